"""The tree and its cut loops, the configuration space, loop gaps and joint reactions (figs. 1 and 2, lesson 01)."""

from __future__ import annotations

import matplotlib as mpl
import matplotlib.pyplot as plt
import matplotlib.style
import numpy as np
from matplotlib.ticker import MultipleLocator

from ...figures._shared import scaled_frame
from ...figures.film import film
from ...figures.machine import arm_points, plot_machine
from ...figures.maps import mode_name, pair_line
from ...figures.style import AFTER, ALARM, BEFORE, NEUTRAL, STYLE, arm_colour, arm_text_colour, axes_or_new
from ...machine.arguments import exact_array, positive_number
from ...mechanics.dynamics import orthogonal_complement
from ...mechanics.kinematics import forward_kinematics, tips, unit_vector
from .sheets import configuration_sheet, on_sheet


def plot_joint_angles(robot, q, ax=None):
    """Fig. 1: the closed machine at q (2N,) with its joint angles: base angles from the x axis, elbow relative.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> ax = plotting.plot_joint_angles(robot, q)
    """
    N, size = robot.n_arms, 0.28 * robot.lengths.max()
    ax = plot_machine(robot, q, axes_or_new(ax, figsize=2 * [max(4.2, N + 0.2)]), labels=False)
    chains = arm_points(robot, q)
    links = chains[:, :2, None] + np.linspace(0, 1, 12)[:, None] * np.diff(chains, axis=1)[:, :, None]
    taken = [*links.reshape(-1, 2)]
    for i in range(N):
        base, elbow = float(q[i]), float(q[N + i])
        at = robot.base[i] + robot.lengths[i, 0] * unit_vector(base)
        _angle(ax, robot.base[i], 0.0, base, size, f"$q^{{{i + 1}}}$", arm_text_colour(i), taken)
        _angle(ax, at, base, base + elbow, size, f"$q^{{{N + i + 1}}}$", arm_text_colour(i), taken)
    return ax


def _angle(ax, at, start: float, stop: float, size: float, text: str, colour: str, taken: list) -> None:
    """An arc with a head from the dotted direction `start` to `stop`, and its name, which keeps off points `taken`."""
    arc = at + size * unit_vector(np.linspace(start, stop, 40))
    ax.plot(*np.stack([at, at + 1.35 * size * unit_vector(start)]).T, ":", color=NEUTRAL, lw=1.1, zorder=2)
    ax.plot(*arc.T, color=colour, lw=1.1, zorder=2)
    ax.annotate("", arc[-1], arc[-4], arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 1.1}, zorder=2)
    # The name of a narrow angle stands on the other side of its dotted line.
    half = (stop - start) / 2
    side = half if abs(half) > 0.4 else -np.copysign(0.3, half)
    ways = start + side + np.array([0.0, 0.4, -0.4, 0.8, -0.8, 1.2, -1.2])
    spots = at + size * np.concatenate([far * unit_vector(ways) for far in (1.55, 1.9)])
    names = spots[:, None] + size * np.array([[-0.3, 0.0], [0.0, 0.0], [0.3, 0.0]])
    room = np.linalg.norm(names[:, :, None] - taken, axis=-1).min(axis=(1, 2))
    k = np.argmax(np.minimum(room, 0.45 * size))  # the first that has enough
    taken.extend(names[k])
    paper = {"facecolor": "white", "edgecolor": "none", "pad": 0.6, "alpha": 0.8}
    ax.text(*spots[k], text, color=colour, ha="center", va="center", fontsize=11, zorder=6, bbox=paper)


def _with_legend(robot, ax):
    """Axes, and where their legend stands: in the corner, or, where a fourth arm would be under it, outside."""
    few = robot.n_arms < 4
    return axes_or_new(ax, figsize=(4.2 if few else 6.4, 4.2)), (0.0 if few else 1.0, 1.0)


