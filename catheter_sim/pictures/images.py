"""Pictures and what they are read by: the backend, cameras, drawn tendons, files, scale and legend."""

from __future__ import annotations

import atexit
import importlib
import math
import os
import sys
import warnings
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image, ImageDraw, ImageFont

from catheter_sim.arrays import Array
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError, unknown
from catheter_sim.files import placed_when_whole
from catheter_sim.mjcf.names import tendon as tendon_name
from catheter_sim.modelling.build import View
from catheter_sim.platforms import BACKEND_VARIABLE, no_context, offscreen_backend, require_mujoco
from catheter_sim.progress import counted
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.tables import replaced_when_whole

if TYPE_CHECKING:
    from av.filter import Graph

# ----------------------------------------------------------------------------------------------------
# An OpenGL context without a screen: which backend, and one line where there is none.
#
# MuJoCo picks its backend from the environment variable `MUJOCO_GL` once, as `mujoco` is imported, and
# takes a window where it is unset. Here an unset variable means EGL on Linux and CGL on macOS, also where
# `mujoco` was imported long before. The variable itself is left alone: `MUJOCO_GL=egl` breaks `import mujoco`
# on a machine without an EGL library, which needs none to simulate.
#
# OpenGL does not survive a fork: the child of a process that has drawn would wait forever for threads that
# only its parent has. It gets an error instead.

SMALLEST_SIDE, LARGEST_SIDE = 16, 4096  # of a picture [pixels]
_drew: set[int] = set()  # numbers of the processes that have drawn: this one, and those it was forked from


def open_renderer(model: mujoco.MjModel, width: int, height: int) -> mujoco.Renderer:
    """Return an offscreen renderer for pictures of `width` x `height` pixels; close it after use.

    The model's offscreen buffer is enlarged where the picture needs it.

    Raises:
        InputError: the size is no picture's, no OpenGL context can be had, or the process was forked from one
            that has drawn. What is opened raises the last too, where a fork took it along.
    """
    if _drew - {os.getpid()}:
        raise _forked()
    require_mujoco()
    for name, value in (("width", width), ("height", height)):
        if not SMALLEST_SIDE <= value <= LARGEST_SIDE:
            limits = f"{SMALLEST_SIDE} to {LARGEST_SIDE}"
            raise InputError(f"{name} = {value}: a picture has {limits} pixels a side")
    model.vis.global_.offwidth = max(model.vis.global_.offwidth, width)
    model.vis.global_.offheight = max(model.vis.global_.offheight, height)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # GLFW warns; what follows says it in one line
            _choose_backend()
            return _renderer_class()(model, height, width)
    except Exception as error:  # ctypes, PyOpenGL and MuJoCo each raise classes of their own
        raise no_context(error) from None


@cache
def _renderer_class() -> type[mujoco.Renderer]:
    import mujoco

    class Renderer(mujoco.Renderer):
        """MuJoCo's, but that it raises in a forked child, where MuJoCo's would hang."""

        def __init__(self, *arguments: Any) -> None:
            self._process = os.getpid()
            super().__init__(*arguments)
            _drew.add(self._process)

        def render(self, **arguments: Any) -> Any:
            if self._process != os.getpid():
                raise _forked()
            return super().render(**arguments)

        def close(self) -> None:
            if self._process == os.getpid():
                super().close()

    return Renderer


def _forked() -> InputError:
    at_exit = getattr(sys.modules.get("mujoco.egl"), "_terminate_display", None)
    if at_exit is not None:  # it would hang as well
        atexit.unregister(at_exit)
    return InputError(
        "cannot draw: this process was forked from one that has drawn; start it with context='spawn' "
        "(AsyncVectorEnv, multiprocessing)"
    )


def _choose_backend() -> None:
    """Let `mujoco.Renderer` use the backend that `MUJOCO_GL` names now, or the system's."""
    import mujoco

    setting = os.environ.get(BACKEND_VARIABLE)
    wanted = (setting or "").strip().lower() or offscreen_backend()
    module = sys.modules[mujoco.Renderer.__module__].gl_context  # where it takes `GLContext` from
    present = getattr(getattr(module, "GLContext", None), "__module__", "")
    if not wanted or present == f"mujoco.{wanted}":
        return
    os.environ[BACKEND_VARIABLE] = wanted
    try:
        importlib.reload(module)
    finally:
        if setting is None:
            del os.environ[BACKEND_VARIABLE]
        else:
            os.environ[BACKEND_VARIABLE] = setting


