"""Every public function against bad arguments: always a ValueError with a sentence, never NaN or LinAlgError."""

import itertools
import re

import numpy as np
import pytest
from samples import MACHINES, TESTBED, random_motion

import rapkm_lite as rk

Q, QD, QDD, (X, XD, XDD) = random_motion(TESTBED, 5, bend=0.3)
C = np.full((5, 3), 0.01)
A = rk.control_matrix(TESTBED, Q)
A_TILDE = rk.redundant_control_matrix(TESTBED, Q)
F = rk.orthogonal_complement(TESTBED, Q)
PATH = rk.hold(TESTBED, [0.01, 0.02], 0.01)
SAMPLE = rk.Desired(3, X, XD, XDD, Q, QD, QDD)


def broken(value):
    """What nobody should pass where a real array is wanted."""
    value = np.asarray(value, dtype=float)
    holes = [value.copy(), value.copy(), value + 1e200]
    holes[0][(0,) * value.ndim], holes[1][(-1,) * value.ndim] = np.nan, np.inf
    holes += [value + 0j, value.astype(str), value.astype(bool), None, "abc", {}]
    shapes = [np.zeros(0), np.zeros((5, 7))]
    if value.ndim:
        shapes += [value[..., :-1], 1.0, np.concatenate([value, value], axis=-1)]
    return holes + shapes


def lead(value):
    """Leading axes that fit nothing else."""
    return np.broadcast_to(value[0], (4, *value.shape[1:]))


def on(f, **good):
    return pytest.param(lambda **kw: f(TESTBED, **kw), good, id=f.__name__)


motion = {"q": Q, "qd": QD}
CALLS = [
    on(rk.arm_vectors, q=Q),
    on(rk.tips, q=Q),
    on(rk.forward_kinematics, q=Q),
    on(rk.loop_constraints, q=Q),
    on(rk.constraint_jacobian, q=Q),
    on(rk.constraint_jacobian_dot, **motion),
    on(rk.reachable, x=X),
    on(rk.working_mode, q=Q),
    on(rk.inverse_kinematics, x=X, mode=np.ones((5, 3))),
    on(rk.close_loops, q=Q),
    on(rk.estimate_pose, q_a=Q[:, :3], guess=X),
    on(rk.mass_matrix, q=Q),
    on(rk.coriolis_matrix, **motion),
    on(rk.generalized_forces, **motion),
    on(rk.orthogonal_complement, q=Q),
    on(rk.orthogonal_complement_dot, **motion),
    on(rk.minimal_dynamics, **motion),
    on(rk.constraint_rank, q=Q),
    on(rk.degree_of_freedom, q=Q),
    on(rk.nullspace_projector, q=Q),
    on(rk.nullspace_projector_dot, **motion),
    on(rk.redundant_dynamics, **motion),
    on(rk.forward_dynamics, **motion, c=C),
    on(rk.kinetic_energy, **motion),
    on(rk.potential_energy, q=Q),
    on(rk.at, q=Q),
    on(rk.control_matrix, q=Q),
    on(rk.redundant_control_matrix, q=Q),
    on(rk.degree_of_actuation, q=Q),
    on(rk.actuation_type, q=Q),
    on(rk.control_vector_fields, q=Q),
    on(rk.distal_cross_products, q=Q),
    on(rk.null_vector, q=Q),
    on(rk.inverse_dynamics, **motion, qdd=QDD, prestress=C),
    on(rk.required_wrench, **motion, qdd=QDD),
    pytest.param(lambda **kw: rk.lyapunov_function(TESTBED, **kw, K_P=1.0), {"q": Q, "e": Q, "ed": QD}, id="lyapunov"),
    pytest.param(lambda **kw: rk.steady_state_error(A, 1.0, **kw), {"offset": C, "wrench": X}, id="steady_error"),
    pytest.param(lambda **kw: rk.steady_state_torque(A, 1.0, **kw), {"offset": C, "wrench": X}, id="steady_torque"),
    pytest.param(lambda c: rk.copper_loss(TESTBED, c, 1e-3), {"c": C}, id="copper_loss"),
]
TALL = {
    "singular_values": rk.singular_values,
    "null_basis": rk.null_basis,
    "common_sign": rk.common_sign,
    "weighted_pseudoinverse": rk.weighted_pseudoinverse,
    "prestress_projector": rk.prestress_projector,
    "antagonism_filter": rk.antagonism_filter,
    "command_filter": lambda A: rk.command_filter(A, 1.0),
    "steady_state_error": lambda A: rk.steady_state_error(A, 1.0, [0.1, 0.1, 0.1]),
    "steady_state_torque": lambda A: rk.steady_state_torque(A, 1.0, [0.1, 0.1, 0.1]),
}
WIDE = {
    "select_independent": rk.select_independent,
    "closed_loop_projector": rk.closed_loop_projector,
    "explicit_pseudoinverse": lambda A_tilde: rk.explicit_pseudoinverse(A_tilde, (0, 1)),
}


