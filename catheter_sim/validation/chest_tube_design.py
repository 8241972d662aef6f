"""The chest tube's design claims: a profile that is asymmetric, rods in place of tendons.

chest_tube_2025 (doi 10.1109/LRA.2025.3597860), Section III-A and Fig. 4. Three profiles with the same rod
holes: symmetric arms of 2 mm, Table II's with the larger arm on alternate sides (Fig. 4b), and with it on
one side at every joint (Fig. 4a). And rods whose stiffness is that of rods or a hundredth of it, as of
tendons, with both sides pulled: there the alternate joints bend against one another (Fig. 4c).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.core.posture import Posture
from catheter_sim.robots.rolling import complete as rods
from catheter_sim.robots.rolling.complete import complete
from catheter_sim.robots.rolling.description import rolling_chain
from catheter_sim.robots.rolling.published import SYMMETRIC_ARM_M, SYMMETRIC_RADIUS_M, chest_tube_section
from catheter_sim.robots.rolling.spec import RollingRobot
from catheter_sim.simulation.replay import simulate
from catheter_sim.validation import paper_plots
from catheter_sim.validation.drives import NO_GRAVITY, given, largest_distance, tips_mm
from catheter_sim.validation.lines import READ_BACK, REFUTED, Line, Validation

SECTION = "chest_tube_section"
TENSIONS_N = np.arange(0.0, 50.1, 2.5)
SIMULATED_N = (5.0, 20.0, 50.0)
HELD_N = 2.0  # assumed: of the other rod, where both are pulled
PULLED_N = np.arange(HELD_N, 30.1, 0.5)
STIFFNESS = (1.0, 0.3, 0.1, 0.01)  # of the rods; a hundredth: tendons
RAMP_S = 6.0  # in the simulation between rows: soft rods follow slowly, and friction remembers what lags
SYMMETRIC, ALTERNATING, ONE_SIDED = "symmetric", "alternating", "one-sided"
_SOURCE = "complete statics"


@dataclass(frozen=True)
class Profile:
    """One profile's answers.

    Attributes:
        levers_mm: of the pulled rod about the joints of the straight section, odd and even, (2,) [mm].
        toward_deg, away_deg: the section's bend at `TENSIONS_N`, pulled on the side of the first joint's
        larger
            arm, and on the other, shape (r,) each [deg].
    """

    levers_mm: Array
    toward_deg: Array
    away_deg: Array


def profiles() -> Mapping[str, RollingRobot]:
    """Return the section with each profile, its holes where they are."""
    nominal = chest_tube_section()
    segment = nominal.segments[0]
    even = replace(
        segment,
        larger_arm_m=SYMMETRIC_ARM_M,
        smaller_arm_m=SYMMETRIC_ARM_M,
        larger_radius_m=SYMMETRIC_RADIUS_M,
        smaller_radius_m=SYMMETRIC_RADIUS_M,
    )
    return {
        SYMMETRIC: replace(nominal, segments=(even,)),
        ALTERNATING: nominal,
        ONE_SIDED: replace(nominal, segments=(replace(segment, larger_arm_side="positive"),)),
    }


def pulled_on_the_other_side(robot: RollingRobot) -> RollingRobot:
    """Return the section with its passive rod pulled, and the other passive."""
    return replace(
        robot,
        tendons=tuple(replace(rod, side="-x") for rod in robot.tendons),
        passive_rods=tuple(replace(rod, side="+x") for rod in robot.passive_rods),
    )


def both_pulled(stiffness: float) -> RollingRobot:
    """Return the section with both rods pulled, their stiffness scaled."""
    robot = chest_tube_section()
    return replace(
        robot, tendons=(*robot.tendons, *robot.passive_rods), passive_rods=(), stiffness_scale=stiffness
    )


def profile(robot: RollingRobot) -> Profile:
    """Return what a profile does, by the complete statics."""
    chain = rolling_chain(robot)
    slope = rods.spans(chain, np.zeros((1, chain.joints))).slope[0, 0]
    bends = [
        np.degrees(_angles(complete(item, given(TENSIONS_N[:, None]), NO_GRAVITY).postures).sum(axis=1))
        for item in (robot, pulled_on_the_other_side(robot))
    ]
    return Profile(-1e3 * slope[:2], bends[0], -bends[1])


def zigzag_deg(stiffness: float) -> Array:
    """Return the median bend of the even joints at `PULLED_N` against `HELD_N`, shape (r,) [deg]."""
    rows = np.stack([PULLED_N, np.full(len(PULLED_N), HELD_N)], axis=1)
    found = complete(both_pulled(stiffness), given(rows), NO_GRAVITY).postures
    return np.asarray(np.degrees(np.median(_angles(found)[:, 1::2], axis=1)))


def validate_design(folder: Path) -> Validation:
    """Check the profiles and the rods against tendons; the picture goes into `folder`."""
    found = {name: profile(robot) for name, robot in profiles().items()}
    back = {stiffness: zigzag_deg(stiffness) for stiffness in STIFFNESS}
    paper_plots.design(TENSIONS_N, found, PULLED_N, back, folder / f"{SECTION}_design.png")
    lines = [*_lever_lines(found), *_bend_lines(found), *_zigzag_lines(back)]
    return Validation(tuple(lines), (_profile_finding(found), _rods_finding(back)))


def _lever_lines(found: Mapping[str, Profile]) -> list[Line]:
    """Compare the pulled rod's lever with the symmetric design's: "doubles and halves"."""
    ratio = found[ALTERNATING].levers_mm / found[SYMMETRIC].levers_mm
    source = (
        "chest_tube_2025, Section III-A: \"{}\"; Table II's arms are {} mm, where the symmetric one's are 2"
    )
    rows = (("larger", 0, 2.0, "doubles", "3", REFUTED), ("smaller", 1, 0.5, "halves", "1", READ_BACK))
    return [
        Line(
            SECTION,
            f"lever of the pulled rod on the {name} arm's side over the symmetric design's",
            "-",
            abs(float(ratio[place]) - printed),
            None,
            source.format(word, arm),
            ours=float(ratio[place]),
            published=printed,
            kind=kind,
        )
        for name, place, printed, word, arm, kind in rows
    ]


def _bend_lines(found: Mapping[str, Profile]) -> list[Line]:
    """Compare simulation and statics of the two other profiles, and show their bends beside Table II's."""
    lines = []
    for name, robot in profiles().items():
        at = int(np.searchsorted(TENSIONS_N, 20.0))
        item = found[name]
        for way, bend in (("toward the first larger arm", item.toward_deg), ("away from it", item.away_deg)):
            what = f"{name} profile, pulled {way} by 20 N: bend of the section"
            lines.append(Line(SECTION, what, "deg", np.nan, None, _SOURCE, analytic=float(bend[at])))
        if name != ALTERNATING:  # Table II's has checks of its own
            rows = given(np.array(SIMULATED_N)[:, None])
            far = [
                largest_distance(
                    tips_mm(simulate(side, rows, NO_GRAVITY).postures),
                    tips_mm(complete(side, rows, NO_GRAVITY).postures),
                )
                for side in (robot, pulled_on_the_other_side(robot))
            ]
            what = f"{name} profile, 5, 20, 50 N on either side, friction: tip, largest"
            lines.append(Line(SECTION, what, "mm", max(far), 1.0, _SOURCE))
    return lines


