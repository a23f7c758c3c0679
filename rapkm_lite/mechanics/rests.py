"""The rests of a log: where the desired angles stand still and the machine has settled; what their torques show."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import NamedTuple

import numpy as np

from ..machine.arguments import matvec, short
from ..machine.logs import Log
from ..machine.manipulator import Manipulator
from . import cores
from .at import at
from .encoders import poses

# Fewest records of a rest, without its first quarter, over which its means are taken.
SHORTEST = 10


class Rests(NamedTuple):
    """Means over each rest: desired and measured angles, torques, each (k, N).

    noise : (k, N, 2, 2) covariance of torque and angle of a record.  records : how many each mean has, (k,).
    creeps : of drives that still move, so that their torques may be those of rates, how far torques and angles move
    from the first half of a rest to the second, (k, 2).  braked : of drives whose torques are free of those of rates.
    integral : K_I in N m/(rad s) of drives whose torques grow in the rests with errors and time.
    """

    desired: np.ndarray
    q_a: np.ndarray
    c: np.ndarray
    noise: np.ndarray
    records: np.ndarray
    creeps: Mapping[int, np.ndarray] = {}
    braked: Collection[int] = ()
    integral: Mapping[int, float] = {}

    @property
    def c_error(self) -> np.ndarray:
        """Standard errors of the torques (k, N)."""
        return np.sqrt(self.noise[..., 0, 0] / self.records[:, None])

    def fit(self, i: int, *columns, creeping: bool = False) -> np.ndarray | None:
        """Coefficients b, and their standard errors, of the torque -b[0] e + b[1] column + ... of drive i at error e.

        creeping : a column tells of that, and what moves within the rests is no noise.
        Long rests weigh more.  What is left of the torques is their noise, or where drives still creep or cycle, more;
        few rests leave it uncertain how much, and five standard deviations are as sure as Student's t at a thousandth.
        None where the columns, each (k,), do not determine them with a rest to spare.
        """
        design = np.stack([self.desired[:, i] - self.q_a[:, i], *columns], axis=-1)
        weighted = design.T * self.records
        information = weighted @ design
        size, spare = np.sqrt(np.diagonal(information)), len(design) - design.shape[1]
        if spare < len(columns) or not size.all() or np.linalg.cond(information / np.outer(size, size)) > 1e10:
            return None
        b = np.linalg.solve(information, weighted @ self.c[:, i])
        left = self.c[:, i] - design @ b
        both = np.array([1.0, b[0]])
        # Of torques that follow exactly, rounding: below 0.
        noise = 0.0 if creeping or i in self.braked else max(np.mean(both @ self.noise[:, i] @ both), 0.0)
        if i in self.creeps:
            noise = max(noise, np.mean(self.records * (self.creeps[i] @ both) ** 2))
        if spare:
            from scipy.special import stdtrit

            noise = max(noise, self.records @ left**2 / spare * max(1.0, stdtrit(spare, 0.9995) / 5.0) ** 2)
        return np.stack([b, np.sqrt(np.diagonal(np.linalg.inv(information)) * noise)])

    def settled(self, qd_a: np.ndarray, moved: np.ndarray, jitter: np.ndarray) -> Rests:
        """The same with the torques that the drives would have there without their rates, where the rests show them.

        In short rests drives still creep, and -K_D qd in their torques looks like another gain, or like friction.
        qd_a : (k, N) mean rates, rad/s.  moved : (k, N, 2) as `creeps` says, of all drives.  jitter : (k, N) rad, what
        the angles would move by their noise alone.
        """
        c, creeps, known = self.c.copy(), {}, []
        moves = np.abs(moved[..., 1]) > np.maximum(5.0 * jitter, 0.02 * np.abs(self.desired - self.q_a).max(axis=0))
        for i, rates in enumerate(qd_a.T):
            braked = self.fit(i, -rates, np.ones(len(rates)), creeping=True)
            # A column too many would blur the one that matters.
            if braked is None or abs(braked[0, 2]) <= 5 * braked[1, 2]:
                braked = self.fit(i, -rates, creeping=True)
            if braked is not None and abs(braked[0, 1]) > 5 * braked[1, 1]:
                c[:, i] += braked[0, 1] * rates
                known.append(i)
            elif moves[:, i].any():
                creeps[i] = moved[:, i]
        return self._replace(c=c, creeps=creeps, braked=tuple(known))

    def integrals(self, moved: np.ndarray, seconds: np.ndarray) -> dict[int, float]:
        """`integral`, from how far torques, angles and rates have `moved`, (k, N, 3), between halves of T / 2 seconds.

        By -K_P de - K_D dqd - K_I e T / 2 : what was gathered before is in both.
        """
        halves = self._replace(desired=0.0 * self.q_a, q_a=moved[..., 1], c=moved[..., 0], records=self.records / 4)
        gathered = (self.q_a - self.desired) * seconds[:, None] / 2
        lines = [halves.fit(i, -gathered[:, i], -moved[:, i, 2]) for i in range(self.c.shape[1])]
        return {i: b[0, 1] for i, b in enumerate(lines) if b is not None and b[0, 1] > 5 * b[1, 1]}

    def creeping(self) -> list[str]:
        """A sentence where drives still move, or their torques."""
        if self.integral:
            K_I = ", ".join(f"{K_I:.3g} N m/(rad s) for drive {i + 1}" for i, K_I in self.integral.items())
            return [f"the torques grow in the rests as under a law with an integral, K_I = {K_I}; use the angles"]
        drives = " and ".join(f"{i + 1}" for i in self.creeps)
        far = max((np.abs(moved[:, 1]).max() for moved in self.creeps.values()), default=0.0)
        sentence = (
            f"drives still creep in the rests ({drives}), by up to {1e3 * far:.2g} mrad from the first half to the "
            "second: what their torques show of gain and friction is unsure; rest longer"
        )
        return [sentence] if self.creeps else []


class Gain(NamedTuple):
    """Gains (N,) N m/rad of PD drives as the rests show them, and their standard errors.

    aside : N m, where torques that all lie aside by so much, with another gain, would explain them as well; or NaN.
    """

    K_P: np.ndarray
    error: np.ndarray
    aside: np.ndarray | tuple = ()

    def least(self) -> np.ndarray:
        """Smallest gains (N,) that would differ from none."""
        return np.maximum(5 * self.error, 1e-6 * np.abs(self.K_P).max())

    def instead(self, i: int) -> str:
        """What else than the gain of drive i the rests may show."""
        if abs(self.K_P[i]) <= self.least()[i]:
            return ", as with torques or angles that are noise, stuck, filtered, or those of another drive"
        doubtful = len(self.aside) and self.aside[i] == self.aside[i]
        words = ", or torques that lie {:+.2g} mN m off -K_P times the error, as with friction before a sensor"
        return words.format(1e3 * self.aside[i]) if doubtful else ""

    def doubts(self) -> list[str]:
        """A sentence for each drive whose gain may be another one."""
        others = [self.instead(i) for i in range(len(self.K_P))]
        return [f"drive {i + 1} has K_P = {self.K_P[i]:.3g} N m/rad{words}" for i, words in enumerate(others) if words]

    def objections(self, nominal: np.ndarray) -> list[str]:
        """A sentence for each drive whose gain is not the nominal one, (N,)."""
        return [
            f"the rests show K_P = {k:.3g} N m/rad for drive {i + 1}, not {given:.3g}{self.instead(i)}"
            for i, (k, error, given) in enumerate(zip(self.K_P, self.error, nominal, strict=True))
            if abs(k - given) > max(5 * error, 0.02 * given)
        ]


def rests(logs: list[Log]) -> Rests | None:
    """The rests of all logs, stretches of equal desired angles without their first quarter; None without any."""
    found = []
    for log in logs:
        # Encoders may count other turns than the desired angles do.
        near = log.q_a - 2 * np.pi * np.rint(log.error / (2 * np.pi))
        moves = np.flatnonzero(np.any(np.diff(log.q_a_desired, axis=0) != 0.0, axis=-1)) + 1
        for start, stop in zip([0, *moves], [*moves, len(log.t)], strict=True):
            still = slice(start + (stop - start) // 4, stop)
            count = stop - still.start
            if count >= SHORTEST:
                both = np.stack([log.c[still], near[still]], axis=-1)
                c, q_a = np.moveaxis(both.mean(axis=0), -1, 0)
                off = both - both.mean(axis=0)
                noise = np.einsum("kia,kib->iab", off, off) / (count - 1)
                qd_a = np.gradient(near[still], log.t[still], axis=0, edge_order=2)
                first, second = np.split(np.concatenate([both, qd_a[..., None]], axis=-1), [count // 2])
                moved = second.mean(axis=0) - first.mean(axis=0)
                # From record to record creeping is no noise; a mean over half of them, and a difference of two.
                jitter = np.sqrt(2.0 * np.sum(np.diff(near[still], axis=0) ** 2, axis=0) / (count - 1) / count)
                means = log.q_a_desired[start], q_a, c, noise, count, qd_a.mean(axis=0)
                found.append((*means, moved, jitter, np.ptp(log.t[still])))
    if not found:
        return None
    desired, q_a, c, noise, records, qd_a, moved, jitter, seconds = map(np.array, zip(*found, strict=True))
    stand = Rests(desired, q_a, c, noise, records)
    return stand.settled(qd_a, moved[..., :2], jitter)._replace(integral=stand.integrals(moved, seconds))


def one_sided(stand: Rests, K_P: np.ndarray) -> list[str]:
    """A sentence for each drive whose torques lie off -K_P e at all rests, by a line with slope and intercept.

    Friction between motor and torque sensor does that where all rests are approached from one side: the sensor reads
    c -+ f_c, and the offset comes out wrong by f_c / K_P.
    """
    said = []
    for i in range(stand.c.shape[1]):
        line = stand.fit(i, np.ones(len(stand.c)))
        if line is None:
            continue
        aside, error = line[:, 1]
        if abs(aside) > 5 * error and abs(aside) > 1e-4 * K_P[i]:
            said.append(
                f"the torques of drive {i + 1} lie {1e3 * aside:+.2g} mN m off -K_P times the error, as with friction "
                f"before a sensor or a wrong zero of it: that shifts its offset by {-1e3 * aside / K_P[i]:+.2g} mrad; "
                "approach each place from both sides, or set the zero"
            )
    return said


def fitted_gain(stand: Rests) -> Gain | None:
    """K_P of c = -K_P (q_a - q_desired) over the rests; None where a drive shows no error, or an integral of errors."""
    if stand.integral or np.any(np.abs(stand.q_a - stand.desired).max(axis=0) < 1e-6):
        return None
    found = []
    for i in range(stand.c.shape[1]):
        line, aside = stand.fit(i), stand.fit(i, np.ones(len(stand.c)))
        doubt = np.nan
        # Torques that all lie aside are no part of the gain.
        if aside is not None and abs(aside[0, 1]) > 5 * aside[1, 1]:
            line = aside
        if line is None:
            return None
        if aside is not None and line is not aside and abs(aside[0, 1]) > 2 * aside[1, 1]:
            doubt = aside[0, 1] if abs(line[0, 0] - aside[0, 0]) > 0.02 * abs(line[0, 0]) else np.nan
        found.append((*line[:, 0], doubt))
    return Gain(*np.array(found).T)


def angles_of_torques(robot: Manipulator, stand: Rests | None, gain, K_P, notes: list[str]) -> tuple[np.ndarray, float]:
    """Readings at the rests from their torques, one row a rest, and their standard deviation from the torques'."""
    if stand is None:
        raise ValueError(
            f"use = 'torques', and no log holds still for {4 * SHORTEST // 3} records with torques; allowed: a Log, a "
            "path of one, or a list of these, with such rests"
        )
    if K_P is None:
        if gain is None:
            why = "".join(f" ({sentence})" for sentence in stand.creeping())
            raise ValueError(
                f"K_P = None, and no rest shows it{why}; allowed: the gain of the drives, a number or (N,)"
            )
        K_P = gain.K_P
        notes += gain.doubts()
        left = stand.c + K_P * (stand.q_a - stand.desired)
        if np.sum(left**2) >= 0.25 * np.sum(stand.c**2) or _filtered(robot, stand, K_P):
            raise ValueError(
                "K_P = None, and the torques at rest do not follow the errors of the angles, as under an antagonism "
                "filter, or where either are stuck, shifted or of another drive; allowed: the gain of the drives, or "
                "use = 'angles'"
            )
        for i in np.flatnonzero(K_P <= gain.least()):
            raise ValueError(
                f"K_P = None, and the rests show K_P[{i}] = {K_P[i]:.3g} ± {gain.error[i]:.2g}; allowed: > 0 by five "
                "standard errors (torques of drives that act, with the sign that drives their angles), or K_P as known"
            )
    angles = stand.desired - stand.c / K_P
    try:
        poses(robot, angles)
    except ValueError:
        far = np.abs(angles - stand.desired).max()
        why = f" ({'; '.join(notes)})" if notes else ""
        raise ValueError(
            f"use = 'torques' with K_P = {short(K_P.tolist())} places the encoders up to {far:.3g} rad from the "
            f"desired angles, where no pose fits{why}; allowed: torques in N m and their gain in N m/rad, or "
            "use = 'angles'"
        ) from None
    notes += [] if stand.integral else one_sided(stand, K_P)
    notes += stand.creeping()
    spread = float(np.sqrt(np.mean((stand.c_error / K_P) ** 2)))
    spread = spread if spread > 1e-12 else 0.0  # the rounding of means
    if filtered := _filtered(robot, stand, K_P):
        asked, pressed = filtered
        notes.append(
            f"the torques are mute: errors of the angles ask for {1e3 * asked:.3g} mN m that only press, and there are "
            f"{1e3 * pressed:.2g} mN m, as under a filter, or of drives that are off, or beside wrong angles"
        )
    return angles, spread


def _filtered(robot: Manipulator, stand: Rests, K_P: np.ndarray) -> tuple[float, float] | None:
    """Torques in N m that only press, as the errors ask for them and as they are, where these are no tenth of those.

    That is how they look behind an antagonism filter, whatever weight they carry besides.
    """
    n = cores.null_space(at(robot, poses(robot, stand.q_a)).A).mT
    asked, pressed = (np.abs(matvec(n, c)).max() for c in (K_P * (stand.q_a - stand.desired), stand.c))
    noise = np.sqrt(np.mean(stand.c_error**2))
    return (asked, pressed) if pressed < 0.1 * asked and asked > 5 * max(noise, 1e-12 * K_P.max()) else None
