"""Reports: what a known crowd prefers is found, and its files are whole, readable and harmless."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import re
import subprocess
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("matplotlib")
pytest.importorskip("statsmodels")

from elocute.errors import OutputError, StudyError
from elocute.evaluation.confidence_intervals import ConfidenceInterval
from elocute.study.crowd import SYNC_BOUNDS_MS, SYNC_SD_MS, Crowd, crowd_answers, seats_of
from elocute.study.design.design import Analysis, Assignment, Design
from elocute.study.design.power import Plan, exact_power, plan_for, plan_study, power_with
from elocute.study.report.answers import COLUMNS, Answer, answers_text, write_answers
from elocute.study.report.report import NOT_PEOPLE, make_report
from elocute.study.report.report_files import table_csv, table_latex, write_report
from elocute.study.report.report_page import page_text
from elocute.study.report.report_parts import Report, Section, Table
from elocute.study.statistics.sync_curves import SyncCurve, fit_sync_curve
from tests.study.designs import design_of
from tests.support.commands import run_here

ROOT = Path(__file__).parents[2]
LEVELS = {"rules": 0.0, "voca": -0.6, "talkers": 0.7}
LEVELS_OF = {
    "binary": LEVELS,
    "style": {"rules": 0.4, "voca": 1.2, "talkers": 0.1},
    "rating": {"rules": 55.0, "voca": 40.0, "talkers": 70.0, "still": 12.0},
    "intelligibility": {"rules": 0.6, "voca": -0.4, "talkers": 1.2},
    "sync": {},
}
KINDS = [*((kind, "mos") for kind in LEVELS_OF), ("rating", "mushra")]


def asked(kind: str, scale: str = "mos", people: int = 14) -> tuple[Design, list[Answer]]:
    design = design_of(kind, scale=scale, sounds=6)
    spread = {"people_sd": 6.0, "stimuli_sd": 4.0} if kind == "rating" else {}
    crowd = Crowd(LEVELS_OF[kind], cheaters=0.1, **spread)
    return design, crowd_answers(design, crowd, seats_of(design, people), 3)


@pytest.fixture(scope="module")
def reports() -> dict[tuple[str, str], Report]:
    """Of every kind of study."""
    return {each: make_report(*asked(*each)) for each in KINDS}


def table_of(report: Report, name: str) -> Table:
    return next(table for table in report.tables if table.name == name)


class Page(HTMLParser):
    """What a page holds."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []
        self.shown: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += attrs

    def handle_data(self, data):
        self.shown.append(data)


@pytest.mark.parametrize(("kind", "scale"), KINDS)
def test_a_page_is_whole_and_asks_nobody(reports, kind, scale):
    text = page_text(reports[kind, scale])
    page = Page(text)
    assert page.tags.count("h1") == 1 and page.tags.count("main") == 1
    assert not {"script", "link", "img", "iframe", "object"} & set(page.tags)
    names = [value for name, value in page.attributes if name == "id"]
    assert len(names) == len(set(names))
    assert not [name for name, _ in page.attributes if name.startswith("on") or name == "src"]
    links = [value or "" for name, value in page.attributes if name.endswith("href")]
    assert all(each.startswith("#") and each[1:] in names for each in links)
    described = [
        part
        for name, value in page.attributes
        if name in ("aria-labelledby", "aria-describedby")
        for part in (value or "").split()
    ]
    assert set(described) <= set(names)
    assert "default-src 'none'" in text and "url(http" not in text
    assert page.tags.count("svg") == page.tags.count("figcaption") >= 2
    assert NOT_PEOPLE in page.shown and "nan" not in text


def test_a_report_is_the_same_again(reports):
    for kind in ("binary", "rating"):
        assert page_text(reports[kind, "mos"]) == page_text(make_report(*asked(kind)))


