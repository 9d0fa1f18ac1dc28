"use strict";
// The page of results: filter, sorting, and interactive figures. Nothing is loaded from a network.
const damper = { figures: {} };

// --- The motion of a run, in closed form between events -------------------------------------------

// x'' + 2 damping x' + stiffness x = strength sin(angle), a time tau on: Taylor series in steps short
// against all rates. It serves every regime of damping, and resonance, to roundoff.
damper.advance = (osc, x, v, angle, tau) => {
  if (!(tau > 0)) return [x, v];
  const steps = Math.max(1, Math.ceil(2 * tau * Math.max(osc.rate, osc.omega)));
  const h = tau / steps;
  for (let step = 0; step < steps; step++) {
    const at = angle + osc.omega * h * step;
    const waves = [Math.sin(at), Math.cos(at), -Math.sin(at), -Math.cos(at)];
    let [lower, upper, power] = [x, v * h, osc.strength]; // terms of the series of x and the force
    [x, v] = [lower + upper, upper];
    for (let n = 0; n < 18; n++) {
      const force = power * waves[n % 4];
      const next = h * (h * (force - osc.stiffness * lower) - 2 * osc.damping * (n + 1) * upper)
        / ((n + 1) * (n + 2));
      [lower, upper, power] = [upper, next, power * osc.omega * h / (n + 1)];
      x += next;
      v += (n + 2) * next;
    }
    v /= h;
  }
  return [x, v];
};

damper.oscillator = (run, mass) => ({ // mass: of what moves together, over the primary's
  damping: run.damping_ratio / mass, stiffness: 1 / mass, strength: 1 / mass,
  omega: run.frequency_ratio, rate: 2 * run.damping_ratio / mass + 1,
});

// Gap and gap rate in the closed rest of a burst: its bounces are self-similar.
damper.bounce = (restitution, duration, rate, tau) => {
  const left = 1 - tau / duration;
  if (restitution === 0 || !(left > 0)) return [0, 0];
  const shrink = Math.exp(Math.floor(Math.log(left) / Math.log(restitution)) * Math.log(restitution));
  const part = Math.min(Math.max((1 - left / shrink) / (1 - restitution), 0), 1);
  const speed = rate * shrink;
  return [speed * duration * shrink * (1 - restitution) * part * (1 - part), speed * (1 - 2 * part)];
};

// Segments of a run: an object each.
damper.segments = (run) => {
  const all = damper.unpack(run.rows, Float64Array), count = all.length / 6;
  return Array.from({ length: count }, (_, k) => {
    const [time, x, v, rate, rest, code] = [0, 1, 2, 3, 4, 5].map((field) => all[field * count + k]);
    const mode = Math.floor(code / 3), tail = mode === 1;
    return { time, x, v, rate, mode, side: code % 3 - 1, gap: tail ? 0 : rest, completion: tail ? rest : 0,
      end: k + 1 < count ? all[k + 1] : run.end };
  });
};

// [x, x', y, y'] a time tau after the start of a segment.
damper.motion = (run, s, tau) => {
  const angle = run.frequency_ratio * s.time + run.phase;
  const share = s.mode ? s.side * run.mass_ratio / (1 + run.mass_ratio) : 0;
  const osc = damper.oscillator(run, s.mode ? 1 + run.mass_ratio : 1);
  let [x, v] = damper.advance(osc, s.x, s.v - share * s.rate, angle, tau);
  let [gap, rate] = [0, 0];
  if (s.mode === 0) {
    [gap, rate] = [s.gap + s.rate * tau + s.side * (x - s.x - s.v * tau), s.rate + s.side * (v - s.v)];
  } else if (s.mode === 1 && s.rate > 0) {
    [gap, rate] = damper.bounce(run.restitution, s.completion, s.rate, tau);
    // The pair's centre follows the flow of both masses; the bounces go on about it.
    [x, v] = [x + share * gap, v + share * rate];
  }
  return [x, v, x + s.side * (run.clearance - gap), v - s.side * rate];
};

