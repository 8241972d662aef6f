"""Hide effects in data of moving robots, let the diagnosis look for them, and score it.

    python scripts/hidden_effects_in_motion.py --draws 80 --seed 11 --jobs 2 -o results/hidden_in_motion

Every other draw hides one cause of 5 to 30 times the noise, the others nothing. A finer model makes the data:
more links, a smaller step, another integrator, damping and loads by other code. The diagnosis, in another
process that is given only the data set's folder, fits the robot's own simulation. A stopped run goes on where
it was; a draw that is scored is not run again. The exit status is 1 where less is reached than asked.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))  # where the benches lie

from catheter_sim.cli.arguments import whole_number
from catheter_sim.errors import InputError
from hidden_effects.in_motion import run_bench, summary


def main() -> int:
    """Run the bench; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--draws", type=whole_number(1, 10000), default=80, help="default 80")
    parser.add_argument("--first", type=whole_number(0, 10000), default=0, help="first draw; default 0")
    parser.add_argument("--seed", type=whole_number(0, 2**31), default=11, help="default 11")
    parser.add_argument("--jobs", type=whole_number(1, 256), default=2, help="processes; default 2")
    parser.add_argument("--trials", type=whole_number(2, 100), default=8, help="of a draw; default 8")
    parser.add_argument("--seconds", type=float, default=10.0, help="of a trial; default 10")
    parser.add_argument("--limit", type=float, default=1800.0, help="seconds for a diagnosis; default 1800")
    parser.add_argument("-o", "--output", metavar="DIR", required=True, help="folder to write")
    options = parser.parse_args()
    draws = range(options.first, options.first + options.draws)
    print(f"seed {options.seed}, draws {draws.start} to {draws.stop - 1}", flush=True)
    try:
        scores = run_bench(
            options.seed,
            draws,
            Path(options.output),
            options.trials,
            options.seconds,
            options.jobs,
            options.limit,
            on_score=_say,
        )
    except InputError as error:
        print(f"hidden_effects_in_motion: error: {error}", file=sys.stderr)
        return 2
    print("\n".join(summary(scores)))
    return 0 if all(item["right"] for item in scores) else 1


def _say(score: dict) -> None:
    answer = score.get("answer", {})
    hidden = f"{answer.get('cause') or 'nothing'} {answer.get('form', '')}".strip()
    words = f"draw {score['index']}: {hidden}: {score['verdict']} {', '.join(score.get('named', []))}"
    print(f"{'hit ' if score['right'] else 'MISS'} {words} [{score.get('seconds', 0.0):.0f} s]", flush=True)


if __name__ == "__main__":
    sys.exit(main())
