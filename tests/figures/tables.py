# SPDX-License-Identifier: MIT
"""The tables of the documents that are written from what was measured; name: lines of Markdown."""

import json
import math
import statistics
import sys
import typing

import documents
import measures
import problems

MATERIAL_COLUMNS = ("force", "torque", "heat")

# For what, which method, and the points that say so: problem, option set, resolutions.
CHOICES = (
    ("impact, plastic flow", "FLIP with B-splines; cpGIMP costs more and is more accurate", "taylor",
     ("bspline flip", "cpgimp flip", "cpgimp apic", "bspline apic", "ugimp flip", "ugimp fmpm(2)")),
    ("sliding with friction", "any; B-spline APIC is cheapest", "friction_block", ("bspline apic", "cpgimp flip", "ugimp flip")),
    ("stirring: viscous flow round a pin that sticks", "B-splines without FBAR, or APIC at 10 cells over the gap",
     "couette", ("ugimp flip", "bspline flip, no FBAR", "bspline flip", "bspline apic", "bspline fmpm(2)")),
    ("large smooth deformation", "cpGIMP with APIC at half the default step, XPIC(2) or FMPM(2) at the default", "waves2d",
     ("cpgimp apic, dt/2", "cpgimp xpic(2)", "cpgimp fmpm(2)", "cpgimp flip", "cpgimp flip usavg", "ugimp flip", "bspline flip")),
    ("small strains, waves", "FMPM(2) with B-splines", "standing_wave",
     ("bspline fmpm(2)", "ugimp apic", "ugimp flip", "ugimp flip usavg")),
    ("vibration with a free end", "FMPM(2), uGIMP or B-splines", "bar", ("ugimp fmpm(2)", "bspline fmpm(2)", "ugimp apic",
                                                                        "ugimp flip", "ugimp flip usavg")),
    ("conduction of smooth temperatures", "FOURIER = 0.5 with uGIMP", "heat_fixed",
     ("ugimp, Fo 0.5", "ugimp, Fo 0.3", "ugimp, Fo 0.15", "bspline, Fo 0.5")),
    ("moving source on a plate", "FOURIER = 0.5 with uGIMP", "source_plate", ("ugimp, Fo 0.5", "ugimp, Fo 0.13", "bspline, Fo 0.13")),
)


def table(head, rows):
    return "".join(f"| {' | '.join(row)} |\n" for row in (head, ["---"] * len(head), *rows)).replace("| --- |", "|---|").replace(
        " --- |", "---|")


def choices(_):
    """Errors (and core-seconds) of the methods for each purpose, at its two finest resolutions."""
    points = {(p["problem"], p["option_set"], p["resolution"]): p for p in measures.lines(measures.PRECISION)}
    rows = []
    for purpose, choice, problem, labels in CHOICES:
        sizes = sorted({n for name, label, n in points if name == problem and label in labels})[-2:]
        told = []
        for label in labels:
            cells = [f"{p['error']:.1e} ({p['core_seconds']:.2g})" if p and p["error"] is not None else "-"
                     for p in (points.get((problem, label, n)) for n in sizes)]
            told.append(f"{label}: {', '.join(cells)}")
        rows.append([f"{purpose} ({problem}, n = {', '.join(map(str, sizes))})", choice, "; ".join(told)])
    return table(["for", "choose", "error (core-seconds)"], rows)


def verification(record):
    """All verification problems that are measured: errors at their resolutions and the observed order."""
    rows = []
    variants = [(name, name, sizes, {}) for name, sizes in measures.VERIFIED.items()] + list(measures.VARIANTS)
    for label, name, sizes, _ in variants:
        problem = problems.ALL[name]
        known = [(n, record[f"{label} {n}"]["error"]) for n in sizes if f"{label} {n}" in record]
        order = ""
        if len(known) > 1 and min(known[-2][1], known[-1][1]) > 0.0:
            order = f"{math.log(known[-2][1] / known[-1][1]) / math.log(known[-1][0] / known[-2][0]):.1f}"
        rows.append([label, problem.norm, f"{problem.passes:.1%} at {problem.resolutions[-1]}",
                     ", ".join(f"{n}: {error:.2%}" for n, error in known), problem.cells, order])
    return table(["problem", "error", "limit", "cells: measured", "cells", "order"], rows)


