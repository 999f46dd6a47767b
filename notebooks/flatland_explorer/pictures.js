// The explorer's pictures, from the numbers that Python sends.
//
// `commands` turns numbers into a list of drawing commands; `paint` draws them on a canvas and `svg`
// writes them as a picture, so that what is tested and looked at is what is shown. All functions
// are pure.

export const SIZE = { width: 1180, height: 772 };
const BOX = {
  scene: { x: 14, y: 30, w: 600, h: 410 },
  curves: { x: 690, y: 30, w: 474, h: 410 },
  field: { x: 62, y: 490, w: 330, h: 226 },
  spectrum: { x: 462, y: 490, w: 226, h: 226 },
  path: { x: 760, y: 490, w: 404, h: 226 },
};
const INK = "#1f2937", PALE = "#9ca3af", RED = "#b91c1c", GREEN = "#15803d", BLUE = "#1d4ed8";
const LAMP = "#e0a526", MIRROR = "#2563eb", DARK = "#10131a", BLOCKED = "#5a6270", HATCH = "#e5e7eb";

// --- maps ---------------------------------------------------------------------------------------

/** The map of a window (left, right, bottom, top) [m] into a box, of equal scales. */
export function fit(window, box) {
  const [a, b, c, d] = window;
  const scale = Math.min(box.w / (b - a), box.h / (d - c));
  return {
    scale,
    x: box.x + 0.5 * box.w - 0.5 * scale * (a + b),
    y: box.y + 0.5 * box.h + 0.5 * scale * (c + d),
  };
}

export const toScreen = (map, p) => [map.x + map.scale * p[0], map.y - map.scale * p[1]];
export const toWorld = (map, q) => [(q[0] - map.x) / map.scale, (map.y - q[1]) / map.scale];

/** Distance of a place from a line of chords. */
export function distance(line, at) {
  let best = Math.hypot(at[0] - line[0][0], at[1] - line[0][1]);
  for (let k = 0; k + 1 < line.length; k++) {
    const [p, q] = [line[k], line[k + 1]];
    const [ex, ey] = [q[0] - p[0], q[1] - p[1]];
    const square = Math.max(ex * ex + ey * ey, 1e-30);
    const t = Math.min(1, Math.max(0, ((at[0] - p[0]) * ex + (at[1] - p[1]) * ey) / square));
    best = Math.min(best, Math.hypot(p[0] + t * ex - at[0], p[1] + t * ey - at[1]));
  }
  return best;
}

/** The handle that a press at a place takes: the nearest within reach, or else a body, or null. */
export function grabbed(scene, at, reach) {
  const nearest = (entries) => entries.reduce((a, b) => (b[1] < a[1] ? b : a), [null, Infinity]);
  const handles = Object.entries(scene.handles)
    .filter(([name]) => !name.endsWith(".body"))
    .map(([name, p]) => [name, Math.hypot(p[0] - at[0], p[1] - at[1])]);
  const handle = nearest(handles);
  if (handle[1] <= reach) return handle[0];
  const body = nearest(scene.parts.map((part, k) => [`${k}.body`, distance(part.line, at)]));
  return body[1] <= reach ? body[0] : null;
}

/** About `count` round numbers between two. */
export function ticks(low, high, count) {
  const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((k) => k * power).find((s) => s >= raw * 0.999);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step);
  return found.map((v) => Number(v.toPrecision(12)));
}

/** A limit that holds nearly all values: spikes of a derivative do not flatten its curve. */
export function limit(values, share = 0.97) {
  const sizes = values.filter((v) => v !== null).map(Math.abs).sort((a, b) => a - b);
  if (!sizes.length) return 1;
  const most = Math.max(sizes[Math.ceil(share * (sizes.length - 1))] * 1.25, 1e-12);
  const power = 10 ** Math.floor(Math.log10(most));
  return Number(([1, 1.5, 2, 3, 4, 5, 7].find((k) => k * power >= most) ?? 10) * power).toPrecision(6) * 1;
}

// --- drawing commands -----------------------------------------------------------------------------

