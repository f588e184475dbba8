#!/usr/bin/env python3
"""Read off the source what SECURITY.md and docs/design.md say that the package never does.

    python scripts/promises.py    names each, `rule: file:line what`; exit code 1 where there is one

No unpickler, no code out of data, no network, no other program, no reader that opens what it should
not, but in the few files that may; no import by a name that hides an arrow between the layers; no
flag of the command line in a text of the library.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

SOURCE = Path(__file__).parents[1] / "src" / "elocute"

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
            "grpc",
            "webbrowser",
            "websockets",
        },
        # `study serve` waits for connections, ends those that ask nothing, and makes none. `live`
        # sends frames where it was told to, and waits for connections where it is told to.
        # `studio` is served likewise, and its link is opened in the user's browser.
        # `agents` waits for its turn by `asyncio`, inside the programs of others.
        {
            "agents/paced_face.py",
            "agents/pipecat.py",
            "cli/commands/studio.py",
            "jobs/ray_cluster.py",
            "live/faces.py",
            "live/a2f.py",
            "live/targets.py",
            "live/vtube_studio.py",
            "live/ws_server.py",
            "serving/listening.py",
            "serving/connections.py",
            "studio/server.py",
            "studio/session.py",
        },
    ),
    # Python alone: the processes that hold espeak-ng's library, Draco's and Blender's.
    "other programs": (
        {"subprocess", "pty"},
        {
            "jobs/ray_cluster.py",
            "speech/voices/espeak.py",
            "meshes/gltf_arrays.py",
            "meshes/fbx_gltf.py",
        },
    ),
    # There it is told to report nothing to its maker.
    "onnxruntime": ({"onnxruntime"}, {"files/onnx_session.py"}),
}
TEXT_ALONE = {"urllib.parse"}
"""Modules of such a package that open nothing."""
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


def offences(tree: ast.AST, place: str) -> list[str]:
    """`rule: place:line name` for everything in a source that SECURITY.md rules out."""
    found: list[str] = []
    for rule, (modules, homes) in MODULES.items():
        found += [
            f"{rule}: {place}:{line} {name}"
            for line, name in imported(tree)
            if name.split(".")[0] in modules and place not in homes and name not in TEXT_ALONE
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


# The one mechanism by which a package loads its own names when they are first asked for.
LAZY = re.compile(r"(.+/)?__init__\.py|lazy_loading\.py")


def dynamic_imports(tree: ast.AST, place: str) -> list[str]:
    """Calls of import_module that hide an arrow between packages from the drawn layers.

    A registry may load a module that lies beside it, by a name that begins with its own package;
    another's library may be loaded by a name in quotes.
    """
    package = ".".join(("elocute", *Path(place).parent.parts))
    found: list[str] = []
    for node in ast.walk(tree):
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
            found.append(f"an import by name: {place}:{node.lineno} {ast.unparse(node)}")
    return found


FLAG = re.compile(r"(?<![\w-])--[a-z][a-z-]*")
OTHERS = ("ray get-auth-token --generate", "ray start --head")
"""Commands of other programs, which have no other name."""


def flags_in(tree: ast.AST, place: str) -> list[str]:
    """Flags in the texts of the library, docstrings included; only the command line has any."""
    found: list[str] = []
    if place.startswith("cli/"):
        return found
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            plain = node.value
            for other in OTHERS:
                plain = plain.replace(other, "")
            found += [f"a flag: {place}:{node.lineno} {flag}" for flag in FLAG.findall(plain)]
    return found


RULES = (offences, dynamic_imports, flags_in)


def broken_by(text: str, place: str) -> list[str]:
    """Everything in a source that a rule forbids; place: its path below the package."""
    tree = ast.parse(text)
    return [line for rule in RULES for line in rule(tree, place)]


def main() -> int:
    told = [
        line
        for path in sorted(SOURCE.rglob("*.py"))
        for line in broken_by(path.read_text(encoding="utf-8"), path.relative_to(SOURCE).as_posix())
    ]
    print("\n".join(told), end="\n" if told else "")
    return bool(told)


if __name__ == "__main__":
    sys.exit(main())
