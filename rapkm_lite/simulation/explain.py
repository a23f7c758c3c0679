"""Why a run was lost: what stopped it, and whether the sampled loop is unstable there or was led astray."""

from __future__ import annotations

import numpy as np

from ..control.computed_torque import APD, CTC, RedundantAPD, RedundantCTC, SwitchedCTC
from ..control.grammar import BadAnswer, coordinates
from ..control.laws import PD, PID, AntagonismFilter, CommandFilter
from ..control.sample import Controller
from ..mechanics.actuation import distal_cross_products, drive_pairs
from .compiled import LEFT_WORKSPACE, NO_POSE, SINGULAR, TOO_STIFF, Plant
from .setup import Setup

REASONS = {
    LEFT_WORKSPACE: "the machine left the workspace",
    NO_POSE: "the measured base angles fit no pose of the controller's model",
    SINGULAR: "the independent coordinates of the law became singular: its torques are not finite",
    TOO_STIFF: "friction is too stiff for the sampling time",
}


def explain(setup: Setup, law, status: int, k: int, cause: Exception | None = None) -> str:
    """What went wrong at sample k."""
    if status not in REASONS:
        words = f": {cause}" if str(cause) else ""
        return str(cause) if isinstance(cause, BadAnswer) else f"the law raised {type(cause).__name__}{words}"
    if status == TOO_STIFF:
        return too_stiff(setup)
    pair = coordinates(law, None) if _ours(law) else None
    pairs = drive_pairs(setup.model)
    if pair is not None and (min(pair), max(pair)) in pairs:
        crossed = distal_cross_products(setup.model, setup.trajectory.q[k])
        measure = abs(crossed[pairs.index((min(pair), max(pair)))])
        if measure < 0.3:
            return (
                f"{REASONS[status]} (near a parameterization singularity of its independent drives "
                f"{pair[0] + 1} and {pair[1] + 1}: |d_j x d_k| = {measure:.2g} at the desired pose)"
            )
    return f"{REASONS[status]} ({_stability(setup, law, k)})"


def too_stiff(setup: Setup) -> str:
    """The sentence on friction that would need more steps per hold than the engine takes."""
    robot = setup.robot
    return (
        f"{REASONS[TOO_STIFF]} of {setup.trajectory.dt:g} s: f_c / v0 = "
        f"{robot.friction.max() / robot.friction_velocity:g} N m s/rad (friction {robot.friction.max():g} N m, "
        f"friction_velocity {robot.friction_velocity:g} rad/s) needs more than 4000 steps in a hold; allowed: a "
        "larger friction_velocity, less friction or a shorter dt"
    )


def _stability(setup: Setup, law, k: int) -> str:
    factor = growth(setup, law, k) if _ours(law) else None
    if factor is None:
        return "look at gains, offsets and the path"
    if factor > 1.05:
        return (
            f"unstable gain: near the desired state the sampled loop magnifies an error {factor:.3g}-fold per "
            f"sample of {setup.trajectory.dt:g} s"
        )
    if factor > 1.001:
        return f"the gains do not hold it: near the desired state an error grows by the factor {factor:.4g} per sample"
    return (
        f"near the desired state an error changes only by the factor {factor:.4g} per sample, so look at "
        "offsets, a weak gain, or a path too near the boundary"
    )


def _ours(law) -> bool:
    """Is the law one of this package to the core?  A user's law is never asked about states that it did not meet."""
    if type(law) in (AntagonismFilter, CommandFilter):
        return _ours(law.law)
    return type(law) in (PD, PID, APD, CTC, SwitchedCTC, RedundantAPD, RedundantCTC)


def growth(setup: Setup, law, k: int) -> float | None:
    """Factor per sample by which the sampled loop magnifies a small error near the desired state of sample k.

    The spectral radius of the linearized map from one sample to the next, with ideal sensors, a healthy machine and a
    law that remembers nothing yet; None where there is none.
    """
    robot, model, trajectory, _, _ = setup
    plant, dt, desired = Plant(robot, trajectory), trajectory.dt, trajectory[k]
    centre = np.concatenate([trajectory.x[k], trajectory.xd[k]])
    step, columns = 1e-6, []

    def following(state):
        q, qd = plant.observe(k, state)
        c = Controller(law, model, dt).command(trajectory.t[k], q, qd, desired, (state[:2], state[2:]))
        return np.array(plant.hold(state, c, dt))

    try:
        for direction in step * np.eye(4):
            columns.append((following(centre + direction) - following(centre - direction)) / (2 * step))
        return float(np.max(np.abs(np.linalg.eigvals(np.array(columns)))))
    except (ValueError, RuntimeError, TypeError, ArithmeticError, np.linalg.LinAlgError):
        return None