const line = (points, stroke, width = 1, dash = []) => ({ op: "line", points, stroke, width, dash });
const area = (points, fill, stroke = null) => ({ op: "area", points, fill, stroke });
const rect = (x, y, w, h, fill) => ({ op: "rect", x, y, w, h, fill });
const dot = (p, r, fill, stroke = null) => ({ op: "dot", x: p[0], y: p[1], r, fill, stroke });
const text = (x, y, words, more = {}) =>
  ({ op: "text", x, y, words, size: 11, fill: INK, align: "left", turn: 0, ...more });
const clip = (box, inner) => [{ op: "clip", ...box }, ...inner, { op: "unclip" }];

const shortly = (v) => (v === 0 ? "0" : Math.abs(v) < 1e-3 || Math.abs(v) >= 1e4 ? v.toExponential(0) : String(v));

/** Frame, ticks and labels; and the map of values into the box. */
function axes(box, xs, ys, names, { title = "", below = true, count = 4 } = {}) {
  const x = (v) => box.x + (box.w * (v - xs[0])) / (xs[1] - xs[0]);
  const y = (v) => box.y + box.h - (box.h * (v - ys[0])) / (ys[1] - ys[0]);
  const [r, b] = [box.x + box.w, box.y + box.h];
  const drawn = [line([[box.x, box.y], [r, box.y], [r, b], [box.x, b], [box.x, box.y]], PALE)];
  for (const v of ticks(xs[0], xs[1], 5)) {
    drawn.push(line([[x(v), b], [x(v), b - 4]], PALE));
    if (below) drawn.push(text(x(v), b + 13, shortly(v), { align: "center", size: 10 }));
  }
  for (const v of ticks(ys[0], ys[1], count)) {
    drawn.push(line([[box.x, y(v)], [box.x + 4, y(v)]], PALE));
    drawn.push(text(box.x - 4, y(v) + 3.5, shortly(v), { align: "right", size: 10 }));
  }
  if (below) drawn.push(text(box.x + 0.5 * box.w, b + 28, names[0], { align: "center" }));
  drawn.push(text(box.x - 38, box.y + 0.5 * box.h, names[1], { align: "center", turn: -90 }));
  if (title) drawn.push(text(box.x, box.y - 8, title, { size: 12 }));
  return { x, y, drawn };
}

const missing = (box, words) => [
  rect(box.x, box.y, box.w, box.h, "#f9fafb"),
  text(box.x + 0.5 * box.w, box.y + 0.5 * box.h, words, { align: "center", fill: PALE }),
];

// --- the scene ------------------------------------------------------------------------------------

function drawScene(shown, ui) {
  const { scene, view } = shown, box = BOX.scene, map = fit(scene.window, box);
  const at = (p) => toScreen(map, p), drawn = [rect(box.x, box.y, box.w, box.h, "#ffffff")];
  const place = at(scene.probe.place);
  for (const gap of view ? view.gaps : []) {
    const fill = gap.L > 0 ? "rgba(250,204,21,0.30)" : gap.seen < 0 ? "rgba(148,163,184,0.10)" : "rgba(71,85,105,0.20)";
    drawn.push(area([place, ...gap.ends.map(at)], fill));
    for (const k of [0, gap.ends.length - 1]) drawn.push(line([place, at(gap.ends[k])], "rgba(71,85,105,0.55)", 0.7));
  }
  if (shown.path && shown.path.points) drawn.push(line(shown.path.points.map(at), MIRROR, 1, [5, 4]));
  scene.parts.forEach((part, k) => {
    const points = part.line.map(at), chosen = ui.selected === k;
    const colour = part.shines ? LAMP : part.reflects ? MIRROR : part.receives ? RED : INK;
    if (part.kind === "point") {
      drawn.push(dot(points[0], 6, LAMP, INK));
    } else {
      if (part.body) drawn.push(area(points, "rgba(31,41,55,0.12)"));
      drawn.push(line(points, chosen ? "#7c3aed" : colour, part.receives || part.shines ? 3.2 : 2.2));
    }
    if (part.name) {
      const q = points[Math.floor(points.length / 2)];
      drawn.push(text(q[0] + 8, q[1] - 8, part.name, { size: 10, fill: "#6b7280" }));
    }
  });
  for (const [name, p] of Object.entries(scene.handles)) {
    const [owner, role] = name.split(".");
    if (role === "body") continue;
    const chosen = String(ui.selected) === owner, q = at(p);
    if (role === "normal") {
      const foot = owner === "probe" ? place : at(scene.handles[`${owner}.body`]);
      drawn.push(line([foot, q], owner === "probe" ? RED : PALE, owner === "probe" ? 1.6 : 1));
    }
    drawn.push(dot(q, owner === "probe" ? 5 : chosen ? 4.5 : 3, owner === "probe" ? RED : "#ffffff", owner === "probe" ? "#ffffff" : INK));
  }
  const bar = ticks(0, (scene.window[1] - scene.window[0]) / 3, 2).pop(), left = box.x + 12, low = box.y + box.h - 12;
  drawn.push(line([[left, low], [left + bar * map.scale, low]], INK, 2));
  drawn.push(text(left + bar * map.scale + 6, low + 4, `${shortly(bar)} m`));
  if (view && view.inside) drawn.push(text(place[0], place[1] - 12, "within a body: no value", { align: "center", fill: RED }));
  const frame = [[box.x, box.y], [box.x + box.w, box.y], [box.x + box.w, low + 12], [box.x, low + 12], [box.x, box.y]];
  return [...clip(box, drawn), line(frame, PALE), text(box.x, box.y - 8, "scene: drag lines, dots and normals; red receives", { size: 12 })];
}

