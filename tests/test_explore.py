"""The explorers: drawn at corners and defaults of their controls, honest about mistakes, and without leaks."""

import datetime
import functools
import importlib.util
import inspect
import itertools
import json
import re
import subprocess
import sys
import threading
from pathlib import Path

import ipywidgets as widgets
import matplotlib
import nbformat
import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.text import Text

import rapkm_lite as rk
from rapkm_lite import explore, plotting
from rapkm_lite.explore import shared
from rapkm_lite.explore.controls import moved, snap
from rapkm_lite.explore.shared import usual_gains
from rapkm_lite.figures.marks import clamped, encode, figure, middle, roomiest, workspace_outline

matplotlib.use("agg")
import matplotlib.pyplot as plt

# Every public function that makes an explorer of a machine.
NAMES = sorted(
    name
    for name, made in vars(explore).items()
    if inspect.isfunction(made) and list(inspect.signature(made).parameters) == ["robot"]
)
_made = {}


def made(name):
    """One explorer of each kind, back at its defaults."""
    if name not in _made:
        _made[name] = getattr(explore, name)()
    _made[name].reset()
    return _made[name]


def ends(widget):
    """First and last setting of a control."""
    if isinstance(widget, widgets.Checkbox):
        return False, True
    if isinstance(widget, widgets.Dropdown):
        values = [o[1] if isinstance(o, tuple) else o for o in widget.options]
        return values[0], values[-1]
    if isinstance(widget, widgets.FloatLogSlider):
        return 10**widget.min, 10**widget.max
    return widget.min, widget.max


def drawn(explorer):
    """The marks of the last step as one comparable text."""
    return [
        (m.kind, m.panel, m.data.round(12).tolist(), sorted(m.style.items()), str(m.words)) for m in marks(explorer)
    ]


def marks(explorer):
    return explorer.picture.marks


def assert_sound(explorer):
    words = " ".join([*explorer.numbers.values(), explorer.sentence, explorer.code])
    assert "nan" not in words.lower() and "inf " not in words.lower(), words
    assert bool(explorer.numbers) != bool(explorer.problem)
    seen = " ".join([*explorer.numbers.values(), *(m.words for m in marks(explorer) if m.kind in ("label", "words"))])
    assert not re.search(r"[−-]0(\.0*)?(?![.\d])", seen), f"a zero has a sign: {seen}"
    header, buffers = encode(explorer.picture, explorer.picture.fixed + marks(explorer), {})
    assert json.loads(json.dumps(header))["frames"] and len(buffers) == 1 + len(header["images"])


class Page:
    """A page in front of an explorer: what it is sent, and the messages of a hand."""

    def __init__(self, explorer):
        self.explorer, self.got = explorer, []
        explorer.canvas.send = lambda content, buffers=None: self.got.append(content)
        self.say({"kind": "hello"})

    def say(self, content):
        self.explorer.canvas._handle_custom_msg(content, [])

    def grab(self, to=None, by=None):
        self.say({"kind": "grab", "from": "me", "seq": len(self.got), "to": to or {}, "by": by or {}})
        return self.got[-1]


def test_every_explorer_of_the_room_is_offered():
    written = set()
    for path in Path(explore.__file__).parent.glob("*.py"):
        written |= set(re.findall(r"^def ([a-z]\w*)\(.*\) -> Explorer:", path.read_text(encoding="utf-8"), re.M))
    assert written == set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_draws_every_end_of_every_control_and_random_corners(name):
    explorer, open_before = made(name), plt.get_fignums()
    assert not explorer.problem, explorer.problem
    for control, widget in explorer.controls.items():
        for value in ends(widget):
            explorer.reset()
            assert_sound(explorer.set(**{control: value}))
    rng = np.random.default_rng(6)
    corners = list(itertools.product(*(ends(w) for w in explorer.controls.values())))
    for corner in rng.permutation(len(corners))[:6]:
        assert_sound(explorer.set(**dict(zip(explorer.controls, corners[corner], strict=True))))
    assert plt.get_fignums() == open_before


@pytest.mark.parametrize("name", NAMES)
def test_every_choice_is_drawn(name):
    explorer = made(name)
    for control, widget in explorer.controls.items():
        if isinstance(widget, widgets.Dropdown):
            for option in widget.options:
                explorer.reset()
                assert_sound(explorer.set(**{control: option[1] if isinstance(option, tuple) else option}))


@pytest.mark.parametrize("mode", explore.machine().controls["mode"].options)
def test_no_title_of_a_stored_picture_is_cut(mode):
    drawn = figure(made("machine").set(mode=mode).picture)
    drawn.draw_without_rendering()
    titles = [text for ax in drawn.axes for text in ax.findobj(Text) if text.get_text() == ax.get_title("left") != ""]
    assert len(titles) == 4
    for title in titles:
        assert title.get_window_extent().x1 <= drawn.bbox.x1, title


@pytest.mark.parametrize("name", NAMES)
def test_every_control_changes_the_picture_and_reset_brings_it_back(name):
    explorer = made(name)
    first, setting = drawn(explorer), explorer.values
    for control, widget in explorer.controls.items():
        low, high = ends(widget)
        explorer.set(**{control: high if setting[control] == low else low})
        assert drawn(explorer) != first, f"{control} changes nothing"
        explorer.reset()
        assert explorer.values == setting
        # A limit may stay wider than at first, so only the settings and numbers are compared with the start.
        assert not explorer.problem


@pytest.mark.parametrize("name", NAMES)
def test_controls_are_labelled_with_units(name):
    dimensionless = {"mode", "drives", "path", "law", "filter", "friction", "encoder"}
    for control, widget in made(name).controls.items():
        assert widget.description and "rapkm-control" in widget._dom_classes
        if hasattr(widget, "min") and control not in dimensionless:
            assert " in " in widget.description or "1/s" in widget.description, widget.description


@pytest.mark.parametrize("name", NAMES)
def test_other_machines_are_accepted(name):
    testbed = rk.load()
    two = rk.Manipulator(base=testbed.base[:2], lengths=0.2, masses=0.134)
    four = rk.Manipulator(base=0.16 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]), lengths=0.2, masses=0.1)
    for robot in (two, four):
        explorer = getattr(explore, name)(robot)
        assert_sound(explorer)
        explorer.close()


def test_theory_and_simulation_meet_in_the_steady_state_explorer():
    explorer = made("steady_state")
    # Without a contradiction between the drives, offsets A e_x move the end-effector and leave no torque: (14).
    explorer.set(**{f"offset_{i}": 0.0 for i in (1, 2, 3)})
    assert explorer.numbers["rest torque"].startswith("0.0 / 0.0 / 0.0")
    explorer.set(offset_1=5.0)
    theory, simulated = (
        np.array([float(v) for v in explorer.numbers[k].removesuffix(" mrad").split(" / ")])
        for k in ("error at rest, theory", "simulated")
    )
    assert np.abs(theory - simulated).max() < 0.05


def test_reading_of_table_1_is_reproduced_by_the_run_explorer():
    reading = rk.experiment("table1_reading")
    explorer = explore.decentralized_run(rk.load().replace(friction=reading.robot.friction))
    explorer.set(path="reading of Table 1", K_P=5.0, K_D=0.15, offset_1=-4.5, offset_2=-6.0, offset_3=12.0)
    run = rk.simulate(reading.robot, rk.PD(5.0, 0.15), reading.trajectory, 1e-3 * np.array([-4.5, -6.0, 12.0]))
    per_drive = " / ".join(f"{e:.2f}" for e in run.energy)
    assert explorer.numbers["energy"] == f"{per_drive} J, in all {run.energy.sum():.2f} J"


def test_zonotope_holds_every_force_of_limited_torques():
    A = rk.control_matrix(rk.load(), rk.inverse_kinematics(rk.load(), [0.05, -0.03]))
    corners = rk.force_polygon(A, 0.085)
    forces = np.array(list(itertools.product([-0.085, 0.085], repeat=3))) @ A
    edges = np.roll(corners, -1, axis=0) - corners
    gap = forces[:, None] - corners
    assert np.all(edges[:, 0] * gap[..., 1] - edges[:, 1] * gap[..., 0] > -1e-12)
    # Its area is 4 sum |g_i x g_j| (McMullen).
    area = np.sum(corners[:, 0] * np.roll(corners[:, 1], -1) - corners[:, 1] * np.roll(corners[:, 0], -1)) / 2
    minors = sum(abs(np.linalg.det(0.085 * A[list(p)])) for p in rk.drive_pairs(rk.load()))
    assert area == pytest.approx(4 * minors, rel=1e-12)


def test_feedback_map_is_the_textbook_one_where_the_pair_is_regular():
    robot = rk.load()
    path = rk.triangle(robot, 0.17, dt=0.1)
    for pair in rk.drive_pairs(robot):
        A = rk.control_matrix(robot, path.q, pair)
        Gbar, _, _ = rk.minimal_dynamics(robot, path.q, path.qd, pair)
        norm = np.linalg.norm(rk.weighted_pseudoinverse(A) @ Gbar, 2, axis=(-2, -1))
        found = explore.torque.feedback_along(robot, rk.CTC(1.0, 1.0, pair), path.q)
        np.testing.assert_allclose(found, norm, rtol=1e-9)


def test_singular_curves_keep_the_distance_from_the_centroid_that_the_reference_states():
    curves = explore.torque.singular_curves(rk.load())
    gaps = [min(np.linalg.norm(line, axis=-1).min() for line in lines) for lines in curves.values()]
    np.testing.assert_allclose(gaps, 0.1012, atol=2e-4)


@pytest.mark.parametrize("mode", [m for m in rk.working_modes(rk.load()) if abs(m.sum()) == 1], ids=str)
def test_in_mixed_modes_all_three_curves_pass_the_middle_of_a_side(mode):
    """Also the one that touches zero: three parallel links, an input singularity, between the arms that bend alike."""
    robot = rk.load()
    alike = [i for i in range(3) if mode[i] * mode.sum() > 0]
    middle = robot.base[alike].mean(axis=0)
    explorer = explore.machine().set(mode=plotting.mode_name(mode))
    for pair in ("(1,2)", "(1,3)", "(2,3)"):
        explorer.set(drives=f"pair {pair}")
        lines = [m.data for m in marks(explorer) if m.kind == "line" and m.style.get("linewidth") == 2.2]
        assert min(np.linalg.norm(line - middle, axis=-1).min() for line in lines) < 3e-3


