#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The picture of the layers in docs/architecture.md, drawn from the add_layer lists of CMakeLists.txt.

    docs/architecture.py           writes the picture into docs/architecture.md
    docs/architecture.py --check   what is out of date; exit status 1 if anything is
"""

import argparse
import pathlib
import re
import sys

PICTURE = re.compile(r"(<!-- layers: .*?-->\n```\n)(.*?)(```\n<!-- end of the layers -->)", re.DOTALL)
STEP = re.compile(r"<!-- step: .*?-->\n```\n(.*?)```\n<!-- end of the step -->", re.DOTALL)


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


def drawn(layers):
    """A line a layer, highest first; layers of a height do not use each other. Behind it stand the
    layers that it rests on, without those that these rest on themselves."""
    lines = []
    order = sorted(layers, key=lambda name: (-height(layers, name), name))
    for number, name in enumerate(order):
        covered = set().union(*(below(layers, use) for use in layers[name]))
        rests = sorted(set(layers[name]) - covered, key=lambda use: (-height(layers, use), use))
        first = number == 0 or height(layers, order[number - 1]) != height(layers, name)
        label = f"{height(layers, name):2d}" if first else "  "
        lines.append(f"{label}  {name:<14}{'-> ' if rests else ''}{', '.join(rests)}".rstrip() + "\n")
    return "".join(lines)


def check_text(root, text):
    """What docs/architecture.md says that is not so."""
    layers = layers_of(root)
    picture, step = PICTURE.search(text), STEP.search(text)
    if not picture or picture.group(2) != drawn(layers):
        yield "docs/architecture.md: the picture of the layers is out of date: run docs/architecture.py"
    described = " ".join(re.findall(r"^\| (`.*?) \|", text, re.MULTILINE))
    for name in layers:
        if f"`{name}`" not in described:
            yield f"docs/architecture.md: the table of layers lacks {name}"
    for line in step.group(1).splitlines() if step else ["no step"]:
        names = re.search(r"(\w+) +(\w+/\w+\.[fF]90)", line)
        if not names:
            yield f"docs/architecture.md: a line of the step names no procedure and file: {line.strip()}"
            continue
        procedure, file = names.groups()
        path = root / "modules" / file
        if not path.exists() or not re.search(rf"(subroutine|function) {procedure}\b", path.read_text(encoding="utf-8")):
            yield f"docs/architecture.md: {procedure} is not in modules/{file}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="only say what is out of date")
    parser.add_argument("--root", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parents[1],
                        help="another source tree")
    given = parser.parse_args()
    document = given.root / "docs/architecture.md"
    text = document.read_text(encoding="utf-8")
    if not given.check:
        picture = drawn(layers_of(given.root))
        document.write_text(PICTURE.sub(lambda m: m.group(1) + picture + m.group(3), text), encoding="utf-8")
        return 0
    found = list(check_text(given.root, text))
    print("\n".join(found) if found else "architecture: as documented")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
