"""Studies: the same numbers as single runs, to the last bit the same in whatever company, failures never counted."""

import collections
import pickle
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np
import pytest

import rapkm_lite as rk
from rapkm_lite.simulation.faults import Fault

ROBOT = rk.load().replace(friction=0.0)
PATH = rk.circle(ROBOT, radius=0.05, duration=0.4)
PD = rk.PD(7.05, 0.225)
OFFSETS = np.random.default_rng(1).normal(0.0, 5e-3, (37, 3))
COLUMNS = ("energies", "torque_norm", "antagonistic_energy", "x_final", "rms_path_error", "largest_path_error")


def same(a, b):
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


LAWS = [
    PD,
    rk.AntagonismFilter(PD),
    rk.AntagonismFilter(PD, pose="true"),
    rk.CommandFilter(PD),
    rk.RedundantCTC(900.0, 60.0),
]


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
@pytest.mark.parametrize("sensors", [{}, {"encoder": 2000, "velocity_filter": 2e-3}], ids=["ideal", "encoder"])
def test_rows_are_single_runs(law, sensors):
    robot = ROBOT.replace(friction=4.2e-3, gravity=(0.0, -0.5))
    study = rk.sweep(robot, law, PATH, OFFSETS[:5], **sensors)
    assert not study.failed.any() and study.failure_time.mask.all()
    for i in range(5):
        run = rk.simulate(robot, law, PATH, OFFSETS[i], **sensors)
        np.testing.assert_allclose(study.energies[i], run.energy, rtol=0, atol=1e-11)
        np.testing.assert_allclose(study.antagonistic_energy[i], rk.antagonistic_energy(run), rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(study.x_final[i], run.x[-1], rtol=0, atol=1e-12)
        off = np.linalg.norm(run.x - PATH.x, axis=1)
        np.testing.assert_allclose(study.rms_path_error[i], np.sqrt(np.mean(off**2)), rtol=0, atol=1e-12)
        np.testing.assert_allclose(study.largest_path_error[i], off.max(), rtol=0, atol=1e-12)
        np.testing.assert_array_equal(run.path_error, off)
        mean_square = np.mean(np.sum(run.c[:-1] ** 2, axis=1))
        np.testing.assert_allclose(study.torque_norm[i], np.sqrt(mean_square), rtol=1e-10)


def test_rows_of_a_law_in_python_are_single_runs_too():
    def law(t, q_a, qd_a, desired):
        return -7.05 * (q_a - desired.q_a) - 0.225 * (qd_a - desired.qd_a)

    fast, slow = (rk.sweep(ROBOT, law, PATH, OFFSETS[:2]) for law in (PD, law))
    for name in COLUMNS:
        np.testing.assert_allclose(getattr(slow, name), getattr(fast, name), rtol=1e-10, atol=1e-12)


def test_bits_do_not_depend_on_chunks_threads_or_order():
    law = rk.AntagonismFilter(PD)
    study = rk.sweep(ROBOT, law, PATH, OFFSETS)
    for chunk in (1, 5, 16, 1000):
        same(study, rk.sweep(ROBOT, law, PATH, OFFSETS, chunk=chunk))
    with ThreadPoolExecutor(3) as executor:
        same(study, rk.sweep(ROBOT, law, PATH, OFFSETS, executor=executor, chunk=4))
    order = np.random.default_rng(2).permutation(len(OFFSETS))
    turned = rk.sweep(ROBOT, law, PATH, OFFSETS[order])
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(turned, name), getattr(study, name)[order])


def test_other_processes():
    with ProcessPoolExecutor(2) as executor:
        same(rk.sweep(ROBOT, PD, PATH, OFFSETS), rk.sweep(ROBOT, PD, PATH, OFFSETS, executor=executor, chunk=20))


def test_dask_cluster():
    distributed = pytest.importorskip("distributed", reason="needs the optional extra [cluster]")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        with distributed.Client(cluster) as client:
            executor = client.get_executor()
            same(rk.sweep(ROBOT, PD, PATH, OFFSETS), rk.sweep(ROBOT, PD, PATH, OFFSETS, executor=executor, chunk=20))


