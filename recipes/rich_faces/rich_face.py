"""One person's face: phones and sound in, vertices out that no rig of the package spans."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from elocute.array_types import Float32Array, Float64Array, FloatArray, IntArray
from elocute.articulation.style import Style, resolve_style
from elocute.audio.waveform import Waveform
from elocute.encoders.phone_encoder import PhonePosteriors
from elocute.encoders.phones_and_visemes import PHONES, SILENCE
from elocute.errors import CaptureError
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import resolve_identity
from elocute.head.model import HeadModel
from elocute.head.normals import vertex_normals
from elocute.motion.curves import Curves
from elocute.numerics.quaternions import from_axis_angle, no_turn
from elocute.numerics.resampling import frames_in
from elocute.one_line_repr import one_line
from elocute.settings import check_settings, described, setting
from recipes.rich_faces import own_shapes, skin_and_jaw
from recipes.rich_faces.face_places import FacePlaces, face_places
from recipes.rich_faces.flesh import FLESH, flesh_masks, lagging
from recipes.rich_faces.habits import draw_habits, habit_names, speak
from recipes.rich_faces.lip_contact import LipContact, lip_contact, rig_gaps
from recipes.rich_faces.pauses import (
    PRESSED,
    breath_weights,
    draw_pause_habits,
    pause_fields,
    pauses,
    swallow_weights,
)
from recipes.rich_faces.prosody import (
    BROWS,
    accents,
    brow_weights,
    draw_gestures,
    head_turns,
)
from recipes.rich_faces.teeth import rigid_motion

BLOCK_FRAMES = 128
VOWELS = tuple(p for p in PHONES if p[0] in "AEIOU")
CHIN = 8  # iBUG 68: the lowest point of the jaw line
LEANING = 0.4  # of the head's turn that the neck has


@described
@dataclass(frozen=True)
class FaceRichness:
    """What the face of a simulated speaker has beyond the shapes of a rig.

    0 leaves a thing out; at 1 each person has it to an extent of the person's own.

    Raises
    ------
    CaptureError
        For a number outside its range.
    """

    own_shapes: float = setting(
        1.0, low=0.0, high=2.0, help="A person's own pattern, amount and path of each shape."
    )
    habits: float = setting(
        1.0, low=0.0, high=2.0, help="A person's own targets and timing of each phone."
    )
    flesh: float = setting(
        1.0, low=0.0, high=2.0, help="Lag and inertia of cheeks, chin and under-jaw."
    )
    slide: float = setting(1.0, low=0.0, high=2.0, help="Skin that slides over jaw and cheeks.")
    lip_bulge: float = setting(
        1.0, low=0.0, high=2.0, help="How much of what lips press away comes out on them."
    )
    swallowing: float = setting(1.0, low=0.0, high=2.0, help="Swallowing in pauses.")
    breathing: float = setting(1.0, low=0.0, high=2.0, help="Nostrils, throat and collar.")
    prosody: float = setting(1.0, low=0.0, high=2.0, help="Head and brow with the stress.")

    def __post_init__(self) -> None:
        check_settings(self, CaptureError)


@dataclass(frozen=True, eq=False)
class RichTake:
    """What a person did in one take.

    Attributes
    ----------
    face
        Whose.
    curves
        What the rig of the built-in head would have been told.
    weights
        (frame, field) of all linear fields of the face.
    flesh
        (place, frame, field) how far the flesh of each place is ahead of them.
    rotations
        (frame, joint, 4) unit quaternions wxyz, head and neck with the prosody; vertices are in
        zero pose.
    fps
        Frames per second.
    """

    face: RichFace
    curves: Curves
    weights: Float64Array
    flesh: Float64Array
    rotations: Float32Array
    fps: float

    __repr__ = one_line

    @property
    def head(self) -> HeadModel:
        """The person's head, whose template is the neutral face."""
        return self.face.own_head

    @property
    def frame_count(self) -> int:
        return len(self.weights)

    @property
    def duration_s(self) -> float:
        return self.frame_count / self.fps

    def vertices(self, start: int = 0, stop: int | None = None) -> Float32Array:
        """(frame, vertex, 3) float32 m in zero pose."""
        stop = self.frame_count if stop is None else min(stop, self.frame_count)
        blocks = [
            self._block(slice(at, min(at + BLOCK_FRAMES, stop)))
            for at in range(start, stop, BLOCK_FRAMES)
        ]
        return np.concatenate(blocks)

    def _block(self, frames: slice) -> Float32Array:
        face = self.face
        moved = face.moved(self.weights[frames], self.flesh[:, frames])
        weights = self.curves.values[frames].astype(np.float64)
        return face.placed(moved, weights)


