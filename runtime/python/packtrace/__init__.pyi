"""Bakes pbrt-v3 scenes to .ptk files, reads them as numpy arrays, and renders ambient occlusion."""

from os import PathLike
from typing import Any, Literal, Mapping, Optional, Sequence, Tuple, Union

import numpy
from numpy.typing import NDArray

__all__ = ["Error", "File", "bake", "open", "render"]
__version__: str

_Path = Union[str, PathLike[str]]

class Error(RuntimeError):
    """Bad input, I/O or options. Its text is complete; where a file is to blame it begins "file:line:column: "."""

    kind: Literal["usage", "input", "unsupported", "limit_exceeded", "io", "cancelled"]
    exit_code: int

class File:
    """A baked file, validated as a whole when opened. Arrays of streams() keep it alive."""

    @property
    def geometry_count(self) -> int:
        """Geometries, with those that are coarser LOD levels of others."""
    @property
    def base_geometry_count(self) -> int:
        """Geometries that instances refer to; they come first."""
    @property
    def file_bytes(self) -> int:
        """Size with codec none, which is what is held in memory."""
    def info(self, by_geometry: bool = ...) -> dict[str, Any]:
        """What `packtrace info --json` writes (docs/json_output.md)."""
    def streams(self) -> dict[str, NDArray[Any]]:
        """The file's sections by name, as read-only views of its memory; nothing is copied.

        Sections of records have structured types whose fields are those of compress/format/layout/baked_format.h.
        """
    def decode(self, geometry: int) -> dict[str, NDArray[Any]]:
        """A geometry in object space: positions (n, 3) float32, triangles (m, 3) uint32 and clusters (m,) uint32.

        Normals (n, 3) and uvs (n, 2), both float32, are there if a cluster stores them; other clusters' rows are NaN.
        """

def bake(
    scene: _Path,
    output: _Path,
    *,
    purpose: Literal["ao", "shading"] = ...,
    precision_edge: Optional[float] = ...,
    precision_abs: Optional[float] = ...,
    position_bits: Optional[int] = ...,
    normals: str = ...,
    keep_normals: bool = ...,
    keep_uvs: bool = ...,
    codec: Literal["none", "fast", "small"] = ...,
    lod: Literal["off", "instanced", "all"] = ...,
    strict: bool = ...,
    force: bool = ...,
) -> dict[str, Any]:
    """Packs a pbrt-v3 scene to a .ptk file. Returns what info() returns, with "problems", a list of str.

    At most one of precision_edge, precision_abs and position_bits may be given; without one, the precision is such
    that images of ambient occlusion do not show it (docs/accuracy.md). Raises Error; force replaces an existing file.
    """

def open(path: _Path) -> File:
    """Maps a .ptk file and validates it. Raises Error."""

def render(
    file: File,
    *,
    size: Optional[Tuple[int, int]] = ...,
    camera: Optional[int] = ...,
    frames: int = ...,
    spp: int = ...,
    denoise: bool = ...,
    denoiser: Literal["ours", "reference", "off"] = ...,
    denoiser_settings: Mapping[str, float] = ...,
    layers: Optional[Sequence[str]] = ...,
    ao_radius: Optional[float] = ...,
    ao_resolution: Literal["full", "quarter"] = ...,
    ao_rate: Literal["full", "checkerboard", "adaptive"] = ...,
    ao_sampler: Literal["net", "sobol", "jitter", "lattice", "independent"] = ...,
    ao_settings: Mapping[str, float] = ...,
    view: Literal["ao", "pbr", "pbr+ao"] = ...,
    shade_settings: Mapping[str, float] = ...,
    backend: Literal["packed", "gpu", "gpu-rt", "embree"] = ...,
    seed: int = ...,
) -> dict[str, NDArray[Any]]:
    """Renders a view. Returns arrays with rows from top to bottom, of height x width pixels:

    ao (denoised; -1 where nothing is hit), ao_raw (last frame), depth, coverage: float32;
    normal, albedo, shaded: float32 with 3 channels, linear colours; instance: uint32, 0xffffffff where nothing is hit.

    layers chooses among these and hit_distance, previous_depth, local_variance, variance, history, disocclusion (float32)
    and motion (float32 with 2 channels), as docs/command_line.md describes them. denoiser_settings are those of
    `packtrace help denoise`; denoise=False is denoiser="off", without variance, history and disocclusion.

    size is (width, height), by default the camera's. camera counts from 0; None frames the whole scene, as for files
    without cameras. ao_radius is in world units, by default a tenth of the scene's diagonal. ao_resolution, ao_rate and
    ao_sampler are those of `packtrace help render`, ao_settings those of docs/ambient_occlusion.md.
    With view "pbr" or "pbr+ao", of files baked for shading, there are also pbr, direct and specular; shade_settings are
    those of docs/shading.md. Raises Error.
    """
