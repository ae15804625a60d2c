"""What a checkpoint says about the run that wrote it, and what has to be the same to go on from it."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

import lightning as L
from omegaconf import DictConfig, OmegaConf

from charnerf.config.problems import differing
from charnerf.config.schema import LIST_GROUPS
from charnerf.data.digest import training_digest
from charnerf.errors import ConfigError
from charnerf.inference.checkpoint_file import read_checkpoint

KEY, FORMAT = "charnerf", "charnerf-checkpoint-1"
MAY_CHANGE = (  # keys and sections that another run of the same state may set otherwise
    "name",
    "ckpt_path",
    "trusted_targets",
    "averaging",  # one begins from the weights that are there
    "budget",
    "scale.steps",  # of the budget
    "scale.seconds",
    "scale.eval_views",  # after training
    "scale.mesh_resolution",
    "splits.test",
    "validation",
    "batches.workers",  # the same batches
    "batches.memory_mib",
    "data",  # another place for the same pictures; those are compared
    "trainer.accelerator",
    "trainer.devices",
    "trainer.num_nodes",
    "trainer.strategy",
    "trainer.default_root_dir",
    "trainer.log_every_n_steps",
)
MOST_KEYS = 12  # in a message

Setting = bool | int | float | str


@final
class RunIdentity(L.Callback):
    """Puts config and data set of a run into its checkpoints.

    Args:
        cfg: Of the run.
        data: Digests of its splits, as `data_of` gives them.
    """

    def __init__(self, cfg: DictConfig, data: Mapping[str, str]) -> None:
        self.config, self.data = settings_of(cfg), dict(data)

    def on_save_checkpoint(
        self, trainer: L.Trainer, pl_module: L.LightningModule, checkpoint: dict[str, Any]
    ) -> None:
        """Add it to what is written."""
        checkpoint[KEY] = {"format": FORMAT, "config": self.config, "data": self.data}


def data_of(cfg: DictConfig, root: Path) -> dict[str, str]:
    """Digests of the splits that a run trains on and validates on, by split."""
    return {split: training_digest(root, split) for split in [*cfg.splits.train, cfg.splits.val]}


@dataclass(frozen=True)
class WrittenRun:
    """What a checkpoint says about the run that wrote it.

    Attributes:
        file: The checkpoint.
        config: Its settings by full keys.
        data: Digests of its splits.
    """

    file: Path
    config: Mapping[str, Setting]
    data: Mapping[str, str]

    def check_config(self, cfg: DictConfig) -> None:
        """Check that it had this config, but for what may change.

        Raises:
            ConfigError: Names every key that differs.
        """
        _compare(self.file, self.config, settings_of(cfg), "settings")

    def check_data(self, data: Mapping[str, str]) -> None:
        """Check that it was trained on this data set.

        Raises:
            ConfigError: Names the splits that differ.
        """
        there, here = (
            {f"digest of split {split}": digest for split, digest in one.items()} for one in (self.data, data)
        )
        _compare(self.file, there, here, "a data set")


def written_run(file: Path) -> WrittenRun:
    """Read what a checkpoint says about its run.

    Raises:
        ConfigError: If it does not say of which run it is.
        DataError: If it can not be read.
    """
    run = read_checkpoint(file).get(KEY)
    if not isinstance(run, Mapping) or run.get("format") != FORMAT:
        raise ConfigError(
            f"ckpt_path: {file} does not say of which run it is, expected {FORMAT}; begin with its weights by"
            f" start_from={file}."
        )
    return WrittenRun(file, run["config"], run["data"])


def settings_of(cfg: DictConfig) -> dict[str, Setting]:
    """Everything that a config says, by full keys; the order of a list of parts counts, so it is a setting too."""
    plain = OmegaConf.to_container(cfg, resolve=True)
    assert isinstance(plain, dict)
    order = {key: " ".join(map(str, plain[key])) for key in LIST_GROUPS if plain.get(key)}
    return flat_settings(plain) | order


def flat_settings(node: Any, key: str = "") -> dict[str, Setting]:
    """Values of nested sections by their full keys."""
    if not isinstance(node, dict | list):
        return {key: node if isinstance(node, bool | int | float | str) else str(node)}
    items = node.items() if isinstance(node, dict) else enumerate(node)
    flat: dict[str, Setting] = {}
    for name, value in items:
        flat |= flat_settings(value, f"{key}.{name}" if key else str(name))
    return flat


def _compare(file: Path, there: Mapping[str, Setting], here: Mapping[str, Setting], what: str) -> None:
    if keys := differing(there, here, MAY_CHANGE):
        lines = [f"  {key}: found {here.get(key)}, expected {there.get(key)}" for key in keys[:MOST_KEYS]]
        more = [f"  and {len(keys) - MOST_KEYS} more"] if len(keys) > MOST_KEYS else []
        raise ConfigError(
            "\n".join(
                [
                    f"ckpt_path: {file} is of a run with {what} of its own; set them as there, or begin a run of your own with"
                    f" its weights by start_from={file}:",
                    *lines,
                    *more,
                ]
            )
        )
