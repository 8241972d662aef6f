"""A small data set with nothing planted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from catheter_sim.lab.engine import Ground
from catheter_sim.lab.specimen import Course, Specimen, drawn_specimen


def short_ground(name: str, seed: int = 1) -> Ground:
    """Return a specimen with seven trials of nine rows: every channel out and home, one after the other."""
    specimen = drawn_specimen(np.random.default_rng(seed), name)
    specimen = replace(specimen, gravity_mps2=np.zeros(3))
    return Ground(specimen, tuple(_course(specimen, number) for number in range(7)))


def _course(specimen: Specimen, number: int) -> Course:
    share = np.array([0.0, 0.5, 1.0, 0.6, 0.2, 0.5, 0.8, 0.4, 0.0])
    commands = np.zeros((len(share), len(specimen.reach)))
    channel = number % len(specimen.reach)
    commands[:, channel] = (1.0 - 0.1 * number) * share * specimen.reach[channel]
    time_s = np.cumsum([0.0, *np.tile([0.5, 2.0], 4)])
    return Course(number, "train" if number < 5 else "heldout", time_s, commands, 0 if number == 4 else None)


@pytest.fixture(scope="session")
def plain_ground() -> Ground:
    """Return the catheter's, which is simulated fastest."""
    return short_ground("mitral_transseptal")


@pytest.fixture(scope="session")
def pulled_ground() -> Ground:
    """Return a robot's that tensions bend, with friction."""
    return short_ground("neuroendoscope_section")


@pytest.fixture(scope="session")
def grounds(plain_ground, pulled_ground) -> dict[str, Ground]:
    """Return robots of several kinds: jointed, tensioned, displaced, in space."""
    others = ("mitral_4dof", "file_displacement", "file_tension", "chest_tube_section")
    own = {"mitral_transseptal": plain_ground, "neuroendoscope_section": pulled_ground}
    return own | {name: short_ground(name) for name in others}
