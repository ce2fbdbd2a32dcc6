"""Optional packages: which extra of finger3d brings each, and one line for a user who lacks one."""

from __future__ import annotations

from importlib.util import find_spec

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
    text = f'{what} needs {module}: pip install "finger3d[{EXTRAS[module]}]"'
    return f"{text}, or {instead}" if instead else text


def absent(error: ImportError) -> str | None:
    """Return the optional module that an import did not find, or None if the error has another reason."""
    root = (error.name or "").split(".")[0] if isinstance(error, ModuleNotFoundError) else ""
    return root if root in EXTRAS and not available(root) else None
