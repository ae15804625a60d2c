"""Fine-tuning: what follows the combination of the views learns from one character's drawings.

Encoder and f1 stay as they are. What is learnt from are rays of the drawings' own cameras; what stays near
the starting weights are rays from elsewhere, whose targets are the start's own answers. Only where the start
is opaque: its haze is what the drawings' masks teach it to leave out. Weights are kept
only if they are better on patches of the drawings that nothing was learnt from and still show the same
character from elsewhere; else the starting weights come back.
"""

from __future__ import annotations

import copy
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import torch
from torch import Tensor, nn

from charnerf.errors import DataError
from charnerf.finetuning.cached_rays import render_cached
from charnerf.finetuning.ray_sets import RaySets, Targets, prepare_rays, render_all
from charnerf.finetuning.recipe import Recipe
from charnerf.inference.hero import Hero
from charnerf.inference.model import Model
from charnerf.models.character import CharacterField
from charnerf.models.charnerf import CharNeRF
from charnerf.scene import Scene
from charnerf.types import LeftOut

if TYPE_CHECKING:
    from charnerf.volume.renderers.base import AbstractRenderer

FINAL_RATE = 0.05
CLOSE_TO_EQUAL = 1e-10  # squared error below which a PSNR says no more
LEAST_GAIN = 1e-3  # of the held-out error: less is not worth other weights
LEARNING = ("combinator", "multi_view", "density", "head")


@dataclass(frozen=True)
class CurvePoint:
    """Where fine-tuning stood.

    Attributes:
        step: Steps done.
        seconds: Since the start, preparation included.
        learnt: Loss on the last step's rays of the drawings; NaN before the first.
        held_out: Loss on the held-out patches.
        held_out_psnr: Of their colours, dB.
        likeness: PSNR to the starting weights in novel views, dB; infinite at the start.
    """

    step: int
    seconds: float
    learnt: float
    held_out: float
    held_out_psnr: float
    likeness: float


@dataclass(frozen=True)
class Finetuned:
    """What fine-tuning gives.

    Attributes:
        model: The model with the weights that were kept: adapted ones, or those it started with.
        hero: The character under them.
        kept: Whether adapted weights were kept.
        reason: Why, in one sentence.
        curve: Error against seconds.
        best: The point of the curve whose weights were kept; the first one if none were.
        left_out: Rays that miss the hull and samples outside it, which were not looked at.
        num_encodings: Encoder passes left out: one was made, one a step would be made without what is cached.
        num_samples: Samples whose f1 was computed once.
        num_answers: How often samples were answered, each without f1.
        seconds: By stage.
    """

    model: Model
    hero: Hero
    kept: bool
    reason: str
    curve: tuple[CurvePoint, ...]
    best: CurvePoint
    left_out: LeftOut
    num_encodings: int
    num_samples: int
    num_answers: int
    seconds: dict[str, float]


def finetune(
    model: Model,
    hero: Hero,
    recipe: Recipe | None = None,
    *,
    on_progress: Callable[[float, CurvePoint], object] = lambda share, point: None,
) -> Finetuned:
    """Adapt a model to one character's drawings; the given model is not changed.

    Args:
        model: Starting weights.
        hero: The character, encoded by them.
        recipe: Settings; the default was chosen on validation characters.
        on_progress: Called with the share done and the last point of the curve after each look.

    Raises:
        DataError: If no ray of the drawings meets the hull, or none of the held-out patches does.
    """
    recipe = recipe or Recipe()
    start = time.perf_counter()
    network = copy.deepcopy(model.network).requires_grad_(False).eval()
    with torch.no_grad():
        hull = hero.scene.bounds.hull
        encoded = network.encode(hero.views, None if hull is None else hull[None], detailed=hero.detailed)
        sets = _prepare(network.scene(encoded, 0), hero, model.renderer, recipe)
    prepared = time.perf_counter()
    run = _Run(network, model.renderer, sets, recipe, start)
    best = run.learn(on_progress)
    kept = best.step > 0
    adapted = replace(model, network=network) if kept else model
    with torch.no_grad():
        after = network.scene(encoded, 0) if kept else hero.scene
    return Finetuned(
        model=adapted,
        hero=replace(hero, scene=after),
        kept=kept,
        reason=_reason(run.curve, best, recipe),
        curve=tuple(run.curve),
        best=best,
        left_out=sets.left_out,
        num_encodings=run.curve[-1].step,
        num_samples=sum(len(one.cached.rows.view_features) for one in run.targets),
        num_answers=run.num_answers,
        seconds={"prepare": prepared - start, "learn": time.perf_counter() - prepared},
    )


