"""Training: VOCA and the network of Karras et al. on a Corpus, the recurrent model on shards.

Needs the extra `train`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.training.crnn.run import train_crnn
    from elocute.training.crnn.settings import CrnnTrainConfig
    from elocute.training.device import available_devices, resolve_device
    from elocute.training.karras.run import train_karras
    from elocute.training.karras.settings import KarrasTrainConfig
    from elocute.training.voca.run import train_voca
    from elocute.training.voca.settings import VocaTrainConfig

__all__ = [
    "CrnnTrainConfig",
    "KarrasTrainConfig",
    "VocaTrainConfig",
    "available_devices",
    "resolve_device",
    "train_crnn",
    "train_karras",
    "train_voca",
]
__getattr__, __dir__ = lazy(
    __name__,
    {
        "crnn.settings": ("CrnnTrainConfig",),
        "crnn.run": ("train_crnn",),
        "device": ("available_devices", "resolve_device"),
        "karras.settings": ("KarrasTrainConfig",),
        "karras.run": ("train_karras",),
        "voca.settings": ("VocaTrainConfig",),
        "voca.run": ("train_voca",),
    },
)
