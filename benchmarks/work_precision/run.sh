#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Measures everything anew and renews results.md and its pictures; arguments go to work_precision.py.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
python=$root/build/venv/bin/python
[[ -x $python ]] || python=python3
exec "$python" "$root/benchmarks/work_precision/work_precision.py" --all "$@"
