"""Named regions of vertices with a hash, since published errors differ in whose lips they mean."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.corpus.topologies import Topology, published_indices
from elocute.errors import CorpusError
from elocute.files.array_reading import read_npy
from elocute.files.json_records import INTEGER_MAX_DIGITS, parse_json
from elocute.files.reading import read_bytes, read_text
from elocute.head.builtin import load_builtin_head
from elocute.head.model import HeadModel
from elocute.one_line_repr import one_line

FILE_MAX_BYTES = 16_000_000
HASH_DIGITS = 12
BUILTIN_REGIONS = ("lips", "upper_face", "eyes")
ALLOWED = "a list of vertex numbers: .json, .txt or .npy"


@dataclass(frozen=True, eq=False)
class VertexRegion:
    """A named set of vertices that a metric is computed over.

    Attributes
    ----------
    name : str
        With its origin: `builtin:…`, `published:…` or `file:…`.
    indices : (vertex,) int64
        Rising, each once.
    """

    name: str
    indices: NDArray[np.int64]

    __repr__ = one_line

    @property
    def digest(self) -> str:
        """The first 12 hexadecimal digits of the SHA-256 of the indices as little-endian int64."""
        return hashlib.sha256(self.indices.astype("<i8").tobytes()).hexdigest()[:HASH_DIGITS]

    def record(self) -> dict[str, Any]:
        """Name, number of vertices and hash, for reports."""
        return {"name": self.name, "vertices": len(self.indices), "sha256": self.digest}


def builtin_region(which: str) -> VertexRegion:
    """A region of the built-in head.

    Parameters
    ----------
    which : str
        `lips`: the skin of both lips up to the vermilion border; `upper_face`: the face from the
        lower edge of the eye areas upwards, with brows and lashes; `eyes`: the skin around both
        eyes, lids included.

    Returns
    -------
    VertexRegion
        Called `builtin:WHICH`.

    Raises
    ------
    CorpusError
        For another name.
    """
    if which not in BUILTIN_REGIONS:
        raise CorpusError.about(
            f"vertex list {which!r}", found="unknown", allowed=", ".join(BUILTIN_REGIONS)
        )
    return VertexRegion(f"builtin:{which}", _places(load_builtin_head(), which))


def published_region(topology: Topology, which: str) -> VertexRegion:
    """The region that published figures of a topology were computed over.

    Parameters
    ----------
    topology : Topology
        `FLAME` or `BIWI`.
    which : str
        `lips` or `upper_face`.

    Returns
    -------
    VertexRegion
        Called `published:…` after its source.

    Raises
    ------
    CorpusError
        For another name.
    """
    indices = published_indices(topology, which)
    return VertexRegion(f"published:{topology.published[which]}", indices)


def _places(head: HeadModel, which: str) -> NDArray[np.int64]:
    """Indices of a region of the built-in head."""
    eyes = np.union1d(head.regions["eye_area_left"], head.regions["eye_area_right"])
    if which == "eyes":
        return eyes.astype(np.int64)
    if which == "lips":
        return np.unique(head.regions["lips"]).astype(np.int64)
    face = head.regions["face"]
    above = face[head.template[face, 1] >= head.template[eyes, 1].min()]
    parts = (above, eyes, head.regions["brows"], head.regions["lashes"])
    return np.unique(np.concatenate(parts)).astype(np.int64)


def read_vertex_region(path: str | Path, vertex_count: int) -> VertexRegion:
    """Read a region from a file, FLAME's lips for example.

    Parameters
    ----------
    path : str or Path
        Vertex numbers from 0 in any order: a list in a .json, numbers with white space or commas
        between them in a .txt, or a one-dimensional array of integers in a .npy.
    vertex_count : int
        Vertices of the topology.

    Returns
    -------
    VertexRegion
        Called `file:NAME`.

    Raises
    ------
    CorpusError
        For anything else, an empty list, or numbers beyond the topology.
    """
    path = Path(path)
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise CorpusError.about(path, found=f"suffix {path.suffix!r}", allowed=ALLOWED)
    numbers = reader(path)
    _check(path, numbers, vertex_count)
    return VertexRegion(f"file:{path.name}", np.unique(numbers.astype(np.int64)))


def _check(path: Path, numbers: NDArray[Any], vertex_count: int) -> None:
    """Raise CorpusError for anything but a list of vertices of the topology."""
    if numbers.ndim != 1 or not len(numbers) or numbers.dtype.kind not in "iu":
        found = f"{numbers.dtype} of shape {numbers.shape}"
        raise CorpusError.about(path, found=found, allowed="one list of whole numbers")
    if numbers.min() < 0 or numbers.max() >= vertex_count:
        wrong = numbers.min() if numbers.min() < 0 else numbers.max()
        raise CorpusError.about(
            path, found=f"vertex {wrong}", allowed=f"0 to {vertex_count - 1}, this topology"
        )


def _from_json(path: Path) -> NDArray[Any]:
    """A JSON list of whole numbers."""
    data = read_bytes(path, max_bytes=FILE_MAX_BYTES, allowed=ALLOWED, error=CorpusError)
    numbers = parse_json(data, path, allowed=ALLOWED, error=CorpusError)
    if not isinstance(numbers, list) or not all(type(number) is int for number in numbers):
        raise CorpusError.about(path, found="no list of numbers", allowed=ALLOWED)
    return np.array(numbers, np.int64)


def _from_text(path: Path) -> NDArray[Any]:
    """Whole numbers with white space or commas between them."""
    text = read_text(path, max_bytes=FILE_MAX_BYTES, allowed=ALLOWED, error=CorpusError)
    words = text.replace(",", " ").split()
    for word in words:
        digits = word.removeprefix("-")
        if not digits.isascii() or not digits.isdigit() or len(digits) > INTEGER_MAX_DIGITS:
            raise CorpusError.about(path, found="no list of numbers", allowed=ALLOWED)
    return np.array([int(word) for word in words], np.int64)


def _from_npy(path: Path) -> NDArray[Any]:
    """An array of numbers."""
    return read_npy(path, max_bytes=FILE_MAX_BYTES, allowed=ALLOWED, error=CorpusError)


_READERS = {".json": _from_json, ".txt": _from_text, ".npy": _from_npy}
