"""Numbers and curves of the explorers, against identities and calculations that are not theirs."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rapkm_lite as rk
from rapkm_lite import explore
from rapkm_lite.explore.shared import curves
from rapkm_lite.lessons.lesson07.tasks import set_points

ROBOT = rk.load().replace(friction=0.0)
OFFSET = 1e-3 * np.array([4.0, -2.0, 5.0])
PRICE = 0.611 / 0.0259**2  # R_el / k_t^2 in W/(N m)^2
NO_OFFSETS = dict.fromkeys(("offset_1", "offset_2", "offset_3"), 0.0)


def said(explorer, name):
    """The numbers in the words beside a name."""
    return np.array([float(v) for v in re.findall(r"(?<![\w²])-?\d+\.?\d*", explorer.numbers[name].replace("−", "-"))])


def marks(explorer, kind, panel, **style):
    """Data (k, 2) of the marks of a kind in a panel that have this style."""
    found = [m for m in explorer.picture.marks if (m.kind, m.panel) == (kind, panel)]
    return [m.data for m in found if all(m.style.get(k) == v for k, v in style.items())]


def curve(explorer, panel):
    """The curves of all drives in a panel, without points and lines across."""
    return [data for data in marks(explorer, "line", panel) if len(data) > 2]


def heights(explorer, panel, **style):
    return np.array([data[2, 1] for data in marks(explorer, "bar", panel, **style)])


def at(x, robot=ROBOT):
    return rk.control_matrix(robot, rk.inverse_kinematics(robot, x))


def area(corners):
    x, y = np.transpose(corners)
    return abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def least_and_prestress(A, c):
    """The part of torques (k, m) in the range of A (k, m, 2), by least squares, and the rest."""
    least = np.stack([M @ np.linalg.lstsq(M, v, rcond=None)[0] for M, v in zip(A, c, strict=True)])
    return least, c - least


def bill(run):
    """Heat of the copper and work of the drives over the holds of a run, J."""
    c = run.c[:-1]
    return np.sum(PRICE * run.dt * c**2 + c * np.diff(run.q_a, axis=0))


@pytest.mark.parametrize("mode", [(1, 1, 1), (1, -1, 1), (-1, 1, 1), (-1, -1, -1)])
def test_every_pixel_of_the_map_stands_at_its_own_place_in_every_mode(mode):
    word = "(" + ", ".join("+" if way > 0 else "−" for way in mode) + ")"
    picture = explore.machine().set(mode=word, drives="all drives").picture
    values, (left, right, low, high), _ = next(m for m in picture.marks if m.kind == "image").words
    rows, columns = values.shape
    for i, j in ((60, 60), (45, 70), (75, 52)):
        x = [left + (j + 0.5) * (right - left) / columns, low + (i + 0.5) * (high - low) / rows]
        A = rk.control_matrix(ROBOT, rk.inverse_kinematics(ROBOT, x, mode))
        assert values[i, j] == pytest.approx(np.linalg.svd(A)[1][1], rel=1e-9)


@pytest.mark.parametrize("times", [0.5, 1, 2])
def test_a_weak_pair_is_told_by_the_angle_between_its_distal_links(times):
    scaled = {name: times * getattr(ROBOT, name) for name in ("base", "lengths", "centers")}
    robot = ROBOT.replace(inertias=times**2 * ROBOT.inertias, **scaled)
    explorer = explore.machine(robot).set(x=94 * times, y=56 * times)
    assert explorer.numbers["end-effector"] == f"({94 * times:.0f}, {56 * times:.0f}) mm"
    q = rk.inverse_kinematics(robot, times * np.array([0.094, 0.056]))
    way = np.degrees(q[:3] + q[3:])
    titles = {m.panel: m.words for m in explorer.picture.marks if m.kind == "title"}
    for panel, (j, k) in zip("abc", rk.drive_pairs(robot), strict=True):
        gap = abs((way[j] - way[k] + 90) % 180 - 90)
        words = re.search(r"(\d+)° from parallel", titles[panel])
        assert (words is not None) == (gap < 25), titles[panel]
        assert words is None or float(words[1]) == round(gap)


def test_a_walk_says_where_it_is_and_which_pair_is_worst():
    explorer, path = explore.actuation().set(place=10), rk.triangle(ROBOT, 0.24, dt=0.01, centre=[0.0, 0.0])
    x = 1e3 * path.x[round(0.1 * (len(path) - 1))]
    assert_allclose(said(explorer, "point"), x, atol=0.51)
    sigma = np.stack([np.linalg.svd(at(path.x)[:, p])[1][:, 1] for p in ([0, 1], [0, 2], [1, 2])], axis=-1)
    pair = ("(1,2)", "(1,3)", "(2,3)")[sigma.min(axis=0).argmin()]
    assert explorer.numbers["worst on this path"] == f"{sigma.min():.3f} rad/m, pair {pair}"
    assert np.ptp(marks(explorer.set(path="circle", size=200), "line", "plane")[0][:, 0]) == pytest.approx(0.2, 1e-3)


def test_more_than_three_drives_have_a_null_space_and_no_null_vector():
    """A null vector n has A^T n = 0; of four drives each has a share, and the squares of the shares add to N - 2."""
    explorer = explore.actuation(rk.load("four_arms"))
    assert "null vector" not in explorer.sentence.lower() and "null vector" in explore.actuation().sentence.lower()
    assert np.sum(said(explorer, "null space") ** 2) == pytest.approx(2.0, abs=0.03)


@pytest.mark.parametrize(
    "name, number",
    [
        ("controller_choice", "energy"),
        ("via_points", "electric energy"),
        ("own_machine", "cost of the offsets, at rest everywhere"),
        ("prestress", "heat without"),
        ("steady_state", "heat at rest"),
        ("three_opinions", "heat at rest"),
    ],
)
def test_gears_that_make_the_same_torques_of_a_thirtieth_of_the_current_take_a_nine_hundredth_of_the_heat(name, number):
    """R (c / k_t)^2: the motion does not know k_t, and a heat that is none of the testbed's is not shown as none."""
    geared = ROBOT.replace(torque_constant=30 * ROBOT.torque_constant)
    direct, less = (said(getattr(explore, name)(robot), number)[-1] for robot in (ROBOT, geared))
    assert less > 0 and direct / less == pytest.approx(900.0, rel=0.05)


