"""The design exercise of lesson 06: where a small triangle should stand so that known offsets fight least."""

from __future__ import annotations

from functools import lru_cache
from itertools import permutations

import numpy as np

from ...control.laws import PD
from ...machine.manipulator import Manipulator, load
from ...mechanics.kinematics import reachable
from ...mechanics.trajectory import triangle
from ...simulation.energy import antagonism_form
from ...simulation.sweeps import sweep
from ..answers import numbers, returned
from ..checker import Measured

SIDE, GAIN = 0.08, 7.05
# Offsets in mrad that are tried, and the share of the energy at the origin that is allowed.
OFFSETS = ((4.0, -2.0, 5.0), (6.0, 3.0, -2.0), (-2.0, 4.0, 6.0))
SHARE = 0.2


def _corners(centre) -> np.ndarray:
    return np.asarray(centre) + SIDE / np.sqrt(3) * np.array([[0, 1], [-np.sqrt(0.75), -0.5], [np.sqrt(0.75), -0.5]])


@lru_cache(maxsize=4)
def _forms(robot: Manipulator) -> tuple[np.ndarray, np.ndarray]:
    """Places (k, 2) in m of a grid where the triangle fits, and its forms (k, N, N)."""
    side = np.linspace(-0.15, 0.15, 16)
    grid = np.stack(np.meshgrid(side, side + 0.02), axis=-1).reshape(-1, 2)
    spots = np.array([p for p in grid if np.all(reachable(robot, _corners(p)))])
    return spots, np.array([_form(robot, p) for p in spots])


def _form(robot, centre) -> np.ndarray:
    return antagonism_form(robot, triangle(robot, side=SIDE, centre=centre, dt=0.05), GAIN)


def placement(robot: Manipulator, offset) -> np.ndarray:
    """Centre (2,) in m of a triangle of side 0.08 m where offsets (3,) in rad cost little antagonistic energy."""
    spots, forms = _forms(robot)
    return spots[np.argmin(np.einsum("i,kij,j->k", offset, forms, offset))]


def _machine() -> Manipulator:
    return load().replace(friction=0.0)


def _measured(centre, offset) -> float:
    """Antagonistic energy in J of the closed loop."""
    robot = _machine()
    path = triangle(robot, side=SIDE, centre=centre)
    # A study of one run: the lesson has compiled this kernel already.
    return float(sweep(robot, PD(GAIN, 0.225), path, offset[None]).antagonistic_energy[0])


@lru_cache(maxsize=1)
def _at_origin() -> tuple[float, ...]:
    return tuple(_measured(np.zeros(2), 1e-3 * np.array(offset)) for offset in OFFSETS)


@lru_cache(maxsize=2)
def _places(answer) -> tuple[np.ndarray, ...]:
    """The answer's centres for the offsets that are tried."""
    return tuple(_point(answer(_machine(), 1e-3 * np.array(offset))) for offset in OFFSETS)


def _point(centre) -> np.ndarray:
    point = numbers(returned(centre))
    if point.shape != (2,) or not np.all(np.isfinite(point)):
        raise ValueError(f"the place is {centre!r}; allowed: two finite coordinates of the centre, in m")
    return point


def judge(answer) -> list[Measured]:
    """The measured energy for each set of offsets beside a fifth of that at the origin."""
    return [
        Measured(
            f"antagonistic energy for ({', '.join(f'{v:g}' for v in offset)}) mrad at ({x:.3f}, {y:.3f}) m",
            _measured(np.array([x, y]), 1e-3 * np.array(offset)),
            "J",
            SHARE * origin,
        )
        for offset, (x, y), origin in zip(OFFSETS, _places(answer), _at_origin(), strict=True)
    ]


def _fits(places) -> bool:
    return all(np.all(reachable(_machine(), _corners(p))) for p in places)


def _costs(places, offsets) -> list[float]:
    """Predicted energy at each place for its offsets, as a share of that at the origin for the same offsets."""
    robot, origin = _machine(), _form(_machine(), np.zeros(2))
    tried = [(place, 1e-3 * np.array(offset)) for place, offset in zip(places, offsets, strict=True)]
    return [float(dq @ _form(robot, place) @ dq / (dq @ origin @ dq)) for place, dq in tried]


def _missed(answer) -> bool:
    places = _places(answer)
    return not _fits(places) or max(_costs(places, OFFSETS)) > SHARE


def _good_elsewhere(change_places=lambda p: p, change_offsets=lambda dq: dq):
    """True for an answer that misses, but would do for changed places or offsets."""

    def made(answer) -> bool:
        places = [change_places(p) for p in _places(answer)]
        return _fits(places) and _missed(answer) and max(_costs(places, map(change_offsets, OFFSETS))) <= SHARE

    return made


def _in_units(metres: float):
    """True for places that fit when read in a smaller unit, and where the farthest is beyond 20 mm, told from cm."""

    def made(answer) -> bool:
        places = [metres * p for p in _places(answer)]
        return _fits(places) and np.abs(places).max() > 0.02 and not _fits(_places(answer))

    return made


def _another_order(answer) -> bool:
    orders = list(permutations(range(3)))[1:]
    return any(_good_elsewhere(change_offsets=lambda dq, k=k: np.take(dq, k))(answer) for k in orders)


def _dearest(answer) -> bool:
    spots, forms = _forms(_machine())
    worst = [np.einsum("i,kij,j->k", dq, forms, dq).max() for dq in 1e-3 * np.array(OFFSETS)]
    at = [dq @ _form(_machine(), p) @ dq for p, dq in zip(_places(answer), 1e-3 * np.array(OFFSETS), strict=True)]
    return all(a > 0.8 * w for a, w in zip(at, worst, strict=True))


def _same(answer) -> bool:
    first, *others = _places(answer)
    return all(np.allclose(first, p, atol=1e-6) for p in others)


MISTAKES = {
    "the place is 1000 times too far away: units, the centre is wanted in m, not in mm": _in_units(1e-3),
    "the place is 100 times too far away: units, the centre is wanted in m, not in cm": _in_units(1e-2),
    "the place is the same for all offsets: the factor `offset` is missing in what is made small": _same,
    "this is the dearest place instead of the cheapest: max for min, or the offsets of other drives": _dearest,
    "the signs of the offsets are lost": _good_elsewhere(change_offsets=np.abs),
    "the offsets are taken in another order": _another_order,
    "x and y of the place are exchanged (order)": _good_elsewhere(lambda p: p[::-1]),
    "the place has the opposite sign": _good_elsewhere(lambda p: -p),
    "this is the lower left corner of the triangle; its centre is wanted": _good_elsewhere(
        lambda p: p + SIDE / np.sqrt(3) * np.array([np.sqrt(0.75), 0.5])
    ),
    "the triangle leaves the workspace there: rk.reachable tells whether all its corners are inside": (
        lambda answer: not _fits(_places(answer))
    ),
}
