"""Characters made of coarse cubes, as voxel editors draw them."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from charnerf.procedural.palette import BLACK, WHITE, Palette, make_palette
from charnerf.procedural.parts import Part, flat
from charnerf.procedural.shapes import box
from charnerf.procedural.textures import Color, darker, mix

Block = NDArray[np.int64]  # (x, y, z) of colour numbers; 0 is empty
Corner = tuple[int, int, int]  # x, y, z, or a width, depth and height, cubes


class Voxels:
    """Named blocks of coloured cubes on one grid; y grows to the back, x to the character's left.

    Args:
        rng: Random numbers of the character.
        palette: Its colours.
    """

    def __init__(self, rng: np.random.Generator, palette: Palette) -> None:
        self.rng = rng
        self.palette = palette
        self._colors: list[Color] = []
        self._blocks: dict[str, tuple[Block, tuple[int, int, int]]] = {}

    def color(self, value: ArrayLike) -> int:
        """Number of a colour."""
        self._colors.append(np.asarray(value, dtype=np.float64))
        return len(self._colors)

    def add(self, name: str, corner: tuple[int, int, int], size: tuple[int, int, int], color: int) -> Block:
        """A block full of one colour; paint or carve it in place."""
        block = np.full(size, color, dtype=np.int64)
        key = name
        while key in self._blocks:
            key += "'"
        self._blocks[key] = (block, corner)
        return block

    def parts(self) -> list[Part]:
        """Boxes of equal colour, as few as merging along x, then z, then y gives.

        A cube that several blocks fill is the last one's: two that share a face would flicker between their colours.
        """
        parts = []
        for key, (block, corner) in self._owned().items():
            for low, high, number in _boxes(block):
                start, end = np.array(corner) + low, np.array(corner) + high
                shape = box(0.5 * (start + end), 0.5 * (end - start))
                parts.append(flat(key.rstrip("'"), shape, self._colors[number - 1]))
        return parts

    def _owned(self) -> dict[str, tuple[Block, tuple[int, int, int]]]:
        """The blocks without the cubes that later ones fill."""
        low = np.min([corner for _, corner in self._blocks.values()], axis=0)
        high = np.max([np.add(corner, block.shape) for block, corner in self._blocks.values()], axis=0)
        taken = np.zeros(high - low, dtype=bool)
        owned = {}
        for key, (block, corner) in reversed(self._blocks.items()):
            place = tuple(
                slice(start, start + size) for start, size in zip(corner - low, block.shape, strict=True)
            )
            owned[key] = (np.where(taken[place], 0, block), corner)
            taken[place] |= block > 0
        return {key: owned[key] for key in self._blocks}


def _boxes(block: Block) -> list[tuple[NDArray[np.int64], NDArray[np.int64], int]]:
    """Cover the cubes of a block by boxes of one colour each: low and high corners, colour number."""
    left = block.copy()
    boxes = []
    for x, y, z in np.argwhere(block > 0):
        number = left[x, y, z]
        if number == 0:
            continue
        end_x = x
        while end_x < left.shape[0] and left[end_x, y, z] == number:
            end_x += 1
        end_z = z
        while end_z < left.shape[2] and (left[x:end_x, y, end_z] == number).all():
            end_z += 1
        end_y = y
        while end_y < left.shape[1] and (left[x:end_x, end_y, z:end_z] == number).all():
            end_y += 1
        left[x:end_x, y:end_y, z:end_z] = 0
        boxes.append((np.array((x, y, z)), np.array((end_x, end_y, end_z)), int(number)))
    return boxes


def _paint_torso(voxels: Voxels, torso: Block, cloth: int) -> None:
    rng, palette = voxels.rng, voxels.palette
    second, accent, leather = (
        voxels.color(value) for value in (palette.second, palette.accent, palette.leather)
    )
    width, _, height = torso.shape
    kind = int(rng.integers(7))
    if kind == 0:
        torso[:, :, ::2] = second
    elif kind == 1:
        torso[width // 2 - 1 : width - width // 2 + 1, 0, :] = second
    elif kind == 2:
        torso[1, 0, :] = torso[-2, 0, :] = accent
    elif kind == 3:
        torso[width // 2 :, :, :] = second
    elif kind == 4:
        torso[width // 2 - 1 : width // 2 + 1, 0, height // 2 : height // 2 + 2] = accent
    elif kind == 5:
        for step in range(height):
            torso[min(step * width // height, width - 1), :, step] = accent
    if rng.uniform() < 0.5:
        torso[:, :, 0] = leather
        torso[width // 2, 0, 0] = accent
    if rng.uniform() < 0.35:
        torso[width // 2 - 1 : width // 2 + 1, -1, 1 : height - 1] = second
    if rng.uniform() < 0.3:
        torso[width // 2 - 1 : width - width // 2 + 1, 0, -1] = voxels.color(palette.skin)
    torso[torso == 0] = cloth


def _paint_face(voxels: Voxels, head: Block) -> None:
    rng, palette = voxels.rng, voxels.palette
    width, _, height = head.shape
    eye = voxels.color(BLACK if rng.uniform() < 0.6 else palette.eyes)
    white, dark = voxels.color(WHITE), voxels.color(darker(mix(palette.skin, (0.5, 0.1, 0.1), 0.5), 0.8))
    level = int(rng.integers(max(1, height // 3), max(2, height // 2 + 1)))
    inset = 1 if width < 7 or rng.uniform() < 0.5 else 2
    tall = 2 if height >= 6 and rng.uniform() < 0.4 else 1
    for column in (inset, width - 1 - inset):
        head[column, 0, level : level + tall] = eye
    if rng.uniform() < 0.3 and inset >= 1:
        head[inset - 1 if inset > 1 else inset + 1, 0, level] = white
        head[width - inset if inset > 1 else width - 2 - inset, 0, level] = white
    if rng.uniform() < 0.6 and level >= 2:
        span = int(rng.integers(0, 2))
        head[width // 2 - 1 - span : width - width // 2 + 1 + span, 0, level - 2] = dark
    if rng.uniform() < 0.2:
        head[:, 0, : max(1, level - 1)] = voxels.color(palette.hair)
    if rng.uniform() < 0.1:
        head[:, 0, level] = np.where(head[:, 0, level] == eye, eye, voxels.color(palette.accent))


def _add_hair(voxels: Voxels, corner: Corner, size: Corner) -> None:
    """Hair, a hat, a helmet or ears over a head."""
    rng, palette = voxels.rng, voxels.palette
    hair, main = (
        voxels.color(palette.hair),
        voxels.color(palette.main if rng.uniform() < 0.5 else palette.accent),
    )
    kind = int(rng.integers(8))
    if kind < 3:
        _add_cut(voxels, corner, size, hair, kind)
    elif kind == 3:
        _add_mohawk(voxels, corner, size, hair)
    elif kind == 4:
        _add_tall_hat(voxels, corner, size, main)
    elif kind == 5:
        _add_cap(voxels, corner, size, main, hair)
    elif kind == 6:
        _add_helmet(voxels, corner, size)
    else:
        _add_ears(voxels, corner, size)


def _add_cut(voxels: Voxels, corner: Corner, size: Corner, hair: int, kind: int) -> None:
    """Hair over the top and back, of kind 2 wider and longer; at times over the sides too."""
    (x, y, z), (width, depth, height), rng = corner, size, voxels.rng
    drop = int(rng.integers(1, height + (2 if kind == 2 else 0)))
    wider = int(kind == 2)
    voxels.add(
        "hair",
        (x - wider, y - (kind != 0), z + height - 1),
        (width + 2 * wider, depth + 1 + (kind != 0), 2),
        hair,
    )
    voxels.add("hair", (x, y + depth, z + height - 1 - drop), (width, 1, drop), hair)
    if kind == 1 or rng.uniform() < 0.4:
        side = int(rng.integers(1, height))
        for column in (x - 1, x + width):
            voxels.add("hair", (column, y + 1, z + height - side), (1, depth, side), hair)


def _add_mohawk(voxels: Voxels, corner: Corner, size: Corner, hair: int) -> None:
    (x, y, z), (width, depth, height) = corner, size
    left = x + width // 2 - 1
    voxels.add("hair", (left, y, z + height), (2, depth + 1, int(voxels.rng.integers(1, 4))), hair)
    voxels.add("hair", (left, y + depth, z + height // 2), (2, 1, height - height // 2), hair)


def _add_tall_hat(voxels: Voxels, corner: Corner, size: Corner, main: int) -> None:
    """A hat with a brim and a band."""
    (x, y, z), (width, depth, height), rng = corner, size, voxels.rng
    brim = int(rng.integers(1, 3))
    voxels.add("hat", (x - brim, y - brim, z + height), (width + 2 * brim, depth + 2 * brim, 1), main)
    tall = int(rng.integers(1, 5))
    crown = voxels.add("hat", (x + 1, y + 1, z + height + 1), (width - 2, max(depth - 2, 1), tall), main)
    crown[:, :, 0] = voxels.color(voxels.palette.second)


def _add_cap(voxels: Voxels, corner: Corner, size: Corner, main: int, hair: int) -> None:
    """A cap with a peak, hair behind."""
    (x, y, z), (width, depth, height) = corner, size
    peak = voxels.color(darker(voxels.palette.main, 0.7))
    voxels.add("hat", (x, y, z + height), (width, depth, 1), main)
    voxels.add("hat", (x, y - 2, z + height - 1), (width, 2, 1), peak)
    voxels.add("hair", (x, y + depth, z + 1), (width, 1, height - 1), hair)


def _add_helmet(voxels: Voxels, corner: Corner, size: Corner) -> None:
    """A helmet that leaves the face free, at times with horns."""
    (x, y, z), (width, depth, height) = corner, size
    metal = voxels.color(voxels.palette.metal)
    low = height // 2
    helmet = voxels.add("helmet", (x - 1, y - 1, z + low), (width + 2, depth + 2, height - low + 1), metal)
    helmet[2:-2, 0, :-2] = 0
    if voxels.rng.uniform() < 0.6:
        horn = voxels.color((0.9, 0.87, 0.78))
        for column in (x - 2, x + width + 1):
            voxels.add("helmet", (column, y + 1, z + height - 1), (1, 1, 3), horn)


def _add_ears(voxels: Voxels, corner: Corner, size: Corner) -> None:
    """Ears on top: thin long ones or wide short ones."""
    (x, y, z), (width, depth, height) = corner, size
    tall = int(voxels.rng.integers(1, 5))
    wider = int(tall < 3)
    skin = voxels.color(voxels.palette.skin)
    for column in (x, x + width - 1 - wider):
        voxels.add("ears", (column, y + depth // 2, z + height), (1 + wider, 1, tall), skin)


def _add_extras(voxels: Voxels, width: int, depth: int, low: int, high: int) -> None:
    """Packs, capes, tails and things in a hand."""
    rng, palette = voxels.rng, voxels.palette
    kind = int(rng.integers(9))
    x = -(width // 2)
    if kind == 0:
        voxels.add(
            "backpack",
            (x + 1, depth, low + 1),
            (width - 2, 2, max(high - low - 1, 1)),
            voxels.color(palette.leather),
        )
    elif kind == 1:
        cape = voxels.add("cape", (x, depth, 1), (width, 1, high - 1), voxels.color(palette.accent))
        cape[:, :, 0] = voxels.color(palette.second)
    elif kind == 2:
        voxels.add("tail", (x + width // 2, depth, low), (1, 2, 1), voxels.color(palette.skin))
        voxels.add("tail", (x + width // 2, depth + 2, low), (1, 1, 3), voxels.color(palette.skin))
    elif kind == 3:
        for side in (x - 2, x + width):
            voxels.add("pauldrons", (side, 0, high - 1), (2, depth, 1), voxels.color(palette.metal))


def make_voxel_parts(rng: np.random.Generator) -> list[Part]:
    """A character of cubes, one unit a cube."""
    surface = ("human", "human", "human", "creature", "robot", "fur")[int(rng.integers(6))]
    voxels = Voxels(rng, make_palette(rng, surface))
    fine = int(rng.integers(1, 3))
    leg_width, leg_height = int(rng.integers(1, 3)) + fine - 1, int(rng.integers(2, 6)) * fine
    width, depth = 2 * int(rng.integers(2, 4)) * fine, int(rng.integers(2, 5)) * fine
    torso_height = int(rng.integers(3, 6)) * fine
    leg_width = min(max(leg_width, width // 4), width // 2)
    palette = voxels.palette
    skin, cloth, trousers, boots = (
        voxels.color(value) for value in (palette.skin, palette.main, palette.trousers, palette.boots)
    )
    _add_legs(voxels, (leg_width, depth, leg_height), width // 2, trousers, boots)
    torso = voxels.add("trunk", (-(width // 2), 0, leg_height), (width, depth, torso_height), cloth)
    _paint_torso(voxels, torso, cloth)
    shoulder = leg_height + torso_height
    arm = min(int(rng.integers(1, 3)) * fine, torso_height)
    _add_arms(voxels, (arm, depth, torso_height), width // 2, shoulder, fine, skin, cloth)
    head_width = max(4, width + 2 * int(rng.integers(-1, 2)) * fine)
    head_size = (
        head_width,
        max(3, depth + int(rng.integers(0, 3)) * fine),
        max(int(rng.integers(3, 6)) * fine, int(0.7 * head_width)),
    )
    head_corner = (-(head_width // 2), (depth - head_size[1]) // 2, shoulder)
    _paint_face(voxels, voxels.add("head", head_corner, head_size, skin))
    _add_hair(voxels, head_corner, head_size)
    _add_extras(voxels, width, depth, leg_height, shoulder)
    return voxels.parts()


def _add_legs(voxels: Voxels, size: Corner, half: int, trousers: int, boots: int) -> None:
    """Legs in boots below a trunk of a half width; size: a leg's width, the trunk's depth, the legs' height."""
    (width, depth, height), rng = size, voxels.rng
    inset = int(rng.integers(0, max(1, half - width + 1)))
    leg_depth = max(1, depth - int(rng.integers(0, 2)))
    front = (depth - leg_depth) // 2
    for name, start in (("left_leg", half - inset - width), ("right_leg", -half + inset)):
        leg = voxels.add(name, (start, front, 0), (width, leg_depth, height), trousers)
        leg[:, :, : max(1, height // 4)] = boots
        if int(rng.integers(0, 2)):
            voxels.add(name, (start, front - 1, 0), (width, 1, 1), boots)


def _add_arms(
    voxels: Voxels, size: Corner, half: int, shoulder: int, fine: int, skin: int, cloth: int
) -> None:
    """Arms in sleeves, held out level or hanging; size: an arm's thickness, the trunk's depth and height."""
    (arm, depth, torso_height), rng = size, voxels.rng
    level = rng.uniform() < 0.5
    reach = int(rng.integers(2, 5)) * fine if level else max(1, torso_height - int(rng.integers(0, 2)))
    sleeve = int(rng.integers(0, reach + 1))
    deep = min(arm, depth) if level else min(depth, arm + 1)
    for name, left in (("left_arm", True), ("right_arm", False)):
        if level:
            corner = (half if left else -half - reach, (depth - deep) // 2, shoulder - arm)
            block = voxels.add(name, corner, (reach, deep, arm), skin)
            block[slice(0, sleeve) if left else slice(reach - sleeve, reach), :, :] = cloth
        else:
            corner = (half if left else -half - arm, 0, shoulder - reach)
            block = voxels.add(name, corner, (arm, deep, reach), skin)
            block[:, :, reach - sleeve :] = cloth
