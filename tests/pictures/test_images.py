"""Pictures and videos are written whole or not at all."""

from __future__ import annotations

import resource
import signal
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import imageio.v2 as imageio
import numpy as np
import pytest
from PIL import Image

from catheter_sim.errors import InputError
from catheter_sim.pictures import images


def colour_frames(count: int, width: int = 64, height: int = 48) -> Iterator[images.Picture]:
    """Yield plain frames that grow brighter."""
    for index in range(count):
        yield np.full((height, width, 3), 40 + 10 * index, dtype=np.uint8)


def test_picture_comes_back_as_it_was(tmp_path: Path) -> None:
    """A PNG loses nothing."""
    image = np.random.default_rng(7).integers(0, 256, (48, 64, 3), dtype=np.uint8)
    images.write_picture(tmp_path / "a.png", image)
    assert np.array_equal(np.asarray(Image.open(tmp_path / "a.png")), image)


@pytest.mark.slow
def test_video_holds_every_frame_in_order(tmp_path: Path) -> None:
    """An MP4 has the frames, their size and their rate, in a format that players know."""
    images.write_video(tmp_path / "a.mp4", colour_frames(12), fps=25, count=12)
    with imageio.get_reader(tmp_path / "a.mp4") as reader:
        meta = reader.get_meta_data()
        frames = [frame.mean() for frame in reader]
    assert meta["codec"] == "h264"
    assert meta["pix_fmt"].startswith("yuv420p")
    assert meta["fps"] == pytest.approx(25)
    assert meta["size"] == (64, 48)
    assert frames == pytest.approx([40 + 10 * index for index in range(12)], abs=4)


def test_one_frame_makes_a_video(tmp_path: Path) -> None:
    """A file of inputs with a single row is still a video."""
    images.write_video(tmp_path / "a.mp4", colour_frames(1), fps=25, count=1)
    with imageio.get_reader(tmp_path / "a.mp4") as reader:
        assert sum(1 for _ in reader) == 1


def test_failure_midway_leaves_nothing_behind(tmp_path: Path) -> None:
    """If a frame cannot be made, neither a video nor a part of one stays in the folder."""

    def failing() -> Iterator[images.Picture]:
        yield from colour_frames(3)
        raise RuntimeError("no more")

    (tmp_path / "old.mp4").write_bytes(b"before")
    with pytest.raises(RuntimeError, match="no more"):
        images.write_video(tmp_path / "old.mp4", failing(), fps=25, count=9)
    assert [path.name for path in tmp_path.iterdir()] == ["old.mp4"]
    assert (tmp_path / "old.mp4").read_bytes() == b"before"


def test_a_signal_while_the_encoder_starts_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is ended before its file is taken away; else it would make the file anew."""
    started: list[subprocess.Popen[bytes]] = []

    class Interrupted(subprocess.Popen[bytes]):
        def __init__(self, *words: Any, **options: Any) -> None:
            super().__init__(*words, **options)
            started.append(self)
            signal.raise_signal(signal.SIGINT)  # before the caller has it

    images.get_ffmpeg_exe()  # tried once by starting it
    monkeypatch.setattr(subprocess, "Popen", Interrupted)
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        images.write_video(tmp_path / "out.mp4", [np.zeros((16, 16, 3), np.uint8)], 10, 1)
    assert signal.getsignal(signal.SIGINT) is before
    assert [process.returncode for process in started] == [-signal.SIGKILL]
    assert list(tmp_path.iterdir()) == []


def test_odd_size_and_missing_folder_are_one_line(tmp_path: Path) -> None:
    """A video of odd height, and a folder that is not there, are input errors that name the file."""
    with pytest.raises(InputError, match=r"a\.mp4: 64 x 47 pixels: .* even"):
        images.write_video(tmp_path / "a.mp4", colour_frames(1, height=47), fps=25, count=1)
    with pytest.raises(InputError, match=r"nowhere/a\.png: cannot be written"):
        images.write_picture(tmp_path / "nowhere" / "a.png", next(colour_frames(1)))
    assert list(tmp_path.iterdir()) == []


@contextmanager
def room(size: int) -> Iterator[None]:
    """Let no file of this process and of those that it starts grow beyond `size` bytes."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize("name", ["a.mp4", "a.png"])
