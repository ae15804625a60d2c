"""What is wrong with a config, by full key."""

import dataclasses


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