// --- E, E', E'' -----------------------------------------------------------------------------------

/** A curve in pieces: it ends at each jump, whose two sides a dotted line joins; null is a gap. */
export function pieces(xs, ys, jump, x, y) {
  const whole = [], dotted = [];
  let piece = [];
  const end = () => { if (piece.length > 1) whole.push(piece); piece = []; };
  xs.forEach((v, k) => {
    if (ys[k] === null) return end();
    const q = [x(v), y(ys[k])];
    piece.push(q);
    if (jump[k]) {
      end();
      const next = ys[k + 1];
      if (next !== null && next !== undefined && Math.abs(y(next) - q[1]) > 1.5) dotted.push([q, [x(xs[k + 1]), y(next)]]);
    }
  });
  end();
  return { whole, dotted };
}

function drawCurves(shown) {
  const { curve, records, field } = shown, box = BOX.curves;
  if (!curve) return missing(box, "E, E′ and E″ along the receiver");
  const gap = 22, h = (box.h - 2 * gap) / 3, drawn = [];
  [["E", "E (W/m)", RED], ["E1", "E′ (W/m²)", GREEN], ["E2", "E″ (W/m³)", BLUE]].forEach(([key, name, colour], row) => {
    const one = { x: box.x, y: box.y + row * (h + gap), w: box.w, h }, top = limit(curve[key]);
    const more = row === 0 && field ? field.mirrored.E : [];
    const most = row === 0 ? limit([...curve.E, ...more], 1) : top;
    const low = row === 0 ? 0 : -most;
    const ax = axes(one, [0, curve.length], [low, most], ["along the receiver (m)", name], { below: row === 2, count: 3 });
    const inner = [];
    for (let k = 0; k + 1 < curve.x.length; k++) {
      if (curve.E[k] === null || curve.E[k + 1] === null) inner.push(rect(ax.x(curve.x[k]), one.y, ax.x(curve.x[k + 1]) - ax.x(curve.x[k]) + 0.4, one.h, HATCH));
    }
    const seen = curve.probe.x;
    inner.push(line([[ax.x(seen), one.y], [ax.x(seen), one.y + h]], "#fca5a5"));
    if (row) inner.push(line([[box.x, ax.y(0)], [box.x + box.w, ax.y(0)]], "#e5e7eb"));
    const cut = pieces(curve.x, curve[key], curve.jump, ax.x, ax.y);
    for (const p of cut.dotted) inner.push(line(p, colour, 1, [1.5, 2.5]));
    for (const p of cut.whole) inner.push(line(p, colour, 1.8));
    if (row === 0 && records && records.x) {
      records.x.forEach((x, k) => {
        const y = ax.y(records.E[k]), r = records.reach[k];
        inner.push(line([[ax.x(x - r), y], [ax.x(x + r), y]], "rgba(124,58,237,0.35)", 2));
        inner.push(dot([ax.x(x), y], 2.6, "#7c3aed"));
      });
      const none = records.grid.map(() => false);
      for (const p of pieces(records.grid, records.answer, none, ax.x, ax.y).whole) inner.push(line(p, "#7c3aed", 1, [4, 3]));
    }
    if (row === 0 && more.length) {
      for (const p of pieces(field.mirrored.x, more, more.map(() => false), ax.x, ax.y).whole) inner.push(line(p, MIRROR, 1.2, [2, 2]));
    }
    drawn.push(...clip(one, inner), ...ax.drawn);
  });
  const [E, E1, E2] = curve.probe.values, words = (v) => (v === null ? "no value" : v.toPrecision(4));
  drawn.push(text(box.x, box.y - 8, `probe: E ${words(E)}, E′ ${words(E1)}, E″ ${words(E2)}`, { size: 12 }));
  const keys = [["exact", RED]];
  if (records && records.x) keys.push([`cache of ${records.x.length} records, worst error ${records.worst.toPrecision(2)} W/m`, "#7c3aed"]);
  if (field && field.mirrored.E.length) keys.push(["by the mirror, from rays", MIRROR]);
  let right = box.x + box.w - 6;
  keys.reverse().forEach(([w, c], k) => drawn.push(text(right, box.y + 13 + 13 * k, w, { align: "right", fill: c, size: 10 })));
  return drawn;
}