def disc_on_plate(record):
    values = record["disc_on_plate"]
    rows = []
    for label in measures.DISCS:
        row = [label]
        for shape in ("bspline", "ugimp"):
            force, torque, heat = (values[f"{label}, {shape}, {key}"] for key in MATERIAL_COLUMNS)
            row.append(f"{force / 1e3:.1f} kN, {torque:.1f} N m, {heat:.1f} J")
        rows.append(row)
    return table(["cells", "B-spline: force, torque, friction heat", "uGIMP"], rows)


def mass_scaling(record):
    values = record["mass_scaling"]
    names = {"1e4": "1e4", "1e5": "1e5", "adapts": f"from 1e5, ends at {values['adapts, factor']:.1e}"}
    rows = []
    for label, name in names.items():
        v = {key: values[f"{label}, {key}"] for key in ("steps", "torque", "force", "hottest", "inertial")}
        rows.append([name, f"{v['steps']:.0f}", f"{v['torque']:.1f}", f"{v['force'] / 1e3:.1f}", f"{v['hottest']:.0f}",
                     f"{v['inertial']:.1f} %"])
    return table(["mass scaling", "steps", "torque N m", "force along z kN", "hottest K", "largest inertial stress"], rows)


def scaling(record):
    values = record["scaling"]
    rows = [[f"{ranks:,}", f"{values[f'strong, {ranks}, efficiency']:.2f} ({values[f'strong, {ranks}, imbalance']:.2f})",
             f"{values[f'strong, {ranks}, efficiency_without_overlap']:.2f}",
             f"{values[f'weak, {ranks}, efficiency']:.2f} ({values[f'weak, {ranks}, imbalance']:.2f})",
             f"{values[f'network, strong, {ranks}, efficiency']:.2f}, {values[f'network, weak, {ranks}, efficiency']:.2f}"]
            for ranks in measures.MODELLED]
    return table(["ranks", "8 million particles: efficiency (imbalance)", "without overlap", "97,000 particles a rank",
                  "both with a network"], rows)


def plates(record):
    """A stirred plate on many ranks, by the model."""
    values, rows = record["scaling"], []
    for particles, every in measures.PLATE_RANKS.items():
        for ranks in every:
            step, imbalance, efficiency, memory, frame, division = (values[f"plate, {particles}, {ranks}, {key}"]
                                                                    for key in measures.PLATE_KEYS)
            rows.append([particles.replace("+0", ""), f"{ranks:,}", f"{step:.3g} ms", f"{efficiency:.2f}", f"{imbalance:.2f}",
                         f"{1e-3*memory:.2g} GB", f"{frame:.0f}", f"{division:.0f}"])
    return table(["particles", "ranks", "a step", "efficiency", "imbalance", "memory of the fullest rank", "a frame [steps]",
                  "a division of the grid [steps]"], rows)


def speed(_):
    """As benchmarks/speed --markdown prints it."""
    text = measures.command("benchmarks/speed", "--markdown", "benchmarks/speed_results.jsonl")
    origin = measures.lines(measures.ROOT / "benchmarks/speed_results.jsonl")[0]
    return ("".join(line + "\n" for line in text.splitlines() if line.startswith("|"))
            + f"\nMade by `{origin['command']}` of {origin['version']} on {origin['machine']}.\n")


def features(_):
    """Ratios of processor times, what is asked of them, and where they were measured."""
    found = next(row for row in measures.lines(measures.ROOT / "benchmarks/speed_results.jsonl") if row["scene"] == "features")
    names = {"thread": "thread on the pin", "flats": "flats on the pin", "scroll": "scroll in the shoulder", "stl": "STL file of the pin",
             "contact_butt": "butt joint, contact", "contact_lap": "lap joint, contact", "tracers": "8000 tracers, rows every five steps",
             "usavg": "USAVG", "musl": "MUSL", "fmpm_4": "FMPM(4)", "apic": "APIC"}
    plain = {"pin": "plain pin", "butt": "tied", "lap": "tied", "block": "block, FLIP, USL"}
    rows = [[name, plain[found[key]["over"]], f"{found[key]['measured']:.2f}", f"{found[key]['asked']}"] for key, name in names.items()]
    return (table(["feature", "over", "measured", "asked"], rows)
            + f"\nMade by `{found['command']}` of {found['version']} on {found['machine']}.\n")


