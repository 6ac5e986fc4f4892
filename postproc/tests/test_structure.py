# SPDX-License-Identifier: MIT
"""Folders of the package import only lower ones, and there are no import cycles."""

import ast
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "stirpost"
LAYERS = ("io", "analysis", "plots", "run", "calibrate", "cli")


def imports_of(path: Path) -> set[str]:
    """Modules of the package that a file imports when it is run, wherever in it; what is there for annotations does not count."""
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    found, nodes = set(), [ast.parse(path.read_text(encoding="utf-8"))]
    while nodes:
        node = nodes.pop()
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            continue
        if isinstance(node, ast.ImportFrom) and node.level:
            base = [*parts[:len(parts) - node.level], *(node.module.split(".") if node.module else [])]
            for name in node.names:
                whole = PACKAGE.joinpath(*base, f"{name.name}.py").is_file()
                found.add(".".join([*base, name.name] if whole else base))
        nodes += ast.iter_child_nodes(node)
    return found


def test_no_module_is_used_by_one_that_it_uses():
    modules = {".".join(path.relative_to(PACKAGE).with_suffix("").parts).removesuffix(".__init__"): path for path in PACKAGE.rglob("*.py")
               if path.parent != PACKAGE or path.stem == "run"}
    uses = {name: imports_of(path) & set(modules) - {name} for name, path in modules.items()}
    for name, used in uses.items():
        above = [other for other in used if LAYERS.index(other.split(".")[0]) > LAYERS.index(name.split(".")[0])]
        assert not above, f"{name} uses {above}"
    left = dict(uses)
    while left:
        free = [name for name, used in left.items() if not used & set(left)]
        assert free, f"these use one another: {sorted(left)}"
        for name in free:
            del left[name]
