"""The studio's server: what the page asks for, over files of one folder.

The page holds no truth of its own. It edits projects; workers compute takes of them, and write
exports beside them. Nothing but files of the folder is read or written, by names that are checked.
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import json
import re
import secrets
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs

from elocute._version import __version__
from elocute.adoption.characters.given_names import NAMES_KIND
from elocute.errors import ElocuteError, InputError, MachineError, needs_extra
from elocute.export.html import page_asset, page_script
from elocute.export.registry import check_suffix, format_options
from elocute.files.json_records import as_record, parse_json
from elocute.files.names import checked_name, file_beside
from elocute.files.reading import FileKind, bytes_text, decoded_text
from elocute.meshes.gltf_document import SUFFIXES as CHARACTER_SUFFIXES
from elocute.render.lights import RIGS
from elocute.serving.gate import HEADERS, Fields, Rates, host_names
from elocute.serving.guard import Body, Guard, Refusal
from elocute.studio.folder import ConflictError
from elocute.studio.jobs import DONE, SLOW, BusyError, Job
from elocute.studio.project import PROJECT_MAX_BYTES, Project, project_of
from elocute.studio.project_names import is_project
from elocute.studio.session import Listener, MissingError, Studio, ended, result_of
from elocute.studio.work import Task

with needs_extra("the studio", "studio"):
    from fastapi import FastAPI, Request, WebSocket, WebSocketDisconnect
    from fastapi.responses import FileResponse, JSONResponse, Response
    from starlette.concurrency import run_in_threadpool
    from starlette.exceptions import HTTPException
    from starlette.requests import ClientDisconnect

SOUND_MAX_BYTES, CHARACTER_MAX_BYTES, TEXT_MAX_BYTES = 1_000_000_000, 400_000_000, 200_000
UPLOADS, SOCKETS = 4, 32
"""How many there may be at once."""
TOKEN_BYTES = 24
WHOLE_S = 600.0
"""How long a file may come in: a video of a gigabyte over a slow network."""
MESHES = (*CHARACTER_SUFFIXES, ".obj", ".ply", ".stl")
LOCAL = ("localhost", "127.0.0.1", "[::1]")
POLICY = (
    "default-src 'none'; script-src 'self' blob:; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; media-src 'self' blob:; connect-src 'self' blob:; "
    "worker-src 'self' blob:; font-src 'self' data:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)
PAGE_HEADERS = {
    "content-security-policy": POLICY,
    "permissions-policy": HEADERS["permissions-policy"].replace(
        "microphone=()", "microphone=(self)"
    ),
}
LASTING = {"cache-control": "private, max-age=86400, immutable"}
"""Of what is named by a digest."""
STATUS: tuple[tuple[type[Exception], int], ...] = (
    (ConflictError, 409),
    (BusyError, 503),
    (InputError, 422),
    (MachineError, 501),
)
_NAME = b"(?:[A-Za-z0-9._~!$&'()+,;=@-]|%[0-9A-Fa-f]{2}){1,600}"
_KEY = b"[0-9a-f]{16,64}"
_PROJECT = b"/api/projects/" + _NAME
PATHS = {
    "GET": b"/|/studio\\.js|/api/(?:state|projects|characters|jobs)|"
    + _PROJECT
    + b"(?:/(?:take|weights|moves|joints|sound|peaks))?|/api/takes/"
    + _KEY
    + b"(?:/(?:weights|moves|joints))?|/api/sounds/"
    + _KEY
    + b"(?:/peaks)?|/api/heads/"
    + _KEY
    + b"(?:\\.glb|\\.json|\\.[a-z]{1,16}\\.json)|/api/jobs/"
    + _KEY
    + b"(?:/file)?|/api/characters/"
    + _NAME,
    "POST": b"/api/projects|/api/characters|" + _PROJECT + b"/(?:take|export|transcribe)",
    "PUT": _PROJECT + b"|/api/characters/" + _NAME + b"/names",
    "DELETE": b"/api/jobs/" + _KEY,
    "WS": b"/api/events",
}
_ANY = Body(SOUND_MAX_BYTES, (), whole=False)
BODIES = {
    re.compile(b"/api/projects"): _ANY,
    re.compile(b"/api/characters"): Body(CHARACTER_MAX_BYTES, (), whole=False),
    re.compile(_PROJECT): Body(PROJECT_MAX_BYTES),
    re.compile(_PROJECT + b"/take"): Body(PROJECT_MAX_BYTES),
    re.compile(_PROJECT + b"/export"): Body(65_536),
    re.compile(b"/api/characters/" + _NAME + b"/names"): Body(NAMES_KIND.max_bytes),
}


def new_token() -> str:
    """What the link of a studio has in it."""
    return secrets.token_urlsafe(TOKEN_BYTES)


def studio_app(
    studio: Studio, port: int, hosts: tuple[str, ...] = (), *, remote: bool = False
) -> Any:
    """The ASGI application of a studio that listens on a port; hosts: its names beside this
    machine's own; remote: whether it is reached by any address in numbers."""
    app = FastAPI(openapi_url=None, docs_url=None, redoc_url=None)
    folder, jobs = studio.folder, studio.jobs
    cookie = f"elocute_studio_{port}"

    def failed(_: Request, error: Exception) -> Response:
        status = next((code for kind, code in STATUS if isinstance(error, kind)), 500)
        if isinstance(error, MissingError):
            status = 404
        return JSONResponse({"error": str(error)}, status)

    for kind in (ElocuteError, BusyError, MissingError):
        app.add_exception_handler(kind, failed)

    @app.exception_handler(HTTPException)
    def unknown(_: Request, error: Exception) -> Response:
        status = error.status_code if isinstance(error, HTTPException) else 404
        return JSONResponse({"error": "unknown"}, status)

    @app.exception_handler(OSError)
    def not_stored(_: Request, error: Exception) -> Response:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        return JSONResponse({"error": f"cannot be read or written ({reason})"}, 507)

    @app.exception_handler(TimeoutError)
    def too_long(_: Request, error: Exception) -> Response:
        return JSONResponse({"error": "the workers have other things to do; try again"}, 503)

    @app.get("/")
    def page() -> Response:
        answer = Response(page_asset("studio.html"), media_type="text/html", headers=PAGE_HEADERS)
        answer.set_cookie(cookie, studio.token, httponly=True, samesite="strict")
        return answer

    @app.get("/studio.js")
    def script() -> Response:
        return Response(page_script("studio.js"), media_type="text/javascript")

    @app.get("/api/state")
    async def state() -> Response:
        told = result_of(await ended(studio.about))
        more = {"sounds": await run_in_threadpool(folder.sounds), "opens": studio.opens}
        return JSONResponse({"version": __version__, **told, **more})

    @app.get("/api/projects")
    def projects() -> Response:
        found = folder.projects()
        return JSONResponse([p | {"duration_s": studio.seconds.get(p["name"])} for p in found])

    @app.post("/api/projects")
    async def add(
        request: Request, name: str = "", file: str = "", language: str = "en-us"
    ) -> Response:
        if file:
            return JSONResponse(await _add_from_folder(file), 201)
        return JSONResponse(await _add_upload(request, name, language), 201)

    async def _add_from_folder(file: str) -> dict[str, Any]:
        there = file_beside(folder.folder, file, "file")
        name = there.stem
        folder.check_free(folder.path(name))
        found = await studio.result(Task("probe", {"path": str(there), "name": file}))
        return _created(name, Project(folder.folder, file), found)

    async def _add_upload(request: Request, file: str, language: str) -> dict[str, Any]:
        name = Path(checked_name(file)).stem
        is_text = file.lower().endswith(".txt")
        kept = f"{name}.wav" if is_text else file
        if is_project(Path(kept)):
            raise InputError.about(file, found="a project", allowed="a sound, a video or a text")
        folder.check_free(folder.path(name), folder.folder / kept)
        async with _uploaded(request, TEXT_MAX_BYTES if is_text else SOUND_MAX_BYTES) as draft:
            if is_text:
                project, found = await _spoken(draft, kept, language)
            else:
                found = await studio.result(Task("probe", {"path": str(draft), "name": file}))
                project = Project(folder.folder, kept)
            path = await run_in_threadpool(folder.take_in, draft, kept)
        try:
            return _created(name, project, found)
        except BaseException:
            path.unlink()
            raise

    async def _spoken(draft: Path, kept: str, language: str) -> tuple[Project, dict[str, Any]]:
        """Speak a text that was sent; its draft then holds the sound."""
        text = _text_of(draft, f"{Path(kept).stem}.txt")
        given = {"text": text, "path": str(draft), "language": language}
        found = await studio.result(Task("speak_text", given))
        known = Project(
            folder.folder,
            kept,
            text=text,
            language=language,
            phones=found["phones"],
            words=found["words"],
        )
        return known, found

    def _created(name: str, project: Project, found: dict[str, Any]) -> dict[str, Any]:
        revision = folder.create(name, project)
        if "duration_s" in found:
            studio.seconds[name] = found["duration_s"]
        if project.text is None:
            studio.listen(name, revision)
        return {"name": name, "revision": revision, "notes": found["notes"]}

    @contextlib.asynccontextmanager
    async def _uploaded(request: Request, most: int) -> AsyncIterator[Path]:
        """A body as a file in the cache, which goes again. Raises InputError, BusyError."""
        if studio.uploads >= UPLOADS:
            raise BusyError(f"{UPLOADS} files come in already; try again when one is there")
        studio.uploads += 1
        draft = studio.cache / f"upload-{secrets.token_hex(8)}"
        try:
            count = 0
            with draft.open("xb") as written:
                async for block in request.stream():
                    count += len(block)
                    if count > most:
                        raise InputError.about(
                            "upload", found="more", allowed=f"up to {bytes_text(most)}"
                        )
                    await run_in_threadpool(written.write, block)
            if not count:
                raise InputError.about("upload", found="nothing", allowed="the bytes of a file")
            yield draft
        except ClientDisconnect:
            raise InputError("upload: it was cut off") from None
        finally:
            studio.uploads -= 1
            draft.unlink(missing_ok=True)

    @app.get("/api/projects/{name}")
    def project(name: str) -> Response:
        data, revision = folder.read(_there(name))
        return Response(data, media_type="application/json", headers={"etag": f'"{revision}"'})

    @app.put("/api/projects/{name}")
    async def save(name: str, request: Request) -> Response:
        revision = request.headers.get("if-match", "").strip('"')
        if not re.fullmatch("[0-9a-f]{16}", revision):
            return JSONResponse({"error": "no revision: if-match is the etag that was read"}, 428)
        data = await request.body()
        new = await run_in_threadpool(folder.save, _there(name), data, revision)
        studio.saved(name, new)
        return JSONResponse({"revision": new}, headers={"etag": f'"{new}"'})

    @app.post("/api/projects/{name}/take")
    async def take(name: str, request: Request) -> Response:
        data = await request.body()
        if not data or data.strip() in (b"{}", b"null"):
            data, _ = folder.read(_there(name))
        opened = project_of(data, folder.folder, "project")
        return JSONResponse({"job": studio.preview(name, opened).id}, 202)

    @app.post("/api/projects/{name}/transcribe")
    def transcribe(name: str) -> Response:
        return JSONResponse({"job": studio.transcribe(_there(name)).id}, 202)

    @app.post("/api/projects/{name}/export")
    async def export(name: str, request: Request) -> Response:
        body = as_record(parse_json(await request.body(), "body", allowed="JSON"), "body", "JSON")
        if set(body) - {"format", "options", "name"}:
            raise InputError.about("body", found="other keys", allowed="format, options, name")
        kind, options = body.get("format"), body.get("options") or {}
        if not isinstance(kind, str) or not isinstance(options, dict):
            raise InputError.about("`format`", found="none", allowed="a format, and its options")
        target = f"{body.get('name') or name}.{kind.lstrip('.')}"
        path = folder.folder / checked_name(target, "output")
        if is_project(path):
            raise InputError.about(target, found="a project's name", allowed="another name")
        check_suffix(path)
        options = {k: tuple(v) if isinstance(v, list) else v for k, v in options.items()}
        format_options(path, options)
        source = folder.existing(_there(name))
        given = {"project": str(source), "target": str(path), "options": options}
        return JSONResponse(
            {"job": jobs.submit(Task("export", given), lane=SLOW, project=name).id}, 202
        )

    def _there(name: str) -> str:
        """The name itself, where there is such a project. Raises MissingError."""
        try:
            folder.existing(name)
        except InputError as error:
            raise MissingError(str(error)) from None
        return name

    def _latest(name: str) -> str:
        digest = studio.takes.get(_there(name))
        if digest is None:
            raise MissingError("no take yet; POST …/take computes one")
        return digest

    @app.get("/api/projects/{name}/take")
    def latest(name: str) -> Response:
        return take_record(_latest(name))

    @app.get("/api/projects/{name}/{part}")
    def part_of_latest(name: str, part: str) -> Response:
        digest = _latest(name)
        if part in ("weights", "moves", "joints"):
            return frames(digest, part)
        if part not in ("sound", "peaks"):
            raise MissingError("no such part of a take")
        record = json.loads(studio.take_file(digest, "take.json").read_text("utf-8"))
        return _sound(record["sound_url"].rpartition("/")[2], part)

    @app.get("/api/takes/{digest}")
    def take_record(digest: str) -> Response:
        return FileResponse(studio.take_file(digest, "take.json"), media_type="application/json")

    @app.get("/api/takes/{digest}/{part}")
    def frames(digest: str, part: str) -> Response:
        path = studio.take_file(digest, f"{part}.f32")
        return FileResponse(path, media_type="application/octet-stream", headers=LASTING)

    def _sound(key: str, part: str) -> Response:
        room = studio.cache / "sounds" / key
        if not (room / "peaks.json").is_file():
            raise MissingError("no such sound")
        if part == "peaks":
            return FileResponse(room / "peaks.json", media_type="application/json", headers=LASTING)
        media = json.loads((room / "peaks.json").read_text("utf-8"))["media"]
        return FileResponse(room / "sound", media_type=media, headers=LASTING)

    @app.get("/api/sounds/{key}")
    def sound(key: str) -> Response:
        return _sound(key, "sound")

    @app.get("/api/sounds/{key}/peaks")
    def peaks(key: str) -> Response:
        return _sound(key, "peaks")

    @app.get("/api/heads/{file}")
    async def head(file: str) -> Response:
        path = studio.cache / "heads" / file
        if file.endswith(".json") and not path.is_file():
            await _make_stage(path)
        if not path.is_file():
            raise MissingError("no such head")
        kind = "model/gltf-binary" if file.endswith(".glb") else "application/json"
        return FileResponse(path, media_type=kind, headers=LASTING)

    async def _make_stage(path: Path) -> None:
        """What the page is told of a head in a light: KEY.json in the studio, KEY.LIGHT.json."""
        key, _, light = path.stem.partition(".")
        light = light or "studio"
        if light not in RIGS:
            raise MissingError("no such light")
        recipe = path.with_name(f"{key}.recipe")
        if not recipe.is_file():
            raise MissingError("no such head")
        project = json.loads(recipe.read_text("utf-8"))
        given = {"project": project, "folder": str(folder.folder), "path": str(path)}
        await studio.result(Task("stage", given | {"light": light}))

    @app.get("/api/jobs")
    def all_jobs() -> Response:
        return JSONResponse(jobs.all())

    def _job(id: str) -> Job:
        job = jobs.find(id)
        if job is None:
            raise MissingError("no such job")
        return job

    @app.get("/api/jobs/{id}")
    def job(id: str) -> Response:
        return JSONResponse(_job(id).record())

    @app.delete("/api/jobs/{id}")
    async def cancel(id: str) -> Response:
        found = _job(id)
        jobs.cancel(id)
        await ended(found)
        return JSONResponse(found.record())

    @app.get("/api/jobs/{id}/file")
    def written(id: str) -> Response:
        found = _job(id)
        if found.state != DONE or "file" not in found.result:
            raise MissingError("no file of this job")
        path = file_beside(folder.folder, found.result["file"], "file")
        kept = {"content-security-policy": "default-src 'none'; sandbox"}
        return FileResponse(
            path, filename=path.name, media_type="application/octet-stream", headers=kept
        )

    @app.get("/api/characters")
    def characters() -> Response:
        return JSONResponse(folder.named(MESHES))

    @app.get("/api/characters/{name}")
    async def report(name: str) -> Response:
        path = file_beside(folder.folder, name, "character")
        _check_mesh(name)
        task = Task("character", {"path": str(path), "name": name})
        return JSONResponse({"name": name, **await studio.result(task)})

    @app.put("/api/characters/{name}/names")
    async def name_shapes(name: str, request: Request) -> Response:
        path = file_beside(folder.folder, name, "character")
        _check_mesh(name)
        given = decoded_text(await request.body(), f"names of {name}", NAMES_KIND)
        task = Task("names", {"path": str(path), "name": name, "given": given})
        return JSONResponse({"name": name, **await studio.result(task)})

    @app.post("/api/characters")
    async def add_character(request: Request, name: str = "") -> Response:
        checked_name(name)
        _check_mesh(name)
        folder.check_free(folder.folder / name)
        async with _uploaded(request, CHARACTER_MAX_BYTES) as draft:
            typed = draft.with_name(f"{draft.name}{Path(name).suffix.lower()}")
            draft.replace(typed)
            try:
                task = Task("character", {"path": str(typed), "name": name})
                found = await studio.result(task)
                await run_in_threadpool(folder.take_in, typed, name)
            finally:
                typed.unlink(missing_ok=True)
        return JSONResponse({"name": name, **found}, 201)

    @app.websocket("/api/events")
    async def events(socket: WebSocket) -> None:
        if len(studio.listeners) >= SOCKETS:
            await socket.close(1013)
            return
        await socket.accept()
        listener = Listener()
        studio.listeners.add(listener)
        try:
            for record in jobs.all():
                listener.put(record)
            ends = asyncio.create_task(_until_gone(socket))
            while not ends.done():
                following = asyncio.create_task(listener.next())
                await asyncio.wait({ends, following}, return_when=asyncio.FIRST_COMPLETED)
                if not following.done():
                    following.cancel()
                    break
                for record in following.result():
                    await socket.send_json(record)
        except (WebSocketDisconnect, RuntimeError):
            pass
        finally:
            studio.listeners.discard(listener)

    names = host_names([*LOCAL, *hosts], port)
    return Guard(
        app,
        names,
        {method: re.compile(paths) for method, paths in PATHS.items()},
        Rates(4_000, 2_000),
        bodies=BODIES,
        queries=re.compile(b"/|/api/projects|/api/characters"),
        knows=_knows(studio.token, cookie),
        numeric=remote,
    )