def kernels(_):
    """Times of the kernels alone, and of where they were measured."""
    rows = {row["scene"]: row for row in measures.lines(measures.ROOT / "benchmarks/speed_results.jsonl")}
    alone = rows["kernels"]
    names = {"weights_ns": "weights", "to_grid_ns": "particles to grid", "from_grid_ns": "grid to particles",
             "stress_plastic_ns": "stress, plastic", "stress_elastic_ns": "stress, elastic"}
    return table(["kernel", "ns a particle"], [[name, f"{alone[key]:.1f}"] for key, name in names.items()])


def cooling(record):
    values = record["cooling"]
    names = {"cooling-plate": "on the backing plate", "cooling-quench": "in a quench", "cooling-without": "without annealing"}
    return table(["cooled", "grains"], [[name, f"{1e9 * values[key]:.0f} nm"] for key, name in names.items()])


def annealing(record):
    values = record["annealing"]
    return table(["changed", "on the backing plate", "in a quench"],
                 [[name, *(f"{1e9 * values[f'{name}, {path}']:.0f} nm" for path in ("plate", "quench"))] for name in measures.ANNEALING])


PLATES = {"copper_plain": "plain", "copper_cavity1": "cavity 1", "copper_cavity2": "cavity 2", "copper_cavity3": "cavity 3",
          "aa5005": "AA5005"}


def heat_plates(record):
    """Peaks of all plates, and errors of cells of 2, 1 and 0.5 mm."""
    values = record["heat plates"]
    rows = [[name, ", ".join(f"{values[f'{plate}, extrapolated, T{k}']:.2f}" for k in (1, 2, 3)),
             *(", ".join(f"{values[f'{plate}, {cell}, {key}']:.2f}" for key in ("peak", "any")) for cell in ("2", "1", "0.5"))]
            for plate, name in PLATES.items()]
    return table(["", "extrapolated", "2 mm", "1 mm", "0.5 mm"], rows)


def orders(values, sizes):
    """Pairs of an error and the order between it and the one before."""
    found = [values[0]], [""]
    for k in range(1, len(values)):
        found[0].append(values[k])
        found[1].append(f"{math.log(values[k - 1] / values[k]) / math.log(float(sizes[k - 1]) / float(sizes[k])):.2f}")
    return zip((f"{value:.6f}" for value in found[0]), found[1])


def heat_slab(record):
    values, cells = record["heat slab"], ("4", "2", "1", "0.5")
    found = orders([values[f"cell, {cell}"] for cell in cells], cells)
    return table(["cell [mm]", "error [K]", "order"], [[cell, *pair] for cell, pair in zip(cells, found)])


def heat_steps(record):
    values, steps = record["heat slab"], ("0.32", "0.16", "0.08", "0.04")
    methods = ("rkl2", "tr-bdf2", "backward-euler")
    found = [orders([values[f"{method}, {step}"] for step in steps], steps) for method in methods]
    rows = [[step, *(cell for pair in pairs for cell in pair)] for step, *pairs in zip(steps, *found)]
    return table(["step [s]", *(cell for method in methods for cell in (f"{method}: error [K]", "order"))], rows)


def heat_tolerance(record):
    values, limits = record["heat tolerance"], ("0.2", "0.5", "1", "2", "5", "15")
    return table(["TOLERANCE [K]", *(f"{limit} (default)" if limit == "2" else limit for limit in limits)],
                 [["largest difference [K]", *(f"{values[f'{limit}, apart']:.3f}" for limit in limits)],
                  ["evaluations of the rates", *(f"{values[f'{limit}, evaluations']:,.0f}" for limit in limits)]])


CROSSING = "benchmarks/heat/crossing.json"


def origin_of_crossing():
    kept = json.loads((measures.ROOT / CROSSING).read_text(encoding="utf-8"))
    versions = sorted({run["version"].rpartition(" ")[2][:7] for run in kept["runs"]})
    return f"\nMade by {' and '.join(versions)} on {kept['machine']}.\n"


