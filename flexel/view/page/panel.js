// One file: its shapes, and what three.js draws of them.
import {clipUniforms, colourOf, cutMaterial, lineMaterial, markMaterials, specialise, surfaceMaterial} from "./paint.js";
import {coarseTriangles} from "./coarse.js";
import {DrawnShape} from "./shape.js";
import {looksOutwards} from "./smooth.js";

const kEdgeInk = {light: "#20262d", dark: "#0c0f12"}, kRestInk = {light: "#7a8794", dark: "#9aa7b4"};

const kNoValue = 2e30;  // grey

function attribute(array, size) {
  const made = new THREE.BufferAttribute(array, size);
  made.setUsage?.(THREE.DynamicDrawUsage);
  return made;
}

// A shape with its lines, at positions of its own.
class Drawing {
  constructor(shape, colours, clip, tint, slow) {
    this.shape = shape;
    this.side = slow && (shape.outwards = shape.outwards ?? looksOutwards(shape)) ? THREE.FrontSide : THREE.DoubleSide;
    this.position = attribute(new Float32Array(3 * shape.count), 3);
    this.normal = attribute(new Float32Array(3 * shape.count), 3);
    this.value = attribute(new Float32Array(shape.count), 1);
    this.group = new THREE.Group();
    const mesh = new THREE.BufferGeometry();
    this.geometry = mesh;
    this.full = attribute(shape.triangles, 1);
    mesh.setIndex(this.full);
    const attributes = {position: this.position, normal: this.normal, value: this.value, tint};
    for (const [name, each] of Object.entries(attributes)) mesh.setAttribute(name, each);
    this.add(new THREE.Mesh(mesh, surfaceMaterial(colours, clip)), "surface");
    this.add(new THREE.Mesh(mesh, cutMaterial(colours, clip, THREE.FrontSide)), "outside");
    this.add(new THREE.Mesh(mesh, cutMaterial(colours, clip, THREE.BackSide)), "inside");
    this.add(this.lines(shape.creases, lineMaterial(clip, kEdgeInk.light, 0.9)), "creases");
    this.add(this.lines(shape.borders, lineMaterial(clip, kEdgeInk.light, 0.35)), "borders");
  }
  lines(indices, material) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", this.position);
    geometry.setIndex(attribute(indices, 1));
    return new THREE.LineSegments(geometry, material);
  }
  add(object, name) {
    object.frustumCulled = false;
    this[name] = object;
    this.group.add(object);
  }
  place(frame, scale) {
    this.shape.place(frame, scale, this.position.array, this.normal.array);
    this.position.needsUpdate = this.normal.needsUpdate = true;
  }
  // For a picture in motion; made when it is first asked for.
  set coarse(coarse) {
    if (coarse && this.few === undefined) {
      const few = coarseTriangles(this.shape);
      this.few = few ? attribute(few, 1) : null;
    }
    this.geometry.setIndex(coarse && this.few ? this.few : this.full);
  }
  dispose() {
    for (const object of this.group.children) {
      object.geometry.dispose();
      object.material.dispose();
    }
  }
  // A ghost is not cut open but cut off.
  show(visible, cut, ghost, coloured) {
    for (const {material} of [this.surface, this.outside, this.inside]) specialise(material, {coloured, cut});
    this.surface.visible = visible && (!cut || ghost);
    this.outside.visible = this.inside.visible = visible && cut && !ghost;
    if (visible) this.ghost = ghost;
  }
  fill(name, frame, factor) {
    this.shape.fill(this.value.array, name, frame, factor);
    this.value.needsUpdate = true;
  }
  // A ghost is seen through, and lies below what is at the same place.
  set ghost(ghost) {
    const {material} = this.surface;
    material.uniforms.opacity.value = ghost ? 0.3 : 1;
    material.uniforms.lift.value = ghost ? -6e-4 : 0;
    material.transparent = ghost;
    material.depthWrite = !ghost;
    const holed = "COLOURED" in material.defines && material.uniforms.outside.value === 2;
    const side = ghost ? THREE.FrontSide : holed ? THREE.DoubleSide : this.side;
    if (material.side !== side) material.needsUpdate = true;
    material.side = side;
  }
}

