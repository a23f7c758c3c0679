"""Colours of the arms, seen with four kinds of eyes; and the short films."""

import io
import itertools
import re
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.colors import to_hex
from PIL import Image, ImageColor

import rapkm_lite as rk
from rapkm_lite import explore, plotting
from rapkm_lite.figures.style import AFTER, ALARM, ARM_COLOURS, ARM_TEXT_COLOURS, PAIR_COLOURS

# Machado, Oliveira, Fernandes 2009, severity 1: linear RGB as it is seen without one kind of cone.
EYES = {
    "all cones": np.eye(3),
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
}
# IEC 61966-2-1: linear sRGB to XYZ, and its white.
XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
WHITE = XYZ @ np.ones(3)


def linear(colour):
    c = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def contrast(colour):
    """WCAG 2: contrast ratio on white."""
    return 1.05 / (XYZ[1] @ linear(colour) + 0.05)


def lab(colour, eye):
    """CIELAB coordinates."""
    t = XYZ @ np.clip(np.asarray(EYES[eye]) @ linear(colour), 0, 1) / WHITE
    f = np.where(t > (6 / 29) ** 3, np.cbrt(t), t / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def test_lab_of_known_colours():
    np.testing.assert_allclose(lab("#FFFFFF", "all cones"), [100, 0, 0], atol=1e-9)
    np.testing.assert_allclose(lab("#FF0000", "all cones"), [53.2, 80.1, 67.2], atol=0.1)
    assert contrast("#000000") == pytest.approx(21)


@pytest.mark.parametrize("colour", ARM_COLOURS + PAIR_COLOURS)
def test_lines_stand_out_on_white(colour):
    assert contrast(colour) >= 3.0


@pytest.mark.parametrize("line, text", list(zip(ARM_COLOURS, ARM_TEXT_COLOURS, strict=True)))
def test_text_of_arms_is_readable_and_of_their_colour(line, text):
    assert contrast(text) >= 4.5
    assert np.linalg.norm(lab(line, "all cones")[1:] - lab(text, "all cones")[1:]) < 20


MADE = [n for n in explore.__all__ if getattr(explore, n).__annotations__.get("return") == "Explorer"]


@pytest.mark.parametrize("name", sorted({*MADE} - {"explorer"}))
def test_words_of_explorers_are_readable_on_what_they_stand_on(name):
    picture = getattr(explore, name)().picture
    marks = [*picture.fixed, *picture.marks]
    discs = [(m.panel, *np.ravel(m.data), to_hex(m.style["color"])) for m in marks if m.style.get("marker") == "o"]
    for mark in marks:
        if mark.kind in ("label", "words"):
            colour = to_hex(mark.style.get("color", AFTER))
            if colour == "#ffffff":  # on a disc, at the same place
                [colour] = {disc[-1] for disc in discs if disc[:-1] == (mark.panel, *np.ravel(mark.data))}
            assert contrast(colour) >= 4.5, mark


def test_words_of_the_figures_of_arms_are_readable():
    robot = rk.load("four_arms")
    q = rk.inverse_kinematics(robot, [0.01, 0.02])
    drawn = [plotting.plot_joint_angles(robot, q), plotting.plot_machine(robot, q)]
    drawn.append(plotting.plot_placement(robot, [[0.0, 0.0], [0.02, 0.0]], [1.0, 2.0]))
    for ax in drawn:
        assert [text for text in ax.texts if contrast(to_hex(text.get_color())) < 4.5] == []
        plt.close(ax.figure)


@pytest.mark.parametrize("eye", EYES)
@pytest.mark.parametrize("palette", [ARM_COLOURS, ARM_TEXT_COLOURS], ids=["lines", "text"])
def test_arms_are_apart_for_every_eye(eye, palette):
    apart = [np.linalg.norm(lab(a, eye) - lab(b, eye)) for a, b in itertools.combinations(palette[:3], 2)]
    assert min(apart) >= 30, "arms 1 to 3; a distance of 2.3 is just noticeable"
    assert min(np.linalg.norm(lab(a, eye) - lab(b, eye)) for a, b in itertools.combinations(palette[:4], 2)) >= 20
    assert min(np.linalg.norm(lab(a, eye) - lab(b, eye)) for a, b in itertools.combinations(palette, 2)) >= 12


@pytest.mark.parametrize("eye", EYES)
def test_pairs_are_apart_for_every_eye_and_no_arms(eye):
    assert min(np.linalg.norm(lab(a, eye) - lab(b, eye)) for a, b in itertools.combinations(PAIR_COLOURS, 2)) >= 12
    arms = [np.linalg.norm(lab(a, "all cones") - lab(b, "all cones")) for a in PAIR_COLOURS for b in ARM_COLOURS]
    assert min(arms) >= 20
    for robot in (rk.load("five_bar"), rk.load("four_arms")):
        lines = [plotting.pair_line(robot, pair) for pair in rk.drive_pairs(robot)]
        assert not {line["color"] for line in lines} & {*ARM_COLOURS, ALARM}


def test_curves_and_prose_know_the_colours():
    style = Path(plotting.STYLE).read_text(encoding="utf-8")
    cycle = re.search(r"prop_cycle.*\[(.*)\]", style)[1].replace("'", "#").split(", ")
    assert [c.strip("#") for c in cycle[:3]] == [c.strip("#") for c in ARM_COLOURS[:3]]
    root = Path(__file__).parents[1]
    files = [p for kind in ("*.py", "*.js", "*.css", "*.mplstyle") for p in (root / "rapkm_lite").rglob(kind)]
    assert not [p.name for p in files if re.search("DDAA33|221, ?170, ?51", p.read_text(encoding="utf-8"), re.I)]


def turning(ax, angle):
    ax.plot([0, np.cos(angle)], [0, np.sin(angle)])
    ax.set(xlim=(-1.2, 1.2), ylim=(-1.2, 1.2))


def test_a_film_moves_stops_and_speaks():
    open_before = plt.get_fignums()
    film = plotting.film(turning, np.linspace(0, 3, 7), 'A hand "turns".', figsize=(2, 2), seconds=1.4, rest=1, loops=3)
    moving = Image.open(io.BytesIO(film.moving))
    assert moving.format == "WEBP" and moving.n_frames == 7 and moving.info["loop"] == 3
    assert len(film.moving) <= 120_000 and plt.get_fignums() == open_before, "no figure of pyplot is left"
    for frame, wanted in ((0, 200), (6, 1200)):
        moving.seek(frame)
        moving.load()
        assert moving.info["duration"] == wanted
    bundle = film._repr_mimebundle_()
    assert 'alt="A hand &quot;turns&quot;."' in bundle["text/html"] and bundle["text/plain"] == film.alt
    assert "prefers-reduced-motion" in bundle["text/html"]


def test_pale_lines_of_the_arms_keep_their_colours_in_a_film():
    """Springs are drawn half as strong; in few colours for many tones each has one that is nearest to its own."""

    def springs(ax, step):
        for i in range(3):
            ax.plot([0, 1], [i, i + 0.2 * step], color=plotting.arm_colour(i), alpha=0.55, lw=1.2)
        ax.imshow(np.linspace(0, 1, 900).reshape(30, 30), cmap="cividis", extent=(0, 1, 3, 5), aspect="auto")
        ax.set(ylim=(-1, 5))

    moving = Image.open(io.BytesIO(plotting.film(springs, [0.0, 1.0], "Three springs.", figsize=(4, 3)).moving))
    shown = np.unique(np.asarray(moving.convert("RGB")).reshape(-1, 3), axis=0).astype(int)
    for i in range(3):
        pale = 255 - 0.55 * (255 - np.array(ImageColor.getrgb(plotting.arm_colour(i))))
        assert np.abs(shown - pale).max(axis=1).min() < 30


def test_a_film_is_saved_under_the_name_of_its_form(tmp_path):
    film = plotting.film(turning, [0.0, 1.0], "A hand turns.", figsize=(2, 2))
    for name in ("own.gif", "own.mp4", "own", 3):
        with pytest.raises(ValueError, match=r"path = .*; allowed: a file name that ends in \.webp"):
            film.save(tmp_path / name if name != 3 else name)
    assert not list(tmp_path.iterdir())
    film.save(tmp_path / "own.webp")
    assert Image.open(tmp_path / "own.webp").n_frames == 2


def test_the_poster_is_the_last_frame_and_paper_stays_white():
    film = plotting.film(turning, [0.0, 1.0, 2.0], "A hand turns.", figsize=(2, 2))
    alone = plotting.film(turning, [2.0, 2.0], "A hand turns.", figsize=(2, 2))
    assert film.png == alone.png
    moving = Image.open(io.BytesIO(film.moving)).convert("RGB")
    assert moving.getpixel((0, 0)) == (255, 255, 255)


def test_a_film_with_frames_left_out_says_so_and_keeps_its_ends():
    steps = np.linspace(0, 3, 30)
    film = plotting.film(turning, steps, "A hand turns.", figsize=(2, 2), poster=7, most=4)
    seen = [0, 7, 10, 19, 29]
    whole = plotting.film(turning, steps[seen], "A hand turns.", figsize=(2, 2), poster=1)
    assert film.moving == whole.moving and film.png == whole.png
    assert f"{len(seen)} of 30 pictures" in film._repr_mimebundle_()["text/html"] and not whole.note


@pytest.mark.parametrize(
    "frames, alt, more, sentence",
    [
        ([1.0], "A hand.", {}, "frames has 1 steps; allowed"),
        ([0.0, 1.0], " ", {}, "alt = ' '; allowed"),
        ([0.0, 1.0], "A hand.", {"loops": 0}, "loops = 0; allowed"),
        ([0.0, 1.0], "A hand.", {"most": 1}, "most = 1; allowed"),
        ([0.0, 1.0], "A hand.", {"poster": 2}, "poster = 2; allowed: whole numbers >= -1, to 1"),
    ],
)
def test_films_refuse_what_they_cannot_show(frames, alt, more, sentence):
    with pytest.raises(ValueError, match=sentence):
        plotting.film(turning, frames, alt, **more)


def test_a_film_that_would_be_too_large_leaves_frames_out_and_lasts_as_long():
    rng = np.random.default_rng(1)
    noise = lambda ax, k: ax.imshow(rng.uniform(size=(60, 60)), cmap="gray")  # noqa: E731
    film = plotting.film(noise, range(60), "Noise.", figsize=(2, 2), seconds=6, rest=1)
    moving = Image.open(io.BytesIO(film.moving))
    shown = moving.n_frames
    assert 2 < shown < 60 and len(film.moving) <= 120_000
    assert film.note == f"{shown} of 60 pictures, because all of them make more than 120 kB."
    lasts = []
    for k in range(shown):
        moving.seek(k)
        moving.load()
        lasts.append(moving.info["duration"])
    assert sum(lasts) == pytest.approx(7000, abs=shown)


def test_a_film_that_is_too_large_with_few_frames_says_what_to_do():
    rng = np.random.default_rng(1)
    with pytest.raises(ValueError, match="take a smaller figsize"):
        plotting.film(lambda ax, k: ax.imshow(rng.uniform(size=(200, 200))), range(12), "Noise.", figsize=(5, 5))
