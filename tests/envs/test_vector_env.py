"""Many environments at once: the numbers of single ones, Gymnasium's rules, and what may go wrong."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv

from catheter_sim.envs.tip import DIVERGED_REWARD
from catheter_sim.envs.vector import OneByOneEnv, TogetherEnv
from catheter_sim.errors import InputError
from catheter_sim.units import si_factor

SECTION = "catheter_sim/NeuroendoscopeSectionReach-v0"
STRAIGHT = (0.0, 0.0, 0.06)  # the tip at rest
ELASTIC = ("segments.section.stiffness_quintic_mm4=1e5",)
SLACK = ("effects.backlash.width_N=0.02",)  # an effect on the inputs, which has a history


def vector(name: str = SECTION, count: int = 3, **arguments: Any) -> Any:
    """Return many environments; every warning is an error."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return gymnasium.make_vec(name, count, "vector_entry_point", **{"threads": 2, **arguments})


def singles(name: str = SECTION, count: int = 3, mode: str = "NextStep", **arguments: Any) -> VectorEnv:
    """Return Gymnasium's own loop over single environments."""
    makers = [lambda: gymnasium.make(name, **arguments)] * count
    return SyncVectorEnv(makers, autoreset_mode=AutoresetMode(mode))


def to_si(name: str) -> float:
    """Return the factor to SI of what `info` holds under a name."""
    return si_factor(name.removesuffix("_per_s"))


def worst(one: Any, other: Any) -> float:
    """Return the largest difference of numbers, lengths in m, angles in rad; all else must be the same."""
    if isinstance(one, dict):
        assert one.keys() == other.keys()
        return max((to_si(name) * worst(one[name], other[name]) for name in one), default=0.0)
    if one is None or isinstance(one, tuple):
        assert (one is None) == (other is None)
        return max((worst(*pair) for pair in zip(one or (), other or (), strict=True)), default=0.0)
    one, other = np.asarray(one), np.asarray(other)
    assert (one.shape, one.dtype) == (other.shape, other.dtype)
    if one.dtype == object:
        return worst(tuple(one), tuple(other))
    if one.dtype == bool:
        assert np.array_equal(one, other)
        return 0.0
    return float(np.abs(one.astype(float) - other.astype(float)).max(initial=0.0))


def difference(many: Any, loop: Any, steps: int, seed: Any = 7, **reset: Any) -> float:
    """Return the largest difference between two vector environments under the same random actions."""
    rng = np.random.default_rng(5)
    found = worst(many.reset(seed=seed, **reset), loop.reset(seed=seed, **reset))
    for _ in range(steps):
        action = rng.uniform(-0.3, 1.0, many.action_space.shape).astype(np.float32)
        found = max(found, worst(many.step(action), loop.step(action)))
    return found


@pytest.fixture(scope="module")
def three() -> Iterator[Any]:
    """Three sections whose episodes are truncated after four steps."""
    made = vector(max_episode_steps=4)
    yield made
    made.close()


@pytest.fixture(scope="module")
def alone() -> Iterator[Any]:
    """The same as Gymnasium steps them, one after another."""
    made = singles(max_episode_steps=4)
    yield made
    made.close()


IDS = [
    (f"catheter_sim/{robot}{task}-v0", count)
    for robot, count in (
        ("NeuroendoscopeSection", 2),
        ("Neuroendoscope", 2),
        ("ChestTube", 1),
        ("ChestTubeSection", 2),
        ("MitralTransseptal", 2),
        ("Mitral4dof", 2),
    )
    for task in ("Reach", "Track")
]

LONG = ("catheter_sim/ChestTubeTrack-v0", "catheter_sim/ChestTubeSectionTrack-v0")  # they run apart

TUMOUR = "catheter_sim/NeuroendoscopeTumour-v0"
CLINICAL = (
    pytest.param("NeuroendoscopeTumour", marks=pytest.mark.long),
    "ChestTubeInsert",
    pytest.param("MitralTransseptalDeliver", marks=pytest.mark.long),
    pytest.param("Mitral4dofDeliver", marks=pytest.mark.long),
)


@pytest.mark.slow
def test_numbers_are_those_of_single_environments(three: Any, alone: Any) -> None:
    """Observations, rewards, ends and infos, over truncations and the starts after them."""
    assert isinstance(three, TogetherEnv)
    assert difference(three, alone, 11) < 1e-9


