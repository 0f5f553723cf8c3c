"""Joint angles of human poses, by the networks of a package of mrhubo, with nothing but NumPy.

    angles = load("NAME.npz")(poses)            poses: local rotations (frames, 21, 3, 3) of SMPL's joints 1..21
    python NAME.py poses.npy angles.npy         the same with files; the weights NAME.npz lie beside NAME.py

Written by mrhubo; licence of the code: Apache-2.0. x to the body's left, y up, z forward, T-pose at
rest; angles in rad, inside the limits, in the order of `load(...).joint_names`. Each frame is answered by itself.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np

# erf(x) = x P(x^2) / Q(x^2), within 3e-8 up to |x| = 4, and +-1 beyond.
_TOP = (1.974827287362027e-06, 0.00028803932033508314, 0.004003595034881348, 0.053467330137303405,
        0.19624791356658905, 1.1283789765461936)  # fmt: skip
_BOTTOM = (3.7480720233753056e-05, 0.001216345537898967, 0.015444325421374245, 0.11647597831624709,
           0.5072513450242637, 1.0)  # fmt: skip


class Retargeter:
    """Networks of one robot. A call takes poses (frames, 21, 3, 3), or a single one, and gives joint angles [rad]."""

    def __init__(self, arrays: dict[str, np.ndarray]) -> None:
        self.arrays, self.meaning = arrays, json.loads(str(arrays["meaning"]))
        self.settings = json.loads(str(arrays["settings"]))
        self.joint_names = json.loads(self.meaning["joint_names"])

    def __call__(self, poses: np.ndarray) -> np.ndarray:
        """Joint angles (frames, joints) [rad]."""
        poses = np.asarray(poses, np.float32)
        if poses.shape == (21, 3, 3):
            return self(poses[None])[0]
        if poses.shape[1:] != (21, 3, 3) or not np.isfinite(poses).all():
            raise ValueError(f"poses must be finite, of shape (frames, 21, 3, 3); found {poses.shape}")
        if self.settings["features"] == "directions":
            return self.of_directions(self.directions(poses))
        columns = poses[:, self.arrays["features.input_I"], :, :2].swapaxes(-1, -2)
        return self._joints([columns])

    def of_directions(self, directions: np.ndarray) -> np.ndarray:
        """Joint angles (frames, joints) [rad] of directions (frames, D, 3), as `directions` gives them."""
        a = {name[9:]: array for name, array in self.arrays.items() if name.startswith("features.")}
        vectors = np.asarray(directions, np.float64)[:, a["input_I"]]
        bends, unit = vectors[:, a["bend_W"]], vectors.copy()
        plane = _unit(np.cross(vectors[:, a["upper_W"]], vectors[:, a["lower_W"]]))
        bends = bends + np.maximum(1 - np.linalg.norm(bends, axis=-1, keepdims=True), 0) * plane
        unit[:, a["bend_W"]] = bends
        cosines = (unit[:, a["first_O"]] * unit[:, a["second_O"]]).sum(-1)
        along, axis, seen = (unit[:, a[f"{name}_M"]] for name in ("limb", "axis", "seen"))
        axis = _unit(axis - along * (along * axis).sum(-1, keepdims=True))
        views = np.stack([(seen * view).sum(-1) for view in (along, axis, np.cross(along, axis))], axis=-1)
        return self._joints([vectors, bends, cosines, views])

    def directions(self, poses: np.ndarray) -> np.ndarray:
        """Where limbs, hands, head and elbow axes point (frames, D, 3), each in the axes of the part that sees it."""
        a = self.arrays
        columns = poses[:, a["human.joint_P"], :, :2].astype(np.float64)
        x = _unit(columns[..., 0])
        y = columns[..., 1] - x * (x * columns[..., 1]).sum(-1, keepdims=True)
        y = _unit(y - x * (x * y).sum(-1, keepdims=True))
        turns = np.stack((x, y, np.cross(x, y)), axis=-1)
        places = [np.broadcast_to(np.eye(3), (len(poses), 3, 3))]
        for joint, parent in enumerate(a["human.parent_P"]):
            places.append(places[parent] @ turns[:, joint])
        placed = np.stack(places, axis=1)
        found = (placed[:, a["human.place_D"]] @ a["human.rest_D3"][..., None])[..., 0]
        if len(a["human.bend_Z"]):
            upper, lower, own = (found[:, a[f"human.{name}_Z"]] for name in ("upper", "lower", "bend"))
            found[:, a["human.bend_Z"]] = self._bend_axes(upper, lower, own)
        views = placed[:, a["human.view_V"][a["human.seen_D"]]]
        return (found[:, :, None] @ views)[:, :, 0]

    def _bend_axes(self, upper: np.ndarray, lower: np.ndarray, own: np.ndarray) -> np.ndarray:
        """About which axis elbows bend: that of the two limbs, and where these are straight, the upper arm's own."""
        across = np.cross(upper, lower)
        bend = np.degrees(np.arctan2(np.linalg.norm(across, axis=-1), (upper * lower).sum(-1)))[..., None]
        plane, needed = self._rising(bend, "plane"), 1 - self._rising(bend, "needed")
        own = _unit(own - upper * (upper * own).sum(-1, keepdims=True))
        return needed * (plane * _unit(across) + (1 - plane) * own)

    def _rising(self, angle: np.ndarray, name: str) -> np.ndarray:
        low, high = (self.settings["constants"][f"{name}_{end}_deg"] for end in ("low", "high"))
        share = np.clip((angle - low) / (high - low), 0, 1)
        return share * share * (3 - 2 * share)

    def _joints(self, seen: list[np.ndarray]) -> np.ndarray:
        flat = np.concatenate([part.reshape(len(part), int(np.prod(part.shape[1:]))) for part in seen], axis=1)
        x = (flat.astype(np.float32) - self.arrays["features.center_F"]) * self.arrays["features.scale_F"]
        for stage in ("pre", "post"):
            if f"{stage}.0.input" in self.arrays:
                x = self._stage(stage, x)
        lower, upper = (np.array(json.loads(self.meaning[name]), np.float32) for name in ("lower_rad", "upper_rad"))
        share = np.tanh(x) if self.settings["bound"] == "tanh" else x
        return np.clip((upper + lower) / 2 + (upper - lower) / 2 * share, lower, upper)

    def _stage(self, stage: str, x: np.ndarray) -> np.ndarray:
        """One network after the other, each of which sees some columns and gives some."""
        found, part = {}, 0
        while (name := f"{stage}.{part}") + ".input" in self.arrays:
            y, layer = x[:, self.arrays[name + ".input"]], 0
            while (place := f"{name}.layers.{layer}") + ".weight" in self.arrays:
                z = (_gelu(y) if layer else y) @ self.arrays[place + ".weight"].T + self.arrays[place + ".bias"]
                last = f"{name}.layers.{layer + 1}.weight" not in self.arrays
                y, layer = (y + z if self.settings["residual"] and layer and not last else z), layer + 1
            found |= dict(zip(self.arrays[name + ".output"].tolist(), y.T, strict=True))
            part += 1
        return np.stack([found[column] for column in sorted(found)], axis=1)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)


def _gelu(x: np.ndarray) -> np.ndarray:
    z = np.clip(x * np.float32(np.sqrt(0.5)), -4, 4)
    top, bottom = (np.polyval(np.array(c, np.float32), z * z) for c in (_TOP, _BOTTOM))
    return (x * (1 + z * top / bottom) / 2).astype(np.float32)


def load(path: str | Path) -> Retargeter:
    """The networks of a file of weights."""
    with np.load(path, allow_pickle=False) as file:
        return Retargeter({name: file[name] for name in file.files})


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(f"usage: python {sys.argv[0]} poses.npy angles.npy")
    try:
        retargeter = load(Path(__file__).with_suffix(".npz"))
        np.save(sys.argv[2], retargeter(np.load(sys.argv[1], allow_pickle=False)))
    except Exception as error:
        print(f"error: {' '.join(f'{type(error).__name__}: {error}'.split())}", file=sys.stderr)
        sys.exit(2)
