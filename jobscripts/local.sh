#!/bin/bash
# SPDX-License-Identifier: MIT
# Builds, runs and tests Stirpoint on one machine (Debian 12), from nothing but bash and apt.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=$root/build/release
venv=$root/build/venv
logs=$root/build/log
packages=(ca-certificates cmake make gcc gfortran pkg-config libopenmpi-dev openmpi-bin
          libhdf5-openmpi-dev libfftw3-dev libpetsc-real-dev)
python_packages=(python3 python3-venv)
python=

usage() {
  cat <<USAGE
Usage: bash jobscripts/local.sh COMMAND

  run [INPUT] [ARGUMENT...]  build, run INPUT (default input/quickstart.nml) on all physical
                             cores and draw the result; the run directory NAME.out is made in
                             the current directory (NAME: &RUN NAME, or the stem of INPUT);
                             further arguments go to stirpoint
  test [TIER]                build, then run tests: smoke (default; up to 5 minutes on two
                             cores), all (what a change must pass), long (draws, robustness,
                             stress and what takes long), every (all and long)
  build                      install what is missing and build
  python                     install what is missing and make build/venv, with the command
                             build/venv/bin/stirpost and what the tests need
  help                       show this

RANKS=n in the environment sets the number of MPI ranks. Missing Debian packages are installed with
apt-get (as root or with sudo); Python packages go to build/venv. Logs: build/log.
USAGE
}

stage() { printf '==> %s\n' "$*"; }

fail() {
  printf 'local.sh: %s\n' "$*" >&2
  exit 1
}

# logged NAME COMMAND...: output to build/log/NAME.log, of which the last line is shown now and then; on
# failure shows its tail and ends.
logged() {
  local log=$logs/$1.log status=0 watch
  shift
  mkdir -p "$logs"
  : >"$log"
  watch_log "$log" &
  watch=$!
  "$@" >"$log" 2>&1 </dev/null || status=$?
  kill "$watch" 2>/dev/null || true
  wait "$watch" 2>/dev/null || true
  ((status == 0)) && return
  printf -- '---- last lines of %s\n' "$log" >&2
  tail -n 40 "$log" >&2
  printf -- '----\n' >&2
  fail "failed with exit status $status: $*"
}

watch_log() {
  local begun=$SECONDS
  while sleep 10 >/dev/null 2>&1 </dev/null; do
    printf '    %d s: %s\n' "$((SECONDS - begun))" "$(tail -n 1 "$1" | tr -dc '[:print:]' | cut -c 1-90)"
  done
}

# --- packages -----------------------------------------------------------------------------------

installed() {
  [[ $(dpkg-query -W -f='${db:Status-Status}' "$1" 2>/dev/null) == installed ]]
}

# Sets `python` to one of Python >= 3.10 that can make a virtual environment.
find_python() {
  local candidate
  for candidate in /usr/bin/python3 "$(command -v python3 || true)"; do
    if [[ -n $candidate ]] && "$candidate" -c \
      'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 10))' 2>/dev/null; then
      python=$candidate
      return 0
    fi
  done
  return 1
}

