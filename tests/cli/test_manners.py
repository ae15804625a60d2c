"""How commands behave: quiet, for programs, with examples, with names that shells find hard."""

import json
import shlex
from pathlib import Path

import pytest
import typer

from charnerf.cli import commands, run
from charnerf.cli.commands import door
from charnerf.cli.messages import quiet, say
from charnerf.cli.summary import Summary, close, typed
from charnerf.errors import DependencyError
from charnerf.meshing import export
from charnerf.training import search
from charnerf.training.search import Tried

COMMANDS = typer.main.get_command(door).commands
GENERATE = [
    "generate",
    "--train",
    "0",
    "--val",
    "0",
    "--test",
    "1",
    "--views",
    "1",
    "--size",
    "16",
    "--jobs",
    "1",
]


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    """One embedded character, in a folder whose name begins with a dash and has a space and an umlaut."""
    folder = tmp_path_factory.mktemp("sets") / "-mär chen"
    assert run([*GENERATE, "-o", str(folder)]) == 0
    return folder


def test_a_command_ends_with_what_was_made_where_and_how_long(tmp_path, capsys):
    close(
        Summary(
            "a ball",
            (tmp_path / "ball.glb",),
            0.0,
            quality="round",
            doubts=("is it one?",),
            try_=("more", "less"),
            next_=("go",),
        ),
        None,
    )
    lines = capsys.readouterr().err.splitlines()
    assert lines[1] == "made      a ball" and lines[2] == f"where     {tmp_path / 'ball.glb'}"
    assert lines[3] == "how good  round" and lines[4].startswith("how long  ")
    assert lines[5:] == ["doubtful  is it one?", "try       more", "          less", "next      go"]


def test_programs_get_json_and_quiet_leaves_standard_error_empty(dataset, tmp_path, capsys):
    drawn = [
        "draw",
        "--data",
        str(dataset),
        "--character",
        "test_00000",
        "-o",
        str(tmp_path / "x"),
        "--size",
        "32",
    ]
    name = next(path.name for path in dataset.iterdir() if path.is_dir())
    drawn[4] = name
    assert run([*drawn, "--json", "-", "--quiet"]) == 0
    told = capsys.readouterr()
    found = json.loads(told.out)
    assert (
        told.err == "" and found["made"] == "3 drawings" and len(found["files"]) == 3 and found["seconds"] > 0
    )
    assert shlex.split(found["next"][0])[:2] == ["charnerf", "reconstruct"]
    assert run(["--quiet", *drawn, "--json", str(tmp_path / "made.json")]) == 0
    assert json.loads((tmp_path / "made.json").read_text())["made"] == "3 drawings"
    assert capsys.readouterr().err == ""


def test_json_that_can_not_be_written_is_refused_before_the_work(dataset, tmp_path, capsys):
    (tmp_path / "file").write_text("")
    where = ["--json", str(tmp_path / "file" / "made.json")]
    assert run([*GENERATE, "-o", str(tmp_path / "new"), *where]) == 1
    assert "found a file, expected a folder" in capsys.readouterr().err and not (tmp_path / "new").exists()


@pytest.mark.parametrize(
    "command", [name for name in COMMANDS if name not in ("train", "app")]
)  # Hydra reads the arguments of one, the other ends by a signal alone
def test_every_command_gives_programs_json(command):
    (option,) = [one for one in COMMANDS[command].params if "--json" in one.opts]
    assert option.default is None and "standard output" in option.help


def test_a_doctor_closes_as_others_do(dataset, tmp_path, capsys):
    examined = ["doctor", str(dataset), "-o", str(tmp_path / "out"), "--jobs", "1"]
    status = run([*examined, "--json", "-", "--quiet"])
    told = capsys.readouterr()
    found = json.loads(told.out)
    assert told.err == "" and found["made"] == f"an examination of {dataset}"
    assert status == (found["details"]["broken"] > 0)
    assert found["files"] == [str(tmp_path / "out" / name) for name in ("doctor.html", "doctor.json")]


def test_a_packing_closes_as_others_do(dataset, tmp_path, capsys):
    pytest.importorskip("webdataset")
    assert (
        run(["pack", "--data", str(dataset), "-o", str(tmp_path / "shards"), "--json", "-", "--quiet"]) == 0
    )
    told = capsys.readouterr()
    found = json.loads(told.out)
    assert (
        told.err == "" and found["made"] == "1 character in 1 shard" and found["details"]["characters"] == 1
    )


