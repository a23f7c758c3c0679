"""Every figure function: units on every labelled axis, the axes it was given, rcParams untouched; what some show."""

import doctest
import functools
import inspect
import itertools

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import pytest

import rapkm_lite as rk
from rapkm_lite import plotting

OFFSET = np.array([4e-3, -2e-3, 5e-3])
# The axes of pure numbers: ratios, shares, and singular values of matrices between joint angles.
PURE_NUMBERS = {
    "share of runs below, %",
    r"step of the torque over width of the friction band, $k_P\Delta_c / (2f_c)$",
    "torque jumps per second",
    "largest singular value of F",
    "effective / nominal gain",
    "gain of drive 3 / gain of drives 1 and 2",
    "visible share β, all drives",
    r"$\sigma_\mathrm{min}(\tilde{A}_1)$",
    "σ_min(Ã), all drives",
    r"$\mathrm{σ}_{\mathrm{min}}$(Ã), all drives",
    "share of the edge",
    "share that still fights",
    "all links too long by the share ε",
    "condition number of A",
    r"share $|\eta_i|$ of the prestress",
    "component of drive 1",
    "component of drive 2",
}


@pytest.fixture(scope="module")
def world():
    robot = rk.load().replace(friction=0.0)
    path, law = rk.triangle(robot), rk.PD(7.05, 0.225)
    runs = {
        "plain": rk.simulate(robot, law, path, OFFSET),
        "filter": rk.simulate(robot, rk.AntagonismFilter(law), path, OFFSET),
    }
    return {
        "robot": robot,
        "path": path,
        "law": law,
        "runs": runs,
        "run": runs["plain"],
        "q": rk.inverse_kinematics(robot, [0.02, -0.03]),
        "switched": rk.simulate(robot, rk.SwitchedCTC(900, 60), path),
    }


def scatter(k):
    return np.random.default_rng(3).uniform(0.1, 1.0, k)


def values_first(xyv):
    x, y, values = xyv
    return values, x, y


CALLS = {
    "plot_five_bar_curves": lambda w: (w["robot"], [-0.1, -0.06], [0.1, -0.06]),
    "plot_spacing": lambda w: (np.array([0.2, 0.1, 0.05]), np.array([0.1, 0.03, 0.008])),
    "plot_demand": lambda w: (np.linspace(0, 1, 9), scatter(9), {"equal": np.array([0.25, 0.5, 0.75])}),
    "plot_geometry_maps": lambda w: (w["robot"], {"longer": w["robot"].replace(lengths=0.2002)}, 7.05),
    "plot_model_share": lambda w: (np.array([1e-3, 1e-2]), np.array([2e-4, 2e-3]), w["path"].t, 0 * w["path"].t),
    "plot_hunting_maps": lambda w: (np.array([1.0, 5.0]), np.array([500, 2000]), {"v0": 200 * np.eye(2)}, 4.2e-3),
    "plot_saturation": lambda w: (np.array([0.05, 0.1]), {"PD": scatter(2), "filter": scatter(2)}),
    "plot_faulty_runs": lambda w: (w["runs"],),
    "plot_mode_maps": lambda w: (
        w["robot"],
        *values_first(rk.actuation_map(w["robot"], mode=rk.working_modes(w["robot"]), n=41)),
    ),
    "plot_parameterization_singularities": lambda w: (w["path"], np.array([0.0, 0.12])),
    "plot_prestress_maps": lambda w: (w["robot"],),
    "plot_available_forces": lambda w: (w["robot"], w["q"]),
    "plot_pair_measures": lambda w: (w["path"],),
    "plot_disagreement": lambda w: (w["robot"], w["q"], OFFSET, 7.05),
    "plot_rest_torques": lambda w: (w["run"], np.zeros(3)),
    "plot_gain_ratio": lambda w: (np.arange(1.0, 5.0), scatter(4), {"printed": scatter(4), "correct": scatter(4)}),
    "plot_fight_map": lambda w: (w["robot"], OFFSET, 7.05),
    "plot_torque_steps": lambda w: (7.05, 2 * np.pi / 2000, 4.2e-3),
    "plot_chatter": lambda w: (scatter(6), 100 * scatter(6), np.array([True, False] * 3)),
    "plot_log": lambda w: (rk.mystery_run("offset_a"),),
    "plot_joint_angles": lambda w: (w["robot"], w["q"]),
    "plot_cut_tree": lambda w: (w["robot"], w["q"] + 0.05),
    "plot_topology": lambda w: (w["robot"],),
    "plot_configuration_space": lambda w: (w["robot"], [[1, 1, 1]]),
    "plot_complement_size": lambda w: (w["path"], [(0, 1)]),
    "plot_loop_gaps": lambda w: (w["path"].t, {"gap": 1e-3 + 0 * w["path"].t}),
    "plot_pin_forces": lambda w: (w["robot"], w["q"], np.ones((3, 2))),
    "plot_working_modes": lambda w: (w["robot"], [0.02, -0.03]),
    "plot_synchronization": lambda w: (w["robot"], [0.0, 0.0], OFFSET),
    "plot_joint_moves": lambda w: (
        w["robot"],
        [-0.1, -0.06],
        [0.1, -0.06],
        np.array([0.2, 0.1]),
        np.array([0.1, 0.03]),
        4e-3,
    ),
    "plot_singular_poses": lambda w: (w["path"],),
    "plot_feedback_map": lambda w: (w["robot"], (0, 1)),
    "plot_feedback_along": lambda w: (w["path"],),
    "plot_torques_and_errors": lambda w: (w["run"],),
    "plot_ee_paths": lambda w: (w["runs"],),
    "plot_pairs": lambda w: (w["switched"],),
    "plot_partition_rules": lambda w: (w["robot"],),
    "plot_effective_gain": lambda w: (w["path"], np.diag([1.0, 1, 1, 0, 0, 0])),
    "plot_step_response": lambda w: (w["path"].t, {"measured": w["path"].t}, {"predicted": w["path"].t}),
    "plot_lyapunov": lambda w: (w["path"].t, {"one": np.exp(-w["path"].t), "two": np.exp(-2 * w["path"].t)}, 1.0),
    "plot_antagonism": lambda w: (w["run"],),
    "plot_torque_norms": lambda w: (w["runs"],),
    "plot_torque_plane": lambda w: (w["runs"],),
    "plot_energies": lambda w: ({"a": scatter(3), "b": scatter(3)},),
    "plot_table1": lambda w: (rk.table1(),),
    "plot_landscape": lambda w: (np.arange(4.0), scatter(64).reshape(4, 4, 4), scatter(64).reshape(4, 4, 4)),
    "plot_gain_curve": lambda w: (np.geomspace(1, 50, 5), scatter(5), scatter(5), scatter(5)),
    "plot_placement": lambda w: (w["robot"], np.zeros((3, 2)), scatter(3)),
    "plot_bands": lambda w: ({"a": scatter(20), "b": scatter(20)},),
    "plot_readings": lambda w: (["a", "b"], [0, 0], [1, 1], scatter(6).reshape(3, 2), scatter(2)),
}
FIGURES = sorted(n for n in plotting.__all__ if n.startswith("plot_"))


