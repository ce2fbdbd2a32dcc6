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
# # Print the mold
#
# A silicone finger is cast in a mold that a 3D printer makes. This tutorial exports the finger and its mold, with
# slots that hold the strip of a gauge in its place. Download this page as a script: {download}`mold.py`.

# %%
from pathlib import Path

import matplotlib.image
import matplotlib.pyplot as plt

import finger3d

_ = Path("finger.toml").write_text("""
title = "A finger with a gauge"

[finger]
geometry = "clipped_cylinder"
radius_mm = 20.0
half_length_mm = 12.0
edge_height_mm = 6.0
width_mm = 8.0

[material]
E_MPa = 0.5
nu = 0.49

[press]
depth_mm = 1.0

[[gauge]]
name = "g"
x_mm = 5.0
y_mm = 6.0
angle_deg = 30.0
length_mm = 3.0
""")

# %% [markdown]
# `shrinkage` makes the cavity larger by what the silicone shrinks when it cures.

# %%
made = finger3d.export(
    "finger.toml", "out/mold", mold=finger3d.MoldOptions(shrinkage=0.001)
)
print(
    f"{made.silicone_ml:.2f} ml of silicone "
    f"for a finger of {made.volume_mm3:.0f} mm3"
)
print(*sorted(file.name for file in made.files), sep="\n")

# %% [markdown]
# Each part has an STL file, and `mold.3mf` has all of them as they should be printed. `mold.html` shows the steps of
# casting; [Molds](../molds.md) has the options.

# %%
fig, ax = plt.subplots(figsize=(7, 6), layout="constrained")
ax.imshow(matplotlib.image.imread("out/mold/mold.png"))
ax.axis("off")
plt.show()

# %% [markdown]
# The sheet says what to print, how much to mix, and in which order to assemble.

# %%
print(Path("out/mold/sheet.txt").read_text(encoding="utf-8"))
