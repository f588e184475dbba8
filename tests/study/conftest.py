"""One small study of flashes for all tests of it, and its server."""

from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("fastapi")
pytest.importorskip("sqlalchemy")

from elocute.study.stimuli.stimuli import make_stimuli
from tests.study.studies import HEAD, QUICK, VIDEOS, Asker, served, two_folders


@pytest.fixture(scope="session")
def videos(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with two folders of videos in it."""
    folder = tmp_path_factory.mktemp("videos")
    two_folders(folder)
    return folder


@pytest.fixture(scope="session")
def flashes(videos: Path) -> Path:
    """The folder of a study of both."""
    path = videos / "study.toml"
    path.write_text(HEAD + VIDEOS + QUICK)
    make_stimuli(path, videos / "study")
    return videos / "study"


@pytest.fixture(scope="module")
def host(flashes: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Its server, with a database of its own."""
    database = tmp_path_factory.mktemp("answers") / "answers.db"
    token = {"ELOCUTE_STUDY_ADMIN_TOKEN": "a-token-of-the-tests"}
    with served(flashes, "--database", f"sqlite:///{database}", environment=token) as host:
        yield host


@pytest.fixture
def asker(host: str) -> Iterator[Asker]:
    made = Asker(host)
    yield made
    made.close()
