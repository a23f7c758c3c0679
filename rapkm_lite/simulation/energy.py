"""Electric energy per drive and the chapter's Table 1."""

from __future__ import annotations

import csv
from dataclasses import dataclass

import numpy as np

from ..control.laws import AntagonismFilter
from ..machine.arguments import matvec, positive_number, real_array
from ..machine.datafiles import data_path
from ..machine.manipulator import Manipulator
from ..mechanics.actuation import control_matrix, prestress_projector
from ..mechanics.antagonism import steady_state_torque
from ..mechanics.trajectory import Trajectory
from .runs import Run, experiment


def copper_loss(robot, c, dt) -> np.ndarray:
    """Joule heat R (c / k_t)^2 dt of torques c (..., k, N) in N m, each held for dt in s: (..., N) in J per drive."""
    c = real_array("c", c, robot.n_arms)
    if c.ndim < 2:
        raise ValueError(f"c has shape {c.shape}; allowed: (..., k, {robot.n_arms}), one row per hold")
    return positive_number("dt", dt) * np.sum(robot.resistance * (c / robot.torque_constant) ** 2, axis=-2)


def mechanical_work(run: Run) -> np.ndarray:
    """Work of the drives on the mechanism (N,) in J.

    Without friction it sums to zero over the drives on a closed path from rest to rest.
    """
    return np.sum(run.c[:-1] * np.diff(run.q_a, axis=0), axis=0)


def antagonistic_torque(run: Run) -> np.ndarray:
    """The part N_{A^T} c of the torques (k, N) in N m that moves nothing, at the true pose."""
    return matvec(prestress_projector(control_matrix(run.robot, run.q)), run.c)


def antagonistic_energy(run: Run) -> float:
    """(R / k_t^2) times the integral of ||c_null||^2, J: what a true-pose filter removes, for identical drives."""
    return float(copper_loss(run.robot, antagonistic_torque(run)[:-1], run.dt).sum())


def antagonism_form(robot: Manipulator, trajectory: Trajectory, K_P) -> np.ndarray:
    """Symmetric S (N, N) in J/rad^2: offsets dq (N,) in rad cost about dq^T S dq of antagonistic energy along the path.

    S = integral of P^T (R / k_t^2) P dt, where P dq are the torques at rest of the corrected (14) at each point of the
    path: quasi-static, to first order in the offsets, without friction.
    """
    A = control_matrix(robot, trajectory.q)
    P = np.stack([steady_state_torque(A, K_P, unit) for unit in np.eye(robot.n_arms)], axis=-1)
    weight = robot.resistance / robot.torque_constant**2
    return np.einsum("kij,i,kil->jl", P[:-1], weight, P[:-1]) * trajectory.dt


@dataclass(frozen=True, eq=False)
class Table1:
    """Electric energies in J, rows without / with filter, columns drives 1 to 3: `measured` and `simulated` (2, 3)."""

    measured: np.ndarray
    simulated: np.ndarray

    @property
    def deviation(self) -> np.ndarray:
        """(simulated - measured) / measured, (2, 3)."""
        return (self.simulated - self.measured) / self.measured


def measured_energies() -> np.ndarray:
    """The chapter's Table 1, (2, 3) in J: rows without / with filter, columns drives 1 to 3."""
    with data_path("table1.csv").open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.reader(file) if row and not row[0].startswith("#")]
    return np.array([[float(v) for v in row[1:]] for row in rows[1:]])


def table1() -> Table1:
    """Table 1 as measured, and as simulated by the one consistent reading in ``data/table1_reading.toml``.

    The chapter leaves offsets, path placement and gains open; the reading is a plausible explanation, one of many.
    """
    reading = experiment("table1_reading")
    runs = [reading.run(), reading.run(AntagonismFilter(reading.law, pose="true"))]
    return Table1(measured_energies(), np.stack([run.energy for run in runs]))
