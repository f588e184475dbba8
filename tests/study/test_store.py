"""What is stored: once, durably, and deleted for good; in SQLite and in PostgreSQL."""

import contextlib
import os
import shutil
import sqlite3
import subprocess
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from elocute.errors import StudyError
from elocute.study.design.design import (
    Assignment,
    Catch,
    Condition,
    Design,
    Panel,
    Qualification,
    Stimuli,
    StimulusSound,
    Study,
    Watching,
)
from elocute.study.design.trials import block_trials
from elocute.study.serving.store import DONE, STOPPED, RefusedError, Store, StoreError

SOUNDS = tuple(StimulusSound(f"s{n}", f"s{n}.wav") for n in range(4))
DESIGN = Design(
    Study(title="T", kind="binary", contact="C"),
    tuple(Condition(name=f"c{n}", model="voca") for n in range(2)),
    Stimuli(sounds=SOUNDS),
    assignment=Assignment(blocks=2),
    qualification=Qualification(items=2, right=2),
    catch=Catch(every=0),
    watching=Watching(practice=0),
    sha256="0" * 64,
)


def programs() -> Path | None:
    """Where PostgreSQL's own programs are."""
    found = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"))
    on_path = shutil.which("initdb")
    return found[-1].parent if found else Path(on_path).parent if on_path else None


@pytest.fixture(scope="module")
def postgres(need, tmp_path_factory) -> Iterator[str]:
    """A server of one's own, on a socket in a folder; its URL."""
    pytest.importorskip("psycopg")
    bin_folder = programs()
    need(bin_folder, "postgresql")
    folder = tmp_path_factory.mktemp("postgres")
    assert bin_folder is not None
    user = "postgres" if os.geteuid() == 0 else None  # the server refuses to run as root
    if user:
        open_to_all = Path(os.devnull).stat().st_mode & 0o002
        need(open_to_all, f"{os.devnull} that every user may write (chmod 666), for PostgreSQL")
        for each in (folder, *list(folder.parents)[:3]):
            if each != Path("/tmp"):
                each.chmod(0o755)
        shutil.chown(folder, "postgres")

    def run(*words: str) -> None:
        subprocess.run(
            [str(bin_folder / words[0]), *words[1:]],
            check=True,
            capture_output=True,
            cwd=folder,
            env={"LC_ALL": "C", "PATH": "/usr/bin:/bin"},
            user=user,
        )

    data = str(folder / "data")
    run("initdb", "-D", data, "-E", "UTF8", "-A", "trust", "-U", "study", "--no-sync")
    flags = f"-k {folder} -c listen_addresses= -c fsync=off"
    run("pg_ctl", "-D", data, "-w", "-o", flags, "-l", str(folder / "log"), "start")
    yield f"postgresql://study@/postgres?host={folder}"
    run("pg_ctl", "-D", data, "-m", "immediate", "stop")


@pytest.fixture(params=["sqlite", "postgresql"])
def database(request, tmp_path):
    if request.param == "sqlite":
        return tmp_path / "answers.db"
    url = request.getfixturevalue("postgres")
    import sqlalchemy as sql

    engine = sql.create_engine(url.replace("postgresql:", "postgresql+psycopg:"))
    with engine.begin() as connection:
        connection.exec_driver_sql("DROP SCHEMA public CASCADE")
        connection.exec_driver_sql("CREATE SCHEMA public")
    engine.dispose()
    return url


@pytest.fixture
def store(database):
    with contextlib.closing(Store(DESIGN, database)) as opened:
        yield opened


def finish(store, person, *, right=True):
    """Answer to the end, obvious items right or wrong."""
    while (shown := person.next) is not None and person.state == "active":
        correct = shown.trial.correct
        wrong = shown.right if correct == shown.left else shown.left
        given = (correct if right else wrong) if correct else shown.left
        person = store.answer(person, shown.order, given, seconds=1, replays=0)
    return person


