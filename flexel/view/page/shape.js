// A surface or a lattice in one of its states: positions, normals, values.

const kUnknown = 1e30;  // beyond all values; the shader takes it for none

export class DrawnShape {
  // `about` and the arrays under `prefix`: flexel/view/page.cpp writes them.
  constructor(about, arrays, prefix) {
    const of = name => arrays[prefix + "/" + name];
    this.rest = of("rest");
    this.count = this.rest.count;
    this.triangles = of("triangles");
    this.face = of("face");
    this.creases = of("creases");
    this.borders = of("borders");
    this.smooth = of("smooth");
    this.colours = of("colours");
    this.carriers = of("carriers");
    this.weights = of("weights");
    this.moved = about.moved;
    this.frames = Math.max(1, about.frames);
    this.displacement = [];
    for (let f = 0; this.moved && f < about.frames; ++f) this.displacement.push(of("displacement/" + f));
    this.fields = about.fields.map((field, k) => {
      const values = [];
      for (let f = 0; f < field.frames; ++f) values.push(of(`field/${k}/${f}`));
      return {...field, values};
    });
    this.size = [0, 1, 2].map(c => this.extent(c));
    this.centre = this.size.map(([low, high]) => (low + high) / 2);
    this.position = new Float32Array(3 * this.count);
    this.normal = new Float32Array(3 * this.count);
    this.lengths = new Map();
  }

  extent(axis) {
    let low = Infinity, high = -Infinity;
    const {steps, lower, step} = this.rest;
    for (let i = axis; i < steps.length; i += 3) {
      low = Math.min(low, steps[i]);
      high = Math.max(high, steps[i]);
    }
    return [lower[axis] + step * low, lower[axis] + step * high];
  }

  get diagonal() { return Math.hypot(...this.size.map(([low, high]) => high - low)); }

  restOf(point) { return [0, 1, 2].map(c => this.rest.lower[c] + this.rest.step * this.rest.steps[3 * point + c]); }

  // (points x 3) m: the displacement of all from now on.
  setLive(displacement) {
    this.live = displacement;
    this.moved = true;
    this.lengths.clear();
  }

  displacementOf(point, frame) {
    if (this.live) return [0, 1, 2].map(c => this.live[3 * point + c]);
    const u = this.displacement[Math.min(frame, this.displacement.length - 1)];
    return u ? [0, 1, 2].map(c => u.lower[c] + u.step * u.steps[3 * point + c]) : [0, 0, 0];
  }

  // Positions about the centre, with the displacement of a frame `scale` times as large; and their normals.
  place(frame, scale, position = this.position, normal = this.normal) {
    if (this.live) return this.placeLive(scale, position, normal);
    const {steps, lower, step} = this.rest, n = steps.length;
    const u = scale === 0 ? undefined : this.displacement[Math.min(frame, this.displacement.length - 1)];
    const start = [0, 1, 2].map(c => lower[c] - this.centre[c] + (u ? scale * u.lower[c] : 0));
    const by = u ? scale * u.step : 0, moved = u ? u.steps : steps;
    for (let i = 0; i < n; i += 3) {
      position[i] = start[0] + step * steps[i] + by * moved[i];
      position[i + 1] = start[1] + step * steps[i + 1] + by * moved[i + 1];
      position[i + 2] = start[2] + step * steps[i + 2] + by * moved[i + 2];
    }
    this.setNormals(position, normal);
  }

  placeLive(scale, position, normal) {
    const {steps, lower, step} = this.rest;
    const {live, centre} = this, x = lower[0] - centre[0], y = lower[1] - centre[1], z = lower[2] - centre[2];
    for (let i = 0; i < steps.length; i += 3) {
      position[i] = x + step * steps[i] + scale * live[i];
      position[i + 1] = y + step * steps[i + 1] + scale * live[i + 1];
      position[i + 2] = z + step * steps[i + 2] + scale * live[i + 2];
    }
    this.setNormals(position, normal);
  }

