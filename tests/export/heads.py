"""Small heads with images, made here: what a picture must show is then known."""

import io

import numpy as np
from PIL import Image

from elocute.head.model import HeadModel
from elocute.head.surface import Surface

SIDE_M = 0.1


def picture(pixels) -> bytes:
    """Pixels as the bytes of a PNG."""
    file = io.BytesIO()
    Image.fromarray(np.asarray(pixels, np.uint8)).save(file, "PNG")
    return file.getvalue()


def sheets(depths, surfaces, material=None) -> HeadModel:
    """Square sheets 0.1 m wide that face the viewer, one behind the other, each its own material.

    depths (sheet,) m towards the viewer. Each sheet is 24 x 24 quads and shows its whole image.
    """
    count = 25
    line = np.linspace(-SIDE_M / 2, SIDE_M / 2, count)
    x, y = np.meshgrid(line, line, indexing="ij")
    flat = np.stack([x.ravel(), y.ravel(), np.zeros(count * count)], axis=1)
    here = np.arange(count * count).reshape(count, count)
    corners = (here[:-1, :-1], here[1:, :-1], here[1:, 1:], here[:-1, 1:])
    quads = np.stack([part.ravel() for part in corners], axis=1)
    at = np.stack([x.ravel(), y.ravel()], axis=1) / SIDE_M + 0.5
    number = len(depths)
    vertices = number * len(flat)
    names = tuple(material or [f"skin_{index}" for index in range(number)])
    empty = np.zeros(0, np.int32)
    return HeadModel(
        name="sheets",
        template=np.concatenate([flat + np.array([0, 0, z]) for z in depths]).astype(np.float32),
        quads=np.concatenate([quads + k * len(flat) for k in range(number)]).astype(np.int32),
        uv=np.tile(at, (number, 1)).astype(np.float32),
        uv_quads=np.concatenate([quads + k * len(flat) for k in range(number)]).astype(np.int32),
        identity_basis=np.zeros((0, vertices, 3), np.float32),
        expression_names=(),
        expression_basis=np.zeros((0, vertices, 3), np.float32),
        joint_names=("root",),
        joint_parents=(-1,),
        joint_positions=np.zeros((1, 3), np.float32),
        joint_identity_basis=np.zeros((0, 1, 3), np.float32),
        skin_weights=np.ones((vertices, 1), np.float32),
        landmarks=empty,
        lip_rings=np.zeros((0, 0), np.int32),
        outer_lip_upper=empty,
        outer_lip_lower=empty,
        inner_lip_upper=empty,
        inner_lip_lower=empty,
        outer_corners=empty,
        inner_corners=empty,
        regions={},
        material=np.repeat(np.arange(number), len(quads)).astype(np.uint8),
        material_names=names,
        vertex_color=np.full((vertices, 3), 255, np.uint8),
        occlusion=np.ones(vertices, np.float32),
        mirror=empty,
        notice="",
        surfaces=dict(zip(names, surfaces, strict=True)),
    )


def plain(**settings) -> Surface:
    """A surface of one grey."""
    grey = np.full((4, 4, 3), 128)
    return Surface(color=picture(grey), roughness_factor=0.8, **settings)
