"""The files that a model may read: below its own folder, regular, of a size that a robot needs, and no others."""

from __future__ import annotations

import errno
import os
import stat
import struct
from pathlib import Path, PurePosixPath

from workbench.errors import ModelError

MAX_BYTES = 10_000_000
"""An XML file larger than this is refused before it is parsed."""

MAX_ASSET = 50_000_000
"""bytes of one mesh, height field or texture"""

MAX_ASSETS = 400_000_000
"""bytes of all that one model reads"""

MAX_PIXELS = 4096
"""width and height of a picture; it is unpacked in memory"""

MESHES = (".stl", ".obj", ".msh")
POINTER = b"version https://git-lfs"
PNG = b"\x89PNG\r\n\x1a\n"


class UnreadableError(Exception):
    """Why a file is not read, for the middle of a sentence."""


def read_text(path: Path) -> str:
    """Read an MJCF file; the text keeps its line endings and its byte order mark.

    Raises
    ------
    ModelError
        Not a regular file, not readable, not UTF-8, or too large. A pipe is refused, not waited for.
    """
    try:
        return read_bytes(path, MAX_BYTES).decode()
    except UnreadableError as error:
        kind = "; a model is an XML file" if str(error).startswith("is ") else ""
        raise ModelError(f"{path}: {error}{kind}", file=str(path)) from error
    except UnicodeDecodeError as error:
        raise ModelError(f"{path}: not UTF-8 text (byte {error.start})", file=str(path)) from error
    except ValueError as error:  # a null byte in the name
        raise ModelError(f"{str(path)!r}: {error}", file=str(path)) from error


def read_bytes(path: Path, limit: int) -> bytes:
    """Read a regular file of at most *limit* bytes.

    Raises
    ------
    UnreadableError
        A directory, a pipe, too large, or not to be read.
    """
    try:
        # O_NONBLOCK: opening a pipe that nobody writes to would wait for ever
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        with open(handle, "rb") as stream:
            status = os.fstat(stream.fileno())
            if not stat.S_ISREG(status.st_mode):
                kind = "a directory" if stat.S_ISDIR(status.st_mode) else "no regular file"
                raise UnreadableError(f"is {kind}")
            if status.st_size > limit:
                raise UnreadableError(f"{status.st_size} bytes; allowed: at most {limit}")
            return stream.read(limit + 1)
    except OSError as error:
        if error.errno == errno.EISDIR or path.is_dir():
            raise UnreadableError("is a directory") from error
        raise UnreadableError(error.strerror or str(error)) from error


def below(root: Path, directory: Path, name: str) -> Path:
    """Return the path of a file that a model in *root* names, seen from *directory*.

    Raises
    ------
    UnreadableError
        It does not lie below *root*: an absolute path, ``..``, or a link that leads out of it.
    """
    written = name.replace("\\", "/")
    if PurePosixPath(written).is_absolute() or written[1:2] == ":" or "\0" in written:
        raise UnreadableError("an absolute path; only files below the model's own folder are read")
    path = Path(os.path.normpath(directory / written))
    try:
        if not path.is_relative_to(os.path.normpath(root)):
            raise UnreadableError("lies outside the model's own folder")
        if not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(root)):
            raise UnreadableError("is a link that leads out of the model's own folder")
        if not path.exists():
            raise UnreadableError("no such file")
    except OSError as error:  # a name too long, a directory that may not be entered
        raise UnreadableError(error.strerror or str(error)) from error
    return path


def read_asset(path: Path, tag: str, content_type: str) -> bytes:
    """Read a mesh, a texture or a height field.

    Raises
    ------
    UnreadableError
        Too large, or of a kind that is not read.
    """
    suffix = path.suffix.lower()
    known = MESHES if tag == "mesh" else (".png",)
    if suffix not in known or content_type not in ("", *(f"{kind}/{suffix[1:]}" for kind in ("model", "image"))):
        raise UnreadableError(f"of a kind that is not read ({', '.join(known)})")
    found = read_bytes(path, MAX_ASSET)
    if found.startswith(POINTER):
        raise UnreadableError("a Git LFS pointer in place of the file")
    if suffix == ".png":
        _check_png(found)
    return found


def _check_png(found: bytes) -> None:
    if len(found) < 24 or not found.startswith(PNG):
        raise UnreadableError("no PNG picture")
    width, height = struct.unpack(">II", found[16:24])
    if not (1 <= width <= MAX_PIXELS and 1 <= height <= MAX_PIXELS):
        raise UnreadableError(f"{width} x {height} pixels; allowed: at most {MAX_PIXELS} x {MAX_PIXELS}")
