"""Our data sets in nerfstudio's own parser, where that is installed: `pip install nerfstudio --no-deps`, and what it imports."""

from pathlib import Path

import pytest
import torch

from charnerf.data.characters import CharacterPictures, load_character, write_character
from charnerf.geometry.cameras import pixel_centres, pixel_rays
from support import foreign_sets as sets


@pytest.mark.parametrize("own_lenses", [False, True])
def test_rays_are_the_same(own_lenses: bool, tmp_path: Path) -> None:
    parser = pytest.importorskip("nerfstudio.data.dataparsers.nerfstudio_dataparser")
    cameras = sets.around()
    if own_lenses:  # intrinsics of each frame's own
        cameras = sets.with_focal(cameras, torch.linspace(40.0, 60.0, 8))
    images = torch.stack([torch.from_numpy(one) for one in sets.pictures(cameras)]).numpy()
    written = CharacterPictures(cameras[3:], images[3:], cameras[:3], images[:3], ("front", "side", "back"))
    folder = write_character(tmp_path, "hero", written)
    config = parser.NerfstudioDataParserConfig(
        data=folder, orientation_method="none", center_method="none", auto_scale_poses=False, eval_mode="all"
    )
    theirs = config.setup().get_dataparser_outputs("train")
    hero = load_character(tmp_path, "hero")
    assert [file.name for file in theirs.image_filenames] == [file.name for file in hero.image_files]
    for index in range(5):
        rays = theirs.cameras.generate_rays(camera_indices=index, keep_shape=True)
        ours = pixel_rays(hero.cameras[index], pixel_centres(sets.SIZE, sets.SIZE))
        torch.testing.assert_close(rays.origins, ours.origins, atol=1e-5, rtol=0)
        torch.testing.assert_close(rays.directions, ours.directions, atol=1e-5, rtol=0)
