"""Whose motion recordings receive: of all captured speakers, of one, or of several, each apart."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import soundfile

pytest.importorskip("pyarrow")

from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.corpus.clip import Clip
from elocute.corpus.corpus_writing import corpus_writer
from elocute.corpus.shards import open_shards
from elocute.corpus.split import Split
from elocute.head.builtin import load_builtin_head
from elocute.propagation import PropagateConfig, propagate_corpus
from tests.support.commands import one_line, run_here, succeeds

SPEAKERS = ("ann", "bob", "tess")  # the last is of the test part
FPS = 30.0


@pytest.fixture(scope="module")
def room(speech_wav: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A word by three captured speakers, whose jaws open by 1, 2 and 3 of their own, and by Eve."""
    folder = tmp_path_factory.mktemp("sources")
    speech = read_audio(speech_wav).resample(16000).samples
    head = load_builtin_head()
    templates = {name: head.template.astype(np.float32) for name in SPEAKERS}
    basis = head.expression_basis[:3]
    with corpus_writer(
        folder / "captured",
        templates,
        fps=FPS,
        basis=basis,
        components=tuple("xyz"),
        faces=head.quads,
    ) as writer:
        for number, name in enumerate(SPEAKERS):
            sound = Waveform(speech[4000 + 300 * number : 16000], 16000)
            frames = np.zeros((int(sound.duration_s * FPS), 3), np.float32)
            frames[:, number] = np.linspace(0, 1, len(frames))
            writer.add(Clip(name, "w0", "please", sound, frames))
        names = tuple(entry.name for entry in writer.entries)
        writer.splits["default"] = Split(names[:2], (), names[2:])
    (folder / "recordings" / "please" / "train").mkdir(parents=True)
    soundfile.write(folder / "recordings/please/train/eve__0.wav", speech[4100:16000], 16000)
    return folder


def carried(shards: Path, room: Path) -> tuple[dict[str, str], set[str]]:
    """Whose motion each recording has, and of whom captured words are there."""
    clips = list(open_shards(shards, room).clips())
    others = {clip.speaker: clip.source for clip in clips if clip.speaker != clip.source}
    return others, {clip.speaker for clip in clips if clip.speaker == clip.source}


@pytest.fixture(scope="module")
def command(room: Path) -> tuple[object, ...]:
    given = ("propagate", room / "captured", room / "recordings", "--root", room)
    return *given, "--method", "dtw", "--confidence", 0


def test_one_source_gives_its_motion_to_every_recording(
    room: Path, command: tuple[object, ...], tmp_path: Path
):
    for source in ("ann", "bob"):
        succeeds(*command, "-o", tmp_path / source, "--source", source)
        assert carried(tmp_path / source, room) == ({"eve": source}, {source, "tess"})


def test_several_sources_have_shards_of_their_own_with_the_same_shapes(
    room: Path, command: tuple[object, ...], tmp_path: Path
):
    told = succeeds(*command, "-o", tmp_path / "out", "--source", "ann", "--source", "bob")
    assert "2 words: 2 recordings carried over, 4 captured" in told.stdout
    shards = {name: open_shards(tmp_path / "out" / name, room) for name in ("ann", "bob")}
    for name in shards:
        assert carried(tmp_path / "out" / name, room) == ({"eve": name}, {name, "tess"})
    first, second = (each.basis.head.expression_basis for each in shards.values())
    assert np.array_equal(first, second)
    tess = [[c.parameters for c in each.clips() if c.speaker == "tess"] for each in shards.values()]
    assert len(tess[0]) == 1 and np.array_equal(tess[0], tess[1])
    again = succeeds(
        *command, "-o", tmp_path / "out", "--source", "ann", "--source", "bob", "--resume"
    )
    assert "2 words kept from an earlier run" in again.stdout


def test_without_a_source_whoever_fits_best_gives_it(room: Path, tmp_path: Path):
    done: list[float] = []
    summary = propagate_corpus(
        room / "captured",
        room / "recordings",
        tmp_path / "all",
        PropagateConfig(method="dtw", confidence=0.0),
        root=room,
        progress=done.append,
    )
    assert (summary.pairs, summary.captured, done[-1]) == (2, 3, 1.0)
    assert carried(tmp_path / "all", room)[1] == set(SPEAKERS)


def test_a_source_of_whom_nothing_is_carried_over_is_refused(
    room: Path, command: tuple[object, ...], tmp_path: Path
):
    for name in ("tess", "nobody"):
        refused = run_here(*map(str, (*command, "-o", tmp_path / "new", "--source", name)))
        one_line(refused, "--source", name, "ann, bob")
    assert not (tmp_path / "new").exists()
