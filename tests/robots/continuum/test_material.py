"""A backbone's stiffness from its material: the numbers of a published robot, and what is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from catheter_sim.catalogue import load_robot
from catheter_sim.errors import InputError
from catheter_sim.resources import assets_folder

EXAMPLE = (assets_folder() / "examples" / "continuum_robot.toml").read_text()
BENDING = "bending_stiffness_N_mm2 = 1560.0 "
TORSION = "torsion_stiffness_N_mm2 = 1180.0 "
MATERIAL = "youngs_modulus_GPa = 211.0\nbackbone_diameter_mm = 0.8\n"


def written(folder: Path, text: str) -> Path:
    path = folder / "robot.toml"
    path.write_text(text)
    return path


def changed(*pairs: tuple[str, str]) -> str:
    """Return the example with its first segment's keys replaced."""
    text = EXAMPLE
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new, 1)
    return text


def test_stiffness_of_the_benchmarks_rod(tmp_path: Path) -> None:
    """E = 211 GPa and d = 0.8 mm (Rao 2021, Table 3) make the built-in benchmark robot's stiffness."""
    text = changed((BENDING, MATERIAL + "poisson_ratio = 0.3 "), (TORSION, "# "))
    segment, other = load_robot(written(tmp_path, text)).segments
    published = load_robot("spacer_disk").segments[0]
    assert segment.bending_stiffness_N_m2 == pytest.approx(published.bending_stiffness_N_m2, rel=1e-9)
    assert segment.torsion_stiffness_N_m2 == pytest.approx(published.torsion_stiffness_N_m2, rel=1e-9)
    assert other.bending_stiffness_N_m2 == pytest.approx(1560e-6)


@pytest.mark.parametrize(
    ("pairs", "message"),
    [
        (((BENDING, BENDING + "\n" + MATERIAL),), "stand for bending_stiffness_N_mm2; leave one of them out"),
        (
            ((BENDING, "youngs_modulus_GPa = 55.0 "),),
            "youngs_modulus_GPa needs backbone_diameter_mm beside it",
        ),
        (((BENDING, MATERIAL.replace("211.0", "-1.0")),), "youngs_modulus_GPa: a number above 0 is needed"),
        (((BENDING, MATERIAL + "poisson_ratio = 0.3 "),), "poisson_ratio stands for torsion_stiffness_N_mm2"),
        (((BENDING, MATERIAL + "poisson_ratio = 2 "), (TORSION, "# ")), "poisson_ratio: a number above -1"),
    ],
)
def test_what_cannot_be_is_refused(pairs: tuple[tuple[str, str], ...], message: str, tmp_path: Path) -> None:
    """The line names the file, the segment and the key."""
    path = written(tmp_path, changed(*pairs))
    with pytest.raises(InputError, match=message) as caught:
        load_robot(path)
    assert str(caught.value).startswith(f"{path}: segments[0]")