// --- the light field ------------------------------------------------------------------------------

const mixed = (a, b, t) => a.map((v, k) => Math.round(v + (b[k] - v) * t));
const rgb = (c) => `rgb(${c.join(",")})`;
/** The colour of a radiance: dark to yellow. */
export const glow = (t) => rgb(mixed([36, 40, 52], [255, 224, 130], Math.min(1, Math.max(0, t))));
const STOPS = [[0, 0, 4], [81, 18, 124], [183, 55, 121], [252, 137, 97], [252, 253, 191]];
/** The colour of a magnitude in [0, 1]. */
export function shade(t) {
  const u = Math.min(0.9999, Math.max(0, t)) * 4, k = Math.floor(u);
  return rgb(mixed(STOPS[k], STOPS[k + 1], u - k));
}

function drawField(shown) {
  const { field, curve } = shown, box = BOX.field;
  if (!field) return missing(box, "light field along the receiver");
  const half = Math.PI / 2;
  const ax = axes(box, [0, field.length], [-half, half], ["along the receiver (m)", "angle from its normal (rad)"], { title: "light field: dark nothing, grey a shape, bright light" });
  const w = box.w / field.steps, inner = [rect(box.x, box.y, box.w, box.h, DARK)];
  const top = Math.max(1e-12, ...field.strips.map((s) => s[4]));
  for (const [i, a, b, shape, L] of field.strips) {
    if (shape < 0 && !(L > 0)) continue;
    inner.push(rect(box.x + i * w, ax.y(b), w + 0.35, ax.y(a) - ax.y(b), L > 0 ? glow(L / top) : BLOCKED));
  }
  for (const i of field.inside) inner.push(rect(box.x + i * w, box.y, w + 0.35, box.h, HATCH));
  if (curve) inner.push(line([[ax.x(curve.probe.x), box.y], [ax.x(curve.probe.x), box.y + box.h]], "#f87171"));
  return [...clip(box, inner), ...ax.drawn];
}

// --- the spectrum ---------------------------------------------------------------------------------

