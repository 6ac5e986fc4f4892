# SPDX-License-Identifier: MIT
"""What pictures show: scales, ticks, units, and metal where there is metal."""

import numpy as np
import pytest
import synthetic

from stirpost.analysis import surface, units
from stirpost.io.frames import Frame, NoRun
from stirpost.io.mesh import Mesh
from stirpost.io.table import Column, Table
from stirpost.plots import curves, look, maps, views
from stirpost.run import Run

H = 1e-3


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    directory = synthetic.make_run(tmp_path_factory.mktemp("runs") / "plate.out", spacing=0.002, frames=3)
    synthetic.write_tools(directory)
    return Run(directory)


@pytest.fixture(autouse=True)
def kelvin():
    yield
    look.use_degrees("K")


def inches_per_mm(axis):
    box = axis.get_position().size * axis.figure.get_size_inches()
    return box / [np.ptp(axis.get_xlim()), np.ptp(axis.get_ylim())]


def test_sections_across_and_along_have_one_scale_and_whole_ticks(run):
    scene = maps.build_scene(run, run.frames)
    scales = []
    for views_, kind in ((scene.cross, "cross"), (scene.along, "along")):
        figure = maps.field_map(views_, kind, "temperature", "T", look.TEMPERATURE, maps.temperature_norm(run.frames))
        for axis in figure.axes[: len(views_)]:
            scales += inches_per_mm(axis).tolist()
            ticks = np.concatenate([axis.get_xticks(), axis.get_yticks()])
            assert np.array_equal(ticks, np.round(ticks))
    assert np.ptp(scales) < 1e-6 * scales[0]