def test_areas_of_the_pairs_forces_add_to_that_of_all_drives():
    """McMullen: the area of a zonotope is the sum over the parallelograms of its pairs."""
    *pairs, whole = map(area, marks(explore.actuation().set(place=30, torque=100), "polygon", "force"))
    assert len(pairs) == 3 and sum(pairs) == pytest.approx(whole, rel=1e-9)
    path = rk.triangle(ROBOT, 0.24, dt=0.01, centre=[0.0, 0.0])
    A = 0.1 * at(path.x[round(0.3 * (len(path) - 1))])
    assert pairs[0] == pytest.approx(4 * abs(np.linalg.det(A[:2])), rel=1e-9)


def test_prestress_adds_its_own_heat_and_takes_changes_of_sign_away():
    explorer, path = explore.prestress().set(level=60), rk.triangle(ROBOT, 0.24, dt=0.005, centre=[0.0, 0.0])
    A, c = at(path.x), rk.inverse_dynamics(ROBOT, path.q, path.qd, path.qdd)
    stress = least_and_prestress(A, np.full(c.shape, 0.06))[1]
    for torque, name in ((c, "without"), (c + stress, "with")):
        moved = np.where(np.abs(torque) > 1e-9, torque, np.nan)
        signs = [column[~np.isnan(column)] for column in moved.T]
        count = [np.sum(column[1:] * column[:-1] < 0) for column in signs]
        assert said(explorer, {"without": "changes of sign without", "with": "changes with"}[name]).tolist() == count
        assert said(explorer, f"heat {name}")[0] == pytest.approx(PRICE * 0.005 * np.sum(torque**2), abs=6e-3)
    assert said(explorer, "largest prestress")[0] == round(1e3 * np.abs(stress).max())
    # At rest in the corner the machine needs no torque.
    assert_allclose([data[0, 1] for data in curve(explorer, "without")], 0, atol=1e-6)
    assert_allclose([data[0, 1] for data in curve(explorer, "with")], 1e3 * stress[0], rtol=1e-9)


