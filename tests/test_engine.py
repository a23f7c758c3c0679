"""The compiled engine against the textbook layer: an independent integration of (4)-(7) under the laws of `control`."""

import math
import os
import platform
import subprocess
import sys

import numpy as np
import pytest
from reference import reference

import rapkm_lite as rk
from rapkm_lite.simulation import compiled
from rapkm_lite.simulation.compiled import Plant
from rapkm_lite.simulation.setup import prepare

ANGLES = {2: [200.0, -20.0], 3: [210.0, 330.0, 90.0], 4: [225.0, 315.0, 45.0, 135.0]}
OFFSET = np.array([4e-3, -2e-3, 5e-3, -3e-3])
PD = rk.PD(7.05, 0.225)
LAWS = {
    "pd": PD,
    "force": rk.AntagonismFilter(PD),
    "force_true": rk.AntagonismFilter(PD, pose="true"),
    "command": rk.CommandFilter(PD),
    "ctc": rk.CTC(900.0, 60.0, (0, 1)),
    "ctc_ee": rk.CTC(900.0, 60.0, None),
    "apd": rk.APD(7.0, 0.2, (0, 1)),
    "switched": rk.SwitchedCTC(900.0, 60.0),
    "redundant_ctc": rk.RedundantCTC(900.0, 60.0),
    "redundant_ctc_line2": rk.RedundantCTC(900.0, 60.0, projected=False),
    "redundant_apd": rk.RedundantAPD(5.0, 0.2),
    "redundant_apd_line2": rk.RedundantAPD(5.0, 0.2, projected=False),
}


def machine(N, **values):
    """N arms on a circle of radius 0.23 m."""
    angle = np.deg2rad(ANGLES[N])
    base = 0.23 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return rk.Manipulator(base=base, lengths=0.2, masses=0.134, rotor_inertia=3.35e-6, **values)


def test_both_loops_look_for_the_measured_pose_from_the_same_place():
    """Near a fold of a five-bar the angles fit two assemblies; a guess a sample behind leads to the other one."""

    class Same(rk.CTC):  # the same formula, in the loop for laws in Python
        pass

    robot = rk.Manipulator(base=[[-0.2, 0.0], [0.2, 0.0]], lengths=0.2, masses=0.134)
    other = robot.replace(mode=[-1, 1])
    for machine, centre, offset in (
        (robot, [-0.134, -0.083], [-1.3e-3, -1e-4]),
        (other, [0.066, -0.145], [-2e-4, 4e-4]),
        (other, [-0.084, -0.135], [1.7e-3, -2.8e-3]),
    ):
        path = rk.circle(machine, 0.03, 0.3, centre=centre)
        runs = [rk.simulate(machine, law(400.0, 40.0, None), path, offset) for law in (rk.CTC, Same)]
        np.testing.assert_allclose(runs[0].x, runs[1].x, rtol=0, atol=1e-9)


def agrees(robot, law, model=None, duration=0.2):
    offset = OFFSET[: robot.n_arms]
    # Up to 8 m/s^2, sixteen times the chapter: the engine's Runge-Kutta step of 1 ms is at rounding level there.
    trajectory = rk.circle(robot, radius=0.1 * duration**2, duration=duration)
    run = rk.simulate(robot, law, trajectory, offset, model=model)
    states, q_a, c = reference(robot, law, trajectory, offset, model)
    np.testing.assert_allclose(run.q_a, q_a, rtol=0, atol=1e-10)
    np.testing.assert_allclose(run.c, c, rtol=0, atol=1e-10)
    np.testing.assert_allclose(run.x, states[:, :2], rtol=0, atol=1e-10)


def to_singularity(robot, dt, height):
    """In 0.5 s to a place above the midpoint of a five-bar's base, where its distal links are parallel, and back."""
    t, w, way = dt * np.arange(round(0.5 / dt) + 1), 4.0 * np.pi, 0.5 * (height - 0.16)
    y = np.stack([0.16 + way * (1.0 - np.cos(w * t)), way * w * np.sin(w * t), way * w * w * np.cos(w * t)])
    x, xd, xdd = y[..., None] * [0.0, 1.0]
    return rk.follow(robot, t, robot.base.mean(axis=0) + x, xd, xdd)


