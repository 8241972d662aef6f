"""The notched wrist of York et al. 2015 and Swaney et al. 2017, as data."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from catheter_sim.core.published import Drawn, Published, Uncertain, reach_and_track
from catheter_sim.core.robot import DAMPING_TIME_S, DYNAMICS_ASSUMED, Dynamics, Friction
from catheter_sim.robots.notched_tube.description import uncut_mass_kg
from catheter_sim.robots.notched_tube.spec import NotchedSegment, NotchedTubeRobot, Superelastic, WallTendon

# ----------------------------------------------------------------------------------------------------
# The notched wrist of York et al. 2015 and Swaney et al. 2017, as data.
#
# York, Swaney, Gilbert, Webster 2015, "A wrist for needle-sized surgical robots", ICRA (doi
# 10.1109/ICRA.2015.7139423); Swaney, York, Gilbert, Burgner-Kahrs, Webster 2017, J. Medical Devices 11,
# 014501 (doi 10.1115/1.4034575). Of the papers themselves only abstracts could be read here. Their numbers
# come from the authors' statics script, of which two copies were read. That of the public repository
# nepacheco/MastersThesis (2020), Wrist_statics.m, has the measured tensions, the wrist's dimensions in
# comments (it computes another tube), 40 GPa, and 75 GPa in a comment only. The other copy, whose
# repository was not identified, computes this wrist, with 60 GPa and plateaus at 500 and 750 MPa. The
# spacing and the tip's length are from an unnamed test file of the same public scripts, unconfirmed.
#
# Three parameter sets. `script`: the other copy's numbers, with the depth that the prototype turned out to
# have. `design`: the same with the depth that was asked for, which closes at the 138 deg that the prototype
# bends. The default: metal and friction, three numbers, fitted to York 2015's bends by the kinetostatic
# model. The script's flat plateau and its friction were fitted by the printed model, in which all notches
# bend alike; taken notch by notch they let one notch after another snap shut, which the prototype's
# tensions do not show.

TOLERANCE_M = 2e-4  # assumed: of environments, 3 % of the length
NOTCHES = 5  # both copies of the script
OUTER_RADIUS_M = 0.58e-3  # abstract of York 2015: 1.16 mm diameter
INNER_RADIUS_M = 0.43e-3  # script: 0.86 mm diameter
NOTCH_HEIGHT_M = 0.508e-3  # script
NOTCH_DEPTH_M = 0.988e-3  # script: "specified 0.97 mm, got 0.987 mm"
SPECIFIED_DEPTH_M = 0.97e-3  # script, in the comment
SPACING_M = 0.51e-3  # unnamed test file, unconfirmed
TIP_LENGTH_M = 1.5e-3  # unnamed test file's distal offset, unconfirmed
DENSITY_KG_PER_M3 = 6450.0  # assumed: of nitinol
AREA_M2 = 9.375e-8  # what a notch leaves of the wall, for the mass
MODULUS_PA = 60e9  # copy that was not identified; 40 GPa in the other one
TENSION_PLATEAU_PA = 500e6  # copy that was not identified
COMPRESSION_PLATEAU_PA = 750e6  # copy that was not identified
FRICTION_MU = 0.2  # script: fitted by its authors to the measured tensions; 0.4 in an earlier version
# Fitted here by the kinetostatic model, three numbers to the 18 rows below, 0.9 deg in the root mean square
# (as scripted: 7.8 deg): a factor on the script's modulus and plateaus, the plateau's slope, the friction.
FITTED_FACTOR = 0.966
FITTED_SLOPE = 0.067
FITTED_MU = 0.164

# Tip bend [deg] and tension at the actuator [N] of the prototype while it is pulled, the bend as read: the
# first row is the unloaded tube. MastersThesis' Wrist_statics.m, whose comments call it the authors'.
MEASURED_BEND_DEG = (
    *(5.9, 11.0, 15.4, 22.9, 28.8, 35.3, 45.0, 55.0, 65.6, 75.1, 85.1, 95.1),
    *(105.6, 114.9, 122.9, 131.6, 137.7, 143.7),
)
MEASURED_TENSION_N = (
    *(0.004154105, 0.357560665, 0.776502946, 1.20881778, 1.622529453, 1.947777032, 2.220738834, 2.409689019),
    *(2.541027722, 2.66422041, 2.816352783, 2.949542383, 3.118125643, 3.247102412, 3.405919401, 3.632075577),
    *(3.880093348, 4.202531803),
)

# What may be calibrated before anything is called wrong: as for the other robots of one section (nominal
# specification), the tendon's radius, half of the arm, by twice the arm's 1 %. The depth is not among them:
# 2 % of it are 30 % of a notch's stiffness, and not to be told from the modulus.
UNCERTAIN = (
    Uncertain("elastic_constant", 0.03, ("stiffness_scale",)),
    Uncertain("friction_coefficient", 0.20, ("friction.mu",)),
    Uncertain("tendon_radius", 0.02, ("tendons.tendon.radius_mm",)),
)

_FITTED = "fitted here by the kinetostatic model, with two other numbers, to York 2015's measured bends"
_THESIS = "the thesis's Wrist_statics.m"
_SCRIPT = "York 2015's statics script (nepacheco/MastersThesis 2020, Wrist_statics.m)"
_COPY = "copy of York 2015's statics script whose repository was not identified"
_TEST = "from an unnamed test file of the same public scripts (nepacheco/MastersThesis 2020); unconfirmed"
_SEGMENT_SOURCES = {
    "notches": f"{_SCRIPT}: n = 5",
    "outer_radius_mm": "York 2015, abstract: a 1.16 mm diameter prototype",
    "inner_radius_mm": f"{_SCRIPT}, in a comment: 0.86 mm diameter",
    "notch_height_mm": f"{_SCRIPT}, in a comment: 0.508 mm",
    "notch_depth_mm": f"{_SCRIPT}, in comments: 0.988 mm, calibrated; 0.97 mm was specified",
    "spacing_mm": f"0.51 mm {_TEST}",
    "mass_g": "assumed: nitinol of 6450 kg/m^3",
    "stiffness_cubic_mm2": "by definition 0: the metal's own law",
    "stiffness_quintic_mm4": "by definition 0: the metal's own law",
    "rest_curvature_x_per_m": "assumed: straight (the prototype's 5.9 deg unloaded are taken off its data)",
    "rest_curvature_y_per_m": "assumed: straight",
    "rest_twist_deg_per_m": "assumed: straight",
}
_SOURCES = {f"segments.wrist.{key}": text for key, text in _SEGMENT_SOURCES.items()} | {
    "tendons.tendon.radius_mm": f"{_SCRIPT} and York 2015's kinematics: on the inner wall (a thin tendon)",
    "tendons.tendon.stiffness_N_per_mm": "assumed: inextensible, as in York 2015's kinematics",
    "tendons.tendon.pretension_N": "assumed: none",
    "material.modulus_Pa": f"{_COPY}: 60 GPa; {_THESIS} has 40 GPa, 75 only in a comment",
    "material.tension_plateau_Pa": f"{_COPY}: 500 MPa",
    "material.compression_plateau_Pa": f"{_COPY}: 750 MPa",
    "material.plateau_slope": f"{_SCRIPT}: flat, as in York 2015's energy",
    "material.poisson_ratio": "assumed: of nitinol; sets the torsion alone",
    "friction.mu": f"{_SCRIPT}: 0.2, fitted to the prototype's tensions",
    "tip_length_mm": f"distal offset of 1.5 mm {_TEST}",
    "mount": "assumed: rigid",
    "dynamics": DYNAMICS_ASSUMED,
    "channel_radius_mm": "assumed: the lumen beside a tendon of 0.2 mm",
    "tip_mass_g": "by definition 0",
    "stiffness_scale": "by definition 1",
}


def notched_wrist() -> NotchedTubeRobot:
    """Return the prototype, its metal and friction (three numbers) fitted to York 2015's bends."""
    made = notched_wrist_script()
    metal = Superelastic(
        FITTED_FACTOR * MODULUS_PA,
        FITTED_FACTOR * TENSION_PLATEAU_PA,
        FITTED_FACTOR * COMPRESSION_PLATEAU_PA,
        FITTED_SLOPE,
    )
    fitted = ("modulus_Pa", "tension_plateau_Pa", "compression_plateau_Pa", "plateau_slope")
    sources = {f"material.{name}": _FITTED for name in fitted} | {"friction.mu": _FITTED}
    return replace(
        made,
        description="nitinol tube of 1.16 mm with five notches, one tendon (York 2015; metal fitted)",
        material=metal,
        friction=Friction(FITTED_MU),
        sources=dict(made.sources) | sources,
    )


