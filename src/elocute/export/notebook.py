"""The viewer inside a notebook: the page of html.py in a frame, needing no network."""

from __future__ import annotations

import html
from collections.abc import Sequence

from elocute.errors import ElocuteError
from elocute.export.html import page_pieces
from elocute.export.soundtrack import Sound, sound_duration_s
from elocute.motion.motion import Motion
from elocute.speech.times.labels import Label

BYTES_MAX = 25_000_000
"""Of a page that is put into the notebook's own file."""
HEIGHT_PX = 480


def viewer_frame(
    motion: Motion, sound: Sound | None, title: str, words: Sequence[Label] = ()
) -> str:
    """HTML that shows a motion with its sound in a notebook.

    Parameters
    ----------
    motion : Motion
        What is shown.
    sound : str, Path, Waveform or None
        The sound that belongs to it.
    title : str
        What the frame is called.
    words : sequence of (float, float, str)
        Start in s, end in s and word, where they are known: captions.

    Returns
    -------
    str
        A frame with the viewer; a sentence where the page would be too large, or cannot be made.
    """
    try:
        if _least_bytes(motion, sound) > BYTES_MAX:
            return _sentence(title, "too long to be shown here")
        page = "".join(page_pieces(motion, sound, title, words))
    except ElocuteError as error:  # the sound's file is gone, or the viewer was not built
        return _sentence(title, str(error))
    if len(page) > BYTES_MAX:
        return _sentence(title, "too large to be shown here")
    return (
        f'<iframe srcdoc="{html.escape(page)}" title="{html.escape(title)}" '
        f'sandbox="allow-scripts" style="width: 100%; height: {HEIGHT_PX}px; border: 0">'
        "</iframe>"
    )


def _least_bytes(motion: Motion, sound: Sound | None) -> float:
    """What motion and sound alone need, in base64."""
    seconds = 0.0 if sound is None else sound_duration_s(sound) or 0.0
    return (motion.weights.nbytes + 8000 * seconds) * 4 / 3


def _sentence(title: str, why: str) -> str:
    return (
        f"<p>{html.escape(title)}: {html.escape(why)}; "
        "<code>write('talk.html')</code> gives a page for a browser.</p>"
    )
