"""What a studio lets in and what not: paths, hosts, origins, tokens, bodies, names."""

from __future__ import annotations

import json

import pytest

from tests.studio.conftest import JSON, PORT, TOKEN, Page
from tests.support.asgi import asked
from tests.support.forged_requests import WAYS, WRONG_HOSTS, WRONG_ORIGINS

SECRET = b"root:x:0"
NAMES = ("etc/passwd", "line.flac", "line.elocute.json", "server.py", "secret.elocute.json")
OWN_WAYS = (
    "/api/projects/{}",
    "/api/projects/..%2f{}",
    "/api/projects/%2e%2e%2f{}",
    "/api/projects/..%5c{}",
    "/api/projects/%252e%252e%252f{}",
    "/api/projects/line/../{}",
    "/api/projects/line/%2e%2e/{}",
    "/api/projects/line/{}",
    "/api/projects/.%00/{}",
    "/api/projects/{}%00",
    "/api/takes/../{}",
    "/api/takes/%2e%2e/{}",
    "/api/heads/../{}",
    "/api/heads/..%2f{}",
    "/api/sounds/../../{}",
    "/api/jobs/../{}/file",
    "/api/characters/..%2f{}",
    "/api/characters/%2fetc%2f{}",
    "/api/characters/{}/names",
    "/studio.js/../{}",
)
SPELLINGS = [way.format(name) for way in (*WAYS, *OWN_WAYS) for name in NAMES]


def test_there_are_cases_enough():
    assert len(set(SPELLINGS)) >= 150 and len(WRONG_HOSTS) + len(WRONG_ORIGINS) >= 45


@pytest.fixture(scope="module")
def outside(page: Page):
    """A project beside the folder, and a link to it within."""
    secret = page.folder.parent / "secret.elocute.json"
    secret.write_text('{"elocute_project": 1, "sound": "root:x:0"}')
    (page.folder / "linked.elocute.json").symlink_to(secret)
    (page.folder / "linked.flac").symlink_to(page.folder / "line.flac")
    yield secret
    for each in (secret, page.folder / "linked.elocute.json", page.folder / "linked.flac"):
        each.unlink()


@pytest.mark.parametrize("way", (*WAYS, *OWN_WAYS))
def test_no_spelling_of_a_path_gets_at_a_file(page: Page, outside, way: str):
    for name in NAMES:
        answer = page.get(way.format(name))
        assert answer.status in (404, 422), (way, name, answer)
        assert SECRET not in answer.data and set(answer.json) == {"error"}


def test_a_link_is_no_file_of_the_folder(page: Page, outside):
    assert page.get("/api/projects/linked").status == 404
    assert page.get("/api/characters/linked.elocute.json").status == 422
    assert page.ask("POST", "/api/projects?file=linked.flac").status == 422
    assert "linked" not in page.get("/api/projects").data.decode()
    record = {"elocute_project": 1, "sound": "linked.flac"}
    failed = page.done(page.post("/api/projects/line/take", json.dumps(record).encode()))
    assert failed["state"] == "failed" and "no file 'linked.flac'" in failed["error"]


UNUSABLE = (
    "..",
    ".",
    "",
    "../line.wav",
    "a/b.wav",
    "a\\b.wav",
    "/etc/passwd",
    "C:\\line.wav",
    ".hidden.wav",
    "CON.wav",
    "com1.wav",
    "a\0.wav",
    "a\n.wav",
    "a:b.wav",
    "a.wav ",
    "a.wav.",
    "-o.wav",
    "a" * 101,
    "\u6c34" * 90,
    "x.elocute.json",
    "\u202egnp.wav",
)


@pytest.mark.parametrize("name", UNUSABLE)
@pytest.mark.parametrize("where", ["projects?name=", "projects?file=", "characters?name="])
def test_a_name_is_one_file_of_the_folder(page: Page, where: str, name: str):
    from urllib.parse import quote

    before = sorted(each.name for each in page.folder.parent.rglob("*"))
    answer = page.ask("POST", f"/api/{where}{quote(name, safe='')}", b"RIFF")
    assert answer.status == 422 and set(answer.json) == {"error"}, answer
    assert sorted(each.name for each in page.folder.parent.rglob("*")) == before


@pytest.mark.parametrize("name", WRONG_HOSTS)
def test_another_host_is_refused(page: Page, name: str):
    fields = [("host", name.format(port=PORT)), ("authorization", f"Bearer {TOKEN}")]
    for path in ("/", "/api/projects"):
        assert asked(page.app, "GET", path, fields=fields).status == 421
    assert asked(page.app, "GET", "/api/events", fields=fields, kind="websocket").status == 403


@pytest.mark.parametrize("origin", WRONG_ORIGINS)
def test_another_origin_is_refused(page: Page, origin: str):
    own = ("origin", origin.format(port=PORT))
    for method, path in (("GET", "/api/projects"), ("PUT", "/api/projects/line")):
        answer = page.ask(method, path, b"", JSON, own)
        assert (answer.status, answer.json) == (403, {"error": "origin"})
    fields = [("host", f"localhost:{PORT}"), ("authorization", f"Bearer {TOKEN}"), own]
    assert asked(page.app, "GET", "/api/events", fields=fields, kind="websocket").status == 403


