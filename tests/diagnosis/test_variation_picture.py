"""The picture of how numbers vary."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.diagnosis.pictures import variation_figure
from catheter_sim.diagnosis.result import Cause, FittedParameter

ROBOT = load_robot("mitral_4dof")


def diagnosed(*corrections: Cause) -> SimpleNamespace:
    """Return what the picture reads of a diagnosis: its causes, a robot, and trials of 80 s."""
    return SimpleNamespace(
        dataset=SimpleNamespace(robot=ROBOT),
        fits=(SimpleNamespace(time_s=np.array([5.0, 85.0])),),
        causes=(),
        corrections=corrections,
    )


def correction(name: str, **values: tuple[float, float, float]) -> Cause:
    """Return a correction with numbers and their intervals."""
    found = {key: FittedParameter(value, (low, high)) for key, (value, low, high) in values.items()}
    return Cause(name, found, 10.0)


def test_a_step_in_time_is_drawn_as_a_step() -> None:
    """A gain of 0.9 that falls by 0.2 at 30 s, and its band, over the longest trial."""
    gain = correction(
        "actuation_gain", **{"scale": (0.9, 0.88, 0.92), "scale~time.step(30)": (-0.2, -0.25, -0.15)}
    )
    figure = variation_figure(diagnosed(gain))  # type: ignore[arg-type]
    (axes,) = figure.axes
    time_s, values = axes.lines[0].get_data()
    assert (time_s[0], time_s[-1]) == (0.0, 80.0)
    assert values == pytest.approx(np.where(time_s > 30.0, 0.7, 0.9))
    band = axes.collections[0].get_paths()[0].vertices[:, 1]
    assert (band.min(), band.max()) == pytest.approx((0.65, 0.9))
    assert (axes.get_xlabel(), axes.get_title()) == ("time [s]", "actuation gain: scale")


def test_a_curve_and_a_number_without_a_value_of_its_own() -> None:
    """Hats join in straight lines; a shift that is not fitted itself starts at what does nothing."""
    drift = correction(
        "drift",
        **{"shift_mm~time.hat(0,20,40)": (0.4, 0.3, 0.5), "shift_mm~time.hat(20,40,40)": (0.1, 0.0, 0.2)},
    )
    figure = variation_figure(diagnosed(drift))  # type: ignore[arg-type]
    time_s, values = figure.axes[0].lines[0].get_data()
    assert np.interp([0.0, 10.0, 20.0, 30.0, 40.0], time_s, values) == pytest.approx(
        [0.0, 0.2, 0.4, 0.25, 0.1], abs=5e-3
    )


def test_without_a_number_that_varies_there_is_no_picture() -> None:
    assert variation_figure(diagnosed(correction("stiffness", scale=(0.9, 0.8, 1.0)))) is None  # type: ignore[arg-type]
