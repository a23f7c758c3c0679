"""Runs end well or say when and why; sensors against a few lines of NumPy; energies against what must be conserved."""

import dataclasses

import numpy as np
import pytest

import rapkm_lite as rk
from rapkm_lite.engine import rows
from rapkm_lite.simulation.compiled import Plant
from rapkm_lite.simulation.energy import root_mean_square_torque
from rapkm_lite.simulation.growth import growth
from rapkm_lite.simulation.setup import prepare

TESTBED = rk.load()
ROBOT = TESTBED.replace(friction=0.0)
LONGER = ROBOT.replace(lengths=0.28)
PD = rk.PD(7.05, 0.225)
OFFSET = np.array([4e-3, -2e-3, 5e-3])


def ends_well_or_says_why(*arguments, **options):
    """A finite result, or an error with a time inside the run."""
    try:
        run = rk.simulate(*arguments, **options)
    except rk.SimulationError as error:
        assert 0.0 <= error.time <= arguments[2].t[-1]
        assert f"at t = {error.time:.4f} s" in str(error)
        return error
    for array in (run.x, run.xd, run.q, run.qd, run.c, run.energy):
        assert np.all(np.isfinite(array))
    assert np.abs(rk.loop_constraints(run.robot, run.q)).max() < 1e-10
    return run


@pytest.mark.parametrize("K_P", np.logspace(-1, 4, 11))
@pytest.mark.parametrize("law", [lambda pd: pd, rk.AntagonismFilter, rk.CommandFilter], ids=["pd", "force", "command"])
def test_gains_over_five_decades(K_P, law):
    path = rk.triangle(ROBOT, duration=1.5)
    end = ends_well_or_says_why(ROBOT, law(rk.PD(K_P, 0.225)), path, OFFSET)
    if K_P >= 1e4:
        # K_P dt^2 / J = 5.6 with J = m l^2 / 3; a sampled PD loop needs less than 4.
        assert isinstance(end, rk.SimulationError) and "unstable gain" in end.reason


def test_unstable_damping():
    end = ends_well_or_says_why(ROBOT, rk.PD(7.05, 50.0), rk.triangle(ROBOT), OFFSET)
    assert isinstance(end, rk.SimulationError) and "unstable gain" in end.reason


@pytest.mark.parametrize("size", [0.05, 0.1, 0.2])
@pytest.mark.parametrize(
    "law",
    [PD, rk.AntagonismFilter(PD), rk.CommandFilter(PD), rk.CTC(900.0, 60.0), rk.RedundantCTC(900.0, 60.0)],
    ids=lambda law: type(law).__name__,
)
def test_large_offsets(size, law):
    path = rk.circle(ROBOT, radius=0.05, duration=1.0)
    for signs in ((1, 1, 1), (1, -1, 1), (-1, 1, 1), (-1, -1, -1)):
        ends_well_or_says_why(ROBOT, law, path, size * np.array(signs))


def test_fixed_pair_through_its_singularity():
    """The triangle crosses the singular curves of all three pairs (reference.md, fact 5)."""
    for pair in ((0, 1), (0, 2), (1, 2)):
        ends_well_or_says_why(ROBOT, rk.CTC(900.0, 60.0, pair), rk.triangle(ROBOT), OFFSET)


def test_a_minute():
    run = ends_well_or_says_why(ROBOT, rk.AntagonismFilter(PD), rk.circle(ROBOT, duration=60.0, turns=10), OFFSET)
    assert isinstance(run, rk.Run) and len(run.t) == 60001


def test_a_jump_over_the_boundary_is_seen():
    """An arm that passes its stretched pose within one hold comes back mirrored in these coordinates."""

    def push(t, q_a, qd_a, desired):
        return np.array([0.3, 0.0, 0.0])

    end = ends_well_or_says_why(ROBOT, push, rk.hold(ROBOT, (0.0, 0.0), 1.0))
    assert isinstance(end, rk.SimulationError) and "left the workspace" in end.reason
    # A constant push feeds nothing back: the gain is not to blame.
    assert "unstable gain" not in end.reason


