"""Claims about the words of a report: it says no more than is known, in short sentences."""

from __future__ import annotations

import ast
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_report import BLANK, made_up

import catheter_sim
from catheter_sim.catalogue import load_robot
from catheter_sim.cli.diagnose import _lines
from catheter_sim.diagnosis.changes.compare import Changes
from catheter_sim.diagnosis.changes.report import comparison_head, comparison_sentence
from catheter_sim.diagnosis.document import data_digest, stamped, to_json
from catheter_sim.diagnosis.notes import Note
from catheter_sim.diagnosis.report import marked_toml, marked_xml, report_html, sentence
from catheter_sim.diagnosis.result import VERDICTS, Cause, DataFault, DiagnosisResult, FittedParameter, Floor
from catheter_sim.diagnosis.words import ASKS, headline_numbers, use_words
from catheter_sim.effects import EFFECTS

PACKAGE = Path(catheter_sim.__file__).parent
BANNED = ("anew", "stands open", "told", "weighed", "settled", "as well as", "what that")
MOST_WORDS, MEAN_WORDS = 35, 20.0
TIP = {
    "heldout_tip_distance_rmse_before_mm": 8.1,
    "heldout_tip_distance_rmse_after_mm": 5.3,
    "heldout_tip_distance_rmse_aligned_before_mm": 6.6,
    "heldout_tip_distance_rmse_aligned_after_mm": 5.1,
    "heldout_simulation_tip_distance_rmse_after_mm": 5.4,
}
FACTOR = {"scale": FittedParameter(1.2, (1.1, 1.3), 1.0)}
GROUP = Cause(
    "stiffness", FACTOR, 60.0, "scale", probability=0.93, members={"stiffness": 0.55, "actuation_gain": 0.38}
)
UNSURE = (
    Cause("measurement_frame", {"scale": FittedParameter(1.04, (1.02, 1.06), 1.0)}, 7.2, probability=0.27),
    Cause("rate", {"lag_s": FittedParameter(0.11, (0.07, 0.16), 0.0)}, 10.1, "input_lag", probability=0.01),
)
LOW = {"measurement_frame": 0.27, "rate": 0.01, "none": 0.05}


def improved(**changes: Any) -> DiagnosisResult:
    given = {"corrections": UNSURE, "probabilities": LOW | {"outside": 0.97}, "extra": TIP, "absorbs": ()}
    return made_up("improved", **given | changes)


def every_verdict() -> list[DiagnosisResult]:
    """Return a diagnosis of each verdict, with and without a calibration, corrections and groups."""
    fault = DataFault("The column tip_x_mm looks turned in sign.", "b.csv", (3, 9))
    calibrated = {"moment_arm": FittedParameter(1.02, (1.0, 1.04), 1.0)}
    command = "catheter-sim diagnose loops -o out --jobs 2"
    found = [
        made_up(causes=(GROUP,), corrections=UNSURE, calibrated=calibrated, extra=TIP, indistinguishable=()),
        improved(),
        improved(corrections=UNSURE[:1]),
        made_up("no_discrepancy", calibrated=calibrated, repeatability={"mm": 0.3}),
        made_up("no_discrepancy", extra=TIP),
        made_up("unexplained", probabilities=LOW | {"outside": 0.97}),
        made_up("unexplained", probabilities={"outside": 0.2, "none": 0.02}),
        made_up("data_suspect", data_faults=(fault, fault, fault)),
    ]
    return [stamped(item, command) for item in found]


# ------------------------------------------------------------------------------------------ sentences


def sentences_of(text: str) -> list[str]:
    """Return the sentences of a text; `.` in numbers and names of files ends none."""
    parts = re.split(r"(?<=[.?!:;])\s+", " ".join(text.split()))
    whole: list[str] = []
    for part in parts:
        if whole and whole[-1][-1] in ":;":
            whole[-1] += f" {part}"
        else:
            whole.append(part)
    return [part for part in whole if part]


def longest_and_mean(texts: list[str]) -> tuple[str, float]:
    found = [item for text in texts for item in sentences_of(text)]
    lengths = [len(item.split()) for item in found]
    return max(found, key=lambda item: len(item.split())), float(np.mean(lengths))


def assert_plain(texts: list[str]) -> None:
    longest, mean = longest_and_mean(texts)
    assert len(longest.split()) <= MOST_WORDS, longest
    assert mean <= MEAN_WORDS
    for text in texts:
        for word in BANNED:
            assert not re.search(rf"\b{word}\b", text), text


