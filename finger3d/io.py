"""Texts, CSV, JSON and npz files, each written completely or not at all."""

from __future__ import annotations

import codecs
import csv
import errno
import glob
import hashlib
import json
import math
import os
import secrets
import tempfile
import time
import tokenize
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from enum import Enum
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from finger3d._types import Array
from finger3d.errors import Finger3dError, MissingError


def cannot_write(path: Path, error: OSError) -> Finger3dError:
    """Return the error of a file that cannot be written: a full disk is nobody's mistake in the input."""
    reason = error.strerror or str(error)
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return MissingError(f"cannot write {path}: {reason}; make room and run the same command again")
    return Finger3dError(f"cannot write {path}: {reason}; choose another place with --out")


def file_bytes(path: str | Path, hint: str = "") -> bytes:
    """Return what a file holds.

    Raises
    ------
    Finger3dError
        If there is no such file, of which `hint` then says more, or it cannot be read.
    """
    try:
        return Path(path).read_bytes()
    except FileNotFoundError:
        raise Finger3dError(f"{path}: there is no such file{hint}") from None
    except OSError as error:
        raise Finger3dError(f"{path}: cannot be read: {error.strerror}") from None


@contextmanager
def atomic(path: str | Path) -> Iterator[Path]:
    """Give the name of a temporary file beside `path`; it takes the place of `path` when the block ends well.

    The temporary name keeps the ending of `path`, for writers that go by it. An error in the block removes the
    temporary file and leaves an older `path` as it was. Missing folders are made. A temporary file that a killed
    process has left is removed after `_STALE_S`, or when its folder is next `claimed`.

    Raises
    ------
    Finger3dError
        If the file cannot be written.
    MissingError
        If the disk is full.
    """
    target = Path(path)
    temporary = target.with_name(f".{target.stem}{_TEMPORARY}{secrets.token_hex(4)}{target.suffix}")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        _remove_temporaries(target.parent, f".{target.stem}", _STALE_S)
        yield temporary
        os.replace(temporary, target)
    except OSError as error:
        raise cannot_write(target, error) from error
    finally:
        # Usually it is gone by now, or was never made; and a folder that refuses has been reported above.
        with suppress(OSError):
            temporary.unlink()


def holds(folder: str | Path, names: Iterable[str], file: str | Path) -> bool:
    """Return whether a file is one of these in a folder, whatever links lead to it."""
    return os.path.realpath(file) in [os.path.realpath(Path(folder) / name) for name in names]


def check_writable(out: Path, scene: Path) -> None:
    """Raise Finger3dError if the output folder cannot be written, or holds the scene file itself."""
    if holds(out, ["scene.toml"], scene):
        raise Finger3dError(f"--out {out}: holds {scene.name}, which the results would overwrite; name another folder")
    check_folder(out)


def check_folder(out: Path) -> None:
    """Raise Finger3dError if a folder cannot be written, or cannot be created where it does not exist."""
    try:
        # a link that leads nowhere, or in a circle, is there without existing
        there = next(p for p in (out, *out.parents, Path()) if os.path.lexists(p))
        if not there.exists():
            raise Finger3dError(f"--out {out}: {there} is a link that leads nowhere; name another folder")
        if there == out and not out.is_dir():
            raise Finger3dError(f"--out {out}: is a file; name a folder")
        with tempfile.TemporaryFile(dir=there):
            pass
    except OSError as error:
        raise Finger3dError(f"--out {out}: cannot be written: {error.strerror}") from None


_TEMPORARY = ".finger3d-"
"""Part of the names of temporary files, before eight digits and the ending."""

_STALE_S = 3600.0
"""Age above which nobody writes a temporary file any more."""


def _remove_temporaries(folder: Path, start: str = "", age_s: float = -math.inf) -> None:
    """Remove the temporary files of a folder whose names start so, and which are older than an age in seconds."""
    for path in folder.glob(f"{glob.escape(start)}{_TEMPORARY}*" if start else f".*{_TEMPORARY}*"):
        with suppress(OSError):  # another process has removed it in the meantime
            if time.time() - path.lstat().st_mtime > age_s:
                path.unlink()


_LOCK = ".finger3d.lock"


_RESULTS = {
    "summary.json": "press",
    "compare.json": "compare",
    "calibration.json": "calibrate",
    "sweep.json": "sweep",
    "search.json": "optimise",
    "gauges.json": "optimise",
    "identify.json": "identify",
    "sensitivity.json": "sensitivity",
}
"""Files of results, and the command that writes each."""


