"""What colour a material has without light: its shaders' base colour and alpha, as sockets of its own node tree."""

from typing import Any

import bpy

Source = Any  # an output socket, or a constant: a tuple, RGBA or one number

_COLOR_INPUTS = ("Base Color", "Color")
_UNKNOWN = (0.4, 0.4, 0.4, 1.0)  # where a material says nothing


def base_color(material: bpy.types.Material) -> tuple[Source, Source]:
    """Colour and alpha of a material; nodes are added to its tree where shaders are mixed."""
    output = _output(material.node_tree, "OUTPUT_MATERIAL")
    surface = None if output is None else source_of(output.inputs["Surface"])
    if not isinstance(surface, bpy.types.NodeSocket):
        return _UNKNOWN, (1.0,)
    return _of_shader(material.node_tree, surface)


def source_of(socket: bpy.types.NodeSocket) -> Source:
    """Where an input comes from; empty where a shader's input has nothing."""
    while socket.is_linked and not socket.links[0].is_muted:
        socket = socket.links[0].from_socket
        if socket.node.type != "REROUTE":
            return socket
        socket = socket.node.inputs[0]
    value: Any = getattr(socket, "default_value", ())
    return tuple(value) if hasattr(value, "__len__") else (float(value),)


def connect(tree: bpy.types.NodeTree, source: Source, socket: bpy.types.NodeSocket) -> None:
    """Give an input a source."""
    if isinstance(source, bpy.types.NodeSocket):
        tree.links.new(source, socket)
    elif hasattr(socket.default_value, "__len__"):
        socket.default_value = (*source, 1.0)[:4] if len(source) > 1 else (*source * 3, 1.0)
    else:
        socket.default_value = source[0]


def _of_shader(tree: bpy.types.NodeTree, socket: bpy.types.NodeSocket) -> tuple[Source, Source]:
    node = socket.node
    if node.type == "MIX_SHADER":
        return _of_mix(tree, node)
    if node.type == "ADD_SHADER":  # the first that has a colour: the others add light
        sources = [source_of(each) for each in node.inputs]
        shaders = [each for each in sources if isinstance(each, bpy.types.NodeSocket)]
        lit = [each for each in shaders if each.node.type not in ("EMISSION", "BSDF_TRANSPARENT")]
        return _of_shader(tree, (lit or shaders)[0]) if shaders else (_UNKNOWN, (1.0,))
    if node.type == "GROUP" and node.node_tree is not None:
        return _of_group(node, socket)
    if node.type in ("BSDF_TRANSPARENT", "HOLDOUT"):
        return _UNKNOWN, (0.0,)
    colors = [node.inputs[name] for name in _COLOR_INPUTS if name in node.inputs]
    if not colors:
        return _UNKNOWN, (1.0,)
    return source_of(colors[0]), source_of(node.inputs["Alpha"]) if "Alpha" in node.inputs else (1.0,)


def _of_mix(tree: bpy.types.NodeTree, node: bpy.types.Node) -> tuple[Source, Source]:
    """A mix of two shaders: a transparent one gives alpha alone."""
    share = source_of(node.inputs[0])
    if isinstance(share, bpy.types.NodeSocket) and share.node.type == "LIGHT_PATH":  # as a camera sees it
        share = (1.0 if share.name == "Is Camera Ray" else 0.0,)
    (first, first_alpha), (second, second_alpha) = (
        _of_shader(tree, each)
        if isinstance(each := source_of(socket), bpy.types.NodeSocket)
        else (_UNKNOWN, (0.0,))
        for socket in node.inputs[1:3]
    )
    if share in ((0.0,), (1.0,)):
        return (first, first_alpha) if share == (0.0,) else (second, second_alpha)
    if first_alpha == (0.0,):
        color = second
    else:
        color = first if second_alpha == (0.0,) else _mixed(tree, share, first, second)
    alpha = (
        (1.0,) if first_alpha == second_alpha == (1.0,) else _mixed(tree, share, first_alpha, second_alpha)
    )
    if (first_alpha, second_alpha) == ((0.0,), (1.0,)):
        alpha = share
    return color, alpha


def _mixed(tree: bpy.types.NodeTree, share: Source, first: Source, second: Source) -> bpy.types.NodeSocket:
    node = tree.nodes.new("ShaderNodeMix")
    node.data_type = "RGBA"
    sockets = [each for each in node.inputs if each.enabled]  # factor, A, B
    for socket, source in zip(sockets, (share, first, second), strict=True):
        connect(tree, source, socket)
    return next(each for each in node.outputs if each.enabled)


def _of_group(node: bpy.types.Node, socket: bpy.types.NodeSocket) -> tuple[Source, Source]:
    """Colour and alpha of a group's shader, led out of the group by outputs of its own."""
    inner = node.node_tree
    output = _output(inner, "GROUP_OUTPUT")
    index = list(node.outputs).index(socket)
    if output is None:
        return _UNKNOWN, (1.0,)
    surface = source_of(output.inputs[index])
    if not isinstance(surface, bpy.types.NodeSocket) or surface.node.type == "GROUP_INPUT":
        return _UNKNOWN, (1.0,)
    led = []
    for kind, source in zip(("Color", "Float"), _of_shader(inner, surface), strict=True):
        name = f"charnerf {index} {kind}"
        if name not in node.outputs:  # another material may have added it
            if hasattr(inner, "interface"):
                inner.interface.new_socket(name, in_out="OUTPUT", socket_type=f"NodeSocket{kind}")
            else:  # before 4.0
                inner.outputs.new(f"NodeSocket{kind}", name)
            connect(inner, source, output.inputs[name])
        led.append(node.outputs[name])
    return led[0], led[1]


def _output(tree: bpy.types.NodeTree, kind: str) -> bpy.types.Node | None:
    outputs = [node for node in tree.nodes if node.type == kind]
    return next((node for node in outputs if node.is_active_output), None) if outputs else None
