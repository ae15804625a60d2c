"""How processes that work for another one are started. Light: a server that computes nothing itself imports it."""

import multiprocessing
import os
from multiprocessing import forkserver
from multiprocessing.context import BaseContext


def clean_processes(*preloaded: str) -> BaseContext:
    """How processes are started that inherit no thread's lock: where the system can, from one that has imported modules for all.

    Args:
        preloaded: Those modules; the first that starts such processes chooses.
    """
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(list(preloaded))
    return context


def import_aside(*preloaded: str) -> None:
    """Let the process that `clean_processes` starts others from begin to import, while this one does something else.

    Nothing happens where processes are started otherwise, or where there is one core.

    Args:
        preloaded: As of `clean_processes`, which is to be asked for the same.
    """
    if clean_processes(*preloaded).get_start_method() == "forkserver" and (os.cpu_count() or 1) > 1:
        forkserver.ensure_running()
