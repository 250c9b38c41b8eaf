// The replay: up to four synchronized runs, their costs, and the controls.

const MAX_PANES = 4;
const GAP = 16;
const WORDS = 68; // height of what stands above and below a picture
const SPEEDS = [0.5, 1, 2, 4, 8, 16];
const REDUCED_MOTION = matchMedia("(prefers-reduced-motion: reduce)");

const ICONS = {
  play: "M5 3l9 6-9 6z",
  pause: "M5 3h3v12H5zM10 3h3v12h-3z",
  start: "M4 3h2v12H4zM15 3v12L7 9z",
  back: "M12 3v12L4 9z",
  forward: "M6 3v12l8-6z",
  end: "M12 3h2v12h-2zM3 3v12l8-6z",
  add: "M8 3h2v5h5v2h-5v5H8v-5H3V8h5z",
  remove: "M4.6 3.2L9 7.6l4.4-4.4 1.4 1.4L10.4 9l4.4 4.4-1.4 1.4L9 10.4l-4.4 4.4-1.4-1.4L7.6 9 3.2 4.6z",
};

function createElement(tag, attributes = {}, ...content) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...content);
  return element;
}

function icon(name) {
  const holder = document.createElement("template");
  holder.innerHTML = `<svg viewBox="0 0 18 18" aria-hidden="true"><path d="${ICONS[name]}"/></svg>`;
  return holder.content.firstChild;
}

function button(name, label, act) {
  const element = createElement("button", { type: "button", class: name, "aria-label": label, title: label }, icon(name));
  element.addEventListener("click", act);
  return element;
}

function choice(label, options, chosen) {
  const element = createElement("select", { "aria-label": label });
  for (const [value, text] of options) element.append(new Option(text, value, false, value === chosen));
  return element;
}

/** Number of columns for panes side by side, and their maximum width so that all fit on the screen. */
function columnsFor(count, aspect, stageWidth, windowHeight) {
  let best = { columns: 1, width: 0 };
  let [maxColumns, minWidth] = [1, Math.min(stageWidth, 420)];
  for (let columns = 1; columns <= count; columns += 1) {
    const maxWidth = (stageWidth - (columns - 1) * GAP) / columns;
    if (columns > 1 && maxWidth < 230) break;
    [maxColumns, minWidth] = [columns, Math.min(maxWidth, 420)];
    const height = (windowHeight - 230) / Math.ceil(count / columns) - WORDS;
    const width = Math.min(maxWidth, height * aspect);
    if (width > best.width + 1) best = { columns, width };
  }
  // If they do not all fit, each is still large enough to see.
  return best.width < minWidth ? { columns: maxColumns, width: minWidth } : best;
}

class Replay {
  constructor(root, data) {
    this.root = root;
    this.arenaMaps = data.maps.map((map) => new ArenaMap(map, () => this.draw()));
    this.runs = data.runs.map((run) => new Run(run, this.arenaMaps[run.map]));
    this.axes = data.axes;
    this.shown = data.panes.slice(0, MAX_PANES);
    this.playing = false;
    this.show = { cells: true, trajectories: true, goals: true };
    this.time = Infinity;
    this.build();
    this.rebuildPanes();
    new ResizeObserver(() => this.draw()).observe(this.stage);
    const again = () => this.recolor();
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", again);
    // notebooks change their theme through attributes of the page
    const watch = new MutationObserver(again);
    for (const page of [document.documentElement, document.body]) {
      watch.observe(page, { attributes: true, attributeFilter: ["class", "data-theme", "data-jp-theme-light"] });
    }
  }

  get end() {
    return Math.max(...this.shown.map((k) => this.runs[k].end));
  }

  get step() {
    return Math.min(...this.shown.map((k) => this.runs[k].step));
  }

  build() {
    this.stage = createElement("div", { class: "stage", tabindex: "0", role: "group" });
    this.stage.setAttribute(
      "aria-label",
      "Replay. Space plays and pauses, the arrow keys step, Home and End go to the first and last moment.",
    );
    this.chart = createElement("canvas", { class: "chart", role: "img" });
    this.play = createElement("button", { type: "button", class: "main" });
    this.play.addEventListener("click", () => this.toggle());
    this.slider = createElement("input", { type: "range", min: "0", step: "any", "aria-label": "Time" });
    this.slider.addEventListener("input", () => this.seek(Number(this.slider.value)));
    this.clock = createElement("span", { class: "clock" });
    this.speed = choice("Speed", SPEEDS.map((value) => [String(value), `${value}×`]), "4");
    this.add = createElement("button", { type: "button", class: "add" }, icon("add"), "Add a run");
    this.add.addEventListener("click", () => this.addPane());
    this.said = createElement("p", { class: "said", role: "status" });
    const boxes = ["cells", "trajectories", "goals"].map((name) => this.checkBox(name));
    const steps = createElement("div", { class: "steps" });
    steps.append(
      button("start", "First moment", () => this.seek(0)),
      button("back", "One step back", () => this.stepBy(-1)),
      this.play,
      button("forward", "One step on", () => this.stepBy(1)),
      button("end", "Last moment", () => this.seek(this.end)),
    );
    const speed = createElement("label", { class: "speed" }, "Speed ", this.speed);
    this.controls = createElement("div", { class: "controls" });
    this.controls.append(createElement("div", { class: "transport" }, steps, this.slider, this.clock));
    this.controls.append(createElement("div", { class: "settings" }, speed, ...boxes, this.add));
    const title = createElement("p", { class: "axis", "aria-hidden": "true" }, "Mean distance to the nearest robot, m");
    const curves = createElement("div", { class: "curves" }, title, this.chart);
    this.live = createElement("div", { class: "live" }, this.stage, curves, this.controls, this.said);
    this.root.append(this.live);
    this.root.addEventListener("keydown", (event) => this.press(event));
    this.chart.addEventListener("pointerdown", (event) => {
      this.chart.setPointerCapture(event.pointerId);
      this.seek(this.timeAt(event.offsetX));
    });
    this.chart.addEventListener("pointermove", (event) => {
      if (this.chart.hasPointerCapture(event.pointerId)) this.seek(this.timeAt(event.offsetX));
    });
  }

