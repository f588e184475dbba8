"""What is laid over a learned model's curves of the built-in head: contacts, rests and blinks."""

from __future__ import annotations

from elocute.articulation.driver import add_blinks, make_contacts
from elocute.articulation.style import Style
from elocute.audio.features import Features
from elocute.models.protocol import FrameSpan
from elocute.motion.curves import Curves


def finished_curves(
    bare: Curves, phones: Features | None, span: FrameSpan, *, blinks: bool
) -> Curves:
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
    blinks : bool
        Whether the eyes blink.

    Returns
    -------
    Curves
    """
    style = Style() if blinks else Style(blink_per_min=0.0)
    if phones is None:
        return add_blinks(bare, style, first_frame=span.first, total_frames=span.total)
    return make_contacts(
        bare,
        phones.values,
        phones.rate,
        style,
        first_frame=span.first,
        first_row=phones.first,
        total_frames=span.total,
    )
