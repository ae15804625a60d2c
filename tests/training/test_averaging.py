"""The average of the weights is what is validated and saved, and a resumed run has the same average."""

import pytest
import torch

from charnerf.config.composition import compose_config
from charnerf.errors import ConfigError
from charnerf.training.averaging import WeightAverage
from support import small_runs

DECAY = 0.5
STEPS = ("loss=opacity", "encoder=single", "scale.steps=6", "validation.times=3")
AVERAGED = (*STEPS, f"averaging.decay={DECAY}")


class WeightsOfSteps(small_runs.L.Callback):
    """Keeps the weights after every step and those that validation sees."""

    def __init__(self):
        self.trained, self.validated = [], []

    def on_train_batch_end(self, trainer, pl_module, *_):
        self.trained.append(small_runs.weights(pl_module.model).clone())

    def on_validation_batch_start(self, trainer, pl_module, batch, batch_idx):
        if batch_idx == 0:
            self.validated.append(small_runs.weights(pl_module.model).clone())


def watched(cfg, folder):
    run = small_runs.assemble(cfg, folder)
    watch = WeightsOfSteps()
    run.trainer.callbacks.insert(0, watch)
    start = small_runs.weights(run.module.model).clone()
    return run.fit(), watch, start


@pytest.fixture(scope="module")
def averaged(figure_dataset, tmp_path_factory):
    """A run with an average, what was seen of it, its weights at the start and its folder."""
    folder = tmp_path_factory.mktemp("averaged")
    return *watched(small_runs.smoke_config(figure_dataset, *AVERAGED), folder), folder


@pytest.fixture(scope="module")
def plain(figure_dataset, tmp_path_factory):
    """The same run without, and its folder."""
    folder = tmp_path_factory.mktemp("plain")
    return small_runs.assemble(small_runs.smoke_config(figure_dataset, *STEPS), folder).fit(), folder


def averages(start, trained):
    """The definition, step by step."""
    average, found = start, []
    for n, weights in enumerate(trained):
        decay = min(DECAY, (1 + n) / (10 + n))
        average = decay * average + (1 - decay) * weights
        found.append(average)
    return found


def test_the_average_is_validated_and_saved_and_does_not_change_training(averaged, plain):
    run, watch, start, folder = averaged
    without, _ = plain
    assert run.recorder.losses == without.recorder.losses
    expected = averages(start, watch.trained)
    assert torch.equal(small_runs.weights(without.module.model), watch.trained[-1])
    torch.testing.assert_close(small_runs.weights(run.module.model), expected[-1])
    for seen, average in zip(watch.validated, expected[1::2], strict=True):
        torch.testing.assert_close(seen, average)
    saved = torch.load(folder / "checkpoints/last.ckpt", weights_only=True)["state_dict"]
    state = {f"model.{name}": value for name, value in run.module.model.state_dict().items()}
    assert saved.keys() == state.keys()
    assert all(torch.equal(saved[name], state[name]) for name in saved)


def before_the_last(folder):
    """The checkpoint of four of six steps."""
    checkpoint = folder / "checkpoints/previous.ckpt"
    content = torch.load(checkpoint, weights_only=True)
    assert content["global_step"] == 4
    return checkpoint, content["state_dict"]


def test_a_resumed_run_has_the_same_average(averaged, figure_dataset, tmp_path):
    straight, _, _, folder = averaged
    cfg = small_runs.smoke_config(figure_dataset, *AVERAGED)
    resumed = small_runs.assemble(cfg, tmp_path).fit(before_the_last(folder)[0])
    assert resumed.recorder.losses == straight.recorder.losses[4:]
    assert torch.equal(small_runs.weights(resumed.module.model), small_runs.weights(straight.module.model))
    average = next(one for one in resumed.trainer.callbacks if isinstance(one, WeightAverage))
    assert average._average_model.n_averaged == 1 + 6  # the start, then every step


def test_a_run_without_an_average_goes_on_with_one_from_its_weights(plain, figure_dataset, tmp_path):
    checkpoint, held = before_the_last(plain[1])
    cfg = small_runs.smoke_config(figure_dataset, *AVERAGED)
    run = small_runs.assemble(cfg, tmp_path)
    watch = WeightsOfSteps()
    run.trainer.callbacks.insert(0, watch)
    start = torch.cat([held[f"model.{name}"].reshape(-1) for name, _ in run.module.model.named_parameters()])
    run.fit(checkpoint)
    torch.testing.assert_close(small_runs.weights(run.module.model), averages(start, watch.trained)[-1])


def test_a_decay_of_one_is_refused():
    with pytest.raises(ConfigError, match=r"averaging\.decay.*below 1"):
        compose_config(["scale=smoke", "averaging.decay=1.0"])
