"""Control laws as small values: decentralized PD (12) and the antagonism filters (16)-(18).

A law maps what a controller knows to drive torques: ``law.torque(model, q, qd, q_a, qd_a, desired)`` with the pose and
its rate on V (..., 2N), the measured base angles and rates (..., N) and the desired motion; `model` is the
controller's own manipulator.  Errors are measured minus desired.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..machine.arguments import (
    bounded,
    check_leading,
    joint_vectors,
    matvec,
    one_of,
    positive_definite,
    real_array,
)
from ..machine.manipulator import Manipulator
from ..mechanics.actuation import (
    control_matrix,
)
from ..mechanics.antagonism import antagonism_filter, command_filter
from ..mechanics.trajectory import Desired


def gain(name: str, value) -> np.ndarray:
    """A positive number, diagonal or matrix of whatever size; the size is checked where the machine is known."""
    K = real_array(name, value)
    if K.size == 0:
        raise ValueError(f"{name} has shape {K.shape}; allowed: one number, one per coordinate, or a matrix")
    return bounded(name, K, 0.0, strict=True) if K.ndim < 2 else positive_definite(name, K, K.shape[-1])


def measured(model, q_a, qd_a, desired) -> tuple[np.ndarray, np.ndarray]:
    """The measured base angles and rates, after a check that they fit the model and the desired motion."""
    q_a, qd_a = joint_vectors(model.n_arms, q_a=q_a, qd_a=qd_a)
    if desired.n_arms != model.n_arms:
        raise ValueError(f"desired has {desired.n_arms} arms, the model {model.n_arms}; allowed: the same number")
    check_leading(q_a=q_a.shape[:-1], desired=desired.q.shape[:-1])
    return q_a, qd_a


class Law:
    """Base of the laws; `pose` says from where the model matrices take the configuration.

    "measured": the least-squares pose of the measured base angles (`estimate_pose`); "true": the true one, for study.
    """

    pose = "measured"

    def torque(self, model: Manipulator, q, qd, q_a, qd_a, desired: Desired) -> np.ndarray:
        """Drive torques c (..., N) in N m."""
        raise NotImplementedError

    def _check_pose(self) -> None:
        one_of("pose", self.pose, ("measured", "true"))


@dataclass(frozen=True, eq=False)
class PD(Law):
    """Decentralized PD control (12), c = -K_P e - K_D ed, each drive for itself.

    K_P in N m/rad, K_D in N m s/rad: one number, one per drive (N,), or a positive definite (N, N).
    Raises ValueError when a gain is not positive.
    """

    K_P: np.ndarray
    K_D: np.ndarray

    def __post_init__(self):
        object.__setattr__(self, "K_P", gain("K_P", self.K_P))
        object.__setattr__(self, "K_D", gain("K_D", self.K_D))

    def gains(self, m: int) -> tuple[np.ndarray, np.ndarray]:
        """K_P and K_D as (m, m) matrices."""
        return positive_definite("K_P", self.K_P, m), positive_definite("K_D", self.K_D, m)

    def torque(self, model, q, qd, q_a, qd_a, desired):
        K_P, K_D = self.gains(model.n_arms)
        q_a, qd_a = measured(model, q_a, qd_a, desired)
        return -matvec(K_P, q_a - desired.q_a) - matvec(K_D, qd_a - desired.qd_a)


@dataclass(frozen=True, eq=False)
class AntagonismFilter(Law):
    """Force form (16): c = R c', R = (A^T)^+ A^T at the pose, of the torques c' of another law."""

    law: Law
    pose: str = "measured"

    def __post_init__(self):
        self._check_pose()
        if not isinstance(self.law, Law):
            raise ValueError(f"law = {self.law!r}; allowed: a law of this package, such as PD(7.05, 0.225)")

    def torque(self, model, q, qd, q_a, qd_a, desired):
        R = antagonism_filter(control_matrix(model, q))
        return matvec(R, self.law.torque(model, q, qd, q_a, qd_a, desired))


@dataclass(frozen=True, eq=False)
class CommandFilter(Law):
    """Command form (17)-(18): the PD drives get filtered commands, c = -K_P R_P e - K_D R_D ed.

    R_P = (A^T K_P)^+ A^T K_P and R_D alike; the end-effector force is that of (16), the torques only for K = k I.
    """

    law: PD
    pose: str = "measured"

    def __post_init__(self):
        self._check_pose()
        if not isinstance(self.law, PD):
            raise ValueError(f"law = {self.law!r}; allowed: PD, whose commands are filtered")

    def commands(self, model, q, q_a, qd_a, desired) -> tuple[np.ndarray, np.ndarray]:
        """The filtered commands (18) for angles and rates, each (..., N), formed with the *measured* angles."""
        A = control_matrix(model, q)
        q_a, qd_a = measured(model, q_a, qd_a, desired)
        e, ed = q_a - desired.q_a, qd_a - desired.qd_a
        return q_a - matvec(command_filter(A, self.law.K_P), e), qd_a - matvec(command_filter(A, self.law.K_D), ed)

    def torque(self, model, q, qd, q_a, qd_a, desired):
        K_P, K_D = self.law.gains(model.n_arms)
        q_c, qd_c = self.commands(model, q, q_a, qd_a, desired)
        return -matvec(K_P, q_a - q_c) - matvec(K_D, qd_a - qd_c)
