"""A run folder examined: weights, checkpoints, figures, and the data set that it was made of."""

from collections.abc import Iterator
from pathlib import Path

from charnerf.data.digest import training_digest
from charnerf.data.layout import DATASET_FILE
from charnerf.doctor.finding import Finding
from charnerf.errors import CharNeRFError, DataError
from charnerf.inference.checkpoint_file import read_checkpoint
from charnerf.inference.weights import load
from charnerf.reporting.run_files import read_curve, read_metrics
from charnerf.reporting.runs import data_root, read_runs
from charnerf.training.identity import written_run

CONFIG, WEIGHTS, METRICS, CURVE = "config.yaml", "weights.safetensors", "metrics.json", "curve.csv"


def run_findings(folder: Path, *, trusted: tuple[str, ...] = ()) -> Iterator[Finding]:
    """What is wrong with a run's folder."""
    again = f"python train.py hydra.run.dir={folder} ckpt_path=last"
    if not (folder / METRICS).is_file():
        yield Finding(
            "unfinished run",
            str(folder),
            f"no {METRICS}",
            "a run that came to its end",
            "Go on with it.",
            again,
        )
    yield from _weights(folder, trusted)
    for file in sorted((folder / "checkpoints").glob("*.ckpt")):
        try:
            read_checkpoint(file)
        except DataError as error:
            fix = "Remove it; with ckpt_path=last the run goes on from the one before."
            yield Finding(
                "truncated file", str(file), str(error), "a checkpoint with its checksum", fix, again
            )
    for file in sorted(folder.glob("nonfinite_batch_*.pt")):
        fix = "Lower optimizer.lr; `charnerf check RUN` looks at the field on stiff cases."
        yield Finding(
            "numbers that are not finite",
            str(file),
            "a batch whose loss was not finite",
            "none",
            fix,
            f"charnerf check {folder}",
        )
    for name, read in ((METRICS, read_metrics), (CURVE, read_curve)):
        if (folder / name).is_file():
            try:
                read(folder / name)
            except DataError as error:
                command = f"charnerf evaluate {folder} --data DATASET -o {folder}" if name == METRICS else ""
                yield Finding(
                    "truncated file",
                    str(folder / name),
                    str(error),
                    "a file as the run wrote it",
                    "Measure again.",
                    command,
                )
    yield from _data(folder)


def _weights(folder: Path, trusted: tuple[str, ...]) -> Iterator[Finding]:
    try:
        load(folder, trusted_targets=trusted)
    except CharNeRFError as error:
        yield Finding(
            "broken weights",
            str(folder / WEIGHTS),
            str(error),
            "finite weights that fit their config",
            "Copy them again, or take checkpoints/best.ckpt.",
        )


def _data(folder: Path) -> Iterator[Finding]:
    """Whether the data set is there and is that of training, by what the last checkpoint says of it."""
    runs = []
    try:
        runs = [run for run in read_runs(folder) if run.folder == folder]
        root = data_root(runs[0]) if runs else None
    except DataError:
        return  # said above
    if root is None:
        return
    if not root.is_dir():
        yield Finding(
            "missing file",
            str(root),
            "no such folder",
            "the data set that the run was measured on",
            "Restore it.",
            is_broken=False,
        )
        return
    checkpoint = folder / "checkpoints" / "last.ckpt"
    if not checkpoint.is_file():
        return
    try:
        noted = written_run(checkpoint).data
        changed = [split for split, digest in noted.items() if training_digest(root, split) != digest]
    except DataError as error:
        yield Finding(
            "changed data set",
            str(root),
            str(error),
            "the data set of the run",
            "Restore it.",
            f"charnerf doctor {root}",
        )
        return
    if changed:
        yield Finding(
            "changed data set", str(root), f"another digest of {', '.join(changed)} than {checkpoint} notes",
            "the data set of the run", "Restore it, or train again.", f"charnerf doctor {root}",
        )  # fmt: skip


def is_run(folder: Path) -> bool:
    """Whether a folder is a run's."""
    return (folder / CONFIG).is_file() and not (folder / DATASET_FILE).exists()
