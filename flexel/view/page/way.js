// The way of a hand that carves: places on the part as it was when the hand came down, so that it does not matter how fast the hand
// is, nor how fast the part changes under it.

const kLeastLeap = 3;            // pixels
const kStep = 0.5, kNear = 0.1;  // of the radius: between places that are looked for, and between those that are told
const kMostWork = 8;             // ms, at a time

export class CarvedWay {
  // `tell(line)` takes what the run is told.
  constructor(picture, panel, radius, tell) {
    Object.assign(this, {picture, panel, radius, tell, still: panel.still, pixels: [], waiting: []});
  }

  // The hand is there [pixels].
  add(...at) {
    this.waiting.push(at);
    this.pixels.push(at);
    this.askToWork();
  }

  // It has left; gives the place where the ball was last.
  end() {
    this.work(Infinity);
    this.tellLeft();
    return this.told;
  }

  stop() { this.waiting = []; }

  askToWork() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => {
      this.asked = false;
      this.work(kMostWork);
      if (this.waiting.length > 0) this.askToWork();
    });
  }

  work(most) {
    const end = performance.now() + most;
    while (this.waiting.length > 0 && performance.now() < end) this.goOn(this.waiting);
  }

  // One step towards the place that waits first.
  goOn(waiting) {
    const [to] = waiting, from = this.pixel ?? to, apart = Math.hypot(to[0] - from[0], to[1] - from[1]);
    const step = Math.max(1, kStep * this.radius * this.scale);
    const share = apart > step ? step / apart : 1;
    if (share === 1) waiting.shift();
    this.reach(from.map((x, k) => x + share * (to[k] - x)));
  }

  get scale() { return this.picture.pixelsPerMetre(this.panel, this.picture.layout[0]); }

  // Where places a pixel apart are farther apart than the radius, one face ends before another: the ball is lifted.
  reach(pixel) {
    const {picture, panel, still, radius, place: before} = this, from = this.pixel ?? pixel, far = Math.max(radius, kLeastLeap / this.scale);
    const hit = picture.pick(...pixel, still), place = hit && panel.restOf(hit, still.shape);
    const apart = (a, b) => Math.hypot(...a.map((x, k) => x - b[k])), leaps = place && before && apart(place, before) > far;
    if (leaps && apart(pixel, from) > 1) {
      this.reach(pixel.map((x, k) => (x + from[k]) / 2));
      return this.reach(pixel);
    }
    Object.assign(this, {pixel, place});
    if (!place || leaps) this.tellLeft();
    if (!place) return;
    if (!before || leaps) this.tellPlace(`carve from ${place.join(" ")} ${radius}`, place);
    else if (apart(place, this.told) < kNear * radius) this.left = place;
    else this.tellPlace(`carve to ${place.join(" ")}`, place);
  }

  tellPlace(line, place) {
    this.tell(line);
    this.told = place;
    this.left = undefined;
  }

  // Where the hand is that was too near to be told.
  tellLeft() {
    if (this.left) this.tellPlace(`carve to ${this.left.join(" ")}`, this.left);
  }
}
