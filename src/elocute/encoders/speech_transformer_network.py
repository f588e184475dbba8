"""wav2vec 2.0, HuBERT and WavLM in torch, from weights on disk: transformers' own networks.

Only the two files given are read: the configuration as plain settings of the architecture, the
weights from safetensors. No network is reached, and no code of the folder's runs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from elocute.array_types import Float32Array
from elocute.encoders.protocol import WEIGHTS_MAX_BYTES
from elocute.errors import InputError, MachineError
from elocute.files.reading import FileKind
from elocute.files.safetensors_header import read_tensor_header

WEIGHTS_FILE = FileKind(
    "a whole safetensors file", WEIGHTS_MAX_BYTES, remedy="download or copy it again"
)

# kind: transformers' names of the configuration and of the network.
CLASSES = {
    "wav2vec2": ("Wav2Vec2Config", "Wav2Vec2Model"),
    "hubert": ("HubertConfig", "HubertModel"),
    "wavlm": ("WavLMConfig", "WavLMModel"),
}
# Stands for masked sound in training alone; some folders leave it out.
UNUSED = "masked_spec_embed"
# Published files spell a normalised weight as torch did before 2.0; early releases of
# transformers leave it to torch's own loading, which is not used here.
RENAMED = {
    ".weight_g": ".parametrizations.weight.original0",
    ".weight_v": ".parametrizations.weight.original1",
}


def load_speech_transformer(
    kind: str, config: Mapping[str, Any], weights: Path
) -> Callable[[Float32Array], Float32Array]:
    """A function from (sample,) at 16 kHz to (frame, hidden) of the last layer, float32.

    Raises MachineError where torch or transformers is missing, InputError where the weights are
    no safetensors or do not fit the configuration.
    """
    torch, transformers = _packages(kind)
    config_name, network_name = CLASSES[kind]
    settings = _settings(transformers, getattr(transformers, config_name), config)
    state = _read_weights(weights)
    with _quiet(transformers):
        network = _build(getattr(transformers, network_name), settings, state, weights)
    network = network.float().eval()

    def run(samples: Float32Array) -> Float32Array:
        sound = torch.from_numpy(np.ascontiguousarray(samples, np.float32))[None]
        with torch.inference_mode():
            return network(sound).last_hidden_state[0].numpy()

    return run


def _packages(kind: str) -> tuple[Any, Any]:
    try:
        import safetensors.torch  # noqa: F401
        import torch
        import transformers
    except ImportError as error:
        raise MachineError(
            f"{kind}: {error.name or error} is missing; it needs torch, transformers and "
            "safetensors; install elocute[encoders]"
        ) from error
    return torch, transformers


def _settings(transformers: Any, config_class: Any, config: Mapping[str, Any]) -> Any:
    """The settings of the architecture itself. Those that all models share are left out: they name
    code to load, kernels to fetch and numbers to quantise with."""
    shared = transformers.PretrainedConfig().to_dict().keys()
    own = config_class().to_dict().keys() - shared
    try:
        return config_class(**{name: value for name, value in config.items() if name in own})
    except Exception as error:  # transformers checks with several libraries' errors
        raise InputError.about(
            "config.json", found=f"settings that do not fit: {_first_line(error)}"
        ) from error


def _read_weights(path: Path) -> dict[str, Any]:
    import safetensors
    from safetensors.torch import load_file

    read_tensor_header(path, WEIGHTS_FILE)
    try:
        return {_present_name(name): array for name, array in load_file(path).items()}
    except (safetensors.SafetensorError, OSError, ValueError, KeyError) as error:
        raise InputError.about(
            path,
            found=f"not a whole safetensors file: {_first_line(error)}",
            remedy="download or copy it again",
        ) from error


def _present_name(name: str) -> str:
    for old, new in RENAMED.items():
        if name.endswith(old):
            return name.removesuffix(old) + new
    return name


def _build(network_class: Any, settings: Any, state: dict[str, Any], path: Path) -> Any:
    try:
        network, report = network_class.from_pretrained(
            None,
            config=settings,
            state_dict=state,
            local_files_only=True,
            output_loading_info=True,
        )
    except Exception as error:  # as above; and RuntimeError for shapes
        raise InputError.about(
            path, found=f"weights that do not fit config.json: {_first_line(error)}"
        ) from error
    missing = sorted(name for name in report["missing_keys"] if not name.endswith(UNUSED))
    if missing:
        raise InputError.about(
            path,
            found=f"{len(missing)} weights missing, {missing[0]} among them",
            allowed="all that config.json asks for",
        )
    return network


def _first_line(error: Exception) -> str:
    return str(error).strip().partition("\n")[0] or type(error).__name__


@contextmanager
def _quiet(transformers: Any) -> Iterator[None]:
    """Without a report of the weights of heads that features do not need."""
    logging = transformers.utils.logging
    before, bars = logging.get_verbosity(), logging.is_progress_bar_enabled()
    logging.set_verbosity_error()
    logging.disable_progress_bar()
    try:
        yield
    finally:
        logging.set_verbosity(before)
        if bars:
            logging.enable_progress_bar()
