// The camera of a frame: what it sees as a pyramid, and the scene as it sees it.

import { add, dot } from "./orbit.js";

/** What a camera sees, as far as a depth: eight strokes. */
export function pyramid({ place, axes }, camera, depth) {
  const { width, height, fx, fy, cx, cy, border } = camera;
  const corner = (u, v) => {
    const ray = [(u + border - cx) / fx, (v + border - cy) / fy, 1];
    return ray.reduce((sum, part, axis) => add(sum, axes[axis], part * depth), place);
  };
  const corners = [corner(0, 0), corner(width, 0), corner(width, height), corner(0, height)];
  return corners.flatMap((here, index) => [
    [...place, ...here],
    [...here, ...corners[(index + 1) % 4]],
  ]);
}

/** From the scene to the screen as the camera sees it: `u = fx x/z + cx`, the whole image on the screen. */
export function throughCamera({ place, axes }, camera, aspect, radius) {
  const { width, height, fx, fy, cx, cy, border } = camera;
  const fit = Math.min(1, aspect / (width / height));
  const scale = [(fit * (width / height)) / aspect, fit];
  const [near, far] = [radius / 2000, radius * 8];
  // Rows of the projection of camera space.
  const rows = [
    [(2 * fx * scale[0]) / width, 0, ((2 * (cx - border)) / width - 1) * scale[0], 0],
    [0, (-2 * fy * scale[1]) / height, (1 - (2 * (cy - border)) / height) * scale[1], 0],
    [0, 0, (far + near) / (far - near), (-2 * far * near) / (far - near)],
    [0, 0, 1, 0],
  ];
  const matrix = new Float32Array(16);
  for (let row = 0; row < 4; row++) {
    for (let column = 0; column < 3; column++) {
      matrix[4 * column + row] = [0, 1, 2].reduce((sum, axis) => sum + rows[row][axis] * axes[axis][column], 0);
    }
    const shift = [0, 1, 2].reduce((sum, axis) => sum - rows[row][axis] * dot(axes[axis], place), 0);
    matrix[12 + row] = rows[row][3] + shift;
  }
  return matrix;
}
