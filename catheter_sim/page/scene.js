// The robot in space on a canvas, for every page that shows it: the camera, which mouse, touch and keys turn, move and
// zoom, and what is drawn through it. Lengths are in mm; z points up. Colours are the page's, by their CSS names.
"use strict";

// A canvas as large as it is shown, cleared; its pen draws in CSS pixels.
function cleared(canvas) {
  const { clientWidth: width, clientHeight: height } = canvas, dense = window.devicePixelRatio || 1;
  canvas.width = Math.round(width * dense);
  canvas.height = Math.round(height * dense);
  const pen = canvas.getContext("2d");
  pen.scale(dense, dense);
  pen.lineJoin = pen.lineCap = "round";
  pen.font = "12px system-ui, sans-serif";
  return { pen, width, height };
}

// A path through places {x, y} in pixels; null ends a line, the next place begins another.
function path(pen, places) {
  pen.beginPath();
  let on = false;
  for (const at of places) {
    if (at) pen[on ? "lineTo" : "moveTo"](at.x, at.y);
    on = Boolean(at);
  }
}

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

// The longest of 1, 2 and 5 times a power of ten that is no longer than a value.
const nice = (value) => {
  const ten = 10 ** Math.floor(Math.log10(value)), times = value / ten;
  return (times >= 5 ? 5 : times >= 2 ? 2 : 1) * ten;
};

