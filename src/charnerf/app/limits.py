"""What one server takes on."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """What one server takes on.

    Attributes:
        sessions: Pages at once.
        pictures: Of a session.
        upload: Bytes of a picture.
        pixels: Of a picture.
        kept: Characters whose field can be looked at; the one that was made first goes first.
        silence_s: Seconds without a byte of what is being sent after which it is not waited for.
        read_s: Seconds for reading pictures.
        grace_s: Seconds without its page after which a job is cancelled.
        keep_s: Seconds without its page after which a session is forgotten.
    """

    sessions: int = 40
    pictures: int = 12
    upload: int = 32 * 2**20
    pixels: int = 64_000_000
    kept: int = 3
    silence_s: float = 10.0
    read_s: float = 180.0
    grace_s: float = 20.0
    keep_s: float = 1800.0
