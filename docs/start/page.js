// The start page: the machine at rest and on its path, by the engine and the stage, without a kernel.

import { Pose, machine, polygon, rest, simulate } from "../../rapkm_lite/explore/engine.js";
import { mount } from "../../rapkm_lite/explore/stage.js";

const given = JSON.parse(document.getElementById("values").textContent);
const robot = machine(given.machine);
const { K_P, K_D, corners, duration, table1, colours, dashes } = given;
const N = robot.N;
const PER_NEWTON = 180; // mm in the picture, less where an arrow would leave it
const FRAME = { machine: [-275, 365, -332, 376] };
const LIMIT = 0.04; // N m per drive, of the polygon of forces
const BASE = given.machine.base;
const FILTERED = "#1B7F79";
const filters = ["off", "measured", "true"];

// What can be set: lowest, highest, step and first value, and how many steps make a whole number in the address.
const controls = {
  x: { low: -150, high: 150, step: 2, value: 20, words: "x in mm" },
  y: { low: -150, high: 180, step: 2, value: 50, words: "y in mm" },
  ...Object.fromEntries(
    [4, -2, 5].map((value, i) => [`offset_${i + 1}`, { low: -8, high: 8, step: 0.5, value, words: `encoder ${i + 1} off by, mrad` }]),
  ),
  time: { low: 0, high: duration, step: 0.05, value: 0, words: "time on the path in s" },
};
const state = Object.fromEntries(Object.entries(controls).map(([name, c]) => [name, c.value]));
state.filter = "off";
state.moving = false; // on the path, or held at one point

const $ = (id) => document.getElementById(id);
const number = (value, digits = 2) => (Math.abs(value) < 0.5 * 10 ** -digits ? 0 : value).toFixed(digits).replace("-", "−");
const offsets = () => [1, 2, 3].map((i) => 1e-3 * state[`offset_${i}`]);
const total = (energy) => energy.reduce((a, b) => a + b, 0);

// ---------------------------------------------------------------- what the engine says

const paths = {};
const path = (dt) => (paths[dt] ??= polygon(robot, corners, { duration, dt }));
const made = new Map();

/** The run with a filter at the present offsets; `dt` is longer while a hand is dragging. */
function lap(filter, dt) {
  const key = [...offsets(), filter, dt].join();
  if (!made.has(key)) {
    if (made.size > 100) made.clear();
    made.set(key, simulate(robot, path(dt), { K_P, K_D, offset: offsets(), filter }));
  }
  return made.get(key);
}

/** Where the machine is, and the torques that act there. */
function now(run, dt) {
  if (state.moving) {
    const k = Math.min(Math.round(state.time / dt), run.torque.length / N - 1);
    const pose = new Pose(robot);
    pose.at(run.x[2 * k], run.x[2 * k + 1]);
    return { pose, torque: Array.from(run.torque.subarray(N * k, N * k + N)) };
  }
  let settled = null;
  // Near the rim offsets may push the machine out of its reach: then it rests a little further in.
  for (let s = 1; !settled; s -= 0.01) settled = rest(robot, 1e-3 * s * state.x, 1e-3 * s * state.y, K_P, offsets());
  if (state.filter !== "off") settled.pose.filter(settled.torque);
  return settled;
}

// ---------------------------------------------------------------- the picture

const line = (color, width = 1.6, more = {}) => ({ z: 2, alpha: 1, color, width, dash: [], ...more });
const arm = (i, width, more = {}) => line(colours[i], width, { dash: dashes[i], ...more });
const dot = (color, marker, size, face) => line(color, 0, { marker, size, face, edge: 1.3, z: 4 });
const text = (color = "#222222", more = {}) => ({ z: 5, alpha: 1, color, size: 9.5, bold: false, ha: "center", va: "bottom", ...more });
const area = (face, color = null, more = {}) => ({ z: 1, alpha: 1, face, color, width: 1, dash: [], ...more });
const bar = (panel, at, height, style, wide = 0.8) =>
  ["bar", panel, style, [at - wide / 2, 0, at + wide / 2, 0, at + wide / 2, height, at - wide / 2, height]];

