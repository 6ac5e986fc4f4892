# SPDX-License-Identifier: MIT
"""Tables of docs/validation.md from the results of the passes."""

import csv
import json

import scenes
import measure
from calculate import HERE, driver, kept

COMMAND = "benchmarks/passes/run.sh"
TABLES = HERE / "results/tables.json"
LAWS = {"hot": "hot copper", "jc": "Johnson-Cook", "tp": "two-phase"}
COLUMNS = [(law, apart) for law in LAWS for apart in (1, 2)]  # particles so many mm apart

# Quantity, experiment, thesis's model, measure, format.
CAVITY1 = (
    ("peak of T1, K", "peak T1", "+11 %; less", "T1 peak, K", ".0f"),
    ("peak of T2, K", "peak T2", "+5 %; less", "T2 peak, K", ".0f"),
    ("peak of T3, K", "peak T3", "+8 %; less", "T3 peak, K", ".0f"),
    ("its time, T1, s", "time T1", "", "T1 time of the peak, s", ".1f"),
    ("T2, s", "time T2", "", "T2 time of the peak, s", ".1f"),
    ("T3, s", "time T3", "", "T3 time of the peak, s", ".1f"),
    ("dip over the cavity of T1, K", "dip T1", "", "T1 dip over the cavity, K", ".0f"),
    ("of T2, K", "dip T2", "", "T2 dip over the cavity, K", ".0f"),
    ("of T3, K", "dip T3", "", "T3 dip over the cavity, K", ".0f"),
    ("cavity filled, %", "68", "61; 66", "cavity filled, %", ".0f"),
    ("cavity covered, seen from above, %", "68", "61; 66", "cavity covered, %", ".0f"),
    ("of the metal in it in the rear advancing quarter, %", "most", "", "in the rear advancing quarter, %", ".0f"),
    ("flash, retreating side, mm", "8", "14", "flash, retreating side, mm", ".1f"),
    ("flash, advancing side, mm", "less", "less", "flash, advancing side, mm", ".1f"),
    ("metal above the plate, retreating side, mm3", "", "", "metal above the plate, retreating side, mm3", ".0f"),
    ("advancing side, mm3", "", "", "metal above the plate, advancing side, mm3", ".0f"),
    ("groove, mm3", "", "1970 (geometry)", "groove, mm3", ".0f"),
    ("metal beyond sides and ends, mm3", "", "", "beyond sides and ends, mm3", ".0f"),
    ("stir zone (strain > 1) at 25 mm, mm", "3-4", "3-4", "stir zone at 25 mm, depth, mm", ".1f"),
    ("at 65 mm, mm", "3-4", "3-4", "stir zone at 65 mm, depth, mm", ".1f"),
    ("interface velocity, % of the tool's", "", "0.5-2.5", "interface velocity, % of the tool's", ".2f"),
    ("largest, %", "", "14", "interface velocity, largest, % of the tool's", ".2f"),
    ("strain under the tool at 15 s, mean", "", "about 30", "strain under the tool at 15 s, mean", ".2g"),
    ("largest", "", "", "strain under the tool at 15 s, largest", ".2g"),
    ("share of friction, %", "", "90-99", "share of friction, %", ".1f"),
    ("farthest metal ahead, tool diameters", "", "1.5", "largest way of a tracer, tool diameters", ".2f"),
    ("moved metal on the advancing side, %", "", "56", "of the moved metal on the advancing side, %", ".0f"),
    ("grains at 65 mm, stir zone, nm", "300", "323-331", "grain size, stir zone, nm", ".0f"),
    ("surface, nm", "", "350", "grain size, surface, nm", ".0f"),
    ("edge of the zone, nm", "", "600", "grain size, edge of the zone, nm", ".0f"),
    ("axial force at 12.5 s, kN", "", "", "force at 12.5 s, kN", ".1f"),
    ("at 50 s, kN", "", "", "force at 50 s, kN", ".1f"),
    ("torque at 12.5 s, N m", "", "", "torque at 12.5 s, N m", ".1f"),
    ("at 50 s, N m", "", "", "torque at 50 s, N m", ".1f"),
    ("hottest metal, K", "", "", "hottest metal, K", ".0f"),
    ("inertial over flow stress, %", "", "", "inertial over flow stress, largest, %", ".2g"),
    ("energy audit, %", "", "", "energy audit, largest, %", ".1g"),
    ("volumes close to, %", "", "", "volumes close to, %", ".1f"),
)
FILLED = {"cavity1": ("68", "61; 66"), "cavity2": ("59", "59; 80"), "cavity3": ("69", "53; 77")}
AA5005 = (
    ("peak of T1, K", "", "", "T1 peak, K", ".0f", 1.0), ("T2, K", "", "", "T2 peak, K", ".0f", 1.0), ("T3, K", "", "", "T3 peak, K", ".0f", 1.0),
    ("flash, retreating side, mm", "", "", "flash, retreating side, mm", ".1f", 1.0),
    ("stir zone at 65 mm, mm", "", "", "stir zone at 65 mm, depth, mm", ".1f", 1.0),
    ("grains at 65 mm, stir zone, um", "2.5", "3.65-3.87", "grain size, stir zone, nm", ".2f", 1e-3),
    ("edge of the zone, um", "", "5.5-7", "grain size, edge of the zone, nm", ".2f", 1e-3),
    ("axial force at 12.5 s, kN", "", "", "force at 12.5 s, kN", ".1f", 1.0),
    ("torque at 12.5 s, N m", "", "", "torque at 12.5 s, N m", ".1f", 1.0),
    ("hottest metal, K", "", "", "hottest metal, K", ".0f", 1.0),
)
STUDIED = ("T1 peak, K", "T2 peak, K", "T3 peak, K", "cavity filled, %", "cavity covered, %", "flash, retreating side, mm", "flash, advancing side, mm",
           "groove, mm3", "beyond sides and ends, mm3", "stir zone at 65 mm, depth, mm", "interface velocity, % of the tool's",
           "strain under the tool at 15 s, mean", "share of friction, %", "largest way of a tracer, tool diameters",
           "grain size, stir zone, nm", "grain size, surface, nm", "grain size, edge of the zone, nm", "force at 12.5 s, kN", "torque at 12.5 s, N m", "power at 12.5 s, kW", "power at 50 s, kW",
           "hottest metal, K", "inertial over flow stress, median, %", "inertial over flow stress, largest, %", "rows with more than 5 % of it, %")