def test_a_person_comes_to_the_end_and_has_a_code(store):
    token, person = store.join("en")
    assert person.next is not None and person.next.order == 1
    person = finish(store, person)
    assert person.state == DONE and len(person.code) == 10
    assert store.person(token) == person
    answers = store.answers()
    assert [each.order for each in answers] == list(range(1, 5))
    assert {each.participant for each in answers} == {person.id}
    assert store.counts() == {"active": 0, "done": 1, "stopped": 0, "answers": 4}


def test_who_misses_an_obvious_item_stops(store):
    _, person = store.join("en")
    person = finish(store, person, right=False)
    assert person.state == STOPPED and person.answered == 2
    with pytest.raises(RefusedError, match="order"):
        store.answer(person, 3, "c0", seconds=1, replays=0)


def test_an_answer_is_stored_once_and_stays_as_it_was(store):
    _, person = store.join("en")
    assert person.next is not None
    first = store.answer(person, 1, person.next.left, seconds=1, replays=0)
    again = store.answer(person, 1, person.next.right, seconds=9, replays=3)
    assert again == first
    (answer,) = store.answers()
    assert (answer.answer, answer.seconds, answer.replays) == (person.next.left, 1.0, 0)


@pytest.mark.parametrize("order", [2, 3, 99])
def test_answers_come_in_their_order(store, order):
    _, person = store.join("en")
    with pytest.raises(RefusedError, match="order"):
        store.answer(person, order, "c0", seconds=1, replays=0)
    assert store.answers() == []


def test_many_at_once_store_one_answer(store):
    _, person = store.join("en")
    results = []

    def send(side):
        results.append(store.answer(person, 1, side, seconds=1, replays=0).answered)

    threads = [threading.Thread(target=send, args=(side,)) for side in ("c0", "c1") * 4]
    for each in threads:
        each.start()
    for each in threads:
        each.join()
    assert results == [1] * 8 and len(store.answers()) == 1


def test_blocks_fill_evenly(store):
    people = [store.join("en")[1] for _ in range(6)]
    assert sorted(each.block for each in people) == [1, 1, 1, 2, 2, 2]
    places = {(each.block, each.visit) for each in people}
    assert len(places) == 6
    seen = {e.trial.name for p in people[:2] for e in p.shown if e.trial.role == "test"}
    assert seen == {e.name for block in (1, 2) for e in block_trials(DESIGN, block)}


def test_places_are_limited_and_those_who_left_give_theirs_up(database):
    now = 1_000_000.0
    few = replace(DESIGN, assignment=Assignment(participants=2))
    with contextlib.closing(Store(few, database, clock=lambda: now)) as store:
        finish(store, store.join("en")[1])
        _, absent = store.join("en")
        with pytest.raises(RefusedError, match="full"):
            store.join("en")
        now += 10_000
        finish(store, store.join("en")[1])
        assert finish(store, absent).state == DONE  # who comes back late may still finish


def test_a_link_is_one_person_s(store):
    link, other = store.make_links(2)
    token, person = store.join("en", link)
    again, same = store.join("de", link)
    assert same.id == person.id and store.person(token) is None
    assert store.person(again) is not None
    assert store.join("en", other)[1].id != person.id
    for wrong in ("x" * 32, token):
        with pytest.raises(RefusedError, match="link"):
            store.join("en", wrong)
    store.withdraw(same)
    with pytest.raises(RefusedError, match="link"):
        store.join("en", link)


def test_who_withdraws_is_deleted(store, database):
    token, person = store.join("en")
    finish(store, person)
    kept = finish(store, store.join("en")[1])
    store.withdraw(person)
    assert store.person(token) is None
    assert {each.participant for each in store.answers()} == {kept.id}
    with pytest.raises(RefusedError, match="gone"):
        store.answer(person, 5, "c0", seconds=1, replays=0)
    if isinstance(database, Path):
        for path in database.parent.glob("answers.db*"):
            assert person.id.encode() not in path.read_bytes(), path


def test_neither_token_nor_link_is_in_the_file(tmp_path):
    path = tmp_path / "answers.db"
    with contextlib.closing(Store(DESIGN, path)) as store:
        tokens = [store.join("en")[0], *store.make_links(1)]
    data = b"".join(each.read_bytes() for each in tmp_path.glob("answers.db*"))
    assert all(each.encode() not in data for each in tokens)