def test_a_known_crowd_is_recovered(reports):
    table = table_of(reports["binary", "mos"], "preference_pairs")
    pairs = {f"{row[0]}{row[1]}": row for row in table.rows}
    crowd = Crowd(LEVELS)
    for one, other in (("voca", "rules"), ("talkers", "rules"), ("voca", "talkers")):
        truth, row = crowd.true_share(one, other), pairs[one + other]
        assert isinstance(row[6], ConfidenceInterval) and row[6].low < truth < row[6].high
    strengths = [row[0] for row in table_of(reports["binary", "mos"], "strengths").rows]
    assert strengths == ["talkers", "rules", "voca"]
    ratings = {row[0]: row[4] for row in table_of(reports["rating", "mushra"], "ratings").rows}
    for name, level in LEVELS_OF["rating"].items():
        assert ratings[name].low < level < ratings[name].high  # type: ignore[union-attr]
    parts = {row[0]: row[1] for row in table_of(reports["rating", "mushra"], "ratings").rows}
    assert (parts["real"], parts["still"]) == ("hidden reference", "anchor")
    words = [row[3].value for row in table_of(reports["intelligibility", "mos"], "words").rows]  # type: ignore[union-attr]
    assert words[1] < min(words[0], words[2])
    [bounds] = table_of(reports["sync", "mos"], "sync_bounds").rows
    for found, truth in zip(bounds[2:4], SYNC_BOUNDS_MS, strict=True):
        assert found.low - 15 < truth < found.high + 15  # type: ignore[union-attr]


def test_a_sync_curve_is_that_of_its_counts():
    offsets = np.array([-400.0, -200.0, -100.0, 0.0, 100.0, 200.0, 300.0, 400.0])
    truth = SyncCurve(*SYNC_BOUNDS_MS, SYNC_SD_MS)
    found = fit_sync_curve(offsets, truth.shares(offsets) * 1e5)
    assert (found.early, found.late, found.sd) == pytest.approx(
        (truth.early, truth.late, truth.sd), abs=1.0
    )
    assert found.shares(offsets).sum(axis=1) == pytest.approx(1, abs=1e-6)


def test_files_are_written_and_a_folder_of_other_things_is_left_alone(tmp_path, reports):
    files = write_report(reports["rating", "mos"], tmp_path / "report")
    assert (tmp_path / "report/report.pdf").read_bytes().startswith(b"%PDF-")
    assert all(path.stat().st_size for path in files)
    names = {path.suffix for path in files}
    assert names == {".html", ".pdf", ".csv", ".tex"}
    before = {path: path.read_bytes() for path in files}
    with pytest.raises(OutputError, match="a report is there already"):
        write_report(reports["rating", "mos"], tmp_path / "report")
    write_report(reports["rating", "mos"], tmp_path / "report", overwrite=True)
    assert {path: path.read_bytes() for path in files} == before  # to the last byte
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/thesis.txt").write_text("years of work")
    with pytest.raises(OutputError, match="something else than a report"):
        write_report(reports["rating", "mos"], tmp_path / "mine", overwrite=True)
    assert (tmp_path / "mine/thesis.txt").read_text() == "years of work"


def test_tables_are_read_by_machines_and_papers(reports):
    table = table_of(reports["binary", "mos"], "preference_pairs")
    rows = list(csv.DictReader(io.StringIO(table_csv(table))))
    assert {row["condition"] for row in rows} == {"talkers", "voca"}
    share = float(rows[0]["all answers, %"])
    assert float(rows[0]["all answers, % low"]) < share < float(rows[0]["all answers, % high"])
    assert 1 < share < 100
    latex = table_latex(table)
    assert latex.count(r"\\") == 4 and r"all answers, \%" in latex and "nan" not in latex


EVIL = (
    "<script>alert(1)</script>",
    '"><img src=x onerror=alert(1)>',
    "</style><b>",
    '=HYPERLINK("http://a.example","b")',
    "+1+1",
    "@SUM(1)",
    "-2+3",
    "@TITLE@",
    "\\input{/etc/passwd}",
    "a\u202eb\x00c\nd",
    "{{x}} ${y}",
)


