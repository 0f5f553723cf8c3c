"""A package gives back what was trained, and is refused when it is not whole."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
import torch

from mrhubo import rotation
from mrhubo.body import BodyPrior, Skeleton, VPoser, build_skeleton, open_prior, save_skeleton
from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.config import load_config
from mrhubo.errors import UserError
from mrhubo.exporting.meaning import describe_networks
from mrhubo.fast import FastRetargeter
from mrhubo.files.storage import read_tensors, write_tensors
from mrhubo.motion import Motion
from mrhubo.reference import OptimizationRetargeter, direction_error
from mrhubo.retargeter import Retargeter, RetargetNetwork, architecture, build_network
from mrhubo.retargeter import parts as pose_parts
from mrhubo.retargeter.integrity import file_checksums
from mrhubo.robot import build_body_map
from tests.chain import new_package
from tests.poses import prior_poses


@pytest.fixture(scope="module")
def made(root: Path) -> Retargeter:
    config = load_config(root / "conf" / "reachy.yaml", ["model.hidden=24", "model.small_hidden=10"])
    body_map = build_body_map(config.robot)
    torch.manual_seed(0)
    return Retargeter(build_network(config, body_map), body_map, BodyPrior.open(), config, phi_threshold=0.01)


@pytest.fixture
def folder(made: Retargeter, tmp_path: Path) -> Path:
    return made.save(tmp_path / "package", {"run_id": "abc"})


def human(count: int) -> torch.Tensor:
    """Local rotations (count, 21, 3, 3) of plausible poses."""
    return prior_poses(count, 1)


def test_round_trip_also_after_a_move(made: Retargeter, folder: Path, tmp_path: Path) -> None:
    moved = tmp_path / "elsewhere"
    shutil.move(folder, moved)
    opened = Retargeter.load(moved)
    assert opened.joint_names == made.joint_names
    pose = human(20)
    torch.testing.assert_close(opened.predict(pose), made.predict(pose))
    torch.testing.assert_close(opened.retarget(pose).confidence, made.retarget(pose).confidence)


@pytest.mark.parametrize("change", ["longer", "gone"])
def test_a_urdf_that_changes_while_a_fit_trains_changes_no_package(root: Path, tmp_path: Path, change: str) -> None:
    urdf = Path(shutil.copy(root / "data/robots/nao/nao.urdf", tmp_path / "my.urdf"))
    config = load_config(root / "conf" / "nao.yaml", ["model.hidden=8", f"robot.urdf={urdf}"])
    body_map = build_body_map(config.robot)
    made = Retargeter(build_network(config, body_map), body_map, BodyPrior(hidden=8).eval(), config, phi_threshold=0.01)
    text = urdf.read_text()
    if change == "gone":
        urdf.unlink()
    else:
        urdf.write_text(text.replace('xyz="0.105', 'xyz="0.205'))
    folder = made.save(tmp_path / "package", {})
    assert (folder / "robot.urdf").read_text() == text
    pose = human(3)
    torch.testing.assert_close(Retargeter.load(folder)(pose).q, made(pose).q)


def test_a_package_knows_what_its_root_follows(root: Path, tmp_path: Path) -> None:
    """And its networks answer alike in all forms; files of layers alone cannot, and say so."""
    config = load_config(root / "conf" / "coman-whole-body.yaml", ["model.hidden=8", "robot.root_follows=chest"])
    body_map = build_body_map(config.robot)
    torch.manual_seed(0)
    made = Retargeter(build_network(config, body_map), body_map, BodyPrior(hidden=8).eval(), config, phi_threshold=0.01)
    made.save(tmp_path, {"run_id": "abc"})
    opened, pose = Retargeter.load(tmp_path), human(8)
    assert opened.body_map.keypoints.root_follows == "chest"
    fast, expected = FastRetargeter.load(tmp_path, "numpy"), made.retarget(pose)
    np.testing.assert_allclose(fast.predict(pose), made.predict(pose), atol=1e-5)
    np.testing.assert_allclose(fast.directions(pose), body_map.human_directions(pose), atol=1e-5)
    np.testing.assert_allclose(fast(pose).direction_error_deg, expected.direction_error_deg, atol=1e-2)
    with pytest.raises(UserError, match="robot.root_follows: legs are seen from a base"):
        describe_networks(opened)
    assert describe_networks(opened, "directions").root is not None


def test_arms_and_head_have_networks_of_their_own(made: Retargeter) -> None:
    """The human's right arm and head move nothing of the robot's left arm; each moves its own."""
    joints, pose = made.joint_names, human(30)
    turned = rotation.axis_angle_to_matrix(torch.randn(30, 21, 3))
    for parts, own in (
        ("r", ["right_collar", "right_shoulder", "right_elbow", "right_wrist"]),
        ("n", ["neck", "head"]),
    ):
        other = pose.clone()
        columns = [POSED_JOINT_NAMES.index(name) for name in own]
        other[:, columns] = turned[:, columns]
        moved = (made.predict(other) - made.predict(pose)).abs().amax(dim=0) > 1e-6
        assert moved.tolist() == [name[0] == parts for name in joints]


def test_branches_of_few_joints_have_narrow_networks(root: Path) -> None:
    def widths(*overrides: str) -> list[int]:
        config = load_config(root / "conf" / "reachy.yaml", overrides)
        network = build_network(config, build_body_map(config.robot))
        assert isinstance(network, RetargetNetwork)
        return [next(piece.weights()).shape[0] for piece in network.pieces()]

    assert widths() == [160, 160, 64]
    assert widths("model.hidden=32") == [32, 32, 32]
    assert widths("model.hidden=32", "model.small_hidden=8") == [32, 32, 8]
    assert widths("model.hidden=32", "model.small_hidden=8", "model.branches=false") == [32]


def test_packages_whose_branches_are_all_as_wide_are_read(root: Path, tmp_path: Path) -> None:
    """Those of before, whose settings know no other width."""
    folder = new_package(root / "conf" / "reachy.yaml", tmp_path / "p", "model.hidden=24", "model.small_hidden=24")
    expected = Retargeter.load(folder).predict(human(5))
    settings, weights = folder / "config.yaml", folder / "retargeter.safetensors"
    settings.write_text(re.sub(r" *small_hidden: 24\n", "", settings.read_text()))
    assert "small_hidden" not in settings.read_text()
    tensors, header = read_tensors(weights)
    others = ["robot.urdf", "config.yaml", "body_prior.safetensors", "skeleton.safetensors"]
    write_tensors(weights, tensors, {**header, **file_checksums(folder, others), "schema": "mrhubo.retargeter/5"})
    assert torch.equal(Retargeter.load(folder).predict(human(5)), expected)
    again = Retargeter.load(Retargeter.load(folder).save(tmp_path / "again", {}))
    assert torch.equal(again.predict(human(5)), expected)


def test_a_head_that_no_joint_turns_is_not_looked_at(root: Path) -> None:
    names = [
        f"{side}_{part}" for side in "lr" for part in ("shoulder_pitch", "shoulder_roll", "arm_yaw", "elbow_pitch")
    ]
    overrides = [f"robot.joints=[{', '.join(names)}]", "robot.ranges={}"]
    config = load_config(root / "conf" / "reachy.yaml", overrides)
    body_map = build_body_map(config.robot)
    network = build_network(config, body_map)
    assert {"head_forward", "head_up"}.isdisjoint(network.features.names) and "left_wrist" in network.features.names
    pose = human(30)
    found_TN = OptimizationRetargeter(body_map).solve_frames(pose)[0]
    assert found_TN.shape == network(rotation.matrix_to_sixd(pose)).shape == (30, 8)
    limbs = [i for i, name in enumerate(body_map.measured_names) if name.endswith(("elbow", "wrist"))]
    still = direction_error(body_map, ((body_map.robot.lower_N + body_map.robot.upper_N) / 2).expand(30, 8), pose)
    found = direction_error(body_map, found_TN, pose)
    assert float(found[:, limbs].mean()) < 0.3 * float(still[:, limbs].mean())


def test_a_branch_without_input_is_refused(root: Path) -> None:
    local = "model.input_frame=local"
    left = [local, "model.input_joints=[left_shoulder, left_elbow]"]
    config = load_config(root / "conf" / "nao.yaml", left)
    body_map = build_body_map(config.robot)
    with pytest.raises(UserError, match=r"RShoulderPitch.*right_shoulder.*model\.branches"):
        build_network(config, body_map)
    whole = load_config(root / "conf" / "nao.yaml", [*left, "model.branches=false"])
    assert build_network(whole, body_map).features.size == 12
    shared = load_config(root / "conf" / "nao.yaml", [local, "model.input_joints=[spine3, left_elbow]"])
    assert build_network(shared, body_map).features.size == 12  # what belongs to no branch is seen by all
    useless = load_config(root / "conf" / "nao.yaml", left[1:])
    with pytest.raises(UserError, match=r"model.input_joints: is of no use with model.input_frame=directions"):
        build_network(useless, body_map)


def test_a_package_keeps_vposer_and_another_skeleton(root: Path, tmp_path: Path) -> None:
    """As made with the official files, which the package must not need again."""
    torch.manual_seed(0)
    prior, longer = VPoser().requires_grad_(False).eval(), Skeleton(1.1 * Skeleton().offsets_J3)
    prior.save(tmp_path / "vposer.safetensors")
    save_skeleton(tmp_path / "longer.safetensors", longer)
    overrides = [f"body.prior_path={tmp_path}/vposer.safetensors", f"body.model_path={tmp_path}/longer.safetensors"]
    config = load_config(root / "conf" / "nao.yaml", ["model.hidden=24", "body.prior=vposer", *overrides])
    body_map = build_body_map(config.robot, build_skeleton(config.body))
    made = Retargeter(build_network(config, body_map), body_map, open_prior(config.body), config, phi_threshold=0.01)
    folder = made.save(tmp_path / "package", {})
    for name in ("vposer", "longer"):
        (tmp_path / f"{name}.safetensors").unlink()
    opened = Retargeter.load(folder)
    assert opened.prior.checksum == prior.checksum and opened.body_map.skeleton.checksum == longer.checksum
    torch.testing.assert_close(opened.retarget(human(5)).confidence, made.retarget(human(5)).confidence)


def test_the_header_tells_joints_limits_and_conventions(made: Retargeter, folder: Path) -> None:
    _, header = read_tensors(folder / "retargeter.safetensors")
    assert header["robot"] == "reachy" and "l_elbow_pitch" in header["joint_names"] and header["run_id"] == "abc"
    assert "rad" in header["output"] and "6D" in header["input"] and header["lower_rad"].count(",") == 16


def test_no_path_of_this_machine_is_in_a_package(folder: Path, root: Path) -> None:
    for file in folder.iterdir():
        assert str(root).encode() not in file.read_bytes(), file.name


def test_confidence_falls_for_implausible_poses(made: Retargeter) -> None:
    noise = rotation.axis_angle_to_matrix(2 * torch.randn(50, 21, 3))
    good, bad = made.retarget(human(50)), made.retarget(noise)
    assert float(bad.phi.min()) > float(good.phi.max())
    for result in (good, bad):
        assert bool(((result.confidence >= 0) & (result.confidence <= 1)).all())
        torch.testing.assert_close(result.confidence, result.branch_confidence.amin(dim=1))
    assert float(bad.confidence.quantile(0.9)) < 0.5 < float(good.confidence.quantile(0.5))


def test_polish_brings_every_frame_nearer_and_stays_inside_the_limits(made: Retargeter) -> None:
    pose, robot = human(60), made.body_map.robot
    errors = []
    for steps in (0, 1, 3):
        result = made.retarget(pose, polish=steps)
        assert torch.equal(result.q, made.predict(pose, steps))
        assert bool(((result.q >= robot.lower_N) & (result.q <= robot.upper_N)).all())
        assert torch.equal(result.collision, made.collision.collides(result.q))
        errors.append(made.directions.quadratic(result.q, made.body_map.human_directions(pose)).cost_BC)
    torch.testing.assert_close(made.predict(pose), made.network(rotation.matrix_to_sixd(pose)), atol=1e-4, rtol=0)
    assert bool((errors[1] <= errors[0]).all()) and bool((errors[2] <= errors[0]).all())
    assert float(errors[2].sum(1).mean()) < float(errors[1].sum(1).mean()) < 0.5 * float(errors[0].sum(1).mean())
    assert made.predict(pose[:0], 1).shape == (0, 17)
    with pytest.raises(UserError, match="polish"):
        made.predict(pose, -1)


def test_a_call_takes_a_motion_and_arrays_of_any_form(made: Retargeter) -> None:
    pose = human(3)
    expected = made.retarget(pose, frame_rate=30.0)
    result = made(Motion("a", pose, 30.0))
    torch.testing.assert_close(result.q, expected.q)
    torch.testing.assert_close(result.confidence, expected.confidence)
    assert result.frame_rate == 30.0 and result.joint_names == made.joint_names
    turns = rotation.matrix_to_axis_angle(pose).flatten(1)
    for array in (rotation.matrix_to_sixd(pose), pose, turns, turns.double().numpy()):
        found = made(array, frame_rate=30.0)
        torch.testing.assert_close(found.q, expected.q, atol=1e-3, rtol=0)
        assert found.frame_rate == 30.0
    assert torch.equal(made(pose, polish=0).q, made.predict(pose))
    with pytest.raises(UserError, match="human pose 2 holds a matrix that is no rotation"):
        made(pose * torch.tensor([1.0, 1.0, 1.2])[:, None, None, None])


@pytest.mark.parametrize("leading", [(), (1,), (6,), (2, 3), (0,), (3, 0)])
def test_the_answer_has_the_leading_axes_of_the_question(made: Retargeter, leading: tuple[int, ...]) -> None:
    pose = human(6)[: int(np.prod(leading))]
    result, expected = made(pose.reshape(*leading, 21, 3, 3).numpy()), made.retarget(pose)
    directions = len(made.body_map.measured_names)
    for name, more in {
        "q": (17,), "confidence": (), "phi": (), "collision": (), "direction_error_deg": (directions,),
        "branch_confidence": (3,),
    }.items():  # fmt: skip
        found = getattr(result, name)
        assert found.shape == (*leading, *more), name
        torch.testing.assert_close(found.flatten(), getattr(expected, name).flatten())


@pytest.mark.parametrize("name", ["a.npz", "a.csv"])
def test_an_answer_is_saved_with_names_and_time(made: Retargeter, tmp_path: Path, name: str) -> None:
    result = made(Motion("a", human(6), 30.0))
    result.save(tmp_path / name)
    if name.endswith("npz"):
        with np.load(tmp_path / name, allow_pickle=False) as file:
            assert tuple(file["joint_names"]) == made.joint_names and float(file["frame_rate"]) == 30.0
            for key in ("q", "confidence", "phi", "collision", "direction_error_deg"):
                np.testing.assert_array_equal(file[key], getattr(result, key))
            np.testing.assert_array_equal(file["branch_confidence"], result.branch_confidence)
            assert tuple(file["branch_names"]) == result.branch_names
    else:
        header, *rows = (tmp_path / name).read_text().splitlines()
        branches = (f"confidence_{branch}" for branch in result.branch_names)
        errors = (f"error_{direction} [deg]" for direction in result.direction_names)
        names = ["confidence", "phi", "collision", *branches, *errors]
        assert header == ",".join(["time [s]", *(f"{joint} [rad]" for joint in made.joint_names), *names])
        assert len(rows) == 6
        np.testing.assert_array_equal(np.array(rows[5].split(",")[1:18], np.float32), result.q[5])


def test_it_moves_whole(folder: Path) -> None:
    """Without a second device: to `meta`, where nothing may be left behind."""
    retargeter = Retargeter.load(folder)
    expected = retargeter.retarget(human(3)).q  # reads the collision shapes too
    assert retargeter.to("cpu") is retargeter and torch.equal(retargeter.retarget(human(3)).q, expected)
    retargeter.to("meta")
    names = {name for name, tensor in [*retargeter.named_parameters(), *retargeter.named_buffers()]}
    assert {"body_map", "directions", "network", "prior"} <= {name.partition(".")[0] for name in names}
    for module in retargeter.modules():
        tensors = [*module.parameters(), *module.buffers(), *(v for v in vars(module).values() if torch.is_tensor(v))]
        assert {tensor.device.type for tensor in tensors} <= {"meta"}, type(module).__name__
    assert retargeter.device.type == "meta"
    if torch.cuda.is_available():
        moved = Retargeter.load(folder).to("cuda")
        torch.testing.assert_close(moved.retarget(human(3)).q.cpu(), expected, atol=1e-4, rtol=0)


@pytest.mark.parametrize("shape", [(5, 20, 3, 3), (21, 3, 3), (5, 21, 3), (5, 21, 6)])
def test_a_wrong_shape_is_refused(made: Retargeter, shape: tuple[int, ...]) -> None:
    with pytest.raises(UserError, match="shape"):
        made.predict(torch.zeros(shape))


def test_nan_names_the_frame(made: Retargeter) -> None:
    pose = human(9)
    pose[4, 3, 2] = torch.nan
    with pytest.raises(UserError, match="human pose 4 holds NaN"):
        made.retarget(pose)


def test_incomplete_or_foreign_packages_are_refused(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="is no package"):
        Retargeter.load(tmp_path)
    weights = folder / "retargeter.safetensors"
    tensors, metadata = read_tensors(weights)
    write_tensors(weights, tensors, {**metadata, "schema": "x/1"})
    with pytest.raises(UserError, match="schema is 'x/1'"):
        Retargeter.load(folder)
    write_tensors(weights, {k: v for k, v in tensors.items() if not k.endswith("first.weight")}, metadata)
    with pytest.raises(UserError, match="do not fit"):
        Retargeter.load(folder)
    weights.write_bytes(b"junk")
    with pytest.raises(UserError, match="cannot be read"):
        Retargeter.load(folder)
    write_tensors(weights, tensors, metadata)
    for name in ("robot.urdf", "config.yaml", "body_prior.safetensors", "skeleton.safetensors"):
        (folder / name).rename(folder / "away")
        with pytest.raises(UserError):
            Retargeter.load(folder)
        (folder / "away").rename(folder / name)
    Retargeter.load(folder)


def test_arrays_and_lists_are_poses_everywhere(made: Retargeter) -> None:
    pose, reference = human(3), OptimizationRetargeter(made.body_map)
    predicted, retargeted = made.predict(pose), made.retarget(pose).q
    torch.testing.assert_close(made(pose).q, retargeted, atol=1e-5, rtol=0)
    for given in (pose.numpy(), pose.double(), pose.tolist(), pose.numpy().astype(">f8"), Motion("a", pose, 24.0)):
        torch.testing.assert_close(made.predict(given), predicted)
        torch.testing.assert_close(made.retarget(given, together=False).q, retargeted, atol=1e-5, rtol=0)
        torch.testing.assert_close(made(given, together=False).q, retargeted, atol=1e-5, rtol=0)
    array = pose.numpy()
    assert torch.equal(reference.retarget(array, 24).q_TN, reference.retarget(pose, 24.0).q_TN)
    assert torch.equal(reference.solve_frames(array.tolist())[0], reference.solve_frames(pose)[0])
    assert torch.equal(reference(array, 24.0).q, reference(pose, 24.0).q)
    assert torch.equal(
        reference.retarget_collision_free(array, 24.0).q_TN, reference.retarget_collision_free(pose, 24.0).q_TN
    )
    for entry in (
        made.predict,
        made.retarget,
        made,
        reference.solve_frames,
        lambda pose: reference.retarget(pose, 24.0),
    ):
        for wrong in ("wave.npz", None, [[1.0], [1.0, 2.0]], np.array([["a"] * 63]), 7):
            with pytest.raises(UserError, match="expected a Motion, or a NumPy or torch array of numbers, found"):
                entry(wrong)  # type: ignore[operator, arg-type]
    with pytest.raises(UserError, match="frame rate must be a positive number, found None"):
        reference.retarget(pose, None)  # type: ignore[arg-type]
    for polish in (-1, 1.5, "1", None, True):
        with pytest.raises(UserError, match="polish must be 0 or more steps"):
            made.predict(pose, polish)  # type: ignore[arg-type]


@pytest.mark.parametrize("value", [1e200, 1e39, 1e20, -3.0])
def test_numbers_that_no_rotation_has_give_no_confidence(made: Retargeter, value: float) -> None:
    pose = human(9).double()
    pose[4, 3, 2, 1] = value
    for entry in (made.predict, made.retarget, made):
        with pytest.raises(
            UserError, match="human pose 4 holds (numbers that no rotation has|a matrix that is no rotation)"
        ):
            entry(pose)
    result = made.retarget(torch.zeros(3, 21, 3, 3))
    assert bool(((result.confidence >= 0) & (result.confidence <= 1)).all())


def test_a_long_motion_is_worked_on_in_parts(made: Retargeter, monkeypatch: pytest.MonkeyPatch) -> None:
    """Frame by frame with the same numbers; one smooth motion to what its solver ends at, a milliradian."""
    pose = human(13)
    given, inner, longest = Motion("a", pose, 30.0), made.network.joints, []
    whole = {together: made(given, together=together) for together in (False, True)}
    monkeypatch.setattr(made.network, "joints", lambda x: longest.append(len(x)) or inner(x))
    monkeypatch.setattr(pose_parts, "_CHUNK", 6)
    for together, near in ((False, 1e-4), (True, 1e-3)):
        longest.clear()
        found = made(given, together=together)
        assert longest == [6, 6, 1] and found.frame_rate == 30.0
        angles = torch.deg2rad(found.direction_error_deg), torch.deg2rad(whole[together].direction_error_deg)
        torch.testing.assert_close(*angles, atol=near, rtol=0)
        for name in ("q", "confidence", "phi", "collision"):
            torch.testing.assert_close(getattr(found, name), getattr(whole[together], name), atol=near, rtol=near)
    pose[8, 3] = torch.nan
    with pytest.raises(UserError, match="human pose 8 holds NaN"):
        made.predict(pose)


def test_networks_fit_into_memory(root: Path) -> None:
    """Nothing of that size is made before it is refused."""
    for overrides, count in (
        (["model.hidden=8192", "model.layers=64"], "model.hidden: 8,192 units in each of 64 layers make 16,9"),
        (["model.hidden=8192", "model.branches=false", "model.stages=1", "model.layers=3"], "make 134,"),
    ):
        config = load_config(root / "conf" / "nao.yaml", overrides)
        with pytest.raises(UserError, match=count):
            build_network(config, build_body_map(config.robot))
    with pytest.raises(UserError, match="model.hidden must be a whole number from 1 to 8192, found 65536"):
        load_config(root / "conf" / "nao.yaml", ["model.hidden=65536"])


@pytest.mark.parametrize("branches", ["true", "false"])
@pytest.mark.parametrize("stages", [1, 2])
def test_weights_are_counted_right(root: Path, stages: int, branches: str, monkeypatch: pytest.MonkeyPatch) -> None:
    sizes = ["model.hidden=7", "model.small_hidden=5", "model.layers=3"]
    overrides = [f"model.stages={stages}", f"model.branches={branches}", *sizes]
    config = load_config(root / "conf" / "reachy.yaml", overrides)
    body_map = build_body_map(config.robot)
    count = sum(weights.numel() for weights in build_network(config, body_map).parameters())
    monkeypatch.setattr(architecture, "_MAX_WEIGHTS", count)
    build_network(config, body_map)
    monkeypatch.setattr(architecture, "_MAX_WEIGHTS", count - 1)
    with pytest.raises(UserError, match=f"make {count:,} weights"):
        build_network(config, body_map)


def test_the_precision_of_the_program_around_it_changes_no_answer(made: Retargeter) -> None:
    pose = human(2)
    expected = made.retarget(pose)
    with torch.autocast("cpu", torch.bfloat16):
        torch.testing.assert_close(made.retarget(pose).q, expected.q, rtol=0, atol=0)
    for convert in (made.double, made.half, lambda: made.to(torch.bfloat16)):
        with pytest.raises(UserError, match="work in float32 alone"):
            convert()
    torch.set_default_dtype(torch.float64)
    try:
        with pytest.raises(UserError, match="PyTorch's default is torch.float64: call torch.set_default_dtype"):
            made.retarget(pose)
    finally:
        torch.set_default_dtype(torch.float32)
    torch.testing.assert_close(made.retarget(pose).q, expected.q, rtol=0, atol=0)


@pytest.mark.parametrize("device", ["nowhere", "cuda:99"])
def test_a_device_that_is_not_there_is_named_in_a_sentence(made: Retargeter, device: str) -> None:
    with pytest.raises(UserError, match="the retargeter cannot go there: "):
        made.to(device)
    assert made.to("cpu") is made and made.device.type == "cpu"
