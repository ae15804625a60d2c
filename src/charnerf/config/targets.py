"""Which classes a `_target_` may name, and finding them."""

import importlib
import inspect
from collections.abc import Callable, Sequence
from typing import Any

from charnerf.config.hints import nearest, shown
from charnerf.config.problems import Problems

ALLOWED_TARGETS = ("charnerf.", "torch.optim.", "lightning.")


def resolve(name: Any, homes: Sequence[str], key: str, problems: Problems) -> Callable[..., Any] | None:
    """Find the class that `_target_` names, if it may be named.

    The module of what is found counts too: an alias such as `charnerf.x.os.system` passes any check of names.
    """
    trusted = tuple(f"{one.rstrip('.')}." for one in problems.trusted)
    wanted = tuple(f"{home}." for home in homes) or ALLOWED_TARGETS
    root = str(name).split(".")[0]
    advice = f"; your own classes need trusted_targets=[{root}] on the command line."
    expected = f"expected a class of {' or '.join(one.rstrip('.') for one in wanted)}"
    if not isinstance(name, str) or not all(piece.isidentifier() for piece in name.split(".")):
        problems.add(key, f"found {shown(name)}, {expected}.")
        return None
    if not name.startswith(wanted + trusted):
        inside = name.startswith(ALLOWED_TARGETS)
        problems.add(key, f"found '{name}', {expected}{'.' if inside else advice}")
        return None
    target = locate(name, key, problems)
    if target is None:
        return None
    module = f"{getattr(target, '__module__', '')}."
    if not callable(target) or not module.startswith(ALLOWED_TARGETS + trusted):
        problems.add(key, f"found '{name}', which is {shown_object(target)}; {expected}.")
        return None
    return target


def locate(name: str, key: str, problems: Problems) -> Any:
    """Import the longest module of a dotted name and follow its attributes; None where it leads nowhere."""
    pieces = name.split(".")
    target: Any = None
    for length in range(len(pieces) - 1, 0, -1):
        module = ".".join(pieces[:length])
        try:
            target = importlib.import_module(module)
        except ModuleNotFoundError as error:
            if error.name is not None and (module == error.name or module.startswith(f"{error.name}.")):
                continue
            problems.add(
                key, f"found '{name}', whose module {module} needs {error.name}, which is not installed."
            )
            return None
        for position, attribute in enumerate(pieces[length:], start=length):
            if not hasattr(target, attribute):
                here = ".".join(pieces[:position])
                problems.add(
                    key,
                    f"'{name}' does not exist: {here} has no '{attribute}'; {suggestion(target, attribute)}",
                )
                return None
            target = getattr(target, attribute)
        return target
    problems.add(
        key, f"'{name}' does not exist: there is no module '{pieces[0]}'; install it or correct the name."
    )
    return None


def suggestion(module: Any, attribute: str) -> str:
    """Advice on a name that a module or class does not have."""
    here = getattr(module, "__name__", "")
    own = [
        n
        for n, o in vars(module).items()
        if inspect.isclass(o) and getattr(o, "__module__", "").startswith(here)
    ]
    return nearest(attribute, own) if own else "correct the name."


def shown_object(target: Any) -> str:
    """What a name led to."""
    return f"{getattr(target, '__module__', '')}.{getattr(target, '__qualname__', type(target).__name__)}".lstrip(
        "."
    )
