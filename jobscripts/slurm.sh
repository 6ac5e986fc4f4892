#!/bin/bash
# SPDX-License-Identifier: MIT
# Stirpoint under Slurm. Adapt the settings below, then
#
#     sbatch jobscripts/slurm.sh [INPUT [OPTION...]]
#     sbatch --array=1-12 jobscripts/slurm.sh --cases FILE
#
# In an array, task N has line N of FILE: the words behind `stirpoint`, separated by tabs, as
# `stirpost sweep --slurm` writes them.
# The run directory is made in the directory of the call; paths are taken from there too. Two
# minutes before the time is over Slurm signals this script; stirpoint then writes a checkpoint and
# stops, the job goes back into the queue and carries on from there until the run is finished. A job
# that was killed carries on from its last checkpoint, or starts anew if it had none yet: results of
# other runs in the directory are never taken for its own (docs/restart.md). A case of a study carries
# on in a new job too.

#SBATCH --job-name=stirpoint
#SBATCH --ntasks=32
#SBATCH --time=12:00:00
#SBATCH --signal=B:USR1@120
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --output=stirpoint-%j.log

arguments=("${@:-input/quickstart.nml}")
stirpoint=${STIRPOINT:-build/release/stirpoint}
most_restarts=50
launcher=${LAUNCHER:-mpirun}          # mpirun or srun
# module load gcc openmpi hdf5        # what the program was built with

# ------------------------------------------------------------------------------------------------
stopped_with_checkpoint=75 # stirpoint's exit status after a signal
restarts=${SLURM_RESTART_COUNT:-0}

cd "${SLURM_SUBMIT_DIR:-.}" || exit 1
asked= # what a case of a study was made from, until it is done
if [[ $1 == --cases ]]; then
  case=${SLURM_ARRAY_TASK_ID:?is not set: submit the cases with sbatch --array}
  IFS=$'\t' read -ra arguments < <(sed -n "${case}p" "$2")
  ((${#arguments[@]} > 0)) || { echo "$2 has no case $case" >&2; exit 2; }
fi
results=$("$stirpoint" "${arguments[@]}" --where | tail -n 1) # as &RUN NAME says
[[ -n $results ]] || exit 2                                    # the input is wrong, and it said so
checkpoint=${results}_checkpoint.h5
[[ $1 != --cases ]] || asked=${results%/*}/sweep_asked.txt
if [[ -n $asked ]] || { ((restarts > 0)) && grep -qsx "job $SLURM_JOB_ID" "${results}_run.txt"; }; then
  for file in "$checkpoint" "${checkpoint%.h5}_previous.h5"; do
    if [[ -f $file ]]; then
      arguments+=(--restart "$file")
      break
    fi
  done
fi
echo "$(date '+%F %T') job $SLURM_JOB_ID, start $((restarts + 1)), on $SLURM_JOB_NODELIST"
echo "stirpoint ${arguments[*]}"

signalled=no
if [[ $launcher == srun* ]]; then # scancel hands the signal to all ranks of the step
  trap 'signalled=yes; scancel --signal=USR1 "$SLURM_JOB_ID.0" 2>/dev/null' USR1
else
  trap 'signalled=yes; kill -USR1 "$mpirun" 2>/dev/null' USR1
fi
$launcher "$stirpoint" "${arguments[@]}" & # the number of ranks comes from Slurm
mpirun=$!

# A trapped signal ends `wait` early, with a status above 128: wait until mpirun itself has ended.
while true; do
  wait "$mpirun"
  status=$?
  kill -0 "$mpirun" 2>/dev/null || break
done
if ((status > 128)); then # it may have ended while the trap ran: ask once more for its own status
  wait "$mpirun"
  again=$?
  ((again == 127)) || status=$again
fi
echo "$(date '+%F %T') stirpoint ended with exit status $status (signalled: $signalled)"

if ((status == stopped_with_checkpoint)) && [[ -f $checkpoint ]]; then
  if ((restarts < most_restarts)); then
    echo "$(date '+%F %T') back into the queue, to carry on from $checkpoint"
    scontrol requeue "$SLURM_JOB_ID" && exit 0
    echo "the job could not be requeued" >&2
  else
    echo "not requeued: $most_restarts restarts are the most allowed" >&2
  fi
fi
((status != 0)) || [[ -z $asked ]] || mv "$asked" "${asked%/*}/sweep_input.txt" # done
exit "$status"
