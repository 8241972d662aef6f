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


def test_changes_of_a_version_are_short() -> None:
    """A stranger reads what changed in two minutes: at most 60 lines a version."""
    versions = re.split(r"^## ", text_of("CHANGELOG.md"), flags=re.MULTILINE)[1:]
    assert len(versions) > 1
    assert all(len(item.splitlines()) <= 60 for item in versions)


def test_every_licence_is_listed() -> None:
    """The page names each licence file, and the wheel's expression has those that the wheel holds."""
    files = {
        path.relative_to(ROOT).as_posix()
        for folder in ("assets", "docs/vendor", "tests/data")
        for path in (ROOT / folder).rglob("LICENSE*")
    }
    rows = [line.split("|")[1:-1] for line in text_of("docs/reference/licences.md").splitlines()]
    listed = {row[0].strip().strip("`"): row for row in rows if row and "LICENSE" in row[0]}
    here = {name for name, row in listed.items() if "sdist" in row[4] or (ROOT / name).exists()}
    assert here == files | {"LICENSE"}
    in_wheel = {row[2].strip() for row in listed.values() if "wheel" in row[4]}
    assert in_wheel == set(PROJECT["project"]["license"].split(" AND "))
    outside = ("tests/", "docs/")
    assert all(("wheel" in row[4]) is not name.startswith(outside) for name, row in listed.items())


def test_a_release_is_drafted_from_what_is_there() -> None:
    """Its workflow calls the scripts, and its notes are cut from the version's own heading."""
    text = text_of(".github/workflows/release.yml")
    assert set(re.findall(r"scripts/\w+\.sh", text)) == {"scripts/test.sh", "scripts/package.sh"}
    assert "CHANGELOG.md" in text
    forms = sorted((ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml"))
    assert len(forms) == 4
    assert (ROOT / ".github" / "PULL_REQUEST_TEMPLATE.md").is_file()
