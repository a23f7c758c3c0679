"""Why a run was lost: the first thing that went wrong, found by looking, and by repeating the run without one thing.

A run is repeated only with laws of this package; a user's law is never asked about states that it did not meet.
"""

from __future__ import annotations

import dataclasses
import math
import os
import traceback
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..control.compiled_law import CompiledLaw
from ..control.grammar import BadAnswer, coordinates
from ..control.laws import PID
from ..machine.arguments import short
from ..machine.manipulator import Manipulator
from ..mechanics.actuation import distal_cross_products, drive_pairs
from .codes import FILTERS, FORMS
from .compiled import DONE, LEFT_WORKSPACE, NO_POSE, SINGULAR, TOO_STIFF, encode, single
from .faults import DeadDrive, EncoderDropout, Fault, TorqueLimit, begins, blank_table, described, fault_table
from .growth import growth, inner_law, magnified, swung
from .loop import closed_loop
from .setup import Setup

REASONS = {
    LEFT_WORKSPACE: "the machine left the workspace",
    NO_POSE: "the measured base angles fit no pose of the controller's model",
    SINGULAR: "the torques of the law are not finite, as where its coordinates become singular or its model ends",
    TOO_STIFF: "friction is too stiff for the sampling time",
}
_NONE = np.empty((0, 2))
_FOREIGN = "<frozen", f"{Path(__file__).parents[1]}{os.sep}", f"{Path(traceback.__file__).parent}{os.sep}"
"""How files of Python and of this package begin."""


def explain(setup: Setup, law, status: int, k: int, cause: Exception | None = None, c: np.ndarray = _NONE) -> str:
    """What went wrong at sample k, before which the torques c (k, N) acted."""
    if status not in REASONS:
        if isinstance(cause, BadAnswer):
            return str(cause)
        return f"the law raised {type(cause).__name__}{_said(cause)}{place(cause)}"
    if status == TOO_STIFF:
        friction, v0 = setup.robot.friction.max(), setup.robot.friction_velocity
        return (
            f"{REASONS[TOO_STIFF]} of {setup.trajectory.dt:g} s: f_c / v0 = {friction / v0:g} N m s/rad (friction "
            f"{friction:g} N m, friction_velocity {v0:g} rad/s) needs more than 4000 steps in a hold; allowed: a "
            "larger friction_velocity, less friction or a shorter dt"
        )
    written = _written_by_user(law)
    if status == SINGULAR and written is not None:
        # Run in Python it did neither; an exception cannot leave a compiled function.
        raised = ", or raised an exception there" if isinstance(written, CompiledLaw) else ""
        name = getattr(getattr(written, "function", written), "__name__", None) or short(written)
        return f"the law {name} returned torques that are not {setup.robot.n_arms} finite numbers{raised}"
    pushed = c.any() or not len(c)
    open_end = f"look at gains{_too(setup)} and the path" if pushed else "no drive pushed, all torques were zero"
    words = next(_causes(setup, law, status, k, written is None, c), open_end)
    return f"{REASONS[status]} ({words})"


def _said(error: BaseException | None) -> str:
    """The words of an exception, after a colon; none where `str` itself fails, as where it returns no text."""
    try:
        return f": {error}" if str(error) else ""
    except Exception:
        return ""


def place(error: BaseException | None) -> str:
    """The line of the user's code that raised, as far as the traceback knows it."""
    frames = traceback.extract_tb(getattr(error, "__traceback__", None))
    own = [f for f in frames if "site-packages" not in f.filename and not f.filename.startswith(_FOREIGN)]
    if not own:
        return ""
    line, file, text = own[-1].lineno, Path(own[-1].filename).name, own[-1].line
    return f" (line {line} of {file}{f': {text}' if text else ''})"


