// A report that moves: tables that sort, what is shown as CSV to save, and the robot in space, in the order of
// this file. It asks for nothing from anywhere: its data stand in the page, as JSON in the element "in-space".
"use strict";
(() => {
const root = document.documentElement;
root.classList.add("moves");

// ---------------------------------------------------------------------------------------------------------
// Saving: rows of cells as a CSV, made in the page.

function csvField(value) {
  if (typeof value === "number") return Number.isFinite(value) ? String(value) : "";
  const text = String(value ?? "").replace(/^[=+@\t]/, "'$&"); // no cell is a spreadsheet's formula
  return /[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
}

function save(name, rows) {
  const text = rows.map((row) => row.map(csvField).join(",")).join("\n") + "\n";
  const address = URL.createObjectURL(new Blob([text], { type: "text/csv;charset=utf-8" }));
  const link = document.createElement("a");
  link.setAttribute("href", address);
  link.download = name;
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(address), 10000);
}

function button(words, act) {
  const made = document.createElement("button");
  made.type = "button";
  made.textContent = words;
  made.addEventListener("click", act);
  return made;
}

// ---------------------------------------------------------------------------------------------------------
// Tables: each can be saved; those of class "sorts" are sorted by the buttons in their heads.

// What a cell says, without the mark of the row that is reported; its lines one after another.
const cellWords = (cell) => [...cell.childNodes].filter((part) => !part.matches?.(".mark"))
  .map((part) => (part.nodeName === "BR" ? "; " : part.textContent)).join("").trim().replace(/\s+/g, " ");
const cellNumber = (cell) => {
  const text = cellWords(cell).replaceAll("\u2212", "-");
  return /^-?[\d.]/.test(text) ? parseFloat(text) : NaN;
};
const plain = (text) => (/^\u2212[\d.]+$/.test(text) ? text.replace("\u2212", "-") : text);

function savable(table) {
  const line = document.createElement("p");
  line.className = "save";
  line.append(button("Save CSV", () => {
    const kept = [...table.rows].map((row) => [...row.cells].filter((cell) => !cell.matches(".bar, .chance")));
    save(`${table.dataset.csv}.csv`, kept.map((cells) => cells.map((cell) => plain(cellWords(cell)))));
  }));
  line.firstChild.setAttribute("aria-label", `Save CSV: ${table.dataset.csv.replaceAll("_", " ")}`);
  table.parentElement.after(line);
}

function sortable(table) {
  const [head, ...rows] = table.rows;
  const sorted = (column, sign) => [...rows].sort((one, two) => {
    const cells = [one.cells[column], two.cells[column]], [a, b] = cells.map(cellNumber);
    if (Number.isNaN(a) && Number.isNaN(b)) return sign * cellWords(cells[0]).localeCompare(cellWords(cells[1]));
    return Number.isNaN(a) ? 1 : Number.isNaN(b) ? -1 : sign * (a - b); // what is no number comes last
  });
  [...head.cells].forEach((cell, column) => {
    if (cell.classList.contains("bar")) return;
    const words = cellWords(cell), face = button(words, () => {
      const rising = cell.getAttribute("aria-sort") !== "ascending";
      for (const other of head.cells) other.removeAttribute("aria-sort");
      cell.setAttribute("aria-sort", rising ? "ascending" : "descending");
      head.after(...sorted(column, rising ? 1 : -1));
    });
    face.className = "sort";
    face.title = `Sort by ${words}`;
    cell.replaceChildren(face);
  });
}

for (const table of document.querySelectorAll("table[data-csv]")) {
  if (table.classList.contains("sorts")) sortable(table);
  savable(table);
}

// ---------------------------------------------------------------------------------------------------------
// The robot in space: what a trial's rows hold, in millimetres.

const AXES = ["x", "y", "z"], STAGES = ["before", "after"], SHOWN = ["measured", ...STAGES];
const holder = document.getElementById("in-space");
if (!holder) return;
const data = JSON.parse(holder.textContent);

// Numbers from their code: of each the difference to the one before, in whole parts of which `per` are one, twice as
// large with the sign as the last bit; digits of five bits, the lowest first, a sixth bit where more follow. "!" is NaN.
const DIGITS = new Map([..."ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"].map((one, k) => [one, k]));
function numbersOf(code, per) {
  const found = [];
  let last = 0, sum = 0, weight = 1;
  for (const letter of code) {
    if (letter === "!") {
      found.push(NaN);
      continue;
    }
    const digit = DIGITS.get(letter);
    sum += (digit & 31) * weight;
    weight *= 32;
    if (digit & 32) continue;
    last += sum % 2 ? -(sum - 1) / 2 : sum / 2;
    found.push(last / per);
    [sum, weight] = [0, 1];
  }
  return found;
}

// Where a point is in a row: null where nothing was measured. An axis that the file lacks is the computed one.
function placeOf(point, stage, row) {
  const found = AXES.map((axis) => point[stage][axis]?.[row]);
  if (found.some(Number.isNaN)) return null;
  return found.map((value, k) => value ?? (point.after[AXES[k]]?.[row] || 0));
}

// The robot's line in a row, base to tip: of each place the step from the one before is known.
function lineOf(trial, stage, row) {
  const steps = trial.line[stage], rows = trial.rows.length, found = [];
  if (Number.isNaN(steps[row])) return null;
  for (let k = 0, at = [0, 0, 0]; k < steps.length; k += 3 * rows) {
    at = at.map((value, axis) => value + steps[k + axis * rows + row]);
    found.push(at);
  }
  return found;
}

function opened(coded) {
  const courses = (axes) => Object.fromEntries(Object.entries(axes).map(([axis, code]) => [axis, numbersOf(code, 100)]));
  const trial = { ...coded, rows: numbersOf(coded.rows, 1), time_s: numbersOf(coded.time_s, 1e4) };
  trial.error = Object.fromEntries(Object.entries(coded.error).map(([name, code]) => [name, numbersOf(code, 1e4)]));
  trial.points = coded.points.map((point) => (
    { name: point.name, ...Object.fromEntries(SHOWN.map((stage) => [stage, courses(point[stage])])) }));
  trial.line = coded.line && { radii: coded.line.radius_mm, ...courses({ before: coded.line.before, after: coded.line.after }) };
  trial.places = Object.fromEntries(SHOWN.map((stage) => [
    stage, trial.points.map((point) => trial.rows.map((_, row) => placeOf(point, stage, row)))]));
  const lines = trial.line ? STAGES.flatMap((stage) => trial.rows.flatMap((_, row) => lineOf(trial, stage, row))) : [];
  const ends = endsOf([...Object.values(trial.places).flat(2), ...lines].filter(Boolean));
  trial.size = Math.hypot(...ends.map(([low, high]) => high - low)) || 1;
  trial.centre = ends.map(([low, high]) => (low + high) / 2);
  const tips = trial.places.measured.at(-1);
  return Object.assign(trial, { joined: joined(trial, tips), yaw: broadside(tips.filter(Boolean)) });
}

const endsOf = (places) => AXES.map((_, k) => places.reduce(
  ([low, high], at) => [Math.min(low, at[k]), Math.max(high, at[k])], [Infinity, -Infinity]));

// Whether a line may join a row to the one before: not over a pause, nor between postures in random order.
function joined(trial, tips) {
  const steps = trial.time_s.map((time, row) => (row ? time - trial.time_s[row - 1] : 0));
  const usual = median(steps.slice(1));
  const ways = tips.map((at, row) => (row && at && tips[row - 1] ? distance(at, tips[row - 1]) : NaN));
  const range = Math.max(...endsOf(tips.filter(Boolean)).map(([low, high]) => high - low));
  const leaps = median(ways.filter((way) => !Number.isNaN(way))) > 0.2 * range;
  return steps.map((step, row) => row > 0 && !leaps && step <= 5 * usual);
}

// The turn about z from which a way is seen in its full width.
function broadside(places) {
  const [x, y] = [0, 1].map((k) => places.reduce((sum, at) => sum + at[k], 0) / places.length);
  let xx = 0, xy = 0, yy = 0;
  for (const at of places) {
    xx += (at[0] - x) ** 2;
    xy += (at[0] - x) * (at[1] - y);
    yy += (at[1] - y) ** 2;
  }
  return 0.5 * Math.atan2(2 * xy, xx - yy) || 0;
}

const distance = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
const median = (values) => [...values].sort((a, b) => a - b)[values.length >> 1] ?? 0;
const number = (value, digits = 2) => (Number.isNaN(value) ? "unknown" : value.toFixed(digits));
const largest = (values) => values.reduce((most, value) => Math.max(most, value || 0), 0);

// ---------------------------------------------------------------------------------------------------------
// What the page shows now, and its parts.

const part = (name) => document.getElementById(`space-${name}`);
const curve = part("curve"), slider = part("row"), play = part("play"), chooser = part("trial");
const trials = data.trials.map(() => null);
const state = { trial: null, row: 0, playing: false, last: 0 };
const shows = (name) => part(name).checked;
const scene = new Scene(part("canvas"), drawSpace, { " ": toggle });

function choose(index) {
  trials[index] ??= opened(data.trials[index]);
  const trial = state.trial = trials[index];
  chooser.value = String(index);
  slider.max = String(trial.rows.length - 1);
  curve.setAttribute("aria-label", `Error over time in ${trial.file}: before up to ` +
    `${number(largest(trial.error.before))} mm, after up to ${number(largest(trial.error.after))} mm. ` +
    "Click to go to a row.");
  stop();
  scene.look(trial.centre, trial.size, trial.yaw);
  const errors = trial.rows.map((_, row) => errorAt("before", row) || 0);
  go(errors.indexOf(largest(errors)));
}

// The distance from measured to computed in the axes that were measured, of several points their root mean square.
function errorAt(stage, row = state.row) {
  const squares = state.trial.points.map((point) => {
    const ways = Object.keys(point.measured).map((axis) => point.measured[axis][row] - point[stage][axis][row]);
    const known = ways.filter((way) => !Number.isNaN(way));
    return known.length ? known.reduce((sum, way) => sum + way ** 2, 0) : NaN;
  }).filter((square) => !Number.isNaN(square));
  return Math.sqrt(squares.reduce((sum, square) => sum + square, 0) / squares.length);
}

function go(row) {
  state.row = row;
  slider.value = String(row);
  const { trial } = state, at = `row ${trial.rows[row]}, ${number(trial.time_s[row])} s`;
  slider.setAttribute("aria-valuetext", at);
  part("said").textContent = `${at[0].toUpperCase()}${at.slice(1)}: ${number(errorAt("before"))} mm off before, ` +
    `${number(errorAt("after"))} mm after.`;
  draw();
}

function stop() {
  state.playing = false;
  play.textContent = "Play";
}

function toggle() {
  if (state.playing) return stop();
  state.playing = true;
  play.textContent = "Pause";
  if (state.row === state.trial.rows.length - 1) go(0);
  requestAnimationFrame(step);
}

// Plays all rows in some ten seconds, of few each for 150 ms at most, of many several at a time.
function step(now) {
  if (!state.playing) return;
  const rows = state.trial.rows.length, pause = Math.min(150, Math.max(33, 10000 / rows));
  if (now - state.last >= pause) {
    state.last = now;
    if (state.row >= rows - 1) return stop();
    go(Math.min(rows - 1, state.row + Math.max(1, Math.round(rows / 300))));
  }
  requestAnimationFrame(step);
}

// ---------------------------------------------------------------------------------------------------------
// Drawing the space: ways, the robot's tubes, what was measured, and errors as lines to scale.

// The last point's way up to this row, and faintly all of it.
function drawPath(stage, ink) {
  const { places: all, joined: lines } = state.trial, places = all[stage].at(-1);
  const way = (to) => places.slice(0, to + 1).flatMap((at, row) => (lines[row] ? [at] : [null, at]));
  const dotted = stage === "measured" || !lines.some(Boolean);
  for (const [to, opacity] of [[places.length - 1, 0.22], [state.row, 0.85]]) {
    if (dotted) scene.dots(places.slice(0, to + 1), 1.6, ink, opacity);
    else scene.line(way(to), ink, 1.3, opacity);
  }
}

function drawSpace() {
  const { trial, row } = state, inks = { measured: colour("ink") };
  for (const stage of STAGES) inks[stage] = colour(`mark-${stage}`);
  const now = Object.fromEntries(SHOWN.map((stage) => [stage, trial.places[stage].map((places) => places[row])]));
  scene.axes();
  if (shows("path")) SHOWN.filter(shows).forEach((stage) => drawPath(stage, inks[stage]));
  const tubes = trial.line ? STAGES.filter(shows).map((stage) => (
    { line: lineOf(trial, stage, row), radii: trial.line.radii, ink: inks[stage] })) : [];
  scene.tubes(tubes.filter(({ line }) => line));
  const along = now.measured.filter((_, k) => !trial.points[k].name.startsWith("marker_"));
  if (shows("measured") && along.length > 2) scene.line(along, inks.measured, 1.5); // the measured shape
  for (const stage of STAGES.filter(shows)) {
    now[stage].forEach((at, k) => {
      if (at && shows("measured") && now.measured[k]) scene.line([now.measured[k], at], inks[stage], 2.5);
    });
    scene.dots(now[stage], 4, inks[stage]);
  }
  if (shows("measured")) scene.dots(now.measured, 4.5, inks.measured);
  scene.ruler();
}

// ---------------------------------------------------------------------------------------------------------
// Drawing the error over time, with a line at the row that is shown.

const EDGE = { left: 42, right: 10, top: 10, bottom: 36 };

function curveFrame(width, height) {
  const { error } = state.trial, end = error.time_s.at(-1) || 1;
  const top = Math.max(largest(error.before), largest(error.after), 1e-6) * 1.05;
  return {
    end, top,
    x: (time) => EDGE.left + time / end * (width - EDGE.left - EDGE.right),
    y: (value) => height - EDGE.bottom - value / top * (height - EDGE.top - EDGE.bottom),
    time: (x) => (x - EDGE.left) / (width - EDGE.left - EDGE.right) * end,
  };
}

function drawCurve() {
  const { pen, width, height } = cleared(curve), { trial } = state;
  if (!width) return;
  const { end, top, x, y } = curveFrame(width, height), { error } = trial;
  pen.lineWidth = 1;
  pen.fillStyle = colour("soft");
  const mark = (value) => `${+value.toPrecision(6)}`;
  pen.strokeStyle = colour("line");
  pen.textAlign = "right";
  for (let value = 0, step = nice(top / 2); value <= top; value += step) {
    path(pen, [{ x: x(0), y: y(value) }, { x: x(end), y: y(value) }]);
    pen.stroke();
    pen.fillText(mark(value), EDGE.left - 5, y(value) + 4);
  }
  pen.textAlign = "center";
  for (let value = 0, step = nice(end / 2); value <= end; value += step) pen.fillText(mark(value), x(value), height - 20);
  pen.textAlign = "right";
  pen.fillText("time [s]", width - EDGE.right, height - 5);
  for (const stage of STAGES) {
    path(pen, error.time_s.map((time, k) => (Number.isNaN(error[stage][k]) ? null : { x: x(time), y: y(error[stage][k]) })));
    pen.strokeStyle = colour(`mark-${stage}`);
    pen.lineWidth = 1.6;
    pen.stroke();
  }
  const now = x(trial.time_s[state.row]);
  path(pen, [{ x: now, y: EDGE.top }, { x: now, y: height - EDGE.bottom }]);
  pen.strokeStyle = colour("ink");
  pen.lineWidth = 1.2;
  pen.stroke();
}

function draw() {
  scene.draw();
  requestAnimationFrame(drawCurve);
}

// ---------------------------------------------------------------------------------------------------------
// The error over time leads to its row.

function pick(event) {
  const box = curve.getBoundingClientRect(), time = curveFrame(box.width, box.height).time(event.clientX - box.left);
  const far = state.trial.time_s.map((at) => Math.abs(at - time));
  stop();
  go(far.indexOf(Math.min(...far)));
}
curve.addEventListener("pointerdown", (event) => {
  curve.setPointerCapture(event.pointerId);
  pick(event);
});
curve.addEventListener("pointermove", (event) => event.buttons && pick(event));

// ---------------------------------------------------------------------------------------------------------
// What is shown as CSV, and the start.

function savePoints() {
  const { trial } = state, columns = [["row", trial.rows], ["time_in_trial_s", trial.time_s]];
  for (const [stage, prefix] of [["measured", ""], ["before", "before_"], ["after", "after_"]]) {
    for (const point of trial.points) {
      for (const axis of AXES.filter((name) => name in point[stage])) {
        columns.push([`${prefix}${point.name}_${axis}_mm`, point[stage][axis]]);
      }
    }
  }
  saveColumns(`points_${trial.series}`, columns);
}

function saveErrors() {
  const { error, series } = state.trial;
  saveColumns(`error_${series}`, [["time_in_trial_s", error.time_s], ["before_mm", error.before], ["after_mm", error.after]]);
}

function saveColumns(name, columns) {
  save(name, [columns.map(([title]) => title), ...columns[0][1].map((_, row) => columns.map(([, values]) => values[row]))]);
}

data.trials.forEach((trial, index) => {
  const role = { heldout: "held out", train: "training" }[trial.role] ?? trial.role;
  chooser.append(new Option(`${trial.file} (${role})`, String(index)));
});
chooser.addEventListener("change", () => choose(Number(chooser.value)));
slider.addEventListener("input", () => { stop(); go(Number(slider.value)); });
play.addEventListener("click", toggle);
part("save-points").addEventListener("click", savePoints);
part("save-error").addEventListener("click", saveErrors);
for (const name of ["measured", "before", "after", "path"]) part(name).addEventListener("change", draw);
new ResizeObserver(draw).observe(curve);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
choose(data.first);
})();
