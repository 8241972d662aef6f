"""A robot along inputs, by simulation, by a static model or under control, and what can be done with it."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from catheter_sim.core.motion import MOST_STEPS, require_steps
from catheter_sim.core.robot import flag_of, number_of, whole_of
from catheter_sim.errors import InputError, SimulationDiverged, shown, unknown
from catheter_sim.public.data import (
    AT_REST,
    Listing,
    columns_of,
    data_frame,
    gravity_of,
    inputs_of,
    listing_of,
    mapping_of,
    path_of,
    progress_of,
    robot_of,
    texts_of,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from catheter_sim.arrays import Array
    from catheter_sim.controllers.comparison import Setting
    from catheter_sim.controllers.loop import ControlRun
    from catheter_sim.core.inputs import Inputs
    from catheter_sim.core.posture import Posture
    from catheter_sim.core.robot import RobotSpec
    from catheter_sim.pictures.offscreen import DrawnState
    from catheter_sim.simulation.simulator import Simulator
    from catheter_sim.tables import Table

# ----------------------------------------------------------------------------------------------------
# A robot along a history of inputs, by simulation or by a static model, and what can be done with it.

HELD, DYNAMIC = "simulation", "simulation in motion"
_TIP = ("tip_x_mm", "tip_y_mm", "tip_z_mm")


@dataclass(frozen=True, repr=False)
class Run:
    """What is observed of a robot along its inputs, row by row.

    Attributes:
        robot: as it was specified, effects named.
        inputs: as they were commanded.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].
        postures: one a row, SI units.
        by: what made it: "simulation", "simulation in motion", or the static model's name.
        residual: of a static model, the largest unbalanced moment of each row, shape (r,) [N m]; else None.
        at_rest: of a simulation, whether each row had come to rest, shape (r,); else None.
        states: of a simulation whose rows are held, what each row looks like, for `render`; else none.

    Examples:
        >>> import catheter_sim as cs
        >>> pull = {"time_s": [0.0, 1.0], "tension_right_N": [0.0, 0.4]}
        >>> run = cs.statics("neuroendoscope_section", pull, model="fkm_exact_arm")
        >>> run.to_table(["tip_x_mm"]).columns["tip_x_mm"].round(2)
        array([ 0.  , 40.48])
    """

    robot: RobotSpec
    inputs: Inputs
    gravity_mps2: Array
    postures: tuple[Posture, ...]
    by: str
    residual: Array | None = None
    at_rest: Array | None = None
    states: tuple[DrawnState, ...] = field(default=(), compare=False)

    def __len__(self) -> int:
        return len(self.postures)

    def to_table(self, columns: Sequence[str] | None = None) -> Table:
        """Return the output columns in file units; `columns` (default: all that the robot has) names them.

        Raises:
            InputError: the robot has no such column.
        """
        from catheter_sim.channels import check_output_channels, output_table

        names = None if columns is None else columns_of(columns)
        check_output_channels(self.robot, names or (), "columns")
        return output_table(self.robot, self.inputs.time_s, self.postures, names)

    def to_dataframe(self, columns: Sequence[str] | None = None) -> Any:
        """Return `to_table` with its `time_s` as a pandas `DataFrame`.

        Raises:
            InputError: pandas is not installed, or as for `to_table`.
        """
        table = self.to_table(columns)
        return data_frame({"time_s": table.time_s, **table.columns})

    def plot(self, columns: Sequence[str] | None = None, ax: Any = None) -> Figure:
        """Return a figure of output columns over time, those of one unit in one panel.

        Args:
            columns: default: the tip's place, and the tensions.
            ax: axes of matplotlib to draw into, one for each unit; None: a new figure.

        Raises:
            InputError: as for `to_table`, or `ax` holds something else.
        """
        from catheter_sim.channels import output_channels
        from catheter_sim.diagnosis.trials import unit_of
        from catheter_sim.pictures.curves import entitle, panels_of

        names = (
            columns_of(columns)
            if columns is not None
            else [name for name in output_channels(self.robot) if name in _TIP or name.startswith("tension_")]
        )
        table = self.to_table(names)
        units: dict[str, list[str]] = {}
        for name in names:
            units.setdefault(unit_of(name), []).append(name)
        count = max(1, len(units))
        figure, panels = panels_of(ax, count, 1, (8.0, 2.4 * count + 0.6), sharex=True)
        for axes, (unit, members) in zip(panels[:, 0], units.items(), strict=False):
            for name in members:
                axes.plot(table.time_s, table.columns[name], label=name.removesuffix(f"_{unit}"))
            axes.set_ylabel(f"[{unit}]")
            axes.legend(fontsize="small", frameon=False)
        panels[-1, 0].set_xlabel("time [s]")
        entitle(figure, panels, f"{self.robot.name}: {self.by}")
        return figure

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write every output column to a CSV file, as `catheter-sim simulate` does.

        Raises:
            InputError: the file cannot be written, or does not end in `.csv`.
        """
        from catheter_sim.tables import write_table

        file = path_of(path, "save")
        if not file.lower().endswith(".csv"):
            raise InputError(f"{file}: a run is saved as a table; choices: .csv")
        write_table(self.to_table(), file)

    def __repr__(self) -> str:
        return f"<Run of {self.robot.name} by {self.by}: {len(self)} rows>"

    def _repr_html_(self) -> str:
        table = self.to_table(_TIP)
        return listing_of(repr(self)[1:-1], {"time_s": table.time_s, **table.columns})._repr_html_()