def _prepare(scene: Scene, hero: Hero, renderer: AbstractRenderer, recipe: Recipe) -> RaySets:
    """Rays of the drawings, to learn from and held out."""
    assert isinstance(scene.field, CharacterField)  # a network makes no other
    sets = prepare_rays(scene.field, renderer, scene, hero.views, hero.radius(), recipe)
    if not len(sets.learnt) or not len(sets.held_out):
        raise DataError(
            f"drawings: found {len(sets.learnt)} rays to learn from and {len(sets.held_out)} held "
            "out, expected some of each. Check the drawings' masks."
        )
    return sets


def learning_parts(network: CharNeRF) -> nn.ModuleList:
    """The parts that learn: the finest field's combinator, f2, density and head."""
    return nn.ModuleList([getattr(network.finest, name) for name in LEARNING])


class _Run:
    """One fine-tuning, step by step."""

    def __init__(
        self,
        network: CharNeRF,
        renderer: AbstractRenderer,
        sets: RaySets,
        recipe: Recipe,
        start: float,
    ) -> None:
        self.network, self.renderer, self.sets, self.recipe = network, renderer, sets, recipe
        self.start = start
        self.learning = learning_parts(network)
        self.generator = torch.Generator().manual_seed(recipe.seed)
        self.curve: list[CurvePoint] = []
        self.num_answers = 0

    @property
    def targets(self) -> tuple[Targets, ...]:
        """All rays that are cached."""
        sets = self.sets
        return sets.learnt, sets.held_out, sets.trusted, sets.guard

    def learn(self, on_progress: Callable[[float, CurvePoint], object]) -> CurvePoint:
        """Learn until time, steps or patience are over; leave the network with the best weights."""
        recipe = self.recipe
        parameters = list(self.learning.parameters())
        self.learning.requires_grad_(True)
        optimizer = torch.optim.Adam(parameters, lr=recipe.learning_rate)
        best = self._look(0, math.nan)
        weights = copy.deepcopy(self.learning.state_dict())
        waited, step = 0, 0
        while step < recipe.most_steps and waited < recipe.patience and self._progress(step) < 1.0:
            for group in optimizer.param_groups:
                share = self._progress(step)
                cosine = 0.5 * (1.0 + math.cos(math.pi * share))
                group["lr"] = recipe.learning_rate * (FINAL_RATE + (1.0 - FINAL_RATE) * cosine)
            optimizer.zero_grad(set_to_none=True)
            loss, learnt = self._loss()
            loss.backward()
            norm = nn.utils.clip_grad_norm_(parameters, recipe.clip)
            if not bool(norm.isfinite()):
                break
            optimizer.step()
            step += 1
            if step % recipe.check_every and self._progress(step) < 1.0:
                continue
            point = self._look(step, learnt)
            on_progress(self._progress(step), point)
            if self._better(point, best):
                best, waited = point, 0
                weights = copy.deepcopy(self.learning.state_dict())
            else:
                waited += 1
        self.learning.load_state_dict(weights)
        self.learning.requires_grad_(False)
        return best

    def _better(self, point: CurvePoint, best: CurvePoint) -> bool:
        """Whether held-out patches show less error and novel views the same character."""
        least = self.curve[0].held_out * (1.0 - LEAST_GAIN)
        return point.held_out < min(best.held_out, least) and point.likeness >= self.recipe.least_likeness

    def _progress(self, step: int) -> float:
        spent = (time.perf_counter() - self.start) / self.recipe.seconds
        return min(1.0, max(spent, step / self.recipe.most_steps))

    def _loss(self) -> tuple[Tensor, float]:
        """Loss of a step, and its part on the drawings' rays."""
        learnt = self._error(self.sets.learnt, self.recipe.rays)
        loss = learnt
        if self.recipe.trust > 0 and len(self.sets.trusted):
            loss = loss + self.recipe.trust * self._error(self.sets.trusted, self.recipe.novel_rays)
        return loss, float(learnt.detach())

    def _error(self, targets: Targets, count: int) -> Tensor:
        """Mean error of some rays, each with its weight."""
        index = torch.randint(len(targets), (count,), generator=self.generator).to(targets.alpha.device)
        rgb, opacity = render_cached(self.network.finest, self.renderer, targets.cached, index)
        self.num_answers += int(targets.cached.samples.inside[index].sum())
        errors = self._errors(rgb, opacity, targets.rgb[index], targets.alpha[index])
        return (targets.weights[index] * errors).mean()

    def _errors(self, rgb: Tensor, opacity: Tensor, target: Tensor, alpha: Tensor) -> Tensor:
        color, mask = (rgb - target).square().sum(-1), (opacity - alpha).square()
        return color + self.recipe.opacity * mask

    @torch.no_grad()
    def _look(self, step: int, learnt: float) -> CurvePoint:
        """Measure held-out patches and novel views, and note it."""
        held, guard = self.sets.held_out, self.sets.guard
        rgb, opacity = render_all(self.network.finest, self.renderer, held.cached)
        there, _ = render_all(self.network.finest, self.renderer, guard.cached)
        self.num_answers += len(held.cached.rows.view_features) + len(guard.cached.rows.view_features)
        point = CurvePoint(
            step=step,
            seconds=time.perf_counter() - self.start,
            learnt=learnt,
            held_out=float(self._errors(rgb, opacity, held.rgb, held.alpha).mean()),
            held_out_psnr=_psnr(rgb, held.rgb),
            likeness=_psnr(there, guard.rgb),
        )
        self.curve.append(point)
        return point