def test_a_light_machine_changes_its_signs_as_often_as_a_heavy_one():
    """In a horizontal plane without friction all torques go with the masses."""
    light = ROBOT.replace(**{name: 2.0**-24 * getattr(ROBOT, name) for name in ("masses", "inertias", "rotor_inertia")})
    name = "changes of sign without"
    assert explore.prestress(light).numbers[name] == explore.prestress(ROBOT).numbers[name]


def test_every_rule_makes_the_force_and_keeps_what_it_promises():
    explorer, A, f = explore.allocation().set(f_x=0.3, f_y=0.6, limit=90), at([0.0, 0.0]), [0.3, 0.6]
    for rule in ("least size", "least peak", "one sign, 4 mN m at least"):
        torques, plain = (said(explorer.set(rule=rule), name) for name in ("torques", "of least size"))
        for c in (torques, plain):
            assert_allclose(A.T @ (1e-3 * c), f, atol=2e-3)
        assert_allclose(plain, 1e3 * np.linalg.pinv(A.T) @ f, atol=0.051)
        assert_allclose(heights(explorer, "torque", alpha=0.45), plain, atol=0.051)
        assert_allclose(heights(explorer, "torque", alpha=None), torques, atol=0.051)
        if rule == "one sign, 4 mN m at least":
            assert np.abs(torques).min() == 4.0 and abs(np.sign(torques).sum()) == 3
        elif rule == "least peak":  # one drive less than there are stands at the peak
            assert np.abs(torques).max() < np.abs(plain).max() - 0.5
            assert np.ptp(np.sort(np.abs(torques))[1:]) < 0.11
    (inner,) = marks(explorer, "line", "force", linestyle="--")
    assert_allclose(np.abs(inner @ np.linalg.pinv(A)).max(axis=1), 0.09, rtol=1e-9)


@pytest.mark.parametrize("counts", [2000, 20_000])
def test_spread_of_offsets_is_that_of_rounded_readings(counts):
    """Rounding has the variance quantum^2 / 12; the rows of the equations are the null vectors of the places."""
    explorer = explore.calibration().set(radius=100, turn=20, places=6, counts=counts)
    angle = np.radians(20 + 60 * np.arange(6))
    q = rk.inverse_kinematics(ROBOT, 0.1 * np.stack([np.cos(angle), np.sin(angle)], axis=-1))
    n, quantum = rk.null_vector(ROBOT, q), 2 * np.pi / counts
    spread = 1e3 * quantum / np.sqrt(12) * np.sqrt(np.diagonal(np.linalg.inv(n.T @ n)))
    assert_allclose(said(explorer, "standard deviation expected"), spread, rtol=0.03, atol=6e-4)
    assert said(explorer, "condition")[0] == pytest.approx(np.linalg.cond(n), rel=0.03)
    found = rk.calibrate(ROBOT, quantum * np.rint((q[:, :3] + OFFSET) / quantum)).offset
    assert_allclose(said(explorer, "error of the offsets"), 1e3 * (found - OFFSET), atol=6e-4)


@pytest.mark.parametrize("filter", [False, True])
def test_imperfections_are_those_of_the_built_machine_and_the_drawings_law(filter):
    robot = rk.load()
    explorer = explore.imperfections(robot).set(longer=8.0, K_P=14.1, filter=filter, limit=120)
    built = robot.replace(lengths=1.008 * robot.lengths, centers=1.008 * robot.centers)
    path = rk.triangle(robot, 0.12, duration=2.5, dt=2e-3, centre=[0.0, 0.0])
    law = rk.PD(14.1, 0.225 * 2**0.5)  # critical damping: K_D^2 goes with K_P
    law = rk.AntagonismFilter(law) if filter else law
    run = rk.simulate(built, law, path, model=robot, faults=[rk.TorqueLimit(0.12)])
    off = 1e3 * np.linalg.norm(run.x - path.x, axis=1).max()
    assert said(explorer, "farthest from the desired position")[0] == pytest.approx(off, abs=6e-3)
    pressing = least_and_prestress(rk.control_matrix(built, run.q[-1:]), run.c[-1:])[1][0]
    assert_allclose(said(explorer, "torque that only presses, at the end"), 1e3 * pressing, atol=0.051)
    assert said(explorer, "largest torque").tolist() == [round(1e3 * np.abs(run.c).max()), 120]
    assert said(explorer, "electric energy")[0] == pytest.approx(bill(run), abs=6e-3)


