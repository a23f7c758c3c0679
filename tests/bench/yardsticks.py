"""What the engine is measured against: a C kernel built on the spot, and MuJoCo."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from pathlib import Path

import numpy as np

import rapkm_lite as rk
from rapkm_lite.engine import tables


def compile_c(folder: Path, lanes: int, friction: bool = False):
    """The C kernel for one run or for `lanes` runs in a vector register; None where there is no compiler."""
    compiler = shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        return None
    library = folder / f"kernel{lanes}{friction}.so"
    source = Path(__file__).with_name("kernel.c")
    still = rk.hold(rk.load(), (0.0, 0.0))
    known = {
        "LANES": lanes,
        "FRICTION": int(friction),
        "COLUMNS": tables.motion_table(still, 3).shape[1],
        **{name: getattr(tables, name) for name in ("ANGLE", "RATE", "COS", "SIN")},
    }
    options = "-O3", "-march=native", "-ffast-math", "-fPIC", "-Wno-psabi", *(f"-D{k}={v}" for k, v in known.items())
    part = library.with_suffix(".o")
    subprocess.run([compiler, *options, "-c", "-o", str(part), str(source)], check=True)
    # Linked without -ffast-math, which would make numbers below 1e-308 zero in the whole process.
    subprocess.run([compiler, "-shared", "-o", str(library), str(part), "-lm"], check=True)
    function = ctypes.CDLL(str(library)).closed_loop
    function.restype = ctypes.c_long
    return function


def aligned(size: int) -> np.ndarray:
    """Numbers that start at a multiple of 64 bytes, as vector registers want them."""
    room = np.zeros(size + 8)
    start = (-room.ctypes.data // 8) % 8
    return room[start : start + size]


def c_run(function, lanes, robot, path, offsets, filtered=False, measured=False):
    """Prepare a run of the C kernel; returns the function that runs it and gives history and sums."""
    arms = np.ascontiguousarray(tables.arm_table(robot, robot.n_arms).T)
    table = np.ascontiguousarray(tables.motion_table(path, robot.n_arms))
    history, sums, offset = np.empty((len(path), 13)), aligned(10 * lanes), aligned(3 * lanes)
    offset[:] = np.broadcast_to(offsets, (lanes, 3)).T.ravel()
    weight = float((robot.resistance / robot.torque_constant**2)[0])
    pointer = [ctypes.c_void_p(v.ctypes.data) for v in (arms, table, offset, history, sums)]
    real = ctypes.c_double
    numbers = [real(v) for v in (7.05, 0.225, weight, 1 / robot.friction_velocity)]

    def run():
        steps = function(
            pointer[0],
            pointer[1],
            ctypes.c_long(len(path)),
            real(path.dt),
            pointer[2],
            *numbers,
            int(measured),
            int(filtered),
            pointer[3],
            pointer[4],
        )
        assert steps >= 0
        return history, sums.reshape(10, lanes)

    run.keep = arms, table, offset
    return run


def mujoco_rollout(robot, path, offset, integrator):
    """PD control of the same machine in MuJoCo, loops closed by connect constraints; returns its run."""
    import mujoco
    from mujoco import rollout

    bodies, loops, drives = "", "", ""
    for i in range(robot.n_arms):
        (l1, l2), (m1, m2) = robot.lengths[i], robot.masses[i]
        # Each link is a slender rod about its middle.
        inner = (
            f'<body name="d{i}" pos="{l1} 0 0"><joint name="e{i}" axis="0 0 1"/>'
            f'<inertial pos="{l2 / 2} 0 0" mass="{m2}" diaginertia="1e-6 1e-3 {m2 * l2**2 / 12}"/></body>'
        )
        bodies += (
            f'<body name="p{i}" pos="{robot.base[i, 0]} {robot.base[i, 1]} 0">'
            f'<joint name="b{i}" axis="0 0 1" armature="{robot.rotor_inertia[i]}"/>'
            f'<inertial pos="{l1 / 2} 0 0" mass="{m1}" diaginertia="1e-6 1e-3 {m1 * l1**2 / 12}"/>'
            f"{inner}</body>"
        )
        drives += f'<position joint="b{i}" kp="7.05"/><velocity joint="b{i}" kv="0.225"/>'
        if i != 1:
            loops += (
                f'<connect body1="d{i}" body2="d1" anchor="{l2} 0 0" solref="0.002 1" solimp="0.999 0.9999 0.001"/>'
            )
    model = mujoco.MjModel.from_xml_string(f"""
        <mujoco><compiler angle="radian" balanceinertia="true"/>
        <option timestep="{path.dt}" integrator="{integrator}" gravity="0 0 0"><flag contact="disable"/></option>
        <worldbody>{bodies}</worldbody><equality>{loops}</equality><actuator>{drives}</actuator></mujoco>""")
    data = mujoco.MjData(model)
    N = robot.n_arms
    order = [model.joint(f"{kind}{i}").qposadr[0] for kind in "be" for i in range(N)]
    data.qpos[order] = path.q[0]
    # The anchor of a connect constraint is taken at the zero pose: put the one on body 2 where the tip is.
    for k in range(model.neq):
        model.eq_data[k, 3:6] = [robot.lengths[1, 1], 0.0, 0.0]
    mujoco.mj_forward(model, data)
    state = np.zeros(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    control = np.empty((len(path) - 1, 2 * N))
    control[:, 0::2], control[:, 1::2] = (path.q_a - offset)[:-1], path.qd_a[:-1]
    return lambda: rollout.rollout(model, data, state[None], control[None])[0][0][:, 1 + np.array(order[:N])]
