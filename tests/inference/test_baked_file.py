"""Baked characters as files: the same pictures without the network; what is broken is named."""

import json
from dataclasses import replace

import numpy as np
import pytest
import torch
from safetensors import safe_open
from safetensors.torch import save_file

from charnerf.errors import DataError
from charnerf.inference.baked_file import load_baked, save_baked
from charnerf.inference.hero import Hero
from charnerf.volume.quadrature import PiecewiseConstant
from charnerf.volume.renderers.baked import TURNING_TOLERANCE
from charnerf.volume.renderers.culled import CulledRenderer
from support import helpers, tiny_models

LOOK = {"azimuth_deg": 30.0, "elevation_deg": 10.0, "size": 24}


@pytest.fixture(scope="module")
def hero() -> Hero:
    model = (
        tiny_models.shake(tiny_models.tiny_model(views="mirrored"), scale=0.1).requires_grad_(False).eval()
    )
    views = helpers.source_views(helpers.person())
    renderer = CulledRenderer(
        quadrature=PiecewiseConstant(), num_coarse=16, num_fine=0, hull_steps=128, memory_mib=256
    )
    scene = model.scene(model.encode(views), 0)
    return Hero(scene=scene, views=views, renderer=renderer).baked()


@pytest.fixture(scope="module")
def file(hero, tmp_path_factory):
    return save_baked(tmp_path_factory.mktemp("baked") / "größe.safetensors", hero)


def test_a_file_gives_the_same_pictures_without_the_network(hero, file):
    loaded = load_baked(file)
    assert loaded.scene.field.source is None and loaded.radius() == hero.radius()
    alone = replace(hero, scene=replace(hero.scene, coarse=replace(hero.scene.field, source=None)))
    seen = loaded.render(**LOOK)
    assert seen[..., 3].max() > 0.1
    np.testing.assert_allclose(seen, alone.render(**LOOK), atol=1e-6)
    assert np.abs(seen[..., 3] - hero.render(**LOOK)[..., 3]).max() < 1e-6


def test_while_it_turns_the_same_grid_is_looked_at_by_a_larger_tolerance(hero):
    quick = hero.turning()
    assert quick.scene is hero.scene and quick.turning() is quick
    assert quick.renderer.tolerance == TURNING_TOLERANCE > hero.renderer.tolerance
    off = np.abs(quick.render(**LOOK)[..., 3] - hero.render(**LOOK)[..., 3])
    assert 0.0 < off.max() < TURNING_TOLERANCE


def test_a_character_that_is_not_baked_is_refused(hero, tmp_path):
    plain = replace(hero, scene=replace(hero.scene, coarse=hero.scene.field.source))
    with pytest.raises(DataError, match="not baked"):
        save_baked(tmp_path / "x.safetensors", plain)
    without_paint = replace(hero, scene=replace(hero.scene, coarse=replace(hero.scene.field, paint=None)))
    with pytest.raises(DataError, match="not made symmetric"):
        save_baked(tmp_path / "x.safetensors", without_paint)
    assert not list(tmp_path.iterdir())


def _contents(file):
    with safe_open(str(file), framework="pt") as opened:
        return {name: opened.get_tensor(name) for name in opened.keys()}, opened.metadata()


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("grid.color_index", lambda one: one - 5, "grid.color_index: found rows"),
        ("grid.u", lambda one: one * float("nan"), "grid.u: found values that are not finite"),
        ("grid.kept", lambda one: one.float(), "grid.kept: found"),
        ("grid.gaps", lambda one: one[:-1].contiguous(), "grid.u: found"),
        ("grid.color_rows", lambda one: one[:, 1:].contiguous(), "grid.color_rows: found"),
        ("grid.color_rows", lambda one: one[:0].contiguous(), "grid.color_rows: found no colours"),
        ("grid.color_rows", lambda one: one[0, 0].clone(), "grid.color_rows: found"),
        ("grid.high", lambda one: one * 1e38, "grid.high: found values that are not finite"),
        ("grid.high", lambda one: one + 100.0, "expected one within its cells"),
        ("drawn.focal", lambda one: one.double(), "cameras with numbers"),
        ("drawn.focal", lambda one: 0.0 * one, "cameras with numbers"),
        ("views.poses", lambda one: one * float("inf"), "cameras with numbers"),
        ("views.orthographic", lambda one: one.float(), "cameras with numbers"),
        ("views.images", lambda one: one * float("nan"), "views: found images"),
        ("drawn.encoded", lambda one: one.int(), "drawn: pictures"),
        ("views.present", lambda one: one.float(), "views: found images"),
        ("drawn.encoded", None, "is missing or wrong"),
        ("drawn.focal", lambda one: one[:1].contiguous(), "is missing or wrong"),
    ],
)
def test_broken_files_are_named(file, tmp_path, name, change, words):
    tensors, metadata = _contents(file)
    tensors = {**tensors, name: None if change is None else change(tensors[name])}
    broken = tmp_path / "broken.safetensors"
    save_file({key: one for key, one in tensors.items() if one is not None}, broken, metadata=metadata)
    with pytest.raises(DataError, match=words):
        load_baked(broken)


def test_other_files_are_refused(file, tmp_path):
    tensors, metadata = _contents(file)
    other = tmp_path / "other.safetensors"
    save_file(tensors, other, metadata={"format": "else"})
    with pytest.raises(DataError, match="charnerf reconstruct --bake"):
        load_baked(other)
    facts = json.loads(metadata["baked"])
    for wrong in (
        {"factor": 10**9},
        {"radius": 0},
        {"pitch": True},
        {"pitch": 1e308},
        {"tolerance": 10**400},
        {"head": []},
    ):
        save_file(tensors, other, metadata={**metadata, "baked": json.dumps({**facts, **wrong})})
        with pytest.raises(DataError, match="expected pitch, factor"):
            load_baked(other)
    save_file(tensors, other, metadata={**metadata, "baked": json.dumps({**facts, "pitch": 1e-9})})
    with pytest.raises(DataError, match="expected one within its cells"):
        load_baked(other)
    save_file(tensors, other, metadata={**metadata, "baked": "[1]"})
    with pytest.raises(DataError, match="expected pitch, factor"):
        load_baked(other)
    other.write_bytes(b"no tensors")
    with pytest.raises(DataError, match="safetensors"):
        load_baked(other)
    assert torch.is_tensor(tensors["grid.u"])
