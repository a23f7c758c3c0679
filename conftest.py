"""What pytest leaves alone, and where it finds its files, from whatever folder it is called."""

import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
LEFT_ALONE = {
    HERE / name
    for name in (
        "conftest.py", "docs", "notebooks/build.py", "notebooks/skeleton", "notebooks/solutions", "notebooks/workshop",
        "tests/bench", "tests/browser/conftest.py", "tests/conftest.py", "tests/site.py", "tests/user_script.py",
    )
}  # fmt: skip


def pytest_ignore_collect(collection_path):
    return True if collection_path in LEFT_ALONE else None


@pytest.fixture(autouse=True)
def no_figure_stays_open():
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")


def pytest_configure(config):
    config.option.nbval_sanitize_with = str(HERE / "tests" / "nbval-sanitize.cfg")