def test_curve_on_the_map_lies_between_poses_that_bend_the_pair_to_either_side():
    robot, mode = rk.load(), [1, -1, 1]
    explorer = made("machine").set(mode="(+, −, +)", drives="pair (1,3)")
    curves = [m.data for m in marks(explorer) if m.kind == "line" and m.style.get("linewidth") == 2.2]
    points = np.concatenate([(c[1:] + c[:-1]) / 2 for c in curves])
    ways = np.concatenate([np.diff(c, axis=0) for c in curves])
    across = 1e-3 * np.stack([-ways[:, 1], ways[:, 0]], axis=-1) / np.linalg.norm(ways, axis=1, keepdims=True)
    sides = points + across, points - across
    seen = np.all([rk.reachable(robot, side) for side in sides], axis=0)
    one, other = (rk.distal_cross_products(robot, rk.inverse_kinematics(robot, s[seen], mode))[:, 1] for s in sides)
    assert seen.sum() > 50 and np.all(one * other < 0)


def line(picture, slope, power=1.0):
    if slope < -2:
        raise ValueError(f"slope = {slope:g}; allowed: >= -2")
    x = np.linspace(0, 1, 50)
    picture.line("a", x, slope * x**power)
    picture.fit("a", slope * x)
    return {"slope": f"{slope:g}"}


def light(**others):
    controls = {
        "slope": explore.slider("slope in m/s", -3.0, 3.0, 0.1, 1.0),
        "power": explore.slider("power", 1, 3, 1, 1),
    }
    return explore.explorer(line, controls | others, {"a": {"xlabel": "time in s"}}, size=(3, 2))


def test_wrong_names_raise_a_sentence_that_names_both_sides():
    with pytest.raises(ValueError, match="slope, power, gain, but line takes slope, power"):
        light(gain=explore.slider("gain", 0, 1, 1, 0))
    with pytest.raises(ValueError, match="controls are named slope, but line takes slope, power"):
        explore.explorer(line, {"slope": explore.slider("slope", 0, 1, 1, 0)}, {"a": {}})
    with pytest.raises(ValueError, match="play = 'time'; allowed: one of slope, power"):
        explore.explorer(line, light().controls, {"a": {}}, play="time")
    with pytest.raises(ValueError, match="no control 'slop'; allowed: slope, power"):
        light().set(slop=1)
    with pytest.raises(ValueError, match="slope = 9; allowed: -3 to 3"):
        light().set(slope=9)
    with pytest.raises(ValueError, match="'up'"):
        light(power=explore.choice("power", [1, 2])).set(power="up")
    with pytest.raises(KeyError, match="no panel 'b'; allowed: a"):
        light().picture.line("b", 0, 0)


@pytest.mark.parametrize(
    ("name", "values"),
    [("slope", ("a", None, [1.0, 2.0], 1j, 4.0)), ("number", (2.5, "3")), ("word", ([1], "up")), ("on", (1, "yes"))],
)
def test_controls_refuse_what_they_cannot_take(name, values):
    controls = {
        "slope": explore.slider("slope", -3.0, 3.0, 0.1, 1.0),
        "number": explore.slider("number", 1, 9, 1, 5),
        "word": explore.choice("word", ["a", "b"]),
        "on": explore.switch("on"),
    }
    made = explore.explorer(lambda picture, **rest: None, controls, {"a": {}})
    for value in values:
        with pytest.raises(ValueError, match=f"^{name} .*allowed"):
            made.set(**{name: value})


OTHER_WIDGETS = [
    (widgets.IntRangeSlider(value=(1, 3), min=0, max=10), (2, 5), "a"),
    (widgets.BoundedFloatText(value=1.0, min=0.0, max=10.0), 2.0, "a"),
    (widgets.DatePicker(), datetime.date(2020, 1, 1), None),  # that of ipywidgets 7 takes anything
    (widgets.ToggleButtons(options=["a", "b"]), "b", "c"),
    (widgets.SelectMultiple(options=["a", "b"]), ("b",), ("c",)),
]


@pytest.mark.parametrize(("widget", "value", "wrong"), OTHER_WIDGETS, ids=[type(w).__name__ for w, *_ in OTHER_WIDGETS])
def test_any_widget_with_a_value_is_a_control(widget, value, wrong):
    seen = []
    controls = {"slope": explore.slider("slope in m/s", 0, 9, 1, 1), "other": widget}
    explorer = explore.explorer(lambda picture, slope, other: seen.append(other), controls, {"a": {}})
    widget.value = value  # as from the page
    assert seen[-1] == value and not explorer.problem
    explorer.reset()
    assert explorer.set(other=value).values["other"] == seen[-1] == value
    # What a control refuses moves no other one.
    if wrong is not None:
        with pytest.raises(ValueError, match=r"^other = .*; allowed: what its control takes"):
            explorer.set(slope=5, other=wrong)
        assert explorer.values == {"slope": 1, "other": value}


def test_whole_numbers_of_numpy_make_a_slider_that_plays():
    slider = explore.slider("power", 1, np.int64(3), 1, np.uint8(2))
    shown = explore.explorer(line, light().controls | {"power": slider}, {"a": {}}, play="power")
    assert shown.values["power"] == 2 and type(shown.values["power"]) is int


def test_a_box_takes_the_truth_values_of_numpy():
    made = explore.explorer(lambda picture, on: None, {"on": explore.switch("on", np.True_)}, {"a": {}})
    assert made.values == {"on": True} and made.set(on=np.False_).values == {"on": False}


def test_a_path_is_told_to_cross_where_it_does():
    """It crosses a curve on which a pair is singular where d_j x d_k changes its sign, on machines of any size."""
    robot, told = rk.load().replace(friction=0.0), {True: [], False: []}
    for times in (0.1, 1.0):
        scaled = {name: times * getattr(robot, name) for name in ("base", "lengths", "centers")}
        own = robot.replace(inertias=times**2 * robot.inertias, **scaled)
        explorer = explore.computed_torque(own).set(law="fixed pair (1,2)", offset_1=0, offset_2=0, offset_3=0)
        frame, outline = explorer.picture.frames["plane"], workspace_outline(own)
        assert np.all(np.nanmin(outline, axis=0) >= frame[::2]) and np.all(np.nanmax(outline, axis=0) <= frame[1::2])
        for side in (170, 220, 230, 240, 280):
            path = rk.triangle(own, 1e-3 * times * side, centre=own.base.mean(axis=0), dt=0.01)
            crossed = np.ptp(np.sign(rk.distal_cross_products(own, path.q)[:, 0])) > 0
            word = explorer.set(side=times * side).numbers.get("distance from its singular curve")
            if word:  # else the run is lost
                told[crossed].append(word == "crossed")
    assert told[True] and all(told[True]) and told[False] and not any(told[False])


def test_a_screen_shows_its_answer_on_demand():
    explorer = light().screen("Why?", "Because.")
    show, said = explorer.widget.children[1].children[0].children[1:]
    for pressed, words, display in ((True, "Hide the answer", "block"), (False, "Show the answer", "none")):
        show.value = pressed
        assert show.description == words and said.layout.display == display


def test_a_broken_draw_fails_at_once():
    def broken(picture, slope):
        raise TypeError("a mistake in the lesson")

    with pytest.raises(TypeError, match="a mistake in the lesson"):
        explore.explorer(broken, {"slope": explore.slider("slope in m", 0, 1, 1, 0)}, {"a": {}})


def test_what_cannot_be_computed_is_a_sentence_in_the_picture():
    explorer = light()
    page = Page(explorer)
    explorer.set(slope=-3.0)
    assert "slope = -3; allowed: >= -2" in explorer.problem and explorer.numbers == {}
    assert "slope = -3" in page.got[-1]["problem"] and "slope = -3" in explorer.sentence
    explorer.set(slope=1.0)
    assert explorer.problem == page.got[-1]["problem"] == "" and explorer.numbers == {"slope": "1"}
    crossed = made("computed_torque").set(side=240)
    assert "left the workspace" in crossed.problem


def test_a_machine_too_small_for_the_triangle_shows_what_it_reaches():
    explorer = made("own_machine")
    explorer.set(proximal=150, distal=150)
    assert "what all arms reach" in explorer.problem
    (reached,) = [mark for mark in explorer.picture.marks if mark.kind == "polygon"]
    # On the outline one arm, the one with the longest way, is stretched to 300 mm; corners are cut between samples.
    way = np.linalg.norm(np.asarray(reached.data)[:, None] - rk.load().base * 0.23 / rk.load().base[2, 1], axis=-1)
    np.testing.assert_allclose(np.nanmax(way, axis=1), 0.3, atol=2e-4)
    # So little that no sample of the outline lies in it.
    tiny = explore.own_machine(rk.load("five_bar")).set(radius=320, distal=155, load=0.3)
    assert "what all arms reach" in tiny.problem
    explorer.set(proximal=200, distal=200)
    assert not explorer.problem and not [mark for mark in explorer.picture.marks if mark.kind == "polygon"]


def test_end_effector_stays_in_the_workspace():
    robot = rk.load()
    for name in ("machine", "steady_state"):
        explorer = made(name)
        page = Page(explorer)
        rng = np.random.default_rng(2)
        for x, y in rng.uniform(-0.6, 0.6, (20, 2)):
            answer = page.grab({"x": 1e3 * x, "y": 1e3 * y})
            at = explorer.picture.handles[0]["at"]
            assert not answer["problem"] and rk.reachable(robot, at)
            # The sliders follow the handle, to half of one of their steps.
            assert (
                np.abs(np.array([explorer.values["x"], explorer.values["y"]]) - 1e3 * np.array(at)).max() <= 1.0 + 1e-6
            )
            inside = rk.reachable(robot, [x, y])
            if not inside and max(abs(x), abs(y)) < 0.2:
                # Clamped on the way from the middle of the drives.
                assert abs(at[0] * y - at[1] * x) < 1e-3