@pytest.mark.parametrize("dt, error", [(5e-3, 5e-9), (1e-2, 1e-7)])
def test_near_an_input_singularity_holds_err_as_little_as_simulate_says(dt, error):
    robot, law = rk.load("five_bar"), rk.CTC(400.0, 40.0, (0, 1))
    path = to_singularity(robot, dt, 0.02)
    assert np.arcsin(np.abs(rk.distal_cross_products(robot, path.q)).min()) == pytest.approx(0.2, rel=0.01)
    states, _, c = reference(robot, law, path, np.zeros(2))
    assert np.abs(c).max() < 0.8
    run = rk.simulate(robot, law, path)
    assert np.linalg.norm(run.x - states[:, :2], axis=1).max() < error
    study = rk.sweep(robot, law, path, np.zeros((2, 2)))
    np.testing.assert_allclose(study.x_final[1], run.x[-1], rtol=0, atol=1e-12)


def test_near_an_input_singularity_what_a_hold_errs_is_its_step():
    """The same torques in holds of one, two and four steps: the error falls with the fourth power of the step."""
    robot, law = rk.load("five_bar").replace(friction=0.0), rk.CTC(400.0, 40.0, (0, 1))
    # To the nearest place: afterwards the same torques would throw a machine ever further that is not controlled.
    states, _, c = reference(robot, law, to_singularity(robot, 5e-3, 0.02), np.zeros(2), samples=51)
    held, errors = np.append(c, np.zeros((50, 2)), axis=0), []
    for times in (1, 2, 4):
        path = to_singularity(robot, 5e-3 / times, 0.02)
        run = rk.simulate(robot, lambda t, q_a, qd_a, want: held[int(t / 5e-3 + 1e-6)], path)
        errors.append(np.abs(run.x[: 50 * times + 1 : times] - states[:, :2]).max())
    orders = np.log2(errors[:-1]) - np.log2(errors[1:])
    assert np.round(orders).tolist() == [4.0, 4.0]


@pytest.mark.parametrize("name", LAWS)
def test_three_arms(name):
    agrees(machine(3), LAWS[name])


@pytest.mark.parametrize("N", [2, 4])
@pytest.mark.parametrize("name", ["pd", "force", "ctc", "redundant_ctc"])
def test_two_and_four_arms(N, name):
    agrees(machine(N), LAWS[name], duration=0.1)


@pytest.mark.parametrize("name", ["force", "command", "redundant_ctc_line2"])
def test_gravity_load_friction_and_a_wrong_model(name):
    # v0 wide enough for a Runge-Kutta step of 1 ms to resolve the friction law.
    robot = machine(3, gravity=(0.0, -9.81), load=0.1, friction=4.2e-3, friction_velocity=5.0)
    model = robot.replace(lengths=[[0.2, 0.201], [0.199, 0.2], [0.2, 0.2]], load=0.05)
    agrees(robot, LAWS[name], model=model, duration=0.1)


def test_every_drive_its_own_gain():
    pd = rk.PD([7.0, 5.0, 9.0], [0.2, 0.3, 0.1])
    for law in (pd, rk.AntagonismFilter(pd), rk.CommandFilter(pd)):
        agrees(machine(3), law, duration=0.1)


def test_a_diagonal_that_is_written_as_a_matrix_is_one_to_the_engine_too():
    """Such as W = diag(R_el / k_t^2) of the filter; what couples coordinates goes through the textbook layer."""
    robot, drives, joints = machine(3), [7.0, 5.0, 9.0], [7.0, 5.0, 9.0, 0.1, 0.2, 0.3]
    setup = prepare(robot, rk.hold(robot, [0.02, 0.03], 0.01), rk.Sensors())
    pd = rk.PD(np.diag(drives), 0.2 * np.eye(3))
    laws = {
        rk.PD(drives, 0.2): pd,
        rk.CommandFilter(rk.PD(drives, 0.2)): rk.CommandFilter(pd),
        rk.AntagonismFilter(PD, W=drives): rk.AntagonismFilter(PD, W=np.diag(drives)),
        rk.CTC([900.0, 700.0], 60.0): rk.CTC(np.diag([900.0, 700.0]), 60.0 * np.eye(2)),
        rk.RedundantAPD(joints, 0.2): rk.RedundantAPD(np.diag(joints), 0.2 * np.eye(6)),
    }
    for law, same in laws.items():
        assert compiled.encode(same, setup) is not None
        agrees(robot, same, duration=0.1)
        rows = rk.sweep(robot, [law, same], rk.circle(robot, 0.03, 0.1), OFFSET[:3])
        np.testing.assert_array_equal(rows.energies[0], rows.energies[1])
    for coupled in (rk.PD(drives, 0.2 + np.eye(3)), rk.AntagonismFilter(PD, W=0.2 + np.eye(3))):
        assert compiled.encode(coupled, setup) is None
        agrees(robot, coupled, duration=0.1)


