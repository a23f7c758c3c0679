"""Curves of the figures carry the numbers that their labels say: in their units, of the right drive, in their place.

What is drawn is compared with what was given, times the factor of the unit, or with a calculation that is not theirs.
"""

import itertools
import re

import matplotlib
import numpy as np
import pytest
from matplotlib.colors import to_hex
from numpy.testing import assert_allclose

import rapkm_lite as rk
from rapkm_lite import explore, plotting

matplotlib.use("Agg")
import matplotlib.pyplot as plt

ROBOT = rk.load().replace(friction=0.0)
OFFSET = np.array([4e-3, -2e-3, 5e-3])
PATH = rk.triangle(ROBOT, dt=5e-3)
RUN = rk.simulate(ROBOT, rk.PD(7.05, 0.225), PATH, OFFSET)
T = np.linspace(0.0, 2.0, 101)


def pose(x, robot=ROBOT, mode=None):
    return rk.inverse_kinematics(robot, x, mode)


def xy(line):
    return np.column_stack(line.get_data())


def named(ax):
    """The lines of an axis by their label."""
    return {line.get_label(): line for line in ax.lines if not line.get_label().startswith("_")}


def y_of(ax, label):
    return np.asarray(named(ax)[label].get_ydata())


def seen(ax, what):
    """The lines of one colour that are no points."""
    return [line for line in ax.lines if to_hex(line.get_color()) == to_hex(what) and len(line.get_xdata()) > 2]


# Machines.
def test_names_of_gaps_are_their_lengths():
    q = pose([0.02, 0.05]) + [0.0, 0.0, 0.3, 0.0, 0.0, 0.0]
    words = [text.get_text() for text in plotting.plot_cut_tree(ROBOT, q).get_legend().get_texts()]
    # Arm 3, turned about its base, carries its tip along a chord.
    chord = 2e3 * np.linalg.norm(ROBOT.base[2] - [0.02, 0.05]) * np.sin(0.15)
    assert words == ["arm 2 to arm 1: 0.0 mm", f"arm 2 to arm 3: {chord:.1f} mm"]


def test_an_arc_ends_on_the_link_whose_angle_it_names():
    q = pose([0.02, 0.05])
    arcs = [xy(line) for line in plotting.plot_joint_angles(ROBOT, q).lines if len(line.get_xdata()) == 40]
    assert len(arcs) == 6
    for k, arc in enumerate(arcs):
        i, elbow = divmod(k, 2)
        centre = ROBOT.base[i] + elbow * 0.2 * np.array([np.cos(q[i]), np.sin(q[i])])
        outer = [0.02, 0.05] if elbow else ROBOT.base[i] + 0.2 * np.array([np.cos(q[i]), np.sin(q[i])])
        way, link = arc[-1] - centre, outer - centre
        assert way @ link == pytest.approx(np.linalg.norm(way) * np.linalg.norm(link), rel=1e-9)


def test_arrows_of_forces_have_the_length_that_was_asked_for():
    forces = np.array([[0.5, 0.0], [0.0, 0.2], [-0.1, -0.1]])
    ax = plotting.plot_pin_forces(ROBOT, pose([0.02, 0.05]), forces, newton_per_metre=5.0)
    ways = np.array([text.xy for text in ax.texts]) - [0.02, 0.05]
    assert_allclose(5.0 * ways, forces, atol=1e-12)


def test_names_of_drives_stand_away_from_their_links():
    q = pose([0.02, 0.05])
    for i, text in enumerate(plotting.plot_machine(ROBOT, q).texts):
        assert np.dot(text.xyann, [np.cos(q[i]), np.sin(q[i])]) < 0


def test_distal_lines_are_prolonged_beyond_the_platform():
    ax = plotting.plot_four_legs([0.05, 0.0, 0.2], lines=True)
    ends = [xy(line) for line in ax.lines if line.get_linestyle() == ":"]
    corners = np.array([line[0] for line in ends])
    # Away from the elbow: the four of them meet inside, or pass through, the platform.
    assert all(np.linalg.norm(b - corners.mean(axis=0)) < np.linalg.norm(a - b) for a, b in ends)
    elbows = [xy(line)[0] for line in ax.lines if line.get_marker() == "o" and len(line.get_xdata()) == 2]
    for (corner, end), elbow in zip(ends, elbows, strict=True):
        assert (corner - elbow) @ (end - corner) > 0


def test_links_that_are_parallel_are_counted_from_one():
    labels = [*named(plotting.plot_pair_curves(ROBOT, n=41))]
    assert labels == ["links 1 and 2 parallel", "links 1 and 3 parallel", "links 2 and 3 parallel"]


@pytest.mark.parametrize("pair", [(1, 0), [0, 1], np.array([1, 0]), np.array([0, 1])])
def test_a_pair_is_the_same_in_either_order_as_a_list_and_as_an_array(pair):
    """As `drive_pairs` writes it, (0, 1)."""
    (curve,) = plotting.plot_pair_curves(ROBOT, pairs=[pair], n=41).get_legend_handles_labels()[1]
    assert curve == "links 1 and 2 parallel"
    (wanted,) = plotting.plot_pair_curves(ROBOT, pairs=[(0, 1)], n=41).collections
    (drawn,) = plotting.plot_pair_curves(ROBOT, pairs=np.array([pair]), n=41).collections
    np.testing.assert_array_equal(drawn.get_paths()[0].vertices, wanted.get_paths()[0].vertices)
    assert plotting.pair_line(rk.load("four_arms"), pair) == plotting.pair_line(rk.load("four_arms"), (0, 1))
    at = [axes[0].lines for axes in (plotting.plot_torques_and_errors(RUN, pair=p) for p in (pair, (0, 1)))]
    assert len(at[0]) == len(at[1])


@pytest.mark.parametrize(
    ("least", "most", "extend"),
    [(None, 0.5, "max"), (0.0, 2.0, "neither"), (None, None, "neither"), (0.15, 2.0, "min"), (0.15, 0.5, "both")],
)
def test_a_scale_is_pointed_where_values_lie_beyond(least, most, extend):
    ax = plotting.plot_map([0.0, 1.0], [0.0, 1.0], np.ma.array([[0.1, 0.2], [0.3, 1.0]]), vmin=least, vmax=most)
    assert ax.collections[0].colorbar.extend == extend


@pytest.mark.parametrize("name", ["five_bar", "testbed", "four_arms"])
def test_two_five_bars_share_drive_2(name):
    """As the docstrings say: pairs (1,2) and (2,3), once each; two arms have one pair."""
    robot = rk.load(name)
    x, count = np.array([0.0, 0.06]), min(robot.n_arms - 1, 2)
    ends = x - [0.02, 0.0], x + [0.02, 0.0]
    plots = (
        plotting.plot_five_bar_curves(robot, *ends)[0],
        plotting.plot_joint_moves(robot, *ends, [0.1], [0.01], 5e-3)[0],
    )
    plots += (plotting.plot_synchronization(robot, x, np.full(robot.n_arms, 1e-3))[0],)
    for ax in plots:
        said = [text.get_text() for text in ax.get_legend().get_texts() if "drives" in text.get_text()]
        assert [re.findall(r"\d", words) for words in said] == [["1", "2"], ["2", "3"]][:count]


@pytest.mark.parametrize("times", [0.1, 10.0])
def test_scales_of_forces_and_room_for_words_go_with_the_size_of_a_machine(times):
    """Forces of equal torques go with one over the length."""
    other = ROBOT.replace(base=times * ROBOT.base, lengths=times * ROBOT.lengths, centers=times * ROBOT.centers)

    def seen(robot, size):
        def radius(A, torque):
            return torque * np.linalg.svd(A)[1][-1]

        q = rk.inverse_kinematics(robot, [0.0, 0.0])
        whole = plotting.plot_guaranteed_force(robot, {"": q}, radius, n=9)[-1].collections[0].get_clim()[1]
        ends = size * np.array([[-0.05, 0.0], [0.05, 0.0]])
        return size * whole, np.divide(plotting.plot_five_bar_curves(robot, *ends)[0].get_ylim(), size)

    for own, same in zip(seen(other, times), seen(ROBOT, 1.0), strict=True):
        assert_allclose(own, same, rtol=1e-6)