# Method and time, and the name in the document.
INTEGRATORS = {"reference, 2 s": "rkl2, tolerance 0.2", "rkl2, 2 s": "rkl2, tolerance 15", "explicit, 2 s": "explicit",
               "tr-bdf2, fftw, 2 s": "tr-bdf2, fftw, tolerance 2", "tr-bdf2, cg, 2 s": "tr-bdf2, cg, tolerance 2",
               "tr-bdf2, petsc, 2 s": "tr-bdf2, petsc, tolerance 2",
               "backward-euler, fftw, 2 s": "backward-euler, fftw, tolerance 0.5",
               "rkl2, 6 s": "6 s: rkl2, tolerance 15", "tr-bdf2, fftw, 6 s": "6 s: tr-bdf2, fftw, tolerance 2"}


def heat_crossing(record):
    """Processor seconds a simulated second and errors of the integrators."""
    values, cells = record["heat crossing"], ("1", "0.5", "0.25")
    rows = []
    for method, name in INTEGRATORS.items():
        row = [name]
        for cell in cells:
            key = f"heat_copper_plain, {cell}, {method}"
            cost, apart = values.get(f"{key}, cpu"), values.get(f"{key}, error")
            row.append("" if cost is None else f"{rough(cost)}" + (f" ({apart:.2g} K)" if apart else ""))
        rows.append(row)
    return table(["", *(f"{cell} mm" for cell in cells)], rows) + origin_of_crossing()


def rough(seconds):
    """Two digits."""
    return f"{float(f'{seconds:.2g}'):g}"


def heat_solvers(record):
    """Processor seconds a simulated second and iterations a linear system of the solvers of tr-bdf2."""
    values, solvers = record["heat crossing"], ("fftw", "cg", "petsc")
    runs = json.loads((measures.ROOT / CROSSING).read_text(encoding="utf-8"))["runs"]
    cells = {(run["input"], f"{run['cell_mm']:g}"): run["cells"] for run in runs}
    rows = []
    for scene, name in (("heat_copper_plain", "box"), ("heat_copper_cavity1", "cavity 1")):
        for cell in ("1", "0.5"):
            row = [f"{name}, {cells[scene, cell]:,} cells"]
            for solver in solvers:
                key = f"{scene}, {cell}, tr-bdf2, {solver}, 2 s"
                known = f"{key}, cpu" in values
                row.append(f"{rough(values[f'{key}, cpu'])}, {values[f'{key}, iterations']:.1f}" if known else "")
            rows.append(row)
    return table(["", *solvers], rows)


TRUE = (("`TP_BETA`", "TP_BETA", 0, "0.0018"), ("`TP_K0`", "TP_K0", 0, "4.6"), ("`TP_STAR` at 298 K", "TP_STAR", 0, "0.2069"),
        ("500 K", "TP_STAR", 1, "0.1330"), ("773 K", "TP_STAR", 2, "0.0617"), ("1000 K", "TP_STAR", 3, "0.0182"))


def calibration(record):
    values = record["calibration"]
    rows = [[name, true, f"{values[f'fitted, {key}, {k}']:.3g}", f"{values[f'standard_errors, {key}, {k}']:.2g}"]
            for name, key, k, true in TRUE]
    return table(["", "true", "found", "standard error"], rows)


def kept(path, title):
    """A table of results that a benchmark keeps, with where and when it was made."""
    def rows(_):
        found = json.loads((measures.ROOT / path).read_text(encoding="utf-8"))[title]
        return (table(found["rows"][0], found["rows"][1:])
                + f"\nMade by `{found['command']}` of {found['version']} on {found['machine']}.\n")
    return rows


WELDS, RULE, REPORTED = (f"benchmarks/welds/{name}" for name in ("results.jsonl", "rule.jsonl", "reported.json"))
SHOWN = (("torque", "torque [N m]", "{:.0f}"), ("force", "axial force [kN]", "{:.0f}"), ("power", "power [kW]", "{:.1f}"))
MEANT = {"coarse": "larger cells", "fine": "cells of 1/3, 1/5 of the sheet", "light": "a third of the mass scaling"}
MEANT |= {"smooth": "a smooth pin"} | {f"smooth-{name}": f"{meant}, smooth pins" for name, meant in MEANT.items()}


def shown_welds():
    """Welds by the rule, without those of Rabe."""
    return [weld for weld in by_name(measures.lines(measures.ROOT / WELDS)) if not {"variant", "set"} & weld.keys() and not weld["weld"].startswith("rabe")]


