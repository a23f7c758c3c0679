"""Model-based laws: APD (19), CTC (20), switched CTC, and the redundant forms of both (28), (32)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..machine.arguments import (
    bounded,
    check_leading,
    exact_array,
    joint_indices,
    joint_vectors,
    matvec,
    one_of,
    positive_definite,
    real_array,
    shaped,
    switch,
)
from ..machine.manipulator import Manipulator, manipulator
from ..machine.values import Array, OptionalArray, OptionalPair, default
from ..mechanics.actuation import distal_cross_products, drive_pairs, weighted_pseudoinverse
from ..mechanics.at import at
from ..mechanics.partition import PARTITION_RULES, explicit_pseudoinverse, first_best, select_independent
from ..mechanics.trajectory import Desired
from .grammar import LawValue, check_asked, gain, joint_gain, measured, seen

_TIE = 1.0 + 1e-9
"""Ratio of two measures above which rounding does not decide which pair is better."""


@dataclass(frozen=True, eq=False, repr=False)
class APD(LawValue):
    """Augmented PD in minimal coordinates (19): c = (A^T)_W^+ (Gbar q2dd^d + Cbar q2d^d + Qbar - K_P e2 - K_D e2d).

    K_P, K_D : one number, (2,) or (2, 2), N m/rad and N m s/rad (N/m and N s/m in end-effector coordinates).
    independent : two 0-based joint indices, or None for the end-effector position.  W : see `weighted_pseudoinverse`.
    Where `independent` or A is singular `torque` raises ValueError, and a run SimulationError.  For pose see `Law`.

    >>> import numpy as np, rapkm_lite as rk; robot = rk.load(); path = rk.circle(robot, 0.05, 0.1); d = path[50]
    >>> law = rk.APD(K_P=7.0, K_D=0.2, independent=(0, 1))
    >>> c = law.torque(robot, d.q, d.qd, d.q_a, d.qd_a, d)
    >>> np.allclose(c, rk.inverse_dynamics(robot, d.q, d.qd, d.qdd))
    True
    """

    K_P: Array
    K_D: Array
    independent: OptionalPair = default((0, 1))
    W: OptionalArray = default(None)
    pose: str = "measured"

    def __post_init__(self):
        self._check_pose()
        self._set(K_P=gain("K_P", self.K_P), K_D=gain("K_D", self.K_D))
        W = None if self.W is None else gain("W", self.W)
        pair = None if self.independent is None else joint_indices("independent", self.independent, None)
        super().__post_init__(W=W, independent=pair)

    def coordinates(self, memory):
        return self.independent

    def _terms(self, model, q, qd, q_a, qd_a, desired):
        """K_P e2 + K_D e2d, q2d^d, q2dd^d and q2d, then Gbar, Cbar, Qbar and (A^T)_W^+."""
        angles, rates = _joint_state(model, q, qd, q_a, qd_a, desired)
        pose = at(model, q, qd).using(self.independent)
        if self.independent is None:
            rate = matvec(np.linalg.pinv(pose.F), pose.qd)
            motion = desired.xd, desired.xdd, rate
            e, ed = pose.x - desired.x, rate - desired.xd
            e = np.broadcast_to(e, (*angles.shape[:-1], 2))  # one torque for each measurement, which do not enter
        else:
            j = list(self.independent)
            motion = desired.qd[..., j], desired.qdd[..., j], pose.qd[..., j]
            e, ed = angles[..., j] - desired.q[..., j], rates[..., j] - desired.qd[..., j]
        feedback = matvec(positive_definite("K_P", self.K_P, 2), e) + matvec(positive_definite("K_D", self.K_D, 2), ed)
        pinv = weighted_pseudoinverse(pose.A, self.W)
        return feedback, *motion, *pose.minimal, pinv

    def torque(self, model, q, qd, q_a, qd_a, desired):
        feedback, rate, acceleration, _, Gbar, Cbar, Qbar, pinv = self._terms(model, q, qd, q_a, qd_a, desired)
        return matvec(pinv, matvec(Gbar, acceleration) + matvec(Cbar, rate) + Qbar - feedback)


@dataclass(frozen=True, eq=False, repr=False)
class CTC(APD):
    """Computed torque in minimal coordinates (20): c = (A^T)_W^+ (Gbar v2 + Cbar q2d + Qbar),

    v2 = q2dd^d - K_D e2d - K_P e2, with the arguments and errors of `APD`; K_P in 1/s^2, K_D in 1/s.

    >>> import rapkm_lite as rk
    >>> rk.CTC(K_P=400, K_D=40, independent=(0, 1))
    CTC(K_P=400.0, K_D=40.0, independent=(0, 1), pose='measured')
    """

    def torque(self, model, q, qd, q_a, qd_a, desired):
        feedback, _, acceleration, rate, Gbar, Cbar, Qbar, pinv = self._terms(model, q, qd, q_a, qd_a, desired)
        return matvec(pinv, matvec(Gbar, acceleration - feedback) + matvec(Cbar, rate) + Qbar)


@dataclass(frozen=True, eq=False, repr=False)
class SwitchedCTC(LawValue):
    """CTC (20) that switches its pair of independent base joints (section 4.2); K_P in 1/s^2, K_D in 1/s.

    It keeps a pair (j, k) until another one has |d_j x d_k| larger by the factor `hysteresis` >= 1; of equal ones, to
    1e-9, it takes the first of `drive_pairs`.  The pair in use is its memory.
    Where no pair is regular `torque` raises ValueError, and a run SimulationError.  For pose see `Law`.

    >>> import rapkm_lite as rk; robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> rk.SwitchedCTC(K_P=400, K_D=40, hysteresis=1.2).choose(robot, q)
    (0, 2)
    """

    K_P: Array
    K_D: Array
    hysteresis: float = 1.2
    pose: str = "measured"

    def __post_init__(self):
        self._check_pose()
        hysteresis = bounded("hysteresis", exact_array("hysteresis", self.hysteresis), 1.0, strict=False)
        super().__post_init__(K_P=gain("K_P", self.K_P), K_D=gain("K_D", self.K_D), hysteresis=float(hysteresis))

    def step(self, memory, sample):
        check_asked(type(self), SwitchedCTC, pairs="choose")
        q, qd = seen(sample).pose(self.pose)
        pair = self.choose(sample.model, q, memory)
        return self.fixed(pair).torque(sample.model, q, qd, sample.q_a, sample.qd_a, sample.desired), pair

    def coordinates(self, memory):
        return memory

    def choose(self, model: Manipulator, q, current: tuple[int, int] | None = None) -> tuple[int, int]:
        """The pair to use at one pose q (2N,), given the current one."""
        q = exact_array("q", q, manipulator(model, "model").n_joints)
        now = () if current is None else joint_indices("current", current, model.n_arms, 2, "drive")
        return self._choices(model, q[None], now)[0]

    def pairs(self, model: Manipulator, q) -> np.ndarray:
        """The pairs (k, 2) used along the poses q (k, 2N); `Run.switches` counts the changes."""
        q = real_array("q", q, manipulator(model, "model").n_joints)
        shaped("q", q, q.ndim == 2, f"(k, {model.n_joints}), poses in the order of time")
        return np.array(self._choices(model, q), dtype=int).reshape(-1, 2)

    def _choices(self, model: Manipulator, q, current=()) -> list[tuple[int, int]]:
        """The pairs along the poses q (k, 2N), beginning with the current one."""
        pairs, chosen = drive_pairs(model), []
        now = pairs.index((min(current), max(current))) if current else None
        measures = np.abs(distal_cross_products(model, q))
        for measure, best in zip(measures.tolist(), first_best(measures).tolist(), strict=True):
            if now is None or measure[best] > _TIE * self.hysteresis * measure[now]:
                now = best
            chosen.append(pairs[now])
        return chosen

    def fixed(self, pair) -> CTC:
        """The CTC law in force while `pair` is used."""
        return CTC(self.K_P, self.K_D, joint_indices("pair", pair, None, 2, "drive"), pose=self.pose)

    def torque(self, model, q, qd, q_a, qd_a, desired):
        """Torques (k, N) for poses in the order of time, q (k, 2N), or (N,) for a single pose with its best pair."""
        q_a, qd_a = (s[..., : model.n_arms] for s in _joint_state(model, q, qd, q_a, qd_a, desired))
        if not (lead := q_a.shape[:-1]):
            return self.fixed(self.choose(model, q)).torque(model, q, qd, q_a, qd_a, desired)
        wanted = desired.x, desired.xd, desired.xdd, desired.q, desired.qd, desired.qdd
        q, qd, *wanted = (np.broadcast_to(v, (*lead, np.shape(v)[-1])) for v in (q, qd, *wanted))
        chosen, c = self.pairs(model, q), np.empty_like(q_a)
        for pair in {tuple(p) for p in chosen.tolist()}:
            k = np.all(chosen == pair, axis=-1)
            part = Desired(desired.n_arms, *(v[k] for v in wanted))
            c[k] = self.fixed(pair).torque(model, q[k], qd[k], q_a[k], qd_a[k], part)
        return c


@dataclass(frozen=True, eq=False, repr=False)
class RedundantAPD(LawValue):
    """Augmented PD in redundant coordinates, line 1 of (28): c = (A~^T)^+ (G~ qdd^d + C~ qd^d + Q~ - K_P e - K_D ed).

    The errors then obey (30), which is G~ edd + (C~ + D K_D) ed + D K_P e = 0 wherever the degree of actuation is
    delta, with D of `closed_loop_projector`.

    K_P, K_D : in N m/rad, N m s/rad.  (m,) = (N,) are the chapter's gains (29), K = diag(0, ..., 0, K_1, ..., K_m) on
        the driven joints (which come first in our q); one number, (2N,) or (2N, 2N) act on all joints.
    rule : partition rule of the explicit pseudoinverse (27), see `select_independent`; the torques do not depend on it.
    projected : False reads line 2 of the print, c = (A~^T)^+ N_J (G qdd^d + C qd^d + Q - K_P e - K_D ed), which is
        another law: both agree for e = ed = 0 and for a desired pose at rest.  Elsewhere a `load` counts in line 2 with
        the acceleration of the arm that carries it (arm 2), in line 1 with that of the end-effector.
    At c-space and input singularities `torque` raises ValueError, and a run SimulationError.  For pose see `Law`.

    >>> import rapkm_lite as rk
    >>> rk.RedundantAPD(K_P=[7.0, 7.0, 7.0], K_D=[0.2, 0.2, 0.2])
    RedundantAPD(K_P=[7.0, 7.0, 7.0], K_D=[0.2, 0.2, 0.2], rule='sigma_min', pose='measured', projected=True)
    """

    K_P: Array
    K_D: Array
    rule: str = "sigma_min"
    pose: str = "measured"
    projected: bool = True

    def __post_init__(self):
        self._check_pose()
        one_of("rule", self.rule, PARTITION_RULES)
        projected = switch("projected", self.projected)
        super().__post_init__(K_P=gain("K_P", self.K_P), K_D=gain("K_D", self.K_D), projected=projected)

    def _terms(self, model, q, qd, q_a, qd_a, desired):
        """K_P e + K_D ed in all joints, then inertia, velocity terms and forces of the line in use, and (A~^T)^+."""
        angles, rates = _joint_state(model, q, qd, q_a, qd_a, desired)
        K_P, K_D = joint_gain("K_P", self.K_P, model.n_arms), joint_gain("K_D", self.K_D, model.n_arms)
        feedback = matvec(K_P, angles - desired.q) + matvec(K_D, rates - desired.qd)
        pose = at(model, q, qd)
        pinv = explicit_pseudoinverse(pose.A_tilde, select_independent(pose.A_tilde, self.rule))
        # (A~^T)^+ N_J = (A~^T)^+, so that N_J need not be written in line 2.
        return feedback, *(pose.redundant if self.projected else (pose.G, pose.C, pose.Q)), pinv

    def torque(self, model, q, qd, q_a, qd_a, desired):
        feedback, G, C, Q, pinv = self._terms(model, q, qd, q_a, qd_a, desired)
        return matvec(pinv, matvec(G, desired.qdd) + matvec(C, desired.qd) + Q - feedback)


@dataclass(frozen=True, eq=False, repr=False)
class RedundantCTC(RedundantAPD):
    """Computed torque in redundant coordinates (32), v = qdd^d - K_D ed - K_P e; the print has qdd instead of qdd^d.

    K_P in 1/s^2, K_D in 1/s, rule, pose and errors: see `RedundantAPD`; (m,) are the chapter's gains (29).
    projected : True reads line 1 of (32), c = (A~^T)^+ (G~ v + C~ qd + Q~) with G~ = N_J G N_J; False reads line 2,
        c = (A~^T)^+ N_J (G v + C qd + Q).  They differ unless v is tangent to V up to Ndot_J qd.

    Line 1 leads to G~ (edd + K_D ed + K_P e) = 0, which the chapter splits into (33) and (34); in independent
    coordinates that is (35), corrected: see `effective_gain`.

    >>> import numpy as np, rapkm_lite as rk; robot = rk.load(); path = rk.circle(robot, 0.05, 0.1); d = path[50]
    >>> c = rk.RedundantCTC(K_P=400, K_D=40).torque(robot, d.q, d.qd, d.q_a, d.qd_a, d)
    >>> np.allclose(c, rk.inverse_dynamics(robot, d.q, d.qd, d.qdd))
    True
    """

    def torque(self, model, q, qd, q_a, qd_a, desired):
        feedback, G, C, Q, pinv = self._terms(model, q, qd, q_a, qd_a, desired)
        return matvec(pinv, matvec(G, desired.qdd - feedback) + matvec(C, np.asarray(qd, dtype=float)) + Q)


def _joint_state(model, q, qd, q_a, qd_a, desired) -> tuple[np.ndarray, np.ndarray]:
    """Joint angles and rates as known: driven joints as measured, elbows from the pose."""
    N = manipulator(model, "model").n_arms
    q, qd = joint_vectors(model.n_joints, q=q, qd=qd)
    q_a, qd_a = measured(model, q_a, qd_a, desired)
    lead = check_leading(q=q.shape[:-1], qd=qd.shape[:-1], q_a=q_a.shape[:-1], qd_a=qd_a.shape[:-1])
    elbows, rates, q_a, qd_a = (np.broadcast_to(part, (*lead, N)) for part in (q[..., N:], qd[..., N:], q_a, qd_a))
    return np.concatenate([q_a, elbows], axis=-1), np.concatenate([qd_a, rates], axis=-1)
