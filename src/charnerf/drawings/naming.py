"""Which view each figure of a sheet is: by likeness of outlines, symmetry, faces and feet, and the order they stand in.

Letters: N figures, S side of a canvas.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise, permutations

import numpy as np
from scipy import ndimage
from skimage.color import rgb2lab

from charnerf.drawings.viewpoints import Viewpoint, viewpoint
from charnerf.reconciling.agreement import iou

HEAD, FEET, SHINS = (0.0, 0.22), (0.93, 1.0), (0.75, 0.9)  # shares of the height from the top
TURNED = 0.05  # of the height: offset of feet and face that surely is a turn
TURNS = {  # views of a sheet by how many there are, in the order in which a figure turns
    2: (("front", "side"), ("front", "back")),
    3: (("front", "side", "back"), ("front", "three-quarter", "side"), ("front", "three-quarter", "back")),
    4: (("front", "three-quarter", "side", "back"), ("front", "side", "back", "other side")),
    5: (("front", "three-quarter", "side", "three-quarter back", "back"),),
}
MOST_NAMED = max(TURNS)
DOUBTFUL = 0.08  # lead of the best naming over the next one below which the user is asked to look
UNSURE = 1.5  # log-odds that front and back are not swapped, below which too; of 276 train sheets none was beyond and wrong
SUREST = 4.0  # log-odds beyond which more evidence counts no more
DETAIL_ODDS, FACE_ODDS, AHEAD_ODDS = 6.0, 2.0, 2.0  # fitted to 138 train characters, captured and drawn
LIKE_FRONT = 0.65  # IoU with the front's outline beyond which a side may be a three-quarter view
LIKE_WIDTHS = 0.8  # correlation with its rows' widths beyond which it then is
MIRRORED = 0.8  # IoU of two outlines, one mirrored, beyond which they are two sides rather than one and a three-quarter view
MIRRORED_WEIGHT = 5.0
LAYOUT_WEIGHT = 0.1
FIRST_WEIGHT = 0.2  # of a front that stands before the back
ODDS_WEIGHT = 0.2  # of a front and back told apart
HALVES_WEIGHT = 4.0
LOOKS_WEIGHT = 0.1  # of feet and face: they trail in a stride or under a robe, colours do not
CLEAR_HALVES = 0.02  # agreement of halves beyond which colours alone say where a profile looks
HEAD_WEIGHT = 4.0  # of rows that show the head: a face tells front from back, clothes often do not


@dataclass(frozen=True)
class Naming:
    """What each figure was taken for.

    Attributes:
        viewpoints: By figure, in the order given.
        is_doubtful: Whether another naming is nearly as good, or better but for where the figures stand, or front and back
            are hardly told apart.
        reasons: What spoke for it, sentences.
    """

    viewpoints: tuple[Viewpoint, ...]
    is_doubtful: bool
    reasons: tuple[str, ...]


@dataclass(frozen=True)
class _Looks:
    """What is measured of a figure: symmetry, width, detail of its head and of all, where feet and face look (-1 left, 1 right)."""

    symmetry: float
    width: float
    face: float
    detail: float
    direction: float


def name_views(canvases: Sequence[np.ndarray]) -> Naming:
    """Name figures of one character.

    Args:
        canvases: RGBA (S, S, 4) each, on one scale, floor line and axis; two to five of them.

    Returns:
        A naming that uses each view once, front among them.
    """
    looks = [_looks(canvas) for canvas in canvases]
    scored = []
    for roles in TURNS[len(canvases)]:
        for order in permutations(range(len(canvases))):
            by_role = {role: order[place] for place, role in enumerate(roles)}
            likeness = _score(by_role, canvases, looks) - 0.15 * TURNS[len(canvases)].index(roles)
            scored.append((likeness + _layout(by_role), by_role, likeness))
    scored.sort(key=lambda one: -one[0])
    best = scored[0][1]
    by_likeness = max(scored, key=lambda one: one[2])[1]
    figures = {index: role for role, index in best.items()}
    viewpoints = tuple(_viewpoint(figures[index], best, canvases, looks) for index in range(len(canvases)))
    others = [
        score
        for score, by_role, _ in scored
        if by_role.get("front") != best["front"] or set(by_role) != set(best)
    ]
    lead = scored[0][0] - max(others, default=-np.inf)
    is_unsure = "back" in best and _odds_of_front(best, canvases, looks) < UNSURE
    reasons = (
        f"heads: {', '.join(f'{one.face:.2f}' for one in looks)} (a face shows more)",
        f"symmetry: {', '.join(f'{one.symmetry:.2f}' for one in looks)}",
    )
    is_by_place = _pairs(by_likeness) != _pairs(best)
    return Naming(viewpoints, is_unsure or bool(lead < DOUBTFUL) or is_by_place, reasons)


def looks_left(side: np.ndarray, front: np.ndarray | None = None, back: np.ndarray | None = None) -> bool:
    """Whether a figure seen from a side (S, S, 4) looks to the picture's left.

    By its feet and its face; with front and back, on canvases of its scale, by which half of it has whose colours too.
    """
    return _turn(side, front, back, _looks(side)) < 0.0


def colors_look_left(side: np.ndarray, front: np.ndarray, back: np.ndarray) -> bool | None:
    """Whether a profile looks to the picture's left by the colours of front and back alone; None where they do not say clearly."""
    halves = _halves(front, back, side)
    return None if abs(halves) < CLEAR_HALVES else halves > 0.0


