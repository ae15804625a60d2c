"""Running the catalogue."""

import platform
import time
from collections.abc import Sequence

import torch

from charnerf.stability import light, networks, space, transforms
from charnerf.stability.measure import Target
from charnerf.stability.report import CheckCurve, CheckReport, CheckRow
from charnerf.stability.trained import TrainedField, check_trained

CASES = (*light.CASES, *space.CASES, *networks.CASES, *transforms.CASES)
DTYPES = (torch.float32, torch.float64, torch.bfloat16, torch.float16)


def run_check(
    trained: TrainedField | None = None,
    *,
    devices: Sequence[torch.device] | None = None,
    dtypes: Sequence[torch.dtype] = DTYPES,
) -> CheckReport:
    """Measure every kernel at its stiff and extreme cases, with the usual formulas beside them.

    Args:
        trained: A trained field to check too.
        devices: Where; the CPU and, if there is one, the GPU if left out.
        dtypes: Of the inputs; half precisions are widened by the kernels and judged as float32.

    Returns:
        The report; `passed` says whether every bound holds and every naive formula fails where it should.
    """
    start = time.perf_counter()
    if devices is None:
        devices = [torch.device("cpu")] + ([torch.device("cuda")] if torch.cuda.is_available() else [])
    measured: list[CheckRow | CheckCurve] = []
    for device in devices:
        for dtype in dtypes:
            for case in CASES:
                measured.extend(case(Target(device, dtype)))
    if trained is not None:
        measured.extend(check_trained(trained))
    return CheckReport(
        rows=tuple(item for item in measured if isinstance(item, CheckRow)),
        curves=tuple(item for item in measured if isinstance(item, CheckCurve)),
        seconds=time.perf_counter() - start,
        environment={
            "torch": torch.__version__,
            "machine": platform.machine(),
            "threads": str(torch.get_num_threads()),
            "devices": ", ".join(str(device) for device in devices),
        },
    )
