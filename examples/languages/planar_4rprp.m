function tau = planar_4rprp(p, q, qd, qdd, force)
  % The 4-RPRP robot by virtual work in platform coordinates, docs/derivations/planar_4rprp.md.
  % workbench: { name = "4rprp-octave", bound = 1e-10 }
  % q, qd, qdd, tau: n x 3 (m, N); force: n x 3 (N); p.a, p.b ...: parameters (SI)
  q1 = q(:, 1); q2 = q(:, 2); q3 = q(:, 3);
  z = 0.5 * (p.b + (q1 - q3) .* (q1 + q3) / p.b);
  y = sqrt((q1 - z) .* (q1 + z));
  low = y - p.h;
  x = sqrt((q2 - low) .* (q2 + low));
  half = q .* qd;
  zd = (half(:, 1) - half(:, 3)) / p.b;
  yd = (half(:, 1) - z .* zd) ./ y;
  xd = (half(:, 2) - low .* yd) ./ x;
  half = q .* qdd + qd .^ 2;
  zdd = (half(:, 1) - half(:, 3)) / p.b;
  ydd = (half(:, 1) - z .* zdd - zd .^ 2 - yd .^ 2) ./ y;
  xdd = (half(:, 2) - low .* ydd - yd .^ 2 - xd .^ 2) ./ x;
  turn_x = p.m2 * p.c2 ^ 2 + p.I2x + p.I3x;
  turn_z = p.m2 * p.c2 ^ 2 + p.I2z + p.I3z;
  [s1, y1] = limb(p, turn_x, z, y, zd, yd, zdd, ydd);
  [s3, y3] = limb(p, turn_x, z - p.b, y, zd, yd, zdd, ydd);
  [s2, y2] = limb(p, turn_z, x, low, xd, yd, xdd, ydd);
  [s4, y4] = limb(p, turn_z, x - p.a, low, xd, yd, xdd, ydd);
  across = p.m6 + p.m4;
  px = across * xdd + s2 + s4 - force(:, 1);
  py = (across + p.m4) * (ydd + p.g) + y1 + y2 + y3 + y4 - force(:, 2);
  pz = across * zdd + s1 + s3 - force(:, 3);
  d2 = px ./ x;
  both = (py - low .* d2) ./ y;
  d3 = (z .* both - pz) / p.b;
  tau = [q1 .* (both - d3), q2 .* d2, q3 .* d3];
end

function [fs, fy] = limb(p, inertia, s, y, sd, yd, sdd, ydd)
  % force (along s, along y) that a limb with r = B - A = (s, y) needs at B to move and to be carried
  q = hypot(s, y); ws = s ./ q; wy = y ./ q;
  qd = ws .* sd + wy .* yd;
  turn = (ws .* yd - wy .* sd) ./ q;
  qdd = ws .* sdd + wy .* ydd + q .* turn .^ 2;
  turnd = (ws .* ydd - wy .* sdd - 2 * qd .* turn) ./ q;
  arm = q - p.c3;
  along = p.m3 * (qdd - arm .* turn .^ 2) + p.m3 * p.g * wy;
  moment = (inertia + p.m3 * arm .^ 2) .* turnd + 2 * p.m3 * arm .* qd .* turn ...
           + (p.m2 * p.c2 + p.m3 * arm) * p.g .* ws;
  fs = along .* ws - moment ./ q .* wy;
  fy = along .* wy + moment ./ q .* ws;
end
