// Unpacks the scene that the page carries. `src/report/scene.rs` says how it is packed.

import { BufferAttribute, BufferGeometry } from 'three';

const HALF_CUBE = 1.25;
const MISSING = 255;
const CLAY = [214, 203, 188];
/** Cosine of 55°: edges sharper than this stay sharp, as in the page's pictures. */
const CREASE = 0.5736;

/** The bytes of a base64 text. */
function bytes(text) {
  return Uint8Array.from(atob(text), (sign) => sign.charCodeAt(0));
}

/** Little-endian numbers of 16 bits. */
function words(text) {
  const view = new DataView(bytes(text).buffer);
  return Uint16Array.from({ length: view.byteLength / 2 }, (_, i) => view.getUint16(2 * i, true));
}

/** One geometry with three vertices of its own for each triangle, so that a corner may have its own normal. */
export function geometry(shape) {
  const corners = words(shape.triangles);
  const points = Float32Array.from(words(shape.points), (word) => ((2 * word) / 65535 - 1) * HALF_CUBE);
  const position = new Float32Array(3 * corners.length);
  corners.forEach((v, i) => position.set(points.subarray(3 * v, 3 * v + 3), 3 * i));
  const made = new BufferGeometry();
  made.setAttribute('position', new BufferAttribute(position, 3));
  made.setAttribute('normal', new BufferAttribute(normals(position, corners, points.length / 3), 3));
  return made;
}

/** The normal of a corner is the mean of those around its point that do not differ much from its triangle's. */
function normals(position, corners, pointCount) {
  const areas = areaVectors(position);
  const fans = Array.from({ length: pointCount }, () => []);
  corners.forEach((v, i) => fans[v].push(3 * Math.floor(i / 3)));
  const normal = new Float32Array(position.length);
  corners.forEach((v, i) => {
    const own = 3 * Math.floor(i / 3);
    for (const other of fans[v]) {
      if (dot(areas, own, other) >= CREASE * length(areas, own) * length(areas, other)) {
        for (let k = 0; k < 3; k++) normal[3 * i + k] += areas[other + k];
      }
    }
    const size = length(normal, 3 * i) || 1;
    for (let k = 0; k < 3; k++) normal[3 * i + k] /= size;
  });
  return normal;
}

function areaVectors(position) {
  const areas = new Float32Array(position.length / 3);
  for (let t = 0; t < areas.length; t += 3) {
    const side = (corner) => [0, 1, 2].map((k) => position[3 * t + 3 * corner + k] - position[3 * t + k]);
    const [[a, b, c], [x, y, z]] = [side(1), side(2)];
    areas.set([b * z - c * y, c * x - a * z, a * y - b * x], t);
  }
  return areas;
}

function dot(vectors, i, j) {
  return vectors[i] * vectors[j] + vectors[i + 1] * vectors[j + 1] + vectors[i + 2] * vectors[j + 2];
}

function length(vectors, i) {
  return Math.sqrt(dot(vectors, i, i));
}

/** The same surface with the colours of the distances; a triangle with an unknown corner stays clay. */
export function coloured(geometry, scene) {
  const corners = words(scene.shapes.original.triangles);
  const [distances, table] = [bytes(scene.distances), bytes(scene.colors)];
  const color = new Float32Array(3 * corners.length);
  for (let i = 0; i < corners.length; i++) {
    const first = i - (i % 3);
    const known = [0, 1, 2].every((k) => distances[corners[first + k]] !== MISSING);
    const row = 3 * distances[corners[i]];
    color.set((known ? [...table.subarray(row, row + 3)] : CLAY).map(linear), 3 * i);
  }
  const made = geometry.clone();
  made.setAttribute('color', new BufferAttribute(color, 3));
  return made;
}

/** The light of an sRGB channel. */
function linear(channel) {
  const c = channel / 255;
  return c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
}
