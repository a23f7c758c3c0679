"""The 4RRR machine of lesson 12: its matrices against MuJoCo and SymPy, and what the lesson says about it."""

import sys
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import least_squares, minimize_scalar

import rapkm_lite as rk

sp = pytest.importorskip("sympy")

from rapkm_lite.lessons.lesson12 import four_rrr, runs, tasks  # noqa: E402
from rapkm_lite.lessons.lesson12.mechanism import accelerations, derive  # noqa: E402
from rapkm_lite.machine.arguments import matvec  # noqa: E402

OFFSET = np.array([4e-3, -2e-3, 5e-3, -3e-3])
DRIVEN = np.r_[np.ones(4), np.zeros(5)]
DEGREES = np.r_[np.ones(8), np.degrees(1.0)]


@cache
def machine():
    return four_rrr.four_rrr()


def poses(k, box=(0.15, 0.15, 0.3), seed=5):
    return np.random.default_rng(seed).uniform(-np.array(box), box, (k, 3))


def A_tilde(pose):
    return rk.projector(machine().J(four_rrr.angles(pose)))[..., :4, :]


def test_without_sympy_a_sentence_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "sympy", None)
    with pytest.raises(ImportError, match="python -m pip install sympy"):
        four_rrr.symbols()


# The matrices.
def test_derived_matrices_obey_mechanics():
    """J is dh/dq; dJ/dt and dG/dt by differences; dG/dt - 2 C is skew, as Christoffel symbols make it."""
    rng = np.random.default_rng(2)
    q, qd, step = rng.uniform(-3, 3, (50, 9)), rng.normal(size=(50, 9)), 1e-6
    J, J_dot, G, C, Q = machine().terms(q, qd)
    after, before = (machine().terms(q + s * step * qd, qd) for s in (1, -1))
    assert_allclose(matvec(J, qd), (machine().h(q + step * qd) - machine().h(q - step * qd)) / (2 * step), atol=1e-8)
    assert_allclose(J_dot, (after[0] - before[0]) / (2 * step), atol=1e-8)
    S = (after[2] - before[2]) / (2 * step) - 2 * C
    assert_allclose(S + S.mT, 0, atol=1e-8)
    assert np.linalg.eigvalsh(G).min() > 0 and not Q.any()


def test_a_machine_of_the_package_is_derived_to_its_own_matrices():
    robot = rk.load("asymmetric").replace(friction=0.0, load=0.0)
    q, qd = sp.symbols("a1:4 b1:4"), sp.symbols("ad1:4 bd1:4")
    tips, T = [], 0
    for i in range(3):
        (l1, l2), (m1, m2), (c1, c2), (i1, i2) = robot.lengths[i], robot.masses[i], robot.centers[i], robot.inertias[i]
        upper = sp.Matrix([sp.cos(q[i]), sp.sin(q[i])])
        lower = sp.Matrix([sp.cos(q[i] + q[3 + i]), sp.sin(q[i] + q[3 + i])])
        for m, point in ((m1, c1 * upper), (m2, l1 * upper + c2 * lower)):
            rate = point.jacobian(q) * sp.Matrix(qd)
            T += m * rate.dot(rate) / 2
        T += (i1 + robot.rotor_inertia[i]) * qd[i] ** 2 / 2 + i2 * (qd[i] + qd[3 + i]) ** 2 / 2
        tips.append(sp.Matrix(robot.base[i]) + l1 * upper + l2 * lower)
    mine = derive(q, qd, [*(tips[0] - tips[1]), *(tips[2] - tips[1])], T, m=3)
    at, rates = rk.inverse_kinematics(robot, [0.02, 0.01]), np.random.default_rng(3).normal(size=6)
    same = rk.constraint_jacobian, rk.mass_matrix
    J, J_dot, G, C, _ = mine.terms(at, rates)
    for got, function in zip((J, G), same, strict=True):
        assert_allclose(got, function(robot, at), atol=1e-12)
    assert_allclose(J_dot, rk.constraint_jacobian_dot(robot, at, rates), atol=1e-12)
    assert_allclose(C @ rates, rk.coriolis_matrix(robot, at, rates) @ rates, atol=1e-12)


