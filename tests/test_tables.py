"""CSV tables: what is written is read back, and what is wrong is named with its line."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from catheter_sim.errors import InputError
from catheter_sim.tables import (
    MAX_ROWS,
    Table,
    compare_tables,
    own_clock,
    read_table,
    replaced_when_whole,
    write_table,
)

_FINITE = st.floats(allow_nan=False, allow_infinity=False, width=64)
_CELL = st.one_of(_FINITE, st.just(float("nan")))
_NAME = st.text(st.characters(codec="utf-8", categories=["L", "N", "P", "S"]), min_size=1, max_size=8).filter(
    lambda name: name != "time_s" and not name.startswith("\ufeff")
)


@st.composite
def tables(draw: st.DrawFn) -> Table:
    """Draw a table with missing values, awkward names and any finite number."""
    rows = draw(st.integers(1, 6))
    column = st.lists(_CELL, min_size=rows, max_size=rows).map(np.array)
    return Table(
        time_s=np.array(draw(st.lists(_FINITE, min_size=rows, max_size=rows))),
        columns=draw(st.dictionaries(_NAME, column, max_size=4)),
    )


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(table=tables())
def test_written_table_reads_back(table: Table, tmp_path_factory: pytest.TempPathFactory) -> None:
    """Names come back as they were, values to nine digits, times exactly, a missing value as missing."""
    path = tmp_path_factory.mktemp("tables") / "table.csv"
    write_table(table, path)
    again = read_table(path)
    assert list(again.columns) == list(table.columns)
    np.testing.assert_array_equal(again.time_s, table.time_s)
    for name, values in table.columns.items():
        np.testing.assert_allclose(again.columns[name], values, rtol=5e-9)


@pytest.mark.slow
@settings(max_examples=50, deadline=None)
@given(table=tables())
def test_reading_and_writing_settles(table: Table, tmp_path_factory: pytest.TempPathFactory) -> None:
    """A file that was read and written again is the same file."""
    folder = tmp_path_factory.mktemp("tables")
    write_table(table, folder / "one.csv")
    write_table(read_table(folder / "one.csv"), folder / "two.csv")
    assert (folder / "one.csv").read_bytes() == (folder / "two.csv").read_bytes()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "the file is empty"),
        ("\n\n", "the file is empty"),
        ("time_s,a\n", "a header without rows"),
        ("t,a\n0,1\n", "no column time_s"),
        ("time_s,a,a\n0,1,2\n", "column 'a' stands twice"),
        ("time_s,a\n0,1\n1\n", "line 3: 1 cells where the header has 2"),
        ("time_s,a\n0,1\n1,2,3\n", "line 3: 3 cells where the header has 2"),
        ("time_s,a\n0,x\n", "line 2: a = 'x': not a number"),
        ("time_s,a\n0,1\n1,nan\n", "line 3: a = nan: not a finite number"),
        ("time_s,a\n0,inf\n", "line 2: a = inf: not a finite number"),
        ("time_s,a\n0,1_000\n", "line 2: a = '1_000': not a number"),
        ("time_s,a\n0,1\n,2\n", "line 3: time_s: a number is needed"),
        ('time_s,a\n0,"1\n', "cannot be read as CSV"),
        ("time_s,a\n\n0,1\n\n\n1,x\n", "line 6: a = 'x'"),  # empty lines count, as in an editor
    ],
)
def test_bad_file_is_named_with_its_line(tmp_path: Path, content: str, message: str) -> None:
    """The line names the file, and where in it the fault lies."""
    path = tmp_path / "in.csv"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_table(path)
    assert str(caught.value).startswith(str(path))
    assert message in str(caught.value)


def test_missing_folder_or_binary_file_is_an_input_error(tmp_path: Path) -> None:
    """What cannot be read at all ends in the same kind of error."""
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00\x01time_s")
    for path in (tmp_path / "no.csv", tmp_path, tmp_path / "binary.csv"):
        with pytest.raises(InputError, match=str(path)):
            read_table(path)


def test_spreadsheet_file_is_read(tmp_path: Path) -> None:
    """A byte order mark, CRLF line ends and spaces around names and numbers do no harm."""
    (tmp_path / "in.csv").write_bytes("\ufefftime_s, a \r\n0, 1.5 \r\n1,\r\n".encode())
    table = read_table(tmp_path / "in.csv")
    np.testing.assert_array_equal(table.time_s, [0, 1])
    np.testing.assert_array_equal(table.columns["a"], [1.5, np.nan])


def test_errors_count_the_lines_of_the_file(tmp_path: Path) -> None:
    """Time that runs backwards is named by its line in the file, empty lines counted."""
    (tmp_path / "in.csv").write_text("time_s,a\n0,1\n\n2,1\n1,1\n")
    with pytest.raises(InputError, match=r"line 5: time_s = 1 does not come after 2"):
        read_table(tmp_path / "in.csv").require_increasing_time()
    (tmp_path / "in.csv").write_text("time_s,a\n\n0,1\n2,\n")
    with pytest.raises(InputError, match=r"line 4: a: a number is needed"):
        read_table(tmp_path / "in.csv").require_complete()


def test_equal_times_do_not_increase() -> None:
    """Two rows at one time are refused like time that runs backwards."""
    with pytest.raises(InputError, match="line 3"):
        Table(np.array([0.0, 0.0]), {}).require_increasing_time()


def test_interrupted_writing_leaves_the_old_file(tmp_path: Path) -> None:
    """A file is replaced only once it is whole; nothing else stays behind."""
    path = tmp_path / "out.csv"
    path.write_text("old")

    def stopped_halfway() -> None:
        with replaced_when_whole(path) as file:
            file.write("half")
            raise RuntimeError("stop")

    with pytest.raises(RuntimeError, match="stop"):
        stopped_halfway()
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["out.csv"]


def test_written_file_has_the_usual_permissions(tmp_path: Path) -> None:
    """A written file can be read by whom the umask lets, not by its owner alone."""
    (tmp_path / "plain").write_text("")
    with replaced_when_whole(tmp_path / "out.csv") as file:
        file.write("x")
    assert (tmp_path / "out.csv").stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_a_link_is_followed_and_stays(tmp_path: Path) -> None:
    """Writing through a symbolic link replaces the file that it points to, not the link."""
    (tmp_path / "real").mkdir()
    (tmp_path / "real" / "out.csv").write_text("old")
    (tmp_path / "link.csv").symlink_to(tmp_path / "real" / "out.csv")
    with replaced_when_whole(tmp_path / "link.csv") as file:
        file.write("new")
    assert (tmp_path / "link.csv").is_symlink()
    assert (tmp_path / "real" / "out.csv").read_text() == "new"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with a name here")
def test_a_pipe_is_written_to_and_not_replaced(tmp_path: Path) -> None:
    """What is no regular file (a pipe, /dev/null) stays what it is."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        with replaced_when_whole(pipe) as file:
            file.write("through")
        assert os.read(reader, 100) == b"through"
    finally:
        os.close(reader)
    assert pipe.is_fifo()


