// A picture of recorded marks on canvases, and handles to take it by.  One module, nothing to build, no dependency.
//
// mount(el, scene, link) shows a picture in `el`.  scene = {panels, layout, widths, size, name, about, labels};
// link = {send(message), receive(callback(message, buffers))} reaches whoever computes, a kernel or a script.
//   to it:   {kind: "hello"} | {kind: "grab", from, seq, to: {control: value}, by: {control: steps}}
//   from it: {kind: "fixed" | "picture", from?, seq?, marks, styles, images, frames, handles, numbers, places, ...}
//            {kind: "lost", from, seq}: a question that has no answer
// A mark is [kind, panel, style, points, words?]: style a number in `styles` or an object, points how many pairs of the
// first buffer, or an array of numbers.  Lengths in styles are points, 1/72 inch; colours are "#rrggbb" for white paper.

const POINT = 96 / 72;
const PATIENCE = 5000; // ms after which an answer counts as lost
const AFLOAT = 2; // questions under way at the same time: three are no faster and lag more
const NARROW = 600; // CSS pixels below which panels are stacked

// ------------------------------------------------------------------------------------------- words, numbers, messages

/** True minus signs before numbers, not in words with a hyphen. */
export const minus = (words) => String(words).replace(/(^|[\s(/])-(?=\d)/g, "$1−");

/** "σ_min" and "10^−3" as pieces {text, shift}: shift -1 is a subscript, 1 a superscript. */
export function pieces(words) {
  const parts = String(words).split(/([_^][\p{L}\p{N}−]+)/u);
  return parts.filter(Boolean).map((part) => {
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
  const least = Math.max((end - start) / Math.max(most, 1), log ? 1 : 0);
  const decade = 10 ** Math.floor(Math.log10(least));
  const step = log ? Math.ceil(least) : [1, 2, 2.5, 5, 10].find((s) => s * decade >= least * (1 - 1e-9)) * decade;
  let digits = 0;
  while (digits < 12 && Math.abs(step * 10 ** digits - Math.round(step * 10 ** digits)) > 1e-6) digits++;
  const out = [];
  for (let k = Math.ceil(start / step - 1e-9); k <= Math.floor(end / step + 1e-9); k++) {
    const words = minus((k * step || 0).toFixed(digits));
    out.push(log ? { at: 10 ** (k * step), words: `10^${words}` } : { at: k * step, words });
  }
  return out;
}

/** Marks and handles of a message; `known` = {styles, images} keeps what is sent only once. */
export function decode(message, buffers, known) {
  Object.assign(known.styles, message.styles);
  const floats = buffers.map(
    (b) => new Float32Array(b.buffer ? b.buffer.slice(b.byteOffset).slice(0, b.byteLength) : b),
  );
  Object.entries(message.images ?? {}).forEach(([key, [rows, columns, ...extent]], k) => {
    known.images[key] = { rows, columns, extent, values: floats[k + 1] };
  });
  let at = 0;
  const take = (count) => floats[0].subarray(at, (at += count));
  const style = (s) => (typeof s === "object" ? s : known.styles[s]) ?? {};
  const marks = message.marks.map(([kind, panel, s, points, words]) => {
    const numbers = Array.isArray(points) ? Float32Array.from(points) : points ? take(2 * points) : [];
    if (kind === "legend") words = words.map(([text, entry]) => [text, style(entry)]);
    return { kind, panel, style: style(s), points: numbers, words };
  });
  const handles = (message.handles ?? []).map((handle) => {
    if (!handle.along) return handle;
    const track = take(2 * handle.along);
    return { ...handle, track, set: Object.fromEntries(Object.keys(handle.set).map((k) => [k, take(handle.along)])) };
  });
  return { marks, handles };
}

// ------------------------------------------------------------------------------------------------- layout of one panel

/** Where the box of a panel and its words are; width(words, size) measures, margins are not less than `least`. */
export function layout({ spec, title, legend = [], scale }, frame, [wide, high], font, width, least = {}) {
  const [line, small] = [1.3 * font, 0.92 * font];
  const fixed = (values) => values.map((v) => ({ at: v, words: minus(v) }));
  const widest = (list) => Math.max(0, ...list.map((t) => width(t.words, small)));
  const lines = (words, room) => wrap(words, room, (w) => width(w, font));
  const titles = lines(title ?? spec.title, wide);
  const rows = [];
  for (const [words, style] of legend) {
    const room = 2.9 * font + width(words, small);
    if (!rows.length || rows.at(-1).room + room > wide) rows.push({ room: 0, entries: [] });
    rows.at(-1).entries.push({ words, style, at: rows.at(-1).room });
    rows.at(-1).room += room;
  }
  // A short title and a short legend share a line.
  const together = titles.length === 1 && rows.length === 1 && width(titles[0], font) * 1.1 + rows[0].room < wide;
  const above = together ? 1 : titles.length + rows.length;
  const top = Math.max(least.top ?? 0, above ? (above + 0.2) * line : 0.6 * line);
  const xlabel = lines(spec.xlabel, wide);
  const bottom = (spec.xticks?.length === 0 ? 0.2 : 1.3 + xlabel.length) * line;
  const ylabel = lines(spec.ylabel, high - top - bottom);
  const most = Math.min(Math.max(Math.floor((high - top - bottom) / (2.1 * font)), 2), 7);
  const y = spec.yticks ? fixed(spec.yticks) : ticks(frame[2], frame[3], most, spec.yscale === "log");
  const left = Math.max(least.left ?? 0, ylabel.length * line + widest(y) + 0.5 * font);
  const levels = scale ? fixed(scale[0].levels) : [];
  const label = lines(scale?.[1], high - top - bottom);
  const right = scale ? 2.3 * font + widest(levels) + label.length * line : 1.1 * font;
  const box = { left, top, width: Math.max(wide - left - right, 10), height: Math.max(high - top - bottom, 10) };
  if (spec.aspect === "equal") {
    const [over, up] = [frame[1] - frame[0], frame[3] - frame[2]];
    const per = Math.min(box.width / over, box.height / up);
    Object.assign(box, { left: left + (box.width - per * over) / 2, width: per * over, height: per * up });
  }
  let x = fixed(spec.xticks ?? []);
  for (let count = 8; !spec.xticks && count; count--) {
    const list = ticks(frame[0], frame[1], count);
    if (list.length * (widest(list) + 0.6 * font) < box.width && (list.length > 1 || !x.length)) x = list;
    if (x.length) break;
  }
  return { box, x, y, titles, rows, xlabel, ylabel, label, levels, font, line, small, left, top, together };
}

// -------------------------------------------------------------------------------------------------------------- colours

const rgb = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16));
const css = (c) => `rgb(${c.join()})`;
const mix = (a, b, share) => a.map((v, k) => Math.round(v + share * (b[k] - v)));
const shine = (c) => [0.2126, 0.7152, 0.0722].reduce((sum, w, k) => sum + w * ((c[k] / 255 + 0.055) / 1.055) ** 2.4, 0);
const contrast = (a, b) => (Math.max(shine(a), shine(b)) + 0.05) / (Math.min(shine(a), shine(b)) + 0.05);

/** What surrounds an element: the colours of paper and ink, and how a colour meant for white paper looks on it. */
export function themeOf(el) {
  let paper = [255, 255, 255];
  for (let e = el; e; e = e.parentElement) {
    const [r, g, b, a = 1] = getComputedStyle(e)
      .backgroundColor.match(/[\d.]+/g)
      ?.map(Number) ?? [0, 0, 0, 0];
    if (a > 0.5) {
      paper = [r, g, b];
      break;
    }
  }
  const dark = shine(paper) < 0.3;
  const ink = dark ? [235, 235, 235] : [34, 34, 34];
  const colour = (hex, fill = false) => {
    if (!hex || !dark) return hex;
    let c = rgb(hex);
    if (shine(c) > 0.95) return css(paper);
    if (fill && shine(c) > 0.6) return css(mix(paper, c, 0.16));
    while (contrast(c, paper) < (fill ? 3 : 4.5)) c = mix(c, [255, 255, 255], 0.15);
    return css(c);
  };
  return {
    dark,
    colour,
    paper: css(paper),
    ink: css(ink),
    faint: css(mix(paper, ink, 0.13)),
    axis: css(mix(paper, ink, 0.6)),
  };
}

// ------------------------------------------------------------------------------------------------------------ one panel

class Panel {
  constructor(name, spec, parent) {
    Object.assign(this, { name, spec, least: {}, map: {} });
    this.el = make("div", { className: `rapkm-panel ${spec.small ? "small" : ""} ${spec.aspect ?? ""}` }, parent);
    this.el.style.gridArea = name;
    const label = [spec.title, spec.ylabel, spec.xlabel].filter(Boolean).join(", ") || name;
    this.canvas = make("canvas", { role: "img", ariaLabel: label }, this.el);
    this.ctx = this.canvas.getContext("2d");
  }

  /** The pixel of a point, and the point of a pixel. */
  at(x, y) {
    const { box, frame, spec } = this;
    const up =
      spec.yscale === "log"
        ? Math.log(y / frame[2]) / Math.log(frame[3] / frame[2])
        : (y - frame[2]) / (frame[3] - frame[2]);
    return [box.left + (box.width * (x - frame[0])) / (frame[1] - frame[0]), box.top + box.height * (1 - up)];
  }

  data(px, py) {
    const { box, frame } = this;
    const [over, up] = [(px - box.left) / box.width, (box.top + box.height - py) / box.height];
    return [frame[0] + over * (frame[1] - frame[0]), frame[2] + up * (frame[3] - frame[2])];
  }

  /** Call paint(text, left, shift) for each piece of words in its font; returns the width. */
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
  write(words, x, y, { size, colour, bold = false, ha = "left", va = "baseline", halo = null }) {
    const left = x - this.pieces(words, size, bold) * { left: 0, center: 0.5, right: 1 }[ha];
    const base = y + size * { baseline: 0, bottom: -0.25, center: 0.36, top: 0.85 }[va];
    Object.assign(this.ctx, { strokeStyle: halo, fillStyle: colour, lineWidth: 3, lineJoin: "round" });
    for (const way of halo ? ["strokeText", "fillText"] : ["fillText"])
      this.pieces(words, size, bold, (text, at, up) => this.ctx[way](text, left + at, base - up));
  }

  /** Paint marks; `look` = {theme, base, floor, family} says how. */
  paint(look, frame, marks) {
    const { clientWidth: wide, clientHeight: high } = this.el;
    const ratio = window.devicePixelRatio || 1;
    if (!wide || !high || !frame) return;
    const pixels = { width: Math.round(wide * ratio), height: Math.round(high * ratio) };
    // Setting a size blanks a canvas, so only when it is another one.
    if (this.canvas.width !== pixels.width || this.canvas.height !== pixels.height) Object.assign(this.canvas, pixels);
    Object.assign(this, { frame, look, theme: look.theme, ratio, ctx: this.ctx });
    this.size = (points) => Math.max((points / 10.5) * look.base, look.floor);
    const last = (kind) => marks.findLast((mark) => mark.kind === kind);
    const [heading, key] = [last("title"), [wide, high, look.base].join()];
    const parts = {
      spec: this.spec,
      title: heading?.words,
      legend: last("legend")?.words,
      scale: last("scale")?.words,
    };
    // Margins only grow, so that nothing moves while a control does.
    if (this.least.key !== key) this.least = { key };
    const plan = layout(parts, frame, [wide, high], this.size(10.5), (w, size) => this.pieces(w, size), this.least);
    Object.assign(this.least, { left: plan.left, top: plan.top });
    Object.assign(this, { box: plan.box, taken: [] });
    this.ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.ctx.clearRect(0, 0, wide, high);
    this.furniture(plan, wide, heading, parts.scale);
    for (const mark of marks.filter((m) => PAINT[m.kind]).sort((a, b) => a.style.z - b.style.z)) {
      this.ctx.save();
      this.ctx.globalAlpha = mark.style.alpha ?? 1;
      PAINT[mark.kind](this, mark, mark.style);
      this.ctx.restore();
    }
  }

  /** Grid, axes, ticks, labels, title, legend, scale of colours. */
  furniture(
    { box, x, y, titles, rows, xlabel, ylabel, label, levels, font, line, small, together },
    wide,
    heading,
    scale,
  ) {
    const { ctx, theme } = this;
    const [right, foot] = [box.left + box.width, box.top + box.height];
    const [text, name] = [
      { size: small, colour: theme.ink },
      { size: font, colour: theme.ink, ha: "center" },
    ];
    const rule = (color, points) => stroke(this, points, { color, width: 0.75 });
    const upright = (words, left) =>
      words.forEach((w, k) => {
        ctx.save();
        ctx.translate(left + (k + 0.8) * line, box.top + box.height / 2);
        ctx.rotate(-Math.PI / 2);
        this.write(w, 0, 0, name);
        ctx.restore();
      });
    for (const t of x) {
      const [px] = this.at(t.at, 1);
      rule(theme.faint, [px, box.top, px, foot]);
      this.write(t.words, px, foot + 0.3 * font, { ...text, ha: "center", va: "top" });
    }
    let widest = 0;
    for (const t of y) {
      const py = this.at(1, t.at)[1];
      rule(theme.faint, [box.left, py, right, py]);
      this.write(t.words, box.left - 0.4 * font, py, { ...text, ha: "right", va: "center" });
      widest = Math.max(widest, this.pieces(t.words, small));
    }
    if (x.length) rule(theme.axis, [box.left, box.top, box.left, foot, right, foot]);
    upright(ylabel, Math.max(0, box.left - 0.5 * font - widest - ylabel.length * line));
    xlabel.forEach((w, k) => {
      const half = this.pieces(w, font) / 2;
      const middle = Math.max(Math.min(box.left + box.width / 2, wide - half), half);
      this.write(w, middle, foot + (k + 1.15) * line, { ...name, va: "top" });
    });
    const rise = box.top - 0.3 * line;
    titles.forEach((w, k) => {
      const bold = heading?.style.bold ?? true;
      const left = Math.max(0, Math.min(box.left, wide - this.pieces(w, font, bold)));
      const up = titles.length - 1 - k + (together ? 0 : rows.length);
      this.write(w, left, rise - up * line, {
        size: font,
        bold,
        colour: theme.colour(heading?.style.color) ?? theme.ink,
      });
    });
    rows.forEach(({ entries, room }, k) => {
      for (const { words, style, at } of entries) {
        const [left, py] = [Math.max(0, right - room) + at, rise - (rows.length - 1 - k) * line];
        ctx.globalAlpha = style.alpha ?? 1;
        stroke(this, [left, py - 0.3 * small, left + 1.8 * font, py - 0.3 * small], style);
        ctx.globalAlpha = 1;
        this.write(words, left + 2.2 * font, py, text);
      }
    });
    if (!scale) return;
    const [colours, bar] = [theme.dark ? scale[0].dark : scale[0].light, right + 0.8 * font];
    levels.forEach((level, k) => {
      const [py, step] = [foot - (box.height * k) / colours.length, box.height / colours.length];
      ctx.fillStyle = colours[k] ?? theme.paper;
      if (k < colours.length) ctx.fillRect(bar, py - step, 0.9 * font, step + 0.5);
      const va = k === 0 ? "bottom" : k < colours.length ? "center" : "top";
      this.write(level.words, bar + 1.2 * font, py, { ...text, va });
    });
    upright(label, wide - label.length * line - 0.1 * font);
  }
}

// ---------------------------------------------------------------------------------------------------------------- marks

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
  s: [-1, -1, 1, -1, 1, 1, -1, 1],
  D: [-1.3, 0, 0, -1.3, 1.3, 0, 0, 1.3],
  x: [-1, -1, 1, 1, NaN, NaN, -1, 1, 1, -1],
  "+": [-1, 0, 1, 0, NaN, NaN, 0, -1, 0, 1],
};