@pytest.mark.parametrize("at", [5.0, 5.25, 5.5, 5.75, 6.0])
def test_solid_metal_has_no_holes_wherever_it_is_cut(at):
    """Also between two layers of particles, and among particles off their lattice."""
    random = np.random.default_rng(3)
    points = synthetic.lattice(H, (0.012, 0.010, 0.008)) + random.uniform(-0.2, 0.2, (960, 3)) * H
    mesh = surface.reconstruct(points, H)
    view = maps.section(maps.View(None, np.zeros(3), np.array([0.012, 0.010, 0.008]), "", mesh, 0), points, at * H, H)
    inner = view.inside[view.shape[0] // 5:-view.shape[0] // 5, view.shape[1] // 5:-view.shape[1] // 5]
    assert inner.all()
    assert np.isfinite(view.spread(points[:, 1])[view.inside]).all()


def test_strains_are_logarithmic_and_end_at_50():
    """A layer of huge strain at the tool does not hide the stir zone; the scale is no longer than what is there."""
    for largest, end in ((1200.0, 50.0), (7.0, 7.0), (0.0, 1.0)):
        norm = maps.strain_norm_of(np.array([0.0, 0.5 * largest, largest]))
        assert norm.vmin == 0.1 and norm.vmax == pytest.approx(end)
        assert norm(0.0) == 0.0 and norm(1e4) == 1.0


def test_one_switch_changes_kelvin_to_celsius_everywhere(run):
    kelvin = maps.temperature_norm(run.frames)
    view = maps.build_scene(run, run.frames[-1:]).cross[0]
    before = view.values("temperature")
    assert curves.thermocouples(run.probes).axes[0].get_ylabel() == "temperature [K]"
    look.use_degrees("C")
    celsius = maps.temperature_norm(run.frames)
    assert (kelvin.vmin - celsius.vmin, kelvin.vmax - celsius.vmax) == pytest.approx((273.15, 273.15))
    assert np.nanmax(np.abs(before - view.values("temperature") - 273.15)) < 1e-3
    assert curves.thermocouples(run.probes).axes[0].get_ylabel() == "temperature [\N{DEGREE SIGN}C]"


def test_lines_of_a_panel_can_be_told_apart():
    """Up to thirty of them, by colour and dashes."""
    kinds = look.line_kinds(30)
    assert len({(kind["color"], kind["linestyle"]) for kind in kinds}) == 30
    time = np.linspace(0.0, 1.0, 20)
    table = Table([Column("time", "s", time)] + [Column(f"energy_{k}", "J", (1.0 + k) * time) for k in range(15)])
    axes = curves.energies(table).axes
    lines = [line for axis in axes for line in axis.lines]
    assert len({(line.get_color(), line.get_linestyle()) for line in lines}) == 15


def test_legends_lie_within_the_picture():
    """However long their names are; the panels keep their size."""
    time = np.linspace(0.0, 1.0, 20)
    sizes = []
    for name in ("e", "energy of a part with a name that is rather long for a legend"):
        axes = curves.energies(Table([Column("time", "s", time)] + [Column(f"{name}_{k}", "J", (1.0 + k) * time) for k in range(20)])).axes
        figure = axes[0].figure
        sizes.append(axes[0].get_window_extent().width)
        assert max(axis.get_legend().get_window_extent().x1 for axis in axes) <= figure.get_figwidth() * figure.dpi
    assert sizes[0] == pytest.approx(sizes[1])


def test_legend_of_thermocouples_lies_within_the_picture():
    time = np.linspace(0.0, 1.0, 20)
    axis = curves.thermocouples(Table([Column("time", "s", time), Column("retreating side", "K", 300.0 + time)]
                                      + [Column(f"retreating side_{x}", "m", 0.0305 + 0 * time) for x in "xyz"])).axes[0]
    assert axis.get_legend().get_window_extent().x1 <= axis.figure.get_figwidth() * axis.figure.dpi


@pytest.mark.parametrize("end", [1.2, 7.0, 10.9, 14.0, 15.1, 50.0])
def test_numbers_of_a_colour_bar_do_not_overlap(end):
    """A third of a decade lies between the largest and the decade below it, or the decade is left out."""
    figure, _, strip = look.panels(1, (50.0, 20.0), 0.1)
    norm = maps.strain_norm_of(np.array([end]))
    look.colour_bar(figure, norm, look.STRAIN, strip, "strain", "both")
    boxes = [text.get_window_extent() for text in strip.get_yticklabels() if text.get_text()]
    assert len(boxes) > 1 and all(low.y1 <= high.y0 for low, high in zip(boxes, boxes[1:]))


def test_further_histories_begin_with_temperatures_and_leave_out_what_is_0():
    time = np.linspace(0.0, 1.0, 20)
    table = Table([Column("time", "s", time), Column("debris_mass", "kg", 0 * time), Column("strain_rate_max", "1/s", time),
                   Column("tool_face_temperature", "K", 300.0 + time), Column("tool_tool_face_temperature", "K", 310.0 + time)])
    axes = curves.others(table).axes
    assert [axis.get_ylabel() for axis in axes] == ["temperature [K]", "strain rate max [1/s]"]
    words = [text.get_text() for text in axes[0].get_legend().get_texts()]
    assert words == ["tool face temperature", "tool tool face temperature"]


def test_sections_are_not_at_the_ends_of_the_plate(run):
    """Where the hottest place is at an end, the section is two particles within it, where the surface is not round."""
    frame = run.frames[-1]
    points = frame.points()
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    (place,), _ = maps.section_positions(Scattered(run), [Hot(points)], [points])
    assert high[0] - place[0] == pytest.approx(2.0 * run.spacing) and low[1] < place[1] < high[1]


class Scattered:
    """A run without a tool."""

    def __init__(self, run):
        self.history, self.spacing = Table([]), run.spacing


class Hot:
    """A frame that is hottest at its largest x."""

    def __init__(self, points):
        self.points = points

    def field(self, name):
        return 300.0 + 1e4 * self.points[:, 0]


def test_names_and_units_are_those_people_use():
    assert units.words("tool_tool_velocity") == "tool velocity" and units.words("plastic_work") == "plastic work"
    assert units.scaled(3.2e-4, "m2") == (1e6, "mm\N{SUPERSCRIPT TWO}") and units.scaled(5e-4, "m") == (1e3, "mm")
    assert units.scaled(12e3, "N") == (1e-3, "kN") and units.scaled(2.0, "m") == (1.0, "m")


@pytest.mark.parametrize("norm", [maps.size_norm, maps.strain_norm, maps.temperature_norm])
def test_a_scale_names_the_field_that_a_frame_lacks(tmp_path, norm):
    synthetic.write_frame(tmp_path / "a_000000.hdf", synthetic.lattice(0.004), {}, 0.0)
    with pytest.raises(NoRun, match="a_000000.hdf: no field (grain_size|plastic_strain|temperature)"):
        norm([Frame(tmp_path / "a_000000.hdf")])


@pytest.mark.parametrize("down", [0.0, 0.020])
def test_the_plate_has_two_views_to_scale_with_whole_ticks(run, down):
    """Also with a tool that comes out of the bottom, on which no number of an axis lies; the cut has an outline."""
    frame = run.frames[-1]
    scene = maps.build_scene(run, [frame])
    norm = maps.temperature_norm([frame])
    tool = run.tool_mesh(frame)
    tool = tool.at(tool.points - [0.0, 0.0, down])
    figure = views.plate_picture(frame, scene.top[0].mesh, tool, "temperature", "T", norm, look.TEMPERATURE, scene.along[0])
    _, _, outline = views.cut_face(scene.along[0], frame.field("temperature"), norm, look.TEMPERATURE, views.Eye(views.SIDE))
    assert np.ptp(outline[..., 0]) == pytest.approx(np.ptp(scene.top[0].mesh.points[:, 0]), rel=0.02)
    seen = views.Eye(views.SIDE).sees(tool.points) * units.MM
    panels = figure.axes[:2]
    scales = np.concatenate([inches_per_mm(panel) for panel in panels])
    assert np.ptp(scales) < 0.01 * scales[0]
    for panel in panels:
        words = [text.get_text() for text in panel.texts]
        assert {"x [mm]", "y [mm]", "z [mm]"} <= set(words)
        assert all(word.lstrip("-").isdigit() for word in words if "[" not in word)
        renderer = figure.canvas.get_renderer()
        for text in panel.texts:  # none is cut by the edge of the picture
            box = text.get_window_extent(renderer)
            assert box.x0 >= 0 and box.y0 >= 0 and box.x1 <= figure.bbox.width and box.y1 <= figure.bbox.height
    for text in panels[1].texts:
        assert not (seen.min(axis=0) < text.get_position()).all() or not (text.get_position() < seen.max(axis=0)).all()


@pytest.mark.parametrize("turns", [24, 36, 48, 60])
def test_stripes_of_a_tool_are_whole_segments(turns):
    """The two triangles between two lines of the profile have one shade, and the stripes are as wide as they can be alike."""
    around = np.arange(turns) * 2 * np.pi / turns
    ring = np.stack([np.cos(around), np.sin(around), 0 * around], axis=1)
    k, nxt = np.arange(turns), (np.arange(turns) + 1) % turns
    corners = np.concatenate([np.stack(c, axis=1) for c in ((k, nxt, nxt + turns), (k, nxt + turns, k + turns), (nxt, k, 0 * k + 2 * turns))])
    points = np.vstack([ring, ring + [0, 0, 1], [[0, 0, 0]]])
    tool = Mesh(points, corners, {"azimuth": np.arctan2(points[:, 1], points[:, 0])})
    shade = views.stripes_of(tool)[:, 0].reshape(3, turns)
    assert (shade[0] == shade[1]).all() and (shade[0] == shade[2]).all()
    assert (np.diff(np.append(shade[0], shade[0, 0]).astype(int)) != 0).sum() == views.STRIPES
