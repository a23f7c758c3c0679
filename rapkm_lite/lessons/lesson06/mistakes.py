"""Wrong answers to the exercises of lesson 06, each with the sentence that names the mistake."""

from __future__ import annotations

import numpy as np

from ...mechanics.actuation import control_matrix, prestress_projector
from ...simulation.energy import antagonism_form


def _null(robot, trajectory) -> np.ndarray:
    """The projector N_{A^T} (k, N, N) at every sample."""
    return prestress_projector(control_matrix(robot, trajectory.q))


def _weight(robot) -> float:
    return robot.resistance[0] / robot.torque_constant[0] ** 2


def _form(integral, weight=_weight):
    """A wrong form: of the projectors (k, N, N) and the trajectory, with another weight perhaps."""

    def form(robot, trajectory, K_P):
        return weight(robot) * K_P**2 * integral(_null(robot, trajectory), trajectory)

    return form


def _held(values, trajectory):
    return values[:-1].sum(axis=0) * trajectory.dt


def _of_matrices(matrix):
    """A wrong form with another matrix (k, N, N) of A (k, N, 2) in place of the projector."""

    def form(robot, trajectory, K_P):
        values = matrix(control_matrix(robot, trajectory.q), robot.n_arms)
        return _weight(robot) * K_P**2 * _held(values, trajectory)

    return form


def _of_cross_products(robot, trajectory, K_P):
    """The three-drive formula with the null vector, for the first three drives."""
    A = control_matrix(robot, trajectory.q)[:, :3]
    n = np.cross(A[..., 0], A[..., 1])
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    return _weight(robot) * K_P**2 * _held(n[:, :, None] * n[:, None, :], trajectory)


FORMS = {
    "the gain is not squared: torques grow with K_P, energies with K_P² (a factor K_P is missing)": (
        lambda robot, trajectory, K_P: antagonism_form(robot, trajectory, K_P) / K_P
    ),
    "the gain is missing: a factor K_P² (N m/rad squared)": (
        lambda robot, trajectory, K_P: antagonism_form(robot, trajectory, 1.0)
    ),
    "the last sample is counted too; a torque is held from each sample to the next, so there is one hold fewer": _form(
        lambda N, path: N.sum(axis=0) * path.dt
    ),
    "the factor dt is missing: a sum over the samples is no integral": _form(lambda N, path: N[:-1].sum(axis=0)),
    "this is the mean over the path; the integral is wanted, a factor of its duration T is missing": _form(
        lambda N, path: N[:-1].mean(axis=0)
    ),
    "the projector of the first pose, or of the last one, is used for the whole path: A changes with the pose": _form(
        lambda N, path: N[0] * path.t[-1]
    ),
    "this is the complement: the part of the torques that moves the machine; the fight is the rest, I minus it": _form(
        lambda N, path: _held(np.eye(N.shape[-1]) - N, path)
    ),
    "nothing is projected: at rest only the part of -k_P dq remains that cannot move the machine": _form(
        lambda N, path: _held(np.eye(N.shape[-1]) + 0 * N, path)
    ),
    "the projector of the mean A is used: project at every sample, then add": (
        lambda robot, trajectory, K_P: (
            _weight(robot)
            * K_P**2
            * trajectory.t[-1]
            * (np.eye(robot.n_arms) - (A := control_matrix(robot, trajectory.q)[:-1].mean(axis=0)) @ np.linalg.pinv(A))
        )
    ),
    "the inverse of A^T A is missing: I - A A^T is no projector": _of_matrices(
        lambda A, N: np.eye(N) - A @ A.swapaxes(-1, -2)
    ),
    "this is A A^T: neither a projector nor the part that moves nothing": _of_matrices(
        lambda A, N: A @ A.swapaxes(-1, -2)
    ),
    "the factor R_el/k_t² is missing: a torque squared is no power": _form(_held, lambda robot: 1.0),
    "the factor 1/k_t² is missing: the current is the torque over k_t": _form(_held, lambda robot: robot.resistance[0]),
    "k_t is not squared: the copper loss grows with the current squared (a factor 1/k_t is missing)": _form(
        _held, lambda robot: robot.resistance[0] / robot.torque_constant[0]
    ),
    "the factor R_el is missing: the resistance of the motors": _form(
        _held, lambda robot: 1 / robot.torque_constant[0] ** 2
    ),
    "R_el is squared too: the copper loss is R_el times the current squared": _form(
        _held, lambda robot: (robot.resistance[0] / robot.torque_constant[0]) ** 2
    ),
    "only the first three drives are counted: N arms have N drives": _of_cross_products,
    "this is the trace of S, its one number; the whole matrix is wanted": (
        lambda robot, trajectory, K_P: np.trace(antagonism_form(robot, trajectory, K_P))
    ),
    "this is the integrand at every sample; it is not yet added up": (
        lambda robot, trajectory, K_P: _weight(robot) * K_P**2 * _null(robot, trajectory)[:-1]
    ),
    "only the diagonal of S is kept: the offsets of two drives fight together": (
        lambda robot, trajectory, K_P: np.diag(np.diag(antagonism_form(robot, trajectory, K_P)))
    ),
}