def test_a_search_closes_as_others_do(tmp_path, monkeypatch, capsys):
    """Without the trainings."""
    pytest.importorskip("optuna")
    found = [Tried({"encoder": "single"}, 0.25, 1.5), Tried({"encoder": "double"}, 0.125, 4.0)]
    monkeypatch.setattr(search.Search, "run", lambda *_, **__: None)
    monkeypatch.setattr(search.Search, "front", lambda _: found)
    space = ["search", "encoder=single,double", "-o", str(tmp_path / "found")]
    assert run([*space, "--json", "-", "--quiet"]) == 0
    told = capsys.readouterr()
    content = json.loads(told.out)
    assert told.err == "" and content["quality"] == "error 0.2500 in 1.5 s, error 0.1250 in 4 s"
    assert content["files"] == [str(tmp_path / "found" / "front.csv")]
    assert [one["seconds"] for one in content["details"]["front"]] == [1.5, 4.0]


def test_quiet_lets_warnings_through(capsys):
    with quiet():
        say("front: cut out by its alpha.")
        say("warning: the back fits the front better unmirrored.")
    assert capsys.readouterr().err == "warning: the back fits the front better unmirrored.\n"


def test_a_character_that_is_not_there_is_answered_with_those_that_are(dataset, tmp_path, capsys):
    assert run(["mesh", "--data", str(dataset), "--character", "nobody", "-o", str(tmp_path / "x")]) == 1
    name = next(path.name for path in dataset.iterdir() if path.is_dir())
    assert f"found no character 'nobody', expected one of the data set's: {name}." in capsys.readouterr().err


def test_a_format_that_misses_its_library_is_refused_before_the_work(dataset, tmp_path, monkeypatch, capsys):
    def missing() -> None:
        raise DependencyError(".usdz: Pixar's library is missing.")

    monkeypatch.setattr(export, "check_usd", missing)
    arguments = [
        "mesh",
        "--data",
        str(dataset),
        "--character",
        "nobody",
        "-o",
        str(tmp_path / "x"),
        "--format",
        "usdz",
    ]
    assert run(arguments) == 1
    assert "Pixar's library is missing" in capsys.readouterr().err, "and not that nobody is there"


@pytest.mark.parametrize("command", [name for name in COMMANDS if name != "train"])
def test_help_shows_examples_as_they_are_typed(command, capsys):
    assert run([command, "--help"]) == 0
    text = capsys.readouterr().out
    examples = getattr(commands, command).EXAMPLES
    assert examples and all(f"\n    {example}\n" in text for example in examples)
    assert all(shlex.split(example)[:2] == ["charnerf", command] for example in examples)


def test_flags_after_two_dashes_are_names(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run(["report", "--", "--quiet"]) == 2
    assert "--quiet" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("charnerf reconstru", ["reconstruct"]),
        ("charnerf mesh --charac", ["--character"]),
        ("charnerf mesh --data DATASET --character ", ["NAME"]),
        ("charnerf evaluate --data DATASET --split t", ["test"]),
        ("charnerf mesh --data nowhere --character ", []),
        ("charnerf reconstruct --texture d", ["drawings"]),
    ],
)
def test_tab_completes(words, offered, dataset, monkeypatch, capsys):
    """As bash asks: all words, and the place of the one that is typed."""
    name = next(path.name for path in dataset.iterdir() if path.is_dir())
    words = words.replace("DATASET", shlex.quote(str(dataset)))
    monkeypatch.setenv("_CHARNERF_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", words)
    monkeypatch.setenv("COMP_CWORD", str(len(shlex.split(words)) - (not words.endswith(" "))))
    assert run([]) == 0
    assert capsys.readouterr().out.split() == [one.replace("NAME", name) for one in offered]


def test_a_command_that_is_proposed_can_be_typed():
    assert (
        typed("reconstruct", Path("-a b.png"), "-o", Path("hero"))
        == "charnerf reconstruct './-a b.png' -o hero"
    )


def test_env_tells_versions_and_machine(tmp_path, capsys):
    assert run(["env", "--json", str(tmp_path / "env.json")]) == 0
    text, facts = capsys.readouterr().out, json.loads((tmp_path / "env.json").read_text())
    assert all(f"{name} " in text for name in ("charnerf", "torch", "python", "machine", "package rich"))
    assert facts["package typer"] and facts["cores"] >= 1 and "package bpy" in facts
