"""Write every built-in robot as MJCF into models/, or check that what lies there is up to date.

python scripts/build_models.py            # write
python scripts/build_models.py --check    # exit 1 where a file is missing, stale or left over
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from catheter_sim.catalogue import ROBOTS, load_robot
from catheter_sim.modelling.build import build_mjcf
from catheter_sim.tables import replaced_when_whole

MODELS = Path(__file__).resolve().parent.parent / "models"


def built() -> dict[str, str]:
    """Return file name -> MJCF text of every built-in robot."""
    return {
        f"{reference}.xml": build_mjcf(load_robot(reference), motion=True)
        for reference in ROBOTS
        if "@" not in reference
    }


def outdated(texts: dict[str, str], folder: Path) -> list[str]:
    """Return what is wrong with `folder`, a line each."""
    present = {path.name: path.read_text(encoding="utf-8") for path in folder.glob("*.xml")}
    problems = [f"{name}: missing" for name in sorted(texts.keys() - present.keys())]
    problems += [f"{name}: no robot builds this file" for name in sorted(present.keys() - texts.keys())]
    return problems + [
        f"{name}: not what its robot builds now"
        for name in sorted(texts.keys() & present.keys())
        if texts[name] != present[name]
    ]


def main() -> int:
    """Write or check; return the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--check", action="store_true", help="write nothing")
    if parser.parse_args().check:
        problems = outdated(built(), MODELS)
        for problem in problems:
            print(f"models/{problem}; run scripts/build_models.py", file=sys.stderr)
        return 1 if problems else 0
    for name, text in built().items():
        with replaced_when_whole(MODELS / name) as file:
            file.write(text)
        print(f"wrote models/{name}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
