// The drawn insole: units by colour and number, the centre of pressure with its last second.
const PHASES = ["swing", "on the heel", "flat", "push off"];
const TRAIL = 50;

// Colours and widths are asked for once: each question makes the browser lay the page out, sixty times a second.
const colours = new Map(), NUMBERS_MS = 200;
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => colours.clear());

function css(name) {
  if (!colours.has(name)) colours.set(name, getComputedStyle(document.documentElement).getPropertyValue(name).trim());
  return colours.get(name);
}

const resized = new ResizeObserver((entries) => { for (const entry of entries) entry.target.wide = entry.contentRect.width; });

function wideOf(canvas) {
  if (canvas.wide === undefined) { canvas.wide = canvas.clientWidth; resized.observe(canvas); }
  return canvas.wide;
}

function canvasFor(canvas, height) {
  const ratio = window.devicePixelRatio || 1, width = wideOf(canvas);
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio);
    canvas.style.height = height + "px";
  }
  const g = canvas.getContext("2d");
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  g.clearRect(0, 0, width, height);
  return [g, width, height];
}

function mixed(low, high, share) {
  const parts = (text) => [1, 3, 5].map((k) => parseInt(text.slice(k, k + 2), 16));
  const a = parts(low), b = parts(high);
  return "rgb(" + a.map((v, k) => Math.round(v + (b[k] - v) * share)).join(",") + ")";
}

class Insole {
  constructor(foot, symbols, ranges) {
    this.foot = foot; this.symbols = symbols; this.trail = []; this.numbers = []; this.toldMs = -NUMBERS_MS;
    this.most = foot.columns.map((c) => (ranges[c] ? 0.2 * ranges[c] : 50));
    this.figure = document.createElement("figure");
    this.canvas = document.createElement("canvas");
    this.caption = document.createElement("figcaption");
    this.figure.append(this.canvas, this.caption);
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", (foot.side || "the") + " insole");
  }
  draw(values, phase, load, along, medial) {
    const inward = this.foot.side === "right" ? -1 : 1; // a left foot's inner edge is on the right as one looks down
    const wide = wideOf(this.canvas), [g, w, h] = canvasFor(this.canvas, Math.min(2.35 * wide, 380));
    const scale = Math.min(w / 0.42, (h - 16) / 1.04);
    const at = (a, m) => [w / 2 + inward * m * scale, h - 8 - (a + 0.02) * scale];
    g.beginPath();
    const points = INSOLE.outline.map(([a, m]) => at(a, m)), n = points.length;
    const middle = (p, q) => [(p[0] + q[0]) / 2, (p[1] + q[1]) / 2];
    g.moveTo(...middle(points[n - 1], points[0]));
    points.forEach((p, k) => g.quadraticCurveTo(...p, ...middle(p, points[(k + 1) % n])));
    g.closePath();
    g.fillStyle = css("--insole"); g.fill();
    g.strokeStyle = css("--skin"); g.lineWidth = 1.5; g.stroke();
    const radius = 0.068 * scale;
    // Nobody reads numbers that change with each picture.
    const now = performance.now(), isTold = now - this.toldMs >= NUMBERS_MS;
    if (isTold) { this.toldMs = now; this.numbers = this.foot.columns.map((column) => numberOf(values[column])); }
    this.foot.columns.forEach((column, k) => {
      const region = this.foot.regions[k], value = values[column];
      this.most[k] = Math.max(this.most[k], Math.abs(value) || 0);
      const share = Math.min(Math.max(value / Math.max(...this.most), 0), 1) || 0;
      const [x, y] = at(...INSOLE.places[region]);
      g.beginPath(); g.arc(x, y, radius, 0, 7);
      g.fillStyle = mixed(css("--low"), css("--high"), share); g.fill();
      g.lineWidth = 3; g.strokeStyle = css("--" + region); g.stroke();
      g.fillStyle = share > 0.5 ? css("--page") : css("--ink");
      g.font = "600 " + Math.max(11, Math.round(radius * 0.72)) + "px system-ui, sans-serif";
      g.textAlign = "center"; g.textBaseline = "middle";
      g.fillText(this.numbers[k], x, y);
    });
    if (Number.isFinite(along)) this.trail.push([along, medial]); else this.trail.push(null);
    if (this.trail.length > TRAIL) this.trail.shift();
    g.lineWidth = 2; g.strokeStyle = css("--bad");
    this.trail.forEach((point, k) => {
      const before = this.trail[k - 1];
      if (!point || !before) return;
      g.globalAlpha = (0.7 * k) / TRAIL;
      g.beginPath(); g.moveTo(...at(...before)); g.lineTo(...at(...point)); g.stroke();
    });
    g.globalAlpha = 1;
    if (Number.isFinite(along)) {
      // A ring, so that the number beneath can be read.
      g.beginPath(); g.arc(...at(along, medial), 7, 0, 7);
      g.lineWidth = 5; g.strokeStyle = css("--card"); g.stroke();
      g.lineWidth = 2.5; g.strokeStyle = css("--bad"); g.stroke();
    }
    if (!isTold) return;
    const symbol = this.symbols[this.foot.columns[0]];
    const same = this.foot.columns.every((c) => this.symbols[c] === symbol);
    say(this.caption, [["b", (this.foot.side || "foot") + ": " + (PHASES[phase] || "no step yet")],
      ["", same ? numberOf(load) + " " + symbol + " in all" : ""]]);
  }
}

function numberOf(value) {
  if (!Number.isFinite(value)) return "–";
  const text = Math.abs(value) < 9.95 ? value.toFixed(1) : value.toFixed(0);
  return text === "-0.0" ? "0.0" : text === "-0" ? "0" : text;
}

// Replace an element's words only where they changed; [tag, text] pairs, no markup is ever read.
function say(element, parts) {
  const key = JSON.stringify(parts);
  if (element.saidKey === key) return;
  element.saidKey = key;
  element.replaceChildren(...parts.filter(([, text]) => text).map(([tag, text]) => {
    if (!tag) return document.createTextNode(text);
    const made = document.createElement(tag); made.textContent = text; return made;
  }));
}
