"""Meshes that published corpora share, recognised by their number of vertices.

The numbers of vertices that published lip errors and upper-face dynamics are counted over are
facts about those measurements; docs/cards/vertex_lists.md says where each list stands.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.errors import CorpusError
from elocute.files.reading import FileKind, read_text

ASSETS = Path(__file__).parent / "assets"
LIST_FILE = FileKind("a list", 1_000_000, CorpusError)


@dataclass(frozen=True, eq=False)
class Topology:
    """A mesh of several corpora."""

    name: str  # as in a corpus's manifest
    title: str  # for people
    vertices: int  # their number, by which the mesh is recognised
    rates: tuple[float, ...]  # frames per second that folders of it have, the usual one first
    # Regions of vertices (`lips`, `upper_face`), and where each was published.
    published: dict[str, str]
    # Middles of upper and lower lip between which their distance was published.
    lip_middles: tuple[int, int] | None = None


FLAME = Topology(
    "flame",
    "FLAME, as in VOCASET",
    5023,
    (60.0, 30.0),
    {"lips": "FaceDiffuser vocaset/lve", "upper_face": "FaceDiffuser vocaset/fdd"},
    (3531, 3504),
)
BIWI = Topology(
    "biwi",
    "BIWI's B3D(AC)2",
    23370,
    (25.0,),
    {"lips": "CodeTalker BIWI/lve", "upper_face": "CodeTalker BIWI/fdd"},
)
TOPOLOGIES = (FLAME, BIWI)


def topology_of(vertices: int) -> Topology | None:
    """The known mesh with a number of vertices, or None."""
    return next((known for known in TOPOLOGIES if known.vertices == vertices), None)


@cache
def published_indices(topology: Topology, which: str) -> NDArray[np.int64]:
    """Vertices that published figures were computed over.

    Parameters
    ----------
    topology : Topology
        The mesh.
    which : str
        `lips` or `upper_face`.

    Returns
    -------
    (vertex,) int64
        Rising; read-only.

    Raises
    ------
    CorpusError
        For another name.
    """
    if which not in topology.published:
        raise CorpusError.about(
            f"vertex list {which!r}", found="unknown", allowed=", ".join(topology.published)
        )
    path = ASSETS / f"{topology.name}_{which}.txt"
    text = read_text(path, LIST_FILE)
    indices = np.array(text.split(), np.int64)
    indices.setflags(write=False)
    return indices
