"""Inputs that once ended in a traceback, took the machine or never came back; made by code.

`benchmarks/fuzz.py` writes the smallest case of every kind that it finds into a folder; what it
found goes here as a few lines when it is mended.
"""

from __future__ import annotations

import io
import json
import struct
import zipfile
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import soundfile

from tests.fuzz.fuzzing.cases import Files
from tests.fuzz.fuzzing.mutations.arrays import npy

HUGE = "9" * 400
DEEP = "[" * 100_000 + "]" * 100_000
Made = tuple[str, Callable[[], Files]]


def _text(name: str, text: str) -> Files:
    return {name: text.encode("utf-8", "surrogateescape")}


def _archive(name: str, entries: dict[str, bytes]) -> Files:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for entry, content in entries.items():
            archive.writestr(f"{entry}.npy", content)
    return {name: out.getvalue()}


def _json_array(value: Any) -> bytes:
    data = json.dumps(value).encode()
    return npy(f"{{'descr': '|u1', 'fortran_order': False, 'shape': ({len(data)},), }}", data)


def _shape(shape: str, descr: str = "<f4", content: bytes = b"") -> bytes:
    return npy(f"{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}", content)


def _wav(tag: int = 1, chunks: bytes = b"", rate: int = 16000) -> Files:
    """A RIFF whose format tag is whatever is asked for, with chunks before the sound."""
    form = b"fmt " + struct.pack("<IHHIIHH", 16, tag, 1, rate, 2 * rate, 2, 16)
    data = b"data" + struct.pack("<I", 640) + bytes(640)
    inside = b"WAVE" + chunks + form + data
    return {"talk.wav": b"RIFF" + struct.pack("<I", len(inside)) + inside}


def _flac(samples: int) -> bytes:
    out = io.BytesIO()
    soundfile.write(out, np.zeros(samples), 16000, format="FLAC")
    return out.getvalue()


def _rf64(size: int) -> Files:
    """A ds64 chunk shorter than its three sizes."""
    whole = _wav(1, b"ds64" + struct.pack("<I", size) + bytes(size))["talk.wav"]
    return {"talk.wav": b"RF64" + b"\xff" * 4 + whole[8:]}


_BROKEN_HEADER = "{'descr': '<f4', 'fortran_order': False, 'shape': ((3,), }"
_CORPUS = {
    "format": "elocute-corpus",
    "version": 1,
    "fps": 30,
    "kind": "weights",
    "components": [],
    "topology": "",
    "subjects": ["a"],
    "note": "",
    "splits": {},
}
_RECORD = {
    "word": "hello",
    "digest": "",
    "shard": None,
    "aligned": 1,
    "captured": 0,
    "pairs": 1,
    "seconds": 1.0,
}
_CLIP = {"subject": "a", "sentence": "b", "text": "", "start": 0, "frames": 1}


def _corpus(**changes: Any) -> Files:
    """A manifest; a field given as text in angle brackets stands there unquoted."""
    record = {**_CORPUS, "clips": [_CLIP], **changes}
    text = json.dumps(record).replace('"<', "").replace('>"', "")
    return {"corpus.json": text.encode()}


