"""Pages of the site that are made from the code, and notebooks that run."""

from __future__ import annotations

import json
import os
import re
import sys
from pathlib import Path
from types import ModuleType

import pytest

import catheter_sim as cs
from tests.scripts_as_modules import script_module

ROOT = Path(__file__).resolve().parents[2]
TUTORIALS = sorted((ROOT / "docs" / "tutorials").glob("*.md"))


@pytest.fixture(scope="module")
def pages() -> ModuleType:
    return script_module("site_pages")


def test_every_public_name_has_a_page_of_its_own(pages: ModuleType) -> None:
    """It documents the object that the name stands for; the list leads to it, by its old anchor too."""
    made = pages.name_pages()
    assert len({address.lower() for address in made}) == len(cs.__all__)
    table = "\n".join(pages.table_of_names())
    for name in cs.__all__:
        address = pages.address_of(name)
        (home,) = re.findall(r"^::: (\S+)$", made[address], re.MULTILINE)
        module, _, own = home.rpartition(".")
        assert getattr(sys.modules[module], own) is getattr(cs, name)
        assert f"</a>[`cs.{name}`]({address.removeprefix('reference/')})" in table
    anchors = re.findall(r'<a id="(\w+)">', table)
    assert len(set(anchors)) == len(cs.__all__)
    assert {"cssimulate", "csload_robot", "csexport", "csexport_1"} <= set(anchors)


@pytest.mark.slow
def test_every_environment_has_a_page_with_its_spaces(pages: ModuleType) -> None:
    """The parts' indices cover the observation without a gap; reward, beginning and end are told."""
    made = pages.environment_pages()
    names = {item.name for item in pages.environments()}
    assert set(made) == {f"reference/environments/{name}.md" for name in (*names, "index")}
    for name in names:
        text = made[f"reference/environments/{name}.md"]
        (size,) = re.findall(r"^Observation: `Box\((\d+),\)`", text, re.MULTILINE)
        spaces = text.split("\nObservation:")[1].split("\n## ")[0]
        rows = re.findall(r"^\| (\d+)(?: to (\d+))? \| `\w+` \| .* \| (.+) \|$", spaces, re.MULTILINE)
        indices = [index for low, high, _ in rows for index in range(int(low), int(high or low) + 1)]
        assert indices == list(range(int(size)))
        assert all(unit for _, _, unit in rows)
        assert {"Reward", "Episode", "Reset"} <= set(re.findall(r"^## (\w+)$", text, re.MULTILINE)), name
        assert (pages.PICTURES / f"{name}.png").is_file()


def test_the_checks_stand_in_a_table_for_each_robot(pages: ModuleType) -> None:
    """No row is lost, each robot has a heading, and a source that is a paper is a link."""
    text = (ROOT / "docs" / "truth" / "validation.md").read_text(encoding="utf-8")
    made = pages.by_robot(text)
    robots = set(re.findall(r"^\| (\w+) \| ", text, re.MULTILINE)) - {"robot"}
    assert robots <= set(re.findall(r"^## (\w+)$", made, re.MULTILINE))
    assert len(re.findall(r"^\| check \|", made, re.MULTILINE)) == len(robots)
    more = 2 * (len(robots) - 1)  # heads and rules
    assert made.count("\n|") == text.count("\n|") + more
    assert "[Kato 2016](https://doi.org/10.1007/s11548-015-1310-2), Results" in made
    assert pages.by_robot("no table") == "no table"


def test_a_notebook_has_the_pages_files_commands_and_code(pages: ModuleType) -> None:
    """In their order; what a page shows as printed is left for the notebook to print."""
    pytest.importorskip("jupytext", reason="jupytext, of the extra docs, makes notebooks")
    page = (
        '# Title\n\n[a guide](../guides/own_robot.md)\n\n```toml title="arm.toml"\nname = 1\n```\n\n'
        "```console\n$ cat arm.toml\nname = 1\n$ ls\n```\n\n```python\nprint(2)\n```\n\n```text\n2\n```\n"
    )
    cells = json.loads(pages.notebook_of(page))["cells"]
    code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    assert code[1:] == ["%%writefile arm.toml\nname = 1", "!cat arm.toml\n!ls", "print(2)"]
    assert "../guides" not in str(cells)


@pytest.mark.slow
@pytest.mark.parametrize("path", TUTORIALS, ids=lambda path: path.stem)
def test_a_tutorials_notebook_runs(pages: ModuleType, path: Path, tmp_path: Path) -> None:
    """Each cell, in an empty folder; a command that fails fails the notebook."""
    for needed in ("jupytext", "nbformat", "nbclient", "ipykernel"):
        pytest.importorskip(needed, reason=f"{needed}, of the extra docs, runs notebooks")
    import nbformat
    from nbclient import NotebookClient

    notebook = nbformat.reads(pages.notebook_of(path.read_text(encoding="utf-8")), as_version=4)
    variables = os.environ | {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    client = NotebookClient(notebook, timeout=1200, resources={"metadata": {"path": str(tmp_path)}})
    client.execute(env=variables)
    said = "".join(
        output.get("text", "") for cell in notebook.cells for output in cell.get("outputs", []) if output
    )
    assert "error:" not in said
    figures = re.findall(r"\d+\.\d{2,}", path.read_text(encoding="utf-8").split("```console")[-1])
    assert all(figure in said for figure in figures if "tip_x_mm" not in figure)