def test_pictures_of_six_drives_have_room_for_their_names():
    """15 pairs and 64 modes: names beside an axis stand apart, legends are not much wider than panels."""
    angle = np.pi / 3 * np.arange(6)
    six = rk.Manipulator(base=0.23 * np.stack([np.cos(angle), np.sin(angle)], -1), lengths=0.22, masses=0.14)
    run = rk.simulate(six, rk.SwitchedCTC(400.0, 40.0), rk.circle(six, 0.05, 0.5))
    names = plotting.plot_pairs(run).get_yticklabels()
    names[0].figure.draw_without_rendering()
    boxes = [name.get_window_extent() for name in names]
    assert all(low.y1 <= high.y0 for low, high in itertools.pairwise(boxes))
    modes = plotting.plot_working_modes(six, [0.02, 0.01])
    assert modes.shape == (8, 8) and modes[0, 0].figure.get_size_inches()[0] <= 20.0
    for ax in (plotting.plot_torques_and_errors(run)[1], plotting.plot_clipping(run, run, 0.1)[0]):
        ax.figure.draw_without_rendering()
        assert ax.get_legend().get_window_extent().width < 1.4 * ax.get_window_extent().width


def test_lines_of_pairs_are_told_apart_with_four_drives():
    path = rk.triangle(rk.load("four_arms"), 0.1, dt=0.01)
    lines = plotting.plot_complement_size(path, rk.drive_pairs(path.robot)).lines[:6]
    assert len({(line.get_color(), line.get_linestyle()) for line in lines}) == 6


def test_the_line_of_all_drives_is_in_the_picture_with_six():
    angle = np.pi / 3 * np.arange(6)
    six = rk.Manipulator(base=0.23 * np.stack([np.cos(angle), np.sin(angle)], -1), lengths=[0.22, 0.26], masses=0.1)
    ax = plotting.plot_pair_measures(rk.triangle(six, 0.1, dt=0.01))
    assert ax.get_ylim()[0] < ax.lines[-1].get_ydata().max() < ax.get_ylim()[1]


def test_a_working_mode_is_drawn_under_its_name():
    """The sign of a x d of each arm, as drawn, is that of the sine of its elbow angle."""
    for ax in np.ravel(plotting.plot_working_modes(ROBOT, [0.03, 0.02])):
        chains = np.array([xy(line) for line in ax.lines if len(line.get_xdata()) == 3])
        a, d = np.moveaxis(np.diff(chains, axis=1), 1, 0)
        assert_allclose(chains[:, 2], [[0.03, 0.02]] * 3)
        assert ax.get_title() == plotting.mode_name(np.sign(a[:, 0] * d[:, 1] - a[:, 1] * d[:, 0]))


def test_a_map_of_a_mode_stands_under_its_name(monkeypatch):
    from rapkm_lite.lessons.lesson02 import figures

    curves, x = [], np.linspace(-0.1, 0.1, 3)
    monkeypatch.setattr(figures, "plot_pair_curves", lambda robot, ax, mode, **rest: curves.append((ax, mode)))
    axes = np.ravel(figures.plot_mode_maps(ROBOT, np.arange(8.0)[:, None, None] * np.ones((3, 3)), x, x))
    for k, (ax, mode, (drawn, of)) in enumerate(zip(axes, rk.working_modes(ROBOT), curves, strict=True)):
        assert_allclose(ax.collections[0].get_array(), k)
        # The style of the lessons puts titles to the left.
        assert ax.get_title("left") + ax.get_title() == plotting.mode_name(mode)
        assert drawn is ax and np.array_equal(of, mode)


def test_cranks_of_the_crossed_linkage_are_as_long_as_links():
    ax = plotting.plot_crossed_linkage(ROBOT, (0, 1))
    cranks = np.array([xy(line) for line in ax.lines if line.get_alpha() == 0.6])
    assert len(cranks) == 6 and {tuple(start) for start in cranks[:, 0]} == {tuple(b) for b in ROBOT.base[:2]}
    assert_allclose(np.linalg.norm(np.diff(cranks, axis=1), axis=-1), 0.2, rtol=1e-9)
    rods = np.array([xy(line) for line in ax.lines if line.get_linestyle() == "-" and line.get_linewidth() == 2.0])
    assert_allclose(np.linalg.norm(np.diff(rods, axis=1), axis=-1), 0.4, rtol=1e-9)


def test_a_patch_of_the_tangent_plane_is_tangent():
    """Columns of F span it: its corners stand aside from the marked angles by F times something, in degrees."""
    q, path = pose([0.02, 0.05]), rk.triangle(ROBOT, dt=5e-2)
    F = rk.orthogonal_complement(ROBOT, q)
    ax = plotting.plot_configuration_space(ROBOT, [(1, 1, 1)], q=q, trajectory=path, F=F)
    way, point, patch = (np.array(line.get_data_3d()).T for line in ax.lines[-3:])
    assert_allclose(np.mod(point - np.degrees(q[:3]) + 180, 360), 180)
    assert_allclose(np.mod(way - np.degrees(path.q_a) + 180, 360), 180)
    aside = patch - point
    assert_allclose(np.cross(*F[:3].T) @ aside.T, 0, atol=1e-9 * np.abs(aside).max())
    assert_allclose(np.linalg.norm(np.diff(patch, axis=0), axis=1), 70)


def test_a_machine_is_drawn_from_its_driven_joints_to_its_end_effector():
    q = pose([0.02, 0.05])
    elbows = ROBOT.base + 0.2 * np.stack([np.cos(q[:3]), np.sin(q[:3])], axis=-1)
    marks = [line for line in plotting.plot_machine(ROBOT, q).lines if line.get_marker() != "None"]
    driven, passive, tips = (np.concatenate([xy(mark) for mark in marks[k::3]]) for k in range(3))
    assert_allclose(driven, ROBOT.base)
    assert_allclose(passive, elbows)
    assert_allclose(tips, [[0.02, 0.05]] * 3)
    assert [mark.get_marker() for mark in marks[:3]] == ["o", "o", "s"]
    assert to_hex(marks[0].get_markerfacecolor()) != to_hex(marks[1].get_markerfacecolor()) == "#ffffff"


def test_the_workspace_is_shaded_where_all_arms_reach():
    """Distances between |l1 - l2| and l1 + l2 from every base point, but for a grid step."""
    shade = plotting.plot_workspace(ROBOT).collections[0].get_paths()[0]
    points = np.random.default_rng(2).uniform([-0.22, -0.2], [0.22, 0.3], (400, 2))
    far = np.linalg.norm(points[:, None] - ROBOT.base, axis=-1).max(axis=1)
    clear = np.abs(far - 0.4) > 4e-3
    assert np.array_equal(shade.contains_points(points)[clear], (far < 0.4)[clear])
    assert 50 < np.count_nonzero(far < 0.4) < 350


def test_a_frame_holds_the_elbows_in_any_pose():
    robot = ROBOT.replace(lengths=[[0.2, 0.22], [0.3, 0.2], [0.21, 0.24]])
    frame = plotting.plane_limits(robot, margin=0.0)
    turn = np.linspace(0, 2 * np.pi, 361)
    elbows = robot.base + robot.lengths[:, :1] * np.stack([np.cos(turn), np.sin(turn)], axis=-1)[:, None]
    low, high = np.transpose([frame["xlim"], frame["ylim"]])
    assert np.all(elbows >= low - 1e-12) and np.all(elbows <= high + 1e-12)