export class Panel {
  // `pack`: what unpack() gave. `colours`: uniforms of all panels; `tints`: of parts; `slow`: drawing takes the processor.
  constructor({about, arrays}, colours, tints, slow) {
    this.slow = slow;
    this.about = about;
    this.facePart = arrays.face_part;
    this.faceNumber = arrays.face_number;
    this.colours = colours;
    this.clip = clipUniforms();
    this.shapes = {};
    for (const kind of ["surface", "lattice"])
      if (about[kind]) this.shapes[kind] = new DrawnShape(about[kind], arrays, kind);
    this.tints = tints.map(hex => colourOf(hex).toArray());
    this.camera = new THREE.OrthographicCamera();
    this.camera.matrixAutoUpdate = false;
    this.scene = new THREE.Scene();
    this.drawings = {};
    this.show(this.shapes.surface ? "surface" : "lattice");
  }

  // Another surface of the same part, about the same centre.
  replaceSurface({about, arrays}) {
    const shape = new DrawnShape(about.surface, arrays, "surface");
    shape.centre = this.shapes.surface.centre;
    this.shapes.surface = shape;
    this.facePart = arrays.face_part;
    this.faceNumber = arrays.face_number;
    for (const drawings of [this.drawings, this.restDrawings ?? {}]) {
      if (drawings.surface) this.scene.remove(drawings.surface.group);
      drawings.surface?.dispose();
      delete drawings.surface;
    }
    this.show("surface");
  }

  get shape() { return this.shapes[this.kind]; }
  get after() { return this.drawings[this.kind]; }
  get frames() { return this.shape.frames; }
  get radius() { return Math.max(0.5 * (this.shape.diagonal || 1), this.reach); }
  reach = 0;  // m, the farthest point from the centre so far

  show(kind) {
    this.kind = kind;
    if (!this.after) {
      const drawing = new Drawing(this.shape, this.colours, this.clip, this.tintOf(this.shape), this.slow);
      this.drawings[kind] = drawing;
      this.scene.add(drawing.group);
    }
    for (const [each, drawing] of Object.entries(this.drawings)) drawing.group.visible = each === kind;
    this.unmark();
  }

  partName(face) { return this.about.parts[this.partOfFace(face)]; }
  partOfFace(face) { return this.kind === "lattice" ? face : this.facePart[face]; }

  tintOf(shape) {
    const tint = new Float32Array(3 * shape.count);
    if (shape.colours) return attribute(tint.map((_, i) => shape.colours[i] / 255), 3);
    for (let t = 0; t < shape.triangles.length; ++t) {
      const part = this.partOfFace(shape.face[Math.floor(t / 3)]);
      tint.set(this.tints[part % this.tints.length], 3 * shape.triangles[t]);
    }
    return attribute(tint, 3);
  }

  // What was before: lines, a ghost, or the whole for a wipe.
  get before() {
    this.restDrawings = this.restDrawings ?? {};
    if (!this.restDrawings[this.kind]) {
      const drawing = new Drawing(this.shape, this.colours, this.clip, this.after.surface.geometry.attributes.tint, this.slow);
      drawing.place(0, 0);
      drawing.value.array.fill(kNoValue);
      drawing.creases.material.uniforms.lift.value = drawing.borders.material.uniforms.lift.value = 2e-4;  // below the others
      this.restDrawings[this.kind] = drawing;
      this.scene.add(drawing.group);
    }
    return this.restDrawings[this.kind];
  }

  place(frame, scale) {
    this.after.place(frame, scale);
    const p = this.after.position.array;
    let farthest = 0;
    for (let i = 0; i < p.length; i += 3)
      farthest = Math.max(farthest, p[i] * p[i] + p[i + 1] * p[i + 1] + p[i + 2] * p[i + 2]);
    this.reach = Math.max(this.reach, Math.sqrt(farthest));
  }

