// The page of results: filter, sorting, and interactive figures. Nothing is loaded from a network.

// --- A point of a figure, and its run -------------------------------------------------------------

// Dimensionless parameters and sizes of units of a point as it is given (damper.parameters.dampers).
damper.scaled = (data, given) => {
  const p = { ...given, forcing: data.forcing };
  if (!data.si) return { p, length: 1, time: 1 };
  const { primary_mass: mass, stiffness, force_amplitude: force, gap } = given;
  const length = force ? force / stiffness : gap / 2, time = Math.sqrt(mass / stiffness);
  return { length, time, p: { ...p, mass_ratio: given.free_mass / mass, clearance: gap / 2 / length,
    damping_ratio: 0.5 * given.damping / Math.sqrt(stiffness * mass), force_amplitude: force ? 1 : 0,
    frequency_ratio: given.forcing_frequency * time, gravity: (given.gravity ?? 0) * time * time / length } };
};

// Steady response of the primary alone, at time 0: [x, x'].
damper.steady = ({ free, omega, phase }) => {
  const detuned = (1 - omega) * (1 + omega), loss = 2 * free.damping * omega;
  const gain = free.strength / (detuned * detuned + loss * loss), sine = Math.sin(phase), cosine = Math.cos(phase);
  return [gain * (detuned * sine - loss * cosine), omega * gain * (detuned * cosine + loss * sine)];
};

damper.start = (data, given) => {
  const { p, length, time } = damper.scaled(data, given), model = damper.model(p, data.run.accuracy);
  const of = (name, size) => (given[`initial_${name}`] ?? 0) / size;
  const [x, v] = data.steady ? damper.steady(model) : [of("displacement", length), of("velocity", length / time)];
  const y = x + of("position", 1) * model.clearance;
  return { model, length, time, state: [x, v, y, v + of("relative_velocity", length / time)] };
};

// First value of a branch, from which its points are followed; none where points stand alone.
damper.branch = (data, given, direction) => {
  const [along] = Object.keys(data.follow);
  return along && { along, way: data.follow[along].filter((value) => direction === "up" ? value < given[along] : value > given[along])
    .sort((a, b) => direction === "up" ? a - b : b - a) };
};

// The run's own start, before any point of its branch hands over, and the value that begins the branch.
damper.first = (data, given, direction) => {
  const { along, way = [] } = damper.branch(data, given, direction) ?? {}, first = way.length ? { [along]: way[0] } : {};
  return { ...damper.start(data, { ...given, ...first }), first };
};

// First cycles of the run of a point, so few that they take no time: of a branch, at its first value.
damper.beginning = (data, given, direction) => {
  const begun = damper.first(data, given, direction), segments = [];
  const most = Math.min(8, data.run.transient + data.run.periods);
  const work = damper.stepwise(begun.model, begun.state, most, (one) => segments.push(one), 2000);
  let turn = work.next();
  while (!turn.done && (segments.length < 150 || !turn.value.cycles)) turn = work.next();
  return turn.value && { ...begun, from: 0, cycles: turn.done ? most : turn.value.cycles, segments };
};

// The run of a point: yields after each event, so that the page stays alive, and returns the run.
damper.running = function* (data, given, direction) {
  const { transient, periods, max_events: most } = data.run;
  let begun = damper.start(data, given);
  const branch = damper.branch(data, given, direction);
  if (branch) { // each point of the branch before this one hands its end over
    const { along, way } = branch;
    let before = null;
    for (const value of [...way, given[along]]) {
      const here = damper.start(data, { ...given, [along]: value });
      if (before) {
        const scale = before.length / here.length, speed = scale * here.time / before.time;
        const [x, v, y, u] = before.state, walls = before.model.clearance;
        const at = scale * x, place = walls && Math.min(Math.max((y - x) / walls, -1), 1) * here.model.clearance;
        here.state = [at, speed * v, at + place, speed * u];
      }
      if (value !== given[along]) {
        const key = JSON.stringify([direction, { ...given, [along]: value }]), known = data.ends ??= {};
        if (!known[key]) {
          const end = yield* damper.stepwise(here.model, here.state, transient + periods, null, most);
          if (!end) return null;
          [known[key]] = damper.motion(here.model, end, [(transient + periods - end.cycles) * here.model.cycle - end.time]);
        }
        here.state = known[key];
      }
      before = begun = here;
    }
  }
  const { model } = begun, watch = damper.watch(model, transient, { fraction: data.visible[0],
    speed: data.visible[1] * begun.time / begun.length, cycles: periods });
  const settled = yield* damper.stepwise(model, begun.state, transient, null, most);
  if (!settled) return null;
  const kept = [], end = transient + periods;
  const see = (s) => {
    watch.see(s);
    if ((s.cycles - end + Math.min(9, periods)) * model.cycle + s.time + s.duration >= 0) kept.push(s);
  };
  if (!(yield* damper.stepwise(model, settled, end, see, most))) return null;
  const found = watch.result(), cycles = Math.min(periods, found.period ? found.period * Math.ceil(3 / found.period) : 8);
  const run = { ...begun, ...found, from: end - cycles, cycles, section: watch.states.filter((_, k) => k % 2 === 0) };
  run.segments = kept.filter((one) => (one.cycles - run.from) * model.cycle + one.time + one.duration > 0);
  if (!found.period) { // how far apart is a start beside it in the end?
    const [x, v, y, u] = watch.states[0], near = 1e-9 * (1 + Math.abs(x));
    const twin = yield* damper.stepwise(model, [x + near, v, y + near, u], periods, null, most);
    const [end] = twin ? damper.motion(model, twin, [(periods - twin.cycles) * model.cycle - twin.time]) : [];
    run.growth = end && Math.max(...end.map((value, k) => Math.abs(value - watch.states.at(-1)[k]))) / near;
  }
  return run;
};

// Rows of [time, x, x', y, y'] over the cycles shown, both ends of each segment among them.
damper.sampled = (run, rows = 900) => run.segments.flatMap((s) => {
  const total = run.cycles * run.model.cycle, begins = (s.cycles - run.from) * run.model.cycle + s.time;
  const first = Math.max(begins, 0), length = Math.min(begins + s.duration, total) - first;
  if (!(length >= 0)) return [];
  const count = Math.max(6, Math.ceil(length / total * rows));
  const times = Array.from({ length: count + 1 }, (_, k) => first + length * k / count);
  const states = damper.motion(run.model, s, times.map((time) => time - begins));
  return times.map((time, k) => [time, ...states[k]]);
});