def mjcf():
    """The machine body by body, written for MuJoCo from the numbers alone."""
    rod = lambda m, long: (  # noqa: E731
        f'<inertial pos="{long / 2} 0 0" mass="{m}" diaginertia="{3 * f"{m * long**2 / 12} "}"/>'
    )
    length, (m1, m2) = four_rrr.LINK, four_rrr.ROD_MASSES
    x, y = -four_rrr.PLATFORM[0]
    legs = ""
    for i, (bx, by) in enumerate(four_rrr.BASE):
        plate = (
            f'<body pos="{length} 0 0"><joint name="p0" axis="0 0 1"/><inertial pos="{x} {y} 0" '
            f'mass="{four_rrr.PLATFORM_MASS}" diaginertia="{3 * f"{four_rrr.PLATFORM_INERTIA} "}"/>'
            + "".join(f'<site name="c{k}" pos="{x + u} {y + v} 0"/>' for k, (u, v) in enumerate(four_rrr.PLATFORM))
            + "</body>"
        )
        legs += (
            f'<body pos="{bx} {by} 0"><joint name="b{i}" axis="0 0 1" armature="{four_rrr.ROTOR}"/>{rod(m1, length)}'
            f'<body pos="{length} 0 0"><joint name="e{i}" axis="0 0 1"/>{rod(m2, length)}'
            f'<site name="t{i}" pos="{length} 0 0"/>'
            f"{plate if i == 0 else ''}</body></body>"
        )
    return f'<mujoco><compiler angle="radian"/><option gravity="0 0 0"/><worldbody>{legs}</worldbody></mujoco>'


def test_matrices_agree_with_mujoco():
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install -e .[oracles]")
    model = mujoco.MjModel.from_xml_string(mjcf())
    state = mujoco.MjData(model)
    names = [f"b{i}" for i in range(4)] + [f"e{i}" for i in range(4)] + ["p0"]
    order = [model.joint(name).dofadr[0] for name in names]
    q = four_rrr.angles(poses(20))
    qd = np.random.default_rng(4).normal(size=(20, 9))
    J, _, G, C, _ = machine().terms(q, qd)
    for k in range(20):
        state.qpos[order], state.qvel[order] = q[k], qd[k]
        mujoco.mj_forward(model, state)
        theirs = np.zeros((9, 9))
        for row, unit in zip(theirs, np.eye(9), strict=True):
            mujoco.mj_mulM(model, state, row, unit)
        assert_allclose(theirs[np.ix_(order, order)], G[k], atol=1e-12)
        assert_allclose(state.qfrc_bias[order], C[k] @ qd[k], atol=1e-12 * (1 + np.abs(C[k] @ qd[k]).max()))
        rows = []
        for i in (1, 2, 3):
            tip, corner = np.zeros((2, 3, 9))
            mujoco.mj_jacSite(model, state, tip, None, model.site(f"t{i}").id)
            mujoco.mj_jacSite(model, state, corner, None, model.site(f"c{i}").id)
            rows.append((tip - corner)[:2, order])
        assert_allclose(np.vstack(rows), J[k], atol=1e-12)


def test_poses_and_angles_are_inverse_and_closed():
    at = poses(200)
    q = four_rrr.angles(at)
    assert np.abs(machine().h(q)).max() < 1e-14
    assert_allclose(four_rrr.poses(q), at, atol=1e-14)
    assert_allclose(four_rrr.legs(q)[:, :, 2], four_rrr.corners(at), atol=1e-14)
    with pytest.raises(ValueError, match="leg 1"):
        four_rrr.angles([0.3, 0.3, 0.0])


