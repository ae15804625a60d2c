"""What TensorBoard is given, read by its own reader."""

import io
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import torch
import trimesh
from PIL import Image
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from tensorboard.plugins.custom_scalar import layout_pb2
from torch.utils.tensorboard import SummaryWriter

from charnerf.training.board import Board, readable
from charnerf.training.clock import RunClock
from charnerf.training.events import forget
from charnerf.training.validation_pictures import error_picture, nearness
from charnerf.types import RenderOutput
from support import small_runs


def read(folder: Path) -> EventAccumulator:
    """Everything, also what an older program wrote of the same steps."""
    everything = {"tensors": 0, "scalars": 0, "images": 0}
    return EventAccumulator(str(folder), size_guidance=everything, purge_orphaned_data=False).Reload()


@pytest.fixture(scope="module")
def without_choice(figure_dataset, tmp_path_factory) -> tuple[small_runs.SmallRun, list[Any]]:
    """A short run whose H makes no choice, and what its validation rendered."""
    cfg = small_runs.smoke_config(
        figure_dataset, "encoder=single", "combinator=mean", "validation.times=1", "validation.views=2"
    )
    run = small_runs.assemble(cfg, tmp_path_factory.mktemp("run"))
    rendered, render = [], run.module.eval_renderer.render_camera

    def render_camera(*arguments):
        rendered.append(render(*arguments))
        return rendered[-1]

    run.module.eval_renderer = cast(Any, SimpleNamespace(render_camera=render_camera))
    run.fit()
    run.board.writer.close()
    return run, rendered


def test_what_a_config_has_not_is_not_written_or_computed(without_choice):
    run, _ = without_choice
    tags = read(run.board.folder).Tags()
    assert not [tag for tag in tags["scalars"] if tag.startswith("attention")]
    assert {"train/loss/total", "train/left_out/rays", "train/rays_per_second"} <= set(tags["scalars"])
    (config,) = read(run.board.folder).Tensors("custom_scalars__config__")
    layout = layout_pb2.Layout.FromString(config.tensor_proto.string_val[0])
    assert "Attention" not in [category.title for category in layout.category]


def test_the_picture_that_is_shown_is_the_one_that_was_measured(without_choice):
    """A validation renders each of its views once, drawn or not."""
    run, rendered = without_choice
    assert len(rendered) == 2 * len(run.data.val_store)
    (shown,) = read(run.board.folder).Images("val/target_prediction_error_depth_opacity/0")
    pixels = np.asarray(Image.open(io.BytesIO(shown.encoded_image_string))).astype(float) / 255.0
    expected = rendered[0].finest.rgb.clamp(0, 1).numpy()
    np.testing.assert_allclose(pixels[:, 32:64], expected, atol=1.01 / 255.0)


def test_a_line_has_a_point_where_it_is_due(without_choice):
    """Every twenty steps, and before a validation: the only one of a run of four steps."""
    events = read(without_choice[0].board.folder)
    assert [event.step for event in events.Scalars("train/loss/total")] == [4]
    (by_time,) = events.Scalars("by_milliseconds/psnr/phase_0")
    assert by_time.step == round(1000 * without_choice[0].clock.seconds)
    assert by_time.value == events.Scalars("val/psnr")[0].value
    speed = events.Scalars("train/rays_per_second")[0].value
    assert speed == pytest.approx(4 * 64 / without_choice[0].clock.seconds, rel=1e-5)


def write(folder: Path, *points: tuple[str, int]) -> None:
    with SummaryWriter(str(folder)) as writer:
        for tag, step in points:
            writer.add_scalar(tag, float(step), step)


def test_a_run_that_goes_on_forgets_what_came_after_its_checkpoint(tmp_path):
    clock = RunClock(steps=100, seconds=None)
    clock.steps, clock.seconds = 40, 1.5
    board = Board(folder=tmp_path, clock=clock, settings={})
    write(
        tmp_path, ("val/psnr", 20), ("val/psnr", 40), ("val/psnr", 41), ("by_milliseconds/psnr/phase_0", 1500)
    )
    write(tmp_path, ("by_milliseconds/psnr/phase_0", 1501), ("Final/psnr", 40), ("val/psnr", 60))
    forget(tmp_path, board._is_of_the_past)
    events = read(tmp_path)
    assert {tag: [event.step for event in events.Scalars(tag)] for tag in events.Tags()["scalars"]} == {
        "val/psnr": [20, 40],
        "by_milliseconds/psnr/phase_0": [1500],
    }
    assert len(list(tmp_path.iterdir())) == 1, "a file of which nothing is left is gone"


def test_files_that_are_cut_off_or_empty_are_mended(tmp_path):
    write(tmp_path, *(("val/psnr", step) for step in range(1, 9)))
    (file,) = tmp_path.iterdir()
    file.write_bytes(file.read_bytes()[:-7])
    (tmp_path / "events.out.tfevents.1.empty").touch()
    forget(tmp_path, lambda tag, step: step < 8)
    write(tmp_path, ("val/psnr", 8))
    assert [event.step for event in read(tmp_path).Scalars("val/psnr")] == list(range(1, 9))
    forget(tmp_path / "none", lambda tag, step: True)


def test_a_file_that_is_kept_whole_is_left_alone(tmp_path):
    write(tmp_path, ("val/psnr", 1))
    (file,) = tmp_path.iterdir()
    before = file.stat()
    forget(tmp_path, lambda tag, step: True)
    assert file.stat().st_ino == before.st_ino and file.stat().st_mtime_ns == before.st_mtime_ns


def test_meshes_stand_upright_and_look_at_the_reader(tmp_path):
    """TensorBoard's y is up, and its reader stands at +z; triangles keep their outer side."""
    board = Board(folder=tmp_path, clock=RunClock(steps=1, seconds=None), settings={})
    head, nose = (0.0, 0.0, 2.0), (0.0, -1.0, 1.0)
    mesh = trimesh.Trimesh(
        [head, nose, (1.0, 0.0, 1.0)], [[0, 1, 2]], vertex_colors=np.full((3, 4), 255, np.uint8)
    )
    board.add_mesh("doll", mesh)
    board.writer.close()
    (event,) = read(tmp_path).Tensors("mesh/doll_VERTEX")
    vertices = np.array(event.tensor_proto.float_val).reshape(-1, 3)
    np.testing.assert_allclose(vertices, [(0, 2, 0), (0, 1, 1), (1, 1, 0)], atol=1e-6)


def test_settings_read_well_in_a_table():
    given = {"combinator._target_": "charnerf.models.combinators.mean.Mean", "scale.width": 16, "name": "a.b"}
    assert readable(given) == {"combinator": "Mean", "scale.width": 16, "name": "a.b"}


def test_errors_are_white_where_there_is_none():
    target = torch.zeros(1, 3, 3)
    prediction = torch.tensor([[[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [1.0, 1.0, 1.0]]])
    torch.testing.assert_close(error_picture(prediction, target), torch.tensor([[1.0, 0.5, 0.0]]))


def test_depth_is_drawn_of_what_is_seen():
    """White is nearest; rays that show nothing are black, whatever depth they carry."""
    depth = torch.tensor(((0.0, 3.0), (4.0, 9.0)))
    opacity = torch.tensor(((0.0, 1.0), (0.9, 0.2)))
    output = RenderOutput(torch.zeros(2, 2, 3), opacity, depth)
    assert nearness(output).tolist() == [[0.0, 1.0], [0.25, 0.0]]
    assert nearness(RenderOutput(output.rgb, 0.0 * opacity, depth)).eq(0).all()
