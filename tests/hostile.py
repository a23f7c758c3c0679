"""Hostile calls made from signatures: every parameter of every public name gets what nobody should pass.

`cases` makes the calls of a module, `judge` says how one ended:

clear     refused by a sentence that names the argument, shows what it got and says what is allowed
half      refused by a sentence that lacks one of these
unclear   refused by an exception of the machinery below (AttributeError, LinAlgError, IndexError ...)
accepted  answered, with finite numbers
nan       answered with NaN or infinity
hang      no answer within two minutes of processor time

Tests take a seeded sample that holds every argument of every function.  All calls, some 34 000, by hand:
``python -m tests.hostile [--each K] [--seed S] [--show] [module ...]``; exit status 1 when one hangs or answers with
NaN, or when less of the refusals are clear than LEAST says: 98 % in the core, 90 % for pictures and explorers.
"""

from __future__ import annotations

import argparse
import importlib
import inspect
import random
import re
import signal
import sys
import warnings
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import matplotlib.pyplot as plt
import numpy as np

import rapkm_lite as rk
from rapkm_lite import explore
from rapkm_lite.lessons.lesson12 import four_rrr

# Share of the refusals that has to be clear.
LEAST = {"rapkm_lite": 0.98, "rapkm_lite.plotting": 0.9, "rapkm_lite.explore": 0.9}
ROBOT = rk.load()
PATH = rk.triangle(ROBOT, duration=0.3, dt=0.01)
Q = rk.inverse_kinematics(ROBOT, [0.02, 0.05])
QD = 0.1 * rk.nullspace_projector(ROBOT, Q) @ Q
RUN = rk.simulate(ROBOT, rk.PD(7.05, 0.225), PATH, [4e-3, -2e-3, 5e-3])
A = rk.control_matrix(ROBOT, Q)
A_TILDE = rk.redundant_control_matrix(ROBOT, Q)
SENSORS = rk.Sensors([4e-3, -2e-3, 5e-3])
CONTROLLER = rk.Controller(rk.PD(7.0, 0.2), ROBOT)
STUDY = rk.sweep(ROBOT, rk.PD(7.05, 0.225), PATH, 1e-3 * np.eye(3))
LOG = rk.data_path("mystery_runs/gain.csv")
X = np.linspace(-0.1, 0.1, 12)
ALONG = np.linspace(0.1, 1.0, 12)
SWITCHED = rk.simulate(ROBOT, rk.SwitchedCTC(400.0, 40.0), PATH)


PICTURE = explore.Picture({"a": {"xlim": (-0.3, 0.3), "ylim": (-0.3, 0.3)}})


def draw(picture, gain):
    picture.line("a", [0, 1], [0, gain])


def pd(t, q_a, qd_a, desired):
    return -7.0 * (q_a - desired.q_a) - 0.2 * (qd_a - desired.qd_a)


class Case(NamedTuple):
    name: str
    parameter: str
    value: Any
    call: Any


SWING = four_rrr.Motion(np.arange(3.0), np.zeros((3, 3)), *3 * [np.zeros((3, 9))])

