// Puts the bunny of the npm package `bunny` into scene.json, with a normal for each vertex: the
// mean of the faces around it, weighed by their area.
//
//     node make_scene.mjs FOLDER OUT.json      FOLDER: where `npm ci` put node_modules
import { createRequire } from 'node:module';
import { readFileSync, writeFileSync } from 'node:fs';
import { resolve } from 'node:path';

const [folder, out] = process.argv.slice(2);
if (!out) {
  console.error('usage: node make_scene.mjs FOLDER OUT.json');
  process.exit(2);
}

const { positions, cells } = createRequire(resolve(folder, 'package.json'))('bunny');

const minus = (a, b) => a.map((value, k) => value - b[k]);
const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];

const normals = positions.map(() => [0, 0, 0]);
for (const cell of cells) {
  const [a, b, c] = cell.map((vertex) => positions[vertex]);
  const twiceArea = cross(minus(b, a), minus(c, a));
  for (const vertex of cell) twiceArea.forEach((value, k) => (normals[vertex][k] += value));
}
const rounded = (value) => Number(value.toFixed(6));
const unit = (v) => v.map((value) => rounded(value / Math.hypot(...v)));

const scene = JSON.parse(readFileSync(new URL('scene.json', import.meta.url), 'utf8'));
for (const object of scene.objects) {
  if (object.type !== 'mesh') continue;
  object.positions = positions.flat();
  object.indices = cells.flat();
  object.normals = normals.flatMap(unit);
}
writeFileSync(out, JSON.stringify(scene));
