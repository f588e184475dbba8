"""What a careless program hands over: one of our errors, never one from inside."""

import io
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile

import elocute
from elocute.audio.features import Features
from elocute.corpus.corpus_store import open_corpus
from elocute.corpus.shards import open_shards
from elocute.errors import AudioError, OutputError
from elocute.motion import edits
from elocute.motion.curves import curves_from_motion
from elocute.motion.vertex_motion import VertexMotion

SILENCE: Any = np.zeros(1600, np.float32)
TWO: Any = np.array([1, 2])
RAGGED: Any = [[1], [2, 3]]
ENDLESS: Any = np.broadcast_to(np.float32(0), (10**10,))
LONG = "x" * 300
WRONG: Any = "x"
HUGE: Any = 10**400
LONGEST: Any = 10**5000  # Python refuses to print it
HEAD = elocute.load_builtin_head()
SHAPES = len(HEAD.expression_names)
ROWS: Any = np.zeros((10, SHAPES), np.float32)
NUMBERS_AS_TEXT: Any = [["1"] * SHAPES]
STILL = elocute.Motion(HEAD, ROWS, 30.0)


def endless(*inner: int) -> Any:
    """What takes no memory, until it is copied."""
    return np.broadcast_to(np.float32(0), (10**10, *inner))


WAVE = elocute.Waveform(SILENCE, 16000)
TAKE = elocute.Animation(STILL, curves_from_motion(STILL), WAVE)
NOISE: Any = np.random.default_rng(0).normal(0, 0.1, 16000).astype(np.float32)
GIVEN: dict[str, Callable[[], object]] = {
    "two rates": lambda: elocute.animate(SILENCE, rate=TWO),
    "two channels": lambda: elocute.animate(SILENCE, rate=16000, channel=TWO),
    "a style file that is none": lambda: elocute.animate(SILENCE, rate=16000, style=Path("a")),  # type: ignore[arg-type]
    "phones as text": lambda: elocute.animate(SILENCE, rate=16000, phones="60"),  # type: ignore[arg-type]
    "more samples than memory": lambda: elocute.animate(ENDLESS, rate=16000),
    "a file of text": lambda: elocute.animate(io.StringIO("la")),  # type: ignore[arg-type]
    "lists of unequal length": lambda: elocute.Waveform(RAGGED, 16000),
    "a block of such lists": lambda: list(elocute.stream(16000).push(RAGGED)),
    "a stream of two rates": lambda: elocute.stream(TWO),
    "curves of such lists": lambda: elocute.Curves(RAGGED, ("a",), 30),
    "curves of text": lambda: elocute.Curves("x", ("a",), 30),  # type: ignore[arg-type]
    "curves of a rate in words": lambda: elocute.Curves(SILENCE[:, None], ("a",), "30"),  # type: ignore[arg-type]
    "motion of text": lambda: elocute.Motion(elocute.load_builtin_head(), "x", 30),  # type: ignore[arg-type]
    "curves of a huge rate": lambda: elocute.Curves(SILENCE[:, None], ("a",), HUGE),
    "curves without end": lambda: elocute.Curves(endless(1), ("a",), 30),
    "a motion without end": lambda: elocute.Motion(HEAD, endless(SHAPES), 30),
    "a motion of text in lists": lambda: elocute.Motion(HEAD, NUMBERS_AS_TEXT, 30),
    "a motion of complex numbers": lambda: elocute.Motion(HEAD, ROWS + 1j, 30),
    "a motion of huge weights": lambda: elocute.Motion(HEAD, ROWS + 1e30, 30),
    "a motion on no head": lambda: elocute.Motion(WRONG, ROWS, 30),
    "a motion of a huge rate": lambda: elocute.Motion(HEAD, ROWS, HUGE),
    "a motion of almost no rate": lambda: elocute.Motion(HEAD, ROWS, 1e-300),
    "turns without end": lambda: elocute.Motion(HEAD, ROWS, 30, endless(5, 4)),
    "vertices from a huge frame on": lambda: STILL.vertices(HUGE),
    "vertices of no frame": lambda: STILL.vertices(5, 5),
    "vertices of no whole frame": lambda: STILL.vertices(WRONG),
    "blocks of no frame": lambda: list(STILL.blocks(0)),
    "a track of text": lambda: VertexMotion(WRONG, HEAD.template, 30),
    "a track of a huge rate": lambda: VertexMotion(ROWS, HEAD.template, HUGE),
    "a waveform without end": lambda: elocute.Waveform(ENDLESS, 16000),
    "a waveform of a rate too long to print": lambda: elocute.Waveform(SILENCE, LONGEST),
    "features without end": lambda: Features(endless(8), 100.0, "mel"),
    "features of a huge rate": lambda: Features(ROWS, HUGE, "mel"),
    "windows of a huge size": lambda: Features(ROWS, 100.0, "mel").windows(HUGE),
    "a pose at a huge time": lambda: edits.with_pose(STILL, "neck", [(HUGE, (0, 0, 0))]),
    "a pose as text": lambda: edits.with_pose(STILL, "neck", ("1", "2", "3")),
    "a pose of a joint without a name": lambda: edits.with_pose(STILL, HUGE, (0, 0, 0)),
    "a gaze of a huge angle": lambda: edits.with_gaze(STILL, (1e308, 0)),
    "a gaze without end": lambda: edits.with_gaze(STILL, range(10**12)),
    "blinks without end": lambda: edits.with_blinks(STILL, range(10**12)),
    "a huge number of blinks": lambda: edits.with_blinks(STILL, per_minute=HUGE),
    "a shape as text": lambda: edits.with_shape(STILL, "jawOpen", WRONG),
    "a shape that no face has": lambda: edits.with_shape(STILL, "jawOpen", 1e38),
    "a face without end": lambda: edits.with_identity(STILL, ENDLESS),
    "a cut at a huge time": lambda: edits.cut(STILL, HUGE),
    "a cut of text": lambda: edits.cut(STILL, WRONG),
    "a head whose names are a number": lambda: replace(HEAD, joint_names=HUGE),
    "a head without end": lambda: replace(HEAD, template=endless(3)),
    "a stream of a huge frame rate": lambda: elocute.stream(16000, fps=LONGEST),
    "a stream of a strength in words": lambda: elocute.stream(16000, strength=WRONG),
    "a stream of a level in words": lambda: elocute.stream(16000, "crnn", level=WRONG),
    "a block without end": lambda: elocute.stream(16000).push(ENDLESS),
    "speech at a huge frame rate": lambda: elocute.animate(SILENCE, rate=16000, fps=LONGEST),
    "speech of a huge face": lambda: elocute.animate(SILENCE, rate=16000, identity=LONGEST),
    "speech by a model of a number": lambda: elocute.animate(SILENCE, rate=16000, model=HUGE),
    "speech in the style of a number": lambda: elocute.animate(SILENCE, rate=16000, style=HUGE),
    "a corpus of a name too long": lambda: open_corpus(LONG),
    "shards of a name too long": lambda: open_shards(LONG, LONG),
}


