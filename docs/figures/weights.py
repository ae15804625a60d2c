"""The weights in the package."""

from safetensors import safe_open

from docs.figures.sources import ROOT

RELEASED = ROOT / "src" / "charnerf" / "weights" / "released.safetensors"


def weights() -> str:
    """How many parameters they are, and how large their file is."""
    with safe_open(RELEASED, "pt") as file:
        count = sum(file.get_tensor(name).numel() for name in file.keys())
    return f"{count / 1e6:.2f} million parameters, {RELEASED.stat().st_size / 1e6:.1f} MB"
