// three.js in headless Chromium: node three.mjs FOLDER < SCENE.json    FOLDER: with node_modules
//
// SCENE.json is one line: {size, fov, eye, segments (around the sphere), shader (phong.glsl with what
// goes before it), uniforms {NAME: [values]}}. It prints a line {"renderer", "version", "first"} when the first picture is there, "first" being seconds since
// this program began. Then each further line of stdin asks for figures:
//
//     {"frames": N, "type": "image/png", "quality": 0.9}
//
// and is answered by {"frame": [seconds], "blob": [seconds], "bytes", "picture" (base64)}: "blob" is
// from before render() until the encoded picture is there, "frame" until its pixels could be read. The canvas is in no document: nothing else is drawn.
import { createRequire } from 'node:module';
import { readFileSync } from 'node:fs';
import { resolve } from 'node:path';
import { createInterface } from 'node:readline';

const folder = process.argv[2];
const { chromium } = createRequire(resolve(folder, 'package.json'))('playwright-core');
const lines = createInterface({ input: process.stdin })[Symbol.asyncIterator]();
const scene = JSON.parse((await lines.next()).value);
const say = (value) => console.log(JSON.stringify(value));

// Runs in the page. The sphere is a mesh, as usual with three.js; its normals are interpolated and
// made unit vectors, positions are projected to the sphere's surface.
async function setUp(scene) {
  const THREE = await import('http://bench/three.module.js');
  const renderer = new THREE.WebGLRenderer({ antialias: false });
  renderer.setPixelRatio(1);
  renderer.setSize(scene.size, scene.size);
  const camera = new THREE.PerspectiveCamera(scene.fov, 1, 0.1, 100);
  camera.position.set(0, 0, scene.eye);
  const material = new THREE.ShaderMaterial({
    glslVersion: THREE.GLSL3,
    uniforms: Object.fromEntries(
      Object.entries(scene.uniforms).map(([name, values]) => [
        name,
        { value: values.map((v) => (Array.isArray(v) ? new THREE.Vector3(...v) : v)) },
      ]),
    ),
    vertexShader: `
      out vec3 direction;
      void main() {
        direction = normal;
        gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
      }`,
    fragmentShader: `${scene.shader}
      in vec3 direction;
      layout(location = 0) out vec4 pixel;
      #define gl_FragColor pixel
      void main() {
        vec3 N = normalize(direction);
        gl_FragColor = vec4(phong(N, N, normalize(vec3(0.0, 0.0, ${scene.eye}.0) - N)), 1.0);
        #include <colorspace_fragment>
      }`,
  });
  for (const uniform of Object.values(material.uniforms))
    if (uniform.value.length === 1) uniform.value = uniform.value[0];
  const world = new THREE.Scene();
  world.background = new THREE.Color(0, 0, 0);
  world.add(new THREE.Mesh(new THREE.SphereGeometry(1, scene.segments, scene.segments / 2), material));

  const gl = renderer.getContext();
  const canvas = renderer.domElement;
  const pixel = new Uint8Array(4);
  const blob = (type, quality) => new Promise((done) => canvas.toBlob(done, type, quality));
  window.measure = async ({ frames, type, quality }) => {
    const frame = [], whole = [];
    let picture;
    for (let i = -8; i < frames; i++) {
      let began = performance.now();
      renderer.render(world, camera);
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel); // waits until it is drawn
      if (i >= 0) frame.push((performance.now() - began) / 1e3);
      began = performance.now();
      renderer.render(world, camera);
      picture = await blob(type, quality);
      if (i >= 0) whole.push((performance.now() - began) / 1e3);
    }
    const bytes = new Uint8Array(await picture.arrayBuffer());
    let text = '';
    for (const byte of bytes) text += String.fromCharCode(byte);
    return { frame, blob: whole, bytes: bytes.length, picture: btoa(text) };
  };
  renderer.render(world, camera);
  await (await blob('image/png')).arrayBuffer();
  const info = gl.getExtension('WEBGL_debug_renderer_info');
  return {
    renderer: gl.getParameter(info.UNMASKED_RENDERER_WEBGL),
    version: THREE.REVISION,
  };
}

const browser = await chromium.launch({
  executablePath: new URL('chromium', import.meta.url).pathname,
  args: ['--no-sandbox', '--enable-unsafe-swiftshader', '--use-angle=swiftshader'],
});
try {
  const page = await browser.newPage();
  const types = { html: 'text/html', js: 'text/javascript' };
  await page.route('http://bench/**', (route) => {
    const name = new URL(route.request().url()).pathname.slice(1) || 'index.html';
    const body = name === 'index.html'
      ? '<!doctype html><title>bench</title>'
      : readFileSync(resolve(folder, 'node_modules/three/build', name));
    return route.fulfill({ body, contentType: types[name.split('.').pop()] });
  });
  page.on('console', (message) => console.error(message.text()));
  await page.goto('http://bench/');
  const about = await page.evaluate(setUp, scene);
  say({ ...about, browser: browser.version(), first: performance.now() / 1e3 });
  for await (const line of lines)
    say(await page.evaluate((wish) => window.measure(wish), JSON.parse(line)));
} finally {
  await browser.close();
}
