"""Type hints as schemas: whether a plain YAML value fits one, and how a user reads it."""

import dataclasses
import difflib
import inspect
import types
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

SCHEMAS = "charnerf.config.schema"  # its dataclasses are plain sections; all others are parts


@dataclasses.dataclass(frozen=True)
class Part:
    """A place that holds a part.

    Attributes:
        group: Of the registry, whose classes may stand here; "" for any part of charnerf, in an argument of a class that the
            user trusts.
        given: Arguments that the code that builds the part passes itself; the config neither needs nor may
            set them.
    """

    group: str
    given: frozenset[str] = frozenset()


@dataclasses.dataclass(frozen=True)
class AtLeast:
    """Smallest number that is accepted."""

    value: float


@dataclasses.dataclass(frozen=True)
class AtMost:
    """Largest number that is accepted."""

    value: float


@dataclasses.dataclass(frozen=True)
class Above:
    """Number that every accepted one exceeds."""

    value: float


def nearest(name: str, choices: Iterable[str]) -> str:
    """End of a sentence that names the nearest choice, or all of them."""
    names = sorted(choices)
    matches = difflib.get_close_matches(name, names, n=1, cutoff=0.6)
    if matches:
        return f"did you mean '{matches[0]}'?"
    return f"expected one of: {', '.join(names)}." if names else "remove it."


def names_of(schema: type) -> list[str]:
    """Field names of a dataclass."""
    return [field.name for field in dataclasses.fields(schema)]


def hints_of(target: Callable[..., Any]) -> dict[str, Any]:
    """Type hints of a constructor or function; empty where they can not be evaluated."""
    try:
        return get_type_hints(target.__init__ if inspect.isclass(target) else target, include_extras=True)  # type: ignore[misc]
    except (NameError, TypeError, AttributeError):  # hints of foreign code that only a type checker can read
        return {}


def is_accepted_as(target: type, hint: type) -> bool:
    """Whether a class may stand where a class hint stands; protocols are not checked."""
    if getattr(hint, "_is_protocol", False) or hint is Any or hint is object:
        return True
    return issubclass(target, hint)


def alternatives(hint: Any) -> tuple[Any, ...]:
    """Members of a union, or the hint alone."""
    return get_args(hint) if get_origin(hint) in (Union, types.UnionType) else (hint,)


def holds_parts(hint: Any) -> bool:
    """Whether an object may stand where a hint stands: not where a number, a text or a collection does."""
    return not all(_is_plain(one) for one in alternatives(hint))


def _is_plain(hint: Any) -> bool:
    kind = get_origin(hint) or hint
    if kind is object or kind is Callable:
        return False
    modules = ("builtins", "pathlib", "collections.abc")
    return kind is Literal or isinstance(hint, str) or (inspect.isclass(kind) and kind.__module__ in modules)


def fits(hint: Any, value: Any) -> bool:  # noqa: PLR0911 (one line a kind)
    """Whether a plain value may stand where a hint stands; what YAML can not express must be a part."""
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
        return issubclass(dict, kind)
    if isinstance(value, list):
        return kind is tuple or (issubclass(list, kind) and kind is not str)
    if isinstance(value, str):
        return kind is str or issubclass(Path, kind)
    if isinstance(value, bool):
        return kind is bool
    return isinstance(value, kind) or (kind is float and isinstance(value, int))


def describe(hint: Any) -> str:  # noqa: PLR0911 (one line a kind)
    """A hint as a user reads it."""
    origin = get_origin(hint)
    if origin is Annotated:
        inner, *notes = get_args(hint)
        part = next((note for note in notes if isinstance(note, Part)), None)
        return f"a section with _target_, a class of {part.group}" if part else describe(inner)
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
    if inspect.isclass(hint) and hint.__module__ == SCHEMAS:
        return f"a section with {', '.join(names_of(hint))}"
    if inspect.isclass(hint) and hint.__module__ not in ("builtins", "pathlib"):
        return f"a section with _target_ {hint.__module__}.{hint.__qualname__}"
    return getattr(hint, "__name__", str(hint))


def shown(value: Any) -> str:
    """A value as a message shows it, shortened."""
    if value is None:
        return "null"
    text = shown_number(value) if isinstance(value, int) else repr(value)
    return f"{text if len(text) <= 60 else text[:57] + '...'} ({type(value).__name__})"


def shown_number(value: float) -> str:
    """A number as a message shows it: whole where it is whole, and its size alone where it has very many digits."""
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        value = int(value)
    if isinstance(value, int) and abs(value) >= 10**60:
        return f"a whole number of {value.bit_length()} bits"
    return str(value)
