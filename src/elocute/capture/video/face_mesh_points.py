"""Where the 478 points of MediaPipe's face mesh lie on the built-in head."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.files.array_reading import read_npz
from elocute.files.reading import FileKind
from elocute.head.mediapipe_face_mesh import CHIN, IRIS, LIPS, RIM
from elocute.one_line_repr import one_line

TABLE_PATH = Path(__file__).parent / "assets" / "face_points.npz"
TABLE_FILE = FileKind("the table that ships", 10_000_000)
CHIN_TRUST = 3.0  # jaw and lower lip open a mouth alike; the chin tells them apart
HALF_TRUST_MM = 2.0  # a spread at which a point's trust is half


@dataclass(frozen=True, eq=False)
class FacePoints:
    """Each point of the face mesh as a place in a triangle of the head, from
    recipes/face_points.py.

    vertices: (478, 3) indices. shares: (478, 3) barycentric coordinates. spread_mm: (478,)
    uncertainty of a place: the median distance of the detector's sightings, or twice how far sides
    differ or the place was moved onto a line, if that is more; 1.8 mm in the median, most at the
    rim of the face.
    """

    vertices: NDArray[np.int32]
    shares: NDArray[np.float32]
    spread_mm: NDArray[np.float32]

    __repr__ = one_line

    def on(self, vertices: NDArray[np.floating]) -> NDArray[np.float64]:
        """(…, 478, 3) of vertices, or of displacements of them, (…, vertex, 3)."""
        corners = vertices[..., self.vertices, :].astype(np.float64)
        return np.einsum("pc,...pca->...pa", self.shares.astype(np.float64), corners)


@cache
def builtin_face_points() -> FacePoints:
    """The table that ships, read once per process."""
    stored = read_npz(TABLE_PATH, TABLE_FILE)
    return FacePoints(stored["vertices"], stored["shares"], stored["spread_mm"])


def point_trust(table: FacePoints) -> NDArray[np.float64]:
    """(478,) how much each point counts in a fit: little where it slides over the skin.

    1 for a point that lies where it belongs; the chin counts more.
    """
    trust = 1 / (1 + (table.spread_mm.astype(np.float64) / HALF_TRUST_MM) ** 2)
    trust[list(RIM)] *= 0.3
    trust[IRIS:] *= 0.5
    trust[list(LIPS)] = 1.0
    trust[list(CHIN)] = CHIN_TRUST
    return trust
