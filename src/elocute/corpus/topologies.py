"""Meshes that published corpora share, told by how many vertices they have.

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
from elocute.files.reading import read_text

ASSETS = Path(__file__).parent / "assets"
LIST_MAX_BYTES = 1_000_000


@dataclass(frozen=True, eq=False)
class Topology:
    """A mesh of many corpora.

    name        as a corpus's manifest says it
    title       for people
    vertices    their count, by which it is told
    rates       frames per second that folders of it come in, the usual one first
    published   list to where it was published, for names in reports
    """

    name: str
    title: str
    vertices: int
    rates: tuple[float, ...]
    published: dict[str, str]


FLAME = Topology(
    "flame",
    "FLAME, as in VOCASET",
    5023,
    (60.0, 30.0),
    {"lips": "FaceDiffuser vocaset/lve", "upper_face": "FaceDiffuser vocaset/fdd"},
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
    """The known mesh with so many vertices, or None."""
    return next((known for known in TOPOLOGIES if known.vertices == vertices), None)


@cache
def published_indices(topology: Topology, which: str) -> NDArray[np.int64]:
    """(vertex,) rising numbers of one of LISTS, read-only. Raises CorpusError for another."""
    if which not in topology.published:
        raise CorpusError.about(
            f"vertex list {which!r}", found="unknown", allowed=", ".join(topology.published)
        )
    path = ASSETS / f"{topology.name}_{which}.txt"
    text = read_text(path, max_bytes=LIST_MAX_BYTES, allowed="a list", error=CorpusError)
    indices = np.array(text.split(), np.int64)
    indices.setflags(write=False)
    return indices
