"""Work in parallel processes."""

import multiprocessing
import os
import signal
import subprocess
import sys
import textwrap
import time
from functools import partial
from pathlib import Path

import pytest
import torch

from charnerf.errors import DataError
from charnerf.interruption import Stopped
from charnerf.parallel import in_processes


def begin(number: int, folder: Path) -> int:
    (folder / str(number)).touch()
    time.sleep(0.02)
    return number


def die(number: int) -> None:
    os._exit(number)


@pytest.mark.parametrize("processes", [1, 2])
def test_each_item_comes_with_its_result(processes: int, tmp_path: Path) -> None:
    with in_processes(partial(begin, folder=tmp_path), range(5), processes) as results:
        assert sorted(results) == [(number, number) for number in range(5)]


def threads(_: int) -> tuple[int, str]:
    return torch.get_num_threads(), os.environ["OMP_NUM_THREADS"]


def test_processes_use_one_thread_of_torch_and_of_what_is_loaded_later() -> None:
    with in_processes(threads, range(2), 2) as results:
        assert [found for _, found in results] == [(1, "1")] * 2


def test_what_processes_need_is_imported_before_one_is_started(tmp_path: Path) -> None:
    (tmp_path / "probe.py").write_text(
        "from pathlib import Path\nPath(__file__).with_name('imported').touch()\n"
    )
    code = """
    import os, sys, time
    from pathlib import Path
    from charnerf.pools import import_aside
    os.cpu_count = lambda: 2
    import_aside("probe")
    end = time.monotonic() + 20.0
    while not Path(sys.argv[1], "imported").exists() and time.monotonic() < end:
        time.sleep(0.01)
    assert not {"probe", "torch"} & set(sys.modules)
    """
    environment = os.environ | {"PYTHONPATH": str(tmp_path)}
    subprocess.run([sys.executable, "-c", textwrap.dedent(code), str(tmp_path)], check=True, env=environment)
    assert (tmp_path / "imported").exists()


@pytest.mark.parametrize("error", [DataError("the caller's"), Stopped(15), None])
def test_a_block_that_is_left_early_begins_nothing_more(error: BaseException | None, tmp_path: Path) -> None:
    """While the error is held, as a traceback holds what failed."""
    work, caught = partial(begin, folder=tmp_path), None
    try:
        with in_processes(work, range(500), 2) as results:
            next(results)
            if error is not None:
                raise error
    except type(error) as err:
        caught = err
    assert caught is error and not multiprocessing.active_children()
    assert 1 <= len(list(tmp_path.iterdir())) < 100


def test_a_process_that_dies_is_told() -> None:
    with pytest.raises(DataError, match="worker process died"), in_processes(die, [3, 4], 2) as results:
        list(results)


def linger(number: int, folder: Path) -> None:
    (folder / f"begun{number}").touch()
    try:
        time.sleep(60.0)
    finally:
        time.sleep(0.5)
        (folder / f"ended{number}").touch()


def test_a_signal_to_all_processes_is_waited_for(tmp_path: Path) -> None:
    """It ends the process that starts the others, which then tells nothing of their end."""
    code = """
    import sys
    from functools import partial
    from pathlib import Path
    from charnerf.interruption import listening
    from charnerf.parallel import in_processes
    from tests.test_parallel import linger
    folder = Path(sys.argv[1])
    with listening():
        try:
            with in_processes(partial(linger, folder=folder), range(2), 2) as results:
                list(results)
        finally:
            print(*sorted(path.name for path in folder.glob("ended*")))
    """
    root = Path(__file__).parents[1]
    command = [sys.executable, "-c", textwrap.dedent(code), str(tmp_path)]
    with subprocess.Popen(command, cwd=root, stdout=subprocess.PIPE, start_new_session=True) as process:
        while len(list(tmp_path.glob("begun*"))) < 2:
            assert process.poll() is None
            time.sleep(0.01)
        os.killpg(process.pid, signal.SIGTERM)
        assert process.stdout is not None
        assert process.stdout.read().split() == [b"ended0", b"ended1"]
