"""Commands as readers: how a bad file leaves the command line.

A command that is given a bad file ends with 2, one line on the standard error stream and nothing
half-done, or with 1 where some of many failed; anything else is raised here, and so is an escape.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from unittest import mock

from elocute.errors import InputError
from tests.fuzz.fuzzing import readers, seeds
from tests.fuzz.fuzzing.cases import Reader

_KINDS = {
    "*.json": "json",
    "*.npz": "npz",
    "*.npy": "npy",
    "*.csv": "text",
    "*.TextGrid": "text",
    "*.ply": "ply",
    "*.obj": "text",
    "*.pkl": "pickle",
    "*.wav": "riff",
    "text": "text",
    "*.vl": "vl",
    "*.txt": "text",
    "*.f??": "bytes",
    "*.m??": "bytes",
}


class BadLeavingError(Exception):
    """A command ended otherwise than commands do."""


def run_command(arguments: Sequence[str]) -> None:
    """Run `elocute` in this process. InputError where it refused as it should, with its line."""
    from elocute.cli import main

    with _Caught() as caught, mock.patch.object(sys, "argv", ["elocute", *arguments]):
        code: object = None
        try:
            main()
        except SystemExit as left:
            code = left.code
        sys.stderr.flush()
        lines = caught.lines()
    strange = [line for line in lines if not line.startswith("elocute: ")]
    if code not in (0, None, 1, 2) or strange or (code == 2 and len(lines) != 1):
        raise BadLeavingError(f"exit {code}: {' | '.join(lines)[:400]}")
    if code == 2:
        raise InputError(lines[0])


class _Caught(contextlib.ExitStack):
    """Both streams of the process, those of C included, into files while the block lasts."""

    def __enter__(self) -> _Caught:
        super().__enter__()
        files = tempfile.TemporaryFile(), tempfile.TemporaryFile()
        self._files = [self.enter_context(file) for file in files]
        for number, name in ((1, "stdout"), (2, "stderr")):
            kept = os.dup(number)
            self.callback(os.close, kept)
            self.callback(os.dup2, kept, number)
            os.dup2(self._files[number - 1].fileno(), number)
            stream = self.enter_context(os.fdopen(os.dup(number), "w", errors="backslashreplace"))
            self.enter_context(mock.patch.object(sys, name, stream))
        return self

    def lines(self) -> list[str]:
        """What came on the error stream."""
        self._files[1].seek(0)
        return self._files[1].read().decode("utf-8", "replace").strip().splitlines()


def command(*words: str) -> Callable[[Path, Path], object]:
    """In words, {NAME} is a file of the seed, {*.npz} the one of that pattern, {out} the folder
    for outputs, {folder} the seed's own folder and <text> what its file `text` holds."""

    def read(folder: Path, out: Path) -> None:
        run_command([_filled(word, folder, out) for word in words])

    return read


def _filled(word: str, folder: Path, out: Path) -> str:
    if word == "<text>":
        data = (folder / "text").read_bytes().replace(b"\0", b"")
        return data.decode("utf-8", "surrogateescape")
    if word.startswith("{out}"):
        return str(out) + word.removeprefix("{out}")
    if word.startswith("{folder}"):
        return str(folder) + word.removeprefix("{folder}")
    if word.startswith("{"):
        return str(next(iter(sorted(folder.glob(word[1:-1])))))
    return word


def with_sound(write: Callable[[Path], None]) -> Callable[[Path], None]:
    """Seeds of a reader, each with a sound beside it that stays as it is."""

    def written(folder: Path) -> None:
        write(folder)
        for inner in folder.iterdir():
            seeds.write_wav(inner / "good.wav", 1.5)
            (inner / "good.wav").rename(inner / "good.sound")

    return written


def with_file(name: str, write: Callable[[Path], None]) -> Callable[[Path], None]:
    """The seeds of a reader that hold a file of this name."""

    def written(folder: Path) -> None:
        write(folder)
        for inner in list(folder.iterdir()):
            if not (inner / name).exists():
                shutil.rmtree(inner)

    return written


def vertex_files(folder: Path) -> None:
    """What `solve` takes, on the small head."""
    import numpy as np

    from elocute.head.store import save_head

    inner = seeds.place(folder, "one")
    motion = seeds.small_motion(turning=False)
    np.save(inner / "talk.npy", motion.vertices())
    save_head(inner / "head.npz", motion.head)


def commands_of(name: str, write: Callable[[Path], None], *words: str, **more) -> Reader:
    modules = (*_MODULES, *more.pop("modules", ()))
    kinds = more.pop("kinds", _KINDS)
    return Reader(f"$ {name}", write, command(*words), kinds, modules, short=8, **more)


