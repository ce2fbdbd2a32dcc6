# ---
# jupytext:
#   text_representation:
#     extension: .py
#     format_name: percent
# kernelspec:
#   display_name: Python 3
#   name: python3
# ---

# %% [markdown]
# # How hard must a hand hold?
#
# A finger that reads the friction of an object tells how hard to hold it. This tutorial calibrates a gauge, reads a
# coefficient of friction with its uncertainty, chooses the normal force for an object of a given weight, lifts it, and
# checks how near to slipping it is. Download this page as a script: {download}`hold.py`.
#
# The finger is that of Maeno, Kawamura and Cheng (2004), Fig. 9, in plane strain. A flat object between two such
# fingers is one finger on a plane with half the weight.

# %%
from pathlib import Path

import numpy as np

import finger3d

FINGER = """
effects.auto = false  # small strain: quick, and what the text below is about
[finger]
geometry = "clipped_cylinder"
radius_mm = 100.0
half_length_mm = 50.0
edge_height_mm = 36.6
width_mm = 20.0

[material]
E_MPa = 1.0
nu = 0.49

[friction]
mu = 0.3

[model]
domain = "plane-strain"

[mesh]
size_mm = 2.0
base_size_mm = 8.0

[[gauge]]
name = "g36"
x_mm = 36.0
y_mm = 40.0
angle_deg = 30.0     # from +x towards +y
"""

_ = Path("read.toml").write_text(FINGER + "[press]\ndepth_mm = 10.0\n")

# %% [markdown]
# Pressed 10 mm, the gauge reads friction. A single reading has a noise of 0.0005, and the mean of 25 readings a fifth
# of that. The tolerances of a real finger widen the estimate; [From strain to friction](friction) treats them, and they
# are left out here.

# %%
READINGS, NOISE = 25, 5e-4
calibration = finger3d.calibrate(
    "read.toml", "g36", "out/sensor", noise=NOISE
)
errors = np.random.default_rng(1).normal(0.0, NOISE, READINGS)
strain = float(calibration["g36"].at(0.3)) + errors.mean()
(found,) = finger3d.estimate(
    calibration, strain, NOISE / READINGS**0.5, tolerances=False
)
print(found.verdict)

# %% [markdown]
# The object weighs 2.4 kg. Each finger carries half of it, and the normal force must be at least that over the
# coefficient of friction. Three standard deviations on the safe side fail once in 741 objects. Of 200 objects drawn at
# random all were lifted, with 1.01 times the least force in the median and 1.18 times it at most. After a single reading
# it would be up to 3.3 times where mu is below 0.2: there the strain changes half as much with mu, and three standard
# deviations are up to half of mu ([held_weights](../../validation/held_weights.py)).

# %%
load_N = 0.5 * 2.4 * 9.81
normal_N = load_N / (found.mu - 3.0 * found.std)
print(f"hold with {normal_N:.1f} N; the least is {load_N / 0.3:.1f} N")

# %% [markdown]
# `force_N` in a leg is the normal force, `force_x_N` the force applied to the object along x. Depth and slide follow.

# %%
lift = f"""
[[press.leg]]
force_N = {normal_N}
steps = 4

[[press.leg]]
force_N = {normal_N}
force_x_N = {-load_N}
steps = 4
"""
_ = Path("lift.toml").write_text(FINGER + lift)
result = finger3d.press("lift.toml", "out/lift")
print(result.outcome)
print(f"the object sinks by {-result.last.slide_x_mm:.2f} mm")

# %% [markdown]
# `slip_margin` says how near to slipping the contact is: 1 less the tangential load over the largest that it holds.

# %%
result.last.slip_margin

# %% [markdown]
# With a smaller normal force the whole contact slips. The press ends there, and says how much can be held.

# %%
less = [f"press.leg.{k}.force_N={0.9 * load_N / 0.3}" for k in (0, 1)]
dropped = finger3d.press("lift.toml", "out/dropped", overrides=less)
print(dropped.summary()["outcome"])