@pytest.mark.parametrize("target", ["no/such/out.csv", "file/out.csv", "."])
def test_unwritable_target_is_an_input_error(tmp_path: Path, target: str) -> None:
    """A folder that is missing, is a file, or is the target itself ends in one line."""
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError) as caught:
        write_table(Table(np.zeros(1), {}), tmp_path / target)
    assert "\n" not in str(caught.value)
    assert os.listdir(tmp_path) == ["file"]


def test_epoch_seconds_keep_their_rows(tmp_path: Path) -> None:
    """Stamps of a thousand rows a second, in epoch seconds, are written and read back as they were."""
    (tmp_path / "in.csv").write_text("time_s,a\n1778538602.521,1\n1778538602.522,2\n1778538602.523,3\n")
    table = read_table(tmp_path / "in.csv")
    write_table(table, tmp_path / "out.csv")
    again = read_table(tmp_path / "out.csv")
    again.require_increasing_time()
    np.testing.assert_array_equal(again.time_s, table.time_s)
    assert (tmp_path / "out.csv").read_text() == (tmp_path / "in.csv").read_text()


def test_times_are_written_in_the_fewest_digits(tmp_path: Path) -> None:
    """Whole seconds have no fraction, and a number that no decimal meets has as many digits as it needs."""
    write_table(Table(np.array([0.0, 0.1, 1 / 3, 2.0, 1e22]), {}), tmp_path / "out.csv")
    assert (tmp_path / "out.csv").read_text().split() == [
        "time_s", "0", "0.1", "0.3333333333333333", "2", "1e+22",
    ]  # fmt: skip


@pytest.mark.parametrize("start", [0.1, -3.0, 23.75, 86400.5, 1.7e9, 1778538602.521])
def test_a_clock_of_its_own_has_lost_no_millisecond(start: float) -> None:
    """Whenever a trial began, its own clock shows the times of the same trial begun at zero."""
    texts = [f"{0.0025 * row:.4f}" for row in range(400)]
    stamps = np.array([float(f"{start + float(text):.4f}") for text in texts])
    np.testing.assert_allclose(own_clock(stamps), [float(text) for text in texts], rtol=1e-14, atol=1e-14)


