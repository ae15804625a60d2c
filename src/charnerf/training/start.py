"""Which weights a run begins with."""

from omegaconf import DictConfig, OmegaConf

from charnerf.config import MODEL_SECTIONS
from charnerf.errors import ConfigError, ShapeError
from charnerf.inference.weights import load
from charnerf.models.charnerf import CharNeRF
from charnerf.models.growth import grow_from

NETWORK_SECTIONS = [name for name in MODEL_SECTIONS if name not in ("quadrature", "renderer")]
MAY_GROW = ("model.width", "model.num_single_view_blocks", "model.num_multi_view_blocks")


def begin(model: CharNeRF, cfg: DictConfig) -> str | None:
    """Give a new run's model the weights that it begins with; says which, None where they are random.

    A model that is wider or deeper than the one given, and the same in everything else, grows from it.

    Raises:
        ConfigError: If the weights of `start_from` are those of another model.
    """
    if cfg.start_from is None:
        return model.encoder.begin()
    source = load(
        None if cfg.start_from == "released" else cfg.start_from, trusted_targets=cfg.trusted_targets
    )
    settings = settings_of(source.config, unlike=cfg)
    grown = [one for one in settings if one.startswith(MAY_GROW)]
    try:
        if settings and settings == grown:
            grow_from(model, source.network)
            return f"Began with the weights of {source.source}, grown from {' '.join(grown)}."
        model.load_state_dict(source.network.state_dict())
    except (RuntimeError, ShapeError) as error:
        raise ConfigError(
            f"start_from: found the weights of another model in {source.source}, expected this run's or a smaller one's"
            f" ({', '.join(MAY_GROW)}). To make them the same: {' '.join(settings)}"
        ) from error
    return f"Began with the weights of {source.source}."


def settings_of(model: DictConfig, *, unlike: DictConfig) -> list[str]:
    """Overrides that give a run the networks of another model's config: an option is named as its file is."""
    overrides = []
    for section in NETWORK_SECTIONS:
        for key, value in model[section].items():
            if OmegaConf.select(unlike, f"{section}.{key}") == value:
                continue
            overrides.append(
                f"{section}={value.split('.')[-2]}" if key == "_target_" else f"{section}.{key}={value}"
            )
    return overrides
