"""What the verbs leave behind: files that mean what the contract says, the same as the library's."""

from __future__ import annotations

import json
import re
from pathlib import Path

import gymnasium
import mujoco
import numpy as np
import pytest
from cli_command import Run

import catheter_sim as cs
from catheter_sim.catalogue import ROBOTS, load_robot, robot_toml
from catheter_sim.channels import (
    FORCE_CHANNELS,
    MOMENT_CHANNELS,
    input_channels,
    output_channels,
    read_inputs,
)
from catheter_sim.cli import diagnose as diagnose_verb
from catheter_sim.core.inputs import Inputs
from catheter_sim.errors import InputError
from catheter_sim.modelling.build import robot_length
from catheter_sim.simulation.replay import simulate
from catheter_sim.tables import read_table
from catheter_sim.theory.static_models import STATIC_MODELS

ROBOT = "neuroendoscope_section"
LOOP = "time_s,tension_right_N\n0,0\n1,0.15\n2,0.3\n3,0.15\n4,0\n"


def test_list_shows_every_registry(run: Run) -> None:
    """The JSON names every robot, model, environment and effect, and the text every one of these names."""
    ran = run("list", "--json")
    assert ran.status == 0
    content = json.loads(ran.out)
    assert [robot["id"] for robot in content["robots"]] == [name for name in ROBOTS if "@" not in name]
    assert {model["name"] for model in content["static_models"]} == set(STATIC_MODELS)
    environments = {item["id"] for item in content["environments"]}
    assert environments == {name for name in gymnasium.registry if name.startswith("catheter_sim/")}
    assert "catheter_sim/NeuroendoscopeReach-v0" in environments
    assert {"tendon_friction", "backlash", "stiffness"} <= {item["name"] for item in content["effects"]}
    text = run("list").out
    for robot in content["robots"]:
        assert robot["id"] in text
        for name in robot["static_models"]:
            assert STATIC_MODELS[name].applies_to(load_robot(robot["id"]))
    for kind in ("static_models", "effects"):
        assert all(item["name"] in text for item in content[kind])
    assert all(name in text for name in environments)


@pytest.mark.slow
def test_listed_effect_parameters_can_be_set(run: Run, folder: Path) -> None:
    """Every listed parameter of every effect is taken by --set within its listed bounds, for every robot."""
    from catheter_sim.cli.driven import load

    content = json.loads(run("list", "--json").out)
    for effect in content["effects"]:
        for robot, parameters in effect["parameters"].items():
            given = {item["name"]: item["no_effect"] for item in parameters}
            for item in parameters:
                bounds = [float(item[key]) for key in ("lower", "no_effect", "upper")]
                assert bounds == sorted(bounds), (effect["name"], item)
            settings = [f"effects.{effect['name']}.{name}={value}" for name, value in given.items()]
            specified, _ = load(robot, settings)
            assert specified.effects.get(effect["name"], {}) == {
                name: float(value) for name, value in given.items()
            }, (effect["name"], robot)


@pytest.mark.slow
@pytest.mark.parametrize("reference", ROBOTS)
def test_built_file_loads_in_plain_mujoco(reference: str, run: Run, folder: Path) -> None:
    """The file stands alone: MuJoCo loads it by its path, with the robot's tendons and straight length."""
    ran = run("build", reference, "-o", "model.xml")
    assert ran.status == 0
    assert "wrote model.xml" in ran.out
    model = mujoco.MjModel.from_xml_path("model.xml")
    robot = load_robot(reference)
    for tendon in robot.tendons:
        assert model.actuator(f"tendon_{tendon.name}").id >= 0
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    pushed_out_m = sum(getattr(segment, "stroke_m", 0.0) for segment in robot.segments)
    length_m = robot_length(robot) - pushed_out_m
    np.testing.assert_allclose(data.site("tip").xpos, [0, 0, length_m], atol=1e-9)


@pytest.mark.slow
def test_settings_reach_the_built_file(run: Run, folder: Path) -> None:
    """A changed length and a doubled stiffness are in the file; several settings may follow one --set."""
    run("build", ROBOT, "-o", "plain.xml")
    words = ["--set", "segments.section.length_mm=90", "stiffness_scale=2"]
    assert run("build", *words, ROBOT, "-o", "long.xml").status == 0
    plain, long = (mujoco.MjModel.from_xml_path(name) for name in ("plain.xml", "long.xml"))
    data = mujoco.MjData(long)
    mujoco.mj_forward(long, data)
    assert data.site("tip").xpos[2] == pytest.approx(0.09)
    ratio = long.jnt_stiffness.max() / plain.jnt_stiffness.max()
    assert ratio == pytest.approx(2 * 60 / 90)  # twice EI over links 1.5 times as long


