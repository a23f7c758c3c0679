// The machine, its PD drives and the antagonism filter in plain JavaScript, for pages without a kernel.
// The same algebra as rapkm_lite/engine, which tests/test_engine_js.py holds it to: with v the velocity of the
// end-effector, an arm with link vectors a, d has the rates b.v and -l.v of its links, b = d / (a x d) and
// l = a / (a x d), so that b is its row of A.  SI units; an offset is measured minus true angle.
const each = (value, i) => (Array.isArray(value) ? value[i] : value);
const zeros = (count) => new Float64Array(count);
const smoothSign = (z) => (z > 20 ? 1 : z < -20 ? -1 : Math.tanh(z)); // beyond 20 the same to the last bit
const wrap = (angle) => angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));

/** A machine from the values of a data file: per-link values are one number or [[proximal, distal], ...]. */
export function machine(values) {
  const { rotor_inertia = 0, friction = 0, friction_velocity = 0.01, gravity = [0, 0], load = 0, mode = 1 } = values;
  const { resistance = 0.611, torque_constant = 0.0259 } = values;
  const arms = values.base.map(([x, y], i) => {
    const link = (value) => [0, 1].map((j) => each(each(value, i), j));
    const [l1, l2] = link(values.lengths), [m1, m2] = link(values.masses), carried = i === 1 ? load : 0;
    const [c1, c2] = values.centers ? link(values.centers) : [l1 / 2, l2 / 2];
    const [i1, i2] = values.inertias ? link(values.inertias) : [(m1 * l1 * l1) / 12, (m2 * l2 * l2) / 12];
    // The coupling of the two links acts like a mass at the tip, and less inertia of the links.
    const tip = (m2 * c2) / l2 + carried;
    return {
      x, y, l1sq: l1 * l1, l2sq: l2 * l2, longest: Math.max(l1, l2), mode: each(mode, i), tip,
      s1: i1 + m1 * c1 * c1 + (m2 + carried - tip) * l1 * l1 + each(rotor_inertia, i),
      s2: i2 + m2 * c2 * c2 + (carried - tip) * l2 * l2, w1: (m1 * c1) / l1 + m2 + carried, w2: tip,
      friction: each(friction, i), loss: each(resistance, i) / each(torque_constant, i) ** 2,
    };
  });
  const mass = arms.reduce((sum, arm) => sum + arm.tip, 0);
  return { arms, mass, gravity, sharpness: 1 / friction_velocity, N: arms.length };
}

