"""Construction of a Scene from a file or a tree of tables, and of a Model from a Scene."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from finger3d._ranges import printable
from finger3d._types import Tree, TreeView
from finger3d.contact.friction import Coulomb
from finger3d.effects import LARGE_DEFORMATION
from finger3d.errors import Finger3dError
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.design import Design, designs
from finger3d.materials.modulus import ElasticConstants
from finger3d.mechanics.model import Domain, Leg, MeshOptions, Model, first_contact
from finger3d.mechanics.readings import Gauge, Marker, Taxel
from finger3d.objects import OBJECTS, RigidObject
from finger3d.scene import checks, material, messages, tree
from finger3d.scene.checked_tables import checked, design_of, effects_of, named, object_of, press_of, shaped
from finger3d.scene.material import parts_of, path_of
from finger3d.scene.mesh_sizes import mesh_options
from finger3d.scene.messages import Place
from finger3d.scene.tables import LegsTable, LegTable, SceneTable, record_of

_AUTO_TOLERANCE = 0.02
"""Default relative change of a number above which an effect is needed."""


@dataclass(frozen=True, repr=False)
class Scene:
    """A checked scene. Two scenes are equal if they are the same with all defaults.

    Attributes
    ----------
    tables : the file's tables with every default filled in; angles in degrees, as in the file
    design : the finger, a frozen dataclass from geometries/
    object : the rigid object
    mesh : edge lengths and mesher
    effects : name -> settings of the effects that are on, or that are on where they are needed
    auto : whether effects are on only where they are needed: True: all; None: large deformation unless it is named;
        False: none
    tolerance_of_effects : change of a number, over its natural scale, above which an effect is needed
    given : what the user wrote, overrides included
    path : the file, or None
    """

    tables: SceneTable
    design: Design = field(compare=False)
    object: RigidObject = field(compare=False)
    mesh: MeshOptions = field(compare=False)
    effects: TreeView = field(compare=False)
    auto: bool | None
    tolerance_of_effects: float
    given: TreeView = field(compare=False)
    path: Path | None = field(compare=False, default=None)

    @property
    def title(self) -> str:
        """The title, or the file's name."""
        return self.tables.title or (printable(self.path.stem) if self.path else "scene")

    def __repr__(self) -> str:
        """One line: title, body, domain, effects."""
        effects = f", {', '.join(self.effects)}" if self.effects else ""
        return f"<Scene {self.title}: {self.design}, {self.domain}{effects}>"

    def _repr_html_(self) -> str:
        """Return the tables with all defaults, as HTML."""
        from finger3d._notebook import card

        rows = [
            (name, ", ".join(f"{k} = {v}" for k, v in settings.items()) if isinstance(settings, Mapping) else "")
            for name, settings in self.as_dict().items()
            if name not in ("title", "gauge", "marker", "taxel", "effects") and settings is not None
        ]
        named = [(f"{kind} {g['name']}", g) for kind in ("gauge", "marker", "taxel") for g in self.as_dict()[kind]]
        effects = self.as_dict()["effects"].items()
        named += [(f"effect {name}", settings) for name, settings in effects if isinstance(settings, Mapping)]
        rows += [(name, ", ".join(f"{k} = {v}" for k, v in given.items() if k != "name")) for name, given in named]
        return card(self.title, self.domain, rows)

    @property
    def open_effects(self) -> tuple[str, ...]:
        """Names of the effects that a press uses only if the scene calls for them; see `effects_by_need.settled`."""
        if self.auto is False:
            return ()
        named = tuple(self.effects)
        is_off = self.given.get("effects", {}).get(LARGE_DEFORMATION) is False
        judged = () if LARGE_DEFORMATION in named or is_off else (LARGE_DEFORMATION,)
        return (*named, *judged) if self.auto else judged

    @property
    def fixed_effects(self) -> tuple[str, ...]:
        """Names of the effects that are on in any case."""
        return tuple(name for name in self.effects if name not in self.open_effects)

    @property
    def domain(self) -> Domain:
        """solid, plane-strain or plane-stress."""
        return self.tables.model.domain

    @property
    def legs(self) -> tuple[Leg, ...]:
        """Targets of the press; the shorthand is one leg."""
        press = self.tables.press
        return path_of(press.get("leg", (press,)), self.design, self.object, self.tables)

    @property
    def constants(self) -> ElasticConstants:
        """Elastic constants of the finger, with the spread and the origin of Young's modulus."""
        return self.tables.material.constants

    def check_numbers(self, of: Iterable[str], *others: str) -> tuple[str, ...]:
        """Return the names of the numbers of its press that have error bars.

        Raises
        ------
        Finger3dError
            If one of those asked for is neither among them nor among `others`.
        """
        under_force = self.legs[-1].force_N is not None
        names = checks.headline_numbers(self.tables, self.domain == "solid", under_force)
        if unknown := [name for name in of if name not in (*names, *others)]:
            raise Finger3dError(checks.no_such_number("of", unknown[0], (*names, *others)))
        return tuple(names)

    def with_mesh(self, mesh: MeshOptions) -> Scene:
        """Return the scene with edge lengths in place of a tolerance."""
        return parse({**self.given, "mesh": mesh.as_table()}, self.path)

    def with_effects(self, names: Iterable[str]) -> Scene:
        """Return the scene with some effects on, with its own settings of each or else the default ones."""
        given = self.given.get("effects", {})
        chosen = {name: given.get(name) or {} for name in names}
        return parse({**self.given, "effects": {"auto": False, **chosen}}, self.path)

    def model(self) -> Model:
        """Return the model: the baseline, and then every effect that the scene names. Angles are in radians.

        Raises
        ------
        Finger3dError
            If it is still open which of them are on.
        """
        if self.auto:
            raise Finger3dError(
                "effects.auto = true: a press finds which effects this scene calls for; take the scene.toml that "
                "finger3d press writes"
            )
        return self._model

    @cached_property
    def _model(self) -> Model:
        t = self.tables
        model = Model(
            design=self.design,
            material=Isotropic(self.constants.E_MPa, self.constants.nu),
            mesh=self.mesh,
            legs=self.legs,
            object=self.object,
            friction=Coulomb(t.friction.mu),
            gauges=tuple(record_of(Gauge, gauge) for gauge in t.gauge),
            markers=tuple(record_of(Marker, marker) for marker in t.marker),
            taxels=tuple(record_of(Taxel, taxel) for taxel in t.taxel),
            domain=t.model.domain,
            centre_of_mass_mm=t.grip.centre_mm if t.grip else None,
            rule=t.contact.rule,
            parts=parts_of(t),
            warnings=checks.unusual(self.given, self.constants.E_MPa, self.design.height_mm),
        )
        for name in sorted(self.effects):
            model = self.effects[name].apply(model)
        return model

    def as_dict(self) -> Tree:
        """Return the tables with every default filled in, as plain dicts and lists, and Young's modulus in any case."""
        t = self.tables
        parts = {label: material.with_modulus(part) for label, part in t.parts.items()}
        return tree.plain(t.model_dump() | {"material": material.with_modulus(t.material), "parts": parts})

    def to_toml(self, defaults: bool = True) -> str:
        """Return TOML text that loads as this scene: with every default, or just what was given."""
        tables = {name: table for name, table in self.tables.model_dump().items() if name != "press" or table}
        return tree.written(tables if defaults else self.given)


