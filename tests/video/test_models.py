"""What is fetched is what it should be, and lies where it should, whole or not at all. No test needs a network."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import pytest

from mrhubo.errors import Unreachable, UserError
from mrhubo.live.__main__ import main as live
from mrhubo.models import main
from mrhubo.video import models
from mrhubo.video.models import FILES, INTEGRITY, find_models, models_folder, set_up
from mrhubo.video.registry import download, registry_url
from tests.video.npm_archive import WHOLE, digest, write_archive


@pytest.fixture(autouse=True)
def nobodys_settings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No settings of whoever runs the tests."""
    for name in ("npm_config_registry", "NPM_CONFIG_REGISTRY", "MRHUBO_POSE_MODELS", "http_proxy", "HTTP_PROXY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("npm_config_userconfig", str(tmp_path / "npmrc"))
    monkeypatch.setenv("no_proxy", "127.0.0.1")


@pytest.fixture
def registry(monkeypatch: pytest.MonkeyPatch) -> Iterator[dict[str, bytes]]:
    """A registry on this machine, which npm is set to: what it has, by path."""
    answers: dict[str, bytes] = {}

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            body = answers.get(self.path)
            self.send_response(404 if body is None else 200)
            self.send_header("Content-Length", str(len(body or b"") + (100 if self.path.endswith("short") else 0)))
            self.end_headers()
            self.wfile.write(body or b"")

        def log_message(self, format: str, *args: object) -> None:
            pass

    server = HTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    monkeypatch.setenv("npm_config_registry", f"http://127.0.0.1:{server.server_port}/")
    yield answers
    server.shutdown()
    thread.join()
    server.server_close()


def test_an_archive_is_unpacked_whole_and_once(tmp_path: Path) -> None:
    archive, said = tmp_path / "pose.tgz", list[str]()
    integrity = write_archive(archive, {**WHOLE, "package/README.md": b"more", "package/a/pose.js": b"another"})
    with pytest.raises(UserError, match="mrhubo models"):
        find_models()
    folder = set_up(archive, tell=said.append, integrity=integrity)
    assert folder == models_folder() == find_models() and folder.is_relative_to(tmp_path / "cache")
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == {name: name.encode() for name in FILES}
    assert [path.name for path in folder.parent.iterdir()] == [folder.name] and not said
    (folder / FILES[0]).unlink()
    with pytest.raises(UserError, match="mrhubo models"):
        find_models()
    set_up(archive, integrity=integrity)
    assert (find_models() / FILES[0]).read_bytes() == FILES[0].encode()


def test_nothing_but_the_very_archive_is_unpacked(tmp_path: Path) -> None:
    archive = tmp_path / "pose.tgz"
    write_archive(archive, WHOLE)
    with pytest.raises(UserError, match=f"pose.tgz: is not the archive of .* expected {INTEGRITY[:20]}"):
        main(["--from", str(archive)])
    with pytest.raises(UserError, match="no such file"):
        set_up(tmp_path / "nothing.tgz")
    assert not (tmp_path / "cache").exists()


def test_the_command_has_two_names(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """`mrhubo live --setup` is `mrhubo models`, with its flags, and asks for no robot."""
    asked: list[tuple[Path | None, Path | None]] = []
    monkeypatch.setattr("mrhubo.video.set_up", lambda *given: asked.append(given) or Path("there"))
    for command, words in ((main, []), (live, ["--setup"])):
        command([*words, "--from", "pose.tgz", "--out", "models"])
        command(words)
    assert asked == [(Path("pose.tgz"), Path("models")), (None, None)] * 2
    assert capsys.readouterr().out == "models: there\n" * 4
    with pytest.raises(UserError, match="--robot"):
        live(["--robot", "nao", "--setup"])


@pytest.mark.parametrize(
    ("members", "links", "sentence"),
    [
        ({n: b"" for n in list(WHOLE)[1:]}, {}, f"has no {FILES[0]}"),
        ({n: b"" for n in list(WHOLE)[1:]}, {list(WHOLE)[0]: "/etc/passwd"}, f"has no {FILES[0]}"),
        ({**{n: b"" for n in list(WHOLE)[1:]}, f"package/../{FILES[0]}": b"", f"/{FILES[0]}": b""}, {}, "has no"),
        ({f"package/{n}": b"" for n in range(1_001)}, {}, "more than 1,000 members"),
    ],
)
def test_hostile_archives_write_nothing(
    tmp_path: Path, members: dict[str, bytes], links: dict[str, str], sentence: str
) -> None:
    archive = tmp_path / "pose.tgz"
    integrity = write_archive(archive, members, links)
    with pytest.raises(UserError, match=sentence):
        set_up(archive, tmp_path / "out", integrity=integrity)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["pose.tgz"]


def test_damaged_archives_write_nothing(tmp_path: Path) -> None:
    whole, cut = tmp_path / "whole.tgz", tmp_path / "cut.tgz"
    write_archive(whole, WHOLE)
    for data in (b"", b"no archive", whole.read_bytes()[:-60], whole.read_bytes()[:200]):
        cut.write_bytes(data)
        with pytest.raises(UserError, match="cut.tgz"):
            set_up(cut, tmp_path / "out", integrity=digest(data))
    assert not (tmp_path / "out").exists()


def test_other_files_stay(tmp_path: Path) -> None:
    archive = tmp_path / "pose.tgz"
    integrity = write_archive(archive, WHOLE)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/thesis.txt").write_text("years")
    with pytest.raises(UserError, match="holds other files .thesis.txt"):
        set_up(archive, tmp_path / "mine", integrity=integrity)
    assert [path.name for path in (tmp_path / "mine").iterdir()] == ["thesis.txt"]


def test_it_comes_from_the_registry_of_npm(
    tmp_path: Path, registry: dict[str, bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    said = list[str]()
    with pytest.raises(Unreachable, match="404 .*--from"):
        set_up(tell=said.append)
    assert "Apache-2.0" in said[0] and not models_folder().exists()
    archive = tmp_path / "pose.tgz"
    integrity = write_archive(archive, WHOLE)
    registry["/@mediapipe/pose/-/pose-0.5.1675469404.tgz"] = archive.read_bytes()
    with pytest.raises(UserError, match="its digest is sha512-"):
        set_up(tell=said.append)
    set_up(tell=said.append, integrity=integrity)
    registry.clear()
    assert set_up(tell=said.append) == find_models(), "what is there is not fetched again"


def test_downloads_are_bounded_and_whole(registry: dict[str, bytes]) -> None:
    base = registry_url("@mediapipe/pose")
    registry.update({"/large": bytes(1001), "/short": bytes(10)})
    assert download(f"{base}/large", 1001) == bytes(1001)
    with pytest.raises(UserError, match="larger than 1,000 bytes"):
        download(f"{base}/large", 1000)
    with pytest.raises(Unreachable, match="cannot be fetched|broke off"):
        download(f"{base}/short", 1000)
    with pytest.raises(Unreachable, match="cannot be fetched"):
        download("http://127.0.0.1:9/nothing", 10)


def test_npms_settings_name_the_registry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert registry_url("@mediapipe/pose") == "https://registry.npmjs.org"
    monkeypatch.setenv("MIRROR", "mirror.example")
    (tmp_path / "npmrc").write_text('; mine\nregistry = "https://${MIRROR}/npm/"\n//mirror/:_authToken=secret\n')
    assert registry_url("@mediapipe/pose") == "https://mirror.example/npm"
    monkeypatch.setenv("NPM_CONFIG_REGISTRY", "https://first.example")
    assert registry_url("@mediapipe/pose") == "https://first.example"
    (tmp_path / "npmrc").write_text("@mediapipe:registry=https://scope.example/x/")
    assert registry_url("@mediapipe/pose") == "https://scope.example/x"
    (tmp_path / "npmrc").write_text("@mediapipe:registry=file:///etc/passwd")
    with pytest.raises(UserError, match="@mediapipe:registry is 'file:///etc/passwd'"):
        registry_url("@mediapipe/pose")


def test_the_digest_has_the_form_of_npm() -> None:
    import base64

    kind, _, digest = models.INTEGRITY.partition("-")
    assert kind == "sha512" and len(base64.b64decode(digest, validate=True)) == 64
