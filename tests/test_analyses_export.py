"""Files for other programs: the mesh, and the deck of CalculiX."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import finger3d
from finger3d.analyses.calculix import (
    MOST_FACETS,
    OBJECT,
    Contact,
    Deck,
    DeckStep,
    ObjectElements,
    export_mesh,
    facet_lines,
    law_cards,
    object_elements,
    press_deck,
)
from finger3d.cli import main
from finger3d.fem.hyperelastic import Hyperelastic
from finger3d.fem.laws import MooneyRivlin, NeoHooke, Ogden, Yeoh
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.mesh import FACETS, quadratic
from finger3d.meshing.given import given_mesh
from finger3d.meshing.mesh_files import write_mesh_vtu
from finger3d.objects import Cylinder, MeshObject, ObjectPose, PlacedObject, Plane, RigidObject, Sphere, Wave, Wedge
from finger3d.scene import load, parse
from tests.bodies import ball, box
from tests.energies import energy as energy_of
from tests.given_meshes import GMSH, cube, refused
from tests.scenes import BLOCK, written
from validation._ccx import printed_forces, program, solve


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    return written(tmp_path, BLOCK)


def swept(path: Path, *keys: str):
    return load(
        path, ['model.domain="solid"', 'mesh.mesher="swept"', "mesh.size_mm=2.0", "mesh.base_size_mm=3.0", *keys]
    )


def test_a_mesh_that_was_written_is_the_same_finger(scene_file: Path, tmp_path: Path) -> None:
    scene = swept(scene_file)
    done = export_mesh(scene, tmp_path / "out")
    assert [file.name for file in done.files] == ["finger.vtu"]
    forces = [finger3d.press(scene, error=False).last.normal_force_N]
    for file in done.files:
        back = scene_file.with_name("back.toml")
        table = BLOCK.split("[material]", 1)[1].split("[model]")[0].split("[mesh]")[0]
        back.write_text(f'effects.auto = false\n[finger]\ngeometry = "{file}"\n[material]{table}', encoding="utf-8")
        result = finger3d.press(load(back), error=False)
        forces.append(result.last.normal_force_N)
        assert result.summary()["scene"]["mesh"]["size_mm"] == pytest.approx(2.0, rel=0.3)
    # the same cells, whole here and halved by symmetry there: round-off
    assert forces[1:] == pytest.approx([forces[0]], rel=1e-6)


def test_a_section_and_the_fingers_own_folder_are_refused(scene_file: Path, tmp_path: Path) -> None:
    assert "model.domain" in refused(
        lambda: export_mesh(swept(scene_file, 'model.domain="plane-strain"'), tmp_path / "out")
    )
    own = tmp_path / "finger.vtu"
    write_mesh_vtu(own, given_mesh(GMSH / "binary.msh").mesh)
    text = f'[finger]\ngeometry = "{own}"\n[material]\nE_MPa = 1.0\nnu = 0.4\n[press]\ndepth_mm = 1.0\n'
    given = written(tmp_path, text)
    before = own.read_bytes()
    line = refused(lambda: export_mesh(load(given), tmp_path))
    assert line.startswith(f"--out {tmp_path}: ")
    assert own.name in line
    assert own.read_bytes() == before


def test_the_command_writes_a_deck_or_a_mesh(
    scene_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["export", str(scene_file), "--set", 'mesh.mesher="swept"', "--set", "mesh.size_mm=2.0"]
    command += ["--set", 'model.domain="solid"']
    command += ["--set", "mesh.base_size_mm=3.0", "--json", "--out", str(tmp_path / "out")]
    assert main([*command, "--solver", "calculix"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["multiple"] == 4.0
    assert (tmp_path / "out" / "press.inp").read_text(encoding="ascii").endswith("*END STEP\n")
    assert main([*command, "--mesh"]) == 0
    assert json.loads(capsys.readouterr().out)["cells"] == 4 * found["cells"]
    assert main([*command, "--mesh", "--solver", "calculix"]) == 2
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert all(option in err for option in ("--mesh", "--solver"))
    assert main([*command, "--solver", "abaqus"]) == 2


MATERIAL = Isotropic(3.0, 0.4)
SHEAR, BULK = 3.0 / 2.8, 3.0 / 0.6
STRETCHES = np.array([1.3, 0.9, 1.0 / (1.3 * 0.9)])  # isochoric


def constants(cards: tuple[str, ...]) -> list[float]:
    return [float(number) for line in cards[1:] for number in line.split(",")]


def test_linear_elasticity() -> None:
    assert law_cards(MATERIAL, None) == ("*ELASTIC", "3, 0.4")
    assert "nu = 0.5" in refused(lambda: law_cards(Isotropic(1.0, 0.5), None))


LAWS = {
    "NEO HOOKE": NeoHooke(1.0),
    "MOONEY-RIVLIN": MooneyRivlin(1.0, 0.3),
    "YEOH": Yeoh(1.0, 0.2, 0.1),
    "OGDEN, N=1": Ogden(1.0, ((1.0, 3.0),)),
    "OGDEN, N=2": Ogden(1.0, ((0.7, 2.0), (0.3, -3.0))),
    "OGDEN, N=3": Ogden(1.0, ((0.5, 2.0), (0.3, -3.0), (0.2, 4.0))),
}


@pytest.mark.parametrize("name", LAWS)
def test_energies_of_the_manual_are_those_of_the_laws(name: str) -> None:
    """CalculiX CrunchiX user's manual 2.20, *HYPERELASTIC."""
    law, j = LAWS[name], 1.2
    cards = law_cards(MATERIAL, law)
    assert cards[0] == f"*HYPERELASTIC, {name}"
    c = constants(cards)
    i1, i2 = (STRETCHES**2).sum(), (STRETCHES**-2.0).sum()
    match re.split(r"[ ,-]", name)[0]:
        case "NEO":
            energy, d = c[0] * (i1 - 3.0), c[1:]
        case "MOONEY":
            energy, d = c[0] * (i1 - 3.0) + c[1] * (i2 - 3.0), c[2:]
        case "YEOH":
            energy, d = sum(c[k] * (i1 - 3.0) ** (k + 1) for k in range(3)), c[3:]
            assert len(d) == 3
        case _:
            n = len(law.terms)
            pairs = zip(c[0 : 2 * n : 2], c[1 : 2 * n : 2], strict=True)
            energy, d = sum(2.0 * mu / a**2 * ((STRETCHES**a).sum() - 3.0) for mu, a in pairs), c[2 * n :]
            assert len(d) == n
    wanted = float(energy_of(law.with_shear(SHEAR), np.diag(STRETCHES)[None])[0])
    assert energy == pytest.approx(wanted, rel=1e-9)
    volumetric = sum((j - 1.0) ** (2 * k) / each for k, each in enumerate(d, 1))
    assert volumetric == pytest.approx(0.5 * BULK * (j - 1.0) ** 2, rel=1e-9)


