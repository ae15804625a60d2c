"""What a mesh's colours are worth: exact where it is the character, and no number where there is nothing to compare."""

import json

import pytest
import torch
import trimesh

from charnerf.evaluation.mesh_scores import picture_scores, score_text
from charnerf.geometry.framing import source_cameras
from charnerf.surfaces.render import render_mesh

CAMERAS = source_cameras(radius=1.5, size=24).to(torch.float32)


def block(at: float) -> trimesh.Trimesh:
    """A grey block half a metre wide, at a place along x, m."""
    mesh = trimesh.creation.box((0.5, 0.5, 0.5))
    mesh.visual.vertex_colors = (90, 90, 90, 255)
    mesh.apply_translation((at, 0.0, 1.0))
    return mesh


def test_the_character_itself_is_right():
    truth = torch.from_numpy(render_mesh(block(0.0), CAMERAS))
    assert picture_scores(block(0.0), CAMERAS, truth) == {
        "texture_psnr": pytest.approx(100.0), "psnr_foreground": pytest.approx(100.0), "iou": 1.0,
    }  # fmt: skip


def test_a_mesh_beside_the_character_has_no_texture_to_measure():
    front = CAMERAS[:1]
    scores = picture_scores(block(1.0), front, torch.from_numpy(render_mesh(block(-1.0), front)))
    assert scores["texture_psnr"] is None and scores["iou"] == 0.0
    assert scores["psnr_foreground"] == pytest.approx(
        -20.0 * torch.log10(torch.tensor(165 / 255)).item(), abs=0.1
    )
    json.dumps(scores, allow_nan=False)
    assert "nan" not in score_text({"hero": {"vertex_novel_texture_psnr": scores["texture_psnr"]}}, {})
