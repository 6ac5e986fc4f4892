# SPDX-License-Identifier: MIT
"""A moving picture of a weld: the tool and the section of the weld behind it.

usage: stirpost film RUN_DIRECTORY [--colour strain|origin|temperature] [--behind MM] [--degrees C] [-o FILE.webp]

The plate is cut across the travel behind the tool; the cut moves with it. It is coloured by plastic strain (logarithmic, up to 50),
by the side of the path on which the metal was at first, or by temperature. Each frame of the run is a picture: a smaller &OUTPUT
FRAME_INTERVAL makes a smoother film. Written to FILE (default RUN_DIRECTORY/report/film.webp; a name that ends in .gif makes a GIF) in
the best quality that needs at most --most megabytes.
"""

from __future__ import annotations

import argparse
import io
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..analysis import units
from ..io.files import write
from ..io.frames import Frame, NoRun
from ..io.mesh import Mesh
from ..plots import look
from ..run import Run

if TYPE_CHECKING:
    from matplotlib.colors import Colormap, Normalize
    from PIL.Image import Image

    from ..plots.views import Face

COLOURS = ("strain", "origin", "temperature")
BEHIND = 1.25  # of the radius of the tool: where the cut is behind its axis
SECONDS = 8.0  # that the film takes, if that makes neither less than 5 nor more than 20 pictures a second
QUALITIES = (85, 70, 55, 40, 25)  # of WebP, until it is small enough
SIZES = (1.0, 0.8, 0.65, 0.5, 0.35)  # then of the pictures


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="stirpost film", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path)
    parser.add_argument("--colour", choices=COLOURS, default="strain")
    parser.add_argument("--behind", type=float, metavar="MM", help="distance of the cut behind the axis of the tool (default 1.25 radii of the tool)")
    parser.add_argument("--degrees", choices=list(look.SCALES), default="K")
    parser.add_argument("--frames", type=int, default=120, help="largest number of pictures (default 120)")
    parser.add_argument("--most", type=float, default=2.9, metavar="MB", help="largest size of the file [MB] (default 2.9)")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE")
    options = parser.parse_args(arguments)
    look.use_degrees(options.degrees)
    path = options.output or options.run / "report" / "film.webp"
    if path.suffix not in (".webp", ".gif"):
        raise ValueError(f"{path}: expected a name that ends in .webp or .gif")
    run = Run(options.run)
    with look.style():
        pictures = Film(run, options).pictures()
    path.parent.mkdir(parents=True, exist_ok=True)
    content = packed(pictures, path.suffix, int(options.most * 1e6))
    print(f"{len(pictures)} pictures in {write(path, content)}, {len(content) / 1e6:.2f} MB")
    return 0


