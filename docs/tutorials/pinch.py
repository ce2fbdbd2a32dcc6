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
# # Pick it up
#
# Two fingers hold an object by friction: each presses on it with the force $N$, and together they carry at most
# $2 \mu N$. This tutorial closes two fingers on a ceramic ball, lets its weight act, reads whether it is held and how
# far it sinks, and finds the smallest grip that holds it for three coefficients of friction. Download this page as a
# script: {download}`pinch.py`.
#
# `[grip]` takes the place of `[press]`. The scene describes the lower finger; the upper one is its mirror image and
# faces it along y across the ball. This scene is `geometries/pinch.toml` on a coarser mesh and in small strain.

# %%
from pathlib import Path

import matplotlib.pyplot as plt

import finger3d

_ = Path("pinch.toml").write_text("""
effects.auto = false  # small strain: quick
[finger]
geometry = "clipped_cylinder"
radius_mm = 25.0
half_length_mm = 9.0
edge_height_mm = 7.0
width_mm = 16.0

[material]
E_MPa = 0.3
nu = 0.45

[object]
shape = "sphere"
radius_mm = 13.0

[friction]
mu = 0.6

[grip]
force_N = 0.5        # of each finger
mass_g = 36.0        # weighs along -z, unless down says otherwise
steps = 3

[mesh]
mesher = "swept"
size_mm = 1.0
base_size_mm = 4.0
""")
held = finger3d.press("pinch.toml", "out/pinch", error=False)
print(held.outcome)

# %% [markdown]
# While the fingers close, the ball moves along y only. Then its weight acts in three increments
# ([glossary](../glossary.md#increment)), in which the ball may move and turn in every direction except those that the
# symmetry of fingers, ball and weight about x excludes. `object_pose` says how far its centre of mass has moved since
# first touch.

# %%
summary = held.summary()
pose = summary["object_pose"]
print("held:", summary["held"])
print(f"each finger closes by {pose['closing_mm']:.3f} mm")
print(f"the ball sinks by {-pose['z_mm']:.3f} mm")

# %% [markdown]
# `fingers` has the increments of both fingers. Their `slip_margin` says how near each is to slipping: it is the share of
# the largest tangential load that is still left.

# %%
for finger in summary["fingers"]:
    last = finger["steps"][-1]
    print(
        f"{finger['finger']}: {last['normal_force_N']:.3f} N, "
        f"carries {-last['force_z_N']:.3f} N, "
        f"{100 * (1.0 - last['slip_margin']):.0f} % of what it holds"
    )

# %% [markdown]
# The picture shows both fingers and the ball; pressure, stick and slip of the upper finger are on its far side.

# %%
fig, ax = plt.subplots(figsize=(6, 6), layout="constrained")
ax.imshow(plt.imread("out/pinch/finger.png"))
ax.set_axis_off()
plt.show()

# %% [markdown]
# ## The least grip
#
# Coulomb's law asks for $N \ge m g / (2 \mu)$ where all friction acts along the weight. `least_grip=True`, or
# `--least-grip` on the command line, finds the smallest force that holds the ball, within 1 %, by bisection: it closes
# the fingers with each force in turn and lets the weight act. Here it agrees with Coulomb's law within that 1 %,
# because the contact is small compared with the ball and nearly flat. It need not agree if an object also turns, or if
# fingers reach around it.

# %%
WEIGHT = 36e-3 * 9.80665
mus, least = (0.3, 0.6, 0.9), []
for mu in mus:
    found = finger3d.press(
        "pinch.toml",
        overrides=[f"friction.mu={mu}", f"grip.force_N={0.7 * WEIGHT / mu}"],
        figures=False,
        error=False,
        least_grip=True,
    )
    least.append(found.summary()["least_grip_N"])
    flat = 0.5 * WEIGHT / mu
    print(f"mu = {mu}: {least[-1]:.3f} N, m g / (2 mu) = {flat:.3f} N")