/** All arms with the end-effector at one point: link vectors a, d, rows b of A, rows l; one number per arm each. */
export class Pose {
  constructor(machine) {
    Object.assign(this, { machine, x: 0, y: 0 });
    for (const name of ["ax", "ay", "dx", "dy", "bx", "by", "lx", "ly", "ad", "inv"]) this[name] = zeros(machine.N);
  }
  /** Move to (x, y); false where an arm does not reach. */
  at(x, y) {
    const { arms, N } = this.machine;
    this.x = x, this.y = y;
    for (let i = 0; i < N; i++) {
      const arm = arms[i], X = x - arm.x, Y = y - arm.y, reach2 = X * X + Y * Y;
      const kappa = 0.5 * (reach2 + (arm.l1sq - arm.l2sq)), area2 = arm.l1sq * reach2 - kappa * kappa;
      if (!(area2 > 0)) return false;
      const root = arm.mode * Math.sqrt(area2), k = kappa / reach2, h = root / reach2, inv = 1 / root;
      const ax = k * X + h * Y, ay = k * Y - h * X, dx = X - ax, dy = Y - ay;
      this.ax[i] = ax, this.ay[i] = ay, this.dx[i] = dx, this.dy[i] = dy;
      this.bx[i] = dx * inv, this.by[i] = dy * inv, this.lx[i] = ax * inv, this.ly[i] = ay * inv;
      this.ad[i] = ax * dx + ay * dy, this.inv[i] = inv;
    }
    return true;
  }
  angle(i) { return Math.atan2(this.ay[i], this.ax[i]); }
  /** Move to the least-squares pose of base angles, by Newton steps from here; false where there is none. */
  estimate(angles) {
    const { arms, N } = this.machine;
    for (let k = 0; k < 50; k++) {
      let m11 = 0, m12 = 0, m22 = 0, n11 = 0, n12 = 0, n22 = 0, fx = 0, fy = 0;
      for (let i = 0; i < N; i++) {
        const bx = this.bx[i], by = this.by[i], lx = this.lx[i], ly = this.ly[i];
        const r = wrap(angles[i] - this.angle(i)), g = r * this.inv[i] * this.ad[i], h = r * this.inv[i] * arms[i].l2sq;
        m11 += bx * bx, m12 += bx * by, m22 += by * by, fx += bx * r, fy += by * r;
        n11 += g * bx * bx + h * lx * lx, n12 += g * bx * by + h * lx * ly, n22 += g * by * by + h * ly * ly;
      }
      // Far away the curvature n may spoil the step: then Gauss-Newton.
      const whole = m11 - n11 > 0 && (m11 - n11) * (m22 - n22) > (m12 - n12) ** 2;
      if (whole) m11 -= n11, m12 -= n12, m22 -= n22;
      const det = m11 * m22 - m12 * m12, sx = (m22 * fx - m12 * fy) / det, sy = (m11 * fy - m12 * fx) / det;
      if (!this.at(this.x + sx, this.y + sy)) return false;
      // What a Newton step leaves is of its square.
      if (Math.max(Math.abs(sx), Math.abs(sy)) < (whole ? 3e-8 : 1e-13) * arms[0].longest) return true;
    }
    return false;
  }
  /** Filter (15)-(16): overwrite torques by R c, their part that moves the end-effector. */
  filter(c) {
    // By the second column less its share of the first: A^T A would square the condition number of A.
    let xx = 0, xy = 0, xc = 0, vv = 0, vc = 0;
    for (let i = 0; i < c.length; i++) xx += this.bx[i] ** 2, xy += this.bx[i] * this.by[i], xc += this.bx[i] * c[i];
    const share = xy / xx, left = (i) => this.by[i] - share * this.bx[i];
    for (let i = 0; i < c.length; i++) vv += left(i) ** 2, vc += left(i) * c[i];
    for (let i = 0; i < c.length; i++) c[i] = this.bx[i] * (xc / xx) + left(i) * (vc / vv);
    return c;
  }
  /** The direction of torques that move nothing, of length one, for three arms: the cross product of A's columns. */
  nullVector() {
    const { bx, by } = this, cross = [1, 2, 0].map((j, i) => bx[j] * by[(i + 2) % 3] - bx[(i + 2) % 3] * by[j]);
    return cross.map((n) => n / Math.hypot(...cross));
  }
  /** Corners of all end-effector forces that torques of at most `torque` make, counter-clockwise. */
  forcePolygon(torque) {
    const edges = Array.from(this.bx, (bx, i) => [2 * torque * bx, 2 * torque * this.by[i]])
      .map(([x, y]) => (y < 0 || (y === 0 && x < 0) ? [-x, -y] : [x, y]))
      .sort((p, q) => Math.atan2(p[1], p[0]) - Math.atan2(q[1], q[0]));
    let x = -edges.reduce((sum, e) => sum + e[0], 0) / 2, y = -edges.reduce((sum, e) => sum + e[1], 0) / 2;
    const half = edges.map((e) => [(x += e[0]) - e[0], (y += e[1]) - e[1]]);
    return [...half, ...half.map((p) => [-p[0], -p[1]])];
  }
}

/** Where PD drives with offsets come to rest near (x, y), without load and friction: the pose, and their torques. */
export function rest(m, x, y, K_P, offset) {
  const pose = new Pose(m);
  const desired = pose.at(x, y) ? offset.map((_, i) => pose.angle(i)) : null;
  // Springs of equal stiffness rest where the sum of the squared errors is least.
  if (!desired?.length || !pose.estimate(desired.map((angle, i) => angle - offset[i]))) return null;
  return { pose, torque: offset.map((o, i) => -K_P * (wrap(pose.angle(i) - desired[i]) + o)) };
}

