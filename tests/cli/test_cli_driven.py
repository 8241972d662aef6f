"""What the verbs drive: effects on inputs, robot and outputs, gravity, the clock and settings all arrive."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import mujoco
import numpy as np
import pytest
from cli_command import Run

from catheter_sim.catalogue import load_robot
from catheter_sim.cli.arguments import whole_number
from catheter_sim.effects import EFFECTS
from catheter_sim.tables import Table, read_table

ROBOT = "neuroendoscope_section"
STATICS = ("statics", ROBOT, "--model", "fkm_exact_arm")
SIMULATE = ("simulate", ROBOT)
BOTH = pytest.mark.parametrize("verb", [STATICS, SIMULATE], ids=lambda verb: verb[0])


def outputs(run: Run, folder: Path, verb: tuple[str, ...], rows: str, *words: object) -> Table:
    """Return what a verb writes for rows of time and right tension."""
    (folder / "in.csv").write_text(f"time_s,tension_right_N\n{rows}")
    ran = run(*verb, "--inputs", "in.csv", "-o", "out.csv", "--columns", "tip_x_mm,tip_z_mm", *words)
    assert ran.status == 0, ran.err
    return read_table("out.csv")


@BOTH
def test_weight_acts_along_gravity(verb: tuple[str, ...], run: Run, folder: Path) -> None:
    """The unloaded robot sinks toward +x by 7.15 mm under 9.81 m/s^2 there, as far to the other side under
    as much the other way, and stands straight without."""
    tips = {
        text: outputs(run, folder, verb, "0,0\n", "--gravity", text).columns["tip_x_mm"][0]
        for text in ("9.81,0,0", "-9.81,0,0", "0,0,0")
    }
    assert tips["9.81,0,0"] == pytest.approx(7.154, abs=0.3)
    assert tips["-9.81,0,0"] == pytest.approx(-tips["9.81,0,0"], abs=1e-3)
    assert tips["0,0,0"] == pytest.approx(0.0, abs=1e-6)


@BOTH
def test_effects_on_the_inputs_arrive(verb: tuple[str, ...], run: Run, folder: Path) -> None:
    """A gain of 1.5 on 0.1 N is 0.15 N, and not 0.1 N."""
    gained = outputs(run, folder, verb, "0,0\n1,0.1\n", "--set", "effects.actuation_gain.scale=1.5")
    more, plain = (outputs(run, folder, verb, f"0,0\n1,{tension}\n") for tension in (0.15, 0.1))
    for name, values in gained.columns.items():
        np.testing.assert_allclose(values, more.columns[name], atol=1e-9)
    assert gained.columns["tip_x_mm"][1] > 1.2 * plain.columns["tip_x_mm"][1] > 1.0


@pytest.mark.slow
@BOTH
def test_effects_on_the_robot_arrive(verb: tuple[str, ...], run: Run, folder: Path) -> None:
    """Twice as stiff by an effect is twice as stiff by the specification, and bends less."""
    rows = "0,0\n1,0.15\n"
    effect = outputs(run, folder, verb, rows, "--set", "effects.stiffness.scale=2")
    stiff = outputs(run, folder, verb, rows, "--set", "stiffness_scale=2")
    plain = outputs(run, folder, verb, rows)
    np.testing.assert_allclose(effect.columns["tip_x_mm"], stiff.columns["tip_x_mm"], atol=1e-9)
    assert effect.columns["tip_x_mm"][1] < 0.7 * plain.columns["tip_x_mm"][1]


@BOTH
def test_effects_on_the_outputs_are_in_the_file(verb: tuple[str, ...], run: Run, folder: Path) -> None:
    """A tracker shifted by 6 mm: every row is off by that, along x alone."""
    rows = "0,0\n1,0.15\n"
    shifted = outputs(run, folder, verb, rows, "--set", "effects.measurement_frame.translation_x_mm=6")
    plain = outputs(run, folder, verb, rows)
    np.testing.assert_allclose(shifted.columns["tip_x_mm"] - plain.columns["tip_x_mm"], 6.0, atol=1e-6)
    np.testing.assert_allclose(shifted.columns["tip_z_mm"], plain.columns["tip_z_mm"], atol=1e-6)


@BOTH
def test_rows_keep_their_times(verb: tuple[str, ...], run: Run, folder: Path) -> None:
    """A clock that does not start at zero is written as it was read."""
    table = outputs(run, folder, verb, "100.5,0\n102,0.05\n")
    np.testing.assert_array_equal(table.time_s, [100.5, 102.0])


@pytest.mark.slow
def test_dynamic_rows_are_not_waited_for(run: Run, folder: Path) -> None:
    """A pull within 20 ms: held, the robot comes to rest under it; by the clock it has hardly moved."""
    rows, smooth = "0,0\n0.02,0.3\n", ("--set", "friction.mu=0")
    held = outputs(run, folder, SIMULATE, rows, *smooth).columns["tip_x_mm"][1]
    moving = outputs(run, folder, SIMULATE, rows, "--dynamic", *smooth).columns["tip_x_mm"][1]
    assert held > 10.0
    assert 0.0 < moving < 0.5 * held


def test_built_file_has_the_settings_and_says_what_it_cannot_hold(run: Run, folder: Path) -> None:
    """A longer robot is in the file, a softer one too; a gain and a tracker's frame are named as not."""
    settings = ["segments.section.length_mm=90", "effects.stiffness.scale=0.5"]
    outside = ["effects.actuation_gain.scale=1.1", "effects.measurement_frame.translation_x_mm=3"]
    ran = run("build", ROBOT, "-o", "long.xml", "--set", *settings, *outside)
    assert ran.status == 0, ran.err
    assert run("build", ROBOT, "-o", "plain.xml").status == 0
    told = ran.out.splitlines()[-1]
    assert "actuation_gain" in told
    assert "measurement_frame" in told
    assert "stiffness" not in told
    plain, long = (mujoco.MjModel.from_xml_path(name) for name in ("plain.xml", "long.xml"))
    data = mujoco.MjData(long)
    mujoco.mj_forward(long, data)
    assert data.site("tip").xpos[2] == pytest.approx(0.09)
    assert long.jnt_stiffness.max() / plain.jnt_stiffness.max() == pytest.approx(0.5 * 60 / 90)


