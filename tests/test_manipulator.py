"""The machine and its files: what is accepted, what is refused and how, and that shipped data load."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from samples import MACHINES, TESTBED, random_points

import rapkm_lite as rk

BASE = [[-0.2, 0.0], [0.2, 0.0]]
GOOD = {"base": BASE, "lengths": 0.25, "masses": 0.1}


# Defaults and derived values.
def test_defaults_are_slender_rods_with_the_mass_in_the_middle():
    robot = rk.Manipulator(base=BASE, lengths=[0.2, 0.3], masses=[[0.1, 0.2], [0.3, 0.4]])
    assert_allclose(robot.centers, [[0.1, 0.15], [0.1, 0.15]])
    assert_allclose(robot.inertias, np.array([[0.1 * 0.04, 0.2 * 0.09], [0.3 * 0.04, 0.4 * 0.09]]) / 12)
    assert (robot.n_arms, robot.n_joints, robot.n_constraints) == (2, 4, 2)
    assert not robot.gravity.any() and robot.load == 0.0


def test_machine_is_read_only():
    with pytest.raises(ValueError, match="read-only"):
        TESTBED.base[0, 0] = 1.0
    with pytest.raises(AttributeError):
        TESTBED.load = 1.0
    base = np.array(BASE)
    robot = rk.Manipulator(base=base, lengths=0.25, masses=0.1)
    base[0, 0] = 9.0
    assert robot.base[0, 0] == -0.2


def test_replace_carries_rods_along_and_keeps_given_inertias():
    heavier = TESTBED.replace(masses=0.268)
    assert_allclose(heavier.inertias, 2 * TESTBED.inertias)
    longer = TESTBED.replace(lengths=0.3)
    assert_allclose(longer.centers, 0.15)
    assert_allclose(TESTBED.replace(centers=0.08).replace(lengths=0.3).centers, 0.08)
    given = MACHINES["asymmetric"].replace(masses=0.2)
    assert_allclose(given.inertias, MACHINES["asymmetric"].inertias)
    assert TESTBED.replace(friction=0.0).same_kinematics(TESTBED)
    assert not TESTBED.replace(mode=-1).same_kinematics(TESTBED)
    assert not TESTBED.replace(base=TESTBED.base + [0.01, 0.0]).same_kinematics(TESTBED)
    assert not TESTBED.replace(lengths=0.201).same_kinematics(TESTBED)
    with pytest.raises(ValueError, match=r"unknown argument 'frictoin' \(did you mean 'friction'\?\); allowed: "):
        TESTBED.replace(frictoin=0.0)
    square = [[-0.2, -0.2], [0.2, -0.2], [0.2, 0.2], [-0.2, 0.2]]
    with pytest.raises(
        ValueError, match=r"base has 4 points; allowed: 3, or masses, .*friction, mode changed along with"
    ):
        TESTBED.replace(base=square, lengths=0.2)


def test_arms_can_be_left_out():
    five_bar = TESTBED.with_arms((0, 1))
    same = MACHINES["five_bar"]
    for key in ("base", "lengths", "masses", "centers", "inertias", "rotor_inertia", "friction", "mode"):
        assert_allclose(getattr(five_bar, key), getattr(same, key))
    for bad in ((0,), (0, 0), (0, 3), 1, "01"):
        with pytest.raises(ValueError, match=r"arms = .*; allowed: two or more different arm indices from 0 to 2"):
            TESTBED.with_arms(bad)


# Bad values.
BAD = [
    ("base", [[0, 0]], r"base has shape \(1, 2\); allowed: \(N, 2\) with at least two arms"),
    ("base", [0, 0], "base has shape"),
    ("base", [[0, 0, 0], [1, 0, 0]], "base has shape"),
    ("base", [[0, 0], [0, 0]], "base = .* holds one point twice"),
    ("base", [[np.nan, 0], [1, 0]], r"base\[0, 0\] = nan"),
    ("base", "two points", "base = 'two points' is not numeric"),
    ("base", [[0, 0], [1]], "base"),
    ("base", [[-1, 0], [1, 0]], "lengths = .* let no point be reached by all 2 arms"),
    ("lengths", -0.25, r"lengths\[0, 0\] = -0.25; allowed: > 0"),
    ("lengths", 0.0, "lengths"),
    ("lengths", 1j, "lengths = 1j is not numeric; allowed: real numbers"),
    ("lengths", [0.2, 0.2, 0.2], r"lengths has shape \(3,\); allowed: one number, \(2,\) or \(2, 2\)"),
    ("masses", -0.1, r"masses\[0, 0\] = -0.1; allowed: > 0"),
    ("masses", [0.1, np.inf], r"masses\[1\] = inf"),
    ("masses", "0.1", "masses = '0.1' is not numeric"),
    ("masses", True, "masses = True is not numeric"),
    ("masses", None, "masses = None is not numeric"),
    ("centers", np.nan, "centers"),
    ("centers", [0.1], "centers has shape"),
    ("inertias", -1e-5, "inertias"),
    ("rotor_inertia", -1e-6, "rotor_inertia"),
    ("rotor_inertia", [0] * 3, r"rotor_inertia has shape \(3,\); allowed: one number or \(2,\)"),
    ("resistance", 0.0, "resistance"),
    ("torque_constant", [0.1, -0.1], r"torque_constant\[1\] = -0.1; allowed: > 0"),
    ("friction", -1e-3, "friction"),
    ("friction_velocity", 0.0, "friction_velocity = 0; allowed: > 0"),
    ("friction_velocity", [0.1, 0.1], "friction_velocity has shape"),
    ("gravity", 9.81, "gravity has shape"),
    ("gravity", [0, 0, -9.81], "gravity has shape"),
    ("gravity", [[0, 0]], "gravity has shape"),
    ("load", -1.0, "load = -1; allowed: >= 0"),
    ("load", [1.0, 2.0], "load has shape"),
    ("mode", 0, "mode = 0; allowed"),
    ("mode", [1, 0.5], "mode"),
    ("mode", [1, 1, 1], "mode has shape"),
    ("mode", "+", "mode"),
]


@pytest.mark.parametrize(("key", "value", "message"), BAD, ids=range(len(BAD)))
def test_bad_values_are_named(key, value, message):
    with pytest.raises(ValueError, match=message):
        rk.Manipulator(**(GOOD | {key: value}))


def test_centres_of_mass_are_on_their_links():
    for bad in (0.21, [0.1, 0.21], -0.01):
        with pytest.raises(ValueError, match=r"centers = .* m; allowed: on the link"):
            TESTBED.replace(centers=bad)
    assert TESTBED.replace(centers=0.2).centers.max() == 0.2


def test_a_machine_without_inertia_is_refused():
    # All mass of the distal links in the elbows, none of it turning with them: the elbow joints would move freely.
    with pytest.raises(ValueError, match=r"inertias = .* positive definite mass matrix"):
        rk.Manipulator(**GOOD, centers=[0.1, 0.0], inertias=0.0)
    with pytest.raises(ValueError, match="positive definite"):
        rk.Manipulator(**GOOD, centers=[0.0, 0.1], inertias=0.0)
    assert rk.Manipulator(**GOOD, centers=[0.1, 0.1], inertias=0.0).n_arms == 2


@pytest.mark.parametrize("unit", [1.0, 1e-13, 1e6 / 3])
@pytest.mark.parametrize(
    ("base", "lengths", "meet"),
    [
        ([[-0.2, 0], [0.2, 0]], 0.1, True),  # just touching, stretched
        ([[-0.2, 0], [0.2, 0]], 0.0999, False),
        ([[0, 0], [0.3, 0]], [[0.5, 0.1], [0.05, 0.04]], False),  # the small arm inside the hole of the large one
        ([[0, 0], [0.3, 0]], [[0.5, 0.1], [0.05, 0.06]], True),
        ([[0, 0], [0.3, 0]], [[0.1, 0.5], [0.04, 0.05]], False),  # so it does not with the shorter links at the bases
        ([[0, 0], [0.3, 0]], [[0.1, 0.5], [0.06, 0.05]], True),
        ([[0, 0], [1, 0], [0.5, 5]], 0.3, False),  # two meet, the third does not
        ([[0, 0], [0.01, 0]], [[0.1, 0.1], [1, 1]], True),  # one annulus inside the other
    ],
)
def test_arms_must_be_able_to_meet(base, lengths, meet, unit):
    base, lengths = unit * np.array(base), unit * np.array(lengths)
    if meet:
        rk.Manipulator(base=base, lengths=lengths, masses=1.0)
    else:
        with pytest.raises(ValueError, match="arms that can meet"):
            rk.Manipulator(base=base, lengths=lengths, masses=1.0)


# Files.
@pytest.mark.parametrize("name", MACHINES)
def test_shipped_machines_load_and_say_where_each_number_comes_from(name):
    import tomllib

    robot = rk.load(name)
    q = rk.inverse_kinematics(robot, random_points(robot, 1))
    assert np.abs(rk.loop_constraints(robot, q)).max() < 1e-15
    tables = tomllib.loads(rk.data_path(f"{name}.toml").read_text(encoding="utf-8"))
    for table in ("manipulator", "control", "path"):
        for key, entry in tables[table].items():
            kept = set(entry) if isinstance(entry, dict) else entry
            assert kept == {"value", "unit", "source"}, f"[{table}] {key}"
    assert rk.load(rk.data_path(f"{name}.toml")).n_arms == robot.n_arms
    assert np.all(np.isfinite(rk.experiment(name).trajectory.qdd))


def test_testbed_is_the_machine_of_the_reference():
    assert_allclose(TESTBED.base, [[-0.2, -0.2 / np.sqrt(3)], [0.2, -0.2 / np.sqrt(3)], [0, 0.4 / np.sqrt(3)]])
    sides = np.linalg.norm(TESTBED.base - np.roll(TESTBED.base, 1, axis=0), axis=-1)
    assert_allclose(sides, 0.4)
    assert_allclose(TESTBED.masses, 0.134)
    assert_allclose(TESTBED.torque_constant, 0.0259)
    assert_allclose(TESTBED.friction, 4.2e-3)
    # The no-load current of the data sheet, 0.163 A, times the torque constant.
    assert_allclose(TESTBED.friction, 0.163 * TESTBED.torque_constant, rtol=0.02)


HEAD = "[manipulator]\nbase = [[-0.2, 0.0], [0.2, 0.0]]\nlengths = 0.25\nmasses = 0.1\n"
FILES = [
    (HEAD + "masss = 1.0\n", r"unknown TOML key 'masss' \(did you mean 'masses'\?\); allowed: base, centers"),
    (HEAD + "[controll]\nK_P = 1.0\n", r"unknown TOML table 'controll' \(did you mean 'control'\?\)"),
    ("[manipulator]\nbase = [[0.0, 0.0], [0.1, 0.0]]\nlengths = 0.2\n", "lacks 'masses'"),
    ("name = 'empty'\n", "lacks 'base'"),
    (HEAD.replace("0.1", "-0.1"), "masses"),
    ("base = [[\n", "is not valid TOML"),
    (HEAD + "load = {value = 1.0, unit = 'g'}\n", r"load in \[manipulator\] has the unit 'g'; allowed: 'kg'"),
    (HEAD + "load = {value = 1.0, origin = 'me'}\n", r"unknown entry of load in \[manipulator\] 'origin'"),
    ("manipulator = 3\n", r"manipulator = 3; allowed: a table"),
    (HEAD + "load = 'heavy'\n", "load = 'heavy' is not numeric"),
    (HEAD + "load = {unit = 'kg'}\n", "load"),
    (HEAD + "gravity = [0.0, nan]\n", r"gravity\[1\] = nan"),
]


@pytest.mark.parametrize(("text", "message"), FILES, ids=range(len(FILES)))
def test_bad_files_are_explained(tmp_path, text, message):
    path = tmp_path / "machine.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=message):
        rk.load(path)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(ValueError, match=r"there is no data file 'nowhere.toml'; allowed"):
        rk.load("nowhere")
    with pytest.raises(ValueError, match="cannot be read"):
        rk.load(tmp_path / "nowhere.toml")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ValueError, match="not valid TOML"):
        rk.load(tmp_path / "binary.toml")
    for bad in (3, None, ["testbed"]):
        with pytest.raises(ValueError, match=r"source = .*; allowed"):
            rk.load(bad)


def test_plain_values_and_names(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(HEAD, encoding="utf-8")
    assert str(rk.load(path)) == "Manipulator('mine': 2 arms, links 0.25 m, working mode ++)"
    assert str(MACHINES["asymmetric"]) == "Manipulator('asymmetric': 3 arms, links 0.2 to 0.25 m, working mode +++)"


def test_a_machine_prints_as_it_is_typed():
    made = {"base": [[-0.2, 0.0], [0.2, 0.0]], "lengths": 0.25, "masses": [0.1, 0.2], "mode": [1, -1]}
    robot = rk.Manipulator(**made, friction=[0.1, 0.1])
    assert repr(robot) == "Manipulator([[-0.2, 0.0], [0.2, 0.0]], 0.25, [0.1, 0.2], friction=0.1, mode=[1.0, -1.0])"
    kept = {"centers": 0.1, "gravity": [0.0, -9.81], "inertias": [[1e-3, 2e-3], [1e-3, 3e-3]], "load": 1.0}
    for each in (robot, robot.replace(**kept), robot.replace(mode=-1, friction_velocity=0.1), *MACHINES.values()):
        assert eval(repr(each), {"Manipulator": rk.Manipulator}) == each


def test_importing_the_package_stays_light():
    import subprocess
    import sys

    code = "import sys, rapkm_lite; print([m for m in ('matplotlib', 'ipywidgets', 'sympy') if m in sys.modules])"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]" and out.stderr == ""


def test_the_package_lists_what_people_call_and_no_modules():
    from types import ModuleType

    from rapkm_lite import explore

    assert "at" in dir(rk) and "null_basis" in dir(rk) and "triangle" in dir(rk)
    assert set(dir(rk)) == {*rk.__all__, "__version__"}
    assert dir(explore) == sorted(explore.__all__)
    for room in (rk, explore):
        things = [name for name, thing in vars(room).items() if not isinstance(thing, ModuleType) and name[0] != "_"]
        assert sorted(things) == sorted(room.__all__)


@pytest.mark.parametrize("turn", [0.0, 0.5, np.pi / 2, 2.5])
def test_arms_meet_where_their_circles_cross_in_any_frame(turn):
    """Base points 0.2 m from the origin: there, and with a smaller reach nowhere, a reach of 0.2 m meets."""
    R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    angle = 2 * np.pi * np.arange(3) / 3
    for base in (BASE, 0.2 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)):
        assert rk.reachable(rk.Manipulator(base=base @ R.T, lengths=0.1025, masses=1.0), [0.0, 0.0])
        with pytest.raises(ValueError, match="arms that can meet"):
            rk.Manipulator(base=base @ R.T, lengths=0.0975, masses=1.0)


def test_arms_may_meet_where_no_two_of_their_circles_cross():
    """The outer circle of the second arm lies whole within the ring of the first, 0.8 to 1.2 m."""
    robot = rk.Manipulator(base=[[0.0, 0.0], [0.05, 0.0]], lengths=[[1.0, 0.2], [0.5, 0.49]], masses=0.1)
    assert rk.reachable(robot, [0.0, 0.95])


def test_an_arm_with_all_its_mass_far_out_may_be_light_elsewhere():
    """Two masses on a light arm: of one kilogram at the tip, and of a milligram at the elbow, by which it turns."""
    values = {"base": [[-0.2, 0.0], [0.2, 0.0]], "lengths": 0.25, "masses": [1e-6, 1.0], "centers": 0.25}
    robot = rk.Manipulator(**values, inertias=0.0)
    q = rk.inverse_kinematics(robot, [0.0, 0.2])
    assert np.linalg.eigvalsh(rk.mass_matrix(robot, q)).min() > 0.0
    with pytest.raises(ValueError, match="let an arm move freely"):
        rk.Manipulator(**values | {"masses": [1e-16, 1.0]}, inertias=0.0)
