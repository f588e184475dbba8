"""wav2vec 2.0, HuBERT and WavLM against transformers' own output; folders that are refused.

The networks are tiny and random, saved by the tests; nothing is downloaded.
"""

import json
import sys

import numpy as np
import pytest

from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.encoders import speech_transformer
from elocute.encoders.registry import resolve_encoder
from elocute.encoders.speech_transformer import Wav2Vec2, blocks
from elocute.errors import InputError, MachineError

KINDS = {"wav2vec2": "Wav2Vec2", "hubert": "Hubert", "wavlm": "WavLM"}
TINY = {
    "hidden_size": 24,
    "num_hidden_layers": 2,
    "num_attention_heads": 2,
    "intermediate_size": 32,
    "conv_dim": [16] * 7,
    "num_conv_pos_embeddings": 16,
    "num_conv_pos_embedding_groups": 2,
    "num_buckets": 32,
    "max_bucket_distance": 80,
    "vocab_size": 32,
}


@pytest.fixture(scope="session")
def transformers():
    pytest.importorskip("torch", reason="needs torch, of the extra `encoders`")
    return pytest.importorskip("transformers", reason="needs the extra `encoders`")


@pytest.fixture
def network(transformers, tmp_path):
    """Save a tiny network: (folder, transformers' own network)."""

    def save(kind: str, head: str = "Model", **changes):
        import torch

        torch.manual_seed(5)
        config = getattr(transformers, f"{KINDS[kind]}Config")(**(TINY | changes))
        made = getattr(transformers, f"{KINDS[kind]}{head}")(config).eval()
        made.save_pretrained(tmp_path)
        return tmp_path, made

    return save


@pytest.fixture(scope="module")
def speech(speech_wav) -> Waveform:
    return Waveform(read_audio(speech_wav, sample_rate=16000).samples[:40160], 16000)


def states(made, samples: np.ndarray) -> np.ndarray:
    """What transformers itself gives."""
    import torch

    with torch.inference_mode():
        return made(torch.from_numpy(samples)[None]).last_hidden_state[0].numpy()


def standard(transformers, samples: np.ndarray) -> np.ndarray:
    extractor = transformers.Wav2Vec2FeatureExtractor(do_normalize=True)
    return extractor(samples, sampling_rate=16000, return_tensors="np").input_values[0]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("stable", [False, True])
def test_features_equal_the_last_hidden_states(kind, stable, network, transformers, speech):
    norm = {"do_stable_layer_norm": stable, "feat_extract_norm": "layer" if stable else "group"}
    folder, made = network(kind, **norm)
    encoder = resolve_encoder(f"{kind}:{folder}")
    features = encoder(speech)
    assert (encoder.name, encoder.feature_count, encoder.rate) == (kind, 24, 50)
    assert (features.encoder, features.rate, features.values.shape) == (kind, 50, (126, 24))
    theirs = states(made, standard(transformers, speech.samples))
    np.testing.assert_allclose(features.values[: len(theirs)], theirs, atol=1e-4)
    np.testing.assert_array_equal(features.values[len(theirs) :], theirs[-1:].repeat(1, 0))


def test_weights_are_found_under_the_names_of_older_torch(network, transformers, speech):
    """The published files spell the norm of the positional convolution as torch once did."""
    from safetensors.torch import load_file, save_file

    folder, made = network("wav2vec2", head="ForCTC")
    path = folder / "model.safetensors"
    older = {
        name.replace("parametrizations.weight.original0", "weight_g").replace(
            "parametrizations.weight.original1", "weight_v"
        ): value
        for name, value in load_file(path).items()
    }
    assert any(name.endswith("weight_g") for name in older)
    save_file(older, path)
    theirs = states(made.wav2vec2, standard(transformers, speech.samples))
    ours = resolve_encoder(f"wav2vec2:{folder}")(speech).values
    np.testing.assert_allclose(ours[: len(theirs)], theirs, atol=1e-4)


