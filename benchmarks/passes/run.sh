#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# The passes of the thesis: bash benchmarks/passes/run.sh --help
set -e
here=$(cd "$(dirname "$0")" && pwd)
python=$here/../../build/venv/bin/python
[ -x "$python" ] || python=python3
exec "$python" "$here/passes.py" "$@"
