// How the part is looked at, and how hands change that: mouse, pen, fingers and keys. One camera for all panels.

// Azimuth and elevation [degrees] as flexel picture has them: 0, 0 looks at the front.
export const kViews = {iso: [45, 35.264], front: [0, 0], back: [180, 0], left: [-90, 0], right: [90, 0], top: [0, 90], bottom: [0, -90]};

const kTurn = 0.4;  // degrees a pixel

export class View {
  constructor(up) {
    this.up = up;
    this.changed = () => {};
    this.reset();
  }

  reset() {
    this.zoom = 1;
    this.shift = [0, 0];  // of the picture's middle, in radii
    this.look("iso");
  }

  look(name) {
    [this.azimuth, this.elevation] = kViews[name];
    this.changed();
  }

  turn(right, up) {
    this.azimuth = (this.azimuth - right) % 360;
    this.elevation = Math.max(-90, Math.min(90, this.elevation + up));
    this.changed();
  }

  pan(x, y) {
    this.shift = [this.shift[0] - x, this.shift[1] - y];
    this.changed();
  }

  // At a place of the picture that stays where it is, in radii from its middle.
  zoomBy(factor, at = [0, 0]) {
    const zoom = Math.max(0.05, Math.min(500, this.zoom * factor)), ratio = this.zoom / zoom;
    this.shift = this.shift.map((s, k) => s + at[k] * (1 - ratio));
    this.zoom = zoom;
    this.changed();
  }

  // The directions of the picture in the world: right, up, and towards the eye.
  get axes() {
    const az = this.azimuth * Math.PI / 180, el = this.elevation * Math.PI / 180;
    const c = Math.cos(az), s = Math.sin(az), ce = Math.cos(el), se = Math.sin(el);
    // With z up; other axes by turning them into it.
    const world = ([x, y, z]) => new THREE.Vector3(...(this.up === "z" ? [x, y, z] : this.up === "y" ? [x, z, -y] : [z, x, y]));
    return {right: world([c, s, 0]), up: world([-s * se, c * se, ce]), eye: world([s * ce, -c * ce, se])};
  }

  // For a part of `radius` about the origin, in a picture of this shape (width / height).
  apply(camera, radius, aspect) {
    const half = 1.08 * radius / this.zoom, {right, up, eye} = this.axes;
    const wide = Math.max(aspect, 1), high = Math.max(1 / aspect, 1);
    camera.left = -half * wide;
    camera.right = half * wide;
    camera.top = half * high;
    camera.bottom = -half * high;
    camera.near = 0;
    camera.far = 6 * radius;
    camera.matrix.makeBasis(right, up, eye);
    camera.matrix.setPosition(right.clone().multiplyScalar(this.shift[0] * radius)
      .addScaledVector(up, this.shift[1] * radius).addScaledVector(eye, 3 * radius));
    camera.matrix.decompose(camera.position, camera.quaternion, camera.scale);
    camera.updateMatrixWorld(true);
    camera.updateProjectionMatrix();
  }
}

// Hands on `element`: calls tap(x, y) [pixels] for what was neither a turn nor a shift. `radiusPixels()`: of the part.
export function listen(element, view, radiusPixels, tap) {
  const down = new Map();  // pointers
  let moved = 0, turning = true, spread = 0;
  const middle = () => [...down.values()].reduce((sum, p) => [sum[0] + p[0] / down.size, sum[1] + p[1] / down.size], [0, 0]);
  const distance = () => {
    const [a, b] = [...down.values()];
    return b ? Math.hypot(a[0] - b[0], a[1] - b[1]) : 0;
  };
  element.addEventListener("pointerdown", event => {
    element.setPointerCapture(event.pointerId);
    down.set(event.pointerId, [event.offsetX, event.offsetY]);
    if (down.size === 1) moved = 0;
    turning = event.button === 0 && !event.shiftKey;
    spread = distance();
  });
  element.addEventListener("pointermove", event => {
    if (!down.has(event.pointerId)) return;
    const before = middle();
    down.set(event.pointerId, [event.offsetX, event.offsetY]);
    const after = middle(), x = after[0] - before[0], y = after[1] - before[1];
    moved += Math.abs(x) + Math.abs(y);
    if (moved < 4) return;
    if (down.size === 1 && turning) return view.turn(kTurn * x, kTurn * y);
    view.pan(x / radiusPixels(), -y / radiusPixels());
    if (down.size === 2 && spread > 0) view.zoomBy(distance() / spread);
    spread = distance();
  });
  const end = event => {
    if (down.delete(event.pointerId) && down.size === 0 && moved < 4 && event.type === "pointerup" && event.button === 0)
      tap(event.offsetX, event.offsetY);
  };
  element.addEventListener("pointerup", end);
  element.addEventListener("pointercancel", end);
  element.addEventListener("contextmenu", event => event.preventDefault());
  element.addEventListener("wheel", event => {
    event.preventDefault();
    view.zoomBy(Math.exp(-0.0015 * event.deltaY));
  }, {passive: false});
}
