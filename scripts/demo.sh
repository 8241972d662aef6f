#!/usr/bin/env bash
# The main job from end to end: a robot simulated with its tendon friction, checked against theory,
# rendered without a screen; and a real robot's measurements diagnosed. Leaves results/demo.
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"

out="results/demo"
inputs="assets/examples/neuroendoscope_section/loops.csv"
dataset="assets/examples/opencr_v4"
run() {
    echo "\$ catheter-sim $*"
    "$venv/bin/catheter-sim" "$@"
}

rm -rf "$out"
mkdir -p "$out"
run build neuroendoscope_section -o "$out/model.xml"
run simulate neuroendoscope_section --inputs "$inputs" -o "$out/simulated.csv"
run statics neuroendoscope_section --model fkm_exact_arm --inputs "$inputs" -o "$out/statics.csv"
run render neuroendoscope_section --inputs "$inputs" -o "$out/loops.mp4"
failed=0
run validate -o "$out/validation" || failed=1 # told at the end: the rest is worth seeing all the same
run diagnose "$dataset" -o "$out/diagnosis" --jobs 2

echo
echo "results:"
find "$out" -type f \( -name '*.mp4' -o -name '*.html' -o -name '*.json' -o -name '*.xml' -o -name '*.toml' \
    -o -name '*.txt' -o -name 'simulated.csv' -o -name 'statics.csv' \) | sort | sed 's/^/  /'

if [ "$failed" = 1 ]; then
    echo "demo: the validation failed, see the table above" >&2
    exit 1
fi