// Means and extremes over the cycles shown, and what became of the work of the force, per cycle.
damper.measured = (run, rows) => {
  const { model, cycles } = run, { mass, free, omega, phase } = model;
  let [work, dashpot, square, impacts, lost] = [0, 0, 0, 0, 0];
  rows.slice(1).forEach((row, k) => { // two Gauss points of the cubic through both ends
    const [t, x, v] = rows[k], h = row[0] - t;
    const middle = (row[2] + v) / 2, bend = (3 * (row[1] - x) / (h || 1) - 3 * middle) / 2;
    for (const part of [-0.7745966692414834, 0, 0.7745966692414834]) {
      const weight = h * (part ? 5 : 8) / 18, speed = middle + part * (row[2] - v) / 2 + bend * (1 - part * part);
      const u = (1 + part) / 2, step = row[1] - x;
      const way = x + step * u + u * (1 - u) * ((1 - u) * (h * v - step) - u * (h * row[2] - step));
      work += weight * free.strength * Math.sin(omega * (t + (1 + part) * h / 2) + phase) * speed;
      dashpot += weight * 2 * free.damping * speed * speed;
      square += weight * way * way;
    }
  });
  for (const s of run.segments) {
    const inside = (s.cycles - run.from) * model.cycle + s.time >= 0, half = 0.5 * mass / (1 + mass);
    if (!inside || s.cause !== IMPACT) continue;
    impacts++;
    lost += half * (s.speed * s.speed - (s.mode === TAIL ? 0 : s.rate * s.rate));
  }
  const energy = ([, x, v, y, u]) => 0.5 * (v * v + x * x + mass * u * u) + mass * model.gravity * y;
  const stored = energy(rows.at(-1)) - energy(rows[0]), total = cycles * model.cycle;
  const alone = free.strength / Math.hypot((1 - omega) * (1 + omega), 2 * free.damping * omega);
  const peak = Math.max(...rows.map((row) => Math.abs(row[1]))), rms = Math.sqrt(square / total);
  return { peak, rms, alone, impacts: impacts / cycles, work: work / cycles, dashpot: dashpot / cycles,
    lost: lost / cycles, stored: stored / cycles };
};

damper.unpack = (text, Kind) =>
  new Kind(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);

// --- An interactive figure ------------------------------------------------------------------------

// As in the static figures; the primary is ink.
const BLUE = "#0072B2", ORANGE = "#E69F00", SKY = "#56B4E9";
const FREE_MASS = "#D55E00", RELATIVE = "#009E73", THEORY = "#8F3B6C";
const KEEP = "Keep this point beside the next";
const CHATTER = ["no visible chatter", "incomplete chatter", "complete chatter"];
const show = (value) => typeof value === "number" ? String(Number(value.toPrecision(5))) : value;
const pretty = (units) => units.replace("sqrt(K M)", "√(KM)").replace("sqrt", "√").replace("F0", "F₀").replace("^2", "²");
const named = (label, units) => units ? `${label} / ${/[ /]/.test(units) ? `(${pretty(units)})` : pretty(units)}` : label;
const fits = (one, value) => value === null || value >= (one.least ?? -Infinity) && value <= (one.most ?? Infinity);
const element = (tag, set = {}, ...inside) => {
  const made = Object.assign(document.createElement(tag), set);
  made.append(...inside);
  return made;
};
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
const axis = (title, more = {}) => ({ title: { text: title, font: { size: 13 } }, automargin: true, zeroline: false,
  gridcolor: colour("line"), linecolor: colour("soft"), ticks: "outside", exponentformat: "power", ...more });
const layout = (x, y, more = {}) => ({ xaxis: x, yaxis: y, margin: { l: 10, r: 10, t: 30, b: 10 },
  paper_bgcolor: colour("paper"), plot_bgcolor: colour("paper"), font: { family: "system-ui, sans-serif",
    color: colour("ink") }, hovermode: "closest", legend: { orientation: "h", y: 1.01, yanchor: "bottom",
    itemsizing: "constant" }, ...more });
const PLOT = { responsive: true, displayModeBar: innerWidth > 700 && "hover", displaylogo: false, modeBarButtons: [["zoom2d", "pan2d", "resetScale2d", "toImage"]] };
const download = (name, rows) => element("a", { download: name, href: URL.createObjectURL(new Blob(
  [rows.map((row) => `${row.map((cell) => /[",]/.test(cell) ? `"${cell}"` : cell).join()}\n`).join("")])) }).click();

// In the next picture of the page, or soon where none is drawn, as in a tab that nobody sees.
const next_picture = (then) => {
  const once = () => { const go = then; then = null; go?.(); };
  requestAnimationFrame(once);
  setTimeout(once, 500);
};
// After it: what takes long need not hold up the motion.
const painted = (then) => new Promise((go) => next_picture(() => setTimeout(go))).then(then);

