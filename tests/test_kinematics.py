"""Constraints, Jacobians, inverse kinematics, closing the loops: identities, finite differences, geometry."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose
from samples import MODES, TESTBED, along, machines, modes, norm, random_motion, random_points
from scipy.optimize import least_squares, minimize

import rapkm_lite as rk
from rapkm_lite.mechanics.kinematics import tip_jacobians, turn, wrap


# Identities on V.
@machines
def test_inverse_kinematics_closes_the_loops_and_forward_kinematics_inverts_it(robot):
    x = random_points(robot, 500)
    for mode in rk.working_modes(robot):
        q = rk.inverse_kinematics(robot, x, mode)
        assert np.abs(rk.loop_constraints(robot, q)).max() < 1e-15
        assert_allclose(rk.forward_kinematics(robot, q), x, atol=1e-15)
        assert np.array_equal(rk.working_mode(robot, q), np.broadcast_to(mode, (500, robot.n_arms)))
        assert np.abs(q).max() <= np.pi


def test_constraints_are_ordered_tip1_tip3_minus_tip2():
    q = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    length, B = 0.2, TESTBED.base
    tips = [
        B[i] + length * np.array([np.cos(q[i]) + np.cos(q[i] + q[3 + i]), np.sin(q[i]) + np.sin(q[i] + q[3 + i])])
        for i in range(3)
    ]
    assert_allclose(rk.loop_constraints(TESTBED, q), np.concatenate([tips[0] - tips[1], tips[2] - tips[1]]), atol=1e-16)
    assert_allclose(rk.tips(TESTBED, q), tips, atol=1e-16)


def test_centroid_pose_from_trigonometry():
    # Distance 0.4/sqrt(3) from each base, two equal links: cos(elbow) = D^2 / (2 l^2) - 1 = -1/3.
    q = rk.inverse_kinematics(TESTBED, [0.0, 0.0])
    assert_allclose(np.cos(q[3:]), -1 / 3, atol=1e-15)
    towards = np.arctan2(*(-TESTBED.base).T[::-1])
    assert_allclose(rk.working_mode(TESTBED, q), 1)
    assert_allclose(np.cos(q[:3] - (towards - q[3:] / 2)), 1.0, atol=1e-15)


def test_angles_are_wrapped_to_the_half_open_turn():
    turns = np.array([-3, -1, 0, 1, 3]) * np.pi
    assert_allclose(wrap(turns), [np.pi, np.pi, 0, np.pi, np.pi], atol=1e-15)
    # Arm 1 stretched along the negative x axis: its angle is +pi.
    robot = TESTBED.with_arms((0, 1)).replace(base=[[0.4, 0.0], [0.0, 0.1]])
    assert rk.inverse_kinematics(robot, [0.0, 0.0])[0] == np.pi


# Derivatives against finite differences.
@machines
def test_jacobians_of_the_tips_are_the_derivatives_of_the_tips(robot):
    """Of each tip by its own two joints, the base angle first; one pose as many."""
    q, N = np.random.default_rng(2).uniform(-3, 3, (20, robot.n_joints)), robot.n_arms
    by_joint = [along(lambda p: rk.tips(robot, p), q, e, 1e-2) for e in np.eye(2 * N)]
    wanted = np.stack([np.stack([by_joint[j][:, i] for j in (i, N + i)], axis=-1) for i in range(N)], axis=1)
    assert_allclose(tip_jacobians(robot, q), wanted, atol=1e-12)
    assert_allclose(tip_jacobians(robot, q[0]), wanted[0], atol=1e-12)


@machines
def test_jacobian_is_the_derivative_of_the_constraints(robot):
    q = np.random.default_rng(1).uniform(-3, 3, (200, robot.n_joints))
    J = np.stack([along(lambda p: rk.loop_constraints(robot, p), q, e, 1e-2) for e in np.eye(robot.n_joints)], axis=-1)
    assert_allclose(rk.constraint_jacobian(robot, q), J, atol=1e-12)


@machines
def test_jacobian_rate_is_the_derivative_of_the_jacobian(robot):
    q, qd = np.random.default_rng(2).uniform(-3, 3, (2, 200, robot.n_joints))
    fd = along(lambda p: rk.constraint_jacobian(robot, p), q, qd, 1e-3)
    assert_allclose(rk.constraint_jacobian_dot(robot, q, qd), fd, atol=1e-11)


@modes
def test_end_effector_complement_and_rate_per_mode(mode):
    q, qd, _, (x, xd, _) = random_motion(TESTBED, 1000, mode, bend=0.2)
    pose = lambda p: rk.inverse_kinematics(TESTBED, p, mode)  # noqa: E731
    F = rk.orthogonal_complement(TESTBED, q)
    assert (norm(rk.constraint_jacobian(TESTBED, q) @ F) / norm(F)).max() < 1e-15
    # The angles themselves wrap, their sines and cosines do not.
    rate = along(lambda p: np.stack([np.cos(pose(p)), np.sin(pose(p))]), x, xd, 5e-5)
    assert_allclose(np.cos(q) * rate[1] - np.sin(q) * rate[0], qd, atol=1e-8)
    fd = along(lambda p: rk.orthogonal_complement(TESTBED, pose(p)), x, xd, 5e-5)
    F_dot = rk.orthogonal_complement_dot(TESTBED, q, qd)
    assert (norm(F_dot - fd) / np.maximum(norm(F_dot), 1)).max() < 1e-7


# Degree of freedom and singularities of V.
@machines
def test_degree_of_freedom_is_two_at_regular_poses(robot):
    q = rk.inverse_kinematics(robot, random_points(robot, 200))
    assert np.all(rk.constraint_rank(robot, q) == robot.n_constraints)
    assert np.all(rk.degree_of_freedom(robot, q) == 2)


def test_corners_of_the_workspace_are_c_space_singularities():
    # At B1 arm 1 is folded and arms 2 and 3 are stretched: forces along the three arms balance, so rows of J depend.
    q = rk.inverse_kinematics(TESTBED, TESTBED.base[0])
    free = q + np.array([0.7, 0, 0, 0, 0, 0])
    for pose in (q, free):
        assert np.abs(rk.loop_constraints(TESTBED, pose)).max() < 1e-15
        assert rk.degree_of_freedom(TESTBED, pose) == 3
        assert np.array_equal(rk.working_mode(TESTBED, pose), [0, 0, 0])
        with pytest.raises(ValueError, match="c-space singularity"):
            rk.nullspace_projector(TESTBED, pose)
    # One arm stretched alone is the boundary of the workspace, but a regular point of V.
    edge = TESTBED.base[0] + 0.4 * np.array([np.cos(0.5), np.sin(0.5)])
    assert rk.degree_of_freedom(TESTBED, rk.inverse_kinematics(TESTBED, edge)) == 2


# Closing the loops.
@machines
def test_close_loops_finds_the_nearest_configuration(robot):
    rng = np.random.default_rng(3)
    rough = rk.inverse_kinematics(robot, random_points(robot, 20, bend=0.3)) + rng.normal(0, 0.1, (20, robot.n_joints))
    q = rk.close_loops(robot, rough)
    assert np.abs(rk.loop_constraints(robot, q)).max() < 1e-13
    # Stationary: the way to the rough pose is normal to V.
    assert np.abs(np.einsum("kij,ki->kj", rk.nullspace_projector(robot, q), q - rough)).max() < 1e-12
    for found, start in zip(q[:5], rough[:5], strict=True):
        peer = minimize(
            lambda p, s=start: ((p - s) ** 2).sum(),
            start,
            method="SLSQP",
            tol=1e-14,
            constraints={"type": "eq", "fun": lambda p: rk.loop_constraints(robot, p)},
        )
        assert_allclose(found, peer.x, atol=1e-6)


@pytest.mark.parametrize("far", [1e2, 1e5])
def test_loops_close_far_from_the_origin(far):
    """A machine that is moved has the same nearest configuration, to what its coordinates are rounded to."""
    moved = TESTBED.replace(base=TESTBED.base + [far, -far])
    rough = rk.inverse_kinematics(TESTBED, [0.03, -0.02]) + 0.1 * np.cos(np.arange(6))
    closed = rk.close_loops(moved, rough)
    assert_allclose(closed, rk.close_loops(TESTBED, rough), atol=20 * np.spacing(far) / TESTBED.lengths.min())
    assert np.abs(rk.loop_constraints(moved, closed)).max() < 4 * np.spacing(far)


def test_close_loops_squares_its_error():
    """Newton's method: 0.1 rad, then about 1e-2, 1e-4, 1e-8, and below the tolerance, in five steps."""
    rng = np.random.default_rng(0)
    q = rk.inverse_kinematics(TESTBED, rng.uniform(-0.06, 0.06, (60, 2)))
    for rough in q + rng.uniform(-0.1, 0.1, q.shape):
        rk.close_loops(TESTBED, rough, iterations=5)


