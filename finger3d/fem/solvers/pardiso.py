"""MKL PARDISO: one symmetric indefinite factorisation with a Schur complement, through pypardiso's loaded library."""

from __future__ import annotations

import ctypes
import os
import sys
import weakref
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

import numpy as np
import scipy.sparse as sp

from finger3d._types import Array, Float
from finger3d.errors import OUT_OF_MEMORY, MissingError

Call: TypeAlias = Callable[..., object]
"""PARDISO's only function."""

Threads: TypeAlias = Callable[[int], int]
"""Sets MKL's number of threads in the calling thread, 0 for that of the process, and returns the one before."""

_MTYPE = ctypes.c_int32(-2)  # real, symmetric, indefinite
_INT32_MAX = 2**31 - 1
_NO_MEMORY = -2
_RELEASE = -1  # phase that releases all memory


def library() -> tuple[Call, Threads, int]:
    """Return PARDISO, the function that sets its threads, and their number now."""
    if "PYPARDISO_MKL_RT" not in os.environ:
        # pypardiso's own search walks the whole environment, which costs more than a small solve.
        libraries = sorted(Path(sys.prefix, "lib").glob("libmkl_rt.so*"))
        if libraries:
            os.environ["PYPARDISO_MKL_RT"] = str(libraries[0])
    from pypardiso.pardiso_wrapper import PyPardisoSolver

    library = PyPardisoSolver().libmkl
    library.mkl_set_exit_handler(_EXIT_HANDLER)
    threads = ctypes.CDLL(library._name).MKL_Set_Num_Threads_Local
    return library.pardiso, threads, int(library.MKL_Get_Max_Threads())


def _exit(code: int) -> None:
    """End the process with the exit code for lack of memory; MKL would exit with 2, the code for bad input."""
    os.write(2, f"finger3d: {OUT_OF_MEMORY}\n".encode())
    os._exit(MissingError.exit_code)


_EXIT_HANDLER = ctypes.CFUNCTYPE(None, ctypes.c_int)(_exit)  # must live as long as MKL may call it


