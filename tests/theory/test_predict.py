"""Every kind's twin: it agrees with the kind's reference model, and effects and columns are put around it."""

from __future__ import annotations

import pickle
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.channels import output_channels, outputs_of
from catheter_sim.core.effect import Effect, Form, Parameter, Stage
from catheter_sim.core.inputs import Inputs, numbers_of, slice_inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.effects import EFFECTS
from catheter_sim.effects.apply import with_effects
from catheter_sim.robots import KINDS, kind_of
from catheter_sim.robots.continuum.twin import arcs_of, in_parts
from catheter_sim.theory.static_models import STATIC_MODELS
from catheter_sim.theory.twins import by_static_model, twin_for

NO_GRAVITY = np.zeros(3)
TIP = ("tip_x_mm", "tip_y_mm", "tip_z_mm")


@dataclass(frozen=True)
class Case:
    """A robot, how it is driven, and the static model that its twin stands for.

    Attributes:
        peak: the largest input of each tendon, SI.
        share: of the robot's length by which a tip may differ from the static model's.
        beyond: which inputs the robot cannot bear, "force_tip" or "tendon", and which they are, SI.
    """

    robot: str
    actuation: str
    peak: Sequence[float]
    model: str
    share: float
    beyond: tuple[str, Sequence[float]] | None = None


CASES = [
    Case("neuroendoscope_section", "tension", (0.3, 0.05), "fkm_exact_arm", 1e-3),
    Case("neuroendoscope_section", "displacement", (1.5e-3, -1.5e-3), "CC", 2e-2),
    Case("spacer_disk", "tension", (16.0, 4.0, 0.0, 8.0), "CC_sub", 5e-3),
    Case("chest_tube_section", "tension", (20.0,), "complete", 1e-6, ("force_tip", (0.0, 0.0, -2000.0))),
    Case(
        "mitral_transseptal",
        "displacement",
        (2e-3, 1e-3, 1e-3, 20e-3),
        "balance",
        1e-9,
        ("tendon", (1.0, 0.0, 0.0, 0.0)),
    ),
    Case(
        "mitral_4dof",
        "displacement",
        (1e-3, -1e-3, 1e-3, 20e-3),
        "balance",
        1e-9,
        ("tendon", (0.0, 1.0, 0.0, 0.0)),
    ),
    Case("notched_wrist", "tension", (2.5,), "kinetostatic", 1e-3),
]


def named(case: Case) -> str:
    return f"{case.robot}-{case.actuation}"


def loaded(case: Case) -> RobotSpec:
    return replace(load_robot(case.robot), actuation=case.actuation)


def there_and_back(case: Case) -> Inputs:
    """Return rows up and half way back."""
    share = np.array([0.0, 0.25, 0.5, 0.75, 1.0, 0.75, 0.5])
    nothing = np.zeros((len(share), 3))
    return Inputs(
        np.arange(float(len(share))), case.actuation, share[:, None] * np.array(case.peak), nothing, nothing
    )


def test_every_kind_has_a_twin_that_is_tested() -> None:
    """No kind is left out of the cases here."""
    assert {kind_of(load_robot(case.robot)).name for case in CASES} == set(KINDS)


def test_no_two_static_models_have_one_name() -> None:
    """The command line knows a model by its name alone."""
    names = [model.name for kind in KINDS.values() for model in kind.statics.MODELS]
    assert names == list(STATIC_MODELS)


def beyond_it(case: Case) -> Inputs:
    """Return the rows, the third of which the robot cannot bear."""
    inputs = there_and_back(case)
    assert case.beyond is not None
    name, values = case.beyond
    rows = np.array(getattr(inputs, name))
    rows[2] = values
    return replace(inputs, **{name: rows})


@pytest.mark.parametrize("case", CASES, ids=named)
def test_a_twin_is_where_the_static_model_is(case: Case) -> None:
    """At every row, to a share of the length that the robot's middle is moved by many times."""
    robot, inputs = loaded(case), there_and_back(case)
    ours = twin_for(robot, case.actuation, TIP, NO_GRAVITY)([robot], inputs)[0]
    if case.model == "CC":  # of which a segment with friction or under a load is several
        robot = in_parts(robot, arcs_of(robot))
    theirs = by_static_model(case.model, robot, TIP, NO_GRAVITY)([robot], inputs)[0]
    length_mm = 1e3 * sum(segment.length_m for segment in robot.segments)
    assert np.abs(ours - theirs).max() < case.share * length_mm
    assert np.ptp(ours, axis=0).max() > 5.0 * case.share * length_mm


