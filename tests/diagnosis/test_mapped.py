"""`[map]`: what is read from a tracker's file is what was measured; what is wrong is named in one line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.diagnosis.trials import Dataset
from catheter_sim.errors import InputError

HEAD = """\
[dataset]
name = "take"
robot = "mitral_transseptal"
source = "made up for a test"
licence = "MIT"
[conditions]
gravity_mps2 = [0.0, 0.0, 0.0]
[channels]
inputs = ["displacement_bending_mm", "advance_mm"]
outputs = ["tip_x_mm", "tip_y_mm", "tip_z_mm"]
[[trials]]
file = "take.csv"
"""
MAP = """\
axes = ["x", "-z", "y"]
time_s = { column = "stamp", unit = "ms" }
tip = { columns = ["X", "Y", "Z"], unit = "m" }
displacement_bending_mm = { column = "motor", unit = "deg", spool_radius_mm = 10.0, sign = -1, zero = 30.0 }
advance_mm = { column = "feed", scale = 2.0 }
"""
CSV = """\
stamp,note,X,Y,Z,motor,feed
1731000000250,begins,0.001,0.065,0.002,30,0
1731000000750,,0.011,0.063,0.003,-27.29577951308232,1
1731000001250,,,0.060,0.004,-84.59155902616465,2
1731000001750,,0.012,0.062,0.003,-27.3,3
"""


def load(folder: Path, mapped: str = MAP, csv: str = CSV, head: str = HEAD) -> Dataset:
    (folder / "dataset.toml").write_text(f"{head}[map]\n{mapped}")
    (folder / "take.csv").write_text(csv)
    return load_dataset(folder)


def test_columns_are_read_in_the_channels_units(tmp_path: Path) -> None:
    """A motor's angle times its spool's radius is a way, metres are mm, y up is the base's z, ms are s."""
    (trial,) = load(tmp_path).trials
    columns = trial.outputs.columns
    np.testing.assert_allclose(columns["tip_x_mm"], [1.0, 11.0, np.nan, 12.0])
    np.testing.assert_allclose(columns["tip_y_mm"], [-2.0, -3.0, -4.0, -3.0])
    np.testing.assert_allclose(columns["tip_z_mm"], [65.0, 63.0, 60.0, 62.0])
    np.testing.assert_allclose(trial.inputs.time_s, [0.0, 0.5, 1.0, 1.5])
    bending = trial.inputs.tendon[:, 0]  # two radians of 57.3 deg, on a spool of 10 mm
    np.testing.assert_allclose(bending[:3], [0.0, 10e-3, 20e-3], rtol=1e-12)
    assert max(trial.inputs.tendon.max(axis=0)) == pytest.approx(20e-3)
    assert 6e-3 in trial.inputs.tendon[3].round(9)  # feed 3, scale 2 mm


def test_counts_of_an_encoder_are_an_angle_by_what_makes_a_turn(tmp_path: Path) -> None:
    """A quarter of 4096 counts, from 2048, winds pi/2 of a 3 mm spool, against its sign."""
    counted = 'unit = "counts", counts_per_turn = 4096, spool_radius_mm = 3.0, sign = -1, zero = 2048'
    mapped = MAP.replace('unit = "deg", spool_radius_mm = 10.0, sign = -1, zero = 30.0', counted)
    lines = [line.split(",") for line in CSV.splitlines()]
    for line, counts in zip(lines[1:], (2048, 1024, 2048, 2048), strict=True):
        line[5] = str(counts)
    (trial,) = load(tmp_path, mapped, "\n".join(",".join(line) for line in lines) + "\n").trials
    np.testing.assert_allclose(trial.inputs.tendon[:2, 0], [0.0, 1e-3 * 3.0 * np.pi / 2.0], atol=1e-12)


def test_rows_before_the_origin_and_between_every_are_left_out(tmp_path: Path) -> None:
    """A trial starts at the origin of its clock; of what follows every second row is taken."""
    mapped = MAP.replace('unit = "ms"', 'unit = "ms", origin = 1731000000700').replace(
        "axes", "every = 2\naxes"
    )
    (trial,) = load(tmp_path, mapped, CSV.replace("30,0\n", "-27.3,0\n")).trials
    np.testing.assert_allclose(trial.outputs.columns["tip_y_mm"], [-3.0, -3.0])
    np.testing.assert_allclose(trial.outputs.time_s, [0.05, 1.05])


def test_inputs_may_lie_in_a_second_file_with_its_own_clock(tmp_path: Path) -> None:
    """They move linearly between its rows; the tracker's rows that it does not reach are left out."""
    (tmp_path / "log.csv").write_text("t;motor;feed\n9,0;30,0;0\n11,0;-84,0;4\n")  # decimal commas
    head = HEAD + 'inputs = "log.csv"\n'
    shifted = 'inputs_time_s = { column = "t", origin = "first row", shift_s = 1731000000.5 }\n'
    (trial,) = load(tmp_path, MAP + shifted, CSV, head).trials
    np.testing.assert_allclose(trial.outputs.columns["tip_z_mm"], [63.0, 60.0, 62.0])
    radians = np.radians(114.0 * np.array([0.125, 0.375, 0.625]))
    np.testing.assert_allclose(trial.inputs.tendon[:, 0], 10e-3 * radians, rtol=1e-5)