function drawSpectrum(shown) {
  const { spectrum } = shown, box = BOX.spectrum;
  if (!spectrum) return missing(box, "spectrum of the shadow");
  if (spectrum.words) return missing(box, spectrum.words);
  const n = spectrum.Omega.length, step = spectrum.Omega[1] - spectrum.Omega[0];
  const end = spectrum.Omega[n - 1] + 0.5 * step, w = box.w / n, inner = [];
  const ax = axes(box, [-end, end], [-end, end], ["Ωx on the receiver (cycles/m)", "Ωy on the lamp’s line (cycles/m)"], { title: "spectrum of the lamp’s shadow" });
  spectrum.cells.forEach((row, i) => row.forEach((v, j) => inner.push(rect(box.x + i * w, box.y + box.h - (j + 1) * w, w + 0.35, w + 0.35, shade(v)))));
  for (const slope of spectrum.slopes || []) {
    const x = slope > 1 ? end / slope : end, y = slope > 1 ? end : end * slope;
    inner.push(line([[ax.x(-x), ax.y(-y)], [ax.x(x), ax.y(y)]], "#ffffff", 1.3, [5, 4]));
  }
  if (spectrum.slopes) {
    const [near, far] = spectrum.depths, share = (100 * spectrum.outside).toFixed(1);
    inner.push(text(box.x + 6, box.y + 14, `${share} % outside`, { fill: "#ffffff", size: 10 }));
    inner.push(text(box.x + 6, box.y + box.h - 7, `depths ${near.toFixed(2)} to ${far.toFixed(2)} m`, { fill: "#ffffff", size: 10 }));
  }
  return [...clip(box, inner), ...ax.drawn];
}

// --- the path -------------------------------------------------------------------------------------

/** Points of the ellipse u' C^-1 u = 1. */
export function ellipse(C, count = 48) {
  const a = Math.sqrt(C[0][0]), b = C[0][1] / a, c = Math.sqrt(Math.max(C[1][1] - b * b, 0));
  return Array.from({ length: count + 1 }, (_, k) => {
    const t = (2 * Math.PI * k) / count;
    return [a * Math.cos(t), b * Math.cos(t) + c * Math.sin(t)];
  });
}

function drawPath(shown) {
  const { path } = shown, box = BOX.path;
  if (!path) return missing(box, "portraits along the path");
  if (path.words) return missing(box, path.words);
  const n = path.steps.length, w = box.w / n, gap = 44, h = (box.h - gap) / 2, drawn = [];
  [["light", "L: x (m)", "angle (rad)", RED], ["spectrum", "spectrum: Ωx (cycles/m)", "Ωθ (cycles/rad)", BLUE]].forEach(([key, across, up, colour], row) => {
    const y = box.y + row * (h + gap), reach = (k) => 1.15 * Math.max(...path.steps.map((s) => Math.sqrt(s[key][k][k])));
    const [X, Y] = [reach(0), reach(1)];
    path.steps.forEach((step, k) => {
      const one = { x: box.x + k * w + 2, y, w: w - 4, h }, [cx, cy] = [one.x + 0.5 * one.w, y + 0.5 * h];
      drawn.push(rect(one.x, y, one.w, h, "#f3f4f6"));
      drawn.push(line([[one.x, cy], [one.x + one.w, cy]], "#d1d5db"), line([[cx, y], [cx, y + h]], "#d1d5db"));
      const points = ellipse(step[key]).map((u) => [cx + (0.5 * one.w * u[0]) / X, cy - (0.5 * h * u[1]) / Y]);
      drawn.push(area(points, key === "light" ? "rgba(185,28,28,0.15)" : "rgba(29,78,216,0.15)", colour));
      if (!row) drawn.push(text(cx, y + h + 12 + (n > 4 ? 11 * (k % 2) : 0), step.title, { align: "center", size: 9.5 }));
    });
    drawn.push(text(box.x + 0.5 * box.w, y + h + (row ? 14 : 36), `${across}, boxes ±${X.toPrecision(2)}`, { align: "center", size: 10 }));
    drawn.push(text(box.x - 8, y + 0.5 * h, `${up}, ±${Y.toPrecision(2)}`, { align: "center", turn: -90, size: 10 }));
  });
  const bend = path.kappa === null ? "" : `, mirror ${path.kappa.toPrecision(2)} rad/m at ${path.incidence.toPrecision(2)} rad`;
  drawn.push(text(box.x, box.y - 8, `path of the dashed ray${bend}`, { size: 12 }));
  return drawn;
}

