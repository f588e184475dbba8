"""Who takes part and what was answered, in a database: SQLite beside the study, or PostgreSQL.

What a method returns is durable: SQLite writes ahead and syncs each transaction to the disk
(`synchronous=FULL`), PostgreSQL as it is set up. One person's answers are numbered, and a number is
taken once; what is deleted is overwritten.
"""

from __future__ import annotations

import contextlib
import hashlib
import hmac
import json
import os
import secrets
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from elocute.errors import MachineError, StudyError, needs_extra
from elocute.study.design.design import Design
from elocute.study.design.trials import Clip, Shown, Trial, block_count, sequence
from elocute.study.report.answers import COLUMNS, Answer, answer_to
from elocute.study.serving.clock import SteadyClock

with needs_extra("serving a study", "study"):
    import sqlalchemy as sql
    from sqlalchemy import event
    from sqlalchemy.exc import DBAPIError, IntegrityError, SQLAlchemyError

SCHEMA = 3
TOKEN_BYTES = 24
ABSENT_S = 7_200.0
"""After so long without an answer a place is given to somebody else; the person may still go on."""
TRIES = 5
ACTIVE, DONE, STOPPED = "active", "done", "stopped"
WITHDRAWN = "withdrawn"
"""Of a link whose person had everything deleted."""
CODE_LETTERS = "ABCDEFGHJKMNPQRSTUVWXYZ23456789"

META = sql.MetaData()
FACTS = sql.Table(
    "study_facts",
    META,
    sql.Column("name", sql.String(40), primary_key=True),
    sql.Column("value", sql.Text, nullable=False),
)
PEOPLE = sql.Table(
    "study_participants",
    META,
    sql.Column("id", sql.String(40), primary_key=True),
    sql.Column("token", sql.String(64), nullable=False, unique=True),
    sql.Column("block", sql.Integer, nullable=False),
    sql.Column("visit", sql.Integer, nullable=False),
    sql.Column("language", sql.String(8), nullable=False),
    sql.Column("state", sql.String(10), nullable=False),
    sql.Column("code", sql.String(20), nullable=False),
    sql.Column("checks", sql.Text, nullable=True),
    sql.Column("answered", sql.Integer, nullable=False),
    sql.Column("last_at", sql.Float, nullable=False),
    sql.Column("joined_at", sql.String(30), nullable=False),
    sql.Column("shown", sql.Text, nullable=False),
    sql.Column("panel", sql.Text, nullable=True),
    sql.UniqueConstraint("block", "visit"),
)
AS_STORED = ("id", "block", "visit", "language", "state", "code", "answered", "last_at")
"""Columns that a `Person` has as they are."""
LINKS = sql.Table(
    "study_links",
    META,
    sql.Column("token", sql.String(64), primary_key=True),
    sql.Column("participant", sql.String(40), nullable=True),
)
_KINDS = {"group": sql.Integer, "order": sql.Integer, "replays": sql.Integer, "seconds": sql.Float}


def _answer_column(name: str) -> Any:
    whose = [sql.ForeignKey("study_participants.id", ondelete="CASCADE")]
    return sql.Column(
        name,
        _KINDS.get(name, sql.String(300)),
        *(whose if name == "participant" else []),
        primary_key=name in ("participant", "order"),
        nullable=False,
        autoincrement=False,
    )


ANSWERS = sql.Table(
    "study_answers",
    META,
    *map(_answer_column, COLUMNS),
    sql.Column("late_ms", sql.Float, nullable=True),
    sql.Column("dropped", sql.Integer, nullable=True),
)


@dataclass(frozen=True)
class Person:
    """One participant."""

    id: str  # opaque, as in the table of answers
    # Place in the assignment.
    block: int
    visit: int
    language: str  # of the page
    state: str  # "active", "done" or "stopped"
    code: str  # for a panel, once done
    checks: dict[str, Any] | None  # what the checks of screen and sound found; None before them
    answered: int  # how many trials
    last_at: float  # when the last answer, or what came before the first, was stored; s since 1970
    shown: tuple[Shown, ...]  # the person's sequence
    # What the link of a panel brought: "id", and "study" and "session" where it has them; {} for
    # who came otherwise.
    panel: dict[str, str] = field(default_factory=dict)

    @property
    def next(self) -> Shown | None:
        """The trial to be answered now, None where there is none."""
        return self.shown[self.answered] if self.answered < len(self.shown) else None


class StoreError(MachineError):
    """What a person sent cannot be stored now: a full disk, a database that is gone."""


class RefusedError(Exception):
    """What was asked is not allowed; `reason` is one word for the page."""

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