damper.draw = (place) => {
  const data = damper.figures[place.dataset.figure], map = data.kind === "map";
  const x = data.axes.at(-1), y = map ? data.axes.at(-2) : null, others = data.axes.filter((one) => one !== x && one !== y);
  const quantity = Object.fromEntries(data.parameters.map((one) => [one.name, one]));
  const values = Object.fromEntries(data.parameters.map((one) => [one.name, one.value]));
  const picks = {}, fields = {}, variable = element("select");
  const controls = element("div", { className: "controls" }), sliders = element("div", { className: "sliders" });
  const every = element("div", { className: "controls" });
  const add = (label, select, options, chosen) => {
    options.forEach((text, value) => select.append(element("option", { value }, show(text))));
    select.addEventListener("change", () => { chosen?.(Number(select.value)); refresh(); });
    controls.append(element("label", {}, `${label} `, select));
  };
  const scaled = (name, value) => Number((value * quantity[name].scale).toPrecision(12));
  const set = (name, value) => {
    values[name] = value;
    for (const field of fields[name] ?? []) {
      const log = field.dataset.log && value > 0;
      field.value = field.type === "range" && log ? Math.log(value) : value === null ? "" : scaled(name, value);
    }
  };
  const field = (name, more, into) => {
    const one = quantity[name], range = more.type === "range", label = named(one.label, one.units);
    const input = element("input", { step: "any", ...more });
    input.setAttribute("aria-label", range ? `${label}, slider` : label);
    if (more.log) input.dataset.log = "1";
    (fields[name] ??= []).push(input);
    input.addEventListener("input", () => {
      let value = range && more.log ? Math.exp(input.value) : Number(input.value) / one.scale;
      if (input.value === "") value = one.default;
      if (value === undefined) return;
      input.setCustomValidity(fits(one, value) ? "" : `must be ${one.allowed}`);
      if (!input.reportValidity()) return;
      set(name, value);
      follow(true);
    });
    into.append(range ? input : element("label", {}, `${label} `, input));
  };

  if (data.variables?.length > 1) add("Shown", variable, data.variables.map((one) => one.name));
  for (const one of others) {
    picks[one.name] = element("select");
    add(named(one.label, one.units), picks[one.name], one.values, (k) => {
      if (one.name in quantity) set(one.name, one.own[k]);
      if (one.name === "draw") for (const name in data.draws) set(name, data.draws[name][k]);
    });
    if (one.name in quantity) values[one.name] = one.own[0];
  }
  for (const name in data.draws) values[name] = data.draws[name][data.draw];
  for (const one of [x, y].filter(Boolean)) {
    const ends = [one.own[0], one.own.at(-1)].map((end) => one.log ? Math.log(end) : scaled(one.name, end));
    const row = element("div", {});
    field(one.name, { type: "number" }, row);
    field(one.name, { type: "range", min: ends[0], max: ends[1], log: one.log }, row);
    sliders.append(row);
    values[one.name] = one.own[one.own.length >> (one === y ? 2 : 1)];
  }
  data.parameters.filter((one) => one !== quantity[x.name] && one !== quantity[y?.name])
    .forEach((one) => field(one.name, { type: "number" }, every));
  const start = { ...values };

  const panel = element("div", { className: "panel", role: "group" });
  panel.setAttribute("aria-label", `${place.dataset.caption}. The fields below choose a point, too.`);
  const said = element("p", { className: "said" }), beside = element("p", { className: "more" });
  said.setAttribute("aria-live", "polite");
  const wrongly = element("p", { role: "alert" });
  const stage = element("canvas", { className: "stage", height: 80 }), scale = element("p", { className: "more" });
  stage.setAttribute("role", "img");
  stage.setAttribute("aria-label", "The free mass in its box: no point is computed yet");
  const [history, primary, relative] = ["history", "", ""].map((name) => element("div", { className: name, role: "group" }));
  const now = element("div", { className: "now" }), past = element("div", { className: "past" }, history, now);
  const runs = element("div", { className: "runs" }, past, relative, primary);
  const measured = element("dl", { className: "values" }), text = element("textarea", { readOnly: true, hidden: true, rows: 7 });
  text.setAttribute("aria-label", "Copied text");
  const play = element("button", { type: "button" }, "Play");
  const speed = element("input", { type: "range", min: -1.5, max: 1, step: 0.1, value: -0.3 });
  const note = element("span", { role: "status" });
  const button = (label, action) => element("button", { type: "button", onclick: action }, label);
  const copy = (what, make) => button(what, () => {
    text.value = make();
    text.hidden = false;
    text.select();
    navigator.clipboard?.writeText(text.value).then(() => { note.textContent = "Copied."; }, () => {});
  });
  // The run that the next ones are drawn over, and what was said of it.
  let kept = null;
  const keep = element("button", { type: "button", onclick: () => {
    kept = kept ? null : shown && { shown, said: said.textContent, told: shown.told };
    keep.textContent = kept ? "Forget the kept point" : KEEP;
    if (shown) describe(shown.told), plots(shown.run, shown.units);
  } }, KEEP);
  const bar = element("div", { className: "controls bar" }, play, element("label", {}, "speed ", speed),
    copy("Copy link", () => location.href), copy("Copy as Python", () => python()), copy("Copy as YAML", () => yaml()),
    button("Figure as CSV", () => download(`${place.dataset.figure.replaceAll("/", "-")}.csv`, table())),
    button("Motion as CSV", () => download("motion.csv", motion())), keep, note);
  const colourOf = map && !data.classes.length ? `Colour: ${named(data.label, data.units)}` : "";
  place.replaceChildren(wrongly, controls, element("p", { className: "more" }, colourOf), panel, sliders,
    element("details", {}, element("summary", {}, "All parameters and the start"), every), beside, said, stage, scale, bar, text, runs, measured);

  const at = (one) => Number(picks[one.name].value);
  // Number of a place in what lies in the order of the axes.
  const number = (axes) => axes.reduce((sum, one) => sum * one.values.length + at(one), 0);
  const fixed = others.filter((one) => !data.overlaid.includes(one.name));
  const grid = data.values && damper.unpack(data.values, Float32Array);
  const size = map && x.values.length * y.values.length;
  const slice = (packed, Kind, length) => packed && damper.unpack(packed, Kind).slice(number(fixed) * length, (number(fixed) + 1) * length);
  const rowsOf = (all) => y.values.map((_, k) => Array.from(all.subarray(k * x.values.length, (k + 1) * x.values.length)));

  const heat = () => {
    const from = number(fixed) * size, rows = rowsOf(grid.subarray(from, from + size));
    const classes = data.classes, ratio = data.colours.length > 0;
    const height = (z) => !Number.isFinite(z) ? null : ratio ? Math.log10(z) : z;
    const bar = { thickness: 10, len: 1, orientation: "h", y: 1.01, yanchor: "bottom" };
    const trace = { type: "heatmap", x: x.values, y: y.values, z: rows.map((row) => row.map(height)),
      customdata: rows.map((row) => row.map((z) => classes.length && Number.isFinite(z)
        ? classes[z][0] : `${show(z)} ${data.units}`)),
      hovertemplate: `${x.label} %{x:.5~g} ${x.units}<br>${y.label} %{y:.5~g} ${y.units}<br>`
        + "<b>%{customdata}</b><extra></extra>", hoverongaps: false, colorscale: "Cividis", colorbar: bar };
    if (classes.length) {
      trace.colorscale = classes.flatMap(([, fill], k) =>
        [[k / classes.length, fill], [(k + 1) / classes.length, fill]]);
      Object.assign(trace, { zmin: -0.5, zmax: classes.length - 0.5, showscale: false });
    } else if (ratio) {
      // Either side of 1 has the colours of its own range, up to ten times.
      const ticks = [0.1, 0.2, 0.5, 1, 2, 5, 10], known = grid.filter((z) => z > 0 && Number.isFinite(z));
      const span = (most) => Math.log10(Math.min(Math.max(most, 1.05), 10));
      const below = span(1 / known.reduce((a, z) => Math.min(a, z), 1)), above = span(known.reduce((a, z) => Math.max(a, z), 1));
      const middle = below / (below + above), last = (data.colours.length - 1) / 2;
      const [low, high] = [10 ** -below, 10 ** above];
      if (!ticks.some((tick) => tick < 1 && tick >= low)) ticks.push(Math.ceil(100 * low) / 100);
      if (!ticks.some((tick) => tick > 1 && tick <= high)) ticks.push(Math.floor(100 * high) / 100);
      trace.colorscale = data.colours.map((fill, k) => [k < last ? middle * k / last : middle + (1 - middle) * (k / last - 1), fill]);
      Object.assign(trace, { zmin: -below, zmax: above });
      Object.assign(bar, { tickvals: ticks.map(Math.log10), ticktext: ticks.map(String) });
    }
    const dots = { type: "scatter", mode: "markers", hoverinfo: "skip" }, drawn = [trace];
    const used = new Set(rows.flat());
    classes.forEach(([name, fill], k) => used.has(k) && drawn.push({ ...dots, x: [null], y: [null], name,
      marker: { symbol: "square", size: 11, color: fill, line: { width: 1, color: "#666" } } }));
    const idle = slice(data.idle, Uint8Array, size), best = slice(data.best, Uint16Array, x.values.length);
    if (idle && !classes.length) {
      const cells = [...idle.keys()].filter((k) => idle[k]), thin = Math.ceil(cells.length / 1500);
      const places = cells.filter((_, k) => k % thin === 0), wide = x.values.length;
      if (places.length) drawn.push({ ...dots, x: places.map((k) => x.values[k % wide]),
        y: places.map((k) => y.values[Math.floor(k / wide)]), name: "walls never touched",
        marker: { symbol: "line-ne-open", size: 7, color: "#777", line: { width: 1, color: "#777" } } });
    }
    if (ratio) drawn.push({ ...dots, x: [null], y: [null], mode: "lines", name: "ratio = 1", line: { width: 1.2, color: colour("ink") } },
      { type: "contour", x: x.values, y: y.values, showlegend: false,
      z: rows.map((row, j) => row.map((z, i) => idle?.[j * x.values.length + i] ? null : height(z))), hoverinfo: "skip",
      contours: { start: 0, end: 0, size: 1, coloring: "lines" }, colorscale: [[0, "#000"], [1, "#000"]], showscale: false, line: { width: 1.2, color: "#000" } });
    if (best) {
      const known = [...best.keys()].filter((k) => best[k]);
      drawn.push({ ...dots, x: known.map((k) => x.values[k]), y: known.map((k) => y.values[best[k] - 1]),
        name: `best ${[y, x].map((one) => one.label.split(",")[0]).join(" at each ")}`, marker: { size: 5, color: "#fff", line: { width: 1, color: "#000" } } });
    }
    return drawn;
  };

  const columns = (data.variables ?? []).map((one) => ({ ...one, counts: damper.unpack(one.counts, Uint16Array),
    values: damper.unpack(one.values, Float32Array) }));
  const chatter = data.chatter && damper.unpack(data.chatter, Uint8Array);
  const kinds = { 0: ["no chatter", "ink"], 1: ["incomplete chatter", ORANGE], 2: ["complete chatter", BLUE] };
  const diagram = (one) => {
    const over = others.filter((other) => data.overlaid.includes(other.name)), last = over.at(-1);
    const count = over.reduce((product, other) => product * other.values.length, 1);
    const first = number(fixed) * count, traces = {};
    let from = one.counts.subarray(0, first * x.values.length).reduce((sum, n) => sum + n, 0);
    for (let branch = 0; branch < count; branch++) {
      x.values.forEach((value, k) => {
        const column = (first + branch) * x.values.length + k, name = last ? `${last.name} ${last.values[branch % last.values.length]}` : "";
        const kind = chatter ? kinds[chatter[column]] : [name, branch === 1 ? SKY : "ink"];
        const paint = kind[1] === "ink" ? colour("ink") : kind[1];
        const trace = traces[kind[0]] = traces[kind[0]] || { type: "scatter", name: kind[0], x: [], y: [],
          mode: "markers", showlegend: Boolean(kind[0]),
          marker: { size: one.line ? 4 : 2.5, color: paint, symbol: one.line && branch ? "circle-open" : "circle" },
          hovertemplate: `${x.label} %{x:.5~g} ${x.units}<br>${one.name} `
            + `<b>%{y:.5~g} ${one.units}</b><extra>${kind[0]}</extra>` };
        for (let n = 0; n < one.counts[column]; n++) {
          trace.x.push(value);
          trace.y.push(one.values[from + n]);
        }
        from += one.counts[column];
      });
    }
    return Object.values(traces);
  };

  const head = (one) => one.units ? `${one.name} (${one.units})` : one.name;
  const digits = (value) => Number.isFinite(value) ? Number(value.toPrecision(7)) : ""; // all that four bytes hold
  const table = () => {
    const one = columns[Number(variable.value)] || columns[0], rest = fixed.map((one) => one.values[at(one)]);
    if (!map) return [[...fixed, x, one].map(head).concat("kind"), ...diagram(one).flatMap((trace) =>
      trace.x.map((value, k) => [...rest, value, digits(trace.y[k]), trace.name]))];
    const from = number(fixed) * size, cell = (z) => data.classes[z]?.[0] ?? digits(z);
    return [[...fixed, x, y, { name: data.label, units: data.units }].map(head), ...y.values.flatMap((up, j) =>
      x.values.map((value, i) => [...rest, value, up, cell(grid[from + j * x.values.length + i])]))];
  };

  const motion = () => {
    const units = shown?.units ?? {}, of = { time: units.time, x: units.length, v: units.speed, y: units.length, u: units.speed };
    return [Object.entries(of).map(([name, units]) => head({ name, units })), ...(shown?.rows ?? [])];
  };

  const cells = (one) => { // from the outer edge of the first cell to that of the last
    const ends = [...one.values.slice(0, 2), ...one.values.slice(-2)].map(one.log ? Math.log10 : Number);
    return [1.5 * ends[0] - 0.5 * ends[1], 1.5 * ends[3] - 0.5 * ends[2]];
  };
  const cursor = () => {
    const line = { type: "line", line: { color: THEORY, width: 2, dash: map ? "dot" : "solid" } };
    const here = (one) => scaled(one.name, values[one.name]);
    return [{ ...line, x0: here(x), x1: here(x), yref: "paper", y0: 0, y1: 1 },
      ...(map ? [{ ...line, y0: here(y), y1: here(y), xref: "paper", x0: 0, x1: 1 }] : [])];
  };

  const refresh = (moves = true) => {
    const one = columns[Number(variable.value)] || columns[0], bar = map && !data.classes.length;
    const scale = (along) => map ? { type: along.log ? "log" : "linear", range: cells(along) } : {};
    const up = map ? axis(named(y.label, y.units), scale(y)) : axis(named(one.name, one.units), { type: one.log ? "log" : "linear" });
    // As long as the choices stay, so does what the reader has zoomed into.
    Plotly.react(panel, map ? heat() : diagram(one), layout(axis(named(x.label, x.units), scale(x)), up, { shapes: cursor(),
      legend: { orientation: "h", y: bar ? -0.16 : 1.01, yanchor: bar ? "top" : "bottom", itemsizing: "constant" },
      showlegend: true, uirevision: fixed.map(at).join() + variable.value, height: 430, plot_bgcolor: map ? "#b0b0b0" : colour("paper") }), PLOT);
    follow(moves);
  };

  // --- the run of the point
  let asked = 0, shown = null, moving = null, playing = false, waits = false, in_view = true;
  const direction = () => picks.direction ? data.axes.find((one) => one.name === "direction").values[at({ name: "direction" })] : data.direction;
  const where = () => [...new Set([...others.map((one) => one.name), x.name, ...(y ? [y.name] : [])])].map((name) => {
    const one = quantity[name];
    return one ? `${one.label.split(",")[0]} ${show(scaled(name, values[name]))} ${pretty(one.units)}`.trim() : `${name} ${name === "direction" ? direction() : picks[name].value}`;
  }).join(", ");
  const changed = () => data.parameters.filter((one) => {
    const pick = others.find((other) => other.name === one.name);
    if (one.name === x.name || one.name === y?.name) return false;
    const drawn = one.name in data.draws ? data.draws[one.name][picks.draw ? Number(picks.draw.value) : data.draw] : start[one.name];
    return values[one.name] !== (pick ? pick.own[at(pick)] : drawn);
  });

  // In the next picture of the page: until then the mouse button's release is to be answered, by the plot
  // as well, and what that reads of the page should not have changed.
  const follow = (moves) => {
    const mine = ++asked;
    next_picture(() => mine === asked && compute(mine, moves));
  };
  const compute = async (mine, moves) => {
    painted(() => {
      if (mine !== asked) return;
      if (panel._fullLayout) Plotly.relayout(panel, { shapes: cursor() });
      if (moves) remember();
    });
    const others = changed();
    beside.textContent = others.length ? `Not as in the figure above: ${others.map((one) =>
      `${one.label} ${show(values[one.name] === null ? "as the other" : scaled(one.name, values[one.name]))} ${one.units}`.trim()).join(", ")}.` : "";
    const unknown = data.parameters.filter((one) => !one.known && values[one.name] !== one.default).map((one) => one.label);
    if (!data.forces.includes(data.forcing)) unknown.push(`the force “${data.forcing}”`);
    if (data.masses > 1) unknown.push(`${data.masses} free masses`);
    if (data.tables) unknown.push("a table of the restitution");
    const { transient, periods } = data.run;
    if (![transient, periods].every(Number.isInteger)) unknown.push("runs whose length is a time, not cycles");
    shown = moving = null;
    if (unknown.length) return stop(`This page does not compute ${unknown.join(", ")}; damper.run in Python does. At ${where()}.`);
    if (!damper.first(data, values, direction()).state.every(Number.isFinite)) {
      return stop(`Without damping there is no steady response at resonance, from which to start. At ${where()}.`);
    }
    const work = damper.running(data, values, direction());
    for (let turn = work.next(), began = performance.now(), most = 8; ; turn = work.next()) {
      if (turn.done) { turn.value ? present(turn.value, moves) : stop(`The run stopped early, after ${data.run.max_events} events, at ${where()}.`); return; }
      if (performance.now() - began < most) continue;
      if (most === 8) begin_with(damper.beginning(data, values, direction()), moves);
      await (most === 8 ? painted() : new Promise((go) => setTimeout(go)));
      if (mine !== asked) return;
      [began, most] = [performance.now(), 25];
    }
  };
  // What lasts longer begins with the first cycles, and says which.
  const begin_with = (run, moves) => {
    place.classList.add("busy");
    const [first] = Object.keys(run?.first ?? {});
    said.textContent = `Computing … at ${where()}.` + (run && moves ? ` Meanwhile its first ${run.cycles > 1 ? `${run.cycles} cycles` : "cycle"} from the start${
      first ? `, at ${quantity[first].label} ${`${show(scaled(first, run.first[first]))} ${pretty(quantity[first].units)}`.trim()}, where its branch begins` : ""}.` : "");
    if (run && moves) move(run, damper.sampled(run, 300), moves);
  };
  const move = (run, rows, moves) => {
    const { length: l, time: t } = run, size = l * (data.si ? 1e3 : 1);
    moving = { run, walls: run.model.clearance * size, cycle: run.model.cycle * t,
      rows: rows.map(([time, ...state]) => [time * t, ...state.map((value, k) => value * size / (k % 2 ? t : 1))]) };
    stage.hidden = scale.hidden = false;
    if (moves && !matchMedia("(prefers-reduced-motion: reduce)").matches) start_playing(true); else animate(0);
    return moving;
  };
  const stop = (why) => {
    place.classList.remove("busy");
    said.textContent = why;
    runs.hidden = stage.hidden = scale.hidden = measured.hidden = true;
  };

  const present = (run, moves) => {
    const rows = damper.sampled(run), found = damper.measured(run, rows), { length: l } = run;
    const units = data.si ? { l: 1e3, length: "mm", time: "s", speed: "mm/s", energy: "J" }
      : { l: 1, length: "F0/K", time: "sqrt(M/K)", speed: "F0/sqrt(K M)", energy: "F0^2/K" };
    const size = l * units.l;
    place.classList.remove("busy");
    shown = Object.assign(move(run, rows, moves), { units });
    let words = damper.in_words(run);
    if (!run.period) words = run.growth > 1e3 ? `chaotic: a difference of 1e-9 grows to ${show(Number((run.growth * 1e-9).toPrecision(2)))} in ${data.run.periods} cycles`
      : `no period up to 8 cycles: quasi-periodic, or not settled after ${data.run.transient} cycles`;
    said.replaceChildren(element("b", {}, `${CHATTER[run.chatter]}; ${words}`), ` at ${where()}`);
    const share = (part) => found.work > 0 ? ` (${show(100 * part / found.work)} %)` : "";
    const joule = data.si ? l * l * values.stiffness : 1;
    const told = [["largest displacement", found.peak * size, units.length], ["rms displacement", found.rms * size, units.length],
      ["largest displacement over that without damper", found.peak / found.alone, ""],
      ["rms displacement over that without damper", found.rms / found.alone * Math.SQRT2, ""],
      ["impacts per cycle, of complete chatter the resolved ones", found.impacts, ""], ["fraction of time sticking", run.sticking, ""],
      ["work of the force per cycle", found.work * joule, units.energy],
      ["of it lost in the dashpot", found.dashpot * joule, units.energy + share(found.dashpot)],
      ["of it lost in impacts", found.lost * joule, units.energy + share(found.lost)],
      ["of it stored", found.stored * joule, units.energy + share(found.stored)]];
    describe(shown.told = told.filter(([, value]) => Number.isFinite(value)).map(([label, value, unit]) => [label, `${show(value)} ${pretty(unit)}`]));
    runs.hidden = measured.hidden = false;
    stage.setAttribute("aria-label", `The free mass in its box over ${run.cycles} cycles: ${said.textContent}`);
    painted(() => shown?.run === run && plots(run, units));
  };

  const describe = (told) => {
    const before = Object.fromEntries(kept?.told ?? []);
    measured.replaceChildren(...told.map(([label, text]) => element("div", {}, element("dt", {}, label), element("dd", {}, text,
      ...(kept ? [element("br"), `kept: ${before[label] ?? "none"}`] : [])))),
    ...(kept ? [element("div", {}, element("dt", {}, "kept point, dotted"), element("dd", { className: "told" }, kept.said))] : []));
  };

  const plots = (run, units) => {
    const { rows, walls } = shown, ink = colour("ink"), size = run.length * units.l;
    const padded = (values) => { // an axis with room beside the curve
      const low = Math.min(...values), high = Math.max(...values), room = 0.06 * (high - low) || 1;
      return { range: [low - room, high + room] };
    };
    const column = (k) => rows.map((row) => row[k]);
    const line = (xs, ys, name, paint, more = {}) => ({ type: "scatter", mode: "lines", x: xs, y: ys, name,
      line: { color: paint, width: 1.3, simplify: false }, ...more });
    const times = rows.map((row) => row[0]), between = rows.map((row) => row[3] - row[1]), still = { ...PLOT, displayModeBar: false };
    const wall = (sign) => line([times[0], times.at(-1)], [sign * walls, sign * walls], "walls", "",
      { line: { color: "#999", width: 1 }, yaxis: "y2", showlegend: sign > 0, hoverinfo: "skip" });
    // The kept run, beneath: the same curves, dotted.
    const other = kept && kept.shown !== shown ? kept.shown.rows : null;
    const under = (x, y, name, paint, more = {}) => other ? [line(other.map(x), other.map(y), `${name}, kept`, paint,
      { line: { color: paint, width: 1.1, dash: "dot", simplify: false }, ...more })] : [];
    Plotly.react(history, [...under((r) => r[0], (r) => r[1], "primary", ink),
      ...under((r) => r[0], (r) => r[3] - r[1], "relative motion", RELATIVE, { yaxis: "y2" }), line(times, column(1), "primary", ink), line(times, column(3), "free mass", FREE_MASS),
      line(times, between, "free mass relative to the primary", RELATIVE, { yaxis: "y2" }), wall(-1), wall(1)],
    layout(axis(named("time", units.time), { anchor: "y2" }), axis(named("displacement", units.length), { domain: [0.54, 1] }),
      { height: 480, yaxis2: axis(named("relative", units.length), { domain: [0, 0.46], range: [-1.12 * walls || -1, 1.12 * walls || 1] }) }), still);
    const section = run.section.map(([a, v, y, u]) => [a * size, v * size / run.time, (y - a) * size, (u - v) * size / run.time]);
    const dots = (first) => line(section.map((one) => one[first]), section.map((one) => one[first + 1]), "section, once per cycle", ORANGE,
      { mode: "markers", marker: { size: 5, color: ORANGE } });
    const edges = [-walls, walls].map((at) => ({ type: "line", x0: at, x1: at, yref: "paper", y0: 0, y1: 1, line: { color: "#999", width: 1 } }));
    const small = { height: 320, showlegend: true };
    Plotly.react(relative, [...under((r) => r[3] - r[1], (r) => r[4] - r[2], "relative motion", RELATIVE), line(between, rows.map((row) => row[4] - row[2]), "relative motion", RELATIVE), dots(2)],
      layout(axis(named("relative displacement", units.length), { range: [-1.12 * walls || -1, 1.12 * walls || 1] }),
        axis(named("relative velocity", units.speed), padded(rows.map((row) => row[4] - row[2]))), { ...small, shapes: edges }), still);
    Plotly.react(primary, [...under((r) => r[1], (r) => r[2], "primary", ink), line(column(1), column(2), "primary", ink), dots(0)],
      layout(axis(named("displacement", units.length), padded(column(1))), axis(named("velocity", units.speed), padded(column(2))), small), still);
    history.setAttribute("aria-label", `Time history: ${said.textContent}`);
    relative.setAttribute("aria-label", "Phase portrait of the relative motion");
    primary.setAttribute("aria-label", "Phase portrait of the primary");
  };

  // --- the ball in its box: the way of the box and that of the ball in it have a scale each
  const animate = (time) => {
    const { rows, walls } = moving, wide = stage.width = stage.clientWidth || stage.width, pen = stage.getContext("2d");
    let low = 0, high = rows.length - 1;
    while (high - low > 1) { const middle = (low + high) >> 1; if (rows[middle][0] <= time) low = middle; else high = middle; }
    const part = Math.min(Math.max((time - rows[low][0]) / (rows[high][0] - rows[low][0] || 1), 0), 1);
    const [, a, , b] = rows[low].map((value, k) => value + part * (rows[high][k] - value));
    moving.peak ??= Math.max(...rows.map((row) => Math.abs(row[1]))) || 1;
    const radius = 14, travel = 0.18 * wide, centre = wide / 2 + a / moving.peak * 0.22 * wide, half = travel + radius;
    pen.strokeStyle = pen.fillStyle = colour("ink");
    pen.lineWidth = 3;
    pen.strokeRect(centre - half, 18, 2 * half, 44);
    pen.lineWidth = 1;
    pen.beginPath();
    const left = centre - half; // the spring to the frame
    for (let k = 0; k <= 24; k++) pen.lineTo(left * k / 24, 40 + (k % 24 && (k % 2 ? 8 : -8)));
    pen.stroke();
    const ratio = walls ? travel / walls / (0.22 * wide / moving.peak) : 1, times = show(Number(ratio.toPrecision(2)));
    scale.textContent = `The motion in the box is drawn ${times} times as large as that of the box. Time ${time.toPrecision(3)} ${pretty(data.si ? "s" : "sqrt(M/K)")}`;
    pen.fillStyle = FREE_MASS;
    pen.beginPath();
    pen.arc(centre + (walls ? (b - a) / walls * travel : 0), 40, radius, 0, 7);
    pen.fill();
    const plot = moving === shown && history._fullLayout?.xaxis;
    now.style.left = plot ? `${plot._offset + plot.l2p(time)}px` : "-9px";
    if (plot) [now.style.top, now.style.height] = ["t", "h"].map((part) => `${history._fullLayout._size[part]}px`);
  };
  const frame = (at) => {
    waits = false;
    if (!playing || !moving || !in_view) return;
    const total = moving.run.cycles * moving.cycle;
    moving.at = ((moving.at ?? 0) + (moving.last ? at - moving.last : 0) / 1000 * 10 ** speed.value * moving.cycle) % total;
    moving.last = at;
    animate(moving.at);
    waits = true;
    requestAnimationFrame(frame);
  };
  const start_playing = (on) => {
    playing = on;
    play.textContent = on ? "Pause" : "Play";
    if (!on || !moving) return;
    moving.last = 0;
    animate(moving.at ?? 0);
    if (!waits) requestAnimationFrame(frame);
    waits = true;
  };
  play.addEventListener("click", () => start_playing(!playing));
  // What nobody sees need not move.
  new IntersectionObserver((seen) => {
    in_view = seen.at(-1).isIntersecting;
    if (in_view && playing) start_playing(true);
  }).observe(stage);

  // --- link, Python, YAML
  const remember = () => {
    const kept = { figure: place.dataset.figure };
    for (const one of others) if (!(one.name in quantity)) kept[one.name] = at(one);
    if (data.variables?.length > 1) kept.shown = variable.value;
    for (const one of others) if (one.name in quantity && values[one.name] !== one.own[at(one)]) kept[`${one.name}_shown`] = at(one);
    for (const name in values) if (values[name] !== start[name]) kept[name] = values[name] ?? "";
    window.history.replaceState(null, "", `#${new URLSearchParams(kept)}`);
  };
  const recall = (kept) => {
    if (kept.get("figure") !== place.dataset.figure) return false;
    const wrong = [];
    const taken = (key, known, before) => {
      const value = kept.get(key);
      if (value === null || known(value)) return value ?? before;
      wrong.push(`${key}=${value}`);
      return before;
    };
    const listed = (select) => (value) => /^\d+$/.test(value) && Number(value) < select.options.length;
    const allowed = (name) => (value) => value === "" ? quantity[name].default === null
      : Number.isFinite(Number(value)) && fits(quantity[name], Number(value));
    if (data.variables?.length > 1) variable.value = taken("shown", listed(variable), variable.value);
    for (const name in values) {
      const value = taken(name, allowed(name), start[name]);
      set(name, value === "" || value === null ? null : Number(value));
    }
    for (const one of others) {
      const own = one.name in quantity ? one.own.indexOf(values[one.name]) : taken(one.name, listed(picks[one.name]), 0);
      picks[one.name].value = taken(`${one.name}_shown`, listed(picks[one.name]), Math.max(own, 0));
    }
    const keys = ["figure", "shown", ...Object.keys(values), ...others.flatMap(({ name }) => [name, `${name}_shown`])];
    for (const [key, value] of kept) if (!keys.includes(key)) wrong.push(`${key}=${value}`);
    wrongly.textContent = wrong.length ? `The address asks for ${wrong.join(", ")}, which this figure does not have; it shows what it has by itself.` : "";
    return true;
  };
  const begins = () => {
    const { state: [a, v, y, u], length, time } = shown.run;
    return [a * length, v * length / time, y * length, u * length / time];
  };
  const given = () => data.parameters.filter((one) => !one.name.startsWith("initial_") && values[one.name] !== null
    && values[one.name] !== one.default).map((one) => [one.name, values[one.name]]);
  const python = () => {
    if (!shown) return "# not computed";
    const [a, v, y, u] = begins(), forcing = data.forcing === "harmonic" ? [] : [["forcing", `"${data.forcing}"`]];
    return `import damper\n\npoint = damper.${data.si ? "SIParameters" : "Parameters"}(${[...given(), ...forcing].map((one) => one.join("=")).join(", ")})\n`
      + `start = damper.State(x=${a}, v=${v}, y=${y}, u=${u})\nrun = damper.run(point, ${data.run.transient + shown.run.cycles} * point.cycle, start)\nrun.plot(${data.run.transient})\n`;
  };
  const yaml = () => {
    if (!shown) return "# not computed";
    const [a, v, y, u] = begins(), walls = shown.run.model.clearance * shown.run.length;
    const initial = { displacement: a, velocity: v, position: walls ? (y - a) / walls : 0, relative_velocity: u - v };
    const rows = [...given(), ...Object.entries(initial).filter(([, value]) => value).map(([name, value]) => [`initial_${name}`, value])];
    return `title: A point of ${place.dataset.caption.replaceAll(/[:#]/g, ",")}\nsource: chosen on the page of results\n${data.forcing === "harmonic" ? "" : `forcing: ${data.forcing}\n`}`
      + `parameters:\n${rows.map(([name, value]) => `  ${name}: ${value}\n`).join("")}transient: ${data.run.transient}\nperiods: ${data.run.periods}\n`
      + "observers: {response: , impacts: , bursts: , motion: , trajectory: }\nfigures:\n  history: {kind: trajectory}\n";
  };

  // A click anywhere in the panel chooses the nearest place of the grid, as the eye measures.
  const choose = (one, pixel, drawn) => {
    const near = one.values.map((value) => Math.abs(drawn.d2p(value) - pixel));
    set(one.name, one.own[near.indexOf(Math.min(...near))]);
  };
  let down = null;
  panel.addEventListener("pointerdown", (event) => { down = event; }, true);
  addEventListener("pointerup", (event) => {
    if (!down || Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY) > 4) { down = null; return; }
    down = null;
    const box = panel.getBoundingClientRect(), { xaxis, yaxis } = panel._fullLayout;
    const [left, top] = [event.clientX - box.x - xaxis._offset, event.clientY - box.y - yaxis._offset];
    if (left < 0 || top < 0 || left > xaxis._length || top > yaxis._length) return;
    choose(x, left, xaxis);
    if (map) choose(y, top, yaxis);
    follow(true);
  }, true);
  damper.drawn.push({ refresh: () => refresh(false), recall });
  Object.entries(values).forEach(([name, value]) => set(name, value));
  recall(new URLSearchParams(location.hash.slice(1)));
  refresh(false);
};

