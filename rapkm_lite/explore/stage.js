// A picture of recorded marks on canvases, and handles to take it by.  One module, nothing to build, no dependency.
//
// mount(el, scene, link) shows a picture in `el`.  scene = {panels, layout, widths, size, name, about, labels};
// link = {send(message), receive(callback(message, buffers))} reaches whoever computes, a kernel or a script.
//   to it:   {kind: "hello"} | {kind: "grab", from, seq, to: {control: value}, by: {control: steps}}
//   from it: {kind: "fixed" | "picture", from?, seq?, marks, styles, images, frames, handles, numbers, places, ...}
//            {kind: "lost", from, seq}: a question that has no answer
// A mark is [kind, panel, style, points, words?]: style a number in `styles` or an object, points how many pairs of the
// first buffer, or an array of numbers.  Lengths in styles are points (1/72 inch), colours "#rrggbb" for white paper.

const POINT = 96 / 72;
const PATIENCE = 5000; // ms after which an answer counts as lost
const AFLOAT = 2; // questions under way at the same time: three are no faster and lag more
const NARROW = 600; // CSS pixels below which panels are stacked

/** True minus signs before numbers, not in words with a hyphen. */
export const minus = (words) => String(words).replace(/(^|[\s(/])-(?=\d)/g, "$1−");

/** "σ_min" and "10^−3" as pieces {text, shift}: shift -1 is a subscript, 1 a superscript. */
export function pieces(words) {
  return String(words).split(/([_^][\p{L}\p{N}−]+)/u).filter(Boolean).map((part) => {
    const shift = part.length > 1 ? ({ _: -1, "^": 1 }[part[0]] ?? 0) : 0;
    return { text: shift ? part.slice(1) : part, shift };
  });
}

/** Words in lines at most `room` wide, as far as single words allow. */
export function wrap(words, room, width) {
  const lines = [];
  for (const word of String(words ?? "").split(" ")) {
    const longer = `${lines.at(-1)} ${word}`;
    if (lines.length && width(longer) <= room) lines[lines.length - 1] = longer;
    else if (word) lines.push(word);
  }
  return lines;
}

/** About `most` ticks {at, words} between two limits, in steps of 1, 2, 2.5, 5; decades on a logarithmic axis. */
export function ticks(low, high, most = 6, log = false) {
  if (!(high > low) || !Number.isFinite(high - low) || (log && low <= 0)) return [];
  const [start, end] = log ? [Math.log10(low), Math.log10(high)] : [low, high];
  const least = Math.max((end - start) / Math.max(most, 1), log ? 1 : 0), decade = 10 ** Math.floor(Math.log10(least));
  const step = log ? Math.ceil(least) : [1, 2, 2.5, 5, 10].find((s) => s * decade >= least * (1 - 1e-9)) * decade;
  const digits = step.toFixed(12).replace(/0+$/, "").split(".")[1].length, out = [];
  for (let k = Math.ceil(start / step - 1e-9); k <= Math.floor(end / step + 1e-9); k++) {
    const words = minus((k * step || 0).toFixed(digits));
    out.push(log ? { at: 10 ** (k * step), words: `10^${words}` } : { at: k * step, words });
  }
  return out;
}

const remade = (object, change) => Object.fromEntries(Object.entries(object).map(([name, v]) => [name, change(v)]));

/** Marks and handles of a message; `known` = {styles, images} keeps what is sent only once. */
export function decode(message, buffers, known) {
  Object.assign(known.styles, message.styles);
  const floats = buffers.map((b) => new Float32Array(b.buffer?.slice(b.byteOffset, b.byteOffset + b.byteLength) ?? b));
  Object.entries(message.images ?? {}).forEach(([key, [rows, columns, ...extent]], k) => {
    known.images[key] = { rows, columns, extent, values: floats[k + 1] };
  });
  let at = 0;
  const take = (count) => floats[0].subarray(at, (at += count));
  const style = (s) => (typeof s === "object" ? s : known.styles[s]) ?? {};
  const marks = message.marks.map(([kind, panel, s, count, words]) => {
    const points = Array.isArray(count) ? Float32Array.from(count) : count ? take(2 * count) : [];
    if (kind === "legend") words = words.map(([text, entry]) => [text, style(entry)]);
    return { kind, panel, style: style(s), points, words, images: known.images };
  });
  const handles = (message.handles ?? []).map((handle) => {
    const track = handle.along && take(2 * handle.along);
    return track ? { ...handle, track, set: remade(handle.set, () => take(handle.along)) } : handle;
  });
  return { marks, handles };
}

/** The function from data to pixels of a box. */
function placing(spec, [x0, x1, y0, y1], box) {
  const up = spec.yscale === "log" ? (y) => Math.log(y / y0) / Math.log(y1 / y0) : (y) => (y - y0) / (y1 - y0);
  return (x, y) => [box.left + (box.width * (x - x0)) / (x1 - x0), box.top + box.height * (1 - up(y))];
}

/**
 * Everything around the marks: {box, texts, rules, keys}; width(words, size) measures, margins are at least `least`.
 * Room is made for every word before the box gets the rest, so that nothing is cut and nothing lies on anything.
 */
export function layout({ spec, title, bold = true, legend = [], scale }, frame, [wide, high], font, width, least = {}) {
  const line = 1.3 * font, small = 0.92 * font;
  const fixed = (values) => Array.from(values ?? [], (v) => ({ at: v, words: minus(v) }));
  const widest = (list) => Math.max(0, ...list.map((t) => width(t.words, small)));
  const lines = (words, room) => wrap(words, room, (w) => 1.05 * width(w, font));
  const titles = lines(title ?? spec.title, wide), rows = [];
  for (const [words, style] of legend) {
    const room = 2.9 * font + width(words, small);
    if (!rows.length || rows.at(-1).room + room > wide) rows.push({ room: 0, entries: [] });
    rows.at(-1).entries.push({ words, style, at: rows.at(-1).room });
    rows.at(-1).room += room;
  }
  // A short title and a short legend share a line.
  const together = titles.length === 1 && rows.length === 1 && 1.1 * width(titles[0], font) + rows[0].room < wide;
  const above = together ? 1 : titles.length + rows.length;
  const top = Math.max(least.top ?? 0, above ? (above + 0.35) * line : 0.6 * line);
  const xlabel = lines(spec.xlabel, wide), bottom = (spec.xticks?.length === 0 ? 0.2 : 1.3 + xlabel.length) * line;
  const tall = Math.max(high - top - bottom, 10), ylabel = lines(spec.ylabel, tall);
  const most = Math.min(Math.max(Math.floor(tall / (2.1 * font)), 2), 7);
  const y = spec.yticks ? fixed(spec.yticks) : ticks(frame[2], frame[3], most, spec.yscale === "log");
  const left = Math.max(least.left ?? 0, ylabel.length * line + widest(y) + 0.5 * font);
  const levels = fixed(scale?.[0].levels), label = lines(scale?.[1], tall);
  const room = scale ? 2.3 * font + widest(levels) + label.length * line : 1.1 * font;
  const box = { left, top, width: Math.max(wide - left - room, 10), height: tall };
  if (spec.aspect === "equal") {
    const over = frame[1] - frame[0], up = frame[3] - frame[2], per = Math.min(box.width / over, box.height / up);
    Object.assign(box, { left: left + (box.width - per * over) / 2, width: per * over, height: per * up });
  }
  let x = fixed(spec.xticks);
  for (let count = 8; !spec.xticks && count && !x.length; count--) {
    const list = ticks(frame[0], frame[1], count);
    if (list.length * (widest(list) + 0.6 * font) < box.width) x = list;
  }
  const right = box.left + box.width, foot = box.top + box.height, at = placing(spec, frame, box);
  const texts = [], rules = [], keys = [];
  const put = (words, x, y, look) => texts.push({ words, x, y, size: font, ha: "center", va: "top", ...look });
  for (const t of x) {
    const [px] = at(t.at, frame[2]);
    rules.push(["faint", [px, box.top, px, foot]]);
    put(t.words, px, foot + 0.3 * font, { size: small });
  }
  for (const t of y) {
    const py = at(frame[0], t.at)[1];
    rules.push(["faint", [box.left, py, right, py]]);
    put(t.words, box.left - 0.4 * font, py, { size: small, ha: "right", va: "center" });
  }
  if (x.length) rules.push(["axis", [box.left, box.top, box.left, foot, right, foot]]);
  xlabel.forEach((w, k) => {
    const half = width(w, font) / 2, middle = Math.max(Math.min((box.left + right) / 2, wide - half), half);
    put(w, middle, foot + (k + 1.15) * line);
  });
  const upright = (words, x) =>
    words.forEach((w, k) => put(w, x + (k + 0.8) * line, (box.top + foot) / 2, { upright: true, va: "baseline" }));
  upright(ylabel, Math.max(0, box.left - 0.5 * font - widest(y) - ylabel.length * line));
  const rise = box.top - 0.45 * line, beside = together ? 1.1 * width(titles[0], font) : 0;
  const edge = (room) => Math.max(room, Math.min(wide, Math.max(right, box.left + beside + room)));
  titles.forEach((w, k) => {
    const up = titles.length - 1 - k + (together ? 0 : rows.length);
    const free = together ? edge(rows[0].room) - rows[0].room : wide;
    const x = Math.max(0, Math.min(box.left, free - 1.1 * width(w, font)));
    put(w, x, rise - up * line, { bold, ha: "left", va: "baseline", title: true });
  });
  rows.forEach(({ entries, room }, k) => entries.forEach(({ words, style, at }) => {
    const x = edge(room) - room + at, y = rise - (rows.length - 1 - k) * line;
    keys.push([style, [x, y - 0.3 * small, x + 1.8 * font, y - 0.3 * small]]);
    put(words, x + 2.2 * font, y, { size: small, ha: "left", va: "baseline" });
  }));
  const step = box.height / Math.max(levels.length - 1, 1), bar = right + 0.8 * font;
  levels.forEach((level, k) => {
    const va = k === 0 ? "bottom" : k < levels.length - 1 ? "center" : "top";
    put(level.words, bar + 1.2 * font, foot - k * step, { size: small, ha: "left", va });
  });
  upright(label, wide - (label.length + 0.1) * line);
  return { box, at, texts, rules, keys, bar: [bar, foot, 0.9 * font, step], left, top };
}

const rgb = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16));
const css = (c) => `rgb(${c.join()})`;
const mix = (a, b, share) => a.map((v, k) => Math.round(v + share * (b[k] - v)));
const shine = (c) => [0.2126, 0.7152, 0.0722].reduce((sum, w, k) => sum + w * ((c[k] / 255 + 0.055) / 1.055) ** 2.4, 0);
const contrast = (a, b) => (Math.max(shine(a), shine(b)) + 0.05) / (Math.min(shine(a), shine(b)) + 0.05);

