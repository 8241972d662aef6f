// A small view in space on a canvas: tubes, paths, points and lines, turned and zoomed by mouse, touch and keys.
// Lengths are in mm; z points up.
"use strict";

class Scene {
  constructor(canvas, length, turn = -0.5) {
    this.canvas = canvas;
    this.pen = canvas.getContext("2d");
    this.length = length;
    this.firstTurn = turn;
    this.reset();
    this.fingers = new Map();
    canvas.tabIndex = 0;
    canvas.addEventListener("pointerdown", (event) => this.grab(event));
    canvas.addEventListener("pointermove", (event) => this.drag(event));
    for (const name of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(name, (event) => this.fingers.delete(event.pointerId));
    }
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoomBy(Math.exp(-0.001 * event.deltaY));
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => this.key(event));
    canvas.addEventListener("dblclick", () => { this.reset(); this.draw(); });
  }

  reset() {
    this.turn = this.firstTurn;
    this.lift = 0.3;
    this.zoom = 1;
    this.middle = [0, 0, 0.5 * this.length];
    this.items = this.items || [];
  }

  grab(event) {
    this.canvas.setPointerCapture(event.pointerId);
    this.fingers.set(event.pointerId, [event.offsetX, event.offsetY]);
  }

  drag(event) {
    const before = this.fingers.get(event.pointerId);
    if (!before) return;
    const now = [event.offsetX, event.offsetY];
    if (this.fingers.size === 2) {
      const [other] = [...this.fingers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
      const apart = (at) => Math.hypot(at[0] - other[0], at[1] - other[1]) || 1;
      this.zoomBy(apart(now) / apart(before));
    } else {
      this.turnBy(0.01 * (now[0] - before[0]), 0.01 * (now[1] - before[1]));
    }
    this.fingers.set(event.pointerId, now);
  }

  key(event) {
    const step = 0.1;
    const turns = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step] };
    if (turns[event.key]) this.turnBy(...turns[event.key]);
    else if (event.key === "+" || event.key === "=") this.zoomBy(1.15);
    else if (event.key === "-") this.zoomBy(1 / 1.15);
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  turnBy(turn, lift) {
    this.turn += turn;
    this.lift = Math.min(1.5, Math.max(-1.5, this.lift + lift));
    this.draw();
  }

  zoomBy(factor) {
    this.zoom = Math.min(20, Math.max(0.2, this.zoom * factor));
    this.draw();
  }

  // [pixels to the right, pixels down, scale there, depth]
  project(point) {
    const [x, y, z] = [0, 1, 2].map((axis) => point[axis] - this.middle[axis]);
    const [c, s, cl, sl] = [Math.cos(this.turn), Math.sin(this.turn), Math.cos(this.lift), Math.sin(this.lift)];
    const across = c * x - s * y, into = s * x + c * y;
    const up = cl * z + sl * into, away = cl * into - sl * z;
    const far = 4 * this.length;
    const scale = (this.zoom * this.size) / (1.35 * this.length) * (far / Math.max(far + away, 0.05 * far));
    return [this.width / 2 + scale * across, this.height / 2 - scale * up, scale, away];
  }

  show(items) {
    this.items = items;
    this.draw();
  }

  draw() {
    const ratio = window.devicePixelRatio || 1;
    this.width = this.canvas.clientWidth;
    this.height = this.canvas.clientHeight;
    this.size = Math.min(this.width, this.height);
    if (this.canvas.width !== Math.round(this.width * ratio)) this.canvas.width = Math.round(this.width * ratio);
    if (this.canvas.height !== Math.round(this.height * ratio)) this.canvas.height = Math.round(this.height * ratio);
    this.pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.pen.clearRect(0, 0, this.width, this.height);
    this.pen.lineCap = this.pen.lineJoin = "round";
    const strokes = [];
    for (const item of [...this.ground(), ...this.items]) {
      const points = item.points.filter((point) => point && point.every((value) => value !== null));
      if (item.kind === "points") {
        for (const point of points) strokes.push({ item, at: [this.project(point)] });
        continue;
      }
      const at = points.map((point) => this.project(point));
      if (item.kind === "tube") {
        if (at.length > 1) strokes.push({ item, at });
        continue;
      }
      for (let k = 1; k < at.length; k++) strokes.push({ item, at: [at[k - 1], at[k]] });
    }
    for (const stroke of strokes) {
      stroke.depth = stroke.at.reduce((sum, at) => sum + at[3], 0) / stroke.at.length;
    }
    strokes.sort((one, other) => other.depth - one.depth);
    for (const stroke of strokes) this.stroke(stroke);
  }

  stroke({ item, at }) {
    const pen = this.pen;
    pen.globalAlpha = item.alpha === undefined ? 1 : item.alpha;
    const width = item.radius ? Math.max(2, 2 * item.radius * at[0][2]) : item.width || 1;
    if (item.kind === "points") {
      pen.fillStyle = item.colour;
      pen.beginPath();
      pen.arc(at[0][0], at[0][1], Math.max(3, width / 2), 0, 2 * Math.PI);
      pen.fill();
    } else {
      const passes = item.kind === "tube" ? [[item.edge, width], [item.colour, Math.max(width - 3, 0.7 * width)]] : [[item.colour, width]];
      for (const [colour, size] of passes) {
        pen.strokeStyle = colour;
        pen.lineWidth = size;
        pen.beginPath();
        pen.moveTo(at[0][0], at[0][1]);
        for (const place of at.slice(1)) pen.lineTo(place[0], place[1]);
        pen.stroke();
      }
    }
    pen.globalAlpha = 1;
  }

  // Two rings on the base's plane and the base frame's axes.
  ground() {
    const colour = getComputedStyle(this.canvas).getPropertyValue("--faint") || "#ccc";
    const ring = (radius) => ({
      kind: "path", colour, width: 1,
      points: Array.from({ length: 49 }, (_, k) => {
        const angle = (k * Math.PI) / 24;
        return [radius * Math.cos(angle), radius * Math.sin(angle), 0];
      }),
    });
    const reach = 0.25 * this.length;
    const axes = [["#D55E00", 0], ["#009E73", 1], ["#0072B2", 2]].map(([axis, index]) => ({
      kind: "path", colour: axis, width: 2,
      points: [[0, 0, 0], [0, 1, 2].map((place) => (place === index ? 0.15 * this.length : 0))],
    }));
    return [ring(reach), ring(2 * reach), ...axes];
  }
}
