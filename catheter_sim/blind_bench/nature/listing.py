"""The list of forms as a table in Markdown, as the documentation shows it."""

from __future__ import annotations

from collections.abc import Iterable

from catheter_sim.blind_bench.nature.form import Form
from catheter_sim.blind_bench.nature.forms import FORMS, OUTSIDE


def forms_table() -> str:
    """Return one row for each form: its cause, its name, its law, who knows it, what says the same."""
    rows = ["| cause | form | law | the diagnosis | also right |", "|---|---|---|---|---|"]
    return "\n".join([*rows, *_rows(FORMS), *_rows(OUTSIDE)]) + "\n"


def _rows(forms: Iterable[Form]) -> list[str]:
    rows = []
    for form in forms:
        cause = f"outside: {form.cause}" if form.outside else f"`{form.cause}`"
        name = "" if form.outside else form.name
        knows = "knows it" if form.known else f"does not, {form.purpose}"
        also = ", ".join(f"`{other}`" for other in form.also)
        rows.append(f"| {cause} | {name} | {form.law.replace('|', chr(92) + '|')} | {knows} | {also} |")
    return rows
