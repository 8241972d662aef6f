"""A chain of hinges with tendons, from MJCF: what it says comes back, and plain MuJoCo bends it the same."""

from __future__ import annotations

import re
from pathlib import Path

import mujoco
import numpy as np
import pytest

import catheter_sim as cs
from catheter_sim.catalogue import robot_toml
from catheter_sim.cli.main import main
from catheter_sim.diagnosis.data.dataset import load_dataset
from catheter_sim.errors import InputError
from catheter_sim.kinds.continuum.from_mjcf import read_chain

MODELS = Path(__file__).parents[3] / "models"
LINKS, LENGTH_M, HOLE_M = 6, 0.02, 0.004


def chain_xml(
    *,
    joint: str = "",
    stiffness: float = 0.05,
    servo: bool = False,
    softer_from: int = LINKS + 1,
    crooked: bool = False,
    ends: tuple[int, int] = (LINKS, LINKS),
) -> str:
    """Return a chain that hangs down, somebody's own: hinges about -x, then y; sites named as they like."""

    def link(k: int) -> str:
        if k > LINKS:
            return ""
        held = stiffness * (0.5 if k >= softer_from else 1.0)
        above = LENGTH_M / 2 if k == 1 else LENGTH_M
        aside = 0.005 if crooked and k == 3 else 0.0
        face = -LENGTH_M / 2
        holes = "".join(
            f'<site name="{side}{k}" pos="{sign * HOLE_M} 0 {face}"/>'
            for side, sign, end in (("a", 1, ends[0]), ("b", -1, ends[1]))
            if k <= end
        )
        spring = f'stiffness="{held}" damping="{0.02 * held}"'
        return f"""<body pos="{aside} 0 {-above}">
          <joint type="hinge" axis="-1 0 0" {spring}/>
          <joint type="hinge" axis="0 1 0" {spring}/>{joint if k == 2 else ""}
          <geom type="cylinder" size="0.006 0.002" pos="0 0 {face}" mass="0.003"/>{holes}{link(k + 1)}
        </body>"""

    drives = "".join(
        f'<position tendon="{name}" kp="800"/>' if servo else f'<motor tendon="{name}" gear="-1"/>'
        for name in ("pull-a", "pull-b")
    )
    ways = "".join(
        f'<spatial name="pull-{side}"><site site="{side}0"/>'
        + "".join(f'<site site="{side}{k}"/>' for k in range(1, end + 1))
        + "</spatial>"
        for side, end in zip("ab", ends, strict=True)
    )
    return f"""<mujoco><option gravity="0 0 0" timestep="0.001"/><worldbody><body pos="0.1 0.2 1">
      <site name="a0" pos="{HOLE_M} 0 0"/><site name="b0" pos="{-HOLE_M} 0 0"/>{link(1)}
    </body></worldbody><tendon>{ways}</tendon><actuator>{drives}</actuator></mujoco>"""


def saved(folder: Path, **changes: object) -> Path:
    """Return such a chain's file."""
    path = folder / "hanging.xml"
    path.write_text(chain_xml(**changes))  # type: ignore[arg-type]
    return path


@pytest.mark.parametrize("name", ["neuroendoscope_section", "neuroendoscope", "spacer_disk"])
def test_what_this_package_builds_comes_back(name: str) -> None:
    """Lengths, stiffnesses, masses, disks, holes: as they were in the robot's file."""
    robot, again = cs.load_robot(name), read_chain(MODELS / f"{name}.xml").robot
    assert (again.links_per_subsegment, again.masses, again.actuation) == (
        robot.links_per_subsegment,
        robot.masses,
        robot.actuation,
    )
    for before, after in zip(robot.segments, again.segments, strict=True):
        assert (after.disks, after.bending_axes) == (before.disks, before.bending_axes)
        for key in ("length_m", "bending_stiffness_N_m2", "torsion_stiffness_N_m2", "mass_kg"):
            assert getattr(after, key) == pytest.approx(getattr(before, key), rel=1e-6), key
    ends = dict(zip([item.name for item in robot.segments], again.segments, strict=True))
    for before, after in zip(robot.tendons, again.tendons, strict=True):
        assert after.name == before.name
        assert after.ends_at == ends[before.ends_at].name
        assert after.radius_m == pytest.approx(before.radius_m, rel=1e-6)
        assert np.cos(after.angle_rad - before.angle_rad) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("softer_from", [LINKS + 1, 4])
def test_somebodys_chain_bends_as_in_plain_mujoco(tmp_path: Path, softer_from: int) -> None:
    """A chain that hangs down elsewhere, pulled at one tendon, its outer half as stiff or half so."""
    path = saved(tmp_path, softer_from=softer_from)
    read = read_chain(path)
    assert [item.disks for item in read.robot.segments] == ([LINKS] if softer_from > LINKS else [3, 3])
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    data.ctrl[0] = pull = 2.0
    mujoco.mj_step(model, data, 6000)
    assert np.abs(data.qvel).max() < 1e-6
    ours = cs.simulate(read.robot, {"time_s": [0.0], "tension_pull_a_N": [pull], "tension_pull_b_N": [0.0]})
    tip = ours.to_table([f"tip_{axis}_mm" for axis in "xyz"]).columns
    plain = 1e3 * (
        data.body(model.nbody - 1).xpos + data.body(model.nbody - 1).xmat.reshape(3, 3) @ [0, 0, -0.01]
    )
    base = 1e3 * np.array([0.1, 0.2, 1.0])
    down = base[2] - plain[2]
    assert np.linalg.norm(plain - base - [0.0, 0.0, -120.0]) > 20.0
    assert float(tip["tip_z_mm"][0]) == pytest.approx(down, abs=0.005)
    sideways = np.hypot(float(tip["tip_x_mm"][0]), float(tip["tip_y_mm"][0]))
    assert sideways == pytest.approx(np.hypot(*(plain - base)[:2]), abs=0.005)