def simulate(
    robot: RobotSpec | str | os.PathLike[str],
    inputs: Any,
    gravity_mps2: Sequence[float] = AT_REST,
    dynamic: bool = False,
    most_steps: int = MOST_STEPS,
    progress: bool | None = None,
) -> Run:
    """Return what MuJoCo makes of a robot under `inputs`, its effects included, from rest.

    Args:
        robot: a robot, its id or its file.
        inputs: from `inputs` or `read_inputs`, or what these take: a mapping, a data frame, a CSV file.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].
        dynamic: start at rest under the first row, then follow `time_s` in motion, with inertia and the
            robot's own damping; else each row is held until the robot rests.
        most_steps: that a motion may take; the default is an hour of computing.
        progress: show on standard error what is done; None: on a terminal, and in a notebook.

    Warns:
        UserWarning: an input is beyond what the robot can follow; one line names the columns.

    Raises:
        InputError: anything is not possible, or a motion takes more steps than `most_steps`.
        SimulationDiverged: the simulation left the finite numbers; the message says at which row and time.

    Examples:
        >>> import catheter_sim as cs
        >>> run = cs.simulate("chest_tube_section", {"time_s": [0.0, 1.0], "tension_active_N": [0.0, 20.0]})
        >>> len(run), run.by
        (2, 'simulation')
    """
    from catheter_sim.effects.varying import varies
    from catheter_sim.pictures.images import PulledTendons, pulled_tendons
    from catheter_sim.pictures.offscreen import state_of
    from catheter_sim.simulation.replay import simulate as run_robot

    value, moving, told = robot_of(robot), flag_of(dynamic, "dynamic"), progress_of(progress)
    budget, gravity = whole_of(most_steps, "most_steps", "a whole number from 1", 1), gravity_of(gravity_mps2)
    commanded = inputs_of(value, inputs)
    if moving:
        require_steps(value, commanded.time_s, budget, "inputs")
    states: list[DrawnState] = []
    tendons: list[PulledTendons] = []

    def keep(simulator: Simulator, row: int) -> None:
        if not tendons:
            tendons.append(pulled_tendons(simulator.model, simulator.robot))
        states.append(state_of(simulator, tendons[0], states[-1] if states else None))

    drawn = None if moving or varies(value) else keep
    done = run_robot(value, commanded, gravity, dynamic=moving, progress=told, on_row=drawn)
    _warn_of_limits(value, commanded)
    if done.failure is not None:
        raise SimulationDiverged(done.failure)
    by = DYNAMIC if moving else HELD
    return Run(value, commanded, gravity, done.postures, by, at_rest=done.at_rest, states=tuple(states))


