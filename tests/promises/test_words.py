"""scripts/words finds words in documents and in the texts of source files, and nowhere else."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.commands import Result, run_python

ROOT = Path(__file__).parents[2]


def words(*paths: Path) -> Result:
    return run_python(ROOT / "scripts" / "words", *paths)


def test_the_documents_have_none() -> None:
    done = words(ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").rglob("*.md"))
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize(
    ("name", "text", "line"),
    [
        ("page.md", "# Title\n\nClips that teach,\nchoose and judge.\n", 3),
        ("code.py", 'def f():\n    """Raises for a seed that is none."""\n', 2),
        ("code.py", 'import typer\n\nx = typer.Option(1, help="Of Adam.")\n', 3),
    ],
)
def test_a_word_is_found_with_its_place(tmp_path: Path, name: str, text: str, line: int) -> None:
    path = tmp_path / name
    path.write_text(text)
    done = words(path)
    assert done.returncode == 1
    assert f"{name}:{line}:" in done.stdout and "write" in done.stdout


def test_names_and_comments_in_code_are_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "code.py"
    path.write_text("teach_choose_and_judge = 1  # a seed that is none\n")
    assert words(path).returncode == 0
