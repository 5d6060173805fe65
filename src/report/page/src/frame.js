// One frame's measurements in image coordinates.

import { classesOf, featuresOf, groupOf } from "./data.js";
import { colour } from "./theme.js";

/** How near a hand has to be, CSS pixels. */
const REACH = 14;
/** Room about the image, as a part of its width. */
const MARGIN = 0.03;
const MOST_ROWS = 400;

export class FrameView {
  /** `pointed` is told the feature that is pointed at, or null. */
  constructor(canvas, sequence, words, table, pointed) {
    Object.assign(this, { canvas, sequence, words, table, pointed, features: [], chosen: -1, frame: 0 });
    new ResizeObserver(() => this.draw()).observe(canvas);
    canvas.addEventListener("pointermove", (event) => this.choose(this.nearest(event)));
    canvas.addEventListener("pointerdown", (event) => this.choose(this.nearest(event)));
    canvas.addEventListener("pointerleave", () => this.choose(-1));
    canvas.addEventListener("keydown", (event) => {
      const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
      if (!step || !this.features.length) return;
      event.preventDefault();
      const count = this.features.length;
      this.choose(this.chosen < 0 ? (step > 0 ? 0 : count - 1) : (this.chosen + step + count) % count);
    });
    table.closest("details").addEventListener("toggle", () => this.fillTable());
  }

  get camera() {
    return this.sequence.cameras[this.sequence.frameCameras[this.frame]];
  }

  setFrame(frame) {
    this.frame = frame;
    const { sequence } = this;
    this.features = [...featuresOf(sequence, "lines", frame), ...featuresOf(sequence, "points", frame)];
    this.choose(-1);
    this.fillTable();
    this.draw();
  }

  /** From the image to the canvas, CSS pixels. */
  fit() {
    const { width, height } = this.camera;
    const margin = MARGIN * width;
    const scale = Math.min(
      this.canvas.clientWidth / (width + 2 * margin),
      this.canvas.clientHeight / (height + 2 * margin),
    );
    const left = (this.canvas.clientWidth - scale * width) / 2 - scale * this.camera.border;
    const top = (this.canvas.clientHeight - scale * height) / 2 - scale * this.camera.border;
    return { scale, place: ({ u, v }) => [left + scale * u, top + scale * v] };
  }

  nearest(event) {
    if (!this.camera) return -1;
    const box = this.canvas.getBoundingClientRect();
    const here = [event.clientX - box.left, event.clientY - box.top];
    const { place } = this.fit();
    let [best, least] = [-1, REACH];
    this.features.forEach((feature, index) => {
      const ends = feature.ends.map(place);
      // Of a point and a segment that are as near, the point is meant.
      const apart = distance(here, ends[0], ends[1] ?? ends[0]) + (ends.length - 1) * 3;
      if (apart < least) [best, least] = [index, apart];
    });
    return best;
  }

  choose(index) {
    if (this.chosen === index) return;
    this.chosen = index;
    const feature = this.features[index];
    this.words.textContent = feature ? this.describe(feature) : "Point at a measurement to read its id.";
    this.pointed(feature ?? null);
    this.draw();
  }

  id({ kind, landmark }) {
    return kind === "points" ? `point ${this.sequence.pointIds[landmark]}` : `line ${this.sequence.lineIds[landmark]}`;
  }

  describe(feature) {
    const at = feature.ends.map(({ u, v, depth }) => {
      const far = depth === null ? "" : `, depth ${depth.toFixed(3)} m`;
      return `u ${u.toFixed(1)}, v ${v.toFixed(1)} px${far}`;
    });
    const group =
      feature.kind === "points" ? "" : `; ${groupOf(this.sequence, feature.landmark)?.name ?? "in no group"}`;
    return `${this.id(feature)}: ${at.join(" to ")}${group}`;
  }

  fillTable() {
    if (!this.table.closest("details").open) return;
    const rows = this.features.slice(0, MOST_ROWS).map((feature) => {
      const cells = [this.id(feature)];
      for (const { u, v, depth } of feature.ends) {
        cells.push(u.toFixed(2), v.toFixed(2), depth === null ? "–" : depth.toFixed(3));
      }
      while (cells.length < 7) cells.push("");
      return cells;
    });
    const header = ["landmark", "u, px", "v, px", "depth, m", "end u, px", "end v, px", "end depth, m"];
    const table = document.createElement("table");
    const add = (cells, name, scope) => {
      const row = document.createElement("tr");
      cells.forEach((text, place) => {
        const cell = document.createElement(place === 0 || name === "th" ? "th" : "td");
        if (cell.tagName === "TH") cell.scope = name === "th" ? "col" : scope;
        cell.textContent = text;
        row.append(cell);
      });
      return row;
    };
    const head = table.createTHead();
    head.append(add(header, "th"));
    const body = table.createTBody();
    rows.forEach((cells) => body.append(add(cells, "td", "row")));
    const left = this.features.length - rows.length;
    this.table.replaceChildren(table, left > 0 ? `and ${left} more` : "");
  }

  draw() {
    const { canvas, camera } = this;
    const ratio = devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (!width || !height) return;
    [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
    const context = canvas.getContext("2d");
    context.scale(ratio, ratio);
    if (!camera) {
      context.fillStyle = colour("ink");
      context.font = "15px system-ui, sans-serif";
      context.fillText("The camera of this frame is not known.", 16, 32);
      return;
    }
    const { scale, place } = this.fit();
    const [left, top] = place({ u: camera.border, v: camera.border });
    context.fillStyle = colour("image");
    context.strokeStyle = colour("line");
    context.lineWidth = 1;
    context.fillRect(left, top, scale * camera.width, scale * camera.height);
    context.strokeRect(left, top, scale * camera.width, scale * camera.height);
    const looked = new Map();
    const look = (classes) => looked.get(classes) ?? looked.set(classes, colour(classes)).get(classes);
    context.lineCap = "round";
    for (const [index, feature] of this.features.entries()) {
      const chosen = index === this.chosen;
      const ends = feature.ends.map(place);
      if (feature.kind === "lines") {
        context.strokeStyle = look(classesOf(groupOf(this.sequence, feature.landmark)));
        context.lineWidth = chosen ? 5 : 2.6;
        context.beginPath();
        context.moveTo(...ends[0]);
        context.lineTo(...ends[1]);
        context.stroke();
      } else {
        context.fillStyle = look("points");
        context.beginPath();
        context.arc(...ends[0], chosen ? 6 : Math.max(2.2, Math.min(3.4, scale * 4.5)), 0, 2 * Math.PI);
        context.fill();
        if (chosen) {
          context.strokeStyle = look("ink");
          context.lineWidth = 2;
          context.stroke();
        }
      }
    }
  }
}

/** How far a place is from a segment. */
function distance([x, y], [ax, ay], [bx, by]) {
  const [dx, dy] = [bx - ax, by - ay];
  const square = dx * dx + dy * dy;
  const part = square ? Math.min(1, Math.max(0, ((x - ax) * dx + (y - ay) * dy) / square)) : 0;
  return Math.hypot(x - ax - part * dx, y - ay - part * dy);
}
