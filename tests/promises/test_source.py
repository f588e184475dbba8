"""What scripts/promises.py reads off the source: it must see what SECURITY.md rules out."""

from __future__ import annotations

import pytest

from scripts.promises import broken_by


@pytest.mark.parametrize(
    "text",
    [
        "import pickle",
        "from pickle import loads",
        "import urllib.request",
        "import socket as s",
        "import importlib\nimportlib.import_module('dill')",
        "eval(text)",
        "exec(text)",
        "list(map(eval, texts))",
        "run = eval",
        "import os\nos.system('ls')",
        "import numpy as np\nnp.load(path)",
        "from numpy import load as read\nread(path)",
        "import torch\ntorch.load(path)",
        "from onnxruntime import InferenceSession\nInferenceSession(path)",
        "import onnxruntime as ort\nort.InferenceSession(path)",
        "start(words, shell=True)",
        "start(words, shell=chosen)",
        "read(path, allow_pickle=True)",
    ],
)
def test_what_is_ruled_out_is_found(text):
    assert len(broken_by(text, "audio/read.py")) == 1


@pytest.mark.parametrize(
    "text",
    [
        "import re\nre.compile('a')",
        "network.eval()",
        "import pickletools",
        "import ast\nast.literal_eval(text)",
        "read(path, allow_pickle=False)",
        "def session(path) -> onnxruntime.InferenceSession: ...",
    ],
)
def test_what_only_looks_alike_is_not(text):
    assert broken_by(text, "audio/read.py") == []


def test_a_rule_s_own_home_may():
    text = "import onnxruntime\nonnxruntime.InferenceSession(model)"
    assert broken_by(text, "files/onnx_session.py") == []


def test_onnxruntime_is_imported_only_where_it_is_told_to_report_nothing():
    assert broken_by("import onnxruntime", "files/onnx_session.py") == []
    assert broken_by("import onnxruntime", "encoders/registry.py") == [
        "onnxruntime: encoders/registry.py:1 onnxruntime"
    ]


@pytest.mark.parametrize(
    "text",
    [
        "importlib.import_module('elocute.export.html')",
        "import_module(name)",
        "import_module(f'elocute.{name}')",
        "import_module(f'elocute.motion.store.{name}')",
        "import_module(f'{package}.store')",
    ],
)
def test_an_import_by_name_is_found(text):
    assert len(broken_by(text, "motion/motion.py")) == 1


@pytest.mark.parametrize(
    "text", ["import_module(f'elocute.motion.{name}')", "import_module('mediapipe.python')"]
)
def test_an_import_by_name_that_hides_nothing_is_not(text):
    assert broken_by(text, "motion/motion.py") == []


def test_a_flag_is_found_where_there_is_one():
    text = 'told = f"{rate} as --fit-pairs says"'
    assert broken_by(text, "audio/read.py") == ["a flag: audio/read.py:1 --fit-pairs"]
    assert broken_by(text, "cli/edit.py") == []
    assert broken_by('"ray start --head", "a -- dash", "well--known"', "audio/read.py") == []
