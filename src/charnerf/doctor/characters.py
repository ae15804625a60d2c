"""A data set's characters examined, one by one: files, figures, cameras, mesh."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import torch

from charnerf.data.layout import DATASET_FILE, MESH_FILE, TRANSFORMS_FILE, read_dataset
from charnerf.doctor.camera_file import read_camera_file
from charnerf.doctor.depth import depth_findings
from charnerf.doctor.figure import figure_alpha, figure_findings
from charnerf.doctor.finding import Finding
from charnerf.doctor.geometry import geometry_findings
from charnerf.doctor.picture_files import DEPTH_AGAIN, duplicates, picture_findings
from charnerf.doctor.seen import seen
from charnerf.doctor.surface import mesh_findings
from charnerf.doctor.views import Patient, View
from charnerf.errors import DataError
from charnerf.foreign.base import AbstractFormat, Found
from charnerf.foreign.kept import is_ours, recognised
from charnerf.foreign.shot import read_mask
from charnerf.foreign.transforms_json import TransformsJson, camera_files
from charnerf.geometry.carving import spread
from charnerf.parallel import in_processes
from charnerf.wording import counted, listed

MOST_ALIKE = 3  # findings of one kind that are told of a character
PICTURE_SIDE = 256  # pixels of evidence
MOST_SEEN = 400  # views of a character whose cameras are compared
MOST_BYTES_HELD = 2**30  # of a character's pictures at once; further ones are not examined


def dataset_findings(
    root: Path, *, processes: int | None, counter: Callable[[int], Callable[[], object]]
) -> list[Finding]:
    """What is wrong with a data set, ours or foreign.

    Args:
        root: Its folder.
        processes: Worker processes; None for one a core.
        counter: Gets how many characters there are; what it answers is called after each.

    Raises:
        DataError: If it is no data set at all.
    """
    told: list[Finding] = []
    if is_ours(root):
        try:
            splits = read_dataset(root).splits
        except DataError as error:
            where = str(root / DATASET_FILE)
            return [Finding("broken list", where, str(error), "a list of splits", "Write it again.")]
        told += _split_findings(root, splits)
        names = list(dict.fromkeys(name for members in splits.values() for name in members))
        patients = [partial(_of_ours, root, name) for name in names]
    else:
        form, found = recognised(root)
        patients = [partial(_of_foreign, form, one) for one in found]
    examined = counter(len(patients))
    with in_processes(_examine, patients, processes) as results:
        for _, findings in results:
            examined()
            told += findings
    return told


def _split_findings(root: Path, splits: Mapping[str, Sequence[str]]) -> Iterator[Finding]:
    """Characters that are trained on and measured on."""
    for measured in ("val", "test"):
        both = sorted(set(splits.get("train", ())) & set(splits.get(measured, ())))
        if both:
            yield Finding(
                "character in two splits", str(root / DATASET_FILE), f"{listed(both, 1)} in train and in {measured}",
                "characters to measure on that are not trained on", "Take them out of one of the two.",
            )  # fmt: skip


def _examine(admit: Callable[[], Patient]) -> list[Finding]:
    """All that is wrong with a character; views whose pictures are wrong say nothing of cameras and mesh."""
    patient = admit()
    findings = list(patient.findings)
    views: list[View] = []
    pictures: list[np.ndarray] = []
    alphas: list[np.ndarray] = []
    for view in patient.views:
        if sum(picture.size for picture in pictures) > MOST_BYTES_HELD:
            break
        picture, alpha, wrong = _examined_view(view)
        findings += wrong
        if picture is not None and alpha is not None:
            views.append(view)
            pictures.append(picture)
            alphas.append(alpha)
    twice = list(duplicates(views, pictures))
    again = {one.where for one in twice}
    kept = [place for place, view in enumerate(views) if str(view.file) not in again]
    kept = spread(torch.tensor(kept, dtype=torch.long), MOST_SEEN).tolist()
    findings += twice
    if not kept:
        return _told(
            [*findings, *mesh_findings(patient, None), *depth_findings(patient.views, {}, are_right=False)]
        )
    views, pictures, alphas = ([every[place] for place in kept] for every in (views, pictures, alphas))  # type: ignore[assignment]
    wrong, agreeing = geometry_findings(patient, seen(views, pictures, alphas))
    findings += [*wrong, *mesh_findings(patient, agreeing)]
    told = {one.where for one in findings}  # whose pictures or cameras are wrong, whatever their depth is
    right = {
        view.key: alpha
        for view, alpha in zip(views, alphas, strict=True)
        if not told & {str(view.file), view.key}
    }
    are_right = patient.in_our_frame and not findings
    return _told([*findings, *depth_findings(patient.views, right, are_right=are_right)])


def _examined_view(view: View) -> tuple[np.ndarray | None, np.ndarray | None, list[Finding]]:
    """A view's picture and alpha, None where they are of no use to geometry, and what is wrong with them."""
    picture, findings = picture_findings(view.file, view.size)
    if picture is None:
        return None, None, findings
    mask, wrong = _mask(view, (picture.shape[1], picture.shape[0]))
    findings += wrong
    alpha = figure_alpha(picture, mask)
    wrong = list(figure_findings(view, picture, alpha))
    fits = picture.shape[1::-1] == view.size
    return picture, alpha if fits and not wrong else None, findings + wrong