/** What surrounds an element: the colours of paper and ink, and how a colour meant for white paper looks on it. */
export function themeOf(el) {
  let paper = [0, 0, 0, 0];
  for (let e = el; e && paper[3] < 0.5; e = e.parentElement)
    paper = [...(getComputedStyle(e).backgroundColor.match(/[\d.]+/g) ?? [0, 0, 0, 0]).map(Number), 1].slice(0, 4);
  paper = paper[3] < 0.5 ? [255, 255, 255] : paper.slice(0, 3);
  const dark = shine(paper) < 0.3, ink = dark ? [235, 235, 235] : [34, 34, 34];
  const colour = (hex, fill = false) => {
    if (!hex || !dark) return hex;
    let c = rgb(hex);
    if (shine(c) > 0.95 || shine(c) < 0.02) return css(shine(c) > 0.95 ? paper : ink);
    if (fill && shine(c) > 0.6) return css(mix(paper, c, 0.16));
    while (contrast(c, paper) < (fill ? 3 : 4.5)) c = mix(c, [255, 255, 255], 0.15);
    return css(c);
  };
  const tone = (share) => css(mix(paper, ink, share));
  return { dark, colour, paper: tone(0), faint: tone(0.13), axis: tone(0.6), ink: tone(1) };
}

const SHARE = { left: 0, center: 0.5, right: 1 };
const DROP = { baseline: 0, bottom: -0.25, center: 0.36, top: 0.85 };

