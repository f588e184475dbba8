"""A character opened from what its JSON says."""

import json

import pytest

from elocute.adoption.characters.open_character import open_character
from tests.support.gltf_files import glb


@pytest.fixture
def opened(tmp_path):
    def make(given, name="face.glb", mesh=None):
        path = tmp_path / name
        text = given if isinstance(given, str) else json.dumps(given)
        path.write_bytes(glb(text) if name != "face.gltf" else text.encode())
        return open_character(path, mesh)

    return make


def shares(opened):
    return {control.name: control.shares for control in opened.character.controls}
