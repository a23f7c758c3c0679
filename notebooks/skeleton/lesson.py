# %% [markdown]
# # NN · How fast may the end-effector move?
#
# This lesson is the skeleton: short, complete and green. Keep its shape and replace its content. It opens with a
# question that a reader has, and with a picture; the answer comes at the end. Here: the drives have a largest speed.
# What does that allow at the end-effector?
#
# **Minutes:** 46. **Prerequisites:** lesson 02 (control matrix, `rk.control_matrix`).
#
# **After this lesson you can**
#
# 1. *compute* the rates of the drives for a motion of the end-effector;
# 2. *find* the direction in which a drive turns fastest;
# 3. *design* a speed that is safe in every direction.
#
# (Two to four objectives, each a verb that can be tested. Minutes are those of the core; `python -m tests.minutes NN`
# estimates them, and each section bears its own.)
# %%
import numpy as np

import rapkm_lite as rk
from rapkm_lite import explore, plotting
from rapkm_lite.checks import check, hint

plotting.use_style()
robot = rk.load().replace(friction=0.0)
# %% [markdown]
# ## Picture first (2 min)
#
# A question stands before every picture, and its answer is out of sight: in a cell with the tag `hide-output`, or
# folded in `<details>`. What the picture shows is also said in words, for those who do not see it: the line `alt` of
# the cell. Figures that only this lesson needs live in `rapkm_lite/lessons/lessonNN/figures.py`.
#
# **Predict.** Where in the workspace does drive 1 have to turn most for one metre of the end-effector, near its base
# point or far away from it? Decide, then run the cell.
# %% tags=["hide-output"] alt="Map of the workspace: drive 1 turns most per metre at the rim."
plotting.plot_turning_NN(robot, 0);
# %% [markdown]
# <details><summary>What you see</summary>
#
# Rad per metre over the workspace. The value grows without bound towards the rim, where an arm is straight and its
# drive cannot move the end-effector along it.
#
# </details>
#
# ## From the equation to a number (14 min)
#
# The rates of the driven joints follow from the velocity of the end-effector,
#
# $$\dot q_a = A\,\dot x .$$
#
# Row $i$ of $A$ belongs to drive $i$; `rk.inverse_kinematics` gives the angles at which it is taken. Equation, then a
# short cell, then what the reader should see, then an `assert` that it is so. Cells whose printed output is compared by
# the tests bear the tag `nbval-check-output`.
# %% tags=["nbval-check-output"]
x, xd = np.array([0.02, -0.03]), np.array([0.1, 0.0])  # m, m/s
A = rk.control_matrix(robot, rk.inverse_kinematics(robot, x))
print("rates in rad/s:", (A @ xd).round(3))
step = 1e-6
moved = rk.inverse_kinematics(robot, x + step * xd) - rk.inverse_kinematics(robot, x)
np.testing.assert_allclose(moved[:3] / step, A @ xd, rtol=1e-4)
# %% [markdown]
# ### Exercise 1: rates of the drives
#
# Lines between the two marks in the source become `raise NotImplementedError` in the student's copy. The check compares
# with the package at random poses and with a law that a right answer obeys; `hint("NN.driven_rates")` helps in three
# steps.
# %%
def driven_rates(A, xd):
    """Rates (m,) in rad/s of the driven joints; A is (m, 2) in rad/m, xd (2,) in m/s."""
    ### BEGIN SOLUTION
    return A @ xd
    ### END SOLUTION

driven_rates = check("NN.driven_rates", driven_rates)
# %% tags=["nbval-check-output"]
for angle in (0, 90, 180):
    way = 0.1 * np.array([np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))])
    print(f"towards {angle:3d} deg: {driven_rates(A, way).round(2) + 0.0} rad/s")
# %% [markdown]
# ## The worst direction (12 min)
#
# ### Exercise 2: how fast a drive turns
#
# In which direction does drive $i$ turn fastest, and how fast is that at 1 m/s? Think of $A_i\dot x$ as a scalar
# product.
# %%
def turning(A):
    """Largest rate (m,) in rad/s of each drive at 1 m/s in any direction."""
    ### BEGIN SOLUTION
    return np.linalg.norm(A, axis=1)
    ### END SOLUTION

turning = check("NN.turning", turning)
# %% tags=["nbval-check-output"]
print("rad per metre:", turning(A).round(2))
assert np.all(turning(A) >= np.abs(driven_rates(A, np.array([1.0, 0.0]))))
# %% [markdown]
# ## The wrong way first (13 min)
#
# One may want to take a typical rate: the mean over the drives. Measure how wrong that is before you show the right
# way; a reader remembers a number that failed.
# %% tags=["nbval-check-output"]
limit = 5.0  # rad/s
typical = limit / turning(A).mean()
print(f"with the mean: {typical:.3f} m/s, and then the fastest drive turns at {typical * turning(A).max():.2f} rad/s")
assert typical * turning(A).max() > limit
# %% [markdown]
# ### Exercise 3: a speed that is safe
#
# The last exercise is a design, judged by what it does: the check prints the measured rates beside their limits.
# %%
def safe_speed(A, limit):
    """Largest speed in m/s that is safe in every direction; no drive may exceed `limit` in rad/s."""
    ### BEGIN SOLUTION
    return limit / turning(A).max()
    ### END SOLUTION

safe_speed = check("NN.safe_speed", safe_speed)
# %% tags=["nbval-check-output"]
speed = safe_speed(A, limit)
print(f"safe speed {speed:.3f} m/s")
assert np.all(speed * turning(A) <= limit * (1 + 1e-12)) and speed < typical
# %% [markdown]
# ### Dig deeper: a hexagon of safe velocities (1 min)
# %% [markdown]
# A folded part begins with a heading that stands alone in its cell, and ends with the next heading of its level or
# above. Whoever skips it misses nothing that the core needs. Here: with all drives at most as fast as the limit, the
# safe velocities fill a hexagon, and the safe speed is the radius of the largest circle inside.
# %% [markdown]
# ## Try it (2 min)
#
# **Predict.** Move the end-effector slowly to the rim of the workspace. Which arm stretches, and what does its drive do
# per step?
# %% alt="The machine at its first setting, with the panels that show what each pair of drives holds alone."
explore.machine()
# %% [markdown]
# <details><summary>What to see</summary>
#
# Near the rim one arm is almost straight. A small step along it needs a large turn of its drive, so the safe speed goes
# to zero there, in every working mode.
#
# </details>
#
# ## Summary (1 min)
#
# - The rates of the drives are $A\dot x$; each row of $A$ is a worst direction and its length a worst rate.
# - The drive that turns farthest per metre decides how fast the end-effector may move.
#
# **Applied:** limits of a pick-and-place path. **Where next:** back to the [overview](../00_start_here.ipynb).
