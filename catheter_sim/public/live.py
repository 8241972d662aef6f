"""A robot that is driven in a browser: the simulation in real time, behind a small server on this machine.

The page (`page/live.html`) draws the robot and has a slider for each input channel. The server answers on one
address, to those who know its token, and serves nothing but the page, the robot's states and what was driven.
"""

from __future__ import annotations

import hmac
import ipaddress
import json
import math
import os
import secrets
import shlex
import socket
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.catalogue import load_robot
from catheter_sim.channels import channel_inputs, drives_of
from catheter_sim.core.inputs import Drive, Inputs
from catheter_sim.core.robot import RobotSpec, whole_of
from catheter_sim.diagnosis.recording import Recording, recording_of
from catheter_sim.diagnosis.shapes import radii_mm
from catheter_sim.effects.apply import built_in, in_force, outside_the_robot
from catheter_sim.errors import InputError, SimulationDiverged, shown
from catheter_sim.page.render import page_json, page_script, rendered
from catheter_sim.public.data import gravity_of, path_of, robot_of
from catheter_sim.simulation.replay import Commands
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.tables import Table
from catheter_sim.units import si_factor
from catheter_sim.viewer import slider_ranges

LOOPBACK = "127.0.0.1"
FRAME_S = 0.03  # a whole number of the models' time steps
RECORD_S = 0.1  # between rows of what was driven
_MOST_ROWS = 100_000  # of these, as of any file of inputs
_MOST_BYTES = 65_536  # of a message from the page
_WAIT_S = 15.0  # for a new state, before a page is told that the server is still there
_LARGEST_TIP_FORCE_N = 1.0
_LARGEST_GRAVITY = 9.81
_ASIDE_RAD = 0.35  # the first view, from straight across the first channel's bending

# ----------------------------------------------------------------------------------------------------
# What may be driven: a slider for each channel, the tip's force and gravity.


@dataclass(frozen=True)
class Slider:
    """One number of the page: its name in files, its range and its step, in the file's unit."""

    name: str
    unit: str
    least: float
    most: float
    step: float


