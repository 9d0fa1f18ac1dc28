"use strict";
// The rigid damper, computed in the page from event to event as damper.engine does: flights, impacts,
// the closed rest of complete chatter, sticking, release. Dimensionless; docs/method.md.
const damper = { figures: {} };

// How the masses move in a segment, and what began it, by the numbers of damper.engine.segment.
const FLIGHT = 0, TAIL = 1, STICKING = 2, NOTHING = -1, IMPACT = 0, STICK = 1, RELEASE = 2;
// Terms of a Taylor series to roundoff, over a step of one over the fastest rate, and over parts of it.
const TERMS = 19, FEWER = [[0.02, 9], [0.2, 13], [1, TERMS]];
// Of a polynomial's terms in each of its Bernstein coefficients, by degree: binomials' ratios.
const choose = (n, k) => k ? choose(n - 1, k - 1) * n / k : 1;
const BERNSTEIN = Array.from({ length: TERMS }, (_, degree) => Array.from({ length: degree + 1 }, (_, k) =>
  Float64Array.from({ length: k + 1 }, (_, n) => choose(k, n) / choose(degree, n))));

// Plain arrays: typed ones of this size lie outside the heap, and cost more than the sums in them.
const zeros = (count) => new Array(count).fill(0);

damper.model = (p, accuracy = 1e-12) => {
  const { mass_ratio: mass, damping_ratio: damping, frequency_ratio: omega, phase = 0, gravity = 0 } = p;
  const strength = p.forcing === "none" ? 0 : p.force_amplitude ?? 1, both = 1 + mass;
  const oscillator = (share, pull) => ({ damping: damping / share, stiffness: 1 / share,
    strength: strength / share, pull, step: 1 / Math.max(omega, 2 * damping / share + Math.sqrt(1 / share)) });
  const restitution = { 1: p.restitution, "-1": p.restitution_left ?? p.restitution };
  return { mass, omega, phase, gravity, clearance: p.clearance, cycle: 2 * Math.PI / omega, restitution,
    tolerance: accuracy / Math.max(1, strength && omega),
    free: oscillator(1, 0), stuck: oscillator(both, -mass * gravity / both) };
};

// Terms of the displacement over a step h: x'' + 2 damping x' + stiffness x = strength sin(angle) + pull.
damper.series = (osc, omega, x, v, angle, h) => {
  const count = FEWER.find(([part]) => h <= part * osc.step)?.[1] ?? TERMS;
  const terms = zeros(count), sine = Math.sin(angle), cosine = Math.cos(angle);
  const square = h * h, drag = 2 * osc.damping * h, turn = omega * h;
  terms[0] = x;
  terms[1] = v * h;
  for (let n = 0, power = osc.strength; n < count - 2; n++) {
    const wave = (n & 1 ? cosine : sine) * (n & 2 ? -power : power);
    const force = n ? wave : wave + osc.pull;
    terms[n + 2] = (square * (force - osc.stiffness * terms[n]) - drag * (n + 1) * terms[n + 1]) / ((n + 1) * (n + 2));
    power *= turn / (n + 1);
  }
  return terms;
};

damper.value = (terms, t) => {
  let sum = 0;
  for (let n = terms.length - 1; n >= 0; n--) sum = sum * t + terms[n];
  return sum;
};
damper.slope = (terms, t) => {
  let sum = 0;
  for (let n = terms.length - 1; n > 0; n--) sum = sum * t + n * terms[n];
  return sum;
};

// First t in [0, 1] at which a polynomial falls through zero; Infinity where there is none. A value
// that begins at zero is divided by t: what is left decides. Bernstein coefficients prove that no
// root is skipped: without a negative one there is none, with one change of sign exactly one.
damper.first_root = (terms) => {
  let size = 0, first = 0;
  while (first < terms.length - 1 && terms[first] <= 0) {
    if (terms[first] < 0 && first > 0) return 0;
    first++;
  }
  const a = first ? terms.slice(first) : terms, degree = a.length - 1;
  for (let n = 1; n <= degree; n++) size += Math.abs(a[n]);
  if (a[0] > size) return Infinity;
  const b = zeros(degree + 1);
  for (let k = 0; k <= degree; k++) {
    const parts = BERNSTEIN[degree][k];
    for (let n = 0; n <= k; n++) b[k] += parts[n] * a[n];
  }
  return damper.isolated(a, b, 0, 1);
};

