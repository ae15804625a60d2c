"""Pictures that stay: predictions as PNG, and one contact sheet a character."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import torch
from PIL import Image, ImageDraw, ImageFont
from torch import Tensor

from charnerf.data.characters import Character
from charnerf.evaluation.angles import view_angles
from charnerf.pictures import on_white, save_png, to_bytes
from charnerf.types import RenderOutput

_SHEET_COLUMNS = 8
_LABEL_WIDTH = 76
_HEADER = 16
_LEAST_WIDTH = 96  # of a picture, pixels
_INK = (60, 60, 60)


def save_prediction(path: Path, prediction: RenderOutput) -> None:
    """Keep a prediction (H, W) as RGBA with straight alpha, so that a metric can be added later."""
    alpha = prediction.opacity[..., None]
    straight = (prediction.rgb - (1.0 - alpha)) / alpha.clamp_min(1.0 / 255.0)
    save_png(path, Image.fromarray(to_bytes(torch.cat((straight, alpha), dim=-1))))


def save_pictures(
    folder: Path,
    character: Character,
    frames: Sequence[int],
    pictures: Mapping[str, Sequence[RenderOutput]],
) -> None:
    """Write the predictions of one character, named as in its data set, and its contact sheet, sheet.png.

    Args:
        folder: Of the character's pictures.
        character: The character.
        frames: Its evaluated frames (n).
        pictures: Predictions (n) by method; "ours" and perhaps "visual_hull", "nearest".
    """
    for index, picture in zip(frames, pictures["ours"], strict=True):
        save_prediction(folder / f"{character.image_files[index].stem}.png", picture)
    save_sheet(folder / "sheet.png", character, frames, pictures)


def depth_picture(prediction: RenderOutput) -> Tensor:
    """Depth (H, W) as grey (H, W, 3): near is dark, far light, nothing white."""
    seen = prediction.opacity > 0.5
    if not bool(seen.any()):
        return torch.ones_like(prediction.rgb)
    near, far = (float(value) for value in torch.aminmax(prediction.depth[seen]))
    grey = 0.1 + 0.75 * (prediction.depth - near) / max(far - near, 1e-3)
    return torch.where(seen, grey, 1.0)[..., None].expand(-1, -1, 3)


def _panels(
    chosen: Sequence[int], images: Tensor, drawn: Mapping[str, Sequence[RenderOutput]]
) -> list[tuple[str, list[Tensor]]]:
    """Rows of the sheet: label and pictures (H, W, 3)."""
    ours = [drawn["ours"][place] for place in chosen]
    rows = [
        ("truth", [on_white(images[place].float() / 255.0) for place in chosen]),
        ("prediction", [picture.rgb for picture in ours]),
    ]
    if "visual_hull" in drawn:
        rows.append(("visual hull", [drawn["visual_hull"][place].rgb for place in chosen]))
    if "nearest" in drawn:
        rows.append(("nearest", [drawn["nearest"][place].rgb for place in chosen]))
    rows.append(("opacity", [1.0 - picture.opacity[..., None].expand(-1, -1, 3) for picture in ours]))
    rows.append(("depth", [depth_picture(picture) for picture in ours]))
    return rows


def save_sheet(
    path: Path,
    character: Character,
    frames: Sequence[int],
    pictures: Mapping[str, Sequence[RenderOutput]],
) -> None:
    """Write a character's contact sheet: its drawings, then truth, prediction, hull, opacity and depth."""
    angles = view_angles(character.cameras[list(frames)], character.sources)
    order = torch.argsort(angles.azimuth_deg).tolist()
    count = min(_SHEET_COLUMNS, len(order))
    chosen = [order[round(step * (len(order) - 1) / max(count - 1, 1))] for step in range(count)]
    scale = -(-_LEAST_WIDTH // character.cameras.width)  # whole: labels need room beside small pictures
    width, height = scale * character.cameras.width, scale * character.cameras.height
    rows = _panels(chosen, character.images(frames), pictures)
    columns = max(count, len(character.source_names))
    size = (_LABEL_WIDTH + columns * width, (len(rows) + 1) * height + 2 * _HEADER)
    sheet = Image.new("RGB", size, "white")
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(11)
    pen.text((4, _HEADER + height // 2), "drawings", _INK, font)
    for place, name in enumerate(character.source_names):
        pen.text((_LABEL_WIDTH + place * width + 4, 1), name, _INK, font)
        source = character.sources.images[0, place].movedim(0, -1)
        shown = Image.fromarray(to_bytes(on_white(source))).resize((width, height))
        sheet.paste(shown, (_LABEL_WIDTH + place * width, _HEADER))
    top = height + _HEADER
    for column, place in enumerate(chosen):
        azimuth, elevation = float(angles.azimuth_deg[place]), float(angles.elevation_deg[place])
        label = f"{azimuth:.0f}°, up {elevation:.0f}°"
        pen.text((_LABEL_WIDTH + column * width + 4, top + 1), label, _INK, font)
    for row, (label, panels) in enumerate(rows):
        y = top + _HEADER + row * height
        pen.text((4, y + height // 2), label, _INK, font)
        for column, picture in enumerate(panels):
            shown = Image.fromarray(to_bytes(picture)).resize((width, height), Image.Resampling.NEAREST)
            sheet.paste(shown, (_LABEL_WIDTH + column * width, y))
    save_png(path, sheet)