@pytest.mark.parametrize("name", ["machine", "steady_state"])
def test_numbers_after_a_grab_beyond_the_workspace_are_those_of_the_sliders(name):
    page = Page(made(name))
    for x, y in ((150, -180), (-190, 40), (190, 190)):
        answer = page.grab({"x": x, "y": y})
        assert (answer["places"]["x"], answer["places"]["y"]) != (x, y)
        fresh = getattr(explore, name)().set(**answer["places"])
        assert dict(answer["numbers"]) == fresh.numbers and answer["sentence"] == fresh.sentence
        assert drawn(page.explorer) == drawn(fresh)


def test_number_of_a_line_stands_beside_no_other_line():
    explorer = made("three_opinions")
    half = explorer.picture.ylim("opinions")[1]
    for offsets in [(5, -3, 8), *itertools.product((-12, -5, 1, 12), repeat=3)]:
        explorer.set(**{f"offset_{i + 1}": offset for i, offset in enumerate(offsets)})
        seen = [mark for mark in marks(explorer) if mark.panel == "opinions"]
        start, end = np.moveaxis([m.data for m in seen if m.style.get("linewidth") == 2.4], 1, 0)
        way = (end - start) / np.linalg.norm(end - start, axis=1, keepdims=True)
        for place, number in [(m.data[0], int(m.words)) for m in seen if m.kind == "label"]:
            gaps = np.abs(way[:, 0] * (place - start)[:, 1] - way[:, 1] * (place - start)[:, 0])
            assert gaps.min() > 0.9 * gaps[number - 1], (offsets, number)
            knobs = np.array([handle["at"] for handle in explorer.picture.handles])
            # On a telephone a knob is wider than an eighth of the panel.
            assert np.linalg.norm(knobs - place, axis=1).min() > 0.19 * half and np.abs(place).max() < 0.95 * half


def test_number_of_a_line_stands_on_the_same_side_on_every_computer():
    robot, places = rk.load().replace(friction=0.0), []
    for shift in 1e-16 * np.arange(-6, 7):
        shown = explore.three_opinions(robot.replace(base=robot.base + shift))
        places.append([mark.data[0] for mark in marks(shown) if (mark.kind, mark.panel) == ("label", "opinions")])
    assert np.ptp(places, axis=0).max() < 1e-6


def test_of_two_places_with_as_much_room_rounding_does_not_choose():
    """Two arms mirror each other at the line through their drives; none of them reaches the middle."""
    robot = rk.Manipulator(base=[[0.2, 0.0], [-0.2, 0.0]], lengths=[0.12, 0.4], masses=0.2)
    places = [roomiest(robot.replace(base=robot.base + shift)) for shift in 1e-16 * np.arange(-6, 7)]
    assert np.ptp(places, axis=0).max() < 1e-6


def test_moving_a_slider_redraws_and_set_redraws_once():
    explorer, calls = light(), []
    inner = explorer.draw

    def counted(picture, **values):
        calls.append(values)
        return inner(picture, **values)

    explorer.draw = counted
    explorer.controls["slope"].value = 2.0
    assert calls == [{"slope": 2.0, "power": 1}]
    explorer.set(slope=0.5, power=2)
    assert calls[1:] == [{"slope": 0.5, "power": 2}]
    explorer.close()
    explorer.controls["slope"].value = -1.0
    assert len(calls) == 2


def test_continuous_update_only_when_compiled_or_asked_for():
    from rapkm_lite import engine

    new = int(widgets.__version__.split(".")[0]) >= 8
    assert light().controls["slope"].continuous_update is (engine.COMPILED and new)
    assert made("machine").controls["x"].continuous_update is new


def test_log_slider_has_a_step_at_its_value():
    # Browsers move a value that lies between two steps.
    slider = explore.log_slider("K_P in N m/rad", 1.0, 50.0, 7.05, steps=40)
    steps = (np.log10(slider.value) - slider.min) / slider.step
    assert steps == pytest.approx(round(steps), abs=1e-9) and slider.value == 7.05
    assert 10**slider.max / 10**slider.min == pytest.approx(50.0)


def test_two_outputs_the_stored_picture_first(monkeypatch):
    shown = []
    monkeypatch.setattr("IPython.display.display", lambda what, **kw: shown.append(what))
    explorer = light()
    explorer._ipython_display_()
    bundle, widget = shown
    assert set(bundle) == {"image/png", "text/html", "text/plain"} and widget is explorer.widget
    assert bundle["text/plain"] == "Explorer(line: slope = 1, power = 1)\nslope: 1"
    assert f'alt="{explorer.sentence}"' in bundle["text/html"] and repr(widget) == "Explorer"


def test_stored_notebooks_keep_the_picture_and_drop_the_widget():
    file = Path(__file__).parents[1] / "notebooks" / "build.py"
    sys.path.insert(0, str(file.parent))
    spec = importlib.util.spec_from_file_location("build", file)
    build = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(build)
    sys.path.pop(0)
    view = {"application/vnd.jupyter.widget-view+json": {}, "text/plain": "Explorer"}
    outputs = [nbformat.v4.new_output("display_data", data=data) for data in (light().stored(), view)]
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell("x", outputs=outputs)])
    build.tidy(notebook)
    (kept,) = notebook.cells[0].outputs
    assert {"image/png", "text/plain"} <= set(kept.data)


@pytest.mark.parametrize("name", NAMES)
def test_stored_picture_is_painted(name):
    explorer = made(name)
    assert explorer.png.startswith(b"\x89PNG") and len(explorer.png) < 100_000
    assert explorer.about and explorer.about in explorer.sentence


@pytest.mark.parametrize("end", [0, 1])
@pytest.mark.parametrize("name", NAMES)
def test_code_brings_the_setting_back(name, end):
    explorer = made(name)
    for control, widget in explorer.controls.items():
        explorer.set(**{control: ends(widget)[end]})
    values, code = explorer.values, explorer.code
    explorer.reset()
    again = eval(code, {"explore": explore})
    assert again.values == values
    assert eval(explorer.code, {"explore": explore}).values == explorer.values


def test_code_names_the_machine_that_was_given():
    robot = rk.load("four_arms")
    explorer = explore.machine(robot).set(x=10)
    assert explorer.code == "explore.machine(robot).set(x=10)"
    assert eval(explorer.code, {"explore": explore, "robot": robot}).values == explorer.values
    assert light().set(slope=0.5).code == "explorer.set(slope=0.5)"


@pytest.mark.parametrize("name", ["machine", "own_machine"])
def test_the_working_mode_that_is_shown_first_is_that_of_the_machine(name):
    """The signs of sin(elbow angle), read off the links that are drawn."""
    robot = rk.load("four_arms").replace(mode=[1, 1, -1, 1])
    shown = getattr(explore, name)(robot)
    assert shown.values["mode"] == "(+, +, −, +)"
    chains = [m.data for m in shown.picture.marks if (m.kind, m.panel) == ("line", "machine") and len(m.data) == 3]
    turns = [np.sign(np.linalg.det(np.diff(chain, axis=0))) for chain in chains[-4:]]
    assert turns == [1, 1, -1, 1]


def test_a_machine_with_weight_rests_where_its_run_ends():
    """(14) with the force of gravity is of first order; with stiff drives that is near."""
    stiff = explore.steady_state(rk.load("asymmetric")).set(K_P_1=49.0, K_P_2=49.0, K_P_3=49.0)
    theory, run = (
        np.array([float(part) for part in stiff.numbers[name].removesuffix(" mrad").split(" / ")])
        for name in ("error at rest, theory", "simulated")
    )
    assert np.abs(run).max() > 5.0
    np.testing.assert_allclose(theory, run, atol=0.1)
    stiff = explore.three_opinions(rk.load("asymmetric")).set(K_P=49.0, offset_1=0, offset_2=0, offset_3=0)
    assert stiff.numbers["torque at rest"] != "0.0 / 0.0 / 0.0 mN m"


def test_the_edge_of_via_points_has_the_length_of_its_machine():
    explorer = explore.via_points(rk.load("asymmetric").replace(base=2 * rk.load().base, lengths=0.4))
    assert explorer.controls["legs"].options[0] == ("480 mm", 1)
    assert explorer.picture.xlim("way") == (0, 480)


def test_a_place_beyond_reach_is_told_and_a_hand_elsewhere_leaves_it():
    explorer = explore.allocation().set(x=150, y=150, f_y=0.3)
    assert re.fullmatch(r"\(12\d, 12\d\) mm: an arm reaches no further", explorer.numbers["end-effector"])
    explorer._message({"kind": "grab", "to": {"f_x": 0.2, "f_y": 0.1}, "from": 1, "seq": 1})
    assert explorer.values | {"f_x": 0.2, "f_y": 0.1} == explorer.values
    assert (explorer.values["x"], explorer.values["y"]) == (150, 150)
    assert "end-effector" not in explore.allocation().numbers


def test_reset_stops_what_plays():
    explorer = explore.animation()
    (play,) = [part for box in explorer.widget.children[0].children for part in getattr(box, "children", [])[:1]]
    play.playing = True
    explorer.reset()
    assert isinstance(play, widgets.Play) and play.playing is False


def test_steps_under_way_when_reset_stops_a_player_are_not_taken():
    """A browser has sent them before it hears of the reset."""
    explorer = explore.animation().set(time=800)
    explorer._player.play.playing = True
    explorer.reset()
    explorer.controls["time"].value = 920
    assert explorer.values["time"] == 400
    explorer.controls["filter"].value = explorer.controls["filter"].options[-1]
    assert explorer.values["filter"] != explorer._first["filter"]


