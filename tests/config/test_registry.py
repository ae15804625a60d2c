"""No function and no class outside the registry is called, imported or looked at, in whichever slot it stands."""

import importlib
import pkgutil
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import lightning
import pytest
import torch.optim
import yaml
from omegaconf import DictConfig, OmegaConf

import charnerf
from charnerf.config import targets, validate
from charnerf.config.checks import check_part, check_value
from charnerf.config.composition import compose_config
from charnerf.config.hints import Part
from charnerf.config.problems import Problems
from charnerf.config.registry import ARGUMENTS, GROUPS
from charnerf.config.schema import MODEL_SECTIONS
from charnerf.errors import ConfigError

ROOT = Path(__file__).resolve().parents[2]
REGISTERED = {name for names in GROUPS.values() for name in names}
MOVED = {"loss_terms": "loss"}


def gadgets() -> set[str]:
    """Every name of a callable in every module that can be imported below what used to be allowed."""
    names = set()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for package in (charnerf, lightning, torch.optim):
            for found in pkgutil.walk_packages(
                package.__path__, f"{package.__name__}.", onerror=lambda _: None
            ):
                if found.name.endswith("__main__"):
                    continue
                try:
                    module = importlib.import_module(found.name)
                except Exception:  # of an optional package that is not installed
                    continue
                names |= {f"{found.name}.{name}" for name, one in vars(module).items() if callable(one)}
            names |= {f"{package.__name__}.{name}" for name, one in vars(package).items() if callable(one)}
    return names - REGISTERED


def targets_in(node: Any, group: str) -> Iterator[tuple[str, str]]:
    """Group and class of every part of a config file."""
    if isinstance(node, Mapping):
        if "_target_" in node:
            yield group, node["_target_"]
            inner = ARGUMENTS.get(node["_target_"], {})
            for name, value in node.items():
                yield from targets_in(value, inner.get(name, group))
        else:
            for value in node.values():
                yield from targets_in(value, group)
    elif isinstance(node, list):
        for value in node:
            yield from targets_in(value, group)


def test_the_registry_holds_the_classes_of_every_option_and_nothing_that_is_no_class() -> None:
    used: set[tuple[str, str]] = set()
    for file in (ROOT / "conf").rglob("*.yaml"):
        group = (
            file.parent.name if file.parent.name != "conf" else MOVED.get(file.stem, f"no group: {file.name}")
        )
        used |= set(targets_in(yaml.safe_load(file.read_text()), group))
    assert used <= {(group, name) for group, names in GROUPS.items() for name in names}
    ours = {(group, name) for group, names in GROUPS.items() for name in names if name.startswith("charnerf")}
    assert used >= ours
    for name in REGISTERED:
        module, _, last = name.rpartition(".")
        assert isinstance(getattr(importlib.import_module(module), last), type)
    assert {group for inner in ARGUMENTS.values() for group in inner.values()} <= set(GROUPS)


def test_weights_hold_our_own_classes_alone() -> None:
    for section in (*MODEL_SECTIONS[1:], "activation"):
        assert all(name.startswith(("charnerf.models.", "charnerf.volume.")) for name in GROUPS[section])


def test_every_other_callable_is_refused_in_every_slot_unseen(monkeypatch: pytest.MonkeyPatch) -> None:
    names = gadgets()
    assert len(names) > 5000
    assert {
        "lightning.pytorch.cli.instantiate_class",
        "charnerf.inference.weights.load",
        "torch.optim.Optimizer",
    } <= names
    looked: list[str] = []
    monkeypatch.setattr(targets, "locate", lambda name, *_: looked.append(name))
    let_in = []
    for name in sorted(names):
        for group in ("", *GROUPS):
            problems = Problems()
            check_part(Part(group), {"_target_": name, "args": 1}, "x", problems)
            if not problems.entries:
                let_in.append((group, name))
    assert let_in == []
    assert looked == []


