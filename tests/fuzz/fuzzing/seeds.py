"""Small valid files of every format that is read, made here: each takes milliseconds to read."""

from __future__ import annotations

import importlib.util
import json
import shutil
import struct
import sys
from dataclasses import asdict, replace
from fractions import Fraction
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from elocute.audio.waveform import Waveform
from elocute.head.mesh import head_from_arrays
from elocute.head.model import HeadModel
from elocute.motion.motion import Motion

ROOT = Path(__file__).resolve().parents[3]
RATE = 16000
VERTICES = 80


def module(path: str) -> ModuleType:
    """A file of tests, imported: what writes VOCASET and Python 2's pickles stands there."""
    spec = importlib.util.spec_from_file_location(Path(path).stem + "_of_tests", ROOT / path)
    assert spec and spec.loader
    made = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = made
    spec.loader.exec_module(made)
    return made


def place(folder: Path, name: str) -> Path:
    """A new folder for one seed."""
    (folder / name).mkdir(parents=True)
    return folder / name


def tone(seconds: float = 0.2, rate: int = RATE) -> np.ndarray:
    """(sample,) float32: a hum that swells."""
    time_s = np.arange(round(seconds * rate)) / rate
    swell = np.abs(np.sin(7 * time_s))
    return (0.4 * swell * np.sin(2 * np.pi * 210 * time_s)).astype(np.float32)


# Heads and motion.


def small_head(name: str = "small") -> HeadModel:
    """A ball as large as a head that names places as the built-in head does."""
    rng = np.random.default_rng(0)
    points = rng.normal(size=(VERTICES, 3))
    points = (0.12 * points / np.linalg.norm(points, axis=1, keepdims=True)).astype(np.float32)
    faces = np.stack([np.arange(VERTICES - 2), np.arange(1, VERTICES - 1), np.arange(2, VERTICES)])
    shapes = np.zeros((3, VERTICES, 3), np.float32)
    shapes[:, :20, 1] = -0.01 * np.arange(1, 4)[:, None]
    head = head_from_arrays(
        name, points, faces.T, expression_names=("jawOpen", "a", "b"), expression_basis=shapes
    )
    ring = np.arange(8, dtype=np.int32)
    return replace(
        head,
        joint_names=("head", "jaw"),
        joint_parents=(-1, 0),
        joint_positions=np.zeros((2, 3), np.float32),
        skin_weights=np.full((VERTICES, 2), 0.5, np.float32),
        identity_basis=np.ones((2, VERTICES, 3), np.float32) * np.float32(1e-3),
        joint_identity_basis=np.zeros((2, 2, 3), np.float32),
        landmarks=np.arange(68, dtype=np.int32),
        lip_rings=np.stack([ring, ring + 8]),
        outer_lip_upper=ring,
        outer_lip_lower=ring + 8,
        inner_lip_upper=ring + 16,
        inner_lip_lower=ring + 24,
        outer_corners=np.array([0, 7], np.int32),
        inner_corners=np.array([1, 6], np.int32),
        mirror=np.arange(VERTICES, dtype=np.int32),
        regions={"lips": ring, "face": np.arange(40, dtype=np.int32)},
        tone_basis=np.array([0.5, 0.1, 0.1], np.float32),
    )


def small_motion(frames: int = 5, turning: bool = True) -> Motion:
    head = small_head()
    weights = np.linspace(0, 1, frames * 3, dtype=np.float32).reshape(frames, 3)
    turns = np.zeros((frames, 2, 4), np.float32)
    turns[..., 0] = 1
    return Motion(head, weights, 30.0, turns if turning else None)


def motions(folder: Path) -> None:
    from elocute.motion.store import save_motion

    save_motion(small_motion(), place(folder, "turning") / "talk.npz")
    save_motion(small_motion(turning=False), place(folder, "still") / "talk.npz")


def heads(folder: Path) -> None:
    from elocute.head.store import save_head

    save_head(place(folder, "small") / "head.npz", small_head())


def flame(folder: Path) -> None:
    python2 = module("tests/conftest.py").Python2()
    entries = python2.flame(vertices=60, components=400)
    for protocol in (0, 2):
        path = place(folder, f"protocol{protocol}") / "model.pkl"
        path.write_bytes(python2.dumps(entries, protocol))


