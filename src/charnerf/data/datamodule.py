"""The mixed ray-plus-surface datamodule."""

from collections.abc import Callable
from pathlib import Path
from typing import final

import lightning as L
from torch.utils.data import DataLoader

from charnerf.data.layout import names_of, read_dataset
from charnerf.data.mixed import MixedDataset
from charnerf.data.sampler import PhaseSampler
from charnerf.data.store import CharacterStore
from charnerf.data.validation import ValidationDataset, ValidationView
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
        memory_mib: Bound on the training characters kept open.
        make_dataset: Makes the training data set of a store.
        sampler: Asks for batches.
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
        make_dataset: Callable[[CharacterStore], MixedDataset],
        sampler: PhaseSampler,
    ) -> None:
        super().__init__()
        info = read_dataset(root)
        train = [name for split in train_splits for name in names_of(info, split)]
        val = names_of(info, val_split)[:val_characters]
        self.train_store = CharacterStore(root=root, names=train, carve=carve, memory_mib=memory_mib)
        self.val_store = CharacterStore(root=root, names=val, carve=carve, memory_mib=memory_mib)
        self.make_dataset = make_dataset
        self.val_views = val_views
        self.sampler = sampler

    def train_dataloader(self) -> DataLoader[TrainBatch]:
        """Batches; the sampler ends an epoch where a validation is due."""
        dataset = self.make_dataset(self.train_store)
        return DataLoader(dataset, sampler=self.sampler, batch_size=None, collate_fn=_as_is)

    def val_dataloader(self) -> DataLoader[ValidationView]:
        """Pictures of the validation characters."""
        dataset = ValidationDataset(store=self.val_store, views=self.val_views)
        return DataLoader(dataset, batch_size=None, collate_fn=_as_is)


def _as_is(item: object) -> object:
    return item