def drawn(name, world, **given):
    """What a figure returns for the arguments above, or the `ax` of the example in its docstring."""
    function = functools.partial(getattr(plotting, name), **given)
    if name in CALLS:
        return function(*CALLS[name](world))
    example = doctest.DocTestParser().get_examples(getattr(plotting, name).__doc__)
    assert example, f"{name} has neither arguments in CALLS nor an example in its docstring"
    names = {name: function}
    exec("".join(line.source for line in example).replace(f"plotting.{name}(", f"{name}("), names)
    return names["ax"]


def test_arguments_are_for_figures_that_exist():
    assert set(CALLS) <= set(FIGURES)


@pytest.mark.parametrize("name", FIGURES)
def test_axes_carry_units(name, world):
    before = dict(matplotlib.rcParams)
    function = getattr(plotting, name)
    returned = drawn(name, world)
    try:
        figure = plt.gcf()
        figure.canvas.draw()
        labels = [label for ax in figure.axes for label in (ax.get_xlabel(), ax.get_ylabel()) if label]
        assert labels or name in ("plot_topology", "plot_pair_curves"), "no axis is labelled"
        for label in labels:
            assert " in " in label or label in PURE_NUMBERS, f"no unit in {label!r}"
        assert returned is not None and function.__doc__
        assert "ax" in inspect.signature(function).parameters or "axes" in inspect.signature(function).parameters
        assert dict(matplotlib.rcParams) == before
    finally:
        plt.close("all")


@pytest.mark.parametrize("name", [n for n in FIGURES if "ax" in inspect.signature(getattr(plotting, n)).parameters])
def test_given_axes_are_used_and_returned(name, world):
    figure = plt.figure()
    ax = figure.add_subplot(projection="3d" if name == "plot_configuration_space" else None)
    try:
        assert drawn(name, world, ax=ax) is ax
        assert plt.get_fignums() == [figure.number]
    finally:
        plt.close("all")


def test_forces_in_newtons_share_no_axes_with_the_workspace():
    robot = rk.load()
    poses = {"middle": rk.inverse_kinematics(robot, [0.0, 0.0])}
    _, axes = plt.subplots(1, 1, squeeze=False)
    try:
        with pytest.raises(ValueError, match="plot_guaranteed_force cannot draw"):
            plotting.plot_guaranteed_force(robot, poses, lambda A, c: 0.5, axes[0], n=9)
    finally:
        plt.close("all")


@pytest.mark.parametrize("name", [n for n in FIGURES if "axes" in inspect.signature(getattr(plotting, n)).parameters])
def test_axes_of_its_own_are_what_a_picture_takes(name, world):
    try:
        made = drawn(name, world)
        assert drawn(name, world, axes=made) is made
        if np.size(made) > 1:
            with pytest.raises(ValueError, match=r"axes = .*; allowed: .*axes as it makes and returns them itself"):
                drawn(name, world, axes=np.ravel(made)[:1])
    finally:
        plt.close("all")


def test_arms_are_told_without_colour():
    # In greyscale by their dashes; colours are held apart in test_colours.
    dashes = [plotting.arm_line(i)["linestyle"] for i in range(4)]
    assert len(set(dashes)) == 4
    assert len({tuple(map(str, plotting.arm_line(i).values())) for i in range(12)}) == 12


@pytest.mark.parametrize("mode", rk.working_modes(rk.load()))
def test_an_arc_is_drawn_once(mode):
    """Either the contour of the cross product finds it, whose sign changes there, or `touching_arcs`."""
    robot = rk.load()
    for k, pair in enumerate(rk.drive_pairs(robot)):
        for arc in plotting.touching_arcs(robot, pair, mode):
            middle = robot.base[list(pair)].mean(axis=0)
            sides = middle + np.array([0.99, 1.01])[:, None, None] * (arc - middle)
            sides = sides[:, rk.reachable(robot, sides).all(axis=0)]
            inner, outer = rk.distal_cross_products(robot, rk.inverse_kinematics(robot, sides, mode))[..., k]
            assert np.all(inner * outer > 0.0)


def test_a_space_of_base_angles_takes_three_of_them():
    with pytest.raises(ValueError, match="robot has 2 arms; allowed: 3 or more"):
        plotting.plot_configuration_space(rk.load("five_bar"), [(1, 1)])


