// Recorded marks on canvases, and handles to take the picture by.  One module, nothing to build, no dependency.
//
// mount(el, scene, link) shows a picture in `el`.  scene: {panels, layout, widths, size, name, about, labels};
// link = {send(message), receive(callback(message, buffers))} reaches whoever computes, a kernel or a script.
//   to it:   {kind: "hello"} | {kind: "grab", from, seq, to: {control: value}, by: {control: steps}}
//   from it: {kind: "fixed" | "picture", from?, seq?, marks, styles, images, frames, handles, numbers, places, ...}
//            {kind: "lost", from, seq}: a question that has no answer
// A mark is [kind, panel, style, points, words?]: style a number in `styles` or an object, points a count of pairs in
// the first buffer or an array of numbers.  Lengths of styles are points (1/72 inch).

const POINT = 96 / 72;
const PATIENCE = 5000; // ms after which an answer counts as lost
const AFLOAT = 2; // questions under way at the same time
const NARROW = 600; // CSS pixels below which panels are stacked

// ---------------------------------------------------------------- words and numbers

export const minus = (words) => String(words).replace(/(^|[\s(/])-(?=\d)/g, "$1−");

/** "σ_min" and "10^−3" as pieces {text, shift}: shift -1 is a subscript, 1 a superscript. */
export function pieces(words) {
  const out = [];
  for (const part of String(words).split(/([_^][\p{L}\p{N}−]+)/u)) {
    const shift = { _: -1, "^": 1 }[part[0]] ?? 0;
    if (part) out.push({ text: shift && part.length > 1 ? part.slice(1) : part, shift: part.length > 1 ? shift : 0 });
  }
  return out;
}

/** Words in lines that are at most `room` wide, if their words allow. */
export function wrap(words, room, width) {
  const lines = [];
  for (const word of String(words).split(" ")) {
    const longer = lines.length ? `${lines.at(-1)} ${word}` : word;
    if (lines.length && width(longer) <= room) lines[lines.length - 1] = longer;
    else lines.push(word);
  }
  return lines;
}

/** Ticks {at, words} between two limits, at most about `most`; decades on a logarithmic axis. */
export function ticks(low, high, most = 6, log = false) {
  if (!(high > low) || !Number.isFinite(high - low) || (log && low <= 0)) return [];
  const out = [];
  if (log) {
    const last = Math.floor(Math.log10(high) + 1e-9);
    let k = Math.ceil(Math.log10(low) - 1e-9);
    const every = Math.max(1, Math.ceil((last - k + 1) / Math.max(most, 1)));
    for (; k <= last; k += every) out.push({ at: 10 ** k, words: `10^${minus(k)}` });
    return out;
  }
  const least = (high - low) / Math.max(most, 1);
  const decade = 10 ** Math.floor(Math.log10(least));
  const step = [1, 2, 2.5, 5, 10].find((s) => s * decade >= least * (1 - 1e-9)) * decade;
  let digits = 0;
  while (digits < 12 && Math.abs(step * 10 ** digits - Math.round(step * 10 ** digits)) > 1e-6) digits++;
  for (let k = Math.ceil(low / step - 1e-9); k <= Math.floor(high / step + 1e-9); k++)
    out.push({ at: k * step, words: minus((k * step || 0).toFixed(digits)) });
  return out;
}

/** The marks of a message as {kind, panel, style, points, words}, in the order of painting. */
export function decode(message, buffers, known) {
  Object.assign(known.styles, message.styles);
  const floats = buffers.map((b) => new Float32Array(b.buffer ? b.buffer.slice(b.byteOffset, b.byteOffset + b.byteLength) : b));
  Object.entries(message.images ?? {}).forEach(([key, [rows, columns, ...extent]], k) => {
    known.images[key] = { rows, columns, extent, values: floats[k + 1] };
  });
  let at = 0;
  const take = (count) => floats[0].subarray(at, (at += count));
  const marks = message.marks.map(([kind, panel, style, points, words]) => {
    const numbers = Array.isArray(points) ? Float32Array.from(points) : points ? take(2 * points) : new Float32Array(0);
    return { kind, panel, style: (typeof style === "object" ? style : known.styles[style]) ?? {}, points: numbers, words };
  });
  const handles = (message.handles ?? []).map((handle) => {
    if (!(handle.along > 0)) return handle;
    const track = take(2 * handle.along);
    return { ...handle, track, set: Object.fromEntries(Object.keys(handle.set).map((k) => [k, take(handle.along)])) };
  });
  return { marks, handles };
}

// ---------------------------------------------------------------- layout of one panel

/** Where the plot box of a panel is, and the lines of its words.  width(words, size) measures. */
export function layout(panel, frame, [wide, high], font, width, least = {}) {
  const { spec, legend = [], scale = null, title = spec.title ?? "" } = panel;
  const line = 1.3 * font;
  const small = 0.92 * font;
  const titles = title ? wrap(title, wide, (w) => width(w, font)) : [];
  const rows = [];
  for (const [words, style] of legend) {
    const room = 2.2 * font + width(words, small) + 0.7 * font;
    if (!rows.length || rows.at(-1).room + room > wide) rows.push({ room: 0, entries: [] });
    rows.at(-1).entries.push({ words, style, at: rows.at(-1).room });
    rows.at(-1).room += room;
  }
  const together = titles.length === 1 && rows.length === 1 && width(title, font) + rows[0].room + font < wide;
  const above = titles.length + rows.length - together;
  const log = spec.yscale === "log";
  const fixed = (list) => list.map((v) => ({ at: v, words: minus(v) }));
  const widest = (list) => Math.max(0, ...list.map((t) => width(t.words, small)));
  const top = Math.max(least.top ?? 0, above ? above * line + 0.25 * font : 0.7 * font);
  const xroom = spec.xticks?.length === 0 ? 0 : line;
  const ylabel = spec.ylabel ? wrap(spec.ylabel, Math.max(high - top - 2.2 * line, 4 * font), (w) => width(w, font)) : [];
  const xlabel = spec.xlabel ? wrap(spec.xlabel, 0.8 * wide, (w) => width(w, font)) : [];
  const bottom = xroom + xlabel.length * line + 0.4 * font;
  const y = spec.yticks
    ? fixed(spec.yticks)
    : ticks(frame[2], frame[3], Math.max(2, Math.min(7, Math.floor((high - top - bottom) / (2.1 * font)))), log);
  const left = Math.max(least.left ?? 0, ylabel.length * line + widest(y) + (y.length ? 0.6 * font : 0.2 * font));
  const bar = scale ? wrap(scale[1], high - top - bottom, (w) => width(w, font)) : [];
  const numbers = scale ? fixed(scale[0].levels) : [];
  const right = scale ? 2.3 * font + widest(numbers) + bar.length * line : y.length ? 1.1 * font : 0.2 * font;
  let box = { left, top, width: Math.max(wide - left - right, 10), height: Math.max(high - top - bottom, 10) };
  if (spec.aspect === "equal") {
    const per = Math.min(box.width / (frame[1] - frame[0]), box.height / (frame[3] - frame[2]));
    const [w, h] = [per * (frame[1] - frame[0]), per * (frame[3] - frame[2])];
    box = { left: left + (box.width - w) / 2, top: top + (box.height - h) / 2, width: w, height: h };
  }
  let x = spec.xticks ? fixed(spec.xticks) : [];
  for (let most = 8; !spec.xticks && most > 1; most--) {
    x = ticks(frame[0], frame[1], most);
    if (x.length * (widest(x) + font) < box.width) break;
  }
  return { box, x, y, titles, rows, together, ylabel, xlabel, bar, numbers, line, small, left, top };
}

// ---------------------------------------------------------------- theme

const rgb = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16));
const light = (c) =>
  [0.2126, 0.7152, 0.0722].reduce((s, w, k) => s + w * ((c[k] / 255 + 0.055) / 1.055) ** 2.4, 0);