def meshes(folder: Path) -> None:
    """Text and binary meshes of the size of a head."""
    import trimesh

    head = small_head()
    mesh = trimesh.Trimesh(head.template, head.triangles, process=False)
    for name, kind, options in (
        ("obj", "obj", {}),
        ("binary", "ply", {"encoding": "binary"}),
        ("ascii", "ply", {"encoding": "ascii"}),
    ):
        data: Any = mesh.export(file_type=kind, **options)
        data = data.encode() if isinstance(data, str) else data
        (place(folder, name) / f"mesh.{kind}").write_bytes(data)


def big_endian(folder: Path) -> None:
    """A .ply in the order of bytes that our own reader leaves to trimesh."""
    head = small_head()
    opening = (
        f"ply\nformat binary_big_endian 1.0\nelement vertex {VERTICES}\nproperty float x\n"
        f"property float y\nproperty float z\nelement face {len(head.triangles)}\n"
        "property list uchar int vertex_indices\nend_header\n"
    )
    faces = b"".join(struct.pack(">B3i", 3, *map(int, row)) for row in head.triangles)
    data = opening.encode() + head.template.astype(">f4").tobytes() + faces
    (place(folder, "big_endian") / "mesh.ply").write_bytes(data)


def scans(folder: Path) -> None:
    """As `meshes`, one that our own writer wrote, and one with a texture."""
    from PIL import Image

    from elocute.capture.scans.scan_file import write_scan

    meshes(folder)
    big_endian(folder)
    head = small_head()
    colours = np.full((VERTICES, 3), 120, np.uint8)
    write_scan(place(folder, "ours") / "scan.ply", head.template, head.triangles, colours)
    textured = place(folder, "textured")
    lines = ["mtllib scan.mtl", "usemtl skin"]
    lines += [f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in head.template[:12]]
    lines += [f"vt {i / 12:.3f} {i / 24:.3f}" for i in range(12)]
    lines += [f"f {i}/{i} {i + 1}/{i + 1} {i + 2}/{i + 2}" for i in range(1, 11)]
    (textured / "scan.obj").write_text("\n".join(lines) + "\n")
    (textured / "scan.mtl").write_text("newmtl skin\nKd 1 1 1\nmap_Kd skin.png\n")
    Image.new("RGB", (8, 8), (200, 150, 130)).save(textured / "skin.png")


def vertex_lists(folder: Path) -> None:
    numbers = np.array([1, 5, 9, 30], np.int64)
    np.save(place(folder, "npy") / "lips.npy", numbers)
    (place(folder, "json") / "lips.json").write_text(json.dumps(numbers.tolist()))
    (place(folder, "txt") / "lips.txt").write_text("1, 5 9\n30\n")


def frames(folder: Path) -> None:
    """A registered frame of a capture, and the person's own face beside it."""
    from elocute.capture.registered_frames import FrameRecord, write_frame
    from elocute.capture.registration.accuracy import SurfaceError
    from elocute.capture.registration.model_fit import ModelParameters
    from elocute.capture.registration.pose import HeadPose
    from elocute.capture.registration.register import Registration

    points = small_head().template.astype(np.float64)
    surface = SurfaceError(**dict.fromkeys(SurfaceError.__dataclass_fields__, 0.5))
    shape = ModelParameters(np.zeros(2), np.zeros(3), HeadPose(np.zeros(3), np.zeros((2, 3))))
    found = Registration(points, points, shape, 0 * points, surface, 1.0, 0.1, ("a note",))
    record = FrameRecord(3, "", surface, 1.0, 68, 0.1, ("a note",))
    write_frame(place(folder, "good") / "00003.npz", "key", record, found)
    write_frame(place(folder, "flagged") / "00003.npz", "key", FrameRecord(3, "lost"), None)


# JSON and text.


def identities(folder: Path) -> None:
    numbers = [round(0.1 * i - 2, 2) for i in range(50)]
    (place(folder, "one") / "face.json").write_text(json.dumps({"identity": numbers}))


def styles(folder: Path) -> None:
    (place(folder, "fields") / "style.json").write_text('{"amplitude": 1.2, "hold_s": 0.1}')
    (place(folder, "mix") / "style.json").write_text('{"mix": {"calm": 0.7, "broad": 0.3}}')


def mixes(folder: Path) -> None:
    (place(folder, "mix") / "mix.json").write_text('{"mix": {"anna": 0.7, "bob": 0.3}, "n": 1}')


