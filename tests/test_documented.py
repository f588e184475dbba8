"""What the README and the pages of docs/ say to type is typed here: commands and Python.

Files that a command names are made small, once for all pages. What would take hours, or needs
another's data or another program, stands in its page behind a comment that says so:

    <!-- not run: REASON -->

There the options are at least understood.
"""

from __future__ import annotations

import functools
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from elocute.cli.app import command_line
from elocute.cli.line_table import Line, read_lines
from elocute.speech.voices.settings import VoiceSettings
from tests.support.commands import run_apart, run_here, run_python
from tests.support.documented_files import file_maker
from tests.support.documented_pages import (
    BLOCKS,
    FIRST_PAGES,
    LINES,
    LOOKS,
    NAMED,
    PAGES,
    PYTHON,
    ROOT,
    RUN,
    UNDERSTOOD,
)
from tests.support.espeak import has_espeak
from tests.support.once_a_run import folder_of_run

NOT_RUN_MAX = 5
WRITES = ("-o", "--output", "--into", "--plot", "--textgrid", "--participants", "--export")
"""Options before the name of what is written."""
SMALLER = {
    r"say .*\.mp4": "--size 64 --fps 10",
    r"animate .*\.(mp4|webm|mov)": "--size 64 --fps 10",
    r"(render|edit) .*\.mp4": "--size 64 --fps 10",
    r"head sample": "--size 128 --count 3",
    r"capture scans": "--jobs 1",
    r"capture simulate": "--seconds 0.05 --points 15000",
    r"train voca": "--epochs 1",
    r"train karras": "--epochs 1",
    r"train crnn": "--epochs 1",
    r"propagate": "--method dtw",
    r"align ": "--method dtw",
    r"blendshapes learn": "--components 3",
}
"""What is added so that a command takes a second; the last of two options holds."""
SMALLER_PYTHON = {"epochs=50": "epochs=1", "1920, 1080": "64, 64", '"dcaw"': '"ctw"'}


@pytest.fixture(scope="module")
def give(
    tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest, run: Callable
) -> Callable:
    """give("talk.npz") makes that file once."""
    folder = folder_of_run(tmp_path_factory) / "documented"
    folder.mkdir(exist_ok=True)
    return file_maker(folder, request, run)


@pytest.fixture(scope="module")
def run() -> Callable[..., str]:
    """Type a command; it succeeds. In this process: dozens of new ones would take their time."""

    def typed(*arguments: object) -> str:
        done = run_here(*arguments)
        assert done.returncode == 0, f"{arguments}: {done.stderr}{done.stdout}"
        return done.stdout

    return typed


def split(line: str) -> tuple[list[str], list[str]]:
    """The words of a command after its first, and those among them that name what is read."""
    words = shlex.split(line)[1:]
    reads = [
        word.rstrip("/")
        for before, word in zip(["", *words], words, strict=False)
        if re.search(
            r"\.(wav|npz|npy|onnx|pkl|ply|json|toml|txt|TextGrid|mp4|glb)$|/|^VOCASET|^(lines|recordings|answers|trial|recorded).csv",
            word,
        )
        and before not in WRITES
    ]
    return words, reads


def by_page(pages: dict[str, str]) -> list[Any]:
    """What is on no page that everybody reads is marked slow."""
    return [
        pytest.param(what, marks=[] if page in FIRST_PAGES else [pytest.mark.slow])
        for what, page in reversed(pages.items())
    ]


