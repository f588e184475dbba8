"""The study's server: a page, the videos of a person's trials, and answers that are stored.

Everything that a person sends is a token, the number of a trial, and one of the answers that this
trial offers. Which condition is where, and which item is a catch, never leaves the server: videos
have names that are digests, and answers are sides.
"""

from __future__ import annotations

import hashlib
import hmac
import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

from elocute.errors import StudyError, needs_extra
from elocute.files.json_records import as_record, parse_json
from elocute.files.reading import FileKind
from elocute.serving.gate import Rates, host_names
from elocute.serving.guard import Guard
from elocute.study.design.design import WORD_MAX
from elocute.study.design.trials import (
    Clip,
    Pair,
    Shown,
    block_count,
    minutes_of,
    sequence,
    videos_of,
)
from elocute.study.report.answers import answers_text
from elocute.study.serving.store import (
    ACTIVE,
    DONE,
    STOPPED,
    Person,
    RefusedError,
    Store,
    StoreError,
)
from elocute.study.stimuli.manifest import StudyFolder

with needs_extra("serving a study", "study"):
    from fastapi import FastAPI, Request
    from fastapi.responses import FileResponse, JSONResponse, Response

PAGES = Path(__file__).parent / "pages"
FILES = {
    "/": ("index.html", "text/html; charset=utf-8"),
    "/page.js": ("page.js", "text/javascript; charset=utf-8"),
    "/player.js": ("player.js", "text/javascript; charset=utf-8"),
    "/checks.js": ("checks.js", "text/javascript; charset=utf-8"),
    "/icon.svg": ("icon.svg", "image/svg+xml"),
    "/page.css": ("page.css", "text/css; charset=utf-8"),
}
"""All that the page consists of beside its texts."""
ADMIN = "/admin/"
TOKEN_MIN = 16
"""Letters of an administrator's token."""
EARLY_S = 0.25
"""How much sooner than the clip lasts an answer may come: clocks and the last frame."""
SLACK_S = 5.0
"""How much longer than the server has seen a person may say to have needed."""
TEXTS_FILE = FileKind("texts", 200_000, StudyError)
NUMBER = re.compile(r"\d{1,3}")
PANEL_VALUE = re.compile(r"(?!.*%\w+%)[^\x00-\x1f\x7f{}\[\]<>]{1,200}")
"""What a panel calls a person, a study or a session; never what a panel has left unfilled, as
{{%PROLIFIC_PID%}}, [%RID%] or %SURVEY_CODE%: everybody would be one person."""


@dataclass(frozen=True)
class Serving:
    """How a study is served."""

    hosts: tuple[str, ...] = ()  # names under which the server is reached; () is this machine alone
    admin_token: str = ""  # who has it may ask for answers; "" is nobody
    invited: bool = False  # whether only personal links let people in
    joins_a_minute: int = 240  # how many may begin in a minute from one address


