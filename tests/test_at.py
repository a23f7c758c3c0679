"""`at`: each attribute against an independent route, near the edge of the workspace too; kept, read-only, refused."""

import copy
import pickle

import mpmath
import numpy as np
import pytest
from numpy.testing import assert_allclose
from samples import MACHINES, TESTBED, machines, modes, norm, random_motion, random_points

import rapkm_lite as rk
from rapkm_lite.mechanics.at import At, asked

T = lambda M: np.swapaxes(M, -1, -2)  # noqa: E731
mv = lambda M, v: np.einsum("...ij,...j->...i", M, v)  # noqa: E731
SINGLE = ("a", "d", "x", "J", "F", "A", "A_T_pinv", "G", "N", "A_tilde", "A_tilde_T_pinv", "tip_columns")
MOVING = ("xd", "J_dot", "F_dot", "C", "Q", "N_dot")
PARTS = {"minimal": 3, "redundant": 3}


def edge_motion(robot, distance, count=40):
    """Motions at poses that are `distance` metres from where an arm is stretched, on rays from the middle."""
    middle = random_points(robot, 200).mean(axis=0)
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    ray = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    low, high = np.zeros(count), np.full(count, 2.0)
    for _ in range(60):
        mid = (low + high) / 2
        inside = rk.reachable(robot, middle + mid[:, None] * ray)
        low, high = np.where(inside, mid, low), np.where(inside, high, mid)
    q = rk.inverse_kinematics(robot, middle + (low - distance)[:, None] * ray)
    return q, np.random.default_rng(1).normal(size=q.shape)


def check_against_lapack(robot, q, qd, limit):
    """The chapter's formulas with J^+ from the singular value decomposition of J.

    Two Newton steps P (2 - J P) in extended precision rid J^+ of its rounding, which N_dot shows ten times larger.
    """
    at = rk.at(robot, q, qd)
    regular = np.linalg.cond(at.J) < 20
    J, J_pinv, eye = at.J.astype(np.longdouble), np.linalg.pinv(at.J), np.eye(robot.n_joints)
    for _ in range(2):
        J_pinv = J_pinv @ (2 * np.eye(J.shape[-2]) - J @ J_pinv)
    N = eye - J_pinv @ J
    half = J_pinv @ at.J_dot @ N
    N_dot = -half - T(half)
    wanted = {"N": N, "N_dot": N_dot, "A_tilde": N[..., : robot.n_arms, :]}
    found = {name: getattr(at, name) for name in wanted}
    found |= dict(zip(("G~", "C~", "Q~"), at.redundant, strict=True))
    wanted |= {"G~": N @ at.G @ N, "C~": N @ (at.C @ N + at.G @ N_dot), "Q~": mv(N, at.Q)}
    for name, value in wanted.items():
        scale = 1e-3 + (norm(value) if name != "Q~" else norm(at.Q))
        assert (norm(found[name] - value) / scale)[regular].max() < limit, name
    assert regular.sum() > 10


@machines
def test_redundant_quantities_are_those_of_the_chapter(robot):
    q, qd, _, _ = random_motion(robot, 200)
    check_against_lapack(robot, q, qd, 1e-13)


@machines
@pytest.mark.parametrize("distance", [1e-4, 1e-7, 1e-10])
def test_redundant_quantities_stay_exact_at_the_edge_of_the_workspace(robot, distance):
    # F grows like one over the root of the distance; nothing of the redundant form may come from it.
    check_against_lapack(robot, *edge_motion(robot, distance), 1e-13)


@machines
@pytest.mark.parametrize("distance", [1e-4, 1e-7, 1e-10])
def test_the_rates_of_joints_keep_their_digits_at_the_edge_of_the_workspace(robot, distance):
    """F = B^-1 arm by arm, B = (E (a + d), E d) the Jacobian of the tip, in 40 digits at the very angles; dF/dt too."""
    q, qd = edge_motion(robot, distance, 12)
    with mpmath.workdps(40):
        for k, at in enumerate(rk.at(robot, q[k], qd[k]) for k in range(len(q))):
            for i, lengths in enumerate(robot.lengths):
                joints = [i, robot.n_arms + i]
                (base, elbow), (w1, bend) = ([mpmath.mpf(float(v[k, j])) for j in joints] for v in (q, qd))
                a, d = (link * mpmath.expj(angle) for link, angle in zip(lengths, (base, base + elbow), strict=True))
                a_dot, d_dot = 1j * w1 * a, 1j * (w1 + bend) * d
                B, B_dot = (
                    mpmath.matrix([[-(v + u).imag, -u.imag], [(v + u).real, u.real]])
                    for v, u in ((a, d), (a_dot, d_dot))
                )
                F = B**-1
                F_dot = -F * B_dot * F
                for found, exact in ((at.F, F), (at.F_dot, F_dot)):
                    wanted = np.array(exact.tolist(), dtype=float)
                    assert_allclose(found[joints], wanted, rtol=0, atol=2e-15 * np.abs(wanted).max())


