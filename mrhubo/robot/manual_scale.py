"""`scale: manual`: the scale factor theta as the paper's authors set it, by numbers for each robot.

Everything is in the robot's base frame, in metres: a keypoint is a link's position (or a weighted mean of several, or
none) plus a constant; upper arms and forearms are lengthened along themselves, and what hangs on them moves along; all
points are shifted, then scaled. The result, turned into human axes, is placed with its pelvis on the human's: the
body prior moves no root, so a shift of all points is there to hold the authors' numbers and changes nothing; whoever
gives one is told so.

Figuera, Park, Ahn: MR.HuBo, IROS 2024, section III, and its published code.

Legend: B batch, K keypoints, L robot links.
"""

from __future__ import annotations

import copy
import dataclasses
import warnings
from collections.abc import Mapping, Sequence

import torch
from torch import Tensor, nn

from mrhubo.body.skeleton import KEYPOINT_NAMES, PAIRED_KEYPOINTS, keypoint_indices
from mrhubo.config import ConstantEntry, ManualScaleConfig, MeanEntry, Range, typed_value
from mrhubo.errors import InputWarning, UserError, unknown_name
from mrhubo.frames import base_to_human
from mrhubo.robot.entries import read_mean, read_vector
from mrhubo.robot.model import LinkPoses, Robot
from mrhubo.robot.parts import PARTS, LimbPart, points_beyond

_AXES = ("x", "y", "z")
_NUMBERS = {
    field.name: (field.metadata["low"], field.metadata["high"])
    for field in dataclasses.fields(ManualScaleConfig)
    if "low" in field.metadata
}
"""The numbers that stand alone, with the range that the config allows."""


class ManualScale(nn.Module):
    """Target keypoints of one robot by the numbers of `robot.manual`."""

    shift_3: Tensor
    weight_KL: Tensor
    offset_K3: Tensor

    def __init__(self, config: ManualScaleConfig) -> None:
        """Checks the entries.

        Raises:
            UserError: a keypoint does not exist, or an entry is none of the forms; names it.
        """
        super().__init__()
        self.config = config
        self._entries: dict[str, tuple[dict[str, float], tuple[float, float, float]]] = {}
        for name, value in config.keypoints.items():
            if name not in KEYPOINT_NAMES:
                raise UserError(f"robot.manual.keypoints.{name}: {unknown_name('keypoint', name, KEYPOINT_NAMES)}")
            self._entries[name] = read_mean(name, value)
        if "pelvis" not in self._entries:
            raise UserError("robot.manual.keypoints: 'pelvis' is missing; the others are placed relative to it")
        if len(self._entries) < 2:
            raise UserError("robot.manual.keypoints: names the pelvis alone; name what is to be matched")
        shift_3 = torch.tensor(read_vector("robot.manual.shift", config.shift))
        self.register_buffer("shift_3", shift_3, persistent=False)
        if bool(shift_3.any()):
            warnings.warn(
                f"robot.manual.shift: {list(config.shift)} moves nothing, because all keypoints are placed relative to "
                "the pelvis; to move the others, add the opposite to the offset of robot.manual.keypoints.pelvis",
                InputWarning,
                stacklevel=2,
            )
        self.keypoint_names = tuple(self._entries)
        self.keypoint_indices = keypoint_indices(self.keypoint_names)
        self._place = {name: row for row, name in enumerate(self.keypoint_names)}
        self._lengthened = [
            (
                part.lengthened_by,
                [self._place[part.start]],
                [self._place[part.end]],
                [self._place[name] for name in points_beyond(part) if name in self._place],
            )
            for part in PARTS
            if isinstance(part, LimbPart) and part.lengthened_by and {part.start, part.end} <= self._place.keys()
        ]
        """Of each limb that a number lengthens: the number, the rows of its start, its end and all that moves along."""

    @property
    def links(self) -> list[str]:
        """Every link that a keypoint is taken from."""
        return list(dict.fromkeys(link for weights, _ in self._entries.values() for link in weights))

    def prepare(self, robot: Robot) -> None:
        """Looks the links up in a robot that computes the poses of all of them."""
        weight_KL = torch.zeros(len(self._entries), len(robot.links))
        for row, (weights, _) in enumerate(self._entries.values()):
            for link, weight in weights.items():
                weight_KL[row, robot.link_index(link)] = weight / sum(weights.values())
        self.register_buffer("weight_KL", weight_KL, persistent=False)
        offset_K3 = torch.tensor([offset for _, offset in self._entries.values()])
        self.register_buffer("offset_K3", offset_K3, persistent=False)
        self.to(robot.lower_N)

    def targets(self, poses: LinkPoses) -> Tensor:
        """Target keypoints (B, K, 3) [m], human frame, of robot poses."""
        base_BK3 = self.weight_KL @ poses.position_BL3 + self.offset_K3
        moved_BK3 = base_BK3.clone()
        for number, start, end, moving in self._lengthened:
            moved_BK3[:, moving] += getattr(self.config, number) * (base_BK3[:, end] - base_BK3[:, start])
        scaled_BK3 = (moved_BK3 + self.shift_3) * self.config.factor
        human_BK3 = base_to_human(scaled_BK3)
        pelvis = self._place["pelvis"]
        return human_BK3 - human_BK3[:, [pelvis]]


def varied(config: ManualScaleConfig, values: Mapping[str, float]) -> ManualScaleConfig:
    """A copy with other numbers: `factor`, `upper_arm`, `forearm` are replaced, `KEYPOINT.x` (or y, z) is added to that
    keypoint's offset [m]; without a side to those of both sides, y mirrored.
    """
    config = copy.deepcopy(config)
    offsets = _offsets(config)
    for name, value in values.items():
        if name in _NUMBERS:
            setattr(config, name, value)
            continue
        for keypoint, axis, sign in offsets[name]:
            links, offset = read_mean(keypoint, config.keypoints[keypoint])
            moved: list[int | float] = list(offset)
            moved[axis] += value * sign
            config.keypoints[keypoint] = MeanEntry({**links}, moved) if links else ConstantEntry(moved)
    return config


def check_ranges(config: ManualScaleConfig, ranges: Mapping[str, Sequence[float]]) -> None:
    """Refuses ranges that `varied` could not take.

    Raises:
        UserError: names the entry.
    """
    if not ranges:
        raise UserError("robot.search.ranges: is empty; name what varies")
    offsets = _offsets(config)
    for name, range_2 in ranges.items():
        key = f"robot.search.ranges.{name}"
        if name not in _NUMBERS and name not in offsets:
            raise UserError(f"{key}: {unknown_name('number', name, [*_NUMBERS, *offsets])}")
        range_2 = typed_value(Range, range_2, key)
        low, high = _NUMBERS.get(name, (-1e3, 1e3))
        if range_2[0] < low or range_2[1] > high:
            raise UserError(f"{key}: must lie within [{low}, {high}], found {list(range_2)}")


def _offsets(config: ManualScaleConfig) -> dict[str, list[tuple[str, int, int]]]:
    """What KEYPOINT.AXIS stands for: keypoints, the axis' place, and the sign; without a side both, y mirrored."""
    both = {name: list(zip(pair, (1, -1), strict=True)) for name, pair in PAIRED_KEYPOINTS.items()}
    found = {}
    for part, keypoints in ({name: [(name, 1)] for name in config.keypoints} | both).items():
        for place, axis in enumerate(_AXES):
            given = [(name, place, sign if axis == "y" else 1) for name, sign in keypoints if name in config.keypoints]
            if given:
                found[f"{part}.{axis}"] = given
    return found
