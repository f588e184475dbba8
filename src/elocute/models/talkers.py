"""The model learned from many talkers: a mouth straight from the sound.

The trunk hears what people's mouths do (`encoders.trunk`), and which phones are said. The rules of
articulation say which shapes those phones want; the mouth that was heard says how far they open,
spread and lower the jaw. It is turned into the same curves through the head's measured response, so
that lips open on the head by as many millimetres. Contacts are decoded over a phrase and come last;
rest is a matter of style and of the length of a pause.

ONNX alone, no torch. Nothing in the file is executed but the network.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np

from elocute.array_types import Float32Array, Float64Array, FloatArray
from elocute.articulation.coarticulation import DIPHTHONG_S, REACH_S
from elocute.articulation.contact_decoding import (
    AT_TEETH,
    POOLS,
    SEALED,
    Contact,
    contact_states,
    contact_track,
    decoded_contacts,
    known_contacts,
)
from elocute.articulation.contacts_and_rest import contact_evidence
from elocute.articulation.driver import (
    FRAME_S,
    LOOKAHEAD_S,
    articulate,
    finish_decoded,
)
from elocute.articulation.mouth_solver import ROUNDED, AskedMouth, mouth_curves
from elocute.articulation.phone_targets import curve_names
from elocute.articulation.rest import (
    EDGE_S,
    KNOWN_EDGE_S,
    breath_share,
    live_rest_share,
    rest_share,
)
from elocute.articulation.style import Style
from elocute.audio.resampling_stream import RESAMPLING_S
from elocute.encoders.phones_and_visemes import PHONES, SILENCE
from elocute.encoders.protocol import FEATURE_RATE
from elocute.encoders.trunk import (
    KIND,
    MOUTH_FIELDS,
    SHIPPED_PATH,
    TrunkNetwork,
    builtin_trunk,
    trunk_lookahead_s,
)
from elocute.errors import ModelError
from elocute.models.feature_extraction import HeardMouth, Hearing
from elocute.models.model_file import check_file
from elocute.models.protocol import FeatureStreams, FrameSpan, SoundLevel, SpeechFeatures
from elocute.models.rule_styles import StyledAsRules
from elocute.motion.curves import Curves
from elocute.motion.mouth_measures import TRACKED_MEASURES
from elocute.motion.mouth_response import (
    builtin_response,
)
from elocute.numerics.resampling import frame_places, read_rows

SHIPPED = "talkers"
SIZES_PATH = Path(__file__).parent / "assets" / "mouth_sizes.json"
OPENING = TRACKED_MEASURES.index("opening_mm")
TEMPO_ROWS = 5  # that a style's tempo looks at on both sides
UNHEARD = (0.5, 0.9)  # of silence in the sound, beside which known phones move as the rules say
PARTED_MM, NEARLY_MM = 1.0, 0.6  # lips in speech come no nearer; where a p may have been heard
MAYBE = 0.15  # evidence of p, b or m with which lips may come as near as that
HISSED = ("S", "Z", "SH", "ZH", "CH", "JH")
BEYOND = 0.4  # of its slope, with which the map goes on above its last knot: lips stretch no more
STIFF_JAW = 0.8  # of its freedom that a jaw loses in them: teeth meet, and lips do the rest
RESTS, STILL_ROWS = 0.5, 2.0  # how far jaw and corners rest where lips do; blur of stillness
SLOWER_ROWS, SLOWEST_ROWS = 1.6, 2.2  # blur of movements twice as slow as plain ones, and the most
SHARPER = 0.9  # share of the difference from a blur that is added where they are twice as fast
ROUNDED_SHARE = 0.2  # of the rules' width where they round the lips fully
KNOWN_ROUNDED = 0.75  # of full rounding, from which all of it, where phones are known


@dataclass(frozen=True, eq=False)
class MouthSizes:
    """How far people's mouths move on the built-in head, from what a trunk tells.

    Parameters
    ----------
    middle_mm, spread_mm : (measure,) float64
        Of `TRACKED_MEASURES`: where speech lies, and a deviation of it, mm.
    opening_map : (2, knot) float64
        The trunk's opening, rising, and what it is in mm.
    """

    middle_mm: Float64Array
    spread_mm: Float64Array
    opening_map: Float64Array


@cache
def mouth_sizes() -> MouthSizes:
    """The sizes that `recipes.train_trunk ship` measured on people."""
    stored = json.loads(SIZES_PATH.read_text(encoding="utf-8"))
    return MouthSizes(**{name: np.array(values, np.float64) for name, values in stored.items()})


class TalkersModel(StyledAsRules):
    """The model of many talkers that ships (`talkers`), or one from a file, as a SpeechModel.

    Parameters
    ----------
    path : str or Path
        "talkers", or an .onnx that `recipes.train_trunk` wrote.
    session : onnxruntime.InferenceSession, optional
        Of the same file, where it was opened before.

    Raises
    ------
    ModelError
        For a file that is missing or too large; when the network is first used, for one that is no
        trunk.
    """

    kind = KIND
    fps = FEATURE_RATE
    decoder_lookahead_s = max(
        LOOKAHEAD_S, FRAME_S + REACH_S + DIPHTHONG_S + (TEMPO_ROWS + 1) / FEATURE_RATE
    )

    def __init__(self, path: str | Path = SHIPPED, session: Any = None) -> None:
        self.path = SHIPPED_PATH if str(path) == SHIPPED else Path(path)
        self._opened = session
        check_file(self.path, "make one: python -m recipes.train_trunk")

    @cached_property
    def network(self) -> TrunkNetwork:
        """The trunk that tells mouth and phones."""
        if self.path == SHIPPED_PATH and self._opened is None:
            return builtin_trunk()
        return TrunkNetwork(self.path, self._opened)

    @property
    def name(self) -> str:
        return self.path.name

    @property
    def lookahead_s(self) -> float:
        return RESAMPLING_S + trunk_lookahead_s(self.network) + self.decoder_lookahead_s

    @property
    def live_lookahead_s(self) -> float:
        between_rows_s = 1 / FEATURE_RATE
        return trunk_lookahead_s(self.network, live=True) + between_rows_s

    def feature_streams(
        self,
        sample_rate: int,
        *,
        contacts: bool = True,
        level: SoundLevel | None = None,
        live: bool = False,
    ) -> FeatureStreams:
        hearing = Hearing(self.network, sample_rate, live=live)
        coming = hearing.coming_phones if live else None
        return FeatureStreams(HeardMouth(hearing), hearing.phones, coming)

    def curves(
        self,
        speech: SpeechFeatures,
        style: Style,
        span: FrameSpan,
        strength: float = 1.0,
        *,
        contacts: bool = True,
    ) -> Curves:
        """Curves 0…1 of every shape that speech uses.

        Without contacts, the mouth as it was heard: nothing closes the lips on p, b and m, holds
        the lower lip at the teeth on f and v, or brings the mouth to rest in a pause.
        """
        phones = speech.phones or speech.features
        times = np.arange(span.first, span.first + span.count) / span.fps
        last_row = phones.first + len(phones.values) - 1
        begin = max(phones.first, math.floor(times[0] * phones.rate) - TEMPO_ROWS)
        stop = max(begin, min(last_row, math.ceil(times[-1] * phones.rate) + TEMPO_ROWS)) + 1
        near = slice(begin - phones.first, stop - phones.first)
        posteriors = np.exp(phones.values)
        rules = rule_curves(phones.values, phones.first, begin, stop - begin)
        told = self._told(speech, rules, begin)
        rest = breath = np.zeros(stop - begin)
        if contacts:
            silence, starts = posteriors[:, SILENCE], phones.first == 0
            edge_s = KNOWN_EDGE_S if speech.known else EDGE_S
            if speech.live:
                rest = live_rest_share(silence, phones.rate)[near]
            else:
                rest = rest_share(silence, phones.rate, starts=starts, edge_s=edge_s)[near]
                breath = breath_share(silence, phones.rate, starts=starts, edge_s=edge_s)[near]
        since_first = times - phones.first / phones.rate
        row_times = np.arange(begin - phones.first, stop - phones.first) / phones.rate
        met = _contacts(speech, posteriors) if contacts else {SEALED: [], AT_TEETH: []}
        asked = AskedMouth(
            wanted_mm=self._wanted_mm(told, style),
            rounding=_rounding(rules, known=speech.known),
            parted_mm=_parted_mm(posteriors)[near] if contacts else np.full(len(rest), NEARLY_MM),
            stiff=STIFF_JAW * _heard(posteriors, HISSED)[near],
            rest=rest,
            settled=rest * self._settling(speech, begin, len(rules)),
            breath=breath,
            sealed=contact_track(met[SEALED], row_times),
            at_teeth=contact_track(met[AT_TEETH], row_times),
        )
        rows = mouth_curves(rules, asked, style, strength)
        places = frame_places(span.first, span.count, phones.rate, span.fps) - begin
        found = Curves(np.clip(read_rows(rows, places), 0, 1), curve_names(), span.fps)
        seals, teeth = (contact_track(met[kind], since_first) for kind in (SEALED, AT_TEETH))
        return finish_decoded(found, seals, teeth, style)

    def _told(self, speech: SpeechFeatures, rules: Float32Array, begin: int) -> Float32Array:
        """(row, measure) deviations from a person's mean, for rows from `begin` on.

        Where phones are known and the sound has none, those of the rules.
        """
        phones, sound = speech.phones, speech.features
        if phones is None or sound.encoder != HeardMouth.name:
            raise ModelError.about(
                self.path,
                found=f"features of {sound.encoder} alone",
                allowed="the mouth and phones, as its feature streams give them",
            )
        heard = _heard_rows(speech, begin, len(rules))
        told = heard[:, : len(TRACKED_MEASURES)]
        if not speech.known:
            return told
        low, high = UNHEARD
        unheard = np.clip((heard[:, len(MOUTH_FIELDS)] - low) / (high - low), 0, 1)[:, None]
        measured = builtin_response(curve_names()).measures(rules)
        ruled = (measured - mouth_sizes().middle_mm) / mouth_sizes().spread_mm
        return (told + unheard * (ruled - told)).astype(np.float32)

    def _settling(self, speech: SpeechFeatures, begin: int, count: int) -> Float64Array:
        """(row,) how far all but the lips rest where they do: wholly where nothing is heard."""
        still = _heard_rows(speech, begin, count)[:, len(MOUTH_FIELDS)] >= 1
        return RESTS + (1 - RESTS) * _blurred(still.astype(np.float64), STILL_ROWS)

    def _wanted_mm(self, told: Float32Array, style: Style) -> Float64Array:
        """(row, measure) of a mouth that speaks in a style."""
        sizes = mouth_sizes()
        z = _at_tempo(told[:, : len(TRACKED_MEASURES)].astype(np.float64), style)
        wanted = sizes.middle_mm + sizes.spread_mm * z
        # The network's opening is in the order of people's; the map has their distribution.
        knots, millimetres = sizes.opening_map
        low, high = np.diff(millimetres)[[0, -1]] / np.diff(knots)[[0, -1]]
        opening = np.interp(z[:, OPENING], knots, millimetres)
        opening += low * np.minimum(z[:, OPENING] - knots[0], 0)
        opening += BEYOND * high * np.maximum(z[:, OPENING] - knots[-1], 0)
        wanted[:, OPENING] = opening
        return wanted


def _heard_rows(speech: SpeechFeatures, begin: int, count: int) -> Float32Array:
    """Rows (count, 8) of `HeardMouth`, the last one over and over beyond its end."""
    sound = speech.features
    rows = np.minimum(np.arange(begin, begin + count) - sound.first, len(sound.values) - 1)
    return sound.values[rows]


def rule_curves(log_posteriors: FloatArray, first_row: int, begin: int, count: int) -> Float32Array:
    """What coarticulation alone makes of phones, a frame for each row.

    Parameters
    ----------
    log_posteriors : (row, 40)
        Of phones.
    first_row : int
        Where the first lies in the take.
    begin, count : int
        The first row wanted, and how many.

    Returns
    -------
    (count, curve) float32
        In the order of `curve_names`.
    """
    bare = articulate(
        log_posteriors,
        FEATURE_RATE,
        fps=FEATURE_RATE,
        frame_count=count,
        first_frame=begin,
        first_row=first_row,
        contacts=False,
    )
    return bare.select(curve_names()).values


def _contacts(speech: SpeechFeatures, posteriors: Float32Array) -> dict[int, list[Contact]]:
    """Of both kinds, in seconds since the first row of phones."""
    phones, kinds = speech.phones or speech.features, (SEALED, AT_TEETH)
    if speech.known:
        return {kind: known_contacts(posteriors, phones.rate, kind) for kind in kinds}
    states = contact_states(posteriors, phones.first)
    return {
        kind: decoded_contacts(posteriors, phones.rate, kind, phones.first, states)
        for kind in kinds
    }


def _at_tempo(z: Float64Array, style: Style) -> Float64Array:
    """Movements blurred for a slow style and sharpened for a quick one."""
    plain = Style()
    pace = (style.anticipation_s + style.carry_s) / (plain.anticipation_s + plain.carry_s)
    octaves = math.log2(pace)
    if abs(octaves) < 0.01:
        return z
    deviation = min(SLOWEST_ROWS, SLOWER_ROWS * abs(octaves))
    blurred = np.stack([_blurred(column, deviation) for column in z.T], axis=1)
    return blurred if octaves > 0 else z + SHARPER * min(1.0, -octaves) * (z - blurred)


def _blurred(column: Float64Array, deviation: float) -> Float64Array:
    """A Gaussian blur that sees TEMPO_ROWS on both sides."""
    reach = np.arange(-TEMPO_ROWS, TEMPO_ROWS + 1)
    kernel: Float64Array = np.exp(-0.5 * (reach / deviation) ** 2)
    padded = np.pad(column, TEMPO_ROWS, mode="edge")
    return np.convolve(padded, kernel / kernel.sum(), "valid").astype(np.float64)


def _rounding(rules: Float32Array, *, known: bool) -> Float64Array:
    """(row,) how far a width is the rules'.

    Unsure of a rounded vowel, a network widens it; of one that is known nobody is unsure.
    """
    names = curve_names()
    rounded = rules[:, [names.index(name) for name in ROUNDED]].sum(axis=1).astype(np.float64)
    share, fully = (1.0, KNOWN_ROUNDED) if known else (ROUNDED_SHARE, 1.0)
    return share * np.clip(rounded / fully, 0, 1)


def _parted_mm(posteriors: Float32Array) -> Float64Array:
    """(row,) how near lips may come without a contact, mm."""
    evidence = contact_evidence(_heard(posteriors, POOLS[SEALED]), posteriors[:, SILENCE])
    share = np.clip(evidence / MAYBE, 0, 1).astype(np.float64)
    return PARTED_MM + (NEARLY_MM - PARTED_MM) * share


def _heard(posteriors: Float32Array, phones: Sequence[str]) -> Float32Array:
    """(row,) posterior of any of some phones."""
    return posteriors[:, [PHONES.index(phone) for phone in phones]].sum(axis=1)
