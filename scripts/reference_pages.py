"""Write the pages of the documentation that are made from the code: commands, causes, numbers.

    python scripts/reference_pages.py [--check]

With --check nothing is written; the exit status is 1 where a page is not what the code says.
"""

from __future__ import annotations

import argparse
import ast
import inspect
import itertools
import sys
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import catheter_sim as cs
from catheter_sim.catalogue import ROBOTS, load_robot
from catheter_sim.effects import EFFECTS
from catheter_sim.robots import KINDS, kind_of

FOLDER = Path(__file__).resolve().parent.parent / "docs" / "reference"
DIAGNOSIS = Path(cs.__file__).parent / "diagnosis"
ROBOT = "neuroendoscope_section"  # whose effects are shown with their bounds
OTHER = "mitral_4dof"  # whose effects are shown where the first robot has none
_VERBS = """\
# Commands

`catheter-sim COMMAND --help` prints the same text as this page.

| exit status | meaning |
|---|---|
| 0 | done |
| 1 | a check failed |
| 2 | bad usage or bad input; one line on standard error names file, line, column or key, and the choices |

`catheter-sim list` shows robots, static models, environments and causes. `catheter-sim list ROBOT` shows one
robot's inputs, outputs, models and causes, also of your own `.toml`. Long work says on standard error what it
is doing, and that a kernel is compiled at its first use. A warning of MuJoCo ends the simulation, with an
error that names the row."""
_EFFECTS = f"""\
# Causes

This is the closed list of causes of error. A diagnosis names causes from this list. To set one yourself, use
`--set effects.backlash.width_mm=0.4`. A cause may act in several forms. A form is on where its numbers differ
from those of "no effect". Bounds and units below are those of `{ROBOT}`, or of `{OTHER}`
where the first has none. `catheter-sim list ROBOT` shows another robot's."""
_KINDS = """
Robots with several sections or joints have further forms.

## Which cause on which kind of robot

The table has, for each kind, the forms that a diagnosis tries on at least one robot of the catalogue, driven
by tension or by displacement. Where there are none, a number in brackets leads to the reason below."""
_GAPS = {
    ("coupling", "notched_tube"): "It has one channel, which nothing else can move with.",
    (
        "payload",
        "catheter",
    ): "You can set it, beside springs that may rub. A search with it would take a quarter of an hour.",
    ("tendon_elongation", "rolling"): "Its rods are driven by tension, which arrives whatever their length.",
    (
        "nonlinear_stiffness",
        "catheter",
    ): "Its tendons' lengths set its joints' angles. So another elastic law shows as little as another "
    "stiffness does. A resistance that was measured is a law of the joint (`resistance`).",
    (
        "twist",
        "catheter",
    ): "Its torsion joints turn by a channel of their own. A turn of one, for good, is that "
    "channel's `actuation_offset`.",
}
_ORDER = """
## What acts before what

`backlash` acts on the input of every robot, before `coupling`. A catheter's drives may have a play of their
own (`play_mm`) behind it. Two plays in a row do what one of the summed width does.

Whether `backlash` or `coupling` comes first matters only where both are set. We tried a width of 0.4 mm and a
share of 0.2 of the distal displacement, in a loop of 3 mm. The order moves the tip of `mitral_4dof` by
1.0 mm, and the distal torsion of `mitral_transseptal` by 0.9 deg. Without `coupling` it moves
nothing (2e-8 mm in the simulation).

The form `slack` of `backlash` is for the bending pairs of catheters. It is also for a robot of your own whose
channel pulls one tendon and lets another out (`channel_gain` below zero). There each tendon is too long by
`slack_mm`, or by `slack_<channel>_mm` for one of several channels. It adds to the tendons' own `slack_mm` in
the robot's file."""
_THRESHOLDS = """\
# Numbers of a diagnosis

A diagnosis decides by these numbers. For each you see the file, the unit, what it decides and why it has its
value. `thresholds.py` holds those that several files need.

- "This" and "this many" mean the number itself.
- "The same" refers to the row above.
- "Assumed" means that nobody measured a reason. The text may then say what makes the value plausible.
- "The blind bench" is the run of 400 drawn data sets with hidden causes of [the bench](../truth/bench.md)."""


def verbs_page() -> Iterator[str]:
    """Yield the lines of the page of verbs: each one's help, as the command prints it."""
    from catheter_sim.cli.main import VERBS, parser

    (verbs,) = [item for item in parser()._actions if isinstance(item, argparse._SubParsersAction)]
    yield _VERBS
    for name, module in VERBS.items():
        summary, _, text = (inspect.getdoc(module) or "").partition("\n")
        yield f"\n## {name}\n\n{summary.replace('<', '&lt;')}\n"
        yield "| argument | what |\n|---|---|"
        for action in verbs.choices[name]._actions:
            if not isinstance(action, argparse._HelpAction):
                said = (action.help or "").replace("%%", "%").replace("|", " or ").replace("<", "&lt;")
                yield f"| `{_argument(action)}` | {said} |"
        yield f"\n```text\n{text.strip()}\n```"


