"""Grids of more than the paper's six rows: labels, tables, comparisons and pictures stay readable."""

from itertools import pairwise
from pathlib import Path

import pytest

from charnerf.reporting.blocks import Heading, Table, Text
from charnerf.reporting.comparison import comparison
from charnerf.reporting.families import families, shown_rows, sorted_rows
from charnerf.reporting.rows import group_rows
from charnerf.reporting.runs import Run
from charnerf.reporting.significance import questions_of, significance

KEYS = ("psnr", "psnr_foreground", "ssim", "silhouette_iou")
SIX = ("pixelnerf", "single_encoder", "no_mha", "no_mha_depth", "no_view", "charnerf")


def run(*overrides, gain=0.0, start=None):
    name = "+".join(overrides)
    scores = {f"c{number}": dict.fromkeys(KEYS, float(number) + gain) for number in range(12)}
    metrics = {"per_character": scores, **dict.fromkeys(KEYS, 5.0 + gain)}
    return Run(Path(name), name, ("scale=small", *overrides), {"all": name}, metrics, [], None, start)


@pytest.fixture
def twice():
    """The six rows with the paper's loss and with another one."""
    losses = ((), ("loss=opacity",))
    return group_rows([run(f"experiment={name}", *loss) for loss in losses for name in SIX])


@pytest.fixture
def search():
    """A search over one experiment's open choices."""
    runs = [
        run("experiment=charnerf", f"combinator.num_heads={heads}", f"combinator.residual={kind}", gain=heads)
        for heads in (1, 2, 4, 8, 16)
        for kind in ("true", "false")
    ]
    return group_rows([*runs, run("experiment=charnerf", gain=3.0)])


def tables(blocks):
    """Headings and the table below each."""
    return {
        first.text: second
        for first, second in pairwise(blocks)
        if isinstance(first, Heading) and isinstance(second, Table)
    }


def test_two_losses_are_two_tables_each_in_the_papers_order(twice):
    assert [row.label for row in sorted_rows(twice)] == [*SIX, *(f"{name} loss=opacity" for name in SIX)]
    found = tables(comparison(twice))
    assert list(found) == ["Table II", "Table II: loss=opacity"]
    for table in found.values():
        paper = table.header.index("paper")
        assert [line[paper] for line in table.rows] == ["29.2", "25.1", "29.8", "25.6", "28.7", "34.3"]


def test_each_table_is_compared_in_itself_and_row_by_row_with_the_other(twice):
    asked = questions_of(twice)
    assert [(one.title, len(one.pairs)) for one in asked] == [
        ("", 15),
        ("loss=opacity", 15),
        ("as it is against loss=opacity", 6),
    ]
    assert asked[2].pairs[-1] == ("charnerf", "charnerf loss=opacity")
    verdicts = [
        block.text for block in significance(twice) if isinstance(block, Text) and "View att" in block.text
    ]
    assert len(verdicts) == 2
    assert "charnerf loss=opacity is undecided against pixelnerf loss=opacity" in verdicts[1]


def test_a_run_without_the_group_of_experiments_has_a_row():
    """`python train.py ~experiment` is a config as any other."""
    rows = group_rows([run("~experiment", "loss=charnerf"), run("experiment=charnerf")])
    assert [(row.label, row.experiment) for row in rows] == [
        ("loss=charnerf", None),
        ("charnerf", "charnerf"),
    ]


def test_a_search_is_labelled_by_what_differs_and_best_first(search):
    labels = [row.label for row in sorted_rows(search)]
    assert set(labels[:2]) == {"num_heads=16 residual=true", "num_heads=16 residual=false"}
    assert "charnerf" in labels  # the one without a change, named by what it is
    assert [family.of_paper for family in families(search)] == [False]


def test_the_papers_figures_do_not_stand_in_a_search(search):
    assert "paper" not in tables(comparison(search))["All rows"].header
    alone = [row for row in search if row.label == "charnerf"]
    table = tables(comparison(alone))["Table II"]
    assert table.rows[0][table.header.index("paper")] == "34.3"


def test_many_rows_are_compared_with_the_one_without_a_change(search):
    (asked,) = questions_of(search)
    assert asked.title == "every row against charnerf"
    assert len(asked.pairs) == 10 and {pair[1] for pair in asked.pairs} == {"charnerf"}


def test_pictures_of_many_rows_show_the_plain_and_the_best(search):
    shown = [row.label for row in shown_rows(search, 4)]
    assert "charnerf" in shown and len(shown) == 4
    assert {"num_heads=16 residual=true", "num_heads=16 residual=false"} < set(shown)
    assert shown_rows(search, 11) == search


def test_keys_that_end_alike_keep_their_whole_name():
    rows = group_rows([run("data.depth=1"), run("encoder.depth=3"), run("+loss.opacity.weight=2")])
    assert [row.label for row in rows] == ["data.depth=1", "encoder.depth=3", "opacity.weight=2"]


def test_rows_that_began_at_random_are_told():
    rows = group_rows([run("experiment=pixelnerf", start="resnet34: random"), run("experiment=charnerf")])
    told = [block.text for block in comparison(rows) if isinstance(block, Text)]
    assert "Start of pixelnerf: resnet34: random" in told