def test_what_bends_about_the_files_x_alone_bends_toward_x(tmp_path: Path) -> None:
    """A planar chain in the file's yz plane is one in the robot's xz plane, and its tendons are."""
    path = tmp_path / "planar.xml"
    path.write_text(re.sub(r'<joint type="hinge" axis="0 1 0"[^>]*>', "", chain_xml()).replace(
        f'pos="{HOLE_M} 0', f'pos="0 {HOLE_M}').replace(f'pos="{-HOLE_M} 0', f'pos="0 {-HOLE_M}')
    )  # fmt: skip
    robot = read_chain(path).robot
    assert [item.bending_axes for item in robot.segments] == ["x"]
    assert sorted(np.cos([item.angle_rad for item in robot.tendons])) == pytest.approx([-1.0, 1.0])
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    data.ctrl[0] = 2.0
    mujoco.mj_step(model, data, 6000)
    ours = cs.simulate(robot, {"time_s": [0.0], "tension_pull_a_N": [2.0], "tension_pull_b_N": [0.0]})
    bend_rad = np.sum(ours.postures[0].joint_angles)
    assert abs(bend_rad) == pytest.approx(abs(data.qpos.sum()), rel=1e-4)


def test_the_file_of_it_is_a_robots(tmp_path: Path) -> None:
    """Written and loaded it is the same robot; a name may be given."""
    read = read_chain(saved(tmp_path), name="hanging_two")
    (tmp_path / "robot.toml").write_text(robot_toml(read.robot))
    assert cs.load_robot(tmp_path / "robot.toml").segments == read.robot.segments
    assert read.robot.name == "hanging_two"
    assert read.robot.dynamics.damping_time_s == pytest.approx(0.02)
    assert any("gravity" in note for note in read.notes)


def test_a_model_stands_where_a_robots_file_does(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """In Python, on the command line, with settings; a data set's path is from its own folder."""
    path = saved(tmp_path)
    robot = cs.load_robot(path, {"friction.mu": 0.2})
    assert robot.friction.mu == 0.2
    assert robot.segments == read_chain(path).robot.segments
    assert main(["list", str(path)]) == 0
    assert "friction.mu = 0: MJCF knows none at holes" in capsys.readouterr().out
    monkeypatch.chdir(tmp_path)
    assert main(["new", "dataset", "data", "--robot", path.name]) == 0
    assert 'robot = "../hanging.xml"' in Path("data/dataset.toml").read_text()
    Path("data/trial_01.csv").write_text("time_s,tension_pull_a_N,tip_z_mm\n0,0,120\n1,1,110\n2,2,90\n")
    channels = 'inputs = ["tension_pull_a_N"]\noutputs = ["tip_z_mm"]'
    trial = '[[trials]]\nfile = "trial_01.csv"\nrole = "train"'
    Path("data/dataset.toml").write_text(
        '[dataset]\nname = "hanging"\nrobot = "../hanging.xml"\nsource = "by hand"\nlicence = "MIT"\n'
        f"[conditions]\ngravity_mps2 = [0.0, 0.0, 0.0]\n[channels]\n{channels}\n{trial}\n"
    )
    assert load_dataset(Path("data")).robot.segments == robot.segments


def test_servos_draw_tendons_through_springs(tmp_path: Path) -> None:
    """A position servo is a displacement with its stiffness; tendons that end earlier cut the segments."""
    robot = read_chain(saved(tmp_path, servo=True, ends=(LINKS, 2))).robot
    assert robot.actuation == "displacement"
    assert [item.stiffness_N_per_m for item in robot.tendons] == [800.0, 800.0]
    assert [item.disks for item in robot.segments] == [2, 4]
    assert [item.ends_at for item in robot.tendons] == ["segment_2", "segment_1"]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"joint": '<joint type="slide" name="out"/>'}, "joint out is no hinge"),
        ({"joint": '<joint type="hinge" axis="1 0 1" name="askew"/>'}, "neither at right angles nor along"),
        ({"crooked": True}, "mm off a line"),
        ({"stiffness": 0.0}, "joint number 0 has no stiffness"),
        ({"joint": '<joint type="hinge" axis="0 0 1" name="loose"/>'}, "joint loose has no stiffness"),
    ],
)
def test_what_is_no_straight_elastic_chain_is_refused(
    tmp_path: Path, changes: dict[str, object], message: str
) -> None:
    """One line names the file and the joint."""
    path = saved(tmp_path, **changes)
    with pytest.raises(InputError, match=message) as caught:
        read_chain(path)
    assert str(caught.value).startswith(str(path))


def test_files_that_are_no_models(tmp_path: Path) -> None:
    """No file, no MJCF, nothing that moves, two arms."""
    with pytest.raises(InputError, match="no such file"):
        read_chain(tmp_path / "none.xml")
    broken = tmp_path / "broken.xml"
    for text, message in (
        ("<mujoco", "MuJoCo cannot read it"),
        ("<mujoco><worldbody/></mujoco>", "nothing moves"),
        (
            "<mujoco><worldbody>"
            + 2 * '<body><joint stiffness="1"/><geom size="0.01"/></body>'
            + "</worldbody></mujoco>",
            "only a single chain",
        ),
    ):
        broken.write_text(text)
        with pytest.raises(InputError, match=message):
            read_chain(broken)
