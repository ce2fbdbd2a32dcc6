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
# # Labels for learning
#
# A model that reads a tactile sensor is trained on presses whose answer is known. `[labels]` in a scene makes `sweep`
# write that answer beside the numbers of each press: on a regular grid of the contact face the displacement, the depth of
# the surface, pressure, shear, and which places stick or slip. This tutorial draws twelve presses of a gel pad at
# random, reads the file in three lines, and looks at one sample. Download this page as a script:
# {download}`labels.py`.
#
# All samples share one pad, whatever their object, friction coefficient and path: it is meshed and condensed
# ([glossary](../glossary.md#condensation)) once, with edges of one length all over its contact face. A sample then
# costs only its increments. On edges of 0.6 to 1 mm of a pad of 20 x 16 mm a sample takes a quarter of a second on two
# cores, 100 000 take six and a half hours, and forces are 1 to 2 % off
# ([label_rate](../../validation/label_rate.py)).

# %%
from pathlib import Path

import h5py
import matplotlib.pyplot as plt

import finger3d

_ = Path("pad.toml").write_text("""
effects.auto = false  # small strain: quick
[finger]
geometry = "block"
half_length_mm = 10.0
height_mm = 4.0
width_mm = 16.0

[material]
E_MPa = 0.1
nu = 0.45

[object]
shape = "sphere"
radius_mm = 5.0
x_mm = 0.0
z_mm = 0.0

[friction]
mu = 0.5

[[press.leg]]
depth_mm = 0.6
steps = 4
[[press.leg]]
depth_mm = 0.6
slide_x_mm = 0.3
steps = 4

[mesh]
mesher = "swept"
size_mm = 1.0
base_size_mm = 1.0

[labels]
grid_mm = 0.5
""")
ranges = {
    "friction.mu": (0.2, 1.0),
    "object.radius_mm": (3.0, 8.0),
    "object.x_mm": (-4.0, 4.0),
    "object.z_mm": (-3.0, 3.0),
}
found = finger3d.sweep(
    "pad.toml", ranges, "out/labels", sample="random:12", seed=1
)
print(
    len(found.columns["point"]), "samples,", found.failed, "without numbers"
)

# %% [markdown]
# On the command line this is
#
# ```
# finger3d sweep pad.toml --sample random:12 --seed 1 --range friction.mu=0.2:1 --range object.radius_mm=3:8 \
#     --range object.x_mm=-4:4 --range object.z_mm=-3:3 --out out/labels
# ```
#
# It may be stopped at any time, even killed: the same command continues, and `labels.h5` has all samples that were
# finished. With `--scheduler ADDRESS` it runs on a Dask cluster.
#
# `labels.h5` has a group for each body; here there is one. The first axis of every array is the sample, the second the
# increment. Only the last increment is there, unless `[labels]` has `increments = "all"`. The numbers of each sample,
# with the keys that were drawn, are in `numbers`.

# %%
with h5py.File("out/labels/labels.h5") as file:
    pad = file["body_1"]
    pressure, mu = pad["pressure_MPa"][:], pad["numbers/friction.mu"][:]
    x, z, status, shear = (
        pad["x_mm"][:],
        pad["z_mm"][:],
        pad["status"][:],
        pad["shear_MPa"][:],
    )
print("pressure: samples, increments, along x, along z:", pressure.shape)
print("mu of the first samples:", mu[:4].round(3))

# %% [markdown]
# One sample: the pressure, the shear along the slide, and where the ball sticks. Places that no point touches are open.

# %%
sample = int(pressure.max(axis=(1, 2, 3)).argmax())
figure, axes = plt.subplots(
    1, 3, figsize=(10, 3.4), sharey=True, layout="constrained"
)
for axis, field, title in (
    (axes[0], pressure, "pressure, kPa"),
    (axes[1], shear[..., 0], "shear along x, kPa"),
):
    image = axis.pcolormesh(x, z, 1e3 * field[sample, 0].T, shading="nearest")
    figure.colorbar(image, ax=axis, shrink=0.75)
    axis.set_title(title)
image = axes[2].pcolormesh(
    x,
    z,
    status[sample, 0].T,
    cmap=plt.get_cmap("Greys", 3),
    vmin=-0.5,
    vmax=2.5,
)
bar = figure.colorbar(image, ax=axes[2], ticks=[0, 1, 2], shrink=0.75)
bar.ax.set_yticklabels(["open", "stick", "slip"])
axes[2].set_title(f"status at mu = {mu[sample]:.2f}")
for axis in axes:
    axis.set(xlabel="x, mm", aspect="equal", xlim=(-7, 7), ylim=(-6, 6))
axes[0].set_ylabel("z, mm")
plt.show()
