// The scene: points, lines by group, paths, the camera of a frame and what it shows.

import {
  createBufferInfoFromArrays,
  createProgramInfo,
  createVertexArrayInfo,
  drawBufferInfo,
  setAttribInfoBufferFromArray,
  setUniforms,
} from "twgl.js";
import { pyramid, throughCamera } from "./camera.js";
import { classesOf, featuresOf, groupOf, poseOf } from "./data.js";
import { Orbit, dot } from "./orbit.js";
import { POINTS, STROKES } from "./shaders.js";
import { rgb } from "./theme.js";

const RECTANGLE = { numComponents: 2, data: [0, -1, 0, 1, 1, -1, 1, 1] };

export class Scene {
  /** Throws where there is no WebGL 2. */
  constructor(canvas, triad, sequence) {
    this.canvas = canvas;
    this.triad = triad;
    this.sequence = sequence;
    this.hidden = new Set(["rays"]);
    this.frame = 0;
    this.follows = false;
    this.orbit = new Orbit(sequence.up, sequence.radius);
    // Kept so that a printed page has the picture.
    const gl = canvas.getContext("webgl2", { antialias: true, alpha: true, preserveDrawingBuffer: true });
    if (!gl) throw new Error("no WebGL 2");
    this.gl = gl;
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => {
      this.make();
      this.draw();
    });
    this.orbit.listen(canvas, () => {
      this.setFollows(false);
      this.draw();
    });
    new ResizeObserver(() => this.drawNow()).observe(canvas);
    this.extent = extent(sequence);
    this.make();
  }

  /** Buffers and programs. */
  make() {
    const { gl, sequence } = this;
    this.pointProgram = createProgramInfo(gl, POINTS);
    this.strokeProgram = createProgramInfo(gl, STROKES);
    for (const program of [this.pointProgram, this.strokeProgram]) {
      if (!program) throw new Error("the graphics do not take the page's shaders");
    }
    this.allPoints = this.dots();
    this.fill(this.allPoints, finitePlaces(sequence.pointPlaces));
    this.seenPoints = this.dots();
    this.pointed = this.dots();

    const segments = new Map();
    sequence.lineGroups.forEach((_, line) => {
      const ends = sequence.linePlaces.subarray(6 * line, 6 * line + 6);
      const group = groupOf(sequence, line);
      if (!segments.has(group)) segments.set(group, []);
      if (ends.every(Number.isFinite)) segments.get(group).push(Array.from(ends));
    });
    this.lines = [...segments].map(([group, all]) => ({
      group,
      name: group ? `group-${sequence.groups.indexOf(group)}` : "ungrouped",
      all: this.strokes(all),
      seen: this.strokes([]),
    }));
    this.paths = sequence.paths.map((path) => {
      const segments = [];
      let before = null;
      for (let frame = 0; frame < sequence.frameIds.length; frame++) {
        const place = path.poses.subarray(7 * frame, 7 * frame + 3);
        const now = place.every(Number.isFinite) ? Array.from(place) : null;
        if (before && now) segments.push([...before, ...now]);
        before = now;
      }
      return this.strokes(segments);
    });
    this.edges = this.strokes(sixes(sequence.edges));
    this.camera = this.strokes([]);
    this.rays = this.strokes([]);
    this.setFrame(this.frame);
  }

  dots() {
    const buffers = createBufferInfoFromArrays(this.gl, {
      place: { numComponents: 3, data: new Float32Array(3), drawType: this.gl.DYNAMIC_DRAW },
    });
    return { buffers, array: createVertexArrayInfo(this.gl, this.pointProgram, buffers), count: 0 };
  }

  fill(dots, places) {
    dots.count = places.length / 3;
    if (dots.count) setAttribInfoBufferFromArray(this.gl, dots.buffers.attribs.place, places);
  }

  /** Strokes from lists of six numbers. */
  strokes(segments) {
    const each = (data, numComponents) => ({
      numComponents,
      data: new Float32Array(data),
      divisor: 1,
      drawType: this.gl.DYNAMIC_DRAW,
    });
    const buffers = createBufferInfoFromArrays(this.gl, {
      corner: RECTANGLE,
      start: each(3, 3),
      end: each(3, 3),
      along: each(1, 1),
    });
    const strokes = { buffers, array: createVertexArrayInfo(this.gl, this.strokeProgram, buffers), count: 0 };
    this.refill(strokes, segments);
    return strokes;
  }

  refill(strokes, segments) {
    strokes.count = segments.length;
    if (!strokes.count) return;
    let travelled = 0;
    let before = null;
    const along = segments.map((ends) => {
      const continues = before && [0, 1, 2].every((axis) => before[3 + axis] === ends[axis]);
      const here = continues ? travelled : 0;
      travelled = here + Math.hypot(ends[3] - ends[0], ends[4] - ends[1], ends[5] - ends[2]);
      before = ends;
      return here;
    });
    const { start, end } = strokes.buffers.attribs;
    setAttribInfoBufferFromArray(this.gl, start, new Float32Array(segments.flatMap((ends) => ends.slice(0, 3))));
    setAttribInfoBufferFromArray(this.gl, end, new Float32Array(segments.flatMap((ends) => ends.slice(3))));
    setAttribInfoBufferFromArray(this.gl, strokes.buffers.attribs.along, new Float32Array(along));
  }

  /** The pose of a frame: the true one, or that of the first estimate which has one. */
  pose() {
    for (const path of this.sequence.paths) {
      const pose = poseOf(path, this.frame);
      if (pose) return pose;
    }
    return null;
  }

  setFrame(frame) {
    this.frame = frame;
    const { sequence } = this;
    const pose = this.pose();
    const camera = sequence.cameras[sequence.frameCameras[frame]];
    const places = [];
    for (const { landmark } of featuresOf(sequence, "points", frame)) {
      places.push(...sequence.pointPlaces.subarray(3 * landmark, 3 * landmark + 3));
    }
    const seen = finitePlaces(places);
    this.fill(this.seenPoints, seen);
    const shown = new Set(featuresOf(sequence, "lines", frame).map(({ landmark }) => landmark));
    for (const { group, seen } of this.lines) {
      const lines = [...shown].filter((line) => groupOf(sequence, line) === group);
      const ends = lines.map((line) => Array.from(sequence.linePlaces.subarray(6 * line, 6 * line + 6)));
      this.refill(seen, ends.filter((numbers) => numbers.every(Number.isFinite)));
    }
    this.refill(this.camera, pose && camera ? pyramid(pose, camera, 0.12 * sequence.radius) : []);
    const rays = [];
    for (let at = 0; pose && at < seen.length; at += 3) rays.push([...pose.place, ...seen.slice(at, at + 3)]);
    this.refill(this.rays, rays);
  }

  /** Marks a landmark, or none. */
  point(feature) {
    const { sequence } = this;
    let places = [];
    if (feature?.kind === "points") {
      places = sequence.pointPlaces.subarray(3 * feature.landmark, 3 * feature.landmark + 3);
    } else if (feature) {
      places = sequence.linePlaces.subarray(6 * feature.landmark, 6 * feature.landmark + 6);
    }
    this.fill(this.pointed, finitePlaces(places));
    this.draw();
  }

  setFollows(follows) {
    if (this.follows !== follows) {
      this.follows = follows;
      this.onFollows?.(follows);
    }
  }

  /** Draws before the next picture of the screen. */
  draw() {
    if (this.waits) return;
    this.waits = requestAnimationFrame(() => {
      this.waits = 0;
      this.drawNow();
    });
  }

  matrix(aspect) {
    this.orbit.fit(this.extent, aspect);
    const camera = this.sequence.cameras[this.sequence.frameCameras[this.frame]];
    const pose = this.pose();
    if (this.follows && camera && pose) return throughCamera(pose, camera, aspect, this.sequence.radius);
    return this.orbit.matrix(aspect);
  }

  drawNow() {
    const { gl, canvas } = this;
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const size = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    if (!size[0] || !size[1]) return;
    if (canvas.width !== size[0] || canvas.height !== size[1]) [canvas.width, canvas.height] = size;
    gl.viewport(0, 0, ...size);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    const shared = { screen_from_scene: this.matrix(size[0] / size[1]), screen: size };
    const shows = (name) => !this.hidden.has(name);

    gl.useProgram(this.strokeProgram.program);
    setUniforms(this.strokeProgram, shared);
    const period = this.sequence.radius / 22;
    const stroke = (strokes, classes, width, opacity = 1, dash = 0) => {
      if (!strokes.count) return;
      setUniforms(this.strokeProgram, { width: width * ratio, colour: [...this.rgb(classes), opacity], period, dash });
      gl.bindVertexArray(strokes.array.vertexArrayObject);
      drawBufferInfo(gl, strokes.array, gl.TRIANGLE_STRIP, 4, 0, strokes.count);
    };
    if (shows("edges")) stroke(this.edges, "faint", 1, 0.8);
    for (const { group, name, all, seen } of this.lines) {
      if (!shows(name)) continue;
      stroke(all, classesOf(group), 1.7, 0.85);
      stroke(seen, classesOf(group), 4.2);
    }
    this.paths.forEach((path, place) => {
      if (!shows(`path-${place}`)) return;
      const { class: classes } = this.sequence.paths[place];
      if (!classes.startsWith("series")) return stroke(path, classes, 1.8);
      const dash = Number(classes.match(/dash-(\d)/)?.[1] ?? 0);
      // An edge tells the path of an estimate from lines of its colour.
      stroke(path, "ink", 3.7, 0.9, dash);
      gl.depthFunc(gl.ALWAYS);
      stroke(path, classes, 2.3, 1, dash);
      gl.depthFunc(gl.LEQUAL);
    });
    if (!this.follows) stroke(this.camera, "truth", 2.2);

    gl.useProgram(this.pointProgram.program);
    setUniforms(this.pointProgram, shared);
    const dot = (dots, classes, width, opacity) => {
      if (!dots.count) return;
      setUniforms(this.pointProgram, { size: width * ratio, colour: [...this.rgb(classes), opacity] });
      gl.bindVertexArray(dots.array.vertexArrayObject);
      drawBufferInfo(gl, dots.array, gl.POINTS, dots.count);
    };
    if (shows("points")) {
      // Fewer points may be larger.
      const width = Math.max(2.4, 6.5 - Math.log10(this.allPoints.count + 1));
      dot(this.allPoints, "quiet", width, 0.6);
      dot(this.seenPoints, "points", width + 2, 1);
    }
    gl.disable(gl.DEPTH_TEST);
    dot(this.pointed, "truth", 12, 0.9);
    if (shows("rays") && !this.follows) {
      gl.useProgram(this.strokeProgram.program);
      stroke(this.rays, "points", 1, 0.35);
    }
    gl.bindVertexArray(null);
    this.drawTriad();
  }

  rgb(classes) {
    this.colours ??= new Map();
    if (!this.colours.has(classes)) this.colours.set(classes, rgb(classes));
    return this.colours.get(classes);
  }

  /** Colours are looked up again, after a change of theme. */
  recolour() {
    this.colours = undefined;
    this.drawNow();
  }

  /** The axes of the world, in a corner. */
  drawTriad() {
    const [right, up] = this.orbit.plane();
    this.triad.style.visibility = this.follows ? "hidden" : "visible";
    ["x", "y", "z"].forEach((name, axis) => {
      const unit = [0, 1, 2].map((other) => (other === axis ? 1 : 0));
      const [across, upward] = [dot(unit, right), dot(unit, up)];
      const line = this.triad.querySelector(`line[data-axis=${name}]`);
      const text = this.triad.querySelector(`text[data-axis=${name}]`);
      line.setAttribute("x2", 24 * across);
      line.setAttribute("y2", -24 * upward);
      text.setAttribute("x", 33 * across);
      text.setAttribute("y", -33 * upward + 4);
      text.style.opacity = Math.hypot(across, upward) > 0.2 ? 1 : 0;
    });
  }
}

/** Places that a look at all of the scene has to show: the first path, and landmarks that are not far away. */
function extent(sequence) {
  const places = [];
  const add = (numbers, stride, count) => {
    const step = Math.max(1, Math.ceil(numbers.length / stride / count)) * stride;
    for (let at = 0; at < numbers.length; at += step) {
      const place = Array.from(numbers.subarray(at, at + 3));
      if (Math.hypot(...place) <= 1.05 * sequence.radius) places.push(place);
    }
  };
  const path = sequence.paths.find((_, place) => sequence.paths[place].poses.some(Number.isFinite));
  if (path) add(path.poses, 7, 1000);
  add(sequence.pointPlaces, 3, 2000);
  add(sequence.linePlaces, 3, 2000);
  return places;
}

function finitePlaces(numbers) {
  const kept = [];
  for (let at = 0; at < numbers.length; at += 3) {
    if (Number.isFinite(numbers[at])) kept.push(numbers[at], numbers[at + 1], numbers[at + 2]);
  }
  return new Float32Array(kept);
}

function sixes(numbers) {
  return Array.from({ length: numbers.length / 6 }, (_, line) => Array.from(numbers.subarray(6 * line, 6 * line + 6)));
}
