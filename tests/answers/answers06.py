"""Answers to lesson 06: the form of a path, mean and least energy, and a place for the triangle."""

import numpy as np
from scipy.optimize import minimize

import rapkm_lite as rk


def weight(robot):
    return robot.resistance[0] / robot.torque_constant[0] ** 2


def null(A):
    return np.eye(A.shape[-2]) - A @ np.linalg.inv(A.swapaxes(-1, -2) @ A) @ A.swapaxes(-1, -2)


def form(robot, trajectory, K_P, matrix=null, keep=slice(None, -1)):
    A = rk.control_matrix(robot, trajectory.q)[keep]
    return weight(robot) * K_P**2 * matrix(A).sum(axis=0) * trajectory.dt


def form_by_loop(robot, trajectory, K_P):
    S = np.zeros((robot.n_arms, robot.n_arms))
    for q in trajectory.q[:-1]:
        A = rk.control_matrix(robot, q)
        K_0 = K_P * (np.eye(robot.n_arms) - A @ np.linalg.pinv(A))
        S += K_0.T @ np.diag(robot.resistance / robot.torque_constant**2) @ K_0 * trajectory.dt
    return S.tolist()


def form_by_svd(robot, trajectory, K_P):
    U = np.linalg.svd(rk.control_matrix(robot, trajectory.q[:-1]))[0][..., 2:]
    return weight(robot) * K_P**2 * trajectory.dt * np.einsum("kia,kja->ij", U, U)


def form_by_filter(robot, trajectory, K_P):
    R = rk.antagonism_filter(rk.control_matrix(robot, trajectory.q[:-1]))
    return weight(robot) * K_P**2 * np.sum(np.eye(robot.n_arms) - R, axis=0) * trajectory.dt


def form_from_rest(robot, trajectory, K_P):
    """Column by column, from the torques that unit offsets leave."""
    A = rk.control_matrix(robot, trajectory.q[:-1])
    K_0 = np.stack(
        [
            K_P * (e - (A @ np.linalg.solve(A.swapaxes(1, 2) @ A, (A.swapaxes(1, 2) @ e)[..., None]))[..., 0])
            for e in np.eye(robot.n_arms)
        ],
        axis=-1,
    )
    return weight(robot) * np.einsum("kji,kjl->il", K_0, K_0) * trajectory.dt


def form_in_place(robot, trajectory, K_P):
    A = rk.control_matrix(robot, trajectory.q)[:-1].copy()
    S = null(A).sum(axis=0)
    S *= K_P**2
    S *= weight(robot)
    S *= trajectory.dt
    return S


def three_drives(A):
    return np.eye(3) - A @ np.linalg.pinv(A)


def cross(A):
    n = np.cross(A[..., 0], A[..., 1])
    return n[:, :, None] * n[:, None, :] / np.sum(n * n, axis=-1)[:, None, None]


def with_weight(change):
    return lambda robot, path, K_P: (
        form(robot, path, K_P) / weight(robot) * change(robot.resistance[0], robot.torque_constant[0])
    )


