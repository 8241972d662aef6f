"""Remake the pictures and videos of the README and of docs/, and compare them with the stored ones.

    python scripts/docs_pictures.py --check [--only NAME ...] [--jobs 2]
    python scripts/docs_pictures.py --write [--only NAME ...] [--jobs 2]
    python scripts/docs_pictures.py --list

docs/gallery.md is the table: below each picture stand the commands that make it. --check runs
them in an empty folder and measures a perceptual distance to the stored file; the exit status is 1 where one
is farther than its bound. --write replaces files that are farther than their bound, or missing; with --all
also those that look the same. A NAME is a file's, with or without its ending. --list prints the table: file,
pages that show it, commands. What needs a browser is skipped where there is none, and that is said.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import av
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageSequence
from scipy.ndimage import gaussian_filter

from catheter_sim.pictures.images import write_video

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
GALLERY = DOCS / "gallery.md"
LONGEST_S = 1800.0  # of one command
_BLOCK = re.compile(r"^```text\n(.*?)^```$", re.DOTALL | re.MULTILINE)
_SHOWN = re.compile(r"!\[[^]]*\]\(([^)\s]+)\)|(?:src|poster)=\"([^\"]+\.(?!js)\w+)\"")
_BROWSER = "look_at_pages.py"  # a command that needs Chromium

# ----------------------------------------------------------------------------------------------------
# The table: which files there are, by which commands, on which pages.


@dataclass(frozen=True)
class Row:
    """What one block of commands makes.

    Attributes:
        files: stored files, relative to docs/.
        commands: in order, as on the page.
    """

    files: tuple[str, ...]
    commands: tuple[str, ...]

    @property
    def missing(self) -> str:
        """Return what this machine lacks to run the commands, "" for nothing."""
        if not any(_BROWSER in command for command in self.commands):
            return ""
        if find_spec("playwright") is None:
            return "playwright is missing"
        found = any(map(shutil.which, ("chromium", "google-chrome")))
        return "" if found else "Chromium is missing"


def table(text: str | None = None) -> list[Row]:
    """Return the rows of the gallery, or of another page's text: one for each part that has commands.

    Raises:
        ValueError: a part shows pictures without commands, or has commands and shows nothing.
    """
    text = GALLERY.read_text(encoding="utf-8") if text is None else text
    rows = []
    for part in re.split(r"^#+ ", text, flags=re.MULTILINE):
        files = tuple(dict.fromkeys(name for names in _SHOWN.findall(part) for name in names if name))
        lines = "".join(_BLOCK.findall(part))
        commands = tuple(re.sub(r"\s*\\\n\s*", " ", lines).strip().splitlines())
        if bool(files) != bool(commands):
            raise ValueError(f"{part.splitlines()[0]}: pictures and commands that make them stand together")
        if files:
            rows.append(Row(files, commands))
    return rows


def pages_that_show() -> dict[Path, list[str]]:
    """Return the pictures and videos of this repository that pages show, and which pages, from the root."""
    found: dict[Path, list[str]] = {}
    for page in [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]:
        for markdown, html in _SHOWN.findall(page.read_text(encoding="utf-8")):
            path = (page.parent / (markdown or html)).resolve()
            names = found.setdefault(path, [])
            name = page.relative_to(ROOT).as_posix()
            if name not in names:
                names.append(name)
    return found


# ----------------------------------------------------------------------------------------------------
# How far two pictures are apart for an eye.
#
# Structural similarity (Wang 2004, Eq. 13) of slightly blurred pictures, on grey and on two differences of
# colours. A robot is a small part of its picture: only the worst places count, not the mean.

# Measured at 1280 x 720 with three robots: another rasteriser (Mesa's softpipe) or no smoothing of edges
# gives at most 0.004, inputs that are 1 % smaller 0.07 to 1, 3 % smaller 0.48 to 1.
BOUND = 0.05
VIDEO_BOUND = 0.2  # of a video: compression alone, at `_LOSS`, moves colours by up to 0.08
BROWSER_BOUND = 0.5  # of a screenshot: letters of another font's version, assumed
_BLUR_PX = 2.0  # at `_WIDTH_PX`: hides how edges are smoothed
_WINDOW_PX = 6.0  # standard deviation of the window
_WIDTH_PX = 640  # wider pictures are made smaller first
_WORST = 0.005  # share of the picture that counts
_C1, _C2 = (0.01 * 255.0) ** 2, (0.03 * 255.0) ** 2  # Wang 2004
_FRAMES = 5  # of a video that are compared

Picture = NDArray[np.uint8]  # shape (height, width, 3)


def distance(one: Picture, other: Picture) -> float:
    """Return how far two pictures are apart, 0 (alike) to 1; 1 where their shapes differ."""
    if one.shape != other.shape:
        return 1.0
    first, second = _channels(one), _channels(other)
    unlike = np.max([1.0 - _similarity(a, b) for a, b in zip(first, second, strict=True)], axis=0)
    count = max(1, round(_WORST * unlike.size))
    return float(np.clip(np.partition(unlike, -count, axis=None)[-count:].mean(), 0.0, 1.0))


def _channels(image: Picture) -> list[NDArray[np.float64]]:
    """Return grey and two differences of colours, blurred, of a picture of at most `_WIDTH_PX`."""
    step = max(1, round(image.shape[1] / _WIDTH_PX))
    rows, columns = (side // step for side in image.shape[:2])
    parts = image[: rows * step, : columns * step].astype(float).reshape(rows, step, columns, step, 3)
    red, green, blue = np.moveaxis(parts.mean(axis=(1, 3)), 2, 0)
    return [
        gaussian_filter(values, _BLUR_PX)
        for values in ((red + green + blue) / 3.0, 0.5 * (red - green), 0.5 * (blue - green))
    ]


def _similarity(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the local structural similarity, shape (rows, columns), Wang 2004, Eq. 13."""
    mean_a, mean_b, aa, bb, ab = (
        gaussian_filter(values, _WINDOW_PX) for values in (a, b, a * a, b * b, a * b)
    )
    var_a, var_b, covariance = aa - mean_a**2, bb - mean_b**2, ab - mean_a * mean_b
    light = (2.0 * mean_a * mean_b + _C1) / (mean_a**2 + mean_b**2 + _C1)
    return light * (2.0 * covariance + _C2) / (np.maximum(var_a + var_b, 0.0) + _C2)


