from __future__ import annotations

import sys

import numpy as np
import pytest
from PIL import Image

from mrhubo.view import Camera, Solids, common_cameras, human_solids, render
from mrhubo.view.painter import LIGHT

RED, BLUE, GREY = (0.9, 0.1, 0.1), (0.1, 0.1, 0.9), (0.6, 0.6, 0.6)
FRONT = Camera(azimuth_deg=0.0, elevation_deg=0.0, width_m=2.0)


def solid(start, end=None, radius=0.2, end_radius=None, color=GREY) -> Solids:
    end = start if end is None else end
    row = (np.asarray(start, float), np.asarray(end, float), radius, radius if end_radius is None else end_radius)
    return Solids.capsules([row], color)


def alpha(solids: Solids, camera: Camera, size=(200, 200)) -> np.ndarray:
    """Covered share (H, W) of every pixel, without shadow."""
    return np.asarray(render(solids, size, camera, background=None, ground=None))[..., 3] / 255.0


def pixels(image: Image.Image) -> np.ndarray:
    return np.asarray(image).astype(int)


def clutter(count=25, seed=0) -> Solids:
    """Tapered capsules, cylinders and boxes through one another."""
    rng = np.random.default_rng(seed)
    starts, ends = rng.uniform(-0.7, 0.7, (2, count, 3))
    kinds = np.arange(count) % 3
    sides = np.cross(ends - starts, rng.normal(size=(count, 3)))
    sides *= rng.uniform(0.05, 0.2, (count, 1)) / np.linalg.norm(sides, axis=1, keepdims=True)
    sides[kinds != 2] = 0.0
    radii, end_radii = rng.uniform(0.03, 0.2, (2, count))
    end_radii[kinds != 0] = radii[kinds != 0]
    return Solids(starts, ends, radii, rng.uniform(0.2, 1.0, (count, 3)), end_radii, kinds == 1, sides)


def take(solids: Solids, order: np.ndarray) -> Solids:
    return Solids(
        solids.starts_S3[order], solids.ends_S3[order], solids.radii_S[order], solids.colors_S3[order],
        solids.end_radii_S[order], solids.flat_S[order], solids.sides_S3[order],
    )  # fmt: skip


@pytest.mark.parametrize("radius", [0.1, 0.35, 0.9])
@pytest.mark.parametrize("angles", [(0.0, 0.0), (30.0, 12.0), (-110.0, 80.0)])
def test_sphere_covers_pi_r_squared(radius, angles):
    share = alpha(solid((0.1, -0.02, 0.03), radius=radius), Camera(*angles, target=(0.1, 0.0, 0.0))).mean()
    assert share * 2.0**2 == pytest.approx(np.pi * radius**2, rel=0.02)


def test_covered_areas_of_capsule_cylinder_and_box_seen_from_the_side():
    start, end, radius = np.array([0.0, 0.0, -0.5]), np.array([0.0, 0.0, 0.5]), 0.2
    color = np.array([GREY])
    assert alpha(solid(start, end, radius), FRONT).mean() * 4 == pytest.approx(0.4 + np.pi * 0.04, rel=0.02)
    cylinder = Solids(start, end, np.array([radius]), color, flat_S=np.array([True]))
    assert alpha(cylinder, FRONT).mean() * 4 == pytest.approx(0.4, rel=0.02)
    above = Camera(0.0, 90.0, width_m=2.0)
    assert alpha(cylinder, above).mean() * 4 == pytest.approx(np.pi * 0.04, rel=0.02)
    tilted = Camera(20.0, 30.0, width_m=2.0)  # side: length cos(e) x width; the discs: one ellipse
    expected = 0.4 * np.cos(np.pi / 6) + np.pi * 0.04 * np.sin(np.pi / 6)
    assert alpha(cylinder, tilted).mean() * 4 == pytest.approx(expected, rel=0.02)
    box = Solids(start, end, np.array([radius]), color, sides_S3=np.array([0.0, 0.3, 0.0]))
    assert alpha(box, FRONT).mean() * 4 == pytest.approx(0.6, rel=0.02)
    assert alpha(box, Camera(90.0, 0.0, width_m=2.0)).mean() * 4 == pytest.approx(0.4, rel=0.02)
    assert alpha(box, above).mean() * 4 == pytest.approx(0.24, rel=0.02)


