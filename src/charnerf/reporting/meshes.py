"""The meshes of a run, and one of every row: turned in HTML, from all sides in Markdown."""

from collections.abc import Sequence
from pathlib import Path

from charnerf.reporting.blocks import Block, Heading, Mesh, Picture, SideBySide, Text
from charnerf.reporting.rows import Row

MOST_ROWS = 8  # meshes in one report
MOST_OF_A_RUN = 3


def run_meshes(folder: Path) -> list[Block]:
    """The first meshes that a run wrote, with their sheets; nothing where it wrote none."""
    files = _meshes(folder)
    blocks: list[Block] = [Heading("The mesh" if len(files) == 1 else "Meshes")] if files else []
    for file in files[:MOST_OF_A_RUN]:
        blocks.append(Mesh(file, f"{file.stem}: the mesh, to be turned"))
        sheet = file.with_name(f"{file.stem}_sheet.png")
        if sheet.is_file():
            blocks.append(Picture(sheet, f"{file.stem}: drawings, and the mesh in its colours and as clay"))
    left = len(files) - MOST_OF_A_RUN
    return [*blocks, Text(f"{left} more lie in {files[0].parent.name}/.")] if left > 0 else blocks


def row_meshes(rows: Sequence[Row]) -> list[Block]:
    """One character's mesh by every row's first seed, side by side; nothing where no row wrote one."""
    by_row = {row.label: {file.stem: file for file in _meshes(row.runs[0].folder)} for row in rows}
    by_row = {label: files for label, files in by_row.items() if files}
    if not by_row:
        return []
    names = [name for files in by_row.values() for name in files]
    name = max(names, key=names.count)  # the one that most rows have, of these the first
    meshes = [Mesh(files[name], label) for label, files in by_row.items() if name in files]
    blocks: list[Block] = [Heading(f"The mesh of {name} by every row"), SideBySide(meshes[:MOST_ROWS])]
    left = len(rows) - len(meshes[:MOST_ROWS])
    return (
        [*blocks, Text(f"{left} of {len(rows)} rows are not shown: no such mesh, or no room.")]
        if left
        else blocks
    )


def _meshes(folder: Path) -> list[Path]:
    """Meshes of a run, those by level of detail aside."""
    return [file for file in sorted((folder / "meshes").glob("*.glb")) if "_LOD" not in file.stem]