def _causes(setup: Setup, law, status: int, k: int, ours: bool, c: np.ndarray) -> Iterator[str]:
    """What may have been the cause, the surest first."""
    begun = sorted((fault for fault in setup.broken if begins(fault) <= setup.trajectory.t[k]), key=begins)
    setup = _with(setup, begun) if setup.broken else setup  # what comes later is not to blame, nor in any repetition
    if not ours:
        yield from _seen(setup, _suspects(setup, begun, status, k), c)
        return
    wrong = _difference(setup.model, setup.robot)
    if wrong and _runs(setup._replace(model=setup.robot), law, k):
        yield f"the controller's model has {wrong}; with the machine's own it is not lost"
    yield from _broken(setup, law, k, begun)
    if status == NO_POSE and not len(c):  # nor are the coordinates of the law
        yield from _sensors(setup, law, k)
    yield from _singular(setup, law, slice(k, k + 1), 0.3)
    factor = growth(setup, law, k) if len(c) else None  # where no torque has acted, no gain is to blame
    if factor is not None and (factor > 1.05 or k * math.log(max(factor, 1.0)) > math.log(100.0)):
        yield f"unstable gain: near the desired state the sampled loop {magnified(factor, setup.trajectory.dt)}"
    yield from _sensors(setup, law, k)
    yield from _singular(setup, law, slice(k), 0.1)
    if factor is not None:
        if factor > 1.001:
            grows = f"an error grows by the factor {factor:.4g} per sample"
            yield f"the gains do not hold it: near the desired state {grows}"
        words = f"near the desired state an error changes only by the factor {factor:.4g} per sample, so look at a weak"
        yield f"{words} gain{_too(setup)}, or a path too near the boundary"


def _seen(setup: Setup, begun: list[Fault], c: np.ndarray) -> Iterator[str]:
    """Without repeating the run: a model that is far off was so from the start, a fault that is felt since it began."""
    model, robot = setup.model, setup.robot
    off = max(np.abs(model.lengths - robot.lengths).max(), np.abs(model.base - robot.base).max())
    if np.any(model.mode != robot.mode) or off > 0.05 * robot.lengths.min():
        yield f"the controller's model has {_difference(model, robot)}"
    dt, felt = setup.trajectory.dt, [fault for fault in begun if fault.felt(c)]
    for fault in felt:
        # A machine that flies apart swings, whatever the cause; a limit may be what an unstable gain leads to.
        before = c[: math.ceil(begins(fault) / dt)]
        if len(before) > 12 and not isinstance(fault, TorqueLimit) and not swung(before, dt):
            yield described(fault)
    yield from filter(None, [swung(c, dt), *map(described, felt)])
    if np.abs(setup.sensors.offset).max() > 0.1:
        yield f"{_offsets(setup)}, is large"
    count, delay = setup.sensors.count, setup.sensors.velocity_filter
    if count is not None and count > 0.1:
        yield f"encoder = {setup.sensors.encoder} counts per turn are {count:.2g} rad each"
    if delay is not None and delay > 10.0 * dt:
        yield f"velocity_filter = {delay:g} s delays the rates by many samples"


def _suspects(setup: Setup, begun: list[Fault], status: int, k: int) -> list[Fault]:
    """Faults but for those that ended long before sample k; of a lost pose those first that change readings."""
    now = setup.trajectory.t[k]
    lasting = [fault for fault in begun if not isinstance(fault, EncoderDropout) or fault.stop > now - 0.1]
    return sorted(lasting, key=lambda fault: status == NO_POSE and isinstance(fault, DeadDrive | TorqueLimit))


def _broken(setup: Setup, law, k: int, begun: list[Fault]) -> Iterator[str]:
    """Faults that have begun, the first one first, and a limit of the law's own."""
    for fault in begun:
        if _runs(_with(setup, [f for f in begun if f is not fault]), law, k):
            yield f"{described(fault)}; without that it is not lost"
    if len(begun) > 1 and _runs(_with(setup, []), law, k):
        yield f"{described(begun[0])}, and other faults with it; without them it is not lost"
    inner = inner_law(law)
    if isinstance(inner, PID) and np.isfinite(inner.limit).any():
        free, own = _replaced(law, limit=math.inf), f"the law's own limit of {inner.limit.min():g} N m"
        if _runs(setup, free, k):
            yield f"{own}; without it it is not lost"
        if begun and _runs(_with(setup, []), free, k):
            yield f"{described(begun[0])}, and {own}; without both it is not lost"


