"""The checkpoint that a run goes on from."""

import logging
from pathlib import Path

from charnerf.errors import ConfigError

log = logging.getLogger(__name__)


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
