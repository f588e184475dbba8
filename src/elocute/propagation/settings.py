"""Settings of a propagation."""

from __future__ import annotations

from dataclasses import dataclass

from elocute.errors import InputError
from elocute.settings import SEED_MAX, check_settings, described, setting


@described
@dataclass(frozen=True, kw_only=True)
class PropagateConfig:
    """How parameters are carried over.

    Raises
    ------
    InputError
        For a number outside its range.
    """

    method: str = setting("cca-soft", help="Alignment: dtw, softdtw, ctw, dctw, cca-soft or dcaw.")
    encoder: str = setting("fbank", help="Speech encoder that recordings are compared by.")
    seed: int = setting(0, low=0, high=SEED_MAX, help="Seed of all random numbers.")
    fit_pairs: int = setting(
        50,
        low=1,
        high=10_000,
        help="Recordings that a word's network is fitted to; the default is the paper's batch.",
    )
    confidence: float = setting(
        0.3, low=0.0, high=1.0, help="Recordings below this confidence are rejected."
    )
    fps: float = setting(
        30.0, unit="frames/s", low=1.0, high=240.0, help="Frame rate of the parameters."
    )

    def __post_init__(self) -> None:
        check_settings(self, InputError)


@described
@dataclass(frozen=True, kw_only=True)
class PropagationSettings(PropagateConfig):
    """The same with its places: what is the same for all words.

    Paths are absolute, since workers may run in other folders.
    """

    corpus: str = setting(help="Folder of the captured speakers.")
    basis: str = setting(help="Speech blendshapes (.npz).")
    recordings: str = setting(help="Folder of the recordings.")
    root: str = setting(help="Folder to which the paths of sounds in the shards are relative.")
    folder: str = setting(help="Folder to write the shards to.")
    truth: bool = setting(True, help="Whether captured words become clips of the shards too.")
    inputs: str = setting("", help="Checksums of corpus and basis, filled in by `propagate`.")
