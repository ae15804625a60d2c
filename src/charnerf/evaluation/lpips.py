"""Learned perceptual distance between pictures, where its network is on this machine."""

from pathlib import Path
from typing import final

import torch
from torch import Tensor

from charnerf.evaluation.metrics import check_pair

_WEIGHTS = "vgg16-397923af.pth"


@final
class Lpips:
    """Learned perceptual distance (VGG) with its network, loaded once and never downloaded.

    Attributes:
        reason: Why the network could not be had; None where it could.

    Source: Zhang 2018; torchmetrics (its linear weights), torchvision (the network).
    """

    def __init__(self) -> None:
        self.reason = _why_missing()
        self._network = None
        if self.reason is None:
            from torchmetrics.image.lpip import LearnedPerceptualImagePatchSimilarity

            self._network = LearnedPerceptualImagePatchSimilarity(net_type="vgg", normalize=True).eval()

    def __call__(self, prediction: Tensor, truth: Tensor) -> float | None:
        """Distance of two pictures (H, W, 3) in [0, 1]; None without the network.

        Raises:
            DataError: If values leave [0, 1].
            NumericalError: If values are not finite.
            ShapeError: If the shapes differ.
        """
        check_pair(prediction, truth)
        if self._network is None:
            return None
        pictures = [
            picture.detach().cpu().float().clamp(0.0, 1.0).movedim(-1, 0)[None]
            for picture in (prediction, truth)
        ]
        with torch.no_grad():
            return float(self._network(*pictures))


def _why_missing() -> str | None:
    """Why the network can not be had without a download; None where it can."""
    try:
        import torchvision  # noqa: F401
    except (ImportError, RuntimeError) as error:
        return f"LPIPS needs torchvision, which does not import here ({error}); install it beside this torch"
    if not (Path(torch.hub.get_dir()) / "checkpoints" / _WEIGHTS).is_file():
        return (
            f"LPIPS needs the VGG-16 weights {_WEIGHTS} in torch's hub folder (checkpoints/), and "
            "nothing is downloaded unasked: fetch them once by torchvision.models.vgg16(weights='DEFAULT')"
        )
    return None
