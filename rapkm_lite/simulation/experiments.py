"""Experiments: machine, law, path, sensors and faults that belong together, from data files; the chapter's Table 1."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..control.laws import PD, AntagonismFilter
from ..machine.datafiles import UNITS_OF, data_path, known, read_toml
from ..machine.manipulator import Manipulator, load
from ..machine.values import Value, frozen
from ..mechanics.trajectory import Trajectory, triangle
from .faults import Fault, read_fault
from .runs import Run, simulate
from .sensors import Sensors
from .setup import prepare


@dataclass(frozen=True, eq=False, repr=False)
class Experiment(Value):
    """A machine, a law, a path, sensors and faults that belong together, as read from a data file.

    Raises ValueError for gains, offsets or faults of another number of drives, and a path out of the robot's reach.

    >>> import rapkm_lite as rk
    >>> rk.experiment("testbed").law
    PD(K_P=7.05, K_D=0.225)
    """

    robot: Manipulator
    law: PD
    trajectory: Trajectory
    sensors: Sensors
    faults: tuple[Fault, ...] = ()

    def __post_init__(self):
        # What a run would refuse is refused here.
        super().__post_init__(faults=prepare(self.robot, self.trajectory, self.sensors, faults=self.faults).broken)
        self.law.gains(self.robot.n_arms)

    @property
    def offset(self) -> np.ndarray:
        """Calibration offsets in rad, (N,) or one number, as `sensors` holds them."""
        return self.sensors.offset

    @property
    def encoder(self) -> float | None:
        """Counts per turn; None for ideal angles."""
        return self.sensors.encoder

    def run(self, law=None) -> Run:
        """Simulate it, by default with its own law."""
        law = self.law if law is None else law
        return simulate(self.robot, law, self.trajectory, sensors=self.sensors, faults=self.faults)


def experiment(source="testbed") -> Experiment:
    """What a data file holds in its tables [manipulator], [control], [path] and [sensor], and in its [[fault]] tables.

    [sensor] holds the arguments of `Sensors`; each [[fault]] holds the `kind` of a fault and its arguments, such as
    ``kind = "DeadDrive"``, ``drive = 1``, ``time = 0.5``.
    source : see `load`.  Raises ValueError for an unknown or missing table, key or kind, a value out of
    range, and a path that leaves the workspace.

    >>> import rapkm_lite as rk
    >>> rk.experiment("table1_reading").offset.shape
    (3,)
    """
    robot, tables = load(source), read_toml(source)
    for table in ("control", "path", "sensor"):
        known(f"TOML key in [{table}]", tables.get(table, ()), UNITS_OF[table])
        if table != "sensor" and table not in tables:
            raise ValueError(f"the file {str(source)!r} lacks the table [{table}]; needed: [control] and [path]")
    control = tables["control"]
    for key in ("K_P", "K_D"):
        if key not in control:
            raise ValueError(f"the table [control] of {str(source)!r} lacks {key!r}; needed: K_P, K_D")
    law = PD(control["K_P"], control["K_D"])
    path = triangle(robot, dt=control.get("dt", 1e-3), **tables["path"])
    sensors = Sensors(**tables.get("sensor", {})).of_drives(robot.n_arms)
    faults = tuple(map(read_fault, tables.get("fault", [])))
    return Experiment(robot, law, path, sensors, faults)


@dataclass(frozen=True, eq=False, repr=False)
class Table1(Value):
    """Electric energies in J, rows without / with filter, columns drives 1 to 3: `measured` and `simulated` (2, 3)."""

    measured: np.ndarray
    simulated: np.ndarray

    @property
    def deviation(self) -> np.ndarray:
        """(simulated - measured) / measured, (2, 3)."""
        return frozen((self.simulated - self.measured) / self.measured)


def measured_energies() -> np.ndarray:
    """The chapter's Table 1, (2, 3) in J: rows without / with filter, columns drives 1 to 3.

    >>> import rapkm_lite as rk
    >>> rk.measured_energies().sum(axis=1).round(2)
    array([4.56, 2.24])
    """
    return np.loadtxt(data_path("table1.csv"), delimiter=",", skiprows=2, usecols=(1, 2, 3))


def table1() -> Table1:
    """Table 1 as measured, and as simulated by the one consistent reading in ``data/table1_reading.toml``.

    The filter works at the true pose.  The chapter leaves offsets, path placement and gains open; the reading is a
    plausible explanation, one of many.

    >>> import rapkm_lite as rk
    >>> bool(abs(rk.table1().deviation).max() < 0.05)
    True
    """
    reading = experiment("table1_reading")
    runs = [reading.run(), reading.run(AntagonismFilter(reading.law, pose="true"))]
    return Table1(measured_energies(), np.stack([run.energy for run in runs]))
