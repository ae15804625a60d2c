"""Checks one value of a config against what its place expects; collects problems instead of raising.

A *part* is a section with `_target_`: its schema is the signature of the class that it names. A *plain section* has a frozen
dataclass as its schema. Everything here works on plain dicts and lists; `charnerf.config` turns a composed config into them.
"""

import dataclasses
import difflib
import importlib
import inspect
import types
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

MISSING = "???"
BROKEN = object()  # a value that could not be read and has been reported already
ALLOWED_TARGETS = ("charnerf.", "torch.optim.", "lightning.")
DIRECTIVES = {"_target_": str, "_partial_": bool, "_convert_": str, "_recursive_": bool}


@dataclasses.dataclass(frozen=True)
class Part:
    """What a section with `_target_` may name.

    Attributes:
        homes: Modules, one of which the class lives in or below.
        given: Arguments that the code that builds the part passes itself; the config neither needs nor may set them.
    """

    homes: tuple[str, ...]
    given: frozenset[str] = frozenset()


@dataclasses.dataclass(frozen=True)
class AtLeast:
    """Smallest number that is accepted."""

    value: float


@dataclasses.dataclass(frozen=True)
class Above:
    """Number that every accepted one exceeds."""

    value: float


@dataclasses.dataclass
class Problems:
    """The problems found so far, and the modules whose classes may be named."""

    trusted: tuple[str, ...] = ()
    found: list[tuple[str, str]] = dataclasses.field(default_factory=list)

    def add(self, key: str, message: str) -> None:
        """Note a problem at a full key."""
        if (key, message) not in self.found:
            self.found.append((key, message))

    def touch(self, key: str) -> bool:
        """Whether a key, a part of it or a section around it has a problem."""
        return any(
            one == key or one.startswith(f"{key}.") or key.startswith(f"{one}.") for one, _ in self.found
        )

    def lines(self) -> list[str]:
        """One line for each problem, beginning with its full key."""
        return [f"{key}: {message}" for key, message in self.found]


def join(key: str, name: str | int) -> str:
    """Full key of a child."""
    return f"{key}.{name}" if key else str(name)


def nearest(name: str, known: Iterable[str]) -> str:
    """End of a sentence that names the nearest known name, or all of them."""
    names = sorted(known)
    close = difflib.get_close_matches(name, names, n=1, cutoff=0.6)
    if close:
        return f"did you mean '{close[0]}'?"
    return f"expected one of: {', '.join(names)}." if names else "remove it."


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


def names_of(schema: type) -> list[str]:
    """Field names of a dataclass."""
    return [field.name for field in dataclasses.fields(schema)]


def check_value(hint: Any, value: Any, key: str, problems: Problems) -> None:
    """Check a value against a type hint of a schema or of a constructor."""
    if value is BROKEN:
        return
    if value == MISSING and isinstance(value, str):
        problems.add(key, f"not set, expected {describe(hint)}; set {key}=... .")
        return
    if get_origin(hint) is Annotated:
        check_annotated(hint, value, key, problems)
        return
    if isinstance(value, Mapping) and "_target_" in value:
        check_part(Part(homes=()), value, key, problems, hint=hint)
        return
    if inspect.isclass(hint) and dataclasses.is_dataclass(hint) and hint.__module__ == "charnerf.config":
        check_section(hint, value, key, problems)
        return
    if not fits(hint, value):
        problems.add(key, f"found {shown(value)}, expected {describe(hint)}.")
        return
    check_children(hint, value, key, problems)


def check_annotated(hint: Any, value: Any, key: str, problems: Problems) -> None:
    """Check a value whose hint carries a `Part` or a bound."""
    inner, *notes = get_args(hint)
    for note in notes:
        if isinstance(note, Part):
            check_part(note, value, key, problems)
            return
    check_value(inner, value, key, problems)
    if not isinstance(value, int | float) or isinstance(value, bool):
        return
    for note in notes:
        if isinstance(note, AtLeast) and not value >= note.value:
            problems.add(key, f"found {value}, expected at least {note.value}.")
        if isinstance(note, Above) and not value > note.value:
            problems.add(key, f"found {value}, expected more than {note.value}.")


