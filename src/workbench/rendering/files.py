"""Pictures into files: .png, .gif, .mp4; whole or not at all."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from workbench.errors import OutputError, did_you_mean
from workbench.output_file import refuse_target
from workbench.rendering.offscreen import Picture
from workbench.rendering.system import needs

GIF_TICK = 0.01
"""Seconds: a GIF counts the time of a picture in these, and viewers slow down below two of them."""


def check_target(path: Path, moving: bool) -> None:
    """Refuse a file that cannot be written, before anything is drawn.

    Parameters
    ----------
    path
        The file.
    moving
        Whether there is a motion to show.

    Raises
    ------
    OutputError
        An unknown ending, a film of a model that stands still, or what `refuse_target` refuses.
    MissingExtraError
        The encoder of .mp4 files is not installed.
    """
    suffix = path.suffix.lower()
    if suffix not in WRITERS:
        hint = did_you_mean(suffix, WRITERS) if suffix else f"; valid: {', '.join(WRITERS)}"
        raise OutputError(f'{path}: no picture ends in "{suffix}"{hint}', path=str(path))
    if suffix != ".png" and not moving:
        raise OutputError(f"{path}: a film needs a motion: give a campaign, and a case of it", path=str(path))
    if suffix == ".mp4":
        needs("imageio_ffmpeg")
    refuse_target(path)


def write_pictures(path: Path, pictures: Iterable[Picture], size: tuple[int, int], fps: float) -> None:
    """Write one picture (.png) or a film (.gif, .mp4).

    Parameters
    ----------
    path
        The file, replaced where it exists.
    pictures
        ``(height, width, 3)`` each.
    size
        Width and height, pixels.
    fps
        Pictures a second.

    Raises
    ------
    OutputError
        It cannot be written.
    """
    temporary = ""
    try:
        handle, temporary = tempfile.mkstemp(prefix=f".{path.stem[:40]}.", suffix=path.suffix.lower(), dir=path.parent)
        os.close(handle)
        WRITERS[path.suffix.lower()](Path(temporary), iter(pictures), size, fps)
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except OSError as error:
        raise OutputError(f"{path}: {error.strerror or error}", path=str(path)) from error
    finally:
        with contextlib.suppress(OSError):
            os.unlink(temporary)


def _png(path: Path, pictures: Iterator[Picture], size: tuple[int, int], fps: float) -> None:
    from PIL import Image

    Image.fromarray(next(pictures)).save(path, format="PNG", optimize=True)


def _gif(path: Path, pictures: Iterator[Picture], size: tuple[int, int], fps: float) -> None:
    from PIL import Image

    frames = (Image.fromarray(picture) for picture in pictures)
    first = next(frames).quantize(dither=Image.Dither.NONE)
    # one palette for all, so that still parts stay still and the file small
    rest = (frame.quantize(palette=first, dither=Image.Dither.NONE) for frame in frames)
    milliseconds = 1000 * GIF_TICK * max(2, round(1 / fps / GIF_TICK))
    first.save(path, format="GIF", save_all=True, append_images=rest, duration=int(milliseconds), loop=0)


def _mp4(path: Path, pictures: Iterator[Picture], size: tuple[int, int], fps: float) -> None:
    import imageio_ffmpeg

    film = imageio_ffmpeg.write_frames(str(path), size, fps=fps, macro_block_size=2, quality=8)
    film.send(None)
    try:
        for picture in pictures:
            film.send(picture.tobytes())
    finally:
        film.close()


WRITERS: dict[str, Callable[[Path, Iterator[Picture], tuple[int, int], float], None]] = {
    ".png": _png, ".gif": _gif, ".mp4": _mp4,
}  # fmt: skip
"""What writes each kind of file."""
