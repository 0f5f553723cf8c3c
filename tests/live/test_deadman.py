"""The button of the page, in a real browser: which presses count, and what the page says of those that do not."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import pytest

pytest.importorskip("websockets")

from mrhubo.live.inbox import Inbox
from mrhubo.live.server import Server
from tests.browser import Browser, find_browser

HINT = "document.querySelector('#hold small').textContent"
USUAL = "space bar, or press and hold"


@pytest.fixture(scope="module")
def browser(open_server: Server, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    find_browser()
    with Browser(tmp_path_factory.mktemp("browser") / "profile") as found:
        found.go(open_server.urls[0])
        yield found


def test_a_page_without_the_keyboard_says_so(browser: Browser) -> None:
    assert not browser.ask("document.hasFocus()") and "keyboard is elsewhere" in browser.ask(HINT)
    browser.key("keyUp")  # the browser gives it the focus first
    browser.until(f"document.hasFocus() && {HINT} === '{USUAL}'")


@pytest.fixture
def held(browser: Browser, open_server: Server) -> Iterator[Callable[[bool], None]]:
    """Waits until the session hears that the button is held, or not. In the beginning the page is connected."""
    inbox = Inbox(10.0)

    def wait(wanted: bool) -> None:
        end = time.monotonic() + 180
        while True:
            open_server.take(inbox, time.monotonic())
            if inbox.held == wanted == (browser.ask("document.getElementById('hold').ariaPressed") == "true"):
                return
            assert time.monotonic() < end, f"held is {inbox.held}; {browser.ask(HINT)}; {browser.complaints()}"
            time.sleep(0.02)

    browser.until("document.getElementById('state').textContent !== 'closed'")
    browser.key("keyUp")
    browser.until(f"document.hasFocus() && {HINT} === '{USUAL}'")
    wait(False)
    yield wait
    browser.key("keyUp")


def test_a_press_that_finds_no_connection_is_told_and_takes_another(
    browser: Browser, open_server: Server, held: Callable[[bool], None]
) -> None:
    browser.key("keyDown")
    held(True)
    open_server.close()
    browser.until("document.getElementById('state').textContent === 'closed'")
    browser.until(f"{HINT}.includes('press again')")  # it was held when the connection went
    browser.key("keyUp")
    browser.until(f"{HINT} === '{USUAL}'")
    browser.key("keyDown")
    browser.until(f"{HINT}.includes('press again')")  # pressed while there is none
    open_server.open()
    browser.until("document.getElementById('state').textContent === 'connected'")
    browser.key("keyDown", repeat=True)
    held(False)
    assert "press again" in browser.ask(HINT), "a robot does not begin to move because a connection is back"
    browser.key("keyUp")
    browser.key("keyDown")
    held(True)
    assert browser.ask(HINT) == USUAL
    browser.key("keyUp")
    held(False)


@pytest.mark.parametrize("element", ["camera", "model", "mirror", "hold"])
def test_whatever_has_the_focus_the_key_is_the_robots(
    browser: Browser, held: Callable[[bool], None], element: str
) -> None:
    browser.ask(f"document.getElementById('{element}').focus()")
    browser.key("keyDown")
    held(True)
    browser.key("keyDown", repeat=True)
    held(True)
    browser.key("keyUp")
    held(False)
    assert browser.ask("document.getElementById('notice').textContent") == "", "the camera was not started"
    assert browser.ask("document.getElementById('mirror').checked") is True
    assert browser.ask("document.getElementById('model').matches(':open')") in (False, None)


def test_a_keyboard_that_tells_no_code(browser: Browser, held: Callable[[bool], None]) -> None:
    browser.key("keyDown", code="")
    held(True)
    browser.key("keyUp", code="")
    held(False)


def test_a_window_that_loses_the_keyboard_lets_go(browser: Browser, held: Callable[[bool], None]) -> None:
    browser.key("keyDown")
    held(True)
    browser.ask("dispatchEvent(new Event('blur'))")
    held(False)
    browser.key("keyDown", repeat=True)  # it has the keyboard again, and the key is still down
    held(False)
    assert "press again" in browser.ask(HINT)
    browser.key("keyUp")
    browser.key("keyDown")
    held(True)


def test_a_pointer(browser: Browser, held: Callable[[bool], None]) -> None:
    place = browser.ask("(({x, y, width, height}) => ({x: x + width / 2, y: y + height / 2}))(document.getElementById('hold').getBoundingClientRect())")  # fmt: skip
    browser.call("Input.dispatchMouseEvent", type="mousePressed", button="left", clickCount=1, **place)
    held(True)
    browser.call("Input.dispatchMouseEvent", type="mouseMoved", x=5, y=500, button="left", buttons=1)
    held(True)
    browser.call("Input.dispatchMouseEvent", type="mouseReleased", button="left", clickCount=1, x=5, y=500)
    held(False)
