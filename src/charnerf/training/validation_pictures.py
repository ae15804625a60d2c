"""What a validation shows in TensorBoard of its first characters: pictures side by side, and what each view counts for."""

from typing import Any, final

import lightning as L
import torch
from torch import Tensor

from charnerf.data.validation import ValidationView
from charnerf.evaluation.attention import mean_shares, view_labels
from charnerf.models.combinators.base import AbstractWeighing
from charnerf.pictures import on_white
from charnerf.training.board import Board
from charnerf.training.module import TrainingModule
from charnerf.types import RenderOutput

PICTURES = 4
DARKEST = 1.0 / 3.0  # mean difference of the colors from which on an error is drawn black


@final
class ValidationPictures(L.Callback):
    """Draws the first view of each of the first characters as it was measured.

    Args:
        board: Gets them.
    """

    def __init__(self, *, board: Board) -> None:
        self.board = board

    def on_validation_batch_end(  # type: ignore[override]
        self,
        trainer: L.Trainer,
        pl_module: L.LightningModule,
        outputs: dict[str, Any],
        batch: ValidationView,
        batch_idx: int,
        dataloader_idx: int = 0,
    ) -> None:
        """Draw a view: the drawings, and beside one another target, prediction, error, depth and opacity."""
        number = _first_view_of(trainer, batch)
        if number is None or number >= PICTURES:
            return
        rendered: RenderOutput = outputs["rendered"]
        target = on_white(batch.rgba)
        shown = [
            target,
            rendered.rgb,
            error_picture(rendered.rgb, target),
            nearness(rendered),
            rendered.opacity,
        ]
        drawings = [on_white(image.permute(1, 2, 0)) for image in batch.views.images[0]]
        add, step = self.board.writer.add_image, self.board.clock.steps
        add(f"val/drawings/{number}", _row(drawings), step)
        add(f"val/target_prediction_error_depth_opacity/{number}", _row(shown), step)


@final
class ShareWriter(L.Callback):
    """Writes the share that H gives each view at the points that the first picture shows, where H weighs views.

    Args:
        board: Gets them.
    """

    def __init__(self, *, board: Board) -> None:
        self.board = board

    def on_validation_batch_end(  # type: ignore[override]
        self,
        trainer: L.Trainer,
        pl_module: L.LightningModule,
        outputs: dict[str, Any],
        batch: ValidationView,
        batch_idx: int,
        dataloader_idx: int = 0,
    ) -> None:
        """Ask the field once more at one point a pixel, of one picture."""
        assert isinstance(pl_module, TrainingModule)
        combinator = pl_module.model.finest.combinator
        if _first_view_of(trainer, batch) != 0 or not isinstance(combinator, AbstractWeighing):
            return
        shares = mean_shares(combinator, outputs["scene"], outputs["rendered"], batch.camera)
        if shares is None:  # of a field that is still empty
            return
        store = trainer.datamodule.val_store  # type: ignore[attr-defined]
        labels = view_labels(store.open(store.names[0]).character, len(shares))
        for label, share in zip(labels, shares.tolist(), strict=True):
            self.board.writer.add_scalar(f"attention/{label}", share, self.board.clock.steps)


def _first_view_of(trainer: L.Trainer, view: ValidationView) -> int | None:
    """Number of the character whose first view that the first process draws this is; None of any other."""
    number, place = divmod(view.index, trainer.datamodule.val_views)  # type: ignore[attr-defined]
    is_first = trainer.is_global_zero and place < trainer.world_size and not trainer.sanity_checking
    return number if is_first else None


def error_picture(prediction: Tensor, target: Tensor) -> Tensor:
    """Mean difference of the colors of pictures (H, W, 3) as grey (H, W): none is white, a third and more is black."""
    difference = (prediction.float().clamp(0.0, 1.0) - target).abs().mean(-1)
    return 1.0 - (difference / DARKEST).clamp_max(1.0)


def nearness(output: RenderOutput) -> Tensor:
    """Depth as grey (H, W): what is seen from white, nearest, to grey; what shows nothing is black."""
    seen = output.opacity > 0.5
    if not bool(seen.any()):
        return torch.zeros_like(output.depth)
    near, far = output.depth[seen].min(), output.depth[seen].max()
    return torch.where(seen, 1.0 - 0.75 * (output.depth - near) / (far - near).clamp_min(1e-6), 0.0)


def _row(pictures: list[Tensor]) -> Tensor:
    """Pictures (H, W, 3), or grey (H, W), beside one another as (3, H, W * n)."""
    colored = [one if one.ndim == 3 else one[..., None].expand(-1, -1, 3) for one in pictures]
    return torch.cat([one.float().clamp(0, 1) for one in colored], dim=1).permute(2, 0, 1).cpu()
