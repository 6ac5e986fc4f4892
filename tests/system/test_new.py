# SPDX-License-Identifier: MIT
"""What makes an input quickly: scenes to begin with, keys of one group, man page, completion of bash."""

import hashlib
import json
import os
import pathlib
import random
import re
import shutil
import subprocess

import driver
import pytest

SCENES = ("pin", "shoulder", "butt", "lap", "bobbin", "stationary", "spot", "refill", "curve", "heat")
MAN = driver.ROOT / "share/man/man1/stirpoint.1"
COMPLETION = driver.ROOT / "share/bash-completion/completions/stirpoint"


@pytest.mark.parametrize("scene", SCENES)
def test_scene_runs_as_it_is(run, tmp_path, scene):
    """--new prints a commented input that passes --check without a warning. The short ones run to an early END, stay below
    melting and warn of nothing; the others take their first steps."""
    text = run(None, "--new", scene).out
    assert text.count("\n!") > 4
    (tmp_path / "my.nml").write_text(text, encoding="utf-8")
    for name in re.findall(r"FILE = '(.*?)'", text):
        (tmp_path / name).write_text(run(None, "--new", name).out, encoding="utf-8")
    checked = run("my.nml", "--check=scene")
    assert "warning" not in checked.out + checked.err
    ends = {"heat": 2.0, "shoulder": 0.6, "spot": 0.3}
    end = {"TIME.END": ends[scene]} if scene in ends else {"TIME.MAX_STEPS": 30}
    done = run("my.nml", sets=end)
    assert "results in my.out" in done.out
    assert "warning" not in done.out + done.err
    history = done.results("my").history()
    assert len(history["time[s]"]) > 1
    if "TIME.END" in end:
        solidus = float(re.search(r"T_MELT = (\d+)", checked.out).group(1))
        assert history["time[s]"][-1] == end["TIME.END"]
        assert 400 < history["temperature_max[K]"].max() < solidus


@pytest.mark.long
@pytest.mark.parametrize("scene", SCENES)
def test_drawn_settings_run(run, tmp_path, scene):
    """Other settings than those printed, drawn at random, pass the first 200 steps: spin, travel and tilt by half less to half more, cells
    of 0.8 to 1.25 times."""
    seed = int(os.environ.get("STIRPOINT_SEED", 1))
    draw = random.Random(f"{scene} {seed}").uniform
    factors = {key: draw(0.5, 1.5) for key in ("SPIN_RPM", "VELOCITY", "SPEED", "TILT_DEG")} | {"CELL": draw(0.8, 1.25)}
    print(seed, factors)

    def scaled(match):
        return match[1] + ", ".join(f"{factors[match[2]] * float(number):.6g}" for number in match[3].split(","))

    text = re.sub(r"(\b(SPIN_RPM|VELOCITY|SPEED|TILT_DEG|CELL) = )([-+.\de]+(?:, [-+.\de]+)?)", scaled, run(None, "--new", scene).out)
    (tmp_path / "my.nml").write_text(text, encoding="utf-8")
    for name in re.findall(r"FILE = '(.*?)'", text):
        (tmp_path / name).write_text(run(None, "--new", name).out, encoding="utf-8")
    done = run("my.nml", "--quiet", sets={"TIME.MAX_STEPS": 200})
    assert len(done.results("my").history()["time[s]"]) > 1


def test_lights_are_of_the_scenes_as_they_are(run):
    """Exact: a recorded light (benchmarks/new_scenes) is of the scene as --new prints it, and only those that say so are red."""
    tables = json.loads((driver.ROOT / "benchmarks/new_scenes.json").read_text(encoding="utf-8"))
    lights = {row[0]: row[-1] for row in tables["scenes"]["rows"][1:] if row[-1]}
    digests = dict(tables["digests"]["rows"])
    assert sorted(lights) == sorted(digests)
    for scene, digest in digests.items():
        text = run(None, "--new", scene).out
        assert hashlib.sha256(re.sub(r"(?m)!.*$|\s+", "", text).encode()).hexdigest()[:16] == digest, f"{scene}: run benchmarks/new_scenes --keep"
        level = lights[scene].split(":")[0]
        assert level == "green" or f"report is {level}" in text