def _mask(view: View, size: tuple[int, int]) -> tuple[np.ndarray | None, list[Finding]]:
    """A view's mask (H, W) in [0, 1], None where there is none that fits."""
    if view.mask is None:
        return None, []
    try:
        return read_mask(view.mask, size).numpy(), []
    except DataError as error:
        fix = "Restore it, or make it as large as its picture."
        return None, [Finding("broken mask", str(view.mask), str(error), "a mask of its picture's size", fix)]


def _told(findings: Sequence[Finding]) -> list[Finding]:
    """Findings of a character, few of each kind, with small pictures: hundreds of views may have one and the same fault."""
    told = []
    for fault in dict.fromkeys(one.fault for one in findings):
        alike = [one for one in findings if one.fault == fault]
        more = len(alike) - MOST_ALIKE
        last = alike[:MOST_ALIKE][-1]
        shown = alike[:MOST_ALIKE]
        if more > 0:
            shown[-1] = replace(
                last,
                found=f"{last.found}; and {counted(more, 'more view')} of this character with this fault",
            )
        told += [replace(one, picture=_small(one.picture)) for one in shown]
    return told


def _small(picture: np.ndarray | None) -> np.ndarray | None:
    """A picture of at most about PICTURE_SIDE pixels a side."""
    if picture is None:
        return None
    step = -(-max(picture.shape[:2]) // PICTURE_SIDE)
    return np.ascontiguousarray(picture[::step, ::step])


def _of_ours(root: Path, name: str) -> Patient:
    folder = root / name
    path = folder / TRANSFORMS_FILE
    if not folder.is_dir():
        fix = "Capture it, or take it out of dataset.json."
        wrong = Finding(
            "missing file", str(folder), "no such folder", "the character that dataset.json lists", fix
        )
        return Patient(name, folder, None, (), (wrong,))
    views, findings = _read(folder, [path])
    lost = [view.depth for view in views if view.depth is not None and not view.depth.is_file()]
    if lost:
        found, expected = f"no {listed([str(one) for one in lost], 1)}", "every depth picture that it names"
        findings.append(Finding("missing file", str(path), found, expected, "Capture it again.", DEPTH_AGAIN))
    if views and not any(view.is_source for view in views):
        fix = "Capture the character again, or read it as a foreign set."
        findings.append(Finding("missing entry", f"{path}: source_views", "none", "front, side or back", fix))
    mesh = folder / MESH_FILE
    has_mesh = mesh.is_file() and mesh.resolve().is_relative_to(folder.resolve())
    return Patient(
        name, folder, path, tuple(views), tuple(findings), mesh if has_mesh else None, in_our_frame=True
    )


def _of_foreign(form: AbstractFormat, found: Found) -> Patient:
    if isinstance(form, TransformsJson):
        files = camera_files(found.folder)
        views, findings = _read(found.folder, files)
        unique = {view.file: view for view in reversed(views)}
        # nothing reads their depth, which may be a sensor's, of the whole room
        kept = tuple(replace(view, depth=None) for view in views if unique[view.file] is view)
        return Patient(found.name, found.folder, files[0] if len(files) == 1 else None, kept, tuple(findings))
    try:
        shots = form.shots(found)
    except DataError as error:
        fix = "Mend what is named, and ask again."
        wrong = Finding(
            "unreadable character", str(found.folder), str(error), f"a character of {form.title}", fix
        )
        return Patient(found.name, found.folder, None, (), (wrong,))
    views = [
        View(
            name=shot.file.name,
            file=shot.file,
            key=shot.where,
            matrix=np.reshape(shot.pose, (4, 4)),
            focal=shot.focal,
            centre=shot.centre,
            size=shot.size,
            mask=shot.mask,
        )
        for shot in shots
    ]
    return Patient(found.name, found.folder, None, tuple(views), ())


def _read(folder: Path, paths: list[Path]) -> tuple[list[View], list[Finding]]:
    """Views of camera files, and what is wrong in them."""
    views: list[View] = []
    findings: list[Finding] = []
    for path in paths:
        try:
            some, wrong = read_camera_file(folder, path)
        except DataError as error:
            fix = "Write it again, or capture the character again."
            findings.append(
                Finding("broken camera file", str(path), str(error), "a JSON object with frames", fix)
            )
            continue
        views += some
        findings += wrong
    return views, findings
