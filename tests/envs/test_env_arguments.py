"""What environments are given: every wrong argument, option, seed or action ends in one line."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from catheter_sim.envs import tip
from catheter_sim.envs.clinical.deliver import DeliverEnv
from catheter_sim.envs.clinical.insert_and_tumour import TumourEnv
from catheter_sim.envs.reach_and_track import ReachEnv, TrackEnv
from catheter_sim.envs.tip import argument_names
from catheter_sim.envs.vector import OneByOneEnv
from catheter_sim.errors import InputError

IDS = sorted(name for name in gymnasium.registry if name.startswith("catheter_sim/"))
SECTION = "catheter_sim/NeuroendoscopeSectionReach-v0"
pytestmark = pytest.mark.filterwarnings("ignore:.*that is not in the possible render_modes")
MATRIX = np.full((3, 3), math.nan)

# What every environment refuses, and what its line says.
WRONG: list[tuple[dict[str, Any], str]] = [
    ({"tolerance": 1e-3}, "unknown argument 'tolerance'; choices: "),
    ({"robot": 5}, "robot = 5: a robot, its id or the path of its .toml is needed"),
    ({"robot": None}, "robot = None: a robot, its id"),
    ({"robot": "a\0.toml"}, "robot = 'a\\x00.toml': a robot, its id"),
    ({"robot": "scorpion"}, "unknown robot 'scorpion'; choices: neuroendoscope, "),
    ({"settings": 5}, "settings = 5: texts KEY=VALUE, or a mapping of keys to values, are needed"),
    ({"settings": None}, "settings = None: texts KEY=VALUE"),
    ({"settings": [5]}, "settings = [5]: texts KEY=VALUE"),
    ({"settings": "friction.mu"}, "settings friction.mu: KEY=VALUE is needed"),
    ({"settings": "friction.mux=0"}, "settings friction.mux: unknown key 'mux'; choices: "),
    ({"settings": ["friction.mux=0"]}, "settings friction.mux: unknown key 'mux'; choices: "),
    ({"settings": {"friction.mux": 0}}, "settings friction.mux: unknown key 'mux'; choices: "),
    ({"settings": {5: 0}}, "settings 5: a dotted key is needed"),
    ({"settings": {"name": 7}}, "name: a text is needed, not 7"),
    ({"settings": {"name": True}}, "settings name = True: a number or a text is needed"),
    ({"settings": {"name": MATRIX}}, "settings name = array([[nan, nan, nan"),
    ({"action_type": 5}, "action_type = 5: choices: tension, displacement, None"),
    ({"action_type": "pull"}, "unknown action_type 'pull'; choices: tension, displacement, None"),
    ({"gravity_mps2": "down"}, "gravity_mps2 = 'down': three finite numbers are needed"),
    ({"gravity_mps2": (0.0, 9.81)}, "gravity_mps2 = (0.0, 9.81): three finite numbers"),
    ({"gravity_mps2": MATRIX}, "gravity_mps2 = array([[nan, nan, nan"),
    ({"tolerance_m": "near"}, "tolerance_m = 'near': must be above zero and finite"),
    ({"tolerance_m": None}, "tolerance_m = None: must be above zero"),
    ({"tolerance_m": True}, "tolerance_m = True: must be above zero"),
    ({"tolerance_m": -1.0}, "tolerance_m = -1: must be above zero"),
    ({"render_mode": "ansi"}, "unknown render_mode 'ansi'; choices: rgb_array, None"),
    ({"width": -1}, "width = -1: must be a whole number, 1 or more"),
    ({"width": 2.5}, "width = 2.5: must be a whole number, 1 or more"),
    ({"width": 3, "height": 3}, "width = 3: a picture has 6 to 4096 pixels a side"),
    ({"height": 10**9}, "height = 1000000000: a picture has 16 to 4096 pixels a side"),
    ({"observation": "pixels", "width": 10**9}, "width = 1000000000: a picture has"),
    ({"observation": 5}, "observation = 5: choices: state, pixels"),
    ({"observation": "smell"}, "unknown observation 'smell'; choices: state, pixels"),
    ({"randomised": 5}, "randomised = 5: a mapping of keys to bounds is needed"),
    ({"randomised": ["friction.mu"]}, "randomised = ['friction.mu']: a mapping of keys to bounds"),
    ({"randomised": {5: (0, 1)}}, "randomised: 5: a dotted key is needed"),
    ({"randomised": {"friction.mu": 5}}, "randomised friction.mu = 5: two finite numbers, least first"),
    ({"randomised": {"friction.mu": "01"}}, "randomised friction.mu = '01': two finite numbers"),
    ({"randomised": {"friction.mu": (1, 0)}}, "randomised friction.mu = (1, 0): two finite numbers"),
    ({"randomised": {"friction.mu": (0, math.nan)}}, "randomised friction.mu = (0, nan): two finite"),
    ({"randomised": {"friction.mux": (0, 1)}}, "randomised friction.mux: unknown key 'mux'; choices: "),
    ({"randomised": {"name": (0, 1)}}, "name: a text is needed, not 0.0"),
]
WRONG_OF_MANY: list[tuple[dict[str, Any], str]] = [
    ({"num_envs": 0}, "num_envs = 0: must be a whole number, 1 or more"),
    ({"num_envs": "two"}, "num_envs = 'two': must be a whole number"),
    ({"threads": 0}, "threads = 0: must be a whole number, 1 or more"),
    ({"threads": -1}, "threads = -1: must be a whole number"),
    ({"threads": MATRIX}, "threads = array([[nan, nan, nan"),
    ({"max_episode_steps": -1}, "max_episode_steps = -1: must be a whole number, 1 or more"),
    ({"autoreset_mode": 5}, "autoreset_mode = 5: choices: NextStep, SameStep, Disabled"),
    ({"autoreset_mode": "Never"}, "unknown autoreset_mode 'Never'; choices: NextStep, SameStep, Disabled"),
    ({"task": 1}, "unknown argument 'task'; choices: num_envs, max_episode_steps, threads, autoreset_mode, "),
]


def refusal(make: Any, *arguments: Any, **named: Any) -> str:
    """Return the line by which `make` refuses its arguments."""
    with pytest.raises(InputError) as caught:
        make(*arguments, **named)
    line = str(caught.value)
    assert "\n" not in line
    assert "--set" not in line, line
    return line


@pytest.mark.parametrize("name", IDS)
def test_every_environment_refuses_every_wrong_argument_in_a_line(name: str) -> None:
    """The line names the argument, what was given and the choices, in the words of Python."""
    for arguments, told in WRONG:
        assert told in refusal(gymnasium.make, name, **arguments), arguments


@pytest.mark.parametrize("name", IDS)
def test_every_vector_form_refuses_every_wrong_argument_in_a_line(name: str) -> None:
    """Its own arguments, and those of the single environment."""
    many = {"vectorization_mode": "vector_entry_point"}
    for arguments, told in [*WRONG_OF_MANY, *WRONG]:
        if "max_episode_steps" in arguments and name != SECTION:
            continue
        line = refusal(gymnasium.make_vec, name, **{"num_envs": 2, **arguments}, **many)
        assert told in line, arguments


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"angle_deg": "a"}, "angle_deg = 'a': must be above 0 and at most 180"),
        ({"flow_N": "01"}, "flow_N = '01': two amplitudes are needed"),
        ({"flow_N": (-1.0, 0.0)}, r"flow_N = (-1.0, 0.0): two amplitudes are needed"),
        ({"largest_bend_rad": [1]}, "largest_bend_rad = [1]: must be above zero and finite"),
    ],
)
def test_deliver_refuses_its_own_wrong_arguments(arguments: dict[str, Any], told: str) -> None:
    """Those that the other tasks do not have, or not for catheters."""
    assert told in refusal(gymnasium.make, "catheter_sim/MitralTransseptalDeliver-v0", **arguments)


def test_unknown_argument_is_answered_with_those_that_the_task_has() -> None:
    """Its own first, then those of all tasks; bases outside the package have none."""
    own = argument_names(TrackEnv)
    assert [name for name in own if name != "time_left"] == argument_names(TumourEnv)
    assert argument_names(ReachEnv)[:4] == ["robot", "settings", "action_type", "hold_steps"]
    assert {"angle_deg", "flow_N", "randomised"} < set(argument_names(DeliverEnv))
    line = refusal(gymnasium.make, SECTION, hold_step=3)
    assert line == f"ReachEnv: unknown argument 'hold_step'; choices: {', '.join(argument_names(ReachEnv))}"


@pytest.mark.parametrize("settings", ["friction.mu=0", {"friction.mu": 0}])
def test_a_text_is_one_setting_and_a_mapping_holds_several(settings: Any) -> None:
    """Both reach the robot that is simulated."""
    assert ReachEnv("neuroendoscope_section", settings).plant.specified.friction.mu == 0.0


@pytest.fixture(scope="module")
def section() -> Iterator[ReachEnv]:
    env = ReachEnv("neuroendoscope_section")
    yield env
    env.close()


@pytest.mark.parametrize(
    "action",
    [
        np.array([math.nan, 0.0]),
        np.zeros(3),
        np.zeros((2, 1)),
        np.zeros(2, complex),
        np.zeros(100_000),
        None,
        "ab",
        [[1], [1, 2]],
        [object(), 1.0],
        {"left": 1.0},
    ],
)
def test_a_wrong_action_is_one_line(section: ReachEnv, action: Any) -> None:
    """Whatever is no array of two numbers; the line is short, and nothing moves."""
    section.reset(seed=0)
    before = section.plant.simulator.data.qpos.copy()
    line = refusal(section.step, action)
    assert line.startswith("action = ")
    assert line.endswith(": 2 numbers are needed")
    assert len(line) < 120
    assert np.array_equal(section.plant.simulator.data.qpos, before)
    assert section.step(np.zeros(2))[0] in section.observation_space


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (5, "options = 5: a mapping is needed; its keys: target"),
        ("target", "options = 'target': a mapping is needed"),
        ([1], "options = [1]: a mapping is needed"),
        ({"goal": 1}, "unknown option of reset 'goal'; choices: target"),
        ({5: 1}, "unknown option of reset 5; choices: target"),
        ({"target": "abc"}, "target = 'abc': three finite numbers are needed"),
        ({"target": (0.0, 0.0, math.nan)}, "target = (0.0, 0.0, nan): three finite numbers"),
    ],
)
def test_wrong_options_of_reset_are_one_line(section: ReachEnv, options: Any, told: str) -> None:
    """What is no mapping, an unknown key, a target that is none."""
    assert told in refusal(section.reset, options=options)


def test_unknown_option_leaves_the_episode_as_it_was(section: ReachEnv) -> None:
    """It neither seeds nor moves anything."""
    section.reset(seed=4)
    target, state = section.target_m, section.np_random.bit_generator.state
    refusal(section.reset, seed=5, options={"goal": 1})
    assert np.array_equal(section.target_m, target)
    assert section.np_random.bit_generator.state == state
    section.step(np.zeros(2))


@pytest.mark.parametrize("seed", [-1, 1.5, "a", [1]])
def test_a_wrong_seed_is_gymnasiums_own_error(section: ReachEnv, seed: Any) -> None:
    """In one line; a huge seed is a seed."""
    with pytest.raises(gymnasium.error.Error) as caught:
        section.reset(seed=seed)
    assert "\n" not in str(caught.value)
    section.reset(seed=10**40)


NEW_ENVIRONMENTS = [pytest.param(name, marks=() if name == SECTION else pytest.mark.slow) for name in IDS]


@pytest.mark.parametrize("name", NEW_ENVIRONMENTS)
def test_a_step_before_a_reset_is_refused(name: str) -> None:
    """By every environment itself, without Gymnasium's wrapper that keeps the order."""
    env = gymnasium.make(name).unwrapped
    with pytest.raises(gymnasium.error.ResetNeeded, match="needs a reset before it"):
        env.step(np.zeros(env.action_space.shape, np.float32))
    env.reset(seed=0)
    env.step(np.zeros(env.action_space.shape, np.float32))