@pytest.mark.parametrize("push", [[0.369, 0.18, 0.033], [-0.237, -0.19, 0.2], [0.008, 0.009, 0.202]])
def test_torques_that_stay_the_same_lose_the_machine_at_one_time_however_often_they_are_held(push):
    """The motion is one: the boundary is reached at an instant, and no hold jumps over it, alone or in a study."""
    # All drives at their limits, whatever they read.
    options = {"offset": -100.0 * np.sign(push), "faults": rk.TorqueLimit(np.abs(push))}

    def end(dt):
        path = rk.hold(ROBOT, (0.0, 0.0), 0.6, dt)
        with pytest.raises(rk.SimulationError, match="left the workspace") as caught:
            rk.simulate(ROBOT, PD, path, **options)
        np.testing.assert_array_equal(caught.value.partial.c, np.broadcast_to(push, caught.value.partial.c.shape))
        # Beside a machine that stands still: what is lost does not come back while the other one goes on.
        offsets = np.array([options["offset"], np.zeros(3)])
        study = rk.sweep(ROBOT, PD, path, offsets, faults=options["faults"], failed="mask")
        assert study.failed.tolist() == [True, False] and study.failure_time[0] == caught.value.time
        return caught.value.time

    instant = end(1e-4)
    for dt in (2e-3, 4e-3):
        assert end(dt) <= instant < end(dt) + dt


def test_a_run_keeps_what_repeats_it():
    robot = rk.load()
    model, path = robot.replace(lengths=0.201, masses=0.2), rk.circle(robot, 0.05, duration=0.2)
    run = rk.simulate(robot, rk.RedundantCTC(400.0, 40.0), path, [4e-3, 0.0, 0.0], 4000, model=model)
    again = rk.simulate(run.robot, run.law, run.trajectory, model=run.model, sensors=run.sensors, faults=run.faults)
    assert run.model == model and again == run and rk.simulate(robot, run.law, path).model == robot


def test_work_without_friction_is_the_kinetic_energy():
    run = rk.simulate(ROBOT, PD, rk.triangle(ROBOT, duration=1.5), OFFSET)
    kinetic = rk.kinetic_energy(ROBOT, run.q, run.qd)
    # Relative to the largest energy; a Runge-Kutta step of 1 ms is good to (rate dt)^5, about 1e-10 here.
    np.testing.assert_allclose(rk.mechanical_work(run).sum(), kinetic[-1], rtol=0, atol=1e-9)


@pytest.mark.parametrize("samples", [2, 3, 4])
def test_a_run_of_few_holds_has_their_mean(samples):
    robot = rk.load()
    run = rk.simulate(robot, rk.PD(7.05, 0.225), rk.hold(robot, [0.03, 0.02], 1e-3 * (samples - 1)), [4e-3, 0.0, 0.0])
    assert len(run.t) == samples
    square = sum(c @ c for c in run.c[:-1]) / (samples - 1)
    np.testing.assert_allclose(root_mean_square_torque(run), np.sqrt(square), rtol=1e-12)


@pytest.mark.parametrize("dt", [1e-3, 2.5e-3])
def test_quantized_angles_and_filtered_rates(dt):
    seen = []

    def law(t, q_a, qd_a, desired):
        seen.append((q_a.copy(), qd_a.copy()))
        return -7.05 * (q_a - desired.q_a) - 0.225 * (qd_a - desired.qd_a)

    path = rk.circle(ROBOT, radius=0.05, duration=0.5, dt=dt)
    sensors = {"encoder": 2000, "velocity_filter": 3e-3}
    run = rk.simulate(ROBOT, law, path, OFFSET, **sensors)
    q = np.round((run.q_a + OFFSET) * 2000 / (2 * np.pi)) * 2 * np.pi / 2000
    rate = np.zeros_like(q)
    for k in range(1, len(q)):
        rate[k] = rate[k - 1] + dt / (3e-3 + dt) * ((q[k] - q[k - 1]) / dt - rate[k - 1])
    np.testing.assert_allclose(np.array([s[0] for s in seen]), q, rtol=0, atol=1e-12)
    np.testing.assert_allclose(np.array([s[1] for s in seen]), rate, rtol=0, atol=1e-9)
    np.testing.assert_allclose(run.c, rk.simulate(ROBOT, PD, path, OFFSET, **sensors).c, rtol=0, atol=1e-9)


