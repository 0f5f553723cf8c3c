"""What a command line names: it is refused in one sentence, before anything slow is done."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

import mrhubo
from mrhubo.config.live import LiveConfig
from mrhubo.errors import UserError
from mrhubo.fast import FastRetargeter
from mrhubo.live.__main__ import main
from mrhubo.live.endpoints import Endpoint
from mrhubo.live.plan import Plan
from mrhubo.live.robot import LiveRobot
from mrhubo.live.sinks.udp import UdpSink
from tests.live.robots import make_robot


def test_a_file_without_a_rate_is_replayed_at_the_one_that_is_told(tmp_path: Path) -> None:
    path = tmp_path / "poses@2.npz"
    np.savez(path, poses=np.zeros((50, 66)), trans=np.zeros((50, 3)))
    for kind in ("replay", "replay-loop"):
        with pytest.raises(
            UserError, match=f"holds no frame rate; say what it is, by --source {kind}:.*poses@2.npz@30$"
        ):
            Plan().add_source(f"{kind}:{path}")
    plan = Plan()
    plan.add_source(f"replay:{path}@60")
    assert plan.sources[0]._rate == 60  # pyright: ignore
    told = path.rename(tmp_path / "a@60")
    with pytest.raises(UserError, match="--source replay:.*a@60@30$"):
        plan.add_source(f"replay:{told}")
    for wrong in ("0", "nan", "1e9"):
        with pytest.raises(UserError, match="expected 1 to 1000"):
            plan.add_source(f"replay:{told}@{wrong}")
    np.savez(tmp_path / "b.npz", poses=np.zeros((50, 66)), trans=np.zeros((50, 3)), mocap_frame_rate=60.0)
    plan.add_source(f"replay:{tmp_path / 'b.npz'}@50")
    assert plan.sources[1]._rate == 60 and any("50" in said and "60" in said for said in plan.told())  # pyright: ignore


WRONG: list[tuple[Callable[[Plan], object], str]] = [
    (lambda plan: plan.add_source("udb:1"), "nearest: 'udp'"),
    (lambda plan: plan.add_source("replay"), "names no file"),
    (lambda plan: plan.add_source("replay:@30"), "names no file"),
    (lambda plan: plan.add_source("replay:dance@me.bvh"), "dance@me.bvh: there is no such file"),
    (lambda plan: plan.add_source("replay:/no/such/file.bvh"), "no such file"),
    (lambda plan: plan.add_source("udp:x"), "HOST:PORT"),
    (lambda plan: plan.add_sink("udp"), "HOST:PORT"),
    (lambda plan: plan.add_sink("file:"), "names no file"),
    (lambda plan: plan.add_sink("tape:1"), "does not exist"),
]


@pytest.mark.parametrize(("add", "sentence"), WRONG)
def test_what_a_command_line_may_get_wrong(add: Callable[[Plan], object], sentence: str) -> None:
    with pytest.raises(UserError, match=sentence):
        add(Plan())


@pytest.mark.parametrize("sink", ["file:walk.npz", "mcap:walk.npz", "file:./walk.npz", "file:my.yaml"])
def test_what_is_replayed_or_read_is_not_written_over(
    sink: str, tmp_path: Path, root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("walk.npz").write_bytes((root / "data/motions/wave.npz").read_bytes())
    Path("my.yaml").touch()
    plan = Plan()
    plan.add_source("replay-loop:walk.npz")
    plan.add_sink("file:other.npz")
    plan.refuse_inputs([None, "nao", "my.yaml"])
    plan.add_sink(sink)
    with pytest.raises(UserError, match="--sink .*: would be written over what is read"):
        plan.refuse_inputs([None, "nao", "my.yaml"])


def test_addresses_that_cannot_be_had_are_refused_before_anything_is_compiled() -> None:
    with Endpoint("127.0.0.1", 0).bound() as used:
        port = used.getsockname()[1]
        plan = Plan()
        for part in ("ws:0", f"udp:{port}"):
            plan.add_source(part)
        with pytest.raises(UserError, match=f"127.0.0.1:{port}: cannot listen there"):
            plan.check()
    plan.check()
    plan.check()  # nothing is kept
    plan.add_source(f"udp:{port}")
    with pytest.raises(UserError, match="cannot listen there"):
        plan.check()


def test_source_and_sink_on_one_port_share_a_server() -> None:
    plan = Plan()
    plan.add_source("ws:8111")
    plan.add_sink("ws:8111")
    plan.add_sink("ws:8112")
    assert plan.sources[0].server is plan.sinks[0].server is not plan.sinks[1].server  # pyright: ignore
    assert [said.split(" ")[0] for said in plan.told()] == ["page:", "page:"]


def test_one_port_is_not_two_hosts() -> None:
    plan = Plan()
    plan.add_source("ws:8111")
    with pytest.raises(UserError, match="ws:localhost:8111: port 8111 is already that of 127.0.0.1"):
        plan.add_sink("ws:localhost:8111")


@pytest.mark.parametrize(
    ("source", "sink"),
    [
        ("udp:{}", "udp:127.0.0.1:{}"),
        ("udp:{}", "udp:localhost:{}"),
        ("udp:{}", "udp:0.0.0.0:{}"),
        ("udp:0.0.0.0:{}", "udp:127.0.0.1:{}"),
        ("udp:0.0.0.0:{}", "udp:127.0.0.9:{}"),
        ("xsens:{}", "udp:127.0.0.1:{}"),
        ("vmc:{}", "udp:[::ffff:127.0.0.1]:{}"),
    ],
)
def test_a_session_does_not_hear_itself(source: str, sink: str) -> None:
    with Endpoint("127.0.0.1", 0).bound() as free:
        port = free.getsockname()[1]
    plan = Plan()
    plan.add_source(source.format(port))
    plan.add_sink("udp:127.0.0.1:1")
    plan.check()
    plan.add_sink(sink.format(port))
    with pytest.raises(UserError, match="own --source listens there"):
        plan.check()


def test_another_machine_may_have_the_same_port() -> None:
    here = Endpoint("0.0.0.0", 9000)
    assert not Endpoint("192.0.2.7", 9000).reaches(here) and not Endpoint("127.0.0.1", 9001).reaches(here)
    assert not Endpoint("127.0.0.2", 9000).reaches(Endpoint("127.0.0.1", 9000))


def test_nothing_is_sent_to_a_whole_network(monkeypatch: pytest.MonkeyPatch) -> None:
    assert "broadcast address" in refused_at_once(monkeypatch, "udp:255.255.255.255:9000")
    assert "nobody listens at port 0" in refused_at_once(monkeypatch, "udp:127.0.0.1:0")
    with pytest.raises(UserError, match="broadcast address"):
        UdpSink(Endpoint("255.255.255.255", 9000)).open(make_robot(), LiveConfig())


def test_settings_that_leave_no_time_to_brake_are_told_first(monkeypatch: pytest.MonkeyPatch) -> None:
    said = refused_at_once(monkeypatch, "udp:127.0.0.1:1", settings=("stop_time=0.1", "heartbeat_timeout=0.19"))
    assert said.startswith("stop_time: 0.1 s leaves no time to brake")


def no_robot(*_: object) -> LiveRobot:
    pytest.fail("something slow was done")


def refused_at_once(monkeypatch: pytest.MonkeyPatch, *sinks: str, settings: Sequence[str] = ()) -> str:
    """What the command says of some sinks."""
    monkeypatch.setattr(LiveRobot, "of_robot", no_robot)
    monkeypatch.setattr(LiveRobot, "of_package", no_robot)
    words = [word for sink in sinks for word in ("--sink", sink)]
    with pytest.raises(UserError) as error:
        main(["--robot", "nao", "--source", "udp:0", *words, *settings])
    return str(error.value)


@pytest.mark.parametrize("name", ["a.npz", "a.mcap"])
def test_files_that_cannot_be_written_are_refused_before_anything_is_compiled(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kind = "mcap" if name == "a.mcap" else "file"
    (tmp_path / "file").touch()
    for folder in (tmp_path / "file", Path("/proc/none")):
        said = refused_at_once(monkeypatch, f"{kind}:{folder / name}")
        assert said.startswith(f"{folder / name}: cannot be written: ")
    (tmp_path / "folder" / name).mkdir(parents=True)
    os.mkfifo(tmp_path / name)
    for path in (tmp_path / "folder" / name, tmp_path / name):
        assert refused_at_once(monkeypatch, f"{kind}:{path}") == f"{path}: is a folder, a pipe or a device; name a file"
    path = tmp_path / "new" / "er" / name
    assert "another sink writes it" in refused_at_once(monkeypatch, f"{kind}:{path}", f"{kind}:{path}")
    assert not (tmp_path / "new").exists(), "nothing is left behind"


def test_a_bag_and_a_file_of_one_name_are_two_sinks_of_one_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(b"yesterday's")
    assert "another sink writes it" in refused_at_once(monkeypatch, f"file:{path}", f"mcap:{path}")
    assert path.read_bytes() == b"yesterday's" and [one.name for one in tmp_path.iterdir()] == ["a.mcap"]


def test_models_of_a_simulation_are_looked_at_before_anything_is_compiled(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("mujoco")
    assert "there is no such file" in refused_at_once(monkeypatch, f"mujoco:{tmp_path / 'none.xml'}")
    (tmp_path / "broken.xml").write_text("<mujoco><worldbody><body>")
    for sink, sentence in (
        ("mujoco", "a package does not tell where"),
        (f"mujoco:{tmp_path / 'broken.xml'}", "cannot load it"),
        (f"mujoco:{root / 'data/robots/nao/nao.urdf'}", "has no joint left_a"),
    ):
        plan = Plan()
        plan.add_sink("udp:127.0.0.1:1")
        plan.add_sink(sink)
        with pytest.raises(UserError, match=sentence):
            plan.check_robot(["left_a"], None)


def test_a_robot_is_known_before_it_is_compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Enough(Exception):
        """Ends what would compile."""

    def known(fast: FastRetargeter, urdf: Path | None) -> None:
        raise Enough(*fast.joint_names, urdf)

    monkeypatch.setattr(LiveRobot, "of_retargeter", no_robot)
    with pytest.raises(Enough) as of_robot:
        LiveRobot.of_robot("nao", LiveConfig(), known=known)
    assert "LShoulderPitch" in of_robot.value.args and of_robot.value.args[-1].name == "nao.urdf"
    fast = FastRetargeter(mrhubo.for_robot("nao").describe(), "numpy")
    monkeypatch.setattr(mrhubo, "load_fast", lambda *_: fast)
    monkeypatch.setattr(mrhubo, "package_folder", lambda *_: tmp_path)
    with pytest.raises(Enough) as of_package:
        LiveRobot.of_package("any", LiveConfig(), known=known)
    assert of_package.value.args == (*fast.joint_names, None)
