// Pictures and videos of what is seen, with all that is written over it.
import {element} from "./elements.js";
import {themeOf} from "./overlay.js";

function save(blob, name) {
  const url = URL.createObjectURL(blob), link = element("a", {href: url, download: name}, document.body);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}

// One canvas with both layers on paper.
function compose(picture, target) {
  target.width = picture.canvas.width;
  target.height = picture.canvas.height;
  const context = target.getContext("2d");
  context.fillStyle = themeOf(picture.state.theme).paper;
  context.fillRect(0, 0, target.width, target.height);
  context.drawImage(picture.canvas, 0, 0, target.width, target.height);
  context.drawImage(picture.overlay, 0, 0, target.width, target.height);
  return target;
}

// The PNG as a blob; what was drawn is there until the browser has shown it.
export function pictureBlob(picture) {
  picture.coarse = picture.rough = false;
  picture.draw();
  const target = compose(picture, document.createElement("canvas"));
  return new Promise(resolve => target.toBlob(resolve, "image/png"));
}

export async function savePicture(picture, name) {
  save(await pictureBlob(picture), name + ".png");
}

const slice = 100;  // ms, between what the encoder hands over
const longestWait = 20000;  // ms
const headerBytes = 256;  // of a WebM without a frame, at most

export class Recorder {
  static get possible() { return typeof MediaRecorder === "function" && MediaRecorder.isTypeSupported("video/webm"); }

  constructor(picture) {
    this.picture = picture;
    this.target = document.createElement("canvas");
  }

  start() {
    compose(this.picture, this.target);
    this.chunks = [];
    this.bytes = 0;
    this.recorder = new MediaRecorder(this.target.captureStream(30), {mimeType: "video/webm", videoBitsPerSecond: 8e6});
    this.recorder.ondataavailable = event => {
      this.chunks.push(event.data);
      this.bytes += event.data.size;
    };
    this.picture.onDraw = () => compose(this.picture, this.target);
    this.recorder.start(slice);
  }

  // The WebM as a blob. A busy machine encodes late: not before a frame is in it.
  async stop() {
    this.picture.onDraw = undefined;
    for (let waited = 0; this.bytes <= headerBytes && waited < longestWait; waited += slice) {
      compose(this.picture, this.target);
      await new Promise(done => setTimeout(done, slice));
    }
    return new Promise(resolve => {
      this.recorder.onstop = () => resolve(new Blob(this.chunks, {type: "video/webm"}));
      this.recorder.stop();
    });
  }

  async save(name) {
    save(await this.stop(), name + ".webm");
  }
}
