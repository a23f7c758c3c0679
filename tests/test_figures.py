"""Every figure function: units on every labelled axis, the axes it was given, rcParams untouched."""

import doctest
import functools
import inspect

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
    "smallest σ_min(Ã) on the grid",
    "σ_min(Ã), all drives",
    "σ_min(Ã₁)",
    "share |η_i| of the prestress",
}


@pytest.fixture(scope="module")
def world():
    robot = rk.load().replace(friction=0.0)
    path, law = rk.triangle(robot), rk.PD(7.05, 0.225)
    runs = {"plain": rk.simulate(robot, law, path, OFFSET),
            "filter": rk.simulate(robot, rk.AntagonismFilter(law), path, OFFSET)}
    return {"robot": robot, "path": path, "law": law, "runs": runs, "run": runs["plain"],
            "q": rk.inverse_kinematics(robot, [0.02, -0.03]),
            "switched": rk.simulate(robot, rk.SwitchedCTC(900, 60), path)}


def scatter(k):
    return np.random.default_rng(3).uniform(0.1, 1.0, k)


def values_first(xyv):
    x, y, values = xyv
    return values, x, y


CALLS = {
    "plot_control_fields": lambda w: (w["robot"],),
    "plot_mode_maps": lambda w: (w["robot"], *values_first(rk.actuation_map(
        w["robot"], mode=rk.working_modes(w["robot"]), n=41))),
    "plot_grid_search": lambda w: (scatter(4), {"mode": scatter(4)}),
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
    "plot_joint_moves": lambda w: (w["robot"], [-0.1, -0.06], [0.1, -0.06], np.array([0.2, 0.1]), np.array([0.1, 0.03]),
                                   4e-3),
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
    names = vars(plotting) | {name: function}
    exec("".join(line.source for line in example), names)
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


def test_arms_differ_in_lightness():
    # Readable in greyscale: CIE lightness of the first three arms at least 15 apart.
    def lightness(colour):
        linear = np.array(matplotlib.colors.to_rgb(colour))
        linear = np.where(linear <= 0.04045, linear / 12.92, ((linear + 0.055) / 1.055) ** 2.4)
        return 116 * np.cbrt(linear @ [0.2126, 0.7152, 0.0722]) - 16

    values = sorted(lightness(c) for c in plotting.ARM_COLOURS[:3])
    assert np.diff(values).min() > 15
