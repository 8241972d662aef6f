"""Claims about a bench that answers by files: they may come half-written, twice, or out of order."""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.errors import InputError
from catheter_sim.lab.recorded import STILL_S, RecordedRig
from catheter_sim.lab.rig import Limits
from catheter_sim.tables import Table, read_table

COLUMN, MEASURED = "tension_right_N", ("tip_x_mm", "tip_z_mm")
CLOCK = np.arange(5.0)
PULL = Table(CLOCK, {COLUMN: np.array([0.0, 0.1, 0.2, 0.1, 0.0])}, "one_inputs.csv")
OTHER = Table(CLOCK, {COLUMN: np.array([0.0, 0.3, 0.0, 0.3, 0.0])}, "two_inputs.csv")
TIPS = {"one": np.array([0.0, 1.25, 2.5, 1.5, 0.25]), "two": np.array([0.0, 3.5, 0.5, 3.25, 0.75])}


@pytest.fixture
def rig(tmp_path: Path) -> RecordedRig:
    limits = Limits({COLUMN: (0.0, 0.4)}, 600.0)
    robot = load_robot("neuroendoscope_section")
    return RecordedRig(tmp_path, robot, "neuroendoscope_section", MEASURED, np.zeros(3), limits)


def text_of(name: str, inputs: Table | None = None, rows: int = 5) -> str:
    """Return a recording's text; with what was commanded if `inputs` are given."""
    logged = f",{COLUMN}" if inputs else ""
    lines = [f"time_s,tip_x_mm,tip_z_mm{logged}"]
    for row in range(rows):
        cells = [CLOCK[row], TIPS[name][row], 60.0 - row, *([inputs.columns[COLUMN][row]] if inputs else [])]
        lines.append(",".join(f"{cell:g}" for cell in cells))
    return "\n".join(lines) + "\n"


def put(rig: RecordedRig, file: str, text: str, age_s: float = 0.0) -> None:
    path = rig.folder / file
    path.write_text(text)
    os.utime(path, (time.time() - age_s,) * 2)


def played(rig: RecordedRig, name: str = "one", inputs: Table = PULL) -> Table | None:
    rig.reset()
    rig.play(inputs, name)
    return rig.read()


def test_inputs_are_put_where_the_bench_finds_them(rig: RecordedRig) -> None:
    """The programme lies in the folder as a CSV, and nothing has arrived."""
    assert played(rig) is None
    put_there = read_table(rig.folder / "one_inputs.csv")
    np.testing.assert_array_equal(put_there.columns[COLUMN], PULL.columns[COLUMN])
    assert rig.waiting().endswith("one.csv: not there yet")


def test_a_whole_recording_is_read(rig: RecordedRig) -> None:
    """With the inputs of the programme, where the bench does not log them, and only the columns wanted."""
    played(rig)
    put(rig, "one.csv", text_of("one"))
    found = rig.read()
    assert found is not None
    assert rig.waiting() == ""
    assert list(found.columns) == [COLUMN, *MEASURED]
    np.testing.assert_array_equal(found.columns["tip_x_mm"], TIPS["one"])
    np.testing.assert_array_equal(found.columns[COLUMN], PULL.columns[COLUMN])
    assert list(rig.read(["tip_z_mm"]).columns) == [COLUMN, "tip_z_mm"]


@pytest.mark.parametrize("cut", range(1, len(text_of("one"))))
def test_half_a_file_is_never_taken(cut: int, rig: RecordedRig) -> None:
    """Wherever the writer has got to: no row of a wrong number, no error, but patience; then the whole."""
    whole = text_of("one")
    put(rig, "one.csv", whole[:cut])
    assert played(rig) is None
    assert "one.csv" in rig.waiting()
    put(rig, "one.csv", whole)
    found = rig.read()
    assert found is not None
    np.testing.assert_array_equal(found.columns["tip_z_mm"], 60.0 - CLOCK)


def test_a_last_line_without_an_end_counts_when_nobody_writes(rig: RecordedRig) -> None:
    """Some loggers end without one; whether the number is whole, only time tells."""
    put(rig, "one.csv", text_of("one").rstrip("\n"))
    assert played(rig) is None
    put(rig, "one.csv", text_of("one").rstrip("\n"), age_s=STILL_S + 1.0)
    assert rig.read() is not None


def test_a_recording_that_ends_early_is_waited_for(rig: RecordedRig) -> None:
    """However long it has lain there: it says how far it got."""
    put(rig, "one.csv", text_of("one", rows=3), age_s=1000.0)
    assert played(rig) is None
    assert rig.waiting().endswith("one.csv: 2 s of 4 s so far")


