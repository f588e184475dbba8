"""Scores the same speech on many faces: do the lips close, and stay out of the teeth?"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, fields, replace

import numpy as np

from elocute.array_types import Float64Array
from elocute.articulation.contacts_and_rest import runs
from elocute.audio.waveform import Waveform
from elocute.encoders.phones_and_visemes import BILABIALS, PHONES
from elocute.encoders.registry import resolve_encoder
from elocute.errors import HeadError, InputError
from elocute.evaluation.lip_closures import CLOSED_MM, TOLERANCE_S, short_runs
from elocute.evaluation.lip_penetration import lip_contact
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import sample_identities
from elocute.head.model import HeadModel
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import measure_mouth

HEARD = 0.5  # posterior of p, b and m together from which they count as heard
LIP_DEPTH_MAX_MM = 3.0  # lips that are pressed together flatten by up to half of it each
TOOTH_DEPTH_MAX_MM = 1.0

Stretch = tuple[float, float]
"""Start and end of a closure, s."""


@dataclass(frozen=True)
class FaceScore:
    """The mouth of one face that says the speech.

    Attributes
    ----------
    closures : int
        Times at which the lips should be sealed.
    sealed : int
        Those at which the lips of this face are: an opening below `CLOSED_MM` nowhere along them,
        up to `TOLERANCE_S` before or after.
    widest_gap_mm : float
        Of the closures the one that leaves most open: its opening at its narrowest moment, mm.
    lip_depth_mm, tooth_depth_mm : float
        How deep a lip lies in the other one, and in a tooth, at most, mm.
    mean_opening_mm, peak_opening_mm : float
        Over the whole speech, mm.
    width_range_mm : float
        Range of the distance between the mouth corners, mm.
    """

    closures: int
    sealed: int
    widest_gap_mm: float
    lip_depth_mm: float
    tooth_depth_mm: float
    mean_opening_mm: float
    peak_opening_mm: float
    width_range_mm: float

    @property
    def faults(self) -> tuple[str, ...]:
        """What is wrong with this face: "open at p, b, m", "lip in lip", "lip in tooth"."""
        wrong = {
            "open at p, b, m": self.sealed < self.closures,
            "lip in lip": self.lip_depth_mm > LIP_DEPTH_MAX_MM,
            "lip in tooth": self.tooth_depth_mm > TOOTH_DEPTH_MAX_MM,
        }
        return tuple(name for name, is_wrong in wrong.items() if is_wrong)

    @property
    def severity(self) -> float:
        """How far the worst measure is from its limit: above 1 is a fault."""
        return max(
            self.widest_gap_mm / CLOSED_MM,
            self.lip_depth_mm / LIP_DEPTH_MAX_MM,
            self.tooth_depth_mm / TOOTH_DEPTH_MAX_MM,
        )


def heard_closures(speech: Waveform) -> list[Stretch]:
    """Find where p, b and m are heard in speech: there the lips should be sealed.

    Parameters
    ----------
    speech : Waveform
        The speech.

    Returns
    -------
    list of (float, float)
        Start and end of each, s.
    """
    heard = resolve_encoder("phones")(speech)
    posterior = np.exp(heard.values[:, [PHONES.index(phone) for phone in BILABIALS]]).sum(axis=1)
    return [(a / heard.rate, b / heard.rate) for a, b in runs(posterior > HEARD)]


def own_closures(motion: Motion) -> list[Stretch]:
    """Find where a motion closes the lips of its own face for a short while.

    Parameters
    ----------
    motion : Motion
        On a head with lips.

    Returns
    -------
    list of (float, float)
        Start and end of each, s.

    Raises
    ------
    HeadError
        For a head without lips.
    """
    closed = measure_mouth(motion)["opening_mm"] < CLOSED_MM
    return [(a / motion.fps, b / motion.fps) for a, b in short_runs(closed, motion.fps)]


def random_faces(motion: Motion, count: int, seed: int) -> Iterable[HeadModel]:
    """Random faces of the built-in head that a motion can move.

    Parameters
    ----------
    motion : Motion
        In the topology of the built-in head.
    count : int
        How many faces.
    seed : int
        The same seed gives the same faces.

    Returns
    -------
    iterable of HeadModel
        Made one after another.

    Raises
    ------
    HeadError
        For an unusable count or seed.
    """
    coefficients = sample_identities(load_builtin_head(), count, seed)
    return faces_of(motion, coefficients)


def faces_of(motion: Motion, coefficients: Iterable[np.ndarray]) -> Iterable[HeadModel]:
    """Faces of the built-in head that a motion can move, made one after another.

    Parameters
    ----------
    motion : Motion
        In the topology of the built-in head.
    coefficients : iterable of (identity,) float32
        Standard deviations of each face.

    Returns
    -------
    iterable of HeadModel
        With the motion's own shapes, where these are not the built-in ones.

    Raises
    ------
    InputError
        For a motion of another topology.
    """
    head = load_builtin_head()
    if motion.head.vertex_count != head.vertex_count:
        raise InputError.about(
            f"head {motion.head.name!r}",
            found="no identity space",
            allowed="a motion of the built-in topology",
        )
    return (_with_shapes_of(motion, head.with_identity(each)) for each in coefficients)


def _with_shapes_of(motion: Motion, face: HeadModel) -> HeadModel:
    if motion.names == face.expression_names:
        return face
    basis = motion.head.expression_basis
    return replace(face, expression_names=motion.names, expression_basis=basis)


def face_scores(
    motion: Motion, faces: Iterable[HeadModel], closures: Sequence[Stretch]
) -> list[FaceScore]:
    """Score the same motion on many faces, each by its own lips and teeth.

    Parameters
    ----------
    motion : Motion
        The motion; joint rotations are left out.
    faces : iterable of HeadModel
        With the motion's shapes, as `random_faces` and `faces_of` give them.
    closures : sequence of (float, float)
        Start and end of the times at which lips should be sealed, s.

    Returns
    -------
    list of FaceScore
        One for each face.

    Raises
    ------
    HeadError
        For a face that does not say where its lips and teeth are, or has other shapes.
    """
    return [_face_score(motion, face, closures) for face in faces]


def _face_score(motion: Motion, face: HeadModel, closures: Sequence[Stretch]) -> FaceScore:
    if face.expression_names != motion.names:
        raise HeadError.about(
            f"head {face.name!r}", found="other shapes", allowed="those that the motion weighs"
        )
    moved = replace(motion, head=face, rotations=None)
    contact, measures = lip_contact(moved), measure_mouth(moved)
    gaps = _gaps_at(contact.gap_mm, closures, motion.fps)
    opening, width = measures["opening_mm"], measures["width_mm"]
    return FaceScore(
        closures=len(gaps),
        sealed=sum(gap < CLOSED_MM for gap in gaps),
        widest_gap_mm=max(0.0, *gaps) if gaps else 0.0,
        lip_depth_mm=float(contact.lip_depth_mm.max()),
        tooth_depth_mm=float(contact.tooth_depth_mm.max()),
        mean_opening_mm=float(opening.mean()),
        peak_opening_mm=float(opening.max()),
        width_range_mm=float(np.ptp(width)),
    )


def _gaps_at(gap_mm: Float64Array, closures: Sequence[Stretch], fps: float) -> list[float]:
    """The narrowest opening during each closure or up to `TOLERANCE_S` away, mm."""
    near = round(TOLERANCE_S * fps)
    stretches = [
        gap_mm[max(0, round(start * fps) - near) : round(end * fps) + near + 1]
        for start, end in closures
    ]
    return [float(stretch.min()) for stretch in stretches if len(stretch)]


def face_score_spread(scores: Sequence[FaceScore]) -> dict[str, dict[str, float]]:
    """Of each measure `mean`, `deviation`, `least` and `greatest` over one face or more."""
    table = {}
    for name in (field.name for field in fields(FaceScore)):
        values = np.array([asdict(score)[name] for score in scores], np.float64)
        table[name] = {
            "mean": float(values.mean()),
            "deviation": float(values.std()),
            "least": float(values.min()),
            "greatest": float(values.max()),
        }
    return table