# Torques, forces, prestress.
def test_forces_of_one_drive_reach_as_far_as_its_torque():
    q = pose([0.02, 0.05])
    ax, A = plotting.plot_available_forces(ROBOT, q, torque=0.08), rk.control_matrix(ROBOT, q)
    for i in range(3):
        assert_allclose(xy(named(ax)[f"drive {i + 1}"]), [-0.08 * A[i], 0.08 * A[i]])


def test_a_drive_has_no_share_of_the_prestress_on_the_curve_of_the_others():
    """Two parallel distal links hold each other alone."""
    for i, ax in enumerate(plotting.plot_prestress_maps(ROBOT, n=41)):
        others = [k + 1 for k in range(3) if k != i]
        # The style of the lessons puts titles to the left.
        assert ax.get_title("left") + ax.get_title() == f"drive {i + 1};  line: pair ({others[0]},{others[1]})"


def test_torques_of_choices_are_in_millinewton_metres():
    torque = np.random.default_rng(1).normal(size=(len(PATH.t), 3))
    (ax,) = plotting.plot_torque_choices(PATH, {"any": torque})
    for i in range(3):
        assert_allclose(y_of(ax, f"drive {i + 1}"), 1e3 * torque[:, i])


def test_drives_are_content_on_their_lines():
    """A_i p = -offset_i, for places p beside the wanted one."""
    q = pose([0.02, 0.05])
    ax, A = plotting.plot_disagreement(ROBOT, q, OFFSET, 7.05), rk.control_matrix(ROBOT, q)
    for i, line in enumerate(named(ax).values()):
        assert_allclose(xy(line) @ A[i], -1e3 * OFFSET[i], atol=1e-9)


def test_torques_of_theory_stand_on_those_of_the_run():
    ax = plotting.plot_rest_torques(RUN, RUN.c)
    for i in range(3):
        assert_allclose(ax.lines[3 + i].get_ydata(), 1e3 * RUN.c[:, i])
        assert_allclose(ax.lines[i].get_ydata(), 1e3 * RUN.c[:, i])


def test_runs_and_theories_of_a_gain_ratio_have_one_unit():
    lines = named(plotting.plot_gain_ratio([0.5, 1.0], [0.03, 0.05], {"wrong": [0.04, 0.04], "right": [0.03, 0.05]}))
    assert_allclose(lines["wrong"].get_ydata(), [40, 40])
    assert_allclose(lines["right"].get_ydata(), lines["simulated"].get_ydata())


def test_white_lines_of_the_fight_map_are_where_nothing_fights():
    ax = plotting.plot_fight_map(ROBOT, OFFSET, 7.05, n=81)
    lines = np.concatenate([path.vertices for path in ax.collections[-1].get_paths()])
    lines = lines[rk.reachable(ROBOT, 1.02 * lines)][::7]
    A = rk.control_matrix(ROBOT, pose(lines))
    fight = np.linalg.norm(rk.steady_state_torque(A, 7.05, OFFSET), axis=-1)
    assert len(lines) > 10 and np.median(fight) < 1e-3 and 7.05 * np.linalg.norm(OFFSET) > 0.04


@pytest.mark.parametrize("start", [-20.0, 0.0, 1.7e9])
def test_the_picture_of_a_log_holds_its_records_whenever_its_clock_began(start):
    log = rk.mystery_run("gain")
    for axes in plotting.plot_log(rk.Log("own", start + log.t, log.q_a, log.q_a_desired, log.c)):
        assert_allclose(axes.get_xlim(), (start, start + 9.0), rtol=0, atol=1e-6)


def test_a_log_is_drawn_in_milliradians_and_millinewton_metres():
    log = rk.mystery_run("gain")
    angles, torques = plotting.plot_log(log)
    for i in range(3):
        assert_allclose(angles.lines[i].get_ydata(), 1e3 * (log.q_a - log.q_a_desired)[:, i])
        assert_allclose(torques.lines[i].get_ydata(), 1e3 * log.c[:, i])


def test_shares_of_a_prestress_are_those_of_the_null_vector():
    x, y, *_ = plotting.grid_points(ROBOT, 41)
    eta = np.abs(rk.null_vector(ROBOT, pose([x[24], y[20]])))
    assert np.ptp(eta) > 0.1
    for i, ax in enumerate(plotting.plot_prestress_maps(ROBOT, n=41)):
        assert ax.collections[0].get_array()[20, 24] == pytest.approx(eta[i], rel=1e-9)


def test_a_disc_and_a_map_of_the_guaranteed_force_are_of_one_torque():
    disc, whole = plotting.plot_guaranteed_force(
        ROBOT, {"": pose([0.02, 0.05])}, lambda A, torque: torque * np.linalg.norm(A[0]), torque=0.2, n=21
    )
    x, y, *_ = plotting.grid_points(ROBOT, 21)
    size = [0.2 * np.linalg.norm(rk.control_matrix(ROBOT, pose(at))[0]) for at in ([0.02, 0.05], [x[12], y[10]])]
    assert disc.patches[-1].get_radius() == pytest.approx(size[0], rel=1e-9)
    assert whole.collections[0].get_array()[10, 12] == pytest.approx(size[1], rel=1e-9)


def test_forces_stand_beside_the_machine_in_their_mode():
    modes = [(1, 1, 1), (1, 1, -1)]
    for mode, ax in zip(modes, plotting.plot_modes_and_forces(ROBOT, [0.03, 0.02], modes)[1::2], strict=True):
        assert_allclose(
            ax.patches[0].get_xy()[:-1], rk.force_polygon(rk.control_matrix(ROBOT, pose([0.03, 0.02], mode=mode)), 0.1)
        )


def test_measures_of_pairs_and_of_all_drives_are_named():
    """sigma_min squared is the smallest eigenvalue of A^T A, of the rows that the name says."""
    ax, A = plotting.plot_pair_measures(PATH), rk.control_matrix(ROBOT, PATH.q)
    rows = {"pair (1,2)": [0, 1], "pair (1,3)": [0, 2], "pair (2,3)": [1, 2], "all drives": [0, 1, 2]}
    for label, some in rows.items():
        square = np.linalg.eigvalsh(A[:, some].mT @ A[:, some])[:, 0]
        assert_allclose(y_of(ax, label) ** 2, square, atol=1e-9)


def test_circles_on_a_path_are_where_it_crosses_the_curve_of_their_colour():
    x = np.array([0.094, 0.064])
    left, right = plotting.plot_parameterization_singularities(rk.triangle(ROBOT), x, (1, 2))
    circles = [line for line in right.lines if line.get_marker() == "o"]
    for k, (line, pair) in enumerate(zip(circles, rk.drive_pairs(ROBOT), strict=True)):
        crossed = rk.distal_cross_products(ROBOT, pose(xy(line)))
        assert len(crossed) == 2 and np.abs(crossed[:, k]).max() < 0.01 < np.abs(np.delete(crossed, k, axis=1)).min()
        assert to_hex(line.get_markeredgecolor()) == to_hex(plotting.pair_line(ROBOT, pair)["color"])
    (dotted,) = [line for line in left.lines if hasattr(line, "get_xy1")]
    way, d = np.subtract(dotted.get_xy2(), dotted.get_xy1()), rk.arm_vectors(ROBOT, pose(x))[1]
    assert_allclose(way[0] * d[1:, 1] - way[1] * d[1:, 0], 0, atol=0.05 * 0.2**2)


def test_one_sign_is_possible_where_the_null_vector_has_one():
    level = plotting.plot_one_sign(PATH, n=41).collections[0].get_array()
    x, y, inside, points = plotting.grid_points(ROBOT, 41, driven=True)
    n = rk.null_vector(ROBOT, pose(points))
    clear = np.abs(n).min(axis=1) > 1e-9  # on the curve of a pair one share is zero
    assert np.array_equal(level[inside][clear].astype(bool), np.abs(np.sign(n).sum(axis=1))[clear] == 3)
    assert level[inside].min() == 0 and level[inside].max() == 1


