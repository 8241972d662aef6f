#!/usr/bin/env bash
# Makes .venv with the package and its tools, and sees to offscreen rendering (EGL). Quick when done
# before: a stamp in .venv holds what it was made from, and nothing then needs a network.
#
# Sourced by demo.sh and test.sh; leaves the working directory at the project's root and
# $venv naming the environment's folder.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
venv=".venv"

fail() {
    echo "setup: $*" >&2
    exit 2
}

# Python 3.11 or later: python3 itself, or one that carries its version in its name.
find_python() {
    local candidate
    for candidate in python3 python3.14 python3.13 python3.12 python3.11; do
        if "$candidate" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
            echo "$candidate"
            return
        fi
    done
    fail "Python 3.11 or later is needed (Debian 12 and 13: python3 and python3-venv)"
}

can_render() {
    MUJOCO_GL=egl "$venv/bin/python" -c '
import mujoco.egl
mujoco.egl.GLContext(16, 16).make_current()' >/dev/null 2>&1
}

make_environment() {
    local python
    python="$(find_python)"
    echo "setup: making $venv with $("$python" --version)"
    rm -rf "$venv"
    "$python" -m venv "$venv" || fail "cannot make $venv (Debian: python3-venv)"
    "$venv/bin/python" -m pip install -qq --disable-pip-version-check --editable '.[dev]' ||
        fail "the packages could not be installed; a network is needed the first time"
}

see_to_rendering() {
    local packages=(libegl1 libgl1-mesa-dri)
    can_render && return
    if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
        echo "setup: installing ${packages[*]} for offscreen rendering"
        apt-get update -qq >/dev/null || true
        DEBIAN_FRONTEND=noninteractive apt-get install -y -qq "${packages[@]}" >/dev/null || true
        can_render && return
    fi
    echo "setup: offscreen rendering does not work here; Debian's packages for it: ${packages[*]}" >&2
    return 1
}

stamp="$venv/.made-from"
made_from="$(sha256sum pyproject.toml | cut -d ' ' -f 1) $PWD"
if [ "$(cat "$stamp" 2>/dev/null)" != "$made_from" ]; then
    make_environment
    echo "$made_from" >"$stamp"
fi
if [ ! -e "$venv/.renders" ]; then
    # Without rendering the rest still works, so go on; the next run looks again.
    if see_to_rendering; then
        touch "$venv/.renders"
    fi
fi