@pytest.mark.skipif(program() is None, reason="ccx, CalculiX's solver, is not installed")
@pytest.mark.parametrize("name", LAWS)
def test_calculix_finds_the_stress_of_the_law(name: str, tmp_path: Path) -> None:
    """A cube whose corners are all prescribed: the forces of a face are the nominal stress on it."""
    law, f = LAWS[name], np.array([[1.25, 0.1, 0.0], [0.0, 0.9, 0.05], [0.0, 0.0, 0.92]])
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
    moved = corners @ (f - np.eye(3)).T
    deck = [
        *("*NODE", *(f"{n}, {x}, {y}, {z}" for n, (x, y, z) in enumerate(corners, 1))),
        *("*ELEMENT, TYPE=C3D8, ELSET=CUBE", "1, 1, 2, 3, 4, 5, 6, 7, 8", f"*NSET, NSET={OBJECT}", "2, 3, 6, 7"),
        *("*MATERIAL, NAME=GEL", *law_cards(MATERIAL, law), "*SOLID SECTION, ELSET=CUBE, MATERIAL=GEL"),
        *("*STEP, NLGEOM", "*STATIC", "0.1, 1.0", "*BOUNDARY"),
        *(f"{n}, {axis}, {axis}, {u:.14g}" for n, row in enumerate(moved, 1) for axis, u in enumerate(row, 1)),
        *(f"*NODE PRINT, NSET={OBJECT}, TOTALS=ONLY", "RF", "*END STEP", ""),
    ]
    path = tmp_path / "cube.inp"
    path.write_text("\n".join(deck), encoding="ascii")
    solve(path, 60.0)
    material = Hyperelastic(law.with_shear(SHEAR), BULK, mixed=False)
    nominal = material.stress(f[None], None)[0, :, 0]
    assert np.abs(printed_forces(path.with_suffix(".dat"))[1][-1] - nominal).max() < 1e-6 * BULK


