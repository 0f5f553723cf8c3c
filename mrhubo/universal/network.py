"""The universal network: what it sees of a branch at its present angles, and what it answers.

It is the same for all branches of all robots, all iterations and all hypotheses. A branch's joints are its tokens;
their order does not matter. All vectors are in human axes (x left, y up, z forward) of the part from which the branch's
directions are seen, right branches mirrored to left ones, and every joint's sense of turn is canonical (`slots`).

Specification of the run-time form. W = width, A = heads, F = W / A, K = hypotheses. Of each joint n, with its
weighted Jacobian rows J_s (3 numbers for each of the slots s = 1..5, `slots`; [1/rad], times sqrt(w_s |t_s|)), the
differences m_s = sqrt(w_s |t_s|) (d_s - t_s / |t_s|), half gradient g_n and half Hessian H as `objective` has them,
and damped Gauss-Newton steps p_k [rad] for the dampings `DAMPINGS`:

    f_n, joint features (44), in this order:
        axis (3), canonical and unit;  J_1 .. J_5 (15);  J_s . m_s (5);  clip(p_k, -1.5, 1.5) (3);  asinh(10 p_k) (3);
        asinh(30 g_n);  sqrt(H_nn);  H_nn;  with u = upper - q and l = q - lower: min(u, 3);  min(l, 3);
        exp(-u / 0.1);  exp(-l / 0.1);  exp(-u / 0.5);  exp(-l / 0.5);  with r = q - middle and h = half of the range:
        r / h;  min(h, 3);  1;  0 where the joint is at a limit beyond which g_n pushes it, else 1;  clip(r, -3, 3);
        1 / joints of the branch
    b, branch features (37):
        directions d_s (15);  unit targets t_s / |t_s| (15), both 0 where w_s |t_s| is 0;  sqrt(w_s |t_s|) (5);
        log(cost + 1e-4) / 5;  1 in the first iteration, else 0

    x_n   = silu(joint.weight f_n + joint.bias + branch.weight b)
    twice, with i = 0, 1, norm_j being layers.i.norm1 and norm2:
        y_n = norm_1(x_n) = (x_n - mean) / sqrt(variance + 1e-5) * weight + bias
        q, k, v = layers.i.mix.weight y_n + layers.i.mix.bias: W numbers each, in that order; A heads of F numbers each
        a_nm = softmax over the branch's joints m of  q_n . k_m / sqrt(F),  head by head
        x_n += layers.i.mixed.weight (sum_m a_nm v_m, heads after each other) + layers.i.mixed.bias
        x_n += layers.i.down.weight silu(layers.i.up.weight norm_2(x_n) + layers.i.up.bias) + layers.i.down.bias
    o     = first.weight norm(x_n) + first.bias      4 K numbers, in the first iteration: four for each hypothesis
    o     = later.weight norm(x_n) + later.bias      4 numbers, in later ones
    step  = sum_k softmax(o_1, o_2, o_3)_k p_k + tanh(o_4)      [rad]
    q'    = clip(q + step, lower, upper)

How iterations use it is written in `iterations`; p_k are those of `objective.steps`, in which a joint that a step would
push beyond its limit stops there and the others' steps are solved again, once.

Weights are float32 in a safetensors file; its metadata names schema, width, heads and hypotheses.

Legend: B branches, N joints, S = 5 slots, K hypotheses, W width, X batch of any shape.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn.functional import silu

from mrhubo.fast.plain.universal import DAMPINGS, REACH
from mrhubo.universal.chains import Local
from mrhubo.universal.objective import Bounds, Quadratic, frozen

JOINT_FEATURES, BRANCH_FEATURES = 44, 37
_LAYERS = 2
_OUTPUTS = len(DAMPINGS) + 1


def joint_features(local: Local, model: Quadratic, step_BKN: Tensor, q_BN: Tensor, bounds: Bounds) -> Tensor:
    """What is seen of each joint (B, N, 44)."""
    root_BS = model.weight_BS.sqrt()
    miss_BS31 = (model.miss_BS3 * root_BS[..., None])[..., None]
    rows_BNS3 = model.rows_BRN.unflatten(1, (5, 3)).permute(0, 3, 1, 2)
    pull_BNS = (rows_BNS3[..., None, :] @ miss_BS31[:, None])[..., 0, 0]
    diagonal_BN = model.hessian_BNN.diagonal(dim1=-2, dim2=-1)
    up_BN, down_BN = bounds.upper_BN - q_BN, q_BN - bounds.lower_BN
    away_BN, half_BN = q_BN - bounds.middle_BN, bounds.half_BN
    joints_B1 = bounds.present_BN.sum(1, keepdim=True).clamp_min(1.0)
    numbers = [
        torch.asinh(30 * model.gradient_BN), diagonal_BN.clamp_min(0.0).sqrt(), diagonal_BN, up_BN.clamp_max(3.0),
        down_BN.clamp_max(3.0), (up_BN / -0.1).exp(), (down_BN / -0.1).exp(), (up_BN / -0.5).exp(),
        (down_BN / -0.5).exp(), away_BN / half_BN, half_BN.clamp_max(3.0), torch.ones_like(q_BN),
        1 - frozen(q_BN, model.gradient_BN, bounds), away_BN.clamp(-3.0, 3.0), (1 / joints_B1).expand_as(q_BN),
    ]  # fmt: skip
    step_BNK = step_BKN.mT
    parts = [local.axis_BN3, rows_BNS3.flatten(2), pull_BNS, step_BNK.clamp(-1.5, 1.5), torch.asinh(10 * step_BNK)]
    return torch.cat((*parts, torch.stack(numbers, dim=-1)), dim=-1)


def branch_features(local: Local, model: Quadratic, target_BS3: Tensor, first: bool) -> Tensor:
    """What is seen of the whole branch (B, 37)."""
    length_BS1 = target_BS3.norm(dim=-1, keepdim=True)
    there_BS1 = (model.weight_BS > 0).to(target_BS3)[..., None]
    unit_BS3 = target_BS3 / length_BS1.clamp_min(1e-6) * there_BS1
    cost_B1 = (model.cost_B[:, None] + 1e-4).log() / 5
    parts = [(local.direction_BS3 * there_BS1).flatten(1), unit_BS3.flatten(1), model.weight_BS.sqrt(), cost_B1]
    return torch.cat((*parts, torch.full_like(cost_B1, float(first))), dim=1)


class Layer(nn.Module):
    """Joints look at each other, then each for itself."""

    def __init__(self, width: int, heads: int) -> None:
        super().__init__()
        self.heads = heads
        self.norm1, self.norm2 = nn.LayerNorm(width), nn.LayerNorm(width)
        self.mix, self.mixed = nn.Linear(width, 3 * width), nn.Linear(width, width)
        self.up, self.down = nn.Linear(width, 2 * width), nn.Linear(2 * width, width)

    def forward(self, x_BNW: Tensor, absent_B11N: Tensor) -> Tensor:
        """Tokens (B, N, W); `absent_B11N` is -inf, or very low, for joints that are not there, else 0."""
        parts = self.mix(self.norm1(x_BNW)).unflatten(-1, (3, self.heads, -1))
        query, key, value = parts.permute(2, 0, 3, 1, 4)
        weight_BANN = torch.softmax(query @ key.mT / query.shape[-1] ** 0.5 + absent_B11N, dim=-1)
        x_BNW = x_BNW + self.mixed((weight_BANN @ value).transpose(1, 2).flatten(2))
        return x_BNW + self.down(silu(self.up(self.norm2(x_BNW))))


class UniversalNetwork(nn.Module):
    """The network of the specification above."""

    def __init__(self, width: int = 32, heads: int = 2, hypotheses: int = 8) -> None:
        super().__init__()
        self.width, self.heads, self.hypotheses = width, heads, hypotheses
        self.joint = nn.Linear(JOINT_FEATURES, width)
        self.branch = nn.Linear(BRANCH_FEATURES, width, bias=False)
        self.layers = nn.ModuleList(Layer(width, heads) for _ in range(_LAYERS))
        self.norm = nn.LayerNorm(width)
        self.first = nn.Linear(width, hypotheses * _OUTPUTS)
        self.later = nn.Linear(width, _OUTPUTS)
        for layer in (self.first, self.later):  # small corrections of damped steps at the beginning
            nn.init.normal_(layer.weight, std=0.02)
        nn.init.normal_(self.first.bias, std=0.3)

    def forward(
        self, local: Local, model: Quadratic, step_BKN: Tensor, q_BN: Tensor, bounds: Bounds, target_BS3: Tensor,
        first: bool,
    ) -> Tensor:  # fmt: skip
        """Steps (B, K, N) [rad] from joint angles (B, N): K hypotheses in the first iteration, else one."""
        with torch.no_grad():
            feature_BNF = joint_features(local, model, step_BKN, q_BN, bounds)
            seen_BF = branch_features(local, model, target_BS3, first)
            absent_B11N = (bounds.present_BN - 1)[:, None, None] * 1e9
        x_BNW = silu(self.joint(feature_BNF) + self.branch(seen_BF)[:, None])
        for layer in self.layers:
            x_BNW = layer(x_BNW, absent_B11N)
        out_BNKO = (self.first if first else self.later)(self.norm(x_BNW)).unflatten(-1, (-1, _OUTPUTS))
        mixture_BNKD = torch.softmax(out_BNKO[..., :-1], dim=-1)
        step_BNKD = step_BKN.mT[:, :, None]
        moved_BNK = (mixture_BNKD * step_BNKD).sum(-1) + REACH * torch.tanh(out_BNKO[..., -1])
        return moved_BNK.transpose(1, 2) * bounds.present_BN[:, None]
