"""Corpora of talking faces: Clip, Corpus, Split; importers; shards of words; checks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.corpus.clip import Clip
    from elocute.corpus.corpus_checks import Finding, check_corpus
    from elocute.corpus.corpus_store import Corpus, open_corpus
    from elocute.corpus.corpus_writing import CorpusWriter, corpus_writer
    from elocute.corpus.importers.registry import convert
    from elocute.corpus.shard_writing import ShardWriter
    from elocute.corpus.shards import Shards, open_shards, shard_writer
    from elocute.corpus.split import ClipEntry, Split, split_by_subject
    from elocute.corpus.word_clip import WordClip

__all__ = [
    "Clip",
    "ClipEntry",
    "Corpus",
    "CorpusWriter",
    "Finding",
    "ShardWriter",
    "Shards",
    "Split",
    "WordClip",
    "check_corpus",
    "convert",
    "corpus_writer",
    "open_corpus",
    "open_shards",
    "shard_writer",
    "split_by_subject",
]
__getattr__, __dir__ = lazy(
    __name__,
    {
        "clip": ("Clip",),
        "corpus_checks": ("Finding", "check_corpus"),
        "corpus_store": ("Corpus", "open_corpus"),
        "corpus_writing": ("CorpusWriter", "corpus_writer"),
        "importers.registry": ("convert",),
        "shard_writing": ("ShardWriter",),
        "shards": ("Shards", "open_shards", "shard_writer"),
        "split": ("ClipEntry", "Split", "split_by_subject"),
        "word_clip": ("WordClip",),
    },
)