FORMS = [
    ("right", "as in the lesson", form),
    ("right", "loop, pinv, every motor its own weight, lists", form_by_loop),
    ("right", "null space by SVD", form_by_svd),
    ("right", "the filter's complement", form_by_filter),
    ("right", "column by column", form_from_rest),
    ("right", "in place", form_in_place),
    ("right", "the package", rk.antagonism_form),
    (
        "close",
        "trapezoidal rule, the same on a closed path",
        lambda robot, path, K_P: (
            weight(robot) * K_P**2 * np.trapezoid(null(rk.control_matrix(robot, path.q)), dx=path.dt, axis=0)
        ),
    ),
    ("close", "all samples but the first, the same on a closed path", lambda *case: form(*case, keep=slice(1, None))),
    ("close", "every tenth sample", lambda robot, path, K_P: 10 * form(robot, path, K_P, keep=slice(0, -1, 10))),
    ("close", "single precision, rounded", lambda *case: np.float32(form(*case)).round(0)),
    ("wrong", "three drives only, np.eye(3)", lambda *case: form(*case, matrix=three_drives), ""),
    ("wrong", "np.eye(3) itself", lambda *case: np.eye(3), "shape"),
    ("wrong", "null vector of three drives", lambda *case: form(*case, matrix=cross), ""),
    ("wrong", "gain once", lambda robot, path, K_P: form(robot, path, K_P) / K_P, "gain"),
    ("wrong", "no gain", lambda robot, path, K_P: form(robot, path, 1.0), "gain"),
    ("wrong", "gain twice too often", lambda robot, path, K_P: form(robot, path, K_P) * K_P, "K_P"),
    ("wrong", "all samples", lambda *case: form(*case, keep=slice(None)), "last sample"),
    ("wrong", "no dt", lambda robot, path, K_P: form(robot, path, K_P) / path.dt, "dt"),
    ("wrong", "mean", lambda robot, path, K_P: form(robot, path, K_P) / path.t[-1], "mean"),
    (
        "wrong",
        "first pose",
        lambda robot, path, K_P: weight(robot) * K_P**2 * path.t[-1] * null(rk.control_matrix(robot, path.q[0])),
        "first pose",
    ),
    (
        "wrong",
        "last pose, the first one of a closed path",
        lambda robot, path, K_P: weight(robot) * K_P**2 * path.t[-1] * null(rk.control_matrix(robot, path.q[-1])),
        "or of the last one",
    ),
    (
        "wrong",
        "mean A",
        lambda robot, path, K_P: (
            weight(robot) * K_P**2 * path.t[-1] * null(rk.control_matrix(robot, path.q[:-1]).mean(axis=0))
        ),
        "mean A",
    ),
    ("wrong", "complement", lambda *case: form(*case, matrix=lambda A: A @ np.linalg.pinv(A)), "complement"),
    (
        "wrong",
        "nothing projected",
        lambda *case: form(*case, matrix=lambda A: null(A) * 0 + np.eye(A.shape[1])),
        "project",
    ),
    (
        "wrong",
        "inverse forgotten",
        lambda *case: form(*case, matrix=lambda A: np.eye(A.shape[1]) - A @ A.swapaxes(1, 2)),
        "inverse",
    ),
    ("wrong", "A A^T", lambda *case: form(*case, matrix=lambda A: A @ A.swapaxes(1, 2)), "projector"),
    ("wrong", "no motor", with_weight(lambda R, k: 1.0), "R_el"),
    ("wrong", "no k_t", with_weight(lambda R, k: R), "k_t"),
    ("wrong", "k_t once", with_weight(lambda R, k: R / k), "k_t"),
    ("wrong", "no resistance", with_weight(lambda R, k: 1 / k**2), "R_el"),
    ("wrong", "resistance squared", with_weight(lambda R, k: (R / k) ** 2), "R_el"),
    ("wrong", "k_t multiplied", with_weight(lambda R, k: R * k**2), ""),
    ("wrong", "opposite sign", lambda *case: -form(*case), "sign"),
    ("wrong", "per mrad", lambda *case: 1e-6 * form(*case), "units"),
    ("wrong", "half", lambda *case: form(*case) / 2, "half"),
    ("wrong", "trace", lambda *case: np.trace(form(*case)), "trace"),
    (
        "wrong",
        "not added up",
        lambda robot, path, K_P: weight(robot) * K_P**2 * null(rk.control_matrix(robot, path.q[:-1])),
        "added up",
    ),
    ("wrong", "diagonal", lambda *case: np.diag(np.diag(form(*case))), "diagonal"),
    ("wrong", "gain in the wrong place", lambda robot, path, K_P: form(robot, path, np.sqrt(K_P)), "gain"),
    ("wrong", "nothing", lambda *case: 0 * form(*case), "zero"),
    ("wrong", "eigenvalues", lambda *case: np.linalg.eigvalsh(form(*case)), "shape"),
]


def sampled(count, seed=1):
    def answer(S, sigma):
        dq = np.random.default_rng(seed).normal(0, sigma, (count, len(S)))
        return np.einsum("ki,ij,kj->k", dq, S, dq).mean()

    return answer


def mean(S, sigma):
    return sigma**2 * np.trace(S)


def in_place(S, sigma):
    S *= sigma**2
    return S.diagonal().sum()


