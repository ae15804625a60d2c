"""Marks around figures: `<!-- figures: KIND ARGUMENT ... -->`, then what that kind writes, then `<!-- end -->`.

A kind that writes several lines gets blank lines around them; one that writes a word stays within its sentence.
"""

import re
import shlex
from collections.abc import Callable, Mapping

Kind = Callable[..., str]

_MARKED = re.compile(r"<!-- figures: (?P<call>.+?) -->(?P<old>.*?)<!-- end -->", re.DOTALL)
_CODE = re.compile(r"^```.*?^```|^ {4}[^\n]*|`[^`\n]+`", re.DOTALL | re.MULTILINE)
_UNITS = "dB|mm|cm|ms|s|seconds?|min|minutes?|h|hours?|MiB|MB|GB|GFLOP/s|times"
_TYPED = re.compile(rf"\d+(?:[.,]\d+)* ?%|\d+\.\d+ (?:{_UNITS})\b|\d+ (?:dB|ms|MiB|MB|GB|times)\b")


def written(text: str, kinds: Mapping[str, Kind]) -> str:
    """A page with every figure written anew.

    Args:
        text: Markdown.
        kinds: What writes each kind of figure, by name; each gets the mark's arguments as texts.

    Raises:
        ValueError: If a mark is not closed, or names no kind.
    """
    if len(_MARKED.findall(text)) != text.count("<!-- figures:"):
        raise ValueError("found a mark without its end, expected '<!-- end -->' after each.")

    def write(found: re.Match[str]) -> str:
        name, *arguments = shlex.split(found["call"])
        if name not in kinds:
            raise ValueError(f"found the mark '{found['call']}', expected one of {', '.join(kinds)} first.")
        new = kinds[name](*arguments)
        new = f"\n\n{new}\n\n" if "\n" in new else new
        return f"<!-- figures: {found['call']} -->{new}<!-- end -->"

    return _MARKED.sub(write, text)


def typed(text: str) -> list[str]:
    """Measured figures that stand outside of marks and code: decimals with a unit, shares, decibels, ratios."""
    return _TYPED.findall(_CODE.sub("", _MARKED.sub("", text)))
