/* The floor of the benchmarks: the closed forms' equations in plain C, for both robots.

   A benchmark artefact, not part of the package: the equations of workbench/robots/<robot>/kernel.py, line by line,
   with the constants that their pack() makes. Compiled on the spot, once as a plain loop (-O3 -march=native) and once in
   blocks for a vector math library (-ffast-math and libmvec, which is why NaN may get lost there). */

#include <math.h>
#include <stdint.h>

#define BLOCK 256

static inline void asym(const double *c, double q1, double s2, double c2, double s3, double c3, double qd1, double qd2,
                        double qd3, double qdd1, double qdd2, double qdd3, double f1, double f2, double f3, double *t1,
                        double *t2, double *t3) {
  double cy = -c[0] - c[2] * c2, cz = c[2] * s2;
  double dy = c[1] + c[3] * c3, dz = c[3] * s3;
  double ey = dy - cy, ez = dz - cz, span = ey * ey + ez * ez;
  double rod_l = c[4] - q1 * q1, rod_r = c[5] - q1 * q1;
  double along = 0.5 * (rod_l - rod_r + span) / span;
  double up = sqrt(rod_l / span - along * along);
  up = ey < 0.0 ? -up : up;
  double x2 = cy + along * ey - up * ez, x3 = cz + along * ez + up * ey;
  double u2 = x2 - cy, u3 = x3 - cz, w2 = x2 - dy, w3 = x3 - dz;
  double tcy = c[2] * s2, tcz = c[2] * c2, tdy = -c[3] * s3, tdz = c[3] * c3;
  double jq2 = u2 * tcy + u3 * tcz, jq3 = w2 * tdy + w3 * tdz;
  double inv = 1.0 / (u2 * w3 - u3 * w2);
  double r2 = jq2 * qd2 - q1 * qd1, r3 = jq3 * qd3 - q1 * qd1;
  double xd2 = (w3 * r2 - u3 * r3) * inv, xd3 = (u2 * r3 - w2 * r2) * inv;
  double cdy = tcy * qd2, cdz = tcz * qd2, ddy = tdy * qd3, ddz = tdz * qd3;
  double cddy = tcy * qdd2 + c[2] * c2 * qd2 * qd2, cddz = tcz * qdd2 - c[2] * s2 * qd2 * qd2;
  double dddy = tdy * qdd3 - c[3] * c3 * qd3 * qd3, dddz = tdz * qdd3 - c[3] * s3 * qd3 * qd3;
  double common = q1 * qdd1 + qd1 * qd1;
  r2 = u2 * cddy + u3 * cddz - common - (xd2 - cdy) * (xd2 - cdy) - (xd3 - cdz) * (xd3 - cdz);
  r3 = w2 * dddy + w3 * dddz - common - (xd2 - ddy) * (xd2 - ddy) - (xd3 - ddz) * (xd3 - ddz);
  double xdd2 = (w3 * r2 - u3 * r3) * inv, xdd3 = (u2 * r3 - w2 * r2) * inv;
  double fcy = c[6] * cddy + c[7] * xdd2, fcz = c[6] * cddz + c[7] * xdd3 - c[9];
  double fdy = c[10] * dddy + c[11] * xdd2, fdz = c[10] * dddz + c[11] * xdd3 - c[13];
  double carried = c[8] + c[12] + c[14];
  double px = carried * qdd1 - f1;
  double py = carried * xdd2 + c[7] * cddy + c[11] * dddy - f2;
  double pz = carried * xdd3 + c[7] * cddz + c[11] * dddz - c[15] - f3;
  double inv_z = 1.0 / sqrt(c[17] - x2 * x2);
  double slope = -x2 * inv_z, zdd = slope * xdd2 - xd2 * xd2 * c[17] * inv_z * inv_z * inv_z;
  py += c[18] * (xdd2 + slope * zdd) - c[19] * slope;
  double lam2 = (w3 * py - w2 * pz) * inv, lam3 = (u2 * pz - u3 * py) * inv;
  *t1 = px - q1 * (lam2 + lam3) + c[16] * qdd1;
  *t2 = jq2 * lam2 + fcy * tcy + fcz * tcz;
  *t3 = jq3 * lam3 + fdy * tdy + fdz * tdz;
}

static inline void limb(const double *c, double inertia, double s, double y, double sd, double yd, double sdd,
                        double ydd, double *fs, double *fy) {
  double q = sqrt(s * s + y * y), ws = s / q, wy = y / q;
  double qd = ws * sd + wy * yd, turn = (ws * yd - wy * sd) / q;
  double qdd = ws * sdd + wy * ydd + q * turn * turn;
  double turn_d = (ws * ydd - wy * sdd - 2.0 * qd * turn) / q;
  double arm = q - c[6];
  double along = c[5] * (qdd - arm * turn * turn) + c[8] * wy;
  double moment = (inertia + c[5] * arm * arm) * turn_d + 2.0 * c[5] * arm * qd * turn + (c[7] + c[8] * arm) * ws;
  double across = moment / q;
  *fs = along * ws - across * wy;
  *fy = along * wy + across * ws;
}

