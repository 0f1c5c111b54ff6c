// Rolling traces: a strip for each foot (and unit of measurement), each column of pixels from its least to its greatest.
const BAND = 9, BELOW = 16, LEFT = 42;

class Strip {
  constructor(title, shoe, units, symbol, side) {
    this.height = 190; this.shoe = shoe; this.units = units; this.side = side; this.top = 1; this.bottom = 0;
    this.element = document.createElement("div"); this.element.className = "strip";
    const head = document.createElement("p"), name = document.createElement("b");
    name.textContent = title + ", " + symbol; head.append(name);
    for (const unit of units) head.append(keyOf("var(--" + unit.colour + ")", unit.label, ""));
    if (side !== null) [1, 2, 3].forEach((k) => head.append(keyOf("var(--phase" + k + ")", PHASES[k], "band")));
    this.canvas = document.createElement("canvas");
    this.canvas.setAttribute("role", "img"); this.canvas.setAttribute("aria-label", "traces of " + title);
    this.element.append(head, this.canvas);
  }
  draw(columns, width, last, seconds, notes, steps) {
    const [g, w, h] = canvasFor(this.canvas, this.height);
    const count = Math.round(seconds / width), right = w - 2, bottom = h - BELOW - (this.side === null ? 0 : BAND + 2);
    const x = (time) => LEFT + ((time - (last + 1) * width) / seconds + 1) * (right - LEFT);
    this.scale(columns, last, count);
    const y = (value) => bottom - ((value - this.bottom) / (this.top - this.bottom)) * (bottom - 8);
    this.grid(g, x, y, bottom, h, right, (last + 1) * width, seconds);
    g.save(); g.beginPath(); g.rect(LEFT, 0, right - LEFT, h - BELOW); g.clip();
    if (this.side !== null) this.phases(g, x, bottom + 2, steps, (last + 1) * width);
    this.marks(g, x, bottom, notes, (last + 1) * width - seconds);
    g.lineWidth = 1.6; g.lineJoin = "bevel";
    for (const unit of this.units) {
      g.strokeStyle = css("--" + unit.colour);
      g.beginPath();
      let before = -Infinity;
      for (let place = last - count; place <= last; place++) {
        const row = columns.row(place);
        if (row < 0) continue;
        const low = columns.low[row * columns.units + unit.column], high = columns.high[row * columns.units + unit.column];
        if (!Number.isFinite(low)) continue;
        const at = x((place + 0.5) * width);
        // A pause longer than a tenth of a second is a break in the line.
        if ((place - before) * width > 0.1 + width) g.moveTo(at, y(low)); else g.lineTo(at, y(low));
        if (high > low) g.lineTo(at, y(high));
        before = place;
      }
      g.stroke();
    }
    g.restore();
  }
  scale(columns, last, count) {
    let most = -Infinity, least = 0;
    for (let place = last - count; place <= last; place++) {
      const row = columns.row(place);
      if (row < 0) continue;
      for (const unit of this.units) {
        const high = columns.high[row * columns.units + unit.column], low = columns.low[row * columns.units + unit.column];
        if (high > most) most = high;
        if (low < least) least = low;
      }
    }
    if (!Number.isFinite(most)) return;
    const step = niceStep(Math.max(most - least, 2) / 4);
    const top = Math.max(Math.ceil((most * 1.02) / step), 1) * step, bottom = least < -0.05 * top ? Math.floor(least / step) * step : Math.min(least, 0);
    // The scale grows at once and shrinks only by much, so that it does not breathe with each step.
    if (top > this.top || top < 0.6 * this.top) this.top = top;
    if (bottom < this.bottom || bottom > 0.6 * this.bottom) this.bottom = bottom;
  }
  grid(g, x, y, bottom, h, right, now, seconds) {
    g.strokeStyle = css("--grid"); g.fillStyle = css("--soft"); g.lineWidth = 1;
    g.font = "11px system-ui, sans-serif"; g.textBaseline = "middle"; g.textAlign = "right";
    const step = niceStep((this.top - this.bottom) / 4);
    for (let v = Math.ceil(this.bottom / step) * step; v <= this.top + 1e-9; v += step) {
      g.beginPath(); g.moveTo(LEFT, y(v)); g.lineTo(right, y(v)); g.stroke();
      g.fillText(String(Math.round(v * 100) / 100), LEFT - 5, y(v));
    }
    const every = seconds <= 5 ? 1 : seconds <= 20 ? 5 : 10;
    g.textAlign = "center"; g.textBaseline = "bottom";
    for (let t = Math.ceil((now - seconds) / every) * every; t <= now; t += every) {
      if (t < 0) continue;
      g.beginPath(); g.moveTo(x(t), 4); g.lineTo(x(t), bottom); g.stroke();
      if (x(t) > LEFT + 12 && x(t) < right - 14) g.fillText(t + " s", x(t), h);
    }
  }
  phases(g, x, top, steps, now) {
    const own = steps.filter((step) => step.foot === this.side);
    own.forEach((step, k) => {
      const phase = { heel_strike: 1, foot_flat: 2, heel_off: 3 }[step.event];
      if (!phase) return;
      const end = k + 1 < own.length ? own[k + 1].time_s : now;
      g.fillStyle = css("--phase" + phase);
      g.fillRect(x(step.time_s), top, Math.max(x(end) - x(step.time_s), 1), BAND - 2);
    });
  }
  marks(g, x, bottom, notes, from) {
    g.font = "12px system-ui, sans-serif"; g.textBaseline = "top"; g.textAlign = "left";
    const shown = notes.filter((note) => !note.before && note.time_s >= from && SHOWN[note.kind] && (note.shoe === null || note.shoe === this.shoe));
    // A person's marks come first, losses last: they are short strokes, with a word only where it stands free.
    const rank = (note) => (note.kind === "mark" ? 0 : note.kind === "gap" ? 2 : 1), taken = [];
    const strokes = shown.filter((note) => note.kind === "gap").map((note) => x(note.time_s));
    for (const note of shown.sort((a, b) => rank(a) - rank(b))) {
      const at = Math.round(x(note.time_s)) + 0.5, isMark = note.kind === "mark", isGap = note.kind === "gap";
      g.strokeStyle = g.fillStyle = css(isMark ? "--ink" : "--warn");
      g.lineWidth = 1; g.setLineDash(isMark || isGap ? [] : [3, 3]);
      g.beginPath(); g.moveTo(at, 2); g.lineTo(at, isGap ? 14 : bottom); g.stroke();
      const word = isMark ? note.says : SHOWN[note.kind], end = at + g.measureText(word).width + 8;
      if (taken.some(([left, right]) => at < right && end > left) || (isGap && strokes.some((other) => other > at + 1 && other < end))) continue;
      taken.push([at, end]);
      g.fillText(word, at + 3, 2);
    }
    g.setLineDash([]);
  }
}

// Notes that stand in the traces, and the word for them.
const SHOWN = { mark: "mark", zero: "zero", gap: "lost", disconnected: "away", reconnected: "back", restarted: "restart", silence: "silent" };

function niceStep(rough) {
  const power = 10 ** Math.floor(Math.log10(rough)), share = rough / power;
  return power * (share <= 1 ? 1 : share <= 2 ? 2 : share <= 5 ? 5 : 10);
}

function keyOf(colour, label, kind) {
  const key = document.createElement("span"), line = document.createElement("i");
  key.className = "key"; line.className = kind; line.style.background = colour;
  key.append(line, label);
  return key;
}
