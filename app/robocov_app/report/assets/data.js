// What is embedded, read back: see embedding.py.

const NONE = 65535;

function numbersOf(text) {
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let k = 0; k < raw.length; k += 1) bytes[k] = raw.charCodeAt(k);
  const view = new DataView(bytes.buffer);
  const values = new Float32Array(raw.length / 2);
  for (let k = 0; k < values.length; k += 1) {
    const word = view.getUint16(2 * k, true);
    values[k] = word === NONE ? NaN : word / (NONE - 1);
  }
  return values;
}

/** Rows of numbers at even times from 0; the last row is at the end, however near. */
class Series {
  constructor(text, width, step, count, end) {
    Object.assign(this, { width, step, count, end, values: numbersOf(text) });
  }

  /** The row at or before a time. */
  before(time) {
    if (time >= this.end) return this.count - 1;
    return Math.max(Math.min(Math.floor(time / this.step + 1e-9), this.count - 2), 0);
  }

  timeOf(row) {
    return row >= this.count - 1 ? this.end : row * this.step;
  }

  /** The row at any time, linear in between; NaN where either neighbour is. */
  at(time) {
    const row = this.before(time);
    const from = this.values.subarray(row * this.width, (row + 1) * this.width);
    const begin = this.timeOf(row);
    if (row === this.count - 1 || time <= begin) return from;
    const to = this.values.subarray((row + 1) * this.width, (row + 2) * this.width);
    const part = (time - begin) / (this.timeOf(row + 1) - begin);
    return from.map((value, k) => value + (to[k] - value) * part);
  }
}

class Plan {
  /** `again` is called when there is more to be drawn than at first. */
  constructor(data, again) {
    const metres = (ring) => Float64Array.from(ring, (value) => value * data.unit);
    this.name = data.name;
    [this.left, this.low, this.right, this.high] = metres(data.bounds);
    this.width = this.right - this.left;
    this.height = this.high - this.low;
    this.region = metres(data.region);
    this.blocked = data.blocked.map((rings) => rings.map(metres));
    if (data.density) {
      this.density = new Image();
      this.density.onload = again;
      this.density.src = data.density;
    }
  }
}

class Run {
  constructor(data, plan) {
    Object.assign(this, data, { plan, robots: data.numbers.length });
    this.where = new Series(data.positions, 2 * this.robots, data.step, data.count, data.end);
    this.goals = data.goals && new Series(data.goals, 2 * this.robots, data.step, data.count, data.end);
    this.range = data.cost;
    this.cost = data.cost && new Series(data.cost.values, 1, data.cost.step, data.cost.count, data.end);
    this.speeds = data.speeds ?? null; // where cells are by time
    this.radii = Array.from({ length: this.robots }, (_, k) => (Array.isArray(data.radius) ? data.radius[k] : data.radius));
  }

  /** Places in metres, x and y in turn. Where the record tells no path, robots stay until they are there. */
  placesAt(time, series = this.where) {
    return this.metres(series.at(this.path || time >= this.end ? time : 0));
  }

  metres(row) {
    const { left, low, width, height } = this.plan;
    return Float64Array.from(row, (value, k) => (k % 2 ? low + value * height : left + value * width));
  }

  /** Mean distance to the nearest robot in metres, NaN where it is not known. */
  costAt(time) {
    if (!this.cost) return NaN;
    const { low, high, last } = this.range;
    if (time >= this.end && last !== null) return last;
    return low + this.cost.at(time)[0] * (high - low);
  }
}
