"""Figures told from what lies behind them by a network, where that is not plain: photographs, textures, painted scenes."""

from pathlib import Path
from typing import Any, final

import numpy as np
from PIL import Image

from charnerf.drawings.load import Drawing
from charnerf.errors import ConfigError, DependencyError
from charnerf.pictures import on_white, to_bytes
from charnerf.thread_count import restored_threads
from charnerf.wording import install_words, typed_or_clicked

MODEL = "isnet-anime"  # trained on drawn figures


@final
class NetworkMask:
    """A segmenter of rembg (extra `rembg`). Nothing is fetched: the model's file must be there.

    Args:
        model: Name of the model, as rembg calls it.

    Raises:
        DependencyError: If rembg is missing.
        ConfigError: If it has no such model on this machine.
    """

    def __init__(self, model: str = MODEL) -> None:
        session_type = _session_types().get(model)
        if session_type is None:
            raise ConfigError(
                f"{_option()}: found the model '{model[:60]}', expected one of {', '.join(sorted(_session_types()))}."
            )
        if session_type.resolve_existing(f"{model}.onnx") is None:
            raise ConfigError(
                f"{_option()}: found no {model}.onnx, expected the model's file in {Path(session_type.model_dir())}."
                f" Fetch it once: rembg d {model}."
            )
        self.model = model
        self._session: Any = None  # a network of 170 MB is read when the first drawing asks for it

    def __call__(self, drawing: Drawing) -> np.ndarray:
        """Share (H, W) in [0, 1] of each pixel that is figure."""
        new_session = _rembg().new_session
        self._session = self._session or new_session(self.model)
        (mask,) = self._session.predict(Image.fromarray(to_bytes(on_white(drawing.rgba))))
        return np.asarray(mask, np.float32) / 255.0


def _option() -> str:
    return typed_or_clicked("--segmenter", "The network for backgrounds")


def _session_types() -> dict[str, Any]:
    """Models of rembg that work on this machine with one file and answer with one mask, by name."""
    named = {one.name(): one for one in _rembg().sessions.sessions_class if one.is_local()}
    return {name: one for name, one in named.items() if not name.endswith(("_custom", "_cloth_seg", "sam"))}


def _rembg() -> Any:
    """The library, whose own libraries (Numba) set the number of threads of all others as they are imported."""
    try:
        with restored_threads():
            import rembg.sessions
    except ImportError as error:
        raise DependencyError(f"{_option()}: {error}. {install_words('rembg')}") from error
    return rembg