def test_close_loops_is_a_projection():
    q = rk.inverse_kinematics(TESTBED, random_points(TESTBED, 100))
    assert_allclose(rk.close_loops(TESTBED, q), q, atol=1e-13)
    rough = q + np.random.default_rng(4).normal(0, 0.2, q.shape)
    once = rk.close_loops(TESTBED, rough)
    assert_allclose(rk.close_loops(TESTBED, once), once, atol=1e-13)


def test_close_loops_from_half_a_radian_off():
    rng = np.random.default_rng(5)
    x = random_points(TESTBED, 200, seed=5)
    q = rk.inverse_kinematics(TESTBED, x, rng.choice([-1, 1], (200, 3)))
    for start in q + rng.uniform(-0.3, 0.3, q.shape):
        assert np.abs(rk.loop_constraints(TESTBED, rk.close_loops(TESTBED, start))).max() < 1e-13


def test_close_loops_stays_near_from_far_away():
    """The pose that was shaken lies in V, so that the nearest one is not further off: steps of turns would lose it."""
    rng, pose = np.random.default_rng(0), rk.inverse_kinematics(TESTBED, [0.02, 0.05])
    for start, shaken in enumerate(pose + rng.normal(0, 0.6, (59, 6))):
        if start in (15, 58):
            distance = np.linalg.norm(rk.close_loops(TESTBED, shaken) - shaken)
            assert distance <= np.linalg.norm(pose - shaken)


