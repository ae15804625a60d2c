"""Every renderer, made of one model, and the names that they bear in tables."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from charnerf.config.composition import compose_config
from charnerf.inference.model import Model
from charnerf.models.charnerf import CharNeRF
from charnerf.volume.renderers.adaptive import AdaptiveRenderer
from charnerf.volume.renderers.baked import BakedRenderer
from charnerf.volume.renderers.base import AbstractRenderer
from charnerf.volume.renderers.culled import CulledRenderer
from charnerf.volume.renderers.dense import DenseRenderer

BASELINE, CULLED, ADAPTIVE, BAKED, DENSE = "pixelNeRF-like", "culled", "adaptive", "baked", "dense"
TRAINING_SCALE = "small"
TOLERANCE = 0.05  # of conf/renderer/adaptive.yaml and baked.yaml


@dataclass(frozen=True)
class Workbench:
    """What is measured.

    Attributes:
        network: The trained network.
        like: Arguments that every renderer takes, the model's own.
        renderers: culled, adaptive, baked and dense, in evaluation.
        training: culled and dense with the number of samples of training at scale=small.
        batch_rays: Rays of a training step there.
        image_size: Of the drawings, pixels.
    """

    network: CharNeRF
    like: dict[str, Any]
    renderers: dict[str, AbstractRenderer]
    training: dict[str, AbstractRenderer]
    batch_rays: int
    image_size: int


def workbench(model: Model) -> Workbench:
    """Renderers of a model's settings."""
    like = model.renderer.settings
    scale = compose_config([f"scale={TRAINING_SCALE}"]).scale
    in_training = {**like, "num_coarse": int(scale.train_num_coarse)}
    return Workbench(
        network=model.network,
        like=like,
        renderers={
            CULLED: CulledRenderer(**like),
            ADAPTIVE: AdaptiveRenderer(**like, tolerance=TOLERANCE),
            BAKED: BakedRenderer(**like, tolerance=TOLERANCE),
            DENSE: DenseRenderer(**like),
        },
        training={CULLED: CulledRenderer(**in_training), DENSE: DenseRenderer(**in_training)},
        batch_rays=int(scale.phase_rays[0]),
        image_size=model.image_size,
    )
