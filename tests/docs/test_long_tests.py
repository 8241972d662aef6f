"""Claims about the tests that run apart: they have been run, they passed, and their table is of these."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import pytest

from tests.scripts_as_modules import script_module

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def script() -> ModuleType:
    return script_module("long_tests")


def counts(line: str) -> list[int]:
    """Return cases, passed, skipped and failed of a line of the table."""
    return [int(cell) for cell in line.split("|")[2:6]]


def test_every_long_test_has_been_run_and_passed(script):
    """A file with such tests has a line in docs/truth/long_tests.md; no line fails, or skips all."""
    lines = script.kept_lines()
    assert sorted(lines) == script.files_with_long_tests()
    for file, line in lines.items():
        cases, passed, skipped, failed = counts(line)
        assert (failed, passed + skipped) == (0, cases), file
        assert passed, file


def test_a_report_is_counted_by_file(script, tmp_path, monkeypatch):
    """A failure and an error fail, a skip is none; the rows of a class go to its file."""
    monkeypatch.setattr(script, "files_with_long_tests", lambda: ["tests/a/test_b.py", "tests/a/test_bc.py"])
    cases = (
        ("tests.a.test_b", ""),
        ("tests.a.test_b", "<failure/>"),
        ("tests.a.test_b.TestIt", "<error/>"),
        ("tests.a.test_bc", "<skipped/>"),
    )
    body = "".join(
        f'<testcase classname="{name}" name="t" time="30.0">{inner}</testcase>' for name, inner in cases
    )
    (tmp_path / "report.xml").write_text(f"<testsuites><testsuite>{body}</testsuite></testsuites>")
    rows = script.rows_of(tmp_path / "report.xml", "0123456789")
    assert counts(rows["tests/a/test_b.py"].text()) == [3, 1, 0, 2]
    assert "| 1.5 | `0123456789` |" in rows["tests/a/test_b.py"].text()
    assert counts(rows["tests/a/test_bc.py"].text()) == [1, 0, 1, 0]