def test_what_strangers_write_is_shown_and_never_run():
    rows: list[list[str | int | float | ConfidenceInterval | None]] = [[each, 1.0] for each in EVIL]
    table = Table("evil", EVIL[0], ("word", "count"), rows, EVIL[1])
    report = Report(
        EVIL[0], [(EVIL[1], EVIL[2])], [Section("Words", EVIL, [], [table])], list(EVIL)
    )
    page = Page(page_text(report))
    assert not {"script", "img", "b"} & set(page.tags) and page.tags.count("style") == 1
    assert "@TITLE@" in page.shown
    cells = [row[0] for row in csv.reader(io.StringIO(table_csv(table)))]
    assert not [cell for cell in cells if cell[:1] in "=+-@\t\r" and cell]
    latex = table_latex(table)
    assert r"\input" not in latex and "\x00" not in latex and "\u202e" not in latex


def test_words_of_a_table_from_elsewhere_are_harmless():
    design, table = asked("intelligibility")
    given = [
        replace(each, stimulus="elsewhere.a.b", answer="<script>x</script>", correct="=1+1")
        if each.role == "test"
        else each
        for each in table
    ]
    report = make_report(design, given)
    assert "script" not in Page(page_text(report)).tags
    assert "=1+1" not in [c[:4] for c in table_csv(table_of(report, "word_answers")).split(",")]


def test_a_report_says_what_was_served_and_what_is_analysed():
    design, table = asked("binary", people=8)
    design = replace(design, sha256="a" * 64)
    report = make_report(design, table, served_sha256="b" * 64, answers_sha256="c" * 64)
    facts = dict(report.facts)
    assert facts["study analysed (SHA-256)"] == "a" * 64
    assert facts["study served (SHA-256)"] == "b" * 64
    assert facts["answers (SHA-256)"] == "c" * 64
    assert any("not the one that was served" in each for each in report.warnings)
    assert any("people are left" in each for each in report.warnings)
    same = make_report(design, table, served_sha256="a" * 64)
    assert not any("not the one" in each for each in same.warnings)


def test_answers_of_people_are_not_called_simulated():
    design, table = asked("binary", people=8)
    people = [
        replace(each, participant=each.participant.replace("simulated", "p")) for each in table
    ]
    assert NOT_PEOPLE not in make_report(design, people).warnings
    assert NOT_PEOPLE in make_report(design, people, simulated=True).warnings


def test_small_studies_are_reported_too():
    for kind, scale in KINDS:
        design, table = asked(kind, scale, people=1)
        if all(each.role != "test" for each in table):
            continue
        assert page_text(make_report(design, table))
    design, table = asked("binary")
    none = [each for each in table if each.role != "test"]
    with pytest.raises(StudyError, match="no test answers"):
        make_report(design, none)
    cheating = crowd_answers(design, Crowd(cheaters=1.0), seats_of(design, 6), 2)
    if any(each.role == "test" for each in cheating):
        assert page_text(make_report(design, cheating))


def test_the_crowd_is_that_of_its_seed_and_says_what_it_is():
    design = design_of(assignment=Assignment(trials=8))
    seats = seats_of(design, 6)
    first = crowd_answers(design, Crowd(LEVELS), seats, 3)
    assert first == crowd_answers(design, Crowd(LEVELS), seats, 3)
    assert first != crowd_answers(design, Crowd(LEVELS), seats, 4)
    assert all(each.participant.startswith("simulated-") for each in first)
    assert {each.group for each in first} == {1, 2, 3}
    with pytest.raises(StudyError, match="lapses"):
        Crowd(lapses=2)


def test_exact_power_by_counting_outcomes():
    """The figure for 100 answers, 60 against 50 %: 0.4621 (G*Power, exact, two-sided)."""
    plan = Plan(share=0.6, lapses=0)
    assert exact_power(plan, 100) == pytest.approx(0.4621, abs=5e-4)
    assert exact_power(Plan(share=0.6, lapses=1e-9), 1000) > 0.999
    assert exact_power(Plan(share=0.6, lapses=0.5), 100) < exact_power(plan, 100)


def test_simulated_power_is_exact_where_nobody_differs():
    plan = Plan(share=0.62, people_sd=0, stimuli_sd=0, trials=1, stimuli=400, lapses=0)
    found = power_with(plan, 120)
    assert found.power.value == pytest.approx(found.exact, abs=0.05)


