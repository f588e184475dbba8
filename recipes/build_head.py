"""Build the built-in head from MakeHuman's CC0 data.

    python -m recipes.build_head [--data ../shared/data] [--people 600]
    python -m recipes.build_head --like src/elocute/head/assets/head.npz

Writes src/elocute/head/assets/head.npz and identities.json. Takes two minutes on one core. The
second keeps the identity space of a built head, so that its seeds stay the same people while shapes
and textures change.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from elocute.head import HeadModel, load_head, save_head
from elocute.head.normals import vertex_normals
from recipes.head import marks, paint, shade
from recipes.head.arkit import NAMES
from recipes.head.face import NeutralFace
from recipes.head.identity import (
    JOINT_NAMES,
    JOINT_PARENTS,
    IdentityBasis,
    identity_basis,
    identity_of,
    joints_of,
)
from recipes.head.lips import PAIRS
from recipes.head.local_faces import with_local_components
from recipes.head.makehuman import MakeHuman
from recipes.head.people import coefficients
from recipes.head.shapes import expression_basis
from recipes.head.weights import skin_weights

ROOT = Path(__file__).parents[1]
NOTICE = (
    "CC0 1.0 Universal (public domain dedication). Derived from the MakeHuman base mesh, targets, "
    "rig and pose units (makehumancommunity.org), which their authors released under CC0 1.0; "
    "changed, sculpted further and given teeth, eyes, colours and shapes for Elocute. "
    "An artist's prior, not population statistics."
)


def build(data: Path, people: int, like: Path | None) -> tuple[HeadModel, dict]:
    """The head, and the coefficients of the named faces."""
    face = NeutralFace(MakeHuman(data / "makehuman"))
    if like:
        identity = identity_of(load_head(like))
    else:
        identity = with_local_components(face, identity_basis(face, people))
    shapes = expression_basis(face)
    named = coefficients(face, identity)
    for name, values in named.items():
        print(f"{name}: largest coefficient {np.abs(values).max():.1f}")
    return assembled(face, identity, shapes), named


def assembled(face: NeutralFace, identity: IdentityBasis, shapes: np.ndarray) -> HeadModel:
    assembly, lips = face.assembly, face.lips
    uv, uv_quads = paint.texture(face)
    triangles = np.vstack([assembly.quads[:, [0, 1, 2]], assembly.quads[:, [0, 2, 3]]])
    ajar = face.vertices + 0.3 * shapes[NAMES.index("jawOpen")]
    light = shade.shading(face, ajar, triangles, vertex_normals(ajar, triangles))
    joints = joints_of(face, face.body)
    joints[:3, 0] = 0
    joints[4] = joints[3] * [-1, 1, 1]
    origin = np.array([0, joints[3, 1], joints[2, 2]])
    rings = lips.rings
    upper, lower = np.array(PAIRS).T
    return HeadModel(
        name="elocute",
        template=(face.vertices - origin).astype(np.float32),
        quads=assembly.quads.astype(np.int32),
        uv=uv.astype(np.float32),
        uv_quads=uv_quads.astype(np.int32),
        identity_basis=identity.vertices.astype(np.float32),
        expression_names=NAMES,
        expression_basis=shapes.astype(np.float32),
        joint_names=JOINT_NAMES,
        joint_parents=JOINT_PARENTS,
        joint_positions=(joints - origin).astype(np.float32),
        joint_identity_basis=identity.joints.astype(np.float32),
        skin_weights=skin_weights(face).astype(np.float32),
        landmarks=marks.landmarks(face),
        lip_rings=rings.astype(np.int32),
        outer_lip_upper=rings[0, upper].astype(np.int32),
        outer_lip_lower=rings[0, lower].astype(np.int32),
        inner_lip_upper=rings[7, upper].astype(np.int32),
        inner_lip_lower=rings[7, lower].astype(np.int32),
        outer_corners=rings[0, [26, 12]].astype(np.int32),
        inner_corners=rings[7, [26, 12]].astype(np.int32),
        regions=marks.regions(face),
        material=paint.face_materials(face),
        material_names=paint.MATERIALS,
        vertex_color=np.round(paint.vertex_colours(face) * 255).clip(0, 255).astype(np.uint8),
        occlusion=light.astype(np.float32),
        mirror=assembly.mirror.astype(np.int32),
        notice=NOTICE,
        tone_basis=identity.tone.astype(np.float32),
        trait_basis=identity.traits.astype(np.float32),
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--people", type=int, default=600)
    parser.add_argument("--like", type=Path, help="a built head whose identity space is kept")
    parser.add_argument(
        "--out", type=Path, default=ROOT / "src" / "elocute" / "head" / "assets" / "head.npz"
    )
    choice = parser.parse_args()
    head, named = build(choice.data, choice.people, choice.like)
    save_head(choice.out, head)
    rounded = {name: np.round(values, 3).tolist() for name, values in named.items()}
    choice.out.with_name("identities.json").write_text(json.dumps(rounded) + "\n")
    print(f"{choice.out}: {head.vertex_count} vertices, {choice.out.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
