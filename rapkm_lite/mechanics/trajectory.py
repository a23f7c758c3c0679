"""End-effector paths, sampled at the control rate, and their joint motion (chapter, section 3.3)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..machine.arguments import check_leading, exact_array, positive_number, real_array, shaped, whole_number
from ..machine.manipulator import Manipulator, manipulator
from ..machine.values import Value, frozen
from .kinematics import unit_vector
from .sampling import Motion, check_rates, chosen, columns, equidistant, quintic, sample_times, slow_edges, slow_turns


@dataclass(frozen=True, eq=False, repr=False)
class Desired(Value):
    """Desired motion at one sample (or many: leading axes), x, xd, xdd (..., 2) in m, s, q, qd, qdd (..., 2N) rad, s.

    n_arms : N.  Every array is C-contiguous and read-only: a law that writes into one gets NumPy's ValueError.

    >>> import rapkm_lite as rk
    >>> rk.triangle(rk.load())[2500].x.round(3)
    array([0.06 , 0.035])
    """

    n_arms: int
    x: np.ndarray
    xd: np.ndarray
    xdd: np.ndarray
    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray

    def __post_init__(self):
        N = whole_number("n_arms", self.n_arms, 2, 10**6)
        self._set(n_arms=N, **{k: real_array(k, getattr(self, k), 2 * N if k[0] == "q" else 2) for k in _MOTION})
        check_leading(**{name: getattr(self, name).shape[:-1] for name in _MOTION})
        super().__post_init__()

    @cached_property
    def q_a(self) -> np.ndarray:
        """Base angles (..., N), rad."""
        return frozen(self.q[..., : self.n_arms])

    @cached_property
    def qd_a(self) -> np.ndarray:
        """Base rates (..., N), rad/s."""
        return frozen(self.qd[..., : self.n_arms])

    @cached_property
    def qdd_a(self) -> np.ndarray:
        """Base accelerations (..., N), rad/s^2."""
        return frozen(self.qdd[..., : self.n_arms])


_MOTION = ("x", "xd", "xdd", "q", "qd", "qdd")
_ROW = (*_MOTION, "q_a", "qd_a", "qdd_a")


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(Desired):
    """A desired motion: `Desired` with one row per sample, and the times t (k,) in s; ``trajectory[k]`` is one sample.

    x, xd, xdd : (k, 2) in m, m/s, m/s^2.  q, qd, qdd : (k, 2N) in rad, rad/s, rad/s^2, continuous in time.
    robot : the machine that q belongs to.  n_arms : its N.  A k beyond the samples raises IndexError.

    >>> import rapkm_lite as rk
    >>> path = rk.circle(rk.load(), radius=0.05, duration=1.0)
    >>> len(path), path.dt, path[0].x
    (1001, 0.001, array([0.05, 0.  ]))
    """

    t: np.ndarray
    robot: Manipulator

    def __post_init__(self):
        self._set(t=equidistant(self.t))
        super().__post_init__()
        if manipulator(self.robot).n_arms != self.n_arms:
            raise ValueError(f"n_arms = {self.n_arms}, the robot has {self.robot.n_arms}; allowed: the same number")
        for name in _MOTION:
            exact_array(name, getattr(self, name), len(self.t), 2 * (self.n_arms if name.startswith("q") else 1))

    @property
    def dt(self) -> float:
        """Sampling time in s."""
        return float(self.t[-1] / (len(self.t) - 1))

    def __len__(self) -> int:
        return len(self.t)

    def __getitem__(self, k) -> Desired:
        rows = chosen(len(self), k)
        if isinstance(rows, int | np.integer):  # also of an array without axes
            # Made for who asks: an array that is read-only can still be given another shape in place.
            sample = object.__new__(Desired)
            known = sample.__dict__
            known["n_arms"] = self.n_arms
            for name in _ROW:
                known[name] = getattr(self, name)[rows]
            return sample
        return Desired(self.n_arms, *(getattr(self, name)[rows] for name in _MOTION))

    def for_robot(self, robot: Manipulator) -> Trajectory:
        """The same end-effector motion for another machine (other joint angles).

        Set-points that are not the angles of x stay as far from them as they are here.
        Raises ValueError when the path leaves its workspace, and for set-points of another number of drives.
        """
        if manipulator(robot).same_kinematics(self.robot):
            return self if robot == self.robot else self._changed(robot=robot)
        if self._apart is not None and robot.n_arms != self.n_arms:
            raise ValueError(f"robot has {robot.n_arms} arms; allowed: {self.n_arms}, as many as the set-points")
        made = _follow(robot, self.t, self._motion, {"machine": robot})
        return made._changed(**{k: getattr(made, k) + v for k, v in self._apart.items()}) if self._apart else made

    def _motion(self, rows: slice) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return self.x[rows], self.xd[rows], self.xdd[rows]

    @cached_property
    def _apart(self) -> dict[str, np.ndarray] | None:
        """How far q, qd and qdd are from those of x, xd and xdd; None where they are those."""
        own = columns(self.robot, self.t, self._motion, {"machine": self.robot})[3:]
        apart = {name: getattr(self, name) - column for name, column in zip(_MOTION[3:], own, strict=True)}
        # Angles that somebody computed in another way differ by rounding.
        near = (np.abs(v).max() <= 1e-9 * (1.0 + np.abs(getattr(self, k)).max()) for k, v in apart.items())
        return None if all(near) else apart

    def with_set_points(self, q_a, qd_a=None) -> Trajectory:
        """The same path with other set-points for the drives, which need not close the loops (fig. 3).

        A drive that interpolates on its own, or whose clock is late, gets such angles.  Only laws that work on base
        angles and rates, such as `PD`, follow them; x, elbow angles and accelerations stay those of the path.
        For another machine, or a model with another geometry, they stay as far from the angles of the path.
        q_a : (k, N) rad.  qd_a : (k, N) rad/s; default: central differences of q_a.
        Raises ValueError for other shapes, numbers that are not finite, or angles half a turn away from the path.

        >>> import rapkm_lite as rk
        >>> path = rk.circle(rk.load(), radius=0.05, duration=1.0)
        >>> late = path.with_set_points(np.concatenate([path.q_a[:1], path.q_a[:-1]]))
        >>> bool(np.all(late.q_a[1:] == path.q_a[:-1])), late.x is path.x
        (True, True)
        """
        q_a, N = exact_array("q_a", q_a, len(self), self.n_arms), self.n_arms
        before = self._apart["q"][:, :N] if self._apart else 0.0
        if (apart := np.abs(q_a - self.q_a + before)).max() > np.pi:
            words = "away from the path; allowed: up to pi, on the turn of the path (np.unwrap(q_a, axis=0)), in rad"
            raise ValueError(f"q_a = {q_a.flat[apart.argmax()]:g} rad lies {apart.max():.3g} rad {words}")
        qd_a = np.gradient(q_a, self.dt, axis=0) if qd_a is None else exact_array("qd_a", qd_a, *q_a.shape)
        q, qd = (np.hstack([new, old[:, N:]]) for new, old in ((q_a, self.q), (qd_a, self.qd)))
        return self._changed(q=q, qd=qd)

    def __repr__(self):
        return f"Trajectory({len(self)} samples, {self.t[-1]:g} s, {self.robot.name!r})"


def follow(robot: Manipulator, t, x, xd, xdd) -> Trajectory:
    """A trajectory from the sampled end-effector motion x, xd, xdd, each (k, 2), at equidistant times t (k,).

    Raises ValueError when the path leaves the workspace, for times that are not equidistant from zero on (to 1e-6 of a
    step), and where x steps otherwise than xd says, by a tenth of the largest step, or xd otherwise than xdd, by half,
    at more than two samples and 5 % of them; xdd may be all 0.

    >>> import numpy as np, rapkm_lite as rk
    >>> t = np.linspace(0.0, 1.0, 101)
    >>> rk.follow(rk.load(), t, np.stack([0.05 * t, 0 * t], -1), [[0.05, 0.0]] * 101, np.zeros((101, 2)))
    Trajectory(101 samples, 1 s, 'testbed')
    """
    t = equidistant(t)
    x, xd, xdd = (exact_array(name, v, len(t), 2) for name, v in (("x", x), ("xd", xd), ("xdd", xdd)))
    check_rates(t, x, xd, xdd)
    return _follow(robot, t, lambda rows: (x[rows], xd[rows], xdd[rows]), {"samples": len(t)})


def _follow(robot: Manipulator, t, motion: Motion, given: dict) -> Trajectory:
    """`follow` without its checks; `motion` gives x, xd, xdd of some rows, `given` is what the caller was asked for."""
    made = Trajectory(manipulator(robot).n_arms, *columns(robot, t, motion, given), t=t, robot=robot)
    made.__dict__["_apart"] = None
    return made


def polygon(robot: Manipulator, corners, duration: float = 5.0, dt: float = 1e-3, rest: float = 0.0) -> Trajectory:
    """The closed polygon through `corners` (k, 2) in m, each edge quintic from rest to rest in the same time.

    duration : of the whole run in s, of which `rest` seconds are spent at the first corner before and after; dt of a
        sample, s.
    Raises ValueError when the path leaves the workspace, or a time does not fit; every edge needs two samples.

    >>> import rapkm_lite as rk
    >>> rk.polygon(rk.load(), [[-0.05, 0.01], [0.05, 0.01], [0.0, 0.05]], duration=3.0).x[1000].round(3)
    array([0.05, 0.01])
    """
    corners = real_array("corners", corners, 2)
    shaped("corners", corners, corners.ndim == 2 and len(corners) >= 2, "(k, 2) with at least two corners")
    return _polygon(robot, corners, duration, dt, rest, {"corners": corners.tolist()})


def _polygon(robot: Manipulator, corners: np.ndarray, duration, dt, rest, given: dict) -> Trajectory:
    t, rest, edges = sample_times(duration, dt), float(exact_array("rest", rest)), len(corners)
    edge_time, steps = slow_edges(t, edges, rest), np.roll(corners, -1, axis=0) - corners

    def motion(rows: slice):
        phase = np.clip((t[rows] - rest) / edge_time, 0.0, edges)
        edge = np.minimum(np.floor(phase).astype(int), edges - 1)
        s = phase - edge
        way, rate, rate_dot = quintic(s)
        first, step = corners.T[:, edge], steps.T[:, edge]
        return (first + way * step).T, (rate * step / edge_time).T, (rate_dot * step / edge_time**2).T

    return _follow(robot, t, motion, given)


def triangle(
    robot: Manipulator,
    side: float = 0.24,
    duration: float = 5.0,
    dt: float = 1e-3,
    centre=(0.0, 0.0),
    angle: float = 0.0,
    rest: float = 0.0,
) -> Trajectory:
    """The triangle of fig. 4; our choice: equilateral, one corner up, from the lower left corner, counter-clockwise.

    side in m; centre (2,) in m; angle turns the triangle about its centre, rad.
    duration, dt, rest in s, and errors: see `polygon`.

    >>> import rapkm_lite as rk
    >>> rk.triangle(rk.load())
    Trajectory(5001 samples, 5 s, 'testbed')
    """
    side, angle = positive_number("side", side), float(exact_array("angle", angle))
    if abs(angle) > 1e6:
        raise ValueError(f"angle = {angle:g} rad; allowed: up to 1e6 rad, beyond which corners would be rounded")
    turned = angle + np.deg2rad([210.0, 330.0, 90.0])
    centre = exact_array("centre", centre, 2)
    corners, given = centre + side / np.sqrt(3) * unit_vector(turned), {"side": side, "centre": centre.tolist()}
    return _polygon(robot, corners, duration, dt, rest, given | {"angle": angle})


def circle(
    robot: Manipulator, radius: float = 0.1, duration: float = 5.0, dt: float = 1e-3, centre=(0, 0), turns: float = 1
) -> Trajectory:
    """A circle from its rightmost point, counter-clockwise, quintic from rest to rest; radius and centre (2,) in m.

    duration, dt : of the whole run and of a sample, s.  turns : how often around, above 0; 0.5 is half of it.
    Raises ValueError when the path leaves the workspace, unless dt is a whole fraction of `duration`, and for more than
    a quarter turn per sample.

    >>> import rapkm_lite as rk
    >>> rk.circle(rk.load(), radius=0.05, duration=1.0).x[0]
    array([0.05, 0.  ])
    """
    radius, t = positive_number("radius", radius), sample_times(duration, dt)
    duration, middle = positive_number("duration", duration), exact_array("centre", centre, 2)[:, None]
    full = 2 * np.pi * slow_turns(t, turns)

    def motion(rows: slice):
        way, rate, rate_dot = quintic(t[rows] / duration)
        angle, rate, rate_dot = full * way, full / duration * rate, full / duration**2 * rate_dot
        u = np.stack([np.cos(angle), np.sin(angle)])
        v = np.stack([-u[1], u[0]])
        return (middle + radius * u).T, (radius * rate * v).T, (radius * (rate_dot * v - rate**2 * u)).T

    return _follow(robot, t, motion, {"radius": radius, "centre": middle.ravel().tolist()})


def hold(robot: Manipulator, x, duration: float = 1.0, dt: float = 1e-3) -> Trajectory:
    """Stay at x (2,) in m for `duration` in s, in samples of dt; raises ValueError unless x is inside the workspace.

    >>> import rapkm_lite as rk
    >>> rk.hold(rk.load(), [0.02, 0.05], duration=0.5)
    Trajectory(501 samples, 0.5 s, 'testbed')
    """
    t = sample_times(duration, dt)
    still, point = np.zeros((len(t), 2)), exact_array("x", x, 2)
    return _follow(robot, t, lambda rows: (still[rows] + point, still[rows], still[rows]), {"x": x})