// Rows of [time, x, x', y, y'], both ends of each segment among them.
damper.sampled = (run) => damper.segments(run).flatMap((s) => {
  const first = Math.max(s.time, 0), length = s.end - first;
  const count = Math.max(8, Math.ceil(length / run.end * 900));
  return length < 0 ? [] : Array.from({ length: count + 1 }, (_, k) => {
    const time = first + length * k / count;
    return [time, ...damper.motion(run, s, time - s.time)];
  });
});

damper.unpack = (text, Kind) =>
  new Kind(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);

// --- An interactive figure ------------------------------------------------------------------------

const INK = "#000000", BLUE = "#0072B2", ORANGE = "#E69F00", VERMILION = "#D55E00", GREEN = "#009E73";
const show = (value) => typeof value === "number" ? String(Number(value.toPrecision(5))) : value;
const named = (label, units) => units ? `${label} / ${/[ /]/.test(units) ? `(${units})` : units}` : label;
const element = (tag, set = {}, ...inside) => {
  const made = Object.assign(document.createElement(tag), set);
  made.append(...inside);
  return made;
};
const axis = (title, more = {}) => ({ title: { text: title, font: { size: 13 } }, automargin: true,
  zeroline: false, gridcolor: "#eee", linecolor: "#888", ticks: "outside", ...more });
const layout = (x, y, more = {}) => ({ xaxis: x, yaxis: y, margin: { l: 10, r: 10, t: 30, b: 10 },
  font: { family: "system-ui, sans-serif" }, hovermode: "closest", legend: { orientation: "h", y: 1.01,
    yanchor: "bottom", itemsizing: "constant" }, ...more });
const PLOT = { responsive: true, displaylogo: false,
  modeBarButtons: [["zoom2d", "pan2d", "resetScale2d", "toImage"]] };

