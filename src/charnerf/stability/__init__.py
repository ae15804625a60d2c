"""Stiff and extreme cases of every kernel, and of trained fields; the doors import `run_check` from here."""

from charnerf.stability.check import run_check
from charnerf.stability.report import CheckReport
from charnerf.stability.trained import TrainedField

__all__ = ["CheckReport", "TrainedField", "run_check"]
