#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The architecture as the sources have it: writes the table of layers in docs/architecture.md from the add_layer
lists of CMakeLists.txt (its last column is kept), and reports where document or sources leave the rules.

    docs/architecture.py           writes the table into docs/architecture.md
    docs/architecture.py --check   what is out of date or against the rules; exit status 1 if anything is
    docs/architecture.py --step    the files that a step with a tool passes, and the way to the kernels
    docs/architecture.py --metrics measures of size and coupling of the sources
"""

import argparse
import pathlib
import re
import sys

import call_graph

MANY_ARGUMENTS = 9           # of a procedure, above which it is counted
# Files of them with procedures that take the whole simulation: a list that only shrinks. All others take parts of it.
MAY_CARRY = {
    "front": "estimate prepare report",
    "heat": "conduction",
    "hooks": "source",
    "output": "checkpoint diagnostics error_norms guards history progress totals warnings writer",
    "run": "balance debris loop mass_scaling regrid restart",
    "state": "parts",
    "step": "acceptance advance constraints drives filter grid_motion room schedule to_grid",
}
# Parts of the simulation that a procedure of these layers takes instead, at most.
MOST_PARTS = {"state": 3, "boundary": 3, "hooks": 3, "mpm": 5, "heat": 5, "contact": 7, "sleep": 7}

REPEATED = 5                 # statements in the same order that count as a duplicate if they stand in two places

SERVICES = {"base", "grid", "particles"}   # memory, messages, numbers of nodes, storage
STEP_BEGINS = ("step_advance", "take_step")
KERNELS = {("transfer_scatter", "p2g_block"), ("transfer_gather", "gather_block")}
# What a step with a tool does not enter: one body of one law, FLIP, USL, nothing asleep.
NOT_ENTERED = {
    "step_advance.update_stress_before": "USAVG",
    "step_advance.remap_velocities": "MUSL, USAVG",
    "mpm_sweeps.move_block": "MUSL, USAVG",
    "mpm_blocks.gather_gradient": "APIC",
    "step_filter": "XPIC, FMPM",
    "contact_body_pairs": "contact of bodies",
    "contact_body_kept": "contact of bodies",
    "sleep_held_layer": "sleepers",
    "sleep_cubes": "sleepers",
    "mpm_prescribed": "known fields",
    "mpm_tractions": "tractions",
    "state_probes": "probes",
    "state_parts.after_nodes": "hooks",
    "physics_flow_law": "laws with internal variables; its procedures are empty defaults for the others",
}
# Extensions of a type, by the beginning of their names: a step enters one, and what that rests on.
ENTERED = {
    "physics_law_": {"physics_law_johnson_cook"},
    "physics_field": set(),
    "state_clamp": set(), "state_conditions": set(),    # walls, and clamps whose nodes move alike, are not asked
    "hooks": set(),
    "tools_mesh": set(),
    "tools_shape": {"tools_shape_revolved", "tools_shape", "tools_shape_shoulder"},
}
# Blocks come back from the grid while sums of contact are on their way: no way of its own to the kernels.
WAITING = ("step_schedule", "sum_with_overlap")

STAIRS = re.compile(r"^\s*!!.*$", re.MULTILINE)
DECLARES = re.compile(r"use\b|.*::|end\b|implicit\b")
FORTRAN = {".f90", ".F90"}
INTRINSIC = {"abs", "all", "any", "count", "dot_product", "exp", "log", "max", "maxval", "merge", "min", "minval", "norm2", "product",
             "real", "sign", "size", "sqrt", "sum"}
# Libraries of others, and the modules or headers by which a source uses them.
LIBRARIES = {"MPI::MPI_Fortran": ["mpi_f08"], "MPI::MPI_C": ["mpi.h"], "hdf5::fortran": ["hdf5"]}

LAYERS = re.compile(r"(<!-- layers: .*?-->\n)(.*?)(<!-- end of the layers -->)", re.DOTALL)
CONTENT = re.compile(r"^\|[^|]*\| `(\w+)` \|[^|]*\| ([^|]+) \|$", re.MULTILINE)
LISTED = re.compile(r"<!-- (step|walks): .*?-->\n(.*?)<!-- end of the \1 -->", re.DOTALL)


def layers_of(root):
    """Layers of CMakeLists.txt, lowest first: name -> the layers it is linked to."""
    text = (root / "CMakeLists.txt").read_text(encoding="utf-8")
    found = {}
    for name, body in re.findall(r"^add_layer\((\w+)\s(.*?)\)$", text, re.DOTALL | re.MULTILINE):
        uses = body.split("USES", 1)[1].split() if "USES" in body else []
        found[name] = [word for word in uses if word in found]
    return found


def below(layers, name):
    """All layers under `name`, direct or not."""
    return {lower for use in layers[name] for lower in {use} | below(layers, use)}


def height(layers, name):
    return 1 + max((height(layers, use) for use in layers[name]), default=0)


def drawn(layers, content):
    """A row a layer, highest first; layers of a height do not use each other. Then the layers that it
    rests on, without those that these rest on themselves, and its content."""
    lines = ["| | layer | rests on | content |\n", "|---|---|---|---|\n"]
    order = sorted(layers, key=lambda name: (-height(layers, name), name))
    for number, name in enumerate(order):
        covered = set().union(*(below(layers, use) for use in layers[name]))
        rests = sorted(set(layers[name]) - covered, key=lambda use: (-height(layers, use), use))
        first = number == 0 or height(layers, order[number - 1]) != height(layers, name)
        label = height(layers, name) if first else ""
        lines.append(f"| {label} | `{name}` | {', '.join(rests)} | {content.get(name, '')} |\n")
    return "".join(lines)


def check_text(root, text):
    """What docs/architecture.md says that is not so."""
    layers = layers_of(root)
    table, listed, content = LAYERS.search(text), dict(LISTED.findall(text)), dict(CONTENT.findall(text))
    if not table or table.group(2) != drawn(layers, content):
        yield "docs/architecture.md: the table of the layers is out of date: run docs/architecture.py"
    for name in layers:
        if name not in content:
            yield f"docs/architecture.md: the table of layers lacks the content of {name}"
    blocks = [re.findall(r"```\n(.*?)```", listed.get(name, ""), re.DOTALL) or [f"no {name}"] for name in ("step", "walks")]
    for line in "".join(sum(blocks, [])).splitlines():
        names = re.search(r"(\w+) +(\w+/\w+\.[fF]90)", line)
        if not names:
            yield f"docs/architecture.md: a line of the step or of a walk names no procedure and file: {line.strip()}"
            continue
        procedure, file = names.groups()
        path = root / "modules" / file
        if not path.exists() or not re.search(rf"(subroutine|function) {procedure}\b", path.read_text(encoding="utf-8")):
            yield f"docs/architecture.md: {procedure} is not in modules/{file}"


def components(graph):
    """Sets of nodes of a graph that reach each other (Tarjan 1972), of more than one node."""
    number, low, stack, found = {}, {}, [], []

    def visit(node):
        number[node] = low[node] = len(number)
        stack.append(node)
        for other in sorted(graph.get(node, ())):
            if other not in number:
                visit(other)
            if other in stack:
                low[node] = min(low[node], low[other])
        if low[node] == number[node]:
            group = stack[stack.index(node):]
            del stack[stack.index(node):]
            if len(group) > 1:
                found.append(sorted(group))

    for node in sorted(graph):
        if node not in number:
            visit(node)
    return found


def check_comments(sources):
    """A comment behind code is one line; a longer one stands above the declaration."""
    for module in sources.modules.values():
        for number, line in enumerate(module.path.read_text(encoding="utf-8").splitlines(), 1):
            if STAIRS.match(line):
                yield f"{module.path.parent.name}/{module.path.name}:{number}: a comment behind code goes on: set it above the declaration"


def arguments_of(text):
    """(name, its items between parentheses) of all references and array elements of a statement."""
    for match in re.finditer(r"(\w+)\s*\(", text):
        items = call_graph.split_list(text[match.end():call_graph.closing(text, match.end() - 1)])
        yield match.group(1), [item.strip() for item in items]


def has_strides(target):
    """True if the elements of a section do not follow each other in memory: `a(i, 1:3)`, `a(1:2, :)`."""
    return any(":" in item and before != ":" for _, items in arguments_of(target) for before, item in zip(items, items[1:]))


def check_sections(sources):
    """gfortran 12 passes an associate name of a section with strides as if its elements followed each other."""
    for procedure in sources.procedures():
        associates = []
        for s in procedure.statements:
            if s.startswith("associate"):
                pairs = [item.partition("=>") for item in next(arguments_of(s))[1]]
                associates.append({name.strip() for name, _, target in pairs if has_strides(target)})
            elif s.startswith("end associate"):
                associates.pop()
            else:
                passed = {item for called, items in arguments_of(s) if called not in INTRINSIC for item in items}
                for name in sorted(passed & set().union(*associates)):
                    yield f"{procedure.module}: {procedure.name} passes {name}, a name of a section with strides: pass the section"


def check_uses(sources, layers):
    """Every `use` goes down, along a USES; no layer reaches itself."""
    graph = {}
    for module in sources.modules.values():
        for name in module.used & set(sources.modules):
            lower = sources.modules[name].layer
            if lower == module.layer:
                continue
            graph.setdefault(module.layer, set()).add(lower)
            if lower not in layers.get(module.layer, []):
                yield f"{module.name}: uses {name}, but {module.layer} has no USES {lower} in CMakeLists.txt"
    for group in components(graph):
        yield f"a cycle of layers: {', '.join(group)}"


def links_of(root):
    """Targets of CMake: (name, its source files, the names of the libraries that it is linked to)."""
    text = (root / "CMakeLists.txt").read_text(encoding="utf-8")
    for name, body in re.findall(r"^add_layer\((\w+)\s(.*?)\)$", text, re.DOTALL | re.MULTILINE):
        yield name, sorted((root / "modules" / name).iterdir()), body.partition("USES")[2].split()
    for folder in (root, root / "tests"):
        text = (folder / "CMakeLists.txt").read_text(encoding="utf-8")
        for name, file, links in re.findall(r"^add_mpi_test\((\w+) +(\S+) [\d ]+ USES (.*?)\)$", text, re.MULTILINE):
            yield name, [folder / file], links.split()
        for name, files in re.findall(r"^add_(?:executable|library)\((\w+) (?:STATIC\s+)?([\w./\s]+)\)$", text, re.MULTILINE):
            links = re.findall(rf"^target_link_libraries\({name} \w+ (.*?)\)$", text, re.MULTILINE)
            yield name, [folder / file for file in files.split()], " ".join(links).split()


def check_links(root):
    """Every layer and library that a target is linked to is used by one of its sources."""
    holds, uses = {name: set(modules) for name, modules in LIBRARIES.items()}, {}
    for name, paths, links in links_of(root):
        holds[name], used = set(), set()
        for path in paths:
            if path.suffix in FORTRAN:
                module = call_graph.read_module(path)
                holds[name].add(module.name)
                used |= module.used
            else:
                used.update(re.findall(r"#include <(.*?)>", path.read_text(encoding="utf-8")))
        uses[name] = links, used
    for name, (links, used) in uses.items():
        for link in links:
            if link in holds and not used & holds[link]:
                yield f"CMake: {name} is linked to {link}, which none of its sources uses"


def carries(procedure):
    return any(kind == "simulation_t" for kind, _ in procedure.variables.values())


def check_owners(sources):
    """Only listed files take the whole simulation, and every listed one does; few parts stand in its place."""
    listed = {f"{layer}_{name}" for layer, names in MAY_CARRY.items() for name in names.split()}
    parts = {kind for kind, _ in sources.modules["state_parts"].types["simulation_t"].components.values() if kind}
    for procedure in sources.procedures():
        if carries(procedure) and procedure.module not in listed:
            yield f"{procedure.module}: {procedure.name} takes the whole simulation: give it the parts that it uses"
        taken = {kind for kind, _ in procedure.variables.values()} & parts
        most = MOST_PARTS.get(sources.modules[procedure.module].layer, len(taken))
        if len(taken) > most:
            yield f"{procedure.module}: {procedure.name} takes {len(taken)} parts of the simulation, more than {most}"
    for name in sorted(listed - {procedure.module for procedure in sources.procedures() if carries(procedure)}):
        yield f"docs/architecture.py: no procedure of {name} takes the whole simulation any more: take it off MAY_CARRY"


def step_graph(sources):
    """Calls of a step with a tool: procedures -> those they call."""
    def enters(key):
        entered = [modules for start, modules in ENTERED.items() if key[0].startswith(start)]
        return key[0] not in NOT_ENTERED and ".".join(key) not in NOT_ENTERED and all(key[0] in modules for modules in entered)

    whole, graph, front = sources.graph(), {}, [STEP_BEGINS]
    while front:
        key = front.pop()
        if key not in graph:
            graph[key] = {called for called in whole[key] if enters(called)}
            front += graph[key]
    return graph


def files_passed(sources, graph):
    """Modules of a step's procedures, without those of the services below it."""
    return sorted({module for module, _ in graph if sources.modules[module].layer not in SERVICES})


