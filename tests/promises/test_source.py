"""What SECURITY.md says that the package never does: read off its source, line by line."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[2] / "src" / "elocute"
PLACES = sorted(path.relative_to(SOURCE).as_posix() for path in SOURCE.rglob("*.py"))

# Rule: what it is about, and the only files that may.
MODULES = {
    "Python's unpickler": (
        {"pickle", "_pickle", "cPickle", "cloudpickle", "dill", "joblib", "shelve"},
        set(),
    ),
    "code out of data": ({"marshal", "runpy", "code", "codeop", "yaml"}, set()),
    "the network": (
        {
            "urllib",
            "urllib3",
            "requests",
            "http",
            "httpx",
            "aiohttp",
            "ftplib",
            "socket",
            "ssl",
            "socketserver",
            "xmlrpc",
            "smtplib",
            "asyncio",
            "webbrowser",
        },
        # `study serve` waits for connections, and makes none.
        {"jobs/ray_cluster.py", "study/listening.py"},
    ),
    # Python alone: the processes that hold espeak-ng's library, Draco's and Blender's.
    "other programs": (
        {"subprocess", "pty"},
        {"jobs/ray_cluster.py", "audio/espeak.py", "files/draco_gltf.py", "files/fbx_gltf.py"},
    ),
}
CALLS = {
    "code out of data": (
        {"eval", "exec", "compile", "__import__", "builtins.eval", "builtins.exec"},
        set(),
    ),
    "the shell": ({"os.system", "os.popen", "os.execv", "os.execvp", "os.spawnv"}, set()),
    "torch's unpickler": ({"torch.load", "torch.hub.load", "torch.jit.load"}, set()),
    "NumPy's reader": (
        {"numpy.load", "numpy.fromfile", "numpy.lib.npyio.NpzFile"},
        set(),
    ),
    "networks from a path": ({"onnxruntime.InferenceSession"}, {"files/onnx_session.py"}),
}
KEYWORDS = {"shell": True, "allow_pickle": True, "trust_remote_code": True, "weights_only": False}


def names_of(tree: ast.AST) -> dict[str, str]:
    """What each imported name stands for: np -> numpy, load -> numpy.load."""
    known: dict[str, str] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for each in node.names:
                known[each.asname or each.name.split(".")[0]] = (
                    each.name if each.asname else each.name.split(".")[0]
                )
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            for each in node.names:
                known[each.asname or each.name] = f"{node.module}.{each.name}"
    return known


def dotted(node: ast.AST, known: dict[str, str]) -> str:
    """`np.load` as `numpy.load`; empty where it is no plain name."""
    if isinstance(node, ast.Name):
        return known.get(node.id, node.id)
    if isinstance(node, ast.Attribute):
        inner = dotted(node.value, known)
        return f"{inner}.{node.attr}" if inner else ""
    return ""


def imported(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Every module that is imported, by statement or by a name in quotes."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, each.name) for each in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.lineno, node.module
        elif (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Attribute)
            and node.func.attr == "import_module"
            and node.args
            and isinstance(node.args[0], ast.Constant)
        ):
            yield node.lineno, str(node.args[0].value)


def named(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Every name that is called, or handed on as it is; annotations do neither."""
    known = names_of(tree)
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            for part in (node.func, *node.args, *(each.value for each in node.keywords)):
                yield node.lineno, dotted(part, known)
        elif isinstance(node, ast.Assign):
            yield node.lineno, dotted(node.value, known)


def offences(text: str, place: str) -> list[str]:
    """`rule: place:line name` for everything in a source that SECURITY.md rules out."""
    tree, found = ast.parse(text), []
    for rule, (modules, homes) in MODULES.items():
        found += [
            f"{rule}: {place}:{line} {name}"
            for line, name in imported(tree)
            if name.split(".")[0] in modules and place not in homes
        ]
    for rule, (calls, homes) in CALLS.items():
        found += [
            f"{rule}: {place}:{line} {name}"
            for line, name in named(tree)
            if name in calls and place not in homes
        ]
    for node in ast.walk(tree):
        if isinstance(node, ast.keyword) and node.arg in KEYWORDS:
            value = node.value
            if not (isinstance(value, ast.Constant) and value.value is not KEYWORDS[node.arg]):
                found.append(f"{node.arg}: {place}:{value.lineno} {ast.unparse(node)}")
    return found


@pytest.mark.parametrize("place", PLACES)
def test_a_source_keeps_the_promises_of_security_md(place):
    assert offences((SOURCE / place).read_text(encoding="utf-8"), place) == []


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
    assert len(offences(text, "audio/read.py")) == 1


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
    assert offences(text, "audio/read.py") == []


def test_a_rule_s_own_home_may():
    text = "import onnxruntime\nonnxruntime.InferenceSession(model)"
    assert offences(text, "files/onnx_session.py") == []


def test_onnxruntime_is_imported_where_it_is_told_to_report_nothing():
    found = {
        path.relative_to(SOURCE).as_posix()
        for path in SOURCE.rglob("*.py")
        for _, module in imported(ast.parse(path.read_text(encoding="utf-8")))
        if module.split(".")[0] == "onnxruntime"
    }
    assert found == {"files/onnx_session.py"}


# The one mechanism by which a package loads its own names when they are first asked for.
LAZY = re.compile(r"(.+/)?__init__\.py|lazy_loading\.py")


def dynamic_imports(text: str, place: str) -> list[str]:
    """Calls of import_module that hide an arrow between packages from the drawn layers.

    A registry may load a module that lies beside it, by a name that begins with its own package;
    another's library may be loaded by a name in quotes.
    """
    package = ".".join(("elocute", *Path(place).parent.parts))
    found = []
    for node in ast.walk(ast.parse(text)):
        if (
            not isinstance(node, ast.Call)
            or dotted(node.func, {}).split(".")[-1] != "import_module"
        ):
            continue
        name = node.args[0] if node.args else None
        if isinstance(name, ast.JoinedStr):
            name = name.values[0]
        start = str(name.value) if isinstance(name, ast.Constant) else ""
        within = start.startswith(f"{package}.") and start.count(".") == package.count(".") + 1
        foreign = bool(start) and start.split(".")[0] != "elocute"
        if not (within or foreign or LAZY.fullmatch(place)):
            found.append(f"{place}:{node.lineno} {ast.unparse(node)}")
    return found


@pytest.mark.parametrize("place", PLACES)
def test_no_import_by_name_hides_an_arrow_between_packages(place):
    assert dynamic_imports((SOURCE / place).read_text(encoding="utf-8"), place) == []


@pytest.mark.parametrize(
    "text",
    [
        "importlib.import_module('elocute.export.notebook')",
        "import_module(name)",
        "import_module(f'elocute.{name}')",
        "import_module(f'elocute.motion.store.{name}')",
        "import_module(f'{package}.store')",
    ],
)
def test_an_import_by_name_is_found(text):
    assert len(dynamic_imports(text, "motion/motion.py")) == 1


@pytest.mark.parametrize(
    "text", ["import_module(f'elocute.motion.{name}')", "import_module('mediapipe.python')"]
)
def test_an_import_by_name_that_hides_nothing_is_not(text):
    assert dynamic_imports(text, "motion/motion.py") == []
