"""Files as trackers export them, in the layouts that their makers describe; the numbers are made up."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from catheter_sim.diagnosis.mapping import read_raw
from catheter_sim.errors import InputError

HEAD = (
    "Format Version,1.23,Take Name,Take 7,Take Notes,,Capture Frame Rate,120.000000,"
    "Export Frame Rate,120.000000,"
    "Capture Start Time,2026-05-11 06.30.02.125 PM,Total Frames in Take,3,Total Exported Frames,3,"
    "Rotation Type,Quaternion,Length Units,Meters,Coordinate Space,Global\n\n"
)
BODY = "Rigid Body," * 7
MOTIVE = (
    f"{HEAD},,{BODY}Rigid Body,Marker,Marker,Marker\n"
    f",,{'Tool,' * 8}Tool:Marker1,Tool:Marker1,Tool:Marker1\n"
    ",,1,1,1,1,1,1,1,1,2,2,2\n"
    f",,{'Rotation,' * 4}{'Position,' * 3}Mean Marker Error,Position,Position,Position\n"
    "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,,X,Y,Z\n"
    "0,0.000000,0,0,0,1,0.1,0.9,0.2,0.0001,0.11,0.91,0.21\n"
    "1,0.008333,0,0,0,1,0.2,0.8,0.3,0.0001,,,\n"
    "2,0.016667,0,0,0,1,0.3,0.7,0.4,0.0001,0.31,0.71,0.41\n"
)
NEWER = (
    HEAD.replace("1.23", "1.25").replace("Meters", "Millimeters")
    + ",Type,Marker,Marker,Marker\n,Name,Tip,Tip,Tip\n,ID,9F:1,9F:1,9F:1\n,Parent,,,\n"
    ",,Position,Position,Position\nFrame,Time (Seconds),X,Y,Z\n0,0,1,2,3\n1,0.008333,4,5,6\n"
)
VICON = """\
Devices
200
,,Imported Analog #1 - Motor,
Frame,Sub Frame,bending,feed
,,deg,V
1,0,10,0.1
1,1,11,0.1
2,0,20,0.2
2,1,21,0.2

Trajectories
100
,,Arm:Tip,,,Arm:Base,,
Frame,Sub Frame,X,Y,Z,X,Y,Z
,,mm,mm,mm,mm,mm,mm
1,0,1,2,3,0,0,0
2,0,4,5,6,0,0,
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "take.csv"
    path.write_text(text)
    return path


def test_motive_columns_carry_object_kind_and_axis(tmp_path: Path) -> None:
    """A rigid body's position is not its rotation, nor a marker's; gaps are missing values."""
    raw = read_raw(written(tmp_path, MOTIVE))
    assert raw.layout == "motive"
    np.testing.assert_allclose(raw.numbers("Tool Position Y", "map"), [0.9, 0.8, 0.7])
    np.testing.assert_allclose(raw.numbers("Tool Rotation W", "map"), [1.0, 1.0, 1.0])
    np.testing.assert_allclose(raw.numbers("Tool:Marker1 Position X", "map"), [0.11, np.nan, 0.31])
    np.testing.assert_allclose(raw.numbers("Time (Seconds)", "map"), [0.0, 0.008333, 0.016667])
    assert raw.units["Tool Position Y"] == "m"
    assert "Tool Rotation W" not in raw.units
    assert raw.lines == (8, 9, 10)


def test_newer_motive_names_its_rows(tmp_path: Path) -> None:
    """Format versions from 1.24 on begin the head's rows with Type, Name, ID, Parent."""
    raw = read_raw(written(tmp_path, NEWER))
    assert raw.names == ("Frame", "Time (Seconds)", "Tip Position X", "Tip Position Y", "Tip Position Z")
    assert raw.units["Tip Position X"] == "mm"


@pytest.mark.parametrize("sign", [",", ";", "\t"])
def test_vicon_trajectories_stand_beside_what_devices_measured(sign: str, tmp_path: Path) -> None:
    """Of a faster device the first sub-frame of each frame is taken; units are the file's own."""
    raw = read_raw(written(tmp_path, VICON.replace(",", sign)))
    assert raw.layout == "vicon"
    np.testing.assert_allclose(raw.numbers("Arm:Tip Z", "map"), [3.0, 6.0])
    np.testing.assert_allclose(raw.numbers("Arm:Base Z", "map"), [0.0, np.nan])
    np.testing.assert_allclose(raw.numbers("Imported Analog #1 - Motor bending", "map"), [10.0, 20.0])
    np.testing.assert_allclose(raw.numbers("time (seconds)", "map"), [0.01, 0.02])
    assert raw.units["Arm:Tip Z"] == "mm"
    assert raw.units["Imported Analog #1 - Motor feed"] == "V"


def test_columns_of_one_name_are_numbered(tmp_path: Path) -> None:
    """A plain table's head may repeat itself; each column keeps a name of its own."""
    raw = read_raw(written(tmp_path, "# a logger's note\nt;x;x\n0,5;1,25;2\n"))
    assert raw.names == ("t", "x", "x #2")
    np.testing.assert_allclose(raw.numbers("x", "map"), [1.25])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("\n\n", "the file is empty"),
        ("1,2\n3,4\n", "line 1: a row of names is needed"),
        ("a,b\n", "a header without rows"),
        ("a,b\n1,2,3\n", "line 2: 3 cells where the header has 2"),
        (MOTIVE.replace("Frame,Time", "Row,Time"), "an export of Motive without its row Frame"),
        (VICON.replace("Trajectories", "Model Outputs"), "without a section Trajectories; sections: devices"),
        (VICON.replace("\n100\n", "\nfast\n"), "Trajectories: a rate in Hz"),
        (
            VICON.replace("Frame,Sub Frame,X", "No,Sub Frame,X"),
            "Trajectories: Frame, Sub Frame, ... is needed",
        ),
    ],
)
def test_broken_files_are_refused_in_one_line(text: str, message: str, tmp_path: Path) -> None:
    """The line names the file, and the line where there is one."""
    path = written(tmp_path, text)
    with pytest.raises(InputError) as caught:
        read_raw(path)
    assert str(caught.value).startswith(str(path))
    assert message in str(caught.value)