_MODULES = (
    "elocute.cli",
    "elocute.audio.read",
    "elocute.motion.store",
    "elocute.motion.mouth_measures",
    "elocute.export.registry",
    "elocute.export.gltf",
    "elocute.head.registry",
    "elocute.corpus.corpus_checks",
    "elocute.corpus.importers.registry",
)
_ANIMATE = ("elocute.animation", "elocute.audio.read")

COMMANDS: tuple[Reader, ...] = (
    commands_of("info motion", seeds.motions, "info", "{talk.npz}"),
    commands_of("info sound", seeds.wavs, "info", "{talk.wav}"),
    commands_of(
        "convert", seeds.motions, "convert", "{talk.npz}", "--to", "arkit", "-o", "{out}/a.json"
    ),
    commands_of("measure", seeds.motions, "measure", "{talk.npz}", "-o", "{out}/a.csv"),
    commands_of("render", seeds.motions, "render", "{talk.npz}", "-o", "{out}/a.glb"),
    commands_of("edit", seeds.motions, "edit", "{talk.npz}", "-o", "{out}/a.npz"),
    commands_of(
        "solve",
        vertex_files,
        "solve",
        "{talk.npy}",
        "--head",
        "{head.npz}",
        "-o",
        "{out}/a.npz",
        needs=("scipy",),
    ),
    commands_of(
        "animate", seeds.wavs, "animate", "{talk.wav}", "-o", "{out}/a.npz", modules=_ANIMATE
    ),
    commands_of(
        "animate mp4",
        seeds.mp4s,
        "animate",
        "{talk.m*}",
        "-o",
        "{out}/a.npz",
        modules=_ANIMATE,
        kinds={"*": "bytes"},
    ),
    commands_of(
        "animate --identity",
        with_sound(seeds.identities),
        "animate",
        "{good.sound}",
        "--identity",
        "{face.json}",
        "-o",
        "{out}/a.npz",
        modules=_ANIMATE,
    ),
    commands_of(
        "animate --style",
        with_sound(seeds.styles),
        "animate",
        "{good.sound}",
        "--style",
        "{style.json}",
        "-o",
        "{out}/a.npz",
        modules=_ANIMATE,
    ),
    commands_of(
        "animate --phones",
        with_sound(with_file("phones.csv", seeds.phones)),
        "animate",
        "{good.sound}",
        "--phones",
        "{phones.csv}",
        "-o",
        "{out}/a.npz",
        modules=_ANIMATE,
    ),
    commands_of(
        "head sample --size",
        seeds.options("size"),
        "head",
        "sample",
        "--count",
        "1",
        "--size",
        "<text>",
        "-o",
        "{out}/a.png",
    ),
    commands_of("head show", seeds.heads, "head", "show", "{head.npz}"),
    commands_of("head show flame", seeds.flame, "head", "show", "{model.pkl}", needs=("scipy",)),
    commands_of("head show mesh", seeds.meshes, "head", "show", "{mesh.*}"),
    commands_of("words take", seeds.words, "words", "take", "{words.*}", "-o", "{out}/a.json"),
    commands_of(
        "words check",
        with_sound(seeds.words),
        "words",
        "check",
        "{words.*}",
        "{good.sound}",
        "-o",
        "{out}/a.html",
    ),
    commands_of("corpus info", seeds.corpora, "corpus", "info", "{folder}"),
    commands_of("corpus check", seeds.corpora, "corpus", "check", "{folder}"),
    commands_of(
        "corpus convert biwi", seeds.biwi, "corpus", "convert", "{folder}", "-o", "{out}/corpus"
    ),
    commands_of(
        "corpus convert folder",
        seeds.folder_corpus,
        "corpus",
        "convert",
        "{folder}",
        "-o",
        "{out}/corpus",
        needs=("scipy",),
    ),
    commands_of(
        "corpus convert grid", seeds.tracks, "corpus", "convert", "{folder}", "-o", "{out}/corpus"
    ),
    commands_of(
        "blendshapes learn",
        seeds.corpora,
        "blendshapes",
        "learn",
        "{folder}",
        "-o",
        "{out}/a.npz",
        "--components",
        "2",
        needs=("scipy",),
    ),
    commands_of(
        "capture scans",
        seeds.capture_folders,
        "capture",
        "scans",
        "{folder}",
        "-o",
        "{out}/work",
        needs=("scipy",),
    ),
)

assert not {reader.name for reader in COMMANDS} & {reader.name for reader in readers.READERS}
