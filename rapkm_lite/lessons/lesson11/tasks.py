"""What the exercises of lesson 11 judge: frequencies of a loop, errors by a wrong model, a law for three duties."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from ...machine.manipulator import load
from ...mechanics.actuation import control_matrix
from ...mechanics.dynamics import minimal_dynamics
from ...mechanics.kinematics import inverse_kinematics
from ...mechanics.trajectory import triangle
from ...simulation.runs import simulate
from ..answers import Ended, given_law
from ..checker import Case, Measured

OFFSET = np.array([4e-3, -2e-3, 5e-3])
PAYLOAD = 0.1


def _plants() -> list:
    lengths, masses = [[0.2, 0.22], [0.23, 0.2], [0.21, 0.24]], [[0.1, 0.2], [0.15, 0.1], [0.2, 0.12]]
    unequal = load().replace(lengths=lengths, masses=masses)
    return [("the testbed", load()), ("unequal arms", unequal), ("four arms", load("four_arms"))]


def pd_frequencies(robot, q, K_P) -> np.ndarray:
    """Natural frequencies (2,) in Hz, the lower one first, of the machine at rest on springs K_P (N,) in N m/rad."""
    A = control_matrix(robot, q)
    G, _, _ = minimal_dynamics(robot, q, 0 * q, None)
    return np.sqrt(np.sort(np.real(np.linalg.eigvals(np.linalg.solve(G, A.T @ (K_P[:, None] * A)))))) / (2 * np.pi)


def frequency_cases(rng) -> list[Case]:
    cases = []
    for label, robot in _plants():
        for x in rng.uniform(-0.06, 0.06, (3, 2)):
            K_P = rng.uniform(3.0, 14.0, robot.n_arms)
            cases.append(Case(label, robot, inverse_kinematics(robot, x), K_P, beyond=robot.n_arms > 3))
    robot = load()
    far, stiff = inverse_kinematics(robot, [0.1, 0.06]), np.array([14.0, 3.0, 3.0])
    equal = Case("equal gains", robot, inverse_kinematics(robot, [0.02, 0.03]), np.full(3, 7.05))
    return [*cases, Case("gains that differ much", robot, far, stiff), equal]


def no_determinant(got, robot, q, K_P) -> tuple[float, str]:
    """The characteristic polynomial det(A^T K_P A - w^2 Gbar) at the answers, over its largest term."""
    A = control_matrix(robot, q)
    G, _, _ = minimal_dynamics(robot, q, 0 * q, None)
    stiffness = A.T @ (K_P[:, None] * A)
    left = [np.linalg.det(stiffness - (2 * np.pi * f) ** 2 * G) for f in np.ravel(got)]
    return float(np.max(np.abs(left)) / np.linalg.det(stiffness)), "characteristic polynomial there, over its last term"


def model_error(robot, model, q, qd, xd, xdd, K_P) -> np.ndarray:
    """Errors (k, 2) in m, true minus desired, of a slow motion under computed torque with a model that is wrong."""
    G, C, Q = minimal_dynamics(robot, q, qd, None)
    G_model, C_model, Q_model = minimal_dynamics(model, q, qd, None)
    missed = np.einsum("kij,kj->ki", G_model - G, xdd) + np.einsum("kij,kj->ki", C_model - C, xd) + Q_model - Q
    return np.linalg.solve(G_model, missed[..., None])[..., 0] / K_P


def _variants() -> list:
    robot = load()
    return [
        ("a payload that the model does not know", robot.replace(load=PAYLOAD), robot),
        ("friction that the model does not know", robot, robot.replace(friction=0.0)),
        ("a payload that is not there", robot, robot.replace(load=0.2)),
        ("gravity that the model does not know", robot.replace(gravity=[0.0, -9.81]), robot),
        ("four arms", load("four_arms").replace(load=PAYLOAD), load("four_arms")),
        ("masses 20 % off", robot, robot.replace(masses=1.2 * robot.masses)),
    ]


def error_cases(rng) -> list[Case]:
    cases = []
    for label, robot, model in _variants():
        path, some = triangle(robot, 0.12, float(rng.choice([2.0, 2.5, 4.0]))), rng.integers(100, 1900, 4)
        motion = path.q[some], path.qd[some], path.xd[some], path.xdd[some]
        K_P = rng.uniform(200.0, 900.0)
        cases.append(Case(label, robot, model, *motion, K_P, beyond=robot.n_arms > 3))
    return cases


def balance(got, robot, model, q, qd, xd, xdd, K_P) -> tuple[float, str]:
    """Force of the law at the answer minus the force that the motion takes."""
    force = []
    for plant, acceleration in ((model, xdd - K_P * np.asarray(got)), (robot, xdd)):
        G, C, Q = minimal_dynamics(plant, q, qd, None)
        force.append(np.einsum("kij,kj->ki", G, acceleration) + np.einsum("kij,kj->ki", C, xd) + Q)
    return float(np.abs(force[0] - force[1]).max()), "force of the law minus force of the motion, in N"


@functools.cache
def duties() -> tuple:
    """The machine without friction and its path, the machine with a payload that the law does not know."""
    robot = load().replace(friction=0.0)
    return robot, triangle(robot, 0.12, 2.5), robot.replace(load=PAYLOAD)


def chosen(answer) -> Any:
    """The law that the student's function chooses for the testbed."""
    law = given_law(answer, duties()[0])
    if not callable(law) and not hasattr(law, "step"):
        raise Ended("wrong", f"a law is wanted, not {type(law).__name__}: return one of the laws of rk, or a function")
    return law


def three_duties(answer) -> list[Measured]:
    """Torque jumps with offsets, the error with an unknown payload, the energy with coarse encoders."""
    law = chosen(answer)
    robot, path, heavy = duties()
    calm = simulate(robot, law, path, OFFSET)
    loaded = simulate(heavy, law, path, OFFSET, model=robot)
    rough = simulate(robot, law, path, OFFSET, encoder=2000, velocity_filter=5e-3)
    error = 1e3 * np.linalg.norm(loaded.x - path.x, axis=-1).max()
    jump = 1e3 * np.abs(np.diff(calm.c, axis=0)).max()
    return [
        Measured("largest error with 100 g on board", error, "mm", 2.6),
        Measured("energy with 2000 counts per turn", rough.energy.sum(), "J", 10.5),
        Measured("energy with good encoders", calm.energy.sum(), "J", 4.0),
        Measured("largest jump of a torque with good encoders", jump, "mN m", 3.0),
    ]


def is_kind(answer, *kinds: str) -> bool:
    """True where the law, or the one inside a filter, is of one of these classes."""
    law = chosen(answer)
    return type(getattr(law, "law", law)).__name__ in kinds
