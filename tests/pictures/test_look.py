"""From where a robot is drawn: across its bending, or as asked; measured points, clear backgrounds."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from PIL import Image

import catheter_sim as cs
from catheter_sim.catalogue import load_robot
from catheter_sim.channels import drives_of
from catheter_sim.cli.main import main
from catheter_sim.modelling.build import remembered_mjcf, views
from catheter_sim.pictures.images import MEASURED
from catheter_sim.pictures.offscreen import (
    DrawnState,
    Look,
    bending_azimuth,
    fitted_view,
    looked_from,
    swept_points,
    zoomed,
)

SECTION = "neuroendoscope_section"
BENT = {"time_s": [0.0, 1.0], "tension_right_N": [0.0, 0.3]}


def bent(name: str, channel: str, share: float = 1.0) -> tuple[mujoco.MjModel, tuple[DrawnState, ...]]:
    """Return the states of a robot that one channel bends."""
    robot = load_robot(name)
    size = {"tension_1_N": 2.0, "tension_2_N": 2.0, "tension_right_N": 0.4}.get(channel, 1.0) * share
    run = cs.simulate(robot, {"time_s": [0.0, 1.0], channel: [0.0, size]})
    return mujoco.MjModel.from_xml_string(remembered_mjcf(robot, run.inputs.actuation)), run.states


@pytest.mark.parametrize("channel", ["tension_1_N", "tension_2_N", "tension_3_N"])
def test_the_overview_looks_across_the_bending_of_each_tendon(channel: str) -> None:
    """Three tendons 120 deg apart: the looking direction stays within 45 deg of each plane's normal."""
    robot = load_robot("spacer_disk")
    names = [drive.column for drive in drives_of(robot)]
    model, states = bent("spacer_disk", names[int(channel.split("_")[1]) - 1])
    data = mujoco.MjData(model)
    data.qpos[:] = states[-1].qpos
    mujoco.mj_forward(model, data)
    tip = data.site("tip").xpos
    normal = np.cross([0.0, 0.0, 1.0], [tip[0], tip[1], 0.0])
    normal /= np.linalg.norm(normal)
    own = next(view for view in views(robot) if view.name == "overview")
    plane = bending_azimuth(model, states)
    assert abs(np.arctan2(tip[1], tip[0]) - plane) % np.pi == pytest.approx(0.0, abs=0.02) or abs(
        np.arctan2(tip[1], tip[0]) - plane
    ) % np.pi == pytest.approx(np.pi, abs=0.02)
    assert abs(looked_from(own, Look(), plane).backward @ normal) > np.cos(np.pi / 4.0)


def test_a_robot_that_bends_all_round_or_not_at_all_is_seen_as_ever() -> None:
    """Points on a ring or on the axis have no plane; points on a line across the axis have its angle."""
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><body><freejoint/><geom size="0.01"/></body></worldbody></mujoco>'
    )

    def plane_of(points: np.ndarray) -> float:
        return bending_azimuth(
            model, [DrawnState(np.array([*point, 1.0, 0.0, 0.0, 0.0]), {}) for point in points]
        )

    angles = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    ring = np.stack([np.cos(angles), np.sin(angles), 0.5 * angles], axis=1)
    assert plane_of(ring) == 0.0
    assert plane_of(ring * [1e-3, 1e-4, 1.0]) == 0.0
    for degrees in (0.0, 35.0, -80.0):
        way = np.radians(degrees)
        line = np.linspace(-0.4, 1.0, 8)
        points = np.stack([line * np.cos(way), line * np.sin(way), 1.0 - line**2], axis=1)
        assert np.degrees(plane_of(points)) == pytest.approx(degrees, abs=1e-6)


