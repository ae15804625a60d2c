"""Every option composes, validates and builds; everything wrong is named in one message."""

import inspect
import re
from pathlib import Path

import pytest
from hydra.utils import get_object
from omegaconf import DictConfig, OmegaConf

from charnerf.config import validate, validate_model
from charnerf.config.command_line import check_command_line
from charnerf.config.composition import compose_config
from charnerf.errors import ConfigError
from charnerf.inference.build import build_model, build_part, build_renderer

ROOT = Path(__file__).resolve().parents[1]
OPTIONS = sorted(file.relative_to(ROOT / "conf") for file in (ROOT / "conf").glob("*/*.yaml"))
DEFAULTS = [
    one for one in OmegaConf.load(ROOT / "conf" / "train.yaml").defaults if isinstance(one, DictConfig)
]
MODEL_GROUPS = (
    "encoder",
    "single_view",
    "activation",
    "combinator",
    "head",
    "density",
    "views",
    "features",
    "quadrature",
    "renderer",
)


def overrides_for(option: Path) -> list[str]:
    overrides = [f"{option.parent}={option.stem}"]
    needed = {"data": dict.fromkeys(("folder", "foreign", "joined", "shards"), "root") | {"people": "assets"}}
    missing = needed.get(str(option.parent), {}).get(option.stem)
    return [*overrides, f"{option.parent}.{missing}=/tmp"] if missing else overrides


def problem(*overrides: str) -> str:
    with pytest.raises(ConfigError) as caught:
        compose_config(["scale=smoke", *overrides])
    return str(caught.value)


@pytest.fixture(scope="module")
def smoke() -> DictConfig:
    """Read only: to be copied."""
    return compose_config(["scale=smoke"])


def refusal(cfg: DictConfig, key: str, value: str) -> str:
    """The message about a config with another value at a full key."""
    changed = cfg.copy()
    OmegaConf.update(changed, key, value)
    with pytest.raises(ConfigError) as caught:
        validate(changed)
    return str(caught.value)


def problems(*overrides: str) -> set[str]:
    """Lines of the one message about several wrong keys: a config takes a third of a second to compose."""
    first, *lines = problem(*overrides).splitlines()
    assert first == f"The config has {len(lines)} problems:"
    return {line.removeprefix("  ") for line in lines}


def is_default(option: Path) -> bool:
    """Whether the default config holds an option: with it typed, another compose would be the same."""
    return {str(option.parent): option.stem} in DEFAULTS


@pytest.mark.parametrize(
    "option",
    # those of the model are composed below
    [None, *(one for one in OPTIONS if one.parent.name not in MODEL_GROUPS and not is_default(one))],
    ids=lambda one: "default" if one is None else one.with_suffix("").as_posix(),
)
def test_every_option_composes_and_validates(option: Path | None) -> None:
    cfg = compose_config([] if option is None else overrides_for(option))
    assert cfg.scale.image_size >= 8
    for group in ("schedule", "data"):
        if option is None or option.parent.name == group:
            assert type(build_part(cfg[group])).__module__.startswith("charnerf.")


def test_a_default_that_is_typed_changes_nothing() -> None:
    typed = [f"{group}={name}" for one in DEFAULTS for group, name in one.items() if isinstance(name, str)]
    assert len(typed) > 15 and compose_config(typed) == compose_config()


@pytest.mark.parametrize(
    "option",
    [None, *(one for one in OPTIONS if one.parent.name in MODEL_GROUPS and not is_default(one))],
    ids=lambda one: "default" if one is None else one.with_suffix("").as_posix(),
)
def test_every_model_option_builds(option: Path | None) -> None:
    cfg = compose_config(["scale=smoke", *([] if option is None else overrides_for(option))])
    model = build_model(cfg)
    assert sum(p.numel() for p in model.parameters()) > 0
    assert type(build_renderer(cfg)).__module__.startswith("charnerf.volume.renderers")


def test_a_fine_field_is_its_own() -> None:
    cfg = compose_config(["scale=smoke", "renderer.num_fine=4"])
    model = build_model(cfg)
    assert model.fine is not None
    coarse = {id(parameter) for parameter in model.coarse.parameters()}
    assert coarse.isdisjoint(id(parameter) for parameter in model.fine.parameters())
    assert build_model(compose_config(["scale=smoke", "renderer.num_fine=0"])).fine is None


# What is wrong, and the message.


