"""What the laboratory writes: targets, tables of every part, parts measured one by one; and the losses of both ways to train."""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest
import torch

from benchmarks import __main__ as command
from benchmarks import processes, repeats, threads
from benchmarks.losses import compared_curves, loss_curves
from benchmarks.parts import PARTS
from benchmarks.plots import plot_kinds, plot_losses
from benchmarks.setting import Setting
from benchmarks.tables import DRAWN, SECTIONS, page, tables
from benchmarks.targets import target_rows
from charnerf.bench.subjects import subject
from charnerf.bench.sweep import Row
from charnerf.bench.workbench import BASELINE
from charnerf.volume.quadrature import PiecewiseConstant
from charnerf.volume.renderers.culled import CulledRenderer
from support import tiny_models
from support.subjects import pictured_person

KEPT = Path(__file__).resolve().parents[2] / "docs" / "speed" / "bench.json"
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
    where = {"device": "cpu", "machine": "a machine", "threads": 2, "torch": "2"}
    return {
        "part": name,
        "characters": characters,
        "weights": "w",
        "note": note,
        "seconds": 1.0,
        "environment": where,
        "result": result,
    }


def comparison(true: float = 0.02) -> dict[str, object]:
    """A comparison whose adaptive renderer erred by so much."""
    adaptive = {
        "rays_per_second": 1.0,
        "psnr": 30.0,
        "rms_error": 0.001,
        "max_error": true,
        "tolerance": {"asked": 0.05, "true": true, "estimated": 0.04},
    }
    return {"name": "one", "speedup": {"adaptive": 60.0}, "methods": {"adaptive": adaptive}}


def headline(true: float = 0.02, **changed: float) -> dict[str, object]:
    """A headline that meets all targets, but for what is changed."""
    head = {
        "render_speedup_culled": 70.0,
        "render_speedup_adaptive": 60.0,
        "render_psnr_loss_db": -0.05,
        "render_max_error": 0.02,
        "train_speedup": 7.0,
        "how": {"render_speedup_culled": "so"},
    }
    return {"headline": {**head, **changed}, "characters": [comparison(true)]}


def arithmetic(share: float) -> list[dict[str, object]]:
    """Arithmetic that reaches a share of the peak."""
    return [{"network": "width 512", "renderer": "culled", "share": share}]


def test_targets_are_judged_by_what_was_measured():
    met = {row[0]: row[2] for row in target_rows({"headline": headline(), "steps": STEPS})}
    assert sum(not one for one in met.values()) == 1
    assert not met["training step at scale=base 8 times the baseline's"]
    missed = headline(render_speedup_adaptive=49.9, render_psnr_loss_db=0.06)
    assert sum(not row[2] for row in target_rows({"headline": missed, "arithmetic": arithmetic(0.5)})) == 3
    assert all(row[2] for row in target_rows({"arithmetic": arithmetic(0.61)}))
    assert not all(row[2] for row in target_rows({"headline": headline(true=0.06)}))
    assert not all(row[2] for row in target_rows({"kinds": [comparison(0.06)]}))
    assert target_rows({}) == []
    assert not target_rows({"exactness": [{"culled - dense": 1e-3}]})[0][2]


def test_every_part_has_a_section(capsys):
    assert SECTIONS.keys() == PARTS.keys()
    with pytest.raises(SystemExit):
        command.main(["--part", "turntabel"])
    assert "turntable" in capsys.readouterr().err


def test_kept_figures_fill_their_tables():
    bench = json.loads(KEPT.read_text(encoding="utf-8"))
    found = tables(bench)
    assert {"targets", "machine", "headline", "headline real test"} <= found.keys()
    assert len(found) == 2 + len(bench["parts"])
    text = page(bench)
    assert all(one in text for one in found.values())


def test_diagrams_and_tables_of_a_data_set_bear_its_name():
    rows = [{"curve": "culled", "rms_error": 0.1}]
    parts = [
        part("headline", headline()),
        part("samples", rows, characters="real, split test", note="busy"),
    ]
    text = page({"parts": parts})
    assert "busy" in text and "![samples](samples_real_test.png)" in text
    assert "adaptive 50 times" in text
    assert tables({"parts": parts})["samples real test"] in text


def test_parts_join_those_measured_before(tmp_path, monkeypatch):
    model = SimpleNamespace(device=torch.device("cpu"), source=Path("some/w.safetensors"))
    model.to = lambda device: model
    monkeypatch.setattr(command.weights, "load", lambda path: model)
    for name, result in (("steps", STEPS), ("headline", headline())):
        monkeypatch.setitem(PARTS, name, lambda setting, result=result: result)
    command.main(["--part", "steps", "-o", str(tmp_path)])
    command.main(["--part", "headline", "--part", "steps", "-o", str(tmp_path), "--note", "again"])
    kept = json.loads((tmp_path / "bench.json").read_text(encoding="utf-8"))["parts"]
    assert [(one["part"], one["note"]) for one in kept] == [("headline", "again"), ("steps", "again")]
    assert kept[1]["result"] == STEPS
    assert "## Training steps" in (tmp_path / "bench.md").read_text(encoding="utf-8")