@pytest.mark.parametrize("case", CASES, ids=named)
def test_states_have_the_shapes_that_are_asked_for(case: Case) -> None:
    """Two robots, every third row, two elements or none; positions in metres, orientations orthonormal."""
    robot, inputs = loaded(case), there_and_back(case)
    outputs = outputs_of(robot)
    twin = kind_of(robot).twin.twin(robot, case.actuation)
    robots = [robot, replace(robot, stiffness_scale=1.2)]
    last = outputs.elements - 1
    states = twin.solve(robots, [inputs, inputs], NO_GRAVITY, (last // 2, last), 3)
    assert states.p_w.shape == (2, 3, 2, 3)
    assert states.R_w.shape == (2, 3, 2, 3, 3)
    assert states.R_w @ states.R_w.swapaxes(-1, -2) == pytest.approx(
        np.broadcast_to(np.eye(3), (2, 3, 2, 3, 3))
    )
    assert states.joint_angles().shape == (2, 3, len(outputs.joints))
    assert states.tension.shape == (2, 3, len(robot.tendons))
    alone = twin.solve(robots, [inputs, inputs], NO_GRAVITY, (), 3)
    assert alone.p_w.shape == (2, 3, 0, 3)
    assert np.array_equal(alone.tension, states.tension)
    assert np.array_equal(alone.joint_angles(), states.joint_angles())


@pytest.mark.parametrize("case", CASES, ids=named)
def test_rows_left_out_make_the_history_all_the_same(case: Case) -> None:
    """Every third row of all is what every third row shows, in every column that the robot has."""
    robot, inputs = loaded(case), there_and_back(case)
    twin = twin_for(robot, case.actuation, output_channels(robot), NO_GRAVITY)
    all_rows = twin([robot], inputs)
    assert np.isfinite(all_rows).all()
    assert twin([robot], inputs, 3) == pytest.approx(all_rows[:, ::3], abs=1e-9)


@pytest.mark.parametrize("case", [case for case in CASES if case.beyond], ids=named)
def test_a_robot_without_balance_is_missing_and_spares_the_others(case: Case) -> None:
    """NaN in all that depends on it; the robot beside it is where it is alone."""
    robot, inputs = loaded(case), there_and_back(case)
    twin = kind_of(robot).twin.twin(robot, case.actuation)
    elements = (0, outputs_of(robot).elements - 1)
    both = twin.solve([robot, robot], [beyond_it(case), inputs], NO_GRAVITY, elements, 1)
    alone = twin.solve([robot], [inputs], NO_GRAVITY, elements, 1)
    for states, alike in ((both.p_w, alone.p_w), (both.R_w, alone.R_w), (both.tension, alone.tension)):
        assert np.isnan(states[0]).any()
        assert np.array_equal(states[1], alike[0])
    assert np.isnan(both.joint_angles()[0]).any()


def test_one_by_one_a_robot_without_balance_is_missing() -> None:
    """A static model's error is no error of a fit."""
    case = CASES[3]
    robot, inputs = loaded(case), there_and_back(case)
    prediction = by_static_model("complete", robot, output_channels(robot), NO_GRAVITY)
    assert np.isnan(prediction([robot], beyond_it(case))).all()
    assert np.isfinite(prediction([robot], inputs)).all()


@pytest.mark.parametrize("case", CASES, ids=named)
def test_a_twin_goes_to_other_processes(case: Case) -> None:
    """Sent and received it says the same."""
    robot, inputs = loaded(case), slice_inputs(there_and_back(case), slice(0, 3))
    twin = twin_for(robot, case.actuation, (*TIP, "tip_qw"), NO_GRAVITY)
    assert np.array_equal(pickle.loads(pickle.dumps(twin))([robot], inputs), twin([robot], inputs))


def test_what_is_seen_late_is_seen_late_of_every_row(monkeypatch: pytest.MonkeyPatch) -> None:
    """An effect that shows each row's tip one row later does so before rows are left out."""

    class Later:
        """The row before, and at the first row that itself."""

        timed = False

        def start(self, robot: object, values: object, rest: np.ndarray) -> np.ndarray:
            return rest

        def step(self, state: np.ndarray, before: np.ndarray, after: np.ndarray, dt_s: float) -> tuple:
            return after, state

        def series(
            self, robot: object, values: object, rest: np.ndarray, time_s: np.ndarray, rows: np.ndarray
        ) -> np.ndarray:
            return np.concatenate([rest[None], rows[:-1]])

    late = Effect(
        "late",
        summary="shown one row later",
        trace="",
        forms=(
            Form(
                "row",
                "y_k = x_(k - 1)",
                Stage.OBSERVATION,
                parameters=lambda robot: (Parameter("rows", 0.0, 0.0, 1.0, 1.0, 1.0),),
                memory=Later(),
            ),
        ),
    )
    monkeypatch.setitem(EFFECTS, "late", late)
    case = CASES[0]
    robot, inputs = loaded(case), there_and_back(case)
    twin = twin_for(robot, case.actuation, TIP, NO_GRAVITY)
    seen = twin([with_effects(robot, {"late": {"rows": 1.0}})], inputs, 3)[0]
    assert seen[1:] == pytest.approx(twin([robot], inputs)[0, 2::3][: len(seen) - 1])


def test_inputs_that_differ_in_one_number_are_told_apart():
    """A fit computes a repeated trial once: by all its numbers, the forces on bodies among them."""
    zeros = np.zeros((2, 3))
    on_body = (1,), zeros[:, None], zeros[:, None]
    inputs = Inputs(np.arange(2.0), "tension", np.ones((2, 1)), zeros, zeros, *on_body)
    names = ("time_s", "tendon", "force_tip", "moment_tip", "force_body", "moment_body")
    changed = [replace(inputs, **{name: getattr(inputs, name) + 0.5}) for name in names]
    others = [*changed, replace(inputs, bodies=(2,)), replace(inputs, actuation="displacement")]
    assert len({numbers_of(item) for item in (inputs, replace(inputs), *others)}) == 1 + len(others)