def test_a_run_that_begins_in_motion_measures_its_rates_from_the_start():
    """A filter without delay reads the true rates at the first sample, and a delay begins with them."""
    t = np.linspace(0.0, 0.2, 201)
    turn = 2 * np.pi * t
    out, along = (
        0.1 * np.stack(part, axis=-1) for part in ((np.cos(turn), np.sin(turn)), (-np.sin(turn), np.cos(turn)))
    )
    path = rk.follow(ROBOT, t, out, 2 * np.pi * along, -((2 * np.pi) ** 2) * out)
    for law in (rk.PD(7.05, 0.225), rk.RedundantCTC(400.0, 40.0)):
        ideal = rk.simulate(ROBOT, law, path)
        for delay in (0.0, 5e-3):
            run = rk.simulate(ROBOT, law, path, velocity_filter=delay)
            np.testing.assert_allclose(run.c[0], ideal.c[0], rtol=0, atol=1e-12)
    law, ideal = rk.PD(7.05, 0.225), rk.simulate(ROBOT, rk.PD(7.05, 0.225), path)
    for faults in ((), [rk.EncoderDropout(drive, 0.0, 2e-3) for drive in range(3)]):
        runs = [rk.simulate(ROBOT, one, path, velocity_filter=5e-3, faults=faults) for one in (law, textbook(law))]
        np.testing.assert_allclose(runs[0].c, runs[1].c, rtol=0, atol=1e-9)
    assert np.abs(runs[0].c[0] - ideal.c[0]).max() > 0.1, "a silent encoder shows no rate"


def test_mirrored_machine():
    """Mirroring x -> -x swaps arms 1 and 2 and turns every working mode sign."""
    mirror = ROBOT.replace(mode=[-1, -1, -1])
    path = rk.triangle(ROBOT, duration=1.5)
    back = rk.follow(mirror, path.t, path.x * [-1, 1], path.xd * [-1, 1], path.xdd * [-1, 1])
    one, two = rk.simulate(ROBOT, PD, path, OFFSET), rk.simulate(mirror, PD, back, -OFFSET[[1, 0, 2]])
    np.testing.assert_allclose(two.energy, one.energy[[1, 0, 2]], rtol=1e-9)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"offset": [0.0, 0.0]}, r"offset has shape \(2,\); allowed: one number or \(3,\)"),
        ({"offset": np.nan}, "offset = nan; allowed: finite numbers"),
        ({"encoder": 0}, "encoder = 0; allowed: >= 1"),
        ({"velocity_filter": -1.0}, "velocity_filter = -1; allowed: >= 0"),
        ({"robot": "testbed"}, "robot = 'testbed'; allowed: a Manipulator"),
        ({"trajectory": [[0.0, 0.0]]}, r"trajectory = .*; allowed: a Trajectory, such as triangle"),
        ({"model": "testbed"}, "model = 'testbed'; allowed: a Manipulator"),
        ({"model": rk.load("five_bar")}, "model has 2 arms, the machine 3"),
        ({"law": "PD"}, "law = 'PD'; allowed: a law, such as PD"),
        ({"law": lambda *a: None}, "law returned None"),
        ({"law": lambda *a: [1.0]}, r"law returned the shape \(1,\); allowed: \(3,\)"),
        ({"law": lambda *a: [1.0, np.inf, 0.0]}, r"\[1\] = inf; allowed: finite numbers"),
        ({"law": rk.PD([1.0, 2.0], 0.1)}, r"K_P has shape \(2,\); allowed: one number, \(3,\) or \(3, 3\)"),
        ({"law": rk.CTC(9.0, 6.0, (0, 6))}, r"independent = \(0, 6\); allowed: 2 different joint indices from 0 to 5"),
    ],
)
def test_bad_arguments(options, message):
    arguments = {"robot": ROBOT, "law": PD, "trajectory": rk.hold(ROBOT, (0.0, 0.0), 0.01)} | options
    with pytest.raises(ValueError, match=message):
        rk.simulate(**arguments)


