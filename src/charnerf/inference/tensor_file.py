"""Safetensors files of ours: tensors and metadata, of a stated format."""

from pathlib import Path

from safetensors import SafetensorError, safe_open
from torch import Tensor

from charnerf.errors import DataError
from charnerf.files import open_regular


def read_tensors(
    file: Path, *, file_format: str, expected: str, otherwise: str
) -> tuple[dict[str, Tensor], dict[str, str]]:
    """Tensors by name, and the metadata.

    Args:
        file: What is read; nothing of it is executed.
        file_format: What its metadata must call it.
        expected: What the file should be, for the message where it can not be read.
        otherwise: What to do or think where it is of another format, a sentence.

    Raises:
        DataError: If it can not be read, or is of another format.
    """
    try:
        open_regular(file).close()
        with safe_open(str(file), framework="pt") as opened:
            metadata: dict[str, str] = opened.metadata() or {}
            tensors = {name: opened.get_tensor(name) for name in opened.keys()}
    except (SafetensorError, OSError) as error:
        raise DataError(f"{file}: can not be read as safetensors ({error}), expected {expected}.") from error
    if metadata.get("format") != file_format:
        raise DataError(
            f"{file}: found format {metadata.get('format')!r} in its metadata, expected {file_format!r}; {otherwise}"
        )
    return tensors, metadata
