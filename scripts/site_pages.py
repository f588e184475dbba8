"""MkDocs hook: pages that are made from what stands elsewhere, so that nothing is written twice.

Home, Contributing, Changelog, Security and Licence are the files of the repository's root; Commands
is what each command prints for `--help`; Python API has a page for each package with public names.
"""

from __future__ import annotations

import importlib
import inspect
import posixpath
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File

ROOT = Path(__file__).parents[1]
ROOT_PAGES = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "SECURITY.md": "security.md",
    "NOTICE": "licence.md",
    "LICENSE": "licence.md",
    "docs/cards": "cards/index.md",
    "docs/decisions": "decisions/index.md",
}
LISTED = {
    "cards": (
        "Cards",
        "What each part that ships was made from, how well it does, and what it cannot do.",
    ),
    "decisions": ("Decisions", "Why things are as they are, one page for each decision."),
}
HELP_COLUMNS = 90
WITHOUT_SIDEBAR = "---\nhide: [navigation]\n---\n"
LINK = re.compile(r"(\]\()([^)#:\s]+)((?:#[^)\s]*)?\))")


def on_config(config: Any) -> Any:
    """Fill the parts of the navigation that follow from files."""
    found: dict[str, list[Any]] = {"Python API": [{name: api_page(name)} for name in packages()]}
    for folder, (title, _) in LISTED.items():
        pages = [{name: place} for name, place in listed(folder)]
        found[title] = [f"{folder}/index.md", *pages]
    for section in (pages for part in config.nav for pages in part.values()):
        for entry in section if isinstance(section, list) else ():
            for title in found.keys() & (entry if isinstance(entry, dict) else {}):
                entry[title] = found[title]
    return config


def on_files(files: Any, config: Any) -> Any:
    """Add the pages that are made here."""
    for source in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md"):
        text = (ROOT / source).read_text(encoding="utf-8")
        before = WITHOUT_SIDEBAR if source == "README.md" else ""
        files.append(made(config, ROOT_PAGES[source], before + relinked(text, "")))
    files.append(made(config, "licence.md", licence_page()))
    files.append(made(config, "reference/commands.md", commands_page()))
    for folder in LISTED:
        files.append(made(config, f"{folder}/index.md", list_page(folder)))
    for name in packages():
        files.append(made(config, api_page(name), public_page(name)))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Links from docs/ to files of the root lead to their pages."""
    if page.file.generated_by:
        return markdown
    return relinked(markdown, posixpath.join("docs", posixpath.dirname(page.file.src_uri)))


def made(config: Any, place: str, text: str) -> File:
    return File.generated(config, place, content=text)


def relinked(markdown: str, folder: str) -> str:
    """Markdown whose links start in `folder` of the repository, for the page made of it."""

    def lead(found: re.Match[str]) -> str:
        before, target, after = found.groups()
        there = posixpath.normpath(posixpath.join(folder, target))
        if there in ROOT_PAGES:
            inside = ROOT_PAGES[there]
        elif there.startswith("docs/"):
            inside = there.removeprefix("docs/")
        else:
            return found.group()
        start = posixpath.relpath(folder or ".", "docs") if folder else "."
        return before + posixpath.relpath(inside, start) + after

    return LINK.sub(lead, markdown)


def listed(folder: str) -> list[tuple[str, str]]:
    """Title and place of each page of a folder of docs/."""
    pages = sorted((ROOT / "docs" / folder).glob("*.md"))
    titles = [path.read_text(encoding="utf-8").partition("\n")[0] for path in pages]
    short = [title.removeprefix("# ").removeprefix("Card: ").replace("`", "") for title in titles]
    return [
        (title[0].upper() + title[1:], f"{folder}/{path.name}")
        for title, path in zip(short, pages, strict=True)
    ]


def list_page(folder: str) -> str:
    title, intro = LISTED[folder]
    rows = [f"- [{name}]({place.removeprefix(f'{folder}/')})" for name, place in listed(folder)]
    return "\n".join([f"# {title}", "", intro, "", *rows, ""])


def licence_page() -> str:
    notice = (ROOT / "NOTICE").read_text(encoding="utf-8")
    licence = (ROOT / "LICENSE").read_text(encoding="utf-8")
    return (
        f"# Licence\n\n## Notice\n\n```text\n{notice}```\n\n## Apache License 2.0\n\n"
        f"```text\n{licence}```\n"
    )


def packages() -> list[str]:
    """`elocute` and its packages that have public names."""
    homes = sorted((ROOT / "src/elocute").rglob("__init__.py"))
    return [
        ".".join(home.parent.relative_to(ROOT / "src").parts)
        for home in homes
        if re.search(r"^(__all__|.*\blazy\(__name__)", home.read_text(encoding="utf-8"), re.M)
    ]


def public_page(package: str) -> str:
    """What a package says of itself, and each of its public names."""
    loaded = importlib.import_module(package)
    parts = [f"# {package}", inspect.cleandoc(loaded.__doc__ or "")]
    if package == "elocute":
        parts += ["## Settings of a take", take_settings()]
    names = [name for name in loaded.__all__ if name != "__version__"]
    shown = "    options:\n      show_root_heading: true\n      show_root_toc_entry: true\n"
    return "\n\n".join([*parts, *(f"::: {package}.{name}\n{shown}" for name in names)])


def take_settings() -> str:
    """The settings that `animate`, `say` and `stream` take by name."""
    from elocute.models.take_settings import TakeSettings
    from elocute.settings import settings_of

    rows = [
        f"- **`{each.name}`** (`{each.type}`, by default `{each.default}`): {known.text}"
        for each, known in settings_of(TakeSettings)
    ]
    return "\n".join(
        ["`animate` and `say` take these by name; `stream` all but the last four.", "", *rows]
    )


def api_page(package: str) -> str:
    return f"reference/api/{package}.md"


def commands_page() -> str:
    """Every command under its name, with what it prints for `--help`."""
    import typer.main

    from elocute.cli.app import command_line

    parts = [
        "# Commands\n\nEvery command prints this by `--help`. `python -m elocute` is the same "
        "program as `elocute`.\n"
    ]
    for context in every_command(typer.main.get_command(command_line())):
        name = context.command_path
        level = "##" if name.count(" ") < 2 else "###"
        parts.append(f"{level} {name}\n\n```text\n{context.get_help()}\n```\n")
    return "\n".join(parts)


def every_command(command: Any, name: str = "elocute", above: Any = None) -> Iterator[Any]:
    """A context for each command, a group before its own."""
    context = command.make_context(
        name,
        [],
        resilient_parsing=True,
        parent=above,
        terminal_width=HELP_COLUMNS,
        max_content_width=HELP_COLUMNS,
    )
    yield context
    for below, child in sorted(getattr(command, "commands", {}).items()):
        yield from every_command(child, below, context)
