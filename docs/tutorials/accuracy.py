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
# # What accuracy costs
#
# The numbers of a press have error bars. This tutorial refines a mesh by hand, compares the error bars with the
# true errors, and lets finger3d choose the mesh for a given accuracy. Download this page as a script:
# {download}`accuracy.py`.

# %%
import time
from pathlib import Path

import matplotlib.pyplot as plt

import finger3d

_ = Path("finger.toml").write_text("""
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
steps = 5

[model]
domain = "plane-strain"
""")


def pressed(size_mm: float) -> tuple[float, float, int, float]:
    """Return normal force, its error bar (N), number of unknowns, and seconds."""
    scene = finger3d.load(
        "finger.toml",
        [f"mesh.size_mm={size_mm}", f"mesh.base_size_mm={4 * size_mm}"],
    )
    begin = time.perf_counter()
    result = finger3d.press(scene, figures=False)
    summary = result.summary()
    bar = summary["error_estimate"]["discretisation"]["normal_force_N"]
    return (
        result.last.normal_force_N,
        bar,
        summary["mesh"]["dofs"],
        time.perf_counter() - begin,
    )


# %%
sizes = [1.6, 0.8, 0.4]
found = {size: pressed(size) for size in sizes}
fine = finger3d.load(
    "finger.toml", ["mesh.size_mm=0.1", "mesh.base_size_mm=0.4"]
)
truth = finger3d.press(fine, figures=False, error=False).last.normal_force_N
print(
    "edge (mm)  unknowns  force (N)  error bar (N)  true error (N)  seconds"
)
for size, (force, bar, dofs, seconds) in found.items():
    print(
        f"{size:9g} {dofs:9d} {force:10.4f} {bar:14.4f} "
        f"{abs(force - truth):15.4f} {seconds:8.2f}"
    )

# %% [markdown]
# The true error is the difference from a mesh with edges of 0.1 mm. Error bars are estimates from the solution
# itself. The true error is within twice the bar in nine cases of ten, and most bars are wider than they need be
# ([Accuracy and cost](../accuracy.md)).

# %%
unknowns = [found[size][2] for size in sizes]
fig, ax = plt.subplots(figsize=(6, 3.5), layout="constrained")
ax.loglog(
    unknowns, [found[size][1] for size in sizes], "s--", label="error bar"
)
ax.loglog(
    unknowns,
    [abs(found[size][0] - truth) for size in sizes],
    "o-",
    label="true error",
)
ax.set(xlabel="unknowns", ylabel="error of the normal force (N)")
ax.legend()
plt.show()

# %% [markdown]
# `tolerance` in place of edge lengths states the wanted accuracy, as a share of the normal force or of the number that
# `goal` names. finger3d starts from its default mesh, and refines it where that number needs it, until the error bar is
# small enough; a mesh that is finer than the tolerance asks for is made coarser.

# %%
scene = finger3d.load("finger.toml", ["mesh.tolerance=0.002"])
result = finger3d.press(scene, figures=False)
force, summary = result.last.normal_force_N, result.summary()
bar = summary["error_estimate"]["discretisation"]["normal_force_N"]
print(
    f"{force:.4f} N with {summary['mesh']['dofs']} unknowns; "
    f"the error bar is {bar / force:.2%} of it"
)

# %% [markdown]
# `plan` forecasts what a scene costs before anything is solved.

# %%
forecast = finger3d.plan(fine)
print(
    f"{forecast.dofs} unknowns, {forecast.total_s:.1f} s, "
    f"{forecast.memory_MB:.0f} MB"
)