def refused(call, name, *args, **kwargs):
    """The call raises ValueError, not LinAlgError, with a sentence that names the argument."""
    with pytest.raises(ValueError) as caught:
        call(*args, **kwargs)
    message = str(caught.value)
    assert not isinstance(caught.value, np.linalg.LinAlgError)
    assert re.search(rf"\b{re.escape(name)}", message), message
    assert "allowed" in message or "needed" in message, message


@pytest.mark.parametrize(("call", "good"), CALLS)
def test_arrays(call, good):
    call(**good)
    for name in good:
        for bad in broken(good[name]):
            if bad is None and name in ("mode", "prestress", "wrench"):
                continue  # None is the default there
            refused(call, name, **(good | {name: bad}))
        if len(good) > 1 and np.ndim(good[name]) > 1 and len(good[name]) == 5:
            refused(call, name, **(good | {name: lead(good[name])}))


@pytest.mark.parametrize("name", [*TALL, *WIDE, "effective_gain"])
def test_matrices(name):
    call, good, argument = {
        **{k: (f, A, "A") for k, f in TALL.items()},
        **{k: (f, A_TILDE, "A_tilde") for k, f in WIDE.items()},
        "effective_gain": (lambda F: rk.effective_gain(F, np.eye(F.shape[-2] if np.ndim(F) > 1 else 6)), F, "F"),
    }[name]
    call(good)
    odd = [good * np.nan, good + 0j, good.astype(str), good > 0, None, "A", 1.0, np.zeros(3), np.swapaxes(good, -1, -2)]
    for bad in odd:
        refused(call, argument, bad if name != "effective_gain" else np.asarray(bad))


def test_leading_axes_of_matrices():
    W = np.broadcast_to(np.eye(3), (4, 3, 3))
    refused(rk.weighted_pseudoinverse, "W", A, W)
    refused(rk.command_filter, "K", A, W)
    refused(rk.steady_state_error, "K_P", A, W, C)
    refused(rk.steady_state_error, "offset", A, 1.0, C[:4])
    refused(rk.inverse_dynamics, "W", TESTBED, Q, QD, QDD, W)
    refused(rk.inverse_dynamics, "prestress", TESTBED, Q, QD, QDD, None, C[:4])
    refused(rk.effective_gain, "K", F, np.broadcast_to(np.eye(6), (4, 6, 6)))
    for bad in (np.eye(5), np.nan, "K", np.ones(6), 1j):
        refused(rk.effective_gain, "K", F, bad)


