// Fewer triangles, for the time that a large part is in motion on a machine that is slow to draw it.

const kManyTriangles = 150000, kEnough = 60000, kGrid = 128;

// The triangles whose corners lie in three cells of a grid, each moved to one point of its cell: what rounding to the grid leaves.
function clustered({steps, count}, triangles, grid) {
  const cell = value => Math.floor(value * grid / 65536), first = new Map(), stand = new Uint32Array(count), kept = [];
  for (let p = 0; p < count; ++p) {
    const key = cell(steps[3 * p]) + grid * (cell(steps[3 * p + 1]) + grid * cell(steps[3 * p + 2]));
    if (!first.has(key)) first.set(key, p);
    stand[p] = first.get(key);
  }
  for (let t = 0; t < triangles.length; t += 3) {
    const a = stand[triangles[t]], b = stand[triangles[t + 1]], c = stand[triangles[t + 2]];
    if (a !== b && b !== c && c !== a) kept.push(a, b, c);
  }
  return new Uint32Array(kept);
}

// Indices into the same points; nothing for a part that is small enough.
export function coarseTriangles({rest, triangles}) {
  if (triangles.length < 3 * kManyTriangles) return undefined;
  const fine = clustered(rest, triangles, kGrid), share = 3 * kEnough / fine.length;
  return share < 1 ? clustered(rest, triangles, Math.floor(kGrid * Math.sqrt(share))) : fine;
}
