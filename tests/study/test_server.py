"""The server as it is asked over the network: what gets through, and what does not."""

import json
import os
import resource
import signal
import socket
import subprocess
import sys

import pytest

from elocute.study.report.answers import read_answers
from elocute.study.serving.server import PAGES
from tests.study.studies import Asker, served
from tests.support.commands import TIMEOUT_S
from tests.support.forged_requests import WAYS, WRONG_HOSTS, WRONG_ORIGINS

SECRET = "root:x:0"
NAMES = (
    "etc/passwd",
    "study.toml",
    "manifest.json",
    "answers.db",
    "videos/ours/one.mean.front.mp4",
    "pairs/ours+theirs/one.mean.front.mp4",
    "server.py",
    "page.js",
)
SPELLINGS = [way.format(name) for way in WAYS for name in NAMES]


def test_there_are_spellings_enough():
    assert len(set(SPELLINGS)) >= 150


@pytest.mark.parametrize("way", WAYS)
def test_no_spelling_of_a_path_gets_at_a_file(asker, way):
    asker.join()
    for name in NAMES:
        path = way.format(name)
        for headers in ({}, {"Authorization": f"Bearer {asker.token}"}):
            status, _, data = asker.send("GET", path, None, headers)
            assert status in (400, 404), (path, status)
            assert SECRET.encode() not in data and b"[study]" not in data and len(data) < 100


PAIRS = (
    "/media/ours",
    "/media/one.mean.front",
    "/media/" + "0" * 23,
    "/media/" + "0" * 25,
    "/media/" + "A" * 24,
    "/media/" + "0" * 24 + "?x=1",
    "/page.js?x=1",
    "/api/study?PROLIFIC_PID=1",
    "/index.html",
    "/PAGE.JS",
    "/docs",
    "/openapi.json",
    "/redoc",
    "/api",
    "/api/",
    "/api/step/",
    "/texts/fr.json",
    "/texts/EN.json",
    "/admin",
    "/admin/",
    "/pages/en.json",
)


@pytest.mark.parametrize("path", PAIRS)
def test_what_is_not_in_the_list_is_not_there(asker, path):
    asker.join()
    status, _, _ = asker.send("GET", path, None, {"Authorization": f"Bearer {asker.token}"})
    assert status == 404


def test_there_are_cases_enough():
    assert len(WRONG_HOSTS) + len(WRONG_ORIGINS) >= 45


@pytest.mark.parametrize("name", WRONG_HOSTS)
def test_another_host_is_refused(asker, host, name):
    named = name.format(port=host.split(":")[1])
    sent = named.encode("utf-8").decode("latin-1")
    for path in ("/", "/api/study"):
        status, _, data = asker.send("GET", path, None, {"Host": sent})
        # Space around a field is not part of it.
        assert status in (400, 421) or named.strip() == f"localhost:{host.split(':')[1]}"
        assert b"Flashes" not in data or status == 200


@pytest.mark.parametrize(
    "name", ["localhost:{port}", "LOCALHOST:{port}", "127.0.0.1:{port}", "[::1]:{port}"]
)
def test_the_own_hosts_are_answered(asker, host, name):
    named = name.format(port=host.split(":")[1])
    assert asker.send("GET", "/api/study", None, {"Host": named})[0] == 200


def test_two_hosts_or_none_are_refused(host):
    name, port = host.split(":")
    for fields in (b"", b"Host: localhost:%s\r\nHost: evil\r\n" % port.encode()):
        with socket.create_connection((name, int(port))) as raw:
            raw.sendall(b"GET /api/study HTTP/1.1\r\n" + fields + b"Connection: close\r\n\r\n")
            assert raw.recv(100).split()[1] in (b"400", b"421")


@pytest.mark.parametrize("origin", WRONG_ORIGINS)
def test_another_origin_is_refused(asker, host, origin):
    named = origin.format(port=host.split(":")[1])
    status, answer = asker.ask("/api/join", {"language": "en"}, Origin=named)
    assert (status, answer["error"]) == (403, "origin")


