"""What the README and the pages of docs/ say to type is typed here: commands and Python.

Files that a command names are made small, once for all pages. What would take hours, or needs
another's data or another program, stands in its page behind a comment that says so:

    <!-- not run: REASON -->

There the options are at least understood.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import pickle
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import pytest
import soundfile
from typer.main import get_command

from elocute.audio.espeak import has_espeak
from elocute.audio.line_table import Line, read_lines
from elocute.audio.voice_settings import VoiceSettings
from elocute.cli import main
from elocute.cli.app import command_line
from tests.support.commands import run_apart, run_python

ROOT = Path(__file__).parents[1]
PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    ROOT / "SECURITY.md",
    *sorted((ROOT / "docs").rglob("*.md")),
]
NOT_RUN_MAX = 5
BLOCK = re.compile(r"^(?:<!-- not run: (.+?) -->\n+)?```(\w+)\n(.*?)^```", re.M | re.S)


@dataclass(frozen=True)
class Block:
    """Code of a page; `not_run` says why it only has to be understood, or is empty."""

    page: str
    kind: str
    text: str
    not_run: str

    @property
    def lines(self) -> list[str]:
        """Commands without their comments."""
        typed = (re.split(r"\s+# ", line)[0].strip() for line in self.text.split("\n"))
        return [line for line in typed if line]


def blocks_of(page: Path) -> list[Block]:
    text, name = page.read_text(encoding="utf-8"), page.relative_to(ROOT).as_posix()
    return [Block(name, kind, code, why or "") for why, kind, code in BLOCK.findall(text)]


BLOCKS = [block for page in PAGES for block in blocks_of(page)]
SHELL = [block for block in BLOCKS if block.kind == "sh"]
PYTHON = {
    page: [b.text for b in BLOCKS if b.page == page and b.kind == "python"]
    for page in dict.fromkeys(b.page for b in BLOCKS if b.kind == "python")
}
LOOKS = ("python -c ", "ls ")
LINES = [line for block in SHELL for line in block.lines]
RUN = dict.fromkeys(
    line for b in SHELL if not b.not_run for line in b.lines if line.startswith("elocute ")
)
UNDERSTOOD = dict.fromkeys(
    line for b in SHELL if b.not_run for line in b.lines if line.startswith("elocute ")
)
NAMED = {
    " ".join(found.split())
    for page in PAGES
    for found in re.findall(
        r"`elocute ([a-z][a-z ]*[a-z])(?: [^`]*)?`",
        re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.S),
    )
}

SPEECH_S = 0.7
SPOKEN = (
    "Hello. Give me any voice, and I will give it a face. My mouth closes on p, b and m. "
    "Five wolves move through the blue fog. Now I rest."
)
KNOWN = {
    "speech.txt": "Guten Morgen.",
    "lines.csv": "id,text,voice\na,Hello Bob.,f2\n",
    "speech.TextGrid": 'File type = "ooTextFile"\nObject class = "TextGrid"\n\n0\n0.7\n<exists>\n'
    '1\n"IntervalTier"\n"phones"\n0\n0.7\n2\n0\n0.3\n"M"\n0.3\n0.7\n"AE1"\n',
    "speech.json": '[{"AudioOffset": 500000, "VisemeId": 21}, {"AudioOffset": 2e6, "VisemeId": 2}]',
}
"""What is known of speech.wav and of lines to be spoken."""
SMALLER = {
    r"say .*\.mp4": "--size 64 --fps 10",
    r"animate .*\.mp4": "--size 64 --fps 10",
    r"render .*\.mp4": "--size 64 --fps 10",
    r"head sample": "--size 128",
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


def speech(seconds: float = SPEECH_S) -> tuple[np.ndarray, int]:
    samples, rate = soundfile.read(ROOT / "src/elocute/assets/example.flac", dtype="float32")
    first = 0 if seconds > 5 else rate
    return samples[first : first + round(seconds * rate)], rate


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Files that were made already, by name."""
    return {"": tmp_path_factory.mktemp("documented")}


