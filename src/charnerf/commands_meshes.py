"""What `charnerf mesh --split` does: the meshes of a whole split, measured."""

import json
import sys
from collections.abc import Sequence
from pathlib import Path

from charnerf import commands
from charnerf.data.characters import load_character
from charnerf.data.layout import names_of, read_dataset
from charnerf.evaluation.environment import environment
from charnerf.evaluation.mesh_scores import score_split, score_text
from charnerf.evaluation.timing import process_peak_mib
from charnerf.files import write_text
from charnerf.reconstruction.meshes import MeshRequest, write_meshes


def measure(
    weights: Path | None,
    data: Path,
    split: str,
    output: Path,
    *,
    request: MeshRequest,
    device: str,
    trust: Sequence[str],
) -> None:
    """Write the meshes of a split and OUTPUT/meshes.md: what they and each kind of colours are worth."""
    model = commands.load_model(weights, device=device, trust=trust)
    characters = [load_character(data, name) for name in names_of(read_dataset(data), split)]
    heroes = {one.name: model.encode_views(one.sources) for one in characters}
    faces = request.faces[0] if request.faces else 8000
    rows = score_split(
        lambda character: heroes[character.name].scene,
        characters,
        resolution=request.resolutions[0],
        faces=faces,
        num_cameras=request.num_cameras,
        texture_size=request.texture_size,
        on_done=lambda name: commands.say(f"{name}: measured"),
    )
    for name, hero in heroes.items():
        for line in write_meshes(hero, name, output / name, request).said[:1]:
            commands.say(line)
    setting = {"split": split, "grid": request.resolutions[0], "faces": faces, "texels": request.texture_size}
    facts = {**setting, **environment(model.device), "peak_memory_mib": round(process_peak_mib())}
    text = score_text(rows, facts)
    write_text(output / "meshes.md", text)
    record = {"facts": facts, "characters": rows}
    write_text(output / "meshes.json", json.dumps(record, indent=2) + "\n")
    sys.stdout.write(text)