@pytest.mark.parametrize("line", by_page(RUN))
def test_a_command_runs(
    line: str,
    give: Callable,
    run: Callable,
    need: Callable,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    words, reads = split(line.replace("calm:", "tense:"))  # what the small model knows
    for extra, package in (
        ("train", "lightning_fabric"),
        ("propagate", "pyarrow"),
        ("align", "numba"),
        ("words", "pocketsphinx"),
        ("study", "sqlalchemy"),
        ("study", "matplotlib"),
        ("studio", "fastapi"),
    ):
        if words[0] == extra:
            pytest.importorskip(package)
    if words[0] == "say" or {"--text-file", "--transcribe"} & set(words):
        need(has_espeak(), "espeak-ng")
    monkeypatch.chdir(tmp_path)
    if "recordings.csv" in reads:
        reads.append("reading.wav")
    if "takes/line.elocute.json" in reads:
        reads.append("takes/line.wav")
    if "study.toml" in reads:
        reads += ["ours", "theirs"]
    for name in reads:
        place = tmp_path / name
        place.parent.mkdir(parents=True, exist_ok=True)
        wanted = "of_flame/model.onnx" if "generic_model" in line and "onnx" in name else name
        if name == "speech.wav" and "--from" in line:
            wanted = "reading.wav"  # long enough for what is cut out of talk.npz
        given = give(wanted)
        (shutil.copytree if given.is_dir() else shutil.copy)(given, place)
    for pattern, more in SMALLER.items():
        if re.match(f"elocute {pattern}", line):
            words += shlex.split(more)
    for before, word in pairwise(words):
        if before == "-o" and "/" in word.rstrip("/"):
            Path(word).parent.mkdir(exist_ok=True)
    if "<" in words:
        piped(words)
        return
    run(*words)
    for before, word in pairwise(words):
        if before in ("-o", "--plot", "--textgrid"):
            made = Path(word)
            assert made.is_file() or any(made.iterdir()), f"{word} is empty"


def piped(words: list[str]) -> None:
    """A command between pipes, as a shell sets them up: JSON comes out."""
    place = words.index("<")
    with Path(words[place + 1]).open("rb") as given:
        done = run_apart(*words[:place], stdin=given, check=True)
    assert json.loads(done.stdout)["frames"]


@functools.cache
def whole_command() -> Any:
    """`elocute` with all its commands, put together once."""
    return get_command(command_line())


def understood(words: list[str]) -> bool:
    """Whether the option parser takes them. Raises as it does."""
    command: Any = whole_command()
    context, rest = command.make_context("elocute", list(words), resilient_parsing=True), words
    while hasattr(command, "commands"):
        command, rest = command.commands[rest[0]], rest[1:]
        context = command.context_class(command, parent=context)
    command.parse_args(context, list(rest))
    return True


@pytest.mark.parametrize("line", [*UNDERSTOOD, *(line for line in RUN if "<" not in line)])
def test_a_command_is_understood(line: str) -> None:
    """Those that are not run, and those that only CI runs."""
    assert understood(shlex.split(line)[1:])


def test_few_blocks_are_not_run_and_each_says_why() -> None:
    told = [block for block in BLOCKS if block.not_run]
    assert len(told) <= NOT_RUN_MAX and all(len(block.not_run) > 20 for block in told)
    marks = sum(page.read_text(encoding="utf-8").count("<!-- not run") for page in PAGES)
    assert marks == len(told)  # each stands right before a block


@pytest.mark.parametrize("name", sorted(NAMED))
def test_a_command_that_a_sentence_names_is_there(name: str) -> None:
    command: Any = whole_command()
    for word in name.split():
        if not hasattr(command, "commands"):
            return  # what follows is no command's name
        assert word in command.commands
        command = command.commands[word]


SCRIPTS = dict.fromkeys(
    line for line in LINES if re.match(r"python -m (benchmarks|elocute|recipes)\.", line)
)


@pytest.mark.slow
@pytest.mark.parametrize("line", SCRIPTS)
def test_a_script_says_how_it_is_used(line: str) -> None:
    module = line.removeprefix("python -m ").split()[0]
    room = ROOT / "src" if module.startswith("elocute") else ROOT
    script = (room / module.replace(".", "/")).with_suffix(".py")
    if "argparse" not in script.read_text(encoding="utf-8"):
        compile(script.read_text(encoding="utf-8"), script, "exec")
        return
    done = run_python("-m", module, "--help", cwd=ROOT)
    assert done.returncode == 0 and "usage" in done.stdout, done.stderr
    for option in re.findall(r"--[\w-]+", line):
        assert option in done.stdout


@pytest.mark.parametrize("line", [line for line in LINES if line.startswith(LOOKS)])
def test_a_look_at_what_is_installed_runs_in_a_shell(line: str) -> None:
    path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
    done = subprocess.run(line, shell=True, capture_output=True, env=os.environ | {"PATH": path})
    assert done.returncode == 0 and done.stdout, done.stderr


def test_what_is_installed_and_made_is_there() -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"][
        "optional-dependencies"
    ]
    groups = re.findall(r'"\.\[([\w,]+)\]"', "\n".join(LINES))
    named = {name for group in groups for name in group.split(",")}
    assert named and named <= set(extras)
    goals = re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(), re.M)
    wanted = [line.split()[1] for line in LINES if line.startswith("make ")]
    assert wanted and set(wanted) <= set(goals)


