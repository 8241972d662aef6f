"""A bench that is simulated: a specimen with hidden causes, its tracker's noise, and limits.

The hidden causes are `lab.forms`'s: laws written a second time, that know nothing of the effects
which a diagnosis fits. A stand-in made by `effects/` would answer every proposal exactly as the proposal's
own arithmetic expects, so that it would show nothing. The specimen's uncertain numbers are drawn in their
ranges, as a real specimen's are.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.channels import check_output_channels, drives_of
from catheter_sim.core.inputs import Quantity
from catheter_sim.core.published import Trials
from catheter_sim.core.robot import RobotSpec
from catheter_sim.errors import InputError, unknown
from catheter_sim.lab.engine import (
    LARGEST,
    SMALLEST,
    Acting,
    CannotMake,
    Ground,
    LabForm,
    Planted,
    columns_of,
    looked_at,
    simulated,
)
from catheter_sim.lab.forms import BY_KEY, CAUSES, FORMS
from catheter_sim.lab.rig import Limits, Said, asked_columns, completed, drive_limits, named_robot
from catheter_sim.lab.robots import BENCH_ROBOTS, BenchRobot
from catheter_sim.lab.specimen import (
    KINDS,
    Course,
    Specimen,
    drawn_courses,
    drawn_specimen,
    measured,
    specimen_of,
)
from catheter_sim.tables import Table
from catheter_sim.units import si_factor

FORCES = ("force_tip_x_N", "force_tip_y_N", "force_tip_z_N")
RANDOM = "random"  # what is hidden, drawn
_KEY = 71  # of this file's random numbers
_TRIES = 30  # causes drawn until one can be planted
_TRIALS = 2  # usual ones, by which it is judged how large a cause must be to show
_INNER = 1.2  # sizes are aimed at so far inside of `SMALLEST` to `LARGEST`
_DRIVES = {Quantity.TENSION: "pull", Quantity.DISPLACEMENT: "heading"}

Sized = tuple[Planted, Array]  # with its change of the outputs over the noise


@dataclass
class SimulatedRig:
    """A stand-in for a robot on a bench (`lab.rig.Rig`), by the MuJoCo simulation.

    Attributes:
        ground: the specimen, and the trials by which what is large for it is judged.
        planted: what is hidden in it, in the order in which it acts.
        noise_kind: one of `lab.specimen.KINDS`.
        seed: of the noise; with the name of a play it decides every reading.
        limits: what it can do.
        further: output columns that it measures besides the specimen's.
    """

    ground: Ground
    planted: tuple[Planted, ...]
    noise_kind: str
    seed: int
    limits: Limits
    further: tuple[str, ...] = ()
    _played: tuple[str, Table] | None = field(default=None, repr=False)

    @property
    def specimen(self) -> Specimen:
        """The robot as nature made it."""
        return self.ground.specimen

    @property
    def robot(self) -> RobotSpec:
        """The robot as specified."""
        return self.specimen.bench.robot

    @property
    def reference(self) -> str:
        """How a data set names it."""
        return self.specimen.bench.reference

    @property
    def gravity_mps2(self) -> Array:
        """In the base frame, shape (3,) [m/s^2]."""
        return self.specimen.gravity_mps2

    @cached_property
    def columns(self) -> tuple[str, ...]:
        """The output columns that it measures."""
        return tuple(dict.fromkeys((*self.specimen.columns, *self.further)))

    def reset(self) -> None:
        """Bring the robot to rest at zero input."""
        self._played = None

    def play(self, inputs: Table, name: str) -> None:
        """Play inputs from rest: see `Rig.play`."""
        self.limits.check(inputs)
        inputs.require_complete()
        self._played = (name, inputs)

    def read(self, columns: Sequence[str] | None = None) -> Table:
        """Return commands and readings of the last play: see `Rig.read`.

        Raises:
            InputError: nothing was played, no such column, or the robot finds no posture under the inputs.
        """
        if self._played is None:
            raise InputError("lab: nothing was played")
        name, inputs = self._played
        wanted = asked_columns(columns, self.columns)
        generator = np.random.default_rng((_KEY, self.seed, _number(name)))
        specimen = replace(self.specimen, columns=self.columns, noise=self._noise())
        course = self._course(name, inputs)
        try:
            clean = _outputs(specimen, self.ground, (*self.planted, *_loads(specimen, inputs)), course)
        except CannotMake as error:
            raise InputError(f"{inputs.where}: the robot finds no posture: {error}") from None
        noisy = measured(clean, specimen.noise, self.noise_kind, generator)
        found = {column: noisy[:, self.columns.index(column)] for column in wanted}
        return Table(course.time_s, {**inputs.columns, **found}, name)

    def waiting(self) -> str:
        """Return what it waits for: nothing."""
        return ""

    def answer(self) -> dict[str, Any]:
        """Return what is hidden, for whoever made the stand-in, with the specimen's errors."""
        specimen, found = self.specimen, []
        for item in self.planted:
            acting = item.acting(specimen, self.ground.scale)
            found.append(
                {
                    "cause": item.form.cause,
                    "form": item.form.name,
                    "law": item.form.law,
                    "known": item.form.known,
                    "also": list(item.form.also),
                    "size": float(item.size),
                    "numbers": dict(item.numbers),
                    "parameters": {key: float(v) for key, v in item.form.parameters(acting).items()},
                }
            )
        return {
            "robot": self.reference,
            "hidden": found,
            "calibration": dict(specimen.factors),
            "noise": dict(zip(self.columns, self._noise().tolist(), strict=True)),
            "noise_kind": self.noise_kind,
            "gravity_mps2": self.gravity_mps2.tolist(),
        }

    def _noise(self) -> Array:
        """Return the noise of each column, shape (o,); of one that the specimen has not, that of its unit."""
        known = dict(zip(self.specimen.columns, self.specimen.noise.tolist(), strict=True))
        by_unit = {name.rsplit("_", 1)[-1]: size for name, size in known.items()}
        typical = {"mm": 0.2, "deg": 0.3, "N": 0.02}  # assumed
        units = [name.rsplit("_", 1)[-1] for name in self.columns]
        return np.array(
            [
                known.get(name, by_unit.get(unit, typical.get(unit, 0.01)))
                for name, unit in zip(self.columns, units, strict=True)
            ]
        )

    def _course(self, name: str, inputs: Table) -> Course:
        commands = np.zeros((len(inputs.time_s), len(self.specimen.drives)))
        for index, drive in enumerate(self.specimen.drives):
            if drive.column in inputs.columns:
                commands[:, index] = inputs.columns[drive.column] * si_factor(drive.column)
        return Course(_number(name), "", inputs.time_s - inputs.time_s[0], commands)


