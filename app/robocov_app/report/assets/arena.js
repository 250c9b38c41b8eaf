// Draws the state of a run at a given time on a canvas.

const COLORS = [
  "background", "panel", "ink", "faint", "grid", "line", "boundary", "obstacle", "obstacle-edge", "moving-obstacle", "cell-edge", "start",
  "final", "on-final", "trajectory", "ring", "rapf", "rpf", "lloyd", "other-0", "other-1", "other-2",
  ...Array.from({ length: 9 }, (_, k) => `cell-${k}`),
];
const MAX_CELLS = 400; // more would take too long in each frame
const FONT = "system-ui, sans-serif";

function lookOf(element) {
  const style = getComputedStyle(element);
  return Object.fromEntries(COLORS.map((name) => [name, style.getPropertyValue(`--rc-${name}`).trim()]));
}

/** Matches a canvas to the screen's resolution; returns its context in CSS pixels, or null if it has no size. */
function prepared(canvas) {
  const { clientWidth: width, clientHeight: height } = canvas;
  if (!width || !height) return null;
  const dense = Math.max(window.devicePixelRatio || 1, 1);
  const size = [Math.round(width * dense), Math.round(height * dense)];
  if (canvas.width !== size[0] || canvas.height !== size[1]) [canvas.width, canvas.height] = size;
  const context = canvas.getContext("2d");
  context.setTransform(dense, 0, 0, dense, 0, 0);
  context.clearRect(0, 0, width, height);
  return context;
}

/** The part of a convex polygon [x, y, ...] that is nearer to robot i than to any other working robot: equation (1). */
function cellOf(region, places, i, counts = () => true) {
  const [x, y] = [places[2 * i], places[2 * i + 1]];
  const others = [];
  for (let j = 0; j < places.length / 2; j += 1) {
    const [dx, dy] = [places[2 * j] - x, places[2 * j + 1] - y];
    const square = dx * dx + dy * dy;
    if (j !== i && square > 1e-18 && counts(j)) others.push([square, dx, dy]);
  }
  others.sort((a, b) => a[0] - b[0]);
  let cell = Array.from(region);
  for (const [square, dx, dy] of others) {
    let farthest = 0;
    for (let k = 0; k < cell.length; k += 2) {
      farthest = Math.max(farthest, (cell[k] - x) ** 2 + (cell[k + 1] - y) ** 2);
    }
    if (square > 4 * farthest) break; // its bisector passes by, and those of the others beyond it too
    cell = clipped(cell, x, y, dx, dy, square / 2);
  }
  return cell;
}

/** The part of a convex polygon where (q - p) . d <= limit. */
function clipped(polygon, x, y, dx, dy, limit) {
  const kept = [];
  const size = polygon.length;
  for (let k = 0; k < size; k += 2) {
    const [ax, ay] = [polygon[k], polygon[k + 1]];
    const [bx, by] = [polygon[(k + 2) % size], polygon[(k + 3) % size]];
    const a = (ax - x) * dx + (ay - y) * dy - limit;
    const b = (bx - x) * dx + (by - y) * dy - limit;
    if (a <= 0) kept.push(ax, ay);
    if (a < 0 !== b < 0 && a !== 0 && b !== 0) {
      const part = a / (a - b);
      kept.push(ax + part * (bx - ax), ay + part * (by - ay));
    }
  }
  return kept;
}

/** The transform from meters to pixels: the whole region, as large as possible, with a margin. */
function frameOf(arenaMap, width, height, margin = 2) {
  const zoom = Math.min((width - 2 * margin) / arenaMap.width, (height - 2 * margin) / arenaMap.height);
  const left = (width - zoom * arenaMap.width) / 2;
  const top = (height - zoom * arenaMap.height) / 2;
  return { zoom, x: (value) => left + (value - arenaMap.left) * zoom, y: (value) => top + (arenaMap.high - value) * zoom };
}

function traced(frame, rings) {
  const path = new Path2D();
  for (const ring of rings) {
    for (let k = 0; k < ring.length; k += 2) {
      path[k ? "lineTo" : "moveTo"](frame.x(ring[k]), frame.y(ring[k + 1]));
    }
    path.closePath();
  }
  return path;
}

