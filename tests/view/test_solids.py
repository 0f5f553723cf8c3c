from __future__ import annotations

import numpy as np
import pytest

from mrhubo.view import Solids, human_solids

RED = (0.9, 0.2, 0.2)


def sphere(centre, radius, color=RED) -> Solids:
    return Solids.capsules([(np.asarray(centre, float), np.asarray(centre, float), radius, radius)], color)


def test_concatenate_translate_bounds():
    both = Solids.concatenate([sphere((0, 0, 0), 0.1), sphere((1, 0, 0), 0.2)])
    assert len(both) == 2
    np.testing.assert_allclose(both.bounds(), [[-0.1, -0.2, -0.2], [1.2, 0.2, 0.2]])
    np.testing.assert_allclose(both.translated(np.array([0, 0, 3.0])).bounds()[:, 2], [2.8, 3.2])
    np.testing.assert_allclose(both.scaled(2.0).bounds(), 2.0 * both.bounds())
    assert len(Solids.concatenate([])) == 0


@pytest.mark.parametrize("kind", ["capsule", "cylinder", "box"])
def test_extent_holds_the_surface_and_touches_it(kind):
    rng = np.random.default_rng(1)
    start, end = np.zeros(3), np.array([0.3, 0.1, 0.5])
    axis = end / np.linalg.norm(end)
    side = np.cross(axis, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side)
    other = np.cross(axis, side)
    radius, width = 0.1, 0.2
    t, angle = rng.random((2, 20_000))
    ring = np.cos(2 * np.pi * angle)[:, None] * side + np.sin(2 * np.pi * angle)[:, None] * other
    if kind == "box":
        corners = rng.choice([-1.0, 1.0], (20_000, 2))
        points = t.round()[:, None] * end + corners[:, :1] * width * side + corners[:, 1:] * radius * other
    elif kind == "cylinder":
        points = t[:, None] * end + radius * ring
        points = np.concatenate([points, radius * ring, end + radius * ring])
    else:
        directions = rng.normal(size=(20_000, 3))
        points = t.round()[:, None] * end + radius * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    solids = Solids(
        start, end, np.array([radius]), np.array([RED]),
        flat_S=np.array([kind == "cylinder"]), sides_S3=width * side if kind == "box" else np.zeros(3),
    )  # fmt: skip
    for direction in np.concatenate([np.eye(3), rng.normal(size=(3, 3))]):
        direction = direction / np.linalg.norm(direction)
        np.testing.assert_allclose(
            solids.extent(direction), [(points @ direction).min(), (points @ direction).max()], atol=2e-3
        )


def test_bad_values_are_refused_by_name():
    with pytest.raises(ValueError, match=r"radii_S\[0\] is not finite"):
        sphere((0, 0, 0), np.nan)
    with pytest.raises(ValueError, match="starts_S3"):
        sphere((0, np.inf, 0), 0.1)
    with pytest.raises(ValueError, match="radii_S has 1 rows, starts_S3 has 2"):
        Solids(np.zeros((2, 3)), np.zeros((2, 3)), np.ones(1), np.ones((2, 3)))
    with pytest.raises(ValueError, match="negative"):
        sphere((0, 0, 0), -0.1)


def test_human_stands_upright_faces_forward_and_has_flesh(human):
    positions, names = human
    low, high = human_solids(positions, names).bounds()
    height = high[2] - low[2]
    assert 1.6 < height < 1.9
    assert high[1] - low[1] > 1.5, "T-pose: arms to the sides"
    assert 0.2 < high[0] - low[0] < 0.45
    assert high[0] > -low[0], "toes and nose point forward"


def test_human_is_mirror_symmetric(human):
    positions, names = human
    rng = np.random.default_rng(0)
    positions = positions + rng.normal(scale=0.01, size=positions.shape)
    swap = {"left": "right", "right": "left"}
    mirrored_names = ["_".join([swap.get(part, part) for part in name.split("_")]) for name in names]
    mirrored = human_solids(positions * [-1.0, 1.0, 1.0], mirrored_names)
    original = human_solids(positions, names)

    def rows(solids: Solids, sign: float) -> np.ndarray:
        """Every solid as one row, in a canonical order."""
        flip = np.array([1.0, sign, 1.0])
        table = np.column_stack([solids.starts_S3 * flip, solids.ends_S3 * flip, solids.radii_S, solids.end_radii_S])
        return table[np.lexsort(table.round(6).T)]

    np.testing.assert_allclose(rows(mirrored, -1.0), rows(original, 1.0), atol=1e-9)


def test_human_grows_in_proportion(human):
    positions, names = human
    full, half = human_solids(positions, names), human_solids(0.5 * positions, names)
    np.testing.assert_allclose(half.radii_S, 0.5 * full.radii_S, rtol=1e-9)
    np.testing.assert_allclose(half.starts_S3, 0.5 * full.starts_S3, atol=1e-9)


def test_missing_points_only_omit_their_part(human):
    positions, names = human
    full = len(human_solids(positions, names))
    for name in names:
        keep = [index for index, other in enumerate(names) if other != name]
        part = human_solids(positions[keep], [names[index] for index in keep])
        assert full - 45 < len(part) <= full, name
    assert len(human_solids(positions[:0], [])) == 0
    only_arm = ["left_shoulder", "left_elbow", "left_wrist"]
    assert len(human_solids(positions[[names.index(name) for name in only_arm]], only_arm)) == 6  # two, two, a mitten


def test_degenerate_human_is_still_finite(human):
    _, names = human
    assert np.isfinite(human_solids(np.zeros((len(names), 3)), names).bounds()).all()


def test_human_with_nan_is_refused_by_name(human):
    positions, names = human
    positions = positions.copy()
    positions[names.index("left_elbow"), 1] = np.nan
    with pytest.raises(ValueError, match="not finite: left_elbow"):
        human_solids(positions, names)
    with pytest.raises(ValueError, match="one row a name"):
        human_solids(positions[:3], names)