def test_simulate_writes_what_the_library_gives(run: Run, folder: Path, inputs: str) -> None:
    """Every promised column, row by row, at the times of the inputs: the library's own values."""
    ran = run("simulate", ROBOT, "--inputs", inputs, "-o", "out.csv")
    assert ran.status == 0
    assert ran.out == "wrote out.csv: 4 rows\n"
    table = read_table("out.csv")
    robot = load_robot(ROBOT)
    assert list(table.columns) == output_channels(robot)
    np.testing.assert_array_equal(table.time_s, [0, 1, 2, 3])
    expected = simulate(robot, read_inputs(robot, read_table(inputs)), np.zeros(3))
    tips = [posture.p_w[-1, 0] * 1e3 for posture in expected.postures]
    np.testing.assert_allclose(table.columns["tip_x_mm"], tips, rtol=1e-8, atol=1e-9)
    assert table.columns["tip_x_mm"][2] > 1.0  # the right tendon pulls toward +x
    np.testing.assert_array_equal(table.columns["tension_right_N"], [0, 0.1, 0.2, 0.1])


@pytest.mark.slow
def test_columns_choose_and_order(run: Run, folder: Path, inputs: str) -> None:
    """--columns writes time_s and the named columns, in that order, with unchanged values."""
    run("simulate", ROBOT, "--inputs", inputs, "-o", "all.csv")
    run("simulate", ROBOT, "--inputs", inputs, "-o", "some.csv", "--columns", "tip_z_mm,time_s,body_7_x_mm")
    everything, some = read_table("all.csv"), read_table("some.csv")
    assert (folder / "some.csv").read_text().splitlines()[0] == "time_s,tip_z_mm,body_7_x_mm"
    for name, values in some.columns.items():
        np.testing.assert_array_equal(values, everything.columns[name])


@pytest.mark.slow
@pytest.mark.parametrize("verb", [["simulate"], ["statics", "--model", "fkm_exact_arm"]], ids=lambda v: v[0])
def test_friction_and_gravity_are_the_users_to_choose(verb: list[str], run: Run, folder: Path) -> None:
    """A loop opens with friction and closes without; weight along +x moves the straight robot there."""
    (folder / "loop.csv").write_text(LOOP)
    (folder / "rest.csv").write_text("\n".join(LOOP.splitlines()[:2]))
    words = [*verb, ROBOT, "--columns", "tip_x_mm", "--inputs"]
    run(*words, "loop.csv", "-o", "rubbing.csv")
    run(*words, "loop.csv", "-o", "smooth.csv", "--set", "friction.mu=0")
    run(*words, "rest.csv", "-o", "heavy.csv", "--gravity", "9.81,0,0")
    run(*words, "rest.csv", "-o", "mirrored.csv", "--gravity", "-9.81,0,0")
    rubbing, smooth, heavy, mirrored = (
        read_table(f"{name}.csv").columns["tip_x_mm"] for name in ("rubbing", "smooth", "heavy", "mirrored")
    )
    assert rubbing[3] - rubbing[1] > 0.5  # coming back it stays bent
    assert abs(smooth[3] - smooth[1]) < 1e-2
    assert heavy[0] > 5.0
    assert heavy[0] == pytest.approx(-mirrored[0], abs=1e-3)


def test_a_toml_is_as_good_as_an_id(run: Run, folder: Path, inputs: str) -> None:
    """A robot's .toml gives the file that its id gives."""
    (folder / "robot.toml").write_text(robot_toml(load_robot(ROBOT)))
    run("statics", ROBOT, "--model", "fkm", "--inputs", inputs, "-o", "id.csv")
    run("statics", "robot.toml", "--model", "fkm", "--inputs", inputs, "-o", "toml.csv")
    assert (folder / "id.csv").read_text() == (folder / "toml.csv").read_text() != ""


