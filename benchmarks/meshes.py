"""Meshes by resolution, by number of cameras, on sparse and full grids: seconds against distance to the finest."""

from __future__ import annotations

import time
from typing import Any

from benchmarks.grids import grid_sampler, hausdorff
from charnerf.bench.subjects import Subject
from charnerf.meshing.extract import extract_surface
from charnerf.meshing.optical_depth import SURFACE

RESOLUTIONS = (64, 96, 128, 192)
FINEST = 256
CAMERAS = (1, 4, 8)


def mesh_rows(subject: Subject) -> list[dict[str, Any]]:
    """Seconds, points and the largest distance to the surface of the finest grid, m."""
    finest = grid_sampler(subject, FINEST, 8)
    truth = extract_surface(finest.evaluate_surface(SURFACE), SURFACE).mesh
    cameras = CAMERAS if subject.scene.field.sees_directions else CAMERAS[-1:]
    rows = []
    for resolution in RESOLUTIONS:
        for count in cameras:
            for name in ("sparse", "full"):
                start = time.perf_counter()
                sampler = grid_sampler(subject, resolution, count)
                grid = sampler.evaluate_surface(SURFACE) if name == "sparse" else sampler.evaluate_all()
                mesh = extract_surface(grid, SURFACE).mesh
                seconds = time.perf_counter() - start
                rows.append(
                    {
                        "grid": name,
                        "cells": resolution,
                        "cameras": count,
                        "seconds": seconds,
                        "points": sampler.num_evaluated,
                        "distance": hausdorff(mesh, truth),
                    }
                )
    return rows