@pytest.mark.parametrize("site", ["cross-site", "same-site", "anything"])
def test_requests_that_another_site_makes_are_refused(asker, site):
    status, _ = asker.ask("/api/join", {"language": "en"}, Sec_Fetch_Site=site)
    assert status == 403
    assert asker.send("GET", "/page.js", None, {"Sec-Fetch-Site": site})[0] == 403


def test_a_link_of_another_site_leads_to_the_page(asker):
    fields = {
        "Sec-Fetch-Site": "cross-site",
        "Sec-Fetch-Mode": "navigate",
        "Sec-Fetch-Dest": "document",
    }
    assert asker.send("GET", "/", None, fields)[0] == 200
    assert asker.send("GET", "/", None, fields | {"Sec-Fetch-Dest": "iframe"})[0] == 403


def test_every_answer_keeps_the_page_to_itself(asker):
    for path in ("/", "/page.js", "/api/study", "/nothing"):
        _, fields, _ = asker.send("GET", path)
        policy = fields["content-security-policy"]
        assert "default-src 'none'" in policy and "unsafe" not in policy and "http" not in policy
        assert fields["x-content-type-options"] == "nosniff"
        assert fields["referrer-policy"] == "no-referrer"
        assert "server" not in fields and "access-control-allow-origin" not in fields
        assert "set-cookie" not in fields


@pytest.mark.parametrize("method", ["PUT", "DELETE", "OPTIONS", "HEAD", "TRACE", "PATCH", "BREW"])
def test_other_methods_are_refused(asker, method):
    assert asker.send(method, "/api/join")[0] in (400, 405)


@pytest.mark.parametrize(
    "kind",
    [
        "text/plain",
        "application/x-www-form-urlencoded",
        "multipart/form-data",
        "",
        "application/jsonp",
    ],
)
def test_forms_of_other_pages_are_refused(asker, kind):
    assert asker.ask("/api/join", {"language": "en"}, Content_Type=kind)[0] == 415


SCRIPT = "<script>alert(1)</script>"
BODIES = [
    b"",
    b"{",
    b"[]",
    b"null",
    b"3",
    b'"x"',
    b'{"language": 1}',
    b'{"language": "xx"}',
    b"{}",
    b'{"language": "en", "more": 1}',
    b'{"language": "../en"}',
    b'{"language": ["en"]}',
    b'{"language": "en", "link": 3}',
    b'{"language": "en", "link": "../../x"}',
    b"\xff\xfe",
    b'{"language": "en", "language": "<script>"}',
    b"[" * 2000,
    b'{"a": NaN}',
    json.dumps({"language": SCRIPT}).encode(),
    json.dumps({"language": "en", "link": SCRIPT + "x" * 20}).encode(),
]


@pytest.mark.parametrize("body", BODIES, ids=range(len(BODIES)))
def test_who_joins_says_a_language_and_no_more(asker, body):
    status, answer = asker.ask("/api/join", body)
    assert status in (400, 403) and set(answer) == {"error"} and "<" not in answer["error"]


def test_large_bodies_are_refused_before_they_are_read(asker, host):
    assert asker.ask("/api/join", b'{"language": "' + b"e" * 5000 + b'"}')[0] == 413
    name, port = host.split(":")
    with socket.create_connection((name, int(port)), timeout=TIMEOUT_S) as raw:
        raw.sendall(
            f"POST /api/join HTTP/1.1\r\nHost: {host}\r\nContent-Type: application/json\r\n"
            "Transfer-Encoding: chunked\r\n\r\n".encode()
        )
        raw.sendall(b"1000\r\n" + b"x" * 4096 + b"\r\n1000\r\n" + b"x" * 4096 + b"\r\n")
        assert b"413" in raw.recv(200).split(b"\r\n")[0]


TOKENS = (
    "",
    "Bearer",
    "Bearer ",
    "Bearer x",
    "Bearer " + "x" * 32,
    "Bearer " + "x" * 5000,
    "bearer {token}",
    "Basic {token}",
    "Bearer {token}x",
    "Bearer {wrong}",
    "Bearer '{token}'",
    "Bearer {token} ",
    "{token}",
    "Bearer  {token}",
    "Bearer {upper}",
    "Bearer ' OR 1=1 --",
    "Bearer a-token-of-the-tests",
)


