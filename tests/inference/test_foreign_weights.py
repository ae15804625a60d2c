"""Weights and run folders from strangers: through every door they run no code, read nothing and take no memory."""

import json
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import torch
import yaml
from omegaconf import OmegaConf
from safetensors import safe_open
from safetensors.torch import load_file, save_file

import charnerf
from charnerf.cli.commands import run
from charnerf.config.composition import compose_config
from charnerf.errors import CharNeRFError, ConfigError, DataError
from charnerf.inference.build import build_model
from charnerf.inference.weights import FORMAT, save_config, save_weights
from charnerf.training.start import begin
from support.work import little_work

SLOTS = (
    "renderer.memory_mib",
    "head.hidden",
    "encoder",
    "model.box_centre",
    "model.activation.scale",
    "views.more",
)
CALLS = (
    {"_target_": "lightning.pytorch.cli.instantiate_class", "args": "touch OWNED", "init": {"class_path": "os.system"}},
    {"_target_": "os.system", "command": "touch OWNED"},
    {"_target_": "charnerf.files.write_text", "path": "OWNED", "text": "x"},
    {"_target_": "charnerf.files.write_bytes", "path": {"_target_": "pathlib.Path", "_args_": ["OWNED"]}, "content": "x"},
    {"_target_": "lightning.fabric.utilities.cloud_io._load", "path_or_url": "PICKLE", "weights_only": False},
    {"_target_": "lightning.pytorch.core.saving.load_hparams_from_yaml", "config_yaml": "PICKLE"},
    {"_target_": "charnerf.cli.commands.run", "arguments": ["generate", "-o", "OWNED"]},
    {"_target_": "charnerf.inference.weights.Path.touch", "self": "OWNED"},
    {"_target_": "torch.optim.Adam", "params": []},
    {"_target_": "lightning.Trainer"},
    {"_target_": "charnerf.models.encoders.single.torch.load", "f": "PICKLE", "weights_only": False},
    {"_target_": "charnerf.capture.procedural_data.ProceduralData", "train": 1, "val": 1, "test": 1, "seed": 0},
)  # fmt: skip