def _psnr(rgb: Tensor, target: Tensor) -> float:
    """PSNR over rays, dB; infinite where they are equal."""
    error = float((rgb - target).square().mean()) if len(rgb) else 0.0
    return math.inf if error < CLOSE_TO_EQUAL else -10.0 * math.log10(error)


def _reason(curve: list[CurvePoint], best: CurvePoint, recipe: Recipe) -> str:
    """One sentence on why weights were kept or not."""
    first = curve[0]
    if best.step > 0:
        return (
            f"Kept: the error on held-out patches of the drawings fell from {first.held_out:.5f} to "
            f"{best.held_out:.5f} (PSNR {first.held_out_psnr:.2f} to {best.held_out_psnr:.2f} dB), and novel "
            f"views stayed within {best.likeness:.1f} dB of the start (at least {recipe.least_likeness:g} asked)."
        )
    if len(curve) == 1:
        return "Not kept: the time was over before the first look at the held-out patches; starting weights returned."
    least = min(curve[1:], key=lambda point: point.held_out)
    if least.held_out < first.held_out * (1.0 - LEAST_GAIN):
        return (
            f"Not kept: where held-out patches improved, novel views differed from the start by more than "
            f"{recipe.least_likeness:g} dB allows ({least.likeness:.1f} dB); starting weights returned."
        )
    return (
        f"Not kept: the error on held-out patches of the drawings never fell below {first.held_out:.5f} by more than "
        f"{100 * LEAST_GAIN:g} %; starting weights returned."
    )