def test_typos_name_the_full_key_and_the_nearest_name() -> None:
    assert problem("budget.step=3") == "budget.step: unknown key; did you mean 'steps'?"
    typed = ("encoder=single", "+encoder.num_stack=2", "+optimizer.lrr=1.0", "+trainer.limit_val_batch=1")
    assert problems(*typed) == {
        "encoder.num_stack: charnerf.models.encoders.single.SingleHourglass takes no argument"
        " 'num_stack'; did you mean 'num_stacks'?",
        "optimizer.lrr: charnerf.training.muon.MuonWithAdam takes no argument 'lrr'; did you mean 'lr'?",
        "trainer.limit_val_batch: lightning.Trainer takes no argument 'limit_val_batch'; "
        "did you mean 'limit_val_batches'?",
    }


@pytest.mark.parametrize("override", ["+typo=1", "typo=1", "++typo=1"])
def test_an_unknown_key_is_refused_however_it_is_added(override: str) -> None:
    message = problem(override)
    assert message.startswith("typo: unknown key; expected one of: ")


def test_an_unknown_key_is_refused_in_every_section() -> None:
    cfg = compose_config(["scale=smoke"])
    sections = [str(key) for key in cfg if isinstance(cfg[key], DictConfig)]
    assert len(sections) > 15
    message = problem(*(f"+{section}.zzz=1" for section in sections))
    named = {line.strip().split(":")[0] for line in message.splitlines()[1:]}
    assert named == {f"{section}.zzz" for section in sections}


def test_wrong_types_are_named() -> None:
    assert problem("seed=abc") == "seed: found 'abc' (str), expected int."
    assert problem("encoder=3").startswith("encoder: found no option '3', expected one of: double, ")
    assert problem("model=3").startswith("model: found 3 (int), expected a section with ")
    typed = ("scale.width=1.5", "model.hull=3", "optimizer.lr=fast", "model.box_centre=[0,0,high]")
    found = problems(*typed, "encoder=single", "encoder.num_stacks=[1]", "scale.num_coarse=true")
    (rate,) = (line for line in found if line.startswith("optimizer.lr: found 'fast' (str), expected "))
    assert found - {rate} == {
        "scale.width: found 1.5 (float), expected int.",
        "scale.num_coarse: found True (bool), expected int.",
        "model.hull: found 3 (int), expected bool.",
        "model.box_centre.2: found 'high' (str), expected float.",
        "encoder.num_stacks: found [1] (list), expected int.",
    }


def test_numbers_out_of_range_are_named() -> None:
    typed = ("scale.width=0", "budget.seconds=0", "batches.foreground_share=1.5", "data.views=0")
    assert problems(*typed, "combinator=mean") == {
        "scale.width: found 0, expected at least 1.",
        "budget.seconds: found 0, expected more than 0.",
        "batches.foreground_share: found 1.5, expected at most 1.",
        "data.views: found 0, expected at least 1.",
    }


def test_what_is_missing_is_named() -> None:
    assert problem("data=folder") == "data.root: not set, expected str; set data.root=... ."
    assert problem("~combinator").startswith(
        "combinator: not set, expected a section with _target_, a class of "
    )
    assert (
        problem("~combinator.num_heads", "combinator=view_mha")
        == "combinator.num_heads: not set, but charnerf.models.combinators.view_attention.ViewAttention needs"
        " it: int."
    )


@pytest.mark.parametrize(
    "target",
    [
        "os.system",
        "builtins.eval",
        "subprocess.Popen",
        "charnerf.cli.sys.exit",
        "charnerf.inference.weights.os.system",
        "charnerf.inference.weights.load",
        "torch.optim.Adam",
        "torch.hub.load",
        "lightning.Trainer",
        "charnerf.models.encoders.single.torch.load",
        "charnerf.models.encoders.__import__",
    ],
)
def test_targets_outside_their_home_are_refused(target: str, smoke: DictConfig) -> None:
    message = refusal(smoke, "encoder._target_", target)
    assert message.startswith("encoder._target_: ")
    assert "charnerf.models.encoders" in message


def test_foreign_targets_are_refused_wherever_they_hide() -> None:
    message = problem("+trainer.profiler={_target_: os.system, command: x}")
    assert message.startswith("trainer.profiler._target_: found 'os.system'")
    message = problem("+trainer.plugins=[{_target_: os.system, command: x}]")
    assert message.startswith(
        "trainer.plugins.0._target_: found 'os.system', expected one of lightning.pytorch.plugins."
    )
    assert "trusted_targets=[os] on the command line" in message


