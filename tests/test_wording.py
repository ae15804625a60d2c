"""Words of sentences."""

from charnerf.wording import counted, listed


def test_a_list_names_the_first_and_counts_the_rest():
    assert listed([], 2) == ""
    assert listed(["a", "b"], 2) == "a, b"
    assert listed(["a", "b", "c", "d"], 2) == "a, b, and 2 more"


def test_one_has_no_plural():
    assert [counted(n, "run") for n in (0, 1, 2)] == ["0 runs", "1 run", "2 runs"]
    assert counted(2, "mesh", "meshes") == "2 meshes"