def test_a_machine_of_other_sizes_closes_where_its_angles_say(monkeypatch):
    """The lesson invites to change the numbers: h is zero in every pose, and leg 1 tells the pose it was made from."""
    monkeypatch.setattr(four_rrr, "BASE", np.array([[-0.5, -0.4], [0.6, -0.45], [0.4, 0.5], [-0.55, 0.6]]))
    monkeypatch.setattr(four_rrr, "PLATFORM", np.array([[-0.12, -0.08], [0.1, -0.1], [0.13, 0.09], [-0.11, 0.07]]))
    monkeypatch.setattr(four_rrr, "LINK", 0.5)
    q, _, h, _, _ = four_rrr.symbols()
    at = poses(20)
    assert_allclose(four_rrr.poses(four_rrr.angles(at)), at, atol=1e-14)
    loops = sp.lambdify([q], h)
    assert_allclose([loops(angles) for angles in four_rrr.angles(at)], 0, atol=1e-14)


def test_the_motion_is_consistent():
    motion = four_rrr.swing(dt=1e-3)
    J, J_dot, *_ = machine().terms(motion.q, motion.qd)
    assert np.abs(matvec(J, motion.qd)).max() < 1e-12
    assert np.abs(matvec(J, motion.qdd) + matvec(J_dot, motion.qd)).max() < 1e-11
    # Differences of second order: dt^2 / 6 times the third derivative.
    inner = slice(2, -2)
    assert_allclose(np.gradient(motion.q, 1e-3, axis=0)[inner], motion.qd[inner], atol=2e-5)
    assert_allclose(np.gradient(motion.qd, 1e-3, axis=0)[inner], motion.qdd[inner], atol=1e-4)


def test_a_swing_ends_at_rest_whatever_its_times():
    """Samples that miss the end would leave the machine in motion."""
    assert np.abs(four_rrr.swing(duration=3.0, dt=0.1).qd[-1]).max() < 1e-12
    with pytest.raises(ValueError, match=r"dt = 0\.3 s; allowed: a whole fraction of duration = 4 s"):
        four_rrr.swing(dt=0.3)


def test_accelerations_keep_the_loops_and_the_energy():
    """Without torques the kinetic energy of a run stays, to the fourth order of the step."""
    q = four_rrr.angles(np.array([[0.05, 0.02, 0.1]]))
    F = rk.complement(machine().J(q), (0, 1, 2))
    qd = matvec(F, np.array([0.5, -0.3, 0.4]))
    energy = lambda q, qd: float(np.squeeze(qd[:, None] @ machine().terms(q, qd)[2] @ qd[..., None]))  # noqa: E731
    start = energy(q, qd)
    for _ in range(50):
        q, qd = runs._hold(machine(), q, qd, np.zeros((1, 4)), 1e-3)
    assert abs(energy(q, qd) / start - 1) < 1e-9 and np.abs(machine().h(q)).max() < 1e-10
    J, J_dot, *_ = machine().terms(q, qd)
    assert np.abs(matvec(J, accelerations(machine(), q, qd, np.ones((1, 4)))) + matvec(J_dot, qd)).max() < 1e-11


def test_a_mechanism_with_a_potential_falls_as_a_pendulum():
    """By hand, for the mass 1 on a circle of radius 1: g downwards along it, and the square of the rate inwards."""
    (x, y), (xd, yd) = q, qd = sp.symbols("x y"), sp.symbols("xd yd")
    mine = derive(q, qd, [x**2 + y**2 - 1], (xd**2 + yd**2) / 2, m=1, U=9.81 * y)
    angle, rate, push = 0.7, 1.3, 2.0  # the angle from below; the drive pushes along x
    out, along = np.array([[np.sin(angle), -np.cos(angle)], [np.cos(angle), np.sin(angle)]])
    found = accelerations(mine, out, rate * along, np.array([push]))
    wanted = (push * np.cos(angle) - 9.81 * np.sin(angle)) * along - rate**2 * out
    assert_allclose(found, wanted, atol=1e-12)


def test_electric_energy_is_heat_and_the_work_that_is_done():
    """Two holds of 0.5 s: 2 W of heat with 1 N m over 1 rad, then with -1 N m over 0.25 rad."""
    q, c = np.array([[0.0], [1.0], [1.25]]), np.array([[1.0], [-1.0], [9.0]])
    assert runs.electric_energy(q, c, 0.5, 2.0, 1.0) == pytest.approx(2.0 + 1.0 - 0.25)


