"""Picture files, before anything is made of them: whole, 8 bits, sRGB, of the stated size, each shown once."""

import hashlib
import io
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageCms

from charnerf.doctor.finding import Finding
from charnerf.doctor.repairs import rgba_command
from charnerf.doctor.views import View
from charnerf.errors import DataError
from charnerf.pictures import open_picture

SRGB_GAMMA = 0.45455
_PNG = b"\x89PNG\r\n\x1a\n"
_EIGHT_BIT = ("RGB", "RGBA", "L", "LA", "P", "PA")
DEPTH_AGAIN = "charnerf capture MESH -o DATASET --split SPLIT --depth"
_DEPTH = ("I;16", "I;16B", "I")


def picture_findings(file: Path, size: tuple[int, int]) -> tuple[np.ndarray | None, list[Finding]]:
    """A picture (H, W, 4) uint8, None where it can not be read, and what is wrong with its file.

    Args:
        file: The picture.
        size: Width and height that are stated, (0, 0) where none are.
    """
    try:
        with open_picture(file) as picture:
            findings = list(_kind(file, picture))
            if findings:
                return None, findings
            findings = list(_colors(file, picture))
            if size not in ((0, 0), picture.size):
                stored = f"{picture.size[0]} x {picture.size[1]}"
                findings.append(
                    Finding(
                        "unequal sizes", str(file), f"{stored} pixels", f"{size[0]} x {size[1]} as its camera file says",
                        "Resize the picture, or correct w, h, fl_x, fl_y, cx and cy of its frame.",
                    )
                )  # fmt: skip
            return np.array(picture.convert("RGBA")), findings
    except (OSError, SyntaxError, ValueError, EOFError, Image.DecompressionBombError) as error:
        found = (
            str(error)
            if isinstance(error, DataError)
            else f"{file.stat().st_size if file.exists() else 0} bytes, {error}"
        )
        fix = "Copy it again, or capture the character again."
        return None, [Finding("truncated file", str(file), found, "a picture that opens whole", fix)]


def read_depth(file: Path) -> tuple[np.ndarray | None, list[Finding]]:
    """A depth picture (H, W), millimetres, None where it can not be read, and what is wrong with its file."""
    try:
        with open_picture(file) as picture:
            if picture.mode in _DEPTH:
                return np.array(picture), []
            found = f"mode {picture.mode}"
    except (OSError, SyntaxError, ValueError) as error:
        expected, fix = "a picture that opens whole", "Capture the character again."
        return None, [Finding("truncated file", str(file), str(error), expected, fix)]
    expected, fix = "16-bit grey, millimetres", "Capture it again."
    return None, [Finding("wrong bit depth", str(file), found, expected, fix, DEPTH_AGAIN)]


def duplicates(views: Sequence[View], pictures: Sequence[np.ndarray]) -> Iterator[Finding]:
    """Target pictures of one content, and target cameras of one pose, under two names."""
    contents: dict[str, int] = {}
    poses: dict[bytes, int] = {}
    for index, (view, picture) in enumerate(zip(views, pictures, strict=True)):
        if view.is_source:
            continue
        same = contents.setdefault(hashlib.sha256(picture.tobytes()).hexdigest(), index)
        if same != index:
            yield Finding(
                "duplicated view", str(view.file), f"the same pixels as {views[same].file.name}", "another view",
                "Leave one of the two out, or restore the picture that belongs there.", picture=picture[..., :3],
            )  # fmt: skip
            continue
        there = poses.setdefault(np.round(view.matrix, 6).tobytes(), index)
        if there != index:
            yield Finding(
                "duplicated view", str(view.file), f"the pose of {views[there].file.name} and another picture", "a pose of its own",
                "One of the two poses is wrong: write it anew.",
            )  # fmt: skip


def _kind(file: Path, picture: Image.Image) -> Iterator[Finding]:
    """Bits of a channel: PNG says them in its header, which Pillow hides for 16-bit colours."""
    with file.open("rb") as raw:
        head = raw.read(26)
    bits = head[24] if head.startswith(_PNG) and len(head) > 24 else 8
    if picture.mode in _EIGHT_BIT and bits in (8, 4, 2, 1) and (bits == 8 or picture.mode in ("P", "PA")):
        return
    yield Finding(
        "wrong bit depth", str(file), f"{bits} bits a channel, mode {picture.mode}", "8 bits a channel, RGB or RGBA",
        "Write it with 8 bits.", rgba_command(file),
    )  # fmt: skip


def _colors(file: Path, picture: Image.Image) -> Iterator[Finding]:
    """Colours that are not sRGB's: readers of data sets take bytes as they are."""
    profile, gamma = picture.info.get("icc_profile"), picture.info.get("gamma")
    if profile:
        name = _profile_name(profile)
        if "srgb" not in name.lower():
            yield Finding(
                "colour profile",
                str(file),
                f"the profile {name!r}",
                "sRGB",
                "Convert it to sRGB.",
                rgba_command(file),
            )
    elif gamma and abs(float(gamma) - SRGB_GAMMA) > 0.01 and "srgb" not in picture.info:
        yield Finding(
            "colour profile",
            str(file),
            f"gamma {float(gamma):.3g}",
            "sRGB",
            "Write it as sRGB, without a gamma.",
            rgba_command(file),
        )


def _profile_name(profile: bytes) -> str:
    try:
        return ImageCms.getProfileDescription(ImageCms.ImageCmsProfile(io.BytesIO(profile))).strip()
    except (ImageCms.PyCMSError, OSError, TypeError) as error:
        return f"unreadable: {error}"