class StudyService:
    """What the page asks for, without HTTP.

    Parameters
    ----------
    study : StudyFolder
        The study.
    store : Store
        Its database.
    serving : Serving
        Who may ask.
    texts : dict of str to dict
        The page's texts by language.
    """

    def __init__(
        self,
        study: StudyFolder,
        store: Store,
        serving: Serving,
        texts: dict[str, dict[str, str]],
    ) -> None:
        self.study, self.store, self.serving, self.texts = study, store, serving, texts
        self._videos = study.manifest.videos
        self.media = {self._id(name): name for name in self._videos}
        first = sequence(study.design, 1, 0)
        seconds = {name: video.seconds for name, video in self._videos.items()}
        self._minutes = max(1, round(minutes_of(first, seconds)))

    def _id(self, name: str) -> str:
        """A video's name as the page knows it."""
        return hmac.new(self.store.secret, name.encode(), hashlib.sha256).hexdigest()[:24]

    def about(self) -> dict[str, Any]:
        """What somebody is told before taking part."""
        design = self.study.design
        return {
            "title": design.study.title,
            "contact": design.study.contact,
            "kind": design.study.kind,
            "scale": design.study.scale,
            "about": design.study.about,
            "question": design.study.question,
            "languages": list(self.texts),
            "minutes": self._minutes,
            "invited": self.serving.invited,
            "headphones": design.watching.headphones,
            "width": design.watching.width,
            "panel": {
                "parameter": design.panel.parameter,
                "required": design.panel.required,
                "full_code": design.panel.full_code,
                "full_return": self._full_return(),
            },
        }

    def _full_return(self) -> str:
        """The address to go back to of who finds no place; the ids stay out, nobody is stored."""
        panel = self.study.design.panel
        return _filled(panel.return_to, panel.full_code, {}) if panel.full_code else ""

    def join(self, body: dict[str, Any]) -> dict[str, Any]:
        """Take somebody in. Raises RefusedError, StoreError."""
        _only(body, {"language", "link", "panel"}, {"language"})
        language, link, panel = body["language"], body.get("link"), body.get("panel")
        known = isinstance(language, str) and language in self.texts
        if not known or not (link is None or _is_token(link)):
            raise RefusedError("invalid")
        if not (panel is None or _is_panel(panel)):
            raise RefusedError("invalid")
        if self.serving.invited and link is None:
            raise RefusedError("link")
        if self.study.design.panel.required and panel is None and link is None:
            raise RefusedError("panel")
        token, person = self.store.join(language, link, panel)
        return {"token": token, "step": self.step(person)}

    def person(self, header: str | None) -> Person | None:
        """Whose header it is. Raises StoreError."""
        scheme, _, token = (header or "").partition(" ")
        return self.store.person(token) if scheme == "Bearer" and _is_token(token) else None

    def step(self, person: Person) -> dict[str, Any]:
        """What a person does next."""
        shown = person.next
        if person.state in (DONE, STOPPED) or shown is None:
            return self._end(person)
        if person.checks is None:
            return {"state": "checks"}
        following = person.shown[person.answered + 1 : person.answered + 2]
        return {
            "state": "trial",
            "trial": self._trial(person, shown),
            "ahead": [self._id(v.name) for each in following for v in videos_of(each.trial)],
        }

    def _end(self, person: Person) -> dict[str, Any]:
        """How it ended, the code for a panel, and the address to go back to."""
        state = DONE if person.state == DONE else STOPPED
        code = self.store.code_of(state, person.code)
        ended = {"state": state} | ({"code": code} if code else {})
        address = self.study.design.panel.return_to if code else ""
        return ended | ({"return_to": _filled(address, code, person.panel)} if address else {})

    def _trial(self, person: Person, shown: Shown) -> dict[str, Any]:
        """A trial as the page knows it: nothing in it says which condition is where."""
        watching, trial = self.study.design.watching, shown.trial
        role = trial.role if trial.role in ("practice", "qualification") else "test"
        kind = "binary" if len(trial.conditions) == 2 and trial.kind != "style" else trial.kind
        return {
            "order": shown.order,
            "total": len(person.shown),
            "phase": role,
            "begins": shown.order == 1 or self._phase(person, shown.order - 1) != role,
            "kind": kind,
            "clips": [self._clip(shown, video) for video in videos_of(trial)],
            "offers": list(shown.offers),
            "share": watching.share,
            "replays": watching.replays,
            "pause": self._is_pause(person, shown),
        }

    @staticmethod
    def _phase(person: Person, order: int) -> str:
        role = person.shown[order - 1].trial.role
        return role if role in ("practice", "qualification") else "test"

    def _clip(self, shown: Shown, video: Clip | Pair) -> dict[str, Any]:
        seconds = self._videos[video.name].seconds
        clip = {"id": self._id(video.name), "seconds": seconds, "sides": 1, "swap": False}
        if isinstance(video, Pair):
            # Of a rating beside its reference, the reference is always on the left.
            left = shown.left if shown.right else shown.trial.reference
            clip |= {"sides": 2, "swap": video.left != left}
        return clip

    def _is_pause(self, person: Person, shown: Shown) -> bool:
        every = self.study.design.watching.break_every
        before = [each for each in person.shown if each.order < shown.order]
        tested = sum(each.trial.role in ("test", "catch") for each in before)
        return bool(every and tested and tested % every == 0)

    def check(self, person: Person, body: dict[str, Any]) -> dict[str, Any]:
        """Store what the checks found. Raises RefusedError, StoreError."""
        _only(body, {"width", "height", "tones", "greys"}, set())
        for value in body.values():
            if type(value) is not int or not 0 <= value <= 100_000:
                raise RefusedError("invalid")
        return self.step(self.store.check(person, body))

    def answer(self, person: Person, body: dict[str, Any], now: float) -> dict[str, Any]:
        """Store an answer. Raises RefusedError, StoreError."""
        known = {"order", "answer", "seconds", "replays", "late_ms", "dropped"}
        _only(body, known, {"order", "answer", "seconds", "replays"})
        order, choice = body["order"], body["answer"]
        seconds, replays = body["seconds"], body["replays"]
        late, dropped = body.get("late_ms"), body.get("dropped")
        watching = self.study.design.watching
        fits = (
            type(order) is int
            and 1 <= order <= len(person.shown)
            and isinstance(choice, str)
            and 0 < len(choice) <= WORD_MAX
            and _is_number(seconds, 0, 1e6)
            and type(replays) is int
            and 0 <= replays <= watching.replays
            and (late is None or _is_number(late, -1e6, 1e6))
            and (dropped is None or (type(dropped) is int and 0 <= dropped <= 1_000_000))
        )
        if not fits:
            raise RefusedError("invalid")
        if order <= person.answered:  # sent again: it is stored, as it was first
            return self.step(person)
        if person.state != ACTIVE or person.checks is None or order != person.answered + 1:
            raise RefusedError("order")
        shown = person.shown[order - 1]
        answer = _answer(shown, choice)
        # A clock that was set back says nothing of how long it took; the page's own does.
        elapsed = now - person.last_at if now >= person.last_at else float(seconds)
        watched = sum(self._videos[video.name].seconds for video in videos_of(shown.trial))
        if elapsed < watched * watching.share - EARLY_S:
            raise RefusedError("early")
        if seconds > elapsed + SLACK_S:
            raise RefusedError("invalid")
        return self.step(
            self.store.answer(
                person,
                order,
                answer,
                seconds=float(seconds),
                replays=replays,
                late_ms=late,
                dropped=dropped,
            )
        )