def stand_in(
    robot: RobotSpec | str,
    hide: Sequence[str] = (),
    seed: int = 0,
    limits: Mapping[str, tuple[float, float]] | None = None,
    duration_s: float = 3600.0,
    noise_kind: str = "white",
    further: Sequence[str] = (),
    said: Said | None = None,
) -> SimulatedRig:
    """Return a stand-in of a robot with hidden causes.

    Args:
        robot: a robot, its id or its file; one that is none of a paper's needs `limits`.
        hide: causes to hide, each CAUSE, CAUSE.FORM or CAUSE.FORM=SIZE by the names of
            docs/truth/independent_bench.md, or "random". A size that is not given is drawn such that 5 to 30
            times the noise are left of it when a calibration has taken its part.
        seed: of the specimen, the sizes and the noise.
        limits: least and most of each input in the unit of its column; None: the robot's usual reach.
        duration_s: longest time of one play [s].
        noise_kind: one of `lab.specimen.KINDS`.
        further: output columns that are measured besides those drawn for the specimen.
        said: what errors call the arguments; None: as on the command line.

    Raises:
        InputError: unknown robot, cause, form, column or noise, or a cause that does nothing on this robot.
    """
    if noise_kind not in KINDS:
        raise unknown("noise", noise_kind, KINDS, "lab")
    said = said or Said()
    for text in hide:
        _check_name(text.partition("=")[0].strip(), said.hide)
    generator = np.random.default_rng((_KEY, seed))
    value, reference = named_robot(robot)
    if reference in BENCH_ROBOTS:
        specimen = drawn_specimen(generator, reference)
        given = dict(limits) if limits else drive_limits(specimen.bench.robot, specimen.bench.trials.reach)
        given = completed(specimen.bench.robot, given, said.limits)
    else:
        if not limits:
            raise InputError(
                f"lab: {reference}: {said.limits}: least and most of each input are needed, as no paper "
                "drove this robot"
            )
        given = completed(value, limits, said.limits)
        specimen = specimen_of(generator, _bench_of(reference, value, given))
    check_output_channels(specimen.bench.robot, further, said.columns)
    ground = Ground(specimen, drawn_courses(specimen, generator)[:_TRIALS])
    chosen = tuple(_hidden(ground, text, generator, said.hide) for text in hide)
    order = {form.key: place for place, form in enumerate((*FORMS, *BY_KEY.values()))}
    chosen = tuple(sorted(chosen, key=lambda item: order[item.form.key]))
    return SimulatedRig(ground, chosen, noise_kind, seed, Limits(given, duration_s), tuple(further))