// --- the reader's own machine, at the page's beginning
const own = document.getElementById("own");
const machine = () => {
  const said = document.getElementById("own-said");
  const wrong = own.querySelector("input:invalid");
  if (wrong) {
    const { min, max } = wrong, range = max ? `from ${min} to ${max}` : `at least ${min}`;
    said.textContent = `${wrong.parentNode.textContent.trim()}: must be a number, ${range}.`;
    return;
  }
  const given = Object.fromEntries([...new FormData(own)].map(([name, value]) => [name, Number(value)]));
  const found = damper.machine({ ...given, damping: given.damping / 100, gap: given.gap / 1e3 });
  const mm = (value) => `${Number((value * 1e3).toPrecision(3))} mm`;
  said.textContent = !found ? "The run stopped early: too many impacts."
    : `It moves ${mm(found.peak)} at most, without the damper ${mm(found.alone)}: ${Math.round(100 * found.peak / found.alone)} %. `
    + `${Number(found.impacts.toPrecision(3))} impacts per cycle. The closed form for a light mass asks for a gap of ${mm(found.gap)}, and leaves ${mm(found.best)}. `
    + "damper design sizes it over a band, with tolerances.";
};
own?.addEventListener("input", () => next_picture(machine));
own?.addEventListener("submit", (event) => event.preventDefault());
if (own) addEventListener("load", () => setTimeout(machine));