def test_points_of_belief_are_those_of_the_readings():
    """A drive reads q + offset: its pair believes to stand A_pair^-1 offset aside, all together A^+ offset."""
    offset, A = 0.1 * OFFSET, rk.control_matrix(ROBOT, pose([0.02, 0.01]))
    ax = plotting.plot_synchronization(ROBOT, [0.02, 0.01], offset)[1]
    squares = [xy(line)[0] for line in ax.lines if line.get_marker() == "s"]
    for point, pair in zip(squares, map(list, rk.drive_pairs(ROBOT)), strict=True):
        assert_allclose(point, 1e3 * np.linalg.solve(A[pair], offset[pair]), rtol=0.02)
    (diamond,) = [xy(line)[0] for line in ax.lines if line.get_marker() == "D"]
    assert_allclose(diamond, 1e3 * np.linalg.lstsq(A, offset, rcond=None)[0], rtol=0.02)


def test_the_film_of_three_lines_ends_without_torques(monkeypatch):
    from rapkm_lite.lessons.lesson03 import figures

    told, q = {}, pose([0.04, -0.05])
    monkeypatch.setattr(figures, "film", lambda draw, steps, alt, **rest: told.update(draw=draw, steps=steps))
    figures.film_three_lines(ROBOT, q, OFFSET, 7.05)
    whole = 1e3 * rk.steady_state_torque(rk.control_matrix(ROBOT, q), 7.05, OFFSET)
    for share in (told["steps"][0], 0.5, told["steps"][-1]):
        ax = plt.figure().add_subplot()
        told["draw"](ax, share)
        words = [float(label.split()[2].replace("−", "-")) for label in named(ax) if label.startswith("drive")]
        assert_allclose(words, share * whole, atol=0.051)
        assert f"{100 * share:3.0f} % of the normal part" in (ax.get_title(), ax.get_title("left"))
    assert (told["steps"][0], told["steps"][-1]) == (1.0, 0.0)


# The filter.
@pytest.mark.parametrize("plot", ["plot_joint_moves", "plot_spacing"])
def test_a_slope_of_two_goes_with_the_square(plot):
    spacing, gap = np.array([0.01, 0.02, 0.04]), np.array([1e-3, 3e-3, 16e-3])
    if plot == "plot_spacing":
        ax, level = plotting.plot_spacing(spacing, gap, ("level", 5e-3)), "level"
        dots = "this edge"
    else:
        ax = plotting.plot_joint_moves(ROBOT, [-0.05, 0.0], [0.05, 0.0], spacing, gap, 5e-3)[1]
        dots, level = "straight lines in joint space", "offsets of this lesson"
    assert_allclose(y_of(ax, "slope two"), [1.0, 4.0, 16.0])
    assert_allclose(xy(named(ax)[dots]), 1e3 * np.column_stack([spacing, gap]))
    assert_allclose(y_of(ax, level), 5.0)


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_the_filter_takes_its_share_of_what_moves_nothing(share):
    left, right = plotting.plot_filter_share(RUN, share)
    torque = np.stack([y_of(left, f"drive {i + 1}") for i in range(3)], axis=-1)
    A, c = rk.control_matrix(ROBOT, RUN.q[::10]), 1e3 * RUN.c[::10]
    moving = np.einsum("kji,kj->ki", A, c)
    assert_allclose(np.einsum("kji,kj->ki", A, torque), moving, atol=1e-9)  # the forces stay
    n = rk.null_vector(ROBOT, RUN.q)
    assert_allclose(np.sum(n[::10] * torque, axis=1), (1 - share) * np.sum(n[::10] * c, axis=1), atol=1e-9)
    pale, now = (xy(line) for line in right.lines[:2])
    assert_allclose(pale[:, 0], 1e3 * np.sum(n * RUN.c, axis=1)[::25], atol=1e-9)
    assert_allclose(now, pale * [1 - share, 1.0], atol=1e-9)


def test_measured_bars_stand_beside_simulated_ones_of_the_same_row():
    table = rk.table1()
    ax = plotting.plot_table1(table)
    bars = [bar.get_height() for bar in ax.patches if np.isfinite(bar.get_x())]
    rows = [table.measured[0], table.simulated[0], table.measured[1], table.simulated[1]]
    assert_allclose(np.reshape(bars, (4, 3)), rows)
    names = ["measured, without filter", "simulated, without filter", "measured, with filter", "simulated, with filter"]
    assert [text.get_text() for text in ax.get_legend().get_texts()] == names


@pytest.mark.parametrize("antagonism", [False, True])
def test_norms_of_torques_are_in_the_unit_of_their_axis(antagonism):
    """What moves nothing is n n^T c, of the size |n^T c|."""
    n = rk.null_vector(ROBOT, RUN.q)
    size = np.abs(np.sum(n * RUN.c, axis=1)) if antagonism else np.sqrt(np.sum(RUN.c**2, axis=1))
    words = "antagonism" if antagonism else "torques"
    for log, unit, scale in ((False, "mN m", 1e3), (True, "N m", 1.0)):
        ax = plotting.plot_torque_norms({"a": RUN}, antagonism=antagonism, log=log)
        assert ax.get_ylabel() == f"norm of the {words} in {unit}"
        assert_allclose(y_of(ax, "a"), scale * size, atol=1e-12)


def test_bars_of_energies_stand_at_their_drive_with_their_number():
    ax = plotting.plot_energies({"a": [1.25, 2.0], "b": [0.5, 0.25]})
    bars = [bar for bar in ax.patches if np.isfinite(bar.get_x())]
    middle = np.reshape([bar.get_x() + bar.get_width() / 2 for bar in bars], (2, 2))
    assert_allclose(middle.mean(axis=0), [0, 1], atol=1e-12)
    assert np.all(middle[0] < middle[1])
    assert_allclose([text.get_position() for text in ax.texts], np.column_stack([middle.ravel(), [1.25, 2, 0.5, 0.25]]))
    assert [text.get_text() for text in ax.texts] == ["1.25", "2.00", "0.50", "0.25"]


def test_long_numbers_of_many_drives_stand_apart():
    """Twelve bars with seven characters each."""
    ax = plotting.plot_energies({"a": 3.1234e-4 * np.ones(6), "b": 2.9876e-4 * np.ones(6)})
    ax.figure.draw_without_rendering()
    boxes = [text.get_window_extent() for text in ax.texts]
    assert not any(a.overlaps(b) for a, b in itertools.combinations(boxes, 2))
    assert not any(box.overlaps(ax.get_legend().get_window_extent()) for box in boxes)


@pytest.mark.parametrize("times", [1e-4, 1e4])
def test_torques_of_light_and_heavy_machines_are_told_with_their_digits(times):
    """By (14) torques at rest are as many times as large as the gain."""
    q, offset = pose([0.02, 0.05]), [4e-3, -2e-3, 5e-3]
    told = [
        [float(t.get_text().split(": ")[1].split()[0].replace("−", "-")) for t in ax.get_legend().get_texts()]
        for ax in (plotting.plot_disagreement(ROBOT, q, offset, K_P) for K_P in (7.05, 7.05 * times))
    ]
    assert_allclose(told[1], times * np.array(told[0]), rtol=0.02)


# Computed torque.
def test_arrows_show_where_the_drives_of_a_pair_feel_nothing():
    """Both base joints of the pair stand still, to first order, while the end-effector moves along the arrow."""
    path = rk.triangle(ROBOT)
    for ax in np.ravel(plotting.plot_singular_poses(path, [(0, 1)])):
        tip, x = (np.array(at) for at in (ax.texts[0].xy, ax.texts[0].xyann))
        d = rk.arm_vectors(ROBOT, pose(x))[1][[0, 1]]
        assert np.abs(d @ (tip - x)).max() < 0.03 * np.linalg.norm(tip - x) * 0.2


