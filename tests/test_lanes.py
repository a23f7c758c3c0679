"""Every law three times: alone in the compiled loop, in lanes, and through the textbook layer; and stiff friction."""

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from reference import reference
from samples import MACHINES, random_points

import rapkm_lite as rk
from rapkm_lite.engine import COMPILED
from rapkm_lite.engine.loop import closed_loops
from rapkm_lite.simulation import compiled
from rapkm_lite.simulation.setup import prepare

OFFSET = np.array([4e-3, -2e-3, 5e-3, -3e-3])
PD = rk.PD(7.05, 0.225)
MACHINE = MACHINES["testbed"].replace(gravity=(0.3, -1.0), load=0.05)
MODEL = MACHINE.replace(
    lengths=[[0.2, 0.201], [0.199, 0.2], [0.2, 0.2]],
    load=0.02,
    friction=3e-3,
    gravity=(-0.2, -0.9),
    friction_velocity=2.0,
)
COLUMNS = ("energies", "torque_norm", "antagonistic_energy", "x_final", "rms_path_error", "largest_path_error")


def neighbours():
    """Calm and wild gains on a path with friction, with what makes runs fly apart."""
    grid = [rk.PD(a, b) for a in np.geomspace(0.5, 300.0, 25) for b in np.geomspace(0.02, 10.0, 20)]
    # Runs that pass the bend of the friction law though no hold began near it, or fly apart.
    gains = [grid[i] for i in (200, 274, 402, 446, 450, 463, 467, 471, 477, 482, 483, 486, 488, 490)]
    dropout = {"encoder": 2000, "faults": [rk.EncoderDropout(0, 0.5, 1.0)]}
    return [(gains, options) for options in ({}, {"encoder": 2000}, dropout)]


@pytest.mark.parametrize(("gains", "options"), neighbours(), ids=["ideal", "counts", "dropout"])
@pytest.mark.parametrize("gravity", [(0.0, 0.0), (0.0, -2.0)], ids=["flat", "hanging"])
def test_a_run_with_friction_does_not_feel_its_neighbours(gains, options, gravity):
    """A neighbour that needs small steps changes neither rounding nor the sample at which a run is lost."""
    robot = rk.load().replace(gravity=gravity)
    path = rk.triangle(robot, duration=2.0, dt=2e-3)
    beside, alone = (
        rk.sweep(robot, gains, path, OFFSET[:3], failed="mask", chunk=chunk, **options) for chunk in (64, 1)
    )
    assert beside.failed.any()
    assert_array_equal(beside.failed, alone.failed)
    assert_array_equal(beside.failure_time.filled(-1.0), alone.failure_time.filled(-1.0))
    for name in COLUMNS:
        assert_array_equal(getattr(beside, name).filled(0.0), getattr(alone, name).filled(0.0))


class Textbook(rk.Law):
    """A law of the package that the engine does not know: it runs through the formulas of `control`."""

    def __init__(self, law):
        self.law = law

    def start(self, model, dt):
        return self.law.start(model, dt)

    def step(self, memory, sample):
        return self.law.step(memory, sample)

    def coordinates(self, memory):
        return self.law.coordinates(memory)