damper.isolated = (a, b, low, high) => {
  let changes = 0;
  for (let k = 1; k < b.length; k++) changes += (b[k] < 0) !== (b[k - 1] < 0);
  if (!changes) return b[0] < 0 ? low : Infinity;
  if (changes === 1 && b[0] >= 0) return damper.bracketed(a, low, high);
  const middle = 0.5 * (low + high);
  if (high - low < 1e-12) return Infinity; // it touches zero: no impact
  const left = b.slice(), right = b.slice(); // de Casteljau
  for (let n = 1; n < b.length; n++) {
    for (let k = 0; k < b.length - n; k++) right[k] = 0.5 * (right[k] + right[k + 1]);
    left[n] = right[0];
  }
  const found = damper.isolated(a, left, low, middle);
  return found < Infinity ? found : damper.isolated(a, right, middle, high);
};

// The one root between two places: Newton steps, halved where they leave the bracket.
damper.bracketed = (a, low, high) => {
  let t = 0.5 * (low + high);
  for (let k = 0; k < 100; k++) {
    const value = damper.value(a, t);
    if (value > 0) low = t; else high = t;
    let next = t - value / damper.slope(a, t);
    if (!(next >= low && next <= high)) next = 0.5 * (low + high);
    if (Math.abs(next - t) <= Number.EPSILON * t || high - low <= Number.EPSILON * high) return next;
    t = next;
  }
  return t;
};

// The run's start: the free mass in flight, or on a wall by the rules of an impact.
damper.begin = (model, [x, v, y, u] = [0, 0, 0, 0]) => {
  const d = model.clearance, side = y >= x ? 1 : -1, gap = d - side * (y - x), rate = -side * (u - v);
  const s = { cycles: 0, time: 0, x, v, gap, rate, side, mode: FLIGHT, cause: NOTHING, speed: 0, first: 0,
    accumulation: 0 };
  if (d === 0) {
    return { ...s, v: (v + model.mass * u) / (1 + model.mass), gap: 0, rate: 0, side: 0, mode: STICKING };
  }
  if (gap > 4 * Number.EPSILON * (d + Math.abs(x) + Math.abs(y))) return s;
  s.gap = 0;
  return rate === 0 && damper.stays(model, s) ? { ...s, mode: STICKING, cause: STICK } : s;
};

// Second to fourth derivative of the displacement less the free mass's, in flight, and their sizes.
damper.rates = (model, s) => {
  const { free, omega, gravity } = model, angle = omega * s.time + model.phase;
  const sine = free.strength * Math.sin(angle), cosine = free.strength * Math.cos(angle);
  const a = sine - 2 * free.damping * s.v - s.x, j = omega * cosine - 2 * free.damping * a - s.v;
  return { a: a + gravity, j, snap: -omega * omega * sine - 2 * free.damping * j - a,
    size: free.strength * omega * omega + 2 * free.damping * Math.abs(j) + Math.abs(a) };
};

damper.stays = (model, s) => {
  const { a, j, snap } = damper.rates(model, s);
  return s.side * (a || j || snap) <= 0;
};

// Time to the accumulation point after an impact, and the error of that (damper.engine.accumulation).
damper.accumulation = (model, s) => {
  const { a, j, size } = damper.rates(model, s), r = model.restitution[s.side], force = -s.side * a;
  if (!(force > 0 && r < 1)) return [0, Infinity];
  const jerk = s.side * j, damping = model.free.damping, first = 2 * s.rate / (force * (1 - r));
  const impacts = damping * model.mass / (1 + model.mass);
  const duration = first * (1 + jerk / force * first / 3 - impacts * r * first);
  const change = (Math.abs(jerk) / force + 2 * damping) * first;
  if (!(duration > 0 && change < 0.5)) return [0, Infinity];
  return [duration, first * (change * change + size / force * first * first)];
};

damper.after_impact = (model, s) => {
  const speed = Math.abs(s.rate), r = model.restitution[s.side], { mass } = model;
  const next = { ...s, v: s.v + s.side * mass * (1 + r) / (1 + mass) * speed, gap: 0, rate: r * speed,
    mode: FLIGHT, cause: IMPACT, speed, first: s.first || speed };
  if (next.rate === 0) return damper.stays(model, next) ? { ...next, mode: TAIL } : next;
  const [left, error] = damper.accumulation(model, next);
  const closes = error <= model.tolerance && 0.25 * next.rate * left * (1 - r) <= model.clearance;
  return closes ? { ...next, mode: TAIL, accumulation: left } : next;
};

