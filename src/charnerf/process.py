"""Settings of the whole process. Only doors (the commands, `train.py`) change them; the library leaves a process as it is.

`limit_spinning` counts only before torch is imported, so this module imports torch where it needs it.
"""

import ctypes
import multiprocessing
import os
import threading
from functools import cache

FLOAT32_ERROR = 1e-5  # of a product, over the product of the absolute values; bfloat16 makes 1e-3
SHAPES = (
    (4096, 64, 64),
    (64, 4096, 64),
    (1024, 512, 512),
)  # a layer, the gradient of its weights, a wide layer
SPIN_COUNT = "20000"  # a millisecond; fewer cost time on idle cores, more on busy ones: docs/speed.md


def limit_spinning() -> None:
    """Let OpenMP's threads go to sleep instead of spinning for one another, unless the user has chosen.

    On busy cores a spinning thread takes the time that the awaited one needs.
    """
    os.environ.setdefault("GOMP_SPINCOUNT", SPIN_COUNT)


def keep_freed_memory() -> None:
    """Let glibc keep freed memory: a training step frees and takes the same blocks again (measured: see docs).

    Does nothing where the C library is another one.
    """
    try:
        library = ctypes.CDLL("libc.so.6")
    except OSError:
        return
    trim_threshold, top_pad, mmap_max = -1, -2, -4
    library.mallopt(mmap_max, 0)
    library.mallopt(trim_threshold, 1 << 30)
    library.mallopt(top_pad, 1 << 26)


def leave_disk_errors_to_callers() -> None:
    """Print no traceback where a thread can not write, as TensorBoard's on a full disk: its next caller raises the same error."""
    others = threading.excepthook

    def hook(failure: threading.ExceptHookArgs) -> None:
        if not issubclass(failure.exc_type, OSError):
            others(failure)

    threading.excepthook = hook


def start_processes_as_usual() -> None:
    """Let a launcher's process start others as Python does: joblib leaves `loky` as the way, which those do not know."""
    multiprocessing.set_start_method(None, force=True)


@cache
def use_fastest_products() -> bool:
    """Let oneDNN multiply float32 matrices where the CPU has AVX-512, in full precision; decided once a process.

    Half of a training step is spent in such products. PyTorch gives them to MKL, which has no AVX-512 kernels for
    processors of other makers: measured on an AMD EPYC, 88 GFLOP/s a core where oneDNN has 205. The one public switch
    to oneDNN is `medium` precision, which allows bfloat16 but does not ask for it; so the switch stays only where
    products come out in full precision. Machines with a GPU are left alone, since the switch concerns the GPU too.

    Returns:
        Whether the switch is set.
    """
    import torch

    before = torch.get_float32_matmul_precision()
    if (
        torch.cuda.is_available()
        or torch.backends.cpu.get_cpu_capability() != "AVX512"
        or before != "highest"
    ):
        return False
    torch.set_float32_matmul_precision("medium")
    if all(_error(*shape) < FLOAT32_ERROR for shape in SHAPES):
        return True
    torch.set_float32_matmul_precision(before)
    return False


def _error(rows: int, inner: int, columns: int) -> float:
    """Largest error of a seeded product (rows, inner) x (inner, columns) against float64, over that of absolute values."""
    import torch

    generator = torch.Generator().manual_seed(0)
    first = torch.randn(rows, inner, generator=generator)
    second = torch.randn(inner, columns, generator=generator)
    exact, size = first.double() @ second.double(), first.double().abs() @ second.double().abs()
    return float((((first @ second).double() - exact).abs() / size).max())