def test_listed_bounds_are_the_effects_own(run: Run) -> None:
    """Value of no effect, lower and upper bound of every parameter of one robot, infinite ones as words."""
    content = json.loads(run("list", "--json").out)
    robot = load_robot("mitral_transseptal")
    for listed in content["effects"]:
        own = EFFECTS[listed["name"]].parameters(robot)
        told = listed["parameters"]["mitral_transseptal"]
        assert [item["name"] for item in told] == [item.name for item in own]
        for item, parameter in zip(told, own, strict=True):
            ends = [float(item[key]) for key in ("no_effect", "lower", "upper")]
            assert ends == [parameter.null, parameter.lower, parameter.upper], parameter.name


@pytest.mark.slow
def test_picture_shows_the_weight(run: Run, folder: Path) -> None:
    """The unloaded robot under gravity across it stands elsewhere in the picture than without."""
    import imageio.v3 as iio

    (folder / "in.csv").write_text("time_s,tension_right_N\n0,0\n")
    words = ("render", ROBOT, "--inputs", "in.csv", "--width", "96", "--height", "72", "--camera", "side")
    frames = []
    for name, gravity in (("none.png", "0,0,0"), ("down.png", "9.81,0,0")):
        assert run(*words, "-o", name, "--gravity", gravity).status == 0
        frames.append(iio.imread(folder / name).astype(int))
    assert (np.abs(frames[1] - frames[0]).max(axis=2) > 30).mean() > 0.002


def test_bench_takes_as_many_turns_as_it_is_told(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each robot is measured over so many turns; without the option over nine."""

    from catheter_sim.speed import benchmark

    asked: list[int] = []
    monkeypatch.setattr(benchmark, "ROBOTS", ("chest_tube_section",))
    monkeypatch.setattr(benchmark, "measure", lambda reference, turns: asked.append(turns))
    monkeypatch.setattr(benchmark, "as_dict", lambda speed: {})
    assert run("bench", "--json", "--turns", "2").status == 0
    assert run("bench", "--json").status == 0
    assert asked == [2, 9]


@pytest.mark.parametrize(
    ("text", "value"), [("1", 1), ("256", 256), ("0", None), ("257", None), ("2.0", None)]
)
def test_whole_numbers_have_both_their_bounds(text: str, value: int | None) -> None:
    """Both ends are taken, what lies beyond either is refused in words that name both."""
    read = whole_number(1, 256)
    if value is not None:
        assert read(text) == value
    else:
        with pytest.raises(argparse.ArgumentTypeError, match="a whole number from 1 to 256 is needed"):
            read(text)
