"""Pictures and videos as files, written whole or not at all."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Iterable
from contextlib import ExitStack, suppress
from pathlib import Path
from threading import Thread

import numpy as np
from imageio_ffmpeg import count_frames_and_secs, get_ffmpeg_exe
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from catheter_sim.errors import InputError, unknown
from catheter_sim.files import placed_when_whole
from catheter_sim.progress import counted
from catheter_sim.signals import held_back
from catheter_sim.tables import replaced_when_whole

Picture = NDArray[np.uint8]  # shape (height, width, 3)

PICTURE, VIDEO, ANIMATION = ".png", ".mp4", ".gif"
_LOSS = 10  # of the encoder, 0 (none) to 51
INK = (40, 48, 60)
_PALETTE = "split[a][b];[a]palettegen[p];[b][p]paletteuse=dither=none"


def suffix_of(path: str | os.PathLike[str]) -> str:
    """Return `PICTURE`, `VIDEO` or `ANIMATION`, whichever the file's name ends in.

    Raises:
        InputError: none of them.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in (PICTURE, VIDEO, ANIMATION):
        raise unknown("kind of picture or video", suffix, (PICTURE, VIDEO, ANIMATION), os.fspath(path))
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
    """Write `frames` as an MP4 that every player shows (H.264, yuv420p), or as a GIF that runs for ever.

    Args:
        path: file to write, `.mp4` or `.gif`.
        frames: pictures of one size, even in width and height.
        fps: frames a second.
        count: how many frames there are, for the progress bar.
        progress: show on standard error how many frames are done.

    Raises:
        InputError: a size is odd, there are no frames, or the file cannot be written, read and counted.
    """
    shown = counted(frames, count, "drawing", "frame", progress)
    with placed_when_whole(path) as encoded:  # the encoder needs a file that it can seek in
        written, complaint = _encoded(path, shown, fps, encoded)
        if not complaint and _frames_in(encoded) != written:
            complaint = f"not all of its {written} frames are in the file"
        if complaint:
            raise InputError(f"{path}: the video cannot be written: {complaint}")


def _encoded(
    path: str | os.PathLike[str], frames: Iterable[Picture], fps: int, encoded: Path
) -> tuple[int, str]:
    """Write `frames` to the file `encoded`; return how many, and the encoder's complaint, "" for none.

    imageio's own writer asks neither for the encoder's exit status nor for its words.
    """
    encoder: _Encoder | None = None
    written = 0
    with ExitStack() as opened:
        for frame in frames:
            height, width = frame.shape[:2]
            if encoder is None:
                animation = Path(path).suffix.lower() == ANIMATION
                if not animation:
                    require_even(path, width, height)
                with held_back():  # a process that has begun is ended, whatever comes meanwhile
                    encoder = opened.enter_context(_Encoder(width, height, fps, encoded, animation))
            if (width, height) != encoder.size:
                raise ValueError(f"frame {written + 1} is {width} x {height}, others are {encoder.size}")
            if not encoder.took(frame):
                break
            written += 1
        return written, encoder.ended() if encoder else "it has no frames"


class _Encoder:
    """A process that encodes the pictures which it is given; at the end of its context it is gone.

    Attributes:
        size: width and height of the pictures [pixels].
    """

    def __init__(self, width: int, height: int, fps: int, encoded: Path, animation: bool) -> None:
        self.size = (width, height)
        picture = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", f"{fps}"]
        coding = ["-an", "-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", f"{_LOSS}", "-f", "mp4"]
        if animation:  # 256 colours, chosen for what is shown
            coding = ["-an", "-vf", _PALETTE, "-loop", "0", "-f", "gif"]
        command = [get_ffmpeg_exe(), "-y", "-v", "error", *picture, "-i", "-", *coding, os.fspath(encoded)]
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            start_new_session=True,  # Ctrl-C is for us, who end it
        )
        assert self._process.stdin is not None
        assert self._process.stderr is not None
        self._given, self._said = self._process.stdin, self._process.stderr
        self._words = b""
        self._reader = Thread(target=self._listen, daemon=True)

    def __enter__(self) -> _Encoder:
        self._reader.start()  # at once: who is not listened to waits
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()
        self._reader.join()
        for pipe in (self._given, self._said):
            with suppress(BrokenPipeError):
                pipe.close()

    def took(self, frame: Picture) -> bool:
        """Hand over a picture; return whether the process was still there to take it."""
        try:
            self._given.write(np.ascontiguousarray(frame).data)
        except BrokenPipeError:
            return False
        return True

    def ended(self) -> str:
        """Wait for the end of the process; return its complaint, "" where all went well."""
        with suppress(BrokenPipeError):
            self._given.close()
        self._reader.join()
        status = self._process.wait()
        if status == 0:
            return ""
        lines = self._words.decode(errors="replace").strip().splitlines()
        ended = f"by {signal.Signals(-status).name}" if status < 0 else f"with status {status}"
        return lines[-1].rpartition("] ")[2] if lines else f"the encoder ended {ended}"

    def _listen(self) -> None:
        self._words = self._said.read()


def _frames_in(video: Path) -> int:
    """Return how many frames of a video can be decoded, 0 if it is none."""
    try:
        return int(count_frames_and_secs(video)[0] or 0)
    except RuntimeError:
        return 0


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
    left, top, right, bottom = draw.multiline_textbbox((0, 0), "\n".join(lines), font=font_of(height))
    return round(right - left) + 2 * gap_of(height), round(bottom - top) + 2 * gap_of(height)


def font_of(height: int) -> ImageFont.ImageFont | ImageFont.FreeTypeFont:
    """Return the letters of a picture so high [pixels]."""
    return ImageFont.load_default(max(10, height // 36))


def gap_of(height: int) -> int:
    """Return the margin around what is written into a picture so high [pixels]."""
    return height // 40


def with_caption(image: Picture, lines: Iterable[str], corner: tuple[int, int]) -> Picture:
    """Return `image` with lines of text in a corner (row, column: 0 first, 1 last)."""
    canvas = Image.fromarray(image)
    draw = ImageDraw.Draw(canvas)
    font, text, gap = font_of(image.shape[0]), "\n".join(lines), gap_of(image.shape[0])
    left, top, right, bottom = draw.multiline_textbbox((0, 0), text, font=font)
    x = image.shape[1] - gap - right if corner[1] else gap - left
    y = image.shape[0] - gap - bottom if corner[0] else gap - top
    draw.multiline_text((x, y), text, fill=INK, font=font)
    return np.asarray(canvas)


def with_words(image: Picture, words: Iterable[str], places: NDArray[np.float64]) -> Picture:
    """Return `image` with a word beside each of `places`, shape (n, 2) (to the right, down) [pixels]."""
    canvas = Image.fromarray(image)
    draw = ImageDraw.Draw(canvas)
    font, gap = font_of(image.shape[0]), gap_of(image.shape[0])
    for word, (across, down) in zip(words, places, strict=True):
        draw.text(
            (across + gap, down), word, fill=INK, font=font, anchor="lm", stroke_width=2, stroke_fill="white"
        )
    return np.asarray(canvas)