def parse(given: TreeView, path: Path | None = None, set_keys: Iterable[str] | Mapping[str, str] = ()) -> Scene:
    """Check a tree of tables (lists or tuples for arrays) and return it as a Scene.

    Parameters
    ----------
    path : the file it came from, for messages
    set_keys : keys that came from the command line, for messages; with the option that gave them if not ``--set``
    """
    given = tree.frozen(tree.absolute(given, path))
    mistakes: dict[Place, str] = {}
    tables = checked(SceneTable, given, (), mistakes)
    mistakes |= material.mistakes(tables.material, ("material",)) if tables else {}
    geometry, dimensions = named(given, "finger", "geometry", designs(), mistakes)
    design = design_of(geometry, dimensions, mistakes)
    shape, placed = named({**given, "object": shaped(given.get("object", {}))}, "object", "shape", OBJECTS, mistakes)
    rigid = object_of(shape, placed, mistakes)
    press = press_of(given, mistakes)
    settings, effects, auto = effects_of(given, mistakes)
    if mistakes or not (tables and dimensions and design and placed and rigid and press and auto):
        order = [*given]
        places = sorted(mistakes, key=lambda p: order.index(p[0]) if p[0] in order else len(order))
        raise messages.refusal([mistakes[p] for p in places], path, set_keys)
    legs = press.leg if isinstance(press, LegsTable) else (press,)
    lines = checks.check(tables, legs, design)
    if lines := [*lines, *checks.unit_mistakes(design, rigid)]:
        raise messages.refusal(lines, path, set_keys)
    tolerance = auto.auto_tolerance or tables.mesh.tolerance or _AUTO_TOLERANCE
    try:
        mesh = _mesh(tables, legs, design, rigid, settings)
        filled = tables.model_copy(
            update={
                "finger": {"geometry": geometry, **dimensions.model_dump()},
                "material": material.filled_in(tables.material),
                "parts": {label: material.filled_in(part) for label, part in tables.parts.items()},
                "object": {"shape": shape, **dict(placed)},
                "press": {} if tables.grip else press.model_dump(),
                # with a tolerance the press finds the sizes
                "mesh": tables.mesh if tables.mesh.tolerance else tables.mesh.model_copy(update=mesh.as_table()),
                "effects": auto.model_dump(exclude_none=True)
                | ({"auto_tolerance": tolerance} if auto.auto else {})
                | {name: table.model_dump() for name, table in settings.items()},
            }
        )
        scene = Scene(filled, design, rigid, mesh, effects, auto.auto, tolerance, given, path)
        _ = scene._model  # effects may refuse what the rest of the scene asks for
    except Finger3dError as error:
        raise messages.refusal([str(error)], path, set_keys) from None
    return scene


