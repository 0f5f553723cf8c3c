"""Writes the motions that ship with mrhubo, beside this file: `python data/motions/make.py [folder]`.

Each is a list of key poses. An arm is written as where the upper arm, the forearm and the palm point: (out, up,
forward) in the chest's frame, so that one pose serves both sides. Torso: lean forward, lean left, turn left; head: nod,
tilt left, turn left [deg]; stance [cm]; times [s].
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from mrhubo.body.skeleton import POSED_JOINT_NAMES
from mrhubo.motion import write_motion
from mrhubo.motion.authoring.key_poses import Arm, Key, Performance, perform
from mrhubo.motion.authoring.stance import Stance

FRAME_RATE = 60.0

HANG = Arm(upper=(0.17, -1, -0.04), fore=(0.10, -1, 0.24), palm=(-1, 0, -0.25), wrist=(8, 0))
CALM = Stance(left=1.0)


def rest(time: float, hold: float = 0.0) -> Key:
    """Standing, arms hanging."""
    return Key(time, HANG, HANG, torso=(0, 0, 0), head=(2, 0, 0), stance=CALM, hold=hold)


def wave() -> list[Key]:
    """The right hand goes up and waves, six times."""
    out = Arm(upper=(0.85, -0.28, 0.45), fore=(0.62, 1, 0.30), palm=(0, 0, 1), wrist=(-6, 10))
    side = Arm(upper=(0.80, -0.30, 0.50), fore=(-0.22, 1, 0.34), palm=(0.1, 0, 1), wrist=(2, -14))
    keys = [rest(0, hold=0.4), Key(1.35, right=out, torso=(-1, 3, -4), head=(-2, -5, -6), stance=Stance(left=3))]
    for swing in range(6):
        keys.append(Key(1.75 + 0.6 * swing, right=side))
        keys.append(Key(2.05 + 0.6 * swing, right=replace(out, upper=(0.86, -0.26, 0.43 - 0.01 * swing))))
    keys.append(Key(5.1, torso=(1, 1, -2), head=(6, 3, -3), stance=Stance(left=2)))
    return [*keys, rest(6.6, hold=0.6)]


def boxing() -> list[Key]:
    """Guard; jab, cross, left hook, right uppercut; jab, jab, cross."""
    guard = Arm(upper=(0.10, -0.78, 0.62), fore=(-0.36, 0.90, 0.38), palm=(-0.9, 0, -0.4))
    straight = Arm(upper=(0.10, -0.02, 1), fore=(-0.06, 0.09, 1), palm=(-0.2, -1, 0), wrist=(0, -3))
    loaded = Arm(upper=(0.80, -0.35, 0.42), fore=(-0.25, 0.60, 0.80), palm=(-0.7, -0.4, 0))
    hook = Arm(upper=(0.30, 0.05, 0.95), fore=(-0.95, 0.02, 0.33), palm=(0, -1, -0.3))
    dropped = Arm(upper=(0.14, -0.97, -0.05), fore=(-0.12, 0.10, 1), palm=(-0.6, 0.8, 0))
    upper = Arm(upper=(0.08, -0.42, 0.90), fore=(-0.22, 0.85, 0.46), palm=(-0.35, 0, -1))
    low = Stance(sink=5)
    ready = Key(0, guard, guard, torso=(8, 0, -8), head=(0, 0, 6), stance=low)

    def at(time: float, **changes) -> Key:
        return replace(ready, time=time, **changes)

    def jab(time: float) -> list[Key]:
        out = at(time + 0.34, left=straight, torso=(10, 0, -24), head=(0, 0, 20), stance=Stance(6, 1, 4))
        return [at(time), out, at(time + 0.75)]

    def cross(time: float) -> list[Key]:
        out = at(time + 0.38, right=straight, torso=(12, 0, 26), head=(0, 0, -22), stance=Stance(7, 3, 6))
        return [at(time), out, at(time + 0.85)]

    return [
        rest(0, hold=0.2),
        at(1.0, hold=0.3),
        *jab(1.45)[1:],
        *cross(2.3),
        at(3.6, left=loaded, torso=(8, 4, 20), head=(0, 0, -16), stance=Stance(8, 4, 0)),
        at(4.0, left=hook, torso=(9, -2, -26), head=(0, 0, 22), stance=Stance(6, -2, 2)),
        at(4.5),
        at(4.9, right=dropped, torso=(14, -8, -22), head=(-6, 4, 18), stance=Stance(10, -4, 0)),
        at(5.3, right=upper, torso=(4, 0, 22), head=(0, 0, -18), stance=Stance(4, 2, 3)),
        at(5.85),
        *jab(6.1)[1:],
        *jab(6.9)[1:],
        *cross(7.7)[1:],
        at(8.6, hold=0.2),
        rest(9.7, hold=0.3),
    ]


def stretch() -> list[Key]:
    """Both arms rise over the sides to overhead, the body stretches, leans left and right, and the arms come down."""
    level = Arm(upper=(1, 0.02, 0.10), fore=(1, 0.10, 0.42), palm=(0, -0.9, 0.4))
    turning = Arm(upper=(0.78, 0.66, 0.16), fore=(0.55, 0.85, 0.50), palm=(-0.4, 0, 1))
    overhead = Arm(upper=(0.20, 1, 0.04), fore=(-0.22, 1, 0.20), palm=(-0.6, 0, 0.8), wrist=(-8, 0))
    reach = Arm(upper=(0.12, 1, -0.04), fore=(-0.16, 1, 0.10), palm=(-0.6, 0, 0.8), wrist=(-14, 0))
    keys = [
        rest(0, hold=0.3),
        Key(1.1, level, level, torso=(-2, 0, 0), head=(-4, 0, 0)),
        Key(1.6, turning, turning),
        Key(2.3, overhead, overhead, torso=(-5, 0, 0), head=(-14, 0, 0)),
        Key(3.0, reach, reach, torso=(-7, 0, 0), head=(-20, 0, 0), hold=0.5),
        Key(4.5, overhead, reach, torso=(-1, 20, 0), head=(-4, 8, 0), stance=Stance(left=-3), hold=0.5),
        Key(6.1, reach, overhead, torso=(-1, -20, 0), head=(-4, -8, 0), stance=Stance(left=3), hold=0.5),
        Key(7.5, overhead, overhead, torso=(-3, 0, 0), head=(-6, 0, 0), stance=CALM),
        Key(8.1, turning, turning),
        Key(8.6, level, level),
    ]
    return [*keys, rest(9.7, hold=0.3)]


def crossing_arms() -> list[Key]:
    """The arms open wide, cross before the chest, open, and fold."""
    wide = Arm(upper=(0.98, -0.10, 0.15), fore=(0.95, 0.10, 0.55), palm=(-0.3, 0.2, 1))
    far = Arm(upper=(-0.16, -0.48, 0.88), fore=(-0.72, 0.48, 0.58), palm=(-0.5, -0.4, -0.8))
    near = Arm(upper=(-0.12, -0.72, 0.66), fore=(-0.80, 0.58, 0.24), palm=(-0.4, -0.4, -0.8))
    forward = Arm(upper=(0.40, -0.55, 0.75), fore=(0.05, 0.35, 1), palm=(-1, -0.2, 0))
    under = Arm(upper=(0.10, -0.90, 0.42), fore=(-0.98, -0.03, 0.14), palm=(0, -0.35, -1), wrist=(8, 0))
    over = Arm(upper=(0.14, -0.78, 0.60), fore=(-0.86, 0.40, 0.24), palm=(0, -0.6, -1), wrist=(10, 0))
    return [
        rest(0, hold=0.3),
        Key(1.2, wide, wide, torso=(-3, 0, 0), head=(-4, 0, 0), stance=CALM),
        Key(2.05, left=near, hold=0.8),
        Key(2.3, right=far, torso=(5, 0, 2), head=(8, 0, 0), hold=0.4),
        Key(3.7, wide, wide, torso=(-3, 0, 0), head=(-3, 0, 0)),
        Key(4.45, right=near, hold=0.75),
        Key(4.7, left=far, torso=(5, 0, -2), head=(8, 0, 0), hold=0.2),
        Key(5.75, forward, forward, torso=(2, 0, 0), head=(2, 0, 0)),
        Key(6.55, left=under, hold=1.4),
        Key(6.75, right=over, torso=(-1, 0, 3), head=(0, 4, -10), stance=Stance(left=-3), hold=1.0),
        Key(8.6, forward, forward, torso=(2, 0, 0), head=(2, 0, 0)),
        rest(9.7, hold=0.3),
    ]


def drinking() -> list[Key]:
    """The right hand takes a cup from a table, drinks twice, and puts it back."""
    over = Arm(upper=(0.20, -0.82, 0.50), fore=(-0.20, 0.20, 1), palm=(-1, -0.2, 0), wrist=(-10, 0))
    grasp = Arm(upper=(0.06, -0.76, 0.65), fore=(-0.22, -0.26, 0.94), palm=(-1, -0.1, 0), wrist=(10, 6))
    lift = Arm(upper=(0.18, -0.82, 0.55), fore=(-0.35, 0.45, 0.82), palm=(-1, 0.1, -0.3), wrist=(14, 8))
    lips = Arm(upper=(0.22, -0.54, 0.80), fore=(-0.74, 0.70, -0.02), palm=(-0.3, -0.3, -1), wrist=(14, 12))
    sip = Arm(upper=(0.36, -0.28, 0.86), fore=(-0.84, 0.66, -0.20), palm=(-0.4, -0.9, -0.4), wrist=(16, 14))
    looking, up = (16, 0, -6), (-6, 0, 0)
    return [
        rest(0, hold=0.3),
        Key(0.9, right=over, torso=(3, 0, 2), head=looking),
        Key(1.5, right=grasp, torso=(7, 0, 5), head=looking, stance=Stance(left=-2, forward=1), hold=0.35),
        Key(2.5, right=lift, torso=(2, 0, 1), head=(8, 0, -3)),
        Key(3.1, right=lips, torso=(0, 0, 0), head=(2, 0, -2), stance=CALM),
        Key(3.7, right=sip, torso=(-4, 0, 0), head=(-14, 0, 0), hold=0.5),
        Key(4.8, right=lips, torso=(-1, 0, 0), head=up, hold=0.3),
        Key(5.7, right=sip, torso=(-5, 0, 0), head=(-18, 0, 0), hold=0.6),
        Key(6.9, right=lips, torso=(0, 0, 0), head=(2, 0, -2)),
        Key(7.4, right=lift, head=(8, 0, -3)),
        Key(8.2, right=grasp, torso=(7, 0, 5), head=looking, stance=Stance(left=-2, forward=1), hold=0.25),
        Key(8.9, right=over, torso=(3, 0, 2), head=(6, 0, 0)),
        rest(9.7, hold=0.3),
    ]


def directing_traffic() -> list[Key]:
    """Stop to the left; beckon those on the right through, three times; then everyone stops; then go straight on."""
    stop = Arm(upper=(0.88, 0.05, 0.48), fore=(0.62, 0.30, 0.72), palm=(0.6, -0.5, 0.9), wrist=(-50, 0))
    ahead = Arm(upper=(0.22, 0.05, 1), fore=(0.02, 0.32, 1), palm=(0, -0.5, 1), wrist=(-55, 0))
    side = Arm(upper=(0.97, -0.05, 0.24), fore=(0.92, 0.08, 0.48), palm=(-0.2, -0.2, 0.9))
    beckon = Arm(upper=(0.95, 0.02, 0.32), fore=(-0.45, 0.75, 0.55), palm=(-1, 0, 0.1), wrist=(15, 0))
    raised = Arm(upper=(0.45, 0.80, 0.42), fore=(0.10, 1, 0.32), palm=(0, 0, 1), wrist=(-4, 0))
    keys = [
        rest(0, hold=0.2),
        Key(1.1, left=stop, torso=(0, 0, 8), head=(0, 0, 42), stance=Stance(left=-2), hold=0.4),
        Key(1.6, right=HANG),
        Key(2.5, right=side, torso=(0, 0, -6), head=(0, 0, -46), stance=Stance(left=2)),
    ]
    for turn in range(3):
        keys.append(Key(3.0 + 0.9 * turn, right=beckon, head=(0, 0, -40)))
        keys.append(Key(3.45 + 0.9 * turn, right=side, head=(0, 0, -46)))
    keys += [
        Key(4.9, left=stop),
        Key(6.2, ahead, raised, torso=(-1, 0, 0), head=(0, 0, 0), stance=CALM, hold=0.9),
        Key(8.0, left=side, right=side, head=(0, 0, 12), hold=0.4),
    ]
    return [*keys, rest(9.6, hold=0.3)]


def bow_and_greet() -> list[Key]:
    """A bow with the right hand on the heart, then both arms open in welcome."""
    heart = Arm(upper=(0.25, -0.90, 0.38), fore=(-0.85, 0.50, 0.18), palm=(0, -0.5, -1), wrist=(6, 0))
    seam = Arm(upper=(0.20, -1, 0.20), fore=(0.10, -1, 0.40), palm=(-1, 0, -0.2), wrist=(4, 0))
    gather = Arm(upper=(0.22, -0.90, 0.40), fore=(-0.35, 0.18, 0.92), palm=(-0.7, 0.6, 0))
    welcome = Arm(upper=(0.60, -0.75, 0.28), fore=(0.62, 0.12, 0.80), palm=(-0.5, 1, 0.2), wrist=(-10, 0))
    return [
        rest(0, hold=0.3),
        Key(1.2, left=HANG, right=heart, head=(4, 0, 0), torso=(1, 0, 0)),
        Key(2.4, left=seam, torso=(42, 0, 0), head=(12, 0, 0), stance=Stance(sink=0.5), hold=0.7),
        Key(4.4, left=HANG, right=heart, torso=(0, 0, 0), head=(0, 0, 0), stance=CALM),
        Key(5.1, gather, gather, torso=(1, 0, 0)),
        Key(5.9, welcome, welcome, torso=(-3, 0, 0), head=(-4, 4, 0), stance=Stance(forward=1), hold=0.7),
        rest(7.8, hold=0.4),
    ]


def pointing() -> list[Key]:
    """The right arm points ahead, up and to the right; the left arm to the left and behind."""
    ready = Arm(upper=(0.30, -0.85, 0.35), fore=(-0.05, 0.40, 0.90), palm=(-1, 0, 0))
    ahead = Arm(upper=(0.02, -0.10, 1), fore=(-0.12, 0.10, 1), palm=(-0.7, -0.7, 0))
    high = Arm(upper=(0.50, 0.45, 0.70), fore=(0.36, 0.80, 0.62), palm=(-0.5, -0.5, 0.6))
    right = Arm(upper=(0.98, -0.04, 0.16), fore=(0.95, 0.06, 0.40), palm=(0, -0.9, 0.4))
    left = Arm(upper=(0.90, -0.06, 0.40), fore=(0.72, 0.06, 0.68), palm=(0, -0.9, 0.3))
    back = Arm(upper=(1, 0.0, -0.14), fore=(1, 0.12, 0.16), palm=(0, -0.9, 0.4))
    return [
        rest(0, hold=0.3),
        Key(0.8, right=ready),
        Key(1.4, right=ahead, torso=(3, 0, 8), head=(2, 0, -6), stance=Stance(forward=2), hold=0.5),
        Key(2.9, right=high, torso=(-3, 0, -6), head=(-18, 0, -22), stance=Stance(left=2), hold=0.5),
        Key(4.4, right=right, torso=(0, 0, -14), head=(0, 0, -48), stance=Stance(left=-2), hold=0.4),
        Key(4.8, left=HANG),
        Key(5.7, right=HANG, torso=(0, 0, 4), head=(2, 0, 10)),
        Key(5.9, left=left, torso=(0, 0, 10), head=(2, 0, 34), stance=Stance(left=1), hold=0.3),
        Key(7.1, left=back, torso=(0, 0, 24), head=(0, 0, 50), stance=Stance(left=3), hold=0.5),
        rest(9.0, hold=0.3),
    ]


def conversation() -> list[Key]:
    """Someone explains: small beats of both hands, one thing here and another there, a thought at the chin, a shrug."""
    low = Arm(upper=(0.22, -0.93, 0.27), fore=(-0.25, 0.02, 0.95), palm=(-0.8, 0.5, 0))
    beat = Arm(upper=(0.26, -0.90, 0.32), fore=(-0.12, 0.30, 0.95), palm=(-0.7, 0.6, 0), wrist=(-8, 0))
    here = Arm(upper=(0.46, -0.82, 0.34), fore=(0.40, 0.22, 0.90), palm=(-0.5, 0.8, 0), wrist=(-8, 0))
    chin = Arm(upper=(0.10, -0.80, 0.56), fore=(-0.57, 0.78, 0.18), palm=(-0.6, 0, -0.8), wrist=(20, 0))
    prop = Arm(upper=(0.10, -0.94, 0.30), fore=(-0.93, 0.05, 0.36), palm=(0, 0.2, -1))
    shrug = Arm(upper=(0.50, -0.86, 0.10), fore=(0.68, 0.38, 0.66), palm=(-0.4, 1, 0.3), wrist=(-20, 0))
    return [
        rest(0, hold=0.2),
        Key(0.9, low, low, torso=(1, 0, 0), head=(2, 0, 4)),
        Key(1.35, beat, beat, head=(6, 0, 4)),
        Key(1.75, low, low, head=(0, 0, 4)),
        Key(2.15, beat, low, head=(6, 0, 2)),
        Key(2.9, here, low, torso=(0, 2, 10), head=(2, 2, 16), stance=Stance(left=3), hold=0.3),
        Key(4.1, low, here, torso=(0, -2, -10), head=(2, -2, -16), stance=Stance(left=-3), hold=0.3),
        Key(4.9, low, low, torso=(2, 0, 0), head=(4, 0, 0)),
        Key(5.9, prop, chin, torso=(3, 0, 2), head=(10, 5, 8), stance=Stance(left=-2), hold=0.9),
        Key(7.5, low, low, torso=(0, 0, 0), head=(0, 0, 0)),
        Key(8.2, shrug, shrug, torso=(-2, 0, 0), head=(0, 10, 0), stance=CALM, hold=0.5),
        rest(9.7, hold=0.2),
    ]


def arm_sweep() -> list[Key]:
    """Straight arms sweep from the thighs over the front to overhead and back, then out to the sides and back."""
    down = Arm(upper=(0.17, -1, 0.0), fore=(0.16, -1, 0.10), palm=(-1, 0, 0))
    ahead = Arm(upper=(0.10, 0.0, 1), fore=(0.09, 0.10, 1), palm=(-1, 0, 0))
    above = Arm(upper=(0.16, 1, 0.10), fore=(0.14, 1, 0.24), palm=(1, 0, 0))
    side = Arm(upper=(1, 0.0, 0.06), fore=(1, 0.0, 0.18), palm=(0, -1, 0))
    return [
        Key(0, down, down, hold=0.3),
        Key(1.3, ahead, ahead),
        Key(2.4, above, above, hold=0.3),
        Key(3.8, ahead, ahead),
        Key(5.0, down, down, hold=0.3),
        Key(6.6, side, side, hold=0.3),
        Key(8.4, down, down, hold=0.3),
    ]


def side_circles() -> list[Key]:
    """Straight arms out to the sides, whose hands draw four circles."""

    def at(turn: float) -> Arm:
        up, forward = 0.35 * np.sin(2 * np.pi * turn), 0.35 * np.cos(2 * np.pi * turn)
        return Arm(upper=(1, up, forward), fore=(1, up, forward + 0.12), palm=(0, -1, 0))

    keys = [Key(0, HANG, HANG, hold=0.2)]
    for eighth in range(33):
        arm = at(eighth / 8 - 0.25)
        keys.append(Key(1.4 + 0.16 * eighth, arm, arm))
    return [*keys, Key(8.4, HANG, HANG, hold=0.2)]


def hanging_noise() -> list[Key]:
    """Straight arms hang at the sides, and every joint of them trembles by 2 degrees, as video estimators' do."""
    down = Arm(upper=(0.17, -1, 0.0), fore=(0.16, -1, 0.10), palm=(-1, 0, 0))
    return [Key(0, down, down, hold=8.0)]