class Panel {
  constructor(name, spec, parent) {
    Object.assign(this, { name, spec, least: {}, map: {} });
    this.el = make("div", { className: `rapkm-panel ${spec.small ? "small" : ""} ${spec.aspect ?? ""}` }, parent);
    this.el.style.gridArea = name;
    const ariaLabel = [spec.title, spec.ylabel, spec.xlabel].filter(Boolean).join(", ") || name;
    this.canvas = make("canvas", { role: "img", ariaLabel }, this.el);
    this.ctx = this.canvas.getContext("2d");
  }

  /** The point of a pixel. */
  data(x, y) {
    const { box, frame } = this, over = (x - box.left) / box.width, up = (box.top + box.height - y) / box.height;
    return [frame[0] + over * (frame[1] - frame[0]), frame[2] + up * (frame[3] - frame[2])];
  }

  /** Call paint(text, left, up) for each piece of words in its font; returns the width. */
  pieces(words, size, bold, paint = () => {}) {
    let left = 0;
    for (const { text, shift } of pieces(words)) {
      this.ctx.font = `${bold ? "bold " : ""}${shift ? 0.72 * size : size}px ${this.look.family}`;
      paint(text, left, 0.3 * shift * size);
      left += this.ctx.measureText(text).width;
    }
    return left;
  }