def laws(N):
    """All laws that the engine knows, for N drives."""
    pid = rk.PID(7.0, 90.0, 0.2, limit=0.5)
    gains = np.linspace(5.0, 8.0, N)
    mixed = np.linspace(300.0, 900.0, 2 * N)
    bare = {
        "PD": rk.PD(gains, 0.225),
        "PID": pid,
        "PID per drive": rk.PID(gains, 10 * gains, 0.03 * gains, 0.1 * gains),
    }
    model = {
        "APD of a pair": rk.APD(7.0, [0.2, 0.3], (0, 1)),
        "APD of an elbow": rk.APD([7.0, 5.0], 0.2, (1, N)),
        "APD in x": rk.APD([300.0, 400.0], 20.0, None),
        "APD weighted": rk.APD(7.0, 0.2, (0, 1), W=gains),
        "CTC of a pair": rk.CTC(900.0, 60.0, (1, 0)),
        "CTC of elbows": rk.CTC(900.0, 60.0, (N, N + 1)),
        "CTC in x": rk.CTC([900.0, 700.0], 60.0, None, pose="true"),
        "CTC weighted": rk.CTC(900.0, 60.0, None, W=gains),
        "SwitchedCTC": rk.SwitchedCTC(900.0, 60.0, 1.05),
        "SwitchedCTC, true pose": rk.SwitchedCTC(900.0, 60.0, 1.0, "true"),
        "RedundantAPD": rk.RedundantAPD(5.0, 0.2),
        "RedundantAPD (29)": rk.RedundantAPD(gains, 0.03 * gains),
        "RedundantAPD line 2": rk.RedundantAPD(gains, 0.2, projected=False),
        "RedundantCTC": rk.RedundantCTC(mixed, 60.0),
        "RedundantCTC (29)": rk.RedundantCTC(100 * gains, 9 * gains),
        "RedundantCTC line 2": rk.RedundantCTC(900.0, 60.0, projected=False, pose="true"),
    }
    around = {
        "filter": rk.AntagonismFilter(PD),
        "filter, true pose": rk.AntagonismFilter(PD, "true"),
        "weighted filter": rk.AntagonismFilter(PD, W=gains),
        "filter of PID": rk.AntagonismFilter(pid),
        "command filter": rk.CommandFilter(rk.PD(gains, 0.2)),
        "filter of APD": rk.AntagonismFilter(model["APD in x"]),
        "filter of CTC": rk.AntagonismFilter(model["CTC of a pair"], W=gains),
        "filter of SwitchedCTC": rk.AntagonismFilter(model["SwitchedCTC"]),
        "filter of RedundantAPD": rk.AntagonismFilter(model["RedundantAPD"]),
        "filter of line 2": rk.AntagonismFilter(model["RedundantCTC line 2"], "true"),
    }
    return bare | model | around


def cut(path, first, count):
    """Some samples of a path as a path of its own, which begins in motion."""
    rows = slice(first, first + count)
    return rk.follow(path.robot, path.t[:count], path.x[rows], path.xd[rows], path.xdd[rows])


def agree(robot, law, path, model=None, **options):
    """One run, its row in a sweep, and the textbook loop."""
    offset = OFFSET[: robot.n_arms]
    assert compiled.encode(law, prepare(robot, path, rk.Sensors(), model)) is not None
    run = rk.simulate(robot, law, path, offset, model=model, **options)
    slow = rk.simulate(robot, Textbook(law), path, offset, model=model, **options)
    for name in ("x", "xd", "q_a", "qd_a", "c"):
        assert_allclose(getattr(run, name), getattr(slow, name), rtol=0, atol=1e-9)
    assert_array_equal(run.pairs, slow.pairs)
    # In company, among runs that go other ways.
    offsets = np.array([-offset, 0 * offset, offset, 2 * offset])
    study = rk.sweep(robot, law, path, offsets, model=model, **options)
    assert_allclose(study.energies[2], run.energy, rtol=1e-11, atol=1e-11)
    assert_allclose(study.antagonistic_energy[2], rk.antagonistic_energy(run), rtol=1e-9, atol=1e-12)
    assert_allclose(study.x_final[2], run.x[-1], rtol=0, atol=1e-11)
    assert_allclose(study.torque_norm[2], np.sqrt(np.mean(np.sum(run.c[:-1] ** 2, axis=1))), rtol=0, atol=1e-11)
    return run


CIRCLE = cut(rk.circle(MACHINE, radius=0.11, duration=0.8), 180, 121)
SENSORS = {"encoder": 4000, "velocity_filter": 2e-3}
FAULTS = [
    rk.TorqueLimit([0.6, np.inf, 0.5]),
    rk.DeadDrive(0, 0.09),
    rk.EncoderDropout(2, 0.02, 0.03),
    rk.EncoderDropout(2, 0.05, 0.07),
    rk.EncoderDropout(1, 0.0, 0.01),
    rk.OffsetJump(1, 0.04, 2e-3),
    rk.OffsetJump(0, 0.0, -1e-3),
    rk.OffsetJump(2, 0.12, 1e-3),
]  # at the first sample, and at the last


@pytest.mark.parametrize("name", laws(3))
def test_gravity_load_friction(name):
    run = agree(MACHINE, laws(3)[name], CIRCLE)
    if "Switched" in name:
        assert run.switches > 0
    if name == "PID":
        assert (np.abs(run.c) == 0.5).any()  # the limit is met