def statics(
    robot: RobotSpec | str | os.PathLike[str],
    inputs: Any,
    model: str,
    gravity_mps2: Sequence[float] = AT_REST,
) -> Run:
    """Return what a static model says of a robot under `inputs`, its effects included, row after row.

    Args:
        robot: a robot, its id or its file.
        inputs: as for `simulate`.
        model: one of `list_models(robot)`.
        gravity_mps2: gravity in the base frame, shape (3,) [m/s^2].

    Raises:
        InputError: the model does not know the robot, or a row has no balance.

    Examples:
        >>> import catheter_sim as cs
        >>> pull = {"time_s": [0.0, 1.0], "tension_active_N": [0.0, 20.0]}
        >>> cs.statics("chest_tube_section", pull, model="complete")
        <Run of chest_tube_section by complete: 2 rows>
    """
    from catheter_sim.core.inputs import row_name
    from catheter_sim.core.posture import finite_rows
    from catheter_sim.theory.static_models import static_model

    value = robot_of(robot)
    solver = static_model(str(model), value, value.name)
    commanded = inputs_of(value, inputs)
    gravity = gravity_of(gravity_mps2)
    solved = solver.solve(value, commanded, gravity)
    row = finite_rows(solved.postures)
    if row < len(solved.postures):
        raise InputError(f"{row_name(commanded, row)}: static model {model!r} gives no finite posture")
    _warn_of_limits(value, commanded)
    return Run(value, commanded, gravity, solved.postures, model, residual=solved.residual)


def _warn_of_limits(robot: RobotSpec, inputs: Inputs) -> None:
    """Warn, at the caller's caller, of inputs beyond what the robot can follow."""
    from catheter_sim.planning.bounded import beyond_limits

    if line := beyond_limits(robot, inputs):
        warnings.warn(f"{robot.name}: {line}", UserWarning, stacklevel=3)


def build(robot: RobotSpec | str | os.PathLike[str]) -> Any:
    """Return a robot's MuJoCo model, effects built in, as a `mujoco.MjSpec`: the one that moves.

    What runs beside MuJoCo's own step (friction, nonlinear springs) is in `Simulator`, not in the model.

    Raises:
        InputError: the robot is not possible.

    Examples:
        >>> import catheter_sim as cs
        >>> cs.build("neuroendoscope_section").compile().ntendon
        2
    """
    import mujoco

    from catheter_sim.effects.apply import built_in
    from catheter_sim.modelling.build import build_mjcf

    return mujoco.MjSpec.from_string(build_mjcf(built_in(robot_of(robot)), motion=True))


