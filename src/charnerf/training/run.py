"""One run from a validated config: prepare data, train, evaluate the test split, mesh, report."""

import logging
import warnings
from collections.abc import Callable, Sequence
from datetime import timedelta
from pathlib import Path
from typing import Any

import lightning as L
from lightning.pytorch.callbacks import ModelCheckpoint
from lightning.pytorch.loggers import TensorBoardLogger
from omegaconf import DictConfig, OmegaConf
from torch.utils.tensorboard.summary import hparams

from charnerf.data.augmentation.sequence import AugmentationSequence
from charnerf.data.base import AbstractData
from charnerf.data.characters import Character
from charnerf.data.datamodule import MixedDataModule
from charnerf.data.layout import names_of, read_dataset
from charnerf.data.mixed import MixedDataset
from charnerf.data.sampler import PhaseSampler
from charnerf.data.store import CharacterStore, SurfaceOf, no_surface
from charnerf.data.surface import AbstractSurface
from charnerf.errors import ConfigError
from charnerf.inference.build import build_model, build_part, build_renderer
from charnerf.inference.weights import save_config, save_weights
from charnerf.losses.base import Needs
from charnerf.losses.total import WeightedLosses
from charnerf.models.charnerf import CharNeRF
from charnerf.surfaces.mesh_files import load_surface_mesh
from charnerf.training.averaging import WeightAverage
from charnerf.training.clock import RunClock
from charnerf.training.finish import finish_run
from charnerf.training.guards import FiniteGuard, WhiteAlarm
from charnerf.training.module import TrainingModule
from charnerf.training.monitor import BudgetBar, CurveWriter, PictureLogger
from charnerf.training.start import begin
from charnerf.training.threads import ThreadTuner, may_choose, restored_threads
from charnerf.volume.renderers.base import AbstractRenderer

log = logging.getLogger(__name__)
START_FILE = "start.txt"  # where the weights of a run began, if that was not random
CHECKPOINT_EVERY = timedelta(minutes=5)  # at least; validations write checkpoints too
HYPER_METRICS = ("val/psnr", "val/psnr_foreground", "val/ssim")  # columns beside the hyper-parameters


@restored_threads()
def run_training(cfg: DictConfig, folder: Path) -> None:
    """Train, evaluate and report into a run folder.

    Args:
        cfg: Composed and validated.
        folder: The run folder (design: On disk); made if it is missing.
    """
    logging.getLogger("lightning.pytorch").setLevel(logging.WARNING)  # the bar and the report say the rest
    L.seed_everything(cfg.seed, verbose=False)
    source: AbstractData = build_part(cfg.data)
    source.check_image_size(cfg.scale.image_size)
    folder.mkdir(parents=True, exist_ok=True)
    checkpoint = find_checkpoint(cfg.ckpt_path, folder)
    save_config(folder, cfg)
    losses, needs = build_losses(cfg)
    model = build_model(cfg)
    start = begin(model, cfg) if checkpoint is None else None
    root = source.prepare(depth=needs.depth)
    check_splits(root, cfg.splits)
    clock = RunClock(steps=cfg.budget.steps, seconds=cfg.budget.seconds)
    renderer = build_renderer(cfg)
    module = TrainingModule(
        model=model,
        renderer=training_renderer(cfg),
        eval_renderer=renderer,
        losses=losses,
        optimizer=build_part(cfg.optimizer),
        final_rate=cfg.optimization.final_lr_scale,
        position=clock.position,
        seed=cfg.seed,
    )
    data = build_data(cfg, root, model, clock, needs)
    threads = ThreadTuner(adapts=may_choose(budget_seconds=cfg.budget.seconds))
    trainer = build_trainer(cfg, folder, clock, losses.names, threads)
    if trainer.is_global_zero:
        log_hyperparameters(trainer, cfg, model)
        if start is not None:
            log.warning(start)
            (folder / START_FILE).write_text(f"{start}\n", encoding="utf-8")
    with warnings.catch_warnings():
        # the loaders are fed from memory, one request at a time: more workers would not help
        warnings.filterwarnings("ignore", message=".*does not have many workers.*")
        warnings.filterwarnings("ignore", message=".*LeafSpec.*", category=DeprecationWarning)
        warnings.filterwarnings("ignore", message=".*LeafSpec.*", category=FutureWarning)
        trainer.fit(module, datamodule=data, ckpt_path=checkpoint, weights_only=checkpoint is not None)
    if trainer.is_global_zero:
        save_weights(folder / "weights.safetensors", model, cfg)
        finish_run(
            cfg,
            folder,
            root,
            model.eval(),
            renderer,
            train_seconds=clock.seconds,
            threads=threads,
            trainer=trainer,
        )


def check_splits(root: Path, splits: DictConfig) -> None:
    """Check that every split that a run reads has characters; the last is read after training.

    Raises:
        DataError: If one has none.
    """
    info = read_dataset(root)
    for split in (*splits.train, splits.val, splits.test):
        names_of(info, split)


def build_losses(cfg: DictConfig) -> tuple[WeightedLosses, Needs]:
    """The loss, and what its terms need in any phase of the run."""
    losses = WeightedLosses({str(name): build_part(term) for name, term in cfg.loss.items()})
    return losses, losses.needs(build_part(cfg.schedule))


