"""The pages of the site that are made while it is built: a name each, an environment each, notebooks.

Nothing of them is stored. A model of each environment is compiled for its spaces; no robot is moved.
`python scripts/site_pages.py` draws the environments' pictures, which are stored in docs/pictures.
"""

from __future__ import annotations

import argparse
import base64
import importlib
import inspect
import json
import re
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import gymnasium
import mujoco
import numpy as np

import catheter_sim as cs
from catheter_sim.catalogue import load_robot
from catheter_sim.diagnosis.shapes import radii_mm
from catheter_sim.envs.reach_and_track import ReachEnv
from catheter_sim.envs.tip import CONTROL_STEP_S
from catheter_sim.public.live import LiveRobot, reach_mm, turn_rad
from catheter_sim.units import si_factor

ROOT = Path(__file__).resolve().parent.parent
PICTURES = ROOT / "docs" / "pictures" / "environments"
NAMES = "reference/python"
ENVIRONMENTS = "reference/environments"
TUTORIALS = "tutorials"
_PREFIX = "catheter_sim/"
_PART = re.compile(r"^\| `(\w+)` \|(?P<cells>.*)\|$", re.MULTILINE)
_COLOURS, _SIZE = 64, (400, 300)  # of the pictures: small files

# ----------------------------------------------------------------------------------------------------
# A page for each public name.


def home_of(name: str) -> str:
    """Return where a public name is defined, as a dotted path."""
    value = getattr(cs, name)
    return f"{value.__module__}.{value.__qualname__}"


def kind_of_name(name: str) -> str:
    """Return "function", "class" or "error"."""
    value = getattr(cs, name)
    if not inspect.isclass(value):
        return "function"
    return "error" if issubclass(value, (Exception, Warning)) else "class"


def address_of(name: str) -> str:
    """Return the address of a public name's page; `export` and `Export` must not be one file on any disk."""
    return f"{NAMES}/{'' if kind_of_name(name) == 'function' else 'classes/'}{name}.md"


def name_pages() -> dict[str, str]:
    """Return the text of each public name's page, by its address in the documentation."""
    text = "---\ntitle: cs.{0}\n---\n\n::: {1}\n    options:\n      heading: cs.{0}\n"
    return {address_of(name): text.format(name, home_of(name)) for name in cs.__all__}


def table_of_names() -> Iterator[str]:
    """Yield the lines of the table of names; each row keeps the anchor that its heading had once."""
    anchors: dict[str, str] = {}
    for name in cs.__all__:
        same = sum(other.lower() == name.lower() for other in anchors)
        anchors[name] = f"cs{name.lower()}{f'_{same}' if same else ''}"
    for kind, heading in (("function", "Functions"), ("class", "Classes"), ("error", "Errors and notes")):
        yield f"\n## {heading}\n\n| name | what |\n|---|---|"
        for name in cs.__all__:
            if kind_of_name(name) == kind:
                summary = (inspect.getdoc(getattr(cs, name)) or "").splitlines()[0].replace("|", "\\|")
                address = address_of(name).removeprefix("reference/")
                yield f'| <a id="{anchors[name]}"></a>[`cs.{name}`]({address}) | {summary} |'


# ----------------------------------------------------------------------------------------------------
# What the page that runs robots in a browser loads: the engine, the drawing code, a script for each robot.

LIVE = "live"
LIVE_ROBOTS = {
    name: ROOT / "docs" / "live" / f"{name}.xml"  # `catheter-sim export NAME --for mjx --no-judge`
    for name in ("chest_tube_section", "neuroendoscope", "neuroendoscope_section")
} | {
    name: ROOT / "models" / f"{name}.xml"  # what `build` writes leaves nothing out of these
    for name in ("mitral_4dof", "mitral_transseptal", "notched_wrist", "spacer_disk")
}
_ENGINE = ROOT / "docs" / "vendor" / "mujoco"


