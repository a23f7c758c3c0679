"""What `python -m rapkm_lite` prints: the machine, and the energies of the default experiment beside Table 1."""

from __future__ import annotations

from ..control.laws import AntagonismFilter
from .experiments import experiment, measured_energies
from .runs import simulate

# The offsets of the lessons, rad.
OFFSET = (4e-3, -2e-3, 5e-3)
ROWS = "without filter", "with filter"


def summary() -> dict:
    """Machine, law, filter (16) at the true pose, and energies per drive in J without / with it, as plain values.

    The default experiment is ``data/testbed.toml`` with the lessons' offsets of (4, -2, 5) mrad.

    >>> summary()["offset_rad"]
    [0.004, -0.002, 0.005]
    """
    setting = experiment("testbed")
    laws = setting.law, AntagonismFilter(setting.law, pose="true")
    runs = [simulate(setting.robot, law, setting.trajectory, OFFSET) for law in laws]
    return {
        "machine": repr(setting.robot),
        "law": repr(setting.law),
        "filter": repr(laws[1]),
        "offset_rad": list(OFFSET),
        "energy_J": {
            "default experiment": dict(zip(ROWS, [run.energy.tolist() for run in runs], strict=True)),
            "Table 1, measured": dict(zip(ROWS, measured_energies().tolist(), strict=True)),
        },
    }


def as_text(values: dict) -> str:
    """The table of `summary`, and the "version", for people."""
    offsets = ", ".join(f"{1e3 * o:g}" for o in values["offset_rad"])
    tables = values["energy_J"]
    lines = [
        f"rapkm_lite {values['version']}",
        f"machine   {values['machine']}",
        f"drives    {values['law']}, encoder offsets ({offsets}) mrad",
        f"filter    {values['filter']}",
        "",
        f"{'electric energy in J':36}{'drive 1':>9}{'drive 2':>9}{'drive 3':>9}{'sum':>9}",
    ]
    for name, rows in tables.items():
        for row, energies in rows.items():
            numbers = "".join(f"{energy:9.2f}" for energy in (*energies, sum(energies)))
            lines.append(f"{name + ', ' + row:36}{numbers}")
        without, filtered = (sum(energies) for energies in rows.values())
        lines.append(f"{'':4}the filter saves {100 * (1 - filtered / without):.0f} %")
    lines += ["", "The chapter leaves offsets and gains open: the two tables agree in kind, not in numbers."]
    return "\n".join(lines)