  /** Words at a pixel, with true subscripts. */
  write({ words, x, y, size, colour, bold = false, ha = "left", va = "baseline", halo = null, upright = false }) {
    const { ctx } = this;
    ctx.save();
    ctx.translate(x, y);
    ctx.rotate(upright ? -Math.PI / 2 : 0);
    Object.assign(ctx, { strokeStyle: halo, fillStyle: colour, lineWidth: 3, lineJoin: "round" });
    const left = -this.pieces(words, size, bold) * SHARE[ha];
    for (const way of halo ? ["strokeText", "fillText"] : ["fillText"])
      this.pieces(words, size, bold, (text, at, up) => ctx[way](text, left + at, size * DROP[va] - up));
    ctx.restore();
  }

  /** Paint marks; `look` = {theme, base, floor, family} says how. */
  paint(look, frame, marks) {
    const { ctx, canvas, el: { clientWidth: wide, clientHeight: high } } = this, { theme } = look;
    if (!wide || !high || !frame) return;
    const ratio = window.devicePixelRatio || 1, width = Math.round(wide * ratio), height = Math.round(high * ratio);
    // Setting a size blanks a canvas, so only when it is another one.
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    Object.assign(this, { frame, look, theme, ratio, taken: [] });
    this.size = (points) => Math.max((points / 10.5) * look.base, look.floor);
    const last = (kind) => marks.findLast((mark) => mark.kind === kind);
    const heading = last("title"), legend = last("legend")?.words, scale = last("scale")?.words;
    const parts = { spec: this.spec, title: heading?.words, bold: heading?.style.bold, legend, scale };
    // Margins only grow, so that nothing moves while a control does.
    const key = [wide, high, look.base].join();
    if (this.least.key !== key) this.least = { key };
    const plan = layout(parts, frame, [wide, high], this.size(10.5), (w, size) => this.pieces(w, size), this.least);
    Object.assign(this.least, { left: plan.left, top: plan.top });
    Object.assign(this, { box: plan.box, at: plan.at });
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    ctx.clearRect(0, 0, wide, high);
    for (const [tone, points] of plan.rules) stroke(this, points, { color: theme[tone], width: 0.75 });
    for (const [style, points] of plan.keys) {
      ctx.globalAlpha = style.alpha ?? 1;
      stroke(this, points, style);
    }
    ctx.globalAlpha = 1;
    const shade = theme.colour(heading?.style.color) ?? theme.ink;
    for (const text of plan.texts) this.write({ ...text, colour: text.title ? shade : theme.ink });
    const [x, y, w, h] = plan.bar;
    (scale?.[0][theme.dark ? "dark" : "light"] ?? []).forEach((colour, k) => {
      ctx.fillStyle = colour;
      ctx.fillRect(x, y - (k + 1) * h, w, h + 0.5);
    });
    for (const mark of marks.filter((m) => PAINT[m.kind]).sort((a, b) => a.style.z - b.style.z)) {
      ctx.save();
      ctx.globalAlpha = mark.style.alpha ?? 1;
      PAINT[mark.kind](this, mark, mark.style);
      ctx.restore();
    }
  }
}

/** A path through pixels x0, y0, x1, y1, ...; numbers that are not finite lift the pen. */
function trace(ctx, points, closed = false) {
  let down = false;
  ctx.beginPath();
  for (let k = 0; k < points.length; k += 2) {
    const seen = Number.isFinite(points[k] + points[k + 1]);
    if (seen) ctx[down ? "lineTo" : "moveTo"](points[k], points[k + 1]);
    else if (closed && down) ctx.closePath();
    down = seen;
  }
  if (closed && down) ctx.closePath();
}

function stroke({ ctx, theme }, points, { width, color, cap = "butt", dash = [] }, closed = false) {
  const lineWidth = width * POINT;
  if (!(lineWidth > 0) || !color) return;
  const strokeStyle = color[0] === "#" ? theme.colour(color) : color;
  Object.assign(ctx, { lineWidth, strokeStyle, lineCap: cap, lineJoin: "round" });
  ctx.setLineDash(dash.map((d) => d * lineWidth));
  trace(ctx, points, closed);
  ctx.stroke();
  ctx.setLineDash([]);
}