/** Everything on the page, as drawing commands. */
export function commands(shown, ui = { selected: null }) {
  return [
    rect(0, 0, SIZE.width, SIZE.height, "#ffffff"),
    ...drawScene(shown, ui), ...drawCurves(shown), ...drawField(shown), ...drawSpectrum(shown), ...drawPath(shown),
  ];
}

// --- a canvas, a file -----------------------------------------------------------------------------

/** Draws commands on a canvas. */
export function paint(ctx, list) {
  const trace = (points) => { ctx.beginPath(); points.forEach(([x, y], k) => (k ? ctx.lineTo(x, y) : ctx.moveTo(x, y))); };
  for (const c of list) {
    if (c.op === "rect") { ctx.fillStyle = c.fill; ctx.fillRect(c.x, c.y, c.w, c.h); }
    else if (c.op === "clip") { ctx.save(); ctx.beginPath(); ctx.rect(c.x, c.y, c.w, c.h); ctx.clip(); }
    else if (c.op === "unclip") ctx.restore();
    else if (c.op === "line") { trace(c.points); ctx.setLineDash(c.dash); ctx.strokeStyle = c.stroke; ctx.lineWidth = c.width; ctx.stroke(); ctx.setLineDash([]); }
    else if (c.op === "area" || c.op === "dot") {
      if (c.op === "area") { trace(c.points); ctx.closePath(); } else { ctx.beginPath(); ctx.arc(c.x, c.y, c.r, 0, 2 * Math.PI); }
      ctx.fillStyle = c.fill; ctx.fill();
      if (c.stroke) { ctx.strokeStyle = c.stroke; ctx.lineWidth = 1.2; ctx.stroke(); }
    } else if (c.op === "text") {
      ctx.save(); ctx.translate(c.x, c.y); ctx.rotate((c.turn * Math.PI) / 180);
      ctx.font = `${c.size}px system-ui, sans-serif`; ctx.fillStyle = c.fill; ctx.textAlign = c.align; ctx.fillText(c.words, 0, 0); ctx.restore();
    }
  }
}

/** The same as the text of an SVG file. */
export function svg(list, { width, height } = SIZE) {
  const safe = (s) => String(s).replace(/[&<>"]/g, (c) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" })[c]);
  const f = (v) => Number(v.toFixed(2)), join = (points) => points.map((p) => p.map(f).join(",")).join(" ");
  const anchor = { left: "start", center: "middle", right: "end" };
  let count = 0;
  const one = (c) => {
    if (c.op === "rect") return `<rect x="${f(c.x)}" y="${f(c.y)}" width="${f(Math.max(c.w, 0))}" height="${f(Math.max(c.h, 0))}" fill="${c.fill}"/>`;
    if (c.op === "clip") { count += 1; return `<clipPath id="c${count}"><rect x="${c.x}" y="${c.y}" width="${c.w}" height="${c.h}"/></clipPath><g clip-path="url(#c${count})">`; }
    if (c.op === "unclip") return "</g>";
    if (c.op === "line") return `<polyline points="${join(c.points)}" fill="none" stroke="${c.stroke}" stroke-width="${c.width}"${c.dash.length ? ` stroke-dasharray="${c.dash.join(" ")}"` : ""}/>`;
    if (c.op === "area") return `<polygon points="${join(c.points)}" fill="${c.fill}"${c.stroke ? ` stroke="${c.stroke}"` : ""}/>`;
    if (c.op === "dot") return `<circle cx="${f(c.x)}" cy="${f(c.y)}" r="${c.r}" fill="${c.fill}"${c.stroke ? ` stroke="${c.stroke}"` : ""}/>`;
    const turn = c.turn ? ` transform="rotate(${c.turn} ${f(c.x)} ${f(c.y)})"` : "";
    return `<text x="${f(c.x)}" y="${f(c.y)}" font-size="${c.size}" font-family="sans-serif" fill="${c.fill}" text-anchor="${anchor[c.align]}"${turn}>${safe(c.words)}</text>`;
  };
  return `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 ${width} ${height}" width="${width}" height="${height}">${list.map(one).join("\n")}</svg>`;
}