def test_a_lost_fixed_pair_names_its_singularity():
    robot = rk.load().replace(friction=0.0)
    with pytest.raises(rk.SimulationError, match="singularity of its independent drives 2 and 3") as caught:
        rk.simulate(robot, rk.CTC(900.0, 60.0, (1, 2)), rk.triangle(robot), offset=[4e-3, -2e-3, 5e-3])
    # The path crosses the curve of this pair at 2.96 s and 3.53 s.
    assert 2.7 < caught.value.time < 3.0


def test_gains_too_weak_for_the_load_are_named():
    """Without gravity they would do: a hanging machine falls away from its desired pose."""
    hanging = ROBOT.replace(gravity=[0.0, -9.81])
    with pytest.raises(
        rk.SimulationError, match=r"the gains do not hold it: .* grows by the factor 1\.0\d+ per sample"
    ):
        rk.simulate(hanging, rk.PD(0.1, 0.01), rk.hold(hanging, [0.0, 0.0], 0.5))


@pytest.mark.parametrize("dt", [1e-3, 2e-3])
def test_columns_of_a_study_are_those_of_its_runs(dt):
    path = rk.triangle(ROBOT, side=0.05, duration=0.2, dt=dt)
    offsets = 1e-3 * np.array([[4.0, -2.0, 5.0], [0.0, 3.0, 1.0]])
    study = rk.sweep(ROBOT, rk.PD(7.05, 0.225), path, offsets)
    for i, offset in enumerate(offsets):
        run = rk.simulate(ROBOT, rk.PD(7.05, 0.225), path, offset)
        np.testing.assert_allclose(study.rms_path_error[i], np.sqrt(np.mean(run.path_error**2)), rtol=1e-9)
        np.testing.assert_allclose(study.largest_path_error[i], run.path_error.max(), rtol=1e-9)
        np.testing.assert_allclose(study.torque_norm[i], root_mean_square_torque(run), rtol=1e-10)
        np.testing.assert_allclose(study.energies[i], run.energy, rtol=0, atol=1e-12)
        np.testing.assert_allclose(study.antagonistic_energy[i], rk.antagonistic_energy(run), rtol=1e-9)
    assert study.model is ROBOT and dataclasses.replace(study, model=LONGER).model == LONGER


def test_a_hold_lasts_a_second_and_a_compiled_law_has_no_memory_unless_asked():
    assert rk.hold(ROBOT, [0.0, 0.0]).t[-1] == 1.0
    assert rk.compiled(lambda t, q_a, qd_a, d: -7.0 * (q_a - d.q_a)).memory == 0


@pytest.mark.parametrize("times", [1.0, 30.0, 3000.0])
def test_a_hold_takes_two_steps_per_time_in_which_creep_decays_or_six_more_than_one(times):
    """The rates of Gbar xdd = -A^T diag(f_c / v0) A xd add up to a trace, here at rest."""
    robot, x = rk.load(), [0.02, 0.05]
    robot, path = robot.replace(friction=times * robot.friction), rk.hold(robot, x, 0.01)
    q = rk.inverse_kinematics(robot, x)
    pose = rk.at(robot, q, 0 * q)
    drag = pose.A.T @ np.diag(robot.friction / robot.friction_velocity) @ pose.A
    rates, plant = np.linalg.eigvals(np.linalg.solve(pose.minimal[0], drag)), Plant(robot, path)
    plant.hold((*x, 0.0, 0.0), np.zeros(3), path.dt)
    decays = path.dt * rates.sum().real
    assert plant._w[rows.BLOCKS * len(plant._arms) + rows.STEPS] == np.ceil(decays + min(decays, 6.0))


