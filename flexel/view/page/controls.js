// The controls beside the picture: each is an element of page.html, and does what it says by Picture.set().
import {kViews} from "./camera.js";
import {button, element} from "./elements.js";
import {numberText} from "./numbers.js";
import {Recorder, savePicture} from "./record.js";

const byId = id => document.getElementById(id);

const kTurnStep = 6, kPanStep = 0.06, kSecondsOfSeries = 6, kMostVideo = 30;  // degrees; radii; s; s

export class Controls {
  constructor(picture, probes, page) {
    Object.assign(this, {picture, probes, page, playing: undefined});
    this.makeColours();
    this.makeShape();
    this.makeSeries();
    this.makeSection();
    this.makePointing();
    this.makeView();
    this.makeSaving();
    this.makeWords();
    this.makeKeys();
  }

  on(id, event, act) {
    byId(id).addEventListener(event, () => act(byId(id)));
    return byId(id);
  }

  set(changes) {
    this.picture.set(changes);
    if ("colour" in changes) this.probes.update();
  }

  makeColours() {
    const {picture, page} = this, select = byId("colour");
    picture.state.colour = page.colour || (picture.moved ? "displacement" : "none");
    this.listColours();
    this.on("colour", "change", () => this.set({colour: select.value, low: null, high: null}) ?? this.showRange());
    for (const end of ["low", "high"])
      this.on(end, "change", box => {
        const value = box.value.trim() === "" ? null : Number(box.value) * this.unit.factor;
        if (value === null || Number.isFinite(value)) this.set({[end]: value});
        this.showRange();
      });
    this.on("scaling", "change", box => this.set({logarithmic: box.value === "log"}) ?? this.showRange());
    this.on("steps", "change", box => this.set({steps: Number(box.value)}));
    this.on("outside", "change", box => this.set({outside: Number(box.value)}));
  }

  // The attributes of what is shown, surfaces or cells.
  listColours() {
    const {picture} = this, names = ["none", ...picture.names], select = byId("colour");
    select.replaceChildren();
    for (const name of names) element("option", {value: name, textContent: name}, select);
    if (!names.includes(picture.state.colour)) picture.state.colour = "none";
    select.value = picture.state.colour;
  }

  showCells(cells) {
    this.set({cells});
    this.listColours();
    this.set({colour: this.picture.state.colour});
    this.showRange();
  }

  get unit() { return this.picture.unit(this.picture.state.colour); }

  // The ends that are taken, where none were given.
  showRange() {
    const {state} = this.picture, none = state.colour === "none";
    for (const id of ["low", "high", "scaling", "steps", "outside"]) byId(id).disabled = none;
    byId("unit").textContent = none || !this.unit.name ? "" : "in " + this.unit.name;
    if (none) return;
    this.picture.ends.forEach((value, k) => {
      const box = byId(["low", "high"][k]);
      box.placeholder = numberText(value / this.unit.factor, 3);
      if (state[box.id] === null) box.value = "";
    });
  }

  makeShape() {
    const {picture, page} = this, fitting = picture.fittingScale;
    byId("shape").hidden = !picture.moved && !picture.panels.some(panel => panel.shapes.lattice && panel.shapes.surface);
    byId("moved").hidden = !picture.moved;
    const slider = byId("scale"), box = byId("scale-number"), scale = page.scale ?? fitting;
    slider.max = Math.max(2, 2 * fitting, scale);
    slider.step = slider.max / 200;
    const show = value => {
      slider.value = value;
      box.value = numberText(value, 3).replaceAll(",", "");
      this.set({scale: value});
    };
    this.showScale = show;
    slider.addEventListener("input", () => show(Number(slider.value)));
    box.addEventListener("change", () => {
      const value = Number(box.value);
      if (Number.isFinite(value) && value >= 0 && value <= 1e9) show(value);
    });
    this.on("scale-true", "click", () => show(1));
    this.on("scale-fit", "click", () => show(fitting));
    this.on("before", "change", each => {
      byId("wipe-row").hidden = each.value !== "wipe";
      this.set({before: each.value});
    });
    this.on("wipe", "input", each => this.set({wipe: Number(each.value)}));
    byId("cells-row").hidden = !picture.panels.some(panel => panel.shapes.lattice && panel.shapes.surface);
    this.on("cells", "change", each => this.showCells(each.checked));
    this.on("edges", "change", each => this.set({edges: each.checked}));
    picture.state.scale = scale;
  }

  makeSeries() {
    const {picture} = this, slider = byId("frame");
    byId("series").hidden = picture.frames < 2;
    slider.max = picture.frames - 1;
    slider.addEventListener("input", () => this.showFrame(Number(slider.value)));
    this.on("play", "click", () => this.play(this.playing === undefined));
  }

  showFrame(frame) {
    byId("frame").value = frame;
    byId("time").textContent = `${numberText(this.picture.times[frame])} s, frame ${frame + 1} of ${this.picture.frames}`;
    this.set({frame});
    this.probes.update();
  }

  play(on) {
    cancelAnimationFrame(this.playing);
    this.playing = undefined;
    byId("play").textContent = on ? "Pause" : "Play";
    if (!on) return;
    const frames = this.picture.frames, last = byId("frame").value - -1 >= frames;
    const start = performance.now() - 1000 * kSecondsOfSeries * (last ? 0 : byId("frame").value / frames);
    const step = now => {
      const frame = Math.floor((now - start) / 1000 / kSecondsOfSeries * frames);
      if (frame >= frames && byId("loop").checked) return this.play(true);
      if (frame >= frames) return this.play(false);
      if (frame !== this.picture.state.frame && frame >= 0) this.showFrame(frame);
      this.playing = requestAnimationFrame(step);
    };
    if (last) this.showFrame(0);
    this.playing = requestAnimationFrame(step);
  }