def test_a_clock_that_starts_at_zero_is_left_alone() -> None:
    """Not a bit of it changes; and rows that lie closer than stamps of their size can tell stay apart."""
    time_s = np.cumsum(np.full(100, 0.1)) - 0.1
    assert own_clock(time_s) is time_s
    close = 1.7e9 + np.spacing(1.7e9) * np.arange(5)
    assert (np.diff(own_clock(close)) > 0).all()
    assert own_clock(np.zeros(0)).tolist() == []


@pytest.mark.parametrize("time", [1e308, -1e308, 1778538602521.0])
def test_a_time_that_is_no_seconds_is_refused(time: float) -> None:
    """Milliseconds since 1970 and numbers that overflow are named with their line."""
    with pytest.raises(
        InputError, match=r"line 3: time_s = .*must lie within 1e\+11 s; is the column in sec"
    ):
        Table(np.array([0.0, time]), {}).require_increasing_time()


def test_equal_epoch_seconds_are_shown_with_all_digits() -> None:
    """The two times that a message compares can be told apart, or seen to be equal."""
    with pytest.raises(InputError, match=r"time_s = 1700000000.5 does not come after 1700000000.75"):
        Table(np.array([1700000000.75, 1700000000.5]), {}).require_increasing_time()


@pytest.mark.slow
def test_too_many_rows_are_refused(tmp_path: Path) -> None:
    """Half a million rows end in one line, as many as are taken are read."""
    rows = [f"{row},0" for row in range(500_000)]
    for count, wrong in ((500_000, True), (MAX_ROWS + 1, True), (MAX_ROWS, False)):
        (tmp_path / "in.csv").write_text("\n".join(["time_s,a", *rows[:count]]))
        if wrong:
            with pytest.raises(InputError, match=r"in\.csv: more than 100000 rows; thin them out"):
                read_table(tmp_path / "in.csv")
        else:
            assert len(read_table(tmp_path / "in.csv").time_s) == MAX_ROWS


def test_columns_that_are_not_asked_for_may_hold_anything(tmp_path: Path) -> None:
    """They are named and not read: labels, twice the same name, none at all."""
    (tmp_path / "in.csv").write_text("label,time_s,a,b,b,\nrest,0,1,x,y,\npull,1,2,,,\n")
    table = read_table(tmp_path / "in.csv", only=["a"])
    assert table.ignored == ("label", "b", "b", "")
    assert {name: values.tolist() for name, values in table.columns.items()} == {"a": [1, 2]}
    with pytest.raises(InputError, match="line 2: label = 'rest': not a number"):
        read_table(tmp_path / "in.csv", only=["a", "label"])
    with pytest.raises(InputError, match="column 'b' stands twice"):
        read_table(tmp_path / "in.csv", only=["b"])


@pytest.mark.parametrize(
    "content", ["w" * 10**6, "time_s,a\n0," + "w" * 10**5, "w" * 10**5 + ",time_s\nx,0\n"], ids=len
)
def test_a_file_of_one_endless_word_gets_a_short_answer(tmp_path: Path, content: str) -> None:
    """A message never shows a whole cell or header."""
    (tmp_path / "in.csv").write_text(content)
    with pytest.raises(InputError) as caught:
        read_table(tmp_path / "in.csv")
    assert len(str(caught.value)) <= 500


def test_a_comparisons_picture_has_a_third_panel_with_the_difference() -> None:
    """First, second over first on one scale, second minus first: a row of panels for each column."""
    time_s = np.array([0.0, 1.0, 2.0])
    first = Table(time_s, {"tip_x_mm": np.array([0.0, 1.0, 4.0]), "tip_z_mm": np.array([9.0, 9, 8])}, "a")
    second = Table(time_s, {"tip_x_mm": np.array([0.5, 2.0, 7.0]), "tip_z_mm": np.array([9.0, 9, 9])}, "b")
    panels = compare_tables(first, second).figure().axes
    assert len(panels) == 6
    for row, name in enumerate(("tip_x_mm", "tip_z_mm")):
        alone, both, apart = panels[3 * row : 3 * row + 3]
        one, other = first.columns[name], second.columns[name]
        assert alone.lines[-1].get_ydata() == pytest.approx(one)
        assert both.lines[-1].get_ydata() == pytest.approx(other)
        assert apart.lines[-1].get_ydata() == pytest.approx(other - one)
        assert alone.get_ylim() == both.get_ylim()
