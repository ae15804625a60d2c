"""What a config must look like; `validate` reports everything that is wrong with one, before any work.

`RunConfig` lists the sections: groups are parts (their schema is the signature of the class that `_target_` names), the rest are
plain sections and values. `RULES` holds what no single value can show.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, make_dataclass
from typing import Annotated, Any, get_type_hints

from omegaconf import DictConfig, ListConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from charnerf.config_checks import BROKEN, MISSING, Above, AtLeast, Part, Problems, check_section, join
from charnerf.errors import ConfigError
from charnerf.schedule import Phase, PhaseSchedule

Count = Annotated[int, AtLeast(1)]
CountOrZero = Annotated[int, AtLeast(0)]


def _part(*homes: str, given: Sequence[str] = ()) -> Any:
    return Annotated[Any, Part(homes=homes, given=frozenset(given))]


@dataclass(frozen=True)
class Scale:
    """Sizes of pictures, networks and runs; the other sections read them by interpolation."""

    image_size: Annotated[int, AtLeast(8)]
    feature_dim: Count
    coarse_stacks: Count
    fine_stacks: Count
    hourglass_depth: Count
    width: Count
    num_single_view_blocks: CountOrZero
    num_multi_view_blocks: CountOrZero
    num_coarse: Count
    num_fine: CountOrZero
    phase_rays: list[Count]
    phase_surface_points: list[CountOrZero]
    batch_characters: Count
    steps: Count | None
    seconds: Annotated[float, Above(0)] | None
    eval_views: Count | None


@dataclass(frozen=True)
class Budget:
    """What ends a run, whichever comes first; training time excludes evaluation."""

    steps: Count | None
    seconds: Annotated[float, Above(0)] | None


@dataclass(frozen=True)
class ModelSettings:
    """Settings of the model as a whole."""

    hull: bool
    num_frequencies: Count
    box_centre: list[float]
    box_half_extent: Annotated[float, Above(0)]
    activation: _part("charnerf.models.activations")  # type: ignore[valid-type]


@dataclass(frozen=True)
class RunConfig:
    """The sections of a run, as `conf/train.yaml` composes them."""

    name: str
    seed: CountOrZero
    ckpt_path: str | None
    trusted_targets: list[str]
    model: ModelSettings
    scale: Scale
    budget: Budget
    encoder: _part("charnerf.models.encoders", given=["in_channels"])  # type: ignore[valid-type]
    combinator: _part("charnerf.models.combinators", given=["width"])  # type: ignore[valid-type]
    head: _part("charnerf.models.heads", given=["width"])  # type: ignore[valid-type]
    density: _part("charnerf.models.density", given=["width"])  # type: ignore[valid-type]
    views: _part("charnerf.models.views")  # type: ignore[valid-type]
    features: _part("charnerf.models.features")  # type: ignore[valid-type]
    quadrature: _part("charnerf.volume.quadrature")  # type: ignore[valid-type]
    renderer: _part("charnerf.volume.renderers", given=["quadrature"])  # type: ignore[valid-type]
    loss: _part("charnerf.losses")  # type: ignore[valid-type]
    schedule: _part("charnerf.schedule")  # type: ignore[valid-type]
    data: _part("charnerf.data", "charnerf.capture")  # type: ignore[valid-type]
    optimizer: _part("torch.optim", given=["params"])  # type: ignore[valid-type]
    trainer: _part("lightning")  # type: ignore[valid-type]


MODEL_SECTIONS = (
    "scale",
    "model",
    "encoder",
    "combinator",
    "head",
    "density",
    "views",
    "features",
    "quadrature",
    "renderer",
)


def validate(cfg: DictConfig, *, trusted_targets: Sequence[str] = ()) -> None:
    """Check a composed config whole, before anything is built from it.

    Args:
        cfg: The config, with or without its interpolations resolved.
        trusted_targets: Modules whose classes `_target_` may name besides charnerf's own, as the user typed them. Never take them
            from the config itself: it may have come with a run folder from elsewhere.

    Raises:
        ConfigError: Lists every problem, each with its full key.
    """
    _validate_against(RunConfig, cfg, trusted_targets)


def validate_model(cfg: DictConfig, *, trusted_targets: Sequence[str] = ()) -> None:
    """Check the sections that the model needs (`MODEL_SECTIONS`) of a config that came with weights; as `validate` does."""
    hints = get_type_hints(RunConfig, include_extras=True)
    schema = make_dataclass("ModelConfig", [(name, hints[name]) for name in MODEL_SECTIONS], frozen=True)
    chosen = OmegaConf.masked_copy(cfg, [name for name in MODEL_SECTIONS if name in cfg])
    _validate_against(schema, chosen, trusted_targets)


def _validate_against(schema: type, cfg: DictConfig, trusted_targets: Sequence[str]) -> None:
    problems = Problems(trusted=tuple(trusted_targets))
    plain = to_plain(cfg, "", problems)
    check_section(schema, plain, "", problems)
    for keys, rule in RULES:
        values = [look_up(plain, key) for key in keys]
        if not any(value is BROKEN or problems.touch(key) for key, value in zip(keys, values, strict=True)):
            for key, message in rule(*values):
                problems.add(key, message)
    check_ranges(plain, "", problems)
    if problems.found:
        raise ConfigError(as_message(problems.lines()))


def as_message(lines: Sequence[str]) -> str:
    """One message for a list of problems."""
    if len(lines) == 1:
        return lines[0]
    return "\n".join([f"The config has {len(lines)} problems:", *(f"  {line}" for line in lines)])


def to_plain(node: Any, key: str, problems: Problems) -> Any:
    """Resolve a config into dicts, lists and values; what can not be read becomes a problem."""
    if isinstance(node, DictConfig):
        names: Sequence[Any] = list(node.keys())
    elif isinstance(node, ListConfig):
        names = range(len(node))
    else:
        return node
    values = {}
    for name in names:
        try:
            missing = OmegaConf.is_missing(node, name)
            values[name] = MISSING if missing else to_plain(node[name], join(key, name), problems)
        except OmegaConfBaseException as error:
            first_line = str(error).splitlines()[0]
            problems.add(join(key, name), f"can not be read: {first_line}; correct what it refers to.")
            values[name] = BROKEN
    return list(values.values()) if isinstance(node, ListConfig) else values


def look_up(plain: Any, key: str) -> Any:
    """Value at a full key, BROKEN where there is none."""
    for name in key.split("."):
        if not isinstance(plain, Mapping) or name not in plain:
            return BROKEN
        plain = plain[name]
    return plain


Rule = Callable[..., Iterator[tuple[str, str]]]


def _heads_divide_width(heads: int, width: int) -> Iterator[tuple[str, str]]:
    if heads < 1 or width % heads:
        yield "combinator.num_heads", f"found {heads}, expected a divisor of scale.width = {width}."


def _something_ends_the_run(steps: int | None, seconds: float | None) -> Iterator[tuple[str, str]]:
    if steps is None and seconds is None:
        yield (
            "budget.steps",
            "found null, and budget.seconds null too; set one of them, or the run never ends.",
        )


def _phases_are_a_schedule(phases: Sequence[Mapping[str, Any]]) -> Iterator[tuple[str, str]]:
    built: list[Phase] = []
    for index, phase in enumerate(phases):
        try:
            built.append(Phase(**{name: value for name, value in phase.items() if name != "_target_"}))
        except ConfigError as error:
            where, message = str(error).split(": ", maxsplit=1)
            yield f"schedule.phases.{index}.{where}", message
            return
    try:
        PhaseSchedule(phases=built)
    except ConfigError as error:
        where, message = str(error).split(": ", maxsplit=1)
        yield where, message


def _some_term_counts(weights: Mapping[str, float]) -> Iterator[tuple[str, str]]:
    if not any(weight > 0 for weight in weights.values()):
        yield "loss.weights", f"found {dict(weights)}, expected at least one weight above 0."
    for term, weight in weights.items():
        if weight < 0:
            yield f"loss.weights.{term}", f"found {weight}, expected 0 or more."


def _at_least_one(key: str) -> tuple[tuple[str, ...], Rule]:
    def rule(value: Any) -> Iterator[tuple[str, str]]:
        if isinstance(value, int | float) and value < 1:
            yield key, f"found {value}, expected at least 1."

    return (key,), rule


RULES: tuple[tuple[tuple[str, ...], Rule], ...] = (
    (("combinator.num_heads", "scale.width"), _heads_divide_width),
    (("budget.steps", "budget.seconds"), _something_ends_the_run),
    (("schedule.phases",), _phases_are_a_schedule),
    (("loss.weights",), _some_term_counts),
    _at_least_one("data.views"),
    _at_least_one("data.train"),
    _at_least_one("data.val"),
    _at_least_one("data.test"),
)


def check_ranges(plain: Any, key: str, problems: Problems) -> None:
    """Find every section with `near` and `far` whose near is not below its far."""
    if isinstance(plain, list):
        plain = dict(enumerate(plain))
    if not isinstance(plain, Mapping):
        return
    near, far = plain.get("near"), plain.get("far")
    if isinstance(near, int | float) and isinstance(far, int | float) and not near < far:
        problems.add(join(key, "near"), f"found {near}, expected below {join(key, 'far')} = {far}.")
    for name, value in plain.items():
        check_ranges(value, join(key, name), problems)