def tips(many: Any, steps: int) -> np.ndarray:
    """Return where the tips of copies are after each of so many random steps, shape (steps, n, 3) [mm]."""
    rng = np.random.default_rng(5)
    many.reset(seed=7)
    seen = []
    for _ in range(steps):
        action = rng.uniform(-1.0, 1.0, many.action_space.shape).astype(np.float32)
        seen.append(many.step(action)[4]["tip_mm"].copy())
    many.close()
    return np.array(seen)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["Neuroendoscope", "ChestTubeSection", "Mitral4dof"])
def test_the_same_seed_and_number_give_the_same_bits(name: str) -> None:
    """In another object, on another number of threads: what the guide says."""
    full = f"catheter_sim/{name}Reach-v0"
    one, other = (tips(vector(full, threads=threads), 12) for threads in (1, 2))
    assert np.array_equal(one, other)


@pytest.mark.slow
def test_friction_alone_makes_copies_differ_from_single_environments() -> None:
    """Over 60 steps: rounding stays rounding without friction; with it, it grows, but not to what matters."""
    name = "catheter_sim/NeuroendoscopeReach-v0"
    apart = {}
    for mu in (0.0, 0.3):
        settings = {"friction.mu": mu}
        many, loop = (make(name, 2, settings=settings) for make in (vector, singles))
        apart[mu] = np.abs(tips(many, 60) - tips(loop, 60)).max()
    assert apart[0.0] < 1e-11
    assert apart[0.0] < apart[0.3] < 0.05


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "count"),
    [pytest.param(*item, marks=[pytest.mark.long] if item[0] in LONG else []) for item in IDS],
)
def test_numbers_of_every_id_are_those_of_single_environments(name: str, count: int) -> None:
    """All registered tasks of the six robots, with a truncation and a second start."""
    many, loop = (make(name, count, max_episode_steps=3) for make in (vector, singles))
    assert isinstance(many, TogetherEnv)
    assert difference(many, loop, 5) < 1e-9
    many.close()
    loop.close()


@pytest.mark.slow
@pytest.mark.parametrize("name", CLINICAL)
def test_numbers_of_the_clinical_tasks_are_those_of_single_environments(name: str) -> None:
    """Whole environments on threads: anatomies, contacts, forces; with a truncation and a second start."""
    many, loop = (make(f"catheter_sim/{name}-v0", 2, max_episode_steps=2) for make in (vector, singles))
    assert isinstance(many, OneByOneEnv)
    assert difference(many, loop, 4) == 0.0
    for env in (many, loop):
        assert not np.array_equal(*env.reset(seed=[1, 2])[0])
        env.close()


@pytest.mark.long
def test_robots_that_differ_are_built_on_threads_at_once() -> None:
    """Each copy has its own robot in its own anatomy, as its seed says."""
    drawn = {"randomised": {"friction.mu": (0.1, 0.5), "effects.stiffness.scale": (0.8, 1.25)}}
    many, loop = (make(TUMOUR, 3, max_episode_steps=2, **drawn) for make in (vector, singles))
    assert difference(many, loop, 3) == 0.0
    frictions = {env.unwrapped.plant.specified.friction.mu for env in many.envs}
    assert len(frictions) == 3
    for env in (many, loop):
        env.close()


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["SameStep", "Disabled"])
def test_other_ways_to_start_anew_are_gymnasiums(alone: Any, mode: str) -> None:
    """The last observation and info of an episode come with the first of the next; or nothing starts."""
    many = vector(max_episode_steps=4, autoreset_mode=mode)
    assert many.metadata["autoreset_mode"] is AutoresetMode(mode)
    alone.autoreset_mode = AutoresetMode(mode)
    try:
        assert difference(many, alone, 6 if mode == "SameStep" else 4) < 1e-9
    finally:
        alone.autoreset_mode = AutoresetMode.NEXT_STEP
    action = np.zeros(many.action_space.shape, np.float32)
    if mode == "Disabled":
        many.reset(options={"reset_mask": np.array([True, False, False])})
        with pytest.raises(InputError, match="environments 1, 2 have ended"):
            many.step(action)
    many.close()


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments",
    [
        pytest.param({"action_type": "displacement"}, marks=pytest.mark.slow),
        pytest.param({"settings": ("friction.mu=0",)}, marks=pytest.mark.slow),
        pytest.param({"settings": ELASTIC, "gravity_mps2": (1.0, 0.0, -9.0)}, marks=pytest.mark.slow),
        {"settings": SLACK},
    ],
    ids=["displacement", "no friction", "elastic law and weight", "one by one"],
)
def test_other_robots_have_the_numbers_of_single_ones(arguments: dict[str, Any]) -> None:
    """Other actuation, other laws, and those for which environments are stepped one by one."""
    many, loop = (make(count=2, max_episode_steps=3, **arguments) for make in (vector, singles))
    assert isinstance(many, OneByOneEnv if arguments.get("settings") == SLACK else TogetherEnv)
    assert difference(many, loop, 5) < 1e-9
    mask = np.array([False, True])
    assert worst(*(env.reset(seed=9, options={"reset_mask": mask}) for env in (many, loop))) < 1e-9
    many.close()
    loop.close()


