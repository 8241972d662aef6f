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

const AXES = ["x", "y", "z"], STAGES = ["before", "after"], MM = 0.01;
const holder = document.getElementById("in-space");
if (!holder) return;
const data = JSON.parse(holder.textContent);

// Where a point is in a row: null where nothing was measured. An axis that the file lacks is the computed one.
function placeOf(point, stage, row) {
  const found = AXES.map((axis) => point[stage][axis]?.[row]);
  if (AXES.some((axis, k) => axis in point[stage] && found[k] == null)) return null;
  return found.map((value, k) => MM * (value ?? point.after[AXES[k]]?.[row] ?? 0));
}

function lineOf(line, stage, row) {
  const steps = line?.[stage][row];
  if (!steps) return null;
  const found = [];
  for (let k = 0, at = [0, 0, 0]; k < steps.length; k += 3) {
    at = at.map((value, axis) => value + MM * steps[k + axis]);
    found.push(at);
  }
  return found;
}

function decoded(trial) {
  const rows = trial.rows.map((_, row) => {
    const shown = { line: {}, points: {} };
    for (const stage of STAGES) shown.line[stage] = lineOf(trial.line, stage, row);
    for (const stage of ["measured", ...STAGES]) {
      shown.points[stage] = trial.points.map((point) => placeOf(point, stage, row));
    }
    return shown;
  });
  const all = rows.flatMap((row) => [...Object.values(row.points).flat(),
    ...Object.values(row.line).flatMap((line) => line ?? [])]).filter(Boolean);
  const ends = AXES.map((_, k) => all.reduce(([low, high], at) => [Math.min(low, at[k]), Math.max(high, at[k])],
    [Infinity, -Infinity]));
  const size = Math.hypot(...ends.map(([low, high]) => high - low)) || 1;
  return { ...trial, shown: rows, centre: ends.map(([low, high]) => (low + high) / 2), size,
    joined: joined(trial, rows), yaw: broadside(rows) };
}

// Whether a line may join a row to the one before: not over a pause, nor between postures in random order.
function joined(trial, rows) {
  const steps = trial.time_s.map((time, row) => (row ? time - trial.time_s[row - 1] : 0));
  const usual = median(steps.slice(1));
  const tips = rows.map((row) => row.points.measured.at(-1));
  const ways = tips.map((at, row) => (row && at && tips[row - 1] ? distance(at, tips[row - 1]) : NaN));
  const known = tips.filter(Boolean);
  const range = Math.max(...AXES.map((_, k) => Math.max(...known.map((at) => at[k])) - Math.min(...known.map((at) => at[k]))));
  const leaps = median(ways.filter((way) => !Number.isNaN(way))) > 0.2 * range;
  return steps.map((step, row) => row > 0 && !leaps && step <= 5 * usual);
}

// The turn about z from which the last point's way is seen in its full width.
function broadside(rows) {
  const at = rows.map((row) => row.points.measured.at(-1)).filter(Boolean);
  const [x, y] = [0, 1].map((k) => at.reduce((sum, place) => sum + place[k], 0) / at.length);
  let xx = 0, xy = 0, yy = 0;
  for (const place of at) {
    xx += (place[0] - x) ** 2;
    xy += (place[0] - x) * (place[1] - y);
    yy += (place[1] - y) ** 2;
  }
  return 0.5 * Math.atan2(2 * xy, xx - yy) || 0;
}

const distance = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
const median = (values) => [...values].sort((a, b) => a - b)[values.length >> 1] ?? 0;
const number = (value, digits = 2) => (value == null ? "unknown" : value.toFixed(digits));

// ---------------------------------------------------------------------------------------------------------
// What the page shows now, and its parts.

const part = (name) => document.getElementById(`space-${name}`);
const space = part("canvas"), curve = part("curve"), slider = part("row"), play = part("play"), chooser = part("trial");
const trials = data.trials.map(() => null);
const state = { trial: null, row: 0, yaw: 0, pitch: 0.22, zoom: 1, playing: false, last: 0 };
const shows = (name) => part(name).checked;

function choose(index) {
  trials[index] ??= decoded(data.trials[index]);
  state.trial = trials[index];
  chooser.value = String(index);
  slider.max = String(state.trial.rows.length - 1);
  const error = state.trial.error;
  curve.setAttribute("aria-label", `Error over time in ${state.trial.file}: before up to ` +
    `${number(largest(error.before))} mm, after up to ${number(largest(error.after))} mm. Click to go to a row.`);
  stop();
  home();
  const errors = state.trial.rows.map((_, row) => errorAt("before", row) ?? 0);
  go(errors.indexOf(Math.max(...errors)));
}

const largest = (values) => values.reduce((most, value) => Math.max(most, value ?? 0), 0);

function home() {
  Object.assign(state, { yaw: state.trial.yaw, pitch: 0.22, zoom: 1 });
}

