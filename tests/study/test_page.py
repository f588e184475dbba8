"""The study's page in a real browser: simulated participants, from consent to completion code."""

import contextlib
import json
import subprocess
import sys
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

from elocute.study.stimuli.stimuli import make_stimuli
from tests.study.participant import HEADING, INTERLUDE, OVER, READY, Participant
from tests.study.studies import HEAD, QUICK, VIDEOS, Asker, served
from tests.support.browser import headless_browser

pytestmark = pytest.mark.browser
AXE = Path(__file__).parents[2] / "web/node_modules/axe-core/axe.min.js"
ADMIN = {"Authorization": "Bearer a-token-of-the-tests"}
DESK, PHONE = (1000, 900), (390, 844)
SCRIPT = "<img src=x onerror=\"document.title='broken'\"><script>document.title='broken'</script>"


@pytest.fixture(scope="module")
def driver(need, tmp_path_factory):
    with headless_browser(need, tmp_path_factory.mktemp("profile"), "1000,900") as driver:
        yield driver


@pytest.fixture
def person(driver, host):
    driver.set_window_size(*DESK)
    driver.get_log("browser")
    return Participant(driver, host)


def answers_of(host, code):
    """The rows of who has a completion code."""
    asker = Asker(host)
    with contextlib.closing(asker):
        people = json.loads(asker.send("GET", "/admin/participants.json", None, ADMIN)[2])
        rows = json.loads(asker.send("GET", "/admin/answers.json", None, ADMIN)[2])["answers"]
    (mine,) = [each["participant"] for each in people["participants"] if each["code"] == code]
    return [each for each in rows if each["participant"] == mine]


def test_a_participant_comes_to_the_end_with_reloads_and_double_clicks(person, host):
    person.begin()
    person.answer(twice=True)
    person.next_trial()
    assert person.order() == 2
    person.driver.refresh()  # before an answer: the same trial again
    person.next_trial()
    assert person.order() == 2
    person.answer(1)
    person.driver.get("about:blank")  # the tab is closed, and opened again later
    person.driver.get(f"http://{host}/")
    person.next_trial()
    assert person.order() == 3
    rows = answers_of(host, person.finish())
    assert [row["order"] for row in rows] == [1, 2, 3, 4]
    assert [row["answer"] == row["left"] for row in rows] == [True, False, True, True]
    assert all(0.3 < row["seconds"] < 300 for row in rows)  # no milliseconds
    serious = [each for each in person.driver.get_log("browser") if each["level"] == "SEVERE"]
    assert not serious, serious


@pytest.mark.slow
def test_by_keyboard_alone(person, host):
    person.driver.get(f"http://{host}/")
    person.run("localStorage.clear()")
    person.driver.refresh()
    person.until("document.getElementById('agree')")

    def tab_to(condition):
        for _ in range(12):
            person.driver.switch_to.active_element.send_keys(Keys.TAB)
            if person.run(f"return document.activeElement.matches({json.dumps(condition)})"):
                return person.driver.switch_to.active_element
        raise AssertionError(condition)

    tab_to("#agree").send_keys(Keys.SPACE)
    tab_to("main button.main").send_keys(Keys.ENTER)
    person.until("document.getElementById('greys')")
    tab_to("#greys").send_keys("8")
    tab_to("main button.main").send_keys(Keys.ENTER)
    while True:
        person.until(f"({READY}) || ({OVER}) || ({HEADING} ?? '').match(/test|counts/)")
        if person.run(f"return {OVER}"):
            break
        if person.run(f"return {READY}"):
            person.answer_by_keys("2")
        else:
            heading = person.run(f"return {HEADING}")
            tab_to("main button.main").send_keys(Keys.ENTER)
            person.until(f"({HEADING}) !== {json.dumps(heading)}")
    rows = answers_of(host, person.run("return document.getElementById('code').textContent"))
    assert len(rows) == 4 and all(row["answer"] == row["right"] for row in rows)


@pytest.mark.slow
def test_two_tabs_store_each_answer_once(person, host):
    person.begin()
    first = person.driver.current_window_handle
    person.driver.switch_to.new_window("tab")
    try:
        person.driver.get(f"http://{host}/")
        person.next_trial()
        person.answer(1)
        person.next_trial()
        person.driver.switch_to.window(first)
        assert person.order() == 1
        person.answer(0)  # was answered in the other tab, and is not stored again
        person.next_trial()
        assert person.order() == 2
        rows = answers_of(host, person.finish())
        assert rows[0]["answer"] == rows[0]["right"] and len(rows) == 4
    finally:
        for handle in person.driver.window_handles:
            if handle != first:
                person.driver.switch_to.window(handle)
                person.driver.close()
        person.driver.switch_to.window(first)


