"""Train: `python train.py [group=option ...] [key=value ...]`; `-m` trains a grid and reports over it.

The same grid typed again skips its finished cells and goes on with the others. Exit status: 0 done, 1 failed, 2 wrong
call. HYDRA_FULL_ERROR=1 shows tracebacks.
"""

import sys
from pathlib import Path

import hydra
from hydra.core.hydra_config import HydraConfig
from hydra.types import RunMode
from omegaconf import DictConfig

from charnerf.config import validate
from charnerf.config.composition import run_door, trusted_by
from charnerf.config.grid import grid_command
from charnerf.errors import GridError
from charnerf.process import keep_freed_memory, limit_spinning, use_fastest_products


@hydra.main(version_base="1.3", config_path="conf", config_name="train")
def train(cfg: DictConfig) -> None:
    """One job: training, evaluation, report."""
    from charnerf.training.cells import run_cell
    from charnerf.training.run import run_training

    keep_freed_memory()  # here, since a launcher may run the job in a process of its own
    use_fastest_products()
    job = HydraConfig.get()
    validate(cfg, trusted_targets=trusted_by(list(job.overrides.task)))
    folder = Path(job.runtime.output_dir)
    if job.mode is RunMode.MULTIRUN:
        run_cell(cfg, Path(job.sweep.dir), name=job.job.override_dirname, job_folder=folder)
    else:
        run_training(cfg, folder)


def train_all() -> None:
    """Train a run; or a grid, and report over it, also if some of its cells failed."""
    from charnerf.training.grid import begin_grid, check_grid, is_lost_worker, report_grid

    grid = grid_command(sys.argv[1:])
    if grid is None:
        train()
        return
    sys.argv[1:] = grid.arguments
    since = begin_grid(grid.folder)
    try:
        train()
    except Exception as error:
        if is_lost_worker(error):
            raise GridError(
                f"{grid.folder}: a process of the launcher was killed, which ended the others, expected all to live; was there"
                " memory enough? The same command goes on with what is not done."
            ) from error
        raise
    finally:
        report_grid(grid.folder)
    check_grid(grid.folder, since=since)


if __name__ == "__main__":
    limit_spinning()
    sys.exit(run_door(train_all, arguments=sys.argv[1:], conf=Path(__file__).resolve().parent / "conf"))