class PardisoFactor:
    """Factor of ``[[K, R^T], [R, 0]]`` that stops before the last rows, and their Schur complement.

    Parameters
    ----------
    upper : (n + r, n + r) sparse
        Upper triangle of the augmented matrix, every diagonal entry stored.
    rows : int
        Number r of last rows that are kept.

    Attributes
    ----------
    schur : (r, r)
        ``-R K^-1 R^T``.
    perturbed : int
        Pivots that PARDISO had to perturb; 0 for a trustworthy factor.
    factorizations : int
        Matrices factored so far; solutions are those of the last.
    """

    def __init__(self, upper: sp.csr_matrix, rows: int) -> None:
        upper = upper.tocsr()
        upper.sort_indices()
        if upper.nnz > _INT32_MAX:
            raise MissingError("matrix has more entries than 32-bit PARDISO can index")
        # PARDISO crashes if a matrix is factored again on another number of threads
        call, self._set_threads, self._threads = library()
        n = upper.shape[0]
        self._n, self._rows = n, rows
        a = np.ascontiguousarray(upper.data, dtype=np.float64)
        ia, ja = upper.indptr.astype(np.int32) + 1, upper.indices.astype(np.int32) + 1
        perm = np.zeros(n, dtype=np.int32)
        perm[n - rows :] = 1
        self._handle = _Handle(call, n, a, ia, ja, perm)
        iparm = self._handle.iparm
        # Own settings, parallel METIS, pivot threshold 1e-13, Bunch-Kaufman.  Two-level factorisation, other
        # pivoting and matching save no time; out of core, the Schur complement returned is zero.
        iparm[[0, 1, 9, 20]] = 1, 3, 13, 1
        iparm[35] = 2  # Schur complement, and keep the factor for solves
        self._finalizer = weakref.finalize(self, self._handle.run, _RELEASE, np.zeros(1), np.zeros(1), 1)
        self.factorizations = 0
        self._phase(11, np.zeros(1), np.zeros(1), 1)
        self._factorize()

    def renew(self, data: Float) -> None:
        """Factor another matrix with entries of its upper triangle in the same places, in the order given first."""
        self._handle.a = np.ascontiguousarray(data, dtype=np.float64)
        self._factorize()

    def _factorize(self) -> None:
        self.factorizations += 1  # before the call, which may fail and yet overwrite
        schur = np.zeros((self._rows, self._rows), order="F")
        self._phase(22, np.zeros(1), schur, 1)
        self.schur = np.asarray(schur)
        self.perturbed = int(self._handle.iparm[13])

    def _phase(self, phase: int, b: Float, x: Float, nrhs: int) -> None:
        before = self._set_threads(self._threads)
        try:
            self._handle.run(phase, b, x, nrhs)
        finally:
            self._set_threads(before)

    def eliminated(self, load: Float) -> tuple[Float, Float]:
        """Forward substitution of loads (n, m): what `substituted` needs of it, and ``R K^-1 load`` (r, m)."""
        n = self._n - self._rows
        b = np.zeros((self._n, load.shape[1]), order="F")
        b[:n] = load
        x = np.zeros_like(b, order="F")
        self._phase(331, b, x, b.shape[1])
        return x, -x[n:]

    def substituted(self, eliminated: Float | None, force: Float) -> Float:
        """Backward substitution: ``K^-1 (load + R^T force)`` (n, m) for eliminated loads, if any, and forces (r, m)."""
        n, m = self._n - self._rows, force.shape[1]
        b, x = np.zeros((self._n, m), order="F"), np.zeros((self._n, m), order="F")
        if eliminated is not None:
            b[:n] = eliminated[:n]
            self._phase(332, b, x, m)
        b[:n], b[n:] = x[:n], -force
        self._phase(333, b, x, m)
        return x[:n]


@dataclass
class _Handle:
    """A matrix and PARDISO's memory for it, which outlives its factor until that is released.

    Attributes
    ----------
    call : PARDISO
    n : number of rows
    a, ia, ja : upper triangle in compressed rows, with indices from 1
    perm : (n,), 1 for the rows of the Schur complement
    pt, iparm : pointers to its memory, and its settings
    """

    call: Call
    n: int
    a: Array
    ia: Array
    ja: Array
    perm: Array
    pt: Array = field(default_factory=lambda: np.zeros(64, dtype=np.int64))
    iparm: Array = field(default_factory=lambda: np.zeros(64, dtype=np.int32))

    def run(self, phase: int, b: Float, x: Float, nrhs: int) -> None:
        """Run a phase with `nrhs` right-hand sides b and solutions x."""

        def i32(value: int) -> object:
            return ctypes.byref(ctypes.c_int32(value))

        def pointer(array: Array, kind: type[ctypes.c_int32 | ctypes.c_int64] = ctypes.c_int32) -> object:
            return array.ctypes.data_as(ctypes.POINTER(kind))

        error = ctypes.c_int32(0)
        self.call(
            pointer(self.pt, ctypes.c_int64), i32(1), i32(1), ctypes.byref(_MTYPE), i32(phase), i32(self.n),
            self.a.ctypes.data_as(ctypes.c_void_p), pointer(self.ia), pointer(self.ja), pointer(self.perm), i32(nrhs),
            pointer(self.iparm), i32(0), b.ctypes.data_as(ctypes.c_void_p), x.ctypes.data_as(ctypes.c_void_p),
            ctypes.byref(error),
        )  # fmt: skip
        if error.value == _NO_MEMORY:
            raise MemoryError(f"PARDISO phase {phase}")
        if error.value:
            reason = {-1: "inconsistent input", -3: "reordering", -4: "zero pivot"}
            raise MissingError(
                f"PARDISO phase {phase}: error {error.value} ({reason.get(error.value, 'see MKL manual')})"
            )
