"""Causes that act in part only: shares lie where they are said to, and nothing acts outside them."""

from __future__ import annotations

import numpy as np
import pytest

from catheter_sim.lab.engine import Ground, Planted, columns_of, looked_at, simulated
from hidden_effects.in_part import FORMS, PARTS, Part
from hidden_effects.planting import drawn_form

TWO_VARIABLES = ("late_and_far", "beside_another", "back_and_late", "late_in_one_half")


def planted(ground: Ground, key: str, size: float = 1.0, **numbers: float) -> Planted:
    form = next(item for item in FORMS if item.key == key)
    drawn = form.draw(ground.specimen, ground.scale, np.random.default_rng(1))
    return Planted(form, size * form.start, {**drawn, **numbers})


def seen(ground: Ground, item: Planted, number: int = 0) -> np.ndarray:
    course, specimen = ground.courses[number], ground.specimen
    inside = [] if item.form.looks_only else [item]
    shapes = simulated(specimen, ground.scale, inside, course) if inside else ground.plain[number]
    return columns_of(specimen, looked_at(specimen, ground.scale, [item], course, shapes))


def test_tuning_and_judging_have_parts_of_their_own():
    """Half of those for judging are of two variables."""
    names = {
        purpose: [part.name for part in PARTS if part.purpose == purpose] for purpose in ("tune", "judge")
    }
    assert not set(names["tune"]) & set(names["judge"])
    assert set(TWO_VARIABLES) < set(names["judge"])
    assert 2 * len(TWO_VARIABLES) >= len(names["judge"])
    assert len({form.key for form in FORMS}) == len(FORMS)
    assert all(not form.known and form.parameters(None) == {} for form in FORMS)


@pytest.mark.parametrize("part", PARTS, ids=lambda part: part.name)
def test_shares_lie_between_none_and_all(part: Part, pulled_ground: Ground):
    """Rows and elements with the share at work, and such without."""
    item = planted(pulled_ground, f"stiffness.{part.name}", of=0, at=0.4)
    acting = item.acting(pulled_ground.specimen, pulled_ground.scale)
    found = []
    if part.rows is not None:
        found.append(np.concatenate([part.rows(acting, course) for course in pulled_ground.courses]))
    if part.places is not None:
        found.append(part.places(acting))
    for share in found:
        assert share.min() >= 0.0
        assert 0.1 < share.max() <= 1.2
        assert share.min() < 0.5 * share.max()


@pytest.mark.parametrize("key", [form.key for form in FORMS if form.name in ("from_a_time", "one_stretch")])
def test_size_zero_does_nothing(key: str, grounds: dict[str, Ground]):
    form = next(item for item in FORMS if item.key == key)
    ground = next((item for item in grounds.values() if form.applies(item.specimen)), None)
    if ground is None:
        pytest.skip("makes no sense for these robots")
    plain = columns_of(ground.specimen, ground.plain[0])
    np.testing.assert_allclose(seen(ground, planted(ground, key, size=0.0)), plain, atol=1e-3)


def test_nothing_acts_before_its_time(pulled_ground: Ground):
    """Softer from the middle of the trial on: rows before are those of the plain robot."""
    clock = pulled_ground.courses[0].time_s / pulled_ground.scale.duration_s
    change = seen(pulled_ground, planted(pulled_ground, "stiffness.from_a_time", at=0.5))
    change = np.abs(change - columns_of(pulled_ground.specimen, pulled_ground.plain[0])).max(axis=1)
    assert change[clock < 0.5].max() < 1e-9
    assert change[clock >= 0.5].max() > 0.1


def test_a_stretch_moves_what_is_beyond_it_alone(pulled_ground: Ground):
    """Softer from two fifths of the length on: elements below stay where they are."""
    ground = pulled_ground
    item = planted(ground, "stiffness.one_stretch", at=0.4)
    before = ground.plain[0]
    after = looked_at(ground.specimen, ground.scale, [item], ground.courses[0], before)
    apart = np.linalg.norm(after.p - before.p, axis=-1).max(axis=0)
    along = (np.arange(len(apart)) + 0.5) / len(apart)
    assert apart[along < 0.4].max() < 1e-12
    assert apart[along > 0.5].min() > 0.0


@pytest.mark.parametrize("purpose", ["tune_in_part", "judge_in_part"])
def test_draws_are_of_their_purpose(purpose: str, pulled_ground: Ground):
    generator = np.random.default_rng(3)
    forms = [drawn_form(pulled_ground.specimen, purpose, 0.4, generator, []) for _ in range(40)]
    assert {form.purpose for form in forms if form is not None} == {purpose.removesuffix("_in_part")}
    assert len({form.cause for form in forms if form is not None}) > 4
