"""Validation pictures: a few fixed views of each validation character."""

from dataclasses import dataclass
from typing import final

from torch import Tensor
from torch.utils.data import Dataset

from charnerf.data.sampler import Share
from charnerf.data.store import CharacterStore
from charnerf.types import Cameras, Hull, SourceViews, TensorRecord


@dataclass(frozen=True)
class ValidationView(TensorRecord):
    """One picture: its place among all, drawings (B = 1), hull, camera of shape () and the true picture (H, W, 4)."""

    index: int
    views: SourceViews
    hull: Hull | None
    camera: Cameras
    rgba: Tensor


@final
class ValidationDataset(Dataset[ValidationView]):
    """Views spread evenly over the frames of each character; one with fewer frames shows some again.

    Args:
        store: The characters.
        views: Pictures a character.
    """

    def __init__(self, *, store: CharacterStore, views: int) -> None:
        self.store = store
        self.views = views

    def __len__(self) -> int:
        """Number of pictures."""
        return len(self.store) * self.views

    def __getitem__(self, index: int) -> ValidationView:
        """Open one picture."""
        one = self.store.open(self.store.names[index // self.views])
        frames = spread_frames(len(one.images), self.views)
        frame = frames[index % self.views % len(frames)]
        return ValidationView(
            index=index,
            views=one.character.sources,
            hull=one.hull,
            camera=one.character.cameras[frame],
            rgba=one.images[frame].float() / 255.0,
        )


def shared_out(total: int, share: Share) -> list[int]:
    """A process's part of all pictures; each gets as many, so the first are drawn again where they do not come out even."""
    rounds = -(-total // share.processes)
    return [(share.process + turn * share.processes) % total for turn in range(rounds)]


def spread_frames(num_frames: int, wanted: int) -> list[int]:
    """Evenly chosen distinct indices of frames; all of them where fewer exist than are wanted."""
    if wanted >= num_frames:
        return list(range(num_frames))
    return [(index + 1) * num_frames // (wanted + 1) for index in range(wanted)]
