"""The head: one mesh, its identity and expression bases, its joints and its named places."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from elocute.errors import HeadError
from elocute.head.skin_tone import TONE_SHARES, recoloured
from elocute.numerics.given import NUMBERS_MAX, floats_of

Array = NDArray[np.float32]
Indices = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class HeadModel:
    """A rigged, morphable head.

    Lengths are metres, +Y is up, +Z points out of the face and +X to the head's own left.
    The mesh is rendered as it is: no subdivision follows, so what holds for these vertices
    (lips sealed, lids closed) holds in every picture and every export.

    Every `*_basis` is linear: vertices = template + Σ identity·identity_basis
    + Σ expression·expression_basis, then linear blend skinning by the joints.
    An identity coefficient is a standard deviation, an expression weight lies in 0..1.
    A head may name no places: its landmarks, lips, corners, regions and mirror are then empty.

    Raises HeadError where parts do not fit each other: shapes, kinds of numbers, numbers that are
    not finite, indices that point past what they index, joints that are no tree.
    """

    name: str
    template: Array  # (vertex, 3) m, mean identity, closed lips
    quads: Indices  # (face, 4); a triangle repeats its last index
    uv: Array  # (texcoord, 2), origin bottom left
    uv_quads: Indices  # (face, 4) into uv
    identity_basis: Array  # (identity, vertex, 3) m per standard deviation
    expression_names: tuple[str, ...]
    expression_basis: Array  # (expression, vertex, 3) m
    joint_names: tuple[str, ...]
    joint_parents: tuple[int, ...]  # -1 = no parent
    joint_positions: Array  # (joint, 3) m
    joint_identity_basis: Array  # (identity, joint, 3) m
    skin_weights: Array  # (vertex, joint), rows sum to one
    landmarks: Indices  # (68,) iBUG order: first on the head's right side; or (0,)
    lip_rings: Indices  # (ring, column), from the vermilion border inwards
    outer_lip_upper: Indices  # (column,) vermilion border, by increasing x
    outer_lip_lower: Indices
    inner_lip_upper: Indices  # (column,) contact line, paired, by increasing x, no corners
    inner_lip_lower: Indices
    outer_corners: Indices  # (2,) by increasing x; or (0,), as the inner ones
    inner_corners: Indices
    regions: dict[str, Indices]  # name -> vertex indices
    material: NDArray[np.uint8]  # (face,) into material_names
    material_names: tuple[str, ...]
    vertex_color: NDArray[np.uint8]  # (vertex, 3) sRGB
    occlusion: Array  # (vertex,) 1 = open to the light, 0 = never lit
    mirror: Indices  # (vertex,) the vertex on the other side; or (0,)
    notice: str = field(repr=False)  # licence and origin
    tone_basis: Array = field(default_factory=lambda: np.zeros(0, np.float32))
    """(1 + identity,) skin tone of the mean face (0 light … 1 dark), then its slope; or empty."""

    def __post_init__(self) -> None:
        _check_kinds(self)
        _check_shapes(self)
        _check_values(self)

    def __repr__(self) -> str:
        return (
            f"HeadModel({self.name!r}, {self.vertex_count} vertices, "
            f"{len(self.expression_names)} expressions, {len(self.identity_basis)} identities, "
            f"{len(self.joint_names)} joints)"
        )

    @property
    def vertex_count(self) -> int:
        return len(self.template)

    @cached_property
    def triangles(self) -> Indices:
        """(triangle, 3): every quad split along its first diagonal, degenerate halves dropped."""
        return split_quads(self.quads)

    @cached_property
    def triangle_material(self) -> NDArray[np.uint8]:
        """(triangle,) material of each row of `triangles`."""
        doubled = np.repeat(self.material, 2)
        return doubled[_kept_halves(self.quads)]

    @cached_property
    def uv_triangles(self) -> Indices:
        """(triangle, 3) into `uv`, row for row with `triangles`."""
        return _halves(self.uv_quads)[_kept_halves(self.quads)]

    def expression_index(self, name: str) -> int:
        """Row of `expression_basis` that `name` owns; HeadError if there is none."""
        try:
            return self.expression_names.index(name)
        except ValueError:
            raise HeadError.about(
                self.name,
                found=f"no expression called {name!r}",
                allowed=", ".join(self.expression_names),
            ) from None

    def expression_vector(self, weights: dict[str, float]) -> Array:
        """(expression,) from a few named weights, zeros elsewhere."""
        vector = np.zeros(len(self.expression_names), np.float32)
        for name, weight in weights.items():
            vector[self.expression_index(name)] = weight
        return vector

    def identity_template(self, coefficients: Array) -> Array:
        """(vertex, 3) m: the neutral face of an identity (identity,) in standard deviations."""
        k = len(coefficients)
        return self.template + np.tensordot(coefficients, self.identity_basis[:k], 1)

    def identity_joints(self, coefficients: Array) -> Array:
        """(joint, 3) m: where the joints of an identity are."""
        k = len(coefficients)
        return self.joint_positions + np.tensordot(coefficients, self.joint_identity_basis[:k], 1)

    @cached_property
    def eye_distance_m(self) -> float:
        """Distance between the outer corners of the eyes (iBUG landmarks 37 and 46).

        HeadError for a head without landmarks.
        """
        if not len(self.landmarks):
            raise HeadError.about(
                f"head {self.name!r}",
                found="names no landmarks",
                allowed="for this measure a head that names its eyes, the built-in one say",
            )
        outer = self.template[self.landmarks[[36, 45]]]
        return float(np.linalg.norm(outer[1] - outer[0]))

    def with_identity(self, coefficients: Array) -> HeadModel:
        """The same head with somebody's face: template, joints and blinks that fit the eyes.

        coefficients (identity,) in standard deviations, at most as many as the basis has;
        HeadError for more. A blink is drawn for the mean face: on an eye that stands further
        open it reaches further, in proportion. The identity space itself is left behind.
        """
        coefficients = floats_of(
            coefficients, f"head {self.name!r}", error=HeadError, allowed="coefficients, a row"
        )
        if coefficients.ndim != 1 or not np.isfinite(coefficients).all():
            _refuse(self, f"coefficients of shape {coefficients.shape}", "a row of finite numbers")
        if len(coefficients) > len(self.identity_basis):
            raise HeadError.about(
                f"head {self.name!r}",
                found=f"{len(coefficients)} identity coefficients",
                allowed=f"at most {len(self.identity_basis)}",
            )
        template = self.identity_template(coefficients)
        basis = self.expression_basis
        for side in ("left", "right"):
            name = f"eyeBlink{side.capitalize()}"
            if name in self.expression_names and f"lid_upper_{side}" in self.regions:
                basis = basis.copy() if basis is self.expression_basis else basis
                scale = self._lid_gap(template, side) / self._lid_gap(self.template, side)
                basis[self.expression_index(name)] *= np.float32(scale)
        return replace(
            self,
            template=template.astype(np.float32),
            expression_basis=basis,
            joint_positions=self.identity_joints(coefficients).astype(np.float32),
            vertex_color=self._toned(coefficients),
            identity_basis=self.identity_basis[:0],
            joint_identity_basis=self.joint_identity_basis[:0],
            tone_basis=self.tone_basis[:0],
        )

    def _toned(self, coefficients: Array) -> NDArray[np.uint8]:
        if not len(self.tone_basis):
            return self.vertex_color
        mean, slope = float(self.tone_basis[0]), self.tone_basis[1 : 1 + len(coefficients)]
        tone = mean + float(slope @ coefficients[: len(slope)])
        share = np.zeros(self.vertex_count, np.float32)
        for index, name in enumerate(self.material_names):
            where = np.unique(self.quads[self.material == index])
            share[where] = np.maximum(share[where], TONE_SHARES.get(name, 0.0))
        return recoloured(self.vertex_color, share, mean, tone)

    def _lid_gap(self, vertices: Array, side: str) -> float:
        upper = vertices[self.regions[f"lid_upper_{side}"], 1].mean()
        return float(upper - vertices[self.regions[f"lid_lower_{side}"], 1].mean())

    def vertices(self, identity: Array, expression: Array) -> Array:
        """(vertex, 3) m: one face, before skinning."""
        return self.identity_template(identity) + np.tensordot(expression, self.expression_basis, 1)


def split_quads(quads: Indices) -> Indices:
    """(triangle, 3) of quads (face, 4) whose triangles repeat their last index."""
    return _halves(quads)[_kept_halves(quads)]


def _halves(quads: Indices) -> Indices:
    return np.stack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]], 1).reshape(-1, 3)


def _kept_halves(quads: Indices) -> NDArray[np.bool_]:
    kept = np.ones((len(quads), 2), bool)
    kept[:, 1] = quads[:, 2] != quads[:, 3]
    return kept.ravel()


LENGTH_MAX = 1e6
"""Beyond any unit of a head's lengths; squares and sums of such numbers still fit a float32."""
NAME_MAX, NOTICE_MAX, NAMES_MAX = 200, 100_000, 10_000
_MAY_BE_EMPTY = ("landmarks", "outer_corners", "inner_corners", "mirror")
_PLACES = (
    "landmarks",
    "lip_rings",
    "outer_lip_upper",
    "outer_lip_lower",
    "inner_lip_upper",
    "inner_lip_lower",
    "outer_corners",
    "inner_corners",
    "mirror",
)
_NUMBERS = (
    "template",
    "uv",
    "identity_basis",
    "expression_basis",
    "joint_positions",
    "joint_identity_basis",
    "skin_weights",
    "occlusion",
    "tone_basis",
)
_WHOLE = ("quads", "uv_quads", *_PLACES, "material", "vertex_color")
_AXES = {
    **dict.fromkeys(("template", "quads", "uv", "uv_quads", "joint_positions", "skin_weights"), 2),
    **dict.fromkeys(("lip_rings", "vertex_color"), 2),
    **dict.fromkeys(("identity_basis", "expression_basis", "joint_identity_basis"), 3),
}
"""Axes where they are not one."""
_REGIONS = ("regions", dict)
_NAMES = ("expression_names", "joint_names", "material_names")


