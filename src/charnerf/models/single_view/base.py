"""What f1 is: encoder features, a point's place and a direction in, one feature a view out, each view by itself."""

from abc import ABC, abstractmethod

from torch import Tensor, nn

from charnerf.models.inputs import PointInputs


class AbstractSingleView(nn.Module, ABC):
    """f1 (paper, Fig. network).

    Attributes:
        latent_size: How many linear maps of the encoder's features are read at a point.
    """

    latent_size: int

    @abstractmethod
    def locate(self, points: Tensor, rotations: Tensor) -> Tensor:
        """Encode where points lie; no weights enter, so that it is done once for all fields.

        Args:
            points: (P, 3), box coordinates in (-1, 1).
            rotations: Axes of the source cameras in the world, (V, 3, 3): camera-to-world.

        Returns:
            (P, C), or (P, V, C) where it depends on the view: `encoded_points` of the inputs.
        """

    @abstractmethod
    def forward(self, inputs: PointInputs, view_dirs: Tensor) -> Tensor:
        """V^(i) (P, V, D) of points seen along view_dirs (P, 3), or (1, 3) for all; zero means no direction."""
