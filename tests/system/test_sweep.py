# SPDX-License-Identifier: MIT
"""stirpost sweep --slurm: a job array computes what the command computes without it."""

import shlex
import shutil
import subprocess
import sys

import driver
import pandas as pd
import pytest

STUDY = ["stir.nml", "--set", "TOOL.FRICTION=.1,.2,.3", "--set", "TIME.END=0.06"]
# Runs the tasks of an array one after the other, each as a job of its own; waits, as sbatch --wait does.
SBATCH = """#!/bin/bash
while [[ $1 == --* ]]; do [[ $1 != --array=* ]] || tasks=${1#*=}; shift; done
for SLURM_ARRAY_TASK_ID in ${tasks//,/ }; do
  export SLURM_ARRAY_TASK_ID SLURM_JOB_ID=$RANDOM
  bash "$@" >>stirpoint-stub.log 2>&1 || status=$?
done
exit ${status:-0}
"""
# A compute node that fails during the second case, after a checkpoint.
BROKEN = """#!/bin/bash
[[ $* == *TOOL.FRICTION=.2* ]] || exec {program} "$@"
{program} "$@" --set TIME.MAX_STEPS=100 && [[ $* == *--where* ]]
"""


def sweep(directory, *words):
    done = subprocess.run([sys.executable, "-m", "stirpost", "sweep", *STUDY, "--program", driver.EXECUTABLE, *words], cwd=directory,
                          env=driver.POSTPROC, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def submit(directory, printed, environment):
    """Do what the command has printed, and wait for it: exit status."""
    program, *words = shlex.split(printed.splitlines()[-1])
    assert program == f"STIRPOINT={driver.EXECUTABLE}" and words[0] == "sbatch"
    environment = {"STIRPOINT": driver.EXECUTABLE} | environment
    return subprocess.run(["sbatch", "--wait", *words[1:]], cwd=directory, env=environment, check=False, timeout=600).returncode


def responds():
    return bool(shutil.which("scontrol")) and "UP" in subprocess.run(["scontrol", "ping"], capture_output=True, text=True, check=False).stdout


@pytest.mark.parametrize("queue", ["stub", pytest.param("slurm", marks=pytest.mark.skipif(not responds(), reason="no slurmctld"))])
def test_a_job_array_is_resumed_gathered_and_drawn(tmp_path, queue):
    """Of three cases one breaks down: two are drawn, and the one that is left carries on from its checkpoint. The table is
    that of the study without Slurm, number by number. Cases of another key are added to the list."""
    shutil.copy(driver.INPUTS / "stir.nml", tmp_path)
    for name, text in (("sbatch", SBATCH), ("broken", BROKEN.format(program=driver.EXECUTABLE))):
        (tmp_path / name).write_text(text)
        (tmp_path / name).chmod(0o755)
    environment = driver.ENVIRONMENT | {"LAUNCHER": "env"}
    if queue == "stub":
        environment["PATH"] = f"{tmp_path}:{environment['PATH']}"
    printed = sweep(tmp_path, "--slurm", "-o", "array")
    assert "3 runs left" in printed and "--array=1,2,3" in printed and not (tmp_path / "array/sweep.csv").exists()
    assert submit(tmp_path, printed, environment | {"STIRPOINT": str(tmp_path / "broken")}) != 0
    printed = sweep(tmp_path, "--slurm", "-o", "array")
    assert "2 runs in array" in printed and "1 run left" in printed and "--array=2 " in printed
    assert submit(tmp_path, printed, environment) == 0
    log = "".join(path.read_text() for path in tmp_path.glob("stirpoint-*.log"))
    assert log.count("--restart") == 1 and "FRICTION=.2_END=0.06.out/stir_checkpoint.h5" in log
    assert " left" not in sweep(tmp_path, "--slurm", "-o", "array") and (tmp_path / "array/sweep.png").stat().st_size > 5000
    sweep(tmp_path, "-o", "plain")
    array, plain = (pd.read_csv(tmp_path / name / "sweep.csv") for name in ("array", "plain"))
    assert len(plain) == 3 and array.equals(plain)
    assert "--array=4,5,6 " in sweep(tmp_path, "--slurm", "-o", "array", "--set", "TIME.CFL=0.8")


@pytest.mark.parametrize("case, said", [(None, "submit the cases with sbatch --array"), ("4", "array/cases.txt has no case 4")])
def test_a_case_that_is_not_there(tmp_path, case, said):
    """A job that is no task of an array, and a task beyond the list, compute nothing and say why."""
    shutil.copy(driver.INPUTS / "stir.nml", tmp_path)
    sweep(tmp_path, "--slurm", "-o", "array")
    environment = {key: value for key, value in driver.ENVIRONMENT.items() if key != "SLURM_ARRAY_TASK_ID"}
    environment |= {"LAUNCHER": "env", "STIRPOINT": driver.EXECUTABLE} | ({"SLURM_ARRAY_TASK_ID": case} if case else {})
    done = subprocess.run(["bash", "array/array.sh", "--cases", "array/cases.txt"], cwd=tmp_path, env=environment, capture_output=True, text=True,
                          check=False, timeout=60)
    assert done.returncode != 0 and said in done.stderr and not list(tmp_path.rglob("*_history.csv"))
