// Runs a robot's plain MJCF in MuJoCo's WebAssembly module, in the reader's browser, and draws it.
// `engine.js` and `robots/NAME.js` are loaded when they are needed; they put their contents into `LIVE`.
"use strict";

const LIVE = { robots: {} };
const find = (id) => document.getElementById(`live-${id}`);
const BUSY_MS = 14; // of a picture's time, that the engine may take
const MOST_TRAIL = 300;
const RAMP_S = 2; // for a channel's whole range

// A script beside this one; pages opened from a folder may load scripts, not files.
const load = (name) => new Promise((loaded, failed) => {
  const script = Object.assign(document.createElement("script"), { src: `live/${name}.js` });
  Object.assign(script, { onload: loaded, onerror: () => failed(new Error(`live/${name}.js cannot be loaded`)) });
  document.head.append(script);
});

const bytes = (base64) => Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));

async function engine() {
  await load("engine");
  const unpacked = new Blob([bytes(LIVE.engine.wasm)]).stream().pipeThrough(new DecompressionStream("gzip"));
  const wasmBinary = await new Response(unpacked).arrayBuffer();
  const address = URL.createObjectURL(new Blob([LIVE.engine.script], { type: "text/javascript" }));
  delete LIVE.engine;
  return (await import(address)).default({ wasmBinary, locateFile: (name) => name });
}

// A robot that runs: its model, what its sliders ask for, where it is.
class Robot {
  constructor(mujoco, about) {
    Object.assign(this, { mujoco, about, values: {}, trail: [], speed: 0, due_s: 0 });
    this.model = mujoco.MjModel.from_xml_string(about.mjcf);
    this.data = new mujoco.MjData(this.model);
    this.step_s = this.model.opt.timestep;
    this.reset();
  }

  reset() {
    this.values = Object.fromEntries(this.about.sliders.map(({ name }) => [name, 0]));
    this.driven = { ...this.values };
    if (this.model.nkey) this.mujoco.mj_resetDataKeyframe(this.model, this.data, 0);
    else this.mujoco.mj_resetData(this.model, this.data);
    this.mujoco.mj_forward(this.model, this.data);
    Object.assign(this, { trail: [], due_s: 0 });
  }

  // Simulates what has passed, as far as there is time; what was late is not caught up.
  advance(passed_s) {
    const { mujoco, model, data } = this, begun = performance.now();
    const from_s = data.time;
    this.due_s = Math.min(this.due_s + passed_s, 0.1);
    while (this.due_s >= this.step_s && performance.now() - begun < BUSY_MS) {
      this.follow();
      mujoco.mj_step(model, data);
      this.due_s -= this.step_s;
    }
    if (passed_s > 0) this.speed += 0.05 * ((data.time - from_s) / passed_s - this.speed);
    this.trail.push(this.tip());
    if (this.trail.length > MOST_TRAIL) this.trail.shift();
  }

  // Brings what drives the robot nearer to its sliders by a step: a slider that jumps is a ramp of the robot's.
  follow() {
    const { ctrl } = this.data;
    for (const { name, least, most } of this.about.sliders) {
      const change = this.step_s * (most - least) / RAMP_S, now = this.driven[name];
      this.driven[name] = Math.min(now + change, Math.max(now - change, this.values[name]));
    }
    this.about.controls.forEach((parts, k) => {
      ctrl[k] = parts.reduce((sum, [name, factor]) => sum + factor * this.driven[name], 0);
    });
  }

  // The tip in mm: it is fixed to the last body.
  tip() {
    const body = this.about.bodies.at(-1), { xpos, xmat } = this.data;
    return [0, 1, 2].map((axis) => 1e3 * (xpos[3 * body + axis] + [0, 1, 2].reduce(
      (sum, k) => sum + xmat[9 * body + 3 * axis + k] * this.about.tip_m[k], 0)));
  }

  line() {
    const { xpos } = this.data;
    return [[0, 0, 0], ...this.about.bodies.map((body) => [0, 1, 2].map((k) => 1e3 * xpos[3 * body + k])), this.tip()];
  }

  paint(scene) {
    const { length_mm, radii_mm } = this.about;
    for (const share of [0.25, 0.5]) scene.ring(share * length_mm);
    scene.axes();
    scene.line(this.trail, colour("trail"), 1.5);
    scene.tubes([{ line: this.line(), radii: radii_mm, ink: colour("robot") }], true);
    scene.ruler();
  }

  free() {
    this.data.delete();
    this.model.delete();
  }
}

let robot = null, mujoco = null, last = null;
const scene = new Scene(find("view"), (own) => robot?.paint(own));

function addSlider({ name, unit, least, most, step }) {
  const label = document.createElement("label"), words = document.createElement("span");
  const range = Object.assign(document.createElement("input"), { type: "range", min: least, max: most, step, value: 0 });
  range.setAttribute("aria-label", name);
  const say = () => { words.textContent = `${name}: ${range.value}`; };
  range.addEventListener("input", () => { robot.values[name] = Number(range.value); say(); });
  label.append(words, range);
  say();
  find("channels").append(label);
}

async function show(name) {
  find("said").textContent = "Loading.";
  find("robot").disabled = true;
  try {
    mujoco ??= await engine();
    if (!LIVE.robots[name]) await load(`robots/${name}`);
    robot?.free();
    robot = null;
    const about = LIVE.robots[name];
    robot = new Robot(mujoco, about);
    scene.look([0, 0, about.length_mm / 2], 1.4 * about.length_mm, about.turn_rad);
    find("channels").replaceChildren();
    about.sliders.forEach(addSlider);
    find("said").textContent = "";
    find("reset").disabled = false;
  } catch (error) {
    find("said").textContent = `It does not run here: ${error.message ?? error}`;
    throw error;
  } finally {
    find("robot").disabled = false;
  }
}

function frame(now_ms) {
  if (robot) {
    robot.advance(last === null ? 0 : (now_ms - last) / 1e3);
    const tip = robot.tip().map((value) => value.toFixed(1)).join(", ");
    find("state").textContent = `${robot.data.time.toFixed(1)} s, tip ${tip} mm, ${robot.speed.toFixed(2)} times real time`;
    scene.draw();
  }
  last = now_ms;
  requestAnimationFrame(frame);
}

find("robot").addEventListener("change", () => { if (mujoco) show(find("robot").value); });
find("start").addEventListener("click", () => {
  find("start").hidden = true;
  show(find("robot").value).catch(() => { find("start").hidden = false; });
});
find("reset").addEventListener("click", () => {
  robot.reset();
  for (const range of find("channels").querySelectorAll("input")) {
    range.value = 0;
    range.dispatchEvent(new Event("input"));
  }
});
requestAnimationFrame(frame);
