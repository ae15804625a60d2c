"""What no single value of a config can show: combinations that can not work."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from hydra.utils import get_object

from charnerf.errors import ConfigError
from charnerf.schedule import Phase, PhaseSchedule

LONGEST_NAME = 120  # characters
LEAST_SQUARE = 31  # pixels, of a square that AlexNet looks at: of smaller ones its last maps have no pixel

Rule = Callable[..., Iterator[tuple[str, str]]]


def _heads_divide_width(heads: int, width: int, inner: int | None) -> Iterator[tuple[str, str]]:
    wide, name = (width, "model.width") if inner is None else (inner, "combinator.attention_width")
    if wide < 1:
        yield name, f"found {wide}, expected at least 1."
    elif heads < 1 or wide % heads:
        yield "combinator.num_heads", f"found {heads}, expected a divisor of {name} = {wide}."


def _names_a_folder(name: str) -> Iterator[tuple[str, str]]:
    is_one = (
        name.isprintable() and not set("/\\") & set(name) and name.strip(". ") and len(name) <= LONGEST_NAME
    )
    if not is_one:
        yield (
            "name",
            f"found {name[:60]!r}, expected a folder's own name, no path: run folders lie in outputs/NAME.",
        )


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


def _some_term_counts(terms: Mapping[str, Mapping[str, Any]]) -> Iterator[tuple[str, str]]:
    weights = {
        f"loss.{term}.{name}": value
        for term, settings in terms.items()
        for name, value in settings.items()
        if name == "weight" or name.endswith("_weight")
    }
    if not any(weight > 0 for weight in weights.values()):
        yield "loss", f"found weights of 0 ({', '.join(weights)}), expected at least one weight above 0."
    for key, weight in weights.items():
        if weight < 0:
            yield key, f"found {weight}, expected 0 or more."


def _labelled_points_lie_in_a_hull(
    weight: float, phases: Sequence[Mapping[str, Any]], hull: bool
) -> Iterator[tuple[str, str]]:
    if hull:
        return
    reason = "reads labelled points, expected a hull to draw them in"
    if weight > 0:
        yield (
            "model.hull",
            f"found false, but loss.occupancy {reason}; set loss.occupancy.weight=0 or model.hull=true.",
        )
    for index, phase in enumerate(phases):
        if (phase.get("loss_weights") or {}).get("occupancy", 0.0) > 0:
            key = f"schedule.phases.{index}.loss_weights.occupancy"
            yield "model.hull", f"found false, but {key} {reason}; set schedule=constant or model.hull=true."


def _squares_are_drawn(
    weight: float, phases: Sequence[Mapping[str, Any]], image_size: int
) -> Iterator[tuple[str, str]]:
    for index, phase in enumerate(phases):
        square = phase.get("square", 0)
        if (phase.get("loss_weights") or {}).get("perceptual", weight) <= 0:
            continue
        reason = f"but loss.perceptual looks at squares of rays in phase {index}, expected at least {LEAST_SQUARE} pixels"
        if square < LEAST_SQUARE:
            key = f"schedule.phases.{index}.square"
            yield (
                key,
                f"found {square}, {reason}; set it (64), schedule=perceptual_last or loss.perceptual.weight=0.",
            )
        if image_size < LEAST_SQUARE:
            yield (
                "scale.image_size",
                f"found {image_size}, {reason}; set schedule=constant and loss.perceptual.weight=0.",
            )


def _average_moves(decay: float | None) -> Iterator[tuple[str, str]]:
    if isinstance(decay, int | float) and decay >= 1:
        yield "averaging.decay", f"found {decay}, expected below 1: at 1 the average would never move."


def _bounded(key: str, holds: Callable[[float], bool], expected: str) -> tuple[tuple[str, ...], Rule]:
    def rule(value: Any) -> Iterator[tuple[str, str]]:
        if isinstance(value, int | float) and not holds(value):
            yield key, f"found {value}, expected {expected}."

    return (key,), rule


_above_zero = partial(_bounded, holds=lambda value: value > 0, expected="more than 0")
_at_least_one = partial(_bounded, holds=lambda value: value >= 1, expected="at least 1")


RULES: tuple[tuple[tuple[str, ...], Rule], ...] = (
    (("name",), _names_a_folder),
    (("combinator.num_heads", "model.width", "combinator.attention_width"), _heads_divide_width),
    (("budget.steps", "budget.seconds"), _something_ends_the_run),
    (("schedule.phases",), _phases_are_a_schedule),
    (("loss",), _some_term_counts),
    (("loss.occupancy.weight", "schedule.phases", "model.hull"), _labelled_points_lie_in_a_hull),
    (("loss.perceptual.weight", "schedule.phases", "model.image_size"), _squares_are_drawn),
    (("averaging.decay",), _average_moves),
    _above_zero("combinator.lr_scale"),
    _above_zero("combinator.temperature"),
    _above_zero("optimizer.lr"),
    _above_zero("optimizer.matrix_lr"),
    _above_zero("space.spread"),
    _at_least_one("space.pool_size"),
    _at_least_one("space.num_directions"),
    _bounded("space.near_share", holds=lambda share: 0 <= share <= 1, expected="a share, 0 to 1"),
    _at_least_one("data.views"),
    _at_least_one("data.train"),
    _at_least_one("data.val"),
    _at_least_one("data.test"),
)


def idle_settings(plain: Mapping[str, Any]) -> list[str]:
    """Settings of a valid config that have no effect in its combination, each with what to do."""
    idle = []
    features = str(plain["features"]["_target_"])
    if get_object(features).reads_hull and not plain["model"]["hull"]:
        option = features.split(".")[-2]  # one option, one file
        idle.append(
            f"features={option} reads the hull, but model.hull=false: it reads zeros; use features=image."
        )
    for index, phase in enumerate(plain["schedule"]["phases"]):
        for unit, end in (phase.get("until") or {}).items():
            limit = plain["budget"].get(unit)
            if limit is not None and end >= limit:
                idle.append(
                    f"schedule.phases.{index}.until.{unit}={end}, but budget.{unit}={limit}: later phases"
                    " never begin."
                )
    return idle
