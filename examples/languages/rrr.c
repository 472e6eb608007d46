/* Planar 3-RRR by virtual work; Newton on the platform's pose, since the joints are given. One sample a call.
   workbench: { name = "rrr-c", bound = 1e-10 } */
#include <math.h>

#define PARAMETERS X (l1) X (l2) X (m1) X (m2) X (m3) X (I1) X (I2) X (I3) X (g) X (b1x) X (b1z) X (b2x) X (b2z)        \
  X (b3x) X (b3z) X (cx) X (cz) X (p2x) X (p3x) X (p3z)
#define X(name) name,
enum { PARAMETERS };
#undef X
#define X(name) #name " "
const char workbench_parameters[] = PARAMETERS;

/* a x = b in place, Gauss with pivots; b has k columns */
static int
solve (double a[3][3], double b[3][3], int k)
{
  for (int c = 0; c < 3; c++)
    {
      int best = c;
      for (int i = c + 1; i < 3; i++)
        if (fabs (a[i][c]) > fabs (a[best][c]))
          best = i;
      if (a[best][c] == 0.0)
        return 1;
      for (int j = 0; j < 3; j++)
        {
          double s = a[c][j], v = b[c][j];
          a[c][j] = a[best][j], a[best][j] = s;
          b[c][j] = b[best][j], b[best][j] = v;
        }
      for (int i = 0; i < 3; i++)
        if (i != c)
          {
            double f = a[i][c] / a[c][c];
            for (int j = c; j < 3; j++)
              a[i][j] -= f * a[c][j];
            for (int j = 0; j < k; j++)
              b[i][j] -= f * b[c][j];
          }
    }
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < k; j++)
      b[i][j] /= a[i][i];
  return 0;
}

int
rrr (const double *p, const double *q, const double *qd, const double *qdd, double *tau)
{
  double B[3][2] = { { p[b1x], p[b1z] }, { p[b2x], p[b2z] }, { p[b3x], p[b3z] } };
  double P[3][2] = { { -p[cx], -p[cz] }, { p[p2x] - p[cx], -p[cz] }, { p[p3x] - p[cx], p[p3z] - p[cz] } };
  double x[3] = { 0 }, r[3][2], S[3][2], d[3][2], A[3][3], b[3][3], ca[3], sa[3];
  for (int i = 0; i < 3; i++)
    ca[i] = cos (q[i]), sa[i] = sin (q[i]);
  for (int k = 0; k < 50; k++)
    {
      double c = cos (x[2]), s = sin (x[2]), step = 0.0;
      for (int i = 0; i < 3; i++)
        {
          r[i][0] = c * P[i][0] - s * P[i][1], r[i][1] = s * P[i][0] + c * P[i][1];
          S[i][0] = -r[i][1], S[i][1] = r[i][0];
          d[i][0] = x[0] + r[i][0] - B[i][0] - p[l1] * ca[i], d[i][1] = x[1] + r[i][1] - B[i][1] - p[l1] * sa[i];
          A[i][0] = 2 * d[i][0], A[i][1] = 2 * d[i][1], A[i][2] = 2 * (d[i][0] * S[i][0] + d[i][1] * S[i][1]);
          b[i][0] = p[l2] * p[l2] - d[i][0] * d[i][0] - d[i][1] * d[i][1];
        }
      if (solve (A, b, 1))
        return 1;
      for (int i = 0; i < 3; i++)
        x[i] += b[i][0], step = fmax (step, fabs (b[i][0]));
      if (step < 1e-15)
        break;
    }
  double t[3][2], nu[3][2], first[3][3], J[3][3] = { { 0 } }, U[3][3], ud[3], udd[3], xd[3] = { 0 }, w2, aE[3][2];
  for (int i = 0; i < 3; i++)
    {
      double u = atan2 (d[i][1], d[i][0]);
      t[i][0] = cos (u), t[i][1] = sin (u), nu[i][0] = -sin (u), nu[i][1] = cos (u);
      A[i][0] = first[i][0] = t[i][0], A[i][1] = first[i][1] = t[i][1];
      A[i][2] = first[i][2] = t[i][0] * S[i][0] + t[i][1] * S[i][1];
      J[i][i] = p[l1] * (t[i][1] * ca[i] - t[i][0] * sa[i]);
    }
  double bq[3] = { J[0][0], J[1][1], J[2][2] };
  if (solve (A, J, 3))
    return 2;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      xd[i] += J[i][j] * qd[j];
  w2 = xd[2] * xd[2];
  for (int i = 0; i < 3; i++)
    {
      double turn = nu[i][0] * S[i][0] + nu[i][1] * S[i][1];
      ud[i] = 0.0;
      for (int j = 0; j < 3; j++)
        {
          U[i][j] = nu[i][0] * J[0][j] + nu[i][1] * J[1][j] + turn * J[2][j];
          if (i == j)
            U[i][j] -= p[l1] * (nu[i][1] * ca[i] - nu[i][0] * sa[i]);
          U[i][j] /= p[l2];
          ud[i] += U[i][j] * qd[j];
        }
      b[i][0] = bq[i] * qdd[i] - p[l1] * qd[i] * qd[i] * (t[i][0] * ca[i] + t[i][1] * sa[i]) - p[l2] * ud[i] * ud[i]
                + w2 * (t[i][0] * r[i][0] + t[i][1] * r[i][1]);
    }
  if (solve (first, b, 1))
    return 3;
  double F[3] = { p[m3] * b[0][0], p[m3] * (b[1][0] + p[g]), p[I3] * b[2][0] }, bar[3];
  for (int i = 0; i < 3; i++)
    {
      double aP[2], aD[2];
      aE[i][0] = p[l1] * (-qdd[i] * sa[i] - qd[i] * qd[i] * ca[i]);
      aE[i][1] = p[l1] * (qdd[i] * ca[i] - qd[i] * qd[i] * sa[i]);
      for (int k = 0; k < 2; k++)
        aP[k] = b[k][0] + b[2][0] * S[i][k] - w2 * r[i][k];
      udd[i] = (nu[i][0] * (aP[0] - aE[i][0]) + nu[i][1] * (aP[1] - aE[i][1])) / p[l2];
      for (int k = 0; k < 2; k++)
        aD[k] = aE[i][k] + p[l2] / 2 * (udd[i] * nu[i][k] - ud[i] * ud[i] * t[i][k]) + (k ? p[g] : 0.0);
      tau[i] = (p[I1] + p[m1] * p[l1] * p[l1] / 4) * qdd[i] + p[m1] * p[g] * p[l1] / 2 * ca[i]
               + p[m2] * p[l1] * (aD[1] * ca[i] - aD[0] * sa[i]);
      bar[i] = p[m2] * p[l2] / 2 * (nu[i][0] * aD[0] + nu[i][1] * aD[1]) + p[I2] * udd[i];
    }
  for (int j = 0; j < 3; j++)
    for (int i = 0; i < 3; i++)
      tau[j] += U[i][j] * bar[i] + J[i][j] * F[i];
  return 0;
}