def plot_cut_tree(robot, q, ax=None, title: str = ""):
    """Fig. 2: the tree of N free arms at any q (2N,), and the gaps h_i from the tip of arm 2 to the other tips.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> ax = plotting.plot_cut_tree(robot, q + [0.1, 0.2, 0, 0, 0, 0])
    """
    ax, corner = _with_legend(robot, ax)
    plot_machine(robot, q, ax, labels=False)
    p = tips(robot, q)
    for i in range(robot.n_arms):
        gap = np.hypot(*(p[i] - p[1]))
        if gap > 5e-3 * robot.lengths.max():
            arrow = {"arrowstyle": "-|>", "color": ALARM, "lw": 1.8, "shrinkA": 4, "shrinkB": 4}
            ax.annotate("", p[i], p[1], arrowprops=arrow, zorder=7)
        if i != 1:
            ax.plot([], [], color=ALARM, label=f"arm 2 to arm {i + 1}: {1e3 * gap:.1f} mm")
    ax.legend(loc="upper left", bbox_to_anchor=corner, handlelength=0, handletextpad=0, title="gaps")
    ax.set_title(title)
    return ax


def plot_topology(robot, ax=None):
    """Bodies (boxes) and revolute joints (lines) of the machine; dashed lines are the joints that are cut.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> ax = plotting.plot_topology(rk.load())
    """
    N = robot.n_arms
    ax = axes_or_new(ax, figsize=(max(4.2, 1.4 * N), 4.2))
    ax.plot([-0.25, N - 0.75], [0, 0], color="#DDDDDD", lw=20, solid_capstyle="round")
    ax.text((N - 1) / 2, 0, "ground", ha="center", va="center", zorder=6)
    for i in range(N):
        ax.plot([i, i], [0.1, 2], color=arm_colour(i), lw=3)
        for y, name in ((0.55, f"$q^{{{i + 1}}}$ driven"), (1.5, f"$q^{{{N + i + 1}}}$")):
            ax.text(i + 0.07, y, name, color=arm_text_colour(i), va="center")
        box = {"boxstyle": "round", "facecolor": "white", "edgecolor": arm_colour(i), "linewidth": 1.5}
        for y, link in ((1, i + 1), (2, N + i + 1)):
            ax.text(i, y, f"link {link}", ha="center", va="center", zorder=5, bbox=box)
        if i != 1:
            # The farther the arms are apart, the higher is the bow, and the flatter.
            steep = abs(i - 1) ** -0.5
            bow = {"connectionstyle": f"arc3,rad={-0.5 * steep * np.sign(i - 1)}"}
            line = {"arrowstyle": "-", "color": ALARM, "ls": "--", "lw": 2} | bow
            ax.annotate("", (i, 2.1), (1, 2.1), zorder=1, arrowprops=line)
            ax.text((1 + i) / 2, 2.3 + 0.25 / steep, "cut", color=ALARM, ha="center", va="center")
    ax.set(xlim=(-0.5, N - 0.3), ylim=(-0.4, 2.8))
    ax.set_axis_off()
    return ax