def outline_of_front(side: np.ndarray, front: np.ndarray) -> float | None:
    """IoU of what is called a side (S, S, 4) with the front's outline, where they are alike, as a three-quarter one is; else None.

    How often that is wrong: docs/drawings.md.
    """
    overlap = max(iou(side[..., 3], one[..., 3]) for one in (front, front[:, ::-1]))
    widths = np.stack([_spans(canvas[..., 3] > 0.5) for canvas in (side, front)])
    widths = widths[:, (widths > 0).all(axis=0)]
    if overlap < LIKE_FRONT or widths.shape[1] < 2 or not widths.std(axis=1).all():
        return None
    return overlap if np.corrcoef(widths)[0, 1] >= LIKE_WIDTHS else None


def _turn(side: np.ndarray, front: np.ndarray | None, back: np.ndarray | None, looks: "_Looks") -> float:
    """How surely a profile looks to the picture's right; below 0 to its left."""
    by_halves = 0.0 if front is None or back is None else -HALVES_WEIGHT * _halves(front, back, side)
    return by_halves + LOOKS_WEIGHT * looks.direction


def _viewpoint(
    role: str, best: dict[str, int], canvases: Sequence[np.ndarray], looks: Sequence[_Looks]
) -> Viewpoint:
    """Azimuth of a role: a figure that looks to the picture's left shows the character's left side."""
    if role in ("front", "back"):
        return viewpoint(role)
    if "side" in best and role != "three-quarter":
        side, back = best["side"], best.get("back")
        behind = None if back is None else canvases[back]
        to_left = _turn(canvases[side], canvases[best["front"]], behind, looks[side]) < 0.0
    else:
        to_left = looks[best[role]].direction < 0.0
    if role == "other side":
        to_left = not to_left
    azimuth = {"side": 90.0, "other side": 90.0, "three-quarter": 45.0, "three-quarter back": 135.0}[role]
    return Viewpoint(azimuth if to_left else 360.0 - azimuth)


def _score(roles: dict[str, int], canvases: Sequence[np.ndarray], looks: Sequence[_Looks]) -> float:
    """How well figures fit roles; about 1 for each piece of evidence."""
    front = roles["front"]
    score = looks[front].symmetry
    if "back" not in roles:
        score += 0.5 * _standing(looks, front, "face")
    else:
        back = roles["back"]
        score += 2.0 * iou(canvases[front][:, ::-1, 3], canvases[back][..., 3]) + looks[back].symmetry
        score += ODDS_WEIGHT * float(np.clip(_odds_of_front(roles, canvases, looks), -SUREST, SUREST))
    if "side" in roles:
        side = roles["side"]
        score += 1.0 - looks[side].symmetry + (1.0 - _standing(looks, side, "width"))
        if "back" in roles:
            score += abs(_turn(canvases[side], canvases[front], canvases[roles["back"]], looks[side]))
        if "other side" in roles:
            mirrored = canvases[roles["other side"]][:, ::-1, 3]
            score += MIRRORED_WEIGHT * (iou(canvases[side][..., 3], mirrored) - MIRRORED)
    return score


def _odds_of_front(roles: dict[str, int], canvases: Sequence[np.ndarray], looks: Sequence[_Looks]) -> float:
    """Log-odds that front and back are not swapped.

    A front shows more, above all its face; and the half of a profile with the front's colours is the one that feet and face
    look to.
    """
    front, back = looks[roles["front"]], looks[roles["back"]]
    odds = DETAIL_ODDS * _contrast(front.detail, back.detail) + FACE_ODDS * _contrast(front.face, back.face)
    if "side" in roles:
        side = roles["side"]
        halves = _halves(canvases[roles["front"]], canvases[roles["back"]], canvases[side])
        odds += AHEAD_ODDS * looks[side].direction * float(np.clip(-halves / CLEAR_HALVES, -1.0, 1.0))
    return odds


def _contrast(one: float, other: float) -> float:
    """How much larger one measure is than another, within [-1, 1]."""
    return (one - other) / max(one + other, 1e-6)


def _pairs(roles: dict[str, int]) -> set[tuple[str, int]]:
    """Roles of figures, where it is all one which of two sides is called the other."""
    return {("side" if role == "other side" else role, index) for role, index in roles.items()}