@pytest.mark.parametrize(
    "independent",
    [
        (0, 0),
        (0,),
        (0, 1, 2),
        (0, 6),
        (-1, 2),
        (0.5, 1),
        (0.0, 0),
        (np.nan, 1.0),
        (0.0, np.inf),
        "01",
        3,
        (True, False),
        [],
        (None, 1),
        ((0, 1), (1, 2)),
    ],
    ids=str,
)
def test_choice_of_coordinates(independent):
    for f in (rk.orthogonal_complement, rk.control_matrix, rk.control_vector_fields):
        refused(f, "independent", TESTBED, Q, independent)
    for f in (rk.orthogonal_complement_dot, rk.minimal_dynamics):
        refused(f, "independent", TESTBED, Q, QD, independent)
    refused(lambda: rk.APD(1.0, 1.0, independent).torque(TESTBED, Q, QD, Q[:, :3], QD[:, :3], SAMPLE), "independent")
    refused(rk.explicit_pseudoinverse, "rows", A_TILDE, independent)


ROWS = [
    np.zeros((5, 2), int),
    np.full((5, 2), 3),
    np.array([[0, 1]] * 4),
    np.zeros((5, 3), int),
    np.array([[0.5, 1.0]] * 5),
    np.array([[0.0, np.nan]] * 5),
    np.array([[0.0, 0.0]] * 5),
    np.array([[-1, 1]] * 5),
    np.zeros((5, 0), int),
]


@pytest.mark.parametrize("rows", ROWS, ids=range(len(ROWS)))
def test_row_choices(rows):
    refused(rk.explicit_pseudoinverse, "rows", A_TILDE, rows)


def test_one_choice_of_rows_may_be_an_array_and_the_wrong_one_of_many_is_told():
    both = rk.explicit_pseudoinverse(A_TILDE, np.array([0, 1])), rk.explicit_pseudoinverse(A_TILDE, (0, 1))
    assert np.array_equal(*both)
    with pytest.raises(ValueError, match=r"rows holds \[2, 2\]; allowed: different indices from 0 to 2"):
        rk.explicit_pseudoinverse(A_TILDE, np.array([[0, 1], [0, 2], [0, 1], [2, 2], [1, 2]]))


NOT_SPD = [
    0.0,
    -1.0,
    np.nan,
    [1.0, 2.0],
    [1.0, -1.0, 1.0],
    -np.eye(3),
    np.zeros((3, 3)),
    np.ones((3, 3)),
    np.eye(4),
    np.array([[1.0, 0.5, 0], [0, 1, 0], [0, 0, 1]]),
    np.array([[1.0, 2, 0], [2, 1, 0], [0, 0, 1]]),
    "I",
    [],
    True,
    1j,
]


@pytest.mark.parametrize("bad", NOT_SPD, ids=range(len(NOT_SPD)))
def test_weights_and_gains(bad):
    refused(rk.weighted_pseudoinverse, "W", A, bad)
    refused(rk.prestress_projector, "W", A, bad)
    refused(rk.inverse_dynamics, "W", TESTBED, Q, QD, QDD, bad)
    refused(rk.command_filter, "K", A, bad)
    refused(rk.steady_state_error, "K_P", A, bad, 0.01 * C)
    refused(rk.steady_state_torque, "K_P", A, bad, 0.01 * C)
    for law, name in itertools.product(
        (rk.PD, rk.APD, rk.CTC, rk.SwitchedCTC, rk.RedundantAPD, rk.RedundantCTC), ("K_P", "K_D")
    ):

        def use(law=law, name=name):
            made = law(**({"K_P": 1.0, "K_D": 1.0} | {name: bad}))
            made.torque(TESTBED, Q, QD, Q[:, :3], QD[:, :3], SAMPLE)

        if not (np.shape(bad) == (2,) and law in (rk.APD, rk.CTC, rk.SwitchedCTC)):
            refused(use, name)
    refused(lambda: rk.CTC(1.0, 1.0, W=bad).torque(TESTBED, Q, QD, Q[:, :3], QD[:, :3], SAMPLE), "W")