MEANS = [
    ("right", "trace", mean),
    ("right", "eigenvalues", lambda S, sigma: np.linalg.eigvalsh(S).sum() * sigma**2),
    ("right", "covariance", lambda S, sigma: np.sum(S * sigma**2 * np.eye(len(S)))),
    ("right", "in place", in_place),
    ("right", "a loop", lambda S, sigma: sum(S[i][i] * sigma * sigma for i in range(len(S)))),
    ("right", "an array of one", lambda S, sigma: np.array([mean(S, sigma)])),
    ("wrong", "Monte Carlo, 20 000 draws", sampled(20_000), "random draws"),
    ("wrong", "Monte Carlo, 200 000 draws", sampled(200_000, 5), "random draws"),
    ("close", "single precision", lambda S, sigma: np.float32(mean(S, sigma))),
    ("wrong", "sigma once", lambda S, sigma: sigma * np.trace(S), "squared"),
    ("wrong", "no sigma", lambda S, sigma: np.trace(S), "sigma"),
    ("wrong", "sum of all", lambda S, sigma: sigma**2 * S.sum(), "diagonal"),
    ("wrong", "equal offsets", lambda S, sigma: sigma**2 * np.ones(len(S)) @ S @ np.ones(len(S)) / len(S), "equal"),
    ("wrong", "largest", lambda S, sigma: sigma**2 * np.linalg.eigvalsh(S)[-1], "dearest"),
    ("wrong", "smallest", lambda S, sigma: sigma**2 * np.linalg.eigvalsh(S)[0], "cheapest"),
    ("wrong", "mean of the eigenvalues", lambda S, sigma: sigma**2 * np.linalg.eigvalsh(S).mean(), "sum"),
    ("wrong", "determinant", lambda S, sigma: sigma**2 * np.linalg.det(S), "determinant"),
    ("wrong", "Frobenius", lambda S, sigma: sigma**2 * np.linalg.norm(S), "norm"),
    ("wrong", "spectral norm", lambda S, sigma: sigma**2 * np.linalg.norm(S, 2), "dearest"),
    ("wrong", "root", lambda S, sigma: sigma * np.sqrt(np.trace(S)), "root"),
    ("wrong", "root alone", lambda S, sigma: np.sqrt(mean(S, sigma)), "root"),
    ("wrong", "deviation", lambda S, sigma: sigma**2 * np.sqrt(2 * np.trace(S @ S)), "deviation"),
    ("wrong", "diagonal", lambda S, sigma: sigma**2 * np.diag(S), "single drives"),
    ("wrong", "matrix", lambda S, sigma: sigma**2 * S, "matrix"),
    ("wrong", "S twice", lambda S, sigma: sigma**2 * np.trace(S.T @ S), "squared"),
    ("wrong", "half", lambda S, sigma: mean(S, sigma) / 2, "half"),
    ("wrong", "twice", lambda S, sigma: 2 * mean(S, sigma), "twice"),
    ("wrong", "in mJ", lambda S, sigma: 1e3 * mean(S, sigma), "1000"),
    ("wrong", "sigma in mrad", lambda S, sigma: 1e6 * mean(S, sigma), "units"),
    ("wrong", "mean absolute offset", lambda S, sigma: (sigma * np.sqrt(2 / np.pi)) ** 2 * np.trace(S), "mean"),
    ("wrong", "opposite", lambda S, sigma: -mean(S, sigma), "sign"),
    ("wrong", "zero, as the mean offset is", lambda S, sigma: np.zeros(len(S)) @ S @ np.zeros(len(S)), "zero"),
    ("close", "three drives", lambda S, sigma: sigma**2 * (S[0, 0] + S[1, 1] + S[2, 2])),
    ("wrong", "one draw", sampled(1), ""),
    ("wrong", "median", lambda S, sigma: mean(S, sigma) * 0.7, "factor"),
]


def least(S, size):
    return size**2 * np.linalg.eigvalsh(S)[0]


def random_directions(count):
    def answer(S, size):
        v = np.random.default_rng(3).normal(size=(count, len(S)))
        v *= size / np.linalg.norm(v, axis=1, keepdims=True)
        return np.einsum("ki,ij,kj->k", v, S, v).min()

    return answer


def optimized(S, size):
    def energy(v):
        v = size * v / np.linalg.norm(v)
        return v @ S @ v

    return min(minimize(energy, start, method="Nelder-Mead").fun for start in np.eye(len(S)) + 0.1)


def power_iteration(S, size):
    v = np.ones(len(S)) + 0.01 * np.arange(len(S))
    for _ in range(60):
        v = np.linalg.solve(S, v)
        v /= np.linalg.norm(v)
    return size**2 * v @ S @ v


