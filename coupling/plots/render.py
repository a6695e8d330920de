"""Off-screen rendering of a scene with pyvista: images without text, which `drawing` puts into figures."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from coupling.plots.scene import Scene, Shape
from structures.structure import Vector

FEATURE_ANGLE = 30.0
"""Degrees between two faces, from which their common edge is drawn."""

LINE_OFFSET = 1e-3
"""Lines lie in front of the body, and those of the body at rest behind it, by this fraction of the picture."""

LINE_COLOUR, REST_COLOUR = "black", "#a0a0a0"

SAFE_WINDOWS = ("vtkEGLRenderWindow", "vtkWin32OpenGLRenderWindow", "vtkCocoaRenderWindow")
"""VTK's window types that either draw or fail with an exception. Other types may end the process, so they are first
tried in a separate process.
"""

WINDOW_PROBE = "import pyvista; pyvista.Plotter(off_screen=True).screenshot(return_img=True)"

NO_WINDOW = (
    "pictures are drawn off-screen by OpenGL, which this machine lacks: install EGL or OSMesa (Debian: libegl1 or "
    "libosmesa6) with vtk 9.4 or later, or start Python by xvfb-run"
)


class Renderer:
    """Images of a scene; close it after use.

    colours: a colour map of matplotlib. ends: its lower and upper end. pixels: the width of the images. line: the width
    of lines. Raises OSError if the machine cannot draw.
    """

    def __init__(self, scene: Scene, colours: str, ends: tuple[float, float], pixels: int, line: float) -> None:
        check_window()
        import pyvista

        self.scene, height = scene, max(2, round(pixels * scene.aspect))
        self.lift = LINE_OFFSET * float((scene.high - scene.low).max())
        with _quiet():
            plotter: Any = pyvista.Plotter
            self.plotter = plotter(
                off_screen=True, window_size=[pixels, height], lighting="none" if scene.flat else "light kit"
            )
        self.plotter.set_background("white")
        self.bodies = _surfaces(scene.shape, scene.rest())
        for surface, edges in self.bodies:
            if scene.flat:
                at_rest = edges.copy()
                at_rest.points[:, 2] -= self.lift
                self._add_lines(at_rest, REST_COLOUR, line)
            surface.point_data["value"] = np.zeros(surface.n_points)
            body = self.plotter.add_mesh(
                surface, scalars="value", cmap=colours, clim=ends, show_scalar_bar=False,
                lighting=not scene.flat, ambient=0.65, diffuse=0.4,
            )  # fmt: skip
            body.prop.interpolation = "Gouraud"
            self._add_lines(edges, LINE_COLOUR, line)
        self._aim()

    def _add_lines(self, edges: Any, colour: str, line: float) -> None:
        """Add lines with a dot at each joint: on fine meshes, segments shorter than a pixel are not drawn as lines.

        Dots are squares, no wider than the line in any direction; round ones would rise above the body.
        """
        self.plotter.add_mesh(edges, color=colour, line_width=line, lighting=False)
        self.plotter.add_mesh(edges, style="points", color=colour, point_size=line / sqrt(2.0), lighting=False)

    def _aim(self) -> None:
        low, high = self.scene.low, self.scene.high
        far = 10.0 * float((high - low).max())
        x, y = ((low + high) / 2.0).tolist()
        self.plotter.enable_parallel_projection()
        camera = self.plotter.camera
        camera.position, camera.focal_point, camera.up = (x, y, far), (x, y, 0.0), (0.0, 1.0, 0.0)
        camera.parallel_scale = float(high[1] - low[1]) / 2.0
        camera.clipping_range = (0.01 * far, 2.0 * far)

    def image(self, number: int, values: Vector) -> NDArray[np.uint8]:
        """Return height × width × 3: the body at the time of this number, coloured by values at the motion's points."""
        places, point = self.scene.places(number), self.scene.shape.point
        for surface, edges in self.bodies:
            drawn = surface.point_data["number"]
            surface.points = places[drawn]
            surface.point_data["value"] = values[point[drawn]]
            edges.points = places[edges.point_data["number"]] + [0.0, 0.0, self.lift]
        self.plotter.render()
        return np.array(self.plotter.screenshot(return_img=True))

    def close(self) -> None:
        """Release the memory of the graphics."""
        self.plotter.close()


def _surfaces(shape: Shape, rest: Vector) -> list[tuple[Any, Any]]:
    """Return the surface of each material and its outline; their "number" is that of the points of the shape."""
    import pyvista
    from vtkmodules.vtkFiltersGeometry import vtkGeometryFilter

    flat, surfaces = shape.kind == "quad" and np.ptp(rest[:, 2]) == 0.0, []
    kind = pyvista.CellType[shape.kind.upper()]
    for part in np.unique(shape.part):
        grid = pyvista.UnstructuredGrid({kind: shape.cells[shape.part == part]}, rest)
        grid.point_data["number"] = np.arange(len(rest))
        outside = vtkGeometryFilter()
        outside.SetInputData(grid)
        outside.Update()
        surface: Any = pyvista.wrap(outside.GetOutput())
        edges = surface.extract_feature_edges(
            FEATURE_ANGLE, boundary_edges=True, feature_edges=not flat, manifold_edges=False, non_manifold_edges=False
        )
        round_off = {"cell_normals": False, "split_vertices": True, "feature_angle": FEATURE_ANGLE}
        surfaces.append((surface if flat else surface.compute_normals(**round_off), edges))
    return surfaces


@cache
def check_window() -> None:
    """Raise an OSError if pictures cannot be drawn; VTK itself would end the process."""
    import vtkmodules.vtkRenderingOpenGL2  # noqa: F401, as it brings the windows
    from vtkmodules.vtkRenderingCore import vtkRenderWindow

    with _quiet():
        window = vtkRenderWindow().GetClassName()
    if window in SAFE_WINDOWS:
        return
    if subprocess.run([sys.executable, "-c", WINDOW_PROBE], capture_output=True, check=False).returncode != 0:
        raise OSError(NO_WINDOW)


@contextmanager
def _quiet() -> Iterator[None]:
    """Suppress VTK's messages about window types that it cannot create before it finds one that works."""
    from vtkmodules.vtkCommonCore import vtkLogger

    before = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    try:
        yield
    finally:
        vtkLogger.SetStderrVerbosity(before)