@pytest.mark.parametrize("message", ["still", "hello"])
def test_a_view_that_goes_stops_what_plays_and_a_new_one_does_not(message):
    explorer = explore.animation()
    explorer._player.play.playing = True
    explorer._message({"kind": message})
    assert explorer._player.play.playing is (message == "hello")
    explorer.controls["time"].value = 920
    assert explorer.values["time"] == 920


def test_reset_goes_back_to_what_was_shown_first(capsys):
    explorer = light().set(slope=0.5)
    explorer._ipython_display_()
    explorer.set(slope=1.5).reset()
    assert explorer.values["slope"] == 0.5


@pytest.mark.parametrize(
    ("mark", "words"),
    [
        (lambda p: p.line("a", [0, 1], [0, 1], color="nocolour"), "nocolour"),
        (lambda p: p.text("a", 0, 0, "here", va="middle"), "va = 'middle'"),
        (lambda p: p.line("a", [0, 1], [0, 1], color=[1, 0, 0]), "color"),
        (lambda p: p.polygon("a", [0.0, 1.0, 2.0]), "shape \\(3,\\)"),
    ],
)
def test_a_style_that_cannot_be_drawn_is_refused_where_it_is_written(mark, words):
    picture = explore.Picture({"a": {}})
    with pytest.raises(ValueError, match=words):
        mark(picture)
    assert not picture.marks


LOOKS = {
    "plain line": ("line", {}),
    "line": ("line", {"color": "r", "linewidth": 2.0, "alpha": 0.5, "zorder": 5, "solid_capstyle": "round"}),
    "dashed": ("line", {"linestyle": "--"}),
    "dotted": ("line", {"linestyle": ":"}),
    "dash-dot": ("line", {"linestyle": "-."}),
    "own dashes": ("line", {"linestyle": (0, (5, 1.2))}),
    "markers": ("line", {"linestyle": "none", "marker": "s", "color": "g", "markersize": 4, "markeredgewidth": 2.0}),
    "hollow markers": ("line", {"marker": "o", "color": "g", "markerfacecolor": "white"}),
    "plain polygon": ("polygon", {}),
    "outline": ("polygon", {"fill": False, "facecolor": "r", "edgecolor": "b", "linestyle": "--", "linewidth": 2.0}),
    "both": ("polygon", {"facecolor": "y", "edgecolor": "b", "zorder": -1}),
    "plain words": ("text", {}),
    "words": ("text", {"color": "g", "fontsize": 8, "fontweight": "bold", "ha": "right", "va": "top"}),
    "thin words": ("text", {"color": "g", "fontweight": "normal", "ha": "center", "va": "center"}),
}


@pytest.mark.parametrize(("kind", "style"), LOOKS.values(), ids=LOOKS)
def test_the_canvas_is_told_what_matplotlib_makes_of_a_style(kind, style):
    """Both paint the same picture; dashes, sizes and who covers whom are Matplotlib's own where a mark says nothing."""
    picture = explore.Picture({"a": {}})
    given = {"line": ([0, 1], [0, 1]), "polygon": ([[0, 0], [1, 0], [0, 1]],), "text": (0.5, 0.5, "here")}[kind]
    getattr(picture, kind)("a", *given, **style)
    (told,) = encode(picture, picture.marks, {})[0]["styles"].values()
    ax = figure(picture).axes[0]
    (drawn,) = {"line": ax.lines, "polygon": ax.patches, "text": ax.texts}[kind]
    assert told["z"] == drawn.get_zorder() and told["alpha"] == (drawn.get_alpha() or 1.0)
    if kind != "text":
        assert tuple(told["dash"]) == tuple(drawn._unscaled_dash_pattern[1] or ())
    {"line": _line_as_drawn, "polygon": _area_as_drawn, "text": _words_as_drawn}[kind](told, drawn, style)


def _line_as_drawn(told, line, style):
    assert told["color"] == to_hex(line.get_color()) and told["face"] == to_hex(line.get_markerfacecolor())
    assert told["width"] == (line.get_linewidth() if line.get_linestyle() != "None" else 0.0)
    assert (told["size"], told["edge"]) == (line.get_markersize(), line.get_markeredgewidth())
    assert (told["marker"] or "None") == line.get_marker()
    assert told["cap"] == style.get("solid_capstyle", "butt")


def _area_as_drawn(told, area, style):
    face, edge = area.get_facecolor(), area.get_edgecolor()
    assert told["face"] == (to_hex(face) if face[3] else None)
    assert told["color"] == (to_hex(edge) if edge[3] else None) and told["width"] == area.get_linewidth()


def _words_as_drawn(told, words, style):
    assert told["color"] == to_hex(style.get("color", "#222222")) and told["size"] == words.get_fontsize()
    assert told["bold"] == (words.get_fontweight() == "bold")
    assert (told["ha"], told["va"]) == (words.get_ha(), words.get_va())


def test_a_truth_value_is_no_number_of_a_style_though_it_equals_one():
    picture = explore.Picture({"a": {}})
    picture.line("a", [0, 1], [0, 1], linewidth=1)
    with pytest.raises(ValueError, match=r"linewidth = True is not numeric"):
        picture.line("a", [0, 1], [0, 1], linewidth=True)


def test_a_message_that_failed_was_told_to_nobody():
    picture, known = explore.Picture({"a": {}}), {}
    picture.line("a", [0, 1], [0, 1], color="#123456")
    broken = [*picture.marks, picture.marks[0]._replace(style={"color": "nocolour"})]
    with pytest.raises(ValueError):
        encode(picture, broken, known)
    header, _ = encode(picture, picture.marks, known)
    assert [style["color"] for style in header["styles"].values()] == ["#123456"]


def test_a_handle_moves_controls_only():
    def draw(picture, slope):
        picture.handle("a", 0.5, slope, slop=(0, 1))

    with pytest.raises(KeyError, match="'slop', which is no control; allowed: slope"):
        explore.explorer(draw, {"slope": explore.slider("slope in m", 0, 2, 0.1, 1)}, {"a": {}})


@pytest.mark.parametrize("name", NAMES)
def test_handles_move_their_controls(name):
    explorer = made(name)
    page = Page(explorer)
    for k, handle in enumerate(explorer.picture.handles):
        explorer.reset()
        before = explorer.values
        answer = page.grab(by=dict.fromkeys(handle["set"], 2))
        assert answer["kind"] == "picture" and answer["from"] == "me"
        changed = {c for c, v in explorer.values.items() if v != before[c]}
        assert changed == set(handle["set"])
        now = explorer.picture.handles[k]
        for control in handle["set"]:
            if handle["along"] is not None:  # all of the curve is within reach of the slider
                low, high = explorer.canvas.scene["ranges"][control]
                assert low <= np.min(now["set"][control]) and np.max(now["set"][control]) <= high
            widget = explorer.controls[control]
            assert explorer.values[control] == pytest.approx(before[control] + 2 * widget.step)
            # The handle stands where the controls say.
            if handle["along"] is not None:
                gap = np.linalg.norm(np.asarray(now["along"]) - now["at"], axis=1)
                reach = np.abs(np.asarray(now["set"][control]) - explorer.values[control]).min()
                assert gap[np.abs(np.asarray(now["set"][control]) - explorer.values[control]).argmin()] < 1e-2 + reach
            else:
                x, y = now["at"]
                a, b, *c = now["set"][control]
                assert a * x + (b * y if b else 0.0) + sum(c) == pytest.approx(explorer.values[control], abs=1e-9)


def test_opinions_agree_on_a_triangle_that_is_closed():
    explorer = made("three_opinions")
    # Offsets A e are those of a displaced machine, on which all drives agree.
    robot = rk.load()
    A = rk.control_matrix(robot, rk.inverse_kinematics(robot, [0.02, 0.03]))
    offsets = A @ [1.0, -0.6]
    third = snap(explorer.controls["offset_3"], offsets[2])
    explorer.set(offset_1=offsets[0], offset_2=offsets[1], offset_3=offsets[2])
    assert explorer.numbers["torque at rest"] == "0.0 / 0.0 / 0.0 mN m"
    assert explorer.numbers["distances from the lines"] == "0.00 / 0.00 / 0.00 mm"
    explorer.set(offset_3=third + 3.0)
    assert explorer.numbers["torque at rest"] != "0.0 / 0.0 / 0.0 mN m"


def test_triangle_of_opinions_is_shaded_though_its_corners_are_out_of_view():
    """Its corners p lie on two lines A_i p = -offset_i each, and the place of rest in their midst."""
    robot, explorer, point = rk.load(), made("three_opinions"), np.array([-0.1, -0.1])
    A = rk.control_matrix(robot, rk.inverse_kinematics(robot, point))
    offset = np.array([-12.0, -12.0, -12.0])
    explorer.set(x=-100, y=-100, **{f"offset_{i + 1}": v for i, v in enumerate(offset)})
    (shaded,) = (m.data.reshape(-1, 2) for m in marks(explorer) if (m.kind, m.panel) == ("polygon", "opinions"))
    assert np.abs(shaded).max() > 3
    # mm times rad/m are mrad.
    assert np.sort(np.abs(shaded @ A.T + offset), axis=1)[:, :2] == pytest.approx(0, abs=1e-4)
    rest = np.array([float(v) for v in re.findall(r"-?\d+\.\d+", explorer.numbers["rest"])])
    weights = np.linalg.solve(np.vstack([shaded.T, np.ones(3)]), [*rest, 1.0])
    assert weights.min() > 0


def test_knobs_stay_in_their_panel_and_numbers_of_level_lines_apart():
    explorer = made("three_opinions")
    for corner in itertools.product((-12.0, 12.0), repeat=3):
        explorer.set(**dict(zip(("offset_1", "offset_2", "offset_3"), corner, strict=True)))
        assert np.abs([handle["at"] for handle in explorer.picture.handles]).max() < 3
    explorer = made("landscape").set(offset_1=-10.0, offset_2=10.0, offset_3=-10.0, K_P=29.0, side=20, shift=60)
    places = [m.data[0] for m in marks(explorer) if (m.kind, m.panel) == ("label", "map")]
    assert len(places) == 6
    assert all(np.any(np.abs(p - q) >= [4.0, 1.8]) for p, q in itertools.combinations(places, 2))