@pytest.mark.slow
def test_both_sides_show_one_picture_and_the_right_one(person, host):
    """Every drawing is read back: both canvases are drawn in one go, from one decoded picture."""
    script = """
        window.drawn = [];
        const draw = CanvasRenderingContext2D.prototype.drawImage;
        CanvasRenderingContext2D.prototype.drawImage = function (video, ...rest) {
            draw.call(this, video, ...rest);
            const [r, g, b] = this.getImageData(32, 32, 1, 1).data;
            const side = [...document.querySelectorAll('canvas')].indexOf(this.canvas);
            if (side >= 0) window.drawn.push([side, r, g, b]);
        };"""
    added = person.driver.execute_cdp_cmd(
        "Page.addScriptToEvaluateOnNewDocument", {"source": script}
    )
    slowly = (  # so that a busy browser, too, draws each flash
        "const play = HTMLMediaElement.prototype.play; HTMLMediaElement.prototype.play ="
        " function () { this.playbackRate = 0.25; return play.call(this); }"
    )
    try:
        person.begin()
        person.run(f"window.drawn = []; {slowly}")
        person.answer()
        drawn = person.run("return window.drawn")
    finally:
        person.driver.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", added)
    assert [each[0] for each in drawn] == [0, 1] * (len(drawn) // 2) and len(drawn) > 10
    white = [[min(each[1:]) > 200 for each in drawn[side::2]] for side in (0, 1)]
    assert white[0] == white[1] and True in white[0]
    row = answers_of(host, person.finish())[0]
    blue = [each[3] > each[1] for each in drawn[:2]]  # of ours
    assert blue[0] == (row["left"] in ("ours", "mismatched"))


@pytest.mark.slow
def test_a_slow_network_only_takes_longer(person, host):
    network = {"offline": False, "latency": 60, "downloadThroughput": 150_000}
    person.driver.execute_cdp_cmd("Network.enable", {})
    person.driver.execute_cdp_cmd(
        "Network.emulateNetworkConditions", network | {"uploadThroughput": 50_000}
    )
    try:
        person.begin()
        assert len(answers_of(host, person.finish())) == 4
    finally:
        person.driver.execute_cdp_cmd(
            "Network.emulateNetworkConditions",
            {"offline": False, "latency": 0, "downloadThroughput": -1, "uploadThroughput": -1},
        )


def test_an_answer_that_is_not_stored_is_told_and_sent_again(person):
    person.begin()
    person.watch()
    person.choose()
    person.run(
        "const real = window.fetch; window.lost = 0; window.fetch = (path, options) => {"
        "if (path !== '/api/answer' || window.lost >= 2) return real(path, options);"
        "window.lost += 1;"
        'return Promise.resolve(new Response(\'{"error": "stored"}\', {status: 503})); }'
    )
    person.run("[...document.querySelectorAll('main button')].at(-1).click()")
    person.until("document.getElementById('status').textContent.includes('not stored yet')")
    assert person.order() == 1
    person.until(INTERLUDE)
    person.next_trial()
    assert person.order() == 2


def test_who_leaves_has_nothing_stored(person, host):
    person.begin()
    person.answer()
    person.next_trial()
    token = person.run("return localStorage.getItem('elocute-study')")
    person.click("#leave")
    person.until("document.querySelector('dialog[open]')")
    person.driver.find_element(By.XPATH, "//dialog//button[.='Delete my answers']").click()
    person.until("document.body.innerText.includes('Your answers are deleted')")
    asker = Asker(host)
    with contextlib.closing(asker):
        asker.token = token
        assert asker.ask("/api/step")[0] == 401
    assert person.run("return localStorage.length") == 0
    person.driver.refresh()
    person.until("document.getElementById('agree')")


@pytest.mark.slow
def test_in_german_on_a_phone(person, host):
    person.driver.set_window_size(*PHONE)
    person.open()
    person.run(
        "const s = document.querySelector('select'); s.value = 'de';"
        "s.dispatchEvent(new Event('change'))"
    )
    person.until("document.documentElement.lang === 'de'")
    person.until("document.body.innerText.includes('Ich bin mindestens 18')")
    person.agree()
    person.see()
    person.until("document.body.innerText.includes('Ein kurzer Test')")
    person.click("main button.main")
    person.until(READY)
    assert person.run("return document.documentElement.scrollWidth <= window.innerWidth")
    boxes = person.run(
        "return [...document.querySelectorAll('canvas')].map(c => c.getBoundingClientRect())"
        ".map(b => [b.top, b.left, b.right, b.width])"
    )
    assert boxes[0][0] == boxes[1][0] and boxes[0][3] == pytest.approx(boxes[1][3], abs=0.5)
    assert boxes[0][1] >= 0 and boxes[1][2] <= PHONE[0]


def test_a_screen_that_is_too_narrow_is_told(person):
    person.open()
    person.agree()
    person.run("Object.defineProperty(window, 'innerWidth', {value: 200, configurable: true})")
    person.run("window.dispatchEvent(new Event('resize'))")
    assert person.run("return !document.querySelector('.warning').hidden")
    assert person.run("return document.querySelector('main button.main').disabled")


@pytest.mark.slow
@pytest.mark.parametrize("size", [DESK, PHONE], ids=["desk", "phone"])
def test_axe_finds_nothing(person, need, size):
    need(AXE.is_file(), "web/node_modules/axe-core (npm ci)")
    person.driver.set_window_size(*size)
    # Its own style sheet, which colours nothing, would be refused.
    person.driver.execute_cdp_cmd("Page.setBypassCSP", {"enabled": True})
    found = {}

    def look(name):
        person.run(AXE.read_text(encoding="utf-8"))
        result = person.driver.execute_async_script("axe.run().then(arguments[0])")
        assert result["passes"]
        found[name] = [
            (e["id"], [n["html"][:90] for n in e["nodes"]]) for e in result["violations"]
        ]

    try:
        person.open()
        look("consent")
        person.agree()
        look("screen")
        person.see()
        person.until(f"({HEADING} ?? '').includes('test')")
        look("interlude")
        person.next_trial()
        look("trial")
        person.watch()
        person.choose()
        look("answer")
        person.click("#leave")
        person.until("document.querySelector('dialog[open]')")
        look("dialog")
        person.driver.find_element(By.XPATH, "//dialog//button[.='Go on']").click()
        person.finish()
        look("done")
    finally:
        person.driver.execute_cdp_cmd("Page.setBypassCSP", {"enabled": False})
    assert {name: told for name, told in found.items() if told} == {}


@pytest.mark.slow
def test_no_other_host_is_asked(person, host):
    person.driver.get_log("performance")
    person.begin()
    person.finish()
    asked = set()
    for entry in person.driver.get_log("performance"):
        message = json.loads(entry["message"])["message"]
        if message["method"] == "Network.requestWillBeSent":
            asked.add(message["params"]["request"]["url"])
    hosts = {urlsplit(url).netloc for url in asked if url.startswith(("http", "ws"))}
    assert hosts == {host}


@pytest.fixture(scope="module")
def words(videos, tmp_path_factory):
    """A study of words whose every text tries to be markup."""
    folder = tmp_path_factory.mktemp("words")
    bad = SCRIPT.replace('"', '\\"')
    text = (HEAD + VIDEOS + QUICK.replace("items = 1", "items = 0")).replace(
        "binary", "intelligibility"
    )
    text = text.replace("headphones = false", "headphones = true")
    text = text.replace("Flashes", bad).replace("A person", bad)
    text = text.replace(
        "[[conditions]]", f'question = "Q {bad}"\nabout = "A {bad}"\n\n[[conditions]]', 1
    )
    choices = 'word = "<b>one</b>", choices = ["<b>one</b>", "<i onclick=x>", "&lt;", "left"]'
    text = text.replace('["ours/*.mp4"]', f'[{{file = "ours/*.mp4", {choices}}}]')
    (folder / "study.toml").write_text(text)
    make_stimuli(folder / "study.toml", folder / "study", data=videos)
    with served(folder / "study") as host:
        yield host


@pytest.mark.slow
def test_no_text_becomes_markup_and_headphones_are_checked(driver, words):
    person = Participant(driver, words)
    driver.set_window_size(*DESK)
    person.open()
    assert SCRIPT in person.run("return document.querySelector('main').textContent")
    person.agree()
    person.see()
    person.until("document.body.innerText.includes('put on headphones')")
    # Nobody hears anything here: the tones end at once.
    person.run(
        "const start = AudioBufferSourceNode.prototype.start;"
        "AudioBufferSourceNode.prototype.start = function () {"
        "start.call(this); this.dispatchEvent(new Event('ended')); }"
    )
    person.click("main .row button:first-child")
    person.until("!document.querySelector('main button.main').disabled")
    person.click("main button.main")
    for number in (1, 2, 3):
        person.until(f"document.body.innerText.includes('Round {number} of 3')")
        person.click("main .row button")
        person.until("!document.querySelector('fieldset').disabled")
        person.choose()
        person.click("main button.main")
    person.until(f"!({HEADING} ?? '').includes('quietest')")
    if person.run("return document.body.innerText.includes('loudspeakers')"):
        driver.find_element(By.XPATH, "//button[.='Go on without']").click()
    seen = 0
    while person.next_trial():
        assert person.run(f"return {HEADING}").startswith("Q <img")
        labels = person.run(
            "return [...document.querySelectorAll('fieldset label')].map(l => l.textContent)"
        )
        assert sorted(labels)[:3] == ["&lt;", "<b>one</b>", "<i onclick=x>"]
        person.answer(seen % 4)
        seen += 1
    assert seen == 6 and driver.title == SCRIPT
    assert (
        person.run("return document.querySelectorAll('main img, main script, main b').length") == 0
    )


@pytest.mark.slow
def test_one_command_after_another_makes_serves_and_exports(driver, videos, tmp_path):
    """From two folders of videos to a table, by the commands alone."""

    def elocute(*words):
        return subprocess.run(
            [sys.executable, "-m", "elocute", "study", *words],
            capture_output=True,
            text=True,
            timeout=300,
            check=True,
        ).stdout

    (tmp_path / "study.toml").write_text(HEAD + VIDEOS + QUICK)
    made = json.loads(
        elocute(
            "new",
            str(tmp_path / "study.toml"),
            "-o",
            str(tmp_path / "s"),
            "--data",
            str(videos),
            "--json",
        )
    )
    assert made["trials"] == 4 and made["kept"] == 0
    with served(tmp_path / "s") as host:
        person = Participant(driver, host)
        driver.set_window_size(*DESK)
        person.begin()
        code = person.finish()
    table = tmp_path / "answers.csv"
    elocute(
        "export", str(tmp_path / "s"), "-o", str(table), "--participants", str(tmp_path / "p.json")
    )
    assert len(table.read_text().splitlines()) == 5
    assert code in (tmp_path / "p.json").read_text()


def test_who_comes_from_a_panel_goes_back_with_its_code(driver, videos, tmp_path):
    """The id is told and kept; a second visit by the same link ends where the first one did."""
    panel = (
        '[panel]\nreturn_to = "https://p.example/done?cc={code}&s={session}"\ndone_code = "C1X"\n'
    )
    (tmp_path / "study.toml").write_text(HEAD + VIDEOS + QUICK + panel)
    make_stimuli(tmp_path / "study.toml", tmp_path / "s", data=videos)
    token = {"ELOCUTE_STUDY_ADMIN_TOKEN": ADMIN["Authorization"].split()[1]}
    with served(tmp_path / "s", environment=token) as host:
        person = Participant(driver, host)
        driver.set_window_size(*DESK)
        link = "?fbclid=Iw-_&prolific_pid=%205f0c+&STUDY_ID=61aa&SESSION_ID=7%267&x=%3Cb%3E"
        person.open("?PROLIFIC_PID={{%PROLIFIC_PID%}}&STUDY_ID=61aa")  # a panel left it unfilled
        assert "%PROLIFIC" not in driver.find_element(By.ID, "main").text
        person.open("?survey_code=%SURVEY_CODE%")
        assert "SURVEY" not in driver.find_element(By.ID, "main").text
        preview = "assignmentId=ASSIGNMENT_ID_NOT_AVAILABLE&hitId=4D"  # only looked at
        driver.get(f"http://{host}/?{preview}")
        person.until("document.body.innerText.includes('your panel gave you')")
        assert not driver.find_elements(By.ID, "agree")
        person.open(link)
        assert "5f0c" in driver.find_element(By.ID, "main").text
        person.agree()
        person.see()
        person.next_trial()
        assert person.finish() == "C1X"
        back = driver.find_element(By.CSS_SELECTOR, "main a.back")
        assert back.get_attribute("href") == "https://p.example/done?cc=C1X&s=7%267"
        person.open(link)  # from another browser: nothing is kept in this one
        person.click("#agree")
        person.click("main button.main")
        person.until(OVER)
        asker = Asker(host)
        with contextlib.closing(asker):
            people = json.loads(asker.send("GET", "/admin/participants.json", None, ADMIN)[2])
        assert [each["panel"] for each in people["participants"]] == [
            {"id": "5f0c", "study": "61aa", "session": "7&7"}
        ]