def test_a_failed_neighbour_changes_nothing_and_is_not_counted():
    gains = [rk.PD(p, 0.225) for p in (7.0, 1e4, 6.0, 5.0)]
    study = rk.sweep(ROBOT, gains, PATH, OFFSETS[0], failed="mask")
    assert study.failed.tolist() == [False, True, False, False]
    assert study.energies.mask[1].all() and not study.energies.mask[[0, 2, 3]].any()
    # How it ended is not told anew by what becomes of it while others go on.
    assert study.stopped == (None, "the machine left the workspace", None, None)
    assert 0.0 < study.failure_time[1] < 0.4
    assert all(np.all(np.isfinite(getattr(study, name).data)) for name in COLUMNS)
    same(
        rk.sweep(ROBOT, [gains[i] for i in (0, 2, 3)], PATH, OFFSETS[0]),
        rk.Sweep(
            ROBOT,
            PD,
            PATH,
            OFFSETS[:3],
            *(getattr(study, name)[[0, 2, 3]] for name in COLUMNS),
            study.failed[[0, 2, 3]],
            study.failure_time[[0, 2, 3]],
        ),
    )
    with pytest.raises(ValueError, match="1 of 4 runs failed"):
        np.asarray(study)
    with pytest.raises(rk.SimulationError, match=r"run 1: at t = 0\.\d+ s .*unstable gain") as caught:
        rk.sweep(ROBOT, gains, PATH, OFFSETS[0])
    assert caught.value.run == 1
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


@pytest.mark.parametrize("offset", [(-5e-3, 5e-3, 0.0), (0.0, 0.0, 0.0)])
def test_a_law_that_fails_at_the_last_sample_has_failed_in_a_study_too(offset):
    """The place that the law is told is out of its model's reach there, and earlier it was not."""
    robot = ROBOT.replace(friction=0.0)
    law, model = rk.CTC(400.0, 40.0, (0, 1), pose="true"), robot.replace(lengths=0.198)
    for duration in (0.037, 0.038):
        path = rk.hold(robot, [0.0, -0.1645], duration)
        row = rk.sweep(robot, law, path, [offset], model=model, failed="mask")
        try:
            rk.simulate(robot, law, path, offset, model=model)
            assert not row.failed[0]
        except rk.SimulationError as lost:
            assert row.failed[0] and row.failure_time[0] == lost.time
    assert row.failed[0] or not any(offset)


def test_reasons_of_a_study_are_found_with_its_model():
    """A model in another working mode loses the run; the right one would not."""
    model, law, path = ROBOT.replace(mode=[1, -1, 1]), rk.CTC(400.0, 40.0), rk.circle(ROBOT, 0.05, 0.3)
    study = rk.sweep(ROBOT, [law, law], path, np.zeros((2, 3)), model=model, failed="mask")
    with pytest.raises(rk.SimulationError) as caught:
        rk.simulate(ROBOT, law, path, model=model)
    assert study.failed.all() and study.reasons == 2 * (caught.value.reason,)
    assert not rk.sweep(ROBOT, law, path, np.zeros((1, 3))).failed.any()


def test_the_run_that_a_study_raises_has_the_offsets_of_its_row():
    offsets = [[1e-3, 0.0, 0.0], [0.0, 2e-3, 0.0]]
    with pytest.raises(rk.SimulationError) as caught:
        rk.sweep(ROBOT, [PD, rk.PD(7.05, 30.0)], rk.hold(ROBOT, [0.0, 0.0], 0.1), offsets)
    assert caught.value.run == 1 and caught.value.partial.offset.tolist() == offsets[1]


def test_a_study_ends_a_row_where_angles_fit_no_pose_at_the_sample_of_its_run():
    path, law = rk.hold(ROBOT, [0.02, 0.05], 0.01), rk.AntagonismFilter(PD)
    jumps = [rk.OffsetJump(i, 0.005, (3.0, -2.0, 1.0)[i]) for i in range(3)]
    study = rk.sweep(ROBOT, law, path, np.zeros((2, 3)), faults=jumps, failed="mask")
    with pytest.raises(rk.SimulationError, match="fit no pose") as caught:
        rk.simulate(ROBOT, law, path, faults=jumps)
    assert study.failed.all() and study.failure_time.tolist() == 2 * [caught.value.time]
    assert caught.value.time == pytest.approx(0.005)


def test_antagonistic_energy_of_unlike_drives_is_that_of_their_runs():
    robot = ROBOT.replace(resistance=[0.3, 0.6, 1.2], torque_constant=[0.02, 0.03, 0.04])
    study = rk.sweep(robot, PD, PATH, OFFSETS[:2])
    runs = [rk.simulate(robot, PD, PATH, offset) for offset in OFFSETS[:2]]
    np.testing.assert_allclose(study.antagonistic_energy, [rk.antagonistic_energy(run) for run in runs], rtol=1e-9)


