"""Folders of long work: made, gone on in, and not left behind empty."""

from pathlib import Path

import pytest

from elocute.errors import OutputError
from elocute.files.output_plan import OutputPlan
from elocute.files.work_folder import no_empty_folder, prepare_training


def test_a_place_without_folders_is_one_line():
    proc = Path("/proc/elocute")
    if not proc.parent.is_dir():
        pytest.skip("needs /proc")
    with pytest.raises(OutputError, match=r"^/proc/elocute: cannot be (made|written)") as raised:
        prepare_training(proc, False)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("files", [(), ("events/log",)])
def test_work_that_fails_leaves_a_new_folder_only_with_files_in_it(tmp_path, files):
    folder = tmp_path / "out"
    with pytest.raises(ZeroDivisionError), no_empty_folder(folder):
        prepare_training(folder, False)
        (folder / "events").mkdir()
        for name in files:
            (folder / name).write_text("kept")
        raise ZeroDivisionError
    assert folder.exists() == bool(files)


def test_a_folder_that_was_there_stays_though_it_is_empty(tmp_path):
    folder = tmp_path / "mine"
    folder.mkdir()
    with pytest.raises(ZeroDivisionError), no_empty_folder(folder):
        prepare_training(folder, False)
        raise ZeroDivisionError
    assert folder.is_dir()


def test_outputs_that_fail_leave_no_new_folder(tmp_path):
    (tmp_path / "mine").mkdir()
    target = tmp_path / "mine" / "new" / "deep" / "a.txt"
    plan = OutputPlan()
    plan.make_folder(target.parent)
    plan.add(target)
    plan.check()
    with pytest.raises(ZeroDivisionError), plan.writing(target):
        assert target.parent.is_dir()
        raise ZeroDivisionError
    assert list((tmp_path / "mine").iterdir()) == []
    with plan.writing(target):
        target.write_text("whole")
    assert target.read_text() == "whole"
