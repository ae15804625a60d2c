"""Work in parallel processes that end with their parent."""

import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing.connection import Connection
from typing import TypeVar

import torch

from charnerf.errors import DataError
from charnerf.interruption import Stopped, end_with_parent, listening
from charnerf.pools import clean_processes

Item = TypeVar("Item")
Result = TypeVar("Result")


@contextmanager
def in_processes(
    work: Callable[[Item], Result], items: Sequence[Item], processes: int | None
) -> Iterator[Iterator[tuple[Item, Result]]]:
    """Do work on items while the block runs; its target yields each with its result as it ends.

    A block that is left early, by an error or a signal too, begins nothing more and waits for what is at hand: until the processes
    have ended, also where a signal to all of them has ended the one that starts them, whose word is all that a pool waits for.

    Args:
        work: Function, or a partial of one, that can be sent to another process.
        items: What to work on; hashable is not needed.
        processes: How many at once; None for one a core; 1 works in this process.

    Raises:
        DataError: If a process dies.
    """
    count = min(processes or os.cpu_count() or 1, len(items))
    if count <= 1:
        yield ((item, work(item)) for item in items)
        return
    context = clean_processes(getattr(work, "func", work).__module__)
    last, held_open = context.Pipe(duplex=False)  # the second end is open as long as a process is there
    with ProcessPoolExecutor(count, mp_context=context, initializer=_begin, initargs=(held_open,)) as pool:
        waiting = {pool.submit(_do, work, item): item for item in items}
        try:
            yield ((waiting[done], done.result()) for done in as_completed(waiting))
        except BrokenProcessPool as err:
            raise DataError(
                "A worker process died, perhaps for want of memory; what was written is kept, "
                "run the command again for the rest, with fewer processes."
            ) from err
        finally:
            pool.shutdown(cancel_futures=True)
            held_open.close()
            last.poll(None)
            last.close()


def _do(work: Callable[[Item], Result], item: Item) -> Result:
    """Do a work in a process of the pool; where a signal ends that, what is half done is cleaned up first."""
    try:
        with listening(in_worker=True):
            return work(item)
    except Stopped as stop:
        os._exit(stop.status)  # the pool would go on with the next item


def _begin(_: Connection) -> None:
    """Use one thread, leave Ctrl-C to the parent, and end with that even if it is killed."""
    torch.set_num_threads(1)
    os.environ["OMP_NUM_THREADS"] = "1"  # of libraries that are loaded from now on
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()
