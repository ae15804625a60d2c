"""How large a config may be, checked before it is expanded, resolved or built: a few bytes can mean millions of values."""

import re
from collections.abc import Mapping
from typing import Any

import yaml

from charnerf.errors import ConfigError

MOST_BYTES = 1_000_000  # of a file
MOST_VALUES = 20_000  # with all that anchors and interpolations repeat; a run's config has 250
DEEPEST = 32  # sections within sections
LONGEST = 10_000  # characters of a text, or of one override on a command line
MOST_JOBS = 10_000  # of a sweep

LARGEST: Mapping[str, float] = {  # numbers by name, of whichever section
    **dict.fromkeys(("depth", "hourglass_depth"), 8),  # each halves the drawing's sides
    **dict.fromkeys(("num_stacks", "coarse_stacks", "fine_stacks"), 16),
    **dict.fromkeys(("reduction", "stride", "count", "octaves", "num_frequencies"), 64),
    **dict.fromkeys(("num_single_view_blocks", "num_multi_view_blocks"), 64),
    **dict.fromkeys(("width", "coarse_width", "fine_width", "attention_width", "hidden"), 8192),
    **dict.fromkeys(("feature_dim", "out_channels", "coarse_channels", "fine_channels", "num_heads"), 8192),
    **dict.fromkeys(("image_size", "size", "num_coarse", "train_num_coarse", "num_fine", "num_guided"), 4096),
    **dict.fromkeys(("hull_steps", "batch_characters", "num_directions", "square"), 4096),
    **dict.fromkeys(("mesh_resolution", "workers"), 1024),
    **dict.fromkeys(("views", "eval_views", "times"), 100_000),
    **dict.fromkeys(("rays", "surface_points", "phase_rays", "phase_surface_points"), 10**7),
    **dict.fromkeys(("space_points", "space_pool", "pool_size", "num_points"), 10**7),
    **dict.fromkeys(
        ("train", "train_characters", "val", "test", "characters", "memory_mib", "cache_mib", "window"), 10**7
    ),
    **dict.fromkeys(("steps", "seconds", "window_steps"), 10**10),
}
LARGEST_OF_ALL = 2.0**63  # any number that has no bound of its own

_REFERENCE = re.compile(r"\$\{\s*([\w.]+)\s*\}")


def largest(key: str) -> float:
    """Largest number that may stand at a full key; members of a list are called after it."""
    names = [name for name in key.split(".") if not name.isdigit()]
    return LARGEST.get(names[-1], LARGEST_OF_ALL) if names else LARGEST_OF_ALL


def check_yaml(content: bytes, where: str) -> None:
    """Check that a YAML file is small when its anchors are expanded, without expanding them.

    Raises:
        ConfigError: If it is not.
        yaml.YAMLError: If it is no YAML.
    """
    if len(content) > MOST_BYTES:
        raise ConfigError(f"{where}: found {len(content)} bytes, expected a config of at most {MOST_BYTES}.")
    sizes: dict[str, int] = {}  # of closed anchors, expanded
    opened: list[tuple[str | None, int]] = [(None, 0)]  # anchor and values so far
    for event in yaml.parse(content, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader)):
        line = f"{where}: line {event.start_mark.line + 1 if event.start_mark else '?'}"
        if isinstance(event, yaml.CollectionStartEvent):
            opened.append((event.anchor, 1))
            if len(opened) > DEEPEST + 1:
                raise ConfigError(
                    f"{line}: found more than {DEEPEST} sections within each other, expected fewer."
                )
            continue
        if isinstance(event, yaml.CollectionEndEvent):
            anchor, values = opened.pop()
        elif isinstance(event, yaml.AliasEvent):
            if event.anchor not in sizes:
                raise ConfigError(f"{line}: '*{event.anchor}' refers to what is around it or to nothing.")
            anchor, values = None, sizes[event.anchor]
        elif isinstance(event, yaml.ScalarEvent):
            anchor, values = event.anchor, 1
            if len(event.value) > LONGEST:
                raise ConfigError(
                    f"{line}: found a text of {len(event.value)} characters, expected at most {LONGEST}."
                )
        else:
            continue
        if anchor is not None:
            sizes[anchor] = values
        outer, sum_so_far = opened.pop()
        opened.append((outer, sum_so_far + values))
        if sum_so_far + values > 2 * MOST_VALUES:  # keys count too
            raise ConfigError(f"{line}: found more than {MOST_VALUES} values, expected fewer.")


def check_values(plain: Any) -> None:
    """Check that a config, its interpolations not resolved, is small when they are.

    Raises:
        ConfigError: Names the key that is too large, too deep or repeats itself.
    """
    _expanded("", nodes_of(plain), {}, ())


def nodes_of(plain: Any) -> dict[str, Any]:
    """Every node by its full key, as many and as deep as a config may have."""
    nodes: dict[str, Any] = {}
    waiting: list[tuple[str, Any, int]] = [("", plain, 0)]
    while waiting:
        key, node, depth = waiting.pop()
        nodes[key] = node
        if depth > DEEPEST:
            raise ConfigError(f"{_short(key)}: lies in more than {DEEPEST} sections, expected fewer.")
        children: list[tuple[Any, Any]] = []
        if isinstance(node, Mapping):
            children = list(node.items())
        elif isinstance(node, list):
            children = list(enumerate(node))
        elif isinstance(node, str) and len(node) > LONGEST:
            raise ConfigError(
                f"{_short(key)}: found a text of {len(node)} characters, expected at most {LONGEST}."
            )
        if len(children) + len(nodes) + len(waiting) > MOST_VALUES:
            raise ConfigError(
                f"{_short(key or 'the config')}: found {len(children)} values, with which the config has more than"
                f" {MOST_VALUES}; expected fewer."
            )
        waiting += [(f"{key}.{name}" if key else str(name), child, depth + 1) for name, child in children]
    return nodes


def _expanded(
    key: str, nodes: Mapping[str, Any], known: dict[str, tuple[int, int]], around: tuple[str, ...]
) -> tuple[int, int]:
    """How many values, or hundreds of characters, a node becomes, and how deep what it means is."""
    if key in known:
        return known[key]
    if key in around or len(around) > 2 * DEEPEST:
        raise ConfigError(f"{_short(key)}: its interpolations lead back to it, or through too many others.")
    node, own, children = nodes.get(key), 1, []
    if isinstance(node, Mapping):
        children = [f"{key}.{name}" if key else str(name) for name in node]
    elif isinstance(node, list):
        children = [f"{key}.{index}" for index in range(len(node))]
    elif isinstance(node, str):
        own += len(node) // 100
        children = [_absolute(one, key) for one in _REFERENCE.findall(node)]
    inner = [_expanded(child, nodes, known, (*around, key)) for child in children]
    total = own + sum(values for values, _ in inner)
    depth = 1 + max((deep for _, deep in inner), default=0)
    if total > MOST_VALUES or depth > 2 * DEEPEST:
        raise ConfigError(
            f"{_short(key or 'the config')}: means more than {MOST_VALUES} values, or goes through more than"
            f" {2 * DEEPEST} interpolations and sections; expected fewer."
        )
    known[key] = total, depth
    return known[key]


def _absolute(reference: str, key: str) -> str:
    """Full key of `${name}`, or of `${.name}` and `${..name}` as the node at `key` means it."""
    name = reference.lstrip(".")
    up = len(reference) - len(name)
    if not up:
        return name
    parents = key.split(".")[:-up]
    return ".".join([*parents, name] if name else parents)


def _short(key: str) -> str:
    return key if len(key) <= 120 else f"{key[:120]}..."