@pytest.fixture(scope="module")
def runs():
    robot = rk.load().replace(friction=0.0)
    path, law = rk.triangle(robot), rk.PD(7.05, 0.225)
    return {
        "plain": rk.simulate(robot, law, path, OFFSET),
        "filter": rk.simulate(robot, rk.AntagonismFilter(law, pose="true"), path, OFFSET),
    }


@pytest.fixture(autouse=True)
def close_figures():
    yield
    plt.close("all")


@pytest.mark.parametrize("pair", [(0, 1), (1, 2), (0, 2)])
def test_the_tip_of_a_five_bar_is_where_two_circles_meet(pair):
    robot = rk.load()
    x = np.array([0.02, -0.03])
    five_bar = robot.with_arms(pair)
    q_a = rk.inverse_kinematics(robot, x)[list(pair)] + OFFSET[list(pair)]
    tip = rk.forward_kinematics(five_bar, rk.estimate_pose(five_bar, q_a, x))
    elbows = robot.base[list(pair)] + 0.2 * np.stack([np.cos(q_a), np.sin(q_a)], axis=-1)
    np.testing.assert_allclose(np.linalg.norm(tip - elbows, axis=-1), 0.2, rtol=1e-12)


def test_all_arms_give_the_machine_back_and_a_wrong_choice_is_explained():
    robot = rk.load().replace(friction=[1e-3, 2e-3, 3e-3])
    same = robot.with_arms(range(3))
    assert same.same_kinematics(robot) and np.array_equal(same.friction, robot.friction)
    assert robot.with_arms((2, 0)).friction.tolist() == [3e-3, 1e-3]
    for wrong in ((0,), (1, 1), (0, 3)):
        with pytest.raises(ValueError, match=r"arms = .*allowed: two or more"):
            robot.with_arms(wrong)


def test_distance_from_the_origin_of_the_torque_plane_is_the_torque(runs):
    ax = plotting.plot_torque_plane(runs)
    for line, run in zip(ax.lines, runs.values(), strict=False):
        np.testing.assert_allclose(np.hypot(*line.get_data()), 1e3 * np.linalg.norm(run.c[::20], axis=-1), rtol=1e-9)
    assert np.abs(ax.lines[1].get_xdata()).max() < 1e-11


def test_curves_carry_the_numbers_of_the_run_in_the_unit_of_the_axis(runs):
    plain, _ = runs.values()
    for plot, values, unit in (
        (plotting.plot_torques, 1e3 * plain.c, "mN m"),
        (plotting.plot_errors, 1e3 * plain.error, "mrad"),
        (plotting.plot_antagonism, 1e3 * rk.antagonistic_torque(plain), "mN m"),
    ):
        ax = plot(plain)
        assert ax.get_ylabel().endswith(f"in {unit}") and ax.get_xlabel() == "time in s"
        np.testing.assert_array_equal(np.stack([line.get_ydata() for line in ax.lines], axis=-1), values)
    large = plotting.plot_torques(plain, milli=False)
    assert large.get_ylabel() == "torque in N m" and large.lines[0].get_ydata()[0] == plain.c[0, 0]


# As the sentence says that refuses other values of `ax`.
def test_new_axes_where_none_are_given():
    path = rk.circle(rk.load(), 0.05, 0.2)
    run = rk.simulate(path.robot, rk.PD(7.05, 0.225), path)
    for values in (run.c, run.c.tolist()):
        lines = plotting.lines_per_drive(run, values, None, "torque in N m", "PD").get_lines()
        assert [np.array_equal(line.get_ydata(), c) for line, c in zip(lines, run.c.T, strict=True)] == [True] * 3
    assert plotting.plane_axes(path.robot, None).get_xlim() == plotting.plane_limits(path.robot)["xlim"]


def test_curves_stay_inside_shared_axes(runs):
    _, axes = plt.subplots(1, 2, sharey=True)
    plotting.plot_torques(runs["filter"], axes[0])
    plotting.plot_torques(runs["plain"], axes[1])
    low, high = axes[0].get_ylim()
    torques = 1e3 * np.concatenate([run.c for run in runs.values()])
    assert low < torques.min() and high > torques.max()


def test_bars_of_table_1_are_its_numbers():
    table = rk.table1()
    ax = plotting.plot_table1(table)
    heights = sorted(round(bar.get_height(), 9) for bar in ax.patches if np.isfinite(bar.get_x()))
    assert heights == sorted(np.round([*table.measured.ravel(), *table.simulated.ravel()], 9))


@pytest.mark.parametrize("size", [0.0, 1.0])
def test_two_five_bars_disagree_only_with_offsets(size):
    axes = plotting.plot_synchronization(rk.load(), [0.0, 0.0], size * OFFSET)
    tips = np.array([line.get_data() for line in axes[0].lines if line.get_marker() == "s"])[..., 0]
    gap = np.linalg.norm(tips[0] - tips[1])
    assert gap > 0.02 if size else gap < 1e-12
    assert axes[1].get_xlabel().endswith("mm")


def test_one_picture_per_working_mode():
    axes = np.ravel(plotting.plot_working_modes(rk.load(), [0.03, 0.02]))
    assert len({ax.get_title("left") + ax.get_title() for ax in axes}) == len(axes) == 8


def test_workspace_grid_keeps_off_the_boundary():
    robot = rk.load()
    x, y, inside, points = plotting.grid_points(robot, 121)
    q = rk.inverse_kinematics(robot, points)
    assert np.abs(np.sin(q[:, 3:])).min() > 1e-6
    np.testing.assert_array_equal(plotting.on_grid(inside, points)[inside], points)
    for wrong in (1.0, points[:1], points[:-1]):
        with pytest.raises(ValueError, match=rf"values has shape .*; allowed: \({len(points)}, ...\)"):
            plotting.on_grid(inside, wrong)
    i, j = np.argwhere(inside)[7]
    assert points[7].tolist() == [x[j], y[i]]