# What the lesson predicts.
def test_null_vector_and_fight_in_the_centre():
    """By symmetry: a quarter turn maps the machine onto itself, so the null vector is an eigenvector of the shift."""
    J = machine().J(four_rrr.angles([0.0, 0.0, 0.0]))
    n = rk.null_basis(rk.complement(J, (0, 1, 2))[:4])[:, 0]
    assert_allclose(n * np.sign(n[0]), np.array([1, -1, 1, -1]) / 2, atol=1e-15)
    c = tasks.fight(J, 4, 40.0, OFFSET)
    assert np.linalg.norm(c) == pytest.approx(0.28, abs=1e-12)


def test_the_fight_is_what_stays_at_rest():
    """A step towards rest leaves no force: A~^T c = 0, and the error solves A~^T K_P (e + offset) = 0 in (13)."""
    J = machine().J(four_rrr.angles([0.05, 0.03, 0.1]))
    A = rk.complement(J, (0, 1, 2))[:4]
    assert_allclose(tasks.fight(J, 4, 40.0, OFFSET), rk.steady_state_torque(A, 40.0, OFFSET), atol=1e-14)


def test_filter_leaves_rounding_only():
    J = machine().J(four_rrr.angles(poses(300)))
    A = rk.complement(J, (0, 1, 2))[:, :4]
    c = np.random.default_rng(1).normal(size=(300, 4))
    left = matvec(rk.prestress_projector(A), matvec(rk.antagonism_filter(A), c))
    assert np.all(np.linalg.norm(left, axis=1) <= 5e-15 * np.linalg.norm(c, axis=1))


def test_one_common_sign_is_rare():
    """2 % of what the legs reach of the box, any platform angle up to a quarter turn; none where the lesson moves."""
    at = poses(30_000, (0.2, 0.2, np.pi / 2))
    reach = np.linalg.norm(four_rrr.corners(at) - four_rrr.BASE, axis=-1).max(axis=-1) < 2 * four_rrr.LINK
    share = [np.mean(one_sign(at[reach])), one_sign(poses(5000, (0.14, 0.14, 0.3))).sum()]
    # Standard deviation of the count: below 0.1 %.
    assert share[0] == pytest.approx(0.02, abs=0.006) and share[1] == 0


def test_common_sign_of_one_null_direction_is_that_of_the_null_vector():
    at = poses(4000, (0.2, 0.2, np.pi / 2))
    at = at[np.linalg.norm(four_rrr.corners(at) - four_rrr.BASE, axis=-1).max(axis=-1) < 2 * four_rrr.LINK]
    A = rk.complement(machine().J(four_rrr.angles(at)), (0, 1, 2))[:, :4]
    possible = rk.common_sign(A)
    assert np.array_equal(possible, one_sign(at)) and possible.any()


def one_sign(at):
    n = np.linalg.svd(A_tilde(at))[0][..., 3]
    return np.abs(np.sign(n).sum(axis=-1)) == 4


def test_apex_where_all_distal_lines_meet():
    """Geometry: the line of leg 1 passes through the centre, (corner - elbow) x corner = 0."""

    def weakest(angle):
        return np.linalg.svd(A_tilde([0.0, 0.0, angle]))[1][2]

    apex = minimize_scalar(weakest, bounds=(0.5, 0.7), method="bounded", options={"xatol": 1e-10}).x
    assert apex == pytest.approx(0.59724, abs=5e-6) and weakest(apex) < 1e-8
    _, elbow, corner = np.moveaxis(four_rrr.legs(four_rrr.angles([0.0, 0.0, apex])), -2, 0)
    assert_allclose((corner - elbow)[:, 0] * corner[:, 1] - (corner - elbow)[:, 1] * corner[:, 0], 0, atol=1e-8)


def test_no_singularity_up_to_045_and_one_in_the_other_mode():
    sigma = np.linalg.svd(A_tilde(poses(5000, (0.14, 0.14, 0.45))), compute_uv=False)
    assert sigma[:, 2].min() > 0.02
    mixed = machine().J(four_rrr.angles([0.0, 0.0, 0.0], mode=(1, -1, 1, -1)))
    assert np.linalg.svd(rk.projector(mixed)[:4])[1][2] < 1e-12


