"""What evaluations and trainings left: scores by method and by azimuth, seconds, and the course of a training."""

from charnerf.reporting.families import TABLE_TWO
from charnerf.reporting.formats import BASELINE_NAMES, COLUMNS, cell, seconds_text
from charnerf.reporting.run_files import read_curve
from docs.figures.sources import ROOT, markdown, read


def scores(file: str) -> str:
    """The model's metrics and those of the baselines that were measured, of a metrics.json."""
    metrics = read(file)
    columns = [key for key in COLUMNS if metrics.get(key) is not None]
    methods = {"charnerf": metrics} | {
        title: metrics["baselines"][name] for name, title in BASELINE_NAMES.items()
    }
    rows = [
        [title, *(cell(found[key], COLUMNS[key][1]) for key in columns)]
        for title, found in methods.items()
        if found["psnr"] is not None
    ]
    return markdown(["", *(COLUMNS[key][0] for key in columns)], rows)


def measured(file: str) -> str:
    """On what it was measured."""
    metrics = read(file)
    views = metrics["num_views"] // metrics["num_characters"]
    return f"{metrics['num_characters']} characters of the {metrics['split']} split, {views} views each"


def seconds(file: str) -> str:
    """How long an evaluation's stages take, and where."""
    metrics = read(file)
    took, machine = metrics["seconds"], metrics["environment"]
    return (
        f"{seconds_text(took['encode'])} to encode a character, {seconds_text(took['render_per_frame'])} a frame, "
        f"{seconds_text(took['mesh'])} a mesh ({machine['machine']}, threads: {machine['threads']})"
    )


def azimuths(file: str) -> str:
    """PSNR and foreground PSNR by azimuth, the model's and the visual hull's."""
    metrics = read(file)
    hull = metrics["baselines"]["visual_hull"]
    shown = [k for k, row in enumerate(metrics["by_azimuth"]) if row["psnr"] is not None]
    rows = [
        [f"{who}, {what}", *(cell(found["by_azimuth"][k][key], "{:.1f}") for k in shown)]
        for who, found in (("charnerf", metrics), ("visual hull", hull))
        for key, what in (("psnr", "PSNR"), ("psnr_foreground", "foreground"))
    ]
    return markdown(["dB by azimuth", *(f"{metrics['by_azimuth'][k]['azimuth_deg']}°" for k in shown)], rows)


def course(file: str) -> str:
    """A training in one sentence, of its curve.csv."""
    curve = read_curve(ROOT / file)
    last, best = curve[-1], max(curve, key=lambda row: row["val_psnr"])
    return (
        f"{seconds_text(last['seconds'])} of training, {last['step']:.0f} steps; best validation: "
        f"{best['val_psnr']:.2f} dB, {best['val_psnr_foreground']:.2f} dB on the foreground, "
        f"after {seconds_text(best['seconds'])}"
    )


GRIDS = {
    "embedded": ("embedded", "charnerf"),
    "real": ("real", "charnerf"),
    "real, opacity": ("real", "opacity"),
}
SHOWN = {"PSNR ↑ dB": "PSNR", "foreground ↑ dB": "foreground", "Chamfer ↓ mm": "Chamfer"}


def table2(file: str) -> str:
    """The rows of Table II on every grid, beside the paper's; the best of the models is bold, the baselines below."""
    header, *lines = read(file)
    every = [dict(zip(header, line, strict=True)) for line in lines]
    names = list(dict.fromkeys(one["row"] for one in every))
    rows = [[name, f"{TABLE_TWO[name]['psnr']:.1f}" if name in TABLE_TWO else ""] for name in names]
    for data, loss in GRIDS.values():
        for column in SHOWN:
            found = {
                one["row"]: one[column] for one in every if one["data"] == data and one["loss"] in (loss, "")
            }
            better = min if "↓" in column else max
            best = better((found[name] for name in TABLE_TWO), key=float)
            for row, name in zip(rows, names, strict=True):
                row.append(f"**{best}**" if name in TABLE_TWO and found[name] == best else found[name])
    heads = [f"{grid}: {short}" for grid in GRIDS for short in SHOWN.values()]
    return markdown(["row", "paper: PSNR", *heads], rows)
