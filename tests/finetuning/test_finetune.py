"""Fine-tuning: what is cached answers as the model does, what is frozen stays, nothing gets worse."""

import copy
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from omegaconf import OmegaConf

from charnerf.errors import ConfigError, DataError
from charnerf.finetuning import Recipe, finetune
from charnerf.finetuning.cached_rays import cache, place, render_cached
from charnerf.finetuning.finetune import learning_parts
from charnerf.finetuning.regions import held_out_patches
from charnerf.geometry.cameras import pixel_centres, pixel_rays
from charnerf.inference.model import Model
from charnerf.volume.quadrature import PiecewiseConstant
from charnerf.volume.renderers.culled import CulledRenderer
from support import helpers, tiny_models

QUICK = Recipe(seconds=60.0, most_steps=10, check_every=5, rays=128, novel_rays=32, learning_rate=3e-3)


def _model(*, fine: bool = False, shaken: bool = True, **parts) -> Model:
    network = tiny_models.tiny_model(fine=fine, **parts)
    if shaken:
        tiny_models.shake(network, scale=0.1)
    renderer = CulledRenderer(
        quadrature=PiecewiseConstant(),
        num_coarse=8,
        num_fine=6 if fine else 0,
        hull_steps=32,
        memory_mib=64,
    )
    config = OmegaConf.create({"model": {"image_size": helpers.SIZE}})
    return Model(network.requires_grad_(False).eval(), renderer, config, Path("weights.safetensors"))


@pytest.mark.parametrize("density", ["view_free", "view_dependent"])
@pytest.mark.parametrize("fine", [False, True])
def test_cached_samples_are_rendered_as_the_renderer_does(person_views, density, fine):
    model = _model(fine=fine, density=density, views="mirrored")
    network, renderer = model.network, model.renderer
    camera = helpers.target_cameras(3)[1]
    rays = pixel_rays(camera, pixel_centres(32, 32).reshape(-1, 2)[::5])
    with torch.no_grad():
        encoded = network.encode(person_views)
        scene = network.scene(encoded, 0)
        expected = renderer.render(scene, rays).finest
        placed, hit = place(renderer, scene, rays, None)
        cached = cache(scene.field, placed)
        index = torch.randperm(len(cached))
        rgb, opacity = render_cached(network.finest, renderer, cached, index)
    assert 0 < len(hit) < len(rays.origins)
    torch.testing.assert_close(rgb, expected.rgb[hit][index], atol=2e-6, rtol=1e-5)
    torch.testing.assert_close(opacity, expected.opacity[hit][index], atol=2e-6, rtol=1e-5)
    missed = torch.ones(len(rays.origins), dtype=torch.bool)
    missed[hit] = False
    assert (expected.opacity[missed] == 0).all()


def test_only_what_follows_the_combination_learns(person_views):
    model = _model()
    hero, before = model.encode_views(person_views), copy.deepcopy(model.network.state_dict())
    done = finetune(model, hero, QUICK)
    assert done.kept and done.best.held_out < done.curve[0].held_out, done.reason
    moved = {
        name
        for name, tensor in done.model.network.state_dict().items()
        if not torch.equal(tensor, before[name])
    }
    learning = {id(parameter) for parameter in learning_parts(done.model.network).parameters()}
    allowed = {name for name, one in done.model.network.named_parameters() if id(one) in learning}
    assert moved and moved <= allowed
    assert not any(
        name.startswith(("encoder", "coarse.single_view", "coarse.from_latents")) for name in moved
    )
    for name, tensor in model.network.state_dict().items():  # the given model is as it was
        assert torch.equal(tensor, before[name])
    again = done.model.encode_views(person_views)
    points, dirs = torch.rand(50, 3) - 0.5, torch.zeros(50, 3)
    torch.testing.assert_close(again.scene.coarse(points, dirs).rgb, done.hero.scene.coarse(points, dirs).rgb)


def test_the_drawings_are_encoded_once(person_views, monkeypatch):
    model = _model()
    hero, calls = model.encode_views(person_views), []
    encode = type(model.network.encoder).forward
    monkeypatch.setattr(
        type(model.network.encoder), "forward", lambda self, x: calls.append(1) or encode(self, x)
    )
    done = finetune(model, hero, QUICK)
    assert len(calls) == 1 and done.num_encodings == done.curve[-1].step == 10
    assert done.num_answers > done.num_samples > 0
    assert done.left_out.rays > 0 and done.left_out.rays_of == 3 * 32 * 32


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"learning_rate": 0.0}, "never fell"),
        ({"least_likeness": 1000.0}, "novel views differed"),
        ({"seconds": 1e-9}, "the time was over"),
    ],
)
def test_never_worse_than_the_start(person_views, changes, words):
    model = _model()
    hero = model.encode_views(person_views)
    done = finetune(model, hero, replace(QUICK, **changes))
    assert not done.kept and done.best.step == 0 and words in done.reason
    assert done.model is model and done.hero.scene is hero.scene


def test_broken_gradients_end_it_with_the_start(person_views):
    model = _model()
    hero = model.encode_views(person_views)
    done = finetune(model, hero, replace(QUICK, learning_rate=1e30))
    assert not done.kept and done.model is model


def test_trust_keeps_novel_views_near_the_start(person_views):
    model = _model()
    hero = model.encode_views(person_views)
    free, trusting = (
        finetune(model, hero, replace(QUICK, trust=trust, least_likeness=0.0)) for trust in (0.0, 100.0)
    )
    assert trusting.curve[-1].likeness > free.curve[-1].likeness


def test_memory_bounds_the_rays(person_views):
    model = _model()
    done = finetune(model, model.encode_views(person_views), replace(QUICK, most_steps=5, memory_mib=1.0))
    more = finetune(model, model.encode_views(person_views), replace(QUICK, most_steps=5))
    assert done.left_out.rays > more.left_out.rays and done.num_samples < more.num_samples


def test_patches_are_whole_spread_and_repeatable():
    mask = held_out_patches(64, 96, patches=16, share=0.2, seed=3)
    assert torch.equal(mask, held_out_patches(64, 96, patches=16, share=0.2, seed=3))
    assert not torch.equal(mask, held_out_patches(64, 96, patches=16, share=0.2, seed=4))
    blocks = mask.reshape(16, 4, 16, 6).permute(0, 2, 1, 3).reshape(256, 24)
    assert (blocks.all(1) | ~blocks.any(1)).all()
    assert float(mask.float().mean()) == pytest.approx(0.2, abs=0.01)
    assert (blocks.any(1).reshape(16, 16).sum(1) >= 2).all()  # every row of patches has some
    with pytest.raises(DataError, match="patches: found 70"):
        held_out_patches(64, 96, patches=70, share=0.2, seed=0)


def test_wrong_settings_are_named():
    with pytest.raises(ConfigError, match="seconds: found 0"):
        Recipe(seconds=0.0)
    with pytest.raises(ConfigError, match="held_out: found 1"):
        Recipe(held_out=1.0)