@pytest.mark.slow
def test_statics_writes_what_the_model_gives(run: Run, folder: Path, inputs: str) -> None:
    """Each of the robot's models writes its own tips under its own name."""
    robot = load_robot(ROBOT)
    given = read_inputs(robot, read_table(inputs))
    for name, model in STATIC_MODELS.items():
        if not model.applies_to(robot):
            continue
        ran = run("statics", ROBOT, "--model", name, "--inputs", inputs, "-o", "out.csv")
        assert ran.out == "wrote out.csv: 4 rows\n"
        postures = model.solve(robot, given, np.zeros(3)).postures
        tips = [posture.p_w[-1, 2] * 1e3 for posture in postures]
        np.testing.assert_allclose(read_table("out.csv").columns["tip_z_mm"], tips, rtol=1e-8)


@pytest.mark.slow
def test_dynamic_follows_the_clock(run: Run, folder: Path) -> None:
    """Held rows do not care how fast they follow one another; with --dynamic a fast pull lags behind."""
    for name, last in (("slow", 8.0), ("fast", 0.02)):
        (folder / f"{name}.csv").write_text(f"time_s,tension_right_N\n0,0\n{last},0.3\n")
    tips = {}
    for name in ("slow", "fast"):
        for option in ((), ("--dynamic",)):
            words = ["simulate", ROBOT, "--inputs", f"{name}.csv", "--columns", "tip_x_mm", *option]
            assert run(*words, "--set", "friction.mu=0", "-o", "out.csv").status == 0
            tips[name, bool(option)] = read_table("out.csv").columns["tip_x_mm"][-1]
    assert tips["slow", False] == tips["fast", False]
    assert tips["slow", True] == pytest.approx(tips["slow", False], rel=0.02)
    assert tips["fast", True] < 0.5 * tips["fast", False]


@pytest.mark.slow
def test_an_effect_changes_simulation_and_statics_alike(run: Run, folder: Path) -> None:
    """A gain of 1.2 on a channel is the same as 1.2 times the input, in the simulation and in the theory."""
    (folder / "once.csv").write_text(LOOP)
    content = json.loads(run("list", "--json").out)
    gain = next(item for item in content["effects"] if item["name"] == "actuation_gain")
    key = next(item["name"] for item in gain["parameters"][ROBOT] if "right" in item["name"])
    setting = f"effects.actuation_gain.{key}=1.2"
    (folder / "more.csv").write_text("time_s,tension_right_N\n0,0\n1,0.18\n2,0.36\n3,0.18\n4,0\n")
    for verb in (["simulate"], ["statics", "--model", "fkm_exact_arm"]):
        words = [*verb, ROBOT, "--columns", "tip_x_mm,tip_z_mm", "-o"]
        run(*words, "effect.csv", "--inputs", "once.csv", "--set", setting)
        run(*words, "input.csv", "--inputs", "more.csv")
        effect, given = read_table("effect.csv"), read_table("input.csv")
        for name in ("tip_x_mm", "tip_z_mm"):
            np.testing.assert_allclose(effect.columns[name], given.columns[name], atol=1e-6)


