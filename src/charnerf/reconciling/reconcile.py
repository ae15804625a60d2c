"""Which view rules which, what is moved where, and the figures of it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from charnerf.reconciling.agreement import iou, share_apart
from charnerf.reconciling.heights import row_offsets
from charnerf.reconciling.registration import SIDE, filled, find_flow, premultiplied, resized, warped
from charnerf.reconciling.tolerance import TOLERANCES, tolerances, widened

AGREES = (
    0.002  # share of two outlines' pixels that may lie apart where views are left as they are, bit for bit
)
LEAST_IOU = (
    0.75  # of a moved outline with its partner's; below, the poses are too unlike for colours to be trusted
)
OPPOSITE = 5.0  # degrees by which azimuths may miss 180, and elevations 0, and still be opposite, and level
COPY = 0.03  # mean difference of colours below which two drawings are one and the same


@dataclass(frozen=True)
class ViewAgreement:
    """How one view agrees with those before it.

    Attributes:
        partner: Index of the view from the opposite side, whose outline this one's mirrors; None where there is none.
        apart_before: Share of the two outlines' pixels that lie apart by more than a pixel of 128, as drawn; 0 without a
            partner.
        iou_before: Of the outlines as drawn; 1 without a partner.
        iou_after: Once moved, before the outline was taken over.
        iou_unmirrored: As drawn, without mirroring: larger where a view was traced.
        rows_moved: Largest vertical shift, share of the side.
        is_mended: Whether anything was changed.
        is_trusted: Whether its colours stand where they should: False where it could not be reconciled.
        copies: Index of a view of which this one is a copy, mirrored or not; None where it is none.
        tolerance: By how much each row of its outline, once mended, may be off, (SIDE,), pixels of 128; infinite where
            it carves nothing.
    """

    partner: int | None
    apart_before: float
    iou_before: float
    iou_after: float
    iou_unmirrored: float
    rows_moved: float
    is_mended: bool
    is_trusted: bool
    copies: int | None
    tolerance: np.ndarray


@final
@dataclass(frozen=True)
class Reconciliation:
    """How views are made to agree, found once and done at any size.

    Attributes:
        views: By view, in the order given.
        flows: By view, (2, SIDE, SIDE) as `registration` has them; None where a view stays as it is.
    """

    views: tuple[ViewAgreement, ...]
    flows: tuple[np.ndarray | None, ...]

    def apply(self, canvases: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Reconcile canvases (S, S, 4) of the same views at any size; a view that agrees is returned as it is."""
        mended: list[np.ndarray] = []
        for canvas, view, flow in zip(canvases, self.views, self.flows, strict=True):
            mended.append(_moved(canvas, flow, None if view.partner is None else mended[view.partner]))
        return mended

    def widened_alphas(self, mended: Sequence[np.ndarray]) -> np.ndarray | None:
        """What hulls of reconciled canvases (S, S, 4) are to be carved from, (V, S, S); None where outlines agree."""
        if all((one.tolerance == TOLERANCES[0]).all() for one in self.views):
            return None
        pairs = zip(mended, self.views, strict=True)
        return np.stack([widened(canvas[..., 3], one.tolerance) for canvas, one in pairs])


