"""The BIWI 3D audiovisual corpus B3D(AC)² (Fanelli et al. 2010) as it is distributed.

    faces/SUBJECT/SENTENCE/frame_NNN.vl  int32 vertex count, then float32 x y z of each vertex,
                                         little-endian; global rotation and shift removed; 25 fps
    rigid_scans/SUBJECT.obj              the neutral face, same topology (23370 vertices)
    audio/SUBJECT_SENTENCE_cut.wav       or SUBJECT_SENTENCE.wav, or SUBJECT/SENTENCE.wav; or
                                         below wav/

`faces` and `rigid_scans` may be left out: subjects then lie in the folder itself, each with its
SUBJECT.obj or neutral.obj or neutral.vl.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array
from elocute.audio.read import read_audio
from elocute.corpus.clip import Clip
from elocute.corpus.corpus_writing import corpus_writer
from elocute.corpus.importers.frame_gaps import filled, frame_rows
from elocute.corpus.importers.import_report import Progress, SkippedClips, require_clips
from elocute.corpus.importers.split_choice import choose_splits
from elocute.corpus.length_units import metres_per_unit
from elocute.corpus.topologies import topology_of
from elocute.errors import AudioError, CorpusError
from elocute.files.reading import FileKind, bytes_text, read_bytes
from elocute.meshes.mesh_file import read_mesh_file

FPS = 25.0
NOTE = "B3D(AC)2 (Fanelli et al. 2010), under the licence of its authors; not to be passed on."
FILE_MAX_BYTES = 64_000_000
SOUND_FOLDERS = ("audio", "wav", ".", "faces")
SOUND_NAMES = (
    "{subject}_{sentence}_cut.wav",
    "{subject}_{sentence}.wav",
    "{subject}/{sentence}.wav",
    "{subject}/{sentence}/{sentence}.wav",
)
"""As distributed (`_cut` is trimmed to the motion), and as people sort them."""


def convert_biwi(
    source: Path,
    output: Path,
    *,
    leave_out: frozenset[str] = frozenset(),
    units: str | None = None,
    split: str | None = None,
    progress: Progress = None,
) -> list[str]:
    """Convert B3D(AC)² into a corpus, as `registry.convert` does; a line for each assumption.

    The scanner's meshes face the front with y down: where the neutral mesh looks along -Z, all is
    turned by half a turn about x. Raises InputError for missing files and another topology; nothing
    is written then.
    """
    folders = list(_sentences(source))
    if not folders:
        raise CorpusError.about(
            source, found="no SUBJECT/SENTENCE/frame_NNN.vl", allowed="the folders of B3D(AC)2"
        )
    notes, skipped = list[str](), SkippedClips()
    meshes = _neutral_faces(source, list(dict.fromkeys(f.parent.name for f in folders)), notes)
    first, faces = next(iter(meshes.values()))
    scale = metres_per_unit(first, notes, units)
    turn = (_turn(first, faces, notes) * scale).astype(np.float32)
    templates: dict[str, Float32Array] = {name: mesh * turn for name, (mesh, _) in meshes.items()}
    known = topology_of(len(first))
    with corpus_writer(
        output, templates, fps=FPS, faces=faces, topology=known.name if known else "", note=NOTE
    ) as writer:
        for done, folder in enumerate(folders, 1):
            if progress:
                progress(done / len(folders))
            subject, sentence = folder.parent.name, folder.name
            if subject not in meshes or {subject, f"{subject}.{sentence}"} & leave_out:
                continue
            sound = _sound(source, subject, sentence)
            if sound is None:
                skipped.add("no sound", f"{subject} {sentence}")
                continue
            try:
                heard = read_audio(sound)
                frames = _frames(folder, len(first), heard.duration_s, notes)
                writer.add(Clip(subject, sentence, "", heard, frames * turn))
            except (AudioError, _BrokenFrameError) as error:
                skipped.add(str(error), f"{subject} {sentence}")
        require_clips(writer, source, skipped.notes(), _names_looked_for(source))
        numbers = {entry.name: entry.sentence for entry in writer.entries}
        writer.splits |= choose_splits(writer.entries, numbers, split, notes)
    return [*notes, *skipped.notes()]


class _BrokenFrameError(CorpusError):
    """A frame that is cut short: its sentence is skipped. Another topology is another error."""


def read_vl(path: Path) -> Float32Array:
    """Read the vertices of one frame.

    Parameters
    ----------
    path : Path
        A `.vl`, as the module describes it.

    Returns
    -------
    (vertex, 3) float32
        In the file's unit.

    Raises
    ------
    CorpusError
        For a file of another size than its number of vertices needs.
    """
    data = read_bytes(path, FileKind("a .vl of vertices", FILE_MAX_BYTES, _BrokenFrameError))
    count = int.from_bytes(data[:4], "little", signed=True) if len(data) >= 4 else -1
    if count < 1 or len(data) != 4 + 12 * count:
        raise _BrokenFrameError.about(
            path,
            found=bytes_text(len(data)),
            allowed=f"{4 + 12 * count} for {count} vertices" if count > 0 else "a .vl of vertices",
        )
    return np.frombuffer(data, "<f4", offset=4).reshape(count, 3).astype(np.float32)


def read_neutral_obj(path: Path) -> tuple[Float32Array, NDArray[np.int32]]:
    """Read a neutral face.

    Parameters
    ----------
    path : Path
        An `.obj` of triangles and quads.

    Returns
    -------
    vertices : (vertex, 3) float32
        In the file's unit.
    faces : (face, 4) int32
        Corners; triangles repeat their last one.

    Raises
    ------
    CorpusError
        For a file that is not a mesh.
    """
    mesh = read_mesh_file(path, max_bytes=FILE_MAX_BYTES, error=CorpusError, cloud=True)
    points = mesh.vertices.astype(np.float32)
    if not np.isfinite(points).all():
        raise CorpusError.about(path, found="NaN or infinity", allowed="a finite mesh")
    return points, mesh.quads().astype(np.int32)


def _root(source: Path) -> Path:
    """The folder of the subjects."""
    return source / "faces" if (source / "faces").is_dir() else source


def _sentences(source: Path) -> Iterator[Path]:
    """Folders SUBJECT/SENTENCE that hold .vl files, sorted."""
    for folder in sorted(_root(source).glob("*/*")):
        if folder.is_dir() and _has_vl(folder):
            yield folder


def _has_vl(folder: Path) -> bool:
    """Whether a folder holds frames."""
    with os.scandir(folder) as entries:
        return any(entry.name.endswith(".vl") and entry.name[0] != "." for entry in entries)


def _neutral_faces(
    source: Path, subjects: list[str], notes: list[str]
) -> dict[str, tuple[Float32Array, NDArray[np.int32] | None]]:
    """Vertices and faces of those subjects that have a neutral mesh, all of one topology."""
    meshes = {}
    for name in subjects:
        mesh = _neutral(source, name)
        if mesh is None:
            notes.append(f"{name}: no neutral .obj or .vl")
        else:
            meshes[name] = mesh
    if not meshes:
        raise CorpusError.about(source, found="no neutral face", allowed="rigid_scans/SUBJECT.obj")
    count = len(next(iter(meshes.values()))[0])
    for name, (template, _) in meshes.items():
        if len(template) != count:
            raise _topology(source / name, len(template), count)
    return meshes


def _neutral(source: Path, subject: str) -> tuple[Float32Array, NDArray[np.int32] | None] | None:
    """Vertices and faces of a subject's neutral mesh, or None where there is none."""
    inside = _root(source) / subject
    for path in (
        source / "rigid_scans" / f"{subject}.obj",
        source / f"{subject}.obj",
        inside / f"{subject}.obj",
        inside / "neutral.obj",
    ):
        if path.is_file():
            vertices, faces = read_neutral_obj(path)
            return vertices, faces if len(faces) else None
    path = inside / "neutral.vl"
    return (read_vl(path), None) if path.is_file() else None