def test_options_of_the_laws():
    pd = rk.PD(1.0, 1.0)
    refused(rk.AntagonismFilter, "pose", pd, pose="guess")
    refused(rk.AntagonismFilter, "law", 3.0)
    refused(rk.CommandFilter, "law", rk.APD(1.0, 1.0))
    refused(rk.RedundantCTC, "rule", 1.0, 1.0, rule="best")
    refused(rk.SwitchedCTC, "hysteresis", 1.0, 1.0, hysteresis=0.5)
    refused(rk.SwitchedCTC, "hysteresis", 1.0, 1.0, hysteresis=[1.2, 1.3])
    switched = rk.SwitchedCTC(1.0, 1.0)
    refused(switched.choose, "q", TESTBED, Q)
    refused(switched.choose, "current", TESTBED, Q[0], (0, 5))
    refused(switched.pairs, "q", TESTBED, Q[0])
    assert switched.pairs(TESTBED, Q[:0]).shape == (0, 2)
    laws = (
        pd,
        rk.AntagonismFilter(pd),
        rk.CommandFilter(pd),
        rk.APD(1.0, 1.0),
        rk.CTC(1.0, 1.0, None),
        switched,
        rk.RedundantAPD(1.0, 1.0),
        rk.RedundantCTC(1.0, 1.0),
    )
    for law in laws:
        refused(law.torque, "q_a", TESTBED, Q, QD, Q[:, :2], QD[:, :3], SAMPLE)
        refused(law.torque, "qd_a", TESTBED, Q, QD, Q[:, :3], QD[:, :3] * np.nan, SAMPLE)
        refused(law.torque, "desired", TESTBED, Q[:4], QD[:4], Q[:4, :3], QD[:4, :3], SAMPLE)
        other = MACHINES["four_arms"]
        q, qd, _, _ = random_motion(other, 5)
        refused(law.torque, "desired", other, q, qd, q[:, :4], qd[:, :4], SAMPLE)
        if law is not pd:
            refused(law.torque, "q_a", TESTBED, Q, QD, Q[:4, :3], QD[:4, :3], SAMPLE)
            refused(law.torque, "q", TESTBED, Q[:, :5], QD, Q[:, :3], QD[:, :3], SAMPLE)


def test_controller_names_what_it_misses():
    true = rk.Controller(rk.CTC(1.0, 1.0, pose="true"), TESTBED)
    refused(true, "truth", 0.0, Q[0, :3], QD[0, :3], PATH[0])
    measured = rk.Controller(rk.CTC(1.0, 1.0), TESTBED)
    refused(measured, "q_a", 0.0, Q[0, :2], QD[0, :3], PATH[0])
    refused(measured, "qd_a", 0.0, Q[0, :3], QD[0, :2], PATH[0])


def test_rules_measures_and_numbers():
    refused(rk.select_independent, "rule", A_TILDE, "largest")
    refused(rk.select_independent, "rule", A_TILDE, None)
    for bad in ("sigma", 3, None, ["cross"]):
        refused(rk.actuation_map, "measure", TESTBED, bad)
        refused(rk.switching_map, "rule", TESTBED, bad)
    for bad in (1, 0, -5, 2.5, np.nan, "9", [5, 5], True):
        refused(rk.actuation_map, "n", TESTBED, n=bad)
    for bad in ((0, 0, 0, 1), (1, 0, 0, 1), (0, 1, 0, 0), (0, 1, 1, 0), (0, 1, 0), "box", (0, 1, 0, np.inf)):
        refused(rk.actuation_map, "box", TESTBED, n=5, box=bad)
    for bad in ((0, 0), (0, 3), 1, "01"):
        refused(rk.actuation_map, "pair", TESTBED, n=5, pair=bad)
    for bad in ([1, 1], [1, 1, 0], [1, 1, 0.5], "+++", np.nan):
        refused(rk.actuation_map, "mode", TESTBED, n=5, mode=bad)
        refused(rk.inverse_kinematics, "mode", TESTBED, X, bad)
    refused(rk.actuation_map, "robot", MACHINES["five_bar"], "prestress", n=5)
    refused(rk.null_vector, "robot", MACHINES["five_bar"], np.zeros(4))
    for bad in (0.0, -1e-9, np.nan, "tight", [1e-9, 1e-9]):
        refused(rk.degree_of_actuation, "tolerance", TESTBED, Q, bad)
        refused(rk.degree_of_freedom, "tolerance", TESTBED, Q, bad)
        refused(rk.close_loops, "tolerance", TESTBED, Q, bad)
        refused(rk.estimate_pose, "tolerance", TESTBED, Q[:, :3], X, bad)
        refused(rk.copper_loss, "dt", TESTBED, C, bad)
    for bad in (0, 1.5, "many"):
        refused(rk.close_loops, "iterations", TESTBED, Q, iterations=bad)
        refused(rk.estimate_pose, "iterations", TESTBED, Q[:, :3], X, iterations=bad)
    refused(rk.copper_loss, "c", TESTBED, np.ones(3), 1e-3)
    refused(rk.singular_values, "A", np.ones((5, 3, 4)))
    for bad in (0, 1.5, 4):
        refused(rk.closed_loop_projector, "delta", np.ones((3, 6)), bad)