def test_too_many_terms_are_refused() -> None:
    law = Ogden(1.0, ((0.25, 2.0), (0.25, 3.0), (0.25, 4.0), (0.25, -2.0)))
    line = refused(lambda: law_cards(MATERIAL, law))
    assert "effects.large_deformation.terms" in line
    assert re.search(r"\b3 terms\b.* 4$", line)


PLATE = ObjectElements(
    np.array([[x, y, z] for y in (4.0, 5.0) for z, x in ((-9, -9), (9, -9), (9, 9), (-9, 9))]),
    "C3D8",
    np.arange(8)[None],
)
LINEAR = ("*ELASTIC", "1, 0.3")


def deck(**options: object) -> Deck:
    """A cube under a plate."""
    steps = (DeckStep(np.array([0.0, -1.0, 0.0]), 4), DeckStep(np.tile([0.5, -1.0, 0.0], (8, 1)), 1))
    made = Deck(quadratic(cube()), (LINEAR,), PLATE, steps, Contact(200.0, 80.0, 0.25), remarks=("a cube",))
    return replace(made, **options)  # type: ignore[arg-type]


def block(lines: list[str], card: str) -> list[str]:
    """The lines after a card, up to the next one."""
    first = lines.index(card) + 1
    return lines[first : next(i for i in range(first, len(lines)) if lines[i].startswith("*"))]


def test_a_deck_holds_the_mesh_the_object_and_the_path() -> None:
    made = deck()
    mesh, lines = made.mesh, made.text().splitlines()
    assert lines[0] == "** a cube"
    nodes = np.array([line.split(",") for line in block(lines, "*NODE, NSET=NALL")], dtype=float)
    np.testing.assert_allclose(nodes[:, 1:], mesh.points, rtol=1e-11)
    cells = np.array([line.split(",") for line in block(lines, "*ELEMENT, TYPE=C3D10, ELSET=BODY0")], dtype=int)
    np.testing.assert_array_equal(cells[:, 1:] - 1, mesh.cells)
    assert len(block(lines, "*SURFACE, NAME=FINGER, TYPE=ELEMENT")) == len(mesh.facets["contact"])
    held = {int(line.split(",")[0]) - 1 for line in block(lines, "*BOUNDARY")}
    assert held == set(np.unique(mesh.facets["base"]).tolist())
    steps = [i for i, line in enumerate(lines) if line.startswith("*STEP")]
    assert len(steps) == 2
    assert not any("NLGEOM" in lines[i] for i in steps)
    first, second = (block(lines[i:], "*BOUNDARY") for i in steps)
    assert first == ["NOBJECT, 1, 1, 0", "NOBJECT, 2, 2, -1", "NOBJECT, 3, 3, 0"]
    assert len(second) == 8 * 3
    assert second[0] == f"{len(mesh.points) + 1}, 1, 1, 0.5"
    assert block(lines[steps[0] :], "*STATIC") == ["0.25, 1., 1e-5, 0.25"]
    assert block(lines, "*FRICTION") == ["0.25, 80"]


def test_faces_have_the_numbers_of_calculix() -> None:
    """S1 to S4 of C3D10 are the nodes 1-2-3, 1-4-2, 2-4-3, 3-4-1 (CalculiX user's manual 2.20, sec. 6.2.5)."""
    mesh = cube(1)
    corners = {1: {0, 1, 2}, 2: {0, 3, 1}, 3: {1, 3, 2}, 4: {2, 3, 0}}
    facets = {frozenset(f) for f in mesh.facets["contact"].tolist()}
    found = [line.split(", S") for line in facet_lines(mesh, ("contact", "ends"))]
    assert {frozenset(mesh.cells[int(e) - 1][list(corners[int(k)])].tolist()) for e, k in found} == facets
    assert len(FACETS[3]) == len(corners)


