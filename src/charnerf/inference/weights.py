"""Weights files and run folders: read without running their code, written whole or not at all."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import torch
from omegaconf import DictConfig, OmegaConf
from safetensors import safe_open
from safetensors.torch import save
from torch import Tensor
from torch.overrides import TorchFunctionMode

from charnerf.config import MODEL_SECTIONS, validate_model
from charnerf.config.foreign import chosen_sections, parse_json, read_yaml
from charnerf.errors import ConfigError, DataError
from charnerf.files import write_aside, write_text
from charnerf.inference.build import build_model, build_renderer
from charnerf.inference.checkpoint_file import read_checkpoint
from charnerf.inference.model import Model
from charnerf.inference.tensor_file import read_tensors
from charnerf.models.charnerf import CharNeRF

RELEASED = Path(__file__).resolve().parents[1] / "weights" / "released.safetensors"
FORMAT = "charnerf-weights-1"


def load(path: str | Path | None = None, *, trusted_targets: Sequence[str] = ()) -> Model:
    """Load a trained model in eval mode.

    Args:
        path: A run folder, a .ckpt below one, a .safetensors; the released weights if None.
        trusted_targets: Modules of your own classes that the run's config may name. Only name what you trust:
            building a part runs its code.

    Raises:
        DataError: If there are no weights, or they do not fit their config.
        ConfigError: If the config that came with them is wrong, or names a class outside the allow-list.
    """
    file = RELEASED if path is None else Path(path)
    if path is None and not file.is_file():
        raise DataError(
            f"{file}: this installation holds no released weights, expected them there; name a run folder, a"
            " .ckpt or a .safetensors instead, or make one with `python train.py`."
        )
    if not file.exists():
        raise DataError(f"{file}: does not exist, expected a run folder, a .ckpt or a .safetensors.")
    if file.is_dir():
        file = _weights_of_run(file)
    if not file.is_file():
        raise DataError(f"{file}: found a pipe or device, expected a run folder, a .ckpt or a .safetensors.")
    cfg, state = _read_safetensors(file) if file.suffix == ".safetensors" else _read_checkpoint(file)
    _check_numbers(file, state)
    try:
        validate_model(cfg, trusted_targets=trusted_targets)
    except ConfigError as error:
        raise ConfigError(f"{file}: its config can not be used. {error}") from error
    try:
        with torch.random.fork_rng(devices=[]):  # first weights are drawn, to be overwritten
            if not trusted_targets:  # own classes may do in their constructors what needs real tensors
                _check_shapes(cfg, state)
            network = build_model(cfg)
        network.load_state_dict(state, strict=True)
    except RuntimeError as error:
        raise DataError(
            f"{file}: its weights do not fit its config ({' '.join(str(error).split())[:300]}); "
            "expected both from one run and one version of charnerf."
        ) from error
    return Model(
        network=network.requires_grad_(False).eval(),
        renderer=build_renderer(cfg),
        config=cfg,
        source=file,
        note=_note_of(file),
    )


def _check_numbers(file: Path, state: Mapping[str, Tensor]) -> None:
    """Check that weights can be computed with.

    Raises:
        DataError: If one is not finite.
    """
    for name, value in state.items():
        if isinstance(value, Tensor) and not bool(value.isfinite().all()):
            raise DataError(
                f"{file}: found NaN or infinity in {name}, expected finite weights. A training that diverged leaves such: name an"
                " earlier checkpoint of it, or train anew with a lower scale.learning_rate."
            )


def _check_shapes(cfg: DictConfig, state: Mapping[str, Tensor]) -> None:
    """Check, before any memory is taken, that a config means the network that the weights are of.

    Raises:
        RuntimeError: If it does not.
    """
    with torch.device("meta"), _Undrawn():
        expected = build_model(cfg).state_dict()
    for name in [*expected, *state]:
        if name not in state or name not in expected:
            where = "config" if name in state else "weights"
            raise RuntimeError(f"{name} is not in its {where}")
        if not isinstance(state[name], Tensor) or state[name].shape != expected[name].shape:
            raise RuntimeError(f"size mismatch for {name}, expected {tuple(expected[name].shape)}")


class _Undrawn(TorchFunctionMode):
    """Draws no normal numbers: where tensors hold none, torch would import symbolic mathematics for it, a second long."""

    def __torch_function__(
        self, func: Any, types: Any, args: tuple[Any, ...] = (), kwargs: dict[str, Any] | None = None
    ) -> Any:
        return args[0] if func is Tensor.normal_ else func(*args, **(kwargs or {}))


def save_weights(path: str | Path, model: CharNeRF, cfg: DictConfig, *, note: str | None = None) -> Path:
    """Write a model's weights with the model's part of its config, beside and then renamed.

    Args:
        path: A .safetensors.
        model: The network; its buffers and weights are written as they are.
        cfg: The run's config; data, trainer and paths are not written.
        note: What a user of the file has to know, such as what it is for; `load` hands it on.

    Returns:
        The file.
    """
    file = Path(path)
    chosen = OmegaConf.create(
        {name: OmegaConf.to_container(cfg[name], resolve=True) for name in MODEL_SECTIONS}
    )
    state = {name: tensor.detach().cpu().contiguous() for name, tensor in model.state_dict().items()}
    metadata = {"format": FORMAT, "config": json.dumps(OmegaConf.to_container(chosen))}
    if note is not None:
        metadata["note"] = note
    with write_aside(file) as aside:
        aside.write_bytes(_sorted_metadata(save(state, metadata=metadata)))
    return file


def _sorted_metadata(content: bytes) -> bytes:
    """A safetensors file with its metadata sorted: the library writes them in another order each time."""
    start = 8 + int.from_bytes(content[:8], "little")
    header = json.loads(content[8:start])
    header["__metadata__"] = dict(sorted(header["__metadata__"].items()))
    text = json.dumps(header, separators=(",", ":")).encode()
    text = text.ljust(-(-len(text) // 8) * 8)  # tensors begin at a multiple of 8 bytes
    return len(text).to_bytes(8, "little") + text + content[start:]


def save_config(folder: Path, cfg: DictConfig) -> Path:
    """Write a run's composed config, interpolations resolved, as `config.yaml` of its folder."""
    file = folder / "config.yaml"
    write_text(file, OmegaConf.to_yaml(cfg, resolve=True))
    return file