def _singular(setup: Setup, law, rows: slice, least: float) -> Iterator[str]:
    """A desired pose among some samples at which all drives, or the angles of independent ones, nearly fail."""
    pair, pairs, q = coordinates(law, None), drive_pairs(setup.model), setup.trajectory.q[rows]
    if not len(q):
        return
    crossed = np.abs(distal_cross_products(setup.model, q))
    if (most := crossed.max(axis=1).min()) < 0.03 * least:
        yield (
            "near an input singularity, where the distal links are parallel and no drive pushes across them: "
            f"|d_j × d_k| = {most:.2g} at most at the desired pose"
        )
    if pair is not None and (min(pair), max(pair)) in pairs:
        measure = crossed[:, pairs.index((min(pair), max(pair)))].min()
        if measure < least:
            yield (
                f"near a parameterization singularity of its independent drives "
                f"{pair[0] + 1} and {pair[1] + 1}: |d_j × d_k| = {measure:.2g} at the desired pose"
            )


def _sensors(setup: Setup, law, k: int) -> Iterator[str]:
    """What the encoders add: the filter of the rates, counts, and offsets."""
    sensors = setup.sensors

    def without(**ideal) -> bool:
        return _runs(setup._replace(sensors=dataclasses.replace(sensors, **ideal)), law, k)

    delay, coarse = sensors.velocity_filter, sensors.encoder is not None and without(encoder=None)
    if delay is not None and without(velocity_filter=None):
        counts = f" of encoder = {sensors.encoder} counts per turn" if coarse else ""
        yield f"the rates that velocity_filter = {delay:g} s makes{counts} are poor; with the true ones it is not lost"
    if coarse:
        yield f"encoder = {sensors.encoder} counts per turn are too coarse; with ideal angles it is not lost"
    if sensors.offset.any() and without(offset=0.0 * sensors.offset):
        yield f"{_offsets(setup)}, is too large here; with right encoders it is not lost"


def _too(setup: Setup) -> str:
    return ", offsets" if setup.sensors.offset.any() else ""


def _offsets(setup: Setup) -> str:
    offset = setup.sensors.offset
    return f"offset = {short(offset.tolist())} rad, up to {1e3 * np.abs(offset).max():.3g} mrad"


def _difference(model: Manipulator, robot: Manipulator) -> str:
    """In what a model differs from the machine; empty where it does not."""
    parts = []
    if np.any(model.mode != robot.mode):
        parts.append(f"another working mode, {model.signs} instead of {robot.signs}")
    for name in ("lengths", "base", "masses", "inertias", "centers", "rotor_inertia", "friction", "gravity", "load"):
        own, true = np.asarray(getattr(model, name)), np.asarray(getattr(robot, name))
        off, size = np.abs(own - true).max(), np.abs(true).max()
        if off > 0.0:
            parts.append(f"{name} that are off by {f'{100 * off / size:.3g} %' if size > 0.0 else f'{off:g}'}")
    return " and ".join(parts)


def _with(setup: Setup, faults: list[Fault]) -> Setup:
    """The run with other faults, or none; it keeps a table of them, so that nothing is compiled anew."""
    t, N = setup.trajectory.t, setup.robot.n_arms
    return setup._replace(faults=fault_table(faults, t, N) or blank_table(t, N))


def _runs(setup: Setup, law, k: int) -> bool:
    """Does this run go on well beyond sample k?"""
    trajectory = setup.trajectory.for_robot(setup.model)
    setup = setup._replace(trajectory=trajectory).begin(k + k // 2 + 100)
    try:
        code = encode(law, setup)
        outcome, cause = closed_loop(setup, law) if code is None else single(setup, code)
    except (ValueError, ArithmeticError):
        return False
    if cause is not None and not isinstance(cause, Exception):
        raise cause
    return outcome.status == DONE


def _written_by_user(law):
    """The part of a law that a user wrote; None where all of it is of this package."""
    if type(law) in FILTERS:
        return _written_by_user(law.law)
    return None if type(law) in FORMS else law


def _replaced(law, **changes):
    """A law with changes to the law within its filter, or to itself."""
    if law is inner_law(law):
        return dataclasses.replace(law, **changes)
    return dataclasses.replace(law, law=_replaced(law.law, **changes))