def carried():
    """By symmetry both modes of PD in the middle have w^2 = K_P / m, m the equal eigenvalues of (A^T A)^-1 Gbar."""
    A, inertia = at([0.0, 0.0]), rk.minimal_dynamics(ROBOT, rk.inverse_kinematics(ROBOT, [0.0, 0.0]), np.zeros(6), None)
    return np.linalg.eigvals(np.linalg.solve(A.T @ A, inertia[0])).real.mean()


@pytest.mark.parametrize(
    ("name", "law", "coarse"),
    [
        ("computed torque, end-effector", lambda w: rk.CTC(w**2, 2 * w, None), False),
        ("computed torque, switched pair", lambda w: rk.SwitchedCTC(w**2, 2 * w), False),
        ("computed torque, redundant", lambda w: rk.RedundantCTC(w**2, 2 * w), True),
        ("PD", lambda w: rk.PD(carried() * w**2, 2 * carried() * w), False),
        ("PD and filter", lambda w: rk.AntagonismFilter(rk.PD(carried() * w**2, 2 * carried() * w)), False),
    ],
)
def test_laws_to_choose_have_both_poles_at_the_frequency_and_know_no_payload(name, law, coarse):
    explorer = explore.controller_choice().set(law=name, frequency=4.0, load=100, coarse=coarse)
    path = rk.triangle(ROBOT, 0.12, duration=2.5, centre=[0.0, 0.0])
    coarse = {"encoder": 2000, "velocity_filter": 5e-3} if coarse else {}
    run = rk.simulate(ROBOT.replace(load=0.1), law(8 * np.pi), path, OFFSET, model=ROBOT, **coarse)
    error = 1e3 * np.linalg.norm(run.x - path.x, axis=1).max()
    assert said(explorer, "largest error")[0] == pytest.approx(error, abs=6e-3)
    jump = 1e3 * np.abs(run.c[1:] - run.c[:-1]).max()
    assert said(explorer, "largest jump of a torque")[0] == pytest.approx(jump, abs=0.06)
    pressing = least_and_prestress(rk.control_matrix(ROBOT, run.q), run.c)[1][:-1]
    shares = bill(run), PRICE * run.dt * np.sum(pressing**2)
    assert_allclose(said(explorer, "energy"), shares, atol=6e-3)


def test_a_payload_comes_on_top_of_the_load_of_a_machine():
    """A law whose model is the machine, started on its path, makes no error; one of 100 g more is that of a copy."""
    robot = ROBOT.replace(load=0.2, gravity=[0.0, -9.81])
    explorer = explore.controller_choice(robot).set(law="computed torque, end-effector", frequency=4.0, **NO_OFFSETS)
    assert said(explorer, "largest error")[0] <= 0.01
    path, law = rk.triangle(robot, 0.12, duration=2.5, centre=[0.0, 0.0]), rk.CTC((8 * np.pi) ** 2, 16 * np.pi, None)
    run = rk.simulate(robot.replace(load=0.3), law, path, model=robot)
    error = 1e3 * np.linalg.norm(run.x - path.x, axis=1).max()
    assert said(explorer.set(load=100), "largest error")[0] == pytest.approx(error, abs=6e-3)


def test_torques_of_a_machine_of_ones_own():
    explorer = explore.own_machine().set(radius=300, proximal=210, distal=230, load=0.4)
    base = 0.3 * ROBOT.base / np.linalg.norm(ROBOT.base, axis=1, keepdims=True)
    own = ROBOT.replace(
        base=base, lengths=[0.21, 0.23], masses=[0.67 * 0.21, 0.67 * 0.23], centers=None, inertias=None, load=0.4
    )
    path = rk.triangle(own, 0.24, dt=0.02, centre=[0.0, 0.0])
    A, c = at(path.x, own), rk.inverse_dynamics(own, path.q, path.qd, path.qdd)
    assert said(explorer, "largest torque that moves")[0] == round(1e3 * np.abs(c).max())
    # At rest the drives hold what is left of -K_P offset beside the range of A.
    rest = 1e3 * least_and_prestress(A, np.tile(-7.05 * OFFSET, (len(A), 1)))[1]
    assert_allclose(said(explorer, "largest torques that press"), np.abs(rest).max(axis=0), atol=0.51)
    assert_allclose([data[0, 1] for data in curve(explorer, "pressing")], rest[0], atol=1e-6)
    sigma = np.linalg.svd(A)[1][:, 1].min()
    assert said(explorer, "smallest σ_min on the triangle")[-1] == pytest.approx(sigma, abs=6e-3)