/** Radii in pixels: enlarged to be readable where there is room, down to true size where robots are close. */
function drawnRadii(run, places, states, frame, most) {
  return run.radii.map((radius, i) => {
    let nearest = Infinity;
    for (let j = 0; j < run.robots; j += 1) {
      if (j === i || states[j] === NOT_JOINED) continue;
      nearest = Math.min(nearest, Math.hypot(places[2 * i] - places[2 * j], places[2 * i + 1] - places[2 * j + 1]));
    }
    return Math.max(radius * frame.zoom, Math.min(Math.max((nearest * frame.zoom) / 2, 2.3), most));
  });
}

/** Draws a run at a given time. `show` says what to draw: cells, trajectories, goals. */
function drawArena(canvas, run, time, look, show) {
  const context = prepared(canvas);
  if (!context) return;
  const frame = frameOf(run.arenaMap, canvas.clientWidth, canvas.clientHeight);
  const [places, states] = [run.positionsAt(time), run.statesAt(time)];
  const region = traced(frame, [run.arenaMap.region]);
  context.lineJoin = "round";
  context.fillStyle = look.background;
  context.fill(region);
  if (show.cells && run.robots <= MAX_CELLS) drawCells(context, run, run.huesAt(time), places, states, frame, look);
  const { density, left, high, width, height } = run.arenaMap;
  if (density?.complete) {
    context.drawImage(density, frame.x(left), frame.y(high), width * frame.zoom, height * frame.zoom);
  }
  context.lineWidth = 1;
  context.fillStyle = look.obstacle;
  context.strokeStyle = look["obstacle-edge"];
  for (const rings of run.arenaMap.blocked) {
    const path = traced(frame, rings);
    context.fill(path, "evenodd");
    context.stroke(path);
  }
  drawMovingObstacles(context, run, time, frame, region, look);
  context.lineWidth = 2;
  context.strokeStyle = look.boundary;
  context.stroke(region);
  if (show.trajectories && run.path) drawTrajectories(context, run, time, places, frame, look);
  drawStarts(context, run, states, frame, look);
  const radii = drawnRadii(run, places, states, frame, Math.max(7, Math.min(9.5, canvas.clientWidth / 40)));
  if (show.goals && run.goals) drawGoals(context, run.positionsAt(time, run.goals), places, radii, frame, run.arenaMap, look);
  drawFailed(context, run, places, states, radii, frame, look);
  if (run.headings) drawNoses(context, run, time, places, states, radii, frame, look);
  drawRobots(context, run, places, states, radii, frame, look);
}

/** Draws moving obstacles at their present positions, clipped to the region. */
function drawMovingObstacles(context, run, time, frame, region, look) {
  if (!run.arenaMap.movingObstacles.length) return;
  context.save();
  context.clip(region);
  for (const obstacle of run.arenaMap.movingObstacles) {
    const [dx, dy] = shiftOf(obstacle, (run.begin ?? 0) + Math.min(time, run.end));
    const path = traced(frame, obstacle.rings.map((ring) => ring.map((value, k) => value + (k % 2 ? dy : dx))));
    context.lineWidth = 2;
    context.fillStyle = look["moving-obstacle"];
    context.fill(path, "evenodd");
    context.stroke(path);
    context.fillStyle = look.obstacle;
  }
  context.restore();
  for (const obstacle of run.arenaMap.movingObstacles) drawMotion(context, obstacle, (run.begin ?? 0) + Math.min(time, run.end), frame, look);
}

/** Draws the path of a moving obstacle's center, dashed, and an arrow in its direction. */
function drawMotion(context, obstacle, time, frame, look) {
  const { line, rings } = obstacle;
  const [xs, ys] = [0, 1].map((axis) => rings[0].filter((_, k) => k % 2 === axis));
  const middle = [xs, ys].map((values) => (Math.min(...values) + Math.max(...values)) / 2);
  const [now, next] = [time, time + 1e-3].map((moment) => shiftOf(obstacle, moment));
  context.save();
  context.strokeStyle = look.ink;
  context.lineWidth = 1;
  context.setLineDash([5, 4]);
  context.beginPath();
  for (let k = 0; k < line.length; k += 2) {
    context.lineTo(frame.x(middle[0] + line[k] - line[0]), frame.y(middle[1] + line[k + 1] - line[1]));
  }
  context.stroke();
  context.setLineDash([]);
  context.lineWidth = 2;
  context.translate(frame.x(middle[0] + now[0]), frame.y(middle[1] + now[1]));
  context.rotate(Math.atan2(now[1] - next[1], next[0] - now[0]));
  context.beginPath();
  for (const [x, y] of [[-9, 0], [9, 0], [3, -4], [9, 0], [3, 4]]) context.lineTo(x, y);
  context.stroke();
  context.restore();
}