def build_data(
    cfg: DictConfig, root: Path, model: CharNeRF, clock: RunClock, needs: Needs
) -> MixedDataModule:
    """The datamodule; what no loss needs is not opened."""
    splits, batches, validation = cfg.splits, cfg.batches, cfg.validation

    def make_dataset(store: CharacterStore) -> MixedDataset:
        return MixedDataset(
            store=store,
            characters=cfg.scale.batch_characters,
            foreground_share=batches.foreground_share,
            needs=needs,
            used_views=model.views,
            augmentation=AugmentationSequence(
                [build_part(one, {"used_views": model.views}) for one in cfg.augmentation.values()]
            ),
            seed=cfg.seed,
        )

    return MixedDataModule(
        root=root,
        train_splits=list(splits.train),
        val_split=splits.val,
        val_characters=validation.characters,
        val_views=validation.views,
        carve=model.carve,
        memory_mib=batches.memory_mib,
        workers=batches.workers,
        surface_of=_surface_of(cfg) if needs.surface else no_surface,
        make_dataset=make_dataset,
        sampler=PhaseSampler(
            schedule=build_part(cfg.schedule), position=clock.position, num_marks=validation.times
        ),
    )


def _surface_of(cfg: DictConfig) -> SurfaceOf:
    """Opens a character's surface; None without a mesh, which is logged once."""
    make_surface: Callable[..., AbstractSurface] = build_part(cfg.surface)
    told: set[str] = set()

    def surface_of(character: Character) -> AbstractSurface | None:
        if character.mesh_file is None:
            if not told:
                log.warning("Character %s has no mesh: it is trained by rays alone.", character.name)
                told.add(character.name)
            return None
        return make_surface(load_surface_mesh(character.mesh_file))

    return surface_of


def build_trainer(
    cfg: DictConfig, folder: Path, clock: RunClock, values: Sequence[str], *more: L.Callback
) -> L.Trainer:
    """Lightning's trainer with our callbacks; the budget, not Lightning, bounds the run.

    Args:
        cfg: Of the run.
        folder: The run folder.
        clock: Of the run.
        values: Names of the loss's values.
        more: Further callbacks.
    """
    averages = [] if cfg.averaging.decay is None else [WeightAverage(decay=cfg.averaging.decay)]
    callbacks = [
        clock,
        *more,
        *averages,  # before what reads the weights at validation
        BudgetBar(clock=clock),
        FiniteGuard(folder=folder),
        WhiteAlarm(),
        CurveWriter(path=folder / "curve.csv", clock=clock, values=values),
        PictureLogger(),
        ModelCheckpoint(
            dirpath=folder / "checkpoints",
            filename="best",
            monitor="val/psnr_foreground",
            mode="max",
            enable_version_counter=False,
        ),
        # of its own: Lightning's `save_last` writes only where the best improved
        ModelCheckpoint(dirpath=folder / "checkpoints", filename="last", enable_version_counter=False),
        ModelCheckpoint(  # the same file between two validations that are far apart
            dirpath=folder / "checkpoints",
            filename="last",
            train_time_interval=CHECKPOINT_EVERY,
            enable_version_counter=False,
        ),
    ]
    return build_part(
        cfg.trainer,
        {
            "callbacks": callbacks,
            "logger": TensorBoardLogger(str(folder), name="", version="tensorboard", default_hp_metric=False),
            "max_epochs": -1,
            "num_sanity_val_steps": 0,
            "enable_progress_bar": False,
            "enable_model_summary": False,
            "use_distributed_sampler": False,
            "gradient_clip_val": cfg.optimization.gradient_clip,
            "log_every_n_steps": 20,
        },
    )


def training_renderer(cfg: DictConfig) -> AbstractRenderer:
    """The renderer with the training's own number of coarse samples."""
    changed = cfg.copy()
    changed.renderer.num_coarse = cfg.scale.train_num_coarse
    return build_renderer(changed)


def find_checkpoint(ckpt_path: str | None, folder: Path) -> Path | None:
    """The checkpoint that a run goes on from.

    Args:
        ckpt_path: None, a file, or `last`: of this run folder, else of the newest run beside it.
        folder: The run folder.

    Raises:
        ConfigError: If there is none.
    """
    if ckpt_path is None:
        return None
    if ckpt_path != "last":
        if Path(ckpt_path).is_file():
            return Path(ckpt_path).resolve()
        raise ConfigError(
            f"ckpt_path: found {ckpt_path!r}, which is no file; expected a .ckpt, `last` or null."
        )
    own = folder / "checkpoints" / "last.ckpt"
    others = sorted(folder.parent.glob("*/checkpoints/last.ckpt"), key=lambda path: path.stat().st_mtime)
    if own.is_file():
        return own
    if others:
        log.info("Going on from %s.", others[-1])
        return others[-1].resolve()
    raise ConfigError(
        f"ckpt_path: found `last`, but no run beside {folder} has checkpoints/last.ckpt; name the .ckpt, or set "
        "hydra.run.dir to the run to go on with."
    )


def log_hyperparameters(trainer: L.Trainer, cfg: DictConfig, model: CharNeRF) -> None:
    """Write the config and the number of parameters to TensorBoard's events and to hparams.yaml."""
    assert isinstance(trainer.logger, TensorBoardLogger)
    size = sum(parameter.numel() for parameter in model.parameters())
    values = {**_flat(OmegaConf.to_container(cfg, resolve=True)), "num_parameters": size}
    trainer.logger.log_hyperparams(values)  # writes no event unless it is given a metric's value
    for summary in hparams(values, dict.fromkeys(HYPER_METRICS, 0.0)):
        trainer.logger.experiment.file_writer.add_summary(summary)


def _flat(node: Any, key: str = "") -> dict[str, bool | int | float | str]:
    """Values of nested sections by their full keys."""
    if not isinstance(node, dict | list):
        return {key: node if isinstance(node, bool | int | float | str) else str(node)}
    items = node.items() if isinstance(node, dict) else enumerate(node)
    flat: dict[str, bool | int | float | str] = {}
    for name, value in items:
        flat |= _flat(value, f"{key}.{name}" if key else str(name))
    return flat