@pytest.mark.parametrize(
    ("shift", "near"),
    [((0.05, 0.0), (-0.22, -0.02)), ((0.0, 0.1), (-0.17, -0.03)), ((-0.15, 0.05), (-0.05, -0.11))],
)
def test_a_fourth_leg_mounted_differently_moves_the_singular_poses_and_leaves_a_curve(monkeypatch, shift, near):
    """Distal lines of four legs through one point: two conditions on x, y, alpha.  One more leg, one condition more."""
    monkeypatch.setattr(four_rrr, "BASE", four_rrr.BASE + [[0, 0], [0, 0], [0, 0], shift])

    def lines(pose):
        """Direction and moment about the centre, over 0.1 m, of the distal links (4, 3)."""
        elbow, corner = four_rrr.legs(four_rrr.angles(pose))[:, 1:].swapaxes(0, 1)
        (x, y), (u, v) = (corner - pose[:2]).T, (corner - elbow).T / four_rrr.LINK
        return np.stack([u, v, (x * v - y * u) / 0.1], axis=-1)

    def apart(place, angle):
        of = lines(np.array([*place, angle]))
        return [np.linalg.det(np.delete(of, leg, axis=0)) for leg in range(4)]

    places = []
    for angle in (0.52, 0.525, 0.53):
        places.append(least_squares(apart, near, args=(angle,), xtol=1e-15, ftol=1e-15, gtol=1e-15).x)
        sigma = np.linalg.svd(lines(np.array([*places[-1], angle])))[1]
        assert sigma[2] < 1e-9 and sigma[1] > 0.5
    assert np.linalg.norm(np.diff(places, axis=0), axis=1).max() < 0.05


def test_default_cut_off_blows_up_and_the_rank_does_not():
    """The fourth singular value is rounding, of the size of the default cut-off: where it lies above, it is inverted.

    How often that is, 60 % of the poses in the reference, is a matter of the libraries; that it happens is enough.
    """
    J = machine().J(four_rrr.angles(poses(2000)))
    printed = (np.eye(9) - np.linalg.pinv(J) @ J)[:, :4]
    wild = np.abs(np.linalg.pinv(printed.mT)).max(axis=(1, 2)) > 1e6
    sigma = np.linalg.svd(printed.mT, full_matrices=False)[1]
    assert wild.any()
    np.testing.assert_array_equal(wild, sigma[:, 3] > 1e-15 * sigma[:, 0])
    A = rk.projector(J)[:, :4]
    truth = np.linalg.pinv(A.mT, rcond=1e-9)
    assert_allclose(rk.explicit_pseudoinverse(A, rk.select_independent(A, delta=3)), truth, atol=1e-11)


def test_a_condition_number_needs_a_length():
    """In the centre: A = (c d_i, -c r) with unit d_i, so the condition number is 1 at L = sqrt(2) * 0.1 m."""
    loops, pose = four_rrr.with_pose(), np.zeros(3)
    A = rk.complement(loops.J(np.r_[four_rrr.angles(pose), pose]), (9, 10, 11))[:4]
    assert_allclose(A, [[0, 2.5, -0.25], [-2.5, 0, -0.25], [0, -2.5, -0.25], [2.5, 0, -0.25]], atol=1e-14)
    condition = [np.linalg.cond(A / [1, 1, L]) for L in (0.1 * 2**0.5, 1.0, 1e-3)]
    assert_allclose(condition, [1.0, 10 / 2**0.5, 100 * 2**0.5], rtol=1e-12)
    assert_allclose(rk.antagonism_filter(A / [1, 1, 1e-3]), rk.antagonism_filter(A), atol=1e-14)
    # The condition ranks poses by the length, the manipulability, det(A^T A)^(1/2), does not.
    pose[2] = 0.3
    turned = rk.complement(loops.J(np.r_[four_rrr.angles(pose), pose]), (9, 10, 11))[:4]
    better, wider = [], []
    for L in (0.1, 0.1 * 2**0.5, 1e-3):
        scaled = [of / [1, 1, L] for of in (A, turned)]
        better.append(bool(np.linalg.cond(scaled[1]) < np.linalg.cond(scaled[0])))
        wider.append(np.prod([np.linalg.svd(of)[1] for of in scaled], axis=1))
    assert better == [True, False, True]
    assert_allclose([one / two for one, two in wider], wider[0][0] / wider[0][1], rtol=1e-9)


