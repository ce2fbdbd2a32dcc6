"""MUMPS: one symmetric indefinite factorisation with a Schur complement, where there is no MKL.

The library is the sequential MUMPS (CeCILL-C) that CasADi's wheels bring for Linux, macOS and Windows, on x86-64 and
ARM.  PARDISO comes first where both are installed: with 140 000 unknowns MUMPS takes 1.7 times its time and 1.25 times
its memory (docs/install.md).  Python's bindings of MUMPS have no wheels, so it is called through cffi, which reads the
structure of its arguments from the header beside the library.
"""

from __future__ import annotations

import functools
import os
import re
import sys
import threading
import weakref
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from finger3d._types import Array, Float
from finger3d.errors import MissingError
from finger3d.fem.solvers.factors import WholeSolutions

_SYMMETRIC, _HOST_WORKS, _NO_MPI = 2, 1, -987654
_START, _END, _ANALYSE, _FACTORIZE, _SOLVE = -1, -2, 1, 2, 3  # values of job
_METIS, _WHOLE_SCHUR = 5, 1
_LIBRARIES = {"win32": "libcoinmumps-3.dll", "darwin": "libcoinmumps.3.dylib"}
_TOO_SMALL = (-8, -9, -14, -15, -17, -20)  # values of infog(1) that more workspace cures
_NO_MEMORY = (-7, -13, -19, -22)
_SMALLEST_PIVOT = 1e-13  # of a matrix that MUMPS has scaled to entries of order 1
_SPACES = 35, 100, 300, 1000  # icntl(14): workspace beyond the prediction of the analysis, %
_AT_ONCE = 64  # right-hand sides
_LOCK = threading.Lock()  # MUMPS keeps data in global variables


@functools.cache
def library() -> tuple[Any, Any]:
    """Return cffi's description of MUMPS's header, and the library."""
    spec = find_spec("casadi")
    if spec is None or spec.origin is None:
        raise ModuleNotFoundError("casadi is not installed", name="casadi")
    from cffi import FFI

    folder = Path(spec.origin).parent
    header = (folder / "include" / "coin-or" / "mumps" / "dmumps_c.h").read_text()
    ffi = FFI()
    ffi.cdef(_declarations(header))
    if sys.platform == "win32":
        os.add_dll_directory(str(folder))
    return ffi, ffi.dlopen(str(folder / _LIBRARIES.get(sys.platform, "libcoinmumps.so.3")))


def _declarations(header: str) -> str:
    """Return the declarations of a header dmumps_c.h without comments and macros, which cffi cannot read."""
    length = re.search(r"#define MUMPS_VERSION_MAX_LEN (\d+)", header)
    structure = re.search(r"typedef struct \{.*?\} DMUMPS_STRUC_C;", header, re.DOTALL)
    if length is None or structure is None:
        raise ImportError("the header dmumps_c.h in CasADi's wheel has another form than MUMPS 5")
    plain = re.sub(r"/\*.*?\*/", "", structure[0], flags=re.DOTALL)
    plain = plain.replace("MUMPS_VERSION_MAX_LEN", length[1])
    return (
        "typedef int MUMPS_INT; typedef int64_t MUMPS_INT8; typedef double DMUMPS_REAL; typedef double DMUMPS_COMPLEX;"
        f"{plain} void dmumps_c(DMUMPS_STRUC_C *);"
    )


class MumpsFactor(WholeSolutions):
    """Factor of ``[[K, R^T], [R, 0]]`` that stops before the last rows, and their Schur complement.

    Parameters and attributes are those of `finger3d.fem.solvers.pardiso.PardisoFactor`.
    """

    def __init__(self, upper: sp.csr_matrix, rows: int) -> None:
        self._ffi, self._lib = library()
        self._upper = upper.tocsr()
        self._n = upper.shape[0] - rows
        places = self._upper.tocoo()
        self._i, self._j = (np.array(part + 1, dtype=np.int32) for part in (places.row, places.col))
        self._take(self._upper.data)
        self._kept = np.arange(self._n + 1, self._n + rows + 1, dtype=np.int32)
        self._schur = np.zeros((rows, rows))
        self._call = call = self._ffi.new("DMUMPS_STRUC_C *")
        call.sym, call.par, call.comm_fortran = _SYMMETRIC, _HOST_WORKS, _NO_MPI
        self._run(_START)
        self._finalizer = weakref.finalize(self, _release, self._lib, call)
        call.icntl[0] = call.icntl[1] = call.icntl[2] = -1  # prints nothing
        call.icntl[3] = 0
        call.cntl[3] = _SMALLEST_PIVOT
        call.icntl[6] = _METIS
        call.icntl[18] = _WHOLE_SCHUR
        call.n, call.nnz, call.size_schur = upper.shape[0], len(self._a), rows
        call.irn, call.jcn, call.listvar_schur = (self._pointer(part) for part in (self._i, self._j, self._kept))
        call.schur = self._pointer(self._schur)
        self.factorizations = 0
        self._run(_ANALYSE, self._a)
        self._factorize()

    def renew(self, data: Float) -> None:
        """Factor another matrix with entries of its upper triangle in the same places, in the order given first."""
        self._take(data)
        self._factorize()

    def _take(self, data: Float) -> None:
        self._a = np.array(data, dtype=np.float64)
        matrix = sp.csr_matrix((self._a, self._upper.indices, self._upper.indptr), shape=self._upper.shape)
        self.rows = matrix[: self._n, self._n :].T.tocsr()

    def _factorize(self) -> None:
        self.factorizations += 1  # before the call, which may fail and yet overwrite
        for space in _SPACES:
            self._call.icntl[13] = space
            if self._run(_FACTORIZE, self._a, unless=_TOO_SMALL if space < _SPACES[-1] else ()):
                break
        self.perturbed = int(self._call.infog[24])
        # One triangle is computed, the other one is left as it was.
        self.schur = np.tril(self._schur) + np.tril(self._schur, -1).T

    def solve(self, load: Float) -> Float:
        """Return ``K^-1 load`` (n, m) of loads (n, m)."""
        whole = np.zeros((self._n + len(self._kept), load.shape[1]), order="F")
        whole[: self._n] = load
        self._call.nrhs, self._call.lrhs = load.shape[1], len(whole)
        self._call.icntl[26] = min(load.shape[1], _AT_ONCE)
        self._run(_SOLVE, rhs=whole)
        return whole[: self._n]

    def _run(self, job: int, a: Float | None = None, rhs: Float | None = None, unless: tuple[int, ...] = ()) -> bool:
        """Call MUMPS; return False if it ends with one of the errors `unless`, and raise for all others."""
        call = self._call
        with _LOCK:
            call.job = job
            if a is not None:
                call.a = self._pointer(a)
            if rhs is not None:
                call.rhs = self._pointer(rhs)
            self._lib.dmumps_c(call)
        error = int(call.infog[0])
        if error in unless:
            return False
        if error in _NO_MEMORY:
            raise MemoryError(f"MUMPS job {job}")
        if error < 0:
            reason = {-6: "singular pattern", -10: "singular matrix"}.get(error, "see the guide of MUMPS, infog(1)")
            raise MissingError(f"MUMPS job {job}: error {error} ({reason})")
        return True

    def _pointer(self, array: Array) -> object:
        return self._ffi.cast("double *" if array.dtype == np.float64 else "int *", array.ctypes.data)


def _release(lib: Any, call: Any) -> None:
    with _LOCK:
        call.job = _END
        lib.dmumps_c(call)