def load(folder):
    """Results by (pass, kind)."""
    found = {}
    for path in sorted(folder.glob("*_*.json")):
        one = json.loads(path.read_text(encoding="utf-8"))
        found[one["pass"], one["kind"]] = one
    return found


def shown(all_of, name, kind, measure, form, factor=1.0):
    one = all_of.get((name, kind))
    value = None if one is None else one["measures"].get(measure)
    return "" if value is None else format(factor * value, form)


def record():
    """Peaks of the record of cavity 1 and their times."""
    rows = list(csv.DictReader((HERE / "cavity1_record.csv").read_text(encoding="utf-8").splitlines()))
    found = {}
    for name in ("T1", "T2", "T3"):
        best = max(rows, key=lambda row: float(row[f"{name}[K]"]))
        found |= {f"peak {name}": f"{float(best[f'{name}[K]']):.0f}", f"time {name}": best["time[s]"],
                  f"dip {name}": f"{record_dip(rows, name):.0f}"}
    return found


def record_dip(rows, name):
    values = measure.np.array([[float(row["time[s]"]), float(row[f"{name}[K]"])] for row in rows])
    return measure.dip(*values.T)


def cavity1(fine, coarse):
    """The pass of cavity 1 on the floor of the valley of each law."""
    peaks, of = record(), {1: fine, 2: coarse}
    columns = [(law, apart) for law, apart in COLUMNS if (f"cavity1_{law}", "floor") in of[apart]]
    rows = [["quantity", "experiment", "thesis's model: Johnson-Cook; two-phase", *(f"{LAWS[law]}, {apart} mm" for law, apart in columns)]]
    for label, experiment, thesis, measure, form in CAVITY1:
        rows.append([label, peaks.get(experiment, experiment), thesis,
                     *(shown(of[apart], f"cavity1_{law}", "floor", measure, form) for law, apart in columns)])
    return rows


