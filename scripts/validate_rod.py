"""Compare the simulated chain with all 500 shapes of a rod in space (assets/reference/sorosim).

    python scripts/validate_rod.py [LINKS] [--released]

Prints mean and worst errors in percent of the rod's length; `catheter-sim validate spacer_disk` does a tenth.
With --released the rod is let go at the tip instead, ten times, and followed for 3 s.
"""

from __future__ import annotations

import argparse
import sys

import numpy as np

from catheter_sim.validation.rod import (
    LINKS,
    RELEASES,
    release_case,
    release_errors_percent,
    rod_cases,
    shape_errors_percent,
    tpu_rod,
)


def even(text: str) -> int:
    """Return an even number of links, 2 or more."""
    if not text.isdigit() or int(text) < 2 or int(text) % 2:
        raise argparse.ArgumentTypeError(f"{text}: must be an even number, 2 or more")
    return int(text)


def main() -> int:
    """Compare; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("links", metavar="LINKS", nargs="?", type=even, default=LINKS, help="default 50")
    parser.add_argument("--released", action="store_true", help="let the rod go at the tip")
    options = parser.parse_args()
    links = options.links
    if options.released:
        means = [release_errors_percent(release_case(number), links)[0].mean() for number in RELEASES]
        print(f"{len(means)} releases, {links} links, mid-length and tip over 3 s:")
        print(f"mean {np.mean(means):.4f} % of the length, mean of the worst release {max(means):.4f} %")
        return 0
    errors = shape_errors_percent(tpu_rod(links), rod_cases(1))
    print(f"{len(errors)} shapes, {links} links: mean {errors[:, 0].mean():.4f} % of the length,")
    print(f"largest mean of a shape {errors[:, 0].max():.4f} %, worst point {errors[:, 1].max():.3f} %")
    return 0


if __name__ == "__main__":
    sys.exit(main())