def test_close_loops_says_where_it_gave_up():
    with pytest.raises(rk.ConvergenceError, match=r"closure error is .* m"):
        rk.close_loops(TESTBED, rk.inverse_kinematics(TESTBED, TESTBED.base[0]))


# Pose from over-determined base angles.
@machines
def test_pose_of_consistent_angles_is_exact(robot):
    x = random_points(robot, 50, bend=0.3)
    A_tilde = rk.redundant_control_matrix(robot, rk.inverse_kinematics(robot, x))
    x = x[np.linalg.svd(A_tilde, compute_uv=False)[:, 1] > 0.1]
    q = rk.inverse_kinematics(robot, x)
    assert_allclose(rk.estimate_pose(robot, q[:, : robot.n_arms], x + 0.002), q, atol=1e-11)
    # Base angles that have turned on stay there.
    turned = q + 2 * np.pi * np.repeat([1.0, 0.0], robot.n_arms)
    assert_allclose(rk.estimate_pose(robot, turned[:, : robot.n_arms], x + 0.002), turned, atol=1e-11)


def test_pose_of_contradicting_angles_is_the_least_squares_one():
    x, offset = np.array([0.03, -0.02]), np.array([0.02, -0.01, 0.03])
    q_a = rk.inverse_kinematics(TESTBED, x)[:3] + offset
    q = rk.estimate_pose(TESTBED, q_a, x)
    misfit = lambda p: rk.inverse_kinematics(TESTBED, p)[:3] - q_a  # noqa: E731
    peer = least_squares(misfit, x, jac="3-point", xtol=1e-15, gtol=1e-14)
    assert_allclose(rk.forward_kinematics(TESTBED, q), peer.x, atol=1e-9)
    # To first order the error is that of the filter: R offset.
    R = rk.antagonism_filter(rk.control_matrix(TESTBED, q))
    assert_allclose(R @ (q_a - q[:3]), 0, atol=1e-12)