# A value that works, by the name of the parameter: one word, one thing.
GOOD: dict[str, Any] = {
    "robot": ROBOT, "model": ROBOT, "trajectory": PATH, "run": RUN, "q": Q, "qd": QD, "qdd": 0.2 * Q,
    "x": [0.02, 0.05], "xd": [0.01, 0.0], "xdd": [0.0, 0.1], "q_a": Q[:3], "qd_a": np.zeros(3), "c": np.zeros(3),
    "A": A, "A_tilde": A_TILDE, "F": rk.orthogonal_complement(ROBOT, Q), "K": 7.0, "K_P": 7.0, "K_D": 0.2, "K_I": 1.0,
    "W": [1.0, 2.0, 3.0], "offset": [4e-3, -2e-3, 5e-3], "offsets": 1e-3 * np.eye(3), "wrench": [0.1, 0.0],
    "independent": (0, 1), "rows": (0, 1), "pair": (0, 1), "pairs": [(0, 1), (0, 2)], "rule": "sigma_min",
    "measure": "sigma_min", "mode": [1, 1, 1], "n": 12, "box": (-0.1, 0.1, -0.1, 0.1), "tolerance": 1e-9,
    "iterations": 20, "guess": [0.0, 0.0], "e": 0.01 * np.ones(6), "ed": np.zeros(6), "eps": 0.0, "quantum": 3e-3,
    "friction": 0.02, "torque": 0.1, "prestress": np.zeros(3), "dt": 1e-2, "t": PATH.t, "duration": 0.3, "side": 0.2,
    "radius": 0.05, "centre": (0.0, 0.0), "angle": 0.1, "rest": 0.0, "turns": 1, "law": rk.PD(7.05, 0.225),
    "corners": [[-0.05, 0.01], [0.05, 0.01], [0.0, 0.05]], "encoder": 2000, "velocity_filter": 0.002, "faults": (),
    "sensors": None, "executor": None, "failed": "raise", "chunk": 2, "progress": False, "name": "testbed",
    "source": "testbed", "pose": "measured", "hysteresis": 1.2, "limit": 0.3, "projected": True, "function": pd,
    "at": "desired", "memory": 2, "drive": 1, "time": 0.1, "start": 0.1, "stop": 0.2, "jump": 1e-3, "n_arms": 3,
    "base": ROBOT.base, "lengths": 0.2, "masses": 0.1, "centers": 0.1, "inertias": 1e-3, "rotor_inertia": 1e-6,
    "resistance": 0.6, "torque_constant": 0.02, "friction_velocity": 0.01, "gravity": (0.0, -9.81), "load": 0.1,
    "arms": (0, 1), "current": (0, 1), "desired": PATH[3], "truth": ([0.0, 0.0], [0.0, 0.0]), "keeper": CONTROLLER,
    "reason": "it was lost", "partial": None, "sweep": None, "timestep": 1e-3, "other": ROBOT, "k": 3, "items": [1, 2],
    "q_a_desired": RUN.q_a,
    # pictures
    "ax": None, "axes": None, "title": "a title", "label": "a label", "labels": True, "alpha": 0.8, "colour": "#112233",
    "margin": 0.1, "i": 1, "milli": True, "vmin": 0.0, "vmax": 1.0, "bar": True, "on_map": False, "ylabel": "y",
    "values": np.ones((12, 12)), "inside": np.ones((12, 12), bool), "modes": rk.working_modes(ROBOT), "marks": None,
    "sigma": np.ones((8, 12, 12)), "forces": np.ones((3, 2)), "newton_per_metre": 5.0, "guaranteed": 0.3,
    "drives": True, "choices": {"a": np.zeros((len(PATH), 3))}, "theory": np.zeros(3), "ratio": ALONG,
    "simulated": ALONG, "theories": {"a": ALONG, "b": ALONG}, "target": 0.5, "jumps": ALONG,
    "log": rk.mystery_run("offset_a"),
    "can_rest": ALONG > 0.5, "magnify": 20.0, "spacing": ALONG, "gap": ALONG, "runs": {"PD": RUN}, "antagonism": False,
    "table": rk.table1(), "functions": {"a": ALONG}, "rate": ALONG,
    "measured": {"a": ALONG}, "predicted": {"a": ALONG}, "zoom": (-0.1, 0.1, -0.1, 0.1),
    "rules": ("printed", "sigma_min"),
    "gains": ALONG, "without": np.ones((12, 3)), "with_filter": np.ones((12, 3)), "antagonistic": ALONG,
    "centres": np.stack(np.meshgrid(X, X), -1), "samples": {"a": ALONG}, "reference": None, "low": [0.0] * 3,
    "high": [1.0] * 3, "readings": np.full((4, 3), 0.5), "names": ["a", "b", "c"], "marked": 0.015,
    "J": rk.constraint_jacobian(ROBOT, Q), "J_dot": rk.constraint_jacobian_dot(ROBOT, Q, 0.1 * Q),
    "frames": ALONG, "seconds": 1.0, "alt": "A hand turns.", "panels": 1, "loops": 2, "poster": -1, "dpi": 40.0,
    "gaps": {"a": ALONG, "b": ALONG}, "poses": {"a": np.stack([Q] * 12), "b": np.stack([Q] * 12)},
    "part": ALONG, "demand": ALONG, "points": {"a": ALONG}, "share": 0.5, "end": [0.05, 0.0],
    "radius_of": lambda A, torque: 0.3, "cube": np.ones((12, 12, 12)), "head": ["law", "error in mm"],
    "picture": PICTURE, "panel": "a", "groups": [([1.0, 2.0, 3.0], {})], "form": ".2f", "width": 0.4,
    "levels": (0.0, 1.0, 2.0), "light": ("#888888", "#EEEEEE"), "dark": ("#777777", "#333333"),
    "options": ["a", "b"], "step": 0.5, "steps": 8, "value": 2.0, "controls": {"gain": explore.slider("K", 1, 9, 1, 5)},
    "G": rk.mass_matrix(ROBOT, Q), "C": rk.coriolis_matrix(ROBOT, Q, 0.1 * Q), "Q": np.zeros(6), "N": 3, "m": 3,
    "F_dot": rk.orthogonal_complement_dot(ROBOT, Q, 0.1 * Q),
    "N_dot": rk.nullspace_projector_dot(ROBOT, Q, 0.1 * Q),
}  # fmt: skip

