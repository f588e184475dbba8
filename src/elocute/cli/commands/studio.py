"""`elocute studio`: takes seen, corrected and kept in a page of this machine."""

from __future__ import annotations

import contextlib
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from elocute.cli import options
from elocute.errors import InputError

if TYPE_CHECKING:
    from elocute.studio.folder import StudioFolder


def studio_command(
    place: Path = typer.Argument(
        Path(), help="Folder of projects; or one of its projects, NAME.elocute.json."
    ),
    port: int = typer.Option(8750, min=0, max=65535, help="Port; 0 takes a free one."),
    host: str = typer.Option(
        "127.0.0.1", help="Address to listen on, in numbers; others need --allow-remote."
    ),
    allow_remote: bool = typer.Option(
        False, "--allow-remote", help="Also let other machines in, unencrypted, by the link."
    ),
    show: bool = typer.Option(True, "--open/--no-open", help="Open the page in a browser."),
    recogniser: str | None = typer.Option(
        None,
        help="Whisper model that finds out what is said: a folder, or a name whose model this "
        "machine has. [default: base]",
    ),
    export: Path | None = typer.Option(
        None,
        help="Write a folder of pages instead, one for each project, that need no server.",
    ),
    overwrite: bool = options.Overwrite,
) -> None:
    """See, correct and keep takes in a page; each is a project file that `elocute render` takes.

    The page needs the link that is printed, since a token is in it. Projects, sounds and exports
    are files of the folder.
    """
    from elocute.speech.text.recogniser import DEFAULT_RECOGNISER, recogniser_folder
    from elocute.studio.folder import StudioFolder
    from elocute.studio.project import open_project
    from elocute.studio.project_names import is_project, project_name

    opens = ""
    if is_project(place):
        open_project(place)
        opens, place = project_name(place), place.parent
    folder = StudioFolder(place)
    if export is not None:
        _export(folder, opens, export, overwrite)
        return
    _check_host(host, allow_remote)
    if recogniser is not None:
        recogniser_folder(recogniser)
    chosen = recogniser or DEFAULT_RECOGNISER
    _serve(folder, (opens, chosen), (host, port), allow_remote, show)


def _check_host(host: str, allow_remote: bool) -> None:
    from ipaddress import ip_address

    try:
        is_local = ip_address(host).is_loopback
    except ValueError:
        raise InputError.about(
            "--host", found=repr(host[:60]), allowed="an address in numbers, such as 127.0.0.1"
        ) from None
    if not is_local and not allow_remote:
        raise InputError.about(
            "--host",
            found=f"{host}, which other machines reach",
            allowed="this machine's own addresses",
            remedy="--allow-remote lets others in, unencrypted",
        )


def _serve(
    folder: StudioFolder,
    chosen: tuple[str, str],
    place: tuple[str, int],
    remote: bool,
    show: bool,
) -> None:
    """Serve the page until it is told to end; chosen: what it opens, and its recogniser."""
    from elocute.files.atomic import working_folder
    from elocute.serving.connections import serve
    from elocute.serving.listening import listening
    from elocute.studio.server import WHOLE_S, new_token, studio_app
    from elocute.studio.session import Studio

    host = "0.0.0.0" if remote and place[0] == "127.0.0.1" else place[0]
    opened = listening(host, place[1])
    port = opened.getsockname()[1]
    named = f"[{place[0]}]" if ":" in place[0] else place[0]
    with working_folder(folder.folder, "studio") as cache:
        studio = Studio(folder, cache, new_token(), *chosen)
        try:
            studio.warm()
            app = studio_app(studio, port, (named,), remote=remote)
            link = f"http://{named}:{port}/?token={studio.token}"
            print(f"the studio of {folder.folder}: {link} (Ctrl-C ends)", flush=True)
            if show:
                _show(link)
            serve(app, opened, whole_s=WHOLE_S, message_max_bytes=4_096)
        finally:
            studio.close()


def _show(link: str) -> None:
    """Open a browser where there is one; the link is printed anyway."""
    import webbrowser

    with contextlib.suppress(webbrowser.Error, OSError):
        webbrowser.open(link)


def _export(folder: StudioFolder, opens: str, target: Path, overwrite: bool) -> None:
    """Write pages of one project, or of all."""
    from elocute.cli.progress import progress_bar
    from elocute.errors import printable
    from elocute.studio.pages import write_pages

    names = [opens] if opens else sorted(each["name"] for each in folder.projects())
    with progress_bar(f"writing {target.name}", False) as progress:
        notes = write_pages(folder, names, target, overwrite=overwrite, progress=progress)
    for note in notes:
        print(f"elocute: {printable(note)}", file=sys.stderr)
    print(target / "index.html")
