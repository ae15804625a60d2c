"""What f1 is: encoder features, a point's place and a direction in, one feature a view out, each view by itself."""

from abc import ABC, abstractmethod

from torch import Tensor, nn

from charnerf.models.inputs import FieldInputs


class AbstractSingleView(nn.Module, ABC):
    """f1 (paper, Fig. network).

    Attributes:
        latent_size: How many linear maps of the encoder's features are read at a point.
    """

    latent_size: int

    @abstractmethod
    def forward(self, inputs: FieldInputs, point_features: Tensor, view_dirs: Tensor) -> Tensor:
        """V^(i) (P, V, D) of points.

        Args:
            inputs: Where the points lie, and the encoder's features there.
            point_features: Further inputs, (P, V, E); E may be 0.
            view_dirs: (P, 3), or (1, 3) for all; zero means no direction.
        """
