"""Drawings and a model to a folder with mesh, turntable, views and report."""

from charnerf.reconstruction.folder import Reconstruction, reconstruct

__all__ = ["Reconstruction", "reconstruct"]