def by_name(welds):
    """In the order of the parts of their names, numbers by size."""
    return sorted(welds, key=lambda weld: [(0, int(part), "") if part.isdigit() else (1, 0, part) for part in weld["weld"].split("-")])


def rabe(_):
    """The welds of Rabe by the rule, in the order of travel and rotational speed: loads, temperature, and the largest void with its place."""
    found = [weld for weld in measures.lines(measures.ROOT / WELDS) if weld["weld"].startswith("rabe") and not {"variant", "set"} & weld.keys()]
    rows = []
    for weld in by_name(found):
        _, alloy, thickness, rpm, speed, depth = weld["weld"].split("-")
        place = f"{weld['void_below']:.1f} below, {weld['void_beside']:+.1f} beside" if "void_below" in weld else ""
        rows.append([f"AA{alloy}, {thickness} mm", rpm, speed, depth, f"{weld['force']:.1f}", f"{weld['plunge']:.0f}", f"{weld['torque']:.0f}",
                     f"{weld['power']:.1f}", f"{weld['face']:.0f}", f"{weld['void']:.1f} ({weld['void_resolved']:.1f})", place, f"{weld['inertia']:.0f}"])
    return table(["sheet", "rpm", "mm/min", "depth", "axial force [kN]", "largest in the plunge [kN]", "torque [N m]", "power [kW]", "face [K]",
                  "largest void [mm2]", "its place [mm]", "inertial stress [%]"], rows)


def welds(_):
    """Published welds: computed / reported; temperatures of the metal on the face, at a thermocouple and of the hottest particle."""
    rows = []
    for weld in shown_welds():
        told = settings_of_welds()[weld["weld"]][1]
        row = [weld["weld"]]
        for key, _, form in SHOWN:
            row.append(form.format(weld[key]) + (" / " + form.format(middle(told[key])) if key in told else ""))
        row.append(f"{weld['face']:.0f}" + (f" / {middle(told['peak']):.0f}" if "peak" in told else ""))
        row.append((f"{weld['probe']:.0f}" + (f" / {middle(told['probe']):.0f}" if "probe" in told else "")) if "probe" in weld else "")
        row.append(f"{weld['hottest']:.0f}")
        row.append(f"{weld['void']:.1f} ({weld['void_resolved']:.1f})" if "void" in weld else "")
        row.append(f"{weld['inertia']:.0f}")
        rows.append(row)
    return table(["weld", *(title for _, title, _ in SHOWN), "face [K]", "probe [K]", "hottest [K]", "largest void [mm2]", "inertial stress [%]"], rows)


def settings_of_welds():
    """Setting: its weld, and what is reported of it; a range of reported values is a list of two."""
    found = json.loads((measures.ROOT / REPORTED).read_text(encoding="utf-8"))
    return {name: (weld, told) for weld in found for name, told in weld["settings"].items()}


def middle(told):
    """A reported value, or the middle of its range."""
    return statistics.mean(told) if isinstance(told, list) else told


class Compared(typing.NamedTuple):
    """A reported quantity of a setting of a weld: its value, ends of its range; computed by the rule, least and largest with other
    values of the rule, cells or mass scaling."""

    setting: str
    weld: dict
    told: float
    told_ends: tuple
    computed: float
    computed_ends: tuple

    @property
    def deviation(self):
        return 100.0 * (self.computed / self.told - 1.0)


def reported_of_welds():
    """Quantity: its title and what was compared; the force of a pressed tool is given."""
    found = {key: (title, []) for key, title, _ in (*SHOWN, ("temperature", "temperature [K]", None))}
    rows = measures.lines(measures.ROOT / WELDS)
    rows += [row for row in measures.lines(measures.ROOT / RULE) if row.get("travel", 2.0) == 2.0]
    for row in by_name(row for row in rows if not {"variant", "set", "film", "friction", "travel"} & row.keys()):
        weld, told = settings_of_welds()[row["weld"]]
        for key in told.keys() & {"torque", "force", "power", "peak", "probe"}:
            own = {"peak": "face"}.get(key, key)
            if own not in row or (key == "force" and row["weld"].endswith("pressed")):
                continue
            all_computed = [other[own] for other in rows if other["weld"] == row["weld"] and own in other]
            ends = told[key] if isinstance(told[key], list) else [told[key]] * 2
            found["temperature" if key in ("peak", "probe") else key][1].append(
                Compared(row["weld"], weld, middle(told[key]), tuple(ends), row[own], (min(all_computed), max(all_computed))))
    return found