def test_switching_goes_by_the_directions_of_distal_links_whatever_the_lengths():
    robot = rk.load().replace(lengths=[[0.22, 0.2], [0.18, 0.3], [0.27, 0.22]], friction=0.0)
    law = rk.SwitchedCTC(400.0, 40.0, hysteresis=1.0, pose="true")
    run = rk.simulate(robot, law, rk.circle(robot, 0.06, 0.4))
    assert np.array_equal(run.pairs, law.pairs(robot, run.q)) and run.switches > 0


@pytest.mark.parametrize("mode", [[1, 1, 1], [-1, -1, -1]])
@pytest.mark.parametrize("turn", [0.0, 0.3])
def test_of_equally_good_pairs_every_switched_run_takes_the_first(mode, turn):
    # In the centroid of equal arms all |d_j x d_k| are sqrt(3)/2, and equal offsets keep the threefold symmetry.
    way = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    robot = rk.load().replace(friction=0.0, mode=mode, base=rk.load().base @ way.T)
    path, law = rk.hold(robot, [0.0, 0.0], 0.02), rk.SwitchedCTC(400.0, 40.0)
    assert law.choose(robot, path.q[0]) == (0, 1)
    for offset in (0.0, 1e-3, 3e-3, -3e-3):
        in_python = rk.simulate(robot, rk.SwitchedCTC(400.0 * np.eye(2), 40.0), path, offset)
        for run in (rk.simulate(robot, law, path, offset), in_python):
            assert np.all(run.pairs == (0, 1))
            np.testing.assert_allclose(run.c, in_python.c, rtol=0, atol=1e-9)


def test_smooth_sign_is_tanh():
    from rapkm_lite.engine.jit import COMPILED
    from rapkm_lite.engine.leaves import smooth_sign

    function = smooth_sign
    if COMPILED:
        import numba

        function = numba.njit(lambda z: smooth_sign(z))
    z = np.concatenate([np.linspace(-30, 30, 2001), np.logspace(-12, 2, 200)])
    np.testing.assert_allclose([function(v) for v in z.tolist()], np.tanh(z), rtol=1e-15, atol=0)
    # Friction of fast drives is constant: exactly so.
    assert function(20.0) == 1.0 == -function(-20.0)


def test_small_angle_is_arcsin():
    from rapkm_lite.engine.leaves import small_angle

    s = np.linspace(-0.1, 0.1, 401)
    # The series of arcsin cut after s^17 leaves less than 0.01 |s|^19, its last three operations a rounding each.
    angle = np.array([getattr(small_angle, "py_func", small_angle)(float(v)) for v in s])
    np.testing.assert_array_max_ulp(angle, np.array([math.asin(v) for v in s]), 2)


SHORT = """
import numpy as np, rapkm_lite as rk
robot = rk.load().replace(gravity=(0.0, -1.0))
path = rk.circle(robot, radius=0.03, duration=0.2)
laws = [rk.PD(7.05, 0.225), rk.AntagonismFilter(rk.PD(7.05, 0.225)), rk.CommandFilter(rk.PD([7, 6, 5], 0.2)),
        rk.CTC(900.0, 60.0), rk.RedundantCTC(900.0, 60.0)]
runs = [rk.simulate(robot, law, path, [4e-3, -2e-3, 5e-3]) for law in laws]
study = rk.sweep(robot, laws[1], path, 1e-3 * np.arange(6.0).reshape(2, 3))
print(" ".join(float(v).hex() for run in runs for v in np.concatenate([run.x, run.q_a, run.c], axis=1).ravel()))
print(" ".join(float(v).hex() for v in np.concatenate([study.energies.ravel(), study.antagonistic_energy])))
"""


def numbers(**environment):
    done = subprocess.run(
        [sys.executable, "-c", SHORT], env={**os.environ, **environment}, capture_output=True, text=True, check=True
    )
    assert done.stderr == ""
    return np.array([float.fromhex(v) for v in done.stdout.split()])


def test_links_after_a_small_step_are_those_of_the_new_place_to_first_order():
    """Taylor: what `moved` leaves out falls with the square of the step."""
    from rapkm_lite.engine.leaves import geometry, moved

    make, move = getattr(geometry, "py_func", geometry), getattr(moved, "py_func", moved)
    arm, step = (0.1, -0.05, 0.04, 0.5 * (0.04 - 0.03), -1.0), np.array([3e-5, -2e-5])
    for x in ((0.2, 0.15), (0.0, 0.1), (-0.05, -0.2)):
        links = make(*arm, *x)[0]
        left = [np.abs(np.subtract(move(links, *s), make(*arm, *(x + s))[0])) for s in (step, step / 2)]
        np.testing.assert_allclose(left[0], 4 * left[1], rtol=1e-2, atol=1e-13)
        assert left[0].max() > 1e-10


