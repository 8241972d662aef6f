// Drives the robot that the page's server simulates: sliders, keys, gamepad, play, CSV, picture.
"use strict";

const about = JSON.parse(document.getElementById("about").textContent);
const find = (id) => document.getElementById(id);
const scene = new Scene(find("view"), paint);
const MOST_TRAIL = 300;
const NAME = about.robot.replace(/[^\w.-]+/g, "_"); // of files
scene.look([0, 0, about.length_mm / 2], 1.4 * about.length_mm, about.turn_rad);
const channels = about.sliders.filter((slider) => !/^(force_tip|gravity)_/.test(slider.name));
const boxes = new Map();
let state = null, trail = [], wanted = {}, asked = false, received = 0, drawn = 0, chosen = 0;

function ask(message) {
  return fetch("ask", { method: "POST", body: JSON.stringify(message) }).then(async (answer) => {
    find("said").textContent = answer.ok ? "" : await answer.text();
  }, () => lost());
}

// Sends what the sliders ask for, once a frame at most.
function set(name, value) {
  const slider = about.sliders.find((item) => item.name === name);
  wanted[name] = Math.min(slider.most, Math.max(slider.least, value));
  show(name, wanted[name], true);
  if (asked) return;
  asked = true;
  requestAnimationFrame(() => {
    const values = wanted;
    wanted = {};
    asked = false;
    ask({ set: values });
  });
}

function show(name, value, always = false) {
  const box = boxes.get(name);
  if (!box || (!always && (document.activeElement === box.number || box.held))) return;
  box.range.value = value;
  box.number.value = Number(value.toPrecision(4));
}

function addSlider(slider, place) {
  const label = document.createElement("label");
  const words = document.createElement("span");
  words.textContent = slider.name.replace(/_[^_]+$/, "").replaceAll("_", " ") + ` [${slider.unit === "mps2" ? "m/s²" : slider.unit}]`;
  const range = document.createElement("input"), number = document.createElement("input");
  Object.assign(range, { type: "range", min: slider.least, max: slider.most, step: slider.step, value: slider.rest });
  Object.assign(number, { type: "number", min: slider.least, max: slider.most, step: slider.step, value: slider.rest });
  range.setAttribute("aria-label", slider.name);
  number.setAttribute("aria-label", `${slider.name}, as a number`);
  range.dataset.channel = slider.name;
  const box = { range, number, held: false };
  range.addEventListener("pointerdown", () => { box.held = true; });
  for (const end of ["change", "pointerup", "pointercancel"]) range.addEventListener(end, () => { box.held = false; });
  range.addEventListener("input", () => set(slider.name, Number(range.value)));
  number.addEventListener("change", () => set(slider.name, Number(number.value)));
  boxes.set(slider.name, box);
  label.append(words, range, number);
  place.append(label);
}

for (const slider of about.sliders) addSlider(slider, find(channels.includes(slider) ? "channels" : "loads"));

// Keys: digits choose a channel, w and s (or a gamepad's stick) drive it.
function choose(index) {
  chosen = Math.min(Math.max(index, 0), channels.length - 1);
  for (const slider of channels) {
    boxes.get(slider.name).range.closest("label").classList.toggle("chosen", slider === channels[chosen]);
  }
}

function drive(share) {
  const slider = channels[chosen];
  const now = Number(boxes.get(slider.name).range.value);
  set(slider.name, now + share * (slider.most - slider.least));
}

document.addEventListener("keydown", (event) => {
  if (event.target instanceof HTMLInputElement && event.target.type === "number") return;
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (/^[1-9]$/.test(event.key)) choose(Number(event.key) - 1);
  else if (event.key === "w") drive(0.02);
  else if (event.key === "s") drive(-0.02);
  else if (event.key === "0") ask({ reset: true });
  else return;
  event.preventDefault();
});

function gamepad() {
  for (const pad of navigator.getGamepads ? navigator.getGamepads() : []) {
    if (!pad) continue;
    pad.axes.slice(0, channels.length).forEach((value, index) => {
      if (Math.abs(value) < 0.15) return;
      const slider = channels[index];
      const now = Number(boxes.get(slider.name).range.value);
      set(slider.name, now - 0.02 * value * (slider.most - slider.least));
    });
  }
}

