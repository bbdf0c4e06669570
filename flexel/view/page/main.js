// Reads the page's data, and begins.
import {listen} from "./camera.js";
import {Clay} from "./clay.js";
import {Controls} from "./controls.js";
import {Probes} from "./probes.js";
import {pictureBlob, Recorder} from "./record.js";
import {Picture} from "./scene.js";
import {fromBase64, unpack} from "./unpack.js";

function report(text) {
  const box = document.getElementById("message");
  box.textContent = text;
  box.hidden = text === "";
}

async function packBytes(page) {
  if (page.whole)
    return [...document.querySelectorAll("script.data")].map(script => {
      const bytes = fromBase64(script.textContent);
      script.remove();
      return bytes;
    });
  return Promise.all(page.files.map(async (_, k) => {
    const answer = await fetch(`data/${k}`);
    if (!answer.ok) throw new Error("flexel view has ended: start it again");
    return new Uint8Array(await answer.arrayBuffer());
  }));
}

// A mark in the middle of the picture, where Enter points, while keys go to it.
function drawAim(picture) {
  picture.over.push(({context, em, theme}) => {
    if (document.activeElement !== picture.canvas || !picture.canvas.matches(":focus-visible")) return;
    const x = Math.round(picture.width / 2) + 0.5, y = Math.round(picture.height / 2) + 0.5;
    context.strokeStyle = theme.ink;
    context.lineWidth = 1;
    for (const [dx, dy] of [[em / 2, 0], [0, em / 2]]) {
      context.beginPath();
      context.moveTo(x - dx, y - dy);
      context.lineTo(x + dx, y + dy);
      context.stroke();
    }
  });
}

async function start() {
  const page = JSON.parse(document.getElementById("page").textContent);
  document.title = page.files.map(file => file.label).join(", ") + " \u2013 Flexel";
  if (typeof DecompressionStream !== "function")
    throw new Error("this browser is too old for this page: it needs DecompressionStream (Chromium 80, Firefox 113)");
  const packs = await Promise.all((await packBytes(page)).map(unpack));
  const canvas = document.getElementById("canvas"), trial = document.createElement("canvas");
  if (!(trial.getContext("webgl2") ?? trial.getContext("webgl")))
    throw new Error("this browser gives no WebGL, which the page draws with: is it switched off, or the graphics driver missing?");
  const picture = new Picture(page, packs, canvas, document.getElementById("overlay"));
  const said = document.getElementById("said");
  const probes = new Probes(picture, document.getElementById("probes"),
                            (text, how = "faint") => Object.assign(said, {textContent: text, className: how}));
  listen(canvas, picture.view, () => picture.pixelsPerMetre(picture.panels[0], picture.layout[0]) * picture.radiusOf(picture.panels[0]),
         (x, y) => probes.tap(x, y));
  drawAim(picture);
  const controls = new Controls(picture, probes, page);
  controls.begin();
  const clay = page.clay ? new Clay(picture, controls, page) : undefined;
  await clay?.begin();
  report("");
  performance.mark("ready");
  window.flexelView = {picture, probes, controls, clay, pictureBlob, Recorder};  // for scripts
  document.documentElement.dataset.ready = "yes";
}

start().catch(error => {
  report(String(error.message ?? error));
  document.documentElement.dataset.ready = "failed";
});