MINIMA = [
    ("right", "eigvalsh", least),
    ("right", "eigenvector put in", lambda S, size: (v := size * np.linalg.eigh(S)[1][:, 0]) @ S @ v),
    ("right", "unsorted, smallest taken", lambda S, size: size**2 * np.linalg.eig(S)[0].real.min()),
    ("right", "singular values", lambda S, size: size**2 * np.linalg.svd(S)[1][-1]),
    ("right", "inverse", lambda S, size: size**2 / np.linalg.norm(np.linalg.inv(S), 2)),
    ("close", "random directions", random_directions(20_000)),
    ("right", "an optimizer at its default tolerance", optimized),
    ("close", "inverse iteration", power_iteration),
    ("close", "single precision", lambda S, size: np.float32(least(S, size))),
    ("wrong", "largest", lambda S, size: size**2 * np.linalg.eigvalsh(S)[-1], "max for min"),
    ("wrong", "size once", lambda S, size: size * np.linalg.eigvalsh(S)[0], "squared"),
    ("wrong", "no size", lambda S, size: np.linalg.eigvalsh(S)[0], "missing"),
    ("wrong", "middle", lambda S, size: size**2 * np.linalg.eigvalsh(S)[1], "second"),
    ("wrong", "one drive alone", lambda S, size: size**2 * np.diag(S).min(), "one drive"),
    ("wrong", "drive 1", lambda S, size: size**2 * S[0, 0], "first drive"),
    ("wrong", "equal offsets", lambda S, size: size**2 * S.mean() * len(S), "equal"),
    ("wrong", "all of the full size", lambda S, size: size**2 * S.sum(), "norm"),
    ("wrong", "unsorted, first", lambda S, size: size**2 * np.linalg.eig(S)[0][0].real, "sort"),
    ("wrong", "unsorted, last", lambda S, size: size**2 * np.linalg.eigvals(S)[-1].real, "sort"),
    ("wrong", "smallest entry", lambda S, size: size**2 * S.min(), "entry"),
    ("wrong", "mean", lambda S, size: size**2 * np.trace(S) / len(S), "mean"),
    ("wrong", "trace", lambda S, size: size**2 * np.trace(S), ""),
    ("wrong", "inverse", lambda S, size: size**2 / np.linalg.eigvalsh(S)[0], "inverse"),
    ("wrong", "inverse norm", lambda S, size: size**2 * np.linalg.norm(np.linalg.inv(S), 2), "inverse"),
    ("wrong", "the offsets", lambda S, size: size * np.linalg.eigh(S)[1][:, 0], "offsets"),
    (
        "wrong",
        "a row of the eigenvectors",
        lambda S, size: size**2 * np.linalg.eigh(S)[1][0] @ S @ np.linalg.eigh(S)[1][0],
        "transposed",
    ),
    ("wrong", "all", lambda S, size: size**2 * np.linalg.eigvalsh(S), "all principal"),
    ("wrong", "root", lambda S, size: size**2 * np.sqrt(np.linalg.eigvalsh(S)[0]), "root"),
    ("wrong", "opposite", lambda S, size: -least(S, size), "sign"),
    ("wrong", "nothing", lambda S, size: 0.0, "zero"),
    ("wrong", "half", lambda S, size: least(S, size) / 2, "half"),
    ("wrong", "in mJ", lambda S, size: 1e3 * least(S, size), "1000"),
    ("close", "three drives", lambda S, size: size**2 * np.linalg.eigvalsh(S[:3, :3])[0]),
    ("wrong", "determinant", lambda S, size: size**2 * np.linalg.det(S), ""),
    ("wrong", "ten directions", random_directions(10), ""),
]

CORNERS = 0.08 / np.sqrt(3) * np.array([[0, 1], [-np.sqrt(0.75), -0.5], [np.sqrt(0.75), -0.5]])


def spots(robot, step):
    side = np.arange(-0.16, 0.161, step)
    grid = np.stack(np.meshgrid(side, side + 0.02), axis=-1).reshape(-1, 2)
    return [p for p in grid if rk.reachable(robot, p + CORNERS).all()]


def predicted(robot, p, offset, K_P=7.05):
    try:
        return offset @ rk.antagonism_form(robot, rk.triangle(robot, side=0.08, centre=p, dt=0.05), K_P) @ offset
    except ValueError:
        return np.inf


def on_grid(step=0.04, cost=predicted, choose=np.argmin):
    def answer(robot, offset):
        places = spots(robot, step)
        return places[choose([cost(robot, p, np.asarray(offset)) for p in places])]

    return answer


def by_runs(robot, p, offset):
    path = rk.triangle(robot, side=0.08, centre=p, dt=4e-3)
    return rk.antagonistic_energy(rk.simulate(robot, rk.PD(7.05, 0.225), path, offset))