def test_a_wrong_call_of_a_picture_names_the_picture_as_python_does():
    for call, sentence in (
        (lambda: plotting.plot_ee_paths({}, ax=None), "plot_ee_paths() got an unexpected keyword argument 'ax'"),
        (lambda: plotting.plot_torques(), "plot_torques() missing a required argument: 'run'"),
    ):
        with pytest.raises(TypeError) as said:
            call()
        assert str(said.value) == sentence


def test_arguments_are_looked_at_before_a_picture_is_drawn(world):
    """What Matplotlib would have drawn, left out or turned into something else."""
    robot, q = world["robot"], world["q"]
    wrong = [
        ("offset", lambda: plotting.plot_synchronization(robot, [0.0, 0.0], ["0.1", "0.1", "0.1"])),
        ("pair", lambda: plotting.plot_ee_paths(world["runs"], pair="12")),
        ("labels", lambda: plotting.plot_machine(robot, q, labels=[1.0])),
        ("guaranteed", lambda: plotting.plot_available_forces(robot, q, guaranteed=-1.0)),
        ("F", lambda: plotting.plot_configuration_space(robot, [(1, 1, 1)], F="F")),
        ("n", lambda: plotting.plot_fight_map(robot, OFFSET, 7.05, n=10**18)),
        ("frames", lambda: plotting.film_workshop(robot, OFFSET, frames=10**18)),
        ("jumps", lambda: plotting.plot_chatter([0.5, 2.0], [1j, 40.0], [True, False])),
        ("gap", lambda: plotting.plot_spacing([0.1, 0.2], 0.0, ("offsets", 5e-3))),
        ("colour", lambda: plotting.plot_workspace(robot, colour="no colour")),
        ("run", lambda: plotting.plot_pairs(world["run"])),
        ("names", lambda: plotting.plot_readings("ab", [0, 0], [1, 1], scatter(6).reshape(3, 2))),
    ]
    for name, call in wrong:
        with pytest.raises(ValueError, match=rf"\b{name}\b.*allowed"):
            call()


def test_lists_are_arrays_and_curves_may_have_gaps():
    plotting.plot_saturation([0.1, 0.2], {"PD": [1e-3, 1e-4]})
    plotting.plot_demand([0.0, 0.5, 1.0], [0.1, 0.0, 0.1], {"equal": [0.5]})
    plotting.plot_gain_curve([1.0, 7.0, 9.0], [2.0, np.nan, 4.0], [2.0, 2.1, 2.2], [0.2, 3.0, 4.0])
    plotting.plot_chatter([0.5, 2.0], [0.0, 40.0], [True, False])


def test_a_rest_is_told_by_flags_of_any_kind():
    for flags in ([True, False, True], [1, 0, 1], np.array([1.0, 0.0, 1.0])):
        rest, none = plotting.plot_chatter([0.5, 2.0, 0.7], [0.0, 40.0, 1.0], flags).lines[1:3]
        assert rest.get_xdata().tolist() == [0.5, 0.7] and none.get_xdata().tolist() == [2.0]


@pytest.mark.parametrize("x", [[0.0, 0.0], [0.01, 0.02]])
def test_lines_that_are_nearly_parallel_frame_no_picture(x):
    four = rk.load("four_arms")
    q = rk.inverse_kinematics(four, x)
    ax = plotting.plot_disagreement(four, q, [4e-3, -2e-3, 5e-3, 0.0], 7.05)
    assert np.ptp(ax.get_xlim()) < 10.0


def test_pictures_of_lost_runs_show_all_that_there_is(world):
    whole, path = world["run"], world["path"]
    with pytest.raises(rk.SimulationError) as caught:
        rk.simulate(world["robot"], rk.CTC(400.0, 40.0), path, OFFSET)
    lost = caught.value.partial
    for runs in ({"PD": whole, "lost": lost}, {"lost": lost, "PD": whole}):
        assert plotting.plot_torque_norms(runs).get_xlim() == (0.0, path.t[-1])
    assert plotting.plot_torques_and_errors(lost, pair=(0, 1))[0].lines
    error = plotting.plot_clipping(whole, lost, 0.1)[1].lines[0].get_ydata()
    np.testing.assert_allclose(error, 1e3 * lost.path_error)


def test_a_move_takes_the_short_way_round(world):
    """At the left of the workspace a base angle passes half a turn."""
    start, stop = [-0.15, 0.0], [-0.15, 0.06]
    line = plotting.plot_joint_moves(world["robot"], start, stop, [0.015, 0.03], [2e-3, 7e-3], 5e-3)[0].lines[1]
    np.testing.assert_allclose([line.get_xdata()[-1], line.get_ydata()[-1]], [-150.0, 60.0], atol=1e-6)


def test_bands_of_samples_that_are_not_positive_have_a_linear_axis():
    samples = {"a": [[0.0, 0, 0], [1.0, 2, 3]], "b": [[-1.0, -2, -3], [1, 2, 3]], "c": [[1.0, 1, 1], [20.0, 30, 40]]}
    axes = plotting.plot_law_bands(["one", "two"], samples)
    assert [ax.get_xscale() for ax in axes] == ["linear", "linear", "log"]
    assert all(ax.get_xlim()[0] <= min(ax.lines[0].get_xdata()) for ax in axes)