def notched_wrist_script() -> NotchedTubeRobot:
    """Return the prototype with the numbers of the copy of the script that was not identified."""
    segment = NotchedSegment(
        name="wrist",
        notches=NOTCHES,
        outer_radius_m=OUTER_RADIUS_M,
        inner_radius_m=INNER_RADIUS_M,
        notch_height_m=NOTCH_HEIGHT_M,
        notch_depth_m=NOTCH_DEPTH_M,
        spacing_m=SPACING_M,
        mass_kg=math.inf,
    )
    segment = replace(segment, mass_kg=uncut_mass_kg(segment, DENSITY_KG_PER_M3, AREA_M2))
    return NotchedTubeRobot(
        name="notched_wrist",
        description="the same wrist with the numbers of its authors' statics script (York 2015)",
        segments=(segment,),
        tendons=(WallTendon("tendon", INNER_RADIUS_M),),
        material=Superelastic(MODULUS_PA, TENSION_PLATEAU_PA, COMPRESSION_PLATEAU_PA),
        friction=Friction(FRICTION_MU),
        tip_length_m=TIP_LENGTH_M,
        # Notches of a lower slope come to rest ten times later than these say.
        dynamics=Dynamics(1e-3, relaxation_time_s=0.01, inertia_time_s=0.002, damping_time_s=DAMPING_TIME_S),
        channel_radius_m=0.23e-3,
        sources=_SOURCES,
    )


def notched_wrist_design() -> NotchedTubeRobot:
    """Return the wrist with the notches' depth as specified."""
    made = notched_wrist_script()
    segment = replace(made.segments[0], notch_depth_m=SPECIFIED_DEPTH_M)
    depth = {"segments.wrist.notch_depth_mm": f"{_SCRIPT}, in a comment: 0.97 mm specified"}
    return replace(
        made,
        description="as the script, with the notches' depth as specified (York 2015)",
        segments=(segment,),
        sources=dict(made.sources) | depth,
    )


NOTCHED_WRISTS = (
    Published(
        "notched_wrist",
        notched_wrist,
        reach_and_track("NotchedWrist", tolerance_m=TOLERANCE_M),
        uncertain=UNCERTAIN,
    ),
    Published("notched_wrist@script", notched_wrist_script, uncertain=UNCERTAIN),
    Published("notched_wrist@design", notched_wrist_design, uncertain=UNCERTAIN),
)


# ----------------------------------------------------------------------------------------------------
# Published notched tubes, one a file.

PUBLISHED: tuple[Published, ...] = NOTCHED_WRISTS
DRAWN: Mapping[str, Drawn] = {}