def test_rates_of_decay_are_positive_where_a_function_falls():
    t = np.linspace(0, 1, 11)
    values, rates = plotting.plot_lyapunov(t, {"V": 3 * np.exp(-4 * t), "W": np.exp(-2 * t)}, 4.0)
    assert_allclose(y_of(rates, "V"), 4.0)
    assert_allclose(y_of(rates, "W"), 2.0)
    assert_allclose(y_of(values, "V"), 3 * np.exp(-4 * t))


def test_the_map_of_the_feedback_is_its_decimal_logarithm():
    ax = plotting.plot_feedback_map(ROBOT, (0, 1), n=41)
    level, (x, y, *_) = ax.collections[0].get_array(), plotting.grid_points(ROBOT, 41, driven=True)
    i, j = 20, 24
    q = pose([x[j], y[i]])
    pair, (G, _, _) = rk.control_matrix(ROBOT, q, (0, 1)), rk.minimal_dynamics(ROBOT, q, 0 * q, (0, 1))
    norm = np.linalg.norm(np.linalg.pinv(pair.T) @ G, 2)
    assert level[i, j] == pytest.approx(np.log10(norm), abs=1e-9)


@pytest.mark.parametrize("decades", [-4, 3])
def test_the_map_of_the_feedback_keeps_its_colours_for_light_and_heavy_machines(decades):
    """Without friction the map is linear in all masses; its colours move with it by decades."""
    robot = ROBOT.replace(friction=0.0)
    other = robot.replace(
        masses=10.0**decades * robot.masses, inertias=None, rotor_inertia=10.0**decades * robot.rotor_inertia
    )
    limits = [plotting.plot_feedback_map(machine, (0, 1), n=41).collections[0].get_clim() for machine in (robot, other)]
    assert_allclose(limits[0], [-2.2, 0.0], atol=1e-12)
    assert_allclose(np.subtract(limits[1], limits[0]), decades, atol=1e-12)


def test_redundant_coordinates_are_the_smooth_curve_of_the_feedback():
    ax = plotting.plot_feedback_along(PATH)
    smooth, *pairs = (y_of(ax, label) for label in ("redundant", "pair (1,2)", "pair (1,3)", "pair (2,3)"))
    assert smooth.max() < 3 * smooth.min() and all(pair.max() > 20 * smooth.max() for pair in pairs)


def test_one_pair_is_in_use_at_a_time():
    run = rk.simulate(ROBOT, rk.SwitchedCTC(900, 60), PATH)
    lines = [line.get_ydata() for line in plotting.plot_pairs(run).lines]
    assert np.all(np.sum(np.isfinite(lines), axis=0) == 1)
    for k, (line, pair) in enumerate(zip(lines, rk.drive_pairs(ROBOT), strict=True)):
        assert np.array_equal(np.isfinite(line), [tuple(p) == pair for p in run.pairs]) and np.nanmax(line) == k
    for pair in ((0, 2), (2, 0)):  # the same coordinates
        fixed = rk.simulate(ROBOT, rk.APD(7.0, 0.2, pair), rk.hold(ROBOT, [0.0, 0.0], 0.01))
        assert [np.isfinite(line.get_ydata()).all() for line in plotting.plot_pairs(fixed).lines] == [
            False,
            True,
            False,
        ]


def test_thin_lines_are_where_the_path_crosses_the_curve_of_the_pair():
    run = rk.simulate(ROBOT, rk.PD(7.05, 0.225), rk.triangle(ROBOT), OFFSET)
    for ax in plotting.plot_torques_and_errors(run, pair=(1, 2)):
        times = [line.get_xdata()[0] for line in ax.lines if line.get_linestyle() == ":"]
        assert len(times) == 2
        crossed = [np.interp(times, run.t, cross) for cross in rk.distal_cross_products(ROBOT, run.trajectory.q).T]
        assert np.abs(crossed[2]).max() < 0.01 < np.abs(crossed[:2]).min()


def test_a_block_is_the_one_that_its_rule_picks():
    """The printed rule of section 4.5: the pair of rows of A~ with the smallest row-sum norm."""
    x, y, *_ = plotting.grid_points(ROBOT, 41)
    i, j = 18, 26
    A = rk.redundant_control_matrix(ROBOT, pose([x[j], y[i]]))
    blocks = [A[list(pair)] for pair in rk.drive_pairs(ROBOT)]
    sigma = [np.linalg.svd(block, compute_uv=False)[-1] for block in blocks]
    printed, best = plotting.plot_partition_rules(ROBOT, n=41)
    small = sigma[int(np.argmin([np.linalg.norm(block, np.inf) for block in blocks]))]
    assert small < 0.9 * max(sigma)
    assert printed.collections[0].get_array()[i, j] == pytest.approx(small, rel=1e-9)
    assert best.collections[0].get_array()[i, j] == pytest.approx(max(sigma), rel=1e-9)


def test_the_line_of_a_mirror_goes_through_both_elbows():
    for ax in plotting.plot_mirror(RUN, 300, (0, 1)):
        (line,) = [line for line in ax.lines if hasattr(line, "get_xy1")]
        for elbow, base in zip((line.get_xy1(), line.get_xy2()), ROBOT.base, strict=False):
            a, d = elbow - base, RUN.x[300] - elbow
            assert_allclose([np.hypot(*a), np.hypot(*d)], 0.2, rtol=1e-9)
            assert a[0] * d[1] > a[1] * d[0]  # the arms bend to the left


def test_a_mirror_of_a_run_far_from_the_corner_shows_where_the_machine_is():
    path = rk.circle(ROBOT, 0.03, 0.5, centre=[0.0, 0.08])
    ax = plotting.plot_mirror(rk.simulate(ROBOT, rk.PD(7.05, 0.225), path, OFFSET), 300, (0, 1))[1]
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    for x in (path.x, *(xy(line) for line in ax.lines if line.get_marker() in ("s", "o"))):
        assert np.all((x > [left, low]) & (x < [right, high]))
    assert right - left < 0.15


def test_a_cross_marks_the_end_of_a_lost_run_and_a_box_its_limits():
    with pytest.raises(rk.SimulationError) as caught:
        rk.simulate(ROBOT, rk.CTC(400.0, 40.0), PATH, OFFSET)
    lost = caught.value.partial
    for ax in (axes := plotting.plot_ee_paths({"PD": RUN, "lost": lost}, pair=(0, 1), zoom=[-0.1, 0.12, -0.09, 0.03])):
        (mark,) = [xy(line) for line in ax.lines if line.get_marker() == "x"]
        assert_allclose(mark, lost.x[-1:])
    assert (axes[1].get_xlim(), axes[1].get_ylim()) == ((-0.1, 0.12), (-0.09, 0.03))


def test_values_of_places_stand_at_their_places():
    centres = [[0.01, 0.05], [-0.02, 0.03]]
    marks = plotting.plot_placement(ROBOT, centres, [1.0, 2.0]).collections[-1]
    assert_allclose(marks.get_offsets(), centres)
    assert_allclose(marks.get_array(), [1.0, 2.0])


# Studies.
def test_offset_1_runs_to_the_right_in_a_landscape():
    values = np.linspace(-2.0, 2.0, 5)
    one, two, three = np.meshgrid(values, values, values, indexing="ij")
    cube = (one + 2.0) * 3.0 + 0.1 * (two + 2.0) + 0.01 * (three + 2.0)
    for ax, third in zip(plotting.plot_landscape(values, cube, cube), (0, 2, 4), strict=True):
        filled, lines = ax.collections
        # Levels of what rises with offset 1 are upright; those of the theory lie on those of the simulation.
        for level, path in zip(lines.levels, lines.get_paths(), strict=True):
            if len(path.vertices):
                assert np.ptp(path.vertices[:, 0]) < 0.15
                x, y = path.vertices.mean(axis=0)
                there = (x + 2.0) * 3.0 + 0.1 * (y + 2.0) + 0.01 * (values[third] + 2.0)
                assert there == pytest.approx(level, abs=1e-6)
        upright = [p.vertices for p in filled.get_paths() if len(p.vertices)]
        assert min(np.ptp(part[:, 0]) for part in upright) < 1.5 < np.ptp(upright[0][:, 1])


