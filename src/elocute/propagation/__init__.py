"""Parameters of captured speakers carried over to many recordings of the same words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy import lazy

if TYPE_CHECKING:
    from elocute.propagation.corpus_propagation import Summary, propagate, propagate_corpus
    from elocute.propagation.settings import JobSettings, PropagateConfig
    from elocute.propagation.word_recordings import Recordings, find_recordings

__all__ = [
    "JobSettings",
    "PropagateConfig",
    "Recordings",
    "Summary",
    "find_recordings",
    "propagate",
    "propagate_corpus",
]
__getattr__, __dir__ = lazy(
    __name__,
    {
        "corpus_propagation": ("Summary", "propagate", "propagate_corpus"),
        "settings": ("JobSettings", "PropagateConfig"),
        "word_recordings": ("Recordings", "find_recordings"),
    },
)