def test_the_pose_of_measured_angles_does_not_depend_on_where_its_search_begins():
    """The least-squares pose is one point, also where arms are nearly stretched: Newton's search ends at rounding."""
    robot, rng = machine(3), np.random.default_rng(3)
    plant, found = Plant(robot, rk.hold(robot, (0.0, 0.0), 0.01)), 0
    for x in rng.uniform(-0.25, 0.25, (2000, 2)):
        if not rk.reachable(robot, x):
            continue
        q_a = rk.inverse_kinematics(robot, x)[:3] + rng.normal(0.0, 3e-3, 3)
        guesses = x, x + 10 ** rng.uniform(-9, -6) * rng.normal(size=2)
        poses = [plant.nearest(q_a, guess) for guess in guesses]
        if None in poses:
            continue
        again = plant.nearest(q_a, poses[0])
        np.testing.assert_allclose(poses, [again, again], rtol=0, atol=1e-13)
        near = np.array(again) + 2e-8 * rng.normal(size=2)
        np.testing.assert_allclose(plant.nearest(q_a, near), again, rtol=0, atol=1e-13)
        found += 1
    assert found > 500


def test_without_numba_the_same_numbers():
    pytest.importorskip("numba")
    np.testing.assert_allclose(numbers(RAPKM_LITE_NUMBA="0"), numbers(), rtol=0, atol=1e-12)


ROOTS = """if True:
    import re, rapkm_lite as rk
    from rapkm_lite.engine.loop import closed_loops
    robot = rk.load().replace(friction=0.0)
    path = rk.hold(robot, (0.0, 0.0), 0.01)
    rk.simulate(robot, rk.PD(7.0, 0.2), path)
    rk.sweep(robot, rk.PD(7.0, 0.2), path, [[0.0] * 3] * 2)
    print(*(len(re.findall(r"\\tv?sqrtpd", code)) for code in closed_loops.inspect_asm().values()))
"""
BESIDE = """if True:
    import operator, sys, rapkm_lite as rk
    robot = rk.load().replace(friction=0.0)
    path = rk.hold(robot, (0.0, 0.0), 0.01)
    run = rk.simulate(robot, rk.PD(7.0, 0.2), path, [4e-3, -2e-3, 5e-3])
    if len(sys.argv) > 1:
        from numba import njit, types
        from numba.extending import overload

        @overload(operator.sub)
        def nothing_less(one, other):
            if isinstance(one, types.UnicodeType):
                return lambda one, other: one

    else:
        assert not {"scipy.linalg", "numba.np.arraymath"} & set(sys.modules)
        from rapkm_lite.engine.loop import closed_loops
        (loaded,) = closed_loops.overloads.values()
        # Names that Python asks for; of globals, those of the wrapper, and none of what is inlined.
        told = str(loaded.library._shared_module)
        assert f'@{loaded.fndesc.llvm_cpython_wrapper_name}(' in told and "call" not in told
        assert [env.env_name for env in loaded.referenced_envs] == [closed_loops.targetctx.get_env_name(loaded.fndesc)]
    study = rk.sweep(robot, rk.PD(7.0, 0.2), path, [[4e-3, -2e-3, 5e-3]] * 2)
    if len(sys.argv) > 1:
        assert njit(lambda one, other: one - other)("as it was", 1) == "as it was"
        assert njit(lambda row: row[-1] + row[0])(run.c[0]) == run.c[0, -1] + run.c[0, 0]
    print(run.energy.sum().hex(), study.energy[0].sum().hex())
"""


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="instructions of other processors")
def test_kernels_take_the_roots_of_arms_and_of_runs_several_at_once(tmp_path):
    """A Runge-Kutta step has four stages, each with a square root per arm: alone, a kernel would be slow in silence."""
    pytest.importorskip("numba")
    from llvmlite import binding

    if not binding.get_host_cpu_features().get("avx2"):
        pytest.skip("registers hold two numbers, of which two roots at once take as long as one after the other")
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path), "RAPKM_LITE_NUMBA": "1"}
    done = subprocess.run([sys.executable, "-c", ROOTS], env=environment, capture_output=True, text=True, check=True)
    single, study = map(int, done.stdout.split())
    assert single >= 4 and study >= 4