@pytest.mark.parametrize("times, shift", [(0.1, (0.0, 0.0)), (3.0, (40.0, -7.0))])
def test_a_machine_of_another_size_and_place_is_in_the_same_frame(world, times, shift):
    robot = world["robot"]
    other = robot.replace(base=times * robot.base + shift, lengths=times * robot.lengths, masses=0.1)

    def there(x):
        return times * np.array(x) + shift

    def at_rest(r, x):
        path = rk.hold(r, x, 0.005)
        return rk.simulate(r, world["law"], path)

    for plot in (
        lambda r, place: plotting.plot_feedback_map(r, (0, 1), n=21),
        lambda r, place: plotting.plot_partition_rules(r, n=21)[0],
        lambda r, place: plotting.plot_modes_and_forces(r, place([0.0, 0.0]), [(1, 1, 1), (1, 1, -1)])[0],
        lambda r, place: plotting.plot_synchronization(r, place([0.0, 0.0]), OFFSET)[0],
        lambda r, place: plotting.plot_ee_paths({"PD": at_rest(r, place([0.0, 0.0]))}, pair=(0, 1))[1],
        lambda r, place: plotting.plot_mirror(at_rest(r, place([0.0, 0.0])), 0, (0, 1))[0],
        lambda r, place: plotting.plot_mirror(at_rest(r, place([0.0, 0.0])), 0, (0, 1))[1],
    ):
        ax, own = plot(other, there), plot(robot, np.array)
        corners = there(np.transpose([own.get_xlim(), own.get_ylim()]))
        np.testing.assert_allclose(np.transpose([ax.get_xlim(), ax.get_ylim()]), corners, atol=1e-12)
        plt.close("all")
    move = [there([-0.05, 0.0]), there([0.05, 0.0]), times * np.array([0.015, 0.03]), [2e-3, 7e-3], 5e-3]
    line = plotting.plot_joint_moves(other, *move)[0]
    assert all(abs(np.subtract(line.get_ylim(), 1e3 * there([0.0, 0.0])[1])) < 40.0 * times)
    tree = plotting.plot_cut_tree(other, rk.inverse_kinematics(other, there([0.02, -0.03])) + 2e-2 * np.eye(6)[0])
    assert len(tree.texts) == 1, "one gap, of 2 % of a length, in either size"
    path = rk.triangle(other, 0.12 * times, centre=there([0.0, 0.0]))
    ax = plotting.plot_pair_measures(path)
    assert ax.get_ylim()[0] < ax.lines[-1].get_ydata().min() < ax.lines[-1].get_ydata().max() < ax.get_ylim()[1]


@pytest.mark.parametrize("turn", [np.pi / 3, 2.0, -0.4])
def test_a_machine_that_is_turned_is_in_the_frame(turn):
    """All that it reaches stays in the pictures that show where its drives are singular."""
    c, s = np.cos(turn), np.sin(turn)
    for robot in (rk.load(), rk.load("asymmetric")):
        turned = robot.replace(base=robot.base @ np.array([[c, s], [-s, c]]))
        x, y, inside = rk.workspace_grid(turned, 61)
        there = np.stack(np.meshgrid(x, y), axis=-1)[inside]
        for ax in (plotting.plot_feedback_map(turned, (0, 1), n=21), *plotting.plot_partition_rules(turned, n=21)):
            low, high = np.transpose([ax.get_xlim(), ax.get_ylim()])
            assert np.all(low < there.min(axis=0)) and np.all(there.max(axis=0) < high)
            plt.close("all")


def test_accelerations_of_a_hanging_machine_are_those_of_all_torques_and_its_weight():
    robot = rk.load().replace(gravity=[0.0, -9.81], friction=0.0)
    ax = plotting.plot_accelerations(robot, [[0.0, 0.0]], 0.3)[0]
    q = rk.inverse_kinematics(robot, [0.0, 0.0])
    corners = 0.3 * np.array([(a, b, c) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)])
    at = rk.at(robot, q)
    right = np.linalg.lstsq(at.F, rk.forward_dynamics(robot, q, 0 * q, corners)[0].T, rcond=None)[0]
    shown = ax.patches[0].get_xy()
    np.testing.assert_allclose(shown.min(axis=0), right.min(axis=1), atol=1e-9)
    np.testing.assert_allclose(shown.max(axis=0), right.max(axis=1), atol=1e-9)


def test_places_at_the_rim_are_seen(world):
    ax = plotting.plot_places(world["robot"], {"low": [[0.0, -0.12]], "left": [[-0.15, 0.05]]})[1]
    for line in ax.lines[:2]:
        assert ax.get_xlim()[0] < line.get_xdata().min() and ax.get_ylim()[0] < line.get_ydata().min()


def test_what_cannot_be_told_apart_is_refused():
    with pytest.raises(ValueError, match="samples has 3 entries; allowed: 1 to 2"):
        plotting.plot_bands({"a": [3.0, 5.0], "b": [1.0, 2.0], "c": [7.0, 8.0]})


@pytest.mark.parametrize("n", [20, 21, 41])
def test_a_sample_on_a_singular_curve_leaves_a_gap(n):
    """With an odd number of samples the middle line of a five-bar's map is where its drives cannot push."""
    robot = rk.load("five_bar")
    for ax in (plotting.plot_feedback_map(robot, (0, 1), n=n), plotting.plot_one_sign(rk.triangle(robot, 0.1), n=n)):
        assert ax.collections
        plt.close("all")


def test_a_linkage_of_other_lengths_and_unlike_drives_are_refused():
    robot = rk.load()
    for other in (rk.load("asymmetric"), robot.replace(lengths=0.22, centers=None)):
        with pytest.raises(ValueError, match="allowed: four equal links"):
            plotting.plot_crossed_linkage(other, (0, 1))
    unlike = robot.replace(resistance=[0.6, 0.6, 1.2])
    run = rk.simulate(unlike, rk.PD(7.05, 0.225), rk.circle(unlike, 0.05, 0.1))
    with pytest.raises(ValueError, match=r"runs\['PD'\] .*allowed: equal drives"):
        plotting.plot_torque_plane({"PD": run})
    with pytest.raises(ValueError, match=r"arms = 5; allowed: .*to 2"):
        plotting.plot_machine(robot, rk.inverse_kinematics(robot, [0.0, 0.0]), arms=(5,))


