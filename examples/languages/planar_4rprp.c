/* The 4-RPRP robot by virtual work in platform coordinates, docs/derivations/planar_4rprp.md; one sample a call.
   workbench: { name = "4rprp-c", bound = 1e-10, description = "virtual work in platform coordinates, in C" } */
#include <math.h>

/* one list for both: what the workbench hands over, and the places in p */
#define PARAMETERS X (a) X (b) X (h) X (m2) X (m3) X (m4) X (m6) X (g) X (c2) X (c3) X (I2x) X (I2z) X (I3x) X (I3z)
#define X(name) name,
enum { PARAMETERS };
#undef X
#define X(name) #name " "
const char workbench_parameters[] = PARAMETERS;
const int workbench_external_force = 1;

/* force (along s, along y) that a limb with r = B - A = (s, y) needs at B to move and to be carried */
static void
limb (const double *p, double inertia, double s, double y, double sd, double yd, double sdd, double ydd, double *f)
{
  double q = hypot (s, y), ws = s / q, wy = y / q;
  double qd = ws * sd + wy * yd, turn = (ws * yd - wy * sd) / q;
  double qdd = ws * sdd + wy * ydd + q * turn * turn;
  double turnd = (ws * ydd - wy * sdd - 2.0 * qd * turn) / q;
  double arm = q - p[c3];
  double along = p[m3] * (qdd - arm * turn * turn) + p[m3] * p[g] * wy;
  double moment = (inertia + p[m3] * arm * arm) * turnd + 2.0 * p[m3] * arm * qd * turn
                  + (p[m2] * p[c2] + p[m3] * arm) * p[g] * ws;
  f[0] += along * ws - moment / q * wy;
  f[1] += along * wy + moment / q * ws;
}

int
planar_4rprp (const double *p, const double *q, const double *qd, const double *qdd, const double *force, double *tau)
{
  double z = 0.5 * (p[b] + (q[0] - q[2]) * (q[0] + q[2]) / p[b]), y = sqrt ((q[0] - z) * (q[0] + z));
  double low = y - p[h], x = sqrt ((q[1] - low) * (q[1] + low));
  double zd = (q[0] * qd[0] - q[2] * qd[2]) / p[b], yd = (q[0] * qd[0] - z * zd) / y;
  double xd = (q[1] * qd[1] - low * yd) / x;
  double h1 = q[0] * qdd[0] + qd[0] * qd[0], h2 = q[1] * qdd[1] + qd[1] * qd[1], h3 = q[2] * qdd[2] + qd[2] * qd[2];
  double zdd = (h1 - h3) / p[b], ydd = (h1 - z * zdd - zd * zd - yd * yd) / y;
  double xdd = (h2 - low * ydd - yd * yd - xd * xd) / x;
  double turn_x = p[m2] * p[c2] * p[c2] + p[I2x] + p[I3x], turn_z = p[m2] * p[c2] * p[c2] + p[I2z] + p[I3z];
  double fz[2] = { 0, 0 }, fx[2] = { 0, 0 }, across = p[m6] + p[m4];
  limb (p, turn_x, z, y, zd, yd, zdd, ydd, fz);
  limb (p, turn_x, z - p[b], y, zd, yd, zdd, ydd, fz);
  limb (p, turn_z, x, low, xd, yd, xdd, ydd, fx);
  limb (p, turn_z, x - p[a], low, xd, yd, xdd, ydd, fx);
  double px = across * xdd + fx[0] - force[0];
  double py = (across + p[m4]) * (ydd + p[g]) + fz[1] + fx[1] - force[1];
  double pz = across * zdd + fz[0] - force[2];
  double d2 = px / x, both = (py - low * d2) / y, d3 = (z * both - pz) / p[b];
  tau[0] = q[0] * (both - d3);
  tau[1] = q[1] * d2;
  tau[2] = q[2] * d3;
  return 0;
}
