"""The page of a benchmark: its targets, its marks, parts measured one by one; and the losses of both ways to train."""

import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest
import torch

from charnerf.bench import run as benchmark
from charnerf.bench.everything import PARTS
from charnerf.bench.page import BEGIN, END, SECTIONS, write_page
from charnerf.bench.plots import plot_kinds, plot_losses
from charnerf.bench.rendering import BASELINE
from charnerf.bench.run import Request, chosen_parts
from charnerf.bench.setting import Setting
from charnerf.bench.subjects import Pictured, subject
from charnerf.bench.sweeps import Row
from charnerf.bench.targets import target_rows
from charnerf.bench.training_step import compared_curves, loss_curves
from charnerf.errors import ConfigError, DataError
from charnerf.volume.quadrature import PiecewiseConstant
from charnerf.volume.renderers.culled import CulledRenderer
from support import helpers, tiny_models

STEPS = [
    {
        "scale": "small",
        "rays": 512,
        "seconds": {"culled": 0.1, "dense": 0.2, BASELINE: 0.7},
        "speedup_of_culled": {"culled": 1.0, "dense": 2.0, BASELINE: 7.0},
    },
    {
        "scale": "base",
        "rays": 1000,
        "seconds": {"culled": 1.0, "dense": 4.0, BASELINE: 7.5},
        "speedup_of_culled": {"culled": 1.0, "dense": 4.0, BASELINE: 7.5},
    },
]


def part(name: str, result: object, *, characters: str = "embedded", note: str = "") -> dict[str, object]:
    """A part as bench.json holds it."""
    known = {"device": "cpu", "machine": "a machine", "threads": 2, "torch": "2"}
    return {
        "part": name,
        "characters": characters,
        "weights": "w",
        "note": note,
        "seconds": 1.0,
        "environment": known,
        "result": result,
    }


def headline(**changed: object) -> dict[str, object]:
    """A headline that meets all targets, but for what is changed."""
    head = {
        "render_speedup_culled": 70.0,
        "render_speedup_adaptive": 60.0,
        "render_psnr_loss_db": -0.05,
        "render_max_error": 0.02,
        "train_speedup_over_dense": 7.0,
        "grid_share_256": 0.019,
        "grid_same_mesh": True,
        "matmul_peak_share": 0.61,
        "peak_memory_render_512_mib": 450.0,
        "peak_memory_mesh_512_mib": 700.0,
        "memory_budget_mib": 2048.0,
        "how": {"render_speedup_culled": "so"},
    }
    one = {
        "name": "one",
        "kind": "fog",
        "speedup": {"adaptive": 60.0},
        "methods": {
            "adaptive": {
                "rays_per_second": 1.0,
                "psnr": 30.0,
                "rms_error": 0.001,
                "max_error": 0.02,
                "tolerance": {"asked": 0.05, "true": 0.02, "estimated": 0.04},
            }
        },
    }
    return {"headline": {**head, **changed}, "characters": [one], "kinds": [one]}


def test_targets_are_judged_by_what_was_measured():
    met = {row[0]: row[2] for row in target_rows({"headline": headline(), "steps": STEPS})}
    assert sum(not one for one in met.values()) == 1
    assert not met["training step at scale=base 8 times the baseline's"]
    missed = headline(render_speedup_adaptive=49.9, render_psnr_loss_db=0.06, matmul_peak_share=0.5)
    assert sum(not row[2] for row in target_rows({"headline": missed})) == 3
    wrong = headline()
    wrong["kinds"][0]["methods"]["adaptive"]["tolerance"]["true"] = 0.06
    assert not all(row[2] for row in target_rows({"headline": wrong}))
    assert target_rows({}) == []
    assert not target_rows({"exactness": [{"culled - dense": 1e-3}]})[0][2]


def test_every_part_has_a_section():
    assert SECTIONS.keys() == PARTS.keys()
    assert chosen_parts([]) == tuple(PARTS)
    assert chosen_parts(["steps", "headline"]) == ("headline", "steps")
    with pytest.raises(ConfigError, match="turntable"):
        chosen_parts(["turntabel"])


def test_only_what_stands_between_the_marks_is_written(tmp_path):
    page = tmp_path / "docs" / "page.md"
    page.parent.mkdir()
    page.write_text(f"# Mine\n\nMy words.\n\n{BEGIN}\nold\n{END}\n\nMore words.\n", encoding="utf-8")
    parts = [
        part("headline", headline()),
        part("samples", [{"curve": "culled", "rms_error": 0.1}], characters="real, split test", note="busy"),
    ]
    write_page(page, parts, pictures=tmp_path / "docs" / "benchmarks")
    text = page.read_text(encoding="utf-8")
    assert text.startswith("# Mine\n\nMy words.") and text.endswith("More words.\n")
    assert "old" not in text and "busy" in text
    assert "![samples](benchmarks/samples_real_test.png)" in text
    assert "| adaptive 50 times" in text
    write_page(page, parts, pictures=tmp_path / "docs" / "benchmarks")
    assert page.read_text(encoding="utf-8") == text
    page.write_text("no marks", encoding="utf-8")
    with pytest.raises(DataError, match="end of figures"):
        write_page(page, parts, pictures=tmp_path)


