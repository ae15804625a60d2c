"""`charnerf train` and `python train.py`: one door, a run or with -m a grid; Hydra reads its arguments."""

import os
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from charnerf.cli.messages import say
from charnerf.interruption import Stopped, end_with_parent, is_listening, listening
from charnerf.process import (
    keep_freed_memory,
    leave_disk_errors_to_callers,
    limit_spinning,
    start_processes_as_usual,
    use_fastest_products,
)

if TYPE_CHECKING:
    from omegaconf import DictConfig

Job = Callable[["DictConfig"], None]
HYDRA_READS_ALL = {"allow_extra_args": True, "ignore_unknown_options": True, "help_option_names": []}


def command(context: typer.Context) -> None:
    """Train a run, or a grid: [group=option ...] [key=value ...] [-m]; its --help lists groups and keys.

    The same grid typed again skips its finished cells and goes on with the others.
    """
    if context.obj:  # --debug
        os.environ["HYDRA_FULL_ERROR"] = "1"
    raise typer.Exit(main(context.args))


def main(arguments: Sequence[str], *, conf: Path | None = None) -> int:
    """Train a run, or a grid.

    Args:
        arguments: Hydra's.
        conf: Folder of the config files; the package's own if None.

    Returns:
        Exit status: 0 done, 1 failed, 2 wrong call; 130, 143 and 129 stopped by SIGINT (Ctrl-C), SIGTERM and
        SIGHUP, with a checkpoint.
        HYDRA_FULL_ERROR=1 shows tracebacks.
    """
    limit_spinning()
    try:
        with listening():
            from charnerf.config.command_line import run_door
            from charnerf.config.options import conf_folder

            folder = (conf or conf_folder()).resolve()
            return run_door(lambda: _train(list(arguments), folder), arguments=arguments, conf=folder)
    except Stopped as stop:
        say(str(stop))
        return stop.status


def _train(arguments: list[str], conf: Path) -> None:
    """Train a run, or a grid."""
    import hydra

    from charnerf.config.grid import grid_command
    from charnerf.config.job_files import run_arguments

    train = hydra.main(version_base="1.3", config_path=str(conf), config_name="train")
    grid = grid_command(arguments)
    sys.argv[1:] = run_arguments(arguments) if grid is None else grid.arguments  # where Hydra reads them
    if grid is None:
        _train_run(train)
    else:
        _train_grid(train(run_job), grid.folder)


def _train_run(train: Callable[[Job], Callable[[], object]]) -> None:
    """Train a run; its error goes past Hydra, which would print the overrides before it."""
    failed: list[Exception] = []

    def job(cfg: "DictConfig") -> None:
        try:
            run_job(cfg)
        except Exception as error:
            failed.append(error)

    train(job)()
    if failed:
        raise failed[0]


def _train_grid(train: Callable[[], object], folder: Path) -> None:
    """Train a grid, and report over it, also if some of its cells failed."""
    from charnerf.errors import GridError
    from charnerf.training.grid import begin_grid, check_grid, is_lost_worker, report_grid

    since = begin_grid(folder)
    try:
        train()
    except Exception as error:
        if is_lost_worker(error):
            raise GridError(
                f"{folder}: a process of the launcher was killed, which ended the others, expected all to live; was there"
                " memory enough? The same command goes on with what is not done."
            ) from error
        raise
    finally:
        report_grid(folder)
    check_grid(folder, since=since)


def run_job(cfg: "DictConfig") -> None:
    """One job, perhaps in a process that a launcher began: training, evaluation, report."""
    if not is_listening():  # a launcher's
        end_with_parent()
        start_processes_as_usual()
    with listening():
        _run_job(cfg)


def _run_job(cfg: "DictConfig") -> None:
    begin_process()
    from hydra.core.hydra_config import HydraConfig
    from hydra.types import RunMode

    from charnerf.config import validate
    from charnerf.config.job_files import save_job
    from charnerf.config.overrides import trusted_by
    from charnerf.training.cells import run_cell
    from charnerf.training.processes import check_alone
    from charnerf.training.run import run_training

    job = HydraConfig.get()
    validate(cfg, trusted_targets=trusted_by(list(job.overrides.task)))
    folder = Path(job.runtime.output_dir)
    train = partial(run_training, begin_process=begin_process)
    if job.mode is RunMode.MULTIRUN:
        check_alone(cfg)
        run_cell(cfg, Path(job.sweep.dir), name=job.job.override_dirname, job_folder=folder, train=train)
    else:
        train(cfg, folder, accepted=partial(save_job, folder, cfg))


def begin_process() -> None:
    """Set the process: this one, or one that a training on several devices begins."""
    keep_freed_memory()
    use_fastest_products()
    leave_disk_errors_to_callers()
