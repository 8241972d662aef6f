"""From a file of inputs to a picture or a video of the simulated robot."""

from __future__ import annotations

from pathlib import Path

import imageio.v3 as imageio
import numpy as np
import pytest
from PIL import Image

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import read_inputs
from catheter_sim.core.inputs import Inputs
from catheter_sim.errors import InputError
from catheter_sim.pictures import offscreen
from catheter_sim.pictures.images import pulled_tendons
from catheter_sim.pictures.offscreen import state_of
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.tables import Table

pytestmark = pytest.mark.slow

ROBOT = load_robot("neuroendoscope_section")
STILL = (0.0, 0.0, 0.0)
SIDE = offscreen.Look("side")
ALONE = offscreen.Look("side", legend=False)


def inputs(seconds: list[float], right: list[float]) -> Inputs:
    return read_inputs(ROBOT, Table(np.array(seconds), {"tension_right_N": np.array(right)}))


def drawn(right: float) -> tuple[np.ndarray, np.ndarray]:
    """Return rows and columns of the robot's pixels, seen from the side under a tension of `right` [N]."""
    simulator = Simulator(ROBOT)
    simulator.set_inputs(np.array([right, 0.0]))
    simulator.settle()
    states = [state_of(simulator)]
    (image,) = offscreen.draw(ROBOT, simulator.model, states, [()], 480, 360, ALONE, close_up=False)
    # The background is a pale blue-grey everywhere; PEEK, metal and tendons are not.
    return np.nonzero(np.abs(image.astype(int) - image[2, 2]).max(axis=2) > 30)


def test_robot_is_drawn_upright_and_bends_toward_plus_x() -> None:
    """Straight, it stands in the middle; pulled by the right tendon, its upper end is at the right."""
    row, column = drawn(0.0)
    assert len(row) > 1000
    assert np.ptp(column) < 0.2 * np.ptp(row)
    row, column = drawn(0.4)
    assert np.ptp(column) > 0.5 * np.ptp(row)
    assert column[row == row.max()].mean() < column.min() + 0.2 * np.ptp(column)
    assert row[column == column.max()].mean() < row.min() + 0.4 * np.ptp(row)


def test_picture_shows_the_last_row_after_those_before_it(tmp_path: Path) -> None:
    """The same last row gives another picture where friction holds what came before it."""
    for name, before in (("loaded.png", 0.0), ("unloaded.png", 0.4)):
        row = inputs([0.0, 1.0], [before, 0.2])
        offscreen.render(ROBOT, row, STILL, tmp_path / name, 480, 360, SIDE)
    loaded, unloaded = (np.asarray(Image.open(tmp_path / name)) for name in ("loaded.png", "unloaded.png"))
    assert loaded.shape == (360, 480, 3)
    assert (np.abs(loaded.astype(int) - unloaded).max(axis=2) > 30).sum() > 500


def test_video_covers_the_time_of_the_inputs(tmp_path: Path) -> None:
    """Half a second of inputs is half a second of video, and the robot moves from frame to frame."""
    path = tmp_path / "a.mp4"
    offscreen.render(ROBOT, inputs([0.0, 0.5], [0.0, 0.3]), STILL, path, 320, 240, SIDE)
    frames = imageio.imread(path, plugin="pyav").astype(int)
    assert frames.shape == (round(0.5 * offscreen.FPS) + 1, 240, 320, 3)
    moved = [(np.abs(frame - frames[0]).max(axis=2) > 40).sum() for frame in frames]
    assert moved[-1] > moved[6] > moved[1]
    assert moved[-1] > 500


def test_long_inputs_are_played_faster_and_frames_lie_on_the_path_of_the_inputs() -> None:
    """An hour of inputs takes the longest video; between rows the inputs are linear."""
    hour = inputs([0.0, 1800.0, 3600.0], [0.0, 0.4, 0.2])
    times = offscreen.frame_times(hour)
    assert len(times) == offscreen.LONGEST_VIDEO_S * offscreen.FPS + 1
    assert (times[0], times[-1]) == (0.0, 3600.0)
    between = offscreen.resampled(hour, np.array([900.0, 1800.0, 2700.0]))
    assert between.tendon[:, 0] == pytest.approx([0.2, 0.4, 0.3])
    assert len(offscreen.frame_times(inputs([5.0], [0.1]))) == 1


def test_caption_states_time_and_inputs() -> None:
    """A channel that several tendons share is shown as the file states it, their sum."""
    robot = load_robot("neuroendoscope")
    table = Table(np.array([0.0, 2.5]), {"tension_proximal_right_N": np.array([0.0, 0.8])})
    row = read_inputs(robot, table)
    lines = offscreen.caption(robot, row, 1)
    assert lines[0] == "t = 2.50 s"
    assert "tension proximal right 0.80 N" in lines
    assert not any("left" in line for line in lines)  # channels that stay 0 have no line