@pytest.mark.parametrize("header", TOKENS)
def test_a_forged_token_is_nobody_s(asker, header):
    asker.join()
    token = asker.token
    swapped = token[:-1] + ("A" if token[-1] != "A" else "B")
    given = header.format(token=token, wrong=swapped, upper=token.swapcase())
    if given.strip() == f"Bearer {token}":
        pytest.skip("space around a field is not part of it")
    for path in ("/api/step", "/media/" + "0" * 24):
        assert asker.ask(path, None, Authorization=given)[0] in (401, 429)
    assert asker.ask("/api/withdraw", {}, Authorization=given)[0] in (401, 429)


def test_a_step_says_neither_conditions_nor_what_is_right(asker):
    step = asker.join()
    text = json.dumps(step)
    for word in ("ours", "theirs", "mismatched", "catch", "correct", "one.mean"):
        assert word not in text
    (clip,) = step["trial"]["clips"]
    assert len(clip["id"]) == 24


WRONG = [
    {"answer": "ours"},
    {"answer": "Left"},
    {"answer": ""},
    {"answer": SCRIPT},
    {"answer": 1},
    {"answer": None},
    {"answer": "left" * 30},
    {"answer": ["left"]},
    {"seconds": -1},
    {"seconds": "1"},
    {"seconds": 1e9},
    {"seconds": None},
    {"replays": -1},
    {"replays": 1.5},
    {"replays": 10**6},
    {"replays": True},
    {"order": 0},
    {"order": -1},
    {"order": "1"},
    {"order": True},
    {"order": 10**9},
    {"late_ms": "x"},
    {"dropped": -1},
    {"more": 1},
    {"participant": "p1"},
    {"correct": "left"},
]


@pytest.mark.parametrize("wrong", WRONG, ids=lambda each: json.dumps(each)[:40])
def test_only_what_a_trial_offers_is_an_answer(asker, wrong):
    step = asker.join()
    status, answer = asker.answer(step, **wrong)
    assert (status, answer) == (400, {"error": "invalid"})
    assert asker.ask("/api/step")[1] == step


def test_an_answer_before_the_clip_was_seen_is_refused(asker):
    step = asker.join()
    body = {"order": 1, "answer": "left", "seconds": 0.1, "replays": 0}
    assert asker.ask("/api/answer", body) == (425, {"error": "early"})
    assert asker.answer(step)[0] == 200


def test_replayed_and_reordered_answers_change_nothing(asker):
    first = asker.join()
    status, second = asker.answer(first)
    assert status == 200 and second["trial"]["order"] == 2
    body = {"order": 1, "answer": "right", "seconds": 0.2, "replays": 0}
    assert asker.ask("/api/answer", body) == (200, second)  # stored once, as it was first
    for order in (3, 4):
        assert asker.ask("/api/answer", body | {"order": order})[0] == 409
    assert asker.ask("/api/step")[1] == second


def test_a_person_cannot_get_at_another_s_trial(asker, host):
    asker.join()
    other = Asker(host)
    step = other.join()
    assert other.answer(step)[0] == 200
    assert asker.ask("/api/step")[1]["trial"]["order"] == 1
    other.close()


def test_videos_are_given_to_participants_alone(asker):
    step = asker.join()
    path = f"/media/{step['trial']['clips'][0]['id']}"
    assert asker.send("GET", path)[0] == 401
    status, fields, data = asker.send("GET", path, None, {"Authorization": f"Bearer {asker.token}"})
    assert status == 200 and fields["content-type"] == "video/mp4" and data[4:8] == b"ftyp"


