"""SMPL parameters in tables of text."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrhubo.body.rest_directions import from_family
from mrhubo.errors import UserError
from mrhubo.motion import Motion, ReadOptions, read_motion
from tests.motion.damage import altered_words, damaged_by, read_or_refused
from tests.motion.readers.estimator_files import made_up, matrices, padded

FRAMES = 12
POSES = {person: made_up(FRAMES, seed=person) for person in (0, 1)}
AXES = "xyz"


def columns(person: int, form: str, joints: int) -> dict[str, np.ndarray]:
    """The columns of somebody, in the manner of one writer or another."""
    pose = POSES[person]
    place = np.tile([person, 0.9, 0.0], (FRAMES, 1)) + np.linspace(0, 1, FRAMES)[:, None] * [0, 0, 1]
    found: dict[str, np.ndarray] = {}
    if form == "flat":
        row = padded(pose, joints)
        found |= {f"pose_{n}": row[:, n] for n in range(3 * joints)}
        found |= {f"trans_{n}": place[:, n] for n in range(3)}
    elif form == "brackets":
        row = padded(pose, joints)
        found |= {f"smpl_pose[{n}]": row[:, n] for n in range(3 * joints)}
        found |= {f"transl[{n}]": place[:, n] for n in range(3)}
    else:
        found |= {f"global_orient_{axis}": pose[:, 0, n] for n, axis in enumerate(AXES)}
        found |= {
            f"body_pose_{joint}_{axis}": pose[:, 1 + joint, n] for joint in range(21) for n, axis in enumerate(AXES)
        }
        found |= {f"transl_{axis}": place[:, n] for n, axis in enumerate(AXES)}
    return found | {f"betas_{n}": np.full(FRAMES, 0.1) for n in range(10)}


def table(told: dict[str, np.ndarray], separator: str = ",", point: str = ".", rows: list[int] | None = None) -> str:
    lines = [separator.join(f"{told[name][t]}".replace(".", point) for name in told) for t in rows or range(FRAMES)]
    return "\n".join([separator.join(told), *lines]) + "\n"


def is_it(motion: Motion, person: int, frames: list[int] | None = None) -> bool:
    frames = list(range(FRAMES)) if frames is None else frames
    expected = matrices(POSES[person][frames, 1:])
    expected = from_family(expected, motion.family) if motion.family else expected
    place_T3 = motion.arrays.root_position_T3
    assert place_T3 is not None and round(float(place_T3[0, 0])) == person
    return len(motion) == len(frames) and np.allclose(motion.arrays.local_TJ33, expected, atol=1e-4)


@given(
    form=st.sampled_from(("flat", "brackets", "axes")),
    joints=st.sampled_from((22, 24, 52, 55)),
    between=st.sampled_from(((",", "."), (";", ","), ("\t", "."))),
    order=st.randoms(use_true_random=False),
)
def test_columns_in_any_order_are_read(
    form: str, joints: int, between: tuple[str, str], order, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("table") / "a.csv"
    told = columns(1, form, joints) | {"time": np.arange(FRAMES) / 25}
    names = list(told)
    order.shuffle(names)
    path.write_text(table({name: told[name] for name in names}, *between))
    motion = read_motion(path)
    assert motion.frame_rate == 25 and is_it(motion, 1) and motion.betas is not None and len(motion.betas) == 10


def test_lines_of_several_people_and_gaps(tmp_path: Path) -> None:
    told = {
        name: np.stack([one, columns(1, "flat", 24)[name]], axis=1).reshape(-1)
        for name, one in columns(0, "flat", 24).items()
    }
    told |= {"frame": np.repeat(np.arange(FRAMES), 2), "person_id": np.tile([3, 7], FRAMES)}
    (tmp_path / "a.csv").write_text(table(told, rows=[*range(2 * FRAMES)]))
    for person, name in enumerate(("3", "7")):
        assert is_it(read_motion(tmp_path / "a.csv", ReadOptions(rate=30, person=name)), person)
    one = columns(0, "flat", 24) | {"frame": np.arange(FRAMES)}
    (tmp_path / "a.csv").write_text(table(one, rows=[t for t in range(FRAMES) if t not in (3, 4)]))
    motion = read_motion(tmp_path / "a.csv", ReadOptions(rate=30))
    assert len(motion) == FRAMES and "not seen in 2 of 12 frames" in motion.notes[0]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: text.splitlines()[0], "no frames"),
        (lambda text: text.rsplit(",", 1)[0] + "\n", "columns"),
        (lambda text: text.replace("pose_0,", "pose_0,", 1).replace("\n", "\nabc", 1), "no number"),
    ],
)
def test_tables_that_are_refused(change, words: str, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(change(table(columns(0, "flat", 24))))
    with pytest.raises(UserError, match=words):
        read_motion(tmp_path / "a.csv", ReadOptions(rate=30))


def test_damaged_tables_are_read_or_refused_in_a_sentence(tmp_path: Path) -> None:
    good = table(columns(0, "flat", 24), rows=[0, 1, 2, 3]).encode()
    for seed in range(60):
        (tmp_path / "damaged.csv").write_bytes(altered_words(seed, good) if seed % 2 else damaged_by(seed, good, good))
        read_or_refused(tmp_path / "damaged.csv")
