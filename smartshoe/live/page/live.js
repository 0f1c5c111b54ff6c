// The page: one socket, one picture an animation frame, words twice a second; whole again after a reload.
const by = (id) => document.getElementById(id);
const COLOURS = ["toe", "meta1", "meta4", "heel"];
const MOST_NOTES = 500, MOST_STEPS = 400, AGAIN_MS = 1000;

const live = {
  socket: null, hello: null, state: null, columns: [], insoles: [], strips: [], notes: [], steps: [],
  last: null, seconds: 20, count: 600, width: 20 / 600, paused: false, marked: null, drawn: -1, lost: false,
};

function connect() {
  const socket = new WebSocket("ws://" + location.host + "/ws" + location.search);
  socket.binaryType = "arraybuffer";
  live.socket = socket;
  socket.onmessage = (event) => {
    if (typeof event.data === "string") told(JSON.parse(event.data)); else picture(frameOf(event.data));
  };
  socket.onclose = () => {
    live.lost = true;
    banner("The server does not answer: what it had acknowledged is kept. Trying again.");
    by("status").textContent = "no connection";
    setTimeout(connect, AGAIN_MS);
  };
}

function ask(what) {
  if (live.socket && live.socket.readyState === WebSocket.OPEN) live.socket.send(JSON.stringify(what));
}

function told(message) {
  if (message.type === "hello") begin(message);
  else if (message.type === "state") { live.state = message; words(); }
  else if (message.type === "task") task(message);
  else if (message.type === "news") {
    live.notes.push(...message.notes); live.steps.push(...message.steps);
    live.notes.splice(0, live.notes.length - MOST_NOTES); live.steps.splice(0, live.steps.length - MOST_STEPS);
    if (message.notes.length) noted();
    const failed = message.notes.find((note) => note.kind === "failed" || note.kind === "no_zero");
    if (failed) banner(failed.says, 8000);
  } else if (message.type === "view") {
    live.seconds = message.seconds; live.count = message.columns; live.width = message.seconds / message.columns;
    live.columns = live.hello.shoes.map((shoe) => new Columns(shoe.names.length, live.count + 8));
    for (const button of by("windows").children) button.setAttribute("aria-pressed", String(Number(button.dataset.seconds) === live.seconds));
  } else if (message.type === "refused") banner(message.says, 8000);
}

// A calibration session's page: what is to be done, how far the pressing is, and what it waits for.
function task(now) {
  for (const name of ["record", "mark", "zero", "weight", "weight-title"]) by(name).hidden = true;
  by("task").hidden = false;
  by("task-says").textContent = now.says;
  by("task-progress").parentElement.hidden = !now.experiment;
  by("task-progress").value = now.duration_s ? now.elapsed_s / now.duration_s : 0;
  by("task-progress-says").textContent = now.experiment + ": " + now.elapsed_s.toFixed(0) + " of " + now.duration_s.toFixed(0) + " s";
  by("task-answers").replaceChildren(...now.answers.map((answer) => {
    const button = document.createElement("button");
    button.type = "button"; button.textContent = answer;
    button.onclick = () => ask({ do: "answer", question: now.question, answer });
    return button;
  }));
}

function begin(hello) {
  const restarted = live.hello && live.hello.session !== hello.session;
  live.hello = hello; live.notes = hello.notes; live.steps = hello.steps; live.last = null;
  if (restarted) banner("The server was started anew; the notes of before are kept where it records.", 8000);
  else if (live.lost) banner("Connected again.", 3000);
  live.lost = false;
  told({ type: "view", ...hello.view });
  live.insoles = []; live.strips = [];
  hello.shoes.forEach((shoe, index) => {
    for (const foot of shoe.feet) live.insoles.push([index, shoe.feet.indexOf(foot), new Insole(foot, shoe.symbols, shoe.ranges)]);
    for (const strip of stripsOf(shoe, index)) live.strips.push(strip);
  });
  const order = (side) => (side === "right" ? 1 : 0);
  live.insoles.sort((a, b) => order(a[2].foot.side) - order(b[2].foot.side));
  live.strips.sort((a, b) => order(a.side) - order(b.side));
  by("feet").replaceChildren(...live.insoles.map((entry) => entry[2].figure));
  by("feet").hidden = !live.insoles.length;
  by("traces").replaceChildren(...live.strips.map((strip) => strip.element));
  noted(); fit();
  if (live.paused) pause(false);
}

