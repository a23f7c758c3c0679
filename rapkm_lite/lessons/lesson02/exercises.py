"""Exercises of lesson 02: control matrix, guaranteed force, weighted torques, input singularities of mixed modes."""

from __future__ import annotations

import numpy as np

from ...machine.manipulator import load
from ...mechanics.actuation import prestress_projector, weighted_pseudoinverse
from ...mechanics.kinematics import cross, turn
from ..checker import Exercise
from . import tasks

EXERCISES = {
    "02.control_matrix": Exercise(
        tasks.control_rows,
        hints=(
            "Both ends of a rigid rod have the same speed along the rod. Which two velocities does that compare for "
            "one distal link?",
            "Along d_i the elbow moves with (d_i . a_i^perp) qd_i = (a_i x d_i) qd_i, and the end-effector with "
            "d_i . xd. Solve for qd_i: what multiplies xd is row i.",
            "Row i is d_i divided by the number a_i x d_i: return d / cross(a, d)[:, None].",
        ),
        unit="rad/m",
        cases=tasks.arms,
        invariant=tasks.stretching,
        tolerance=1e-10,
        close=1e-4,
        improve="divide by the cross product itself, without a difference quotient or a small number added",
        mistakes={
            "the lever is missing: the rows are the distal vectors, not yet divided by a x d": lambda a, d: d,
            "the rows are unit vectors: they have the direction of the distal links, but the lever in m is missing": (
                lambda a, d: tasks.unit(d)
            ),
            "the rows point along the proximal links; a drive pushes along its distal link (another direction)": (
                lambda a, d: a / cross(a, d)[:, None]
            ),
            "the rows are turned by a quarter: they stand across the distal links, another frame": (
                lambda a, d: turn(d) / cross(a, d)[:, None]
            ),
            "it is divided by the scalar product a . d; the lever is the cross product a x d": (
                lambda a, d: d / np.sum(a * d, axis=1)[:, None]
            ),
            "it is multiplied by the lever a x d; the rates follow when you divide by it": (
                lambda a, d: d * cross(a, d)[:, None]
            ),
            "the lever of unit vectors is only the sine of the elbow angle: the lengths of the links are missing": (
                lambda a, d: tasks.unit(d) / cross(tasks.unit(a), tasks.unit(d))[:, None]
            ),
            "the lever is taken with a unit distal vector, but the row is not of unit length: a factor, the length of "
            "the distal link, is one too many": lambda a, d: d / cross(a, tasks.unit(d))[:, None],
            "a factor is missing, the length of the distal link: row and lever need the same d": (
                lambda a, d: tasks.unit(d) / cross(a, d)[:, None]
            ),
            "the sign of the lever is lost: no absolute value, an elbow that bends the other way turns the other way": (
                lambda a, d: d / np.abs(cross(a, d))[:, None]
            ),
            "each row is divided by the lever of another arm (order of the levers)": (
                lambda a, d: d / np.roll(cross(a, d), 1)[:, None]
            ),
            "the whole arm a + d stands in the row; only the distal vector belongs there": (
                lambda a, d: (a + d) / cross(a, d)[:, None]
            ),
            "this is the inverse direction, xd from the rates (a pseudoinverse); A gives the rates from xd": (
                lambda a, d: np.linalg.pinv(tasks.control_rows(a, d)).T
            ),
        },
    ),
    "02.guaranteed_force": Exercise(
        tasks.guaranteed_force,
        hints=(
            "The largest disc inside a polygon about zero touches the nearest edge. In which directions do the edges "
            "of the hexagon run?",
            "Each edge is parallel to one row of A, so its distance from zero is b(u) for the unit vector u across "
            "that row. There are as many directions to try as there are drives.",
            "For each row: u = (-row_y, row_x) / |row|, b = torque * np.abs(A @ u).sum(); return the smallest b.",
        ),
        unit="N",
        cases=tasks.control_matrices,
        invariant=tasks.overpromise,
        tolerance=1e-9,
        close=0.02,
        improve="the nearest point lies on an edge: try the direction across each row exactly",
        mistakes={
            "this is the largest distance of an edge (max for min); guaranteed is only the smallest": (
                lambda A, torque: torque * max(tasks.edges(A))
            ),
            "this is the nearest corner of the polygon; the nearest point lies on an edge": tasks.force_without(
                "corner"
            ),
            "this is the farthest corner, the largest force in any direction (max for min)": (
                tasks.force_without("far corner")
            ),
            "this is the smallest singular value: it belongs to torques in a ball, |c| <= torque, and here each drive "
            "has its own limit": lambda A, torque: torque * np.linalg.svd(A, compute_uv=False)[-1],
            "a singular value with a factor, the root of the number of drives: the box of torques is no ball": (
                tasks.force_without("root")
            ),
            "this is the largest singular value; it belongs to a ball of torques, and to the best direction": (
                lambda A, torque: torque * np.linalg.svd(A, compute_uv=False)[0]
            ),
            "this is what the shortest torques, pinv(A.T) @ f, give before one of them is at its limit; other torques "
            "for the same force go further": (
                lambda A, torque: torque / np.linalg.norm(np.linalg.pinv(A.T), axis=1).max()
            ),
            "this is the force of the weakest drive alone, in its own direction": (
                lambda A, torque: torque * np.linalg.norm(A, axis=1).min()
            ),
            "this is the force of all drives along their own directions added: they do not all push the same way": (
                lambda A, torque: torque * np.linalg.norm(A, axis=1).sum()
            ),
            "the absolute value is missing: each drive chooses the sign that helps": tasks.force_without("abs"),
            "the direction across a row is not of unit length: the factor 1 / |A_i| is missing": tasks.force_without(
                "size"
            ),
            "the length of the row is divided out twice (a factor too many)": tasks.force_without("unit"),
            "only the best drive is counted in each direction; all drives add up": tasks.force_without("one"),
            "this looks along the rows; the edges run along them, so look across (another direction)": (
                tasks.force_without("along")
            ),
            "this is the mean over the edges, not the smallest": tasks.force_without("mean"),
            "only the directions x and y are tried": tasks.force_without("axes"),
        },
    ),
    "02.best_torques": Exercise(
        tasks.best_torques,
        hints=(
            "Write c = c0 + s. What must the step s bring at the end-effector, and in which sense should it be small?",
            "The step makes up for the force f - A^T c0 and has the smallest s^T W s. With two multipliers p the "
            "condition is W s = A p.",
            "s = W^-1 A p with (A^T W^-1 A) p = f - A^T c0: two calls of np.linalg.solve, then c0 + s.",
        ),
        unit="N m",
        cases=tasks.choices,
        invariant=tasks.not_the_best,
        tolerance=1e-9,
        close=0.01,
        improve="the conditions are linear: solve them for c and the two multipliers instead of minimizing",
        mistakes={
            "the weights are forgotten: this is the answer for W = I (a factor W is missing)": (
                lambda A, f, W, c0: tasks.best_torques(A, f, np.eye(len(A)), c0)
            ),
            "the weights are inverted: W^-1 stands where W belongs": (
                lambda A, f, W, c0: tasks.best_torques(A, f, np.linalg.inv(W), c0)
            ),
            "the weights are squared": lambda A, f, W, c0: tasks.best_torques(A, f, W @ W, c0),
            "only the diagonal of W is used; the rest of it counts too": (
                lambda A, f, W, c0: tasks.best_torques(A, f, np.diag(np.diag(W)), c0)
            ),
            "the wish c0 is forgotten: this is the answer for c0 = 0 (a term is missing)": (
                lambda A, f, W, c0: tasks.best_torques(A, f, W, 0 * c0)
            ),
            "weights and wish are both forgotten: this is pinv(A.T) @ f": lambda A, f, W, c0: np.linalg.pinv(A.T) @ f,
            "the whole wish is added, and a part of it changes the force: the projector is missing": (
                lambda A, f, W, c0: weighted_pseudoinverse(A, W) @ f + c0
            ),
            "the whole wish is added, which changes the force (the projector is missing), and without weights": (
                lambda A, f, W, c0: weighted_pseudoinverse(A) @ f + c0
            ),
            "the sign of the wish c0 is opposite": lambda A, f, W, c0: tasks.best_torques(A, f, W, -c0),
            "the sign of the force f is opposite": lambda A, f, W, c0: tasks.best_torques(A, -f, W, c0),
            "the wish is projected without the weights (the projector of W = I)": (
                lambda A, f, W, c0: weighted_pseudoinverse(A, W) @ f + prestress_projector(A) @ c0
            ),
            "the force is distributed without the weights, only the wish has them": (
                lambda A, f, W, c0: weighted_pseudoinverse(A) @ f + prestress_projector(A, W) @ c0
            ),
            "this is the step from c0 only; add the wish": lambda A, f, W, c0: tasks.best_torques(A, f, W, c0) - c0,
            "this is the prestress only; the part that makes the force is missing": (
                lambda A, f, W, c0: prestress_projector(A, W) @ c0
            ),
            "the projector is transposed": (
                lambda A, f, W, c0: weighted_pseudoinverse(A, W) @ f + prestress_projector(A, W).T @ c0
            ),
            "the wish is not multiplied by the weights: the slope of the price is W (c - c0) (a factor W is missing)": (
                lambda A, f, W, c0: tasks.best_torques(A, f, W, np.linalg.solve(W, c0))
            ),
            "the price of c instead of c - c0 is smallest: the wish is weighted, not projected": (
                lambda A, f, W, c0: tasks.best_torques(A, f, W, 0 * c0) + np.linalg.solve(W, c0)
            ),
        },
    ),
    "02.input_singularity": Exercise(
        tasks.input_singularity,
        hints=(
            "All three distal links are parallel there. How many equations is that, and for how many unknowns?",
            "Two of the cross products that rk.distal_cross_products gives must vanish together, as functions of the "
            "two coordinates. A root finder wants a start: the darkest node of the map is close.",
            "root(lambda p: rk.distal_cross_products(robot, rk.inverse_kinematics(robot, p, mode))[:2], start).x with "
            "root from scipy.optimize.",
        ),
        unit="m",
        cases=tasks.mixed_modes,
        invariant=tasks.spread,
        tolerance=1e-6,
        close=0.15,
        improve="a grid or a minimizer comes only near: let a root finder make both cross products zero from there",
        mistakes={
            "this is the other common point of the curves, a base joint: there the arm is folded, a corner of the "
            "workspace and not inside": lambda mode: load().base[tasks.odd(mode)],
            "this is the midpoint of another side of the base triangle, between the arm that bends the other way and "
            "the first of the two that bend alike (order of the arms)": (
                lambda mode: load().base[[tasks.odd(mode), tasks.equal(mode)[0]]].mean(axis=0)
            ),
            "this is the midpoint of another side of the base triangle, between the arm that bends the other way and "
            "the second of the two that bend alike (order of the arms)": (
                lambda mode: load().base[[tasks.odd(mode), tasks.equal(mode)[1]]].mean(axis=0)
            ),
            "the points are turned by 120 degrees: the arms are counted on by one (order), or it is another frame": (
                lambda mode: tasks.input_singularity(np.roll(mode, 1))
            ),
            "the points are turned by -120 degrees: the arms are counted back by one (order), or it is another frame": (
                lambda mode: tasks.input_singularity(np.roll(mode, -1))
            ),
            "this is the sum of the two base points, not the point midway (a factor of 2)": (
                lambda mode: 2 * tasks.input_singularity(mode)
            ),
            "this is a base joint of the two arms that bend alike, not the middle between them": (
                lambda mode: load().base[tasks.equal(mode)[0]]
            ),
            "this point lies on the opposite side of the centroid (sign)": lambda mode: -tasks.input_singularity(mode),
        },
    ),
}
