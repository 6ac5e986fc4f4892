# SPDX-License-Identifier: MIT
"""What the Fortran sources of modules/ say of themselves: modules, `use` statements, procedures, and which
procedure calls which. A reader of this program's own style, no compiler: one module a file, `only` on every
`use`, declarations with `::`. A call through a type-bound name goes to the procedure of the declared type, and
for `class` to those of all types that extend it."""

import dataclasses
import pathlib
import re

DECLARED = re.compile(r"(?:type|class)\s*\(\s*(\w+)\s*\)|(?:integer|real|logical|character|complex|procedure)\b")
PROCEDURE = re.compile(r"(?:(?!end\b)[^'\"=]*\s)?(?:subroutine|function)\s+(\w+)\s*(?:\(|$)")
NAME = re.compile(r"[a-z_]\w*")


@dataclasses.dataclass
class Procedure:
    """A procedure of a module, with its number of arguments, its statements and the types of its variables ('' for
    plain ones)."""

    module: str
    name: str
    arguments: int = 0
    statements: list = dataclasses.field(default_factory=list)
    variables: dict = dataclasses.field(default_factory=dict)

    @property
    def key(self):
        return self.module, self.name


@dataclasses.dataclass
class Type:
    """A derived type: its components, the procedures bound to it, the type that it extends."""

    name: str
    parent: str = ""
    components: dict = dataclasses.field(default_factory=dict)
    bound: dict = dataclasses.field(default_factory=dict)


@dataclasses.dataclass
class Module:
    """A file of modules/: path, number of lines, and what stands in it."""

    path: pathlib.Path
    name: str
    lines: int
    uses: dict = dataclasses.field(default_factory=dict)        # local name -> (module, name)
    used: set = dataclasses.field(default_factory=set)          # modules
    types: dict = dataclasses.field(default_factory=dict)
    generics: dict = dataclasses.field(default_factory=dict)
    procedures: dict = dataclasses.field(default_factory=dict)

    @property
    def layer(self):
        return self.path.parent.name


def statements_of(text):
    """Statements in lower case, one each, without comments, continuation lines and what texts hold."""
    joined = ""
    for line in text.lower().splitlines():
        line = re.sub(r"'[^']*'|\"[^\"]*\"", "''", line)
        line = line.split("!")[0].strip()
        if line.startswith("#"):
            continue
        joined += line.lstrip("&") if joined else line
        if joined.endswith("&"):
            joined = joined[:-1] + " "
            continue
        yield from (part.strip() for part in joined.split(";") if part.strip())
        joined = ""


def split_list(text):
    """Items between the commas that stand in no parentheses."""
    items, depth = [""], 0
    for letter in text:
        depth += {"(": 1, "[": 1, ")": -1, "]": -1}.get(letter, 0)
        if letter == "," and depth == 0:
            items.append("")
        else:
            items[-1] += letter
    return items


def split_names(text):
    """Names of a list of declared entities: `a(3), b = f(1, 2), c => d`."""
    return [re.split(r"[=(*]", item)[0].strip() for item in split_list(text)]


def declare(statement, into):
    match = DECLARED.match(statement)
    if match and "::" in statement:
        for name in split_names(statement.split("::", 1)[1]):
            into[name] = (match.group(1) or "", statement.startswith("class"))


def read_module(path):
    text = path.read_text(encoding="utf-8")
    module = Module(path, "", text.count("\n"))
    inside, stack, is_interface = None, [], False
    for s in statements_of(text):
        if match := re.match(r"module\s+(?!procedure\b)(\w+)$", s):
            module.name = match.group(1)
        elif match := re.match(r"use\s*(?:,\s*\w+\s*)?(?:::)?\s*(\w+)\s*(?:,\s*only\s*:\s*(.*))?$", s):
            module.used.add(match.group(1))
            for item in (match.group(2) or "").split(","):
                local, _, name = (part.strip() for part in item.partition("=>"))
                if local:
                    module.uses[local] = (match.group(1), name or local)
        elif re.match(r"(abstract\s+)?interface\b", s):
            is_interface, generic = True, s.split()[-1]
        elif re.match(r"end\s*interface", s):
            is_interface = False
        elif is_interface:
            if match := re.match(r"(?:module\s+)?procedure\s*(?:::)?\s*(.*)$", s):
                module.generics.setdefault(generic, []).extend(split_names(match.group(1)))
        elif match := re.match(r"type\s*(?:,[^:]*)?(?:::)?\s*(\w+)$", s):
            extends = re.search(r"extends\s*\(\s*(\w+)\s*\)", s)
            inside = module.types[match.group(1)] = Type(match.group(1), extends.group(1) if extends else "")
        elif re.match(r"end\s*type\b", s):
            inside = None
        elif inside is not None:
            read_component(s, inside)
        elif match := PROCEDURE.match(s):
            stack.append(Procedure(module.name, match.group(1), len([name for name in split_names(s[match.end():].partition(")")[0]) if name])))
            module.procedures[stack[-1].name] = stack[-1]
            declare(s[:match.start(1)].replace("function", "::"), {})
        elif re.match(r"end\s*(subroutine|function)\b", s):
            stack.pop()
        elif stack:
            declare(s, stack[-1].variables)
            stack[-1].statements.append(s)
    return module


