"""A foreign model with what was found, as the text of its own file: what it can carry, and what it cannot.

Damping, friction, stiffness and masses are the file's own; gains and offsets go into actuators whose force is
linear in the control. Delays, play, the tracker's frame and muscles' controls stay outside, and so does a
number of an element that does not stand in the text but is made from it (`replicate`, `attach`).
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.foreign.model import (
    DAMPING,
    FRICTION,
    GAIN,
    OFFSET,
    PAYLOAD,
    STIFFNESS,
    ForeignModel,
    Number,
    Values,
    masses_of,
)
from catheter_sim.mjcf.document import ALL_DIGITS, Element, read

_LABEL = "found"  # of the body that carries a payload
_POINT_LIKE = (1e-12, 1e-12, 1e-12)  # inertia [kg m^2]
_SHORTCUTS = ("kp", "kv", "dampratio", "timeconst", "inheritrange", "area", "diameter", "bias", "gain")


def extended_text(model: ForeignModel, values: Values) -> tuple[str, tuple[str, ...]]:
    """Return the file's text with numbers in it, and the names of those that it cannot carry.

    What the file includes stands in the text, and its meshes and pictures are found from anywhere. No digit
    of a number is lost.
    """
    folder = model.path.resolve().parent
    root = _whole(model.path.resolve(), folder)
    _last(root, "compiler").set(
        assetdir=None,
        meshdir=str(folder / model.spec.meshdir),
        texturedir=str(folder / model.spec.texturedir),
    )
    for other in root.every("model"):  # of which `attach` takes parts
        other.set(file=str(folder / other.get("file")))
    if model.gravity_mps2 is not None:
        _last(root, "option").set(gravity=model.gravity_mps2)
    elements = _Elements(root, model.compiled)
    carried = {
        *_masses(elements, values),
        *_springs_and_joints(elements, values),
        *_actuators(elements, values),
    }
    return root.text(ALL_DIGITS), tuple(number.name for number in values if number not in carried)


def _whole(path: Path, folder: Path) -> Element:
    """Return a file's model with what it includes, which lies beside it or in the main file's `folder`."""
    root = read(path.read_text(encoding="utf-8"))
    for item in list(root.every("include")):
        beside = path.parent / item.get("file")
        children = _whole(beside if beside.is_file() else folder / item.get("file"), folder).children
        above, place = item.parent, item.parent.children.index(item)
        above.children[place : place + 1] = children
        for child in children:
            child.parent = above
    return root


def _last(root: Element, tag: str) -> Element:
    """Return the section that MuJoCo reads last of all with a tag; a new one where there is none."""
    return next((item for item in reversed(root.children) if item.tag == tag), None) or root.add(tag)


class _Elements:
    """The elements of a text by their numbers in the compiled model."""

    def __init__(self, root: Element, compiled: mujoco.MjModel) -> None:
        self.compiled = compiled
        sections = {tag: [item for item in root.children if item.tag == tag] for tag in _SECTIONS}
        bodies = [body for world in sections["worldbody"] for body in world.every("body")]
        self._all = {
            "body": (compiled.nbody, [root, *bodies]),
            "joint": (compiled.njnt, [joint for body in bodies for joint in _joints_of(body)]),
            "tendon": (compiled.ntendon, [item for part in sections["tendon"] for item in part.children]),
            "actuator": (compiled.nu, [item for part in sections["actuator"] for item in part.children]),
        }

    def find(self, kind: str, number: int) -> Element | None:
        """Return an element; None where it does not stand in the text, or cannot be told from others."""
        count, elements = self._all[kind]
        name = getattr(self.compiled, kind)(number).name
        if name:
            return next((item for item in elements if item.get("name") == name), None)
        return elements[number] if len(elements) == count else None


_SECTIONS = ("worldbody", "tendon", "actuator")


def _joints_of(body: Element) -> Iterator[Element]:
    """Yield a body's own joints, also those in frames."""
    for child in body.children:
        if child.tag in ("joint", "freejoint"):
            yield child
        elif child.tag == "frame":
            yield from _joints_of(child)


def _masses(elements: _Elements, values: Values) -> Iterator[Number]:
    """Weld point-like masses to bodies; yield the numbers that are there."""
    for body, mass_kg, place_m in masses_of(values):
        element = elements.find("body", body)
        if element is not None:
            hung = element.add(
                "body", name=f"{_LABEL}_{body}", pos=elements.compiled.body_ipos[body] + place_m
            )
            hung.add("inertial", pos=(0.0, 0.0, 0.0), mass=mass_kg, diaginertia=_POINT_LIKE)
            yield from (number for number in values if number.cause == PAYLOAD and number.of == (body,))