  checkBox(name) {
    const box = createElement("input", { type: "checkbox" });
    box.checked = this.show[name];
    box.addEventListener("change", () => {
      this.show[name] = box.checked;
      this.draw();
    });
    return createElement("label", { class: name }, box, name[0].toUpperCase() + name.slice(1));
  }

  /** Rebuilds the panes after a run was added, removed or chosen. */
  rebuildPanes() {
    const { runs, shown } = this;
    this.time = Math.min(this.time, this.end);
    this.panes = shown.map((k, place) => this.pane(runs[k], k, place));
    this.stage.replaceChildren(...this.panes.map((pane) => pane.element));
    this.add.hidden = shown.length >= Math.min(MAX_PANES, runs.length);
    this.controls.querySelector(".goals").hidden = !shown.some((k) => runs[k].goals);
    this.slider.max = String(this.end);
    this.chart.parentElement.hidden = !shown.some((k) => runs[k].cost);
    this.recolor();
    this.update();
    this.describe();
  }

  pane(run, k, place) {
    const canvas = createElement("canvas", { role: "img" });
    const mark = createElement("canvas", { class: "mark", "aria-hidden": "true" });
    const head = createElement("div", { class: "head" }, mark);
    if (this.runs.length > 1) {
      const names = this.runs.map((other, i) => [String(i), other.title]);
      const list = choice(`Run in pane ${place + 1}`, names, String(k));
      list.addEventListener("change", () => {
        this.shown[place] = Number(list.value);
        this.rebuildPanes();
        this.panes[place].element.querySelector("select").focus();
      });
      head.append(list);
    } else {
      head.append(createElement("strong", {}, run.title));
    }
    if (this.shown.length > 1) {
      head.append(
        button("remove", `Remove pane ${place + 1}`, () => {
          this.shown.splice(place, 1);
          this.rebuildPanes();
          this.stage.focus();
        }),
      );
    }
    const [value, note] = [createElement("strong"), createElement("span")];
    const element = createElement("div", { class: "pane" }, head, canvas, createElement("p", { class: "facts" }, value, note));
    canvas.style.aspectRatio = `${run.arenaMap.width} / ${run.arenaMap.height}`;
    return { element, canvas, mark, value, note, run };
  }

  addPane() {
    const free = this.runs.map((_, k) => k).filter((k) => !this.shown.includes(k));
    const { arenaMap } = this.runs[this.shown.at(-1)];
    this.shown.push(free.find((k) => this.runs[k].arenaMap === arenaMap) ?? free[0]);
    this.rebuildPanes();
    this.panes.at(-1).element.querySelector("select").focus();
  }

  /** Shows a run in place of the last pane, unless it is shown already. */
  showRun(k) {
    if (!this.shown.includes(k)) {
      if (this.shown.length < MAX_PANES) this.shown.push(k);
      else this.shown[MAX_PANES - 1] = k;
      this.rebuildPanes();
    }
    this.stage.focus();
  }

