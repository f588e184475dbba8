"""Corpora of talking faces: Clip, Corpus, Split; importers; shards of words; checks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.corpus.clip import Clip as Clip
    from elocute.corpus.corpus_checks import Finding as Finding, check_corpus as check_corpus
    from elocute.corpus.corpus_store import Corpus as Corpus, open_corpus as open_corpus
    from elocute.corpus.corpus_writing import (
        CorpusWriter as CorpusWriter,
        corpus_writer as corpus_writer,
    )
    from elocute.corpus.importers.registry import convert as convert
    from elocute.corpus.shards import (
        Shards as Shards,
        ShardWriter as ShardWriter,
        open_shards as open_shards,
        shard_writer as shard_writer,
    )
    from elocute.corpus.split import (
        ClipEntry as ClipEntry,
        Split as Split,
        split_by_subject as split_by_subject,
    )
    from elocute.corpus.word_clip import WordClip as WordClip

__getattr__, __dir__ = lazy(__name__, __file__)
