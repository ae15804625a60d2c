"""Finding the class that a `_target_` names, where the registry or the user lets it be named."""

import importlib
import inspect
from collections.abc import Sequence
from typing import Any

from charnerf.config.hints import nearest, shown
from charnerf.config.problems import Problems
from charnerf.config.registry import GROUPS

OURS = tuple(name for names in GROUPS.values() for name in names if name.startswith("charnerf."))


def resolve(name: Any, group: str, key: str, problems: Problems) -> type | None:
    """Find the class that `_target_` names; nothing is imported that may not stand here.

    Args:
        name: As written.
        group: Of the registry; "" for any part of charnerf, in an argument of a class that the user trusts.
        key: Full key of the `_target_`.
        problems: Takes what is wrong; its trusted modules may be named in any group.

    Returns:
        The class, None where there is none or it may not stand here.
    """
    choices = GROUPS[group] if group else OURS
    expected = f"expected one of {', '.join(choices)}" if group else "expected a part of charnerf"
    if not isinstance(name, str) or not all(piece.isidentifier() for piece in name.split(".")):
        problems.add(key, f"found {shown(name)}, {expected}.")
        return None
    trusted = tuple(f"{one.rstrip('.')}." for one in problems.trusted)
    if name not in choices and not name.startswith(trusted):
        if _is_misspelt(name, choices):
            locate(name, key, problems)
        root = name.split(".")[0]
        is_foreign = root not in ("charnerf", "lightning", "torch")
        advice = f"; your own classes need trusted_targets=[{root}] on the command line" if is_foreign else ""
        problems.add_once(key, f"found '{name}', {expected}{advice}.")
        return None
    target = locate(name, key, problems)
    if target is None:
        return None
    home = f"{getattr(target, '__module__', '')}."  # an alias such as `mylab.x.os.system` passes any check of names
    if not inspect.isclass(target) or not (name in choices or home.startswith(trusted)):
        problems.add(key, f"found '{name}', which is {shown_object(target)}; {expected}.")
        return None
    return target


def _is_misspelt(name: str, choices: Sequence[str]) -> bool:
    """Whether a name is of a module of the choices, none of whose names it is."""
    module, _, last = name.rpartition(".")
    if module not in {choice.rpartition(".")[0] for choice in choices}:
        return False
    return not hasattr(importlib.import_module(module), last)


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
