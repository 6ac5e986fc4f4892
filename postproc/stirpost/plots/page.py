# SPDX-License-Identifier: MIT
"""One HTML page that needs nothing beside it: assets/page.html, filled in."""

from __future__ import annotations

import base64
import io
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path

from ..analysis.alarms import Check, verdict
from ..io.files import write


@dataclass
class Picture:
    path: Path
    caption: str
    chapter: str


@dataclass
class Page:
    """Content of the page, from the top."""

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
        from jinja2 import Environment

        from . import solid

        chapters: dict[str, list[tuple[Picture, str]]] = {}
        for picture in self.pictures:
            chapters.setdefault(picture.chapter, []).append((picture, embedded(picture)))
        parts = (("Process", self.process), ("Metal", self.results), ("The metal and the tool", self.solid), *chapters.items(),
                 ("All figures", self.tables or self.figures), ("Input", self.input_text.strip()))
        template = Environment(autoescape=True, keep_trailing_newline=True).from_string(asset("page.html"))
        write(path, template.render(page=self, style=asset("page.css"), titles=[title for title, part in parts if part], chapters=chapters,
                                    verdict=verdict(self.checks), library=solid.library() if self.solid else "", viewer=asset("viewer.js")))


def asset(name: str) -> str:
    return (files("stirpost") / "plots/assets" / name).read_text(encoding="utf-8")


def embedded(picture: Picture) -> str:
    """The picture as WebP in base 64: a quarter of the size of the PNG."""
    from PIL import Image

    file = io.BytesIO()
    with Image.open(picture.path) as image:
        image.convert("RGB").save(file, "WEBP", quality=88, method=0)
    return base64.b64encode(file.getvalue()).decode("ascii")
