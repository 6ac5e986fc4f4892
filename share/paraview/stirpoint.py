# SPDX-License-Identifier: MIT
"""A run of Stirpoint in ParaView: particles as balls, coloured, with the tools.

In ParaView: Macros > Import new macro..., choose this file; open NAME.hdf.series of a run, and run the macro. Without a window:

    pvpython stirpoint.py RUN.out [--field temperature] [--time SECONDS] [--picture picture.png]

RUN.out is the folder of a run, or its NAME.hdf.series.
"""

import argparse
import glob
import os
import sys

from paraview import simple

UNITS = {"temperature": "K", "plastic_strain": "", "strain_rate": "1/s", "flow_stress": "Pa", "pressure": "Pa", "von_mises": "Pa",
         "velocity": "m/s", "body": "", "material": ""}


def series_of(run):
    """The list of the frames of a run, and that of its tools or None."""
    if os.path.isdir(run):
        found = [path for path in sorted(glob.glob(os.path.join(run, "*.hdf.series"))) if not path.endswith("_tools.hdf.series")]
        if not found:
            raise SystemExit(f"{run}: has no frames (&OUTPUT FRAME_INTERVAL)")
        run = found[0]
    tools = run.replace(".hdf.series", "_tools.hdf.series")
    return run, tools if os.path.exists(tools) else None


def listed(reader):
    """The list of the frames that are open."""
    names = list(getattr(reader, "FileNames", None) or reader.FileName)
    if names[0].endswith(".series"):
        return names[0]
    return names[0].rsplit("_", 1)[0] + ".hdf.series"


def open_series(path, name):
    reader = simple.OpenDataFile(path)
    simple.RenameSource(name, reader)
    reader.UpdatePipeline()
    return reader


def spacing_of(reader):
    """Distance of neighbouring particles, from their number in their box [m]."""
    information = reader.GetDataInformation()
    x = information.GetBounds()
    volume = max(x[1] - x[0], 1e-12) * max(x[3] - x[2], 1e-12) * max(x[5] - x[4], 1e-12)
    return (volume / max(1, information.GetNumberOfPoints())) ** (1 / 3)


def draw_particles(reader, view, field):
    """Balls of the particles' size."""
    shown = simple.Show(reader, view)
    shown.SetRepresentationType("Point Gaussian")
    shown.GaussianRadius = 0.55 * spacing_of(reader)
    shown.ShaderPreset = "Sphere"
    simple.ColorBy(shown, ("POINTS", field))
    shown.RescaleTransferFunctionToDataRange(True, False)
    colours = simple.GetColorTransferFunction(field)
    colours.ApplyPreset("Inferno (matplotlib)" if field == "temperature" else "Viridis (matplotlib)", True)
    bar = simple.GetScalarBar(colours, view)
    bar.Title = field.replace("_", " ")
    bar.ComponentTitle = f"[{UNITS[field]}]" if UNITS.get(field) else ""
    bar.TitleColor = bar.LabelColor = [0, 0, 0]
    bar.TitleFontSize = bar.LabelFontSize = 10
    bar.ScalarBarLength = 0.25
    shown.SetScalarBarVisibility(view, True)
    return shown


def draw_tools(path, view):
    """Surfaces of the tools, half through."""
    shown = simple.Show(open_series(path, "tools"), view)
    shown.ColorArrayName = ["POINTS", ""]
    shown.DiffuseColor = shown.AmbientColor = [0.62, 0.66, 0.72]
    shown.Specular = 0.4
    shown.Opacity = 0.55


def draw(reader, tools, field="temperature", time=None):
    """The view of frames, and of tools if there are some, at a time [s], the last one if none is given."""
    view = simple.GetActiveViewOrCreate("RenderView")
    view.UseColorPaletteForBackground = 0
    view.Background = [1, 1, 1]
    view.OrientationAxesLabelColor = [0, 0, 0]
    scene = simple.GetAnimationScene()
    scene.UpdateAnimationUsingDataTimeSteps()
    times = list(reader.TimestepValues)
    view.ViewTime = scene.AnimationTime = (times[-1] if times else 0) if time is None else time
    reader.UpdatePipeline(view.ViewTime)
    draw_particles(reader, view, field)
    if tools:
        draw_tools(tools, view)
    stamp = simple.AnnotateTimeFilter(reader, Format="t = {time:.4g} s")
    label = simple.Show(stamp, view)
    label.Color = [0, 0, 0]
    label.FontSize = 10
    camera = view.GetActiveCamera()
    camera.SetFocalPoint(0, 0, 0)
    camera.SetPosition(-0.6, -1, 0.55)
    camera.SetViewUp(0, 0, 1)
    view.ResetCamera()
    simple.Render(view)
    return view


def main():
    parser = argparse.ArgumentParser(description="A run of Stirpoint in ParaView.")
    parser.add_argument("run", help="folder of the run, or its NAME.hdf.series")
    parser.add_argument("--field", default="temperature")
    parser.add_argument("--time", type=float, help="[s]; the last frame")
    parser.add_argument("--picture", help="write a picture of 1400 x 900 and end")
    if len(sys.argv) < 2:                          # a macro
        reader = simple.GetActiveSource()
        if reader is None:
            raise SystemExit("open NAME.hdf.series of a run first")
        simple.Hide(reader)
        draw(reader, series_of(listed(reader))[1])
        return
    given = parser.parse_args()
    frames, tools = series_of(given.run)
    view = draw(open_series(frames, os.path.basename(frames)[:-len(".hdf.series")]), tools, given.field, given.time)
    if given.picture:
        simple.SaveScreenshot(given.picture, view, ImageResolution=[1400, 900])
    else:
        simple.Interact(view)


if __name__ == "__main__":
    main()
