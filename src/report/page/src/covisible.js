// Which frames share most landmarks with the one that is shown.

import { framesOfLandmarks } from "./data.js";
import { colour } from "./theme.js";

const LISTED = 10;

export class Covisible {
  constructor(canvas, list, sequence, go) {
    Object.assign(this, { canvas, list, sequence, frame: 0, shared: new Uint32Array(0) });
    this.go = go;
    this.shows = ["points", "lines"].map((kind) => [sequence[kind], framesOfLandmarks(sequence, kind)]);
    canvas.addEventListener("click", (event) => {
      const box = canvas.getBoundingClientRect();
      const part = (event.clientX - box.left) / box.width;
      go(Math.max(0, Math.min(this.shared.length - 1, Math.floor(part * this.shared.length))));
    });
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  setFrame(frame) {
    this.frame = frame;
    const shared = new Uint32Array(this.sequence.frameIds.length);
    for (const [{ starts, landmarks }, { begins, frames }] of this.shows) {
      for (let row = starts[frame]; row < starts[frame + 1]; row++) {
        const landmark = landmarks[row];
        for (let at = begins[landmark]; at < begins[landmark + 1]; at++) shared[frames[at]]++;
      }
    }
    this.own = shared[frame];
    shared[frame] = 0;
    this.shared = shared;
    this.fillList();
    this.draw();
  }

  fillList() {
    const others = Array.from(this.shared.keys()).filter((other) => this.shared[other] > 0);
    const apart = (other) => Math.abs(other - this.frame);
    others.sort((a, b) => this.shared[b] - this.shared[a] || apart(a) - apart(b) || a - b);
    const items = others.slice(0, LISTED).map((other) => {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = `frame ${this.sequence.frameIds[other]}: ${this.shared[other]}`;
      button.addEventListener("click", () => this.go(other));
      const item = document.createElement("li");
      item.append(button);
      return item;
    });
    if (!items.length) {
      const item = document.createElement("li");
      item.textContent = "No other frame shows a landmark of this one.";
      items.push(item);
    }
    // Whoever stands on an entry stays on the list.
    const place = [...this.list.children].findIndex((item) => item.contains(document.activeElement));
    this.list.replaceChildren(...items);
    if (place >= 0) this.list.children[Math.min(place, items.length - 1)].querySelector("button")?.focus();
  }

  draw() {
    const { canvas, shared } = this;
    const ratio = devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (!width || !height || !shared.length) return;
    [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
    const context = canvas.getContext("2d");
    const most = shared.reduce((most, number) => Math.max(most, number), 1);
    context.fillStyle = colour("points");
    for (let x = 0; x < canvas.width; x++) {
      const from = Math.floor((x / canvas.width) * shared.length);
      const to = Math.max(from + 1, Math.floor(((x + 1) / canvas.width) * shared.length));
      let number = 0;
      for (let frame = from; frame < to; frame++) number = Math.max(number, shared[frame]);
      const high = (number / most) * (canvas.height - 4);
      context.fillRect(x, canvas.height - high, 1, high);
    }
    context.fillStyle = colour("cursor");
    const x = ((this.frame + 0.5) / shared.length) * canvas.width;
    context.fillRect(x - ratio, 0, 2 * ratio, canvas.height);
  }
}