def cavities(all_of):
    rows = [["quantity", "experiment", "thesis's model: Johnson-Cook; two-phase", "hot copper"]]
    for label, measure, form in (("filled, %", "cavity filled, %", ".0f"), ("covered, %", "cavity covered, %", ".0f"),
                                 ("flash, retreating side, mm", "flash, retreating side, mm", ".1f"), ("peak of T2, K", "T2 peak, K", ".0f"),
                                 ("stir zone at 65 mm, mm", "stir zone at 65 mm, depth, mm", ".1f")):
        for plate, (_, words) in scenes.PLATES.items():
            if label.endswith("ed, %") and plate == "plain":
                continue
            experiment, thesis = FILLED.get(plate, ("", "")) if label.endswith("ed, %") else ("", "")
            rows.append([f"{words}: {label}", experiment, thesis, shown(all_of, f"{plate}_hot", "floor", measure, form)])
    return rows


def aa5005(fine, coarse):
    rows = [["quantity", "experiment", "thesis's model", "film 200, 1.7 mm", "film 45000, 1.1 mm"]]
    for label, experiment, thesis, measure, form, factor in AA5005:
        rows.append([label, experiment, thesis, shown(coarse, "aa5005_tp", "floor", measure, form, factor),
                     shown(fine, "aa5005_tp", "cooled", measure, form, factor)])
    return rows


def experiments(law, *results):
    """What the kinds of the pass of cavity 1 give, of some sets of results, each with words for the head."""
    name = f"cavity1_{law}"
    columns = [(words, all_of, kind) for words, all_of in results for kind in scenes.KINDS if (name, kind) in all_of]
    rows = [["quantity", *((scenes.EXPERIMENTS[kind][0] if kind != "floor" else "floor of the valley") + words for words, _, kind in columns)]]
    for measure in STUDIED:
        cells = [shown(all_of, name, kind, measure, ".3g") for _, all_of, kind in columns]
        if any(cells):
            rows.append([measure, *cells])
    return rows


VALLEY = HERE / "results/valley.jsonl"
FRICTION = {"shear": "m", "coulomb": "mu"}


def valley_rows(is_map):
    """The whole passes of the map, hot copper with sides held and a constant film, or all others."""
    found = map(json.loads, VALLEY.read_text(encoding="utf-8").splitlines())
    return [row for row in found if not row["ended"]
            and (row["law"] == "hot" and row["sides"] == "held" and not row["pressure_factor"]) == is_map]


def valley(_):
    """Misfit of the peaks, depth of the stir zone at 65 mm and force over friction and film."""
    points = {(row["friction"], row["value"], row["film"]): row for row in valley_rows(True)}
    films = sorted({key[2] for key in points})
    rows = [["friction", *(f"film {film}" for film in films)]]
    for kind, value in sorted({key[:2] for key in points}, key=lambda key: (key[0] != "shear", key[1])):
        cells = []
        for film in films:
            row = points.get((kind, value, film))
            cells.append(f"{100 * row['misfit']:.0f} %, {row['stir zone at 65 mm, depth, mm']:.1f} mm, {row['force at 12.5 s, kN']:.0f} kN" if row else "")
        rows.append([f"{FRICTION[kind]} = {value:g}", *cells])
    return rows


def valley_laws(_):
    """The other laws, conductances under pressure and free sides."""
    rows = [["law", "friction", "film", "pressure factor", "sides", "T1, T2, T3, K", "misfit, %", "stir zone at 65 mm, mm", "force at 12.5 s, kN", "filled, %"]]
    for row in valley_rows(False):
        rows.append([LAWS[row["law"]], f"{FRICTION[row['friction']]} = {row['value']:g}", f"{row['film']}", f"{row['pressure_factor']}",
                     "free" if row["sides"] == "printed" else row["sides"], ", ".join(f"{row[f'{name} peak, K']:.0f}" for name in ("T1", "T2", "T3")), f"{100 * row['misfit']:.0f}",
                     f"{row['stir zone at 65 mm, depth, mm']:.1f}", f"{row['force at 12.5 s, kN']:.0f}", f"{row['cavity filled, %']:.0f}"])
    return rows


def runs(all_of):
    rows = [["pass", "kind", "particles", "apart, mm", "mass scaling", "steps", "processor time, s", "solver"]]
    for (name, kind), one in all_of.items():
        m, keys = one["measures"], one["keys"]
        seconds = [part["cpu_seconds"] for part in one["made"]]
        rows.append([name, kind, f"{m['particles']:.0f}", f"{m['distance of particles, mm']:.3g}", keys.get("TIME.MASS_SCALING", "1e5"),
                     f"{m['steps']:.0f}", "not recorded" if None in seconds else f"{sum(seconds):.0f}", one["solver"]])
    return rows