# Where the same word has another shape.
OTHER: dict[tuple[str, str], Any] = {
    ("copper_loss", "c"): np.zeros((5, 3)),
    ("follow", "x"): PATH.x, ("follow", "xd"): PATH.xd, ("follow", "xdd"): PATH.xdd,
    ("command_filter", "K"): [7.0, 8.0, 9.0], ("data_path", "name"): "testbed.toml", ("mystery_run", "name"): "gain",
    ("SwitchedCTC.pairs", "q"): PATH.q, ("plot_pairs", "run"): SWITCHED, ("pair_measures", "q"): PATH.q,
    ("projector_dot", "J_dot"): rk.constraint_jacobian_dot(ROBOT, Q, 0.1 * Q),
    **{("redundant_terms", "N"): rk.nullspace_projector(ROBOT, Q), ("read_log", "source"): LOG},
    **{("Sweep", n): getattr(STUDY, n) for n in STUDY._fields()},
    **{("Trajectory", n): getattr(PATH, n) for n in ("x", "xd", "xdd", "q", "qd", "qdd", "t")},
    **{("Desired", n): getattr(PATH[3], n) for n in ("x", "xd", "xdd", "q", "qd", "qdd")},
    **{("Run", n): getattr(RUN, n) for n in RUN._fields()},
    **{("Log", n): RUN.q_a for n in ("q_a", "q_a_desired", "c")},
    ("plot_apex", "angle"): [0.0, 0.3, 0.7], ("plot_apex", "sigma"): [0.35, 0.2, 0.0],
    ("plot_apex", "pose"): [0.0, 0.0, 0.59], ("plot_four_legs", "pose"): [0.0, 0.0, 0.1],
    ("plot_length_choice", "lengths"): [0.1, 1.0], ("plot_length_choice", "conditions"): {"centre": [1.0, 7.0]},
    ("plot_length_choice", "special"): ("platform", 0.14),
    ("plot_places", "groups"): {"three": [[0.1, 0.0], [0.0, 0.1], [-0.1, 0.0]]},
    **{("plot_counted", n): ALONG for n in ("t", "gap", "exact")}, ("plot_bias", "names"): ["a"],
    **{("plot_bias", n): [[1e-5, 2e-5]] for n in ("residual", "bias")},
    ("plot_geometry_maps", "models"): {"longer": ROBOT.replace(lengths=0.2002)}, ("plot_geometry_maps", "n"): 9,
    ("plot_model_share", "eps"): ALONG, ("plot_model_share", "share"): ALONG, ("plot_model_share", "t"): ALONG,
    ("plot_model_share", "leak"): ALONG, ("plot_hunting_maps", "gains"): [1.0, 7.0],
    ("plot_hunting_maps", "counts"): [500.0, 2000.0], ("plot_hunting_maps", "jumps"): {"slow": np.ones((2, 2))},
    ("plot_saturation", "limit"): ALONG, ("plot_saturation", "shifts"): {"PD": ALONG},
    ("loop_frequencies", "stiffness"): 2e3 * np.eye(2), ("plot_loop_frequencies", "springs"): {"PD": 2e3 * np.eye(2)},
    **{(name, "path"): PATH for name in ("loop_frequencies", "plot_loop_frequencies")},
    ("plot_loop_frequencies", "nominal"): 5.0, ("plot_law_bands", "names"): ["PD"],
    ("plot_law_bands", "columns"): {"energy in J": [ALONG], "error in mm": [ALONG]},
    ("plot_slow_error", "t"): ALONG, ("plot_slow_error", "error"): np.ones((len(ALONG), 2)),
    ("plot_slow_error", "predicted"): np.ones((len(ALONG), 2)), ("plot_swing", "motion"): SWING,
    ("plot_swing", "pose"): np.ones((1, 3, 3)), ("plot_swing", "labels"): ["PD"],
    ("plot_clipping", "free"): RUN, ("plot_clipping", "clipped"): RUN, ("plot_clipping", "limit"): 0.1,
    ("plot_accelerations", "places"): [[0.0, 0.0], [-0.05, 0.0]], ("plot_accelerations", "limit"): 0.085,
    ("plot_room", "c"): [0.11, -0.06, -0.05], ("plot_room", "n"): [0.577, 0.577, 0.577], ("plot_room", "limit"): 0.085,
    ("plot_room", "room"): [-0.04, -0.045], ("plot_room", "marks"): {"least size": 0.0},
    ("plot_torque_norms", "log"): False, ("plot_spacing", "marked"): ("a level", 0.1),
    ("on_grid", "values"): np.ones(144),
    ("plot_parameterization_singularities", "x"): [0.0, 0.0],
    ("Experiment", "sensors"): SENSORS, ("Sample", "t"): 0.0, ("SimulationError", "run"): None,
    ("Controller", "t"): 0.0, ("CommandFilter", "law"): rk.PD(7.0, 0.2), ("load", "source"): "testbed",
    ("plot_map", "x"): X, ("plot_map", "y"): X, ("plot_mode_maps", "x"): X, ("plot_mode_maps", "y"): X,
    ("plot_loop_gaps", "t"): ALONG, ("plot_lyapunov", "t"): ALONG, ("plot_step_response", "t"): ALONG,
    ("plot_torque_steps", "friction"): 0.02, ("plot_joint_moves", "start"): [-0.05, 0.0],
    ("plot_joint_moves", "stop"): [0.05, 0.0], ("plot_energies", "rows"): {"a": [1.0, 2.0, 3.0]},
    ("plot_placement", "values"): np.ones((12, 12)), ("lines_per_drive", "values"): RUN.c,

    ("plot_effective_gain", "K"): 400.0, ("switching_map", "rule"): "cross",
    ("plot_pair_curves", "pairs"): [(0, 1)], ("film", "draw"): lambda ax, s: ax.plot([0, 1], [0, s]),
    ("plot_landscape", "values"): ALONG, ("plot_landscape", "theory"): np.ones((12, 12, 12)),
    ("plot_five_bar_curves", "start"): [-0.05, 0.0], ("plot_guaranteed_force", "poses"): {"a": Q},
    ("table", "rows"): [["PD", "1.65"]], ("film_loops", "t"): ALONG, ("film", "rest"): 0.2,
    **{(name, "low"): 1.0 for name in ("slider", "log_slider")},
    **{(name, "high"): 9.0 for name in ("slider", "log_slider")},
    **{(name, "frames"): 12 for name in ("film_force_polygon", "film_three_lines")},
    **{(name, "frames"): 4 for name in ("film_filter", "film_loops", "film_mirror", "film_workshop")},
    **{(name, "ax"): plt.figure().add_subplot() for name in ("lines_per_drive", "plane_axes")},
    ("plot_lyapunov", "rate"): 0.5,
    ("choice", "value"): "a", ("switch", "value"): True, ("draw_machine", "names"): True, ("Picture", "setup"): None,
    **{(name, "panels"): {"a": {"ylim": (0, 2)}} for name in ("explorer", "Picture")}, ("explorer", "draw"): draw,
    ("Explorer", "draw"): draw, ("Explorer", "play"): None, ("Explorer", "live"): True,
    ("offset_sliders", "limit"): 8, ("offset_sliders", "values"): [4.0, -2.0, 5.0],
}  # fmt: skip


