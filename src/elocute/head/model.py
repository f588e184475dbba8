"""The head: one mesh, its identity and expression bases, its joints and its named places."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array
from elocute.errors import HeadError
from elocute.head.character import Character
from elocute.head.looks.look import Look
from elocute.head.model_checks import check_head, refuse
from elocute.head.shape_reach import shape_reach
from elocute.head.skin_tone import TONE_SHARES, recoloured
from elocute.head.skinning import skin
from elocute.head.surface import Surface
from elocute.numerics.input_checks import floats_of
from elocute.numerics.quaternions import to_matrices

Int32Array = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class HeadModel:
    """A rigged, morphable head: one mesh, its bases, its joints and its named places.

    Lengths are metres; +Y is up, +Z points out of the face and +X to the head's own left. Every
    basis is linear: vertices = template + Σ identity · identity_basis + Σ expression ·
    expression_basis, then pose blendshapes where the head has them, and linear blend skinning by
    the joints. An identity coefficient is a standard deviation; an expression weight lies in 0 to
    1. A head need not name its places: landmarks, lips, corners, regions and mirror are then empty.

    Parameters
    ----------
    name : str
        What messages call it.
    template : (vertex, 3) float32
        The mean face with closed lips, m.
    quads : (face, 4) int32
        Vertex indices; a triangle repeats its last index.
    uv : (texcoord, 2) float32
        Texture coordinates, origin bottom left.
    uv_quads : (face, 4) int32
        Indices into `uv`.
    identity_basis : (identity, vertex, 3) float32
        Metres per standard deviation.
    expression_names : tuple of str
        One per expression, ARKit's where it has one.
    expression_basis : (expression, vertex, 3) float32
        Metres at weight one.
    joint_names : tuple of str
        One per joint.
    joint_parents : tuple of int
        The index of each joint's parent, which comes before it; -1 for none.
    joint_positions : (joint, 3) float32
        Metres.
    joint_identity_basis : (identity, joint, 3) float32
        How joints move with the identity, m per standard deviation.
    skin_weights : (vertex, joint) float32
        Rows sum to one.
    landmarks : (68,) or (0,) int32
        Vertices in iBUG's order, which begins on the head's right side.
    lip_rings : (ring, column) int32
        Vertices of the lips, from the vermilion border inwards.
    outer_lip_upper, outer_lip_lower : (outer column,) int32
        Vermilion border, by increasing x.
    inner_lip_upper, inner_lip_lower : (inner column,) int32
        Contact line, paired, by increasing x, without corners.
    outer_corners, inner_corners : (2,) or (0,) int32
        Corners of the mouth, by increasing x.
    regions : dict of str to int32 array
        Vertices by the name of a place.
    material : (face,) uint8
        Indices into `material_names`.
    material_names : tuple of str
        One per material.
    vertex_color : (vertex, 3) uint8
        sRGB.
    occlusion : (vertex,) float32
        1 = open to the light, 0 = never lit.
    mirror : (vertex,) or (0,) int32
        The vertex on the other side.
    notice : str
        Licence and origin.
    tone_basis : (at most 1 + identity,) or (0,) float32
        Skin tone of the mean face (0 light to 1 dark), then its change per standard deviation of
        the first components; the others leave it.
    trait_basis : (2, at most 1 + identity) or (0, number) float32
        The same of sex (0 woman to 1 man) and of age in years, as far as a face tells them.
    pose_basis : (9 · (joint - 1), vertex, 3) or (0, 1, 3) float32
        Pose blendshapes, m for each element of the rotation matrices, row by row, less those of
        the zero pose; of all joints but the first.
    joint_regressor : (joint, vertex) or (0, 1) float32
        Joints as sums of the vertices before these turn; without it, they rest where they are.
    surfaces : dict of str to Surface
        Images by the name of a material; a material without one shows its vertex colours.
    look : Look, optional
        What pictures and pages dress the head in; a head without one is drawn as it is.
    character : Character, optional
        Whom the head stands for: its curves and joints move that file's, and no mesh is drawn.

    Raises
    ------
    HeadError
        Where parts do not fit each other: shapes, kinds of numbers, numbers that are not finite,
        indices out of range, joints that form no tree.

    Notes
    -----
    What holds for these vertices (sealed lips, closed lids) holds in every picture and export:
    a head that is dressed has more of them between these, which stay where they are.
    """

    name: str
    template: Float32Array
    quads: Int32Array
    uv: Float32Array
    uv_quads: Int32Array
    identity_basis: Float32Array
    expression_names: tuple[str, ...]
    expression_basis: Float32Array
    joint_names: tuple[str, ...]
    joint_parents: tuple[int, ...]
    joint_positions: Float32Array
    joint_identity_basis: Float32Array
    skin_weights: Float32Array
    landmarks: Int32Array
    lip_rings: Int32Array
    outer_lip_upper: Int32Array
    outer_lip_lower: Int32Array
    inner_lip_upper: Int32Array
    inner_lip_lower: Int32Array
    outer_corners: Int32Array
    inner_corners: Int32Array
    regions: dict[str, Int32Array]
    material: NDArray[np.uint8]
    material_names: tuple[str, ...]
    vertex_color: NDArray[np.uint8]
    occlusion: Float32Array
    mirror: Int32Array
    notice: str = field(repr=False)
    tone_basis: Float32Array = field(default_factory=lambda: np.zeros(0, np.float32))
    trait_basis: Float32Array = field(default_factory=lambda: np.zeros((0, 1), np.float32))
    pose_basis: Float32Array = field(default_factory=lambda: np.zeros((0, 1, 3), np.float32))
    joint_regressor: Float32Array = field(default_factory=lambda: np.zeros((0, 1), np.float32))
    surfaces: dict[str, Surface] = field(default_factory=dict, repr=False)
    look: Look | None = field(default=None, repr=False)
    character: Character | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        check_head(vars(self))

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
    def triangles(self) -> Int32Array:
        """(triangle, 3): every quad split along its first diagonal, degenerate halves dropped."""
        return split_quads(self.quads)

    @cached_property
    def triangle_material(self) -> NDArray[np.uint8]:
        """(triangle,) material of each row of `triangles`."""
        doubled = np.repeat(self.material, 2)
        return doubled[_kept_halves(self.quads)]

    @cached_property
    def uv_triangles(self) -> Int32Array:
        """(triangle, 3) into `uv`, row for row with `triangles`."""
        return _halves(self.uv_quads)[_kept_halves(self.quads)]

    def expression_index(self, name: str) -> int:
        """The row of `expression_basis` with a name.

        Parameters
        ----------
        name : str
            One of `expression_names`.

        Returns
        -------
        int

        Raises
        ------
        HeadError
            For an unknown name.
        """
        try:
            return self.expression_names.index(name)
        except ValueError:
            raise HeadError.about(
                self.name,
                found=f"no expression called {name!r}",
                allowed=", ".join(self.expression_names),
            ) from None

    def expression_vector(self, weights: dict[str, float]) -> Float32Array:
        """Weights of all expressions from a few named ones.

        Parameters
        ----------
        weights : dict of str to float
            Weight by name; all others are zero.

        Returns
        -------
        (expression,) float32

        Raises
        ------
        HeadError
            For an unknown name.
        """
        vector = np.zeros(len(self.expression_names), np.float32)
        for name, weight in weights.items():
            vector[self.expression_index(name)] = weight
        return vector

    def identity_template(self, coefficients: Float32Array) -> Float32Array:
        """The neutral face of an identity.

        Parameters
        ----------
        coefficients : (identity,) float32
            Standard deviations, at most as many as the basis has.

        Returns
        -------
        (vertex, 3) float32
            Metres.
        """
        k = len(coefficients)
        return self.template + np.tensordot(coefficients, self.identity_basis[:k], 1)

    def identity_joints(self, coefficients: Float32Array) -> Float32Array:
        """Where the joints of an identity are.

        Parameters
        ----------
        coefficients : (identity,) float32
            Standard deviations, at most as many as the basis has.

        Returns
        -------
        (joint, 3) float32
            Metres.
        """
        k = len(coefficients)
        return self.joint_positions + np.tensordot(coefficients, self.joint_identity_basis[:k], 1)

    @cached_property
    def eye_distance_m(self) -> float:
        """Distance between the outer corners of the eyes (iBUG landmarks 37 and 46), m.

        Raises HeadError for a head without landmarks.
        """
        if not len(self.landmarks):
            raise HeadError.about(
                f"head {self.name!r}",
                found="no landmarks",
                allowed="a head with landmarks, such as the built-in one",
            )
        outer = self.template[self.landmarks[[36, 45]]]
        return float(np.linalg.norm(outer[1] - outer[0]))

    def with_identity(self, coefficients: Float32Array) -> HeadModel:
        """The same head with another face: template, joints, skin tone, fitting blinks and round
        lips.

        Shapes are made for the mean face; on an eye that is wider open a blink reaches further in
        proportion, and so do round lips from the corners of a wider mouth. The identity space
        itself is dropped.

        Parameters
        ----------
        coefficients : (identity,)
            Standard deviations, at most as many as the basis has.

        Returns
        -------
        HeadModel

        Raises
        ------
        HeadError
            For more coefficients than the basis has.
        """
        coefficients = floats_of(
            coefficients, f"head {self.name!r}", error=HeadError, allowed="coefficients, a row"
        )
        if coefficients.ndim != 1 or not np.isfinite(coefficients).all():
            refuse(
                vars(self), f"coefficients of shape {coefficients.shape}", "a row of finite numbers"
            )
        if len(coefficients) > len(self.identity_basis):
            raise HeadError.about(
                f"head {self.name!r}",
                found=f"{len(coefficients)} identity coefficients",
                allowed=f"at most {len(self.identity_basis)}",
            )
        template = self.identity_template(coefficients)
        basis = self.expression_basis.copy()
        for name, factors in shape_reach(self, template).items():
            basis[self.expression_index(name)] *= factors
        return replace(
            self,
            template=template.astype(np.float32),
            expression_basis=basis,
            joint_positions=self.identity_joints(coefficients).astype(np.float32),
            vertex_color=self._toned(coefficients),
            identity_basis=self.identity_basis[:0],
            joint_identity_basis=self.joint_identity_basis[:0],
            tone_basis=self.tone_basis[:0],
            trait_basis=self.trait_basis[:0],
        )

    def _toned(self, coefficients: Float32Array) -> NDArray[np.uint8]:
        if not len(self.tone_basis):
            return self.vertex_color
        mean, slope = float(self.tone_basis[0]), self.tone_basis[1 : 1 + len(coefficients)]
        tone = mean + float(slope @ coefficients[: len(slope)])
        share = np.zeros(self.vertex_count, np.float32)
        for index, name in enumerate(self.material_names):
            where = np.unique(self.quads[self.material == index])
            share[where] = np.maximum(share[where], TONE_SHARES.get(name, 0.0))
        return recoloured(self.vertex_color, share, mean, tone)

    def vertices(self, identity: Float32Array, expression: Float32Array) -> Float32Array:
        """One face in zero pose.

        Parameters
        ----------
        identity : (identity,) float32
            Standard deviations, at most as many as the basis has.
        expression : (expression,) float32
            Weights.

        Returns
        -------
        (vertex, 3) float32
            Metres.
        """
        return self.identity_template(identity) + np.tensordot(expression, self.expression_basis, 1)

    def posed(self, points: Float32Array, quaternions: Float32Array) -> Float32Array:
        """Faces whose joints turn.

        Parameters
        ----------
        points : (frame, vertex, 3) float32
            In zero pose, m.
        quaternions : (frame, joint, 4) float32
            Unit quaternions wxyz, each relative to the parent.

        Returns
        -------
        (frame, vertex, 3) float32
            Metres.

        References
        ----------
        Li et al. 2017, equations 2 to 4, for a head with pose blendshapes and a joint regressor.
        """
        centres = self.joint_positions
        if len(self.joint_regressor):
            centres = self.joint_regressor @ points
        if len(self.pose_basis):
            bent = to_matrices(quaternions[:, 1:]) - np.eye(3, dtype=np.float32)
            moved = np.tensordot(bent.reshape(len(bent), -1), self.pose_basis, 1)
            points = points + moved.astype(np.float32)
        posed = skin(points, quaternions, centres, self.joint_parents, self.skin_weights)
        return posed.astype(np.float32)


def split_quads(quads: Int32Array) -> Int32Array:
    """(triangle, 3) of quads (face, 4) whose triangles repeat their last index."""
    return _halves(quads)[_kept_halves(quads)]


def _halves(quads: Int32Array) -> Int32Array:
    return np.stack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]], 1).reshape(-1, 3)


def _kept_halves(quads: Int32Array) -> NDArray[np.bool_]:
    kept = np.ones((len(quads), 2), bool)
    kept[:, 1] = quads[:, 2] != quads[:, 3]
    return kept.ravel()
