"""A disk that takes no more, closed and full outputs: one line, nothing half-written.

Where this process may mount, a file system of 32 kB is filled; a limit on the size of files, which
every system has, stands for it elsewhere.
"""

import os
import pickle
import resource
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import soundfile

from elocute.errors import needs_extra
from elocute.head.builtin import load_builtin_head
from elocute.motion.motion import Motion
from elocute.motion.store import save_motion
from tests.support.commands import one_line, run_apart as run, run_here, run_python

pytestmark = pytest.mark.usefixtures("unmeasured")
LIMIT = 30_000
TEXT = (
    "Hello. Give me any voice, and I will give it a face. My mouth closes on p, b and m. "
    "Five wolves move through the blue fog. Now I rest."
)


@pytest.fixture(scope="module")
def talk(tmp_path_factory):
    """Two seconds of a mouth that opens, which no format stores in 30 kB."""
    head = load_builtin_head()
    weights = np.random.default_rng(0).random((120, len(head.expression_names)), np.float32)
    path = tmp_path_factory.mktemp("talk") / "talk.npz"
    save_motion(Motion(head, weights, 60.0), path)
    return path


@pytest.fixture
def small(tmp_path):
    """A file system of 32 kB."""
    folder = tmp_path / "small"
    folder.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=32k", "tmpfs", str(folder)],
        capture_output=True,
        check=False,
    )
    if mounted.returncode:
        pytest.skip("may not mount a small file system")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def limited():
    resource.setrlimit(resource.RLIMIT_FSIZE, (LIMIT, LIMIT))


FORMATS = ("npz", "glb", "html", "csv", "npy", "obj", "ply", "png", "mp4")
DRAWN = {"png": ("--size", "640"), "mp4": ("--size", "640", "--fps", "5")}


