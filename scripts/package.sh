#!/usr/bin/env bash
# Builds the sdist, from it the wheel, and tries both outside the checkout: each in an environment that was empty
# before, with the libraries from the package index. Leaves results/package.
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"

out="$PWD/results/package"
rm -rf "$out"
mkdir -p "$out"
"$venv/bin/python" -m build --outdir "$out" . >"$out/build.log" || fail "could not be built, see $out/build.log"
python="$PWD/$venv/bin/python"
elsewhere="$(mktemp -d)"
trap 'rm -rf "$elsewhere"' EXIT
cd "$elsewhere"
unset PYTHONPATH

for package in "$out"/*.whl "$out"/*.tar.gz; do
    echo "trying $(basename "$package") in an empty environment"
    rm -rf environment work
    mkdir work
    "$python" -m venv environment
    environment/bin/pip install -qq --disable-pip-version-check "$package" || fail "$package cannot be installed"
    (
        cd work
        run() { ../environment/bin/catheter-sim "$@" >>log.txt 2>&1 || { cat log.txt >&2; exit 1; }; }
        run --version
        run example worn_catheter
        run import worn_catheter/take_{1,2,3}.csv --robot mitral_transseptal --spool-radius 10 -o data
        run diagnose data -o report
        grep -q '"verdict": "cause_found"' report/diagnosis.json
        run example neuroendoscope_section
        run simulate neuroendoscope_section --inputs neuroendoscope_section/loops.csv -o simulated.csv
        run build neuroendoscope_section -o model.xml
        ../environment/bin/python -c '
import pathlib
import catheter_sim
assert "environment" in catheter_sim.__file__
assert pathlib.Path(catheter_sim.__file__).with_name("py.typed").is_file()'
    ) || fail "$(basename "$package") does not work outside the checkout"
done
echo "both work: $(cd "$out" && ls ./*.whl ./*.tar.gz | tr '\n' ' ')"
