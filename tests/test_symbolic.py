"""The equations derived from the Lagrangian with SymPy, and the NumPy forms held against them.

For one arm with a tip mass the closed forms are proved (the difference simplifies to zero); for the cut tree of three
different arms the NumPy functions agree with the derivation at random states to rounding.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from samples import MACHINES

import rapkm_lite as rk

sp = pytest.importorskip("sympy")
ROBOT = MACHINES["asymmetric"].replace(friction=0.0, gravity=[1.1, -9.81], load=0.2)
STATES = np.random.default_rng(0).uniform(-3, 3, (20, 2, 6))


class Arm:
    """One arm in symbols: base point, two links with any centre of mass, a rotor, a point mass at the tip."""

    def __init__(self, i=""):
        self.q = sp.symbols(f"theta{i} phi{i}", real=True)
        self.qd = sp.symbols(f"thetadot{i} phidot{i}", real=True)
        names = "bx by l1 l2 m1 m2 c1 c2 I1 I2 Jr load"
        self.parameters = sp.symbols(" ".join(name + i for name in names.split()), positive=True)
        bx, by, l1, l2, m1, m2, c1, c2, I1, I2, Jr, load = self.parameters
        theta, phi = self.q
        u = sp.Matrix([sp.cos(theta), sp.sin(theta)])
        v = sp.Matrix([sp.cos(theta + phi), sp.sin(theta + phi)])
        base = sp.Matrix([bx, by])
        self.a, self.d = l1 * u, l2 * v
        self.tip = base + self.a + self.d
        self.points = [(m1, base + c1 * u), (m2, base + l1 * u + c2 * v), (load, self.tip)]
        self.spin = ((I1 + Jr) * self.qd[0] ** 2 + I2 * (self.qd[0] + self.qd[1]) ** 2) / 2

    def rate(self, expression):
        parts = (expression.diff(x) * xd for x, xd in zip(self.q, self.qd, strict=True))
        return sum(parts, sp.zeros(*expression.shape))

    def kinetic(self):
        return self.spin + sum(m * self.rate(p).dot(self.rate(p)) / 2 for m, p in self.points)

    def potential(self, g):
        return -sum(m * g.dot(p) for m, p in self.points)


def lagrange(q, qd, kinetic, potential):
    """G, C by Christoffel symbols, and Q of G qdd + C qd + Q = u, from the Lagrangian."""
    n = len(q)
    G = sp.hessian(kinetic, qd)
    C = sp.Matrix(
        n,
        n,
        lambda i, j: sum((G[i, j].diff(q[k]) + G[i, k].diff(q[j]) - G[j, k].diff(q[i])) * qd[k] for k in range(n)) / 2,
    )
    return G, C, sp.Matrix([potential]).jacobian(q).T


def zero(expression):
    return all(sp.simplify(sp.expand(entry)) == 0 for entry in expression)


GRAVITY = sp.Matrix(sp.symbols("gx gy", real=True))


@pytest.fixture(scope="module")
def arm():
    one = Arm()
    return one, *lagrange(one.q, one.qd, one.kinetic(), one.potential(GRAVITY))


# Proofs for one arm.
def test_mass_matrix_of_one_arm(arm):
    one, G, _, _ = arm
    _, _, l1, l2, m1, m2, c1, c2, I1, I2, Jr, load = one.parameters
    J_a, J_d = I1 + Jr + m1 * c1**2 + (m2 + load) * l1**2, I2 + m2 * c2**2 + load * l2**2  # Manipulator.arm_inertias
    P = l1 * (m2 * c2 + load * l2)
    cosine = P * sp.cos(one.q[1])
    assert zero(G - sp.Matrix([[J_a + J_d + 2 * cosine, J_d + cosine], [J_d + cosine, J_d]]))


def test_coriolis_matrix_of_one_arm(arm):
    one, G, C, _ = arm
    _, _, l1, l2, _, m2, _, c2, _, _, _, load = one.parameters
    sine = l1 * (m2 * c2 + load * l2) * sp.sin(one.q[1])
    theta, phi = one.qd
    assert zero(C - sp.Matrix([[-sine * phi, -sine * (theta + phi)], [sine * theta, 0]]))
    S = one.rate(G) - 2 * C
    assert zero(S + S.T)
    # Lagrange's equation itself: d/dt dT/dqd - dT/dq = G qdd + C qd.
    gradient = sp.Matrix([one.kinetic()]).jacobian(one.q).T
    assert zero(one.rate(G) * sp.Matrix(one.qd) - gradient - C * sp.Matrix(one.qd))


def test_gravity_forces_of_one_arm(arm):
    one, _, _, Q = arm
    _, _, l1, l2, m1, m2, c1, c2, _, _, _, load = one.parameters
    gx, gy = GRAVITY
    w1, w2 = (m1 * c1 + (m2 + load) * l1) / l1, (m2 * c2 + load * l2) / l2  # Manipulator.arm_moments over the lengths
    turned = lambda v: gx * v[1] - gy * v[0]  # noqa: E731
    assert zero(Q - sp.Matrix([w1 * turned(one.a) + w2 * turned(one.d), w2 * turned(one.d)]))


def test_jacobian_of_one_arm_and_its_inverse(arm):
    one = arm[0]
    turn = sp.Matrix([[0, -1], [1, 0]])
    blocks = one.tip.jacobian(one.q)
    assert zero(blocks - sp.Matrix.hstack(turn * (one.a + one.d), turn * one.d))
    # F in end-effector coordinates: the rows d / (a x d) and -(a + d) / (a x d) invert the block.
    den = one.a[0] * one.d[1] - one.a[1] * one.d[0]
    F = sp.Matrix.vstack(one.d.T, -(one.a + one.d).T) / den
    assert zero(sp.simplify(blocks * F) - sp.eye(2))
    # Jdot of one arm.
    rates = sp.Matrix.hstack(-one.qd[0] * one.a - sum(one.qd) * one.d, -sum(one.qd) * one.d)
    assert zero(one.rate(blocks) - rates)


def test_null_vector_in_closed_form():
    # n_i = den_i (d_j x d_k) annihilates the rows d_i / den_i: the Jacobi identity of planar vectors.
    d = [sp.Matrix(sp.symbols(f"x{i} y{i}")) for i in range(3)]
    den = sp.symbols("s0:3")
    cross = lambda a, b: a[0] * b[1] - a[1] * b[0]  # noqa: E731
    total = sum((den[i] * cross(d[(i + 1) % 3], d[(i + 2) % 3]) * d[i] / den[i] for i in range(3)), sp.zeros(2, 1))
    assert zero(total)


def test_rate_of_the_projector():
    # d/dt (I - J^+ J) with J^+ = J^T (J J^T)^-1, proved for a general 1 x 3 constraint.
    J, J_dot = sp.Matrix([sp.symbols("j1:4", real=True)]), sp.Matrix([sp.symbols("k1:4", real=True)])
    pinv = J.T / J.dot(J)
    N = sp.eye(3) - pinv * J
    rate = sum((N.diff(j) * k for j, k in zip(J, J_dot, strict=True)), sp.zeros(3, 3))
    half = pinv * J_dot * N
    assert zero(rate + half + half.T)


# The loops: three different arms, the NumPy functions against the derivation.
@pytest.fixture(scope="module")
def loops():
    arms = [Arm(str(i)) for i in range(3)]
    q = [a.q[0] for a in arms] + [a.q[1] for a in arms]
    qd = [a.qd[0] for a in arms] + [a.qd[1] for a in arms]
    values = {}
    for i, arm in enumerate(arms):
        numbers = [
            *ROBOT.base[i],
            *ROBOT.lengths[i],
            *ROBOT.masses[i],
            *ROBOT.centers[i],
            *ROBOT.inertias[i],
            ROBOT.rotor_inertia[i],
            ROBOT.load if i == 1 else 0.0,
        ]
        values |= dict(zip(arm.parameters, numbers, strict=True))
    values |= dict(zip(GRAVITY, ROBOT.gravity, strict=True))
    tips = [a.tip.subs(values) for a in arms]
    h = sp.Matrix.vstack(tips[0] - tips[1], tips[2] - tips[1])
    J = h.jacobian(q)
    J_dot = sum((J.diff(x) * xd for x, xd in zip(q, qd, strict=True)), sp.zeros(*J.shape))
    kinetic, potential = (
        sum(energies).subs(values) for energies in ([a.kinetic() for a in arms], [a.potential(GRAVITY) for a in arms])
    )
    G, C, Q = lagrange(q, qd, kinetic, potential)
    return {
        name: sp.lambdify([q, qd], expression, "numpy")
        for name, expression in {"h": h, "J": J, "J_dot": J_dot, "G": G, "C": C, "Q": Q}.items()
    }


@pytest.mark.parametrize(
    ("name", "numpy_form"),
    [
        ("h", lambda q, qd: rk.loop_constraints(ROBOT, q)[:, None]),
        ("J", lambda q, qd: rk.constraint_jacobian(ROBOT, q)),
        ("J_dot", lambda q, qd: rk.constraint_jacobian_dot(ROBOT, q, qd)),
        ("G", lambda q, qd: rk.mass_matrix(ROBOT, q)),
        ("C", lambda q, qd: rk.coriolis_matrix(ROBOT, q, qd)),
        ("Q", lambda q, qd: rk.generalized_forces(ROBOT, q, qd)[:, None]),
    ],
)
def test_numpy_forms_of_the_cut_tree(loops, name, numpy_form):
    for q, qd in STATES:
        assert_allclose(numpy_form(q, qd), loops[name](q, qd), atol=1e-14 * max(1, np.abs(loops[name](q, qd)).max()))
