// The page around the replays: enlarged pictures, and printing.

/** The enlarged picture of a run, from which one can go to the previous and the next run. */
class Enlarged {
  constructor() {
    this.title = createElement("h2");
    this.canvas = createElement("canvas", { role: "img" });
    this.facts = createElement("p", { class: "facts" });
    this.watch = createElement("button", { type: "button", class: "watch-run" }, icon("play"), "Watch in the replay");
    this.back = button("back", "Previous run", () => this.move(-1));
    this.forward = button("forward", "Next run", () => this.move(1));
    const close = button("remove", "Close", () => this.dialog.close());
    const head = createElement("div", { class: "head" }, this.title, this.back, this.forward, close);
    this.dialog = createElement("dialog", { class: "robocov-replay enlarged" }, head, this.canvas, this.facts, this.watch);
    this.dialog.setAttribute("data-live", "");
    document.body.append(this.dialog);
    this.watch.addEventListener("click", () => {
      this.opener = null; // the focus goes to the replay
      this.dialog.close();
      this.replay.showRun(this.run);
      this.replay.root.scrollIntoView({ behavior: REDUCED_MOTION.matches ? "auto" : "smooth", block: "start" });
    });
    this.dialog.addEventListener("close", () => this.opener?.focus());
    this.dialog.addEventListener("click", (event) => {
      if (event.target === this.dialog) this.dialog.close(); // beside its content
    });
    this.dialog.addEventListener("keydown", (event) => {
      const turn = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (turn) this.move(turn);
    });
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }

  open(replay, run, opener) {
    Object.assign(this, { replay, opener, count: replay.runs.length });
    this.dialog.showModal();
    this.showRun(run);
    this.dialog.querySelector(".remove").focus();
  }

  move(turn) {
    this.showRun((this.run + turn + this.count) % this.count);
  }

  showRun(k) {
    this.run = k;
    const run = this.replay.runs[k];
    const cost = run.costAt(run.end);
    const final = Number.isFinite(cost) ? `Mean distance ${cost.toFixed(3)} m after ${run.end.toFixed(1)} s. ` : "";
    this.title.textContent = run.title;
    this.facts.textContent = `${final}${run.facts}`;
    this.canvas.setAttribute("aria-label", `${run.title}: trajectories of all robots. ${final}${run.facts}`);
    this.canvas.style.aspectRatio = `${run.arenaMap.width} / ${run.arenaMap.height}`;
    // as large as the screen allows, whatever the aspect of the map
    this.canvas.style.maxWidth = `calc((100vh - 210px) * ${run.arenaMap.width / run.arenaMap.height})`;
    this.draw();
  }

  draw() {
    if (!this.dialog.open) return;
    const run = this.replay.runs[this.run];
    drawArena(this.canvas, run, run.end, lookOf(this.dialog), { cells: true, trajectories: true, goals: true });
  }
}

function startReport(replays) {
  const enlarged = new Enlarged();
  for (const [root, replay] of replays) {
    const thumbnails = root.closest(".result").querySelectorAll(".thumbnails button");
    for (const thumbnail of thumbnails) {
      thumbnail.addEventListener("click", () => enlarged.open(replay, Number(thumbnail.dataset.run), thumbnail));
    }
  }
  // collapsed sections are printed, too
  let folded = [];
  addEventListener("beforeprint", () => {
    folded = [...document.querySelectorAll("details:not([open])")];
    for (const details of folded) details.open = true;
  });
  addEventListener("afterprint", () => {
    for (const details of folded) details.open = false;
  });
}
