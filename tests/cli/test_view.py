"""The viewer without a screen: its one line, its colours, and a window played by a test."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
import pytest
from cli_command import Run

from catheter_sim import viewer
from catheter_sim.catalogue import load_robot
from catheter_sim.errors import InputError
from catheter_sim.pictures.images import TENSION_COLOURS, tension_colours
from catheter_sim.public.live import LiveServer
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.viewer import Sliders, TendonPaint, named_model, show, slider_names, slider_ranges


class FakeWindow:
    """A window whose user does `act` to the state at each frame, for `frames` frames."""

    def __init__(
        self, simulator: Simulator, frames: int, act: Callable[[int, mujoco.MjData], None] = lambda *_: None
    ) -> None:
        self.user_scn = mujoco.MjvScene(simulator.model, maxgeom=2000)
        self.left, self.frame, self.act, self.data = frames, 0, act, simulator.data
        self.shown: list[np.ndarray] = []

    def is_running(self) -> bool:
        self.left -= 1
        return self.left >= 0

    def lock(self) -> contextlib.nullcontext[Any]:
        return contextlib.nullcontext()

    def sync(self) -> None:
        self.shown.append(self.data.ctrl.copy())
        self.act(self.frame, self.data)
        self.frame += 1


def opened(
    reference: str, frames: int, act: Callable[[int, mujoco.MjData], None] = lambda *_: None, *settings: str
) -> tuple[Simulator, FakeWindow, TendonPaint]:
    """Return a simulator after `frames` frames in a window, the window, and what painted its tendons."""
    robot = load_robot(reference, settings)
    simulator = Simulator(robot)
    ranges = slider_ranges(robot, simulator.actuation)
    sliders, paint = Sliders(simulator, ranges), TendonPaint(simulator, ranges)
    window = FakeWindow(simulator, frames, act)
    show(simulator, window, sliders, paint, sleep=lambda _: None)
    return simulator, window, paint


def test_without_a_screen_it_says_so_in_one_line(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """No display named: the robot is served to a browser. A robot that does not exist comes first."""
    monkeypatch.setattr(viewer.platform, "system", lambda: "Linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(InputError, match="no screen: neither DISPLAY nor WAYLAND_DISPLAY is set") as raised:
        viewer.require_screen()
    assert "catheter-sim render" in str(raised.value)
    monkeypatch.setattr(LiveServer, "begin", lambda server: server.stop.set())
    monkeypatch.setattr(LiveServer, "end", lambda server: server.server_close())
    shown = run("view", "neuroendoscope_section").out
    assert shown.startswith("open http://127.0.0.1:")
    assert "ssh -L" in shown
    assert "no_such_robot" in run("view", "no_such_robot").error()
    pages: list[str] = []
    monkeypatch.setattr(LiveServer, "begin", lambda server: (pages.append(server.page), server.stop.set()))
    run("view", "neuroendoscope_section", "--set", "friction.mu=0.1", "--gravity", "0,0,-9.81")
    assert '"command":"neuroendoscope_section --set friction.mu=0.1"' in pages[0]
    assert "--gravity" in run("view", "neuroendoscope", "--gravity", "down").error()
    assert "--inputs" in run("view", "neuroendoscope", "--trial", "first").error()


def test_a_display_that_does_not_answer_is_one_line_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """GLFW's own failure, where it says so and where it raises."""
    glfw = pytest.importorskip("glfw")
    monkeypatch.setenv("DISPLAY", ":nowhere")
    monkeypatch.setattr(glfw, "init", lambda: False)
    with pytest.raises(InputError, match="no screen: no window can be opened"):
        viewer.require_screen()

    def fail() -> bool:
        raise RuntimeError("two\nlines")

    monkeypatch.setattr(glfw, "init", fail)
    with pytest.raises(InputError, match="no screen: two lines; "):
        viewer.require_screen()
    assert viewer.no_screen()


def test_colours_run_from_grey_through_yellow_to_red() -> None:
    """Ends and middle are the named colours, all is opaque, red rises and blue falls; NaN is slack."""
    share = np.linspace(0.0, 1.0, 11)
    colours = tension_colours(share)
    assert colours.shape == (11, 4)
    assert colours.dtype == np.float32
    assert colours[[0, 5, 10], :3] == pytest.approx(np.array(TENSION_COLOURS), abs=1e-6)
    assert (colours[:, 3] == 1.0).all()
    assert (np.diff(colours[:6, 0]) > 0.0).all()
    assert (np.diff(colours[5:, 1]) < 0.0).all()
    assert tension_colours([-1.0, 2.0, np.nan]) == pytest.approx(colours[[0, 10, 0]])