def test_a_test_of_what_is_not_there_finds_it_as_rarely_as_it_says():
    plan = Plan(share=0.5, trials=10, stimuli=20, people_sd=0.8, stimuli_sd=0.4, simulations=2000)
    assert power_with(plan, 30).power.value < 0.065


def test_more_people_are_needed_where_they_differ_and_lapse():
    easy = plan_study(Plan(share=0.65, trials=10, stimuli=30, simulations=300))
    hard = plan_study(
        Plan(share=0.65, trials=10, stimuli=30, people_sd=1.5, lapses=0.2, simulations=300)
    )
    assert 5 < easy.people < hard.people
    assert (
        plan_study(Plan(share=0.53, trials=2, stimuli=2, stimuli_sd=2.0, simulations=100)).people
        == 0
    )


def test_a_plan_takes_what_its_study_says():
    plan = plan_for(design_of(analysis=Analysis(margin=0.2)), share=0.7)
    assert (plan.trials, plan.stimuli, plan.comparisons, plan.margin) == (8, 8, 3, 0.2)
    with pytest.raises(StudyError, match="a study of kind rating"):
        plan_for(design_of("rating"))


STUDY = """
[study]
title = "Three ways to speak"
kind = "binary"
contact = "ada@example.org"
[[conditions]]
name = "rules"
model = "articulation"
[[conditions]]
name = "voca"
model = "voca"
[stimuli]
sounds = ["a.wav", "b.wav", "c.wav", "d.wav"]
"""