def plot_configuration_space(robot, modes, ax=None, q=None, trajectory=None, F=None):
    """The c-space V in the space of the first three base angles, in degrees: one sheet per working mode in `modes`.

    q (2N,) marks a configuration, F (2N, 2) a patch of the tangent plane there, `trajectory` draws its path on V.
    For three arms or more.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> ax = plotting.plot_configuration_space(rk.load(), [(1, 1, 1)])
    """
    if robot.n_arms < 3:
        raise ValueError(f"robot has {robot.n_arms} arms; allowed: 3 or more, whose base angles are the axes")
    if ax is None:
        with matplotlib.style.context(STYLE):
            ax = plt.figure(figsize=(6.4, 5.4)).add_subplot(projection="3d", computed_zorder=False)
    rims = []
    shades = mpl.colormaps["bone"](np.linspace(0.85, 0.45, len(modes)))
    for shade, mode in zip(shades, modes, strict=True):
        sheet = np.rad2deg(configuration_sheet(robot, mode))
        label = f"mode {mode_name(mode)}"
        ax.plot_surface(*sheet[..., :3].T, color=shade, alpha=0.8, lw=0, rstride=1, cstride=1, label=label)
        ax.plot(*sheet[-1, :, :3].T, color=NEUTRAL, lw=0.8)
        rims.append(sheet[-1])
    if len(rims) == 2:
        seam = np.where((np.abs(rims[0] - rims[1]) < 0.1).all(axis=-1, keepdims=True), rims[0], np.nan)
        if np.isfinite(seam).any():
            ax.plot(*seam[:, :3].T, color=ALARM, lw=2.5, label="common rim", zorder=8)
    if trajectory is not None:
        ax.plot(*np.rad2deg(on_sheet(robot, trajectory.q_a)[:, :3]).T, color="black", lw=1.6, label="path", zorder=8)
    if q is not None:
        point = np.rad2deg(on_sheet(robot, np.asarray(q)[: robot.n_arms])[:3])
        ax.plot(*point[:, None], "o", color=ALARM, ms=6, zorder=9)
        if F is not None:
            # An orthonormal basis of the plane keeps the patch a square, whatever the independent coordinates.
            basis = 35 * np.linalg.qr(F[:3])[0].T
            corners = np.array([[1, 1], [1, -1], [-1, -1], [-1, 1], [1, 1]]) @ basis
            ax.plot(*(point + corners).T, color=ALARM, lw=1.6, label="tangent plane, columns of F", zorder=9)
    ax.set(xlabel="base angle 1 in °", ylabel="base angle 2 in °", zlabel="base angle 3 in °")
    ax.set_aspect("equal")
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.set_major_locator(MultipleLocator(90 if len(modes) > 2 else 45))
        axis.labelpad = 10
    ax.view_init(elev=22, azim=-105)
    ax.set_box_aspect(None, zoom=0.95)  # pyright: ignore[reportArgumentType]
    ax.legend(loc="upper left", fontsize=9)
    return ax


def plot_complement_size(trajectory, pairs, ax=None):
    """Largest singular value of F along a path for pairs of base joints (0-based) as independent coordinates, rad/rad.

    With three arms a pair has the colour of the arm it leaves out.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting; path = rk.triangle(rk.load(), dt=5e-3)
    >>> ax = plotting.plot_complement_size(path, [(0, 1), (0, 2)])
    """
    ax = axes_or_new(ax)
    for pair in pairs:
        size = np.linalg.norm(orthogonal_complement(trajectory.robot, trajectory.q, pair), ord=2, axis=(-2, -1))
        names = f"$q^{{{pair[0] + 1}}}$, $q^{{{pair[1] + 1}}}$ independent"
        ax.semilogy(trajectory.t, size, label=names, **pair_line(trajectory.robot, tuple(sorted(pair))))
    ax.axhline(1.0, color=NEUTRAL, lw=1.0, label="$N_J$: size 1 everywhere")
    ax.set(xlabel="time in s", ylabel="largest singular value of F", xlim=(0, trajectory.t[-1]))
    ax.set_ylim(0.5, 1e7)
    ax.legend(loc="upper center", ncols=2)
    return ax


def plot_loop_gaps(t, gaps: dict, ax=None):
    """Largest loop gap over time on a logarithmic axis; `gaps` maps a label to (k,) gaps in m.

    >>> from rapkm_lite import plotting; ax = plotting.plot_loop_gaps([0.0, 1.0], {"10 ms": [1e-6, 1e-4]})
    """
    ax = axes_or_new(ax)
    for k, (label, gap) in enumerate(gaps.items()):
        colour, dash = (ALARM, BEFORE, AFTER)[k % 3], ("-", "--", "-")[k % 3]
        ax.semilogy(t, 1e3 * np.maximum(gap, 1e-16), color=colour, ls=dash, label=label)
    ax.set(xlabel="time in s", ylabel="largest loop gap in mm", xlim=(t[0], t[-1]))
    ax.legend(loc="center right")
    return ax


