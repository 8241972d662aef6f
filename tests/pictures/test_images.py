"""Pictures and videos are written whole or not at all."""

from __future__ import annotations

import errno
import signal
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import av
import imageio.v3 as imageio
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
    meta = imageio.immeta(tmp_path / "a.mp4", plugin="pyav")
    frames = imageio.imread(tmp_path / "a.mp4", plugin="pyav")
    assert meta["codec"] == "h264"
    assert meta["video_format"] == "yuv420p"
    assert meta["fps"] == pytest.approx(25)
    assert frames.shape == (12, 48, 64, 3)
    assert frames.mean(axis=(1, 2, 3)) == pytest.approx([40 + 10 * index for index in range(12)], abs=4)


def test_a_videos_colours_are_the_frames_and_it_says_how_they_are_stored(tmp_path: Path) -> None:
    """Colours by BT.601's matrix; without its name players would take a large picture's for BT.709."""
    colours = np.array([[200, 40, 40], [40, 160, 60], [40, 60, 200], [230, 210, 40]], dtype=np.uint8)
    frames = [np.broadcast_to(colour, (48, 64, 3)) for colour in colours]
    images.write_video(tmp_path / "a.mp4", frames, fps=25, count=4)
    shown = imageio.imread(tmp_path / "a.mp4", plugin="pyav")
    assert np.abs(shown.astype(int) - colours[:, None, None]).max() <= 4
    with av.open(str(tmp_path / "a.mp4")) as file:
        coded = file.streams.video[0].codec_context
        assert (coded.colorspace, coded.color_primaries, coded.color_trc, coded.color_range) == (6, 1, 1, 1)


def test_one_frame_makes_a_video(tmp_path: Path) -> None:
    """A file of inputs with a single row is still a video."""
    images.write_video(tmp_path / "a.mp4", colour_frames(1), fps=25, count=1)
    assert len(imageio.imread(tmp_path / "a.mp4", plugin="pyav")) == 1


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


def test_a_signal_while_frames_are_encoded_leaves_nothing(tmp_path: Path) -> None:
    """The encoder's file is closed, and gone."""

    def interrupted() -> Iterator[images.Picture]:
        yield from colour_frames(3)
        signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        images.write_video(tmp_path / "out.mp4", interrupted(), 10, 9)
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
    resource = pytest.importorskip("resource")
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
    assert len(imageio.imread(tmp_path / "a.mp4", plugin="pyav")) == 3


End = Callable[[images._Encoder], None]


def cut(encoder: images._Encoder, end: End) -> None:
    """End as if all were well, with a file that is not whole."""
    end(encoder)
    path = Path(encoder._file.name)
    path.write_bytes(path.read_bytes()[:-200])


def broken(encoder: images._Encoder, end: End) -> None:
    """End with the words of a device that fails."""
    raise av.FFmpegError(errno.EIO, "Input/output error")


def wordless(encoder: images._Encoder, end: End) -> None:
    """Fail, and say nothing."""
    raise av.FFmpegError(errno.EIO, "")


@pytest.mark.parametrize("name", ["a.mp4", "a.gif"])
@pytest.mark.parametrize(
    ("fault", "message"),
    [
        (cut, "not all of its 3 frames are in the file"),
        (broken, "Input/output error"),
        (wordless, "FFmpegError"),
    ],
)
def test_what_the_encoder_leaves_is_checked(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    fault: Callable[[images._Encoder, End], None],
    message: str,
    name: str,
) -> None:
    """An encoder that fails, or whose file is not whole: one line, and no video."""
    end = images._Encoder.end
    monkeypatch.setattr(images._Encoder, "end", lambda encoder: fault(encoder, end))
    with pytest.raises(InputError, match=rf"{name}: the video cannot be written: {message}$"):
        images.write_video(tmp_path / name, colour_frames(3), fps=25, count=3)
    assert list(tmp_path.iterdir()) == []


def test_a_frame_that_is_lost_is_missed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An encoder that takes three frames and writes two."""
    take = images._Encoder.take

    def lossy(encoder: images._Encoder, picture: images.Picture) -> None:
        if picture[0, 0, 0] != 50:
            take(encoder, picture)

    monkeypatch.setattr(images._Encoder, "take", lossy)
    with pytest.raises(InputError, match="not all of its 3 frames are in the file"):
        images.write_video(tmp_path / "a.mp4", colour_frames(3), fps=25, count=3)
    assert list(tmp_path.iterdir()) == []


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
    lines = ["t = 1.00 s", "tension 0.3 N"]
    places = [
        images.in_corner(plain, size, corner)
        for size in (images.inset_size(60, 200), images.caption_size(lines, 200))
    ]
    for changed in (
        images.with_inset(plain, small, places[0]),
        images.with_caption(plain, lines, places[1]),
    ):
        rows, columns = np.nonzero((changed != plain).any(axis=2))
        assert len(rows) > 50
        assert {int(row >= 100) for row in rows} == {corner[0]}
        assert {int(column >= 150) for column in columns} == {corner[1]}
