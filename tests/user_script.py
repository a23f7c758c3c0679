"""What a user writes, with the types a user has at hand: floats, lists, tuples, lambdas.  Read by `test_types`."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

import rapkm_lite as rk
from rapkm_lite import explore, plotting
from rapkm_lite.checks import check

square = [[-0.25, -0.25], [0.25, -0.25], [0.25, 0.25], [-0.25, 0.25]]
robot = rk.Manipulator(base=square, lengths=[0.25, 0.3], masses=0.1, gravity=(0.0, -9.81), name="mine")
robot = robot.replace(friction=0.0, load=0.1)
testbed = rk.load("testbed")

q = rk.inverse_kinematics(robot, [0.02, -0.03], mode=(1, 1, -1, 1))
x, y = rk.forward_kinematics(robot, q)
angle: float = float(np.hypot(x, y))
A = rk.control_matrix(robot, list(q), independent=[0, 1])
c = rk.weighted_pseudoinverse(A, W=np.eye(4)) @ np.array([1.0, 0.0])
n = rk.null_vector(testbed, rk.inverse_kinematics(testbed, (0.0, 0.0)))
F = rk.orthogonal_complement(testbed, rk.inverse_kinematics(testbed, (0.0, 0.0)), (0, 1))
Gbar, Cbar, Qbar = rk.minimal_dynamics(robot, q, 0 * q)
e = rk.steady_state_error(A, 7.05, [1e-3, 0.0, 0.0, 0.0])

path = rk.triangle(testbed, side=0.2, duration=3, centre=(0.0, 0.01))
ring = rk.circle(testbed, 0.05)
stay = rk.hold(testbed, [0, 0], 1)
law = rk.AntagonismFilter(rk.PD(7.05, [0.2, 0.2, 0.3]), pose="true")
run = rk.simulate(testbed, law, path, offset=[1e-3, -1e-3, 0.0], encoder=2000, velocity_filter=5e-3)
run = rk.simulate(testbed, lambda t, q_a, qd_a, desired: -7.0 * (q_a - desired.q_a), path, offset=1e-3)
run = rk.simulate(testbed, rk.CTC(400, 40, independent=(0, 1)), path, model=testbed.replace(lengths=0.201))
total: float = float(run.energy.sum())

gentle = rk.AntagonismFilter(lambda t, q_a, qd_a, desired: -7.0 * (q_a - desired.q_a), W=[1.0, 2.0, 1.0])
broken = rk.simulate(
    testbed,
    gentle,
    rk.circle(testbed, 0.05, 0.2, centre=[0, 0]),
    encoder=np.float64(2000),
    faults=[rk.TorqueLimit([0.3, 0.3, np.inf]), rk.DeadDrive(1, 0.1), rk.OffsetJump(0, 0, 1e-3)],
)
summing = rk.PID(7, 20, [0.2, 0.2, 0.2], limit=0.5)
in_pairs = [rk.CTC(400, 40, [0, 1]), rk.APD(7, 0.2, (1, 2), W=2), rk.CTC(400, 40, None), rk.SwitchedCTC(400, 40, 1)]
pose = rk.at(testbed, path.q[0], path.qd[0])
inertia = pose.minimal[0] @ np.ones(2) + pose.using([0, 1]).F_dot[0] + pose.G.trace() + broken.c.max()


class Damped(rk.Law):
    pose = None

    def start(self, model, dt):
        return np.zeros(model.n_arms)

    def step(self, memory, sample):
        e, ed = sample.errors()
        memory = memory + sample.dt * e
        return -7.0 * e - 0.2 * ed - memory, memory


run = rk.simulate(testbed, Damped(), stay, offset=np.full(3, 1e-3), sensors=None)
several = rk.sweep(testbed, [rk.PD(7, 0.2), summing, Damped()], stay, 0.0, failed="mask")
grid = rk.workspace_grid(testbed, 10, box=[-0.1, 0.1, -0.1, 0.1])
values = rk.actuation_map(testbed, mode=rk.working_modes(testbed), n=10, pair=[0, 1])[2].max()
with ThreadPoolExecutor() as pool:
    study = rk.sweep(testbed, rk.PD(7.05, 0.225), path, [[0.0, 0.0, 0.0], [1e-3, 0.0, 0.0]], executor=pool)
print(study.energies.mean(axis=0), rk.table1().measured)


def mine(t, q_a, qd_a, desired):
    return -7.0 * (q_a - desired.q_a) - 0.2 * (qd_a - desired.qd_a)


run = rk.simulate(testbed, mine, stay)
try:
    rk.simulate(testbed, rk.RedundantCTC(400.0, 40.0), ring)
except rk.SimulationError as error:
    print(error.time, error.reason)

ax = plotting.plot_machine(testbed, path.q[0])
plotting.plot_torques(run, ax, "torques")
panel = {"a": {"xlabel": "time in s"}}
shown = explore.explorer(lambda picture, gain: {"gain": f"{gain}"}, {"gain": explore.slider("gain", 1, 9, 1, 5)}, panel)
shown.set(gain=3)
answer = check("08.counts", lambda K_P, friction: np.pi * K_P / friction)