@pytest.mark.parametrize("kind", FORMATS)
def test_a_full_disk_is_one_line(talk, speech_wav, small, kind):
    target = small / f"a.{kind}"
    done = run_here("render", talk, "-o", target, "--audio", speech_wav, *DRAWN.get(kind, ()))
    one_line(done, f"a.{kind}: cannot be written (No space left on device)")
    assert list(small.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize("kind", FORMATS)
def test_a_limit_on_the_size_of_files_is_one_line(talk, speech_wav, tmp_path, kind):
    arguments = ("render", talk, "-o", tmp_path / f"a.{kind}", "--audio", speech_wav)
    done = run(*arguments, *DRAWN.get(kind, ()), preexec_fn=limited)
    one_line(done, "cannot be written (File too large)")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_checkpoints_and_corpora_on_a_full_disk(small, speech_wav, make_corpus):
    """SafetensorError and LibsndfileError do not leave as they are."""
    torch = pytest.importorskip("torch", reason="needs the extra `train`")
    from elocute.errors import OutputError
    from elocute.training.checkpoint import save_checkpoint

    with pytest.raises(OutputError, match=r"a\.safetensors: cannot be written .*No space left"):
        save_checkpoint(small / "a.safetensors", {"x": torch.zeros(100_000)}, {})
    with pytest.raises(OutputError, match=r"corpus: cannot be written \(No space left"):
        make_corpus(small / "corpus")
    assert list(small.iterdir()) == []


def test_the_log_of_a_training_on_a_full_disk(small):
    pytest.importorskip("tensorboard", reason="needs the extra `train`")
    from elocute.errors import OutputError
    from elocute.training.epochs import TrainingLog

    board = TrainingLog(small, ("epoch", "loss"), 0)
    (small / "full").write_bytes(b"x" * (os.statvfs(small).f_bavail * 4096 - 4096))
    with pytest.raises(OutputError, match="No space left on device"):
        for epoch in range(1000):
            board.add([{"epoch": epoch, "loss": 0.5}])


def test_a_full_folder_for_temporary_files_does_not_matter(talk, small, tmp_path):
    (small / "full").write_bytes(b"x" * os.statvfs(small).f_bavail * 4096)
    environment = os.environ | {"TMPDIR": str(small)}
    targets = [tmp_path / f"a.{kind}" for kind in ("npz", "glb", "html", "png")]
    outputs = [word for target in targets for word in ("-o", target)]
    assert run("render", talk, *outputs, env=environment).returncode == 0
    assert all(target.is_file() for target in targets)


def test_standard_output_that_is_full_or_closed():
    for command in (["head", "show", "builtin"], ["head", "show", "builtin", "--json"]):
        with Path("/dev/full").open("w") as full:
            done = run(*command, stdout=full)
        one_line(done, "standard output: cannot be written (No space left on device)")
        reader, writer = os.pipe()
        os.close(reader)
        done = run(*command, stdout=writer)
        os.close(writer)
        assert (done.returncode, done.stderr) == (141, "")


def test_standard_input_and_error_that_are_closed_or_full(tmp_path):
    def shell(line):
        command = f'exec "$0" -m elocute {line}'
        return subprocess.run(
            ["sh", "-c", command, sys.executable],
            capture_output=True,
            text=True,
            cwd=tmp_path,
            check=False,
        )

    one_line(shell("animate - -o talk.csv <&-"), "standard input: nothing")
    told = one_line(shell("animate - -o talk.csv </dev/null"), "standard input: nothing")
    assert told.count("standard input") == told.count("allowed") == 1
    one_line(shell("animate a.wav -o - --format csv >&-"), "standard output: closed")
    assert shell("no-such-command 2>/dev/full").returncode == 2
    assert shell("no-such-command 2>&-").returncode == 2
    one_line(shell(f"animate x.wav -o {'a/' * 3000}talk.csv"), "no possible name")


@pytest.mark.slow
def test_simulated_scans_on_a_full_disk(small, speech_wav):
    pytest.importorskip("scipy", reason="needs the extra `capture`")
    done = run("capture", "simulate", speech_wav, "-o", small / "scans", "--seconds", "0.1")
    one_line(done, f"{small / 'scans'}")
    assert "cannot be written (No space left on device)" in done.stderr
    assert ".part" not in done.stderr and list(small.iterdir()) == []


@pytest.mark.slow
def test_words_on_a_full_disk(small, speech_wav, tmp_path):
    """What `segment` finds, and what `take` takes back."""
    segment = ("words", "segment", speech_wav, "--text", TEXT)
    spoken = run(*segment, "-o", tmp_path / "w.json")
    assert spoken.returncode == 0, spoken.stderr
    (small / "full").write_bytes(b"x" * os.statvfs(small).f_bavail * 4096)
    full = "cannot be written (No space left on device)"
    one_line(run(*segment, "-o", small / "w.json"), f"w.json: {full}")
    take = ("words", "take", tmp_path / "w.json", "-o", small / "w.TextGrid")
    one_line(run(*take), f"w.TextGrid: {full}")
    assert [path.name for path in small.iterdir()] == ["full"]


@pytest.mark.slow
def test_a_converted_corpus_on_a_full_disk(small, tmp_path):
    source, rng = tmp_path / "source", np.random.default_rng(0)
    for part in ("vertices_npy", "wav"):
        (source / part).mkdir(parents=True)
    template = rng.normal(0, 60, (60, 3)).astype(np.float32)
    (source / "templates.pkl").write_bytes(pickle.dumps({"ann": template, "bob": template}))
    for name in ("ann_e01", "ann_e02", "bob_e01", "bob_e02"):
        np.save(source / "vertices_npy" / f"{name}.npy", np.tile(template.ravel(), (15, 1)))
        soundfile.write(source / "wav" / f"{name}.wav", rng.normal(0, 0.1, 11025), 22050)
    done = run("corpus", "convert", source, "-o", small / "corpus", "--units", "mm")
    one_line(done, "corpus")
    assert "No space left on device" in done.stderr and ".part" not in done.stderr
    assert list(small.iterdir()) == []


@pytest.mark.parametrize("kind", ["a file", "read-only"])
def test_a_state_folder_that_cannot_be_used_does_not_matter(talk, small, tmp_path, kind):
    """What this tool made is then not known any more, and so not replaced unasked."""
    state = small / "state"
    if kind == "a file":
        state.write_text("mine")
    else:
        subprocess.run(["mount", "-o", "remount,ro", str(small)], check=True)
    environment = os.environ | {"ELOCUTE_STATE": str(state)}
    target = tmp_path / "a.csv"
    done = run("render", talk, "-o", target, env=environment)
    assert (done.returncode, done.stderr) == (0, "") and target.is_file()
    one_line(run("render", talk, "-o", target, env=environment), "exists already")
    assert run("render", talk, "-o", target, "--overwrite", env=environment).returncode == 0
    assert kind != "a file" or state.read_text() == "mine"


def test_a_warning_does_not_come_before_an_error(talk, tmp_path):
    """That a .glb is without sound is told of one that was written."""
    for command in ("render", "edit", "solve"):
        done = run(command, talk, "-o", tmp_path / "a.glb", preexec_fn=limited)
        one_line(done, "a.glb: cannot be written (File too large)")


def test_folders_that_would_be_new_are_not_left_empty(small, speech_wav):
    (small / "full").write_bytes(b"x" * (os.statvfs(small).f_bavail * 4096 - 8192))
    target = small / "new" / "takes"
    done = run("animate", speech_wav, "-o", target, "--format", "npz")
    one_line(done, "cannot be written (No space left on device)")
    assert [path.name for path in small.iterdir()] == ["full"]


def test_too_little_memory_for_a_library_is_one_line(tmp_path):
    code = (
        "import sys; from unittest import mock; from elocute.cli import app, main\n"
        "def fail(_): raise ImportError('liba.so: failed to map segment from shared object')\n"
        "with mock.patch.object(app, 'command_line', fail): main()"
    )
    one_line(run_python("-c", code, cwd=tmp_path), "not enough memory", code=1)


def test_an_import_for_which_there_is_no_memory_is_not_a_missing_extra():
    with pytest.raises(ImportError, match="map segment"), needs_extra("this", "train"):
        raise ImportError("liba.so: failed to map segment from shared object")
