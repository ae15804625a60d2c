"""Where figures were taken: device, versions, commit."""

import platform
import subprocess
from pathlib import Path
from typing import Any

import torch

_UNKNOWN_COMMIT = "charnerf was not run from a git checkout"


def _git(*arguments: str) -> str | None:
    """Output of a git command in the package's folder, None if it fails."""
    try:
        answer = subprocess.run(
            ["git", *arguments],
            cwd=Path(__file__).parent,
            capture_output=True,
            text=True,
            timeout=10,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return answer.stdout.strip()


def commit() -> str | None:
    """Commit of the checkout that this runs from, with `-dirty` where files differ; None elsewhere."""
    if _git("ls-files", "--error-unmatch", Path(__file__).name) is None:
        return None
    return _git("describe", "--always", "--abbrev=40", "--exclude=*", "--dirty")


def _processor() -> str:
    """Name of the processor, as far as the system tells."""
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def environment(device: torch.device) -> dict[str, Any]:
    """What a reader needs to compare seconds: device, torch, commit (or null and why), threads, machine."""
    name = torch.cuda.get_device_name(device) if device.type == "cuda" else str(device)
    facts: dict[str, Any] = {"device": name, "torch": torch.__version__, "commit": commit()}
    if facts["commit"] is None:
        facts["commit_reason"] = _UNKNOWN_COMMIT
    return facts | {
        "threads": torch.get_num_threads(),
        "machine": f"{_processor()}, {platform.system()} {platform.machine()}",
        "python": platform.python_version(),
    }
