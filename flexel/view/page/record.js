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

export class Recorder {
  static get possible() { return typeof MediaRecorder === "function" && MediaRecorder.isTypeSupported("video/webm"); }

  constructor(picture) {
    this.picture = picture;
    this.target = document.createElement("canvas");
  }

  start() {
    compose(this.picture, this.target);
    this.chunks = [];
    this.recorder = new MediaRecorder(this.target.captureStream(30), {mimeType: "video/webm", videoBitsPerSecond: 8e6});
    this.recorder.ondataavailable = event => this.chunks.push(event.data);
    this.picture.onDraw = () => compose(this.picture, this.target);
    this.recorder.start();
  }

  // The WebM as a blob.
  stop() {
    this.picture.onDraw = undefined;
    return new Promise(resolve => {
      this.recorder.onstop = () => resolve(new Blob(this.chunks, {type: "video/webm"}));
      this.recorder.stop();
    });
  }

  async save(name) {
    save(await this.stop(), name + ".webm");
  }
}
