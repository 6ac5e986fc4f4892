# SPDX-License-Identifier: MIT
"""Flow of the metal in a pass: flash on both sides, groove, where its volume went, cavity, stir zone, layers.

usage: stirpost flow RUN_DIRECTORY [--time T] [--section X ...] [--strain 1] [--isotherm K ...] [--json] [-o DIR]

The last frame (or the first at or after T) is compared with the first one, particle by particle. Particles are boxes
of their volume, which is that at rest times what temperature and pressure make of it; they are stretched as far as
their neighbours of the first frame have moved apart, or cubes where these are no neighbours any more. The top face is that of the
first frame. The advancing side is where the tool's surface moves with the travel: +y for travel along +x and spin
clockwise seen from above. The groove is what is missing below the top face, outside the cavity, where the tool's face
has passed or within a particle of it, as metal does not show its rim finer. What left the groove lies above the face (ridges and flash, by side), in the cavity, beyond ends and sides,
below the bottom, or is debris; `closure` is their sum less thermal and elastic expansion over the groove, less 1; what it
leaves is what is missing below the face beside the groove (`sunk_beside`): where sides bulge, the face sinks a little,
and the places of particles enclose a few thousandths less or more than their volumes.

Voids of the track behind the tool are those of stirpost/analysis/voids.py: tunnels (closed), grooves (open to the top), lack of fill at
the root, loose metal, each with the metal that is missing in its largest section, depth and side, and the smallest that particles and cells
resolve. flow_voids.png shows the fill that they are measured from.

Written to DIR (default RUN_DIRECTORY/report): flow.json, flow_voids.png if there is a track, and flow_cavity.png if there is a cavity.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from ..analysis import units, voids
from ..io.files import write
from ..plots import look
from ..run import Run


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="stirpost flow", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path)
    parser.add_argument("--time", type=float, help="[s]")
    parser.add_argument("--section", type=float, nargs="+", metavar="X", help="places along the travel [m] "
                        "(default: quarters of the way)")
    parser.add_argument("--strain", type=float, default=1.0, help="plastic strain above which metal counts as stirred (default 1)")
    parser.add_argument("--isotherm", type=float, nargs="+", metavar="K", help="temperatures of isotherms [K] (default: multiples of 100 K)")
    parser.add_argument("--json", action="store_true", help="print flow.json instead of lines")
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args(arguments)
    run = Run(options.run)
    flow = run.flow(options.time)
    result = flow.measures(options.section, options.strain, options.isotherm, whole=True)
    output = options.output or options.run / "report"
    output.mkdir(parents=True, exist_ok=True)
    text = json.dumps(result, indent=1)
    write(output / "flow.json", text + "\n")
    from ..plots import flow_pictures

    with look.style():
        if flow.cavity:
            look.save(flow_pictures.cavity_picture(flow), output / "flow_cavity.png")
        if "voids" in result:
            look.save(flow_pictures.sheet(flow.voids), output / "flow_voids.png")
    print(text if options.json else "\n".join(lines(result)))
    return 0


def percent(value: float | None) -> str:
    return "-" if value is None else f"{100 * value:.3g} %"


def rows(result: dict) -> list[tuple[str, str]]:
    """Meaning and value of what is one number."""
    flash, volume = result["flash"], result["volumes"]
    found = voids.rows(result["voids"]) if "voids" in result else []
    found += [("flash, advancing side: height; volume above the initial top face",
              f"{units.mm(flash['height_advancing[m]'])}; {units.mm(volume['above_advancing[m3]'], 3)}"),
             ("flash, retreating side: height; volume above the initial top face",
              f"{units.mm(flash['height_retreating[m]'])}; {units.mm(volume['above_retreating[m3]'], 3)}")]
    if "groove[m3]" in volume:
        found.append(("groove: volume below the initial top face; mean depth",
                      f"{units.mm(volume['groove[m3]'], 3)}; {units.mm(volume['groove_mean_depth[m]'])}"))
    found.append(("metal displaced beyond ends; sides; below the bottom; debris",
                  "; ".join(units.mm(volume[f"{k}[m3]"], 3) for k in ("ends", "sides", "below", "debris"))))
    found.append(("thermal and elastic expansion", units.mm(volume["expansion[m3]"], 3)))
    if volume.get("closure") is not None:
        found.append(("sinkage of the top face beside the groove: volume", units.mm(volume["sunk_beside[m3]"], 3)))
        found.append(("error of the balance of volumes: metal that left the groove, without expansion, against the volume of the groove", percent(volume["closure"])))
    if "cavity" in result:
        found.append(("cavity: filled; metal in it", f"{percent(result['cavity']['filled'])}; {units.mm(volume['cavity[m3]'], 3)}"))
    for pair in (pair for pair in result.get("mixing", []) if pair["volume[m3]"] > 0.0):
        found.append((f"metal of {pair['body']} where {pair['where']} was: volume; how deep in it",
                      f"{units.mm(pair['volume[m3]'], 3)}; {units.mm(pair['depth_max[m]'])}"))
    for zone in result.get("stir_zone", []):
        found.append((f"stir zone (strain > {zone['strain_above']:g}) at {units.mm(zone['at[m]'])}: depth; width; area",
                      f"{units.mm(zone['depth[m]'])}; {units.mm(zone['width[m]'])}; {units.mm(zone['area[m2]'], 2)}"))
    return found


def tables(result: dict) -> list[tuple[str, list[str], list[list[str]]]]:
    """Title, headings and rows: layers, isotherms."""
    found = []
    if result.get("layers"):
        path = "path_max_diameters" in result["layers"][0]
        headings = ["depth [mm]", "median [mm]", "90 % [mm]", "largest [mm]", "largest ahead [diameters]"]
        headings += ["longest path [diameters]"] * path
        headings += ["moved > a spacing", "of these on the advancing side", "passed to it", "under the tool [s]"]
        body = []
        for row in result["layers"]:
            line = [" to ".join(f"{d * units.MM:.3g}" for d in row["depth[m]"])]
            line += [f"{row[f'displacement_{k}[m]'] * units.MM:.3g}" for k in ("median", "90", "max")]
            line.append(f"{row['ahead_max_diameters']:.2f}")
            if path:
                line.append(f"{row['path_max_diameters']:.2f}")
            line += [percent(row["moved_more_than_spacing"]), percent(row["of_moved_on_advancing_side"]),
                     percent(row["of_moved_passed_to_advancing_side"]), f"{row['time_under_tool_mean[s]']:.3g}"]
            body.append(line)
        found.append(("Displacement along the plate of layers by initial depth, under the path", headings, body))
    warm = [(zone, iso) for zone in result.get("stir_zone", []) for iso in zone.get("isotherms", [])]
    if warm:
        found.append(("Isotherms of the highest temperatures",
                      ["place [mm]", "isotherm [K]", "depth [mm]", "width [mm]", "area [mm2]", "of the stir zone within"],
                      [[f"{zone['at[m]'] * units.MM:.3g}", f"{iso['temperature[K]']:.0f}", f"{iso['depth[m]'] * units.MM:.3g}",
                        f"{iso['width[m]'] * units.MM:.3g}", f"{iso['area[m2]'] * units.MM**2:.3g}",
                        percent(iso["share_of_stir_zone"])] for zone, iso in warm]))
    return found


def lines(result: dict) -> list[str]:
    """The measures as text."""
    found = [f"t = {result['time[s]']:g} s, {result['particles']} particles, {result['lost']} lost"]
    found += [f"{name}: {value}" for name, value in rows(result)]
    for title, headings, body in tables(result):
        widths = [max(len(row[k]) for row in [headings, *body]) for k in range(len(headings))]
        found += ["", title] + ["  ".join(text.rjust(w) for text, w in zip(row, widths)) for row in [headings, *body]]
    return found