def check_children(hint: Any, value: Any, key: str, problems: Problems) -> None:
    """Check the members of a list or mapping that fits its hint as a whole; nested parts everywhere."""
    chosen = next((one for one in alternatives(hint) if fits(one, value)), Any)
    arguments = get_args(chosen)
    if isinstance(value, Mapping):
        member = arguments[1] if len(arguments) == 2 else Any
        for name, item in value.items():
            check_value(member, item, join(key, name), problems)
    elif isinstance(value, list):
        member = arguments[0] if arguments else Any
        for index, item in enumerate(value):
            check_value(member, item, join(key, index), problems)


def check_part(part: Part, value: Any, key: str, problems: Problems, *, hint: Any = Any) -> None:
    """Check a section with `_target_`: that it may be named, that it exists, and its arguments."""
    if not isinstance(value, Mapping) or "_target_" not in value:
        homes = " or ".join(part.homes)
        problems.add(key, f"found {shown(value)}, expected a section with _target_, a class of {homes}.")
        return
    for name, kind in DIRECTIVES.items():
        if name in value and not isinstance(value[name], kind):
            problems.add(join(key, name), f"found {shown(value[name])}, expected {kind.__name__}.")
    target = resolve(value["_target_"], part.homes, join(key, "_target_"), problems)
    if target is None:
        for name, item in value.items():  # nothing is known of the arguments, but nested parts still are
            if name not in DIRECTIVES:
                check_value(Any, item, join(key, name), problems)
        return
    partial = value.get("_partial_", False) is True
    if not partial and inspect.isclass(hint) and inspect.isclass(target) and not is_accepted_as(target, hint):
        problems.add(join(key, "_target_"), f"found {value['_target_']}, expected {describe(hint)}.")
    check_arguments(target, part.given, value, key, problems, partial=partial)


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
    settable = [name for name in named if name not in given]
    for name, item in value.items():
        if name in DIRECTIVES:
            continue
        full = join(key, name)
        if name in given and name in named:
            problems.add(full, f"{title} gets '{name}' from the model, not from this section; remove it.")
        elif name not in named and not is_open:
            problems.add(full, f"{title} takes no argument '{name}'; {nearest(str(name), settable)}")
        else:
            check_value(hints.get(name, Any), item, full, problems)
    if partial:
        return
    for name in settable:
        if named[name].default is inspect.Parameter.empty and name not in value:
            problems.add(join(key, name), f"not set, but {title} needs it: {describe(hints.get(name, Any))}.")


def hints_of(target: Callable[..., Any]) -> dict[str, Any]:
    """Type hints of a constructor or function; empty where they can not be evaluated."""
    try:
        return get_type_hints(target.__init__ if inspect.isclass(target) else target, include_extras=True)  # type: ignore[misc]
    except (NameError, TypeError, AttributeError):  # hints of foreign code that only a type checker can read
        return {}


def resolve(name: Any, homes: Sequence[str], key: str, problems: Problems) -> Callable[..., Any] | None:
    """Find the class that `_target_` names, if it may be named; its own module too, for aliases slip past a prefix."""
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
    found = locate(name, key, problems)
    if found is None:
        return None
    module = f"{getattr(found, '__module__', '')}."
    if not callable(found) or not module.startswith(ALLOWED_TARGETS + trusted):
        problems.add(key, f"found '{name}', which is {shown_object(found)}; {expected}.")
        return None
    return found