def test_a_whole_study_and_its_export_and_withdrawal(asker, tmp_path):
    step = asker.join()
    seen = 0
    while step["state"] == "trial":
        status, step = asker.answer(step)
        assert status == 200
        seen += 1
    assert step["state"] == "done" and len(step["code"]) == 10 and seen == 4
    admin = {"Authorization": "Bearer a-token-of-the-tests"}
    status, _, data = asker.send("GET", "/admin/answers.csv", None, admin)
    (tmp_path / "answers.csv").write_bytes(data)
    rows = read_answers(tmp_path / "answers.csv")
    assert status == 200 and len(rows) >= 4
    people = json.loads(asker.send("GET", "/admin/participants.json", None, admin)[2])
    mine = next(p for p in people["participants"] if p["code"] == step["code"])
    assert sum(row.participant == mine["participant"] for row in rows) == 4
    assert asker.ask("/api/withdraw", {}) == (200, {"state": "withdrawn"})
    assert asker.ask("/api/step")[0] == 401
    data = asker.send("GET", "/admin/answers.csv", None, admin)[2]
    assert mine["participant"].encode() not in data


@pytest.mark.parametrize("path", ["status", "answers.csv", "answers.json", "participants.json"])
def test_answers_are_given_to_the_administrator_alone(asker, path):
    asker.join()
    for header in ("", "Bearer", f"Bearer {asker.token}", "Bearer a-token-of-the-test"):
        assert asker.send("GET", f"/admin/{path}", None, {"Authorization": header})[0] == 401
    admin = {"Authorization": "Bearer a-token-of-the-tests"}
    assert asker.send("GET", f"/admin/{path}", None, admin)[0] == 200


def test_without_a_token_there_is_no_administration(flashes, tmp_path):
    environment = {"ELOCUTE_STUDY_ADMIN_TOKEN": ""}
    with served(
        flashes, "--database", f"sqlite:///{tmp_path}/a.db", environment=environment
    ) as host:
        asker = Asker(host)
        for header in ("Bearer ", "Bearer", ""):
            assert (
                asker.send("GET", "/admin/answers.csv", None, {"Authorization": header})[0] == 404
            )
        asker.close()


@pytest.mark.parametrize("token", ["", "short", "with space in the middle", "ü" * 20])
def test_public_needs_an_administrator_s_token(flashes, tmp_path, token):
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "elocute",
            "study",
            "serve",
            str(flashes),
            "--public",
            "a.example",
            "--address",
            "127.0.0.1",
            "--port",
            "0",
            "--database",
            f"sqlite:///{tmp_path}/a.db",
        ],
        env=os.environ | {"ELOCUTE_STUDY_ADMIN_TOKEN": token},
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S,
        check=False,
    )
    assert done.returncode == 2 and "ELOCUTE_STUDY_ADMIN_TOKEN" in done.stderr
    assert done.stderr.count("\n") == 1


def test_only_who_is_invited_comes_in(flashes, tmp_path):
    database = f"sqlite:///{tmp_path}/a.db"
    with served(flashes, "--invited", "--database", database) as host:
        asker = Asker(host)
        assert asker.ask("/api/join", {"language": "en"}) == (403, {"error": "link"})
        made = subprocess.run(
            [
                sys.executable,
                "-m",
                "elocute",
                "study",
                "links",
                str(flashes),
                "--count",
                "2",
                "--database",
                database,
            ],
            capture_output=True,
            text=True,
            timeout=TIMEOUT_S,
            check=True,
        )
        first, second = (line.split("#link=")[1] for line in made.stdout.split())
        assert asker.join(link=first)["state"] == "trial"
        assert asker.join(link=second)["state"] == "trial"
        asker.close()


def test_who_asks_too_often_is_told_to_wait(flashes, tmp_path):
    with served(flashes, "--joins", "5", "--database", f"sqlite:///{tmp_path}/a.db") as host:
        asker = Asker(host)
        got = [asker.ask("/api/join", {"language": "en"})[0] for _ in range(8)]
        assert got[:5] == [201] * 5 and 429 in got[5:]
        guesses = [
            asker.ask("/api/step", None, Authorization=f"Bearer {n:032}")[0] for n in range(40)
        ]
        assert guesses[0] == 401 and guesses[-1] == 429
        asker.close()


