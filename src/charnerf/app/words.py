"""Sentences of other rooms in the page's words: there, options are typed; here, they have names and buttons."""

import re
from pathlib import Path

_SAID = (  # what a command line says, and what the page does
    (r"(If it (?:looks the other way|does)), say --side (\w+), or of a sheet --figure \w+=N\.", r"\1, call it \2."),
    (r"or take --segmenter rembg\.", "or set Background to a network (Options, Drawings) and add it again."),
    (r"--segmenter(?: rembg)?: ", "The network for backgrounds: "),
    (r"Install it: pip", "Whoever runs this page can install it: pip"),
    (r"Give it alone, as `charnerf reconstruct SHEET -o DIR`, or crop", "Crop"),
    (r"--refine 30 adapts", "Refine (30 seconds) adapts"),
    (r"--symmetric,", "Symmetric,"),
    (r"--smooth 10 evens", "Smoothing (10) evens"),
    (r"--view back=FILE, or right=FILE for the other side:", "A drawing of the back, or of the other side:"),
    (r"; --as-drawn takes the others alone", "; “As drawn” takes the others alone"),
    (r"say --view (\d+)=FILE in its place, or of a sheet --figure \d+=N: a side", r"call it \1 degrees: a side"),
    (r" \(--keep-ink leaves them\)", " (“Keep ink” leaves them)"),
    (r"give the same command again\.", "try again."),
    (r" \(docs/\w+\.md\)", ""),
    (r": crop it to the views of one character, or give them one by one with --view\.", ": crop it to the views of one character."),
    (r"Install it by `pip install 'charnerf\[usd\]'`, or choose \.glb\.",
     "Whoever runs this page can install it: pip install 'charnerf[usd]'."),
)  # fmt: skip


def page_words(text: str, folder: Path) -> str:
    """A sentence as the page says it: without options, and with files by the names that they came with.

    Args:
        text: The sentence.
        folder: The session's; each picture lies in a folder of its own in there.
    """
    text = re.sub(rf"{re.escape(str(folder))}/(\d+/)?", "", text)
    for said, shown in _SAID:
        text = re.sub(said, shown, text, flags=re.DOTALL)
    return text
