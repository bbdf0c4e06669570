// Hands: what is held, the tool that follows the mouse, what it feels, and what is saved. Every act is a line that is posted
// (docs/reference/clay-protocol.md); the part moves as the frames say.
import {button, element} from "./elements.js";
import {numberText} from "./numbers.js";
import {readFrames} from "./stream.js";
import {unpack} from "./unpack.js";
import {CarvedWay} from "./way.js";

const kFormats = ["stl", "obj", "3mf", "step"], kTurnPerPixel = 0.01, kCorners = 8;  // rad
const kMostLines = 100;  // of a message

const hex = bytes => [...bytes].map(byte => byte.toString(16).padStart(2, "0")).join("");

export class Clay {
  constructor(picture, controls, page) {
    Object.assign(this, {picture, controls, about: page.clay, panel: picture.panels[0], frame: undefined, drag: undefined,
                         waiting: [], busy: false, mode: "hold", surface: 0, shown: 0, latencies: [], sent: []});
    this.client = hex(crypto.getRandomValues(new Uint8Array(8)));
    this.shape = this.panel.shape;
    page.units.displacement = page.units["/size"];
    this.unit = page.units["/size"];
    for (const id of ["shape", "series"]) document.getElementById(id).hidden = true;
    document.getElementById("clay").hidden = false;
    this.makeControls();
    this.listen(document.getElementById("stage"));
    picture.over.push(pen => this.draw(pen));
  }

  async begin() {
    const answer = await fetch("save/rest.f32");
    if (!answer.ok) throw new Error(await answer.text());
    this.rest = new Float32Array(await answer.arrayBuffer());
    this.facePlaces = this.placesOfFaces();
    this.aimAtFace();
    readFrames(this.client, frame => this.take(frame), (yes, why) => this.setConnected(yes, why));
  }

  by(id) { return document.getElementById(id); }

  // --- controls ---

