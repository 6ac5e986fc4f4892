# SPDX-License-Identifier: MIT
"""One HTML page that needs nothing beside it."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from html import escape
from pathlib import Path

LAYOUT = """
body { margin: 0; background: #f6f7f9; color: #22303c; 
       font: 15px/1.5 system-ui, "DejaVu Sans", sans-serif; }
main { max-width: 1080px; margin: 0 auto; padding: 24px 20px 60px; }
h1 { font-size: 26px; margin: 8px 0 2px; } h2 { font-size: 18px; margin: 34px 0 10px; }
p.sub { color: #5d6a75; margin: 0; }
table { border-collapse: collapse; background: white; border: 1px solid #dfe4ea; width: 100%; }
td { padding: 5px 12px; border-bottom: 1px solid #eceff3; }
td:last-child { font-variant-numeric: tabular-nums; }
figure { margin: 0 0 22px; background: white; border: 1px solid #dfe4ea; padding: 12px; }
figure img { width: 100%; height: auto; display: block; }
figcaption { color: #44525f; font-size: 14px; padding-top: 8px; }
table.phases td, table.phases th { text-align: right; padding: 5px 8px; font-size: 14px; }
table.phases td:first-child, table.phases th:first-child { text-align: left; }
th { font-weight: 600; border-bottom: 1px solid #dfe4ea; }
ul.alarms { background: #fdf1e7; border: 1px solid #d1541b; padding: 10px 12px 10px 30px; margin: 18px 0 0; }
pre { background: white; border: 1px solid #dfe4ea; padding: 14px; overflow-x: auto;
      font-size: 13px; line-height: 1.4; }
"""


@dataclass
class Picture:
    path: Path
    caption: str


def write_page(
    path: Path,
    title: str,
    subtitle: str,
    alarms: list[str],
    figures: list[tuple[str, str]],
    tables: list[tuple[str, list[str], list[list[str]]]],
    pictures: list[Picture],
    input_text: str,
) -> None:
    """Writes the page with its pictures inside it: what to be wary of, key figures, tables, pictures, the input."""
    rows = "\n".join(
        f"<tr><td>{escape(name)}</td><td>{escape(value)}</td></tr>" for name, value in figures
    )
    shown = "\n".join(embedded(picture) for picture in pictures)
    warned = "".join(f"<li>{escape(text)}</li>" for text in alarms)
    warned = f'<ul class="alarms">{warned}</ul>' if alarms else ""
    more = "\n".join(table(*parts) for parts in tables)
    drawn = f"<h2>Pictures</h2>\n{shown}" if pictures else ""
    given = f"<h2>Input</h2>\n<pre>{escape(input_text)}</pre>" if input_text.strip() else ""
    path.write_text(
        f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{escape(title)}</title>
<style>{LAYOUT}</style>
</head>
<body><main>
<h1>{escape(title)}</h1>
<p class="sub">{escape(subtitle)}</p>
{warned}
<h2>Key figures</h2>
<table>
{rows}
</table>
{more}
{drawn}
{given}
</main></body>
</html>
""",
        encoding="utf-8",
    )


def table(title: str, headings: list[str], rows: list[list[str]]) -> str:
    head = "".join(f"<th>{escape(text)}</th>" for text in headings)
    body = "\n".join("<tr>" + "".join(f"<td>{escape(text)}</td>" for text in row) + "</tr>" for row in rows)
    return f'<h2>{escape(title)}</h2>\n<table class="phases">\n<tr>{head}</tr>\n{body}\n</table>'


def embedded(picture: Picture) -> str:
    data = base64.b64encode(picture.path.read_bytes()).decode("ascii")
    return (
        f'<figure><img src="data:image/png;base64,{data}" alt="{escape(picture.caption)}">'
        f"<figcaption>{escape(picture.caption)}</figcaption></figure>"
    )
