// Writes the bundle that the reports carry, and three's licence beside it.

import { readFileSync, writeFileSync } from 'node:fs';
import { build } from 'esbuild';

const folder = '../src/page';
const licence = readFileSync('node_modules/three/LICENSE', 'utf8').replaceAll('\r', '').trim();
const { version } = JSON.parse(readFileSync('node_modules/three/package.json', 'utf8'));

await build({
  entryPoints: ['viewer.js'],
  outfile: `${folder}/viewer.min.js`,
  bundle: true,
  minify: true,
  format: 'iife',
  target: 'es2022',
  legalComments: 'inline',
  banner: { js: `/*! Contains three.js ${version}\n\n${licence}\n*/` },
});
writeFileSync(`${folder}/LICENSE-three`, `${licence}\n`);
