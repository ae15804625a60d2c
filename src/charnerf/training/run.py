"""One run from a validated config: prepare data, train, evaluate the test split, mesh, report."""

import logging
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import lightning as L
from omegaconf import DictConfig

from charnerf.data.base import AbstractData
from charnerf.data.datamodule import MixedDataModule
from charnerf.data.sampler import Share
from charnerf.distributed import gathered
from charnerf.files import named_full_disk, write_text
from charnerf.inference.build import build_model, build_part, build_renderer
from charnerf.inference.weights import save_config, save_weights
from charnerf.interruption import Stopped, held
from charnerf.losses.base import Needs
from charnerf.losses.total import WeightedLosses
from charnerf.models.charnerf import CharNeRF
from charnerf.thread_count import restored_threads
from charnerf.training.board import Board
from charnerf.training.checkpoint import find_checkpoint
from charnerf.training.clock import RunClock
from charnerf.training.data import build_data
from charnerf.training.finish import finish_run
from charnerf.training.identity import RunIdentity, WrittenRun, data_of, settings_of, written_run
from charnerf.training.module import TrainingModule
from charnerf.training.processes import first_speaks, meet, processes_to_begin, run_processes
from charnerf.training.run_lock import RunLock
from charnerf.training.start import begin
from charnerf.training.threads import ThreadTuner, may_choose
from charnerf.training.trainer import build_trainer
from charnerf.volume.renderers.base import AbstractRenderer

log = logging.getLogger(__name__)
START_FILE = "start.txt"  # where the weights of a run began, if that was not random


@dataclass(frozen=True)
class _Prepared:
    """A run that has been checked; what it reads is there.

    Attributes:
        cfg: Its config.
        folder: Its folder.
        root: The data set's.
        checkpoint: From which it goes on; None where it begins.
        identity: What its checkpoints say of it.
    """

    cfg: DictConfig
    folder: Path
    root: Path
    checkpoint: Path | None
    identity: RunIdentity


@dataclass(frozen=True)
class _Network:
    """The model before it is trained, and where its weights began if that was not random."""

    model: CharNeRF
    start: str | None


def run_training(
    cfg: DictConfig,
    folder: Path,
    *,
    accepted: Callable[[], object] = lambda: None,
    begin_process: Callable[[], object] = lambda: None,
) -> None:
    """Train, evaluate and report into a run folder.

    Args:
        cfg: Composed and validated.
        folder: The run folder (design: On disk); made if it is missing.
        accepted: Called before training, once nothing in the folder speaks against it.
        begin_process: Sets each process that a training on several devices begins, as the caller's own is set; a function of a
            module.
    """
    _hush_lightning()
    count = processes_to_begin(cfg)
    share = meet(cfg) if count == 1 else Share()
    with RunLock(folder) as lock:
        if share.processes > 1:
            with first_speaks(share):
                _train_in(lambda: None, lock, _from_first(cfg, lock, accepted, share), share)
            return
        prepared, network = _prepare(cfg, lock)
        accepted()
        if count == 1:
            _train(prepared, network)
            return
        log.info("Trains in %d processes; rays, points and characters a step are of each.", count)
        with held():  # they have a checkpoint to write
            run_processes(partial(_train_in, begin_process, lock, prepared), count)


def _train_in(begin_process: Callable[[], object], lock: RunLock, prepared: _Prepared, share: Share) -> None:
    """Train as one process of several; each holds the folder."""
    _hush_lightning()
    begin_process()
    with lock:
        _train(prepared, _begin(prepared.cfg, prepared.checkpoint))


def _from_first(cfg: DictConfig, lock: RunLock, accepted: Callable[[], object], share: Share) -> _Prepared:
    """What the first of several processes prepares, its folder too; its error is that of all."""
    outcome: _Prepared | Exception | None = None
    if share.process == 0:
        try:
            outcome, _ = _prepare(cfg, lock)
            accepted()
        except Exception as error:
            outcome = error
    first = gathered(outcome)[0]
    if isinstance(first, Exception):
        raise first
    assert first is not None
    return first


def _hush_lightning() -> None:
    """The bar and the report say what Lightning would."""
    for name in ("lightning.pytorch", "lightning.fabric"):
        logging.getLogger(name).setLevel(logging.WARNING)


def _prepare(cfg: DictConfig, lock: RunLock) -> tuple[_Prepared, _Network]:
    """Check everything that can be checked before the work, hold the folder, and make the data set."""
    folder = lock.folder
    source: AbstractData = build_part(cfg.data)
    source.check_image_size(cfg.scale.image_size)
    source.check_splits(**cfg.splits)
    folder.mkdir(parents=True, exist_ok=True)
    lock.take()
    checkpoint = find_checkpoint(cfg.ckpt_path, folder)
    before = None if checkpoint is None else written_run(checkpoint)
    if before is not None:
        before.check_config(cfg)
    _, needs = build_losses(cfg)
    network = _begin(cfg, checkpoint)
    root = source.prepare(depth=needs.depth)
    return _Prepared(cfg, folder, root, checkpoint, _identity(cfg, folder, root, before)), network


