"""Claims about the checks of the mitral catheters."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from catheter_sim.validation.mitral import validate_4dof, validate_transseptal


@pytest.mark.slow
@pytest.mark.parametrize(("check", "judged"), [(validate_transseptal, 7), (validate_4dof, 6)])
def test_every_line_passes_by_an_order_of_magnitude(check, judged: int, tmp_path: Path) -> None:
    """All judged lines are within a tenth of their tolerance; the findings name what was assumed."""
    validation = check(tmp_path)
    lines = [line for line in validation.lines if line.tolerance is not None]
    assert len(lines) == judged
    for line in lines:
        assert math.isfinite(line.error)
        assert line.error <= 0.1 * line.tolerance, line.quantity
    assert any("constant curvature" in finding for finding in validation.findings)
