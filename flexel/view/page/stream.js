// Frames of a live run over HTTP: a header, then lines of JSON, each with the bytes that it says (docs/guide/live.md).

const kRetry = 1000, kSilence = 4000;  // ms

// Cuts what comes in pieces into frames.
export class FrameReader {
  constructor() {
    this.pieces = [];
    this.size = 0;
    this.header = undefined;
  }

  feed(piece) {
    this.pieces.push(piece);
    this.size += piece.length;
    const frames = [];
    for (let frame; (frame = this.next()); ) frames.push(frame);
    return frames;
  }

  joined() {
    if (this.pieces.length > 1) {
      const all = new Uint8Array(this.size);
      let at = 0;
      for (const piece of this.pieces) all.set(piece, (at += piece.length) - piece.length);
      this.pieces = [all];
    }
    return this.pieces[0] ?? new Uint8Array(0);
  }

  next() {
    if (this.size < (this.wanted ?? 1)) return undefined;
    const bytes = this.joined(), end = bytes.indexOf(10);
    if (end < 0) return undefined;
    const line = JSON.parse(new TextDecoder().decode(bytes.subarray(0, end)));
    const whole = end + 1 + (this.header ? line.bytes : 0);
    this.wanted = whole;
    if (bytes.length < whole) return undefined;
    this.wanted = 1;
    if (this.header && line.bytes > 0) line.positions = new Float32Array(bytes.slice(end + 1, whole).buffer);
    this.pieces = [bytes.subarray(whole)];
    this.size = bytes.length - whole;
    if (this.header) return line;
    if (line["flexel-live"] !== 1 || line.clay !== 4) throw new Error("this page and its flexel clay are of different versions: load it again");
    this.header = line;
    return this.next();
  }
}

// Reads for ever; where the connection is lost it comes back by itself. `show(frame)`, `connected(yes)`.
export async function readFrames(client, show, connected) {
  for (;;) {
    try {
      const aborting = new AbortController();
      let heard = setTimeout(() => aborting.abort(), kSilence);
      const answer = await fetch(`live?client=${client}`, {signal: aborting.signal});
      if (!answer.ok) throw new Error(await answer.text());
      const reader = answer.body.getReader(), frames = new FrameReader();
      for (;;) {
        const {done, value} = await reader.read();
        if (done) break;
        clearTimeout(heard);
        heard = setTimeout(() => aborting.abort(), kSilence);
        connected(true);
        for (const frame of frames.feed(value)) show(frame);
      }
    } catch (error) {
      connected(false, String(error.message ?? error));
    }
    await new Promise(done => setTimeout(done, kRetry));
  }
}