class Store:
    """The database of one study. Safe to use from several threads.

    Parameters
    ----------
    design : Design
        The study, with every sound by name.
    url : str or Path
        A file of SQLite, or the URL of a database.
    clock : callable, optional
        Seconds since 1970; by default one that never goes back.

    Raises
    ------
    StudyError
        For a database of another study or of a newer Elocute, and a URL that is none.
    StoreError
        For a database that cannot be reached.
    """

    def __init__(
        self, design: Design, url: str | Path, clock: Callable[[], float] | None = None
    ) -> None:
        self.design = design
        self.clock = clock or SteadyClock()
        self._lock = threading.Lock()
        self._shown: dict[str, tuple[Shown, ...]] = {}
        self._engine = _engine(url)
        try:
            with self._writing() as connection:
                _migrate(connection)
                self._check_study(connection)
            with self._reading() as connection:
                self.secret = bytes.fromhex(_fact(connection, "secret") or "")
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Give back every connection."""
        self._engine.dispose()

    def _check_study(self, connection: Any) -> None:
        known = _fact(connection, "design_sha256")
        if known is None:
            facts = {"design_sha256": self.design.sha256, "secret": secrets.token_hex(32)}
            for name, value in facts.items():
                connection.execute(sql.insert(FACTS).values(name=name, value=value))
        elif known != self.design.sha256:
            raise StudyError.about(
                "answers",
                found="those to another study.toml",
                allowed="a database of this study, or a new one",
            )

    @contextmanager
    def _writing(self) -> Iterator[Any]:
        """A transaction; it is durable when the block ends. Raises StoreError."""
        try:
            with self._lock, self._engine.begin() as connection:
                yield connection
        except IntegrityError:
            raise
        except SQLAlchemyError as error:
            raise StoreError(f"answers cannot be stored: {_told(error)}") from error

    @contextmanager
    def _reading(self) -> Iterator[Any]:
        try:
            with self._engine.connect() as connection:
                yield connection
        except SQLAlchemyError as error:
            raise StoreError(f"answers cannot be read: {_told(error)}") from error

    def join(
        self, language: str, link: str | None = None, panel: dict[str, str] | None = None
    ) -> tuple[str, Person]:
        """Take somebody in, and return the token that the person's page has; its digest is stored.

        Whoever comes again by a personal link, or with the id of a panel, is the same person, whose
        former token ends. Raises RefusedError: "link" for one that is unknown or whose person
        withdrew, "again" for the id of a panel whose person withdrew, "full" where all places are
        taken. Raises StoreError where it cannot be stored.
        """
        token = secrets.token_urlsafe(TOKEN_BYTES)
        for _ in range(TRIES):
            try:
                return token, self._joined(token, language, link, panel or {})
            except IntegrityError:  # another server took the place meanwhile
                continue
        raise StoreError("answers cannot be stored: no place could be taken")

    def _joined(self, token: str, language: str, link: str | None, panel: dict[str, str]) -> Person:
        with self._writing() as connection:
            if link is None and panel:
                link = self._link_of(connection, panel["id"])
            if link is not None and (known := self._by_link(connection, link)) is not None:
                connection.execute(
                    sql.update(PEOPLE).where(PEOPLE.c.id == known.id).values(token=digest(token))
                )
                return self._person(known)
            block, visit = self._place(connection)
            person = Person(
                id=f"p{secrets.token_hex(8)}",
                block=block,
                visit=visit,
                language=language,
                state=ACTIVE,
                code=_new_code(),
                checks=None,
                answered=0,
                last_at=self.clock(),
                shown=tuple(sequence(self.design, block, visit)),
                panel=panel,
            )
            connection.execute(
                sql.insert(PEOPLE).values(
                    **{name: getattr(person, name) for name in AS_STORED},
                    token=digest(token),
                    joined_at=utc(person.last_at),
                    shown=json.dumps([_record(each) for each in person.shown]),
                    panel=json.dumps(panel) if panel else None,
                )
            )
            if link is not None:
                connection.execute(
                    sql.update(LINKS)
                    .where(LINKS.c.token == digest(link))
                    .values(participant=person.id)
                )
        self._shown[person.id] = person.shown
        return person

    def _link_of(self, connection: Any, panel_id: str) -> str:
        """A personal link of its own for each id of a panel. Raises RefusedError.

        It stays, as a digest with the study's secret, when its person withdraws: nobody sees the
        study twice.
        """
        link = hmac.new(self.secret, panel_id.encode(), hashlib.sha256).hexdigest()
        row = connection.execute(
            sql.select(LINKS.c.participant).where(LINKS.c.token == digest(link))
        ).first()
        if row is None:
            connection.execute(sql.insert(LINKS).values(token=digest(link)))
        elif row.participant == WITHDRAWN:
            raise RefusedError("again")
        return link

    def _by_link(self, connection: Any, link: str) -> Any:
        """The row of who came by a link before, None for nobody. Raises RefusedError."""
        row = connection.execute(
            sql.select(LINKS.c.participant).where(LINKS.c.token == digest(link)).with_for_update()
        ).first()
        if row is None:
            raise RefusedError("link")
        if row.participant is None:
            return None
        known = connection.execute(sql.select(PEOPLE).where(PEOPLE.c.id == row.participant)).first()
        if known is None:  # withdrawn
            raise RefusedError("link")
        return known

    def _place(self, connection: Any) -> tuple[int, int]:
        """The block that fewest have done or are at, and how many had it before.

        Raises RefusedError.
        """
        recent = self.clock() - ABSENT_S
        there = sql.or_(
            PEOPLE.c.state == DONE, sql.and_(PEOPLE.c.state == ACTIVE, PEOPLE.c.last_at > recent)
        )
        counted = sql.select(PEOPLE.c.block, sql.func.count()).where(there).group_by(PEOPLE.c.block)
        taken = {row[0]: row[1] for row in connection.execute(counted)}
        places = self.design.assignment.participants
        if places and sum(taken.values()) >= places:
            raise RefusedError("full")
        blocks = range(1, block_count(self.design) + 1)
        block = min(blocks, key=lambda each: (taken.get(each, 0), each))
        last = sql.select(sql.func.max(PEOPLE.c.visit)).where(PEOPLE.c.block == block)
        visit = connection.execute(last).scalar()
        return block, 0 if visit is None else visit + 1

    def person(self, token: str) -> Person | None:
        """Whose token it is, None for nobody's. Raises StoreError."""
        with self._reading() as connection:
            row = connection.execute(
                sql.select(PEOPLE).where(PEOPLE.c.token == digest(token))
            ).first()
        return None if row is None else self._person(row)

    def _person(self, row: Any) -> Person:
        if row.id not in self._shown:
            self._shown[row.id] = tuple(_shown(each) for each in json.loads(row.shown))
        return Person(
            **{name: getattr(row, name) for name in AS_STORED},
            checks=None if row.checks is None else json.loads(row.checks),
            shown=self._shown[row.id],
            panel=json.loads(row.panel) if row.panel else {},
        )

    def check(self, person: Person, results: dict[str, Any]) -> Person:
        """Store what the checks of screen and sound found. Raises StoreError."""
        now = self.clock()
        with self._writing() as connection:
            connection.execute(
                sql.update(PEOPLE)
                .where(PEOPLE.c.id == person.id, PEOPLE.c.checks.is_(None))
                .values(checks=json.dumps(results), last_at=now)
            )
        return replace(person, checks=results, last_at=now)

    def answer(
        self,
        person: Person,
        order: int,
        answer: str,
        *,
        seconds: float,
        replays: int,
        late_ms: float | None = None,
        dropped: int | None = None,
    ) -> Person:
        """Store an answer (condition, number or word), once; the person as it is now.

        `late_ms` and `dropped` say how far picture and sound were apart at most, and how many
        pictures were not shown. A trial that was answered before stays as it was. Raises
        RefusedError: "order" for a trial that is not the next, "gone" where the person withdrew
        meanwhile. Raises StoreError where it cannot be stored; then it is not.
        """
        now = self.clock()
        with self._writing() as connection:
            row = connection.execute(
                sql.select(PEOPLE).where(PEOPLE.c.id == person.id).with_for_update()
            ).first()
            if row is None:
                raise RefusedError("gone")
            current = self._person(row)
            if order <= current.answered:
                return current
            shown = current.next
            if order != current.answered + 1 or shown is None or current.state != ACTIVE:
                raise RefusedError("order")
            stored = answer_to(
                shown,
                answer,
                participant=person.id,
                group=current.block,
                seconds=round(seconds, 3),
                replays=replays,
                answered_at=utc(now),
            )
            values = {**asdict(stored), "late_ms": late_ms, "dropped": dropped}
            connection.execute(sql.insert(ANSWERS).values(values))
            state = self._state_after(connection, current, order)
            connection.execute(
                sql.update(PEOPLE)
                .where(PEOPLE.c.id == person.id)
                .values(answered=order, last_at=now, state=state)
            )
        return replace(current, answered=order, last_at=now, state=state)

    def _state_after(self, connection: Any, person: Person, order: int) -> str:
        """Whether somebody is done, or stopped since too few obvious items were right."""
        if order == len(person.shown):
            return DONE
        asked = [each.order for each in person.shown if each.trial.role == "qualification"]
        if self.design.qualification.failed == "stop" and asked and order == asked[-1]:
            right = sql.select(sql.func.count()).where(
                ANSWERS.c.participant == person.id,
                ANSWERS.c.role == "qualification",
                ANSWERS.c.answer == ANSWERS.c.correct,
            )
            if connection.execute(right).scalar() < self.design.qualification.needed:
                return STOPPED
        return person.state

    def withdraw(self, person: Person) -> None:
        """Delete all that is known of a person. Raises StoreError."""
        with self._writing() as connection:
            connection.execute(sql.delete(ANSWERS).where(ANSWERS.c.participant == person.id))
            connection.execute(
                sql.update(LINKS)
                .where(LINKS.c.participant == person.id)
                .values(participant=WITHDRAWN)
            )
            connection.execute(sql.delete(PEOPLE).where(PEOPLE.c.id == person.id))
        self._shown.pop(person.id, None)
        if self._engine.dialect.name == "sqlite":
            # What was deleted is still in the write-ahead log until that is emptied.
            with self._lock, self._engine.connect() as connection:
                connection.exec_driver_sql("PRAGMA wal_checkpoint(TRUNCATE)")

    def make_links(self, count: int) -> list[str]:
        """Tokens of so many new personal links; only their digests are stored."""
        tokens = [secrets.token_urlsafe(TOKEN_BYTES) for _ in range(count)]
        with self._writing() as connection:
            connection.execute(sql.insert(LINKS), [{"token": digest(token)} for token in tokens])
        return tokens

    def answers(self) -> list[Answer]:
        """Every answer, by when people came and in their order. Raises StoreError."""
        with self._reading() as connection:
            rows = connection.execute(
                sql.select(*(ANSWERS.c[name] for name in COLUMNS))
                .join(PEOPLE, PEOPLE.c.id == ANSWERS.c.participant)
                .order_by(PEOPLE.c.joined_at, PEOPLE.c.id, ANSWERS.c.order)
            ).all()
        return [Answer(**dict(zip(COLUMNS, row, strict=True))) for row in rows]

    def people(self) -> list[dict[str, Any]]:
        """Every participant: place, state, code, checks and how it played. Raises StoreError."""
        with self._reading() as connection:
            worst = (
                sql.select(
                    ANSWERS.c.participant,
                    sql.func.max(ANSWERS.c.late_ms).label("late_ms"),
                    sql.func.sum(ANSWERS.c.dropped).label("dropped"),
                )
                .group_by(ANSWERS.c.participant)
                .subquery()
            )
            rows = connection.execute(
                sql.select(PEOPLE, worst.c.late_ms, worst.c.dropped)
                .join(worst, worst.c.participant == PEOPLE.c.id, isouter=True)
                .order_by(PEOPLE.c.joined_at, PEOPLE.c.id)
            ).all()
        return [
            {
                "participant": row.id,
                "group": row.block,
                "visit": row.visit,
                "language": row.language,
                "state": row.state,
                "code": self.code_of(row.state, row.code),
                "panel": json.loads(row.panel) if row.panel else {},
                "answered": row.answered,
                "joined_at": row.joined_at,
                "checks": row.checks or "",
                "late_ms": row.late_ms,
                "dropped": row.dropped,
            }
            for row in rows
        ]

    def code_of(self, state: str, own: str) -> str:
        """What a person gives to a panel: the study's code for a state, or the person's own."""
        panel = self.design.panel
        codes = {DONE: panel.done_code or own, STOPPED: panel.stopped_code}
        return codes.get(state, "")

    def counts(self) -> dict[str, int]:
        """People by state, and answers. Raises StoreError."""
        with self._reading() as connection:
            states = connection.execute(
                sql.select(PEOPLE.c.state, sql.func.count()).group_by(PEOPLE.c.state)
            ).all()
            answers = connection.execute(sql.select(sql.func.count()).select_from(ANSWERS)).scalar()
        people = {row[0]: row[1] for row in states}
        return {
            **{each: people.get(each, 0) for each in (ACTIVE, DONE, STOPPED)},
            "answers": answers,
        }


