"""What follows training: test figures, a mesh, the report."""

import logging
import shlex
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import lightning as L
import torch
from omegaconf import DictConfig

from charnerf.data.characters import load_character
from charnerf.data.layout import names_of, read_dataset
from charnerf.data.sampler import Share
from charnerf.errors import NumericalError
from charnerf.evaluation.evaluate import evaluate
from charnerf.evaluation.metrics_file import write_metrics
from charnerf.evaluation.nearest import TrainingCharacters
from charnerf.meshing.build import build_mesh, find_surface
from charnerf.meshing.export import save_mesh
from charnerf.meshing.options import MeshOptions
from charnerf.meshing.sheet import contact_sheet
from charnerf.models.charnerf import CharNeRF
from charnerf.reporting.formats import seconds_text
from charnerf.reporting.run_report import write_run_report
from charnerf.training.board import Board
from charnerf.training.threads import ThreadTuner
from charnerf.volume.renderers.base import AbstractRenderer

log = logging.getLogger(__name__)


def finish_run(
    cfg: DictConfig,
    folder: Path,
    root: Path,
    model: CharNeRF,
    renderer: AbstractRenderer,
    *,
    train_seconds: float,
    threads: ThreadTuner,
    trainer: L.Trainer,
    board: Board,
) -> None:
    """Evaluate the test split, shared out among the processes of a training, write metrics.json, meshes/ and the report.

    Args:
        cfg: Of the run.
        folder: Run folder.
        root: Data set.
        model: Trained, in eval mode.
        renderer: For evaluation.
        train_seconds: Training time, evaluation excluded.
        threads: What the steps were taken with.
        trainer: That trained it.
        board: Gets the mesh and the final figures.
    """
    metrics = evaluate(
        model,
        renderer,
        root,
        cfg.splits.test,
        views=cfg.scale.eval_views or "all",
        output=folder,
        mesh=partial(find_surface, options=MeshOptions(resolution=cfg.scale.mesh_resolution, height=None)),
        training=TrainingCharacters([(root, split) for split in cfg.splits.train]),
        train_seconds=train_seconds,
        share=Share(trainer.global_rank, trainer.world_size),
    )
    if not trainer.is_global_zero:
        return
    metrics["environment"]["training_steps_by_threads"] = dict(threads.steps_by_threads)
    size = sum(parameter.numel() for parameter in model.parameters())
    write_metrics(folder / "metrics.json", {**metrics, "num_parameters": size, "steps": trainer.global_step})
    first = names_of(read_dataset(root), cfg.splits.test)[0]
    write_first_mesh(folder, root, first, model, board)
    board.finish(metrics)
    _tell(metrics, write_run_report(folder))


def _tell(metrics: Mapping[str, Any], report: Path) -> None:
    """Log the figures that matter most, and how to go on."""
    beside = metrics["baselines"]["visual_hull"]
    log.info(
        "Trained for %s. Test: %.2f dB, %.2f dB on the foreground, SSIM %.3f (visual hull: %.2f, %.2f, %.3f). Report: %s. Next:"
        " charnerf reconstruct FRONT SIDE BACK --weights %s -o DIR",
        seconds_text(metrics["seconds"]["train"]),
        *(scores[key] for scores in (metrics, beside) for key in ("psnr", "psnr_foreground", "ssim")),
        report.with_suffix(".html"),
        shlex.quote(str(report.parent)),
    )


def write_first_mesh(folder: Path, root: Path, name: str, model: CharNeRF, board: Board) -> None:
    """Write one character's mesh, into TensorBoard too; says so where the field has no surface."""
    device = next(model.parameters()).device
    with torch.no_grad():
        sources = load_character(root, name).sources.to(device)
        scene = model.scene(model.encode(sources), 0)
        try:
            built = build_mesh(scene, sources, MeshOptions(height=None))
        except NumericalError as error:  # too thin for a surface: the figures count all the same
            log.warning("No mesh of %s: %s", name, error)
            return
    (folder / "meshes").mkdir(exist_ok=True)
    save_mesh(built.mesh, folder / "meshes" / f"{name}.glb")
    contact_sheet(built.mesh, sources).save(folder / "meshes" / f"{name}_sheet.png")
    board.add_mesh(name, built.mesh)
