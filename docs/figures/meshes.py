"""What `charnerf mesh` measured: meshes of a split, levels of detail."""

from charnerf.evaluation.angles import mean_of
from charnerf.evaluation.mesh_scores import KINDS
from docs.figures.sources import markdown, read

SCORES = {
    **{f"{kind}_source_texture_psnr": (f"source views: {kind}", "{:.2f}") for kind in KINDS},
    **{f"{kind}_novel_texture_psnr": (f"novel views: {kind}", "{:.2f}") for kind in KINDS},
    "iou": ("IoU", "{:.3f}"),
    "chamfer_mm": ("Chamfer, mm", "{:.1f}"),
    "f_score": ("F", "{:.3f}"),
    "hull_iou": ("hull: IoU", "{:.3f}"),
    "hull_chamfer_mm": ("Chamfer, mm", "{:.1f}"),
    "hull_f_score": ("F", "{:.3f}"),
    "texels_from_field": ("from field", "{:.2f}"),
}


def meshes(file: str) -> str:
    """Texture PSNR by kind of colours and view, dB, outlines and surface, by character and on average."""
    by_name = read(file)["characters"]
    means = mean_of(list(by_name.values()), list(SCORES))
    rows = [
        [name, *(form.format(found[key]) for key, (_, form) in SCORES.items())]
        for name, found in {**by_name, "**mean**": means}.items()
    ]
    return markdown(["", *(title for title, _ in SCORES.values())], rows)


def lods(file: str) -> str:
    """The levels of detail of one character."""
    rows = [
        [
            one["file"].rpartition("_")[2],
            one["grid"],
            one["vertices"],
            one["faces"],
            one["parts"],
            "yes" if one["watertight"] else "no",
            one["euler_number"],
            f"{one['chamfer_mm']:.2f}",
            "" if one["evaluated"] is None else f"{one['evaluated']:.1%}".replace("%", " %"),
        ]
        for one in read(file)
    ]
    heads = [
        "level",
        "grid",
        "vertices",
        "faces",
        "parts",
        "watertight",
        "Euler number",
        "Chamfer, mm",
        "evaluated",
    ]
    return markdown(heads, rows)
