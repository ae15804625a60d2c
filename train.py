"""Trains a CharNeRF: composes conf/, validates it whole, trains, evaluates, writes the run folder.

    python train.py [group=option ...] [key=value ...]
    python train.py -m combinator=mean,sa encoder=single,double     # a grid, and one report over its runs

Exit status: 0 done, 1 failed, 2 wrong call. HYDRA_FULL_ERROR=1 shows tracebacks.
"""

import sys
from pathlib import Path

import hydra
from hydra.core.hydra_config import HydraConfig
from hydra.types import RunMode
from omegaconf import DictConfig

from charnerf.config import validate
from charnerf.config.composition import run_door, trusted_by

CONF = Path(__file__).resolve().parent / "conf"
sweep_folders: list[Path] = []


@hydra.main(version_base="1.3", config_path="conf", config_name="train")
def train(cfg: DictConfig) -> None:
    """One job: training, evaluation, report."""
    job = HydraConfig.get()
    validate(cfg, trusted_targets=trusted_by(list(job.overrides.task)))
    if job.mode is RunMode.MULTIRUN:
        sweep_folders[:] = [Path(job.sweep.dir)]
    from charnerf.training.run import run_training

    run_training(cfg, Path(job.runtime.output_dir))


def main() -> None:
    """Train all jobs, then report over a sweep."""
    train()
    if sweep_folders:
        from charnerf.evaluation.report import write_report

        write_report(sweep_folders[0])


if __name__ == "__main__":
    sys.exit(run_door(main, arguments=sys.argv[1:], conf=CONF))
