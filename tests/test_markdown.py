"""Tables in Markdown."""

from charnerf.markdown import table


def test_a_table() -> None:
    assert table(["character", "dB", "mm"], [["a", "20.1", "4"], ["b|c", "-", "5"]]) == [
        "| character | dB | mm |",
        "| --- | ---: | ---: |",
        "| a | 20.1 | 4 |",
        "| b\\|c | - | 5 |",
    ]


def test_a_table_without_rows_keeps_its_heads() -> None:
    assert table(["a"], []) == ["| a |", "| --- |"]