def load_config(folder: Path, sections: Sequence[str] | None = None) -> DictConfig:
    """Read the `config.yaml` of a run folder, or some of its sections; it is not validated, and evaluates nothing.

    Raises:
        DataError: If there is none, or it is not YAML.
        ConfigError: If a section holds an interpolation, or more than a config does.
    """
    file = folder / "config.yaml"
    if not file.is_file():
        raise DataError(f"{file}: does not exist, expected the config of a run; is {folder} a run folder?")
    return chosen_sections(read_yaml(file), sections, str(file))


def run_folder(weights: Path) -> Path | None:
    """Folder of the run that a weights file or a checkpoint lies in, by its config.yaml; None outside of one."""
    folders = (weights.parent, weights.parent.parent)
    return next((folder for folder in folders if (folder / "config.yaml").is_file()), None)


def _weights_of_run(folder: Path) -> Path:
    """The best weights that a run folder holds."""
    candidates = [
        folder / "weights.safetensors",
        *(folder / "checkpoints" / f"{one}.ckpt" for one in ("best", "last")),
    ]
    for file in candidates:
        if file.is_file():
            return file
    listed = ", ".join(str(file.relative_to(folder)) for file in candidates)
    raise DataError(
        f"{folder}: holds no weights, expected one of {listed}; is it the folder of a run that got to its"
        " end?"
    )


def _read_safetensors(file: Path) -> tuple[DictConfig, dict[str, Tensor]]:
    state, metadata = read_tensors(
        file,
        file_format=FORMAT,
        expected="a file that charnerf wrote",
        otherwise="it was not written by this version of charnerf.",
    )
    plain = parse_json(metadata.get("config", ""), str(file))
    return chosen_sections(plain, MODEL_SECTIONS, str(file)), state


def _note_of(file: Path) -> str | None:
    """What a weights file says about itself; nothing where it says nothing."""
    if file.suffix != ".safetensors":
        return None
    with safe_open(str(file), framework="pt") as opened:
        return (opened.metadata() or {}).get("note")


def _read_checkpoint(file: Path) -> tuple[DictConfig, dict[str, Tensor]]:
    """Config from the run folder that the checkpoint lies in, weights from the checkpoint."""
    content, prefix = read_checkpoint(file, sealed=False).get("state_dict"), "model."
    if not isinstance(content, Mapping) or not all(isinstance(one, Tensor) for one in content.values()):
        raise DataError(
            f"{file}: can not be read as a checkpoint (its state_dict holds other things than tensors), expected one that a run"
            " wrote."
        )
    state = {name.removeprefix(prefix): one for name, one in content.items() if str(name).startswith(prefix)}
    folder = run_folder(file)
    if folder is None:
        raise DataError(
            f"{file}: no config.yaml beside it or in {file.parent.parent}; keep checkpoints in their run"
            " folder."
        )
    return load_config(folder, MODEL_SECTIONS), state