@pytest.mark.parametrize("name", ["q_a", "qd_a"])
@pytest.mark.parametrize("velocity_filter", [None, 2e-3])
def test_what_was_measured_is_read_only_in_a_run(name, velocity_filter):
    """A law that writes into it would change what the next reading is compared with."""

    class Writes(rk.Law):
        def step(self, memory, sample):
            getattr(sample, name)[0] = 0.0
            return np.zeros(3), memory

    with pytest.raises(ValueError, match="read-only"):
        rk.simulate(ROBOT, Writes(), rk.hold(ROBOT, [0.02, 0.03], 0.01), velocity_filter=velocity_filter)


def test_a_law_without_coordinates_shows_none():
    """`pairs` is -1 then, whoever runs it; a law with coordinates shows them in every sample."""
    path = rk.hold(ROBOT, [0.02, 0.03], 0.01)
    task = rk.CTC(900.0, 60.0, None)
    for law in (PD, task, lambda t, q_a, qd_a, desired: -7.0 * (q_a - desired.q_a)):
        assert np.all(rk.simulate(ROBOT, law, path, OFFSET).pairs == -1)
    assert np.all(rk.simulate(ROBOT, rk.CTC(900.0, 60.0, (0, 2)), path, OFFSET).pairs == [0, 2])


# Long arms whose drives can turn right round, and a path once around all of them.
ROUND = rk.Manipulator(base=[[-0.1, 0.0], [0.1, 0.0], [0.0, 0.15]], lengths=1.0, masses=0.2)
LAP = rk.circle(ROUND, 1.0, 4.0)


def textbook(law):
    """The same law as a function, which runs through the textbook layer."""
    return lambda t, q_a, qd_a, desired: law.K_P * (desired.q[:3] - q_a) + law.K_D * (desired.qd[:3] - qd_a)


@pytest.mark.parametrize("filtered", [None, 2e-3])
def test_drives_that_stand_while_the_path_goes_round_keep_their_angles(filtered):
    """Angles are continuous: nothing moves, so none changes, whatever turn the path is on."""
    seen = []

    def slack(t, q_a, qd_a, desired):
        seen.append((q_a.copy(), qd_a.copy()))
        return np.zeros(3)

    run = rk.simulate(ROUND, slack, LAP, velocity_filter=filtered)
    assert np.ptp(run.q_a, axis=0).max() < 1e-12 and np.ptp(run.error, axis=0).min() > 5.0
    assert np.ptp([q for q, _ in seen], axis=0).max() < 1e-12 and np.abs([qd for _, qd in seen]).max() < 1e-9


@pytest.mark.parametrize("wrap", [lambda law: law, textbook], ids=["engine", "textbook"])
def test_work_of_drives_that_fall_turns_behind_is_the_energy_of_the_machine(wrap):
    """Without friction and gravity all work of the drives is kinetic energy, on whatever turn they are."""
    run = rk.simulate(ROUND, wrap(rk.PD(0.02, 0.001)), LAP)
    assert np.abs(run.error).max() > np.pi and np.abs(np.diff(run.q_a, axis=0)).max() < 0.1
    kinetic = rk.kinetic_energy(ROUND, run.q[-1], run.qd[-1]) - rk.kinetic_energy(ROUND, run.q[0], run.qd[0])
    assert rk.mechanical_work(run).sum() == pytest.approx(kinetic, abs=1e-9)
    # Beside a run that is never a turn behind, and one that hardly moves: in the end all its drives are a whole turn
    # behind, and each of them is near its path but for that.
    laws = [wrap(rk.PD(0.02, 0.001)), wrap(rk.PD(200.0, 20.0)), wrap(rk.PD(1e-6, 1e-6))]
    study = rk.sweep(ROUND, laws, LAP, [0.0, 0.0, 0.0])
    for law, energy in zip(laws, study.energies, strict=True):
        run = rk.simulate(ROUND, law, LAP)
        assert np.abs(np.diff(run.q_a, axis=0)).max() < 0.1
        np.testing.assert_allclose(energy, run.energy, rtol=1e-9)
    # No run is far from its path in the end, though all are a turn behind.
    twins = rk.sweep(ROUND, laws[2], LAP, np.zeros((2, 3)))
    np.testing.assert_allclose(twins.energies, [run.energy, run.energy], rtol=1e-9)