def test_no_room_is_one_line_and_leaves_nothing(tmp_path: Path, name: str) -> None:
    """A disk that is full ends in an error that names the file; half a video or picture is none."""
    frames = np.random.default_rng(7).integers(0, 256, (20, 96, 128, 3), dtype=np.uint8)

    def write() -> None:
        with room(4000):
            if name == "a.mp4":
                images.write_video(tmp_path / name, frames, fps=25, count=20)
            else:
                images.write_picture(tmp_path / name, frames[0])

    with pytest.raises(InputError, match=rf"{name}: .*cannot be written: ") as caught:
        write()
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_a_full_temporary_folder_does_not_matter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A video is encoded where it is to lie; the system's temporary folder is not used."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "nowhere"))
    images.write_video(tmp_path / "a.mp4", colour_frames(3), fps=25, count=3)
    with imageio.get_reader(tmp_path / "a.mp4") as reader:
        assert sum(1 for _ in reader) == 3


@pytest.mark.parametrize(
    ("encoder", "message"),
    [
        ("cat > /dev/null", "not all of its 3 frames are in the file"),
        ("head -c 100 > /dev/null; echo '[x @ 0x1] broken' >&2; exit 3", "broken"),
        ("exit 4", "the encoder ended with status 4"),
        ("kill -9 $$", "the encoder ended by SIGKILL"),
    ],
)
def test_what_the_encoder_leaves_is_checked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, encoder: str, message: str
) -> None:
    """An encoder that fails, or that says nothing and writes nothing: one line, and no video."""
    program = tmp_path / "encoder"
    program.write_text(f"#!/bin/sh\n{encoder}\n")
    program.chmod(0o755)
    monkeypatch.setattr(images, "get_ffmpeg_exe", lambda: str(program))
    with pytest.raises(InputError, match=rf"a\.mp4: the video cannot be written: {message}$"):
        images.write_video(tmp_path / "a.mp4", colour_frames(3), fps=25, count=3)
    assert [path.name for path in tmp_path.iterdir()] == ["encoder"]


def test_an_animation_has_all_frames_their_time_and_runs_for_ever(tmp_path: Path) -> None:
    """Also with odd sides; its colours are the frames'."""
    frames = list(colour_frames(5, width=33))
    images.write_video(tmp_path / "a.gif", frames, fps=25, count=5)
    with Image.open(tmp_path / "a.gif") as shown:
        assert (shown.n_frames, shown.size, shown.info["duration"], shown.info["loop"]) == (
            5,
            (33, 48),
            40,
            0,
        )
        for index, frame in enumerate(frames):
            shown.seek(index)
            assert np.abs(np.asarray(shown.convert("RGB")).astype(int) - frame).max() < 12


def test_frames_of_two_sizes_make_no_video(tmp_path: Path) -> None:
    """Frames are raw bytes to the encoder, which would take a wrong size for noise."""
    frames = [*colour_frames(1), *colour_frames(1, width=32)]
    with pytest.raises(ValueError, match="frame 2 is 32 x 48"):
        images.write_video(tmp_path / "a.mp4", frames, fps=25, count=2)
    with pytest.raises(InputError, match="it has no frames"):
        images.write_video(tmp_path / "a.mp4", [], fps=25, count=0)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["a.jpg", "a", "a.mp4.txt"])
def test_other_kinds_are_refused_with_the_choices(name: str) -> None:
    """Only .png, .mp4 and .gif are written."""
    with pytest.raises(InputError, match=r"choices: \.png, \.mp4, \.gif"):
        images.suffix_of(name)
    assert images.suffix_of("A.MP4") == ".mp4"


@pytest.mark.parametrize("corner", [(0, 0), (0, 1), (1, 0), (1, 1)])
def test_inset_and_caption_stay_in_their_corner(corner: tuple[int, int]) -> None:
    """They change one quarter of the picture and leave the others."""
    plain = np.full((200, 300, 3), 220, dtype=np.uint8)
    small = np.zeros((60, 60, 3), dtype=np.uint8)
    for changed in (
        images.with_inset(plain, small, corner),
        images.with_caption(plain, ["t = 1.00 s", "tension 0.3 N"], corner),
    ):
        rows, columns = np.nonzero((changed != plain).any(axis=2))
        assert len(rows) > 50
        assert {int(row >= 100) for row in rows} == {corner[0]}
        assert {int(column >= 150) for column in columns} == {corner[1]}