class Scene {
  // `paint(scene)` draws what there is by the methods below; `keys` are further ones: {key: what it does}.
  constructor(canvas, paint, keys = {}) {
    Object.assign(this, { canvas, paint, keys, waiting: false, down: new Map() });
    this.look([0, 0, 0], 1, 0);
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.down.set(event.pointerId, this.under(event));
    });
    canvas.addEventListener("pointermove", (event) => this.drag(event));
    for (const end of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(end, (event) => this.down.delete(event.pointerId));
    }
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoomBy(Math.exp(-0.0015 * event.deltaY), this.under(event));
    }, { passive: false });
    canvas.addEventListener("dblclick", () => this.reset());
    canvas.addEventListener("keydown", (event) => this.key(event));
    new ResizeObserver(() => this.draw()).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }

  // Looks at a centre, shape (3,), about which lies what has a size, from a turn about z [rad].
  look(centre, size, yaw) {
    this.first = { centre, size, yaw };
    this.reset();
  }

  reset() {
    Object.assign(this, this.first, { pitch: 0.22, zoom: 1, shift: [0, 0] });
    this.draw();
  }

  turnBy(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = Math.min(Math.PI / 2, Math.max(-Math.PI / 2, this.pitch + pitch));
    this.draw();
  }

  // Moves what is seen, in pixels.
  moveBy(x, y) {
    this.shift = [this.shift[0] + x, this.shift[1] + y];
    this.draw();
  }

  // What is at a place in pixels stays there; by default the middle.
  zoomBy(factor, at = this.middle()) {
    const zoom = Math.min(40, Math.max(0.3, this.zoom * factor)), middle = this.middle();
    this.shift = this.shift.map((value, k) => at[k] - middle[k] - zoom / this.zoom * (at[k] - middle[k] - value));
    this.zoom = zoom;
    this.draw();
  }

  middle() {
    return [this.canvas.clientWidth / 2, this.canvas.clientHeight / 2];
  }

  under(event) {
    const box = this.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  drag(event) {
    const before = this.down.get(event.pointerId);
    if (!before) return;
    const now = this.under(event), [x, y] = now.map((value, k) => value - before[k]);
    const [other] = [...this.down].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
    this.down.set(event.pointerId, now);
    if (other) {
      const apart = (at) => Math.hypot(at[0] - other[0], at[1] - other[1]) || 1;
      this.moveBy(x / 2, y / 2);
      this.zoomBy(apart(now) / apart(before), now.map((value, k) => (value + other[k]) / 2));
    } else if (event.shiftKey) this.moveBy(x, y);
    else this.turnBy(-0.008 * x, 0.008 * y);
  }

  key(event) {
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (way && event.shiftKey) this.moveBy(30 * way[0], 30 * way[1]);
    else if (way) this.turnBy(-0.1 * way[0], 0.1 * way[1]);
    else if (event.key === "+" || event.key === "=") this.zoomBy(1.15);
    else if (event.key === "-") this.zoomBy(1 / 1.15);
    else if (event.key === "Home") this.reset();
    else if (this.keys[event.key]) this.keys[event.key]();
    else return;
    event.preventDefault();
  }

  // Draws at the browser's next picture, once however often it is asked to.
  draw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      Object.assign(this, cleared(this.canvas));
      if (this.width) this.paint(this);
    });
  }

  // Where a point is seen, in pixels; `depth` is how far behind the centre [mm], `scale` pixels a millimetre there.
  seen(point) {
    const away = 3 * this.size, usual = 1.05 * this.zoom * Math.min(this.width, this.height) / this.size;
    const [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    const [x, y, z] = point.map((value, k) => value - this.centre[k]);
    const back = cy * y - sy * x, depth = cp * back - sp * z;
    const scale = usual * away / Math.max(0.2 * away, away + depth);
    const [right, down] = [(cy * x + sy * y) * scale, -(cp * z + sp * back) * scale];
    return { x: this.width / 2 + this.shift[0] + right, y: this.height / 2 + this.shift[1] + down, depth, scale };
  }

  // A line through points in space; null ends it, the next point begins another.
  line(points, ink, width = 1, opacity = 1) {
    path(this.pen, points.map((point) => point && this.seen(point)));
    Object.assign(this.pen, { strokeStyle: ink, lineWidth: width, globalAlpha: opacity });
    this.pen.stroke();
    this.pen.globalAlpha = 1;
  }

  // Points in space as dots, those of null left out; the radius in pixels.
  dots(points, radius, ink, opacity = 1) {
    Object.assign(this.pen, { fillStyle: ink, globalAlpha: opacity });
    for (const point of points.filter(Boolean)) {
      const at = this.seen(point);
      this.pen.beginPath();
      this.pen.arc(at.x, at.y, radius, 0, 2 * Math.PI);
      this.pen.fill();
    }
    this.pen.globalAlpha = 1;
  }

  // Tubes along lines, {line, radii, ink}, the farthest first: each its outline, to both sides of the way. Through
  // one that is not `solid` the others are seen.
  tubes(wanted, solid = false) {
    const found = wanted.map(({ line, radii, ink }) => ({ at: line.map((point) => this.seen(point)), radii, ink }));
    const depth = ({ at }) => at.reduce((sum, { depth }) => sum + depth, 0) / at.length;
    found.sort((one, other) => depth(other) - depth(one));
    for (const { at, radii, ink } of found) this.tube(at, radii, ink, solid);
  }

  tube(line, radii, ink, solid) {
    const { pen } = this, across = [];
    line.forEach((at, k) => {
      const [from, to] = [line[Math.max(0, k - 1)], line[Math.min(line.length - 1, k + 1)]];
      const length = Math.hypot(to.x - from.x, to.y - from.y);
      across.push(length > 1e-3 ? [(from.y - to.y) / length, (to.x - from.x) / length] : across.at(-1) ?? [1, 0]);
    });
    const sides = (share) => {
      const half = line.map((at, k) => share * Math.max(1.2, radii[k] * at.scale));
      const side = (sign) => line.map((at, k) => (
        { x: at.x + sign * half[k] * across[k][0], y: at.y + sign * half[k] * across[k][1] }));
      path(pen, [...side(1), ...side(-1).reverse()]);
      pen.closePath();
    };
    const shades = [[1, 0.3], [0.72, 0.22], [0.4, 0.2]]; // rounder by three of them
    for (const [share, opacity, shade] of [...(solid ? [[1, 1, colour("paper")]] : []), ...shades]) {
      sides(share);
      Object.assign(pen, { fillStyle: shade ?? ink, globalAlpha: opacity });
      pen.fill();
    }
    sides(1);
    Object.assign(pen, { strokeStyle: ink, lineWidth: 1, globalAlpha: 0.9 });
    pen.stroke();
    pen.globalAlpha = 1;
  }

  // The base frame's axes, with their names.
  axes() {
    const long = nice(this.size / 4);
    ["x", "y", "z"].forEach((name, k) => {
      const end = [0, 1, 2].map((axis) => (axis === k ? long : 0)), at = this.seen(end);
      this.line([[0, 0, 0], end], colour("soft"));
      this.pen.fillStyle = colour("soft");
      this.pen.fillText(name, at.x + 3, at.y - 3);
    });
  }

  // A circle about the base on the plane on which it stands.
  ring(radius) {
    const turns = Array.from({ length: 49 }, (_, k) => k * Math.PI / 24);
    this.line(turns.map((angle) => [radius * Math.cos(angle), radius * Math.sin(angle), 0]), colour("line"));
  }

  // A length to scale, in the lower left corner; it holds at the centre's depth.
  ruler() {
    const { pen } = this, { scale } = this.seen(this.centre), long = nice(0.25 * this.width / scale);
    const x = 12, y = this.height - 12;
    path(pen, [{ x, y }, { x: x + long * scale, y }]);
    Object.assign(pen, { strokeStyle: colour("ink"), fillStyle: colour("ink"), lineWidth: 2 });
    pen.stroke();
    pen.fillText(`${+long.toPrecision(1)} mm`, x, y - 6);
  }
}
