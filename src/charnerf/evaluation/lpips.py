"""Learned perceptual distance between pictures: AlexNet's, which comes with the package, and VGG's where its network is here."""

from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import final

import torch
from safetensors.torch import load
from torch import Tensor, nn
from torch.nn import functional as F

from charnerf.evaluation.metrics import check_pair

_SHIFT, _SCALE = (-0.030, -0.088, -0.188), (0.458, 0.448, 0.450)  # of inputs in [-1, 1]: ImageNet's means
_STRIDES, _PADDINGS, _POOLED = (4, 1, 1, 1, 1), (2, 2, 1, 1, 1), (False, True, True, False, False)
LEAST_SIDE = 31  # pixels: of smaller pictures the last maps have no pixel
_VGG_WEIGHTS = "vgg16-397923af.pth"


@final
class AlexLpips(nn.Module):
    """LPIPS v0.1 with AlexNet: its five convolutions, and a weight for every channel of each.

    The weights lie in the package in half precision, which moves distances by less than 0.0005.

    Source: Zhang 2018 (The Unreasonable Effectiveness of Deep Features as a Perceptual Metric).
    """

    shift: Tensor
    scale: Tensor

    def __init__(self) -> None:
        super().__init__()
        tensors = load(files("charnerf").joinpath("weights/lpips_alexnet.safetensors").read_bytes())
        for name, tensor in tensors.items():
            self.register_buffer(name.replace(".", "_"), tensor.float())
        self.register_buffer("shift", torch.tensor(_SHIFT)[:, None, None])
        self.register_buffer("scale", torch.tensor(_SCALE)[:, None, None])

    def forward(self, pictures: Tensor, truth: Tensor) -> Tensor:
        """Distances (N,) of pictures (N, 3, H, W) from one (1, 3, H, W), in [0, 1], LEAST_SIDE a side or more."""
        x = (2.0 * torch.cat((pictures, truth)) - 1.0 - self.shift) / self.scale
        total = x.new_zeros(len(pictures))
        for index, (stride, padding, is_pooled) in enumerate(zip(_STRIDES, _PADDINGS, _POOLED, strict=True)):
            if is_pooled:
                x = F.max_pool2d(x, 3, stride=2)
            weight, bias = getattr(self, f"conv{index}_weight"), getattr(self, f"conv{index}_bias")
            x = F.conv2d(x, weight, bias, stride=stride, padding=padding).relu()
            unit = x / (x.square().sum(1, keepdim=True).sqrt() + 1e-10)
            squared = (unit[:-1] - unit[-1:]).square()
            head = getattr(self, f"head{index}_weight")[:, None, None]
            total = total + (squared * head).sum(1).mean((-1, -2))
        return total


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
