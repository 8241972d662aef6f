"""The rod in PyElastica: a Cosserat rod of elements, stepped in time with damping until it is at rest."""

from __future__ import annotations

import contextlib
import io
import math
from importlib.metadata import version
from typing import Any

import numpy as np

from peers.rods import DENSITY, ELEMENTS, LENGTH_M, RADIUS_M, SHEAR_PA, YOUNG_PA, Program

_STEP_S = 0.3 * LENGTH_M / ELEMENTS / math.sqrt(YOUNG_PA / DENSITY)  # of the way of sound through an element
_STEPS = 2000
_DAMPING_PER_S = 20.0  # near the critical one of the first mode: it comes to rest soonest
_AT_REST_M_PER_S = 1e-5


def program() -> Program:
    """Return PyElastica.

    Raises:
        ImportError: it is not installed.
    """
    import elastica

    class RodScene(elastica.BaseSystemCollection, elastica.Constraints, elastica.Forcing, elastica.Damping):  # type: ignore[misc,name-defined]
        """A collection of systems with what this rod needs."""

    def rod(scale: float, force_N: float) -> tuple[Any, Any]:
        scene = RodScene()
        made = elastica.CosseratRod.straight_rod(
            ELEMENTS, np.zeros(3), np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]), LENGTH_M, RADIUS_M,
            DENSITY, youngs_modulus=scale * YOUNG_PA, shear_modulus=scale * SHEAR_PA,
        )  # fmt: skip
        scene.append(made)
        scene.constrain(made).using(
            elastica.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,)
        )
        push = np.array([force_N, 0.0, 0.0])
        scene.add_forcing_to(made).using(elastica.EndpointForces, np.zeros(3), push, ramp_up_time=1e-6)
        scene.dampen(made).using(
            elastica.AnalyticalLinearDamper, uniform_damping_constant=_DAMPING_PER_S, time_step=_STEP_S
        )
        scene.finalize()
        return scene, made

    def advance(scene: Any, steps: int) -> None:
        with contextlib.redirect_stdout(io.StringIO()):  # it prints the final time
            elastica.integrate(elastica.PositionVerlet(), scene, steps * _STEP_S, steps, progress_bar=False)

    def tip(scale: float, force_N: float) -> tuple[float, float]:
        scene, made = rod(scale, force_N)
        for _ in range(100):
            advance(scene, _STEPS)
            if np.abs(made.velocity_collection).max() < _AT_REST_M_PER_S:
                break
        place = made.position_collection[:, -1]
        return float(place[0]), float(place[2])

    moving, _ = rod(1.0, 0.1)

    def step() -> int:
        advance(moving, _STEPS)
        return _STEPS

    return Program(
        f"PyElastica {version('pyelastica')}",
        tip,
        step,
        _STEP_S,
        None,
        0,
        "damped steps until at rest",
    )
