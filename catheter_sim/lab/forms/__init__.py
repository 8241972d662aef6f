"""All forms of all causes, by cause."""

from __future__ import annotations

from collections.abc import Mapping

from catheter_sim.lab.engine import LabForm
from catheter_sim.lab.forms import (
    axial,
    elasticity,
    hysteresis,
    inputs,
    loads,
    outside,
    rest_shape,
    timing,
    tracker,
)

# In the order in which forms act on commands: what is sensed and driven first, then what the routing does.
_FILES = (inputs, timing, hysteresis, axial, loads, elasticity, rest_shape, tracker)
FORMS: tuple[LabForm, ...] = tuple(form for file in _FILES for form in file.FORMS)
OUTSIDE: tuple[LabForm, ...] = outside.FORMS
CAUSES: tuple[str, ...] = tuple(dict.fromkeys(form.cause for form in FORMS))
BY_KEY: Mapping[str, LabForm] = {form.key: form for form in (*FORMS, *OUTSIDE)}