def test_pythagoras():
    """reference.md, fact 6: of every torque c a true-pose filter R saves (R / k_t^2) int ||c_null||^2 dt."""
    study = rk.sweep(ROBOT, PD, PATH, OFFSETS[:3])
    for i in range(3):
        run = rk.simulate(ROBOT, PD, PATH, OFFSETS[i])
        R = rk.antagonism_filter(rk.control_matrix(ROBOT, run.q[:-1]))
        kept = np.einsum("kij,kj->ki", R, run.c[:-1])
        saved = rk.copper_loss(ROBOT, run.c[:-1], run.dt) - rk.copper_loss(ROBOT, kept, run.dt)
        np.testing.assert_allclose(study.antagonistic_energy[i], saved.sum(), rtol=1e-9)
    filtered = rk.sweep(ROBOT, rk.AntagonismFilter(PD, pose="true"), PATH, OFFSETS[:3])
    assert np.all(filtered.antagonistic_energy < 1e-20)


def test_turning_the_machine_permutes_the_energies():
    """A third of a turn maps the testbed and a triangle about its centre onto themselves."""
    path = rk.triangle(ROBOT, side=0.2, duration=0.9)
    turned = rk.triangle(ROBOT, side=0.2, duration=0.9, angle=2 * np.pi / 3)
    first = rk.sweep(ROBOT, PD, path, OFFSETS[:4])
    second = rk.sweep(ROBOT, PD, turned, np.roll(OFFSETS[:4], 1, axis=1))
    np.testing.assert_allclose(second.energies, np.roll(first.energies, 1, axis=1), rtol=1e-9)
    np.testing.assert_allclose(second.torque_norm, first.torque_norm, rtol=1e-9)


def test_a_law_of_a_student():
    def law(t, q_a, qd_a, desired):
        return -7.05 * (q_a - desired.q_a) - 0.225 * (qd_a - desired.qd_a)

    np.testing.assert_allclose(
        rk.sweep(ROBOT, law, PATH, OFFSETS[:2]).energies,
        rk.sweep(ROBOT, PD, PATH, OFFSETS[:2]).energies,
        rtol=0,
        atol=1e-11,
    )


GAINS = [rk.PD(7.05, 0.225), rk.PD(6.0, 0.2)]


class Listed(list):
    """A list of a user's."""


def array_of(laws):
    array = np.empty(len(laws), object)
    array[:] = laws
    return array


@pytest.mark.parametrize(
    "form",
    [tuple, Listed, collections.deque, array_of, iter, lambda laws: dict(enumerate(laws)).values()],
    ids=["tuple", "Listed", "deque", "array", "iter", "values"],
)
def test_laws_come_in_whatever_has_an_order(form):
    study, same_laws = (rk.sweep(ROBOT, laws, PATH, OFFSETS[:2]) for laws in (form(GAINS), GAINS))
    same(study, same_laws)
    assert study == same_laws and study.law == tuple(GAINS)
    unstable = rk.sweep(ROBOT, form([PD, rk.PD(7.05, 30.0)]), PATH, OFFSETS[0], failed="mask")
    assert unstable.reasons[0] is None and "unstable gain" in unstable.reasons[1]


def test_laws_without_an_order_are_refused_before_a_run():
    asked = []
    law = lambda t, q_a, qd_a, desired: asked.append(t)  # noqa: E731
    for laws in ({law}, frozenset([law]), {law: 1}):
        with pytest.raises(ValueError, match=r"law = .*; allowed: a law, such as PD"):
            rk.sweep(ROBOT, laws, PATH, OFFSETS[0])
    assert not asked


def test_a_study_has_one_law_or_one_per_row():
    study = rk.sweep(ROBOT, GAINS, PATH, OFFSETS[:2])
    assert rk.Sweep(**(study._fields() | {"law": Listed(GAINS)})) == study
    with pytest.raises(ValueError, match="law holds 1 for 2 rows; allowed: one law, or one per row"):
        rk.Sweep(**(study._fields() | {"law": [PD]}))


def test_a_law_that_cannot_go_to_another_process_is_told_where_it_can():
    """A lambda has no name in a module, by which pickle would find it there."""
    law = lambda t, q_a, qd_a, desired: -7.05 * (q_a - desired.q_a)  # noqa: E731

    class Local(Fault):
        def mark(self, table, t):
            pass

    with ProcessPoolExecutor(1) as executor:
        with pytest.raises((pickle.PicklingError, AttributeError), match="lambda") as e:
            rk.sweep(ROBOT, [PD, law], PATH, OFFSETS[:2], executor=executor, chunk=1)
        assert "only in modules" in e.value.__notes__[0] and e.value.partial.failed.tolist() == [False, True]
        with pytest.raises((pickle.PicklingError, AttributeError), match="Local"):
            rk.sweep(ROBOT, PD, PATH, OFFSETS[:2], executor=executor, faults=Local())
        same(rk.sweep(ROBOT, PD, PATH, OFFSETS[:2], executor=executor), rk.sweep(ROBOT, PD, PATH, OFFSETS[:2]))
    with ThreadPoolExecutor(1) as executor:
        same(rk.sweep(ROBOT, law, PATH, OFFSETS[0], executor=executor), rk.sweep(ROBOT, law, PATH, OFFSETS[0]))