def test_pose_near_a_singularity_is_as_exact_as_its_angles():
    """The rounding of the angles alone moves x by 1e-16 over sigma, more than the tolerance of regular poses."""
    robot = rk.Manipulator(base=[[-0.2, 0.0], [0.2, 0.0]], lengths=0.2, masses=0.134, mode=[-1, 1])
    rng = np.random.default_rng(0)
    x = rng.uniform([-0.15, -0.19], [0.15, -0.1], (2000, 2))
    q = rk.inverse_kinematics(robot, x := x[rk.reachable(robot, x)])
    sigma = rk.singular_values(rk.control_matrix(robot, q))[:, -1]
    near = (sigma > 1e-3) & (sigma < 0.3)
    assert near.sum() > 500
    found = rk.estimate_pose(robot, q[near, :2], x[near] + 1e-4 * rng.normal(size=(near.sum(), 2)))
    assert_allclose(found[:, :2], q[near, :2], rtol=0, atol=1e-12)


@pytest.mark.parametrize("distance", [1e-3, 2e-7, 1e-9, 1e-11])
def test_pose_is_found_where_an_arm_of_equal_links_reaches_its_own_base(distance):
    """Its angles are those of the inverse kinematics, which puts the end-effector where it was."""
    x = TESTBED.base[0] + distance * np.stack([np.cos(a := np.linspace(0.2, 0.8, 9)), np.sin(a)], axis=-1)
    q = rk.estimate_pose(TESTBED, rk.inverse_kinematics(TESTBED, x)[:, :3], x)
    assert_allclose(rk.tips(TESTBED, q), np.repeat(x[:, None], 3, axis=1), rtol=0, atol=4e-15)


@pytest.mark.parametrize("contradiction", [1e-12, 1e-10, 1e-8])
def test_pose_near_a_singularity_is_found_for_angles_that_contradict_each_other(contradiction):
    """Rounding moves x by 1e-16 over sigma there, too; at the least squares A^+ leaves nothing of the residuals."""
    robot = TESTBED.replace(mode=[1, 1, -1])
    away = 3e-4 * np.stack([np.cos(a := np.arange(24) * np.pi / 12 + 0.1), np.sin(a)], axis=-1)
    x = TESTBED.base[:2].mean(axis=0) + away
    q_a = rk.inverse_kinematics(robot, x)[:, :3] + contradiction * np.random.default_rng(2).normal(size=(24, 3))
    found = np.array([rk.estimate_pose(robot, angles, place) for angles, place in zip(q_a, x, strict=True)])
    A = rk.control_matrix(robot, found)
    left = np.linalg.pinv(A, rcond=0.0) @ (q_a - found[:, :3])[..., None]
    assert np.abs(left).max() < 1e-15 * np.linalg.cond(A).max()


def test_pose_fails_loudly():
    with pytest.raises(rk.ConvergenceError, match=r"at the rim of the workspace, the residuals are \[.*\] rad"):
        rk.estimate_pose(TESTBED, [0.0, 0.0, 0.0], [0.0, 0.0])
    with pytest.raises(rk.ConvergenceError, match="outside the workspace"):
        rk.estimate_pose(TESTBED, [0.0, 0.0, 0.0], [1.0, 0.0])
    # One step of at most a tenth of a proximal link leads to a place well inside.
    q_a = rk.inverse_kinematics(TESTBED, [0.05, 0.05])[:3]
    with pytest.raises(rk.ConvergenceError, match="inside the workspace") as caught:
        rk.estimate_pose(TESTBED, q_a, [-0.05, -0.05], iterations=1)
    step = np.array(re.search(r"x = \[(.*?), (.*?)\]", str(caught.value)).groups(), dtype=float) - [-0.05, -0.05]
    assert np.abs(step).max() == pytest.approx(0.1 * 0.2, abs=1e-6)


# Facts of reference: the shape of the workspace.
def test_workspace_is_the_reuleaux_triangle_on_the_base_points():
    x, y, inside = rk.workspace_grid(TESTBED, 1000)
    cell = (x[1] - x[0]) * (y[1] - y[0])
    assert_allclose(inside.sum() * cell, (np.pi - np.sqrt(3)) / 2 * 0.4**2, rtol=2e-3)
    angle = np.linspace(0, np.pi / 3, 50)
    for i in range(3):
        start = np.arctan2(*(TESTBED.base[(i + 1) % 3] - TESTBED.base[i])[::-1])
        rim = TESTBED.base[i] + 0.4 * np.stack([np.cos(start + angle), np.sin(start + angle)], axis=-1)
        centre = TESTBED.base.mean(axis=0)
        assert np.all(rk.reachable(TESTBED, centre + 0.999999 * (rim - centre)))
        assert not np.any(rk.reachable(TESTBED, centre + 1.000001 * (rim - centre)))