damper.drawn = [];
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => damper.drawn.forEach((one) => one.refresh()));

// Scripts beside the page, each once, when a figure comes near the window.
damper.load = (path) => damper.load[path] = damper.load[path] || new Promise((done, failed) => {
  document.head.append(element("script", { src: path, onload: done, onerror: failed }));
});
damper.plotly = () => damper.plotly.ready = damper.plotly.ready || damper.load("plotly.js").then(async () => {
  const packed = (await fetch(`data:;base64,${damper.packed}`)).body.pipeThrough(new DecompressionStream("gzip"));
  await damper.load(URL.createObjectURL(await new Response(packed).blob()));
});
const near = new IntersectionObserver((seen) => seen.filter((one) => one.isIntersecting).forEach(({ target }) => {
  near.unobserve(target);
  Promise.all([damper.plotly(), damper.load(`${target.dataset.figure}.js`)])
    .then(() => damper.draw(target))
    .catch((error) => {
      console.error(error);
      target.textContent = "Its files, plotly.js and the folder interactive, are not beside this page.";
    });
}), { rootMargin: "300px" });
document.querySelectorAll("[data-figure]").forEach((place) => near.observe(place));

// --- Chapters, filter and sorting -----------------------------------------------------------------

// Names that differ in the fewest letters are the nearest.
const distance = (one, other) => {
  let row = [...other, ""].map((_, k) => k);
  [...one].forEach((letter, k) => {
    row = row.reduce((made, up, n) => [...made, n ? Math.min(up + 1, made[n - 1] + 1, row[n - 1] + (letter !== other[n - 1])) : k + 1], []);
  });
  return row.at(-1);
};
const lost = document.querySelector("#lost");