const contrast = (a, b) => (Math.max(light(a), light(b)) + 0.05) / (Math.min(light(a), light(b)) + 0.05);
const mix = (a, b, share) => a.map((v, k) => Math.round(v + share * (b[k] - v)));
const css = (c) => `rgb(${c.join(",")})`;

/** The theme around an element: the colour of the paper, and how colours meant for white paper look on it. */
export function themeOf(el) {
  let paper = null;
  for (let e = el; e && !paper; e = e.parentElement) {
    const [r, g, b, a = 1] = (getComputedStyle(e).backgroundColor.match(/[\d.]+/g) ?? [0, 0, 0, 0]).map(Number);
    if (a > 0.5) paper = [r, g, b];
  }
  paper ??= [255, 255, 255];
  const dark = light(paper) < 0.3;
  const seen = new Map();
  const colour = (hex, fill = false) => {
    if (!hex || !dark) return hex;
    const key = hex + fill;
    if (!seen.has(key)) {
      let c = rgb(hex);
      if (light(c) > 0.95) c = paper;
      else if (fill && light(c) > 0.6) c = mix(paper, c, 0.16);
      else for (let k = 0; k < 12 && contrast(c, paper) < (fill ? 3 : 4.5); k++) c = mix(c, [255, 255, 255], 0.15);
      seen.set(key, css(c));
    }
    return seen.get(key);
  };
  const ink = dark ? [235, 235, 235] : [34, 34, 34];
  return { paper: css(paper), dark, colour, ink: css(ink), faint: css(mix(paper, ink, 0.13)), axis: css(mix(paper, ink, 0.6)) };
}

// ---------------------------------------------------------------- one panel

