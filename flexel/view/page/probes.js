// Points that were pointed at: values there, names of faces to copy, distances between two.
import {button, element} from "./elements.js";
import {numberText, quantityText, shellWord, tomlText} from "./numbers.js";
import {drawMeasure, drawProbe} from "./overlay.js";

const kMostProbes = 20;

export class Probes {
  // `list`: the element that lists them; `say(text, how)`: "spoken" for those who do not see the list.
  constructor(picture, list, say) {
    Object.assign(this, {picture, list, say, probes: [], measures: [], from: undefined, measuring: false, count: 0});
    picture.over.push(pen => this.draw(pen));
  }

  tap(x, y) {
    const hit = this.picture.pick(x, y);
    if (!hit) return this.say("nothing is there");
    const at = {panel: hit.panel, kind: hit.panel.kind, triangle: hit.triangle, weights: hit.weights};
    this.measuring ? this.measure(at) : this.probe(at);
    this.picture.redraw();
  }

  probe(at) {
    const face = at.panel.shape.face[at.triangle];
    const probe = {...at, number: ++this.count, name: at.panel.faceName(face), ownName: at.panel.about.face_names[face]};
    this.probes.push(probe);
    if (this.probes.length > kMostProbes) this.probes.shift();
    for (const panel of this.picture.panels) panel.unmark();
    if (probe.kind === "surface") probe.panel.markFace(face);
    this.update();
    this.say(this.describe(probe).join(", "), "spoken");
  }

  measure(at) {
    if (!this.from || this.from.panel !== at.panel) {
      this.from = at;
      return this.say("first point; point at the second");
    }
    this.measures.push({from: this.from, to: at, number: ++this.count});
    if (this.measures.length > kMostProbes) this.measures.shift();
    this.from = undefined;
    this.update();
    this.say(this.describeMeasure(this.measures.at(-1)).join(", "), "spoken");
  }

  clear() {
    [this.probes, this.measures, this.from] = [[], [], undefined];
    for (const panel of this.picture.panels) panel.unmark();
    this.update();
    this.picture.redraw();
  }

  pointText(point) {
    const unit = this.picture.lengthUnit;
    return `(${point.map(value => numberText(value / unit.factor)).join(", ")})\u00a0${unit.name}`;
  }

  // Where the point is now [m], with the displacement as large as it is.
  placeNow(at) {
    const u = at.panel.displacementOf(at, this.picture.state.frame);
    return at.panel.restOf(at).map((x, k) => x + u[k]);
  }

  describe(probe) {
    const {picture} = this, {colour, frame} = picture.state, {panel} = probe;
    const lines = [probe.name.text + (probe.ownName ? ` (${probe.ownName})` : "")];
    if (colour !== "none") lines.push(`${colour}: ${quantityText(panel.valueOf(probe, colour, frame), picture.unit(colour))}`);
    if (panel.shape.moved && colour !== "displacement")
      lines.push(`displacement: ${quantityText(panel.valueOf(probe, "displacement", frame), picture.unit("displacement"))}`);
    lines.push(`at ${this.pointText(panel.restOf(probe))}` + (panel.shape.moved ? " at rest" : ""));
    return lines;
  }

  describeMeasure({from, to}) {
    const [a, b] = [from, to].map(at => this.placeNow(at)), {lengthUnit: unit} = this.picture;
    const rest = Math.hypot(...from.panel.restOf(from).map((x, k) => x - to.panel.restOf(to)[k]));
    const now = Math.hypot(...a.map((x, k) => x - b[k]));
    const lines = [quantityText(now, unit), `by axis ${this.pointText(b.map((x, k) => x - a[k]))}`];
    if (from.panel.shape.moved) lines.push(`at rest ${quantityText(rest, unit)}`);
    return lines;
  }

  isShown(at) { return at.panel.kind === at.kind; }

  draw(pen) {
    const {picture} = this;
    const place = at => picture.project(at.panel, at.panel.placeOf(at));
    for (const each of this.measures)
      if (this.isShown(each.from)) drawMeasure(pen, place(each.from), place(each.to), this.describeMeasure(each)[0]);
    if (this.from) drawProbe(pen, {x: place(this.from)[0], y: place(this.from)[1], lines: ["first point"], number: ""}, picture.width);
    for (const probe of this.probes)
      if (this.isShown(probe)) {
        const [x, y] = place(probe);
        drawProbe(pen, {x, y, lines: this.describe(probe).slice(0, 2), number: probe.number}, picture.width);
      }
  }

  // The list beside the picture. Texts of files go in as text, never as HTML.
  update() {
    this.list.replaceChildren();
    const item = (title, lines, remove) => {
      const box = element("li", {}, this.list), head = element("div", {className: "head"}, box);
      element("strong", {textContent: title}, head);
      button("\u00d7", `Remove ${title}`, remove, head);
      for (const line of lines) element("div", {textContent: line}, box);
      return box;
    };
    for (const probe of this.probes.filter(each => this.isShown(each))) {
      const [name, ...lines] = this.describe(probe);
      const box = item(`${probe.number}  ${name}`, lines, () => this.remove(this.probes, probe));
      this.addCopies(probe, element("div", {className: "row"}, box));
    }
    for (const each of this.measures.filter(measure => this.isShown(measure.from)))
      item(`${each.number}  distance`, this.describeMeasure(each), () => this.remove(this.measures, each));
  }

  addCopies({name, kind}, row) {
    if (kind !== "surface") return;
    if (name.odd) return void element("span", {textContent: "its name has characters that cannot be typed"}, row);
    for (const text of [`--fix ${shellWord(name.text)}`, `where = ${tomlText(name.text)}`])
      button(text, `Copy ${text}`, () => this.copy(text), row);
  }

  async copy(text) {
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      const box = element("textarea", {value: text}, document.body);
      box.select();
      document.execCommand("copy");
      box.remove();
    }
    this.say(`copied: ${text}`);
  }

  remove(list, one) {
    list.splice(list.indexOf(one), 1);
    for (const panel of this.picture.panels) panel.unmark();
    this.update();
    this.picture.redraw();
  }
}