@pytest.mark.parametrize("times", [0.5, 2])
def test_a_machine_of_another_size_fills_the_pictures_alike(times):
    """Lengths scale: A with one over them, forces of equal torques too, distances with them."""
    robot = rk.load().replace(friction=0.0)
    scaled = {name: times * getattr(robot, name) for name in ("base", "lengths", "centers")}
    other = robot.replace(inertias=times**2 * robot.inertias, **scaled)
    for name in NAMES:
        assert set(getattr(explore, name)(other).controls) == set(getattr(explore, name)(robot).controls)
    for name in ("actuation", "allocation", "calibration", "computed_torque", "landscape", "machine", "prestress"):
        assert not getattr(explore, name)(other).problem

    def values(explorer, what):
        return np.array([float(word) for word in re.findall(r"[-\d.]+", explorer.numbers[what])])

    for name in ("actuation", "machine"):
        own, same = (values(getattr(explore, name)(r), "σ_min of all drives") for r in (other, robot))
        np.testing.assert_allclose(times * own, same, atol=0.011)
    own, same = (values(explore.allocation(r), "torques") for r in (other, robot))
    np.testing.assert_allclose(own, same, atol=0.11)


@pytest.mark.parametrize("times, heavier", [(0.05, 1e-3), (50.0, 1e3)])
def test_gains_go_with_the_inertia_of_a_machine(times, heavier):
    """Lengths and masses scale: with gains that go with mass and length squared, all angles are the same."""
    robot, torque = rk.load().replace(friction=0.0), heavier * times**2
    scaled = {name: times * getattr(robot, name) for name in ("base", "lengths", "centers")}
    heavy = {"masses": heavier * robot.masses, "inertias": torque * robot.inertias}
    other = robot.replace(rotor_inertia=torque * robot.rotor_inertia, **scaled, **heavy)
    gains = usual_gains(robot)
    assert gains == (7.05, 0.225)
    for own, same in zip(usual_gains(other), gains, strict=True):
        assert 0.5 < own / (torque * same) < 1.3
    for name in ("animation", "decentralized_run", "imperfections", "steady_state", "three_opinions", "via_points"):
        assert not getattr(explore, name)(other).problem
    angles = explore.steady_state(other).numbers["error at rest, theory"]
    assert angles == explore.steady_state(robot).numbers["error at rest, theory"]


def test_an_edge_that_no_arm_reaches_is_shortened():
    base = [[0.3, 0.0], [0.1, 0.28], [-0.25, 0.2], [-0.2, -0.22], [0.12, -0.3]]
    lengths = [[0.25, 0.3], [0.28, 0.24], [0.3, 0.22], [0.21, 0.33], [0.26, 0.26]]
    assert_sound(explore.via_points(rk.Manipulator(base=base, lengths=lengths, masses=0.1)))


def test_a_machine_of_ones_own_is_made_of_rods_whatever_the_given_one_is_made_of():
    odd = rk.load().replace(centers=0.18, inertias=1e-3, friction=0.0)
    assert explore.own_machine(odd).numbers == explore.own_machine().numbers


def test_a_machine_of_ones_own_begins_with_the_given_one_as_near_as_its_sliders_come():
    robot = rk.load()
    wide = robot.replace(
        base=0.292 / np.linalg.norm(robot.base[0]) * robot.base, lengths=[0.18, 0.26], centers=None, mode=[1, 1, -1]
    )
    values = explore.own_machine(wide).values
    assert values == explore.own_machine().values | {"radius": 290, "proximal": 180, "distal": 260, "mode": "(+, +, −)"}
    large = explore.own_machine(robot.replace(base=10 * robot.base, lengths=10 * robot.lengths, centers=None))
    assert (large.values["radius"], large.values["distal"]) == (320, 300)
    # With the shortest links that the sliders know the triangle would be out of reach.
    small = explore.own_machine(many_arms(6, 0.25))
    assert [small.values[name] for name in ("radius", "proximal", "distal")] == [230, 200, 200] and not small.problem


@pytest.mark.parametrize("name", NAMES)
def test_a_machine_that_stands_elsewhere_has_the_same_numbers(name):
    """Translation: what is asked of a machine about its own middle does not depend on where that is."""
    elsewhere = rk.load().replace(base=rk.load().base + [0.5, -0.3], friction=0.0)
    here = elsewhere.replace(base=rk.load().base)
    shown, same = (getattr(explore, name)(robot) for robot in (elsewhere, here))
    assert not shown.problem
    places = {"point", "end-effector"}
    assert {k: v for k, v in shown.numbers.items() if k not in places} == {
        k: v for k, v in same.numbers.items() if k not in places
    }


@pytest.mark.parametrize("name", ["imperfections", "controller_choice", "via_points"])
def test_drives_above_one_another_are_no_machine_without_width(name):
    """A five-bar turned by a quarter has a base of no extent along x; its path is as large as before."""
    robot = rk.load("five_bar").replace(friction=0.0)
    turned = robot.replace(base=robot.base @ np.array([[0.0, 1.0], [-1.0, 0.0]]))
    for shown in (getattr(explore, name)(turned), getattr(explore, name)(robot)):
        assert not shown.problem
        energy = shown.numbers["electric energy"] if "electric energy" in shown.numbers else shown.numbers["energy"]
        assert float(re.match(r"[\d.]+", energy)[0]) > 0.0


def test_a_machine_with_a_drive_in_the_middle_is_compared_under_every_law():
    """docs/add_a_machine.md: all explorers take it; its middle is no pose, but its path is."""
    robot = rk.Manipulator(base=[[-0.2, -0.1], [0.2, -0.1], [0.0, 0.2], [0.0, 0.0]], lengths=0.25, masses=0.1)
    with pytest.raises(ValueError, match="boundary"):
        rk.control_matrix(robot, rk.inverse_kinematics(robot, [0.0, 0.0]))
    shown = explore.controller_choice(robot)
    assert not shown.problem and "largest error" in shown.numbers
    # Gains fit its weight: without friction equal accelerations make the same motion.
    for mass in (1e-3, 10.0):
        other = explore.controller_choice(robot.replace(masses=mass))
        assert other.numbers["largest error"] == shown.numbers["largest error"]


def test_a_machine_whose_first_triangle_is_too_large_is_shown_on_a_smaller_one():
    """docs/add_a_machine.md: all explorers take it; the picture says what does not fit, as for any setting."""
    robot = rk.Manipulator(base=[[-0.2, 0.0], [0.2, 0.0]], lengths=[0.25, 0.3], masses=0.1, mode=[1, -1])
    shown = explore.computed_torque(robot).set(law="redundant coordinates", rate=20, offset_1=0, offset_2=0)
    assert not shown.problem
    assert "outside the workspace" in shown.set(side=340).problem


ODD = {
    "a ring": ([[0.0, -0.15], [0.13, 0.075], [-0.13, 0.075]], [0.5, 0.3]),
    "a crescent": ([[-0.2, 0.0], [0.0, 0.05], [0.2, 0.0]], [0.4, 0.25]),
    "far drives": ([[0.4, 0.0], [-0.2, 0.346], [-0.2, -0.346]], [0.22, 0.22]),
    "a short arm": ([[0.0, 0.0], [0.6, 0.0], [0.3, 0.25]], [[0.45, 0.45], [0.2, 0.15], [0.3, 0.3]]),
    "two arms": ([[-0.1, 0.0], [0.1, 0.0]], [0.25, 0.35]),
    "a narrow five-bar": ([[-0.03, 0.0], [0.03, 0.0]], [0.3, 0.15]),
}


@pytest.mark.parametrize("base, lengths", ODD.values(), ids=ODD)
def test_paths_begin_where_all_arms_reach_them(base, lengths):
    """Base joint to place: between | l1 - l2 | and l1 + l2 for each arm, on the whole first path of each explorer."""
    robot = rk.Manipulator(base=base, lengths=lengths, masses=0.2)
    where, room = shared.place(robot)
    disc = where + 0.999 * room * np.exp(2j * np.pi * np.arange(99) / 99).view(float).reshape(-1, 2)
    reach = np.linalg.norm(disc[:, None] - robot.base, axis=-1)
    l1, l2 = robot.lengths.T
    assert np.all((reach < l1 + l2) & (reach > np.abs(l1 - l2)))
    for name in set(NAMES) - {"own_machine"}:
        shown = getattr(explore, name)(robot)
        if name == "computed_torque":
            shown.set(law="redundant coordinates")
        if robot.n_arms > 2 or name not in ("landscape", "calibration"):
            assert not shown.problem, (name, shown.problem)


@pytest.mark.parametrize("name", ["testbed", "five_bar", "four_arms", "asymmetric"])
def test_paths_of_the_machines_of_the_package_lie_in_the_middle_of_the_drives(name):
    robot = rk.load(name)
    assert np.array_equal(shared.place(robot)[0], middle(robot)) and reachable_disc(robot) >= 0.08 * 3**0.5


def reachable_disc(robot):
    """From the middle to the nearest place where an arm is stretched or folded, by hand, in m."""
    reach = np.linalg.norm(middle(robot) - robot.base, axis=-1)
    l1, l2 = robot.lengths.T
    return min((l1 + l2 - reach).min(), np.where(l1 == l2, np.inf, reach - np.abs(l1 - l2)).min())


