"""What is public: the names that packages list in `__all__`, and nothing else.

That each loads and says what it is, and that documents use no other, is checked by
scripts/public_names.py.
"""

from __future__ import annotations

import pkgutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import elocute
from scripts import public_names
from scripts.public_names import HOMES

INSIDES = (
    "cli",
    "files",
    "jobs",
    "live",
    "meshes",
    "networks",
    "numerics",
    "plots",
    "registration",
    "serving",
)
"""Packages in which nothing is public."""


def test_every_package_says_what_is_public_or_is_an_inside() -> None:
    packages = {
        module.name
        for module in pkgutil.iter_modules(elocute.__path__)
        if module.ispkg and module.name not in INSIDES
    }
    assert {f"elocute.{name}" for name in packages} <= set(HOMES)
    assert not [home for home in HOMES if home.split(".")[1:2] and home.split(".")[1] in INSIDES]


def test_a_name_that_there_is_not_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match=r"'elocute\.corpus' has no attribute 'open_crypt'"):
        _ = elocute.corpus.open_crypt  # type: ignore[attr-defined]
    assert isinstance(elocute.corpus, ModuleType)


def test_importing_a_package_loads_nothing_heavy() -> None:
    names = sorted(package for package in HOMES if package != "elocute.motion.edits")
    code = f"import importlib, sys; [importlib.import_module(n) for n in {names}];" + (
        "print([m for m in ('numpy', 'scipy', 'torch', 'av', 'onnxruntime', 'numba', 'pyarrow')"
        " if m in sys.modules])"
    )
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "[]"


@pytest.mark.parametrize(
    ("code", "told"),
    [
        ("from elocute.audio.read import read_audio", "elocute.audio.read.read_audio"),
        ("import elocute\nelocute.corpus.open_crypt()", "elocute.corpus.open_crypt"),
        ("from elocute.corpus import open_corpus\nimport elocute\nelocute.animate", ""),
    ],
)
def test_a_page_that_uses_what_is_not_public_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: str, told: str
) -> None:
    monkeypatch.setattr(public_names, "ROOT", tmp_path)
    (tmp_path / "page.md").write_text(f"# A page\n\n```python\n{code}\n```\n")
    found = list(public_names.private_names(tmp_path / "page.md"))
    assert found == ([f"page.md: {told} is not public"] if told else [])


def test_a_public_name_that_does_not_say_what_it_is_is_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(elocute.corpus.open_corpus, "__doc__", "")
    assert list(public_names.meaning_of("elocute.corpus", "open_corpus")) == [
        "elocute.corpus.open_corpus: no docstring"
    ]


def test_a_function_without_an_example_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    assert not list(public_names.without_example("elocute.life"))
    monkeypatch.setattr(public_names, "PAGES", [])
    named = list(public_names.without_example("elocute.life"))
    assert "elocute.life.resolve_mood: no example in a page or in examples/" in named