SHORT_GRID = """File type = "ooTextFile"
Object class = "TextGrid"

0
1.5
<exists>
2
"IntervalTier"
"words"
0
1.5
3
0
0.4
""
0.4
0.9
"hello"
0.9
1.5
"world"
"TextTier"
"points"
0
1.5
1
0.7
"here"
"""


def words(folder: Path) -> None:
    from elocute.alignment.word_times import TimedWord, TimedWords, write_words

    said = TimedWords((TimedWord("she", 0.1, 0.4, 0.9), TimedWord("had", 0.5, 0.9, 0.8)), 1.5)
    write_words(said, place(folder, "json") / "words.json")
    write_words(said, place(folder, "long") / "words.TextGrid")
    (place(folder, "short") / "words.TextGrid").write_text(SHORT_GRID)
    (place(folder, "utf16") / "words.TextGrid").write_bytes(SHORT_GRID.encode("utf-16"))


def parts(folder: Path) -> None:
    record = {"phones": [[0, 0.1, "S"], [0.1, 0.3, "IY"]], "word": [0.0, 0.3]}
    (place(folder, "one") / "parts.json").write_text(json.dumps(record))


def phones(folder: Path) -> None:
    text = "start_s,end_s,phone\n0,0.1,SIL\n0.1,0.22,HH\n0.22,0.4,AH0\n0.4,0.6,L\n"
    (place(folder, "one") / "phones.csv").write_text(text)


def texts(folder: Path) -> None:
    (place(folder, "tsv") / "texts.tsv").write_text("anna\tsentence01\tShe had.\nbob\te02\tHi\n")
    record = {"anna": {"sentence01": "She had."}, "bob": {"e02": "Hi"}}
    (place(folder, "json") / "texts.json").write_text(json.dumps(record))


def landmarks(folder: Path) -> None:
    points = small_head().template[:68].astype(float)
    given = {"points": points.tolist(), "confidence": [0.9] * 68}
    given["points"][4] = None
    (place(folder, "json") / "00000.json").write_text(json.dumps(given))
    grouped = {"version": 2, "labels": [], "landmarks": {"points": points.tolist()}}
    (place(folder, "ljson2") / "00000.ljson").write_text(json.dumps(grouped))
    groups = {"version": 3, "groups": {"LJSON": {"landmarks": {"points": points.tolist()}}}}
    (place(folder, "ljson3") / "00000.ljson").write_text(json.dumps(groups))
    rows = "\n".join(" ".join(f"{x:.4f}" for x in row) for row in points)
    (place(folder, "pts") / "00000.pts").write_text(f"version: 1\nn_points: 68\n{{\n{rows}\n}}\n")


def capture_folders(folder: Path) -> None:
    from elocute.capture.scans.scan_file import write_scan
    from elocute.capture.scans.scan_sequence import SequenceMetadata, write_metadata

    head, inner = small_head(), place(folder, "one")
    metadata = SequenceMetadata(subject="anna", sentence="ah", text="ah", sound="ah.wav", neutral=0)
    write_metadata(inner, metadata)
    for number in range(2):
        write_scan(inner / f"{number:05}.ply", head.template, head.triangles)
    write_wav(inner / "ah.wav")


def word_records(folder: Path) -> None:
    from elocute.corpus.shards import ShardEntry
    from elocute.propagation.word_job import RejectedRecording, WordResult, save_word_result

    shard = ShardEntry("hello.parquet", 3, "0" * 64)
    record = WordResult(
        "hello", "d" * 64, shard, 2, 1, 4, (RejectedRecording("hello", "a.wav", "no"),), 1.5
    )
    save_word_result(record, place(folder, "one") / "hello.json")


def curves(folder: Path) -> None:
    from elocute.export.arkit_csv import POSE_COLUMNS
    from elocute.head.builtin import load_builtin_head

    names = [name[:1].upper() + name[1:] for name in load_builtin_head().expression_names]
    rows = [",".join(["Timecode", "BlendShapeCount", *names, *POSE_COLUMNS])]
    zeros = ",".join(["0.000000"] * len(POSE_COLUMNS))
    for frame in range(3):
        values = ",".join(f"{0.01 * (frame + i):.6f}" for i in range(len(names)))
        rows.append(f"00:00:00:{frame:06.3f},61,{values},{zeros}")
    (place(folder, "one") / "take.csv").write_text("\n".join(rows) + "\n")


