/* The yardstick: the same closed loop (PD, force filter, true or measured pose, horizontal plane) in C.
   LANES = 1 is the scalar kernel with its history, LANES = 8 runs eight runs in one vector register and keeps only
   sums.  FRICTION = 1 adds friction in the drives, without the substeps that it would need.  ANGLE, RATE, COS, SIN are
   blocks of the engine's motion table, which has so many COLUMNS. */
#include <math.h>
#if LANES == 1
typedef double real;
static inline real root(real v) { return sqrt(v); }
static inline int any_above(real v, double limit) { return v > limit; }
static inline real smaller(real a, real b) { return a < b ? a : b; }
#else
typedef double real __attribute__((vector_size(8 * LANES)));
#if defined(__AVX512F__) && LANES == 8
#include <immintrin.h>
static inline real root(real v) { return (real)_mm512_sqrt_pd((__m512d)v); }
static inline real smaller(real a, real b) { return (real)_mm512_min_pd((__m512d)a, (__m512d)b); }
#else
static inline real root(real v) { for (int l = 0; l < LANES; l++) v[l] = sqrt(v[l]); return v; }
static inline real smaller(real a, real b) { for (int l = 0; l < LANES; l++) a[l] = a[l] < b[l] ? a[l] : b[l]; return a; }
#endif
static inline int any_above(real v, double limit) {
    int found = 0;
    for (int l = 0; l < LANES; l++) found |= v[l] > limit;
    return found;
}
#endif
#define N 3
#define EACH for (int i = 0; i < N; i++)

typedef struct { double bx, by, l1sq, l2sq, half, mode, s1, s2, tip, w1, w2, friction, scale, elbow_scale; } arm;
typedef struct { real ax, ay, ad, bx, by, lx, ly, inv, area2; } geo;

static inline geo geometry(const arm *m, real x, real y) {
    geo g;
    real X = x - m->bx, Y = y - m->by, rho2 = X * X + Y * Y, kappa = 0.5 * rho2 + m->half;
    g.area2 = m->l1sq * rho2 - kappa * kappa;
    real den = m->mode * root(g.area2);
    real inverse = 1.0 / rho2, k = kappa * inverse, h = den * inverse;
    g.ax = k * X + h * Y, g.ay = k * Y - h * X, g.ad = kappa - m->l1sq, g.inv = 1.0 / den;
    g.bx = (X - g.ax) * g.inv, g.by = (Y - g.ay) * g.inv, g.lx = g.ax * g.inv, g.ly = g.ay * g.inv;
    return g;
}

static inline real small_angle(real s) {
    real z = s * s;
    return s * (1.0 + z * (1. / 6 + z * (3. / 40 + z * (5. / 112 + z * (35. / 1152 + z * (63. / 2816 +
           z * (231. / 13312 + z * (143. / 10240 + z * (6435. / 557056)))))))));
}

/* tanh(z): e^u - 1 at u = 2 z / 256 by its series, doubled eight times. */
static inline real smooth_sign(real z) {
    real top = 40.0 + (real){0}, u = -smaller(-smaller(z + z, top), top) * 0.00390625;
    real t = u * (1.0 + u * (1. / 2 + u * (1. / 6 + u * (1. / 24 + u * (1. / 120 + u * (1. / 720 + u * (1. / 5040 +
             u * (1. / 40320 + u * (1. / 362880)))))))));
    for (int i = 0; i < 8; i++) t = t * (2.0 + t);
    return t / (2.0 + t);
}

