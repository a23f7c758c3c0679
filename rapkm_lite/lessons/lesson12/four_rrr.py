"""The planar 4RRR machine: a platform on four legs, three freedoms and four drives; in symbols, and its motions.

q = (four base angles, four elbow angles, the angle in the joint of platform and leg 1), all relative, n = 9.  The tree
is cut where the platform meets legs 2, 3 and 4, r = 6.  The pose is (x, y, alpha): the centre of the platform in m, and
its angle in rad.  Horizontal plane, all elbows bent to the left (working mode +, +, +, +).
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from ...machine.arguments import matvec
from ...mechanics.cores import wrap
from ...mechanics.matrices import complement, complement_dot
from ...mechanics.sampling import quintic, sample_times
from .mechanism import Mechanism, derive, symbolic

CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
BASE, PLATFORM = 0.5 * CORNERS, 0.1 * CORNERS  # m
LINK, ROD_MASSES, PLATFORM_MASS, PLATFORM_INERTIA, ROTOR = 0.4, (0.3, 0.2), 1.0, 0.01, 1e-3  # m, kg, kg m^2
RESISTANCE, TORQUE_CONSTANT = 0.6, 0.1  # ohm, N m/A
_PLATFORM_JOINTS = (0, 4, 8)


def symbols():
    """q, qd, constraints h, kinetic energy T, and the pose as functions of q, in SymPy.

    A point is reached over links (length, joints, bend): a vector of that length at the sum of the joints' angles, plus
    the bend.  The square of its velocity then holds only differences of angles.
    """
    sp = symbolic()
    q, qd = sp.symbols("theta1:5 phi1:5 psi"), sp.symbols("thetadot1:5 phidot1:5 psidot")
    angle = lambda link: sum(q[j] for j in link[1]) + link[2]  # noqa: E731
    spin = lambda link: sum(qd[j] for j in link[1])  # noqa: E731

    def place(start, links):
        x = [sum(link[0] * of(angle(link)) for link in links) for of in (sp.cos, sp.sin)]
        return sp.Matrix(start) + sp.Matrix(x)

    def energy(mass, links, inertia):
        """Half m v^2 of the point, and half I omega^2 of the body that ends there."""
        square = sum(a[0] * b[0] * spin(a) * spin(b) * sp.cos(angle(a) - angle(b)) for a in links for b in links)
        return mass * square / 2 + inertia * spin(links[-1]) ** 2 / 2

    def across(x, y):
        """A vector of the platform, as a link."""
        return np.hypot(x, y), _PLATFORM_JOINTS, sp.Rational(np.arctan2(y, x) / np.pi) * sp.pi

    m1, m2 = ROD_MASSES
    half, T, legs = LINK / 2, 0, []
    for i in range(4):
        upper, lower = (LINK, (i,), 0), (LINK, (i, 4 + i), 0)
        legs.append([upper, lower])
        T += energy(m1, [(half, *upper[1:])], m1 * LINK**2 / 12 + ROTOR)
        T += energy(m2, [upper, (half, *lower[1:])], m2 * LINK**2 / 12)
    centre = [*legs[0], across(*-PLATFORM[0])]
    T += energy(PLATFORM_MASS, centre, PLATFORM_INERTIA)
    gaps = [place(BASE[i], legs[i]) - place(BASE[0], [*centre, across(*PLATFORM[i])]) for i in (1, 2, 3)]
    pose = [*place(BASE[0], centre), angle(centre[-1])]
    return q, qd, [e for gap in gaps for e in gap], T, pose


@functools.cache
def four_rrr() -> Mechanism:
    """The machine in its nine angles; derived once a session, in a second or two."""
    q, qd, h, T, _ = symbols()
    return derive(q, qd, h, T, m=4)


@functools.cache
def with_pose() -> Mechanism:
    """The same loops in twelve coordinates, the nine angles and the pose, which h ties to them; without masses."""
    sp = symbolic()
    q, qd, h, _, pose = symbols()
    x, xd = sp.symbols("x y alpha"), sp.symbols("xdot ydot alphadot")
    return derive([*q, *x], [*qd, *xd], [*h, *(a - b for a, b in zip(pose, x, strict=True))], 0, m=4)


def angles(pose, mode=(1, 1, 1, 1)) -> np.ndarray:
    """q (..., 9) in rad of poses (..., 3), in a working mode; raises ValueError where a leg does not reach."""
    pose = np.asarray(pose, dtype=float)
    gap = corners(pose) - BASE
    reach = np.linalg.norm(gap, axis=-1) / (2 * LINK)
    if np.any(reach > 1.0):
        leg = int(np.argmax(reach.reshape(-1, 4).max(axis=0))) + 1
        raise ValueError(f"pose: leg {leg} would have to be {2 * LINK * reach.max():.3g} m long; allowed: {2 * LINK} m")
    bend = np.asarray(mode) * np.arccos(reach)
    base, elbow = np.arctan2(gap[..., 1], gap[..., 0]) - bend, 2 * bend
    psi = pose[..., 2] - base[..., 0] - elbow[..., 0]
    return np.concatenate([wrap(base), elbow, wrap(psi)[..., None]], axis=-1)


def corners(pose) -> np.ndarray:
    """Corners of the platform (..., 4, 2) in m."""
    pose = np.asarray(pose, dtype=float)[..., None, :]
    cos, sin = np.cos(pose[..., 2]), np.sin(pose[..., 2])
    x, y = PLATFORM.T
    return np.stack([pose[..., 0] + cos * x - sin * y, pose[..., 1] + sin * x + cos * y], axis=-1)


def poses(q) -> np.ndarray:
    """Poses (..., 3) of closed configurations q (..., 9), as leg 1 tells."""
    q = np.asarray(q, dtype=float)
    lower = q[..., 0] + q[..., 4]
    turn = lower + q[..., 8]
    inward = np.arctan2(*-PLATFORM[0, ::-1])
    links = [(LINK, q[..., 0]), (LINK, lower), (np.hypot(*PLATFORM[0]), turn + inward)]
    x, y = (sum(length * of(at) for length, at in links) + b for of, b in zip((np.cos, np.sin), BASE[0], strict=True))
    return np.stack([x, y, wrap(turn)], axis=-1)


@dataclass(frozen=True)
class Motion:
    """A desired motion: t (k,) in s, pose (k, 3) in m and rad, and q, qd, qdd (k, 9) on V."""

    t: np.ndarray
    pose: np.ndarray
    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray


def swing(radius: float = 0.1, angle: float = 0.3, duration: float = 4.0, dt: float = 1e-3) -> Motion:
    """Once round a circle about the middle, from rest to rest (quintic), while the platform swings by +-angle.

    radius : m.  angle : rad.  duration, dt : s.

    >>> swing(dt=0.1).q.shape
    (41, 9)
    """
    t = sample_times(duration, dt)
    way, way_dot, way_ddot = quintic(t / duration)
    turn, rate, accel = 2 * np.pi * way, 2 * np.pi * way_dot / duration, 2 * np.pi * way_ddot / duration**2
    size = np.array([radius, radius, angle])
    cos, sin = np.cos(turn), np.sin(turn)
    pose = size * np.stack([cos, sin, sin], axis=-1)
    slope = size * np.stack([-sin, cos, cos], axis=-1)
    xd = slope * rate[:, None]
    xdd = slope * accel[:, None] - pose * rate[:, None] ** 2
    q = np.unwrap(angles(pose), axis=0)
    both, own = np.hstack([q, pose]), (9, 10, 11)
    loops = with_pose()
    J = loops.J(both)
    F = complement(J, own)
    qd = matvec(F, xd)
    F_dot = complement_dot(J, loops.terms(both, qd)[1], own)
    qdd = matvec(F, xdd) + matvec(F_dot, xd)
    return Motion(t, pose, q, qd[:, :9], qdd[:, :9])


def legs(q) -> np.ndarray:
    """Base joint, elbow and corner of the platform of each leg, (..., 4, 3, 2) in m."""
    q = np.asarray(q, dtype=float)
    upper, lower = q[..., :4], q[..., :4] + q[..., 4:8]
    links = [LINK * np.stack([np.cos(at), np.sin(at)], axis=-1) for at in (upper, lower)]
    base = BASE + 0 * links[0]
    return np.stack([base, base + links[0], base + links[0] + links[1]], axis=-2)
