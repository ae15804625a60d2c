"""What the page's form offers, and the plan that it makes; the page draws the form from this alone."""

import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal, get_args

from charnerf.drawings.options import ReadingOptions
from charnerf.drawings.segmenters import NETWORK, PAPER
from charnerf.errors import ConfigError
from charnerf.meshing.options import Texture
from charnerf.reconstruction.options import LIGHT, ReconstructionOptions
from charnerf.reconstruction.progress import mesh_seconds, reconstruction_stages

MOST_LEVELS = 6
FORMATS = 2.0  # seconds
DEFAULT = ReconstructionOptions()


@dataclass(frozen=True)
class Reading:
    """How drawings are read: what crosses to the processes that read them.

    Attributes:
        reconciled: As of `ReadingOptions`.
        keep_ink: As of `ReadingOptions`.
        segmenter: Its name.
    """

    reconciled: bool = ReadingOptions.reconciled
    keep_ink: bool = ReadingOptions.keep_ink
    segmenter: str = PAPER


@dataclass(frozen=True)
class Plan:
    """What is made of a character's drawings.

    Attributes:
        options: Mesh, pictures, refinement.
        reading: How drawings are read.
        levels: Faces of further levels of detail, most first.
    """

    options: ReconstructionOptions
    reading: Reading
    levels: tuple[int, ...]

    @property
    def seconds(self) -> tuple[float, float]:
        """What the character takes, about, and then the files for other programs and the levels."""
        levels = sum(mesh_seconds(replace(self.options.mesh, faces=faces)) for faces in self.levels)
        return sum(reconstruction_stages(self.options).values()), FORMATS + levels


@dataclass(frozen=True)
class Field:
    """One field of the form.

    Attributes:
        name: Of its value.
        label: What the page calls it.
        hint: What it is for.
        kind: number, choice, switch or text.
        default: Its value at first.
        least: Of a number.
        most: Of a number.
        choices: Values and their names, of a choice.
        group: What it belongs to.
    """

    name: str
    label: str
    hint: str
    kind: Literal["number", "choice", "switch", "text"]
    default: Any
    group: str
    least: float = 0
    most: float = 0
    choices: tuple[tuple[str, str], ...] = ()


COLORS = {
    "drawings": "from the drawings",
    "field": "by the field",
    "vertex": "at vertices",
}
FIELDS = (
    Field("resolution", "Resolution", "Points of the grid along the height: more show finer parts and take longer.", "number",
          DEFAULT.mesh.resolution, "Mesh", 32, 256),
    Field("faces", "Faces", "Triangles of the mesh.", "number", LIGHT.faces, "Mesh", 100, 60_000),
    Field("levels", "Levels of detail", "Faces of further, lighter meshes, such as 2000, 500.", "text", "", "Mesh"),
    Field("texture", "Colours", "What paints it: a texture, or colours at vertices.", "choice", DEFAULT.mesh.texture, "Mesh",
          choices=tuple((name, COLORS[name]) for name in get_args(Texture))),
    Field("texture_size", "Texture size", "Texels a side.", "number", DEFAULT.mesh.texture_size, "Mesh", 128, 4096),
    Field("smooth", "Smoothing", "Rounds; 10 evens a frayed surface out.", "number", DEFAULT.mesh.smooth, "Mesh", 0, 100),
    Field("symmetric", "Symmetric", "Averages left and right, for characters that are alike on both sides.", "switch",
          DEFAULT.symmetric, "Mesh"),
    Field("refine", "Refine", "Seconds in which the model is adapted to these drawings first; kept only where it helps.", "number",
          0, "Field and pictures", 0, 600),
    Field("frames", "Turntable frames", "Pictures around the character.", "number", DEFAULT.frames, "Field and pictures", 1, 120),
    Field("size", "Picture size", "Pixels a side of turntable and views.", "number", DEFAULT.size, "Field and pictures", 64, 512),
    Field("segmenter", "Background", "How figures without alpha are told from what lies behind them.", "choice", PAPER, "Drawings",
          choices=((PAPER, "one plain colour"), (NETWORK, "a photo or scene: a network"))),
    Field("as_drawn", "As drawn", "Takes views as they are, also where they disagree.", "switch",
          not ReadingOptions.reconciled, "Drawings"),
    Field("keep_ink", "Keep ink", "Takes lines along outlines for paint.", "switch", ReadingOptions.keep_ink, "Drawings"),
)  # fmt: skip


def form() -> list[dict[str, Any]]:
    """The fields for the page."""
    return [asdict(field) for field in FIELDS]


def read_plan(values: Any) -> Plan:
    """The plan of a filled form; what is not in it stays at its default.

    Raises:
        ConfigError: If a value is out of range or of another kind; the message names its field as the page does.
    """
    if not isinstance(values, Mapping):
        raise ConfigError("settings: found something else, expected values by name. Load the page again.")
    unknown = values.keys() - {field.name for field in FIELDS}
    if unknown:
        raise ConfigError(f"{sorted(unknown)[0][:40]!r}: no such setting. Load the page again.")
    read = {field.name: _value(field, values.get(field.name, field.default)) for field in FIELDS}
    levels = _levels(read["levels"], read["faces"])
    mesh = replace(
        LIGHT,
        resolution=read["resolution"],
        faces=read["faces"],
        texture=read["texture"],
        texture_size=read["texture_size"],
        smooth=read["smooth"],
    )
    options = ReconstructionOptions(
        mesh=mesh,
        frames=read["frames"],
        size=read["size"],
        symmetric=read["symmetric"],
        refine_seconds=float(read["refine"]) if read["refine"] else None,
    )
    reading = Reading(not read["as_drawn"], read["keep_ink"], read["segmenter"])
    return Plan(options, reading, levels)


def _value(field: Field, value: Any) -> Any:
    """A field's value, checked."""
    if field.kind == "switch" and isinstance(value, bool):
        return value
    if field.kind == "choice" and isinstance(value, str) and value in dict(field.choices):
        return value
    if field.kind == "text" and isinstance(value, str) and len(value) <= 100:
        return value
    is_number = field.kind == "number" and isinstance(value, int) and not isinstance(value, bool)
    if is_number and field.least <= value <= field.most:
        return value
    wanted = {
        "number": f"a whole number from {field.least:g} to {field.most:g}",
        "choice": ", ".join(label for _, label in field.choices),
        "switch": "on or off",
        "text": "a short text",
    }
    raise ConfigError(
        f"{field.label}: found {str(value)[:40]!r}, expected {wanted[field.kind]}. Correct it and build again."
    )


def _levels(text: str, faces: int) -> tuple[int, ...]:
    """Faces of the levels, most first."""
    parts = [part for part in re.split(r"[,;\s]+", text.strip()) if part]
    good = all(part.isascii() and part.isdigit() and len(part) <= 6 for part in parts)
    counts = sorted({int(part) for part in parts}, reverse=True) if good else []
    if not good or len(counts) > MOST_LEVELS or (counts and not 50 <= counts[-1] <= counts[0] < faces):
        raise ConfigError(
            f"Levels of detail: found {text[:40]!r}, expected up to {MOST_LEVELS} whole numbers from 50 to fewer than the mesh's"
            f" {faces} faces, such as 2000, 500. Correct it and build again."
        )
    return tuple(counts)