def read_component(statement, kind):
    if match := re.match(r"(procedure|generic)\b[^:]*::\s*(.*)$", statement):
        if match.group(1) == "generic":
            name, _, targets = match.group(2).partition("=>")
            kind.bound[name.strip()] = [part.strip() for part in targets.split(",")]
            return
        for item in match.group(2).split(","):
            name, _, target = (part.strip() for part in item.partition("=>"))
            kind.bound[name] = [] if "deferred" in statement else [target or name]
    else:
        declare(statement, kind.components)


def designators(text):
    """Chains of names, `a(i)%b%c(...)` as [a, b, c], and those inside their parentheses."""
    place, found = 0, []
    while match := NAME.search(text, place):
        place = match.end()
        if match.start() > 0 and (text[match.start() - 1] in "%._" or text[match.start() - 1].isdigit()):
            continue
        chain = [match.group()]
        while True:
            rest = re.match(r"\s*", text[place:]).end() + place
            if text[rest:rest + 1] == "(":
                end = closing(text, rest)
                found += designators(text[rest + 1:end])
                place = end + 1
            elif text[rest:rest + 1] == "%":
                name = NAME.search(text, rest)
                chain.append(name.group())
                place = name.end()
            else:
                break
        found.append(chain)
    return found


def closing(text, place):
    """Place of the parenthesis that closes the one at `place`."""
    depth = 0
    for k in range(place, len(text)):
        depth += {"(": 1, ")": -1}.get(text[k], 0)
        if depth == 0:
            return k
    return len(text)


class Sources:
    """All modules below modules/, and the calls between their procedures."""

    def __init__(self, root):
        paths = [path for path in sorted((root / "modules").glob("*/*.[fF]90")) if path.parent.name != "petsc"]
        found = [read_module(path) for path in paths if not path.stem.endswith("_none")]
        self.modules = {module.name: module for module in found}
        self.heirs = {}
        for module in found:
            for kind in module.types.values():
                if kind.parent:
                    self.heirs.setdefault(self.type_of(module, kind.parent), []).append((module.name, kind.name))

    def procedures(self):
        return (procedure for module in self.modules.values() for procedure in module.procedures.values())

    def in_scope(self, module, name):
        """The procedures that `name` means in a module."""
        if name in module.generics:
            return [key for one in module.generics[name] for key in self.in_scope(module, one)]
        if name in module.procedures:
            return [(module.name, name)]
        if name in module.uses and module.uses[name][0] in self.modules:
            other, theirs = module.uses[name]
            return self.in_scope(self.modules[other], theirs)
        return []

    def type_of(self, module, name):
        """Module and name of the type that `name` means in a module; None if it is of no module here."""
        if name in module.types:
            return module.name, name
        if name in module.uses and module.uses[name][0] in self.modules:
            return self.type_of(self.modules[module.uses[name][0]], module.uses[name][1])
        return None

    def bound_to(self, kind, name, with_heirs):
        """The procedures behind the bound `name` of a type; None if it has none of this name."""
        module = self.modules[kind[0]]
        definition = module.types[kind[1]]
        found = None
        if name in definition.bound:
            found = []
            for target in definition.bound[name]:
                deeper = self.bound_to(kind, target, False) if target != name and target in definition.bound else None
                found += deeper or self.in_scope(module, target)
        elif definition.parent:
            found = self.bound_to(self.type_of(module, definition.parent), name, False)
        if found is not None and with_heirs:
            for heir in self.heirs.get(kind, []):
                found = found + (self.bound_to(heir, name, True) or [])
        return found

    def component(self, kind, name):
        """Type of a component of a type, and whether it is polymorphic."""
        while kind:
            module = self.modules[kind[0]]
            definition = module.types[kind[1]]
            if name in definition.components:
                written, is_class = definition.components[name]
                return self.type_of(module, written), is_class
            kind = self.type_of(module, definition.parent)
        return None, False

    def follow(self, chain, variables):
        """Procedures called by a chain of names, and the type at its end."""
        kind, is_class = variables.get(chain[0], (None, False))
        for name in chain[1:]:
            if not kind:
                return [], (None, False)
            called = self.bound_to(kind, name, is_class)
            if called is not None:
                return called, (None, False)
            kind, is_class = self.component(kind, name)
        return [], (kind, is_class)

    def calls_of(self, procedure):
        """Keys of the procedures that one calls."""
        module, called = self.modules[procedure.module], set()
        variables = {name: (self.type_of(module, written), is_class)
                     for name, (written, is_class) in procedure.variables.items()}
        for s in procedure.statements:
            if match := re.match(r"(?:\w+\s*:\s*)?associate\s*\((.*)\)$", s):
                for item in split_list(match.group(1)):
                    local, _, meant = (part.strip() for part in item.partition("=>"))
                    chains = designators(meant)
                    variables[local] = self.follow(chains[-1], variables)[1] if chains else (None, False)
            for chain in designators(s):
                if len(chain) > 1:
                    called.update(self.follow(chain, variables)[0])
                elif chain[0] not in variables:
                    called.update(self.in_scope(module, chain[0]))
        called.discard(procedure.key)
        return called

    def graph(self):
        """Every procedure -> those it calls."""
        return {procedure.key: self.calls_of(procedure) for procedure in self.procedures()}
