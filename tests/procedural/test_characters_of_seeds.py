"""The generator of embedded characters: what holds for every seed."""

import numpy as np
import pytest
import trimesh

from charnerf.procedural.character import make_parts
from charnerf.procedural.figure import SURFACES, make_figure
from charnerf.procedural.parts import Part, assemble
from charnerf.procedural.proportions import CHANCES
from charnerf.procedural.voxels import make_voxel_parts
from charnerf.surfaces.raycast import RayCaster
from charnerf.surfaces.scene_mesh import surface_of_scene
from charnerf.surfaces.surface_mesh import shade

SEEDS = tuple(range(14))


@pytest.fixture(scope="module")
def characters() -> dict[int, list[Part]]:
    return {seed: make_parts(seed) for seed in SEEDS}


def vertices_of(parts: list[Part]) -> np.ndarray:
    return np.concatenate([part.shape.vertices for part in parts])


def limb(parts: list[Part], name: str) -> np.ndarray:
    return np.concatenate([part.shape.vertices for part in parts if part.name == name])


@pytest.mark.parametrize("seed", [1, 2**100 + 3])
def test_equal_seeds_give_equal_characters(seed):
    first, second = make_parts(seed), make_parts(seed)
    assert [part.name for part in first] == [part.name for part in second]
    for one, other in zip(first, second, strict=True):
        np.testing.assert_array_equal(one.shape.vertices, other.shape.vertices)
        np.testing.assert_array_equal(one.shape.uv, other.shape.uv)
        np.testing.assert_array_equal(one.texels, other.texels)


def test_different_seeds_give_different_characters(characters):
    shapes = {vertices_of(parts).tobytes() for parts in characters.values()}
    colors = {b"".join(part.texels.tobytes() for part in parts) for parts in characters.values()}
    assert len(shapes) == len(colors) == len(SEEDS)


def test_parts_are_closed_and_turned_outwards(characters):
    for seed, parts in characters.items():
        for part in parts:
            mesh = trimesh.Trimesh(part.shape.vertices, part.shape.faces, process=False)
            where = f"seed {seed}, {part.name}"
            assert mesh.is_watertight, where
            assert mesh.is_winding_consistent, where
            assert mesh.volume > 0.0, where


def test_characters_stand_2_m_tall_on_the_floor_and_centred(characters):
    for seed, parts in characters.items():
        points = vertices_of(parts)
        low, high = points.min(axis=0), points.max(axis=0)
        assert np.isfinite(points).all(), seed
        assert low[2] == 0.0, seed
        assert high[2] == pytest.approx(2.0, abs=1e-12), seed
        np.testing.assert_allclose(low[:2] + high[:2], 0.0, atol=1e-9)
        assert np.linalg.norm(points - (0.0, 0.0, 1.0), axis=-1).max() < 1.7, seed  # the model's box is 1.8 m


def test_each_has_one_head_two_arms_and_two_legs(characters):
    for seed, parts in characters.items():
        head, trunk = limb(parts, "head"), limb(parts, "trunk")
        assert head[:, 2].mean() > trunk[:, 2].mean(), seed
        body_x = 0.5 * (trunk[:, 0].min() + trunk[:, 0].max())
        for kind in ("arm", "leg"):
            left, right = limb(parts, f"left_{kind}"), limb(parts, f"right_{kind}")
            assert left[:, 0].mean() > body_x > right[:, 0].mean(), seed  # it faces -Y: its left is +X
            assert left[:, 0].max() - body_x == pytest.approx(body_x - right[:, 0].min(), abs=1e-6), seed
        legs = limb(parts, "left_leg")
        assert legs[:, 2].max() < head[:, 2].max(), seed
        assert legs[:, 2].min() < 0.35, seed
        assert limb(parts, "left_arm")[:, 2].min() > 0.1, seed


def test_proportions_poses_and_surfaces_vary():
    figures = [make_figure(np.random.default_rng(seed)) for seed in range(200)]
    heads = [figure.build.head for figure in figures]
    assert min(heads) < 0.35
    assert max(heads) > 0.7  # from giants to chibis
    angles = np.array([figure.build.arm_angle_deg for figure in figures])
    for low, high in ((-1.0, 10.0), (20.0, 65.0), (65.0, 90.0)):  # T pose, A pose, arms down
        assert ((angles >= low) & (angles <= high)).mean() > 0.08
    assert {figure.surface for figure in figures} == set(SURFACES)
    assert {figure.build.name for figure in figures} == set(CHANCES)


def test_scene_has_one_texture_and_sane_coordinates(characters):
    for seed in SEEDS[:8]:
        scene = assemble(characters[seed])
        materials = {id(mesh.visual.material.baseColorTexture) for mesh in scene.geometry.values()}
        assert len(materials) == 1
        for mesh in scene.geometry.values():
            assert mesh.visual.material.baseColorTexture.mode == "RGB"
            assert mesh.visual.uv.min() >= 0.0
            assert mesh.visual.uv.max() <= 1.0
            assert len(mesh.visual.uv) == len(mesh.vertices)


def test_flat_colors_survive_the_atlas_exactly(characters):
    for seed in SEEDS[:5]:
        parts, scene = characters[seed], assemble(characters[seed])
        for name, mesh in scene.geometry.items():
            texels = {part.texels.tobytes() for part in parts if part.name == name}
            if len(texels) > 1 or any(len(texel) > 3 for texel in texels):
                continue
            picture = np.asarray(mesh.visual.material.baseColorTexture)
            x = (mesh.visual.uv[:, 0] * picture.shape[1]).astype(int)
            y = ((1.0 - mesh.visual.uv[:, 1]) * picture.shape[0]).astype(int)
            assert {bytes(color) for color in picture[y, x]} == texels


def test_fronts_are_unlike_backs(characters):
    differences = []
    x, z = np.meshgrid(np.linspace(-0.6, 0.6, 24), np.linspace(0.05, 1.95, 32))
    for seed in SEEDS[:8]:
        surface = surface_of_scene(assemble(characters[seed]))
        caster = RayCaster.of_surface(surface)
        colors = []
        for side in (-1.0, 1.0):
            origins = np.stack((x.ravel(), np.full(x.size, 4.0 * side), z.ravel()), axis=-1)
            directions = np.broadcast_to((0.0, -side, 0.0), origins.shape)
            hits = caster.first_hits(origins.astype(np.float32), np.ascontiguousarray(directions, np.float32))
            seen = hits.triangles >= 0
            picture = np.ones((x.size, 3))
            picture[seen] = shade(surface, hits.triangles[seen], hits.u[seen], hits.v[seen])[:, :3]
            colors.append(picture)
        inside = (colors[0] < 1.0).any(axis=-1) | (colors[1] < 1.0).any(axis=-1)
        differences.append(np.abs(colors[0] - colors[1])[inside].mean())
    assert np.mean(differences) > 0.03
    assert min(differences) > 0.002


def test_no_two_blocks_of_cubes_fill_the_same_place():
    for seed in range(40):
        boxes = np.array(
            [
                (part.shape.vertices.min(axis=0), part.shape.vertices.max(axis=0))
                for part in make_voxel_parts(np.random.default_rng(seed))
            ]
        )
        low = np.maximum(boxes[:, None, 0], boxes[None, :, 0])
        high = np.minimum(boxes[:, None, 1], boxes[None, :, 1])
        shared = (high - low).clip(0.0).prod(axis=-1)
        np.fill_diagonal(shared, 0.0)
        assert shared.max() == 0.0, f"seed {seed}: faces in one plane would flicker"
