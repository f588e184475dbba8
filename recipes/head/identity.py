"""The identity basis: principal components of random adults with sealed lips."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .face import NeutralFace
from .population import random_adult

JOINTS = ("neck01____head", "head____head", "jaw____head", "eye.L____head", "eye.R____head")
JOINT_NAMES = ("neck", "head", "jaw", "eyeLeft", "eyeRight")
JOINT_PARENTS = (-1, 0, 1, 1, 1)


@dataclass(frozen=True, eq=False)
class IdentityBasis:
    vertices: np.ndarray  # (component, vertex, 3) m per standard deviation
    joints: np.ndarray  # (component, joint, 3)
    explained: float  # share of variance
    held_out_m: float  # mean vertex error on faces not used


def joints_of(face: NeutralFace, body: np.ndarray) -> np.ndarray:
    return np.stack([face.mh.joint(name, body) for name in JOINTS])


def identity_basis(
    face: NeutralFace, people: int = 600, components: int = 50, held_out: int = 30, seed: int = 0
) -> IdentityBasis:
    rng = np.random.default_rng(seed)
    rows = np.stack([_person(face, rng) for _ in range(people + held_out)]).astype(np.float32)
    known, unknown = rows[:people], rows[people:]
    mean = known.mean(0)
    # 600 people, 24,000 numbers each: the small side of the matrix is decomposed.
    centred = known - mean
    values, vectors = np.linalg.eigh((centred @ centred.T).astype(np.float64))
    order = np.argsort(values)[::-1][:components]
    basis = vectors[:, order].T @ centred / np.sqrt(values[order])[:, None]
    spread = np.sqrt(values[order] / (people - 1))
    rest = unknown - mean
    missed = (rest - (rest @ basis.T) @ basis).reshape(held_out, -1, 3)
    scaled = (basis * spread[:, None]).reshape(components, -1, 3)
    skin = missed[:, face.skin_slice]
    return IdentityBasis(
        vertices=scaled[:, : face.assembly.count],
        joints=scaled[:, face.assembly.count :],
        explained=float(values[order].sum() / values.sum()),
        held_out_m=float(np.linalg.norm(skin, axis=2).mean()),
    )


def _person(face: NeutralFace, rng: np.random.Generator) -> np.ndarray:
    """Vertices and joints of one adult: placed like the template, lips sealed, neck cut."""
    body = random_adult(face.mh, rng)
    upper = face.skin[:, 1] > face.skin[:, 1].mean()
    shift = (face.skin - face.anatomy.skin(body))[upper].mean(0)
    vertices = face.assembly.whole(body + shift)
    vertices[face.skin_slice] = face.finished(vertices[face.skin_slice])
    return np.concatenate([face.assembly.attach(vertices), joints_of(face, body + shift)]).ravel()
