// The picture: panels side by side, drawn when something changed.
import {View} from "./camera.js";
import {logTicks, numberText, roundBelow, roundTicks} from "./numbers.js";
import {drawAxes, drawLegend, drawScaleBar, themeOf, write} from "./overlay.js";
import {colourUniforms} from "./paint.js";
import {Panel} from "./panel.js";
import {drawsWithProcessor, Smooth} from "./smooth.js";

const kMostSmoothed = 200000;  // triangles, of a picture that the processor draws
const kLegendEms = 9.5, kSlow = 100, kMostSlow = 2, kRest = 700;  // ms, frames, ms

export class Picture {
  // `page`: what flexel/view/page.cpp writes.
  constructor(page, packs, canvas, overlay) {
    this.page = page;
    this.canvas = canvas;
    this.overlay = overlay;
    const slow = drawsWithProcessor(document.createElement("canvas"));
    this.renderer = new THREE.WebGLRenderer({canvas, antialias: !slow, alpha: true});
    this.renderer.autoClear = false;
    if (slow) this.smooth = new Smooth(this.renderer);
    this.renderer.setScissorTest(true);
    this.colours = colourUniforms(page.colours);
    this.panels = packs.map(pack => new Panel(pack, this.colours, page.colours.tints, slow));
    this.view = new View(page.up);
    this.view.changed = () => this.move();
    this.frames = Math.max(...this.panels.map(panel => panel.frames));
    this.times = this.panels.find(panel => panel.frames === this.frames).about.times;
    this.state = {colour: "none", low: null, high: null, logarithmic: false, steps: 0, outside: 0, scale: 1, frame: 0,
                  before: "lines", wipe: 0.5, edges: true, cells: false, theme: "light",
                  cut: false, cutAxis: "x", cutAt: 0.5, cutFlip: false};
    this.ranges = new Map();
    this.drawn = 0;
    this.over = [];  // what else draws on the overlay: functions of a pen
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
  }

  get moved() { return this.panels.some(panel => panel.shape.moved); }
  get names() { return [...new Set(this.panels.flatMap(panel => panel.shape.names))]; }
  unit(name) { return this.page.units[name.startsWith("displacement") ? "displacement" : name] ?? {factor: 1, name: ""}; }
  get lengthUnit() { return this.page.units["/size"]; }

  // So large that the largest displacement is a tenth of the part: 1, 2, 5 times a power of ten, at least 1.
  get fittingScale() {
    const factors = this.panels.filter(panel => panel.shape.largestDisplacement > 0)
      .map(panel => roundBelow(Math.max(1, 0.1 * panel.shape.diagonal / panel.shape.largestDisplacement)));
    return factors.length > 0 ? Math.min(...factors) : 1;
  }

  // The range of an attribute in all panels and frames.
  range(name) {
    const key = name + this.state.cells;
    if (!this.ranges.has(key)) {
      const all = {low: Infinity, positive: Infinity, high: -Infinity, largest: -Infinity};
      for (const {shape} of this.panels) {
        const range = shape.range(name);
        all.low = Math.min(all.low, range.low);
        all.positive = Math.min(all.positive, range.positive);
        all.high = Math.max(all.high, range.high);
        all.largest = Math.max(all.largest, shape.largest(name) ?? range.high);
      }
      this.ranges.set(key, all);
    }
    return this.ranges.get(key);
  }

  // Ends of the colours, SI.
  get ends() {
    const {colour, low, high, logarithmic} = this.state, range = this.range(colour);
    let [from, to] = [low ?? range.low, high ?? Math.max(range.high, range.largest)];
    if (low === null && from >= 0 && from < 0.5 * to) from = 0;
    if (logarithmic && !(from > 0)) from = low === null ? Math.max(range.positive, 1e-4 * to) : Math.abs(to) * 1e-4;
    if (!(to > from)) to = from + Math.max(1e-30, 1e-3 * Math.abs(from));
    return [from, to];
  }

