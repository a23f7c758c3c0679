"""A new lesson: from the skeleton to green tests in a copy of the repository."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]


def run(folder, *command):
    environment = os.environ | {"PYTHONPATH": str(folder)}
    done = subprocess.run([sys.executable, *command], cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return done.stdout


def test_a_lesson_made_from_the_skeleton_is_green(tmp_path):
    # With what is compiled already; a file that another process is writing at the moment has a passing name.
    made = ("*.tmp.*", "*.pyc.*", ".ipynb_checkpoints", "_site", "_work")
    skipped = shutil.ignore_patterns(*made, "[!0]*.ipynb", "0[!0]*.ipynb")
    for name in ("rapkm_lite", "notebooks", "tests", "data", "docs"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=skipped)
    for name in ("README.md", "conftest.py", "pyproject.toml"):
        shutil.copy(ROOT / name, tmp_path / name)
    run(tmp_path, "notebooks/build.py", "new", "97_turning_drives")
    run(tmp_path, "notebooks/build.py", "97")
    tests = [f"tests/test_{name}.py" for name in ("lessons", "figures", "answers", "docs")]
    options = ("-q", "-n0", "-p", "no:cacheprovider", "-k", "97 or figures_is_generated")
    said = run(tmp_path, "-m", "pytest", *options, *tests, "notebooks")
    assert "passed" in said and "failed" not in said
    assert (
        run(tmp_path, "-c", "from rapkm_lite import plotting; print(plotting.plot_turning_97.__module__)").strip()
        == "rapkm_lite.lessons.lesson97.figures"
    )