def refused_with(words, picture, *args, **named):
    with pytest.raises(ValueError, match=words):
        picture(*args, **named)
    plt.close("all")


@pytest.mark.parametrize("name", ["plot_crossed_linkage", "film_force_polygon", "plot_parameterization_singularities"])
def test_the_pair_that_a_picture_takes_by_itself_is_looked_at_too(name):
    """Its default pair (2,3) is none of a five-bar."""
    robot = rk.load("five_bar")
    first = rk.circle(robot, 0.03, 0.1, centre=[0.0, 0.1]) if name.startswith("plot_param") else robot
    more = () if name == "plot_crossed_linkage" else ([0.0, 0.1],)
    refused_with(r"pair = \(1, 2\); allowed: .*from 0 to 1", getattr(plotting, name), first, *more)


def test_a_sample_of_a_run_lies_within_the_run():
    path = rk.hold(rk.load(), [0.02, 0.0], 6.0)
    run = rk.simulate(path.robot, rk.PD(7.05, 0.225), path)
    ax = plotting.plot_mirror(run, 6000, (0, 1))[0]
    assert ax.get_title() == "6.00 s"
    assert plotting.plot_mirror(run, 6000.0, (0.0, 1.0))[0].get_title() == "6.00 s"  # a whole number
    refused_with("k = 6001; allowed: .*to 6000", plotting.plot_mirror, run, 6001, (0, 1))
    refused_with(r"pair = \(0, 1\): the path crosses its curve 0 times", plotting.film_mirror, run, (0, 1))


@pytest.mark.parametrize("arms", [(2.0,), [0.0, 2.0], np.array([0.0, 1.0])])
def test_arms_in_a_picture_may_be_whole_numbers_of_any_kind(world, arms):
    drawn = [plotting.plot_machine(world["robot"], world["q"], arms=some) for some in (arms, list(map(int, arms)))]
    one, other = ([line.get_xydata().tolist() for line in ax.lines] for ax in drawn)
    assert one == other
    plt.close("all")


@pytest.mark.parametrize("text", ["a", "a" * 10**6], ids=["short", "long"])
def test_a_dict_is_asked_for_before_anything_is_drawn(world, text):
    """A figure with an axes for each of a million letters would take minutes."""
    refused_with("models = 'a.*; allowed: a dict", plotting.plot_geometry_maps, world["robot"], text, 7.05)
    refused_with("columns = 'a.*; allowed: a dict", plotting.plot_law_bands, ["PD"], text)
    given = [0.1, 0.0, 0.0], [0.5, 0.5, 0.5], 0.2, (-0.1, 0.1)
    refused_with("marks = 'a.*; allowed: a dict", plotting.plot_room, *given, text)
    assert not plt.get_fignums()


def test_what_stands_side_by_side_has_as_many_parts_as_the_picture(world):
    robot, q, gap = world["robot"], world["q"], [0.0, 1e-3]
    refused_with(r"forces has shape \(2, 2\); allowed: \(3, 2\)", plotting.plot_pin_forces, robot, q, np.ones((2, 2)))
    for gaps, poses in (("ab", "a"), ("a", "ab"), ("abc", "ab")):
        given = dict.fromkeys(gaps, gap), {name: [q, q] for name in poses}
        refused_with("(gaps|poses) has . entries; allowed: 2", plotting.film_loops, robot, [0.0, 1.0], *given, frames=2)
    three = dict.fromkeys("abc", gap)
    refused_with("theories has 3 entries; allowed: 1 to 2", plotting.plot_gain_ratio, [0.5, 1.0], gap, three)
    assert len(plotting.plot_gain_ratio([0.5, 1.0], gap, {"one": gap}).lines) == 2
    refused_with("rule = 'cross'; allowed: 'sigma_min'", plotting.plot_partition_rules, robot, ("cross",), n=9)
    assert len(plotting.plot_partition_rules(robot, ("sigma_min",), n=9)) == 1
    plt.close("all")