@pytest.mark.parametrize("wrap", [lambda law: law, textbook], ids=["engine", "textbook"])
def test_a_drive_begins_on_the_turn_of_the_path_though_the_model_has_it_elsewhere(wrap):
    """At 3.05 rad in the model and at -3.08 rad in the machine, which is 3.20 rad: the nearest turn."""
    model = ROBOT.replace(base=ROBOT.base - [[0.0, 0.0], [0.0, 0.0], [0.0, 0.03]])
    path = rk.hold(ROBOT, [-0.088, 0.053], 0.01)
    wanted, at = rk.inverse_kinematics(model, path.x[0])[2], rk.inverse_kinematics(ROBOT, path.x[0])[2]
    run = rk.simulate(ROBOT, wrap(rk.PD(7.05, 0.225)), path, model=model)
    assert wanted > 3.0 and at < -3.0 and run.q_a[0, 2] == pytest.approx(at + 2 * np.pi, abs=1e-12)


def test_pose_of_a_sample_is_on_the_turn_of_what_was_measured_and_found_once():
    robot = rk.load()
    path, turns = rk.hold(robot, [0.02, 0.03], 0.05), 2 * np.pi * np.array([1.0, 0.0, -2.0])
    controller = rk.Controller(rk.PD(7.0, 0.2), robot)
    sample = rk.Sample(controller, 0.0, path.q_a[0] + turns, path.qd_a[0], path[0], (path.x[0], path.xd[0]))
    q, _ = sample.pose("measured")
    np.testing.assert_allclose(q[:3], path.q_a[0] + turns, rtol=0, atol=1e-12)
    np.testing.assert_allclose(sample.pose("true")[0][:3], path.q_a[0], rtol=0, atol=1e-12)
    assert sample.pose("measured")[0] is q
    for part in (*sample.pose("measured"), *sample.pose("true")):
        with pytest.raises(ValueError, match="read-only"):
            part[0] = 0.0


