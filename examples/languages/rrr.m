function tau = rrr(p, q, qd, qdd)
  % Planar 3-RRR by virtual work; Newton on the platform's pose, since the joints are given.
  % workbench: { name = "rrr-octave", bound = 1e-10 }
  n = size(q, 1);
  tau = zeros(n, 3);
  B = [p.b1x, p.b2x, p.b3x; p.b1z, p.b2z, p.b3z];
  P = [0, p.p2x, p.p3x; 0, 0, p.p3z] - [p.cx; p.cz];
  for i = 1:n
    a = q(i, :); rate = qd(i, :)'; acc = qdd(i, :)';
    ea = [cos(a); sin(a)]; na = [-sin(a); cos(a)];
    E = B + p.l1 * ea;
    x = zeros(3, 1);
    for k = 1:50
      R = [cos(x(3)), -sin(x(3)); sin(x(3)), cos(x(3))];
      r = R * P; S = [-r(2, :); r(1, :)];
      d = x(1:2) + r - E;
      f = sum(d .^ 2)' - p.l2 ^ 2;
      dx = -[2 * d', 2 * sum(d .* S)'] \ f;
      x = x + dx;
      if max(abs(dx)) < 1e-15, break; end
    end
    u = atan2(d(2, :), d(1, :));
    t = [cos(u); sin(u)]; nu = [-sin(u); cos(u)];
    A = [t', sum(t .* S)'];
    b = p.l1 * sum(t .* na)';
    J = A \ diag(b);
    xd = J * rate;
    U = ([nu', sum(nu .* S)'] * J - diag(p.l1 * sum(nu .* na))) / p.l2;
    ud = U * rate;
    w2 = xd(3) ^ 2;
    xdd = A \ (b .* acc - p.l1 * rate .^ 2 .* sum(t .* ea)' - p.l2 * ud .^ 2 + w2 * sum(t .* r)');
    aP = xdd(1:2) + xdd(3) * S - w2 * r;
    aE = p.l1 * (acc' .* na - rate' .^ 2 .* ea);
    udd = sum(nu .* (aP - aE))' / p.l2;
    aD = aE + p.l2 / 2 * (udd' .* nu - ud' .^ 2 .* t);
    up = [0; p.g];
    own = (p.I1 + p.m1 * p.l1 ^ 2 / 4) * acc + p.m1 * p.g * p.l1 / 2 * cos(a)' + p.m2 * p.l1 * sum(na .* (aD + up))';
    bar = p.m2 * p.l2 / 2 * sum(nu .* (aD + up))' + p.I2 * udd;
    F = [p.m3 * (xdd(1:2) + up); p.I3 * xdd(3)];
    tau(i, :) = (own + U' * bar + J' * F)';
  end
end
