"""Numbers in sentences."""


def counted(number: int, one: str, many: str | None = None) -> str:
    """A number with its noun: 1 run, 2 runs; `many` where an s is not enough."""
    return f"{number} {one if number == 1 else many or one + 's'}"


def printable(text: str) -> str:
    """A message as every terminal can show it: half characters and control signs, as names of files hold them, escaped."""
    return "".join(one if one.isprintable() or one in "\n\t" else ascii(one)[1:-1] for one in text)
