"""The engine of the start page, in Node, against the package: runs to 1e-12 N m, statics to rounding."""

import base64
import itertools
import json
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import pytest
from samples import MACHINES, machines, random_points

import rapkm_lite as rk
from rapkm_lite.machine.datafiles import read_toml

pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="needs Node")

SCRIPT = Path(__file__).parent / "js" / "run_engine.mjs"
ENGINE = Path(rk.__file__).parent / "explore" / "engine.js"
VALUES = (
    "base lengths masses centers inertias rotor_inertia resistance torque_constant friction friction_velocity gravity "
    "load mode"
).split()
FILTERS = ("off", "true", "measured")


def answers(cases):
    """What the page's engine says to all cases, from one start of Node."""
    with tempfile.TemporaryDirectory() as folder:
        # Before version 20.19 Node takes a module for one by the end of its name only.
        shutil.copy(ENGINE, Path(folder) / "engine.mjs")
        environment = os.environ | {"RAPKM_ENGINE": (Path(folder) / "engine.mjs").as_uri()}
        how = {"input": json.dumps(cases), "capture_output": True, "text": True, "encoding": "utf-8"}
        done = subprocess.run(["node", str(SCRIPT)], env=environment, **how)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def values(robot):
    """A machine as the page reads it."""
    return {name: np.asarray(getattr(robot, name)).tolist() for name in VALUES}


def triangle_of(side=0.24, centre=(0.0, 0.0), angle=0.0):
    corner = np.deg2rad([210.0, 330.0, 90.0]) + angle
    return (side / np.sqrt(3) * np.stack([np.cos(corner), np.sin(corner)], -1) + centre).tolist()


def deviation(robot, path, law, corners, how):
    """Largest deviation of torques per sample, and of positions, angles and energies, in a list of runs."""
    cases = [h | {"robot": values(robot), "corners": corners, "duration": float(path.t[-1])} for h in how]
    for h, page in zip(how, answers(cases), strict=True):
        filtered = law if h["filter"] == "off" else rk.AntagonismFilter(law, pose=h["filter"])
        run = rk.simulate(robot, filtered, path, h["offset"], encoder=h["encoder"])
        assert page["lost"] is None
        page = {k: np.frombuffer(base64.b64decode(page[k])) for k in ("x", "angle", "torque", "energy")}
        torque = np.abs(page["torque"].reshape(run.c.shape) - run.c).max(axis=-1)
        others = page["x"].reshape(run.x.shape) - run.x, page["angle"].reshape(run.q_a.shape) - run.q_a
        yield h, torque, *(np.abs(v).max() for v in others), np.abs(page["energy"] - run.energy).max()


def settings(law, N, encoders):
    """Three offsets (none, and two at random) with every filter and encoder."""
    offsets = np.vstack([np.zeros(N), np.random.default_rng(N).uniform(-5e-3, 5e-3, (2, N))]).tolist()
    gains = {"K_P": float(law.K_P), "K_D": float(law.K_D)}
    return [
        gains | {"offset": offset, "filter": name, "encoder": encoder}
        for offset, name, encoder in itertools.product(offsets, FILTERS, encoders)
    ]


@pytest.mark.parametrize("friction", [True, False], ids=["friction", "frictionless"])
@pytest.mark.parametrize("name", MACHINES)
def test_runs_agree_with_the_package(name, friction):
    """Path, law, filter, friction steps and energy: one model in two languages."""
    setting = rk.experiment(name)
    robot = setting.robot if friction else setting.robot.replace(friction=0.0)
    given = read_toml(name)["path"]
    place = {key: given[key] for key in ("side", "centre", "angle") if key in given}
    path, corners = rk.triangle(robot, **place), triangle_of(**place)
    how = settings(setting.law, robot.n_arms, [None])
    for h, torque, x, angle, energy in deviation(robot, path, setting.law, corners, how):
        assert torque.max() <= 1e-12, h
        assert max(x, angle) <= 1e-13 and energy <= 1e-11, h


def test_a_pose_is_found_from_the_last_one_where_the_parabola_leads_too_far():
    """Large offsets move the first estimates by centimetres; what goes on smoothly from there misses the machine."""
    robot = rk.load().replace(friction=0.0, mode=[-1, 1, 1])
    path, law = rk.triangle(robot, 0.1, duration=1.5), rk.PD(7.05, 0.225)
    offsets = [0.113, -0.067, -0.219], [-0.098, -0.21, -0.03], [-0.12, -0.046, -0.283]
    how = [{"K_P": 7.05, "K_D": 0.225, "offset": o, "filter": "measured", "encoder": None} for o in offsets]
    for h, torque, *_ in deviation(robot, path, law, triangle_of(0.1), how):
        assert torque.max() <= 1e-12, h


