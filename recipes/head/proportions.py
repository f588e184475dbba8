"""Faces brought to proportions of life: distances between landmarks, as callipers take them.

MakeHuman's faces have small eyes, narrow mouths and short chins by those that Farkas measured
("Anthropometry of the head and face", 1994): 31 mm from corner to corner of an eye, 50 to 54 mm
of the mouth, 43 to 50 mm from the line where lips meet to the chin.
"""

from __future__ import annotations

import numpy as np

from recipes.head.face import NeutralFace
from recipes.head.identity import IdentityBasis
from recipes.head.marks import landmarks

ACROSS = {
    "face": ((1, 15),),
    "cheeks": ((3, 13),),
    "jaw": ((4, 12),),
    "chin": ((7, 9),),
    "eye": ((36, 39), (42, 45)),
    "eye opening": ((37, 41), (38, 40), (43, 47), (44, 46)),
    "between eyes": ((39, 42),),
    "nose": ((31, 35),),
    "mouth": ((48, 54),),
}
"""Distances in space: the mean over these pairs of landmarks."""
UPWARDS = {
    "brow over eye": ((19, 37), (24, 44)),
    "eye to nose": ((39, 33), (42, 33)),
    "nose to lips": ((33, 62),),
    "lips to chin": ((62, 8),),
    "upper lip": ((51, 62),),
    "lower lip": ((66, 57),),
    "corners over lips": ((48, 62), (54, 62)),
}
"""Differences of height, likewise."""
MEASURES = tuple(ACROSS) + tuple(UPWARDS)
TRUSTED_MM, TRUSTED_TRAITS = 0.3, (0.03, 1.5)
"""How far a face may miss a measure, by one standard deviation of the face; sex and years."""
STEPS = 4
"""Distances are not linear in coefficients, though nearly."""


def measured(marks_mm: np.ndarray) -> np.ndarray:
    """(measure,) mm of (68, 3) landmarks."""

    def apart(pairs: tuple[tuple[int, int], ...]) -> np.ndarray:
        one, other = np.array(pairs).T
        return marks_mm[one] - marks_mm[other]

    across = [np.linalg.norm(apart(pairs), axis=1).mean() for pairs in ACROSS.values()]
    upwards = [apart(pairs)[:, 1].mean() for pairs in UPWARDS.values()]
    return np.array([*across, *upwards])


class Proportions:
    """Measures of faces of an identity space, and the faces that have given ones."""

    def __init__(self, face: NeutralFace, identity: IdentityBasis) -> None:
        marks = landmarks(face)
        self.mean = 1e3 * face.vertices[marks]
        self.basis = 1e3 * identity.vertices[:, marks]
        known = identity.traits[:, 1:]
        self.traits = np.pad(known, ((0, 0), (0, len(self.basis) - known.shape[1])))

    def of(self, values: np.ndarray) -> dict[str, float]:
        """Measures in mm of a face, by its coefficients."""
        return dict(zip(MEASURES, self._measured(values).tolist(), strict=True))

    def brought(self, values: np.ndarray, wanted: dict[str, float]) -> np.ndarray:
        """(component,) coefficients of the most likely face beside another that has the measures
        wanted, mm; its sex and age stay."""
        chosen = [MEASURES.index(name) for name in wanted]
        goal = np.array(list(wanted.values()))
        size = np.r_[np.full(len(chosen), TRUSTED_MM), TRUSTED_TRAITS]
        found = values
        for _ in range(STEPS):
            slope = np.vstack([self._slopes(found)[chosen], self.traits]) / size[:, None]
            missed = np.r_[goal - self._measured(found)[chosen], self.traits @ (values - found)]
            aim = missed / size + slope @ (found - values)
            found = values + slope.T @ np.linalg.solve(slope @ slope.T + np.eye(len(aim)), aim)
        return found

    def _measured(self, values: np.ndarray) -> np.ndarray:
        return measured(self.mean + np.tensordot(values, self.basis, 1))

    def _slopes(self, values: np.ndarray, step: float = 1e-3) -> np.ndarray:
        """(measure, component) mm per standard deviation."""
        plain = self._measured(values)
        moved = values + step * np.eye(len(values))
        return np.stack([self._measured(one) - plain for one in moved], 1) / step
