"""The faces of simulated speakers: the rig's, or faces of flesh that no rig spans.

`rig` gives weights of the built-in head's shapes, exactly as the shipped models learned them;
`rich` gives vertices of `recipes.rich_faces`, each subject in a speaking style of the subject's
own; `people` are the same faces in the plain style, about which what people differ by was fitted to
talkers tracked in video (`recipes.talker_spread`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from elocute.articulation.driver import articulate
from elocute.articulation.style import STYLES
from elocute.audio.waveform import Waveform
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import resolve_identity
from elocute.speech.text.known_phones import posteriors_from_phones
from recipes.corpus.subjects import Subject
from recipes.encoder.store import LABEL_RATE
from recipes.encoder.synthesise import Phones
from recipes.rich_faces.rich_face import RichFace

KINDS = ("rich", "people", "rig")


def rig_weights(phones: Phones, duration_s: float, style: str, fps: float) -> np.ndarray:
    """(frame, component) weights of the built-in head for phones with known times."""
    head = load_builtin_head()
    curves = articulate(
        posteriors_from_phones(phones, duration_s, LABEL_RATE),
        LABEL_RATE,
        frame_count=max(1, round(duration_s * fps)),
        fps=fps,
        style=STYLES[style],
    )
    return curves.select(head.expression_names).values


class RigFaces:
    """Weights of the built-in head's shapes, the same shapes for every subject."""

    kind = "rig"

    def __init__(self, subjects: Sequence[Subject]) -> None:
        head = load_builtin_head()
        self.templates = {
            s.style: head.identity_template(resolve_identity(str(s.identity))).astype(np.float32)
            for s in subjects
        }
        self.basis: np.ndarray | None = head.expression_basis
        self.components = head.expression_names

    def frames(
        self, phones: Phones, sound: Waveform, style: str, name: str, fps: float
    ) -> np.ndarray:
        """(frame, component) weights for phones with known times."""
        return rig_weights(phones, sound.duration_s, style, fps)

    def of_weights(self, weights: np.ndarray, subject: str) -> np.ndarray:
        """Weights of the built-in head, as this corpus stores them."""
        return weights


class RichFaces:
    """Vertices of people with shapes, flesh and habits of their own; people by their identity."""

    basis = None
    components: tuple[str, ...] = ()

    def __init__(self, subjects: Sequence[Subject], kind: str = "rich") -> None:
        head, self.kind = load_builtin_head(), kind
        self.people = {
            s.style: RichFace(
                head,
                resolve_identity(str(s.identity)),
                STYLES[s.style if kind == "rich" else "plain"],
                seed=s.identity,
            )
            for s in subjects
        }
        self.templates = {name: person.template for name, person in self.people.items()}

    def frames(
        self, phones: Phones, sound: Waveform, style: str, name: str, fps: float
    ) -> np.ndarray:
        """(frame, vertex, 3) m for phones with known times; `name` makes takes differ."""
        take = self.people[style].take(
            posteriors_from_phones(phones, sound.duration_s, LABEL_RATE),
            LABEL_RATE,
            frame_count=round(sound.duration_s * fps),
            fps=fps,
            sound=sound,
            name=name,
        )
        return take.vertices()

    def of_weights(self, weights: np.ndarray, subject: str) -> np.ndarray:
        """Weights of the built-in head, as this corpus stores them."""
        basis = load_builtin_head().expression_basis
        return self.templates[subject] + np.tensordot(weights, basis, 1).astype(np.float32)


Faces = RigFaces | RichFaces


def open_faces(kind: str, subjects: Sequence[Subject]) -> Faces:
    """The faces of subjects, of a kind of `KINDS`."""
    return RigFaces(subjects) if kind == "rig" else RichFaces(subjects, kind)


def writer_options(faces: Faces) -> dict[str, Any]:
    """What `corpus_writer` is told of the mesh and the motion."""
    head = load_builtin_head()
    return {
        "basis": faces.basis,
        "components": faces.components,
        "faces": head.quads,
        "topology": head.name,
    }
