"""Claims about what numbers of causes do to a model, against MuJoCo's own elements and by hand."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from mujoco import rollout

from catheter_sim.foreign.extended import extended_text
from catheter_sim.foreign.model import (
    ForeignModel,
    ForeignTrial,
    Runner,
    add_mass,
    arriving_controls,
    changed,
    variants_of,
)
from tests.foreign.recorded import FILE, OUTPUTS

MODEL = ForeignModel(FILE, (0.0, 0.0, -9.81)).measured(OUTPUTS, "test")
NUMBERS = {number.name: number for item in variants_of(MODEL) for number in item.numbers}
TIME_S = np.linspace(0.0, 1.0, 51)
WAVE = np.stack([0.4 * np.sin(5.0 * TIME_S), 0.6 * np.sin(3.0 * TIME_S)], axis=1)
TRIAL = ForeignTrial("wave", "train", TIME_S, WAVE, np.zeros((51, len(OUTPUTS))))


def played(**values: float) -> np.ndarray:
    numbers = {NUMBERS[name]: value for name, value in values.items()}
    return Runner(MODEL).outputs([numbers], [TRIAL])[0][0]


def by_hand(spec: mujoco.MjSpec) -> np.ndarray:
    """Return the outputs of a model in a plain loop."""
    spec.option.gravity = [0.0, 0.0, -9.81]
    model = spec.compile()
    data, found = mujoco.MjData(model), []
    for step in range(501):
        now = step * model.opt.timestep
        data.ctrl[:] = [np.interp(now, TIME_S, WAVE[:, k]) for k in range(2)]
        if step % 10 == 0:
            mujoco.mj_kinematics(model, data)
            found.append([*np.degrees(data.qpos[:2]), *(1e3 * data.site("end").xpos[[0, 2]])])
        mujoco.mj_step(model, data)
    return np.array(found)


def test_a_model_is_run_as_mujoco_runs_it() -> None:
    assert played() == pytest.approx(by_hand(mujoco.MjSpec.from_file(str(FILE))), abs=1e-6)


def test_a_mass_is_a_ball_that_is_welded_on() -> None:
    spec = mujoco.MjSpec.from_file(str(FILE))
    ball = spec.body("lower").add_body(name="ball", pos=[0.02, 0.0, -0.2])
    ball.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[1e-4, 0, 0], mass=0.15, contype=0, conaffinity=0)
    own = played(mass_lower_g=150.0, place_lower_x_mm=20.0, place_lower_z_mm=-75.0)
    assert own == pytest.approx(by_hand(spec), abs=1e-3)
    assert np.abs(own - played()).max() > 1.0  # it matters


def test_a_mass_at_the_centre_changes_no_axes() -> None:
    model = mujoco.MjModel.from_xml_path(str(FILE))
    body = model.body("lower").id
    before, inertia = float(model.body_mass[body]), sorted(model.body_inertia[body])
    add_mass(model, body, 0.3, np.zeros(3))
    assert model.body_mass[body] == pytest.approx(before + 0.3)
    assert sorted(model.body_inertia[body]) == pytest.approx(inertia)


@pytest.mark.parametrize(
    "values",
    [
        {"damping_first": 0.4},
        {"friction_second": 0.3},
        {"scale_springs": 3.0},
        {"scale_servo_two": 0.5},
        {"mass_lower_g": 200.0, "place_lower_z_mm": -60.0},
        {"scale_one": 1.2},
        {"offset_two": 0.1},
    ],
)
def test_the_extended_file_moves_as_the_fit_does(values: dict[str, float], tmp_path: Path) -> None:
    numbers = {NUMBERS[name]: value for name, value in values.items()}
    text, left = extended_text(MODEL, numbers)
    (tmp_path / "model.xml").write_text(text)
    own = played(**values)
    assert left == ()
    assert own == pytest.approx(by_hand(mujoco.MjSpec.from_file(str(tmp_path / "model.xml"))), abs=0.02)
    assert np.abs(own - played()).max() > 0.5


AWKWARD = """<mujoco><compiler angle="degree" meshdir="m"/><include file="parts/classes.xml"/>
<worldbody><frame pos="0 0 0.1234567890123"><body pos="0 0 1"><body pos="0.3333333333333333 0 0">
<frame euler="0 10 0"><joint axis="0 1 0"/></frame><geom fromto="0 0 0 0.2 0 0"/></body>
<geom fromto="0 0 0 0.3333333333333333 0 0"/><joint name="first" class="sprung" axis="0 1 0"/></body></frame>
</worldbody>
<tendon><fixed name="cord" stiffness="3.3333333333333335"><joint joint="first" coef="0.01"/></fixed></tendon>
<actuator><position joint="first" dampratio="0.7" kp="31.41592653589793" inheritrange="1"/>
<motor tendon="cord"/>
<velocity joint="first" kv="0.1234567890123" ctrlrange="-1 1"/></actuator></mujoco>"""
CLASSES = """<mujocoinclude><default><geom type="capsule" size="0.02" contype="0"/><general gear="2"/>
<default class="sprung"><joint springdamper="0.1 0.9" range="-90.123456789012 45" damping="7"/></default>
</default></mujocoinclude>"""


def test_the_written_file_is_the_extended_model_to_the_last_digit(tmp_path: Path) -> None:
    """Classes, shortcuts, an included file, names that are missing, joints after the bodies behind them."""
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "classes.xml").write_text(CLASSES)
    (tmp_path / "arm.xml").write_text(AWKWARD)
    model = ForeignModel(tmp_path / "arm.xml", (0.1234567890123, 0.0, -9.81))
    numbers = {number.name: number for item in variants_of(model) for number in item.numbers}
    values = {
        numbers[name]: 1.1 + 1e-13 * k
        for k, name in enumerate(
            (
                "damping_2",
                "friction_first",
                "scale_springs",
                "scale_servo_1",
                "scale_1",
                "offset_1",
                "scale_2",
            )
        )
    }
    text, left = extended_text(model, values)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "model.xml").write_text(text)
    written = mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "model.xml"))
    wanted = changed(
        model, {n: v for n, v in values.items() if not n.name.startswith(("scale_1", "scale_2", "off"))}
    )
    scale, gain, offset = (values[numbers[name]] for name in ("scale_servo_1", "scale_1", "offset_1"))
    own = model.compiled.actuator_gainprm[0, 0]
    wanted.actuator_gainprm[0, 0] *= gain
    wanted.actuator_biasprm[0, 0] += scale * own * offset
    wanted.actuator_gainprm[1, 0] *= values[numbers["scale_2"]]
    assert left == ()
    for field in dir(wanted):
        value = getattr(wanted, field)
        if isinstance(value, np.ndarray) and np.issubdtype(value.dtype, np.floating):
            np.testing.assert_allclose(getattr(written, field), value, rtol=1e-12, atol=1e-15, err_msg=field)
    assert "0.1234567890123" in text


def test_an_element_that_the_text_only_makes_is_left_out(tmp_path: Path) -> None:
    """Three links by `replicate`: which of them a number is of, the text cannot say."""
    link = '<body><joint name="j" axis="0 1 0" stiffness="1"/><geom size="0.02"/></body>'
    body = f'<replicate count="3" offset="0.1 0 0">{link}</replicate>'
    text = f'<mujoco><worldbody>{body}</worldbody><actuator><motor joint="j0"/></actuator></mujoco>'
    (tmp_path / "three.xml").write_text(text)
    model = ForeignModel(tmp_path / "three.xml")
    numbers = {number.name: number for item in variants_of(model) for number in item.numbers}
    names = ("damping_j1", "scale_springs", "mass_2_g")
    written, left = extended_text(model, {numbers[name]: 1.1 for name in (*names, "scale_1")})
    assert left == names
    assert mujoco.MjModel.from_xml_string(written).njnt == 3


def test_what_a_file_cannot_carry_is_said() -> None:
    names = ("delay_s", "width_one", "rotation_x_deg")
    assert extended_text(MODEL, {NUMBERS[name]: 0.1 for name in names})[1] == names


def test_commands_pass_gain_and_offset_then_play_then_delay() -> None:
    values = {NUMBERS["width_one"]: 0.2, NUMBERS["scale_one"]: 2.0, NUMBERS["offset_one"]: 0.1}
    ramp = np.stack([np.array([0.0, 1.0, 0.0]), np.zeros(3)], axis=1)
    trial = ForeignTrial("ramp", "train", np.array([0.0, 1.0, 2.0]), ramp, np.zeros((3, len(OUTPUTS))))
    at_s = np.array([0.0, 1.0, 2.0])
    # 0.1, 2.1, 0.1 commanded; behind a play of 0.2 in whose middle it begins: 0.1, 2.0, 0.2
    assert arriving_controls(MODEL, trial, values, at_s)[:, 0] == pytest.approx([0.1, 2.0, 0.2])
    late = arriving_controls(MODEL, trial, values | {NUMBERS["delay_s"]: 0.5}, at_s)[:, 0]
    assert late == pytest.approx([0.1, 0.5 * (0.1 + 2.0), 0.5 * (2.0 + 0.2)])


def test_a_tracker_turned_about_y_sees_x_where_z_was() -> None:
    turned, straight = played(rotation_y_deg=45.0, translation_x_mm=7.0), played()
    c = np.sqrt(0.5)
    assert turned[:, 2] == pytest.approx(c * straight[:, 2] + c * straight[:, 3] + 7.0)
    assert turned[:, 3] == pytest.approx(c * straight[:, 3] - c * straight[:, 2])
    assert turned[:, :2] == pytest.approx(straight[:, :2])


def test_the_model_itself_stays_as_it_was() -> None:
    before = MODEL.simulated.dof_damping.copy()
    changed(MODEL, {NUMBERS["damping_first"]: 1.0})
    assert np.array_equal(MODEL.simulated.dof_damping, before)


def test_wild_numbers_give_large_errors_and_no_exception() -> None:
    assert np.isfinite(played(damping_first=NUMBERS["damping_first"].upper * 1e9)).all()


def test_several_at_a_time_give_the_same() -> None:
    sets = [{NUMBERS["scale_one"]: value} for value in (0.9, 1.0, 1.1)]
    alone, together = (Runner(MODEL, jobs=jobs).outputs(sets, [TRIAL]) for jobs in (1, 2))
    for one, other in zip(alone, together, strict=True):
        assert np.array_equal(one[0], other[0])


def test_a_trial_begins_as_its_first_row_has_settled() -> None:
    held = ForeignTrial("held", "train", TIME_S, np.tile([0.4, -0.3], (51, 1)), np.zeros((51, len(OUTPUTS))))
    moving, settled = (Runner(MODEL, settle_s).outputs([{}], [held])[0][0] for settle_s in (0.0, 5.0))
    assert np.ptp(moving[:, 0]) > 5.0
    assert np.ptp(settled[:, 0]) < 0.1


def test_the_extended_file_finds_meshes_from_anywhere(tmp_path: Path) -> None:
    (tmp_path / "here" / "meshes").mkdir(parents=True)
    corners = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    (tmp_path / "here" / "meshes" / "corner.obj").write_text(corners)
    text = FILE.read_text().replace(
        "<compiler", '<asset><mesh file="corner.obj"/></asset><compiler meshdir="meshes"'
    )
    text = text.replace('<site name="end"', '<geom type="mesh" mesh="corner" mass="0"/><site name="end"')
    (tmp_path / "here" / "arm.xml").write_text(text)
    text, _ = extended_text(ForeignModel(tmp_path / "here" / "arm.xml"), {NUMBERS["damping_first"]: 0.1})
    (tmp_path / "model.xml").write_text(text)
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "model.xml")).nmesh == 1


def test_threads_of_a_run_end_with_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """However many runners a search makes."""
    opened, closed = [], []

    class Counted(rollout.Rollout):
        def __init__(self, **options: int) -> None:
            super().__init__(**options)
            opened.append(self)

        def close(self) -> None:
            super().close()
            closed.append(self)

    monkeypatch.setattr(rollout, "Rollout", Counted)
    for _ in range(3):
        Runner(MODEL, jobs=2).outputs([{}], [TRIAL])
    assert len(opened) == 3
    assert closed == opened
