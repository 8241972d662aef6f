"""What a stranger looks for first is there, and says one thing everywhere."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import catheter_sim

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def text_of(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def test_version_stands_in_one_place() -> None:
    """The build reads it from the package; the citation and the changes name the same."""
    assert "version" in PROJECT["project"]["dynamic"]
    assert PROJECT["tool"]["hatch"]["version"]["path"] == "catheter_sim/__init__.py"
    assert re.search(r"^version: (.+)$", text_of("CITATION.cff"), re.MULTILINE)[1] == catheter_sim.__version__
    assert f"\n## {catheter_sim.__version__}\n" in text_of("CHANGELOG.md")


def test_the_package_is_typed() -> None:
    """PEP 561: type checkers of others read our types."""
    assert (ROOT / "catheter_sim" / "py.typed").is_file()


def test_pythons_are_those_that_are_tried() -> None:
    """Classifiers, requires-python, set-up and the workflow name the same versions."""
    tried = {"3.11", "3.12", "3.13", "3.14"}
    named = {item.rsplit(" ", 1)[-1] for item in PROJECT["project"]["classifiers"] if "Python :: 3." in item}
    assert named == tried
    assert PROJECT["project"]["requires-python"] == ">=3.11"
    assert "sys.version_info < (3, 11)" in text_of("scripts/setup.sh")
    assert all(f"python{version}" in text_of("scripts/setup.sh") for version in tried)
    assert all(f'"{version}"' in text_of(".github/workflows/ci.yml") for version in tried)


def test_the_workflow_calls_scripts_that_are_there() -> None:
    """A public host runs what a contributor runs."""
    called = set(re.findall(r"scripts/\w+\.sh", text_of(".github/workflows/ci.yml")))
    assert called == {"scripts/test.sh", "scripts/docs.sh", "scripts/package.sh", "scripts/demo.sh"}
    assert all((ROOT / name).is_file() for name in called)
    assert all(name in text_of("CONTRIBUTING.md") for name in called - {"scripts/demo.sh"})
