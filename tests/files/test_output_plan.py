"""One plan of all outputs: nothing of a user's is replaced without being asked for."""

import contextlib
import multiprocessing
import os
import sqlite3
import sys
from pathlib import Path
from typing import Any

import pytest

from elocute.errors import InputError, OutputError
from elocute.files import output_history
from elocute.files.atomic import write_atomically
from elocute.files.output_plan import OutputPlan

posix = pytest.mark.skipif(os.name != "posix", reason="links and folders of Unix")


@pytest.fixture(autouse=True)
def state(tmp_path, monkeypatch):
    """A state folder for this test alone."""
    monkeypatch.setenv("ELOCUTE_STATE", str(tmp_path / "state"))
    return tmp_path / "state"


@pytest.fixture
def speech(tmp_path):
    path = tmp_path / "speech.wav"
    path.write_bytes(b"sound")
    return path


RULES: list[dict[str, Any]] = [{}, {"overwrite": True}, {"no_clobber": True}]


def run(output, *sources, text="made", side=None, **rules):
    """What a command does: plan, check, write. Gives what it left alone."""
    plan = OutputPlan()
    plan.add(output, *sources)
    if side is not None:
        plan.add(side, *sources, beside=output)
    plan.check(**rules)
    for path in plan.wanted([output]):
        with plan.writing(path):
            for place in plan.wanted([path, *([side] if side else [])]):
                place.write_text(text)
    return plan.kept


def test_a_new_file_is_written_and_the_same_command_runs_again(tmp_path, speech):
    run(tmp_path / "talk.glb", speech, text="first")
    run(tmp_path / "talk.glb", speech, text="second")
    assert (tmp_path / "talk.glb").read_text() == "second"


def test_a_strangers_file_is_never_replaced(tmp_path, speech):
    (tmp_path / "talk.glb").write_text("mine")
    with pytest.raises(
        OutputError, match=r"talk\.glb: exists already: a file that was not made from .*speech\.wav"
    ):
        run(tmp_path / "talk.glb", speech)
    assert (tmp_path / "talk.glb").read_text() == "mine"


def test_a_side_file_is_held_by_the_same_rule(tmp_path, speech):
    (tmp_path / "take.wav").write_text("a recording")
    with pytest.raises(OutputError, match=r"take\.wav: .*beside take\.glb.*speech\.wav"):
        run(tmp_path / "take.glb", speech, side=tmp_path / "take.wav")
    assert not (tmp_path / "take.glb").exists()


def test_what_was_made_of_another_input_is_not_ours_for_this_one(tmp_path, speech):
    other = tmp_path / "other.wav"
    other.write_bytes(b"more")
    run(tmp_path / "talk.glb", speech)
    with pytest.raises(OutputError, match=r"made from .*speech\.wav, not .*other\.wav"):
        run(tmp_path / "talk.glb", other)


def test_what_somebody_changed_is_no_longer_ours(tmp_path, speech):
    run(tmp_path / "talk.csv", speech)
    (tmp_path / "talk.csv").write_text("made, and corrected by hand")
    with pytest.raises(OutputError, match="changed since it was made"):
        run(tmp_path / "talk.csv", speech)


def test_overwrite_replaces_and_no_clobber_keeps(tmp_path, speech):
    (tmp_path / "talk.glb").write_text("mine")
    assert run(tmp_path / "talk.glb", speech, no_clobber=True) == [tmp_path / "talk.glb"]
    assert (tmp_path / "talk.glb").read_text() == "mine"
    run(tmp_path / "talk.glb", speech, overwrite=True)
    assert (tmp_path / "talk.glb").read_text() == "made"
    with pytest.raises(InputError, match="one of them"):
        run(tmp_path / "talk.glb", speech, overwrite=True, no_clobber=True)


def test_two_inputs_for_one_file_are_named_both(tmp_path):
    plan = OutputPlan()
    plan.add(tmp_path / "a.npz", tmp_path / "a.flac")
    plan.add(tmp_path / "a.npz", tmp_path / "a.wav")
    with pytest.raises(OutputError, match=r"a\.npz: .*a\.flac and .*a\.wav"):
        plan.check(overwrite=True)


def test_a_side_file_may_not_be_an_output_of_another_input(tmp_path):
    plan = OutputPlan()
    plan.add(tmp_path / "take.glb", "a.flac")
    plan.add(tmp_path / "take.wav", "a.flac", beside=tmp_path / "take.glb")
    plan.add(tmp_path / "take.wav", "b.flac")
    with pytest.raises(OutputError, match=r"take\.wav: .*a\.flac and b\.flac"):
        plan.check()