def deepest(graph, key, known):
    """The longest way from a procedure to a kernel, as a list of procedures; empty if there is none."""
    if key in KERNELS:
        return [key]
    if key not in known:
        known[key] = []                     # of a procedure that calls itself
        ways = [deepest(graph, called, known) for called in sorted(graph[key]) if called != WAITING]
        longest = max(ways, key=len, default=[])
        known[key] = [key, *longest] if longest else []
    return known[key]


def check_step(sources):
    named = {procedure.module for procedure in sources.procedures()}
    named |= {".".join(procedure.key) for procedure in sources.procedures()}
    missing = sorted((set(NOT_ENTERED).union(*ENTERED.values()) | {".".join(key) for key in {*KERNELS, STEP_BEGINS, WAITING}}) - named)
    if missing:
        yield f"docs/architecture.py: names what is not there: {', '.join(missing)}"
        return
    if not deepest(step_graph(sources), STEP_BEGINS, {}):
        yield "a step with a tool reaches no kernel: the call graph is broken"


def problems(root):
    """All that is out of date or against the rules in a source tree."""
    layers, sources = layers_of(root), call_graph.Sources(root)
    text = (root / "docs/architecture.md").read_text(encoding="utf-8")
    return [*check_text(root, text), *check_comments(sources), *check_sections(sources), *check_uses(sources, layers), *check_links(root),
            *check_owners(sources), *check_step(sources)]