def digest(token: str) -> str:
    """What of a token is stored, hexadecimal."""
    return hashlib.sha256(token.encode("utf-8", "replace")).hexdigest()


def utc(seconds: float) -> str:
    """Seconds since 1970 as the table of answers writes them: ISO 8601 with milliseconds."""
    moment = datetime.fromtimestamp(seconds, UTC)
    return moment.isoformat(timespec="milliseconds").replace("+00:00", "Z")


def _new_code() -> str:
    return "".join(secrets.choice(CODE_LETTERS) for _ in range(10))


def _told(error: SQLAlchemyError) -> str:
    """What the database says, without the statement and what a person sent."""
    said = error.orig if isinstance(error, DBAPIError) else error
    return " ".join(str(said).split())[:200]


def _engine(url: str | Path) -> Any:
    """An engine of SQLite for a path, of any database for a URL. Raises StudyError."""
    if isinstance(url, Path):
        address = sql.URL.create("sqlite", database=str(url))
    else:
        try:
            address = sql.make_url(url)
        except (SQLAlchemyError, ValueError):
            raise StudyError.about(
                "`database`", found="no URL", allowed="postgresql://USER@HOST/NAME"
            ) from None
        if address.drivername in ("postgresql", "postgres"):
            address = address.set(drivername="postgresql+psycopg")
    if address.get_backend_name() not in ("sqlite", "postgresql"):
        raise StudyError.about(
            "`database`", found=address.drivername, allowed="postgresql://USER@HOST/NAME"
        )
    if address.get_backend_name() == "sqlite":
        _keep_private(address.database)
        engine = sql.create_engine(address, connect_args={"timeout": 30})
        event.listen(engine, "connect", _durable)
        return engine
    try:
        return sql.create_engine(address, pool_pre_ping=True, pool_size=10, max_overflow=10)
    except ImportError as error:
        raise MachineError(
            f"PostgreSQL needs {error.name}; install it: pip install 'psycopg[binary]'"
        ) from error


