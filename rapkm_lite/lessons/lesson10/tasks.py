"""What the exercises of lesson 10 are tried on: wrong geometry, a limit of torque, and a machine that loses a drive."""

from __future__ import annotations

import numpy as np

from ...control.laws import PD, AntagonismFilter
from ...machine.manipulator import Manipulator, load
from ...mechanics.actuation import control_matrix, prestress_projector
from ...mechanics.antagonism import antagonism_filter, null_basis
from ...mechanics.closure import estimate_pose
from ...mechanics.kinematics import inverse_kinematics
from ...mechanics.trajectory import hold, triangle
from ...simulation.faults import DeadDrive, TorqueLimit
from ...simulation.runs import SimulationError, simulate
from ..answers import given_law
from ..checker import Case, Measured

TOO_LONG, COUNTS, WEAK = 5e-3, 2000, 0.15
ERROR, ENERGY, RIPPLE = 5.0, 7.0, 36.0


def geometry_fight(robot, model, x, K_P) -> np.ndarray:
    """Torques (N,) in N m of PD drives at rest, told by `model` to go to x (2,) m; one gain K_P, N m/rad."""
    wanted = demanded(model, x)
    return K_P * (wanted - estimate_pose(robot, wanted, x)[: robot.n_arms])


def demanded(model, x) -> np.ndarray:
    """Base angles (N,) in rad that a model demands for the place x (2,) in m."""
    return inverse_kinematics(model, x)[: model.n_arms]


def first_order(robot, model, x, K_P, part=prestress_projector) -> np.ndarray:
    """The fight from a projector at the place x itself, (N,) in N m; right to first order in the mistakes."""
    A = control_matrix(robot, inverse_kinematics(robot, x))
    return K_P * part(A) @ (demanded(model, x) - demanded(robot, x))


def wrong_models(rng) -> list[tuple]:
    cases = []
    for name, label in (("testbed", "the testbed"), ("asymmetric", "three different arms"), ("four_arms", "four arms")):
        # A machine that hangs holds torques against its weight, too.
        robot = load(name).replace(gravity=(0.0, 0.0))
        stretched = robot.replace(lengths=robot.lengths * (1 + rng.normal(0, 3e-3, robot.lengths.shape)))
        shifted = robot.replace(base=robot.base + rng.normal(0, 5e-4, robot.base.shape))
        for model, what in ((stretched, "wrong lengths"), (shifted, "wrong base points")):
            x, K_P = rng.uniform(-0.05, 0.05, 2), rng.uniform(3, 12)
            cases.append(Case(f"{label} with {what}", robot, model, x, K_P, beyond=name == "four_arms"))
    return cases


def pushes(got, robot, model, x, K_P) -> tuple[float, str]:
    """At rest the torques move nothing: A^T c = 0 at the pose where the drives have come to stand."""
    q = estimate_pose(robot, demanded(model, x), x)
    return float(np.abs(antagonism_filter(control_matrix(robot, q)) @ got).max()), "torque that moves it (N m)"


def force_left(A, fight, limit) -> float:
    """Force in N that is left in every direction: each drive carries its share of the fight first."""
    return float(np.min((limit - np.abs(fight)) / shares(A)))


def shares(A) -> np.ndarray:
    """Torque of each drive per newton in its worst direction, (N,) in m."""
    return np.linalg.norm(A @ np.linalg.inv(A.T @ A), axis=1)


def fights(rng) -> list[tuple]:
    cases = []
    for name, label in (("testbed", "the testbed"), ("asymmetric", "different arms"), ("four_arms", "four drives")):
        robot = load(name)
        for k, x in enumerate(rng.uniform(-0.06, 0.06, (3, 2))):
            A = control_matrix(robot, inverse_kinematics(robot, x))
            n = null_basis(A)
            # A strong fight brings another drive to its limit than the one with the largest share of the force.
            fight = n @ rng.normal(0, 0.2 if k == 0 else 0.02, n.shape[1])
            limit = float(np.abs(fight).max() + rng.uniform(0.02, 0.1))
            cases.append(Case(label, A, fight, limit, beyond=name == "four_arms"))
    return cases


def touches(got, A, fight, limit) -> tuple[float, str]:
    """The worst drive in the worst direction is at its limit, no other is beyond: tried all around the circle."""
    turn = np.linspace(0, 2 * np.pi, 20_001)
    force = got * np.stack([np.cos(turn), np.sin(turn)])
    most = np.abs(fight[:, None] + A @ np.linalg.solve(A.T @ A, force)).max()
    return float(abs(most - limit)), "largest torque all around less the limit (N m)"


def machine() -> tuple[Manipulator, Manipulator]:
    """The machine as it was built, its links half a per cent too long, and its drawing, which knows no friction."""
    real = load()
    return real.replace(lengths=(1 + TOO_LONG) * real.lengths), real.replace(friction=0.0)


def spare_law(drawing):
    """A filter, which spares the torque, and a gain between an error that is too large and a ripple that is."""
    return AntagonismFilter(PD(19.0, 0.55))


def gains_of_the_lessons(law) -> bool:
    """Is this the filter around the PD drives of the other lessons?"""
    if not isinstance(law, AntagonismFilter) or type(law.law) is not PD:
        return False
    plain = law == AntagonismFilter(law.law)  # at the measured pose, without weights
    return plain and all(np.allclose(K, k * np.eye(3)) for K, k in zip(law.law.gains(3), (7.05, 0.225), strict=True))


def survives(make) -> list[Measured]:
    """The law that `make(drawing)` returns, on the small triangle with each drive dead in turn, and healthy."""
    built, drawing = machine()
    path = triangle(drawing, side=0.12, duration=2.5, dt=2e-3)

    def run(path, *broken):
        faults = [TorqueLimit(WEAK), *broken]
        return simulate(built, given_law(make, drawing), path, encoder=COUNTS, model=drawing, faults=faults)

    healthy, still = run(path), run(hold(drawing, [0.03, 0.02], 1.0, 2e-3))
    found = [
        Measured("energy of the healthy triangle", float(healthy.energy.sum()), "J", ENERGY),
        Measured("ripple at rest", 1e3 * float(still.c[-250:].std(axis=0).max()), "mN m", RIPPLE),
    ]
    for drive in range(built.n_arms):
        try:
            off = np.linalg.norm(run(path, DeadDrive(drive, 0.5)).x - path.x, axis=1)
            words, size = "", 1e3 * float(off.max())
        except SimulationError as error:
            if error.__cause__ is not None:
                raise
            words, size = f" (lost at {error.time:.2f} s)", np.inf
        found.append(Measured(f"drive {drive + 1} dead{words}: largest error", size, "mm", ERROR))
    return found
