"""Everything a benchmark measures, made of one model."""

import copy
from typing import Any

from charnerf.bench.headline import ADAPTIVE, CULLED, DENSE, Workbench
from charnerf.bench.subjects import untrained_like
from charnerf.config.composition import compose_config
from charnerf.inference import weights as runs
from charnerf.inference.model import Model
from charnerf.models.charnerf import CharNeRF
from charnerf.volume.renderers.adaptive import AdaptiveRenderer
from charnerf.volume.renderers.base import AbstractRenderer
from charnerf.volume.renderers.culled import CulledRenderer
from charnerf.volume.renderers.dense import DenseRenderer

WIDE = 512
TRAINING_SCALE = "small"
TOLERANCE = 0.05  # of conf/renderer/adaptive.yaml
CHUNK_SHARE = 0.125  # of the memory budget, for one chunk of points


def workbench(model: Model, *, memory_mib: float, tolerance: float = TOLERANCE) -> Workbench:
    """Renderers and networks for the headline.

    Args:
        model: The trained model.
        memory_mib: Budget of a rendering or a mesh, MiB.
        tolerance: Asked of the adaptive renderer.
    """
    like = settings_of(model.renderer)
    like["memory_mib"] = CHUNK_SHARE * memory_mib
    scale = compose_config([f"scale={TRAINING_SCALE}"]).scale
    in_training = {**like, "num_coarse": int(scale.train_num_coarse)}
    return Workbench(
        network=model.network,
        wide=resized_network(model, WIDE),
        like=like,
        renderers={
            CULLED: CulledRenderer(**like),
            ADAPTIVE: AdaptiveRenderer(**like, tolerance=tolerance),
            DENSE: DenseRenderer(**like),
        },
        training={CULLED: CulledRenderer(**in_training), DENSE: DenseRenderer(**in_training)},
        batch_rays=int(scale.phase_rays[0]),
        memory_mib=memory_mib,
        image_size=model.image_size,
    )


def settings_of(renderer: AbstractRenderer) -> dict[str, Any]:
    """Arguments that every renderer takes, of a given one."""
    return {
        "quadrature": renderer.quadrature,
        "num_coarse": renderer.num_coarse,
        "num_fine": renderer.num_fine,
        "hull_steps": renderer.hull_steps,
        "memory_mib": renderer.memory_mib,
    }


def resized_network(model: Model, width: int, seed: int = 0) -> CharNeRF:
    """A network as the model's with another width and seeded weights, on the same device."""
    config = copy.deepcopy(model.config)
    config.model.width = width
    network = untrained_like(runs.build_model(config), seed)
    return network.requires_grad_(False).eval().to(model.device)