static inline void dynamics(const arm *arms, const geo *g, real vx, real vy, const real *c, double sharpness, real *kx,
                            real *ky, real *low) {
    real m11 = arms[0].tip + arms[1].tip + arms[2].tip + (real){0}, m12 = {0}, m22 = m11, fx = {0}, fy = {0};
    EACH {
        const arm *m = arms + i;
        const geo q = g[i];
        *low = smaller(*low, q.area2);
        real base = q.bx * vx + q.by * vy, back = q.lx * vx + q.ly * vy;
        real b2 = base * base * q.inv, k2 = back * back * q.inv;
        real ba = b2 * q.ad + k2 * m->l2sq, la = b2 * m->l1sq + k2 * q.ad;
        real sx = m->s1 * q.bx, sy = m->s1 * q.by, tx = m->s2 * q.lx, ty = m->s2 * q.ly;
        m11 += sx * q.bx + tx * q.lx, m12 += sx * q.by + tx * q.ly, m22 += sy * q.by + ty * q.ly;
        real drive = FRICTION ? c[i] - m->friction * smooth_sign(base * sharpness) : c[i];
        fx += q.bx * drive - sx * ba - tx * la, fy += q.by * drive - sy * ba - ty * la;
    }
    real s = 1.0 / (m11 * m22 - m12 * m12);
    *kx = (m22 * fx - m12 * fy) * s, *ky = (m11 * fy - m12 * fx) * s;
}

static inline void accelerate(const arm *arms, real x, real y, real vx, real vy, const real *c, double sharpness,
                              real *kx, real *ky, real *low) {
    geo g[N];
    EACH g[i] = geometry(arms + i, x, y);
    dynamics(arms, g, vx, vy, c, sharpness, kx, ky, low);
}

/* sums, in lanes: copper and work per drive, torque, antagonism; history, for one run: x y vx vy | q | qd | c.
   Returns how many Newton steps were taken. */
