"""A run folder or a weights file, and the model in it; the only place that builds parts from a config."""

import inspect
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import torch
from hydra.errors import InstantiationException
from hydra.utils import get_object, instantiate
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import Tensor
from yaml import YAMLError

from charnerf.config import MODEL_SECTIONS, validate_model
from charnerf.errors import CharNeRFError, ConfigError, DataError
from charnerf.files import write_aside, write_text
from charnerf.inference.model import Model
from charnerf.models.charnerf import CharNeRF
from charnerf.models.field import Field
from charnerf.volume.renderers.base import AbstractRenderer

IMAGE_CHANNELS = 4  # RGBA
RELEASED = Path(__file__).resolve().parents[1] / "weights" / "released.safetensors"
FORMAT = "charnerf-weights-1"


def build_part(section: DictConfig, given: Mapping[str, Any] | None = None) -> Any:
    """Build the object that a section with `_target_` describes; lists arrive as lists, sections as dicts.

    Args:
        section: Validated before.
        given: Arguments that the config does not hold, because another part decides them; those that the
            class does not take (the mean has no width) are left out.
    """
    taken = inspect.signature(get_object(section._target_)).parameters
    chosen = {name: value for name, value in (given or {}).items() if name in taken}
    try:
        return instantiate(section, _convert_="all", **chosen)
    except InstantiationException as error:
        if isinstance(error.__cause__, CharNeRFError):
            raise error.__cause__ from error
        raise ConfigError(f"{section._target_}: can not be built: {error.__cause__ or error}") from error


def build_model(cfg: DictConfig) -> CharNeRF:
    """Build the untrained model of a validated config; a fine field only where there is a fine pass."""
    encoder = build_part(cfg.encoder, {"in_channels": IMAGE_CHANNELS})
    features = build_part(cfg.features)
    settings = cfg.model
    width = {"width": int(cfg.model.width)}

    def build_field() -> Field:
        return Field(
            single_view=build_part(
                cfg.single_view,
                {
                    **width,
                    "num_frequencies": settings.num_frequencies,
                    "num_point_features": features.num_point_features,
                    "num_blocks": settings.num_single_view_blocks,
                },
            ),
            combinator=build_part(cfg.combinator, width),
            density=build_part(cfg.density, width),
            head=build_part(cfg.head, width),
            activation=build_part(settings.activation),
            feature_channels=encoder.out_channels,
            width=cfg.model.width,
            num_multi_view_blocks=cfg.model.num_multi_view_blocks,
        )

    return CharNeRF(
        encoder=encoder,
        views=build_part(cfg.views),
        features=features,
        coarse=build_field(),
        fine=build_field() if cfg.renderer.num_fine > 0 else None,
        box_centre=list(settings.box_centre),
        box_half_extent=settings.box_half_extent,
        hull=settings.hull,
    )


def build_renderer(cfg: DictConfig) -> AbstractRenderer:
    """Build the renderer of a validated config."""
    return build_part(cfg.renderer, {"quadrature": build_part(cfg.quadrature)})


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
    cfg, state = _read_safetensors(file) if file.suffix == ".safetensors" else _read_checkpoint(file)
    try:
        validate_model(cfg, trusted_targets=trusted_targets)
    except ConfigError as error:
        raise ConfigError(f"{file}: its config can not be used. {error}") from error
    with torch.random.fork_rng(devices=[]):  # first weights are drawn, to be overwritten
        network = build_model(cfg)
    try:
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


def load_config(folder: Path) -> DictConfig:
    """Read the `config.yaml` of a run folder; it is not validated.

    Raises:
        DataError: If there is none, or it is not YAML.
    """
    file = folder / "config.yaml"
    if not file.is_file():
        raise DataError(f"{file}: does not exist, expected the config of a run; is {folder} a run folder?")
    try:
        cfg = OmegaConf.load(file)
    except (YAMLError, OmegaConfBaseException, UnicodeDecodeError, OSError) as error:
        raise DataError(
            f"{file}: can not be read ({' '.join(str(error).split())[:200]}), expected YAML."
        ) from error
    if not isinstance(cfg, DictConfig):
        raise DataError(f"{file}: found a list, expected sections.")
    return cfg


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
    try:
        with safe_open(str(file), framework="pt") as opened:
            metadata = opened.metadata() or {}
            state = {name: opened.get_tensor(name) for name in opened.keys()}
    except (SafetensorError, OSError) as error:
        raise DataError(
            f"{file}: can not be read as safetensors ({error}), expected a file that charnerf wrote."
        ) from error
    if metadata.get("format") != FORMAT:
        raise DataError(
            f"{file}: found format {metadata.get('format')!r} in its metadata, expected {FORMAT!r}; "
            "it was not written by this version of charnerf."
        )
    try:
        return OmegaConf.create(json.loads(metadata["config"])), state
    except (KeyError, ValueError, OmegaConfBaseException) as error:
        raise DataError(
            f"{file}: its metadata holds no readable config ({error}); write it again from its run."
        ) from error


def _note_of(file: Path) -> str | None:
    """What a weights file says about itself; nothing where it says nothing."""
    if file.suffix != ".safetensors":
        return None
    with safe_open(str(file), framework="pt") as opened:
        return (opened.metadata() or {}).get("note")


def _read_checkpoint(file: Path) -> tuple[DictConfig, dict[str, Tensor]]:
    """Config from the run folder that the checkpoint lies in, weights from the checkpoint."""
    try:
        content = torch.load(file, map_location="cpu", weights_only=True)
        state = content["state_dict"]
    except Exception as error:  # torch raises many kinds on files that are no checkpoints
        raise DataError(
            f"{file}: can not be read as a checkpoint ({' '.join(str(error).split())[:200]}), expected one"
            " that a run wrote."
        ) from error
    folder = next((one for one in (file.parent, file.parent.parent) if (one / "config.yaml").is_file()), None)
    if folder is None:
        raise DataError(
            f"{file}: no config.yaml beside it or in {file.parent.parent}; keep checkpoints in their run"
            " folder."
        )
    prefix = "model."
    return load_config(folder), {k.removeprefix(prefix): v for k, v in state.items() if k.startswith(prefix)}
