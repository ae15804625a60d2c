"""The command line: help, exit statuses, one message for an error."""

import json
import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest
import trimesh

from charnerf.cli import run
from charnerf.config.command_line import check_command_line, run_door
from charnerf.config.composition import compose_config
from charnerf.errors import ConfigError, DataError
from charnerf.inference.build import build_model
from charnerf.inference.weights import save_config, save_weights

ROOT = Path(__file__).resolve().parents[1]
COMMANDS = (
    "capture",
    "generate",
    "evaluate",
    "mesh",
    "reconstruct",
    "report",
    "search",
)  # that Typer describes


@pytest.fixture(scope="module")
def weights(tmp_path_factory: pytest.TempPathFactory) -> Path:
    cfg = compose_config(["scale=smoke"])
    return save_weights(tmp_path_factory.mktemp("run") / "x.safetensors", build_model(cfg), cfg)


@pytest.fixture(scope="module")
def mesh_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A red box with a blue head, Y up as OBJ has it."""
    body, head = trimesh.creation.box((0.8, 1.6, 0.4)), trimesh.creation.icosphere(2, 0.25)
    head.apply_translation((0.0, 1.0, 0.0))
    body.visual.face_colors, head.visual.face_colors = (200, 30, 30, 255), (30, 30, 200, 255)
    file = tmp_path_factory.mktemp("meshes") / "robot.glb"
    trimesh.Scene([body, head]).export(file)
    return file


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory, mesh_file: Path) -> Path:
    root = tmp_path_factory.mktemp("data") / "set"
    assert (
        run(
            [
                "capture",
                str(mesh_file),
                "-o",
                str(root),
                "--split",
                "test",
                "--views",
                "3",
                "--size",
                "32",
                "--jobs",
                "1",
            ]
        )
        == 0
    )
    return root


def test_help_lists_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--help"]) == 0
    text = capsys.readouterr().out
    assert all(f"  {command} " in text for command in COMMANDS)


@pytest.mark.parametrize("command", COMMANDS)
def test_help_of_every_command_explains_every_option(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run([command, "--help"]) == 0
    text = capsys.readouterr().out
    lines = [line for line in text.splitlines() if line.startswith("  -")]
    for index, line in enumerate(lines):
        name = line.split()[0]
        after = text[text.index(line) + len(line) :].splitlines()
        described = "  " in line.strip() or (len(after) > 1 and after[1].startswith(" " * 10))
        assert described, f"{command} {name} has no help ({index})"
    assert "Exit status: 0 done, 1 failed, 2 wrong call." in text


def test_help_is_instant() -> None:
    """Heavy packages wait until a command runs. Seconds are the processor's, so that a busy machine changes nothing."""
    code = (
        "import sys, charnerf.cli; print(sorted({'torch', 'lightning', 'hydra', 'trimesh', 'numpy'} &"
        " set(sys.modules)))"
    )
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert after.ru_utime - before.ru_utime < 5.0


