"""The neutral face while shapes are sculpted on it."""

from __future__ import annotations

import numpy as np

from elocute.numerics.smoothing import smoothstep
from recipes.head import nose
from recipes.head.anatomy import Anatomy
from recipes.head.assembly import Assembly
from recipes.head.bite import Bite
from recipes.head.ears import Ears
from recipes.head.jaw import jaw_move, jaw_weights
from recipes.head.lips import Lips
from recipes.head.makehuman import MakeHuman
from recipes.head.population import RACES, Traits, body
from recipes.head.pose import PoseUnits
from recipes.head.tongue import resting
from recipes.head.topology import SmoothSpread, adjacency, mirrored, symmetrised

SOFTENING = (
    ("mouth/mouth-angles-up", 0.44),
    ("head/head-scale-vert-decr", 0.15),
    ("eyes/l-eye-corner2-up", 0.18),
    ("eyes/r-eye-corner2-up", 0.18),
    ("mouth/mouth-lowerlip-volume-decr", 0.15),
)
"""Small touches that make the average face friendlier: (target, amount)."""


EYES_OPEN = 0.22
"""Share of the wide-eyed expression in the neutral face: MakeHuman's lids hang a little."""


class BustCut:
    """Brings the rim of the neck into one plane, the same for every face."""

    def __init__(self, anatomy: Anatomy, skin: np.ndarray) -> None:
        self.rim = anatomy.rim
        points = skin[self.rim]
        front, back = points[points[:, 2].argmax()], points[points[:, 2].argmin()]
        slope = (front - back) * [0, 1, 1]
        self.normal = np.cross(slope, [1.0, 0, 0])
        self.normal /= np.linalg.norm(self.normal) * np.sign(self.normal[1])
        self.height = float(points.mean(0) @ self.normal) - 0.006
        near = np.flatnonzero(skin @ self.normal - self.height < 0.07)
        self.spread = SmoothSpread(
            anatomy.skin_quads, anatomy.skin_count, self.rim, near, alpha=0.002
        )

    def __call__(self, skin: np.ndarray) -> np.ndarray:
        drop = self.height - skin[self.rim] @ self.normal
        return self.spread(drop[:, None] * self.normal)