/** Draws cells by travel time: fast robots first, because the cells of slow ones are holes in theirs. */
function drawTimedCells(context, run, hues, places, states, frame, look) {
  const { speeds } = run;
  for (const i of [...speeds.keys()].filter((k) => states[k] === WORKS).sort((a, b) => speeds[b] - speeds[a])) {
    const equal = traced(frame, [cellOf(run.arenaMap.region, places, i, (j) => states[j] === WORKS && speeds[j] === speeds[i])]);
    const circles = [];
    for (let j = 0; j < run.robots; j += 1) {
      if (states[j] !== WORKS || speeds[j] <= speeds[i]) continue;
      // of Apollonius, around the slower one
      const part = (speeds[i] / speeds[j]) ** 2 / (1 - (speeds[i] / speeds[j]) ** 2);
      const [dx, dy] = [places[2 * j] - places[2 * i], places[2 * j + 1] - places[2 * i + 1]];
      const [x, y] = [places[2 * i] - part * dx, places[2 * i + 1] - part * dy];
      const circle = new Path2D();
      circle.arc(frame.x(x), frame.y(y), part * (speeds[j] / speeds[i]) * Math.hypot(dx, dy) * frame.zoom, 0, 7);
      circles.push(circle);
    }
    context.save();
    for (const path of [equal, ...circles]) context.clip(path);
    context.fillStyle = look[`cell-${hues[i]}`];
    context.fill(equal);
    context.stroke(equal);
    context.lineWidth = 2; // of which only the inner half is seen
    for (const path of circles) context.stroke(path);
    context.restore();
  }
}

function drawCells(context, run, hues, places, states, frame, look) {
  context.lineWidth = 1;
  context.strokeStyle = look["cell-edge"];
  if (run.speeds) {
    drawTimedCells(context, run, hues, places, states, frame, look);
    return;
  }
  for (let i = 0; i < run.robots; i += 1) {
    if (states[i] !== WORKS) continue;
    const path = traced(frame, [cellOf(run.arenaMap.region, places, i, (j) => states[j] === WORKS)]);
    context.fillStyle = look[`cell-${hues[i]}`];
    context.fill(path);
    context.stroke(path);
  }
}

function drawTrajectories(context, run, time, places, frame, look) {
  const { values, width } = run.where;
  const last = run.where.before(time);
  const { left, low, width: wide, height: high } = run.arenaMap;
  context.lineWidth = run.robots > 30 ? 1.2 : 2;
  context.lineCap = "round";
  context.strokeStyle = look.trajectory;
  context.beginPath();
  for (let i = 0; i < run.robots; i += 1) {
    const begin = run.lifetimes[i][0];
    if (time < begin) continue;
    let drawn = 0;
    for (let row = begin > 0 ? run.where.before(begin) + 1 : 0; row <= last; row += 1) {
      const x = frame.x(left + values[row * width + 2 * i] * wide);
      const y = frame.y(low + values[row * width + 2 * i + 1] * high);
      context[drawn ? "lineTo" : "moveTo"](x, y);
      drawn += 1;
    }
    context[drawn ? "lineTo" : "moveTo"](frame.x(places[2 * i]), frame.y(places[2 * i + 1]));
  }
  context.stroke();
}

function drawStarts(context, run, states, frame, look) {
  context.lineWidth = 1.8;
  context.strokeStyle = look.start;
  for (let i = 0; i < run.robots; i += 1) {
    if (states[i] === NOT_JOINED) continue;
    const begin = run.positionsAt(run.lifetimes[i][0]);
    context.beginPath();
    context.arc(frame.x(begin[2 * i]), frame.y(begin[2 * i + 1]), 4, 0, 2 * Math.PI);
    context.stroke();
  }
}