@pytest.mark.slow
@pytest.mark.parametrize(
    "reference", ["neuroendoscope", "chest_tube", "mitral_transseptal@tube", "mitral_4dof"]
)
def test_every_slider_moves_the_robot_and_stays_where_it_was_left(reference: str) -> None:
    """At the top of its range for a few frames; the tip leaves its place, nothing else is commanded."""
    robot = load_robot(reference)
    ranges = slider_ranges(robot, robot.actuation)
    assert (ranges.least <= 0.0).all()
    assert (ranges.most > 0.0).all()
    for index in (0, len(ranges.most) - 1):

        def pull(frame: int, data: mujoco.MjData, index: int = index) -> None:
            if frame == 0:
                data.ctrl[index] = 2.0 * ranges.most[index]  # further than the range

        simulator, window, _ = opened(reference, 4, pull)
        expected = np.zeros(len(ranges.most))
        expected[index] = ranges.most[index]
        assert window.shown[-1][: len(expected)] == pytest.approx(expected)
        tip = simulator.posture().p_w[-1]
        simulator.reset()
        assert np.linalg.norm(simulator.posture().p_w[-1] - tip) > 1e-4


@pytest.mark.slow
@pytest.mark.parametrize(
    ("reference", "names"),
    [
        ("neuroendoscope_section", ["tension_right [N]", "tension_left [N]"]),
        ("chest_tube_section", ["tension_active [N]"]),
        ("mitral_transseptal", ["displacement_bending [m]", "displacement_torsion_proximal [m]"]),
        ("neuroendoscope", ["tension_distal_right [N]"]),
    ],
)
def test_sliders_are_named_by_channel_and_reach_the_simulators_controls(
    reference: str, names: list[str]
) -> None:
    """In the model that is shown, actuator by actuator; its size and its sliders are the simulator's."""
    robot = load_robot(reference)
    simulator = Simulator(robot)
    Sliders(simulator, slider_ranges(robot, simulator.actuation))
    said = slider_names(simulator)
    model = named_model(simulator, said)
    assert [model.actuator(k).name for k in range(model.nu)] == said
    assert set(names) <= set(said)
    own = simulator.model
    assert (model.nq, model.nv, model.nu, model.nbody, model.ngeom, model.ntendon, model.nsite) == (
        own.nq, own.nv, own.nu, own.nbody, own.ngeom, own.ntendon, own.nsite,
    )  # fmt: skip
    assert (model.actuator_trnid == own.actuator_trnid).all()
    assert (model.actuator_ctrlrange == own.actuator_ctrlrange).all()
    copied = mujoco.MjData(own)
    mujoco.mj_forward(model, simulator.data)
    mujoco.mj_forward(own, copied)
    assert simulator.data.geom_xpos == pytest.approx(copied.geom_xpos, abs=1e-9)
    if reference == "neuroendoscope":
        assert sorted(name for name in said if "proximal_left" in name) == [
            "tension_proximal_left 1 of 2 [N]",
            "tension_proximal_left 2 of 2 [N]",
        ]
    if reference == "mitral_transseptal":
        assert said[4] == "antagonist of displacement_bending [m]"


@pytest.mark.slow
def test_steps_and_inputs_are_the_simulators() -> None:
    """What a window shows is what the simulator alone would do under the sliders' inputs, to the last bit."""

    def pull(frame: int, data: mujoco.MjData) -> None:
        data.ctrl[:] = 0.02 * frame, 0.0

    shown, _, _ = opened("neuroendoscope_section", 6, pull)
    alone = Simulator(load_robot("neuroendoscope_section"))
    for frame in range(6):
        alone.set_inputs(np.array([0.02 * frame, 0.0]))
        alone.step(round(viewer.FRAME_S / alone.model.opt.timestep))
    assert shown.data.qpos == pytest.approx(alone.data.qpos, abs=0.0)
    assert abs(alone.data.qpos).max() > 1e-3


