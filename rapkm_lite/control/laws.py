"""Decentralized PD (12), PD with an integral, and the antagonism filters (16)-(18), in the grammar of `Law`."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..machine.arguments import (
    bounded,
    exact_array,
    matvec,
    numeric,
    positive_definite,
    real_array,
    shaped,
    short,
    whole_number,
)
from ..machine.manipulator import manipulator
from ..machine.values import Array, OptionalArray, default
from ..mechanics.actuation import control_matrix, weighted_pseudoinverse
from ..mechanics.antagonism import antagonism_filter, command_filter
from .grammar import LawLike, LawValue, as_law, ask, begin, check_asked, coordinates, gain, measured, seen


@dataclass(frozen=True, eq=False, repr=False)
class PD(LawValue):
    """Decentralized PD control (12), c = -K_P e - K_D ed, each drive on its own.

    K_P in N m/rad, K_D in N m s/rad: one number, one per drive (N,), or a positive definite (N, N).
    Raises ValueError when a gain is not positive.

    >>> import rapkm_lite as rk
    >>> rk.PD(7.05, 0.225)
    PD(K_P=7.05, K_D=0.225)
    """

    K_P: Array
    K_D: Array
    pose = None

    def __post_init__(self):
        super().__post_init__(K_P=gain("K_P", self.K_P), K_D=gain("K_D", self.K_D))

    def start(self, model, dt):
        self.gains(manipulator(model, "model").n_arms)

    def step(self, memory, sample):
        if type(self) is not PD:
            return super().step(memory, sample)  # by the formula, which a class of a user's may change
        e, ed = seen(sample).errors()
        return -_times(self.K_P, e) - _times(self.K_D, ed), memory

    def gains(self, m: int) -> tuple[np.ndarray, np.ndarray]:
        """K_P and K_D as (m, m) matrices."""
        m = whole_number("m", m, 1, 1000)
        return positive_definite("K_P", self.K_P, m), positive_definite("K_D", self.K_D, m)

    def torque(self, model, q, qd, q_a, qd_a, desired):
        K_P, K_D = self.gains(manipulator(model, "model").n_arms)
        q_a, qd_a = measured(model, q_a, qd_a, desired)
        return -matvec(K_P, q_a - desired.q_a) - matvec(K_D, qd_a - desired.qd_a)


@dataclass(frozen=True, eq=False, repr=False)
class PID(LawValue):
    """PD (12) with the integral of the error, c = -(K_P e + K_D ed + K_I int e dt), cut off at +-limit.

    K_P, K_D : see `PD`.  K_I in N m/(rad s): likewise, zero allowed for a number or diagonal.
    limit : largest torque in N m, one number or one per drive; the integral of a drive at its limit stands still.
    Its memory is the integral (N,) in N m.
    Raises ValueError when a gain or the limit is out of range.

    >>> import rapkm_lite as rk
    >>> rk.PID(K_P=7.05, K_I=20.0, K_D=0.225, limit=0.1)
    PID(K_P=7.05, K_I=20.0, K_D=0.225, limit=0.1)
    """

    K_P: Array
    K_I: Array
    K_D: Array
    limit: Array = default(math.inf)
    pose = None

    def __post_init__(self):
        self._set(K_P=gain("K_P", self.K_P), K_I=gain("K_I", self.K_I, zero=True), K_D=gain("K_D", self.K_D))
        super().__post_init__(limit=torque_limit(self.limit))

    def start(self, model, dt):
        N = manipulator(model, "model").n_arms
        for name in ("K_P", "K_I", "K_D", "limit"):
            value = getattr(self, name)
            fits = f"one number or ({N},)" if name == "limit" else f"one number, ({N},) or ({N}, {N})"
            shaped(name, value, value.shape in ((), (N,), (N, N)), fits)
        return np.zeros(N)

    def step(self, memory, sample):
        check_asked(type(self), PID)
        e, ed = seen(sample).errors()
        memory = exact_array("memory", memory, len(e))
        integral = memory + _times(self.K_I, sample.dt * e)
        c = -(_times(self.K_P, e) + _times(self.K_D, ed) + integral)
        held = np.clip(c, -self.limit, self.limit)
        return held, np.where(held == c, integral, memory)


def _times(K: np.ndarray, e: np.ndarray) -> np.ndarray:
    """K e of one sample, for a gain that is a number, a diagonal or a matrix."""
    return K * e if K.ndim < 2 else K @ e


def torque_limit(limit) -> np.ndarray:
    """A largest torque in N m, one number or (N,), not negative; infinity is no limit."""
    array = numeric("limit", limit)
    shaped("limit", array, array.ndim <= 1 and array.size > 0, "one number or one per drive")
    bounded("limit", real_array("limit", np.where(array == math.inf, 0.0, array)), 0.0, strict=False)
    return array


@dataclass(frozen=True, eq=False, repr=False)
class AntagonismFilter(LawValue):
    """Force form (16): c = R c' of the torques c' of any other law, R = (A^T)^+ A^T of (15) at the pose.

    law : a law, or a callable ``(t, q_a, qd_a, desired) -> c'``; its memory is handed on.
    pose : "measured" or "true", where R is formed; the law inside keeps its own.
    W : positive definite number, (m,) or (m, m); then R = (A^T)_W^+ A^T, and of all torques with the same end-effector
        force c has the smallest c^T W c.  W = diag(R_el / k_t^2) makes the least heat; default the identity.
    Where there is no R, at input singularities and where an arm is stretched or folded, `torque` raises ValueError, and
    a run ends with SimulationError.

    >>> import rapkm_lite as rk
    >>> rk.AntagonismFilter(rk.PD(7.05, 0.225))
    AntagonismFilter(PD(K_P=7.05, K_D=0.225), pose='measured')
    """

    law: LawLike
    pose: str = "measured"
    W: OptionalArray = default(None)

    def __post_init__(self):
        self._check_pose()
        as_law(self.law)
        super().__post_init__(W=None if self.W is None else gain("W", self.W))

    def start(self, model, dt):
        return begin(self.law, manipulator(model, "model"), dt)

    def step(self, memory, sample):
        check_asked(type(self), AntagonismFilter)
        c, memory = ask(self.law, memory, seen(sample))
        q, _ = sample.pose(self.pose)
        return self.matrix(sample.model, q) @ c, memory

    def matrix(self, model, q) -> np.ndarray:
        """R (..., m, m) of (15) at the pose q (..., 2N)."""
        A = control_matrix(manipulator(model, "model"), q)
        return antagonism_filter(A) if self.W is None else weighted_pseudoinverse(A, self.W) @ A.mT

    def torque(self, model, q, qd, q_a, qd_a, desired):
        return matvec(self.matrix(model, q), as_law(self.law).torque(model, q, qd, q_a, qd_a, desired))

    def coordinates(self, memory):
        return coordinates(self.law, memory)


@dataclass(frozen=True, eq=False, repr=False)
class CommandFilter(LawValue):
    """Command form: PD drives that get the commands (18), whose errors are filtered as in (17):

    c = -K_P R_{A^T K_P} e - K_D R_{A^T K_D} ed, see `command_filter`.  The end-effector force is that of (16), the
    torques in general only for K = k_P I.  `law` is a `PD`; for pose and errors see `AntagonismFilter`.

    >>> import rapkm_lite as rk
    >>> rk.CommandFilter(rk.PD(7.05, 0.225))
    CommandFilter(PD(K_P=7.05, K_D=0.225), pose='measured')
    """

    law: PD
    pose: str = "measured"

    def __post_init__(self):
        self._check_pose()
        kind = type(self.law)
        if not issubclass(kind, PD) or any(getattr(kind, k) is not getattr(PD, k) for k in ("step", "torque", "gains")):
            raise ValueError(f"law = {short(self.law)}; allowed: PD, whose commands are filtered, and no more than it")
        super().__post_init__()

    def start(self, model, dt):
        return self.law.start(model, dt)

    def commands(self, model, q, q_a, qd_a, desired) -> tuple[np.ndarray, np.ndarray]:
        """The filtered commands (18) for angles and rates, each (..., N), formed with the *measured* angles."""
        q_a, qd_a = measured(model, q_a, qd_a, desired)
        A = control_matrix(model, q)
        e, ed = q_a - desired.q_a, qd_a - desired.qd_a
        return q_a - matvec(command_filter(A, self.law.K_P), e), qd_a - matvec(command_filter(A, self.law.K_D), ed)

    def torque(self, model, q, qd, q_a, qd_a, desired):
        q_c, qd_c = self.commands(model, q, q_a, qd_a, desired)
        K_P, K_D = self.law.gains(model.n_arms)
        return -matvec(K_P, q_a - q_c) - matvec(K_D, qd_a - qd_c)