def _answer(shown: Shown, choice: str) -> str:
    """The answer as the table has it. Raises RefusedError for one that is not offered."""
    if shown.offers:
        if choice not in shown.offers:
            raise RefusedError("invalid")
        return {"left": shown.left, "right": shown.right}[choice] if shown.right else choice
    if not NUMBER.fullmatch(choice) or not choice.isascii() or int(choice) > 100:
        raise RefusedError("invalid")
    return str(int(choice))


def _only(body: dict[str, Any], known: set[str], needed: set[str]) -> None:
    if not needed <= set(body) <= known:
        raise RefusedError("invalid")


def _is_token(value: object) -> bool:
    return isinstance(value, str) and re.fullmatch(r"[A-Za-z0-9_-]{20,64}", value) is not None


def _is_panel(fields: object) -> bool:
    """Whether it is what the link of a panel brings: an id, and the panel's study and session."""
    return (
        isinstance(fields, dict)
        and {"id"} <= set(fields) <= {"id", "study", "session"}
        and all(isinstance(each, str) and PANEL_VALUE.fullmatch(each) for each in fields.values())
    )


def _filled(address: str, code: str, panel: dict[str, str]) -> str:
    """The address that a person goes back to."""
    known = {"code": code, "id": "", "study": "", "session": ""} | panel
    return re.sub(r"\{(\w+)\}", lambda found: quote(known[found[1]], safe=""), address)


def _is_number(value: object, low: float, high: float) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and low <= value <= high


STATUS = {
    "invalid": 400,
    "order": 409,
    "early": 425,
    "gone": 401,
    "link": 403,
    "full": 403,
    "panel": 403,
    "again": 403,
    "often": 429,
    "stored": 503,
}
"""HTTP's number of each reason."""