MOTIONS: tuple[Callable[[], list[Key]], ...] = (
    wave, boxing, stretch, crossing_arms, drinking, directing_traffic, bow_and_greet, pointing, conversation,
)  # fmt: skip


STRAIGHT_ARMS = (arm_sweep, side_circles, hanging_noise)
"""Where a straight elbow leaves the twist of the arm open: apart from the others, whose mean tells what to expect."""
TREMBLING_DEG = 2.0


def main(folder: Path) -> None:
    """Writes every motion to `folder`. Rounding to 1e-5 rad hides what differs between machines."""
    for seed, motion in enumerate(MOTIONS):
        write(folder, motion, perform(motion(), FRAME_RATE, seed))
    for seed, motion in enumerate(STRAIGHT_ARMS):
        done = straightened(perform(motion(), FRAME_RATE, seed))
        write(folder / "straight_arms", motion, trembling(done) if motion is hanging_noise else done)


def write(folder: Path, motion: Callable[[], list[Key]], done: Performance) -> None:
    """One file."""
    folder.mkdir(exist_ok=True)
    numbers = [np.round(a, 5) for a in (done.pose_body_T63, done.root_orient_T3, done.trans_T3)]
    description = " ".join((motion.__doc__ or "").split())
    write_motion(folder / f"{motion.__name__}.npz", *numbers, frame_rate=FRAME_RATE, description=description)
    print(f"{motion.__name__}: {len(numbers[0]) / FRAME_RATE:.1f} s")


def straightened(done: Performance) -> Performance:
    """The motion with elbows that never bend."""
    pose_TJ3 = done.pose_body_T63.reshape(-1, 21, 3).copy()
    pose_TJ3[:, [POSED_JOINT_NAMES.index(f"{side}_elbow") for side in ("left", "right")]] = 0.0
    return replace(done, pose_body_T63=pose_TJ3.reshape(-1, 63))


def trembling(done: Performance) -> Performance:
    """The motion with noise in every frame and joint of the arms, normally distributed about each axis."""
    arms = [i for i, name in enumerate(POSED_JOINT_NAMES) if name.endswith(("shoulder", "elbow", "wrist"))]
    pose_TJ3 = done.pose_body_T63.reshape(-1, 21, 3).copy()
    noise = np.random.default_rng(0).normal(size=(len(pose_TJ3), len(arms), 3)) * np.radians(TREMBLING_DEG)
    for place, joint in enumerate(arms):
        turned = Rotation.from_rotvec(pose_TJ3[:, joint]) * Rotation.from_rotvec(noise[:, place])
        pose_TJ3[:, joint] = turned.as_rotvec()
    return replace(done, pose_body_T63=pose_TJ3.reshape(-1, 63))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
