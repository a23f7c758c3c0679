"""Figures of machines and runs show what they say; machines with fewer arms."""

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import pytest

import rapkm_lite as rk
from rapkm_lite import plotting

OFFSET = np.array([4e-3, -2e-3, 5e-3])


@pytest.fixture(scope="module")
def runs():
    robot = rk.load().replace(friction=0.0)
    path, law = rk.triangle(robot), rk.PD(7.05, 0.225)
    return {"plain": rk.simulate(robot, law, path, OFFSET),
            "filter": rk.simulate(robot, rk.AntagonismFilter(law, pose="true"), path, OFFSET)}


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
    for plot, values, unit in ((plotting.plot_torques, 1e3 * plain.c, "mN m"),
                               (plotting.plot_errors, 1e3 * plain.error, "mrad"),
                               (plotting.plot_antagonism, 1e3 * rk.antagonistic_torque(plain), "mN m")):
        ax = plot(plain)
        assert ax.get_ylabel().endswith(f"in {unit}") and ax.get_xlabel() == "time in s"
        np.testing.assert_array_equal(np.stack([line.get_ydata() for line in ax.lines], axis=-1), values)
    large = plotting.plot_torques(plain, milli=False)
    assert large.get_ylabel() == "torque in N m" and large.lines[0].get_ydata()[0] == plain.c[0, 0]


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
    assert len({ax.get_title() for ax in axes}) == len(axes) == 8


def test_workspace_grid_keeps_off_the_boundary():
    robot = rk.load()
    x, y, inside, points = plotting.grid_points(robot, 121)
    q = rk.inverse_kinematics(robot, points)
    assert np.abs(np.sin(q[:, 3:])).min() > 1e-6
    np.testing.assert_array_equal(plotting.on_grid(inside, points)[inside], points)
    i, j = np.argwhere(inside)[7]
    assert points[7].tolist() == [x[j], y[i]]
