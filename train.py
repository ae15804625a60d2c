"""Train: `python train.py [group=option ...] [key=value ...]`; `-m` trains a grid and reports over it.

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

sweeps: set[Path] = set()


@hydra.main(version_base="1.3", config_path="conf", config_name="train")
def train(cfg: DictConfig) -> None:
    """One job: training, evaluation, report."""
    from charnerf.training.run import run_training

    job = HydraConfig.get()
    validate(cfg, trusted_targets=trusted_by(list(job.overrides.task)))
    if job.mode is RunMode.MULTIRUN:
        sweeps.add(Path(job.sweep.dir))
    run_training(cfg, Path(job.runtime.output_dir))


def train_and_report() -> None:
    """Train all jobs, then report over a sweep, also if some of its jobs failed."""
    from charnerf.reporting.folder_report import write_folder_report

    try:
        train()
    finally:
        for folder in sweeps:
            if any(folder.rglob("metrics.json")):
                write_folder_report(folder)


if __name__ == "__main__":
    sys.exit(
        run_door(train_and_report, arguments=sys.argv[1:], conf=Path(__file__).resolve().parent / "conf")
    )
