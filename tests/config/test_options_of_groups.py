"""One option of a group by itself takes what it shares from another section, and the rest from the YAML."""

import pytest

from charnerf.config.composition import compose_config
from charnerf.config.options import option, options_of
from charnerf.errors import ConfigError


def test_an_option_like_another_section() -> None:
    cfg = compose_config(["scale=smoke", "renderer=culled", "renderer.memory_mib=100"])
    adaptive = option("renderer", "adaptive", like=cfg.renderer)
    composed = compose_config(["scale=smoke", "renderer=adaptive", "renderer.memory_mib=100"])
    assert adaptive == composed.renderer
    assert option("renderer", "culled", like=composed.renderer) == cfg.renderer


def test_an_option_alone_is_its_file() -> None:
    assert options_of("trainer") == ["auto", "cpu", "ddp", "gpu"]
    assert option("trainer", "cpu") == {"_target_": "lightning.Trainer", "accelerator": "cpu", "devices": 1}


def test_an_option_that_is_not_there_is_named() -> None:
    with pytest.raises(ConfigError, match=r"renderer: found no option 'adaptiv'; did you mean 'adaptive'\?"):
        option("renderer", "adaptiv")