// What the server says, and how it is drawn.
function take(next) {
  if (state && next.time_s < state.time_s) trail = [];
  state = next;
  received += 1;
  const tip = state.shape_mm[state.shape_mm.length - 1];
  trail.push(tip);
  if (trail.length > MOST_TRAIL) trail.shift();
  scene.draw();
  for (const [name, value] of Object.entries(state.values)) show(name, value);
  find("time").textContent = `${state.time_s.toFixed(1)} s`;
  find("tip").textContent = `tip ${tip.map((value) => value.toFixed(1)).join(", ")} mm`;
  find("failure").textContent = state.failure ? `${state.failure}. Press Reset.` : "";
  if (about.played) {
    find("at").value = state.play_s;
    find("play").textContent = state.running ? "Pause" : "Play";
  }
}

function paint() {
  if (!state) return;
  for (const share of [0.25, 0.5]) scene.ring(share * about.length_mm);
  scene.axes();
  scene.line(trail, colour("trail"), 1.5);
  scene.tubes([{ line: state.shape_mm, radii: about.radii_mm, ink: colour("robot") }], true);
  const known = (state.measured_mm ?? []).filter((point) => point.every((value) => value !== null));
  scene.dots(known, 4.5, colour("measured"));
  scene.ruler();
  drawn += 1;
}

function poll() {
  gamepad();
  requestAnimationFrame(poll);
}

setInterval(() => {
  find("rate").textContent = `${received} states/s, ${drawn} pictures/s`;
  document.body.dataset.states = received;
  document.body.dataset.pictures = drawn;
  received = drawn = 0;
}, 1000);

function lost() {
  find("lost").hidden = false;
}

// A page that is not seen asks for no states: a browser has six connections to a server, for all its pages.
let source = null;

function listen() {
  source?.close();
  source = null;
  if (document.hidden) return;
  source = new EventSource("states");
  source.onmessage = (event) => { find("lost").hidden = true; take(JSON.parse(event.data)); };
  source.onerror = lost;
}

document.addEventListener("visibilitychange", listen);
listen();

find("reset").addEventListener("click", () => ask({ reset: true }));
find("save").addEventListener("click", () => {
  const link = Object.assign(document.createElement("a"), { href: "driven.csv", download: `${NAME}_driven.csv` });
  link.click();
});
find("shot").addEventListener("click", () => {
  const drawn_on = find("view"), sheet = document.createElement("canvas"), pen = sheet.getContext("2d");
  Object.assign(sheet, { width: drawn_on.width, height: drawn_on.height });
  pen.fillStyle = colour("paper");
  pen.fillRect(0, 0, sheet.width, sheet.height);
  pen.drawImage(drawn_on, 0, 0);
  Object.assign(document.createElement("a"), { href: sheet.toDataURL("image/png"), download: `${NAME}.png` }).click();
});
find("copy").addEventListener("click", async () => {
  const pull = ["x", "y", "z"].map((axis) => state?.values[`gravity_${axis}_mps2`] ?? 0);
  const gravity = pull.some(Boolean) ? ` --gravity=${pull.join(",")}` : "";
  const text = `catheter-sim simulate ${about.command} --inputs ${NAME}_driven.csv${gravity} -o out.csv`;
  try {
    await navigator.clipboard.writeText(text);
    find("said").textContent = `copied: ${text}`;
  } catch {
    find("said").textContent = text;
  }
});
if (about.outside.length) {
  find("outside").textContent = `The sliders leave out what acts on commands or measurements: ${about.outside.join(", ")}.`
    + (about.played ? " A file that is played has what acts on its commands." : "");
}
if (about.played) {
  find("player").hidden = false;
  find("file").textContent = about.played.name;
  find("at").max = about.played.end_s;
  find("play").addEventListener("click", () => ask({ play: { running: !(state && state.running) } }));
  find("at").addEventListener("input", () => ask({ play: { at_s: Number(find("at").value), running: false } }));
  find("speed").addEventListener("change", () => ask({ play: { speed: Number(find("speed").value), running: Boolean(state && state.running) } }));
}
choose(0);
requestAnimationFrame(poll);