@pytest.mark.slow
def test_threads_do_not_matter(three: Any) -> None:
    """Two threads, or more than environments: the same to the bit."""
    many = vector(threads=5, max_episode_steps=4)
    assert difference(three, many, 6) == 0.0
    many.close()


def test_seeds_are_gymnasiums(three: Any, alone: Any) -> None:
    """A seed stands for itself and its successors; a list for its numbers; without one it goes on."""
    first, _ = three.reset(seed=3)
    assert three.np_random_seed == (3, 4, 5)
    again, _ = three.reset(seed=[3, 4, 5])
    assert np.array_equal(first, again)
    onward, _ = three.reset()
    single = alone.envs[1]
    assert np.array_equal(single.reset(seed=4)[0], first[1])
    assert np.array_equal(single.reset()[0], onward[1])
    assert not np.array_equal(onward, first)


@pytest.mark.slow
def test_targets_drawn_ahead_are_forgotten_where_a_generator_was_used(three: Any, alone: Any) -> None:
    """A copy's generator is its user's: what was drawn ahead does not outlive other draws from it."""
    for many in (three, alone):
        many.reset(seed=1)
        many.reset(options={"reset_mask": np.array([True, False, False])})  # draws for the others ahead
        many.np_random[1].random()
        many.np_random[2].random(7)
    assert worst(three.reset(), alone.reset()) < 1e-9


def test_some_are_reset_and_the_others_go_on(three: Any, alone: Any) -> None:
    """`reset_mask` chooses; the others' episodes are truncated when their time has come."""
    mask = {"reset_mask": np.array([False, True, False])}
    action = np.full(three.action_space.shape, 0.5, np.float32)
    for many in (three, alone):
        many.reset(seed=1)
        for _ in range(3):
            many.step(action)
    begun = three.reset(seed=8, options=mask)
    assert list(mask) == ["reset_mask"]  # Gymnasium's own takes it away
    assert worst(begun, alone.reset(seed=8, options=mask)) < 1e-9
    ends = three.step(action)
    assert worst(ends, alone.step(action)) < 1e-9
    assert ends[3].tolist() == [True, False, True]


def test_one_target_for_all_can_be_set(three: Any) -> None:
    """`options["target"]` is every copy's; unknown options are refused."""
    _, info = three.reset(seed=0, options={"target": STRAIGHT})
    assert np.array_equal(info["target_mm"], 1e3 * np.array([STRAIGHT] * 3))
    with pytest.raises(InputError, match="unknown option of reset 'goal'; choices: target"):
        three.reset(options={"goal": STRAIGHT})


@pytest.mark.slow
def test_a_copy_succeeds_when_it_has_been_held_long_enough() -> None:
    """At the target from the start, one copy is moved away: only the others' fifth step is their last."""
    many, loop = vector(), singles()
    starts = [env.reset(seed=0, options={"target": STRAIGHT}) for env in (many, loop)]
    assert worst(*starts) < 1e-9
    action = np.zeros(many.action_space.shape, np.float32)
    action[1, 0] = 1.0
    for step in range(1, 8):
        one, other = many.step(action), loop.step(action)
        assert worst(one, other) < 1e-9
        assert one[2].tolist() == one[4]["is_success"].tolist() == [step == 5, False, step == 5]
    many.close()
    loop.close()


