"""Which name is near enough to be suggested."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrhubo.errors import encodable, nearest, unknown_name

PARTS = ["chest", "head", "left_elbow", "left_hand", "left_shoulder", "left_wrist", "right_hand", "right_wrist"]
KEYS = [
    "accelerator", "batch_size", "loss", "lr", "max_steps", "muon_lr", "optimizer", "precision", "seed",
    "validate_every", "weight_decay",
]  # fmt: skip


@pytest.mark.parametrize(
    ("name", "names", "near"),
    [
        ("left_elbo", PARTS, "left_elbow"),
        ("left_ebwo", PARTS, "left_elbow"),  # swapped, and one is missing
        ("haed", PARTS, "head"),  # swapped
        ("leftelbow", PARTS, "left_elbow"),
        ("LeftElbow", PARTS, "left_elbow"),
        ("left-elbow", PARTS, "left_elbow"),
        ("elbow", PARTS, "left_elbow"),  # a word that no other has
        ("wrist", PARTS, None),  # two have it
        ("left", PARTS, None),
        ("right_h", PARTS, "right_hand"),
        ("foot", PARTS, None),
        ("hip", PARTS, None),
        ("learning_rate", KEYS, None),
        ("step", KEYS, None),
        ("steps", KEYS, "max_steps"),
        ("batch", KEYS, "batch_size"),
        ("maxsteps", KEYS, "max_steps"),
        ("seed_of_it", KEYS, "seed"),
        ("lr", ["dir", "uri"], None),
        ("g1", ["nao", "g1-whole-body", "pepper"], "g1-whole-body"),
        ("g1", ["g1-arms", "g1-legs"], None),
        ("", KEYS, None),
        ("x", [], None),
    ],
)
def test_near(name: str, names: list[str], near: str | None) -> None:
    assert nearest(name, names) == near


def test_what_a_name_has_that_is_no_letter_becomes_one() -> None:
    assert encodable("wällen 1") == "wällen 1"
    assert encodable("w\udcc3\udca4llen") == "wällen"  # UTF-8, of a system that knows no UTF-8
    assert encodable("w\udce4llen") == "w\ufffdllen"  # Latin-1
    assert encodable("\ud800") == "?"


@given(st.sampled_from(PARTS + KEYS), st.data())
def test_one_slip_is_near(name: str, data: st.DataObject) -> None:
    place = data.draw(st.integers(0, len(name) - 1))
    letter = data.draw(st.sampled_from("aexz_"))
    slips = [name[:place] + letter + name[place:], name[:place] + letter + name[place + 1 :]]
    slips += [name[:place] + name[place + 1 :], name[:place] + name[place : place + 2][::-1] + name[place + 2 :]]
    slip = data.draw(st.sampled_from(slips))
    assert nearest(slip, [name]) == name


@given(st.text(max_size=12), st.lists(st.text(max_size=12)))
def test_what_is_suggested_exists(name: str, names: list[str]) -> None:
    near = nearest(name, names)
    assert near is None or near in names


def test_sentences() -> None:
    assert unknown_name("link", "Hed", ["Head"], "nao.urdf") == "link 'Hed' does not exist in nao.urdf; nearest: 'Head'"
    assert unknown_name("link", "Foot", ["Head", "Arm"]) == "link 'Foot' does not exist; available: Arm, Head"
    said = unknown_name(
        "file", "conf/g1.yaml", ["conf/nao.yaml", "conf/g1-legs.yaml"], telling=lambda path: Path(path).stem
    )
    assert said == "file 'conf/g1.yaml' does not exist; nearest: 'conf/g1-legs.yaml'"
    assert unknown_name("link", "Foot", []) == "link 'Foot' does not exist; available: none"