def print_step(root):
    sources = call_graph.Sources(root)
    graph = step_graph(sources)
    for module in files_passed(sources, graph):
        path = sources.modules[module].path.relative_to(root / "modules")
        print(f"{str(path):<36}{' '.join(sorted(name for where, name in graph if where == module))}")
    print(f"{len(files_passed(sources, graph))} files")
    print("deepest: " + " > ".join(name for _, name in deepest(graph, STEP_BEGINS, {})))


def repeated_statements(procedures):
    """Statements of procedures that belong to a run of REPEATED equal statements standing elsewhere too."""
    places = {}
    for procedure in procedures:
        for k in range(len(procedure.statements) - REPEATED + 1):
            run = tuple(re.sub(r"\s+", " ", s) for s in procedure.statements[k:k + REPEATED])
            if not all(DECLARES.match(s) for s in run):
                places.setdefault(run, []).append((procedure.key, k))
    return len({(key, k + i) for found in places.values() if len(found) > 1 for key, k in found for i in range(REPEATED)})


def print_metrics(root):
    """A table of two columns: what is measured in modules/, and its value."""
    sources = call_graph.Sources(root)
    procedures = list(sources.procedures())
    arguments = [procedure.arguments for procedure in procedures]
    statements = [s for procedure in procedures for s in procedure.statements]
    depths = [len(chain) - 1 for s in statements for chain in call_graph.designators(s)]
    texts = [path.read_text(encoding="utf-8") for path in (root / "modules").glob("*/*.[fF]90")]
    carriers = sum(map(carries, procedures))
    step = step_graph(sources) if STEP_BEGINS[0] in sources.modules else {}
    of_step = [procedure.arguments for procedure in procedures if procedure.key in step]
    for name, value in {
            "lines": sum(text.count("\n") for text in texts),
            "layers, files, lines of the longest file": f"{len(layers_of(root))}, {len(texts)}, {max(text.count(chr(10)) for text in texts)}",
            "procedures": len(procedures),
            "arguments of a procedure: mean, most": f"{sum(arguments) / len(arguments):.1f}, {max(arguments)}",
            f"procedures with more than {MANY_ARGUMENTS} arguments": sum(number > MANY_ARGUMENTS for number in arguments),
            "procedures with a variable of type simulation_t": carriers,
            "a step with a tool: procedures, files, most arguments, calls to a kernel":
                f"{len(step)}, {len(files_passed(sources, step))}, {max(of_step, default=0)}, "
                f"{max(0, len(deepest(step, STEP_BEGINS, {})) - 1) if step else 0}",
            "component references of one, two, three or more %": ", ".join(str(sum(map(test, depths))) for test in (
                lambda depth: depth == 1, lambda depth: depth == 2, lambda depth: depth > 2)),
            "continuation lines of comments behind code": sum(len(STAIRS.findall(text)) for text in texts),
            f"statements in runs of {REPEATED} that stand in two places, of": f"{repeated_statements(procedures)}, {len(statements)}",
            }.items():
        print(f"{name:<76}{value}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="only say what is out of date or against the rules")
    parser.add_argument("--step", action="store_true", help="only say what a step with a tool passes")
    parser.add_argument("--metrics", action="store_true", help="only print measures of size and coupling")
    parser.add_argument("--root", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parents[1],
                        help="another source tree")
    given = parser.parse_args()
    if given.step:
        print_step(given.root)
    elif given.metrics:
        print_metrics(given.root)
    elif given.check:
        found = problems(given.root)
        print("\n".join(found) if found else "architecture: as documented, by its rules")
        return 1 if found else 0
    else:
        document = given.root / "docs/architecture.md"
        text = document.read_text(encoding="utf-8")
        table = drawn(layers_of(given.root), dict(CONTENT.findall(text)))
        document.write_text(LAYERS.sub(lambda m: m.group(1) + table + m.group(3), text), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
