"""Exercises of lesson 12: a fight from J alone, the projector in other units, and a machine of one's own."""

from __future__ import annotations

import numpy as np

from ...mechanics.matrices import projector
from ..checker import Exercise
from . import tasks

EXERCISES = {
    "12.fight": Exercise(
        tasks.fight,
        hints=(
            "Offsets pull each drive by -K_P times its own. Which part of these torques moves nothing, and which "
            "matrix says so?",
            "A_tilde = rk.projector(J)[:m]; torques with A_tilde.T @ c = 0 move nothing. R of (15) is (A~^T)^+ A~^T; "
            "the degree of freedom is n - r. (The default cut-off of pinv may take rounding for rank.)",
            "R = rk.explicit_pseudoinverse(A_tilde, rk.select_independent(A_tilde, delta=J.shape[1] - J.shape[0])) "
            "@ A_tilde.T; -K_P * (np.eye(m) - R) @ offset",
        ),
        unit="N m",
        cases=tasks.fight_cases,
        invariant=tasks.moves,
        tolerance=1e-9,
        close=1e-3,
        improve="project exactly; a cut-off of 1e-9 for pinv will do",
        partly="at some poses of a machine it is right and at others not, as when rounding decides a rank: the default "
        "cut-off of pinv does not know it; one of 1e-9 does, and so does (27)",
        mistakes={
            "the sign: a drive is pulled back by its offset": lambda J, m, K_P, offset: -tasks.fight(J, m, K_P, offset),
            "nothing is projected: part of these torques moves the machine": (
                lambda J, m, K_P, offset: -K_P * np.asarray(offset)
            ),
            "this is the part that moves; its complement is left at rest": (
                lambda J, m, K_P, offset: -K_P * tasks.range_projector(J, m) @ offset
            ),
            "the gain K_P is missing": lambda J, m, K_P, offset: tasks.fight(J, m, 1.0, offset),
            "N_J itself is no filter of torques: only A~^T c = 0 says that c moves nothing": (
                lambda J, m, K_P, offset: -K_P * (np.eye(m) - projector(J)[:m, :m]) @ offset
            ),
            "the driven block of N_J lets part of the motion through; take the null space of A~^T": (
                lambda J, m, K_P, offset: -K_P * projector(J)[:m, :m] @ offset
            ),
        },
    ),
    "12.other_units": Exercise(
        tasks.in_units,
        hints=(
            "The colleague's rates are qd' = scale qd. What is the colleague's Jacobian, if J' qd' = J qd?",
            "J' = J S^-1, N' = rk.projector(J'); a rate of yours goes to the colleague (S), through N', and back.",
            "S = np.diag(scale); np.linalg.inv(S) @ rk.projector(J @ np.linalg.inv(S)) @ S",
        ),
        unit="(without unit)",
        cases=tasks.unit_cases,
        invariant=tasks.no_projector,
        tolerance=1e-9,
        close=1e-4,
        improve="scale exactly",
        mistakes={
            "these are your own units: scale is missing": lambda J, scale: projector(J),
            "the result is still in the colleague's units; it has to come back": lambda J, scale: projector(J / scale),
            "J' = J S^-1, not J S: rates grow by scale, so the columns of J shrink": (
                lambda J, scale: tasks.in_units(J, 1 / scale)
            ),
            "J' = J S^-1, not J S, and the result has to come back": lambda J, scale: projector(J * scale),
            "there and back in the wrong order: S first, then N', then S^-1": (
                lambda J, scale: projector(J / scale) / scale * scale[:, None]
            ),
            "J was not changed with the rates: J' = J S^-1": (lambda J, scale: projector(J) * scale / scale[:, None]),
            "only the columns are scaled; S^-1 on the left is missing": lambda J, scale: projector(J / scale) * scale,
            "S is missing on the right": lambda J, scale: projector(J / scale) / scale[:, None],
        },
    ),
    "12.own_machine": Exercise(
        tasks.own_machine,
        hints=(
            "The offsets cost K_P times their part along the null vector. What in a machine decides the signs of that "
            "vector?",
            "The working mode: one arm bent the other way mostly turns one sign, not always that of its own drive. Try "
            "all three: one leaves little of (4, -2, 5), another doubles the cost. On the testbed such a mode is "
            "singular at the middle of one base side (lesson 02), with a wider base nowhere.",
            "mode=[1, 1, -1], base points 0.28 to 0.3 m from the origin, distal links longer than proximal ones: "
            "lengths=[0.18, 0.26].",
        ),
        unit="",
        judge=tasks.behaviour,
        close=0.05,
        improve="move the base points a little",
        points=10.0,
        mistakes={
            "the lengths are in mm; the unit is m": lambda answer: bool(tasks.equipped(answer).lengths.min() > 10.0),
            "all elbows are bent to one side, so the signs of the null vector are those of the testbed: 4 - 2 + 5": (
                tasks.costly_and_bent_alike
            ),
        },
    ),
}
