"""Messages: one readable line whatever the user wrote."""

from __future__ import annotations

import pickle

import pytest

from catheter_sim.errors import LONGEST_MESSAGE, InputError, SimulationDiverged, cut, shown, unknown


def test_a_long_message_keeps_both_its_ends() -> None:
    """What a message says where and what for survives a hundred thousand characters in between."""
    message = str(InputError(f"in.csv: line 3: {'x' * 100_000}: a number is needed"))
    assert len(message) <= LONGEST_MESSAGE
    assert message.startswith("in.csv: line 3: xxx")
    assert message.endswith("xxx: a number is needed")
    assert str(InputError("short")) == "short"
    assert str(InputError("a\n\nname of\u2028lines")) == "a name of lines"
    assert cut("a" * 20, 20) == "a" * 20
    assert len(cut("a" * 21, 20)) <= 20


def test_an_error_travels_between_processes_unchanged() -> None:
    """A worker's error arrives as it was raised."""
    for kind in (InputError, SimulationDiverged):
        again = pickle.loads(pickle.dumps(kind("y" * 5000)))
        assert type(again) is kind
        assert str(again) == str(kind("y" * 5000))


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (3, "3"),
        ("a", "'a'"),
        ([0.0, 9.81], "[0.0, 9.81]"),
        (10**400, None),
        (10**5000, "a whole number of thousands of digits"),
        ("z" * 10**6, None),
        ({"a": {"b": {"c": {"d": {}}}}}, None),
    ],
    ids=lambda item: str(item)[:10] if not isinstance(item, int) else "",
)
def test_any_value_can_be_shown(value: object, text: str | None) -> None:
    """Short values are shown as Python writes them, others shortened."""
    assert len(shown(value)) <= 100
    if text is not None:
        assert shown(value) == text


def test_a_value_that_is_nested_deeply_can_be_shown() -> None:
    """Python itself would give up on it."""
    value: list[object] = []
    for _ in range(100_000):
        value = [value]
    assert shown(value) == "[[[[...]]]]"


def test_few_choices_are_all_shown_in_their_order() -> None:
    """A handful of names is the best answer to a wrong one."""
    assert str(unknown("kind", "b", ["c", "a"], "x.toml")) == "x.toml: unknown kind 'b'; choices: c, a"
    assert str(unknown("kind", "b", [])) == "unknown kind 'b'; choices: (none)"


def test_of_many_choices_the_nearest_come_first_with_their_number() -> None:
    """A typo finds its word among hundreds."""
    names = [f"body_{k}_{axis}_mm" for k in range(1, 200) for axis in "xyz"]
    message = str(unknown("output column", "body_117_x_m", names))
    assert message.startswith("unknown output column 'body_117_x_m'; choices: body_117_x_mm, ")
    assert message.endswith(", ... (597 in all)")
    assert len(message) < 300
    assert len(str(unknown("column", "w" * 10**6, names))) < 400