def test_numbers_of_half_precision_are_computed_in_single(network, speech):
    from safetensors.torch import load_file, save_file

    folder, _ = network("hubert")
    path = folder / "model.safetensors"
    before = resolve_encoder(f"hubert:{folder}")(speech).values
    save_file({name: value.half() for name, value in load_file(path).items()}, path)
    after = resolve_encoder(f"hubert:{folder}")(speech).values
    assert after.dtype == np.float32
    np.testing.assert_allclose(after, before, atol=0.05)


def test_sound_is_left_as_it_is_where_the_folder_says_so(network, speech):
    folder, made = network("wavlm")
    settings = {"do_normalize": False, "sampling_rate": 16000}
    (folder / "preprocessor_config.json").write_text(json.dumps(settings))
    theirs = states(made, speech.samples)
    ours = resolve_encoder(f"wavlm:{folder}")(speech).values
    np.testing.assert_allclose(ours[: len(theirs)], theirs, atol=1e-4)


def test_a_network_with_a_head_for_text_gives_the_same_features(network, transformers, speech):
    folder, made = network("wav2vec2", head="ForCTC")
    theirs = states(made.wav2vec2, standard(transformers, speech.samples))
    ours = resolve_encoder(f"wav2vec2:{folder}")(speech).values
    np.testing.assert_allclose(ours[: len(theirs)], theirs, atol=1e-4)


@pytest.mark.parametrize(
    ("count", "rate"), [(2, 16000), (700, 16000), (24080, 16000), (44100, 44100)]
)
def test_features_last_as_long_as_the_sound(count, rate, network):
    folder, _ = network("hubert")
    sound = Waveform(np.full(count, 0.1, np.float32), rate)
    values = resolve_encoder(f"hubert:{folder}")(sound).values
    assert values.shape == (max(1, round(count * 50 / rate)), 24)


@pytest.mark.parametrize("frames", [1, 1500, 1501, 1700, 3000, 4444])
@pytest.mark.parametrize("more", [0, 1, 319])
def test_blocks_of_a_long_sound_join_without_gap_or_overlap(frames, more):
    samples = np.arange(frames * 320 + more, dtype=np.float32)
    places = []
    for sound, first, stop in blocks(samples):
        count = (len(sound) - 400) // 320 + 1
        assert len(sound) <= 2000 * 320 + 400
        places += [int(sound[k * 320]) // 320 for k in range(count)][first:stop]
    assert places == list(range(len(places)))
    assert frames - 1 <= len(places) <= frames


def test_a_long_sound_is_nearly_what_it_is_whole(network, speech, monkeypatch):
    folder, _ = network("wav2vec2", feat_extract_norm="layer", do_stable_layer_norm=True)
    encoder = resolve_encoder(f"wav2vec2:{folder}")
    whole = encoder(speech).values
    monkeypatch.setattr(speech_transformer, "BLOCK_FRAMES", 50)
    monkeypatch.setattr(speech_transformer, "CONTEXT_FRAMES", 30)
    cut = encoder(speech).values
    assert cut.shape == whole.shape
    assert np.abs(cut - whole).mean() < 0.1 * whole.std()


def test_a_pickle_is_refused_and_the_way_out_told(network):
    folder, _ = network("wav2vec2")
    (folder / "model.safetensors").rename(folder / "pytorch_model.bin")
    with pytest.raises(InputError, match=r"pytorch_model\.bin.*pickle.*safe_serialization"):
        Wav2Vec2(folder)
    (folder / "pytorch_model.bin").unlink()
    with pytest.raises(InputError, match=r"no model\.safetensors"):
        Wav2Vec2(folder)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"model_type": "hubert"}, "'hubert'"),
        ({"hidden_size": 10**9}, "hidden_size 1000000000"),
        ({"hidden_size": None}, "hidden_size None"),
        ({"num_hidden_layers": 10**9}, "num_hidden_layers"),
        ({"num_attention_heads": True}, "num_attention_heads True"),
        ({"conv_stride": [5, 2, 2, 2, 2, 2, 1]}, "every 160 samples"),
        ({"conv_dim": [16] * 6}, "convolutions"),
        ({"conv_kernel": [10**9] * 7}, "convolutions"),
        ({"conv_kernel": "3"}, "convolutions"),
        ({"add_adapter": True}, "adapter"),
    ],
)
def test_a_forged_configuration_is_refused(change, says, tmp_path):
    config = {"model_type": "wav2vec2"} | TINY | change
    (tmp_path / "config.json").write_text(json.dumps(config))
    (tmp_path / "model.safetensors").write_bytes(b"")
    with pytest.raises(InputError, match=says) as caught:
        Wav2Vec2(tmp_path)
    assert "config.json" in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("content", ["", "[1]", "{", "[" * 100_000, '"x"', "\xff"])
