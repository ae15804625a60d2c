"""What is wrong with a config, by full key."""

import dataclasses
from collections.abc import Mapping, Sequence


@dataclasses.dataclass
class Problems:
    """Problems found so far, modules whose classes may be named, and keys that repeat another key's value."""

    trusted: tuple[str, ...] = ()
    copies: dict[str, str] = dataclasses.field(default_factory=dict)
    entries: list[tuple[str, str]] = dataclasses.field(default_factory=list)

    def add(self, key: str, message: str) -> None:
        """Note a problem at a full key."""
        if (key, message) not in self.entries:
            self.entries.append((key, message))

    def add_once(self, key: str, message: str) -> None:
        """Note a problem at a full key that has none yet."""
        if not any(one == key for one, _ in self.entries):
            self.entries.append((key, message))

    def touch(self, key: str) -> bool:
        """Whether a key, a part of it or a section around it has a problem."""
        return any(_is_within(one, key) or _is_within(key, one) for one, _ in self.entries)

    def lines(self) -> list[str]:
        """One line for each problem, by full key; a wrong value is named where it was written."""
        wrong = {key for key, _ in self.entries}
        return [
            f"{key}: {message}"
            for key, message in self.entries
            if not any(_is_within(self._origin(key), one) for one in wrong)
        ]

    def _origin(self, key: str) -> str:
        """The key whose value a key repeats; empty where it repeats none."""
        for copy, origin in self.copies.items():
            if _is_within(key, copy):
                return origin + key[len(copy) :]
        return ""


def _is_within(key: str, section: str) -> bool:
    return key == section or key.startswith(f"{section}.")


def differing(there: Mapping[str, object], here: Mapping[str, object], free: Sequence[str] = ()) -> list[str]:
    """Full keys whose settings differ, sorted; those are left out that are `free`, or stand in a section that is."""
    return [
        key
        for key in sorted({*there, *here})
        if there.get(key) != here.get(key)
        and not any(key == one or key.startswith(f"{one}.") for one in free)
    ]


def join(key: str, name: str | int) -> str:
    """Full key of a child."""
    return f"{key}.{name}" if key else str(name)