/** A closed polygon, each edge quintic from rest to rest: per sample x (2), base angles and rates (N). */
export function polygon(m, corners, { duration = 5, dt = 1e-3 } = {}) {
  const steps = Math.round(duration / dt), edges = corners.length, time = duration / edges;
  const angles = m.N * (steps + 1), sized = { x: zeros(2 * steps + 2), angle: zeros(angles), rate: zeros(angles) };
  const path = { dt: duration / steps, samples: steps + 1, ...sized }, pose = new Pose(m);
  for (let k = 0; k <= steps; k++) {
    const phase = (k * path.dt) / time, edge = Math.min(Math.floor(phase), edges - 1), s = Math.min(phase - edge, 1);
    const way = s ** 3 * (10 - 15 * s + 6 * s * s), rate = (30 * (s * (1 - s)) ** 2) / time;
    const [x0, y0] = corners[edge], [x1, y1] = corners[(edge + 1) % edges];
    if (!pose.at(x0 + way * (x1 - x0), y0 + way * (y1 - y0))) return null;
    path.x[2 * k] = pose.x, path.x[2 * k + 1] = pose.y;
    for (let i = 0, o = k * m.N; i < m.N; i++, o++) {
      const last = k > 0 ? path.angle[o - m.N] : 0;
      path.angle[o] = last + wrap(pose.angle(i) - last);
      path.rate[o] = rate * (pose.bx[i] * (x1 - x0) + pose.by[i] * (y1 - y0));
    }
  }
  return path;
}

/** PD drives (12) on a path from rest; filter "off", or (16) with R at the "true" or the "measured" pose.
    Per sample x (2), true base angles and torques (N); energy per drive in J; lost: the time where it broke off. */