@pytest.mark.parametrize("rank", [0, 1, 2, 3])
@pytest.mark.parametrize("delta", [1, 2, 3])
def test_a_delta_that_is_not_the_rank_is_named(rank, delta):
    """A product of factors of `rank` columns has that rank; also where one of many poses differs."""
    draw = np.random.default_rng(rank).normal
    A, regular = draw(size=(3, rank)) @ draw(size=(rank, 6)), draw(size=(3, delta)) @ draw(size=(delta, 6))
    if rank == delta:
        assert rk.closed_loop_projector(A, delta).shape == (6, 6)
        return
    less = r" \(at an input singularity it is less than elsewhere\)" if rank < delta else ""
    words = rf"delta = {delta}, but A_tilde has rank {rank}{less}; allowed: the rank of"
    for A_tilde in (A, np.stack([regular, A])):
        with pytest.raises(ValueError, match=words):
            rk.closed_loop_projector(A_tilde, delta)


def test_rows_that_are_dependent_just_below_the_bound_are_named_where_all_of_them_are_just_above():
    """Of singular values 1 and s of A_tilde, near 1e-12, a choice of rows has a smaller ratio: no index is missing."""
    draw, dependent = np.random.default_rng(0), 0
    for s in np.geomspace(5e-13, 2e-12, 60):
        (U, _), (V, _) = np.linalg.qr(draw.normal(size=(3, 2))), np.linalg.qr(draw.normal(size=(6, 2)))
        try:
            assert rk.closed_loop_projector(U * [1.0, s] @ V.T).shape == (6, 6)
        except ValueError as error:
            assert re.match("delta = 2, but A_tilde has rank 1|A~_1, the chosen rows .*, has lost rank", str(error))
            dependent += str(error).startswith("A~_1")
    assert dependent > 0


def test_rank_loss_is_named():
    flat = np.ones((3, 2))
    for f in (rk.weighted_pseudoinverse, rk.antagonism_filter, rk.prestress_projector):
        refused(f, "A", flat)
    refused(rk.steady_state_error, "A", flat, 1.0, np.zeros(3))
    refused(rk.explicit_pseudoinverse, "A~_1", np.ones((3, 6)), (0, 1))
    with pytest.raises(ValueError, match=r"^J has lost rank .*; allowed: matrices with rank J = r = 2$"):
        rk.projector(np.zeros((2, 4)))
    for columns in (1, 2, 3):
        refused(rk.common_sign, "A", np.zeros((5, columns)))
    refused(rk.effective_gain, "F", np.zeros((6, 2)), 1.0)
    edge = rk.inverse_kinematics(TESTBED, TESTBED.base[0] + 0.4 * np.array([np.cos(0.5), np.sin(0.5)]))
    refused(rk.orthogonal_complement, "q", TESTBED, edge)
    refused(rk.inverse_dynamics, "q", TESTBED, edge, edge, edge)
    refused(rk.redundant_dynamics, "q", TESTBED, rk.inverse_kinematics(TESTBED, TESTBED.base[0]), np.zeros(6))


