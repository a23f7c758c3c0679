// A picture of recorded marks on canvases, and handles to take it by.  One module, nothing to build, no dependency.
// mount(el, scene, link) shows a picture; scene = {panels, layout, widths, size, name, about, labels, ranges, code};
// link = {send(message), receive(callback(message, buffers))} reaches whoever computes, a kernel or a script.
//   to it:   {kind: "hello" | "still"} | {kind: "grab", from, seq, to: {control: value}, by: {control: steps}}
//   from it: {kind: "fixed" | "picture" | "lost", from?, seq?, marks, styles, images, frames, handles, numbers, ...}
// A mark is [kind, panel, style, points, words?]: style a number in `styles` or an object, points how many pairs of the
// first buffer, or an array of numbers.  Lengths in styles are points (1/72 inch), colours "#rrggbb" for white paper.
const POINT = 96 / 72;
const PATIENCE = 5000; // ms after which nobody waits for an answer: the kernel is busy, or another one
const AFLOAT = 2; // questions under way at the same time: three are no faster and lag more
const ENTER = { key: "Enter", keyCode: 13, bubbles: true };

/** True minus signs before numbers, not in words with a hyphen. */
export const minus = (words) => String(words).replace(/(^|[\s([/])-(?=\.?\d)/g, "$1−");
export const WHOLE = /((?:[\d.]+ )?m?N m\b\S*(?: s\b\S*)?|[\d.]+ (?:[%‰]|(?:k?g|Hz|[mµ]?(?:[NmJWs]|rad))\b\S*))/u;

/** "σ_min" and "10^−3" as pieces {text, shift}: shift -1 is a subscript, 1 a superscript. */
export function pieces(words) {
  return String(words).split(/([_^][\p{L}\p{N}−]+)/u).filter(Boolean).map((part) => {
    const shift = part.length > 1 ? ({ _: -1, "^": 1 }[part[0]] ?? 0) : 0;
    return { text: shift ? part.slice(1) : part, shift };
  });
}

/** About `most` ticks {at, words} between two limits, in steps of 1, 2, 2.5, 5; decades on a logarithmic axis. */
export function ticks(low, high, most = 6, log = false) {
  const [start, end] = log ? [Math.log10(low), Math.log10(high)] : [low, high], far = Math.max(-start, end);
  if (!(end - start > Math.max(1e-12 * far, 1e-10)) || !(far < 1e21)) return []; // no digits tell them apart
  const least = Math.max((end - start) / Math.max(most, 1), log ? 1 : 0), decade = 10 ** Math.floor(Math.log10(least));
  const step = log ? Math.ceil(least) : [1, 2, 2.5, 5, 10].find((s) => s * decade >= least * (1 - 1e-9)) * decade;
  const digits = step.toFixed(12).replace(/0+$/, "").split(".")[1].length, out = [];
  for (let k = Math.ceil(start / step - 1e-9); k <= Math.floor(end / step + 1e-9); k++) {
    const words = minus((k * step || 0).toFixed(digits));
    out.push(log ? { at: 10 ** (k * step), words: `10^${words}` } : { at: k * step, words });
  }
  return out;
}

/** The marks of a message; `known` = {styles, images} keeps what is sent only once. */
export function decode(message, buffers, known) {
  Object.assign(known.styles, message.styles);
  const floats = buffers.map((b) => new Float32Array(b.buffer?.slice(b.byteOffset, b.byteOffset + b.byteLength) ?? b));
  for (const [k, [key, [rows, columns, ...extent]]] of Object.entries(message.images ?? {}).entries())
    known.images[key] = { rows, columns, extent, values: floats[k + 1] };
  let at = 0;
  const style = (s) => (typeof s === "object" ? s : known.styles[s]) ?? {};
  return message.marks.map(([kind, panel, s, count, words]) => {
    const points = Array.isArray(count) ? Float32Array.from(count) : (floats[0]?.subarray(at, (at += 2 * count)) ?? []);
    if (kind === "legend") words = words.map(([text, entry]) => [text, style(entry)]);
    return { kind, panel, style: style(s), points, words, images: known.images };
  });
}

/** The box of a panel in its canvas, what lies around it, how many pixels a point has, how far the box is aside. */
export function layout(spec, scale, [x0, x1, y0, y1], [wide, high], font, width) {
  const fixed = (values) => Array.from(values ?? [], (v) => ({ at: v, words: minus(v) }));
  const widest = (list) => Math.max(0, ...list.map((t) => width(t.words)));
  const top = 0.7 * font, bottom = spec.xticks?.length === 0 ? top : 1.6 * font;
  const tall = Math.max(high - top - bottom, 10), most = Math.min(Math.max(Math.floor(tall / (2.2 * font)), 3), 7);
  const y = spec.yticks ? fixed(spec.yticks) : ticks(y0, y1, most, spec.yscale === "log");
  // At least four digits have room, so that the box seldom moves while a control does.
  const left = y.length ? Math.max(widest(y), width("−100")) + 0.6 * font : top;
  const levels = fixed(scale?.levels), room = scale ? 2.1 * font + widest(levels) : 1.2 * font;
  const box = { left, top, width: Math.max(wide - left - room, 10), height: tall };
  if (spec.aspect === "equal") {
    const per = Math.min(box.width / (x1 - x0), tall / (y1 - y0)), width = per * (x1 - x0), height = per * (y1 - y0);
    Object.assign(box, { left: left + (box.width - width) / 2, top: top + tall - height, width, height });
  }
  const fits = (list) => list.length * (widest(list) + 0.6 * font) < box.width;
  const tried = [8, 6, 5, 4, 3, 2].map((count) => ticks(x0, x1, count)).filter((list) => list.length > 1);
  const x = spec.xticks ? fixed(spec.xticks) : (tried.find(fits) ?? tried.at(-1)?.slice(-2) ?? []); // one is no scale
  const right = box.left + box.width, foot = box.top + box.height, thin = spec.small ? Math.min(box.width / 120, 1) : 1;
  const up = spec.yscale === "log" ? (y) => Math.log(y / y0) / Math.log(y1 / y0) : (y) => (y - y0) / (y1 - y0);
  const at = (x, y) => [box.left + (box.width * (x - x0)) / (x1 - x0), box.top + box.height * (1 - up(y))];
  const texts = [], put = (words, x, y, ha, va) => texts.push({ words, x, y, size: font, color: "ink", ha, va });
  const strokes = [], rule = (color, ...points) => strokes.push([{ color, width: 0.75 }, points]);
  for (const t of x) {
    const [px] = at(t.at, y0);
    rule("faint", px, box.top, px, foot);
    put(t.words, px, foot + 0.2 * font, "center", "top");
  }
  for (const t of y) {
    const [, py] = at(x0, t.at);
    rule("faint", box.left, py, right, py);
    put(t.words, box.left - 0.4 * font, py, "right", "center");
  }
  if (x.length) rule("axis", box.left, box.top, box.left, foot, right, foot);
  const step = box.height / Math.max(levels.length - 1, 1), bar = [right + 0.6 * font, foot, 0.9 * font, step];
  levels.forEach((level, k) => put(level.words, bar[0] + 1.2 * font, foot - k * step, "left", "center"));
  return { box, at, texts, strokes, bar, point: POINT * thin, aside: [box.left - left, (box.top - top) / 2] };
}

const remade = (object, change) => Object.fromEntries(Object.entries(object).map(([name, v]) => [name, change(v)]));
const rgb = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16));
const css = (c) => `rgb(${c.join()})`, mix = (a, b, share) => a.map((v, k) => Math.round(v + share * (b[k] - v)));
const shine = (c) => [0.2126, 0.7152, 0.0722].reduce((sum, w, k) => sum + w * ((c[k] / 255 + 0.055) / 1.055) ** 2.4, 0);
const contrast = (a, b) => (Math.max(shine(a), shine(b)) + 0.05) / (Math.min(shine(a), shine(b)) + 0.05);

