"""Options of meshes: one record, checked, with the defaults of every door."""

import inspect
import subprocess
import sys
from dataclasses import fields

import pytest

from charnerf.errors import ConfigError
from charnerf.inference.hero import Hero
from charnerf.meshing.options import MeshOptions


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("resolution", 15),
        ("num_cameras", 0),
        ("faces", 3),
        ("smooth", -1),
        ("height", 0.0),
        ("height", float("nan")),
        ("texture", "paint"),
        ("texture_size", 8193),
    ],
)
def test_an_option_out_of_range_is_named(name, value):
    with pytest.raises(ConfigError, match=f"{name}: found '?{value}"):
        MeshOptions(**{name: value})


def test_the_library_has_the_same_options_and_defaults():
    keywords = list(inspect.signature(Hero.mesh).parameters.values())[1:]
    assert [(one.name, one.default) for one in keywords] == [
        (one.name, one.default) for one in fields(MeshOptions)
    ]


def test_defaults_are_read_without_importing_anything_heavy():
    code = "import sys, charnerf.reconstruction.options; print({'torch', 'numpy'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
