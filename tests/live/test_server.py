"""The page and the WebSockets: who is let in, and what becomes of what they send."""

from __future__ import annotations

import http.client
import socket
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("websockets")
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from mrhubo.errors import UserError
from mrhubo.live.endpoints import TOKEN_VARIABLE, Endpoint, find_token, token_fits
from mrhubo.live.inbox import Inbox
from mrhubo.live.messages import MAX_BYTES
from mrhubo.live.server import PageSource, Server
from mrhubo.live.visitors import Visitors, find_file
from tests.live.messages import beat, message

_PATIENCE = 120.0
"""Seconds: on a busy machine a thread may wait for its turn."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    page = tmp_path / "page"
    page.mkdir()
    (page / "index.html").write_text("<p>hello")
    (page / "models").mkdir()
    (page / "models" / "net.wasm").write_bytes(b"\0wasm")
    (tmp_path / "secret.txt").write_text("secret")
    (page / "link.txt").symlink_to(tmp_path / "secret.txt")
    (page / ".hidden").write_text("hidden")
    return page


@pytest.fixture
def server(folder: Path) -> Iterator[Server]:
    found = Server(Endpoint("127.0.0.1", 0), folder)
    found.open()
    yield found
    found.close()


def soon(true: Callable[[], Any]) -> None:
    """Waits until something is so."""
    end = time.monotonic() + _PATIENCE
    while not true():
        assert time.monotonic() < end, "it never was"
        time.sleep(0.01)


def get(server: Server, path: str, **headers: str) -> tuple[int, bytes, dict[str, str]]:
    connection = http.client.HTTPConnection("127.0.0.1", server.endpoint.port, timeout=_PATIENCE)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    return answer.status, answer.read(), dict(answer.getheaders())


def live(server: Server, query: str = "") -> str:
    return f"ws://127.0.0.1:{server.endpoint.port}/live{query}"


def test_it_serves_the_page_and_nothing_beside_it(server: Server) -> None:
    status, body, headers = get(server, "/")
    assert (status, body) == (200, b"<p>hello") and headers["Content-Type"] == "text/html; charset=utf-8"
    assert "frame-ancestors 'none'" in headers["Content-Security-Policy"]
    assert get(server, "/models/net.wasm?v=1")[2]["Content-Type"] == "application/wasm"
    for path in ("/../secret.txt", "/%2e%2e/secret.txt", "/link.txt", "/.hidden", "/models", "/none", "/a%00b"):
        assert get(server, path)[0] == 404, path


def test_it_hands_on_the_models_and_nothing_beside_them(
    server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MRHUBO_POSE_MODELS", str(tmp_path / "models"))
    assert get(server, "/pose/pose.js")[0] == 404, "they have not been fetched"
    (tmp_path / "models").mkdir()
    for name in ("pose.js", "pose_solution_wasm_bin.wasm", "other.js"):
        (tmp_path / "models" / name).write_bytes(name.encode())
    status, body, headers = get(server, "/pose/pose.js")
    assert (status, body) == (200, b"pose.js") and headers["Content-Type"].startswith("text/javascript")
    assert get(server, "/pose/pose_solution_wasm_bin.wasm")[2]["Content-Type"] == "application/wasm"
    for path in ("/pose/other.js", "/pose/../secret.txt", "/pose/", "/pose/%2e%2e/secret.txt", "/pose.js"):
        assert get(server, path)[0] == 404, path


def test_a_client_sends_and_watches(server: Server) -> None:
    inbox, source = Inbox(0.25), PageSource(server)
    with connect(live(server), origin=f"http://127.0.0.1:{server.endpoint.port}") as client:  # pyright: ignore
        client.send(beat(0).decode())
        client.send(message(1).decode())
        client.send("{")
        soon(lambda: source.read(inbox, 1.0) and inbox.counts["malformed"])
        assert inbox.held and inbox.counts["frames"] == 1
        server.show("one")
        assert client.recv(timeout=_PATIENCE) == "one"
    soon(lambda: source.read(inbox, 1.1) and not inbox.held)


@pytest.mark.parametrize(
    ("path", "headers", "fault"),
    [
        ("/", {"Host": "evil.example"}, "host"),
        ("/", {"Host": "evil.example:{port}"}, "host"),
        ("/live", {"Host": "127.0.0.1:{port}", "Origin": "http://evil.example"}, "origin"),
        ("/live", {"Host": "127.0.0.1:{port}", "Origin": "null"}, "origin"),
        ("/live", {"Host": "127.0.0.1:{port}", "Origin": "http://127.0.0.1:1"}, "origin"),
        ("/live", {"Host": "rebound.example:{port}", "Origin": "http://rebound.example:{port}"}, "host"),
    ],
)
def test_pages_of_strangers_are_refused(server: Server, path: str, headers: dict[str, str], fault: str) -> None:
    told = {name: value.format(port=server.endpoint.port) for name, value in headers.items()}
    if path == "/live":
        told |= {
            "Upgrade": "websocket",
            "Connection": "Upgrade",
            "Sec-WebSocket-Version": "13",
            "Sec-WebSocket-Key": "MDEyMzQ1Njc4OTAxMjM0NQ==",
        }
    assert get(server, path, **told)[0] == 403
    inbox = Inbox(0.25)
    server.take(inbox, 0.0)
    assert inbox.counts[fault] == 1


def test_what_is_no_request_is_survived(server: Server) -> None:
    for garbage in (
        b"\x00\xff" * 50 + b"\r\n\r\n",
        b"GET / HTTP/1.1\r\n\r\n",
        b"POST /live HTTP/1.1\r\nHost: x\r\n\r\n",
    ):
        with socket.create_connection(("127.0.0.1", server.endpoint.port), timeout=_PATIENCE) as raw:
            raw.sendall(garbage)
            raw.settimeout(_PATIENCE)
            raw.recv(10)
    assert get(server, "/")[0] == 200


@pytest.mark.parametrize("path", ["//[x", "//[1]x/live"])
def test_an_address_that_is_none_is_refused_and_counted(server: Server, path: str) -> None:
    assert get(server, path)[0] == 403
    inbox = Inbox(0.25)
    server.take(inbox, 0.0)
    assert inbox.counts["malformed"] == 1


def test_a_name_that_no_file_can_have_is_not_there(server: Server) -> None:
    assert get(server, "/" + "a" * 5_000)[0] == 404


def test_a_message_that_is_too_long_ends_the_connection(server: Server) -> None:
    inbox = Inbox(0.25)
    with connect(live(server)) as client, pytest.raises(ConnectionClosed):
        client.send("x" * (MAX_BYTES + 1))
        client.recv(timeout=_PATIENCE)
    soon(lambda: server.take(inbox, 0.0) or inbox.counts["too_long"])


def test_whoever_is_slow_gets_the_newest_and_a_flood_is_bounded(server: Server) -> None:
    with connect(live(server)) as client:
        client.send(beat(0).decode())
        inbox = Inbox(0.25)
        soon(lambda: server.take(inbox, 0.0) or inbox.held)
        for number in range(500):
            server.show(str(number))
        seen = [client.recv(timeout=_PATIENCE)]
        while seen[-1] != "499":
            seen.append(client.recv(timeout=_PATIENCE))
        assert len(seen) < 100
        for number in range(300):
            client.send(message(number).decode())
        soon(lambda: len(server._waiting) == 64)
        assert len(server._waiting) == 64


TOLD = "#token=a-secret-of-some-length"


def test_beyond_loopback_a_token_is_needed(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(TOKEN_VARIABLE, "a-secret-of-some-length")
    server = Server(Endpoint("0.0.0.0", 0), folder)
    server.open()
    try:
        for query in ("", "?token=", "?token=a-secret-of-some-lengtH", "?token=a&token=a-secret-of-some-length"):
            with pytest.raises(InvalidStatus):
                connect(live(server, query))
        with connect(live(server, "?token=a-secret-of-some-length")) as client:
            assert client.response is not None and client.response.status_code == 101
        with connect(live(server), additional_headers={"Authorization": "Bearer a-secret-of-some-length"}):
            pass
        assert all(url.endswith("/#token=a-secret-of-some-length") for url in server.urls)
        assert server.urls[0] == f"http://{socket.gethostname()}:{server.endpoint.port}/" + TOLD
        for url in server.urls[1:]:  # whoever opens them is let in
            page = f"ws://{url.removeprefix('http://').removesuffix('/' + TOLD)}/live?token=a-secret-of-some-length"
            with connect(page):
                pass
        assert get(server, "/")[0] == 200, "the page holds no secret"
        inbox = Inbox(0.25)
        server.take(inbox, 0.0)
        assert inbox.counts["token"] == 4
    finally:
        server.close()


def test_tokens(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(TOKEN_VARIABLE, raising=False)
    assert find_token("127.0.0.1") is find_token("localhost") is find_token("::1") is None
    first, second = find_token("0.0.0.0"), find_token("192.168.1.5")
    assert first and second and first != second and len(first) >= 32
    monkeypatch.setenv(TOKEN_VARIABLE, "short")
    with pytest.raises(UserError, match=TOKEN_VARIABLE):
        find_token("0.0.0.0")
    assert token_fits(None, None) and token_fits("a", "a")
    assert not any(token_fits("abc", given) for given in (None, "", "ab", 3, ["abc"], "\ud800"))


@pytest.mark.parametrize("host", ["localhost:80", "127.0.0.1:80", "[::1]:80", "127.0.0.1"])
def test_hosts_that_are_ours(host: str) -> None:
    assert Visitors(Endpoint("127.0.0.1", 80), None).fault("/", host, None) is None


@pytest.mark.parametrize(
    "host",
    ["", "10.0.0.1:80", "localhost.evil:80", "127.0.0.1:81", "user@127.0.0.1.evil:80", "[::1", "127.0.0.1:99999999"],
)
def test_hosts_that_are_not(host: str) -> None:
    assert Visitors(Endpoint("127.0.0.1", 80), None).fault("/", host, None) == "host"


def test_a_port_that_is_used_is_told(server: Server, folder: Path) -> None:
    second = Server(server.endpoint, folder)
    with pytest.raises(UserError, match="cannot listen"):
        second.open()


@pytest.mark.parametrize("text", ["x", "1.2.3.4", "h:", "h:99999", ":5", "h:٣", "a:b:c"])
def test_endpoints_that_are_none(text: str) -> None:
    with pytest.raises(UserError, match="HOST:PORT"):
        Endpoint.read(text, "--sink udp")


def test_endpoints() -> None:
    assert Endpoint.read("[::1]:5", "x") == Endpoint("::1", 5) and Endpoint("::1", 5).shown == "[::1]:5"
    assert Endpoint.read("7", "x").is_loopback and Endpoint.read("", "x", 9) == Endpoint("127.0.0.1", 9)


def test_shipped_page_is_there() -> None:
    from mrhubo.live.server import PAGE

    assert find_file(PAGE, "/") is not None