@pytest.mark.slow
def test_a_copy_that_diverges_leaves_the_others_alone(three: Any) -> None:
    """It terminates with the price of that and its last finite observation, and starts anew."""
    many, calm = vector(threads=1, max_episode_steps=4), three
    action = np.full(many.action_space.shape, 0.5, np.float32)
    for env in (many, calm):
        env.reset(seed=0)
        before = env.step(action)[0]
    many._fleet._parts[0]._copies.qvel[1, 3] = math.nan
    observation, reward, terminated, truncated, info = many.step(action)
    expected = calm.step(action)
    assert (terminated.tolist(), truncated.any()) == ([False, True, False], False)
    assert info["diverged"].tolist() == [False, True, False]
    assert reward[1] == DIVERGED_REWARD
    assert np.array_equal(observation[1], before[1])
    others = [0, 2]
    assert np.array_equal(observation[others], expected[0][others])
    assert np.array_equal(reward[others], expected[1][others])
    observation, reward, terminated, _, info = many.step(action)
    assert not terminated.any()
    assert not info["diverged"].any()
    assert np.array_equal(observation[others], calm.step(action)[0][others])
    assert reward[1] == 0.0
    many.close()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"threads": 0}, "threads = 0: must be a whole number, 1 or more"),
        ({"threads": 1.5}, "threads = 1.5: must be"),
        ({"count": 0}, "num_envs = 0: must be"),
        ({"max_episode_steps": -1}, "max_episode_steps = -1: must be"),
        (
            {"autoreset_mode": "never"},
            "unknown autoreset_mode 'never'; choices: NextStep, SameStep, Disabled",
        ),
        ({"observation": "smell"}, "unknown observation 'smell'; choices: state, pixels"),
    ],
)
def test_bad_arguments_are_refused(arguments: dict[str, Any], message: str) -> None:
    """One line that names the argument and what it may be."""
    with pytest.raises(InputError, match=message):
        vector(**arguments)


def test_bad_actions_masks_and_seeds_are_refused(three: Any, alone: Any) -> None:
    """Wrong shapes, NaN, a mask that chooses none; a bad action moves nothing."""
    three.reset(seed=0)
    nan = np.zeros(three.action_space.shape)
    nan[2, 0] = math.nan
    for action in (np.zeros(2), nan):
        with pytest.raises(InputError, match=r"actions: \(3, 2\) numbers are needed"):
            three.step(action)
    for mask in (np.zeros(3, bool), np.ones(2, bool), [True, True, True]):
        with pytest.raises(InputError, match="reset_mask: "):
            three.reset(options={"reset_mask": mask})
    with pytest.raises(InputError, match="seed: 2 numbers are given, 3 are needed"):
        three.reset(seed=[1, 2])
    alone.reset(seed=0)
    rest = np.zeros(three.action_space.shape, np.float32)
    assert worst(three.step(rest), alone.step(rest)) < 1e-9


def test_observations_lie_in_their_space(three: Any) -> None:
    """Batched spaces are those of the single environment, n times."""
    observation, _ = three.reset(seed=0)
    assert observation in three.observation_space
    assert three.observation_space.shape == (3, *three.single_observation_space.shape)
    assert three.step(three.action_space.sample())[0] in three.observation_space


@pytest.mark.slow
def test_pixels_are_those_of_single_environments() -> None:
    """64x64 pictures of every copy by one renderer, byte by byte; `render` gives the same."""
    arguments = {"observation": "pixels", "render_mode": "rgb_array"}
    many, loop = vector(count=2, **arguments), singles(count=2, **arguments)
    action = np.full(many.action_space.shape, (1.0, -1.0), np.float32)
    for env in (many, loop):
        seen, _ = env.reset(seed=0)
    assert seen.shape == (2, 64, 64, 3)
    for _ in range(3):
        seen, shown = many.step(action)[0], loop.step(action)[0]
        assert seen.dtype == np.uint8
        assert np.array_equal(seen, shown)
    assert np.array_equal(many.render(), seen)
    assert not np.array_equal(seen[0], seen[1])
    for env in (many, loop):
        env.close()


@pytest.mark.slow
def test_pixels_of_what_was_never_reset_are_black() -> None:
    """The first reset may be of some copies only."""
    env = vector(count=2, observation="pixels")
    seen, _ = env.reset(seed=0, options={"reset_mask": np.array([False, True])})
    assert not seen[0].any()
    assert seen[1].any()
    env.close()


@pytest.mark.slow
def test_gymnasium_finds_nothing_to_complain_about_in_pixels() -> None:
    """`check_env` passes with pictures as observations."""
    env = gymnasium.make(SECTION, observation="pixels", width=48, height=32).unwrapped
    assert env.observation_space == gymnasium.spaces.Box(0, 255, (32, 48, 3), np.uint8)
    check_env(env, skip_render_check=True)
    env.close()