def test_bars_of_the_steady_state_are_theory_and_run():
    explorer = explore.steady_state().set(x=40, y=-30, K_P_2=12.0)
    K, offset = np.array([7.05, 12.0, 7.05]), 1e-3 * np.array([5.0, -3.0, 8.0])
    A = at([0.04, -0.03])
    # (14), corrected: of all errors A p that close the loops, the one without a force, A^T K (A p + offset) = 0.
    error = -1e3 * A @ np.linalg.solve(A.T @ (K[:, None] * A), A.T @ (K * offset))
    theory, run = heights(explorer, "rest", alpha=0.45), heights(explorer, "rest", alpha=None)
    assert_allclose(theory, error, atol=1e-9)
    assert_allclose(said(explorer, "simulated"), run, atol=6e-3)
    assert said(explorer, "largest difference")[0] == pytest.approx(1e3 * np.abs(theory - run).max(), abs=0.06)
    dotted = [data[:, 1] for data in marks(explorer, "line", "error", linestyle=":")]
    assert_allclose(dotted, np.stack([error, error], axis=1), atol=1e-9)
    still = rk.hold(ROBOT, [0.04, -0.03], 1.5, 2e-3)
    own = 1e3 * rk.simulate(ROBOT, rk.PD(K, 0.225 * np.sqrt(K / 7.05)), still, offset).error
    drawn = [data[:, 1] for data in marks(explorer, "line", "error") if len(data) > 2]
    assert_allclose([[row.min(), row.max()] for row in drawn], np.stack([own.min(0), own.max(0)], axis=1), rtol=1e-9)
    heat = PRICE * np.sum((1e-3 * heights(explorer, "torque", alpha=None)) ** 2)
    assert said(explorer, "heat at rest")[0] == pytest.approx(heat, abs=6e-4)


def test_drives_that_agree_put_the_end_effector_where_they_agree():
    """Offsets A e are those of a machine that stands e beside; drive i is content where A_i p = -offset_i."""
    A, beside = at([0.02, 0.03]), np.array([1.0, -0.6])
    explorer = explore.three_opinions().set(**{f"offset_{i + 1}": v for i, v in enumerate(A @ beside)})
    assert_allclose(said(explorer, "rest"), -beside, atol=6e-3)
    explorer.reset()
    offset, torque = np.array([5.0, -3.0, 8.0]), heights(explorer, "torque")
    ends = marks(explorer, "line", "opinions", linewidth=6)
    for i, (rest, foot) in enumerate(ends):
        assert A[i] @ foot == pytest.approx(-offset[i], abs=1e-9)
        # What is left of the way costs the torque.
        assert -7.05 * A[i] @ (rest - foot) == pytest.approx(torque[i], abs=1e-9)
    assert said(explorer, "heat at rest")[0] == pytest.approx(PRICE * np.sum((1e-3 * torque) ** 2), abs=6e-4)


