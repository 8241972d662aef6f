"""Let other methods look at the independent bench's data, and put them beside the diagnosis.

    python scripts/natural_effects.py --draws 45 --seed 1 --purpose tune -o results/nature
    python scripts/other_methods.py results/nature --jobs 2

A fit of everything at once, a lasso and forward selection by BIC (`blind_bench/other_methods`) get the twin,
the calibrated numbers and the noise that the diagnosis has. A name counts only if it is the hidden one's, for
all alike. A stopped run goes on where it was; after a change all are run again.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))  # where the benches lie

from catheter_sim.cli.arguments import whole_number
from catheter_sim.errors import InputError
from hidden_effects.natural import scores_in
from hidden_effects.other_methods import METHODS, PLACE, as_text, rows, run_methods
from hidden_effects.running import write_json


def main() -> int:
    """Run the methods; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("bench", metavar="DIR", help="a folder of scripts/natural_effects.py, diagnosed")
    parser.add_argument("--jobs", type=whole_number(1, 256), default=2, help="processes; default 2")
    options = parser.parse_args()
    root = Path(options.bench)
    diagnosed = scores_in(root)
    if not diagnosed:
        print(f"other_methods: error: {root}: no draw that the present code has diagnosed", file=sys.stderr)
        return 2
    try:
        scores = run_methods(root, [item["index"] for item in diagnosed], options.jobs, on_score=_say)
    except InputError as error:
        print(f"other_methods: error: {error}", file=sys.stderr)
        return 2
    by_method = {name: [item for item in scores if item.get("method") == name] for name in METHODS}
    table = rows({"diagnosis": diagnosed} | by_method)
    write_json(table, root / PLACE / "table.json")
    print(as_text(table))
    return 0


def _say(score: dict[str, Any]) -> None:
    if score:
        hidden = " + ".join(score["true"]) or "nothing"
        said = " + ".join(score["named"]) or "nothing"
        print(
            f"{score['index']:3d} {score['method']}: {hidden} -> {said} [{score['seconds']:.0f} s]",
            flush=True,
        )


if __name__ == "__main__":
    sys.exit(main())
