"""What a GPU does: the same run as the CPU's, in float32 and, nearly, in bfloat16. Runs with `-m gpu`."""

import pytest
import torch

from charnerf.evaluation.timing import Stopwatch
from support import small_runs

STEPS = ("scale.steps=4", "validation.times=2")


def run_on(accelerator, root, folder, precision="32-true"):
    cfg = small_runs.smoke_config(root, *STEPS, f"+trainer.precision={precision}")
    cfg.trainer.accelerator = accelerator
    return small_runs.assemble(cfg, folder)


@pytest.mark.gpu
@pytest.mark.parametrize(("precision", "rtol"), [("32-true", 0.01), ("bf16-mixed", 0.1)])
def test_a_gpu_trains_as_the_cpu_does(figure_dataset, tmp_path, precision, rtol):
    """Its batches come from a worker, through pinned memory."""
    there = run_on("gpu", figure_dataset, tmp_path / "gpu", precision)
    there.data.trainer = there.trainer
    loader = there.data.train_dataloader()
    assert loader.num_workers == 1 and loader.pin_memory
    there.fit()
    here = run_on("cpu", figure_dataset, tmp_path / "cpu").fit()
    assert there.recorder.batches == here.recorder.batches
    assert there.recorder.losses == pytest.approx(here.recorder.losses, rel=rtol)


@pytest.mark.gpu
def test_peak_memory_of_a_stage_is_the_gpu_s(figure_dataset):
    device = torch.device("cuda")
    with Stopwatch(device) as watch, watch.stage("work"):
        torch.zeros(2**22, device=device).add_(1.0)
    assert watch.peaks_mib()["work"] >= 16.0


def test_half_precision_is_a_setting_of_the_trainer(figure_dataset, tmp_path):
    half = run_on("cpu", figure_dataset, tmp_path / "half", "bf16-mixed").fit()
    full = run_on("cpu", figure_dataset, tmp_path / "full").fit()
    assert half.recorder.losses != full.recorder.losses
    assert half.recorder.losses == pytest.approx(full.recorder.losses, rel=0.1)
