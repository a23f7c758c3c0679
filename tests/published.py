"""Numbers that the lessons print or quote, computed by the package: ``python -m tests.published`` writes the table.

`data/published_numbers.json` has for each the lesson, a name, the value in SI units, the tolerance (absolute), and the
words of the lesson that quote it, where there are such.  tests/test_published.py computes all of them anew.
"""

from __future__ import annotations

import argparse
import functools
import json
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq, fminbound

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
        Number("05", "stall torque at 24 V, N m", stall, EXACT, "1.02"),
        Number("05", "switches without hysteresis", lambda: switches(1.0), EXACT, "switches == 9"),
        Number("05", "switches with hysteresis 1.2", lambda: switches(1.2), EXACT, "switches == 3"),
        Number("05", "energy, redundant law, no offsets, J", lambda: run("redundant", False).energy.sum(), RUN),
        Number("06", "trace of the energy form, J/rad^2", lambda: np.trace(small()), RUN),
        Number("06", "lowest eigenvalue of the energy form, J/rad^2", lambda: np.linalg.eigvalsh(small())[0], RUN),
        Number("06", "energy by the form at (4, -2, 5) mrad, J", lambda: OFFSET @ small() @ OFFSET, RUN),
        Number("07", "via points every 3.75 mm, rad", lambda: gap(64), 1e-6, "0.11"),
        Number("07", "inherent antagonism at 1 kHz, share", _inherent(frictionless), 1e-3, "0.1 % of the energy"),
        Number("08", "one count of 2000, rad", lambda: rk.Sensors(encoder=2000).count or 0.0, EXACT, "3.14$ mrad"),
        Number("08", "friction of a drive, N m", lambda: robot().friction[0], EXACT, "4.2 mN m"),
        *calibration(),
        *allocation(),
        *imperfections(),
        *controllers(),
        *another_machine(),
    ]
    return rows


def calibration() -> list[Number]:
    """Lesson 08: what places and torques tell of the offsets."""
    rng = np.random.default_rng(7)
    angle, reach = rng.uniform(0, 2 * np.pi, 24), np.sqrt(rng.uniform(0, 1, 24))
    disc = reach[:, None] * np.stack([np.cos(angle), np.sin(angle)], -1)

    def null_vectors(x):
        return rk.null_vector(robot(), rk.inverse_kinematics(robot(), x))

    def three(radius, turn):
        """Condition of three places on a circle, the first at `turn` degrees."""
        angle = np.radians(turn + np.array([0.0, 120.0, 240.0]))
        return np.linalg.cond(null_vectors(radius * np.stack([np.cos(angle), np.sin(angle)], -1)))

    def rounding(radius):
        """Standard deviation in rad of the worst offset from 24 rests: that of a count is its size over sqrt(12)."""
        eta = null_vectors(radius * disc)
        return 2 * np.pi / 2000 / np.sqrt(12) * np.sqrt(np.linalg.inv(eta.T @ eta).diagonal().max())

    def by_torques():
        """Error in rad of the offsets that the torques at rest show, one gain being other than it is said to be."""
        log = rk.mystery_run("gain")
        rests = np.linalg.norm(np.gradient(log.q_a, log.t, axis=0), axis=1) < 1e-9
        eta = rk.null_vector(robot(), rk.estimate_pose(robot(), log.q_a[rests], np.zeros((rests.sum(), 2))))
        shown = np.linalg.lstsq(eta, -np.sum(eta * log.c[rests], axis=1) / 7.05, rcond=None)[0]
        return np.abs(shown - rk.calibrate(robot(), log).offset).max()

    def unseen():
        q_a = rk.inverse_kinematics(robot(), 0.1 * disc)[:, :3] + OFFSET
        return float(15 - rk.calibrate(robot(), q_a, "all").rank)

    return [
        Number("08", "three places on 120 mm, condition", lambda: three(0.12, 0), EXACT, "from 8.6 to 1.4"),
        Number("08", "the same, turned by 60 degrees", lambda: three(0.12, 60), EXACT, "from 8.6 to 1.4"),
        Number("08", "three places on 137 mm, least condition", lambda: three(0.137, 65), EXACT, "reach 1.01"),
        Number("08", "24 rests, small disc, worst offset, rad", lambda: rounding(0.03), EXACT, "4 mrad in the small"),
        Number("08", "24 rests, large disc, worst offset, rad", lambda: rounding(0.12), EXACT, "0.7 mrad"),
        Number("08", "offsets from torques, wrong gain, rad", by_torques, 1e-6, "miss by 1.6 mrad"),
        Number("08", "unknowns that stay unseen", unseen, EXACT, "Of 15 unknowns"),
    ]


