"""Where arms reach: rings around their base points, and the points where these meet."""

from __future__ import annotations

import numpy as np


def within(reach: np.ndarray, lengths: np.ndarray, slack=0.0) -> np.ndarray:
    """True (...,) where all arms of link lengths (N, 2) in m reach a point at the distances (..., N) in m from their
    base points; slack in m, one number or (N,), widens their rings, or narrows them where it is negative.

    >>> within(np.array([[0.3, 0.1], [0.3, 0.6]]), np.array([[0.2, 0.2], [0.3, 0.2]]))
    array([ True, False])
    """
    l1, l2 = lengths.T
    return np.all((reach <= l1 + l2 + slack) & (reach >= np.abs(l1 - l2) - slack), axis=-1)


def shared_rims(base: np.ndarray, lengths: np.ndarray, slack: float) -> np.ndarray:
    """Points (k, 2) in m on the rims of the rings that all arms reach, to `slack` times the longest arm.

    Crossings of two rims, and the four outermost points of each one: arms that can meet share one of these at least,
    and the workspace goes as far to each side as they do.

    >>> shared_rims(np.array([[-0.3, 0.0], [0.3, 0.0]]), np.full((2, 2), 0.25), 1e-12).max(axis=0).round(3)
    array([0.2, 0.4])
    """
    centres, radii = np.tile(base, (2, 1)), np.concatenate([np.abs(lengths[:, 0] - lengths[:, 1]), lengths.sum(axis=1)])
    i, j = np.tril_indices(len(radii), -1)
    ends = [centres + radii[:, None] * way for way in ([1, 0], [-1, 0], [0, 1], [0, -1])]
    points = np.concatenate([*ends, crossings(centres[i], centres[j], radii[i], radii[j])])
    reach = np.linalg.norm(points[:, None] - base, axis=-1)
    return points[within(reach, lengths, slack * radii.max())]


def crossings(a: np.ndarray, b: np.ndarray, r_a: np.ndarray, r_b: np.ndarray) -> np.ndarray:
    """Where circles about a and b (k, ..., 2) of radii r (k,) cross: (2 k, ..., 2), first those left of b - a.

    Circles that do not meet give the point of their line of centres on the radical axis; touching ones touch there.
    """
    r_a, r_b = (r.reshape(-1, *[1] * (a.ndim - 1)) for r in (r_a, r_b))
    gap = b - a
    distance = np.maximum(np.linalg.norm(gap, axis=-1, keepdims=True), 1e-12 * r_b.max())
    unit = gap / distance
    along = (distance**2 + r_a**2 - r_b**2) / (2 * distance)
    across = np.sqrt(np.maximum(r_a**2 - along**2, 0.0)) * np.stack([-unit[..., 1], unit[..., 0]], axis=-1)
    middle = a + along * unit
    return np.concatenate([middle + across, middle - across])