def test_two_names_for_one_folder_are_one_place(tmp_path):
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to("real")
    plan = OutputPlan()
    plan.add(tmp_path / "real" / "t.npz", "a.wav")
    plan.add(tmp_path / "link" / "t.npz", "b.wav")
    with pytest.raises(OutputError, match=r"a\.wav and b\.wav"):
        plan.check()


def test_names_that_differ_by_case_are_two_where_the_file_system_has_two(tmp_path):
    (tmp_path / "x").touch()
    plan = OutputPlan()
    plan.add(tmp_path / "Talk.npz", "a.wav")
    plan.add(tmp_path / "talk.npz", "b.wav")
    if (tmp_path / "X").exists():  # macOS, Windows
        with pytest.raises(OutputError, match=r"a\.wav and b\.wav"):
            plan.check()
    else:
        plan.check()
    assert not list(tmp_path.glob(".elocute-*"))  # the file system was asked, and left as it was


def test_names_that_differ_by_case_may_lie_in_a_folder_yet_to_be_made(tmp_path):
    plan = OutputPlan()
    plan.make_folder(tmp_path / "out" / "deep")
    plan.add(tmp_path / "out" / "deep" / "Talk.npz", "a.wav")
    plan.add(tmp_path / "out" / "deep" / "talk.npz", "b.wav")
    (tmp_path / "x").touch()
    if (tmp_path / "X").exists():  # macOS, Windows
        with pytest.raises(OutputError, match=r"a\.wav and b\.wav"):
            plan.check()
    else:
        plan.check()
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("link", [os.symlink, os.link])
def test_an_output_is_never_an_input_by_whatever_name(tmp_path, speech, link):
    link(speech, tmp_path / "alias.wav")
    for rules in RULES:
        with pytest.raises(OutputError, match=r"alias\.wav: an input of this run .*speech\.wav"):
            run(tmp_path / "alias.wav", speech, **rules)
    assert speech.read_bytes() == b"sound"


def test_a_folder_is_replaced_only_where_it_was_made_here(tmp_path, speech):
    folder = tmp_path / "talk.obj"

    def write(**rules):
        plan = OutputPlan()
        plan.add(folder, speech)
        plan.check(**rules)
        with plan.writing(folder):
            folder.mkdir(exist_ok=True)
            (folder / "0.obj").write_text("v")

    write()
    write()
    (folder / "notes.txt").write_text("mine")
    for rules in ({}, {"overwrite": True}):
        with pytest.raises(OutputError, match="changed since it was made; remove it"):
            write(**rules)


def test_a_folder_that_holds_an_input_is_no_output(tmp_path):
    (tmp_path / "talk.obj").mkdir()
    speech = tmp_path / "talk.obj" / "speech.wav"
    speech.write_bytes(b"sound")
    with pytest.raises(OutputError, match="holds an input"):
        run(tmp_path / "talk.obj", speech, overwrite=True)


def test_what_comes_between_check_and_writing_is_kept(tmp_path, speech):
    plan = OutputPlan()
    plan.add(tmp_path / "talk.glb", speech)
    plan.check()
    (tmp_path / "talk.glb").write_text("somebody was quicker")
    with pytest.raises(OutputError, match="in the meantime"), plan.writing(tmp_path / "talk.glb"):
        pass


@pytest.mark.parametrize("there", [None, "first"])
def test_what_comes_while_an_output_is_written_is_kept(tmp_path, speech, there):
    """Minutes may lie between the start of a writer and the moment when its file is complete."""
    path = tmp_path / "talk.mp4"
    if there is not None:
        run(path, speech, text=there)
    plan = OutputPlan()
    plan.add(path, speech)
    plan.check()
    with (
        pytest.raises(OutputError, match="in the meantime"),
        plan.writing(path),
        write_atomically(path) as draft,
    ):
        draft.write_text("made")
        path.write_text("somebody was quicker")
    assert path.read_text() == "somebody was quicker"
    assert not list(tmp_path.glob(".talk*"))


