"""People: poses, traits, clothes, and assets that are missing or broken; of assets of the tests' own making."""

import json

import numpy as np
import pytest

from charnerf.errors import DataError
from charnerf.geometry.stances import Arm, Leg, Stance, arm_directions, draw_stance, leg_direction
from charnerf.people import Assets, make_person
from charnerf.people.assets import BASE, PICTURES, RIG, WEIGHTS, WORN
from charnerf.people.body import RACES, Traits, shaped, target_shares
from charnerf.people.garments import read_garment
from charnerf.people.painting import dyed
from charnerf.people.polygons import parse_obj
from charnerf.people.rig import posed_bones, read_rig, skinned
from tests.support.people_assets import BOX, HAT, bones, write_assets, write_target


@pytest.fixture(scope="module")
def assets(tmp_path_factory):
    return Assets(write_assets(tmp_path_factory.mktemp("people")))


@pytest.fixture
def broken(tmp_path):
    """Assets to break."""
    return Assets(write_assets(tmp_path / "assets"))


def base_and_rig(assets):
    base = assets.read(assets.root / BASE, parse_obj)
    return base, read_rig(assets, base)


def traits(**others):
    usual = {"male": 1.0, "age": 0.5, "muscle": 0.5, "weight": 0.5, "height": 0.5, "proportions": 0.5}
    return Traits(**{**usual, "races": {"caucasian": 0.75, "african": 0.25}, **others})


def to_world(vectors):
    return np.stack((vectors[..., 0], -vectors[..., 2], vectors[..., 1]), axis=-1)


def test_limbs_point_where_the_stance_says_and_feet_stay_level(assets):
    base, rig = base_and_rig(assets)
    rng = np.random.default_rng(0)
    for _ in range(20):
        stance = draw_stance(rng)
        moved = posed_bones(rig, base.vertices, stance)
        np.testing.assert_allclose(np.linalg.det(moved[:, :3, :3]), 1.0)
        joints = {
            name: moved[index] @ np.append(base.vertices[rig.joints[index]].mean(0), 1.0)
            for index, name in enumerate(rig.bones)
        }
        for side, sign, arm, leg in zip("lr", (1.0, -1.0), stance.arms, stance.legs, strict=True):
            chain = np.stack([joints[f"{name}_{side}"][:3] for name in ("upperarm", "lowerarm", "hand")])
            ways = to_world(np.diff(chain, axis=0))
            ways /= np.linalg.norm(ways, axis=1, keepdims=True)
            np.testing.assert_allclose(ways, arm_directions(arm, sign), atol=1e-9)
            way = to_world(joints[f"foot_{side}"][:3] - joints[f"thigh_{side}"][:3])
            np.testing.assert_allclose(way / np.linalg.norm(way), leg_direction(leg, sign), atol=1e-9)
            np.testing.assert_allclose(moved[rig.bones.index(f"foot_{side}"), :3, :3], np.eye(3), atol=1e-9)


def test_bones_keep_their_lengths_and_heads_turn_to_the_left(assets):
    base, rig = base_and_rig(assets)
    stance = Stance((Arm(0, 0, 90), Arm(80, 0, 0)), (Leg(10, 20), Leg(0, 0)), twist=0.0, lean=0.0, look=90.0)
    points = skinned(base.vertices, rig.weights, posed_bones(rig, base.vertices, stance))
    body = slice(0, 8 * len(bones()))
    for before, after in zip(
        np.split(base.vertices[body], len(bones())), np.split(points[body], len(bones())), strict=True
    ):
        np.testing.assert_allclose(
            np.linalg.norm(after - after[0], axis=1), np.linalg.norm(before - before[0], axis=1)
        )
    nose = points[HAT + 7] - points[HAT + 6]  # along +Z before
    np.testing.assert_allclose(nose / np.linalg.norm(nose), (1.0, 0.0, 0.0), atol=1e-9)


def test_directions_of_known_arms_and_legs():
    upper, lower = arm_directions(Arm(0.0, 0.0, 90.0), 1.0)
    np.testing.assert_allclose((upper, lower), ((1, 0, 0), (0, -1, 0)), atol=1e-12)
    upper, lower = arm_directions(Arm(90.0, 90.0, 30.0), -1.0)  # straight forwards: no elbow bends further
    np.testing.assert_allclose((upper, lower), ((0, -1, 0), (0, -1, 0)), atol=1e-12)
    np.testing.assert_allclose(leg_direction(Leg(30.0, 0.0), -1.0), (-0.5, 0.0, -(3**0.5) / 2), atol=1e-12)


def test_traits_move_the_body_by_products_of_their_shares(assets):
    base, _ = base_and_rig(assets)
    moved = shaped(base.vertices, traits(age=0.34375), assets) - base.vertices  # half a child
    np.testing.assert_allclose(moved[HAT + 1], (0.0, 0.25, 0.0), atol=1e-12)
    assert np.count_nonzero(moved) == 1
    for drawn in (traits(), traits(age=0.1, muscle=0.9, weight=0.2, height=1.0), traits(male=0.3, age=1.0)):
        shares = list(target_shares(drawn))
        for of in ("universal-", *(f"{race}-" for race in RACES)):
            total = sum(share for name, share in shares if name.startswith(f"macrodetails/{of}"))
            assert total == pytest.approx(1.0 if of == "universal-" else drawn.races.get(of[:-1], 0.0))
        assert all(share >= 0.0 for _, share in shares)


