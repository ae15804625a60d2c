"""The mixed ray-plus-surface datamodule."""

import multiprocessing
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

import lightning as L
import torch
from torch.utils.data import DataLoader, Dataset

from charnerf.data.layout import names_of, read_dataset
from charnerf.data.mixed import MixedDataset
from charnerf.data.sampler import BatchRequest, PhaseSampler, Share
from charnerf.data.store import CharacterStore, SpaceOf, SurfaceOf
from charnerf.data.validation import ValidationDataset, ValidationView, shared_out
from charnerf.errors import CharNeRFError, ConfigError
from charnerf.interruption import leave_signals_to_parent
from charnerf.types import Hull, SourceViews, TrainBatch


@final
class MixedDataModule(L.LightningDataModule):
    """Training batches by requests of a sampler, validation pictures one by one.

    Args:
        root: Data set.
        train_splits: Splits trained on, such as [train, train_extra].
        val_split: Split validated on.
        val_characters: Validation characters at most, the first of the split; None for all.
        val_views: Pictures a validation character.
        carve: The model's `carve`.
        memory_mib: Bound on the training characters kept open, in each worker.
        workers: Processes that make training batches ahead of the steps, the same batches as without; None: one where a
            GPU would wait for them, else none.
        surface_of: Makes a training character's surface.
        space_of: Makes what a training character's labelled points are drawn from.
        make_dataset: Makes the training data set of a store, and of this process's share of every batch.
        sampler: Asks for batches.

    Raises:
        ConfigError: Workers asked for where the system can not fork a process.
    """

    def __init__(
        self,
        *,
        root: Path,
        train_splits: list[str],
        val_split: str,
        val_characters: int | None,
        val_views: int,
        carve: Callable[[SourceViews], Hull | None],
        memory_mib: float,
        workers: int | None,
        surface_of: SurfaceOf,
        space_of: SpaceOf,
        make_dataset: Callable[[CharacterStore, Share], MixedDataset],
        sampler: PhaseSampler,
    ) -> None:
        super().__init__()
        if workers and not _can_fork():
            raise ConfigError(
                f"batches.workers: found {workers}, but this system can not fork processes, expected 0 or null; "
                "set batches.workers=0."
            )
        info = read_dataset(root)
        train = [name for split in train_splits for name in names_of(info, split)]
        val = names_of(info, val_split)[:val_characters]
        self.train_store = CharacterStore(
            root=root,
            names=train,
            carve=carve,
            memory_mib=memory_mib,
            surface_of=surface_of,
            space_of=space_of,
        )
        self.val_store = CharacterStore(root=root, names=val, carve=carve, memory_mib=memory_mib)
        self.workers = workers
        self.make_dataset = make_dataset
        self.val_views = val_views
        self.sampler = sampler

    def train_dataloader(self) -> DataLoader[TrainBatch | CharNeRFError]:
        """Batches; the sampler ends an epoch where a validation is due."""
        on_gpu = self.trainer is not None and self.trainer.strategy.root_device.type == "cuda"
        workers = int(on_gpu and _can_fork()) if self.workers is None else self.workers
        return DataLoader(
            _ErrorsAsItems(self.make_dataset(self.train_store, self._share)),
            sampler=self.sampler,
            batch_size=None,
            collate_fn=_as_is,
            num_workers=workers,
            persistent_workers=workers > 0,  # their characters stay open from one epoch to the next
            multiprocessing_context="fork" if workers else None,
            worker_init_fn=_begin_worker,
            pin_memory=on_gpu,
        )

    def val_dataloader(self) -> DataLoader[ValidationView]:
        """Pictures of the validation characters, every so many-th where processes share them."""
        dataset = ValidationDataset(store=self.val_store, views=self.val_views)
        return DataLoader(
            dataset, sampler=shared_out(len(dataset), self._share), batch_size=None, collate_fn=_as_is
        )

    @property
    def _share(self) -> Share:
        """This process's, of the trainer's."""
        if self.trainer is None:
            return Share()
        return Share(self.trainer.global_rank, self.trainer.world_size)

    def transfer_batch_to_device(self, batch: Any, device: torch.device, dataloader_idx: int) -> Any:
        """Move a batch, beside the GPU's work where it is pinned; raise the error that there was instead of one."""
        if isinstance(batch, CharNeRFError):
            raise batch
        return batch.to(device, non_blocking=device.type == "cuda")


@dataclass(frozen=True)
class _ErrorsAsItems(Dataset[TrainBatch | CharNeRFError]):
    """Batches, or errors as they are: torch would bring those of a worker as its traceback's text."""

    dataset: MixedDataset

    def __getitem__(self, request: BatchRequest) -> TrainBatch | CharNeRFError:  # type: ignore[override]
        try:
            return self.dataset[request]
        except CharNeRFError as err:
            return err


def _can_fork() -> bool:
    return "fork" in multiprocessing.get_all_start_methods()


def _begin_worker(_: int) -> None:
    """The trainer answers signals, and ends its workers once it has no more use for their batches."""
    leave_signals_to_parent()


def _as_is(item: object) -> object:
    return item