def _springs_and_joints(elements: _Elements, values: Values) -> Iterator[Number]:
    """Put damping and friction into joints, stiffness into all springs; yield the numbers that are there."""
    compiled = elements.compiled
    springs = {"joint": compiled.jnt_stiffness, "tendon": compiled.tendon_stiffness}
    for number, value in values.items():
        if number.cause in (DAMPING, FRICTION):
            joint = elements.find("joint", number.of[0])
            dof = int(compiled.jnt_dofadr[number.of[0]])
            if joint is None:
                continue
            if number.cause == DAMPING:
                _own_spring(joint, compiled, number.of[0]).set(damping=_first(joint, "damping", 1.0, value))
            else:
                joint.set(frictionloss=float(compiled.dof_frictionloss[dof]) + value)
            yield number
        elif number.cause == STIFFNESS and not number.of:
            sprung = {
                (kind, k): elements.find(kind, k)
                for kind, stiffness in springs.items()
                for k in np.flatnonzero(stiffness).tolist()
            }
            there = {place: element for place, element in sprung.items() if element is not None}
            if len(there) < len(sprung):
                continue
            for (kind, k), element in there.items():
                if kind == "joint":
                    _own_spring(element, compiled, k)
                else:
                    element.set(stiffness=_polynomial(compiled, "tendon_stiffness", k))
                element.set(stiffness=_first(element, "stiffness", value))
            yield number


def _own_spring(joint: Element, compiled: mujoco.MjModel, number: int) -> Element:
    """Let a joint's spring and damper stand in itself, whatever its class or its `springdamper` says."""
    if joint.get("springdamper") != (0.0, 0.0):
        damping = _polynomial(compiled, "dof_damping", int(compiled.jnt_dofadr[number]))
        stiffness = _polynomial(compiled, "jnt_stiffness", number)
        joint.set(stiffness=stiffness, damping=damping, springdamper=(0.0, 0.0))
    return joint


def _polynomial(compiled: mujoco.MjModel, field: str, number: int) -> Array:
    """Return a force's coefficients: the linear one, and those of a higher order where there are any."""
    more = getattr(compiled, f"{field}poly", None)
    linear = getattr(compiled, field)[number]
    return np.array([linear] if more is None or not more[number].any() else [linear, *more[number]])


def _first(element: Element, name: str, factor: float, more: float = 0.0) -> list[float]:
    """Return an attribute's numbers, the first one scaled and more."""
    first, *others = element.numbers(name)
    return [factor * first + more, *others]


def _actuators(elements: _Elements, values: Values) -> Iterator[Number]:
    """Put gains, offsets and stiffness into actuators; yield the numbers that are there.

    The force s (G (g u + o) + b) of a control u, with the file's own gain G and bias b, has the gain s g G
    and the bias s (b + G o). A servo's velocity gain, the bias's third number, is not scaled by s.
    """
    compiled = elements.compiled
    there, missing = set[Number](), set[Number]()
    for k in range(compiled.nu):
        driving = [
            number for number in values if number.cause in (GAIN, OFFSET, STIFFNESS) and k in number.of
        ]
        own = {number: values[number] for number in driving}
        if not own:
            continue
        element = elements.find("actuator", k)
        fixed = int(compiled.actuator_gaintype[k]) == int(mujoco.mjtGain.mjGAIN_FIXED)
        linear = fixed and int(compiled.actuator_dyntype[k]) == int(mujoco.mjtDyn.mjDYN_NONE)
        fit = {
            number: value
            for number, value in own.items()
            if element is not None and (linear or number.cause == STIFFNESS)
        }
        there |= set(fit)
        missing |= set(own) - set(fit)
        if element is not None and fit:
            _retune(element, compiled, k, fit)
    yield from there - missing


def _retune(element: Element, compiled: mujoco.MjModel, k: int, values: Values) -> None:
    """Let an actuator be a general one with other gains, in which no class or shortcut has a say."""
    gain, bias = compiled.actuator_gainprm[k].copy(), compiled.actuator_biasprm[k].copy()
    kind = mujoco.mjtBias(int(compiled.actuator_biastype[k]))
    offset = sum(value for number, value in values.items() if number.cause == OFFSET)
    if offset:
        bias = np.zeros_like(bias) if kind == mujoco.mjtBias.mjBIAS_NONE else bias
        kind = mujoco.mjtBias.mjBIAS_AFFINE
        bias[0] += gain[0] * offset
    for number, value in values.items():
        if number.cause in (GAIN, STIFFNESS):
            gain[0] *= value
        if number.cause == STIFFNESS:
            bias[:2] *= value
    element.tag = "general"
    element.set(**dict.fromkeys(_SHORTCUTS))
    element.set(
        dyntype=_word(mujoco.mjtDyn(int(compiled.actuator_dyntype[k]))),
        gaintype=_word(mujoco.mjtGain(int(compiled.actuator_gaintype[k]))),
        biastype=_word(kind),
        dynprm=compiled.actuator_dynprm[k],
        gainprm=gain,
        biasprm=bias,
    )
    for name in ("ctrl", "act"):
        limited = bool(getattr(compiled, f"actuator_{name}limited")[k])
        ends = getattr(compiled, f"actuator_{name}range")[k]
        element.set(**{f"{name}limited": limited, f"{name}range": ends if ends.any() else None})


def _word(kind: mujoco.mjtDyn | mujoco.mjtGain | mujoco.mjtBias) -> str:
    """Return how a file calls one of MuJoCo's kinds: "filterexact" for mjDYN_FILTEREXACT."""
    return str(kind.name).split("_", 1)[1].lower()
