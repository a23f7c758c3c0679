"""Exercises of lesson 09: how far a prestress may go, torques of one sign, and a load carried on geared drives."""

from __future__ import annotations

import numpy as np

from ...mechanics.antagonism import null_basis
from ..checker import Exercise
from . import tasks

EXERCISES = {
    "09.room": Exercise(
        tasks.room,
        hints=(
            "Each drive alone allows an interval of mu. What do several intervals have in common?",
            "Drive i stands at its limits for mu = (-limit_i - c_i) / n_i and mu = (limit_i - c_i) / n_i; which of the "
            "two is the lower one depends on the sign of n_i.",
            "a, b = (-limit - c) / n, (limit - c) / n; np.array([np.minimum(a, b).max(), np.maximum(a, b).min()])",
        ),
        unit="N m",
        cases=tasks.room_cases,
        invariant=tasks.off_the_limits,
        tolerance=1e-9,
        close=0.02,
        improve="compute the ends, c_i + mu n_i = +-limit_i, instead of searching for them",
        mistakes={
            "for a negative n_i the inequality turns around: the sign of n_i decides which end is the lower one": (
                lambda c, n, limit: np.array([tasks.ends(c, n, limit)[0].max(), tasks.ends(c, n, limit)[1].min()])
            ),
            "divided by |n_i|: for a negative n_i the inequality turns around, which its absolute value hides": (
                lambda c, n, limit: np.array([((-limit - c) / np.abs(n)).max(), ((limit - c) / np.abs(n)).min()])
            ),
            "this is where any one drive is within its limit; all have to be: the largest of the lower ends, the "
            "smallest of the upper ones": (
                lambda c, n, limit: np.array([tasks.ends(c, n, limit).min(), tasks.ends(c, n, limit).max()])
            ),
            "sorted ends hide that nothing fits: there low is larger than high": (
                lambda c, n, limit: np.sort(tasks.room(c, n, limit))
            ),
            "the ends stand in the other order: low comes first": lambda c, n, limit: tasks.room(c, n, limit)[::-1],
            "a symmetric room: a drive may also go through zero to its other limit": (
                lambda c, n, limit: np.min((limit - np.abs(c)) / np.abs(n)) * np.array([-1.0, 1.0])
            ),
            "the torques c that the force needs are missing": (
                lambda c, n, limit: np.min(limit / np.abs(n)) * np.array([-1.0, 1.0])
            ),
            "the sign of mu: c + mu n, not c - mu n": lambda c, n, limit: -tasks.room(c, n, limit)[::-1],
            "the limits differ from drive to drive; this takes the smallest for all": (
                lambda c, n, limit: tasks.room(c, n, np.full(len(c), limit.min()))
            ),
            "the limits differ from drive to drive; this takes the first for all": (
                lambda c, n, limit: tasks.room(c, n, np.full(len(c), limit[0]))
            ),
        },
    ),
    "09.one_sign": Exercise(
        tasks.one_sign,
        hints=(
            "The demands are linear in c, and so is the sum. What kind of problem is that?",
            "scipy.optimize.linprog(cost, A_eq=..., b_eq=..., bounds=...) minimizes cost @ c; its bounds are (0, None) "
            "unless you say otherwise.",
            "linprog(np.ones(len(A)), A_eq=A.T, b_eq=f, bounds=(least, None)).x",
        ),
        unit="N m",
        cases=tasks.one_sign_cases,
        invariant=tasks.off_the_force,
        tolerance=1e-7,
        close=0.02,
        improve="a linear programme ends at a corner, where m - 2 drives carry `least` exactly",
        mistakes={
            "this is the choice of least size: some drives push the other way (no prestress)": (
                lambda A, f, least: tasks.smallest(A, f)
            ),
            "clipped from below: the force is no longer f": lambda A, f, least: np.maximum(tasks.smallest(A, f), least),
            "the same amount is added to every drive: the force is no longer f": (
                lambda A, f, least: tasks.smallest(A, f) + least
            ),
            "the absolute values make another force than f (the sign is no free choice)": (
                lambda A, f, least: np.abs(tasks.smallest(A, f))
            ),
            "least is missing: the bounds of linprog are (0, None) by default": (
                lambda A, f, least: tasks.one_sign(A, f, 0.0)
            ),
            "the sign: all drives pull, and all should push": lambda A, f, least: -tasks.one_sign(A, -f, least),
            "the sign of the force: these torques make -f": lambda A, f, least: tasks.one_sign(A, -f, least),
            "the force f is missing: this prestress alone moves nothing": (
                lambda A, f, least: tasks.one_sign(A, 0 * f, least)
            ),
            "the prestress alone reaches least; what the force takes from the drives is missing in it": (
                lambda A, f, least: tasks.smallest(A, f) + least * null_basis(A)[:, 0] / null_basis(A)[:, 0].min()
            ),
        },
    ),
    "09.quiet_gears": Exercise(
        tasks.quiet_gears,
        hints=(
            "Which of your two earlier functions looks at the lower limit, and which at the upper one?",
            "On top of the torques of least size, c + mu n: the smallest mu that lifts every drive to 5 mN m, anew at "
            "every pose, is the cheapest of its sign. A constant one must serve the worst moment all the time.",
            "return one_sign(A, f, 5e-3)",
        ),
        unit="",
        judge=tasks.carried,
        close=0.05,
        improve="let the prestress follow what the force takes from each drive, a little above the least",
        points=10.0,
        mistakes={
            "these torques do not make the force f: A^T c is another one, as after clipping single drives": (
                tasks.another_force
            ),
            "there is no prestress in this choice, so drives change their sign with the force": tasks.without_prestress,
            "the prestress changes its side along the way, and every drive its sign with it; choose one side for the "
            "whole run": tasks.changes_its_side,
            "a constant prestress of this sign: what is enough for the worst moment is too much for limit and heat": (
                tasks.with_a_constant_one
            ),
        },
    ),
}