/** An arrow; `size` is the unit of the panel, one for a panel some hundred units wide. */
function arrow(panel, x, y, dx, dy, style, size = 1) {
  const length = Math.hypot(dx, dy), head = Math.min(9 * size, 0.5 * length);
  if (length < 0.5 * size) return [];
  const [ux, uy] = [dx / length, dy / length], [bx, by] = [x + dx - head * ux, y + dy - head * uy];
  const tip = [x + dx, y + dy, bx - 0.4 * head * uy, by + 0.4 * head * ux, bx + 0.4 * head * uy, by - 0.4 * head * ux];
  return [["line", panel, style, [x, y, bx, by]], ["polygon", panel, area(style.color, style.color, { z: 4 }), tip]];
}

/** The scale at which the arrows of forces [fx, fy] from a place stay in the picture. */
const scaleOf = (forces, place) => Math.min(PER_NEWTON, ...forces.flatMap((force) => force.map((f, k) => {
  const [low, high] = FRAME.machine.slice(2 * k, 2 * k + 2);
  return (f > 0 ? high - 8 - place[k] : place[k] - low - 8) / Math.max(Math.abs(f), 1e-9);
})));

/** The machine on its path, with the forces that its drives can make and those that they do make. */
function drawMachine({ pose, torque }) {
  const [x, y] = [1e3 * pose.x, 1e3 * pose.y];
  const forces = Array.from(torque, (c, i) => [pose.bx[i] * c, pose.by[i] * c]), scale = scaleOf(forces, [x, y]);
  const reach = pose.forcePolygon(LIMIT).flatMap(([fx, fy]) => [x + scale * fx, y + scale * fy]);
  const marks = [["polygon", "machine", area("#E4E8EE", "#8A94A6"), reach]];
  for (let i = 0; i < N; i++) {
    const [bx, by] = BASE[i].map((v) => 1e3 * v), elbow = [bx + 1e3 * pose.ax[i], by + 1e3 * pose.ay[i]];
    marks.push(["line", "machine", line(colours[i], 3.2, { cap: "round" }), [bx, by, ...elbow, x, y]]);
    marks.push(["line", "machine", dot(colours[i], "o", 8, colours[i]), [bx, by]]);
    marks.push(["line", "machine", dot(colours[i], "o", 6, "#ffffff"), elbow]);
    const words = `drive ${i + 1}`;
    marks.push(["label", "machine", text("#222222", { va: by > 0 ? "bottom" : "top" }), [bx, by + (by > 0 ? 20 : -20)], words]);
  }
  for (let i = 0; i < N; i++)
    marks.push(...arrow("machine", x, y, ...forces[i].map((f) => scale * f), line(colours[i], 2.4, { z: 4 })));
  marks.push(["line", "machine", dot("#222222", "s", 7, "#ffffff"), [x, y]]);
  const newtons = [0.2, 0.5, 1, 2].find((n) => n * scale > 25) ?? 5, end = FRAME.machine[1] - 20;
  marks.push(["line", "machine", line("#222222", 2.4), [end - newtons * scale, -305, end, -305]]);
  marks.push(["label", "machine", text("#222222", { ha: "right" }), [end, -295], `${newtons} N`]);
  return marks;
}

/** The forces of the drives one after the other: a closed figure moves nothing. */
function drawForces({ pose, torque }) {
  const forces = Array.from(torque, (c, i) => [1e3 * pose.bx[i] * c, 1e3 * pose.by[i] * c]);
  const corners = [[0, 0]];
  for (const [fx, fy] of forces) corners.push([corners.at(-1)[0] + fx, corners.at(-1)[1] + fy]);
  const size = limit(corners.flat(), [75, 150, 300, 600, 1200]), head = size / 60;
  const marks = forces.flatMap((force, i) => arrow("forces", ...corners[i], ...force, line(colours[i], 2.4), head));
  const [x, y] = corners.at(-1);
  if (Math.hypot(x, y) > 5) marks.push(...arrow("forces", 0, 0, x, y, line("#222222", 2.4), head));
  return [marks, size];
}

