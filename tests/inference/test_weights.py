"""Weights and run folders: what is written comes back, and what comes from elsewhere runs no code."""

import json
import pickle
from pathlib import Path

import numpy as np
import pytest
import torch
from omegaconf import DictConfig, OmegaConf
from safetensors import safe_open
from safetensors.torch import load_file, save_file

import charnerf
from charnerf.config.composition import compose_config
from charnerf.errors import ConfigError, DataError
from charnerf.inference.build import build_model
from charnerf.inference.weights import MODEL_SECTIONS, save_config, save_weights
from charnerf.models.charnerf import CharNeRF


@pytest.fixture(scope="module")
def cfg() -> DictConfig:
    return compose_config(["scale=smoke"])


@pytest.fixture(scope="module")
def network(cfg: DictConfig) -> CharNeRF:
    return build_model(cfg)


@pytest.fixture
def weights(tmp_path: Path, network: CharNeRF, cfg: DictConfig) -> Path:
    return save_weights(tmp_path / "weights.safetensors", network, cfg)


def rewritten(weights: Path, change: dict) -> Path:
    """The same weights with another config."""
    with safe_open(str(weights), framework="pt") as opened:
        metadata = dict(opened.metadata())
    config = OmegaConf.merge(json.loads(metadata["config"]), change)
    metadata["config"] = json.dumps(OmegaConf.to_container(config))
    changed = weights.with_name("changed.safetensors")
    save_file(load_file(weights), str(changed), metadata=metadata)
    return changed


def write_run(folder: Path, network: CharNeRF, cfg: DictConfig) -> Path:
    """A run folder with a checkpoint alone."""
    (folder / "checkpoints").mkdir(parents=True)
    save_config(folder, cfg)
    state = {f"model.{name}": value for name, value in network.state_dict().items()}
    torch.save({"state_dict": state}, folder / "checkpoints" / "last.ckpt")
    return folder


def test_weights_come_back_bit_by_bit(weights: Path, network: CharNeRF) -> None:
    model = charnerf.load(weights)
    assert not model.network.training
    for name, value in model.network.state_dict().items():
        assert torch.equal(value, network.state_dict()[name]), name
    assert not any(parameter.requires_grad for parameter in model.network.parameters())
    assert (model.source, model.image_size) == (weights, 32)


def test_weights_hold_the_model_and_nothing_of_the_machine(weights: Path) -> None:
    with safe_open(str(weights), framework="pt") as opened:
        config = json.loads(opened.metadata()["config"])
    assert set(config) == set(MODEL_SECTIONS)
    assert "${" not in json.dumps(config)
    assert list(weights.parent.iterdir()) == [weights]


def test_a_run_folder_and_its_checkpoint_load(tmp_path: Path, network: CharNeRF, cfg: DictConfig) -> None:
    folder = write_run(tmp_path / "run", network, cfg)
    for path in (folder, folder / "checkpoints" / "last.ckpt"):
        model = charnerf.load(path)
        assert model.source == folder / "checkpoints" / "last.ckpt"
        assert torch.equal(
            model.network.state_dict()["encoder." + first(model.network)], first_value(network)
        )
    save_weights(folder / "weights.safetensors", network, cfg)
    assert charnerf.load(folder).source == folder / "weights.safetensors"


def first(network: CharNeRF) -> str:
    return next(iter(network.encoder.state_dict()))


def first_value(network: CharNeRF) -> torch.Tensor:
    return next(iter(network.encoder.state_dict().values()))


@pytest.mark.parametrize(
    "change",
    [
        {"encoder": {"_target_": "os.system"}},
        {"combinator": {"_target_": "charnerf.inference.weights.os.system"}},
        {"model": {"activation": {"_target_": "builtins.exec"}}},
        {"head": {"hidden": {"_target_": "os.system", "command": "touch owned"}}},
    ],
)
def test_a_config_from_elsewhere_can_not_run_code(weights: Path, change: dict) -> None:
    with pytest.raises(ConfigError, match=r"_target_: found"):
        charnerf.load(rewritten(weights, change))


