#!/usr/bin/env bash
# Tries the package on another Python, in an environment that is made for it and taken away again:
#     bash scripts/other_python.sh python3.13
# The wheel is built and installed with the libraries from the package index; then simulate, diagnose and render
# run outside the checkout, and the fast tests in it (JOBS processes, 2 unless set). The last line says what passed;
# the exit status is 1 where something did not.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

fail() {
    echo "other_python: $*" >&2
    exit 2
}

[ $# = 1 ] || fail "one argument is needed: a Python, such as python3.13"
version="$("$1" -c 'import platform; print(platform.python_version())')" || fail "$1 is no Python"
"$1" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || fail "Python 3.11 or later is needed, this is $version"
unset PYTHONPATH

out="$(mktemp -d)"
trap 'rm -rf "$out"' EXIT
echo "making an environment of Python $version"
"$1" -m venv "$out/environment" || fail "cannot make an environment (Debian: python3-venv)"
bin="$out/environment/bin"
[ -d "$bin" ] || bin="$out/environment/Scripts" # Windows
pip() { "$bin/python" -m pip --disable-pip-version-check -q "$@"; }
pip wheel --no-deps --wheel-dir "$out" . || fail "the wheel could not be built"
wheel="$(ls "$out"/*.whl)"
pip install "$wheel" || fail "the wheel could not be installed; a network is needed"
size="$(du -sm "$out/environment" | cut -f 1)"
echo "the environment takes $size MB"
pip install "$wheel[dev]" || fail "what the tests need could not be installed"

passed=() failed=()
try() { # NAME COMMAND...: in the folder of trials
    local name="$1"
    shift
    if (cd "$out/work" && "$@") >"$out/log.txt" 2>&1; then
        passed+=("$name")
    else
        failed+=("$name")
        tail -n 30 "$out/log.txt" >&2
    fi
}
diagnosed() {
    catheter-sim example worn_catheter &&
        catheter-sim import worn_catheter/take_{1,2,3}.csv --robot mitral_transseptal --spool-radius 10 -o data &&
        catheter-sim diagnose data -o report &&
        grep '"verdict": "cause_found"' report/diagnosis.json
}
mkdir "$out/work"
PATH="$bin:$PATH"
inputs=neuroendoscope_section/loops.csv
try example catheter-sim example neuroendoscope_section
try simulate catheter-sim simulate neuroendoscope_section --inputs "$inputs" -o simulated.csv
try "render to png" catheter-sim render neuroendoscope_section --inputs "$inputs" -o bent.png --row 9
try "render to mp4" catheter-sim render neuroendoscope_section --inputs "$inputs" -o bent.mp4 --width 320 --height 240
try diagnose diagnosed

tests=("$bin/python" -m pytest -q -p no:cacheprovider -n "${JOBS:-2}" --dist loadgroup -m "not slow and not long")
if "${tests[@]}" | tee "$out/tests.txt"; then
    passed+=("the fast tests ($(tail -n 1 "$out/tests.txt"))")
else
    failed+=("the fast tests ($(tail -n 1 "$out/tests.txt"))")
fi

joined() { printf ', %s' "$@" | cut -c 3-; }
said="Python $version, $size MB:"
[ ${#passed[@]} = 0 ] || said+=" passed: $(joined "${passed[@]}");"
[ ${#failed[@]} = 0 ] || said+=" failed: $(joined "${failed[@]}");"
echo "${said%;}"
[ ${#failed[@]} = 0 ]
