"""A chain of hinges with tendons, from MJCF: what it says comes back, and plain MuJoCo bends it the same."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import catheter_sim as cs
from catheter_sim.catalogue import robot_toml
from catheter_sim.cli.main import main
from catheter_sim.diagnosis.dataset import load_dataset
from catheter_sim.errors import InputError
from catheter_sim.robots.continuum.from_mjcf import read_chain
from catheter_sim.robots.continuum.twin import twin

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


@pytest.mark.slow
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


@pytest.mark.slow
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


@pytest.mark.slow
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


@pytest.mark.slow
def test_the_file_of_it_is_a_robots(tmp_path: Path) -> None:
    """Written and loaded it is the same robot; a name may be given."""
    read = read_chain(saved(tmp_path), name="hanging_two")
    (tmp_path / "robot.toml").write_text(robot_toml(read.robot))
    assert cs.load_robot(tmp_path / "robot.toml").segments == read.robot.segments
    assert read.robot.name == "hanging_two"
    assert read.robot.dynamics.damping_time_s == pytest.approx(0.02)
    assert any("gravity" in note for note in read.notes)


@pytest.mark.slow
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


@pytest.mark.slow
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


def rising_xml(
    *,
    gaps_mm: Sequence[float] = 6 * (10.0,),
    axes: Sequence[str] = ("0 1 0",),
    aside_mm: Sequence[float] = (2.0, 0.0),
    above_mm: float = 0.0,
    stiffness: Sequence[float] = (0.02,),
    tendons: Sequence[tuple[str, float, int]] = (("t", 1.0, 6),),
    base_mm: float = 0.0,
    pose: str = "",
    gravity: str = "0 0 0",
    end: str = '<site name="tip" pos="0 0 0.01"/>',
    tendon: str = "",
    taper_mm: float = 0.0,
) -> str:
    """Return somebody's chain that rises from its base, as most are written: sites in the hinges' planes.

    Args: of the hinges their distances, axes and stiffnesses, in turn; of the holes their place at a tendon's
    share of 1, and their height above the hinge; of the tendons name, share and last link.
    """

    def holes(link: int, height_mm: float) -> str:
        shares = ((name, share * (1.0 - taper_mm * link)) for name, share, last in tendons if link <= last)
        return "".join(
            f'<site name="{name}{link}" pos="{1e-3 * s * aside_mm[0]} {1e-3 * s * aside_mm[1]} '
            f'{1e-3 * height_mm}"/>'
            for name, s in shares
        )

    text = ""
    for k, gap in reversed(list(enumerate(gaps_mm, start=1))):
        height = gap + (base_mm if k == 1 else 0.0)
        held = stiffness[(k - 1) % len(stiffness)]
        text = (
            f'<body name="b{k}" pos="0 0 {1e-3 * height}"><joint axis="{axes[(k - 1) % len(axes)]}" '
            f'stiffness="{held}" damping="{0.025 * held}" armature="1e-6"/><geom type="capsule" '
            f'pos="0 0 0.005" size="0.0015 0.003" mass="5e-4"/>{holes(k, above_mm)}'
            f"{text or end}</body>"
        )
    ways = "".join(
        f'<spatial name="{name}" {tendon}>'
        + "".join(f'<site site="{name}{k}"/>' for k in range(last + 1))
        + "</spatial>"
        for name, _, last in tendons
    )
    motors = "".join(f'<motor tendon="{name}" gear="-1"/>' for name, _, _ in tendons)
    return (
        f'<mujoco><compiler angle="degree"/><option gravity="{gravity}" timestep="0.001" '
        f'integrator="implicitfast"><flag contact="disable"/></option><worldbody><body name="foot" {pose}>'
        f"{holes(0, base_mm)}{text}</body></worldbody><tendon>{ways}</tendon>"
        f"<actuator>{motors}</actuator></mujoco>"
    )


PAIR = (("t", 1.0, 6), ("u", -1.0, 6), ("v", 0.75, 3))
LAYOUTS: dict[str, dict[str, Any]] = {
    "in the hinges' planes": {},
    "about x": {"axes": ("1 0 0",), "aside_mm": (0.0, 2.0)},
    "about x and y in turn": {"axes": ("0 1 0", "1 0 0"), "aside_mm": (1.5, 1.5)},
    "above the hinges": {"above_mm": 2.0},
    "below the hinges": {"above_mm": -2.0},
    "between the hinges": {"above_mm": 5.0},
    "unequal links": {"gaps_mm": (10.0, 12.0, 8.0, 15.0, 7.0, 11.0)},
    "a base with its own length": {"base_mm": 30.0},
    "several tendons": {"tendons": PAIR},
    "unequal stiffnesses": {"stiffness": (0.04, 0.03, 0.025, 0.02, 0.015, 0.01)},
    "its own weight": {"gravity": "0 0 -9.81"},
}


def plain_tips_mm(path: Path, pulls: Sequence[float]) -> np.ndarray:
    """Return where plain MuJoCo has the tip at rest in the base body, the first tendon pulled, (r, 3)."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    tips = []
    for pull in pulls:
        data.ctrl[0] = pull
        mujoco.mj_step(model, data, 15000)
        assert np.abs(data.qvel).max() < 1e-6
        base = data.body("foot")
        tips.append(1e3 * base.xmat.reshape(3, 3).T @ (data.site("tip").xpos - base.xpos))
    return np.array(tips)


