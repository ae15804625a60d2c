import numpy as np
import pytest
import torch
from PIL import Image

from charnerf.errors import DataError
from charnerf.reporting.real_drawings import drawn_views, find_drawings


def draw(path, *, arm="left", alpha=True):
    """A figure with one arm, on nothing or on white."""
    rgba = np.zeros((120, 100, 4), dtype=np.uint8)
    rgba[10:110, 40:60] = (200, 40, 40, 255)
    rgba[30:40, 15 : 40 if arm == "left" else 15] = (40, 40, 200, 255)
    if not alpha:
        rgba[rgba[..., 3] == 0] = 255
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(rgba).save(path)
    return path


def test_drawings_are_found_by_their_names(tmp_path):
    draw(tmp_path / "hero" / "front.png")
    draw(tmp_path / "hero" / "side.png")
    draw(tmp_path / "gopher" / "gopher-front.png")
    draw(tmp_path / "gopher" / "gopher-side_color.png")
    draw(tmp_path / "crowd" / "one_texture.png")
    draw(tmp_path / "crowd" / "one_mask.png")
    draw(tmp_path / "loose.png")
    (tmp_path / "notes.txt").write_text("licences")
    found = {one.name: sorted(one.files) for one in find_drawings(tmp_path)}
    assert found == {
        "loose": ["front"],
        "one": ["front"],
        "gopher": ["front", "side"],
        "hero": ["front", "side"],
    }


def test_two_pictures_of_one_view_are_refused(tmp_path):
    draw(tmp_path / "hero" / "front.png")
    draw(tmp_path / "hero" / "front-old.png")
    with pytest.raises(DataError, match="expected one front view"):
        find_drawings(tmp_path)


def test_a_folder_without_pictures_is_refused(tmp_path):
    with pytest.raises(DataError, match="found no drawings"):
        find_drawings(tmp_path)


def test_a_missing_back_is_the_mirrored_front(tmp_path):
    draw(tmp_path / "hero" / "front.png")
    views, told = drawn_views(find_drawings(tmp_path)[0], 32)
    assert told == "drawn: front"
    assert views.images.shape == (1, 3, 4, 32, 32)
    front, side, back = views.images[0]
    assert 0 < side[3].sum() < front[3].sum()
    torch.testing.assert_close(back, front.flip(-1), atol=0.02, rtol=0.0)
    assert (front[3, :, :16].sum() - front[3, :, 16:].sum()).abs() > 5.0  # the arm is on one side
    towards = views.cameras.world_from_camera[0, :, :3, 2]
    torch.testing.assert_close(
        towards, torch.tensor([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), atol=1e-6, rtol=0.0
    )


def test_a_mask_beside_a_picture_is_its_alpha(tmp_path):
    path = draw(tmp_path / "kid_texture.png", alpha=False)
    alone, _ = drawn_views(find_drawings(tmp_path)[0], 32)
    rgba = np.array(Image.open(path).convert("RGBA"))
    mask = (rgba[..., :3].min(-1) < 255).astype(np.uint8) * 255
    mask[:, :40] = 0  # cuts the arm off
    Image.fromarray(mask).save(tmp_path / "kid_mask.png")
    masked, _ = drawn_views(find_drawings(tmp_path)[0], 32)
    width, whole = (int((views.images[0, 0, 3] > 0.5).any(0).sum()) for views in (masked, alone))
    assert width < 0.7 * whole
