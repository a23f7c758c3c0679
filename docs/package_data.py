"""Build hook of pyproject.toml: data files and the students' lessons, without outputs, go into the wheel."""

import importlib.util
import tempfile
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class PackageData(BuildHookInterface):
    """An editable install finds both in the checkout; a wheel takes the lessons from a temporary folder."""

    def initialize(self, version, build_data):
        self.folder = tempfile.TemporaryDirectory()
        if version == "editable":
            return
        root, added = Path(self.root), build_data["force_include"]
        for path in sorted([*(root / "data").rglob("*.toml"), *(root / "data").rglob("*.csv")]):
            added[str(path)] = f"rapkm_lite/{path.relative_to(root).as_posix()}"
        spec = importlib.util.spec_from_file_location("copies", root / "rapkm_lite/lessons/copies.py")
        copies = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(copies)
        for path in copies.shipped(root / "notebooks"):
            target = Path(self.folder.name, path.name)
            target.write_text(copies.student_text(path), encoding="utf-8", newline="\n")
            added[str(target)] = f"rapkm_lite/notebooks/{path.name}"

    def finalize(self, version, build_data, artifact_path):
        self.folder.cleanup()