class Odd:
    """An object of no meaning here."""


def bad(good) -> list:
    """What nobody should pass where `good` works."""
    values = [
        "abc", "", b"abc", 1j, float("nan"), float("inf"), -float("inf"), 1e200, 10**400, -1.5, {}, {"a": 1}, set(),
        object(), Odd, Odd(), rk.Manipulator, rk.load, lambda: None, np.zeros(0), np.zeros((5, 7)), [[1.0], [2.0, 3.0]],
        [None], np.array(["1.0"]), np.datetime64("2020-01-01"), True, None, ROBOT, PATH, RUN, (x for x in "ab"),
        np.ma.array([1.0, 2.0, 3.0], mask=[0, 1, 0]), [float("nan")] * 3, Ellipsis, slice(3), NotImplemented,
        ThreadPoolExecutor, type, int, "../../etc/passwd", "a\0b", -1, 10**9 + 0.5,
    ]  # fmt: skip
    if isinstance(good, str | type(None) | bool | dict) or callable(good) or isinstance(good, rk.Desired | rk.Run):
        return values
    try:
        array = np.asarray(good, dtype=float)
    except (TypeError, ValueError):
        return values
    if array.size and array.dtype == float:
        first = (0,) * array.ndim
        holes = [array.copy() for _ in range(3)]
        holes[0][first], holes[1][first], holes[2][first] = np.nan, np.inf, 1e150
        mask = np.zeros(array.shape, bool)
        mask[first] = True
        values += [*holes, array + 1j, array.astype(str), array > 0, np.ma.array(array, mask=mask)]
        values += [array[..., :-1], array[None, None, None], array[..., None]] if array.ndim else [[1.0, 2.0, 3.0, 4.0]]
    return values


