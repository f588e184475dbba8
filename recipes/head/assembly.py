"""Everything the head is made of in one vertex array: skin, eyes, tongue, teeth, gums."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from recipes.head.anatomy import Anatomy
from recipes.head.refine import refine
from recipes.head.topology import symmetrised

from . import attachments, eyeball, teeth

PARTS = (
    "skin",
    "eye_left",
    "eye_right",
    "tongue",
    "teeth_upper",
    "teeth_lower",
    "gums_upper",
    "gums_lower",
    "bust",
    "brows",
    "lashes",
    "scalp",
)
UPPER_HELPER = slice(15060, 15128)
LOWER_HELPER = slice(14992, 15060)
EYE_SHELL_LEFT, EYE_SHELL_RIGHT = slice(0, 256), slice(532, 788)
"""Outer shells in MakeHuman's high-poly eyes."""
OVERBITE_MM = 1.3
"""How far the upper incisors reach over the lower ones."""
BITING_MM = 2.3
"""How far the edges of the upper incisors lie under MakeHuman's: 1.3 mm under the line of shut
lips, so that lips which part show them, as people's do."""


@dataclass(frozen=True, eq=False)
class Follower:
    """A part that keeps its shape but for the affine map that best carries some helpers."""

    vertices: np.ndarray
    carry: np.ndarray  # (vertex, helper): vertices' = carry @ helpers'

    @classmethod
    def of(cls, vertices: np.ndarray, helpers: np.ndarray) -> Follower:
        def homogeneous(points: np.ndarray) -> np.ndarray:
            return np.c_[points, np.ones(len(points))]

        return cls(vertices, homogeneous(vertices) @ np.linalg.pinv(homogeneous(helpers)))