class RichFace:
    """A person whose face is made of flesh.

    Parameters
    ----------
    head : HeadModel
        The built-in head, without an identity.
    identity : (identity,)
        The person's face, standard deviations.
    style : Style
        How the person articulates, about which the habits are drawn.
    richness : FaceRichness
        What there is, and how much of it.
    seed : int
        The same seed gives the same person.

    Attributes
    ----------
    template : (vertex, 3) float32
        The neutral face, m: its lips touch and do not overlap.
    """

    def __init__(
        self,
        head: HeadModel,
        identity: FloatArray,
        style: Style,
        richness: FaceRichness | None = None,
        seed: int = 0,
    ) -> None:
        self.head, self.seed = head, seed
        self.identity = np.asarray(identity, np.float32)
        self.richness = own_extent(richness or FaceRichness(), seed)
        self.places: FacePlaces = face_places(head)
        self.bare: Float64Array = head.identity_template(self.identity).astype(np.float64)
        self.habits = draw_habits(style, self.richness.habits, seed)
        self.gestures = draw_gestures(self.richness.prosody, seed)
        self.pause_habits = draw_pause_habits(
            self.richness.swallowing, self.richness.breathing, seed
        )
        rng = np.random.default_rng((seed, 40))
        self.contact: LipContact = lip_contact(
            head, self.bare, float(rng.uniform(0.3, 0.5)), self.richness.lip_bulge
        )
        self._draw_flesh(rng)
        self._draw_jaw(rng)
        nothing = np.zeros((1, len(head.expression_names)))
        self.template: Float32Array = self.placed(
            np.zeros((1, *self.bare.shape), np.float32), nothing
        )[0]

    def _draw_flesh(self, rng: np.random.Generator) -> None:
        calm = skin_and_jaw.off_the_lips(self.head, self.places)
        loose = self.richness.flesh * np.exp(0.25 * rng.normal(size=len(FLESH)))
        masks = np.minimum(flesh_masks(self.places, calm) * loose[:, None], 0.85)
        pace = np.exp(0.12 * rng.normal() + 0.06 * rng.normal(size=len(FLESH)))
        self.hertz = np.array([flesh.hertz for flesh in FLESH]) * pace
        self.damping = np.clip(
            [flesh.damping * np.exp(0.15 * rng.normal()) for flesh in FLESH], 0.2, 0.9
        )
        self.loose = [
            (where, mask[where]) for mask in masks for where in [np.flatnonzero(mask > 0.004)]
        ]

    def _draw_jaw(self, rng: np.random.Generator) -> None:
        strength = self.richness.own_shapes
        aside, crooked, forward, lean = strength * rng.normal(size=4)
        self.jaw_path = skin_and_jaw.JawPath(
            0.0011 * aside, 0.0009 * crooked, 0.0012 * forward, np.radians(0.6) * lean
        )
        self.sliding = np.array([0.35, 0.35, 0.45]) * self.richness.slide
        self.sliding *= np.exp(0.3 * rng.normal(size=3))

    @cached_property
    def jaw_bone(self) -> IntArray:
        """Lower teeth and gums: what is one piece with the jaw."""
        return np.concatenate([self.head.regions[name] for name in ("teeth_lower", "gums_lower")])

    @cached_property
    def own_head(self) -> HeadModel:
        """The built-in head with this person's neutral face, colours and joints."""
        return replace(self.head.with_identity(self.identity), template=self.template)

    @cached_property
    def shape_names(self) -> tuple[str, ...]:
        """Shapes that this face moves by."""
        used = {*habit_names(), *BROWS, *PRESSED}
        return tuple(name for name in self.head.expression_names if name in used)

    @cached_property
    def fields(self) -> Float32Array:
        """(field, vertex, 3) m: shapes, shapes together, jaw, pauses, slides, turns of the head.

        The last three move nothing by themselves: only flesh lags behind them.
        """
        head, places = self.head, self.places
        normals = vertex_normals(self.bare, head.triangles)
        own = own_shapes.own_versions(
            head, places, self.shape_names, self.richness.own_shapes, 0.15, self.seed
        )
        common = own_shapes.common_fields(head, places, self.richness.own_shapes, self.seed)
        jaw = skin_and_jaw.jaw_fields(head, self.bare)
        slides = skin_and_jaw.slide_fields(head, places, normals, self.sliding)
        pause = pause_fields(places, normals)
        away = self.bare - head.joint_positions[head.joint_names.index("head")]
        turns = np.cross(np.eye(3)[:, None], away[None]) * places.soft[:, None]
        return np.concatenate([own, common, jaw, pause, slides, turns]).astype(np.float32)

    def take(
        self,
        log_posteriors: FloatArray,
        rate: float,
        *,
        frame_count: int,
        fps: float,
        sound: Waveform | None = None,
        name: str = "",
    ) -> RichTake:
        """Say something.

        Parameters
        ----------
        log_posteriors : (row, 40)
            Natural logarithms in the order of PHONES, `rate` rows a second.
        rate : float
            Rows per second.
        frame_count, fps : int, float
            Frames, and how many a second.
        sound : Waveform, optional
            Whose stress head and brow go with; vowels alone count without it.
        name : str
            The same name gives the same take: no two takes are alike.

        Returns
        -------
        RichTake
        """
        rng = np.random.default_rng((self.seed, 50, *name.encode()))
        times = np.arange(frame_count) / fps
        posteriors = np.exp(np.asarray(log_posteriors, np.float64))
        voiced = posteriors[:, [PHONES.index(p) for p in VOWELS]].sum(axis=1)
        stretches = pauses(posteriors[:, SILENCE], rate)
        curves = speak(self.habits, log_posteriors, rate, frame_count, fps, rng)
        table = dict(zip(curves.names, curves.values.T.astype(np.float64), strict=True))
        accent = accents(sound, voiced, rate, times)
        for shape, weight in brow_weights(self.gestures, accent, fps, rng).items():
            table[shape] = weight
        swallow, pressed = swallow_weights(self.pause_habits, stretches, times, rng)
        for shape, weight in PRESSED.items():
            table[shape] = np.maximum(table[shape], weight * pressed)
        breath = breath_weights(self.pause_habits, stretches, times, rng)
        turns = head_turns(self.gestures, accent, fps, rng)
        shapes = np.stack([table[each] for each in self.shape_names], axis=1)
        weights = self._weights(shapes, np.concatenate([swallow, breath], axis=1), turns)
        settled = lagging(weights, fps, self.hertz, self.damping) - weights
        whole = Curves(
            np.stack([table.get(n, np.zeros(frame_count)) for n in self.head.expression_names], 1),
            self.head.expression_names,
            fps,
        )
        return RichTake(self, whole, weights, settled, self._joints(turns), fps)

    def _weights(
        self, shapes: Float64Array, pause: Float64Array, turns: Float64Array
    ) -> Float64Array:
        """(frame, field) of shapes (frame, shape), fields of pauses and turns of the head."""
        names = self.shape_names
        jaw = skin_and_jaw.jaw_weights(shapes[:, names.index("jawOpen")], self.jaw_path)
        moved = np.concatenate([shapes, own_shapes.common_weights(shapes, names), jaw], axis=1)
        corners = self.head.outer_corners
        places = [int(corners[1]), int(corners[0]), int(self.head.landmarks[CHIN])]
        at = np.tensordot(moved, self.fields[: moved.shape[1], places].astype(np.float64), 1)
        slides = skin_and_jaw.slide_weights(at[:, 0], at[:, 1], at[:, 2])
        return np.concatenate([moved, pause, slides, turns], axis=1)

    def _joints(self, turns: Float64Array) -> Float32Array:
        joints = no_turn(len(turns), len(self.head.joint_names)).astype(np.float32)
        for name, share in (("neck", LEANING), ("head", 1 - LEANING)):
            joints[:, self.head.joint_names.index(name)] = from_axis_angle(share * turns)
        return joints

    def moved(self, weights: Float64Array, flesh: Float64Array) -> Float32Array:
        """(frame, vertex, 3) m of weights (frame, field) and flesh (place, frame, field)."""
        linear = weights.astype(np.float32)[:, :-3]
        out = np.tensordot(linear, self.fields[:-3], 1)
        for (where, mask), ahead in zip(self.loose, flesh.astype(np.float32), strict=True):
            swung = np.tensordot(ahead, self.fields[:, where], 1)
            out[:, where] += mask.astype(np.float32)[:, None] * swung
        return out

    def placed(self, moved: Float32Array, weights: Float64Array) -> Float32Array:
        """Vertices of displacements (frame, vertex, 3) m; weights (frame, expression) of the rig,
        which say when lips are closed."""
        vertices = self.bare + moved
        bone, contact = self.jaw_bone, self.contact
        # A sum of shapes bends what turns; bone does not.
        turns, shifts = rigid_motion(self.bare[bone], vertices[:, bone])
        vertices[:, bone] = np.einsum("fab,pb->fpa", turns, self.bare[bone]) + shifts[:, None]
        vertices[:, contact.vertices] = contact.settled(
            vertices[:, contact.vertices],
            rig_gaps(self.head, self.bare, weights),
            np.clip(weights[:, self.head.expression_index("mouthLabiodental")] / 0.6, 0, 1),
            (turns, shifts),
        )
        return vertices.astype(np.float32)


