"""The two recordings of a draw before anything is planted: one specimen, and the trials of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from catheter_sim.blind_bench.nature.courses import TRAINING, Course, drawn_courses
from catheter_sim.blind_bench.nature.engine import CannotMake
from catheter_sim.blind_bench.nature.ground import Ground
from catheter_sim.blind_bench.nature.specimen import drawn_specimen

_DRAWS = 100  # of which trials stay


@dataclass(frozen=True)
class Recordings:
    """Specimen and trials of the two recordings.

    Attributes:
        before: the earlier one.
        courses: trials of the later one.
    """

    before: Ground
    courses: tuple[Course, ...]

    @cached_property
    def after(self) -> Ground:
        """The later one. What a calibration would take shows there: the earlier one has shown the specimen.

        What is large for a form is what is large in the earlier one, so that one law is the same in both.
        """
        return Ground(self.before.specimen, self.courses, calibrates=False, known_scale=self.before.scale)


def drawn_recordings(generator: np.random.Generator, robot: str, commands: str) -> Recordings:
    """Return a specimen and the trials of its two recordings.

    Args:
        generator: draws them.
        robot: one of the bench's.
        commands: "same": both have the same trials; "other": none in common; "partly": some.
    """
    specimen = drawn_specimen(generator, robot)
    first = drawn_courses(specimen, generator)
    if commands == "same":
        return Recordings(Ground(specimen, first), first)
    fresh = tuple(
        replace(course, role=old.role)
        for course, old in zip(drawn_courses(specimen, generator), first, strict=True)
    )
    if commands == "other" and _learnable(fresh):
        return Recordings(Ground(specimen, first), fresh)
    for _ in range(_DRAWS):
        stays = generator.random(len(first)) < 0.5
        stays[TRAINING] = stays[0]  # that one is the first again
        mixed = tuple(old if kept else new for old, new, kept in zip(first, fresh, stays, strict=True))
        if commands == "partly" and not stays.all() and stays.any() and _learnable(mixed):
            return Recordings(Ground(specimen, first), mixed)
    raise CannotMake(f"no trials were drawn that have {commands} commands")


def _learnable(courses: Sequence[Course]) -> bool:
    """Return whether held-out trials move only channels that training moves."""
    moved = np.array([course.commands.any(axis=0) for course in courses])
    learned = moved[: TRAINING + 1].any(axis=0)
    return not moved[TRAINING + 1 :, ~learned].any()