@pytest.mark.slow
def test_a_first_reset_of_some_leaves_the_others_unready() -> None:
    """Stepped together they wait for theirs; one by one the first reset has to be one of all."""
    some = {"reset_mask": np.array([True, False])}
    many = gymnasium.make_vec(SECTION, num_envs=2, vectorization_mode="vector_entry_point", threads=1)
    many.reset(seed=0, options=some)
    with pytest.raises(gymnasium.error.ResetNeeded, match="a reset of every environment"):
        many.step(np.zeros((2, 2)))
    apart = OneByOneEnv([partial(ReachEnv, "neuroendoscope_section")] * 2, 1, AutoresetMode.NEXT_STEP)
    assert refusal(apart.reset, options=some) == "reset_mask: the first reset is one of all environments"
    for env in (many, apart):
        env.reset(seed=0)
        env.reset(options=some)
        env.step(np.zeros((2, 2)))
        env.close()


@pytest.mark.slow
@pytest.mark.parametrize("name", [SECTION, "catheter_sim/NeuroendoscopeTumour-v0"])
def test_many_are_stepped_only_after_a_reset_of_all(name: str) -> None:
    """Stepped together or one by one; wrong actions, seeds and masks of either are one line."""
    many = gymnasium.make_vec(name, num_envs=2, vectorization_mode="vector_entry_point", threads=2)
    rest = np.zeros(many.action_space.shape)
    with pytest.raises(gymnasium.error.ResetNeeded):
        many.step(rest)
    many.reset(seed=0)
    shape = many.action_space.shape
    for actions in (None, "ab", rest[:1], rest[:, :1], [object(), 1], np.full(shape, math.nan)):
        assert "numbers are needed" in refusal(many.step, actions)
    for seed in (1.5, "ab", [1], [1, -1], {1: 2}, -1):
        assert refusal(many.reset, seed=seed).startswith("seed")
    for options in (5, {"goal": 1}, {"reset_mask": [True, True]}, {"reset_mask": np.zeros(2, bool)}):
        refusal(many.reset, options=options)
    many.step(rest)
    many.close()