@pytest.mark.parametrize(
    "arguments",
    [
        ["nonsense"],
        ["capture"],
        ["capture", "nowhere.glb", "-o", "x"],
        ["generate", "-o", "x", "--train", "-1"],
        ["generate", "-o", "x", "--train", "0", "--val", "0", "--test", "0"],
        ["evaluate", "--data", "nowhere"],
        ["mesh", "--data", "nowhere", "--character", "a", "-o", "x"],
        ["reconstruct", "front.png", "side.png", "-o", "x"],
        ["report", "nowhere"],
        ["evaluate", "--bogus"],
    ],
)
def test_a_wrong_call_exits_2_and_writes_nothing(
    arguments: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(arguments) == 2
    assert "Traceback" not in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_failure_exits_1_with_one_message(
    dataset: Path, weights: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = [
        "mesh",
        str(weights),
        "--data",
        str(dataset),
        "--character",
        "nobody",
        "-o",
        str(tmp_path / "x"),
    ]
    assert run(arguments) == 1
    text = capsys.readouterr().err
    assert text.startswith("error: ")
    assert "nobody" in text
    assert len(text.splitlines()) == 1
    assert not (tmp_path / "x").exists()
    assert run([*arguments, "--debug"]) == 1
    assert "Traceback" in capsys.readouterr().err


def test_captured_names_are_refused_the_second_time(
    dataset: Path, mesh_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = sorted(path for path in dataset.rglob("*") if path.is_file())
    assert run(["capture", str(mesh_file), "-o", str(dataset), "--split", "train", "--size", "32"]) == 1
    assert "robot" in capsys.readouterr().err
    assert sorted(path for path in dataset.rglob("*") if path.is_file()) == before


def test_evaluate_prints_and_writes_metrics(
    dataset: Path, weights: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "metrics.json"
    arguments = [str(weights), "--data", str(dataset), "--views", "1", "--json", str(file), "--no-mesh"]
    capsys.readouterr()
    assert run(["evaluate", *arguments, "--device", "cpu"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads(file.read_text())
    assert (printed["split"], printed["num_characters"], printed["num_views"]) == ("test", 1, 1)
    assert run(["evaluate", *arguments, "--views", "many"]) == 2
    assert run(["evaluate", *arguments, "--device", "toaster"]) == 2
    assert run(["evaluate", *arguments, "--split", "nope"]) == 1


def test_evaluate_measures_as_many_views_as_the_run_did(
    dataset: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cfg = compose_config(["scale=smoke", "scale.eval_views=2"])
    weights = save_weights(tmp_path / "run" / "weights.safetensors", build_model(cfg), cfg)
    measure = [
        "evaluate",
        str(weights),
        "--data",
        str(dataset),
        "--no-mesh",
        "--no-baselines",
        "--device",
        "cpu",
    ]
    for expected in (3, 2):  # all that there are, of 24, by weights alone; then as the run's config says
        capsys.readouterr()
        assert run(measure) == 0
        assert json.loads(capsys.readouterr().out)["num_views"] == expected
        save_config(tmp_path / "run", cfg)


def test_mesh_and_reconstruct_write_their_files(dataset: Path, weights: Path, tmp_path: Path) -> None:
    common = ["--resolution", "24", "--device", "cpu"]
    where = ["--data", str(dataset), "--character", "robot", "-o", str(tmp_path / "mesh")]
    assert run(["mesh", str(weights), *where, "--format", "ply", *common]) == 0
    mesh = trimesh.load(tmp_path / "mesh" / "robot.ply")
    assert mesh.bounds[1, 2] - mesh.bounds[0, 2] == pytest.approx(2.0, abs=1e-3)
    assert (tmp_path / "mesh" / "robot_sheet.png").is_file()
    drawings = [str(dataset / "robot" / "sources" / f"{view}.png") for view in ("front", "side", "back")]
    out = tmp_path / "hero"
    more = ["--weights", str(weights), "--frames", "2", "--size", "32", "--faces", "500", *common]
    assert run(["reconstruct", *drawings, "-o", str(out), *more]) == 0
    assert (out / "mesh.glb").is_file()
    assert (out / "report.md").is_file()
    assert (out / "turntable.mp4").is_file() or (out / "turntable.gif").is_file()


def test_levels_of_detail_come_in_one_call_with_one_table(
    dataset: Path, weights: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    where = ["mesh", str(weights), "--data", str(dataset), "--character", "robot", "-o", str(tmp_path / "x")]
    levels = ["--lod", "16,24", "--faces", "100,200", "--texture", "drawings", "--texture-size", "64"]
    assert run([*where, *levels, "--format", "obj", "--height", "1.5", "--device", "cpu"]) == 0
    table = capsys.readouterr().out
    assert (tmp_path / "x" / "lods.md").read_text().count(table) == 1
    rows = json.loads((tmp_path / "x" / "lods.json").read_text())
    assert len(rows) == 4 and all(f"| {row['file']} |" in table for row in rows)
    for row in rows:
        file = tmp_path / "x" / f"{row['file']}.obj"
        assert file.with_suffix(".mtl").is_file() and file.with_suffix(".png").is_file()
        assert trimesh.load(file, force="mesh").extents[1] == pytest.approx(1.5, abs=1e-5)
    whole = [*where[:4], "--split", "test", "-o", str(tmp_path / "y"), "--resolution", "24", "--faces", "200"]
    assert run([*whole, "--texture-size", "64"]) == 0
    text = (tmp_path / "y" / "meshes.md").read_text()
    assert "| robot |" in text and "| **mean** |" in text and text in capsys.readouterr().out
    assert (tmp_path / "y" / "robot" / "robot.glb").is_file()
    assert run(whole[:4] + whole[6:]) == 2
    assert run([*where, "--lod", "16,many"]) == 2
    assert run([*where, "--faces", "3"]) == 2


def test_the_shell_completes_names_of_commands() -> None:
    asked = {"_CHARNERF_COMPLETE": "complete_bash", "COMP_WORDS": "charnerf re", "COMP_CWORD": "1"}
    done = subprocess.run(
        [sys.executable, "-m", "charnerf"],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, **asked},
    )
    assert done.stdout.split() == ["reconstruct", "report"]


def test_python_m_charnerf_is_the_command() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "charnerf", "--version"], capture_output=True, text=True, check=True
    )
    assert done.stdout.startswith("charnerf ")


@pytest.mark.parametrize(
    "arguments", [["combinator=nope"], ["+typo=1"], ["data=folder", "data.root=/nowhere"]]
)
def test_train_refuses_a_wrong_call_before_any_work(
    arguments: list[str], conf: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("HYDRA_FULL_ERROR", "0")
    worked: list[bool] = []
    status = run_door(lambda: worked.append(True), arguments=["scale=smoke", *arguments], conf=conf)
    text = capsys.readouterr().err
    assert (status, worked) == (2, [])
    assert text.startswith("error: ")
    assert len(text.splitlines()) == 1


@pytest.mark.parametrize(
    "case",
    [
        (DataError("x.png: found nothing."), 1, "error: x.png: found nothing.\n"),
        (ConfigError("a: b"), 2, "error: a: b\n"),
        (ZeroDivisionError("zero"), 1, "error: ZeroDivisionError: zero (HYDRA_FULL_ERROR=1 shows where)\n"),
        (
            PermissionError(13, "Permission denied", "a\x1b[2J"),
            1,
            "error: a\\x1b[2J: can not be opened (Permission denied), expected to be allowed to. Change its permissions, or name"
            " another place.\n",
        ),
        (KeyboardInterrupt(), 1, "stopped.\n"),
    ],
    ids=lambda case: type(case[0]).__name__,
)
def test_train_tells_errors_in_one_message(
    case: tuple[BaseException, int, str],
    conf: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    error, status, message = case

    def fail() -> None:
        raise error

    monkeypatch.delenv("HYDRA_FULL_ERROR", raising=False)
    assert run_door(fail, arguments=["scale=smoke"], conf=conf) == status
    assert "HYDRA_FULL_ERROR" not in os.environ  # or the next call would show tracebacks
    assert capsys.readouterr().err == message
    monkeypatch.setenv("HYDRA_FULL_ERROR", "1")
    assert run_door(fail, arguments=["scale=smoke"], conf=conf) == status
    assert ("Traceback" in capsys.readouterr().err) == isinstance(error, Exception)


@pytest.mark.parametrize("door", [[str(ROOT / "train.py")], ["-m", "charnerf", "train"]])
def test_train_itself_exits_2(door: list[str], tmp_path: Path) -> None:
    command = [sys.executable, *door, "combinator=nope"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("error: combinator: found no option 'nope', expected one of: ")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "typed",
    [["seed=0,1", "-m"], pytest.param(["scale=smoke", "-m", "seed=0,1"], marks=pytest.mark.slow)],
    ids=" ".join,
)
def test_a_grids_overrides_stand_before_or_after_m(
    typed: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("charnerf.training.run.run_training", lambda cfg, folder, **settings: None)
    monkeypatch.setattr(sys, "argv", ["charnerf"])
    monkeypatch.setenv("HYDRA_FULL_ERROR", "0")  # the door sets it
    monkeypatch.chdir(tmp_path)
    silent = ("hydra/job_logging=none", "hydra/hydra_logging=none")  # these would stay for other tests
    assert run(["train", *silent, *typed]) == 0
    assert len(list(tmp_path.glob("outputs/grid/seed-*/seed-*"))) == 2


def test_debug_shows_the_traceback_of_training_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HYDRA_FULL_ERROR", "0")
    for arguments in (["--debug", "train", "combinator=nope"], ["train", "combinator=nope", "--debug"]):
        assert run(arguments) == 2
        assert "Traceback" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("splits.test=tset", r"^splits\.test: split 'tset' does not exist; .* val \(4\), test \(6\)\.$"),
        ("splits.train=[train,more]", r"splits\.train: split 'more' does not exist"),
    ],
)
def test_a_split_that_is_not_there_is_named_before_any_work(
    override: str, message: str, conf: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Embedded characters are not generated, and no run folder is begun."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    with pytest.raises(ConfigError, match=message):
        check_command_line(["scale=smoke", override], conf=conf)
    assert not (tmp_path / "charnerf").exists()


def test_drawings_of_another_size_are_named_before_any_work(
    dataset: Path, conf: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigError, match=r"image_size: found 64, expected 32.*capture MESHES .* --size 64"):
        captured = ["data=folder", f"data.root={dataset}", "scale.image_size=64"]
        check_command_line(["scale=smoke", *captured], conf=conf)
    with pytest.raises(ConfigError, match=r"data\.size: found 16, expected scale\.image_size = 32"):
        check_command_line(["scale=smoke", "data.size=16"], conf=conf)
    assert not list(tmp_path.iterdir())
