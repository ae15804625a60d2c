"""`charnerf mesh`: the mesh of a character of a data set, its levels of detail, or a split's meshes measured."""

import json
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from charnerf.cli.completion import characters, splits
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
from charnerf.cli.summary import JsonFile, Summary, check_json, close, show
from charnerf.files import check_folder
from charnerf.meshing.options import MeshOptions, Texture
from charnerf.reconstruction.options import LIGHT
from charnerf.wording import counted

if TYPE_CHECKING:
    from charnerf.data.characters import Character
    from charnerf.inference.hero import Hero
    from charnerf.reconstruction.meshes import MeshFiles

EXAMPLES = (
    "charnerf mesh --data characters --character anna -o out",
    "charnerf mesh outputs/run --data characters --character anna -o out --lod 64,128 --faces 2000,8000",
    "charnerf mesh --data characters --split test -o out",
)


Name = Annotated[
    str | None,
    typer.Option(
        "--character",
        metavar="NAME",
        autocompletion=characters,
        help="Character of the data set; this or --split.",
    ),
]
Split = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        autocompletion=splits,
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
        metavar="N[,N..]|all",
        help=f"Faces after decimation, or all; {LIGHT.faces} if left out, with --lod none. With several numbers, or with --lod,"
        " further meshes.",
    ),
]
Convergence = Annotated[
    bool,
    typer.Option(
        "--convergence",
        help="Also measure how many cameras are needed: DIR/NAME_cameras.md.",
    ),
]
Format = Annotated[
    Literal["glb", "gltf", "obj", "ply", "stl", "usdz"],
    typer.Option("--format", help="File format; usdz needs the extra `usd`."),
]


SomeColors = Annotated[
    Texture | None,
    typer.Option(
        "--texture",
        help="Colours, as of reconstruct: a texture from the drawings, by the field, or at vertices; drawings if left out, vertex"
        " where all faces are kept or the format carries no texture.",
    ),
]


@dataclass(frozen=True)
class Plan:
    """Which meshes are made of a character.

    Attributes:
        grids: Of levels of detail; empty where one grid is enough.
        counts: Faces that are asked for.
        first: Faces of a single mesh; None keeps all.
    """

    grids: tuple[int, ...]
    counts: tuple[int, ...]
    first: int | None

    @property
    def has_levels(self) -> bool:
        """Whether there are several meshes."""
        return bool(self.grids) or len(self.counts) > 1


def plan_options(*, lod: Grids = None, faces: Faces = None) -> Plan:
    """What --lod and --faces ask for."""
    grids = _numbers(lod, "--lod", least=16)
    if faces == "all":
        return Plan(grids, (), None)
    counts = _numbers(faces, "--faces", least=4)
    if len(counts) > 1 or grids:
        return Plan(grids, counts, None)
    return Plan(grids, counts, counts[0] if counts else LIGHT.faces)


@gathered(data=dataset_options, mesh=mesh_options(MeshOptions()), plan=plan_options)
def command(
    *,
    data: GivenDataset,
    output: Folder,
    character: Name = None,
    split: Split = None,
    weights: Weights = None,
    mesh: MeshOptions,
    plan: Plan,
    texture: SomeColors = None,
    convergence: Convergence = False,
    symmetric: Symmetric = False,
    suffix: Format = "glb",
    device: Device = "auto",
    trust: Trusted = None,
    json_file: JsonFile = None,
) -> None:
    """Make the mesh of a character of a data set: DIR/NAME.glb, metres, and a contact sheet.

    Several levels of detail are DIR/NAME_LOD0.glb (the finest) and so on; their table is printed and
    written to DIR/lods.md and DIR/lods.json.
    """
    if (character is None) == (split is None):
        raise typer.BadParameter("expected one of the two.", param_hint="--character, --split")
    from charnerf.meshing.export import check_format

    began = time.perf_counter()
    check_format(f".{suffix}")
    check_json(json_file)
    check_folder(output)
    options = _options(mesh, plan, texture, suffix)
    heroes = _heroes(data.opened(), character, split, symmetric, weights, device=device, trust=trust)
    if split is not None:
        show(_measure(heroes, options, output, split).rstrip("\n"), json_file)
    written: list[Path] = []
    for one, hero in heroes:
        folder = output if split is None else output / one.name
        files = _write(hero, one.name, folder, options, plan, suffix, json_file)
        notes = files.notes + (_converged(hero, one.name, folder) if convergence else ())
        for line in notes if split is None else notes[:1]:
            say(line)
        written += [*files.meshes, files.sheet]
    close(
        Summary(
            made=counted(len(heroes), "character's mesh", "characters' meshes"), files=written, began=began
        ),
        json_file,
    )


def _options(mesh: MeshOptions, plan: Plan, texture: Texture | None, suffix: str) -> MeshOptions:
    """How a single mesh, or the first level, is made."""
    from charnerf.meshing.export import TEXTURED_SUFFIXES

    if texture is None:
        has_texture = plan.first is not None and f".{suffix}" in TEXTURED_SUFFIXES
        texture = LIGHT.texture if has_texture else "vertex"
    resolution = plan.grids[0] if plan.grids else mesh.resolution
    return replace(mesh, resolution=resolution, faces=plan.first, texture=texture)


def _write(
    hero: "Hero",
    name: str,
    folder: Path,
    options: MeshOptions,
    plan: Plan,
    suffix: str,
    json_file: Path | None,
) -> "MeshFiles":
    """Write a mesh, or levels of detail with their table, which is shown."""
    from charnerf.meshing.lod import lod_table
    from charnerf.reconstruction.meshes import write_lods, write_mesh

    if not plan.has_levels:
        return write_mesh(hero, name, folder, options, suffix=suffix)
    grids = plan.grids or (options.resolution,)
    files = write_lods(hero, name, folder, options, resolutions=grids, faces=plan.counts, suffix=suffix)
    show(lod_table(files.lods), json_file)
    return files


def _converged(hero: "Hero", name: str, folder: Path) -> tuple[str, ...]:
    """Lines of how many cameras a mesh needs."""
    from charnerf.reconstruction.meshes import write_convergence

    return write_convergence(hero, name, folder)


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
) -> str:
    """Write OUTPUT/meshes.md, which is returned, with meshes.json: what meshes and each kind of colors are worth."""
    from charnerf.evaluation.environment import environment
    from charnerf.evaluation.mesh_scores import score_meshes, score_text
    from charnerf.evaluation.timing import process_peak_mib
    from charnerf.files import write_text

    options = replace(options, faces=options.faces or LIGHT.faces)
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
    }
    if (peak := process_peak_mib()) is not None:
        facts["peak_memory_mib"] = round(peak)
    text = score_text(rows, facts)
    write_text(output / "meshes.md", text)
    write_text(output / "meshes.json", json.dumps({"facts": facts, "characters": rows}, indent=2) + "\n")
    return text