class Film:
    """Settings common to all pictures: path of the tool, viewpoint, colours."""

    def __init__(self, run: Run, options: argparse.Namespace):
        from ..analysis import surface
        from ..analysis.tool_path import tool_path_of
        from ..plots import canvas, maps, views

        if len(run.frames) < 2:
            raise NoRun(f"{run.directory}: there are not two frames")
        self.tool_path = tool_path_of(run, run.scene, run.frames[-1].time)
        self.run, self.colour, self.maps, self.surface, self.views = run, options.colour, maps, surface, views
        self.frames = maps.choose_frames(run.frames, max(2, options.frames))
        self.behind = BEHIND * self.tool_path.radius if options.behind is None else options.behind / units.MM
        self.eye = canvas.Eye(views.BEHIND)
        if self.colour == "origin":
            ids = run.frames[0].need("id")
            order = np.argsort(ids)
            self.ids, self.origin = ids[order], self.turned(run.frames[0].points())[order, 1]
        self.norm, self.colours, self.label = self.scale()

    def turned(self, points: np.ndarray) -> np.ndarray:
        """Coordinates along the path of the tool, to its left and upwards [m]."""
        left = np.array([-self.tool_path.along[1], self.tool_path.along[0]])
        flat = points[:, :2] - self.tool_path.place[0]
        return np.column_stack([flat @ self.tool_path.along, flat @ left, points[:, 2]])

    def scale(self) -> tuple[Normalize, Colormap, str]:
        from matplotlib.colors import Normalize

        if self.colour == "temperature":
            return self.maps.temperature_norm(self.frames), look.TEMPERATURE, f"temperature [{look.unit_of_temperature()}]"
        if self.colour == "strain":
            return self.maps.strain_norm(self.frames), look.STRAIN, "equivalent plastic strain [1]"
        half = 0.6 * self.tool_path.radius * units.MM
        return Normalize(-half, half), look.part_of("Spectral", 0.0, 1.0), "metal was at first to the left of the path by [mm]"

    def values(self, frame: Frame) -> np.ndarray:
        """The value of each particle for its colour."""
        if self.colour == "origin":
            return self.origin[np.searchsorted(self.ids, frame.need("id")).clip(0, len(self.ids) - 1)] * units.MM
        name = {"strain": "plastic_strain", "temperature": "temperature"}[self.colour]
        return look.shown(name, frame.need(name).astype(float))

    def parts(self, frame: Frame) -> tuple[Mesh, Mesh | None, Face | None]:
        """Visible parts of a frame: the metal before the cut, the tool, the face of the cut."""
        points, values = self.turned(frame.points()), self.values(frame)
        metal = self.surface.metal(self.run, frame, [])
        metal = metal.at(self.turned(metal.points))
        near, weight = self.maps.weights(metal.points, points, self.run.spacing, 8)
        metal.data["colour"] = self.views.coloured((values[near] * weight).sum(axis=1), self.norm, self.colours)
        tool = self.run.tool_mesh(frame)
        if tool is not None:
            tool = tool.at(self.turned(tool.points))
        place = self.tool_path.tool.place(frame.time)
        at = float(self.turned(place[None])[0, 0]) - self.behind
        low, high = self.maps.common_box([points], self.run.spacing)
        view = self.maps.section(self.maps.View(frame, low, high, "", metal, axis=0), points, at, self.run.spacing, 500)
        face = self.views.cut_face(view, values, self.norm, self.colours, self.eye)
        return self.views.half_behind(metal, 0, at, self.eye), tool, face

    def pictures(self) -> list[Image]:
        """One picture for each frame."""
        from PIL import Image

        parts = [self.parts(frame) for frame in self.frames]
        start = self.turned(self.run.frames[0].points())
        low, high = start.min(axis=0) - 0.5 * self.run.spacing, start.max(axis=0) + 0.5 * self.run.spacing
        corners = Mesh(np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]), np.empty((0, 3)))
        box = self.views.seen_box(self.eye, corners, *(mesh for metal, tool, _ in parts for mesh in (metal, tool)))
        sides, below, wide = 0.8, 0.5, 7.6
        inches = (wide - sides - look.BAR - 0.5) / ((box[1] - box[0])[0] * units.MM)
        tall = below + (box[1] - box[0])[1] * units.MM * inches + 0.3
        figure = look.new_figure(wide, tall)
        figure.set_layout_engine("none")
        panel = self.views.panel_of(figure, sides, below, box, inches)
        shown = panel.imshow(np.zeros((2, 2, 3)), extent=(*box[:, 0] * units.MM, *box[:, 1] * units.MM), aspect="auto")
        self.views.draw_axes(panel, self.eye, low, high, "along the path", "to its left")
        words = figure.text(0.1 / wide, 1.0 - 0.2 / tall, "", fontsize=10)
        strip = figure.add_axes(((wide - look.BAR + 0.12) / wide, 0.2, 0.14 / wide, 0.6))
        look.colour_bar(figure, self.norm, self.colours, strip, self.label, "neither" if self.colour == "temperature" else "both")
        found = []
        for frame, (metal, tool, face) in zip(self.frames, parts):
            shown.set_data(self.views.image(self.eye, box, self.views.FINE * inches * units.MM, metal, metal["colour"], tool, face))
            words.set_text(f"t = {units.seconds(frame.time)}")
            figure.canvas.draw()
            found.append(Image.fromarray(np.asarray(figure.canvas.buffer_rgba())[..., :3].copy()))
        return found


def packed(pictures: list[Image], suffix: str, most: int) -> bytes:
    """The film in the best quality that needs at most so many bytes."""
    pause = int(1000 * np.clip(SECONDS / len(pictures), 0.05, 0.2))
    tries = [(1.0, quality) for quality in QUALITIES] if suffix == ".webp" else []
    tries += [(size, QUALITIES[-1]) for size in (SIZES[1:] if suffix == ".webp" else SIZES)]
    for size, quality in tries:
        file = io.BytesIO()
        fitting = [p.resize((round(p.width * size), round(p.height * size))) for p in pictures] if size < 1.0 else pictures
        if suffix == ".gif":
            fitting = [p.quantize(128) for p in fitting]
        fitting[0].save(file, suffix[1:].upper(), save_all=True, append_images=fitting[1:], duration=pause, loop=0, quality=quality, method=2)
        if file.tell() <= most:
            return file.getvalue()
    raise ValueError(f"the film of {len(pictures)} pictures needs more than {most / 1e6:g} MB: choose fewer with --frames")
