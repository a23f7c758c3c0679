"""Put the lessons into the browser: python docs/lite.py --pyodide FOLDER, after docs/build.py.

Needs docs/requirements.txt and docs/requirements-lite.txt.  FOLDER is an unpacked full distribution of Pyodide, with
NumPy, SciPy and Matplotlib.  The result, docs/_site/lite, asks for nothing from elsewhere: our wheel and what it needs
stand in the distribution's lock file, so that `import rapkm_lite` installs them, and the notebooks stay as they are.
Unlike the other pages it needs a server, such as python -m http.server -d docs/_site.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib.util
import json
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from email.parser import HeaderParser
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

from pages.lessons import STILL  # noqa: E402

from rapkm_lite.lessons.copies import shipped, student_text  # noqa: E402

# Pure Python, and not always in a distribution.
NEEDED = (
    "ipywidgets", "comm", "widgetsnbextension", "jupyterlab-widgets", "anywidget", "psygnal", "typing-extensions",
    "sympy", "mpmath",
)  # fmt: skip
# What the kernel and the package ask the distribution for.
BROUGHT = "micropip", "packaging", "numpy", "scipy", "matplotlib"
PLUGIN = "@jupyterlite/pyodide-kernel-extension:kernel"
SITE = {
    "jupyter-lite-schema-version": 0,
    "jupyter-config-data": {"litePluginSettings": {PLUGIN: {"pyodideUrl": "./static/pyodide/pyodide.js"}}},
}
FIRST = "00_start_here"
FROM_DISK = """\
if (location.protocol === "file:") for (const link of document.querySelectorAll(".on-wide, .on-narrow"))
  link.onclick = () => alert("Lessons that run need a server: python -m http.server, in this site's folder.") ?? false;