damper.draw = (place) => {
  const data = damper.figures[place.dataset.figure], map = data.kind === "map";
  const x = data.axes[data.axes.length - 1], y = map ? data.axes[data.axes.length - 2] : null;
  const picks = {}; // a drop-down for each axis: its value is the place on that axis
  const variable = element("select");
  const controls = element("div", { className: "controls" });
  const add = (label, select, options) => {
    options.forEach(([value, text]) => select.append(element("option", { value }, text)));
    select.addEventListener("change", () => refresh());
    controls.append(element("label", {}, `${label} `, select));
  };
  if (data.variables && data.variables.length > 1) {
    add("Shown", variable, data.variables.map((one, k) => [k, one.name]));
  }
  for (const one of data.axes) {
    picks[one.name] = element("select");
    const places = one.kept || one.values.map((_, k) => k);
    add(named(one.label, one.units), picks[one.name], places.map((k) => [k, show(one.values[k])]));
    if (one.kept) picks[one.name].selectedIndex = places.length >> (one === y ? 2 : 1);
  }
  const panel = element("div", { className: "panel", role: "img" });
  const said = element("p", { className: "said" });
  said.setAttribute("aria-live", "polite");
  const [history, primary, relative] = ["history", "", ""].map((name) => element("div", { className: name }));
  const runs = element("div", { className: "runs" }, history, primary, relative);
  const values = element("dl", { className: "values" });
  const colour = element("p", { className: "more" },
    map && !data.classes.length ? `Colour: ${named(data.label, data.units)}` : "");
  place.replaceChildren(controls, colour, panel, said, runs, values);
  panel.setAttribute("aria-label", `${place.dataset.caption}. The lists above choose a point, too.`);

  const at = (one) => Number(picks[one.name].value);
  // Number of a place in what lies in the order of the axes: `size` and `index` of each.
  const number = (axes, size, index) => axes.reduce((sum, one) => sum * size(one) + index(one), 0);
  const fixed = data.axes.filter((one) => one !== x && one !== y && !data.overlaid.includes(one.name));
  const kept = (one) => one.kept ? one.kept.length : one.values.length;
  const run = () => number(data.axes, kept, (one) => picks[one.name].selectedIndex);
  const grid = data.values && damper.unpack(data.values, Float32Array);

  const heat = () => {
    const size = x.values.length * y.values.length;
    const from = number(fixed, (one) => one.values.length, at) * size;
    const rows = y.values.map((_, k) => Array.from(grid.subarray(from + k * x.values.length,
      from + (k + 1) * x.values.length)));
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
      const ticks = [0.1, 0.2, 0.5, 1, 2, 5, 10];
      trace.colorscale = data.colours.map((fill, k) => [k / (data.colours.length - 1), fill]);
      Object.assign(trace, { zmin: -1, zmax: 1 });
      Object.assign(bar, { tickvals: ticks.map(Math.log10), ticktext: ticks.map(String) });
    }
    const dots = y.kept.flatMap((j) => x.kept.map((i) => [x.values[i], y.values[j]]));
    const here = { type: "scatter", mode: "markers", hoverinfo: "skip", showlegend: false };
    return [trace,
      ...classes.map(([name, fill]) => ({ type: "scatter", mode: "markers", x: [null], y: [null], name,
        marker: { symbol: "square", size: 11, color: fill, line: { width: 1, color: "#666" } } })),
      { ...here, x: dots.map((dot) => dot[0]), y: dots.map((dot) => dot[1]),
        marker: { size: 3, color: "#fff", line: { width: 0.7, color: INK } } },
      { ...here, x: [x.values[at(x)]], y: [y.values[at(y)]],
        marker: { size: 14, symbol: "circle-open", color: GREEN, line: { width: 3 } } }];
  };

  const columns = data.variables ? data.variables.map((one) => ({ ...one,
    counts: damper.unpack(one.counts, Uint16Array), values: damper.unpack(one.values, Float32Array) })) : [];
  const chatter = data.chatter && damper.unpack(data.chatter, Uint8Array);
  const COLOURS = { 0: ["no chatter", INK], 1: ["incomplete chatter", ORANGE], 2: ["complete chatter", BLUE] };
  const diagram = (shown) => {
    const over = data.axes.filter((one) => data.overlaid.includes(one.name));
    const count = over.reduce((product, one) => product * one.values.length, 1);
    const first = number(fixed, (one) => one.values.length, at) * count, traces = {};
    let from = shown.counts.subarray(0, first * x.values.length).reduce((sum, n) => sum + n, 0);
    for (let branch = 0; branch < count; branch++) {
      x.values.forEach((value, k) => {
        const column = (first + branch) * x.values.length + k, one = over[over.length - 1];
        const kind = chatter ? COLOURS[chatter[column]]
          : [one ? `${one.name} ${one.values[branch % one.values.length]}` : "", branch === 1 ? VERMILION : INK];
        const trace = traces[kind[0]] = traces[kind[0]] || { type: "scatter", name: kind[0], x: [], y: [],
          mode: shown.line ? "lines+markers" : "markers", showlegend: Boolean(kind[0]),
          marker: { size: shown.line ? 4 : 2.5, color: kind[1], symbol: shown.line && branch ? "circle-open" : "circle" },
          line: { width: 1 }, hovertemplate: `${x.label} %{x:.5~g} ${x.units}<br>${shown.name} `
            + `<b>%{y:.5~g} ${shown.units}</b><extra>${kind[0]}</extra>` };
        for (let n = 0; n < shown.counts[column]; n++) {
          trace.x.push(value);
          trace.y.push(shown.values[from + n]);
        }
        from += shown.counts[column];
      });
    }
    return Object.values(traces);
  };

  const cells = (one) => { // from the outer edge of the first cell to that of the last
    const ends = [...one.values.slice(0, 2), ...one.values.slice(-2)].map(one.log ? Math.log10 : Number);
    return [1.5 * ends[0] - 0.5 * ends[1], 1.5 * ends[3] - 0.5 * ends[2]];
  };

  const refresh = () => {
    const shown = columns[Number(variable.value)] || columns[0];
    const scale = (one) => map ? { type: one.log ? "log" : "linear", range: cells(one) } : {};
    const across = axis(named(x.label, x.units), scale(x));
    const up = map ? axis(named(y.label, y.units), scale(y))
      : axis(named(shown.name, shown.units), { type: shown.log ? "log" : "linear" });
    const cursor = map ? [] : [{ type: "line", x0: x.values[at(x)], x1: x.values[at(x)], yref: "paper",
      y0: 0, y1: 1, line: { color: GREEN, width: 2 } }];
    // As long as the choices stay, so does what the reader has zoomed into.
    const kind = fixed.map(at).join() + variable.value;
    Plotly.react(panel, map ? heat() : diagram(shown), layout(across, up, { shapes: cursor, uirevision: kind,
      height: 430, plot_bgcolor: map ? "#b0b0b0" : "#fff" }), PLOT);
    follow();
  };

  const follow = () => {
    const found = data.runs[run()], [length, time, speed] = data.run_units;
    const where = data.axes.map((one) => `${one.label} ${show(one.values[at(one)])} ${one.units}`.trim());
    said.replaceChildren(element("b", {}, found.class), ` at ${where.join(", ")}`);
    const measured = data.measured.map((one) => [one, damper.unpack(one.values, Float32Array)[run()]]);
    values.replaceChildren(...measured.filter(([, value]) => Number.isFinite(value)).map(([one, value]) =>
      element("div", {}, element("dt", {}, one.label), element("dd", {}, `${show(value)} ${one.units}`))));
    const rows = damper.sampled(found);
    runs.hidden = rows.length === 0; // the run stopped early
    if (runs.hidden) return;
    const l = found.length, t = found.time, d = found.clearance * l;
    const line = (xs, ys, name, colour, more = {}) => ({ type: "scatter", mode: "lines", x: xs, y: ys, name,
      line: { color: colour, width: 1.3, simplify: false }, ...more });
    const times = rows.map((row) => row[0] * t), between = rows.map((row) => (row[3] - row[1]) * l);
    const x1 = rows.map((row) => row[1] * l), still = { ...PLOT, displayModeBar: false };
    const wall = (sign) => line([times[0], times[times.length - 1]], [sign * d, sign * d], "walls", "",
      { line: { color: "#999", width: 1 }, yaxis: "y2", showlegend: sign > 0, hoverinfo: "skip" });
    const small = { height: 300, showlegend: false };
    Plotly.react(history, [line(times, x1, "primary", INK),
      line(times, rows.map((row) => row[3] * l), "free mass", BLUE),
      line(times, between, "free mass relative to the primary", GREEN, { yaxis: "y2" }), wall(-1), wall(1)],
    layout(axis(named("time", time), { anchor: "y2" }), axis(named("displacement", length), { domain: [0.54, 1] }),
      { height: 480, yaxis2: axis(named("relative", length), { domain: [0, 0.46] }) }), still);
    Plotly.react(primary, [line(x1, rows.map((row) => row[2] * l / t), "primary", INK)],
      layout(axis(named("displacement", length)), axis(named("velocity", speed)), small), still);
    Plotly.react(relative, [line(between, rows.map((row) => (row[4] - row[2]) * l / t), "relative motion", GREEN)],
      layout(axis(named("relative displacement", length)), axis(named("relative velocity", speed)), small), still);
    history.setAttribute("aria-label", `Time history: ${said.textContent}`);
    [history, primary, relative].forEach((plot) => plot.setAttribute("role", "img"));
    primary.setAttribute("aria-label", "Phase portrait of the primary");
    relative.setAttribute("aria-label", "Phase portrait of the relative motion");
  };

  // The nearest kept point, as the eye measures: in parts of the axis.
  const choose = (one, value) => {
    const scale = one.log ? Math.log : Number;
    const near = one.kept.map((k) => Math.abs(scale(one.values[k]) - scale(value)));
    picks[one.name].selectedIndex = near.indexOf(Math.min(...near));
  };
  refresh();
  panel.on("plotly_click", ({ points: [point] }) => {
    choose(x, point.x);
    if (map) choose(y, point.y);
    else if (data.overlaid.length === 1 && !chatter) picks[data.overlaid[0]].selectedIndex = point.curveNumber;
    refresh();
  });
};

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
    .catch(() => { target.textContent = "Its files, plotly.js and the folder interactive, are not beside this page."; });
}), { rootMargin: "300px" });
const places = document.querySelectorAll("[data-figure]");
places.forEach((place) => near.observe(place));
addEventListener("load", () => places.length && damper.plotly().catch(() => {}));

// --- Filter and sorting ---------------------------------------------------------------------------

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
