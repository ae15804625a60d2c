"""Parts, models and renderers from a validated config; the only place that builds them."""

import inspect
from collections.abc import Mapping
from typing import Any

from hydra.errors import InstantiationException
from hydra.utils import get_object, instantiate
from omegaconf import DictConfig

from charnerf.errors import CharNeRFError, ConfigError
from charnerf.models.charnerf import CharNeRF
from charnerf.models.field import Field
from charnerf.volume.renderers.base import AbstractRenderer

IMAGE_CHANNELS = 4  # RGBA


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
            features=features,
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
        coarse=build_field(),
        fine=build_field() if cfg.renderer.num_fine > 0 else None,
        box_centre=list(settings.box_centre),
        box_half_extent=settings.box_half_extent,
        hull=settings.hull,
        image_size=settings.image_size,
    )


def build_renderer(cfg: DictConfig) -> AbstractRenderer:
    """Build the renderer of a validated config."""
    return build_part(cfg.renderer, {"quadrature": build_part(cfg.quadrature)})