def functions(module) -> Iterator[tuple[str, Any]]:
    """Everything callable that a module shows, and the methods of values that work."""
    for name in getattr(module, "__all__", None) or [
        n for n in vars(module) if not n.startswith("_") and n != "guarded"
    ]:
        thing = getattr(module, name)
        # What writes files is tried by hand: some of the strings below are paths.
        if (
            name != "write_log"
            and callable(thing)
            and not (isinstance(thing, type) and issubclass(thing, BaseException))
        ):
            yield name, thing
    if module is rk:
        methods = {
            ROBOT: ["with_arms", "same_kinematics"], rk.SwitchedCTC(400, 40): ["choose", "pairs", "fixed"],
            PATH: ["for_robot"], SENSORS: ["of_drives"], rk.at(ROBOT, Q): ["using"],
            rk.AntagonismFilter(rk.PD(7.0, 0.2)): ["matrix"], rk.PD(7.0, 0.2): ["gains"],
        }  # fmt: skip
        for value, names in methods.items():
            for name in names:
                yield f"{type(value).__name__}.{name}", getattr(value, name)
        yield "Manipulator.replace", lambda lengths, friction: ROBOT.replace(lengths=lengths, friction=friction)
        for law in (rk.PD(7.0, 0.2), rk.CTC(400, 40), rk.RedundantAPD(7.0, 0.2), rk.AntagonismFilter(rk.PD(7.0, 0.2))):
            yield f"{type(law).__name__}.torque", law.torque


def good_arguments(name: str, thing) -> dict[str, Any] | None:
    """Arguments that work, by name; None where a signature holds a word without one."""
    try:
        parameters = inspect.signature(thing).parameters.values()
    except (TypeError, ValueError):
        return None
    arguments = {}
    for p in parameters:
        if p.kind in (p.VAR_POSITIONAL, p.VAR_KEYWORD):
            continue
        if (name, p.name) in OTHER:
            arguments[p.name] = OTHER[name, p.name]
        elif p.name in GOOD:
            arguments[p.name] = GOOD[p.name]
        elif p.default is not p.empty:
            arguments[p.name] = p.default
        else:
            return None
    return arguments


def new_words(name: str, thing) -> str:
    """The arguments without a value that works."""
    parameters = inspect.signature(thing).parameters.values()
    new = [p.name for p in parameters if p.default is p.empty and p.name not in GOOD and (name, p.name) not in OTHER]
    return ", ".join(new)


