"""The data of a run: its splits, and a datamodule that opens what the loss needs."""

import logging
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from omegaconf import DictConfig
from torch import Tensor

from charnerf.data.augmentation.sequence import AugmentationSequence
from charnerf.data.characters import Character
from charnerf.data.datamodule import MixedDataModule
from charnerf.data.mixed import MixedDataset
from charnerf.data.sampler import PhaseSampler, Share
from charnerf.data.shards import is_cache, read_index_once
from charnerf.data.silhouettes import SilhouetteSpace
from charnerf.data.space import AbstractSpace
from charnerf.data.store import CharacterStore, SpaceOf, SurfaceOf, no_space, no_surface
from charnerf.data.surface import AbstractSurface
from charnerf.data.window import Window, groups_of
from charnerf.inference.build import build_part
from charnerf.losses.base import Needs
from charnerf.models.charnerf import CharNeRF
from charnerf.surfaces.mesh_files import load_surface_mesh
from charnerf.training.clock import RunClock
from charnerf.types import Hull

log = logging.getLogger(__name__)


def build_data(
    cfg: DictConfig, root: Path, model: CharNeRF, clock: RunClock, needs: Needs
) -> MixedDataModule:
    """The datamodule; what no loss needs is not opened."""
    splits, batches, validation = cfg.splits, cfg.batches, cfg.validation

    def make_dataset(store: CharacterStore, share: Share) -> MixedDataset:
        return MixedDataset(
            store=store,
            characters=cfg.scale.batch_characters,
            foreground_share=batches.foreground_share,
            needs=needs,
            used_views=model.views,
            augmentation=AugmentationSequence(
                [build_part(one, {"used_views": model.views}) for one in cfg.augmentation.values()]
            ),
            seed=cfg.seed,
            share=share,
            window=_window(root, store.names, batches, seed=cfg.seed),
        )

    return MixedDataModule(
        root=root,
        train_splits=list(splits.train),
        val_split=splits.val,
        val_characters=validation.characters,
        val_views=validation.views,
        carve=model.carve,
        memory_mib=batches.memory_mib,
        workers=batches.workers,
        surface_of=_surface_of(cfg) if needs.surface else no_surface,
        space_of=_space_of(cfg) if needs.space_points else no_space,
        make_dataset=make_dataset,
        sampler=PhaseSampler(
            schedule=build_part(cfg.schedule), position=clock.position, num_marks=validation.times
        ),
    )


def _window(root: Path, names: Sequence[str], batches: DictConfig, *, seed: int) -> Window | None:
    """What training draws from where the config says how many at a time; shards come and go whole."""
    if batches.window is None or batches.window >= len(names):
        return None
    shards = [shard.names for shard in read_index_once(root).shards] if is_cache(root) else None
    groups = groups_of(names, shards)
    each = len(names) / len(groups)
    return Window(
        groups,
        held=max(1, round(batches.window / each)),
        steps=max(1, round(batches.window_steps * each)),
        seed=seed,
    )


def _surface_of(cfg: DictConfig) -> SurfaceOf:
    """Opens a character's surface; None without a mesh, which is logged once."""
    make_surface: Callable[..., AbstractSurface] = build_part(cfg.surface)
    warn = _warned_once("Character %s has no mesh: it is trained by rays alone.")

    def surface_of(character: Character) -> AbstractSurface | None:
        if character.mesh_file is None:
            warn(character)
            return None
        return make_surface(load_surface_mesh(character.mesh_file))

    return surface_of


def _space_of(cfg: DictConfig) -> SpaceOf:
    """Opens what a character's labelled points are drawn from; its pictures without a mesh, logged once if not asked for."""
    make_space: partial[AbstractSpace] = build_part(cfg.space)
    by_pictures = make_space.func is SilhouetteSpace
    warn = _warned_once("Character %s has no mesh: points in it are labelled by its pictures.")

    def space_of(character: Character, images: Tensor, hull: Hull | None) -> AbstractSpace | None:
        if by_pictures or character.mesh_file is not None or hull is None:
            return make_space(character, images, hull)
        warn(character)
        return SilhouetteSpace(character, images, hull)

    return space_of


def _warned_once(message: str) -> Callable[[Character], None]:
    """Logs a message of the first character that it is called with."""
    first: list[str] = []

    def warn(character: Character) -> None:
        if not first:
            first.append(character.name)
            log.warning(message, character.name)

    return warn
