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
    PAUSE_S,
    breath_share,
    live_rest_share,
    rest_share,
)
from elocute.articulation.style import PLAIN, Style
from elocute.audio.resampling_stream import RESAMPLING_S, resampling_s
from elocute.audio.waveform import SPEECH_RATE
from elocute.encoders.phones_and_visemes import PHONES, SILENCE
from elocute.encoders.protocol import FEATURE_RATE
from elocute.encoders.trunk import (
    KIND,
    LIVE_PACES,
    MOUTH_FIELDS,
    SHIPPED_PATH,
    TrunkNetwork,
    builtin_trunk,
    live_pace,
    trunk_lookahead_s,
)
from elocute.errors import ModelError
from elocute.models.articulation_model import StyledAsRules
from elocute.models.feature_extraction import HeardMouth, Hearing
from elocute.models.model_file import check_file
from elocute.models.protocol import FeatureStreams, FrameSpan, SoundLevel, SpeechFeatures
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
BREATH_MM = 4.2  # that lips part before a phrase at most, and before a known one
UNSURE_MM, SURER = 1.2, 1.6  # people breathe in or do not; half a breath that is heard is a doubt
HISSED = ("S", "Z", "SH", "ZH", "CH", "JH")
STIFF_JAW = 0.8  # of its freedom that a jaw loses in them: teeth meet, and lips do the rest
RESTS, STILL_ROWS = 0.5, 2.0  # how far jaw and corners rest where lips do; blur of stillness
SLOWER_ROWS, SLOWEST_ROWS = 1.6, 2.2  # blur of movements twice as slow as plain ones, and the most
SHARPER = 0.9  # share of the difference from a blur that is added where they are twice as fast
BETWEEN_ROWS_S = 1 / FEATURE_RATE  # a frame waits for the row after it
ROUNDED_SHARE = 0.1  # of the rules' width where they round the lips fully
KNOWN_ROUNDED = 0.75  # of full rounding, from which all of it, where phones are known


@dataclass(frozen=True, eq=False)
class MouthSizes:
    """How far people's mouths move on the built-in head, from what a trunk predicts.

    Parameters
    ----------
    middle_mm, spread_mm : (measure,) float64
        Of `TRACKED_MEASURES`: where speech lies, and a deviation of it, mm.
    """

    middle_mm: Float64Array
    spread_mm: Float64Array


@cache
def mouth_sizes() -> MouthSizes:
    """The sizes that `recipes.train_trunk ship` measured on people."""
    stored = json.loads(SIZES_PATH.read_text(encoding="utf-8"))
    return MouthSizes(**{name: np.array(values, np.float64) for name, values in stored.items()})