// A step in sticking or flight: terms of the displacement, and of the gap or contact force.
damper.step = (model, s, at) => {
  const osc = s.mode === FLIGHT ? model.free : model.stuck, { gravity } = model;
  let h = osc.step;
  if (s.cause === IMPACT && s.mode === FLIGHT && !at.tau) { // a short bounce is one short step
    const bend = s.side * damper.rates(model, s).a;
    if (bend < 0) h = Math.min(h, -3 * at.rate / bend);
  }
  const way = damper.series(osc, model.omega, at.x, at.v, model.omega * (s.time + at.tau) + model.phase, h);
  if (s.mode === FLIGHT) {
    const gap = zeros(way.length);
    for (let n = 2; n < way.length; n++) gap[n] = s.side * way[n];
    gap[0] = at.gap;
    gap[1] = at.rate * h;
    // At a release both accelerations are the same, by definition.
    gap[2] = s.cause === RELEASE && !at.tau ? 0 : gap[2] + s.side * 0.5 * gravity * h * h;
    return { h, way, seen: gap };
  }
  const force = zeros(way.length - 2);
  for (let n = 0; n < force.length; n++) force[n] = -s.side * (n + 1) * (n + 2) * way[n + 2];
  force[0] -= s.side * gravity * h * h;
  return { h, way, seen: force };
};

// The segment after this one, with `duration` of this one written into it; null where `limit` is first.
damper.following = (model, s, limit) => {
  s.duration = limit;
  const then = (tau, more) => {
    s.duration = tau;
    const turns = Math.floor((s.time + tau) / model.cycle);
    return { ...s, cycles: s.cycles + turns, time: s.time + tau - turns * model.cycle, gap: 0, speed: 0,
      accumulation: 0, ...more };
  };
  if (s.mode === TAIL) {
    if (s.accumulation > limit) return null;
    const [[x, v]] = damper.flow(model, s, [s.accumulation]);
    return then(s.accumulation, { x, v, rate: 0, mode: STICKING, cause: STICK, first: 0 });
  }
  let at = { x: s.x, v: s.v, gap: s.gap, rate: s.rate, tau: 0 };
  while (at.tau <= limit) {
    const { h, way, seen } = damper.step(model, s, at);
    const near = s.side ? damper.first_root(seen) : Infinity;
    let far = Infinity;
    if (s.mode === FLIGHT) {
      const other = zeros(seen.length);
      for (let n = 0; n < seen.length; n++) other[n] = -seen[n];
      other[0] += 2 * model.clearance;
      far = damper.first_root(other);
    }
    const t = Math.min(near, far, 1), tau = at.tau + t * h;
    const x = damper.value(way, t), v = damper.slope(way, t) / h;
    const rate = s.mode === FLIGHT ? damper.slope(seen, t) / h : 0;
    if (near <= 1 || far <= 1) {
      if (tau > limit) return null;
      if (s.mode === STICKING) return then(tau, { x, v, rate: 0, mode: FLIGHT, cause: RELEASE });
      const other = far < near ? { side: -s.side, first: 0 } : {};
      return damper.after_impact(model, then(tau, { x, v, rate, ...other }));
    }
    at = { x, v, gap: s.mode === FLIGHT ? damper.value(seen, 1) : 0, rate, tau };
  }
  return null;
};

// The primary or, in contact, the centre of both masses about which bounces go on: [x, x'] at rising
// times after the start of a segment, each from the one before.
damper.flow = (model, s, times) => {
  const flies = s.mode === FLIGHT, osc = flies ? model.free : model.stuck;
  let x = s.x, v = flies ? s.v : s.v - s.side * model.mass / (1 + model.mass) * s.rate, at = 0;
  return times.map((tau) => {
    const steps = Math.max(1, Math.ceil((tau - at) / osc.step)), h = (tau - at) / steps;
    for (let step = 0; h > 0 && step < steps; step++) {
      const way = damper.series(osc, model.omega, x, v, model.omega * (s.time + at + step * h) + model.phase, h);
      [x, v] = [damper.value(way, 1), damper.slope(way, 1) / h];
    }
    at = tau;
    return [x, v];
  });
};

