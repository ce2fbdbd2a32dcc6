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
# # Is a section enough?
#
# A finger is often computed as its cross-section, in plane strain or in plane stress. This tutorial computes the same
# finger as both sections and as a solid, and compares their forces. Download this page as a script:
# {download}`section.py`.
#
# The finger is a silicone dome 24 mm long, 10 mm high and 8 mm wide. A scene is one TOML file, with units in its
# keys.

# %%
from pathlib import Path

import matplotlib.pyplot as plt

import finger3d

_ = Path("finger.toml").write_text("""
title = "A finger 8 mm wide"
effects.auto = false  # small strain: quick, and what the text below is about

[finger]
geometry = "clipped_cylinder"
radius_mm = 20.0
half_length_mm = 12.0
edge_height_mm = 6.0
width_mm = 8.0

[material]
E_MPa = 0.5
nu = 0.49

[friction]
mu = 0.4

[press]
depth_mm = 1.0
steps = 4

[mesh]
mesher = "swept"     # structured, the same on every run
size_mm = 1.6
base_size_mm = 3.2
""")

# %% [markdown]
# `compare` solves the scene in plane stress, in plane strain and as a solid, here also for two other widths. Each
# number has an error bar, and the verdict states by how much the sections are wrong.

# %%
comparison = finger3d.compare(
    "finger.toml", "out/compare", widths=[4.0, 24.0]
)
comparison

# %% [markdown]
# Plane strain holds the material between two rigid walls; a nearly incompressible finger that is free at its ends
# bulges out there instead and is softer. The force per width of the solid approaches that of plane strain as the
# finger becomes wide, and that of plane stress as it becomes narrow.

# %%
solids = sorted(
    (c.width_mm, c.numbers["force_N_per_mm"])
    for c in comparison.cases
    if c.model == "solid"
)
fig, ax = plt.subplots(figsize=(6, 3.5), layout="constrained")
ax.plot(*zip(*solids, strict=True), "o-", label="solid")
for model, style in (("plane strain", "--"), ("plane stress", ":")):
    force = next(
        c.numbers["force_N_per_mm"]
        for c in comparison.cases
        if c.model == model
    )
    ax.axhline(force, color="grey", linestyle=style, label=model)
ax.set(
    xlabel="width of the finger (mm)",
    ylabel="normal force per width (N/mm)",
    ylim=(0, None),
)
ax.legend(loc="lower right")
plt.show()

# %% [markdown]
# The mesh here is coarse, so that the page is built in seconds. Without `size_mm` and `base_size_mm` finger3d chooses
# finer ones; the same call then takes longer, and its error bars are shorter. From the command line:
#
# ```sh
# finger3d compare finger.toml --out out/compare
# ```
