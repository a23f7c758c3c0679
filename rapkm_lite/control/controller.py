"""A law at work in a sampled loop."""

from __future__ import annotations

import numpy as np

from ..machine.arguments import (
    joint_vectors,
    matvec,
    solve,
    transpose,
)
from ..machine.manipulator import Manipulator
from ..mechanics.actuation import (
    control_matrix,
)
from ..mechanics.closure import estimate_pose
from ..mechanics.kinematics import ee_complement, forward_kinematics, inverse_kinematics
from ..mechanics.trajectory import Desired
from .computed_torque import SwitchedCTC
from .laws import PD, Law


class Controller:
    """A law at work in a sampled loop: it remembers the last pose estimate and the pair in use.

    Called as ``controller(t, q_a, qd_a, desired, truth=(x, xd))`` with measured base angles and rates; the true
    end-effector motion is needed for a law with pose="true" only.
    """

    def __init__(self, law: Law, model: Manipulator):
        self.law, self.model, self.x, self.pair = law, model, None, None

    def __call__(self, t, q_a, qd_a, desired: Desired, truth=None) -> np.ndarray:
        if isinstance(self.law, PD):
            return self.law.torque(self.model, None, None, q_a, qd_a, desired)
        q, qd = self._state(q_a, qd_a, desired, truth)
        law = self.law
        if isinstance(law, SwitchedCTC):
            self.pair = law.choose(self.model, q, self.pair)
            law = law.fixed(self.pair)
        return law.torque(self.model, q, qd, q_a, qd_a, desired)

    def _state(self, q_a, qd_a, desired, truth):
        """Pose and its rate on V by least squares from the measurement, or from the true end-effector motion."""
        model = self.model
        q_a, qd_a = joint_vectors(model.n_arms, q_a=q_a, qd_a=qd_a)
        if self.law.pose == "true":
            if truth is None:
                raise ValueError("truth = None for a law with pose = 'true'; allowed: the true motion (x, xd)")
            x, xd = truth
            q = inverse_kinematics(model, x)
        else:
            q = estimate_pose(model, q_a, desired.x if self.x is None else self.x)
            A = control_matrix(model, q)
            projected = matvec(transpose(A), qd_a)
            xd = solve("A^T A (an input singularity)", transpose(A) @ A, projected[..., None])[..., 0]
            self.x = forward_kinematics(model, q)
        return q, matvec(ee_complement(model, q), xd)