  makeSection() {
    this.on("cut", "change", () => this.turnSection());
    this.on("cut-axis", "change", () => this.turnSection());
    this.on("cut-at", "input", box => this.set({cutAt: Number(box.value)}));
    this.on("cut-flip", "change", box => this.set({cutFlip: box.checked}));
  }

  // Takes away the half that is nearer to the eye.
  turnSection() {
    const axis = byId("cut-axis").value, flip = byId("cut-flip");
    flip.checked = this.picture.view.axes.eye[axis] < 0;
    this.set({cut: byId("cut").checked, cutAxis: axis, cutFlip: flip.checked});
  }

  makePointing() {
    this.on("pointing", "change", box => {
      this.probes.measuring = box.value === "measure";
      this.probes.from = undefined;
      this.picture.redraw();
    });
    this.on("clear", "click", () => this.probes.clear());
  }

  makeView() {
    for (const name of Object.keys(kViews))
      button(name[0].toUpperCase() + name.slice(1), `Look at it: ${name}`, () => this.look(name), byId("views"));
    button("Fit", "Fit the part into the picture", () => this.picture.fit(), byId("views"));
    const dark = byId("dark");
    dark.checked = matchMedia("(prefers-color-scheme: dark)").matches;
    dark.addEventListener("change", () => this.setTheme());
    this.on("hide", "click", () => document.body.classList.toggle("wide"));
  }

  look(name) {
    this.picture.view.look(name);
    this.picture.fit();
  }

  setTheme() {
    const theme = byId("dark").checked ? "dark" : "light";
    document.documentElement.dataset.theme = theme;
    this.set({theme});
  }

  get fileName() {
    return this.picture.panels[0].about.label.replace(/\.\w+$/, "").replace(/[^\w.-]+/g, "_") || "picture";
  }

  makeSaving() {
    this.on("save-picture", "click", () => savePicture(this.picture, this.fileName));
    byId("save-video").disabled = !Recorder.possible;
    this.on("save-video", "click", () => this.recorder ? this.stopVideo() : this.startVideo());
  }

  startVideo() {
    this.recorder = new Recorder(this.picture);
    this.recorder.start();
    byId("save-video").textContent = "Stop the video";
    this.videoEnd = setTimeout(() => this.stopVideo(), 1000 * kMostVideo);
    if (this.picture.frames > 1) this.play(true);
  }

  async stopVideo() {
    const {recorder} = this;
    this.recorder = undefined;
    clearTimeout(this.videoEnd);
    byId("save-video").textContent = "Video (WebM)";
    await recorder.save(this.fileName);
  }

  makeWords() {
    const {warnings, lines, summary} = this.page.words, box = byId("words");
    for (const text of warnings) element("p", {className: "warning", textContent: text}, box);
    for (const text of lines) element("p", {className: "line", textContent: text}, box);
    const table = element("table", {}, box);
    const row = (name, text) => {
      const made = element("tr", {}, table);
      element("th", {textContent: name, scope: "row"}, made);
      element("td", {textContent: text}, made);
    };
    for (const panel of this.picture.panels) {
      if (this.picture.panels.length > 1) row(panel.about.label, "");
      for (const [name, text] of panel.about.facts) row(name, text);
    }
    if (summary) this.addSummary(summary, box);
    byId("warned").textContent = warnings.length === 0 ? "" : warnings.length === 1 ? "1 warning" : `${warnings.length} warnings`;
    byId("words-box").open = warnings.length > 0 || lines.length > 0;
  }

  addSummary(summary, box) {
    const part = element("details", {}, box);
    element("summary", {textContent: "All that it found (SI units)"}, part);
    element("pre", {textContent: JSON.stringify(summary, null, 1)}, part);
  }

  // Keys of the picture; every control has its own as the browser gives them.
  makeKeys() {
    const {view} = this.picture, {canvas} = this.picture;
    const turns = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]};
    const acts = {
      "+": () => view.zoomBy(1.2), "=": () => view.zoomBy(1.2), "-": () => view.zoomBy(1 / 1.2), f: () => this.picture.fit(),
      Enter: () => this.probes.tap(this.picture.width / 2, this.picture.height / 2),
      " ": () => this.picture.frames > 1 && this.play(this.playing === undefined),
      ".": () => this.stepFrame(1), ",": () => this.stepFrame(-1), Escape: () => this.probes.clear(),
      1: () => this.look("front"), 2: () => this.look("back"), 3: () => this.look("left"), 4: () => this.look("right"),
      5: () => this.look("top"), 6: () => this.look("bottom"), 0: () => this.look("iso"),
    };
    canvas.addEventListener("keydown", event => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const turn = turns[event.key], act = acts[event.key];
      if (!turn && !act) return;
      event.preventDefault();
      if (act) return void act();
      event.shiftKey ? view.pan(kPanStep * turn[0], kPanStep * turn[1]) : view.turn(-kTurnStep * turn[0], -kTurnStep * turn[1]);
    });
    canvas.addEventListener("focus", () => this.picture.redraw());
    canvas.addEventListener("blur", () => this.picture.redraw());
  }

  stepFrame(by) {
    const frame = this.picture.state.frame + by;
    if (frame >= 0 && frame < this.picture.frames) this.showFrame(frame);
  }

  // All is there: the first picture.
  begin() {
    this.showScale(this.picture.state.scale);
    this.setTheme();
    if (this.picture.frames > 1) this.showFrame(this.picture.frames - 1);
    this.set({...this.picture.state});
    this.showRange();
    this.picture.resize();
    this.picture.fit();
  }
}
