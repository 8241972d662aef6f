#!/usr/bin/env bash
# Every check: style, types, then the tests, the fast ones first. FAST=1 leaves the slow ones out. Those that
# take longest run apart: scripts/long_tests.py.
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"

bin="$venv/bin"
unset PYTHONDONTWRITEBYTECODE # the same files are read by two runs of two processes
"$bin/python" scripts/compile_kernels.py & # kept on disk, so that the tests' processes need not
compiling=$!
"$bin/ruff" check .
"$bin/ruff" format --check .
"$bin/mypy"
wait "$compiling"
"$bin/pytest" -q -n 2 --dist loadgroup -m "not slow and not long"
if [ -z "${FAST:-}" ]; then
    "$bin/pytest" -q -n 2 --dist loadgroup -m "slow and not long"
fi
