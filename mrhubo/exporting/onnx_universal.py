"""The five iterations of the network for every robot as nodes of an ONNX graph, as `mrhubo.fast.plain.universal` has
them: float64 but for the network's layers. Systems of equations are solved by elimination, written out, all branches
side by side.

Legend: B frames, K hypotheses or dampings, X = B K, N joints, C blocks of M joints at most, D directions, A driven
joints, E branches, S = 5 slots.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrhubo.errors import UserError
from mrhubo.exporting.values import Value, asinh, join, silu, solve
from mrhubo.fast.description import Description
from mrhubo.fast.plain.human import skew
from mrhubo.fast.plain.steps import FLOOR, SHORTEST
from mrhubo.fast.plain.universal import DAMPINGS, FINAL_DAMPINGS, KEPT, REACH, REFINED, Branches
from mrhubo.fast.sections import Universal

_EPSILON = 1e-5
"""Of `torch.nn.LayerNorm`."""


@dataclass(frozen=True)
class _Goal:
    unit_BD3: Value
    weight_BD1: Value
    directions: int

    def several(self, count: int) -> _Goal:
        def often(value: Value, last: int) -> Value:
            longer = value.unsqueeze(1)
            tiled = Value(value.graph, value.graph.node("Tile", longer.name, value.graph.numbers([1, count, 1, 1])))
            return tiled.reshape(-1, self.directions, last)

        return _Goal(often(self.unit_BD3, 3), often(self.weight_BD1, 1), self.directions) if count > 1 else self


@dataclass(frozen=True)
class _Place:
    q_XN: Value
    cost_XC: Value
    gradient_XN: Value
    hessian_XNN: Value
    direction_XD3: Value
    jacobian_XD3N: Value
    axis_XN3: Value


def joint_angles(description: Description, universal: Universal, target_BD3: Value) -> Value:
    """Joint angles (B, N) [rad], before they are rounded to float32, for human directions (B, D, 3) in float64.

    Raises:
        UserError: a branch of the robot is none that the network knows.
    """
    nodes = _Nodes(description, universal)
    if not nodes.plain.known_N.all():
        raise UserError(
            "the network for every robot does not know a branch of this one, such as legs that share a joint, and an "
            "exported file has its iterations alone; mrhubo.load_fast answers it"
        )
    cost, block_N = description.cost, description.cost.block_N
    partial_D1, joints = cost.partial_D[:, None] > 0, len(block_N)
    length_BD1 = (target_BD3 * target_BD3).sum().node("Sqrt") * partial_D1 + ~partial_D1
    weight_BD1 = length_BD1 * cost.weight_D[:, None]
    goal = _Goal(target_BD3 / length_BD1.node("Max", SHORTEST), weight_BD1, len(cost.weight_D))
    q_BN = weight_BD1.take(0, 1) * np.zeros(joints) + (cost.lower_N + cost.upper_N) / 2
    place = nodes.at(q_BN, goal)
    best_BN, best_BC = q_BN, place.cost_XC
    tried_BKN = nodes.answer(place, goal, nodes.steps(place, DAMPINGS), first=True)
    keep = int(universal.size_2[1])
    cost_BKC = nodes.cost(tried_BKN, goal, keep)
    for turn, most in enumerate((*KEPT, 1)):
        keep = min(keep, most)
        least_BKC, order_BKC = cost_BKC.least(keep)
        kept_BKN = tried_BKN.node("GatherElements", order_BKC.take(block_N, 2), axis=1)
        least_BC = least_BKC.take(0, 1)
        better_BC = least_BC.less(best_BC)
        best_BN = better_BC.take(block_N, 1).where(kept_BKN.take(0, 1), best_BN)
        best_BC = better_BC.where(least_BC, best_BC)
        if turn == len(KEPT):
            break
        goal_X = goal.several(keep)
        place = nodes.at(kept_BKN.reshape(-1, joints), goal_X)
        step_XKN = nodes.steps(place, DAMPINGS if turn < REFINED else FINAL_DAMPINGS)
        first_XN = place.q_XN + step_XKN.take(0, 1)
        if turn < REFINED:
            ways = (nodes.answer(place, goal_X, step_XKN, first=False).take(0, 1), first_XN)
        else:
            ways = (first_XN, place.q_XN + step_XKN.take(1, 1))
        one_BKN, two_BKN = (way.reshape(-1, keep, joints) for way in ways)
        one_BKC, two_BKC = (nodes.cost(way, goal, keep) for way in (one_BKN, two_BKN))
        better_BKC = two_BKC.less(one_BKC)
        tried_BKN = better_BKC.take(block_N, 2).where(two_BKN, one_BKN)
        cost_BKC = better_BKC.where(two_BKC, one_BKC)
    return best_BN


class _Nodes:
    def __init__(self, description: Description, universal: Universal) -> None:
        self.plain, self.d, self.u = Branches(description, universal), description, universal
        cost = description.cost
        blocks = [np.flatnonzero(cost.block_N == block) for block in range(cost.joints_NC.shape[1])]
        self.most = max(map(len, blocks))
        self.joint_CM = np.zeros((len(blocks), self.most), np.int64)
        self.there_CM = np.zeros(self.joint_CM.shape)
        self.place_N = np.zeros(len(cost.block_N), np.int64)
        for block, own_N in enumerate(blocks):
            self.joint_CM[block, : len(own_N)], self.there_CM[block, : len(own_N)] = own_N, 1
            self.place_N[own_N] = block * self.most + np.arange(len(own_N))

    def _placed(self, q_XN: Value) -> tuple[Value, Value, Value, Value, Value, Value, Value]:
        """Rotations and positions of bodies, starts, ends, lengths and units of directions, and the parts' axes."""
        k = self.d.kinematics
        joints = len(k.parent_A)
        angle_XA11 = (q_XN.take(k.column_A, 1) * k.ratio_A + k.offset_A).reshape(-1, joints, 1, 1)
        rotary_A11, across_A33 = (k.rotary_A > 0)[:, None, None], skew(k.axis_A3)
        fixed_A44, sine_A44, rest_A44, slide_A44 = np.zeros((4, joints, 4, 4))
        fixed_A44[:, :3], fixed_A44[:, 3, 3] = k.origin_A34, 1
        once_A33 = k.origin_A34[..., :3] @ across_A33
        sine_A44[:, :3, :3] = once_A33 * rotary_A11
        rest_A44[:, :3, :3] = once_A33 @ across_A33 * rotary_A11
        slide_A44[:, :3, 3:] = k.origin_A34[..., :3] @ k.axis_A3[..., None] * ~rotary_A11
        cosine = (angle_XA11 + np.pi / 2).node("Sin")  # ONNX Runtime has no cosine of float64
        own_XA44 = angle_XA11.node("Sin") * sine_A44 + (cosine * -1.0 + 1.0) * rest_A44 + fixed_A44
        if slide_A44.any():
            own_XA44 = own_XA44 + angle_XA11 * slide_A44
        bodies = [own_XA44.take(0, 1) * 0.0 + np.eye(4)]
        for joint, parent in enumerate(k.parent_A.tolist()):
            own = own_XA44.take(joint, 1)
            bodies.append(bodies[parent] @ own if parent else own)
        body_XL44 = join([body.unsqueeze(1) for body in bodies], 1)
        rotation_XL33 = body_XL44.take(range(3), 2).take(range(3), 3)
        ends = [(body_XL44.take(body, 1).take(range(3), 2) @ np.c_[point, k.limb_D][..., None]).squeeze(3)
                for body, point in ((k.start_body_D, k.start_D3), (k.end_body_D, k.end_D3))]  # fmt: skip
        along_XD3 = ends[1] - ends[0]
        length_XD1 = (along_XD3 * along_XD3).sum().node("Sqrt")
        view_XV33 = rotation_XL33.take(k.view_body_V, 1) @ k.view_V33
        position_XL3 = body_XL44.take(range(3), 2).take(3, 3)
        return rotation_XL33, position_XL3, *ends, length_XD1, along_XD3 / length_XD1, view_XV33

    def _costs(self, q_XN: Value, miss_XD3: Value, goal: _Goal) -> Value:
        cost = self.d.cost
        away_XN = q_XN - cost.middle_N
        weighed_XD = ((miss_XD3 * miss_XD3).sum() * goal.weight_BD1).squeeze(2)
        return weighed_XD @ cost.directions_DC + (away_XN * away_XN * cost.ridge_N) @ cost.joints_NC

    def cost(self, q_BKN: Value, goal: _Goal, count: int) -> Value:
        """What blocks cost (B, K, C)."""
        q_XN, goal = q_BKN.reshape(-1, len(self.place_N)), goal.several(count)
        *_, unit_XD3, view_XV33 = self._placed(q_XN)
        miss_XD3 = _seen(unit_XD3, view_XV33.take(self.d.human.seen_D, 1)) - goal.unit_BD3
        return self._costs(q_XN, miss_XD3, goal).reshape(-1, count, len(self.joint_CM))

    def at(self, q_XN: Value, goal: _Goal) -> _Place:
        """Everything there."""
        k, cost, u = self.d.kinematics, self.d.cost, self.u
        rotation_XL33, position_XL3, start_XD3, end_XD3, length_XD1, unit_XD3, view_XV33 = self._placed(q_XN)
        joints, directions = len(self.place_N), len(cost.weight_D)
        driven = np.arange(1, len(k.parent_A) + 1)
        axis_XA3 = (rotation_XL33.take(driven, 1) @ k.axis_A3[..., None]).squeeze(3)
        d, a, n = k.direction_Q, k.joint_Q, k.column_Q
        end_Q1, start_Q1, bend_Q1, slide_Q1 = k.factor_Q4.T[..., None]
        axis_XQ3, along_XQ3 = axis_XA3.take(a, 1), unit_XD3.take(d, 1)
        lever_XQ3 = end_XD3.take(d, 1) * end_Q1 - start_XD3.take(d, 1) * start_Q1
        lever_XQ3 = lever_XQ3 - position_XL3.take(a + 1, 1) * bend_Q1
        graph = q_XN.graph
        moved_XQ3 = Value(graph, graph.cross(axis_XQ3.name, lever_XQ3.name)) + axis_XQ3 * slide_Q1
        moved_XQ3 = (moved_XQ3 - along_XQ3 * (along_XQ3 * moved_XQ3).sum()) / length_XD1.take(d, 1)
        spread_QP = (d * joints + n)[:, None] == np.arange(directions * joints)
        base_XD3N = (moved_XQ3.turned(0, 2, 1) @ spread_QP).reshape(-1, 3, directions, joints).turned(0, 2, 1, 3)
        see_XD33 = view_XV33.take(self.d.human.seen_D, 1)
        jacobian_XD3N = see_XD33.turned(0, 1, 3, 2) @ base_XD3N
        direction_XD3 = _seen(unit_XD3, see_XD33)
        miss_XD3 = direction_XD3 - goal.unit_BD3
        own_D1N = (cost.block_D[:, None] == cost.block_N)[:, None]
        rows_XD3N = jacobian_XD3N * own_D1N
        heavy_XNR = (rows_XD3N * goal.weight_BD1.unsqueeze(3)).reshape(-1, 3 * directions, joints).turned(0, 2, 1)
        gradient_XN = (heavy_XNR @ miss_XD3.reshape(-1, 3 * directions, 1)).squeeze(2)
        gradient_XN = gradient_XN + (q_XN - cost.middle_N) * cost.ridge_N
        hessian_XNN = heavy_XNR @ rows_XD3N.reshape(-1, 3 * directions, joints) + np.diag(cost.ridge_N)
        axis_XN3 = _seen(axis_XA3.take(u.joint_N, 1), view_XV33.take(u.view_E[self.plain.row_N], 1))
        cost_XC = self._costs(q_XN, miss_XD3, goal)
        return _Place(q_XN, cost_XC, gradient_XN, hessian_XNN, direction_XD3, jacobian_XD3N, axis_XN3)

    def frozen(self, found: _Place) -> Value:
        """1 where a limit holds a joint (X, N)."""
        cost, zero = self.d.cost, found.gradient_XN * 0.0
        low = found.q_XN.node("LessOrEqual", cost.lower_N, kind=np.bool_).node("And", zero.less(found.gradient_XN))
        high = found.q_XN.node("GreaterOrEqual", cost.upper_N, kind=np.bool_)
        return low.node("Or", high.node("And", found.gradient_XN.less(zero))).cast(np.float64)

    def steps(self, found: _Place, damping_K: tuple[float, ...]) -> Value:
        """Damped Gauss-Newton steps (X, K, N) [rad]."""
        cost, most, joints = self.d.cost, self.most, len(self.place_N)
        shape = (-1, 1, *self.joint_CM.shape)

        def blocks(value_XN: Value) -> Value:
            return value_XN.take(self.joint_CM.ravel(), 1).reshape(*shape)

        flat_CMM = (self.joint_CM[..., None] * joints + self.joint_CM[:, None]).ravel()
        matrix = found.hessian_XNN.reshape(-1, joints * joints).take(flat_CMM, 1).reshape(*shape, most)
        eye = np.eye(most)
        diagonal = (matrix * eye).sum() + FLOOR  # (X, 1, C, M, 1)
        matrix = matrix + diagonal * eye * np.array(damping_K)[:, None, None, None]
        down = blocks(found.gradient_XN) * -np.ones((len(damping_K), 1, 1))
        free = (blocks(self.frozen(found)) * -1.0 + 1.0) * self.there_CM
        lower, upper = (blocks(found.q_XN * -1.0 + limit_N) for limit_N in (cost.lower_N, cost.upper_N))
        step = solve(matrix, down, free, most)
        fixed = step.clip(lower, upper)
        inside = fixed.node("Equal", step, kind=np.bool_).cast(np.float64)
        fixed = fixed * (inside * -1.0 + 1.0)
        right = down - (matrix @ fixed.unsqueeze(4)).squeeze(4)
        step = (solve(matrix, right, free * inside, most) + fixed).clip(lower, upper)
        return step.reshape(-1, len(damping_K), self.joint_CM.size).take(self.place_N, 2)

    def _features(self, found: _Place, goal: _Goal, step_XKN: Value) -> Value:
        cost, plain, joints = self.d.cost, self.plain, len(self.place_N)
        sense_N, slots = plain.sense_N, plain.slot_NS.shape[1]
        there_NS = plain.slot_NS >= 0
        slot_P = np.where(there_NS, plain.slot_NS, 0).ravel()
        root_XD1 = goal.weight_BD1.node("Sqrt")
        flat = found.jacobian_XD3N.turned(0, 1, 3, 2).reshape(-1, len(cost.weight_D) * joints, 3)
        rows = flat.take(slot_P * joints + np.repeat(np.arange(joints), slots), 1) * root_XD1.take(slot_P, 1)
        rows = rows.reshape(-1, joints, slots, 3) * (there_NS * sense_N[:, None])[..., None]
        miss = ((found.direction_XD3 - goal.unit_BD3) * root_XD1).take(slot_P, 1).reshape(-1, joints, slots, 3)
        pull = (rows * miss).sum().squeeze(3)
        rows = (rows * self.u.flip_E53[plain.row_N]).reshape(-1, joints, 3 * slots)
        q_XN, away = found.q_XN, (found.q_XN - cost.middle_N) * sense_N
        half_N, turned_N = (cost.upper_N - cost.lower_N) / 2, sense_N > 0
        up = (q_XN * -sense_N) + np.where(turned_N, cost.upper_N, -cost.lower_N)
        down = (q_XN * sense_N) + np.where(turned_N, -cost.lower_N, cost.upper_N)
        diagonal = (found.hessian_XNN * np.eye(joints)).sum().squeeze(2)
        ones, siblings_N = q_XN * 0.0 + 1.0, cost.joints_NC.sum(axis=0)[cost.block_N]
        numbers = [
            asinh(found.gradient_XN * (30 * sense_N)), diagonal.node("Max", 0.0).node("Sqrt"), diagonal,
            up.node("Min", 3.0), down.node("Min", 3.0), (up * -10.0).node("Exp"), (down * -10.0).node("Exp"),
            (up * -2.0).node("Exp"), (down * -2.0).node("Exp"), away / half_N, ones * np.minimum(half_N, 3.0), ones,
            ones - self.frozen(found), away.clip(-3.0, 3.0), ones / siblings_N,
        ]  # fmt: skip
        step = (step_XKN * sense_N).turned(0, 2, 1)
        axis = found.axis_XN3 * (self.u.axial_E3[plain.row_N] * sense_N[:, None])
        told = [number.unsqueeze(2) for number in numbers]
        return join([axis, rows, pull, step.clip(-1.5, 1.5), asinh(step * 10.0), *told], 2).cast(np.float32)

    def _branch_features(self, found: _Place, goal: _Goal, first: bool) -> Value:
        u, there_ES = self.u, self.u.slot_E5 >= 0
        branches, slot_P = len(u.slot_E5), np.where(there_ES, u.slot_E5, 0).ravel()
        weight = goal.weight_BD1.take(slot_P, 1).reshape(-1, *there_ES.shape) * there_ES
        seen = (weight * 0.0).less(weight).cast(np.float64).unsqueeze(3) * u.flip_E53
        vectors = [(array.take(slot_P, 1).reshape(-1, *there_ES.shape, 3) * seen).reshape(-1, branches, 15)
                   for array in (found.direction_XD3, goal.unit_BD3)]  # fmt: skip
        cost = ((found.cost_XC.take(u.block_E, 1) + 1e-4).node("Log") / 5.0).unsqueeze(2)
        return join([*vectors, weight.node("Sqrt"), cost, cost * 0.0 + float(first)], 2).cast(np.float32)

    def answer(self, found: _Place, goal: _Goal, step_XKN: Value, first: bool) -> Value:
        """The network's next angles (X, K, N) [rad]."""
        w, (heads, hypotheses), joints = self.u.weights, self.u.size_2.tolist(), len(self.place_N)
        width, count = len(w["joint.bias"]), hypotheses if first else 1

        def affine(name: str, x: Value) -> Value:
            return x @ w[f"{name}.weight"].T + w[f"{name}.bias"]

        def norm(name: str, x: Value) -> Value:
            x = x - x.mean()
            return x / ((x * x).mean() + _EPSILON).node("Sqrt") * w[f"{name}.weight"] + w[f"{name}.bias"]

        branch = (self._branch_features(found, goal, first) @ w["branch.weight"].T).take(self.plain.row_N, 1)
        x = silu(affine("joint", self._features(found, goal, step_XKN)) + branch)
        for layer in ("layers.0.", "layers.1."):
            parts = affine(layer + "mix", norm(layer + "norm1", x)).reshape(-1, joints, 3, heads, width // heads)
            query, key, value = (parts.take(place, 2).turned(0, 2, 1, 3) for place in range(3))
            score = query @ key.turned(0, 1, 3, 2) * (width // heads) ** -0.5 + self.plain.apart_NN
            mixed = (score.node("Softmax", axis=-1) @ value).turned(0, 2, 1, 3).reshape(-1, joints, width)
            x = x + affine(layer + "mixed", mixed)
            x = x + affine(layer + "down", silu(affine(layer + "up", norm(layer + "norm2", x))))
        out = affine("first" if first else "later", norm("norm", x)).reshape(-1, joints, count, 4)
        share = out.take(range(3), 3).node("Softmax", axis=-1).cast(np.float64)
        moved = (share * step_XKN.turned(0, 2, 1).unsqueeze(2)).sum().squeeze(3)
        moved = moved + out.take(3, 3).node("Tanh").cast(np.float64) * (REACH * self.plain.sense_N[:, None])
        cost = self.d.cost
        return (found.q_XN.unsqueeze(1) + moved.turned(0, 2, 1)).clip(cost.lower_N, cost.upper_N)


def _seen(vector_XD3: Value, view_XD33: Value) -> Value:
    return (vector_XD3.unsqueeze(2) @ view_XD33).squeeze(2)