def test_a_mean_stands_on_its_curve_of_shares():
    ax = plotting.plot_bands({"a": [1.0, 2.0, 3.0, 10.0], "b": [1.0, 1.0, 1.0, 5.0]})
    diamonds = [xy(line)[0].tolist() for line in ax.lines if line.get_marker() == "D" and len(line.get_xdata())]
    assert diamonds == [[4.0, 75.0], [2.0, 75.0]]


def test_readings_stand_between_the_ends_of_their_range():
    ax = plotting.plot_readings(["a", "b"], [2.0, -1.0], [4.0, 1.0], [[2.0, 1.0], [3.0, 0.0]], [4.0, -1.0])
    assert [line.get_xdata().tolist() for line in ax.lines] == [[0.0, 1.0], [0.5, 0.5], [1.0, 0.0]]


def test_readings_beyond_their_range_are_seen():
    ax = plotting.plot_readings(["a", "b"], [2.0, -1.0], [4.0, 1.0], [[2.0, 1.0], [9.0, 0.0]], [4.0, -4.0])
    (left, right), places = ax.get_xlim(), np.concatenate([line.get_xdata() for line in ax.lines])
    assert sorted(places) == [-1.5, 0.0, 0.5, 1.0, 1.0, 3.5]
    # Half a mark of 7 points is a hundredth of the 330 points between the ends.
    assert min(places.min() - left, right - places.max()) > 0.011 * (right - left)


def test_energies_over_the_gain_are_told_apart():
    lines = named(plotting.plot_gain_curve([1.0, 7.0], [2.2, 5.5], [2.0, 2.1], [0.2, 3.5]))
    got = {label: line.get_ydata().tolist() for label, line in lines.items()}
    assert got == {"without filter": [2.2, 5.5], "with filter": [2.0, 2.1], "antagonistic part": [0.2, 3.5]}


def test_what_an_edge_needs_begins_and_ends_as_it_is_commanded():
    ax = plotting.plot_five_bar_curves(ROBOT, [-0.1, -0.06], [0.1, -0.02])[1]
    dotted = [line for line in ax.lines if line.get_linestyle() == ":" and len(line.get_xdata())]
    for line, pair in zip(dotted, ((0, 1), (1, 2)), strict=True):
        straight = xy(named(ax)[f"drives ({pair[0] + 1},{pair[1] + 1})"])
        turn = np.degrees(pose([0.1, -0.02]) - pose([-0.1, -0.06]))[list(pair)]
        assert_allclose(xy(line)[[0, -1]], straight[[0, -1]], atol=1e-9)
        assert_allclose(straight[-1], turn, atol=1e-9)


def test_via_points_stand_below_their_shares():
    ax = plotting.plot_demand([0.0, 0.5, 1.0], [0.1, 0.05, 0.2], {"first": [0.2, 0.3], "second": [0.7]})
    assert xy(ax.lines[0]).tolist() == [[0.0, 0.1], [0.5, 0.05], [1.0, 0.2]]
    first, second = (xy(named(ax)[label]) for label in ("first", "second"))
    assert (first[:, 0].tolist(), second[:, 0].tolist()) == ([0.2, 0.3], [0.7])
    assert first[0, 1] == first[1, 1] < 0 and second[0, 1] < 0 and first[0, 1] != second[0, 1]


def test_a_crossing_lies_between_its_sample_and_the_next():
    path = rk.triangle(ROBOT)
    crossed = rk.distal_cross_products(ROBOT, path.q)
    for k, at in enumerate(plotting.curve_crossings(path)):
        assert len(at) == 2 and np.all(crossed[at, k] * crossed[at + 1, k] < 0)


# Readings and rests.
def test_components_of_null_vectors_are_those_of_drives_1_and_2():
    places = [[0.1, 0.0], [0.0, 0.1], [-0.1, -0.03]]
    n = rk.null_vector(ROBOT, pose(places))
    assert_allclose(xy(named(plotting.plot_places(ROBOT, {"a": places})[1])["a"]), n[:, :2])


def test_counts_lie_around_what_they_count():
    exact = 5e-3 * T
    for ax in plotting.plot_counted(T, 1e-3 * np.rint(1e3 * exact), exact):
        assert_allclose(y_of(ax, "without rounding"), 5.0 * T)
        assert np.abs(y_of(ax, "from counts") - y_of(ax, "without rounding")).max() <= 0.5 + 1e-9


def test_steps_of_a_torque_go_on_either_side_of_the_exact_one():
    """An encoder rounds to the nearest count: the step is off by half a count at most; friction holds +-f_c."""
    ax = plotting.plot_torque_steps(7.05, 1e-3, 4.2e-3)
    exact, moved, held = (y_of(ax, f) for f in ("exact angle", "measured, is driven on", "measured, can rest here"))
    off = np.where(np.isfinite(moved), moved, held) - exact
    assert np.nanmax(np.abs(off)) == pytest.approx(7.05 / 2, abs=0.02) and abs(np.nanmean(off)) < 0.01
    assert np.nanmax(np.abs(held)) <= 4.2 < np.nanmin(np.abs(moved))
    band = ax.patches[0].get_extents().transformed(ax.transData.inverted())
    assert_allclose([band.y0, band.y1], [-4.2, 4.2])


def test_errors_stand_over_the_residuals_that_they_leave():
    ax = plotting.plot_bias(np.array([[1e-5, 2e-5]]), np.array([[1e-3, 3e-3]]), ["a"])
    assert_allclose(xy(named(ax)["a"]), [[0.01, 1.0], [0.02, 3.0]])


# Room and faults.
def test_limits_lie_where_the_drives_are_clipped():
    torques = plotting.plot_clipping(RUN, RUN, 0.085)[0]
    assert [line.get_ydata()[0] for line in torques.lines if line.get_linestyle() == ":"] == [-85.0, 85.0]


def test_a_drive_stands_at_its_limit_where_the_room_ends():
    c, n = np.array([0.05, -0.06, -0.02]), np.array([0.6, 0.64, 0.48])
    ends = np.array([(-0.085 - c) / n, (0.085 - c) / n])
    room = ends.min(axis=0).max(), ends.max(axis=0).min()
    ax = plotting.plot_room(c, n, 0.085, room, {"least size": 0.0})
    shade = ax.patches[1].get_extents().transformed(ax.transData.inverted())
    assert_allclose([shade.x0, shade.x1], 1e3 * np.array(room))
    torque = [np.interp([shade.x0, shade.x1], *line.get_data()) for line in [*named(ax).values()][:3]]
    assert_allclose(np.abs(torque).max(axis=0), 85.0, rtol=1e-9)


def test_accelerations_of_least_size_and_of_pairs_touch_those_of_all_drives():
    """No choice of torques leads beyond the polygon of all drives; in some direction torques of least size reach it."""
    ax = plotting.plot_accelerations(ROBOT, [[0.02, 0.01]], 0.085)[0]
    corners = ax.patches[0].get_xy()[:-1]
    edge = np.roll(corners, -1, axis=0) - corners
    edge, corners = edge[np.linalg.norm(edge, axis=1) > 1e-9], corners[np.linalg.norm(edge, axis=1) > 1e-9]
    out = np.stack([edge[:, 1], -edge[:, 0]], axis=-1) / np.linalg.norm(edge, axis=1)[:, None]
    out *= np.sign(np.sum(out * corners, axis=1))[:, None]
    far = np.sum(out * corners, axis=1)
    for label, line in named(ax).items():
        reach = (xy(line) @ out.T / far).max()
        assert reach <= 1 + 1e-9
        assert reach > (0.99 if label == "all, least size" else 0.5)
    A = rk.control_matrix(ROBOT, pose([0.02, 0.01]))
    G, _, _ = rk.minimal_dynamics(ROBOT, pose([0.02, 0.01]), np.zeros(6), None)
    pair = xy(named(ax)["pair (1,2)"]) @ G @ np.linalg.inv(A[:2])
    assert_allclose(np.abs(pair), 0.085, rtol=1e-9)