def test_turning_the_machine_by_a_third_permutes_the_arms():
    turn = np.array([[-0.5, -np.sqrt(0.75)], [np.sqrt(0.75), -0.5]])
    x = random_points(TESTBED, 100)
    q, turned = rk.inverse_kinematics(TESTBED, x), rk.inverse_kinematics(TESTBED, x @ turn.T)
    for i in range(3):  # arm i takes the place of arm i + 1
        j = (i + 1) % 3
        assert_allclose(np.cos(turned[:, j] - q[:, i] - 2 * np.pi / 3), 1, atol=1e-14)
        assert_allclose(turned[:, 3 + j], q[:, 3 + i], atol=1e-12)


# Leading axes.
def test_one_pose_and_a_trajectory_are_the_same_call():
    q, qd, _, (x, _, _) = random_motion(TESTBED, 12)
    for f, *args in (
        (rk.loop_constraints, q),
        (rk.constraint_jacobian, q),
        (rk.constraint_jacobian_dot, q, qd),
        (rk.forward_kinematics, q),
        (rk.tips, q),
        (rk.working_mode, q),
        (rk.inverse_kinematics, x),
        (rk.reachable, x),
        (rk.constraint_rank, q),
        (rk.degree_of_freedom, q),
        (rk.close_loops, q + 0.01),
        (rk.estimate_pose, q[:, :3] + [0.01, 0, -0.01], x),
    ):
        whole = f(TESTBED, *args)
        single = np.stack([f(TESTBED, *(a[k] for a in args)) for k in range(12)])
        block = f(TESTBED, *(a.reshape(3, 4, -1) for a in args))
        assert_allclose(whole, single, atol=1e-13, err_msg=f.__name__)
        assert_allclose(block.reshape(whole.shape), single, atol=1e-13, err_msg=f.__name__)
        assert f(TESTBED, *(a[:0] for a in args)).shape == (0, *whole.shape[1:])
    assert rk.inverse_kinematics(TESTBED, x[0], MODES).shape == (8, 6)
    assert rk.arm_vectors(TESTBED, q)[0].shape == (12, 3, 2)


@pytest.mark.parametrize("lead", [(), (3,), (3, 2)])
def test_a_quarter_turn_is_the_product_with_i(lead):
    v = np.random.default_rng(3).normal(size=(*lead, 2))
    turned = (v[..., 0] + 1j * v[..., 1]) * 1j
    assert_allclose(turn(v), np.stack([turned.real, turned.imag], axis=-1), rtol=0, atol=0)


@pytest.mark.parametrize("spread", [0.05, 0.2])
def test_pose_of_readings_that_contradict_each_other_is_that_of_an_independent_solver(spread):
    """Residuals of tenths of a radian: steps of Gauss and Newton alone shrink there by a third, or not at all."""
    rng = np.random.default_rng(5)
    x = random_points(TESTBED, 40, 5, 0.6)
    q_a = rk.inverse_kinematics(TESTBED, x)[:, :3] + rng.normal(0.0, spread, (40, 3))
    for angles, guess in zip(q_a, x, strict=True):
        found = rk.forward_kinematics(TESTBED, rk.estimate_pose(TESTBED, angles, guess))
        apart = lambda p: wrap(rk.inverse_kinematics(TESTBED, p)[:3] - angles)  # noqa: B023, E731
        other = least_squares(apart, found, xtol=1e-15, ftol=1e-15, gtol=1e-15)
        assert_allclose(found, other.x, atol=1e-7)
        assert np.abs(rk.control_matrix(TESTBED, rk.inverse_kinematics(TESTBED, found)).T @ apart(found)).max() < 1e-10