def test_diagrams_of_a_data_set_bear_its_name(tmp_path):
    ours = Setting(None, None, "test", tmp_path, print)
    theirs = Setting(None, Path("some/real"), "val", tmp_path, print)
    assert ours.picture("samples") == tmp_path / "samples.png" and ours.label == "embedded"
    assert theirs.picture("samples") == tmp_path / "samples_real_val.png"
    assert theirs.label == "real, split val"


def test_both_ways_to_train_have_one_loss_curve(tmp_path):
    torch.manual_seed(1)
    network = tiny_models.shake(tiny_models.tiny_model(features="image_hull"), scale=0.15)
    one = subject(pictured_person(16), network.requires_grad_(False).eval(), num_pixels=256)
    culled = CulledRenderer(
        quadrature=PiecewiseConstant(), num_coarse=16, num_fine=0, hull_steps=64, memory_mib=64
    )
    curves = loss_curves(one, {"culled": culled}, num_rays=48, steps=6, seeds=2, rate=1e-3)
    assert {len(losses) for of_seeds in curves.values() for losses in of_seeds} == {6}
    for ours, theirs in zip(curves["culled"], curves[BASELINE], strict=True):
        assert ours == pytest.approx(theirs, rel=0.15)
    (row, base) = compared_curves(curves)
    assert base["off the baseline"] == 0.0 and base["within it"]
    assert abs(row["off the baseline"]) < 0.15 * base["last third"]
    assert plot_losses(curves, tmp_path / "losses.png").stat().st_size > 1000


def test_kinds_get_a_panel_each(tmp_path):
    rows = [Row("culled", str(n), 0.1 * n, 1.0, 0.1 / n, 0.1, 20.0) for n in (1, 2, 4)]
    empty = [Row("culled", "1", 0.1, 1.0, 0.0, 0.0, 100.0)]
    path = plot_kinds({"a": rows, "b": rows, "c": rows, "empty": empty}, tmp_path / "kinds.png")
    assert path.stat().st_size > 1000


def test_sections_show_their_numbers():
    settings = ((BASELINE, "64 + 32", 2.0, 0.02), ("culled", "8", 0.25, 0.01), ("culled", "4", 0.1, 0.03))
    names = ("curve", "setting", "seconds", "rms_error")
    rows = [{**dict(zip(names, values, strict=True)), "max_error": 0.1} for values in settings]
    parts = [
        part("kind_samples", {"fog": rows, "empty picture": rows[:1]}),
        part("size", {"parameters": 15_000_000, "encoder": "ResNet-34", "rays": 64,
                      "methods": {BASELINE: {"seconds": 2.0, "speed-up": 1.0}}}),
        part("steps", STEPS),
        part("scaling", [{"over": "views", "sizes": [1, 2], "seconds": [0.125, 0.25], "seconds_exponent": 1.0}]),
        part("hull", []),
    ]  # fmt: skip
    text = page({"parts": parts})
    assert "15,000,000 parameters" in text and "0.125, 0.25" in text and "has no hull" in text
    assert "![kind_samples](kind_samples.png)" in text
    assert [line.split()[5:10:2] for line in text.splitlines() if line.startswith("| fog ")] == [
        ["8", "0.25", "8"]
    ]
    assert text.count("| base ") == 1 and "over pixelNeRF-like" in text


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name == "hull" else pytest.mark.slow) for name in PARTS]
)
def test_parts_run_on_the_released_weights(name, tmp_path, monkeypatch):
    monkeypatch.setattr(threads, "SECONDS", 3)
    monkeypatch.setattr(threads, "ROUNDS", 1)
    monkeypatch.setattr(processes, "STEPS", 4)
    monkeypatch.setattr(processes, "MARKS", 2)
    monkeypatch.setattr(repeats, "ROUNDS", 40)
    command.main(["--part", name, "-o", str(tmp_path), "--device", "cpu"])
    (part,) = json.loads((tmp_path / "bench.json").read_text(encoding="utf-8"))["parts"]
    assert part["part"] == name and part["result"]
    assert (tmp_path / f"{name}.png").is_file() == (name in DRAWN)
    assert SECTIONS[name][0] in (tmp_path / "bench.md").read_text(encoding="utf-8")


def test_growth_reads_the_same_as_measured_and_as_kept() -> None:
    """What was measured holds tuples, what was kept in JSON lists."""
    rows = [
        {
            "over": "image side, pixels",
            "sizes": (64, 128),
            "seconds": (0.0512345, 0.2),
            "seconds_exponent": 2.0,
        }
    ]
    _, show = SECTIONS["scaling"]
    assert show(rows) == show(json.loads(json.dumps(rows)))
    assert "0.0512, 0.2" in show(rows)[0]
