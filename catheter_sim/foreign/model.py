"""Somebody's MJCF as it stands: which columns drive it, which it reports, and the model that is simulated.

Inputs are its actuators' controls, `control_<actuator>`, in the file's own units (radians of a servo, newtons
of a motor). Outputs are joints (`joint_<name>_deg` or `_mm`), places of sites and bodies
(`site_<name>_x_mm`, `body_<name>_x_mm`) and scalar sensors of the file (`sensor_<name>`, in SI units).
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.errors import InputError, cut, unknown

CONTROL = "control_"
OWN_UNIT = "own"  # what columns of the file's sensors are in
_PLACE = re.compile(r"(site|body)_(.+)_([xyz])_mm")
_PREFIX = "measured "  # of the sensors that are added


@dataclass(frozen=True)
class Column:
    """One output column.

    Attributes:
        name: in files.
        sensor: name of the sensor that gives it, in the model that is simulated.
        index: which of the sensor's numbers.
        factor: from the sensor's SI number to the column's unit.
        unit: "mm", "deg" or `OWN_UNIT`.
        point: name of the site or body whose place it belongs to; "": it is no place.
    """

    name: str
    sensor: str
    index: int
    factor: float
    unit: str
    point: str = ""


@dataclass(frozen=True)
class ForeignModel:
    """A model from a file.

    Attributes:
        path: of the file.
        gravity_mps2: in the world frame, shape (3,); None: the file's own.
        columns: the outputs that are wanted.
        timestep_s: of the simulation; None: the file's own.
    """

    path: Path
    gravity_mps2: tuple[float, float, float] | None = None
    columns: tuple[Column, ...] = ()
    timestep_s: float | None = None
    spec: mujoco.MjSpec = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Read the file.

        Raises:
            InputError: it is no MJCF that MuJoCo compiles, or nothing drives it.
        """
        object.__setattr__(self, "spec", _read(self.path))
        if not self.compiled.nu:
            raise InputError(f"{self.path}: the model has no actuator, so that no input can drive it")

    @cached_property
    def compiled(self) -> mujoco.MjModel:
        """The model as the file has it."""
        try:
            return self.spec.copy().compile()
        except ValueError as error:
            raise _refused(self.path, error) from None

    @cached_property
    def simulated(self) -> mujoco.MjModel:
        """The model with a sensor for each wanted output, under the gravity that was asked for."""
        spec = self.spec.copy()
        for sensor in dict.fromkeys(column.sensor for column in self.columns):
            if sensor.startswith(_PREFIX):
                what, name = sensor.removeprefix(_PREFIX).split(" ", 1)
                kind, of = {
                    "joint": (mujoco.mjtSensor.mjSENS_JOINTPOS, mujoco.mjtObj.mjOBJ_JOINT),
                    "site": (mujoco.mjtSensor.mjSENS_FRAMEPOS, mujoco.mjtObj.mjOBJ_SITE),
                    "body": (mujoco.mjtSensor.mjSENS_FRAMEPOS, mujoco.mjtObj.mjOBJ_XBODY),
                }[what]
                spec.add_sensor(name=sensor, type=kind, objtype=of, objname=name)
        if self.timestep_s is not None:
            spec.option.timestep = self.timestep_s
        if self.gravity_mps2 is not None:
            spec.option.gravity = self.gravity_mps2
        model = spec.compile()
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET  # what diverges is to be seen
        return model

    @cached_property
    def actuators(self) -> tuple[str, ...]:
        """The actuators' names; one without a name is called by its number, from 1."""
        return tuple(self.compiled.actuator(k).name or str(k + 1) for k in range(self.compiled.nu))

    @property
    def resting_controls(self) -> Array:
        """The controls of the first keyframe, where the model begins, or zeros, shape (nu,)."""
        compiled = self.compiled
        return np.array(compiled.key_ctrl[0] if compiled.nkey else np.zeros(compiled.nu))

    @property
    def input_columns(self) -> tuple[str, ...]:
        """The names of the input columns, in the order of the controls."""
        return tuple(CONTROL + name for name in self.actuators)

    def unit_of(self, channel: str) -> str:
        """Return the unit of an input or output, for maps: "rad", "m", "deg" or "mm"; "1": the file's own.

        A servo's control is in rad or m, by the joint that it holds; other controls have no unit here.
        """
        if channel not in self.input_columns:
            return "1" if channel.startswith("sensor_") else channel.rsplit("_", 1)[-1]
        model, index = self.compiled, self.input_columns.index(channel)
        servo = bool(model.actuator_biasprm[index, 1]) and not model.actuator_dyntype[index]
        if not servo or int(model.actuator_trntype[index]) not in _OF_JOINTS:
            return "1"
        return _SI_UNITS.get(int(model.jnt_type[model.actuator_trnid[index, 0]]), "1")

    @cached_property
    def output_columns(self) -> tuple[str, ...]:
        """The names of all outputs that the model can give."""
        model, names = self.compiled, []
        for k in range(model.njnt):
            unit = _JOINT_UNITS.get(int(model.jnt_type[k]))
            if unit and model.joint(k).name:
                names.append(f"joint_{model.joint(k).name}_{unit}")
        points = [("site", model.site(k).name) for k in range(model.nsite)]
        points += [("body", model.body(k).name) for k in range(1, model.nbody)]
        names += [f"{what}_{name}_{axis}_mm" for what, name in points if name for axis in "xyz"]
        for k in range(model.nsensor):
            if int(model.sensor_dim[k]) == 1 and model.sensor(k).name:
                names.append(f"sensor_{model.sensor(k).name}")
        return tuple(names)

    def measured(self, names: Sequence[str], where: str) -> ForeignModel:
        """Return the model with these outputs wanted.

        Raises:
            InputError: the model has no such output; `where` says who asked.
        """
        return replace(self, columns=tuple(self._column(name, where) for name in names))

    def _column(self, name: str, where: str) -> Column:
        if name not in self.output_columns:
            raise unknown("output column", name, self.output_columns, where)
        place = _PLACE.fullmatch(name)
        if place:
            sensor = f"{_PREFIX}{place[1]} {place[2]}"
            return Column(name, sensor, "xyz".index(place[3]), 1e3, "mm", f"{place[1]} {place[2]}")
        if name.startswith("joint_"):
            joint, unit = name.removeprefix("joint_").rsplit("_", 1)
            return Column(name, f"{_PREFIX}joint {joint}", 0, _FACTORS[unit], unit)
        return Column(name, name.removeprefix("sensor_"), 0, 1.0, OWN_UNIT)

    @cached_property
    def sensor_places(self) -> np.ndarray:
        """Where each wanted column stands in the sensors' data of `simulated`, shape (o,)."""
        places = [int(self.simulated.sensor(item.sensor).adr[0]) + item.index for item in self.columns]
        return np.array(places, dtype=int)

    @property
    def factors(self) -> Array:
        """From the sensors' numbers to the columns' units, shape (o,)."""
        return np.array([item.factor for item in self.columns])


_FACTORS = {"deg": 180.0 / math.pi, "mm": 1e3}
_JOINT_UNITS = {
    int(mujoco.mjtJoint.mjJNT_HINGE): "deg",
    int(mujoco.mjtJoint.mjJNT_SLIDE): "mm",
}
_SI_UNITS = {int(mujoco.mjtJoint.mjJNT_HINGE): "rad", int(mujoco.mjtJoint.mjJNT_SLIDE): "m"}
_OF_JOINTS = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))


def _read(path: Path) -> mujoco.MjSpec:
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    try:
        return mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise _refused(path, error) from None


def _refused(path: Path, error: ValueError) -> InputError:
    return InputError(f"{path}: MuJoCo does not take it: {cut(' '.join(str(error).split()), 200)}")