def test_weights_too_far_apart_are_told_from_an_input_singularity():
    """The pose is regular, A has full rank: what hides it is W."""
    W = [1e-30, 1.0, 1.0]
    for f in (rk.weighted_pseudoinverse, rk.prestress_projector):
        with pytest.raises(ValueError, match=r"A weighted with W has lost rank .* weights that differ too much"):
            f(A[0], W)


def test_a_corner_of_the_workspace_is_no_input_singularity():
    """Arm 3 folded, the others stretched: J loses rank, and the distal links of arms 1 and 2 are not parallel."""
    corner = rk.inverse_kinematics(TESTBED, TESTBED.base[2])
    assert rk.degree_of_freedom(TESTBED, corner) == 3
    assert abs(rk.distal_cross_products(TESTBED, corner)[0]) > 0.8
    for f in (rk.null_vector, rk.feedback_norm):
        refused(f, "q is a c-space singularity", TESTBED, corner)


def test_a_pose_of_open_loops_has_no_null_vector():
    open_loops = Q[0] + 0.1 * np.eye(6)[0]
    with pytest.raises(ValueError, match="q leaves the loops open"):
        rk.null_vector(TESTBED, open_loops)


@pytest.mark.parametrize("name", ["testbed", "four_arms"])
def test_rates_that_open_the_loops_are_refused_where_a_motion_is_asked_for(name):
    """The sentence's remedy, N_J qd, is accepted; so are rates from closed poses a sample apart, and noise at rest."""
    robot = rk.load(name)
    q = rk.inverse_kinematics(robot, [[0.02, 0.05], [-0.03, 0.01]])
    qd, c = np.random.default_rng(0).normal(size=q.shape), np.zeros(robot.n_arms)
    calls = [
        lambda qd: rk.forward_dynamics(robot, q, qd, c),
        lambda qd: rk.inverse_dynamics(robot, q, qd, 0 * q),
        lambda qd: rk.required_wrench(robot, q, qd, 0 * q),
    ]
    speed = np.abs(np.einsum("kij,kj->ki", rk.constraint_jacobian(robot, q), qd)).max()
    moved = rk.inverse_kinematics(robot, [[0.022, 0.051], [-0.029, 0.008]])  # 2 m/s
    tangent = np.einsum("kij,kj->ki", rk.nullspace_projector(robot, q), qd)
    for call in calls:
        with pytest.raises(ValueError, match=r"qd opens the loops .* allowed: .* nullspace_projector") as caught:
            call(qd)
        assert float(str(caught.value).split()[5]) == pytest.approx(speed, rel=1e-2)
        for fine in (tangent, (moved - q) / 1e-3, 2e-3 * qd / np.abs(qd).max()):
            call(fine)
    assert np.all(np.isfinite(rk.at(robot, q, qd).redundant[1]))  # a law takes what it measures


def test_the_rates_that_open_the_loops_most_for_their_size_are_named():
    """A slow motion that is no motion, and a fast one that errs by more metres, but by a smaller share."""
    robot = rk.load().replace(friction=0.0)
    q = np.stack(2 * [rk.inverse_kinematics(robot, [0.02, 0.05])])
    wrong, J = np.array([0.5, 0.0, 0.0, 0.0, 0.0, 0.0]), rk.constraint_jacobian(robot, q[0])
    fast = 40.0 * rk.orthogonal_complement(robot, q[0]) @ [1.0, 0.0] + 2.0 * wrong
    speed = [np.abs(J @ qd).max() for qd in (wrong, fast)]
    assert speed[0] < speed[1] and speed[0] > speed[1] / np.abs(fast).max()
    for order in ([0, 1], [1, 0]):
        with pytest.raises(ValueError, match=f"at {speed[0]:.3g} m/s"):
            rk.forward_dynamics(robot, q, np.stack([wrong, fast])[order], np.zeros((2, 3)))


