"""Lays contacts and rests over a learned model's curves of the built-in head."""

from __future__ import annotations

from elocute.articulation.driver import make_contacts
from elocute.audio.features import Features
from elocute.models.protocol import FrameSpan
from elocute.motion.curves import Curves


def finished_curves(bare: Curves, phones: Features | None, span: FrameSpan) -> Curves:
    """A network's curves, finished by the driver's rules.

    Parameters
    ----------
    bare : Curves
        The frames of `span`, 0 to 1.
    phones : Features or None
        (row, 40) log-posteriors of phones, from which contacts and rests are made; None makes
        neither.
    span : FrameSpan
        Where the frames lie in the take.

    Returns
    -------
    Curves
    """
    if phones is None:
        return bare
    return make_contacts(
        bare, phones.values, phones.rate, first_frame=span.first, first_row=phones.first
    )
