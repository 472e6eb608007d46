/* The 2RSS+PPaP robot by virtual work in end-point coordinates, docs/derivations/asym_2rss_ppap.md; a whole batch a call.
   workbench: { name = "2rss-c", bound = 1e-10, description = "virtual work in end-point coordinates, in C" } */
#include <math.h>

#define PARAMETERS                                                                                                     \
  X (L_left) X (L_right) X (l_left) X (l_right) X (a1_left) X (a1_right) X (a2_left) X (a2_right) X (a5)               \
  X (m1_left) X (m1_right) X (m2_left) X (m2_right) X (m3) X (m4) X (m5) X (m6) X (payload) X (g)                      \
  X (I1_left) X (I1_right) X (I2_left) X (I2_right) X (I5) X (k1_left) X (k1_right) X (k2_left) X (k2_right) X (k5)
#define X(name) name,
enum { PARAMETERS };
#undef X
#define X(name) #name " "
const char workbench_parameters[] = PARAMETERS;
const int workbench_external_force = 1;

/* a bar as a constant matrix of its end points, and their shares of its mass */
typedef struct { double pp, pd, dd, wp, wd; } bar;

static bar
bar_of (double m, double I, double len, double k)
{
  double i = I / (len * len);
  bar s = { m * (1 - k) * (1 - k) + i, m * k * (1 - k) - i, m * k * k + i, m * (1 - k), m * k };
  return s;
}

static void
sample (const double *p, const double *q, const double *qd, const double *qdd, const double *force, double *tau)
{
  double s2 = sin (q[1]), c2 = cos (q[1]), s3 = sin (q[2]), c3 = cos (q[2]), al = p[a1_left], ar = p[a1_right];
  double C[2] = { -(p[L_left] - p[l_left]) - al * c2, al * s2 }, D[2] = { p[L_right] - p[l_right] + ar * c3, ar * s3 };
  double tC[2] = { al * s2, al * c2 }, tD[2] = { -ar * s3, ar * c3 };
  double Cdd[2] = { tC[0] * qdd[1] + al * c2 * qd[1] * qd[1], tC[1] * qdd[1] - al * s2 * qd[1] * qd[1] };
  double Ddd[2] = { tD[0] * qdd[2] - ar * c3 * qd[2] * qd[2], tD[1] * qdd[2] - ar * s3 * qd[2] * qd[2] };
  double e[2] = { D[0] - C[0], D[1] - C[1] }, span = e[0] * e[0] + e[1] * e[1];
  double rl = p[a2_left] * p[a2_left] - q[0] * q[0], rr = p[a2_right] * p[a2_right] - q[0] * q[0];
  double along = 0.5 * (rl - rr + span) / span, up = sqrt (rl / span - along * along);
  if (e[0] < 0)
    up = -up;
  double x[2] = { C[0] + along * e[0] - up * e[1], C[1] + along * e[1] + up * e[0] };
  double u[2] = { x[0] - C[0], x[1] - C[1] }, w[2] = { x[0] - D[0], x[1] - D[1] };
  double det = u[0] * w[1] - u[1] * w[0], jq2 = u[0] * tC[0] + u[1] * tC[1], jq3 = w[0] * tD[0] + w[1] * tD[1];
  double a = jq2 * qd[1] - q[0] * qd[0], b = jq3 * qd[2] - q[0] * qd[0];
  double xd[2] = { (w[1] * a - u[1] * b) / det, (u[0] * b - w[0] * a) / det };
  double common = q[0] * qdd[0] + qd[0] * qd[0];
  a = u[0] * Cdd[0] + u[1] * Cdd[1] - common - pow (xd[0] - tC[0] * qd[1], 2) - pow (xd[1] - tC[1] * qd[1], 2);
  b = w[0] * Ddd[0] + w[1] * Ddd[1] - common - pow (xd[0] - tD[0] * qd[2], 2) - pow (xd[1] - tD[1] * qd[2], 2);
  double xdd[2] = { (w[1] * a - u[1] * b) / det, (u[0] * b - w[0] * a) / det };
  bar left = bar_of (p[m1_left], p[I1_left], al, p[k1_left]), right = bar_of (p[m1_right], p[I1_right], ar, p[k1_right]);
  bar rod_l = bar_of (p[m2_left], p[I2_left], p[a2_left], p[k2_left]);
  bar rod_r = bar_of (p[m2_right], p[I2_right], p[a2_right], p[k2_right]), swing = bar_of (p[m5], p[I5], p[a5], p[k5]);
  double carried = rod_l.dd + rod_r.dd + p[m3] + p[payload], fC[2], fD[2], P[2];
  for (int i = 0; i < 2; i++)
    {
      double weight = i ? p[g] : 0.0;
      fC[i] = (left.dd + rod_l.pp) * Cdd[i] + rod_l.pd * xdd[i] - weight * (left.wd + rod_l.wp);
      fD[i] = (right.dd + rod_r.pp) * Ddd[i] + rod_r.pd * xdd[i] - weight * (right.wd + rod_r.wp);
      P[i] = carried * xdd[i] + rod_l.pd * Cdd[i] + rod_r.pd * Ddd[i] - force[1 + i]
             - weight * (p[m3] + p[payload] + rod_l.wd + rod_r.wd);
    }
  /* the parallelogram swings: its tip lies at (x2, sqrt (a5^2 - x2^2)) */
  double zi = 1.0 / sqrt (p[a5] * p[a5] - x[0] * x[0]), slope = -x[0] * zi;
  double zdd = slope * xdd[0] - xd[0] * xd[0] * p[a5] * p[a5] * zi * zi * zi;
  P[0] += (swing.dd + p[m6]) * (xdd[0] + slope * zdd) - p[g] * (swing.wd + p[m6]) * slope;
  double l2 = (w[1] * P[0] - w[0] * P[1]) / det, l3 = (u[0] * P[1] - u[1] * P[0]) / det;
  tau[0] = (carried + p[m4] + p[m5] + p[m6]) * qdd[0] - force[0] - q[0] * (l2 + l3);
  tau[1] = jq2 * l2 + fC[0] * tC[0] + fC[1] * tC[1];
  tau[2] = jq3 * l3 + fD[0] * tD[0] + fD[1] * tD[1];
}

int
asym_2rss_ppap_batch (int n, const double *p, const double *q, const double *qd, const double *qdd,
                      const double *force, double *tau)
{
  for (int i = 0; i < n; i++)
    sample (p, q + 3 * i, qd + 3 * i, qdd + 3 * i, force + 3 * i, tau + 3 * i);
  return 0;
}