@pytest.mark.parametrize("call", ["forward_dynamics", "inverse_dynamics", "required_wrench"])
def test_one_rate_at_many_poses_is_that_rate_at_each_of_them(call):
    """Leading axes are broadcast: the sentence is that of J qd at the worst pose, and rest is rest at each of them."""
    robot = rk.load()
    q = rk.inverse_kinematics(robot, [[0.02, 0.05], [-0.03, 0.01]])
    rest = np.array([0.1, 0.0, 0.0]) if call == "forward_dynamics" else np.zeros(6)
    speed = np.abs(rk.constraint_jacobian(robot, q).sum(axis=-1)).max()
    for qd in (np.ones(6), np.ones((1, 6)), np.ones((2, 6))):
        with pytest.raises(ValueError, match=f"qd opens the loops at {speed:.3g} m/s; allowed: 0.002 m/s"):
            getattr(rk, call)(robot, q, qd, rest)
    together = getattr(rk, call)(robot, q, np.zeros(6), rest)
    for k, pose in enumerate(q):
        alone = getattr(rk, call)(robot, pose, np.zeros(6), rest)
        for one, many in zip(alone, together, strict=True) if call == "forward_dynamics" else [(alone, together)]:
            np.testing.assert_allclose(many[k], one, rtol=0, atol=1e-12)


OUTSIDE = [[0.3, 0.3], [-0.25, -0.2], [1e3, 0.0]]


def test_points_and_paths_outside_the_workspace():
    for p in OUTSIDE:
        refused(rk.inverse_kinematics, "x", TESTBED, p)
        refused(rk.hold, "x", TESTBED, p)
    with pytest.raises(ValueError, match=r"x\[1\] = \(0.3, 0.3\) m lies outside .* base point 1; allowed: 0 to 0.4 m"):
        rk.inverse_kinematics(TESTBED, [[0, 0], [0.3, 0.3]])
    refused(rk.triangle, "x", TESTBED, side=0.5)
    refused(rk.circle, "x", TESTBED, radius=0.2)


def test_arguments_of_the_paths():
    for bad in (0.0, -1.0, np.nan, "0.1", [0.1, 0.2], None, True, 1j):
        for name in ("side", "duration", "dt"):
            refused(rk.triangle, name, TESTBED, **{name: bad})
        for name in ("radius", "duration", "dt", "turns"):
            refused(rk.circle, name, TESTBED, **{name: bad})
    refused(rk.triangle, "dt", TESTBED, duration=1.0, dt=0.3)
    refused(rk.triangle, "dt", TESTBED, duration=1.0, dt=2.0)
    for bad in (-0.1, 2.5, 3.0, np.nan, [0.1], "0"):
        refused(rk.triangle, "rest", TESTBED, rest=bad)
    for bad in ([0, 0, 0], 0.0, [[0, 0], [0, 0]], [np.nan, 0], "origin"):
        refused(rk.triangle, "centre", TESTBED, centre=bad)
        refused(rk.circle, "centre", TESTBED, centre=bad)
        refused(rk.hold, "x", TESTBED, bad)
    refused(rk.triangle, "angle", TESTBED, angle=[0.1, 0.2])
    for bad in ([[0, 0]], [0, 0], np.zeros((3, 3)), [], [[0, 0], [np.nan, 0]]):
        refused(rk.polygon, "corners", TESTBED, bad)
    times = ([0.0], [0.0, 1.0, 3.0], [1.0, 2.0], [0.0, 0.0], [0.0, -1.0], 1.0, [[0.0, 1.0]], ["0", "1"], [0, np.nan])
    for bad in times:
        zero = np.zeros((np.size(bad), 2))
        refused(rk.follow, "t", TESTBED, bad, zero, zero, zero)
    good = np.zeros((3, 2))
    for name in ("x", "xd", "xdd"):
        for bad in (np.zeros((2, 2)), np.zeros((3, 3)), np.zeros((1, 3, 2)), np.nan * good):
            refused(rk.follow, name, TESTBED, [0, 0.1, 0.2], **({"x": good, "xd": good, "xdd": good} | {name: bad}))