function line(panel, { points }, style) {
  const { ctx, theme } = panel;
  const path = pixels(panel, points);
  clip(panel, style.marker ? 8 : 0);
  stroke(panel, path, style);
  for (let k = 0; style.marker && k < path.length; k += 2) {
    const r = (style.size * POINT) / 2;
    const open = "x+".includes(style.marker);
    trace(
      ctx,
      (SHAPES[style.marker] ?? []).map((v, j) => path[k + (j % 2)] + r * v),
      !open,
    );
    if (style.marker === "o") ctx.arc(path[k], path[k + 1], r, 0, 2 * Math.PI);
    ctx.fillStyle = theme.colour(style.face, true);
    if (!open) ctx.fill();
    Object.assign(ctx, { strokeStyle: theme.colour(style.color), lineWidth: style.edge * POINT });
    ctx.stroke();
  }
}

function polygon(panel, { points }, style) {
  const path = pixels(panel, points);
  clip(panel);
  trace(panel.ctx, path, true);
  panel.ctx.fillStyle = panel.theme.colour(style.face, true) ?? "transparent";
  panel.ctx.fill("evenodd");
  stroke(panel, path, style, true);
}

function words(panel, { kind, points, words }, style) {
  const { box, theme } = panel;
  const [x, y] =
    kind === "words" ? [box.left + points[0] * box.width, box.top + (1 - points[1]) * box.height] : panel.at(...points);
  if (x < box.left - 1 || x > box.left + box.width + 1 || y < box.top - 1 || y > box.top + box.height + 1) return;
  const [size, colour] = [panel.size(style.size), theme.colour(style.color)];
  const wide = panel.pieces(words, size, style.bold);
  const left = x - wide * { left: 0, center: 0.5, right: 1 }[style.ha];
  // Words that would cover others step aside, away from what they name.
  const way = style.va === "top" ? 0.5 : -0.5;
  const hit = (up) =>
    panel.taken.some(([a, b, c, s]) => left < c && left + wide > a && Math.abs(y + up - b) < 0.6 * (s + size));
  let up = 0;
  while (Math.abs(up) < 3 * size && hit(up)) up += way * size;
  panel.taken.push([left, y + up, left + wide, size]);
  panel.write(words, x, y + up, { ...style, size, colour, halo: style.color === "#ffffff" ? null : theme.paper });
}