LOW, HIGH = np.array([-10.0, 0.0, -4.0]), np.array([10.0, 8.0, 4.0])
SAGITTA = 2e-3
POSES = (ObjectPose(0.0), ObjectPose(1.0), ObjectPose(1.0, slide_x_mm=0.5, turn_z=0.2))
OBJECTS = [
    Plane(tilt=0.1),
    Cylinder(radius_mm=6.0),
    Cylinder(radius_mm=6.0, axis="x", x_mm=1.0),
    Sphere(radius_mm=6.0, z_mm=1.0),
    Wedge(angle=0.4, tip_radius_mm=1.0),
    Wedge(angle=0.4),
    Wave(wavelength_mm=5.0, amplitude_mm=0.5),
    MeshObject(surface=box(4.0, 4.0, 4.0)),
]


def placed(obj: RigidObject) -> list[PlacedObject]:
    return [PlacedObject.of(obj, 8.0, pose) for pose in POSES]


@pytest.mark.parametrize("obj", OBJECTS, ids=lambda o: type(o).__name__)
def test_facets_lie_on_the_surface_and_elements_behind_it(obj: RigidObject) -> None:
    poses = placed(obj)
    made, motion = object_elements(poses, LOW - 2.0, HIGH + 2.0, SAGITTA, 3)
    width = 3 if made.kind == "C3D4" else 4
    corners = made.nodes[made.elements]
    face = corners[:, :width]
    exact = isinstance(obj, MeshObject)  # whose triangles are the surface
    np.testing.assert_allclose(poses[0].distance(face.reshape(-1, 3))[0], 0.0, atol=1e-9)
    away = np.abs(poses[0].distance(face.mean(axis=1))[0]).max()
    assert away <= (1e-9 if exact else 1.01 * SAGITTA)
    normal = np.cross(face[:, 1] - face[:, 0], face[:, -1] - face[:, 0])
    behind = corners[:, width:].mean(axis=1) - face.mean(axis=1)
    assert (np.einsum("ij,ij->i", normal, behind) > 0.0).all()  # the order that makes the volume positive
    assert (poses[0].distance(face.mean(axis=1) + 0.05 * behind)[0] < 0.0).all()
    for pose, moved in zip(poses, motion, strict=True):
        np.testing.assert_allclose(pose.to_own(made.nodes + moved), poses[0].to_own(made.nodes), atol=1e-9)


@pytest.mark.parametrize("obj", OBJECTS[1:6:2], ids=lambda o: type(o).__name__)
def test_segments_of_a_section(obj: RigidObject) -> None:
    pose = PlacedObject.of(obj, 8.0)
    made, _ = object_elements([pose], LOW - 2.0, HIGH + 2.0, SAGITTA, 2)
    assert made.kind == "CPE4"
    a, b, c, d = np.moveaxis(made.nodes[made.elements][..., :2], 1, 0)
    for p, q, r in ((a, b, c), (b, c, d), (c, d, a)):
        assert ((q - p)[:, 0] * (r - p)[:, 1] - (q - p)[:, 1] * (r - p)[:, 0] > 0.0).all()
    if isinstance(obj, Cylinder | Sphere) and getattr(obj, "axis", "z") == "z":
        np.testing.assert_allclose(np.linalg.norm(a - [obj.x_mm, 14.0], axis=1), 6.0, rtol=1e-9)


def test_facets_far_from_the_finger_are_left_out() -> None:
    many = MeshObject(surface=ball(300.0, 80, 160))
    made, _ = object_elements([PlacedObject.of(many, 8.0)], LOW - 2.0, HIGH + 2.0, SAGITTA, 3)
    assert 0 < len(made.elements) < 0.1 * len(many.triangles.faces)
    assert "model.domain" in refused(lambda: object_elements([PlacedObject.of(many, 8.0)], LOW, HIGH, SAGITTA, 2))
    fine = MeshObject(surface=ball(5.0, 75, 150))
    line = refused(lambda: object_elements([PlacedObject.of(fine, 8.0)], LOW - 99.0, HIGH + 99.0, SAGITTA, 3))
    assert f" {len(fine.triangles.faces)} facets " in line
    assert f" {MOST_FACETS}: " in line


