"""The identity basis: principal components of random adults with sealed lips."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elocute.head import HeadModel
from elocute.numerics.ridge import ridge_coefficients
from recipes.head.face import NeutralFace
from recipes.head.population import Traits, random_adult, tone_of

JOINTS = ("neck01____head", "head____head", "jaw____head", "eye.L____head", "eye.R____head")
JOINT_NAMES = ("neck", "head", "jaw", "eyeLeft", "eyeRight")
JOINT_PARENTS = (-1, 0, 1, 1, 1)


RIDGE = 4.0


@dataclass(frozen=True, eq=False)
class IdentityBasis:
    vertices: np.ndarray  # (component, vertex, 3) m per standard deviation
    joints: np.ndarray  # (component, joint, 3)
    tone: np.ndarray  # (1 + component,) mean skin tone, then its slope
    traits: np.ndarray  # (2, 1 + component) sex (0 woman, 1 man) and age in years, in the same way


def joints_of(face: NeutralFace, body: np.ndarray) -> np.ndarray:
    return np.stack([face.mh.joint(name, body) for name in JOINTS])


def identity_basis(
    face: NeutralFace, people: int = 600, components: int = 50, held_out: int = 30, seed: int = 0
) -> IdentityBasis:
    rng = np.random.default_rng(seed)
    drawn = [random_adult(face.mh, rng) for _ in range(people + held_out)]
    rows = np.stack([person_row(face, body) for body, _ in drawn]).astype(np.float32)
    everyone = [traits for _, traits in drawn[:people]]
    known, unknown = rows[:people], rows[people:]
    mean = known.mean(0)
    # 600 people, 25,000 numbers each: the small side of the matrix is decomposed.
    centred = known - mean
    values, vectors = np.linalg.eigh((centred @ centred.T).astype(np.float64))
    order = np.argsort(values)[::-1][:components]
    basis = vectors[:, order].T @ centred / np.sqrt(values[order])[:, None]
    spread = np.sqrt(values[order] / (people - 1))
    coefficients = centred @ basis.T / spread
    rest = unknown - mean
    missed = (rest - (rest @ basis.T) @ basis).reshape(held_out, -1, 3)
    held_out_m = np.linalg.norm(missed[:, face.skin_slice], axis=2).mean()
    explained = values[order].sum() / values.sum()
    print(f"identity: {explained:.4f} of variance, held out {held_out_m * 1e3:.2f} mm")
    scaled = (basis * spread[:, None]).reshape(components, -1, 3)
    return IdentityBasis(
        vertices=scaled[:, : face.assembly.count],
        joints=scaled[:, face.assembly.count :],
        tone=_regression(coefficients, tone_of(Traits()), [tone_of(one) for one in everyone]),
        traits=np.stack(
            [
                _regression(coefficients, Traits().male, [one.male for one in everyone]),
                _regression(coefficients, Traits().years, [one.years for one in everyone]),
            ]
        ),
    )


def identity_of(head: HeadModel) -> IdentityBasis:
    """That of a head built earlier. A basis sampled anew, of a face that has changed a little, has
    components that are turned among each other: its seeds would be other people."""
    return IdentityBasis(
        vertices=head.identity_basis.astype(float),
        joints=head.joint_identity_basis.astype(float),
        tone=head.tone_basis.astype(float),
        traits=head.trait_basis.astype(float),
    )


def fitted(face: NeutralFace, identity: IdentityBasis, body: np.ndarray) -> np.ndarray:
    """(component,) coefficients that come closest to a body, mildly drawn to the mean."""
    offset = person_row(face, body) - person_row(face, face.body)
    whole = np.concatenate([identity.vertices, identity.joints], 1)
    rows = whole.reshape(len(whole), -1)
    return ridge_coefficients(rows, offset, RIDGE * 1e-4)


def person_row(face: NeutralFace, body: np.ndarray, moved: np.ndarray | float = 0.0) -> np.ndarray:
    """Vertices and joints of one adult, whose skin is moved besides: placed like the template,
    and finished like it."""
    upper = face.skin[:, 1] > face.skin[:, 1].mean()
    shift = (face.skin - face.anatomy.skin(body))[upper].mean(0)
    whole = face.person(body + shift, moved)
    return np.concatenate([whole, joints_of(face, body + shift)]).ravel()


def _regression(coefficients: np.ndarray, template: float, values: list[float]) -> np.ndarray:
    """A trait of the template, from which coefficients count, and its ridge slope over the
    coefficients (which are standardised)."""
    apart = np.array(values) - np.mean(values)
    return np.r_[template, coefficients.T @ apart / (len(apart) + RIDGE)]