def test_result_is_an_array_of_energies():
    study = rk.sweep(ROBOT, PD, PATH, OFFSETS[:3])
    assert len(study) == 3 and np.asarray(study).shape == (3, 3) and study.energy is study.energies
    assert repr(study).startswith("Sweep(3 runs, 0 failed, total energy ")


@pytest.mark.parametrize("of", [np.array, np.asarray])
def test_an_array_made_of_a_study_is_the_callers_own(of):
    study = rk.sweep(ROBOT, PD, PATH, OFFSETS[:3])
    before, mine = study.energies.copy(), of(study)
    mine[:] = 0.0
    np.testing.assert_array_equal(study.energies, before)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"offsets": np.zeros((4, 2))}, r"offsets has shape \(4, 2\); allowed: \(k, 3\)"),
        ({"offsets": np.zeros((0, 3))}, "allowed: at least one run"),
        ({"offsets": [[0.0, np.nan, 0.0]]}, r"offsets\[0, 1\] = nan"),
        ({"law": [PD, PD, PD]}, "law holds 3 for 2 rows"),
        ({"law": [PD, 7.0]}, r"law = 7\.0; allowed: a law, such as PD"),
        ({"failed": "ignore"}, "failed = 'ignore'; allowed: 'raise', 'mask'"),
        ({"chunk": 0}, "chunk = 0; allowed: >= 1"),
        ({"executor": 3}, "executor = 3; allowed: an executor"),
        ({"encoder": -5}, "encoder = -5; allowed: >= 1"),
    ],
)
def test_bad_arguments(arguments, message):
    with pytest.raises(ValueError, match=message):
        rk.sweep(**{"robot": ROBOT, "law": PD, "trajectory": PATH, "offsets": np.zeros((2, 3))} | arguments)


def test_a_law_that_is_itself_a_tuple_or_list_is_one_law():
    class Gains(collections.namedtuple("Gains", "K_P K_D")):
        def __call__(self, t, q_a, qd_a, desired):
            return -self[0] * (q_a - desired.q_a) - self[1] * (qd_a - desired.qd_a)

    class Listed(list):
        __call__ = Gains.__call__

    path = rk.hold(ROBOT, [0.0, 0.0], 0.05)
    for law in (Gains(7.05, 0.225), Listed([7.05, 0.225])):
        study = rk.sweep(ROBOT, law, path, OFFSETS[:2])
        assert study.law == law and study.reasons == (None, None)
        np.testing.assert_allclose(study.energies, rk.sweep(ROBOT, PD, path, OFFSETS[:2]).energies, rtol=1e-9)


def test_an_executor_whose_answers_are_no_futures_is_named():
    class Now:
        def submit(self, function, *given):
            return function(*given)

    with pytest.raises(ValueError, match=r"executor\.submit\(\.\.\.\) = .*; allowed: a Future of concurrent\.futures"):
        rk.sweep(ROBOT, PD, PATH, OFFSETS[:2], executor=Now())


@pytest.mark.parametrize("failed", ["raise", "mask"])
def test_rows_of_lost_runs_are_masked_whether_the_study_raises_or_not(failed):
    """Gains of 1e4 lose the second of three runs; where none is lost, a study that masks has masked arrays, too."""
    robot = rk.load().replace(friction=0.0)
    path = rk.hold(robot, [0.0, 0.0], 0.1)
    laws = [rk.PD(7.05, 0.225), rk.PD(1e4, 0.225), rk.PD(7.05, 0.225)]
    if failed == "raise":
        with pytest.raises(rk.SimulationError, match="run 1: ") as caught:
            rk.sweep(robot, laws, path, [4e-3, -2e-3, 5e-3])
        study = caught.value.sweep
    else:
        study = rk.sweep(robot, laws, path, [4e-3, -2e-3, 5e-3], failed="mask")
    for column in (study.energies, study.torque_norm, study.x_final, study.largest_path_error):
        masked = np.ma.getmaskarray(column).reshape(3, -1)
        assert np.array_equal(masked.all(axis=1), [False, True, False]) and not masked[[0, 2]].any()
    healthy = rk.sweep(robot, laws[::2], path, [4e-3, -2e-3, 5e-3], failed=failed)
    assert np.ma.isMaskedArray(healthy.energies) == (failed == "mask")