/** A map in classes: bilinear between its samples, decided anew at every pixel of the screen. */
function image(panel, { points, words: [key, palette], images }) {
  const { rows, columns, extent, values } = images[key];
  const { ctx, ratio, theme, map } = panel;
  const [left, top] = panel.at(extent[0], extent[3]).map((v) => Math.floor(v * ratio));
  const [width, height] = panel.at(extent[1], extent[2]).map((v, k) => Math.ceil(v * ratio) - [left, top][k]);
  const now = [key, width, height, theme.dark].join();
  if (map.key !== now) {
    const canvas = make("canvas", { width, height });
    const picture = ctx.createImageData(width, height);
    const out = new Uint32Array(picture.data.buffer);
    const colours = (theme.dark ? palette.dark : palette.light).map((c) => [...rgb(c).reverse(), 255]);
    const packed = colours.map(([b, g, r, a]) => ((a << 24) | (b << 16) | (g << 8) | r) >>> 0);
    const place = (k, n, count) => Math.min(Math.max(((k + 0.5) / n) * count - 0.5, 0), count - 1.000001);
    for (let j = 0, level = 0; j < height; j++) {
      const v = place(height - 1 - j, height, rows);
      for (let i = 0; i < width; i++) {
        const u = place(i, width, columns);
        const at = Math.floor(v) * columns + Math.floor(u);
        const [a, b] = [u % 1, v % 1];
        const low = values[at] + a * (values[at + 1] - values[at]);
        const high = values[at + columns] + a * (values[at + columns + 1] - values[at + columns]);
        const value = low + b * (high - low);
        while (level < packed.length - 1 && value >= palette.levels[level + 1]) level++;
        while (level > 0 && value < palette.levels[level]) level--;
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

// -------------------------------------------------------------------------------------------------------------- handles

/** The distance of (x, y) from a path x0, y0, x1, y1, ... and where along it the nearest point is, in corners. */
function nearest(path, x, y) {
  let best = { gap: Infinity, place: 0 };
  for (let k = 0; k + 3 < path.length; k += 2) {
    const [ax, ay, dx, dy] = [path[k], path[k + 1], path[k + 2] - path[k], path[k + 3] - path[k + 1]];
    const share = Math.min(Math.max(((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy || 1), 0), 1);
    const gap = Math.hypot(x - ax - share * dx, y - ay - share * dy);
    if (gap < best.gap) best = { gap, place: k / 2 + share };
  }
  return best;
}

/** What the controls of a handle must be for it to stand at (x, y). */
export function wish({ track, set }, x, y) {
  const { place } = nearest(track ?? [], x, y);
  const k = track ? Math.min(Math.floor(place), track.length / 2 - 2) : 0;
  const value = (v) => (track ? v[k] + (place - k) * (v[k + 1] - v[k]) : v[0] * x + (v[1] && v[1] * y) + v[2]);
  return Object.fromEntries(Object.entries(set).map(([name, v]) => [name, value(v)]));
}

/** Steps of its controls for an arrow key, ten with shift; null for another key. */
export function steps({ track, set, at }, key, shift) {
  const way = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[key];
  if (!way) return null;
  const count = (v) =>
    track || at[1] === null ? way[0] + way[1] : Math.sign(v[0]) * way[0] + Math.sign(v[1]) * way[1];
  const moves = Object.entries(set).map(([name, v]) => [name, (shift ? 10 : 1) * count(v)]);
  return Object.fromEntries(moves.filter(([, n]) => n));
}

// ---------------------------------------------------------------------------------------------------- the whole picture

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
  const root = make(
    "div",
    { className: "rapkm", role: "group", ariaLabel: scene.about || scene.name || "picture" },
    el,
  );
  const stage = make("div", { className: "rapkm-panels" }, root);
  const problem = make("p", { className: "rapkm-problem", hidden: true }, stage);
  const numbers = make("p", { className: "rapkm-numbers" }, root);
  const foot = make("p", { className: "rapkm-foot" }, root);
  const copy = make("button", { type: "button", textContent: "copy this setting", hidden: scene.code === false }, foot);
  const note = make("span", { className: "rapkm-note", role: "status" }, foot);
  const sentence = make("p", { className: "rapkm-sentence", ariaLive: "polite" }, root);
  const say = (text) => (note.textContent = text);
  stage.style.setProperty("--areas", scene.layout.map((row) => `"${row.join(" ")}"`).join(" "));
  stage.style.setProperty("--columns", scene.widths.map((w) => `minmax(0, ${w}fr)`).join(" "));
  stage.style.setProperty("--shape", scene.size.join(" / "));
  const panels = Object.entries(scene.panels).map(([name, spec]) => new Panel(name, spec, stage));
  const known = { styles: {}, images: {} };
  const state = { fixed: [], marks: [], handles: [], frames: null, places: {}, drawn: 0 };
  let theme = null;

  function paint() {
    if (!state.frames || !root.clientWidth) return;
    theme ??= themeOf(root);
    root.classList.toggle("narrow", root.clientWidth < NARROW);
    const style = getComputedStyle(root);
    const floor = parseFloat(style.getPropertyValue("--least")) || 12;
    const look = { theme, floor, base: parseFloat(style.fontSize), family: style.fontFamily };
    const marks = [...state.fixed, ...state.marks];
    for (const panel of panels)
      panel.paint(
        look,
        state.frames[panel.name],
        marks.filter((m) => m.panel === panel.name),
      );
    state.handles.forEach(knob);
    knobs.slice(state.handles.length).forEach((knob) => (knob.hidden = true));
  }

  // One focusable knob for each handle.
  const knobs = [];
  function knob(handle, k) {
    const panel = panels.find((p) => p.name === handle.panel);
    if (!panel.box) return;
    const knob = (knobs[k] ??= make("div", { tabIndex: 0, role: "slider" }));
    const bare = handle.at[1] === null;
    const [x, y] = panel.at(handle.at[0], bare ? panel.frame[2] : handle.at[1]);
    const names = Object.keys(handle.set);
    const label = (name) => scene.labels?.[name] ?? name;
    if (knob.parentElement !== panel.el) panel.el.append(knob);
    Object.assign(knob, { className: bare ? "rapkm-knob bare" : "rapkm-knob", hidden: false });
    Object.assign(knob, {
      ariaLabel: `${names.map(label).join(" and ")}, in the picture`,
      ariaValueNow: state.places[names[0]],
    });
    knob.ariaValueText = names.map((name) => `${label(name)}: ${state.places[name]}`).join(", ");
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
  const open = new Map();
  let [seq, waiting] = [0, { to: {}, by: {} }];
  function ask(to, by = {}) {
    Object.assign(waiting.to, to);
    for (const [name, n] of Object.entries(by)) waiting.by[name] = (waiting.by[name] ?? 0) + n;
    pump();
  }
  function pump() {
    for (const [k, since] of open) {
      if (performance.now() - since < PATIENCE) continue;
      open.delete(k);
      say("No answer: run the cell again.");
    }
    if (open.size >= AFLOAT || !Object.keys({ ...waiting.to, ...waiting.by }).length) return;
    open.set(++seq, performance.now());
    const message = { kind: "grab", from: me, seq, ...waiting };
    waiting = { to: {}, by: {} };
    setTimeout(pump, PATIENCE + 50);
    link.send(message);
  }

  let rest = 0;
  function receive(message, buffers = []) {
    if (message.from === me) open.delete(message.seq);
    if (message.marks) {
      const { marks, handles } = decode(message, buffers, known);
      for (const mark of marks) mark.images = known.images;
      state.frames = message.frames;
      if (message.kind === "fixed") state.fixed = marks;
      else show(message, marks, handles);
    }
    pump();
  }
  function show(message, marks, handles) {
    Object.assign(state, { marks, places: message.places ?? {}, code: message.code ?? "" });
    // While there is a problem the last handles stay, as the way back.
    if (handles.length || !message.problem) state.handles = handles;
    Object.assign(problem, { textContent: message.problem ?? "", hidden: !message.problem });
    const item = ([name, text]) => {
      const span = rich(make("span"), `${name}: `);
      rich(make("b", {}, span), minus(text));
      return span;
    };
    numbers.replaceChildren(...(message.numbers ?? []).map(item));
    say(message.note ?? "");
    root.classList.add("live");
    paint();
    root.dataset.drawn = ++state.drawn;
    root.dataset.places = JSON.stringify(state.places);
    // Read out when the hand rests, not at every step.
    clearTimeout(rest);
    rest = setTimeout(() => {
      sentence.textContent = message.sentence ?? "";
      nameControls();
    }, 700);
  }

  // Taking hold of the nearest knob or line, else of a line that is pushed along the panel.
  let held = null;
  function under(panel, { clientX, clientY, pointerType = "touch" }) {
    const area = panel.el.getBoundingClientRect();
    const [x, y] = [clientX - area.left, clientY - area.top];
    let best = null;
    for (const handle of panel.box ? state.handles.filter((h) => h.panel === panel.name) : []) {
      const bare = handle.at[1] === null;
      const [hx, hy] = bare ? [x, y] : panel.at(...handle.at);
      const grip = handle.grip
        ? nearest(
            handle.grip.flatMap((p) => panel.at(...p)),
            x,
            y,
          ).gap / 14
        : Infinity;
      const gap = bare ? 0.99 : Math.min(Math.hypot(x - hx, y - hy) / 24, grip) / (pointerType === "mouse" ? 1 : 1.6);
      if (gap < (best?.gap ?? 1)) best = { panel, handle, gap, off: [hx - x, hy - y] };
    }
    return best;
  }
  function move({ clientX, clientY }) {
    const area = held.panel.el.getBoundingClientRect();
    const at = held.panel.data(clientX - area.left + held.off[0], clientY - area.top + held.off[1]);
    ask(wish(held.handle, ...at));
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
    navigator.clipboard?.writeText(state.code).then(
      () => say(`copied: ${state.code}`),
      () => {},
    );
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

  // A new style sheet may come late, so colours are looked up again for a while.
  const again = () => {
    theme = null;
    paint();
  };
  const watch = new MutationObserver(() => [0, 300, 1200].forEach((ms) => setTimeout(again, ms)));
  for (const node of [document.documentElement, document.body])
    watch.observe(node, { attributeFilter: ["class", "data-theme", "data-jp-theme-light", "data-jp-theme-name"] });
  const sizes = new ResizeObserver(paint);
  [root, ...panels.map((panel) => panel.el)].forEach((node) => sizes.observe(node));
  const dark = matchMedia("(prefers-color-scheme: dark)");
  dark.addEventListener("change", again);
  window.addEventListener("resize", paint);
  document.addEventListener("keydown", page, true);
  link.receive(receive);
  link.send({ kind: "hello" });
  const leave = () => {
    [watch, sizes].forEach((observer) => observer.disconnect());
    dark.removeEventListener("change", again);
    window.removeEventListener("resize", paint);
    document.removeEventListener("keydown", page, true);
    root.remove();
  };
  return Object.assign(leave, { say });
}

/** Page up and page down turn the screens of a dashboard, also while a slider has the focus. */
function page(event) {
  const screens = [...document.querySelectorAll(".rapkm-screen")];
  const way = { PageDown: 1, PageUp: -1 }[event.key];
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
