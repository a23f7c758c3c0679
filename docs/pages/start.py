"""The start page as one file that opens from disk, where a browser loads no modules: everything is put into it."""

from __future__ import annotations

import json
import re
from pathlib import Path
from urllib.parse import quote

import numpy as np

import rapkm_lite as rk
from rapkm_lite.figures.style import ARM_COLOURS

HERE = Path(__file__).resolve().parents[1] / "start"
EXPLORE = Path(rk.__file__).resolve().parent / "explore"
VALUES = (
    "base lengths masses centers inertias rotor_inertia resistance torque_constant friction friction_velocity gravity "
    "load mode"
).split()
# Solid, dashed, dash-dotted: lengths in line widths.
DASHES = [], [5, 1.2], [4, 1.2, 1, 1.2]


def values() -> dict:
    """What the page must know: the machine, its drives and path, and Table 1."""
    setting = rk.experiment("testbed")
    robot, path = setting.robot, setting.trajectory
    # Samples at the corners, which the path's own do not meet.
    corners = rk.triangle(robot, dt=path.t[-1] / 3000).x[:3000:1000]
    return {
        "machine": {name: np.asarray(getattr(robot, name)).tolist() for name in VALUES},
        "K_P": float(setting.law.K_P),
        "K_D": float(setting.law.K_D),
        "corners": corners.tolist(),
        "duration": float(path.t[-1]),
        "table1": rk.measured_energies().tolist(),
        "colours": ARM_COLOURS[: robot.n_arms],
        "dashes": DASHES,
    }


def script() -> str:
    """Stage, engine and page in one scope each; a page that asks for a name finds it in the scope of its module."""
    parts = []
    for path in (EXPLORE / "stage.js", EXPLORE / "engine.js"):
        text = path.read_text(encoding="utf-8").replace("export default {", "void {")
        names = re.findall(r"^export (?:const|function|class) (\w+)", text, re.MULTILINE)
        body = re.sub(r"^export ", "", text, flags=re.MULTILINE)
        parts.append(f"const {path.stem} = (() => {{\n{body}\nreturn {{ {', '.join(names)} }};\n}})();")
    page = (HERE / "page.js").read_text(encoding="utf-8")
    page = re.sub(r'^import (\{.*?\}) from "[^"]*/(\w+)\.js";', r"const \1 = \2;", page, flags=re.MULTILINE)
    return "\n".join([*parts, f"(() => {{\n{page}\n}})();"])


def page(read: str, run: str) -> str:
    """The whole page; `read` and `run` are the addresses of the site and of the lessons in the browser."""
    css = "\n".join(path.read_text(encoding="utf-8") for path in (EXPLORE / "stage.css", HERE / "page.css"))
    icon = "data:image/svg+xml," + quote((HERE.parent / "pages/static/icon.svg").read_text(encoding="utf-8"))
    parts = {"css": css, "icon": icon, "read": read, "run": run, "values": json.dumps(values()), "script": script()}
    text = (HERE / "index.html").read_text(encoding="utf-8")
    return re.sub(r"\{\{(\w+)\}\}", lambda name: parts[name[1]].replace("</script", "<\\/script"), text)
