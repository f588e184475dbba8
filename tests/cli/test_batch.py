"""Edit lists on the command line, and many takes in one run: tables, folders, resuming."""

from __future__ import annotations

import contextlib
import json
import shutil
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile

from elocute.files import atomic
from elocute.jobs.pool import one_after_another
from tests.support.commands import run_here

FAST = ("--format", "csv", "--fps", 25)
EDITS = {
    "elocute": "edits",
    "version": 1,
    "edits": [{"edit": "amplitude", "regions": {"jaw": 1.3}}],
}


@pytest.fixture(scope="module")
def sounds(tmp_path_factory: pytest.TempPathFactory, speech_wav: Path) -> Path:
    """A folder with two short recordings and, below, a third."""
    folder = tmp_path_factory.mktemp("sounds")
    samples, rate = soundfile.read(speech_wav)
    (folder / "more").mkdir()
    for number, name in enumerate(("a.wav", "b.wav", "more/c.wav")):
        start = int((2 + number) * rate)
        soundfile.write(folder / name, samples[start : start + rate // 2], rate)
    (folder / "take.json").write_text(json.dumps(EDITS))
    return folder


@pytest.fixture
def place(sounds: Path, tmp_path: Path) -> Path:
    shutil.copytree(sounds, tmp_path / "in")
    return tmp_path


def refused(*arguments: object) -> str:
    done = run_here(*arguments)
    assert done.returncode == 2, done.stderr
    assert done.stderr.count("\n") == 1
    return done.stderr


def states(folder: Path) -> dict[str, tuple[int, int]]:
    files = [p for p in folder.rglob("*") if p.is_file()]
    return {
        p.relative_to(folder).as_posix(): (p.stat().st_ino, p.stat().st_mtime_ns) for p in files
    }


def test_edits_are_applied_to_speech_and_to_stored_motion_alike(place: Path):
    sound, edits = place / "in/a.wav", place / "in/take.json"
    wanted = (("plain.npz", ()), ("plain.csv", ()), ("one.csv", ("--edits", edits)))
    for target, more in wanted:
        done = run_here("animate", sound, "-o", place / target, *more)
        assert done.returncode == 0, done.stderr
    done = run_here("edit", place / "plain.npz", "--edits", edits, "-o", place / "two.csv")
    assert done.returncode == 0, done.stderr
    assert (place / "one.csv").read_text() == (place / "two.csv").read_text()
    assert (place / "one.csv").read_text() != (place / "plain.csv").read_text()


def test_a_mistake_in_a_list_is_told_before_anything_is_made(place: Path):
    wrong = place / "wrong.json"
    wrong.write_text(json.dumps({**EDITS, "edits": [{"edit": "amplitudde"}]}))
    for command in ("animate", place / "in/a.wav"), ("edit", place / "in/a.wav"):
        told = refused(*command, "--edits", wrong, "-o", place / "x.csv")
        assert f"{wrong}: edits[0].edit: 'amplitudde'" in told and "did you mean" in told
    told = refused("animate", place / "in/a.wav", "--edits", place / "no.json", "-o", "x.csv")
    assert "no.json" in told
    assert not (place / "x.csv").exists()


def test_an_output_never_replaces_the_list(place: Path):
    edits = place / "in/take.json"
    told = refused(*("animate", place / "in/a.wav", "--edits", edits, "-o", edits, "--overwrite"))
    assert "take.json" in told and json.loads(edits.read_text()) == EDITS


def test_a_table_of_recordings_has_edits_and_is_resumed(place: Path):
    table, out = place / "in/lines.csv", place / "takes"
    table.write_text("id,audio,edits\none,a.wav,\ntwo,a.wav,take.json\nbad,b.wav,no.json\ntext,,\n")
    command = ("animate", "--table", table, "-o", out, *FAST)
    done = run_here(*command)
    assert done.returncode == 1 and "2 of 4 failed" in done.stderr
    assert "bad: edits: 'no.json', which is not there" in done.stderr
    made = states(out)
    assert set(made) == {"one.csv", "two.csv"}
    assert (out / "one.csv").read_text() != (out / "two.csv").read_text()
    done = run_here(*command, "--jobs", 2)
    assert "2 of 4 there already" in done.stderr and states(out) == made
    changed = {**EDITS, "edits": [{"edit": "offset", "seconds": 0.1}]}
    (place / "in/take.json").write_text(json.dumps(changed))
    done = run_here(*command)
    assert "two: " in done.stderr and states(out) == made, "a changed list does not replace"
    assert "a file made from the recording 'a.wav' (" in done.stderr
    done = run_here(*command, "--overwrite")
    after = states(out)
    assert after["one.csv"] == made["one.csv"] and after["two.csv"] != made["two.csv"]


def test_a_take_that_was_written_and_not_remembered_is_neither_lost_nor_made_again(
    place: Path, monkeypatch: pytest.MonkeyPatch
):
    table, out = place / "in/lines.csv", place / "takes"
    table.write_text("id,audio\none,a.wav\ntwo,b.wav\n")
    command = ("animate", "--table", table, "-o", out, *FAST)

    for at, left in (("_announce", []), ("_sync", ["one.csv"])):
        shutil.rmtree(out, ignore_errors=True)
        kill_at(monkeypatch, at, command)
        assert sorted(states(out)) == left
        made = states(out)
        done = run_here(*command)
        assert done.returncode == 0, done.stderr
        assert f"{len(left)} of 2 there already" in done.stderr or not left
        assert states(out) | made == states(out)


@pytest.mark.parametrize("at", ["_announce", "_sync"])
def test_a_user_s_file_where_a_killed_run_would_write_is_never_replaced(
    place: Path, monkeypatch: pytest.MonkeyPatch, at: str
):
    """Whenever the run was killed: what it did not provably write is somebody else's."""
    table, out = place / "in/lines.csv", place / "out"
    table.write_text("id,audio\none,a.wav\n")
    command = ("animate", "--table", table, "-o", out, *FAST)
    kill_at(monkeypatch, at, command)
    (out / "one.csv").write_text("three days of work")
    for _ in range(2):
        done = run_here(*command)
        assert done.returncode == 1 and "exists already" in done.stderr
        assert (out / "one.csv").read_text() == "three days of work"


class Killed(BaseException):
    """Nothing cleans up after it, as after a kill."""


def kill_at(monkeypatch: pytest.MonkeyPatch, function: str, command: tuple[object, ...]) -> None:
    """Run a command that is killed right before a draft takes its place, or right after it did."""
    usual = getattr(atomic, function)

    def killed(path: Path, *more: Path) -> None:
        if function == "_sync" and not path.is_dir():
            usual(path)
            return
        if function == "_announce":
            usual(path, *more)
        raise Killed

    with monkeypatch.context() as patch:
        patch.setattr(atomic, function, killed)
        with pytest.raises(Killed):
            run_here(*command)


def test_folders_over_processes_mirror_themselves_and_are_resumed(place: Path):
    command = ("animate", place / "in", "-r", "-o", place / "out", *FAST, "--jobs", 2)
    done = run_here(*command)
    assert done.returncode == 0, done.stderr
    made = states(place / "out")
    assert set(made) == {"a.csv", "b.csv", "more/c.csv"}
    done = run_here(*command)
    assert "3 of 3 there already" in done.stderr and states(place / "out") == made
    alone = run_here("animate", place / "in", "-r", "-o", place / "alone", *FAST)
    assert alone.returncode == 0, alone.stderr
    for name in made:
        assert numbers(place / "alone" / name) == pytest.approx(
            numbers(place / "out" / name), abs=1e-4
        )


def numbers(table: Path) -> np.ndarray:
    """The curves of a .csv; another number of threads may change their last digit."""
    return np.loadtxt(table, delimiter=",", skiprows=1, usecols=range(1, 50))


def test_what_cannot_be_a_batch_is_refused(place: Path):
    sound, table = place / "in/a.wav", place / "in/lines.csv"
    table.write_text("id,audio\none,a.wav\n")
    out = ("-o", place / "out")
    assert "one recording" in refused("animate", sound, "-o", place / "x.csv", "--jobs", 2)
    assert "one recording" in refused("animate", sound, "-o", place / "x.csv", "--ray", "local")
    assert "recordings too" in refused("animate", sound, "--table", table, *out)
    assert "no recording" in refused("animate", *out)
    assert "0 to 256" in refused("animate", "--table", table, *out, "--jobs", 999)
    assert "no address" in refused("animate", "--table", table, *out, "--ray", "a b")
    shutil.copy(sound, place / "in/b.flac")
    told = refused("animate", place / "in", "-r", *out, "--format", "csv", "--jobs", 2)
    assert "the same name as" in told


def test_what_is_told_goes_to_the_output_also_where_a_pool_takes_it(
    place: Path, monkeypatch: pytest.MonkeyPatch
):
    """A Ray cluster's notices are sent to standard error while its pool runs."""

    def pool(work: Any, tasks: Any) -> Any:
        with contextlib.redirect_stdout(sys.stderr):
            yield from one_after_another(work, tasks)

    monkeypatch.setattr("elocute.cli.commands.animate.chosen_pool", lambda *_: pool)
    table = place / "in/lines.csv"
    table.write_text("id,audio\none,a.wav\n")
    done = run_here("animate", "--table", table, "-o", place / "takes", *FAST, "--json")
    assert json.loads(done.stdout)["id"] == "one" and not done.stderr
