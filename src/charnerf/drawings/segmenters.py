"""What tells figures from their background, by name."""

from charnerf.drawings.options import Segment
from charnerf.errors import ConfigError

PAPER, NETWORK = "paper", "rembg"


def segmenter_by_name(name: str) -> Segment | None:
    """The segmenter that is called so; None for the background's plain colour.

    Args:
        name: paper, rembg, or rembg:MODEL.

    Raises:
        ConfigError: If there is none of this name, or its model is not on this machine.
        DependencyError: If rembg is missing.
    """
    kind, _, model = name.partition(":")
    if kind not in (PAPER, NETWORK) or (kind == PAPER and model):
        raise ConfigError(f"--segmenter: found '{name[:60]}', expected paper, rembg or rembg:MODEL.")
    if kind == PAPER:
        return None
    from charnerf.drawings.network_mask import NetworkMask

    return NetworkMask(model) if model else NetworkMask()
