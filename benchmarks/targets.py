"""What the framework is held to, beside what was measured."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from statistics import median
from typing import Any

from benchmarks.grids import CUBE_SIDE
from charnerf.bench.workbench import ADAPTIVE, BAKED, BASELINE, CULLED

Row = tuple[str, str, bool]
LEAST_STEP = {"small": 5.0, "base": 8.0}
MEMORY_MIB = 2048.0


def target_rows(results: Mapping[str, Any]) -> list[Row]:
    """Target, measured and whether it is met, of the parts that were measured.

    Args:
        results: By part, on the embedded characters.
    """
    return [row for part, rows in TARGETS.items() if part in results for row in rows(results[part])]


def _headline(result: Mapping[str, Any]) -> list[Row]:
    head = result["headline"]
    culled, adaptive = head["render_speedup_culled"], head["render_speedup_adaptive"]
    loss = head["render_psnr_loss_db"]
    rows = [
        ("culled 20 times the baseline's rays a second", f"{culled:.3g}", culled >= 20),
        ("adaptive 50 times", f"{adaptive:.3g}", adaptive >= 50),
        ("adaptive at most 0.05 dB below the baseline", f"{loss:+.3f} dB", loss <= 0.05),
        _tolerance(ADAPTIVE, "character", result["characters"]),
    ]
    return rows + (_baked(head, result["characters"]) if "turntable_speedup" in head else [])


def _baked(head: Mapping[str, Any], comparisons: list[Mapping[str, Any]]) -> list[Row]:
    speedup, loss = head["turntable_speedup"], head["baked_psnr_loss_db"]
    rate = head["frames_per_second_256"]
    return [
        ("a baked turntable 300 times", f"{speedup:.3g}", speedup >= 300),
        ("baked at most 0.05 dB below the baseline", f"{loss:+.3f} dB", loss <= 0.05),
        ("10 baked pictures of 256 pixels a second", f"{rate:.3g}", rate >= 10),
        _tolerance(BAKED, "character", comparisons),
    ]


def _kinds(result: list[Mapping[str, Any]]) -> list[Row]:
    measured = [name for name in (ADAPTIVE, BAKED) if name in result[0]["methods"]]
    return [_tolerance(name, "kind of scene", result) for name in measured]


def _tolerance(name: str, what: str, comparisons: list[Mapping[str, Any]]) -> Row:
    tolerances = [one["methods"][name]["tolerance"] for one in comparisons]
    within = sum(one["true"] <= one["asked"] for one in tolerances)
    worst = max(one["true"] for one in tolerances)
    return (
        f"{name}'s true error within the tolerance on every {what}",
        f"{within} of {len(tolerances)}, largest {worst:.3g}",
        within == len(tolerances),
    )


def _exactness(rows: list[Mapping[str, Any]]) -> list[Row]:
    worst = max(row["culled - dense"] for row in rows)
    return [("culled is dense to rounding", f"colors differ by {worst:.1g} at most", worst < 1e-5)]


def _arithmetic(rows: list[Mapping[str, Any]]) -> list[Row]:
    wide = next(row for row in rows if (row["network"], row["renderer"]) == ("width 512", CULLED))
    share = 100 * wide["share"]
    return [("60 % of the peak of matrix products at width 512", f"{share:.3g} %", share >= 60)]


def _steps(rows: list[Mapping[str, Any]]) -> list[Row]:
    return [
        (
            f"training step at scale={row['scale']} {LEAST_STEP[row['scale']]:g} times the baseline's",
            f"{row['speedup_of_culled'][BASELINE]:.3g}",
            row["speedup_of_culled"][BASELINE] >= LEAST_STEP[row["scale"]],
        )
        for row in rows
    ]


def _losses(rows: list[Mapping[str, Any]]) -> list[Row]:
    ours = next(row for row in rows if row["method"] == CULLED)
    last, off, spread = ours["last third"], ours["off the baseline"], ours["spread of seeds"]
    text = f"{last:.3g}, {off:+.2g} off the baseline, spread {spread:.2g}"
    target = "losses of packed training steps as the baseline's, within the spread of seeds"
    return [(target, text, ours["within it"])]


def _grids(rows: list[Mapping[str, Any]]) -> list[Row]:
    share, farthest = 100 * median(row["share"] for row in rows), max(row["distance"] for row in rows)
    return [
        ("grid of 256^3, 8 cameras: at most 3 % of the points", f"{share:.3g} %", share <= 3),
        (
            "everywhere within a cell, 8.6 mm, of the full grid's mesh",
            f"{1000 * farthest:.2g} mm",
            farthest <= CUBE_SIDE / 256,
        ),
    ]


def _memory(rows: list[Mapping[str, Any]]) -> list[Row]:
    return [
        (
            f"memory of a {row['work']} at 512 within {MEMORY_MIB:,.0f} MiB",
            f"{row['rise_mib']:,.0f} MiB",
            row["rise_mib"] <= MEMORY_MIB,
        )
        for row in rows
        if row["side"] == 512
    ]


TARGETS: dict[str, Callable[[Any], list[Row]]] = {
    "headline": _headline,
    "kinds": _kinds,
    "exactness": _exactness,
    "arithmetic": _arithmetic,
    "steps": _steps,
    "losses": _losses,
    "grids": _grids,
    "memory": _memory,
}