def live_scripts() -> dict[str, str]:
    """Return the text of each script, by its address; a page that is opened from a folder may load those."""
    engine = {
        "script": (_ENGINE / "mujoco.js").read_text(encoding="utf-8"),
        "wasm": base64.b64encode((_ENGINE / "mujoco.wasm.gz").read_bytes()).decode("ascii"),
    }
    scene = resources.files("catheter_sim.page").joinpath("scene.js").read_text(encoding="utf-8")
    made = {f"{LIVE}/engine.js": f"LIVE.engine = {json.dumps(engine)};\n", f"{LIVE}/scene.js": scene}
    for name in LIVE_ROBOTS:
        made[f"{LIVE}/robots/{name}.js"] = f"LIVE.robots.{name} = {json.dumps(live_robot(name))};\n"
    return made


def live_robot(name: str) -> dict[str, Any]:
    """Return a robot's plain MJCF with what drives and draws it there.

    `controls`: of each actuator, the channels that it follows and how many SI units one of theirs is.
    `tip_m`: of the last of `bodies`, in its frame.
    """
    mjcf = LIVE_ROBOTS[name].read_text(encoding="utf-8")
    model = mujoco.MjModel.from_xml_string(mjcf)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    robot = load_robot(name)
    live = LiveRobot(robot)
    followed: dict[str, list[tuple[str, float]]] = {}
    for drive in live.drives:
        for tendon, part in zip(drive.tendons, drive.parts, strict=True):
            factor = part * si_factor(drive.column)
            pulled = robot.tendons[tendon].name
            followed.setdefault(f"tendon_{pulled}", []).append((drive.column, factor))
            followed.setdefault(f"antagonist_{pulled}", []).append((drive.column, -factor))
    bodies = [k for k in range(1, model.nbody) if model.body(k).name.startswith("link_")]
    faces_mm = np.array(live.state["shape_mm"])
    height_mm = np.concatenate([[0.0], 1e3 * data.xpos[bodies, 2], faces_mm[-1:, 2]])
    radii = np.interp(height_mm, faces_mm[:, 2], radii_mm(robot, np.arange(len(faces_mm))))
    to_tip = 1e-3 * faces_mm[-1] - data.xpos[bodies[-1]]
    return {
        "mjcf": mjcf,
        "sliders": [vars(live.sliders[drive.column]) for drive in live.drives],
        "controls": [followed.get(model.actuator(k).name, []) for k in range(model.nu)],
        "bodies": bodies,
        "tip_m": (data.xmat[bodies[-1]].reshape(3, 3).T @ to_tip).tolist(),
        "radii_mm": radii.round(3).tolist(),
        "length_mm": reach_mm(live.state["shape_mm"]),
        "turn_rad": turn_rad(live.drives),
    }


# ----------------------------------------------------------------------------------------------------
# A page for each environment, from its class's text and the registry.


@dataclass(frozen=True)
class Registered:
    """An environment of the registry.

    Attributes:
        name: without the package and the version.
        specs: what is registered of it, by version.
    """

    name: str
    specs: Mapping[str, Any]

    @property
    def text(self) -> str:
        """The text of its class."""
        module, _, name = self.specs["v0"].entry_point.partition(":")
        return inspect.getdoc(getattr(importlib.import_module(module), name)) or ""


def environments() -> list[Registered]:
    """Return all that are registered."""
    found: dict[str, dict[str, Any]] = {}
    for full, spec in gymnasium.registry.items():
        if full.startswith(_PREFIX):
            name, _, version = full.removeprefix(_PREFIX).rpartition("-")
            found.setdefault(name, {})[version] = spec
    return [Registered(name, specs) for name, specs in found.items()]


def environment_pages() -> dict[str, str]:
    """Return the text of each environment's page and of their list, by the address in the documentation."""
    pages, rows = {}, []
    for registered in environments():
        spec = registered.specs["v0"]
        made = gymnasium.make(spec.id, disable_env_checker=True).unwrapped
        pages[f"{ENVIRONMENTS}/{registered.name}.md"] = "\n".join(_environment_page(registered, made)) + "\n"
        rows.append(
            f"| [{registered.name}]({registered.name}.md) | `{spec.kwargs['robot']}` "
            f"| {made.action_space.shape[0]} | {made.observation_space.shape[0]} "
            f"| {spec.max_episode_steps} | {', '.join(registered.specs)} |"
        )
        made.close()
    head = (
        '# Environments\n\n`gymnasium.make("catheter_sim/NAME-v0")` after `import catheter_sim`:\n'
        "[environments, and how to train a policy](../../guides/train_a_policy.md).\n\n"
        "| name | robot | actions | observations | steps | versions |\n|---|---|---|---|---|---|\n"
    )
    return {f"{ENVIRONMENTS}/index.md": head + "\n".join(rows) + "\n"} | pages


