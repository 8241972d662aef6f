"""The transseptal catheter held at 90 deg in a pulsatile flow (Nayar 2022, Section IV-F).

The tip is pushed aside, its bending tendons held: deflection over tension, printed 1.814 mm/N. Then a flow
of 70 strokes a minute: the deflection is sensed from the tension through that calibration, and compensated
by pulling the tendon by the stretch that the tension tells, `SHARE` of it. What is left by statics:
`compensated_share`.

`@tube` has tendons as stiff as 1.814 mm/N asks for: of 0.12 mm and 0.61 m they would have 450 GPa, four
times the stiffest polyethylene fibre's. `@material` has the stiffest that a tendon of that section can be.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.robot import Friction
from catheter_sim.robots.catheter.description import joint_stiffness, ring_length_m
from catheter_sim.robots.catheter.kinematics import arm_m, pulled_m
from catheter_sim.robots.catheter.published import (
    DEFLECTION_M_PER_N,
    MK_SLOPE_M_PER_RAD,
    TUBE_TENDON_STIFFNESS_N_PER_M,
    joint_slope_m_per_rad,
    mitral_transseptal_material,
    mitral_transseptal_tube,
    tendon_modulus_Pa,
)
from catheter_sim.robots.catheter.spec import CatheterRobot
from catheter_sim.simulation.simulator import Simulator
from catheter_sim.validation.lines import ASSUMED, FITTED, PREDICTED, READ_BACK, REFUTED, Line, Validation

NAME = "mitral_transseptal"
HELD_DEG = 90.0
STROKES_PER_S, FLOW_DEFLECTION_M = 70.0 / 60.0, 0.13e-3  # Section IV-F
SMALL_N = 0.02
SHARE = 0.8  # of the tendon's stretch that is pulled back; chosen: 1 would have no margin
SENSOR_S = 0.02  # of the tension's low-pass; assumed
BEATS = 3  # the last is looked at
_SECTION = "Nayar 2022, Section IV-F"


@dataclass(frozen=True)
class Held:
    """The robot held at 90 deg and pushed aside.

    Attributes:
        slope_m_per_N: deflection along the push over the tension's change.
        tip_m, tension_N: amplitudes in the flow, tendons held.
        compensated_m: the tip's amplitude with the tension fed back.
        sensed_rmse_m: of the deflection told from the tension, tendons held, over a beat.
    """

    slope_m_per_N: float
    tip_m: float
    tension_N: float
    compensated_m: float
    sensed_rmse_m: float


def validate_flow(folder: Path) -> Validation:
    """Show the deflection in flow beside print, and check what compensation leaves; nothing is written."""
    tube = mitral_transseptal_tube()
    free = held(replace(tube, friction=Friction(0.0)))
    rubbed, material = held(tube), held(mitral_transseptal_material())
    lines = held_lines("no friction", free, FITTED)
    lines += held_lines(f"friction {tube.friction.mu:g}", rubbed, REFUTED)
    lines += [*compensation_lines(tube, free, rubbed), *material_lines(material)]
    return Validation(tuple(lines), (_finding(material),))


def held(robot: CatheterRobot) -> Held:
    """Hold the bending joint at 90 deg, push the tip against the bend, and let it pulse."""
    simulator = Simulator(robot, inertia=False)
    displacement = np.array([_displacement_at_m(robot, math.radians(HELD_DEG)), 0.0, 0.0, 0.0])
    _ramp(simulator, displacement)
    simulator.settle()
    push = -simulator.posture().R_w[-1][:, 0]  # against the bend, across the tip
    seen = []
    for force in (SMALL_N, 2.0 * SMALL_N):
        simulator.set_inputs(displacement, force * push)
        simulator.settle()
        seen.append(simulator.posture())
    way = float((seen[1].p_w[-1] - seen[0].p_w[-1]) @ push)
    slope = way / float(seen[1].actuator_tension[0] - seen[0].actuator_tension[0])
    amplitude_N = FLOW_DEFLECTION_M / (way / SMALL_N)  # of the force
    tip, tension = _pulse(simulator, displacement, push, amplitude_N, 0.0)
    compensated, _ = _pulse(simulator, displacement, push, amplitude_N, SHARE)
    told = slope * (tension - tension.mean()) - (tip - tip.mean())
    return Held(
        slope,
        0.5 * float(np.ptp(tip)),
        0.5 * float(np.ptp(tension)),
        0.5 * float(np.ptp(compensated)),
        float(np.sqrt((told**2).mean())),
    )


def compensated_share(robot: CatheterRobot, share: float) -> float:
    """Return what compensation leaves of the tip's deflection at 90 deg, by statics without friction.

    Gaps of stiffness g each, with the tendons' k a^2 on the sum of their angles: a force on the tip turns
    them by its levers L, so that the deflection is L.L / g - c (sum L)^2 / (g (g + n c)), c = k a^2. Pulling
    the tendon by a share of its stretch makes it as stiff as c / (1 - share).
    """
    segment, angle = robot.segments[1], math.radians(HELD_DEG)
    lever = levers_m(robot, angle)
    gaps = len(lever)
    stiffness = joint_stiffness(robot, segment) * gaps
    held_Nm = robot.tendons[0].stiffness_N_per_m * float(arm_m(segment, angle)) ** 2

    def deflection(tendon: float) -> float:
        shared = tendon * lever.sum() ** 2 / (stiffness + gaps * tendon)
        return float((lever @ lever - shared) / stiffness)

    return deflection(held_Nm / (1.0 - share)) / deflection(held_Nm)


def levers_m(robot: CatheterRobot, bend_rad: float) -> Array:
    """Return the levers about every gap of a force across the tip, evenly bent, shape (n + 1,) [m]."""
    segment = robot.segments[1]
    gaps = segment.rings + 1
    between = ring_length_m(segment) + 2.0 * segment.half_gap_m
    reach = [between] * segment.rings + [
        segment.half_gap_m + sum(item.length_m for item in robot.segments[2:])
    ]
    # from the tip back: how far the tip lies ahead of each gap along its own axis, which is across the push
    turn = np.cumsum(np.full(gaps, bend_rad / gaps))[::-1] - bend_rad
    ahead = np.cumsum(np.array(reach)[::-1] * np.cos(turn))
    return ahead[::-1]


def held_lines(case: str, found: Held, kind: str) -> list[Line]:
    """Return the lines of deflection over tension and of the amplitudes in flow."""
    start = f"with the tube, held at {HELD_DEG:g} deg, {case}: "
    rows = (
        (
            "tip deflection along the push over tension",
            "mm/N",
            f"{_SECTION}: one of two figures that the robot without friction is from",
            found.slope_m_per_N * 1e3,
            DEFLECTION_M_PER_N * 1e3,
            kind,
        ),
        (
            "flow of 70 strokes a minute, amplitude of the tip",
            "mm",
            f"{_SECTION}; force by statics",
            found.tip_m * 1e3,
            FLOW_DEFLECTION_M * 1e3,
            READ_BACK if kind == FITTED else kind,
        ),
        (
            "the same, amplitude of the tension",
            "N",
            f"{_SECTION}: 0.13 mm over 1.814 mm/N",
            found.tension_N,
            FLOW_DEFLECTION_M / DEFLECTION_M_PER_N,
            kind,
        ),
    )
    return [
        Line(NAME, start + what, unit, abs(ours - aim), None, source, ours, None, aim, worth)
        for what, unit, source, ours, aim, worth in rows
    ]


def compensation_lines(robot: CatheterRobot, free: Held, rubbed: Held) -> list[Line]:
    """Return what sensing and compensation by the tension come to; judged against statics without
    friction."""
    wanted = compensated_share(robot, SHARE)
    lines = []
    for case, found in (("no friction", free), (f"friction {robot.friction.mu:g}", rubbed)):
        start = f"with the tube, held at {HELD_DEG:g} deg, {case}: "
        left = found.compensated_m / found.tip_m
        what = (
            f"{start}flow sensed from the tension and {SHARE:g} of the stretch pulled back: deflection that "
            "is left"
        )
        judged = case == "no friction"
        lines.append(
            Line(
                NAME,
                what,
                "-",
                abs(left - wanted),
                0.1 * wanted if judged else None,
                f"statics of joint and tendon; {_SECTION} proposes it without figures",
                left,
                wanted if judged else None,
                kind=PREDICTED if judged else ASSUMED,
            )
        )
        what = f"{start}deflection told from the tension in flow, RMSE over its amplitude"
        share = found.sensed_rmse_m / found.tip_m
        source = f"{_SECTION}: the calibration is of the same robot, slowly pushed"
        lines.append(Line(NAME, what, "-", share, None, source, share, kind=ASSUMED))
    return lines


def material_lines(found: Held) -> list[Line]:
    """Return what tendons and tube as stiff as their materials give: of the two printed figures one is
    met."""
    slope, printed = joint_slope_m_per_rad() * 1e3, MK_SLOPE_M_PER_RAD * 1e3
    ours, aim = found.slope_m_per_N * 1e3, DEFLECTION_M_PER_N * 1e3
    return [
        Line(
            NAME,
            "@material, bending beyond l*: displacement per bend",
            "mm/rad",
            abs(slope - printed),
            None,
            "Nayar 2022, Eq. 25, second line; moduli of tube and tendons assumed, nothing fitted",
            slope,
            None,
            printed,
            ASSUMED,
        ),
        Line(
            NAME,
            f"@material, held at {HELD_DEG:g} deg, friction on: tip deflection along the push over tension",
            "mm/N",
            abs(ours - aim),
            None,
            f"{_SECTION}; a tendon that gives 1.814 mm/N at the tip would have "
            f"{tendon_modulus_Pa(TUBE_TENDON_STIFFNESS_N_PER_M) * 1e-9:.0f} GPa: so read, no tendon can",
            ours,
            None,
            aim,
            REFUTED,
        ),
    ]


def _pulse(
    simulator: Simulator, displacement: Array, push: Array, amplitude_N: float, share: float
) -> tuple[Array, Array]:
    """Return the tip's way [m] and the bending pair's tension [N] through the last beat, shape (r,) each."""
    stiffness = simulator.robot.tendons[0].stiffness_N_per_m
    step = float(simulator.model.opt.timestep)
    beat = round(1.0 / STROKES_PER_S / step)
    rest = 2.0 * amplitude_N  # a flow that pushes one way
    simulator.set_inputs(displacement, rest * push)
    simulator.settle()
    mean_N = told_N = float(simulator.posture().actuator_tension[0])
    given, tips, tensions = displacement.copy(), [], []
    for tick in range(BEATS * beat):
        force = rest + amplitude_N * math.sin(2.0 * math.pi * tick / beat)
        given[0] = displacement[0] + share * (told_N - mean_N) / stiffness
        simulator.set_inputs(given, force * push)
        simulator.step()
        posture = simulator.posture()
        tension = float(posture.actuator_tension[0])
        told_N += (tension - told_N) * step / SENSOR_S
        if tick >= (BEATS - 1) * beat:
            tips.append(float(posture.p_w[-1] @ push))
            tensions.append(tension)
    return np.array(tips), np.array(tensions)


def _displacement_at_m(robot: CatheterRobot, angle: float) -> float:
    """Return the displacement that bends the loaded joint so far, friction aside [m]."""
    pair, segment = robot.tendons[0], robot.segments[1]
    stretch = joint_stiffness(robot, segment) * angle / (segment.arm_m * pair.stiffness_N_per_m)
    return pair.slack_m + float(pulled_m(segment, angle)) + stretch


def _ramp(simulator: Simulator, displacement: Array) -> None:
    for share in np.linspace(0.0, 1.0, 400):
        simulator.set_inputs(displacement * share)
        simulator.step()


def _finding(found: Held) -> str:
    ours, printed = joint_slope_m_per_rad() * 1e3, MK_SLOPE_M_PER_RAD * 1e3
    return (
        f"{NAME}: tube and tendons as stiff as their materials give Eq. 25's slope ({ours:.2f} against "
        f"{printed:.2f} mm/rad), and {found.slope_m_per_N * 1e3:.1f} mm/N where 1.814 is printed. With the "
        "tendon "
        "held that figure is a lever over the arm and the tendon's stiffness, the joint's hardly matters, "
        "and "
        "friction before the sensor makes it larger. So 1.814 is not the tip's, or the tendon was not held."
    )