class Panel {
  constructor(name, spec, place) {
    Object.assign(this, { name, spec, place, least: {}, map: {} });
    this.el = document.createElement("div");
    this.el.className = "rapkm-panel";
    this.canvas = this.el.appendChild(document.createElement("canvas"));
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", [spec.title?.trim(), spec.ylabel, spec.xlabel].filter(Boolean).join(", ") || name);
    this.ctx = this.canvas.getContext("2d");
  }

  /** Pixels of data, and back. */
  at(x, y) {
    const { left, top, width, height } = this.box;
    const [x0, x1, y0, y1] = this.frame;
    const up = this.spec.yscale === "log" ? Math.log(y / y0) / Math.log(y1 / y0) : (y - y0) / (y1 - y0);
    return [left + (width * (x - x0)) / (x1 - x0), top + height * (1 - up)];
  }

  data([px, py]) {
    const { left, top, width, height } = this.box;
    const [x0, x1, y0, y1] = this.frame;
    return [x0 + ((px - left) / width) * (x1 - x0), y1 - ((py - top) / height) * (y1 - y0)];
  }

  font(size, bold) {
    this.ctx.font = `${bold ? "bold " : ""}${size}px ${this.family}`;
  }

  width = (words, size, bold) =>
    pieces(words).reduce((sum, { text, shift }) => {
      this.font(shift ? 0.72 * size : size, bold);
      return sum + this.ctx.measureText(text).width;
    }, 0);

  /** Words at a pixel, with true subscripts; returns their rectangle. */
  write(words, x, y, { size, bold = false, ha = "left", va = "baseline", colour, halo = null }) {
    const ctx = this.ctx;
    const wide = this.width(words, size, bold);
    let left = x - wide * { left: 0, center: 0.5, right: 1 }[ha];
    const base = y + size * ({ baseline: 0, bottom: -0.25, center: 0.36, top: 0.85 }[va] ?? 0);
    const rectangle = [left, base - 0.85 * size, left + wide, base + 0.25 * size];
    for (const { text, shift } of pieces(words)) {
      this.font(shift ? 0.72 * size : size, bold);
      for (const [way, paint] of [["strokeText", halo], ["fillText", colour]]) {
        if (!paint) continue;
        Object.assign(ctx, { strokeStyle: paint, fillStyle: paint, lineWidth: 3, lineJoin: "round" });
        ctx[way](text, left, base - 0.3 * shift * size);
      }
      left += ctx.measureText(text).width;
    }
    return rectangle;
  }

  /** Paint the marks of this panel; false while there is no room. */
  paint(theme, frame, marks, base, floor, family) {
    const { clientWidth: wide, clientHeight: high } = this.el;
    if (!wide || !high || !frame) return false;
    const ratio = window.devicePixelRatio || 1;
    const [w, h] = [Math.round(wide * ratio), Math.round(high * ratio)];
    // A canvas that is resized is blank and costs memory, so only when it must.
    if (this.canvas.width !== w || this.canvas.height !== h) Object.assign(this.canvas, { width: w, height: h }, { title: "" });
    Object.assign(this, { frame, family, theme, ratio, size: (points) => Math.max((points / 10.5) * base, floor) });
    const last = (kind) => marks.findLast((m) => m.kind === kind);
    const heading = last("title");
    const legend = last("legend")?.words.map(([words, style]) => [words, style]);
    const key = `${wide} ${high} ${base}`;
    if (this.least.key !== key) this.least = { key };
    const panel = { spec: this.spec, legend, scale: last("scale")?.words, title: heading?.words ?? this.spec.title };
    const plan = layout(panel, frame, [wide, high], this.size(10.5), this.width, this.least);
    // Margins only grow, so that nothing moves while a control does.
    Object.assign(this.least, { left: plan.left, top: plan.top });
    this.box = plan.box;
    this.ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.ctx.clearRect(0, 0, wide, high);
    this.furniture(plan, wide, heading, panel.scale);
    const order = marks.filter((m) => PAINT[m.kind]).sort((a, b) => (a.style.z ?? 2) - (b.style.z ?? 2));
    this.taken = [];
    for (const mark of order) {
      this.ctx.save();
      this.ctx.globalAlpha = mark.style.alpha ?? 1;
      PAINT[mark.kind](this, mark, mark.style);
      this.ctx.restore();
    }
    return true;
  }

