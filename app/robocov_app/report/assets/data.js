// Reads the data written by embedding.py.

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

/** Rows of numbers at equal time steps from 0. The last row is at the end, which may be less than a step later. */
class Series {
  constructor(text, width, step, count, end) {
    Object.assign(this, { width, step, count, end, values: numbersOf(text) });
  }

  /** Index of the last row at or before a time. */
  before(time) {
    if (time >= this.end) return this.count - 1;
    return Math.max(Math.min(Math.floor(time / this.step + 1e-9), this.count - 2), 0);
  }

  timeOf(row) {
    return row >= this.count - 1 ? this.end : row * this.step;
  }

  /** The row at any time, interpolated linearly; NaN if a neighboring row is. */
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

class ArenaMap {
  /** `again` is called to draw again when more has been loaded, such as an image. */
  constructor(data, again) {
    const meters = (ring) => Float64Array.from(ring, (value) => value * data.unit);
    this.name = data.name;
    [this.left, this.low, this.right, this.high] = meters(data.bounds);
    this.width = this.right - this.left;
    this.height = this.high - this.low;
    this.region = meters(data.region);
    this.blocked = data.blocked.map((rings) => rings.map(meters));
    this.movingObstacles = (data.movingObstacles ?? []).map(({ rings, line, speed }) => ({ rings: rings.map(meters), line: meters(line), speed }));
    if (data.density) {
      this.density = new Image();
      this.density.onload = again;
      this.density.src = data.density;
    }
  }
}

/** Displacement of an obstacle after some seconds, along the line of its round trip. */
function shiftOf({ line, speed }, time) {
  const pieces = [];
  for (let k = 2; k < line.length; k += 2) pieces.push(Math.hypot(line[k] - line[k - 2], line[k + 1] - line[k - 1]));
  let left = (time * speed) % pieces.reduce((sum, length) => sum + length, 0);
  let k = 0;
  while (k < pieces.length - 1 && left > pieces[k]) {
    left -= pieces[k];
    k += 1;
  }
  const part = pieces[k] > 0 ? left / pieces[k] : 0;
  return [0, 1].map((axis) => line[2 * k + axis] + part * (line[2 * k + 2 + axis] - line[2 * k + axis]) - line[axis]);
}

const NOT_JOINED = 0;
const WORKS = 1;
const FAILED = 2;

class Run {
  constructor(data, arenaMap) {
    Object.assign(this, data, { arenaMap, robots: data.numbers.length });
    this.where = new Series(data.positions, 2 * this.robots, data.step, data.count, data.end);
    this.goals = data.goals && new Series(data.goals, 2 * this.robots, data.step, data.count, data.end);
    this.headings = data.headings && new Series(data.headings, 2 * this.robots, data.step, data.count, data.end);
    this.range = data.cost;
    this.cost = data.cost && new Series(data.cost.values, 1, data.cost.step, data.cost.count, data.end);
    this.lifetimes = data.lifetimes ?? Array.from({ length: this.robots }, () => [0, null]);
    this.events = this.lifetimes.flatMap(([begin, end], i) => [
      ...(begin > 0 && begin <= this.end ? [{ time: begin, words: `+ ${this.numbers[i]}`, said: `robot ${this.numbers[i]} joins` }] : []),
      ...(end !== null ? [{ time: end, words: `× ${this.numbers[i]}`, said: `robot ${this.numbers[i]} fails` }] : []),
    ]).sort((a, b) => a.time - b.time);
    this.speeds = data.speeds ?? null; // if cells are by travel time
    this.radii = Array.from({ length: this.robots }, (_, k) => (Array.isArray(data.radius) ? data.radius[k] : data.radius));
  }

  /** State of each robot: it has not joined yet, works, or has failed. */
  statesAt(time) {
    return this.lifetimes.map(([begin, end]) => {
      if (time < begin - 1e-9) return NOT_JOINED;
      return end !== null && time >= end - 1e-9 ? FAILED : WORKS;
    });
  }

  /** Positions in meters, x and y alternating. If the record has no path, robots stay at the start until the end. */
  positionsAt(time, series = this.where) {
    return this.meters(series.at(this.path || time >= this.end ? time : 0));
  }

  /** The hue of each robot's cell, which differs from its neighbors'. Hues change rarely during a run. */
  huesAt(time) {
    const moment = this.path || time >= this.end ? this.where.before(time) : 0;
    const hues = [...this.hues.first];
    for (const [since, robot, hue] of this.hues.changes) {
      if (since > moment) break;
      hues[robot] = hue;
    }
    return hues;
  }

  meters(row) {
    const { left, low, width, height } = this.arenaMap;
    return Float64Array.from(row, (value, k) => (k % 2 ? low + value * height : left + value * width));
  }

  /** Mean distance to the nearest robot in meters; NaN if it is unknown. */
  costAt(time) {
    if (!this.cost) return NaN;
    const { low, high, last } = this.range;
    if (time >= this.end && last !== null) return last;
    return low + this.cost.at(time)[0] * (high - low);
  }
}
