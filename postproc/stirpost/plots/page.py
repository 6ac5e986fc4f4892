# SPDX-License-Identifier: MIT
"""One HTML page that needs nothing beside it."""

from __future__ import annotations

import base64
import io
from dataclasses import dataclass, field
from html import escape
from pathlib import Path

from ..analysis.alarms import Check, verdict
from ..io.files import write

LAYOUT = """
* { box-sizing: border-box; }
body { margin: 0; background: #f4f6f8; color: #22303c; font: 15px/1.5 system-ui, "DejaVu Sans", sans-serif; }
main { max-width: 1120px; margin: 0 auto; padding: 20px 18px 60px; }
h1 { font-size: 25px; line-height: 1.25; margin: 8px 0 4px; } h2 { font-size: 18px; margin: 32px 0 10px; }
p.sub { color: #5d6a75; margin: 0; font-size: 14px; }
p.weld { margin: 6px 0; } p.weld strong { padding: 1px 8px; }
p.checks { display: flex; flex-wrap: wrap; gap: 6px; margin: 6px 0 10px; font-size: 14px; }
p.checks a { padding: 1px 8px; border: 1px solid; color: inherit; text-decoration: none; }
.green { background: #e3f3e6; border-color: #2a8c4a; } .amber { background: #fdf1d8; border-color: #b8860b; }
.red { background: #fbe0dc; border-color: #c2331f; } .green::before { content: "\\2713  "; }
.amber::before { content: "!  "; } .red::before { content: "\\2717  "; }
nav { display: flex; flex-wrap: wrap; gap: 6px 14px; margin: 12px 0 0; font-size: 14px; } nav a { color: #0b6fa4; }
.wide { overflow-x: auto; background: white; border: 1px solid #dfe4ea; }
table { border-collapse: collapse; width: 100%; }
td, th { padding: 6px 10px; border-bottom: 1px solid #eceff3; text-align: left; vertical-align: top; }
th { font-weight: 600; border-bottom: 1px solid #dfe4ea; background: #fafbfc; }
td { font-variant-numeric: tabular-nums; }
table.process td:not(:first-child):not(.remark), table.phases td:not(:first-child) { white-space: nowrap; }
td.whole { background: #f7fafc; font-weight: 600; }
td.remark { color: #8c3208; font-size: 13.5px; line-height: 1.4; padding-top: 0; }
td.remark div { max-width: min(100%, calc(100vw - 60px)); position: sticky; left: 10px; }
tr.warned td { background: #fdf4ec; }
table.phases td, table.phases th { padding: 5px 8px; font-size: 14px; }
figure { margin: 0 0 18px; background: white; border: 1px solid #dfe4ea; padding: 10px; }
figure img { width: 100%; height: auto; display: block; }
figcaption { color: #44525f; font-size: 14px; padding-top: 8px; }
ul.alarms { background: #fdf1e7; border: 1px solid #d1541b; padding: 10px 12px 10px 30px; margin: 18px 0 0; }
.solid { background: white; border: 1px solid #dfe4ea; padding: 10px; }
.solid .canvas { touch-action: pan-y; cursor: grab; } .solid canvas { display: block; max-width: 100%; }
.solid .bar { display: flex; flex-wrap: wrap; gap: 8px 14px; align-items: center; padding-top: 8px; font-size: 14px; }
.solid input[type=range] { flex: 1 1 180px; min-width: 120px; } .solid .time { min-width: 86px; }
.solid .scale { display: flex; gap: 8px; align-items: center; flex: 1 1 200px; }
.solid .scale i { flex: 1; height: 10px; border-radius: 3px; }
.solid p { margin: 0; display: none; } .solid.none p { display: block; } .solid.none .bar, .solid.none .canvas { display: none; }
button, select { font: inherit; padding: 3px 10px; border: 1px solid #b9c3cd; border-radius: 4px; background: #fafbfc; }
details { background: white; border: 1px solid #dfe4ea; padding: 8px 12px; margin-top: 10px; }
summary { cursor: pointer; font-weight: 600; }
pre { overflow-x: auto; font-size: 13px; line-height: 1.4; margin: 10px 0 0; }
@media (max-width: 560px) { main { padding: 12px 10px 40px; } h1 { font-size: 20px; } td, th { padding: 5px 7px; font-size: 13.5px; }
  figure { padding: 4px; margin-left: -6px; margin-right: -6px; } .scroll { overflow-x: auto; } .scroll img { min-width: 640px; } }
"""


@dataclass
class Picture:
    path: Path
    caption: str
    chapter: str