def _refuse(head: HeadModel, found: str, allowed: str = "") -> NoReturn:
    name = head.name[:NAME_MAX] if isinstance(head.name, str) else "?"
    raise HeadError.about(f"head {name!r}", found=found, allowed=allowed)


def _check_kinds(head: HeadModel) -> None:
    for field_name, most in (("name", NAME_MAX), ("notice", NOTICE_MAX)):
        text = getattr(head, field_name)
        if not isinstance(text, str) or len(text) > most:
            _refuse(head, f"{field_name} that is no text", f"up to {most} characters")
    for field_name, kind in (*((name, tuple) for name in (*_NAMES, "joint_parents")), _REGIONS):
        if not isinstance(getattr(head, field_name), kind):
            _refuse(head, f"{field_name} is no {kind.__name__}")
    if not all(isinstance(name, str) for name in head.regions):
        _refuse(head, "a region whose name is no text")
    for field_name in _NAMES:
        names = getattr(head, field_name)
        texts = all(isinstance(name, str) and len(name) <= NAME_MAX for name in names)
        if not texts or len(names) > NAMES_MAX or len(set(names)) != len(names):
            _refuse(head, f"{field_name} that are none", "texts, each once")
    regions = {f"region {name[:40]}": values for name, values in head.regions.items()}
    kinds = [(name, getattr(head, name), "f") for name in _NUMBERS]
    kinds += [(name, getattr(head, name), "iu") for name in _WHOLE]
    for name, values, allowed in (*kinds, *((name, v, "iu") for name, v in regions.items())):
        if not isinstance(values, np.ndarray) or values.dtype.kind not in allowed:
            found = values.dtype if isinstance(values, np.ndarray) else type(values).__name__
            _refuse(head, f"{name} of {found}", "fractions" if allowed == "f" else "whole numbers")
        if values.size > NUMBERS_MAX:
            _refuse(head, f"{name} of {values.size} numbers", f"up to {NUMBERS_MAX}")


