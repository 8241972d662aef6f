"""What the guide says `info` holds is what environments hand out, with the unit at the end of each name."""

from __future__ import annotations

import re
from pathlib import Path

import gymnasium
import numpy as np
import pytest

import catheter_sim  # noqa: F401 - registers the environments

PAGE = Path(__file__).resolve().parents[2] / "docs" / "guides" / "train_a_policy.md"
TASKS = ("NotchedWristReach", "NeuroendoscopeSectionTrack", "NeuroendoscopeTumour", "ChestTubeInsert")
WITHOUT_UNIT = {"is_success", "diverged", "pressed_too_hard", "points_reached"}
UNITS = ("_mm", "_deg", "_N", "_mm_per_s")


def told() -> dict[str, str]:
    """Return the names in the guide's table, and the tasks of each."""
    text = PAGE.read_text(encoding="utf-8")
    rows = text[text.index("What `info` holds") :].partition("\n## ")[0]
    return {
        name: row.split("|")[-2]
        for row in rows.splitlines()
        if row.startswith("| `")
        for name in re.findall(r"`(\w+)`", row.split("|")[1])
    }


@pytest.mark.slow
@pytest.mark.parametrize("task", [*TASKS, "Mitral4dofDeliver"])
def test_every_name_of_info_is_told_and_has_its_unit(task: str) -> None:
    """At a reset and after a step."""
    env = gymnasium.make(f"catheter_sim/{task}-v0")
    _, first = env.reset(seed=0)
    _, _, _, _, later = env.step(np.zeros(env.action_space.shape, dtype=np.float32))
    env.close()
    for info in (first, later):
        assert set(info) <= set(told())
        for name in set(info) - WITHOUT_UNIT:
            assert name.endswith(UNITS), name
    assert {"tip_mm", "target_mm", "distance_mm", "is_success"} <= set(later)


def test_the_table_is_found() -> None:
    """Names of one task say which."""
    assert told()["points_reached"].strip() == "`Tumour`"
    assert len(told()) > 18
