"""A folder with a project, and a studio that is asked without a network."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("fastapi")

from elocute.files.atomic import working_folder
from elocute.studio.folder import StudioFolder
from elocute.studio.project import Project
from elocute.studio.server import studio_app
from elocute.studio.session import Studio
from tests.support.asgi import Answer, asked

PORT, TOKEN = 8750, "a-token-of-the-tests"
JSON = ("content-type", "application/json")


@dataclass
class Page:
    """Asks a studio as its page does."""

    studio: Studio
    app: Any

    @property
    def folder(self) -> Path:
        return self.studio.folder.folder

    def ask(self, method: str, path: str, body: Any = b"", *fields: tuple[str, str]) -> Answer:
        known = [("host", f"127.0.0.1:{PORT}"), ("authorization", f"Bearer {TOKEN}"), *fields]
        return asked(self.app, method, path, body=body, fields=known)

    def get(self, path: str) -> Answer:
        return self.ask("GET", path)

    def post(self, path: str, body: bytes = b"{}") -> Answer:
        return self.ask("POST", path, body, JSON)

    def done(self, started: Answer) -> dict[str, Any]:
        """The record of a job, once it has ended."""
        assert started.status == 202, started.data
        job = self.studio.jobs.find(started.json["job"])
        assert job is not None
        return job.ended.result(300).record()


@pytest.fixture(scope="package")
def page(tmp_path_factory: pytest.TempPathFactory, speech_wav: Path) -> Iterator[Page]:
    """A studio of a folder with the project `line`, of a person who speaks."""
    room = tmp_path_factory.mktemp("takes")
    shutil.copy(speech_wav, room / "line.flac")
    Project(room, "line.flac").save(room / "line.elocute.json")
    with a_page(room) as made:
        yield made


@contextlib.contextmanager
def a_page(room: Path, **more: Any) -> Iterator[Page]:
    """A studio of a folder; more: what else it is told."""
    with working_folder(room, "studio") as cache:
        studio = Studio(StudioFolder(room), cache, TOKEN, **more)
        try:
            yield Page(studio, studio_app(studio, PORT))
        finally:
            studio.close()
