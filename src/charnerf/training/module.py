"""The LightningModule: encode, render, lose, log. No drawing, no metric's maths."""

import math
from collections.abc import Callable, Iterable
from typing import Any

import lightning as L
import torch
from torch import Tensor

from charnerf.data.sampler import Position, step_seed
from charnerf.data.validation import ValidationView
from charnerf.errors import ConfigError
from charnerf.evaluation.metrics import psnr, psnr_foreground, ssim
from charnerf.losses.total import Pass, WeightedLosses
from charnerf.models.charnerf import CharNeRF
from charnerf.models.combinators.base import AbstractCombinator
from charnerf.scene import AbstractField
from charnerf.types import RenderOutput, TrainBatch
from charnerf.volume.renderers.base import AbstractRenderer

OptimizerOf = Callable[[Iterable[torch.nn.Parameter] | list[dict[str, Any]]], torch.optim.Optimizer]
WARM_UP = 0.01  # share of the run in which the learning rate rises


class TrainingModule(L.LightningModule):
    """Trains a model by rays and points.

    Args:
        model: What is trained.
        renderer: Renders the training rays.
        eval_renderer: Renders validation pictures.
        losses: Terms and weights.
        optimizer: Makes the optimiser of parameters.
        final_rate: Learning rate at the end of the run over that at the start (cosine between them).
        position: Where the run stands.
        seed: Of the run; with the step it seeds the jitter of the samples.
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
        seed: int,
    ) -> None:
        super().__init__()
        self.model = model
        self.renderer = renderer
        self.eval_renderer = eval_renderer
        self.losses = losses
        self.make_optimizer = optimizer
        self.final_rate = final_rate
        self.position = position
        self.seed = seed
        self.last_opacity = math.nan  # mean over the rays of the last batch that show the character

    def training_step(self, batch: TrainBatch, batch_idx: int) -> Tensor:
        """Loss of one batch."""
        generator = torch.Generator().manual_seed(step_seed(self.seed, batch.step))
        encoded = self.model.encode(batch.views, batch.hull)
        scenes = [self.model.scene(encoded, index) for index in range(len(batch.names))]
        renderings = [self.renderer.render(scene, batch.rays[b], generator) for b, scene in enumerate(scenes)]
        passes = [_pass([r.finest for r in renderings], [s.field for s in scenes])]
        if renderings[0].coarse is not None:
            coarse = [r.coarse for r in renderings if r.coarse is not None]
            passes.append(_pass(coarse, [s.coarse for s in scenes]))
        loss, terms = self.losses(passes, batch, generator)
        self.last_opacity = _seen_opacity(passes[0].rays.opacity.detach(), batch.alpha)
        now = self.position()
        logged: dict[str, Tensor | float] = {
            f"train/loss/{term}": value.detach() for term, value in terms.items()
        }
        logged |= {"train/loss/total": loss.detach(), "train/opacity_foreground": self.last_opacity}
        logged |= {"train/rays": float(batch.alpha.numel()), "train/phase": float(batch.phase)}
        points = 0 if batch.surface is None else batch.surface.points[..., 0].numel()
        logged |= {
            "train/surface_points": float(points),
            "train/seconds": now.seconds,
            "train/lr": self._rate(),
        }
        self.log_dict(logged, batch_size=1)
        return loss

    def validation_step(self, view: ValidationView, batch_idx: int) -> None:
        """Render one picture of a validation character and measure it."""
        encoded = self.model.encode(view.views, view.hull)
        output = self.eval_renderer.render_camera(self.model.scene(encoded, 0), view.camera).finest
        rgb, alpha = output.rgb.float().clamp(0.0, 1.0), view.rgba[..., 3]
        target = view.rgba[..., :3] * alpha[..., None] + (1.0 - alpha[..., None])
        foreground = psnr_foreground(rgb, target, alpha)
        measured = {"val/psnr": psnr(rgb, target), "val/ssim": ssim(rgb, target)}
        if foreground is not None:
            measured["val/psnr_foreground"] = foreground
        self.log_dict(measured, batch_size=1, sync_dist=True)

    def configure_optimizers(self) -> torch.optim.Optimizer:
        """The optimiser; its rate is set before every step. A combinator with an lr_scale other than 1 is a group of its own."""
        combinators = [one for one in self.model.modules() if isinstance(one, AbstractCombinator)]
        lr_scale = combinators[0].lr_scale
        own = {id(p): p for one in combinators for p in one.parameters()}
        if lr_scale == 1.0 or not own:
            return self.make_optimizer(self.model.parameters())
        others = [p for p in self.model.parameters() if id(p) not in own]
        try:
            optimizer = self.make_optimizer([{"params": others}, {"params": list(own.values())}])
        except (AttributeError, TypeError) as error:
            raise ConfigError(
                f"combinator.lr_scale: found {lr_scale}, but this optimizer takes no groups of parameters ({error}); expected 1,"
                " or an optimizer of torch.optim."
            ) from error
        optimizer.param_groups[1]["lr"] *= lr_scale
        return optimizer

    def on_train_start(self) -> None:
        """Remember the rate that the config asks for; a resumed optimiser has it already."""
        for group in self._optimizer().param_groups:
            group.setdefault("initial_lr", group["lr"])

    def on_train_batch_start(self, batch: TrainBatch, batch_idx: int) -> None:
        """Set the learning rate by the share of the run: a short rise, then a cosine."""
        for group in self._optimizer().param_groups:
            group["lr"] = group["initial_lr"] * rate_at(self.position().progress, final=self.final_rate)

    def _optimizer(self) -> Any:
        return self.trainer.optimizers[0]

    def _rate(self) -> float:
        return float(self._optimizer().param_groups[0]["lr"])


def rate_at(progress: float, *, final: float) -> float:
    """Factor on the learning rate: rises from 1/20 to 1 in the first hundredth of the run, then a cosine to `final`."""
    rise = min(1.0, 0.05 + 0.95 * progress / WARM_UP)
    return rise * (final + (1.0 - final) * 0.5 * (1.0 + math.cos(math.pi * progress)))


def _pass(outputs: list[RenderOutput], fields: list[AbstractField]) -> Pass:
    """A pass of the renderings and fields of all characters."""
    rays = RenderOutput(
        rgb=torch.stack([one.rgb for one in outputs]),
        opacity=torch.stack([one.opacity for one in outputs]),
        depth=torch.stack([one.depth for one in outputs]),
    )
    return Pass(rays, fields)


def _seen_opacity(opacity: Tensor, alpha: Tensor) -> float:
    """Mean opacity of the rays that show the character; NaN if none does."""
    shown = alpha > 0.5
    return float(opacity[shown].mean()) if bool(shown.any()) else math.nan