def picture(place):
    """Thermocouples of cavity 1 beside the record, from the folders of the runs; not drawn without them."""
    import matplotlib
    from stirpost.plots import look

    found = {law: driver.Results(place / f"cavity1_{law}_floor/cavity1_{law}.out", f"cavity1_{law}") for law in LAWS}
    if not all(results.path("_probes.csv").is_file() for results in found.values()):
        return
    rows = list(csv.DictReader((HERE / "cavity1_record.csv").read_text(encoding="utf-8").splitlines()))
    with matplotlib.rc_context(look.STYLE):
        figure = look.new_figure(9.6, 3.4)
        for panel, name in zip(figure.subplots(1, 3, sharex=True, sharey=True), ("T1", "T2", "T3")):
            panel.plot([float(row["time[s]"]) for row in rows], [float(row[f"{name}[K]"]) for row in rows], ".", color=look.INK,
                       markersize=4, label="record")
            for k, (law, results) in enumerate(found.items()):
                probes = results.probes()
                panel.plot(probes["time[s]"], probes[f"{name}[K]"], color=look.LINES[k], label=LAWS[law])
            panel.set_title(name)
            panel.set_xlabel("time [s]")
            panel.grid(True)
        figure.axes[0].set_ylabel("temperature [K]")
        figure.legend(*panel.get_legend_handles_labels(), loc="outside lower center", ncols=5)
        look.save(figure, HERE.parents[1] / "docs/pictures/passes_thermocouples.png")


def valley_picture():
    """Misfit of the peaks over friction and film, with the stir zone and the force as lines."""
    import matplotlib
    from stirpost.plots import look

    np = measure.np
    found = valley_rows(True)
    with matplotlib.rc_context(look.STYLE):
        figure = look.new_figure(9.6, 3.8)
        panels = figure.subplots(1, 2, sharey=True)
        for panel, kind, label in zip(panels, FRICTION, ("shear factor", "Coulomb's coefficient")):
            points = {(row["value"], row["film"]): row for row in found if row["friction"] == kind}
            values, films = (sorted({key[k] for key in points}) for k in (0, 1))

            def field(name):
                return np.array([[points[value, film][name] for value in values] for film in films])

            filled = panel.contourf(values, films, 100 * field("misfit"), levels=[0, 5, 10, 15, 20, 30, 40, 50, 70], cmap="viridis_r")
            lines = panel.contour(values, films, field("stir zone at 65 mm, depth, mm"), levels=[2, 3, 4, 5], colors="white", linewidths=1.2)
            panel.clabel(lines, fmt="%g mm", fontsize=7)
            lines = panel.contour(values, films, field("force at 12.5 s, kN"), levels=[30, 60, 90, 120, 150], colors=look.INK, linewidths=0.6, linestyles="--")
            panel.clabel(lines, fmt="%g kN", fontsize=7)
            panel.set_yscale("log")
            panel.set_xlabel(f"{label} [-]")
        panels[0].set_ylabel("film [W/(m2 K)]")
        figure.colorbar(filled, ax=list(panels), label="misfit of the peaks [%]")
        look.save(figure, HERE.parents[1] / "docs/pictures/passes_valley.png")


def tables_of(folder):
    """All tables, by their titles, from the results in a folder."""
    fine, coarse = (load(folder / f"{apart}mm") for apart in (1, 2))
    return {"cavity 1": cavity1(fine, coarse), "cavities": cavities(coarse), "AA5005": aa5005(fine, coarse),
            "experiments": experiments("hot", ("", coarse)), "grains": experiments("tp", (", 1 mm", fine), (", 2 mm", coarse)),
            "mass scaling": experiments("hot", ("", fine)),
            "valley": valley(coarse), "valley, laws": valley_laws(coarse), "runs": runs(fine) + runs(coarse)[1:]}


def write(folder, place):
    tables = tables_of(folder)
    for title, rows in tables.items():
        kept.show(title, rows)
    kept.keep(TABLES, COMMAND, tables)
    picture(place)
    valley_picture()