@pytest.mark.slow
@pytest.mark.parametrize("layout", LAYOUTS)
def test_holes_stay_where_they_are(tmp_path: Path, layout: str) -> None:
    """In the file's own frame the tip is where plain MuJoCo has it; the fast model has it nearly there."""
    path = tmp_path / "rising.xml"
    path.write_text(rising_xml(**LAYOUTS[layout]))
    with pytest.warns(cs.RobotNote, match=r"rising.xml: 0 % of bend and 0 mm off .*; base = file's$"):
        robot = read_chain(path).robot
    gravity = (0.0, 0.0, -9.81) if "gravity" in LAYOUTS[layout] else (0.0, 0.0, 0.0)
    inputs = cs.inputs(robot, {"time_s": [0.0, 1.0, 2.0], "tension_t_N": [0.0, 1.0, 1.7]})
    ours = cs.simulate(robot, inputs, gravity_mps2=gravity)
    tips_mm = 1e3 * np.array([posture.p_w[-1] for posture in ours.postures])
    plain = plain_tips_mm(path, (0.0, 1.0, 1.7))
    assert np.linalg.norm(plain[2] - plain[0]) > 15.0
    np.testing.assert_allclose(tips_mm, plain, atol=0.01)
    last = len(ours.postures[0].p_w) - 1
    fast = twin(robot, "tension").solve([robot], [inputs], np.array(gravity), [last], 1)
    np.testing.assert_allclose(1e3 * fast.p_w[0, :, 0], plain, atol=0.005 * 70.0)


@pytest.mark.slow
def test_a_hinge_bends_as_its_moment_says(tmp_path: Path) -> None:
    """k q = T r: with holes 2 mm off the hinges, in their planes, 1 N bends 0.02 N m/rad by 5.70 deg."""
    path = tmp_path / "rising.xml"
    path.write_text(rising_xml())
    inputs = {"time_s": [0.0, 1.0], "tension_t_N": [1.0, 2.0]}
    bends = cs.simulate(path, inputs).to_table([f"joint_x{k}_deg" for k in range(1, 7)]).columns
    for bend in bends.values():
        np.testing.assert_allclose(bend, [5.70, 11.23], atol=0.005)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"pose": 'pos="0.1 0.2 0.3" euler="0 0 30"'}, "base = file's (body foot)"),
        ({"pose": 'euler="180 0 0"'}, "base = file's (body foot)"),
        (
            {"axes": ("0.70710678 0.70710678 0",), "aside_mm": (1.4142, -1.4142)},
            "base = file's, turned by -45 deg about z",
        ),
    ],
)
def test_what_becomes_of_the_frame_is_said(tmp_path: Path, changes: dict[str, object], said: str) -> None:
    """It is the base body's; hinges askew in that turn it."""
    path = tmp_path / "rising.xml"
    path.write_text(rising_xml(**changes))  # type: ignore[arg-type]
    with pytest.warns(cs.RobotNote) as notes:
        read = read_chain(path)
    assert str(notes[0].message).endswith(said)
    assert said in read.robot.description


def test_a_chain_beside_its_bodys_origin_is_shifted(tmp_path: Path) -> None:
    """The base is on the chain, where its first holes are; the note says by how much, in the file's frame."""
    text = rising_xml(base_mm=30.0)
    text = text.replace('<site name="t0" pos="0.002 0.0 ', '<site name="t0" pos="0.006 0.0 ')
    path = tmp_path / "rising.xml"
    path.write_text(text.replace('<body name="b1" pos="0 0 ', '<body name="b1" pos="0.004 0 '))
    with pytest.warns(cs.RobotNote, match=r"0 % of bend .*; base = file's, shifted by \(4, 0, 30\) mm$"):
        read_chain(path)


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"taper_mm": 0.07}, "holes up to .* mm from their median place"),
        ({"tendon": 'stiffness="500" springlength="0.06"'}, "left out: springs of tendons"),
        ({"skip": "t3"}, "led through 1 more disks"),
        ({"skip": "t0"}, "no site on the base"),
    ],
)
def test_another_robot_is_refused(tmp_path: Path, changes: dict[str, object], why: str) -> None:
    """Where it would bend by more than 2 % otherwise, one line says by how much, and why."""
    text = rising_xml(**{key: value for key, value in changes.items() if key != "skip"})  # type: ignore[arg-type]
    path = tmp_path / "rising.xml"
    path.write_text(text.replace(f'<site site="{changes.get("skip")}"/>', ""))
    with pytest.raises(
        InputError, match=f"% of bend and .* mm.* off the file in MuJoCo.*: .*{why}"
    ) as caught:
        read_chain(path)
    share = re.search(r"would be (\S+) % of bend", str(caught.value))
    assert share
    assert float(share[1]) > 2.0
