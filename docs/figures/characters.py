"""The real characters of `docs/characters.csv`: how many in each split and under each licence, and whom to credit."""

from collections import Counter

from docs.figures.sources import markdown, read

CHARACTERS = "docs/characters.csv"
LICENCES = {
    "CC0-1.0": "https://creativecommons.org/publicdomain/zero/1.0/",
    "Unlicense/CC0": "https://unlicense.org",
    "CC-BY-4.0": "https://creativecommons.org/licenses/by/4.0/",
    "CC-BY-3.0": "https://creativecommons.org/licenses/by/3.0/",
    "CC-BY-2.0": "https://creativecommons.org/licenses/by/2.0/",
    "CC-BY": "https://creativecommons.org/licenses/",
    "MIT": "https://opensource.org/license/mit",
    "BSD-3-Clause": "https://opensource.org/license/bsd-3-clause",
    "Apache-2.0": "https://www.apache.org/licenses/LICENSE-2.0",
}


def characters() -> list[dict[str, str]]:
    """All characters, by column."""
    header, *rows = read(CHARACTERS)
    return [dict(zip(header, row, strict=True)) for row in rows]


def splits() -> str:
    """Characters and families by split, with the digest of the split's source views."""
    every = characters()
    rows = []
    for split, digest in read("docs/digests.csv")[1:]:
        inside = [one for one in every if one["split"] == split]
        rows.append([split, len(inside), len({one["family"] for one in inside}), f"`{digest}`"])
    return markdown(["split", "characters", "families", "digest"], rows)


def licences() -> str:
    """How many characters stand under each licence, most first."""
    counts = Counter(one["licence"] for one in characters())
    rows = [[f"[{name}]({LICENCES[name]})", count] for name, count in counts.most_common()]
    return markdown(["licence", "characters"], rows)


def credits() -> str:
    """Authors whose licence asks for credit, with their characters."""
    by_author: dict[str, list[str]] = {}
    for one in characters():
        if one["licence"].startswith("CC-BY"):
            by_author.setdefault(f"{one['author']} ({one['licence']})", []).append(one["character"])
    return "\n".join(f"- {author}: {', '.join(names)}" for author, names in by_author.items())