// The distance from measured to computed in the axes that were measured, of several points their root mean square.
function errorAt(stage, row = state.row) {
  const squares = state.trial.points.map((point) => {
    const ways = Object.keys(point.measured).map((axis) => [point.measured[axis][row], point[stage][axis][row]]);
    const known = ways.filter(([measured, computed]) => measured != null && computed != null);
    return known.length ? known.reduce((sum, [measured, computed]) => sum + (MM * (measured - computed)) ** 2, 0) : null;
  }).filter((square) => square != null);
  return squares.length ? Math.sqrt(squares.reduce((sum, square) => sum + square, 0) / squares.length) : null;
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

function step(now) {
  if (!state.playing) return;
  const rows = state.trial.rows.length, pause = Math.min(150, Math.max(33, 10000 / rows)); // of ten seconds, about
  if (now - state.last >= pause) {
    state.last = now;
    if (state.row >= rows - 1) return stop();
    go(state.row + 1);
  }
  requestAnimationFrame(step);
}

// ---------------------------------------------------------------------------------------------------------
// Drawing the space: a small perspective, z up, turned by yaw about z and by pitch from above.

const colour = (name) => getComputedStyle(root).getPropertyValue(`--${name}`).trim();

// A canvas as large as it is shown, cleared; its pen draws in CSS pixels.
function cleared(canvas) {
  const { clientWidth: width, clientHeight: height } = canvas, dense = window.devicePixelRatio || 1;
  canvas.width = Math.round(width * dense);
  canvas.height = Math.round(height * dense);
  const pen = canvas.getContext("2d");
  pen.scale(dense, dense);
  pen.lineJoin = pen.lineCap = "round";
  return { pen, width, height };
}

function projection(width, height) {
  const { centre, size } = state.trial, away = 2.5 * size, usual = 1.05 * state.zoom * Math.min(width, height) / size;
  const [cy, sy, cp, sp] = [Math.cos(state.yaw), Math.sin(state.yaw), Math.cos(state.pitch), Math.sin(state.pitch)];
  return (at) => {
    const [x, y, z] = at.map((value, k) => value - centre[k]);
    const right = cy * x + sy * y, back = cy * y - sy * x, depth = cp * back - sp * z;
    const scale = usual * away / Math.max(0.2 * away, away + depth); // pixels a millimetre there
    return { x: width / 2 + right * scale, y: height / 2 - (cp * z + sp * back) * scale, depth, scale };
  };
}

function path(pen, places) {
  pen.beginPath();
  let on = false;
  for (const at of places) {
    if (at) pen[on ? "lineTo" : "moveTo"](at.x, at.y);
    on = Boolean(at);
  }
}

// A tube along a line, as its outline: in each place to both sides of the way there.
function tube(pen, line, radii, ink) {
  const across = [];
  line.forEach((at, k) => {
    const [from, to] = [line[Math.max(0, k - 1)], line[Math.min(line.length - 1, k + 1)]];
    const length = Math.hypot(to.x - from.x, to.y - from.y);
    across.push(length > 1e-3 ? [(from.y - to.y) / length, (to.x - from.x) / length] : across.at(-1) ?? [1, 0]);
  });
  const sides = (share) => {
    const half = line.map((at, k) => share * Math.max(1.2, radii[k] * at.scale));
    const side = (sign) => line.map((at, k) => ({ x: at.x + sign * half[k] * across[k][0], y: at.y + sign * half[k] * across[k][1] }));
    path(pen, [...side(1), ...side(-1).reverse()]);
    pen.closePath();
  };
  pen.fillStyle = pen.strokeStyle = ink;
  for (const [share, opacity] of [[1, 0.3], [0.72, 0.22], [0.4, 0.2]]) { // rounder by three shades
    sides(share);
    pen.globalAlpha = opacity;
    pen.fill();
  }
  sides(1);
  pen.globalAlpha = 0.9;
  pen.lineWidth = 1;
  pen.stroke();
  pen.globalAlpha = 1;
}

function dot(pen, at, radius, ink) {
  pen.beginPath();
  pen.arc(at.x, at.y, radius, 0, 2 * Math.PI);
  pen.fillStyle = ink;
  pen.fill();
}

// The last point's way up to this row, and faintly all of it.
function drawPath(pen, seen, stage, ink) {
  const { shown, joined: lines } = state.trial;
  const places = shown.map((row) => row.points[stage].at(-1)).map((at) => at && seen(at));
  const stretch = (to) => {
    const way = [];
    for (let row = 0; row <= to; row += 1) way.push(...(lines[row] ? [places[row]] : [null, places[row]]));
    path(pen, way);
    pen.strokeStyle = ink;
    pen.lineWidth = 1.3;
    pen.stroke();
  };
  const dots = (to) => places.slice(0, to + 1).forEach((at) => at && dot(pen, at, 1.6, ink));
  const show = stage === "measured" || !lines.some(Boolean) ? dots : stretch;
  pen.globalAlpha = 0.22;
  show(places.length - 1);
  pen.globalAlpha = 0.85;
  show(state.row);
  pen.globalAlpha = 1;
}

function drawAxes(pen, seen, size) {
  const long = nice(size / 4), origin = seen([0, 0, 0]);
  pen.strokeStyle = pen.fillStyle = colour("soft");
  pen.font = "12px system-ui, sans-serif";
  pen.lineWidth = 1;
  AXES.forEach((axis, k) => {
    const end = seen(AXES.map((_, other) => (other === k ? long : 0)));
    path(pen, [origin, end]);
    pen.stroke();
    pen.fillText(axis, end.x + 3, end.y - 3);
  });
}

const nice = (value) => {
  const ten = 10 ** Math.floor(Math.log10(value)), times = value / ten;
  return (times >= 5 ? 5 : times >= 2 ? 2 : 1) * ten;
};

function drawScale(pen, width, height) {
  const { size, centre } = state.trial, scale = projection(width, height)(centre).scale;
  const long = nice(0.25 * width / scale), x = 12, y = height - 12;
  pen.strokeStyle = pen.fillStyle = colour("ink");
  pen.lineWidth = 2;
  path(pen, [{ x, y }, { x: x + long * scale, y }]);
  pen.stroke();
  pen.font = "12px system-ui, sans-serif";
  pen.fillText(`${long} mm`, x, y - 6);
}

function drawSpace() {
  const { pen, width, height } = cleared(space), { trial } = state, now = trial.shown[state.row];
  if (!width) return;
  const seen = projection(width, height), inks = { measured: colour("ink") };
  for (const stage of STAGES) inks[stage] = colour(`mark-${stage}`);
  drawAxes(pen, seen, trial.size);
  if (shows("path")) ["measured", ...STAGES].filter(shows).forEach((stage) => drawPath(pen, seen, stage, inks[stage]));
  const tubes = STAGES.filter((stage) => shows(stage) && now.line[stage])
    .map((stage) => ({ stage, line: now.line[stage].map(seen) }));
  const depth = ({ line }) => line.reduce((sum, at) => sum + at.depth, 0);
  for (const { stage, line } of tubes.sort((a, b) => depth(b) - depth(a))) {
    tube(pen, line, trial.line.radius_mm, inks[stage]);
  }
  const places = (stage) => now.points[stage].map((at) => at && seen(at));
  const measured = places("measured");
  for (const stage of STAGES.filter(shows)) {
    places(stage).forEach((at, k) => {
      if (!at) return;
      if (shows("measured") && measured[k]) {
        path(pen, [measured[k], at]);
        pen.strokeStyle = inks[stage];
        pen.lineWidth = 2.5;
        pen.stroke();
      }
      dot(pen, at, 4, inks[stage]);
    });
  }
  if (shows("measured")) measured.forEach((at) => at && dot(pen, at, 4.5, inks.measured));
  drawScale(pen, width, height);
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
  pen.font = "12px system-ui, sans-serif";
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
    path(pen, error.time_s.map((time, k) => (error[stage][k] == null ? null : { x: x(time), y: y(error[stage][k]) })));
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

let waiting = false;
function draw() {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(() => {
    waiting = false;
    drawSpace();
    drawCurve();
  });
}

// ---------------------------------------------------------------------------------------------------------
// Mouse, touch and keys.

function turn(yaw, pitch) {
  state.yaw += yaw;
  state.pitch = Math.min(Math.PI / 2, Math.max(-Math.PI / 2, state.pitch + pitch));
  draw();
}

function zoom(factor) {
  state.zoom = Math.min(40, Math.max(0.3, state.zoom * factor));
  draw();
}

const touching = new Map(); // where the pointers that are down were last
const apart = () => {
  const [one, two] = [...touching.values()];
  return Math.hypot(one.x - two.x, one.y - two.y);
};
space.addEventListener("pointerdown", (event) => {
  space.setPointerCapture(event.pointerId);
  touching.set(event.pointerId, { x: event.clientX, y: event.clientY });
});
space.addEventListener("pointermove", (event) => {
  const before = touching.get(event.pointerId);
  if (!before) return;
  const now = { x: event.clientX, y: event.clientY }, far = touching.size === 2 ? apart() : 0;
  touching.set(event.pointerId, now);
  if (far) zoom(apart() / far);
  else turn(-0.008 * (now.x - before.x), 0.008 * (now.y - before.y));
});
for (const end of ["pointerup", "pointercancel"]) space.addEventListener(end, (event) => touching.delete(event.pointerId));
space.addEventListener("wheel", (event) => {
  event.preventDefault();
  zoom(Math.exp(-0.0015 * event.deltaY));
}, { passive: false });

const KEYS = {
  ArrowLeft: () => turn(0.1, 0), ArrowRight: () => turn(-0.1, 0), ArrowUp: () => turn(0, -0.1), ArrowDown: () => turn(0, 0.1),
  "+": () => zoom(1.15), "=": () => zoom(1.15), "-": () => zoom(1 / 1.15), " ": toggle,
  Home: () => { home(); draw(); },
};
space.addEventListener("keydown", (event) => {
  if (!KEYS[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
  event.preventDefault();
  KEYS[event.key]();
});

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
        const values = point[stage][axis].map((value) => (value == null ? "" : value / 100));
        columns.push([`${prefix}${point.name}_${axis}_mm`, values]);
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
new ResizeObserver(draw).observe(space);
new ResizeObserver(draw).observe(curve);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
choose(data.first);
})();
