"""How a foreign data set is read: what a user says of it."""

from dataclasses import dataclass

from charnerf.errors import ConfigError


@dataclass(frozen=True)
class Reading:
    """What is taken for what.

    Attributes:
        front: Number of the view that is the front, counted from 0 in the order of the set's files; its camera then stands at
            azimuth 0. None: the view that is nearest to a level one at the set's own -Y.
        side: Number of the view from the character's left; None: the nearest to azimuth 90.
        back: Number of the view from behind; None: the nearest to azimuth 180.
        keep_frame: Whether poses stay as they are, neither turned upright nor brought to 2 m.
        size: Side of the square that every picture is brought to, pixels.
    """

    front: int | None = None
    side: int | None = None
    back: int | None = None
    keep_frame: bool = False
    size: int = 128

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            ConfigError: If one is out of range, or two views are one.
        """
        for name, value in self.views.items():
            if value is not None and value < 0:
                raise ConfigError(f"{name}: found {value}, expected the number of a view, 0 or more.")
        given = [value for value in self.views.values() if value is not None]
        if len(set(given)) != len(given):
            raise ConfigError(f"front, side, back: found {self.views}, expected different views.")
        if not 8 <= self.size <= 4096:
            raise ConfigError(f"size: found {self.size}, expected 8 to 4096 pixels.")

    @property
    def views(self) -> dict[str, int | None]:
        """Numbers of the source views by name, in their order."""
        return {"front": self.front, "side": self.side, "back": self.back}
