"""`elocute study`: what people see in faces that speak, from a file to a table for a paper."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import typer

from elocute.cli import options
from elocute.cli.command_group import CommandGroup
from elocute.cli.commands import study_report
from elocute.cli.progress import progress_bar
from elocute.errors import StudyError

app = CommandGroup("Run perceptual studies.")
app.command("report")(study_report.report_command)
app.command("plan")(study_report.plan_command)
app.command("simulate")(study_report.simulate_command)
ANSWERS = "answers.db"
ADMIN_TOKEN = "ELOCUTE_STUDY_ADMIN_TOKEN"
Folder = typer.Argument(..., help="A study's folder, as `elocute study new` made it.")
Database = typer.Option(
    "", help="PostgreSQL, postgresql://USER@HOST/NAME; by default answers.db in the folder."
)


@app.command("new")
def new_command(
    study: Path = typer.Argument(..., help="The file of the study (study.toml)."),
    output: Path = typer.Option(
        ..., "-o", "--output", help="Folder for its videos; one that was begun is completed."
    ),
    data: Path | None = typer.Option(
        None, help="Folder of the files it names; by default its own."
    ),
    jobs: int = typer.Option(1, help="Number of processes; 0 takes all processors."),
    as_json: bool = options.Json,
) -> None:
    """Make the videos of a perceptual study, once, with a manifest of checksums.

    A run that was cut off goes on where it was, and only what changed is made again.
    """
    from elocute.jobs.pool import one_after_another
    from elocute.jobs.process_pool import checked_jobs, local_pool
    from elocute.study.design.trials import minutes_of, sequence
    from elocute.study.stimuli.manifest import open_study
    from elocute.study.stimuli.stimuli import make_stimuli

    pool = one_after_another if checked_jobs(jobs) == 1 else local_pool(jobs)
    with progress_bar("making videos", as_json) as progress:
        stimuli = make_stimuli(study, output, data=data, pool=pool, progress=progress)
    design = open_study(output).design
    shown = sequence(design, 1, 0)
    minutes = minutes_of(shown, {v.name: v.seconds for v in stimuli.manifest.videos.values()})
    record = {
        "folder": str(output),
        "videos": len(stimuli.manifest.videos),
        "rendered": stimuli.rendered,
        "kept": stimuli.kept,
        "megabytes": round(sum(v.size for v in stimuli.manifest.videos.values()) / 1e6, 2),
        "trials": len(shown),
        "minutes": round(minutes, 1),
        "notes": list(stimuli.manifest.notes),
    }
    if as_json:
        print(json.dumps(record))
        return
    print(
        f"{record['videos']} videos ({stimuli.rendered} made now, {record['megabytes']} MB); each "
        f"person sees {len(shown)} trials in about {minutes:.0f} minutes"
    )
    for note in stimuli.manifest.notes:
        print(f"elocute: {note}", file=sys.stderr)


@app.command("serve")
def serve_command(
    folder: Path = Folder,
    port: int = typer.Option(8765, min=0, max=65535, help="Port; 0 takes a free one."),
    public: list[str] | None = typer.Option(
        None,
        help="A name under which others reach this server (study.example.org), which then listens "
        "for them. Can be repeated; by default it answers this machine alone.",
    ),
    address: str = typer.Option("", help="Address to listen on; with --public all of them."),
    behind_proxy: bool = typer.Option(
        False, help="A web server on this machine, with the certificate, passes requests on."
    ),
    database: str = Database,
    invited: bool = typer.Option(False, help="Let people in by personal links alone."),
    texts: Path | None = typer.Option(None, help="Folder with LANGUAGE.json of more languages."),
    joins: int = typer.Option(
        240, min=1, help="People who may begin in a minute from one address."
    ),
) -> None:
    """Serve a perceptual study: a page for phone and desk, answers stored as they come.

    An answer is acknowledged once it is on the disk. With --public the environment variable
    ELOCUTE_STUDY_ADMIN_TOKEN has to be set; who knows it may ask for the answers at
    /admin/answers.csv.
    """
    from elocute.serving.connections import serve
    from elocute.serving.listening import listening
    from elocute.study.serving.server import (
        Serving,
        StudyService,
        check_admin_token,
        read_texts,
        study_app,
    )
    from elocute.study.serving.store import Store
    from elocute.study.stimuli.manifest import open_study

    token = os.environ.get(ADMIN_TOKEN, "")
    check_admin_token(token, bool(public))
    study = open_study(folder)
    study.check_videos()
    spoken = read_texts(study.design.study.languages, texts)
    opened = listening(address or ("0.0.0.0" if public else "127.0.0.1"), port)
    store = Store(study.design, database or folder / ANSWERS)
    serving = Serving(tuple(public or ()), token, invited, joins)
    port = opened.getsockname()[1]
    app = study_app(StudyService(study, store, serving, spoken), port)
    reached = public[0] if public else f"127.0.0.1:{port}"
    print(f"serving {study.design.study.title!r} at http://{reached}/ (Ctrl-C ends)", flush=True)
    try:
        serve(app, opened, behind_proxy=behind_proxy)
    finally:
        store.close()


@app.command("links")
def links_command(
    folder: Path = Folder,
    count: int = typer.Option(..., min=1, max=10_000, help="Number of links."),
    site: str = typer.Option("http://127.0.0.1:8765", help="Address of the study."),
    database: str = Database,
) -> None:
    """Make personal links, one for each participant, for a study served with --invited.

    A link brings back the person who used it first, on any device.
    """
    from elocute.study.serving.store import Store
    from elocute.study.stimuli.manifest import open_study

    store = Store(open_study(folder).design, database or folder / ANSWERS)
    try:
        for token in store.make_links(count):
            print(f"{site.rstrip('/')}/#link={token}")
    finally:
        store.close()


@app.command("export")
def export_command(
    folder: Path = Folder,
    output: list[Path] = typer.Option(
        ..., "-o", "--output", help="Table of answers: .csv, .json or .parquet. Can be repeated."
    ),
    participants: Path | None = typer.Option(
        None, help="Also who took part (.json): state, completion code, checks, how it played."
    ),
    database: str = Database,
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
) -> None:
    """Write the answers of a study as a table, at any time, while it is served or after."""
    from elocute.cli.outputs import check_file_suffix, plan_files
    from elocute.files.json_records import write_record
    from elocute.study.report.answers import SUFFIXES, write_answers
    from elocute.study.serving.store import Store
    from elocute.study.stimuli.manifest import open_study

    for path in output:
        check_file_suffix(path, *SUFFIXES)
    check_file_suffix(participants, ".json")
    design = open_study(folder).design
    source = database or folder / ANSWERS
    if isinstance(source, Path) and not source.is_file():
        raise StudyError.about(
            source, found="no such file", allowed="answers", remedy="`elocute study serve` first"
        )
    origin = f"the answers of {design.sha256[:12]}"
    plan = plan_files(
        [folder / "study.toml", origin], [*output, participants], overwrite, no_clobber
    )
    store = Store(design, source)
    try:
        answers, people = store.answers(), store.people()
    finally:
        store.close()
    for path in plan.wanted(output):
        with plan.writing(path):
            write_answers(answers, path)
        print(f"{path}: {len(answers)} answers")
    if participants is not None and plan.wants(participants):
        with plan.writing(participants):
            write_record(participants, {"participants": people}, indent=1)
        print(f"{participants}: {len(people)} participants")
