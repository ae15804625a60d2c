"""The figures of README.md and docs/*.md, written from files of this repository by `python -m docs`."""