/** The first of some round limits that holds all numbers, so that a scale seldom changes. */
const limit = (values, levels) => levels.find((level) => values.every((v) => Math.abs(v) < 0.93 * level)) ?? levels.at(-1);

function drawBars(at, unit) {
  const marks = [["line", "offset", line("#555555", 1), [0.4, 0, N + 0.6, 0]], ["line", "torque", line("#555555", 1), [0.4, 0, N + 0.6, 0]]];
  for (let i = 0; i < N; i++) {
    const value = state[`offset_${i + 1}`], torque = 1e3 * at.torque[i];
    marks.push(bar("offset", i + 1, value, area(colours[i]), 0.5), bar("torque", i + 1, torque, area(colours[i]), 0.5));
    for (const [panel, v, gap] of [["torque", torque, unit], ["offset", value, 2.4]]) { // 2.4 mrad: off the ring
      const words = number(v, 1), way = words.startsWith("−") ? -1 : 1;
      marks.push(["label", panel, text("#222222", { va: way < 0 ? "top" : "bottom" }), [i + 1, v + way * gap], words]);
    }
  }
  return marks;
}

/** The energies of Table 1 beside those of these offsets. */
function drawEnergy(here) {
  const rows = [[table1[0], table1[1]], [here.off, here.on]].map((pair) => pair.map(total));
  const marks = [];
  rows.forEach((pair, group) => pair.forEach((joules, k) => {
    const x = 1 + 2.6 * group + k;
    marks.push(bar("energy", x, joules, area(k ? FILTERED : "#999999")));
    marks.push(["label", "energy", text(), [x, joules + 0.1], number(joules)]);
  }));
  marks.push(["legend", "energy", {}, [], [["without", line("#999999", 6)], ["with filter", line(FILTERED, 6)]]]);
  return [marks, Math.max(...rows.flat())];
}

function drawRun(run, dt) {
  const every = Math.max(1, Math.round(0.01 / dt)), marks = [];
  for (let i = 0; i < N; i++) {
    const points = [];
    for (let k = 0; k * N < run.torque.length; k += every) points.push(k * dt, 1e3 * run.torque[k * N + i]);
    marks.push(["line", "run", arm(i, 1.5), points]);
  }
  marks.push(["line", "run", line("#222222", 1.2), [state.time, -300, state.time, 300]]);
  marks.push(["legend", "run", {}, [], colours.map((_, i) => [`drive ${i + 1}`, arm(i, 1.5)])]);
  return marks;
}

