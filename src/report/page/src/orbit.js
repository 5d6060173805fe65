// From where the scene is looked at, and how hands and keys change it.

import { m4 } from "twgl.js";

const FIELD = (40 * Math.PI) / 180;
const TURN = 0.006;
const KEY_TURN = Math.PI / 24;
const KEY_ZOOM = 1.15;

const add = (a, b, scale) => a.map((part, axis) => part + scale * b[axis]);
const dot = (a, b) => a.reduce((sum, part, axis) => sum + part * b[axis], 0);
const cross = ([a, b, c], [d, e, f]) => [b * f - c * e, c * d - a * f, a * e - b * d];

export class Orbit {
  constructor(up, radius) {
    this.up = up;
    this.radius = radius;
    // Two horizontal axes that turn to the third, upward one.
    this.first = Math.abs(up[2]) > 0.5 ? [1, 0, 0] : [0, 0, 1];
    this.second = cross(up, this.first);
    this.reset();
  }

  /** All of the scene, from above at an angle. */
  reset() {
    this.look(-Math.PI / 3, (35 * Math.PI) / 180);
  }

  /** All of the scene, as on a map. */
  top() {
    this.look(-Math.PI / 2, Math.PI / 2);
  }

  look(azimuth, elevation) {
    Object.assign(this, { azimuth, elevation, zoom: 1, target: [0, 0, 0], fitted: false });
  }

  /** Fills the picture with some places, once after each look at all of the scene. */
  fit(places, aspect) {
    if (this.fitted || !places.length) return;
    this.fitted = true;
    // Perspective makes each step a better guess than the one before.
    for (let step = 0; step < 6; step++) {
      const matrix = this.matrix(aspect);
      const [low, high] = [[1e9, 1e9], [-1e9, -1e9]];
      for (const place of places) {
        const screen = m4.transformPoint(matrix, place);
        for (const axis of [0, 1]) {
          low[axis] = Math.min(low[axis], screen[axis]);
          high[axis] = Math.max(high[axis], screen[axis]);
        }
      }
      const middle = [0, 1].map((axis) => (low[axis] + high[axis]) / 2);
      this.move((-middle[0] * aspect) / 2, middle[1] / 2, aspect);
      this.scale(0.9 / Math.max((high[0] - low[0]) / 2, (high[1] - low[1]) / 2, 1e-3));
    }
  }

  outward() {
    const [azimuth, elevation] = [this.azimuth, this.elevation];
    const flat = add(this.first.map((part) => part * Math.cos(azimuth)), this.second, Math.sin(azimuth));
    return add(flat.map((part) => part * Math.cos(elevation)), this.up, Math.sin(elevation));
  }

  /** Axes of the picture: right and up. */
  plane() {
    const right = add(this.second.map((part) => part * Math.cos(this.azimuth)), this.first, -Math.sin(this.azimuth));
    return [right, cross(this.outward(), right)];
  }

  distance(aspect) {
    return (1.02 * this.radius) / Math.sin(FIELD / 2) / Math.min(1, aspect) / this.zoom;
  }

  /** From the scene to the screen. */
  matrix(aspect) {
    const distance = this.distance(aspect);
    const eye = add(this.target, this.outward(), distance);
    const far = distance + 4 * this.radius + Math.hypot(...this.target);
    const projection = m4.perspective(FIELD, aspect, Math.max(distance / 200, far / 5000), far);
    return m4.multiply(projection, m4.inverse(m4.lookAt(eye, this.target, this.plane()[1])));
  }

  turn(across, up) {
    this.azimuth -= across;
    this.elevation = Math.min(Math.PI / 2, Math.max(-Math.PI / 2, this.elevation + up));
  }

  scale(factor) {
    this.zoom = Math.min(200, Math.max(0.1, this.zoom * factor));
  }

  /** Moves what is in the middle by a part of the picture's height. */
  move(across, up, aspect) {
    const size = 2 * this.distance(aspect) * Math.tan(FIELD / 2);
    const [right, upward] = this.plane();
    this.target = add(add(this.target, right, -across * size), upward, up * size);
  }

  /** Lets hands and keys on an element change the view; `changed` is told. */
  listen(element, changed) {
    const hands = new Map();
    const aspect = () => element.clientWidth / element.clientHeight;
    element.addEventListener("pointerdown", (event) => {
      element.setPointerCapture(event.pointerId);
      hands.set(event.pointerId, [event.clientX, event.clientY]);
    });
    for (const name of ["pointerup", "pointercancel"]) {
      element.addEventListener(name, (event) => hands.delete(event.pointerId));
    }
    element.addEventListener("pointermove", (event) => {
      const before = hands.get(event.pointerId);
      if (!before) return;
      const now = [event.clientX, event.clientY];
      const [across, down] = [now[0] - before[0], now[1] - before[1]];
      const other = [...hands].find(([id]) => id !== event.pointerId)?.[1];
      hands.set(event.pointerId, now);
      if (other) {
        const apart = ([x, y]) => Math.hypot(x - other[0], y - other[1]) || 1;
        this.scale(apart(now) / apart(before));
        this.move(across / 2 / element.clientHeight, down / 2 / element.clientHeight, aspect());
      } else if (event.shiftKey || event.buttons & 2) {
        this.move(across / element.clientHeight, down / element.clientHeight, aspect());
      } else {
        this.turn(across * TURN, down * TURN);
      }
      changed();
    });
    element.addEventListener("contextmenu", (event) => event.preventDefault());
    element.addEventListener("wheel", (event) => {
      // Without Ctrl the wheel moves the page, unless the scene is in use.
      if (!event.ctrlKey && document.activeElement !== element) return;
      event.preventDefault();
      this.scale(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)));
      changed();
    }, { passive: false });
    element.addEventListener("keydown", (event) => {
      const keys = {
        ArrowLeft: () => this.turn(-KEY_TURN, 0),
        ArrowRight: () => this.turn(KEY_TURN, 0),
        ArrowUp: () => this.turn(0, KEY_TURN),
        ArrowDown: () => this.turn(0, -KEY_TURN),
        "+": () => this.scale(KEY_ZOOM),
        "=": () => this.scale(KEY_ZOOM),
        "-": () => this.scale(1 / KEY_ZOOM),
        0: () => this.reset(),
        Home: () => this.reset(),
      };
      if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
      keys[event.key]();
      event.preventDefault();
      changed();
    });
  }
}

export { add, cross, dot };
