// What the graphics run for points and strokes: vertex and fragment shaders.

export const POINTS = [
  `#version 300 es
  in vec3 place;
  uniform mat4 screen_from_scene;
  uniform float size;
  void main() {
    gl_Position = screen_from_scene * vec4(place, 1.0);
    gl_PointSize = size;
  }`,
  `#version 300 es
  precision mediump float;
  uniform vec4 colour;
  out vec4 fragment;
  void main() {
    vec2 from_middle = gl_PointCoord - 0.5;
    if (dot(from_middle, from_middle) > 0.25) discard;
    fragment = colour;
  }`,
];

// A stroke is a rectangle on the screen: thicker lines than WebGL has.
export const STROKES = [
  `#version 300 es
  in vec2 corner;
  in vec3 start;
  in vec3 end;
  in float along;
  uniform mat4 screen_from_scene;
  uniform vec2 screen;
  uniform float width;
  out float travelled;
  void main() {
    vec4 a = screen_from_scene * vec4(start, 1.0);
    vec4 b = screen_from_scene * vec4(end, 1.0);
    float length_m = distance(start, end);
    float from = 0.0, to = 1.0;
    // What is behind the eye is cut off.
    float near_a = a.z + a.w, near_b = b.z + b.w;
    if (near_a < 0.0 && near_b > 0.0) from = near_a / (near_a - near_b);
    if (near_b < 0.0 && near_a > 0.0) to = near_a / (near_a - near_b);
    vec4 first = mix(a, b, from), last = mix(a, b, to);
    vec2 direction = (last.xy / last.w - first.xy / first.w) * screen;
    direction = length(direction) > 0.0 ? normalize(direction) : vec2(1.0, 0.0);
    vec4 here = mix(first, last, corner.x);
    vec2 aside = vec2(-direction.y, direction.x) * corner.y + direction * (corner.x * 2.0 - 1.0) * 0.5;
    here.xy += aside * width / screen * here.w;
    travelled = along + mix(from, to, corner.x) * length_m;
    gl_Position = here;
  }`,
  `#version 300 es
  precision highp float;
  uniform vec4 colour;
  uniform float period;
  uniform int dash;
  in float travelled;
  out vec4 fragment;
  void main() {
    // As the style sheet dashes curves: 1 long, 2 dots, 3 long and a dot.
    float part = fract(travelled / period);
    if (dash == 1 && part > 0.62) discard;
    if (dash == 2 && fract(3.0 * part) > 0.45) discard;
    if (dash == 3 && (part > 0.82 || (part > 0.52 && part < 0.69))) discard;
    fragment = colour;
  }`,
];
