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
# # Press on something that is not flat
#
# The object may be a plane, a cylinder, a sphere, a wedge, a wave, or any closed body from an STL or STEP file. This
# tutorial presses a dome on a ball, then on a hexagonal bar made in CAD. Download this page as a script:
# {download}`objects.py`.

# %%
from pathlib import Path

import matplotlib.pyplot as plt

import finger3d

SCENE = """
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

[object]
{object}

[press]
depth_mm = {depth}
steps = 4

{more}
"""
MESH = """
[mesh]
mesher = "swept"
size_mm = 0.8
base_size_mm = 3.0
"""

BALL = """
shape = "sphere"
radius_mm = 15.0
x_mm = 3.0
"""
_ = Path("ball.toml").write_text(
    SCENE.format(object=BALL, depth=0.8, more=MESH)
)
ball = finger3d.press("ball.toml", figures=False, error=False)
ball

# %% [markdown]
# The middle of the ball is 3 mm beside the apex of the dome. Contact forces act along the normals of the ball, so
# that the finger is also pushed towards -x, although the ball moves straight down. The remark is right: extents need
# more contact points, hence a smaller `size_mm` and more time. All numbers have their units in their names.

# %%
last = ball.last
print(
    f"pressed down by {last.normal_force_N:.3f} N, "
    f"sideways by {last.force_x_N:.3f} N"
)
print(
    f"contact area {last.contact_area_mm2:.1f} mm2, "
    f"of which {last.stick_area_mm2:.1f} mm2 stick"
)

# %% [markdown]
# The table of contact points shows where the surface sticks and where it slips.

# %%
points = ball.to_dataframe("contact")
fig, ax = plt.subplots(figsize=(6, 3.2), layout="constrained")
for status, colour in (
    ("open", "0.85"),
    ("stick", "tab:blue"),
    ("slip", "tab:orange"),
):
    some = points[points.status == status]
    ax.scatter(some.x_mm, some.z_mm, c=colour, s=18, label=status)
ax.set(
    xlabel="x (mm)",
    ylabel="z (mm)",
    aspect="equal",
    title="contact points of the finger",
)
ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
plt.show()

# %% [markdown]
# A body from a file is any closed surface. Here CAD makes a hexagonal bar with
# rounded edges, which lies along z with one edge down. It is the same along
# z, so that a section shows what happens.

# %%
import build123d as cad

bar = cad.extrude(
    cad.RegularPolygon(radius=5.0, side_count=6, rotation=30.0), 20.0
)
bar = cad.fillet(bar.edges().filter_by(cad.Axis.Z), 2.0)
cad.export_stl(cad.Pos(0, 0, -10) * bar, "bar.stl")

BAR = """
shape = "mesh"
path = "bar.stl"
"""
SECTION = """
[model]
domain = "plane-strain"

[mesh]
size_mm = 0.15
base_size_mm = 1.0
"""
_ = Path("bar.toml").write_text(
    SCENE.format(object=BAR, depth=0.8, more=SECTION)
)
on_bar = finger3d.press("bar.toml", figures=False, error=False)
on_bar.plot_contact()

# %% [markdown]
# The pressure under an edge is narrow and high, and contact points must be close enough together to see it:
# `finger3d plan` warns where they are not, and a press whose object passes between them is refused with the edge
# length that resolves it. `largest_penetration_mm` says how deep any place of the finger's surface ended up inside
# the object.

# %%
print(
    f"deepest penetration: {on_bar.last.largest_penetration_mm:.4f} mm "
    f"of {on_bar.last.depth_mm:g} mm"
)