def cut_welds():
    """Settings with a search for voids: the weld, and whether the computed result, closed or not, is the reported one; a pore counts as closed."""
    rows = [row for row in measures.lines(measures.ROOT / WELDS) if "void" in row and not {"variant", "set"} & row.keys()]
    known = [(row, *settings_of_welds()[row["weld"]]) for row in rows]
    return [(weld, (row["void"] < 1.5 * row["void_resolved"]) == told["closed"]) for row, weld, told in known if "closed" in told]


def weld_ratios(_):
    """A row a weld, by metal: median deviation of the computed from the reported values over its settings, of how many settings
    the computed weld is closed, or not, as reported, and in how many mass scaling is too large to tell."""
    found, rows = reported_of_welds(), []
    rule = [row for row in measures.lines(measures.ROOT / WELDS) if not {"variant", "set"} & row.keys()]
    for weld in sorted({id(w): w for w, _ in settings_of_welds().values()}.values(), key=lambda w: (w["metal"], w["known"], w["weld"])):
        off = [[one.deviation for one in compared if one.weld["weld"] == weld["weld"]] for _, compared in found.values()]
        right = [agrees for own, agrees in cut_welds() if own["weld"] == weld["weld"]]
        inertia = [row["inertia"] > 10.0 for row in rule if settings_of_welds()[row["weld"]][0] == weld]
        if inertia:
            rows.append([weld["metal"], weld["weld"], weld["known"], *(f"{statistics.median(one):+.0f} %, {len(one)}" if one else "" for one in off),
                         f"{sum(right)} of {len(right)}" if right else "", f"{sum(inertia)} of {len(inertia)}"])
    return table(["metal", "weld", "reported values", *(title.rpartition(" [")[0] for title, _ in found.values()), "closed or not, as reported",
                  "inertial stress above 10 %"], rows)


def trust(_):
    """Deviation by kind of metal and of reported value: median over the welds (of the medians over their settings), the largest of a
    setting in brackets, and over how many; settings that are closed or not as reported."""
    def cell(compared):
        if not compared:
            return ""
        own = {one.weld["weld"]: [] for one in compared}
        for one in compared:
            own[one.weld["weld"]].append(one.deviation)
        settings = f", {len(compared)} settings" if len(compared) > len(own) else ""
        return (f"{statistics.median(abs(statistics.median(off)) for off in own.values()):.0f} % ({max((one.deviation for one in compared), key=abs):+.0f} %), "
                f"{len(own)} weld{'s' * (len(own) > 1)}{settings}")

    kinds = list(dict.fromkeys((weld["metal"], weld["known"]) for weld, _ in settings_of_welds().values()))
    rows = []
    for title, found in reported_of_welds().values():
        name = title.rpartition(" [")[0] + (" above 0 K" if title.startswith("temperature") else "")
        rows.append([name, *(cell([one for one in found if (one.weld["metal"], one.weld["known"]) == kind]) for kind in kinds)])
    right = [[agrees for weld, agrees in cut_welds() if (weld["metal"], weld["known"]) == kind] for kind in kinds]
    rows.append(["closed or not, as reported", *(f"{sum(one)} of {len(one)} settings" if one else "" for one in right)])
    return table(["median deviation (largest), welds", *(", ".join(kind) for kind in kinds)], rows)


def weld_changes(_):
    """Changes of the results of a weld with other cells, another mass scaling, or one other value of the rule in the same cells."""
    kept = {(row["weld"], row.get("variant"), row.get("set")): row for row in measures.lines(measures.ROOT / WELDS)}
    rows = []
    for (name, variant, value), weld in kept.items():
        own = kept.get((name, variant if value else "smooth" if (variant or "").startswith("smooth-") else None, None), weld)
        if weld is own:
            continue
        cells = MEANT.get(variant, "")
        rows.append([name, f"`{value}`" + (f" ({cells})" if cells else "") if value else cells,
                     *(f"{100.0 * (weld[key] / own[key] - 1.0):+.1f} %" for key, _, _ in SHOWN),
                     *(f"{round(weld[key] - own[key]):+d} K" for key in ("face", "hottest")),
                     (f"{own['void']:.1f} " if "void" in own else "") + f"-> {weld['void']:.1f}" if "void" in weld else ""])
    return table(["weld", "changed", "torque", "axial force", "power", "face", "hottest", "largest void [mm2]"], rows)