// A link leads into a folded chapter: open all that is around its target, or say that there is none.
const unfold = () => {
  lost.hidden = true;
  if (location.hash.length < 2) return;
  const asked = location.hash.slice(1), figure = new URLSearchParams(asked).get("figure");
  let name = asked;
  try { name = figure ? `figure=${figure}` : decodeURIComponent(asked); } catch { /* no text: as it stands */ }
  const target = document.getElementById(name);
  if (!target) {
    const ids = [...document.querySelectorAll("section, figure, [data-figure], h3[id], td[id]")].map((one) => one.id).filter(Boolean);
    const near = ids.sort((a, b) => distance(name, a) - distance(name, b))[0];
    lost.replaceChildren(`Nothing on this page has the address “${name}”. The nearest one: `, element("a", { href: `#${near}` }, near), ".");
    lost.hidden = false;
    lost.scrollIntoView();
    return;
  }
  for (let one = target; one; one = one.parentElement) if (one.tagName === "DETAILS") one.open = true;
  target.querySelector(":scope > details.chapter")?.setAttribute("open", "");
  target.scrollIntoView();
};
addEventListener("hashchange", () => {
  unfold();
  const kept = new URLSearchParams(location.hash.slice(1));
  if (kept.has("figure")) damper.drawn.forEach((one) => { one.recall(kept) && one.refresh(); });
});
document.addEventListener("click", ({ target }) => target.closest("a[href^='#']") && setTimeout(unfold));
unfold();