@pytest.mark.slow
def test_an_antagonists_slider_only_mirrors_its_pairs() -> None:
    """Pulling the antagonist's slider changes nothing; the pair's own moves both."""

    def wrong(frame: int, data: mujoco.MjData) -> None:
        data.ctrl[4] = 1e-3

    simulator, window, _ = opened("mitral_transseptal", 3, wrong)
    assert simulator.model.actuator(4).name == "antagonist_bending"
    assert window.shown[-1][[0, 4]] == pytest.approx([0.0, 0.0])
    own = opened("mitral_transseptal", 3, lambda frame, data: data.ctrl.__setitem__(0, 1e-3))[1]
    assert own.shown[-1][[0, 4]] == pytest.approx([1e-3, -1e-3])


@pytest.mark.slow
def test_the_viewers_reset_brings_the_robot_to_rest() -> None:
    """Time that jumps back is a reset: sliders at zero, no friction left."""

    def act(frame: int, data: mujoco.MjData) -> None:
        if frame < 3:
            data.ctrl[0] = 0.2
        if frame == 5:
            data.time = 0.0

    simulator, window, _ = opened("neuroendoscope_section", 7, act)
    assert window.shown[5][0] == pytest.approx(0.2)
    assert window.shown[-1] == pytest.approx([0.0, 0.0])
    assert simulator.data.qpos == pytest.approx(np.zeros(30), abs=1e-12)
    assert simulator.span_tension() == pytest.approx(np.zeros((2, 30)))


@pytest.mark.slow
def test_friction_shows_along_a_tendon() -> None:
    """A pulled tendon's tension falls toward the tip, without friction it does not, a slack one is grey."""

    def pull(frame: int, data: mujoco.MjData) -> None:
        data.ctrl[0] = 0.2

    simulator, window, paint = opened("neuroendoscope_section", 20, pull, "friction.mu=0.3")
    pulled, slack = paint.tensions()
    assert pulled == pytest.approx(simulator.span_tension()[0])
    assert pulled[-1] < 0.95 * pulled[0]
    assert slack == pytest.approx(np.zeros(30))
    paint.draw(window.user_scn)
    assert window.user_scn.ngeom == 60
    colours = np.array([window.user_scn.geoms[k].rgba for k in range(60)])
    full = slider_ranges(simulator.robot, "tension").full_tension[0]
    assert colours[:30] == pytest.approx(tension_colours(pulled / full), abs=1e-6)
    assert np.abs(colours[0] - colours[29]).max() > 0.1
    assert colours[30:, :3] == pytest.approx(np.tile(TENSION_COLOURS[0], (30, 1)), abs=1e-6)
    first = window.user_scn.geoms[0].pos
    here, there = (simulator.data.site(f"hole_right_{k}").xpos for k in (0, 1))
    assert first == pytest.approx((here + there) / 2.0, abs=1e-6)
    _, _, even = opened("neuroendoscope_section", 20, pull, "friction.mu=0")
    assert even.tensions()[0] == pytest.approx(np.full(30, 0.2))


@pytest.mark.slow
@pytest.mark.parametrize("reference", ["chest_tube", "mitral_4dof", "neuroendoscope"])
def test_all_pulled_tendons_are_drawn_base_to_tip(reference: str) -> None:
    """One piece for each straight stretch of each tendon that an actuator pulls; a full scene stays full."""
    simulator, window, paint = opened(reference, 2)
    model = simulator.model
    pulling = model.actuator_trntype == int(mujoco.mjtTrn.mjTRN_TENDON)
    stretches = model.tendon_num[model.actuator_trnid[pulling, 0]] - 1
    assert [len(item) for item in paint.tensions()] == list(stretches)
    assert window.user_scn.ngeom == sum(stretches)
    small = mujoco.MjvScene(model, maxgeom=5)
    paint.draw(small)
    assert small.ngeom == 5


def test_effects_that_no_model_holds_are_named(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """A gain on the way to the robot cannot be seen in its model."""
    seen = []
    monkeypatch.setattr(viewer, "no_screen", lambda: False)
    monkeypatch.setattr(viewer, "view", lambda robot, gravity: seen.append((robot, gravity)))
    ran = run(
        "view", "neuroendoscope_section", "--set", "friction.mu=0.1", "--gravity", "0,0,-9.81",
        "--set", "effects.rate.delay_s=0.1",
    )  # fmt: skip
    assert ran.status == 0
    assert ran.out == "the sliders leave out what acts on inputs or outputs: rate\n"
    ((robot, gravity),) = seen
    assert robot.friction.mu == 0.1
    assert gravity == (0.0, 0.0, -9.81)