static inline void planar(const double *c, double q1, double q2, double q3, double qd1, double qd2, double qd3,
                          double qdd1, double qdd2, double qdd3, double fx, double fy, double fz, double *t1,
                          double *t2, double *t3) {
  double a = c[0], b = c[1];
  double z = 0.5 * (b + (q1 - q3) * (q1 + q3) / b), y = sqrt((q1 - z) * (q1 + z)), low = y - c[2];
  double x = sqrt((q2 - low) * (q2 + low));
  double h1 = q1 * qd1, h2 = q2 * qd2, h3 = q3 * qd3;
  double zd = (h1 - h3) / b, yd = (h1 - z * zd) / y, xd = (h2 - low * yd) / x;
  h1 = q1 * qdd1 + qd1 * qd1, h2 = q2 * qdd2 + qd2 * qd2, h3 = q3 * qdd3 + qd3 * qd3;
  double zdd = (h1 - h3) / b, ydd = (h1 - z * zdd - zd * zd - yd * yd) / y;
  double xdd = (h2 - low * ydd - yd * yd - xd * xd) / x;
  double s1, y1, s2, y2, s3, y3, s4, y4;
  limb(c, c[3], z, y, zd, yd, zdd, ydd, &s1, &y1);
  limb(c, c[3], z - b, y, zd, yd, zdd, ydd, &s3, &y3);
  limb(c, c[4], x, low, xd, yd, xdd, ydd, &s2, &y2);
  limb(c, c[4], x - a, low, xd, yd, xdd, ydd, &s4, &y4);
  double px = c[9] * xdd + s2 + s4 - fx;
  double py = c[10] * ydd + c[11] + y1 + y2 + y3 + y4 - fy;
  double pz = c[9] * zdd + s1 + s3 - fz;
  double d2 = px / x, both = (py - low * d2) / y, d3 = (z * both - pz) / b;
  *t1 = q1 * (both - d3), *t2 = q2 * d2, *t3 = q3 * d3;
}

/* plain loops over rows of three; a batch of one is the single call */
void asym_rows(const double *c, const double *q, const double *qd, const double *qdd, const double *f, double *tau,
               int64_t n) {
  for (int64_t i = 0; i < 3 * n; i += 3)
    asym(c, q[i], sin(q[i + 1]), cos(q[i + 1]), sin(q[i + 2]), cos(q[i + 2]), qd[i], qd[i + 1], qd[i + 2], qdd[i],
         qdd[i + 1], qdd[i + 2], f[i], f[i + 1], f[i + 2], tau + i, tau + i + 1, tau + i + 2);
}

void planar_rows(const double *c, const double *q, const double *qd, const double *qdd, const double *f, double *tau,
                 int64_t n) {
  for (int64_t i = 0; i < 3 * n; i += 3)
    planar(c, q[i], q[i + 1], q[i + 2], qd[i], qd[i + 1], qd[i + 2], qdd[i], qdd[i + 1], qdd[i + 2], f[i], f[i + 1],
           f[i + 2], tau + i, tau + i + 1, tau + i + 2);
}

/* blocks of columns, so that the compiler can use vectors and a vector math library */
typedef double columns[15][BLOCK];

static inline int64_t load(columns b, const double *q, const double *qd, const double *qdd, const double *f, int64_t i,
                           int64_t n) {
  int64_t count = n - i < BLOCK ? n - i : BLOCK;
  for (int64_t j = 0; j < count; j++)
    for (int k = 0; k < 3; k++) {
      b[k][j] = q[3 * (i + j) + k], b[3 + k][j] = qd[3 * (i + j) + k];
      b[6 + k][j] = qdd[3 * (i + j) + k], b[9 + k][j] = f[3 * (i + j) + k];
    }
  return count;
}

static inline void store(columns b, double *tau, int64_t i, int64_t count) {
  for (int64_t j = 0; j < count; j++)
    for (int k = 0; k < 3; k++) tau[3 * (i + j) + k] = b[12 + k][j];
}

void asym_blocks(const double *c, const double *q, const double *qd, const double *qdd, const double *f, double *tau,
                 int64_t n) {
  static _Thread_local columns b;
  static _Thread_local double s2[BLOCK], c2[BLOCK], s3[BLOCK], c3[BLOCK];
  for (int64_t i = 0; i < n; i += BLOCK) {
    int64_t count = load(b, q, qd, qdd, f, i, n);
    /* separate loops: together the compiler makes a call of sincos of them, which has no vector form */
    for (int64_t j = 0; j < count; j++) s2[j] = sin(b[1][j]);
    for (int64_t j = 0; j < count; j++) c2[j] = cos(b[1][j]);
    for (int64_t j = 0; j < count; j++) s3[j] = sin(b[2][j]);
    for (int64_t j = 0; j < count; j++) c3[j] = cos(b[2][j]);
#pragma omp simd
    for (int64_t j = 0; j < count; j++)
      asym(c, b[0][j], s2[j], c2[j], s3[j], c3[j], b[3][j], b[4][j], b[5][j], b[6][j], b[7][j], b[8][j], b[9][j],
           b[10][j], b[11][j], &b[12][j], &b[13][j], &b[14][j]);
    store(b, tau, i, count);
  }
}

void planar_blocks(const double *c, const double *q, const double *qd, const double *qdd, const double *f, double *tau,
                   int64_t n) {
  static _Thread_local columns b;
  for (int64_t i = 0; i < n; i += BLOCK) {
    int64_t count = load(b, q, qd, qdd, f, i, n);
#pragma omp simd
    for (int64_t j = 0; j < count; j++)
      planar(c, b[0][j], b[1][j], b[2][j], b[3][j], b[4][j], b[5][j], b[6][j], b[7][j], b[8][j], b[9][j], b[10][j],
             b[11][j], &b[12][j], &b[13][j], &b[14][j]);
    store(b, tau, i, count);
  }
}
