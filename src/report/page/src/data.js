// What a sequence's description and block of columns hold, as typed arrays.

const KINDS = { f32: Float32Array, u32: Uint32Array, u16: Uint16Array, u8: Uint8Array };
const NO_DEPTH = 65535;
const NO_GROUP = 65535;

/** The sequence of an explorer. */
export function load(element) {
  const description = JSON.parse(element.querySelector("[data-description]").textContent);
  const block = element.querySelector("[data-block]");
  const bytes = decoded(block.textContent);
  // The text is megabytes that nobody needs twice.
  block.remove();
  const column = ({ kind, offset, length }) => new KINDS[kind](bytes.buffer, offset, length);
  const features = (columns, ends) => {
    const counts = column(columns.counts);
    const starts = new Uint32Array(counts.length + 1);
    counts.forEach((count, frame) => (starts[frame + 1] = starts[frame] + count));
    return {
      ends,
      starts,
      landmarks: column(columns.landmarks),
      pixels: column(columns.pixels),
      depths: columns.depths && column(columns.depths),
      depthStep: columns.depth_step,
    };
  };
  const scene = description.scene;
  return {
    cameras: description.cameras,
    frameIds: description.frame_ids,
    seconds: column(description.seconds),
    frameCameras: column(description.frame_cameras),
    groups: description.groups,
    paths: description.paths.map((path, place) => ({ ...path, poses: column(scene.paths[place]) })),
    radius: scene.radius,
    up: scene.up,
    pointIds: scene.point_ids,
    pointPlaces: column(scene.points),
    lineIds: scene.line_ids,
    linePlaces: column(scene.lines),
    lineGroups: column(scene.line_groups),
    edges: column(scene.edges),
    points: features(description.points, 1),
    lines: features(description.lines, 2),
  };
}

function decoded(base64) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(base64);
  return Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));
}

/** The features of a frame: landmark, ends in pixels, depths in metres (null where none is known). */
export function featuresOf(sequence, kind, frame) {
  const features = sequence[kind];
  const camera = sequence.cameras[sequence.frameCameras[frame]];
  const found = [];
  if (!camera) return found;
  const { from, step } = camera.grid;
  const depth = (place) => {
    const number = features.depths ? features.depths[place] : NO_DEPTH;
    return number === NO_DEPTH ? null : number * features.depthStep;
  };
  for (let row = features.starts[frame]; row < features.starts[frame + 1]; row++) {
    const ends = [];
    for (let end = row * features.ends; end < (row + 1) * features.ends; end++) {
      const [u, v] = [features.pixels[2 * end], features.pixels[2 * end + 1]];
      ends.push({ u: from[0] + step * u, v: from[1] + step * v, depth: depth(end) });
    }
    found.push({ kind, landmark: features.landmarks[row], ends });
  }
  return found;
}

/** For each landmark of a kind the frames that show it: where they begin, and their list. */
export function framesOfLandmarks(sequence, kind) {
  const { starts, landmarks } = sequence[kind];
  const count = kind === "points" ? sequence.pointIds.length : sequence.lineIds.length;
  const begins = new Uint32Array(count + 1);
  for (const landmark of landmarks) begins[landmark + 1]++;
  for (let place = 0; place < count; place++) begins[place + 1] += begins[place];
  const next = begins.slice(0, count);
  const frames = new Uint32Array(landmarks.length);
  for (let frame = 0; frame + 1 < starts.length; frame++) {
    for (let row = starts[frame]; row < starts[frame + 1]; row++) frames[next[landmarks[row]]++] = frame;
  }
  return { begins, frames };
}

/** The pose of a path at a frame: place and rotation matrix (columns), or null. */
export function poseOf(path, frame) {
  const [x, y, z, qx, qy, qz, qw] = path.poses.subarray(7 * frame, 7 * frame + 7);
  const length = Math.hypot(qx, qy, qz, qw);
  if (!Number.isFinite(x + y + z + length) || length === 0) return null;
  const [a, b, c, w] = [qx / length, qy / length, qz / length, qw / length];
  return {
    place: [x, y, z],
    axes: [
      [1 - 2 * (b * b + c * c), 2 * (a * b + w * c), 2 * (a * c - w * b)],
      [2 * (a * b - w * c), 1 - 2 * (a * a + c * c), 2 * (b * c + w * a)],
      [2 * (a * c + w * b), 2 * (b * c - w * a), 1 - 2 * (a * a + b * b)],
    ],
  };
}

/** The group of a line, or null. */
export function groupOf(sequence, line) {
  const place = sequence.lineGroups[line];
  return place === NO_GROUP ? null : sequence.groups[place];
}

/** The classes that give a line its colour. */
export function classesOf(group) {
  return group ? `group-${group.colour}` : "quiet";
}