def test_a_full_disk_is_told_and_nothing_is_pretended(flashes, tmp_path):
    """The limit on the size of files stands for a full disk; the person tries again and goes on."""
    database = tmp_path / "a.db"

    def limited():
        resource.setrlimit(resource.RLIMIT_FSIZE, (150_000, resource.RLIM_INFINITY))
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)

    with served(flashes, "--database", f"sqlite:///{database}", preexec_fn=limited) as host:
        asker = Asker(host)
        joined, status, answer = [], 0, None
        for _ in range(200):
            status, answer = asker.ask("/api/join", {"language": "en"})
            if status != 201:
                break
            joined.append(answer["token"])
        assert (status, answer) == (503, {"error": "stored"}) and joined
        for token in joined:  # everybody who was told to be stored is
            asker.token = token
            assert asker.ask("/api/step")[0] == 200
        asker.close()


@pytest.mark.parametrize("seed", range(3))
def test_a_killed_server_has_every_answer_it_acknowledged(flashes, tmp_path, seed):
    """200 kills under more load: `python -m benchmarks.study_load --kills 200`."""
    from benchmarks.study_load import kill_under_load

    found = kill_under_load(
        flashes, tmp_path / "a.db", people=6, after_s=0.4 + 0.4 * seed, seed=seed
    )
    assert found.acknowledged > 0
    assert (found.lost, found.twice, found.changed) == (0, 0, 0)


def test_languages_have_the_same_texts():
    english, german = (json.loads((PAGES / f"{name}.json").read_text()) for name in ("en", "de"))
    assert list(english) == list(german)
    for name, text in english.items():
        assert german[name].count("{") == text.count("{"), name


PANEL_LINKS = (
    "/?PROLIFIC_PID=5f0c&STUDY_ID=61aa&SESSION_ID=77bb",
    "/?workerId=A1B2&assignmentId=3C&hitId=4D",
    "/?fbclid=IwAR0x-_&utm_source=mail",
    "/?",
    "/?x=" + "1" * 2_000,
    "/?a=%00%ff&b=../../etc/passwd&c=<script>",
)


@pytest.mark.parametrize("link", PANEL_LINKS)
def test_whatever_a_panel_adds_to_the_link_the_page_comes(asker, link):
    status, fields, data = asker.send("GET", link)
    assert status == 200 and fields["content-type"].startswith("text/html")
    assert data == (PAGES / "index.html").read_bytes()


def test_the_id_of_a_panel_is_kept_and_brings_its_person_back(asker, host):
    panel = {"id": "5f0c", "study": "61aa", "session": "77bb"}
    step = asker.join(panel=panel)
    assert asker.answer(step)[0] == 200
    again = Asker(host)  # a second visit, from another device
    status, joined = again.ask("/api/join", {"language": "en", "panel": panel})
    assert status == 201 and joined["step"]["trial"]["order"] == 2
    assert asker.ask("/api/step")[0] == 401  # one person, one page
    admin = {"Authorization": "Bearer a-token-of-the-tests"}
    people = json.loads(asker.send("GET", "/admin/participants.json", None, admin)[2])
    assert [p["answered"] for p in people["participants"] if p["panel"] == panel] == [1]
    again.token = joined["token"]
    assert again.ask("/api/withdraw", {})[0] == 200
    body = {"language": "en", "panel": panel}
    assert again.ask("/api/join", body) == (403, {"error": "again"})
    assert b"5f0c" not in asker.send("GET", "/admin/participants.json", None, admin)[2]
    again.close()


@pytest.mark.parametrize(
    "panel",
    [
        *({}, {"study": "1"}, {"id": ""}, {"id": 1}, {"id": "a\n"}, {"id": "a", "x": "b"}, "a"),
        *({"id": "{{%PROLIFIC_PID%}}"}, {"id": "${e://Field/PID}"}, {"id": "[%RID%]"}),
        *({"id": "%SURVEY_CODE%"}, {"id": "{psid}"}, {"id": "<your id>"}, {"id": "[request_id]"}),
    ],
)
def test_what_is_no_id_of_a_panel_is_refused(asker, panel):
    assert asker.ask("/api/join", {"language": "en", "panel": panel})[0] == 400
