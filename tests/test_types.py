"""What an editor tells users: pyright (basic) finds no error in the package, the README, the lessons, a user's script.

Skipped where pyright is not installed (``python -m pip install "pyright[nodejs]"``).
"""

import json
import os
import re
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

import nbformat
import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "rapkm_lite"
ROOMS = sorted({path.relative_to(PACKAGE).parts[0] for path in PACKAGE.rglob("*.py")})
SOLVED = sorted((ROOT / "notebooks" / "solutions").glob("*.ipynb"))
DONE = {path.name for path in SOLVED}
LESSONS = [*SOLVED, *(p for p in sorted((ROOT / "notebooks").glob("*.ipynb")) if p.name not in DONE)]
# A cell may define a name anew and end with a value to show.
CELLS = {"reportRedeclaration": "none", "reportUnusedExpression": "none"}


def test_the_users_script_runs():
    script = ROOT / "tests" / "user_script.py"
    environment = os.environ | {"MPLBACKEND": "agg"}
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, cwd=ROOT, env=environment)
    assert done.returncode == 0, done.stderr


@pytest.fixture(scope="module")
def errors(tmp_path_factory):
    """Sentences of pyright by room of the package or name of a script, from one run over both."""
    pytest.importorskip("pyright")
    folder = tmp_path_factory.mktemp("scripts").resolve()
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.S)
    (folder / "README.py").write_text("\n".join(blocks), encoding="utf-8")
    (folder / "user_script.py").write_text((ROOT / "tests" / "user_script.py").read_text(encoding="utf-8"))
    for path in LESSONS:
        cells = [c.source for c in nbformat.read(path, as_version=4).cells if c.cell_type == "code"]
        text = "\n\n".join(["from IPython.display import display", *cells])
        (folder / f"lesson_{path.stem}.py").write_text(text, encoding="utf-8")
    config = folder / "pyrightconfig.json"
    roots = [{"root": str(folder), "extraPaths": [str(ROOT)], **CELLS}, {"root": str(ROOT)}]
    # What is to be read has to be named relative to the configuration.
    settings = {"include": [os.path.relpath(PACKAGE, folder), "."], "executionEnvironments": roots}
    config.write_text(json.dumps(settings | {"extends": str(ROOT / "pyproject.toml")}), encoding="utf-8")
    command = [sys.executable, "-m", "pyright", "--outputjson", "--pythonpath", sys.executable, "-p", str(config)]
    said = json.loads(subprocess.run(command, capture_output=True, text=True).stdout)
    assert said["summary"]["filesAnalyzed"] >= len(list(PACKAGE.rglob("*.py"))) + len(LESSONS) + 2
    found = defaultdict(list)
    for item in said["generalDiagnostics"]:
        if item["severity"] == "error":
            path, line = Path(item["file"]), item["range"]["start"]["line"] + 1
            first = path.relative_to(PACKAGE).parts[0] if path.is_relative_to(PACKAGE) else path.stem
            found[first].append(f"{path.name}:{line}: {item['message']}")
    return found


@pytest.mark.parametrize("room", ROOMS)
def test_package_is_sound(room, errors):
    assert not errors[room], "\n".join(errors[room])


@pytest.mark.parametrize("name", ["README", "user_script", *(f"lesson_{path.stem}" for path in LESSONS)])
def test_what_users_write_is_sound(name, errors):
    assert not errors[name], "\n".join(errors[name])
