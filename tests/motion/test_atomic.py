"""Nothing half-written, nothing lost."""

import pytest

from elocute.errors import OutputError
from elocute.motion.atomic import write_atomically, write_folder_atomically


def test_a_file_appears_when_it_is_whole(tmp_path):
    with write_atomically(tmp_path / "a.txt") as draft:
        draft.write_text("whole")
        assert not (tmp_path / "a.txt").exists()
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


def test_a_failure_keeps_what_was_there(tmp_path):
    (tmp_path / "a.txt").write_text("before")
    with pytest.raises(ZeroDivisionError), write_atomically(tmp_path / "a.txt") as draft:
        draft.write_text("half")
        raise ZeroDivisionError
    assert (tmp_path / "a.txt").read_text() == "before"
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


def test_a_folder_in_the_way_is_refused(tmp_path):
    (tmp_path / "a.txt").mkdir()
    with pytest.raises(OutputError, match="folder"), write_atomically(tmp_path / "a.txt"):
        pass


def test_folders_appear_whole_too(tmp_path):
    with write_folder_atomically(tmp_path / "frames") as room:
        (room / "1").write_text("x")
    assert (tmp_path / "frames" / "1").read_text() == "x"
