"""The machine for MuJoCo: an XML text in its format MJCF."""

from __future__ import annotations

import numpy as np

from ..machine.arguments import exact_array, positive_number
from ..machine.manipulator import Manipulator, manipulator
from .at import at
from .kinematics import inverse_kinematics, reachable
from .maps import poses_inside, workspace_grid


def to_mjcf(robot: Manipulator, q=None, timestep: float = 2.5e-4) -> str:
    """The machine as MJCF, a text that ``mujoco.MjModel.from_xml_string`` reads.

    Hinges "base1" .. "baseN" and "elbow1" .. "elbowN" with the angles of q, which stand arm by arm in MuJoCo: base1,
    elbow1, base2, ..., so look them up by name; sites "tip1" .. "tipN",
    tied to tip 2 by equality constraints; motors "drive1" .. "driveN" whose control is the torque c in N m; sensors:
    angles and rates of the base joints, in rad and rad/s, and the position of tip 2 in m.  The load is lumped into the
    distal link of arm 2.  Not exported: Coulomb friction (modelled differently there), resistance and torque constant.

    q : (2N,) rad, where MuJoCo starts, at rest, and the keyframe "start"; default: with the end-effector at the
    mean of the base points, or, where not all arms reach that bent, where the arms bend most evenly.
    timestep : s, up to 0.1; its integrator is RK4.  From 1 ms on the springs that close the loops grow softer with it,
    and gaps of the tips larger, as with the forces: under PD on the triangle in 5 s some ten nanometres at 1 ms, tenths
    of a micrometre at 5 ms, and some fifty times that on a circle of 0.1 m in 1 s.
    Raises ValueError for values out of range, point masses, a q with open loops, and where the default finds no place.

    >>> import rapkm_lite as rk
    >>> rk.to_mjcf(rk.load()).count("<motor")
    3
    """
    from xml.sax.saxutils import quoteattr  # only when needed: it brings a tenth of what the package imports

    N = manipulator(robot).n_arms
    timestep = positive_number("timestep", timestep)
    if not 1e-12 <= timestep <= 0.1:  # no springs that RK4 integrates in longer ones hold the tips together
        raise ValueError(f"timestep = {timestep:g} s; allowed: 1e-12 to 0.1 s")
    pose = _home(robot) if q is None else exact_array("q", q, robot.n_joints)
    _ = at(robot, pose)._closed
    arms = "".join(_arm(robot, i, pose) for i in range(N))
    # Stiff, critically damped springs between the tips, rad/s; RK4 is unstable for more than 2.8 / timestep.
    rate = min(1e3, 1.0 / timestep)
    spring = f'solref="{-(rate**2):.17g} {-2.0 * rate:.17g}" solimp="0.9999 0.9999 0.001"'
    loops = "".join(f'    <connect site1="tip{i + 1}" site2="tip2" {spring}/>\n' for i in range(N) if i != 1)
    motors = "".join(f'    <motor name="drive{i + 1}" joint="base{i + 1}"/>\n' for i in range(N))
    angles = "".join(f'    <jointpos name="q{i + 1}" joint="base{i + 1}"/>\n' for i in range(N))
    rates = "".join(f'    <jointvel name="qd{i + 1}" joint="base{i + 1}"/>\n' for i in range(N))
    # A tree is read arm by arm: base1 elbow1 base2 elbow2 ...
    start = f'  <keyframe><key name="start" qpos="{_row(pose.reshape(2, N).T.ravel())}"/></keyframe>\n'
    name = "".join(letter if letter.isprintable() else " " for letter in robot.name)  # XML has no control characters
    return (
        f"<mujoco model={quoteattr(name)}>\n"
        f'  <compiler angle="radian"/>\n'
        f'  <option timestep="{timestep:.17g}" integrator="RK4" gravity="{_row([*robot.gravity, 0.0])}" '
        f'solver="Newton" tolerance="1e-14" iterations="100" jacobian="dense"><flag contact="disable"/></option>\n'
        f"  <worldbody>\n{arms}  </worldbody>\n"
        f"  <equality>\n{loops}  </equality>\n"
        f"  <actuator>\n{motors}  </actuator>\n"
        f'  <sensor>\n{angles}{rates}    <framepos name="x" objtype="site" objname="tip2"/>\n  </sensor>\n'
        f"{start}</mujoco>\n"
    )


def _home(robot: Manipulator) -> np.ndarray:
    centre = robot.base.mean(axis=0)
    if reachable(robot, centre) and _bend(q := inverse_kinematics(robot, centre)) > 0.1:
        return q
    try:
        q = poses_inside(robot, *workspace_grid(robot, 100))
        return q[np.argmax(_bend(q))]
    except ValueError:
        raise ValueError(
            "q = None, and no place was found that all arms reach with a bend; allowed: a pose (2N,)"
        ) from None


def _bend(q: np.ndarray) -> np.ndarray:
    """The smallest |sin(elbow angle)|."""
    return np.abs(np.sin(q[..., q.shape[-1] // 2 :])).min(axis=-1)


def _arm(robot: Manipulator, i: int, pose: np.ndarray) -> str:
    (l1, l2), (m1, m2), (c1, c2), (i1, i2) = robot.lengths[i], robot.masses[i], robot.centers[i], robot.inertias[i]
    load = robot.load if i == 1 else 0.0
    mass, centre = m2 + load, (m2 * c2 + load * l2) / (m2 + load)
    inertia = i2 + m2 * (c2 - centre) ** 2 + load * (l2 - centre) ** 2
    if min(i1, inertia) < 1e-14:
        raise ValueError(
            f"inertias of arm {i + 1} are {i1:g} and {inertia:g} kg m^2 about the centres of its links; allowed: 1e-14 "
            "or more, MuJoCo knows no point mass"
        )
    tip = f'        <site name="tip{i + 1}" pos="{l2:.17g} 0 0"/>\n'
    base, elbow = pose.reshape(2, -1)[:, i]
    distal = _link(f"elbow{i + 1}", elbow, [l1, 0.0, 0.0], l2, mass, centre, inertia, 0.0, tip)
    return _link(f"base{i + 1}", base, [*robot.base[i], 0.0], l1, m1, c1, i1, robot.rotor_inertia[i], distal)


def _link(joint: str, angle, position, length, mass, centre, inertia, rotor, inner: str) -> str:
    # A viewer opens a model where its bodies stand in the file, which `ref` calls the angle: so they stand at the pose.
    # Moments about the other two axes do nothing in the plane, but MuJoCo wants them to fit a body.
    return (
        f'    <body name="{joint} link" pos="{_row(position)}" euler="0 0 {angle:.17g}">\n'
        f'      <joint name="{joint}" axis="0 0 1" ref="{angle:.17g}" armature="{rotor:.17g}"/>\n'
        f'      <inertial pos="{centre:.17g} 0 0" mass="{mass:.17g}" diaginertia="{_row([inertia] * 3)}"/>\n'
        f'      <geom type="capsule" size="{length / 40:.6g}" fromto="0 0 0 {length:.17g} 0 0"/>\n'
        f"{inner}    </body>\n"
    )


def _row(numbers) -> str:
    return " ".join(f"{number:.17g}" for number in numbers)