@pytest.mark.parametrize("name", laws(3))
def test_another_model_and_real_encoders(name):
    agree(MACHINE, laws(3)[name], CIRCLE, model=MODEL, **SENSORS)


@pytest.mark.parametrize("name", ["CTC in x", "RedundantAPD (29)"])
@pytest.mark.parametrize("forces", ["friction", "gravity", "none"])
def test_forces_that_the_machine_or_its_model_has_alone(name, forces):
    """A law cancels what its model has, also where the machine has it not, and nothing else."""
    free = MACHINE.replace(friction=0.0, gravity=(0.0, 0.0))
    has = {"friction": {"friction": 6e-3}, "gravity": {"gravity": (0.3, -1.0)}, "none": {}}[forces]
    machine, model = (MACHINE, free) if forces == "none" else (free, free.replace(**has))
    agree(machine, laws(3)[name], CIRCLE, model=model)


@pytest.mark.parametrize("sensors", [{}, SENSORS], ids=["ideal", "encoder"])
@pytest.mark.parametrize(
    "name",
    [
        "PD",
        "PID",
        "filter",
        "weighted filter",
        "command filter",
        "APD of an elbow",
        "CTC in x",
        "SwitchedCTC",
        "RedundantAPD (29)",
        "RedundantCTC",
        "filter of PID",
    ],
)
def test_faults(name, sensors):
    run = agree(MACHINE, laws(3)[name], CIRCLE, faults=FAULTS, **sensors)
    assert not run.c[90:, 0].any() and (np.abs(run.c) <= [0.6, np.inf, 0.5]).all()


def longer(robot, times):
    """A machine whose lengths and gravity are multiplied, its masses divided by the square: the same inertias."""
    lengths = {name: times * getattr(robot, name) for name in ("base", "lengths", "centers", "gravity")}
    masses = {name: getattr(robot, name) / times**2 for name in ("masses", "load")}
    return robot.replace(**lengths, **masses, inertias=robot.inertias)


@pytest.mark.parametrize("name", ["filter", "CTC in x", "SwitchedCTC", "RedundantCTC line 2"])
def test_no_bit_depends_on_the_unit_of_length(name):
    """With a power of two all products and sums are the same but for their exponent, unless a bound has a unit."""
    law, runs, rows = laws(3)[name], [], []
    for times in (1.0, 128.0, 1.0 / 128.0):
        robot, model = longer(MACHINE, times), longer(MODEL, times)
        path = cut(rk.circle(robot, radius=0.11 * times, duration=0.8), 180, 121)
        runs.append(rk.simulate(robot, law, path, OFFSET[:3], model=model, faults=FAULTS, **SENSORS))
        rows.append(rk.sweep(robot, law, path, [OFFSET[:3], 2 * OFFSET[:3]], model=model, faults=FAULTS, **SENSORS))
        for attribute in ("q_a", "qd_a", "c", "pairs"):
            assert_array_equal(getattr(runs[-1], attribute), getattr(runs[0], attribute))
        assert_array_equal(runs[-1].x, times * runs[0].x)
        for column in ("energies", "torque_norm", "antagonistic_energy"):
            assert_array_equal(getattr(rows[-1], column), getattr(rows[0], column))


@pytest.mark.parametrize("machine", ["five_bar", "four_arms", "asymmetric"])
@pytest.mark.parametrize(
    "name",
    [
        "PD",
        "filter",
        "APD weighted",
        "CTC of elbows",
        "SwitchedCTC",
        "RedundantAPD",
        "RedundantCTC",
        "RedundantCTC line 2",
    ],
)
def test_other_machines(machine, name):
    robot = MACHINES[machine].replace(gravity=(0.0, -2.0))
    agree(robot, laws(robot.n_arms)[name], rk.circle(robot, radius=0.03, duration=0.12))


def test_five_arms_that_fill_up_two_vector_registers():
    """Sums run over eight arms, three of which weigh nothing: SciPy knows none of them."""
    turn, offset = 0.3 + 1.25 * np.arange(5), np.array([4e-3, -2e-3, 5e-3, -3e-3, 1e-3])
    base, lengths = 0.24 * np.stack([np.cos(turn), np.sin(turn)], axis=-1), np.linspace(0.2, 0.23, 10).reshape(5, 2)
    robot = rk.Manipulator(base=base, lengths=lengths, masses=[0.12, 0.15], mode=[1, -1, 1, 1, -1], friction=0.0)
    law, path = laws(5)["PD"], cut(rk.circle(robot, radius=0.05, duration=0.5), 100, 12)
    states, angles, torques = reference(robot, law, path, offset)
    run = rk.simulate(robot, law, path, offset)
    for found, true in ((run.x, states[:, :2]), (run.q_a, angles), (run.c, torques)):
        assert_allclose(found, true, rtol=0, atol=1e-9)


