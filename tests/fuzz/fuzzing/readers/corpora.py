"""Corpora, shards, and the importers of what others distribute."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from pathlib import Path

from tests.fuzz.fuzzing import seeds
from tests.fuzz.fuzzing.cases import Files, Reader
from tests.fuzz.fuzzing.readers.media import AUDIO


def _corpus(folder: Path, _out: Path) -> None:
    from elocute.corpus.corpus_checks import check_corpus
    from elocute.corpus.corpus_store import open_corpus

    corpus = open_corpus(folder)
    check_corpus(corpus)
    _ = corpus.faces
    for entry in corpus.entries:
        corpus.clip(entry.name)
        corpus.vertices(entry.name)


def _captured(folder: Path, _out: Path) -> None:
    from elocute.corpus.corpus_store import open_corpus
    from elocute.propagation.captured_words import captured_words

    captured_words(open_corpus(folder / "corpus"), folder / "words")


def _shards(folder: Path, _out: Path) -> None:
    from elocute.corpus.shards import open_shards

    opened = open_shards(folder / "shards", folder / "sounds")
    _ = opened.basis
    for clip in opened.clips():
        opened.sound(clip, 0.1)


def forge(files: Files) -> None:
    """The manifest's checksums follow the shards, as a forger would have them."""
    try:
        record = json.loads(files["shards/manifest.json"])
        for entry in record["shards"]:
            data = files[f"shards/{entry['name']}"]
            entry["sha256"] = hashlib.sha256(data).hexdigest()
    except (ValueError, KeyError, TypeError, RecursionError):
        return
    files["shards/manifest.json"] = json.dumps(record).encode()


def _convert(format: str) -> Callable[[Path, Path], object]:
    def read(folder: Path, out: Path) -> None:
        from elocute.corpus.importers.registry import convert

        convert(folder, out / "corpus", format=format)

    return read


_IMPORTERS = ("elocute.corpus.importers.registry", *AUDIO)

READERS: tuple[Reader, ...] = (
    Reader(
        "corpus",
        seeds.corpora,
        _corpus,
        {"*.json": "json", "*.npy": "npy", "*.flac": "bytes"},
        ("elocute.corpus.corpus_store", "elocute.corpus.corpus_checks", *AUDIO),
        short=100,
    ),
    Reader(
        "shards",
        seeds.shards,
        _shards,
        {"*.json": "json", "*.parquet": "bytes", "*basis.npz": "npz", "*.wav": "riff"},
        ("elocute.corpus.shards", "pyarrow.parquet"),
        repair=forge,
        needs=("pyarrow",),
        short=100,
    ),
    Reader(
        "vocaset",
        seeds.vocaset,
        _convert("vocaset"),
        {"*.pkl": "pickle", "*.npy": "npy"},
        _IMPORTERS,
        short=20,
        needs=("scipy",),
    ),
    Reader(
        "biwi",
        seeds.biwi,
        _convert("biwi"),
        {"*.vl": "vl", "*.obj": "text", "*.wav": "riff"},
        _IMPORTERS,
        short=60,
    ),
    Reader(
        "folder",
        seeds.folder_corpus,
        _convert("folder"),
        {"*.pkl": "pickle", "*.npy": "npy", "*.wav": "riff"},
        _IMPORTERS,
        short=60,
    ),
    Reader(
        "grid",
        seeds.tracks,
        _convert("grid"),
        {"*.npz": "npz", "*.ogg": "bytes"},
        _IMPORTERS,
        short=40,
    ),
    Reader(
        "captured words",
        seeds.captured,
        _captured,
        {"*words/*.json": "json", "*.TextGrid": "text"},
        ("elocute.propagation.captured_words", "elocute.corpus.corpus_store", *AUDIO),
        needs=("pyarrow",),
        short=100,
    ),
)
