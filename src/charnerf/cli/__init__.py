"""The command `charnerf`: one file a command, with its options and what it does."""

from charnerf.cli.commands import main, run

__all__ = ["main", "run"]