export function simulate(m, path, { K_P, K_D, offset = 0, filter = "off", encoder = null }) {
  const { arms, N, mass, sharpness, gravity: [gx, gy] } = m, { dt, samples } = path;
  const run = { x: zeros(2 * samples), angle: zeros(N * samples), torque: zeros(N * samples), energy: zeros(N) };
  const drag = gx !== 0 || gy !== 0 || arms.some((arm) => arm.friction > 0), quantum = (2 * Math.PI) / encoder;
  const pose = new Pose(m), thought = new Pose(m), [c, read, rates, bend, acc, M] = [N, N, N, N, 2, 3].map(zeros);
  /** Acceleration of the end-effector into `acc`; false where the machine would leave its workspace within h. */
  function accelerate(x, y, vx, vy, h) {
    if (!pose.at(x, y)) return false;
    let m11 = mass, m12 = 0, m22 = mass, fx = 0, fy = 0, inside = true;
    for (let i = 0; i < N; i++) {
      const arm = arms[i], bx = pose.bx[i], by = pose.by[i], lx = pose.lx[i], ly = pose.ly[i], inv = pose.inv[i];
      const ad = pose.ad[i], base = bx * vx + by * vy, back = lx * vx + ly * vy;
      const base2 = base * base * inv, back2 = back * back * inv;
      // Accelerations of the links that velocities alone make.
      const pb = base2 * ad + back2 * arm.l2sq, pl = base2 * arm.l1sq + back2 * ad;
      let drive = c[i] - arm.s1 * pb, distal = -arm.s2 * pl;
      if (drag) {
        drive -= arm.w1 * (gx * pose.ay[i] - gy * pose.ax[i]) + arm.friction * smoothSign(base * sharpness);
        distal += arm.w2 * (gx * pose.dy[i] - gy * pose.dx[i]);
      }
      m11 += arm.s1 * bx * bx + arm.s2 * lx * lx, m12 += arm.s1 * bx * by + arm.s2 * lx * ly;
      m22 += arm.s1 * by * by + arm.s2 * ly * ly, fx += bx * drive + lx * distal, fy += by * drive + ly * distal;
      rates[i] = base, bend[i] = pb, inside = inside && h * ad * inv * (base + back) < 1;
    }
    const det = m11 * m22 - m12 * m12;
    acc[0] = (m22 * fx - m12 * fy) / det, acc[1] = (m11 * fy - m12 * fx) / det, M[0] = m11, M[1] = m12, M[2] = m22;
    return inside;
  }
  /** Steps that friction asks of a hold: a drive that can pass zero is stiff there. */
  function steps() {
    let stiff = 0, fast = 0, near = false, det = M[0] * M[2] - M[1] * M[1];
    for (let i = 0; i < N; i++) {
      const bx = pose.bx[i], by = pose.by[i], f = arms[i].friction;
      const yields = (f * (M[2] * bx * bx - 2 * M[1] * bx * by + M[0] * by * by)) / det;
      const qdd = Math.abs(bx * acc[0] + by * acc[1] + bend[i]);
      stiff += yields * sharpness * dt;
      if (!(f > 0 && Math.abs(rates[i]) < 20 / sharpness + (qdd + 2 * yields) * dt)) continue;
      near = true, fast = Math.max(fast, Math.min((qdd + yields) * dt * sharpness / 0.6, yields * dt * dt / 3e-9));
    }
    return near ? Math.max(1, Math.ceil(Math.max(stiff + Math.min(stiff, 6), Math.min(fast, 4000)))) : 1;
  }
  let x = path.x[0], y = path.x[1], vx = 0, vy = 0, x1 = x, y1 = y, x2 = x, y2 = y;
  thought.at(x, y);
  for (let k = 0, o = 0; k < samples; k++, o += N) {
    pose.at(x, y), run.x[2 * k] = x, run.x[2 * k + 1] = y;
    // What the drives read, and what they ask for.
    for (let i = 0; i < N; i++) {
      const wanted = path.angle[o + i], angle = (run.angle[o + i] = wanted + wrap(pose.angle(i) - wanted));
      if (k > 0) run.energy[i] += arms[i].loss * c[i] * c[i] * dt + c[i] * (angle - run.angle[o + i - N]);
      read[i] = angle + each(offset, i);
      if (encoder !== null) read[i] = quantum * Math.floor(read[i] / quantum + 0.5);
      const rate = pose.bx[i] * vx + pose.by[i] * vy;
      c[i] = -(each(K_P, i) * (read[i] - wanted) + each(K_D, i) * (rate - path.rate[o + i]));
    }
    if (filter === "measured") {
      // The pose moves on smoothly, unless angles are stepped: a parabola through the last three.
      const px = thought.x, py = thought.y, smooth = encoder === null ? 1 : 0;
      const guess = [px + smooth * (2 * px - 3 * x1 + x2), py + smooth * (2 * py - 3 * y1 + y2)];
      if (![guess, [px, py]].some((p) => thought.at(...p) && thought.estimate(read))) return { ...run, lost: k * dt };
      x2 = x1, y2 = y1, x1 = px, y1 = py;
    }
    if (filter !== "off") (filter === "true" ? pose : thought).filter(c);
    run.torque.set(c, o);
    if (k + 1 === samples) return { ...run, lost: null };
    // The torques are held: Runge-Kutta steps of order 4.
    let inside = accelerate(x, y, vx, vy, dt);
    const n = drag && inside ? steps() : 1, h = dt / Math.min(n, 4000);
    for (let s = 0; s < n && inside; s++) {
      if (s > 0) inside = accelerate(x, y, vx, vy, 0);
      const k1x = acc[0], k1y = acc[1], ux = vx + 0.5 * h * k1x, uy = vy + 0.5 * h * k1y;
      inside = inside && accelerate(x + 0.5 * h * vx, y + 0.5 * h * vy, ux, uy, 0);
      const k2x = acc[0], k2y = acc[1], wx = vx + 0.5 * h * k2x, wy = vy + 0.5 * h * k2y;
      inside = inside && accelerate(x + 0.5 * h * ux, y + 0.5 * h * uy, wx, wy, 0);
      const k3x = acc[0], k3y = acc[1], zx = vx + h * k3x, zy = vy + h * k3y;
      inside = inside && accelerate(x + h * wx, y + h * wy, zx, zy, 0);
      x += (h / 6) * (vx + 2 * (ux + wx) + zx), y += (h / 6) * (vy + 2 * (uy + wy) + zy);
      vx += (h / 6) * (k1x + 2 * (k2x + k3x) + acc[0]), vy += (h / 6) * (k1y + 2 * (k2y + k3y) + acc[1]);
    }
    if (!inside || n > 4000 || !pose.at(x, y)) return { ...run, lost: k * dt };
  }
}
