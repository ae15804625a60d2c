"""Files of any format into Blender's scene, and nothing that is not theirs: no script runs, no picture from elsewhere."""

from collections.abc import Callable, Iterator
from pathlib import Path

import bpy

from charnerf.blender.inside.refusal import Refused

_NO_COLLADA = (
    "Blender {version} reads no Collada (it was taken out of 5.0): put an older `blender` on PATH, "
    "or save the character as FBX or GLB"
)
_NO_IMPORTER = "Blender {version} has no importer for {suffix}; use the wheel, bpy 5.0 or later"
_OPERATORS = {  # of bpy.ops, the first that this Blender has
    ".fbx": (("wm", "fbx_import"), ("import_scene", "fbx")),
    ".obj": (("wm", "obj_import"), ("import_scene", "obj")),
    ".dae": (("wm", "collada_import"),),
}


def open_file(file: Path) -> list[str]:
    """Make a file's content the scene.

    Returns:
        What is to be said about it.

    Raises:
        Refused: If it can not be read, or needs other files than its own.
    """
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.preferences.filepaths.use_scripts_auto_execute = False  # the module's default is to run them
    try:
        _importer(file.suffix.lower())(str(file))
    except RuntimeError as err:  # what operators report
        raise Refused(
            f"can not be read by Blender {bpy.app.version_string} ({_one_line(err)}); export it again"
        ) from err
    linked = sorted({library.filepath for library in bpy.data.libraries})
    if linked:
        raise Refused(
            f"links to other files ({', '.join(linked)}); make everything local (Object > Relations > Make Local)"
        )
    pictures = {
        bpy.path.abspath(image.filepath) for image in bpy.data.images
    }  # `check_pictures` looks at those that are used
    outside = sorted(
        path
        for path in set(bpy.utils.blend_paths(absolute=True, packed=False)) - pictures
        if Path(path).exists() and not _is_in(Path(path), file.parent)
    )
    if outside:
        raise Refused(f"uses files outside its folder ({', '.join(outside)}); put them there, or pack them")
    return ["its scripts and scripted drivers were not run"] if bpy.app.autoexec_fail else []


def _importer(suffix: str) -> Callable[[str], object]:
    if suffix == ".blend":
        return lambda path: bpy.ops.wm.open_mainfile(filepath=path, load_ui=False, use_scripts=False)
    if suffix in (".glb", ".gltf", ".vrm"):
        return lambda path: bpy.ops.import_scene.gltf(filepath=path, guess_original_bind_pose=False)
    found = [each for group, name in _OPERATORS[suffix] if (each := _operator(group, name)) is not None]
    if not found:
        advice = _NO_COLLADA if suffix == ".dae" else _NO_IMPORTER
        raise Refused(advice.format(version=bpy.app.version_string, suffix=suffix))
    return lambda path: found[0](filepath=path)


def _operator(group: str, name: str) -> Callable[..., object] | None:
    """An operator of bpy.ops, if this Blender has it."""
    return getattr(getattr(bpy.ops, group), name) if name in dir(getattr(bpy.ops, group)) else None


def _one_line(err: Exception) -> str:
    """What an operator reports: its first line, the last of a traceback."""
    lines = [line.strip() for line in str(err).splitlines() if line.strip()]
    if not lines:
        return type(err).__name__
    return lines[-1] if "Traceback" in lines[0] else lines[0].removeprefix("Error: ")


def check_pictures(material: bpy.types.Material, folder: Path, most_pixels: int) -> None:
    """Check that pictures of a material are packed or lie in a folder, where they are looked for by their names too.

    Raises:
        Refused: If one is missing, lies elsewhere or is too large.
    """
    for image in _pictures(material.node_tree):
        name = f"material {material.name!r}: picture {image.filepath or image.name!r}"
        if image.source != "GENERATED" and image.packed_file is None and not image.packed_files:
            written = bpy.path.abspath(image.filepath)
            beside = folder / written.replace("\\", "/").rsplit("/", 1)[-1]
            own = next((path for path in (Path(written), beside) if _is_in(path, folder)), None)
            if own is None:
                raise Refused(
                    f"{name} is not in the file's folder; put it there, or pack it (File > External Data)"
                )
            if str(own) != written:
                image.filepath = str(own)
        width, height = image.size  # loads it
        if not width * height:
            raise Refused(f"{name} can not be read; save it again as PNG")
        if width * height > most_pixels:
            raise Refused(f"{name} has {width} x {height} pixels, expected at most {most_pixels} in all")


def _pictures(tree: bpy.types.NodeTree) -> Iterator[bpy.types.Image]:
    for node in tree.nodes:
        if node.type in ("TEX_IMAGE", "TEX_ENVIRONMENT") and node.image is not None:
            yield node.image
        elif node.type == "GROUP" and node.node_tree is not None:
            yield from _pictures(node.node_tree)


def _is_in(path: Path, folder: Path) -> bool:
    """Whether a file is there and in a folder, links followed."""
    try:
        return path.is_file() and path.resolve().is_relative_to(folder.resolve())
    except (OSError, ValueError):
        return False