const pixels = (panel, points) => Float64Array.from(points, (v, k) => panel.at(points[k & ~1], points[k | 1])[k & 1]);

function clip({ ctx, box }, margin = 0) {
  ctx.beginPath();
  ctx.rect(box.left - margin, box.top - margin, box.width + 2 * margin, box.height + 2 * margin);
  ctx.clip();
}

const SHAPES = {
  s: [-1, -1, 1, -1, 1, 1, -1, 1], D: [-1.3, 0, 0, -1.3, 1.3, 0, 0, 1.3],
  x: [-1, -1, 1, 1, NaN, NaN, -1, 1, 1, -1], "+": [-1, 0, 1, 0, NaN, NaN, 0, -1, 0, 1],
};

function line(panel, { points }, style) {
  const { ctx, theme } = panel, path = pixels(panel, points), r = (style.size * POINT) / 2;
  clip(panel, style.marker ? 8 : 0);
  stroke(panel, path, style);
  for (let k = 0; style.marker && k < path.length; k += 2) {
    const open = "x+".includes(style.marker);
    trace(ctx, (SHAPES[style.marker] ?? []).map((v, j) => path[k + (j % 2)] + r * v), !open);
    if (style.marker === "o") ctx.arc(path[k], path[k + 1], r, 0, 2 * Math.PI);
    ctx.fillStyle = theme.colour(style.face, true);
    if (!open) ctx.fill();
    Object.assign(ctx, { strokeStyle: theme.colour(style.color), lineWidth: style.edge * POINT });
    ctx.stroke();
  }
}

function polygon(panel, { points }, style) {
  const { ctx, theme } = panel, path = pixels(panel, points);
  clip(panel);
  trace(ctx, path, true);
  ctx.fillStyle = theme.colour(style.face, true) ?? "transparent";
  ctx.fill("evenodd");
  stroke(panel, path, style, true);
}

function words(panel, { kind, points, words }, style) {
  const { box, theme } = panel, right = box.left + box.width, foot = box.top + box.height;
  const inside = () => [box.left + points[0] * box.width, foot - points[1] * box.height];
  const [x, y] = kind === "words" ? inside() : panel.at(...points);
  if (x < box.left - 1 || x > right + 1 || y < box.top - 1 || y > foot + 1) return;
  const size = panel.size(style.size), wide = panel.pieces(words, size, style.bold), left = x - wide * SHARE[style.ha];
  // Words that would cover others step aside, away from what they name.
  const near = ([a, b, c, s], up) => left < c && left + wide > a && Math.abs(y + up - b) < 0.6 * (s + size);
  const way = (style.va === "top" ? 0.5 : -0.5) * size;
  let up = 0;
  while (Math.abs(up) < 3 * size && panel.taken.some((t) => near(t, up))) up += way;
  panel.taken.push([left, y + up, left + wide, size]);
  const halo = style.color === "#ffffff" ? null : theme.paper;
  panel.write({ ...style, words, x, y: y + up, size, colour: theme.colour(style.color), halo });
}

/** A map in classes: bilinear between its samples, decided anew at every pixel of the screen. */
function image(panel, { points, words: [key, palette], images }) {
  const { rows, columns, extent, values } = images[key], { ctx, ratio, theme } = panel;
  const [left, top] = panel.at(extent[0], extent[3]).map((v) => Math.floor(v * ratio));
  const [width, height] = panel.at(extent[1], extent[2]).map((v, k) => Math.ceil(v * ratio) - [left, top][k]);
  const now = [key, width, height, theme.dark].join();
  if (panel.map.key !== now) {
    const canvas = make("canvas", { width, height }), picture = ctx.createImageData(width, height);
    const out = new Uint32Array(picture.data.buffer), bounds = palette.levels;
    const pack = ([r, g, b]) => (0xff000000 | (b << 16) | (g << 8) | r) >>> 0;
    const packed = palette[theme.dark ? "dark" : "light"].map((c) => pack(rgb(c)));
    const place = (k, n, count) => Math.min(Math.max(((k + 0.5) / n) * count - 0.5, 0), count - 1.000001);
    for (let j = 0, level = 0; j < height; j++) {
      const v = place(height - 1 - j, height, rows);
      for (let i = 0; i < width; i++) {
        const u = place(i, width, columns), a = u % 1;
        const at = Math.floor(v) * columns + Math.floor(u), over = at + columns;
        const low = values[at] + a * (values[at + 1] - values[at]);
        const value = low + (v % 1) * (values[over] + a * (values[over + 1] - values[over]) - low);
        while (level < packed.length - 1 && value >= bounds[level + 1]) level++;
        while (level > 0 && value < bounds[level]) level--;
        if (!Number.isNaN(value)) out[j * width + i] = packed[level];
      }
    }
    canvas.getContext("2d").putImageData(picture, 0, 0);
    panel.map = { key: now, canvas };
  }
  clip(panel);
  trace(ctx, pixels(panel, points), true);
  if (points.length) ctx.clip("evenodd");
  ctx.drawImage(panel.map.canvas, left / ratio, top / ratio, width / ratio, height / ratio);
}

