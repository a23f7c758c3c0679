"""Self-calibration: encoder offsets, link lengths and base points from the closure of redundant encoders.

N encoders measure a pose of two coordinates, so every sample contradicts itself in N - 2 ways unless offsets and
geometry are right.  With n_k a basis of the null space of A^T at the pose of sample k, the closure of its readings is
n_k^T (q_k - offset - q_a(x_k)) = 0: no torque, no gain, no friction enters, and the machine may move.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..machine.arguments import ConvergenceError, bounded, drive_values, one_of, positive_number, small_number
from ..machine.manipulator import Manipulator, manipulator
from ..machine.values import Array, Value
from . import cores
from .at import at
from .encoders import cautions, certain, changed, closure, gauge, measured, poses, rounding, unknown_names
from .rests import angles_of_torques, fitted_gain, rests

UNKNOWNS = {"offsets": 1, "offsets+lengths": 3, "all": 5}  # per drive
GAUGE = ("scale", "rotation", "translation x", "translation y")


class CalibrationError(ValueError):
    """The samples do not determine the unknowns; nothing is estimated.

    rank : how many combinations the samples determine.  needed : how many there are to find.
    known : (rank, p) their coefficients, p unknowns in the order of `Calibration.names`; orthonormal rows, of each the
    coefficient largest in size is positive.
    value : (rank,) what these combinations are, rad and m; of lengths and base points, of their changes from nominal.

    >>> import rapkm_lite as rk
    >>> try:
    ...     rk.calibrate(rk.load(), rk.mystery_run("offset_c"))
    ... except rk.CalibrationError as error:
    ...     print(error.rank, "of", error.needed)
    1 of 3
    """

    def __init__(self, sentence: str, rank: int, needed: int, known: np.ndarray, value: np.ndarray):
        super().__init__(sentence)
        self.rank, self.needed, self.known, self.value = rank, needed, known, value

    def __reduce__(self):
        return type(self), (str(self), self.rank, self.needed, self.known, self.value)


@dataclass(frozen=True, eq=False, repr=False)
class Calibration(Value):
    """What `calibrate` found; read-only.

    names : of the unknowns, in the order of the covariance.  estimate : (p,) rad and m.
    offset : (N,) rad, measured minus true base angle.  lengths : (N, 2) m.  base : (N, 2) m.
    covariance : (p, p) of the estimate for independent noise of the readings, by first order.
    noise : rad, standard deviation of one reading that the covariance uses; for counts, that of the distinct readings,
        larger where long rests jitter (their means, with `noise` given, say more).
    freedom : how many readings were left over to estimate the noise from; infinite where it was given.
    rank : how many combinations of the unknowns the samples determine.  condition : of the closure equations.
    unseen : motions of the unknowns that no sample can show; what is estimated holds them at their nominal values.
    residual : rad, root mean square of the closure that is left.  K_P : (N,) N m/rad of PD drives at rest, or None.
    corrected : the machine with the estimated lengths and base points.  note : sentences on what to mind.

    >>> import rapkm_lite as rk
    >>> found = rk.calibrate(rk.load(), rk.mystery_run("offset_a"))
    >>> found.interval(0.95).shape, found.rank
    ((2, 3), 3)
    """

    names: tuple[str, ...]
    estimate: Array
    offset: Array
    lengths: Array
    base: Array
    covariance: Array
    noise: float
    freedom: float
    rank: int
    condition: float
    unseen: tuple[str, ...]
    residual: float
    K_P: Any
    corrected: Manipulator
    note: str = ""

    def interval(self, level: float = 0.95) -> np.ndarray:
        """Lower and upper limits (2, p) of the estimate at a level of confidence between 0 and 1, each on its own.

        Student's t where the residual showed the noise, with `freedom` degrees, and no narrower than
        the steps of counts make it; normal where the noise was given.
        Raises ValueError where neither the log nor the caller said how large the noise is.
        """
        if self.noise == 0.0:
            raise ValueError("no reading was left over to show the noise; allowed: a calibration with `noise`, in rad")
        level = small_number("level", level)
        from scipy.special import ndtri, stdtrit

        outside = (1.0 - level) / 2
        half = -ndtri(outside)
        if 0 < self.freedom < math.inf:
            # Readings that are counts wander by their rounding at least, however well they seem to agree.
            spread = self.residual * math.sqrt(1.0 + self.rank / self.freedom)
            half = max(half, -stdtrit(self.freedom, outside) * spread / self.noise)
        half = half * np.sqrt(np.diagonal(self.covariance))
        return np.stack([self.estimate - half, self.estimate + half])

    def __repr__(self):
        offset = ", ".join(f"{o:.4g}" for o in 1e3 * self.offset)
        return f"Calibration(offset [{offset}] mrad, rank {self.rank}, residual {1e3 * self.residual:.2g} mrad)"


def calibrate(
    robot: Manipulator, log, unknowns: str = "offsets", use: str = "angles", K_P=None, noise=None
) -> Calibration:
    """Encoder offsets, with link lengths and base points if asked for, from logged angles or torques.

    Minimizes the closure of all samples over the unknowns: Gauss-Newton with the poses eliminated, as in variable
    projection.  Equal readings count once, because a rest repeats one rounding however long it lasts.

    log : a `Log`, several of one machine, the path of a CSV file (`read_log`), or measured base angles (k, N) in rad.
    unknowns : "offsets" (N), "offsets+lengths" (3N) or "all", base points too (5N); of these, four motions stay unseen:
    scale, rotation and two translations of the whole machine.
    use : "angles", every sample, moving or not; or "torques", those of the rests of PD drives under a known gain, of
    which each says where its encoder stood, q_desired - c / K_P, less what rates add where the rests show it.  `note`
    says where drives still creep or integrate, or where friction before a torque sensor shifts an offset by f_c / K_P.
    K_P : number or (N,) N m/rad, for torques; default: fitted to the rests.
    noise : rad, standard deviation of a reading; default: from the residual and the steps of the readings.
    Raises `CalibrationError` where the samples do not determine the unknowns, with the combinations that they do, and
    ValueError for two drives, a log that does not fit the machine or has no rests for "torques", or angles of no pose.

    >>> import rapkm_lite as rk
    >>> rk.calibrate(rk.load(), rk.mystery_run("offset_b")).rank
    3
    """
    manipulator(robot)
    one_of("unknowns", unknowns, UNKNOWNS)
    one_of("use", use, ("angles", "torques"))
    K_P = None if K_P is None else bounded("K_P", drive_values("K_P", K_P, robot.n_arms), 0.0, strict=True)
    noise = None if noise is None else positive_number("noise", noise)
    if noise is not None and noise >= 0.1:
        raise ValueError(f"noise = {noise:g} rad of a reading hides everything; allowed: below 0.1 rad")
    if robot.n_arms < 3:
        raise ValueError(f"robot has {robot.n_arms} drives, whose angles contradict nothing; allowed: three or more")
    angles, logs = measured(robot, log)
    stand = rests(logs)
    gain = fitted_gain(stand) if stand else None
    notes = [] if gain is None or K_P is None else gain.objections(K_P)
    step = rounding(angles)
    if use == "torques":
        # The drives know the readings of their encoders, counts and all.
        angles, spread = angles_of_torques(robot, stand, gain, K_P, notes)
        step = math.hypot(step, spread)
    else:
        angles = np.unique(angles, axis=0)
    return _solved(robot, angles, unknowns, noise, step, None if gain is None else gain.K_P, notes)


def _solved(robot, angles, unknowns, noise, step, K_P, notes) -> Calibration:
    N = robot.n_arms
    nominal = np.concatenate([np.zeros(N), robot.lengths.ravel(), robot.base.ravel()])
    count = N * UNKNOWNS[unknowns]
    # Steps of equal size: one for an angle of 1 rad or for the longest link; the gauge of the base points stands.
    basis = np.eye(5 * N, 5 * N - 4)
    basis[3 * N :, 3 * N :] = cores.null_space(gauge(robot))
    basis[N:] *= robot.lengths.max()
    basis = basis[:count, :count]
    p, blur = nominal[:count], max(step, noise or 0.0)
    sure, x = certain(robot, angles)
    if basis.shape[1] < (N - 2) * sure.sum() < (N - 2) * len(angles):
        # A sample in the wrong assembly mode would hold the unknowns where it fits: those in doubt wait for the others.
        with suppress(ValueError):
            p = _minimum(robot, angles[sure], basis, p, p, x[sure], blur, enough=1e-3)[0]
    p, machine, x, left, sigma, Vt = _searched(robot, angles, basis, nominal[:count], p, x, blur)
    spare, total = len(left) - len(sigma), float(left @ left) * len(angles)
    spread = math.sqrt(total / spare) if spare else 0.0
    used = max(spread, step) if noise is None else noise
    half = basis @ (Vt.T / sigma)
    condition = float(sigma[0] / sigma[-1])
    notes = [*notes, *cautions(x, robot, condition, spread, step, noise)]
    if unknowns == "all":
        notes.append(f"{', '.join(GAUGE)} of the whole machine are held: no reading shows them")
    return Calibration(
        names=unknown_names(N)[: len(p)],
        estimate=p,
        offset=p[:N],
        lengths=machine.lengths,
        base=machine.base,
        covariance=half @ half.T * used**2 / len(angles),
        noise=used,
        freedom=spare if noise is None else math.inf,
        rank=len(sigma),
        condition=condition,
        unseen=GAUGE if unknowns == "all" else (),
        residual=math.sqrt(total / len(left)),
        K_P=K_P,
        corrected=machine,
        note="; ".join(notes),
    )


def _searched(*given):
    """As `_minimum`, with more courage where it is refused; the refusal is that of the more cautious searches."""
    refused = {}
    for courage in range(3):
        try:
            return _minimum(*given, courage=courage)
        except CalibrationError as error:
            refused[courage] = error
        except ValueError:
            if courage == 0:
                raise
    raise refused.get(1, refused[0])


def _minimum(robot, angles, basis, nominal, p, x, blur, enough=0.0, courage=0):
    """Unknowns of least closure, by Gauss-Newton steps from p and the places x (k, 2) m.

    Ends where a step (in `basis`) is below `enough`, or no larger than its rounding error.
    Returns them, their machine, and of the last step the places (k, 2) m, the closure, and the singular values and
    right vectors of its derivative.  blur : rad, what is known of the noise.  courage : 1 goes on where rank is lost,
    along what is determined there, 2 along all, in short steps: far from the minimum what is not explained is no noise.
    Raises `CalibrationError` for too low a rank, ValueError for angles that fit no pose, and ConvergenceError.
    """
    N, size = robot.n_arms, math.inf
    for _ in range(50):
        machine = changed(robot, p)
        pose = at(machine, poses(machine, angles - p[:N], x))
        x = pose.x
        left, rows = (part / math.sqrt(len(angles)) for part in closure(pose, angles - p[:N], len(p)))
        U, sigma, Vt = np.linalg.svd(rows @ basis, full_matrices=False)
        explained, gap = U.T @ left, math.sqrt(left @ left)
        # Rows wander by about the noise of the angles they are taken at: smaller singular values say nothing.
        noise = max(blur, math.sqrt(max(gap**2 - explained @ explained, 0.0)) * (len(left) > len(sigma)))
        rank = int(np.sum(sigma > max(1e-8, 10 * (blur if courage == 2 and gap > 0.02 else noise)) * sigma[0]))
        step = explained[:rank] / sigma[:rank]
        move = -Vt[:rank].T @ step
        far = np.abs(move).max(initial=0.0)
        if courage == 2:
            move *= min(1.0, 0.1 / max(far, 1e-300))
        settled = far < 1e-3
        if courage and settled and gap > 0.02:  # another minimum
            break
        if rank < basis.shape[1] and (settled or not courage):
            spread = noise / math.sqrt(len(angles)) / sigma[:rank]
            raise _refusal(robot, basis, Vt[:rank], step, spread, p - nominal)
        p, size = p + basis @ move, np.abs(move).max(initial=0.0)
        # No step gets smaller than its rounding error, nor than that of base points far from the origin.
        coarse = 1e-13 + 4 * np.spacing(np.abs(robot.base).max()) / robot.lengths.max()
        if rank == basis.shape[1] and size < max(enough, coarse + 8 * np.finfo(float).eps * sigma[0] / sigma[-1]):
            return p, changed(robot, p), x, left, sigma, Vt
    raise ConvergenceError(
        f"calibrate did not converge: its last step was {size:.3g} at offsets {p[:N].tolist()} rad; "
        "allowed: a log of this machine, whose angles are near a pose"
    )


def _refusal(robot, basis, rows, step, spread, moved) -> CalibrationError:
    """What is known: combinations `rows` of the last step in `basis`, after all that was `moved` before."""
    rank, needed = len(rows), basis.shape[1]
    known = rows @ np.linalg.pinv(basis)
    value = known @ moved - step
    Q, R = np.linalg.qr(known.T)  # orthonormal in radians and metres, too
    sign = np.where(Q.max(axis=0) < -Q.min(axis=0), -1.0, 1.0)
    known, value, names = sign[:, None] * Q.T, sign * np.linalg.solve(R.T, value) + 0.0, unknown_names(robot.n_arms)
    spread = np.linalg.norm(np.linalg.solve(R.T, np.diag(spread)), axis=-1)
    terms = (" ".join(f"{c:+.3f} {n}" for c, n in zip(row, names, strict=False) if abs(c) > 5e-4) for row in known[:3])
    changes = ", geometry as changes from nominal" if len(moved) > robot.n_arms else ""
    within = (f" ± {s:.2g}" if s > 0.0 else "" for s in spread)
    told = "; ".join(f"{sum_} = {number:.4g}{s}" for sum_, number, s in zip(terms, value, within, strict=False))
    told += "" if spread.any() else "; no reading is left over to show the noise: pass noise"
    told = told if rank else "nothing, as the readings are rough by 0.1 rad or more"  # the bound of `_minimum`
    words = (
        f"the log determines {rank} of {needed} unknowns; allowed: logs that determine all, so more places and "
        f"further apart, or fewer unknowns. Known to first order, in rad and m{changes}: {told}"
    )
    return CalibrationError(words, rank, needed, known, value)