@dataclass
class Page:
    """What stands on the page, from the top."""

    title: str
    origin: str
    joint: tuple[str, str] | None = None  # traffic light, and whether the weld is closed
    weld: str = ""  # what was welded, with which tool and how
    checks: list[Check] = field(default_factory=list)
    alarms: list[str] = field(default_factory=list)
    process: tuple[list[str], list[tuple[str, list[str], str]]] | None = None
    results: list[tuple[str, str]] = field(default_factory=list)
    solid: str = ""  # data of the view that turns, '' for none
    pictures: list[Picture] = field(default_factory=list)
    tables: list[tuple[str, list[str], list[list[str]]]] = field(default_factory=list)
    figures: list[tuple[str, str]] = field(default_factory=list)
    input_text: str = ""

    def write(self, path: Path) -> None:
        from . import solid

        chapters = list(dict.fromkeys(picture.chapter for picture in self.pictures))
        parts = []
        if self.process:
            parts.append(("Process", process(*self.process)))
        if self.results:
            parts.append(("Metal", f'<div class="wide">{pairs(self.results)}</div>'))
        if self.solid:
            parts.append(("The metal and the tool", SOLID))
        for chapter in chapters:
            shown = "\n".join(embedded(picture) for picture in self.pictures if picture.chapter == chapter)
            parts.append((chapter, shown))
        if self.tables or self.figures:
            more = "\n".join(table(*one) for one in self.tables)
            parts.append(("All figures", f'<div class="wide">{pairs(self.figures)}</div>{more}'))
        if self.input_text.strip():
            parts.append(("Input", f"<details><summary>The input as it was run, with the defaults of what it does not give</summary><pre>{escape(self.input_text)}</pre></details>"))
        warned = "".join(f"<li>{escape(text)}</li>" for text in self.alarms)
        warned = f'<ul class="alarms">{warned}</ul>' if warned else ""
        links = "".join(f'<a href="#c{k}">{escape(title)}</a>' for k, (title, _) in enumerate(parts))
        body = "\n".join(f'<section id="c{k}"><h2>{escape(title)}</h2>\n{text}</section>' for k, (title, text) in enumerate(parts))
        drawn = (f"<script>{solid.library()}</script>\n<script>{solid.script()}\n"
                 f'window.view = viewer(document.querySelector(".solid"), {self.solid});</script>') if self.solid else ""
        write(path, f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{escape(self.title)}</title>
<style>{LAYOUT}</style>
</head>
<body><main>
<h1>{escape(self.title)}</h1>
{joint(self.joint)}{trust(self.weld, self.checks, [title for title, _ in parts])}
<p class="sub">{escape(self.origin)}</p>
<nav>{links}</nav>
{warned}
{body}
</main>
{drawn}
</body>
</html>
""")


SOLID = """<div class="solid"><div class="canvas"></div>
<p>This browser has no WebGL: the view that turns is left out.</p>
<div class="bar"><button class="play">play</button><input type="range" min="0" value="0" step="1" aria-label="time">
<span class="time"></span></div>
<div class="bar"><select aria-label="colours"></select><span class="scale"></span>
<label><input type="checkbox" checked> tool</label></div></div>"""


def joint(found: tuple[str, str] | None) -> str:
    """Whether the weld is closed, first of all."""
    return f'<p class="weld"><strong class="{found[0]}">{escape(found[1])}</strong></p>\n' if found else ""


def trust(weld: str, checks: list[Check], sections: list[str]) -> str:
    """What was welded, whether its figures may be trusted, and each check with a link to the first of its sections."""
    level, words = verdict(checks)
    links = ""
    for check in checks:
        there = [f' href="#c{sections.index(name)}"' for name in check.sections if name in sections]
        links += f'<a class="{check.level}"{there[0] if there else ""}>{escape(check.name)}: {escape(check.value)}</a> '
    return f'<p class="weld">{escape(weld)} <strong class="{level}">{escape(words)}</strong></p>\n<p class="checks">{links}</p>'


def process(headings: list[str], rows: list[tuple[str, list[str], str]]) -> str:
    """Values in each phase; what to be wary of stands below them."""
    head = "".join(f"<th>{escape(text)}</th>" for text in ["", *headings])
    body = ""
    for name, values, remark in rows:
        cells = "".join(f'<td{" class=whole" * (k == len(values) - 1)}>{escape(text)}</td>' for k, text in enumerate(values))
        body += f"<tr{' class=warned' if remark else ''}><td>{escape(name)}</td>{cells}</tr>\n"
        if remark:
            body += f'<tr class=warned><td class="remark" colspan="{len(values) + 1}"><div>{escape(remark)}</div></td></tr>\n'
    return f'<div class="wide"><table class="process">\n<tr>{head}</tr>\n{body}</table></div>'


def pairs(rows: list[tuple[str, str]]) -> str:
    body = "\n".join(f"<tr><td>{escape(name)}</td><td>{escape(value)}</td></tr>" for name, value in rows)
    return f"<table>\n{body}\n</table>"


def table(title: str, headings: list[str], rows: list[list[str]]) -> str:
    head = "".join(f"<th>{escape(text)}</th>" for text in headings)
    body = "\n".join("<tr>" + "".join(f"<td>{escape(text)}</td>" for text in row) + "</tr>" for row in rows)
    return f'<h2>{escape(title)}</h2>\n<div class="wide"><table class="phases">\n<tr>{head}</tr>\n{body}\n</table></div>'


def embedded(picture: Picture) -> str:
    """As WebP, a quarter of the size of the PNG beside the page."""
    from PIL import Image

    file = io.BytesIO()
    with Image.open(picture.path) as image:
        image.convert("RGB").save(file, "WEBP", quality=88, method=1)
    data = base64.b64encode(file.getvalue()).decode("ascii")
    return (
        f'<figure><div class="scroll"><img src="data:image/webp;base64,{data}" alt="{escape(picture.caption)}"></div>'
        f"<figcaption>{escape(picture.caption)}</figcaption></figure>"
    )
