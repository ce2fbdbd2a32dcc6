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
# # A ball on a gel pad
#
# Camera-based tactile sensors, such as GelSight, watch dots on a thin pad of soft gel. This tutorial presses a ball
# onto such a pad, drags it until part of the contact slips, and shows what the camera would see. Download this page
# as a script: {download}`gel_pad.py`.
#
# The pad is a block of silicone 4 mm high, of Shore hardness 00-30. The first leg of the path presses with 2 N, the
# second keeps that force and moves the ball 1 mm along x. `marker_grid` places the dots. This is the scene
# `geometries/gel_pad.toml` with longer edges and fewer increments.

# %%
from pathlib import Path

import matplotlib.pyplot as plt

import finger3d

_ = Path("gel_pad.toml").write_text("""
[finger]
geometry = "block"
half_length_mm = 15.0
height_mm = 4.0
width_mm = 20.0

[material]
shore_00 = 30.0
nu = 0.49

[object]
shape = "sphere"
radius_mm = 6.0

[friction]
mu = 0.5

[[press.leg]]
force_N = 2.0
steps = 3

[[press.leg]]
force_N = 2.0
steps = 4
slide_x_mm = 1.0

[marker_grid]
spacing_mm = 2.0

[mesh]
mesher = "swept"
size_mm = 1.0
base_size_mm = 3.0
""")
pad = finger3d.press("gel_pad.toml", figures=False, error=False)
last = pad.last
print(
    f"indented {last.depth_mm:.2f} mm by {last.normal_force_N:.2f} N; "
    f"dragged with {last.force_x_N:.2f} N"
)
print(
    f"contact area {last.contact_area_mm2:.1f} mm2, "
    f"of which {last.stick_area_mm2:.1f} mm2 stick"
)

# %% [markdown]
# Each arrow is the displacement of a dot in the plane of the camera, enlarged. Dots under the ball follow it, those
# around it are pushed outwards.

# %%
dots = pad.to_dataframe("markers")
dots = dots[dots.step == dots.step.max()]
fig, ax = plt.subplots(figsize=(6, 4), layout="constrained")
ax.quiver(
    dots.x_mm,
    dots.z_mm,
    dots.displacement_x_mm,
    dots.displacement_z_mm,
    angles="xy",
    scale_units="xy",
    scale=0.5,
)
ax.set(
    xlabel="x (mm)",
    ylabel="z (mm)",
    aspect="equal",
    title="displacements of the dots, twice their size",
)
plt.show()

# %% [markdown]
# The contact is coarse here. `finger3d cost gel_pad.toml` says what smaller errors would take in edge lengths, time
# and memory, before anything long is computed, and a press with `error=True`, the default, has an error bar for
# every number.