@machines
def test_runs_with_stepped_angles_differ_in_a_few_samples_at_most(robot):
    """A rounding error at a threshold may turn a count, and the run goes on from there; elsewhere they agree."""
    setting = rk.experiment(next(name for name, value in MACHINES.items() if value == robot))
    side = 0.1
    how = settings(setting.law, robot.n_arms, [2000, 65536])
    path = rk.triangle(robot, side, duration=1.5)
    for h, torque, *_ in deviation(robot, path, setting.law, triangle_of(side), how):
        assert np.count_nonzero(torque > 1e-12) <= 5, h


@machines
def test_statics_agree_with_the_package(robot):
    points = random_points(robot, 40, seed=3, bend=0.3)
    offset = np.random.default_rng(1).uniform(-3e-3, 3e-3, robot.n_arms)
    case = {"robot": values(robot), "points": points.tolist(), "K_P": 7.05, "offset": offset.tolist()}
    q = rk.inverse_kinematics(robot, points)
    A = rk.control_matrix(robot, q)
    for k, page in enumerate(answers([case])[0]):
        scale = np.abs(A[k]).max()
        assert np.allclose(np.exp(1j * np.array(page["angle"])), np.exp(1j * q[k, : robot.n_arms]), atol=1e-14)
        assert np.allclose(page["A"], A[k], atol=1e-13 * scale)
        assert np.allclose(page["polygon"], rk.force_polygon(A[k], 0.1), atol=1e-13 * scale)
        assert np.allclose(page["moving"], rk.antagonism_filter(A[k]) @ offset, atol=1e-15)
        if robot.n_arms == 3:
            assert np.allclose(page["null"], rk.null_vector(robot, q[k]), atol=1e-13)
        desired = q[k, : robot.n_arms]
        # Springs of equal stiffness rest in the least-squares pose of the angles that they want.
        rest = rk.estimate_pose(robot, desired - offset, points[k])
        assert np.allclose(page["rest"], rk.forward_kinematics(robot, rest), atol=1e-13)
        assert np.allclose(page["torque"], -7.05 * (rest[: robot.n_arms] - desired + offset), atol=1e-12)
        assert np.allclose(rk.control_matrix(robot, rest).T @ page["torque"], 0.0, atol=1e-12 * scale**2)


def test_a_point_out_of_reach_is_no_pose():
    robot = MACHINES["testbed"]
    case = {"robot": values(robot), "points": [[0.5, 0.0]], "K_P": 7.05, "offset": [0.0, 0.0, 0.0]}
    assert answers([case]) == [[None]]


@pytest.mark.parametrize("distance", [1e-3, 1e-5, 1e-7])
def test_a_nearly_folded_arm_keeps_its_digits_on_the_page(distance):
    """Equal links l and the distance r of their ends are an isosceles triangle, with acos(r / 2 l) at its ends."""
    robot = MACHINES["testbed"]
    angle = np.linspace(0.2, 0.8, 20)
    away = distance * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    case = {"robot": values(robot), "points": (robot.base[0] + away).tolist(), "K_P": 7.05, "offset": [0.0, 0.0, 0.0]}
    x, y = ((robot.base[0] + away) - robot.base[0]).T  # as rounded
    expected = np.arctan2(y, x) - np.arccos(np.hypot(x, y) / (2 * robot.lengths[0, 0]))
    assert np.allclose([page["angle"][0] for page in answers([case])[0]], expected, rtol=0, atol=2e-15)


@pytest.mark.parametrize("distance", [1e-4, 1e-6, 1e-8])
def test_the_filter_on_the_page_keeps_its_digits_near_an_input_singularity(distance):
    """R c = c - n n^T c, n in closed form; rounding turns n by that of d_j x d_k, and so by A's condition."""
    robot = MACHINES["testbed"].replace(mode=[1, -1, 1])
    place = robot.base[::2].mean(axis=0) + distance * np.array([0.6, 0.8])
    c = [1e-3, -4e-4, 3e-4]
    case = {"robot": values(robot), "points": [place.tolist()], "K_P": 7.05, "offset": c}
    q = rk.inverse_kinematics(robot, place)
    n, A = rk.null_vector(robot, q), rk.control_matrix(robot, q)
    assert np.linalg.cond(A) > 0.1 / distance
    assert np.allclose(answers([case])[0][0]["moving"], c - n * (n @ c), rtol=0, atol=1e-18 * np.linalg.cond(A))