// Gap and gap rate in the closed rest of a burst: its bounces are self-similar.
damper.bounce = (restitution, duration, rate, tau) => {
  const left = 1 - tau / duration;
  if (restitution === 0 || !(left > 0)) return [0, 0];
  const shrink = Math.exp(Math.floor(Math.log(left) / Math.log(restitution)) * Math.log(restitution));
  const part = Math.min(Math.max((1 - left / shrink) / (1 - restitution), 0), 1);
  const speed = rate * shrink;
  return [speed * duration * shrink * (1 - restitution) * part * (1 - part), speed * (1 - 2 * part)];
};

// States [x, x', y, y'] at rising times after the start of a segment.
damper.motion = (model, s, times) => damper.flow(model, s, times).map(([x, v], k) => {
  const tau = times[k];
  let gap = 0, rate = 0;
  if (s.mode === FLIGHT) {
    const fallen = model.gravity * tau;
    gap = s.gap + s.rate * tau + s.side * (x - s.x - s.v * tau + 0.5 * fallen * tau);
    gap = Math.min(Math.max(gap, 0), 2 * model.clearance);
    rate = s.rate + s.side * (v - s.v + fallen);
  } else if (s.mode === TAIL && s.rate > 0) {
    const share = s.side * model.mass / (1 + model.mass);
    [gap, rate] = damper.bounce(model.restitution[s.side], s.accumulation, s.rate, tau);
    [x, v] = [x + share * gap, v + share * rate];
  }
  return [x, v, x + s.side * (model.clearance - gap), v - s.side * rate];
});

// Runs on from a segment or a state to a whole number of cycles. Yields each segment that begins, and
// calls `see` with those that have ended and with the last one, cut there, which is returned to go on
// from; null after `most` events.
damper.stepwise = function* (model, from, cycles, see, most = 1e6) {
  let s = Array.isArray(from) ? damper.begin(model, from) : from;
  for (let events = 0; events < most; events++) {
    const next = damper.following(model, s, (cycles - s.cycles) * model.cycle - s.time);
    see?.(s);
    if (!next) return s;
    yield s = next;
  }
  return null;
};

// A machine at resonance in SI units, its damping a ratio: the largest displacement of 40 cycles, that
// without the damper, the impacts per cycle, and what the closed form of docs/theory.md says of the best
// gap. The larger motion of two starts: at rest, and from the amplitude without the damper.
damper.machine = ({ mass, hertz, damping, force, free, gap, restitution }) => {
  const size = force / (mass * (2 * Math.PI * hertz) ** 2), ratio = free / mass, cycles = 40;
  const model = damper.model({ mass_ratio: ratio, damping_ratio: damping, frequency_ratio: 1,
    clearance: 0.5 * gap / size, restitution });
  const before = Math.min(Math.max(Math.ceil(30 / (2 * Math.PI * (damping + 0.15 * ratio))), 100), 2000);
  const alone = 0.5 / damping, bouncy = (1 + restitution) / (1 - restitution);
  const best = 1 / (2 * damping + 4 * ratio / Math.PI * bouncy);
  const run = (start) => {
    let peak = 0, impacts = 0;
    const see = (s) => {
      const first = Math.max((before - s.cycles) * model.cycle - s.time, 0), length = s.duration - first;
      if (length < 0) return;
      impacts += s.cause === IMPACT && !first;
      const count = Math.ceil(100 * length / model.cycle);
      const times = Array.from({ length: count + 1 }, (_, k) => first + k / Math.max(count, 1) * length);
      for (const [x] of damper.motion(model, s, times)) peak = Math.max(peak, Math.abs(x));
    };
    const work = damper.stepwise(model, start, before + cycles, see, 2e5);
    for (let turn = work.next(); ; turn = work.next()) if (turn.done) return turn.value && { peak, impacts };
  };
  const found = [0, -alone].map((x) => run([x, 0, x + model.clearance, 0]));
  if (!found.every(Boolean)) return null;
  const worst = found[0].peak > found[1].peak ? found[0] : found[1];
  return { peak: worst.peak * size, alone: alone * size, impacts: worst.impacts / cycles,
    best: best * size, gap: Math.PI * bouncy * best * size };
};

// --- What motion it is, as damper.observers.motion and bursts say -----------------------------------

