"""Nothing beside the encoder's features, as the paper."""

from typing import final

from torch import Tensor

from charnerf.models.features.base import AbstractFeatures
from charnerf.models.inputs import FieldInputs


@final
class ImageFeatures(AbstractFeatures):
    """No further inputs."""

    num_point_features = 0
    reads_hull = False

    def __call__(self, inputs: FieldInputs) -> Tensor:
        """Return (P, V, 0)."""
        return inputs.views.rgb[..., :0]