/** Everything that is seen, as a message for the stage. */
function picture(dt) {
  const off = lap("off", dt), on = lap(state.filter === "off" ? "measured" : state.filter, dt);
  const run = state.filter === "off" ? off : on, at = now(run, dt);
  const here = { off: off.energy, on: on.energy };
  const [bars, highest] = drawEnergy(here), [chain, size] = drawForces(at);
  const scale = limit(at.torque.map((c) => 1e3 * c), [30, 45, 60, 90, 120]), whole = limit(run.torque.map((c) => 1e3 * c), [65, 130, 260]);
  const frames = {
    ...FRAME, offset: [0.4, N + 0.6, -12.5, 12.5], torque: [0.4, N + 0.6, -1.25 * scale, 1.25 * scale],
    forces: [-size, size, -size, size], energy: [0.3, 5.3, -0.25, 1.32 * Math.max(highest, 5)], run: [0, duration, -whole, whole],
  };
  const saved = 1 - total(here.on) / total(here.off), measured = 1 - total(table1[1]) / total(table1[0]);
  let apart = 0;
  for (let k = 0; k < on.x.length; k += 2) apart = Math.max(apart, Math.hypot(on.x[k] - off.x[k], on.x[k + 1] - off.x[k + 1]));
  const torques = at.torque.map((c) => number(1e3 * c, 1)).join(", "), eta = at.pose.nullVector();
  const where = state.moving ? `at ${number(state.time)} s on the path` : "at rest here";
  const lost = [off, on].find((r) => r.lost !== null);
  const places = { ...state, time: Number(state.time.toFixed(2)) };
  if (state.moving) [places.x, places.y] = [at.pose.x, at.pose.y].map((v) => Math.round(1e3 * v));
  // The words follow the numbers, whatever the setting.
  const words = lost
    ? `With these offsets the machine is lost after ${number(lost.lost)} s.`
    : `One lap costs ${number(total(here.off))} J without the filter and ${number(total(here.on))} J with it, ` +
      (saved > 0.005 ? `${number(100 * saved, 0)} % less` : Number(number(total(here.on))) < Number(number(total(here.off))) ? "hardly less" : "no less") +
      ` (the chapter measured ${number(100 * measured, 0)} % less), and the two motions are never more than ${number(Math.max(Math.ceil(1e5 * apart) / 100, 0.01))} mm apart.`;
  if ($("said").textContent !== words) $("said").textContent = words;
  return {
    kind: "picture", styles: {}, frames,
    marks: [
      ["title", "torque", text("#222222", { bold: true }), [], state.moving ? "Torques now, mN m" : "Torques at rest, mN m"],
      ...drawMachine(at), ...chain, ...drawBars(at, scale / 60), ...bars, ...drawRun(run, dt),
    ],
    handles: [
      { panel: "machine", at: [1e3 * at.pose.x, 1e3 * at.pose.y], set: { x: [1, 0, 0], y: [0, 1, 0] } },
      ...[1, 2, 3].map((i) => ({ panel: "offset", at: [i, state[`offset_${i}`]], set: { [`offset_${i}`]: [0, 1, 0] } })),
      { panel: "run", at: [state.time, null], set: { time: [1, 0, 0] } },
    ],
    numbers: [[`torques ${where}`, `${torques} mN m`], ["null vector η", `(${eta.map((n) => number(n)).join(", ")})`]],
    places, code: "", problem: "",
    sentence: `The machine ${where}, filter ${state.filter}: drive torques ${torques} mN m. ${words}`,
  };
}

// ---------------------------------------------------------------- settings

const snap = (name, value, step = controls[name].step) => {
  const { low, high } = controls[name];
  return Math.min(Math.max(Number((step * Math.round(value / step)).toFixed(6)), low), high);
};

/** The point nearest to the wish on the way from here that all arms reach. */
function reachable(x, y) {
  const pose = new Pose(robot), here = [state.x, state.y];
  const far = (s) => [x, y].map((v, k) => Math.round(here[k] + s * (v - here[k])));
  const fits = (s) => pose.at(...far(s).map((v) => 1e-3 * v)) && Math.min(...pose.inv.map(Math.abs).map((v) => 1 / v)) > 0.004;
  if (fits(1)) return far(1);
  let [good, bad] = [0, 1];
  for (let k = 0; k < 12; k++) fits((good + bad) / 2) ? (good = (good + bad) / 2) : (bad = (good + bad) / 2);
  return far(good);
}

