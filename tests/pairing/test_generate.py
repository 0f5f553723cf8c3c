"""Shards: what they hold, and that other settings never mix."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch

from mrhubo import rotation
from mrhubo.body import BodyPrior, Skeleton
from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.config import Config, load_config
from mrhubo.errors import UserError
from mrhubo.files.arrays import DamagedFile
from mrhubo.pairing import PairGenerator, PairStore, amortiser, generate_pairs
from mrhubo.pairing.settings import pairing_settings
from mrhubo.reference import OptimizationRetargeter
from mrhubo.robot import build_body_map
from mrhubo.robot.plausibility import read_phi

pytestmark = pytest.mark.usefixtures("light_pairs")

SMALL = [
    "pairs.count=250",
    "pairs.reverse_share=0.4",
    "pairs.shard_size=100",
    "pairs.solver=fine",
    "pairs.amortiser_steps=40",
    "pairs.fine_steps=3",
]


def config_of(root: Path, folder: Path, *overrides: str) -> Config:
    return load_config(root / "conf" / "nao.yaml", [*SMALL, f"pairs.dir={folder}", *overrides])


def store_of(config: Config) -> PairStore:
    return PairStore.of(config, build_body_map(config.robot), BodyPrior.open())


def generate(config: Config) -> PairStore:
    store = store_of(config)
    generate_pairs(config, PairGenerator(build_body_map(config.robot), BodyPrior.open(), config), store)
    return store


def contents(store: PairStore) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(store.folder.iterdir())}


@pytest.fixture(scope="module")
def made(root: Path, tmp_path_factory: pytest.TempPathFactory) -> PairStore:
    return generate(config_of(root, tmp_path_factory.mktemp("pairs")))


@pytest.fixture(scope="module")
def unaligned(root: Path, tmp_path_factory: pytest.TempPathFactory) -> PairStore:
    return generate(config_of(root, tmp_path_factory.mktemp("unaligned"), "pairs.align=false"))


def test_aligned_humans_point_where_the_robot_does(
    root: Path, made: PairStore, unaligned: PairStore, tmp_path: Path
) -> None:
    before = unaligned.read_all()
    after, body_map = made.read_all(), build_body_map(config_of(root, tmp_path).robot)
    forward = ~after["reverse"]
    measured = body_map.measured
    directions = body_map.robot_directions(body_map.robot.forward(after["q"][forward]))[:, measured]
    aligned, unaligned = (
        body_map.human_directions(rotation.stack_columns(pairs["H"][forward]))[:, measured] for pairs in (after, before)
    )
    torch.testing.assert_close(aligned, directions, atol=1e-4, rtol=0)
    assert float((unaligned - directions).abs().max()) > 0.1
    for name in ("q", "R", "cost", "residual_m", "z_norm"):
        torch.testing.assert_close(after[name], before[name])
    assert torch.equal(after["H"][~forward], before["H"][~forward])


def test_a_search_tells_networks_that_read_directions_nothing_more(root: Path, made: PairStore, tmp_path: Path) -> None:
    config = config_of(root, tmp_path, "pairs.solver=auto")
    store = generate(config)
    assert not store.amortiser_path.exists(), "nothing is searched for"
    searched, direct, body_map = made.read_all(), store.read_all(), build_body_map(config.robot)
    for name in ("q", "R", "phi"):
        torch.testing.assert_close(direct[name], searched[name], atol=1e-5, rtol=1e-4)
    seen, expected = (body_map.human_directions(rotation.stack_columns(pairs["H"])) for pairs in (direct, searched))
    torch.testing.assert_close(seen, expected, atol=1e-4, rtol=0)
    forward = ~direct["reverse"]
    assert float(direct["residual_m"][forward].max()) < 1e-5 < 1e-3 < float(searched["residual_m"][forward].mean())
    legs = [i for i, name in enumerate(POSED_JOINT_NAMES) if name.endswith(("hip", "knee"))]
    at_rest = rotation.matrix_to_sixd(torch.eye(3))
    assert bool((direct["H"][forward][:, legs] == at_rest).all()) and torch.equal(
        direct["H"][~forward], searched["H"][~forward]
    )


@pytest.mark.parametrize(
    "change", ["pairs.align=false", "pairs.phi=all", "model.input_frame=local", "robot.scale=manual"]
)
def test_where_more_of_a_pose_is_used_it_is_searched_for(root: Path, change: str) -> None:
    path = root / "conf" / "paper" / "nao.yaml"  # which has the numbers of a manual scale factor
    shipped = ["pairs.align=true", "pairs.phi=read", "model.input_frame=directions", "robot.scale=auto"]
    assert pairing_settings(load_config(path, [*shipped, "pairs.solver=auto"])).solver == "direct"
    assert pairing_settings(load_config(path, [*shipped, "pairs.solver=auto", change])).solver == "fine"
    assert pairing_settings(load_config(path, [*shipped, "pairs.solver=fast"])).solver == "fast"
    with pytest.raises(UserError, match=rf"pairs\.solver: 'direct' .* {change} uses more"):
        pairing_settings(load_config(path, [*shipped, "pairs.solver=direct", change]))


def test_pairs_are_what_they_say(root: Path, unaligned: PairStore) -> None:
    pairs = unaligned.read_all()
    config = config_of(root, unaligned.folder.parent)
    body_map, prior = build_body_map(config.robot), BodyPrior.open()
    robot = body_map.robot
    assert len(pairs["q"]) == 250
    assert bool(((pairs["q"] >= robot.lower_N) & (pairs["q"] <= robot.upper_N)).all())
    torch.testing.assert_close(robot.moving_orientations(robot.forward(pairs["q"])), pairs["R"], atol=1e-5, rtol=0)
    matrices = rotation.sixd_to_matrix(pairs["H"])
    torch.testing.assert_close(rotation.matrix_to_sixd(matrices), pairs["H"], atol=1e-5, rtol=0)
    read = read_phi(body_map, prior, body_map.human_directions(matrices))
    torch.testing.assert_close(read, pairs["phi"], atol=1e-5, rtol=1e-3)
    target = body_map.targets(robot.forward(pairs["q"]))
    reached = body_map.skeleton.keypoints(matrices)[:, body_map.keypoint_indices]
    reached[150:] = body_map.human_keypoints(body_map.human_directions(matrices[150:]))
    torch.testing.assert_close((reached - target).norm(dim=-1).mean(1), pairs["residual_m"], atol=1e-5, rtol=1e-3)
    assert pairs["reverse"].tolist() == 150 * [False] + 100 * [True]
    directions = body_map.human_directions(matrices) * body_map.robot_directions(robot.forward(pairs["q"]))
    for reverse, least in ((False, 0.8), (True, 0.6)):  # many a drawn pose is out of the robot's reach
        same = directions[:, body_map.measured].sum(-1)[pairs["reverse"] == reverse].mean()
        assert float(same) > least, "human and robot limbs point the same way"


def test_phi_of_the_whole_pose_is_the_papers(root: Path, tmp_path: Path) -> None:
    config, prior = config_of(root, tmp_path, "pairs.phi=all"), BodyPrior.open()
    generator = PairGenerator(build_body_map(config.robot), prior, config)
    pose_BJ6 = prior.decode(torch.randn(20, prior.latent))
    found = generator._measure(*generator._decoded(prior.encode(pose_BJ6)), *_targets(generator, 20), "reverse")
    torch.testing.assert_close(found["phi"], prior.reconstruction_error(found["H"]), atol=1e-6, rtol=1e-3)


def _targets(generator: PairGenerator, count: int) -> tuple[torch.Tensor, torch.Tensor]:
    """Keypoints and directions of random robot poses."""
    poses = generator.robot.forward(generator.robot.sample(count, torch.Generator().manual_seed(0)))
    return generator.body_map.upright_keypoints(poses), generator.body_map.robot_directions(poses)


def test_reverse_pairs_are_the_references_answer_to_the_priors_poses(root: Path, made: PairStore) -> None:
    pairs = {name: tensor[made.read_all()["reverse"]] for name, tensor in made.read_all().items()}
    reference = OptimizationRetargeter(build_body_map(config_of(root, made.folder.parent).robot))
    local_BJ33 = rotation.stack_columns(pairs["H"])
    target = reference.body_map.human_directions(local_BJ33)
    cost_B = reference.problem.quadratic(pairs["q"], target).cost_BC.sum(1)
    assert float((cost_B - reference.problem.minimise(pairs["q"], target)[1].sum(1)).max()) < 1e-3, "converged"
    assert float(cost_B.mean()) < 1.02 * float(reference.solve_frames(local_BJ33)[1].mean()), (
        "no better with more starts"
    )
    drawn = 80  # of each shard's 100 the last fifth is drawn joint by joint, legs and back at rest
    assert abs(float(pairs["z_norm"][:drawn].mean()) / BodyPrior.open().latent ** 0.5 - 1.1) < 0.1
    legs = [i for i, name in enumerate(POSED_JOINT_NAMES) if name.endswith(("hip", "knee"))]
    at_rest = (local_BJ33[:, legs] - torch.eye(3)).abs().amax(dim=(1, 2, 3)) < 1e-6
    assert at_rest.tolist() == [i >= drawn for i in range(len(at_rest))]


def test_another_share_of_reverse_pairs_keeps_what_is_there(root: Path, made: PairStore, tmp_path: Path) -> None:
    found = {}
    for share in (0.0, 1.0, 0.4):
        store = generate(config_of(root, tmp_path, f"pairs.reverse_share={share}"))
        assert float(store.read_all()["reverse"].float().mean()) == pytest.approx(share)
        again = {path.name: path.stat().st_mtime_ns for path in store.folder.iterdir()}
        assert again.items() >= found.items()
        found = again
    assert contents(store).items() >= contents(made).items()


def test_reverse_pairs_alone_need_no_amortised_solver(root: Path, tmp_path: Path) -> None:
    store = generate(config_of(root, tmp_path, "pairs.reverse_share=1", "pairs.count=100"))
    assert [path.name for path in store.folder.iterdir()] == ["reverse-000000.safetensors"]


def test_joint_angles_are_uniform(made: PairStore) -> None:
    q = made.read_all()["q"][:150]  # the others follow human poses
    unit = (q - q.amin(0)) / (q.amax(0) - q.amin(0))
    assert float((unit.mean(0) - 0.5).abs().max()) < 0.08
    assert float(torch.corrcoef(q.T).fill_diagonal_(0).abs().max()) < 0.25


def test_the_same_config_and_seed_give_the_same_bytes(root: Path, made: PairStore, tmp_path: Path) -> None:
    assert contents(generate(config_of(root, tmp_path))) == contents(made)


def test_more_pairs_keep_what_is_there(root: Path, tmp_path: Path) -> None:
    few = generate(config_of(root, tmp_path, "pairs.count=150"))
    before = {path.name: path.stat().st_mtime_ns for path in few.folder.iterdir()}
    many = generate(config_of(root, tmp_path, "pairs.count=300"))
    assert many.folder == few.folder and many.shards == 4
    assert before.items() <= {path.name: path.stat().st_mtime_ns for path in many.folder.iterdir()}.items()


def test_other_settings_have_another_folder(root: Path, tmp_path: Path) -> None:
    base = store_of(config_of(root, tmp_path)).folder
    for change in ("pairs.seed=1", "pairs.fine_steps=4", "pairs.solver=fast", "robot.keypoints.left_wrist=l_gripper"):
        assert store_of(config_of(root, tmp_path, change)).folder != base, change
    for same in ("pairs.filter=none", "pairs.count=9999", "pairs.workers=3", "robot.key_links=[l_wrist]"):
        assert store_of(config_of(root, tmp_path, same)).folder == base, same


def test_another_prior_or_skeleton_has_another_folder(root: Path, tmp_path: Path) -> None:
    config = config_of(root, tmp_path)
    longer = build_body_map(config.robot, Skeleton(1.1 * Skeleton().offsets_J3))
    folders = {
        store_of(config).folder,
        PairStore.of(config, longer, BodyPrior.open()).folder,
        PairStore.of(config, build_body_map(config.robot), BodyPrior()).folder,
    }
    assert len(folders) == 3


@pytest.mark.parametrize("damage", ["truncated", "flipped", "foreign", "empty", "another index"])
def test_a_bad_shard_is_noticed_and_remade(root: Path, made: PairStore, tmp_path: Path, damage: str) -> None:
    config = config_of(root, tmp_path)
    store = store_of(config)
    store.folder.mkdir(parents=True)
    for name, content in contents(made).items():
        (store.folder / name).write_bytes(content)
    victim = store.path(1)
    content = bytearray(victim.read_bytes())
    if damage == "truncated":
        victim.write_bytes(content[: len(content) // 2])
    elif damage == "flipped":
        content[-5] ^= 4
        victim.write_bytes(content)
    elif damage == "foreign":
        store_of_other = store_of(config_of(root, tmp_path, "pairs.seed=5"))
        store_of_other.write(1, made.read(1))
        victim.write_bytes(store_of_other.path(1).read_bytes())
    elif damage == "empty":
        victim.write_bytes(b"")
    else:
        victim.write_bytes(store.path(0).read_bytes())
    with pytest.raises(DamagedFile):
        store.read(1)
    assert store.missing() == [1]
    generate(config)
    assert contents(store) == contents(made)


def test_the_amortisers_training_resumes_exactly(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(amortiser, "_CHECKPOINT_EVERY", 7)
    monkeypatch.setattr(amortiser, "_BLOCK", 4)
    config = config_of(root, tmp_path)
    maker = PairGenerator(build_body_map(config.robot), BodyPrior.open(), config)

    def run(path: Path, stop_at: int | None = None) -> None:
        draws = 0

        def draw(count: int, generator: torch.Generator) -> torch.Tensor:
            nonlocal draws
            draws += 1
            if stop_at is not None and draws > stop_at:
                raise KeyboardInterrupt
            return maker.draw_targets(count, generator)

        amortiser.train_amortiser(maker.problem, draw, 20, 3, path, {"what": "test"})

    run(tmp_path / "whole")
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path / "parts", stop_at=4)
    assert (tmp_path / "parts.checkpoint").exists() and not (tmp_path / "parts").exists()
    run(tmp_path / "parts")
    assert (tmp_path / "parts").read_bytes() == (tmp_path / "whole").read_bytes()
    assert not (tmp_path / "parts.checkpoint").exists()


def test_the_papers_solver_needs_no_amortiser(root: Path, tmp_path: Path) -> None:
    store = generate(config_of(root, tmp_path, "pairs.solver=paper", "pairs.count=100"))
    pairs = store.read_all()
    assert not store.amortiser_path.exists() and float(pairs["cost"][~pairs["reverse"]].mean()) < 5


def test_a_summary_of_many_shards_reads_some_of_each_direction(root: Path, made: PairStore) -> None:
    whole, some = made.read_all_measures(100), made.read_all_measures(2)
    assert len(whole["phi"]) == 250 and len(some["phi"]) == 200
    assert sorted(some["reverse"].unique().tolist()) == [False, True]
    torch.testing.assert_close(whole["cost"], made.read_all()["cost"])
