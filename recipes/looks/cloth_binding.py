"""How cloth follows the skin: near the neck what is beside it, further away the rim as a whole."""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from elocute.numerics.smoothing import smoothstep
from recipes.head.face import NeutralFace
from recipes.looks.cards import SKULL, Cards

LOCAL_M = 0.10
"""Further from the rim than this, cloth follows the rim as a whole."""
CARDINALS, NEAREST = 4, 7


def _cardinals(face: NeutralFace) -> np.ndarray:
    """Rim vertices at the left, right, front and back."""
    rim = face.anatomy.rim
    points = face.skin[rim]
    left = int(rim[points[:, 0].argmax()])
    front = rim[np.argsort(np.abs(points[:, 0]) - 10 * points[:, 2])[0]]
    back = rim[np.argsort(np.abs(points[:, 0]) + 10 * points[:, 2])[0]]
    return np.array([left, face.anatomy.skin_mirror[left], front, back])


def bound(face, points, quads, uv, uv_quads, light) -> Cards:
    """Near the neck on the skin beside it, further away on the rim as a whole."""
    skin = face.skin
    away, near = map(np.asarray, KDTree(skin).query(points, NEAREST))
    # The furthest counts for nothing: where another takes its place, cloth has no step.
    local = (1 - away / away[:, -1:]) ** 2
    local /= local.sum(1, keepdims=True)
    far = smoothstep(np.clip(away[:, 0] / LOCAL_M, 0, 1))[:, None]
    whole = _cardinals(face)
    index = np.hstack([near, np.tile(whole, (len(points), 1))])
    weights = np.hstack([local * (1 - far), np.tile(far / CARDINALS, (1, CARDINALS))])
    weights = _coarse(weights, 12)  # fewer bits are a smaller file
    weights[:, 0] += 1 - weights.sum(1)
    offset = _coarse(points - np.einsum("vk,vkc->vc", weights, skin[index]), 17)
    return Cards(index, weights, offset, quads, uv, uv_quads, light, points)


def _coarse(values: np.ndarray, bits: int) -> np.ndarray:
    return np.round(values * 2**bits) / 2**bits


def measures(face: NeutralFace) -> tuple[np.ndarray, np.ndarray]:
    """What scales the shirt: the neck's width and depth, and the height of the skull."""
    left, right, front, back = _cardinals(face)
    pairs = np.array([[left, right], face.anatomy.local[list(SKULL[1])], [front, back]])
    between = [abs(face.skin[a, k] - face.skin[b, k]) for k, (a, b) in enumerate(pairs)]
    return pairs, np.array(between)
