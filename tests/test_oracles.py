"""Peer engines on the same machine: forward dynamics in Pinocchio, a whole closed-loop run in MuJoCo.

Needs the optional extra: pip install -e .[oracles].  Both peers get the machine link by link from its data, in three
dimensions, and close the loops in their own way.  Frictionless.
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


# MuJoCo: loops closed by stiff springs between the tips.  The gaps stay below a nanometre.
def mujoco_twin(mujoco, robot, step):
    def body(name, pos, m, c, inertia, armature, inner):
        I = f"{inertia:.17g}"  # noqa: E741
        return (
            f'<body pos="{pos[0]:.17g} {pos[1]:.17g} 0">'
            f'<joint name="{name}" axis="0 0 1" armature="{armature:.17g}"/>'
            f'<inertial pos="{c:.17g} 0 0" mass="{m:.17g}" diaginertia="{I} {I} {I}"/>{inner}</body>'
        )

    bodies, loops = "", ""
    for i in range(robot.n_arms):
        (l1, l2), (m1, m2), (c1, c2), (i1, i2) = robot.lengths[i], robot.masses[i], robot.centers[i], robot.inertias[i]
        load = robot.load if i == 1 else 0.0
        # A point mass at the tip, lumped into the distal link.
        mass, centre = m2 + load, (m2 * c2 + load * l2) / (m2 + load)
        inertia = i2 + m2 * (c2 - centre) ** 2 + load * (l2 - centre) ** 2
        distal = body(f"elbow{i}", (l1, 0.0), mass, centre, inertia, 0.0, f'<site name="tip{i}" pos="{l2:.17g} 0 0"/>')
        bodies += body(f"base{i}", robot.base[i], m1, c1, i1, robot.rotor_inertia[i], distal)
        if i != 1:
            loops += f'<connect site1="tip{i}" site2="tip1" solref="-1e6 -2e3" solimp="0.9999 0.9999 0.001"/>'
    gx, gy = robot.gravity
    return mujoco.MjModel.from_xml_string(f"""
        <mujoco>
          <option timestep="{step}" integrator="RK4" gravity="{gx} {gy} 0" solver="Newton" tolerance="1e-14"
                  iterations="100" jacobian="dense"><flag contact="disable"/></option>
          <compiler angle="radian"/>
          <worldbody>{bodies}</worldbody><equality>{loops}</equality>
        </mujoco>""")


@pytest.mark.parametrize("name", NAMES)
def test_closed_loop_run_agrees_with_mujoco(name):
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install -e .[oracles]")
    robot = MACHINES[name].replace(friction=0.0)
    law, path = rk.experiment(name).law, rk.experiment(name).trajectory
    offset = np.array([0.004, -0.002, 0.005, 0.001])[: robot.n_arms]
    run = rk.simulate(robot, law, path, offset)

    step = 2.5e-4
    model = mujoco_twin(mujoco, robot, step)
    state = mujoco.MjData(model)
    base = [model.joint(f"base{i}").qposadr[0] for i in range(robot.n_arms)]
    elbow = [model.joint(f"elbow{i}").qposadr[0] for i in range(robot.n_arms)]
    tips = [model.site(f"tip{i}").id for i in range(robot.n_arms)]
    state.qpos[base], state.qpos[elbow] = path.q_a[0], path.q[0, robot.n_arms :]
    error = gap = 0.0
    for k in range(len(path)):
        mujoco.mj_kinematics(model, state)
        at = state.site_xpos[tips][:, :2]
        error, gap = max(error, np.abs(at[1] - run.x[k]).max()), max(gap, np.abs(at - at[1]).max())
        state.qfrc_applied[base] = -law.K_P * (state.qpos[base] + offset - path.q_a[k]) - law.K_D * (
            state.qvel[base] - path.qd_a[k]
        )
        mujoco.mj_step(model, state, round(path.dt / step))
    assert np.abs(run.error).max() > 1e-3  # the run has something to disagree about
    assert gap < 1e-8
    assert error < 1e-6, f"largest distance {error:.3g} m"