def frames_of(path: Path) -> tuple[int, list[Picture]]:
    """Return how many frames a picture or video has, and some of them, first and last among them."""
    if path.suffix == ".mp4":
        with av.open(str(path)) as file:
            every = list(file.decode(video=0))
        return len(every), [every[k].to_ndarray(format="rgb24") for k in _some(len(every))]
    with Image.open(path) as file:
        count = getattr(file, "n_frames", 1)
        shown = []
        for k in _some(count):
            file.seek(k)
            shown.append(np.asarray(file.convert("RGB")))
    return count, shown


def _some(count: int) -> list[int]:
    return sorted({round(share * (count - 1)) for share in np.linspace(0.0, 1.0, _FRAMES)})


def files_apart(one: Path, other: Path) -> float:
    """Return the largest distance of two files' frames; 1 where one has more frames than the other."""
    (count, frames), (others_count, others) = frames_of(one), frames_of(other)
    if count != others_count:
        return 1.0
    return max(distance(a, b) for a, b in zip(frames, others, strict=True))


# ----------------------------------------------------------------------------------------------------
# Pictures remade and compared.

_LOSS = 18  # of a stored video, 0 (none) to 51: about half the size that `render` writes


_EVERY, _GIF_FPS = 4, 6  # frames of a stored GIF: each fourth, a little faster than `render` plays them


def keep(path: Path, stored: Path) -> None:
    """Copy a file into the form in which it is stored: videos and GIFs become smaller."""
    if path.suffix == ".mp4":
        _compress(path, stored)
    elif path.suffix == ".gif":
        with Image.open(path) as file:
            frames = [np.asarray(frame.convert("RGB")) for frame in ImageSequence.Iterator(file)][::_EVERY]
        write_video(stored, frames, _GIF_FPS, len(frames))
    else:
        shutil.copyfile(path, stored)


def _compress(path: Path, stored: Path) -> None:
    """Store a video more tightly than it was written, its colours named as before."""
    with av.open(str(path)) as file, av.open(str(stored), "w", format="mp4") as out:
        read = file.streams.video[0]
        options = {"crf": f"{_LOSS}", "preset": "slow"}
        stream = out.add_stream("libx264", rate=read.average_rate, options=options)
        stream.width, stream.height, stream.pix_fmt = read.width, read.height, "yuv420p"
        for name in ("colorspace", "color_primaries", "color_trc", "color_range"):
            setattr(stream.codec_context, name, getattr(read.codec_context, name))
        for number, frame in enumerate(file.decode(read)):
            frame.pts, frame.time_base = number, 1 / read.average_rate
            frame.pict_type = 0  # what it was in the other file does not matter
            out.mux(stream.encode(frame))
        out.mux(stream.encode())