class Pickled:
    """Touches a file when it is read."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple:
        return (Path.touch, (self.path,))


@pytest.fixture(scope="module")
def weights(tmp_path_factory: pytest.TempPathFactory) -> Path:
    cfg = compose_config(["scale=smoke"])
    return save_weights(tmp_path_factory.mktemp("weights") / "x.safetensors", build_model(cfg), cfg)


def config_of(weights: Path) -> dict:
    with safe_open(str(weights), framework="pt") as opened:
        return json.loads(opened.metadata()["config"])


def with_config(weights: Path, config: dict | str, folder: Path) -> Path:
    """The same tensors with another config."""
    changed = folder / "changed.safetensors"
    text = config if isinstance(config, str) else json.dumps(config)
    save_file(load_file(weights), str(changed), metadata={"format": FORMAT, "config": text})
    return changed


def changed_at(config: dict, key: str, value: object) -> dict:
    """A config with another value, or another section, at a full key."""
    config = json.loads(json.dumps(config))
    *sections, last = key.split(".")
    place = config
    for name in sections:
        place = place[name]
    place[last] = value
    return config


def run_of(folder: Path, weights: Path, config: dict) -> Path:
    """A run folder with a checkpoint and a config.yaml."""
    (folder / "checkpoints").mkdir(parents=True)
    (folder / "config.yaml").write_text(yaml.safe_dump(config))
    state = {f"model.{name}": value for name, value in load_file(weights).items()}
    torch.save({"state_dict": state}, folder / "checkpoints" / "last.ckpt")
    return folder


@pytest.mark.parametrize("slot", SLOTS)
@pytest.mark.parametrize("call", CALLS, ids=lambda call: call["_target_"])
def test_no_callable_of_a_config_is_called(slot: str, call: dict, weights: Path, tmp_path: Path) -> None:
    torch.save(Pickled(tmp_path / "owned"), tmp_path / "pickle")
    text = (
        json.dumps(call).replace("OWNED", str(tmp_path / "owned")).replace("PICKLE", str(tmp_path / "pickle"))
    )
    config = changed_at(config_of(weights), slot, json.loads(text))
    for one in (with_config(weights, config, tmp_path), run_of(tmp_path / "run", weights, config)):
        with pytest.raises(ConfigError, match=slot.rpartition(".")[0] or slot):
            charnerf.load(one)
    assert not (tmp_path / "owned").exists()


def doors(weights: Path, data: Path, output: Path) -> Iterator[list[str]]:
    yield ["mesh", str(weights), "--data", str(data), "--character", "twin", "-o", str(output)]
    yield ["evaluate", str(weights), "--data", str(data), "--no-mesh"]
    yield ["check", str(weights), "--data", str(data), "-o", str(output)]


def test_the_shown_attack_ends_at_every_door(
    weights: Path, tmp_path: Path, figure_dataset: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    owned = tmp_path / "owned"
    call = CALLS[0] | {"args": f"touch {owned}"}
    evil = with_config(weights, changed_at(config_of(weights), "renderer.memory_mib", call), tmp_path)
    for arguments in doors(evil, figure_dataset, tmp_path / "out"):
        assert run(arguments) == 2, arguments
        assert "renderer.memory_mib._target_: found 'lightning" in capsys.readouterr().err
    cfg = compose_config(["scale=smoke", f"start_from={evil}"])
    with pytest.raises(ConfigError, match=r"renderer\.memory_mib\._target_: found"):
        begin(build_model(cfg), cfg)
    assert not owned.exists()


def test_nothing_of_a_config_is_evaluated(weights: Path, tmp_path: Path) -> None:
    calls: list[str] = []
    OmegaConf.register_new_resolver("noted", lambda *_: calls.append("x") or 32, replace=True)
    good = config_of(weights)
    for text in ("${noted:}", "${oc.env:HOME}", "${model.width}", "a${noted:}", "${oc.decode:${noted:}}"):
        for key in ("model.width", "renderer.memory_mib", "encoder._target_"):
            evil = changed_at(good, key, text)
            for one in (
                with_config(weights, evil, tmp_path),
                run_of(tmp_path / f"{len(calls)}{time.time_ns()}", weights, evil),
            ):
                with pytest.raises(ConfigError, match=rf"{key}: found the interpolation"):
                    charnerf.load(one)
        unread = {
            **good,
            "data": {"root": text, "_target_": "os.system"},
            "name": text,
            "hydra": {"a": [text]},
        }
        for one in (
            with_config(weights, unread, tmp_path),
            run_of(tmp_path / f"{time.time_ns()}", weights, unread),
        ):
            assert set(charnerf.load(one).config) <= set(good)
    assert calls == []


@pytest.mark.parametrize(
    ("key", "value"),
    [
        *(("encoder.depth", one) for one in (1_000_000, 1e6, 10**40, -1)),
        *(("encoder.coarse_stacks", one) for one in (1_000_000, 100)),
        *(("model.image_size", one) for one in (10**9, float("inf"))),
        ("model.width", 8192),  # within bounds, but not the weights' own
        ("model.num_multi_view_blocks", 64),
        ("model.box_centre", [0.0] * 1_000_000),
        ("renderer.num_coarse", 10**9),
        ("encoder.coarse_width", "x" * 500_000),
    ],
)  # fmt: skip
def test_sizes_of_a_config_take_no_memory_and_no_time(
    key: str, value: object, weights: Path, tmp_path: Path
) -> None:
    one = with_config(weights, changed_at(config_of(weights), key, value), tmp_path)
    with little_work(), pytest.raises(CharNeRFError, match=rf"{key}|its config can not|metadata|do not fit"):
        charnerf.load(one)


@pytest.mark.parametrize(
    "text",
    ["[" * 100_000, '{"a":' * 500 + "1" + "}" * 500, "9" * 5000, '{"model": ' + "9" * 5000 + "}", "null", "[]", '"x"', "{}",
     '{"model": {"width": NaN}}', '{"encoder": [[[[]]]]}', '{"model": "\\ud800"}', '{"encoder": {"_target_": {"_target_": {}}}}'],
)  # fmt: skip
def test_metadata_that_is_no_config_is_one_error(text: str, weights: Path, tmp_path: Path) -> None:
    with pytest.raises(CharNeRFError, match=r"changed\.safetensors: "):
        charnerf.load(with_config(weights, text, tmp_path))


def test_a_run_folder_can_not_make_an_evaluation_large(
    weights: Path, tmp_path: Path, figure_dataset: Path
) -> None:
    folder = tmp_path / "run"
    folder.mkdir()
    cfg = compose_config(["scale=smoke"])
    save_config(folder, cfg)
    file = save_weights(folder / "weights.safetensors", build_model(cfg), cfg)
    for name, value in [("eval_views", 10**9), ("mesh_resolution", 10**6), ("eval_views", "${oc.env:HOME}")]:
        config = yaml.safe_load((folder / "config.yaml").read_text())
        config["scale"] = {name: value}
        (folder / "config.yaml").write_text(yaml.safe_dump(config))
        assert run(["evaluate", str(file), "--data", str(figure_dataset)]) in (1, 2)
    assert run(["evaluate", str(file), "--data", str(figure_dataset), "--views", "1000000000"]) == 2
    assert run(["evaluate", str(file), "--data", str(figure_dataset), "--views", "1e9"]) == 2


def test_a_folder_of_others_is_no_run(tmp_path: Path) -> None:
    (tmp_path / "weights.safetensors").mkdir()
    with pytest.raises(DataError, match="holds no weights"):
        charnerf.load(tmp_path)


@pytest.mark.parametrize(
    "state",
    [None, [1], {1: torch.zeros(1)}, {"model.x": 3}, {"model.x": [torch.zeros(1)]}, {}, {"model.x": torch.zeros(1)}, "x"],
)  # fmt: skip
def test_checkpoints_that_hold_no_weights_are_named(state: object, weights: Path, tmp_path: Path) -> None:
    folder = run_of(tmp_path / "run", weights, config_of(weights))
    for content in ({"state_dict": state}, state):
        torch.save(content, folder / "checkpoints" / "last.ckpt")
        with pytest.raises(DataError, match=r"last\.ckpt: "):
            charnerf.load(folder)


@pytest.mark.parametrize(
    ("options", "status"),
    [
        *((["--lod", one], 2) for one in ("²", "9" * 5000, "1000000000", "64,", "")),
        (["--faces", "9" * 30], 2),
        (["--cameras", "1000000000"], 2),
        (["--smooth", "1000000000"], 2),
        (["--height", "nan"], 2),
        (["--texture-size", "1000000000"], 2),
    ],
)
def test_options_that_no_machine_does_are_refused_at_once(
    options: list[str],
    status: int,
    weights: Path,
    tmp_path: Path,
    figure_dataset: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    mesh = [
        "mesh",
        str(weights),
        "--data",
        str(figure_dataset),
        "--character",
        "twin",
        "-o",
        str(tmp_path / "o"),
    ]
    with little_work():
        assert run([*mesh, *options]) == status
    assert "--debug" not in capsys.readouterr().err


@pytest.mark.parametrize(
    "command", [["generate", "--train", "1000000000"], ["generate", "--views", "1000000000"]]
)
def test_data_sets_that_no_disk_holds_are_refused_at_once(command: list[str], tmp_path: Path) -> None:
    assert run([*command, "-o", str(tmp_path / "o")]) == 2
    assert not (tmp_path / "o").exists()


@pytest.mark.parametrize("output", ["/proc/nothing", "/proc/nothing/deep", "/" + "x" * 5000])
def test_folders_that_can_not_be_written_to_are_named_before_the_work(
    output: str, weights: Path, figure_dataset: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = ["--data", str(figure_dataset)]
    for command in (
        ["draw", *data, "--character", "twin", "-o", output],
        ["mesh", str(weights), *data, "--character", "twin", "-o", output],
        ["evaluate", str(weights), *data, "-o", output],
        ["evaluate", str(weights), *data, "--json", f"{output}/x.json"],
        ["check", str(weights), *data, "-o", output],
        ["generate", "-o", output],
        ["capture", str(figure_dataset / "twin/mesh/mesh.obj"), "-o", output],
        ["gallery", str(figure_dataset / "twin/sources"), "-o", f"{output}/x.png", "--weights", str(weights)],
    ):
        with little_work():
            assert run(command) == 1
        told = capsys.readouterr().err
        assert f"error: {output[:100]}" in told and "can not be written to" in told, command
