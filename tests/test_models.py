"""The MJCF files in models/ are what the robots build now."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import mujoco
import pytest

from tests.scripts_as_modules import script_module

pytestmark = pytest.mark.xdist_group("models")  # built once


@pytest.fixture(scope="module")
def script() -> ModuleType:
    """The script that writes models/, as a module."""
    return script_module("build_models")


@pytest.fixture(scope="module")
def texts(script: ModuleType) -> dict[str, str]:
    """Every robot's file name and MJCF, built anew."""
    return script.built()


def test_models_are_up_to_date(script: ModuleType, texts: dict[str, str]) -> None:
    """Rebuilding gives the same text; no file is missing or left over."""
    assert script.outdated(texts, script.MODELS) == []


@pytest.mark.slow
def test_building_twice_gives_the_same_text(script: ModuleType, texts: dict[str, str]) -> None:
    """A model's text depends on its robot alone."""
    assert script.built() == texts


def test_stale_missing_and_left_over_files_are_noticed(
    script: ModuleType, texts: dict[str, str], tmp_path: Path
) -> None:
    """Each way of being out of date is told, with the file's name."""
    for name, text in texts.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    assert script.outdated(texts, tmp_path) == []
    first, second, *_ = sorted(texts)
    (tmp_path / first).unlink()
    (tmp_path / second).write_text(texts[second].replace("0.0", "0.1", 1), encoding="utf-8")
    (tmp_path / "snake.xml").write_text("<mujoco/>")
    assert script.outdated(texts, tmp_path) == [
        f"{first}: missing",
        "snake.xml: no robot builds this file",
        f"{second}: not what its robot builds now",
    ]


def test_models_open_in_plain_mujoco(script: ModuleType) -> None:
    """Each file loads by its path, alone."""
    paths = sorted(script.MODELS.glob("*.xml"))
    assert paths
    for path in paths:
        assert mujoco.MjModel.from_xml_path(str(path)).ntendon > 0