def _hidden(ground: Ground, text: str, generator: np.random.Generator, said: str) -> Planted:
    """Return what a text names, with what it leaves open drawn."""
    name, equals, size_text = text.partition("=")
    for _ in range(_TRIES):
        form = _form_named(ground.specimen, name.strip(), generator, said)
        numbers = form.draw(ground.specimen, ground.scale, generator)
        if equals:
            return Planted(form, _size(text, size_text, said), numbers)
        found = sized(ground, form, generator)
        if found is not None:
            return found[0]
    raise InputError(f"{said} {text}: on this robot no size of it shows; give {name}=SIZE")


def sized(ground: Ground, form: LabForm, generator: np.random.Generator) -> Sized | None:
    """Return a form of a drawn size, and its change; None where no size leaves as much as is asked."""
    numbers = form.draw(ground.specimen, ground.scale, generator)
    low, high = np.log(SMALLEST * _INNER), np.log(LARGEST / _INNER)
    target = float(np.exp(generator.uniform(low, high)))
    sign = float(generator.choice([-1.0, 1.0])) if form.signed else 1.0
    return ground.sized(form, numbers, target, sign)


def _form_named(specimen: Specimen, name: str, generator: np.random.Generator, said: str) -> LabForm:
    if name == RANDOM:
        choices = [form for form in FORMS if form.known and form.applies(specimen)]
        causes = list(dict.fromkeys(form.cause for form in choices))
        cause = causes[int(generator.integers(len(causes)))]
        choices = [form for form in choices if form.cause == cause]
        return choices[int(generator.integers(len(choices)))]
    if name in BY_KEY:
        form = BY_KEY[name]
        if not form.applies(specimen):
            own = [item.key for item in FORMS if item.cause == form.cause and item.applies(specimen)]
            choices_text = f"; choices: {', '.join(own)}" if own else ""
            raise InputError(f"{said} {name}: makes no sense on {specimen.bench.reference}{choices_text}")
        return form
    choices = [form for form in FORMS if form.cause == name and form.known and form.applies(specimen)]
    if not choices:
        raise InputError(f"{said} {name}: makes no sense on {specimen.bench.reference}")
    return choices[int(generator.integers(len(choices)))]


def _check_name(name: str, said: str) -> None:
    """Raise `InputError` where nothing can be hidden by that name."""
    cause, dot, _ = name.partition(".")
    if name == RANDOM or name in BY_KEY or name in CAUSES:
        return
    if dot and cause in CAUSES:
        raise unknown("form", name, [form.key for form in FORMS if form.cause == cause], said)
    raise unknown("cause", name, [*CAUSES, RANDOM], said)


def _size(text: str, number: str, said: str) -> float:
    try:
        value = float(number)
    except ValueError:
        value = float("nan")
    if not np.isfinite(value):
        raise InputError(f"{said} {text}: a finite size is needed after =")
    return value


def _outputs(specimen: Specimen, ground: Ground, planted: Sequence[Planted], course: Course) -> Array:
    """Return the outputs of a course without noise, shape (r, o), in file units."""
    scale = ground.scale
    inside = [item for item in planted if not item.form.looks_only]
    tethered = any(item.form.tether is not None for item in inside)
    plain = simulated(specimen, scale, (), course) if tethered else None
    shapes = simulated(specimen, scale, inside, course, without=plain)
    return columns_of(specimen, looked_at(specimen, scale, planted, course, shapes))


def _loads(specimen: Specimen, inputs: Table) -> tuple[Planted, ...]:
    """Return a known force on the tip that is played, as something that acts on the last element."""
    if not any(name in inputs.columns and inputs.columns[name].any() for name in FORCES):
        return ()
    none = np.zeros(len(inputs.time_s))
    force = np.stack([inputs.columns.get(name, none) for name in FORCES], axis=1)

    def on_tip(acting: Acting, course: Course) -> tuple[int, Array]:
        return specimen.elements, force

    return (Planted(LabForm("known force", "tip", "as played", body_force=on_tip), 1.0, {}),)


def _bench_of(reference: str, robot: RobotSpec, limits: Mapping[str, tuple[float, float]]) -> BenchRobot:
    drives = drives_of(robot)
    reach = tuple(limits.get(drive.column, (0.0, 0.0))[1] * si_factor(drive.column) for drive in drives)
    own_joints = all(drive.side == (0.0, 0.0) for drive in drives)
    drive = "joints" if own_joints else _DRIVES.get(drives[0].quantity, "pull")
    return BenchRobot(reference, robot, Trials(drive, reach))


def _number(name: str) -> int:
    """Return a whole number for a name, the same on every machine."""
    return zlib.crc32(name.encode("utf-8"))
