"""Bakes pbrt-v3 scenes to .ptk files, reads them as numpy arrays, and renders ambient occlusion."""

from ._packtrace import Error, File, __version__, bake, open, render

__all__ = ["Error", "File", "bake", "open", "render"]
