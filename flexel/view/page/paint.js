// What makes triangles and lines visible: the palette, the materials.

const kClip = `
  uniform vec4 plane;
  uniform bool cut;
  varying vec3 place;
  bool cutAway() { return cut && dot(plane.xyz, place) > plane.w; }`;

// What is not asked for is not compiled: a processor that draws spends most of its time here.
const kSurfaceVertex = `
  #ifdef COLOURED
  attribute float value;
  varying float shownValue;
  #else
  attribute vec3 tint;
  varying vec3 ownColour;
  #endif
  #ifdef CUT
  varying vec3 place;
  #endif
  uniform float lift;
  varying vec3 side;
  void main() {
    #ifdef CUT
    place = position;
    #endif
    side = normalMatrix * normal;
    #ifdef COLOURED
    shownValue = value;
    #else
    ownColour = tint;
    #endif
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
    gl_Position.z -= lift * gl_Position.w;
  }`;

// The matter that a section shows is what is seen of the far side from within: it is hatched, not lit. Lines
// keep off it, by the stencil.
const kSurfaceFragment = `
  #ifdef CUT
  ${kClip}
  #endif
  uniform sampler2D palette;
  uniform float low, high, steps, opacity, hatch;
  uniform int outside;  // 0: the end's colour, 1: grey, 2: nothing
  uniform bool logarithmic;
  uniform vec3 nothing, section;
  varying vec3 side;
  #ifdef COLOURED
  varying float shownValue;
  vec3 paint() {
    if (abs(shownValue) > 1e29) return nothing;
    float at = logarithmic ? log(max(shownValue, 1e-37) / low) / log(high / low) : (shownValue - low) / (high - low);
    if ((at < -1e-4 || at > 1.0001) && outside > 0) {
      if (outside == 2) discard;
      return nothing;
    }
    at = clamp(at, 0.0, 1.0);
    if (steps > 0.0) at = (min(floor(at * steps), steps - 1.0) + 0.5) / steps;
    return texture2D(palette, vec2((at * 255.0 + 0.5) / 256.0, 0.5)).rgb;
  }
  #else
  varying vec3 ownColour;
  vec3 paint() { return ownColour; }
  #endif
  void main() {
    #ifdef CUT
    if (cutAway()) discard;
    #endif
    #ifdef INSIDE
    float line = mod(gl_FragCoord.x + gl_FragCoord.y, hatch) < 0.16 * hatch ? 0.72 : 1.0;
    gl_FragColor = vec4(section * line, opacity);
    #else
    vec3 n = normalize(side);
    if (n.z < 0.0) n = -n;
    float lamp = max(dot(n, normalize(vec3(-0.45, 0.62, 0.75))), 0.0);
    float fill = max(dot(n, normalize(vec3(0.7, -0.1, 0.5))), 0.0);
    float light = 0.74 + 0.27 * lamp + 0.08 * fill;
    float gleam = pow(max(dot(n, normalize(vec3(-0.24, 0.33, 0.92))), 0.0), 40.0);
    gl_FragColor = vec4(paint() * light + 0.06 * gleam, opacity);
    #endif
  }`;

// Lines lie on surfaces: `lift` (of the depth that is seen) lets them win.
const kLineVertex = `
  uniform float lift;
  varying vec3 place;
  void main() {
    place = position;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
    gl_Position.z -= lift * gl_Position.w;
  }`;

const kLineFragment = kClip + `
  uniform vec3 ink;
  uniform float opacity;
  void main() {
    if (cutAway()) discard;
    gl_FragColor = vec4(ink, opacity);
  }`;

export function colourOf(hex) {
  return new THREE.Vector3(...[1, 3, 5].map(at => parseInt(hex.slice(at, at + 2), 16) / 255));
}

function paletteTexture(palette) {
  const bytes = new Uint8Array(palette.flatMap(hex => [...colourOf(hex).toArray().map(c => Math.round(255 * c)), 255]));
  const texture = new THREE.DataTexture(bytes, palette.length, 1, THREE.RGBAFormat);
  texture.magFilter = texture.minFilter = THREE.LinearFilter;
  texture.needsUpdate = true;
  return texture;
}

// Uniforms that all materials of one panel share.
export function clipUniforms() {
  return {plane: {value: new THREE.Vector4(0, 0, 1, 0)}, cut: {value: false}};
}

// Uniforms that all panels share.
export function colourUniforms(colours) {
  return {
    palette: {value: paletteTexture(colours.palette)},
    low: {value: 0}, high: {value: 1}, steps: {value: 0}, hatch: {value: 8},
    outside: {value: 0}, logarithmic: {value: false},
    nothing: {value: colourOf(colours.nothing)}, section: {value: colourOf("#c9ced6")},
  };
}

export function surfaceMaterial(colours, clip) {
  return new THREE.ShaderMaterial({
    uniforms: {...colours, ...clip, opacity: {value: 1}, lift: {value: 0}},
    vertexShader: kSurfaceVertex, fragmentShader: kSurfaceFragment, defines: {}, side: THREE.DoubleSide,
    polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 2,
  });
}

// Compiles a surface's shaders anew where it is no longer, or not yet, coloured or cut.
export function specialise(material, {coloured, cut}) {
  for (const [name, on] of [["COLOURED", coloured], ["CUT", cut]]) {
    if (on === (name in material.defines)) continue;
    if (on) material.defines[name] = true;
    else delete material.defines[name];
    material.needsUpdate = true;
  }
}

// Of a surface that is cut: the side that is seen from without, or that from within.
export function cutMaterial(colours, clip, side) {
  const material = surfaceMaterial(colours, clip);
  if (side === THREE.BackSide) material.defines.INSIDE = true;
  return Object.assign(material, {side, stencilWrite: true, stencilZPass: THREE.ReplaceStencilOp,
                                  stencilRef: side === THREE.BackSide ? 1 : 0});
}

export function lineMaterial(clip, hex, opacity, lift = 4e-4) {
  return new THREE.ShaderMaterial({
    uniforms: {...clip, lift: {value: lift}, ink: {value: colourOf(hex)}, opacity: {value: opacity}},
    vertexShader: kLineVertex, fragmentShader: kLineFragment, transparent: opacity < 1,
    stencilWrite: true, stencilFunc: THREE.EqualStencilFunc, stencilRef: 0,
  });
}

// A face that is pointed at: its inside, and the lines around it.
export function markMaterials(clip) {
  const inside = lineMaterial(clip, "#ff7a1a", 0.14, 2e-4), around = lineMaterial(clip, "#ff7a1a", 1, 8e-4);
  inside.side = THREE.DoubleSide;
  inside.depthWrite = false;
  return {inside, around};
}
