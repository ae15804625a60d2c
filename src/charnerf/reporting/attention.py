"""The attention figure of runs with `view_mha`: made from their weights, kept beside them, drawn in reports."""

from collections.abc import Sequence
from pathlib import Path
from statistics import fmean

from charnerf.data.characters import Character
from charnerf.errors import CharNeRFError
from charnerf.evaluation.attention import ATTENTION_FILE, AttentionProfile, attention_profile
from charnerf.inference.model import Model
from charnerf.reporting.blocks import Block, Heading, Picture, Text
from charnerf.reporting.plots import Line, plot_lines
from charnerf.reporting.rows import Row
from charnerf.reporting.runs import Run, measured

CHARACTERS = 2
_TARGET = "view_attention.ViewAttention"
_X = "azimuth of the query, degrees"
_THEORY = "cos x + cos(x - 90) + cos(x - 180), scaled"


def has_view_attention(run: Run) -> bool:
    """Whether a run's config names the paper's combinator."""
    combinator = run.config.get("combinator")
    return isinstance(combinator, dict) and str(combinator.get("_target_", "")).endswith(_TARGET)


def with_view_attention(rows: Sequence[Row]) -> list[Row]:
    """Rows whose first run has it."""
    return [row for row in rows if has_view_attention(row.runs[0])]


def attention_of(run: Run, *, trusted: Sequence[str] = ()) -> AttentionProfile:
    """The profile of a run over its first test characters that are drawn from the same views.

    Raises:
        CharNeRFError: If weights or data are gone, or the model shows nothing.
    """

    def measure(model: Model, characters: Sequence[Character]) -> AttentionProfile:
        alike = [one for one in characters if one.source_names == characters[0].source_names]
        return attention_profile(model.network, model.renderer, alike)

    return measured(
        run,
        ATTENTION_FILE,
        AttentionProfile,
        measure,
        what="an attention profile",
        num_characters=CHARACTERS,
        trusted=trusted,
    )


def attention(rows: Sequence[Row], folder: Path, *, trusted: Sequence[str] = ()) -> list[Block]:
    """The figure of the first run of every row that has view attention."""
    blocks: list[Block] = []
    for number, row in enumerate(with_view_attention(rows)):
        blocks.append(Heading(f"What view attention looks at: {row.label}"))
        try:
            profile = attention_of(row.runs[0], trusted=trusted)
        except CharNeRFError as error:
            blocks.append(Text(f"It can not be drawn: {error}"))
            continue
        blocks += figure(profile, folder / f"report_attention_{number}.png")
    return blocks


def figure(profile: AttentionProfile, path: Path) -> list[Block]:
    """Both parts beside the paper's curve, every head's feature part, and the weights of the source views."""
    heads = range(len(profile.features[0]))
    feature = [fmean(values) for values in profile.features]
    view = [fmean(values) for values in profile.view]

    def line(values: Sequence[float]) -> list[Line]:
        return [(profile.azimuth_deg, values)]

    parts = {"feature part": line(feature), "view part": line(view), _THEORY: line(profile.curve)}
    by_head = {f"head {head + 1}": line([values[head] for values in profile.features]) for head in heads}
    by_source = {f"weight of {name}": line(weights) for name, weights in _weights(profile).items()}
    panels = {
        "mean scaled dot product": parts,
        "feature part by head": by_head,
        "mean attention weight": by_source,
    }
    picture = plot_lines(panels, path, x=_X)
    caption = "Mean scaled dot product in its two parts, the feature part of every head, and the weight of every source view"
    method = (
        f"Characters: {', '.join(profile.characters)}; {profile.num_points:,} points: at each azimuth those that a level camera"
        " sees, one a pixel, at the expected depth of rays more opaque than not. Means over points, rows and keys; the two parts"
        " sum to the logit exactly, and the view part is the same in every head, since each holds the whole direction. The curve"
        f" is scaled by the model's own s² / √d_k / {len(profile.sources)} = {profile.view_factor:.3g}, not fitted."
    )
    return [Picture(picture, caption), Text(method), Text(_reading(profile, feature, view))]


def _weights(profile: AttentionProfile) -> dict[str, list[float]]:
    """Mean weight over the heads by source view, one an azimuth."""
    return {
        name: [fmean(head[place] for head in heads) for heads in profile.weights]
        for place, name in enumerate(profile.sources)
    }


def _reading(profile: AttentionProfile, feature: Sequence[float], view: Sequence[float]) -> str:
    """What the curves say, in one sentence."""
    span_feature, span_view = max(feature) - min(feature), max(view) - min(view)
    most = [
        f"{name} up to {max(weights):.2f} at {profile.azimuth_deg[weights.index(max(weights))]:.0f}°"
        for name, weights in _weights(profile).items()
    ]
    larger = "view" if span_view > span_feature else "feature"
    return (
        f"Over the azimuths the feature part varies by {span_feature:.3g}, the view part by {span_view:.3g}: the {larger} part"
        f" decides more. Weights (even would be {1.0 / len(profile.sources):.2f}): {'; '.join(most)}."
    )