@pytest.mark.parametrize(
    "end", [(0.5, 0.3, 0.2), (0.8, 0.05, 0.0), (0.8, 0.0, 0.0), (0.1, 0.05, 0.0), (-0.8, 0.01, 0.0)]
)
@pytest.mark.parametrize("radii", [(0.1, 0.1), (0.1, 0.3), (0.3, 0.05), (0.2, 0.0)])
def test_tapered_capsule_equals_many_spheres(end, radii):
    """Also seen end-on, where one sphere hides the other and the cone between them shows."""
    share = np.linspace(0.0, 1.0, 400)
    starts = share[:, None] * np.array(end)
    spheres = Solids(starts, starts, radii[0] + share * (radii[1] - radii[0]), np.tile(GREY, (400, 1)))
    size = (70, 70)
    whole = pixels(render(solid((0, 0, 0), end, *radii), size, FRONT, ground=None))
    pieces = pixels(render(spheres, size, FRONT, ground=None))
    assert np.abs(whole - pieces).mean() < 0.5
    assert (np.abs(whole - pieces).max(axis=-1) > 40).mean() < 0.004


def test_nearer_hides_farther_whatever_the_order():
    near, far = solid((0.5, 0, 0), color=RED), solid((-0.5, 0, 0), radius=0.4, color=BLUE)
    for order in ([near, far], [far, near]):
        picture = pixels(render(order, (100, 100), FRONT))
        assert picture[50, 50, 0] > 2 * picture[50, 50, 2], "red in front"
        assert picture[50, 65, 2] > 2 * picture[50, 65, 0], "blue around it"
    behind = pixels(render([near, far], (100, 100), Camera(180.0, 0.0, width_m=2.0)))
    assert behind[50, 50, 2] > 2 * behind[50, 50, 0]


def test_picture_does_not_depend_on_the_order():
    solids = clutter()
    first = pixels(render(solids, (120, 120)))
    order = np.random.default_rng(3).permutation(len(solids))
    shuffled = pixels(render(take(solids, order), (120, 120)))
    np.testing.assert_allclose(first, shuffled, atol=1)


def test_mirrored_solids_give_the_mirror_image(human):
    mirror = np.array([1.0, -1.0, 1.0])
    for solids in (clutter(seed=5), human_solids(*human)):
        mirrored = Solids(
            solids.starts_S3 * mirror, solids.ends_S3 * mirror, solids.radii_S, solids.colors_S3,
            solids.end_radii_S, solids.flat_S, solids.sides_S3 * mirror,
        )  # fmt: skip
        camera = Camera(25.0, 10.0, width_m=2.6)
        opposite = Camera(-25.0, 10.0, width_m=2.6)
        there = pixels(render(solids, (160, 160), camera))
        back = pixels(render(mirrored, (160, 160), opposite, light=(-LIGHT[0], LIGHT[1], LIGHT[2])))[:, ::-1]
        different = np.abs(there - back).max(axis=-1) > 2
        assert different.mean() < 1e-3


def test_right_hand_side_of_the_picture_is_the_figures_left_and_up_is_up():
    covered = alpha(solid((0.0, 0.5, 0.6), radius=0.1), FRONT)
    rows, columns = np.nonzero(covered)
    assert rows.max() < 100 < columns.min()
    towards_left = alpha(solid((0.5, 0.0, 0.0), radius=0.1), Camera(60.0, 0.0, width_m=2.0))
    assert np.nonzero(towards_left)[1].max() < 100, "seen from the figure's left, its front is on the left"


def test_light_from_above_left():
    picture = pixels(render(solid((0, 0, 0), radius=0.8), (100, 100), FRONT, ground=None)).sum(axis=-1)
    assert picture[30, 35] > picture[50, 50] > picture[75, 70]