SCENE: dict[str, Any] = {
    "title": "Würfel",
    "finger": {"geometry": "block", "half_length_mm": 10.0, "height_mm": 8.0, "width_mm": 6.0},
    "material": {"E_MPa": 2.0, "nu": 0.4},
    "friction": {"mu": 0.25},
    "press": {"depth_mm": 1.0, "steps": 4},
    "mesh": {"size_mm": 3.0, "base_size_mm": 4.0, "mesher": "swept"},
}


def scene(**tables: Any):
    return parse(SCENE | tables)


def test_the_deck_of_a_symmetric_press_is_a_quarter() -> None:
    made = press_deck(scene().model(), "Würfel")
    assert made.multiple == 4.0
    assert made.axes == ("x", "z")
    assert made.notes == ()
    assert [step.increments for step in made.steps] == [4]
    np.testing.assert_allclose(made.steps[0].motion, [0.0, -1.0, 0.0], atol=1e-12)
    assert made.contact.penalty == pytest.approx(200.0 * 2.0 / 1.0)
    assert made.object.nodes[:, 1].min() == pytest.approx(8.0)
    text = made.text()
    assert text.isascii()
    assert " 4 times " in text
    assert "2, 0.4" in text


def test_every_leg_is_a_step_and_every_increment_of_one_that_turns() -> None:
    legs = [
        {"depth_mm": 1.0, "steps": 4},
        {"depth_mm": 1.0, "slide_x_mm": 0.5, "steps": 3},
        {"depth_mm": 1.0, "slide_x_mm": 0.5, "turn_y_deg": 5.0, "steps": 2},
        {"depth_mm": 0.5, "slide_x_mm": 0.5, "turn_y_deg": 5.0},
    ]
    made = press_deck(scene(press={"leg": legs}).model())
    assert [step.increments for step in made.steps] == [4, 3, 1, 1, 10]
    assert [step.motion.ndim for step in made.steps] == [1, 1, 2, 2, 2]
    np.testing.assert_allclose(made.steps[1].motion, [0.5, -1.0, 0.0], atol=1e-12)
    assert made.multiple == 1.0
    (remark,) = made.notes
    assert remark.startswith('steps = "auto": 10 increments ')


def test_a_section_has_its_thickness() -> None:
    strain, stress = (press_deck(scene(model={"domain": f"plane-{kind}"}).model()) for kind in ("strain", "stress"))
    assert (strain.multiple, strain.thickness_mm) == (2.0, 6.0)
    # a thin slice of a section in plane stress
    assert stress.thickness_mm < 0.01
    assert stress.multiple * stress.thickness_mm == pytest.approx(2.0 * 6.0)
    assert "CPS6" in stress.text()
    assert "CPE6" in strain.text()


@pytest.mark.parametrize(
    ("tables", "told"),
    [
        (
            {"effects": {"viscosity": {"prony": [[0.3, 0.5]]}}, "press": {"depth_mm": 1.0, "duration_s": 1.0}},
            "[effects.viscosity]",
        ),
        ({"effects": {"kinetic_friction": {"ratio": 0.7}}}, "[effects.kinetic_friction]"),
        ({"effects": {"elastic_object": {"E_MPa": 10.0, "nu": 0.4}}}, "[effects.elastic_object]"),
        (
            {
                "effects": {"embedded_gauge": {"E_MPa": 3000.0, "thickness_mm": 0.02, "width_mm": 3.0}},
                "gauge": [{"name": "g", "x_mm": 0.0, "y_mm": 4.0, "length_mm": 2.0}],
            },
            "[effects.embedded_gauge]",
        ),
        ({"press": {"force_N": 2.0}}, "force_N: "),
        ({"material": {"E_MPa": 1.0, "nu": 0.5}}, " nu = 0.5"),
        ({"model": {"domain": "plane-stress"}, "effects": {"large_deformation": {}}}, "[effects.large_deformation]"),
    ],
)  # fmt: skip
def test_what_calculix_lacks_is_refused_by_name(tables: dict[str, Any], told: str) -> None:
    line = refused(lambda: press_deck(scene(**tables).model()))
    assert line.startswith("--solver calculix: ")
    assert told in line


def test_nearly_incompressible_materials_are_told() -> None:
    made = press_deck(scene(material={"E_MPa": 1.0, "nu": 0.49}).model())
    (remark,) = made.notes
    assert remark.startswith("nu ")
    assert "C3D10" in remark