@pytest.mark.parametrize("heavier", [1e-3, 1.0, 30.0])
def test_torques_of_sliders_go_with_what_a_machine_needs(heavier):
    """Without friction torques are proportional to the masses; so are limits and prestress, in steps of 1, 2 and 5."""
    base = 0.25 * np.array([[0.0, -1.0], [0.866, 0.5], [-0.866, 0.5]])
    robot = rk.Manipulator(base=base, lengths=0.25, masses=0.15 * heavier, inertias=1e-3 * heavier)
    shown, stress = explore.imperfections(robot), explore.prestress(robot)
    limit, acts = shown.controls["limit"], 1e3 * np.abs(shown_run(robot).c).max()
    assert limit.min < acts < limit.max
    # Numbers of which a reader sees two figures, not 0.0.
    pressing = rk.antagonistic_torque(shown_run(robot))[-1]
    said = re.findall(r"-?[\d.]+", shown.numbers["torque that only presses, at the end"])
    assert np.allclose([float(word) for word in said], 1e3 * pressing, rtol=0.05)
    other = drawn(shown)
    assert drawn(shown.set(limit=limit.min)) != other and shown.numbers["largest torque"].split(" ")[0] != "0"
    without = [m.data[:, 1] for m in stress.picture.marks if (m.kind, m.panel) == ("line", "without")]
    assert 0.1 < stress.values["level"] / max(np.abs(y).max() for y in without) < 10


def shown_run(robot):
    """What `imperfections` shows first, without its limit."""
    path = rk.triangle(robot, 0.12, duration=2.5, dt=2e-3)
    return rk.simulate(robot.replace(lengths=1.005 * robot.lengths), rk.PD(*usual_gains(robot)), path, model=robot)


def test_a_place_on_the_boundary_is_left_by_a_hair():
    """At | l1 - l2 | from a base joint the arm is folded and no pose: rows of the control matrix go with 1 / sin."""
    robot = rk.Manipulator(*ODD["a ring"], masses=0.2)
    at = clamped(robot, np.array([-0.2, -0.15]))
    assert (
        np.hypot(*(at - robot.base[0])) > 0.2
        and np.isfinite(rk.control_matrix(robot, rk.inverse_kinematics(robot, at))).all()
    )


def test_a_circle_as_large_as_the_room_is_not_the_first_of_a_calibration():
    """At |x - B| = 2 l an arm is stretched, where control matrices have no end: 0.34 + 0.06 m = 2 x 0.2 m."""
    robot = rk.Manipulator(
        base=0.34 * np.array([[1, 0], [-0.5, 0.75**0.5], [-0.5, -(0.75**0.5)]]), lengths=0.2, masses=0.1
    )
    assert abs(shared.place(robot)[1] - 0.06) < 1e-12
    assert not explore.calibration(robot).problem


def test_a_machine_that_reaches_a_single_point_is_refused_by_a_sentence():
    robot = rk.Manipulator(
        base=0.3 * np.array([[1, 0], [-0.5, 0.75**0.5], [-0.5, -(0.75**0.5)]]), lengths=0.15, masses=0.1
    )
    with pytest.raises(ValueError, match="all arms reach a single point, or hardly more"):
        explore.machine(robot)


def test_a_share_that_is_none_is_a_number():
    """Diagonal entries of a projector are 0 to 1; rounded below zero they have no square root."""
    robot = rk.Manipulator(
        base=0.25 * np.array([[3**0.5 / 2, -0.5], [0, 1.0], [-(3**0.5) / 2, -0.5]]), lengths=0.25, masses=0.1
    )
    for times in (1.0, 10.0):
        one = robot.replace(base=times * robot.base, lengths=times * robot.lengths, centers=None, inertias=None)
        shown = explore.calibration(one)
        for radius in (shown.controls["radius"].max, shown.controls["radius"].min):
            shown.set(radius=radius)
            assert all(np.isfinite(m.data).all() for m in shown.picture.marks if m.panel == "seen")


@pytest.mark.parametrize("name", ["animation", "controller_choice", "decentralized_run", "imperfections", "landscape"])
def test_a_machine_that_reaches_half_a_triangle_is_shown(name):
    """docs/add_a_machine.md: all explorers take it; a path that no slider changes is one that its arms reach."""
    lengths = [[0.16, 0.16], [0.3, 0.2], [0.2, 0.25], [0.16, 0.2]]
    shown = getattr(explore, name)(rk.load("four_arms").replace(lengths=lengths))
    assert not shown.problem
    assert_sound(shown)


def test_a_drive_in_the_middle_of_the_others_has_a_place_too():
    square = 0.2 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [0.0, 0.0]])
    assert not explore.own_machine(rk.Manipulator(base=square, lengths=[0.25, 0.3], masses=0.1)).problem


def test_drives_in_a_row_stay_in_a_row():
    """The layout of the given machine is kept, also where two drives lie in one direction from the middle."""
    row = rk.Manipulator(base=[[-0.3, 0.0], [0.0, 0.0], [0.3, 0.0]], lengths=0.25, masses=0.67 * 0.25, load=0.5)
    path = rk.triangle(row, 0.24, dt=0.02)
    largest = 1e3 * np.abs(rk.inverse_dynamics(row, path.q, path.qd, path.qdd)).max()
    shown = explore.own_machine(row)
    assert shown.values["radius"] == 200
    assert shown.numbers["largest torque that moves"] == f"{largest:.0f} mN m"


def test_the_feedback_of_a_heavy_machine_is_in_the_picture():
    """Links ten times as long and a hundred times as heavy: the norm of the feedback grows with the inertia."""
    robot = rk.load().replace(friction=0.0)
    heavy = robot.replace(
        base=10 * robot.base, lengths=10 * robot.lengths, centers=None, inertias=None, masses=100 * robot.masses
    )
    for machine in (robot, heavy):
        shown = explore.computed_torque(machine)
        low, high = shown.picture.ylim("map")
        assert low < float(re.match(r"[\d.e+]+", shown.numbers["largest feedback map"])[0]) < high


def test_a_failure_in_the_kernel_blocks_nobody():
    def shy(picture, slope):
        if slope > 2:
            raise RuntimeError("a mistake that nobody expected")
        picture.line("a", [0, 1], [0, slope])
        picture.handle("a", 0.5, slope, slope=(0, 1))

    explorer = explore.explorer(shy, {"slope": explore.slider("slope in m", 0.0, 4.0, 0.1, 1.0)}, {"a": {}})
    page = Page(explorer)
    assert "a mistake that nobody expected" in page.grab({"slope": 3.0})["problem"]
    explorer.controls["slope"].value = 2.5
    assert "RuntimeError" in page.got[-1]["problem"]
    assert page.grab({"slope": 1.0})["problem"] == ""
    page.grab({"unknown": 1.0})
    assert page.got[-1]["kind"] == "lost" and page.got[-1]["from"] == "me"
    assert page.grab(by={"slope": 2})["places"] == {"slope": 1.2}


def test_a_second_view_is_told_everything_again():
    explorer = made("machine")
    page = Page(explorer)
    explorer.set(x=30)
    assert page.got[-1]["styles"] == {} and page.got[-1]["images"] == {}
    page.say({"kind": "hello"})
    fixed, picture = page.got[-2:]
    assert fixed["kind"] == "fixed" and picture["images"] and picture["styles"]


@pytest.mark.parametrize("times", [0.3, 3.0, 6.0])
def test_forces_begin_with_one_that_the_drives_can_make(times):
    testbed = rk.load()
    robot = testbed.replace(base=times * testbed.base, lengths=times * testbed.lengths, friction=0.0)
    explorer = explore.allocation(robot)
    assert explorer.problem == "" and explorer.values["f_y"] > 0.0
    # A drive in the middle: a pose of no machine with equal links; one with unequal links begins beside it.
    base = [[-0.15, 0.0], [0.15, 0.0], [0.0, 0.0]]
    assert explore.allocation(rk.Manipulator(base=base, lengths=0.3, masses=0.1)).values["f_y"] == 0.0
    beyond = explore.allocation(rk.Manipulator(base=base, lengths=[0.25, 0.3], masses=[0.1, 0.2]))
    assert beyond.problem == "" and beyond.values["f_y"] > 0.0


def test_controls_snap_to_their_steps():
    slider = explore.slider("offset 1 in mrad", -20.0, 20.0, 0.5, 5.0)
    assert snap(slider, 3.14) == 3.0 and snap(slider, 99.0) == 20.0 and moved(slider, -3) == 3.5
    whole = explore.slider("x in mm", -200, 200, 2, 20)
    assert snap(whole, 30.9) == 30 and isinstance(snap(whole, 30.9), int)
    # Steps that lead beyond the end.
    assert snap(explore.slider("places", 0, 11, 3, 0), 11) == 11
    assert snap(explore.slider("places", 0, 10, 3, 0), 10) == 9
    log = explore.log_slider("K_P in N m/rad", 1.0, 50.0, 7.05)
    assert moved(log, 1) == pytest.approx(7.05 * 50 ** (1 / 40)) and snap(log, 7.1) == pytest.approx(7.05)
    assert moved(log, 9990) == pytest.approx(log.base**log.max) and moved(log, -999) == pytest.approx(log.base**log.min)
    assert snap(explore.switch("friction"), True) is True


@pytest.mark.parametrize(
    ("step", "digits"), [(1.0, 0), (0.5, 1), (0.25, 2), (0.1, 1), (0.001, 3), (5.0, 0), (0.3 - 0.2, 1)]
)
def test_a_slider_shows_as_many_digits_as_its_step_has(step, digits):
    assert explore.slider("force in N", 0.0, 10.0, step, 0.0).readout_format == f".{digits}f"


def test_offsets_are_cut_or_repeated_to_as_many_as_there_are_drives():
    four, two = (explore.offset_sliders(rk.load(name), [4, -2, 5]) for name in ("four_arms", "five_bar"))
    assert [one.value for one in four.values()] == [4, -2, 5, 4] and [one.value for one in two.values()] == [4, -2]


def test_slow_steps_wait_for_the_release(monkeypatch):
    explorer = light()
    monkeypatch.setattr(sys.modules["rapkm_lite.explore.explorer"], "PATIENCE", -1.0)
    explorer.controls["slope"].continuous_update = True
    explorer._slow = 0
    explorer.set(slope=2.0).set(slope=2.5)
    assert explorer.controls["slope"].continuous_update is False


def test_a_typed_value_that_is_rounded_says_so():
    explorer = light()
    page = Page(explorer)
    explorer.controls["slope"].value = 1.234
    assert explorer.values["slope"] == 1.2 and page.got[-1]["note"] == "1.234 was rounded to 1.2"
    explorer.set(slope=0.0)
    explorer.controls["slope"].set_state({"value": 4.4e-16})
    assert explorer.values["slope"] == 0.0 and not page.got[-1].get("note"), "the browser's rounding of zero"
    explorer.controls["slope"].value = 1.5
    assert page.got[-1]["note"] == ""


