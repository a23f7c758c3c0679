// Ticks, words, layout, handles and decoding of the stage; run by tests/test_stage_js.py with a message that Python wrote.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import test from "node:test";
import { pathToFileURL } from "node:url";

const [stage, golden] = [process.env.RAPKM_STAGE, process.env.RAPKM_MESSAGE];
const { WHOLE, decode, layout, minus, pieces, steps, ticks, wish } = await import(pathToFileURL(stage));
const width = (words, size) => 0.6 * size * String(words).length;

test("ticks are round, inside the limits, in equal steps, and few", () => {
  const ranges = [[0, 1], [-1, 1], [0, 5], [-20, 20], [0.1, 0.13], [-3e-4, 2e-4], [99, 101], [0, 1e6], [-0.4, 0.41], [1e-9, 3e-9]];
  for (const [low, high] of ranges)
    for (const most of [2, 3, 5, 8]) {
      const list = ticks(low, high, most);
      const slack = 1e-6 * (high - low);
      assert.ok(list.length >= 1 && list.length <= most + 1, `${low} ${high} ${most}: ${list.length}`);
      assert.ok(list.every(({ at }) => at >= low - slack && at <= high + slack));
      const gaps = list.slice(1).map(({ at }, k) => at - list[k].at);
      assert.ok(gaps.every((gap) => Math.abs(gap - gaps[0]) < 1e-9 * (high - low) + 1e-15));
      if (gaps.length) {
        const lead = Number((gaps[0] / 10 ** Math.floor(Math.log10(gaps[0] * 1.0000001))).toFixed(6));
        assert.ok([1, 2, 2.5, 5].includes(lead), `${low} ${high} ${most}: ${lead}`);
      }
      // What is written is what is meant.
      for (const { at, words } of list) assert.ok(Math.abs(Number(words.replace("−", "-")) - at) < slack + 1e-12, words);
      assert.equal(new Set(list.map(({ words }) => words)).size, list.length);
    }
});

test("a logarithmic axis has decades, and limits without meaning have no ticks", () => {
  assert.deepEqual(ticks(1e-3, 1e2, 6, true).map(({ words }) => words), ["10^−3", "10^−2", "10^−1", "10^0", "10^1", "10^2"]);
  assert.deepEqual(ticks(1e-3, 1e2, 3, true).map(({ at }) => Math.round(Math.log10(at))), [-2, 0, 2]);
  for (const [low, high, log] of [[0, 1, true], [-1, 1, true], [1, 1, false], [2, 1, false], [NaN, 1, false], [0, Infinity, false]])
    assert.deepEqual(ticks(low, high, 5, log), []);
});

test("numbers on an axis are different ones, and few, however large, small or near each other its limits are", () => {
  const ranges = [[0, 1e-11], [0, 1e-300], [-1e300, 1e300], [0, 1e22], [1e15, 1e15 + 1], [-1e16, 2 - 1e16], [1e-30, 1e30]];
  for (const [low, high] of [...ranges, [1e-9, 3e-9], [0, 1e20], [1e6, 1e6 + 1e-3]])
    for (const log of [false, true]) {
      const words = ticks(low, high, 5, log).map((tick) => tick.words);
      assert.ok(words.length <= 6 && new Set(words).size === words.length, `${low} ${high}: ${words}`);
    }
});

test("subscripts, powers and minus signs are found, hyphens are left", () => {
  assert.equal(minus("-.01 was rounded to 0.0, a half-.5"), "−.01 was rounded to 0.0, a half-.5");
  assert.deepEqual(pieces("K_P 1 in N"), [{ text: "K", shift: 0 }, { text: "P", shift: -1 }, { text: " 1 in N", shift: 0 }]);
  assert.deepEqual(pieces("10^−3"), [{ text: "10", shift: 0 }, { text: "−3", shift: 1 }]);
  assert.deepEqual(pieces("σ_min").map((p) => p.text), ["σ", "min"]);
  const whole = "0 / −5.5 mN m of 2 N m s²/rad, 7 N m/rad, 9 % at 2 J/mrad², 3 more, 1 sample, torque in mN m".split(WHOLE);
  const kept = ["5.5 mN m", "2 N m s²/rad,", "7 N m/rad,", "9 %", "2 J/mrad²,", "mN m"];
  assert.deepEqual(whole.filter((_, k) => k % 2), kept);
  assert.equal(minus("end-effector at (-60, -69) mm"), "end-effector at (−60, −69) mm");
});

const covers = (a, b) => a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];

/** The rectangle of words that layout has placed. */
function rectangle({ words, x, y, size, ha, va }) {
  const wide = width(words, size);
  const left = x - wide * { left: 0, center: 0.5, right: 1 }[ha];
  const foot = y + size * { center: 0.36, top: 1.05 }[va];
  return [left, foot - 0.75 * size, left + wide, foot + 0.1 * size];
}