  toggle() {
    if (this.playing) {
      this.stop();
      return;
    }
    if (this.time >= this.end) this.time = 0;
    this.playing = true;
    this.update();
    let before = null;
    let nextTime = this.time;
    const frame = (now) => {
      if (!this.playing) return;
      // after the page was hidden, the replay continues where it was
      const passed = before === null ? 0 : Math.min((now - before) / 1000, 0.1);
      before = now;
      nextTime = Math.min(nextTime + passed * Number(this.speed.value), this.end);
      // readers who prefer reduced motion get one still picture after another
      const isWaiting = REDUCED_MOTION.matches && nextTime < this.end && nextTime - this.time < Number(this.speed.value) * 0.5;
      if (!isWaiting) this.time = nextTime;
      if (!isWaiting) this.update();
      if (nextTime >= this.end) this.stop();
      else requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  stop() {
    this.playing = false;
    this.update();
    this.describe();
  }

  seek(time) {
    this.playing = false;
    this.time = Math.min(Math.max(time, 0), this.end);
    this.update();
    clearTimeout(this.later);
    this.later = setTimeout(() => this.describe(), 500); // one word for a whole drag
  }

  stepBy(count) {
    const rows = this.time / this.step;
    const next = count > 0 ? Math.floor(rows + 1e-6) + count : Math.ceil(rows - 1e-6) + count;
    this.seek(next * this.step);
  }

  press(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest("select")) return;
    const inTime = event.target === this.stage || event.target === this.slider;
    const acts = {
      " ": inTime && (() => this.toggle()),
      ",": () => this.stepBy(-1),
      ".": () => this.stepBy(1),
      ArrowLeft: inTime && (() => this.stepBy(event.shiftKey ? -10 : -1)),
      ArrowRight: inTime && (() => this.stepBy(event.shiftKey ? 10 : 1)),
      Home: inTime && (() => this.seek(0)),
      End: inTime && (() => this.seek(this.end)),
    };
    if (!acts[event.key]) return;
    event.preventDefault();
    event.stopPropagation(); // a notebook has keys of its own
    acts[event.key]();
  }

  recolor() {
    this.look = lookOf(this.root);
    this.draw();
  }

  /** Updates controls and pictures to the current time. */
  update() {
    const [time, end] = [this.time.toFixed(1), this.end.toFixed(1)];
    this.slider.value = String(this.time);
    this.slider.setAttribute("aria-valuetext", `${time} of ${end} seconds`);
    this.clock.textContent = `${time} / ${end} s`;
    if (this.play.dataset.playing !== String(this.playing)) {
      this.play.dataset.playing = String(this.playing);
      this.play.replaceChildren(icon(this.playing ? "pause" : "play"), this.playing ? "Pause" : "Play");
    }
    for (const { run, value, note } of this.panes) {
      const cost = run.costAt(this.time);
      const ended = this.time > run.end ? `, ended at ${run.end.toFixed(1)} s` : "";
      value.textContent = Number.isFinite(cost) ? `${cost.toFixed(3)} m` : "";
      const states = run.statesAt(this.time);
      const failed = run.numbers.filter((_, i) => states[i] === FAILED);
      const lost = failed.length ? `, ${failed.length > 6 ? `${failed.length} robots` : `robot ${failed.join(", ")}`} failed` : "";
      note.textContent = Number.isFinite(cost) ? ` mean distance${lost}${ended}` : `${lost}${ended}`.slice(2);
    }
    this.draw();
  }

  /** Describes the pictures for screen readers, but not during playback. */
  describe() {
    if (this.playing) return;
    const at = `At ${this.time.toFixed(1)} s`;
    const words = this.panes.map(({ run, canvas }) => {
      const cost = run.costAt(this.time);
      const distance = Number.isFinite(cost) ? `mean distance to the nearest robot ${cost.toFixed(3)} m` : "cost not known";
      const robots = run.robots === 1 ? "1 robot" : `${run.robots} robots`;
      const events = run.events.map(({ time, said }) => `${said} at ${time.toFixed(1)} s`);
      canvas.setAttribute("aria-label", `${run.title}: ${robots} on map ${run.arenaMap.name}. ${at}, ${distance}. ${[...events, run.facts].join(". ")}`.trim());
      return `${run.label}: ${distance}`;
    });
    const curves = this.panes.filter(({ run }) => run.cost).map(({ run }) => {
      const [first, last] = [run.costAt(0), run.costAt(run.end)].map((value) => value.toFixed(3));
      return `${run.title} from ${first} m to ${last} m after ${run.end.toFixed(1)} s`;
    });
    this.chart.setAttribute("aria-label", `Mean distance to the nearest robot against time. ${curves.join("; ")}.`);
    this.said.textContent = `${at}: ${words.join("; ")}`;
  }

  draw() {
    if (!this.look) return;
    const stageWidth = this.stage.clientWidth;
    if (!stageWidth) return;
    const aspect = Math.min(...this.panes.map(({ run }) => run.arenaMap.width / run.arenaMap.height));
    const { columns, width } = columnsFor(this.panes.length, aspect, stageWidth, window.innerHeight);
    const layout = `repeat(${columns}, minmax(0, ${Math.floor(width)}px))`;
    if (this.stage.style.gridTemplateColumns !== layout) this.stage.style.gridTemplateColumns = layout;
    for (const { run, canvas, mark } of this.panes) {
      drawArena(canvas, run, this.time, this.look, this.show);
      const context = prepared(mark);
      if (context) drawMark(context, run.mark, 8, 8, 4.5, this.look[run.style], this.look);
    }
    const runs = this.panes.map(({ run }) => run);
    this.timeAt = drawChart(this.chart, runs, this.time, this.look, this.axes);
  }
}

/** Starts the replays of the page that have not been started; returns them, keyed by their elements. */
function startReplays() {
  const started = new Map();
  for (const root of document.querySelectorAll(".robocov-replay:not([data-live])")) {
    const data = root.querySelector('script[type="application/json"]');
    if (!data) continue;
    root.setAttribute("data-live", "");
    started.set(root, new Replay(root, JSON.parse(data.textContent)));
  }
  return started;
}