def lrw(folder: Path) -> None:
    inner = place(folder, "one") / "lipread_mp4" / "ABOUT" / "train"
    inner.mkdir(parents=True)
    encoded(inner / "ABOUT_00001.mp4", "aac", 0.4)
    text = "Disk reference: 12345\nChannel: ANY\nDuration: 0.30 seconds\n"
    (inner / "ABOUT_00001.txt").write_text(text)


OPTIONS = {
    "size": ("800", "1280x720", "4k"),
    "mix": ("calm:0.7,broad:0.3", "plain"),
    "identity": ("mean", "17"),
    "keyframes": ("0:0,0,0; 1.5:0,20,0",),
    "numbers": ("1,2.5,-3",),
    "encoder": ("phones", "fbank"),
    "identities": ("0:mean; 2:5",),
    "text": ("She had your dark suit",),
}


def options(which: str):
    """Seeds of one option's texts."""

    def write(folder: Path) -> None:
        for number, text in enumerate(OPTIONS[which]):
            (place(folder, str(number)) / "text").write_text(text)

    return write


# Sound and video.


def write_wav(path: Path, seconds: float = 0.2, subtype: str = "PCM_16") -> None:
    import soundfile

    soundfile.write(path, tone(seconds), RATE, subtype=subtype)


def wavs(folder: Path) -> None:
    import soundfile

    samples = tone()
    for subtype in ("PCM_16", "PCM_U8", "PCM_24", "FLOAT", "ULAW", "IMA_ADPCM"):
        write_wav(place(folder, subtype) / "talk.wav", subtype=subtype)
    two = np.stack([samples, samples], axis=1)
    soundfile.write(place(folder, "extensible") / "talk.wav", two, RATE, format="WAVEX")
    soundfile.write(place(folder, "rf64") / "talk.wav", samples, RATE, format="RF64")


def flacs(folder: Path) -> None:
    import soundfile

    soundfile.write(place(folder, "flac") / "talk.flac", tone(), RATE)


def aiffs(folder: Path) -> None:
    import soundfile

    soundfile.write(place(folder, "aiff") / "talk.aiff", tone(), RATE)


def oggs(folder: Path) -> None:
    import soundfile

    soundfile.write(place(folder, "vorbis") / "talk.ogg", tone(), RATE)
    encoded(place(folder, "opus") / "talk.opus", "libopus", 0.3, 48000)


def encoded(path: Path, codec: str, seconds: float = 0.3, rate: int = RATE) -> None:
    """A sound in whatever container the suffix means."""
    import av

    with av.open(str(path), "w") as file:
        stream: Any = file.add_stream(codec, rate=rate, layout="mono")
        frame = av.AudioFrame.from_ndarray(tone(seconds, rate)[None], format="fltp", layout="mono")
        frame.sample_rate, frame.time_base, frame.pts = rate, Fraction(1, rate), 0
        context = stream.codec_context
        packer = av.AudioResampler(
            context.format.name, "mono", rate, frame_size=context.frame_size or 1024
        )
        for piece in [*packer.resample(frame), *packer.resample(None)]:
            file.mux(stream.encode(piece))
        file.mux(stream.encode(None))


def mp3s(folder: Path) -> None:
    encoded(place(folder, "mp3") / "talk.mp3", "mp3")


def mp4s(folder: Path) -> None:
    encoded(place(folder, "m4a") / "talk.m4a", "aac")
    encoded(place(folder, "mp4") / "talk.mp4", "aac")


def mkvs(folder: Path) -> None:
    encoded(place(folder, "mkv") / "talk.mkv", "aac")
    encoded(place(folder, "webm") / "talk.webm", "libopus", 0.3, 48000)


def videos(folder: Path) -> None:
    import av

    for name, codec in (("talk.mp4", "libx264"), ("talk.mkv", "mpeg4")):
        with av.open(str(place(folder, codec) / name), "w") as file:
            film: Any = file.add_stream(codec, rate=25)
            film.width, film.height, film.pix_fmt = 48, 32, "yuv420p"
            for number in range(4):
                picture = np.full((32, 48, 3), 40 * number, np.uint8)
                frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
                frame.pts = number
                file.mux(film.encode(frame))
            file.mux(film.encode(None))


# Corpora and shards.


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
    from elocute.training.crnn.feature_cache import BANDS, STATIC, TARGETS

    inner = place(folder, "one")
    np.save(inner / STATIC, np.zeros((20, BANDS), "<f2"))
    np.save(inner / TARGETS, np.zeros((5, 3), "<f4"))
    rows = [["c0", "hello", "anna", "train", 0, 20, 0, 5, 0]]
    record = {"fps": 30.0, "parameters": 3, "missing": [["c1", "no sound"]], "rows": rows}
    (inner / "rows.json").write_text(json.dumps(record))


