"""What is hidden in the logs of ``data/mystery_runs``, for the checks and the script that makes them.  No peeking."""

from __future__ import annotations

import numpy as np

K_P, K_D = 7.05, 0.225
_SEED = 2013
_NAMES = ("offset_a", "offset_b", "offset_c", "gain")


def random_numbers(name: str) -> np.random.Generator:
    """The generator of one log; the hidden values are its first draws, the noise of the sensors follows."""
    return np.random.default_rng([_SEED, _NAMES.index(name)])


def hidden(name: str, rng: np.random.Generator | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Offsets (3,) in rad, measured minus true angle, and gains K_P (3,) in N m/rad of one log."""
    rng = random_numbers(name) if rng is None else rng
    offset = rng.choice([-1.0, 1.0], 3) * rng.uniform(3e-3, 9e-3, 3)
    gains = np.full(3, K_P)
    if name == "gain":
        gains[rng.integers(3)] *= rng.uniform(0.45, 0.65)
    return offset, gains
