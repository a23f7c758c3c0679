"""Exercises of lesson 10: the fight of a wrong geometry, what it leaves of the torques, a law that can lose a drive."""

from __future__ import annotations

import numpy as np

from ...control.laws import PD
from ...mechanics.antagonism import antagonism_filter
from ...mechanics.kinematics import inverse_kinematics
from ..checker import Exercise
from . import tasks

EXERCISES = {
    "10.geometry_fight": Exercise(
        tasks.geometry_fight,
        hints=(
            "Two machines take part: one demands angles, the other one has to live with them. Which is which?",
            "The model demands rk.inverse_kinematics(model, x)[:N]. Drives with equal gains come to rest at the pose "
            "of the machine that fits these angles best, rk.estimate_pose(robot, ..., x).",
            "wanted = rk.inverse_kinematics(model, x)[:N]; "
            "return K_P * (wanted - rk.estimate_pose(robot, wanted, x)[:N])",
        ),
        unit="N m",
        cases=tasks.wrong_models,
        invariant=tasks.pushes,
        tolerance=1e-8,
        close=0.1,
        improve="give a simulated machine more time to come to rest; in a formula take the pose that fits best, "
        "rk.estimate_pose, instead of a first-order step from x",
        mistakes={
            "the sign is turned, as if robot and model changed places: the model demands, the machine closes loops": (
                lambda robot, model, x, K_P: tasks.geometry_fight(model, robot, x, K_P)
            ),
            "nothing is projected: this is the difference of the angles at x, part of which only shifts the machine": (
                lambda robot, model, x, K_P: K_P * (tasks.demanded(model, x) - tasks.demanded(robot, x))
            ),
            "this is the complement, the part that shifts the machine; the fight is what is left of it": (
                lambda robot, model, x, K_P: tasks.first_order(robot, model, x, K_P, antagonism_filter)
            ),
            "the gain K_P is missing: these are angles": (
                lambda robot, model, x, K_P: tasks.geometry_fight(robot, model, x, 1.0)
            ),
            "this is the size of the fight; one torque for each drive is wanted": (
                lambda robot, model, x, K_P: np.linalg.norm(tasks.geometry_fight(robot, model, x, K_P))
            ),
            "these are the angles that the model demands, times the gain; the pose of the machine is missing": (
                lambda robot, model, x, K_P: K_P * inverse_kinematics(model, x)[: model.n_arms]
            ),
        },
    ),
    "10.force_left": Exercise(
        tasks.force_left,
        hints=(
            "A drive has the limit, carries its share of the fight, and may use the rest. What does a force of 1 N "
            "ask of it?",
            "PD drives with equal gains share a force f as A (A^T A)^-1 f. For drive i the worst direction lies along "
            "row i of that matrix, and there it needs the length of the row for every newton.",
            "share = np.linalg.norm(A @ np.linalg.inv(A.T @ A), axis=1); "
            "return np.min((limit - np.abs(fight)) / share)",
        ),
        unit="N",
        cases=tasks.fights,
        invariant=tasks.touches,
        tolerance=1e-8,
        close=0.01,
        improve="the worst direction of each drive is known: it lies along its row of A (A^T A)^-1",
        mistakes={
            "the fight is left out: this is the force of drives at peace": (
                lambda A, fight, limit: float(np.min(limit / tasks.shares(A)))
            ),
            "this is the strongest drive (max for min); the weakest one decides what is left in every direction": (
                lambda A, fight, limit: float(np.max((limit - np.abs(fight)) / tasks.shares(A)))
            ),
            "the absolute value is missing: a force comes with either sign, so does its torque": (
                lambda A, fight, limit: float(np.min((limit - fight) / tasks.shares(A)))
            ),
            "the sign: the fight takes from the limit, it adds nothing": (
                lambda A, fight, limit: float(np.min((limit + np.abs(fight)) / tasks.shares(A)))
            ),
            "the size (norm) of the fight is taken from every drive; each carries its own entry only": (
                lambda A, fight, limit: float(np.min((limit - np.linalg.norm(fight)) / tasks.shares(A)))
            ),
            "the rows of A are used (inverse missing): A maps velocities, A (A^T A)^-1 maps forces to torques": (
                lambda A, fight, limit: float(np.min((limit - np.abs(fight)) / np.linalg.norm(A, axis=1)))
            ),
            "the rows of A multiply instead of dividing by the torque per newton: this drive works alone": (
                lambda A, fight, limit: float(np.min((limit - np.abs(fight)) * np.linalg.norm(A, axis=1)))
            ),
            "the largest fight is set beside the largest share, though they may belong to two drives": (
                lambda A, fight, limit: float((limit - np.abs(fight).max()) / tasks.shares(A).max())
            ),
            "only forces along x and y are tried; the worst direction lies between": (
                lambda A, fight, limit: float(
                    np.min((limit - np.abs(fight)) / np.abs(A @ np.linalg.inv(A.T @ A)).max(axis=1))
                )
            ),
            "the smallest singular value bounds the size of all torques together; each drive has its own limit": (
                lambda A, fight, limit: float(np.min(limit - np.abs(fight)) * np.linalg.svd(A, compute_uv=False)[-1])
            ),
            "this is one force for each drive; the smallest is left in every direction": (
                lambda A, fight, limit: (limit - np.abs(fight)) / tasks.shares(A)
            ),
        },
    ),
    "10.spare_law": Exercise(
        tasks.spare_law,
        hints=(
            "What does each of the three limits ask of the gain, and on what is the energy spent?",
            "Most of the energy is the fight, and a filter takes it away. Then raise the gain until every dead drive "
            "costs less than 5 mm, and stop before the steps K_P times one count shake the machine at rest.",
            "return rk.AntagonismFilter(rk.PD(K_P, K_D)) with K_P near 19 N m/rad, and half as much damping "
            "again as 0.225 * np.sqrt(K_P / 7.05)",
        ),
        unit="",
        judge=tasks.survives,
        close=0.05,
        improve="move the gain a little, towards the limit that has room",
        points=10.0,
        mistakes={
            "bare PD drives: with links that are too long they fight, and a stiff gain is dear": (
                lambda answer: isinstance(answer(tasks.machine()[1]), PD)
            ),
            "the gain is that of the other lessons; three drives may be stiff enough with it, two are not": (
                lambda answer: tasks.gains_of_the_lessons(answer(tasks.machine()[1]))
            ),
        },
    ),
}
