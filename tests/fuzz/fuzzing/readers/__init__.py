"""The registry: every function of the package that takes a file, a folder or a text of a user.

Each call goes as far as a command would: a corpus is opened and all its clips are read, a network
is opened and runs once.
"""

from __future__ import annotations

import importlib.util

from tests.fuzz.fuzzing.cases import Reader
from tests.fuzz.fuzzing.readers import arrays, corpora, media, meshes, networks, options, texts

READERS: tuple[Reader, ...] = (
    *texts.READERS,
    *arrays.READERS,
    *meshes.READERS,
    *media.READERS,
    *corpora.READERS,
    *networks.READERS,
    *options.READERS,
)


def usable() -> list[Reader]:
    """Readers whose packages are here."""
    return [
        reader
        for reader in READERS
        if all(importlib.util.find_spec(name) is not None for name in reader.needs)
    ]
