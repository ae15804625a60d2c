"""The one error that is meant for the user."""


class Refused(Exception):
    """A file or a wish that can not be served; the message says what was found, what was expected, what to do."""
