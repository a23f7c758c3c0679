"""The moving picture of the README: python docs/pictures/make.py"""

import argparse
from pathlib import Path

import numpy as np

import rapkm_lite as rk
from rapkm_lite import plotting

HERE = Path(__file__).resolve().parent
OFFSET = [4e-3, -2e-3, 5e-3]
ALT = (
    "The machine goes once around its triangle. Beside it the torques of its three drives: without the filter they are "
    "lopsided and one still pulls when the machine has stopped, with the filter they are small and end near zero."
)


def main() -> None:
    plotting.use_style()
    robot, law = rk.load(), rk.PD(7.05, 0.225)
    path = rk.triangle(robot)
    runs = {
        "without filter": rk.simulate(robot, law, path, OFFSET),
        "with filter": rk.simulate(robot, rk.AntagonismFilter(law), path, OFFSET),
    }

    def draw(axes, k):
        plane, *others = axes
        plane.plot(*path.x[:, :2].T, color=plotting.NEUTRAL, linewidth=0.8, linestyle="--")
        plotting.plot_machine(robot, runs["with filter"].q[k], plane, labels=False)
        for i, beside in enumerate([(-6, 13), (14, -13), (0, 10)]):
            look = {
                "color": plotting.arm_text_colour(i),
                "ha": "center",
                "va": "center",
                "fontsize": 9,
                "weight": "bold",
            }
            plane.annotate(f"drive {i + 1}", robot.base[i], beside, textcoords="offset points", **look)
        plane.set(xlim=(-0.37, 0.33), ylim=(-0.29, 0.33), xticks=[], yticks=[], xlabel="", ylabel="", title="")
        plane.set_aspect("equal")
        for ax, (name, run) in zip(others, runs.items(), strict=True):
            for i in range(3):
                ax.plot(run.t[: k + 1 : 10], 1e3 * run.c[: k + 1 : 10, i], **plotting.arm_line(i))
            ax.set(xlim=(0, 5), ylim=(-50, 30), xlabel="t in s", title=f"{name}: {run.energy.sum():.1f} J")
            ax.grid(False)
        others[0].set_ylabel("torques in mN m")

    steps = np.linspace(0, 5000, 36).astype(int)
    film = plotting.film(draw, steps, ALT, panels=3, figsize=(7.8, 2.5), seconds=5, rest=2.0, loops=50, dpi=90)
    film.save(HERE / "front.webp")
    print(film)


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__).parse_args()
    main()
