"""`charnerf env`: what a bug report needs to know of the machine."""

from charnerf.cli.summary import JsonFile, check_json, show, write_json

EXAMPLES = ("charnerf env", "charnerf env --json env.json")
EXTRAS = ("plotly", "usd-core", "transformers", "gradio", "bpy")
CORE = ("torch", "lightning", "hydra-core", "numpy", "scipy", "pillow", "trimesh", "embreex", "typer", "rich")


def command(*, json_file: JsonFile = None) -> None:
    """Print versions, processor, memory and what optional things are there: paste it into a bug report."""
    check_json(json_file)
    facts = _facts()
    width = max(map(len, facts))
    lines = [f"{name:<{width}}  {'-' if value is None else value}" for name, value in facts.items()]
    show("\n".join(lines), json_file)
    write_json(facts, json_file)


def _facts() -> dict[str, str | int | float | None]:
    """Versions and machine; None where something is not there."""
    import os
    from pathlib import Path

    import torch

    import charnerf
    from charnerf.evaluation.environment import environment

    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    facts: dict[str, str | int | float | None] = {"charnerf": charnerf.__version__, **environment(device)}
    facts |= {"cuda": torch.version.cuda, "cores": os.cpu_count(), "memory_gib": _memory_gib()}
    facts["installed_at"] = str(Path(charnerf.__file__).parent)
    facts["ffmpeg"] = _ffmpeg()
    return facts | {f"package {name}": _version(name) for name in (*CORE, *EXTRAS)}


def _version(name: str) -> str | None:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _memory_gib() -> float | None:
    import os

    try:
        return round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30, 1)
    except (AttributeError, OSError, ValueError):  # Windows
        return None


def _ffmpeg() -> str | None:
    from imageio_ffmpeg import get_ffmpeg_version

    try:
        return str(get_ffmpeg_version())
    except RuntimeError:  # no program came with the package
        return None