def test_fights_of_a_wrong_geometry_are_in_millinewton_metres():
    model = ROBOT.replace(lengths=0.2004)
    (ax,) = np.atleast_1d(plotting.plot_geometry_maps(ROBOT, {"long": model}, 7.05, n=41))
    x, y, *_ = plotting.grid_points(ROBOT, 41)
    i, j = 20, 22
    wanted = pose([x[j], y[i]], model)[:3]
    A = rk.control_matrix(ROBOT, pose([x[j], y[i]]))
    left = np.eye(3) - A @ np.linalg.pinv(A)
    fight = 7.05e3 * np.linalg.norm(left @ (wanted - pose([x[j], y[i]])[:3]))
    assert ax.collections[0].get_array()[i, j] == pytest.approx(fight, rel=0.05)


def test_what_a_filter_lets_pass_goes_with_the_error_of_its_model():
    eps = np.array([1e-3, 1e-2, 1e-1])
    share, leak = plotting.plot_model_share(eps, 0.2 * eps, T, 0.01 + 0 * T)
    assert_allclose(y_of(share, "slope one"), y_of(share, "filter with the wrong model"))
    assert_allclose(leak.lines[0].get_ydata(), 10.0)


def test_a_step_fills_the_band_on_the_line_of_the_hunting_maps():
    (ax,) = plotting.plot_hunting_maps([1.0, 7.0], [500.0, 2000.0], {"a": [[0.0, 9.0], [0.0, 5.0]]}, 4.2e-3)
    gains, counts = ax.lines[0].get_data()
    assert_allclose(gains * 2 * np.pi / counts, 2 * 4.2e-3)


def test_shifts_and_distances_are_in_millimetres():
    assert_allclose(xy(named(plotting.plot_saturation([0.1, 0.2], {"a": [1e-3, 1e-4]}))["a"]), [[100, 1], [200, 0.1]])
    off = 1e3 * np.hypot(*(RUN.x - PATH.x).T)
    assert_allclose(y_of(plotting.plot_faulty_runs({"a": RUN}, least=1e-9), "a"), np.maximum(off, 1e-9))


# Frequencies and gains, other mechanisms.
def test_a_bar_holds_the_middle_four_fifths():
    ax = plotting.plot_law_bands(["a"], {"energy in J": [np.linspace(1.0, 2.0, 101)]})
    ax = np.ravel(ax)[0]
    assert_allclose(ax.collections[0].get_segments()[0][:, 0], [1.1, 1.9])
    assert_allclose(ax.lines[0].get_xdata(), 1.5)


def test_theory_and_run_of_one_axis_have_one_name():
    error = np.column_stack([1e-3 * T, 2e-3 * T])
    ax = plotting.plot_slow_error(T, error, 1.1 * error)
    for word, factor in (("x", 1.0), ("y", 2.0)):
        assert_allclose(y_of(ax, f"run, {word}"), factor * T)
        assert_allclose(y_of(ax, f"theory, {word}"), 1.1 * factor * T)


def test_the_fast_direction_keeps_more_of_a_gain_than_the_slow_one():
    """What is left of a gain of the driven joints: eigenvalues of N_J I_a N_J that are not zero."""
    ax = plotting.plot_effective_gain(PATH, np.diag([1.0, 1, 1, 0, 0, 0]))
    N_J = rk.nullspace_projector(ROBOT, PATH.q)[..., :3]
    shares = np.linalg.eigvalsh(N_J @ N_J.mT)[:, -2:]
    assert_allclose(y_of(ax, "slow direction"), shares[:, 0], atol=1e-9)
    assert_allclose(y_of(ax, "fast direction"), shares[:, 1], atol=1e-9)


def test_effective_gains_are_seen_in_whatever_unit_the_gain_is():
    """(35) is linear in K: a gain of 400 / s^2 gives 400 times the curves."""
    drives = np.diag([1.0, 1, 1, 0, 0, 0])
    shares, gains = (plotting.plot_effective_gain(PATH, k * drives) for k in (1.0, 400.0))
    assert_allclose(y_of(gains, "slow direction"), 400.0 * y_of(shares, "slow direction"))
    assert y_of(gains, "fast direction").max() < gains.get_ylim()[1] and shares.get_ylim() == (0.0, 1.05)


def test_predicted_points_stand_at_their_times():
    y = 1e-3 * np.exp(-T)
    lines = named(plotting.plot_step_response(T, {"run": y}, {"theory": y}))
    points = xy(lines["predicted, theory"])
    assert_allclose(points[:, 1], np.exp(-points[:, 0]))
    assert_allclose(lines["simulated, run"].get_ydata(), np.exp(-T))


def test_distance_from_a_circle_leaves_the_turn_of_the_platform_out():
    from rapkm_lite.lessons.lesson12 import four_rrr

    motion = four_rrr.Motion(np.arange(3.0), np.zeros((3, 3)), *3 * [np.zeros((3, 9))])
    poses = np.array([[[3e-3, 4e-3, 7.0]] * 3])
    assert_allclose(plotting.plot_swing(motion, poses, ["PD"]).lines[0].get_ydata(), 5.0)


def test_gaps_and_sizes_have_their_units():
    assert_allclose(y_of(plotting.plot_loop_gaps([0.0, 1.0], {"a": [1e-6, 1e-4]}), "a"), [1e-3, 0.1])
    ax = plotting.plot_complement_size(PATH, [(0, 1)])
    F = rk.orthogonal_complement(ROBOT, PATH.q, (0, 1))
    largest = np.sqrt(np.linalg.eigvalsh(F.mT @ F)[:, -1])
    assert_allclose(ax.lines[0].get_ydata(), largest, rtol=1e-9)


def test_meters_of_the_workshop_show_the_energy_of_their_runs(monkeypatch):
    """Half way along an edge the arms hold work that they give back on the rest of it, much of it under a load."""
    from rapkm_lite.lessons.lesson00 import figures

    told, half, loaded = {}, 850, ROBOT.replace(load=3.0)
    monkeypatch.setattr(figures, "film", lambda draw, steps, alt, **rest: told.update(draw=draw, alt=alt))
    figures.film_workshop(loaded, OFFSET, frames=2)
    axes = plt.subplots(1, 2)[1]
    told["draw"](axes, half)
    lap = rk.triangle(loaded)
    for ax, offset in zip(axes, (0 * OFFSET, OFFSET), strict=True):
        run = rk.simulate(loaded, rk.PD(7.05, 0.225), lap, offset)
        heat = 0.611 / 0.0259**2 * run.dt * np.sum(run.c[:half] ** 2)
        work = np.sum(run.c[:half] * (run.q_a[1 : half + 1] - run.q_a[:half]))
        assert next(text.get_text() for text in ax.texts) == f"{heat + work:.1f} J" and work > 0.1


# Marks of the canvas.
def test_bars_of_drives_stand_about_the_number_of_their_drive():
    picture = explore.Picture({"a": {"ylim": (0, 2)}})
    explore.bars(picture, "a", [([1.0, 2.0], {}), ([1.5, 0.5], {"alpha": 0.4})])
    bars = np.array([mark.data for mark in picture.marks if mark.kind == "bar"]).reshape(2, 2, 4, 2)
    middle = bars[..., 0].mean(axis=-1)
    assert_allclose(middle.mean(axis=0), [1.0, 2.0])
    words = [mark for mark in picture.marks if mark.kind == "label"]
    assert_allclose([mark.data[0, 0] for mark in words], middle.ravel())
    assert [float(mark.words) for mark in words] == [1.0, 2.0, 1.5, 0.5]
    picture.bar("a", 3.0, 1.0, 0.5)
    assert picture.marks[-1].data.tolist() == [[2.75, 0], [3.25, 0], [3.25, 1], [2.75, 1]]


