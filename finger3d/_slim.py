"""Files of the MKL and OpenMP wheels that PARDISO does without: python -m finger3d._slim removes them.

PARDISO needs libmkl_rt, the interface lp64, the threads of Intel's OpenMP, the core and the kernels of the processor at
hand. Interfaces for 64-bit indices, other threads, clusters and offloading to a GPU come in the same wheels, which pip
can only install whole, and are never loaded; vector mathematics and the allocator of TBB are loaded where they are
found, and never called. A child process solves without the files before they are removed. No other package of finger3d
loads MKL. Where another one in the same environment does, leave the files alone; `pip install --force-reinstall mkl
intel-openmp` brings them back.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from importlib import metadata
from pathlib import Path

_NOT_NEEDED = (
    "libmkl_*_ilp64.so*", "libmkl_gnu_thread.so*", "libmkl_tbb_thread.so*", "libmkl_sequential.so*", "libmkl_vml_*.so*",
    "libmkl_blacs_*.so*", "libmkl_scalapack_*.so*", "libmkl_cdft_core.so*", "libomptarget*", "libompstubs5.*",
    "libarcher*", "libiomp5.a", "libiomp5.dbg", "libiomp5_db.so", "libur_*.so*", "libumf.so*", "libtcm*.so*",
    "libtbb*.so*",
)  # fmt: skip
_WHEELS = ("mkl", "intel-openmp", "intel-cmplr-lib-ur", "umf", "tcmlib", "tbb")


def unused(prefix: Path) -> Iterator[Path]:
    """Yield the files in the environment `prefix` that these wheels installed and PARDISO does without; Linux only."""
    for name in _WHEELS:
        try:
            files = metadata.distribution(name).files or []
        except metadata.PackageNotFoundError:
            continue
        for file in files:
            path = Path(str(file.locate())).resolve()
            if path.parent == (prefix / "lib").resolve() and any(map(path.match, _NOT_NEEDED)) and path.is_file():
                yield path


def environment_bytes(prefix: Path) -> int:
    """Return the bytes on disk of all files in an environment; a file with several names counts once."""
    found: dict[tuple[int, int], int] = {}
    for path in prefix.rglob("*"):
        if path.is_file() and not path.is_symlink():
            status = path.stat()
            found[status.st_dev, status.st_ino] = getattr(status, "st_blocks", -(-status.st_size // 512)) * 512
    return sum(found.values())


_PROBE = """
import numpy as np, scipy.sparse as sp
from finger3d.fem.pardiso import PardisoFactor
full = sp.diags_array([-1.0, 2.5, -1.0], offsets=[-1, 0, 1], shape=(4000, 4000)).tocsr()
factor, load = PardisoFactor(sp.csr_matrix(sp.triu(full)), 4), np.ones((3996, 2))
found = factor.substituted(factor.eliminated(load)[0], np.zeros((4, 2)))
assert np.abs(full[:3996, :3996] @ found - load).max() < 1e-12
"""


def remove(paths: Sequence[Path], aside: Path, probe: Sequence[str]) -> bool:
    """Remove files if a program succeeds without them; else leave all as they are.

    Parameters
    ----------
    paths : the files
    aside : an empty folder of the same file system, where they are while the program runs
    probe : the program and its arguments
    """
    moved = [(path, aside / f"{number}") for number, path in enumerate(paths)]
    for path, place in moved:
        path.replace(place)
    done = subprocess.run(probe, capture_output=True, check=False)
    for path, place in moved:
        if done.returncode == 0:
            place.unlink()
        else:
            place.replace(path)
    return done.returncode == 0


def main() -> None:
    """Remove the files if PARDISO solves without them, and print how much they took."""
    prefix = Path(sys.prefix)
    if sys.prefix == sys.base_prefix:
        sys.exit("this Python is no virtual environment; nothing was removed")
    paths = list(unused(prefix))
    if not paths:
        return
    size = sum(path.stat().st_size for path in paths)
    with tempfile.TemporaryDirectory(dir=prefix) as folder:
        removed = remove(paths, Path(folder), [sys.executable, "-c", _PROBE])
    if removed:
        print(f"{size / 1e6:.0f} MB of MKL that PARDISO does without were removed from {prefix}")
    else:
        print(f"PARDISO does not solve without {size / 1e6:.0f} MB of MKL on this machine; nothing was removed")


if __name__ == "__main__":
    main()
