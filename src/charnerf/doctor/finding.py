"""One thing that is wrong, with its evidence."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Finding:
    """What is wrong, where, how that shows, and what mends it.

    Attributes:
        fault: Kind of fault, a few words in lower case, such as `mirrored picture`.
        where: The file, and the key in it, or the character.
        found: The evidence: what was measured or read.
        expected: What would be right.
        fix: What to do.
        command: A command that does it; empty where no command can.
        picture: RGB uint8 (H, W, 3) that shows it, or None.
        is_broken: Whether results would be wrong; else it is worth knowing only.
    """

    fault: str
    where: str
    found: str
    expected: str
    fix: str
    command: str = ""
    picture: np.ndarray | None = None
    is_broken: bool = True

    def line(self) -> str:
        """The finding in one sentence."""
        return f"{self.fault}: {self.where}: found {self.found}, expected {self.expected}. {self.fix}"