def test_limits_of_x_leave_those_of_y():
    picture = explore.Picture({"a": {"xlim": (0, 1), "ylim": (2, 3)}})
    picture.limits("a", x=(-5, 5))
    assert picture.xlim("a") == (-5, 5) and picture.ylim("a") == (2, 3)


@pytest.mark.parametrize(
    ("largest", "top"),
    [(0.9, 1.0), (1.0, 1.5), (1.4, 1.5), (1.9, 2.0), (2.0, 3.0), (2.9, 5.0), (4.7, 5.0), (5.0, 7.0), (6.8, 10.0),
     (9.6, 15.0), (6e-4, 7e-4)],
)  # fmt: skip
def test_limits_are_the_next_step_of_1_15_2_3_5_7_that_leaves_a_twentieth_of_room(largest, top):
    for symmetric in (True, False):
        picture = explore.Picture({"a": {"ylim": (-1e6, 1e6)}})
        picture.fit("a", [0.1 * largest, -largest], symmetric=symmetric)
        assert_allclose(picture.ylim("a"), (-top if symmetric else 0.0, top), rtol=1e-12)


def test_limits_shrink_only_below_half_and_end_at_the_first_step_not_below_the_most():
    picture = explore.Picture({"a": {"ylim": (-10.0, 10.0)}})
    for largest, top in ((5.0, 10.0), (9.5, 10.0), (2.0, 3.0), (1.5, 3.0)):
        picture.fit("a", [largest])
        assert_allclose(picture.ylim("a"), (-top, top), rtol=1e-12)
    # A panel that begins with other limits keeps none of them.
    picture.limits("a", y=(0.0, 7.3))
    picture.fit("a", [6.0])
    assert_allclose(picture.ylim("a"), (-7.0, 7.0), rtol=1e-12)
    for most, top in ((2.5, 3.0), (3.0, 3.0), (3.1, 5.0), (1e3, 150.0)):
        picture.fit("a", [100.0], most=most)
        assert_allclose(picture.ylim("a"), (-top, top), rtol=1e-12)
        picture.limits("a", y=(-1e6, 1e6))


@pytest.mark.parametrize("size", [0.01, 0.5])
def test_an_arrow_is_its_own_mirror_image_about_its_vector_and_ends_there(size):
    """A long one and one so short that its head is most of it; what is shorter than it is wide is none."""
    picture, start, along = explore.Picture({"a": {}}), np.array([0.3, -0.2]), np.array([0.6, 0.8])
    picture.arrow("a", start, size * along, 0.006)
    way = (picture.marks[0].data - start) @ np.array([along, [-0.8, 0.6]]).T
    assert_allclose(way[::-1] * [1.0, -1.0], way, atol=1e-15)
    assert_allclose(way.max(axis=0), [size, 1.6 * 0.006])
    assert_allclose(way[3], [size, 0.0], atol=1e-15)
    # The shaft reaches to the head, which is four widths long at most.
    assert_allclose(way[1], [size - min(0.024, 0.6 * size), 0.003])
    picture.arrow("a", start, 0.005 * along, 0.006)
    assert len(picture.marks) == 1


def test_numbers_that_agree_are_written_once_between_the_bars_and_below_those_that_hang():
    picture = explore.Picture({"a": {"ylim": (-2, 2)}})
    explore.bars(picture, "a", [([1.0, -2.0], {}), ([1.0, -0.5], {})])
    words = [(mark.data[0, 0], mark.data[0, 1], mark.words, mark.style["va"]) for mark in picture.marks if mark.words]
    wide = 0.42 / 2
    assert words == [
        (1, 1.0, "1.00", "bottom"),
        (2 - wide, -2.0, "−2.00", "top"),
        (2 + wide, -0.5, "−0.50", "top"),
    ]


def test_rows_of_a_legend_are_read_from_the_left():
    from rapkm_lite.figures.marks import figure

    names = [f"a curve of some length, {i}" for i in range(7)]
    picture = explore.Picture({"a": {"ylim": (0, 1), "legend": [(name, {}) for name in names]}}, size=(6.0, 3.0))
    drawn = figure(picture)
    drawn.draw_without_rendering()
    texts = drawn.axes[0].get_legend().get_texts()
    places = {text.get_text(): text.get_window_extent() for text in texts}
    rows = {round(box.y0) for box in places.values()}
    assert 1 < len(rows) < len(names)
    assert sorted(places, key=lambda name: (-round(places[name].y0), places[name].x0)) == names


def test_a_point_out_of_reach_gives_way_to_the_last_one_on_the_way_to_it():
    """A millimetre before it: on the way from the middle, in reach, and two millimetres farther no more."""
    from rapkm_lite.figures.marks import clamped

    for point in ([0.4, 0.1], [-0.1, -0.5], [0.0, 0.3]):
        found = clamped(ROBOT, np.array(point))
        unit = np.array(point) / np.linalg.norm(point)
        assert found @ [-unit[1], unit[0]] == pytest.approx(0.0, abs=1e-12) and found @ unit > 0.0
        assert rk.reachable(ROBOT, found + 0.9e-3 * unit) and not rk.reachable(ROBOT, found + 1.1e-3 * unit)
    assert clamped(ROBOT, np.array([0.02, 0.03])).tolist() == [0.02, 0.03]


def test_on_the_outline_of_the_workspace_an_arm_is_stretched_or_folded():
    from rapkm_lite.figures.marks import workspace_outline

    robot = rk.Manipulator(base=[[-0.1, 0.0], [0.1, 0.0]], lengths=[0.3, 0.2], masses=0.1)
    outline = workspace_outline(robot)
    points = outline[np.isfinite(outline).all(axis=1)]
    reach = np.linalg.norm(points[:, None] - robot.base, axis=-1)
    stretched, folded = np.abs(reach - 0.5).min(axis=1), np.abs(reach - 0.1).min(axis=1)
    # Corners are cut by a cell of the grid at most.
    assert np.minimum(stretched, folded).max() < 0.01 and (stretched < 1e-3).any() and (folded < 1e-3).any()


def test_a_line_without_a_line_has_no_width_on_the_canvas():
    from rapkm_lite.figures.marks.palette import canvas_style

    assert canvas_style("line", (("linestyle", "none"), ("marker", "o"), ("linewidth", 3.0)))["width"] == 0.0
    assert canvas_style("line", (("linewidth", 3.0),))["width"] == 3.0


def test_the_middle_of_two_drives_is_that_of_three_at_equal_distances():
    from rapkm_lite.figures.marks import middle

    five_bar = rk.Manipulator(base=[[-0.2, 0.1], [0.2, 0.1]], lengths=0.3, masses=0.1)
    third = five_bar.base.mean(axis=0) + [0.0, 0.4 * np.sqrt(3) / 2]
    assert_allclose(middle(five_bar), np.mean([*five_bar.base, third], axis=0))


@pytest.fixture(autouse=True)
def close_figures():
    yield
    plt.close("all")


@pytest.mark.parametrize("lost", [np.nan, np.ma.masked])
def test_bands_count_lost_runs_and_show_none_of_them(lost):
    """Energies 1 to 10 J and two lost runs of twelve: ten twelfths are below 10 J, five below the mean of 5.5 J."""
    energies = np.ma.arange(1.0, 13.0)
    energies[10:] = [4.0, 8.0]
    energies[[3, 7]] = lost
    curve, mean, *_ = plotting.plot_bands({"a": energies}).lines
    np.testing.assert_allclose(curve.get_xydata()[-1], [10.0, 1000 / 12])
    np.testing.assert_allclose(mean.get_xydata(), [[5.5, 500 / 12]])
    with pytest.raises(ValueError, match="samples\\['a'\\] has 12 lost runs; allowed"):
        plotting.plot_bands({"a": np.full(12, np.nan)})
