"""The skeleton: where joints are in a body, and how a stance moves what hangs on them (linear blend skinning)."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from charnerf.geometry.stances import Stance, arm_directions, leg_direction
from charnerf.people.assets import RIG, WEIGHTS, Assets
from charnerf.people.polygons import GroupedMesh

_LIMBS = {  # between which joints a bone's limb lies, whose direction the stance gives
    "clavicle": ("upperarm", "lowerarm"),
    "upperarm": ("upperarm", "lowerarm"),
    "lowerarm": ("lowerarm", "hand"),
    "thigh": ("thigh", "foot"),
}
_COLLAR = 0.25  # share of an arm's turn that the collar bone takes
_SPINE, _HEAD = ("spine_01", "spine_02", "spine_03"), ("neck_01", "head")


@dataclass(frozen=True)
class Rig:
    """A skeleton for the base mesh.

    Attributes:
        bones: Names, parents before children.
        parents: Index of each bone's parent; -1 for the root.
        joints: Vertices of the base mesh whose mean is each bone's head.
        weights: Shares of the bones in every vertex, float32 (n, bones); a row's sum is 1.
    """

    bones: tuple[str, ...]
    parents: tuple[int, ...]
    joints: tuple[np.ndarray, ...]
    weights: np.ndarray

    def shares(self, *prefixes: str) -> np.ndarray:
        """Share (n,) of the bones whose names begin so."""
        return self.weights[:, [bone.startswith(prefixes) for bone in self.bones]].sum(axis=1)


def read_rig(assets: Assets, base: GroupedMesh) -> Rig:
    """The rig of game engines that comes with the base mesh.

    Raises:
        KeyError: If it names a bone or a joint that is not there.
        ValueError: If a vertex hangs on no bone.
    """
    described: dict[str, Any] = assets.json(RIG)
    described = described.get("bones", described)
    bones: list[str] = []

    def add(bone: str) -> None:
        if bone not in bones:
            parent = described[bone]["parent"]
            if parent:
                add(parent)
            bones.append(bone)

    for bone in described:
        add(bone)
    weights = np.zeros((len(base.vertices), len(bones)), np.float32)
    for bone, entries in assets.json(WEIGHTS)["weights"].items():
        for vertex, weight in entries:
            weights[int(vertex), bones.index(bone)] += weight
    sums = weights.sum(axis=1, keepdims=True)
    if not (sums > 0.0).all():
        raise ValueError(f"{int((sums <= 0.0).sum())} vertices hang on no bone")
    weights /= sums
    parents = tuple(
        bones.index(described[bone]["parent"]) if described[bone]["parent"] else -1 for bone in bones
    )
    return Rig(tuple(bones), parents, tuple(_joint(described[bone]["head"], base) for bone in bones), weights)


def _joint(head: dict[str, Any], base: GroupedMesh) -> np.ndarray:
    """Vertices whose mean is a joint."""
    if head["strategy"] == "CUBE":
        cube = np.unique(base.faces[base.group(head["cube_name"])])
        if not len(cube):
            raise KeyError(head["cube_name"])
        return cube
    return np.atleast_1d(head["vertex_index"] if head["strategy"] == "VERTEX" else head["vertex_indices"])


def posed_bones(rig: Rig, vertices: np.ndarray, stance: Stance) -> np.ndarray:
    """Transforms (bones, 4, 4) that bring a body into a stance.

    Args:
        rig: The skeleton.
        vertices: Of the body as modelled, (n, 3), MakeHuman's frame.
        stance: The pose.
    """
    joints = {bone: vertices[of].mean(axis=0) for bone, of in zip(rig.bones, rig.joints, strict=True)}
    transforms: dict[str, np.ndarray] = {}
    for bone, parent in zip(rig.bones, rig.parents, strict=True):
        before = transforms[rig.bones[parent]] if parent >= 0 else np.eye(4)
        local = np.eye(4)
        local[:3, :3] = _turn(bone, joints, before[:3, :3], stance)
        local[:3, 3] = joints[bone] - local[:3, :3] @ joints[bone]
        transforms[bone] = before @ local
    return np.stack(list(transforms.values()))


def skinned(points: np.ndarray, weights: np.ndarray, transforms: np.ndarray) -> np.ndarray:
    """Points (n, 3) moved by transforms (bones, 4, 4) in the shares of weights (n, bones)."""
    blended = np.tensordot(weights.astype(np.float64), transforms, axes=1)
    return np.einsum("nij,nj->ni", blended[:, :3, :3], points) + blended[:, :3, 3]


def _turn(bone: str, joints: dict[str, np.ndarray], before: np.ndarray, stance: Stance) -> np.ndarray:
    """Rotation of a bone about its head, after which come those of its ancestors (3, 3)."""
    limb, _, end = bone.rpartition("_")
    index = {"l": 0, "r": 1}.get(end)
    if index is not None and limb in _LIMBS:
        sign, (start, stop) = (1.0, -1.0)[index], _LIMBS[limb]
        upper, lower = arm_directions(stance.arms[index], sign)
        way = {"lowerarm": lower, "thigh": leg_direction(stance.legs[index], sign)}.get(limb, upper)
        turn = _between(joints[f"{stop}_{end}"] - joints[f"{start}_{end}"], before.T @ _from_world(way))
        return turn if limb != "clavicle" else _part_of(turn, _COLLAR)
    if limb == "foot":
        return before.T  # feet stay level
    if bone in _SPINE:
        lean = _about(2, -stance.lean) if bone == _SPINE[0] else np.eye(3)
        return lean @ _about(1, stance.twist / len(_SPINE))
    return _about(1, 0.5 * stance.look) if bone in _HEAD else np.eye(3)


def _from_world(vector: np.ndarray) -> np.ndarray:
    """MakeHuman's axes (+Y up, facing +Z) of a vector of the world (+Z up, facing -Y)."""
    return np.array((vector[0], vector[2], -vector[1]))


def _about(axis: int, angle_deg: float) -> np.ndarray:
    """Right-handed rotation about one of MakeHuman's axes."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    turn, angle = np.eye(3), np.radians(angle_deg)
    turn[first, first] = turn[second, second] = np.cos(angle)
    turn[first, second], turn[second, first] = -np.sin(angle), np.sin(angle)
    return turn


def _between(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """The smallest rotation that turns a direction into another."""
    a, b = start / np.linalg.norm(start), end / np.linalg.norm(end)
    cosine = float(np.clip(a @ b, -0.999, 1.0))
    x, y, z = np.cross(a, b)
    cross = np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))
    return np.eye(3) + cross + cross @ cross / (1.0 + cosine)


def _part_of(turn: np.ndarray, share: float) -> np.ndarray:
    """A rotation by a share of a rotation's angle."""
    return Rotation.from_rotvec(share * Rotation.from_matrix(turn).as_rotvec()).as_matrix()
