"""Corpora, shards, and folders as others distribute them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from elocute.audio.waveform import Waveform
from tests.fuzz.fuzzing.seeds.making import RATE, module, place, small_motion, tone
from tests.fuzz.fuzzing.seeds.media import vorbis, write_wav


def corpora(folder: Path) -> None:
    from elocute.corpus.clip import Clip
    from elocute.corpus.corpus_writing import corpus_writer
    from elocute.corpus.split import Split

    motion = small_motion()
    head = motion.head
    subjects: dict[str, np.ndarray] = dict.fromkeys(("anna", "bob", "cy"), head.template)
    for kind in ("weights", "vertices"):
        weights = kind == "weights"
        with corpus_writer(
            folder / kind,
            subjects,
            fps=30.0,
            basis=head.expression_basis if weights else None,
            components=head.expression_names if weights else (),
            faces=head.quads,
            topology="small",
        ) as writer:
            for name in subjects:
                frames = motion.weights if weights else motion.vertices()
                sound = Waveform(tone(), RATE)
                writer.add(Clip(name, "ah" + name, "a text", sound, frames))
            writer.splits["default"] = Split(("anna.ahanna",), ("bob.ahbob",), ("cy.ahcy",))


def shards(folder: Path) -> None:
    from elocute.corpus.shards import WordClip, shard_writer

    inner, motion = place(folder, "one"), small_motion()
    (inner / "sounds").mkdir()
    write_wav(inner / "sounds" / "talk.wav", 0.5)
    with shard_writer(inner / "shards", motion, rows=2) as writer:
        for number, split in enumerate(("train", "train", "test")):
            writer.add(
                WordClip(
                    f"c{number}",
                    "hello",
                    f"{split}er",
                    "a",
                    split,
                    "talk.wav",
                    0.0,
                    0.2,
                    30.0,
                    motion.weights,
                )
            )


def features(folder: Path) -> None:
    """What `train crnn` keeps of the shards it has heard."""
    from elocute.models.crnn_network import MEL, column_features
    from elocute.training.crnn.feature_cache import STATIC, TARGETS

    inner = place(folder, "one")
    np.save(inner / STATIC, np.zeros((20, column_features(MEL)), "<f2"))
    np.save(inner / TARGETS, np.zeros((5, 3), "<f4"))
    rows = [["c0", "hello", "anna", "anna", "train", 0, 20, 0, 5, 0]]
    record = {
        "fps": 30.0,
        "encoder": MEL,
        "parameters": 3,
        "missing": [["c1", "no sound"]],
        "rows": rows,
    }
    (inner / "rows.json").write_text(json.dumps(record))


def tracks(folder: Path) -> None:
    """Lips tracked in video, as `grid` has them, and a sound beside them."""
    from elocute.corpus.importers.grid import SCALARS
    from elocute.head.mediapipe_face_mesh import LIP_CONTOURS, UNDER_NOSE

    inner, count = place(folder, "one"), 14
    numbers = np.array(sorted({UNDER_NOSE, *(n for contour in LIP_CONTOURS for n in contour)}))
    rng = np.random.default_rng(0)
    still = rng.normal(0, 30, (len(numbers), 3))
    wave = np.abs(np.sin(np.arange(count) / 2))
    fields: dict[str, Any] = dict.fromkeys(SCALARS, 0.3 + 0.1 * wave)
    fields["inner_opening_mean"] = 0.1 * wave
    np.savez(
        inner / "clip.npz",
        lip_xyz=still + wave[:, None, None],
        lip_idx=numbers,
        eye_dist_px=np.full(count, 100.0),
        valid=np.ones(count),
        fps=25.0,
        t=np.arange(count) / 25,
        words=json.dumps([[0, 0.2, "sil"], [0.2, 0.5, "bin"]]),
        **fields,
    )
    vorbis(inner / "clip.ogg", 0.6)


def vocaset(folder: Path) -> None:
    """As it is distributed, but for the subjects; 5,023 vertices make it the largest seed."""
    tests = module("tests/corpus/sources.py")
    python2 = module("tests/conftest.py").Python2()
    tests.RATE = 4000  # pyright: ignore[reportAttributeAccessIssue]
    tests.write_vocaset(folder / "one", python2, ("ann", "bob"), (1,))


def folder_corpus(folder: Path) -> None:
    tests = module("tests/corpus/sources.py")
    tests.write_folder(folder / "one", ("A", "B"), 30)
    for path in (*folder.glob("one/wav/*_e0[23].wav"), *folder.glob("one/*/*_e0[23].npy")):
        path.unlink()


def biwi(folder: Path) -> None:
    tests = module("tests/corpus/sources.py")
    tests.write_biwi(folder / "one", ("F1", "M1"), 20)
    for path in folder.glob("one/faces/*/*/frame_0*.vl"):
        if int(path.stem[-3:]) > 3:
            path.unlink()


def pickles(folder: Path) -> None:
    """What VOCASET's pickles hold, by several protocols, and a sparse matrix."""
    import pickle

    from scipy.sparse import csc_matrix

    python2 = module("tests/conftest.py").Python2()
    item = {
        "a": np.arange(6.0).reshape(2, 3),
        "b": [1, 2.5, None, True, "text", (1, 2), 2**70],
        "c": {"x": np.float64(3), 1: np.array([1, 2], ">i2")},
        "d": csc_matrix(np.eye(3)),
        "e": np.arange(6, dtype=np.float32).reshape(2, 3).T,
    }
    (place(folder, "python2") / "item.pkl").write_bytes(python2.dumps(item))
    (place(folder, "text") / "item.pkl").write_bytes(python2.dumps(item, 0))
    for protocol in (2, 4, 5):
        path = place(folder, f"protocol{protocol}") / "item.pkl"
        path.write_bytes(pickle.dumps(item, protocol))


def captured(folder: Path) -> None:
    """A corpus of three clips and, beside it, when the words of one are said."""
    from elocute.speech.text.word_times import TimedWord, TimedWords, write_words

    corpora(folder)
    said = TimedWords((TimedWord("a", 0.02, 0.06, 0.9), TimedWord("text", 0.08, 0.15, 0.8)), 0.2)
    for inner in list(folder.iterdir()):
        corpus = inner.rename(folder / "moved")
        corpus.rename(place(folder, inner.name) / "corpus")
        (inner / "words").mkdir()
        write_words(said, inner / "words" / "anna.ahanna.json")
        write_words(said, inner / "words" / "bob.ahbob.TextGrid")
