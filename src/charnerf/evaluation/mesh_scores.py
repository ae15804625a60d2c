"""What meshes and their colours are worth: texture, outline and surface against the captured character."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np
import torch
import trimesh

from charnerf.data.characters import Character
from charnerf.evaluation.baselines import VisualHullBaseline
from charnerf.evaluation.surface_error import surface_scores, true_points
from charnerf.markdown import table
from charnerf.meshing.build import find_surface, finish_mesh
from charnerf.meshing.options import MeshOptions, Texture
from charnerf.pictures import on_white
from charnerf.scene import Scene
from charnerf.surfaces.render import render_mesh
from charnerf.types import Cameras

KINDS: tuple[Texture, ...] = ("drawings", "field", "vertex")
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
        "source": (sources.cameras[0].to("cpu"), sources.images[0].cpu().movedim(1, -1).numpy()),
        "novel": (character.cameras[indices], character.images(indices).numpy() / 255.0),
    }
    found = find_surface(scene, sources, options)
    result: dict[str, Any] = {"surface_seconds": found.seconds, "level": found.extraction.level}
    for kind in KINDS:
        start = time.perf_counter()
        built = finish_mesh(scene, found, sources, replace(options, texture=kind, height=None))
        result[f"{kind}_seconds"] = time.perf_counter() - start
        if built.textured is not None and kind == "drawings":
            result["texels_from_field"] = built.textured.num_from_field / max(built.textured.num_texels, 1)
        for name, (cameras, images) in true_views.items():
            scores = _picture_scores(built.mesh, cameras, images)
            result |= {f"{kind}_{name}_{key}": value for key, value in scores.items()}
    result |= {"iou": result["vertex_novel_iou"], **_surface(found.extraction.mesh, character)}
    hull = VisualHullBaseline(sources).mesh
    if hull is not None:
        result |= {f"hull_{key}": value for key, value in _surface(hull, character).items()}
        result["hull_iou"] = _picture_scores(hull, *true_views["novel"])["iou"]
    return result


def _surface(mesh: trimesh.Trimesh, character: Character) -> dict[str, float | None]:
    if character.mesh_file is None:
        return {}
    return surface_scores(mesh, true_points(character.mesh_file), character.cameras)[0]


def _picture_scores(mesh: trimesh.Trimesh, cameras: Cameras, truth: np.ndarray) -> dict[str, float]:
    """Mean over views (N, H, W, 4) of texture PSNR, foreground PSNR and silhouette IoU."""
    rows = []
    for found, true in zip(render_mesh(mesh, cameras), truth, strict=True):
        both = (found[..., 3] > WHOLE) & (true[..., 3] > WHOLE)
        inside = true[..., 3] > 0.5
        squared = (found[..., :3] - true[..., :3]) ** 2
        squared_on_white = (on_white(found) - on_white(true)) ** 2
        hit = found[..., 3] > 0.5
        union = (hit | inside).sum()
        iou = (hit & inside).sum() / union if union else 1.0
        rows.append((_decibels(squared[both]), _decibels(squared_on_white[inside]), float(iou)))
    means = np.nanmean(np.array(rows, np.float64), axis=0)
    return dict(zip(("texture_psnr", "psnr_foreground", "iou"), map(float, means), strict=True))


def _decibels(squared: np.ndarray) -> float:
    return float(-10.0 * np.log10(max(float(squared.mean()), 1e-10))) if squared.size else float("nan")


def score_table(rows: dict[str, dict[str, Any]]) -> str:
    """Figures by character, and their means, as Markdown."""
    heads = ["character", "drawings", "field", "vertex", "drawings", "field", "vertex"]
    heads += ["IoU", "Chamfer, mm", "F", "hull IoU", "hull Chamfer", "hull F", "from field", "surface, s"]
    heads += ["texture, s"]
    keys = [f"{kind}_{view}_texture_psnr" for view in ("source", "novel") for kind in KINDS]
    keys += ["iou", "chamfer_mm", "f_score", "hull_iou", "hull_chamfer_mm", "hull_f_score"]
    keys += ["texels_from_field", "surface_seconds", "drawings_seconds"]
    forms = [*["{:.2f}"] * 6, "{:.3f}", "{:.1f}", "{:.3f}", "{:.3f}", "{:.1f}", "{:.3f}", "{:.2f}"]
    forms += ["{:.1f}", "{:.1f}"]
    table_rows = [heads]
    every = {**rows, "**mean**": {key: mean_of(rows.values(), key) for key in keys}}
    for name, row in every.items():
        values = [row.get(key) for key in keys]
        cells = ["-" if v is None else form.format(v) for v, form in zip(values, forms, strict=True)]
        table_rows.append([name, *cells])
    groups = ["", "in source views, dB", "", "", "in novel views, dB", *[""] * 11]
    return "\n".join(table(groups, table_rows))


def score_text(rows: dict[str, dict[str, Any]], facts: dict[str, Any]) -> str:
    """The text of meshes.md: the table, what it means, and where it was measured."""
    gain = (mean_of(rows.values(), "drawings_source_texture_psnr") or 0.0) - (
        mean_of(rows.values(), "vertex_source_texture_psnr") or 0.0
    )
    lines = ["# Meshes and their colours", "", score_table(rows), ""]
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


def mean_of(rows: Any, key: str) -> float | None:
    """Mean of a figure over the rows that have it."""
    values = [row[key] for row in rows if row.get(key) is not None]
    return float(np.mean(values)) if values else None
