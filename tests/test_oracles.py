"""Peer engines on the same machine: forward dynamics in Pinocchio, a whole closed-loop run in MuJoCo.

Needs the optional extra: pip install -e .[oracles].  Both peers get the machine link by link from its data, in three
dimensions, and close the loops in their own way; MuJoCo through `rk.to_mjcf`.  Frictionless.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from samples import MACHINES, random_motion

import rapkm_lite as rk

NAMES = ["testbed", "four_arms", "asymmetric"]


# Pinocchio: constraint forces by its proximal algorithm, exact in the limit although the loops repeat the plane's
# constraint z = 0; no Baumgarte stabilization.
def pinocchio_twin(pin, robot):
    """Model, the two constraint lists, and the positions of our joints in its vectors."""
    model = pin.Model()
    model.gravity.linear = np.array([*robot.gravity, 0.0])
    at = lambda x, y: pin.SE3(np.eye(3), np.array([x, y, 0.0]))  # noqa: E731
    rod = lambda m, c, inertia: pin.Inertia(m, np.array([c, 0.0, 0.0]), np.diag([0.0, 0.0, inertia]))  # noqa: E731
    arms = []
    for i in range(robot.n_arms):
        (l1, l2), (m1, m2), (c1, c2), (i1, i2) = robot.lengths[i], robot.masses[i], robot.centers[i], robot.inertias[i]
        base = model.addJoint(0, pin.JointModelRZ(), at(*robot.base[i]), f"base {i}")
        elbow = model.addJoint(base, pin.JointModelRZ(), at(l1, 0.0), f"elbow {i}")
        model.appendBodyToJoint(base, rod(m1, c1, i1), pin.SE3.Identity())
        model.appendBodyToJoint(elbow, rod(m2, c2, i2), pin.SE3.Identity())
        if i == 1:
            model.appendBodyToJoint(elbow, rod(robot.load, l2, 0.0), pin.SE3.Identity())
        model.armature[model.joints[base].idx_v] = robot.rotor_inertia[i]
        arms.append((base, elbow))
    models, datas = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
    for i in (i for i in range(robot.n_arms) if i != 1):
        models.append(
            pin.RigidConstraintModel(
                pin.ContactType.CONTACT_3D,
                model,
                arms[i][1],
                at(robot.lengths[i, 1], 0.0),
                arms[1][1],
                at(robot.lengths[1, 1], 0.0),
                pin.ReferenceFrame.LOCAL,
            )
        )
        datas.append(models[len(models) - 1].createData())
    order = [model.joints[arm[k]].idx_v for k in (0, 1) for arm in arms]
    return model, models, datas, order


@pytest.mark.parametrize("name", NAMES)
def test_forward_dynamics_agrees_with_pinocchio(name):
    pin = pytest.importorskip("pinocchio", reason="Pinocchio is not installed: pip install -e .[oracles]")
    robot = MACHINES[name].replace(friction=0.0)
    model, models, datas, order = pinocchio_twin(pin, robot)
    data = model.createData()
    before_4 = int(pin.__version__.split(".")[0]) < 4
    pin.initConstraintDynamics(model, data, models, *([] if before_4 else [datas]))
    q, qd, _, _ = random_motion(robot, 200, bend=0.1)
    c = np.random.default_rng(1).normal(0, 1, (200, robot.n_arms))
    qdd, reactions = rk.forward_dynamics(robot, q, qd, c)
    settings = pin.ProximalSettings(1e-14, 1e-8, 100)
    for k in range(200):
        position, rate, torque = np.zeros((3, robot.n_joints))
        position[order], rate[order], torque[order[: robot.n_arms]] = q[k], qd[k], c[k]
        peer = pin.constraintDynamics(model, data, position, rate, torque, models, datas, settings)
        assert_allclose(qdd[k], peer[order], rtol=0, atol=1e-8 * np.abs(qdd[k]).max())
        # The force of the end-effector on the tip of arm 1, given in the frame of its distal link.
        angle = q[k, 0] + q[k, robot.n_arms]
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        force = turn @ datas[0].contact_force.linear[:2]
        assert_allclose(-reactions[k, :2], force, atol=1e-8 * np.abs(reactions[k]).max())


def default_run(name):
    """The frictionless default experiment of a machine, with offsets."""
    offset = np.array([0.004, -0.002, 0.005, 0.001])[: MACHINES[name].n_arms]
    given = rk.experiment(name)
    return rk.simulate(MACHINES[name].replace(friction=0.0), given.law, given.trajectory, offset)


def tips_in_mujoco(run, step):
    """Samples k of a run and the tips (N, 2) that MuJoCo puts there, with this timestep and the same PD law."""
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install -e .[oracles]")
    robot, law, path, N = run.robot, run.law, run.trajectory, run.robot.n_arms
    model = mujoco.MjModel.from_xml_string(rk.to_mjcf(robot, path.q[0], step))
    state = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, state, 0)
    base = [model.joint(f"base{i + 1}").qposadr[0] for i in range(N)]
    tips = [model.site(f"tip{i + 1}").id for i in range(N)]
    for k in range(0, len(path), max(1, round(step / path.dt))):
        mujoco.mj_kinematics(model, state)
        yield k, state.site_xpos[tips][:, :2]
        error, rate = state.qpos[base] + run.offset - path.q_a[k], state.qvel[base] - path.qd_a[k]
        state.ctrl[:] = -law.K_P * error - law.K_D * rate
        mujoco.mj_step(model, state, max(1, round(path.dt / step)))


@pytest.mark.parametrize("name", NAMES)
def test_closed_loop_run_agrees_with_mujoco(name):
    run = default_run(name)
    error = max(np.abs(tips[1] - run.x[k]).max() for k, tips in tips_in_mujoco(run, 2.5e-4))
    assert np.abs(run.error).max() > 1e-3  # the run has something to disagree about
    assert error < 1e-6, f"largest distance {error:.3g} m"


@pytest.mark.parametrize(("step", "most"), [(2.5e-4, 3e-9), (1e-3, 3e-8), (2e-3, 1e-7), (5e-3, 6e-7)])
@pytest.mark.parametrize("name", NAMES)
def test_loops_stay_closed_in_mujoco_at_any_timestep(name, step, most):
    gap = max(np.abs(tips - tips[1]).max() for _, tips in tips_in_mujoco(default_run(name), step))
    assert gap < most, f"largest gap {gap:.3g} m"


def test_mjcf_says_what_the_machine_is():
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install -e .[oracles]")
    robot = MACHINES["asymmetric"].replace(friction=0.0)
    q, qd, qdd, (x, _, _) = random_motion(robot, 1, bend=0.3)
    model = mujoco.MjModel.from_xml_string(rk.to_mjcf(robot, q[0]))
    state = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, state, 0)
    mujoco.mj_forward(model, state)
    N = robot.n_arms
    assert_allclose(state.sensor("x").data[:2], x[0], atol=1e-12)
    assert_allclose([state.sensor(f"q{i + 1}").data[0] for i in range(N)], q[0, :N], rtol=0, atol=1e-15)
    # The mass matrix of the tree, ours ordered base joints first.
    G = np.zeros((model.nv, model.nv))
    for row, unit in zip(G, np.eye(model.nv), strict=True):
        mujoco.mj_mulM(model, state, row, unit)
    order = [model.joint(f"{kind}{i + 1}").dofadr[0] for kind in ("base", "elbow") for i in range(N)]
    assert_allclose(G[np.ix_(order, order)], rk.mass_matrix(robot, q[0]), atol=1e-15)


# Machines whose arms do not all reach the centroid of the base points, or hardly bend there.
AWKWARD = {
    "one long way": rk.Manipulator(
        [[-0.1, 0], [0.1, 0], [0.0, 1.2]], lengths=[[0.3, 0.3], [0.3, 0.3], [0.5, 0.25]], masses=1
    ),
    "too near": rk.Manipulator([[-0.1, 0], [0.1, 0.01], [0.0, 0.1]], lengths=[0.4, 0.25], masses=1),
    "mixed mode": MACHINES["testbed"].replace(mode=[1, -1, 1], gravity=[0.0, -9.81], load=0.3),
}


@pytest.mark.parametrize("robot", [*MACHINES.values(), *AWKWARD.values()], ids=[*MACHINES, *AWKWARD])
def test_mjcf_starts_closed_and_at_rest(robot):
    """As MuJoCo opens the file, without its keyframe: no violation of any equality, no speed, our mode."""
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install -e .[oracles]")
    model = mujoco.MjModel.from_xml_string(rk.to_mjcf(robot))
    state, N = mujoco.MjData(model), robot.n_arms
    mujoco.mj_forward(model, state)
    assert state.nefc == 3 * (N - 1) and np.abs(state.efc_pos).max() < 1e-14
    q = np.concatenate([[state.joint(f"{kind}{i + 1}").qpos[0] for i in range(N)] for kind in ("base", "elbow")])
    assert np.abs(rk.loop_constraints(robot, q)).max() < 1e-14
    assert np.array_equal(rk.working_mode(robot, q), robot.mode) and not state.qvel.any()
    assert_allclose(state.sensor("x").data[:2], rk.forward_kinematics(robot, q), rtol=0, atol=1e-14)
    assert np.array_equal(state.qpos, model.key_qpos[0])
    if not robot.gravity.any():
        mujoco.mj_step(model, state, 1000)
        assert_allclose(state.qpos, model.key_qpos[0], rtol=0, atol=1e-9)


def test_mjcf_starts_amid_the_base_points_where_it_can():
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install -e .[oracles]")
    for name in MACHINES:
        state = mujoco.MjData(model := mujoco.MjModel.from_xml_string(rk.to_mjcf(MACHINES[name])))
        mujoco.mj_forward(model, state)
        assert_allclose(state.sensor("x").data[:2], MACHINES[name].base.mean(axis=0), rtol=0, atol=1e-14)


def test_mjcf_refuses_what_it_cannot_export():
    with pytest.raises(ValueError, match="robot = 3"):
        rk.to_mjcf(3)
    for timestep in (0.0, 1e-13, 0.1000001, 1e10, np.nan):
        with pytest.raises(ValueError, match=r"timestep = .*; allowed: "):
            rk.to_mjcf(MACHINES["testbed"], timestep=timestep)
    with pytest.raises(ValueError, match="q has shape"):
        rk.to_mjcf(MACHINES["testbed"], q=[0.0])
    with pytest.raises(ValueError, match=r"q leaves the loops open by .*close_loops"):
        rk.to_mjcf(MACHINES["testbed"], q=np.zeros(6))
    touching = rk.Manipulator([[-0.2, 0], [0.2, 0]], lengths=0.1, masses=1)
    with pytest.raises(ValueError, match="q = None, and no place was found that all arms reach with a bend"):
        rk.to_mjcf(touching)
    assert "<key " in rk.to_mjcf(touching, [0.0, np.pi, 0.0, 0.0])
