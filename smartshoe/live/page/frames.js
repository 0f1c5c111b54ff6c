"use strict";
// A binary frame of the server (smartshoe/live/frames.py) as numbers.
function frameOf(buffer) {
  const view = new DataView(buffer);
  if (view.getUint8(0) !== 1) throw new Error("a frame of another version: load the page anew");
  const frame = { number: view.getUint32(4, true), now: view.getFloat64(8, true), width: view.getFloat64(16, true), shoes: [] };
  let at = 24;
  for (let shoe = view.getUint8(1); shoe > 0; shoe--) {
    const c = view.getUint32(at, true), n = view.getUint32(at + 4, true), f = view.getUint32(at + 8, true);
    const first = view.getFloat64(at + 12, true);
    at += 20;
    const take = (Kind, size) => { const taken = new Kind(buffer, at, size); at += 4 * size; return taken; };
    const places = take(Int32Array, n), values = take(Float32Array, c), feet = take(Float32Array, 4 * f);
    frame.shoes.push({ first, places, values, feet, low: take(Float32Array, n * c), high: take(Float32Array, n * c) });
  }
  return frame;
}

// The columns of one shoe that the page keeps: a ring by place, so that a column sent again replaces itself.
class Columns {
  constructor(units, size) {
    this.units = units; this.size = size;
    this.place = new Float64Array(size).fill(NaN);
    this.low = new Float32Array(size * units); this.high = new Float32Array(size * units);
  }
  add(part) {
    for (let k = 0; k < part.places.length; k++) {
      const place = part.first + part.places[k], row = ((place % this.size) + this.size) % this.size;
      this.place[row] = place;
      this.low.set(part.low.subarray(k * this.units, (k + 1) * this.units), row * this.units);
      this.high.set(part.high.subarray(k * this.units, (k + 1) * this.units), row * this.units);
    }
  }
  row(place) {
    const row = ((place % this.size) + this.size) % this.size;
    return this.place[row] === place ? row : -1;
  }
}
