"""`charnerf mesh`: the mesh of a character of a data set, its levels of detail, or a split's meshes measured."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from charnerf.cli.dataset import GivenDataset, dataset_options
from charnerf.cli.messages import say
from charnerf.cli.model import load_model
from charnerf.cli.options import (
    Device,
    Folder,
    Symmetric,
    Trusted,
    Weights,
    gathered,
    is_count,
    mesh_options,
)
from charnerf.files import check_folder
from charnerf.meshing.options import MeshOptions

if TYPE_CHECKING:
    from charnerf.data.characters import Character
    from charnerf.inference.hero import Hero

MEASURED_FACES = 8000  # of a split's meshes, unless --faces says otherwise


Name = Annotated[
    str | None,
    typer.Option("--character", metavar="NAME", help="Character of the data set; this or --split."),
]
Split = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        help="All characters of a split, and DIR/meshes.md: what meshes and each kind of colours are worth.",
    ),
]
Grids = Annotated[
    str | None,
    typer.Option("--lod", metavar="N,N,..", help="A mesh for each of these grids, in place of --resolution."),
]
Faces = Annotated[
    str | None,
    typer.Option(
        metavar="N[,N..]",
        help="Faces after decimation; all if left out. With several numbers, or with --lod, further meshes.",
    ),
]
Convergence = Annotated[
    bool,
    typer.Option(
        "--convergence",
        help="Also measure how many cameras are needed, and show levels beside the chosen one: DIR/NAME_cameras.md.",
    ),
]
Format = Annotated[
    Literal["glb", "gltf", "obj", "ply", "stl", "usdz"],
    typer.Option("--format", help="File format; usdz needs the extra `usd`."),
]


@gathered(data=dataset_options, mesh=mesh_options(MeshOptions()))
def command(
    *,
    data: GivenDataset,
    output: Folder,
    character: Name = None,
    split: Split = None,
    weights: Weights = None,
    mesh: MeshOptions,
    lod: Grids = None,
    faces: Faces = None,
    convergence: Convergence = False,
    symmetric: Symmetric = False,
    suffix: Format = "glb",
    device: Device = "auto",
    trust: Trusted = None,
) -> None:
    """Make the mesh of a character of a data set: DIR/NAME.glb, metres, and a contact sheet.

    Several levels of detail are DIR/NAME_LOD0.glb (the finest) and so on; their table is printed and
    written to DIR/lods.md and DIR/lods.json.
    """
    if (character is None) == (split is None):
        raise typer.BadParameter("expected one of the two.", param_hint="--character, --split")
    from charnerf.meshing.lod import lod_table
    from charnerf.reconstruction.meshes import write_convergence, write_lods, write_mesh

    grids, counts = _numbers(lod, "--lod", least=16), _numbers(faces, "--faces", least=4)
    options = replace(
        mesh, resolution=grids[0] if grids else mesh.resolution, faces=counts[0] if counts else None
    )
    check_folder(output)
    heroes = _heroes(data.opened(), character, split, symmetric, weights, device=device, trust=trust)
    if split is not None:
        _measure(heroes, options, output, split)
    for one, hero in heroes:
        folder = output if split is None else output / one.name
        if lod is None and len(counts) <= 1:
            files = write_mesh(hero, one.name, folder, options, suffix=suffix)
        else:
            grids = grids or (mesh.resolution,)
            files = write_lods(
                hero, one.name, folder, options, resolutions=grids, faces=counts, suffix=suffix
            )
        notes = files.notes
        if convergence:
            notes += write_convergence(hero, one.name, folder, files.built)
        for line in notes if split is None else notes[:1]:
            say(line)
        if split is None and files.lods:
            typer.echo(lod_table(files.lods))


def _heroes(
    data: Path,
    character: str | None,
    split: str | None,
    symmetric: bool,
    weights: Path | None,
    *,
    device: str,
    trust: Sequence[str] | None,
) -> list[tuple["Character", "Hero"]]:
    """The characters that are meshed, encoded."""
    from charnerf.data.characters import load_character
    from charnerf.data.layout import names_of, read_dataset

    names = [character] if character is not None else names_of(read_dataset(data), split or "")
    characters = [load_character(data, name) for name in names]
    model = load_model(weights, device=device, trust=trust)
    heroes = [model.encode_views(one.sources) for one in characters]
    return list(zip(characters, [one.symmetric() for one in heroes] if symmetric else heroes, strict=True))


def _numbers(text: str | None, name: str, *, least: int) -> tuple[int, ...]:
    """Whole numbers of a list such as 64,128,256; none of None.

    Raises:
        typer.BadParameter: If it is no such list, or a number is below the least.
    """
    parts = [] if text is None else [part.strip() for part in text.split(",")]
    if not all(is_count(part, least=least) for part in parts):
        raise typer.BadParameter(
            f"found '{(text or '')[:60]}', expected whole numbers from {least} on, such as 64,128.",
            param_hint=name,
        )
    return tuple(int(part) for part in parts)


def _measure(
    heroes: Sequence[tuple["Character", "Hero"]], options: MeshOptions, output: Path, split: str
) -> None:
    """Write and print OUTPUT/meshes.md, with meshes.json: what meshes and each kind of colors are worth."""
    from charnerf.evaluation.environment import environment
    from charnerf.evaluation.mesh_scores import score_meshes, score_text
    from charnerf.evaluation.timing import process_peak_mib
    from charnerf.files import write_text

    options = replace(options, faces=options.faces or MEASURED_FACES)
    rows = {}
    for character, hero in heroes:
        rows[character.name] = score_meshes(hero.scene, character, options)
        say(f"{character.name}: measured")
    facts = {
        "split": split,
        "grid": options.resolution,
        "faces": options.faces,
        "texels": options.texture_size,
        **environment(heroes[0][1].views.images.device),
        "peak_memory_mib": round(process_peak_mib()),
    }
    text = score_text(rows, facts)
    write_text(output / "meshes.md", text)
    write_text(output / "meshes.json", json.dumps({"facts": facts, "characters": rows}, indent=2) + "\n")
    typer.echo(text, nl=False)