@pytest.mark.parametrize("name", GIVEN)
def test_one_of_our_errors(name: str):
    with pytest.raises(elocute.InputError) as told:
        GIVEN[name]()
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("given", [{}, None, "talk.npz"])
def test_what_is_no_motion_is_told_so(given: Any, tmp_path: Path):
    from elocute.export.registry import write

    for use in (
        lambda: elocute.save_motion(given, tmp_path / "a.npz"),
        lambda: elocute.measure_mouth(given),
        lambda: write(given, tmp_path / "a.glb"),
        lambda: edits.with_pose(given, "neck", (0, 0, 0)),
    ):
        with pytest.raises(elocute.InputError, match=f"a {type(given).__name__}, not a Motion"):
            use()
    assert not list(tmp_path.iterdir())


SIZES: list[Any] = [(0, 0), (-800, 800), (800,), (800, 800, 3), (1e3, 1e3), ("800", 8), 800, None]


@pytest.mark.parametrize("size", [*SIZES, (HUGE, 800), (8192, 8192), ENDLESS])
@pytest.mark.parametrize("kind", ["mp4", "png"])
def test_no_size_of_a_picture(size: Any, kind: str, tmp_path: Path):
    with pytest.raises(
        elocute.InputError, match=r"`size`: .*; allowed: 2 numbers, each 64 to 4096 pixels"
    ):
        TAKE.write(tmp_path / f"a.{kind}", size=size)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("a.mp4", {"fps": 30}),
        ("a.mp4", {"view": ["front"]}),
        ("a.mp4", {"backend": 5}),
        ("a.png", {"progress": "yes"}),
        ("a.html", {"title": 5}),
        ("a.glb", {"embed_audio": "no"}),
        ("a.glb", {"overwrite": ENDLESS}),
        ("a.npz", {"size": (800, 800)}),
        (5, {}),
    ],
)
def test_no_option_of_a_writer(name: Any, options: dict[str, Any], tmp_path: Path):
    with pytest.raises(elocute.InputError, match="allowed: "):
        TAKE.write(tmp_path / name if isinstance(name, str) else name, **options)
    assert not list(tmp_path.iterdir())


class Drops(io.RawIOBase):
    """A file that gives four bytes at a time, as a bad connection does."""

    left = 1_000_000_000

    def read(self, size: int = -1, /) -> bytes:
        self.left -= 4
        return b"abcd" if self.left >= 0 else b""


def test_a_file_in_drops_is_given_up_soon():
    drops = Drops()
    with pytest.raises(elocute.InputError, match="bytes a read or more"):
        elocute.animate(drops)
    assert drops.left > 999_000_000


def test_a_short_file_in_drops_is_read():
    class Slow(io.BytesIO):
        def read(self, size: int | None = -1, /) -> bytes:
            return super().read(min(size or 4, 4))

    packed = io.BytesIO()
    soundfile.write(packed, NOISE, 16000, format="WAV")
    whole = elocute.animate(packed.getvalue())
    assert np.array_equal(
        elocute.animate(Slow(packed.getvalue())).curves.values, whole.curves.values
    )