def take_from_sound(
    sound: Waveform,
    *,
    fps: float = 60.0,
    seconds: float | None = None,
    identity: str = "mean",
    style: str | Style = "plain",
    richness: FaceRichness | None = None,
    seed: int = 0,
) -> RichTake:
    """A person of flesh says what is in a recording.

    Parameters
    ----------
    sound : Waveform
        The recording; the built-in encoder hears its phones.
    fps : float
        Frames per second.
    seconds : float, optional
        Only so much from the start.
    identity : str
        A face of the built-in head.
    style : str or Style
        How the person articulates.
    richness : FaceRichness, optional
        What the face has, and how much of it.
    seed : int
        The same seed gives the same person and the same take.

    Returns
    -------
    RichTake
    """
    heard = PhonePosteriors()(sound)
    person = RichFace(
        load_builtin_head(), resolve_identity(identity), resolve_style(style), richness, seed
    )
    duration_s = sound.duration_s if seconds is None else min(seconds, sound.duration_s)
    return person.take(
        heard.values, heard.rate, frame_count=frames_in(duration_s, fps), fps=fps, sound=sound
    )


def own_extent(richness: FaceRichness, seed: int) -> FaceRichness:
    """How much of each a person has, about what is asked for."""
    rng = np.random.default_rng((seed, 60))
    drawn = {
        each.name: float(min(2.0, getattr(richness, each.name) * np.exp(0.2 * rng.normal())))
        for each in fields(richness)
    }
    return FaceRichness(**drawn)
