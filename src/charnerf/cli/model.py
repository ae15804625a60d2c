"""The model that a command works with."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from charnerf.cli.messages import say
from charnerf.errors import ConfigError
from charnerf.process import use_fastest_products

if TYPE_CHECKING:
    import torch

    from charnerf.inference.model import Model


def load_model(
    path: Path | None, *, device: str, trust: Sequence[str] | None, renderer: str | None = None
) -> "Model":
    """Load a model onto a device, with its own renderer or another one of the same settings."""
    from omegaconf import OmegaConf

    from charnerf.config.options import option
    from charnerf.inference.build import build_renderer
    from charnerf.inference.weights import load

    use_fastest_products()
    model = load(path, trusted_targets=trust or ()).to(pick_device(device))
    if model.note is not None:
        say(f"{model.source}: {model.note}")
    if renderer is None:
        return model
    changed = OmegaConf.masked_copy(model.config, ["quadrature"])
    changed.renderer = option("renderer", renderer, like=model.config.renderer)
    return replace(model, renderer=build_renderer(changed))


def pick_device(name: str) -> "torch.device":
    """Device of a name; `auto` is a GPU if there is one.

    Raises:
        ConfigError: If there is no such device.
    """
    import torch

    if name == "auto":
        return torch.device("cuda" if torch.cuda.is_available() else "cpu")
    try:
        device = torch.device(name)
        torch.zeros(1, device=device)
    except (RuntimeError, AssertionError, NotImplementedError) as error:
        raise ConfigError(
            f"--device: found '{name}', expected auto, cpu or a GPU of this machine."
        ) from error
    return device
