"""Settings of a robot in Python: a text, several, or a mapping; errors in Python's words."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.errors import InputError

ROBOT = "neuroendoscope_section"


@pytest.mark.parametrize(
    "settings",
    [
        "friction.mu=0.25",
        ["friction.mu=0.25"],
        ("friction.mu=0.5", "friction.mu = 0.25"),
        {"friction.mu": 0.25},
        {"friction.mu": "0.25"},
        {" friction.mu ": np.float32(0.25)},
    ],
)
def test_a_text_several_and_a_mapping_say_the_same(settings: Any) -> None:
    """Each gives the robot whose friction is 0.25; of a key that is set twice the last value holds."""
    assert load_robot(ROBOT, settings) == load_robot(ROBOT, ["friction.mu=0.25"])
    assert load_robot(ROBOT, settings).friction.mu == 0.25


def test_a_mapping_sets_effects_names_and_whole_numbers() -> None:
    """As `--set` does; a whole number may stand for a number, and a text for a name that looks like one."""
    robot = load_robot(
        ROBOT,
        {"effects.backlash.width_N": 1, "name": "7", "friction.mu": 1, "segments.section.length_mm": 90},
    )
    assert robot.effects == {"backlash": {"width_N": 1}}
    assert robot.name == "7"
    assert (robot.friction.mu, robot.segments[0].length_m) == (1.0, pytest.approx(0.09))


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        (5, "settings = 5: texts KEY=VALUE, or a mapping of keys to values, are needed"),
        (None, "settings = None: texts KEY=VALUE"),
        ([5], "settings = [5]: texts KEY=VALUE"),
        ("friction.mu", "settings friction.mu: KEY=VALUE is needed, as in friction.mu=0.2"),
        ("=1", "settings =1: KEY=VALUE is needed"),
        ({"friction": 1}, "settings friction: names a whole table; choices: mu"),
        ({"friction.nu": 1}, "settings friction.nu: unknown key 'nu'; choices: mu"),
        ({"effects.backlash": 1}, "settings effects.backlash: an effect is set as"),
        ({5: 1}, "settings 5: a dotted key is needed, as in friction.mu"),
        ({"": 1}, "settings '': a dotted key is needed"),
        ("a\nb", "settings 'a\\nb': a dotted key is needed"),
        ({"a\nb": 1}, "settings 'a\\nb': a dotted key is needed"),
        ({"a=b": "1"}, "settings 'a=b': a dotted key is needed"),
        ({"friction.mu": True}, "settings friction.mu = True: a number or a text is needed"),
        ({"friction.mu": None}, "settings friction.mu = None: a number or a text is needed"),
        ({"friction.mu": 10**400}, "too large a number"),
        (f"friction.mu={10**400}", "too large a number"),
        ({"friction.mu": math.nan}, "mu: a number is needed, not nan"),
        ({"friction.mu": "abc"}, "mu: a number is needed, not 'abc'"),
        ({"name": 7}, "name: a text is needed, not 7"),
        ({"friction.mu": np.zeros((2, 2))}, "settings friction.mu = array([[0., 0.], [0., 0.]]): a number"),
    ],
)
def test_wrong_settings_are_one_line_without_the_words_of_the_command_line(settings: Any, told: str) -> None:
    """What was given, and what would be right."""
    with pytest.raises(InputError) as caught:
        load_robot(ROBOT, settings)
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)
    assert "--set" not in str(caught.value)


def test_the_command_line_names_its_own_option() -> None:
    """What it passes on is called as it was typed."""
    with pytest.raises(InputError, match=r"^--set friction.nu: unknown key 'nu'; choices: mu$"):
        load_robot(ROBOT, ["friction.nu=1"], "--set")