class Blocks(HTMLParser):
    """The texts of a page's paragraphs, list items, cells and headings."""

    INSIDE = ("a", "b", "span", "code", "strong", "em")

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.texts: list[str] = [""]
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        if tag not in ("img", "meta", "br", "input"):
            self.open.append(tag)
        if tag not in self.INSIDE:
            self.texts.append("")

    def handle_endtag(self, tag: str) -> None:
        self.open.pop()
        if tag not in self.INSIDE:
            self.texts.append("")

    def handle_data(self, data: str) -> None:
        if not set(self.open) & {"style", "pre", "title", "script"}:
            self.texts[-1] += data


def blocks_of(html: str) -> list[str]:
    page = Blocks()
    page.feed(html)
    return [text for text in page.texts if len(text.split()) > 3]


@pytest.mark.parametrize("diagnosis", every_verdict(), ids=lambda item: item.verdict)
def test_every_sentence_of_a_page_is_short_and_plain(diagnosis: DiagnosisResult) -> None:
    """At most 35 words, 20 in the mean, none of the words that read as translated."""
    assert_plain(blocks_of(report_html(diagnosis, BLANK)))
    assert_plain([line for line in _lines(diagnosis) if line.startswith(("note:", "what", "next"))])
    assert_plain([sentence(diagnosis), use_words(diagnosis)])


