"""What a config switches off is not built, not read, not missed."""

import logging
import shutil
from pathlib import Path

import pytest
from torch import nn

from charnerf.config.composition import compose_config
from charnerf.data.silhouettes import SilhouetteSpace
from charnerf.errors import DataError
from charnerf.inference.build import build_model
from charnerf.models.encoders.hourglass import Hourglass
from charnerf.models.mlp import ResidualBlock
from support import helpers, small_runs

ONE = ("splits.train=[train]", "splits.val=train", "validation.characters=1",
       "validation.times=1", "encoder=single", "scale.steps=2")  # fmt: skip


def built(*overrides: str) -> nn.Module:
    return build_model(compose_config(["scale=smoke", *overrides]))


def count(module: nn.Module, kind: type[nn.Module]) -> int:
    return sum(isinstance(one, kind) for one in module.modules())


def test_modules_are_those_of_the_config():
    one, two = built("encoder=single"), built("encoder=double")
    assert (count(one, Hourglass), count(two, Hourglass)) == (1, 2)
    assert count(built("encoder=double", "scale.coarse_stacks=3"), Hourglass) == 4
    assert one.fine is None and not any(name.startswith("fine") for name, _ in one.named_parameters())
    fine = built("encoder=single", "scale.num_fine=4")
    coarse_size = sum(p.numel() for p in one.coarse.parameters())
    assert sum(p.numel() for p in fine.parameters()) - sum(p.numel() for p in one.parameters()) == coarse_size
    assert sum(p.numel() for p in fine.encoder.parameters()) == sum(
        p.numel() for p in one.encoder.parameters()
    )
    assert count(built("scale.num_single_view_blocks=0", "scale.num_multi_view_blocks=0"), ResidualBlock) == 1


@pytest.mark.parametrize(
    ("overrides", "absent"),
    [
        (["features=image"], "from_point_features"),
        (["density=view_dependent"], "density.colour"),
        (["head=radiance"], "head.score"),
        (["combinator=mean"], "combinator"),
        (["combinator=sa"], "view_scale"),
        (["combinator=sa"], "norm"),
        (["combinator=view_mha"], "log_temperature"),
    ],
)
def test_parameters_of_what_is_off_do_not_exist(overrides, absent):
    names = [name for name, _ in built("encoder=single", *overrides).coarse.named_parameters()]
    assert not [name for name in names if absent in name]


@pytest.fixture
def broken(tmp_path) -> Path:
    """A data set whose mesh and depth pictures can not be read."""
    root = tmp_path / "dataset"
    folder = helpers.write_figure(root, "ball", "train", helpers.ball(), views=2)
    (folder / "mesh/mesh.obj").write_text("not a mesh")
    for path in (folder / "depth").iterdir():
        path.write_text("not a picture")
    return root


def test_files_that_no_loss_reads_are_not_opened(broken, tmp_path):
    small_runs.assemble(small_runs.smoke_config(broken, "loss=opacity", *ONE), tmp_path / "run").fit()
    for loss, file in (("charnerf", "mesh.obj"), ("depth", "depth")):
        run = small_runs.assemble(small_runs.smoke_config(broken, f"loss={loss}", *ONE), tmp_path / loss)
        with pytest.raises(DataError, match=file):
            run.fit()


def test_a_phase_that_reads_more_gets_it(broken, tmp_path):
    """The loss itself reads no mesh, its last phase does."""
    phase = "+schedule.phases.0.loss_weights={surface_rgb:0.1}"
    run = small_runs.assemble(small_runs.smoke_config(broken, "loss=opacity", phase, *ONE), tmp_path / "run")
    with pytest.raises(DataError, match=r"mesh\.obj"):
        run.fit()


def test_without_meshes_it_trains_by_rays_alone_and_says_so_once(tmp_path, caplog):
    root = tmp_path / "dataset"
    helpers.write_figure(root, "ball", "train", helpers.ball(), views=2, mesh=False)
    helpers.write_figure(root, "other", "train", helpers.ball(0.5), views=2, mesh=False)
    cfg = small_runs.smoke_config(root, "loss=charnerf", *ONE, "scale.steps=4")
    with caplog.at_level(logging.WARNING, logger="charnerf"):
        run = small_runs.assemble(cfg, tmp_path / "run").fit()
    told = [record.getMessage() for record in caplog.records if "mesh" in record.getMessage()]
    assert len(told) == 1 and "rays alone" in told[0]
    assert [batch[2:] for batch in run.recorder.batches] == [(64, 0)] * 4


@pytest.mark.parametrize(("space", "warnings"), [("solid", 1), ("silhouettes", 0)])
def test_without_meshes_points_are_labelled_by_pictures_which_is_said_once(space, warnings, tmp_path, caplog):
    root = tmp_path / "dataset"
    for name in ("one", "other"):
        helpers.write_figure(root, name, "train", helpers.ball(0.5), views=2, mesh=False)
    cfg = small_runs.smoke_config(root, "schedule=inside_last", f"space={space}", *ONE, "scale.steps=4")
    with caplog.at_level(logging.WARNING, logger="charnerf"):
        run = small_runs.assemble(cfg, tmp_path / "run").fit()
    told = sum("labelled by its pictures" in record.getMessage() for record in caplog.records)
    assert told == warnings
    assert all(isinstance(one.space, SilhouetteSpace) for one in run.data.train_store._open.values())


def test_squares_are_drawn_and_compared_in_their_phase_alone(figure_dataset, tmp_path):
    cfg = small_runs.smoke_config(figure_dataset, "schedule=perceptual_last", *ONE, "scale.steps=5")
    run = small_runs.assemble(cfg, tmp_path / "run").fit()
    assert [rays for _, _, rays, _ in run.recorder.batches] == [64] * 4 + [32 * 32 + 64]
    assert run.module.logged["train/loss/perceptual"] > 0.0


def test_without_a_hull_none_is_carved(figure_dataset, tmp_path):
    shutil.copytree(figure_dataset, tmp_path / "dataset")
    cfg = small_runs.smoke_config(tmp_path / "dataset", "model.hull=false", "features=image", *ONE)
    run = small_runs.assemble(cfg, tmp_path / "run").fit()
    assert all(one.hull is None for one in run.data.train_store._open.values())