FOUND: dict[str, Made] = {
    "identity of huge whole numbers": (
        "identity",
        partial(_text, "face.json", f'{{"identity": [{HUGE}]}}'),
    ),
    "identity of infinity": ("identity", partial(_text, "face.json", '{"identity": [Infinity]}')),
    "style of a huge whole number": (
        "style",
        partial(_text, "style.json", f'{{"amplitude": {HUGE}}}'),
    ),
    "style of a very long text": (
        "style",
        partial(_text, "style.json", '{"amplitude": "' + "x" * 5000 + '"}'),
    ),
    "style of lists in lists": (
        "style",
        partial(_text, "style.json", '{"amplitude": ' + "[" * 900 + "]" * 900 + "}"),
    ),
    "scan with a face far beyond its vertices": (
        "scan",
        partial(_text, "scan.obj", "v 0 0 0\nv 0 1 0\nv 1 0 0\nf 1 2 2147483648\n"),
    ),
    "mix of huge whole numbers": (
        "style",
        partial(_text, "style.json", f'{{"mix": {{"calm": {HUGE}, "broad": 1}}}}'),
    ),
    "words that last a huge whole number": (
        "words",
        partial(
            _text,
            "words.json",
            f'{{"format": "elocute-words", "version": 1, "duration_s": {HUGE}, "words": []}}',
        ),
    ),
    "words from a huge whole number": (
        "words",
        partial(
            _text,
            "words.json",
            '{"format": "elocute-words", "version": 1, "duration_s": 3, "words": '
            f'[{{"word": "a", "start_s": {HUGE}, "end_s": 1, "confidence": 1}}]}}',
        ),
    ),
    "phones nested deeply": ("parts", partial(_text, "parts.json", DEEP)),
    "phones at huge whole numbers": (
        "parts",
        partial(_text, "parts.json", f'{{"phones": [[0, {HUGE}, "a"]]}}'),
    ),
    "word that ends at a huge whole number": (
        "parts",
        partial(_text, "parts.json", f'{{"phones": [[0, 1, "a"]], "word": [0, {HUGE}]}}'),
    ),
    "landmarks of 400 digits": (
        "landmarks",
        partial(_text, "00000.json", f'{{"points": [[{HUGE}, 0, 0]]}}'),
    ),
    "landmarks in no group": ("landmarks", partial(_text, "00000.ljson", '{"groups": {}}')),
    "landmarks, one very long word": (
        "landmarks",
        partial(_text, "00000.pts", "{" + "a" * 5000 + "}"),
    ),
    "capture.json with a very long text": (
        "capture",
        partial(
            _text,
            "capture.json",
            '{"format": "elocute-scans", "version": 1, "sound": "' + "x" * 5000 + '"}',
        ),
    ),
    "capture.json with a sound of no name": (
        "capture",
        partial(
            _text, "capture.json", '{"format": "elocute-scans", "version": 1, "sound": "a\\u0000b"}'
        ),
    ),
    "vertex list whose header does not close": (
        "vertex list",
        lambda: {"lips.npy": npy(_BROKEN_HEADER, bytes(12))},
    ),
    "vertex list of a list of types": ("vertex list", lambda: {"lips.npy": _shape("(3,)", ",i8")}),
    "vertex list of exabytes": ("vertex list", lambda: {"lips.npy": _shape(f"({10**18},)", "<i8")}),
    "motion whose texts are a number": (
        "motion",
        lambda: _archive("talk.npz", {"texts": _json_array(3)}),
    ),
    "motion of exabytes": (
        "motion",
        lambda: _archive("talk.npz", {"texts": _shape(f"({10**18},)", "|u1")}),
    ),
    "motion whose header does not close": (
        "motion",
        lambda: _archive("talk.npz", {"texts": npy(_BROKEN_HEADER, bytes(12))}),
    ),
    "head whose texts are a list": (
        "head",
        lambda: _archive("head.npz", {"texts": _json_array([])}),
    ),
    "head of exabytes": (
        "head",
        lambda: _archive("head.npz", {"template": _shape(f"({10**18},)")}),
    ),
    "head that is empty": ("head", lambda: {"head.npz": b""}),
    "frame whose record is a number": (
        "frame",
        lambda: _archive("00003.npz", {"record": _json_array(1.5)}),
    ),
    "frame that is cut off": ("frame", lambda: {"00003.npz": b"PK\x05\x06" + bytes(10)}),
    "track that is no archive": ("track", lambda: {"clip.npz": b"nothing"}),
    "take that is no archive": ("take", lambda: {"clip.npz": b"nothing"}),
    "sound of an unknown coding": ("wav", lambda: _wav(0x0999)),
    "sound of a coding without a decoder": ("wav", lambda: _wav(0x0042)),
    "sound with a short ds64": ("wav", partial(_rf64, 4)),
    "corpus with a template that is no number": (
        "corpus",
        lambda: {"templates.npy": _shape("(3, 80, 3)", "<f4", b"\xff" * 2880)},
    ),
    "corpus with a sound of a few samples": (
        "corpus",
        lambda: {"sound/anna.ahanna.flac": _flac(20)},
    ),
    "corpus at an infinite frame": (
        "corpus",
        partial(_corpus, clips=[{**_CLIP, "start": "<Infinity>"}]),
    ),
    "corpus of infinite frames": (
        "corpus",
        partial(_corpus, clips=[{**_CLIP, "frames": "<1e400>"}]),
    ),
    "corpus at a huge rate": ("corpus", partial(_corpus, fps=f"<{HUGE}>")),
    "corpus with a list in a split": (
        "corpus",
        partial(_corpus, splits={"s": {"train": [[]], "validation": [], "test": []}}),
    ),
    "shards of infinitely many rows": (
        "shards",
        partial(
            _text,
            "shards/manifest.json",
            '{"format": "elocute-shards", "version": 1, "components": 1e400, "note": "", '
            '"shards": [{"name": "a.parquet", "rows": 1, "sha256": ""}]}',
        ),
    ),
    "record of a word whose rejects are texts": (
        "word record",
        partial(_text, "hello.json", json.dumps({**_RECORD, "rejects": ["no"]})),
    ),
    "sound faster than FLAC holds": (
        "folder",
        lambda: {"wav/B_e01.wav": _wav(rate=700_000)["talk.wav"]},
    ),
    "vertex list whose header has escapes": (
        "vertex list",
        lambda: {"lips.npy": npy("{'descr': '<f4\\\\,', 'shape': (3,), }", bytes(12))},
    ),
    "features of rows that are texts": (
        "features",
        partial(
            _text,
            "rows.json",
            '{"fps": 30, "encoder": "mel-deltas", "parameters": 3, "missing": [], '
            '"rows": [["a", "b", "c", "train", "0", 1, 0, 1, 0]]}',
        ),
    ),
    "features nested deeply": ("features", partial(_text, "rows.json", DEEP)),
    "size of 5,000 digits": ("option size", partial(_text, "text", "9" * 5000)),
    "encoder of a very long name": ("option encoder", partial(_text, "text", "x" * 5000)),
    "mix of a very long name": ("option mix", partial(_text, "text", "x" * 5000)),
    "identity of bytes that are no text": ("option identity", lambda: {"text": b"\xff\xfe" * 1000}),
}
