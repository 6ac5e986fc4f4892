# SPDX-License-Identifier: MIT
"""Tables that a benchmark prints and keeps, with where and how they were made."""

import json
import pathlib
import shutil
import subprocess

ROOT = pathlib.Path(__file__).resolve().parent.parent


def machine():
    """Processor and number of cores."""
    text = pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    names = [line.split(":", 1)[1].strip() for line in text if line.startswith("model name")]
    return f"{len(names)} x {names[0]}" if names else "unknown"


def version():
    """Commit of the working tree; unknown without git."""
    words = ["git", "-C", str(ROOT), "describe", "--always", "--dirty=+", "--exclude=*"]
    return (subprocess.run(words, capture_output=True, text=True, check=False).stdout.strip() if shutil.which("git") else "") or "unknown"


def show(title, rows):
    """Print rows (the first is the head) as Markdown."""
    head, *body = [[str(cell) for cell in row] for row in rows]
    print(f"\n{title}:\n\n| " + " | ".join(head) + " |\n" + "|---" * len(head) + "|")
    for row in body:
        print("| " + " | ".join(row) + " |", flush=True)


def keep(path, command, tables):
    """Put tables (title: rows) into a file of kept results; others in it stay, and those whose rows are the same."""
    kept = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    for title, rows in tables.items():
        texts = [[str(cell) for cell in row] for row in rows]
        if kept.get(title, {}).get("rows") != texts:
            kept[title] = {"command": command, "machine": machine(), "version": version(), "rows": texts}
    text = json.dumps(kept, indent=1)
    path.write_text(text + "\n", encoding="utf-8")


def read(path):
    return json.loads(path.read_text(encoding="utf-8"))