def test_weld_on_a_backing_plate(run):
    """The shipped weld warns of nothing, heats tool and backing, and its plunge takes its first tenths of a millimetre;
    a run that ends in them says that the shoulder stays above the plate."""
    name = driver.ROOT / "input/fsw_aa6061_backing.nml"
    checked = run(name, "--check=scene")
    assert "warning" not in checked.out + checked.err
    done = run(name, sets={"TIME.END": 0.15, "OUTPUT.FRAME_INTERVAL": 0})
    assert (done.out + done.err).count("warning") == 1 and "the shoulder does not come down to the plate" in done.out
    history = done.results("fsw_aa6061_backing").history()
    assert history["tool_heat_gained[J]"][-1] > 0 and history["plate_zmin_backing_heat_gained[J]"][-1] >= 0
    assert history["tool_z[m]"][-1] == pytest.approx(13.1e-3 - 0.15e-3, abs=1e-6)
    assert abs(history["conduction_error[%]"][-1]) < 1e-6


def test_scenes_are_those_of_the_help(run):
    """Each file is known, and each known scene has a file."""
    files = sorted(path.stem for path in (driver.ROOT / "share/stirpoint/new").glob("*.nml"))
    assert files == sorted(SCENES)
    listed = re.search(r"--new SCENE .*?: (.*?)\n  --", run(None, "--help").out, re.DOTALL).group(1)
    assert " ".join(listed.split()) == "pin, shoulder, butt, lap, bobbin, stationary, spot, refill, curve, curve.csv or heat"
    wrong = run(None, "--new", "pim", expect=driver.BAD_INPUT)
    assert "there is no scene pim to begin with: --new pin, shoulder" in wrong.err
    assert "--new needs a value" in run(None, "--new", expect=driver.BAD_INPUT).err


def test_keys_of_one_group(run):
    """--keys=TOOL is the part of --keys about &TOOL; a misspelt group is named."""
    whole, part = run(None, "--keys").out, run(None, "--keys=tool").out
    assert part.startswith("&TOOL (") and part in whole
    assert [line for line in part.splitlines() if line.startswith("&")] == [part.splitlines()[0]]
    wrong = run(None, "--keys=TOLL", expect=driver.BAD_INPUT)
    assert wrong.err == "stirpoint: error: unknown group &TOLL; did you mean TOOL?\n"
    assert "--check=x is unknown; there is --check=scene" in run(None, "--check=x", expect=driver.BAD_INPUT).err


def test_man_page_and_completion_are_up_to_date(run):
    """Exact: the man page and the completion have the options of --help."""
    options = set(re.findall(r"^  (--\w+)", run(None, "--help").out, re.MULTILINE))
    man = MAN.read_text(encoding="utf-8").replace("\\-", "-")
    assert set(re.findall(r"^\\fB(--\w+)", man, re.MULTILINE)) == options
    words = re.search(r'compgen -W "(--[^"]+)"', COMPLETION.read_text(encoding="utf-8"))[1]
    assert set(words.split()) == options


@pytest.mark.skipif(shutil.which("groff") is None, reason="no groff")
def test_man_page_has_no_errors():
    done = subprocess.run(["groff", "-man", "-Tutf8", "-ww", MAN], capture_output=True, text=True)
    assert done.returncode == 0 and done.stderr == ""


@pytest.mark.parametrize(
    "words, wanted",
    [
        (["stirpoint", "--re"], {"--restart"}),
        (["stirpoint", "--new", "bu"], {"butt"}),
        (["stirpoint", "--keys", "=", "TO"], {"TOOL"}),
        (["stirpoint", "--keys", "="], {"markdown", "TOOL", "HEAT"}),
        (["stirpoint", "my.nml", "--set", "TO"], {"TOOL."}),
        (["stirpoint", "my.nml", "--set", "TOOL(2).FRICTION_L"], {"TOOL(2).FRICTION_LAW="}),
        (["stirpoint", "my.nml", "--set", "tool.friction_l"], {"TOOL.FRICTION_LAW="}),
        (["stirpoint", "m"], {"my.nml"}),
        (["stirpoint", "--restart", "my_"], {"my_checkpoint.h5"}),
    ],
)
def test_completion(tmp_path, words, wanted):
    """What bash offers for the last word."""
    for name in ("my.nml", "my_checkpoint.h5", "my.txt"):
        (tmp_path / name).touch()
    quoted = " ".join(f"'{word}'" for word in words)
    script = f"source {COMPLETION}; COMP_WORDS=({quoted}); COMP_CWORD={len(words) - 1}; _stirpoint; printf '%s\\n' \"${{COMPREPLY[@]}}\""
    environment = driver.ENVIRONMENT | {"PATH": f"{pathlib.Path(driver.EXECUTABLE).parent}:{os.environ['PATH']}"}
    done = subprocess.run(["bash", "-c", script], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
    offered = set(done.stdout.split())
    assert wanted <= offered
    assert len(wanted) > 1 or offered == wanted, offered