@pytest.fixture(scope="module")
def give(made: dict[str, Path], request: pytest.FixtureRequest, run: Callable) -> Callable:
    """give("talk.npz") makes that file once, with what it needs."""

    def make(name: str, place: Path) -> None:
        if name.endswith(".wav"):
            samples, rate = speech(11 if name == "reading.wav" else SPEECH_S)
            soundfile.write(place, samples, rate)
        elif name == "clips":
            place.mkdir()
            for clip in ("a.wav", "b.wav"):
                soundfile.write(place / clip, *speech())
        elif name == "talk.npz":
            run("animate", one("reading.wav"), "-o", place)
        elif name == "vertices.npy":
            run("animate", one("speech.wav"), "-o", place, "--fps", 10)
        elif name in ("corpus", "captured", "build/corpus"):
            request.getfixturevalue("make_corpus")(place, vertices=True, fps=30.0)
        elif name == "sequence":
            run(
                "capture",
                "simulate",
                one("speech.wav"),
                "-o",
                place,
                "--seconds",
                0.05,
                "--points",
                15000,
            )
        elif name == "face.ply":
            shutil.copy(one("sequence") / "00000.ply", place)
        elif name == "speech.npz":
            run("blendshapes", "learn", one("corpus"), "-o", place, "--components", 3)
        elif name == "trained/model.onnx":
            shutil.copy(request.getfixturevalue("learned").model, place)
        elif name == "of_flame/model.onnx":
            corpus, trained = place.with_name("corpus"), place.with_name("trained")
            run("corpus", "convert", one("VOCASET"), "-o", corpus)
            run("train", "voca", corpus, "-o", trained, "--epochs", 1)
            shutil.copy(trained / "model.onnx", place)
        elif name == "captured/corpus":
            shutil.copytree(one("corpus"), place)
        elif name in ("mine.json", "new.json"):
            run(
                "style",
                "fit",
                one("talk.npz"),
                "--sound",
                one("speech.wav"),
                "--model",
                one("trained/model.onnx"),
                *(["--new"] if name == "new.json" else []),
                "-o",
                place,
            )
        elif name == "shards":
            shutil.copytree(request.getfixturevalue("speech_shards").folder, place)
        elif name == "recordings":
            shutil.copytree(request.getfixturevalue("speech_shards").sound_root, place)
        elif name == "drafts/ann.r000.json":
            run(
                "words",
                "segment",
                one("reading.wav"),
                "--text-file",
                one("reading.txt"),
                "-o",
                place,
            )
        elif name == "edit.TextGrid":
            run(
                "words",
                "check",
                one("drafts/ann.r000.json"),
                one("reading.wav"),
                "-o",
                place.with_name("page.html"),
                "--textgrid",
                place,
            )
        elif name == "reading.txt":
            place.write_text(SPOKEN)
        elif name in ("speech.txt", "lines.csv", "speech.TextGrid", "speech.json"):
            place.write_text(KNOWN[name])
        elif name in ("vocaset", "ours", "theirs"):
            _make_benchmark(place, truth=name == "vocaset")
        elif name in ("VOCASET", "generic_model.pkl"):
            _make_vocaset(place, name, request)
        elif name == "flame.npz":
            run("head", "adopt", one("generic_model.pkl"), "-o", place)
        elif name == "flame_talk.npz":
            head = one("flame.npz")
            run("animate", one("speech.wav"), "--head", head, "--fps", 5, "-o", place)
        elif name == "parameters.npz":
            solve = "solve", one("flame_talk.npz"), "--flame", one("generic_model.pkl")
            run(*solve, "-o", place)
        elif name == "tracked":
            _make_tracked(place)
        elif name == "flame_corpus":
            _make_flame_corpus(place, one("generic_model.pkl"))
        else:
            pytest.fail(f"a page names {name}, which nothing here makes")

    def one(name: str) -> Path:
        if name not in made:
            place = made[""] / name
            place.parent.mkdir(exist_ok=True, parents=True)
            make(name, place)
            made[name] = place
        return made[name]

    return one