@pytest.mark.parametrize(("link", "length"), [(0.4, 0.1 * 2**0.5), (0.5, 0.165)])
def test_the_length_of_condition_1_is_that_of_the_corner_for_elbows_at_right_angles_only(monkeypatch, link, length):
    """A^T A = c^2 diag(2, 2, 4 (lever / L)^2) in the centre; sqrt(2) lever = sqrt(2) r sin(elbow / 2)."""
    monkeypatch.setattr(four_rrr, "LINK", link)
    q = four_rrr.angles(np.zeros(3))
    _, elbow, corner = np.moveaxis(four_rrr.legs(q), -2, 0)
    along = (corner - elbow) / link
    lever = corner[:, 0] * along[:, 1] - corner[:, 1] * along[:, 0]
    assert np.linalg.cond(np.column_stack([along, lever / (2**0.5 * np.abs(lever[0]))])) == pytest.approx(1.0)
    assert 2**0.5 * np.abs(lever) == pytest.approx(0.2 * np.sin(q[4:8] / 2))
    assert 2**0.5 * np.abs(lever) == pytest.approx(length, abs=5e-4)


def feedback(q, v, scale, line=1):
    """(32) for v, all of it in a colleague's units q' = scale q; drives in ours, so the torques compare."""
    J, _, G, _, _ = machine().terms(q, 0 * q)
    G = G / scale[:, None] / scale
    N = rk.projector(J / scale)
    pinv = rk.explicit_pseudoinverse(N[:4], rk.select_independent(N[:4], delta=3))
    return pinv @ (N @ G @ (N if line == 1 else np.eye(9)) @ (scale * v))


def test_feedback_feels_the_units_and_feed_forward_does_not():
    motion = four_rrr.swing(dt=4e-3)
    change = []
    for q, qd, qdd in zip(motion.q[::20], motion.qd[::20], motion.qdd[::20], strict=True):
        J, J_dot, G, _, _ = machine().terms(q, qd)
        N = rk.projector(J)
        tangent, error = qdd - rk.projector_dot(J, J_dot) @ qd, np.r_[OFFSET, np.zeros(5)]
        for v, line in ((tangent, 1), (error, 1), (error, 2)):
            mine, theirs = feedback(q, v, np.ones(9), line), feedback(q, v, DEGREES, line)
            change.append(np.linalg.norm(theirs - mine) / max(np.linalg.norm(mine), 1e-6))
        # The lesson's short form: only the projector before v matters.
        pinv = rk.explicit_pseudoinverse(N[:4], rk.select_independent(N[:4], delta=3))
        assert_allclose(pinv @ G @ tasks.in_units(J, DEGREES) @ error, feedback(q, error, DEGREES), atol=1e-14)
    forward, back, second = np.array(change).reshape(-1, 3).T
    assert forward.max() < 1e-9 and second.max() < 1e-9
    # Reference: 48 %, which is the change at the pose of the other tests; along the circle it is more or less.
    q, error = four_rrr.angles([0.05, 0.03, 0.1]), np.r_[OFFSET, np.zeros(5)]
    mine, theirs = feedback(q, error, np.ones(9)), feedback(q, error, DEGREES)
    assert np.linalg.norm(theirs - mine) / np.linalg.norm(mine) == pytest.approx(0.48, abs=0.005)
    assert back.min() < 0.48 < back.max()