# ----------------------------------------------------------------------------------------------------
# Where a camera sees a point: a pinhole camera as a projection matrix, of no model's.
#
# Image coordinates: u to the right and v down, in pixels, from the picture's top left corner; the pixel in
# column c and row r covers c <= u < c + 1 and r <= v < r + 1, so its centre is at (c + 0.5, r + 0.5).


@dataclass(frozen=True)
class PinholeCamera:
    """A camera that looks along its -z axis, +x to the right of the picture and +y up.

    Attributes:
        p_w: where it stands, shape (3,) [m].
        R_wc: its axes in the base frame as columns, shape (3, 3).
        fovy_rad: angle between the picture's top and bottom edge [rad].
        width, height: of the picture [pixels]; pixels are square.
    """

    p_w: Array
    R_wc: Array
    fovy_rad: float
    width: int
    height: int


def projection_matrix(camera: PinholeCamera) -> Array:
    """Return P, shape (3, 4), with P (x, y, z, 1) = w (u, v, 1) for a point in the base frame [m]."""
    focal = camera.height / 2.0 / math.tan(camera.fovy_rad / 2.0)
    intrinsic = np.array(
        [
            [focal, 0.0, -camera.width / 2.0],
            [0.0, -focal, -camera.height / 2.0],
            [0.0, 0.0, -1.0],  # depth is along -z
        ]
    )
    R_cw = camera.R_wc.T
    return intrinsic @ np.column_stack([R_cw, -R_cw @ camera.p_w])


def project(matrix: Array, points: Array) -> Array:
    """Return the image coordinates (u, v) of `points`, shape (n, 3) [m], as shape (n, 2) [pixels]."""
    image = np.asarray(points) @ matrix[:, :3].T + matrix[:, 3]
    return image[:, :2] / image[:, 2:]


# ----------------------------------------------------------------------------------------------------
# Tendons in the colours of their tension, stretch by stretch: friction shows as it falls along them.

TENSION_COLOURS = ((0.45, 0.50, 0.58), (0.98, 0.78, 0.10), (0.82, 0.05, 0.08))  # slack, half, full
MEASURED = np.array([0.0, 0.45, 0.70, 1.0], np.float32)  # blue: no tension has it
WIDER = 1.6  # what is drawn over a tendon's own drawing
NO_TENSION = 4e-3  # of what is drawn in the last colour: less is one of its 256 steps, and none


def tension_colours(share: ArrayLike) -> NDArray[np.float32]:
    """Return a colour for each tension, shape (*, 4): red, green, blue, opacity from 0 to 1.

    From grey through yellow to red.

    Args:
        share: tensions over what counts as full, shape (*); below 0 is shown as 0, above 1 as 1, NaN as 0.
    """
    place = np.clip(np.nan_to_num(np.asarray(share, float), nan=0.0), 0.0, 1.0)
    stops = np.linspace(0.0, 1.0, len(TENSION_COLOURS))
    channels = [np.interp(place, stops, column) for column in zip(*TENSION_COLOURS, strict=True)]
    return np.stack([*channels, np.ones_like(place)], axis=-1).astype(np.float32)


@dataclass(frozen=True)
class PulledTendons:
    """The tendons of a model that actuators pull and that are drawn as straight stretches.

    Attributes:
        pulls: actuator and tendon of each.
        rows: each one's place among the robot's tendons; -1: none of them (a pair's antagonist).
        groups: the tendons of each group that share holes, as places in `pulls`; a tendon alone has none.
    """

    pulls: tuple[tuple[int, int], ...]
    rows: tuple[int, ...]
    groups: tuple[tuple[int, ...], ...] = ()


def pulled_tendons(model: mujoco.MjModel, robot: RobotSpec) -> PulledTendons:
    """Return the pulled tendons of a robot's model."""
    pulling = np.flatnonzero(model.actuator_trntype == int(mujoco.mjtTrn.mjTRN_TENDON))
    sites = model.wrap_type[model.tendon_adr] == int(mujoco.mjtWrap.mjWRAP_SITE)
    pulls = tuple(
        (int(actuator), int(model.actuator_trnid[actuator, 0]))
        for actuator in pulling
        if sites[model.actuator_trnid[actuator, 0]]
    )
    names = [tendon_name(tendon.name) for tendon in robot.tendons]
    rows = tuple(
        names.index(name) if name in names else -1
        for name in (model.tendon(tendon).name for _, tendon in pulls)
    )
    return PulledTendons(pulls, rows, _sharing(model, [tendon for _, tendon in pulls]))


