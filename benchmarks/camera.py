"""What it costs to see a person by one camera: the estimator's own error, and its time.

    python benchmarks/camera.py [--motions FOLDER] [--seconds 4] [--views 0,45,90] [--models lite,full,heavy]

Motions are by default those that measure a fit. From the middle of each so many seconds are drawn, frame by frame, as
a figure of capsules that turns as the person does, and stands, in the first frame, turned by so many degrees from the
camera. What the estimator finds in the pictures is read as a video's motion is, and compared with the motion that was
drawn. It is an error of pictures that are clean, and of a figure that is no human.

Errors are angles between limbs, arms and head seen from the chest and legs from the pelvis, as networks read them:
means over frames and sides, and the 95th percentile over all limbs. `true points` is what an estimator without any
error would get; what goes beyond is the estimator's. `jitter` is by how much a limb's direction changes its speed from
frame to frame, on the mean; `drawn` is that of the motion itself. `smoothed` is MediaPipe's One-Euro filter, `prior`
what the body prior makes of the estimator's poses.

Legend: T frames, J joints, L limbs, K keypoints.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
from common import print_header, print_table, read_options
from torch import Tensor
from torch.nn.functional import normalize

from mrhubo.body import KEYPOINT_NAMES, BodyPrior, Skeleton
from mrhubo.body.skeleton import JOINT_NAMES, SIDES
from mrhubo.errors import UserError
from mrhubo.motion import Motion, find_motions, read_folder, trim
from mrhubo.motion.orientations import rest_points
from mrhubo.motion.readers.keypoint_sets import SETS
from mrhubo.motion.readers.video import motion_of_track
from mrhubo.reference import angle_between
from mrhubo.rotation import matrix_to_sixd
from mrhubo.runtime.locations import default_motions
from mrhubo.video import PoseEstimator
from mrhubo.video.smoothing import smoothed
from mrhubo.video.track import Track
from mrhubo.view import Camera, human_solids, render

BACKGROUND = (0.55, 0.60, 0.55)
LIMBS = {
    "upper arm": ("spine3", "shoulder", "elbow"),
    "forearm": ("spine3", "elbow", "wrist"),
    "thigh": ("pelvis", "hip", "knee"),
    "shin": ("pelvis", "knee", "ankle"),
}
"""The part from which each is seen, where it starts and where it ends."""
HEAD = ("nose", "left_ear", "right_ear")
PARTS = (*LIMBS, "head")


def middle_of(motion: Motion, seconds: float) -> Motion:
    """So many seconds from the middle of a motion, or all of it."""
    start = max(0.0, ((len(motion) - 1) / motion.frame_rate - seconds) / 2)
    return trim(motion, start, start + seconds)


def turned(motion: Motion, degrees: float) -> dict[str, np.ndarray]:
    """Points (T, 3) [m] as a camera sees them: the person stands turned by `degrees` in the first frame, and turns
    from there as in the motion.
    """
    root_T33 = motion.root_rotation_T33
    root_T33 = torch.eye(3).repeat(len(motion), 1, 1) if root_T33 is None else root_T33
    heading = torch.atan2(root_T33[0, 0, 2], root_T33[0, 2, 2])
    way = torch.deg2rad(torch.tensor(degrees)) - heading
    cos, sin = torch.cos(way).item(), torch.sin(way).item()
    root_T33 = torch.tensor([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]]) @ root_T33
    point_TK3, turn_TJ33 = Skeleton().keypoints_and_rotations(motion.local_TJ33)
    rest, head = rest_points(), JOINT_NAMES.index("head")
    places = [torch.from_numpy(rest[name] - rest["head"]).float() for name in HEAD]
    more = [point_TK3[:, [head]] + place_13 @ turn_TJ33[:, head].mT for place_13 in places]
    seen_TK3 = torch.cat([point_TK3, *more], dim=1) @ root_T33.mT
    return dict(zip((*KEYPOINT_NAMES, *HEAD), seen_TK3.numpy().transpose(1, 0, 2), strict=True))


def pictures(points: dict[str, np.ndarray], size: int) -> list[np.ndarray]:
    """The figure of each frame, before one camera that stands still and level."""
    point_TK3 = np.stack([points[name] for name in KEYPOINT_NAMES], axis=1)
    figures = [human_solids(point_K3, KEYPOINT_NAMES) for point_K3 in point_TK3]
    camera = Camera.framing(figures, (size, size), azimuth_deg=0.0, elevation_deg=0.0, margin=0.1)
    return [np.asarray(render(figure, (size, size), camera, BACKGROUND, supersample=1)) for figure in figures]


def found_in(images: Sequence[np.ndarray], rate: float, estimator: PoseEstimator) -> tuple[Track, list[float]]:
    """What the estimator finds, and the CPU time of each picture [s]."""
    estimator.reset()
    points, visible, seconds = [], [], []
    for image_HW3 in images:
        before = time.process_time()
        found = estimator.landmarks(image_HW3)
        seconds.append(time.process_time() - before)
        points.append(found.point_K3)
        visible.append(found.visibility_K)
    return Track(rate, np.stack(points), np.stack(visible)), seconds


def without_error(points: dict[str, np.ndarray], rate: float) -> Track:
    """What an estimator without any error would find; points that nobody reads are not found."""
    nothing_T3 = np.full((len(points["pelvis"]), 3), np.nan)
    true_TK3 = np.stack([points.get(name, nothing_T3) for name in SETS["MediaPipe"]], axis=1)
    return Track(rate, true_TK3, np.ones(true_TK3.shape[:2]))


def directions(local_TJ33: Tensor) -> Tensor:
    """Directions (T, L, 3) of all limbs, left and right, and of the head's way forward, seen from chest or pelvis."""
    point_TK3, turn_TJ33 = Skeleton().keypoints_and_rotations(local_TJ33)
    place, joint = KEYPOINT_NAMES.index, JOINT_NAMES.index
    rows = [
        normalize(point_TK3[:, place(f"{side}_{end}")] - point_TK3[:, place(f"{side}_{start}")], dim=-1)[:, None]
        @ turn_TJ33[:, joint(part)]
        for part, start, end in LIMBS.values()
        for side in SIDES
    ]
    head_T13 = turn_TJ33[:, joint("head"), :, 2][:, None] @ turn_TJ33[:, joint("spine3")]
    return torch.cat([*rows, head_T13], dim=1)


