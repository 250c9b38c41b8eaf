// Cost curves of the displayed runs, with a cursor at the displayed time.

const SMALL = 11.5;

/** Round numbers within [low, high] for at most `most` intervals; empty if there is no room for any. */
function roundTicks(low, high, most, factors) {
  const rough = (high - low) / Math.max(most, 1);
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = factors.map((factor) => factor * power).find((value) => value >= rough * 0.999);
  const first = Math.ceil(low / step - 1e-9);
  const count = Math.floor(high / step + 1e-9) - first + 1;
  // if steps are smaller than rounding errors, or a limit is not finite, they cannot be counted
  if (!Number.isFinite(step) || !(Math.abs(first) < 1e12) || !(count > 0 && count < 1000)) return [];
  return Array.from({ length: count }, (_, k) => (first + k) * step);
}

function plain(value) {
  return String(Number(value.toPrecision(6)));
}

/** Heights at least `gap` apart within [low, high], as near as possible to the given ones; see spread_labels in look/labels.py. */
function spreadLabels(heights, gap, low, high) {
  const order = heights.map((_, k) => k).sort((a, b) => heights[a] - heights[b]);
  const blocks = []; // of labels that are moved together: mean and number
  order.forEach((k, rank) => {
    let block = { mean: heights[k] - gap * rank, size: 1 };
    while (blocks.length && blocks.at(-1).mean > block.mean) {
      const { mean, size } = blocks.pop();
      block = { mean: (mean * size + block.mean * block.size) / (size + block.size), size: size + block.size };
    }
    blocks.push(block);
  });
  const levels = blocks.flatMap(({ mean, size }) => Array(size).fill(mean));
  const result = [...heights];
  order.forEach((k, rank) => {
    const height = Math.max(levels[rank], low) + gap * rank;
    result[k] = Math.min(height, high - gap * (order.length - 1 - rank));
  });
  return result;
}

/** Limits of the chart by the rule of look/axes.py, whose constants are in the data. */
function limitsOf(runs, rules) {
  let [low, high, end] = [Infinity, -Infinity, 0];
  for (const run of runs) {
    end = Math.max(end, run.end);
    if (!run.range) continue;
    low = Math.min(low, run.range.low);
    high = Math.max(high, run.range.high);
  }
  if (!(low <= high)) return { low: 0, high: 1, end };
  const size = Math.max(Math.abs(low), Math.abs(high), 1e-3);
  const room = high - low > 1e-9 * size ? rules.margin * (high - low) : 0.1 * size;
  const fromZero = low >= 0 && low < rules.maxLowFraction * high;
  return { low: fromZero ? 0 : low - room, high: high + room, end };
}

function labelOf(run, number, numbered) {
  return numbered ? `${number} ${run.label}` : run.label;
}

/** Draws the chart; returns a function that converts a pixel to a time. */
function drawChart(canvas, runs, time, look, rules) {
  const context = prepared(canvas);
  if (!context) return () => time;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  const { low, high, end } = limitsOf(runs, rules);
  context.font = `600 ${SMALL}px ${FONT}`;
  const labels = runs.map((run, k) => (run.cost ? labelOf(run, k + 1, runs.length > 1) : ""));
  const wide = Math.max(...labels.map((label) => context.measureText(`${label}  00.000`).width), 0);
  const box = { left: 36, top: 10, right: width - Math.min(wide + 22, 0.42 * width), bottom: height - 22 };
  const x = (value) => box.left + (value / (end || 1)) * (box.right - box.left);
  const y = (value) => box.bottom - ((value - low) / (high - low)) * (box.bottom - box.top);
  drawAxes(context, box, x, y, { low, high, end }, look, rules);
  runs.forEach((run, k) => {
    if (run.cost) drawCurve(context, run, x, y, look, Math.min(runs.length - 1 - k, 3));
  });
  const drawn = runs.filter((run) => run.cost);
  drawEvents(context, box, x, drawn, look);
  context.lineWidth = 1;
  context.strokeStyle = look.ink;
  context.beginPath();
  context.moveTo(Math.round(x(time)) + 0.5, box.top - 6);
  context.lineTo(Math.round(x(time)) + 0.5, box.bottom);
  context.stroke();
  const values = drawn.map((run) => run.costAt(time));
  drawn.forEach((run, k) => {
    if (Number.isFinite(values[k])) drawMark(context, run.mark, x(Math.min(time, run.end)), y(values[k]), 4, look[run.style], look);
  });
  const wanted = values.map((value) => (Number.isFinite(value) ? y(value) : box.bottom));
  const heights = spreadLabels(wanted, 15, box.top + 4, box.bottom - 2);
  context.font = `600 ${SMALL}px ${FONT}`;
  context.textAlign = "left";
  context.textBaseline = "middle";
  const names = labels.filter((label) => label);
  drawn.forEach((run, k) => {
    const said = Number.isFinite(values[k]) ? values[k].toFixed(3) : "–";
    context.fillStyle = look[run.style];
    const value = `  ${said}`;
    const room = width - box.right - 14 - context.measureText(value).width;
    context.fillText(cutTo(context, names[k], room) + value, box.right + 12, heights[k]);
  });
  return (pixel) => Math.min(Math.max((pixel - box.left) / (box.right - box.left), 0), 1) * end;
}

