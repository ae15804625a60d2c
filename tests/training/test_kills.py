"""Random kills over short trainings: every one ends as if nobody had killed it. CHARNERF_KILLS says how many each."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

KILLS = int(os.environ.get("CHARNERF_KILLS", "8"))
ENVIRONMENT = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": str(Path(__file__).parents[1])}
SHORT = ("scale.steps=24", "validation.times=4")


@pytest.mark.slow
@pytest.mark.parametrize(
    "settings",
    [
        ("encoder=single", "schedule=constant"),
        ("schedule=two_phase", "averaging.decay=0.9", "augmentation=[recolor,mirror]"),
        ("encoder=single", "schedule=two_phase", "batches.workers=1", "optimizer=adam"),
        (
            "encoder=single",
            "schedule=two_phase",
            "trainer=ddp",
            "trainer.accelerator=cpu",
            "trainer.devices=2",
        ),
    ],
    ids=["constant", "averaged", "worker", "two processes"],
)
def test_killed_trainings_end_as_the_one_that_was_not(figure_dataset, tmp_path, settings):
    command = [sys.executable, "-m", "support.kills", str(figure_dataset), str(tmp_path), str(KILLS), "1"]
    done = subprocess.run([*command, *SHORT, *settings], capture_output=True, env=ENVIRONMENT, check=False)
    assert done.returncode == 0, done.stderr.decode()
    report = json.loads(done.stdout)
    assert report["kills"] == KILLS and report["wrong"] == []