def plot_pin_forces(robot, q, forces, ax=None, newton_per_metre: float = 5.0, title: str = ""):
    """Forces (N, 2) in N that the end-effector pin exerts on the arm tips, arrows of 1 / newton_per_metre m per N.

    Raises ValueError for another number of forces than arms; `q` may leave the loops open.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> ax = plotting.plot_pin_forces(robot, q, [[0.1, 0.0], [0.0, 0.1], [-0.1, -0.1]])
    """
    scale = positive_number("newton_per_metre", newton_per_metre)
    forces = exact_array("forces", forces, robot.n_arms, 2)
    ax, corner = _with_legend(robot, ax)
    plot_machine(robot, q, ax, labels=False, alpha=0.35)
    x = forward_kinematics(robot, q)
    for i, force in enumerate(forces):
        arrow = {"arrowstyle": "-|>", "color": arm_colour(i), "lw": 2.4, "shrinkA": 0, "shrinkB": 0}
        ax.annotate("", tuple(x + force / scale), tuple(x), zorder=7, arrowprops=arrow)
        ax.plot([], [], color=arm_colour(i), lw=2.4, label=f"on arm {i + 1}: {np.hypot(*force):.2f} N")
    ax.legend(loc="upper left", bbox_to_anchor=corner)
    ax.set_title(title)
    return ax


def film_loops(robot, t, gaps: dict, poses: dict, frames: int = 26):
    """A film of poses (k, 2N) of two motions by name, as cut trees side by side; their largest gaps (k,) over t (k,).

    t in s, gaps in m.  Raises ValueError unless `gaps` and `poses` have two entries each.

    >>> import rapkm_lite as rk; from rapkm_lite import plotting
    >>> robot = rk.load(); q = rk.inverse_kinematics(robot, [0.02, 0.05])
    >>> plotting.film_loops(robot, [0.0, 1.0], {"a": [0, 1e-3], "b": [0, 0]}, {"a": [q, q], "b": [q, q]}, frames=2).size
    (844, 288)
    """
    for what, entries in (("gaps", gaps), ("poses", poses)):
        if len(entries) != 2:
            raise ValueError(f"{what} has {len(entries)} entries; allowed: 2, which stand side by side")
    size = 1e3 * max(np.max(gap) for gap in gaps.values())

    def draw(axes, k):
        for ax, (name, q) in zip(axes, poses.items(), strict=False):
            plot_cut_tree(robot, q[k], ax).legend().remove()
            ax.text(0.016, 0.953, f"{name}, {t[k]:.1f} s", fontweight="bold", transform=ax.transAxes)
            ax.set(**scaled_frame(robot, -0.27, 0.36, -0.32, 0.32, drives=True))
            ax.set_axis_off()
        for (name, gap), (colour, dash) in zip(gaps.items(), ((ALARM, "-"), (AFTER, "--")), strict=True):
            axes[-1].plot(t[: k + 1], 1e3 * np.asarray(gap[: k + 1]), color=colour, ls=dash, label=name)
        axes[-1].set(xlabel="time in s", ylabel="largest gap in mm", xlim=(0, t[-1]), ylim=(-0.03 * size, 1.1 * size))
        axes[-1].legend(loc="upper left")

    names = list(poses)
    alt = (
        f"Two simulations of the machine on its circle. {names[0]}: the tips drift apart, to {size:.0f} mm after "
        f"{t[-1]:.0f} s, with red arrows for the gaps. {names[1]}: they stay together, and the gap stays zero."
    )
    return film(draw, np.linspace(0, len(t) - 1, frames).astype(int), alt, panels=3, figsize=(8.8, 3.0))
