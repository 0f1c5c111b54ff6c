"use strict";
// Draws the page's charts with uPlot: linked cursors and zoom, keyboard, themes, paper, the numbers behind.
(() => {
  const charts = JSON.parse(document.getElementById("charts").textContent);
  const drawn = new Map(); // figure's number -> its plots
  const MISSING = -32768, MOST_ROWS = 40, PAPER_PX = 640;

  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;

  function numbers(packed) {
    const steps = new Int16Array(bytes(packed.steps));
    return Array.from(steps, (k) => (k === MISSING ? null : packed.middle + k * packed.step));
  }

  function unpacked(chart) {
    if (!chart.data) {
      chart.data = {
        x: Array.from(new Float32Array(bytes(chart.x)), (v) => v + chart.x0),
        panels: chart.panels.map((panel) => panel.lines.map((line) => ({
          y: numbers(line.y), low: line.low && numbers(line.low), high: line.high && numbers(line.high),
        }))),
      };
    }
    return chart.data;
  }

  function short(value, digits = 4) {
    if (value === null || value === undefined) return "–";
    if (value === 0) return "0";
    const size = Math.abs(value);
    if (size >= 1e6 || size < 1e-4) return value.toExponential(digits - 1).replaceAll("-", "−");
    return value.toFixed(Math.max(0, digits - 1 - Math.floor(Math.log10(size)))).replace("-", "−");
  }
  const day = (seconds) => new Date(1000 * seconds).toISOString().slice(0, 10);
  // Of x as many digits as part neighbours: whole numbers have none behind the point, close times more than four in all.
  function shownX(chart, value) {
    if (value === null || value === undefined) return "–";
    if (chart.dates) return day(value);
    const x = chart.data.x;
    if (chart.whole === undefined) {
      chart.whole = x.every(Number.isInteger);
      chart.places = x.length < 2 || chart.logX ? 0 : Math.min(4, Math.ceil(-0.01 - Math.log10((x[x.length - 1] - x[0]) / (chart.of - 1))));
    }
    if (chart.whole) return String(value).replace("-", "−");
    const said = short(value), places = (said.split(".")[1] || "").length;
    return places < chart.places ? value.toFixed(chart.places).replace("-", "−") : said;
  }

  // What is seen of a panel, with bands and bars, so that nothing is cut off.
  function limits(lines, u) {
    let low = Infinity, high = -Infinity;
    const [first, last] = u.series[0].idxs;
    for (const line of lines) for (const values of [line.y, line.low, line.high]) {
      if (!values) continue;
      for (let k = first; k <= last; k++) {
        const v = values[k];
        if (v === null) continue;
        if (v < low) low = v;
        if (v > high) high = v;
      }
    }
    if (low > high) return [0, 1];
    const margin = 0.06 * (high - low) || 0.05 * Math.abs(high) || 1;
    return [low - (low === 0 ? 0 : margin), high + margin];
  }

  // Places of each run of true, so that nothing is drawn where there is nothing.
  function runs(flags) {
    const found = [];
    flags.forEach((flag, k) => { if (flag) { if (!k || !flags[k - 1]) found.push([]); found[found.length - 1].push(k); } });
    return found;
  }

  // Under the grid: shaded spans, bands about lines; over it: error bars.
  function under(chart, panel, data, u) {
    const { ctx, bbox } = u, at = (v, scale) => u.valToPos(v, scale, true), x = chart.data.x;
    ctx.save();
    ctx.beginPath(); ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height); ctx.clip();
    for (const [start, end, name] of chart.marks) {
      ctx.fillStyle = ctx.strokeStyle = colour(name);
      if (end > start) {
        ctx.globalAlpha = 0.16;
        ctx.fillRect(at(start, "x"), bbox.top, at(end, "x") - at(start, "x"), bbox.height);
      } else {
        ctx.globalAlpha = 1; ctx.setLineDash([6, 4]); ctx.lineWidth = devicePixelRatio;
        ctx.beginPath(); ctx.moveTo(at(start, "x"), bbox.top); ctx.lineTo(at(start, "x"), bbox.top + bbox.height);
        ctx.stroke(); ctx.setLineDash([]);
      }
    }
    panel.lines.forEach((line, i) => {
      const { low, high } = data[i];
      if (!low || !high || !u.series[i + 1].show) return;
      ctx.fillStyle = ctx.strokeStyle = colour(line.colour);
      if (line.style === "points") {
        ctx.globalAlpha = 1; ctx.lineWidth = devicePixelRatio; ctx.beginPath();
        x.forEach((v, k) => {
          if (low[k] === null) return;
          ctx.moveTo(at(v, "x"), at(low[k], "y")); ctx.lineTo(at(v, "x"), at(high[k], "y"));
        });
        ctx.stroke();
      } else {
        ctx.globalAlpha = 0.22;
        for (const there of runs(x.map((_, k) => low[k] !== null && high[k] !== null))) {
          ctx.beginPath();
          there.forEach((k, n) => ctx[n ? "lineTo" : "moveTo"](at(x[k], "x"), at(high[k], "y")));
          there.reverse().forEach((k) => ctx.lineTo(at(x[k], "x"), at(low[k], "y")));
          ctx.closePath(); ctx.fill();
        }
      }
    });
    ctx.restore();
  }

  const wide = (u, values) => (values ? Math.max(34, 14 + 6.6 * Math.max(...values.map((v) => String(v ?? "").length))) : 34);

  function axis(chart, label, isX) {
    const made = {
      stroke: () => colour("ink"), grid: { stroke: () => colour("line"), width: 1 },
      ticks: { stroke: () => colour("line"), size: 5 },
      font: "12px system-ui, sans-serif", labelFont: "12px system-ui, sans-serif", label, labelSize: isX ? 22 : 20, gap: 3,
    };
    if (isX) {
      made.size = 26; made.space = chart.dates ? 95 : 70;
      if (chart.dates) made.values = (u, splits) => splits.map(day);
      else if (chart.logX) {
        made.splits = (u) => (chart.data.x.length <= 12 ? chart.data.x : logTicks(u.scales.x.min, u.scales.x.max, u.bbox.width / devicePixelRatio));
        made.filter = (u, splits) => splits;
      }
    } else {
      made.size = wide; made.space = 20;  // a low panel about zero needs a number beside it
    }
    if (!made.values) made.values = (u, splits) => splits.map((v) => (v === null ? "" : tick(v, chart.logX && isX ? 0 : splits[1] - splits[0])));
    return made;
  }

  // As many digits as part it from its neighbours, a step away; of a logarithmic axis three.
  function tick(value, step) {
    const told = step > 0 ? value.toFixed(Math.min(Math.max(1 - Math.floor(Math.log10(step)), 0), 20)) : value.toPrecision(3);
    return String(+told).replace("-", "−");
  }

  // Round numbers on a logarithmic axis: as many as keep their labels apart, and two at least.
  function logTicks(low, high, width) {
    const decades = [];
    for (let k = Math.floor(Math.log10(low)); k <= Math.ceil(Math.log10(high)); k++) decades.push(k);
    const tenths = Array.from({ length: 90 }, (_, k) => 1 + k / 10);
    const steps = [[1], [1, 3], [1, 2, 5], [1, 2, 3, 5, 7], [1, 1.5, 2, 3, 4, 5, 6, 7, 8, 9], tenths].map((each) =>
      decades.flatMap((k) => each.map((v) => +(v * 10 ** k).toPrecision(3))).filter((v) => v >= low && v <= high));
    const apart = (ticks) => Math.min(...ticks.slice(1).map((v, k) => (Math.log(v / ticks[k]) / Math.log(high / low)) * width));
    const fitting = steps.filter((ticks) => ticks.length > 1 && apart(ticks) >= 46);
    return fitting.length ? fitting[fitting.length - 1] : [+low.toPrecision(2), +high.toPrecision(2)].filter((v) => v >= low && v <= high);
  }

  function series(line) {
    const points = line.style === "points";
    return {
      label: line.label, stroke: () => colour(line.colour), width: points ? 0 : 1.5,
      dash: line.style === "dashed" ? [6, 4] : undefined, paths: points ? () => null : undefined,
      points: points ? { show: true, size: 6, fill: () => colour(line.colour) } : { size: 5, show: line.style === "dashed" ? false : undefined },
      value: (u, v) => short(v),
    };
  }

  let zooming = false;
  function follow(u) {
    if (zooming || !u.ready) return;
    zooming = true;
    const { min, max } = u.scales.x;
    for (const plots of drawn.values()) for (const other of plots) {
      if (other !== u && other.group === u.group) other.setScale("x", { min, max });
    }
    zooming = false;
    const whole = min <= u.whole[0] && max >= u.whole[1];
    document.querySelectorAll("figure.chart").forEach((figure) => {
      const plots = drawn.get(figure.dataset.chart);
      if (plots && plots[0].group === u.group) {
        figure.querySelector("button.whole").hidden = whole;
        tellThin(figure, plots[0]);
        fillNumbers(figure);
      }
    });
  }

  // Where the page keeps too few samples for what is zoomed into, a line between extremes is not the signal's course.
  function tellThin(figure, u) {
    const chart = charts[+figure.dataset.chart], { min, max } = u.scales.x, x = chart.data.x;
    const seen = x.reduce((n, v) => n + (v >= min && v <= max), 0);
    const there = chart.of * (Math.min(max, u.whole[1]) - Math.max(min, u.whole[0])) / (u.whole[1] - u.whole[0]);
    const thin = figure.querySelector(".thin"), isThin = x.length < chart.of && seen < 0.9 * there && seen < u.bbox.width / devicePixelRatio / 2;
    thin.hidden = !isThin;
    thin.textContent = isThin ? "Zoomed in beyond what the page keeps: straight pieces join the extremes of a stretch." : "";
  }

  function widthOf(plot) {
    return document.documentElement.hasAttribute("data-printing") ? PAPER_PX : Math.max(200, plot.clientWidth);
  }

  function draw(figure) {
    const key = figure.dataset.chart, chart = charts[+key], plot = figure.querySelector(".plot");
    if (drawn.has(key) || (plot.clientWidth === 0 && !document.documentElement.hasAttribute("data-printing"))) return;
    if (plot.closest("details:not([open])")) return;
    const data = unpacked(chart), group = chart.group || "chart-" + key;
    const edge = [data.x[0], data.x[data.x.length - 1]];
    const plots = chart.panels.map((panel, p) => {
      const last = p === chart.panels.length - 1;
      const u = new uPlot({
        width: widthOf(plot), height: panel.height + (last ? 48 : 8), ms: 1,
        scales: {
          x: { time: false, distr: chart.logX ? 3 : 1, range: (u, min, max) => [min, max] },
          y: { range: (u) => panel.limits || limits(data.panels[p], u) },
        },
        axes: [
          last ? axis(chart, chart.xLabel, true) : { ...axis(chart, undefined, true), size: 8, labelSize: 0, values: (u, s) => s.map(() => "") },
          axis(chart, panel.label, false),
        ],
        series: [{ label: chart.xLabel, value: (u, v) => shownX(chart, v) }, ...panel.lines.map(series)],
        legend: { markers: { dash: (u, k) => (u.series[k].dash ? "dashed" : "solid") } },
        cursor: { sync: { key: group, scales: ["x", null] }, drag: { x: true, y: false, dist: 6 }, points: { size: 7 } },
        hooks: { drawAxes: [(u) => under(chart, panel, data.panels[p], u)], setScale: [(u, k) => k === "x" && follow(u)] },
      }, [data.x, ...data.panels[p].map((line) => line.y)], plot);
      u.group = group; u.whole = edge; u.ready = true; u.panel = panel;
      return u;
    });
    drawn.set(key, plots);
    if (chart.window) zoom(plots, ...chart.window);
    plot.addEventListener("keydown", (event) => onKey(event, chart, plots));
    figure.querySelector("button.whole").addEventListener("click", () => zoom(plots, ...edge));
    const own = figure.querySelector("button.own");
    if (chart.panels.some((panel) => panel.limits)) {
      own.hidden = false;
      own.addEventListener("click", () => {
        chart.panels.forEach((panel) => { [panel.limits, panel.kept] = [panel.kept || null, panel.limits]; });
        own.setAttribute("aria-pressed", String(!chart.panels[0].limits));
        plots.forEach((u) => u.setScale("x", { min: u.scales.x.min, max: u.scales.x.max }));
      });
    }
    figure.querySelector("details.numbers").addEventListener("toggle", () => fillNumbers(figure));
  }

  const zoom = (plots, min, max) => plots.forEach((u) => u.setScale("x", { min, max }));

  function onKey(event, chart, plots) {
    const u = plots[0], x = chart.data.x, { min, max } = u.scales.x, middle = (min + max) / 2;
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (step) {
      const seen = x.map((_, k) => k).filter((k) => x[k] >= min && x[k] <= max);
      const stride = (event.shiftKey ? 10 : 1) * Math.max(1, Math.round(seen.length / 200));
      const from = u.cursor.idx ?? (step > 0 ? seen[0] - stride : seen[seen.length - 1] + stride);
      const to = Math.min(Math.max(from + step * stride, seen[0]), seen[seen.length - 1]);
      u.setCursor({ left: u.valToPos(x[to], "x"), top: 10 }, true, true);
      const live = u.root.closest("figure").querySelector(".live");
      live.textContent = chart.xLabel + " " + shownX(chart, x[to]) + ": " + chart.data.panels.flatMap((lines, p) =>
        lines.map((line, i) => chart.panels[p].lines[i].label + " " + short(line.y[to]))).join(", ");
    } else if (event.key === "+" || event.key === "=") {
      const at = u.cursor.idx === null || u.cursor.idx === undefined ? middle : x[u.cursor.idx];
      zoom(plots, at - (at - min) / 2, at + (max - at) / 2);
    } else if (event.key === "-") {
      zoom(plots, Math.max(u.whole[0], min - (max - min) / 2), Math.min(u.whole[1], max + (max - min) / 2));
    } else if (event.key === "0" || event.key === "Escape") {
      zoom(plots, ...u.whole);
    } else return;
    event.preventDefault();
  }

  // A column's heading: the line's name with the unit, and which panel it is of where there are several.
  function headOf(chart, panel, line) {
    if (panel.label.startsWith(line.label + " (")) return panel.label;
    if (chart.panels.length > 1) return line.label + ", " + panel.label;
    const unit = panel.label.match(/ \([^()]*\)$/);
    return line.label + (unit && !line.label.endsWith(")") ? unit[0] : "");
  }

  function fillNumbers(figure) {
    const details = figure.querySelector("details.numbers");
    if (!details.open) return;
    const chart = charts[+figure.dataset.chart], data = unpacked(chart), u = drawn.get(figure.dataset.chart)[0];
    const { min, max } = u.scales.x, seen = [];
    data.x.forEach((v, k) => { if (v >= min && v <= max) seen.push(k); });
    const every = Math.max(1, Math.ceil(seen.length / MOST_ROWS));
    const table = document.createElement("table"), head = table.createTHead().insertRow();
    const columns = [];
    chart.panels.forEach((panel, p) => panel.lines.forEach((line, i) => {
      columns.push([headOf(chart, panel, line), data.panels[p][i].y]);
      const whose = chart.panels.length > 1 || panel.lines.some((other) => other !== line && other.low) ? line.label + ", " : "";
      for (const name of ["low", "high"]) if (data.panels[p][i][name]) columns.push([whose + name, data.panels[p][i][name]]);
    }));
    for (const name of [chart.xLabel, ...columns.map((c) => c[0])]) {
      const cell = document.createElement("th"); cell.scope = "col"; cell.textContent = name; head.append(cell);
    }
    const rows = table.createTBody();
    for (let n = 0; n < seen.length; n += every) {
      const row = rows.insertRow(), k = seen[n];
      row.insertCell().textContent = shownX(chart, data.x[k]);
      for (const [, values] of columns) row.insertCell().textContent = short(values[k]);
    }
    const note = document.createElement("p");
    note.className = "note";
    note.textContent = (every > 1 ? table.tBodies[0].rows.length + " of the " : "All ") + seen.length + " points that are shown"
      + (chart.of > data.x.length ? "; the record has " + chart.of + " samples, of which the page keeps " + data.x.length + " with every extreme." : ".");
    const box = details.querySelector(".scroll");
    box.replaceChildren(table, note);
  }

  // A link to a folded part unfolds it.
  function unfold() {
    const target = location.hash && document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (target && target.tagName === "DETAILS") target.open = true;
  }
  addEventListener("hashchange", unfold);
  document.querySelectorAll('a[href^="#"]').forEach((link) => link.addEventListener("click", () => setTimeout(unfold)));
  unfold();

  const figures = [...document.querySelectorAll("figure.chart")];
  const EARLY_PX = 400; // before it comes into sight a chart is drawn
  const inSight = new IntersectionObserver((seen) => {
    for (const entry of seen) if (entry.isIntersecting) { draw(entry.target); inSight.unobserve(entry.target); }
  }, { rootMargin: EARLY_PX + "px" });
  // What is in sight from the beginning is drawn at once: a browser that only takes a picture shows no frame, and so
  // never tells what comes into sight.
  figures.forEach((figure) => {
    if (figure.getBoundingClientRect().top < innerHeight + EARLY_PX) draw(figure);
    inSight.observe(figure);
  });
  document.querySelectorAll("details").forEach((details) => details.addEventListener("toggle", () => {
    if (details.open) details.querySelectorAll("figure.chart").forEach((figure) => { inSight.unobserve(figure); inSight.observe(figure); });
  }));

  function resize() {
    for (const figure of figures) {
      const plots = drawn.get(figure.dataset.chart), plot = figure.querySelector(".plot");
      if (plots && (plot.clientWidth || document.documentElement.hasAttribute("data-printing"))) {
        plots.forEach((u) => u.setSize({ width: widthOf(plot), height: u.height }));
      }
    }
  }
  const redraw = () => { for (const plots of drawn.values()) plots.forEach((u) => u.redraw(false, true)); };
  let wait = 0;
  addEventListener("resize", () => { clearTimeout(wait); wait = setTimeout(resize, 80); });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  addEventListener("beforeprint", () => {
    document.documentElement.setAttribute("data-printing", "");
    figures.forEach(draw); resize(); redraw();
  });
  addEventListener("afterprint", () => { document.documentElement.removeAttribute("data-printing"); resize(); redraw(); });
})();