def test_the_edge_itself_is_a_regular_pose_of_the_redundant_form():
    edge = TESTBED.base[0] + 0.4 * np.array([np.cos(0.5), np.sin(0.5)])
    at = rk.at(TESTBED, rk.inverse_kinematics(TESTBED, edge), np.ones(6))
    assert_allclose(at.J @ at.N, 0, atol=1e-15)
    assert np.all(np.isfinite(at.redundant[1])) and np.all(np.isfinite(at.A_tilde_T_pinv))
    for name in ("F", "F_dot", "A", "minimal"):
        with pytest.raises(ValueError, match="boundary of the workspace"):
            getattr(at, name)


@modes
def test_pseudoinverse_of_the_redundant_control_matrix(mode):
    for name in ("testbed", "four_arms", "asymmetric"):
        robot = MACHINES[name]
        q = random_motion(robot, 200, np.resize(mode, robot.n_arms))[0]
        at = rk.at(robot, q)
        sigma = np.linalg.svd(at.A_tilde, compute_uv=False)
        peer = np.linalg.pinv(T(at.A_tilde), rcond=1e-10)  # the rank is 2
        good = sigma[:, 1] > 1e-2
        assert (norm(at.A_tilde_T_pinv - peer) / norm(peer))[good].max() < 1e-12


@machines
def test_complement_and_its_rate_annihilate_the_constraints(robot):
    q, qd, qdd, (x, xd, xdd) = random_motion(robot, 100, bend=0.2)
    at = rk.at(robot, q, qd)
    assert_allclose(at.x, x, atol=1e-15)
    assert_allclose(at.xd, xd, atol=1e-14)
    for pose in (at, at.using((0, 3)), at.using((1, robot.n_arms))):
        rate = qd[:, pose.independent] if pose.independent else xd
        assert (norm(at.J @ pose.F) / norm(pose.F)).max() < 1e-13
        assert_allclose(mv(pose.F, rate), qd, atol=1e-10 * np.abs(qd).max())
        derivative = at.J_dot @ pose.F + at.J @ pose.F_dot  # d/dt (J F) = 0
        assert (norm(derivative) / norm(at.J_dot @ pose.F)).max() < 1e-11
        assert np.array_equal(pose.A, pose.F[:, : robot.n_arms])
        # (6)-(7): the tree's forces, projected. Rounding is that of the terms, which cancel where a pair nearly fails.
        force = mv(T(pose.F), mv(at.G, qdd) + mv(at.C, qd) + at.Q)
        acceleration = qdd[:, pose.independent] if pose.independent else xdd
        G, C, Q = pose.minimal
        terms = mv(np.abs(G), np.abs(acceleration)) + mv(np.abs(C), np.abs(rate))
        assert (np.abs(mv(G, acceleration) + mv(C, rate) + Q - force) / terms.max(axis=-1, keepdims=True)).max() < 1e-13


@machines
def test_public_functions_and_attributes_agree_to_the_bit_and_give_arrays_to_write_into(robot):
    q, qd, _, _ = random_motion(robot, 5)
    for pose in (0, slice(None)):
        at = rk.at(robot, q[pose], qd[pose])
        pairs = [
            (rk.constraint_jacobian(robot, q[pose]), at.J),
            (rk.mass_matrix(robot, q[pose]), at.G),
            (rk.constraint_jacobian_dot(robot, q[pose], qd[pose]), at.J_dot),
            (rk.coriolis_matrix(robot, q[pose], qd[pose]), at.C),
            (rk.forward_kinematics(robot, q[pose]), at.x),
            (rk.generalized_forces(robot, q[pose], qd[pose]), at.Q),
            (rk.nullspace_projector(robot, q[pose]), at.N),
            (rk.nullspace_projector_dot(robot, q[pose], qd[pose]), at.N_dot),
            (rk.orthogonal_complement(robot, q[pose]), at.F),
            (rk.control_matrix(robot, q[pose]), at.A),
            (rk.orthogonal_complement_dot(robot, q[pose], qd[pose], (0, 2)), at.using((0, 2)).F_dot),
            (rk.redundant_control_matrix(robot, q[pose]), at.A_tilde),
            *zip(rk.minimal_dynamics(robot, q[pose], qd[pose]), at.minimal, strict=True),
            *zip(rk.redundant_dynamics(robot, q[pose], qd[pose]), at.redundant, strict=True),
        ]
        for function, attribute in pairs:
            assert np.array_equal(function, attribute)
            function[...] = 0.0
            assert function.flags.owndata or function.base.flags.writeable