def said_in(source: str) -> Iterator[str]:
    """Yield the texts of a module with five words or more, docstrings left out; X: what is put in."""
    tree = ast.parse(source)
    skipped = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            skipped |= {id(part) for part in node.values}
            text = "".join(str(part.value) if isinstance(part, ast.Constant) else "X" for part in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in skipped:
            text = node.value
        else:
            continue
        if len(text.split()) >= 5:
            yield text


@pytest.mark.slow
def test_every_text_of_a_diagnosis_is_short_and_plain() -> None:
    """Notes, faults of the data, what to measure next, and errors, as they stand in the package."""
    texts: list[str] = []
    for path in PACKAGE.joinpath("diagnosis").rglob("*.py"):
        texts += said_in(path.read_text(encoding="utf-8"))
    assert len(texts) > 150
    assert_plain(texts)
    assert [*said_in('"""Not this one, as it is a docstring."""\nf"It is {x:.2g} mm long."')] == [
        "It is X mm long."
    ]


@pytest.mark.parametrize("name", EFFECTS)
def test_every_cause_speaks_plainly(name: str) -> None:
    effect = EFFECTS[name]
    assert_plain([effect.summary, effect.bench, effect.trace, *effect.advice.values()])


# ------------------------------------------------------------------------------------- what is claimed


def test_an_improved_model_is_not_called_wrong_about_anything() -> None:
    """The gain, and that nothing is established and why; by the chance of what is not on the list."""
    said = sentence(improved())
    assert "the tip error of neuroendoscope_section on held-out data falls from 8.10 to 5.30 mm." in said
    assert said.endswith(
        "None of them is established: something outside the list is at work with probability 0.97."
    )
    assert "wrong" not in said
    likely = sentence(improved(probabilities=LOW | {"outside": 0.2}, corrections=UNSURE[:1]))
    assert likely.endswith("not established: the most probable one, measurement frame, has probability 0.27.")


def test_named_causes_stand_alone_and_corrections_are_counted() -> None:
    """A group is one entry, by "or"; corrections have a sentence of their own, without their names."""
    said = sentence(made_up(causes=(GROUP,), corrections=UNSURE, extra=TIP, indistinguishable=()))
    assert "is wrong about stiffness or actuation gain. Corrected, its tip error" in said
    assert "2 further corrections lower the error; none is established." in said
    assert "measurement frame" not in said
    one = sentence(made_up(causes=(GROUP,), corrections=UNSURE[:1]))
    assert "One further correction lowers the error; it is not established." in one
    outside = sentence(made_up(causes=(GROUP,), probabilities={"outside": 0.8}))
    assert outside.endswith("Something outside the list is at work too, with probability 0.80.")


@pytest.mark.parametrize(
    ("chances", "says"),
    [
        ({"outside": 0.97}, "something outside the list is at work with probability 0.97"),
        ({"outside": 0.1, "rate": 0.4}, "the most probable one, rate, has probability 0.40"),
        ({"outside": 0.1, "rate": 0.02}, "these data do not show what is wrong"),
    ],
)
def test_an_unexplained_error_says_what_is_true(chances: dict[str, float], says: str) -> None:
    """Nothing is said of what no cause explains where nothing outside the list is likely."""
    said = sentence(made_up("unexplained", probabilities=chances))
    assert said.endswith(f"No cause is established: {says}.")


def test_an_error_falls_only_where_it_falls() -> None:
    rising = TIP | {"heldout_tip_distance_rmse_after_mm": 9.5}
    assert "rises from 8.10 to 9.50 mm" in sentence(improved(extra=rising))
    same = TIP | {"heldout_tip_distance_rmse_after_mm": 8.1}
    assert "stays at 8.10 mm" in sentence(improved(extra=same))


@pytest.mark.parametrize("diagnosis", every_verdict(), ids=lambda item: item.verdict)
def test_a_model_is_called_calibrated_only_where_something_was_calibrated(diagnosis: DiagnosisResult) -> None:
    page = " ".join(blocks_of(report_html(diagnosis, BLANK))) + sentence(diagnosis)
    calibrated = "calibrated" in page
    assert calibrated == bool(diagnosis.calibrated)


def test_the_tips_distance_in_space_is_the_first_figure() -> None:
    """Of MuJoCo, then of the fast model; the noise beside it in space: the root of three times an output's.

    Where corrections help another unit alone, as a scale of torsion does, that unit's figures come first.
    """
    values = [item["value"] for item in headline_numbers(improved(repeatability={"mm": 0.2}))]
    assert values[:3] == ["5.40 mm", "5.30 mm", "8.10 mm"]
    assert float(values[3].split()[0]) == pytest.approx(0.05 * np.sqrt(3.0), abs=6e-4)
    assert float(values[4].split()[0]) == pytest.approx(0.2 * np.sqrt(3.0), abs=6e-3)
    assert "is 5.40 mm" in use_words(improved())
    units = improved().by_unit
    only_deg = units | {"mm": replace(units["mm"], gain_percent_ci95=(-1.0, 1.0))}
    assert headline_numbers(improved(by_unit=only_deg))[0]["value"] == "0.50 deg"


@pytest.mark.slow
def test_every_verdict_asks_for_something_and_the_guide_says_the_same() -> None:
    assert set(ASKS) == set(VERDICTS)
    guide = Path(__file__).parents[2].joinpath("docs", "guides", "diagnose.md").read_text(encoding="utf-8")
    for verdict, asks in ASKS.items():
        (row,) = [line for line in guide.splitlines() if line.startswith(f"| `{verdict}` |")]
        assert row.replace("`", "").endswith(f"| {asks} |")
        assert asks in blocks_of(report_html(made_up(verdict), BLANK))


def test_formulas_are_shown_as_they_are_written() -> None:
    """With their keys, and a sign between factors."""
    gain = Cause("actuation_gain", {"scale": FittedParameter(1.1, (1.0, 1.2), 1.0)}, 9.0, "scale")
    page = report_html(made_up(causes=(gain,)), BLANK)
    assert "<code>u&#39; = scale * scale_&lt;channel&gt; * u</code>" in page
    for effect in EFFECTS.values():
        for form in effect.forms:
            assert not re.search(r"\b(\w+) \1\b", form.equation), form.equation
            assert not re.search(
                r"(scale|creep|through|EI|E|T|share)[ _>]*\) ?\w|\w_\w+ [uxyzt]\b", form.equation
            )


@pytest.mark.parametrize(("chance", "said"), [(0.001, "leaves 4.80 mm"), (0.2, "shows no sure gain")])
def test_the_floor_is_said_as_far_as_it_is_sure(chance: float, said: str) -> None:
    """A gain by chance is none, and its number does not stand at the head."""
    floor = Floor({"mm": 2.7}, {"mm": chance}, 4.8)
    found = made_up("improved", causes=(), corrections=UNSURE, extra=TIP, floor=floor)
    assert said in use_words(found)
    assert any("flexible model" in item["words"] for item in headline_numbers(found)) == (chance < 0.01)
    assert to_json(found)["floor"] == {"mm": 2.7}
    assert "flexible" not in use_words(made_up("improved", causes=(), corrections=UNSURE, extra=TIP))


# ------------------------------------------------------------------------------------------ documents


def test_corrections_groups_and_tip_stand_in_the_document() -> None:
    document = to_json(made_up(causes=(GROUP,), corrections=UNSURE, extra=TIP))
    (cause,) = document["causes"]
    assert (cause["name"], cause["probability"]) == ("stiffness", 0.93)
    assert cause["one_of"] == ["stiffness", "actuation_gain"]
    assert cause["members"] == {"stiffness": 0.55, "actuation_gain": 0.38}
    assert [item["name"] for item in document["corrections"]] == ["measurement_frame", "rate"]
    assert "one_of" not in document["corrections"][0]
    assert document["tip_mm"] == {
        "before": 8.1,
        "after": 5.3,
        "of": "held-out",
        "aligned": {"before": 6.6, "after": 5.1},
        "floor": None,
    }
    assert document["floor"] == {}
    assert to_json(made_up())["tip_mm"] is None
    assert {document[name] for name in ("version", "made", "command", "data_digest")} == {None}


def test_a_report_says_where_it_comes_from(monkeypatch: pytest.MonkeyPatch) -> None:
    """Version, time in UTC, command, and a digest that one changed value changes; on the page too."""
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    found = stamped(made_up(), "catheter-sim diagnose loops -o out")
    document = to_json(found)
    assert document["version"] == catheter_sim.__version__
    assert document["made"] == "2023-11-14T22:13:20Z"  # as `date -u -d @1700000000` says
    assert document["command"] == "catheter-sim diagnose loops -o out"
    assert re.fullmatch("[0-9a-f]{64}", document["data_digest"])
    page = report_html(found, BLANK)
    assert all(document[name] in page for name in ("version", "made", "command", "data_digest"))
    other = made_up()
    other.dataset.trials[0].outputs.columns["tip_z_mm"][3] += 1e-9
    assert data_digest(other.dataset) != document["data_digest"]


def test_the_digest_of_a_folder_is_of_its_files(tmp_path: Path) -> None:
    """Of dataset.toml and the trials that it names, not of what else lies there."""
    listing = tmp_path / "dataset.toml"
    listing.write_text('[[trials]]\nfile = "a.csv"\n')
    (tmp_path / "a.csv").write_text("time_s\n0\n")
    dataset = replace(made_up().dataset, folder=tmp_path)
    first = data_digest(dataset)
    (tmp_path / "notes.txt").write_text("nothing")
    assert data_digest(dataset) == first
    (tmp_path / "a.csv").write_text("time_s\n1\n")
    second = data_digest(dataset)
    listing.write_text('[[trials]]\nfile = "a.csv" # the first\n')
    assert len({first, second, data_digest(dataset)}) == 3


def test_the_corrected_robot_says_what_each_of_its_effects_is(tmp_path: Path) -> None:
    """A line above each in robot.toml, one comment in model.xml; both still read."""
    effects = {
        "stiffness": {"scale": 1.2},
        "measurement_frame": {"scale": 1.04},
        "rate": {"lag_s": 0.11},
        "backlash": {"width_mm": 0.1},
    }
    robot = replace(load_robot("spacer_disk"), effects=effects)
    found = stamped(made_up(causes=(GROUP,), corrections=UNSURE, extended_robot=robot))
    text = marked_toml(found)
    lines = text.splitlines()
    above = {line: lines[index - 1] for index, line in enumerate(lines) if line.startswith("[effects.")}
    assert above == {
        "[effects.stiffness]": "# cause, probability 0.93; may be actuation_gain instead",
        "[effects.measurement_frame]": "# correction, not established (0.27)",
        "[effects.rate]": "# correction, not established (0.01)",
        "[effects.backlash]": "# as specified",
    }
    (tmp_path / "robot.toml").write_text(text)
    assert load_robot(tmp_path / "robot.toml").effects == effects
    assert stamped(found, "another").provenance == found.provenance
    marked = marked_xml(found, '<mujoco model="a"/>')
    assert "stiffness: cause, probability 0.93" in marked
    assert "rate: correction, not established (0.01)" in marked
    assert ElementTree.fromstring(marked).get("model") == "a"


# ---------------------------------------------------------------------------------------- comparisons


def compared(verdict: str, backward: bool = False, **changes: Any) -> Changes:
    return Changes(made_up(verdict, extra=TIP, **changes), "May", "June", 80, 80, backward=backward)


@pytest.mark.slow
def test_a_comparison_speaks_as_a_diagnosis_does() -> None:
    """What changed by name, a group by "or"; no change that is not established; each asks for something."""
    changed = compared("cause_found", causes=(GROUP,))
    assert comparison_sentence(changed) == (
        "From “May” to “June”, stiffness or actuation gain changed. With it the tip error on held-out data "
        "falls from 8.10 to 5.30 mm."
    )
    assert "May" in comparison_sentence(compared("cause_found", backward=True))
    assert "nothing changed" in comparison_sentence(compared("no_discrepancy"))
    unknown = comparison_sentence(compared("unexplained", probabilities=LOW))
    assert unknown.startswith("From “May” to “June”, no change is established.")
    assert "backlash" not in unknown
    for found in (changed, compared("no_discrepancy"), compared("unexplained")):
        page = report_html(found.diagnosis, BLANK, comparison_head(found))
        assert_plain(blocks_of(page))
        assert "What changed" in page
        assert f"verdict: {found.verdict}" in page


def test_a_note_of_something_else_is_in_the_sentence() -> None:
    note = Note("something_else_too", "More is at work.")
    assert sentence(made_up(notes=(note,))).endswith("Something else is at work too.")
