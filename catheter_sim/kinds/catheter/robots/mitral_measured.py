"""The catheter of Nayar 2023 with what its control was measured with: numbers fitted to its errors, a tube.

`mitral_4dof@measured` is `mitral_4dof@elongation` with
- a slack of the bending tendons that gives the printed 4.8 deg which the feedforward with elongation leaves
  (Section IV-A): fitted to that one figure, so that it is no prediction of it. The paper names no slack; what
  is in it are also its shift parameter beta, couplings and friction;
- an exposed tube that bends, as stiff as its material and section say, and a weight beyond it: the
  orientation of the tool, of which the paper makes its joint angles, then depends on the advance (rows of
  Table I).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from catheter_sim.core.published import Published
from catheter_sim.kinds.catheter.robots.materials import tube_stiffness_N_m2
from catheter_sim.kinds.catheter.robots.mitral import mitral_4dof_elongation
from catheter_sim.kinds.catheter.spec import CatheterRobot

FITTED_SLACK_M = 0.803e-3  # to 4.8 deg of the proximal joint, as `validation.mitral_control` runs it
HOLDER_KG = 1.5e-3  # assumed: implant and its holder, 15 mm of plastic and steel


def mitral_4dof_measured() -> CatheterRobot:
    """Return the catheter of Nayar 2023 with slack fitted to its errors, a tube that bends and a weight."""
    robot = mitral_4dof_elongation()
    changed: dict[str, dict[str, Any]] = {
        "advance": {"tube_stiffness_N_m2": tube_stiffness_N_m2()},
        "torsion": {"mass_kg": HOLDER_KG},
    }
    fitted = "fitted to Nayar 2023, Section IV-A: 4.8 deg left by the feedforward with elongation"
    return replace(
        robot,
        name="mitral_4dof@measured",
        description="mitral-valve catheter of Nayar 2023: slack fitted to its errors, tube bends, weight",
        segments=tuple(replace(item, **changed.get(item.name, {})) for item in robot.segments),
        tendons=tuple(
            replace(item, slack_m=FITTED_SLACK_M) if item.law == "uhmwpe" else item for item in robot.tendons
        ),
        sources={
            **robot.sources,
            "segments.advance.tube_stiffness_N_mm2": "assumed: Nayar 2022, Table I (1.68 mm, 72D), 0.51 GPa",
            "segments.torsion.mass_g": "assumed: implant and holder; masses are not printed",
            "tendons.bending_proximal.slack_mm": fitted,
            "tendons.bending_distal.slack_mm": f"{fitted} of the proximal joint; assumed alike",
        },
    )


PUBLISHED = (Published("mitral_4dof@measured", mitral_4dof_measured),)
