"""A head as adoption needs it: its skin, its landmarks, and the lines of its lips and lids."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from elocute.adoption.correspondence import LabelledSurface, lip_sides
from elocute.adoption.face_lines import FaceLine, lines_by_landmarks, lines_of_named_head
from elocute.adoption.mesh_paths import EdgeGraph
from elocute.array_types import Float64Array
from elocute.errors import HeadError
from elocute.head.model import HeadModel
from elocute.registration.template import Template


@dataclass(frozen=True, eq=False)
class Face:
    """A head with landmarks, prepared for adoption.

    Attributes
    ----------
    head
        It has landmarks; where it names no lips, their lines are found through the landmarks.
    """

    head: HeadModel

    def __post_init__(self) -> None:
        if not len(self.head.landmarks):
            raise HeadError.about(
                f"head {self.head.name!r}", found="no landmarks", allowed="a head with 68 landmarks"
            )

    @cached_property
    def template(self) -> Template:
        return Template(self.head)

    @property
    def points(self) -> Float64Array:
        """(vertex, 3) m, at rest."""
        return self.template.vertices

    @property
    def skin(self) -> NDArray[np.intp]:
        """(free,) vertices of the part that bears the landmarks."""
        return self.template.skin

    @cached_property
    def triangles(self) -> NDArray[np.intp]:
        """(triangle, 3) of the skin."""
        inside = np.zeros(self.head.vertex_count, bool)
        inside[self.skin] = True
        return self.head.triangles[inside[self.head.triangles].all(axis=1)].astype(np.intp)

    @cached_property
    def graph(self) -> EdgeGraph:
        return EdgeGraph(self.points, self.head.triangles)

    @cached_property
    def lines(self) -> dict[str, FaceLine]:
        """The edges of lips and lids."""
        if len(self.head.inner_lip_upper) and "lid_upper_left" in self.head.regions:
            return lines_of_named_head(self.head)
        return lines_by_landmarks(self.points, self.graph, self.head.landmarks.astype(np.intp))

    @cached_property
    def sides(self) -> Float64Array:
        """(vertex,) upper lip 1, lower lip -1, 0 away from them."""
        return lip_sides(self.graph, self.lines)

    def surface(self, points: Float64Array | None = None) -> LabelledSurface:
        """The skin, at rest or in another shape (vertex, 3) m."""
        return LabelledSurface(
            self.points if points is None else points, self.triangles, self.sides
        )
