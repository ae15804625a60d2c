"""Blender as a program that does one job: the wheel `bpy` in a Python of its own, or `blender`."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from charnerf.errors import DataError, DependencyError

_ENTRY = Path(__file__).with_name("inside") / "__main__.py"
_LAST_LINES = 5


def find_blender(suffix: str = "") -> list[str]:
    """The command that runs a job file, which is its last argument: the wheel if it is there, else `blender` on PATH.

    Args:
        suffix: Of the file that it shall read: Collada is read by `blender` where there is one, since the wheel does not.

    Raises:
        DependencyError: If there is neither.
    """
    has_wheel, program = find_spec("bpy") is not None, shutil.which("blender")
    if has_wheel and (program is None or suffix != ".dae"):
        return [sys.executable, "-m", "charnerf.blender.inside.__main__"]
    if program is None:
        raise DependencyError(
            "Blender is not here: pip install 'charnerf[blender]' (Python 3.11), or put `blender` 3.4 or later on PATH."
        )
    options = ["--background", "--factory-startup", "--disable-autoexec", "--python-exit-code", "1"]
    return [program, *options, "--python", str(_ENTRY), "--"]


def run_job(folder: Path, job: Mapping[str, Any], *, where: str, limit_s: float) -> dict[str, Any]:
    """Do a job of `charnerf.blender.inside` in a process of its own.

    Args:
        folder: Where the job, its answer and Blender's own files are put.
        job: What to do.
        where: The file that messages name.
        limit_s: Seconds after which it hangs.

    Returns:
        Its answer.

    Raises:
        DataError: If the job is refused, fails, crashes or hangs.
        DependencyError: If there is no Blender.
    """
    file, answer = folder / "job.json", folder / "answer.json"
    file.write_text(json.dumps({**job, "parent": os.getpid()}), encoding="utf-8")
    answer.unlink(missing_ok=True)
    log = folder / "blender.log"
    own = {
        "BLENDER_USER_RESOURCES": str(folder / "user"),
        "TMPDIR": str(folder),
    }  # nobody's add-ons, no leftovers
    try:
        with log.open("wb") as output:
            status = subprocess.run(
                [*find_blender(Path(job.get("file", "")).suffix.lower()), str(file)],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                env={**os.environ, **own},
                timeout=limit_s,
                check=False,
            ).returncode
    except subprocess.TimeoutExpired as err:
        raise DataError(
            f"{where}: Blender was not done after {limit_s:.0f} s and was ended; open it there and make it simpler."
        ) from err
    if not answer.is_file():
        raise DataError(
            f"{where}: Blender {_ending(status)}; open the file there and save it again. Its last lines:\n{_tail(log)}"
        )
    content = json.loads(answer.read_text(encoding="utf-8"))
    if "error" in content:
        raise DataError(f"{where}: {content['error']}.")
    return content


def _ending(status: int) -> str:
    return f"crashed (signal {-status})" if status < 0 else f"failed (status {status})"


def _tail(log: Path) -> str:
    lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
    return "\n".join(f"    {line[:200]}" for line in lines[-_LAST_LINES:])