  // [left, right, bottom, top] [m] of what is drawn, along two directions.
  extentAlong(right, up) {
    const box = [Infinity, -Infinity, Infinity, -Infinity], p = this.after.position.array;
    for (let i = 0; i < p.length; i += 3) {
      const x = p[i] * right.x + p[i + 1] * right.y + p[i + 2] * right.z;
      const y = p[i] * up.x + p[i + 1] * up.y + p[i + 2] * up.z;
      if (x < box[0]) box[0] = x;
      if (x > box[1]) box[1] = x;
      if (y < box[2]) box[2] = y;
      if (y > box[3]) box[3] = y;
    }
    return box;
  }

  setInk(theme) {
    for (const drawing of Object.values(this.drawings))
      for (const name of ["creases", "borders"]) drawing[name].material.uniforms.ink.value = colourOf(kEdgeInk[theme]);
    this.restInk = kRestInk[theme];
  }

  // Shows only what is after, or only what was before (`wipe`), or both as `before` says.
  choose(before, edges, side, coarse, coloured) {
    const hasBefore = before !== "nothing" && this.shape.moved;
    const after = this.after, rest = hasBefore ? this.before : undefined;
    for (const [kind, each] of Object.entries(this.restDrawings ?? {})) each.group.visible = hasBefore && kind === this.kind;
    after.group.visible = !(before === "wipe" && side === "before" && rest);
    const cut = this.clip.cut.value;
    after.coarse = coarse;
    if (rest) rest.coarse = coarse;
    after.show(true, cut, false, coloured);
    after.creases.visible = after.borders.visible = edges;
    if (!rest) return;
    rest.group.visible = before !== "wipe" || side === "before";
    rest.show(before !== "lines", cut, before === "ghost", coloured);
    rest.creases.visible = before === "lines" || before === "ghost" || edges;
    rest.borders.visible = before === "wipe" && edges;
    rest.creases.material.uniforms.ink.value = colourOf(before === "wipe" ? kEdgeInk.light : this.restInk ?? kRestInk.light);
  }

  // Lights up a face: its triangles, and the edges that only one of them has.
  markFace(face) {
    this.unmark();
    const {shape} = this, {triangles, smooth} = shape, inside = [], once = new Map();
    for (let t = 0; t < shape.face.length; ++t) {
      if (shape.face[t] !== face) continue;
      const corners = triangles.subarray(3 * t, 3 * t + 3);
      inside.push(...corners);
      corners.forEach((from, k) => {
        const to = corners[(k + 1) % 3], [a, b] = [from, to].map(p => smooth ? smooth[p] : p);
        const key = a < b ? `${a} ${b}` : `${b} ${a}`;
        once.has(key) ? once.set(key, undefined) : once.set(key, [from, to]);
      });
    }
    const materials = markMaterials(this.clip);
    this.marked = new THREE.Group();
    const add = (Kind, indices, material) => {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", this.after.position);
      geometry.setIndex(indices);
      const object = new Kind(geometry, material);
      object.frustumCulled = false;
      this.marked.add(object);
    };
    add(THREE.Mesh, inside, materials.inside);
    add(THREE.LineSegments, [...once.values()].filter(edge => edge).flat(), materials.around);
    this.scene.add(this.marked);
  }
  unmark() {
    if (!this.marked) return;
    this.scene.remove(this.marked);
    for (const object of this.marked.children) object.geometry.dispose();
    this.marked = undefined;
  }

  // "bracket/3", as options and scenes take it ("bracket/#3" where the file calls another face 3); the part alone on a lattice.
  faceName(face) {
    const part = this.partName(face);
    if (this.kind === "lattice") return part;
    const number = String(this.faceNumber[face]);
    if (number === "0") return {text: `${part.text}/carved`, odd: true};  // no face of the file
    const taken = Object.entries(this.about.face_names).some(
      ([other, name]) => name === number && Number(other) !== face && this.facePart[other] === this.facePart[face]);
    return {text: `${part.text}/${taken ? "#" : ""}${number}`, odd: part.odd};
  }

