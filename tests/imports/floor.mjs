// A checkered floor in three.js, in headless Chromium: node floor.mjs FOLDER < JOBS    FOLDER: with node_modules
//
// A line of stdin is a job, {width, height, fov, position, target, angle (of the checks, degrees), texels (of the
// texture, a side of a check), anisotropy, samples (of multisampling), times (it is drawn larger, and averaged)}.
// It is answered by a line {renderer, version, most (anisotropy), values: rows from above of light in [0, 1]}.
import { createRequire } from 'node:module';
import { readFileSync } from 'node:fs';
import { resolve } from 'node:path';
import { createInterface } from 'node:readline';

const folder = process.argv[2];
const { chromium } = createRequire(resolve(folder, 'package.json'))('playwright-core');

// Runs in the page. Light is linear throughout, in floats where the target may hold them.
async function draw(job) {
  const THREE = await import('http://floor/three.module.js');
  window.renderer ??= new THREE.WebGLRenderer({ antialias: false });
  const side = 2 * job.texels;
  const texels = new Uint8Array(4 * side * side);
  for (let i = 0; i < side * side; i++) {
    const odd = ((i % side) / job.texels | 0) + (i / side / job.texels | 0) & 1;
    texels.fill(odd ? 255 : 0, 4 * i, 4 * i + 4);
  }
  const map = new THREE.DataTexture(texels, side, side);
  map.wrapS = map.wrapT = THREE.RepeatWrapping;
  map.magFilter = THREE.LinearFilter;
  map.minFilter = THREE.LinearMipmapLinearFilter;
  map.generateMipmaps = true;
  map.anisotropy = job.anisotropy;
  map.needsUpdate = true;
  // In squares that are the larger the farther they are: numbers along one of all are too coarse.
  const lines = [0, ...Array.from({ length: 49 }, (_, i) => 2 ** (i / 4 - 0.5))];
  const across = [...lines.slice(1).map((x) => -x).reverse(), ...lines];
  const turn = (job.angle * Math.PI) / 180;
  const positions = [], uvs = [], indices = [];
  for (const z of across)
    for (const x of across) {
      positions.push(x, 0, z);
      uvs.push((Math.cos(turn) * x + Math.sin(turn) * z) / 2, (Math.sin(turn) * x - Math.cos(turn) * z) / 2);
    }
  const row = across.length;
  for (let i = 0; i < row * (row - 1); i++)
    if ((i + 1) % row) indices.push(i, i + row, i + 1, i + 1, i + row, i + row + 1);
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.Float32BufferAttribute(positions, 3));
  geometry.setAttribute('uv', new THREE.Float32BufferAttribute(uvs, 2));
  geometry.setIndex(indices);
  const world = new THREE.Scene();
  world.add(new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ map })));
  const camera = new THREE.PerspectiveCamera(job.fov, job.width / job.height, 0.01, 1e4);
  camera.position.set(...job.position);
  camera.lookAt(...job.target);
  const [width, height] = [job.width * job.times, job.height * job.times];
  const target = new THREE.WebGLRenderTarget(width, height, { type: THREE.FloatType, samples: job.samples });
  window.renderer.setRenderTarget(target);
  window.renderer.render(world, camera);
  const pixels = new Float32Array(4 * width * height);
  window.renderer.readRenderTargetPixels(target, 0, 0, width, height, pixels);
  const values = new Array(job.width * job.height).fill(0);
  for (let y = 0; y < height; y++)
    for (let x = 0; x < width; x++) {
      const at = (job.height - 1 - Math.floor(y / job.times)) * job.width + Math.floor(x / job.times);
      values[at] += pixels[4 * (y * width + x)] / job.times ** 2;
    }
  for (const thing of [target, map, geometry]) thing.dispose();
  const gl = window.renderer.getContext();
  const info = gl.getExtension('WEBGL_debug_renderer_info');
  return { renderer: gl.getParameter(info.UNMASKED_RENDERER_WEBGL), version: THREE.REVISION, error: gl.getError(),
           most: window.renderer.capabilities.getMaxAnisotropy(), values };
}

const browser = await chromium.launch({
  executablePath: '/usr/bin/chromium',
  args: ['--no-sandbox', '--enable-unsafe-swiftshader', '--use-angle=swiftshader'],
});
try {
  const page = await browser.newPage();
  page.setDefaultTimeout(120e3);
  await page.route('http://floor/**', (route) => {
    const name = new URL(route.request().url()).pathname.slice(1);
    const body = name ? readFileSync(resolve(folder, 'node_modules/three/build', name))
                      : '<!doctype html><title>floor</title>';
    return route.fulfill({ body, contentType: name ? 'text/javascript' : 'text/html' });
  });
  page.on('console', (message) => console.error(message.text()));
  await page.goto('http://floor/');
  for await (const line of createInterface({ input: process.stdin }))
    console.log(JSON.stringify(await page.evaluate(draw, JSON.parse(line))));
} finally {
  await browser.close();
}
