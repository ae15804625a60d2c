"""Models small enough to test, built part by part."""

from typing import Any

import torch
from torch import nn

from charnerf.models.activations import ShiftedSoftplus
from charnerf.models.charnerf import CharNeRF
from charnerf.models.combinators.base import AbstractCombinator
from charnerf.models.combinators.learned import LearnedWeights
from charnerf.models.combinators.mean import Mean
from charnerf.models.combinators.self_attention import SelfAttention
from charnerf.models.combinators.view_attention import ViewAttention
from charnerf.models.density.base import AbstractDensity
from charnerf.models.density.view_dependent import ViewDependentDensity
from charnerf.models.density.view_free import ViewFreeDensity
from charnerf.models.density.view_in_f1 import ViewInF1Density
from charnerf.models.encoders.double import DoubleHourglass
from charnerf.models.encoders.single import SingleHourglass
from charnerf.models.features.image import ImageFeatures
from charnerf.models.features.image_hull import ImageHullFeatures
from charnerf.models.features.image_hull_section import ImageHullSectionFeatures
from charnerf.models.features.image_hull_section_consistency import ImageHullSectionConsistencyFeatures
from charnerf.models.field import Field
from charnerf.models.heads.blend import BlendHead
from charnerf.models.heads.radiance import RadianceHead
from charnerf.models.single_view.base import AbstractSingleView
from charnerf.models.single_view.camera import CameraSingleView
from charnerf.models.single_view.world import WorldSingleView
from charnerf.models.views.mirrored import MirroredSide
from charnerf.models.views.turnaround import Turnaround

WIDTH = 12
FREQUENCIES = 3
DENSITIES = ("view_free", "view_dependent", "view_in_f1")
COMBINATORS = ("mean", "sa", "view_mha", "learned")


def attention(**changes: Any) -> dict[str, Any]:
    """Arguments of the paper's plain attention with two heads, some of them changed."""
    plain = {"width": WIDTH, "num_heads": 2, "attention_width": None, "residual": False, "norm": True}
    return {**plain, "temperature": None, "lr_scale": 1.0, **changes}


def combinator(name: str, *, width: int = WIDTH) -> AbstractCombinator:
    """A combinator by its option's name."""
    made = {
        "mean": Mean,
        "sa": lambda: SelfAttention(**attention(width=width)),
        "view_mha": lambda: ViewAttention(**attention(width=width), view_scale=1.0),
        "learned": lambda: LearnedWeights(width=width, hidden=8),
    }
    return made[name]()


def density_by(name: str, *, width: int = WIDTH) -> AbstractDensity:
    """Which stages see directions, by the option's name."""
    made = {
        "view_free": lambda: ViewFreeDensity(width=width),
        "view_dependent": ViewDependentDensity,
        "view_in_f1": ViewInF1Density,
    }
    return made[name]()


def single(*, stride: int = 2, num_stacks: int = 1) -> SingleHourglass:
    """A tiny encoder of one hourglass."""
    return SingleHourglass(
        in_channels=4, num_stacks=num_stacks, depth=2, width=8, out_channels=6, stride=stride
    )


def double() -> DoubleHourglass:
    """A tiny encoder of two."""
    return DoubleHourglass(
        in_channels=4,
        coarse_stacks=2,
        fine_stacks=1,
        depth=1,
        coarse_width=8,
        fine_width=8,
        coarse_channels=5,
        fine_channels=6,
        reduction=2,
        stride=2,
    )


def f1(
    name: str, *, num_point_features: int = 0, num_blocks: int = 1, width: int = WIDTH
) -> AbstractSingleView:
    """f1 by its option's name."""
    sizes = {"width": width, "num_point_features": num_point_features, "num_blocks": num_blocks}
    if name == "camera":
        return CameraSingleView(**sizes, octaves=2, factor=1.5)
    return WorldSingleView(**sizes, num_frequencies=FREQUENCIES)


def tiny_model(
    *,
    combining: str = "learned",
    head: str = "blend",
    density: str = "view_free",
    views: str = "turnaround",
    features: str = "image_hull",
    single_view: str = "world",
    fine: bool = False,
    hull: bool = True,
    image_size: int = 32,
    width: int = WIDTH,
    num_blocks: int = 1,
) -> CharNeRF:
    """A model of a few thousand parameters; the names are those of the config's options."""
    encoder = single()
    options = {
        "image": ImageFeatures,
        "image_hull": ImageHullFeatures,
        "image_hull_section": ImageHullSectionFeatures,
        "image_hull_section_consistency": ImageHullSectionConsistencyFeatures,
    }
    inputs = options[features]()

    def field() -> Field:
        return Field(
            features=inputs,
            single_view=f1(
                single_view, num_point_features=inputs.num_point_features, num_blocks=num_blocks, width=width
            ),
            combinator=combinator(combining, width=width),
            density=density_by(density, width=width),
            head=BlendHead(width=width, hidden=8) if head == "blend" else RadianceHead(width=width),
            activation=ShiftedSoftplus(shift=-1.0, scale=20.0),
            feature_channels=encoder.out_channels,
            width=width,
            num_multi_view_blocks=num_blocks,
        )

    return CharNeRF(
        encoder=encoder,
        views={"turnaround": Turnaround, "mirrored": MirroredSide}[views](),
        coarse=field(),
        fine=field() if fine else None,
        box_centre=[0.0, 0.0, 1.0],
        box_half_extent=1.8,
        hull=hull,
        image_size=image_size,
    )


def shake(module: nn.Module, *, seed: int = 0, scale: float = 0.3) -> nn.Module:
    """Add noise to every parameter: layers that start at zero would hide what depends on what."""
    generator = torch.Generator().manual_seed(seed)
    with torch.no_grad():
        for parameter in module.parameters():
            noise = torch.randn(parameter.shape, generator=generator, dtype=parameter.dtype)
            parameter.add_(noise, alpha=scale)
    return module