def test_a_class_that_does_not_exist_is_named() -> None:
    message = problem("encoder=single", "encoder._target_=charnerf.models.encoders.single.SingleHourglas")
    assert (
        message == "encoder._target_: 'charnerf.models.encoders.single.SingleHourglas' does not exist: "
        "charnerf.models.encoders.single has no 'SingleHourglas'; did you mean 'SingleHourglass'?"
    )


def test_own_classes_are_trusted_from_the_command_line_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "mylab.py").write_text(
        "class Mean:\n    def __init__(self, *, width: int) -> None:\n        pass\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    mine = ["scale=smoke", "combinator=mean", "combinator._target_=mylab.Mean"]
    assert "trusted_targets=[mylab]" in problem(*mine[1:])
    cfg = compose_config([*mine, "trusted_targets=[mylab]"])
    assert cfg.combinator._target_ == "mylab.Mean"
    with pytest.raises(ConfigError, match=r"mylab\.Mean"):
        validate(cfg)  # its own trusted_targets do not count
    with pytest.raises(ConfigError, match=r"mylab\.Mean"):
        validate_model(cfg)
    validate_model(cfg, trusted_targets=["mylab"])
    (tmp_path / "mylab2.py").write_text("import os\nfrom os import system as Mean\n")
    assert "which is posix.system" in problem(
        "combinator=mean", "combinator._target_=mylab2.Mean", "trusted_targets=[mylab2]"
    )


@pytest.mark.parametrize("name", ["../x", "/x", "a/b", "..", ".", "", "a\\b", "x" * 200])
def test_a_name_is_no_path(name: str, smoke: DictConfig) -> None:
    assert re.match(r"name: found .*expected a folder's own name", refusal(smoke, "name", name))


def test_a_name_that_is_typed_is_no_path_either() -> None:
    assert problem("name=../x").startswith("name: found ")


def test_combinations_that_can_not_work_are_named() -> None:
    assert (
        problem("combinator=sa", "combinator.num_heads=3")
        == "combinator.num_heads: found 3, expected a divisor of model.width = 16."
    )
    assert problem("budget.steps=null", "budget.seconds=null").startswith(
        "budget.steps: found null, and budget."
    )
    assert problem("schedule.phases=[]") == "schedule.phases: found none, expected at least one phase."
    assert "expected at least one weight above 0." in problem(
        "loss=rays_only", "loss.reconstruction.weight=0"
    )
    assert problem("loss.opacity.weight=-1") == "loss.opacity.weight: found -1, expected 0 or more."


def test_numbers_that_no_training_could_use_are_named() -> None:
    expected = {
        "combinator.temperature=0": "more than 0",
        "combinator.lr_scale=-1": "more than 0",
        "optimizer.lr=-1": "more than 0",
        "optimizer.matrix_lr=0": "more than 0",
        "space.spread=0": "more than 0",
        "space.num_directions=0": "at least 1",
        "space.pool_size=0": "at least 1",
        "space.near_share=2": "a share, 0 to 1",
        "combinator.view_scale=nan": "a number",
        "loss.opacity.weight=nan": "a number",
    }
    keys = {override: override.partition("=") for override in expected}
    assert problems("combinator=view_mha", *expected) == {
        f"{key}: found {found}, expected {expected[override]}." for override, (key, _, found) in keys.items()
    }
    message = "combinator.temperature: found nan, expected a number."
    assert problem("combinator=view_mha", "combinator.temperature=nan") == message


def test_phases_that_do_not_ascend_are_named() -> None:
    one = "{_target_: charnerf.schedule.Phase, rays: 8, surface_points: 0, until: {steps: 5}}"
    last = "{_target_: charnerf.schedule.Phase, rays: 8, surface_points: 0}"
    assert (
        problem(f"schedule.phases=[{one},{one},{last}]")
        == "schedule.phases: found ends [5, 5] in steps, expected them to ascend."
    )
    assert problem(f"schedule.phases=[{last},{last}]").startswith(
        "schedule.phases.0.until: not set, expected an end"
    )


def test_settings_that_would_be_overwritten_are_refused() -> None:
    assert (
        problem("++encoder.in_channels=3", "encoder=single")
        == "encoder.in_channels: charnerf sets 'in_channels' of"
        " charnerf.models.encoders.single.SingleHourglass itself; remove it."
    )


def test_what_a_class_refuses_is_told_before_any_work() -> None:
    assert problem("loss.occupancy.delta=0") == "loss.occupancy.delta: found 0, expected more than 0 m."


def test_labelled_points_need_a_hull() -> None:
    no_hull = ("model.hull=false", "features=image", "schedule=constant")
    message = problem("loss.occupancy.weight=0.1", *no_hull)
    assert message.startswith("model.hull: found false, but loss.occupancy reads labelled points")
    message = problem(*no_hull, "schedule=inside_last")
    assert "but schedule.phases.1.loss_weights.occupancy reads labelled points" in message


def test_the_perceptual_term_needs_squares_that_its_network_can_see() -> None:
    message = problem("loss.perceptual.weight=0.1")
    assert message.startswith(
        "schedule.phases.0.square: found 0, but loss.perceptual looks at squares of rays in phase 0"
    )
    message = problem("schedule=perceptual_last", "schedule.phases.1.square=30")
    assert (
        message.startswith("schedule.phases.1.square: found 30,") and "expected at least 31 pixels" in message
    )
    message = problem("schedule=perceptual_last", "scale.image_size=16")
    assert message.startswith("scale.image_size: found 16,")
    compose_config(["schedule=perceptual_last"])
    compose_config(["loss.perceptual.weight=0.1", "+schedule.phases.0.square=64"])


def test_settings_without_effect_are_warned_of(conf: Path) -> None:
    for option in ("image_hull", "image_hull_section", "image_hull_section_consistency"):
        with pytest.warns(UserWarning, match=rf"features={option} reads the hull, but model\.hull=false"):
            check_command_line(["scale=smoke", f"features={option}", "model.hull=false"], conf=conf)
    phase = "_target_: charnerf.schedule.Phase, rays: 8, surface_points: 0"
    late = f"schedule.phases=[{{{phase}, until: {{steps: 50}}}},{{{phase}}}]"
    with pytest.warns(UserWarning, match=r"schedule\.phases\.0\.until\.steps=50, but budget\.steps=4: later"):
        check_command_line(["scale=smoke", "budget.steps=4", late], conf=conf)


def test_all_problems_come_at_once() -> None:
    message = problem("seed=abc", "budget.step=3", "+typo=1", "scale.width=-1", "combinator=mean")
    lines = message.splitlines()
    assert lines[0] == "The config has 4 problems:"
    assert [line.strip().split(":")[0] for line in lines[1:]] == [
        "typo",
        "seed",
        "scale.width",
        "budget.step",
    ]


def test_broken_interpolations_are_named() -> None:
    assert problem("seed=${scale.nothing}").startswith(
        "seed: can not be read: Interpolation key 'scale.nothing'"
    )


@pytest.mark.parametrize("group", sorted({option.parent.name for option in OPTIONS}))
def test_a_wrong_option_lists_the_right_ones(group: str) -> None:
    options = ", ".join(sorted(option.stem for option in OPTIONS if option.parent.name == group))
    assert problem(f"{group}=zzz") == f"{group}: found no option 'zzz', expected one of: {options}."


def test_a_mistyped_option_or_group_names_the_nearest() -> None:
    assert problem("experiment=no_mah").endswith("Did you mean 'no_mha'?")
    assert problem("combinatr=mean") == "combinatr: unknown key; did you mean 'combinator'?"


def test_what_can_not_be_read_is_shown() -> None:
    assert problem("seed=[").startswith("seed=[: can not be read")


def test_no_job_of_a_sweep_starts_if_one_is_wrong(conf: Path) -> None:
    with pytest.raises(ConfigError) as caught:
        check_command_line(["-m", "scale=smoke", "combinator=mean,sa", "seed=1,x"], conf=conf)
    lines = str(caught.value).splitlines()
    assert lines[0] == "2 of 4 jobs can not start, so none was; first `scale=smoke combinator=mean seed=x`:"
    assert lines[1] == "seed: found 'x' (str), expected int."
    check_command_line(["-m", "scale=smoke", "experiment=glob(no_*)"], conf=conf)


@pytest.mark.parametrize(
    "option",
    [one for one in OPTIONS if one.parent.name in MODEL_GROUPS],
    ids=lambda one: one.with_suffix("").as_posix(),
)
def test_values_live_once(option: Path) -> None:
    """A hyper-parameter that YAML sets has no default in Python."""
    section = OmegaConf.load(ROOT / "conf" / option)
    parameters = inspect.signature(get_object(str(section._target_))).parameters
    for key in section:
        if not str(key).startswith("_"):
            found = parameters[str(key)].default
            assert found is inspect.Parameter.empty, f"{option}: {key} has a default in Python too"
