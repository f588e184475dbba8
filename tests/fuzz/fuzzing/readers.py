"""The registry: every function of the package that takes a file, a folder or a text of a user.

Each call goes as far as a command would: a corpus is opened and all its clips are read, a network
is opened and runs once.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib.util
import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from tests.fuzz.fuzzing import seeds
from tests.fuzz.fuzzing.cases import Files, Reader


def only(read: Callable[[Path], object]) -> Callable[[Path, Path], object]:
    """For readers of one file: the only one in the folder."""
    return lambda folder, _out: read(next(path for path in folder.iterdir()))


def text(read: Callable[[str], object]) -> Callable[[Path, Path], object]:
    """For texts of options, as a shell hands them over."""
    return only(
        lambda path: read(path.read_bytes().replace(b"\0", b"").decode("utf-8", "surrogateescape"))
    )


# What is read, one function for each.


def _identity(path: Path) -> None:
    from elocute.head.identity import read_identity

    read_identity(path)


def _style(path: Path) -> None:
    from elocute.articulation.style import resolve_style

    resolve_style(str(path))


def _mix(path: Path) -> None:
    from elocute.models.styles import read_mix

    read_mix(path)


def _words(path: Path) -> None:
    from elocute.alignment.word_times import merge_edits, read_words

    words = read_words(path)
    merge_edits(words, words)


def _parts(path: Path) -> None:
    from elocute.evaluation.timed_recordings import read_phone_times

    read_phone_times(path)


def _phones(path: Path) -> None:
    from elocute.articulation.phone_times import read_phone_times

    read_phone_times(path)


def _texts(path: Path) -> None:
    from elocute.corpus.importers.vocaset import read_texts

    read_texts(path)


def _landmarks(path: Path) -> None:
    from elocute.capture.scans.landmarks import read_landmarks

    read_landmarks(path, 0.001)


def _capture(folder: Path, _out: Path) -> None:
    from elocute.capture.scans.scan_sequence import find_sequences, open_sequence

    for inner in find_sequences(folder):
        sequence = open_sequence(inner)
        _ = sequence.missing, sequence.name, sequence.landmark_file(sequence.neutral)
        sequence.scan(sequence.neutral)


def _word_record(path: Path) -> None:
    from elocute.propagation.word_job import load_word_result

    load_word_result(path)


def _curves(path: Path) -> None:
    from elocute.export.arkit_csv import read_csv_curves

    read_csv_curves(path, 60.0)


def _lrw(folder: Path, _out: Path) -> None:
    from elocute.propagation.word_recordings import find_recordings, word_span

    found = find_recordings(folder)
    for word in found.words:
        for recording in found.of(word)[0]:
            word_span(folder, recording, 0.4)


def _motion(path: Path) -> None:
    from elocute.motion.store import load_motion

    motion = load_motion(path)
    motion.vertices()
    _ = motion.head.triangles, motion.head.uv_triangles, motion.head.triangle_material


def _head(path: Path) -> None:
    from elocute.head.registry import open_head

    head = open_head(path)
    head.with_identity(np.ones(len(head.identity_basis), np.float32))
    _ = head.triangles, head.uv_triangles, head.triangle_material, head.eye_distance_m


def _flame(path: Path) -> None:
    from elocute.head.registry import open_head

    head = open_head(path)
    _ = head.triangles, head.with_identity(np.ones(len(head.identity_basis), np.float32))


def _mesh(path: Path) -> None:
    from elocute.head.registry import open_head

    _ = open_head(path).triangles


def _scan(folder: Path, _out: Path) -> None:
    from elocute.capture.scans.scan import checked_scan
    from elocute.capture.scans.scan_file import read_scan
    from elocute.errors import CaptureError

    path = next(path for path in folder.iterdir() if path.suffix in (".ply", ".obj"))
    scan = read_scan(path)
    with contextlib.suppress(CaptureError):  # none of the seeds has points enough
        checked_scan(scan)


def _vertex_list(path: Path) -> None:
    from elocute.evaluation.vertex_regions import read_vertex_region

    read_vertex_region(path, 100)


def _frame(path: Path) -> None:
    from elocute.capture.frame_store import (
        read_frame_record,
        read_pose,
        read_registration,
        read_zero,
    )

    record = read_frame_record(path, "key")
    if record is not None and not record.flag:
        read_zero(path)
        read_pose(path)
        read_registration(path, record)


def _sound(path: Path) -> None:
    from elocute.audio.read import probe_audio, read_audio

    read_audio(path, sample_rate=16000)
    probe_audio(path)


def _video(path: Path) -> None:
    from elocute.capture.video.video_frames import Video

    with Video(path) as video:
        for _ in video.pictures():
            pass


def _corpus(folder: Path, _out: Path) -> None:
    from elocute.corpus.corpus_checks import check_corpus
    from elocute.corpus.corpus_store import open_corpus

    corpus = open_corpus(folder)
    check_corpus(corpus)
    _ = corpus.faces
    for entry in corpus.entries:
        corpus.clip(entry.name)
        corpus.vertices(entry.name)


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


def _features(folder: Path, _out: Path) -> None:
    from elocute.training.crnn.feature_cache import open_feature_cache

    cache = open_feature_cache(folder)
    for clip in cache.clips:
        np.asarray(cache.columns(clip))
        np.asarray(cache.parameters(clip))


def _track(path: Path, _out: Path) -> None:
    from elocute.corpus.importers.grid import read_tracked_lips

    read_tracked_lips(path / "clip.npz")


def _take(path: Path, _out: Path) -> None:
    from elocute.evaluation.tracked_mouth_scores import find_tracked_mouths, read_tracked_mouth

    for take in find_tracked_mouths(path):
        read_tracked_mouth(take)


def _convert(format: str) -> Callable[[Path, Path], object]:
    def read(folder: Path, out: Path) -> None:
        from elocute.corpus.importers.registry import convert

        convert(folder, out / "corpus", format=format)

    return read


def _pickle(path: Path) -> None:
    from elocute.files.pickles.closed_pickle import read_pickle

    read_pickle(path)


def _vl(path: Path) -> None:
    from elocute.corpus.importers.biwi import read_vl

    read_vl(path)


def _deepspeech(path: Path) -> None:
    from elocute.audio.waveform import Waveform
    from elocute.encoders.deepspeech import DeepSpeech

    DeepSpeech(path)(Waveform(seeds.tone(), seeds.RATE))


def _model(path: Path) -> None:
    from elocute.animation import animate
    from elocute.audio.waveform import Waveform

    style = "even" if path.stem == "voca" else "plain"
    animate(Waveform(seeds.tone(), seeds.RATE), model=path, style=style, fps=30.0)


def _phone_encoder(path: Path) -> None:
    from elocute.encoders.phone_encoder import PhoneEncoder

    PhoneEncoder(path).encode(seeds.tone())


def _checkpoint(path: Path) -> None:
    import torch

    from elocute.training.voca.config import VocaTrainConfig
    from elocute.training.voca.fit import _restore

    network: Any = torch.nn.Linear(3, 2)
    optimiser = torch.optim.Adam(network.parameters())
    material: Any = SimpleNamespace(styles=("anna",), fps=60.0)
    _restore(path, network, optimiser, material, VocaTrainConfig())


def _transformer(folder: Path, _out: Path) -> None:
    from elocute.encoders.speech_transformer import Wav2Vec2

    _ = Wav2Vec2(folder).feature_count


def _transformer_network(folder: Path, _out: Path) -> None:
    from elocute.audio.waveform import Waveform
    from elocute.encoders.speech_transformer import Wav2Vec2

    Wav2Vec2(folder)(Waveform(seeds.tone(), seeds.RATE))


def _size(given: str) -> None:
    from elocute.cli.formats import parse_size

    parse_size(given)


def _style_text(given: str) -> None:
    from elocute.articulation.style import resolve_style

    resolve_style(given)


def _identity_text(given: str) -> None:
    from elocute.head.identity import resolve_identity

    resolve_identity(given)


def _keyframes(given: str) -> None:
    from elocute.cli.keyframes import parse_numbers

    parse_numbers("--pose", given, 3)


def _numbers(given: str) -> None:
    from elocute.cli.keyframes import parse_list

    parse_list("--blinks", given)


def _identities(given: str) -> None:
    from elocute.cli.keyframes import split_keyframes
    from elocute.head.identity import resolve_identity

    for _, who in split_keyframes("--identity", given):
        resolve_identity(who)


def _encoder_text(given: str) -> None:
    from elocute.encoders.registry import resolve_encoder

    resolve_encoder(given)


def _read_text(given: str) -> None:
    from elocute.alignment.forced_alignment import words_in

    words_in(given)


_AUDIO = ("elocute.audio.read", "elocute.audio.decoders", "elocute.audio.decoders")
_IMPORTERS = ("elocute.corpus.importers.registry", *_AUDIO)
_JSON = {"*.json": "json"}

READERS: tuple[Reader, ...] = (
    # JSON and text
    Reader("identity", seeds.identities, only(_identity), _JSON, ("elocute.head.identity",)),
    Reader("style", seeds.styles, only(_style), _JSON, ("elocute.articulation.style",)),
    Reader("mix", seeds.mixes, only(_mix), _JSON, ("elocute.models.styles",)),
    Reader(
        "words",
        seeds.words,
        only(_words),
        {"*.json": "json", "*.TextGrid": "text"},
        ("elocute.alignment.word_times",),
    ),
    Reader("parts", seeds.parts, only(_parts), _JSON, ("elocute.evaluation.timed_recordings",)),
    Reader(
        "phones",
        seeds.phones,
        only(_phones),
        {"*.csv": "text"},
        ("elocute.articulation.phone_times",),
    ),
    Reader(
        "texts",
        seeds.texts,
        only(_texts),
        {"*.json": "json", "*.tsv": "text"},
        ("elocute.corpus.importers.vocaset",),
    ),
    Reader(
        "landmarks",
        seeds.landmarks,
        only(_landmarks),
        {"*.json": "json", "*.ljson": "json", "*.pts": "text"},
        ("elocute.capture.scans.landmarks",),
    ),
    Reader(
        "capture",
        seeds.capture_folders,
        _capture,
        {"*.json": "json"},
        ("elocute.capture.scans.scan_sequence",),
    ),
    Reader(
        "word record",
        seeds.word_records,
        only(_word_record),
        _JSON,
        ("elocute.propagation.word_job",),
        needs=("pyarrow", "numba"),
    ),
    Reader("curves", seeds.curves, only(_curves), {"*.csv": "text"}, ("elocute.export.arkit_csv",)),
    Reader("lrw", seeds.lrw, _lrw, {"*.txt": "text"}, ("elocute.propagation.word_recordings",)),
    # Arrays
    Reader("motion", seeds.motions, only(_motion), {"*.npz": "npz"}, ("elocute.motion.store",)),
    Reader("head", seeds.heads, only(_head), {"*.npz": "npz"}, ("elocute.head.registry",)),
    Reader("frame", seeds.frames, only(_frame), {"*.npz": "npz"}, ("elocute.capture.frame_store",)),
    Reader(
        "vertex list",
        seeds.vertex_lists,
        only(_vertex_list),
        {"*.npy": "npy", "*.json": "json", "*.txt": "text"},
        ("elocute.evaluation.vertex_regions",),
    ),
    Reader("track", seeds.tracks, _track, {"*.npz": "npz"}, ("elocute.corpus.importers.grid",)),
    Reader(
        "take",
        seeds.tracks,
        _take,
        {"*.npz": "npz"},
        ("elocute.evaluation.tracked_mouth_scores",),
    ),
    Reader(
        "features",
        seeds.features,
        _features,
        {"*.json": "json", "*.npy": "npy"},
        ("elocute.training.crnn.feature_cache",),
        needs=("torch", "pyarrow"),
    ),
    # Meshes, scans, FLAME
    Reader(
        "scan",
        seeds.scans,
        _scan,
        {"*.ply": "ply", "*.obj": "text", "*.mtl": "text", "*.png": "png"},
        ("elocute.capture.scans.scan", "elocute.capture.scans.scan_file", "trimesh"),
        short=150,
    ),
    Reader(
        "mesh",
        seeds.meshes,
        only(_mesh),
        {"*.ply": "ply", "*.obj": "text"},
        ("elocute.head.registry", "trimesh"),
        short=150,
    ),
    Reader(
        "flame",
        seeds.flame,
        only(_flame),
        {"*.pkl": "pickle"},
        ("elocute.head.registry",),
        short=150,
        needs=("scipy",),
    ),
    Reader(
        "pickle",
        seeds.pickles,
        only(_pickle),
        {"*.pkl": "pickle"},
        ("elocute.files.pickles.closed_pickle",),
        needs=("scipy",),
    ),
    Reader(
        "vl",
        lambda folder: _vl_seed(folder),
        only(_vl),
        {"*.vl": "vl"},
        ("elocute.corpus.importers.biwi",),
    ),
    # Sound and video
    Reader("wav", seeds.wavs, only(_sound), {"*": "riff"}, _AUDIO),
    Reader("aiff", seeds.aiffs, only(_sound), {"*": "riff"}, _AUDIO),
    Reader("flac", seeds.flacs, only(_sound), {"*": "bytes"}, _AUDIO),
    Reader("ogg", seeds.oggs, only(_sound), {"*": "bytes"}, _AUDIO),
    Reader("mp3", seeds.mp3s, only(_sound), {"*": "bytes"}, _AUDIO, short=150),
    Reader("mp4", seeds.mp4s, only(_sound), {"*": "bytes"}, _AUDIO, short=150),
    Reader("mkv", seeds.mkvs, only(_sound), {"*": "bytes"}, _AUDIO, short=150),
    Reader(
        "video",
        seeds.videos,
        only(_video),
        {"*": "bytes"},
        ("elocute.capture.video.video_frames", "av"),
        short=150,
    ),
    # Corpora
    Reader(
        "corpus",
        seeds.corpora,
        _corpus,
        {"*.json": "json", "*.npy": "npy", "*.flac": "bytes"},
        ("elocute.corpus.corpus_store", "elocute.corpus.corpus_checks", *_AUDIO),
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
    # Networks
    Reader(
        "frozen graph",
        seeds.frozen_graphs,
        only(_deepspeech),
        {"*.pb": "proto"},
        ("elocute.encoders.deepspeech",),
    ),
    Reader(
        "model",
        seeds.shipped("voca.onnx", "crnn.onnx"),
        only(_model),
        {"*.onnx": "proto"},
        ("elocute.animation", "elocute.models.registry"),
        short=30,
    ),
    Reader(
        "phone encoder",
        seeds.shipped("phones.onnx"),
        only(_phone_encoder),
        {"*.onnx": "proto"},
        ("elocute.encoders.phone_encoder",),
        short=10,
    ),
    Reader(
        "checkpoint",
        seeds.checkpoints,
        only(_checkpoint),
        {"*.safetensors": "safetensors"},
        ("elocute.training.voca.fit", "torch._dynamo"),
        needs=("torch", "safetensors", "lightning_fabric"),
    ),
    Reader(
        "transformer",
        seeds.transformer_folders,
        _transformer,
        _JSON,
        ("elocute.encoders.speech_transformer",),
    ),
    Reader(
        "transformer network",
        seeds.transformer_networks,
        _transformer_network,
        {"*.json": "json", "*.safetensors": "safetensors"},
        ("elocute.encoders.speech_transformer", "elocute.encoders.speech_transformer_network"),
        needs=("torch", "transformers"),
        short=0,
    ),
    # Texts of options
    *(
        Reader(f"option {name}", seeds.options(name), text(read), {"text": "text"}, modules)
        for name, read, modules in (
            ("size", _size, ("elocute.cli.options",)),
            ("mix", _style_text, ("elocute.articulation.style",)),
            ("identity", _identity_text, ("elocute.head.identity",)),
            ("keyframes", _keyframes, ("elocute.cli.keyframes",)),
            ("numbers", _numbers, ("elocute.cli.keyframes",)),
            ("identities", _identities, ("elocute.cli.keyframes",)),
            ("encoder", _encoder_text, ("elocute.encoders.registry",)),
        )
    ),
)


def usable() -> list[Reader]:
    """Readers whose packages are here."""
    return [
        reader
        for reader in READERS
        if all(importlib.util.find_spec(name) is not None for name in reader.needs)
    ]


def _vl_seed(folder: Path) -> None:
    data = np.int32(4).tobytes() + np.arange(12, dtype="<f4").tobytes()
    (seeds.place(folder, "one") / "frame_001.vl").write_bytes(data)