def test_another_study_s_answers_are_refused(store, database):
    with pytest.raises(StudyError, match=r"another study\.toml"):
        Store(replace(DESIGN, sha256="1" * 64), database)


def test_what_an_older_one_wrote_is_brought_up_to_date(tmp_path):
    path = tmp_path / "answers.db"
    with contextlib.closing(Store(DESIGN, path)) as store:
        finish(store, store.join("en")[1])
        before = store.answers()
    with contextlib.closing(sqlite3.connect(path)) as old:
        old.execute("ALTER TABLE study_answers DROP COLUMN late_ms")
        old.execute("ALTER TABLE study_answers DROP COLUMN dropped")
        old.execute("ALTER TABLE study_participants DROP COLUMN panel")
        old.execute("UPDATE study_facts SET value = '1' WHERE name = 'schema'")
        old.commit()
    with contextlib.closing(Store(DESIGN, path)) as store:
        assert store.answers() == before
        _, person = store.join("en")
        assert person.next is not None
        store.answer(person, 1, person.next.left, seconds=1, replays=0, late_ms=4.5, dropped=1)
        assert store.people()[-1]["late_ms"] == 4.5


def test_what_a_newer_one_wrote_is_left_alone(tmp_path):
    path = tmp_path / "answers.db"
    Store(DESIGN, path).close()
    with contextlib.closing(sqlite3.connect(path)) as new:
        new.execute("UPDATE study_facts SET value = '99' WHERE name = 'schema'")
        new.commit()
    with pytest.raises(StudyError, match="schema 99"):
        Store(DESIGN, path)


@pytest.mark.parametrize("url", ["nonsense", "mysql://a@b/c", "oracle://x", "://"])
def test_other_databases_are_refused(url):
    with pytest.raises(StudyError, match="postgresql"):
        Store(DESIGN, url)


def test_a_database_that_is_not_there_is_told_in_one_line(tmp_path):
    pytest.importorskip("psycopg")
    with pytest.raises(StoreError, match="cannot be stored") as error:
        Store(DESIGN, f"postgresql://study@/none?host={tmp_path}")
    assert "\n" not in str(error.value)


def test_a_file_that_is_no_database_is_told(tmp_path):
    path = tmp_path / "answers.db"
    path.write_bytes(b"something else entirely, long enough to be looked at" * 20)
    with pytest.raises(StoreError, match="not a database"):
        Store(DESIGN, path)


def test_answers_are_readable_for_their_owner_alone(tmp_path):
    path = tmp_path / "answers.db"
    with contextlib.closing(Store(DESIGN, path)) as store:
        store.join("en")
        modes = {each.name: each.stat().st_mode & 0o777 for each in tmp_path.glob("answers.db*")}
    assert len(modes) == 3 and set(modes.values()) == {0o600}, modes


def test_the_same_id_of_a_panel_is_the_same_person(tmp_path):
    with contextlib.closing(Store(DESIGN, tmp_path / "answers.db")) as store:
        first, person = store.join("en", panel={"id": "5f0c", "session": "1"})
        second, again = store.join("en", panel={"id": "5f0c", "session": "2"})
        assert again.id == person.id and again.panel == {"id": "5f0c", "session": "1"}
        assert store.person(first) is None and store.person(second) == again
        assert store.join("en", panel={"id": "other"})[1].id != person.id
        store.withdraw(again)
        with pytest.raises(RefusedError, match="again"):
            store.join("en", panel={"id": "5f0c"})


def test_codes_of_a_panel_are_those_that_the_study_fixes(tmp_path):
    panel = Panel(return_to="https://p.example/?cc={code}", done_code="C1", stopped_code="S1")
    with contextlib.closing(Store(replace(DESIGN, panel=panel), tmp_path / "answers.db")) as store:
        assert [store.code_of(state, "own") for state in ("active", "done", "stopped")] == [
            "",
            "C1",
            "S1",
        ]