@pytest.fixture(scope="module")
def study(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("typed") / "study.toml"
    path.write_text(STUDY)
    return path


def one_line(done: subprocess.CompletedProcess[str], *told: str) -> None:
    assert done.returncode == 2, done
    assert done.stderr.count("\n") == 1 and done.stderr.startswith("elocute: "), done.stderr
    assert all(each in done.stderr for each in told), done.stderr


def test_from_a_crowd_to_a_report_on_the_command_line(study, tmp_path):
    table, report = tmp_path / "answers.csv", tmp_path / "report"
    options = ("--people", 14, "--level", "rules=1.0", "--cheaters", 0.2)
    done = run_here("study", "simulate", study, "-o", table, *options)
    assert done.returncode == 0 and "14 simulated people" in done.stdout
    done = run_here("study", "report", study, "--answers", table, "-o", report, "--json")
    assert done.returncode == 0, done.stderr
    record = json.loads(done.stdout)
    assert record["study analysed (SHA-256)"] == hashlib.sha256(study.read_bytes()).hexdigest()
    assert record["answers (SHA-256)"] == hashlib.sha256(table.read_bytes()).hexdigest()
    assert str(report / "report.html") in record["outputs"]
    assert NOT_PEOPLE in done.stderr
    one_line(run_here("study", "report", study, "--answers", table, "-o", report), "already")
    again = run_here("study", "report", study, "--answers", table, "-o", report, "--overwrite")
    assert again.returncode == 0 and "people: " in again.stdout
    plan = run_here("study", "plan", study, "--share", 0.7, "--simulations", 100, "--json")
    assert json.loads(plan.stdout)["plan"]["stimuli"] == 4
    shown = run_here("study", "plan", "--share", 0.7, "--trials", 20, "--simulations", 100)
    assert re.search(r"\d+ people are needed for 80 %", shown.stdout)


def spoilt(text: str) -> dict[str, tuple[bytes, str]]:
    head, first, *rest = text.split("\n")
    cells = first.split(",")

    def row(**values: str) -> bytes:
        given = dict(zip(COLUMNS, cells, strict=True)) | values
        return "\n".join([head, ",".join(given[name] for name in COLUMNS), *rest]).encode()

    return {
        "empty": (b"", "no column `participant`"),
        "another table": (b"name,age\nbob,7\n", "no column `participant`"),
        "a column less": (text.replace("seconds", "time", 1).encode(), "no column `seconds`"),
        "no answers": (head.encode() + b"\n", "no test answers"),
        "bytes": (bytes(range(256)), ""),
        "another encoding": (text.encode("utf-32"), ""),
        "a NUL": (row(participant="a\x00b"), "row 1"),
        "an open quote": (row(participant='"abc'), ""),
        "a huge cell": (row(answer="x" * 300_000), ""),
        "a formula": (row(participant="=1+1"), "row 1 `participant`"),
        "script": (row(trial="<script>"), "row 1 `trial`"),
        "a path": (row(left="../../etc"), "row 1 `left`"),
        "an answer of others": (row(answer="=cmd|x"), "`answer`"),
        "a short row": ((text + "a,1,2\n").encode(), "row 2: no `trial`"),
        "no number": (row(order="first"), "row 1 `order`"),
        "a huge number": (row(replays="9" * 400), "row 1 `replays`"),
        "not a number": (row(seconds="nan"), "row 1 `seconds`"),
        "another time": (row(answered_at="yesterday"), "row 1 `answered_at`"),
        "another kind": (row(kind="guess"), "row 1 `kind`"),
        "another role": (row(role="admin"), "row 1 `role`"),
        "a row twice": ((text + first + "\n").encode(), "twice"),
    }


SPOILT = spoilt(
    ",".join(COLUMNS)
    + "\np1,1,1,a.b.c,binary,test,a.b.c,,rules,voca,rules,,3.5,0,2026-01-01T00:00:00.000+00:00\n"
)


@pytest.mark.parametrize("what", SPOILT)
def test_a_table_that_cannot_be_used_is_refused_in_one_line(study, tmp_path, what):
    data, told = SPOILT[what]
    table = tmp_path / "answers.csv"
    table.write_bytes(data)
    done = run_here("study", "report", study, "--answers", table, "-o", tmp_path / "report")
    one_line(done, told)
    assert len(done.stderr) < 1500 and not (tmp_path / "report").exists()


def test_a_table_of_gigabytes_is_not_read(study, tmp_path):
    table = tmp_path / "answers.csv"
    with table.open("wb") as file:
        file.truncate(3_000_000_000)  # takes no room on the disk
    done = run_here("study", "report", study, "--answers", table, "-o", tmp_path / "report")
    one_line(done, "answers.csv")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("report", "STUDY", "-o", "r"), "elocute study serve"),
        (("report", "nothing.toml", "-o", "r"), "nothing.toml"),
        (("report", "STUDY", "--answers", "a.txt", "-o", "r"), "a.txt"),
        (("simulate", "STUDY", "-o", "a.txt"), "a.txt"),
        (("simulate", "STUDY", "-o", "a.csv", "--level", "nobody=1"), "--level"),
        (("simulate", "STUDY", "-o", "a.csv", "--level", "rules=much"), "rules=much"),
        (("simulate", "STUDY", "-o", "a.csv", "--lapses", "2"), "--lapses"),
        (("plan", "--share", "0.5"), "--equivalent"),
        (("plan", "--share", "0.7", "--equivalent"), "--share"),
        (("plan", "--power", "1.5"), "--power"),
    ],
)
def test_what_cannot_be_done_is_told_in_one_line(study, tmp_path, monkeypatch, words, told):
    monkeypatch.chdir(tmp_path)
    typed = [str(study) if word == "STUDY" else word for word in words]
    one_line(run_here("study", *typed), told)
    assert not list(tmp_path.iterdir())


def test_a_table_of_another_suffix_is_reported_alike(study, tmp_path):
    from elocute.study.design.design_file import read_design

    design = read_design(study)
    answers = crowd_answers(design, Crowd(), seats_of(design, 5), 1)
    found = []
    for name in ("a.csv", "a.json"):
        write_answers(answers, tmp_path / name)
        out = tmp_path / f"{name}-report"
        assert (
            run_here("study", "report", study, "--answers", tmp_path / name, "-o", out).returncode
            == 0
        )
        found.append((out / "tables/preference_pairs.csv").read_text())
    assert found[0] == found[1]
    assert answers_text(answers, ".csv").startswith("participant,")