@pytest.mark.parametrize("size", [(60, 60), (37, 90), (120, 41)])
@pytest.mark.parametrize("angles", [(30.0, 12.0), (180.0, 0.0), (0.0, 90.0)])
def test_default_camera_shows_the_figure_whole(human, size, angles):
    for solids in (human_solids(*human), clutter(), solid((5, 5, 5), radius=1e-3), solid((0, 0, 0), radius=0.0)):
        camera = Camera.framing(solids, size, *angles)
        covered = alpha(solids, camera, size) > 0
        if solids.radii_S.max() > 0.0:
            assert covered.any()
        border = [covered[0], covered[-1], covered[:, 0], covered[:, -1]]
        assert not np.concatenate(border).any()


def test_common_cameras_keep_scale_and_ground_line(human):
    big, small = human_solids(*human), human_solids(0.5 * human[0], human[1]).translated(np.array([3.0, 1.0, 2.0]))
    cameras = common_cameras([big, small], (150, 150))
    assert cameras[0].width_m == cameras[1].width_m
    covered = [
        np.nonzero(alpha(figure, camera, (150, 150))) for figure, camera in zip([big, small], cameras, strict=True)
    ]
    heights = [np.ptp(rows) for rows, _ in covered]
    assert heights[0] == pytest.approx(2 * heights[1], abs=2)
    assert covered[0][0].max() == pytest.approx(covered[1][0].max(), abs=1)
    assert common_cameras([]) == []


def test_common_cameras_leave_who_jumps_above_the_ground(human):
    stands = human_solids(*human)
    floor = stands.extent(np.array([0.0, 0.0, 1.0]))[0]
    jumps = stands.translated(np.array([2.0, 0.0, 0.5]))
    cameras = common_cameras([stands, jumps], (150, 200), ground=floor)
    assert cameras[0].width_m == cameras[1].width_m
    lowest = [
        np.nonzero(alpha(figure, camera, (150, 200)))[0].max()
        for figure, camera in zip([stands, jumps], cameras, strict=True)
    ]
    raised = 0.5 * np.cos(np.deg2rad(12)) * 150 / cameras[0].width_m
    assert lowest[0] - lowest[1] == pytest.approx(raised, abs=1.5) and lowest[0] < 199


def test_background_shadow_and_transparency():
    sphere = solid((0, 0, 0.2), radius=0.2)
    plain = pixels(render(sphere, (80, 80), ground=None, background=(0.2, 0.4, 0.6)))
    assert plain[0, 0].tolist() == [51, 102, 153]
    shaded, bare = pixels(render(sphere, (80, 80))), pixels(render(sphere, (80, 80), ground=None))
    assert (shaded <= bare).all() and (shaded < bare).any()
    clear = render(sphere, (80, 80), background=None)
    assert clear.mode == "RGBA"
    on_white = Image.new("RGB", clear.size, "white")
    on_white.paste(clear, mask=clear)
    np.testing.assert_allclose(pixels(on_white), shaded, atol=3)


def test_empty_and_bad_requests():
    assert np.all(pixels(render(Solids.empty(), (10, 10))) == 255)
    with pytest.raises(ValueError, match="empty"):
        Camera.framing(Solids.empty())
    with pytest.raises(ValueError, match="size"):
        render(solid((0, 0, 0)), (0, 10))


def test_solids_outside_the_picture_are_cut_off():
    assert alpha(solid((0, 5, 0)), FRONT).max() == 0.0
    assert alpha(solid((0, 0, 0), radius=50.0), FRONT).min() == 1.0


def test_drawing_takes_steps_for_every_solid_and_none_for_a_pixel(human):
    """What makes it fast: all pixels of a solid at once, in numpy."""
    figure = human_solids(*human)
    two = Solids.concatenate([figure, figure.translated(np.array([0.0, 2.0, 0.0]))])

    def steps(solids: Solids, size: tuple[int, int]) -> int:
        camera, count, before = Camera.framing(solids, size), 0, sys.getprofile()

        def see(frame, event, argument):
            nonlocal count
            count += event in ("call", "c_call")

        sys.setprofile(see)
        try:
            render(solids, size, camera)
        finally:
            sys.setprofile(before)
        return count

    small, large = steps(figure, (60, 60)), steps(figure, (300, 300))
    assert large == pytest.approx(small, rel=0.05)
    assert 1.5 * large < steps(two, (300, 300)) < 2.1 * large
