"""Laws in the words of the engine: names of codes and rows, and what stands in them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..control.compiled_law import CompiledLaw
from ..control.computed_torque import APD, CTC, RedundantAPD, RedundantCTC, SwitchedCTC
from ..control.grammar import joint_gain
from ..control.laws import PD, PID, AntagonismFilter, CommandFilter
from ..machine.arguments import joint_indices, shaped


@dataclass(frozen=True, eq=False)
class Code:
    """A law as the engine knows it: names of its codes, and what fills the rows of the work table.

    drives : values (N,) by name of a row with one number per drive.  run : values by name of a row with one per run.
    """

    form: str
    filter: str
    true_pose: bool
    task: bool
    switched: bool
    drives: dict
    run: dict
    user: CompiledLaw | None = None

    @property
    def kind(self) -> tuple:
        """Codes of one kind can run side by side."""
        return self.form, self.filter, self.true_pose, self.task, self.switched, self.user


FORMS = {
    PD: "PD",
    PID: "PID",
    APD: "APD",
    CTC: "CTC",
    SwitchedCTC: "CTC",
    RedundantAPD: "REDUNDANT_APD",
    RedundantCTC: "REDUNDANT_CTC",
}
FILTERS = {AntagonismFilter: "FORCE_FILTER", CommandFilter: "COMMAND_FILTER"}


def code_of(law: Any, model) -> Code | None:
    """The engine's form of a law, or None where it has none.

    The engine knows diagonal gains and weights, also as matrices, that are not too unequal, and filters that share the
    pose of the law inside.
    """
    form, weights, pose = "NO_FILTER", getattr(law, "W", None), getattr(law, "pose", None)
    if type(law) in FILTERS:
        form, law = FILTERS[type(law)], law.law
        if getattr(law, "W", None) is not None or getattr(law, "pose", None) not in (None, pose):
            return None
    if not _diagonal(weights):
        return None
    if type(law) is CompiledLaw:
        code, drives, run, user = "USER", {}, {}, law
    elif type(law) in FORMS and all(_diagonal(getattr(law, name, None)) for name in ("K_P", "K_D", "K_I")):
        (code, drives, run), user = _gains(law, model.n_arms), None
    else:
        return None
    drives["EASE"] = np.ones(model.n_arms) if weights is None else 1 / _per("W", weights, model.n_arms)
    squares = [drives[name] ** 2 for name in ("GAIN_P", "GAIN_D")] if form == "COMMAND_FILTER" else []
    if any(map(_one_for_all, [drives["EASE"], *squares])):
        return None
    task, switched = getattr(law, "independent", ()) is None, isinstance(law, SwitchedCTC)
    return Code(code, form, pose == "true", task, switched, drives, run, user)


def _diagonal(value) -> bool:
    """Does each coordinate have a number of its own, if there is a value at all?"""
    return np.ndim(value) < 2 or not np.any(value - np.diag(np.diagonal(value)))


def _one_for_all(ease: np.ndarray) -> bool:
    """Does one drive outweigh all others in A^T W^-1 A, whose other direction would be rounding?

    That matrix squares the condition number of what the textbook's factorization works on.
    """
    first, second = np.sort(ease)[:-3:-1]
    return bool(first > 1e6 * second)


def _gains(law: Any, N: int) -> tuple[str, dict, dict]:
    """Code of a law of this package, and what it fills the rows of drives and runs with."""
    code = FORMS[type(law)]
    if code in ("PD", "PID"):
        names = {"GAIN_P": "K_P", "GAIN_D": "K_D"} | ({"GAIN_I": "K_I", "LIMIT": "limit"} if code == "PID" else {})
        return code, {row: _per(name, getattr(law, name), N) for row, name in names.items()}, {}
    if code in ("REDUNDANT_APD", "REDUNDANT_CTC"):
        P, D = (np.diagonal(joint_gain(name, getattr(law, name), N)) for name in ("K_P", "K_D"))
        code = code if law.projected else f"{code}_LINE2"
        return code, {"GAIN_P": P[:N], "ELBOW_P": P[N:], "GAIN_D": D[:N], "ELBOW_D": D[N:]}, {}
    gains = *_per("K_P", law.K_P, 2), *_per("K_D", law.K_D, 2)
    pair = getattr(law, "independent", None)
    joints = (-1, -1) if pair is None else joint_indices("independent", pair, 2 * N)
    rows = "PAIR_P1", "PAIR_P2", "PAIR_D1", "PAIR_D2", "HYSTERESIS", "JOINT_J", "JOINT_K"
    values = *gains, getattr(law, "hysteresis", 1.0), *joints
    return code, {}, dict(zip(rows, map(float, values), strict=True))


def _per(name: str, value, size: int) -> np.ndarray:
    value = np.asarray(value, dtype=float)
    fits = f"one number or ({size},)" if name == "limit" else f"one number, ({size},) or ({size}, {size})"
    value = np.diagonal(value) if value.shape == (size, size) else value
    return np.full(size, shaped(name, value, value.shape in ((), (size,)), fits))
