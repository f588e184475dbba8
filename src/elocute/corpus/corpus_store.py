"""A corpus on disk: a folder that is read when it is needed, and from which nothing is run.

    corpus.json     who says what, where its frames are, the splits; no paths
    motion.npy      all frames of all clips, one after another: (frame, component) weights or
                    (frame, vertex, 3) m
    templates.npy   (subject, vertex, 3) m, the neutral faces
    basis.npy       (component, vertex, 3) m, with weights only
    faces.npy       (face, 3 or 4), where they are known
    sound/NAME.flac 16 bits

Arrays are uncompressed, and frames stay on disk until they are asked for: a random one takes
some hundredths of a millisecond, however long the corpus.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array
from elocute.audio.waveform import Waveform
from elocute.corpus.clip import Clip, check_name
from elocute.corpus.split import PARTS, ClipEntry, Split
from elocute.errors import CorpusError
from elocute.files.array_file import ArrayFile
from elocute.files.array_reading import read_npy
from elocute.files.json_records import finite_number, read_record
from elocute.files.reading import ANY_BYTES, FileKind, is_file, path_of
from elocute.motion.motion import FPS_MAX
from elocute.one_line_repr import one_line

FORMAT, VERSION = "elocute-corpus", 1
MANIFEST_FILE = FileKind("a corpus manifest", 256_000_000, CorpusError)
TEXT_MAX, COUNT_MAX = 10_000, 10**12
ALLOWED = "what CorpusWriter wrote"
ARRAY_FILE = FileKind(ALLOWED, 2_000_000_000, CorpusError)
"""Of templates, basis and faces, which are held in memory."""
MOTION_FILE = FileKind(ALLOWED, ANY_BYTES, CorpusError)


@dataclass(frozen=True, eq=False)
class Corpus:
    """A folder of clips; `open_corpus` makes one, and frames are read when they are asked for.

    Attributes
    ----------
    folder : Path
        Where it is.
    fps : float
        Frames per second.
    kind : str
        "weights" of `basis`, or "vertices".
    components : tuple of str
        Names of the weights, () for vertices.
    topology : str
        Name of the head whose mesh this is ("elocute" for the built-in one), or "".
    subjects : tuple of str
        In the order of `templates` and of a model's styles.
    entries : tuple of ClipEntry
        The clips.
    splits : dict of str to Split
        Splits by name.
    note : str
        Origin and licence, in words.
    """

    folder: Path
    fps: float
    kind: str
    components: tuple[str, ...]
    topology: str
    subjects: tuple[str, ...]
    entries: tuple[ClipEntry, ...]
    splits: dict[str, Split] = field(default_factory=dict)
    note: str = ""

    __repr__ = one_line

    @cached_property
    def motion(self) -> ArrayFile:
        """(frame, …) of all clips, on disk."""
        return ArrayFile(_there(self.folder / "motion.npy"), MOTION_FILE)

    @cached_property
    def templates(self) -> Float32Array:
        """(subject, vertex, 3) m."""
        return _in_memory(self.folder / "templates.npy")

    @cached_property
    def basis(self) -> Float32Array | None:
        """(component, vertex, 3) m, or None where frames are vertices."""
        return _in_memory(self.folder / "basis.npy") if self.kind == "weights" else None

    @cached_property
    def faces(self) -> NDArray[np.int32] | None:
        """(face, 3 or 4) corners, or None where they are unknown."""
        path = self.folder / "faces.npy"
        if not path.is_file():
            return None
        faces = read_npy(path, ARRAY_FILE)
        corners = faces.ndim == 2 and faces.shape[1] in (3, 4) and faces.dtype.kind in "iu"
        if not corners or (faces.size and not 0 <= faces.min() <= faces.max() < self.vertex_count):
            raise CorpusError.about(
                path,
                found=f"{faces.dtype} of shape {faces.shape}",
                allowed=f"(face, 3 or 4) vertices from 0 to {self.vertex_count - 1}",
            )
        return faces.astype(np.int32)

    @cached_property
    def by_name(self) -> dict[str, ClipEntry]:
        """Clips by name."""
        return {entry.name: entry for entry in self.entries}

    @property
    def vertex_count(self) -> int:
        """Vertices of the mesh."""
        return self.templates.shape[1]

    @property
    def frame_count(self) -> int:
        """Frames of all clips."""
        return sum(entry.frames for entry in self.entries)

    def entry(self, name: str) -> ClipEntry:
        """A clip as the manifest lists it.

        Parameters
        ----------
        name : str
            `SUBJECT.SENTENCE`.

        Returns
        -------
        ClipEntry
            The entry.

        Raises
        ------
        CorpusError
            For an unknown clip.
        """
        if name not in self.by_name:
            raise CorpusError.about(
                self.folder, found=f"no clip {name[:60]!r}", allowed=_some(list(self.by_name))
            )
        return self.by_name[name]

    def split(self, name: str = "default") -> Split:
        """A split.

        Parameters
        ----------
        name : str
            Its name.

        Returns
        -------
        Split
            Names of the clips of each part.

        Raises
        ------
        CorpusError
            For an unknown split.
        """
        if name not in self.splits:
            raise CorpusError.about(
                self.folder, found=f"no split {name[:60]!r}", allowed=_some(list(self.splits))
            )
        return self.splits[name]

    def template(self, subject: str) -> Float32Array:
        """The neutral face of a subject.

        Parameters
        ----------
        subject : str
            The subject.

        Returns
        -------
        (vertex, 3) float32
            Metres.

        Raises
        ------
        CorpusError
            For an unknown subject.
        """
        if subject not in self.subjects:
            raise CorpusError.about(
                self.folder,
                found=f"no subject {subject[:60]!r}",
                allowed=_some(list(self.subjects)),
            )
        return self.templates[self.subjects.index(subject)]

    def frames(self, name: str) -> ArrayFile:
        """The frames of a clip, on disk.

        Parameters
        ----------
        name : str
            The clip.

        Returns
        -------
        ArrayFile (frame, component) or (frame, vertex, 3)
            Weights, or vertices in m; nothing is read yet.

        Raises
        ------
        CorpusError
            For an unknown clip.
        """
        entry = self.entry(name)
        return self.motion.part(entry.start, entry.start + entry.frames)

    def displacements(self, name: str, start: int = 0, stop: int | None = None) -> Float32Array:
        """Displacements of a clip from its subject's template.

        Parameters
        ----------
        name : str
            The clip.
        start, stop : int
            Frames, as in a slice; all by default.

        Returns
        -------
        (frame, vertex, 3) float32
            Metres.

        Raises
        ------
        CorpusError
            For an unknown clip.
        """
        frames = self.frames(name)[start:stop]
        if self.basis is None:
            return frames - self.template(self.entry(name).subject)
        flat = frames @ self.basis.reshape(len(self.basis), -1)
        return flat.reshape(len(frames), -1, 3)

    def vertices(self, name: str, start: int = 0, stop: int | None = None) -> Float32Array:
        """Vertices of a clip.

        Parameters
        ----------
        name : str
            The clip.
        start, stop : int
            Frames, as in a slice; all by default.

        Returns
        -------
        (frame, vertex, 3) float32
            Metres.

        Raises
        ------
        CorpusError
            For an unknown clip.
        """
        if self.basis is None:
            return self.frames(name)[start:stop]
        return self.displacements(name, start, stop) + self.template(self.entry(name).subject)

    def sound_path(self, name: str) -> Path:
        """The file of a clip's sound, made from the clip's name and never read from the manifest.

        Parameters
        ----------
        name : str
            The clip.

        Returns
        -------
        Path
            It may be missing.

        Raises
        ------
        CorpusError
            For an unknown clip.
        """
        return self.folder / "sound" / f"{self.entry(name).name}.flac"

    def sound(self, name: str) -> Waveform:
        """Read the sound of a clip.

        Parameters
        ----------
        name : str
            The clip.

        Returns
        -------
        Waveform
            The sound.

        Raises
        ------
        CorpusError
            For an unknown clip.
        AudioError
            For a file that is missing or damaged.
        """
        from elocute.audio.read import read_audio

        return read_audio(self.sound_path(name))

    def clip(self, name: str) -> Clip:
        """Read a clip into memory.

        Parameters
        ----------
        name : str
            The clip.

        Returns
        -------
        Clip
            Sound and frames.

        Raises
        ------
        CorpusError
            For an unknown clip, or frames that are cut short.
        AudioError
            For a sound that is missing or damaged.
        """
        entry = self.entry(name)
        return Clip(
            entry.subject,
            entry.sentence,
            entry.text,
            self.sound(name),
            np.array(self.frames(name)),
        )


def open_corpus(folder: str | Path) -> Corpus:
    """Read the manifest of a corpus and check that the arrays fit it; frames stay on disk.

    Parameters
    ----------
    folder : str or Path
        A folder that `corpus_writer` wrote.

    Returns
    -------
    Corpus
        The corpus.

    Raises
    ------
    CorpusError
        With what is wrong and where.
    """
    folder = path_of(folder, CorpusError)
    corpus = _corpus_of(folder, _read_manifest(folder))
    _check_arrays(corpus)
    return corpus


def write_manifest(corpus: Corpus) -> None:
    """Write corpus.json into a corpus's folder, indented for people.

    Raises OSError where it cannot be written.
    """
    record = {
        "format": FORMAT,
        "version": VERSION,
        "fps": corpus.fps,
        "kind": corpus.kind,
        "components": corpus.components,
        "topology": corpus.topology,
        "subjects": corpus.subjects,
        "note": corpus.note,
        "clips": [
            {k: v for k, v in asdict(entry).items() if k != "name"} for entry in corpus.entries
        ],
        "splits": {name: split.parts() for name, split in corpus.splits.items()},
    }
    text = json.dumps(record, indent=1)
    (corpus.folder / "corpus.json").write_text(text + "\n", encoding="utf-8")


def _read_manifest(folder: Path) -> dict[str, Any]:
    """The manifest of a folder, once its format and version are known to be ours."""
    path = folder / "corpus.json"
    if not is_file(path):
        raise CorpusError.about(
            folder,
            found="no corpus.json in it",
            allowed="a corpus folder",
            remedy="make one: elocute corpus convert",
        )
    record = read_record(path, MANIFEST_FILE)
    if record.get("format") != FORMAT:
        raise CorpusError.about(path, found="another kind of JSON", allowed=f"format {FORMAT}")
    if record.get("version") != VERSION:
        raise CorpusError.about(
            path, found=f"version {str(record.get('version'))[:40]}", allowed=f"version {VERSION}"
        )
    return record


def _corpus_of(folder: Path, record: dict[str, Any]) -> Corpus:
    """A Corpus of its manifest, all fields checked."""
    try:
        clips, fps = _list_of(record["clips"], dict), finite_number(record["fps"])
        corpus = Corpus(
            folder,
            0.0 if fps is None else fps,
            _text(record["kind"]),
            tuple(map(_text, _list_of(record["components"], str))),
            _text(record["topology"]),
            tuple(check_name(_text(s), "subject") for s in record["subjects"]),
            tuple(map(_entry, clips)),
            {
                _text(name): Split(*(tuple(_list_of(parts[p], str)) for p in PARTS))
                for name, parts in record["splits"].items()
            },
            _text(record["note"]),
        )
    except CorpusError as error:
        raise CorpusError(f"{folder / 'corpus.json'}: {error}") from error
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise CorpusError.about(
            folder / "corpus.json",
            allowed=ALLOWED,
            found=f"a field that is missing or wrong ({str(error)[:80]})",
        ) from error
    _check_lists(corpus)
    return corpus


def _entry(clip: dict[str, Any]) -> ClipEntry:
    """One clip of a manifest."""
    subject = check_name(_text(clip["subject"]), "subject")
    sentence = check_name(_text(clip["sentence"]), "sentence")
    start, frames = clip["start"], clip["frames"]
    if type(start) is not int or type(frames) is not int or max(start, frames) > COUNT_MAX:
        raise ValueError("start and frames that are no whole numbers")
    return ClipEntry(f"{subject}.{sentence}", subject, sentence, _text(clip["text"]), start, frames)


def _text(value: Any) -> str:
    """A text of the manifest; raises TypeError for anything else."""
    if not isinstance(value, str) or len(value) > TEXT_MAX:
        raise TypeError(f"found a {type(value).__name__}, no text of up to {TEXT_MAX} characters")
    return value


def _list_of(values: Any, kind: type) -> list[Any]:
    """A list of one kind of value; raises TypeError for anything else."""
    if not isinstance(values, list) or not all(isinstance(value, kind) for value in values):
        raise TypeError(f"no list of {kind.__name__}")
    return values


def _check_lists(corpus: Corpus) -> None:
    """Raise CorpusError where clips, subjects and splits of a manifest contradict one another."""

    def refuse(found: str, allowed: str) -> None:
        raise CorpusError.about(corpus.folder / "corpus.json", found=found, allowed=allowed)

    if corpus.kind not in ("weights", "vertices"):
        refuse(f"kind {corpus.kind[:60]!r}", "weights, vertices")
    if not 0 < corpus.fps <= FPS_MAX:
        refuse(f"fps {corpus.fps}", f"above 0, at most {FPS_MAX:g}")
    if not corpus.entries:
        refuse("no clip", "one clip or more")
    if len(corpus.by_name) != len(corpus.entries):
        refuse("a subject that says one sentence twice", "names SUBJECT.SENTENCE that differ")
    subjects = set(corpus.subjects)
    if len(subjects) != len(corpus.subjects):
        refuse("a subject twice", "each subject once")
    for entry in corpus.entries:
        if entry.subject not in subjects:
            refuse(f"clip {entry.name} of an unlisted subject", _some(list(corpus.subjects)))
        if entry.start < 0 or entry.frames < 1:
            refuse(f"clip {entry.name} at {entry.start}, {entry.frames} frames", "0, 1 or more")
    for name, split in corpus.splits.items():
        listed = [clip for part in split.parts().values() for clip in part]
        strange = sorted(set(listed) - set(corpus.by_name))
        if strange:
            refuse(f"split {name[:60]} names a clip {strange[0][:60]!r}", "clips of this corpus")
        if len(set(listed)) != len(listed):
            refuse(f"split {name[:60]} names a clip twice", "each clip in one part")


def _check_arrays(corpus: Corpus) -> None:
    """Raise CorpusError where arrays and manifest do not fit."""
    motion, templates = corpus.motion, corpus.templates
    vertex = templates.shape[1] if templates.ndim == 3 else 0
    expected = (len(corpus.subjects), vertex, 3)
    wanted: list[tuple[str, tuple[int, ...], tuple[int, ...]]] = [
        ("templates.npy", templates.shape, expected)
    ]
    last = max(entry.start + entry.frames for entry in corpus.entries)
    total = max(last, len(motion))
    if corpus.basis is None:
        wanted.append(("motion.npy", motion.shape, (total, vertex, 3)))
    else:
        wanted.append(("motion.npy", motion.shape, (total, len(corpus.components))))
        wanted.append(("basis.npy", corpus.basis.shape, (len(corpus.components), vertex, 3)))
    if corpus.motion.dtype.kind != "f":
        raise CorpusError.about(
            corpus.folder / "motion.npy", found=str(corpus.motion.dtype), allowed="fractions"
        )
    for name, found, allowed in wanted:
        if found != allowed:
            raise CorpusError.about(
                corpus.folder / name, found=f"shape {found}", allowed=str(allowed)
            )


def _there(path: Path) -> Path:
    """A file of the corpus; raises CorpusError where it is missing."""
    if not path.is_file():
        raise CorpusError.about(
            path.parent, found=f"no {path.name} in it", allowed="a whole corpus"
        )
    return path


def _in_memory(path: Path) -> Float32Array:
    """An array of lengths, read whole."""
    array = read_npy(_there(path), ARRAY_FILE)
    if array.dtype.kind != "f":
        raise CorpusError.about(path, found=str(array.dtype), allowed="metres")
    return array


def _some(names: list[str]) -> str:
    """The first names of many, for messages."""
    return ", ".join(names[:20]) + (f" and {len(names) - 20} more" if len(names) > 20 else "")
