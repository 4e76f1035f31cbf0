// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { NUM_PARTS, NUM_RAMP } from "./palette";

/** Where a sub-map is drawn; hidden ones and those without a place are moved out of sight. */
const partOffset = /* glsl */ `
  uniform sampler2D partPlaces;
  vec3 part_offset(float submap) {
    int index = int(min(submap, 4095.0));
    return texelFetch(partPlaces, ivec2(index & 63, index >> 6), 0).xyz;
  }`;
const nowhere = "vec4(2.0, 2.0, 2.0, 1.0)";

/** The colour of a landmark at a place and a distance from who looks. */
const landmarkTint = /* glsl */ `
  attribute float frame;
  attribute vec2 facts;
  attribute vec4 colour;
  uniform int mode;
  uniform vec2 range;
  uniform vec2 fog;
  uniform vec3 ground;
  uniform vec3 ramp[${NUM_RAMP}];
  uniform vec3 parts[${NUM_PARTS}];
  uniform vec3 ink;
  uniform vec3 down;
  varying vec3 tint;
  vec3 ramped(float value) {
    float x = clamp((value - range.x) / max(range.y - range.x, 1e-6), 0.0, 1.0) * ${NUM_RAMP - 1}.0;
    int i = min(int(x), ${NUM_RAMP - 2});
    return mix(ramp[i], ramp[i + 1], x - float(i));
  }
  vec3 tint_at(vec3 place, float distance) {
    vec3 own = parts[int(mod(facts.y, ${NUM_PARTS}.0))];
    if (mode == 0) own = colour.a > 0.5 ? mix(ink, colour.rgb, 0.85) : mix(ink, ramp[2], 0.5);
    else if (mode == 1) own = ramped(-dot(place, down));
    else if (mode == 2) own = ramped(frame);
    else if (mode == 3) own = ramped(log2(facts.x));
    return mix(own, ground, 0.6 * smoothstep(fog.x, fog.y, distance));
  }`;

export const pointVertex = /* glsl */ `
  uniform vec2 pointSize;
  uniform float worldSize;
  uniform float viewHeight;
  ${landmarkTint}
  ${partOffset}
  void main() {
    if (facts.x < 0.5) { gl_Position = ${nowhere}; gl_PointSize = 0.0; return; }
    vec4 view = modelViewMatrix * vec4(position + part_offset(facts.y), 1.0);
    gl_Position = projectionMatrix * view;
    gl_PointSize = clamp(worldSize * projectionMatrix[1][1] * viewHeight / max(1e-6, -view.z), pointSize.x, pointSize.y);
    tint = tint_at(position, -view.z);
  }`;

/** A piece of the edge that a landmark lies on: each instance is a landmark, `position.x` the end of it (-1 or 1). */
export const edgePointVertex = /* glsl */ `
  attribute vec3 place;
  attribute vec3 half_;
  ${landmarkTint}
  ${partOffset}
  void main() {
    if (facts.x < 0.5 || half_ == vec3(0.0)) { gl_Position = ${nowhere}; return; }
    vec4 view = modelViewMatrix * vec4(place + position.x * half_ + part_offset(facts.y), 1.0);
    gl_Position = projectionMatrix * view;
    tint = tint_at(place, -view.z);
  }`;

export const edgePointFragment = /* glsl */ `
  uniform float dim;
  varying vec3 tint;
  void main() { gl_FragColor = vec4(tint, dim); }`;

/** Squares of markers with their numbers, out of one texture of many cells. */
export const markerVertex = /* glsl */ `
  attribute vec2 cell;
  attribute vec2 corner;
  varying vec2 cell_;
  varying vec2 inside_;
  void main() {
    cell_ = cell;
    inside_ = corner;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  }`;

export const markerFragment = /* glsl */ `
  uniform sampler2D numbers;
  uniform float cells;
  varying vec2 cell_;
  varying vec2 inside_;
  void main() {
    vec2 inside = clamp(inside_, 0.02, 0.98);
    // From behind the number still reads from left to right.
    if (!gl_FrontFacing) inside.x = 1.0 - inside.x;
    gl_FragColor = texture2D(numbers, (floor(cell_ + 0.5) + inside) / cells);
  }`;

/** What stands for a marker that is too far away to be seen: its number, always as large. */
export const markerSignVertex = /* glsl */ `
  attribute vec2 cell;
  attribute float side;
  uniform float signSize;
  uniform float viewHeight;
  varying vec2 cell_;
  void main() {
    cell_ = cell;
    vec4 view = modelViewMatrix * vec4(position, 1.0);
    float shown = side * projectionMatrix[1][1] * viewHeight / max(1e-6, -view.z);
    gl_Position = shown < signSize ? projectionMatrix * view : ${nowhere};
    gl_PointSize = signSize;
  }`;

export const markerSignFragment = /* glsl */ `
  uniform sampler2D numbers;
  uniform float cells;
  varying vec2 cell_;
  void main() {
    vec2 inside = clamp(vec2(gl_PointCoord.x, 1.0 - gl_PointCoord.y), 0.02, 0.98);
    gl_FragColor = texture2D(numbers, (floor(cell_ + 0.5) + inside) / cells);
  }`;

export const pointFragment = /* glsl */ `
  uniform float dim;
  varying vec3 tint;
  void main() {
    vec2 d = gl_PointCoord - 0.5;
    if (dot(d, d) > 0.25) discard;
    gl_FragColor = vec4(tint, dim);
  }`;

