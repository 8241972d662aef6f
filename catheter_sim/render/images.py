"""Pictures and videos as files, written whole or not at all."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import imageio.v2 as imageio
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from catheter_sim.errors import InputError, unknown
from catheter_sim.progress import counted
from catheter_sim.tables import replaced_when_whole

Picture = NDArray[np.uint8]  # shape (height, width, 3)

PICTURE, VIDEO = ".png", ".mp4"
_INK = (40, 48, 60)


def suffix_of(path: str | os.PathLike[str]) -> str:
    """Return `PICTURE` or `VIDEO`, whichever the file's name ends in.

    Raises:
        InputError: neither.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in (PICTURE, VIDEO):
        raise unknown("kind of picture or video", suffix, (PICTURE, VIDEO), os.fspath(path))
    return suffix


def require_even(path: str | os.PathLike[str], width: int, height: int) -> None:
    """Raise `InputError` if a video cannot have this size: its colours are stored for 2 x 2 pixels."""
    if width % 2 or height % 2:
        raise InputError(f"{os.fspath(path)}: {width} x {height} pixels: a video's width and height are even")


def write_picture(path: str | os.PathLike[str], image: Picture) -> None:
    """Write `image` as a PNG.

    Raises:
        InputError: the file cannot be written.
    """
    with replaced_when_whole(path, binary=True) as file:
        Image.fromarray(image).save(file, format="PNG")


def write_video(
    path: str | os.PathLike[str], frames: Iterable[Picture], fps: int, count: int, progress: bool = False
) -> None:
    """Write `frames` as an MP4 that every player shows (H.264, yuv420p).

    Args:
        path: file to write.
        frames: pictures of one size, even in width and height.
        fps: frames a second.
        count: how many frames there are, for the progress bar.
        progress: show on standard error how many frames are done.

    Raises:
        InputError: a size is odd, or the file cannot be written.
    """
    shown = counted(frames, count, "drawing", "frame", progress)
    # The encoder needs a file that it can seek in; only the finished one goes to its place.
    with replaced_when_whole(path, binary=True) as file, tempfile.TemporaryDirectory() as folder:
        encoded = Path(folder) / f"video{VIDEO}"
        writer: Any  # imageio does not type its plug-ins
        with imageio.get_writer(
            encoded,
            format="FFMPEG",  # type: ignore[arg-type]
            fps=fps,
            codec="libx264",
            pixelformat="yuv420p",
            quality=8,
            macro_block_size=2,
            ffmpeg_log_level="error",
        ) as writer:
            for frame in shown:
                require_even(path, frame.shape[1], frame.shape[0])
                writer.append_data(frame)
        with encoded.open("rb") as done:
            shutil.copyfileobj(done, file)


def with_inset(image: Picture, inset: Picture, corner: tuple[int, int]) -> Picture:
    """Return `image` with a framed smaller picture in a corner (row, column: 0 first, 1 last)."""
    result = image.copy()
    framed = np.pad(inset, ((2, 2), (2, 2), (0, 0)), constant_values=150)
    rows, columns, gap = framed.shape[0], framed.shape[1], image.shape[0] // 40
    top = image.shape[0] - rows - gap if corner[0] else gap
    left = image.shape[1] - columns - gap if corner[1] else gap
    result[top : top + rows, left : left + columns] = framed
    return result


def caption_size(lines: Iterable[str], height: int) -> tuple[int, int]:
    """Return width and height that `with_caption` takes, margins included, in a picture so high [pixels]."""
    draw = ImageDraw.Draw(Image.new("L", (1, 1)))
    left, top, right, bottom = draw.multiline_textbbox((0, 0), "\n".join(lines), font=_font(height))
    return round(right - left) + 2 * _gap(height), round(bottom - top) + 2 * _gap(height)


def _font(height: int) -> ImageFont.ImageFont | ImageFont.FreeTypeFont:
    return ImageFont.load_default(max(10, height // 36))


def _gap(height: int) -> int:
    return height // 40


def with_caption(image: Picture, lines: Iterable[str], corner: tuple[int, int]) -> Picture:
    """Return `image` with lines of text in a corner (row, column: 0 first, 1 last)."""
    canvas = Image.fromarray(image)
    draw = ImageDraw.Draw(canvas)
    font, text, gap = _font(image.shape[0]), "\n".join(lines), _gap(image.shape[0])
    left, top, right, bottom = draw.multiline_textbbox((0, 0), text, font=font)
    x = image.shape[1] - gap - right if corner[1] else gap - left
    y = image.shape[0] - gap - bottom if corner[0] else gap - top
    draw.multiline_text((x, y), text, fill=_INK, font=font)
    return np.asarray(canvas)
