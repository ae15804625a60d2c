"""What the benchmark is asked for, beside what was measured."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

Row = tuple[str, str, bool]


def target_rows(results: Mapping[str, Any]) -> list[Row]:
    """Asked, read and whether it is met, of the parts that were measured.

    Args:
        results: By part, on the embedded characters.
    """
    rows: list[Row] = []
    if "headline" in results:
        rows += _of_headline(results["headline"])
    rows += [_of_step(one) for one in results.get("steps", ()) if one["scale"] in LEAST_STEP]
    if "losses" in results:
        ours = next(row for row in results["losses"] if row["method"] == "culled")
        last, off, spread = ours["last third"], ours["off the baseline"], ours["spread of seeds"]
        text = f"{last:.3g}, {off:+.2g} off the baseline, spread {spread:.2g}"
        rows.append(
            (
                "losses of packed training steps as the baseline's, within the spread of seeds",
                text,
                ours["within it"],
            )
        )
    if "exactness" in results:
        worst = max(row["culled - dense"] for row in results["exactness"])
        rows.append(("culled is dense to rounding", f"colours differ by {worst:.1g} at most", worst < 1e-5))
    return rows


LEAST_STEP = {"small": 5.0, "base": 8.0}


def _of_step(step: Mapping[str, Any]) -> Row:
    least, ratio = LEAST_STEP[step["scale"]], step["speedup_of_culled"]["pixelNeRF-like"]
    return (
        f"training step at scale={step['scale']} {least:g} times the baseline's",
        f"{ratio:.3g}",
        ratio >= least,
    )


def _of_headline(found: Mapping[str, Any]) -> list[Row]:
    head = found["headline"]
    asked = [one["methods"]["adaptive"]["tolerance"] for one in (*found["characters"], *found["kinds"])]
    within = sum(one["true"] <= one["asked"] for one in asked)
    budget = head["memory_budget_mib"]
    memory = {name: head[f"peak_memory_{name}_512_mib"] for name in ("render", "mesh")}
    share, products = 100 * head["grid_share_256"], 100 * head["matmul_peak_share"]
    culled, adaptive = head["render_speedup_culled"], head["render_speedup_adaptive"]
    loss, worst = head["render_psnr_loss_db"], head["render_max_error"]
    return [
        ("culled 20 times the baseline's rays a second", f"{culled:.3g}", culled >= 20),
        ("adaptive 50 times", f"{adaptive:.3g}", adaptive >= 50),
        ("adaptive at most 0.05 dB below the baseline", f"{loss:+.3f} dB", loss <= 0.05),
        (
            "its true error within the tolerance on every character and kind of scene",
            f"{within} of {len(asked)}, largest {worst:.3g}",
            within == len(asked),
        ),
        ("grid of 256^3, 8 cameras: at most 3 % of the points", f"{share:.3g} %", share <= 3),
        (
            "the same mesh as the full grid's",
            "yes" if head["grid_same_mesh"] else "no",
            head["grid_same_mesh"],
        ),
        ("60 % of the peak of matrix products at width 512", f"{products:.3g} %", products >= 60),
        *(
            (f"memory of a {name} at 512 within {budget:,.0f} MiB", f"{rise:,.0f} MiB", rise <= budget)
            for name, rise in memory.items()
        ),
    ]
