"""A few bytes that mean millions of values are refused at once, by their key."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from omegaconf import OmegaConf

from charnerf.config import validate
from charnerf.config.bounds import LARGEST, check_values, check_yaml
from charnerf.config.command_line import check_command_line
from charnerf.config.composition import compose_config
from charnerf.config.foreign import read_yaml
from charnerf.config.overrides import jobs_of, parse_overrides
from charnerf.errors import ConfigError, DataError
from support.work import little_work

LAUGHS = "a0: &a0 [x, x]\n" + "".join(
    f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]\n" for n in range(1, 30)
)


@pytest.fixture(autouse=True)
def _at_once() -> Iterator[None]:
    with little_work():
        yield


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (LAUGHS, "values, expected fewer"),
        ("a: &a [*a]", "refers to what is around it"),
        ("a: &a {<<: *a}", "refers to what is around it"),
        ("m0: &m0 {k: 1}\n" + "".join(f"m{n}: &m{n} {{<<: [{', '.join([f'*m{n - 1}'] * 9)}]}}\n" for n in range(1, 30)), "values"),
        ("[" * 500 + "]" * 500, "within each other"),
        ("a: [" + "1, " * 100_000 + "1]", "more than 20000 values"),
        ("a: " + "x" * 20_000, "characters"),
        ("# " + "x" * 2_000_000, "bytes"),
        ("a: " + "9" * 5000, "4300 digits"),
        ("a: 2001-99-99", "month"),
        ("? [1, 2]\n: 3", "unhashable"),
        ("a: \x00", "can not be read"),
        ("a: !!python/object/apply:os.system [ls]", "could not determine a constructor"),
    ],
)  # fmt: skip
def test_yaml_that_explodes_is_refused(content: str, problem: str, tmp_path: Path) -> None:
    file = tmp_path / "config.yaml"
    file.write_text(content)
    with pytest.raises(DataError, match=problem):
        read_yaml(file)


def test_anchors_of_ordinary_size_are_read(tmp_path: Path) -> None:
    check_yaml(b"a: &a {b: 1}\nc: *a\nd: {<<: *a, e: 2}\n", "x.yaml")


@pytest.mark.parametrize(
    ("config", "key"),
    [
        ({"a0": "x", **{f"a{n}": f"${{a{n - 1}}}${{a{n - 1}}}" for n in range(1, 40)}}, "a"),
        ({"a0": [1, 2], **{f"a{n}": [f"${{a{n - 1}}}"] * 9 for n in range(1, 20)}}, "a"),
        ({**{f"a{n}": f"${{a{n - 1}}}" for n in range(1, 1000)}, "a0": 1}, "a"),
        ({f"a{n}": f"${{a{n + 1}}}" for n in range(1000)}, "a"),
        ({"a": "${b}", "b": "${a}"}, "[ab]"),
        ({"a": {"b": "${a}"}}, "a"),
        ({"a": {"b": "${..a}"}}, "a"),
        ({"a": list(range(1_000_000))}, "a"),
        ({"a": "x" * 100_000}, "a"),
    ],
)
def test_interpolations_and_lists_that_explode_are_refused(config: dict, key: str) -> None:
    with pytest.raises(ConfigError, match=rf"^({key}\d*(\.\w+)*|the config): "):
        check_values(config)


def test_sizes_that_no_machine_has_are_refused() -> None:
    """All in one message: a config takes a third of a second to compose."""
    overrides = (
        *("encoder.depth=1000000", "encoder.coarse_stacks=1000000", "scale.image_size=1000000000"),
        *("model.width=1000000", "model.num_multi_view_blocks=100000", "model.image_size=1000000000"),
        *("data.views=1000000000", "data.train=1000000000", "scale.eval_views=1000000000"),
        *("renderer.num_coarse=1000000000", "renderer.memory_mib=1000000000000", "head.hidden=1000000000"),
        *("batches.workers=100000", "validation.views=1000000000", "scale.phase_rays=[1000000000,1]"),
        *("seed=1" + "0" * 100, "+schedule.phases.0.square=1000000000"),
    )
    with pytest.raises(ConfigError) as caught:
        compose_config(["scale=smoke", *overrides])
    _, *lines = str(caught.value).splitlines()
    assert len(lines) == len(overrides) + 1  # schedule.phases.0.rays refers to scale.phase_rays
    for override in overrides:
        key = override.partition("=")[0].removeprefix("+")
        (line,) = (one for one in lines if re.match(rf"  {re.escape(key)}(\.\d)?: ", one))
        assert re.search(r": found .*, expected at most ", line), line


def test_every_count_of_a_part_has_a_bound() -> None:
    sizes = {"lr_scale", "seed"}  # whose size costs nothing
    for options in ([], ["combinator=view_mha", "encoder=single", "views=front"], ["experiment=pixelnerf"]):
        cfg = compose_config(options)
        for section in OmegaConf.to_container(cfg, resolve=True).values():
            if isinstance(section, dict):
                for name, value in section.items():
                    if type(value) is int and name not in sizes | {"devices"}:
                        assert name in LARGEST, name


def test_overrides_and_sweeps_that_explode_are_refused() -> None:
    for override in ("a=[" + "0," * 100_000 + "0]", "a=" + "[" * 1000, "a=" + "${" * 1000):
        with pytest.raises(ConfigError, match=r"^a: found .* characters"):
            parse_overrides([override])
    with pytest.raises(ConfigError, match=r"^seed: with it the sweep has more than"):
        jobs_of(["seed=range(0,1000000000)"])
    with pytest.raises(ConfigError, match=r"^b: with it the sweep has more than"):
        jobs_of([f"a={','.join(map(str, range(200)))}", f"b={','.join(map(str, range(200)))}"])
    assert len(jobs_of(["seed=range(0,3)", "b=1,2"])) == 6


def test_config_files_of_the_user_that_explode_are_refused(tmp_path: Path, conf: Path) -> None:
    (tmp_path / "experiment").mkdir()
    (tmp_path / "experiment" / "laughs.yaml").write_text(f"# @package _global_\n{LAUGHS}")
    with pytest.raises(ConfigError, match=r"laughs\.yaml: line \d+: found more than"):
        check_command_line(["--config-dir", str(tmp_path), "experiment=laughs"], conf=conf)


def test_a_config_in_memory_is_bounded_too() -> None:
    cfg = compose_config(["scale=smoke"])
    cfg.model.box_centre = [0.0] * 30_000
    with pytest.raises(ConfigError, match=r"model\.box_centre: found 30000 values"):
        validate(cfg)
