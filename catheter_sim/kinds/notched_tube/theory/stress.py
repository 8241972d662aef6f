"""The stress of a superelastic metal: linear, then a plateau of a lower slope, in tension and compression.

York et al. 2015 (doi 10.1109/ICRA.2015.7139423) and Swaney et al. 2017 (doi 10.1115/1.4034575): a flat
plateau, lower in tension than in compression. Pacheco et al. 2021 (J. Medical Robotics Research): 0.08 of
the modulus beyond 2 % strain.
"""

from __future__ import annotations

import math

import numpy as np

from catheter_sim.arrays import Array
from catheter_sim.kinds.notched_tube.spec import Superelastic


def knees(metal: Superelastic) -> tuple[float, float]:
    """Return the strains at which the plateaus begin, of tension and compression, both above zero."""
    return metal.tension_plateau_Pa / metal.modulus_Pa, metal.compression_plateau_Pa / metal.modulus_Pa


def beyond_knees(metal: Superelastic, strain: Array) -> Array:
    """Return how far a strain lies beyond its knee, with its sign; 0 between the knees."""
    tension, compression = knees(metal)
    above = np.maximum(strain - tension, 0.0) if math.isfinite(tension) else np.zeros_like(strain)
    below = np.minimum(strain + compression, 0.0) if math.isfinite(compression) else np.zeros_like(strain)
    return above + below


def stress(metal: Superelastic, strain: Array) -> Array:
    """Return the stress at a strain [Pa]."""
    return metal.modulus_Pa * (strain - (1.0 - metal.plateau_slope) * beyond_knees(metal, strain))


def energy_density(metal: Superelastic, strain: Array) -> Array:
    """Return the energy stored per volume at a strain [J/m^3]: the integral of `stress`."""
    beyond = beyond_knees(metal, strain)
    return 0.5 * metal.modulus_Pa * (strain**2 - (1.0 - metal.plateau_slope) * beyond**2)
