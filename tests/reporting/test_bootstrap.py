import numpy as np
import pytest
import scipy.stats

from charnerf.reporting.bootstrap import bootstrap_means, compare_rows, holm, paired_bootstrap


def test_means_of_two_values_are_binomial():
    means = bootstrap_means([0.0, 1.0], resamples=40_000, seed=3)
    shares = [float((means == value).mean()) for value in (0.0, 0.5, 1.0)]
    assert shares == pytest.approx([0.25, 0.5, 0.25], abs=0.01)


def test_means_have_the_variance_of_the_plug_in_distribution():
    values = np.random.default_rng(0).normal(size=(30, 2))
    means = bootstrap_means(values, resamples=20_000)
    assert means.mean(0) == pytest.approx(values.mean(0), abs=0.01)
    assert means.var(0) == pytest.approx(values.var(0) / 30, rel=0.05)
    both = np.corrcoef(means.T)[0, 1]  # columns are drawn together
    assert both == pytest.approx(np.corrcoef(values.T)[0, 1], abs=0.05)


def test_interval_is_scipys_percentile_interval():
    values = np.random.default_rng(1).normal(0.3, 1.0, size=15)
    ours = paired_bootstrap(values)
    theirs = scipy.stats.bootstrap(
        (values,), np.mean, n_resamples=10_000, method="percentile", rng=np.random.default_rng(5)
    ).confidence_interval
    assert (ours.low, ours.high) == pytest.approx((theirs.low, theirs.high), abs=0.04)
    assert ours.mean == pytest.approx(values.mean())


def test_p_value_agrees_with_the_t_test_for_many_characters():
    values = np.random.default_rng(2).normal(0.15, 1.0, size=200)
    assert paired_bootstrap(values).p_value == pytest.approx(
        scipy.stats.ttest_1samp(values, 0.0).pvalue, abs=0.01
    )


def test_p_value_inverts_the_interval():
    generator = np.random.default_rng(4)
    for shift in (0.0, 0.2, 0.4, 0.6, 0.8):
        found = paired_bootstrap(generator.normal(shift, 1.0, size=20))
        if abs(found.p_value - 0.05) > 0.002:
            assert (found.low > 0.0 or found.high < 0.0) == (found.p_value < 0.05)


def test_few_characters_can_not_say_more_than_their_signs():
    assert paired_bootstrap([1.0, 1.1]).p_value == 0.5
    assert paired_bootstrap([1.0] * 12).p_value == pytest.approx(2.0**-11)
    assert paired_bootstrap([0.0, 0.0, 0.0]).p_value == 1.0
    assert paired_bootstrap([1.0]).p_value == 1.0
    with pytest.raises(ValueError, match="found shape"):
        paired_bootstrap([])


def test_the_same_seed_gives_the_same_interval():
    assert paired_bootstrap([1.0, -0.5, 0.3], seed=1) == paired_bootstrap([1.0, -0.5, 0.3], seed=1)


def test_holm_on_hand_numbers():
    # smallest times 4, next times 3, ..., never falling
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.4, 0.9]) == [0.8, 0.9]
    assert holm([0.6, 0.7]) == [1.0, 1.0]
    assert holm([]) == []


def test_rows_are_paired_by_character_and_the_better_one_comes_first():
    names = [f"c{number}" for number in range(12)]
    hard = dict(zip(names, np.random.default_rng(0).normal(20.0, 5.0, size=12), strict=True))
    better = {name: value + 0.2 + 0.01 * number for number, (name, value) in enumerate(hard.items())}
    noisy = {name: value + (-1) ** number for number, (name, value) in enumerate(hard.items())}
    found = {
        frozenset((one.first, one.second)): one for one in compare_rows({"a": hard, "b": better, "c": noisy})
    }
    sure = found[frozenset("ab")]
    assert (sure.first, sure.second, sure.holds) == ("b", "a", True)  # 5 dB between characters cancel
    assert sure.mean == pytest.approx(0.255)
    assert sure.p_value == pytest.approx(3 * 2.0**-11)  # Holm over three pairs
    assert not found[frozenset("ac")].holds


def test_rows_without_a_common_character_are_not_compared():
    assert compare_rows({"a": {"x": 1.0}, "b": {"y": 1.0}}) == []
    only = compare_rows({"a": {"x": 1.0, "y": 5.0}, "b": {"y": 1.0}})
    assert (only[0].num_characters, only[0].mean) == (1, 4.0)