@pytest.mark.parametrize("name", NEW_ENVIRONMENTS)
def test_info_names_the_units_of_files(name: str) -> None:
    """Every length, angle, force and speed of `info` says its unit at its name's end, as files do."""
    env = gymnasium.make(name).unwrapped
    infos = [env.reset(seed=0)[1], env.step(np.zeros(env.action_space.shape, np.float32))[4]]
    bare = {"is_success", "diverged", "pressed_too_hard", "points_reached"}
    for info in infos:
        for key in info:
            assert key in bare or key.endswith(("_mm", "_deg", "_N", "_mm_per_s")), key
    assert isinstance(env, tip.TipEnv)
    assert infos[1]["tip_mm"] == pytest.approx(1e3 * env.plant.posture().p_w[-1], abs=1e-9)
    assert infos[1]["target_mm"] == pytest.approx(1e3 * env.target_m, abs=1e-9)
    distance = np.linalg.norm(infos[1]["tip_mm"] - infos[1]["target_mm"])
    assert infos[1]["distance_mm"] == pytest.approx(distance, abs=1e-9)


class _Built(BaseException):
    """All arguments were taken, and the robot is to be simulated."""


JUNK: tuple[Any, ...] = (
    *(None, True, 0, -1, 7, 2.5, math.nan, -math.inf, 10**400, 1 + 2j, "", "x", "a\nb", "a\0.toml", b"x"),
    *((), [], [1], (0.0, 1.0), [[1], [1, 2]], {}, {"a": 1}, {1: (0, 1)}, {"friction.mu": (0.1, 0.2)}),
    *(object(), MATRIX, np.zeros(3), np.array(["a"]), range(3), len, {"friction.mu": 0}, "friction.mu=0"),
    *("rgb_array", "pixels", "displacement", 64, 1e-3, {"friction.mu": math.inf}, ["friction.mu=1", "x"]),
)


