"""What was found, as one page, as JSON and in lines."""

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from PIL import Image

from charnerf.doctor.finding import Finding
from charnerf.files import write_text
from charnerf.pictures import save_png
from charnerf.reporting.blocks import Block, Bullets, Code, Heading, Picture, Text
from charnerf.reporting.page import to_html

PAGE, NUMBERS, PICTURES = "doctor.html", "doctor.json", "doctor"
MOST_PICTURES = 200  # shown on the page
_LEAST_SIDE = 256  # pixels of a picture on the page


def write_findings(folder: Path, subject: str, findings: Sequence[Finding]) -> Path:
    """Write doctor.html, which needs no other file, and doctor.json.

    Args:
        folder: Where to.
        subject: What was examined.
        findings: What is wrong with it.

    Returns:
        The page.
    """
    pictures = _save_pictures(folder, findings)
    entries = [
        {
            **{key: getattr(one, key) for key in ("fault", "where", "found", "expected", "fix", "command")},
            "broken": one.is_broken,
            "picture": str(path.relative_to(folder)) if path else None,
        }
        for one, path in zip(findings, pictures, strict=True)
    ]
    summary = {"subject": subject, "broken": sum(one.is_broken for one in findings), "findings": entries}
    write_text(folder / NUMBERS, json.dumps(summary, indent=1) + "\n")
    blocks: list[Block] = [Heading(f"charnerf doctor: {subject}", 1), Text(verdict(findings), lead=True)]
    for one, path in zip(findings, pictures, strict=True):
        blocks += [
            Heading(f"{one.fault}{'' if one.is_broken else ' (note)'}"),
            Bullets([f"where: {one.where}", f"found: {one.found}", f"expected: {one.expected}"]),
            Text(one.fix),
        ]
        blocks += [Code(one.command)] if one.command else []
        blocks += [Picture(path, one.where)] if path else []
    write_text(folder / PAGE, to_html("charnerf doctor", blocks))
    return folder / PAGE


def verdict(findings: Sequence[Finding]) -> str:
    """How many faults of which kind there are."""
    if not findings:
        return "Nothing is wrong."
    broken = sum(one.is_broken for one in findings)
    kinds = ", ".join(
        f"{fault} ({count})" for fault, count in Counter(one.fault for one in findings).most_common()
    )
    return f"{broken} faults, {len(findings) - broken} notes: {kinds}."


def _save_pictures(folder: Path, findings: Sequence[Finding]) -> list[Path | None]:
    """Files of the findings' pictures, small ones enlarged."""
    paths: list[Path | None] = []
    for index, one in enumerate(findings):
        if one.picture is None or index >= MOST_PICTURES:
            paths.append(None)
            continue
        picture = Image.fromarray(one.picture)
        factor = -(-_LEAST_SIDE // max(picture.size))
        if factor > 1:
            picture = picture.resize(
                (picture.width * factor, picture.height * factor), Image.Resampling.NEAREST
            )
        path = folder / PICTURES / f"{index:03d}.png"
        save_png(path, picture)
        paths.append(path)
    return paths
