"""Nothing half-written, nothing lost."""

import os
import subprocess

import pytest

from elocute.errors import OutputError
from elocute.files.atomic import (
    check_output,
    moved_aside,
    remove_stale_drafts,
    write_atomically,
    write_folder_atomically,
)
from tests.support.commands import python, run_python


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


def test_the_next_run_removes_what_a_killed_one_left(tmp_path):
    """A process is killed while it writes; its draft is gone when the next one writes there."""
    killed = (
        "import os, signal, sys; from elocute.files.atomic import write_atomically\n"
        "with write_atomically(sys.argv[1]) as draft:\n"
        "    draft.write_text('half'); os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    run_python("-c", killed, tmp_path / "talk.mp4")
    (left,) = tmp_path.iterdir()
    assert left.name.startswith(".talk.mp4.")
    with write_atomically(tmp_path / "other.glb") as draft:
        draft.write_text("whole")
    assert [p.name for p in tmp_path.iterdir()] == ["other.glb"]


def test_the_draft_of_a_process_that_lives_is_left_alone(tmp_path):
    with write_atomically(tmp_path / "a.txt") as slow:
        slow.write_text("slow")
        with write_atomically(tmp_path / "b.txt") as quick:
            quick.write_text("quick")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.txt", "b.txt"]


def test_a_full_disk_is_one_line(tmp_path):
    """A limit on the size of files stands for a disk that takes no more."""
    full = (
        "import resource, sys; from elocute.files.atomic import write_atomically\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))\n"
        "from elocute.errors import OutputError\n"
        "try:\n"
        "    with write_atomically(sys.argv[1]) as draft: draft.write_bytes(b'x' * 5000)\n"
        "except OutputError as error: print(error)\n"
    )
    done = run_python("-c", full, tmp_path / "a.bin", check=True)
    assert "a.bin: cannot be written (File too large)" in done.stdout
    assert list(tmp_path.iterdir()) == []


def test_a_name_that_no_file_can_have_is_one_line(tmp_path):
    for name in ("a" * 300 + ".mp4", "a\0b.mp4"):
        with pytest.raises(OutputError, match="no possible name"):
            check_output(tmp_path / name)


def test_a_folder_that_is_replaced_comes_back_where_that_fails(tmp_path):
    (tmp_path / "frames").mkdir()
    (tmp_path / "frames" / "1").write_text("before")
    with pytest.raises(ZeroDivisionError), moved_aside(tmp_path / "frames"):
        assert not (tmp_path / "frames").exists()
        raise ZeroDivisionError
    assert (tmp_path / "frames" / "1").read_text() == "before"
    with (
        moved_aside(tmp_path / "frames"),
        write_folder_atomically(tmp_path / "frames") as room,
    ):
        (room / "1").write_text("after")
    assert (tmp_path / "frames" / "1").read_text() == "after"
    assert [p.name for p in tmp_path.iterdir()] == ["frames"]


def test_a_folder_comes_back_with_the_next_run_where_one_was_killed(tmp_path):
    killed = (
        "import os, signal, sys; from pathlib import Path\n"
        "from elocute.files.atomic import moved_aside\n"
        "with moved_aside(Path(sys.argv[1])): os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    (tmp_path / "frames").mkdir()
    (tmp_path / "frames" / "1").write_text("before")
    run_python("-c", killed, tmp_path / "frames")
    assert not (tmp_path / "frames").exists()
    with write_atomically(tmp_path / "other.txt") as draft:
        draft.write_text("whole")
    assert (tmp_path / "frames" / "1").read_text() == "before"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["frames", "other.txt"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes")
def test_what_is_no_file_is_never_replaced(tmp_path):
    """As /dev/null, which would be a file from then on, for everybody."""
    pipe, link = tmp_path / "pipe.csv", tmp_path / "link.csv"
    os.mkfifo(pipe)
    link.symlink_to(pipe)
    for place in (pipe, link):
        with (
            pytest.raises(OutputError, match="a device, a pipe or a socket"),
            write_atomically(place),
        ):
            pass
    assert pipe.is_fifo() and link.is_symlink()


def test_files_of_a_folder_are_told_as_what_they_would_have_been(tmp_path):
    """As every frame of `capture simulate`, which is written through a draft of its own."""
    full = (
        "import resource, sys; from pathlib import Path\n"
        "from elocute.files.atomic import write_atomically, write_folder_atomically\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))\n"
        "from elocute.errors import OutputError\n"
        "try:\n"
        "    with write_folder_atomically(sys.argv[1]) as room:\n"
        "        with write_atomically(room / '1') as draft: draft.write_bytes(b'x' * 5000)\n"
        "except OutputError as error: print(error)\n"
    )
    done = run_python("-c", full, tmp_path / "frames", check=True)
    assert done.stdout == f"{tmp_path / 'frames' / '1'}: cannot be written (File too large)\n"
    assert list(tmp_path.iterdir()) == []


def test_containers_of_one_name_leave_each_other_alone(tmp_path):
    """What writes in another container has a number that nobody has here."""
    container = ["unshare", "--pid", "--fork", "--kill-child"]
    if subprocess.run([*container, "true"], capture_output=True, check=False).returncode:
        pytest.skip("may not make a container")
    slow = (
        "import os, sys; from elocute.files.atomic import write_atomically\n"
        "with write_atomically(sys.argv[1]) as draft:\n"
        "    draft.write_text('whole'); os.write(1, b'.'); sys.stdin.read()\n"
    )
    script = [*container, *python("-c", slow, tmp_path / "slow.txt")]
    with subprocess.Popen(script, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdin and process.stdout
        process.stdout.read(1)
        (draft,) = tmp_path.iterdir()
        other = tmp_path / draft.name.replace("-1-", "-99999999-")  # a number that nobody has
        draft.rename(other)
        remove_stale_drafts(tmp_path)
        assert other.is_dir()
        other.rename(draft)
        process.stdin.close()
    assert (tmp_path / "slow.txt").read_text() == "whole"


def test_a_folder_comes_back_where_the_work_fails(tmp_path):
    place = tmp_path / "frames"
    place.mkdir()
    (place / "1").write_text("mine")
    with pytest.raises(ZeroDivisionError), moved_aside(place):
        assert not place.exists()
        raise ZeroDivisionError
    assert (place / "1").read_text() == "mine"
    assert [p.name for p in tmp_path.iterdir()] == ["frames"]


def test_a_folder_whose_place_was_taken_is_kept_beside_it(tmp_path):
    """Another program put a folder there in the meantime: neither is lost."""
    place = tmp_path / "frames"
    place.mkdir()
    (place / "1").write_text("mine")
    kept_beside = pytest.raises(OutputError, match=r"frames: cannot be put back; it is kept in ")
    with kept_beside, moved_aside(place):
        place.mkdir()
        (place / "2").write_text("theirs")
        raise ZeroDivisionError
    assert (place / "2").read_text() == "theirs"
    kept = [p for p in tmp_path.iterdir() if p != place]
    assert len(kept) == 1 and kept[0].name.startswith("frames.before-")
    assert (kept[0] / "frames" / "1").read_text() == "mine"