def _sharing(model: mujoco.MjModel, tendons: Sequence[int]) -> tuple[tuple[int, ...], ...]:
    """Return groups of `tendons` that overlap in a hole by more than a tendon's radius, as places in it."""
    holes = []
    for tendon in tendons:
        first, count = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
        sites = model.wrap_objid[first : first + count]
        holes.append((model.site_bodyid[sites], model.site_pos[sites]))
    group = list(range(len(tendons)))
    for one, two in combinations(range(len(tendons)), 2):
        (bodies, places), (others, there) = holes[one], holes[two]
        apart = np.linalg.norm(places[:, np.newaxis] - there, axis=2)
        near = apart < min(model.tendon_width[tendons[one]], model.tendon_width[tendons[two]])
        if (near & (bodies[:, np.newaxis] == others)).any():
            group = [group[one] if item == group[two] else item for item in group]
    shared = {number: tuple(np.flatnonzero(np.equal(group, number)).tolist()) for number in group}
    return tuple(members for members in shared.values() if len(members) > 1)


def stretch_tensions(simulator: Simulator, pulled: PulledTendons) -> tuple[Array, ...]:
    """Return the tension in every straight stretch of each pulled tendon, base to tip [N]."""
    model, data = simulator.model, simulator.data
    spans = simulator.span_tension()
    result = []
    for (actuator, tendon), row in zip(pulled.pulls, pulled.rows, strict=True):
        stretches = int(model.tendon_num[tendon]) - 1
        known = spans[row][np.isfinite(spans[row])] if row >= 0 else np.zeros(0)
        if not len(known):
            pull = -model.actuator_gear[actuator, 0] * data.actuator_force[actuator]
            known = np.array([max(0.0, float(pull))])
        # More stretches than spans: a run before the base, or two stretches at each joint.
        result.append(known[np.arange(stretches) * len(known) // stretches])
    return tuple(result)


def paint_tendons(
    scene: mujoco.MjvScene,
    model: mujoco.MjModel,
    data: mujoco.MjData,
    pulled: PulledTendons,
    tensions: Sequence[Array],
    full_N: Sequence[float],
) -> None:
    """Add the tendons to `scene` over their own drawing, as far as it has room.

    `full_N` is what is drawn in the last colour, of each tendon [N].
    """
    for (_, tendon), full, tension in zip(pulled.pulls, full_N, tensions, strict=True):
        paint_tendon(
            scene, tendon_path(model, data, tendon), tension / full, WIDER * model.tendon_width[tendon]
        )


def tendon_path(model: mujoco.MjModel, data: mujoco.MjData, tendon: int) -> Array:
    """Return the sites along a tendon as `data` stands, shape (n, 3) [m]."""
    first, count = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
    return np.asarray(data.site_xpos[model.wrap_objid[first : first + count]])


def paint_tendon(
    scene: mujoco.MjvScene, path: Array, share: Array, radius_m: float, moves: Sequence[Array] = ()
) -> None:
    """Add a tendon's stretches to `scene` in the colours of their tensions, each moved by one of `moves`."""
    for k, colour in enumerate(tension_colours(share)):
        if scene.ngeom >= scene.maxgeom:
            return
        move = moves[k] if moves else 0.0
        geom = scene.geoms[scene.ngeom]
        capsule = mujoco.mjtGeom.mjGEOM_CAPSULE
        mujoco.mjv_initGeom(geom, capsule, np.zeros(3), np.zeros(3), np.eye(3).ravel(), colour)
        mujoco.mjv_connector(geom, capsule, radius_m, path[k] + move, path[k + 1] + move)
        scene.ngeom += 1


def paint_points(scene: mujoco.MjvScene, points: Array, radius_m: float) -> None:
    """Add measured points, shape (k, 3) [m], to `scene` as balls, as far as it has room; NaN is missing."""
    for point in points[np.isfinite(points).all(axis=1)]:
        if scene.ngeom >= scene.maxgeom:
            return
        sphere = mujoco.mjtGeom.mjGEOM_SPHERE
        size = np.full(3, radius_m)
        mujoco.mjv_initGeom(scene.geoms[scene.ngeom], sphere, size, point, np.eye(3).ravel(), MEASURED)
        scene.ngeom += 1


# ----------------------------------------------------------------------------------------------------
# Pictures and videos as files, written whole or not at all.

Picture = NDArray[np.uint8]  # shape (height, width, 3)
Place = tuple[int, int]  # left and top edge of what stands in a picture, its margins included [pixels]

PICTURE, VIDEO, ANIMATION = ".png", ".mp4", ".gif"
_LOSS = 10  # of the encoder, 0 (none) to 51
# The numbers of H.273 for how colours are stored: swscale's own matrix, BT.601; sRGB's primaries, and its
# curve as videos name it; luma from 16 to 235.
_COLOURS = {"colorspace": 6, "color_primaries": 1, "color_trc": 1, "color_range": 1}
INK = (40, 48, 60)
_FRAME = 2  # around a smaller picture [pixels]


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

    `count` and `progress` are for the bar on standard error.

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
    """Write `frames` to the file `encoded`; return how many, and the encoder's complaint, "" for none."""
    from av import FFmpegError

    encoder: _Encoder | None = None
    written = 0
    try:
        for frame in frames:
            height, width = frame.shape[:2]
            if encoder is None:
                animation = Path(path).suffix.lower() == ANIMATION
                if not animation:
                    require_even(path, width, height)
                encoder = _Encoder(width, height, fps, encoded, animation)
            if (width, height) != encoder.size:
                raise ValueError(f"frame {written + 1} is {width} x {height}, others are {encoder.size}")
            encoder.take(frame)
            written += 1
        if encoder is None:
            return 0, "it has no frames"
        encoder.end()
    except FFmpegError as error:
        return written, error.strerror or type(error).__name__
    finally:
        if encoder is not None:
            with suppress(FFmpegError):  # what is wrong has been said
                encoder.close()
    return written, ""


class _Encoder:
    """Encodes the pictures which it is given into a file; every method may raise `av.FFmpegError`.

    Attributes:
        size: width and height of the pictures [pixels].
    """

    def __init__(self, width: int, height: int, fps: int, encoded: Path, animation: bool) -> None:
        import av  # takes a tenth of a second, which only a video needs

        self.size = (width, height)
        self._beat = Fraction(1, fps)  # time from picture to picture [s]
        self._given = 0
        self._palette: Graph | None = None
        if animation:
            self._file = av.open(os.fspath(encoded), "w", format="gif", options={"loop": "0"})
            self._stream = self._file.add_stream("gif", rate=fps)
            self._stream.pix_fmt = "pal8"
            self._palette = _palette(width, height, self._beat)
        else:
            self._file = av.open(os.fspath(encoded), "w", format="mp4")
            self._stream = self._file.add_stream("libx264", rate=fps, options={"crf": f"{_LOSS}"})
            self._stream.pix_fmt = "yuv420p"
            self._stream.thread_type = "FRAME"  # slices would cost size
            for name, number in _COLOURS.items():
                setattr(self._stream.codec_context, name, number)
        self._stream.width, self._stream.height = width, height

    def take(self, picture: Picture) -> None:
        """Encode the next picture."""
        from av import VideoFrame

        frame = VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")
        frame.pts, frame.time_base = self._given, self._beat
        self._given += 1
        if self._palette is not None:  # whose colours are chosen when all are there
            self._palette.push(frame)
        else:
            self._file.mux(self._stream.encode(frame.reformat(format="yuv420p", interpolation="BICUBIC")))

    def end(self) -> None:
        """Write what is still held, and close the file."""
        from av import VideoFrame

        if self._palette is not None:
            self._palette.push(None)
            for _ in range(self._given):
                frame = self._palette.pull()
                assert isinstance(frame, VideoFrame)
                self._file.mux(self._stream.encode(frame))
        self._file.mux(self._stream.encode())
        self.close()

    def close(self) -> None:
        """Close the file, whole or not; once is enough."""
        self._file.close()


def _palette(width: int, height: int, beat: Fraction) -> Graph:
    """Return what turns pictures into ones of 256 colours, chosen for what is shown."""
    from av import VideoFormat
    from av.filter import Graph

    graph = Graph()
    given = graph.add_buffer(width=width, height=height, format=VideoFormat("rgb24"), time_base=beat)
    twice, chosen, sink = graph.add("split"), graph.add("palettegen"), graph.add("buffersink")
    drawn = graph.add("paletteuse", "dither=none")
    given.link_to(twice)
    twice.link_to(chosen, 0)
    twice.link_to(drawn, 1, 0)
    chosen.link_to(drawn, 0, 1)
    drawn.link_to(sink)
    graph.configure()
    return graph


def _frames_in(video: Path) -> int:
    """Return how many frames of a video can be decoded, 0 if it is none."""
    import av

    try:
        with av.open(os.fspath(video)) as file:
            file.streams.video[0].thread_type = "AUTO"
            return sum(1 for _ in file.decode(video=0))
    except (av.FFmpegError, IndexError):
        return 0


def in_corner(image: Picture, size: tuple[int, int], corner: tuple[int, int]) -> Place:
    """Return the place of something of a width and height in a corner (row, column: 0 first, 1 last)."""
    height, width = image.shape[:2]
    return (width - size[0] if corner[1] else 0), (height - size[1] if corner[0] else 0)


def inset_size(side: int, height: int) -> tuple[int, int]:
    """Return width and height that `with_inset` takes, margins included, in a picture so high [pixels]."""
    whole = side + 2 * _FRAME + 2 * gap_of(height)
    return whole, whole


def with_inset(image: Picture, inset: Picture, place: Place) -> Picture:
    """Return `image` with a framed smaller picture."""
    result, gap = image.copy(), gap_of(image.shape[0])
    framed = np.pad(inset, ((_FRAME, _FRAME), (_FRAME, _FRAME), (0, 0)), constant_values=150)
    left, top = place[0] + gap, place[1] + gap
    result[top : top + framed.shape[0], left : left + framed.shape[1]] = framed
    return result


def caption_size(lines: Iterable[str], height: int) -> tuple[int, int]:
    """Return width and height that `with_caption` takes, margins included, in a picture so high [pixels]."""
    draw = ImageDraw.Draw(Image.new("L", (1, 1)))
    left, top, right, bottom = draw.multiline_textbbox((0, 0), "\n".join(lines), font=font_of(height))
    return round(right - left) + 2 * gap_of(height), round(bottom - top) + 2 * gap_of(height)


Letters = ImageFont.ImageFont | ImageFont.FreeTypeFont


def _opened(image: Picture) -> tuple[Image.Image, ImageDraw.ImageDraw, Letters, int]:
    """Return a picture to write on, what draws on it, its letters and the margin around them [pixels]."""
    canvas = Image.fromarray(image)
    return canvas, ImageDraw.Draw(canvas), font_of(image.shape[0]), gap_of(image.shape[0])


def font_of(height: int) -> Letters:
    """Return the letters of a picture so high [pixels]."""
    return ImageFont.load_default(max(10, height // 36))


def gap_of(height: int) -> int:
    """Return the margin around what is written into a picture so high [pixels]."""
    return height // 40


def with_caption(image: Picture, lines: Iterable[str], place: Place) -> Picture:
    """Return `image` with lines of text."""
    canvas, draw, font, gap = _opened(image)
    text = "\n".join(lines)
    left, top, _, _ = draw.multiline_textbbox((0, 0), text, font=font)
    draw.multiline_text((place[0] + gap - left, place[1] + gap - top), text, fill=INK, font=font)
    return np.asarray(canvas)


def with_words(image: Picture, words: Iterable[str], places: NDArray[np.float64]) -> Picture:
    """Return `image` with a word beside each of `places`, shape (n, 2) (to the right, down) [pixels]."""
    canvas, draw, font, gap = _opened(image)
    for word, (across, down) in zip(words, places, strict=True):
        draw.text(
            (across + gap, down), word, fill=INK, font=font, anchor="lm", stroke_width=2, stroke_fill="white"
        )
    return np.asarray(canvas)


# ----------------------------------------------------------------------------------------------------
# What a picture is read by: a scale bar, the base frame's axes, and what the colours of tensions mean.

_SHARE = 0.2  # of the picture's height, that a scale bar takes at most
_AXIS = 0.055  # an axis's length over the picture's height
_AXIS_COLOURS = ((176, 48, 48), (46, 125, 60), (40, 84, 168))  # x, y, z
_BAR = (0.018, 0.16)  # width and height of the bar of colours over the picture's height
_AWAY = 0.3  # an axis that points so nearly at the reader (share of its length seen) has no letter


def round_length(longest: float) -> float:
    """Return the longest of 1, 2 and 5 times a power of ten that is no longer than `longest`."""
    power = 10.0 ** math.floor(math.log10(longest))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= longest * (1.0 + 1e-9))


def round_end(largest: float) -> float:
    """Return the least of 1, 2 and 5 times a power of ten that holds `largest`, to a step of the colours."""
    least = largest * (1.0 - NO_TENSION)
    power = 10.0 ** math.floor(math.log10(least))
    return min(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= least)


def scale_size(height: int) -> tuple[int, int]:
    """Return width and height that `with_scale` takes in a picture so high, margins included [pixels]."""
    gap = gap_of(height)
    return round((_SHARE + 3.0 * _AXIS) * height) + 2 * gap, round(2.6 * _AXIS * height) + 2 * gap


def with_scale(image: Picture, view: View, place: Place) -> Picture:
    """Return `image` with a scale bar and the base frame's axes.

    The bar is true in the plane through the view's target; nearer to the camera things are a little larger.
    """
    height = image.shape[0]
    canvas, draw, font, gap = _opened(image)
    left, bottom = place[0] + gap, place[1] + scale_size(height)[1] - gap
    pixels_per_m = height / view.height
    length_mm = round_length(1e3 * _SHARE * height / pixels_per_m)
    end = left + round(1e-3 * length_mm * pixels_per_m)
    thick = max(2, height // 240)
    draw.line([(left, bottom), (end, bottom)], fill=INK, width=thick)
    for at in (left, end):
        draw.line([(at, bottom - 3 * thick), (at, bottom)], fill=INK, width=thick)
    draw.text((left, bottom - 4 * thick), f"{length_mm:g} mm", fill=INK, font=font, anchor="ls")
    middle = (left + round((_SHARE + 1.4 * _AXIS) * height), bottom - round(1.1 * _AXIS * height))
    right, up = view.axes
    for name, colour, direction in zip("xyz", _AXIS_COLOURS, np.eye(3), strict=True):
        way = np.array([direction @ right, -(direction @ up)]) * _AXIS * height
        tip = (middle[0] + way[0], middle[1] + way[1])
        draw.line([middle, tip], fill=colour, width=thick)
        if np.linalg.norm(way) > _AWAY * _AXIS * height:
            place = (middle[0] + 1.35 * way[0], middle[1] + 1.35 * way[1])
            draw.text(place, name, fill=colour, font=font, anchor="mm")
    return np.asarray(canvas)


def legend_size(height: int) -> tuple[int, int]:
    """Return width and height that `with_tension_legend` takes in a picture so high [pixels]."""
    letters, gap = font_of(height).getbbox("tension 00.00 N"), gap_of(height)
    title, bar = _legend_heights(height)
    return round(letters[2]) + 2 * gap, title + bar + round(0.5 * letters[3]) + 2 * gap


def _legend_heights(height: int) -> tuple[int, int]:
    """Return the heights of the legend's title and bar: three figures fit beside the bar [pixels]."""
    letter = font_of(height).getbbox("0 N")[3]
    return round(max(0.05 * height, 1.5 * letter)), round(max(_BAR[1] * height, 2.6 * letter))


def with_tension_legend(image: Picture, full_N: float, place: Place) -> Picture:
    """Return `image` with the colours of tensions from 0 to `full_N`, figures beside them."""
    height = image.shape[0]
    canvas, draw, font, gap = _opened(image)
    left, top = place[0] + gap, place[1] + gap
    draw.text((left, top), "tension", fill=INK, font=font, anchor="lt")
    title, bar_height = _legend_heights(height)
    top, bar_width = top + title, max(4, round(_BAR[0] * height))
    colours = np.round(255 * tension_colours(np.linspace(1.0, 0.0, bar_height))[:, :3]).astype(np.uint8)
    bar = np.repeat(colours[:, np.newaxis], bar_width, axis=1)
    canvas.paste(Image.fromarray(bar), (left, top))
    beside = left + bar_width + gap // 2
    for share in (1.0, 0.5, 0.0):
        at = top + round((1.0 - share) * (bar_height - 1))
        draw.text((beside, at), f"{share * full_N:.3g} N", fill=INK, font=font, anchor="lm")
    return np.asarray(canvas)
