"""Gives a motion another face, or faces that change over time (VOCA 2019, section 4, Figure 7)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elocute.errors import MotionError
from elocute.head.builtin import load_builtin_head
from elocute.head.model import HeadModel
from elocute.head.shape_reach import shape_reach
from elocute.motion.edits.blinks import identity_columns, lid_scale
from elocute.motion.edits.keyframes import Keyframes, read_keyframes
from elocute.motion.motion import Motion, check_motion
from elocute.numerics.resampling import interpolate

SIDES = ("Left", "Right")


def with_identity(
    motion: Motion, coefficients: ArrayLike, *, space: HeadModel | None = None
) -> Motion:
    """The same motion on another face.

    Parameters
    ----------
    motion : Motion
        On a head with a known identity space.
    coefficients : (identity,)
        Standard deviations.
    space : HeadModel, optional
        The same head with its identities, where they did not travel with the motion.

    Returns
    -------
    Motion

    Raises
    ------
    MotionError
        Where the head's identity space is unknown or has fewer components.
    """
    return with_identity_over_time(motion, [(0.0, coefficients)], space=space)


def with_identity_over_time(
    motion: Motion, keyframes: Keyframes, *, space: HeadModel | None = None
) -> Motion:
    """A face that becomes another while it moves; linear between keyframes.

    Parameters
    ----------
    motion : Motion
        On a head with a known identity space. A stored motion has left its identity space behind;
        for the built-in head it is known.
    keyframes : [(time s, (identity,)), …]
        Coefficients in standard deviations. Called again, these replace the faces before.
    space : HeadModel, optional
        The same head with its identities, where they did not travel with the motion: a FLAME
        model as `elocute.adoption.open_speaking_head` opens it.

    Returns
    -------
    Motion
        Its template is the face of the first keyframe; the differences from it join the
        expression basis as `identity000`, `identity001`, …: the identity components that change
        or, where those are more, one difference for each further face. This is exact and
        low-rank. A weight of `eyeBlinkLeft` or `eyeBlinkRight` grows with the eye it has to close
        and may pass one.

    Raises
    ------
    MotionError
        For other heads without an identity space, more coefficients than it has, and malformed
        keyframes.

    Notes
    -----
    Skin tone and the places of the joints stay as the first keyframe has them. Joints of the named
    faces differ by up to 8 mm: under a turned head the last face is off by as much times the sine
    of the turn. Round lips fit the first face's mouth.

    References
    ----------
    VOCA 2019, section 4 and Figure 7.
    """
    check_motion(motion)
    times, values = read_keyframes(keyframes, "identity over time")
    motion = _without_identity_components(motion)
    mean = _identity_space(motion.head, space)
    known = len(mean.identity_basis)
    if values.shape[1] > known:
        raise MotionError.about(
            "identity over time",
            found=f"{values.shape[1]} coefficients",
            allowed=f"at most {known} on head {mean.name!r}",
        )
    face = replace(mean.with_identity(values[0].astype(np.float32)), look=motion.head.look)
    mixes, directions = _low_rank(values - values[0])
    if not directions.any():
        return replace(motion, head=face)
    basis = np.tensordot(directions, mean.identity_basis[: values.shape[1]], 1)
    names = tuple(f"identity{number:03d}" for number in range(len(directions)))
    head = replace(
        face,
        expression_names=(*face.expression_names, *names),
        expression_basis=np.concatenate([face.expression_basis, basis.astype(np.float32)]),
    )
    change = interpolate(times, mixes, motion.times_s).astype(np.float32)
    weights = np.concatenate([motion.weights, change], axis=1)
    return _lids_scaled(replace(motion, head=head, weights=weights))


def _low_rank(
    changes: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Weights (key, component) and directions (component, identity) whose product is `changes`.

    changes (key, identity); its first row is zero. A face that comes again costs nothing.
    """
    moving = np.flatnonzero(changes.any(axis=0))
    faces, which = np.unique(changes, axis=0, return_inverse=True)
    other = np.flatnonzero(faces.any(axis=1))
    if len(moving) <= len(other):
        return changes[:, moving], np.eye(changes.shape[1])[moving]
    return np.eye(len(faces))[which.ravel()][:, other], faces[other]


def _without_identity_components(motion: Motion) -> Motion:
    """The motion on the face of its template, for all its length."""
    columns = identity_columns(motion)
    if not columns:
        return motion
    plain = _lids_scaled(motion, back=True)
    kept = np.setdiff1d(np.arange(len(motion.names)), columns)
    head = replace(
        motion.head,
        expression_names=tuple(motion.names[column] for column in kept),
        expression_basis=motion.head.expression_basis[kept],
    )
    return replace(plain, head=head, weights=plain.weights[:, kept])


def _lids_scaled(motion: Motion, *, back: bool = False) -> Motion:
    weights = motion.weights.copy()
    for side in SIDES:
        if f"eyeBlink{side}" in motion.names:
            scale = lid_scale(motion, side.lower())
            weights[:, motion.names.index(f"eyeBlink{side}")] *= 1 / scale if back else scale
    return replace(motion, weights=weights)


def _identity_space(head: HeadModel, space: HeadModel | None) -> HeadModel:
    """The head as its identity space's mean face, with the shapes that it has."""
    if len(head.identity_basis):
        return head
    known = load_builtin_head() if space is None else space
    if head.name != known.name or not np.array_equal(head.quads, known.quads):
        raise MotionError.about(
            f"head {head.name!r}",
            found="its identity space did not travel with the motion",
            allowed=f"motions of head {known.name!r}, or of a head loaded with its identities",
            remedy="" if space else "`head` names the file that it was made from",
        )
    if not len(known.identity_basis):
        raise MotionError.about(
            f"head {known.name!r}", found="no identities", allowed="a head with them"
        )
    basis = head.expression_basis.copy()
    # Blinks and round lips fit this face: give them the mean face's reach again.
    for name, factors in shape_reach(head, known.template).items():
        basis[head.expression_index(name)] *= factors
    return replace(
        head,
        template=known.template,
        expression_basis=basis,
        joint_positions=known.joint_positions,
        identity_basis=known.identity_basis,
        joint_identity_basis=known.joint_identity_basis,
        tone_basis=known.tone_basis,
        trait_basis=known.trait_basis,
        vertex_color=known.vertex_color,
    )
