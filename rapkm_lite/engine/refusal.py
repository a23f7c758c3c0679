"""Why a law does not compile, in one sentence: the compiler's words without its colours, names of steps and types."""

from __future__ import annotations

import dis
import linecache
import re
from pathlib import Path

# What a compiled law finds in `at`.
MATRICES = "x xd q qd F F_dot A A_T_pinv J J_dot N N_dot G C Q minimal redundant A_tilde A_tilde_T_pinv".split()

# What Numba says, what is said instead; the first that fits.
_WORDS = (
    (r"name '(\w+)': Cannot determine Numba type of <class 'function'>", r"\1 is a function without @numba.njit"),
    (r"name '(\w+)': Cannot determine Numba type of <class '(?:\w+\.)*(\w+)'>", r"\1 is of type \2"),
    (r"use of a (?:reflected )?(\w+)\(.*?type, assigned to variable '(\w+)'", r"\2 is a \1; an array would be known"),
    (r"= freevar\((\w+): \[", r"\1 is a list; an array would be known"),
    (r"NameError: (name '\w+' is not defined)", r"\1"),
    (r"Unknown attribute '(\w+)' of type Matrices.+", rf"at has no \1 here, but {', '.join(MATRICES)}"),
    (r"Unknown attribute '(\w+)' of type (.+)", r"\2 has no \1"),
    (r"Cannot unify (.+) and (.+) for '([^.'$]+)(?:\.\d+)?'", r"\3 is once \1 and once \2"),
    (r"unsupported NumPy function '([\w.]+)'", r"\1 is not known here"),
    (r"No implementation of function [^\0]*?>>> (.+)", r"\1 is not known here"),
    (r"Cannot bind 'args=", "arguments after * are not known here"),
    (r"Unsupported context manager", "such a with statement is not known here"),
    (r"(?:Use of )?(.+ not supported yet|unsupported opcode \(\w+\))", r"\1"),
)
_TYPES = (
    (r"Wanted\([^()]*(?:\([^()]*\)[^()]*)*\)", "d"),
    (r"Matrices\(.*\)", "at"),
    (r"[Aa]rray\(\w+, (\d)d, \w+(?:, [^()]*)?\)", "an array"),
    (r"Literal\[int\]\((.*?)\)", r"\1"),
    (r"Literal\[str\]\(.*?\)|unicode_type", "a string"),
    (r"\b(?:float|int|uint)\d+\b", "a number"),
    (r"\bcomplex\d+\b", "a complex number"),
    (r"\b(?:reflected )?list\(.*\)(?:<iv=.*>)?", "a list"),
    (r"\b(?:reflected )?set\(.*\)", "a set"),
    (r"DictType\[.*", "a dictionary"),
    (r"(?:readonly )?bytes\(.*\)", "bytes"),
    (r"\bnone\b", "nothing"),
)


def refusal(function, error: Exception, answer=None) -> str:
    """The sentence on a law that does not compile; `answer` is the type it returns, where that was still found."""
    text = re.sub(r"\x1b\[[0-9;]*m", "", str(error))
    return f"{_what(text) if answer is None else _returned(answer)}{_where(function, text)}"


def _what(text: str) -> str:
    for pattern, words in _WORDS:
        found = re.search(pattern, text)
        if found:
            return _plain(found.expand(words))
    lines = [line.strip() for line in text.splitlines()]
    return _plain(next((line for line in lines if line and not line.startswith("Failed in")), "no reason given"))[:160]


def _plain(words: str) -> str:
    for pattern, plain in _TYPES:
        words = re.sub(pattern, plain, words)
    return words


def _returned(answer) -> str:
    """What it returns instead of torques."""
    kind = str(answer)
    if kind == "none":
        return "it returns nothing: is a return missing?"
    if "generator" in kind:
        return "it yields: a return is needed"
    if "bool" in kind:
        return "it returns truth values"
    size = re.match(r"array\((\w+), (\d)d", kind)
    if size and "complex" in kind:
        return "it returns complex numbers"
    return f"it returns an array with {size[2]} dimensions" if size else f"it returns {_plain(kind)[:60]}"


def _where(function, text: str) -> str:
    """The line of the user's file that the compiler stopped at, as far as it is known."""
    code = getattr(function, "__code__", None)
    if code is None:
        return ""
    undefined = re.search(r"NameError: name '(\w+)' is not defined", text)
    lines = [int(n) for file, n in re.findall(_PLACE, text) if Path(file).name == Path(code.co_filename).name]
    if undefined:
        marks = (step.positions for step in dis.get_instructions(function) if step.argval == undefined[1])
        lines = [mark.lineno for mark in marks if mark is not None and mark.lineno is not None]
    if not lines:
        return ""
    line = linecache.getline(code.co_filename, lines[0]).strip()
    return f", line {lines[0]} of {Path(code.co_filename).name}{f': {line}' if line else ''}"


_PLACE = r"""(?:File "|Raised from |at )([^"\n]+?)(?:", line | \()(\d+)"""