def allocation() -> list[Number]:
    """Lesson 09: the carriage, the workspace, the hot drive."""
    limit = 0.085
    free = functools.cache(lambda: robot().replace(friction=0.0))
    carriage = functools.cache(lambda: free().replace(load=0.7))
    up = functools.cache(lambda: rk.polygon(carriage(), [[0, -0.06], [0, 0.06]], duration=2.0, dt=5e-3))
    ctc = rk.CTC(400.0, 40.0, independent=None)

    def demanded():
        return np.abs(rk.inverse_dynamics(carriage(), up().q, up().qd, up().qdd)[:, 0]).max()

    def clipped():
        return rk.simulate(carriage(), ctc, up(), faults=[rk.TorqueLimit(limit)]).path_error.max()

    def heat():
        run = rk.simulate(carriage(), ctc, up())
        return rk.copper_loss(run.robot, run.c[:-1], run.dt).sum()

    def dearer(allocate):
        """Heat of a rule over that of the least size, for the exact torques at every fourth sample."""
        A = rk.control_matrix(carriage(), up().q)
        f = rk.required_wrench(carriage(), up().q, up().qd, up().qdd)
        least = rk.inverse_dynamics(carriage(), up().q, up().qd, up().qdd)
        c = np.array([allocate(*pair) for pair in zip(A[::4], f[::4], strict=True)])
        return np.sum(c**2) / np.sum(least[::4] ** 2)

    @functools.cache
    def everywhere():
        x, y, inside = rk.workspace_grid(robot(), 201)
        places = np.stack(np.meshgrid(x, y), axis=-1)[inside]
        return rk.control_matrix(robot(), rk.inverse_kinematics(robot(), places))

    def conditions(rows):
        large, small = rk.singular_values(everywhere()[:, rows]).T
        return large / small

    def area():
        """Area of all forces over that of the rule of least size, by Gauss's formula and by rays."""
        x, y = rk.force_polygon(at().A, limit).T
        angle = np.linspace(0, 2 * np.pi, 20000, endpoint=False)
        way = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        reach = limit / np.abs(way @ rk.weighted_pseudoinverse(at().A).T).max(axis=1)
        return np.abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2 / (np.mean(reach**2) * np.pi)

    def hot(weighted):
        odd = free().replace(resistance=[0.05, 0.05, 3.0])
        W, motion = odd.resistance / odd.torque_constant**2, rk.triangle(odd)
        c = rk.inverse_dynamics(odd, motion.q, motion.qd, motion.qdd, W=W if weighted else None)
        return rk.copper_loss(odd, c[:-1], motion.dt).sum()

    def softer():
        """Stiffness in N/m that a prestress of 1 N m along the null vector takes away in the centre."""
        n = rk.null_basis(at().A)[:, 0]
        before, after = (rk.endeffector_stiffness(robot(), at().q, 7.05, mu * n)[0, 0] for mu in (0.0, 1.0))
        return abs(before - after)

    return [
        Number("09", "largest torque of drive 1 for 0.7 kg, N m", demanded, EXACT, "112 mN m"),
        Number("09", "error of the clipped run, m", clipped, RUN, "1.3 mm, sixty times"),
        Number("09", "heat without limits, J", heat, RUN, "12.3 J"),
        Number(
            "09",
            "heat within the limits over the least",
            lambda: dearer(lambda A, f: rk.allocate_torques(A, f, limit)),
            1e-6,
            "rises by 7 %",
        ),
        Number("09", "heat of the least peak over the least", lambda: dearer(rk.minimax_torques), 1e-6, "17 %"),
        Number("09", "area of forces over that of least size", area, 1e-6, "4 / 3"),
        Number(
            "09", "share of the workspace with one sign", lambda: rk.common_sign(everywhere()).mean(), 1e-6, "56 % of"
        ),
        Number(
            "09", "condition of a fixed pair, 95 %", lambda: np.percentile(conditions([0, 1]), 95), 1e-6, "of 22 that"
        ),
        Number("09", "heat of least size, J", lambda: hot(False), EXACT, "1.52 J against 2.98 J"),
        Number("09", "heat of least heat, J", lambda: hot(True), EXACT, "1.52 J against 2.98 J"),
        Number("09", "stiffness for a prestress, 1/m", softer, EXACT, "17.2 N/m for each N m"),
    ]