def test_angles_are_mujocos_and_zoom_and_point_are_as_asked() -> None:
    """Azimuth 90 looks along +y; a negative elevation looks down; twice as large shows half."""
    model, states = bent(SECTION, "tension_right_N")
    own = next(view for view in views(load_robot(SECTION)) if view.name == "overview")
    along = looked_from(own, Look(azimuth_deg=90.0, elevation_deg=0.0), 0.3)
    np.testing.assert_allclose(along.backward, [0.0, -1.0, 0.0], atol=1e-12)
    down = looked_from(own, Look(azimuth_deg=0.0, elevation_deg=-30.0), 0.3)
    np.testing.assert_allclose(down.backward, [-np.sqrt(0.75), 0.0, 0.5], atol=1e-12)
    np.testing.assert_allclose(looked_from(own, Look("side"), 0.3).backward, own.backward, atol=1e-12)
    whole = fitted_view(along, swept_points(model, states), 320, 240)
    near = zoomed(whole, Look(zoom=2.0, look_at_mm=(1.0, 2.0, 30.0)))
    assert near.height == whole.height / 2.0
    np.testing.assert_allclose(near.target, [1e-3, 2e-3, 0.03])


def drawn(tmp_path: Path, name: str, table: dict[str, list[float]], *words: str) -> np.ndarray:
    given = tmp_path / f"{name}.csv"
    rows = zip(*table.values(), strict=True)
    given.write_text("\n".join([",".join(table), *(",".join(map(str, row)) for row in rows)]) + "\n")
    out = tmp_path / f"{name}.png"
    size = ("--width", "320", "--height", "240")
    assert main(["render", SECTION, "--inputs", str(given), "-o", str(out), *size, *words]) == 0
    return np.asarray(Image.open(out))


def test_a_clear_background_leaves_the_robot(tmp_path: Path) -> None:
    """Opaque where the robot is drawn, clear elsewhere; what is opaque is what the plain picture shows."""
    plain = drawn(tmp_path, "plain", BENT, "--no-legend")
    clear = drawn(tmp_path, "clear", BENT, "--no-legend", "--transparent")
    assert plain.shape[-1] == 3
    assert set(np.unique(clear[..., 3])) == {0, 255}
    assert 0.005 < (clear[..., 3] == 255).mean() < 0.3
    np.testing.assert_array_equal(clear[..., :3], plain)
    assert (clear[0, 0, 3], clear[-1, -1, 3]) == (0, 0)
    written = drawn(tmp_path, "written", BENT, "--transparent")
    close_up = written[-109:-7, -109:-7, 3]  # a picture of its own, with its background
    assert (close_up == 255).all()
    assert (written[..., 3] == 255).mean() > 0.1


def test_measured_points_are_blue_balls_where_they_were_measured(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One ball, where the measured tip is seen, at the end of a thin line, and words; none without."""

    def blue(image: np.ndarray, thin: bool = True) -> np.ndarray:
        wanted = np.asarray(MEASURED[:3])
        share = image / np.maximum(image.max(axis=-1, keepdims=True), 1.0)
        found = (np.abs(share - wanted / wanted.max()) < 0.2).all(axis=-1) & (image.max(axis=-1) > 60)
        return found if thin else found & np.roll(found, 1, 0) & np.roll(found, -1, 0)

    measured = {**BENT, "tip_x_mm": [0.0, -10.0], "tip_z_mm": [60.0, 40.0]}
    words = ("--no-legend", "--camera", "side", "--look-at", "-10,0,40")
    image = drawn(tmp_path, "measured", measured, *words)
    assert "measured: tip: blue balls, lines from the computed points\n" in capsys.readouterr().out
    found = np.argwhere(blue(image, thin=False))
    assert len(found) > 3
    np.testing.assert_allclose(found.mean(axis=0), [119.5, 159.5], atol=1.5)
    assert blue(image).sum() > 4 * len(found)
    assert not blue(drawn(tmp_path, "none", BENT, *words)).any()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--look-at", "1,2"), "--look-at 1,2: three numbers x,y,z in mm are needed"),
        (("--elevation", "91"), "an angle from -90 to 90 is needed"),
        (("--zoom", "0"), "a number above zero is needed"),
        (("--transparent", "--rows", "1,2"), "transparent is one row's picture"),
    ],
)
def test_a_bad_look_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: tuple[str, ...], said: str
) -> None:
    given = tmp_path / "in.csv"
    given.write_text("time_s,tension_right_N\n0,0\n1,0.3\n")
    call = ["render", SECTION, "--inputs", str(given), "-o", str(tmp_path / "out.png"), *words]
    try:
        status = main(call)
    except SystemExit as stop:
        status = stop.code
    assert status == 2
    assert said in capsys.readouterr().err