def _environment_page(registered: Registered, made: Any) -> Iterator[str]:
    spec = registered.specs["v0"]
    summary, _, rest = registered.text.partition("\n")
    robot = load_robot(spec.kwargs["robot"])
    yield f"# {registered.name}\n\n{summary}\n"
    if (PICTURES / f"{registered.name}.png").is_file():
        picture = f"../../pictures/environments/{registered.name}.png"
        yield f"![{registered.name} at the beginning of an episode]({picture})\n"
    yield "| | |\n|---|---|"
    versions = [f"`{item.id}`{_more(item, spec)}" for item in registered.specs.values()]
    yield f"| versions | {'; '.join(versions)} |"
    yield f"| robot | `{spec.kwargs['robot']}`: {robot.description} |"
    arguments = [f"`{key}={value!r}`" for key, value in spec.kwargs.items() if key != "robot"]
    yield f"| arguments that the id sets | {', '.join(arguments) or 'none'} |"
    yield f"| dynamics | {'inertial' if made.plant.inertial else 'quasi-static'} by default |"
    seconds = spec.max_episode_steps * CONTROL_STEP_S
    yield f"| an episode | at most {spec.max_episode_steps} steps of {CONTROL_STEP_S:g} s, {seconds:g} s |"
    yield f"\n## Spaces\n\nAction: `{made.action_space}`\n"
    yield "| index | drive, in shares of its largest change |\n|---|---|"
    for index, drive in enumerate(made.drives.names):
        yield f"| {index} | `{drive}` |"
    seen = made.observation_space
    yield f"\nObservation: `Box{seen.shape}`, {seen.dtype}; L is the straight robot's length.\n"
    yield "| index | part | what | unit |\n|---|---|---|---|"
    cells = _parts(inspect.getdoc(ReachEnv) or "", ", base frame") | _parts(rest)
    for part, place in made.layout.items():
        told = cells.get(part, [""])
        where = f"{place.start}" if place.stop == place.start + 1 else f"{place.start} to {place.stop - 1}"
        yield f"| {where} | `{part}` | {told[1] if len(told) > 2 else ''} | {told[-1]} |"
    yield rest


def _parts(text: str, left_out: str = "") -> dict[str, list[str]]:
    """Return the cells after the name of each part of an observation; the other tasks begin as `Reach`."""
    return {
        part[1]: [cell.replace(left_out, "").strip() for cell in part["cells"].split("|")]
        for part in _PART.finditer(text)
    }


def _more(spec: Any, first: Any) -> str:
    more = {key: value for key, value in spec.kwargs.items() if first.kwargs.get(key) != value}
    return f" (with {', '.join(f'`{key}={value!r}`' for key, value in more.items())})" if more else ""


def draw_environments() -> None:
    """Draw each environment at the beginning of an episode, with its target."""
    from PIL import Image

    PICTURES.mkdir(parents=True, exist_ok=True)
    for registered in environments():
        made = gymnasium.make(
            registered.specs["v0"].id, render_mode="rgb_array", width=2 * _SIZE[0], height=2 * _SIZE[1]
        )
        made.reset(seed=1)
        picture = Image.fromarray(made.render()).resize(_SIZE, Image.Resampling.LANCZOS)
        picture.quantize(_COLOURS).save(PICTURES / f"{registered.name}.png", optimize=True)
        made.close()


# ----------------------------------------------------------------------------------------------------
# A long table of checks, a table for each robot, sources as links.

