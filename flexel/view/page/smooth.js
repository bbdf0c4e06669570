// On a machine that draws with its processor: what is in motion has no smoothed edges, which would take most of the time, and is seen
// from outside only where it can be. The picture at rest is the mean of four, shifted by parts of a pixel.

const kShifts = [[-0.125, -0.375], [0.375, -0.125], [-0.375, 0.125], [0.125, 0.375]];  // pixels
const kMostChecked = 100000;  // triangles

const kCopyVertex = "varying vec2 at; void main() { at = uv; gl_Position = vec4(position.xy, 0.0, 1.0); }";
const kCopyFragment = `
  uniform sampler2D a, b, c, d;
  varying vec2 at;
  void main() { gl_FragColor = 0.25 * (texture2D(a, at) + texture2D(b, at) + texture2D(c, at) + texture2D(d, at)); }`;

export function drawsWithProcessor(canvas) {
  const context = canvas.getContext("webgl");
  const names = context?.getExtension("WEBGL_debug_renderer_info");
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(String(context?.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : context.RENDERER)));
}

export class Smooth {
  constructor(renderer) {
    this.renderer = renderer;
    this.targets = kShifts.map(() => Object.assign(new THREE.WebGLRenderTarget(1, 1, {stencilBuffer: true}), {scissorTest: true}));
    const uniforms = Object.fromEntries(this.targets.map((target, k) => ["abcd"[k], {value: target.texture}]));
    const material = new THREE.ShaderMaterial({uniforms, vertexShader: kCopyVertex, fragmentShader: kCopyFragment,
                                               blending: THREE.NoBlending, depthTest: false, depthWrite: false});
    this.scene = new THREE.Scene();
    this.scene.add(Object.assign(new THREE.Mesh(new THREE.PlaneBufferGeometry(2, 2), material), {frustumCulled: false}));
    this.camera = new THREE.OrthographicCamera();
  }

  // `drawAll(room, shift)` draws everything, each part of it after `room(viewport, scissor)` [pixels of the canvas], shifted by so many
  // pixels. Nobody's viewport is left as it was.
  draw(width, height, drawAll) {
    this.targets.forEach((target, k) => {
      if (target.width !== width || target.height !== height) target.setSize(width, height);
      const room = (viewport, scissor) => {
        target.viewport.set(...viewport);
        target.scissor.set(...scissor);
        this.renderer.setRenderTarget(target);
      };
      room([0, 0, width, height], [0, 0, width, height]);
      this.renderer.clear();
      drawAll(room, kShifts[k]);
    });
    this.renderer.setRenderTarget(null);
  }
  show() { this.renderer.render(this.scene, this.camera); }
}

// Whether nothing of a surface is seen from within: it is closed, and each piece of it looks outwards.
export function looksOutwards({rest: {steps, count}, triangles}) {
  if (triangles.length > 3 * kMostChecked) return false;
  const place = new Map(), at = new Uint32Array(count), edges = new Set(), root = new Uint32Array(count).map((_, p) => p);
  for (let p = 0; p < count; ++p) {
    const key = (steps[3 * p] * 65536 + steps[3 * p + 1]) * 65536 + steps[3 * p + 2];
    if (!place.has(key)) place.set(key, p);
    at[p] = place.get(key);
  }
  const find = p => { while (root[p] !== p) p = root[p] = root[root[p]]; return p; };
  for (let i = 0; i < triangles.length; ++i) {
    const from = at[triangles[i]], to = at[triangles[i % 3 === 2 ? i - 2 : i + 1]], edge = from * count + to;
    if (from === to || edges.has(edge)) return false;
    edges.add(edge);
    root[find(from)] = find(to);
  }
  for (const edge of edges) if (!edges.has(edge % count * count + Math.floor(edge / count))) return false;
  const volume = new Map();
  for (let t = 0; t < triangles.length; t += 3) {
    const [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = [0, 1, 2].map(k => steps.subarray(3 * triangles[t + k], 3 * triangles[t + k] + 3));
    const piece = find(at[triangles[t]]);
    volume.set(piece, (volume.get(piece) ?? 0) + ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx));
  }
  return [...volume.values()].every(value => value > 0);
}