  makeControls() {
    const {about} = this, on = (id, event, act) => this.by(id).addEventListener(event, () => act(this.by(id)));
    for (const each of document.querySelectorAll("input[name=hand]"))
      each.addEventListener("change", () => this.choose(each.value));
    const faces = this.by("face");
    this.faceNames = [...new Set(this.shape.face)].sort((a, b) => a - b).map(face => this.panel.faceName(face)).filter(name => !name.odd);
    this.partOfFace = new Map([...new Set(this.shape.face)].map(face => [this.panel.faceName(face).text, this.panel.partName(face)]));
    for (const name of this.faceNames) element("option", {value: name.text, textContent: name.text}, faces);
    on("face-hold", "click", () => this.toggleHold(faces.value));
    on("face-pull", "click", () => this.post("grab face " + faces.value));
    for (const kind of ["ball", "plate"]) on(`face-push-${kind}`, "click", () => this.push(kind, this.facePlaces.get(faces.value)));
    on("face-paint", "click", () => this.paint(this.partOfFace.get(faces.value)));
    on("stay", "click", () => this.post("release"));
    on("keep", "click", () => this.post("keep"));
    for (const act of ["undo", "redo"]) on(act, "click", () => this.letGo(act));
    on("take", "click", () => this.post("take"));
    on("lead", "click", () => this.leadExactly());
    on("face", "change", () => this.aimAtFace());
    for (const act of ["carve", "glue"]) on(act, "click", () => this.change(act, this.triple("at-")));
    on("carve-on", "click", () => this.carveOn());
    for (const each of document.querySelectorAll(".length-unit")) each.textContent = this.unit.name;
    this.by("ball").value = Number((2 * about.spacing / this.unit.factor).toPrecision(2));
    this.by("within").value = Number((about.spacing / this.unit.factor).toPrecision(2));
    const materials = this.by("material");
    if (about.material && !about.materials.includes(about.material)) about.materials.unshift(about.material);
    for (const box of [materials, this.by("paint-with")])
      for (const name of about.materials) element("option", {value: name, textContent: name}, box);
    this.by("material-row").hidden = !about.material;
    on("material", "change", box => this.post("material " + box.value));
    for (const format of kFormats)
      button(format.toUpperCase(), `Save the part as it is now, as ${format.toUpperCase()}`, () => this.save(`part.${format}`, `${about.stem}-bent.${format}`), this.by("save-part"));
    button("Scene", "Save the scene that does the same without hands", () => this.save("scene.tar", `${about.stem}-scene.tar`), this.by("save-part"));
    document.addEventListener("keydown", event => {
      if (event.key === "Escape" && this.drag) return this.letGo("cancel");
      if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "z" || /INPUT|SELECT|TEXTAREA/.test(event.target.tagName)) return;
      event.preventDefault();
      this.letGo(event.shiftKey ? "redo" : "undo");
    });
  }

  // The hand leaves, its button still down, and something is done: what it led is there no more, or another.
  letGo(act) {
    this.drag?.way?.stop();
    this.drag = undefined;
    this.post(act);
  }

  say(text, how = "faint") { Object.assign(this.by("hands-said"), {textContent: text, className: how}); }

  setConnected(yes, why) {
    if (this.connected === yes) return;
    this.connected = yes;
    if (!yes) this.say(`flexel clay does not answer (${why}); this page tries again`, "warning");
    this.showState();
  }

  // m
  length(id) { return (Number(this.by(id).value) || 0) * this.unit.factor; }
  triple(ids) { return ["x", "y", "z"].map(axis => this.length(ids + axis)); }

  // A tool that pushes goes into the face unless something else is asked for.
  choose(mode) {
    const pushes = name => name.startsWith("push-"), along = this.by("along");
    if (pushes(mode) && along.value === "any") along.value = "in";
    if (!pushes(mode) && along.value === "in") along.value = "any";
    if (mode === "paint") this.say("A part has one material throughout: a click paints all of it.");
    this.mode = mode;
  }

  leadExactly() { this.post(`0 ${this.triple("lead-").join(" ")}`, "stay"); }

  // By keys a place is given in numbers; that of the chosen face to begin with.
  aimAtFace() {
    const at = this.facePlaces.get(this.by("face").value);
    if (!at) return;
    this.panel.restOf(at).forEach((x, k) => { this.by("at-" + "xyz"[k]).value = Number((x / this.unit.factor).toPrecision(6)); });
  }

  get radius() { return Math.max(1e-9, this.length("ball")); }

  // Carves or glues in the ball about a place at rest.
  change(act, rest) {
    if (act === "carve") this.carved = rest;
    const ball = `${act} at ${rest.join(" ")} ${this.radius}`;
    this.post(act === "glue" ? `${ball} ${Math.max(1e-9, this.length("within"))}` : ball);
  }

  // Straight on from where a ball was carved out last.
  carveOn() {
    if (!this.carved) return this.say("Carve a ball first: the way begins there.", "warning");
    const [from, to] = [this.carved, this.triple("at-")];
    this.post(`carve from ${from.join(" ")} ${this.radius}`, `carve to ${to.join(" ")}`, "stay");
    this.carved = to;
  }

  // Puts a ball or a plate where it touches a place as it is now.
  push(kind, at) {
    const {centre} = this.shape, place = this.panel.placeOf(at).toArray().map((x, k) => x + centre[k]);
    this.post(`push ${kind} ${place.join(" ")} ${this.panel.normalOf(at).toArray().join(" ")} ${this.radius}`);
  }

  // Blanks in a material's name do not matter, and divide the words of an act.
  paint(part) {
    if (part.odd) return this.say(`${part.text} has no name that can be typed`, "warning");
    this.post(`paint ${this.by("paint-with").value.replaceAll(" ", "-")} ${part.text}`);
  }

  toggleHold(name) {
    if (!name) return;
    this.post((this.frame?.holds.includes(name) ? "free " : "hold ") + name);
  }

  async save(name, as) {
    this.say(`saving ${as} \u2026`);
    const answer = await fetch("save/" + name);
    if (!answer.ok) return this.say(await answer.text(), "warning");
    const link = element("a", {href: URL.createObjectURL(await answer.blob()), download: as}, document.body);
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60000);
    link.remove();
    this.say(`saved ${as}`);
  }

  // --- acts ---

  // Lines go out one message after another; where the hand is replaces where it was.
  post(...lines) {
    for (const line of lines) {
      const moves = text => /^(hand|\d|-)/.test(text);
      if (moves(line) && this.waiting.length > 0 && moves(this.waiting.at(-1).line)) this.waiting.pop();
      this.waiting.push({line, at: performance.now()});
    }
    if (!this.busy) this.pump();
  }

  async pump() {
    this.busy = true;
    try {
      while (this.waiting.length > 0) {
        const acts = this.waiting.splice(0, kMostLines), lines = acts.map(act => act.line);
        const answer = await fetch("act", {method: "POST", body: [`client ${this.client}`, ...lines].join("\n")});
        const text = await answer.text();
        if (!answer.ok) this.say(text.trim(), "warning");
        else this.sent.push({line: JSON.parse(text).line, at: acts.at(-1).at});
      }
    } catch (error) {
      this.waiting = [];
      this.say(`flexel clay does not answer (${error.message})`, "warning");
    } finally {
      this.busy = false;
    }
  }

  // --- the hand ---

  listen(stage) {
    stage.addEventListener("pointerdown", event => this.down(event), {capture: true});
    stage.addEventListener("pointermove", event => this.move(event), {capture: true});
    for (const name of ["pointerup", "pointercancel"]) stage.addEventListener(name, event => this.up(event), {capture: true});
  }

  place(event) {
    const box = this.picture.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  down(event) {
    if (event.target !== this.picture.canvas || event.button !== 0 || event.shiftKey || this.drag || this.mode === "look" || !this.mine) return;
    const at = this.place(event), hit = this.picture.pick(...at);
    if (!hit) return;
    event.stopPropagation();
    const rest = this.panel.restOf(hit), name = this.panel.faceName(this.shape.face[hit.triangle]);
    if (this.mode === "hold") return name.odd ? this.say(`${name.text} is no face that has a name`, "warning") : this.toggleHold(name.text);
    if (this.mode === "paint") return this.paint(this.panel.partName(this.shape.face[hit.triangle]));
    if (this.mode === "glue") return this.change("glue", rest);
    if (this.mode === "carve") return this.beginToCarve(event, at);
    const pushes = this.mode.startsWith("push-") && this.mode.slice(5), byFace = !pushes && this.by("takes").value === "face";
    if (byFace && name.odd) return this.say(`${name.text} is no face that has a name`, "warning");
    this.picture.canvas.setPointerCapture(event.pointerId);
    this.drag = {from: at, now: at, pointer: event.pointerId, mode: this.mode, grabs: this.frame.grabs, axes: this.picture.view.axes,
                 touch: event.pointerType === "touch", pen: event.pointerType === "pen", pressure: event.pressure, into: this.panel.normalOf(hit).negate()};
    if (pushes) this.push(pushes, hit);
    else this.post(byFace ? `grab face ${name.text}` : `grab at ${rest.join(" ")} ${this.radius}`);
  }

  beginToCarve(event, at) {
    this.picture.canvas.setPointerCapture(event.pointerId);
    this.drag = {pointer: event.pointerId, way: new CarvedWay(this.picture, this.panel, this.radius, line => this.post(line))};
    this.drag.way.add(...at);
  }

  move(event) {
    if (!this.drag || event.pointerId !== this.drag.pointer) return;
    event.stopPropagation();
    if (this.drag.way) return this.carveAlong(event);
    this.drag.now = this.place(event);
    this.drag.pressure = event.pressure;
    this.follow();
  }

  // A browser tells places of a fast hand together.
  carveAlong(event) {
    const all = event.getCoalescedEvents?.() ?? [];
    for (const each of all.length > 0 ? all : [event]) this.drag.way.add(...this.place(each));
    this.picture.drawOver(this.picture.layout);
  }

  up(event) {
    if (!this.drag || event.pointerId !== this.drag.pointer) return;
    event.stopPropagation();
    if (this.drag.way) {
      this.carved = this.drag.way.end();
      this.post("stay");
      this.drag = undefined;
      return this.picture.redraw();
    }
    this.drag.done = true;
    this.follow();
  }

  // Where the hand has led the tool that it holds; nothing before the run has taken hold.
  follow() {
    const {drag} = this;
    if (!drag?.base) return;
    const metre = this.picture.pixelsPerMetre(this.panel, this.picture.layout[0]);
    const [x, y] = [drag.now[0] - drag.from[0], drag.now[1] - drag.from[1]], {right, up, eye} = drag.axes;
    const pose = [...drag.base];
    if (drag.mode === "twist") {
      ["x", "y", "z"].forEach((axis, k) => { pose[3 + k] += kTurnPerPixel * x * eye[axis]; });
    } else {
      const way = right.clone().multiplyScalar(x / metre).addScaledVector(up, -y / metre);
      const along = this.by("along").value;
      if (along === "in") this.keepAlong(way, drag.into, right, up, y / metre);
      else if (along !== "any") this.keepAlong(way, new THREE.Vector3(...["x", "y", "z"].map(axis => axis === along ? 1 : 0)), right, up, 0);
      if (drag.pen) way.addScaledVector(drag.into, drag.pressure * this.radius);
      [way.x, way.y, way.z].forEach((value, k) => { pose[k] += value; });
    }
    if (x !== 0 || y !== 0 || drag.pen) this.post("hand " + pose.join(" "));
    if (!drag.done) return;
    this.drag = undefined;
    this.post("stay");
  }

  // A way in the picture becomes one along a direction that looks the same there; `unseen`: how long where that is along the eye.
  keepAlong(way, direction, right, up, unseen) {
    const [a, b] = [direction.dot(right), direction.dot(up)], seen = a * a + b * b;
    const length = seen < 0.01 ? unseen : (way.dot(right) * a + way.dot(up) * b) / seen;
    way.copy(direction).multiplyScalar(length);
  }

  // --- frames ---

  take(frame) {
    const before = this.frame;
    this.frame = {...frame, positions: frame.positions ?? before?.positions};
    if (this.drag && !this.drag.base && frame.grabs > this.drag.grabs) {
      this.drag.base = frame.place.at(-1);
      this.follow();
    }
    if (this.drag && !this.drag.base && !this.drag.way && frame.said) this.drag = undefined;
    const text = frame.said || this.hint;
    if (text !== this.told) this.say(text, frame.said ? "warning" : "faint");
    this.told = text;
    if (frame.positions) this.fresh = frame.positions;
    if (frame.surface !== this.surface) this.renewSurface();
    this.askToShow();
  }

  askToShow() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => this.show());
  }

  // Carving, and undoing it, gives the part another surface; what is drawn stays until that has come.
  async renewSurface() {
    if (this.renewing) return;
    this.renewing = true;
    try {
      for (let number; (number = this.frame.surface) !== this.surface; ) {
        const answer = await fetch(number === 0 ? "data/0" : `save/surface-${number}`);
        if (!answer.ok && number !== this.frame.surface) continue;
        if (answer.status === 404) break;  // another has come; the frame that says so is on its way
        if (!answer.ok) throw new Error(await answer.text());
        const pack = await unpack(new Uint8Array(await answer.arrayBuffer()));
        if (number !== this.frame.surface) continue;
        this.panel.replaceSurface(pack);
        this.shape = this.panel.shape;
        this.carriedRest = undefined;
        this.surface = number;
        this.bend(this.frame.positions);  // at once: until then its points lie nowhere, and no click finds it
      }
      this.controls.probes.clear();
      this.panel.setInk(this.picture.state.theme);
      this.facePlaces = this.placesOfFaces();
      this.askToShow();
    } catch (error) {
      this.say(`what was carved is not shown (${error.message.trim()})`, "warning");
    } finally {
      this.renewing = false;
    }
  }

  show() {
    this.asked = false;
    if (this.fresh && this.surface === this.frame.surface && !this.renewing) {
      this.bend(this.fresh);
      this.fresh = undefined;
    }
    this.showState();
    this.picture.drawNow();
    ++this.shown;
    const arrived = this.sent.filter(each => each.line <= this.frame.line);
    if (arrived.length > 0) {
      this.latencies.push(performance.now() - arrived.at(-1).at);
      if (this.latencies.length > 1000) this.latencies.shift();
      this.sent = this.sent.filter(each => each.line > this.frame.line);
    }
    this.vibrate();
  }

  // Where the elements carry the points at rest: (points x 3) m.
  carriedFrom() {
    const {rest, shape: {count, carriers, weights}} = this, from = new Float64Array(3 * count);
    for (let a = 0; a < kCorners * count; ++a)
      for (let c = 0; c < 3; ++c) from[3 * Math.floor(a / kCorners) + c] += weights[a] * rest[3 * carriers[a] + c];
    return from;
  }

  // The points where their elements carry them.
  bend(positions) {
    const {shape} = this, {carriers, weights} = shape, moved = shape.live ?? new Float32Array(3 * shape.count);
    const from = this.carriedRest = this.carriedRest ?? this.carriedFrom();
    for (let p = 0, i = 0, a = 0; p < shape.count; ++p, i += 3) {
      let x = -from[i], y = -from[i + 1], z = -from[i + 2];
      for (const end = a + kCorners; a < end; ++a) {
        const e = 3 * carriers[a], w = weights[a];
        x += w * positions[e];
        y += w * positions[e + 1];
        z += w * positions[e + 2];
      }
      moved[i] = x;
      moved[i + 1] = y;
      moved[i + 2] = z;
    }
    shape.setLive(moved);
    this.picture.ranges.clear();
    this.picture.set({frame: 0});
    if (this.by("colour").options.length !== this.picture.names.length + 1) this.controls.listColours();
  }

  get mine() { return this.connected && this.frame && (!this.frame.holder || this.frame.holder === this.client.slice(0, 8)); }

  // What someone new does next.
  get hint() {
    if (this.frame.holds.length === 0) return "Click a face that stays where it is.";
    return this.frame.tools.length === 0 ? "Choose \u201cpulls where it drags\u201d, and drag at another place." : "Drag on, keep the shape, or save.";
  }

  turnText(t) {
    const turn = Math.hypot(...this.frame.place[t].slice(3)) * 180 / Math.PI;
    if (turn < 0.05) return "";
    return `, ${numberText(Math.hypot(...this.frame.felt[t].slice(3)), 3)}\u00a0N\u00a0m at ${numberText(turn, 3)}\u00b0`;
  }

  forceText(t) {
    const force = Math.hypot(...this.frame.felt[t].slice(0, 3));
    return force >= 1000 ? `${numberText(force / 1000, 3)}\u00a0kN` : `${numberText(force, 3)}\u00a0N`;
  }

  showState() {
    const {frame, mine} = this;
    if (!frame) return;
    for (const each of document.querySelectorAll("#clay button, #clay input, #clay select")) each.disabled = !mine && !each.closest("#save-part");
    this.by("take").disabled = false;
    this.by("watching").hidden = mine || !this.connected;
    if (mine) {
      this.by("undo").disabled = !frame.undo;
      this.by("redo").disabled = !frame.redo;
      for (const id of ["stay", "lead"]) this.by(id).disabled = frame.tools.length === 0;
      this.by("keep").disabled = frame.tools.length === 0 && frame.holds.length === 0;
    }
    this.by("held").textContent = frame.holds.length > 0 ? frame.holds.join(", ") : "nothing yet: click a face";
    if (frame.material) this.by("material").value = frame.material;
    const painted = Object.entries(frame.painted);
    this.by("painted").hidden = painted.length === 0;
    this.by("painted").textContent = "Painted: " + painted.map(([part, material]) => `${part} with ${material}`).join(", ");
    const last = frame.tools.length - 1;
    const way = last < 0 ? 0 : Math.hypot(...frame.place[last].slice(0, 3)) / this.unit.factor;
    const seen = JSON.stringify([frame.holds, frame.place, frame.felt, frame.hand, frame.middles, frame.shapes]);
    if (seen !== this.seen) this.picture.redraw();
    this.seen = seen;
    this.by("feel").textContent = last < 0 ? "nothing" : `${this.forceText(last)} at ${numberText(way, 3)}\u00a0${this.unit.name}` + this.turnText(last) + (frame.settled ? "" : " \u2026");
  }

  // A gamepad or a phone shakes with the force, as a share of the largest so far.
  vibrate() {
    const last = this.frame.felt.at(-1);
    if (!this.drag || !last) return;
    const force = Math.hypot(...last.slice(0, 3));
    this.strongest = Math.max(this.strongest ?? 0, force);
    const share = this.strongest > 0 ? force / this.strongest : 0;
    for (const pad of navigator.getGamepads?.() ?? [])
      pad?.vibrationActuator?.playEffect?.("dual-rumble", {duration: 100, strongMagnitude: share, weakMagnitude: share})?.catch(() => {});
    if (this.drag.touch) navigator.vibrate?.(Math.round(20 * share));
  }

  // --- the overlay ---

  // By name, a point of each face: the centre of its largest triangle.
  placesOfFaces() {
    const {shape, panel} = this, places = new Map(), sizes = new Map();
    for (let t = 0; t < shape.face.length; ++t) {
      const [a, b, c] = [0, 1, 2].map(k => new THREE.Vector3(...shape.restOf(shape.triangles[3 * t + k])));
      const area = b.clone().sub(a).cross(c.clone().sub(a)).length(), name = panel.faceName(shape.face[t]).text;
      if (area <= (sizes.get(name) ?? 0)) continue;
      sizes.set(name, area);
      places.set(name, {triangle: t, weights: [1 / 3, 1 / 3, 1 / 3]});
    }
    return places;
  }

  worldPoint(point) {
    const {centre} = this.shape;
    return this.picture.project(this.panel, new THREE.Vector3(...point.map((x, k) => x - centre[k])));
  }

  draw({context, em, theme}) {
    const {frame} = this;
    if (!frame || !this.facePlaces) return;
    if (this.drag?.way) this.drawWay(context, theme);
    context.font = `${em}px system-ui, sans-serif`;
    context.lineWidth = 2;
    context.textAlign = "left";
    context.textBaseline = "middle";
    context.fillStyle = context.strokeStyle = theme.ink;
    for (const name of frame.holds) {
      const at = this.facePlaces.get(name);
      if (!at) continue;
      const [x, y] = this.picture.project(this.panel, this.panel.placeOf(at));
      context.fillRect(x - em / 3, y - em / 3, 0.66 * em, 0.66 * em);
      this.label(context, theme, `held: ${name}`, x + 0.6 * em, y);
    }
    frame.tools.forEach((_, t) => {
      const middle = frame.middles[t], [x, y] = this.worldPoint(middle.map((m, k) => m + frame.place[t][k]));
      const leads = t === frame.tools.length - 1 && frame.hand;
      context.beginPath();
      if (frame.shapes[t]) this.outline(context, t, x, y);
      else context.arc(x, y, 0.5 * em, 0, 2 * Math.PI);
      context.stroke();
      this.label(context, theme, this.forceText(t), x + 0.8 * em, y - 0.8 * em);
      if (leads) this.drawSpring(context, [x, y], this.worldPoint(middle.map((m, k) => m + frame.hand[k])), em);
    });
  }

  // Where a ball carves that the hand leads, as wide as it is.
  drawWay(context, theme) {
    const {pixels, radius} = this.drag.way;
    context.save();
    Object.assign(context, {globalAlpha: 0.25, strokeStyle: theme.ink, lineCap: "round", lineJoin: "round",
                            lineWidth: 2 * radius * this.picture.pixelsPerMetre(this.panel, this.picture.layout[0])});
    context.beginPath();
    context.moveTo(...pixels[0]);
    for (const at of pixels) context.lineTo(...at);
    context.stroke();
    context.restore();
  }

  // Of a ball, or of a plate's face as it is turned.
  outline(context, t, x, y) {
    const {kind, radius, normal} = this.frame.shapes[t], place = this.frame.place[t];
    if (kind === "ball") return context.arc(x, y, radius * this.picture.pixelsPerMetre(this.panel, this.picture.layout[0]), 0, 2 * Math.PI);
    const turn = new THREE.Vector3(...place.slice(3)), angle = turn.length();
    const face = new THREE.Vector3(...normal);
    if (angle > 0) face.applyAxisAngle(turn.normalize(), angle);
    const side = new THREE.Vector3(...(Math.abs(face.x) < 0.5 ? [1, 0, 0] : [0, 1, 0])).cross(face).normalize(), other = face.clone().cross(side);
    for (let k = 0; k <= 32; ++k) {
      const [c, s] = [Math.cos(k * Math.PI / 16), Math.sin(k * Math.PI / 16)];
      context.lineTo(...this.worldPoint(this.frame.middles[t].map((m, i) => m + place[i] + radius * (c * side.getComponent(i) + s * other.getComponent(i)))));
    }
  }

  // In a box, for the part below may have any colour.
  label(context, theme, text, x, y) {
    const {width} = context.measureText(text), {em} = this.picture;
    context.fillStyle = theme.box;
    context.fillRect(x - 0.2 * em, y - 0.7 * em, width + 0.4 * em, 1.4 * em);
    context.fillStyle = theme.ink;
    context.fillText(text, x, y);
  }

  // From the tool to the hand that draws it.
  drawSpring(context, [x, y], [hx, hy], em) {
    const turns = 8, length = Math.hypot(hx - x, hy - y);
    if (length < 2) return;
    const [nx, ny] = [-(hy - y) / length * 0.3 * em, (hx - x) / length * 0.3 * em];
    context.lineWidth = 1;
    context.beginPath();
    context.moveTo(x, y);
    for (let k = 1; k < turns; ++k) {
      const side = k % 2 ? 1 : -1;
      context.lineTo(x + (hx - x) * k / turns + side * nx, y + (hy - y) * k / turns + side * ny);
    }
    context.lineTo(hx, hy);
    context.stroke();
    context.beginPath();
    context.arc(hx, hy, 0.25 * em, 0, 2 * Math.PI);
    context.fill();
  }
}