@contextmanager
def claimed(folder: str | Path, command: str = "") -> Iterator[Path]:
    """Create a folder, and lock it against other runs of finger3d during the block.

    A folder created here is removed if nothing was written into it.

    Parameters
    ----------
    command : what is going to write there; its own older results may be replaced, those of another command may not

    Raises
    ------
    Finger3dError
        If another run holds it, it holds what another command wrote, or it cannot be written.
    """
    from filelock import FileLock, Timeout

    path = Path(folder)
    for file, other in _RESULTS.items():
        if command not in ("", other) and (path / file).exists():
            raise Finger3dError(f"--out {path}: holds the results of a {other}; name another folder, or remove it")
    made = [p for p in (path, *path.parents) if not p.exists()]
    try:
        path.mkdir(parents=True, exist_ok=True)
        lock = FileLock(path / _LOCK, blocking=False)
        lock.acquire()
    except Timeout:
        raise Finger3dError(
            f"{path}: another finger3d is writing there; wait for it, or name another folder with --out"
        ) from None
    except OSError as error:
        raise Finger3dError(f"--out {path}: cannot be written: {error.strerror or error}") from None
    _remove_temporaries(path)
    try:
        yield path
    finally:
        if made and os.listdir(path) == [_LOCK]:
            with suppress(OSError):  # of a folder that another run has found in the meantime
                (path / _LOCK).unlink()
                for folder in made:
                    folder.rmdir()
        lock.release()


_DAMAGED = (
    ValueError,
    TypeError,
    KeyError,
    AttributeError,
    EOFError,
    MemoryError,
    OverflowError,
    RuntimeError,
    SyntaxError,
    tokenize.TokenError,
    zipfile.BadZipFile,
    zlib.error,
)
"""What NumPy raises for an .npz file that is cut short, changed, or of another kind."""

_CHECKSUM = "checksum"
"""Name of the array of an .npz file with the SHA-256 of all others."""

_MOST_EXPANSION = 100
"""Largest ratio of the arrays' bytes to those of an .npz file; finger3d writes them uncompressed."""


def read_arrays(path: str | Path) -> dict[str, Array]:
    """Read the arrays that `write_arrays` wrote.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it is damaged, or was altered.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            expanded = sum(member.file_size for member in archive.infolist())
        if expanded > _MOST_EXPANSION * os.path.getsize(path):
            raise ValueError(f"it expands to {expanded / 1e6:.0f} MB")
        with np.load(path, allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files}
    except _DAMAGED as error:
        raise ValueError(f"no .npz file, or damaged: {error}") from error
    if not np.array_equal(arrays.pop(_CHECKSUM, np.zeros(0)), _checksum_of(arrays)):
        raise ValueError("it was altered after it was written")
    return arrays


def text_of(content: bytes) -> str:
    """Return a text in UTF-8, UTF-16 with its mark, GB 2312 or Latin-1.

    ASCII, and with it numbers and separators, is the same in the last two and in GB 18030.

    Raises
    ------
    ValueError
        If it is no text.
    """
    is_utf16 = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    if not is_utf16 and b"\0" in content:
        raise ValueError("holds zero bytes, as no text does")
    for encoding in ("utf-16",) if is_utf16 else ("utf-8-sig", "gb2312", "latin-1"):
        with suppress(UnicodeDecodeError):
            return content.decode(encoding).replace("\ufeff", "")
    raise ValueError("is cut within a character of UTF-16")


def write_text(path: str | Path, text: str) -> None:
    """Write a text in UTF-8."""
    with atomic(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_csv(path: str | Path, columns: Mapping[str, ArrayLike]) -> None:
    """Write one line of names and a line for each entry; numbers keep every digit (``repr``).

    Parameters
    ----------
    columns : name (with its unit) -> (n,) numbers, or texts; all of one length
    """
    arrays = [np.asarray(column) for column in columns.values()]
    shapes = {a.shape for a in arrays}
    if len(shapes) > 1 or any(len(s) != 1 for s in shapes):
        raise ValueError(f"columns of {path} differ in shape: { {k: np.shape(v) for k, v in columns.items()} }")
    with atomic(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(zip(*(a.tolist() for a in arrays), strict=True))


def write_json(path: str | Path, data: object) -> None:
    """Write nested dicts, lists, arrays and numbers; NaN and infinity, which JSON lacks, become null."""
    write_text(path, json_text(data) + "\n")


def json_text(data: object) -> str:
    """JSON of nested dicts, lists, arrays and numbers; NaN and infinity become null."""
    return json.dumps(_plain(data), indent=2, ensure_ascii=False, allow_nan=False)


def write_arrays(path: str | Path, arrays: Mapping[str, Array]) -> None:
    """Write arrays and their checksum as an .npz file, whole or not at all."""
    with atomic(path) as temporary, temporary.open("wb") as file:
        np.savez(file, allow_pickle=False, **{**arrays, _CHECKSUM: _checksum_of(arrays)})


def _checksum_of(arrays: Mapping[str, Array]) -> Array:
    digest = hashlib.sha256()
    for name in sorted(arrays):
        values = np.ascontiguousarray(arrays[name])
        digest.update(f"{name} {values.dtype.str} {values.shape}".encode())
        digest.update(values.data)
    return np.frombuffer(digest.digest(), dtype=np.uint8)


def checksum(data: object, before: str = "") -> str:
    """Return 16 hex digits of the SHA-256 of JSON data, the same before they are written and after they are read.

    Parameters
    ----------
    before : checksum of what must come before the data
    """
    text = before + json.dumps(_plain(data), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _plain(value: object) -> object:
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    if isinstance(value, Enum | Path):
        return str(value)
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