class TalkersModel(StyledAsRules):
    """The model of many talkers that ships (`talkers`), or one from an .onnx, as a SpeechModel.

    Such a file is what `recipes.train_trunk` writes; a session may be given where it was opened
    before.

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
        """The trunk that predicts mouth and phones."""
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
        return trunk_lookahead_s(self.network, LIVE_PACES[-1]) + BETWEEN_ROWS_S

    def feature_streams(
        self,
        sample_rate: int,
        *,
        contacts: bool = True,
        level: SoundLevel | None = None,
        within_s: float | None = None,
    ) -> FeatureStreams:
        if within_s is None:
            hearing = Hearing(self.network, sample_rate)
            return FeatureStreams(HeardMouth(hearing), hearing.phones)
        resampled_s = resampling_s(sample_rate, SPEECH_RATE, prompt=True)
        pace = live_pace(self.network, within_s - resampled_s - BETWEEN_ROWS_S)
        hearing = Hearing(self.network, sample_rate, pace=pace)
        late_s = trunk_lookahead_s(self.network, pace) + resampled_s + BETWEEN_ROWS_S
        return FeatureStreams(HeardMouth(hearing), hearing.phones, hearing.coming_phones, late_s)

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
        deviations = self._deviations(speech, rules, begin)
        rest = breath = np.zeros(stop - begin)
        if contacts:
            silence = posteriors[:, SILENCE]
            starts = phones.first == round(speech.origin_s * phones.rate)
            edge_s = KNOWN_EDGE_S if speech.known else EDGE_S
            if speech.live:
                unheard = _rows_unheard(speech, silence) if starts else 0
                pause_s = KNOWN_EDGE_S if speech.known else PAUSE_S
                shares = live_rest_share(silence, phones.rate, pause_s=pause_s, unheard=unheard)
                rest = shares[near]
            else:
                rest = rest_share(silence, phones.rate, starts=starts, edge_s=edge_s)[near]
                breath = breath_share(silence, phones.rate, starts=starts, edge_s=edge_s)[near]
        since_first = times - phones.first / phones.rate
        row_times = np.arange(begin - phones.first, stop - phones.first) / phones.rate
        met = _contacts(speech, posteriors) if contacts else {SEALED: [], AT_TEETH: []}
        wanted_mm = self._wanted_mm(deviations, style)
        surely_mm = SURER * (wanted_mm[:, OPENING] - UNSURE_MM)
        heard_mm = BREATH_MM if speech.known else np.clip(surely_mm, 0, BREATH_MM)
        asked = AskedMouth(
            wanted_mm=wanted_mm,
            rounding=_rounding(rules, known=speech.known),
            parted_mm=_parted_mm(posteriors)[near] if contacts else np.full(len(rest), NEARLY_MM),
            stiff=STIFF_JAW * _heard(posteriors, HISSED)[near],
            breath_mm=breath * heard_mm,
            rest=rest,
            settled=rest * self._settling(speech, begin, len(rules)),
            sealed=contact_track(met[SEALED], row_times),
            at_teeth=contact_track(met[AT_TEETH], row_times),
        )
        rows = mouth_curves(rules, asked, style, strength)
        places = frame_places(span.first, span.count, phones.rate, span.fps) - begin
        mouth = Curves(np.clip(read_rows(rows, places), 0, 1), curve_names(), span.fps)
        seals, teeth = (contact_track(met[kind], since_first) for kind in (SEALED, AT_TEETH))
        return finish_decoded(mouth, seals, teeth, style)

    def _deviations(self, speech: SpeechFeatures, rules: Float32Array, begin: int) -> Float32Array:
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
        deviations = heard[:, : len(TRACKED_MEASURES)]
        if not speech.known:
            return deviations
        low, high = UNHEARD
        unheard = np.clip((heard[:, len(MOUTH_FIELDS)] - low) / (high - low), 0, 1)[:, None]
        measured = builtin_response(curve_names()).measures(rules)
        ruled = (measured - mouth_sizes().middle_mm) / mouth_sizes().spread_mm
        return (deviations + unheard * (ruled - deviations)).astype(np.float32)

    def _settling(self, speech: SpeechFeatures, begin: int, count: int) -> Float64Array:
        """(row,) how far all but the lips rest where they do: wholly where nothing is heard."""
        still = _heard_rows(speech, begin, count)[:, len(MOUTH_FIELDS)] >= 1
        return RESTS + (1 - RESTS) * _blurred(still.astype(np.float64), STILL_ROWS)

    def _wanted_mm(self, deviations: Float32Array, style: Style) -> Float64Array:
        """(row, measure) of a mouth that speaks in a style."""
        sizes = mouth_sizes()
        z = _at_tempo(deviations[:, : len(TRACKED_MEASURES)].astype(np.float64), style)
        return sizes.middle_mm + sizes.spread_mm * z


def _heard_rows(speech: SpeechFeatures, begin: int, count: int) -> Float32Array:
    """Rows (count, 8) of `HeardMouth`, the last one over and over beyond its end."""
    sound = speech.features
    rows = np.minimum(np.arange(begin, begin + count) - sound.first, len(sound.values) - 1)
    return sound.values[rows]


def _rows_unheard(speech: SpeechFeatures, silence: Float32Array) -> int:
    """Rows at the beginning in which nothing is heard and nothing said."""
    spoken = silence < 0.5
    heard = speech.features.values[:, len(MOUTH_FIELDS)] < 1
    spoken[: len(heard)] |= heard
    return int(spoken.argmax()) if spoken.any() else len(spoken)


def rule_curves(log_posteriors: FloatArray, first_row: int, begin: int, count: int) -> Float32Array:
    """What coarticulation alone makes of log-posteriors (row, 40) of phones, a frame for each row.

    Rows lie in the take from `first_row` on; `count` of them are wanted, from row `begin` on.

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
    pace = (style.anticipation_s + style.carry_s) / (PLAIN.anticipation_s + PLAIN.carry_s)
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

    A network widens a rounded vowel that it is unsure of; a known one is as wide as in the rules.
    """
    names = curve_names()
    rounded = rules[:, [names.index(name) for name in ROUNDED]].sum(axis=1).astype(np.float64)
    share, fully = (1.0, KNOWN_ROUNDED) if known else (ROUNDED_SHARE, 1.0)
    return share * np.clip(rounded / fully, 0, 1)


def _parted_mm(posteriors: Float32Array) -> Float64Array:
    """(row,) how near lips may come without a contact, mm."""
    silence = posteriors[:, SILENCE].astype(np.float64)
    evidence = contact_evidence(_heard(posteriors, POOLS[SEALED]), silence)
    share = np.clip(evidence[: len(silence)] / MAYBE, 0, 1)
    return (1 - silence) * (PARTED_MM + (NEARLY_MM - PARTED_MM) * share)


def _heard(posteriors: Float32Array, phones: Sequence[str]) -> Float32Array:
    """(row,) posterior of any of some phones."""
    return posteriors[:, [PHONES.index(phone) for phone in phones]].sum(axis=1)
