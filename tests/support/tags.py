"""Tags of TensorBoard that docs/watching.md promises."""

import re
from pathlib import Path

PAGE = Path(__file__).resolve().parents[2] / "docs" / "watching.md"
ANY = {"TERM": r"\w+", "MEASURE": r"\w+", "VIEW": r"[\w ]+", "NAME": r"\w+", "N": r"\d+"}


def promised_tags() -> dict[str, re.Pattern[str]]:
    """Tags of the page's table, and what each stands for."""
    rows = re.findall(r"^\| (`.*?) \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    tags = [tag for row in rows for tag in re.findall(r"`([^`]+)`", row)]
    words = "|".join(rf"\b{word}\b|(?<=_){word}$" for word in ANY)
    return {tag: re.compile(re.sub(words, lambda word: ANY[word[0]], tag)) for tag in tags}