def test_a_frame_with_the_drives_holds_them_all_and_is_that_of_the_testbed():
    testbed = rk.load()
    small = testbed.replace(lengths=0.15, centers=None)
    try:
        for robot in (testbed, small):
            ax = plotting.plot_placement(robot, [[0.0, 0.0], [0.02, 0.0]], [1.0, 2.0])
            (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
            assert np.all(robot.base > [left, low]) and np.all(robot.base < [right, high])
            if robot is testbed:
                assert (left, right, low, high) == (-0.27, 0.27, -0.2, 0.29)
    finally:
        plt.close("all")


def test_names_of_six_arms_keep_apart():
    base = rk.load().base
    six = rk.Manipulator(np.concatenate([base, -base]), 0.2, masses=0.1)
    try:
        ax = plotting.plot_topology(six)
        ax.figure.draw_without_rendering()
        words = [(t.get_text(), t.get_window_extent()) for t in ax.texts if t.get_text()]
        assert len(words) == 1 + 2 * 6 + 2 * 6 + 5
        for (one, a), (other, b) in itertools.combinations(words, 2):
            assert not a.overlaps(b), (one, other)
        right = {f"$q^{{{i + 1}}}$ driven": ax.transData.transform((i + 1, 0))[0] for i in range(5)}
        assert all(box.x1 < right[word] for word, box in words if word in right)
    finally:
        plt.close("all")


def idle(robot, x=(0.0, 0.0)):
    """A run in which nothing happens: no offset, no motion, no weight."""
    return rk.simulate(robot, rk.PD(7.05, 0.225), rk.hold(robot, x, 0.05))


def test_rounding_is_a_flat_line(world):
    """What has no cause in the model is zero; its curves take less than a thousandth of the axis."""
    robot, path = world["robot"], rk.circle(world["robot"], 0.03, 0.5)
    still, filtered = idle(robot), rk.simulate(robot, rk.AntagonismFilter(rk.PD(7.05, 0.225)), path)
    zero = {"limit": 0.1, "t": still.t, "nothing": np.full((len(still), 2), 1e-17)}
    drawn_axes = [
        plotting.plot_torques(still),
        plotting.plot_torques(still, milli=False),
        plotting.plot_errors(still),
        plotting.plot_antagonism(filtered),
        plotting.plot_rest_torques(still, np.zeros(3)),
        plotting.plot_torque_norms({"idle": still}),
        plotting.plot_torque_norms({"filter": filtered}, antagonism=True),
        plotting.plot_torque_choices(still.trajectory, {"idle": still.c})[0],
        plotting.plot_filter_share(still, 0.5)[0],
        plotting.plot_clipping(still, still, zero["limit"])[1],
        *plotting.plot_log(still.log()),
        plotting.plot_slow_error(still.t, zero["nothing"], zero["nothing"]),
    ]
    for ax in drawn_axes:
        values = np.concatenate([line.get_ydata() for line in ax.lines if len(line.get_ydata()) > 2])
        assert np.ptp(values) < 1e-3 * np.ptp(ax.get_ylim()), ax.get_ylabel()


@pytest.mark.parametrize("times", [5e-3, 1.0, 50.0])
def test_what_is_flat_is_asked_of_the_machine(times):
    """Scaled by s at equal density, torques over the same angles go with s^5: the same picture at every size."""
    robot = rk.load().replace(friction=0.0, rotor_inertia=0.0)
    scaled = robot.replace(base=times * robot.base, lengths=times * robot.lengths, masses=times**3 * robot.masses)
    path = rk.circle(scaled, 0.05 * times, 0.5)
    run = rk.simulate(scaled, rk.PD(7.05 * times**5, 0.225 * times**5), path, OFFSET)
    for ax in (plotting.plot_torques(run), plotting.plot_antagonism(run), *plotting.plot_log(run.log())):
        values = np.concatenate([line.get_ydata() for line in ax.lines])
        assert np.ptp(values) > 0.5 * np.ptp(ax.get_ylim())
    ax = plotting.plot_torque_norms({"run": run}, log=True)
    low, high = ax.get_ylim()
    assert low < ax.lines[0].get_ydata().min() and ax.lines[0].get_ydata().max() < high


def test_pairs_of_nine_drives_are_told_apart():
    arms = [plotting.arm_line(i) for i in range(36)]
    assert len({(line["color"], str(line["linestyle"])) for line in arms}) == 36


def ring(N):
    angle = np.pi / 2 + 2 * np.pi * np.arange(N) / N
    base = 0.23 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return rk.Manipulator(base=base, lengths=0.2, masses=0.1)


@pytest.mark.parametrize("N", [3, 5, 6])
def test_names_of_angles_hide_no_other_name_and_no_drive(N):
    robot = ring(N)
    ax = plotting.plot_joint_angles(robot, rk.inverse_kinematics(robot, [0.02, 0.05]))
    ax.figure.canvas.draw()
    boxes = [text.get_window_extent() for text in ax.texts if text.get_text()]
    assert len(boxes) == 2 * N
    assert not any(a.overlaps(b) for a, b in itertools.combinations(boxes, 2))
    drives = ax.transData.transform(robot.base)
    assert not any(box.contains(*drive) for box in boxes for drive in drives)


def test_a_legend_of_many_drives_stays_on_its_axes():
    run = idle(ring(7))
    ax = plotting.plot_torques(run)
    ax.figure.canvas.draw()
    legend, room = ax.get_legend().get_window_extent(), ax.get_window_extent()
    assert room.x0 <= legend.x0 and legend.x1 <= room.x1 + 1.0


@pytest.mark.parametrize("name", ["testbed", "four_arms"])
@pytest.mark.parametrize(
    ("size", "shape"), [((12, 7), (2, 3)), ((10, 6), (2, 2)), ((8, 3), (1, 2)), ((6.4, 4.8), (2, 1))]
)
def test_a_legend_lies_on_no_curve_on_axes_of_any_shape(name, size, shape):
    robot = rk.load(name)
    run = rk.simulate(robot, rk.PD(7.05, 0.225), rk.circle(robot, 0.05, 1.0))
    figure, axes = plt.subplots(*shape, figsize=size)
    ax = plotting.plot_torques(run, np.ravel(axes)[0])
    figure.canvas.draw()
    legend = ax.get_legend().get_window_extent()
    for line in ax.get_lines():
        points = ax.transData.transform(line.get_xydata())
        assert not np.any(np.all((points > legend.min + 1.0) & (points < legend.max), axis=-1))  # a pixel
    plt.close(figure)


def test_a_sheet_about_a_middle_that_no_arm_reaches_is_whole():
    """Without folding limits the workspace is convex: any place in it sees all of it, and the sheet has no jump."""
    robot = rk.load().replace(lengths=[[0.1, 0.1], [0.2, 0.2], [0.3, 0.3]])
    assert not rk.reachable(robot, robot.base.mean(axis=0))
    ax = plotting.plot_configuration_space(robot, [(1, 1, 1)])
    rim = np.stack(ax.lines[0].get_data_3d(), axis=-1)
    assert np.abs(np.diff(rim, axis=0)).max() < 180.0  # a jump would be a turn
    folded = rk.load().replace(lengths=[[0.4, 0.15]] * 3)
    with pytest.raises(ValueError, match=r"robot has a workspace with holes, .*allowed"):
        plotting.plot_configuration_space(folded, [(1, 1, 1)])


def test_readings_below_zero_are_inside():
    t = np.linspace(0.0, 1.0, 50)
    ax = plotting.plot_counted(t, -1e-3 * np.rint(5 * t + 2), -1e-3 * (5 * t + 2))[0]
    assert ax.get_ylim()[1] > -2.0


def test_a_short_run_is_drawn_to_its_end(world):
    run = idle(world["robot"])
    assert plotting.plot_filter_share(run, 0.5)[0].lines[0].get_xdata()[-1] == run.t[-1]
    assert len(plotting.plot_torque_plane({"idle": run}).lines[0].get_xdata()) == len(run)


def test_energies_are_asked_for_by_the_name_that_a_run_has_for_them(world):
    run, words = world["run"], "energies in J, one per drive, such as run.energy"
    for energies in (run, rk.sweep(run.robot, run.law, run.trajectory, [OFFSET]), np.ones((2, 3)), [], 1.0, None):
        with pytest.raises(ValueError, match=rf"^rows\['a'\] .*; allowed: {words}$"):
            plotting.plot_energies({"a": energies})
    for rows in (run, [run, run], {}):
        with pytest.raises(ValueError, match=rf"^rows = .*; allowed: a dict that is not empty, {words}, by its label$"):
            plotting.plot_energies(rows)
    with pytest.raises(ValueError, match=r"^rows\['a'\]\[1\] = nan; "):
        plotting.plot_energies({"a": [1.0, np.nan]})


def test_every_drive_of_the_largest_machine_has_its_name_below_its_bar():
    ax = plotting.plot_energies({"three drives": [1.0, 2.0, 3.0], "two": [1.0, 2.0]})
    assert [label.get_text() for label in ax.get_xticklabels()] == ["drive 1", "drive 2", "drive 3"]


@pytest.mark.parametrize(
    "robot, x, pair", [(rk.load("four_arms"), [0.0, 0.0], "1 and 3"), (rk.load(), [0.0, 0.2309], "1 and 2")]
)
def test_a_pair_that_sees_no_pose_is_named(robot, x, pair):
    """Opposite arms of a square are parallel in its middle; at a corner of the workspace two arms are stretched."""
    with pytest.raises(ValueError, match=f"drives {pair} alone: .*; allowed"):
        plotting.plot_synchronization(robot, x, np.full(robot.n_arms, 4e-3))


@pytest.mark.parametrize("x", [[0.05, -0.03], [-0.04, 0.02], [0.03, 0.05], [0.06, 0.05]])
def test_names_of_pairs_that_nearly_agree_do_not_touch(x):
    """Six pairs of four arms: each name once, none on another or on a point."""
    ax = plotting.plot_synchronization(rk.load("four_arms"), x, [4e-3, -2e-3, 5e-3, 0.0])[1]
    ax.figure.canvas.draw()
    words = [*ax.texts, *ax.get_legend().get_texts()]
    names = [f"drives {j + 1}, {k + 1}" for j, k in rk.drive_pairs(rk.load("four_arms"))]
    assert [word.get_text() for word in words] == [*names, "least squares", "true"]
    boxes = [word.get_window_extent() for word in words]
    assert not [1 for k, a in enumerate(boxes) for b in boxes[k + 1 :] if a.overlaps(b)]
    points = np.vstack([ax.transData.transform(line.get_xydata()) for line in ax.lines])
    assert not any(box.contains(*point) for box in boxes for point in points)
    # A square stands beside the name of the pair whose colours it has.
    for handle, (j, k) in zip(ax.get_legend().legend_handles, rk.drive_pairs(rk.load("four_arms")), strict=False):
        assert handle.get_color() == plotting.arm_colour(j)
        assert handle.get_markerfacecoloralt() == plotting.arm_colour(k)


def test_bars_of_any_size_have_their_numbers():
    for size, words in ((1e-11, "1e−11"), (1.5, "1.50"), (2e15, "2e+15")):
        ax = plotting.plot_energies({"a": [size, size / 2]})
        assert ax.texts[0].get_text() == words and ax.get_ylim()[1] > size
    assert plotting.plot_energies({"a": [-1.0, -2.0]}).get_ylim()[1] > 0.0


@pytest.mark.filterwarnings("error")
def test_a_run_of_one_sample_is_seen(world):
    def law(t, q_a, qd_a, desired):
        if t > 0.0:
            raise ValueError("no more")
        return np.array([0.1, 0.0, -0.1])

    with pytest.raises(rk.SimulationError) as caught:
        rk.simulate(world["robot"], law, world["path"])
    one = caught.value.partial
    assert len(one) == 1
    for ax in (plotting.plot_torques(one), plotting.plot_errors(one), plotting.plot_antagonism(one)):
        assert {line.get_marker() for line in ax.lines} == {"o"} and ax.get_xlim() == (0.0, one.dt)
    plotting.plot_torque_norms({"lost": one})
    plotting.plot_filter_share(one, 0.5)


def test_a_stiffness_without_frequency_is_refused(world):
    path = rk.hold(world["robot"], [0.0, 0.0], 0.01)
    for stiffness in (-2e3 * np.eye(2), [[0.0, 2e3], [2e3, 0.0]]):
        refused_with("stiffness = .*; allowed: springs that pull back", plotting.loop_frequencies, path, stiffness)
    free = plotting.loop_frequencies(path, np.diag([0.0, 2e3]))[0]  # a direction without a spring swings not at all
    assert free[0] == 0.0 and free[1] > 1.0


def test_a_limit_that_is_none_is_named_by_its_own_name(world):
    refused_with("limit = -0.1; allowed: > 0", plotting.plot_accelerations, world["robot"], [[0.0, 0.0]], -0.1)


def test_drives_disagree_at_a_pose_that_is_a_list(world):
    robot, q = world["robot"], world["q"]
    one, other = (plotting.plot_disagreement(robot, pose, OFFSET, 7.05) for pose in (q, q.tolist()))
    for line, same in zip(one.lines, other.lines, strict=True):
        np.testing.assert_array_equal(line.get_xydata(), same.get_xydata())