  // The mean over the triangles of a smooth part of the surface, weighted by area.
  setNormals(position, normal) {
    const {triangles, smooth} = this;
    let sums = normal;
    if (smooth) sums = this.sums = this.sums ?? new Float32Array(3 * (1 + smooth.reduce((a, b) => Math.max(a, b), 0)));
    sums.fill(0);
    for (let t = 0; t < triangles.length; t += 3) {
      const a = 3 * triangles[t], b = 3 * triangles[t + 1], c = 3 * triangles[t + 2];
      const px = position[b] - position[a], py = position[b + 1] - position[a + 1], pz = position[b + 2] - position[a + 2];
      const qx = position[c] - position[a], qy = position[c + 1] - position[a + 1], qz = position[c + 2] - position[a + 2];
      const x = py * qz - pz * qy, y = pz * qx - px * qz, z = px * qy - py * qx;
      for (let k = 0; k < 3; ++k) {
        const at = smooth ? 3 * smooth[triangles[t + k]] : 3 * triangles[t + k];
        sums[at] += x;
        sums[at + 1] += y;
        sums[at + 2] += z;
      }
    }
    for (let i = 0; i < sums.length; i += 3) {
      const length = Math.sqrt(sums[i] ** 2 + sums[i + 1] ** 2 + sums[i + 2] ** 2) || 1;
      sums[i] /= length;
      sums[i + 1] /= length;
      sums[i + 2] /= length;
    }
    if (smooth)
      for (let p = 0; p < smooth.length; ++p)
        for (let c = 0; c < 3; ++c) normal[3 * p + c] = sums[3 * smooth[p] + c];
  }

  get names() {
    const names = this.fields.map(field => field.name);
    return this.moved ? ["displacement", "displacement.x", "displacement.y", "displacement.z", ...names] : names;
  }

  largest(name) { return this.fields.find(field => field.name === name)?.largest; }

  // (points) SI; NaN where nothing is known. Nothing for a name that this does not have.
  values(name, frame) {
    const field = this.fields.find(each => each.name === name);
    if (field) return field.values[Math.min(frame, field.values.length - 1)];
    const [column, component] = name.split(".");
    if (column !== "displacement" || !this.moved) return undefined;
    return this.displacementValues(component, this.live ? 0 : Math.min(frame, this.displacement.length - 1));
  }

  displacementValues(component, frame) {
    const key = component + "/" + frame;
    if (this.lengths.has(key)) return this.lengths.get(key);
    const {steps, lower, step} = this.displacement[frame] ?? {}, values = new Float32Array(this.count);
    const axis = "xyz".indexOf(component ?? "-");
    for (let p = 0; p < this.count; ++p) {
      const at = c => this.live ? this.live[3 * p + c] : lower[c] + step * steps[3 * p + c];
      values[p] = axis >= 0 ? at(axis) : Math.hypot(at(0), at(1), at(2));
    }
    this.lengths.clear();
    this.lengths.set(key, values);
    return values;
  }

  // Least, least above zero and greatest value of all frames.
  range(name) {
    const range = {low: Infinity, positive: Infinity, high: -Infinity};
    for (let f = 0; f < this.frames; ++f)
      for (const value of this.values(name, f) ?? []) {
        if (!Number.isFinite(value)) continue;
        if (value < range.low) range.low = value;
        if (value > range.high) range.high = value;
        if (value > 0 && value < range.positive) range.positive = value;
      }
    return range;
  }

  // Values as the shader takes them, in units of `factor`.
  fill(target, name, frame, factor) {
    const values = this.values(name, frame);
    if (!values) return target.fill(kUnknown);
    for (let p = 0; p < values.length; ++p) target[p] = Number.isFinite(values[p]) ? values[p] / factor : kUnknown;
    return target;
  }

  get largestDisplacement() {
    return this.moved ? this.range("displacement").high : 0;
  }
}