def remake(row: Row, folder: Path) -> dict[str, Path]:
    """Run a row's commands in `folder`; return the files made, by their names in docs/.

    Raises:
        RuntimeError: a command failed, or made no such file; the message has what it said.
    """
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])}
    for command in row.commands:
        ran = subprocess.run(
            list(_words(command)),
            cwd=folder,
            env=environment,
            capture_output=True,
            text=True,
            timeout=LONGEST_S,
        )
        if ran.returncode:
            raise RuntimeError(f"$ {command}\n{ran.stdout}{ran.stderr}")
    made = {name: next(folder.rglob(Path(name).name), None) for name in row.files}
    absent = [name for name, path in made.items() if path is None]
    if absent:
        raise RuntimeError(f"$ {row.commands[-1]}\nmade no {', '.join(absent)}")
    return {name: path for name, path in made.items() if path is not None}


def _words(command: str) -> Iterator[str]:
    """Yield a command's words as they are run: by this Python, this repository's files by their paths."""
    for number, word in enumerate(shlex.split(command)):
        if number == 0 and word == "catheter-sim":
            yield from (sys.executable, "-m", "catheter_sim")
        elif number == 0 and word == "python":
            yield sys.executable
        elif word.startswith(("scripts/", "docs/")):
            yield str(ROOT / word)
        else:
            yield word


def bound_of(row: Row, name: str) -> float:
    """Return the distance from which a row's file counts as changed."""
    if name.endswith(".mp4"):
        return VIDEO_BOUND
    return BROWSER_BOUND if any(_BROWSER in command for command in row.commands) else BOUND


def treat(row: Row, write: bool, every: bool = False, docs: Path = DOCS) -> tuple[int, str]:
    """Check a row or write it; return how many of its files are not as stored, and lines that say so."""
    names = ", ".join(row.files)
    if row.missing:
        return 0, f"{names}: skipped: {row.missing}"
    begun, lines, wrong = time.monotonic(), [], 0
    with tempfile.TemporaryDirectory() as folder:
        try:
            made = remake(row, Path(folder))
        except (RuntimeError, subprocess.TimeoutExpired) as error:
            return len(row.files), f"{names}: FAILED: {error}"
        took_s = time.monotonic() - begun
        for name, path in made.items():
            stored, kept = docs / name, Path(folder) / f"kept_{path.name}"
            keep(path, kept)
            apart = files_apart(kept, stored) if stored.is_file() else 1.0
            far = apart > bound_of(row, name)
            says = "CHANGED" if far else "as stored"
            if write and (far or every):
                stored.parent.mkdir(exist_ok=True)
                shutil.copyfile(kept, stored)
                says = "written"
            wrong += far and not write
            lines.append(f"{name}: {says}, distance {apart:.3f}, {took_s:.0f} s")
    return wrong, "\n".join(lines)


def chosen(rows: Sequence[Row], only: Sequence[str]) -> list[Row]:
    """Return the rows that make a file of these names; all where there are none.

    Raises:
        SystemExit: with 2, where no row makes a named file.
    """
    found = []
    for name in only:
        of_name = [
            row for row in rows if any(name in (Path(file).name, Path(file).stem) for file in row.files)
        ]
        if not of_name:
            choices = ", ".join(Path(file).name for row in rows for file in row.files)
            print(f"docs_pictures: --only {name}: choices: {choices}", file=sys.stderr)
            raise SystemExit(2)
        found += [row for row in of_name if row not in found]
    return found or list(rows)


def main() -> int:
    """Check, write or list; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--check", action="store_true", help="compare with what is stored")
    what.add_argument("--write", action="store_true", help="replace what has changed")
    what.add_argument("--list", action="store_true", help="print the table")
    parser.add_argument("--only", metavar="NAME", nargs="+", default=[], help="files to treat; default all")
    parser.add_argument("--all", action="store_true", help="with --write: replace what looks the same, too")
    parser.add_argument("--jobs", type=int, default=1, help="rows at a time; default 1")
    options = parser.parse_args()
    rows = chosen(table(), options.only)
    if options.list:
        pages = pages_that_show()
        for row in rows:
            for name in row.files:
                print(f"{name}: {', '.join(pages.get(DOCS / name, ['no page']))}")
            print("".join(f"    {command}\n" for command in row.commands), end="")
        return 0
    wrong = 0
    with ThreadPoolExecutor(max(1, options.jobs)) as pool:
        for count, lines in pool.map(lambda row: treat(row, options.write, options.all), rows):
            wrong += count
            print(lines, flush=True)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
