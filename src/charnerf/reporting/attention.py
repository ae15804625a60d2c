"""The attention figure of runs with `view_mha`: made from their weights, kept beside them, drawn in reports."""

from collections.abc import Sequence
from pathlib import Path

from charnerf.data.characters import load_character
from charnerf.data.layout import names_of, read_dataset
from charnerf.errors import CharNeRFError
from charnerf.evaluation.attention import (
    ATTENTION_FILE,
    AttentionProfile,
    attention_profile,
    read_profile,
    view_attention_of,
    write_profile,
)
from charnerf.inference.weights import load
from charnerf.reporting.blocks import Block, Heading, Picture, Plot, Text
from charnerf.reporting.interactive import Line, lines_figure
from charnerf.reporting.plots import plot_lines
from charnerf.reporting.rows import Row, Run, data_root

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


def make_profile(run: Run, *, trusted: Sequence[str] = ()) -> AttentionProfile:
    """The profile of a run over its first test characters: read where it is newer than the weights, else made and kept.

    Raises:
        CharNeRFError: If weights or data are gone, or the model shows nothing.
    """
    file, weights = run.folder / ATTENTION_FILE, run.folder / "weights.safetensors"
    if file.is_file() and (not weights.is_file() or file.stat().st_mtime >= weights.stat().st_mtime):
        return read_profile(file)
    model = load(run.folder, trusted_targets=trusted)
    view_attention_of(model.network)
    root = data_root(run)
    characters = [
        load_character(root, name) for name in names_of(read_dataset(root), run.metrics["split"])[:CHARACTERS]
    ]
    alike = [one for one in characters if one.source_names == characters[0].source_names]
    profile = attention_profile(model.network, model.renderer, alike)
    write_profile(file, profile)
    return profile


def attention(rows: Sequence[Row], folder: Path, *, trusted: Sequence[str] = ()) -> list[Block]:
    """The figure of the first run of every row that has view attention."""
    blocks: list[Block] = []
    for number, row in enumerate(with_view_attention(rows)):
        blocks.append(Heading(f"What view attention looks at: {row.label}"))
        try:
            profile = make_profile(row.runs[0], trusted=trusted)
        except CharNeRFError as error:
            blocks.append(Text(f"It can not be drawn: {error}"))
            continue
        blocks += figure(profile, folder / f"report_attention_{number}.png")
    return blocks


def figure(profile: AttentionProfile, path: Path) -> list[Block]:
    """Both parts beside the paper's curve, every head's feature part, and the weights of the source views."""
    x = profile.azimuth_deg
    heads = range(len(profile.features[0]))
    feature = [sum(values) / len(values) for values in profile.features]
    view = [sum(values) / len(values) for values in profile.view]

    def one(values: Sequence[float]) -> list[Line]:
        return [(x, list(values))]

    parts = {"feature part": one(feature), "view part": one(view), _THEORY: one(profile.curve)}
    by_head = {f"head {head + 1}": one([values[head] for values in profile.features]) for head in heads}
    by_source = {
        f"weight of {name}": one(
            [sum(each[head][place] for head in heads) / len(heads) for each in profile.weights]
        )
        for place, name in enumerate(profile.sources)
    }
    panels = {
        "mean scaled dot product": parts,
        "feature part by head": by_head,
        "mean attention weight": by_source,
    }
    picture = plot_lines(panels, path, x=_X)
    caption = "Mean scaled dot product in its two parts, the feature part of every head, and the weight of every source view"
    told = (
        f"Characters: {', '.join(profile.characters)}; {profile.num_points:,} points: at each azimuth those that a level camera"
        " sees, one a pixel, at the expected depth of rays more opaque than not. Means over points, rows and keys; the two parts"
        " sum to the logit exactly, and the view part is the same in every head, since each holds the whole direction. The curve"
        f" is scaled by the model's own s² / √d_k / {len(profile.sources)} = {profile.view_factor:.3g}, not fitted."
    )
    return [
        Plot(lines_figure(panels, x=_X), Picture(picture, caption)),
        Text(told),
        Text(_reading(profile, feature, view)),
    ]


def _reading(profile: AttentionProfile, feature: Sequence[float], view: Sequence[float]) -> str:
    """What the curves say, in one sentence."""
    span_feature, span_view = max(feature) - min(feature), max(view) - min(view)
    heads = len(profile.features[0])
    most = []
    for place, name in enumerate(profile.sources):
        line = [sum(each[head][place] for head in range(heads)) / heads for each in profile.weights]
        best = max(range(len(line)), key=lambda index: line[index])
        most.append(f"{name} up to {line[best]:.2f} at {profile.azimuth_deg[best]:.0f}°")
    larger = "view" if span_view > span_feature else "feature"
    return (
        f"Over the azimuths the feature part varies by {span_feature:.3g}, the view part by {span_view:.3g}: the {larger} part"
        f" decides more. Weights (even would be {1.0 / len(profile.sources):.2f}): {'; '.join(most)}."
    )
