"""Compare the simulated chain with all 500 shapes of a rod in space (assets/reference/sorosim).

    python scripts/validate_rod.py [LINKS]

Prints mean and worst errors in percent of the rod's length; `catheter-sim validate spacer_disk` does a tenth.
"""

from __future__ import annotations

import sys

from catheter_sim.validation.rod import LINKS, rod_cases, shape_errors_percent, tpu_rod


def main() -> int:
    """Compare; return the exit status."""
    links = sys.argv[1] if len(sys.argv) > 1 else str(LINKS)
    if not links.isdigit() or int(links) < 2 or int(links) % 2:
        print(f"validate_rod: LINKS = {links}: must be an even number, 2 or more", file=sys.stderr)
        return 2
    errors = shape_errors_percent(tpu_rod(int(links)), rod_cases(1))
    print(f"{len(errors)} shapes, {links} links: mean {errors[:, 0].mean():.4f} % of the length,")
    print(f"largest mean of a shape {errors[:, 0].max():.4f} %, worst point {errors[:, 1].max():.3f} %")
    return 0


if __name__ == "__main__":
    sys.exit(main())