function stripsOf(shoe, index) {
  const groups = new Map();
  shoe.names.forEach((name, column) => {
    const foot = shoe.feet.find((each) => each.columns.includes(column));
    const side = foot ? foot.side : null, key = side + " " + shoe.symbols[column];
    const region = foot ? foot.regions[foot.columns.indexOf(column)] : null;
    if (!groups.has(key)) groups.set(key, { side, symbol: shoe.symbols[column], units: [] });
    groups.get(key).units.push({ column, label: region || name, colour: region || COLOURS[column % 4] });
  });
  return [...groups.values()].map(({ side, symbol, units }) =>
    new Strip(side === null ? "other units" : side ? side + " foot" : "foot", index, units, symbol, side));
}

// As many columns as there are pixels, strips as high as the window has room for.
function fit() {
  const room = innerWidth > 640 ? (innerHeight - 110) / Math.max(live.strips.length, 1) - 50 : 180;
  for (const strip of live.strips) strip.height = Math.max(150, Math.min(room, 340));
  const wide = Math.max(100, Math.round((by("traces").clientWidth - LEFT) / 100) * 100);
  ask({ do: "view", seconds: live.seconds, columns: Math.min(wide, 1600) });
}

function picture(frame) {
  if (!live.hello || Math.abs(frame.width - live.width) > 1e-9) return;
  frame.shoes.forEach((part, k) => live.columns[k].add(part));
  if (live.last === null) requestAnimationFrame(draw);
  live.last = frame;
}

// Drawn once an animation frame however many frames came; the number of what is on the screen is told, for the latency.
function draw() {
  const frame = live.last;
  live.last = null;
  if (!frame) return;
  live.insoles.forEach(([shoe, foot, insole]) => {
    const part = frame.shoes[shoe];
    insole.draw(part.values, ...part.feet.subarray(4 * foot, 4 * foot + 4));
  });
  const last = Math.floor(frame.now / frame.width);
  for (const strip of live.strips) strip.draw(live.columns[strip.shoe], frame.width, last, live.seconds, live.notes, live.steps);
  live.drawn = frame.number;
}

const STATES = { streaming: "", opening: "opening", silent: "silent", away: "away, being called back", over: "at its end", failed: "stopped by a fault" };

function words() {
  const state = live.state, ill = state.shoes.filter((shoe) => STATES[shoe.state]);
  const rate = state.rate_hz.toFixed(state.rate_hz % 1 ? 1 : 0) + " Hz";
  const recording = state.recording ? "recording " + state.recording.file + ", " + counted(state.recording.samples) + " samples on disk" : (by("task").hidden ? "not recording" : "every sample is kept in the session's folder");
  by("status").textContent = ill.length
    ? ill.map((shoe) => shoe.shoe + " is " + STATES[shoe.state]).join("; ") + " · " + recording
    : rate + (live.hello.speed === 1 ? "" : ", " + live.hello.speed + " times as fast") + " · " + recording;
  const button = by("record");
  button.classList.toggle("on", Boolean(state.recording));
  button.lastChild.textContent = state.recording ? "Stop" : "Record";
  list(by("clock"), state.shoes.flatMap(clockWords));
  by("weight").textContent = state.weight
    ? Math.round(state.weight.value) + " N ± " + Math.round(state.weight.sd) + " N, " + (state.weight.value / 9.81).toFixed(0) + " kg"
    : "told from forces, after some strides or a stand: give --calibration for the units";
  const checks = state.checks.flat().filter((check) => check.verdict !== "unknown");
  list(by("checks"), checks.length ? checks.map((c) => [c.verdict, c.says]) : [["ok", state.samples ? "nothing to complain of in the last half minute" : "no samples yet"]]);
}

