"""The scene as it is seen now, as plain meshes: modifiers, poses, shape keys and instances applied."""

import bpy


def flatten(chosen: set[bpy.types.Object]) -> list[bpy.types.Object]:
    """Replace everything in the scene by plain meshes of what is chosen.

    Args:
        chosen: Objects.

    Returns:
        Mesh objects with materials, each where it stood.
    """
    for each in bpy.context.scene.objects:
        _show_as_rendered(each)
    bpy.context.view_layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    made = []
    for instance in depsgraph.object_instances:
        shape, holder = instance.object, instance.parent if instance.is_instance else instance.object
        is_shown = instance.show_self and not shape.original.hide_render
        # curves, texts and metaballs come a second time, as meshes that are their own instances
        if not is_shown or shape.type != "MESH" or holder.original not in chosen:
            continue
        mesh = bpy.data.meshes.new_from_object(shape, preserve_all_data_layers=True, depsgraph=depsgraph)
        if mesh is not None and len(mesh.polygons):
            made.append((shape.name, mesh, instance.matrix_world.copy()))
    for each in list(bpy.data.objects):
        bpy.data.objects.remove(each)
    flats = [_placed(*one) for one in made]
    bpy.context.view_layer.update()
    return flats


def _show_as_rendered(each: bpy.types.Object) -> None:
    """What is evaluated for the screen becomes what is evaluated for pictures."""
    each.hide_viewport = each.hide_render
    if each.name in bpy.context.view_layer.objects:
        each.hide_set(False)
    for modifier in each.modifiers:
        modifier.show_viewport = modifier.show_render
        if modifier.type in ("SUBSURF", "MULTIRES"):
            modifier.levels = modifier.render_levels


def _placed(name: str, mesh: bpy.types.Mesh, matrix: object) -> bpy.types.Object:
    flat = bpy.data.objects.new(name, mesh)
    flat.matrix_world = matrix
    bpy.context.scene.collection.objects.link(flat)
    return flat
