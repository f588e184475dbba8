"""Parameters of captured speakers carried over to many recordings of the same words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.propagation.corpus_propagation import (
        PropagationSummary as PropagationSummary,
        propagate as propagate,
        propagate_corpus as propagate_corpus,
    )
    from elocute.propagation.settings import (
        PropagateConfig as PropagateConfig,
        PropagationSettings as PropagationSettings,
    )
    from elocute.propagation.word_recordings import (
        WordRecordings as WordRecordings,
        find_recordings as find_recordings,
    )

__getattr__, __dir__ = lazy(__name__, __file__)