function change(to, by = {}) {
  const taken = ["x", "y"].some((name) => name in to || name in by);
  if (taken && state.moving) {
    // A hand takes the machine from where it is on its path.
    const { pose } = now(lap(state.filter, 1e-3), 1e-3);
    [state.x, state.y] = [1e3 * pose.x, 1e3 * pose.y];
  }
  const wish = { ...to };
  for (const [name, count] of Object.entries(by)) wish[name] = state[name] + count * controls[name].step;
  if (taken) {
    // A key on a slider goes by 1 mm, one on the machine by the step.
    [state.x, state.y] = reachable(snap("x", wish.x ?? state.x, 1), snap("y", wish.y ?? state.y, 1));
    state.moving = false;
  }
  // A hand on the machine or on its time ends the play.
  if (taken || "time" in wish) stop();
  for (const name of Object.keys(wish)) if (name !== "x" && name !== "y") state[name] = snap(name, wish[name]);
  if ("time" in wish) state.moving = true;
}

function inputs(places) {
  for (const [name, c] of Object.entries(controls)) {
    $(name).value = places[name];
    $(`${name}-value`).textContent = number(places[name], c.step < 0.1 ? 2 : c.step < 1 ? 1 : 0);
  }
  $("filter").value = state.filter;
}

/** Whole numbers in the address: what a link carries to somebody else. */
function address() {
  const whole = Object.entries(controls).map(([name, c]) => Math.round(state[name] / (name === "x" || name === "y" ? 1 : c.step)));
  history.replaceState(null, "", `#${[...whole, filters.indexOf(state.filter), Number(state.moving)].join(",")}`);
}

function fromAddress(url) {
  const whole = new URL(url).hash.slice(1).split(",").map(Number), names = Object.keys(controls);
  if (whole.length !== names.length + 2 || !whole.every(Number.isInteger) || url.includes(",,")) return;
  const value = (k) => whole[k] * (k < 2 ? 1 : controls[names[k]].step);
  // At the rim a place may lie between two steps.
  [state.x, state.y] = reachable(snap("x", value(0), 1), snap("y", value(1), 1));
  stop();
  names.slice(2).forEach((name, k) => (state[name] = snap(name, value(k + 2))));
  state.filter = filters[whole.at(-2)] ?? "off";
  state.moving = whole.at(-1) === 1;
}

// ---------------------------------------------------------------- the loop of the page

let show = () => {}, fine = 0;

/** Draw, roughly while a hand moves, and once more finely when it rests. */
function update(answered = {}, rough = false) {
  const made = picture(rough ? 2e-3 : 1e-3);
  show({ ...made, ...answered });
  inputs(made.places);
  clearTimeout(fine);
  fine = setTimeout(() => {
    address();
    if (rough) update();
  }, 150);
}

/** One picture per frame of the screen, however many questions came. */
const asked = [];
function answer() {
  const last = asked.pop();
  for (const question of asked.splice(0)) show({ kind: "lost", ...question });
  update(last, true);
}

const link = {
  receive: (callback) => (show = callback),
  send(message) {
    if (message.kind === "grab") {
      change(message.to, message.by);
      asked.push({ from: message.from, seq: message.seq });
      if (asked.length === 1) requestAnimationFrame(answer);
      return;
    }
    const ring = Array.from({ length: 91 }, (_, k) => (k * Math.PI) / 45), [l1, l2] = [0, 1].map((j) => reachOf(j));
    const marks = BASE.map(([x, y], i) => ["line", "machine", line(colours[i], 0.6, { z: 0, alpha: 0.6 }),
      ring.flatMap((a) => [1e3 * (x + (l1 + l2) * Math.cos(a)), 1e3 * (y + (l1 + l2) * Math.sin(a))])]);
    marks.push(["polygon", "machine", area(null, "#555555", { dash: [3, 2] }), corners.flatMap(([x, y]) => [1e3 * x, 1e3 * y])]);
    show({ kind: "fixed", marks, styles: {}, frames: picture(1e-3).frames });
    update();
  },
};
const reachOf = (j) => (Array.isArray(given.machine.lengths) ? given.machine.lengths[0][j] : given.machine.lengths);

let playing = 0;
function stop() {
  cancelAnimationFrame(playing);
  playing = 0;
  state.time = snap("time", state.time); // as the address will have it
  $("play").textContent = still.matches ? "Step" : "Play the run";
}
const still = matchMedia("(prefers-reduced-motion: reduce)");