  // Takes what changed: {colour: "strain"}.
  set(changes) {
    Object.assign(this.state, changes);
    const changed = (...names) => names.some(name => name in changes), {state} = this;
    if (changed("cells"))
      for (const panel of this.panels) if (panel.shapes.lattice && panel.shapes.surface) panel.show(state.cells ? "lattice" : "surface");
    if (changed("scale", "frame", "cells")) for (const panel of this.panels) panel.place(state.frame, state.scale);
    if (changed("colour", "frame", "cells", "low", "high", "logarithmic", "steps", "outside")) this.paint();
    if (changed("theme", "cells")) for (const panel of this.panels) panel.setInk(state.theme);
    for (const panel of this.panels) this.placeSection(panel);
    changed("scale", "frame", "cutAt") ? this.move() : this.redraw();
  }

  paint() {
    const {state, colours} = this, coloured = state.colour !== "none";
    if (!coloured) return;
    const {factor} = this.unit(state.colour), [low, high] = this.ends;
    colours.low.value = low / factor;
    colours.high.value = high / factor;
    colours.steps.value = state.steps;
    colours.outside.value = state.outside;
    colours.logarithmic.value = state.logarithmic && low > 0;
    for (const panel of this.panels) panel.after.fill(state.colour, state.frame, factor);
  }

  placeSection({shape, clip, radius}) {
    const {cut, cutAxis, cutAt, cutFlip} = this.state, axis = "xyz".indexOf(cutAxis);
    clip.cut.value = cut;
    const half = (shape.size[axis][1] - shape.size[axis][0]) / 2, sign = cutFlip ? -1 : 1;
    const at = (2 * cutAt - 1) * (half + 1e-6 * radius), normal = [0, 0, 0];
    normal[axis] = sign;
    clip.plane.value.set(...normal, sign * at);
  }