def imperfections() -> list[Number]:
    """Lesson 10: links that are not those of the drawing, and drives that die."""
    drawing = functools.cache(lambda: robot().replace(friction=0.0))
    place = np.array([0.03, 0.02])
    pd = rk.PD(7.05, 0.225)

    def longer(eps, machine=drawing):
        return machine().replace(lengths=(1 + eps) * machine().lengths)

    def control(machine, x=place):
        return rk.control_matrix(machine, rk.inverse_kinematics(machine, x))

    def still_fights():
        x = rk.triangle(drawing()).x
        kept = rk.prestress_projector(control(longer(1e-3), x)) @ rk.antagonism_filter(control(drawing(), x))
        return np.linalg.norm(kept, axis=(1, 2)).max()

    def leak():
        motion = rk.triangle(drawing())
        force = control(longer(1e-3), motion.x).mT @ rk.null_vector(drawing(), motion.q)[..., None]
        return np.linalg.norm(force, axis=1).max()

    def fight(K_P):
        wanted = rk.inverse_kinematics(drawing(), place)[:3]
        return K_P * (wanted - rk.estimate_pose(longer(1e-2), wanted, place)[:3])

    def left(K_P):
        share = np.linalg.norm(rk.weighted_pseudoinverse(control(drawing())), axis=1)
        return np.min((0.12 - np.abs(fight(K_P))) / share)

    def dead(eps, law):
        motion = rk.triangle(drawing(), side=0.12, duration=2.5)
        run = rk.simulate(longer(eps, robot), law, motion, model=drawing(), faults=rk.DeadDrive(0, 0.5))
        return run.path_error.max()

    filtered = rk.AntagonismFilter(pd)
    return [
        Number(
            "10", "share that the filter leaves, links 0.1 % longer", still_fights, EXACT, "a thousandth of the torque"
        ),
        Number("10", "leak of a prestress, links 0.1 % longer, 1/m", leak, EXACT, "10 mN for each N m"),
        Number("10", "fight, links 1 % longer, N m", lambda: _size(fight(7.05)), 1e-6),
        Number("10", "force left at 15 N m/rad, N", lambda: left(15.0), 1e-4, "almost no force is left"),
        Number("10", "drive 1 dead, filter, m", lambda: dead(0.0, filtered), RUN, "lag by 13 mm"),
        Number("10", "drive 1 dead, PD, links 0.5 % longer, m", lambda: dead(5e-3, pd), RUN, "9 mm at +5 ‰"),
        Number("10", "drive 1 dead, PD, links 0.5 % shorter, m", lambda: dead(-5e-3, pd), RUN, "17 mm at −5 ‰"),
        Number("10", "drive 1 dead, filter, 0.5 % longer, m", lambda: dead(5e-3, filtered), RUN, "12 to 14 mm"),
        Number("10", "drive 1 dead, filter, 0.5 % shorter, m", lambda: dead(-5e-3, filtered), RUN, "12 to 14 mm"),
    ]


def controllers() -> list[Number]:
    """Lesson 11: laws that are equally fast, 5 Hz at the centroid, of a machine without friction."""
    w = 10 * np.pi
    smooth = functools.cache(lambda: rk.load().replace(friction=0.0))
    small = functools.cache(lambda: rk.triangle(smooth(), 0.12, 2.5))

    @functools.cache
    def pull():
        """A^T A over the inertia at the centroid, in 1/(kg m^2): squares of frequencies for springs of 1 N m/rad."""
        inertia = rk.minimal_dynamics(robot(), at().q, 0 * at().q, None)[0]
        return np.linalg.solve(inertia, at().A.T @ at().A)

    @functools.cache
    def raced(name):
        gain = 2 / np.trace(pull())
        laws = {
            "PD": rk.PD(gain * w**2, gain * 2 * w),
            "CTC": rk.CTC(w**2, 2 * w, None),
            "switched": rk.SwitchedCTC(w**2, 2 * w),
        }
        return rk.simulate(smooth(), laws[name], small(), OFFSET)

    def rms(name):
        return np.sqrt(np.mean(raced(name).path_error ** 2))

    return [
        Number("11", "effective gain at the centroid", _centroid_gain, EXACT, "3 / 7"),
        Number("11", "lowest effective gain on the triangle", lambda: effective()[0], 1e-6, "0.19"),
        Number("11", "highest effective gain on the triangle", lambda: effective()[1], 1e-6, "0.73"),
        Number("11", "frequency of PD, centroid, Hz", lambda: np.sqrt(_top_of(pull()) * 7.05) / (2 * np.pi), EXACT),
        Number("11", "mean miss of computed torque, m", lambda: rms("CTC"), RUN, "0.84 to 0.85 mm"),
        Number("11", "largest miss of PD, m", lambda: raced("PD").path_error.max(), RUN, "at worst they miss by 2 mm"),
        Number("11", "antagonistic energy of PD, J", lambda: rk.antagonistic_energy(raced("PD")), RUN, "2.4 J on"),
        Number("11", "largest jump of the switched law, N m", lambda: _jump(raced("switched")), RUN, "over 50 mN m"),
    ]