def _argument(action: argparse.Action) -> str:
    """Return an argument as a command line has it."""
    value = action.metavar or "|".join(map(str, action.choices or ())) or action.dest.upper()
    shown = value if isinstance(value, str) else " ".join(value)
    if not action.option_strings:
        return shown.replace("|", " or ")
    name = ", ".join(action.option_strings)
    return (name if action.nargs == 0 else f"{name} {shown}").replace("|", " or ")


def forms_by_kind() -> dict[tuple[str, str], list[str]]:
    """Return the names of the forms that a diagnosis tries, by cause and kind of robot."""
    found: dict[tuple[str, str], list[str]] = {}
    for kind_name, kind in KINDS.items():
        robots = [load_robot(name) for name in ROBOTS if kind_of(load_robot(name)) is kind]
        driven = [replace(item, actuation=by) for item in robots for by in kind.drives.actuations(item)]
        for effect in EFFECTS.values():
            tried = [form.name for form in effect.forms if any(form.freed(robot) for robot in driven)]
            found[effect.name, kind_name] = tried
    return found


def kinds_table() -> Iterator[str]:
    """Yield the lines of the table of causes and kinds, and of the reasons of its gaps.

    Raises:
        ValueError: a gap has no reason, or a reason no gap.
    """
    forms = forms_by_kind()
    gaps = [(effect, kind) for effect in EFFECTS for kind in KINDS if not forms[effect, kind]]
    if set(gaps) != set(_GAPS):
        raise ValueError(f"gaps and reasons differ: {sorted(set(gaps) ^ set(_GAPS))}")
    yield f"| cause | {' | '.join(KINDS)} |"
    yield "|---" * (len(KINDS) + 1) + "|"
    for effect in EFFECTS:
        cells = (", ".join(forms[effect, kind]) or f"[{gaps.index((effect, kind)) + 1}]" for kind in KINDS)
        yield f"| `{effect}` | {' | '.join(cells)} |"
    yield ""
    for number, place in enumerate(gaps, start=1):
        yield f"{number}. `{place[0]}`, {place[1]}: {_GAPS[place]}"


def effects_page() -> Iterator[str]:
    """Yield the lines of the page of effects: the closed list, with forms, parameters and bounds."""
    yield _EFFECTS
    rows: dict[str, dict[str, list[Mapping[str, Any]]]] = {ROBOT: {}, OTHER: {}}
    for robot, of_robot in rows.items():
        for row in cs.list_effects(robot):
            of_robot.setdefault(row["effect"], []).append(row)
    for effect in EFFECTS:
        robot = ROBOT if effect in rows[ROBOT] else OTHER
        parameters = rows[robot][effect]
        yield ""
        yield f"## `{effect}`"
        yield ""
        whose = "" if robot == ROBOT else f" Of `{robot}`:"
        yield f"{parameters[0]['summary'].rstrip('.').replace('<', '&lt;')}.{whose}"
        yield ""
        yield "| form | parameter | no effect | bounds |"
        yield "|---|---|---|---|"
        for row in parameters:
            bounds = f"{row['lower']:.4g} to {row['upper']:.4g}"
            yield f"| {row['form']} | `{row['parameter']}` | {row['no_effect']:g} | {bounds} |"
    yield _KINDS
    yield ""
    yield from kinds_table()
    yield _ORDER


def thresholds_page() -> Iterator[str]:
    """Yield the lines of the page of thresholds: the constants of the diagnosis that say why."""
    yield _THRESHOLDS
    for path in sorted(DIAGNOSIS.rglob("*.py")):
        rows = list(thresholds_of(path))
        if rows:
            yield f"\n## {path.relative_to(DIAGNOSIS).as_posix()}\n"
            yield "| number | value | what and why |\n|---|---|---|"
            yield from (f"| `{name}` | `{value}` | {text} |" for name, value, text in rows)


def thresholds_of(path: Path) -> Iterator[tuple[str, str, str]]:
    """Yield name, value and text of a file's constants that a text "[unit] ... Why: ..." follows."""
    for node, after in itertools.pairwise(ast.parse(path.read_text(encoding="utf-8")).body):
        if (
            isinstance(node, ast.Assign)
            and isinstance(after, ast.Expr)
            and isinstance(after.value, ast.Constant)
            and str(after.value.value).startswith("[")
        ):
            text = " ".join(str(after.value.value).split())
            yield ast.unparse(node.targets[0]), ast.unparse(node.value), text.replace("[", "\\[", 1)


PAGES = {
    "verbs.md": verbs_page,
    "effects.md": effects_page,
    "thresholds.md": thresholds_page,
}


def texts() -> dict[str, str]:
    """Return the text of each page by its file's name."""
    return {name: "\n".join(lines()) + "\n" for name, lines in PAGES.items()}


def main() -> int:
    """Write the pages, or say which are stale."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--check", action="store_true", help="write nothing; exit with 1 where a page is stale"
    )
    check = parser.parse_args().check
    stale = []
    for name, text in texts().items():
        path = FOLDER / name
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            stale.append(name)
            if not check:
                path.write_text(text, encoding="utf-8")
    print(f"{'stale' if check else 'written'}: {', '.join(stale) or 'nothing'}")
    return 1 if check and stale else 0


if __name__ == "__main__":
    sys.exit(main())