def test_level_lines_hold_the_energy_that_is_written_on_them():
    explorer = explore.landscape()
    path = rk.triangle(ROBOT, 0.12, dt=0.01, centre=[0.04, 0.0])
    S = 1e-6 * rk.antagonism_form(ROBOT, path, 7.05)
    lines, offset = [data for data in marks(explorer, "line", "map") if len(data) > 2], np.array([4.0, -2.0, 5.0])
    levels = []
    for line in lines:
        points = np.column_stack([line, np.full(len(line), 5.0)])
        energy = np.einsum("ki,ij,kj->k", points, S, points)
        assert np.ptp(energy) < 1e-9 * energy[0]
        levels.append(energy[0])
    assert_allclose(levels, 2.0 ** np.arange(5 - len(levels), 5), rtol=1e-9)
    for mark in explorer.picture.marks:
        if (mark.kind, mark.panel) == ("label", "map"):
            point = np.append(mark.data[0], 5.0)
            assert float(mark.words) == pytest.approx(point @ S @ point, rel=1e-6)
    assert said(explorer, "trace of S")[0] == pytest.approx(np.trace(S), abs=6e-4)
    assert_allclose(said(explorer, "principal costs"), np.linalg.eigvalsh(S), atol=6e-4)
    shares = heights(explorer, "shares")
    assert shares.sum() == pytest.approx(offset @ S @ offset, rel=1e-9)
    assert_allclose(np.sort(shares), np.sort(np.linalg.eigh(S)[0] * (offset @ np.linalg.eigh(S)[1]) ** 2), atol=1e-9)


@pytest.mark.parametrize(("filter", "row"), [("off", 0), ("force form (16)", 1)])
def test_pale_bars_are_the_measured_ones_of_table_1(filter, row):
    explorer = explore.decentralized_run().set(filter=filter, friction=False)
    assert_allclose(heights(explorer, "energy", alpha=0.4), rk.measured_energies()[row])
    path, offset = rk.triangle(ROBOT, 0.24, centre=[0.0, 0.0]), 1e-3 * np.array([-3.0, -4.0, 7.0])
    law = rk.PD(7.05, 0.225)
    plain = rk.simulate(ROBOT, law, path, offset)
    run = plain if filter == "off" else rk.simulate(ROBOT, rk.AntagonismFilter(law), path, offset)
    assert said(explorer, "largest error")[0] == pytest.approx(1e3 * np.abs(run.q_a - path.q_a).max(), abs=0.06)
    assert_allclose(said(explorer, "torque at the end"), 1e3 * run.c[-1], atol=0.051)
    if filter != "off":
        share = 100 * (plain.energy.sum() - run.energy.sum()) / plain.energy.sum()
        assert said(explorer, "saved by the filter")[0] == round(share)


def test_arrows_of_the_player_are_the_forces_of_its_sample():
    explorer = explore.animation().set(time=2000)
    path = rk.triangle(ROBOT, 0.24, centre=[0.0, 0.0])
    run = rk.simulate(ROBOT, rk.PD(7.05, 0.225), path, OFFSET)
    A, c = rk.control_matrix(ROBOT, run.q[2000]), run.c[2000]
    assert run.t[2000] == pytest.approx(2.0) and explorer.numbers["time"] == "2.00 s"
    assert said(explorer, "force on the end-effector")[0] == pytest.approx(np.linalg.norm(A.T @ c), abs=6e-3)
    sizes = sum(np.linalg.norm(A[i] * c[i]) for i in range(3))
    assert said(explorer, "sizes of the drives' forces, added")[0] == pytest.approx(sizes, abs=6e-3)
    pressing = 1e3 * np.linalg.norm(least_and_prestress(A[None], c[None])[1])
    assert said(explorer, "torque that moves nothing")[0] == pytest.approx(pressing, abs=0.06)
    off = 1e3 * np.linalg.norm(run.x[2000] - path.x[2000])
    assert said(explorer, "path error")[0] == pytest.approx(off, abs=6e-3)
    # 40 ms every 80 ms.
    words = [part.value for box in explorer.widget.children[0].children for part in getattr(box, "children", [])[1:]]
    assert words == ["plays at 0.5 × real time"]