// Watches a run from a whole number of cycles on; `visible`: part of a burst's first speed, or a speed.
damper.watch = (model, from, { fraction = 0.03, speed: least = 0, cycles: length }) => {
  const states = [], counts = [], now = { "-1": 0, 1: 0, complete: { "-1": 0, 1: 0 }, row: 0, wall: 0 };
  let burst, chatter = 0, stuck = 0; // burst: null for none, undefined for one that began before
  const close = (outcome) => { if (burst.count >= 5) chatter = Math.max(chatter, outcome); };
  const see = (s) => {
    const start = (s.cycles - from) * model.cycle + s.time, inside = start >= 0;
    if (!states.length && !burst) burst = s.first > 0 ? { earlier: s.side } : null;
    if (burst?.earlier && (s.mode === STICKING || (s.cause === IMPACT && s.side !== burst.earlier))) burst = null;
    if (s.mode === STICKING) {
      stuck += Math.max(0, s.duration + Math.min(start, 0));
      if (s.cause === STICK && burst) close(2);
      if (s.cause === STICK) burst = null;
    } else if (s.cause === IMPACT && inside && !burst?.earlier) {
      if (burst && burst.wall !== s.side) { close(1); burst = null; }
      burst = burst || { wall: s.side, count: 0 };
      const limit = Math.max(fraction * s.first, least), r = model.restitution[s.side];
      burst.count += s.speed >= limit;
      if (s.mode === TAIL && r > 0 && limit > 0 && limit <= s.rate) {
        burst.count += 1 + Math.floor(Math.log(limit / s.rate) / Math.log(r));
      }
    }
    if (inside && s.cause === IMPACT) {
      now.row = s.side === now.wall ? now.row + 1 : 1;
      now.wall = s.side;
      now[s.side]++;
    } else if (inside && s.cause === STICK) {
      now[s.side] -= now.row; // the impacts before are those of a sequence that completes
      now.complete[s.side]++;
      now.row = now.wall = 0;
    }
    const end = s.duration + 1e-12 * model.cycle, times = []; // the last sample is where the run ends
    for (let k = states.length, tau; (tau = k / 2 * model.cycle - start) <= end && k <= 2 * length; k++) {
      times.push(Math.max(tau, 0));
      counts.push([now[-1], now[1], now.complete[-1], now.complete[1]]);
    }
    if (times.length) states.push(...damper.motion(model, s, times));
  };
  const result = () => {
    if (burst?.wall) close(1);
    return { ...damper.repeats(model, states.slice(-33), counts.slice(-33)), chatter,
      sticking: stuck / (length * model.cycle) };
  };
  return { see, result, states };
};

// After how many cycles the motion repeats, what happens in that time, and on which side it is.
damper.repeats = (model, states, counts) => {
  const near = 1e-6 * Math.max(...states.flat().map(Math.abs)), last = states.length - 1;
  const apart = (from, shift, sign) => Math.max(...states.slice(from).flatMap((state, k) =>
    state.map((value, n) => Math.abs(value - sign * states[from + k - shift][n]))));
  for (let period = 1; period <= last / 4; period++) {
    const from = last - 2 * period;
    if (!(apart(from, 2 * period, 1) <= near)) continue;
    const happened = counts[last].map((count, k) => count - counts[from][k]);
    const odd = !model.gravity && model.restitution[1] === model.restitution[-1];
    const symmetric = period % 2 === 1 && apart(from, period, -1) <= near;
    const sums = states.slice(from + 1).reduce((sum, state) =>
      [state[2] - state[0], ...state].map((value, k) => value + sum[k]), [0, 0, 0, 0, 0]);
    const [left, right, done, completed] = happened;
    const signs = [right - left, completed - done, ...sums.filter((sum) => Math.abs(sum) > near)];
    return { period, happened, side: !odd ? null : symmetric ? 0 : Math.sign(signs.find(Boolean) || 0) };
  }
  return { period: 0 };
};

damper.in_words = ({ period, happened, side }) => {
  if (!period) return "no period found";
  const kinds = [["impact", 0], ["complete chatter sequence", 2]].map(([noun, k]) => [noun, happened[k], happened[k + 1]])
    .filter(([, left, right]) => left || right);
  const words = [`period ${period}`], plural = (n) => n > 1 ? "s" : "";
  if (!kinds.length) return [...words, "no impacts"].join(", ");
  if (kinds.some(([, left, right]) => left !== right)) {
    return [...words, ...kinds.map(([noun, left, right]) => `${noun}s ${left} left, ${right} right`)].join(", ");
  }
  words.push(`${kinds.map(([noun, n]) => `${n} ${noun}${plural(n)}`).join(" and ")} on each wall`);
  if (side !== null) words.push({ 0: "symmetric", "-1": "more to the left", 1: "more to the right" }[side]);
  return words.join(", ");
};