def test_one_run_may_write_an_output_twice(tmp_path, speech):
    plan = OutputPlan()
    plan.add(tmp_path / "talk.mp4", speech)
    plan.check()
    with plan.writing(tmp_path / "talk.mp4"):
        for text in ("draft", "whole"):
            with write_atomically(tmp_path / "talk.mp4") as draft:
                draft.write_text(text)
    assert (tmp_path / "talk.mp4").read_text() == "whole"


@posix
def test_a_link_to_a_folder_is_no_place_for_a_file(tmp_path, speech):
    (tmp_path / "folder").mkdir()
    (tmp_path / "talk.csv").symlink_to(tmp_path / "folder")
    with pytest.raises(OutputError, match="a link to a folder"):
        run(tmp_path / "talk.csv", speech, overwrite=True)


@posix
def test_a_folder_that_was_deleted_is_told(tmp_path, speech, monkeypatch):
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    with pytest.raises(OutputError, match="current folder does not exist"):
        run(Path("talk.csv"), speech)


def test_a_history_that_cannot_be_read_is_begun_anew_and_kept(tmp_path, speech, state):
    run(tmp_path / "talk.glb", speech)
    mine = b"no database at all, but long enough to be looked at" * 40
    (state / output_history.DATABASE_NAME).write_bytes(mine)
    with pytest.raises(OutputError, match="not made from"):
        run(tmp_path / "talk.glb", speech)
    run(tmp_path / "talk.glb", speech, overwrite=True)
    run(tmp_path / "talk.glb", speech)
    assert (state / (output_history.DATABASE_NAME + ".unreadable")).read_bytes() == mine


@pytest.mark.parametrize("broken", ["file", "folder"])
def test_without_a_history_nothing_is_known_and_everything_works(tmp_path, speech, state, broken):
    """A file where the folder should be, or a folder where the file should be."""
    if broken == "file":
        state.write_text("in the way")
    else:
        (state / output_history.DATABASE_NAME).mkdir(parents=True)
    run(tmp_path / "talk.glb", speech)
    with pytest.raises(OutputError, match="not made from"):
        run(tmp_path / "talk.glb", speech)


def test_the_history_forgets_the_oldest(tmp_path, speech, state, monkeypatch):
    monkeypatch.setattr(output_history, "ROWS_MAX", 3)
    for number in range(5):
        run(tmp_path / f"{number}.npz", speech)
    with contextlib.closing(sqlite3.connect(state / output_history.DATABASE_NAME)) as table:
        assert table.execute("SELECT count(*) FROM outputs").fetchone() == (3,)
    run(tmp_path / "4.npz", speech)
    with pytest.raises(OutputError):
        run(tmp_path / "0.npz", speech)


def _note(folder, first):
    for number in range(first, first + 20):
        path = folder / f"{number}.npz"
        path.write_text("x")
        output_history.remember_output(path, ["speech.wav"])


def test_many_processes_note_at_once(tmp_path):
    context = multiprocessing.get_context("spawn")
    workers = [context.Process(target=_note, args=(tmp_path, 100 * k)) for k in range(3)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join(300)
    places = [tmp_path / f"{100 * k + n}.npz" for k in range(3) for n in range(20)]
    assert all(output_history.recall_output(place) == ("speech.wav", True) for place in places)


@pytest.mark.skipif(sys.platform in ("darwin", "win32"), reason="the names of Linux")
def test_where_the_history_lies(monkeypatch, tmp_path):
    monkeypatch.delenv("ELOCUTE_STATE")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert output_history.state_folder() == tmp_path / "elocute"
    monkeypatch.setenv("XDG_STATE_HOME", "relative is not allowed")
    assert output_history.state_folder().parts[-3:] == (".local", "state", "elocute")


def test_names_that_are_no_text_are_remembered(tmp_path, speech):
    name = os.fsdecode(b"caf\xe9.npz")
    run(tmp_path / name, speech)
    run(tmp_path / name, speech)


def test_files_of_a_folder_that_is_an_input_are_inputs(tmp_path):
    corpus = tmp_path / "corpus"
    corpus.mkdir()
    (corpus / "corpus.json").write_text("{}")
    for rules in RULES[:2]:
        with pytest.raises(OutputError, match=r"corpus\.json: a file of an input of this run"):
            run(corpus / "corpus.json", corpus, **rules)
    assert (corpus / "corpus.json").read_text() == "{}"
    for text in ("first", "second"):  # a report beside it is the run's own
        run(corpus / "report.json", corpus, text=text)
    assert (corpus / "report.json").read_text() == "second"