@pytest.mark.parametrize("law", [rk.CTC(400.0, 40.0, (3, 4)), rk.RedundantCTC(400.0, 40.0), rk.RedundantAPD(5.0, 0.2)])
def test_elbows_far_from_their_path(law):
    """Readings that are wrong by half a radian, and with them elbows: too far for a series of the arcsine."""
    path, offset = cut(rk.circle(MACHINE, radius=0.05, duration=0.4), 100, 21), np.array([0.6, 0.4, -0.5])
    run = rk.simulate(MACHINE, law, path, offset)
    read = rk.estimate_pose(MACHINE, run.q_a + offset, run.x)
    assert np.abs(read - path.q)[:, 3:].max() > 0.8
    assert_allclose(run.c, rk.simulate(MACHINE, Textbook(law), path, offset).c, rtol=0, atol=1e-9)
    study = rk.sweep(MACHINE, law, path, [0 * offset, offset])
    assert_allclose(study.energies[1], run.energy, rtol=1e-11, atol=1e-11)
    assert_allclose(study.x_final[1], run.x[-1], rtol=0, atol=1e-11)


@pytest.mark.parametrize("law", [rk.CTC(400.0, 40.0, (2, 3), pose="true"), rk.RedundantCTC(400.0, 40.0, pose="true")])
def test_an_elbow_that_is_folded_and_should_be_stretched_is_far_from_its_path(law):
    """Half a turn off, where the sine of the error is as small as at none; the other arm is as long in both places."""
    x = np.array([[0.005, 0.0], [0.35, 0.192]])
    x[1] *= 0.39987 / np.linalg.norm(x[1])
    aside = x.mean(axis=0) + 0.5 * (x[1] - x[0])[::-1] * [1.0, -1.0]
    robot = rk.Manipulator(base=[[0.0, 0.0], aside], lengths=0.2, masses=0.134)
    path = rk.follow(robot, [0.0, 1e-4], x, 0.0 * x, 0.0 * x)
    assert np.ptp(path.q[:, 2]) > 3.05 and np.ptp(path.q[:, 3]) < 1e-9
    run = rk.simulate(robot, law, path)
    assert_allclose(run.c, rk.simulate(robot, Textbook(law), path).c, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("size", [0.3, -0.3])
def test_the_pose_of_mirrored_readings_is_on_the_axis_of_the_machine(size):
    """A machine that is its own mirror image: no step across its axis ends the search for the place along it."""
    robot = MACHINES["five_bar"].replace(mode=[1, -1])
    path, offset = rk.hold(robot, (0.0, 0.1), 0.005), np.array([size, -size])
    for law in (rk.CTC(400.0, 40.0, None), rk.CTC(400.0, 40.0, (0, 1))):
        run = rk.simulate(robot, law, path, offset)
        assert_allclose(run.x[:, 0], 0.0, rtol=0, atol=1e-12)
        assert_allclose(run.c, -run.c[:, ::-1], rtol=0, atol=1e-10)
        assert_allclose(run.c, rk.simulate(robot, Textbook(law), path, offset).c, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", ["testbed", "four_arms"])
def test_the_pose_of_readings_that_are_far_off_is_that_of_the_textbook(name):
    """The engine's own search from a rough start against `estimate_pose`: torques, or no pose."""
    robot, rng, found = MACHINES[name].replace(friction=0.0), np.random.default_rng(8), 0
    law = rk.CTC(400.0, 40.0, None)
    for x in random_points(robot, 40, seed=8, bend=0.2):
        offset, path = rng.uniform(-1.2, 1.2, robot.n_arms), rk.hold(robot, x, 0.001)
        first = []
        for one in (law, Textbook(law)):
            try:
                first.append(rk.simulate(robot, one, path, offset).c[0])
            except rk.SimulationError as error:
                first.append(error.partial.c[0] if len(error.partial) else None)
        assert (first[0] is None) == (first[1] is None)
        if first[0] is not None:
            assert_allclose(first[0], first[1], rtol=1e-6, atol=1e-6)
            found += 1
    assert found > 5


def test_a_pose_is_found_where_the_squared_error_bends_downwards_all_around_its_start():
    """A step by that Hessian leads uphill, so that no half of it is taken: the search would end with no pose."""
    robot = MACHINES["four_arms"].replace(friction=0.0)
    path = rk.hold(robot, (0.031860931602637754, 0.1986939208956775), 0.001)
    offset = np.array([0.36442871451885944, 0.38804617777992745, 0.7403486750086571, 1.359597090300016])
    for law in (rk.CTC(400.0, 40.0, None), rk.AntagonismFilter(PD)):
        expected = rk.simulate(robot, Textbook(law), path, offset).c[0]
        assert_allclose(rk.simulate(robot, law, path, offset).c[0], expected, rtol=1e-6, atol=1e-6)


def test_a_jump_at_the_first_sample_is_an_offset_also_where_angles_hardly_tell_the_pose():
    """A five-bar's angles always fit: what a row is filled up with must not look like an error of theirs."""
    robot = MACHINES["five_bar"].replace(friction=0.0)
    path, size = rk.hold(robot, (0.17135016899900393, -0.037710297595029585), 0.002), -0.21710881417028727
    law, jump = rk.CTC(40.0, 4.0, None), [rk.OffsetJump(1, 0.0, size)]
    shifted, jumped = rk.simulate(robot, law, path, [0.0, size]), rk.simulate(robot, law, path, faults=jump)
    assert len(jumped) == len(shifted) == len(path)
    assert not rk.sweep(robot, law, path, [[0.0, 0.0]], faults=jump, failed="mask").failed.any()


# Company.
@pytest.mark.skipif(not COMPILED, reason="a row is filled up for vector registers, in compiled runs only")
@pytest.mark.parametrize("law", [rk.PD(5.0, 0.5), rk.CTC(400.0, 40.0, (0, 4)), rk.RedundantCTC(400.0, 40.0)])
def test_three_and_four_arms_share_a_kernel(law):
    """A fourth arm without mass, whose row of A is zero, leaves the machine of three what it is."""
    three, four = rk.load(), rk.load("four_arms")
    run = rk.simulate(three, law, rk.circle(three, 0.02, 0.1))
    kernels = len(closed_loops.signatures)
    rk.simulate(four, law, rk.circle(four, 0.02, 0.1))
    assert len(closed_loops.signatures) == kernels
    # An elbow is counted after the drives of its own machine.
    expected = (0, 4) if isinstance(law, rk.CTC) else (-1, -1)
    assert_array_equal(run.pairs, np.broadcast_to(expected, run.pairs.shape))


def test_laws_of_all_kinds_in_one_sweep():
    """A row has the bits of a sweep of its own, whatever its neighbours, the threads and the order."""
    every = list(laws(3).values())
    study = rk.sweep(MACHINE, every, CIRCLE, OFFSET[:3], faults=FAULTS, chunk=64)
    with ThreadPoolExecutor(2) as pool:
        others = [
            rk.sweep(MACHINE, every, CIRCLE, OFFSET[:3], faults=FAULTS, executor=pool, chunk=3),
            rk.sweep(MACHINE, every[::-1], CIRCLE, OFFSET[:3], faults=FAULTS),
        ]
    for name in COLUMNS:
        column = getattr(study, name)
        assert_array_equal(getattr(others[0], name), column)
        assert_array_equal(getattr(others[1], name)[::-1], column)
    for i, law in enumerate(every):
        own = rk.sweep(MACHINE, law, CIRCLE, OFFSET[:3], faults=FAULTS)
        for name in COLUMNS:
            assert_array_equal(getattr(own, name)[0], getattr(study, name)[i])


COARSE = cut(rk.circle(MACHINE, radius=0.11, duration=0.8, dt=2e-3), 90, 61)


def test_a_row_has_the_gains_of_its_own_law():
    """Of laws that run side by side, one as the other's neighbour: energies of single runs, whose torques differ."""
    pairs = [
        [rk.CTC([900.0, 700.0], 60.0, None), rk.CTC([400.0, 300.0], [30.0, 50.0], None)],
        [rk.APD([300.0, 400.0], 20.0, None), rk.APD([500.0, 250.0], [15.0, 25.0], None)],
        [rk.CommandFilter(rk.PD([5.0, 6.5, 8.0], 0.2)), rk.CommandFilter(rk.PD(6.0, [0.1, 0.2, 0.15]))],
        [rk.SwitchedCTC(900.0, 60.0, 1.0), rk.SwitchedCTC(900.0, 60.0, 1.5)],
    ]
    every = [law for pair in pairs for law in pair]
    study = rk.sweep(MACHINE, every, COARSE, OFFSET[:3])
    runs = [rk.simulate(MACHINE, law, COARSE, OFFSET[:3]) for law in every]
    for i, run in enumerate(runs):
        assert np.abs(run.energy - runs[i ^ 1].energy).max() > 1e-6
        assert_allclose(study.energies[i], run.energy, rtol=1e-11, atol=1e-11)
        assert_allclose(study.antagonistic_energy[i], rk.antagonistic_energy(run), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", ["PID", "filter", "SwitchedCTC"])
def test_another_sampling_time(name):
    agree(MACHINE, laws(3)[name], COARSE, faults=FAULTS, **SENSORS)


@pytest.mark.parametrize("name", ["PD", "filter", "CTC of elbows", "SwitchedCTC", "RedundantAPD"])
def test_neighbours_that_fail_change_no_bit(name):
    """Offsets that fit no pose, and offsets that drive the machine out of its workspace."""
    law, good = laws(3)[name], np.random.default_rng(3).normal(0.0, 3e-3, (5, 3))
    bad = np.array([[2.5, -2.5, 2.5], [0.8, 0.8, -0.8], [-1.2, 1.0, 1.2]])
    offsets = np.concatenate([bad[:1], good[:3], bad[1:], good[3:]])
    study = rk.sweep(MACHINE, law, CIRCLE, offsets, failed="mask")
    rows = [1, 2, 3, 6, 7]
    assert study.failed.any() and not study.failed[rows].any()
    own = rk.sweep(MACHINE, law, CIRCLE, good)
    for column in COLUMNS:
        assert_array_equal(getattr(study, column)[rows], getattr(own, column))
    alone = rk.sweep(MACHINE, law, CIRCLE, offsets, failed="mask", chunk=1)
    assert_array_equal(study.failure_time.filled(-1.0), alone.failure_time.filled(-1.0))
    assert study.reasons == alone.reasons


# Friction.
FAST = rk.circle(MACHINES["testbed"], 0.1, 0.3)
MOTIONS = {
    "a drive turns back": cut(FAST, 95, 26),
    "two turn back": cut(FAST, 160, 26),
    "at rest": rk.hold(MACHINES["testbed"], (0.02, 0.03), 0.015),
}


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize(
    ("friction", "velocity"),
    [(0.0, 0.01), (4.2e-3, 0.01), (4.2e-3, 1e-3), (0.1, 0.1), (0.3, 3e-3), (1.0, 0.03), (1.0, 1e-4), (4.2e-3, 1e-4)],
)
def test_friction_as_a_stiff_solver_has_it(friction, velocity, motion):
    """LSODA at its tightest in every hold."""
    robot, path = MACHINES["testbed"].replace(friction=friction, friction_velocity=velocity), MOTIONS[motion]
    states = reference(robot, PD, path, OFFSET[:3], method="LSODA", rtol=1e-12, atol=1e-15)[0]
    assert_allclose(rk.simulate(robot, PD, path, OFFSET[:3]).x, states[:, :2], rtol=0, atol=2e-9)
    study = rk.sweep(robot, PD, path, [OFFSET[:3], [0.0, 0.0, 0.0]])
    assert_allclose(study.x_final[0], states[-1, :2], rtol=0, atol=2e-9)


def test_friction_of_a_machine_that_is_thrown_about():
    """Thousands of rad/s^2, in which the bend of friction is passed unresolved, against the same solver: to 10 nm."""
    robot, path, law = MACHINES["testbed"], MOTIONS["a drive turns back"], rk.CTC(250.0**2, 500.0, None)
    offset = np.array([0.05, 0.04, -0.06])
    states = reference(robot, law, path, offset, method="LSODA", rtol=1e-12, atol=1e-15)[0]
    assert_allclose(rk.simulate(robot, law, path, offset).x, states[:, :2], rtol=0, atol=1e-8)
    assert_allclose(rk.sweep(robot, law, path, offset).x_final[0], states[-1, :2], rtol=0, atol=1e-8)


def test_friction_of_a_machine_with_a_payload_that_starts_at_once():
    """Creep that dies away within some tenths of a hold carries far enough to be integrated well: to 2 nm."""
    robot = MACHINES["asymmetric"].replace(gravity=[0.0, 0.0], friction=0.7, friction_velocity=0.1)
    path, law, offset = rk.hold(robot, [0.0, 0.0], 0.02), rk.PD(30.0, 0.8), np.array([0.01, -0.01, -0.01])
    states = reference(robot, law, path, offset, method="LSODA", rtol=1e-12, atol=1e-15)[0]
    assert_allclose(rk.simulate(robot, law, path, offset).x, states[:, :2], rtol=0, atol=2e-9)
    assert_allclose(rk.sweep(robot, law, path, offset).x_final[0], states[-1, :2], rtol=0, atol=2e-9)


def test_friction_of_neighbours_changes_no_bit():
    """Constant friction of drives that all move fast, and its tanh beside a neighbour that is slow, are one number."""
    robot, path = MACHINES["testbed"].replace(friction=[4e-3, 0.3, 0.0]), rk.circle(MACHINES["testbed"], 0.1, 1.0)
    offsets = np.random.default_rng(5).normal(0.0, 0.02, (40, 3))
    together = rk.sweep(robot, PD, path, offsets)
    for i in (0, 13, 39):
        alone = rk.sweep(robot, PD, path, offsets[i])
        assert_array_equal(together.energies[i], alone.energies[0])
        run = rk.simulate(robot, PD, path, offsets[i])
        assert_allclose(alone.energies[0], run.energy, rtol=0, atol=1e-11 * np.abs(run.energy).max())


def test_a_run_that_is_beyond_its_reach_waits_for_its_neighbour_as_it_is():
    """Thrown out across a drive with friction, which it passes in one step, beside a run that stops this drive in many:
    it is lost with the sample with which it is lost alone.  No step leads nowhere, also where inertia has no end."""
    robot = MACHINES["testbed"].replace(friction=[4e-3, 0.0, 0.0], friction_velocity=1e-3)
    law, path = rk.PD(1.0, 0.1), cut(rk.circle(robot, 0.05, 0.2), 60, 6)
    at = rk.at(robot, path.q[0], path.qd[0])
    along = at.A[0] / np.linalg.norm(at.A[0])
    across = np.array([-along[1], along[0]])
    # No error but that of the encoders: it is the torque.
    thrown, stopped = (-at.A_T_pinv @ at.minimal[0] @ xdd for xdd in (3.5e5 * across, -6e3 * along))
    alone, beside = (rk.sweep(robot, law, path, rows, failed="mask") for rows in ([thrown], [thrown, stopped]))
    assert alone.failed.all() and beside.failed.tolist() == [True, False]
    assert beside.failure_time[0] == alone.failure_time[0] > 0.0


def test_friction_beyond_all_measure():
    robot, still = MACHINES["testbed"].replace(friction=50.0, friction_velocity=1e-6), MOTIONS["at rest"]
    words = r"f_c / v0 = 5e\+07 N m s/rad \(friction 50 N m, friction_velocity 1e-06 rad/s\) needs more than 4000 steps"
    for law in (PD, Textbook(PD)):
        with pytest.raises(rk.SimulationError, match=words):
            rk.simulate(robot, law, still, OFFSET[:3])
        with pytest.raises(rk.SimulationError, match="run 0: .*" + words):
            rk.sweep(robot, law, still, [OFFSET[:3], -OFFSET[:3]])


@pytest.mark.skipif(not COMPILED, reason="without a compiler")
def test_a_loop_over_runs_fills_the_widest_registers_of_the_processor():
    from llvmlite import binding
    from numba import types

    from rapkm_lite.engine.jit import outlined

    def double(w):
        for j in range(len(w)):
            w[j] *= 2.0

    loop: Any = outlined(double)
    loop.compile((types.float64[::1],))
    features = dict(binding.get_host_cpu_features())
    lanes = 8 if features.get("avx512f") else 4 if features.get("avx") else 2
    assert f"<{lanes} x double>" in "".join(loop.inspect_llvm().values())