/** Minimum distance of a goal that is drawn from its robot, as a fraction of the longer side of the map, as in figures. */
const MIN_GOAL_DISTANCE = 0.03;

function drawGoals(context, goals, places, radii, frame, arenaMap, look) {
  const minDistance = MIN_GOAL_DISTANCE * Math.max(arenaMap.width, arenaMap.height) * frame.zoom;
  context.lineWidth = 1.6;
  context.strokeStyle = look.ink;
  context.beginPath();
  for (let i = 0; i < radii.length; i += 1) {
    const [x, y] = [frame.x(goals[2 * i]), frame.y(goals[2 * i + 1])];
    const away = Math.hypot(x - frame.x(places[2 * i]), y - frame.y(places[2 * i + 1]));
    if (!(away > minDistance)) continue; // there, or no goal at all
    context.moveTo(x - 5, y);
    context.lineTo(x + 5, y);
    context.moveTo(x, y - 5);
    context.lineTo(x, y + 5);
  }
  context.stroke();
}

/** Draws failed robots, which have become obstacles: crossed out, with their numbers next to them. */
function drawFailed(context, run, places, states, radii, frame, look) {
  context.textAlign = "left";
  context.textBaseline = "middle";
  for (let i = 0; i < run.robots; i += 1) {
    if (states[i] !== FAILED) continue;
    const [x, y, radius] = [frame.x(places[2 * i]), frame.y(places[2 * i + 1]), radii[i]];
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.fillStyle = look.obstacle;
    context.fill();
    context.lineWidth = Math.min(1.5, 0.25 * radius);
    context.strokeStyle = look.ink;
    context.stroke();
    const arm = 0.62 * radius;
    context.lineWidth = Math.min(2, 0.3 * radius);
    context.beginPath();
    context.moveTo(x - arm, y - arm);
    context.lineTo(x + arm, y + arm);
    context.moveTo(x - arm, y + arm);
    context.lineTo(x + arm, y - arm);
    context.stroke();
    if (radius < 6) continue;
    context.fillStyle = look.ink;
    context.font = `700 11px ${FONT}`;
    context.fillText(String(run.numbers[i]), x + radius + 3, y);
  }
}

/** Draws the headings of unicycles, below their discs. */
function drawNoses(context, run, time, places, states, radii, frame, look) {
  const vectors = run.headings.at(run.path || time >= run.end ? time : 0);
  for (let i = 0; i < run.robots; i += 1) {
    if (states[i] !== WORKS || Number.isNaN(vectors[2 * i])) continue;
    const angle = Math.atan2(2 * vectors[2 * i + 1] - 1, 2 * vectors[2 * i] - 1);
    const [x, y] = [frame.x(places[2 * i]), frame.y(places[2 * i + 1])];
    context.beginPath();
    for (const [far, side] of [[1.65, 0], [1, 0.5], [1, -0.5]]) {
      context.lineTo(x + far * radii[i] * Math.cos(angle + side), y - far * radii[i] * Math.sin(angle + side));
    }
    context.closePath();
    context.fillStyle = look.ink;
    context.fill();
  }
}

function drawRobots(context, run, places, states, radii, frame, look) {
  context.textAlign = "center";
  context.textBaseline = "middle";
  for (let i = 0; i < run.robots; i += 1) {
    if (states[i] !== WORKS) continue;
    const [x, y, radius] = [frame.x(places[2 * i]), frame.y(places[2 * i + 1]), radii[i]];
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.fillStyle = look.final;
    context.fill();
    context.lineWidth = Math.min(1.5, 0.25 * radius);
    context.strokeStyle = look.ring;
    context.stroke();
    const number = String(run.numbers[i]);
    const size = radius * [1.35, 1.15, 0.9, 0.7][Math.min(number.length, 4) - 1];
    if (size < 6) continue;
    context.fillStyle = look["on-final"];
    context.font = `700 ${size}px ${FONT}`;
    context.fillText(number, x, y + 0.06 * size);
  }
}