def _check_shapes(head: HeadModel) -> None:
    for field_name in (*_NUMBERS, *_WHOLE):
        values = getattr(head, field_name)
        if values.ndim != _AXES.get(field_name, 1):
            _refuse(head, f"{field_name} is {values.shape}", f"{_AXES.get(field_name, 1)} axes")
    vertex, face = len(head.template), len(head.quads)
    if not vertex:
        _refuse(head, "no vertices", "one or more")
    joint, expression = len(head.joint_names), len(head.expression_names)
    identity = len(head.identity_basis)
    expected: dict[str, tuple[int, ...]] = {
        "template": (vertex, 3),
        "quads": (face, 4),
        "uv": (len(head.uv), 2),
        "uv_quads": (face, 4),
        "identity_basis": (identity, vertex, 3),
        "expression_basis": (expression, vertex, 3),
        "joint_positions": (joint, 3),
        "joint_identity_basis": (identity, joint, 3),
        "skin_weights": (vertex, joint),
        "landmarks": (68,),
        "inner_lip_lower": head.inner_lip_upper.shape,
        "outer_corners": (2,),
        "inner_corners": (2,),
        "material": (face,),
        "vertex_color": (vertex, 3),
        "occlusion": (vertex,),
        "mirror": (vertex,),
    }
    for field_name, shape in expected.items():
        found = getattr(head, field_name).shape
        if found != shape and not (found == (0,) and field_name in _MAY_BE_EMPTY):
            _refuse(head, f"{field_name} is {found}", str(shape))
    if len(head.joint_parents) != joint:
        _refuse(head, f"{len(head.joint_parents)} parents for {joint} joints")


def _check_values(head: HeadModel) -> None:
    for field_name in _NUMBERS:
        values = getattr(head, field_name)
        low, high = values.min(initial=0), values.max(initial=0)  # NaN where one is NaN
        if not (low >= -LENGTH_MAX and high <= LENGTH_MAX):
            finite = bool(np.isfinite(values).all())
            found = (
                f"{field_name} of {max(-low, high):g}" if finite else f"{field_name} is not finite"
            )
            _refuse(head, found, f"up to {LENGTH_MAX:g}")
    places = [(name, getattr(head, name), len(head.template)) for name in ("quads", *_PLACES)]
    places += [
        (f"region {name[:40]}", values, len(head.template)) for name, values in head.regions.items()
    ]
    places.append(("uv_quads", head.uv_quads, len(head.uv)))
    places.append(("material", head.material, len(head.material_names)))
    for field_name, values, top in places:
        if values.size and (values.min() < 0 or values.max() >= top):
            _refuse(head, f"{field_name} points past {top} entries")
    for index, parent in enumerate(head.joint_parents):
        whole = isinstance(parent, int | np.integer) and not isinstance(parent, bool)
        if not whole or not -1 <= parent < index:
            _refuse(head, f"joint {index} that does not follow its parent", "parents come first")