@machines
def test_one_pose_and_many_are_the_same_numbers(robot):
    q, qd, _, _ = random_motion(robot, 6, bend=0.2)
    many = rk.at(robot, q.reshape(2, 3, -1), qd.reshape(2, 3, -1))
    for k in range(6):
        one = rk.at(robot, q[k], qd[k])
        for name in (*SINGLE, *MOVING):
            whole = getattr(many, name)
            assert_allclose(whole[divmod(k, 3)], getattr(one, name), rtol=0, atol=1e-12 * np.abs(whole).max())
        for name, count in PARTS.items():
            for i in range(count):
                whole = getattr(many, name)[i]
                assert_allclose(whole[divmod(k, 3)], getattr(one, name)[i], rtol=0, atol=1e-12 * np.abs(whole).max())


def test_one_pose_many_rates_and_the_other_way_round():
    q, qd, _, _ = random_motion(TESTBED.replace(gravity=[0, -9.81]), 4)
    for a, b in ((q[0], qd), (q, qd[0]), (q[:1], qd)):
        at = rk.at(TESTBED, a, b)
        for k in range(4):
            one = rk.at(TESTBED, a if a.ndim == 1 else a[k % len(a)], b if b.ndim == 1 else b[k])
            for name in MOVING:
                assert_allclose(
                    getattr(at, name)[k], getattr(one, name), rtol=0, atol=1e-12 * np.abs(getattr(one, name)).max()
                )


def test_attributes_are_kept_and_read_only():
    q, qd, _, _ = random_motion(TESTBED, 3)
    at = rk.at(TESTBED, q, qd)
    for name in (*SINGLE, *MOVING):
        value = getattr(at, name)
        assert value is getattr(at, name)
        with pytest.raises(ValueError, match="read-only"):
            value[...] = 0.0
    for name in PARTS:
        for part in getattr(at, name):
            with pytest.raises(ValueError, match="read-only"):
                part[...] = 0.0
    with pytest.raises(AttributeError):
        at.G = np.eye(6)
    before = at.J.copy()
    q[...] = 0.0  # the caller's own array, which `at` has copied
    assert np.array_equal(rk.at(TESTBED, at.q, at.qd).J, before)
    assert at.using(None) is at and at.using((0, 1)).using(None).F is not None
    assert at.using([0, 1]).G is at.G  # what does not depend on the coordinates is shared


def test_a_pose_is_a_value():
    q, qd, _, _ = random_motion(TESTBED, 2)
    at = rk.at(TESTBED, q, qd)
    at.redundant  # noqa: B018
    for other in (rk.at(rk.load(), q.tolist(), qd), copy.deepcopy(at), pickle.loads(pickle.dumps(at))):
        assert other == at and hash(other) == hash(at)
        assert np.array_equal(other.N_dot, at.N_dot) and not other.q.flags.writeable
    assert at != rk.at(TESTBED, q) and at != rk.at(TESTBED, q[::-1], qd) and at != at.using((0, 1))
    assert repr(at) == "At('testbed', 2 poses, with rates)"
    assert repr(rk.at(TESTBED, q[0]).using((0, 2))) == "At('testbed', 1 pose, independent joints (0, 2))"


def test_what_needs_rates_says_so():
    at = rk.at(TESTBED, rk.inverse_kinematics(TESTBED, [0.01, 0.02]))
    for name in SINGLE:
        assert np.all(np.isfinite(getattr(at, name)))
    for name in ("xd", "J_dot", "F_dot", "C", "Q", "N_dot", "minimal", "redundant"):
        with pytest.raises(ValueError, match=rf"{name} needs the rates, qd = None; allowed: at\(robot, q, qd\)"):
            getattr(at, name)


def test_bad_poses_are_refused_at_once():
    q, qd, _, _ = random_motion(TESTBED, 3)
    for args, name in (
        ((q[:, :5],), "q has shape"),
        ((q * np.nan,), r"q\[0, 0\] = nan"),
        ((None,), "q = None"),
        ((q, qd[:, :4]), "qd has shape"),
        ((q, "fast"), "qd = 'fast'"),
        ((q, qd[:2]), "the leading axes do not fit together"),
    ):
        with pytest.raises(ValueError, match=name):
            rk.at(TESTBED, *args)
    for bad in ((0, 0), (0, 6), (0,), "01"):
        with pytest.raises(ValueError, match="independent"):
            rk.at(TESTBED, q).using(bad)
    corner = rk.at(TESTBED, rk.inverse_kinematics(TESTBED, TESTBED.base[0]), np.zeros(6))
    for name in ("N", "N_dot", "A_tilde", "redundant", "A_tilde_T_pinv"):
        with pytest.raises(ValueError, match="c-space singularity"):
            getattr(corner, name)