def test_kernels_and_what_others_compile_leave_each_other_alone(tmp_path):
    """Another package may teach Numba a new difference between two kernels, and count from the end of an array; a
    kernel from the cache needs nothing of what Numba would import to compile one, comes without the code that it was
    made from, and gives the same bits."""
    pytest.importorskip("numba")
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path), "RAPKM_LITE_NUMBA": "1"}
    first, again = (
        subprocess.run(
            [sys.executable, "-c", BESIDE, *words], env=environment, capture_output=True, text=True, check=True
        )
        for words in (["first"], [])
    )
    assert first.stdout == again.stdout
    assert first.stderr == again.stderr == ""


def test_read_only_package_folder(tmp_path):
    pytest.importorskip("numba")
    import shutil
    from pathlib import Path

    package = Path(rk.__file__).parent
    shutil.copytree(package, tmp_path / "rapkm_lite", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(package.parent / "data", tmp_path / "data")
    code = """if True:
        import os, rapkm_lite as rk
        assert rk.__path__[0].startswith(os.getcwd())
        robot = rk.load()
        rk.simulate(robot, rk.PD(7.0, 0.2), rk.hold(robot, (0.0, 0.0), 0.01))
    """
    (tmp_path / "rapkm_lite" / "__pycache__").write_text("no folder, so nothing can be written here")
    (tmp_path / "rapkm_lite" / "engine" / "__pycache__").write_text("nor here")
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "cache")}
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""


@pytest.mark.parametrize("gains", [[7.05, 2e-4, 2e-4], [7e-5, 7.05, 3e-5]])
def test_commands_change_no_force_however_unequal_the_gains(gains):
    """Commands (18) leave the force of the drives, as (16) does."""
    robot, pd = machine(3), rk.PD(gains, 0.2)
    path = rk.circle(robot, 0.03, 0.1, dt=2e-3)
    run = rk.simulate(robot, rk.CommandFilter(pd, "true"), path, OFFSET[:3])
    A = rk.control_matrix(robot, run.q)
    asked = pd.torque(robot, run.q, run.qd, run.q_a + OFFSET[:3], run.qd_a, path)
    force, wanted = (np.einsum("kij,ki->kj", A, c) for c in (run.c, asked))
    np.testing.assert_allclose(force, wanted, rtol=0, atol=1e-10 * np.abs(wanted).max())


def test_the_engine_leaves_a_law_whose_drive_outweighs_all_others_together():
    """Then A^T W^-1 A is nearly of rank one; with two heavy drives, or one that weighs nothing, it is not."""
    setup = prepare(machine(3), rk.hold(machine(3), [0.02, 0.03], 0.01), rk.Sensors())
    for ease, known in (([1.0, 1.0, 1e-9], True), ([1e9, 1e9, 1.0], True), ([1e9, 1.0, 1.0], False)):
        law = rk.AntagonismFilter(PD, W=1.0 / np.array(ease))
        assert (compiled.encode(law, setup) is not None) == known


@pytest.mark.parametrize("W", [[1e-12, 1.0, 1.0], [1.0, 1e-9, 1.0], [1e-12, 1e-6, 1.0]])
def test_weights_change_no_force_however_unequal(W):
    """A^T (A^T)_W^+ = I in (11): the force is that of the same law without weights, in runs and in studies."""
    robot = machine(3)
    path = rk.circle(robot, 0.03, 0.1, dt=2e-3)
    pairs = [
        (rk.AntagonismFilter(PD, "true", W), PD),
        (
            rk.AntagonismFilter(
                rk.compiled(lambda t, q_a, qd_a, d: -7.05 * (q_a - d.q_a) - 0.225 * (qd_a - d.qd_a)), W=W
            ),
            PD,
        ),
        (rk.CTC(400.0, 40.0, None, W, "true"), rk.CTC(400.0, 40.0, None, pose="true")),
        (rk.APD(7.0, 0.2, (0, 1), W, "true"), rk.APD(7.0, 0.2, (0, 1), pose="true")),
    ]
    for law, plain in pairs:
        run = rk.simulate(robot, law, path)
        A = rk.control_matrix(robot, run.q)
        force = np.einsum("kij,ki->kj", A, run.c)
        asked = np.einsum("kij,ki->kj", A, plain.torque(robot, run.q, run.qd, run.q_a, run.qd_a, path))
        np.testing.assert_allclose(force, asked, rtol=0, atol=1e-9 * np.abs(asked).max())
        study = rk.sweep(robot, [law, plain], path, 0.0)
        np.testing.assert_allclose(study.energies[0], run.energy, rtol=1e-9)