@pytest.mark.parametrize(
    ("name", "size", "camera", "message"),
    [
        ("a.jpg", (64, 48), "side", r"choices: \.png, \.mp4, \.gif"),
        ("a.mp4", (65, 48), "side", "even"),
        ("a.png", (64, 4), "side", "height = 4"),
        ("a.png", (64, 48), "top", "unknown camera 'top'; choices: overview, side"),
    ],
)
def test_bad_requests_are_refused_before_the_simulation(
    name: str,
    size: tuple[int, int],
    camera: str,
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Bad kind, size or camera: one line, no simulation, no file."""

    def never(*_: object, **__: object) -> None:
        raise AssertionError("simulated")

    monkeypatch.setattr(offscreen, "simulate", never)
    with pytest.raises(InputError, match=message):
        offscreen.render(
            ROBOT, inputs([0.0, 1.0], [0.0, 0.1]), STILL, tmp_path / name, *size, offscreen.Look(camera)
        )
    assert list(tmp_path.iterdir()) == []


def test_the_robot_fills_the_picture() -> None:
    """Its pixels reach over nine tenths of the picture from end to end, and none is cut off."""
    row, column = drawn(0.0)
    assert 0.9 * 360 < np.ptp(row) < 359
    row, column = drawn(0.4)
    assert max(np.ptp(row) / 360, np.ptp(column) / 480) > 0.9
    assert row.min() > 0
    assert row.max() < 359
    assert column.min() > 0
    assert column.max() < 479


def test_several_rows_stand_in_one_picture_each_where_it_stands_alone(tmp_path: Path) -> None:
    """Of a straight and a bent posture both are seen; a row that is not there is one line."""
    history = inputs([0.0, 1.0, 2.0], [0.0, 0.4, 0.2])
    offscreen.render(ROBOT, history, STILL, tmp_path / "a.png", 480, 360, SIDE, rows=(0, 1))
    both = np.asarray(Image.open(tmp_path / "a.png")).astype(int)
    robot = np.nonzero(np.abs(both - both[2, 240]).max(axis=2) > 60)
    for other in ((0,), (1,)):
        offscreen.render(ROBOT, history, STILL, tmp_path / "b.png", 480, 360, SIDE, rows=other)
    assert np.ptp(robot[1]) > 150  # from the straight one to the bent one's tip
    assert np.ptp(robot[0]) > 250
    with pytest.raises(InputError, match="row 4: the inputs have the rows 1 to 3"):
        offscreen.render(ROBOT, history, STILL, tmp_path / "c.png", 480, 360, SIDE, rows=(0, 3))
    with pytest.raises(InputError, match=r"several rows are shown in a picture; choices: \.png"):
        offscreen.render(ROBOT, history, STILL, tmp_path / "c.mp4", 480, 360, SIDE, rows=(0, 1))
    with pytest.raises(InputError, match=r"curves stand beside a video; choices: \.mp4, \.gif"):
        offscreen.render(ROBOT, history, STILL, tmp_path / "c.png", 480, 360, SIDE, curves=True)


def test_a_pulled_tendon_is_red_and_a_slack_one_grey() -> None:
    """In two pictures of one motion: the straight robot has no red pixel, the pulled one has."""
    simulator = Simulator(ROBOT)
    pulled = pulled_tendons(simulator.model, ROBOT)
    states = []
    for tension in (0.0, 0.2):  # 0.2 N: an end of the colours
        simulator.set_inputs(np.array([tension, 0.0]))
        simulator.settle()
        states.append(state_of(simulator, pulled))
    slack, taut = (
        int((image[:, :, 0].astype(int) - image[:, :, 1:].max(axis=2) > 90).sum())
        for image in offscreen.draw(ROBOT, simulator.model, states, [()] * 2, 960, 720, ALONE, close_up=False)
    )
    assert slack == 0
    assert taut > 60


def test_an_animation_with_curves_covers_the_time_of_the_inputs(tmp_path: Path) -> None:
    """A picture of the asked size, as many frames as a video has."""
    history = inputs([0.0, 0.2], [0.0, 0.3])
    offscreen.render(ROBOT, history, STILL, tmp_path / "a.gif", 321, 200, SIDE, curves=True)
    with Image.open(tmp_path / "a.gif") as shown:
        assert shown.size == (321, 200)
        assert shown.n_frames == round(0.2 * offscreen.FPS) + 1
