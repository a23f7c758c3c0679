"""A headless Chromium for the browser tests.

They are skipped where playwright or a Chromium is missing, unless the environment variable RAPKM_LITE_BROWSER is 1.
"""

import os
import shutil

import pytest
from lab import ARGUMENTS, NOTEBOOKS, find_browser, server

DEMANDED = os.environ.get("RAPKM_LITE_BROWSER") == "1"


def missing(what: str):
    """Skip with the reason, or fail where the browser tests are demanded."""
    (pytest.fail if DEMANDED else pytest.skip)(f"{what}; the browser tests need playwright and a Chromium")


@pytest.fixture(scope="session")
def laboratory(tmp_path_factory):
    """One JupyterLab for all tests, on a copy of the notebooks: (its folder, url, token)."""
    folder = tmp_path_factory.mktemp("lab")
    shutil.copytree(NOTEBOOKS, folder / "root", ignore=shutil.ignore_patterns(".ipynb_checkpoints"))
    with server(folder / "root", folder) as (url, token):
        yield folder / "root", url, token


# No longer than a module: playwright's event loop would stand in the way of the tests that run notebooks.
@pytest.fixture(scope="module")
def browser():
    """A headless Chromium."""
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        missing("playwright is not installed (python -m pip install playwright)")
    path = find_browser()
    if path is None:
        missing("no chromium, chromium-browser or google-chrome on the path (apt-get install chromium)")
    with sync_playwright() as p:
        browser = p.chromium.launch(executable_path=path, args=ARGUMENTS)
        yield browser
        browser.close()
