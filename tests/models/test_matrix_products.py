"""Products stay in full precision, whichever library makes them."""

from collections.abc import Iterator

import pytest
import torch

from charnerf.models import matrix_products
from charnerf.models.matrix_products import use_fastest_products


@pytest.fixture(autouse=True)
def _as_before() -> Iterator[None]:
    before = torch.get_float32_matmul_precision()
    torch.set_float32_matmul_precision("highest")
    use_fastest_products.cache_clear()
    yield
    torch.set_float32_matmul_precision(before)
    use_fastest_products.cache_clear()


def test_products_keep_their_digits() -> None:
    use_fastest_products()
    for rows, inner, columns in ((1000, 64, 64), (64, 3000, 64), (700, 42, 128), (17, 5, 3)):
        first, second = torch.randn(rows, inner), torch.randn(inner, columns)
        exact = first.double() @ second.double()
        size = first.double().abs() @ second.double().abs()
        assert float(((first @ second - exact).abs() / size).max()) < 1e-5


def test_the_switch_is_taken_back_where_digits_are_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(matrix_products, "FLOAT32_ERROR", 0.0)
    assert not use_fastest_products()
    assert torch.get_float32_matmul_precision() == "highest"


def test_a_choice_of_the_user_is_left_alone() -> None:
    torch.set_float32_matmul_precision("high")
    assert not use_fastest_products()
    assert torch.get_float32_matmul_precision() == "high"