GOOD: dict[str, Any] = {
    "settings": {"friction.mu": 0.1},
    "action_type": "displacement",
    "gravity_mps2": [0, 0, -9.81],
    "tolerance_m": np.float32(1e-3),
    "largest_bend_rad": 1,
    "render_mode": "rgb_array",
    "width": 48,
    "height": np.int64(32),
    "observation": "pixels",
    "randomised": {"friction.mu": np.array([0.1, 0.2])},
    "hold_steps": 3,
}


def test_random_arguments_end_in_a_robot_or_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """300 draws of one to four keywords, half with any values (seed 15); nothing else is ever raised."""

    def build(*arguments: Any, **named: Any) -> Any:
        raise _Built

    monkeypatch.setattr(tip, "Plant", build)
    rng = np.random.default_rng(15)
    names = [*argument_names(ReachEnv), "tolerance", "threads"]
    names.remove("robot")
    lines, built = [], 0
    for _ in range(300):
        arguments: dict[str, Any] = {"robot": "neuroendoscope_section"}
        for name in map(str, rng.choice(names, size=rng.integers(1, 5), replace=False)):
            any_value = JUNK[int(rng.integers(len(JUNK)))]
            arguments[name] = GOOD[name] if name in GOOD and rng.random() < 0.5 else any_value
        if rng.random() < 0.1:
            arguments["robot"] = JUNK[int(rng.integers(len(JUNK)))]
        try:
            ReachEnv(**arguments)
        except _Built:
            built += 1
        except InputError as error:
            lines.append(str(error))
    assert built > 30
    assert len(lines) == 300 - built
    assert not [line for line in lines if "\n" in line or "--set" in line or len(line) > 600]