def reconcile(
    canvases: Sequence[np.ndarray],
    azimuths_deg: Sequence[float],
    elevations_deg: Sequence[float] | None = None,
) -> Reconciliation:
    """Find how views of one character are made to agree.

    Args:
        canvases: RGBA (S, S, 4) each, float32 in [0, 1], straight alpha, on one scale, floor line and axis; the first rules,
            then the second, and so on.
        azimuths_deg: Of their cameras.
        elevations_deg: Of their cameras, 0 if not given. What is seen from above or below has no rows in common with
            the others: it is left as it is, and only colours where those had to be mended.

    Returns:
        Nothing to do where views agree.
    """
    drawn = [resized(canvas, SIDE) for canvas in canvases]
    level = np.abs(np.zeros(len(drawn)) if elevations_deg is None else np.asarray(elevations_deg)) <= OPPOSITE
    partners = [_partner(azimuths_deg, index, level) for index in range(len(drawn))]
    flows: list[np.ndarray | None] = []
    mended: list[np.ndarray] = []
    for index, (picture, partner) in enumerate(zip(drawn, partners, strict=True)):
        if partner is not None:
            target = mended[partner][:, ::-1]
            agrees = share_apart(target[..., 3], picture[..., 3]) <= AGREES
            flows.append(None if agrees else find_flow(target, picture))
        else:
            comparable = index > 0 and level[0] and level[index]
            flows.append(_vertical(row_offsets(mended[0], picture)) if comparable else None)
        mended.append(_moved(picture, flows[index], None if partner is None else mended[partner]))
    allowed = _allowed([picture[..., 3] for picture in mended], azimuths_deg, level)
    views = [
        _agreement(picture, flow, partner, mended, _copied(drawn, index), allowed[index])
        for index, (picture, flow, partner) in enumerate(zip(drawn, flows, partners, strict=True))
    ]
    return Reconciliation(tuple(views), tuple(flows))


def _moved(canvas: np.ndarray, flow: np.ndarray | None, partner: np.ndarray | None) -> np.ndarray:
    """A canvas along its flow, with the mirrored outline of its partner where it has one."""
    if flow is None:
        return canvas
    moved = warped(canvas, flow)
    return moved if partner is None else filled(moved, partner[:, ::-1, 3])


def _agreement(
    picture: np.ndarray,
    flow: np.ndarray | None,
    partner: int | None,
    mended: Sequence[np.ndarray],
    copies: int | None,
    tolerance: np.ndarray,
) -> ViewAgreement:
    """The figures of one view as drawn (SIDE, SIDE, 4)."""
    outline = picture[..., 3]
    target = outline if partner is None else mended[partner][:, ::-1, 3]
    after = warped(picture, flow)[..., 3] if flow is not None and partner is not None else outline
    overlap = iou(target, after)
    return ViewAgreement(
        partner=partner,
        apart_before=share_apart(target, outline),
        iou_before=iou(target, outline),
        iou_after=overlap,
        iou_unmirrored=iou(target[:, ::-1], outline),
        rows_moved=0.0 if flow is None else float(np.abs(flow[0])[target > 0.5].max(initial=0.0)),
        is_mended=flow is not None,
        is_trusted=overlap >= LEAST_IOU,
        copies=copies,
        tolerance=tolerance,
    )


def _vertical(offsets: np.ndarray | None) -> np.ndarray | None:
    """Row offsets (SIDE,) as a flow."""
    if offsets is None:
        return None
    down = np.repeat(offsets[:, None], SIDE, axis=1)
    return np.stack((down, np.zeros_like(down)))


def _partner(azimuths_deg: Sequence[float], index: int, level: np.ndarray) -> int | None:
    """The first earlier view from the opposite side; None for views from above or below."""
    turns = [(azimuths_deg[index] - azimuth) % 360.0 for azimuth in azimuths_deg[:index]]
    opposite = (i for i, turn in enumerate(turns) if level[i] and abs(turn - 180.0) <= OPPOSITE)
    return next(opposite, None) if level[index] else None


def _allowed(outlines: Sequence[np.ndarray], azimuths_deg: Sequence[float], level: np.ndarray) -> np.ndarray:
    """Tolerances (V, SIDE) of all views; one from above or below carves where the level ones agree, else not at all."""
    rows = np.flatnonzero(level).tolist()
    found = np.full((len(outlines), SIDE), TOLERANCES[0])
    if len(rows) > 1:
        found[rows] = tolerances([outlines[i] for i in rows], [azimuths_deg[i] for i in rows])
        if (found[rows] > TOLERANCES[0]).any():
            found[~level] = np.inf
    return found


def _copied(pictures: Sequence[np.ndarray], index: int) -> int | None:
    """An earlier picture that a picture is a copy of, mirrored or not."""
    picture = premultiplied(pictures[index])
    for earlier, other in enumerate(map(premultiplied, pictures[:index])):
        least = min(np.abs(one - picture).mean() for one in (other, other[:, ::-1]))
        if least < COPY * (other[..., 3] > 0.5).mean():
            return earlier
    return None
