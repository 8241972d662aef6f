"""Runs: the numbers of the command line, as tables, pictures and files."""

from __future__ import annotations

import sys
import types
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

import catheter_sim as cs
from catheter_sim import progress
from catheter_sim.cli.main import main
from catheter_sim.pictures import offscreen
from catheter_sim.simulation import replay, simulator
from catheter_sim.tables import read_table

PULL = {"time_s": [0.0, 1.0, 2.0], "tension_right_N": [0.0, 0.2, 0.4]}
SECTION = "neuroendoscope_section"


@pytest.fixture(scope="module")
def run() -> cs.Run:
    return cs.statics(SECTION, PULL, model="fkm_sliding")


def test_statics_writes_what_the_command_line_writes(tmp_path: Path) -> None:
    """`Run.save` after `statics` and `catheter-sim statics` give the same file, effects included."""
    (tmp_path / "in.csv").write_text("time_s,tension_right_N\n0,0\n1,0.2\n2,0.4\n")
    setting, settings = "effects.actuation_gain.scale=0.8", {"effects.actuation_gain.scale": 0.8}
    command = ["statics", SECTION, "--model", "fkm_sliding", "--inputs", str(tmp_path / "in.csv")]
    assert main([*command, "--set", setting, "-o", str(tmp_path / "out.csv")]) == 0
    cs.statics(cs.load_robot(SECTION, settings), PULL, "fkm_sliding").save(tmp_path / "saved.csv")
    assert (tmp_path / "saved.csv").read_text() == (tmp_path / "out.csv").read_text()


@pytest.mark.slow
@pytest.mark.parametrize("dynamic", [False, True])
def test_simulate_writes_what_the_command_line_writes(dynamic: bool, tmp_path: Path) -> None:
    """`simulate`, held and in motion, and `catheter-sim simulate` give the same file, effects included."""
    (tmp_path / "in.csv").write_text("time_s,tension_right_N\n0,0\n0.2,0.2\n")
    setting, settings = "effects.actuation_gain.scale=0.8", {"effects.actuation_gain.scale": 0.8}
    command = ["simulate", SECTION, "--inputs", str(tmp_path / "in.csv"), "--set", setting]
    command += ["-o", str(tmp_path / "out.csv"), "--gravity", "0,0,-9.81"]
    assert main([*command, "--dynamic"] if dynamic else command) == 0
    done = cs.simulate(cs.load_robot(SECTION, settings), tmp_path / "in.csv", (0, 0, -9.81), dynamic)
    done.save(tmp_path / "saved.csv")
    assert (tmp_path / "saved.csv").read_text() == (tmp_path / "out.csv").read_text()
    assert done.by == ("simulation in motion" if dynamic else "simulation")
    assert done.at_rest is not None
    assert done.at_rest.all()


def test_inputs_are_the_same_from_a_mapping_a_file_and_a_frame(tmp_path: Path) -> None:
    """A mapping, anything with a data frame's face, and a CSV file say the same; a number fills a column."""
    (tmp_path / "in.csv").write_text("time_s,tension_right_N,tension_left_N\n0,0,0.1\n1,0.2,0.1\n2,0.4,0.1\n")
    table = PULL | {"tension_left_N": 0.1}
    ways = (
        cs.inputs(SECTION, table),
        cs.inputs(cs.load_robot(SECTION), Frame(table)),
        cs.read_inputs(SECTION, tmp_path / "in.csv"),
    )
    for way in ways:
        np.testing.assert_array_equal(way.time_s, [0.0, 1.0, 2.0])
        np.testing.assert_array_equal(way.tendon, [[0.0, 0.1], [0.2, 0.1], [0.4, 0.1]])


class Frame:
    """What a pandas `DataFrame` shows of itself here: columns by name, its iterator the names."""

    def __init__(self, columns: dict[str, Any]) -> None:
        self.columns = columns

    def keys(self) -> list[str]:
        return list(self.columns)

    def __iter__(self) -> Any:
        return iter(self.columns)

    def __contains__(self, name: object) -> bool:
        return name in self.columns

    def __getitem__(self, name: str) -> Any:
        return self.columns[name]


