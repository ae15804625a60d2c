"""How drawings are read."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ReadingOptions:
    """What is done to drawings before the model sees them.

    Attributes:
        reconciled: Whether views that disagree are mended; else they are only compared.
        keep_ink: Whether lines along outlines stay, as if they were paint.
    """

    reconciled: bool = True
    keep_ink: bool = False