"""
MINUTE = "the first start takes a minute"
SETTINGS = {"@jupyterlab/notebook-extension:tracker": {"windowingMode": "none"}}


def lacking(pyodide: Path) -> list[str]:
    """What a distribution must have and does not have; its core, without packages, is not enough."""
    missing = [name for name in ("pyodide.js", "pyodide-lock.json") if not (pyodide / name).is_file()]
    if missing:
        return missing
    packages = json.loads((pyodide / "pyodide-lock.json").read_text(encoding="utf-8")).get("packages", {})
    return [name for name in BROUGHT if not (pyodide / packages.get(name, {}).get("file_name", "/")).is_file()]


def run(*command: object) -> None:
    subprocess.run([str(part) for part in command], check=True)


def entry(wheel: Path) -> dict:
    """The entry of a pure Python wheel in the lock file of Pyodide."""
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        metadata = next(name for name in names if name.endswith(".dist-info/METADATA"))
        head = HeaderParser().parsestr(archive.read(metadata).decode("utf-8"))
    required = [r for r in head.get_all("Requires-Dist", []) if "extra ==" not in r and "python_version" not in r]
    tops = {
        name.split("/")[0] for name in names if name.count("/") and ".dist-info" not in name and ".data" not in name
    }
    return {
        "name": canonical(head["Name"]),
        "version": head["Version"],
        "file_name": wheel.name,
        "install_dir": "site",
        "sha256": hashlib.sha256(wheel.read_bytes()).hexdigest(),
        "package_type": "package",
        "imports": sorted(tops),
        "depends": sorted({canonical(re.match(r"[\w.-]+", r)[0]) for r in required}),
        "unvendored_tests": False,
    }


def canonical(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def distribution(source: Path, target: Path) -> None:
    """A copy of a Pyodide distribution whose lock file knows our wheel and what it needs."""
    shutil.copytree(source, target)
    lock = json.loads((target / "pyodide-lock.json").read_text(encoding="utf-8"))
    packages = lock["packages"]
    with tempfile.TemporaryDirectory() as folder:
        run(sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", folder, ROOT)
        missing = [name for name in NEEDED if name not in packages]
        if missing:
            # Some also come compiled for the machine that builds; a browser wants the pure ones.
            pure = "--only-binary=:all:", "--platform=any", "--implementation=py", "--abi=none", "--python-version=3.12"
            run(sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", *pure, "--dest", folder, *missing)
        added = {}
        for wheel in sorted(Path(folder).glob("*.whl")):
            shutil.copy(wheel, target)
            row = entry(wheel)
            added[row["name"]] = row
    packages.update(added)
    for row in added.values():
        # The kernel brings IPython and the rest itself.
        row["depends"] = [name for name in row["depends"] if name in packages]
    # The widgets come with the package, whose explorers need them; SymPy too, which lesson 12 needs inside the package.
    packages["rapkm-lite"]["depends"].append("sympy")
    text = json.dumps(lock, indent=None, separators=(",", ":"))
    (target / "pyodide-lock.json").write_text(text, encoding="utf-8")


def ways(lite: str, lesson: str, words: str) -> str:
    """A link to a lesson that runs: JupyterLab, or on a narrow screen, where it leaves no room, the notebook alone."""
    place = f"index.html?path={lesson}.ipynb"
    links = (
        f'<a class="{screen}" href="{lite}/{form}/{place}">{words}</a>'
        for screen, form in (("on-wide", "lab"), ("on-narrow", "notebooks"))
    )
    return "".join(links) + f"<script>{FROM_DISK}</script>"


def link(lite: Path) -> None:
    """The pages of the site around `lite` lead to the lessons that run in it."""
    site = lite.parent
    start = ways(lite.name, FIRST, f"Run the lessons <small>({MINUTE})</small>")
    first = f"<p>{ways(lite.name, FIRST, 'Run lesson 00 here')}, in this browser; {MINUTE}.</p>"
    places = {
        site / "index.html": ('<a href="run.html">Run the lessons</a>', start),
        site / "run.html": ("<!-- here -->", first),
    }
    for notebook in (lite / "files").glob("*.ipynb"):
        what = "dashboard" if notebook.stem == "dashboard" else "lesson"
        here = ways(f"../{lite.name}", notebook.stem, f"Run this {what} in the browser")
        still = f"<p>{here}; {MINUTE}. On this page pictures are still, there they answer.</p>"
        places[site / f"lessons/{notebook.stem}.html"] = STILL, still
    for page, (old, new) in places.items():
        if page.exists():
            page.write_text(page.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pyodide", type=Path, required=True, help="folder with pyodide.js and pyodide-lock.json")
    parser.add_argument("--output", type=Path, default=HERE / "_site/lite", help="an empty folder, or one made before")
    options = parser.parse_args()
    if missing := lacking(options.pyodide):
        whole = "an unpacked full distribution of Pyodide"
        parser.error(f"--pyodide {options.pyodide}: no {', '.join(missing)} there; allowed: {whole}")
    if not importlib.util.find_spec("jupyterlite_core"):
        parser.error("JupyterLite is not installed; needed: python -m pip install -r docs/requirements-lite.txt")
    if options.output.exists() and not (options.output / "jupyter-lite.json").exists():
        if not options.output.is_dir() or any(options.output.iterdir()):
            parser.error(f"--output {options.output}: not made by this; allowed: an empty folder, or one made before")
    shutil.rmtree(options.output, ignore_errors=True)
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        (work / "files").mkdir()
        for path in shipped(ROOT / "notebooks"):
            (work / "files" / path.name).write_text(student_text(path), encoding="utf-8")
        (work / "overrides.json").write_text(json.dumps(SETTINGS), encoding="utf-8")
        (work / "jupyter-lite.json").write_text(json.dumps(SITE), encoding="utf-8")
        lite = [sys.executable, "-m", "jupyterlite_core.app", "build", "--lite-dir", work, "--contents", work / "files"]
        run(*lite, "--output-dir", options.output.resolve())
    distribution(options.pyodide, options.output / "static/pyodide")
    link(options.output)
    size = sum(path.stat().st_size for path in options.output.rglob("*") if path.is_file())
    print(f"{options.output}: {size / 1e6:.0f} MB; to run it: python -m http.server -d {options.output.parent}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
