"""What pictures of several lessons share, and nobody else calls: frames, axes, and looks that can be told apart."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes

from ..machine.manipulator import load
from ..machine.reach import shared_rims

# Angles in mrad, and places in mm on a machine of 1 m, that differ by less are rounding.
LEAST = 1e-6


def workspace_box(robot) -> np.ndarray:
    """The smallest box [[x_min, x_max], [y_min, y_max]] in m, (2, 2), around the points that all arms reach.

    Its sides touch the rims of reach where these are farthest out, or where two of them cross.

    >>> import rapkm_lite as rk
    >>> workspace_box(rk.load()).round(3).tolist()
    [[-0.2, 0.2], [-0.169, 0.231]]
    """
    there = shared_rims(robot.base, robot.lengths, 1e-9)
    return np.stack([there.min(axis=0), there.max(axis=0)], axis=-1)


def scaled_frame(robot, left: float, right: float, low: float, high: float, *, drives: bool = False) -> dict:
    """Keywords of ``Axes.set``: limits in m that frame the testbed's workspace, for that of another machine.

    drives : as much more as it takes to hold the base points, which may be far outside a small workspace.

    >>> import rapkm_lite as rk; testbed = rk.load()
    >>> scaled_frame(testbed.replace(base=3 * testbed.base, lengths=0.6), -0.21, 0.21, -0.19, 0.25)["xlim"]
    (-0.63, 0.63)
    """
    testbed, own = workspace_box(load()), workspace_box(robot)
    times = np.ptp(own, axis=1).max() / np.ptp(testbed, axis=1).max()
    corners = own.mean(axis=1) + times * (np.array([[left, low], [right, high]]) - testbed.mean(axis=1))
    if drives:
        room = 0.25 * robot.lengths.max()
        corners[0] = np.minimum(corners[0], robot.base.min(axis=0) - room)
        corners[1] = np.maximum(corners[1], robot.base.max(axis=0) + room)
    x, y = corners.round(12).T.tolist()
    return {"xlim": tuple(x), "ylim": tuple(y)}


def least_torque(robot) -> float:
    """The torque in N m that gives the heaviest arm 1e-6 rad/s^2: less is rounding, for gains that 1 kHz can have.

    >>> import rapkm_lite as rk
    >>> f"{least_torque(rk.load()):.1e} N m"
    '7.2e-09 N m'
    """
    return 1e-6 * float(robot.arm_inertias.max())


def no_finer(ax: Axes, least: float) -> None:
    """Show what varies by less than 2 `least`, in the unit of the vertical axis, or by 1e-6 of itself, as a flat line.

    Without, rounding fills the axis like a signal.

    >>> from matplotlib.figure import Figure; ax = Figure().add_subplot()
    >>> line = ax.plot([0.0, 1.0, 2.0], [1e-16, -3e-16, 2e-16])
    >>> no_finer(ax, 1e-6); ax.dataLim.intervaly.tolist()
    [-1e-06, 1e-06]
    """
    low, high = ax.dataLim.intervaly
    size = max(abs(low), abs(high))
    if np.isfinite(size) and high - low < max(2 * least, 1e-6 * size):
        middle, room = (low + high) / 2 if size > least else 0.0, max(least, 0.05 * size)
        ax.update_datalim([(0.0, middle - room), (0.0, middle + room)], updatex=False)
        ax.autoscale_view(scalex=False)


def step_of(run, most: int) -> int:
    """Every how many samples of a run are drawn: `most`, or fewer where this would leave less than 40.

    >>> import rapkm_lite as rk; path = rk.circle(rk.load(), 0.05, 0.5)
    >>> step_of(rk.simulate(path.robot, rk.PD(7.05, 0.225), path), 20)
    12
    """
    return min(most, max(1, len(run) // 40))


def with_looks(name: str, entries: dict, looks) -> Iterator[tuple]:
    """((label, value), look) for each entry; ValueError where there is none, or more than looks to tell them apart.

    >>> list(with_looks("runs", {"PD": 1.0}, ("-", "--")))
    [(('PD', 1.0), '-')]
    """
    if not 0 < len(entries) <= len(looks):
        raise ValueError(f"{name} has {len(entries)} entries; allowed: 1 to {len(looks)}, which can be told apart")
    return zip(entries.items(), looks, strict=False)