/** The colours of paper and ink of an element, and how a colour meant for white paper looks on it. */
export function themeOf(el) {
  const paper = getComputedStyle(el).backgroundColor.match(/[\d.]+/g).slice(0, 3).map(Number);
  const dark = shine(paper) < 0.3, ink = dark ? [235, 235, 235] : [34, 34, 34];
  const tones = remade({ paper: 0, faint: 0.13, axis: 0.6, ink: 1 }, (share) => css(mix(paper, ink, share)));
  const colour = (hex, fill = false) => {
    if (!hex || !dark || tones[hex]) return tones[hex] ?? hex;
    let c = rgb(hex);
    if (shine(c) > 0.95 || shine(c) < 0.02) return shine(c) > 0.95 ? tones.paper : tones.ink;
    if (fill && shine(c) > 0.6) return css(mix(paper, c, 0.16));
    if (new Set(c).size === 1) c = mix(ink, paper, Math.min(c[0] / 255, 0.5)); // a darker grey is brighter
    while (contrast(c, paper) < (fill ? 3 : 4.5)) c = mix(c, [255, 255, 255], 0.15);
    return css(c);
  };
  return { dark, colour };
}

const SHARE = { left: 0, center: 0.5, right: 1 }, DROP = { baseline: 0, bottom: -0.35, center: 0.36, top: 1.05 };