def test_a_textbook_law_is_the_same_through_at():
    path = rk.triangle(TESTBED, dt=0.05)
    for d in path:
        at = rk.at(TESTBED, d.q, d.qd)
        G, C, Q = at.redundant
        c = at.A_tilde_T_pinv @ (G @ d.qdd + C @ d.qd + Q)
        A_tilde = rk.redundant_control_matrix(TESTBED, d.q)
        G, C, Q = rk.redundant_dynamics(TESTBED, d.q, d.qd)
        pinv = rk.explicit_pseudoinverse(A_tilde, rk.select_independent(A_tilde))
        assert_allclose(pinv @ (G @ d.qdd + C @ d.qd + Q), c, atol=1e-14)
        assert_allclose(rk.inverse_dynamics(TESTBED, d.q, d.qd, d.qdd), c, atol=1e-14)


def test_what_was_asked_before_does_not_stay_with_other_coordinates():
    q = rk.inverse_kinematics(TESTBED, [0.02, 0.05])
    asked, fresh = rk.at(TESTBED, q), rk.at(TESTBED, q)
    assert asked.A_T_pinv.shape == (3, 2) and isinstance(hash(asked), int)
    other = asked.using((0, 2))
    assert_allclose(T(other.A) @ other.A_T_pinv, np.eye(2), atol=1e-14)
    assert other == fresh.using((0, 2)) and hash(other) == hash(fresh.using((0, 2)))


SHAPE = ("a", "d", "x", "J", "F", "A", "N", "A_tilde", "A_tilde_T_pinv", "G")


def test_geometry_of_a_pose_asked_again_is_that_of_its_own_angles_and_machine():
    """The last poses keep their geometry; one among many, as [q, q], is computed for itself."""
    q = rk.inverse_kinematics(TESTBED, [0.02, 0.05])
    longer = TESTBED.replace(lengths=1.1 * TESTBED.lengths)
    work = q.copy()
    for robot, x in ((TESTBED, [0.02, 0.05]), (longer, [0.02, 0.05]), (TESTBED, [0.01, 0.03]), (TESTBED, [0.02, 0.05])):
        work[:] = rk.inverse_kinematics(robot, x)  # the same array, with other numbers
        for pose in (asked(robot, work), asked(robot, work, work), rk.at(robot, work), asked(robot, work)):
            alone = rk.at(robot, np.stack([work, work]), np.stack([work, work]))
            for name in SHAPE:
                assert_allclose(getattr(pose, name), getattr(alone, name)[0], rtol=1e-12, atol=1e-13, err_msg=name)
    assert np.array_equal(rk.redundant_control_matrix(TESTBED, q), rk.at(TESTBED, q, q).A_tilde)


def test_what_is_handed_out_belongs_to_one_pose_alone():
    q = rk.inverse_kinematics(TESTBED, [0.02, 0.05])
    first, second = asked(TESTBED, q), asked(TESTBED, q)
    wanted = {name: getattr(first, name).copy() for name in SHAPE}
    for name in SHAPE:
        array = getattr(first, name)
        if array.base is None:
            array.setflags(write=True)  # what nobody should do
            array[:] = 0.0
        elif not array.base.flags.writeable:
            with pytest.raises(ValueError, match="WRITEABLE"):
                array.setflags(write=True)
    for name in SHAPE:
        assert np.array_equal(getattr(second, name), wanted[name]), name


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, lambda pose: pickle.loads(pickle.dumps(pose))])
def test_a_copied_pose_has_its_geometry(copied):
    pose = asked(TESTBED, rk.inverse_kinematics(TESTBED, [0.02, 0.05]))
    N = pose.N
    assert np.array_equal(copied(pose).N, N) and copied(pose) == pose


def test_a_pose_that_is_refused_is_refused_again():
    q = rk.inverse_kinematics(TESTBED, [0.02, 0.05])
    q[5] = 0.0
    for _ in range(2):
        with pytest.raises(ValueError, match="boundary of the workspace"):
            rk.orthogonal_complement(TESTBED, q)
        with pytest.raises(ValueError, match="leaves the loops open"):
            rk.nullspace_projector(TESTBED, q)


def test_coordinates_may_be_given_at_once():
    q = rk.inverse_kinematics(TESTBED, [0.02, 0.05])
    pose = At(TESTBED, q, None, (0, 2))
    assert pose.independent == (0, 2) and pose == rk.at(TESTBED, q).using((0, 2))
    assert_allclose(pose.A[[0, 2]], np.eye(2), atol=1e-14)
    with pytest.raises(ValueError, match="independent"):
        At(TESTBED, q, None, (0, 9))


def test_of_many_poses_the_stretched_arm_is_named():
    robot = rk.load()
    q = np.tile(rk.inverse_kinematics(robot, [0.02, 0.05]), (4, 1))
    q[1, 5] = 0.0
    with pytest.raises(ValueError, match=r"^q puts arm 3 on the boundary of the workspace"):
        _ = rk.at(robot, q).F
