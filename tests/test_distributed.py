"""What processes tell one another, and that errors over counts of their own are those of all together."""

import subprocess
import sys
from pathlib import Path

import torch

from charnerf.distributed import gathered, mean_over_processes
from charnerf.losses.terms import absolute_depth_error, balanced_occupancy_error

TWO = """
import os, sys, torch
from torch import distributed
from charnerf.distributed import gathered, mean_over_processes
from charnerf.losses.terms import absolute_depth_error, balanced_occupancy_error

child = os.fork()
rank = 1 if child == 0 else 0
distributed.init_process_group("gloo", init_method=f"file://{sys.argv[1]}/meeting", rank=rank, world_size=2)
numbers = torch.load(f"{sys.argv[1]}/numbers.pt")[rank]
errors = torch.stack([balanced_occupancy_error(*numbers[:2]), absolute_depth_error(*numbers[2:])])
nothing = balanced_occupancy_error(numbers[0], torch.zeros_like(numbers[1]))
said = gathered((rank, errors.tolist(), float(nothing)))
assert [one[0] for one in said] == [0, 1]
mean = mean_over_processes(torch.tensor([float(rank), 4.0]))
assert mean.tolist() == [0.5, 4.0]
if rank == 0:
    torch.save(torch.tensor([one[1] for one in said]), f"{sys.argv[1]}/errors.pt")
    assert os.waitpid(child, 0)[1] == 0
distributed.destroy_process_group()
os._exit(0)
"""


def test_a_lone_process_hears_itself():
    count = torch.tensor(3.0, requires_grad=True)
    assert mean_over_processes(count).item() == 3.0 and not mean_over_processes(count).requires_grad
    assert gathered("it") == ["it"]


def test_the_mean_of_the_processes_errors_is_the_error_of_all(tmp_path: Path):
    """One has many points inside and few rays that meet the surface, the other few and none."""
    generator = torch.Generator().manual_seed(0)
    alphas, depth, opacity = torch.rand(3, 2, 1, 40, generator=generator)
    inside = (torch.rand(2, 1, 40, generator=generator) < torch.tensor((0.9, 0.1))[:, None, None]).float()
    target = depth + 0.1
    target[0, :, :10] = target[1] = 0.0
    numbers = list(zip(alphas, inside, depth, target, opacity, strict=True))
    torch.save(numbers, tmp_path / "numbers.pt")
    done = subprocess.run([sys.executable, "-c", TWO, str(tmp_path)], capture_output=True, check=False)
    assert done.returncode == 0, done.stderr.decode()
    errors = torch.load(tmp_path / "errors.pt").mean(0)
    together = [torch.cat(each) for each in zip(*numbers, strict=True)]
    expected = torch.stack([balanced_occupancy_error(*together[:2]), absolute_depth_error(*together[2:])])
    torch.testing.assert_close(errors, expected)
    alone = torch.stack([absolute_depth_error(*one[2:]) for one in numbers]).mean(0)
    assert abs(float(alone - expected[1])) > 0.01  # a mean of means would be another error
