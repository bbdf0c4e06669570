// What is written over the picture: names, legend, axes, scale bar, probes. On a canvas, so that a saved picture has it too.
import {quantityText, roundBelow} from "./numbers.js";

const kFont = "system-ui, -apple-system, 'Segoe UI', 'DejaVu Sans', sans-serif";
const kThemes = {
  light: {paper: "#fafbfc", ink: "#20262d", faint: "#5d6873", box: "rgba(255,255,255,0.88)", line: "#b9c2cb"},
  dark: {paper: "#14181d", ink: "#e8ecf0", faint: "#9aa7b4", box: "rgba(24,29,35,0.88)", line: "#475260"},
};
export const themeOf = name => kThemes[name];

const kAxes = [["x", [1, 0, 0], "#d0453c"], ["y", [0, 1, 0], "#2f9a4a"], ["z", [0, 0, 1], "#3b78d8"]];

// `pen`: {context, theme, em (pixels)}.
export function write(pen, text, x, y, {align = "left", faint = false, bold = false, size = 1} = {}) {
  const {context, theme, em} = pen;
  context.font = `${bold ? "600 " : ""}${size * em}px ${kFont}`;
  context.textAlign = align;
  context.textBaseline = "middle";
  context.fillStyle = faint ? theme.faint : theme.ink;
  context.fillText(text, x, y);
  return context.measureText(text).width;
}

export function drawLegend(pen, {title, unit, largest, ticks, colours, palette}, height) {
  const {context, em} = pen;
  const bar = {x: 1.2 * em, y: 4.6 * em, width: 1.1 * em, height: Math.min(22 * em, height - 13 * em)};
  if (bar.height < 4 * em) return;
  write(pen, title, bar.x, 1.7 * em, {bold: true});
  write(pen, unit ? "in " + unit : "", bar.x, 3.1 * em, {faint: true, size: 0.9});
  const steps = colours.steps || palette.length;
  for (let k = 0; k < steps; ++k) {
    const at = (k + 0.5) / steps;
    context.fillStyle = palette[Math.round(at * (palette.length - 1))];
    const top = bar.y + bar.height * (1 - (k + 1) / steps);
    context.fillRect(bar.x, top, bar.width, bar.height / steps + (k > 0 ? 0.6 : 0));
  }
  context.strokeStyle = pen.theme.line;
  context.lineWidth = em / 14;
  context.strokeRect(bar.x, bar.y, bar.width, bar.height);
  for (const {text, at} of ticks) {
    const y = bar.y + bar.height * (1 - at);
    context.beginPath();
    context.moveTo(bar.x + bar.width, y);
    context.lineTo(bar.x + bar.width + 0.35 * em, y);
    context.stroke();
    write(pen, text, bar.x + bar.width + 0.6 * em, y);
  }
  write(pen, largest, bar.x, bar.y + bar.height + 1.4 * em, {faint: true, size: 0.9});
}

// At the bottom left of a panel.
export function drawAxes(pen, x, y, {right, up, eye}) {
  const {context, em} = pen, length = 2.1 * em;
  const arms = kAxes.map(([name, [a, b, c], hex]) => {
    const axis = new THREE.Vector3(a, b, c);
    return {name, hex, x: axis.dot(right), y: axis.dot(up), depth: axis.dot(eye)};
  }).sort((a, b) => a.depth - b.depth);
  for (const arm of arms) {
    context.strokeStyle = arm.hex;
    context.lineWidth = em / 6.5;
    context.beginPath();
    context.moveTo(x, y);
    context.lineTo(x + length * arm.x, y - length * arm.y);
    context.stroke();
    if (Math.hypot(arm.x, arm.y) > 0.12)
      write(pen, arm.name, x + 1.32 * length * arm.x, y - 1.32 * length * arm.y, {align: "center", size: 0.9});
  }
}

export function drawScaleBar(pen, x, y, pixelsPerMetre, most, unit) {
  const length = roundBelow(most / pixelsPerMetre), pixels = length * pixelsPerMetre, {context, em} = pen;
  context.strokeStyle = pen.theme.ink;
  context.lineWidth = em / 8;
  context.beginPath();
  context.moveTo(x, y - 0.3 * em);
  context.lineTo(x, y);
  context.lineTo(x + pixels, y);
  context.lineTo(x + pixels, y - 0.3 * em);
  context.stroke();
  write(pen, quantityText(length, unit), x + pixels / 2, y - 0.95 * em, {align: "center", size: 0.9});
}

function drawDot({context, em}, x, y) {
  context.fillStyle = "#ff7a1a";
  context.strokeStyle = "#ffffff";
  context.lineWidth = em / 8;
  context.beginPath();
  context.arc(x, y, 0.36 * em, 0, 7);
  context.fill();
  context.stroke();
}

// A dot, and a label beside it that stays within [0, width].
export function drawProbe(pen, {x, y, lines, number}, width) {
  const {context, theme, em} = pen;
  drawDot(pen, x, y);
  context.font = `${0.9 * em}px ${kFont}`;
  const texts = lines.map((line, k) => k === 0 ? `${number}  ${line}` : line);
  const wide = Math.max(...texts.map(text => context.measureText(text).width)) + em, high = (1.25 * texts.length + 0.5) * em;
  const left = x + em + wide > width ? x - em - wide : x + em, top = y - high / 2;
  context.fillStyle = theme.box;
  context.strokeStyle = theme.line;
  context.lineWidth = 1;
  context.fillRect(left, top, wide, high);
  context.strokeRect(left, top, wide, high);
  texts.forEach((text, k) => write(pen, text, left + em / 2, top + (0.9 + 1.25 * k) * em, {size: 0.9}));
}

export function drawMeasure(pen, from, to, text) {
  const {context, em, theme} = pen;
  context.strokeStyle = "#ff7a1a";
  context.lineWidth = em / 7;
  context.setLineDash([0.5 * em, 0.3 * em]);
  context.beginPath();
  context.moveTo(...from);
  context.lineTo(...to);
  context.stroke();
  context.setLineDash([]);
  for (const end of [from, to]) drawDot(pen, ...end);
  const x = (from[0] + to[0]) / 2, y = (from[1] + to[1]) / 2;
  context.font = `600 ${em}px ${kFont}`;
  const wide = context.measureText(text).width + em;
  context.fillStyle = theme.box;
  context.fillRect(x - wide / 2, y - 0.8 * em, wide, 1.6 * em);
  write(pen, text, x, y, {align: "center", bold: true});
}