def locate(name: str, key: str, problems: Problems) -> Any:
    """Import the longest module of a dotted name and follow its attributes; None, with a problem noted, where it ends."""
    pieces = name.split(".")
    found: Any = None
    for length in range(len(pieces) - 1, 0, -1):
        module = ".".join(pieces[:length])
        try:
            found = importlib.import_module(module)
        except ModuleNotFoundError as error:
            if error.name is not None and (module == error.name or module.startswith(f"{error.name}.")):
                continue
            problems.add(
                key, f"found '{name}', whose module {module} needs {error.name}, which is not installed."
            )
            return None
        for position, attribute in enumerate(pieces[length:], start=length):
            if not hasattr(found, attribute):
                here = ".".join(pieces[:position])
                problems.add(
                    key,
                    f"'{name}' does not exist: {here} has no '{attribute}'; {suggestion(found, attribute)}",
                )
                return None
            found = getattr(found, attribute)
        return found
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


def is_accepted_as(target: type, hint: type) -> bool:
    """Whether a class may stand where a class hint stands; protocols are not checked."""
    if getattr(hint, "_is_protocol", False) or hint is Any or hint is object:
        return True
    return issubclass(target, hint)


def alternatives(hint: Any) -> tuple[Any, ...]:
    """Members of a union, or the hint alone."""
    return get_args(hint) if get_origin(hint) in (Union, types.UnionType) else (hint,)


def fits(hint: Any, value: Any) -> bool:
    """Whether a plain value may stand where a hint stands; hints that YAML can not express ask for a part or None."""
    origin = get_origin(hint)
    if hint is Any or hint is object or isinstance(hint, str) or type(hint).__name__ == "TypeVar":
        return True
    if hint is None or hint is type(None):
        return value is None
    if origin in (Union, types.UnionType):
        return any(fits(one, value) for one in get_args(hint))
    if origin is Annotated:
        return fits(get_args(hint)[0], value)
    if origin is Literal:
        return any(value == one and type(value) is type(one) for one in get_args(hint))
    kind = origin or hint
    if not inspect.isclass(kind):
        return True
    if isinstance(value, Mapping):
        return "_target_" in value or issubclass(dict, kind)
    if isinstance(value, list):
        return kind is tuple or (issubclass(list, kind) and kind is not str)
    if isinstance(value, str):
        return kind is str or issubclass(Path, kind)
    if isinstance(value, bool):
        return kind is bool
    return isinstance(value, kind) or (kind is float and isinstance(value, int))


def describe(hint: Any) -> str:
    """A hint as a user reads it."""
    origin = get_origin(hint)
    if origin is Annotated:
        inner, *notes = get_args(hint)
        part = next((note for note in notes if isinstance(note, Part)), None)
        return f"a section with _target_, a class of {' or '.join(part.homes)}" if part else describe(inner)
    if hint is type(None) or hint is None:
        return "null"
    if origin in (Union, types.UnionType):
        return " or ".join(describe(one) for one in get_args(hint))
    if origin is Literal:
        return "one of " + ", ".join(str(one) for one in get_args(hint))
    if origin is not None:
        inner_text = ", ".join("..." if one is Ellipsis else describe(one) for one in get_args(hint))
        return f"{getattr(origin, '__name__', origin)}[{inner_text}]"
    if hint is Any:
        return "a value"
    if inspect.isclass(hint) and hint.__module__ == "charnerf.config":
        return f"a section with {', '.join(names_of(hint))}"
    if inspect.isclass(hint) and hint.__module__ not in ("builtins", "pathlib"):
        return f"a section with _target_ {hint.__module__}.{hint.__qualname__}"
    return getattr(hint, "__name__", str(hint))


def shown(value: Any) -> str:
    """A value as a message shows it, shortened."""
    if value is None:
        return "null"
    text = repr(value)
    return f"{text if len(text) <= 60 else text[:57] + '...'} ({type(value).__name__})"


def shown_object(found: Any) -> str:
    """What a name led to."""
    return (
        f"{getattr(found, '__module__', '')}.{getattr(found, '__qualname__', type(found).__name__)}".lstrip(
            "."
        )
    )