def test_the_same_file_twice_is_one_recording(rig: RecordedRig) -> None:
    """Under another name, and with all rows appended again, header included."""
    put(rig, "one (1).csv", text_of("one"))
    put(rig, "one.csv", text_of("one") + text_of("one"))
    found = played(rig)
    assert found is not None
    np.testing.assert_array_equal(found.time_s, CLOCK)
    np.testing.assert_array_equal(found.columns["tip_x_mm"], TIPS["one"])
    assert found.where.endswith("one.csv")


@pytest.mark.slow
def test_a_copy_serves_where_the_first_file_is_broken(rig: RecordedRig) -> None:
    """The file of the play's own name comes first, but a sound copy is better than none."""
    put(rig, "one.csv", text_of("one").replace("1.25", "oops"))
    with pytest.raises(InputError, match="line 3: tip_x_mm = 'oops': not a number"):
        played(rig)
    put(rig, "one_copy.csv", text_of("one"))
    assert rig.read() is not None


def test_files_out_of_order_go_by_their_names(rig: RecordedRig) -> None:
    """The second play's recording lies there before the first's: each is read under its own name."""
    put(rig, "two.csv", text_of("two", OTHER))
    assert played(rig) is None
    put(rig, "one.csv", text_of("one", PULL))
    first, second = rig.read(), played(rig, "two", OTHER)
    assert first is not None
    assert second is not None
    np.testing.assert_array_equal(first.columns["tip_x_mm"], TIPS["one"])
    np.testing.assert_array_equal(second.columns["tip_x_mm"], TIPS["two"])


def test_rows_out_of_order_are_put_in_order(rig: RecordedRig) -> None:
    """A network that loses and repeats packets changes nothing."""
    header, *rows = text_of("one").splitlines()
    mixed = [rows[0], rows[3], rows[1], rows[3], rows[4], rows[2]]
    put(rig, "one.csv", "\n".join([header, *mixed]) + "\n")
    found = played(rig)
    assert found is not None
    np.testing.assert_array_equal(found.columns["tip_x_mm"], TIPS["one"])


def test_what_was_read_stays(rig: RecordedRig) -> None:
    """A file that is overwritten later does not change what was read."""
    put(rig, "one.csv", text_of("one"))
    first = played(rig)
    put(rig, "one.csv", text_of("one").replace("1.25", "9.75"))
    again = rig.read()
    assert first is not None
    assert again is not None
    np.testing.assert_array_equal(first.columns["tip_x_mm"], again.columns["tip_x_mm"])


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (
            text_of("two", OTHER),
            "time_s = 1: tension_right_N = 0.3, but one_inputs.csv plays 0.1: is it anoth",
        ),
        (text_of("one").replace("time_s", "t"), "no column time_s; columns: t, tip_x_mm, tip_z_mm"),
        (text_of("one").replace("tip_z_mm", "z"), "no column tip_z_mm; columns: time_s, tip_x_mm, z"),
        (text_of("one").replace("2.5,58", "2.5"), "line 4: 2 cells where the header has 3"),
        (text_of("one").replace("2.5,", "inf,"), "line 4: tip_x_mm = inf: not a finite number"),
        (text_of("one").replace("\n2,", "\n,"), "line 4: time_s: a number is needed"),
        (
            text_of("one").replace("\n2,", "\n1,"),
            "lines 3 and 4: time_s = 1 stands twice, with other values of ti",
        ),
    ],
)
def test_a_wrong_file_ends_in_one_line(text: str, line: str, rig: RecordedRig) -> None:
    """It names the file, and the line or the time, and what is wrong."""
    put(rig, "one.csv", text)
    with pytest.raises(InputError) as caught:
        played(rig)
    assert f"{rig.folder / 'one.csv'}: {line}" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_nothing_played_nothing_read(rig: RecordedRig) -> None:
    """And what the bench cannot do is refused before a file is written."""
    with pytest.raises(InputError, match="nothing was played"):
        rig.read()
    with pytest.raises(InputError, match=r"the bench gives 0 to 0\.4"):
        rig.play(Table(CLOCK, {COLUMN: np.full(5, 0.5)}, "in.csv"), "one")
    with pytest.raises(InputError, match="a play's name has letters"):
        rig.play(PULL, "../one")
    assert list(rig.folder.iterdir()) == []
