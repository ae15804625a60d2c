"""Learned perceptual distance between pictures: AlexNet's, which comes with the package, and VGG's where its network is here."""

from collections.abc import Sequence
from pathlib import Path
from typing import final

import torch
from torch import Tensor

from charnerf.evaluation.metrics import check_pair
from charnerf.losses.alex_lpips import LEAST_SIDE, AlexLpips

_VGG_WEIGHTS = "vgg16-397923af.pth"


@final
class Lpips:
    """Perceptual distances of two pictures, networks loaded once and never downloaded.

    Attributes:
        vgg_reason: Why VGG's could not be had; None where it could.

    Source: Zhang 2018; for VGG torchmetrics (its linear weights) and torchvision (the network).
    """

    def __init__(self) -> None:
        self._alex = AlexLpips().eval()
        self.vgg_reason = _why_missing()
        self._vgg = None
        if self.vgg_reason is None:
            from torchmetrics.image.lpip import LearnedPerceptualImagePatchSimilarity

            self._vgg = LearnedPerceptualImagePatchSimilarity(net_type="vgg", normalize=True).eval()

    def __call__(self, prediction: Tensor, truth: Tensor) -> dict[str, float | None]:
        """What `of_all` says of one picture."""
        return self.of_all([prediction], truth)[0]

    @torch.no_grad()
    def of_all(self, predictions: Sequence[Tensor], truth: Tensor) -> list[dict[str, float | None]]:
        """`lpips` (AlexNet) and `lpips_vgg` of pictures from a true one; None without VGG's network or too small.

        Args:
            predictions: (H, W, 3) each, in [0, 1].
            truth: (H, W, 3), in [0, 1]; AlexNet sees it once for all of them.

        Raises:
            DataError: If values leave [0, 1].
            NumericalError: If values are not finite.
            ShapeError: If the shapes differ.
        """
        for prediction in predictions:
            check_pair(prediction, truth)
        if min(truth.shape[:2]) < LEAST_SIDE:
            return [{"lpips": None, "lpips_vgg": None} for _ in predictions]
        *pictures, true = (
            picture.detach().cpu().float().clamp(0.0, 1.0).movedim(-1, 0)[None]
            for picture in (*predictions, truth)
        )
        return [
            {"lpips": distance, "lpips_vgg": None if self._vgg is None else float(self._vgg(picture, true))}
            for distance, picture in zip(
                self._alex(torch.cat(pictures), true).tolist(), pictures, strict=True
            )
        ]


def _why_missing() -> str | None:
    """Why VGG's network can not be had without a download; None where it can."""
    try:
        import torchvision  # noqa: F401
    except (ImportError, RuntimeError) as error:
        return f"LPIPS with VGG needs torchvision, which does not import here ({error}); install it beside this torch"
    if not (Path(torch.hub.get_dir()) / "checkpoints" / _VGG_WEIGHTS).is_file():
        return (
            f"LPIPS with VGG needs the weights {_VGG_WEIGHTS} in torch's hub folder (checkpoints/), and "
            "nothing is downloaded unasked: fetch them once by torchvision.models.vgg16(weights='DEFAULT')"
        )
    return None