@pytest.mark.parametrize(
    "hint", [int, float, str, bool, int | None, float | None, list[int], dict[str, float], Any]
)
@pytest.mark.parametrize(
    "name", ["os.system", *sorted(REGISTERED)[:2], "lightning.pytorch.cli.instantiate_class"]
)
def test_a_value_is_never_a_part(hint: Any, name: str) -> None:
    part = {"_target_": name}
    for value in (part, [part], {"a": part}, {"a": [[{"b": part}]]}, {"_args_": [part]}):
        problems = Problems()
        check_value(hint, value, "x", problems)
        assert problems.entries, (hint, value)


@pytest.mark.parametrize(
    "override",
    [
        "renderer.memory_mib={_target_: lightning.pytorch.cli.instantiate_class, args: 1, init: {class_path: os.system}}",
        "scale.width={_target_: charnerf.schedule.Phase, rays: 1, surface_points: 0}",
        "name={_target_: charnerf.schedule.Phase, rays: 1, surface_points: 0}",
        "model.box_centre=[{_target_: charnerf.schedule.Phase, rays: 1, surface_points: 0},0,0]",
        "encoder._target_=charnerf.models.heads.radiance.RadianceHead",
        "optimizer._target_=torch.optim.Optimizer",
        "optimizer._target_=torch.optim.lr_scheduler.LambdaLR",
        "loss.surface.directions={_target_: charnerf.losses.surface.Surface}",
        "+trainer.callbacks=[{_target_: lightning.pytorch.callbacks.LambdaCallback}]",
        "+trainer.profiler={_target_: lightning.pytorch.cli.LightningCLI}",
        "+trainer.default_root_dir={_target_: charnerf.schedule.Phase, rays: 1, surface_points: 0}",
        "+combinator._args_=[1]",
        "+combinator._partial_=true",
        "+augmentation.mirror.more={deep: [[{_target_: os.system}]]}",
        "schedule.phases=[{_target_: charnerf.schedule.PhaseSchedule, phases: []}]",
    ],
)
def test_slots_take_classes_of_their_own_group_alone(override: str, smoke: DictConfig) -> None:
    name, _, value = override.lstrip("+").partition("=")
    cfg = smoke.copy()
    OmegaConf.update(cfg, name, yaml.safe_load(value), force_add=True)
    with pytest.raises(ConfigError, match=rf"{name.partition('._')[0]}.*: "):
        validate(cfg)


@pytest.fixture(scope="module")
def smoke() -> DictConfig:
    """Read only: to be copied."""
    return compose_config(["scale=smoke"])


def test_own_classes_stand_in_the_right_slots(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "mylab3.py").write_text(
        "class Inner:\n    def __init__(self, *, size: int) -> None: ...\n"
        "class Mean:\n    def __init__(self, *, width: int, inner: Inner, count: int = 1) -> None: ...\n"
        "class Profiler:\n    pass\n"
        "def make(width): ...\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    base = ["scale=smoke", "combinator=mean", "trusted_targets=[mylab3]", "combinator._target_=mylab3.Mean"]
    mine = [*base, "+combinator.inner={_target_: mylab3.Inner, size: 3}"]
    assert compose_config(mine).combinator.inner._target_ == "mylab3.Inner"
    with pytest.raises(ConfigError, match=r"combinator\.inner\.size\._target_: found 'mylab3\.Inner'"):
        compose_config([*base, "+combinator.inner={_target_: mylab3.Inner, size: {_target_: mylab3.Inner}}"])
    with pytest.raises(ConfigError, match=r"combinator\.count\._target_: found 'mylab3\.Inner'"):
        compose_config([*mine, "+combinator.count={_target_: mylab3.Inner, size: 3}"])
    with pytest.raises(ConfigError, match=r"combinator\._target_: found 'mylab3\.make'"):
        compose_config([*base[:3], "combinator._target_=mylab3.make"])
    cfg = compose_config(["scale=smoke"])
    cfg.trusted_targets = ["os"]  # as a file may say, whose weights `start_from` would then trust
    with pytest.raises(ConfigError, match=r"trusted_targets: found \['os'\]"):
        validate(cfg)