/** Marks when robots failed (×) and joined (+): a line for each, with a label where there is room. */
function drawEvents(context, box, x, runs, look) {
  const seen = new Set();
  const events = runs.flatMap((run) => run.events).filter(({ time, words }) => {
    const key = `${time.toFixed(2)} ${words}`;
    return !seen.has(key) && seen.add(key); // under the same conditions all runs have them
  });
  context.font = `${SMALL}px ${FONT}`;
  context.textAlign = "left";
  context.textBaseline = "middle";
  let free = box.left;
  for (const { time, words } of events.sort((a, b) => a.time - b.time)) {
    const at = Math.round(x(time)) + 0.5;
    context.lineWidth = 1;
    context.strokeStyle = look.grid;
    context.beginPath();
    context.moveTo(at, box.top);
    context.lineTo(at, box.bottom);
    context.stroke();
    const wide = context.measureText(words).width;
    if (at < free || at + 4 + wide > box.right) continue;
    context.fillStyle = look.faint;
    context.fillText(words, at + 4, box.top + 3);
    free = at + wide + 10;
  }
}

function cutTo(context, text, room) {
  if (context.measureText(text).width <= room) return text;
  let kept = text;
  while (kept && context.measureText(`${kept}…`).width > room) kept = kept.slice(0, -1);
  return `${kept}…`;
}

function drawAxes(context, box, x, y, { low, high, end }, look, rules) {
  context.lineWidth = 1;
  context.font = `${SMALL}px ${FONT}`;
  context.fillStyle = look.faint;
  context.textAlign = "right";
  context.textBaseline = "middle";
  for (const value of roundTicks(low, high, Math.max((box.bottom - box.top) / 24, 2), rules.tickFactors)) {
    const level = Math.round(y(value)) + 0.5;
    context.strokeStyle = value === 0 ? look.faint : look.line;
    context.beginPath();
    context.moveTo(box.left, level);
    context.lineTo(box.right, level);
    context.stroke();
    context.fillText(plain(value), box.left - 7, level);
  }
  context.textAlign = "center";
  context.textBaseline = "alphabetic";
  const ticks = roundTicks(0, end, Math.max((box.right - box.left) / 48, 2), rules.tickFactors);
  ticks.forEach((value, k) => {
    context.fillText(k === ticks.length - 1 ? `${plain(value)} s` : plain(value), x(value), box.bottom + 16);
  });
}

function drawCurve(context, run, x, y, look, above) {
  const { low, high } = run.range;
  const { cost } = run;
  context.lineWidth = 1.8 + 0.7 * above; // the first is the widest and lowest: none hides another
  context.strokeStyle = look[run.style];
  context.setLineDash(run.dashes.map((part) => part * 1.8));
  context.lineCap = "butt";
  context.beginPath();
  let begun = false;
  for (let row = 0; row < cost.count; row += 1) {
    const value = low + cost.values[row] * (high - low);
    if (Number.isFinite(value)) context[begun ? "lineTo" : "moveTo"](x(cost.timeOf(row)), y(value));
    begun = Number.isFinite(value);
  }
  context.stroke();
  context.setLineDash([]);
}

/** Draws the mark of a curve, an SVG path: curves differ in shape as well as in color. */
function drawMark(context, mark, x, y, size, color, look) {
  const path = new Path2D(mark);
  context.save();
  context.translate(x, y);
  context.scale(size / 5, size / 5);
  context.strokeStyle = look.background;
  context.lineWidth = 10 / size;
  context.stroke(path);
  context.fillStyle = color;
  context.fill(path);
  context.restore();
}