def cases(module, each: int | None = None, seed: int = 0) -> Iterator[Case]:
    """The calls of a module: all, or at random `each` of every argument."""
    for name, thing in functions(module):
        arguments = good_arguments(name, thing)
        if arguments is None:
            continue
        defaults = {p.name: p.default for p in inspect.signature(thing).parameters.values()}
        for parameter, good in arguments.items():
            values = [v for v in bad(good) if v is not None or defaults[parameter] is not None]
            if each is not None:
                values = random.Random(f"{seed} {name} {parameter}").sample(values, min(each, len(values)))
            for value in values:
                yield Case(name, parameter, value, lambda a={**arguments, parameter: value}, f=thing: f(**a))


CLOCK = hasattr(signal, "setitimer")  # Windows has none: a hang hangs there


class Hang(BaseException):
    pass


def _alarm(*_):
    raise Hang


def _wind(seconds: float) -> None:
    if CLOCK:
        signal.setitimer(signal.ITIMER_PROF, seconds)


def judge(case: Case, seconds: float = 120.0) -> tuple[str, str]:
    """How a call ended, and its words.  Processor time is counted: other work on the cores makes no hang."""
    before = signal.signal(signal.SIGPROF, _alarm) if CLOCK else None
    _wind(seconds)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            answer = case.call()
        return ("accepted" if finite(answer) else "nan"), type(answer).__name__
    except Hang:
        return "hang", ""
    except Exception as error:
        _wind(0.0)
        return verdict(case, error), f"{type(error).__name__}: {error}"
    finally:
        _wind(0.0)
        if CLOCK:
            signal.signal(signal.SIGPROF, before)
        plt.close("all")


def verdict(case: Case, error: Exception) -> str:
    words = str(error)
    if not isinstance(error, ValueError | TypeError | rk.SimulationError) or isinstance(error, np.linalg.LinAlgError):
        return "unclear"
    named = re.search(rf"\b{re.escape(case.parameter)}\b", words) is not None
    allowed = re.search(r"allowed|needed|needs", words) is not None
    shown = (
        re.search(r"=|shape|\bhas\b|\bholds\b|\bis\b|\bare\b|returned|unknown|lacks|no data file|cannot", words)
        is not None
    )
    return "clear" if named and allowed and shown else "half" if named or allowed else "unclear"


def finite(answer, depth: int = 0) -> bool:
    """No NaN and no infinity in what came back, as far as one can look inside."""
    if isinstance(answer, float | np.floating | np.ndarray):
        array = np.ma.filled(answer, 0.0) if isinstance(answer, np.ma.MaskedArray) else np.asarray(answer)
        return array.dtype.kind not in "fc" or bool(np.all(np.isfinite(array)))
    if isinstance(answer, tuple | list) and depth < 3:
        return all(finite(part, depth + 1) for part in answer)
    if not isinstance(answer, type) and hasattr(answer, "_fields") and callable(answer._fields) and depth < 2:
        return all(finite(part, depth + 1) for name, part in answer._fields().items() if name not in ("limit",))
    return True


def shortfall(module: str, count: Counter[str]) -> str:
    """What is amiss with the verdicts of a module, in words; nothing if all is well."""
    refused = count["clear"] + count["half"] + count["unclear"]
    least = LEAST.get(module, 0.9)
    wrong = [f"{count[how]} {how}" for how in ("nan", "hang") if count[how]]
    if count["clear"] < least * refused or not refused:
        wrong.append(f"{count['clear']} of {refused} refusals clear; needed: {least:.0%}")
    return ", ".join(wrong)


def main(words: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.hostile", description="Hostile calls, counted by verdict.")
    parser.add_argument("modules", nargs="*", default=list(LEAST))
    parser.add_argument("--each", type=int, help="calls per argument; all without it")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--show", action="store_true", help="list what is not clear")
    given = parser.parse_args(words)
    failed = 0
    for name in given.modules:
        count: Counter[str] = Counter()
        for case in cases(importlib.import_module(name), given.each, given.seed):
            how, said = judge(case)
            count[how] += 1
            if given.show and how not in ("clear", "accepted"):
                print(f"{how:8} {case.name}({case.parameter}={str(case.value)[:40]!r}): {said[:200]}")
        print(f"{name}: {sum(count.values())} calls, {dict(count)}")
        if wrong := shortfall(name, count):
            print(f"{name} fails: {wrong}")
            failed = 1
    return failed


if __name__ == "__main__":
    sys.exit(main())
