"""How processes that work for another one are started. Light: a server that computes nothing itself imports it."""

import multiprocessing
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