  /** Grid, axes, ticks, labels, title, legend and colour scale. */
  furniture(plan, wide, heading, scale) {
    const { ctx, theme, box } = this;
    const { line, small } = plan;
    const font = this.size(10.5);
    const [right, foot] = [box.left + box.width, box.top + box.height];
    const rule = (colour, ...ends) => {
      ctx.strokeStyle = colour;
      ctx.lineWidth = 1;
      ctx.beginPath();
      for (const [x0, y0, x1, y1] of ends) (ctx.moveTo(x0, y0), ctx.lineTo(x1, y1));
      ctx.stroke();
    };
    const [xs, ys] = [plan.x.map((t) => this.at(t.at, 1)[0]), plan.y.map((t) => this.at(1, t.at)[1])];
    rule(theme.faint, ...xs.map((x) => [x, box.top, x, foot]), ...ys.map((y) => [box.left, y, right, y]));
    rule(theme.axis, [box.left, box.top, box.left, foot], [box.left, foot, right, foot]);
    const text = { size: small, colour: theme.ink };
    plan.x.forEach((t, k) => this.write(t.words, xs[k], foot + 0.3 * small, { ...text, ha: "center", va: "top" }));
    plan.y.forEach((t, k) => this.write(t.words, box.left - 0.4 * font, ys[k], { ...text, ha: "right", va: "center" }));
    const below = foot + (plan.x.length ? line : 0.2 * font);
    const label = { size: font, colour: theme.ink, ha: "center" };
    plan.xlabel.forEach((w, k) => {
      const half = this.width(w, font) / 2;
      const middle = Math.min(Math.max(box.left + box.width / 2, half), wide - half);
      this.write(w, middle, below + (k + 0.2) * line, { ...label, va: "top" });
    });
    const upright = (lines, x) =>
      lines.forEach((w, k) => {
        ctx.save();
        ctx.translate(x + (k + 0.8) * line, box.top + box.height / 2);
        ctx.rotate(-Math.PI / 2);
        this.write(w, 0, 0, label);
        ctx.restore();
      });
    const labels = Math.max(0, ...plan.y.map((t) => this.width(t.words, small)));
    upright(plan.ylabel, Math.max(0, box.left - 0.7 * font - labels - plan.ylabel.length * line));
    const head = box.top - 0.35 * font - (plan.together ? 0 : plan.rows.length * line);
    plan.titles.forEach((w, k) => {
      const y = head - (plan.titles.length - 1 - k) * line;
      const colour = heading ? theme.colour(heading.style.color) : theme.ink;
      const left = Math.max(0, Math.min(box.left, wide - this.width(w, font, true)));
      this.write(w, left, y, { size: font, bold: (heading?.style.bold ?? true) !== false, colour });
    });
    plan.rows.forEach(({ entries, room }, k) => {
      const left = Math.max(0, Math.min(right, wide) - room);
      const y = box.top - 0.35 * font - (plan.rows.length - 1 - k) * line;
      for (const { words, style, at } of entries) {
        const points = [left + at, y - 0.32 * small, left + at + 1.8 * font, y - 0.32 * small];
        ctx.save();
        ctx.globalAlpha = style.alpha ?? 1;
        stroke(this, points, style);
        ctx.restore();
        this.write(words, left + at + 2.2 * font, y, text);
      }
    });
    if (!scale) return;
    const [{ levels, light: pale, dark }] = scale;
    const colours = theme.dark ? dark : pale;
    const bar = right + 0.8 * font;
    colours.forEach((colour, k) => {
      const [low, high] = [k, k + 1].map((j) => foot - (box.height * j) / colours.length);
      ctx.fillStyle = colour;
      ctx.fillRect(bar, high, 0.9 * font, low - high + 0.5);
      this.write(plan.numbers[k + 1].words, bar + 1.2 * font, high, { ...text, va: k + 1 < levels.length - 1 ? "center" : "top" });
    });
    this.write(plan.numbers[0].words, bar + 1.2 * font, foot, { ...text, va: "bottom" });
    upright(plan.bar, bar + 1.3 * font + Math.max(...plan.numbers.map((t) => this.width(t.words, small))));
  }
}

// ---------------------------------------------------------------- marks

/** A path through pixels x0, y0, x1, y1, ...; numbers that are not finite lift the pen. */
function trace(ctx, points, closed = false) {
  ctx.beginPath();
  let down = false;
  for (let k = 0; k < points.length; k += 2) {
    if (Number.isFinite(points[k] + points[k + 1])) {
      if (down) ctx.lineTo(points[k], points[k + 1]);
      else ctx.moveTo(points[k], points[k + 1]);
      down = true;
    } else {
      if (closed && down) ctx.closePath();
      down = false;
    }
  }
  if (closed && down) ctx.closePath();
}

function stroke({ ctx, theme }, points, style, closed = false) {
  const width = style.width * POINT;
  if (!(width > 0) || !style.color) return;
  Object.assign(ctx, { lineWidth: width, strokeStyle: theme.colour(style.color), lineCap: style.cap ?? "butt", lineJoin: "round" });
  ctx.setLineDash((style.dash ?? []).map((d) => d * width));
  trace(ctx, points, closed);
  ctx.stroke();
  ctx.setLineDash([]);
}

function pixels(panel, points) {
  const out = new Float64Array(points.length);
  for (let k = 0; k < points.length; k += 2) [out[k], out[k + 1]] = panel.at(points[k], points[k + 1]);
  return out;
}

