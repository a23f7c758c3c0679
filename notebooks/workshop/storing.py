"""The stored form of a notebook: what a reader sees, with answers out of sight, and the student's copy of a lesson."""

from __future__ import annotations

import ast
import re

import nbformat

from .pictures import describe

WIDGET = "application/vnd.jupyter.widget-view+json"
HIDDEN, DEEPER, SCENE = "hide-output", "dig-deeper", "hide-input"
# JupyterLab shows the first line of a hidden output; tests/nbval-sanitize.cfg takes this one out of comparisons.
COVER = "The answer is here; open it when you have your own.\n"
_SOLUTION = re.compile(r"^([ \t]*)### BEGIN SOLUTION *\n(.*?)^[ \t]*### END SOLUTION *\n?", re.M | re.S)
_DEEPER = re.compile(r"#+ Dig deeper\b")


def blank(source: str) -> str:
    """A code cell with its solutions taken out."""

    def stub(match: re.Match) -> str:
        indent, body = match.groups()
        if indent:
            return f"{indent}raise NotImplementedError\n"
        names = dict.fromkeys(re.findall(r"^(\w+) *=[^=]", body, re.M))
        return "".join(f"{name} = ...\n" for name in names)

    return _SOLUTION.sub(stub, source if source.endswith("\n") else source + "\n").rstrip("\n")


def _states(node: ast.AST) -> bool:
    """Does a check say a number of its own? Indices, tolerances and 0 are none."""
    if isinstance(node, ast.Constant):
        return isinstance(node.value, (int, float)) and node.value != 0
    if isinstance(node, ast.Subscript):
        return _states(node.value)
    return not isinstance(node, ast.keyword) and any(map(_states, ast.iter_child_nodes(node)))


def unchecked(source: str) -> str:
    """The code of a hidden answer without the assertions that tell it; comparisons of two results stay."""
    lines, tree = source.splitlines(keepends=True), ast.parse(source)
    for node in ast.walk(tree):
        call = node.value if isinstance(node, ast.Expr) else None
        tested = isinstance(call, ast.Call) and ast.unparse(call.func).startswith("np.testing.assert_")
        if isinstance(node, ast.Assert) or (tested and _states(node)):
            lines[node.lineno - 1 : node.end_lineno] = [""] * (node.end_lineno - node.lineno + 1)
    text = "".join(lines).rstrip("\n")
    last, _, _ = ast.unparse(ast.parse(text).body[-1:]).partition("(")
    # A notebook shows the value of a last line, such as the axes of a picture, which was not the last before.
    drawn = last.startswith("plotting.plot") and not text.endswith(";")
    return text + ";" if drawn and text != source.rstrip("\n") else text


def student(notebook: nbformat.NotebookNode) -> nbformat.NotebookNode:
    """The student's copy of a solved lesson, without outputs; links are meant from its folder, one level up."""
    copy = nbformat.reads(nbformat.writes(notebook), as_version=4)
    for cell in copy.cells:
        if cell.cell_type == "code":
            source = blank(cell.source)
            cell.source = unchecked(source) if HIDDEN in cell.metadata.get("tags", []) else source
            cell.outputs, cell.execution_count = [], None
        else:
            cell.source = cell.source.replace("](../", "](")
    return copy


def kept(cell: nbformat.NotebookNode) -> dict:
    """The metadata of a cell that are stored: tags, words of its pictures, and what JupyterLab hides or folds."""
    tags = [tag for tag in cell.metadata.get("tags", []) if tag != DEEPER]
    stored: dict = {}
    if cell.cell_type == "markdown" and _DEEPER.match(cell.source):
        stored["jp-MarkdownHeadingCollapsed"] = True
        tags.append(DEEPER)
    if cell.cell_type == "code" and {HIDDEN, SCENE} & set(tags):
        closed = {"outputs_hidden": HIDDEN, "source_hidden": SCENE}
        stored["jupyter"] = {what: True for what, tag in closed.items() if tag in tags}
    if tags:
        stored["tags"] = tags
    if cell.metadata.get("alt"):
        stored["alt"] = cell.metadata["alt"]
    return stored


def cover(cell: nbformat.NotebookNode) -> None:
    """Begin the outputs of a hidden cell with a line that is not the answer."""
    first = cell.outputs[0] if cell.outputs else None
    if first is not None and first.get("name") == "stdout":
        first.text = COVER + first.text.removeprefix(COVER)
    elif first is not None:
        cell.outputs.insert(0, nbformat.v4.new_output("stream", name="stdout", text=COVER))


def joined(outputs: list) -> list:
    """The outputs in their order, with printed lines that follow one another as one."""
    found: list = []
    for output in outputs:
        if found and output.get("name") is not None and found[-1].get("name") == output.name:
            found[-1].text += output.text
        else:
            found.append(output)
    return found


def bare_widget(output: nbformat.NotebookNode) -> bool:
    """True for a widget with nothing but its repr beside it, of which nothing is left without a kernel."""
    data = output.get("data")
    # A line for somebody who waits is emptied at its end.
    return data == {} or (bool(data) and WIDGET in data and set(data) <= {WIDGET, "text/plain"})


def tidy(notebook: nbformat.NotebookNode) -> None:
    """Keep what a reader sees of a notebook that has just run: no widget state, time stamps or versions."""
    notebook.metadata = nbformat.from_dict(
        {
            "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
            "language_info": {"name": "python"},
        }
    )
    for number, cell in enumerate(notebook.cells):
        cell.id = f"cell-{number:02d}"
        cell.metadata = nbformat.from_dict(kept(cell))
        if cell.cell_type == "code":
            cell.outputs = joined([o for o in cell.outputs if not bare_widget(o)])
            for output in cell.outputs:
                output.get("data", {}).pop(WIDGET, None)
            describe(cell)
            if HIDDEN in cell.metadata.get("tags", []):
                cover(cell)