def tracks(folder: Path) -> None:
    """Lips tracked in video, as `grid` has them, and a sound beside them."""
    import soundfile

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
    soundfile.write(inner / "clip.ogg", tone(0.6), RATE)


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


# Networks.


def frozen_graphs(folder: Path) -> None:
    """DeepSpeech's node names around a few units."""
    from elocute.files.protobuf import write_message

    inputs, hidden, letters = 494, 2, 29
    sizes = {
        "1": (inputs, hidden),
        "2": (hidden, hidden),
        "3": (hidden, 2 * hidden),
        "5": (2 * hidden, hidden),
        "6": (hidden, letters),
    }
    arrays = {f"h{layer}": np.full(size, 0.1, "<f4") for layer, size in sizes.items()}
    arrays |= {f"b{layer}": np.zeros(size[1], "<f4") for layer, size in sizes.items()}
    for way in ("fw", "bw"):
        cell = f"bidirectional_rnn/{way}/basic_lstm_cell"
        arrays[f"{cell}/kernel"] = np.full((3 * hidden, 4 * hidden), 0.1, "<f4")
        arrays[f"{cell}/bias"] = np.zeros(4 * hidden, "<f4")

    def node(name: str, operation: str, array: np.ndarray | None = None) -> bytes:
        fields: list[tuple[int, Any]] = [(1, name), (2, operation)]
        if array is not None:
            shape = write_message(*((2, write_message((1, size))) for size in array.shape))
            tensor = write_message((1, 1), (2, shape), (4, array.tobytes()))
            fields.append((5, write_message((1, "value"), (2, write_message((8, tensor))))))
        return write_message((1, write_message(*fields)))

    nodes = [node(name, "Placeholder") for name in ("input_node", "input_lengths")]
    nodes += [node("logits", "Identity")]
    nodes += [node(name, "Const", array) for name, array in arrays.items()]
    (place(folder, "one") / "output_graph.pb").write_bytes(b"".join(nodes))


def shipped(*names: str):
    """Copies of networks that ship."""

    def copy(folder: Path) -> None:
        for path in (ROOT / "src" / "elocute").rglob("*.onnx"):
            if path.name in names:
                shutil.copy(path, place(folder, path.stem) / path.name)

    return copy


def checkpoints(folder: Path) -> None:
    """As `train voca` leaves them, of a network of eight numbers."""
    import torch

    from elocute.training.checkpoint import network_tensors, save_checkpoint
    from elocute.training.voca.config import VocaTrainConfig

    network = torch.nn.Linear(3, 2)
    optimiser = torch.optim.Adam(network.parameters())
    network(torch.ones(1, 3)).sum().backward()
    optimiser.step()
    record = {
        "config": asdict(VocaTrainConfig()),
        "styles": ["anna"],
        "fps": 60.0,
        "log": [{"epoch": 1, "train_mm2": 0.5}],
    }
    path = place(folder, "one") / "checkpoint.safetensors"
    save_checkpoint(path, network_tensors(network, optimiser), record)


TINY = {
    "model_type": "wav2vec2",
    "hidden_size": 24,
    "num_hidden_layers": 2,
    "num_attention_heads": 2,
    "intermediate_size": 32,
    "conv_dim": [16] * 7,
    "num_conv_pos_embeddings": 16,
    "num_conv_pos_embedding_groups": 2,
    "vocab_size": 32,
    "conv_stride": [5, 2, 2, 2, 2, 2, 2],
    "conv_kernel": [10, 3, 3, 3, 3, 2, 2],
}


def transformer_folders(folder: Path) -> None:
    """The settings of a small network; its weights are only weighed here."""
    inner = place(folder, "one")
    (inner / "config.json").write_text(json.dumps(TINY))
    (inner / "preprocessor_config.json").write_text(
        '{"sampling_rate": 16000, "do_normalize": true}'
    )
    (inner / "model.safetensors").write_bytes(bytes(20_000))


def transformer_networks(folder: Path) -> None:
    import torch
    from transformers import Wav2Vec2Config, Wav2Vec2Model

    torch.manual_seed(0)
    settings = {name: value for name, value in TINY.items() if name != "model_type"}
    Wav2Vec2Model(Wav2Vec2Config(**settings)).save_pretrained(place(folder, "one"))
