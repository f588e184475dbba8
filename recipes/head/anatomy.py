"""The parts of the head and how a MakeHuman body becomes them."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from recipes.head.makehuman import MakeHuman
from recipes.head.topology import Connectivity, limit_stencil, mirror_map

NOSE_TIP = 297
NECK_CUT = (1491, 8177)
"""First two vertices of the closed edge loop where head and body part."""
LIP_RINGS = (362, 455, 466, 467, 509, 468, 474, 520, 537, 554)
"""Upper midline vertices of the lip rings, from the vermilion border into the mouth."""
CONTACT_RING = 7
CORNERS = (12, 26)
"""Columns of the mouth corners: column 0 is the upper midline, 19 the lower."""
UPPER_COLUMNS = (*range(27, 38), *range(12))
LOWER_COLUMNS = tuple(range(25, 12, -1))
"""Both by increasing x, corners left out."""
LID_FRONT, LID_MIDDLE, LID_BACK = (6784, 6785), (13352, 13359), (7747, 7748)
"""First two vertices of the left lid margin's loops; the last one lies on the eyeball."""


class Anatomy:
    """Index sets on the base mesh; skin and tongue vertices lie on their limit surface."""

    def __init__(self, mh: MakeHuman) -> None:
        self.mh = mh
        base = mh.base
        body = base.quads[base.groups == "body"]
        web = Connectivity(body)
        self.rim_of_base = web.loop(*NECK_CUT)
        self.skin_of_base = np.array(sorted(web.flood(NOSE_TIP, set(self.rim_of_base))))
        self.skin_quads, self.skin_faces_of_base = self._cut(self.skin_of_base, "body")
        self.skin_count = len(self.skin_of_base)
        self.skin_mirror = mirror_map(base.vertices[self.skin_of_base])
        tongue = base.quads[base.groups == "helper-tongue"]
        self.tongue_of_base = np.unique(tongue)
        self.tongue_quads, self.tongue_faces_of_base = self._cut(
            self.tongue_of_base, "helper-tongue"
        )
        self.tongue_mirror = mirror_map(base.vertices[self.tongue_of_base])
        self.local = np.full(len(base.vertices), -1)
        self.local[self.skin_of_base] = np.arange(self.skin_count)
        self.rim = self.local[self.rim_of_base]
        self.lip_rings = self.local[[self._ring(web, start) for start in LIP_RINGS]]
        self.web = Connectivity(self.skin_quads)
        lids = [self.local[web.loop(*start)] for start in (LID_FRONT, LID_MIDDLE, LID_BACK)]
        self.lid_front, self.lid_middle, self.lid_back = lids

    def _cut(self, kept: np.ndarray, group: str) -> tuple[np.ndarray, np.ndarray]:
        base = self.mh.base
        local = np.full(len(base.vertices), -1)
        local[kept] = np.arange(len(kept))
        faces = np.flatnonzero((base.groups == group) & np.isin(base.quads, kept).all(1))
        return local[base.quads[faces]], faces

    def _ring(self, web: Connectivity, start: int) -> list[int]:
        x = self.mh.base.vertices[:, 0]
        second = next(vertex for vertex in web.neighbours[start] if x[vertex] > 1e-4)
        return web.loop(start, second)

    @cached_property
    def skin_stencil(self):
        return limit_stencil(self.skin_quads, self.skin_count)

    @cached_property
    def tongue_stencil(self):
        return limit_stencil(self.tongue_quads, len(self.tongue_of_base))

    def skin(self, body: np.ndarray) -> np.ndarray:
        """(vertex, 3) of the skin from positions or displacements of the base mesh."""
        return self.skin_stencil @ body[self.skin_of_base]

    def tongue(self, body: np.ndarray) -> np.ndarray:
        return self.tongue_stencil @ body[self.tongue_of_base]

    def lid_arc(self, skin: np.ndarray, upper: bool) -> np.ndarray:
        """Vertices of the left lid's front edge between the corners, corners left out."""
        edge, height = self.lid_front, skin[self.lid_front, 1]
        first, last = int(skin[edge, 0].argmin()), int(skin[edge, 0].argmax())
        count = len(edge)
        ways = (
            [(first + k) % count for k in range((last - first) % count + 1)],
            [(first - k) % count for k in range((first - last) % count + 1)],
        )
        choose = max if upper else min
        return edge[choose(ways, key=lambda way: height[way].mean())[1:-1]]

    @cached_property
    def inner_mouth(self) -> np.ndarray:
        """Skin vertices behind the contact ring."""
        wall = set(self.lip_rings[CONTACT_RING].tolist())
        return np.array(sorted(self.web.flood(int(self.lip_rings[CONTACT_RING + 1][0]), wall)))
