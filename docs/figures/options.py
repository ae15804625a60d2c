"""The config groups and their options, from `conf/`: an option's first comment says what it is."""

from pathlib import Path

import yaml

from docs.figures.sources import ROOT, markdown

CONF = ROOT / "conf"


def groups() -> str:
    """The names of all groups, the defaults' order."""
    return ", ".join(f"`{name}`" for name in _defaults())


def options() -> str:
    """All options of all groups; the defaults are bold."""
    rows = []
    for group, default in _defaults().items():
        for number, file in enumerate(sorted((CONF / group).glob("*.yaml"))):
            name = f"**`{file.stem}`**" if file.stem in default else f"`{file.stem}`"
            rows.append(["" if number else f"`{group}`", name, comment(file)])
    return markdown(["group", "option", "what it is"], rows)


def comment(file: Path) -> str:
    """The comment above an option's first key, in one line.

    Raises:
        ValueError: If there is none.
    """
    lines = []
    for line in file.read_text(encoding="utf-8").splitlines():
        if not line.startswith("#"):
            break
        if not line.startswith("# @package"):
            lines.append(line.removeprefix("#").strip())
    if not lines:
        raise ValueError(f"{file}: found no comment at its top, expected one that says what the option is.")
    return " ".join(lines)


def _defaults() -> dict[str, list[str]]:
    """Groups and their default options."""
    listed = yaml.safe_load((CONF / "train.yaml").read_text(encoding="utf-8"))["defaults"]
    groups = [group for entry in listed if isinstance(entry, dict) for group in entry.items()]
    return {name: chosen if isinstance(chosen, list) else [chosen] for name, chosen in groups}