def study_app(service: StudyService, port: int, clock: Callable[[], float] | None = None) -> Any:
    """The ASGI application of a study that listens on a port, with the store's clock by default."""
    now = clock or service.store.clock
    app = FastAPI(openapi_url=None, docs_url=None, redoc_url=None)
    joins = Rates(service.serving.joins_a_minute, service.serving.joins_a_minute / 60)
    asking = Rates(60, 20)
    guessing = Rates(30, 0.5)
    study = service.study

    def sender(request: Request) -> str:
        return request.client.host if request.client else ""

    def whose(request: Request) -> Person:
        header = request.headers.get("authorization")
        person = service.person(header)
        if person is None:
            if not guessing.allows(sender(request)):
                raise RefusedError("often")
            raise RefusedError("gone")
        if not asking.allows(person.id):
            raise RefusedError("often")
        return person

    @app.exception_handler(RefusedError)
    def refused(_: Request, error: Exception) -> Response:
        reason = error.reason if isinstance(error, RefusedError) else "invalid"
        return JSONResponse({"error": reason}, STATUS[reason])

    @app.exception_handler(StoreError)
    def not_stored(_: Request, error: Exception) -> Response:
        import sys

        print(f"elocute: {error}", file=sys.stderr, flush=True)
        return JSONResponse({"error": "stored"}, STATUS["stored"])

    for path, (name, kind) in FILES.items():
        _add_file(app, path, (PAGES / name).read_bytes(), kind)
    for language, texts in service.texts.items():
        data = json.dumps(texts, ensure_ascii=False).encode()
        _add_file(app, f"/texts/{language}.json", data, "application/json")

    @app.get("/api/study")
    def about() -> Response:
        return JSONResponse(service.about())

    @app.get("/api/step")
    def step(request: Request) -> Response:
        return JSONResponse(service.step(whose(request)))

    @app.post("/api/join")
    async def join(request: Request) -> Response:
        body = await _json(request)
        if not joins.allows(sender(request)):
            raise RefusedError("often")
        return JSONResponse(await _apart(service.join, body), 201)

    @app.post("/api/checks")
    async def checks(request: Request) -> Response:
        body = await _json(request)
        return JSONResponse(await _apart(lambda: service.check(whose(request), body)))

    @app.post("/api/answer")
    async def answer(request: Request) -> Response:
        body = await _json(request)
        return JSONResponse(await _apart(lambda: service.answer(whose(request), body, now())))

    @app.post("/api/withdraw")
    async def withdraw(request: Request) -> Response:
        _only(await _json(request), set(), set())
        await _apart(lambda: service.store.withdraw(whose(request)))
        return JSONResponse({"state": "withdrawn"})

    @app.get("/media/{name}")
    def media(name: str, request: Request) -> Response:
        whose(request)
        known = service.media.get(name)
        if known is None:
            return JSONResponse({"error": "unknown"}, 404)
        file = study.folder / study.manifest.videos[known].file
        kept = {"cache-control": "private, max-age=86400, immutable"}
        return FileResponse(file, media_type="video/mp4", headers=kept)

    if service.serving.admin_token:
        _add_admin(app, service, guessing, sender)
    return Guard(
        app, host_names(_hosts(service.serving), port), _addresses(service), Rates(4_000, 2_000)
    )


async def _json(request: Request) -> dict[str, Any]:
    try:
        parsed = parse_json(await request.body(), "body", allowed="an object")
        return as_record(parsed, "body", "an object")
    except ValueError:
        raise RefusedError("invalid") from None


async def _apart(work: Callable[..., Any], *given: Any) -> Any:
    """In a thread: it waits for the disk."""
    from starlette.concurrency import run_in_threadpool

    return await run_in_threadpool(work, *given)


def _hosts(serving: Serving) -> tuple[str, ...]:
    return serving.hosts or ("localhost", "127.0.0.1", "[::1]")


