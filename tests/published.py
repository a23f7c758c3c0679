"""Numbers that the lessons print or quote, computed by the package: ``python -m tests.published`` writes the table.

`data/published_numbers.json` has for each the lesson, a name, the value in SI units, the tolerance (absolute), and the
words of the lesson that quote it, where there are such.  tests/test_published.py computes all of them anew.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

import rapkm_lite as rk

TABLE = Path(__file__).parents[1] / "data" / "published_numbers.json"
OFFSET = np.array([4e-3, -2e-3, 5e-3])
# Identities and poses are exact to rounding; a run has the errors of its integration, well below its printed digits.
EXACT, RUN = 1e-8, 2e-4


class Number(NamedTuple):
    lesson: str
    name: str
    compute: Callable[[], float]
    relative: float
    quoted: str = ""


@functools.cache
def robot():
    return rk.load()


@functools.cache
def at(x=0.0, y=0.0):
    return rk.at(robot(), rk.inverse_kinematics(robot(), [x, y]))


@functools.cache
def path():
    return rk.triangle(robot())


@functools.cache
def run(law="PD", offset=True):
    pd = rk.PD(7.05, 0.225)
    laws = {"PD": pd, "filter": rk.AntagonismFilter(pd), "redundant": rk.RedundantCTC([400.0] * 3, [40.0] * 3)}
    return rk.simulate(robot(), laws[law], path(), OFFSET if offset else 0.0)


@functools.cache
def along():
    """Singular values of A of all drives along the triangle."""
    return rk.singular_values(rk.control_matrix(robot(), path().q))


def guaranteed(torque):
    """Radius in N of the largest disc in the zonotope of the forces at the centroid: the nearest of its edges."""
    corners = rk.force_polygon(at().A, torque)
    edges = np.roll(corners, -1, axis=0) - corners
    return (np.abs(corners[:, 0] * edges[:, 1] - corners[:, 1] * edges[:, 0]) / np.hypot(*edges.T)).min()


def nearest_curve():
    """Distance of the centroid from the nearest curve of a pair, on 720 rays."""

    def product(r, angle):
        x = r * np.array([np.cos(angle), np.sin(angle)])
        return rk.distal_cross_products(robot(), rk.inverse_kinematics(robot(), x))

    found = []
    for angle in np.linspace(0.0, 2 * np.pi, 721):
        r = np.linspace(0.0, 0.12, 25)
        values = np.stack([product(one, angle) for one in r])
        for k, i in np.argwhere(np.diff(np.sign(values), axis=0)):
            found.append(brentq(lambda s, a=angle, i=i: product(s, a)[i], r[k], r[k + 1], xtol=1e-12))
    return min(found)


def gap(pieces):
    """Largest |eta^T dq_a| on the first edge when drives move along straight lines between `pieces` + 1 via points."""
    start, end = path().x[[0, 1667]]
    s, share = np.linspace(0, 1, 33), np.linspace(0, 1, pieces + 1)[:, None]
    via = rk.inverse_kinematics(robot(), start + share * (end - start))[:, :3]
    angles = ((1 - s[:, None, None]) * via[:-1] + s[:, None, None] * via[1:]).reshape(-1, 3)
    guess = start + (s[:, None] + np.arange(pieces)).reshape(-1, 1) / pieces * (end - start)
    closed = rk.estimate_pose(robot(), angles, guess)
    return np.abs(np.sum(rk.null_vector(robot(), closed) * (angles - closed[:, :3]), axis=1)).max()


def effective(K=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)):
    """Lowest and highest effective gain (35) along the triangle, gains on the driven joints, as part of the nominal."""
    F = rk.orthogonal_complement(robot(), path().q[::10], (0, 1))
    values = np.linalg.eigvals(rk.effective_gain(F, np.diag(K))).real
    return values.min(), values.max()


def switches(hysteresis):
    model = robot().replace(friction=0.0)
    law = rk.SwitchedCTC(400.0, 40.0, hysteresis=hysteresis)
    pairs = law.pairs(model, rk.triangle(model).q)
    return float(np.sum(np.any(np.diff(pairs, axis=0) != 0, axis=1)))


def mirror_times():
    """Times in s at which drive 3 carries no part of the null vector on the second edge."""
    eta, t = rk.null_vector(robot(), path().q)[:, 2], path().t
    k = np.flatnonzero(np.diff(np.sign(eta)))
    return t[k] - eta[k] * (t[k + 1] - t[k]) / (eta[k + 1] - eta[k])


def numbers() -> list[Number]:
    R = lambda: rk.antagonism_filter(at().A)  # noqa: E731
    frictionless = lambda: robot().replace(friction=0.0)  # noqa: E731
    small = functools.cache(lambda: rk.antagonism_form(robot(), path(), 7.05))
    table = functools.cache(rk.table1)
    stall = lambda: 24.0 * robot().torque_constant[0] / robot().resistance[0]  # noqa: E731
    rows = [
        Number("00", "energy without offsets, J", lambda: run(offset=False).energy.sum(), RUN),
        Number("00", "energy with offsets (4, -2, 5) mrad, J", lambda: run().energy.sum(), RUN, "4, −2 and 5 mrad"),
        Number("00", "largest torque at 5 s with offsets, N m", lambda: np.abs(run().c[-1]).max(), RUN),
        Number("01", "degree of freedom", lambda: float(rk.degree_of_freedom(robot(), at().q)), EXACT),
        Number("01", "rank of the constraints", lambda: float(rk.constraint_rank(robot(), at().q)), EXACT),
        Number("01", "largest eigenvalue of F^T G F at the centroid", lambda: _top(at().F.T @ at().G @ at().F), EXACT),
        Number("02", "guaranteed force at the centroid, N", lambda: guaranteed(0.1), EXACT, "0.92 N at the centroid"),
        Number("02", "sigma_min at the centroid, rad/m", lambda: rk.singular_values(at().A)[-1], EXACT, "6.5 rad/m"),
        Number("02", "lowest sigma_min on the triangle, rad/m", lambda: along()[:, -1].min(), EXACT, "4.5 rad/m"),
        Number("02", "centroid to the nearest pair curve, m", nearest_curve, 1e-5, "0.101 m"),
        Number("02", "eta_3 = 0 first, s", lambda: mirror_times()[0], 1e-5),
        Number("02", "entry of eta at the centroid", lambda: abs(rk.null_vector(robot(), at().q)[0]), EXACT),
        Number("03", "one count of 2000, rad", lambda: rk.Sensors(encoder=2000).count or 0.0, EXACT, "3.14$ mrad"),
        Number("03", "friction of a drive, N m", lambda: robot().friction[0], EXACT, "4.2 mN m"),
        Number(
            "03",
            "antagonism at rest, centroid, N m",
            lambda: _size(rk.steady_state_torque(at().A, 7.05, OFFSET)),
            EXACT,
        ),
        Number("03", "error at rest, centroid, rad", lambda: _size(rk.steady_state_error(at().A, 7.05, OFFSET)), EXACT),
        Number("04", "largest torque at 5 s, no filter, N m", lambda: np.abs(run().c[-1]).max(), RUN, "40 mN m"),
        Number("04", "energy without filter, J", lambda: run().energy.sum(), RUN),
        Number("04", "energy with filter, J", lambda: run("filter").energy.sum(), RUN),
        Number("04", "antagonistic energy without filter, J", lambda: rk.antagonistic_energy(run()), RUN),
        Number(
            "04", "stuck torque under the filter, N m", lambda: _row(R()) * robot().friction[0], EXACT, "4 / 3 * f_c"
        ),
        Number("04", "via points at the corners only, rad", lambda: gap(1), 1e-6, "128.6e-3"),
        Number("04", "via points every 15 mm, rad", lambda: gap(16), 1e-6, "1.7 mrad"),
        *(
            Number("04", f"Table 1 {kind}, drive {i + 1}, {row}, J", _entry(table, kind, j, i), RUN)
            for kind in ("measured", "simulated")
            for j, row in enumerate(("no filter", "filter"))
            for i in range(3)
        ),
        Number("05", "effective gain at the centroid", _centroid_gain, EXACT, "3 / 7"),
        Number("05", "lowest effective gain on the triangle", lambda: effective()[0], 1e-6, "0.19"),
        Number("05", "highest effective gain on the triangle", lambda: effective()[1], 1e-6, "0.73"),
        Number("05", "stall torque at 24 V, N m", stall, EXACT, "1.02"),
        Number("05", "switches without hysteresis", lambda: switches(1.0), EXACT, "switches == 9"),
        Number("05", "switches with hysteresis 1.2", lambda: switches(1.2), EXACT, "switches == 3"),
        Number("05", "energy, redundant law, no offsets, J", lambda: run("redundant", False).energy.sum(), RUN),
        Number("06", "trace of the energy form, J/rad^2", lambda: np.trace(small()), RUN),
        Number("06", "lowest eigenvalue of the energy form, J/rad^2", lambda: np.linalg.eigvalsh(small())[0], RUN),
        Number("06", "energy by the form at (4, -2, 5) mrad, J", lambda: OFFSET @ small() @ OFFSET, RUN),
        Number("07", "via points every 3.75 mm, rad", lambda: gap(64), 1e-6, "0.11"),
        Number("07", "inherent antagonism at 1 kHz, share", _inherent(frictionless), 1e-3, "0.1 % of the energy"),
    ]
    return rows


def _top(matrix):
    return np.linalg.eigvalsh(matrix)[-1]


def _size(vector):
    return float(np.linalg.norm(vector))


def _row(matrix):
    return np.abs(matrix).sum(axis=1).max()


def _entry(table, kind, j, i):
    return lambda: getattr(table(), kind)[j, i]


def _centroid_gain():
    F = rk.orthogonal_complement(robot(), at().q, (0, 1))
    return np.linalg.eigvals(rk.effective_gain(F, np.diag([1.0, 1, 1, 0, 0, 0]))).real.min()


def _inherent(frictionless):
    def share():
        machine = frictionless()
        one = rk.simulate(machine, rk.PD(7.05, 0.225), rk.triangle(machine))
        return rk.antagonistic_energy(one) / one.energy.sum()

    return share


def rows() -> list[dict]:
    """The table as it is written."""
    made = []
    for number in numbers():
        value = float(number.compute())
        tolerance = float(f"{number.relative * abs(value):.1g}")
        row = {"lesson": number.lesson, "name": number.name, "value": value, "tolerance": tolerance}
        made.append(row | ({"quoted": number.quoted} if number.quoted else {}))
    return made


if __name__ == "__main__":
    lines = ",\n".join("  " + json.dumps(row, ensure_ascii=False) for row in rows())
    TABLE.write_text(f"[\n{lines}\n]\n", encoding="utf-8")
    print(f"{len(rows())} numbers in {TABLE.name}")