@pytest.mark.parametrize("number", [np.nan, np.inf])
@pytest.mark.parametrize("name", ["crnn", "voca"])
def test_a_model_of_broken_weights_is_named(name: str, number: float, tmp_path: Path):
    onnx = pytest.importorskip("onnx")
    from elocute.models import crnn_network, voca

    shipped = {"crnn": crnn_network.SHIPPED_PATH, "voca": voca.SHIPPED_PATH}[name]
    model = onnx.load(str(shipped))
    for tensor in model.graph.initializer:
        if tensor.data_type == onnx.TensorProto.FLOAT and len(tensor.dims) > 1:
            broken = np.full(tuple(tensor.dims), number, np.float32)
            tensor.CopyFrom(onnx.numpy_helper.from_array(broken, tensor.name))
    onnx.save(model, str(tmp_path / "broken.onnx"))
    with pytest.raises(elocute.InputError, match=r"broken\.onnx: .* NaN or infinity"):
        elocute.animate(NOISE, rate=16000, model=tmp_path / "broken.onnx")


@pytest.mark.parametrize("outputs", [b"0", b"1", b"99"])
def test_a_model_that_says_less_or_more_of_itself(tmp_path: Path, outputs: bytes):
    from elocute.models import crnn_network

    said = re.compile(rb'"outputs": ?\d+')
    whole = crnn_network.SHIPPED_PATH.read_bytes()
    found = said.findall(whole)[0]
    forged = b'"outputs":' + outputs.rjust(len(found) - 10)
    (tmp_path / "forged.onnx").write_bytes(whole.replace(found, forged))
    with pytest.raises(elocute.InputError, match=r"forged\.onnx"):
        elocute.animate(SILENCE, rate=16000, model=tmp_path / "forged.onnx")


@pytest.mark.parametrize("name", [None, b"a.npz", 5, ["a.npz"]])
def test_what_is_no_path(name: Any):
    for use in (
        lambda: elocute.load_motion(name),
        lambda: elocute.save_motion(TAKE.motion, name),
        lambda: elocute.read_audio(name),
    ):
        with pytest.raises(elocute.InputError, match=r"path: .*; allowed: the name of a file"):
            use()


def test_a_channel_that_is_none_and_a_closed_file(speech_wav: Path):
    with pytest.raises(elocute.InputError, match="no channel"):
        elocute.animate(speech_wav, channel=np.zeros(3))  # pyright: ignore[reportArgumentType]
    with speech_wav.open("rb") as file:
        pass
    with pytest.raises(elocute.InputError, match="closed file; allowed: an open binary file"):
        elocute.animate(file)


@pytest.mark.parametrize(
    ("size", "says"),
    [
        (1 << 20, "nothing but zeros at its start"),
        (1 << 29, "nothing but zeros at its start"),
        (1 << 40, "nearly all of it holes"),
    ],
)
def test_zeros_are_refused_however_many(tmp_path: Path, size: int, says: str):
    with (tmp_path / "a.mp3").open("wb") as file:
        file.truncate(size)  # takes no room on the disk
    with pytest.raises(elocute.InputError, match=says):
        elocute.read_audio(tmp_path / "a.mp3")


class Fails:
    """Whatever is asked of it fails."""

    def __repr__(self) -> str:
        raise RuntimeError("no repr")

    def __array__(self, *_: object, **__: object) -> Any:
        raise RuntimeError("no array")


class NumberPath:
    """A path object that stands for a number."""

    def __fspath__(self) -> Any:
        return 5


FAILS, NUMBER_PATH = Fails(), NumberPath()
ODD: dict[str, dict[str, Any]] = {
    "speech": {"speech": NUMBER_PATH, "rate": None},
    "head": {"head": NUMBER_PATH},
    "identity": {"identity": NUMBER_PATH},
    "style": {"style": NUMBER_PATH},
    "model": {"model": NUMBER_PATH},
    "array": {"speech": FAILS},
    "a head without a repr": {"head": FAILS},
    "a model without a repr": {"model": FAILS},
    "a style without a repr": {"style": FAILS},
    "a frame rate without a repr": {"fps": FAILS},
}


@pytest.mark.parametrize("name", ODD)
def test_objects_whose_own_methods_fail(name: str):
    given: dict[str, Any] = {"speech": SILENCE, "rate": 16000} | ODD[name]
    error = AudioError if "speech" in ODD[name] else elocute.InputError
    with pytest.raises(error, match="allowed: "):
        elocute.animate(**given)


@pytest.mark.parametrize("progress", [5, "x", [], np.zeros((2, 2)), FAILS])
def test_no_function_of_progress_is_told_before_any_work(progress: Any):
    with pytest.raises(elocute.InputError, match=r"progress: .*; allowed: a function or None"):
        elocute.animate("no such file.wav", progress=progress)


@pytest.mark.parametrize("name", ["sound", "motion"])
def test_an_animation_is_written_with_what_is_its_own(name: str, tmp_path: Path):
    with pytest.raises(OutputError, match=f"`{name}`: .*the animation's own"):
        TAKE.write(tmp_path / "a.glb", **{name: "y.wav"})
    assert not list(tmp_path.iterdir())
