"""Lays contacts and rests over a learned model's curves of the built-in head."""

from __future__ import annotations

from elocute.articulation.driver import make_contacts
from elocute.audio.features import Features
from elocute.models.protocol import FrameSpan
from elocute.motion.curves import Curves


def finished_curves(bare: Curves, phones: Features | None, span: FrameSpan) -> Curves:
    """A network's curves of a span of frames, finished by the driver's rules.

    Contacts and rests are made from `phones`, log-posteriors (row, 40); None makes neither.
    """
    if phones is None:
        return bare
    return make_contacts(
        bare, phones.values, phones.rate, first_frame=span.first, first_row=phones.first
    )
