"""Numbers and names as a reader wants them: rounded to their uncertainty, with their unit."""

from __future__ import annotations

import math
from collections.abc import Iterable

from catheter_sim.units import SI_TO_FILE

_PLAIN_UNITS = {
    "_N_mm_per_rad": "N mm/rad",
    "_N_per_mm": "N/mm",
    "_N_mm2": "N mm²",
    "_deg_per_m": "deg/m",
    "_per_m": "1/m",
    "_mm2": "mm²",
    "_mm4": "mm⁴",
    "_percent": "%",
    "_m_per_s2": "m/s²",
    "_per_s": "1/s",
    "_mm_per_min": "mm/min",
    "_N_per_min": "N/min",
}
_UNITS = {suffix: suffix.removeprefix("_") for suffix, _ in SI_TO_FILE.values()} | _PLAIN_UNITS
_LONGEST_FIRST = sorted(_UNITS, key=len, reverse=True)


def name_and_unit(name: str) -> tuple[str, str]:
    """Return words and unit of a name that ends in its unit: "width_mm" is ("width", "mm")."""
    for suffix in _LONGEST_FIRST:
        if name.endswith(suffix):
            return name.removesuffix(suffix).replace("_", " "), _UNITS[suffix]
    return name.replace("_", " "), ""


def decimals(uncertainty: float, value: float = 0.0) -> int:
    """Return how many decimals leave two significant digits of `uncertainty`.

    Without an uncertainty (zero, or not finite) three significant digits of `value`.
    """
    if math.isfinite(uncertainty) and uncertainty > 0.0:
        return max(0, 1 - math.floor(math.log10(uncertainty)))
    if math.isfinite(value) and value != 0.0:
        return max(0, 2 - math.floor(math.log10(abs(value))))
    return 2


def rounded(value: float, uncertainty: float = math.nan) -> str:
    """Return `value` with the digits that `uncertainty` leaves; "undefined" if it is not finite."""
    return fixed(value, decimals(uncertainty, value))


def digits_to_tell(values: Iterable[float], digits: int = 2) -> int:
    """Return the decimals in which to show `values` side by side.

    Two at least, and so many that the smallest keeps `digits` significant digits; no more than five.
    """
    sizes = [abs(value) for value in values if math.isfinite(value) and value != 0.0]
    if not sizes:
        return 2
    return min(5, max(2, digits - 1 - math.floor(math.log10(min(sizes)))))


def fixed(value: float, places: int) -> str:
    """Return `value` with `places` decimals; "undefined" if it is not finite."""
    if not math.isfinite(value):
        return "∞" if value == math.inf else "undefined"
    text = f"{value:.{places}f}"
    return text.replace("-", "−") if float(text) != 0.0 else text.removeprefix("-")


def interval(value: float, ci95: tuple[float, float]) -> str:
    """Return a 95 % interval as "0.40 to 0.44", with the digits that its width leaves."""
    half = half_width(ci95)
    if not all(math.isfinite(end) for end in ci95):
        return "undefined" if math.isnan(half) else f"{rounded(ci95[0])} to {rounded(ci95[1])}"
    return f"{rounded(ci95[0], half)} to {rounded(ci95[1], half)}"


def half_width(ci95: tuple[float, float]) -> float:
    """Return half the width of an interval."""
    return (ci95[1] - ci95[0]) / 2.0


def words(name: str) -> str:
    """Return an effect's name in words."""
    return name.replace("_", " ")


def listed(items: list[str] | tuple[str, ...], last: str = "and") -> str:
    """Return "a, b and c"."""
    if len(items) < 2:
        return "".join(items)
    return f"{', '.join(items[:-1])} {last} {items[-1]}"


def axis_label(name: str) -> str:
    """Return the words for a column or coordinate with its unit in brackets: "tip x [mm]"."""
    words, _, unit = name.rpartition("_")
    if unit not in ("mm", "deg", "N", "Nm", "s"):
        return name.replace("_", " ")
    return f"{words.replace('_', ' ')} [{unit}]"