class Panel {
  constructor(name, spec, parent) {
    Object.assign(this, { name, spec, map: {} });
    this.el = make("div", { className: `rapkm-panel ${spec.small ? "small" : ""} ${spec.aspect ?? ""}` }, parent);
    this.el.style.gridArea = name;
    for (const part of ["head", "ylabel", "plot", "scale", "xlabel"])
      this[part] = rich(make("div", { className: `rapkm-${part}` }, this.el), spec[part]);
    this.heading = make("b", {}, this.head);
    this.canvas = make("canvas", { role: "img", ariaLabel: (!spec.aspect && spec.ylabel) || name }, this.plot);
    this.ctx = this.canvas.getContext("2d");
  }

  /** Title and legend are words of the page, which wrap by themselves; written anew only when they change. */
  entitle({ words = this.spec.title, style: { color, bold = true } = {} } = {}, legend = []) {
    const { theme, heading, canvas } = this;
    if (heading.words !== words)
      canvas.ariaLabel = rich(heading, (heading.words = words)).textContent.trim() || canvas.ariaLabel;
    Object.assign(heading.style, { color: theme.colour(color) ?? "", fontWeight: bold ? 700 : 400 });
    if (this.told === (this.told = JSON.stringify([legend, theme.dark]))) return;
    this.head.replaceChildren(heading, make("div"));
    this.head.lastChild.append(...legend.map(([words, { color, width, dash, alpha }]) => {
      const entry = rich(make("span"), words), ink = theme.colour(color, width > 5), w = width * POINT;
      const look = `stroke="${ink}" stroke-width="${w}" stroke-dasharray="${dash.map((d) => d * w).join(" ")}"`;
      entry.insertAdjacentHTML("afterbegin", `<svg><line x2="26" y1="5" y2="5" ${look} opacity="${alpha}"/></svg>`);
      return entry;
    }));
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
  write({ words, x, y, size, color, bold = false, ha, va, halo = false }) {
    const { ctx, theme } = this, left = x - this.pieces(words, size, bold) * SHARE[ha], foot = y + size * DROP[va];
    Object.assign(ctx, { strokeStyle: theme.colour("paper"), fillStyle: theme.colour(color), lineWidth: 5 });
    for (const way of halo ? ["strokeText", "fillText"] : ["fillText"])
      this.pieces(words, size, bold, (text, at, up) => ctx[way](text, left + at, foot - up));
  }

  /** Paint marks; `look` = {theme, base, floor, family} says how. */
  paint(look, frame, marks) {
    const { ctx, canvas, room: [wide, high] } = this, { theme } = look;
    const last = (kind) => marks.findLast((mark) => mark.kind === kind);
    Object.assign(this, { frame, look, theme, taken: [] });
    const [palette, label] = last("scale")?.words ?? [];
    if (label && !this.scale.textContent) rich(this.scale, label);
    this.entitle(last("title"), last("legend")?.words);
    if (!wide || !high || !frame) return;
    const ratio = (this.ratio = devicePixelRatio || 1), [width, height] = this.room.map((v) => Math.round(v * ratio));
    // Setting a size blanks a canvas, so only when it is another; stretched by part of a pixel it is blurred.
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    [canvas.style.width, canvas.style.height] = [width, height].map((v) => `${v / ratio}px`);
    this.size = (points) => Math.max((points / 10.5) * look.base, look.floor);
    const font = 0.92 * this.size(10.5);
    const plan = layout(this.spec, palette, frame, [wide, high], font, (words) => this.pieces(words, font));
    const { box, bar: [x, y, w, h], aside } = Object.assign(this, plan);
    [this.ylabel, this.head].forEach((e, k) => (e.style.translate = `${k ? 0 : aside[0]}px ${aside[1] * (k + 1)}px`));
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0), ctx.clearRect(0, 0, wide, high);
    for (const [style, points] of plan.strokes) stroke(this, points, style);
    for (const text of plan.texts) this.write(text);
    const colours = palette?.[theme.dark ? "dark" : "light"] ?? [];
    colours.forEach((fillStyle, k) => Object.assign(ctx, { fillStyle }).fillRect(x, y - (k + 1) * h, w, h + 0.5));
    for (const mark of marks.filter((m) => PAINT[m.kind]).sort((a, b) => a.style.z - b.style.z)) {
      ctx.save();
      ctx.globalAlpha = mark.style.alpha ?? 1;
      const more = PAINT[mark.kind] === words ? wide : mark.style.marker ? 8 : 0; // markers on the edge are whole
      ctx.beginPath(), ctx.rect(box.left - more, box.top - more, box.width + 2 * more, box.height + 2 * more);
      ctx.clip();
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
    down = seen;
  }
  if (closed && down) ctx.closePath();
}

function stroke({ ctx, theme, point }, points, { width, color, cap = "butt", dash = [] }, closed = false) {
  const lineWidth = width * point;
  if (!(lineWidth > 0) || !color) return;
  Object.assign(ctx, { lineWidth, strokeStyle: theme.colour(color), lineCap: cap, lineJoin: "round" });
  ctx.setLineDash(dash.map((d) => d * lineWidth));
  trace(ctx, points, closed);
  ctx.stroke();
}

const pixels = (panel, points) => Float64Array.from(points, (v, k) => panel.at(points[k & ~1], points[k | 1])[k & 1]);
const SHAPES = {
  o: Array.from({ length: 64 }, (_, k) => Math.cos((Math.PI * (k >> 1)) / 16 - (k % 2) * (Math.PI / 2))),
  s: [-1, -1, 1, -1, 1, 1, -1, 1],
  D: [-1.3, 0, 0, -1.3, 1.3, 0, 0, 1.3],
  x: [-1, -1, 1, 1, NaN, NaN, -1, 1, 1, -1],
  "+": [-1, 0, 1, 0, NaN, NaN, 0, -1, 0, 1],
};

function line(panel, { points }, style) {
  const path = pixels(panel, points), { marker, face, color, edge: width } = style, r = (style.size * panel.point) / 2;
  stroke(panel, path, style);
  for (let k = 0; marker && k < path.length; k += 2)
    area(panel, SHAPES[marker].map((v, j) => path[k + (j % 2)] + r * v), { face, color, width });
}

/** Closed rings of pixels, filled and with an edge; of one colour, in the tone of lines. */
function area(panel, path, style, { face, color } = style) {
  trace(panel.ctx, path, true);
  Object.assign(panel.ctx, { fillStyle: panel.theme.colour(face, face !== color) ?? "transparent" }).fill("evenodd");
  stroke(panel, path, style, true);
}

function words(panel, { kind, points, words }, style) {
  const { box } = panel, right = box.left + box.width, foot = box.top + box.height, [u, v] = points;
  const [x, y] = kind === "words" ? [box.left + u * box.width, foot - v * box.height] : panel.at(u, v);
  if (x < box.left - 1 || x > right + 1 || y < box.top - 1 || y > foot + 1) return;
  const size = panel.size(style.size), wide = panel.pieces(words, size, style.bold);
  const left = Math.max(Math.min(x - wide * SHARE[style.ha], panel.room[0] - wide), 0); // on the canvas
  // Words that would cover others step aside, away from what they name.
  const near = ([a, b, c, s], up) => left - 1 < c && left + wide + 1 > a && Math.abs(y + up - b) < 0.6 * (s + size);
  const way = (style.va === "top" ? 0.25 : -0.25) * size;
  let up = 0;
  while (Math.abs(up) < 3 * size && panel.taken.some((t) => near(t, up))) up += way;
  panel.taken.push([left, y + up, left + wide, size]);
  panel.write({ ...style, words, x: left, ha: "left", y: y + up, size, halo: style.color !== "#ffffff" });
}

/** A map in classes: bilinear between its samples, decided anew at every pixel of the screen. */
function image(panel, { points, words: [key, palette], images }) {
  const { rows, columns, extent, values } = images[key], { ctx, ratio, theme } = panel;
  const [left, top] = panel.at(extent[0], extent[3]).map((v) => Math.floor(v * ratio));
  const [width, height] = panel.at(extent[1], extent[2]).map((v, k) => Math.ceil(v * ratio) - [left, top][k]);
  const now = [key, width, height, theme.dark].join();
  if (panel.map.key !== now) {
    const canvas = make("canvas", { width, height }), picture = ctx.createImageData(width, height);
    const out = new Uint32Array(picture.data.buffer), colours = palette[theme.dark ? "dark" : "light"].map(rgb);
    const packed = colours.map(([r, g, b]) => (0xff000000 | (b << 16) | (g << 8) | r) >>> 0);
    const place = (k, n, count) => Math.min(Math.max(((k + 0.5) / n) * count - 0.5, 0), count - 1.000001);
    for (let j = 0; j < height; j++) {
      const v = place(height - 1 - j, height, rows);
      for (let i = 0; i < width; i++) {
        const u = place(i, width, columns), a = u % 1;
        const at = Math.floor(v) * columns + Math.floor(u), over = at + columns;
        const low = values[at] + a * (values[at + 1] - values[at]);
        const value = low + (v % 1) * (values[over] + a * (values[over + 1] - values[over]) - low);
        let level = packed.length - 1;
        while (level > 0 && value < palette.levels[level]) level--;
        if (!Number.isNaN(value)) out[j * width + i] = packed[level];
      }
    }
    canvas.getContext("2d").putImageData(picture, 0, 0);
    panel.map = { key: now, canvas };
  }
  if (points.length) trace(ctx, pixels(panel, points), true), ctx.clip("evenodd");
  ctx.drawImage(panel.map.canvas, left / ratio, top / ratio, width / ratio, height / ratio);
}

const polygon = (panel, { points }, style) => area(panel, pixels(panel, points), style);
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
export function wish({ along, set }, x, y) {
  if (!along) return remade(set, ([a, b, c]) => a * x + (b && b * y) + c);
  const { place } = nearest(along, x, y), k = Math.min(Math.floor(place), along.length / 2 - 2);
  return remade(set, (v) => v[k] + (place - k) * (v[k + 1] - v[k]));
}

/** Steps of its controls for an arrow key (one alone takes all four), ten with shift, or to either end; else null. */
export function steps({ along, set }, key, shift) {
  const [dx, dy] = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[key] ?? [];
  const end = { Home: -1e9, End: 1e9 }[key], alone = Object.keys(set).length === 1; // further than any slider goes
  if (dx === undefined && !end) return null;
  const count = ([a, b]) => end ?? (along ? dx + dy : Math.sign(a || alone * b) * dx + Math.sign(b || alone * a) * dy);
  return Object.fromEntries(Object.entries(remade(set, (v) => (shift ? 10 : 1) * count(v))).filter(([, n]) => n));
}

const make = (tag, properties = {}, parent = new DocumentFragment()) =>
  parent.appendChild(Object.assign(document.createElement(tag), properties));

/** Put words into an element, with true subscripts; units stay with their numbers. */
function rich(el, words = "") {
  const whole = (text) => text.split(WHOLE).map((part, k) => (k % 2 ? make("nobr", { textContent: part }) : part));
  el.replaceChildren(...pieces(words).flatMap((p) => (p.shift ? make("sub", { textContent: p.text }) : whole(p.text))));
  return el;
}

/** Show a picture in `el`; returns a function that takes it away, with `say(words)` for a note below the picture. */
export function mount(el, scene, link) {
  const root = make("div", { className: "rapkm", role: "group", ariaLabel: scene.about || scene.name }, el);
  const stage = make("div", { className: "rapkm-panels" }, root);
  const problem = make("p", { className: "rapkm-problem", hidden: true }, stage);
  const numbers = make("p", { className: "rapkm-numbers" }, root), foot = make("p", { className: "rapkm-foot" }, root);
  const copy = make("button", { type: "button", textContent: "copy this setting", hidden: scene.code === false }, foot);
  const note = make("span", { className: "rapkm-note", role: "status" }, foot);
  const sentence = make("p", { className: "rapkm-sentence", ariaLive: "polite" }, root);
  const say = (text) => (note.textContent = text), around = () => el.closest(".rapkm-explorer");
  stage.style.setProperty("--areas", scene.layout.map((row) => `"${row.join(" ")}"`).join(" "));
  stage.style.setProperty("--columns", scene.widths.map((w) => `minmax(0, ${w}fr)`).join(" "));
  stage.style.setProperty("--shape", scene.size.join(" / "));
  const panels = Object.entries(scene.panels).map(([name, spec]) => new Panel(name, spec, stage));
  const known = { styles: {}, images: {} }, knobs = [], open = new Set(), me = Math.random().toString(36).slice(2);
  const state = { fixed: null, marks: [], handles: [], frames: null, places: {}, drawn: 0 };
  let held = null, rest = 0, seq = 0, waiting = { to: {}, by: {} }, look = null;

  // Sizes and colours are noted when they are new: whoever asks for them at every step lays out the page every time.
  function paint(renewed = !look) {
    if (!state.fixed || (renewed && !root.clientWidth)) return;
    if (renewed) {
      const style = getComputedStyle(root), floor = parseFloat(style.getPropertyValue("--least")) || 12;
      look = { theme: themeOf(root), floor, base: parseFloat(style.fontSize), family: style.fontFamily };
      for (const panel of panels) panel.room = [panel.plot.clientWidth, panel.plot.clientHeight];
    }
    const marks = [...state.fixed, ...state.marks];
    for (const p of panels) p.paint(look, state.frames[p.name], marks.filter((m) => m.panel === p.name));
    state.handles.forEach(knob);
    for (const knob of knobs.slice(state.handles.length)) knob.hidden = true;
  }

  // One focusable knob for each handle.
  function knob(handle, k) {
    const panel = panels.find((p) => p.name === handle.panel), bare = handle.at[1] === null;
    if (!panel.box) return;
    const knob = (knobs[k] ??= make("div", { tabIndex: 0, role: "slider" })), names = Object.keys(handle.set);
    const [x, y] = panel.at(handle.at[0], bare ? panel.frame[2] : handle.at[1]);
    const label = (name) => scene.labels?.[name] ?? name, told = (name) => `${label(name)}: ${state.places[name]}`;
    if (knob.parentElement !== panel.plot) panel.plot.append(knob);
    const ariaLabel = `${names.map(label).join(" and ")}, in the picture`, ariaValueNow = state.places[names[0]];
    const className = `rapkm-knob ${bare ? "bare" : ""}`, ariaValueText = minus(names.map(told).join(", "));
    const [ariaValueMin, ariaValueMax] = scene.ranges?.[names[0]] ?? [null, null];
    Object.assign(knob, { className, ariaLabel, ariaValueNow, ariaValueMin, ariaValueMax, ariaValueText, hidden: 0 });
    // JupyterLab takes arrow keys from whatever has the focus without this word.
    knob.dataset.lmSuppressShortcuts = "true";
    knob.style.translate = `${bare ? Math.max(x, panel.box.left + 9) : x}px ${y - 14 * bare}px`; // off the numbers
    knob.onkeydown = (event) => {
      const by = steps(handle, event.key, event.shiftKey);
      if (by) event.preventDefault(), ask({}, by);
    };
  }

  // What the hand wishes waits until fewer than AFLOAT answers are due; the last value wins, steps add up.
  function ask(to, by = {}) {
    Object.assign(waiting.to, to);
    for (const [name, n] of Object.entries(by)) waiting.by[name] = (waiting.by[name] ?? 0) + n;
    pump();
  }
  function pump(late) {
    if (open.delete(late)) say("No answer yet. Was the kernel restarted? Then run the cell again.");
    if (open.size >= AFLOAT || !Object.keys({ ...waiting.to, ...waiting.by }).length) return;
    const message = { kind: "grab", from: me, seq: ++seq, ...waiting };
    waiting = { to: {}, by: {} };
    open.add(seq);
    if (scene.code !== false) setTimeout(pump, PATIENCE, seq); // else there is no kernel to be busy or gone
    link.send(message);
  }
  function receive(message, buffers = []) {
    if (message.from === me) open.delete(message.seq);
    const marks = message.marks && decode(message, buffers, known);
    state.frames = message.frames ?? state.frames;
    if (message.kind === "fixed") state.fixed = marks;
    if (message.kind === "picture" && state.fixed) show(message, marks); // an earlier one is for other views
    pump();
  }
  function show(message, marks) {
    Object.assign(state, { marks, places: message.places ?? {}, code: message.code ?? "", shown: Date.now() });
    // While there is a problem the last handles stay, as the way back.
    if (message.handles.length || !message.problem) state.handles = message.handles;
    rich(problem, minus(message.problem ?? "")).hidden = !message.problem;
    numbers.replaceChildren(...(message.numbers ?? []).map(([name, text]) => {
      const span = rich(make("span"), `${name}: `);
      return rich(make("b", {}, span), minus(text)), span;
    }));
    const places = JSON.stringify(state.places);
    if (message.note || message.from || places !== root.dataset.places) say(minus(message.note ?? ""));
    root.classList.add("live");
    paint();
    Object.assign(root.dataset, { drawn: ++state.drawn, places });
    clearTimeout(rest), (rest = setTimeout(atRest, 700, message.sentence ?? "")); // read out when the hand rests
  }

  // Taking hold of the nearest knob or line, else of a line that is pushed along the panel; one finger at a time.
  function under(panel, { clientX, clientY, pointerType, pointerId }) {
    const area = panel.plot.getBoundingClientRect(), x = clientX - area.left, y = clientY - area.top;
    let best = null;
    for (const handle of panel.box ? state.handles.filter((h) => h.panel === panel.name) : []) {
      const bare = handle.at[1] === null, [hx, hy] = bare ? [x, y] : panel.at(...handle.at);
      const grip = handle.grip ? nearest(handle.grip.flatMap((p) => panel.at(...p)), x, y).gap / 14 : Infinity;
      const gap = bare ? 0.99 : Math.min(Math.hypot(x - hx, y - hy) / 24, grip) / (pointerType === "mouse" ? 1 : 1.6);
      if (gap < (best?.gap ?? 1)) best = { panel, handle, gap, off: [hx - x, hy - y], id: pointerId, x: clientX };
    }
    return best;
  }
  function move({ clientX, clientY }) {
    const { panel: { plot, box, frame }, handle, off: [dx, dy] } = held, area = plot.getBoundingClientRect();
    const over = (clientX - area.left + dx - box.left) / box.width;
    const up = (area.top + box.top + box.height - clientY - dy) / box.height;
    ask(wish(handle, frame[0] + over * (frame[1] - frame[0]), frame[2] + up * (frame[3] - frame[2])));
  }
  for (const panel of panels) {
    const { plot } = panel;
    plot.onpointerdown = (event) => {
      if (held?.panel.plot.hasPointerCapture(held.id) || event.button !== 0 || !(held = under(panel, event))) return;
      event.preventDefault(), plot.setPointerCapture(event.pointerId);
      knobs[state.handles.indexOf(held.handle)].focus({ preventScroll: true });
      if (held.handle.at[1] === null && event.pointerType === "mouse") move(event);
    };
    plot.onpointermove = (event) => {
      const up = held?.handle.at[1] === null && event.pointerType !== "mouse" && Math.abs(event.clientX - held.x) < 9;
      if (held?.id === event.pointerId && !up) move(event); // a finger that goes up or down scrolls the page
      plot.style.cursor = held ? "grabbing" : under(panel, event) ? "grab" : "";
    };
    plot.onpointerup = (event) => held?.id === event.pointerId && held.handle.at[1] === null && move(event);
    plot.onlostpointercapture = ({ pointerId }) => held?.id === pointerId && (held = null);
    plot.addEventListener("touchstart", (event) => held?.handle.at[1] != null && event.preventDefault()); // no scroll
  }
  copy.onclick = () => say(state.code) && navigator.clipboard?.writeText(state.code).catch(() => {});

  // For readers of the screen what is seen, names of sliders, and their numbers, not exponents; subscripts for labels.
  function atRest(words) {
    sentence.textContent = minus(words);
    for (const control of around()?.querySelectorAll(".rapkm-control") ?? []) {
      const label = control.querySelector(".widget-label"), said = (el) => el?.textContent.replace("\u200b", "").trim();
      const name = (control.dataset.words ??= said(label) || said(control)); // a box has an empty label besides
      for (const part of control.querySelectorAll(".noUi-handle, .ui-slider-handle, .widget-readout, select, input"))
        Object.assign(part, { ariaLabel: name }).dataset.lmSuppressShortcuts = "true";
      const [handle, readout] = [".noUi-handle", ".widget-readout"].map((part) => control.querySelector(part));
      const told = () => handle.ariaValueText === readout.textContent || (handle.ariaValueText = readout.textContent);
      if (handle && readout) told(), (control.eye ??= new MutationObserver(told)).observe(handle, { attributes: true });
      control.onkeydown = (event) => event.isTrusted || event.stopPropagation(); // JupyterLab would take the focus
      readout?.isContentEditable && (readout.role = "textbox"), label?.textContent.includes("_") && rich(label, name);
    }
    for (const part of around()?.querySelectorAll("button") ?? []) {
      const sign = part.querySelector(".widget-play i")?.className.replace(/.*fa-/, "").replace("retweet", "repeat");
      Object.assign(part, sign && { ariaLabel: sign }).dataset.lmSuppressShortcuts = "true";
    }
  }

  // A number typed beside a slider may lie between two of its steps; one that is left counts as entered.
  function typed({ type, target, key }) {
    if (!target.matches?.(".widget-readout") || !around()?.contains(target)) return;
    const words = () => target.textContent.replace("−", "-").trim(), before = words(), { was } = target.dataset;
    if (type === "beforeinput") target.dataset.was ??= before;
    if (type === "blur" && was !== undefined) target.dispatchEvent(new KeyboardEvent("keydown", ENTER));
    if (key !== "Enter") return;
    delete target.dataset.was;
    const { drawn } = state, meant = before ? Number(before) : NaN, whole = isFinite(meant);
    target.textContent = whole ? meant : before; // a slider reads neither a true minus nor, in whole numbers, 1e3
    setTimeout(() => {
      const now = words(), how = now === was ? "not read, it stays" : "read as", again = "was" in target.dataset;
      if (again || state.drawn > drawn + 1 || around()?.querySelector(".noUi-active")) return; // the hand has moved on
      say(meant === Number(now) ? "" : minus(`${before || "an empty field"} was ${whole ? "rounded to" : how} ${now}`));
    }, 400);
  }

  // A new style sheet may come late, so the picture is painted again for a while.
  const watch = new MutationObserver(() => [0, 300, 1200].forEach((ms) => setTimeout(paint, ms, true)));
  for (const node of [document.documentElement, document.body]) watch.observe(node, { attributes: true });
  const sizes = new ResizeObserver(paint), gone = new AbortController(), here = { signal: gone.signal, capture: true };
  for (const node of [root, ...panels.map((panel) => panel.plot)]) sizes.observe(node);
  for (const query of ["(prefers-color-scheme: dark)", "(forced-colors: active)", "print"])
    matchMedia(query).addEventListener("change", paint, here);
  window.addEventListener("resize", paint, here); // a zoom changes the pixels, and not always the size
  matchMedia("(prefers-reduced-motion: reduce)").addEventListener("change", () => link.send({ kind: "still" }), here);
  window.addEventListener("keydown", page, here); // JupyterLab listens on the document
  for (const name of ["beforeinput", "blur", "keydown"]) document.addEventListener(name, typed, here);
  link.receive(receive), link.send({ kind: "hello" });
  // Only what may be playing is stopped: each message makes Jupyter end the figures of a cell that runs just then.
  const still = () => Date.now() < state.shown + 2000 && link.send({ kind: "still" });
  return Object.assign(() => (gone.abort(), watch.disconnect(), root.remove(), still()), { say });
}

/** Page up and down turn the screens of a dashboard, also on a slider; all pictures listen, the first one acts.
    Running a cell, saving and other shortcuts with a letter, but for those that edit a text, go on to JupyterLab. */
function page(event) {
  const letter = (event.ctrlKey || event.metaKey) && /^[bd-uw]$/i.test(event.key);
  const run = event.key === "Enter" && (event.ctrlKey || event.shiftKey || event.altKey);
  const shut = (letter || run) && event.target.closest?.(".rapkm-explorer [data-lm-suppress-shortcuts]");
  if (shut) delete shut.dataset.lmSuppressShortcuts, setTimeout(() => (shut.dataset.lmSuppressShortcuts = "true"));
  const screens = [...document.querySelectorAll(".rapkm-screen")].filter((screen) => screen.getClientRects().length);
  const way = { PageDown: 1, PageUp: -1 }[event.key], written = event.target.closest?.("textarea, .cm-content");
  if (!way || !screens.length || written) return;
  event.preventDefault(), event.stopImmediatePropagation();
  screens[way + screens.findLastIndex((one) => one.getBoundingClientRect().top < innerHeight / 2)]?.scrollIntoView();
}

export default {
  render({ model, el }) {
    const send = (message) => { try { model.send(message); } catch { /* the kernel has gone */ } };
    const leave = mount(el, model.get("scene"), { send, receive: (callback) => model.on("msg:custom", callback) });
    const over = () => leave.say("The kernel has gone: run the cell again; without cells, load the page again.");
    const end = model.widget_manager?.kernel?.disposed; // a restart tells the model, a shut-down only the kernel
    model.on("comm_live_update", over), end?.connect(over);
    return () => (end?.disconnect(over), leave());
  },
};