def sliders_of(
    robot: RobotSpec, actuation: str, gravity_mps2: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> tuple[Slider, ...]:
    """Return a slider for each input channel, and for the tip's force and gravity, which holds what is given.

    A channel reaches as far as bends each segment alone by 90 deg, or as its joint goes.
    """
    ranges = slider_ranges(robot, actuation)
    found = []
    for drive in drives_of(robot, actuation):
        unit = si_factor(drive.column)
        ends = [
            np.array([ranges.least[tendon], ranges.most[tendon]]) / part
            for tendon, part in zip(drive.tendons, drive.parts, strict=True)
        ]
        least = max(float(min(pair)) for pair in ends) / unit
        most = min(float(max(pair)) for pair in ends) / unit
        least, most = max(least, drive.least / unit), min(most, drive.most / unit)
        found.append(_slider(drive.column, least, most))
    for axis in "xyz":
        found.append(_slider(f"force_tip_{axis}_N", -_LARGEST_TIP_FORCE_N, _LARGEST_TIP_FORCE_N))
    largest = max(_LARGEST_GRAVITY, *map(abs, gravity_mps2))
    for axis in "xyz":
        found.append(_slider(f"gravity_{axis}_mps2", -largest, largest))
    return tuple(found)


def _slider(name: str, least: float, most: float) -> Slider:
    size = 10.0 ** math.floor(math.log10(max(abs(least), abs(most), 1e-9)))
    step = size / 1000.0
    ends = (math.ceil(least / step) * step, math.floor(most / step) * step)
    return Slider(name, name.rpartition("_")[2], float(f"{ends[0]:.6g}"), float(f"{ends[1]:.6g}"), step)


# ----------------------------------------------------------------------------------------------------
# The robot in real time: what is asked of it, where it is, what was driven.


@dataclass(frozen=True)
class Played:
    """A file of inputs that is played: its rows, and points that were measured beside them.

    Attributes:
        name: of the file.
        inputs: its rows, as they were commanded.
        arriving: what reaches the robot of them, through effects on the inputs.
        values: of the channels at the rows, as commanded, shape (r, c), in file units.
        points: shape (r, k, 3) [m]; None: nothing was measured.
    """

    name: str
    inputs: Inputs
    arriving: Commands
    values: Array
    points: Array | None = None


@dataclass
class LiveRobot:
    """A robot that is simulated in real time, or as fast as it goes.

    Attributes:
        robot: with its effects built in.
        gravity_mps2: at first, shape (3,).
        played: what may be played; its inputs are the robot's.
        command: how a command line names the robot, quoted: id or file, and settings; "": by its name.
        outside: effects that act before or after the robot, so that a slider does not have them.
        state: of the robot, as the page reads it; `number` counts them.
    """

    robot: RobotSpec
    gravity_mps2: tuple[float, float, float] = (0.0, 0.0, 0.0)
    played: Played | None = None
    command: str = ""
    outside: tuple[str, ...] = ()
    state: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        actuation = None if self.played is None else self.played.inputs.actuation
        self.simulator = Simulator(self.robot, actuation, gravity_mps2=self.gravity_mps2)
        self.drives: tuple[Drive, ...] = tuple(drives_of(self.robot, self.simulator.actuation))
        self.sliders = {item.name: item for item in self._sliders()}
        self.rest = dict.fromkeys(self.sliders, 0.0)
        for axis, value in zip("xyz", self.gravity_mps2, strict=True):
            self.rest[f"gravity_{axis}_mps2"] = value
        self.values = dict(self.rest)
        self.rows: list[tuple[float, dict[str, float]]] = []
        self.time_s = 0.0
        self._play_s = 0.0  # place in what is played
        self._by_hand, self._speed, self._running = True, 1.0, False
        self._changed = threading.Condition()
        self._number = 0
        self.failure = ""
        self._show()

    def _sliders(self) -> tuple[Slider, ...]:
        return sliders_of(self.robot, self.simulator.actuation, self.gravity_mps2)

    def ask(self, message: Mapping[str, Any]) -> None:
        """Take what a page asks for: `set`, `reset`, `play`.

        Raises:
            InputError: it asks for something else, or for no number.
        """
        with self._changed:
            for key, value in message.items():
                if key == "set" and isinstance(value, Mapping):
                    self._set(value)
                elif key == "reset" and value is True:
                    self._reset()
                elif key == "play" and isinstance(value, Mapping):
                    self._play(value)
                else:
                    raise InputError(f"{shown(key)}: choices: set, reset, play")

    def _set(self, values: Mapping[str, Any]) -> None:
        for name, value in values.items():
            slider = self.sliders.get(str(name))
            if slider is None:
                raise InputError(f"{shown(name)}: choices: {', '.join(self.sliders)}")
            if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
                raise InputError(f"{name}: a finite number is needed")
            self.values[slider.name] = min(max(float(value), slider.least), slider.most)
        self._by_hand, self._running = True, False

    def _reset(self) -> None:
        self.values = dict(self.rest)
        self.rows, self.time_s, self.failure = [], 0.0, ""
        self._play_s, self._by_hand, self._running = 0.0, True, False
        self.simulator.model.opt.gravity[:] = self.gravity_mps2
        self.simulator.reset()

    def _play(self, how: Mapping[str, Any]) -> None:
        if self.played is None:
            raise InputError("play: no file of inputs was given")
        numbers = {name: how.get(name) for name in ("at_s", "speed")}
        for name, value in numbers.items():
            if value is not None and (isinstance(value, bool) or not isinstance(value, int | float)):
                raise InputError(f"play: {name}: a number is needed")
        if numbers["at_s"] is not None:
            self._play_s = min(max(float(numbers["at_s"]), 0.0), float(self.played.inputs.time_s[-1]))
        if numbers["speed"] is not None:
            self._speed = min(max(float(numbers["speed"]), 0.05), 20.0)
        self._running = how.get("running", self._running) is True
        self._by_hand = False
        if self._running and self._play_s >= float(self.played.inputs.time_s[-1]):
            self._play_s = 0.0

    def advance(self) -> None:
        """Simulate one frame.

        Raises:
            SimulationDiverged: it did.
        """
        with self._changed:
            self._take_played()
            simulator = self.simulator
            steps = max(1, round(FRAME_S / simulator.model.opt.timestep))
            simulator.model.opt.gravity[:] = [self.values[f"gravity_{axis}_mps2"] for axis in "xyz"]
            if self.played is None or self._by_hand:
                force = np.array([self.values[f"force_tip_{axis}_N"] for axis in "xyz"])
                simulator.set_inputs(self._tendon(), force)
            else:
                arriving = self.played.arriving
                arriving.set(simulator, arriving.means(np.array([self._play_s]), FRAME_S)[0])
            simulator.step(steps)
            simulator.require_finite()
            self.time_s += FRAME_S
            if len(self.rows) < _MOST_ROWS and self.time_s >= len(self.rows) * RECORD_S:
                self.rows.append((round(self.time_s, 3), self._driven()))
            self._show()
            self._changed.notify_all()

    def _tendon(self) -> Array:
        found = np.zeros(len(self.robot.tendons))
        for drive in self.drives:
            value = self.values[drive.column] * si_factor(drive.column)
            found[list(drive.tendons)] = value * np.array(drive.parts)
        return found

    def _driven(self) -> dict[str, float]:
        return {name: value for name, value in self.values.items() if not name.startswith("gravity_")}

    def _take_played(self) -> None:
        if self.played is None or self._by_hand:
            return
        clock = self.played.inputs.time_s
        for column, drive in enumerate(self.drives):
            self.values[drive.column] = float(np.interp(self._play_s, clock, self.played.values[:, column]))
        for axis, letter in enumerate("xyz"):
            force = self.played.inputs.force_tip[:, axis]
            self.values[f"force_tip_{letter}_N"] = float(np.interp(self._play_s, clock, force))
        if self._running:
            self._play_s = min(self._play_s + self._speed * FRAME_S, float(clock[-1]))
            self._running = self._play_s < float(clock[-1])

    def _show(self) -> None:
        posture = self.simulator.posture()
        seen = None
        if self.played is not None and self.played.points is not None and not self._by_hand:
            clock = self.played.inputs.time_s
            flat = self.played.points.reshape(len(clock), -1).T
            seen = np.array([np.interp(self._play_s, clock, values) for values in flat]).reshape(-1, 3)
        self._number += 1
        self.state = {
            "number": self._number,
            "time_s": round(self.time_s, 3),
            "shape_mm": _rounded(np.concatenate([np.zeros((1, 3)), posture.p_w])),
            "measured_mm": None if seen is None else _rounded(seen),
            "tension_N": np.round(posture.actuator_tension, 4).tolist(),
            "values": dict(self.values),
            "play_s": self._play_s,
            "running": self._running,
            "failure": self.failure,
        }

    def run(self, stop: threading.Event, clock: Callable[[], float] = time.perf_counter) -> None:
        """Simulate until `stop` is set; a simulation that diverges says so and waits for a reset."""
        due = clock()
        while not stop.is_set():
            if not self.failure:
                try:
                    self.advance()
                except (SimulationDiverged, InputError) as error:
                    with self._changed:
                        self.failure = str(error)
                        self.state = self.state | {"failure": self.failure, "number": self._number + 1}
                        self._number += 1
                        self._changed.notify_all()
            due = max(due + FRAME_S, clock())  # what was late is not caught up
            stop.wait(due - clock())

    def states(self, stop: threading.Event) -> Iterator[dict[str, Any] | None]:
        """Yield each new state; None where none came for some seconds."""
        known = 0
        while not stop.is_set():
            with self._changed:
                if self._number == known:
                    self._changed.wait(_WAIT_S)
                found = self.state if self._number != known else None
                known = self._number
            yield found

    def table(self) -> str:
        """Return what was driven as a CSV that every verb takes."""
        with self._changed:
            rows = list(self.rows) or [(0.0, self._driven())]
        names = [name for name in rows[0][1] if any(row[name] for _, row in rows)]
        names = names or [self.drives[0].column]
        lines = [",".join(["time_s", *names])]
        lines += [",".join([f"{when:g}", *(f"{row[name]:.6g}" for name in names)]) for when, row in rows]
        return "\n".join(lines) + "\n"


def _rounded(points: Array) -> list[list[float | None]]:
    """Return points [m] as lists in mm, to a hundredth; None is missing."""
    return [[round(1e3 * x, 2) if math.isfinite(x) else None for x in point] for point in points.tolist()]


def live_robot(
    specified: RobotSpec,
    gravity_mps2: tuple[float, float, float],
    recording: Recording | None = None,
    name: str = "",
    command: str = "",
) -> LiveRobot:
    """Return a robot to drive, such of its effects built in as act on it; a recording may be played on it.

    `name`: of the recording; `command`: as of `LiveRobot`.

    Raises:
        InputError: the robot cannot be driven.
    """
    if recording is None:
        outside = tuple(outside_the_robot(specified))
        return LiveRobot(built_in(specified, specified.name), gravity_mps2, command=command, outside=outside)
    inputs = recording.inputs
    moving = recording.conditions is not None and recording.conditions[1]
    acting = in_force(specified, inputs, specified.name, moving)
    drives = drives_of(acting.robot, inputs.actuation)
    units = np.array([si_factor(drive.column) for drive in drives])
    values = channel_inputs(acting.robot, inputs) / units
    played = Played(name, inputs, Commands(acting.inputs), values, recording.points_at(inputs.time_s))
    return LiveRobot(acting.robot, gravity_mps2, played, command, tuple(outside_the_robot(acting.specified)))


# ----------------------------------------------------------------------------------------------------
# The server: one address, one token, four answers.


class LiveServer(ThreadingHTTPServer):
    """Serves one live robot to those who know its token."""

    daemon_threads = True

    def __init__(self, live: LiveRobot, host: str = LOOPBACK, port: int = 0) -> None:
        """Bind; `port` 0 takes a free one.

        Raises:
            InputError: the address cannot be had.
        """
        self.live, self.token, self.stop = live, secrets.token_urlsafe(24), threading.Event()
        if ":" in host:
            self.address_family = socket.AF_INET6
        try:
            super().__init__((host, port), _Answers)
        except (OSError, OverflowError) as error:
            raise InputError(f"--host {host}, port {port}: {error}") from None
        self.alone = host == LOOPBACK
        everywhere = host in ("0.0.0.0", "::")
        self.name = socket.gethostname() if everywhere else str(self.server_address[0])
        self.names = {LOOPBACK, "localhost", host, self.name}
        self.page = page_of(live)

    @property
    def address(self) -> str:
        """What to open in a browser."""
        name = f"[{self.name}]" if ":" in self.name else self.name
        return f"http://{name}:{self.server_port}/{self.token}/"

    def knows(self, host: str) -> bool:
        """Return whether a Host header names this server.

        Where others are let in, an address in numbers will do: only a name can be led elsewhere.
        """
        name, _, port = host.rpartition(":")
        if port != str(self.server_port):
            return False
        name = name.removeprefix("[").removesuffix("]")
        return name in self.names or (not self.alone and _is_address(name))

    def begin(self) -> None:
        """Simulate and serve in threads of their own."""
        threading.Thread(target=self.live.run, args=(self.stop,), daemon=True).start()
        threading.Thread(target=self.serve_forever, args=(0.1,), daemon=True).start()

    def end(self) -> None:
        """Free the address."""
        self.stop.set()
        self.shutdown()
        self.server_close()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing: a page that is closed in the middle of an answer is no error."""


def _is_address(text: str) -> bool:
    try:
        ipaddress.ip_address(text)
    except ValueError:
        return False
    return True


class _Answers(BaseHTTPRequestHandler):
    server: LiveServer
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "catheter-sim", ""

    def log_message(self, format: str, *args: Any) -> None:
        """Nothing is logged."""

    def do_GET(self) -> None:
        """Answer with the page, the states or the table."""
        what = self._asked()
        if what == "":
            self._send(self.server.page.encode(), "text/html; charset=utf-8")
        elif what == "driven.csv":
            self._send(self.server.live.table().encode(), "text/csv; charset=utf-8")
        elif what == "states":
            self._stream()
        elif what is not None:
            self._refuse(HTTPStatus.NOT_FOUND)

    def do_POST(self) -> None:
        """Take what the page asks for."""
        what = self._asked()
        if what is None:
            return
        length = self.headers.get("Content-Length", "")
        number = int(length) if length.isascii() and length.isdigit() else _MOST_BYTES + 1
        if what != "ask" or number > _MOST_BYTES:
            self._refuse(HTTPStatus.NOT_FOUND if what != "ask" else HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
            return
        try:
            message = json.loads(self.rfile.read(number))
            if not isinstance(message, dict):
                raise InputError("a JSON object is needed")
            self.server.live.ask(message)
        except (ValueError, RecursionError, InputError) as error:
            self._send(f"{error}\n".encode(), "text/plain; charset=utf-8", HTTPStatus.BAD_REQUEST)
            return
        self._send(b"", "text/plain; charset=utf-8", HTTPStatus.OK)

    def _asked(self) -> str | None:
        """Return what of the server is asked for; None: it was refused."""
        origin = self.headers.get("Origin")
        known = self.server.knows(self.headers.get("Host", ""))
        if known and origin is not None:
            scheme, _, place = origin.partition("://")
            known = scheme == "http" and self.server.knows(place)
        if not known:
            self._refuse(HTTPStatus.FORBIDDEN)
            return None
        first, _, rest = self.path.removeprefix("/").partition("/")
        if not hmac.compare_digest(first.encode(), self.server.token.encode()):
            self._refuse(HTTPStatus.FORBIDDEN)
            return None
        return rest

    def _refuse(self, status: HTTPStatus) -> None:
        self.close_connection = True
        self._send(f"{status.phrase}\n".encode(), "text/plain; charset=utf-8", status)

    def _send(self, content: bytes, kind: str, status: HTTPStatus = HTTPStatus.OK) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(content)))
        self._guard()
        self.end_headers()
        self.wfile.write(content)

    def _guard(self) -> None:
        self.send_header("Cache-Control", "no-store")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("X-Frame-Options", "DENY")
        self.send_header("Referrer-Policy", "no-referrer")
        self.send_header(
            "Content-Security-Policy",
            "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; connect-src 'self'; "
            "img-src data: blob:",
        )

    def _stream(self) -> None:
        """Send states as they come (server-sent events)."""
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", "text/event-stream")
        self._guard()
        self.close_connection = True
        self.end_headers()
        for state in self.server.live.states(self.server.stop):
            text = ":\n\n" if state is None else f"data: {json.dumps(state)}\n\n"
            self.wfile.write(text.encode())
            self.wfile.flush()


def reach_mm(shape_mm: Sequence[Sequence[float]]) -> float:
    """Return how far the farthest point of a shape is from the base [mm]."""
    return max(math.hypot(*point) for point in shape_mm)


def turn_rad(drives: Sequence[Drive]) -> float:
    """Return the turn about z from which the first drive's bending is seen, nearly from the side [rad]."""
    sides = [drive.side for drive in drives if any(drive.side)] or [(1.0, 0.0)]
    return math.atan2(sides[0][1], sides[0][0]) + _ASIDE_RAD


def page_of(live: LiveRobot) -> str:
    """Return the page of a live robot: one HTML text that loads nothing but the robot's states."""
    robot = live.robot
    about = {
        "robot": robot.name,
        "sliders": [vars(item) | {"rest": live.rest[item.name]} for item in live.sliders.values()],
        "command": live.command or robot.name,
        "radii_mm": radii_mm(robot, np.arange(len(live.state["shape_mm"]))).round(3).tolist(),
        "length_mm": reach_mm(live.state["shape_mm"]),
        "turn_rad": turn_rad(live.drives),
        "outside": [name.replace("_", " ") for name in live.outside],
        "played": None
        if live.played is None
        else {"name": live.played.name, "end_s": float(live.played.inputs.time_s[-1])},
    }
    context = {
        "robot": robot.name,
        "about": page_json(about),
        "script": page_script("scene.js", "live.js"),
    }
    return rendered("catheter_sim.page", "live.html", context)


# ----------------------------------------------------------------------------------------------------
# The public face.


class LiveView:
    """A robot that is driven in a browser until it is closed.

    Attributes:
        address: what to open. Whoever has it can drive the robot.

    Examples:
        >>> import catheter_sim as cs
        >>> robot = cs.view("neuroendoscope_section")
        >>> list(robot.table().columns)
        ['tension_right_N']
        >>> robot.close()
    """

    def __init__(self, server: LiveServer) -> None:
        self._server, self.address = server, server.address
        server.begin()

    def table(self) -> Table:
        """Return what was driven so far: `time_s` and the input columns."""
        header, *rows = self._server.live.table().splitlines()
        values = np.array([[float(cell) for cell in row.split(",")] for row in rows])
        names = header.split(",")
        columns = {name: values[:, index] for index, name in enumerate(names) if index}
        return Table(values[:, 0], columns, "driven")

    def close(self) -> None:
        """End the simulation and free the address."""
        self._server.end()

    def __enter__(self) -> LiveView:
        return self

    def __exit__(self, *raised: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"LiveView({self._server.live.robot.name}: {self.address})"

    def _repr_html_(self) -> str:
        return f'<a href="{self.address}" target="_blank" rel="noopener">{self._server.live.robot.name}</a>'


def view(
    robot: RobotSpec | str | os.PathLike[str],
    inputs: str | os.PathLike[str] | None = None,
    gravity_mps2: Sequence[float] = (0.0, 0.0, 0.0),
    port: int = 0,
) -> LiveView:
    """Return a robot that is simulated in real time and driven in a browser, with a slider for each channel.

    It listens on this machine alone. In a notebook the view shows itself as a link. The command that the page
    copies names the robot's id or its file; of another robot NAME.toml, which `cs.save_robot` writes.

    Args:
        robot: a robot, its id or its file.
        inputs: a CSV file to play, a trial's own file too, with the points that were measured.
        gravity_mps2: gravity in the base frame at first, shape (3,) [m/s^2].
        port: where to listen; 0 takes a free one.

    Raises:
        InputError: the robot cannot be driven, the file cannot be read, or the port is taken.

    Examples:
        >>> import catheter_sim as cs
        >>> with cs.view("neuroendoscope_section") as robot:
        ...     robot.address.startswith("http://127.0.0.1:")
        True
    """
    value = robot_of(robot)
    x, y, z = gravity_of(gravity_mps2).tolist()
    place = whole_of(port, "port", "the number of a port", 0)
    recording = None if inputs is None else recording_of(value, path_of(inputs, "inputs"))
    name = "" if inputs is None else Path(inputs).name
    command = shlex.quote(_reference(value) if isinstance(robot, RobotSpec) else os.fspath(robot))
    return LiveView(LiveServer(live_robot(value, (x, y, z), recording, name, command), port=place))


def _reference(robot: RobotSpec) -> str:
    """Return how to name a robot of which no file is known."""
    try:
        known = load_robot(robot.name) == robot
    except InputError:
        known = False
    return robot.name if known else f"{robot.name}.toml"