def test_dates_and_frames_are_clocks_too(tmp_path: Path) -> None:
    """Dates count from the first one; frames by their rate."""
    dated = CSV
    for second in (0, 1, 2, 3):
        dated = dated.replace(f"173100000{(250 + 500 * second):04d}", f"2026-05-11T18:30:0{second}.5")
    (trial,) = load(tmp_path, MAP.replace('"ms"', '"date"'), dated).trials
    np.testing.assert_allclose(trial.outputs.time_s, [0.0, 1.0, 2.0, 3.0])
    frames = MAP.replace('"ms"', '"frame", rate_Hz = 1000.0')
    (trial,) = load(tmp_path, frames).trials
    np.testing.assert_allclose(trial.inputs.time_s, [0.0, 0.5, 1.0, 1.5])


def test_an_orientation_stands_beside_a_point(tmp_path: Path) -> None:
    """Parts of the tip's quaternion are columns of their own, whatever maps its position."""
    head = HEAD.replace('"tip_z_mm"]', '"tip_z_mm", "tip_qw"]')
    mapped = MAP + 'tip_qw = { column = "Q" }\n'
    lines = CSV.splitlines()
    csv = "\n".join([f"{lines[0]},Q", *(f"{line},0.5" for line in lines[1:])]) + "\n"
    (trial,) = load(tmp_path, mapped, csv, head).trials
    np.testing.assert_allclose(trial.outputs.columns["tip_qw"], 0.5)
    np.testing.assert_allclose(trial.outputs.columns["tip_z_mm"][:2], [65.0, 63.0])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("axes", "axis", "[map]: unknown key 'axis'; choices: time_s, inputs_time_s, axes, every"),
        ('"-z"', '"z"', "map.axes: ['x', 'z', 'y']: a mirror image"),
        ('"-z"', '"x"', "each of the file's axes stands once"),
        ('"-z"', '"up"', "map.axes: unknown axis"),
        ('unit = "m" }', 'unit = "yd" }', "map.tip: unit: unknown unit 'yd'; choices: mm, m, cm, um, in"),
        (
            '["X", "Y", "Z"]',
            '["X", "Y", "W"]',
            "unknown column 'W'; choices: stamp, note, X, Y, Z, motor, feed",
        ),
        ('["X", "Y", "Z"]', '["X", "Y", "Y"]', "map.tip.columns: a column stands twice"),
        ('["X", "Y", "Z"]', '["X", "note", "Z"]', "line 2: note = 'begins': not a finite number"),
        (
            "spool_radius_mm = 10.0, ",
            "",
            "unknown unit 'deg'; choices: mm, m, cm, um, in, deg with spool_radius_mm",
        ),
        ("10.0, sign", "-1.0, sign", "map.displacement_bending_mm.spool_radius_mm: must be above 0"),
        ('"deg", sp', '"counts", sp', 'counts_per_turn goes with unit = "counts", and with no other'),
        ('"deg", sp', '"deg", counts_per_turn = 360, sp', 'counts_per_turn goes with unit = "counts"'),
        (
            '"deg", sp',
            '"counts", counts_per_turn = 0, sp',
            "map.displacement_bending_mm.counts_per_turn: must be above 0, not 0",
        ),
        ('"deg", sp', '"yd", sp', "unknown unit 'yd'; choices: deg, rad, turn, counts"),
        ("sign = -1", "sign = 2", "map.displacement_bending_mm.sign: 1 or -1 is needed"),
        ("scale = 2.0", 'scale = 2.0, unit = "mm"', "map.advance_mm: scale stands for unit"),
        ("scale = 2.0", "scale = inf", "map.advance_mm.scale: a finite number is needed"),
        (
            '"ms"',
            '"weeks"',
            "map.time_s: unit: unknown unit 'weeks'; choices: s, ms, us, ns, min, h, frame, date",
        ),
        ('"ms"', '"frame"', 'map.time_s: rate_Hz goes with unit = "frame"'),
        ('"ms"', '"date"', "a date such as 2026-05-11T18:30:02.5 is needed"),
        ('"ms"', '"ms", origin = "noon"', 'map.time_s.origin: a finite number or "first row" is needed'),
        ('"ms"', '"ms", origin = 1831000000000', "no row comes after map.time_s.origin"),
        ("axes", "every = 0\naxes", "map.every: a whole number from 1 to 10000"),
        ("axes", 'tip_x_mm = { column = "X" }\naxes', "map.tip_x_mm: tip maps it already"),
        ('column = "feed"', 'colum = "feed"', "unknown key 'colum'; choices: column, unit, scale"),
    ],
)
def test_wrong_map_is_refused_in_one_line(old: str, new: str, message: str, tmp_path: Path) -> None:
    """The line names the file, the key and the choices."""
    assert old in MAP
    with pytest.raises(InputError) as caught:
        load(tmp_path, MAP.replace(old, new))
    assert message in str(caught.value)
    assert str(tmp_path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_clocks_that_do_not_meet_are_named(tmp_path: Path) -> None:
    """Of two files whose clocks count from other moments both spans are told."""
    (tmp_path / "log.csv").write_text("t,motor,feed\n0,30,0\n2,-84,4\n")
    mapped = MAP + 'inputs_time_s = { column = "t" }\n'
    with pytest.raises(InputError, match="its clock, 0 to 2 s, does not meet that of"):
        load(tmp_path, mapped, CSV, HEAD + 'inputs = "log.csv"\n')


def test_inputs_of_a_trial_need_a_map(tmp_path: Path) -> None:
    """Without `[map]` a trial has one file, as ever."""
    (tmp_path / "dataset.toml").write_text(HEAD + 'inputs = "log.csv"\n')
    (tmp_path / "take.csv").write_text(CSV)
    with pytest.raises(InputError, match="unknown key 'inputs'; choices: file, role"):
        load_dataset(tmp_path)
