"""A simulated participant: does in a real browser what a person does with a study's page."""

from __future__ import annotations

import json
from typing import Any

from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

from tests.support.browser import eventually

READY = "document.getElementById('main').dataset.ready === 'yes'"
ANSWERABLE = f"{READY} && !document.querySelector('fieldset').disabled"
INTERLUDE = "[...document.querySelectorAll('main button')].some(b => b.textContent === 'Start')"
OVER = "document.getElementById('code') !== null"
HEADING = "document.querySelector('main h1')?.textContent"


class Participant:
    """Goes through a study by its page; waits for what the page shows, never for a while."""

    def __init__(self, driver: Any, host: str) -> None:
        self.driver, self.host = driver, host

    def run(self, script: str, *given: Any) -> Any:
        return self.driver.execute_script(script, *given)

    def until(self, condition: str) -> Any:
        """Wait until an expression of the page is true, and give it."""
        found: list[Any] = []
        if eventually(lambda: found.append(self.run(f"return {condition}")) or found[-1]):
            return found[-1]
        told = self.run("return document.body.innerText")
        raise AssertionError(f"never {condition}: {told!r} {self.driver.get_log('browser')}")

    def click(self, selector: str) -> None:
        self.driver.find_element(By.CSS_SELECTOR, selector).click()

    def open(self, fragment: str = "") -> None:
        """Come for the first time."""
        self.driver.get(f"http://{self.host}/")
        self.run("localStorage.clear()")
        self.driver.get("about:blank")
        self.driver.get(f"http://{self.host}/{fragment}")
        self.until("document.getElementById('agree')")

    def agree(self) -> None:
        """Agree, and set the screen."""
        self.click("#agree")
        self.click("main button.main")
        self.until("document.getElementById('greys')")

    def see(self) -> None:
        """Pass the check of the screen."""
        self.run(
            "const s = document.getElementById('greys'); s.value = '8';"
            "s.dispatchEvent(new Event('change'))"
        )
        self.click("main button.main")

    def begin(self) -> None:
        """All that comes before the first trial."""
        self.open()
        self.agree()
        self.see()
        self.next_trial()

    def next_trial(self) -> bool:
        """Go on to a trial that is ready; False where all is over."""
        while True:
            self.until(f"({READY}) || ({INTERLUDE}) || ({OVER})")
            if self.run(f"return {OVER}"):
                return False
            if self.run(f"return {READY}"):
                return True
            heading = self.run(f"return {HEADING}")
            self.click("main button.main")
            self.until(f"({HEADING}) !== {json.dumps(heading)} || {READY}")

    def order(self) -> int:
        """The number of the trial on the page."""
        return int(self.run("return document.getElementById('count').textContent.split(' ')[0]"))

    def watch(self) -> None:
        """Play, and wait until an answer may be given."""
        self.click(".stage + .row button")
        self.until(ANSWERABLE)

    def choose(self, place: int = 0) -> None:
        self.driver.find_elements(By.CSS_SELECTOR, "fieldset label.choice")[place].click()

    def gone(self, order: int) -> str:
        """What is true once a trial was left."""
        return f"!({READY}) || document.getElementById('count').textContent !== '{order}'"

    def answer(self, place: int = 0, *, twice: bool = False) -> None:
        """Watch and answer one trial."""
        self.watch()
        self.choose(place)
        before = self.run("return document.getElementById('count').textContent")
        button = self.driver.find_element(By.XPATH, "//main//button[.='Next' or .='Weiter']")
        self.run("arguments[0].click(); if (arguments[1]) arguments[0].click()", button, twice)
        self.until(
            f"({OVER}) || ({INTERLUDE}) ||"
            f" document.getElementById('count').textContent !== {json.dumps(before)}"
        )

    def answer_by_keys(self, digit: str) -> None:
        """Watch and answer one trial without a mouse."""
        before = self.run("return document.getElementById('count').textContent")
        self.driver.switch_to.active_element.send_keys("p")
        self.until(ANSWERABLE)
        self.driver.switch_to.active_element.send_keys(digit)
        self.driver.switch_to.active_element.send_keys(Keys.ENTER)
        self.until(
            f"({OVER}) || ({INTERLUDE}) ||"
            f" document.getElementById('count').textContent !== {json.dumps(before)}"
        )

    def finish(self) -> str:
        """All trials that are left; gives the completion code."""
        while self.next_trial():
            self.answer()
        return self.run("return document.getElementById('code').textContent")
