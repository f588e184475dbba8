"""A studio while it runs: its folder, its workers, its cache, and the pages that hear of them."""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import json
import shutil
from collections.abc import Collection
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from elocute._version import __version__
from elocute.adoption.characters.given_names import names_path
from elocute.errors import ElocuteError, InputError
from elocute.speech.text.recogniser import DEFAULT_RECOGNISER
from elocute.studio.folder import StudioFolder
from elocute.studio.jobs import DONE, SLOW, Job, Jobs
from elocute.studio.project import Project, project_of
from elocute.studio.work import Task

TAKES, SOUNDS, HEADS = 32, 64, 60
"""How many are kept; the oldest are made again when they are asked for."""
WAIT_S = 600.0
"""How long a page waits for a worker that has other things to do."""


@dataclass
class Studio:
    """What the server knows while it runs.

    Parameters
    ----------
    folder : StudioFolder
        Where projects lie.
    cache : Path
        A folder on the same disk, which is removed at the end.
    token : str
        What who asks has to know.
    opens : str
        The project that the page opens first, "" for none.
    recogniser : str
        The Whisper model that finds out what is said, as `animate` takes it.
    """

    folder: StudioFolder
    cache: Path
    token: str
    opens: str = ""
    recogniser: str = DEFAULT_RECOGNISER
    takes: dict[str, str] = field(default_factory=dict)  # digest of the latest take, by project
    seconds: dict[str, float] = field(default_factory=dict)  # of sounds, by project
    listeners: set[Listener] = field(default_factory=set)
    uploads: int = 0

    def __post_init__(self) -> None:
        self.jobs = Jobs(self.tell)

    @cached_property
    def about(self) -> Job:
        """The job that finds out what a take may be made of."""
        return self.jobs.submit(Task("about", {"recogniser": self.recogniser}))

    def warm(self) -> None:
        """Load what pages ask for first."""
        assert self.about
        self.jobs.submit(Task("warm", {"cache": str(self.cache)}))

    def tell(self, record: dict[str, Any]) -> None:
        """Tell all pages of something, from any thread."""
        for each in list(self.listeners):
            each.put(record)

    def close(self) -> None:
        """End the workers."""
        self.jobs.close()

    def digest(self, project: Project) -> str:
        """What changes with anything that a take depends on."""
        facts = [project.folder / name for name in (project.sound, project.character) if name]
        if project.character:
            facts.append(names_path(project.folder / project.character))
        stamps = [(p.stat().st_size, p.stat().st_mtime_ns) for p in facts if p.is_file()]
        made_of = replace(project, options={}, locks={}).record()
        told = json.dumps([made_of, stamps, __version__], sort_keys=True)
        return hashlib.sha256(told.encode()).hexdigest()[:32]

    async def result(self, task: Task, **more: Any) -> dict[str, Any]:
        """What a task gives, once it is done. Raises InputError with what is wrong with it."""
        return result_of(await ended(self.jobs.submit(task, **more)))

    def preview(self, name: str, project: Project) -> Job:
        """Compute a take of a project; one that is there already is given at once."""
        digest = self.digest(project)
        given = {"project": project.record(), "folder": str(self.folder.folder)}
        task = Task("preview", given | {"cache": str(self.cache), "digest": digest})
        job = self.jobs.submit(task, project=name)
        job.ended.add_done_callback(lambda _: self._keep(name, job, digest))
        return job

    def _keep(self, name: str, job: Job, digest: str) -> None:
        if job.state != DONE:
            return
        self.takes[name] = digest
        with contextlib.suppress(OSError):  # a worker writes there
            keep_latest(self.cache / "takes", TAKES, set(self.takes.values()))
            keep_latest(self.cache / "sounds", SOUNDS)
            keep_latest(self.cache / "heads", HEADS)

    def listen(self, name: str, revision: str) -> None:
        """Find out what is said in a new project, where this machine can; what somebody has saved
        meanwhile stays."""
        about = self.about.result if self.about.state == DONE else {}
        if not about.get("extras", {}).get("transcribe"):
            return
        job = self.transcribe(name)
        job.ended.add_done_callback(lambda _: self._keep_text(name, revision, job))

    def transcribe(self, name: str) -> Job:
        """Recognise the words of a project's sound."""
        given = {"project": str(self.folder.existing(name)), "recogniser": self.recogniser}
        return self.jobs.submit(Task("transcribe", given), lane=SLOW, project=name)

    def _keep_text(self, name: str, revision: str, job: Job) -> None:
        if job.state != DONE or not job.result["text"]:
            return
        with contextlib.suppress(ElocuteError, OSError):  # it was changed meanwhile, or is gone
            data, _ = self.folder.read(name)
            known = replace(project_of(data, self.folder.folder, name), text=job.result["text"])
            self.saved(name, self.folder.save(name, known.text_of_file().encode(), revision))

    def saved(self, name: str, revision: str) -> None:
        """Tell all pages that a project is another now."""
        self.tell(
            {"id": f"project {name}", "what": "project", "project": name, "revision": revision}
        )

    def take_file(self, digest: str, name: str) -> Path:
        """A file of a take. Raises MissingError."""
        path = self.cache / "takes" / digest / name
        if not path.is_file():
            raise MissingError("no take of this; POST …/take computes one")
        return path


def keep_latest(folder: Path, most: int, wanted: Collection[str] = ()) -> None:
    """Remove the oldest of what the cache holds of a kind; those that are wanted stay."""
    kept = sorted(folder.iterdir(), key=lambda each: each.stat().st_mtime)
    for old in kept[:-most]:
        if old.name not in wanted and old.is_dir():
            shutil.rmtree(old, ignore_errors=True)
        elif old.name not in wanted:
            old.unlink(missing_ok=True)


class MissingError(Exception):
    """What is asked for is not there."""


class Listener:
    """A page that hears of jobs: of each the latest alone, however slow the page is."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._waiting: dict[str, dict[str, Any]] = {}
        self._there = asyncio.Event()

    def put(self, record: dict[str, Any]) -> None:
        with contextlib.suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(self._take, record)

    def _take(self, record: dict[str, Any]) -> None:
        self._waiting[str(record.get("id"))] = record
        self._there.set()

    async def next(self) -> list[dict[str, Any]]:
        await self._there.wait()
        self._there.clear()
        records, self._waiting = list(self._waiting.values()), {}
        return records


def result_of(job: Job) -> dict[str, Any]:
    if job.state == DONE:
        return job.result
    raise InputError(job.error or "it was cancelled")


async def ended(job: Job) -> Job:
    async with asyncio.timeout(WAIT_S):
        return await asyncio.wrap_future(job.ended)
