"""Meshes of a glTF document in the pose that its nodes have: morph weights and skins become plain positions."""

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from charnerf.errors import DataError
from charnerf.surfaces.gltf_document import GltfDocument


def pose_meshes(document: GltfDocument) -> None:
    """Give every skinned or morphed node of the scene a mesh of its own that needs neither.

    The joints of a skin say where its vertices are in the scene; the skinned node's own place does not count, so that its
    mesh becomes a root.
    """
    tree = document.tree
    nodes, meshes = tree.get("nodes", []), tree.get("meshes", [])
    scene = tree["scenes"][tree.get("scene", 0)]
    places: dict[int, np.ndarray] | None = None
    for index in _reached(nodes, scene.get("nodes", [])):
        node = nodes[index]
        if "mesh" not in node:
            continue
        mesh = meshes[node["mesh"]]
        weights = np.array(node.get("weights", mesh.get("weights", ())), dtype=np.float64)
        skin = tree["skins"][node["skin"]] if "skin" in node else None
        if skin is None and not weights.any():
            continue
        bones = None
        if skin is not None:
            places = places if places is not None else _places(nodes)
            bones = _bones(document, skin, places)
        primitives = [_posed(document, each, weights, bones) for each in mesh["primitives"]]
        meshes.append({**mesh, "primitives": primitives})
        if skin is None:
            node["mesh"] = len(meshes) - 1
            continue
        del node["mesh"], node["skin"]
        nodes.append({"mesh": len(meshes) - 1, "name": f"{node.get('name', index)} skinned"})
        scene["nodes"] = [*scene["nodes"], len(nodes) - 1]


def _reached(nodes: list[dict[str, Any]], roots: list[int]) -> list[int]:
    """Nodes of the trees under the roots, each after its parent."""
    reached, waiting = [], list(roots)
    while waiting:
        reached.append(waiting.pop())
        waiting += nodes[reached[-1]].get("children", [])
    return reached


def _places(nodes: list[dict[str, Any]]) -> dict[int, np.ndarray]:
    """World from node (4, 4) of all nodes, joints outside the scene among them."""
    parents = {child: index for index, node in enumerate(nodes) for child in node.get("children", [])}
    places: dict[int, np.ndarray] = {}
    for index in _reached(nodes, [index for index in range(len(nodes)) if index not in parents]):
        own = _matrix(nodes[index])
        places[index] = places[parents[index]] @ own if index in parents else own
    return places


def _matrix(node: dict[str, Any]) -> np.ndarray:
    """Parent from node."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    matrix = np.eye(4)
    rotation = Rotation.from_quat(node.get("rotation", (0.0, 0.0, 0.0, 1.0))).as_matrix()
    matrix[:3, :3] = rotation * np.array(node.get("scale", (1.0, 1.0, 1.0)), dtype=np.float64)
    matrix[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return matrix


def _bones(document: GltfDocument, skin: dict[str, Any], places: dict[int, np.ndarray]) -> np.ndarray:
    """World from mesh of every joint (J, 4, 4)."""
    worlds = np.stack([places[joint] for joint in skin["joints"]])
    if "inverseBindMatrices" not in skin:
        return worlds
    inverse_binds = document.accessor(skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
    return worlds @ inverse_binds[: len(worlds)].astype(np.float64)


def _posed(
    document: GltfDocument, primitive: dict[str, Any], weights: np.ndarray, bones: np.ndarray | None
) -> dict[str, Any]:
    """The primitive with its positions morphed and skinned; its normals, which do not follow, are left out."""
    attributes = dict(primitive["attributes"])
    positions = document.accessor(attributes["POSITION"]).astype(np.float64)
    for weight, target in zip(weights, primitive.get("targets", []), strict=False):
        if weight and "POSITION" in target:
            positions += weight * document.accessor(target["POSITION"])
    if bones is not None:
        positions = _skinned(positions, bones, *_influences(document, attributes))
    kept = {name: index for name, index in attributes.items() if name.startswith(("TEXCOORD_", "COLOR_"))}
    posed = {key: value for key, value in primitive.items() if key != "targets"}
    return {**posed, "attributes": {"POSITION": document.add_accessor(positions), **kept}}


def _influences(document: GltfDocument, attributes: dict[str, int]) -> tuple[np.ndarray, np.ndarray]:
    """Joints, integers (n, 4 sets), and weights that add up to 1."""
    sets = sum(name.startswith("JOINTS_") for name in attributes)
    if not sets:
        raise DataError("a skinned mesh has no JOINTS_0; export it again.")
    joints = np.concatenate(
        [document.accessor(attributes[f"JOINTS_{index}"]) for index in range(sets)], axis=1
    )
    weights = np.concatenate(
        [document.accessor(attributes[f"WEIGHTS_{index}"]) for index in range(sets)], axis=1
    )
    total = weights.sum(axis=1, keepdims=True, dtype=np.float64)
    weights = np.where(total > 0.0, weights / np.where(total > 0.0, total, 1.0), np.eye(weights.shape[1])[0])
    return joints.astype(np.int64), weights


def _skinned(positions: np.ndarray, bones: np.ndarray, joints: np.ndarray, weights: np.ndarray) -> np.ndarray:
    if joints.max(initial=0) >= len(bones):
        raise DataError(f"a vertex follows joint {joints.max()} of {len(bones)}; export it again.")
    moved = np.zeros_like(positions)
    for joint, weight in zip(joints.T, weights.T, strict=True):
        bone = bones[joint]
        moved += weight[:, None] * (np.einsum("nij,nj->ni", bone[:, :3, :3], positions) + bone[:, :3, 3])
    return moved