  // The part as it is drawn now, for hit() to go by whatever becomes of it.
  get still() { return {shape: this.shape, position: this.after.position.array.slice()}; }

  // The first triangle on the way from `origin` (about the centre) along `direction`: {triangle, weights, ...}. `rest`: of the part
  // as it was; `still`: of that.
  hit(origin, direction, rest, still) {
    const {triangles} = (still ?? this).shape, p = still?.position ?? (rest ? this.before : this.after).position.array, {plane, cut} = this.clip;
    const [ox, oy, oz] = origin.toArray(), [dx, dy, dz] = direction.toArray();
    let best;
    for (let t = 0; t < triangles.length; t += 3) {
      const a = 3 * triangles[t], b = 3 * triangles[t + 1], c = 3 * triangles[t + 2];
      const ex = p[b] - p[a], ey = p[b + 1] - p[a + 1], ez = p[b + 2] - p[a + 2];
      const fx = p[c] - p[a], fy = p[c + 1] - p[a + 1], fz = p[c + 2] - p[a + 2];
      const hx = dy * fz - dz * fy, hy = dz * fx - dx * fz, hz = dx * fy - dy * fx;
      const det = ex * hx + ey * hy + ez * hz;
      if (det === 0) continue;
      const sx = ox - p[a], sy = oy - p[a + 1], sz = oz - p[a + 2];
      const v = (sx * hx + sy * hy + sz * hz) / det;
      if (!(v >= 0 && v <= 1)) continue;
      const qx = sy * ez - sz * ey, qy = sz * ex - sx * ez, qz = sx * ey - sy * ex;
      const w = (dx * qx + dy * qy + dz * qz) / det;
      if (!(w >= 0 && v + w <= 1)) continue;
      const distance = (fx * qx + fy * qy + fz * qz) / det;
      if (!(distance > 0) || (best && distance >= best.distance)) continue;
      const place = new THREE.Vector3(ox + distance * dx, oy + distance * dy, oz + distance * dz);
      if (cut.value && place.dot(new THREE.Vector3(plane.value.x, plane.value.y, plane.value.z)) > plane.value.w) continue;
      best = {triangle: t / 3, weights: [1 - v - w, v, w], distance, inside: det < 0};
    }
    return best && !(cut.value && best.inside) ? best : undefined;  // a section is no surface
  }

  // Of a point on a triangle: place about the centre [m].
  placeOf({triangle, weights}) {
    const p = this.after.position.array;
    return new THREE.Vector3(...[0, 1, 2].map(c => this.mean(triangle, weights, point => p[3 * point + c])));
  }
  // Outward, of a triangle as it is drawn.
  normalOf({triangle}) {
    const [a, b, c] = [0, 1, 2].map(k => new THREE.Vector3().fromArray(this.after.position.array, 3 * this.shape.triangles[3 * triangle + k]));
    return b.sub(a).cross(c.sub(a)).normalize();
  }
  mean(triangle, weights, of, {triangles} = this.shape) {
    return weights.reduce((sum, weight, k) => sum + weight * of(triangles[3 * triangle + k]), 0);
  }
  restOf({triangle, weights}, shape = this.shape) { return [0, 1, 2].map(c => this.mean(triangle, weights, point => shape.restOf(point)[c], shape)); }
  displacementOf({triangle, weights}, frame) {
    return [0, 1, 2].map(c => this.mean(triangle, weights, point => this.shape.displacementOf(point, frame)[c]));
  }
  // SI. Lengths are those of the mean vector, so that they agree with it.
  valueOf(at, name, frame) {
    const [column, component] = name.split(".");
    if (column === "displacement" && this.shape.moved && !this.shape.fields.some(field => field.name === name)) {
      const u = this.displacementOf(at, frame);
      return component ? u["xyz".indexOf(component)] : Math.hypot(...u);
    }
    const values = this.shape.values(name, frame);
    return values ? this.mean(at.triangle, at.weights, point => values[point]) : NaN;
  }
}
