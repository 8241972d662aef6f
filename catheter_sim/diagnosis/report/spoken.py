"""Keys as a reader says them: numbers of causes, further figures, columns, and keys inside sentences.

The key itself stays in a title, which a browser shows on pointing; programs find it in `diagnosis.json`.
"""

from __future__ import annotations

import re

from markupsafe import Markup, escape

from catheter_sim.diagnosis.report.wording import name_and_unit, words
from catheter_sim.effects import EFFECTS

_WHOLE = {  # names that say less than they mean
    "mu": "coefficient of friction",
    "scale": "factor",
    "cubic": "cubic term",
    "zero": "wandering of the zero",
    "creep": "share that creeps",
    "creep time": "time constant of the creep",
    "lag": "time constant of the lag",
    "elastic constant": "factor on elastic constants",
    "moment arm": "factor on moment arms",
    "friction coefficient": "coefficient of friction",
}
_FIRST = {  # the first word of a name of several, and what it says of the rest
    "scale": "factor of",
    "offset": "offset of",
    "width": "width at",
    "slack": "slack at",
    "zero": "wandering of the zero of",
    "curvature": "curvature,",
    "rotation": "turn about",
    "translation": "shift along",
    "force": "force along",
    "arm": "factor on the arm of",
    "radius": "factor on the radius of",
}
_FRAME_SHIFT = re.compile(r"frame (shift|turn) ([xyz])")
_FURTHER = re.compile(
    r"heldout_(?P<simulation>simulation_)?(?P<what>tip_distance_(?:rmse|mean)|rmse|minus_twin_rms)"
    r"(?P<aligned>_aligned)?(?:_(?P<stage>before|after))?(?:_(?P<unit>mm|deg|N))?(?P<first>_as_chosen_in_training)?"
)
_WHAT = {
    "tip_distance_rmse": "tip error in space, RMS",
    "tip_distance_mean": "tip error in space, mean",
    "rmse": "error of each output, RMS",
    "minus_twin_rms": "difference from the fast model, RMS",
}
_TOKEN = re.compile(r"[A-Za-z0-9_.<>/\\-]*[A-Za-z0-9>](?:[._/][A-Za-z0-9_.<>/-]*[A-Za-z0-9_>])")
_FILE = re.compile(r".*\.(csv|tsv|txt|json|toml|xml|html|png|dat)|.*/.*", re.IGNORECASE)


def number_words(name: str) -> tuple[str, str]:
    """Return words and unit of a cause's or a calibrated number: "width_mm" is ("width", "mm")."""
    text, unit = name_and_unit(name)
    if text in _WHOLE:
        return _WHOLE[text], unit
    shift = _FRAME_SHIFT.fullmatch(text)
    if shift:
        way = "shift along" if shift[1] == "shift" else "turn about"
        return f"tracker's frame, {way} {shift[2]}", unit
    first, _, rest = text.partition(" ")
    return (f"{_FIRST[first]} {rest}" if rest and first in _FIRST else text), unit


def figure_words(name: str) -> tuple[str, str]:
    """Return words and unit of a further figure: "heldout_simulation_rmse_after_mm"."""
    found = _FURTHER.fullmatch(name)
    if found is None:
        return name_and_unit(name)
    who = "MuJoCo" if found["simulation"] else "fast model"
    stage = f", {found['stage']}" if found["stage"] else ""
    aligned = ", without its mean offset" if found["aligned"] else ""
    first = "; with the causes chosen in training" if found["first"] else ""
    return f"{who}{stage}: {_WHAT[found['what']]}{aligned}{first}", found["unit"] or ""


def column_words(name: str) -> str:
    """Return a column's name in words, its unit in brackets: "tension right [N]"."""
    text, unit = name_and_unit(name)
    return f"{text} [{unit}]" if unit else text


def titled(text: str, key: str) -> Markup:
    """Return words that show their key on pointing."""
    return Markup('<span title="{}">{}</span>').format(key, text)


def spoken(text: object) -> Markup:
    """Return a sentence as HTML: its keys in words, the names of its files as `<code>`, all else escaped.

    A `.` between digits, at the end of a sentence or in an abbreviation is none of a key.
    """
    said = str(text)
    parts: list[Markup] = []
    end = 0
    for match in _TOKEN.finditer(said):
        token = match[0]
        parts += [escape(said[end : match.start()]), _said(token)]
        end = match.end()
    return Markup("").join([*parts, escape(said[end:])])


def _said(token: str) -> Markup:
    if _FILE.fullmatch(token):
        # "N/mm" and "and/or" are no paths: a path has an ending or more than one step, or a key's sign in it.
        if "." in token or "_" in token:
            return Markup("<code>{}</code>").format(token)
        return escape(token)
    effect, dot, name = token.partition(".")
    if dot and effect in EFFECTS:
        return titled(f"{words(effect)}, {number_words(name)[0]}", token)
    if "_" in token or (dot and effect.isidentifier() and name.isidentifier() and len(effect) > 1):
        text, _ = name_and_unit(token.replace(".", " "))
        return titled(text, token)
    return escape(token)