def _layout(roles: dict[str, int]) -> float:
    """How well the figures stand as artists place them: as one turns, the front first."""
    places = [index for _, index in sorted(roles.items(), key=lambda pair: _TURN[pair[0]])]
    steps = sum(later > earlier for earlier, later in pairwise(places))
    in_turn = LAYOUT_WEIGHT * (steps / max(1, len(places) - 1) + (roles["front"] == 0))
    return in_turn + FIRST_WEIGHT * ("back" in roles and roles["front"] < roles["back"])


_TURN = {"front": 0, "three-quarter": 1, "side": 2, "three-quarter back": 3, "back": 4, "other side": 5}


def _standing(looks: Sequence[_Looks], index: int, what: str) -> float:
    """Where a figure stands among all of them in a measure, 0 the least to 1 the most."""
    values = np.array([getattr(one, what) for one in looks])
    span = values.max() - values.min()
    return float((values[index] - values.min()) / span) if span > 1e-6 else 0.5


def _looks(canvas: np.ndarray) -> _Looks:
    alpha = canvas[..., 3]
    inside = alpha > 0.5
    rows = np.flatnonzero(inside.any(axis=1))
    top, height = int(rows[0]), len(rows)

    def band(span: tuple[float, float]) -> slice:
        return slice(top + int(span[0] * height), top + max(int(span[1] * height), int(span[0] * height) + 1))

    trunk = inside[band((0.3, 0.7))]
    detail = _detail(canvas)
    head = inside[band(HEAD)]
    columns = np.arange(canvas.shape[1])
    shown = detail[band(HEAD)] * ndimage.binary_erosion(head, iterations=2)
    within = ndimage.binary_erosion(inside, iterations=2)
    feet, shins = inside[band(FEET)], inside[band(SHINS)]
    ahead = _middle(feet, columns) - _middle(shins, columns)
    gaze = (shown * columns).sum() / max(shown.sum(), 1e-6) - _middle(head, columns)
    return _Looks(
        symmetry=iou(alpha, alpha[:, ::-1]),
        width=float(trunk.sum(axis=1).mean() / height),
        face=float(shown.sum() / max(ndimage.binary_erosion(head, iterations=2).sum(), 1)),
        detail=float((detail * within).sum() / max(within.sum(), 1)),
        direction=float(np.clip((2.0 * ahead + gaze) / (TURNED * height), -1.0, 1.0)),
    )


def _halves(front: np.ndarray, back: np.ndarray, side: np.ndarray) -> float:
    """How much better a front fits the left half of a profile, and a back the right one, than swapped; within (-2, 2)."""
    lab, inside = rgb2lab(side[..., :3]), side[..., 3] > 0.5
    middle = np.array([_middle(row, np.arange(len(row))) for row in inside])
    ahead = inside & (np.arange(side.shape[1]) < middle[:, None] - 0.5)
    behind = inside & (np.arange(side.shape[1]) > middle[:, None] + 0.5)
    rows = {name: _row_colors(lab, mask) for name, mask in (("ahead", ahead), ("behind", behind))}
    faces = {}
    for name, canvas in (("front", front), ("back", back)):
        faces[name] = _row_colors(rgb2lab(canvas[..., :3]), canvas[..., 3] > 0.5)
    there = inside.any(axis=1) & (front[..., 3] > 0.5).any(axis=1) & (back[..., 3] > 0.5).any(axis=1)

    def apart(view: str, half: str) -> np.ndarray:
        return np.minimum(np.linalg.norm(faces[view] - rows[half], axis=-1)[there], 30.0)

    gain = (
        apart("front", "behind") + apart("back", "ahead") - apart("front", "ahead") - apart("back", "behind")
    )
    if not there.any():
        return 0.0
    weights = np.where(np.arange(len(gain)) < HEAD[1] * len(gain), HEAD_WEIGHT, 1.0)
    return float(np.average(gain, weights=weights) / 30.0)


def _row_colors(lab: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Mean colour of each row's pixels of a mask, (S, 3)."""
    return (lab * mask[..., None]).sum(axis=1) / np.maximum(mask.sum(axis=1), 1)[:, None]


def _detail(canvas: np.ndarray) -> np.ndarray:
    """How much colours change from pixel to pixel, (S, S)."""
    lab = rgb2lab(canvas[..., :3])
    return np.sqrt(sum(ndimage.gaussian_gradient_magnitude(lab[..., c], 1.0) ** 2 for c in range(3)))


def _spans(figure: np.ndarray) -> np.ndarray:
    """Columns from the first to the last pixel of each row of a figure (S, S) bool, (S,); 0 where there is none."""
    side = figure.shape[1]
    return np.where(figure.any(axis=1), side - figure.argmax(axis=1) - figure[:, ::-1].argmax(axis=1), 0)


def _middle(mask: np.ndarray, columns: np.ndarray) -> float:
    """Mean column of a mask's pixels."""
    return float((mask * columns).sum() / max(mask.sum(), 1))