def test_a_garment_hangs_on_three_vertices_and_grows_with_the_body(assets):
    base, rig = base_and_rig(assets)
    garment = read_garment(assets, assets.folders("clothes")[0])
    foot = 8 * list(bones()).index("foot_l")
    box = base.vertices[foot : foot + 8]
    wide = base.vertices.copy()
    wide[foot : foot + 8] += BOX  # twice as wide
    for body, size in ((base.vertices, 0.8), (wide, 2.4 - 0.8)):
        expected = 0.5 * (body[foot] + body[foot + 4]) + np.array((0.1 * size / 0.4, 0.0, 0.0))
        np.testing.assert_allclose(garment.fitting.fitted(body)[0], expected, atol=1e-9)
    np.testing.assert_allclose(garment.fitting.fitted(base.vertices)[1:], box[[1, 4]], atol=1e-9)
    np.testing.assert_allclose(garment.fitting.weights(rig.weights)[:, rig.bones.index("foot_l")], 1.0)
    assert garment.fitting.hidden.tolist() == list(range(foot, foot + 8)) and garment.picture == "red.png"


def test_people_stand_where_characters_do_and_equal_seeds_give_equal_ones(assets):
    surfaces = [make_person(seed, assets) for seed in range(6)]
    for surface in surfaces:
        points = surface.triangles.reshape(-1, 3)
        low, high = points.min(axis=0), points.max(axis=0)
        assert np.isfinite(points).all() and low[2] == pytest.approx(0.0, abs=1e-5)
        assert high[2] == pytest.approx(2.0, abs=1e-5)
        np.testing.assert_allclose(low[:2] + high[:2], 0.0, atol=1e-5)
        assert (np.diff(surface.material_ids) >= 0).all()
        assert surface.material_ids.max() == len(surface.materials) - 1
    again = make_person(3, Assets(assets.root))
    assert np.array_equal(again.triangles, surfaces[3].triangles)
    assert len({surface.triangles.tobytes() for surface in surfaces}) == 6


def test_the_smaller_picture_stands_for_one_that_git_lfs_holds(assets):
    """Red shoes, dyed or not: their one bright colour is what they are dyed with, or red."""
    found = set()
    for seed in range(12):
        pictures = [
            one.texture.pixels for one in make_person(seed, assets).materials if one.texture is not None
        ]
        shoes = [one for one in pictures if one.shape == (4, 8, 4)]
        assert len(shoes) == 1
        found.add(tuple(shoes[0][0, 0, :3]))
    assert (200, 0, 0) in found and len(found) > 4


def test_dyed_cloth_keeps_its_folds():
    picture = np.full((2, 2, 4), 255, np.uint8)
    picture[0, :, :3] = 85
    color = np.array((0.2, 0.4, 0.6))
    after = dyed(picture, color)[..., :3] / 255.0
    np.testing.assert_allclose(after[1] / after[0], 3.0, rtol=0.05)
    np.testing.assert_allclose(after.mean(axis=(0, 1)), color, atol=0.005)


@pytest.mark.parametrize("missing", [BASE, RIG, WEIGHTS, "mpfb2"])
def test_a_folder_without_assets_is_one_error_with_the_next_step(broken, tmp_path, missing):
    (broken.root / missing).rename(tmp_path / "elsewhere")
    with pytest.raises(DataError, match=r"found no mpfb2.*makehumancommunity/mpfb2.*docs/generators\.md"):
        broken.check()


@pytest.mark.parametrize(
    ("name", "content"),
    [
        (BASE, b"v 0 0 0\ng body\nf 1/1 2/1 3/1\n"),
        (BASE, b"v zero 0 0\n"),
        (RIG, b"{"),
        (WEIGHTS, b"[]"),
        (WEIGHTS, json.dumps({"weights": {"tail": [[0, 1.0]]}}).encode()),
        (WEIGHTS, json.dumps({"weights": {"head": [[10**6, 1.0]]}}).encode()),
        (WEIGHTS, json.dumps({"weights": {"head": [[0, 1.0]]}}).encode()),
        (f"{WORN}/clothes/shoes01/shoes.mhclo", b"obj_file ../../../shoes.obj\nverts 0\n1\n"),
        (f"{WORN}/clothes/shoes01/shoes.mhclo", b"obj_file shoes.obj\n"),
        (f"{PICTURES}/proxies/clothes/shoes01/textures/red.png", b"\x89PNG\r\n"),
    ],
)
def test_a_broken_file_is_one_error_that_names_it(broken, name, content):
    (broken.root / name).write_bytes(content)
    with pytest.raises(DataError, match=r"rig\.game|" + name.rpartition("/")[2].replace(".", r"\.")):
        make_person(0, broken)


def test_a_target_beyond_the_base_mesh_is_an_error(broken):
    for race in ("african", "asian", "caucasian"):
        write_target(broken.root, f"macrodetails/{race}-male-young", [(10**6, 0.0, 1.0, 0.0)])
        write_target(broken.root, f"macrodetails/{race}-female-young", [(10**6, 0.0, 1.0, 0.0)])
    with pytest.raises(DataError, match="names a vertex that the base mesh has not"):
        [make_person(seed, broken) for seed in range(8)]


def test_other_assets_have_another_digest(broken, tmp_path):
    other = Assets(write_assets(tmp_path / "other"))
    changed = Assets(write_assets(tmp_path / "changed"))
    write_target(changed.root, "head/head-square", [(0, 0.0, 0.0, 1.0)])
    assert other.digest == broken.digest != changed.digest
