"""Seconds and memory of the stages: devices are synchronised."""

import os
import sys
import threading
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Self, final

import torch

_MIB = 1024.0 * 1024.0
_STATM = Path("/proc/self/statm")


def synchronize(device: torch.device) -> None:
    """Wait until the device has done all that was asked of it."""
    if device.type == "cuda":
        torch.cuda.synchronize(device)


def process_peak_mib() -> float | None:
    """Largest resident memory of this process so far, MiB; None where the system does not tell."""
    try:
        import resource
    except ImportError:  # Windows
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / _MIB if sys.platform == "darwin" else peak / 1024.0


def resident_mib() -> float | None:
    """Resident memory of this process now, MiB; None where the system does not tell."""
    try:
        return int(_STATM.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / _MIB
    except (OSError, ValueError, IndexError):
        return None


@final
class Stopwatch:
    """Collects the seconds of named stages, and the most memory that was resident while each ran.

    Memory is read by a thread every 20 ms (on CUDA devices: the allocator's own peak), so a shorter spike may
    be missed. Use as a context manager around everything that is measured.
    """

    def __init__(self, device: torch.device) -> None:
        self.device = device
        self._seconds: dict[str, list[float]] = defaultdict(list)
        self._peaks: dict[str, float] = {}
        self._stage: str | None = None
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> Self:
        """Start reading memory."""
        if self.device.type != "cuda":
            self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop reading memory."""
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join()

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Measure one execution of a stage; an execution that raises is not counted."""
        synchronize(self.device)
        if self.device.type == "cuda":
            torch.cuda.reset_peak_memory_stats(self.device)
        self._stage = name
        self._note(name)
        start = time.perf_counter()
        try:
            yield
            synchronize(self.device)
            self._seconds[name].append(time.perf_counter() - start)
            self._note(name)
        finally:
            self._stage = None

    def seconds(self) -> dict[str, list[float]]:
        """Of every execution of each stage, in order."""
        return {name: list(seconds) for name, seconds in self._seconds.items()}

    def total_seconds(self, name: str) -> float:
        """Sum over the executions of a stage."""
        return sum(self._seconds.get(name, ()))

    def peaks_mib(self) -> dict[str, float]:
        """Most memory resident (CUDA: allocated) while each stage ran, MiB."""
        return dict(self._peaks)

    def _note(self, name: str) -> None:
        """Raise a stage's peak to what is held now."""
        if self.device.type == "cuda":
            held: float | None = torch.cuda.max_memory_allocated(self.device) / _MIB
        else:
            held = resident_mib()
        if held is not None:
            self._peaks[name] = max(self._peaks.get(name, 0.0), held)

    def _watch(self) -> None:
        while not self._stop.wait(0.02):
            name = self._stage
            if name is not None:
                self._note(name)
