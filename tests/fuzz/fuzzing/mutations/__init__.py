"""Changed bytes, drawn by a random.Random: the same seed always gives the same bytes.

Every kind of file has mutations that keep its outer form, so that what lies inside is reached:
JSON stays JSON, an archive's checksums stay right, a protocol buffer's lengths fit.
"""

from __future__ import annotations

from random import Random

from tests.fuzz.fuzzing.mutations.any_bytes import ANY, Mutation, edge, number, spliced
from tests.fuzz.fuzzing.mutations.arrays import (
    npy_header,
    npy_numbers,
    npz_bomb,
    npz_entry,
    zip_directory,
)
from tests.fuzz.fuzzing.mutations.gltf import glb_binary, glb_json
from tests.fuzz.fuzzing.mutations.json_text import json_key_twice, json_value
from tests.fuzz.fuzzing.mutations.media import png, riff
from tests.fuzz.fuzzing.mutations.models import count, header_text, pickle, safetensors
from tests.fuzz.fuzzing.mutations.protobuf import proto
from tests.fuzz.fuzzing.mutations.text import encoding, lines, token

GROWN_MOST = 1_000_000  # bytes: a large file may cost much, a small one may not

KINDS: dict[str, tuple[Mutation, ...]] = {
    "bytes": (),
    "json": (json_value, json_value, json_value, json_value, json_key_twice, token, encoding),
    "text": (token, token, token, lines, encoding),
    "npy": (npy_header, npy_header, npy_numbers),
    "npz": (npz_entry,) * 60 + (zip_directory,) * 9 + (npz_bomb,),
    "proto": (proto,),
    "png": (png,),
    "riff": (riff,),
    "glb": (glb_json, glb_json, glb_json, glb_binary),
    "ply": (header_text, header_text, edge),
    "safetensors": (safetensors,),
    "pickle": (pickle,),
    "vl": (count, number),
}


def mutate(rng: Random, data: bytes, kind: str, others: tuple[bytes, ...] = ()) -> bytes:
    """One to three mutations of `data`, half of them such as its kind has, half of any bytes.

    `others` are seeds of the same kind, for splices.
    """
    special = KINDS[kind]
    most = 4 * len(data) + GROWN_MOST
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        if special and rng.random() < 0.7:
            try:
                data = rng.choice(special)(rng, data)[:most]
                continue
            except Exception:
                pass  # changed so much that its form is lost: any bytes, then
        if others and rng.random() < 0.1:
            data = spliced(rng, data, rng.choice(others))
        else:
            data = rng.choice(ANY)(rng, data)[:most]
    return data
