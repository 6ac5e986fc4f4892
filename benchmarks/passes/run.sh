#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# The passes of the thesis; --help tells more.
#
#     benchmarks/passes/run.sh [NAME[:KIND]...] [--particles MM] [--ranks N] [--draw]
#     benchmarks/passes/run.sh --valley | --tables
set -e
here=$(cd "$(dirname "$0")" && pwd)
python=$here/../../build/venv/bin/python
[ -x "$python" ] || python=python3
exec "$python" "$here/passes.py" "$@"