def test_question_for_a_place_of_rest():
    good = {"q": Q[0], "K_P": 7.0, "offset": C[0], "quantum": 3e-3, "friction": 4e-3}
    rk.rest_exists(TESTBED, **good)
    bad_values = (
        ("q", Q),
        ("q", Q[0] * np.nan),
        ("K_P", -1.0),
        ("K_P", [1.0, 2.0]),
        ("offset", C),
        ("offset", 0.0),
        ("K_P", [7.0 * np.eye(3)]),
        ("K_P", [7.0 * np.eye(3)] * 3),
        ("quantum", 0.0),
        ("quantum", None),
        ("friction", -1.0),
        ("friction", [0.1, 0.1, 0.1]),
    )
    for name, bad in bad_values:
        refused(rk.rest_exists, name, TESTBED, **(good | {name: bad}))
    refused(rk.antagonism_form, "K_P", TESTBED, PATH, [1.0, 2.0])


def test_no_numpy_warnings_turn_into_results():
    with np.errstate(all="raise"):
        for f in (rk.inverse_dynamics, rk.required_wrench):
            assert np.all(np.isfinite(f(TESTBED, Q, QD, QDD)))
        assert np.all(np.isfinite(rk.singular_values(np.zeros((2, 3, 2)))))


class Silent:
    """What has no words for itself."""

    def __repr__(self):
        raise RuntimeError("no words")

    def __array__(self, dtype=None, copy=None):
        raise RuntimeError("no numbers")


def test_bytes_are_no_numbers():
    for bad in (b"\x00\x01", bytearray(b"\x00\x01\x02")):
        refused(rk.steady_state_torque, "offset", A[0], 7.0, bad)
        refused(rk.control_matrix, "independent", TESTBED, Q[0], bad)
    refused(rk.PD, "K_P", bytearray(b"a"), 0.2)


def test_an_object_without_words_is_named_all_the_same():
    refused(rk.CommandFilter, "law", Silent())
    refused(rk.to_mjcf, "robot", Silent())
    refused(rk.calibrate, "robot", Silent(), Q[:, :3])
    refused(rk.read_log, "source", Silent())
    refused(rk.TorqueLimit, "limit", Silent())
    refused(rk.CommandFilter, "law", "x" * 100000)


@pytest.mark.parametrize("n", [5001, 10**18, 2**63])
def test_a_grid_fits_into_the_memory(n):
    for of in (rk.workspace_grid, rk.actuation_map, rk.switching_map):
        refused(of, "n", TESTBED, n=n)


def test_what_a_decorator_and_a_calibration_ask_for_is_looked_at_once():
    refused(rk.compiled, "at", at="nowhere")
    refused(rk.compiled, "memory", memory=-1)
    for bad in (-7.0, 0.0, [7.0, 7.0]):
        refused(rk.calibrate, "K_P", TESTBED, Q[:, :3], K_P=bad)


@pytest.mark.parametrize("skew", [1e-7, 1e-10])
def test_a_gain_that_is_hardly_symmetric_is_not(skew):
    """Ten digits are written by hand, rounding leaves fifteen."""
    gain, tilt = np.diag([7.0, 8.0, 9.0]), np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    with pytest.raises(ValueError, match="K_P is not symmetric"):
        rk.simulate(TESTBED, rk.PD(gain + 7.0 * skew * tilt, 0.2), PATH)
    rk.simulate(TESTBED, rk.PD(gain + 1e-15 * tilt, 0.2), PATH)


def test_a_tolerance_is_below_one():
    with pytest.raises(ValueError, match="tolerance = 1; allowed"):
        rk.degree_of_actuation(TESTBED, Q[0], tolerance=1.0)
    assert rk.degree_of_actuation(TESTBED, Q[0], tolerance=1e-3) == 2
