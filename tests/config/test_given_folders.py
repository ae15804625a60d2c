"""Config files of others: nothing in them that Hydra runs, however they are given."""

import re
from pathlib import Path

import pytest

from charnerf.config.command_line import check_command_line
from charnerf.config.given_folders import check_hydra
from charnerf.errors import ConfigError

SMALL = ["scale=smoke", "trainer=cpu"]
AROUND = {
    "--config-dir": lambda folder: ["--config-dir", str(folder)],
    "searchpath": lambda folder: [f"hydra.searchpath=[file://{folder}]"],
    "searchpath, no scheme": lambda folder: [f"hydra.searchpath=['{folder}']"],
}


@pytest.fixture
def theirs(tmp_path: Path) -> Path:
    folder = tmp_path / "their files"
    (folder / "experiment").mkdir(parents=True)
    return folder


@pytest.mark.parametrize(
    "key",
    [
        "callbacks.theirs._target_",
        "launcher._target_",
        "launcher.setup",
        "sweeper._target_",
        "job_logging.handlers.theirs.()",
        "hydra_logging.root.handlers",
        "job.env_set.LD_PRELOAD",
        "mode",
        "unheard",
    ],
)
def test_what_hydra_runs_is_typed(key: str) -> None:
    typed = {"run.dir": "outputs", "mode": None}
    for there in ({key: "theirs"}, {key: ["theirs"]}):
        with pytest.raises(ConfigError, match=rf"^hydra\.{re.escape(key)}: set by a file of --config-dir"):
            check_hydra(typed, typed | there)
    check_hydra(typed, typed | {"run.dir": "theirs", "job.name": "theirs"})


@pytest.mark.parametrize("way", AROUND)
def test_however_their_folder_is_given(way: str, theirs: Path, conf: Path) -> None:
    """An option that looks as ours, and says something to Hydra besides."""
    (theirs / "experiment/theirs.yaml").write_text(
        "# @package _global_\nhydra: {callbacks: {theirs: {_target_: os.system, command: touch ran}}}\n"
    )
    command = [*SMALL, "experiment=theirs", *AROUND[way](theirs)]
    with pytest.raises(ConfigError, match=r"^hydra\.callbacks: set by a file"):
        check_command_line(command, conf=conf)


def test_an_option_of_theirs_takes_the_place_of_none_of_hydras(theirs: Path, conf: Path) -> None:
    """A plugin's options come last in Hydra's search."""
    (theirs / "hydra/launcher").mkdir(parents=True)
    (theirs / "hydra/launcher/joblib.yaml").write_text("_target_: theirs.Launcher\n")
    more = ["--config-dir", str(theirs)]
    with pytest.raises(ConfigError, match=r"hydra\.launcher"):
        check_command_line([*SMALL, "hydra/launcher=joblib", *more], conf=conf)
    with pytest.raises(
        ConfigError, match=r"Could not find 'hydra/launcher/theirs' in charnerf's config files"
    ):
        check_command_line([*SMALL, "hydra/launcher=theirs", *more], conf=conf)
    check_command_line([*SMALL, "hydra.job_logging.root.level=WARN", *more], conf=conf)


@pytest.mark.parametrize("way", AROUND)
def test_small_files_that_mean_much_are_refused_unread(way: str, theirs: Path, conf: Path) -> None:
    laughs = "a0: &a0 [x, x]\n" + "".join(
        f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]\n" for n in range(1, 30)
    )
    (theirs / "experiment/theirs.yaml").write_text(laughs)
    for more in ([], ["--cfg", "job"]):
        with pytest.raises(ConfigError, match=r"theirs\.yaml: line .* values"):
            check_command_line([*SMALL, *AROUND[way](theirs), *more], conf=conf)


def test_a_primary_file_adds_no_folders(theirs: Path, conf: Path) -> None:
    """Hydra imports a package to look into it."""
    (theirs / "train.yaml").write_text("x: {searchpath: ['pkg://theirs']}\nhydra: ${x}\n")
    with pytest.raises(ConfigError, match=r"train\.yaml: sets hydra\.searchpath"):
        check_command_line(["--config-path", str(theirs)], conf=conf)