test("no numbers around a panel lie on others or are cut, wide or narrow", () => {
  const scale = { levels: [0, 0.5, 1.5, 2.5, 3.5] };
  const panels = [
    [{ xlabel: "time in s", ylabel: "torque in mN m" }],
    [{ xlabel: "x in m", ylabel: "y in m", aspect: "equal" }, scale],
    [{ xlabel: "principal direction, cheapest first", xticks: [1, 2, 3] }],
    [{ yscale: "log" }],
  ];
  const frames = [[0, 5, -100, 100], [-0.4, 0.4, -0.3, 0.5], [0.4, 3.6, 0.5, 2.5], [0, 5, 1e-3, 1e2]];
  panels.forEach(([spec, palette], n) => {
    for (const size of [[480, 260], [260, 200], [220, 190]])
      for (const frame of [frames.slice(0, 3), frames.slice(1, 3), frames.slice(2, 3), frames.slice(3)][n]) {
        const plan = layout(spec, palette, frame, size, 13, (words) => width(words, 13));
        const all = plan.texts.map((t) => [t.words, rectangle(t)]);
        assert.ok(all.length >= 4);
        for (const [words, [a, b, c, d]] of all)
          assert.ok(a >= -1 && b >= -1 && c <= size[0] + 1 && d <= size[1] + 1, `${words} is cut at ${size}: ${[a, b, c, d]}`);
        all.forEach(([words, one], k) =>
          all.slice(k + 1).forEach(([others, other]) => assert.ok(!covers(one, other), `${words} on ${others} at ${size}`)),
        );
        assert.ok(plan.box.width > 25 && plan.box.height > 25, `${size}: ${plan.box.width} x ${plan.box.height}`);
      }
  });
});

test("a handle wishes the values of its place, and stays on its curve", () => {
  assert.deepEqual(wish({ set: { x: [1e3, 0, 0], y: [0, 1e3, 5] } }, 0.02, 0.03), { x: 20, y: 35 });
  assert.deepEqual(wish({ set: { time: [1e3, 0, 0] }, at: [1, null] }, 0.5, NaN), { time: 500 });
  const along = [0, 0, 1, 0, 1, 1];
  const set = { place: [0, 50, 100] };
  assert.deepEqual(wish({ along, set }, 0.5, -3), { place: 25 });
  assert.deepEqual(wish({ along, set }, 9, 0.5), { place: 75 });
  assert.deepEqual(wish({ along, set }, 9, 9), { place: 100 });
});

test("arrow keys are steps of the controls that a direction moves", () => {
  const plane = { set: { x: [1e3, 0, 0], y: [0, 1e3, 0] }, at: [0, 0] };
  assert.deepEqual(steps(plane, "ArrowLeft", false), { x: -1 });
  assert.deepEqual(steps(plane, "ArrowUp", true), { y: 10 });
  const home = steps(plane, "Home", false);
  assert.ok(home.x === home.y && home.x < -1e6); // further than any slider goes
  assert.equal(steps(plane, "Enter", false), null);
  assert.deepEqual(steps({ set: { offset: [-4, 2, 0] }, at: [0, 0] }, "ArrowRight", false), { offset: -1 });
  const ring = { set: { offset: [0, 2, 0] }, at: [1, 0] };
  for (const [key, count] of Object.entries({ ArrowUp: 1, ArrowRight: 1, ArrowLeft: -1, ArrowDown: -1 }))
    assert.deepEqual(steps(ring, key, false), { offset: count });
  assert.deepEqual(steps({ set: { time: [1e3, 0, 0] }, at: [1, null] }, "ArrowDown", false), { time: -1 });
});

test("a message from Python is read back number by number", () => {
  const { header, buffers, marks } = JSON.parse(readFileSync(golden, "utf8"));
  const views = buffers.map((text) => {
    // As ipywidgets hands them over: views into a larger buffer.
    const bytes = Buffer.from(text, "base64");
    const whole = new Uint8Array(bytes.length + 8);
    whole.set(bytes, 8);
    return new DataView(whole.buffer, 8, bytes.length);
  });
  const known = { styles: {}, images: {} };
  const read = decode(header, views, known);
  assert.equal(read.length, marks.length);
  read.forEach((mark, k) => {
    assert.equal(mark.kind, marks[k].kind);
    assert.deepEqual(Array.from(mark.points, (v) => (Number.isFinite(v) ? v : null)), marks[k].points);
  });
  const image = read.find((m) => m.kind === "image");
  const { rows, columns, values } = image.images[image.words[0]];
  assert.equal(values.length, rows * columns);
  assert.ok(header.handles.length > 0 && header.handles.every((h) => Object.keys(h.set).length > 0));
  // What was sent once is not needed again.
  const later = decode({ ...header, styles: {}, images: {} }, views.slice(0, 1), known);
  assert.equal(later.find((m) => m.kind === "image").images[image.words[0]].values, values);
});
