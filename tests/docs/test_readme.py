"""The README is short, its figures are those of the pages, and the pages' those of kept results."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
DOCS = ROOT / "docs"
MOST_BYTES = 8192


def page(name: str) -> str:
    return (DOCS / name).read_text(encoding="utf-8")


def table() -> dict[str, list[str]]:
    """Return the cells of the README's table by its first cell."""
    text = README.split("<!-- validation:")[1].split("-->", 1)[1].split("<!-- validation ends")[0]
    rows = [line.strip("|").split("|") for line in text.strip().splitlines()[2:]]
    return {row[0].strip(): [cell.strip() for cell in row[1:]] for row in rows}


def ours(what: str) -> str:
    (found,) = [cells[0] for name, cells in table().items() if name.startswith(what)]
    return found


def listed(what: str) -> list[str]:
    """Return the counts in the README's line on hidden faults that begins so."""
    (line,) = [line for line in README.splitlines() if line.startswith(f"- {what}")]
    return re.findall(r"\d+ of \d+", line)


def counted(row: str) -> tuple[int, int]:
    """Return the sums over the four runs of a row of the bench's table."""
    (line,) = [line for line in page("truth/bench.md").splitlines() if line.startswith(f"| {row}")]
    pairs = [(int(a), int(b)) for a, b in re.findall(r"(\d+) of (\d+)", line)]
    assert len(pairs) == 4
    return sum(a for a, _ in pairs), sum(b for _, b in pairs)


def judged(*rows: str) -> str:
    """Return how many were right of how many draws, of rows of the independent bench's table."""
    lines = page("truth/independent_bench.md").split("**Judging**")[1].split("Brier score")[0].splitlines()
    found = [
        re.findall(r"\| (\d+) ", line) for line in lines if line.startswith(tuple(f"| {r}" for r in rows))
    ]
    assert len(found) == len(rows)
    draws, right = (sum(int(numbers[k]) for numbers in found) for k in (0, 1))
    return f"{right} of {draws}"


def test_independent_bench_is_told_as_its_page_has_it() -> None:
    """Sums over its rows; a row that is missing would be seen."""
    assert listed("One fault, by independent code") == [
        judged("single, known form", "single, foreign form: named, or")
    ]
    assert listed("Two faults, by independent") == [
        judged("pair of known forms", "pair with a foreign form"),
        judged("pair of known forms"),
    ]
    limits = page("explanations/limits.md")
    for what in ("One fault, by independent", "Two faults, by independent"):
        assert listed(what)[0] in limits


def test_inverse_kinematics_is_told_as_its_page_has_it() -> None:
    """The largest miss of eight robots."""
    rows = re.findall(r"\| 1000 \| .* ([\d.]+) % \|$", page("guides/inverse_sense_control.md"), re.MULTILINE)
    assert len(rows) == 8
    assert ours("Can it steer?") == f"{max(rows, key=float)} %"


def test_readme_is_short() -> None:
    """At most 8 kB; the rest is in the pages."""
    assert len(README.encode()) <= MOST_BYTES


@pytest.mark.parametrize(
    "path",
    [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(DOCS.rglob("*.md"))],
    ids=lambda path: path.name,
)
def test_links_lead_somewhere(path: Path) -> None:
    """Every relative link of a page is a file."""
    for target in re.findall(
        r"\]\(([^)#]+?)(?:#[^)]*)?\)", re.sub(r"\s+", " ", path.read_text(encoding="utf-8"))
    ):
        if "://" not in target:
            assert (path.parent / target).exists(), target


@pytest.mark.parametrize(
    ("what", "row"),
    [
        ("One fault, by the package's own physics", "single effect named first"),
        ("Two faults, by the package's own physics", "both of two named"),
        ("A fault outside the list", "outside the list"),
        ("No fault", "a cause named for nothing"),
    ],
)
def test_sums_of_the_bench(what: str, row: str) -> None:
    """The README counts the four runs together."""
    right, of = counted(row)
    assert listed(what) == [f"{right} of {of}"]


@pytest.mark.parametrize(
    ("what", "name", "stands_there"),
    [
        ("Does a loaded rod", "explanations/static_models.md", "0.017 % of the length off in the mean"),
        ("Does it move right", "explanations/motion.md", "0.038 % over all ten releases"),
        ("Is tendon friction", "truth/validation.md", "shipped friction, tip, largest | - | - | 0.02 mm"),
        ("Published benchmark", "truth/validation.md", "mean tip position error | 0.148 | 0.16 |"),
        (
            "A real robot",
            "truth/real_robots.md",
            "| after the diagnosis, as chosen inside the training file | 5.41 mm | 5.19 mm |",
        ),
    ],
)
def test_figures_are_those_of_the_pages(what: str, name: str, stands_there: str) -> None:
    """What the README says, its source says with the same digits."""
    assert ours(what).split()[0] in stands_there
    assert stands_there in " ".join(page(name).split())


def test_the_table_has_six_rows() -> None:
    """Each leads to the page that has its command."""
    assert len(table()) == 6
    for cells in table().values():
        assert "](docs/" in cells[2]


@pytest.mark.parametrize(
    "path",
    [ROOT / "README.md", *(path for path in sorted(DOCS.rglob("*.md")) if path.parent.name != "truth")],
    ids=lambda path: path.name,
)
def test_no_page_installs_a_bare_name(path: Path) -> None:
    """Anybody may register it: a page names a wheel file, the checkout or this repository's address."""
    assert not bare_installs(path.read_text(encoding="utf-8"))


def bare_installs(text: str) -> list[str]:
    """Return what would fetch this package by its name alone."""
    return re.findall(r"pip install ['\"]?catheter[-_]sim(?![\w.*-])", text)


def test_a_bare_name_is_noticed() -> None:
    """With an extra and in quotes, too; a wheel file and an address are none."""
    for extra in ("", "[gpu]"):
        assert bare_installs(f"pip install catheter-sim{extra}\n")
        assert bare_installs(f"`pip install 'catheter_sim{extra}'`")
    assert not bare_installs("pip install catheter_sim-0.1.0-py3-none-any.whl")
    assert not bare_installs('pip install "git+$CATHETER_SIM_ADDRESS"')


def test_opencr_figures_are_those_of_the_golden_run() -> None:
    """The page's tip errors are those of the diagnosis kept as a golden file."""
    golden = json.loads((ROOT / "tests" / "data" / "opencr_v4_diagnosis.json").read_text())
    section = page("truth/real_robots.md").split("## Two more")[0]
    for key in ("before", "after"):
        assert f"{golden[f'heldout_tip_distance_rmse_{key}_mm']:.2f}" in section
        assert f"{golden[f'heldout_tip_distance_rmse_aligned_{key}_mm']:.2f}" in section
    aligned = "heldout_tip_distance_rmse_aligned_after_mm"  # of its own only where the held-out file decided
    assert f"{golden.get(f'{aligned}_as_chosen_in_training', golden[aligned]):.2f}" in section
