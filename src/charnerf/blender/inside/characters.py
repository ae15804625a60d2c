"""Which objects of a scene are the character."""

from collections.abc import Iterable, Sequence

import bpy

from charnerf.blender.inside.refusal import Refused

SHAPES = frozenset({"MESH", "CURVE", "SURFACE", "FONT", "META", "CURVES"})


def choose(names: Sequence[str]) -> set[bpy.types.Object]:
    """Objects that are captured: all that renders, or what hangs on the objects and collections that are named.

    Raises:
        Refused: If there is no shape, a name is not there, or several armatures ask for a choice.
    """
    shown = [each for each in bpy.context.scene.objects if not each.hide_render]
    if not names:
        figures = sorted({armature.name for each in shown for armature in _armatures(each)})
        if len(figures) > 1:
            raise Refused(
                f"holds {len(figures)} figures ({', '.join(figures)}); choose by --object NAME, more than once for several"
            )
        chosen = set(shown)
    else:
        chosen = {one for name in names for one in _named(name)}
    if not any(each.type in SHAPES or each.instance_type == "COLLECTION" for each in chosen):
        raise Refused(
            f"has no shape to capture{' in ' + ', '.join(names) if names else ''}; {_what_is_there()}"
        )
    return chosen


def _named(name: str) -> set[bpy.types.Object]:
    """An object or the objects of a collection, and all that is below them or follows their armatures."""
    collection = bpy.data.collections.get(name)
    if name in bpy.context.scene.objects:
        roots: Iterable[bpy.types.Object] = (bpy.context.scene.objects[name],)
    elif collection is not None:
        roots = collection.all_objects
    else:
        raise Refused(f"has no object or collection {name!r}; {_what_is_there()}")
    below = {one for root in roots for one in (root, *root.children_recursive)}
    return below | {
        each for each in bpy.context.scene.objects if any(one in below for one in _armatures(each))
    }


def _armatures(shape: bpy.types.Object) -> list[bpy.types.Object]:
    """Armatures that move a shape."""
    if shape.type not in SHAPES:
        return []
    return [
        modifier.object for modifier in shape.modifiers if modifier.type == "ARMATURE" and modifier.object
    ]


def _what_is_there() -> str:
    objects = sorted(
        each.name
        for each in bpy.context.scene.objects
        if each.parent is None and any(one.type in SHAPES for one in (each, *each.children_recursive))
    )
    collections = sorted(each.name for each in bpy.data.collections if each.all_objects)
    return f"there are the objects {', '.join(objects) or 'none'}, the collections {', '.join(collections) or 'none'}"