long closed_loop(const arm *arms, const double *table, long samples, double dt, const double *offsets, double Kp,
                 double Kd, double weight, double sharpness, int measured, int filtered, double *history,
                 double *sums) {
    real x, y, vx, vy, px, py, p1x, p1y, p2x, p2y, c[N], offset[N], old[N], copper[N], work[N], torque = {0}, null_ = {0};
    x = px = p1x = p2x = table[0] + (real){0}, y = py = p1y = p2y = table[1] + (real){0}, vx = vy = (real){0};
    EACH copper[i] = work[i] = old[i] = c[i] = (real){0}, offset[i] = *(const real *)(offsets + i * LANES);

    long steps = 0;
    for (long k = 0; k < samples; k++) {
        const double *row = table + k * COLUMNS, *want = row + 6 + ANGLE * N, *want_rate = row + 6 + RATE * N,
                     *u = row + 6 + COS * N, *v = row + 6 + SIN * N;
        geo g[N];
        real e[N], rate[N], angle[N], a1[N], a2[N];
        EACH {
            g[i] = geometry(arms + i, x, y);
            angle[i] = want[i] + small_angle((u[i] * g[i].ay - v[i] * g[i].ax) * arms[i].scale);
            rate[i] = g[i].bx * vx + g[i].by * vy;
            e[i] = angle[i] + offset[i] - want[i];
            work[i] += c[i] * (angle[i] - old[i]), old[i] = angle[i];
            a1[i] = g[i].bx, a2[i] = g[i].by;
        }
        if (measured) {
            real gx = 3.0 * (px - p1x) + p2x, gy = 3.0 * (py - p1y) + p2y;
            p2x = p1x, p2y = p1y, p1x = px, p1y = py, px = gx, py = gy;
            for (int n = 0; n < 12; n++, steps++) {
                real m11 = {0}, m12 = {0}, m22 = {0}, fx = {0}, fy = {0};
                EACH {
                    geo q = geometry(arms + i, px, py);
                    real r = e[i] - small_angle((u[i] * q.ay - v[i] * q.ax) * arms[i].scale), h = r * q.inv;
                    real bx = q.bx, by = q.by, lx = q.lx, ly = q.ly;
                    real g1 = 1.0 - h * q.ad, g2 = h * arms[i].l2sq;
                    m11 += g1 * bx * bx - g2 * lx * lx, m12 += g1 * bx * by - g2 * lx * ly;
                    m22 += g1 * by * by - g2 * ly * ly, fx += bx * r, fy += by * r, a1[i] = bx, a2[i] = by;
                }
                real s = 1.0 / (m11 * m22 - m12 * m12);
                real sx = (m22 * fx - m12 * fy) * s, sy = (m11 * fy - m12 * fx) * s;
                px += sx, py += sy;
                if (!any_above(sx * sx + sy * sy, 4e-28)) break;
            }
        }
        real m11 = {0}, m12 = {0}, m22 = {0}, fx = {0}, fy = {0};
        EACH {
            c[i] = Kp * e[i] + Kd * (rate[i] - want_rate[i]);
            m11 += a1[i] * a1[i], m12 += a1[i] * a2[i], m22 += a2[i] * a2[i], fx += a1[i] * c[i], fy += a2[i] * c[i];
        }
        real s = 1.0 / (m11 * m22 - m12 * m12), gx = (m22 * fx - m12 * fy) * s, gy = (m11 * fy - m12 * fx) * s;
        EACH c[i] = filtered ? -(a1[i] * gx + a2[i] * gy) : -c[i];
#if LANES == 1
        double *h = history + k * (4 + 3 * N);
        h[0] = x, h[1] = y, h[2] = vx, h[3] = vy;
        EACH h[4 + i] = angle[i], h[4 + N + i] = rate[i], h[4 + 2 * N + i] = c[i];
#else
        if (k + 1 == samples) break;
        m11 = m12 = m22 = fx = fy = (real){0};
        EACH {
            real b1 = g[i].bx, b2 = g[i].by;
            m11 += b1 * b1, m12 += b1 * b2, m22 += b2 * b2, fx += b1 * c[i], fy += b2 * c[i];
            copper[i] += c[i] * c[i], torque += c[i] * c[i];
        }
        s = 1.0 / (m11 * m22 - m12 * m12), gx = (m22 * fx - m12 * fy) * s, gy = (m11 * fy - m12 * fx) * s;
        EACH {
            real rest = c[i] - (g[i].bx * gx + g[i].by * gy);
            null_ += weight * rest * rest;
        }
#endif
        if (k + 1 == samples) break;
        /* What the run must notice: an arm that leaves its reach on the way, or would within this hold. */
        real low = 1e300 + (real){0};
        EACH {
            real ahead = 1.0 - dt * g[i].ad * g[i].inv * ((g[i].bx + g[i].lx) * vx + (g[i].by + g[i].ly) * vy);
            low = smaller(low, ahead);
        }
        real h2 = 0.5 * dt + (real){0}, k1x, k1y, k2x, k2y, k3x, k3y, k4x, k4y;
        dynamics(arms, g, vx, vy, c, sharpness, &k1x, &k1y, &low);
        real ux = vx + h2 * k1x, uy = vy + h2 * k1y;
        accelerate(arms, x + h2 * vx, y + h2 * vy, ux, uy, c, sharpness, &k2x, &k2y, &low);
        real wx = vx + h2 * k2x, wy = vy + h2 * k2y;
        accelerate(arms, x + h2 * ux, y + h2 * uy, wx, wy, c, sharpness, &k3x, &k3y, &low);
        real zx = vx + dt * k3x, zy = vy + dt * k3y;
        accelerate(arms, x + dt * wx, y + dt * wy, zx, zy, c, sharpness, &k4x, &k4y, &low);
        double d6 = dt / 6.0;
        x += d6 * (vx + 2.0 * (ux + wx) + zx), y += d6 * (vy + 2.0 * (uy + wy) + zy);
        vx += d6 * (k1x + 2.0 * (k2x + k3x) + k4x), vy += d6 * (k1y + 2.0 * (k2y + k3y) + k4y);
        real speed = vx * vx + vy * vy;
        if (any_above(-low, 0.0) || any_above(speed, 1e300)) return -k;
    }
#if LANES > 1
    real *out = (real *)sums;
    EACH out[i] = copper[i], out[N + i] = work[i];
    out[2 * N] = torque, out[2 * N + 1] = null_, out[2 * N + 2] = x, out[2 * N + 3] = y;
#endif
    return steps;
}