def _mesh(
    tables: SceneTable, legs: Sequence[LegTable], design: Design, obj: RigidObject, effects: Iterable[str]
) -> MeshOptions:
    """Return the edge lengths, given or chosen.

    Raises
    ------
    Finger3dError
        If the contact conditions cannot describe the object's motion into the finger.
    """
    domain = tables.model.domain
    path = path_of([dict(leg) for leg in legs], design, obj, tables)
    box = first_contact(design, obj, path, domain).contact_box
    linear = not set(effects) - {"kinetic_friction"}
    # where increments factor the stiffness, or a companion mesh gives the error bars, a first press costs as much
    quick = linear and tables.friction.mu > 0.0 and not any(leg.is_under_force for leg in path)
    return mesh_options(tables.mesh, design, domain, obj, box, quick)


Source = Scene | TreeView | str | Path
"""A scene: loaded, as the tables of a scene file, or the path of the file."""


def load(path: str | Path, overrides: Iterable[str] = ()) -> Scene:
    """Read and check a scene file.

    Parameters
    ----------
    path : TOML file
    overrides : texts such as ``friction.mu=0.5``, applied before anything is checked

    Raises
    ------
    Finger3dError
        With one line that names the file, the key, the value and what is allowed.
    """
    return scene_of(Path(path), overrides)


def scene_of(source: Source, overrides: Iterable[str] = ()) -> Scene:
    """Return the scene that an argument stands for, with values of other keys as for ``--set``.

    Raises
    ------
    Finger3dError
        If it has a mistake, or is no scene.
    """
    overrides = list(overrides)
    if isinstance(source, Scene) and not overrides:
        return source
    document, path = tables_of(source)
    changed, keys = tree.overridden(document, overrides)
    return parse(changed, path, keys)


def tables_of(source: Source, overrides: Sequence[str] = ()) -> tuple[TreeView, Path | None]:
    """Return the tables of a scene, with values of other keys as for ``--set``, and the path of its file if it has one.

    Raises
    ------
    Finger3dError
        If the file cannot be read, a key cannot be set, or the argument is no scene.
    """
    if isinstance(source, Scene):
        document, path = source.given, source.path
    elif isinstance(source, Mapping):
        document, path = tree.frozen(source), None
    elif isinstance(source, str | Path):
        path = Path(source)
        document = tree.read(path)
    else:
        raise Finger3dError(
            f"a {type(source).__name__} is no scene: give the path of a scene file, a dict with its tables, or what "
            "finger3d.load returns (a Model is solved by build and march of finger3d.mechanics)"
        )
    return tree.override(document, overrides), path
