"""A browser without a window, steered by Chromium's DevTools protocol (https://chromedevtools.github.io/devtools-protocol)."""

from __future__ import annotations

import base64
import contextlib
import itertools
import json
import os
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import TracebackType
from typing import Any
from urllib.request import urlopen

import numpy as np
import pytest

_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
_PATIENCE = 120.0


def find_browser() -> str:
    """The program; skips the test where there is none."""
    for name in _NAMES:
        if (path := shutil.which(name)) is not None:
            return path
    pytest.skip(f"no browser is installed: {', '.join(_NAMES)}")


def write_y4m(path: Path, images: list[np.ndarray], rate: int = 15) -> Path:
    """Pictures (H, W, 3) of even sizes as raw video, which Chromium takes for a camera's, again and again (BT.601)."""
    height, width = images[0].shape[:2]
    with open(path, "wb") as file:
        file.write(f"YUV4MPEG2 W{width} H{height} F{rate}:1 Ip A1:1 C420jpeg\n".encode())
        for image_HW3 in images:
            red, green, blue = np.moveaxis(image_HW3.astype(np.float64), -1, 0)
            light = 16 + 0.257 * red + 0.504 * green + 0.098 * blue
            planes = [
                128 - 0.148 * red - 0.291 * green + 0.439 * blue,
                128 + 0.439 * red - 0.368 * green - 0.071 * blue,
            ]
            file.write(b"FRAME\n" + light.round().astype(np.uint8).tobytes())
            for plane in planes:
                file.write(plane.reshape(height // 2, 2, width // 2, 2).mean((1, 3)).round().astype(np.uint8).tobytes())
    return path


def _commands() -> Iterator[tuple[int, str]]:
    """Processes of this machine (Linux) and their command lines."""
    for place in Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):  # it has ended meanwhile
            yield int(place.parent.name), place.read_bytes().decode(errors="replace")


class Browser:
    """One page in a browser whose camera is a file."""

    def __init__(self, folder: Path, camera: Path | None = None) -> None:
        """`folder`: for its profile; `camera`: a .y4m file; None: the browser's own test picture."""
        self._process = subprocess.Popen(
            [
                find_browser(), "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--remote-debugging-port=0",
                "--remote-allow-origins=*", f"--user-data-dir={folder}", "--window-size=1200,800", "--no-first-run",
                "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist",
                "--use-fake-device-for-media-stream", "--use-fake-ui-for-media-stream",
                *([] if camera is None else [f"--use-file-for-fake-video-capture={camera}"]), "about:blank",
            ],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        self._folder, self._numbers = folder, itertools.count(1)
        self.events: list[dict[str, Any]] = []
        port_file = folder / "DevToolsActivePort"
        self.wait(lambda: port_file.exists() and port_file.read_text().count("\n") >= 1, "the browser does not start")
        port = port_file.read_text().split("\n")[0]
        from websockets.sync.client import connect

        with urlopen(f"http://127.0.0.1:{port}/json/list", timeout=60) as answer:
            target = next(one for one in json.load(answer) if one["type"] == "page")
        self._socket = connect(target["webSocketDebuggerUrl"], max_size=2**26)
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")

    def __enter__(self) -> Browser:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._socket.close()
        self._process.terminate()
        try:
            self._process.wait(30)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def wait(self, done: Callable[[], Any], what: str, seconds: float = _PATIENCE) -> Any:
        """What `done` returns, once that is true; fails by `what` if it never is."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if found := done():
                return found
            time.sleep(0.05)
        raise AssertionError(f"{what}; the browser said: {self.complaints()}" if hasattr(self, "events") else what)

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Calls a method of the protocol."""
        number = next(self._numbers)
        self._socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            message = json.loads(self._socket.recv(4 * _PATIENCE))
            if message.get("id") == number:
                assert "error" not in message, message
                return message["result"]
            self.events.append(message)

    def complaints(self) -> list[str]:
        """Errors that the page has met."""
        found = []
        for event in self.events:
            if event.get("method") == "Runtime.exceptionThrown":
                found.append(json.dumps(event["params"]["exceptionDetails"])[:500])
            elif event.get("method") == "Log.entryAdded" and event["params"]["entry"]["level"] == "error":
                found.append(event["params"]["entry"]["text"] + " " + event["params"]["entry"].get("url", ""))
        return found

    def go(self, url: str) -> None:
        """Opens a page."""
        self.call("Page.navigate", url=url)
        self.until("document.readyState === 'complete'")

    def ask(self, script: str) -> Any:
        """The value of an expression in the page."""
        return self.call(
            "Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True, userGesture=True
        )["result"].get("value")

    def until(self, script: str, seconds: float = _PATIENCE) -> Any:
        """Waits until an expression is true."""
        return self.wait(lambda: self.ask(script), f"never true: {script}", seconds)

    def key(self, kind: str, code: str = "Space", repeat: bool = False) -> None:
        """Presses (`keyDown`) or lets go of (`keyUp`) the space bar; `repeat`: it is held, and the system presses again."""
        self.call("Input.dispatchKeyEvent", type=kind, code=code, key=" ", windowsVirtualKeyCode=32, autoRepeat=repeat)

    def unplug(self) -> None:
        """Kills the browser's process that reads cameras, as nothing else takes a camera of Chromium's own away."""
        found = [pid for pid, command in _commands() if str(self._folder) in command and "VideoCapture" in command]
        assert found, "no process of the browser reads cameras"
        for pid in found:
            os.kill(pid, signal.SIGKILL)

    def click(self, x: float, y: float) -> None:
        """Moves the mouse to a place of the page [pixels], and presses and lets go of its left button."""
        self.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)
        for kind in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def picture(self, path: Path) -> None:
        """A screenshot."""
        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"]))