def test_a_config_from_elsewhere_can_not_trust_itself(
    weights: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "evil.py").write_text("raise RuntimeError('imported')\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    changed = rewritten(weights, {"trusted_targets": ["evil"], "combinator": {"_target_": "evil.Mean"}})
    with pytest.raises(ConfigError, match=r"combinator\._target_: found 'evil\.Mean'"):
        charnerf.load(changed)


def test_a_checkpoint_from_elsewhere_can_not_run_code(
    tmp_path: Path, network: CharNeRF, cfg: DictConfig
) -> None:
    class Evil:
        def __reduce__(self) -> tuple:
            return (Path.touch, (tmp_path / "owned",))

    folder = write_run(tmp_path / "run", network, cfg)
    (folder / "checkpoints" / "last.ckpt").write_bytes(pickle.dumps({"state_dict": Evil()}, protocol=2))
    with pytest.raises(DataError, match=r"last\.ckpt: can not be read as a checkpoint"):
        charnerf.load(folder)
    torch.save({"state_dict": Evil()}, folder / "checkpoints" / "last.ckpt")
    with pytest.raises(DataError, match=r"last\.ckpt: can not be read as a checkpoint"):
        charnerf.load(folder)
    assert not (tmp_path / "owned").exists()


def test_what_is_not_there_is_named(
    tmp_path: Path, weights: Path, network: CharNeRF, cfg: DictConfig
) -> None:
    with pytest.raises(DataError, match="does not exist"):
        charnerf.load(tmp_path / "nothing")
    empty = tmp_path / "empty"
    empty.mkdir()
    with pytest.raises(DataError, match=r"holds no weights, expected one of weights\.safetensors"):
        charnerf.load(empty)
    folder = write_run(tmp_path / "run", network, cfg)
    (folder / "config.yaml").unlink()
    with pytest.raises(DataError, match=r"no config\.yaml"):
        charnerf.load(folder)
    (folder / "config.yaml").write_text("a: [")
    with pytest.raises(DataError, match="expected YAML"):
        charnerf.load(folder)


def test_files_that_are_no_weights_are_named(tmp_path: Path, weights: Path) -> None:
    torn = tmp_path / "torn.safetensors"
    torn.write_bytes(weights.read_bytes()[:-100])
    with pytest.raises(DataError, match=r"torn\.safetensors: can not be read"):
        charnerf.load(torn)
    foreign = tmp_path / "foreign.safetensors"
    save_file({"x": torch.zeros(1)}, str(foreign))
    with pytest.raises(DataError, match=r"foreign\.safetensors: found format None"):
        charnerf.load(foreign)
    with pytest.raises(DataError, match="do not fit its config"):
        charnerf.load(rewritten(weights, {"model": {"width": 32}}))


@pytest.mark.parametrize("value", [torch.nan, torch.inf])
def test_weights_of_a_training_that_diverged_are_named(weights: Path, tmp_path: Path, value: float) -> None:
    with safe_open(str(weights), framework="pt") as opened:
        metadata = opened.metadata()
    state = load_file(weights)
    name = next(iter(state))
    state[name].view(-1)[-1] = value
    save_file(state, str(tmp_path / "diverged.safetensors"), metadata=metadata)
    with pytest.raises(DataError, match=rf"diverged\.safetensors: found NaN or infinity in {name}"):
        charnerf.load(tmp_path / "diverged.safetensors")


def test_a_hero_is_rendered_and_meshed(weights: Path) -> None:
    """An untrained field fills the hull: it is seen from any angle, and its mesh stands on the floor."""
    model = charnerf.load(weights)
    drawing = np.zeros((48, 32, 4), dtype=np.uint8)
    drawing[4:44, 10:22] = (200, 40, 40, 255)
    hero = model.encode(front=drawing, side=drawing, back=drawing[:, ::-1])
    assert hero.turnaround is not None
    image = hero.render(azimuth_deg=30, elevation_deg=10, size=24)
    assert image.shape == (24, 24, 4)
    assert image.dtype == np.float32
    assert 0.0 <= image.min()
    assert image.max() <= 1.0
    assert image[12, 12, 3] > 0.5
    assert image[0, 0, 3] == 0.0
    mesh = hero.mesh(resolution=32)
    assert mesh.bounds[0, 2] == pytest.approx(0.0, abs=1e-6)
    assert mesh.bounds[1, 2] == pytest.approx(2.0, abs=1e-6)
    width = mesh.extents[0]
    assert width == pytest.approx(2.0 * 12 / 40, rel=0.3)
    assert charnerf.save_mesh(mesh, weights.parent / "hero.glb").is_file()
    with pytest.raises(ConfigError, match="size"):
        hero.render(azimuth_deg=0, elevation_deg=0, size=0)


def test_released_weights_that_are_not_there_are_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("charnerf.inference.weights.RELEASED", tmp_path / "released.safetensors")
    with pytest.raises(DataError, match="holds no released weights"):
        charnerf.load()