function clip({ ctx, box }, margin = 0) {
  ctx.beginPath();
  ctx.rect(box.left - margin, box.top - margin, box.width + 2 * margin, box.height + 2 * margin);
  ctx.clip();
}

function marker({ ctx, theme }, x, y, style) {
  const r = (style.size * POINT) / 2;
  ctx.beginPath();
  if (style.marker === "o") ctx.arc(x, y, r, 0, 2 * Math.PI);
  else if (style.marker === "s") ctx.rect(x - r, y - r, 2 * r, 2 * r);
  else if (style.marker === "D") trace(ctx, [x - 1.3 * r, y, x, y - 1.3 * r, x + 1.3 * r, y, x, y + 1.3 * r], true);
  const [a, b] = style.marker === "x" ? [r, r] : [r, 0];
  if ("x+".includes(style.marker)) trace(ctx, [x - a, y - b, x + a, y + b, NaN, 0, x + b, y - a, x - b, y + a]);
  else {
    ctx.fillStyle = theme.colour(style.face, true);
    ctx.fill();
  }
  Object.assign(ctx, { strokeStyle: theme.colour(style.color), lineWidth: style.edge * POINT });
  ctx.stroke();
}

function patch(panel, mark, style) {
  const { ctx, theme } = panel;
  const points = pixels(panel, mark.points);
  clip(panel);
  trace(ctx, points, true);
  if (style.face) {
    ctx.fillStyle = theme.colour(style.face, true);
    ctx.fill("evenodd");
  }
  stroke(panel, points, style, true);
}

function words(panel, mark, style) {
  const { box, theme } = panel;
  const [x, y] = mark.points;
  const inside = mark.kind === "words";
  const [px, py] = inside ? [box.left + x * box.width, box.top + (1 - y) * box.height] : panel.at(x, y);
  if (!inside && (px < box.left - 1 || px > box.left + box.width + 1 || py < box.top - 1 || py > box.top + box.height + 1)) return;
  const size = panel.size(style.size);
  const look = { ...style, size, colour: theme.colour(style.color), halo: style.color === "#ffffff" ? null : theme.paper };
  const wide = panel.width(mark.words, size, style.bold);
  const left = px - wide * { left: 0, center: 0.5, right: 1 }[style.ha ?? "left"];
  // Words that would cover others step aside, away from what they name.
  const down = style.va === "top" ? 1 : -1;
  const hit = (up) => panel.taken.some(([a, b, c, d]) => left < c && left + wide > a && py + up < d + size && py + up + size > b + size && b < d);
  let up = 0;
  while (Math.abs(up) < 3 * size && hit(up)) up += down * 0.5 * size;
  panel.taken.push(panel.write(mark.words, px, py + up, look));
}

/** A map in classes: bilinear between its samples, decided anew at every pixel of the screen. */
function image(panel, mark) {
  const { ctx, box, ratio, theme } = panel;
  const [key, palette] = mark.words;
  const source = mark.images[key];
  const [x0, x1, y0, y1] = source.extent;
  const [left, top] = panel.at(x0, y1).map((v) => Math.floor(v * ratio));
  const [right, foot] = panel.at(x1, y0).map((v) => Math.ceil(v * ratio));
  const [w, h] = [right - left, foot - top];
  const now = [key, w, h, theme.dark].join();
  if (panel.map.key !== now) {
    const { rows, columns, values } = source;
    const canvas = Object.assign(document.createElement("canvas"), { width: w, height: h });
    const picture = canvas.getContext("2d").createImageData(w, h);
    const out = new Uint32Array(picture.data.buffer);
    const colours = (theme.dark ? palette.dark : palette.light).map(rgb).map(([r, g, b]) => ((255 << 24) | (b << 16) | (g << 8) | r) >>> 0);
    const levels = palette.levels;
    const place = (k, n, count) => Math.min(Math.max(((k + 0.5) / n) * count - 0.5, 0), count - 1.000001);
    for (let j = 0, k = 0; j < h; j++) {
      const v = place(h - 1 - j, h, rows);
      const [row, b] = [Math.floor(v) * columns, v - Math.floor(v)];
      for (let i = 0; i < w; i++) {
        const u = place(i, w, columns);
        const at = row + Math.floor(u);
        const a = u - Math.floor(u);
        const below = values[at] + a * (values[at + 1] - values[at]);
        const over = values[at + columns] + a * (values[at + columns + 1] - values[at + columns]);
        const value = below + b * (over - below);
        while (k < colours.length - 1 && value >= levels[k + 1]) k++;
        while (k > 0 && value < levels[k]) k--;
        if (value === value) out[j * w + i] = colours[k];
      }
    }
    canvas.getContext("2d").putImageData(picture, 0, 0);
    panel.map = { key: now, canvas };
  }
  clip(panel);
  if (mark.points.length) {
    trace(ctx, pixels(panel, mark.points), true);
    ctx.clip("evenodd");
  }
  ctx.drawImage(panel.map.canvas, left / ratio, top / ratio, w / ratio, h / ratio);
}