class NeutralFace:
    """Template with closed lips, and the sources that shapes are drawn from."""

    def __init__(self, mh: MakeHuman) -> None:
        self.mh = mh
        moved = body(mh, Traits())
        for name, amount in SOFTENING:
            moved += amount * mh.target(name)
        for side in ("left", "right"):
            moved += EYES_OPEN * self._expression_of_base(f"eye-{side}-opened-up")
        self.body = mh.base.vertices + moved
        self.anatomy = Anatomy(mh)
        self.assembly = Assembly(self.anatomy, self.body)
        self.skin_slice = self.assembly.slices["skin"]
        raw = symmetrised(self.assembly.whole(self.body), self.assembly.mirror)
        self.lips = Lips(self.anatomy, raw[self.skin_slice])
        self.bust = BustCut(self.anatomy, raw[self.skin_slice])
        self.ears = Ears(self.anatomy, raw[self.skin_slice])
        raw[self.skin_slice] = self.finished(raw[self.skin_slice]) + self.ears.sculpted()
        raw[self.skin_slice] += nose.sculpted(self.anatomy, raw[self.skin_slice])
        self.vertices = self.assembly.attach(symmetrised(raw, self.assembly.mirror))
        self.tongue_rest = resting(self.vertices[self.assembly.slices["tongue"]])
        self.vertices[self.assembly.slices["tongue"]] += self.tongue_rest
        self.lips.rest = self.skin
        self.bite = Bite(self.assembly, self.lips, self.vertices)
        self.pose_units = PoseUnits(mh)
        self.jaw_joint = mh.joint("jaw____head", self.body) * [0, 1, 1]
        self.jaw_weights = jaw_weights(self.assembly)

    def finished(self, skin: np.ndarray) -> np.ndarray:
        """Skin of any face: lips of human height and outline, sealed; neck cut along a plane."""
        thin = skin + self.lips.thinned(skin) + self.lips.bowed()
        return thin + self.lips.seal(thin) + self.bust(thin)

    def person(self, body: np.ndarray, moved: np.ndarray | float = 0.0) -> np.ndarray:
        """(vertex, 3) m of the whole on another body whose skin is moved besides, an affine map of
        both: skin finished, and behind its lips teeth and tongue, as far in and as far up as on
        the neutral face."""
        vertices = self.assembly.whole(body)
        vertices[self.skin_slice] = self.finished(vertices[self.skin_slice] + moved)
        vertices[self.assembly.slices["tongue"]] += self.tongue_rest
        return self.assembly.attach(self.bite.behind_lips(vertices))

    def off_the_bust(self, height_m: float) -> np.ndarray:
        """(vertex,) 0 at the cut of the neck, 1 from a height above it, smoothly between."""
        t = np.clip((self.vertices @ self.bust.normal - self.bust.height) / height_m, 0, 1)
        return smoothstep(t)

    @property
    def skin(self) -> np.ndarray:
        return self.vertices[self.skin_slice]

    def of_skin(self, displacement: np.ndarray) -> np.ndarray:
        """A displacement of the skin as one of the whole."""
        whole = np.zeros((self.assembly.count, 3))
        whole[self.skin_slice] = displacement
        return whole

    def expression(self, name: str) -> np.ndarray:
        """(skin vertex, 3): MakeHuman's expression target, its three ancestries averaged."""
        return self.anatomy.skin(self._expression_of_base(name))

    def _expression_of_base(self, name: str) -> np.ndarray:
        parts = [self.mh.target(f"expression/units/{race}/{name}") for race in RACES]
        return np.mean(parts, axis=0)

    def pose_unit(self, name: str) -> np.ndarray:
        """(skin vertex, 3): displacement of one of MakeHuman's pose units."""
        return self.anatomy.skin(self.pose_units.delta(name, self.body))

    def jaw(self, **movement) -> np.ndarray:
        """(vertex, 3) of the whole: see `jaw_move`."""
        return jaw_move(self.vertices, self.jaw_weights, self.jaw_joint, **movement)

    def resealed(self, displacement: np.ndarray, overlap_m: float = 0.0003) -> np.ndarray:
        """The same skin displacement with closed lips."""
        return displacement + self.lips.seal(self.skin + displacement, overlap_m)

    def off_the_lips(self, displacement: np.ndarray) -> np.ndarray:
        """The same skin displacement fading out towards the lips, which stay."""
        return displacement - self.lips.field(displacement[self.lips.rings])

    def softened(self, displacement: np.ndarray, rounds: int) -> np.ndarray:
        """The same skin displacement without steps: evened out between neighbours."""
        links = adjacency(self.anatomy.skin_quads, self.anatomy.skin_count)
        degree = np.asarray(links.sum(1))
        for _ in range(rounds):
            displacement = (displacement + links @ displacement / degree) / 2
        return displacement

    def halves(self, displacement: np.ndarray, blend_m: float = 0.0045) -> dict[str, np.ndarray]:
        """Left and right part of a skin displacement, blended across the middle."""
        share = 1 / (1 + np.exp(-self.skin[:, 0] / blend_m))[:, None]
        return {"Left": displacement * share, "Right": displacement * (1 - share)}

    def attached(self, displacement: np.ndarray) -> np.ndarray:
        return self.assembly.attach(displacement.copy(), offset=False)

    def mirrored(self, field: np.ndarray) -> np.ndarray:
        return mirrored(field, self.assembly.mirror)

    def symmetrised(self, field: np.ndarray) -> np.ndarray:
        return symmetrised(field, self.assembly.mirror)