const contents = document.querySelector("nav details"), search = document.querySelector("#search");
contents.open = innerWidth > 900;
search.addEventListener("input", () => {
  const words = search.value.toLowerCase().split(/\s+/);
  document.querySelectorAll("nav li").forEach((item) => {
    const section = document.getElementById(item.firstElementChild.getAttribute("href").slice(1));
    const text = section.textContent.toLowerCase();
    item.hidden = section.hidden = !words.every((word) => text.includes(word));
  });
  document.querySelectorAll("nav ul").forEach((list) => {
    list.hidden = list.previousElementSibling.hidden = [...list.children].every((item) => item.hidden);
  });
  const count = document.querySelectorAll("nav li:not([hidden])").length;
  document.querySelector("#found").textContent = search.value ? `${count || "No"} section${count === 1 ? "" : "s"}` : "";
});

document.querySelectorAll("table.cells thead th").forEach((head) => {
  const button = element("button", { type: "button" }, ...head.childNodes);
  head.append(button);
  button.addEventListener("click", () => {
    const down = head.getAttribute("aria-sort") === "ascending", body = head.closest("table").tBodies[0];
    const key = (row) => row.cells[head.cellIndex].textContent.trim();
    const order = (a, b) => (Number(a) - Number(b)) || a.localeCompare(b, "en", { numeric: true });
    const rows = [...body.rows].sort((a, b) => (down ? -1 : 1) * order(key(a), key(b)));
    head.parentElement.querySelectorAll("th").forEach((other) => other.removeAttribute("aria-sort"));
    head.setAttribute("aria-sort", down ? "descending" : "ascending");
    body.append(...rows);
  });
});