def _make_tracked(place: Path) -> None:
    """Two talkers whose mouths follow the loudness of what they say."""
    (place / "clips").mkdir(parents=True)
    samples, rate = speech()
    times = np.arange(round(len(samples) / rate * 25)) / 25
    loud = [np.abs(samples[round(t * rate) : round((t + 0.04) * rate)]).mean() for t in times]
    opening = np.array(loud) / max(loud) * 0.1
    fields = {"t": times, "valid": np.ones(len(times)), "inner_opening_mean": opening}
    records = []
    for name, talker in (("one", "ann"), ("two", "bob")):
        soundfile.write(place / "clips" / f"{name}.wav", samples, rate)
        np.savez(place / "clips" / f"{name}.npz", lip_width=0.6 - opening, words="[]", **fields)
        records.append({"id": name, "speaker": talker, "language": "en", "offset_s": 0.0})
    (place / "manifest.json").write_text(json.dumps({"clips": records}))


def _make_benchmark(place: Path, *, truth: bool) -> None:
    """A test clip of VOCASET as FaceFormer keeps it, or a prediction of it."""
    from elocute.corpus.importers.published_splits import VOCASET_TEST

    subject = VOCASET_TEST[0]
    face = np.random.default_rng(0).uniform(-0.1, 0.1, (5023, 3))
    frames = np.repeat(face.astype(np.float32)[None], 8, axis=0)
    folder = place / "vertices_npy" if truth else place
    folder.mkdir(parents=True)
    condition = "" if truth else f"_condition_{subject}"
    np.save(folder / f"{subject}_sentence21{condition}.npy", frames.reshape(8, -1))
    if truth:
        (place / "templates.pkl").write_bytes(pickle.dumps({subject: face}))


def _make_vocaset(place: Path, name: str, request: pytest.FixtureRequest) -> None:
    from elocute.corpus.importers import published_splits

    python2: Any = request.getfixturevalue("python2")
    if name == "VOCASET":
        people = (
            published_splits.VOCASET_TRAIN[0],
            published_splits.VOCASET_TRAIN[1],
            published_splits.VOCASET_VALIDATION[0],
            published_splits.VOCASET_TEST[0],
        )
        request.getfixturevalue("sources").write_vocaset(place, python2, people)
    else:
        from tests.support.flame_layout import flame_layout

        place.write_bytes(python2.dumps(flame_layout().entries))


def _make_flame_corpus(place: Path, flame: Path) -> None:
    """Two sentences of one subject on FLAME's mesh, a few frames each."""
    from elocute.audio.waveform import Waveform
    from elocute.corpus.clip import Clip
    from elocute.corpus.corpus_writing import corpus_writer
    from elocute.head.flame import flame_vertices, load_flame

    model = load_flame(flame)
    with corpus_writer(
        place, {"ada": model.template.astype(np.float32)}, fps=60, topology="flame"
    ) as writer:
        for sentence in ("one", "two"):
            pose = np.zeros((3, 15))
            pose[:, 6] = [0, 0.1, 0.2]
            frames = flame_vertices(model, expression=[0.5, -1], pose=pose).astype(np.float32)
            sound = Waveform(np.zeros(800, np.float32), 16000)
            writer.add(Clip("ada", sentence, "", sound, frames))


@pytest.fixture(scope="module")
def run() -> Callable[..., str]:
    """Type a command; it succeeds. In this process: dozens of new ones would take their time."""

    def typed(*arguments: object) -> str:
        out, err, kept = io.StringIO(), io.StringIO(), signal.getsignal(signal.SIGINT)
        with (
            mock.patch.object(sys, "argv", ["elocute", *map(str, arguments)]),
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(err),
            pytest.raises(SystemExit) as left,
        ):
            main()
        signal.signal(signal.SIGINT, kept)
        assert left.value.code == 0, f"{arguments}: {err.getvalue()}{out.getvalue()}"
        return out.getvalue()

    return typed


