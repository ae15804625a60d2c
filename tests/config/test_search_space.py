"""What may be searched, as it is typed."""

from pathlib import Path

import pytest

from charnerf.config.search_space import Choice, Interval, search_space
from charnerf.errors import ConfigError


def test_values_ranges_and_intervals(conf: Path) -> None:
    space = search_space(
        [
            "scale=smoke",
            "combinator=mean,sa",
            "scale.width=range(16,64,16)",
            "scale.num_coarse=int(interval(8,32))",
            "optimizer.lr=tag(log,interval(1e-4,1e-2))",
        ],
        conf,
    )
    assert space.fixed == ("scale=smoke",)
    assert space.free == {
        "combinator": Choice(("mean", "sa")),
        "scale.width": Choice(("16", "32", "48")),
        "scale.num_coarse": Interval(8, 32, True, False),
        "optimizer.lr": Interval(1e-4, 1e-2, False, True),
    }
    probes = [set(one) for one in space.probes()]
    assert len(probes) == 1 + 1 + 2 + 1 + 1
    first = {"scale=smoke", "combinator=mean", "scale.width=16", "scale.num_coarse=8", "optimizer.lr=0.0001"}
    assert probes[0] == first
    assert all(len(one - first) == 1 for one in probes[1:])


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["scale=smoke"], "found nothing to choose"),
        (["optimizer.lr=interval(2.0,1.0)"], r"found 2\.0 to 1\.0, expected a lower number first"),
        (["optimizer.lr=tag(log,interval(0,1))"], "above 0 for its logarithm"),
        (["=="], "can not be read"),
    ],
)
def test_what_is_no_space(overrides: list[str], message: str, conf: Path) -> None:
    with pytest.raises(ConfigError, match=message):
        search_space(overrides, conf)