def _check_mesh(name: str) -> None:
    if not name.lower().endswith(MESHES):
        raise InputError.about(name, found="another kind of file", allowed=" ".join(MESHES))


def _text_of(draft: Path, name: str) -> str:
    """A text that was sent. Raises InputError, about its name, for anything else."""
    text = decoded_text(draft.read_bytes(), name, FileKind("a text", TEXT_MAX_BYTES)).strip()
    if not text:
        raise InputError.about(name, found="no words", allowed="a text that is spoken")
    return text


async def _until_gone(socket: WebSocket) -> None:
    """Read what a page says, which is nothing, until it has gone."""
    with contextlib.suppress(WebSocketDisconnect, RuntimeError):
        while (await socket.receive())["type"] != "websocket.disconnect":
            pass


def _knows(token: str, cookie: str) -> Callable[[str, Fields, bytes], Refusal | None]:
    """Refuses who does not know the token: by cookie, header, or the link that was printed."""
    guessing = Rates(30, 0.5)

    def refusal(sender: str, fields: Fields, query: bytes) -> Refusal | None:
        given = [_cookie(each, cookie) for each in fields.get("cookie", [])]
        bearers = [each.partition(" ") for each in fields.get("authorization", [])]
        given += [each for scheme, _, each in bearers if scheme == "Bearer"]
        given += parse_qs(query.decode("latin-1")).get("token", [])
        if any(hmac.compare_digest(each.encode(), token.encode()) for each in given):
            return None
        allowed = not any(given) or guessing.allows(sender)
        return (403, "token") if allowed else (429, "often")

    return refusal


def _cookie(header: str, name: str) -> str:
    """The value of a cookie among those of a header, "" where it is not there."""
    pairs = (each.strip().partition("=") for each in header.split(";"))
    return next((value for key, _, value in pairs if key == name), "")
