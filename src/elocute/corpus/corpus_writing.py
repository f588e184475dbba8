"""Writing a corpus clip by clip, with one clip in memory."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.audio.write import write_flac
from elocute.corpus.clip import Clip, check_name
from elocute.corpus.corpus_store import Corpus, open_corpus, write_manifest
from elocute.corpus.split import ClipEntry, Split
from elocute.errors import CorpusError
from elocute.files.array_writing import RowWriter, save_npy
from elocute.files.atomic import write_folder_atomically

BLOCK_FRAMES = 120  # in memory at once of a clip that lies on disk
FLAC_MAX_HZ = 655_350


class CorpusWriter:
    """Writes clips into a new folder; `corpus_writer` makes one and moves the folder into place.

    Parameters
    ----------
    folder : Path
        An empty folder.
    templates, fps, basis, components, faces, topology, note
        As for `corpus_writer`.

    Attributes
    ----------
    entries : list of ClipEntry
        Clips that were written.
    splits : dict of str to Split
        Splits to be written; to be filled by the caller.
    """

    def __init__(
        self,
        folder: Path,
        templates: dict[str, NDArray[np.float32]],
        *,
        fps: float,
        basis: NDArray[np.float32] | None = None,
        components: tuple[str, ...] = (),
        faces: NDArray[np.integer] | None = None,
        topology: str = "",
        note: str = "",
    ) -> None:
        for subject in templates:
            check_name(subject, "subject")
        self._corpus = Corpus(
            folder,
            fps,
            "vertices" if basis is None else "weights",
            components,
            topology,
            tuple(templates),
            (),
            {},
            note,
        )
        self.entries: list[ClipEntry] = []
        self.splits: dict[str, Split] = {}
        stacked = np.stack(list(templates.values())).astype(np.float32)
        self._shape = stacked.shape[1:] if basis is None else (len(basis),)
        (folder / "sound").mkdir()
        save_npy(folder / "templates.npy", stacked)
        if basis is not None:
            save_npy(folder / "basis.npy", basis.astype(np.float32))
        if faces is not None:
            save_npy(folder / "faces.npy", faces.astype(np.int32))
        self._rows = RowWriter(folder / "motion.npy", self._shape)
        self._names: set[str] = set()

    def add(self, clip: Clip) -> None:
        """Append one clip.

        Parameters
        ----------
        clip : Clip
            Its frames must fit the corpus's basis or topology.

        Raises
        ------
        CorpusError
            For a clip of another shape, an unknown subject, a name that is there already, or a
            sample rate beyond what FLAC holds.
        """
        self._check(clip)
        path = self._corpus.folder / "sound" / f"{clip.name}.flac"
        write_flac(path, clip.sound.samples, clip.sound.sample_rate)
        start = self._rows.count
        for block in range(0, len(clip.frames), BLOCK_FRAMES):
            self._rows.add(clip.frames[block : block + BLOCK_FRAMES])
        self._names.add(clip.name)
        self.entries.append(
            ClipEntry(clip.name, clip.subject, clip.sentence, clip.text, start, len(clip.frames))
        )

    def _check(self, clip: Clip) -> None:
        """Raise CorpusError for a clip that does not fit the corpus."""
        if clip.frames.shape[1:] != self._shape:
            raise CorpusError.about(
                f"clip {clip.name}",
                found=f"frames of shape {clip.frames.shape[1:]}",
                allowed=str(self._shape),
            )
        if clip.subject not in self._corpus.subjects:
            raise CorpusError.about(
                f"clip {clip.name}",
                found="a subject without template",
                allowed=", ".join(self._corpus.subjects),
            )
        if clip.name in self._names:
            raise CorpusError.about(f"clip {clip.name}", found="there already")
        if clip.sound.sample_rate > FLAC_MAX_HZ:
            raise CorpusError.about(
                f"clip {clip.name}",
                found=f"sound at {clip.sound.sample_rate} Hz",
                allowed=f"up to {FLAC_MAX_HZ} Hz, as much as FLAC holds",
            )

    def close(self) -> None:
        """Write the header of the frames, and the manifest."""
        self._rows.close()
        write_manifest(replace(self._corpus, entries=tuple(self.entries), splits=self.splits))


@contextlib.contextmanager
def corpus_writer(
    folder: str | Path,
    templates: dict[str, NDArray[np.float32]],
    *,
    fps: float,
    basis: NDArray[np.float32] | None = None,
    components: tuple[str, ...] = (),
    faces: NDArray[np.integer] | None = None,
    topology: str = "",
    note: str = "",
) -> Iterator[CorpusWriter]:
    """Write a corpus whose folder appears under its name only when the block ends without error.

    Parameters
    ----------
    folder : str or Path
        A new folder.
    templates : dict of str to (vertex, 3) float32
        The neutral face of each subject, m.
    fps : float
        Frames per second.
    basis : (component, vertex, 3) float32, optional
        What the weights of clips move, m; without it clips hold vertices.
    components : tuple of str
        Names of the weights.
    faces : (face, 3 or 4) int, optional
        Corners of triangles or quads.
    topology : str
        Name of the mesh: "elocute", "flame", "biwi", or "".
    note : str
        Origin and licence, in words.

    Yields
    ------
    CorpusWriter
        Takes the clips.

    Raises
    ------
    OutputError
        For a place that cannot be written, or a folder that exists.
    CorpusError
        For an empty corpus.
    """
    with write_folder_atomically(folder) as draft:
        writer = CorpusWriter(
            draft,
            templates,
            fps=fps,
            basis=basis,
            components=components,
            faces=faces,
            topology=topology,
            note=note,
        )
        try:
            yield writer
        except BaseException:
            with contextlib.suppress(OSError):
                writer.close()
            raise
        writer.close()
        open_corpus(draft)  # refuse to leave behind what could not be read again