def test_the_pose_does_not_depend_on_which_arm_is_the_first():
    """A permutation of the arms renames the drives, also where one proximal link is much shorter than the others."""
    base, lengths = [[-0.3, -0.05], [0.25, -0.15], [0.0, 0.3]], [[0.02, 0.35], [0.3, 0.3], [0.3, 0.3]]
    order, place, guess = [1, 2, 0], [-0.0439, 0.2149], [0.0273, 0.1098]
    one = rk.Manipulator(base=base, lengths=lengths, masses=0.1)
    other = rk.Manipulator(base=np.array(base)[order], lengths=np.array(lengths)[order], masses=0.1)
    for robot in (one, other):
        q = rk.inverse_kinematics(robot, place)
        assert_allclose(rk.estimate_pose(robot, q[:3], guess), q, atol=1e-12)


@pytest.mark.parametrize("far", [12.0, 1e3])
def test_the_pose_is_found_far_from_the_origin(far):
    """A machine with links of 2 mm that is moved by kilometres of its own size has the same pose and the same run."""
    size, shift, offset = 0.01, np.array([far, 0.7 * far]), np.array([4e-3, -2e-3, 5e-3])
    near = TESTBED.replace(base=size * TESTBED.base, lengths=size * TESTBED.lengths, masses=0.134 / size**2)
    moved = near.replace(base=near.base + shift)
    coarse = 100 * np.spacing(far) / near.lengths.min()
    for x in size * np.random.default_rng(4).uniform(-0.05, 0.05, (20, 2)):
        q_a = rk.inverse_kinematics(near, x)[:3] + offset
        found = rk.estimate_pose(moved, q_a, shift)
        assert_allclose(found, rk.estimate_pose(near, q_a, [0.0, 0.0]), atol=coarse)
    law = rk.AntagonismFilter(rk.PD(7.0, 0.2))
    run = rk.simulate(moved, law, rk.circle(moved, 0.05 * size, 0.2, centre=shift), offset)
    assert_allclose(run.c, rk.simulate(near, law, rk.circle(near, 0.05 * size, 0.2), offset).c, atol=1e2 * coarse)


@pytest.mark.parametrize("size", [1e-10, 1e-6, 1e6])
def test_configurations_and_poses_are_found_in_any_unit_of_length(size):
    """Angles know no unit: they are those of the machine in metres, to the tolerance of its longest link."""
    robot = TESTBED.replace(base=size * TESTBED.base, lengths=size * TESTBED.lengths, centers=size * TESTBED.centers)
    rng = np.random.default_rng(7)
    x = random_points(TESTBED, 20, 7, 0.5)
    rough = rk.inverse_kinematics(TESTBED, x) + rng.uniform(-0.2, 0.2, (20, 6))
    found = np.array([rk.close_loops(robot, q) for q in rough])
    assert np.abs(rk.loop_constraints(robot, found)).max() < 1e-13 * 0.2 * size
    assert_allclose(found, [rk.close_loops(TESTBED, q) for q in rough], rtol=0, atol=1e-12)
    for q, place in zip(rough, x, strict=True):
        pose = rk.estimate_pose(robot, q[:3], size * place, iterations=8)
        assert_allclose(pose, rk.estimate_pose(TESTBED, q[:3], place), rtol=0, atol=1e-12)
    # A corner, where arm 1 is folded and arms 2 and 3 are stretched, loses a constraint in any unit, other poses none.
    corner = np.array([0.0, np.pi, -2 * np.pi / 3, np.pi, 0.0, 0.0])
    assert rk.degree_of_freedom(robot, corner) == 3 and np.all(rk.degree_of_freedom(robot, found) == 2)


def test_many_configurations_need_no_more_steps_than_one():
    rough = rk.inverse_kinematics(TESTBED, random_points(TESTBED, 2000, 8, 0.5))
    rough += np.random.default_rng(8).uniform(-0.15, 0.15, rough.shape)
    found = rk.close_loops(TESTBED, rough, iterations=8)
    assert_allclose(found[::100], [rk.close_loops(TESTBED, q, iterations=8) for q in rough[::100]], rtol=0, atol=1e-12)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_gap_is_one_in_any_direction_and_unit(sign):
    """The tip of arm 2 stays behind both others, or runs ahead of them, in x and in y."""
    for size in (1e-3, 1.0, 1e3):
        robot = TESTBED.replace(base=size * TESTBED.base, lengths=size * TESTBED.lengths)
        for gap, closed in ((0.9e-3, True), (1.1e-3, False)):
            shifted = robot.replace(
                base=robot.base + sign * gap * size * 0.2 * np.array([[1.0, 1.0], [0, 0], [1.0, 1.0]])
            )
            q = rk.inverse_kinematics(robot, [0.02 * size, 0.03 * size])
            assert_allclose(rk.loop_constraints(shifted, q), sign * gap * size * 0.2, rtol=1e-9)
            if closed:
                assert rk.orthogonal_complement(shifted, q).shape == (6, 2)
            else:
                with pytest.raises(ValueError, match="leaves the loops open"):
                    rk.orthogonal_complement(shifted, q)


