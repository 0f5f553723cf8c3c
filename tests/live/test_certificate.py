"""The certificate of a page by https: whom it convinces, how long it is kept, and what of a user's own is refused."""

from __future__ import annotations

import asyncio
import datetime
import http.client
import shutil
import ssl
import stat
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("websockets")
pytest.importorskip("cryptography")
from websockets.asyncio.client import connect
from websockets.exceptions import InvalidStatus

from mrhubo.errors import UserError
from mrhubo.live import certificate as room
from mrhubo.live.__main__ import main
from mrhubo.live.certificate import ServerCertificate, open_certificate
from mrhubo.live.endpoints import TOKEN_VARIABLE, Endpoint
from mrhubo.live.plan import Plan
from mrhubo.live.server import Server


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("cache")
        patch.setenv("XDG_CACHE_HOME", str(folder))
        yield folder


@pytest.fixture(scope="module")
def ours(kept: Path) -> ServerCertificate:
    return open_certificate()


@pytest.fixture(scope="module")
def server(ours: ServerCertificate) -> Iterator[Server]:
    found = Server(Endpoint("127.0.0.1", 0), certificate=ours)
    found.open()
    yield found
    found.close()


def who_trusts(path: Path) -> ssl.SSLContext:
    """A client that checks names and dates, and trusts one certificate."""
    context = ssl.create_default_context(cafile=str(path))
    context.verify_flags |= ssl.VERIFY_X509_STRICT
    return context


def test_a_client_that_was_told_of_it_checks_it_and_comes_in(server: Server, ours: ServerCertificate) -> None:
    port = server.endpoint.port
    for host in ("127.0.0.1", "localhost"):
        page = http.client.HTTPSConnection(host, port, timeout=120, context=who_trusts(ours.path))
        page.connect()
        assert page.sock.version() in ("TLSv1.2", "TLSv1.3")  # pyright: ignore[reportAttributeAccessIssue]
        page.request("GET", "/")
        assert page.getresponse().status == 200
    server.show("one")

    async def watch() -> str | bytes:
        here, trust = f"127.0.0.1:{port}", who_trusts(ours.path)
        async with connect(f"wss://{here}/live", ssl=trust, origin=f"https://{here}") as client:  # pyright: ignore
            server.show("two")
            return await asyncio.wait_for(client.recv(), 30)

    assert asyncio.run(watch()) in ("one", "two")
    assert server.urls[0] == f"https://127.0.0.1:{port}/"


def test_who_was_not_told_refuses_it(server: Server) -> None:
    stranger = http.client.HTTPSConnection("127.0.0.1", server.endpoint.port, timeout=120)
    with pytest.raises(ssl.SSLCertVerificationError, match="self-signed"):
        stranger.request("GET", "/")
    plain = http.client.HTTPConnection("127.0.0.1", server.endpoint.port, timeout=120)
    with pytest.raises((http.client.HTTPException, OSError)):
        plain.request("GET", "/")
        plain.getresponse()


def status(url: str, trust: ssl.SSLContext, origin: str) -> int:
    """What a server answers who wants to begin a WebSocket; 101: it may. In one thread (asyncio): the client of
    `websockets.sync` reads and writes its TLS connection in two, which CPython locks
    since gh-134698; with 3.11 one request in a hundred was lost (https://github.com/python/cpython/issues/134698).
    """

    async def ask() -> int:
        try:
            async with connect(url, ssl=trust, origin=origin):  # pyright: ignore[reportArgumentType]
                return 101
        except InvalidStatus as error:
            return error.response.status_code

    return asyncio.run(ask())


def test_pages_and_tokens_as_without_it(ours: ServerCertificate, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(TOKEN_VARIABLE, "a-secret-of-some-length")
    server = Server(Endpoint("0.0.0.0", 0), certificate=ours)
    server.open()
    try:
        here, trust = f"127.0.0.1:{server.endpoint.port}", who_trusts(ours.path)
        known = "?token=a-secret-of-some-length"
        for query, origin in (("", f"https://{here}"), (known, f"http://{here}"), (known, "https://evil.example")):
            assert status(f"wss://{here}/live{query}", trust, origin) == 403
        assert status(f"wss://{here}/live{known}", trust, f"https://{here}") == 101
        assert server.urls[0].startswith("https://") and server.urls[0].endswith("/#token=a-secret-of-some-length")
    finally:
        server.close()


def test_it_is_kept_until_it_no_longer_serves(ours: ServerCertificate, monkeypatch: pytest.MonkeyPatch) -> None:
    assert stat.S_IMODE(ours.path.stat().st_mode) == 0o600, "nobody else reads the key"
    assert open_certificate().fingerprint == ours.fingerprint and len(ours.fingerprint) == 32 * 3 - 1
    der = ssl.PEM_cert_to_DER_cert(ours.path.read_text().split("-----BEGIN PRIVATE")[0])
    assert ours.fingerprint.replace(":", "").lower() == __import__("hashlib").sha256(der).hexdigest()
    other = open_certificate(host="10.1.2.3")
    assert other.fingerprint != ours.fingerprint, "for one more address"
    assert open_certificate().fingerprint == other.fingerprint, "which serves without it too"
    later = datetime.datetime.now(datetime.UTC) + datetime.timedelta(days=340)
    monkeypatch.setattr(room, "_now", lambda: later)
    assert open_certificate().fingerprint != other.fingerprint, "it has 25 days left"
    monkeypatch.undo()
    again = open_certificate()
    again.path.write_bytes(b"-----BEGIN CERTIFICATE-----\nbroken off")
    assert open_certificate().fingerprint != again.fingerprint


def test_a_certificate_of_ones_own(ours: ServerCertificate, tmp_path: Path) -> None:
    own = tmp_path / "own.pem"
    shutil.copy(ours.path, own)
    found = open_certificate(own)
    assert not found.ours and ours.ours and found.path == own
    plan = Plan(certificate=found)
    plan.add_sink("ws:0")
    assert f"certificate: your own; SHA-256 {found.fingerprint}" in plan.told()


@pytest.mark.parametrize(
    "content", [b"", b"what", b"-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n", None]
)
def test_files_that_are_none(content: bytes | None, tmp_path: Path, ours: ServerCertificate) -> None:
    path = tmp_path / "own.pem"
    text = ours.path.read_bytes()
    path.write_bytes(text[: text.index(b"-----BEGIN PRIVATE")] if content is None else content)  # without its key
    with pytest.raises(UserError, match=r"own\.pem: is no certificate followed by its key"):
        open_certificate(path)
    with pytest.raises(UserError, match="no such file"):
        open_certificate(tmp_path / "none.pem")


@pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl is not installed")
def test_a_key_with_a_password_is_refused_and_nobody_is_asked(ours: ServerCertificate, tmp_path: Path) -> None:
    text = ours.path.read_bytes()
    locked = subprocess.run(
        ["openssl", "pkcs8", "-topk8", "-passout", "pass:secret", "-in", ours.path], capture_output=True, check=True
    ).stdout
    path = tmp_path / "locked.pem"
    path.write_bytes(text[: text.index(b"-----BEGIN PRIVATE")] + locked)
    with pytest.raises(UserError, match="has a password"):
        open_certificate(path)


def test_without_a_page_it_is_refused(ours: ServerCertificate) -> None:
    with pytest.raises(UserError, match="--https: there is no page"):
        main(["--robot", "nao", "--source", "udp", "--sink", "udp:127.0.0.1:9", "--https"])
    with pytest.raises(UserError, match="--certificate goes with --https"):
        main(["--robot", "nao", "--source", "ws", "--sink", "ws", "--certificate", "own.pem"])
