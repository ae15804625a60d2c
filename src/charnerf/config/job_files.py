"""What Hydra keeps of a job in `.hydra`: what was typed, the composed config, and Hydra's own settings."""

from collections.abc import Sequence
from pathlib import Path

from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig, OmegaConf

from charnerf.config.hydra_internals import looks_only, options_first, read_arguments
from charnerf.files import write_text

FOLDER = ".hydra"


def run_arguments(arguments: Sequence[str]) -> list[str]:
    """A run's command line as `hydra.main` reads it, by which Hydra writes none of these files: `save_job` does."""
    is_run = not looks_only(read_arguments(arguments))
    return options_first([*arguments, "hydra.output_subdir=null"] if is_run else arguments)


def save_job(folder: Path, cfg: DictConfig) -> None:
    """Write the files of the current job as Hydra does, which would write them before the job can refuse.

    Args:
        folder: The run folder.
        cfg: The job's config, as Hydra composed it.
    """
    job = HydraConfig.get()
    kept = {
        "config.yaml": cfg,
        "hydra.yaml": OmegaConf.create({"hydra": job}),
        "overrides.yaml": job.overrides.task,
    }
    for name, content in kept.items():
        write_text(folder / FOLDER / name, OmegaConf.to_yaml(content))
