"""The errors that charnerf raises on purpose.

Each message says where (file, argument or full config key), what was found, what was expected and what to do.
"""


class CharNeRFError(Exception):
    """Base of every error raised on purpose; the doors print it as one message without a traceback."""


class ConfigError(CharNeRFError, ValueError):
    """The composed configuration is wrong; the message names every full key."""


class ShapeError(CharNeRFError, ValueError):
    """A tensor has another shape than its function documents."""


class DataError(CharNeRFError, ValueError):
    """A file, image, mesh or data set can not be used; the message names the file."""


class NumericalError(CharNeRFError, ArithmeticError):
    """A computation left the finite numbers."""


class DependencyError(CharNeRFError, ImportError):
    """An optional dependency is missing; the message says what to install or do instead."""


class GridError(CharNeRFError, RuntimeError):
    """Cells of a grid are not done; the message names each one and why."""
