"""From front, side and back drawings of a character to a neural radiance field, novel views and a mesh.

import charnerf
model = charnerf.load()
hero = model.encode(front="front.png", side="side.png", back="back.png")
image = hero.render(azimuth_deg=45, elevation_deg=10, size=256)
charnerf.save_mesh(hero.mesh(resolution=128), "hero.glb")

The names below are imported when they are first used, so that `import charnerf` costs nothing.
"""

import importlib
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from charnerf.errors import (
        CharNeRFError as CharNeRFError,
    )
    from charnerf.errors import (
        ConfigError as ConfigError,
    )
    from charnerf.errors import (
        DataError as DataError,
    )
    from charnerf.errors import (
        DependencyError as DependencyError,
    )
    from charnerf.errors import (
        NumericalError as NumericalError,
    )
    from charnerf.errors import (
        ShapeError as ShapeError,
    )
    from charnerf.inference.baked_file import load_baked as load_baked
    from charnerf.inference.baked_file import save_baked as save_baked
    from charnerf.inference.hero import Hero as Hero
    from charnerf.inference.model import Model as Model
    from charnerf.inference.weights import load as load
    from charnerf.inference.weights import save_weights as save_weights
    from charnerf.meshing.export import save_mesh as save_mesh

try:
    __version__ = version("charnerf")
except PackageNotFoundError:  # a checkout on the path, not installed
    __version__ = "0+unknown"

_HOMES = {
    "load": "charnerf.inference.weights",
    "save_weights": "charnerf.inference.weights",
    "load_baked": "charnerf.inference.baked_file",
    "save_baked": "charnerf.inference.baked_file",
    "save_mesh": "charnerf.meshing.export",
    "Model": "charnerf.inference.model",
    "Hero": "charnerf.inference.hero",
    "CharNeRFError": "charnerf.errors",
    "ConfigError": "charnerf.errors",
    "DataError": "charnerf.errors",
    "DependencyError": "charnerf.errors",
    "NumericalError": "charnerf.errors",
    "ShapeError": "charnerf.errors",
}
__all__ = ["__version__", *_HOMES]  # noqa: PLE0604 (strings all)


def __getattr__(name: str) -> Any:
    """Import a public name from where it lives."""
    if name not in _HOMES:
        raise AttributeError(f"module 'charnerf' has no attribute '{name}'")
    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    """Public names, whether imported yet or not."""
    return sorted([*globals(), *_HOMES])
