"""Nothing beside the encoder's features, as the paper."""

from typing import final

from torch import Tensor

from charnerf.models.features.base import AbstractFeatures, ViewReadings


@final
class ImageFeatures(AbstractFeatures):
    """No further inputs."""

    num_point_features = 0
    reads_hull = False

    def __call__(self, readings: ViewReadings) -> Tensor:
        """Return (P, V, 0)."""
        return readings.source_rgb[..., :0]
