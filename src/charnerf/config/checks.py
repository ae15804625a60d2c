"""Checks one value of a config against what its place expects; collects problems instead of raising.

A *part* is a section with `_target_`: its schema is the signature of the class that it names. A *plain
section* has a frozen dataclass as its schema. Everything here works on plain dicts and lists.
"""

import dataclasses
import inspect
import math
from collections.abc import Callable, Mapping
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from charnerf.config.bounds import largest
from charnerf.config.hints import (
    SCHEMAS,
    Above,
    AtLeast,
    AtMost,
    Part,
    alternatives,
    describe,
    fits,
    hints_of,
    holds_parts,
    is_accepted_as,
    names_of,
    nearest,
    shown,
    shown_number,
)
from charnerf.config.problems import Problems, join
from charnerf.config.registry import ARGUMENTS, COMPLETED_LATER
from charnerf.config.targets import resolve

MISSING = "???"
BROKEN = object()  # a value that could not be read and has been reported already
DIRECTIVES = {"_target_": str, "_partial_": bool, "_convert_": str, "_recursive_": bool}


def check_section(schema: type, value: Any, key: str, problems: Problems) -> None:
    """Check a plain section against its frozen dataclass: unknown keys, keys that are missing, types."""
    if not isinstance(value, Mapping):
        problems.add(key, f"found {shown(value)}, expected a section with {', '.join(names_of(schema))}.")
        return
    hints = get_type_hints(schema, include_extras=True)
    for name in value:
        if name not in hints:
            problems.add(join(key, name), f"unknown key; {nearest(str(name), hints)}")
    for name, hint in hints.items():
        if name not in value:
            problems.add(join(key, name), f"not set, expected {describe(hint)}; add it to the config.")
        else:
            check_value(hint, value[name], join(key, name), problems)


def check_value(hint: Any, value: Any, key: str, problems: Problems, slot: Part | None = None) -> None:
    """Check a value against a type hint of a schema or of a constructor; parts stand in slots alone."""
    if value is BROKEN:
        return
    if value == MISSING and isinstance(value, str):
        problems.add(key, f"not set, expected {describe(hint)}; set {key}=... .")
        return
    if get_origin(hint) is Annotated:
        check_annotated(hint, value, key, problems, slot)
        return
    if isinstance(value, Mapping) and "_target_" in value:
        if slot is None or not holds_parts(hint):
            found = shown(value["_target_"]).rpartition(" (")[0]
            problems.add(
                join(key, "_target_"),
                f"found {found}, expected {describe(hint)}: no class may stand here.",
            )
        else:
            check_part(slot, value, key, problems, hint=hint)
        return
    if inspect.isclass(hint) and dataclasses.is_dataclass(hint) and hint.__module__ == SCHEMAS:
        check_section(hint, value, key, problems)
        return
    if not fits(hint, value):
        problems.add(key, f"found {shown(value)}, expected {describe(hint)}.")
    elif isinstance(value, float) and math.isnan(value):
        problems.add(key, "found nan, expected a number.")
    elif isinstance(value, int | float) and not isinstance(value, bool) and abs(value) > largest(key):
        problems.add(key, f"found {shown_number(value)}, expected at most {shown_number(largest(key))}.")
    else:
        check_children(hint, value, key, problems, slot)


def check_annotated(hint: Any, value: Any, key: str, problems: Problems, slot: Part | None = None) -> None:
    """Check a value whose hint carries a `Part` or a bound."""
    inner, *notes = get_args(hint)
    for note in notes:
        if isinstance(note, Part):
            check_part(note, value, key, problems)
            return
    check_value(inner, value, key, problems, slot)
    if not isinstance(value, int | float) or isinstance(value, bool):
        return
    for note in notes:
        if isinstance(note, AtLeast) and not value >= note.value:
            problems.add(key, f"found {value}, expected at least {note.value}.")
        if isinstance(note, AtMost) and not value <= note.value:
            problems.add(key, f"found {value}, expected at most {note.value}.")
        if isinstance(note, Above) and not value > note.value:
            problems.add(key, f"found {value}, expected more than {note.value}.")


