// Numbers, names and commands as text.

// Four significant digits, without an exponent where that is readable.
export function numberText(value, digits = 4) {
  if (!Number.isFinite(value)) return "\u2013";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size < 1e-4 || size >= 1e7) return value.toExponential(digits - 1);
  const rounded = Number(value.toPrecision(digits));
  return size >= 1e4 ? rounded.toLocaleString("en-US", {maximumFractionDigits: 0}) : String(rounded);
}

export function quantityText(value, unit, digits = 4) {
  if (!Number.isFinite(value)) return "no value";
  return numberText(value / unit.factor, digits) + (unit.name ? "\u00a0" + unit.name : "");
}

// The greatest of 1, 2, 5 times a power of ten that is not above `value` (> 0).
export function roundBelow(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  for (const step of [10, 5, 2]) if (step * power <= value * (1 + 1e-9)) return step * power;
  return power;
}

// Round numbers in [low, high], at most `most`.
export function roundTicks(low, high, most) {
  if (!(high - low > 1e-12 * Math.max(Math.abs(low), Math.abs(high)))) return [];
  const spare = 1e-6 * (high - low);
  let step = roundBelow((high - low) / (most + 1));
  const count = () => Math.floor((high + spare) / step) - Math.ceil((low - spare) / step) + 1;
  while (count() > most) step = roundBelow(step * 2.5);
  const decimals = Math.min(17, Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
  const ticks = [];
  for (let k = Math.ceil((low - spare) / step); k * step <= high + spare; ++k)
    ticks.push({value: k * step, text: (k === 0 ? 0 : k * step).toFixed(decimals)});
  return ticks;
}

// Powers of ten, and 2 and 5 times these where there are few.
export function logTicks(low, high) {
  const factors = Math.log10(high / low) > 3 ? [1] : [1, 2, 5];
  const ticks = [];
  for (let power = Math.floor(Math.log10(low)); power <= Math.ceil(Math.log10(high)); ++power)
    for (const factor of factors) {
      const value = factor * 10 ** power;
      if (value >= low * 0.9999 && value <= high * 1.0001) ticks.push({value, text: numberText(value, 3)});
    }
  return ticks;
}

// As one word of a shell's command line.
export function shellWord(text) {
  return /^[\w.\/:@%+-]+$/.test(text) ? text : "'" + text.replaceAll("'", "'\\''") + "'";
}

// As a string of TOML.
export function tomlText(text) {
  return '"' + text.replaceAll("\\", "\\\\").replaceAll('"', '\\"') + '"';
}
