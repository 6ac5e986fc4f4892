# SPDX-License-Identifier: MIT
"""Files in and out: each error is one line that names the file."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any


def text_of(path: Path | str) -> str:
    """The text of a file, without a byte order mark."""
    with named(path):
        raw = Path(path).read_bytes()
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        return raw.decode("utf-16", errors="replace")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("cp1252", errors="replace")


def write(path: Path, content: str | bytes) -> Path:
    with named(path):
        path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8"))
    return path


@contextmanager
def named(path: Path | str) -> Iterator[None]:
    """Add the name of the file to errors, which those of a full disk lack."""
    try:
        yield
    except OSError as problem:
        raise OSError(problem.errno, problem.strerror, str(path)) from None


@contextmanager
def hdf5(path: Path) -> Iterator[Any]:
    """An HDF5 file to read from. Whatever the body cannot read in it is a ValueError with the name of the file."""
    import h5py

    try:
        with h5py.File(path, "r") as file:
            yield file
    except (OSError, KeyError, RuntimeError, TypeError, ValueError, AttributeError, IndexError, MemoryError) as problem:
        reason = re.search(r"\((.*)\)", message_of(problem))  # that of the library, behind its name for the call
        raise ValueError(f"{path}: cut short or damaged: {reason[1] if reason else message_of(problem)}") from None


def message_of(problem: BaseException) -> str:
    """The message of an error: for a file its name and what is wrong with it."""
    if isinstance(problem, OSError) and problem.strerror:
        return f"{problem.filename}: {problem.strerror}" if problem.filename else problem.strerror
    if isinstance(problem, (ValueError, RuntimeError, OSError)) and str(problem):
        return str(problem).strip()
    return f"{type(problem).__name__} {problem}".strip()