const PAINT = {
  line(panel, mark, style) {
    const points = pixels(panel, mark.points);
    clip(panel, style.marker ? 8 : 0);
    stroke(panel, points, style);
    for (let k = 0; style.marker && k < points.length; k += 2) marker(panel, points[k], points[k + 1], style);
  },
  polygon: patch,
  bar: patch,
  label: words,
  words,
  image,
};

// ---------------------------------------------------------------- handles

/** Distance of a pixel from the segment between two pixels. */
function distance([x, y], [ax, ay], [bx, by]) {
  const length = (bx - ax) ** 2 + (by - ay) ** 2;
  const t = length ? Math.min(Math.max(((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length, 0), 1) : 0;
  return Math.hypot(x - ax - t * (bx - ax), y - ay - t * (by - ay));
}

/** What the controls of a handle must be for it to stand at (x, y) in data. */
export function wish(handle, x, y) {
  if (!handle.track) return Object.fromEntries(Object.entries(handle.set).map(([k, [a, b, c]]) => [k, a * x + (b ? b * y : 0) + c]));
  let [best, place] = [Infinity, 0];
  for (let k = 0; k + 3 < handle.track.length; k += 2) {
    const [ax, ay, bx, by] = handle.track.subarray(k, k + 4);
    const length = (bx - ax) ** 2 + (by - ay) ** 2;
    const t = length ? Math.min(Math.max(((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length, 0), 1) : 0;
    const gap = Math.hypot(x - ax - t * (bx - ax), y - ay - t * (by - ay));
    if (gap < best) [best, place] = [gap, k / 2 + t];
  }
  const k = Math.min(Math.floor(place), handle.track.length / 2 - 2);
  return Object.fromEntries(Object.entries(handle.set).map(([name, v]) => [name, v[k] + (place - k) * (v[k + 1] - v[k])]));
}

/** Steps of the controls for an arrow key. */
export function steps(handle, key, shift) {
  const way = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[key];
  if (!way) return null;
  const free = handle.track || handle.at[1] === null;
  const count = (by) => (free ? way[0] + way[1] : Math.sign(by[0]) * way[0] + Math.sign(by[1]) * way[1]) * (shift ? 10 : 1);
  const moves = Object.entries(handle.set).map(([name, by]) => [name, count(by)]);
  return Object.fromEntries(moves.filter(([, n]) => n));
}

// ---------------------------------------------------------------- the whole picture

function make(tag, properties = {}, parent = null) {
  const { data = {}, ...rest } = properties;
  const el = Object.assign(document.createElement(tag), rest);
  for (const [name, value] of Object.entries(data)) el.setAttribute(name, value);
  return parent ? parent.appendChild(el) : el;
}

/** Words with true subscripts as children of an element. */
function rich(el, words) {
  el.replaceChildren(...pieces(words).map(({ text, shift }) => (shift ? make("sub", { textContent: text }) : text)));
  return el;
}

/** Show a picture in `el`; returns a function that takes it away. */
export function mount(el, scene, link) {
  const me = Math.random().toString(36).slice(2);
  const root = make("div", { className: "rapkm", data: { role: "group", "aria-label": scene.about || scene.name || "picture", "data-drawn": 0 } }, el);
  const stage = make("div", { className: "rapkm-panels" }, root);
  const problem = make("p", { className: "rapkm-problem", hidden: true }, stage);
  const numbers = make("p", { className: "rapkm-numbers" }, root);
  const foot = make("p", { className: "rapkm-foot" }, root);
  const copy = make("button", { type: "button", textContent: "copy this setting" }, foot);
  const note = make("span", { className: "rapkm-note", data: { role: "status" } }, foot);
  const sentence = make("p", { className: "rapkm-sentence", data: { "aria-live": "polite" } }, root);
  copy.hidden = scene.code === false;
  const columns = scene.layout[0].length;
  const panels = Object.fromEntries(Object.entries(scene.panels).map(([name, spec]) => [name, new Panel(name, spec)]));
  stage.style.setProperty("--areas", scene.layout.map((row) => `"${row.join(" ")}"`).join(" "));
  stage.style.setProperty("--columns", scene.widths.map((w) => `minmax(0, ${w}fr)`).join(" "));
  stage.style.setProperty("--shape", scene.size.join(" / "));
  for (const { el, name, spec } of Object.values(panels)) {
    el.style.gridArea = name;
    if (spec.small) el.classList.add("small");
    if (spec.aspect === "equal") el.classList.add("square");
    stage.append(el);
  }
  const known = { styles: {}, images: {} };
  const state = { fixed: [], marks: [], handles: [], frames: null, places: {}, code: "", drawn: 0 };
  let theme = themeOf(root);

  function paint() {
    if (!state.frames || !root.clientWidth) return;
    root.classList.toggle("narrow", root.clientWidth < NARROW);
    root.classList.toggle("dark", theme.dark);
    const look = getComputedStyle(root);
    const floor = parseFloat(look.getPropertyValue("--least")) || 12;
    for (const panel of Object.values(panels)) {
      const marks = [...state.fixed, ...state.marks].filter((m) => m.panel === panel.name);
      panel.paint(theme, state.frames[panel.name], marks, parseFloat(look.fontSize), floor, look.fontFamily);
    }
    knobs();
  }

  // Handles: one focusable knob each; what the hand wishes waits until fewer than AFLOAT answers are due.
  const knobEls = [];
  function knobs() {
    state.handles.forEach((handle, k) => {
      const panel = panels[handle.panel];
      const knob = (knobEls[k] ??= make("div", { className: "rapkm-knob", tabIndex: 0, data: { role: "slider", "data-lm-suppress-shortcuts": "true" } }));
      if (knob.parentElement !== panel.el) panel.el.append(knob);
      const bare = handle.at[1] === null;
      const [x, y] = panel.at(handle.at[0], bare ? state.frames[handle.panel][2] : handle.at[1]);
      knob.style.translate = `${x}px ${y}px`;
      knob.hidden = !(panel.box && x > -9 && y > -9 && x < panel.el.clientWidth + 9 && y < panel.el.clientHeight + 9);
      knob.classList.toggle("scrub", bare);
      const names = Object.keys(handle.set);
      const label = names.map((name) => scene.labels?.[name] ?? name);
      knob.setAttribute("aria-label", `${label.join(" and ")}, in the picture`);
      knob.setAttribute("aria-valuenow", state.places[names[0]] ?? 0);
      knob.setAttribute("aria-valuetext", names.map((name, j) => `${label[j]}: ${state.places[name]}`).join(", "));
      knob.onkeydown = (event) => {
        const by = steps(handle, event.key, event.shiftKey);
        if (!by) return;
        event.preventDefault();
        event.stopPropagation();
        ask({}, by);
      };
    });
    knobEls.slice(state.handles.length).forEach((knob) => (knob.hidden = true));
  }

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
    if (open.size >= AFLOAT || !(Object.keys(waiting.to).length + Object.keys(waiting.by).length)) return;
    open.set(++seq, performance.now());
    const wishes = waiting;
    waiting = { to: {}, by: {} };
    link.send({ kind: "grab", from: me, seq, ...wishes });
    setTimeout(pump, PATIENCE + 50);
  }

  const say = (words) => (note.textContent = words);

  function receive(message, buffers = []) {
    if (message.kind === "lost" || message.kind === "picture") {
      if (message.from === me) open.delete(message.seq);
    }
    if (message.kind === "fixed" || message.kind === "picture") {
      const { marks, handles } = decode(message, buffers, known);
      for (const mark of marks) {
        mark.images = known.images;
        // Legends and scales name the styles of their entries.
        if (mark.kind === "legend") mark.words = mark.words.map(([w, s]) => [w, typeof s === "object" ? s : known.styles[s]]);
      }
      state.frames = message.frames;
      if (message.kind === "fixed") state.fixed = marks;
      else answer(message, marks, handles);
    }
    pump();
  }

  let rest = 0;
  function answer(message, marks, handles) {
    Object.assign(state, { marks, places: message.places ?? {}, code: message.code ?? "" });
    // While there is a problem the last handles stay, as the way back.
    if (handles.length || !message.problem) state.handles = handles;
    problem.textContent = message.problem ?? "";
    problem.hidden = !message.problem;
    numbers.replaceChildren(
      ...(message.numbers ?? []).map(([name, text]) => {
        const span = rich(make("span"), `${minus(name)}: `);
        rich(make("b", {}, span), minus(text));
        return span;
      }),
    );
    say(message.note ?? "");
    root.classList.add("live");
    paint();
    root.dataset.drawn = ++state.drawn;
    root.dataset.places = JSON.stringify(state.places);
    clearTimeout(rest);
    rest = setTimeout(() => (sentence.textContent = message.sentence ?? ""), 700);
    nameControls();
  }

  // Taking hold: the knob or line that is nearest, else a line that is pushed along the panel.
  let held = null;
  function under(panel, event) {
    const area = panel.el.getBoundingClientRect();
    const at = [event.clientX - area.left, event.clientY - area.top];
    const reach = event.pointerType === "mouse" ? 1 : 1.6;
    let best = null;
    for (const handle of panel.box ? state.handles : []) {
      if (handle.panel !== panel.name) continue;
      const bare = handle.at[1] === null;
      const spot = bare ? [panel.at(handle.at[0], 1)[0], at[1]] : panel.at(...handle.at);
      const gaps = [Math.hypot(at[0] - spot[0], at[1] - spot[1]) / 24];
      if (handle.grip) gaps.push(distance(at, ...handle.grip.map((p) => panel.at(...p))) / 14);
      const gap = bare ? 0.99 : Math.min(...gaps) / reach;
      if (gap < 1 && !(best && best.gap <= gap)) best = { handle, gap, at, off: bare ? [0, 0] : [spot[0] - at[0], spot[1] - at[1]] };
    }
    return best;
  }
  for (const panel of Object.values(panels)) {
    const move = (event) => {
      if (!held || held.panel !== panel) return;
      const area = panel.el.getBoundingClientRect();
      const at = [event.clientX - area.left + held.off[0], event.clientY - area.top + held.off[1]];
      ask(wish(held.handle, ...panel.data(at)));
    };
    panel.el.addEventListener("pointerdown", (event) => {
      const found = event.button === 0 && under(panel, event);
      if (!found) return;
      event.preventDefault();
      held = { panel, ...found };
      panel.el.setPointerCapture(event.pointerId);
      knobEls[state.handles.indexOf(found.handle)]?.focus({ preventScroll: true });
      root.classList.add("held");
      if (found.handle.at[1] === null) move(event);
    });
    panel.el.addEventListener("pointermove", (event) => {
      if (held) move(event);
      else panel.el.style.cursor = under(panel, event) ? "grab" : "";
    });
    for (const name of ["pointerup", "pointercancel", "lostpointercapture"])
      panel.el.addEventListener(name, () => {
        held = null;
        root.classList.remove("held");
      });
    // A finger that takes hold does not scroll the page.
    panel.el.addEventListener("touchstart", (event) => {
      if (under(panel, { ...event.touches[0], clientX: event.touches[0].clientX, clientY: event.touches[0].clientY })) event.preventDefault();
    }, { passive: false });
  }

  copy.onclick = async () => {
    try {
      await navigator.clipboard.writeText(state.code);
      say(`copied: ${state.code}`);
    } catch {
      say(state.code);
    }
  };

  // Controls beside the picture: names for readers of the screen, true subscripts, a word when a number is rounded.
  const box = el.closest(".rapkm-explorer");
  function nameControls() {
    for (const control of box?.querySelectorAll(".rapkm-control:not([data-named])") ?? []) {
      const label = control.querySelector(".widget-label");
      const parts = control.querySelectorAll(".noUi-handle, .ui-slider-handle, .widget-readout, select, input");
      if (!parts.length) continue;
      const words = label?.textContent || control.textContent.trim();
      parts.forEach((part) => part.setAttribute("aria-label", words));
      if (label && words.includes("_")) rich(label, words);
      control.dataset.named = "";
    }
  }

  // Theme and size.  A new style sheet may come late, so colours are looked up again for a while.
  const look = () => {
    theme = themeOf(root);
    paint();
  };
  let later = [];
  const watch = new MutationObserver(() => {
    later.forEach(clearTimeout);
    later = [0, 300, 1200].map((ms) => setTimeout(look, ms));
  });
  for (const node of [document.documentElement, document.body])
    watch.observe(node, { attributes: true, attributeFilter: ["class", "data-theme", "data-jp-theme-light", "data-jp-theme-name"] });
  const sizes = new ResizeObserver(paint);
  [root, ...Object.values(panels).map((p) => p.el)].forEach((node) => sizes.observe(node));
  const dark = matchMedia("(prefers-color-scheme: dark)");
  dark.addEventListener("change", look);
  window.addEventListener("resize", paint);
  if (el.closest(".rapkm-screen")) document.addEventListener("keydown", page, true);
  link.receive(receive);
  link.send({ kind: "hello" });
  return Object.assign(
    () => {
      watch.disconnect();
      sizes.disconnect();
      dark.removeEventListener("change", look);
      window.removeEventListener("resize", paint);
      root.remove();
    },
    { say },
  );
}

/** Page up and page down turn the screens of a dashboard, also while a slider has the focus. */
function page(event) {
  const way = { PageDown: 1, PageUp: -1 }[event.key];
  const screens = [...document.querySelectorAll(".rapkm-screen")];
  if (!way || !screens.length) return;
  event.preventDefault();
  event.stopPropagation();
  const tops = screens.map((s) => s.getBoundingClientRect().top);
  const now = tops.findLastIndex((top) => top < innerHeight / 2);
  const next = screens[Math.min(Math.max(now + way, 0), screens.length - 1)];
  next.scrollIntoView({ block: "start" });
  next.focus({ preventScroll: true });
}

export default {
  render({ model, el }) {
    const link = {
      send: (message) => model.send(message),
      receive: (callback) => model.on("msg:custom", (message, buffers) => callback(message, buffers)),
    };
    const leave = mount(el, model.get("scene"), link);
    model.on("comm_live_update", () => leave.say("The kernel has gone: run the cell again."));
    return leave;
  },
};