def _addresses(service: StudyService) -> dict[str, re.Pattern[bytes]]:
    """What may be asked for, by method, as it is sent."""
    fixed = [*FILES, *(f"/texts/{language}.json" for language in service.texts)]
    fixed += ["/api/study", "/api/step"]
    if service.serving.admin_token:
        fixed += [f"{ADMIN}status", f"{ADMIN}answers.csv", f"{ADMIN}answers.json"]
        fixed += [f"{ADMIN}participants.json"]
    gets = "|".join([*map(re.escape, fixed), "/media/[0-9a-f]{24}"])
    posts = "|".join(f"/api/{name}" for name in ("join", "checks", "answer", "withdraw"))
    return {"GET": re.compile(gets.encode()), "POST": re.compile(posts.encode())}


def _add_file(app: FastAPI, path: str, data: bytes, kind: str) -> None:
    async def given() -> Response:
        return Response(data, media_type=None, headers={"content-type": kind})

    app.get(path)(given)


def _add_admin(
    app: FastAPI, service: StudyService, guessing: Rates, sender: Callable[[Request], str]
) -> None:
    """What who has the administrator's token may ask for."""

    def check(request: Request) -> None:
        scheme, _, token = (request.headers.get("authorization") or "").partition(" ")
        wanted = service.serving.admin_token.encode()
        token_bytes = token.encode("utf-8", "replace")
        if not guessing.allows(f"admin {sender(request)}"):
            raise RefusedError("often")
        if scheme != "Bearer" or not hmac.compare_digest(token_bytes, wanted):
            raise RefusedError("gone")

    @app.get(f"{ADMIN}status")
    def status(request: Request) -> Response:
        check(request)
        design = service.study.design
        more = {"blocks": block_count(design), "places": design.assignment.participants}
        return JSONResponse(service.store.counts() | more)

    @app.get(f"{ADMIN}participants.json")
    def participants(request: Request) -> Response:
        check(request)
        return JSONResponse({"participants": service.store.people()})

    @app.get(f"{ADMIN}answers.csv")
    def as_csv(request: Request) -> Response:
        check(request)
        text = answers_text(service.store.answers(), ".csv")
        return Response(text, headers={"content-type": "text/csv; charset=utf-8"})

    @app.get(f"{ADMIN}answers.json")
    def as_json(request: Request) -> Response:
        check(request)
        text = answers_text(service.store.answers(), ".json")
        return Response(text, headers={"content-type": "application/json"})


def read_texts(languages: tuple[str, ...], folder: Path | None = None) -> dict[str, dict[str, str]]:
    """The page's texts by language, then by name; the page begins with the first language.

    Languages beside English and German are files LANGUAGE.json in `folder`. Raises StudyError for a
    language without a file, and a file that lacks a text.
    """
    from elocute.files.json_records import read_record

    english = read_record(PAGES / "en.json", TEXTS_FILE)
    texts = {}
    for language in languages:
        own = folder / f"{language}.json" if folder else None
        path = own if own is not None and own.is_file() else PAGES / f"{language}.json"
        if not path.is_file():
            raise StudyError.about(
                "[study] `languages`",
                found=repr(language),
                allowed="en, de, or a language with a file LANGUAGE.json among `texts`",
            )
        read = read_record(path, TEXTS_FILE)
        missing = [name for name in english if not isinstance(read.get(name), str)]
        if missing:
            raise StudyError.about(
                path, found=f"no text {missing[0]!r}", allowed="those of en.json"
            )
        texts[language] = {name: read[name] for name in english}
    return texts


def check_admin_token(token: str, public: bool) -> None:
    """Raise StudyError for an administrator's token that is easily guessed, or missing."""
    if (token or public) and not re.fullmatch(rf"[!-~]{{{TOKEN_MIN},200}}", token):
        raise StudyError.about(
            "ELOCUTE_STUDY_ADMIN_TOKEN",
            found="none" if not token else f"{len(token)} characters",
            allowed=f"{TOKEN_MIN} to 200 letters, digits and signs, where others are served",
            remedy="python -c 'import secrets; print(secrets.token_urlsafe())' makes one",
        )
