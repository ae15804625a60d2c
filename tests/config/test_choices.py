"""What a group may be set to: one option, or a list of different ones where the group takes a list."""

import pytest
from omegaconf import DictConfig

from charnerf.config.composition import compose_config
from charnerf.config.grid import config_hash, grid_command
from charnerf.errors import ConfigError
from charnerf.training.cells import cell_folder


def compose_smoke(*overrides: str) -> DictConfig:
    return compose_config(["scale=smoke", *overrides])


@pytest.mark.parametrize(
    "chosen", [[], ["mirror"], ["recolor", "mirror"], ["stretch", "mirror", "recolor", "drawing"]]
)
def test_augmentation_is_the_list_that_was_typed(chosen: list[str]) -> None:
    assert list(compose_smoke(f"augmentation=[{','.join(chosen)}]").augmentation) == chosen


def test_an_option_of_a_list_is_set_by_its_name() -> None:
    cfg = compose_smoke("augmentation=[stretch,mirror]", "augmentation.mirror.share=0.25")
    assert cfg.augmentation.mirror.share == 0.25
    assert list(compose_smoke("experiment=charnerf").augmentation) == []
    assert list(compose_smoke("experiment=charnerf", "augmentation=mirror").augmentation) == ["mirror"]


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("augmentation=[mirror,zzz]", "augmentation: found no option 'zzz', expected one of: drawing, mirror"),
        ("augmentation=[mirror,1]", "augmentation: found no option '[mirror,1]', expected one of: "),
        ("augmentation=null", "augmentation: found no option 'null', expected one of: "),
        ("augmentation=[mirror,recolor,mirror]", "augmentation: found 'mirror' 2 times, expected each option "),
        ("augmentation.drawing.share=1", "augmentation.drawing: found {'share': 1} (dict), expected a section with "),
        ("augmentation.mirror.shares=1", "augmentation.mirror.shares: charnerf.data.augmentation.mirror.Mirror "),
        ("encoder=[single,double]", "encoder: found no option '[single,double]', expected one of: double, "),
    ],
)  # fmt: skip
def test_what_a_group_can_not_be_set_to_is_named(override: str, message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        compose_smoke(override)
    assert str(caught.value).startswith(message)


def test_the_order_of_a_list_makes_another_config() -> None:
    one, other = (compose_smoke(f"augmentation=[{names}]") for names in ("recolor,mirror", "mirror,recolor"))
    assert config_hash(one) != config_hash(other)
    assert config_hash(one) == config_hash(compose_smoke())


def test_a_grid_over_lists_has_a_folder_and_cells(tmp_path) -> None:
    grid = grid_command(["-m", "augmentation=[],[recolor,mirror]", "seed=0,1"])
    assert grid is not None
    assert grid.folder.name.startswith("augmentation+seed-")
    folder = cell_folder(tmp_path, compose_smoke(), "augmentation-[recolor,mirror]+seed-0")
    assert folder.name.startswith("augmentation-[recolor,mirror]+seed-0-")
