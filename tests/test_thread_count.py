"""torch's number of threads."""

import pytest
import torch

from charnerf.thread_count import restored_threads


def test_the_number_is_given_back() -> None:
    before = torch.get_num_threads()
    with pytest.raises(KeyError), restored_threads():
        torch.set_num_threads(before + 1)
        raise KeyError
    assert torch.get_num_threads() == before
