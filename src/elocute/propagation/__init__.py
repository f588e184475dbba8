"""Parameters of captured speakers carried over to many recordings of the same words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.propagation.corpus_propagation import (
        PropagationSummary,
        propagate,
        propagate_corpus,
    )
    from elocute.propagation.settings import PropagateConfig, PropagationSettings
    from elocute.propagation.word_recordings import WordRecordings, find_recordings

__all__ = [
    "PropagateConfig",
    "PropagationSettings",
    "PropagationSummary",
    "WordRecordings",
    "find_recordings",
    "propagate",
    "propagate_corpus",
]
__getattr__, __dir__ = lazy(
    __name__,
    {
        "corpus_propagation": ("PropagationSummary", "propagate", "propagate_corpus"),
        "settings": ("PropagateConfig", "PropagationSettings"),
        "word_recordings": ("WordRecordings", "find_recordings"),
    },
)
