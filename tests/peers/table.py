"""The table of this package beside other programs."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from peers.rods import FORCES_N, Measured, Program, measured

PROGRAMS = (
    "catheter-sim, statics VC",
    "catheter-sim, simulation",
    "mujoco, plain",
    "PyElastica",
    "SoRoMoX",
)
_HOW_TO_GET = "not installed: pip install pyelastica soromox"


def measure(name: str, turns: int) -> Measured:
    """Measure one of `PROGRAMS`; of one that is not installed return a row that says so."""
    try:
        program = _maker(name)()
    except ImportError:
        return Measured(name, _HOW_TO_GET)
    return measured(program, turns)


def _maker(name: str) -> Callable[[], Program]:
    from peers import pyelastica, soromox
    from peers import rods as ours

    makers = (ours.static_model, ours.simulation, ours.plain_mujoco, pyelastica.program, soromox.program)
    return dict(zip(PROGRAMS, makers, strict=True))[name]


def text(rows: Sequence[Measured]) -> str:
    """Return the rows as a table for people."""
    head = (
        f"{'one rod, a force at its tip':<27} {'error':>9} {'statics':>10} {'of ours':>9} {'in batch':>10} "
        f"{'steps/s':>9} {'real time':>9} {'fit':>10} {'its error':>9}"
    )
    lines = [head, "-" * len(head)]
    first = rows[0].statics_s
    for row in rows:
        if row.statics_s is None:
            lines.append(f"{row.program:<27} {row.how}")
            continue
        times = row.statics_s / first if first else 1.0
        rate = "" if row.steps_per_s is None else f"{row.steps_per_s:.0f}"
        speed = "" if row.real_time is None else f"{row.real_time:.2f}x"
        lines.append(
            f"{row.program:<27} {row.error_percent:>7.1g} % {_time(row.statics_s):>10} {times:>8.0f}x "
            f"{_time(row.batch_s):>10} {rate:>9} {speed:>9} {_time(row.fit_s):>10} "
            f"{row.fit_error_percent:>7.1g} %"
        )
    forces = ", ".join(str(force) for force in FORCES_N)
    lines += [f"{row.program}: {row.how}" for row in rows if row.statics_s is not None]
    lines.append(
        f"error: of the tip at {forces} N, of the length; fit: of Young's modulus to the three tips;\n"
        "times: the processor's, the shortest of the turns, after compiling; real time: simulated s in one"
    )
    return "\n".join(lines)


def _time(seconds: float | None) -> str:
    if seconds is None:
        return ""
    for unit, size in (("s", 1.0), ("ms", 1e-3)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds * 1e6:.3g} us"