@pytest.mark.parametrize("site", ["cross-site", "same-site", "anything"])
def test_requests_that_another_site_makes_are_refused(page: Page, site: str):
    assert page.ask("GET", "/api/projects", b"", ("sec-fetch-site", site)).status == 403


TOKENS = ("", "x", TOKEN[:-1], TOKEN + "x", TOKEN.upper(), f"'{TOKEN}'", "x" * 5000, "é" * 20)


@pytest.mark.parametrize("token", TOKENS)
def test_who_does_not_know_the_token_gets_nothing(page: Page, token: str):
    host = ("host", f"127.0.0.1:{PORT}")
    ways = [
        ("authorization", f"Bearer {token}"),
        ("authorization", TOKEN),
        ("cookie", f"elocute_studio_{PORT}={token}"),
    ]
    for way in ways:
        for path in ("/", "/studio.js", "/api/state", "/api/projects/line"):
            assert asked(page.app, "GET", path, fields=[host, way]).status in (403, 429)
        assert asked(page.app, "GET", "/api/events", fields=[host, way], kind="websocket").status
    assert asked(page.app, "GET", f"/?token={TOKEN[:-1]}", fields=[host]).status in (403, 429)


def test_the_cookie_of_the_link_lets_its_page_in(page: Page):
    """By the name of its port: studios of other ports of this machine have other cookies."""
    host = ("host", f"127.0.0.1:{PORT}")
    cookie = ("cookie", f"other=1; elocute_studio_{PORT}={TOKEN}")
    assert asked(page.app, "GET", "/api/projects", fields=[host, cookie]).status == 200
    other = ("cookie", f"elocute_studio_1={TOKEN}")
    assert asked(page.app, "GET", "/api/projects", fields=[host, other]).status == 403


def test_every_answer_keeps_the_page_to_itself(page: Page):
    for path in ("/api/projects", "/nothing", "/api/projects/none"):
        fields = page.get(path).fields
        assert "default-src 'none'" in fields["content-security-policy"]
        assert fields["x-content-type-options"] == "nosniff"
        assert fields["cross-origin-resource-policy"] == "same-origin"
        assert "access-control-allow-origin" not in fields and "server" not in fields


@pytest.mark.parametrize("method", ["OPTIONS", "HEAD", "TRACE", "PATCH", "BREW"])
def test_other_methods_are_refused(page: Page, method: str):
    assert page.ask(method, "/api/projects").status == 405


def test_bodies_are_refused_before_they_are_read(page: Page):
    """Nothing is given to be read: it would end the test."""
    for path, most in (
        ("/api/projects?name=a.wav", 1_000_000_000),
        ("/api/characters?name=a.glb", 400_000_000),
        ("/api/projects/line/export", 65_536),
    ):
        large = ("content-length", str(most + 1))
        assert page.ask("POST", path, b"x", JSON, large).status == 413
    large = ("content-length", "5000001")
    assert page.ask("PUT", "/api/projects/line", b"x", JSON, large).status == 413
    assert page.ask("PUT", "/api/characters/a.glb/names", b"x", JSON, large).status == 413
    pieces = [b"x" * 1_000_000] * 7
    assert page.ask("PUT", "/api/projects/line", pieces, JSON).status == 413
    assert page.ask("POST", "/api/projects/line/take", b"{}").status == 415


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"{",
        b"[]",
        b"null",
        b"\xff\xfe",
        b"[" * 5000,
        b'{"elocute_project": 2, "sound": "line.flac"}',
        b'{"elocute_project": true, "sound": "line.flac"}',
        b'{"elocute_project": 1}',
        b'{"elocute_project": 1, "sound": "../line.flac"}',
        b'{"elocute_project": 1, "sound": "/etc/passwd"}',
        b'{"elocute_project": 1, "sound": 3}',
        b'{"elocute_project": 1, "sound": "line.flac", "more": 1}',
        b'{"elocute_project": 1, "sound": "line.flac", "edits": [{"edit": "x"}]}',
        b'{"elocute_project": 1, "sound": "line.flac", "settings": {"fps": NaN}}',
        b'{"elocute_project": 1, "sound": "line.flac", "settings": {"model": "nonesuch"}}',
        b'{"elocute_project": 1, "sound": "line.flac", "settings": {"model": "../a.onnx"}}',
        b'{"elocute_project": 1, "sound": "line.flac", "settings": {"style": "brood"}}',
        b'{"elocute_project": 1, "sound": "line.flac", "settings": {"mood": "hapy"}}',
        b'{"elocute_project": 1, "sound": "line.flac", "settings": {"identity": "nobody"}}',
        b'{"elocute_project": 1, "sound": "line.flac", "settings": {"life": "heads=1"}}',
    ],
)
def test_what_is_no_project_is_not_saved(page: Page, body: bytes):
    before = (page.folder / "line.elocute.json").read_bytes()
    tag = ("if-match", page.get("/api/projects/line").fields["etag"])
    answer = page.ask("PUT", "/api/projects/line", body, JSON, tag)
    assert answer.status == 422 and "\n" not in answer.json["error"]
    assert (page.folder / "line.elocute.json").read_bytes() == before
