# SPDX-License-Identifier: MIT
"""One pass in a folder of its own: started, resumed from its checkpoint, or kept if it is complete."""

import hashlib
import json
import pathlib
import resource
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(HERE), str(HERE.parent), str(ROOT / "tests/system")]
import driver  # noqa: E402
import kept  # noqa: E402
import scenes  # noqa: E402


def keys_of(name, kind, particles, mass):
    """All keys that differ from the input of the pass: of the variant, and those of the numbers."""
    return scenes.cells(name, particles) | {"TIME.MASS_SCALING": f"{mass:g}", "TIME.MASS_SCALING_RANGE": "0,0"} | scenes.variant(name, kind)


def digest(recipe):
    return hashlib.sha256(recipe.encode()).hexdigest()[:12]


def is_whole(folder, recipe):
    """Whether a run of this recipe came to its end; one that was stopped has a summary, too."""
    machines = folder / "machine.jsonl"
    return machines.is_file() and digest(recipe) in machines.read_text(encoding="utf-8")


def calculate(folder, name, kind, keys, ranks=1, tell=print):
    """The results of a pass, computed if they are not there: what is there counts only if its input is the same."""
    text = scenes.text_of(name, kind)
    recipe = json.dumps({"keys": keys, "input": text}, indent=1)
    made, results = folder / "recipe.json", driver.Results(folder / f"{name}.out", name)
    same = made.is_file() and made.read_text(encoding="utf-8") == recipe
    if same and is_whole(folder, recipe):
        tell(f"{folder}: is there")
        return results
    folder.mkdir(parents=True, exist_ok=True)
    checkpoint = results.path("_checkpoint.h5")
    words = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    if same and checkpoint.is_file():
        words += [driver.EXECUTABLE, "--restart", str(checkpoint)]
    else:
        (folder / f"{name}.nml").write_text(text, encoding="utf-8")
        made.write_text(recipe, encoding="utf-8")
        words += [driver.EXECUTABLE, str(folder / f"{name}.nml"), "--overwrite"]
        for key, value in keys.items():
            words += ["--set", f"{key}={value}"]
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    done = subprocess.run([*words, "--quiet", "--output", str(results.directory)], env=driver.ENVIRONMENT, capture_output=True,
                          text=True, check=False)
    seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    if done.returncode != 0:
        raise RuntimeError(f"{folder}: {done.stderr.strip() or 'stirpoint failed'}")
    with (folder / "machine.jsonl").open("a", encoding="utf-8") as file:
        file.write(json.dumps({"recipe": digest(recipe), "machine": kept.machine(), "version": kept.version(), "ranks": ranks, "cpu_seconds": round(seconds, 1),
                               "restarted": "--restart" in words}) + "\n")
    tell(f"{folder}: computed in {seconds:.0f} s of processor time")
    return results
