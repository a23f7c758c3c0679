"""A design exercise: the lowest energy with unequal motors, judged in closed loop."""

from __future__ import annotations

import numpy as np

from ...control.laws import PD, AntagonismFilter
from ...machine.manipulator import load
from ...mechanics.antagonism import null_vector
from ...mechanics.trajectory import triangle
from ...simulation.runs import SimulationError, simulate
from ..answers import blind, given_law, stiffness
from ..checker import Exercise, Measured

OFFSETS = ((4e-3, -2e-3, 5e-3), (-3e-3, -3e-3, -3e-3))
ERROR, ENERGY = 2.0, 3.0  # mm, J


def _machine():
    return load().replace(friction=0.0, resistance=[0.3, 0.6, 2.4])


def lean_law(robot):
    """PD control behind the filter that weighs each torque by the heat it makes."""
    W = robot.resistance / robot.torque_constant**2
    return AntagonismFilter(PD(10.0, 0.27), W=W)


def _runs(make) -> list[Measured]:
    """The larger error and the larger bill of two runs with offsets, and with links that the law does not know."""
    robot = _machine()
    real = robot.replace(masses=1.01 * robot.masses)
    path, error, energy = triangle(robot, dt=2e-3), 0.0, 0.0
    for offset in OFFSETS:
        law = given_law(make, robot)
        try:
            run = simulate(real, law, path, offset, model=robot)
        except SimulationError as lost:
            if lost.__cause__ is not None:
                raise
            return [Measured(f"largest error (lost at {lost.time:.2f} s)", np.inf, "mm", ERROR)]
        error = max(error, 1e3 * float(np.linalg.norm(run.x - path.x, axis=1).max()))
        energy = max(energy, float(run.energy.sum()))
        if energy > 2 * ENERGY or error > 2 * ERROR:
            break
    return [Measured("largest error", error, "mm", ERROR), Measured("energy", energy, "J", ENERGY)]


def _probed(test):
    """True for a function whose change with the measured angles, (3, 3), and the null vector there pass the test."""

    def made(make) -> bool:
        path = triangle(_machine(), dt=2e-3)
        K = stiffness(make(_machine()), path[300])
        return bool(np.isfinite(K).all() and test(K, null_vector(_machine(), path.q[300])))

    return made


def _fights(K, n) -> bool:
    """Does an error that contradicts itself make a torque?"""
    return bool(np.abs(K @ n).max() > 1e-3 * np.abs(K).max())


def _filtered(test):
    """True for a filter around something whose weights, one per drive, pass the test."""

    def made(make) -> bool:
        law = make(_machine())
        return isinstance(law, AntagonismFilter) and test(law, law.W)

    return made


def _ratios(W) -> np.ndarray:
    """The weights of the drives, relative to the first."""
    diagonal = np.diag(W) if W.ndim == 2 else np.broadcast_to(W, 3)
    return diagonal / diagonal[0]


_unweighted = _filtered(lambda law, W: isinstance(law.law, PD) and (W is None or np.ptp(_ratios(W)) < 1e-9))

LEAN_LAW = Exercise(
    lean_law,
    hints=(
        "Two things cost: the drives' quarrel, and torque in the hot motor that a cold one could give. What removes "
        "the first, and what shifts the second?",
        "Heat is R_el (c/k_t)^2 per drive: with these weights the filter looks for the least heat. And a gain decides "
        "the error, hardly the bill.",
        "rk.AntagonismFilter(rk.PD(10.0, 0.27), W=robot.resistance / robot.torque_constant**2).",
    ),
    judge=_runs,
    close=0.03,
    improve="a stiffer loop follows closer, and under a filter costs next to nothing; a high bill needs other weights",
    mistakes={
        "the readings are not used: torques fed forward without feedback let the machine drift (a gain is missing)": (
            lambda make: blind(make(_machine()), triangle(_machine(), dt=2e-3)[300])
        ),
        "the feedback pushes away from the path (sign): a drive ahead of its desired angle must be held back": (
            _probed(lambda K, n: np.linalg.eigvalsh(K + K.T)[-1] > 1e-3 and np.trace(K) > 0.0)
        ),
        "there is no filter: the drives pay for their quarrel (the antagonism is not removed)": (
            lambda make: isinstance(make(_machine()), PD) or _probed(_fights)(make)
        ),
        "the weights are missing or alike: this filter makes c^2 small, not the heat R_el (c/k_t)^2": (
            lambda make: _unweighted(make) or _probed(lambda K, n: not _fights(K, n) and not _fights(K.T, n))(make)
        ),
        "the weights are upside down: the hot drive must be spared, its weight is the largest (inverse)": (
            _filtered(lambda law, W: isinstance(law.law, PD) and W is not None and _ratios(W)[2] < 1.0)
        ),
    },
    points=10,
)