function play() {
  if (playing) return stop(), update();
  if (!state.moving || state.time >= duration) state.time = 0;
  state.moving = true;
  if (still.matches) {
    state.time = snap("time", state.time + 0.25);
    return update();
  }
  $("play").textContent = "Pause";
  let last = performance.now();
  const tick = (time) => {
    state.time = Math.min(state.time + Math.max(0, time - last) / 1000, duration);
    last = time; // a frame may have begun before the click
    update();
    if (state.time < duration) playing = requestAnimationFrame(tick);
    else stop();
  };
  playing = requestAnimationFrame(tick);
}

let before = {};
for (const [name, c] of Object.entries(controls)) {
  const row = document.createElement("label");
  row.innerHTML = `<span>${c.words}: <b id="${name}-value"></b></span>`;
  const input = Object.assign(document.createElement("input"), { type: "range", id: name, min: c.low, max: c.high, step: name === "x" || name === "y" ? 1 : c.step });
  input.setAttribute("aria-label", c.words);
  input.oninput = () => (change({ [name]: input.valueAsNumber }), update({}, true));
  // A finger that scrolls the page puts down on a slider first: what it moved there goes back.
  input.onpointerdown = () => (before = { ...state });
  input.onpointercancel = () => (Object.assign(state, before), update());
  row.append(input);
  $("controls").append(row);
}
$("filter").onchange = () => ((state.filter = $("filter").value), update());
$("play").onclick = play;
// A hand that takes hold of something ends the play; the stage has focused it by now.
$("stage").addEventListener("pointerdown", () => playing && document.activeElement.matches(".rapkm-knob") && (stop(), update()));
// The address that was asked for: the page may have written its own in the meantime.
addEventListener("hashchange", (event) => (fromAddress(event.newURL), update()));

fromAddress(location.href);
stop();
mount($("stage"), {
  name: "machine", code: false,
  about: "The machine with the forces its drives can make, encoder offsets, drive torques, their forces one after the other, energies beside Table 1, and torques along the path",
  labels: Object.fromEntries(Object.entries(controls).map(([name, c]) => [name, c.words])),
  ranges: Object.fromEntries(Object.entries(controls).map(([name, c]) => [name, [c.low, c.high]])),
  panels: {
    machine: { title: "Drag the end-effector", aspect: "equal", xticks: [], yticks: [], xlabel: "mm; grey: all forces of drives with at most 40 mN m" },
    offset: { title: "Encoder errors, mrad", xticks: [1, 2, 3] },
    torque: { xticks: [1, 2, 3] },
    forces: { title: "Forces in a chain, mN", aspect: "equal" },
    energy: { title: "Energy of a lap, J", xticks: [], xlabel: "left Table 1, right here" },
    run: { title: "Torques along the path, mN m", xlabel: "time in s" },
  },
  layout: [["machine", "offset", "torque"], ["machine", "forces", "energy"], ["run", "run", "run"]], widths: [1.7, 1, 1], size: [12, 9.6],
}, link);

// On a narrow page, where panels stand below each other, a slider stands below what it moves.
const narrow = matchMedia("(max-width: 640px)"), movers = [["machine", /^[xy]$/], ["offset", /^offset/], ["run", /^time$/]];
function arrange() {
  const held = document.activeElement;
  const panels = Object.fromEntries(Array.from(document.querySelectorAll(".rapkm-panel"), (el) => [el.style.gridArea.split(" ")[0], el]));
  for (const [panel, names] of movers) {
    const rows = Object.keys(controls).filter((name) => names.test(name)).map((name) => $(name).parentElement);
    if (narrow.matches) panels[panel].after(...rows);
    else $("controls").append(...rows);
  }
  held.focus({ preventScroll: true }); // what is moved in the document loses it
}
narrow.addEventListener("change", arrange);
arrange();
