"""bench.md: what was measured, as tables, with the machine and the command that makes it again."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from charnerf.bench.tables import comparison_table, headline_table, markdown


def report(result: dict[str, Any]) -> str:
    """Markdown of a full run."""
    machine = result["environment"]
    parts = [
        "# Error against run time",
        f"`charnerf bench` on {machine['machine']}, {machine['threads']} threads, torch {machine['torch']}, "
        f"{machine['device']}, {result['seconds'] / 60:.0f} minutes; weights {result['weights']}, characters: {result['data']}.",
        "## Headline",
        headline_table(result["headline"]),
        "\n".join(f"- `{name}`: {text}" for name, text in result["headline"]["how"].items()),
        "## Characters",
        comparison_table(result["characters"]),
        "## Kinds of scene",
        comparison_table([{**one, "name": one["kind"]} for one in result["kinds"]]),
    ]
    for name, title in (
        ("samples", "Samples a ray and tolerances"),
        ("tricks", "One trick off at a time"),
        ("precision", "Precision"),
        ("compile", "Compiled"),
    ):
        parts += [f"## {title}", f"![{title}]({name}.png)", _rows(result[f"sweep_{name}"])]
    for kind, rows in result["sweep_kinds"].items():
        parts += [f"### {kind}", f"![{kind}](kind_{kind.replace(' ', '_')}.png)", _rows(rows)]
    steps = [
        {
            "scale": one["scale"],
            "rays": one["rays"],
            **{f"{name} s": value for name, value in one["seconds"].items()},
            **{f"over {name}": value for name, value in one["speedup_of_culled"].items()},
        }
        for one in result["training_steps"]
    ]
    large = result["large_network"]
    parts += [
        "## Drawings' resolution",
        _rows(result["source_resolution"]),
        "## Builds",
        _rows(result["builds"]),
        f"`experiment=pixelnerf scale=paper`: {large['parameters']:,} parameters with its encoder ({large['encoder']}; "
        f"pixelNeRF counts 13 million more that its ResNet never uses), seeded weights, {large['rays']} rays:",
        _rows(
            [
                {"method": name, "seconds": s, "speed-up": large["speedup"][name]}
                for name, s in large["seconds"].items()
            ]
        ),
        "## Training steps",
        _rows(steps),
        "## Meshes",
        _rows(result["meshes"]),
        "## Turntable",
        _rows([result["turntable"]]),
        "## Growth",
        "![growth](scaling.png)",
        _rows(
            [
                {k: str(v) if isinstance(v, tuple | list) else v for k, v in one.items()}
                for one in result["scaling"]
            ]
        ),
        "Peak memory over the loaded model, a fresh process each:",
        _rows(result["memory_growth"]),
        "## What the hull cuts away",
        "Pixels of one whole target picture that show the character, and those of them whose rays meet no cell of its hull.",
        _rows(result["cut_by_hull"]) if result["cut_by_hull"] else "The model has no hull.",
    ]
    return "\n\n".join(parts) + "\n"


def _rows(rows: Sequence[dict[str, Any]]) -> str:
    """A table of dicts with the same keys."""
    return markdown(tuple(rows[0]), [tuple(row.values()) for row in rows])
