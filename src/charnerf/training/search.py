"""A search over configs for the front of error and seconds: Optuna chooses, cells of a grid train, a journal remembers."""

import csv
import io
import json
import logging
import math
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

from omegaconf import DictConfig

from charnerf.config.problems import differing
from charnerf.config.search_space import Choice, Interval, SearchSpace
from charnerf.errors import ConfigError, DataError
from charnerf.files import read_bytes, write_text
from charnerf.reporting.run_files import read_metrics
from charnerf.training.cells import DONE, cell_folder, run_cell
from charnerf.training.run import run_training

if TYPE_CHECKING:
    import optuna

log = logging.getLogger(__name__)
JOURNAL, FRONT, STUDY = "search.log", "front.csv", "charnerf"
MOST_JOURNAL = 256 * 2**20  # bytes


@dataclass(frozen=True)
class Tried:
    """A run of the search: what was chosen, its error (root mean square of the foreground's colors) and its seconds."""

    chosen: Mapping[str, Any]
    error: float
    seconds: float


@final
class Search:
    """A search in a folder, perhaps begun before, perhaps worked on by other processes and machines at once.

    Args:
        folder: Of the search: a grid, and Optuna's journal.
        space: What may be chosen.
        seconds: Which of the seconds of metrics.json count.
        seed: What is chosen follows from it and from what was tried before.

    Raises:
        ConfigError: If the folder holds another search, or Optuna is missing.
        DataError: If its journal can not be read.
    """

    def __init__(self, folder: Path, space: SearchSpace, *, seconds: str, seed: int) -> None:
        self.folder, self.space, self.seconds, self.seed = folder, space, seconds, seed
        self._optuna = _optuna()
        folder.mkdir(parents=True, exist_ok=True)
        self._study = self._open_study()
        self._check_same()

    def run(
        self,
        trials: int,
        compose: Callable[[list[str]], DictConfig],
        *,
        train: Callable[[DictConfig, Path], None] = run_training,
    ) -> None:
        """Go on with what was begun, then choose anew until so many runs were; what fails is left for the next call.

        Args:
            trials: In all, those before counted.
            compose: Makes a config of overrides.
            train: Trains a config into a folder.
        """
        for begun in self._study.get_trials(states=[self._optuna.trial.TrialState.RUNNING]):
            self._work(begun.number, begun.params, compose, train)
        while (number := len(self._study.get_trials(deepcopy=False))) < trials:
            self._study.sampler = self._optuna.samplers.TPESampler(seed=self.seed + 1_000_003 * number)
            trial = self._study.ask({key: self._distribution(one) for key, one in self.space.free.items()})
            self._work(trial.number, trial.params, compose, train)

    def front(self) -> list[Tried]:
        """Runs that no other beats in both, fastest first."""
        best = [Tried(one.params, *one.values) for one in self._study.best_trials]
        return sorted(best, key=lambda one: one.seconds)

    def write_front(self) -> Path:
        """Write them as a table."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow([*self.space.free, "error", f"seconds.{self.seconds}"])
        writer.writerows(
            [*(one.chosen[key] for key in self.space.free), f"{one.error:.5g}", f"{one.seconds:.4g}"]
            for one in self.front()
        )
        write_text(self.folder / FRONT, text.getvalue())
        return self.folder / FRONT

    def _open_study(self) -> "optuna.Study":
        """Read the journal, perhaps a stranger's, or begin one; a line that a full disk cut off goes: the next would join it."""
        file = self.folder / JOURNAL
        journal = self._optuna.storages.journal
        lock = journal.JournalFileOpenLock(
            str(file)
        )  # the default one hangs on what a kill leaves, where paths are relative
        try:
            if file.exists():
                raw = read_bytes(file, most=MOST_JOURNAL)
                if raw and not raw.endswith(b"\n"):
                    lock.acquire()
                    try:
                        os.truncate(file, raw.rfind(b"\n") + 1)
                    finally:
                        lock.release()
            return self._optuna.create_study(
                storage=self._optuna.storages.JournalStorage(journal.JournalFileBackend(str(file), lock)),
                study_name=STUDY,
                directions=["minimize", "minimize"],
                load_if_exists=True,
            )
        except (DataError, OSError):
            raise
        except Exception as error:  # Optuna checks nothing of what it reads
            raise DataError(
                f"{file}: can not be read ({type(error).__name__}: {error}), expected a journal of `charnerf search`; name another"
                " folder."
            ) from error

    def _work(
        self,
        number: int,
        chosen: Mapping[str, Any],
        compose: Callable[[list[str]], DictConfig],
        train: Callable[[DictConfig, Path], None],
    ) -> None:
        self.space.check(chosen, f"{self.folder / JOURNAL}: run {number}")
        cfg = compose(self.space.overrides(chosen))
        name = "+".join(f"{key}-{value}" for key, value in chosen.items())
        cell = run_cell(cfg, self.folder, name=name, job_folder=self.folder, train=train)
        if cell.state != DONE:
            return
        metrics = read_metrics(cell_folder(self.folder, cfg, name) / "metrics.json")
        error, seconds = color_error(metrics), metrics["seconds"].get(self.seconds)
        if error is None or seconds is None:
            raise DataError(
                f"{self.folder / cell.name}/metrics.json: found no psnr_foreground or no seconds.{self.seconds}, expected both;"
                " name other seconds."
            )
        self._study.tell(number, (error, float(seconds)), skip_if_finished=True)
        log.info("%s: error %.4f, %.4g s", name, error, seconds)

    def _distribution(self, one: Choice | Interval) -> "optuna.distributions.BaseDistribution":
        kinds = self._optuna.distributions
        if isinstance(one, Choice):
            return kinds.CategoricalDistribution(one.values)
        if one.is_whole:
            return kinds.IntDistribution(int(one.low), int(one.high), log=one.is_log)
        return kinds.FloatDistribution(one.low, one.high, log=one.is_log)

    def _check_same(self) -> None:
        """Check that the folder's search is this one; note it in a new one."""
        here = {"fixed": sorted(self.space.fixed), "seconds": self.seconds}
        here |= {f"free {key}": repr(one) for key, one in self.space.free.items()}
        there = self._study.user_attrs.get("search")
        if there is None:
            self._study.set_user_attr("search", here)
        elif there != here:
            keys = differing(there, here)
            raise ConfigError(
                f"{self.folder}: holds another search ({json.dumps(keys)} differ), expected this one; name another folder."
            )


def color_error(metrics: Mapping[str, Any]) -> float | None:
    """Root mean square error of the foreground's colors, in [0, 1], that a PSNR stands for."""
    psnr = metrics.get("psnr_foreground")
    return None if psnr is None else math.pow(10.0, -psnr / 20.0)


def _optuna() -> Any:
    try:
        import optuna
    except ModuleNotFoundError as error:
        raise ConfigError("search: needs Optuna; python -m pip install 'charnerf[search]'") from error
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    return optuna