def test_of_many_poses_the_one_whose_loops_stay_open_is_named():
    q = rk.inverse_kinematics(TESTBED, [0.02, 0.03])
    for poses in ([q, q + np.array([0, 0, 0, 2.5, 2.5, -2.5])], [q + np.array([0, 0, 0, 2.5, 2.5, -2.5]), q]):
        with pytest.raises(rk.ConvergenceError) as caught:
            rk.close_loops(TESTBED, poses, iterations=3)
        assert float(re.search(r"the closure error is (\S+) m", str(caught.value))[1]) > 0.01


def test_an_arm_of_equal_links_reaches_its_own_base_point():
    """Folded, at distance zero, which is the least that its links leave; an arm of unequal links does not get there."""
    robot = rk.Manipulator(base=[[-0.25, 0.125], [0.25, 0.0]], lengths=0.5, masses=0.1)
    assert rk.reachable(robot, robot.base).tolist() == [True, True]
    assert rk.reachable(robot.replace(lengths=[[0.5, 0.25], [0.5, 0.5]]), robot.base).tolist() == [False, True]


def test_a_point_too_near_to_a_base_point_is_refused_like_one_too_far():
    robot = rk.Manipulator(base=[[0.0, 0.0], [0.5, 0.0]], lengths=[[0.3, 0.1], [0.3, 0.3]], masses=0.1)
    for distance, allowed in ((0.19, False), (0.21, True), (0.39, True), (0.41, False)):
        x = distance * np.array([0.6, 0.8])
        if allowed:
            assert_allclose(rk.tips(robot, rk.inverse_kinematics(robot, x)), [x, x], atol=1e-15)
        else:
            with pytest.raises(ValueError, match=rf"it is {distance:g} m from base point 1; allowed: 0\.2 to 0\.4 m"):
                rk.inverse_kinematics(robot, x)


def test_tips_of_stretched_and_folded_arms_are_reached_whatever_rounding_did_to_them():
    """cos(elbow) = +-1 to some 1e-15, which leaves angles of the root of that."""
    robot = rk.Manipulator(base=[[0.1, -0.2], [0.35, -0.2]], lengths=[[0.3, 0.1], [0.7, 0.7]], masses=0.1)
    angle = np.linspace(0.1, 6.2, 500)
    for length in (0.4, 0.2):
        x = robot.base[0] + length * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        assert_allclose(rk.tips(robot, rk.inverse_kinematics(robot, x)), np.stack([x, x], axis=1), rtol=0, atol=1e-12)


@pytest.mark.parametrize("distance", [1e-2, 1e-4, 1e-6, 1e-8, 1e-10])
def test_an_arm_that_is_nearly_folded_keeps_all_its_digits(distance):
    """Two equal links l and the distance r of their ends are an isosceles triangle: the elbow angle is
    pi - 2 asin(r / 2 l), and the proximal link leads the line to the tip by half of it."""
    robot, l1 = rk.Manipulator(base=[[0.0, 0.0], [0.2, 0.0]], lengths=0.2, masses=0.1), 0.2
    for angle in np.linspace(0.1, 3.0, 30):
        x = distance * np.array([np.cos(angle), np.sin(angle)])
        for mode in (1, -1):
            q = rk.inverse_kinematics(robot, x, [mode, 1])
            elbow = np.pi - 2 * np.arcsin(np.hypot(*x) / (2 * l1))
            assert_allclose(q[2], mode * elbow, rtol=0, atol=2e-15)
            assert_allclose(wrap(q[0] - np.arctan2(x[1], x[0]) + mode * elbow / 2), 0.0, atol=2e-15)
            assert_allclose(rk.tips(robot, q), [x, x], rtol=0, atol=5e-16)