function clockWords(shoe) {
  const of = live.hello.shoes.length > 1 ? shoe.shoe + ": " : "";
  const share = (100 * shoe.lost) / Math.max(shoe.samples + shoe.lost, 1);
  const lost = shoe.lost ? counted(shoe.lost) + " lost (" + (share < 0.01 ? "under 0.01" : share.toFixed(2)) + "\u00a0%)" : "none lost";
  const words = [[shoe.lost ? "warning" : "ok", of + counted(shoe.samples) + " samples, " + lost]];
  if (STATES[shoe.state]) words.unshift([shoe.state === "over" ? "" : "fault", of + STATES[shoe.state]]);
  const clock = shoe.clock;
  if (clock.sd_ms === null) words.push(["unknown", of + "the clock is not known yet"]);
  else if (clock.sd_ms === 0) words.push(["ok", of + "time is the recording's own"]);
  else {
    words.push([clock.sd_ms < 1 ? "ok" : "warning", of + "times are right within " + (1.96 * clock.sd_ms).toFixed(clock.sd_ms < 0.05 ? 2 : 1) +
      " ms (95\u00a0%), up to one constant delay"]);
    words.push(["", of + "its clock is " + Math.abs(clock.skew_ppm).toFixed(0) + " ppm " + (clock.skew_ppm > 0 ? "slow" : "fast") + " against this computer's"]);
  }
  return words;
}

function counted(number) { return number.toLocaleString("en").replaceAll(",", "\u202f"); }

function list(element, items) {
  const key = JSON.stringify(items);
  if (element.saidKey === key) return;
  element.saidKey = key;
  element.replaceChildren(...items.map(([kind, text]) => {
    const item = document.createElement("li"); item.className = kind; item.textContent = text; return item;
  }));
}

function noted() {
  const items = [];
  let losses = null; // one after the other they are one line, so that a person's marks do not drown in them
  for (const note of live.notes.slice().reverse()) {
    const isGap = note.kind === "gap" && !note.before;
    if (isGap && losses) {
      losses.more++;
      losses.text.data = losses.says + "; " + losses.more + " more such since " + note.time_s.toFixed(2) + " s";
      continue;
    }
    if (items.length === 100) break;
    const item = document.createElement("li"), time = document.createElement("time");
    const text = document.createTextNode(note.says + (note.before ? " (before the restart)" : ""));
    item.className = note.kind + (note.before ? " before" : "");
    time.textContent = note.time_s.toFixed(2) + " s";
    item.append(time, text);
    items.push(item);
    losses = isGap ? { text, says: note.says, more: 0 } : null;
  }
  by("notes").replaceChildren(...items);
}

let bannerEnds = 0;
function banner(text, ms) {
  clearTimeout(bannerEnds);
  by("banner").textContent = text; by("banner").hidden = false;
  if (ms) bannerEnds = setTimeout(() => { by("banner").hidden = true; }, ms);
}

function pause(on) {
  live.paused = on;
  by("pause").setAttribute("aria-pressed", String(on));
  by("pause").lastChild.textContent = on ? "Go on" : "Pause";
  ask({ do: "pause", on });
  if (!on) fit();
}

function marking(on) {
  live.marked = on ? performance.now() : null;
  by("marking").hidden = !on;
  by("word").value = "";
  if (!on) return by("word").blur();
  by("marked").textContent = new Date().toLocaleTimeString();
  by("word").focus();
}

const record = () => ask({ do: "record", on: !(live.state && live.state.recording) });
by("record").onclick = record;
by("mark").onclick = () => marking(true);
by("zero").onclick = () => ask({ do: "zero" });
by("pause").onclick = () => pause(!live.paused);
by("unmark").onclick = () => marking(false);
by("marking").onsubmit = (event) => {
  event.preventDefault();
  ask({ do: "mark", word: by("word").value, age_s: (performance.now() - live.marked) / 1000 });
  marking(false);
};
const show = (seconds) => { live.seconds = seconds; fit(); };
for (const button of by("windows").children) button.onclick = () => show(Number(button.dataset.seconds));
const KEYS = { r: record, m: () => marking(true), z: () => ask({ do: "zero" }), " ": () => pause(!live.paused), 1: () => show(5), 2: () => show(20), 3: () => show(60) };
document.addEventListener("keydown", (event) => {
  if (event.key === "Escape" && live.marked !== null) return marking(false);
  if (!by("task").hidden && "rmz".includes(event.key)) return;
  if (event.target === by("word") || event.ctrlKey || event.metaKey || event.altKey || event.repeat || !KEYS[event.key]) return;
  event.preventDefault();
  KEYS[event.key]();
});
let fitting = 0;
addEventListener("resize", () => { clearTimeout(fitting); fitting = setTimeout(fit, 150); });
connect();