install_packages() {
  local package missing=()
  if ! command -v dpkg-query >/dev/null; then
    stage "Not a Debian system: the compiler, MPI and HDF5 must be there already"
    find_python || fail "no python3 >= 3.10 with venv and ensurepip"
    return
  fi
  for package in "${packages[@]}"; do
    installed "$package" || missing+=("$package")
  done
  if ! find_python; then
    for package in "${python_packages[@]}"; do
      installed "$package" || missing+=("$package")
    done
  fi
  if ((${#missing[@]} > 0)); then
    apt_install "${missing[@]}"
  fi
  find_python || fail "no python3 >= 3.10 with venv and ensurepip (Debian: ${python_packages[*]})"
}

# sudo may ask for the password where there is somebody to answer.
may_sudo() {
  command -v sudo >/dev/null || return
  sudo -n true 2>/dev/null || { [[ -t 0 ]] && sudo -v; }
}

apt_install() {
  local as_root=() apt=(apt-get -o DPkg::Lock::Timeout=300)
  if ((EUID != 0)); then
    may_sudo || fail "these Debian packages are missing (and neither root nor sudo is there): $*"
    as_root=(sudo)
  fi
  as_root+=(env DEBIAN_FRONTEND=noninteractive)
  stage "Installing Debian packages: $*"
  # an outdated list may do: the install decides
  (logged apt-update "${as_root[@]}" "${apt[@]}" update) ||
    stage "Going on with the old package lists"
  logged apt-install "${as_root[@]}" "${apt[@]}" install -y --no-install-recommends "$@"
}

# --- Python -------------------------------------------------------------------------------------

# What a run and its report need; `make_venv tests` also what the tests and documents need.
make_venv() {
  export MPLCONFIGDIR=$root/build/matplotlib # its font cache: the home directory may be read-only
  local all=$root/build/requirements wanted=$root/postproc/pyproject.toml stamp=$venv/requirements.installed
  local more=()
  mkdir -p "$root/build"
  cat "$root/postproc/requirements.txt" "$root/postproc/pyproject.toml" >"$all"
  if [[ ${1:-} == tests ]]; then
    wanted=$all
    more=(-r "$root/postproc/requirements.txt")
  fi
  if { cmp -s "$wanted" "$stamp" || cmp -s "$all" "$stamp"; } && "$venv/bin/python" -c 'import stirpost' 2>/dev/null; then
    return
  fi
  stage "Setting up Python in build/venv (from PyPI${more:+, with what the tests need})"
  if ! "$venv/bin/python" -m pip --version >/dev/null 2>&1; then
    logged venv "$python" -m venv --clear "$venv"
  fi
  # Modules are compiled when they are used: a quarter of the size is those that are not
  logged pip "$venv/bin/python" -m pip install --disable-pip-version-check --prefer-binary --no-compile \
    "${more[@]}" -e "$root/postproc${more:+[all]}"
  if ((${#more[@]} == 0)); then # a sixth of the size is what only those who build or test these packages need
    logged pip-uninstall "$venv/bin/python" -m pip uninstall --disable-pip-version-check -y setuptools
    find "$venv" \( -type d -name tests -o -type f \( -name '*.c' -o -name '*.pyi' -o -name '*.pyx' \) \) -prune -exec rm -rf {} +
  fi
  cp "$wanted" "$stamp"
}

# --- build --------------------------------------------------------------------------------------

build_program() {
  local home
  home=$(sed -n 's/^CMAKE_HOME_DIRECTORY:INTERNAL=//p' "$build/CMakeCache.txt" 2>/dev/null || true)
  if [[ -n $home && $home != "$root" ]]; then # the source was moved: the old cache is of no use
    rm -rf "$build"
  fi
  cd "$root" # presets are read from the current directory
  stage "Configuring build/release"
  logged configure cmake --preset release
  stage "Building with $(nproc) jobs"
  logged build cmake --build --preset release --parallel "$(nproc)"
  cd "$start"
}

prepare() {
  install_packages
  make_venv "$@"
  build_program
}

# --- run and test -------------------------------------------------------------------------------

# Physical cores this process may use: hardware threads and shares of a container do not count.
physical_cores() {
  local cores threads quota period
  threads=$(nproc)
  cores=$(lscpu -p=CORE,SOCKET 2>/dev/null | grep -v '^#' | sort -u | wc -l) || cores=0
  ((cores >= 1 && cores < threads)) || cores=$threads
  if read -r quota period 2>/dev/null </sys/fs/cgroup/cpu.max && [[ $quota != max ]]; then
    quota=$((quota / period))
    ((quota >= cores)) || cores=$((quota > 1 ? quota : 1))
  fi
  echo "$cores"
}

mpi_environment() {
  if ((EUID == 0)); then
    export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
  fi
  if [[ -e /.dockerenv ]]; then # Open MPI tries a copy that containers forbid
    export OMPI_MCA_btl_vader_single_copy_mechanism=none
  fi
}

run_program() {
  local input=$root/input/quickstart.nml results ranks cores status=0
  if (($# > 0)) && [[ $1 != -* ]]; then
    input=$1
    shift
  fi
  [[ -f $input ]] || fail "no input file $input"
  prepare
  mpi_environment
  results=$("$build/stirpoint" "$input" "$@" --where | tail -n 1) || exit 2
  cores=$(physical_cores)
  ranks=${RANKS:-$cores}
  [[ $ranks =~ ^[1-9][0-9]*$ ]] || fail "RANKS=$ranks is not a number of ranks"
  if ((ranks > cores)); then # ranks that share a core must give way
    export OMPI_MCA_rmaps_base_oversubscribe=1 OMPI_MCA_mpi_yield_when_idle=1 \
      OMPI_MCA_hwloc_base_binding_policy=none
  fi
  stage "Running $input on $ranks MPI ranks"
  mpirun -n "$ranks" "$build/stirpoint" "$input" "$@" || status=$?
  if ((status != 0)); then
    stage "stirpoint ended with exit status $status"
  fi
  results=$(dirname "$results")
  if compgen -G "$results/*_*.hdf" >/dev/null; then
    stage "Drawing $results"
    draw "$results" || { ((status != 0)) || status=1; }
  fi
  exit "$status"
}

draw() {
  "$venv/bin/python" -m stirpost report "$1" || return
  stage "Pictures and report.html are in $1/report"
}

run_tests() {
  local tier=${1:-smoke}
  [[ $tier =~ ^(smoke|all|long|every)$ ]] || fail "there are the tests smoke, all, long, every; not $tier"
  prepare tests
  mpi_environment
  export PATH="$venv/bin:$PATH"
  stage "Tests of the program"
  ctest --test-dir "$build" --parallel "$(nproc)" --output-on-failure --no-tests=error ||
    fail "TESTS FAILED: of the program (see above)"
  if [[ $tier == long ]]; then # other draws with every commit
    STIRPOINT_SEED=${STIRPOINT_SEED:-$(git -C "$root" rev-list --count HEAD 2>/dev/null || echo 0)}
    export STIRPOINT_SEED
    stage "Draws from STIRPOINT_SEED=$STIRPOINT_SEED on"
  fi
  # in one, as tests of whole runs wait for programs to start, while those of the post-processing compute
  stage "Tests of whole runs and the post-processing: $tier"
  STIRPOINT_EXECUTABLE=$build/stirpoint "$venv/bin/python" -m pytest -q -p no:cacheprovider \
    -n "$((2 * $(nproc)))" --dist worksteal --tier "$tier" "$root/tests" "$root/benchmarks" "$root/postproc/tests" ||
    fail "TESTS FAILED: of whole runs and the post-processing (see above)"
  stage "ALL TESTS PASSED: $tier"
}

start=$PWD
command=${1:-help}
(($# == 0)) || shift
case $command in
  run) run_program "$@" ;;
  test) run_tests "$@" ;;
  build)
    prepare
    stage "Built $build/stirpoint"
    ;;
  python)
    install_packages
    make_venv tests
    ;;
  help | -h | --help) usage ;;
  *)
    usage >&2
    fail "unknown command: $command"
    ;;
esac