@pytest.mark.parametrize("robot", [ROBOT, rk.load()], ids=["frictionless", "with friction"])
def test_a_late_drive_follows_its_set_points_so_many_milliseconds_later(robot):
    explorer = explore.via_points(robot).set(legs=4, late=6)
    ends = np.array([[-0.12, -0.07], [0.12, -0.07]])
    path = rk.polygon(robot, ends, duration=3.0, dt=2e-3)
    q_a = set_points(robot, path, *ends, np.linspace(0, 1, 5))
    late = np.interp(path.t - 6e-3, path.t, q_a[:, 0])
    run = rk.simulate(
        robot, rk.PD(7.05, 0.225), path.with_set_points(np.column_stack([late, q_a[:, 1:]])), [0.0, 0.0, 0.0]
    )
    pressing = least_and_prestress(rk.control_matrix(robot, run.q), run.c)[1]
    assert said(explorer, "largest torque that only presses")[0] == pytest.approx(
        1e3 * np.abs(pressing).max(), abs=0.06
    )
    assert_allclose(said(explorer, "at the end"), 1e3 * pressing[-1], atol=0.051)
    energy, lost = said(explorer, "electric energy")
    assert energy == pytest.approx(run.energy.sum(), abs=6e-3)
    assert lost == pytest.approx(PRICE * 2e-3 * np.sum(pressing[:-1] ** 2), abs=6e-4)
    off = 1e3 * (run.x - path.x)[: len(path) // 2 + 1]
    assert said(explorer, "farthest from the desired position")[0] == pytest.approx(np.hypot(*off.T).max(), abs=6e-3)
    for data, values in zip(curve(explorer, "way"), off.T, strict=True):
        assert data[:, 1].max() == pytest.approx(values.max()) and data[:, 1].min() == pytest.approx(values.min())


def test_the_three_pairs_are_equally_far_from_their_curves():
    """A third of a turn takes machine, triangle and the curve of each pair to those of the next."""
    explorer, names = explore.computed_torque(), ("fixed pair (1,2)", "fixed pair (1,3)", "fixed pair (2,3)")
    for side in (150, 200, 215):
        runs = [explorer.set(law=name, side=side, **NO_OFFSETS).numbers for name in names]
        assert len({numbers["distance from its singular curve"] for numbers in runs}) == 1


def test_computed_torque_has_both_poles_where_the_slider_says():
    explorer = explore.computed_torque().set(law="redundant coordinates", side=150, rate=30, offset_2=3.0)
    path = rk.triangle(ROBOT, 0.15, centre=[0.0, 0.0])
    run = rk.simulate(ROBOT, rk.RedundantCTC(900.0, 60.0), path, 1e-3 * np.array([1.0, 3.0, 0.5]))
    assert said(explorer, "largest torque")[0] == round(1e3 * np.abs(run.c).max())
    assert said(explorer, "largest error")[0] == pytest.approx(1e3 * np.abs(run.q_a - path.q_a).max(), abs=0.06)
    assert said(explorer, "energy")[-1] == pytest.approx(bill(run), abs=6e-3)


def test_switches_are_counted_by_the_sines_between_the_distal_links():
    """A pair is kept until another one has a sine larger by a fifth."""
    explorer = explore.computed_torque().set(law="switched pair", side=170, **NO_OFFSETS)
    path = rk.triangle(ROBOT, 0.17, centre=[0.0, 0.0])
    way = path.q[:, :3] + path.q[:, 3:]
    sines = np.abs(np.sin([way[:, k] - way[:, j] for j, k in rk.drive_pairs(ROBOT)]))
    used, count = sines[:, 0].argmax(), 0
    for row in sines.T:
        if row.max() > 1.2 * row[used]:
            used, count = row.argmax(), count + 1
    assert count > 1 and explorer.numbers["switches"] == str(count)


def test_distance_from_a_singular_curve_is_where_the_distal_links_turn_past_each_other():
    explorer = explore.computed_torque().set(law="fixed pair (1,2)", side=150, **NO_OFFSETS)
    distance = 1e-3 * said(explorer, "distance from its singular curve")[0]
    x, turn = rk.triangle(ROBOT, 0.15, dt=0.02, centre=[0.0, 0.0]).x, np.linspace(0, 2 * np.pi, 73)
    for times, crossed in ((0.95, False), (1.06, True)):
        around = x[:, None] + times * distance * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        sign = np.sign(rk.distal_cross_products(ROBOT, rk.inverse_kinematics(ROBOT, around))[..., 0])
        assert (np.ptp(sign) > 0) == crossed


def test_a_curve_that_leaves_the_picture_says_how_far_it_goes():
    picture = explore.Picture({"a": {}})
    curves(picture, "a", np.arange(3.0), np.array([[1.0], [-321.0], [5.0]]), 5.0, most=100.0)
    assert picture.ylim("a") == (-100.0, 100.0)
    assert [m.words for m in picture.marks if m.kind == "words"] == ["goes on to −321"]