def check_children(hint: Any, value: Any, key: str, problems: Problems, slot: Part | None = None) -> None:
    """Check the members of a list or mapping that fits its hint as a whole; nested parts everywhere."""
    chosen = next((one for one in alternatives(hint) if fits(one, value)), Any)
    if get_origin(chosen) is Annotated:
        check_annotated(chosen, value, key, problems, slot)
        return
    arguments = get_args(chosen)
    if isinstance(value, Mapping):
        names, member = arguments if len(arguments) == 2 else (Any, Any)
        for name, item in value.items():
            if not fits(names, name):
                problems.add(join(key, name), f"unknown key; {nearest(str(name), map(str, get_args(names)))}")
                continue
            check_value(member, item, join(key, name), problems, slot)
    elif isinstance(value, list):
        member = arguments[0] if arguments else Any
        for index, item in enumerate(value):
            check_value(member, item, join(key, index), problems, slot)


def check_part(part: Part, value: Any, key: str, problems: Problems, *, hint: Any = Any) -> None:
    """Check a section with `_target_`: that it may be named, that it exists, and its arguments."""
    if not isinstance(value, Mapping) or "_target_" not in value:
        advice = "; choose the option that brings it, or name a class" if isinstance(value, Mapping) else ""
        problems.add(
            key, f"found {shown(value)}, expected a section with _target_, a class of {part.group}{advice}."
        )
        return
    for name, kind in DIRECTIVES.items():
        if name in value and not isinstance(value[name], kind):
            problems.add(join(key, name), f"found {shown(value[name])}, expected {kind.__name__}.")
    for name in value:
        if str(name).startswith("_") and name not in DIRECTIVES:
            problems.add(join(key, name), f"unknown directive; {nearest(str(name), DIRECTIVES)}")
    partial = value.get("_partial_", False) is True
    if partial and part.group not in COMPLETED_LATER:
        problems.add(
            join(key, "_partial_"), f"found true, expected it in {', '.join(COMPLETED_LATER)} alone."
        )
    target = resolve(value["_target_"], part.group, join(key, "_target_"), problems)
    if target is None:
        for name, item in value.items():  # nothing is known of the arguments, but nested parts still are
            if name not in DIRECTIVES:
                check_value(Any, item, join(key, name), problems)
        return
    if not partial and inspect.isclass(hint) and not is_accepted_as(target, hint):
        problems.add(join(key, "_target_"), f"found {value['_target_']}, expected {describe(hint)}.")
    check_arguments(target, part.given, value, key, problems, partial=partial)


def slots_of(name: str, problems: Problems) -> Callable[[str], Part | None]:
    """Which arguments of a class hold parts: those that the registry names; any one of a class that the user trusts."""
    if name.startswith(tuple(f"{one.rstrip('.')}." for one in problems.trusted)):
        return lambda _: Part(group="")
    groups = ARGUMENTS.get(name, {})
    return lambda argument: Part(group=groups[argument]) if argument in groups else None


def check_arguments(
    target: Callable[..., Any],
    given: frozenset[str],
    value: Mapping[str, Any],
    key: str,
    problems: Problems,
    *,
    partial: bool,
) -> None:
    """Check the arguments of a part against the signature of its class."""
    parameters = inspect.signature(target).parameters
    named = {n: p for n, p in parameters.items() if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)}
    is_open = any(p.kind is p.VAR_KEYWORD for p in parameters.values())
    hints = hints_of(target)
    title = f"{value['_target_']}"
    slot_of = slots_of(title, problems)
    settable = [name for name in named if name not in given]
    for name, item in value.items():
        if str(name).startswith("_"):
            continue
        full = join(key, name)
        if name in given and name in named:
            problems.add(full, f"charnerf sets '{name}' of {title} itself; remove it.")
        elif name not in named and not is_open:
            problems.add(full, f"{title} takes no argument '{name}'; {nearest(str(name), settable)}")
        else:
            check_value(hints.get(name, Any), item, full, problems, slot_of(name))
    if partial:
        return
    for name in settable:
        if named[name].default is inspect.Parameter.empty and name not in value:
            problems.add(join(key, name), f"not set, but {title} needs it: {describe(hints.get(name, Any))}.")