def test_thinned_traces_keep_every_extreme():
    explorer = light()
    t = np.linspace(0, 5, 5001)
    y = np.random.default_rng(3).standard_normal(5001)
    y[2345] = 9.0
    explorer.picture.begin()
    explorer.picture.trace("a", t, y)
    x, thin = marks(explorer)[0].data.T
    assert len(thin) < 700 and thin.max() == 9.0 and thin.min() == y.min() and np.all(np.diff(x) > 0)
    assert x[-1] == 5.0 and x[thin.argmax()] == t[2345]


def test_thousand_steps_leave_nothing_behind():
    # In a process of its own, where nothing else allocates.
    code = """
import gc, math, sys
from test_explore import light
explorer = light()
slider = explorer.controls["slope"]
def steps(count):
    for k in range(count):
        slider.value = round(2.5 * math.sin(0.37 * k), 1)
    gc.collect()
    return sys.getallocatedblocks(), len(gc.get_objects())
blocks, objects = (b - a for a, b in zip(steps(500), steps(1000)))
assert blocks < 200 and objects < 20, (blocks, objects)
assert len(slider._trait_notifiers["value"]["change"]) == 1
from matplotlib import pyplot
assert pyplot.get_fignums() == []
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=Path(__file__).parent, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_drawing_leaves_the_readers_style_alone():
    before = dict(matplotlib.rcParams)
    light().set(slope=2.0).stored()
    assert dict(matplotlib.rcParams) == before


def test_explorers_take_a_machine_and_nothing_else():
    public = {name: getattr(explore, name) for name in explore.__all__ if inspect.isfunction(getattr(explore, name))}
    made = {name for name, function in public.items() if inspect.signature(function).return_annotation == "Explorer"}
    assert made - {"explorer"} == {*NAMES}


def test_labels_that_stay_stand_in_their_panels():
    found = 0
    for name in NAMES:
        picture = getattr(explore, name)().picture
        for label in (mark for mark in picture.fixed if mark.kind == "label"):
            low, high = picture.xlim(label.panel)
            assert np.all((low <= label.data[:, 0]) & (label.data[:, 0] <= high)), (name, label.words)
            found += 1
    assert found


def test_the_label_of_the_colours_belongs_to_no_small_panel():
    drawn = figure(explore.machine().picture)
    drawn.canvas.draw()
    machine, *small, colours = drawn.axes
    label = colours.yaxis.label.get_window_extent()
    assert label.x0 - colours.bbox.x1 < min(ax.bbox.x0 for ax in small) - label.x1
    assert not any(spine.get_visible() for ax in small for spine in ax.spines.values())
    assert machine.spines["left"].get_visible()


def test_curves_of_a_law_that_works_are_seen():
    explorer = explore.computed_torque()
    for panel in ("torque", "error"):
        curves = [m.data[:, 1] for m in explorer.picture.marks if (m.kind, m.panel) == ("line", panel)]
        assert 0.15 * explorer.picture.ylim(panel)[1] < np.abs(np.concatenate(curves)).max()


@pytest.mark.parametrize(
    "widget", [explore.slider("a", 0, 1, 0.1, 0.5), explore.log_slider("a", 1, 10, 5), explore.switch("a")]
)
def test_only_whole_numbers_play(widget):
    with pytest.raises(ValueError, match="play = 'a'; allowed: the name of a slider with whole numbers"):
        explore.explorer(lambda picture, a: None, {"a": widget}, {"panel": {}}, play="a")


def test_a_picture_is_drawn_by_one_thread(monkeypatch):
    """A kernel may answer a hand on the picture in one thread while a cell sets a control in another."""
    explorer = explore.machine()
    usual, sent, done = (len(explorer.picture.marks), len(explorer.picture.handles)), [], threading.Event()
    monkeypatch.setattr(explorer, "_watched", True)
    monkeypatch.setattr(
        explorer, "_post", lambda message, marks: sent.append((len(marks), len(explorer.picture.handles)))
    )

    def hand():
        while not done.is_set():
            explorer._message({"kind": "grab", "by": {"x": 1}})
            explorer._message({"kind": "grab", "by": {"x": -1}})

    page = threading.Thread(target=hand)
    page.start()
    for k in range(60):
        explorer.set(y=k % 3)
    done.set()
    page.join()
    assert len(sent) > 60 and set(sent) == {usual}


def test_whatever_python_calls_may_draw():
    """An object, a method and a partial function are named after what somebody wrote, and described in its words."""

    class Line:
        """A line through the origin."""

        def __call__(self, picture, gain):
            picture.line("p", [0.0, 1.0], [0.0, gain])
            return {"gain": str(gain)}

        def again(self, picture, gain):
            """The same line."""
            return self(picture, gain)

    def draw(scale, picture, gain):
        """A line that is scaled."""
        return Line()(picture, scale * gain)

    panels = {"p": {"xlabel": "x", "ylabel": "y", "xlim": (0, 1), "ylim": (0, 9)}}
    for call, name, about in (
        (Line(), Line.__qualname__, "A line through the origin."),
        (Line().again, Line.__qualname__, "The same line."),
        (functools.partial(draw, 1.0), draw.__qualname__, "A line that is scaled."),
        (functools.partial(Line()), Line.__qualname__, "A line through the origin."),
    ):
        made = explore.explorer(call, {"gain": explore.slider("gain in 1", 1.0, 3.0, 1.0, 2.0)}, panels)
        assert made.name == name.split(".")[0] and made.about == about and made.set(gain=3.0).numbers == {"gain": "3.0"}
        with pytest.raises(ValueError, match=r"controls are named \(none\), but \w+ takes gain after the picture"):
            explore.explorer(call, {}, panels)


@pytest.mark.parametrize("told", [7.0, "7 mm", (x for x in "ab")])
def test_numbers_that_are_no_dict_are_named_in_the_picture(told):
    made = explore.explorer(
        lambda picture, gain: told, {"gain": explore.slider("gain in 1", 1.0, 3.0, 1.0, 2.0)}, {"p": {}}
    )
    assert "what draw returns = " in made.problem and "allowed: a dict of name -> text, or None" in made.problem
    assert made.numbers == {} and made.problem in made.sentence


@pytest.mark.parametrize("space", [{}, {"__name__": "read_from_a_file_and_never_imported"}])
def test_a_draw_function_need_not_belong_to_an_imported_module(space):
    exec("def bare(picture, gain):\n    'A line.'\n    return {'gain': f'{gain:g}'}", space)
    made = explore.explorer(space["bare"], {"gain": explore.slider("gain in 1", 1.0, 3.0, 1.0, 2.0)}, {"p": {}})
    assert made.about == "A line." and made.set(gain=3.0).numbers == {"gain": "3"}


def many_arms(N, times=1.0):
    """N arms of the testbed around a circle as wide as its own, lengths and masses so many times as large."""
    turn = np.pi * 7 / 6 + 2 * np.pi * np.arange(N) / N
    base = 0.4 / np.sqrt(3) * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    return rk.Manipulator(base=times * base, lengths=0.2 * times, masses=0.134 * times)


def laid_out(explorer):
    """The stored picture with its texts in place."""
    shown = figure(explorer.picture)
    with matplotlib.rc_context(matplotlib.rc_params_from_file(plotting.STYLE, use_default_template=False)):
        shown.draw_without_rendering()
    return shown


@pytest.mark.parametrize("N", [4, 6])
@pytest.mark.parametrize(
    "name, panel",
    [("actuation", "sigma"), ("computed_torque", "plane"), ("prestress", "without"), ("imperfections", "torque")],
)
def test_every_curve_is_named_and_no_legend_covers_a_title(N, name, panel):
    explorer = getattr(explore, name)(many_arms(N))
    named = next(m.words for m in explorer.picture.fixed if m.kind == "legend" and m.panel == panel)
    # Of imperfections the limit, too.
    assert len(named) == {"prestress": N, "imperfections": N + 1}.get(name, N * (N - 1) // 2)
    for ax in laid_out(explorer).axes:
        title = next(t for t in ax.findobj(Text) if t.get_text() == ax.get_title("left")).get_window_extent()
        if ax.get_legend() is not None and title.width:
            said = [t.get_window_extent() for t in ax.get_legend().get_texts() + ax.get_legend().get_lines()]
            assert not any(title.overlaps(box) for box in said), ax.get_title("left")


@pytest.mark.parametrize("N", [4, 6])
def test_curves_look_as_the_legend_of_pairs_says(N):
    picture = explore.actuation(many_arms(N)).picture
    named = next(m.words for m in picture.fixed if m.kind == "legend" and m.panel == "sigma")
    curves = [m.style for m in picture.marks if (m.kind, m.panel) == ("line", "sigma")]
    drawn, told = (
        {(style["color"], style["linestyle"]) for style in these if "linestyle" in style}
        for these in (curves, dict(named).values())
    )
    assert drawn == told and len(told) == len(named)


@pytest.mark.parametrize("name, robot", [("machine", rk.load("five_bar")), ("landscape", many_arms(4))])
def test_titles_and_labels_are_whole(name, robot):
    shown = laid_out(getattr(explore, name)(robot))
    for ax in shown.axes:
        words = [ax.get_title("left"), ax.get_xlabel(), ax.get_ylabel()]
        for text in (t for t in ax.findobj(Text) if t.get_text().strip() and t.get_text() in words):
            box = text.get_window_extent()
            assert 0 <= box.x0 and box.x1 <= shown.bbox.x1 and 0 <= box.y0 and box.y1 <= shown.bbox.y1, text


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("times, mass", [(0.25, 0.005), (25.0, 80.0)])
def test_numbers_along_an_axis_stand_apart_and_words_are_not_cut(name, times, mass):
    robot = many_arms(6, times).replace(masses=mass, inertias=None)
    shown = laid_out(getattr(explore, name)(robot))
    for ax in shown.axes:
        boxes = [t.get_window_extent() for t in ax.get_xticklabels() if t.get_text() and t.get_visible()]
        inside = [box for box in boxes if ax.bbox.x0 - 1 < (box.x0 + box.x1) / 2 < ax.bbox.x1 + 1]
        assert not any(a.overlaps(b) for a, b in itertools.pairwise(inside)), ax.get_title("left")
        for text in ax.texts:
            box, room = text.get_window_extent(), ax.bbox if text.get_clip_on() else shown.bbox
            whole = room.x0 - 2 <= box.x0 and box.x1 <= room.x1 + 2
            assert whole or box.x1 <= room.x0 or box.x0 >= room.x1, text


def test_a_middle_out_of_reach_gives_way_to_a_place_with_room():
    robot = rk.Manipulator([[-0.3, 0.0], [0.3, 0.0], [0.0, 0.05]], [[0.3, 0.3], [0.3, 0.3], [0.15, 0.35]], masses=0.1)
    assert not rk.reachable(robot, robot.base.mean(axis=0))
    for name in ("machine", "steady_state", "three_opinions", "allocation", "animation", "imperfections"):
        assert not getattr(explore, name)(robot).problem, name
    # A hand that pulls beyond all arms comes back to what they reach.
    assert not explore.machine(robot).set(x=explore.machine(robot).controls["x"].max).problem


def test_a_torque_limit_stays_one_where_the_path_is_singular():
    """With no place of the path singular the torques stay below ten times their median."""
    five = rk.load("five_bar")
    robot = five.replace(base=0.5 * five.base, lengths=[[0.25, 0.2]] * 2, centers=None)
    limit = explore.imperfections(robot).controls["limit"]
    assert limit.max <= 4000 and explore.imperfections(five).controls["limit"].max == 200


@pytest.mark.parametrize("times", [1e-2, 1e2])
def test_texts_of_a_small_and_a_large_machine_keep_apart(times):
    """Ticks below the machine, numbers on bars, titles of small panels: as long as their numbers need."""
    for name in ("machine", "animation", "landscape", "three_opinions"):
        for ax in (shown := laid_out(getattr(explore, name)(many_arms(3, times)))).axes:
            low, high = ax.get_xlim()
            ticks = [t.label1 for t in ax.xaxis.get_major_ticks() if low <= t.get_loc() <= high]
            numbers = [t for t in ax.texts if t.get_text().strip() and t.get_bbox_patch() is None and name != "machine"]
            for texts in (ticks, numbers if ax is not shown.axes[0] else []):
                boxes = [t.get_window_extent().padded(-1) for t in texts]
                assert not any(a.overlaps(b) for a, b in itertools.combinations(boxes, 2)), (name, texts)


def test_a_choice_may_mean_a_list():
    """Equal lists are the same choice, as equal numbers are; arrays, which are equal entry by entry, are refused."""
    offsets = explore.choice("offsets", [("none", [0.0, 0.0]), ("some", [4.0, -2.0])], [4.0, -2.0])
    assert offsets.label == "some"
    shown = explore.explorer(
        lambda picture, offsets: {"drive 1": f"{offsets[0]} mrad"}, {"offsets": offsets}, {"p": {}}
    )
    assert shown.set(offsets=[0.0, 0.0]).numbers == {"drive 1": "0.0 mrad"} and offsets.label == "none"
    with pytest.raises(ValueError, match=r"offsets = array.*; allowed: \[0.0, 0.0\], \[4.0, -2.0\]"):
        shown.set(offsets=np.zeros(2))


@pytest.mark.parametrize("heavier", [1e-4, 1e5])
def test_numbers_of_light_and_heavy_machines_are_those_of_the_testbed_times_the_mass(heavier):
    """Without friction (2) and (12) are linear in masses, gains and torques; heat in a winding goes with the square."""
    robot = rk.load().replace(friction=0.0)
    inertia = {name: heavier * getattr(robot, name) for name in ("masses", "inertias", "rotor_inertia")}
    other = robot.replace(**inertia)
    for make, told in (
        ("steady_state", {"rest torque": 1, "heat at rest": 2}),
        ("three_opinions", {"torque at rest": 1, "heat at rest": 2}),
        ("prestress", {"heat with": 2, "largest prestress": 1}),
        ("decentralized_run", {"torque at the end": 1, "largest torque": 1}),
        ("animation", {"force on the end-effector": 1, "torque that moves nothing": 1}),
        ("via_points", {"largest torque that only presses": 1}),
        ("controller_choice", {"largest jump of a torque": 1}),
    ):
        one, times = getattr(explore, make)(robot).numbers, getattr(explore, make)(other).numbers
        for name, power in told.items():
            ours, theirs = ([float(v) for v in re.findall(r"-?[\d.]+(?:e-?\d+)?", n[name])] for n in (one, times))
            slack = 0.5 * 10.0 ** -len(one[name].split(" ")[0].partition(".")[2])
            for a, b in zip(ours, theirs, strict=True):
                assert abs(a - b / heavier**power) <= 1.01 * slack + 5.1e-3 * abs(a), (
                    make,
                    name,
                    one[name],
                    times[name],
                )


def test_a_small_machine_shows_its_bars_and_arrows():
    """5 cm and 10 g: no bar reads zero, energies fill their panel, and the longest arrow is seen beside its scale."""
    home = rk.load()
    robot = rk.Manipulator(base=home.base / 8, lengths=home.lengths / 8, masses=0.01 / 6)
    for name in ("steady_state", "three_opinions", "decentralized_run"):
        shown = getattr(explore, name)(robot)
        words = [m.words for m in shown.picture.marks if m.kind == "label" and m.panel in ("torque", "energy")]
        assert len(words) >= 3 and sum(not re.search("[1-9]", w) for w in words) < 2, (name, words)
        bars = [np.ptp(m.data[:, 1]) for m in shown.picture.marks if m.kind == "bar"]
        assert max(bars) > 0.0
    # What the numbers below call zero is no more beside its bar.
    energies = shown.numbers["energy"].split(" J")[0].replace("-", "−").split(" / ")
    assert [
        m.words.replace("-", "−") for m in shown.picture.marks if m.kind == "label" and m.panel == "energy"
    ] == energies
    low, high = shown.picture.ylim("energy")
    assert max(bars) > 0.2 * (high - low)
    moved = explore.animation(robot)
    (unit,) = (float(m.words.removesuffix(" N")) for m in moved.picture.fixed if m.words and " N" in str(m.words))
    path = shared.fitting_triangle(robot)
    run = rk.simulate(robot, rk.PD(*usual_gains(robot)), path, 1e-3 * np.array([4.0, -2.0, 5.0]))
    largest = np.linalg.norm(rk.control_matrix(robot, run.q) * run.c[..., None], axis=-1).max()
    assert 0.4 < largest / unit < 5.0


def test_the_words_at_the_arrow_of_scale_stay_in_a_wide_picture():
    """10 points are 0.14 in, of a panel that is 3.6 in high; drives far from a small workspace make it show more."""
    square = 0.4 * np.array([[-1.0, 0.0], [0.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
    for robot in (rk.load(), rk.Manipulator(base=square, lengths=0.3, masses=0.2)):
        picture = explore.animation(robot).picture
        low, high = picture.ylim("plane")
        ((_, y),) = next(m.data for m in picture.fixed if " N" in str(m.words))
        assert y + 0.14 / 3.6 * (high - low) < high


@pytest.mark.parametrize("base, lengths", [ODD["a ring"], ODD["a crescent"]], ids=["a ring", "a crescent"])
def test_sliders_of_places_reach_around_the_place_of_paths_and_a_point_beyond_reach_is_told(base, lengths):
    """Where the middle is out of reach, a place between both would be all that its sliders could say."""
    robot = rk.Manipulator(base=base, lengths=lengths, masses=0.2)
    where, room = (1e3 * v for v in shared.place(robot))
    for name in ("three_opinions", "machine", "steady_state", "allocation"):
        shown = getattr(explore, name)(robot)
        for axis, at in zip("xy", where, strict=True):
            ends = shown.controls[axis].min, shown.controls[axis].max
            assert ends[0] <= at - 0.5 * room and at + 0.5 * room <= ends[1], (name, axis)
    for side in (350, 410):  # 1e-3 * 350 is 0.35000000000000003
        problem = explore.prestress(robot).set(side=side).problem
        assert not problem or f"side = {side / 1e3:g}," in problem
    shown = explore.three_opinions(robot)
    start = [1e-3 * shown.values[axis] for axis in "xy"]
    assert ("desired point" in shown.numbers) != np.allclose(clamped(robot, np.array(start)), start)
    x, y = np.rint(1e3 * middle(robot) / shown.controls["x"].step).astype(int) * shown.controls["x"].step
    told = shown.set(x=x, y=y).numbers["desired point"]
    assert told.endswith(" mm: an arm reaches no further") and not told.startswith(f"({x}, {y})")


def test_a_value_that_comes_back_too_late_from_a_browser_moves_nothing():
    """Live sliders send back what they round to: 3 + 2e-15 after 11 was set."""
    shown = explore.three_opinions().set(offset_1=3.0).set(offset_1=11.0)
    control, wanted = shown.controls["offset_1"], dict(shown.numbers)
    control.set_state({"value": 3.0000000000000018})
    assert control.value == 11.0 and shown.numbers == wanted
    control.set_state({"value": 11.000000000000002})
    control.set_state({"value": 3.0})
    assert shown.values["offset_1"] == 3.0 and shown.numbers != wanted, "a hand gives it without noise"
    control.set_state({"value": 7.5})
    assert shown.values["offset_1"] == 7.5 and shown.numbers != wanted


def test_a_rest_outside_the_picture_says_nothing_of_a_desired_point_that_is_reached():
    shown = explore.three_opinions(rk.load("asymmetric"))
    assert any(mark.words.startswith("at rest outside") for mark in shown.picture.marks if mark.kind == "words")
    assert "desired point" not in shown.numbers
