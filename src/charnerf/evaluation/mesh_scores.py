"""What meshes and their colours are worth: texture, outline and surface against the captured character."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import torch
import trimesh
from torch import Tensor

from charnerf.data.characters import Character
from charnerf.evaluation.angles import Record, mean_of
from charnerf.evaluation.baselines import VisualHullBaseline
from charnerf.evaluation.metrics import psnr_foreground, silhouette_iou
from charnerf.evaluation.surface_error import surface_scores, true_points
from charnerf.markdown import table
from charnerf.meshing.build import find_surface, finish_mesh
from charnerf.meshing.options import MeshOptions, Texture
from charnerf.pictures import on_white
from charnerf.scene import Scene
from charnerf.surfaces.render import render_mesh
from charnerf.types import Cameras

KINDS: tuple[Texture, ...] = ("drawings", "field", "vertex")
COLUMNS = {
    **{f"{kind}_source_texture_psnr": (kind, "{:.2f}") for kind in KINDS},
    **{f"{kind}_novel_texture_psnr": (kind, "{:.2f}") for kind in KINDS},
    "iou": ("IoU", "{:.3f}"),
    "chamfer_mm": ("Chamfer, mm", "{:.1f}"),
    "f_score": ("F", "{:.3f}"),
    "hull_iou": ("hull IoU", "{:.3f}"),
    "hull_chamfer_mm": ("hull Chamfer", "{:.1f}"),
    "hull_f_score": ("hull F", "{:.3f}"),
    "texels_from_field": ("from field", "{:.2f}"),
    "surface_seconds": ("surface, s", "{:.1f}"),
    "drawings_seconds": ("texture, s", "{:.1f}"),
}
WHOLE = 0.99  # alpha from which a pixel shows the character alone
NOVEL_VIEWS = 12  # at most, evenly chosen


@torch.no_grad()
def score_meshes(scene: Scene, character: Character, options: MeshOptions) -> dict[str, Any]:
    """Figures of one character's mesh with each kind of colours, and of the visual hull's mesh.

    Texture PSNR is over pixels that both the captured character and the mesh cover wholly: what the colours
    are worth where there are any. The whole foreground's counts what the mesh misses as white.
    """
    sources = character.sources
    indices = list(range(0, len(character.image_files), -(-len(character.image_files) // NOVEL_VIEWS)))
    true_views = {
        "source": (sources.cameras[0].to("cpu"), sources.images[0].cpu().movedim(1, -1)),
        "novel": (character.cameras[indices], character.images(indices) / 255.0),
    }
    surface = find_surface(scene, sources, options)
    result: dict[str, Any] = {"surface_seconds": surface.seconds}
    for kind in KINDS:
        start = time.perf_counter()
        built = finish_mesh(scene, surface, sources, replace(options, texture=kind, height=None))
        result[f"{kind}_seconds"] = time.perf_counter() - start
        if built.textured is not None and kind == "drawings":
            result["texels_from_field"] = built.textured.num_from_field / max(built.textured.num_texels, 1)
        for name, (cameras, images) in true_views.items():
            scores = picture_scores(built.mesh, cameras, images)
            result |= {f"{kind}_{name}_{key}": value for key, value in scores.items()}
    result |= {"iou": result["vertex_novel_iou"], **_surface_scores(surface.extraction.mesh, character)}
    hull = VisualHullBaseline(sources).mesh
    if hull is not None:
        result |= {f"hull_{key}": value for key, value in _surface_scores(hull, character).items()}
        result["hull_iou"] = picture_scores(hull, *true_views["novel"])["iou"]
    return result


def _surface_scores(mesh: trimesh.Trimesh, character: Character) -> dict[str, float | None]:
    if character.mesh_file is None:
        return {}
    return surface_scores(mesh, true_points(character.mesh_file), character.cameras)[0]


def picture_scores(mesh: trimesh.Trimesh, cameras: Cameras, truth: Tensor) -> dict[str, float | None]:
    """Texture PSNR, foreground PSNR, dB, and silhouette IoU against true pictures (N, H, W, 4), RGBA in [0, 1], straight alpha.

    Means over the views that have a figure: of texture there is none where mesh and character share no whole pixel.
    """
    rows = []
    for picture, true in zip(render_mesh(mesh, cameras), truth, strict=True):
        predicted = torch.from_numpy(picture)
        shared = (torch.minimum(predicted[..., 3], true[..., 3]) > WHOLE).float()
        rows.append(
            {
                "texture_psnr": psnr_foreground(predicted[..., :3], true[..., :3], shared),
                "psnr_foreground": psnr_foreground(on_white(predicted), on_white(true), true[..., 3]),
                "iou": silhouette_iou(predicted[..., 3], true[..., 3]),
            }
        )
    return mean_of(rows, ("texture_psnr", "psnr_foreground", "iou"))


def score_table(rows: Mapping[str, Record]) -> list[str]:
    """Figures by character, and their means, as Markdown."""
    heads = ["character", *(title for title, _ in COLUMNS.values())]
    every = {**rows, "**mean**": mean_of(list(rows.values()), list(COLUMNS))}
    lines = [heads]
    for name, row in every.items():
        values = [(row.get(key), form) for key, (_, form) in COLUMNS.items()]
        lines.append([name, *("-" if value is None else form.format(value) for value, form in values)])
    groups = ["", "in source views, dB", "", "", "in novel views, dB"]
    return table([*groups, *[""] * (len(heads) - len(groups))], lines)


def score_text(rows: Mapping[str, Record], facts: Mapping[str, Any]) -> str:
    """The text of meshes.md: the table, what it means, and where it was measured."""
    drawn, plain = mean_of(
        list(rows.values()), ["drawings_source_texture_psnr", "vertex_source_texture_psnr"]
    ).values()
    gain = (drawn or 0.0) - (plain or 0.0)
    lines = ["# Meshes and their colours", "", *score_table(rows), ""]
    lines += [
        f"Textures from the drawings are {gain:+.1f} dB beside vertex colours in the source views.",
        "",
        "Texture PSNR: over pixels that the captured character and the mesh both cover wholly. IoU: silhouettes",
        "in novel views. Chamfer and F-score (2 cm): all faces, against the surface that cameras see. From field:",
        "share of texels that the field was asked for. Surface, texture: seconds, without and with drawings.",
        "",
        ", ".join(f"{key}: {value}" for key, value in facts.items()),
        "",
    ]
    return "\n".join(lines)
