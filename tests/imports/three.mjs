// Models in three.js, in headless Chromium: node three.mjs FOLDER < JOBS    FOLDER: with node_modules
//
// A line of stdin is a job, {model (a GLB below node_modules), picture, size, background, camera {position,
// target, fov}, lights [{direction, intensity}]}: numbers as our scene has them. The model is drawn
// with all of its textures, and its picture is written as PNG.
import { createRequire } from 'node:module';
import { readFileSync, writeFileSync } from 'node:fs';
import { extname, resolve } from 'node:path';
import { createInterface } from 'node:readline';

const folder = process.argv[2];
const { chromium } = createRequire(resolve(folder, 'package.json'))('playwright-core');

// Runs in the page. Light that shows white as white has the intensity pi there.
async function draw(job) {
  const THREE = await import('three');
  const { GLTFLoader } = await import('http://models/three/examples/jsm/loaders/GLTFLoader.js');
  const { scene: model } = await new GLTFLoader().loadAsync(`http://models/${job.model}`);
  model.traverse((one) => {
    if (!one.isMesh) return;
    one.material.vertexColors = false;
    one.material.side = THREE.DoubleSide;
    one.material.needsUpdate = true;
    for (const map of Object.values(one.material)) if (map?.isTexture) map.anisotropy = 16;
  });
  const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
  renderer.setPixelRatio(1);
  renderer.setSize(job.size, job.size);
  const world = new THREE.Scene();
  world.background = new THREE.Color().setRGB(job.background, job.background, job.background);
  world.add(model);
  const { position, target, fov } = job.camera;
  const far = Math.hypot(...position.map((v, i) => v - target[i]));
  const camera = new THREE.PerspectiveCamera(fov, 1, far / 1000, far * 10);
  camera.position.set(...position);
  camera.lookAt(...target);
  for (const { direction, intensity } of job.lights) {
    const light = new THREE.DirectionalLight(0xffffff, Math.PI * intensity);
    light.position.set(...direction.map((v) => -v));
    world.add(light);
  }
  renderer.render(world, camera);
  return renderer.domElement.toDataURL('image/png').split(',')[1];
}

const browser = await chromium.launch({
  executablePath: '/usr/bin/chromium',
  args: ['--no-sandbox', '--enable-unsafe-swiftshader', '--use-angle=swiftshader'],
});
try {
  const page = await browser.newPage();
  page.setDefaultTimeout(120e3);
  const types = { '.html': 'text/html', '.js': 'text/javascript', '.glb': 'model/gltf-binary' };
  const start = `<!doctype html><title>models</title><script type="importmap">
    {"imports": {"three": "http://models/three/build/three.module.js"}}</script>`;
  await page.route('http://models/**', (route) => {
    const name = new URL(route.request().url()).pathname.slice(1) || 'index.html';
    const body = name === 'index.html' ? start : readFileSync(resolve(folder, 'node_modules', name));
    return route.fulfill({ body, contentType: types[extname(name)] });
  });
  page.on('console', (message) => console.error(message.text()));
  await page.goto('http://models/');
  for await (const line of createInterface({ input: process.stdin })) {
    const job = JSON.parse(line);
    writeFileSync(job.picture, Buffer.from(await page.evaluate(draw, job), 'base64'));
  }
} finally {
  await browser.close();
}
