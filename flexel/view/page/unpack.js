// Reads what flexel/view/pack.h describes.

const kMagic = 0x56584c46;  // "FLXV"

async function inflate(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Steps of a box: coordinate c of point i is lower[c] + step * steps[3 i + c].
function readPoints(planes, about) {
  const n = 3 * about.count, steps = new Uint16Array(n);
  for (let i = 0; i < n; ++i)
    steps[i] = (planes[i] | planes[n + i] << 8) + (i < 3 ? 0 : steps[i - 3]);
  return {steps, lower: about.lower, step: about.step, count: about.count};
}

function readIndices(planes, {count: n}) {
  const indices = new Uint32Array(n);
  for (let i = 0, before = 0; i < n; ++i)
    before = indices[i] =
        before + (planes[i] | planes[n + i] << 8 | planes[2 * n + i] << 16 | planes[3 * n + i] << 24);
  return indices;
}

function readNumbers(planes, {count: n}) {
  const bits = new Uint32Array(n);
  for (let i = 0; i < n; ++i) bits[i] = planes[i] << 8 | planes[n + i] << 16 | planes[2 * n + i] << 24;
  return new Float32Array(bits.buffer);
}

const kReaders = {points: readPoints, indices: readIndices, numbers: readNumbers, bytes: planes => planes};

// {about, arrays by name} of a pack (Uint8Array).
export async function unpack(bytes) {
  const head = new DataView(bytes.buffer, bytes.byteOffset, 8);
  if (head.getUint32(0, true) !== kMagic) throw new Error("the data of this page is damaged");
  const start = 8 + head.getUint32(4, true);
  const text = JSON.parse(new TextDecoder().decode(bytes.subarray(8, start)));
  const arrays = {};
  for (const [name, about] of Object.entries(text.arrays)) {
    const planes = await inflate(bytes.subarray(start + about.offset, start + about.offset + about.bytes));
    if (planes.length !== about.count * about.width) throw new Error("the data of this page is damaged");
    arrays[name] = kReaders[about.kind](planes, about);
  }
  return {about: text.about, arrays};
}

export function fromBase64(text) {
  const binary = atob(text), bytes = new Uint8Array(binary.length);
  for (let i = 0; i < bytes.length; ++i) bytes[i] = binary.charCodeAt(i);
  return bytes;
}
