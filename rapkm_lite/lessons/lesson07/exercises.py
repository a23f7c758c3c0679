"""Exercises of lesson 07: how much angles contradict each other, late drives, and via points where they are needed."""

from __future__ import annotations

import numpy as np

from ...mechanics.actuation import prestress_projector
from ...mechanics.kinematics import inverse_kinematics
from ..checker import Exercise
from . import tasks

EXERCISES = {
    "07.contradiction": Exercise(
        tasks.contradiction,
        hints=(
            "Which angles would the drives have if they all agreed, and as close to the commanded ones as can be?",
            "rk.estimate_pose(robot, q_a, guess) gives that pose; the first N of its angles are those of the drives.",
            "np.linalg.norm(q_a - rk.estimate_pose(robot, q_a, guess)[:, :robot.n_arms], axis=1)",
        ),
        unit="rad",
        cases=tasks.contradiction_cases,
        invariant=tasks.off_the_normal,
        tolerance=1e-9,
        close=0.02,
        improve="take the pose that fits the angles best at each row, not the guess or a first-order step from it",
        mistakes={
            "the root is missing: this is the sum of the squares": (
                lambda robot, q_a, guess: np.sum(tasks.left_over(robot, q_a, guess) ** 2, axis=-1)
            ),
            "this is the largest entry, not the size (norm) of what is left": (
                lambda robot, q_a, guess: np.abs(tasks.left_over(robot, q_a, guess)).max(axis=-1)
            ),
            "the entries or their absolute values are added; the size is the root of the sum of squares": (
                lambda robot, q_a, guess: np.abs(tasks.left_over(robot, q_a, guess)).sum(axis=-1)
            ),
            "the entries or their absolute values are averaged; the size is the root of the sum of squares": (
                lambda robot, q_a, guess: np.abs(tasks.left_over(robot, q_a, guess)).mean(axis=-1)
            ),
            "this is the root mean square; the factor of the number of drives is missing": (
                lambda robot, q_a, guess: np.sqrt(np.mean(tasks.left_over(robot, q_a, guess) ** 2, axis=-1))
            ),
            "this is what is left of each drive; its size is wanted, one number a row (norm over the drives)": (
                tasks.left_over
            ),
            "the pose of the guess is taken away instead of the one that fits best": (
                lambda robot, q_a, guess: np.linalg.norm(
                    q_a - inverse_kinematics(robot, guess)[:, : robot.n_arms], axis=-1
                )
            ),
            "this is the part along (1, 1, 1), the null vector at the centroid; it turns with the pose": (
                lambda robot, *angles: np.abs(np.sum(tasks.left_over(robot, *angles), axis=-1)) / robot.n_arms**0.5
            ),
            "this is the part along the null space at the guess, which turns on the way to the pose that fits best": (
                tasks.seen_from_the_guess
            ),
            "one number for all rows: the norm goes over the drives only (axis=1)": (
                lambda robot, q_a, guess: np.full(len(q_a), np.linalg.norm(tasks.left_over(robot, q_a, guess)))
            ),
        },
    ),
    "07.delay_torque": Exercise(
        tasks.delay_torque,
        hints=(
            "A set-point that comes late is an offset of its own size. How large is it for a drive that turns?",
            "The angle is off by (A xd)_i delay_i, the drive pulls back with K_P times that, and only the part along "
            "the null space of A^T stays.",
            "-K_P * rk.prestress_projector(A) @ ((A @ xd) * delay)",
        ),
        unit="N m",
        cases=tasks.delay_cases,
        invariant=tasks.pushes,
        tolerance=1e-12,
        close=1e-3,
        improve="project exactly, with rk.prestress_projector or I - A A^+",
        mistakes={
            "the sign: a late set-point lies behind the drive, which is pulled back": (
                lambda A, xd, delay, K_P: -tasks.delay_torque(A, xd, delay, K_P)
            ),
            "nothing is projected: part of these torques moves the end-effector": (
                lambda A, xd, delay, K_P: -K_P * (A @ xd) * delay
            ),
            "the filter is used instead of its complement: this is the part that moves": (
                lambda A, xd, delay, K_P: -K_P * (A @ xd) * delay - tasks.delay_torque(A, xd, delay, K_P)
            ),
            "the gain K_P is missing": lambda A, xd, delay, K_P: tasks.delay_torque(A, xd, delay, 1.0),
            "the rates A xd are missing: a delay in s is no angle": (
                lambda A, xd, delay, K_P: -K_P * prestress_projector(A) @ delay
            ),
            "this is zero but for rounding: rates contradict nothing, alone or with equal (averaged) delays; project "
            "the products of each rate with its own delay": (
                lambda A, xd, delay, K_P: tasks.delay_torque(A, xd, np.full(len(A), delay.mean()), K_P)
            ),
            "1000 times too large (units): delays come in s, torques are in N m": (
                lambda A, xd, delay, K_P: tasks.delay_torque(A, xd, 1e3 * delay, K_P)
            ),
        },
    ),
    "07.via_points": Exercise(
        tasks.via_points,
        hints=(
            "Does every part of the edge need via points as badly as every other? The figure above says.",
            "A leg of length h contradicts by about h^2/8 |eta^T q_a''|. Choose the legs so that this is the same for "
            "all: h as 1/sqrt(demand).",
            "way = np.cumsum(np.sqrt(demand)); np.interp(np.linspace(way[0], way[-1], 11)[1:-1], way, part)",
        ),
        unit="",
        judge=tasks.quarrel,
        close=0.07,
        improve="shift a point from a quiet leg into the loudest one",
        points=10.0,
        mistakes={
            "these are equal distances, which waste points where the edge is quiet": (
                lambda answer: 0 < len(shares := tasks.chosen(answer)) and np.ptp(np.diff([0, *shares, 1])) < 5e-3
            ),
            "the density should grow with the square root of the demand, not with the demand itself": (
                lambda answer: tasks.as_dense_as_the_demand(tasks.chosen(answer))
            ),
        },
    ),
}