def descended(robot, offset):
    starts = spots(robot, 0.12)
    found = [
        minimize(lambda p: min(predicted(robot, p, offset), 1e3), s, method="Nelder-Mead", options={"maxiter": 20})
        for s in starts
    ]
    return min(found, key=lambda f: f.fun).x


def at_one_pose(robot, p, offset):
    """The fight at the centre only, at rest."""
    A = rk.control_matrix(robot, rk.inverse_kinematics(robot, p))
    return np.sum((null(A) @ offset) ** 2)


grid = on_grid(0.03)

PLACES = [
    ("right", "a grid of forms", grid),
    ("right", "a grid of runs, a list", lambda robot, offset: list(on_grid(0.05, by_runs)(robot, offset))),
    ("right", "the rest at the centre only", on_grid(0.02, at_one_pose)),
    ("right", "a search from several places", descended),
    ("right", "in place", lambda robot, offset: grid(robot, offset.__imul__(1e3))),
    ("wrong", "dearest", on_grid(choose=np.argmax), "dearest"),
    ("wrong", "always the origin", lambda robot, offset: np.zeros(2), "same for all"),
    ("wrong", "only for (4, -2, 5) mrad", lambda robot, offset: np.array([0.06, 0.13]), "same for all"),
    (
        "wrong",
        "trace",
        on_grid(
            0.05,
            lambda robot, p, offset: np.trace(
                rk.antagonism_form(robot, rk.triangle(robot, side=0.08, centre=p, dt=0.05), 7.05)
            ).round(3),
        ),
        "same for all",
    ),
    (
        "wrong",
        "worst offsets",
        on_grid(
            0.05,
            lambda robot, p, offset: np.linalg.eigvalsh(
                rk.antagonism_form(robot, rk.triangle(robot, side=0.08, centre=p, dt=0.05), 7.05)
            )[-1],
        ),
        "same for all",
    ),
    ("wrong", "in mm", lambda robot, offset: 1e3 * np.array(grid(robot, offset)), "not in mm"),
    ("wrong", "in cm", lambda robot, offset: 1e2 * np.array(grid(robot, offset)), "not in cm"),
    ("wrong", "outside", lambda robot, offset: 50 * offset[:2], "workspace"),
    ("wrong", "x and y exchanged", lambda robot, offset: grid(robot, offset)[::-1], "exchanged"),
    ("wrong", "opposite", lambda robot, offset: -grid(robot, offset), "opposite sign"),
    ("wrong", "corner", lambda robot, offset: grid(robot, offset) + CORNERS[1], "corner"),
    ("wrong", "signs lost", on_grid(0.02, cost=lambda robot, p, offset: predicted(robot, p, np.abs(offset))), ""),
    ("wrong", "offsets backwards", on_grid(cost=lambda robot, p, offset: predicted(robot, p, offset[::-1])), "order"),
    ("wrong", "drives from 2 on", lambda robot, offset: grid(robot, np.roll(offset, -1)), "another order"),
    # The cheapest places for (dq_3, dq_1, dq_2) are the dearest ones here: nobody can tell which of the two it was.
    ("wrong", "drives from 3 on", lambda robot, offset: grid(robot, np.roll(offset, 1)), "offsets of other drives"),
    (
        "wrong",
        "first offset only",
        on_grid(cost=lambda robot, p, offset: predicted(robot, p, offset * [1.0, 0.0, 0.0])),
        "same for all",
    ),
    ("wrong", "a number", lambda robot, offset: 0.1, "two finite"),
    ("wrong", "an index", lambda robot, offset: 17, "two finite"),
    ("wrong", "the triangle", lambda robot, offset: rk.triangle(robot, side=0.08), ""),
    ("wrong", "three coordinates", lambda robot, offset: np.zeros(3), "two finite"),
    ("wrong", "NaN", lambda robot, offset: np.array([np.nan, 0.0]), "two finite"),
    ("wrong", "a value", np.array([0.06, 0.13]), "function"),
    ("wrong", "a random place", lambda robot, offset: spots(robot, 0.03)[int(1e6 * abs(offset).sum()) % 60], ""),
    (
        "wrong",
        "largest torque of the path instead of the fight",
        on_grid(0.06, lambda robot, p, offset: -p[1]),
        "same for all",
    ),
]

ANSWERS = {
    "06.form": FORMS,
    "06.expected_cost": MEANS,
    "06.cheapest_offsets": MINIMA,
    "06.placement": PLACES,
}