def _eigenvalues(choice):
    """A wrong answer from the eigenvalues of S in rising order and the number beside S."""
    return lambda S, number: choice(np.linalg.eigvalsh(S), number)


MEANS = {
    "sigma is not squared: the energy is quadratic in the offsets (a factor sigma is missing)": (
        lambda S, sigma: sigma * np.trace(S)
    ),
    "the factor sigma² is missing: this is the trace of S alone": lambda S, sigma: np.trace(S),
    "the entries beside the diagonal are added too: for independent offsets the mean of dq_i dq_j is zero": (
        lambda S, sigma: sigma**2 * S.sum()
    ),
    "this is the cost of offsets that are all equal, sigma times (1, 1, 1) over its norm; theirs are independent": (
        lambda S, sigma: sigma**2 * S.sum() / len(S)
    ),
    "this is the cost in the dearest direction, the largest eigenvalue; the mean takes all of them": _eigenvalues(
        lambda e, sigma: sigma**2 * e[-1]
    ),
    "this is the cost in the cheapest direction, the smallest eigenvalue; the mean takes all of them": _eigenvalues(
        lambda e, sigma: sigma**2 * e[0]
    ),
    "this is the mean of the principal costs; their sum is wanted: the number of drives is missing, or the offsets "
    "were drawn evenly from -sigma to sigma, whose mean square is a third of sigma²": _eigenvalues(
        lambda e, sigma: sigma**2 * e.mean()
    ),
    "this is the product of the principal costs (the determinant); their sum is wanted": (
        lambda S, sigma: sigma**2 * np.linalg.det(S)
    ),
    "this is the norm of S; the sum of its eigenvalues is wanted, the trace": (
        lambda S, sigma: sigma**2 * np.linalg.norm(S)
    ),
    "the root is one too many: this is sigma times the root of the trace": (
        lambda S, sigma: sigma * np.sqrt(np.trace(S))
    ),
    "this is the standard deviation of the cost, not its mean": lambda S, sigma: sigma**2 * np.sqrt(2 * np.sum(S * S)),
    "these are the costs of the single drives; their sum is wanted": lambda S, sigma: sigma**2 * np.diag(S),
    "this is sigma² S, still a matrix: take the mean of dq^T S dq": lambda S, sigma: sigma**2 * S,
    "S is squared: the cost is dq^T S dq, not the square of S dq": lambda S, sigma: sigma**2 * np.trace(S @ S),
    "this is the mean size of the offsets put in: the mean of |dq_i| is not the root of the mean of dq_i²": (
        lambda S, sigma: sigma**2 * 2 / np.pi * np.trace(S)
    ),
}

MINIMA = {
    "this is the dearest direction, the largest eigenvalue: the order is the opposite, max for min": _eigenvalues(
        lambda e, size: size**2 * e[-1]
    ),
    "the norm is not squared: the energy is quadratic in the offsets (a factor of size is missing)": _eigenvalues(
        lambda e, size: size * e[0]
    ),
    "the factor size² is missing: this is the smallest eigenvalue alone": _eigenvalues(lambda e, size: e[0]),
    "this is the second smallest eigenvalue: the order is off by one": _eigenvalues(lambda e, size: size**2 * e[1]),
    "this is the cost when one drive alone has the whole offset; mixed directions can be cheaper": (
        lambda S, size: size**2 * np.diag(S).min()
    ),
    "this is the first drive alone": lambda S, size: size**2 * S[0, 0],
    "this is the cost of equal offsets, (1, 1, 1) over its norm": lambda S, size: size**2 * S.sum() / len(S),
    "this is the cost of offsets that are all equal to size: their norm is larger": lambda S, size: size**2 * S.sum(),
    "np.linalg.eig does not sort: its first eigenvalue need not be the smallest (order)": (
        lambda S, size: size**2 * np.linalg.eig(S)[0][0].real
    ),
    "np.linalg.eig does not sort: its last eigenvalue need not be the smallest (order)": (
        lambda S, size: size**2 * np.linalg.eig(S)[0][-1].real
    ),
    "this is the smallest entry of S, not its smallest eigenvalue": lambda S, size: size**2 * S.min(),
    "this is the mean cost over all directions; the least is wanted": _eigenvalues(lambda e, size: size**2 * e.mean()),
    "the smallest eigenvalue divides here; it should multiply (its inverse is taken)": _eigenvalues(
        lambda e, size: size**2 / e[0]
    ),
    "these are the offsets; their energy is wanted": lambda S, size: size * np.linalg.eigh(S)[1][:, 0],
    "a row of the matrix of eigenvectors is put in; the eigenvectors are its columns (transposed)": (
        lambda S, size: size**2 * (v := np.linalg.eigh(S)[1][0]) @ S @ v
    ),
    "these are all principal costs; the least is wanted": _eigenvalues(lambda e, size: size**2 * e),
    "the root is one too many: singular values of a root of S": _eigenvalues(lambda e, size: size**2 * np.sqrt(e[0])),
}