def jitter(direction_TL3: Tensor) -> float:
    """By how much limbs change their speed from frame to frame [deg], on the mean."""
    return float(torch.rad2deg(direction_TL3.diff(n=2, dim=0).norm(dim=-1)).mean())


def row(name: str, found: Sequence[Tensor], drawn: Sequence[Tensor]) -> list[str]:
    """A row of the table of errors: of directions (T, L, 3) of each clip."""
    off_XL = torch.rad2deg(torch.cat([angle_between(a, b) for a, b in zip(found, drawn, strict=True)]))
    by_part = [float(off_XL[:, 2 * place : 2 * place + 2].mean()) for place in range(len(PARTS))]
    last = float(off_XL.flatten().quantile(0.95)), float(np.mean([jitter(one) for one in found]))
    return [name, *(f"{value:.1f}" for value in (*by_part, float(off_XL.mean()), *last))]


def main(argv: list[str]) -> None:
    """The program."""
    options, _ = read_options(argv, motions="", seconds="4", views="0,45,90", models="lite,full,heavy", size="480")
    folder = Path(options["motions"]) if options["motions"] else find_motions(default_motions())
    clips = [middle_of(motion, float(options["seconds"])) for motion in read_folder(folder)]
    estimators = {name: PoseEstimator(name) for name in options["models"].split(",")}
    prior = BodyPrior.open()
    print_header()
    print(f"{sum(map(len, clips)):,} frames of {len(clips)} clips from {folder}, {options['size']} pixels\n")
    times: dict[str, list[float]] = {name: [] for name in estimators}
    columns = ["model", *(f"{part} [deg]" for part in PARTS), "mean [deg]", "95% [deg]", "jitter [deg]"]
    for view in options["views"].split(","):
        found: dict[str, list[Tensor]] = {}
        drawn, lost, frames = [], dict.fromkeys(estimators, 0), 0
        for clip in clips:
            points = turned(clip, float(view))
            images = pictures(points, int(options["size"]))
            drawn.append(directions(clip.local_TJ33))
            found.setdefault("true points", []).append(
                directions(pose_of(clip.name, without_error(points, clip.frame_rate)))
            )
            frames += len(clip)
            for name, estimator in estimators.items():
                track, seconds = found_in(images, clip.frame_rate, estimator)
                times[name] += seconds[2:]  # the first two look for the person, and wake the network
                lost[name] += int((~track.seen_T).sum())
                calm = Track(track.rate, smoothed(track.point_TK3, track.rate), track.visibility_TK)
                for kind, one in ((name, track), (f"{name}, smoothed", calm)):
                    local_TJ33 = pose_of(clip.name, one)
                    with torch.no_grad():
                        cleaned_TJ33 = prior.decode_matrices(prior.encode(matrix_to_sixd(local_TJ33)))
                    found.setdefault(kind, []).append(directions(local_TJ33))
                    found.setdefault(f"{kind}, prior", []).append(directions(cleaned_TJ33))
        rows = [row(name, directions_of, drawn) for name, directions_of in found.items()]
        print(f"person turned by {view} degrees; nobody found: "
              + ", ".join(f"{name} {count} of {frames:,} frames" for name, count in lost.items()) + "\n")  # fmt: skip
        print_table(columns, [*rows, row("drawn", drawn, drawn)])
        print()
    rows = [[name, f"{1000 * np.median(s):.1f}", f"{1000 * np.quantile(s, 0.99):.1f}"] for name, s in times.items()]
    print_table(["model", "CPU time of a frame [ms]", "99% [ms]"], rows)


def pose_of(name: str, track: Track) -> Tensor:
    """Local rotations (T, 21, 3, 3) of a track; the rest pose where nobody is found at all."""
    try:
        return motion_of_track(name, track, "", ()).local_TJ33
    except UserError:
        return torch.eye(3).repeat(len(track.point_TK3), 21, 1, 1)


if __name__ == "__main__":
    main(sys.argv[1:])