def test_parts_join_those_measured_before(tmp_path, monkeypatch):
    model = SimpleNamespace(device=torch.device("cpu"), source=Path("some/weights.safetensors"))
    monkeypatch.setattr(benchmark, "workbench", lambda model, memory_mib: None)
    for name, found in (("steps", STEPS), ("headline", headline())):
        monkeypatch.setitem(PARTS, name, lambda setting, found=found: found)
    request = Request(parts=("steps",), output=tmp_path)
    assert benchmark.run(model, request, lambda _: None)["parts"] == {"steps": STEPS}
    again = Request(parts=("headline", "steps"), output=tmp_path, note="again")
    result = benchmark.run(model, again, lambda _: None)
    assert result["headline"]["render_speedup_culled"] == 70.0
    assert "headline" in benchmark.summary(result)
    kept = json.loads((tmp_path / "bench.json").read_text(encoding="utf-8"))["parts"]
    assert [(one["part"], one["note"]) for one in kept] == [("headline", "again"), ("steps", "again")]
    assert "## Training steps" in (tmp_path / "bench.md").read_text(encoding="utf-8")


def test_diagrams_of_a_data_set_bear_its_name(tmp_path):
    quiet: Callable[[str], None] = lambda _: None  # noqa: E731
    ours = Setting(None, None, "test", tmp_path, quiet)
    theirs = Setting(None, Path("some/real"), "val", tmp_path, quiet)
    assert ours.picture("samples") == tmp_path / "samples.png" and ours.label == "embedded"
    assert theirs.picture("samples") == tmp_path / "samples_real_val.png"
    assert theirs.label == "real, split val"


def test_both_ways_to_train_have_one_loss_curve(person_views, tmp_path):
    torch.manual_seed(1)
    network = tiny_models.shake(tiny_models.tiny_model(features="image_hull"), scale=0.15)
    camera = helpers.target_cameras(4, size=16)[1]
    picture = helpers.photograph(helpers.person(symmetric=False), helpers.target_cameras(4, size=16)[1:2])
    pictured = Pictured("person", person_views, camera, picture[0])
    one = subject(pictured, network.requires_grad_(False).eval(), kind="test", num_pixels=256)
    culled = CulledRenderer(
        quadrature=PiecewiseConstant(), num_coarse=16, num_fine=0, hull_steps=64, memory_mib=64
    )
    curves = loss_curves(one, {"culled": culled}, num_rays=48, steps=6, seeds=2, rate=1e-3, baseline=BASELINE)
    assert {len(losses) for of_seeds in curves.values() for losses in of_seeds} == {6}
    for ours, theirs in zip(curves["culled"], curves[BASELINE], strict=True):
        assert ours == pytest.approx(theirs, rel=0.15)
    (row, base) = compared_curves(curves, baseline=BASELINE)
    assert base["off the baseline"] == 0.0 and base["within it"]
    assert abs(row["off the baseline"]) < 0.15 * base["last third"]
    assert plot_losses(curves, tmp_path / "losses.png").stat().st_size > 1000


def test_kinds_get_a_panel_each(tmp_path):
    rows = [Row("culled", str(n), 0.1 * n, 1.0, 0.1 / n, 0.1, 20.0) for n in (1, 2, 4)]
    empty = [Row("culled", "1", 0.1, 1.0, 0.0, 0.0, 100.0)]
    path = plot_kinds({"a": rows, "b": rows, "c": rows, "empty": empty}, tmp_path / "kinds.png")
    assert path.stat().st_size > 1000


def test_sections_show_their_numbers(tmp_path):
    settings = ((BASELINE, "64 + 32", 2.0, 0.02), ("culled", "8", 0.25, 0.01), ("culled", "4", 0.1, 0.03))
    names = ("curve", "setting", "seconds", "rms_error")
    rows = [{**dict(zip(names, values, strict=True)), "max_error": 0.1} for values in settings]
    parts = [
        part("kinds", {"fog": rows, "empty picture": rows[:1]}),
        part("size", {"parameters": 15_000_000, "encoder": "ResNet-34", "rays": 64,
                      "methods": {BASELINE: {"seconds": 2.0, "speed-up": 1.0}}}),
        part("steps", STEPS),
        part("scaling", [{"over": "views", "sizes": [1, 2], "seconds": [0.125, 0.25], "seconds_exponent": 1.0}]),
        part("hull", []),
    ]  # fmt: skip
    write_page(tmp_path / "page.md", parts, pictures=tmp_path)
    text = (tmp_path / "page.md").read_text(encoding="utf-8")
    assert "15,000,000 parameters" in text and "0.125, 0.25" in text and "has no hull" in text
    assert "![kinds](kinds.png)" in text
    assert [line.split()[5:10:2] for line in text.splitlines() if line.startswith("| fog ")] == [
        ["8", "0.25", "8"]
    ]
    assert text.count("| base ") == 1 and "over pixelNeRF-like" in text
