"""How S3LE (see `s3le`) is trained: its pairs, and the losses on them.

Legend: B batch, D directions, N joints, G glue pairs, S self-made pairs, U unpaired poses.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from mrhubo.baselines.s3le.model import S3LE, normality_gap
from mrhubo.config import S3LEConfig
from mrhubo.reference import OptimizationRetargeter
from mrhubo.robot import BodyMap, SelfCollision
from mrhubo.runtime.progress import SILENT, Reporter
from mrhubo.runtime.trainer import cosine_schedule

_MIXTURES = 0.5
_LOG_EVERY = 100


@dataclass(frozen=True)
class S3LEData:
    """What does not depend on the network: poses of both domains."""

    human_GD3: Tensor
    """Directions of human poses from motion capture."""
    robot_GN: Tensor
    """The reference retargeter's answers to them [rad]."""
    random_UN: Tensor
    """Random poses inside the limits, free of collision [rad]."""
    random_UD3: Tensor
    """Their directions."""
    collision: SelfCollision


def make_data(body_map: BodyMap, local_GJ33: Tensor, settings: S3LEConfig, report: Reporter = SILENT) -> S3LEData:
    """Glue pairs of human poses (G, 21, 3, 3) from motion capture, and random robot poses."""
    robot, collision = body_map.robot, body_map.collision
    retargeter = OptimizationRetargeter(body_map)
    answers = []
    with report.step("glue pairs", len(local_GJ33)) as progress:
        for done, part in enumerate(local_GJ33.split(2_000)):
            progress.update(2_000 * done)
            answers.append(retargeter.solve_frames(part)[0])
    generator = torch.Generator().manual_seed(settings.seed)
    random_UN = robot.sample(settings.random_poses, generator)
    random_UN = random_UN[~collision.collides(random_UN)]
    return S3LEData(
        human_directions(body_map, local_GJ33),
        torch.cat(answers),
        random_UN,
        _directions(body_map, random_UN),
        collision,
    )


def human_directions(body_map: BodyMap, local_BJ33: Tensor) -> Tensor:
    """What S3LE sees of human poses (B, 21, 3, 3): unit directions (B, D, 3)."""
    return body_map.human_directions(local_BJ33)[:, body_map.measured]


def _directions(body_map: BodyMap, q_BN: Tensor) -> Tensor:
    found = [body_map.robot_directions(body_map.robot.forward(part)) for part in q_BN.split(8_192)]
    return torch.cat(found)[:, body_map.measured]


def train_s3le(body_map: BodyMap, data: S3LEData, settings: S3LEConfig, report: Reporter = SILENT) -> S3LE:
    """Trains the autoencoders on glue pairs, then with the self-made pairs that they allow to make.

    Args:
        body_map: the robot.
        data: what `make_data` gave.
        settings: sizes, weights, steps.
        report: told of the steps.
    """
    robot = body_map.robot
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(settings.seed)
        model = S3LE(len(body_map.measured), robot.lower_N, robot.upper_N, settings.hidden, settings.latent)
    free_GN = data.robot_GN[~data.collision.collides(data.robot_GN)]
    feasible_FN = torch.cat((free_GN, data.random_UN))
    optimizer = torch.optim.Adam(model.parameters(), settings.lr, fused=True)
    schedule = cosine_schedule(optimizer, settings.steps)
    generator = torch.Generator().manual_seed(settings.seed + 1)
    bootstrap = settings.steps // 2
    pairs: tuple[Tensor, Tensor, Tensor] | None = None
    with report.step("S3LE", settings.steps, "steps") as progress:
        for step in range(settings.steps):
            if step == bootstrap:
                pairs = _self_made_pairs(model, body_map, data, feasible_FN, settings, generator)
            loss = _loss(model, data, pairs, settings, generator)
            optimizer.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(model.parameters(), 1.0)
            optimizer.step()
            schedule.step()
            if step % _LOG_EVERY == 0 or step + 1 == settings.steps:
                progress.update(step + 1, f"loss {float(loss.detach()):.4f}")
    assert pairs is not None
    model.requires_grad_(False).eval()
    model.set_feasible(torch.cat((feasible_FN, pairs[2])))
    return model


@torch.no_grad()
def _self_made_pairs(
    model: S3LE,
    body_map: BodyMap,
    data: S3LEData,
    feasible_FN: Tensor,
    settings: S3LEConfig,
    generator: torch.Generator,
) -> tuple[Tensor, Tensor, Tensor]:
    """Directions of poses beyond the limits (S, D, 3), of their feasible projections, and the projections (S, N)."""
    model.set_feasible(feasible_FN)
    unit_SN = 2 * torch.rand(settings.self_made, len(model.half_N), generator=generator) - 1
    beyond_SN = model.middle_N + (1 + settings.beyond) * model.half_N * unit_SN
    codes_SZ = model.robot_codes(beyond_SN)
    projected_SN = model.answer(codes_SZ, settings.neighbours, settings.width, data.collision)
    return _directions(body_map, beyond_SN), _directions(body_map, projected_SN), projected_SN


def _loss(
    model: S3LE,
    data: S3LEData,
    pairs: tuple[Tensor, Tensor, Tensor] | None,
    settings: S3LEConfig,
    generator: torch.Generator,
) -> Tensor:
    batch = settings.batch_size

    def draw(count: int) -> Tensor:
        return torch.randint(count, (batch,), generator=generator)

    glue_B, random_B = draw(len(data.robot_GN)), draw(len(data.random_UN))
    human_BX, paired_BN = data.human_GD3[glue_B].flatten(1), model.scaled(data.robot_GN[glue_B])
    random_BX, random_BN = data.random_UD3[random_B].flatten(1), model.scaled(data.random_UN[random_B])
    human_codes, paired_codes, random_codes = (
        model.human.encode(human_BX), model.robot.encode(paired_BN), model.robot.encode(random_BN)
    )  # fmt: skip
    skeleton_codes = model.human.encode(random_BX)
    rebuilt = (
        (model.human.decode(human_codes) - human_BX).abs().mean()
        + (model.human.decode(skeleton_codes) - random_BX).abs().mean()
        + (model.robot.decode(paired_codes) - paired_BN).abs().mean()
        + (model.robot.decode(random_codes) - random_BN).abs().mean()
    )
    normal = [torch.randn(batch, settings.latent, generator=generator) for _ in range(2)]
    gap = normality_gap(human_codes, normal[0]) + normality_gap(paired_codes, normal[1])
    # A random feasible pose is its own projection, so its skeleton is a pair as well.
    drawn = (human_codes - paired_codes).square().mean() + (skeleton_codes - random_codes).square().mean()
    loss = rebuilt + settings.normal_weight * gap + settings.pair_weight * drawn
    if pairs is not None:
        beyond_SD3, projected_SD3, projected_SN = pairs
        made_B = draw(len(projected_SN))
        share_B11 = _MIXTURES * torch.rand(batch, 1, 1, generator=generator)
        mixed_BD3 = (1 - share_B11) * beyond_SD3[made_B] + share_B11 * projected_SD3[made_B]
        target_BZ = model.robot_codes(projected_SN[made_B])
        gaps = [(model.human_codes(d) - target_BZ).square().mean() for d in (mixed_BD3, projected_SD3[made_B])]
        loss = loss + settings.projection_weight * (gaps[0] + gaps[1])
    return loss