def weld_rule(_):
    """Welds with other films, another friction or another distance of travel, and the same welds with those of their pairs of surfaces."""
    others = measures.lines(measures.ROOT / RULE)
    own = [row for row in shown_welds() if row["weld"] in {other["weld"] for other in others}]
    rows = [[row["weld"], f"{row['film']:.0f}" if "film" in row else "pair", str(row["friction"] or "seizes") if "friction" in row else "pair",
             f"{row.get('travel', 2.0):.0f}", *(form.format(row[key]) for key, _, form in SHOWN), *(f"{row[key]:.0f}" if key in row else "" for key in ("face", "probe"))]
            for row in sorted((*others, *own), key=lambda row: row["weld"])]
    return table(["weld", "film at 1 MPa [W/(m2 K)]", "friction", "travel [radii]", *(title for _, title, _ in SHOWN), "face [K]",
                  "probe [K]"], rows)


def detection(_):
    """What catches drawn mutations of each library: the lines that tests/detection keeps."""
    sys.path.insert(0, str(measures.ROOT / "tests/detection"))
    import mutations

    return mutations.table(measures.lines(measures.ROOT / "tests/detection/mutations.jsonl"))


SLEEPING, PASS = "benchmarks/sleeping_results.json", "benchmarks/copper_pass.json"
PLATE = "benchmarks/stirred_plate.json"
PASSES = "benchmarks/passes/results/tables.json"
BAND = "benchmarks/graded_band.json"
BEGIN = "benchmarks/new_scenes.json"
ALL = {
    "detection": detection,
    "welds": welds, "welds, ratios": weld_ratios, "trust": trust, "welds, changes": weld_changes, "welds, rule": weld_rule, "welds, rabe": rabe, "choices": choices, "verification": verification, "disc on plate": disc_on_plate, "mass scaling": mass_scaling,
    "scaling": scaling, "plates": plates, "speed": speed, "features": features, "kernels": kernels, "cooling": cooling, "annealing": annealing, "calibration": calibration,
    "sleeping, tilted": kept(SLEEPING, "tilted tool at x = 25 mm"),
    "heat plates": heat_plates, "heat slab": heat_slab, "heat steps": heat_steps, "heat tolerance": heat_tolerance,
    "heat crossing": heat_crossing, "heat solvers": heat_solvers, "stretches": kept(SLEEPING, "stretches"), "copper pass": kept(PASS, "along the way"), "copper pass, sums": kept(PASS, "sums"),
    "stirred plate": kept(PLATE, "stirred plate"), "hot plate": kept(PLATE, "hot plate"),
    "disc on a hot plate": kept(PLATE, "disc on a hot plate"), "graded band": kept(BAND, "graded band"),
    **{f"passes, {title}": kept(PASSES, title) for title in ("cavity 1", "cavities", "AA5005", "experiments", "grains",
                                                            "mass scaling", "valley", "valley, laws", "runs")},
    "new scenes": kept(BEGIN, "scenes"),
}

SERIES = "benchmarks/work_precision/results.md"


def has_series(text):
    """Whether a document has the tables that benchmarks/work_precision writes from its results."""
    sys.path.insert(0, str(measures.ROOT / "benchmarks/work_precision"))
    import table as series

    return series.markdown(measures.lines(measures.PRECISION)) in text


# Which measurements a table holds, where not that of its name.
HOLDS = {"disc on plate": ("disc_on_plate",), "mass scaling": ("mass_scaling",), "choices": ("precision",),
         "verification": tuple(measure.name for measure in measures.of_verification()), "heat steps": ("heat slab",),
         "heat solvers": ("heat crossing",), "plates": ("scaling",)}


def documents_of(measure):
    """Documents with a table that holds a measurement."""
    held = {title for title in ALL if measure in HOLDS.get(title, (title,))}
    return [name for name in documents.NAMES if held & set(documents.tables(documents.read(name)))]
