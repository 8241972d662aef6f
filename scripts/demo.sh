#!/usr/bin/env bash
# What the package is for: a named fault of a robot within a minute; a robot simulated with its tendon friction beside
# theory, and rendered; a real robot's measurements diagnosed, in ten to twenty minutes more. Leaves results/demo.
# The whole validation, some ten minutes, is a command of its own: catheter-sim validate -o results/validation
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"

out="results/demo"
set_up_s=$SECONDS
run() {
    echo
    echo "\$ catheter-sim $*"
    "$venv/bin/catheter-sim" "$@" 2>&1 | grep --line-buffered -v '^diagnose: '
}
since() { echo $((SECONDS - set_up_s)); }

rm -rf "$out"
mkdir -p "$out"
echo "set-up took $set_up_s s"

# A catheter's drive is worn; three files of a tracker are all there is.
run example worn_catheter -o "$out/worn_catheter"
run import "$out"/worn_catheter/take_{1,2,3}.csv --robot mitral_transseptal --spool-radius 10 -o "$out/worn_data"
run diagnose "$out/worn_data" -o "$out/worn_report"
run render "$out/worn_report/robot.toml" --inputs assets/examples/mitral_transseptal/bend_and_advance.csv \
    -o "$out/worn_catheter.png"
first_s=$(since)
echo
echo "first result after $first_s s: the fault and its gain above; the picture $out/worn_catheter.png,"
echo "the report $out/worn_report/report.html"

# A real robot of three segments and nine tendons, meanwhile.
run diagnose assets/examples/opencr_v4 -o "$out/opencr_report" --jobs 2 >"$out/opencr.txt" &
opencr=$!

# A neuroendoscope's tendons rub: simulation beside theory, row by row.
inputs="assets/examples/neuroendoscope_section/loops.csv"
run simulate neuroendoscope_section --inputs "$inputs" -o "$out/simulated.csv"
run statics neuroendoscope_section --model fkm_sliding --inputs "$inputs" -o "$out/statics.csv"
run compare "$out/simulated.csv" "$out/statics.csv" --columns tip_x_mm,tip_z_mm -o "$out/simulated_and_statics.png"
run render neuroendoscope_section --inputs "$inputs" -o "$out/loops.mp4" --width 480 --height 270
run build neuroendoscope_section -o "$out/model.xml"

echo
echo "a real robot's measurements are still being diagnosed ..."
wait "$opencr"
cat "$out/opencr.txt"

echo
echo "first result after $first_s s, everything after $(since) s (set-up before it: $set_up_s s). What was found:"
for report in worn_report opencr_report; do
    "$venv/bin/python" - "$out/$report/diagnosis.json" <<'PYTHON'
import json
import sys

found = json.load(open(sys.argv[1], encoding="utf-8"))
causes = ", ".join(" or ".join(cause.get("one_of", [cause["name"]])) for cause in found["causes"])
corrections = f"{len(found['corrections'])} corrections, none established" if found["corrections"] else ""
tip = found["tip_mm"]
print(
    f"  {found['robot']}: {found['verdict']}: {'; '.join(filter(None, [causes, corrections])) or 'no cause'}; "
    f"tip error on held-out data {tip['before']:.3g} mm before, {tip['after']:.3g} mm after"
)
PYTHON
    echo "    $out/$report/report.html"
done
echo "  simulation beside theory: $out/simulated_and_statics.png, $out/loops.mp4, $out/model.xml"
echo "Everything that is checked against theory and published values: catheter-sim validate -o results/validation"