def another_machine() -> list[Number]:
    """Lesson 12: the platform on four legs, from what SymPy derives, and the testbed with a load."""

    @functools.cache
    def legs():
        from rapkm_lite.lessons.lesson12 import four_rrr

        return four_rrr, four_rrr.four_rrr(), four_rrr.with_pose()

    def pressed():
        legs4, machine, _ = legs()
        A = rk.complement(machine.J(legs4.angles([0, 0, 0])), independent=(0, 1, 2))[:4]
        return 40 * abs(rk.null_basis(A)[:, 0] @ (1e-3 * np.array([4, -2, 5, -3])))

    def apex():
        """Angle of the platform in rad at which the four distal links meet in one point."""
        legs4, machine, _ = legs()

        def weakest(angle):
            return np.linalg.svd(rk.projector(machine.J(legs4.angles([0, 0, angle])))[:4])[1][2]

        return fminbound(weakest, 0.5, 0.7, xtol=1e-10)

    def condition(length):
        legs4, _, loops = legs()
        J = loops.J(np.r_[legs4.angles([0, 0, 0]), 0.0, 0.0, 0.0])
        return np.linalg.cond(rk.complement(J, independent=(9, 10, 11))[:4] / [1, 1, length])

    def effective_on_circle():
        legs4, machine, _ = legs()
        F = rk.complement(machine.J(legs4.swing(dt=2e-3).q), independent=(0, 1, 2))
        return np.linalg.eigvals(rk.effective_gain(F, np.diag([1.0] * 4 + [0.0] * 5))).real.min(axis=-1)

    def carried():
        heavy = robot().replace(load=0.5, friction=0.0)
        motion = rk.triangle(heavy)
        return np.abs(rk.inverse_dynamics(heavy, motion.q, motion.qd, motion.qdd)).max()

    def wasted():
        heavy = robot().replace(load=0.5)
        return rk.antagonistic_energy(rk.simulate(heavy, rk.PD(7.05, 0.225), rk.triangle(heavy), OFFSET))

    return [
        Number("12", "fight of four offsets, K_P = 40 N m/rad, N m", pressed, EXACT),
        Number("12", "angle at which all four let go, rad", apex, 1e-6, "0.59724 rad"),
        Number("12", "condition in metres", lambda: condition(1.0), EXACT, '(7, "in SI units")'),
        Number("12", "condition in millimetres", lambda: condition(1e-3), EXACT, "141, in millimetres"),
        Number("12", "lowest effective gain on the circle", lambda: effective_on_circle().min(), 1e-6, "0.03 to 0.18"),
        Number("12", "highest of the lowest gains", lambda: effective_on_circle().max(), 1e-6, "0.03 to 0.18"),
        Number("12", "torque of the testbed with 0.5 kg, N m", carried, EXACT, "75 mN m"),
        Number("12", "antagonism of the testbed with 0.5 kg, J", wasted, RUN, "wastes 3.3 J"),
    ]


def _top_of(matrix):
    return np.linalg.eigvals(matrix).real.max()


def _jump(run):
    return np.abs(np.diff(run.c, axis=0)).max()


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


def kept(new: list[dict], old: list[dict]) -> list[dict]:
    """The new rows, but as they were where a value moved by less than its tolerance: another processor rounds so."""
    before = {(row["lesson"], row["name"]): row for row in old}
    made = []
    for row in new:
        was = before.get((row["lesson"], row["name"]), {"value": float("inf"), "tolerance": 0.0})
        stays = abs(row["value"] - was["value"]) < was["tolerance"]
        made.append(row | {key: was[key] for key in ("value", "tolerance") if stays})
    return made


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    table = kept(rows(), json.loads(TABLE.read_text(encoding="utf-8")))
    lines = ",\n".join("  " + json.dumps(row, ensure_ascii=False) for row in table)
    TABLE.write_text(f"[\n{lines}\n]\n", encoding="utf-8")
    print(f"{len(table)} numbers in {TABLE.name}")
