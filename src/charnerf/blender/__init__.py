"""Blender, in a process of its own, as a reader of files and a maker of pictures.

What runs there is `inside/`: bpy, numpy and what of charnerf needs no more. Its functions serve one job, after which the process
ends: they change bpy's one global scene. It has no `__init__.py`, since its modules can be imported in Blender alone.
"""