def test_a_lap_later_a_loop_is_as_at_its_start_but_for_a_turn_of_each_drive():
    """Same place, same rest: so is what becomes of a small error, looked at beside the turn of the path there."""
    setup, last = prepare(ROUND, LAP, rk.Sensors()), len(LAP) - 1
    assert np.abs(LAP.q_a[last] - LAP.q_a[0]).min() > 6.0
    plant = Plant(ROUND, LAP)
    for k in (last, 0, last // 2):
        q, qd = plant.observe(k, (*LAP.x[k], *LAP.xd[k]))
        np.testing.assert_allclose(q, LAP.q_a[k], rtol=0, atol=1e-12)
        np.testing.assert_allclose(qd, LAP.qd_a[k], rtol=0, atol=1e-12)
    # One that stood still while the path went round is a turn behind: where a sample follows on the last one only.
    for k in range(len(LAP)):
        behind, _ = plant.observe(k, (*LAP.x[0], *LAP.xd[0]))
    np.testing.assert_allclose(behind, LAP.q_a[0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(plant.observe(last, (*LAP.x[0], *LAP.xd[0]))[0], LAP.q_a[last], rtol=0, atol=1e-12)
    for law in (rk.PD(200.0, 20.0), rk.PD(5.0, 0.1)):
        assert growth(setup, law, last) == pytest.approx(growth(setup, law, 0), rel=1e-8)


def test_filter_finds_the_pose_of_drives_that_are_turns_behind():
    """A matrix for W is the same law, but one of the textbook layer."""
    filters = [rk.AntagonismFilter(rk.PD(0.02, 0.001), W=W) for W in (None, np.eye(3))]
    compiled, plain = (rk.simulate(ROUND, law, LAP, offset=[0.02, -0.01, 0.0]) for law in filters)
    assert np.abs(compiled.error).max() > np.pi
    np.testing.assert_allclose(compiled.x, plain.x, atol=1e-7)
    np.testing.assert_allclose(compiled.energy, plain.energy, rtol=1e-7)


@pytest.mark.parametrize("drive", range(3))
def test_a_pose_far_from_all_readings_is_the_same_in_both_loops(drive):
    """Readings that contradict each other by some tenths of a radian, as those of an encoder that repeats itself."""
    silent = rk.EncoderDropout(drive, 0.2, 0.55)
    path, ends = rk.triangle(ROBOT, duration=1.5), []
    for W in (None, np.eye(3)):
        try:
            ends.append(rk.simulate(ROBOT, rk.AntagonismFilter(PD, W=W), path, faults=silent))
        except rk.SimulationError as error:
            ends.append(error.partial)
    assert len(ends[0]) == len(ends[1])
    np.testing.assert_allclose(ends[0].c, ends[1].c, atol=1e-6)


class Same(rk.CTC):
    """A law without a word of its own, which runs in the loop for laws in Python."""


@pytest.mark.parametrize(
    ("path", "fault"),
    [
        (rk.circle(TESTBED, 0.1, 1.0), rk.OffsetJump(0, 0.5, 1.0)),
        (rk.triangle(TESTBED), rk.EncoderDropout(1, 0.5, 4.0)),
        (rk.triangle(TESTBED), rk.EncoderDropout(0, 0.5, 4.0)),
    ],
)
def test_a_search_for_a_pose_takes_as_long_in_both_loops(path, fault):
    """Readings far from any pose, where Newton's steps are many."""
    ends = []
    for law in (rk.CTC(400.0, 40.0, None), Same(400.0, 40.0, None)):
        try:
            ends.append(len(rk.simulate(TESTBED, law, path, faults=[fault])))
        except rk.SimulationError as error:
            ends.append(error.time)
    assert ends[0] == pytest.approx(ends[1], abs=2e-3)


def test_loops_follow_the_same_samples_of_a_path_of_a_users_class():
    """Laws in Python ask a path for its samples, compiled ones for its columns: no class may tell them two things."""
    circle = rk.circle(ROBOT, 0.05, 0.1)
    fields = [getattr(circle, name) for name in ("n_arms", "x", "xd", "xdd", "q", "qd", "qdd", "t", "robot")]

    class Named(rk.Trajectory):
        def __getitem__(self, k):
            return getattr(self, k) if isinstance(k, str) else super().__getitem__(k)

    class Late(rk.Trajectory):
        def __getitem__(self, k):
            return super().__getitem__(max(k - 20, 0))

    class Turned(rk.Trajectory):
        @property
        def q_a(self):
            return super().q_a + 1e-3

    law = rk.PD(7.05, 0.225)
    assert rk.simulate(ROBOT, law, Named(*fields)).c.tolist() == rk.simulate(ROBOT, law, circle).c.tolist()
    for path in (Late(*fields), Turned(*fields)):
        for run in (rk.simulate, lambda *given: rk.sweep(*given, np.zeros(3))):
            with pytest.raises(
                ValueError, match=r"trajectory\[\d+\] of the class \w+ is not the row \d+ of x, xd, xdd"
            ):
                run(ROBOT, law, path)