def _zigzag_lines(back: Mapping[float, Array]) -> list[Line]:
    """Show how far the even joints bend backward where the other rod is held, and check it by simulation."""
    lines = []
    for stiffness, bend in back.items():
        k = int(bend.argmin())
        what = f"{_held(stiffness)}: even joints furthest back, median"
        far = float(bend[k])
        lines.append(
            Line(SECTION, f"{what}, at {PULLED_N[k]:g} N", "deg", max(-far, 0.0), None, _SOURCE, analytic=far)
        )
    for stiffness in (STIFFNESS[0], STIFFNESS[-1]):
        rows = given(np.array([(2.0 * HELD_N, HELD_N), (10.0, HELD_N), (30.0, HELD_N)]))
        robot = both_pulled(stiffness)
        ours = simulate(robot, rows, NO_GRAVITY, ramp_s=RAMP_S).postures
        theirs = complete(robot, rows, NO_GRAVITY).postures
        apart = float(np.degrees(np.abs(_angles(ours) - _angles(theirs)).max()))
        what = f"{_held(stiffness)}, 4, 10, 30 N: joint angle, largest"
        lines.append(Line(SECTION, what, "deg", apart, 0.2, _SOURCE))
    return lines


def _held(stiffness: float) -> str:
    return f"other rod held at {HELD_N:g} N, rods' stiffness x{stiffness:g}"


def _profile_finding(found: Mapping[str, Profile]) -> str:
    at = int(np.searchsorted(TENSIONS_N, 20.0))
    told = "; ".join(
        f"{name} {item.toward_deg[at]:.0f} and {item.away_deg[at]:.0f} deg" for name, item in found.items()
    )
    return (
        f"{SECTION}: bend at 20 N, pulled toward the first joint's larger arm and away from it: {told}. "
        "The larger arm pays where it is on one side at every joint; on alternate sides, as Table II has "
        "it, the levers' mean is the symmetric 2 mm and the section bends no further than a symmetric "
        f"one of {SYMMETRIC_RADIUS_M * 1e3:g} mm radius (assumed). Section III-A's lever is 1.5 times the "
        "symmetric one, not twice."
    )


def _rods_finding(back: Mapping[float, Array]) -> str:
    told = "; ".join(f"x{stiffness:g} {bend.min():.1f} deg" for stiffness, bend in back.items())
    return (
        f"{SECTION}: the alternate joints do bend against one another where both rods are tense (Fig. "
        f"4c): with the other rod held at {HELD_N:g} N the even joints' median goes back to, by the rods' "
        f"stiffness, {told}. Stiff rods bound it, as the paper says. With one rod pulled alone and the "
        "other free nothing bends backward in the complete balance, whatever the stiffness."
    )


def _angles(postures: Sequence[Posture]) -> Array:
    return np.array([posture.joint_angles for posture in postures])