const PAINT = { line, polygon, bar: polygon, label: words, words, image };

/** The distance of (x, y) from a path x0, y0, x1, y1, ... and where along it the nearest point is, in corners. */
function nearest(path, x, y) {
  let best = { gap: Infinity, place: 0 };
  for (let k = 0; k + 3 < path.length; k += 2) {
    const ax = path[k], ay = path[k + 1], dx = path[k + 2] - ax, dy = path[k + 3] - ay;
    const share = Math.min(Math.max(((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy || 1), 0), 1);
    const gap = Math.hypot(x - ax - share * dx, y - ay - share * dy);
    if (gap < best.gap) best = { gap, place: k / 2 + share };
  }
  return best;
}

/** What the controls of a handle must be for it to stand at (x, y). */
export function wish({ track, set }, x, y) {
  if (!track) return remade(set, ([a, b, c]) => a * x + (b && b * y) + c);
  const { place } = nearest(track, x, y), k = Math.min(Math.floor(place), track.length / 2 - 2);
  return remade(set, (v) => v[k] + (place - k) * (v[k + 1] - v[k]));
}

/** Steps of its controls for an arrow key, ten with shift; null for another key. */
export function steps({ track, set, at }, key, shift) {
  const [dx, dy] = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[key] ?? [];
  if (dx === undefined) return null;
  const count = (v) => (track || at[1] === null ? dx + dy : Math.sign(v[0]) * dx + Math.sign(v[1]) * dy);
  return Object.fromEntries(Object.entries(remade(set, (v) => (shift ? 10 : 1) * count(v))).filter(([, n]) => n));
}

function make(tag, properties = {}, parent = null) {
  const el = Object.assign(document.createElement(tag), properties);
  return parent ? parent.appendChild(el) : el;
}

/** Put words into an element, with true subscripts. */
function rich(el, words) {
  el.replaceChildren(...pieces(words).map(({ text, shift }) => (shift ? make("sub", { textContent: text }) : text)));
  return el;
}

/** Show a picture in `el`; returns a function that takes it away, with `say(words)` for a note below the picture. */
export function mount(el, scene, link) {
  const me = Math.random().toString(36).slice(2);
  const root = make("div", { className: "rapkm", role: "group", ariaLabel: scene.about || scene.name }, el);
  const stage = make("div", { className: "rapkm-panels" }, root);
  const problem = make("p", { className: "rapkm-problem", hidden: true }, stage);
  const numbers = make("p", { className: "rapkm-numbers" }, root), foot = make("p", { className: "rapkm-foot" }, root);
  const copy = make("button", { type: "button", textContent: "copy this setting", hidden: scene.code === false }, foot);
  const note = make("span", { className: "rapkm-note", role: "status" }, foot);
  const sentence = make("p", { className: "rapkm-sentence", ariaLive: "polite" }, root);
  const say = (text) => (note.textContent = text);
  stage.style.setProperty("--areas", scene.layout.map((row) => `"${row.join(" ")}"`).join(" "));
  stage.style.setProperty("--columns", scene.widths.map((w) => `minmax(0, ${w}fr)`).join(" "));
  stage.style.setProperty("--shape", scene.size.join(" / "));
  const panels = Object.entries(scene.panels).map(([name, spec]) => new Panel(name, spec, stage));
  const known = { styles: {}, images: {} }, knobs = [], open = new Set();
  const state = { fixed: [], marks: [], handles: [], frames: null, places: {}, drawn: 0 };
  let theme = null, held = null, rest = 0, seq = 0, waiting = { to: {}, by: {} };

  function paint() {
    if (!state.frames || !root.clientWidth) return;
    theme ??= themeOf(root);
    root.classList.toggle("narrow", root.clientWidth < NARROW);
    const style = getComputedStyle(root), floor = parseFloat(style.getPropertyValue("--least")) || 12;
    const look = { theme, floor, base: parseFloat(style.fontSize), family: style.fontFamily };
    const marks = [...state.fixed, ...state.marks];
    for (const p of panels) p.paint(look, state.frames[p.name], marks.filter((m) => m.panel === p.name));
    state.handles.forEach(knob);
    knobs.slice(state.handles.length).forEach((knob) => (knob.hidden = true));
  }

  // One focusable knob for each handle.
  function knob(handle, k) {
    const panel = panels.find((p) => p.name === handle.panel), bare = handle.at[1] === null;
    if (!panel.box) return;
    const knob = (knobs[k] ??= make("div", { tabIndex: 0, role: "slider" })), names = Object.keys(handle.set);
    const [x, y] = panel.at(handle.at[0], bare ? panel.frame[2] : handle.at[1]);
    const label = (name) => scene.labels?.[name] ?? name, told = (name) => `${label(name)}: ${state.places[name]}`;
    if (knob.parentElement !== panel.el) panel.el.append(knob);
    const ariaLabel = `${names.map(label).join(" and ")}, in the picture`, ariaValueText = names.map(told).join(", ");
    const className = bare ? "rapkm-knob bare" : "rapkm-knob", ariaValueNow = state.places[names[0]];
    Object.assign(knob, { className, ariaLabel, ariaValueNow, ariaValueText, hidden: false });
    // JupyterLab takes arrow keys from whatever has the focus without this word.
    knob.dataset.lmSuppressShortcuts = "true";
    knob.style.translate = `${x}px ${y}px`;
    knob.onkeydown = (event) => {
      const by = steps(handle, event.key, event.shiftKey);
      if (!by) return;
      event.preventDefault();
      event.stopPropagation();
      ask({}, by);
    };
  }

  // What the hand wishes waits until fewer than AFLOAT answers are due; the last value wins, steps add up.
  function ask(to, by = {}) {
    Object.assign(waiting.to, to);
    for (const [name, n] of Object.entries(by)) waiting.by[name] = (waiting.by[name] ?? 0) + n;
    pump();
  }
  function pump(late) {
    if (open.delete(late)) say("No answer: run the cell again.");
    if (open.size >= AFLOAT || !Object.keys({ ...waiting.to, ...waiting.by }).length) return;
    const message = { kind: "grab", from: me, seq: ++seq, ...waiting };
    waiting = { to: {}, by: {} };
    open.add(seq);
    setTimeout(pump, PATIENCE, seq);
    // A page without a kernel answers before this returns.
    link.send(message);
  }

  function receive(message, buffers = []) {
    if (message.from === me) open.delete(message.seq);
    const { marks, handles } = message.marks ? decode(message, buffers, known) : {};
    state.frames = message.frames ?? state.frames;
    if (message.kind === "fixed") state.fixed = marks;
    if (message.kind === "picture") show(message, marks, handles);
    pump();
  }
  function show(message, marks, handles) {
    Object.assign(state, { marks, places: message.places ?? {}, code: message.code ?? "" });
    // While there is a problem the last handles stay, as the way back.
    if (handles.length || !message.problem) state.handles = handles;
    Object.assign(problem, { textContent: message.problem ?? "", hidden: !message.problem });
    numbers.replaceChildren(...(message.numbers ?? []).map(([name, text]) => {
      const span = rich(make("span"), `${name}: `);
      rich(make("b", {}, span), minus(text));
      return span;
    }));
    if (message.note || message.from) say(message.note ?? "");
    root.classList.add("live");
    paint();
    Object.assign(root.dataset, { drawn: ++state.drawn, places: JSON.stringify(state.places) });
    // Read out when the hand rests, not at every step.
    clearTimeout(rest);
    rest = setTimeout(() => {
      sentence.textContent = message.sentence ?? "";
      nameControls();
    }, 700);
  }

  // Taking hold of the nearest knob or line, else of a line that is pushed along the panel.
  function under(panel, { clientX, clientY, pointerType = "touch" }) {
    const area = panel.el.getBoundingClientRect(), x = clientX - area.left, y = clientY - area.top;
    let best = null;
    for (const handle of panel.box ? state.handles.filter((h) => h.panel === panel.name) : []) {
      const bare = handle.at[1] === null, [hx, hy] = bare ? [x, y] : panel.at(...handle.at);
      const grip = handle.grip ? nearest(handle.grip.flatMap((p) => panel.at(...p)), x, y).gap / 14 : Infinity;
      const gap = bare ? 0.99 : Math.min(Math.hypot(x - hx, y - hy) / 24, grip) / (pointerType === "mouse" ? 1 : 1.6);
      if (gap < (best?.gap ?? 1)) best = { panel, handle, gap, off: [hx - x, hy - y] };
    }
    return best;
  }
  function move({ clientX, clientY }) {
    const { panel, handle, off } = held, area = panel.el.getBoundingClientRect();
    ask(wish(handle, ...panel.data(clientX - area.left + off[0], clientY - area.top + off[1])));
  }
  for (const panel of panels) {
    panel.el.onpointerdown = (event) => {
      held = event.button === 0 ? under(panel, event) : null;
      if (!held) return;
      event.preventDefault();
      panel.el.setPointerCapture(event.pointerId);
      knobs[state.handles.indexOf(held.handle)].focus({ preventScroll: true });
      if (held.handle.at[1] === null) move(event);
    };
    panel.el.onpointermove = (event) => {
      if (held) move(event);
      panel.el.style.cursor = held ? "grabbing" : under(panel, event) ? "grab" : "";
    };
    panel.el.onlostpointercapture = () => (held = null);
    // A finger that takes hold does not scroll the page.
    const hold = (event) => under(panel, event.touches[0]) && event.preventDefault();
    panel.el.addEventListener("touchstart", hold, { passive: false });
  }

  copy.onclick = () => {
    say(state.code);
    navigator.clipboard?.writeText(state.code).catch(() => {});
  };

  // Sliders have no name for readers of the screen, and their labels no subscripts.
  function nameControls() {
    for (const control of el.closest(".rapkm-explorer")?.querySelectorAll(".rapkm-control") ?? []) {
      const label = control.querySelector(".widget-label");
      const words = (control.dataset.words ??= label?.textContent || control.textContent.trim());
      for (const part of control.querySelectorAll(".noUi-handle, .ui-slider-handle, .widget-readout, select, input")) {
        part.ariaLabel = words;
        part.dataset.lmSuppressShortcuts = "true";
      }
      if (label?.textContent.includes("_")) rich(label, words);
    }
  }

  // A number typed beside a slider may lie between two of its steps.
  function typed({ target, key = "Enter" }) {
    if (key !== "Enter" || !target.matches?.(".widget-readout")) return;
    if (!el.closest(".rapkm-explorer")?.contains(target)) return;
    const number = () => Number(target.textContent.replace("−", "-")), before = number();
    setTimeout(() => before === number() || say(`${before} was rounded to ${number()}`), 400);
  }

  // A new style sheet may come late, so colours are looked up again for a while.
  const again = () => (theme = null, paint());
  const watch = new MutationObserver(() => [0, 300, 1200].forEach((ms) => setTimeout(again, ms)));
  for (const node of [document.documentElement, document.body])
    watch.observe(node, { attributeFilter: ["class", "data-theme", "data-jp-theme-light", "data-jp-theme-name"] });
  const sizes = new ResizeObserver(paint), gone = new AbortController(), { signal } = gone;
  for (const node of [root, ...panels.map((panel) => panel.el)]) sizes.observe(node);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", again, { signal });
  window.addEventListener("resize", paint, { signal });
  document.addEventListener("keydown", page, { signal, capture: true });
  for (const name of ["blur", "keydown"]) document.addEventListener(name, typed, { signal, capture: true });
  link.receive(receive);
  link.send({ kind: "hello" });
  const leave = () => {
    gone.abort();
    watch.disconnect();
    root.remove();
  };
  return Object.assign(leave, { say });
}

/** Page up and page down turn the screens of a dashboard, also while a slider has the focus. */
function page(event) {
  const screens = [...document.querySelectorAll(".rapkm-screen")], way = { PageDown: 1, PageUp: -1 }[event.key];
  if (!way || !screens.length) return;
  event.preventDefault();
  // Each picture of the page listens; one of them is enough.
  event.stopImmediatePropagation();
  const now = screens.findLastIndex((screen) => screen.getBoundingClientRect().top < innerHeight / 2);
  screens[Math.min(Math.max(now + way, 0), screens.length - 1)].scrollIntoView({ block: "start" });
}

export default {
  render({ model, el }) {
    const receive = (callback) => model.on("msg:custom", (message, buffers) => callback(message, buffers));
    const leave = mount(el, model.get("scene"), { send: (message) => model.send(message), receive });
    model.on("comm_live_update", () => leave.say("The kernel has gone: run the cell again."));
    return leave;
  },
};