def test_units_reach_32_and_not_the_feed_forward_nor_28_with_the_gains_29():
    """N q'' + N' q' = q'' for every projector onto the tangent space; (A~^T)^+ K e = R K_a e_a has drives only."""
    motion, K = four_rrr.swing(dt=4e-3), np.diag(DRIVEN)
    q, qd, qdd = motion.q[300], motion.qd[300], motion.qdd[300]
    J, J_dot, G, _, _ = machine().terms(q, qd)
    error = np.r_[OFFSET, np.random.default_rng(0).normal(0, 3e-3, 5)]
    first, by_28, by_32 = [], [], []
    for scale in (np.ones(9), DEGREES):
        N, N_dot = rk.projector(J / scale), rk.projector_dot(J / scale, J_dot / scale)
        first.append((N @ (scale * qdd)) / scale)
        assert_allclose(first[-1] + N_dot @ (scale * qd) / scale, qdd, atol=1e-12)
        pinv = np.linalg.pinv(N[:4].T, 1e-9)
        by_28.append(pinv @ K @ (scale * error))
        by_32.append(pinv @ N @ (G / scale[:, None] / scale) @ N @ K @ (scale * error))
    assert np.abs(first[1] - first[0]).max() > 0.03
    A = rk.complement(J, (0, 1, 2))[:4]
    assert_allclose(by_28, [A @ np.linalg.pinv(A) @ OFFSET] * 2, atol=1e-12)
    assert np.linalg.norm(by_32[1] - by_32[0]) > 0.1 * np.linalg.norm(by_32[0])


def test_effective_gains_of_29_along_the_circle():
    F = rk.complement(machine().J(four_rrr.swing(dt=2e-3).q), (0, 1, 2))
    lowest = np.linalg.eigvals(rk.effective_gain(F, np.diag(DRIVEN))).real.min(axis=-1)
    assert lowest.min() == pytest.approx(0.032, abs=5e-4) and lowest.max() == pytest.approx(0.178, abs=6e-4)


def pd(z):
    return -40 * (z.q_a - z.q_d[:4]) - 4 * (z.qd_a - z.qd_d[:4])


def filtered(z):
    return rk.antagonism_filter(rk.complement(machine().J(z.fit), (0, 1, 2))[:4]) @ pd(z)


def redundant_ctc(gains, read):
    def law(z):
        q = read(z)
        J, J_dot, G, C, _ = machine().terms(q, z.qd)
        N = rk.projector(J)
        G, C, _ = rk.redundant_terms(N, rk.projector_dot(J, J_dot), G, C, np.zeros(9))
        v = z.qdd_d - 40 * gains * (z.qd - z.qd_d) - 400 * gains * (q - z.q_d)
        pinv = rk.explicit_pseudoinverse(N[:4], rk.select_independent(N[:4], delta=3))
        return pinv @ (G @ v + C @ z.qd)

    return law


def test_a_circle_with_a_swing():
    """Values of an independent simulation, to their last digit; Pythagoras for what the filter saves."""
    motion = four_rrr.swing(dt=2e-3)
    read = (lambda z: z.q), (lambda z: z.fit)
    laws = [pd, filtered, redundant_ctc(DRIVEN, read[0]), redundant_ctc(np.ones(9), read[0])]
    q, c = runs.run(machine(), [*laws, redundant_ctc(np.ones(9), read[1])], motion, OFFSET)
    assert np.abs(machine().h(q)).max() < 1e-9
    off = np.linalg.norm((four_rrr.poses(q) - motion.pose)[..., :2], axis=-1)
    energy = runs.electric_energy(q, c, 2e-3, four_rrr.RESISTANCE, four_rrr.TORQUE_CONSTANT)
    error = 1e3 * np.sqrt(np.mean(off**2, axis=1))
    assert_allclose(error[:4], [1.81, 1.81, 0.41, 0.11], atol=6e-3)
    assert_allclose(energy[:4], [35.2, 16.6, 15.3, 15.2], atol=0.06)
    # Encoders at the drives only: what all gains then see is the same four offsets.
    assert 0.3 < error[4] < 0.45
    A = rk.complement(machine().J(q[0]), (0, 1, 2))[:, :4]
    pressed = matvec(rk.prestress_projector(A), c[0])
    saved = 60 * np.sum(pressed[:-1] ** 2) * 2e-3
    assert energy[0] - energy[1] == pytest.approx(saved, rel=5e-3)