def _keep_private(path: str | None) -> None:
    """Make a new file of SQLite readable for its owner alone; its log follows it.

    Answers are of people, and a study's folder is often one that others of a group can read.
    """
    if path and path != ":memory:" and not path.startswith("file:"):
        with contextlib.suppress(OSError):  # SQLite says itself what it cannot open
            os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o600))


def _durable(connection: Any, _: object) -> None:
    for pragma in (
        "journal_mode=WAL",
        "synchronous=FULL",
        "foreign_keys=ON",
        "secure_delete=ON",
    ):
        connection.execute(f"PRAGMA {pragma}").close()


def _fact(connection: Any, name: str) -> str | None:
    return connection.execute(sql.select(FACTS.c.value).where(FACTS.c.name == name)).scalar()


def _add_measures(connection: Any) -> None:
    """From 1 to 2: how far picture and sound were apart, and pictures that were not shown."""
    for name, kind in (("late_ms", "FLOAT"), ("dropped", "INTEGER")):
        connection.exec_driver_sql(f"ALTER TABLE study_answers ADD COLUMN {name} {kind}")


def _add_panel(connection: Any) -> None:
    """From 2 to 3: what the link of a panel brought."""
    connection.exec_driver_sql("ALTER TABLE study_participants ADD COLUMN panel TEXT")


