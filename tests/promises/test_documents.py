"""What the documents name is there: commands parse, files exist, every number has a command."""

from __future__ import annotations

import ast
import importlib.metadata
import json
import re
import shlex
import tomllib
from pathlib import Path

import pytest

from tests.support.commands import run_python

ROOT = Path(__file__).parents[2]
CARDS = ROOT / "docs" / "cards"
MEASURED = ROOT / "docs" / "measurements"
PAGES = [*sorted(MEASURED.glob("*.md")), *sorted(CARDS.glob("*.md"))]
STARTS = ("python ", "elocute ", "make ", "pytest ", "du ")
PROGRAMS = [
    path for folder in ("recipes", "benchmarks") for path in sorted((ROOT / folder).rglob("*.py"))
]


def spans(text: str) -> list[str]:
    """Code in backticks, which may run over the end of a line."""
    without_blocks = re.sub(r"```.*?```", "", text, flags=re.S)
    return [" ".join(found.split()) for found in re.findall(r"`([^`]+)`", without_blocks)]


def commands(text: str) -> list[str]:
    """Commands among the code of a page; `a && b` are two."""
    found = [part.strip() for span in spans(text) for part in span.split(" && ")]
    return [part for part in found if part.startswith(STARTS)]


def program_and_arguments(command: str) -> list[str] | None:
    """What parse_commands.py takes; None for make and pytest, which are looked at otherwise."""
    words = shlex.split(command)
    if words[0] == "elocute":
        return words
    if words[:2] == ["python", "-m"] and words[2].startswith(("recipes.", "benchmarks.")):
        return words[2:]
    assert not words[1].startswith(("recipes/", "benchmarks/")), f"{command}: run them by -m"
    return None


def commands_of_a_docstring(path: Path) -> list[str]:
    """Indented lines that begin with `python` or `elocute`, without the remark after them."""
    text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    found = re.findall(r"^ *((?:python|elocute) .*)$", text, re.M)
    plain = (re.split(r"  |#", command)[0] for command in found)
    return [re.sub(r"[\[\]]", "", command).strip() for command in plain]


def problems_of(asked: list[list[str]]) -> list[str]:
    """What the commands' own parsers say, "" where they take the arguments."""
    parser = "tests.promises.parse_commands"
    done = run_python("-m", parser, input=json.dumps(asked), check=True, cwd=ROOT)
    return json.loads(done.stdout)


def targets() -> set[str]:
    return set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M))


def test_every_command_of_the_pages_parses():
    told = {
        (page.name, command)
        for page in PAGES
        for command in commands(page.read_text(encoding="utf-8"))
    }
    told |= {(path.name, command) for path in PROGRAMS for command in commands_of_a_docstring(path)}
    asked = sorted(
        (page, command, words)
        for page, command in told
        if (words := program_and_arguments(command)) is not None
    )
    assert len(asked) > 60
    problems = {
        f"{page}: {command}": problem
        for (page, command, _), problem in zip(
            asked, problems_of([words for *_, words in asked]), strict=True
        )
        if problem
    }
    assert problems == {}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_test_and_target_of_a_page_exists(page):
    for command in commands(page.read_text(encoding="utf-8")):
        program, *words = shlex.split(command)
        if program == "make":
            assert words[0] in targets(), command
        if program == "pytest":
            for word in words:
                assert word.startswith("-") or (ROOT / word.split("::")[0]).exists(), command


def test_a_command_that_is_wrong_is_told():
    right = [
        ["benchmarks.crnn", "--seconds", "10"],
        ["elocute", "evaluate", "noise", "corpus", "--noise", "white"],
    ]
    wrong = [
        ["benchmarks.crnn", "--hours", "10"],
        ["benchmarks.alignment", "sentences"],
        ["benchmarks.nothing"],
        ["elocute", "evaluate", "noise", "corpus", "--loudness", "3"],
        ["elocute", "evaluate", "taste"],
    ]
    told = problems_of(right + wrong)
    assert [bool(problem) for problem in told] == [False] * len(right) + [True] * len(wrong), told


@pytest.mark.parametrize(
    "page",
    [page for page in MEASURED.glob("*.md") if page.name not in ("index.md", "scale.md")],
    ids=lambda page: page.name,
)
def test_every_table_of_measurements_has_a_command_in_its_section(page):
    sections = re.split(r"^(?=#+ )", page.read_text(encoding="utf-8"), flags=re.M)[1:]
    bare = [
        section.splitlines()[0]
        for section in sections
        if re.search(r"^\|---", section, re.M) and not commands(section)
    ]
    assert bare == []


def test_the_index_of_measurements_names_every_page():
    named = re.findall(r"\]\(([\w-]+\.md)\) \|", (MEASURED / "index.md").read_text("utf-8"))
    assert {*named, "index.md"} == {page.name for page in MEASURED.glob("*.md")}


def test_every_shipped_asset_is_named_in_the_notice():
    notice = (ROOT / "NOTICE").read_text(encoding="utf-8")
    shipped = [
        path
        for folder in (ROOT / "src" / "elocute").rglob("assets")
        for path in folder.iterdir()
        if path.is_file() and path.suffix not in (".sha256", ".py")
    ]
    assert len(shipped) >= 6
    assert [path.name for path in shipped if path.name not in notice] == []


def test_every_card_that_is_named_exists_and_every_card_is_named():
    notice = (ROOT / "NOTICE").read_text(encoding="utf-8")
    named = set(re.findall(r"docs/cards/(\w+\.md)", notice))
    assert named == {path.name for path in CARDS.glob("*.md")}


def test_every_dependency_has_its_licence_in_the_table():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wanted = list(project["dependencies"])
    for extra in project["optional-dependencies"].values():
        wanted += extra
    table = (CARDS / "dependencies.md").read_text(encoding="utf-8")
    rows = {line.split("|")[1].strip() for line in table.splitlines() if line.startswith("| ")}
    assert {plain(name) for name in wanted} <= rows


def test_what_is_installed_with_the_run_time_is_in_the_table_too():
    """Every distribution that a plain `pip install elocute` brings, followed to the end."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    waiting, seen = [plain(name) for name in project["dependencies"]], set()
    while waiting:
        name = waiting.pop()
        if name in seen:
            continue
        seen.add(name)
        for need in importlib.metadata.requires(name) or []:
            if ";" not in need:
                waiting.append(plain(need))
    table = (CARDS / "dependencies.md").read_text(encoding="utf-8")
    assert [name for name in sorted(seen) if name not in table.lower()] == []


def plain(requirement: str) -> str:
    """`Markdown_it-py>=3` as `markdown-it-py`."""
    found = re.match(r"[\w.-]+", requirement)
    assert found
    return re.sub(r"[-_.]+", "-", found.group()).lower()