def split(line: str) -> tuple[list[str], list[str]]:
    """The words of a command after its first, and those among them that name what is read."""
    words = shlex.split(line)[1:]
    reads = [
        word.rstrip("/")
        for before, word in zip(["", *words], words, strict=False)
        if re.search(
            r"\.(wav|npz|npy|onnx|pkl|ply|json|txt|TextGrid|mp4)$|/|^VOCASET|^lines.csv", word
        )
        and before not in ("-o", "--output", "--plot", "--textgrid")
    ]
    return words, reads


@pytest.mark.parametrize("line", RUN)
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
    ):
        if words[0] == extra:
            pytest.importorskip(package)
    if words[0] == "say" or "--text-file" in words:
        need(has_espeak(), "espeak-ng")
    monkeypatch.chdir(tmp_path)
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


def understood(words: list[str]) -> bool:
    """Whether the option parser takes them. Raises as it does."""
    command: Any = get_command(command_line())
    context, rest = command.make_context("elocute", list(words), resilient_parsing=True), words
    while hasattr(command, "commands"):
        command, rest = command.commands[rest[0]], rest[1:]
        context = command.context_class(command, parent=context)
    command.parse_args(context, list(rest))
    return True


@pytest.mark.parametrize("line", UNDERSTOOD)
def test_a_command_that_is_not_run_is_understood(line: str) -> None:
    assert understood(shlex.split(line)[1:])


def test_few_blocks_are_not_run_and_each_says_why() -> None:
    told = [block for block in BLOCKS if block.not_run]
    assert len(told) <= NOT_RUN_MAX and all(len(block.not_run) > 20 for block in told)
    marks = sum(page.read_text(encoding="utf-8").count("<!-- not run") for page in PAGES)
    assert marks == len(told)  # each stands right before a block


@pytest.mark.parametrize("name", sorted(NAMED))
def test_a_command_that_a_sentence_names_is_there(name: str) -> None:
    command: Any = get_command(command_line())
    for word in name.split():
        if not hasattr(command, "commands"):
            return  # what follows is no command's name
        assert word in command.commands
        command = command.commands[word]


@pytest.mark.parametrize(
    "line",
    dict.fromkeys(line for line in LINES if line.startswith("python -m ")),
)
def test_a_script_says_how_it_is_used(line: str) -> None:
    module = line.removeprefix("python -m ").split()[0]
    script = (ROOT / module.replace(".", "/")).with_suffix(".py")
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
    )
    assert [line for line in LINES if not line.startswith(kinds)] == []
    assert {block.kind for block in BLOCKS} <= {"sh", "python", "csv", "text"}


@pytest.mark.parametrize("table", [block.text for block in BLOCKS if block.kind == "csv"])
def test_tables_of_lines_are_read(table: str, tmp_path: Path) -> None:
    place = tmp_path / "lines.csv"
    place.write_text(table, encoding="utf-8")
    lines = read_lines(place, VoiceSettings())
    assert lines and all(isinstance(line, Line) for line in lines)


@pytest.mark.parametrize("page", PYTHON)
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
    if "training" in code or "aligner" in code:
        pytest.importorskip("lightning_fabric")
        pytest.importorskip("numba")
    monkeypatch.chdir(tmp_path)
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
    ):
        if f'"{name}' in code:
            given = give(name)
            (shutil.copytree if given.is_dir() else shutil.copy)(given, tmp_path / name)
    import elocute

    sounds = [give(f"{name}.wav") for name in ("one", "two", "three")]
    samples = elocute.read_audio(sounds[0], sample_rate=48000).samples
    blocks = [samples[at : at + 4800] for at in range(0, len(samples), 4800)]
    exec(code, {"recordings": sounds, "blocks": blocks})
