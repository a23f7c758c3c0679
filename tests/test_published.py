"""The numbers of the lessons, from what the package computes today, against the table that is kept."""

import json
from pathlib import Path

import published
import pytest

KEPT = json.loads(published.TABLE.read_text(encoding="utf-8"))
NUMBERS = {(n.lesson, n.name): n for n in published.numbers()}


def lesson(number):
    """All that the authors wrote in a lesson with its solutions, outputs aside."""
    notebooks = Path(__file__).parents[1] / "notebooks"
    file = next((notebooks / "solutions").glob(f"{number}_*.ipynb"), None) or next(notebooks.glob(f"{number}_*.ipynb"))
    return "\n".join("".join(cell["source"]) for cell in json.loads(file.read_text(encoding="utf-8"))["cells"])


def test_the_table_holds_the_numbers_of_the_script():
    assert [(row["lesson"], row["name"]) for row in KEPT] == list(NUMBERS)
    assert {row["lesson"] for row in KEPT} == {f"{k:02}" for k in range(13)}


@pytest.mark.parametrize("row", KEPT, ids=lambda row: f"{row['lesson']}: {row['name']}")
def test_a_published_number_is_what_the_package_computes(row):
    value = float(NUMBERS[row["lesson"], row["name"]].compute())
    assert abs(value - row["value"]) <= row["tolerance"] <= 1e-3 * abs(row["value"])


@pytest.mark.parametrize("row", [row for row in KEPT if "quoted" in row], ids=lambda row: row["quoted"])
def test_a_lesson_quotes_its_number(row):
    assert row["quoted"] in lesson(row["lesson"])


def test_what_another_processor_rounds_otherwise_stays_as_it_was():
    old = {"lesson": "03", "name": "a", "value": 1.0, "tolerance": 1e-3}
    for moved, wanted in ((1e-9, 1.0), (2e-3, 1.002)):
        assert published.kept([old | {"value": 1.0 + moved}], [old])[0]["value"] == wanted
    assert published.kept([old], []) == [old]
