"""The rest pose, or an action at a frame."""

from typing import Any

import bpy

from charnerf.blender.inside.refusal import Refused


def set_pose(action_name: str | None, frame: float) -> None:
    """Bring the scene into a pose.

    Args:
        action_name: None for the rest pose: armatures at rest, nothing animated, shape keys as they are set.
        frame: Of the action.

    Raises:
        Refused: If there is no such action or frame.
    """
    owners = [*bpy.data.objects, *bpy.data.shape_keys]
    used = [_used_actions(owner) for owner in owners]
    for owner in owners:
        if owner.animation_data is not None:
            owner.animation_data.action = None
            owner.animation_data.use_nla = False
    for armature in bpy.data.armatures:
        armature.pose_position = "REST" if action_name is None else "POSE"
    if action_name is None:
        return
    action = _action(action_name, frame)
    players = [
        (owner, actions[action.name])
        for owner, actions in zip(owners, used, strict=True)
        if action.name in actions
    ]
    for owner, slot in players or [(each, None) for each in bpy.data.objects if each.type == "ARMATURE"]:
        data = owner.animation_data_create()
        data.action = action
        if hasattr(data, "action_slot") and data.action_slot is None:  # actions have slots since 4.4
            data.action_slot = slot or next(iter(data.action_suitable_slots), None)
    bpy.context.scene.frame_set(int(frame // 1), subframe=frame % 1)


def _action(name: str, frame: float) -> bpy.types.Action:
    action = bpy.data.actions.get(name)
    if action is None:
        there = [f"{each.name} ({_frames(each)})" for each in sorted(bpy.data.actions, key=lambda a: a.name)]
        raise Refused(
            f"has no action {name!r} (--pose ACTION:FRAME); there are {', '.join(there) or 'none, so --pose rest'}"
        )
    first, last = action.frame_range
    if not first <= frame <= last:
        raise Refused(f"has no frame {frame:g} in action {name!r}, expected one of {_frames(action)}")
    return action


def _frames(action: bpy.types.Action) -> str:
    first, last = action.frame_range
    return f"{first:g} to {last:g}"


def _used_actions(owner: bpy.types.ID) -> dict[str, Any]:
    """Names of the actions that move an object or shape keys, and their slots."""
    data = owner.animation_data
    if data is None:
        return {}
    used = {
        strip.action.name: getattr(strip, "action_slot", None)
        for track in data.nla_tracks
        for strip in track.strips
        if strip.action is not None
    }
    if data.action is not None:
        used[data.action.name] = getattr(data, "action_slot", None)
    return used
