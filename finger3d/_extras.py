"""Optional packages: which extra of finger3d brings each, and one line for a user who lacks one."""

from __future__ import annotations

import json
import sys
from importlib.metadata import PackageNotFoundError, distribution
from importlib.util import find_spec
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import url2pathname

from finger3d.errors import MissingError

EXTRAS = {
    "pypardiso": "mkl",
    "casadi": "mumps",
    "cffi": "mumps",
    "build123d": "cad",
    "OCP": "cad",
    "ocp_gordon": "cad",
    "lib3mf": "cad",
    "manifold3d": "cad",
    "pytetwild": "cad",
    "pyvista": "view",
    "vtk": "view",
    "vtkmodules": "view",
    "distributed": "cluster",
    "dask": "cluster",
    "netgen": "netgen",
    "dash": "app",
    "h5py": "labels",
    "pandas": "table",
    "pyarrow": "table",
}
"""The name of an optional module -> the extra of finger3d that brings it."""


def available(*modules: str) -> bool:
    """Whether modules are installed; they are not imported."""
    return all(find_spec(module) is not None for module in modules)


def require(what: str, *modules: str, instead: str = "") -> None:
    """Check that optional modules are installed.

    Parameters
    ----------
    what : what needs them, the subject of the message
    modules : names of modules, of `EXTRAS`
    instead : what a user may do without them

    Raises
    ------
    MissingError
        If one is not installed.
    """
    for module in modules:
        if not available(module):
            raise MissingError(message(what, module, instead))


def message(what: str, module: str, instead: str = "") -> str:
    """Return the line about a module that is not installed."""
    text = f"{what} needs {module}: {install(EXTRAS[module])}"
    return f"{text}, or {instead}" if instead else text


def install(extra: str) -> str:
    """Return the command that adds an extra where this package is installed: no index has finger3d by its name.

    It names this Python, whose pip need not be the first on the path, and the folder that finger3d came from.
    """
    source, editable = Path(__file__).resolve().parent.parent, "--editable "
    if not (source / "pyproject.toml").is_file():
        source, editable = _installed_from(), ""
    return f'{sys.executable} -m pip install {editable}"{source}[{extra}]"'


def _installed_from() -> Path:
    """Return the folder or wheel that pip has installed this package from, as PEP 610 records it."""
    try:
        text = distribution("finger3d").read_text("direct_url.json")
    except PackageNotFoundError:
        text = None
    return Path(url2pathname(urlsplit(json.loads(text)["url"]).path)) if text else Path("finger3d")


def absent(error: ImportError) -> str | None:
    """Return the optional module that an import did not find, or None if the error has another reason."""
    root = (error.name or "").split(".")[0] if isinstance(error, ModuleNotFoundError) else ""
    return root if root in EXTRAS and not available(root) else None