@pytest.fixture
def pandas(monkeypatch: pytest.MonkeyPatch) -> None:
    """Stand-in for pandas, so that the tests need it not."""
    module = types.ModuleType("pandas")
    module.DataFrame = Frame  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "pandas", module)


@pytest.mark.usefixtures("pandas")
def test_data_frame_holds_the_table(run: cs.Run) -> None:
    """`to_dataframe` gives the columns of `to_table`, `time_s` first, to pandas."""
    frame = run.to_dataframe(["tip_x_mm"])
    assert list(frame) == ["time_s", "tip_x_mm"]
    np.testing.assert_array_equal(frame["tip_x_mm"], run.to_table(["tip_x_mm"]).columns["tip_x_mm"])
    models = cs.list_models(SECTION)
    assert models.to_dataframe()["name"] == models.column("name")


def test_data_frame_without_pandas_is_one_line(run: cs.Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where pandas is not installed, the error names the package."""
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(cs.InputError, match=r"needs pandas: pip install pandas"):
        run.to_dataframe()


def test_notebook_shows_the_tip_row_by_row(run: cs.Run) -> None:
    """The HTML has a row for each row, the tip's place in it, and the sentence as its caption."""
    shown = run._repr_html_()
    assert "<caption>Run of neuroendoscope_section by fkm_sliding: 3 rows</caption>" in shown
    assert shown.count("<tr>") == 1 + len(run)
    assert f"<td>{run.to_table().columns['tip_x_mm'][2]:.6g}</td>" in shown


def test_plot_draws_each_unit_in_its_panel_without_pyplot(run: cs.Run) -> None:
    """Curves are the table's; a panel for each unit; no global state of matplotlib is touched."""
    loaded = "matplotlib.pyplot" in sys.modules
    figure = run.plot(["tip_x_mm", "tip_z_mm", "tension_right_N"])
    assert [axes.get_ylabel() for axes in figure.axes] == ["[mm]", "[N]"]
    (curve,) = figure.axes[1].lines
    np.testing.assert_allclose(curve.get_ydata(), PULL["tension_right_N"], rtol=1e-12)
    assert ("matplotlib.pyplot" in sys.modules) == loaded
    assert run.plot("tip_qw").axes[0].get_ylabel() == "[1]"


def test_plot_draws_into_the_axes_that_are_given(run: cs.Run) -> None:
    """One for each unit, of one figure, which is returned; the figure's own title stays."""
    figure = Figure()
    figure.suptitle("mine")
    axes = figure.subplots(2, 1)
    assert run.plot(["tip_x_mm", "tension_right_N"], ax=axes) is figure
    assert [len(item.lines) for item in axes] == [1, 1]
    assert figure.get_suptitle() == "mine"
    one = Figure().subplots()
    assert run.plot("tip_x_mm", ax=one) is one.figure
    for other in (5, "axes", [axes[0], 5], Figure()):
        with pytest.raises(cs.InputError, match="axes of matplotlib are needed"):
            run.plot("tip_x_mm", ax=other)
    with pytest.raises(
        cs.InputError, match=r"ax: 2 axes are needed, as figure.subplots\(2, 1\) makes them; 1"
    ):
        run.plot(ax=one)
    with pytest.raises(cs.InputError, match="several figures"):
        run.plot(ax=[one, axes[0]])


@pytest.mark.slow
def test_every_figure_draws_into_given_axes_and_shows_itself() -> None:
    """Of every result that plots: a notebook's PNG without pyplot, and no axes but those given."""
    bend = {"time_s": [0.0, 1.0], "displacement_bending_mm": [0.0, 1.0]}
    robot = "mitral_transseptal"
    asked = {"time_s": [0.0, 0.1], "angle_bending_deg": [0.0, 1.0]}
    results = (
        (cs.statics(robot, bend, "pk"), (1, 1)),
        (cs.sense(robot, bend, uncertain={}, columns=["tip_x_mm", "tip_z_mm"]), (2, 1)),
        (cs.inverse_kinematics(robot, {"tip_x_mm": [10.0]}, corrections=None), (2, 1)),
        (cs.workspace(robot, samples=5), (1, 3)),
        (cs.which_model(robot, bend, reference="pk"), (1, 1)),
        (cs.control(robot, asked, models=["pk"], noise_deg=0.0), (3, 1)),
    )
    for result, shape in results:
        how: dict[str, Any] = {"columns": ["tip_x_mm"]} if isinstance(result, cs.Run) else {}
        own = result.plot(**how)
        assert own._repr_png_().startswith(b"\x89PNG")  # type: ignore[attr-defined]
        figure = Figure()
        given = figure.subplots(*shape)
        assert result.plot(**how, ax=given) is figure
        assert figure.axes == list(np.ravel(given))
        assert all(item.has_data() for item in figure.axes)
        assert len(own.axes) == len(figure.axes)


def test_built_model_has_the_robot_with_its_effects() -> None:
    """`build` is the model that `catheter-sim build` writes: a stiffer robot has stiffer joints."""
    soft, stiff = (
        cs.build(cs.load_robot(SECTION, {"effects.stiffness.scale": scale})).compile() for scale in (1.0, 2.0)
    )
    assert soft.ntendon == 2
    np.testing.assert_allclose(stiff.jnt_stiffness, 2.0 * soft.jnt_stiffness, rtol=1e-9)
    assert soft.jnt_stiffness.max() > 0.0


@pytest.mark.slow
def test_render_draws_a_held_run_with_its_effects(tmp_path: Path) -> None:
    """A picture is written of a simulation whose rows were held."""
    done = cs.simulate(SECTION, PULL)
    cs.render(done, tmp_path / "tip.png", width=160, height=120)
    assert (tmp_path / "tip.png").stat().st_size > 1000


@pytest.mark.slow
def test_render_draws_the_rows_that_were_simulated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is simulated again, and the picture is that of a second simulation, friction included."""
    pull = {"time_s": [0.0, 1.0, 2.0, 3.0], "tension_right_N": [0.0, 0.4, 0.2, 0.2]}
    done = cs.simulate(SECTION, pull)
    size = {"width": 160, "height": 120}
    offscreen.render(done.robot, done.inputs, (0.0, 0.0, 0.0), tmp_path / "again.png", **size)  # type: ignore[arg-type]

    def refused(*arguments: Any, **named: Any) -> None:
        raise AssertionError("simulated again")

    monkeypatch.setattr(offscreen, "simulate", refused)
    cs.render(done, tmp_path / "own.png", **size)  # type: ignore[arg-type]
    assert (tmp_path / "own.png").read_bytes() == (tmp_path / "again.png").read_bytes()
    cs.render(done, tmp_path / "rows.png", rows=[0, 1], **size)  # type: ignore[arg-type]
    cs.render(done, tmp_path / "own.gif", **size)  # type: ignore[arg-type]
    middle = offscreen._state_at(done.states, done.inputs.time_s, 0.25)
    np.testing.assert_allclose(
        middle.qpos, 0.75 * done.states[0].qpos + 0.25 * done.states[1].qpos, rtol=1e-12
    )
    assert (
        offscreen._state_at(done.states, done.inputs.time_s, 3.0).qpos.tolist()
        == done.states[3].qpos.tolist()
    )


@pytest.mark.parametrize("seconds", [1e5, 5000.1, 1.7e9])
def test_a_motion_of_too_many_steps_is_refused_before_any_work(
    seconds: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The line names rows, seconds, steps, the budget, and how to go on."""
    monkeypatch.setattr(replay, "in_force", None)  # the first thing that a simulation does
    pull = {"time_s": [0.0, seconds], "tension_right_N": [0.0, 0.1]}
    with pytest.raises(cs.InputError) as error:
        cs.simulate(SECTION, pull, dynamic=True)
    told = str(error.value)
    assert told == (
        f"inputs: time_s runs over {seconds:g} s, in motion at most 5000 s. These are 2 rows, "
        f"{seconds / 0.0005:.0f} steps of 0.0005 s; the budget is 10000000. Is time_s in seconds? If so, "
        "raise most_steps"
    )
    with pytest.raises(TypeError):  # both are let through, and fail at the patch
        cs.simulate(SECTION, pull, dynamic=True, most_steps=10**13)
    with pytest.raises(TypeError):
        cs.simulate(SECTION, pull)


def test_a_long_way_holds_a_second_of_its_inputs(monkeypatch: pytest.MonkeyPatch) -> None:
    """However far two rows are apart; all steps between them are taken, each once and in order."""
    asked: list[np.ndarray] = []
    means = replay.Commands.means

    def noted(self: Any, at_s: np.ndarray, width_s: float) -> Any:
        asked.append(at_s)
        return means(self, at_s, width_s)

    monkeypatch.setattr(replay.Commands, "means", noted)
    monkeypatch.setattr(simulator.Simulator, "step", lambda self, count=1: None)
    cs.simulate(SECTION, {"time_s": [0.0, 7.3], "tension_right_N": [0.0, 0.1]}, dynamic=True)
    assert max(map(len, asked)) == 2000
    np.testing.assert_allclose(np.concatenate(asked), 0.0005 * np.arange(14600), rtol=1e-12)


def test_progress_is_shown_where_it_is_asked_for(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """By lines where standard error is no terminal; not by itself, but on a terminal and in a notebook."""
    monkeypatch.setattr(simulator.Simulator, "step", lambda self, count=1: None)
    monkeypatch.setattr(replay, "counted", partial(progress.counted, every_s=0.0))
    pull = {"time_s": [0.0, 12.0], "tension_right_N": [0.0, 0.1]}
    cs.simulate(SECTION, pull, dynamic=True)
    assert capsys.readouterr().err == ""
    cs.simulate(SECTION, pull, dynamic=True, progress=True)
    told = capsys.readouterr().err
    assert "simulating: row 2 of 2" in told
    assert "simulating row 2: second 12 of 12" in told
    monkeypatch.setitem(sys.modules, "IPython", Notebook())
    cs.simulate(SECTION, pull, dynamic=True)
    assert "0/12" in capsys.readouterr().err
    cs.simulate(SECTION, pull, dynamic=True, progress=False)
    assert capsys.readouterr().err == ""


class Notebook(types.ModuleType):
    """IPython in a notebook, as far as it is asked."""

    def __init__(self) -> None:
        super().__init__("IPython")

    def get_ipython(self) -> Any:
        return types.SimpleNamespace(kernel=object())


def test_saved_table_reads_back(run: cs.Run, tmp_path: Path) -> None:
    """A saved run is the CSV of every output column."""
    run.save(tmp_path / "run.csv")
    assert list(read_table(tmp_path / "run.csv").columns) == list(run.to_table().columns)


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda run: cs.load_robot("neuroendoscop"), "unknown robot 'neuroendoscop'"),
        (lambda run: cs.load_robot(5), "robot: a path is needed, not 5"),
        (lambda run: cs.load_robot(SECTION, {"friction.nu": 1}), "friction.nu"),
        (lambda run: cs.load_robot(SECTION, 5), "settings"),
        (lambda run: cs.inputs(5, PULL), "robot = 5: a robot, its id or the path of its .toml is needed"),
        (lambda run: cs.inputs(SECTION, 5), "inputs: a mapping or a data frame of columns is needed, not 5"),
        (lambda run: cs.inputs(SECTION, {"tension_right_N": [1]}), "inputs: no column time_s"),
        (lambda run: cs.inputs(SECTION, {"time_s": 1.0}), "inputs: time_s: one number a row is needed"),
        (lambda run: cs.inputs(SECTION, {"time_s": []}), "inputs: time_s: one number a row is needed"),
        (
            lambda run: cs.inputs(SECTION, PULL | {"tension_right_N": [0.0]}),
            "shape (1,) where time_s has (3,)",
        ),
        (lambda run: cs.inputs(SECTION, PULL | {"tension_right_N": "a"}), "numbers are needed, not 'a'"),
        (lambda run: cs.inputs(SECTION, PULL | {"tension_up_N": 0}), "unknown input channel 'tension_up_N'"),
        (
            lambda run: cs.inputs(SECTION, PULL | {"tension_right_N": [0, -1, 0]}),
            "inputs: row 2: tension_right_N",
        ),
        (lambda run: cs.inputs(SECTION, PULL | {"time_s": [0, np.nan, 1]}), "inputs: row 2: time_s"),
        (lambda run: cs.inputs(SECTION, PULL | {"time_s": [0, 2, 1]}), "inputs: row 3: time_s = 1"),
        (lambda run: cs.read_inputs(SECTION, "nowhere.csv"), "nowhere.csv: no such file"),
        (lambda run: cs.read_inputs(SECTION, 5), "inputs: a path is needed, not 5"),
        (lambda run: cs.simulate(SECTION, PULL, (0, 0)), "gravity_mps2 = (0, 0): three finite numbers"),
        (lambda run: cs.simulate(SECTION, PULL, "down"), "gravity_mps2 = 'down': three finite numbers"),
        (lambda run: cs.simulate("chest_tube", run.inputs), "of 2 tendons; chest_tube has 8"),
        (lambda run: cs.statics(SECTION, PULL, "pk"), "unknown static model 'pk'; choices: fkm"),
        (lambda run: cs.statics(SECTION, PULL, None), "unknown static model"),
        (
            lambda run: cs.statics(
                cs.load_robot("spacer_disk", {"segments.first.rest_curvature_y_per_m": 3}), PULL, "VC"
            ),
            "static model 'VC' does not carry this robot: segments.first: rest curvature; choices: CC",
        ),
        (lambda run: cs.build("nothing"), "unknown robot 'nothing'"),
        (lambda run: cs.render(run, "tip.png"), "only a run of `simulate` whose rows are held is drawn"),
        (lambda run: cs.render(5, "tip.png"), "render: 5: only a run of `simulate`"),
        (lambda run: run.to_table(["tip_a_mm"]), "columns: unknown output column 'tip_a_mm'"),
        (lambda run: run.to_table(5), "columns = 5: names of output columns are needed"),
        (lambda run: run.plot("tip"), "columns: unknown output column 'tip'"),
        (lambda run: run.save("run.txt"), "run.txt: a run is saved as a table; choices: .csv"),
        (lambda run: run.save(5), "save: a path is needed, not 5"),
        (lambda run: run.save("no/such/run.csv"), "no/such"),
        (lambda run: cs.list_models("nothing"), "unknown robot 'nothing'"),
        (lambda run: cs.list_effects(3), "robot = 3"),
    ],
)
def test_bad_argument_is_one_line(run: cs.Run, call: Any, told: str) -> None:
    """What a user gets wrong is an `InputError` of one line that names it."""
    with pytest.raises(cs.InputError) as error:
        call(run)
    assert told in str(error.value)
    assert "\n" not in str(error.value)


def test_simulated_robot_that_winds_up_diverges(monkeypatch: pytest.MonkeyPatch) -> None:
    """A simulation that leaves the finite numbers raises, and the message says at which row."""
    pull = {"time_s": [0.0, 1.0], "tension_right_N": [0.0, 1e9]}
    with pytest.raises(cs.SimulationDiverged, match="row 2"):
        cs.simulate(SECTION, pull)


def test_row_of_statics_without_a_balance_is_named() -> None:
    """A static model that finds no balance ends in an error that names the row."""
    pull = {"time_s": [0.0, 1.0], "tension_right_N": [0.0, 1e9]}
    with pytest.raises(cs.InputError, match="row 2"):
        cs.statics(SECTION, pull, "VC_ref")
