"""Scenes: a TOML file, strictly checked, turned into a model, and written back with its defaults filled in."""

from finger3d.scene.scene import Scene, Source, load, parse, scene_of, tables_of

__all__ = [
    "Scene",
    "Source",
    "load",
    "parse",
    "scene_of",
    "tables_of",
]
