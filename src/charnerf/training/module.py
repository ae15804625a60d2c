"""The LightningModule: encode, render, lose, log. No drawing, no metric's maths."""

import math
from typing import Any

import lightning as L
import torch
from torch import Tensor

from charnerf.data.sampler import Position
from charnerf.data.validation import ValidationView
from charnerf.distributed import gathered, mean_over_processes
from charnerf.evaluation.metrics import psnr, psnr_foreground, ssim
from charnerf.losses.total import Pass, WeightedLosses
from charnerf.models.charnerf import CharNeRF
from charnerf.pictures import on_white
from charnerf.scene import AbstractField
from charnerf.training.optimization import OptimizerOf, optimizer_of, rate_at
from charnerf.types import LeftOut, RenderOutput, TrainBatch
from charnerf.volume.renderers.base import AbstractRenderer

MEASURES = ("val/psnr", "val/ssim", "val/psnr_foreground")


class TrainingModule(L.LightningModule):
    """Trains a model by rays and points.

    Args:
        model: What is trained.
        renderer: Renders the training rays.
        eval_renderer: Renders validation pictures.
        losses: Terms and weights.
        optimizer: Makes the optimizer of parameters.
        final_rate: Learning rate at the end of the run over that at the start (cosine between them).
        position: Where the run stands.
    """

    def __init__(
        self,
        *,
        model: CharNeRF,
        renderer: AbstractRenderer,
        eval_renderer: AbstractRenderer,
        losses: WeightedLosses,
        optimizer: OptimizerOf,
        final_rate: float,
        position: Position,
    ) -> None:
        super().__init__()
        self.model = model
        self.renderer = renderer
        self.eval_renderer = eval_renderer
        self.losses = losses
        self.make_optimizer = optimizer
        self.final_rate = final_rate
        self.position = position
        self.logged: dict[str, Tensor | float] = {}  # by the last step, of all processes
        self.left_out = LeftOut()  # by the last step, of this process's rays
        self._measured: list[tuple[float, ...]] = []  # in this validation, a row a picture: index, MEASURES

    def training_step(self, batch: TrainBatch, batch_idx: int) -> Tensor:
        """Loss of one batch."""
        generators = [torch.Generator().manual_seed(seed) for seed in batch.seeds]
        encoded = self.model.encode(batch.views, batch.hull)
        scenes = [self.model.scene(encoded, index) for index in range(len(batch.names))]
        renderings = [
            self.renderer.render(scene, batch.rays[b], generators[b]) for b, scene in enumerate(scenes)
        ]
        passes = [_pass([r.finest for r in renderings], [s.field for s in scenes])]
        if renderings[0].coarse is not None:
            coarse = [r.coarse for r in renderings if r.coarse is not None]
            passes.append(_pass(coarse, [s.coarse for s in scenes]))
        self.left_out = sum((rendering.left_out for rendering in renderings), LeftOut())
        loss, values = self.losses(passes, batch, generators)
        shown = batch.alpha > 0.5
        seen = (passes[0].rays.opacity * shown).sum(), shown.sum()
        counted = torch.stack([value.detach().float() for value in (*values.values(), loss, *seen)])
        *means, opacity, count = mean_over_processes(counted)
        points = 0 if batch.surface is None else batch.surface.points[..., 0].numel()
        self.logged = {
            f"train/loss/{name}": mean for name, mean in zip([*values, "total"], means, strict=True)
        }
        self.logged |= {
            "train/opacity_foreground": opacity / count,  # NaN if no ray shows the character
            "train/rays": float(batch.alpha.numel() * self.trainer.world_size),
            "train/surface_points": float(points * self.trainer.world_size),
            "train/phase": float(batch.phase),
            "train/seconds": self.position().seconds,
            "train/lr": float(self._param_groups()[0]["lr"]),
        }
        return loss

    def validation_step(self, view: ValidationView, batch_idx: int) -> dict[str, Any]:
        """Render one picture of a validation character and measure it; both are returned, to be shown."""
        scene = self.model.scene(self.model.encode(view.views, view.hull), 0)
        rendered = self.eval_renderer.render_camera(scene, view.camera).finest
        rgb, target = rendered.rgb.float().clamp(0.0, 1.0), on_white(view.rgba)
        foreground = psnr_foreground(rgb, target, view.rgba[..., 3])
        scores = psnr(rgb, target), ssim(rgb, target), math.nan if foreground is None else foreground
        self._measured.append((view.index, *scores))
        return {"scene": scene, "rendered": rendered}

    def on_validation_epoch_end(self) -> None:
        """Log the means over the pictures of all processes, each picture once and in its order."""
        once = {index: scores for rows in gathered(self._measured) for index, *scores in rows}
        self._measured = []
        means = torch.tensor([once[index] for index in sorted(once)], dtype=torch.float64).nanmean(0).tolist()
        known = {name: mean for name, mean in zip(MEASURES, means, strict=True) if not math.isnan(mean)}
        self.log_dict(known, batch_size=1, sync_dist=True)

    def configure_optimizers(self) -> torch.optim.Optimizer:
        """The optimizer; its rate is set before every step."""
        return optimizer_of(self.model, self.make_optimizer)

    def on_train_start(self) -> None:
        """Remember the rate that the config asks for; a resumed optimizer has it already."""
        for group in self._param_groups():
            group.setdefault("initial_lr", group["lr"])

    def on_train_batch_start(self, batch: TrainBatch, batch_idx: int) -> None:
        """Set the learning rate by the share of the run: a short rise, then a cosine."""
        for group in self._param_groups():
            group["lr"] = group["initial_lr"] * rate_at(self.position().progress, final=self.final_rate)

    def _param_groups(self) -> list[dict[str, Any]]:
        return self.trainer.optimizers[0].param_groups


def _pass(outputs: list[RenderOutput], fields: list[AbstractField]) -> Pass:
    """A pass of the renderings and fields of all characters."""
    rays = RenderOutput(
        rgb=torch.stack([one.rgb for one in outputs]),
        opacity=torch.stack([one.opacity for one in outputs]),
        depth=torch.stack([one.depth for one in outputs]),
    )
    return Pass(rays, fields)
