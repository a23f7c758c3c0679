"""Build the site into docs/_site: python docs/build.py, after python -m pip install -r docs/requirements.txt.

Needs no network.  --lessons takes the notebooks from another folder; --strict fails on a warning.
"""

from __future__ import annotations

import argparse
import importlib.util
import re
import shutil
import sys
import tempfile
from importlib.metadata import files
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
sys.path.insert(0, str(HERE))

from pages import drawing, lessons, reference, start  # noqa: E402

WORK, SITE = HERE / "_work", HERE / "_site"
PLAN = """\
# rapkm_lite

Three motors drive a planar robot that needs only two. The extra one makes it stiffer, and lets the drives fight each
other as soon as their encoders disagree by a few milliradians. These lessons show the fight, compute it, filter it
away, and control the robot where minimal coordinates fail.

<a href="index.html">Take the machine in your hands</a> first: the start page needs no installation.

```{{toctree}}
:caption: Lessons
:maxdepth: 1

run
{lessons}
Dashboard <lessons/dashboard>
lessons/solutions/index
```

```{{toctree}}
:caption: Look up
:maxdepth: 1

lessons/equations
lessons/errata
develop/glossary
reference/index
```
{teaching}
```{{toctree}}
:caption: Develop
:maxdepth: 1

{develop}
```
"""
RUN = """\
# Run the lessons

<!-- here -->
{hosted}
On your own machine, in a clone of the repository, with Python 3.11 or newer:

    python -m pip install -r requirements.txt
    python -m jupyter lab notebooks/00_start_here.ipynb

This takes 870 MB, with compiler and tests. `python -m pip install . jupyterlab` makes do with 570 MB,
without SymPy, which lessons 01 and 12 need, and without Numba: a run takes 0.3 s instead of 1 ms.
"""
SOLUTIONS = """\
# Solutions

Open one after you have tried: each page is a lesson with its exercises solved and run.

```{{toctree}}
:maxdepth: 1

{pages}
```
"""


def write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def prepare(notebooks: Path, repository: str) -> None:
    """All sources of the site, in docs/_work."""
    shutil.rmtree(WORK, ignore_errors=True)
    index = (notebooks / "equations.md").read_text(encoding="utf-8")
    where = lessons.lesson_of_equation(index)
    names = sorted(path.stem for path in notebooks.glob("[0-9][0-9]_*.ipynb"))
    for name in [*names, "dashboard"]:
        anchors = [anchor for anchor, lesson in where.items() if lesson == name]
        write(WORK / f"lessons/{name}.ipynb", lessons.lesson_page(notebooks / f"{name}.ipynb", anchors))
    solved = sorted(path.stem for path in (notebooks / "solutions").glob("[0-9][0-9]_*.ipynb"))
    for name in solved:
        page = lessons.lesson_page(notebooks / f"solutions/{name}.ipynb", [], "../")
        write(WORK / f"lessons/solutions/{name}.ipynb", page)
    write(WORK / "lessons/solutions/index.md", SOLUTIONS.format(pages="\n".join(solved)))
    write(WORK / "lessons/equations.md", lessons.index_page(index, reference.page_of()))
    write(WORK / "lessons/errata.md", lessons.errata_page((notebooks / "errata.md").read_text(encoding="utf-8")))
    # In the repository a README, on the site the first page for teachers, in a folder beside the teaching pages.
    readme = next(folder / "README.md" for folder in (notebooks, ROOT / "notebooks") if (folder / "README.md").exists())
    instructor = readme.read_text(encoding="utf-8").replace("](../docs/teaching/", "](../teaching/")
    write(WORK / "lessons/instructor.md", lessons.linked(instructor))
    reference.write(WORK / "reference")
    develop = pages(HERE, "develop")
    teaching = pages(HERE / "teaching", "teaching")
    taught = "\n".join(["lessons/instructor", *teaching])
    plan = f"\n```{{toctree}}\n:caption: Teach\n:maxdepth: 1\n\n{taught}\n```\n"
    listed = "\n".join(f"lessons/{name}" for name in names)
    write(
        WORK / "contents.md",
        PLAN.format(lessons=listed, teaching=plan, develop="\n".join(develop)),
    )
    write(WORK / "run.md", RUN.format(hosted=hosted(repository)))


def hosted(repository: str) -> str:
    """Links to sessions on other people's machines, where the repository is known."""
    if not repository:
        return ""
    places = {
        "Binder": f"https://mybinder.org/v2/gh/{repository}/HEAD?urlpath=lab/tree/notebooks/00_start_here.ipynb",
        "Colab": f"https://colab.research.google.com/github/{repository}/blob/main/docs/hosted/colab.ipynb",
        "Codespaces": f"https://codespaces.new/{repository}",
    }
    return "\nOn other people's machines: " + ", ".join(f"[{name}]({link})" for name, link in places.items()) + ".\n"


def pages(folder: Path, name: str) -> list[str]:
    """Copy the pages of a folder; links to files that are no pages lose their link."""
    made = []
    for path in sorted(folder.glob("*.md")):
        text = lessons.linked(path.read_text(encoding="utf-8"))
        text = re.sub(r"```mermaid\n(.*?)```", drawn, text, flags=re.S)
        write(WORK / f"{name}/{path.name}", lessons.without_dead_links(text, folder, WORK / name))
        made.append(f"{name}/{path.stem}")
    return [page for page in made if page != "develop/glossary"]


def drawn(diagram: re.Match[str]) -> str:
    """The block of a diagram as a picture in the page."""
    return f'```{{raw}} html\n<div class="wide-picture">{drawing.svg(diagram[1])}</div>\n```'


def mathjax() -> Path:
    """The one file of MathJax that the pages load."""
    found = [path for path in files("django-static-mathjax") or [] if path.match("es5/tex-svg.js")]
    return Path(found[0].locate())


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--lessons", type=Path, default=ROOT / "notebooks", help="folder of the notebooks")
    parser.add_argument("--repository", default="", help="owner/name on GitHub, for links to hosted sessions")
    parser.add_argument("--strict", action="store_true", help="fail on a warning")
    options = parser.parse_args()
    if not (options.lessons / "equations.md").exists():
        parser.error(f"--lessons {options.lessons}: no equations.md there; allowed: a copy of notebooks")
    if not importlib.util.find_spec("sphinx"):
        parser.error("Sphinx is not installed; needed: python -m pip install -r docs/requirements.txt")
    from sphinx.cmd.build import build_main

    prepare(options.lessons.resolve(), options.repository)
    shutil.rmtree(SITE, ignore_errors=True)
    with tempfile.TemporaryDirectory() as doctrees:
        strict = ["-W", "--keep-going"] if options.strict else []
        arguments = ["-q", "-b", "html", "-c", str(HERE), "-d", doctrees, *strict, str(WORK), str(SITE)]
        status = build_main(arguments)
    shutil.copy(mathjax(), SITE / "_static/tex-svg.js")
    (SITE / "index.html").write_text(start.page("contents.html", "run.html"), encoding="utf-8")
    size = sum(path.stat().st_size for path in SITE.rglob("*") if path.is_file())
    print(f"{SITE}: {len(list(SITE.rglob('*.html')))} pages, {size / 1e6:.1f} MB")
    return status


if __name__ == "__main__":
    sys.exit(main())
