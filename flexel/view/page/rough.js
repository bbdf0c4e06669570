// A picture in motion on a machine that draws with its processor: without smoothed edges, which take most of the time. The picture
// at rest has them.

const kCopyVertex = "varying vec2 at; void main() { at = uv; gl_Position = vec4(position.xy, 0.0, 1.0); }";
const kCopyFragment = "uniform sampler2D image; varying vec2 at; void main() { gl_FragColor = texture2D(image, at); }";

export function drawsWithProcessor(context) {
  const names = context.getExtension("WEBGL_debug_renderer_info");
  const name = context.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : context.RENDERER);
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(String(name));
}

export class Rough {
  constructor(renderer) {
    this.renderer = renderer;
    this.target = new THREE.WebGLRenderTarget(1, 1, {stencilBuffer: true});
    this.target.scissorTest = true;
    const material = new THREE.ShaderMaterial({uniforms: {image: {value: this.target.texture}}, vertexShader: kCopyVertex, fragmentShader: kCopyFragment,
                                               blending: THREE.NoBlending, depthTest: false, depthWrite: false});
    this.scene = new THREE.Scene();
    this.scene.add(Object.assign(new THREE.Mesh(new THREE.PlaneBufferGeometry(2, 2), material), {frustumCulled: false}));
    this.camera = new THREE.OrthographicCamera();
  }

  // Pixels; what is drawn from now on goes into the rough picture.
  begin(width, height) {
    if (this.target.width !== width || this.target.height !== height) this.target.setSize(width, height);
    this.room([0, 0, width, height], [0, 0, width, height]);
    this.renderer.clear();
  }
  room(viewport, scissor) {
    this.target.viewport.set(...viewport);
    this.target.scissor.set(...scissor);
    this.renderer.setRenderTarget(this.target);
  }

  // Onto the canvas, all of which is the viewport.
  end() {
    this.renderer.setRenderTarget(null);
    this.renderer.render(this.scene, this.camera);
  }
}