/** Outlines of cameras: each instance is a keyframe, `position` holds (point of the outline, camera of the rig). */
export const glyphVertex = /* glsl */ `
  attribute vec3 place;
  attribute vec4 rotation;
  attribute vec2 facts;
  attribute vec3 ring;
  uniform sampler2D cameras;
  uniform float rigs;
  uniform float size;
  uniform float smallest;
  uniform float largest;
  uniform float isSphere;
  uniform int selected;
  uniform vec3 colour;
  uniform vec3 selectedColour;
  uniform bool byPart;
  uniform vec3 parts[${NUM_PARTS}];
  varying vec3 tint;
  varying float strength;
  ${partOffset}
  vec3 rotated(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }
  void main() {
    int rig = int(facts.x), first = int(position.y) * 5;
    gl_Position = ${nowhere};
    if (facts.x >= rigs) return;
    vec4 camera = texelFetch(cameras, ivec2(first, rig), 0);
    if (camera.w < 0.0 || abs(camera.w - isSphere) > 0.5) return;
    bool isSelected = gl_InstanceID == selected;
    vec3 origin = place + part_offset(facts.y);
    vec4 centre = modelViewMatrix * vec4(origin, 1.0);
    float seen = max(0.0, -centre.z) / projectionMatrix[1][1];
    float scale = clamp(size * (isSelected ? 1.5 : 1.0), smallest * seen, largest * seen);
    vec3 point = ring * 0.6;
    if (isSphere < 0.5 && position.x > 0.5) point = texelFetch(cameras, ivec2(first + int(position.x), rig), 0).xyz;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(origin + rotated(rotation, camera.xyz + scale * point), 1.0);
    tint = isSelected ? selectedColour : byPart ? parts[int(mod(facts.y, ${NUM_PARTS}.0))] : colour;
    strength = isSelected ? 1.0 : isSphere < 0.5 && position.x < 0.5 ? 0.95 : 0.6;
  }`;

export const glyphFragment = /* glsl */ `
  varying vec3 tint;
  varying float strength;
  void main() { gl_FragColor = vec4(tint, strength); }`;

export const edgeVertex = /* glsl */ `
  attribute vec2 facts;
  ${partOffset}
  void main() { gl_Position = projectionMatrix * modelViewMatrix * vec4(position + part_offset(facts.y), 1.0); }`;

export const plainVertex = /* glsl */ `
  uniform float dotSize;
  void main() {
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
    gl_PointSize = dotSize;
  }`;

export const plainFragment = /* glsl */ `
  uniform vec3 colour;
  uniform float opacity;
  void main() { gl_FragColor = vec4(colour, opacity); }`;

/** A thick line from frame to frame: each instance is a segment, `position` its corner (0 or 1 along, -1 or 1 across). */
export const trailVertex = /* glsl */ `
  attribute vec3 from;
  attribute vec3 to;
  attribute vec2 fromFacts;
  attribute vec2 toFacts;
  uniform vec2 viewport;
  uniform float width;
  uniform int cursor;
  uniform vec3 colour;
  uniform vec3 filledColour;
  varying vec4 tint;
  ${partOffset}
  void main() {
    gl_Position = ${nowhere};
    if (fromFacts.x < 0.5 || toFacts.x < 0.5 || fromFacts.y != toFacts.y) return;
    vec3 offset = part_offset(fromFacts.y);
    vec4 a = modelViewMatrix * vec4(from + offset, 1.0), b = modelViewMatrix * vec4(to + offset, 1.0);
    float near = -1e-4;
    if (a.z > near && b.z > near) return;
    if (a.z > near) a = mix(a, b, (a.z - near) / (a.z - b.z));
    if (b.z > near) b = mix(b, a, (b.z - near) / (b.z - a.z));
    vec4 p = projectionMatrix * a, q = projectionMatrix * b;
    vec2 along = (q.xy / q.w - p.xy / p.w) * viewport;
    float length_px = length(along);
    along = length_px > 1e-4 ? along / length_px : vec2(1.0, 0.0);
    vec4 end = position.x < 0.5 ? p : q;
    vec2 shift = vec2(-along.y, along.x) * position.y + along * (position.x < 0.5 ? -0.5 : 0.5);
    end.xy += shift * width / viewport * end.w;
    end.z -= 1e-4 * end.w;
    gl_Position = end;
    bool isFilled = fromFacts.x > 2.5 && fromFacts.x < 3.5;
    tint = vec4(isFilled ? filledColour : colour, gl_InstanceID < cursor ? 1.0 : 0.28);
  }`;

export const trailFragment = /* glsl */ `
  varying vec4 tint;
  void main() { gl_FragColor = tint; }`;

export const gridVertex = /* glsl */ `
  varying vec2 ground;
  void main() {
    vec4 world = modelMatrix * vec4(position, 1.0);
    ground = world.xz;
    vec4 view = viewMatrix * world;
    gl_Position = projectionMatrix * view;
  }`;

export const gridFragment = /* glsl */ `
  uniform vec3 colour;
  uniform float spacing;
  uniform float reach;
  uniform vec2 centre;
  varying vec2 ground;
  float lines(float step_) {
    vec2 cell = ground / step_;
    vec2 width = fwidth(cell);
    vec2 d = abs(fract(cell - 0.5) - 0.5) / max(width, vec2(1e-6));
    float line = 1.0 - min(min(d.x, d.y), 1.0);
    return line * (1.0 - smoothstep(0.15, 0.6, max(width.x, width.y)));
  }
  void main() {
    float fade = 1.0 - smoothstep(0.35, 1.0, length(ground - centre) / reach);
    float alpha = max(0.4 * lines(spacing), 0.8 * lines(10.0 * spacing)) * fade;
    if (alpha < 0.004) discard;
    gl_FragColor = vec4(colour, alpha);
  }`;