MIGRATIONS: Sequence[Callable[[Any], None]] = (_add_measures, _add_panel)
"""From schema 1 on, each to the next."""


def _migrate(connection: Any) -> None:
    """Make tables, or bring those of an older Elocute up to date. Raises StudyError."""
    if not sql.inspect(connection).has_table(FACTS.name):
        META.create_all(connection)
        connection.execute(sql.insert(FACTS).values(name="schema", value=str(SCHEMA)))
        return
    version = int(_fact(connection, "schema") or 0)
    if not 1 <= version <= SCHEMA:
        raise StudyError.about(
            "answers",
            found=f"schema {version}",
            allowed=f"1 to {SCHEMA}",
            remedy="a newer Elocute wrote them; use that one",
        )
    for step in MIGRATIONS[version - 1 :]:
        step(connection)
    connection.execute(sql.update(FACTS).where(FACTS.c.name == "schema").values(value=str(SCHEMA)))


def _record(shown: Shown) -> dict[str, Any]:
    """A trial as one person sees it, for JSON."""
    record, clip = asdict(shown), shown.trial.reference_clip
    record["trial"]["reference_clip"] = [clip.condition, clip.stimulus] if clip else None
    return record


def _shown(record: dict[str, Any]) -> Shown:
    trial = dict(record["trial"])
    clip = trial.pop("reference_clip")
    asked = Trial(
        **{
            **trial,
            "conditions": tuple(trial["conditions"]),
            "words": tuple(trial["words"]),
            "reference_clip": Clip(*clip) if clip else None,
        }
    )
    words = tuple(record["words"])
    return Shown(record["order"], asked, record["left"], record["right"], words)
