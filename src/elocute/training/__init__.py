"""Training: VOCA and the network of Karras et al. on a Corpus, the recurrent model on shards.

Needs the extra `train`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.training.crnn.run import train_crnn as train_crnn
    from elocute.training.crnn.settings import CrnnTrainConfig as CrnnTrainConfig
    from elocute.training.device import (
        available_devices as available_devices,
        resolve_device as resolve_device,
    )
    from elocute.training.karras.run import train_karras as train_karras
    from elocute.training.karras.settings import KarrasTrainConfig as KarrasTrainConfig
    from elocute.training.voca.run import train_voca as train_voca
    from elocute.training.voca.settings import VocaTrainConfig as VocaTrainConfig

__getattr__, __dir__ = lazy(__name__, __file__)
