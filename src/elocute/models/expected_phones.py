"""Phones that are told of sound before it is heard, laid over those that were heard."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from elocute.audio.features import Features
from elocute.encoders.protocol import FEATURE_RATE
from elocute.encoders.trunk import SILENCE_ALONE
from elocute.errors import InputError
from elocute.speech.text.known_phones import checked_phones, known_posteriors
from elocute.speech.times.labels import Label

LENGTH_MAX_S = 600.0
COMING_ROWS = 25  # behind a frame that phones are known of: no rule looks further ahead
SETTLED_ROWS = 40  # after what was expected, when the mouth rests


class ExpectedPhones:
    """Phones of a live sound, as a speech engine tells them."""

    def __init__(self) -> None:
        self._spans: list[Features] = []

    def add(self, phones: Sequence[Label], begin_s: float) -> None:
        """Expect phones, in s after a moment of the sound.

        Raises InputError for an unknown phone, and times that run backwards or too far.
        """
        place = begin_s * FEATURE_RATE
        late_s = place % 1 / FEATURE_RATE
        known = [
            (first + late_s, end + late_s, phone) for first, end, phone in checked_phones(phones)
        ]
        end_s = max((end for _, end, _ in known), default=0.0)
        if end_s > LENGTH_MAX_S:
            raise InputError.about(
                "phones", found=f"{end_s:g} s", allowed=f"up to {LENGTH_MAX_S:g} s"
            )
        if known:
            rows = known_posteriors(known, end_s)
            self._spans.append(Features(rows, FEATURE_RATE, "phones", math.floor(place)))

    def laid_over(
        self, phones: Features, last_s: float, *, may_come: bool
    ) -> tuple[Features, bool]:
        """Phones that were heard, with those that are expected in their place.

        Also whether the frame at `last_s` has such. With `may_come` those behind the last row that
        was heard are there too, as far as a frame looks at them.
        """
        if not self._spans:
            return phones, False
        self._spans = [each for each in self._spans if _end(each) > phones.first]
        values, begin, known = phones.values, phones.first, False
        last = math.floor(last_s * phones.rate) + 1
        for each in self._spans:
            known |= each.first <= last <= _end(each) + SETTLED_ROWS
            more = min(_end(each), last + COMING_ROWS) - begin - len(values)
            if more > 0 and may_come:
                values = np.concatenate([values, np.tile(SILENCE_ALONE, (more, 1))])
            first, stop = max(each.first, begin), min(_end(each), begin + len(values))
            if first < stop:
                values = values.copy()
                told = each.values[first - each.first : stop - each.first]
                values[first - begin : stop - begin] = told
        return replace(phones, values=values), known


def _end(span: Features) -> int:
    return span.first + len(span.values)