@pytest.mark.parametrize(
    ("error", "tolerance", "status"),
    [(0.1, 0.2, 0), (0.3, 0.2, 1), (float("nan"), 0.2, 1), (float("inf"), 0.2, 1), (9.0, None, 0)],
)
def test_validate_exits_1_where_a_line_is_out(
    error: float,
    tolerance: float | None,
    status: int,
    run: Run,
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The exit status follows the lines: undefined never passes, what only informs never fails."""
    from catheter_sim.validation import report
    from catheter_sim.validation.lines import Line, Validation

    def check(_: Path) -> Validation:
        return Validation(
            (Line(ROBOT, "planted quantity", "mm", error, tolerance, "a test"),), ("a finding",)
        )

    monkeypatch.setattr(report, "CHECKS", {ROBOT: (check,)})
    ran = run("validate", "-o", "deep/out")
    assert ran.status == status
    assert ran.err == ""
    assert "planted quantity" in ran.out
    assert "a finding" in ran.out
    assert (folder / "deep" / "out" / "validation.json").is_file()


def test_diagnose_prints_the_verdict_and_its_figures(
    run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The sentence, each unit's errors, each cause with its parameters and what cannot be told apart."""
    from catheter_sim.diagnosis import pipeline
    from catheter_sim.diagnosis.dataset import load_dataset
    from catheter_sim.diagnosis.notes import Note
    from catheter_sim.diagnosis.result import (
        Candidate,
        Cause,
        DiagnosisResult,
        FittedParameter,
        NextExperiment,
        UnitResult,
    )
    from catheter_sim.resources import assets_folder

    dataset = load_dataset(assets_folder() / "examples" / "opencr_v4")
    asked: list[object] = []

    def diagnose(
        data: str,
        out: Path,
        jobs: int,
        progress: bool,
        dask: str,
        budget_s: float,
        command: str,
        search_anyway: bool,
    ) -> DiagnosisResult:
        asked.extend([data, str(out), jobs, progress, budget_s, command, search_anyway])
        return DiagnosisResult(
            dataset=dataset,
            verdict="cause_found",
            unit="mm",
            by_unit={"mm": UnitResult("mm", 0.05, 6.1, 0.9, 85.2, (83.0, 87.1))},
            causes=(Cause("backlash", {"width_mm": FittedParameter(-0.42, (-0.44, -0.40))}, 85.2),),
            ranking=(Candidate(("backlash",), 0.9, 0.9),),
            indistinguishable=(("stiffness", "actuation_gain"),),
            next_experiment=NextExperiment("Pull slower."),
            extended_robot=dataset.robot,
            fits=(),
            notes=(Note("doubt", "A doubt."),),
            extra={"tip_rmse_mm": 1.25},
        )

    monkeypatch.setattr(pipeline, "diagnose", diagnose)
    given = ("diagnose", "data", "-o", "out", "--jobs", "2", "--budget", "90")
    ran = run(*given)
    assert ran.status == 0
    assert asked == ["data", "out", 2, True, 90.0, f"catheter-sim {' '.join(given)}", False]
    for text in (
        "is wrong about backlash",
        "verdict: cause_found",
        "held out, RMSE [mm]: 6.10 before, 0.900 after; row-to-row noise 0.0500; ",
        "gain 85.2 % (95 %: 83.0 to 87.1)",
        "cause: backlash, 85.2 % of the error before",
        "width_mm = -0.420 (95 %: -0.440 to -0.400)",
        "these data cannot tell apart: stiffness, actuation_gain",
        "tip_rmse_mm = 1.25",
        "note: A doubt.",
        "next experiment: Pull slower.",
    ):
        assert text in ran.out, ran.out


def test_several_data_sets_get_a_folder_each(run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each is named, and written to its own folder; nothing is begun where one of them cannot be read."""
    from catheter_sim.diagnosis import pipeline
    from catheter_sim.resources import assets_folder

    asked: list[tuple[str, str]] = []

    def diagnose(data: str, out: Path, **named: object) -> None:
        asked.append((data, str(out)))
        raise InputError("that is all")

    monkeypatch.setattr(pipeline, "diagnose", diagnose)
    first, second = (str(assets_folder() / "examples" / name) for name in ("opencr_v4", "trunk/settled_000g"))
    for wrong, said in (
        ((first, "nothing_here"), "nothing_here"),
        ((first, first), "opencr_v4: two data sets of this name"),
        ((first, second, "--since", first), "--since compares one data set"),
    ):
        ran = run("diagnose", *wrong, "-o", "out")
        assert ran.status == 2
        assert said in ran.err
    assert not asked
    monkeypatch.setattr(diagnose_verb, "_run_one", lambda options, data, out: asked.append((data, str(out))))
    ran = run("diagnose", first, second, "-o", "out")
    assert ran.status == 0
    assert ran.out.splitlines() == ["opencr_v4:", "settled_000g:"]
    assert asked == [(first, "out/opencr_v4"), (second, "out/settled_000g")]


@pytest.mark.parametrize(("more", "budget_s"), [([], 300.0), (["--budget", "40"], 40.0)])
def test_a_comparison_ends(
    run: Run, monkeypatch: pytest.MonkeyPatch, more: list[str], budget_s: float
) -> None:
    """After five minutes where nothing else is asked for, by the command line and in Python."""
    from catheter_sim.diagnosis.changes import series
    from catheter_sim.resources import assets_folder

    asked: list[object] = []

    def compare(*given: object, **named: object) -> None:
        asked.append(named["budget_s"])
        raise InputError("that is all")

    monkeypatch.setattr(series, "compare_series", compare)
    data = str(assets_folder() / "examples" / "opencr_v4")
    assert run("diagnose", data, "--since", data, "-o", "out", *more).status == 2
    with pytest.raises(InputError, match="that is all"):
        cs.compare(data, data, **({"budget_s": budget_s} if more else {}))
    assert asked == [budget_s, budget_s]


@pytest.mark.slow
def test_diagnose_says_its_stages_off_a_terminal(run: Run, folder: Path) -> None:
    """Each is a line on standard error with the time since the start; standard output has the answer."""
    rows = [(number, 0.05 * min(number % 16, 16 - number % 16)) for number in range(33)]
    for name, most in (("one", 1.0), ("two", 0.8)):
        text = "".join(f"{number},{most * pull:g}\n" for number, pull in rows)
        (folder / f"{name}_in.csv").write_text(f"time_s,tension_right_N\n{text}")
        words = ["--model", "fkm_sliding", "--inputs", f"{name}_in.csv", "-o", f"{name}_out.csv"]
        assert run("statics", ROBOT, *words, "--columns", "tip_x_mm,tip_z_mm").status == 0
        inputs, outputs = ((folder / f"{name}_{part}.csv").read_text().splitlines() for part in ("in", "out"))
        joined = [f"{one},{other.split(',', 1)[1]}" for one, other in zip(inputs, outputs, strict=True)]
        (folder / f"{name}.csv").write_text("\n".join(joined) + "\n")
    (folder / "dataset.toml").write_text(
        f'[dataset]\nname = "small"\nrobot = "{ROBOT}"\nsource = "made"\nlicence = "none"\n'
        "[conditions]\ngravity_mps2 = [0.0, 0.0, 0.0]\n"
        '[channels]\ninputs = ["tension_right_N"]\noutputs = ["tip_x_mm", "tip_z_mm"]\n'
        '[[trials]]\nfile = "one.csv"\n[[trials]]\nfile = "two.csv"\n'
    )
    ran = run("diagnose", ".", "-o", "out")
    assert ran.status == 0, ran.err
    lines = [line for line in ran.err.splitlines() if "kernel" not in line]
    told = [re.fullmatch(r"diagnose: (.+) \((\d+\.\d) s\)", line) for line in lines]
    stages = [found[1] for found in told if found]
    assert len(stages) == len(lines), ran.err
    assert stages, ran.out
    assert stages[0] == "calibrating"
    for stage in ("choosing causes", "replaying in MuJoCo", "looking for what to measure next"):
        assert stage in stages
    times = [float(found[2]) for found in told if found]
    assert times == sorted(times)
    assert "diagnose: " not in ran.out
    assert "verdict: " in ran.out


@pytest.mark.parametrize("name", ["out.png", pytest.param("out.mp4", marks=pytest.mark.slow)])
def test_render_leaves_a_picture_of_its_size(name: str, run: Run, folder: Path, inputs: str) -> None:
    """The file has the asked-for size, and shows something: its pixels are not all alike."""
    import imageio.v3 as iio

    size = ["--width", "160", "--height", "120"]
    ran = run("render", ROBOT, "--inputs", inputs, "-o", name, *size, "--camera", "side")
    assert ran.status == 0, ran.err
    options = {"index": 0, "plugin": "pyav"} if name.endswith("mp4") else {}
    frame = iio.imread(folder / name, **options)
    assert frame.shape[:2] == (120, 160)
    assert frame.std() > 1.0


@pytest.mark.slow
def test_output_may_go_to_a_device(run: Run, folder: Path, inputs: str) -> None:
    """Output to /dev/null is written there; the device stays a device."""
    assert run("simulate", ROBOT, "--inputs", inputs, "-o", "/dev/null").status == 0
    assert Path("/dev/null").is_char_device()


def test_list_shows_what_a_robots_file_takes_and_gives(run: Run, folder: Path) -> None:
    """Its inputs of each kind, every output column, its models, and its effects with what the file sets."""
    robot = load_robot("spacer_disk", ["disks_per_segment=2", "effects.tendon_friction.mu=0.1"])
    (folder / "my.toml").write_text(robot_toml(robot))
    content = json.loads(run("list", "my.toml", "--json").out)
    assert content["inputs"] == {kind: input_channels(robot, kind) for kind in ("tension", "displacement")}
    assert content["optional_inputs"] == [*FORCE_CHANNELS, *MOMENT_CHANNELS]
    assert content["inputs_on_bodies"] == ["force_body_<k>_x_N ...", "moment_body_<k>_x_Nm ..."]
    assert content["outputs"] == output_channels(robot)
    models = [model["name"] for model in content["static_models"]]
    assert models == [name for name, model in STATIC_MODELS.items() if model.applies_to(robot)]
    effects = {effect["name"]: effect for effect in content["effects"]}
    assert effects["tendon_friction"]["set"] == {"mu": 0.1}
    assert {"scale_1", "scale_4"} <= {item["name"] for item in effects["actuation_gain"]["parameters"]}
    text = run("list", "my.toml").out
    assert text.startswith(f"my.toml: {robot.description}\n")
    for word in ("displacement_3_mm", "force_tip_z_N", "body_1_x_mm", "body_4_z_mm", "tension_4_N", *effects):
        assert word in text
    assert "mu = 0 (0 to 1.5), set: 0.1" in text


@pytest.mark.parametrize("reference", ROBOTS)
def test_list_knows_every_robot(reference: str, run: Run) -> None:
    """Ids and parameter sets alike; the text names each static model and effect once."""
    content = json.loads(run("list", reference, "--json").out)
    assert content["outputs"] == output_channels(load_robot(reference))
    text = run("list", reference).out
    for kind in ("static_models", "effects"):
        for item in content[kind]:
            assert text.count(f"\n  {item['name']:<24} ") == 1


def test_list_refuses_what_is_no_robot(run: Run, folder: Path) -> None:
    """In the words of every other verb."""
    assert "unknown robot 'my'; choices: " in run("list", "my").error()
    assert "my.toml: no such file" in run("list", "my.toml").error()


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        ["simulate", "--dynamic"],
        ["simulate", "--set", "effects.rate.lag_s=0.3"],
        ["statics", "--model", "fkm_exact_arm", "--set", "effects.rate.delay_s=0.35"],
        ["statics", "--model", "fkm_exact_arm", "--set", "effects.drift.zero_N_per_min=2"],
    ],
    ids=lambda words: words[-1],
)
def test_the_year_of_a_measurement_changes_nothing(words: list[str], run: Run, folder: Path) -> None:
    """Rows in epoch seconds give what the same rows from zero give, at their own times."""
    pulls = 0.1 + 0.1 * np.sin(np.arange(60) / 6.0)
    for name, start in (("zero", 0.0), ("epoch", 1.7e9)):
        rows = [f"{start + 0.0125 * row:.4f},{pull:.3f}" for row, pull in enumerate(pulls)]
        (folder / f"{name}.csv").write_text("\n".join(["time_s,tension_right_N", *rows]))
        assert run(*words, ROBOT, "--inputs", f"{name}.csv", "-o", f"{name}_out.csv").status == 0
    zero, epoch = read_table("zero_out.csv"), read_table("epoch_out.csv")
    np.testing.assert_array_equal(epoch.time_s, read_table("epoch.csv").time_s)
    for name, values in zero.columns.items():
        np.testing.assert_allclose(epoch.columns[name], values, rtol=0, atol=1e-6, err_msg=name)
    assert np.ptp(zero.columns["tip_x_mm"]) > 1.0


@pytest.mark.parametrize(
    ("option", "time_s", "pull"),
    [
        ([], 3.0, 0.1),
        (["--row", "1"], 0.0, 0.0),
        (["--row", "3"], 2.0, 0.2),
        (["--time", "1700000001"], 1.0, 0.1),
        (["--time", "1700000001.25"], 1.25, 0.125),
        (["--time", "1700000003"], 3.0, 0.1),
    ],
)
def test_a_picture_shows_the_row_or_time_asked_for(
    option: list[str], time_s: float, pull: float, run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The robot after all rows before it, under the inputs of that row or on the line between two."""
    from catheter_sim.pictures import offscreen

    seen: list[Inputs] = []
    monkeypatch.setattr(offscreen, "render", lambda robot, inputs, *rest, **named: seen.append(inputs))
    rows = [f"{1.7e9 + row},{pull}" for row, pull in enumerate([0, 0.1, 0.2, 0.1])]
    (folder / "in.csv").write_text("\n".join(["time_s,tension_right_N", *rows]))
    ran = run("render", ROBOT, "--inputs", "in.csv", "-o", "out.png", *option)
    assert ran.status == 0, ran.err
    (inputs,) = seen
    assert inputs.time_s[-1] == pytest.approx(time_s)
    assert inputs.tendon[-1, 0] == pytest.approx(pull)
    assert inputs.tendon[0, 0] == 0.0
    assert len(inputs) == int(np.floor(time_s)) + (1 if time_s % 1 == 0 else 2)