def test_a_configuration_that_is_no_object_is_refused(content, tmp_path):
    (tmp_path / "config.json").write_text(content, "latin1")
    with pytest.raises(InputError, match=r"config\.json"):
        Wav2Vec2(tmp_path)


def test_another_sampling_rate_is_refused(network):
    folder, _ = network("wav2vec2")
    (folder / "preprocessor_config.json").write_text('{"sampling_rate": 8000}')
    with pytest.raises(InputError, match="sampling_rate 8000"):
        Wav2Vec2(folder)


def test_a_configuration_larger_than_its_weights_is_refused_before_memory_is_taken(network):
    folder, _ = network("wav2vec2")
    path = folder / "config.json"
    for change in (
        {"hidden_size": 8192},
        {"num_hidden_layers": 96, "intermediate_size": 32768},
        {"conv_dim": [4096] * 7},
    ):
        path.write_text(json.dumps({"model_type": "wav2vec2"} | TINY | change))
        with pytest.raises(InputError, match=r"model\.safetensors: \d+ bytes; allowed"):
            Wav2Vec2(folder)


def refusal(folder, speech) -> str:
    with pytest.raises(InputError) as caught:
        Wav2Vec2(folder)(speech)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_weights_that_are_cut_off_or_none_are_refused(network, speech):
    folder, _ = network("wav2vec2")
    path = folder / "model.safetensors"
    whole = path.read_bytes()
    for content in (b"", b"\x80\x04pickle", whole[:100], whole[:-10], b"\xff" * 64):
        path.write_bytes(content)
        assert "model.safetensors" in refusal(folder, speech)


def test_weights_that_are_missing_or_of_another_shape_are_refused(network, speech):
    from safetensors.torch import load_file, save_file

    folder, _ = network("wav2vec2")
    path = folder / "model.safetensors"
    whole = load_file(path)
    name = "encoder.layers.1.final_layer_norm.weight"
    save_file({key: value for key, value in whole.items() if key != name}, path)
    assert "1 weights missing" in refusal(folder, speech)
    save_file(whole | {name: whole[name][:4].clone()}, path)
    assert "do not fit" in refusal(folder, speech)


def test_settings_that_reach_for_code_or_kernels_are_not_passed_on(network, speech):
    folder, _ = network("wav2vec2")
    before = resolve_encoder(f"wav2vec2:{folder}")(speech).values
    path = folder / "config.json"
    config = json.loads(path.read_text())
    config |= {
        "auto_map": {"AutoModel": "evil--evil.Model"},
        "_attn_implementation": "evil/kernel",
        "attn_implementation": "evil/kernel",
        "quantization_config": {"quant_method": "awq"},
    }
    path.write_text(json.dumps(config))
    (folder / "adapter_config.json").write_text('{"base_model_name_or_path": "evil/model"}')
    after = resolve_encoder(f"wav2vec2:{folder}")(speech).values
    np.testing.assert_array_equal(before, after)


@pytest.mark.parametrize("package", ["torch", "transformers", "safetensors.torch"])
def test_a_missing_package_is_told_in_one_line(package, tmp_path, speech, monkeypatch):
    pytest.importorskip("torch", reason="the networks' own package needs it")
    (tmp_path / "config.json").write_text(json.dumps({"model_type": "wavlm"} | TINY))
    (tmp_path / "model.safetensors").write_bytes(bytes(100_000))
    encoder = resolve_encoder(f"wavlm:{tmp_path}")
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(MachineError, match=r"install elocute\[encoders\]") as caught:
        encoder(speech)
    assert "\n" not in str(caught.value)
