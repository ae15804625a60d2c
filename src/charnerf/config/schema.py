"""The sections of a config. A group is a part; its schema is the signature of the class that it names."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from charnerf.config.hints import Above, AtLeast, AtMost, Part

Count = Annotated[int, AtLeast(1)]
CountOrZero = Annotated[int, AtLeast(0)]
Share = Annotated[float, AtLeast(0), AtMost(1)]


def _part(group: str, given: Sequence[str] = ()) -> Any:
    return Annotated[Any, Part(group=group, given=frozenset(given))]


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
    train_num_coarse: Count
    num_fine: CountOrZero
    num_guided: CountOrZero
    phase_rays: list[Count]
    phase_surface_points: list[CountOrZero]
    space_points: CountOrZero
    space_pool: Count
    learning_rate: Annotated[float, Above(0)]
    train_characters: Count
    batch_characters: Count
    steps: Count | None
    seconds: Annotated[float, Above(0)] | None
    eval_views: Count | None
    mesh_resolution: Annotated[int, AtLeast(16)]


@dataclass(frozen=True)
class Budget:
    """What ends a run, whichever comes first; training time excludes evaluation."""

    steps: Count | None
    seconds: Annotated[float, Above(0)] | None


@dataclass(frozen=True)
class Splits:
    """Which splits of the data set are trained on, validated on and tested on."""

    train: list[str]
    val: str
    test: str


@dataclass(frozen=True)
class Batches:
    """How training batches are made."""

    foreground_share: Share
    memory_mib: Annotated[float, Above(0)]
    window: Count | None
    window_steps: Count
    workers: CountOrZero | None


@dataclass(frozen=True)
class Validation:
    """How often a run is validated, and on how much."""

    times: Count
    characters: Count | None
    views: Count


@dataclass(frozen=True)
class Optimization:
    """What every optimizer does alike."""

    final_lr_scale: Share
    gradient_clip: Annotated[float, Above(0)] | None


@dataclass(frozen=True)
class Averaging:
    """Which weights are validated and saved: those of the last step, or their moving average."""

    decay: Annotated[float, AtLeast(0)] | None


@dataclass(frozen=True)
class ModelSettings:
    """Settings of the model as a whole; what weights carry with them holds no other sizes."""

    width: Count
    num_single_view_blocks: CountOrZero
    num_multi_view_blocks: CountOrZero
    image_size: Annotated[int, AtLeast(8)]
    hull: bool
    num_frequencies: Count
    box_centre: list[float]
    box_half_extent: Annotated[float, Above(0)]
    activation: _part("activation")  # type: ignore[valid-type]


F1_GIVEN = ("width", "num_frequencies", "num_point_features", "num_blocks")
TRAINER_GIVEN = (
    "callbacks",
    "logger",
    "max_epochs",
    "num_sanity_val_steps",
    "enable_progress_bar",
    "enable_model_summary",
    "use_distributed_sampler",
    "gradient_clip_val",
    "log_every_n_steps",
)


@dataclass(frozen=True)
class RunConfig:
    """The sections of a run, as `conf/train.yaml` composes them."""

    name: str
    seed: CountOrZero
    ckpt_path: str | None
    start_from: str | None
    trusted_targets: list[str]
    model: ModelSettings
    scale: Scale
    budget: Budget
    encoder: _part("encoder", given=["in_channels"])  # type: ignore[valid-type]
    single_view: _part("single_view", given=F1_GIVEN)  # type: ignore[valid-type]
    combinator: _part("combinator", given=["width"])  # type: ignore[valid-type]
    head: _part("head", given=["width"])  # type: ignore[valid-type]
    density: _part("density", given=["width"])  # type: ignore[valid-type]
    views: _part("views")  # type: ignore[valid-type]
    features: _part("features")  # type: ignore[valid-type]
    quadrature: _part("quadrature")  # type: ignore[valid-type]
    renderer: _part("renderer", given=["quadrature"])  # type: ignore[valid-type]
    splits: Splits
    batches: Batches
    validation: Validation
    optimization: Optimization
    averaging: Averaging
    surface_dirs: _part("surface_dirs")  # type: ignore[valid-type]
    space: _part("space", given=["character", "images", "hull"])  # type: ignore[valid-type]
    surface: _part("surface", given=["mesh"])  # type: ignore[valid-type]
    augmentation: dict[str, _part("augmentation", given=["used_views"])]  # type: ignore[valid-type]
    loss: dict[str, _part("loss")]  # type: ignore[valid-type]
    schedule: _part("schedule")  # type: ignore[valid-type]
    data: _part("data")  # type: ignore[valid-type]
    optimizer: _part("optimizer", given=["params"])  # type: ignore[valid-type]
    trainer: _part("trainer", given=TRAINER_GIVEN)  # type: ignore[valid-type]


LIST_GROUPS = ("augmentation",)  # any number of options, in order, each a part of its own
MODEL_SECTIONS = (
    "model",
    "encoder",
    "single_view",
    "combinator",
    "head",
    "density",
    "views",
    "features",
    "quadrature",
    "renderer",
)