def _begin(cfg: DictConfig, checkpoint: Path | None) -> _Network:
    """Build the model; the same each time."""
    L.seed_everything(cfg.seed, verbose=False)
    model = build_model(cfg)
    return _Network(model, begin(model, cfg) if checkpoint is None else None)


@restored_threads()
def _train(prepared: _Prepared, network: _Network) -> None:
    """Train, evaluate and report; in each of the processes where there are several."""
    cfg, folder, root, model = prepared.cfg, prepared.folder, prepared.root, network.model
    losses, needs = build_losses(cfg)
    clock = RunClock(steps=cfg.budget.steps, seconds=cfg.budget.seconds)
    renderer = build_renderer(cfg)
    module = build_module(cfg, model, renderer, losses, clock)
    data = build_data(cfg, root, model, clock, needs)
    board = Board(folder=folder / "tensorboard", clock=clock, settings=settings_of(cfg))
    threads = ThreadTuner(adapts=may_choose(budget_seconds=cfg.budget.seconds))
    with held(), named_full_disk(folder):  # until a checkpoint, or the weights, are whole
        trainer = build_trainer(cfg, folder, clock, losses.names, board, threads, prepared.identity)
        if trainer.is_global_zero:
            _note_start(folder, network.start)
        _fit(trainer, module, data, prepared.checkpoint)
        if trainer.is_global_zero:
            save_weights(folder / "weights.safetensors", model, cfg)
            save_config(folder, cfg)
    with _trained(folder), named_full_disk(folder):
        finish_run(
            cfg,
            folder,
            root,
            model.eval(),
            renderer,
            train_seconds=clock.seconds,
            threads=threads,
            trainer=trainer,
            board=board,
        )


def _identity(cfg: DictConfig, folder: Path, root: Path, before: WrittenRun | None) -> RunIdentity:
    """What the run's checkpoints say of it; its config is written if it is new, else with the next checkpoint."""
    identity = RunIdentity(cfg, data_of(cfg, root))
    if before is None:
        save_config(folder, cfg)
    else:
        before.check_data(identity.data)
    return identity


def _note_start(folder: Path, start: str | None) -> None:
    """Say where the weights of a run began, if that was not random."""
    if start is not None:
        log.warning(start)
        write_text(folder / START_FILE, f"{start}\n")


@contextmanager
def _trained(folder: Path) -> Iterator[None]:
    """Say what is there where a signal stops what follows training."""
    try:
        yield
    except Stopped:
        log.warning(
            "Stopped after training; the weights are %s. The same command evaluates them, a single run's with"
            " hydra.run.dir=%s ckpt_path=last",
            folder / "weights.safetensors",
            folder,
        )
        raise


def _fit(trainer: L.Trainer, module: TrainingModule, data: MixedDataModule, checkpoint: Path | None) -> None:
    """Train, without what Lightning warns of and does not concern us."""
    with warnings.catch_warnings():
        # the loaders are fed from memory, one request at a time: more workers would not help
        warnings.filterwarnings("ignore", message=".*does not have many workers.*")
        warnings.filterwarnings("ignore", message=".*LeafSpec.*", category=DeprecationWarning)
        warnings.filterwarnings("ignore", message=".*LeafSpec.*", category=FutureWarning)
        trainer.fit(module, datamodule=data, ckpt_path=checkpoint, weights_only=checkpoint is not None)


def build_losses(cfg: DictConfig) -> tuple[WeightedLosses, Needs]:
    """The loss, and what its terms need in any phase of the run."""
    losses = WeightedLosses({str(name): build_part(term) for name, term in cfg.loss.items()})
    return losses, losses.needs(build_part(cfg.schedule))


def build_module(
    cfg: DictConfig, model: CharNeRF, renderer: AbstractRenderer, losses: WeightedLosses, clock: RunClock
) -> TrainingModule:
    """What is trained, validated by a renderer."""
    return TrainingModule(
        model=model,
        renderer=training_renderer(cfg),
        eval_renderer=renderer,
        losses=losses,
        optimizer=build_part(cfg.optimizer),
        final_rate=cfg.optimization.final_lr_scale,
        position=clock.position,
    )


def training_renderer(cfg: DictConfig) -> AbstractRenderer:
    """The renderer with the training's own number of coarse samples."""
    changed = cfg.copy()
    changed.renderer.num_coarse = cfg.scale.train_num_coarse
    return build_renderer(changed)