SPLIT = "truth/validation.md"
_DOI = {
    "Kato 2016": "10.1007/s11548-015-1310-2",
    "Rao 2021": "10.3389/frobt.2020.630245",
    "Nayar 2022": "10.1109/TMRB.2022.3215522",
    "York 2015": "10.1109/ICRA.2015.7139423",
    "Swaney 2017": "10.1115/1.4034575",
    "chest_tube_2025": "10.1109/LRA.2025.3597860",
}


def by_robot(text: str) -> str:
    """Return a page whose table names the robot first, with a heading and a table for each robot."""
    lines = text.split("\n")
    first = next((number for number, line in enumerate(lines) if line.startswith("| robot | check |")), None)
    if first is None:
        return text
    last = next((k for k in range(first, len(lines)) if not lines[k].startswith("|")), len(lines))
    tables: dict[str, list[str]] = {}
    for row in lines[first + 2 : last]:
        robot, _, rest = row.removeprefix("| ").partition(" | ")
        tables.setdefault(robot, []).append(f"| {_linked(rest)}")
    head = [lines[first].removeprefix("| robot "), lines[first + 1].removeprefix("|---")]
    made = []
    for robot, rows in tables.items():
        made += [f"## {robot}", "", *head, *rows, ""]
    return "\n".join([*lines[:first], *made, *lines[last:]])


def _linked(row: str) -> str:
    """Return a row with its last cell's papers as links."""
    cells, source = row.rstrip(" |").rpartition(" | ")[::2]
    for paper, doi in _DOI.items():
        source = source.replace(paper, f"[{paper}](https://doi.org/{doi})", 1)
    return f"{cells} | {source} |"


# ----------------------------------------------------------------------------------------------------
# A notebook for each tutorial, from the same page.

_BLOCK = re.compile(r'^```(\w*)(?: title="([^"\n]+)")?\n(.*?)^```$', re.DOTALL | re.MULTILINE)
_LINK = re.compile(r"\]\((?!\w+://)([^)#]+)([^)]*)\)")


def notebook_of(text: str) -> str:
    """Return a tutorial as a notebook's JSON: commands and code are cells, what they print is left out."""
    import jupytext

    first = (
        "import os\n\n"
        'os.environ["PYTHONUNBUFFERED"] = "1"  # what a command prints comes at once\n'
        'os.environ.pop("MPLBACKEND", None)  # commands draw into files, not into the notebook\n'
    )
    parts, at = [f"```python\n{first}```"], 0
    for block in _BLOCK.finditer(text):
        kind, name, code = block.groups()
        parts.append(text[at : block.start()])
        at = block.end()
        if name:
            parts.append(f"```python\n%%writefile {name}\n{code}```")
        elif kind == "console":
            commands = re.findall(r"^\$ (.*)$", code, re.MULTILINE)
            parts.append("```python\n" + "".join(f"!{command}\n" for command in commands) + "```")
        elif kind == "python":
            parts.append(block.group())
    parts.append(text[at:])
    page = _LINK.sub(_named_alone, "\n\n".join(part.strip() for part in parts if part.strip()))
    made = jupytext.reads(page, fmt="md")
    made.metadata["kernelspec"] = {"name": "python3", "display_name": "Python 3", "language": "python"}
    for number, cell in enumerate(made.cells):
        cell["id"] = f"cell-{number}"  # the same at every build
    return str(jupytext.writes(made, fmt="ipynb"))


def _named_alone(link: re.Match[str]) -> str:
    """Return a link to the site's own page or picture as text: a notebook lies elsewhere."""
    return f"] (documentation: {Path(link[1]).stem})"


def notebooks() -> dict[str, str]:
    """Return each tutorial's notebook by its address in the documentation."""
    pages = sorted((ROOT / "docs" / TUTORIALS).glob("*.md"))
    return {f"{TUTORIALS}/{page.stem}.ipynb": notebook_of(page.read_text(encoding="utf-8")) for page in pages}


def main() -> int:
    """Draw the pictures."""
    argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    ).parse_args()
    draw_environments()
    print(f"wrote {PICTURES.relative_to(ROOT)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