def test_every_line_is_of_a_kind_that_is_tested() -> None:
    kinds = (
        "elocute ",
        "python -m recipes.",
        "python -m benchmarks.",
        "make ",
        "pip install ",
        *LOOKS,
        # By tests of their own.
        "python examples/browser/make.py ",
        "python -m elocute.models.browser_tables ",
        "python scripts/blender_extension.py",
        # Programs of others.
        "(cd web && npm ci)",
        "npm install onnxruntime-web@",
        "python -m http.server ",
    )
    assert [line for line in LINES if not line.startswith(kinds)] == []
    assert {block.kind for block in BLOCKS} <= {"sh", "python", "csv", "json", "js", "text", "toml"}


@pytest.mark.parametrize("table", [block.text for block in BLOCKS if block.kind == "csv"])
def test_tables_of_lines_are_read(table: str, tmp_path: Path) -> None:
    place = tmp_path / "lines.csv"
    place.write_text(table, encoding="utf-8")
    lines = read_lines(place, VoiceSettings())
    assert lines and all(isinstance(line, Line) for line in lines)


def test_the_edit_list_of_the_page_is_the_example() -> None:
    shown = [
        json.loads(b.text) for b in BLOCKS if b.kind == "json" and '"elocute": "edits"' in b.text
    ]
    examples = [json.loads(p.read_text()) for p in (ROOT / "examples").glob("*.json")]
    assert shown and all(each in examples for each in shown)


@pytest.mark.parametrize("page", by_page({page: page for page in PYTHON}))
def test_python_of_a_page_runs(
    page: str,
    give: Callable,
    need: Callable,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """From top to bottom in one namespace, as a reader types it."""
    code = "\n".join(PYTHON[page])
    for large, small in SMALLER_PYTHON.items():
        code = code.replace(large, small)
    if "elocute.agents" in code:  # the page is run with them in tests/agents/test_page.py
        pytest.importorskip("pipecat")
        pytest.importorskip("livekit")
    if "training" in code or "aligner" in code:
        pytest.importorskip("lightning_fabric")
        pytest.importorskip("numba")
    monkeypatch.chdir(tmp_path)
    if "elocute.study" in code:
        pytest.importorskip("matplotlib")
    if "say(" in code:
        need(has_espeak(), "espeak-ng")
    for name in (
        "speech.wav",
        "speech.TextGrid",
        "talk.npz",
        "corpus",
        "shards",
        "recordings",
        "parameters.npz",
        "generic_model.pkl",
        "hero.glb",
        "studies/example.toml",
        "takes",
    ):
        if f'"{name}' in code:
            given = give(name)
            (tmp_path / name).parent.mkdir(exist_ok=True)
            (shutil.copytree if given.is_dir() else shutil.copy)(given, tmp_path / name)
    import elocute

    sounds = [give(f"{name}.wav") for name in ("one", "two", "three")]
    samples = elocute.read_audio(sounds[0], sample_rate=48000).samples
    blocks = [samples[at : at + 4800] for at in range(0, len(samples), 4800)]
    exec(code, {"recordings": sounds, "blocks": blocks, "chunk": blocks[0]})
