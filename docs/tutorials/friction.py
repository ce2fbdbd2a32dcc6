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
# # From strain to friction
#
# A strain gauge inside the finger reads the friction between the finger and the object, if it sits at the right
# place. This tutorial calibrates a gauge, and turns a reading into a coefficient of friction with its uncertainty.
# Download this page as a script: {download}`friction.py`.
#
# The finger is that of Maeno, Kawamura and Cheng (2004), Fig. 9, in plane strain, pressed 10 mm on a plane.

# %%
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import finger3d

_ = Path("fig9.toml").write_text("""
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
mu = 0.25

[press]
depth_mm = 10.0

[model]
domain = "plane-strain"

[mesh]
size_mm = 0.5
base_size_mm = 2.0

[[gauge]]
name = "g36"
x_mm = 36.0
y_mm = 40.0
angle_deg = 30.0     # from +x towards +y
""")

# %% [markdown]
# The body is condensed once to its contact points. After that, a press with another coefficient of friction costs the
# solution of contact only. Depth, modulus, tilt and the place of the gauge are not known exactly; each is a tolerance with a
# standard deviation. Here the gauge has been measured after it was laid, and the finger is well aligned.

# %%
measured = {
    "gauge_angle_deg": 0.5,
    "gauge_x_mm": 0.1,
    "gauge_y_mm": 0.1,
    "tilt_deg": 0.1,
}
calibration = finger3d.calibrate(
    "fig9.toml", "g36", "out/calibration", tolerances=measured
)
calibration

# %%
mu = np.linspace(calibration.mu[0], calibration.mu[-1], 200)
fig, ax = plt.subplots(figsize=(6, 3.5), layout="constrained")
g36 = calibration["g36"]
ax.plot(mu, g36.at(mu))
ax.plot(g36.mu, g36.reading, "o", markersize=4)
ax.set(xlabel="coefficient of friction", ylabel="strain of gauge g36")
plt.show()

# %% [markdown]
# A reading gives a likelihood of the coefficient of friction. With the noise of the gauge alone it is narrow:

# %%
for true in (0.2, 0.3, 0.4):
    (found,) = finger3d.estimate(
        calibration, float(g36.at(true)), tolerances=False
    )
    print(found.verdict)

# %% [markdown]
# The tolerances and the mesh widen it, since one gauge cannot tell them apart from friction:

# %%
for true in (0.2, 0.3, 0.4):
    (found,) = finger3d.estimate(calibration, float(g36.at(true)))
    print(found.verdict)

# %% [markdown]
# The calibration finds mu to 0.1 or better wherever these estimates do, and nowhere else:

# %%
print(calibration.verdict())

# %% [markdown]
# Several gauges together tell friction from the tolerances, and
# `finger3d.place_gauges` finds their places; see [From strain to friction](../sensor.md). In a finger of finite width
# this gauge tells much less than in the section: that is why a sensor is calibrated as a solid, with the same call
# and `domain = "solid"`.
