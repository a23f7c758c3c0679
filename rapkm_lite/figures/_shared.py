"""What pictures of several lessons share, and nobody else calls: frames, and looks that can be told apart."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..machine.manipulator import load
from ..mechanics.maps import sampling_box


def scaled_frame(robot, left: float, right: float, low: float, high: float) -> dict:
    """Keywords of ``Axes.set``: limits in m that frame the testbed, for a machine of another place and size.

    >>> import rapkm_lite as rk; testbed = rk.load()
    >>> scaled_frame(testbed.replace(base=3 * testbed.base, lengths=0.6), -0.21, 0.21, -0.19, 0.25)["xlim"]
    (-0.63, 0.63)
    """
    testbed, own = (np.reshape(sampling_box(machine), (2, 2)) for machine in (load(), robot))
    times = np.ptp(own, axis=1).max() / np.ptp(testbed, axis=1).max()
    corners = own.mean(axis=1) + times * (np.array([[left, low], [right, high]]) - testbed.mean(axis=1))
    x, y = corners.round(12).T.tolist()
    return {"xlim": tuple(x), "ylim": tuple(y)}


def with_looks(name: str, entries: dict, looks) -> Iterator[tuple]:
    """((label, value), look) for each entry; ValueError where there is none, or more than looks to tell them apart.

    >>> list(with_looks("runs", {"PD": 1.0}, ("-", "--")))
    [(('PD', 1.0), '-')]
    """
    if not 0 < len(entries) <= len(looks):
        raise ValueError(f"{name} has {len(entries)} entries; allowed: 1 to {len(looks)}, which can be told apart")
    return zip(entries.items(), looks, strict=False)