class Assembly:
    """Where each part lies in the whole, and how a MakeHuman body becomes the whole."""

    def __init__(self, anatomy: Anatomy, body: np.ndarray) -> None:
        self.anatomy = anatomy
        mh = anatomy.mh
        shells, _ = mh.eye_mesh(body)
        self.eye_centre = mh.joint("eye.L____head", body)
        radius = np.linalg.norm(shells[EYE_SHELL_LEFT] - self.eye_centre, axis=1).min() * 1.0
        self.eye_radius = radius
        ball = eyeball.eyeball(radius)
        self.eye_angle = ball.angle
        left = ball.directions + self.eye_centre
        followers = {
            "eye_left": Follower.of(left, shells[EYE_SHELL_LEFT]),
            "eye_right": Follower.of(left * [-1, 1, 1], shells[EYE_SHELL_RIGHT]),
        }
        jaws = _jaws(body)
        for name, part in jaws.items():
            helper = body[UPPER_HELPER if name.endswith("upper") else LOWER_HELPER]
            followers[name] = Follower.of(part.vertices, helper)
        self.followers = followers
        self.jaws = jaws
        skin = symmetrised(anatomy.skin(body), anatomy.skin_mirror)
        self.refined = refine(anatomy, skin, self.eye_centre)
        self.attached = {
            "bust": attachments.bust(anatomy),
            "brows": attachments.brows(anatomy, skin, self.eye_centre),
            "lashes": attachments.lashes(anatomy, skin, self.eye_centre),
            "scalp": attachments.loose(self.refined.mixture, self.refined.mirror),
        }
        quads = {
            "skin": self.refined.quads,
            "eye_left": ball.quads,
            "eye_right": ball.quads[:, ::-1],
            "tongue": anatomy.tongue_quads,
            **{name: part.quads for name, part in jaws.items()},
        }
        counts = [anatomy.skin_count, len(left), len(left), len(anatomy.tongue_of_base)]
        counts += [len(jaws[name].vertices) for name in PARTS[4:8]]
        counts += [len(self.attached[name].offset) for name in PARTS[8:]]
        ends = np.cumsum(counts)
        self.slices = {
            name: slice(end - n, end) for name, n, end in zip(PARTS, counts, ends, strict=True)
        }
        self.count = int(ends[-1])
        quads |= {name: part.quads for name, part in self.attached.items()}
        self.quads = np.vstack([self._numbered(name, quads[name]) for name in PARTS])
        self.part_of_face = np.repeat(np.arange(len(PARTS)), [len(quads[name]) for name in PARTS])
        self.mirror = self._mirror()

    def _numbered(self, name: str, quads: np.ndarray) -> np.ndarray:
        """Own numbers as numbers of the whole. The skin and what rides on it count the skin's
        vertices first; the skin's further vertices are the scalp's."""
        if name != "skin" and name not in self.attached:
            return quads + self.slices[name].start
        start = self.slices["scalp" if name == "skin" else name].start
        count = self.anatomy.skin_count
        return np.where(quads < count, quads, quads - count + start)

    def _mirror(self) -> np.ndarray:
        mirror = np.empty(self.count, int)
        own = {"skin": self.anatomy.skin_mirror, "tongue": self.anatomy.tongue_mirror}
        own |= {name: part.mirror for name, part in self.jaws.items()}
        own |= {name: part.mirror for name, part in self.attached.items()}
        for name, partner in own.items():
            mirror[self.slices[name]] = partner + self.slices[name].start
        left, right = self.slices["eye_left"], self.slices["eye_right"]
        mirror[left] = np.arange(right.start, right.stop)
        mirror[right] = np.arange(left.start, left.stop)
        return mirror

    def whole(self, body: np.ndarray) -> np.ndarray:
        """(vertex, 3) m of all parts on a body (all maps are affine in the body)."""
        shells, _ = self.anatomy.mh.eye_mesh(body)
        helpers = {
            "eye_left": shells[EYE_SHELL_LEFT],
            "eye_right": shells[EYE_SHELL_RIGHT],
            "teeth_upper": body[UPPER_HELPER],
            "gums_upper": body[UPPER_HELPER],
            "teeth_lower": body[LOWER_HELPER],
            "gums_lower": body[LOWER_HELPER],
        }
        vertices = np.empty((self.count, 3))
        vertices[self.slices["skin"]] = self.anatomy.skin(body)
        vertices[self.slices["tongue"]] = self.anatomy.tongue(body)
        for name, points in helpers.items():
            vertices[self.slices[name]] = self.followers[name].carry @ points
        return self.attach(vertices)

    def attach(self, vertices: np.ndarray, offset: bool = True) -> np.ndarray:
        """Put what rides on the skin where the skin is; `offset` False for displacements."""
        skin = vertices[self.slices["skin"]]
        for name, part in self.attached.items():
            vertices[self.slices[name]] = part.mixture @ skin + (part.offset if offset else 0)
        return vertices


def _jaws(body: np.ndarray) -> dict[str, teeth.Part]:
    """Teeth and gums fitted to the mouth of `body`."""
    helper = body[UPPER_HELPER] * 1000
    front, biting = helper[:, 2].max() + 4.0, helper[:, 1].min() - BITING_MM
    upper = teeth.Arch(29.0, front, front - 46.0, biting, direction=-1)
    lower = teeth.Arch(26.0, front - 2.9, front - 46.5, biting + OVERBITE_MM, direction=1)
    return {
        "teeth_upper": teeth.teeth(
            upper, teeth.UPPER_WIDTHS_MM, teeth.UPPER_HEIGHTS_MM, teeth.UPPER_DEPTHS_MM
        ),
        "teeth_lower": teeth.teeth(
            lower, teeth.LOWER_WIDTHS_MM, teeth.LOWER_HEIGHTS_MM, teeth.LOWER_DEPTHS_MM
        ),
        "gums_upper": teeth.gums(upper, teeth.UPPER_WIDTHS_MM, teeth.UPPER_HEIGHTS_MM),
        "gums_lower": teeth.gums(lower, teeth.LOWER_WIDTHS_MM, teeth.LOWER_HEIGHTS_MM),
    }