def _turn(
    vertices: Float32Array, faces: NDArray[np.int32] | None, notes: list[str]
) -> Float32Array:
    """(3,) signs: half a turn about x where the open front of the mesh looks along -Z."""
    if faces is None:
        notes.append("orientation: unknown without faces, left as it is")
        return np.ones(3, np.float32)
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    if np.cross(b - a, c - a)[:, 2].sum() >= 0:
        return np.ones(3, np.float32)
    notes.append("orientation: faces look along -Z; turned by half a turn about x")
    return np.array([1, -1, -1], np.float32)


def _sound(source: Path, subject: str, sentence: str) -> Path | None:
    """The sound of a sentence, or None where there is none."""
    names = [name.format(subject=subject, sentence=sentence) for name in SOUND_NAMES]
    for folder in SOUND_FOLDERS:
        for name in names:
            if (source / folder / name).is_file():
                return source / folder / name
    return None


def _names_looked_for(source: Path) -> str:
    """What sounds should be called, and what those that are there are called."""
    there = [path for folder in SOUND_FOLDERS for path in sorted((source / folder).glob("*.wav"))]
    names = ", ".join(n.format(subject="SUBJECT", sentence="SENTENCE") for n in SOUND_NAMES)
    seen = f"; there is {there[0].name}" if there else "; there are no .wav"
    return f"name sounds {names} in audio/ or wav/{seen}"


def _frames(folder: Path, count: int, sound_s: float, notes: list[str]) -> Float32Array:
    """(frame, vertex, 3) of one sentence, short gaps filled.

    Raises _BrokenFrameError for broken frames and long gaps, CorpusError for other topologies.
    """
    # What begins with a point is left by a Mac beside each file.
    paths = [path for path in folder.glob("*.vl") if path.name[0] != "."]
    paths.sort(key=lambda path: (_number(path), path.name))
    frames = np.empty((len(paths), count, 3), np.float32)
    for row, path in zip(frames, paths, strict=True):
        vertices = read_vl(path)
        if len(vertices) != count:
            raise _topology(path, len(vertices), count)
        if not np.isfinite(vertices).all():
            raise _BrokenFrameError.about(path, found="NaN or infinity", allowed="finite numbers")
        row[:] = vertices
    try:
        numbers = [_number(path) for path in paths]
        rows, note = frame_rows(numbers, 1, FPS, sound_s)
    except CorpusError as error:
        raise _BrokenFrameError(str(error)) from None
    if note:
        notes.append(f"{folder.parent.name} {folder.name}: {note}")
    return filled(frames, rows)


def _number(path: Path) -> int:
    """The number of a frame in its file's name."""
    digits = re.findall(r"[0-9]+", path.stem)
    return int(digits[-1][-9:]) if digits else 0


def _topology(path: Path, count: int, expected: int) -> CorpusError:
    """The error for another number of vertices."""
    return CorpusError.about(
        path, found=f"{count} vertices", allowed=f"{expected}, as the neutral face has"
    )
