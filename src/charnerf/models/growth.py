"""A wider or deeper field that begins by answering as a trained one does.

Letters: O old units, N new ones; P points, V views.
"""

import torch
from torch import Tensor

from charnerf.errors import ShapeError
from charnerf.geometry.safe import safe_normalize
from charnerf.models.charnerf import CharNeRF
from charnerf.models.field import Field
from charnerf.models.inputs import FieldInputs, PointViews

FIELDS = ("coarse.", "fine.")
NUM_POINTS, NUM_VIEWS = 64, 4  # at which two fields are compared
ROUNDING = 1e-4  # of an answer in float32, sums over other widths included; what is really another answer is off by a tenth or more


def grow_from(model: CharNeRF, smaller: CharNeRF) -> None:
    """Put the weights of a smaller model into one with wider fields or more residual blocks; its answers stay the same.

    Old units go on reading old ones alone, and new units, which nothing reads yet, keep their random weights; the last layer of a
    new block is zero. The encoders have to be the same.

    Args:
        model: The larger one, with fresh weights; changed.
        smaller: The trained one.

    Raises:
        ShapeError: If the parts are others, something is smaller, or the parts can not grow without another answer (attention
            divides by its width).

    Source: Net2Net (Chen 2016), with units of their own in place of copies, which only noise would tell apart.
    """
    fresh, old = model.state_dict(), smaller.state_dict()
    missing = [name for name in old if name not in fresh]
    added = [name for name in fresh if name not in old and ".blocks." not in name]
    if missing or added:
        raise ShapeError(f"found other parts in the two models: {', '.join((missing + added)[:3])}.")
    for name, value in old.items():
        _place(fresh[name], value, name)  # the tensors of a state are those of the model
    for mine, its in ((model.coarse, smaller.coarse), (model.fine, smaller.fine)):
        if mine is not None and its is not None and not _answer_alike(mine, its):
            raise ShapeError("found parts that answer otherwise once they are larger, such as attention.")


def _place(fresh: Tensor, old: Tensor, name: str) -> None:
    """Write old weights (O, ...) into the first rows and columns of fresh ones (O + N, ...)."""
    if fresh.shape == old.shape:
        fresh.copy_(old)
        return
    is_smaller = fresh.ndim != old.ndim or any(a < b for a, b in zip(fresh.shape, old.shape, strict=False))
    if is_smaller or not name.startswith(FIELDS):
        raise ShapeError(f"{name}: found {tuple(fresh.shape)} for a trained {tuple(old.shape)}.")
    fresh[: len(old)] = 0.0  # what is old does not read what is new
    fresh[tuple(slice(size) for size in old.shape)] = old


def _answer_alike(first: Field, second: Field) -> bool:
    """Whether two fields answer seeded random inputs with the same colours and densities."""
    answers = []
    for field in (first, second):
        with torch.no_grad():
            answers.append(field(*_random_inputs(field)))
    mine, its = answers
    return all(
        torch.allclose(a, b, rtol=ROUNDING, atol=ROUNDING)
        for a, b in ((mine.rgb, its.rgb), (mine.densities, its.densities))
    )


def _random_inputs(field: Field) -> tuple[FieldInputs, Tensor]:
    generator = torch.Generator().manual_seed(0)

    def normal(*shape: int) -> Tensor:
        return torch.randn(*shape, generator=generator)

    def unit(*shape: int) -> Tensor:
        return safe_normalize(normal(*shape))

    def share(*shape: int) -> Tensor:
        return torch.rand(*shape, generator=generator)

    points, views = NUM_POINTS, NUM_VIEWS
    rows = normal(points * views, field.from_latents.in_features)
    inputs = FieldInputs(
        views=PointViews(
            rgb=share(points, views, 3),
            uv=share(points, views, 2),
            dirs=unit(points, views, 3),
            behind=0.1 * normal(points, views),
            valid=share(points, views) > 0.2,
        ),
        latents=field.hoist(rows).view(points, views, -1),
        edge=0.1 * normal(points, views),
        mirrored=torch.zeros(views),
        section_places=normal(points, 3),
        section_lengths=share(points, 3),
        box_points=unit(points, 3),
        rotations=torch.eye(3).expand(views, 3, 3),
        kept=torch.ones(points),
    )
    return inputs, unit(points, 3)
