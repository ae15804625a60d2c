"""A field without a surface still has figures."""

import logging

import torch

from charnerf.training import finish
from support import small_runs


def test_a_field_too_thin_for_a_mesh_is_said_and_the_run_goes_on(figure_dataset, tmp_path, caplog):
    cfg = small_runs.smoke_config(figure_dataset, "encoder=single", "model.activation.scale=1e-6")
    run = small_runs.assemble(cfg, tmp_path)
    with caplog.at_level(logging.WARNING), torch.no_grad():
        finish.write_first_mesh(tmp_path, figure_dataset, "twin", run.module.model.eval(), run.board)
    assert "No mesh of twin: grid: found values from 0 to" in caplog.text
    assert not (tmp_path / "meshes").exists()