def to_pymjcf(robot: RobotSpec | str | os.PathLike[str]) -> Any:
    """Return what `build` does as a `dm_control.mjcf.RootElement`, to be attached to an arena.

    All of it hangs on a body `base_frame`, so that `Simulator` finds it by the prefix `<model's name>/`. Its
    lights, cameras, background and gravity stay behind, and it touches nothing. Its angles are in radians:
    so must be those of the arena.

    Raises:
        InputError: the robot is not possible, dm_control cannot be imported, or there are more links inside
            one another than it reads (some 250).

    Examples:
        >>> import catheter_sim as cs
        >>> from dm_control import mjcf
        >>> arena = mjcf.RootElement(model="arena")
        >>> frame = arena.attach(cs.to_pymjcf("neuroendoscope_section"))
        >>> arena.find("actuator", "neuroendoscope_section/tendon_right").tag
        'motor'
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # it looks for a screen, which a model needs not
            from dm_control import mjcf
    except Exception as error:  # it and PyOpenGL raise classes of their own where `MUJOCO_GL` does not fit
        raise InputError(f"dm_control cannot be imported: pip install dm-control ({error})") from None

    from catheter_sim.core.law import BASE
    from catheter_sim.effects.apply import built_in
    from catheter_sim.mjcf.document import Element, read
    from catheter_sim.modelling.build import build_mjcf

    value, base = built_in(robot_of(robot)), Element("body", name=BASE)
    root = read(build_mjcf(value, motion=True))
    root.set(model=value.name.replace("/", "_"))  # PyMJCF parts names by it
    option, world = root.part("option"), root.part("worldbody")
    option.set(gravity=None)
    left = ("flag", "statistic", "visual", "texture", "light", "camera")
    for item in list(root.every(*left)):
        item.remove()
    for item in list(world.children):
        base.append(item)
    world.append(base)
    try:
        return mjcf.from_xml_string(root.text())
    except SyntaxError as error:  # lxml's, of links inside one another
        raise InputError(f"{value.name}: dm_control does not read the model: {error}") from None


def render(
    run: Run,
    path: str | os.PathLike[str],
    width: int = 1280,
    height: int = 720,
    rows: Sequence[int] = (),
    curves: bool = False,
    progress: bool | None = None,
) -> None:
    """Write a picture (.png: the last row) or a video (.mp4, .gif: all rows) of a run, without a screen.

    The run's own rows are drawn; between two of them a video goes evenly from one to the other. A run in
    motion or of a static model has no picture.

    Args:
        run: a run of `simulate`.
        path: file to write.
        width, height: of the picture [pixels].
        rows: numbers of the rows to show in one picture, 0 for the first; the last in full colours.
        curves: show the inputs' curves beside the video.
        progress: show on standard error what is done; None: on a terminal, and in a notebook.

    Raises:
        InputError: another file's ending, a run that has no picture, or nothing to draw with.

    Examples:
        >>> import catheter_sim as cs
        >>> run = cs.simulate("neuroendoscope_section", {"time_s": [0.0], "tension_right_N": [0.3]})
        >>> cs.render(run, "tip.png", width=320, height=240)
    """
    from catheter_sim.effects.apply import in_force
    from catheter_sim.pictures.offscreen import render as draw

    if not isinstance(run, Run) or not run.states:
        raise InputError(f"render: {shown(run)}: only a run of `simulate` whose rows are held is drawn")
    acting = in_force(run.robot, run.inputs)
    draw(
        acting.robot,
        acting.inputs,
        tuple(run.gravity_mps2),
        path_of(path, "render"),
        whole_of(width, "width", "a whole number of pixels", 1),
        whole_of(height, "height", "a whole number of pixels", 1),
        progress=progress_of(progress),
        rows=rows_of(rows),
        curves=flag_of(curves, "curves"),
        states=run.states,
    )


def rows_of(rows: Sequence[int]) -> list[int]:
    """Return numbers of rows as a list.

    Raises:
        InputError: they are none.
    """
    try:
        listed = list(rows)
    except TypeError:
        raise InputError(f"rows = {shown(rows)}: numbers of rows, 0 for the first, are needed") from None
    return [whole_of(row, "rows", "the number of a row, 0 for the first,", 0) for row in listed]


# ----------------------------------------------------------------------------------------------------
# Controlled motions of a catheter: feedforward by a named model, PID on a tracker, motors.

PAPER = ("pk", "te", "te+pid")  # Nayar 2023, Section IV-A
PID = (0.01, 0.2, 0.0001)  # printed there; units as read in `controllers.motors`
NOISE_DEG = 0.5  # assumed: of an electromagnetic tracker's angles
_LONGEST_S = 1000.0
_MOST_RATE_HZ = 200.0
# Nayar 2023, Section IV-A: RMSE of the proximal bending joint [deg]; the trajectory is not printed.
_PRINTED_DEG = {"PK": 21.0, "TE": 4.8, "PK+PID": 2.53, "TE+PID": 0.88}
_PRINTED_OF = ("mitral_4dof", "bending_proximal")
_RATIOS = (("TE", "PK"), ("PK+PID", "PK"), ("TE+PID", "TE"), ("TE+PID", "PK"))
SUMMARY = ("run", "joint", "rmse_deg", "measured_rmse_deg", "effort_mm", "controller_share")


@dataclass(frozen=True, repr=False)
class Control:
    """Controlled motions by the names of their ways ("PK", "TE+PID"): see `control`, which returns it.

    Attributes:
        robot: what was simulated.
        believed: what the controller took it for.
        pairs: names of the joints' pairs, in the order of the runs' columns.
        runs: the motions.
        setting: gains, noise, rate and motors.
        own_trajectory: whether the user gave the trajectory; else it is the stand-in for the paper's.

    Examples:
        >>> import catheter_sim as cs
        >>> asked = {"time_s": [0.0, 2.0, 3.0], "angle_bending_proximal_deg": [0.0, 20.0, 20.0]}
        >>> found = cs.control("mitral_4dof", asked, models=["pk"], noise_deg=0.0)
        >>> found
        <Control of mitral_4dof: PK>
        >>> bool(found.to_table()[0]["rmse_deg"] < 1.0)
        True
    """

    robot: RobotSpec
    believed: RobotSpec
    pairs: tuple[str, ...]
    runs: Mapping[str, ControlRun]
    setting: Setting
    own_trajectory: bool

    def to_table(self) -> Listing:
        """Return a row for each run and each joint that turns and is asked to.

        Columns: `run`, `joint`, `rmse_deg` (true angle less desired), `measured_rmse_deg` (as the tracker saw
        it), `effort_mm` (mean displacement of the pair), `controller_share` (of feedback in it, Nayar 2023,
        Table II).
        """
        rows = []
        for name, run in self.runs.items():
            shares, errors = run.controller_share(), run.rmse_deg()
            for k, pair in enumerate(self.pairs):
                if run.joints[k] == "prismatic" or not np.any(run.desired[:, k]):
                    continue
                measured = run.reached if run.measured is None else run.measured
                seen = np.degrees(np.sqrt(np.mean((measured[:, k] - run.desired[:, k]) ** 2)))
                effort = 1e3 * float(np.abs(run.displaced_m[:, k]).mean())
                values = (name, pair, float(errors[k]), float(seen), effort, float(shares[k]))
                rows.append(dict(zip(SUMMARY, values, strict=True)))
        return Listing(f"Control of {self.robot.name}", SUMMARY, tuple(rows))

    def ratios(self) -> Listing:
        """Return ratios of the runs' errors joint by joint, with the printed ones beside.

        Columns: `joint`, `of` and `over` (runs), `ratio` (of `rmse_deg`), `printed` (Nayar 2023, Section
        IV-A, of the proximal bending joint under the paper's own trajectory, which is not printed; None
        elsewhere).
        """
        error = {(row["run"], row["joint"]): row["rmse_deg"] for row in self.to_table()}
        rows = []
        for pair in self.pairs:
            printed_here = not self.own_trajectory and self._is_papers() and pair == _PRINTED_OF[1]
            for of, over in _RATIOS:
                if (of, pair) in error and (over, pair) in error and error[over, pair] > 0.0:
                    printed = _PRINTED_DEG[of] / _PRINTED_DEG[over] if printed_here else None
                    ratio = error[of, pair] / error[over, pair]
                    rows.append({"joint": pair, "of": of, "over": over, "ratio": ratio, "printed": printed})
        return Listing("Ratios of errors", ("joint", "of", "over", "ratio", "printed"), tuple(rows))

    def series(self, run: str) -> Table:
        """Return one run over time: desired, reached, measured angle and error of each joint, and its effort.

        Columns are `desired_<joint>_deg`, `reached_...`, `measured_...`, `error_...` (mm for an advance), and
        `model_<joint>_mm`, `controller_<joint>_mm`, `displacement_<joint>_mm`.

        Raises:
            InputError: no such run.
        """
        from catheter_sim.tables import Table as Value

        if run not in self.runs:
            raise unknown("run", run, self.runs)
        found = self.runs[run]
        measured = found.reached if found.measured is None else found.measured
        columns: dict[str, Array] = {}
        for k, pair in enumerate(self.pairs):
            unit, size = ("mm", 1e3) if found.joints[k] == "prismatic" else ("deg", 180.0 / np.pi)
            parts = {
                "desired": found.desired,
                "reached": found.reached,
                "measured": measured,
                "error": found.reached - found.desired,
            }
            columns |= {f"{name}_{pair}_{unit}": size * part[:, k] for name, part in parts.items()}
            efforts = {
                "model": found.model_m,
                "controller": found.controller_m,
                "displacement": found.displaced_m,
            }
            columns |= {f"{name}_{pair}_mm": 1e3 * part[:, k] for name, part in efforts.items()}
        return Value(found.times_s, columns)

    def to_dataframe(self) -> Any:
        """Return `to_table` as a pandas `DataFrame`.

        Raises:
            InputError: pandas is not installed.
        """
        return self.to_table().to_dataframe()

    def save(self, path: str | os.PathLike[str]) -> list[str]:
        """Write a folder: `summary.csv`, `ratios.csv`, a CSV of each run over time, `control.png`.

        Returns:
            The files' names.

        Raises:
            InputError: the folder cannot be written.
        """
        from catheter_sim.files import check_output_folder
        from catheter_sim.tables import replaced_when_whole, write_table

        folder = check_output_folder(path_of(path, "save"))
        folder.mkdir(parents=True, exist_ok=True)
        self.to_table().save(folder / "summary.csv")
        self.ratios().save(folder / "ratios.csv")
        names = ["summary.csv", "ratios.csv"]
        for run in self.runs:
            names.append(f"{run.lower().replace('+', '_')}.csv")
            write_table(self.series(run), folder / names[-1])
        with replaced_when_whole(folder / "control.png", binary=True) as file:
            self.plot().savefig(file, format="png", dpi=130)
        return [*names, "control.png"]

    def plot(self, ax: Any = None) -> Figure:
        """Return a figure of angles, errors and efforts over time, a column a joint.

        Args:
            ax: axes of matplotlib to draw into, three a moving joint, row by row; None: a new figure.

        Raises:
            InputError: `ax` holds something else.
        """
        from catheter_sim.public.planning import control_figure

        return control_figure(self, ax)

    def _is_papers(self) -> bool:
        return self.robot.name.partition("@")[0] == _PRINTED_OF[0]

    def __repr__(self) -> str:
        return f"<Control of {self.robot.name}: {', '.join(self.runs)}>"

    def _repr_html_(self) -> str:
        return self.to_table()._repr_html_()


def control(
    robot: RobotSpec | str | os.PathLike[str],
    trajectory: Any = None,
    models: Sequence[str] = PAPER,
    pid: Sequence[float] = PID,
    noise_deg: float = NOISE_DEG,
    frame_error_deg: float = 0.0,
    believed: RobotSpec | str | os.PathLike[str] | None = None,
    motors: str = "none",
    motor_gain: float = 1.0,
    dead_band_mm: Mapping[str, float] | None = None,
    rate_hz: float = 40.0,
    seed: int = 0,
) -> Control:
    """Return how well a catheter follows a trajectory of its joints, by several ways of control.

    At each tick a tracker measures the joints' angles, feedforward and PID add up to displacements of the
    pairs, and these move evenly to the next tick. The robot starts at rest. A terminal and a notebook show
    what is done.

    Args:
        robot: what is simulated: a catheter, its id or its file.
        trajectory: a mapping, a data frame or a CSV file: `time_s` [s], and any of `angle_<joint>_deg` and
            the tube's advance in mm (`advance_mm`), on lines from row to row; joints left out stay at 0.
            None: both bending joints of the 4-DoF catheter through 10, 40, 10, 60, 10 deg in 75 s, the
            stand-in for the trajectory of Nayar 2023, Section IV-A, which is not printed.
        models: ways: a feedforward (`pk` pure kinematics, `te` with the tendons' elongation, `mk` modified
            kinematics), with `+pid` where feedback is added.
        pid: gains KP [mm/deg], KI [mm/(deg s)], KD [mm s/deg]; default: as printed, units as read.
        noise_deg: standard deviation of the measured angles, white [deg] (assumed).
        frame_error_deg: what every angle is measured too large [deg].
        believed: what the controller takes the robot for; default: of `mitral_4dof@elongation` the nominal
            `mitral_4dof`, else the robot without its effects.
        motors: "none": pairs follow at once; "pd": by a motor with PD; "observer": with a disturbance
            observer besides (Nayar 2022, Fig. 5).
        motor_gain: the motors' gain over the one that their controller takes them to have.
        dead_band_mm: dead-bands of torsion pairs that the feedforward compensates, by the pair's name.
        rate_hz: ticks a second; a whole number of simulation steps must fit.
        seed: of the noise, the same for every way.

    Raises:
        InputError: the robot is no catheter, or anything else is not possible.

    Examples:
        >>> import catheter_sim as cs
        >>> hold = {"time_s": [0.0, 1.0], "angle_bending_deg": [0.0, 10.0]}
        >>> list(cs.control("mitral_transseptal", hold, models=["pk", "pk+pid"]).runs)
        ['PK', 'PK+PID']
    """
    value = robot_of(robot)
    taken_for = believed_robot(value) if believed is None else robot_of(believed)
    bands_mm = mapping_of(dead_band_mm, "dead_band_mm", "pairs to dead-bands")
    setting = setting_of(pid, noise_deg, frame_error_deg, motors, motor_gain, bands_mm, rate_hz, seed)
    return controlled(value, taken_for, trajectory, models, setting, progress_of(None))


def setting_of(
    pid: Sequence[float],
    noise_deg: float,
    frame_error_deg: float,
    motors: str,
    motor_gain: float,
    dead_band_mm: Mapping[str, float],
    rate_hz: float,
    seed: int,
) -> Setting:
    """Return what all ways share, checked; arguments and errors as of `control`."""
    from catheter_sim.controllers.comparison import Setting as Value

    return Value(
        gains_of(pid),
        _number(noise_deg, "noise_deg", 0.0, 90.0),
        _number(frame_error_deg, "frame_error_deg", -90.0, 90.0),
        whole_of(seed, "seed", "a whole number from 0", 0),
        _number(rate_hz, "rate_hz", 0.1, _MOST_RATE_HZ),
        motors,
        _number(motor_gain, "motor_gain", 0.01, 100.0),
        {name: 1e-3 * number_of(width, f"dead_band_mm: {name}") for name, width in dead_band_mm.items()},
    )


def controlled(
    robot: RobotSpec,
    believed: RobotSpec,
    trajectory: Any,
    models: Sequence[str] | str,
    setting: Setting,
    progress: bool = False,
) -> Control:
    """Return a robot's controlled motions; arguments and errors as of `control`.

    `setting` is what all ways share.
    """
    from catheter_sim.controllers.comparison import follow, way_of

    named = texts_of(models, "models", "ways of control, as pk+pid,", 1)
    ways = list(dict.fromkeys(way_of(model) for model in named))
    desired = desired_values(robot, trajectory, setting.rate_hz)
    runs = follow(robot, believed, desired, ways, setting, progress)
    pairs = tuple(pair.name for pair in robot.tendons)
    return Control(robot, believed, pairs, runs, setting, trajectory is not None)


def believed_robot(robot: RobotSpec) -> RobotSpec:
    """Return what a controller takes a robot for: its nominal parameter set, without effects."""
    from dataclasses import replace

    from catheter_sim.catalogue import PUBLISHED, load_robot

    nominal, _, parameters = robot.name.partition("@")
    if parameters and nominal in PUBLISHED:
        return load_robot(nominal)
    return replace(robot, effects={})


def gains_of(pid: Sequence[float]) -> Any:
    """Return gains in mm and deg as `controllers.motors.Gains`.

    Raises:
        InputError: not three finite numbers.
    """
    from catheter_sim.controllers.motors import DEG_TO_SI, Gains

    try:
        p, i, d = (number_of(gain, "pid") for gain in pid)
    except (TypeError, ValueError):  # InputError too
        raise InputError(f"pid = {shown(pid)}: three numbers KP, KI, KD are needed, all finite") from None
    return Gains(p * DEG_TO_SI, i * DEG_TO_SI, d * DEG_TO_SI)


def desired_values(robot: RobotSpec, trajectory: Any, rate_hz: float) -> Array:
    """Return the joint values that are desired at the ticks, shape (r, t) [rad or m].

    Raises:
        InputError: a column is no joint's, a value is missing, or the motion is too long.
    """
    from catheter_sim.channels import drives_of, outputs_of
    from catheter_sim.controllers.loop import through, ticks_s
    from catheter_sim.core.inputs import Quantity
    from catheter_sim.public.planning import clocked_table
    from catheter_sim.robots import face_of
    from catheter_sim.tables import own_clock

    face_of(robot, "joint_control", "joint control")
    drives = drives_of(robot)
    if trajectory is None:
        from catheter_sim.validation.mitral_control import BENDING, CORNERS_DEG, LEGS_S

        moved = [k for k, pair in enumerate(robot.tendons) if pair.name in BENDING]
        if len(moved) < len(BENDING):
            raise InputError(f"{robot.name}: a trajectory is needed; only mitral_4dof has one of its own")
        ticks = ticks_s(sum(LEGS_S), rate_hz)
        desired = np.zeros((len(ticks), len(drives)))
        desired[:, moved] = np.radians(through(CORNERS_DEG, LEGS_S, ticks))[:, np.newaxis]
        return desired
    table = clocked_table(trajectory, "trajectory")
    angles = {f"angle_{drive.moves}_deg": k for k, drive in enumerate(drives)}
    known = {name: k for name, k in angles.items() if name in outputs_of(robot).angles}
    known |= {item.column: k for k, item in enumerate(drives) if item.quantity is Quantity.ADVANCE}
    for name in table.columns:
        if name not in known:
            raise unknown("joint", name, known, table.where)
    table.require_complete()
    table.require_increasing_time()
    clock = own_clock(table.time_s)
    if clock[-1] > _LONGEST_S:
        raise InputError(f"{table.where}: time_s runs over {clock[-1]:g} s; at most {_LONGEST_S:g} s")
    ticks = ticks_s(float(clock[-1]), rate_hz)
    desired = np.zeros((len(ticks), len(drives)))
    for name, values in table.columns.items():
        size = np.pi / 180.0 if name.endswith("_deg") else 1e-3
        desired[:, known[name]] = size * np.interp(ticks, clock, values)
    return desired


def _number(value: Any, where: str, least: float, most: float) -> float:
    return number_of(value, where, f"a number from {least:g} to {most:g}", lambda it: least <= it <= most)


def notes(found: Control) -> list[str]:
    """Return what a reader must know of the figures, a line each."""
    noise, turned = found.setting.noise_deg, found.setting.frame_error_deg
    parts = [
        f"controller takes the robot for {found.believed.name}; white noise of {noise:g} deg on every angle "
        f"(assumed), frame error {turned:g} deg"
    ]
    if any(row["printed"] is not None for row in found.ratios()):
        parts.append(
            "printed: Nayar 2023, Section IV-A, proximal joint, RMSE 21 (PK), 4.8 (TE), 0.88 deg (TE+PID); "
            "its trajectory is not printed, and TE's error here follows from an assumed slack and friction"
        )
    return parts


def table_text(found: Control) -> str:
    """Return summary, ratios and notes as text."""
    return "\n".join([str(found.to_table()), "", str(found.ratios()), *notes(found)])
