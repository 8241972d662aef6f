"""A robot along a history of inputs, by simulation or by a static model, and what can be done with it."""

from __future__ import annotations

import os
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from catheter_sim.core.motion import MOST_STEPS, require_steps
from catheter_sim.core.requirements import flag_of, whole_of
from catheter_sim.errors import InputError, SimulationDiverged, shown
from catheter_sim.public.arguments import AT_REST, columns_of, gravity_of, path_of, progress_of, robot_of
from catheter_sim.public.data import inputs_of
from catheter_sim.public.listing import data_frame, listing_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from catheter_sim.arrays import Array
    from catheter_sim.core.inputs import Inputs
    from catheter_sim.core.posture import Posture
    from catheter_sim.core.robot import RobotSpec
    from catheter_sim.pictures.state import State
    from catheter_sim.simulation.simulator import Simulator
    from catheter_sim.tables import Table

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
    states: tuple[State, ...] = field(default=(), compare=False)

    def __len__(self) -> int:
        return len(self.postures)

    def to_table(self, columns: Sequence[str] | None = None) -> Table:
        """Return the output columns in file units; `columns` (default: all that the robot has) names them.

        Raises:
            InputError: the robot has no such column.
        """
        from catheter_sim.channels import check_output_channels
        from catheter_sim.columns import output_table

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
        from catheter_sim.pictures.figures import entitle, panels_of

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
        UserWarning: an input is beyond what the robot can follow; a line for each column.

    Raises:
        InputError: anything is not possible, or a motion takes more steps than `most_steps`.
        SimulationDiverged: the simulation left the finite numbers; the message says at which row and time.

    Examples:
        >>> import catheter_sim as cs
        >>> run = cs.simulate("chest_tube_section", {"time_s": [0.0, 1.0], "tension_active_N": [0.0, 20.0]})
        >>> len(run), run.by
        (2, 'simulation')
    """
    from catheter_sim.pictures.state import state_of
    from catheter_sim.pictures.tendon_paint import PulledTendons, pulled_tendons
    from catheter_sim.simulation.replay import simulate as run_robot

    value, moving, told = robot_of(robot), flag_of(dynamic, "dynamic"), progress_of(progress)
    budget, gravity = whole_of(most_steps, "most_steps", "a whole number from 1", 1), gravity_of(gravity_mps2)
    commanded = inputs_of(value, inputs)
    if moving:
        require_steps(value, commanded.time_s, budget, "inputs")
    states: list[State] = []
    tendons: list[PulledTendons] = []

    def keep(simulator: Simulator, row: int) -> None:
        if not tendons:
            tendons.append(pulled_tendons(simulator.model, simulator.robot))
        states.append(state_of(simulator, tendons[0], states[-1] if states else None))

    done = run_robot(
        value, commanded, gravity, dynamic=moving, progress=told, on_row=None if moving else keep
    )
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
    from catheter_sim.theory.run import static_model

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
    from catheter_sim.planning.limits import beyond_limits

    for line in beyond_limits(robot, inputs):
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
        'general'
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
