"""Figures of lesson 00: the machine in all its working modes."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from ...figures.machine import plot_machine
from ...figures.maps import mode_name
from ...mechanics.kinematics import inverse_kinematics, working_modes


def plot_working_modes(robot, x, axes=None):
    """The machine at the point x (2,) in m, once per working mode; returns the axes."""
    modes = working_modes(robot)
    if axes is None:
        axes = plt.subplots(2, len(modes) // 2, figsize=(2.5 * len(modes) // 2, 5.2), sharex=True, sharey=True)[1]
    for ax, mode in zip(np.ravel(axes), modes, strict=True):
        plot_machine(robot, inverse_kinematics(robot, x, mode), ax, labels=False)
        ax.set_title(mode_name(mode), loc="center")
        ax.label_outer()
    return axes
