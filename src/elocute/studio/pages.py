"""A folder of pages that show a studio's takes without a server: one of each project, and a list.

Each is the page that `elocute render NAME.elocute.json -o NAME.html` writes: nothing is computed in
it, and nothing can be changed.
"""

from __future__ import annotations

import html
from collections.abc import Callable, Sequence
from pathlib import Path
from urllib.parse import quote

from elocute.errors import InputError
from elocute.files.atomic import write_folder_atomically
from elocute.files.output_plan import OutputPlan
from elocute.studio.folder import StudioFolder
from elocute.studio.project import Project, open_project

INDEX = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="content-security-policy" content="default-src 'none'; style-src 'unsafe-inline'">
<title>Takes</title>
<style>
:root {{ color-scheme: light dark; font: 16px/1.5 system-ui, sans-serif }}
main {{ max-width: 40rem; margin: 3rem auto; padding: 0 1rem }}
li {{ margin: .5rem 0 }}
</style>
<main>
<h1>Takes</h1>
<ul>
{rows}
</ul>
</main>
</html>
"""


def write_pages(
    folder: StudioFolder,
    names: Sequence[str],
    target: Path,
    *,
    overwrite: bool = False,
    progress: Callable[[float], None] | None = None,
) -> list[str]:
    """Write a page of each project, and `index.html`, into a new folder, whole or not at all.

    A folder that this wrote before is replaced. What to know of the takes is given back. Raises
    OutputError for another folder that is there, InputError for no projects, and what takes raise.
    """
    if not names:
        raise InputError.about(
            folder.folder, found="no projects", allowed="NAME.elocute.json", remedy="make one first"
        )
    plan = OutputPlan()
    plan.add(target, *(folder.existing(name) for name in names))
    plan.check(overwrite=overwrite)
    notes: list[str] = []
    with plan.writing(target), write_folder_atomically(target) as room:
        rows = []
        for place, name in enumerate(names):
            project = open_project(folder.existing(name))
            try:
                made = project.animate()
            except InputError as error:
                raise type(error)(f"{name}: {error}") from None
            page = room / f"{name}.html"
            made.write(page, **project.options_of(page))
            notes += [f"{name}: {note}" for note in made.notes]
            rows.append(_row(name, project))
            if progress is not None:
                progress((place + 1) / len(names))
        (room / "index.html").write_text(INDEX.format(rows="\n".join(rows)), encoding="utf-8")
    return notes


def _row(name: str, project: Project) -> str:
    text = f" — {html.escape(project.text[:200])}" if project.text else ""
    return f'<li><a href="{quote(name)}.html">{html.escape(name)}</a>{text}</li>'
