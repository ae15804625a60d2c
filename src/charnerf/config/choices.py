"""What a config group is set to, checked before Hydra composes it."""

from collections.abc import Sequence

from hydra.core.override_parser.types import Override

from charnerf.config.hints import nearest
from charnerf.config.overrides import options_in
from charnerf.config.schema import LIST_GROUPS
from charnerf.errors import ConfigError


def check_choice(override: Override) -> None:
    """Check what an override sets a group to; names that no option has are left to Hydra.

    Hydra would merge two options of one part into one section, and take an option that is listed twice for once.

    Raises:
        ConfigError: If a group of one part is set to several, or a list holds what is no name, or one twice.
    """
    group, value = override.key_or_group, override.value()
    if "." in group or isinstance(value, str) or override.is_delete():  # a key's value, or one option
        return
    if value is None and group not in LIST_GROUPS:
        return
    options = options_in(group)
    if not options:
        return
    listed = value if group in LIST_GROUPS and isinstance(value, list) else [value]
    if not all(isinstance(one, str) for one in listed):
        raise no_option(group, override.get_value_string(), options)
    for one in listed:
        if listed.count(one) > 1:
            raise ConfigError(f"{group}: found '{one}' {listed.count(one)} times, expected each option once.")


def no_option(group: str, name: str, options: Sequence[str]) -> ConfigError:
    """The error about what is no option of its group."""
    advice = nearest(name, options)
    also = f" D{advice[1:]}" if advice.startswith("did") else ""
    return ConfigError(
        f"{group}: found no option '{name}', expected one of: {', '.join(sorted(options))}.{also}"
    )
