# The 4-RPRP robot by virtual work in platform coordinates, docs/derivations/planar_4rprp.md.
# workbench: { name = "4rprp-r", bound = 1e-10 }
source("exchange.R")

# force (along s, along y) that a limb with r = B - A = (s, y) needs at B to move and to be carried
limb <- function(p, inertia, s, y, sd, yd, sdd, ydd) {
  q <- sqrt(s^2 + y^2); ws <- s / q; wy <- y / q
  qd <- ws * sd + wy * yd
  turn <- (ws * yd - wy * sd) / q
  qdd <- ws * sdd + wy * ydd + q * turn^2
  turnd <- (ws * ydd - wy * sdd - 2 * qd * turn) / q
  arm <- q - p$c3
  along <- p$m3 * (qdd - arm * turn^2) + p$m3 * p$g * wy
  moment <- (inertia + p$m3 * arm^2) * turnd + 2 * p$m3 * arm * qd * turn + (p$m2 * p$c2 + p$m3 * arm) * p$g * ws
  list(s = along * ws - moment / q * wy, y = along * wy + moment / q * ws)
}

serve(function(p, q, qd, qdd, force) {
  q1 <- q[, 1]; q2 <- q[, 2]; q3 <- q[, 3]
  z <- 0.5 * (p$b + (q1 - q3) * (q1 + q3) / p$b)
  y <- sqrt((q1 - z) * (q1 + z))
  low <- y - p$h
  x <- sqrt((q2 - low) * (q2 + low))
  half <- q * qd
  zd <- (half[, 1] - half[, 3]) / p$b
  yd <- (half[, 1] - z * zd) / y
  xd <- (half[, 2] - low * yd) / x
  half <- q * qdd + qd^2
  zdd <- (half[, 1] - half[, 3]) / p$b
  ydd <- (half[, 1] - z * zdd - zd^2 - yd^2) / y
  xdd <- (half[, 2] - low * ydd - yd^2 - xd^2) / x
  turn_x <- p$m2 * p$c2^2 + p$I2x + p$I3x
  turn_z <- p$m2 * p$c2^2 + p$I2z + p$I3z
  f1 <- limb(p, turn_x, z, y, zd, yd, zdd, ydd)
  f3 <- limb(p, turn_x, z - p$b, y, zd, yd, zdd, ydd)
  f2 <- limb(p, turn_z, x, low, xd, yd, xdd, ydd)
  f4 <- limb(p, turn_z, x - p$a, low, xd, yd, xdd, ydd)
  across <- p$m6 + p$m4
  px <- across * xdd + f2$s + f4$s - force[, 1]
  py <- (across + p$m4) * (ydd + p$g) + f1$y + f2$y + f3$y + f4$y - force[, 2]
  pz <- across * zdd + f1$s + f3$s - force[, 3]
  d2 <- px / x
  both <- (py - low * d2) / y
  d3 <- (z * both - pz) / p$b
  cbind(q1 * (both - d3), q2 * d2, q3 * d3)
})