  resize() {
    const {clientWidth: width, clientHeight: height} = this.canvas.parentElement;
    if (width === 0 || height === 0) return;
    const ratio = this.pixelRatio = Math.min(window.devicePixelRatio || 1, 2);
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height);
    this.overlay.width = Math.round(width * ratio);
    this.overlay.height = Math.round(height * ratio);
    this.width = width;
    this.height = height;
    this.draw();
  }

  get em() { return Math.max(11, Math.min(15, this.width / 60)); }
  get hasLegend() { return this.state.colour !== "none"; }

  // {x, y, width, height} of each panel, CSS pixels from the top left.
  get layout() {
    const left = this.hasLegend ? kLegendEms * this.em : 0, count = this.panels.length;
    const wide = this.width - left, foot = 4.4 * this.em, high = this.height - foot;
    let columns = 1, best = 0;
    for (let n = 1; n <= count; ++n) {
      const side = Math.min(wide / n, high / Math.ceil(count / n));
      if (side > best * 1.001) [columns, best] = [n, side];
    }
    const rows = Math.ceil(count / columns), width = wide / columns, height = high / rows;
    return this.panels.map((_, k) => ({x: left + width * (k % columns), y: height * Math.floor(k / columns), width, height}));
  }

  // One scale for all, where the smallest is not lost beside the largest.
  get commonRadius() {
    const radii = this.panels.map(panel => panel.radius), largest = Math.max(...radii);
    return radii.every(radius => 4 * radius >= largest) ? largest : undefined;
  }
  radiusOf(panel) { return this.commonRadius ?? panel.radius; }

  // Of a panel that is so large.
  pixelsPerMetre(panel, {width, height}) {
    return Math.min(width, height) * this.view.zoom / (2 * 1.08 * this.radiusOf(panel));
  }

  // Zooms and shifts so that what is drawn fills the panels.
  fit() {
    const {right, up} = this.view.axes, box = [Infinity, -Infinity, Infinity, -Infinity], [room] = this.layout;
    for (const panel of this.panels) {
      panel.extentAlong(right, up).forEach((value, k) => {
        const at = value / this.radiusOf(panel);
        box[k] = k % 2 === 0 ? Math.min(box[k], at) : Math.max(box[k], at);
      });
    }
    const side = Math.min(room.width, room.height) / (2 * 1.08);
    this.view.zoom = 0.84 * Math.min(room.width / (side * (box[1] - box[0])), (room.height - 2.4 * this.em) / (side * (box[3] - box[2])));
    this.view.zoom = Math.max(0.05, Math.min(500, this.view.zoom || 1));
    this.view.shift = [(box[0] + box[1]) / 2, (box[2] + box[3]) / 2];
    this.redraw();
  }

  // Redraws what is in motion: roughly where frames were slow, and fully once it rests.
  move() {
    this.coarse = this.slow >= kMostSlow;
    this.rough = this.smooth !== undefined;
    clearTimeout(this.resting);
    this.redraw();
  }

  // Once the rough frame is on the screen and nothing moves any more, the whole one.
  rest() {
    requestAnimationFrame(() => {
      clearTimeout(this.resting);
      this.resting = setTimeout(() => {
        this.coarse = this.rough = false;
        this.redraw();
      }, kRest);
    });
  }

  // Frames wait for those before them, so a long wait means slow ones.
  redraw() {
    if (this.asked) return;
    this.asked = true;
    const began = performance.now();
    requestAnimationFrame(() => {
      if (!this.asked) return;
      const wait = performance.now() - began;
      if (!this.coarse && this.slow < kMostSlow) this.slow = wait < kSlow ? 0 : this.slow + (wait < 4 * kSlow ? 1 : kMostSlow);
      this.drawNow();
    });
  }
  slow = 0;

  // What redraw() was asked for, without waiting for the next frame of the screen.
  drawNow() {
    if (!this.asked) return;
    this.asked = false;
    this.draw();
    if (this.coarse || this.rough) this.rest();
  }

  draw() {
    if (!this.width) return;
    const {renderer} = this, layout = this.layout;
    this.colours.hatch.value = 7 * this.pixelRatio;
    const whole = () => {
      renderer.setScissor(0, 0, this.width, this.height);
      renderer.setViewport(0, 0, this.width, this.height);
    };
    const drawAll = (...how) => this.panels.forEach((panel, k) => this.drawPanel(panel, layout[k], ...how));
    const smoothed = this.smooth && !this.rough && this.panels.every(({shape}) => shape.triangles.length < 3 * kMostSmoothed);
    renderer.setClearColor(0, 0);
    if (smoothed) this.smooth.draw(this.canvas.width, this.canvas.height, drawAll);
    whole();
    renderer.clear();
    smoothed ? this.smooth.show() : drawAll();
    this.drawOver(layout);
    ++this.drawn;
    this.onDraw?.();
  }

  // `room`, `shift`: as Smooth.draw() has them.
  drawPanel(panel, {x, y, width, height}, room, shift) {
    const {renderer, state} = this, bottom = this.height - y - height;
    this.view.apply(panel.camera, this.radiusOf(panel), width / height);
    if (shift) [width, height].forEach((size, k) => { panel.camera.projectionMatrix.elements[12 + k] += 2 * shift[k] / (size * this.pixelRatio); });
    const pixels = box => box.map(value => value * this.pixelRatio);
    renderer.setViewport(x, bottom, width, height);
    const part = (from, to, side) => {
      const box = [x + from * width, bottom, (to - from) * width, height];
      panel.choose(state.before, state.edges, side, this.coarse, this.hasLegend);
      renderer.setScissor(...box);
      room?.(pixels([x, bottom, width, height]), pixels(box));
      renderer.render(panel.scene, panel.camera);
    };
    if (state.before !== "wipe" || !panel.shape.moved) return part(0, 1, "both");
    part(0, state.wipe, "before");
    part(state.wipe, 1, "after");
  }

  // Where a place of a panel (m, about its centre) is, in CSS pixels.
  project(panel, place) {
    const {x, y, width, height} = this.layout[this.panels.indexOf(panel)];
    this.view.apply(panel.camera, this.radiusOf(panel), width / height);
    const at = place.clone().project(panel.camera);
    return [x + (at.x + 1) / 2 * width, y + (1 - at.y) / 2 * height];
  }

  // The panel under a place, and what is there of it: {panel, triangle, weights}. `still`: as Panel.hit() has it.
  pick(x, y, still) {
    const k = this.layout.findIndex(room => x >= room.x && x < room.x + room.width && y >= room.y && y < room.y + room.height);
    if (k < 0) return undefined;
    const panel = this.panels[k], room = this.layout[k], {eye} = this.view.axes;
    this.view.apply(panel.camera, this.radiusOf(panel), room.width / room.height);
    const from = new THREE.Vector3((x - room.x) / room.width * 2 - 1, 1 - (y - room.y) / room.height * 2, -1).unproject(panel.camera);
    const wiped = this.state.before === "wipe" && panel.shape.moved && x < room.x + this.state.wipe * room.width;
    const hit = panel.hit(from, eye.clone().negate(), wiped, still);
    return hit && {panel, ...hit};
  }

  get legend() {
    const {state} = this, unit = this.unit(state.colour), [low, high] = this.ends, range = this.range(state.colour);
    const {logarithmic} = this.colours, [from, to] = [low / unit.factor, high / unit.factor];
    const ticks = logarithmic.value ? logTicks(from, to) : roundTicks(from, to, 8);
    const at = value => logarithmic.value ? Math.log(value / from) / Math.log(to / from) : (value - from) / (to - from);
    return {title: state.colour, unit: unit.name, colours: {steps: state.steps}, palette: this.page.colours.palette,
            largest: Number.isFinite(range.largest) ? "largest " + numberText(range.largest / unit.factor, 3) : "no values",
            ticks: ticks.map(tick => ({text: tick.text, at: at(tick.value)}))};
  }

  get captions() {
    const {scale, before, frame} = this.state, lines = [];
    if (this.frames > 1) lines.push(`time ${numberText(this.times[frame])} s`);
    if (!this.moved) return lines;
    if (scale !== 1) lines.push(`deformation drawn ${numberText(scale, 3)} times as large`);
    if (before === "lines") lines.push("grey lines: before");
    if (before === "ghost") lines.push("ghost: before");
    if (before === "wipe") lines.push("left of the line: before");
    return lines;
  }

  drawOver(layout) {
    const context = this.overlay.getContext("2d"), {em} = this, pen = {context, em, theme: themeOf(this.state.theme)};
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, this.overlay.width, this.overlay.height);
    context.scale(this.pixelRatio, this.pixelRatio);
    if (this.hasLegend) drawLegend(pen, this.legend, this.height);
    drawAxes(pen, 3.6 * em, this.height - 3.2 * em, this.view.axes);
    this.panels.forEach((panel, k) => {
      const room = layout[k];
      write(pen, panel.about.label, room.x + room.width / 2, room.y + 1.3 * em, {align: "center", bold: true});
      const own = this.commonRadius === undefined;
      if (own || k === 0)
        drawScaleBar(pen, own ? room.x + em : 8 * em, own ? room.y + room.height : this.height - 1.3 * em,
                     this.pixelsPerMetre(panel, room), Math.min(12 * em, 0.4 * room.width), this.lengthUnit);
      if (this.state.before === "wipe" && panel.shape.moved) this.drawWipe(pen, room);
    });
    this.captions.forEach((line, k, all) =>
      write(pen, line, this.width - 1.2 * em, this.height - (1.3 + 1.35 * (all.length - 1 - k)) * em, {align: "right", faint: true}));
    for (const draw of this.over) draw(pen);
  }

  drawWipe({context, theme}, {x, y, width, height}) {
    const at = Math.round(x + this.state.wipe * width) + 0.5;
    context.strokeStyle = theme.faint;
    context.lineWidth = 1;
    context.beginPath();
    context.moveTo(at, y);
    context.lineTo(at, y + height);
    context.stroke();
  }
}
