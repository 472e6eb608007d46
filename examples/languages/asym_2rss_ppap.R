# The 2RSS+PPaP robot by virtual work in end-point coordinates, docs/derivations/asym_2rss_ppap.md.
# workbench: { name = "2rss-r", bound = 1e-10 }
source("exchange.R")

# u . x = a, w . x = b
solve2 <- function(u, w, a, b) {
  det <- u[, 1] * w[, 2] - u[, 2] * w[, 1]
  cbind(w[, 2] * a - u[, 2] * b, u[, 1] * b - w[, 1] * a) / det
}

# a bar as a constant matrix of its end points: proximal, coupling, distal mass and shares of the weight
bar <- function(m, I, len, k) {
  i <- I / len^2
  list(pp = m * (1 - k)^2 + i, pd = m * k * (1 - k) - i, dd = m * k^2 + i, wp = m * (1 - k), wd = m * k)
}

serve(function(p, q, qd, qdd, force) {
  s2 <- sin(q[, 2]); c2 <- cos(q[, 2]); s3 <- sin(q[, 3]); c3 <- cos(q[, 3])
  q1 <- q[, 1]; qd1 <- qd[, 1]; qdd1 <- qdd[, 1]; qd2 <- qd[, 2]; qd3 <- qd[, 3]
  # arm tips C, D seen so that both rods end in the platform; second and third coordinate
  C <- cbind(-(p$L_left - p$l_left) - p$a1_left * c2, p$a1_left * s2)
  D <- cbind(p$L_right - p$l_right + p$a1_right * c3, p$a1_right * s3)
  tC <- p$a1_left * cbind(s2, c2); nC <- p$a1_left * cbind(c2, -s2)
  tD <- p$a1_right * cbind(-s3, c3); nD <- p$a1_right * cbind(-c3, -s3)
  rl <- p$a2_left^2 - q1^2; rr <- p$a2_right^2 - q1^2
  e <- D - C; span <- rowSums(e^2)
  along <- 0.5 * (rl - rr + span) / span
  up <- sign(e[, 1]) * sqrt(rl / span - along^2)
  x <- C + along * e + up * cbind(-e[, 2], e[, 1])
  u <- x - C; w <- x - D
  jq2 <- rowSums(u * tC); jq3 <- rowSums(w * tD)
  xd <- solve2(u, w, jq2 * qd2 - q1 * qd1, jq3 * qd3 - q1 * qd1)
  Cdd <- tC * qdd[, 2] + nC * qd2^2; Ddd <- tD * qdd[, 3] + nD * qd3^2
  common <- q1 * qdd1 + qd1^2
  xdd <- solve2(u, w, rowSums(u * Cdd) - common - rowSums((xd - tC * qd2)^2),
                rowSums(w * Ddd) - common - rowSums((xd - tD * qd3)^2))
  al <- bar(p$m1_left, p$I1_left, p$a1_left, p$k1_left); ar <- bar(p$m1_right, p$I1_right, p$a1_right, p$k1_right)
  bl <- bar(p$m2_left, p$I2_left, p$a2_left, p$k2_left); br <- bar(p$m2_right, p$I2_right, p$a2_right, p$k2_right)
  sw <- bar(p$m5, p$I5, p$a5, p$k5)
  g <- cbind(0, rep(p$g, nrow(q)))
  fC <- (al$dd + bl$pp) * Cdd + bl$pd * xdd - (al$wd + bl$wp) * g
  fD <- (ar$dd + br$pp) * Ddd + br$pd * xdd - (ar$wd + br$wp) * g
  carried <- bl$dd + br$dd + p$m3 + p$payload
  P <- carried * xdd + bl$pd * Cdd + br$pd * Ddd - (p$m3 + p$payload + bl$wd + br$wd) * g - force[, 2:3]
  # the parallelogram swings: its tip lies at (x2, sqrt(a5^2 - x2^2))
  zi <- 1 / sqrt(p$a5^2 - x[, 1]^2); slope <- -x[, 1] * zi
  zdd <- slope * xdd[, 1] - xd[, 1]^2 * p$a5^2 * zi^3
  P[, 1] <- P[, 1] + (sw$dd + p$m6) * (xdd[, 1] + slope * zdd) - p$g * (sw$wd + p$m6) * slope
  det <- u[, 1] * w[, 2] - u[, 2] * w[, 1]
  l2 <- (w[, 2] * P[, 1] - w[, 1] * P[, 2]) / det
  l3 <- (u[, 1] * P[, 2] - u[, 2] * P[, 1]) / det
  cbind((carried + p$m4 + p$m5 + p$m6) * qdd1 - force[, 1] - q1 * (l2 + l3),
        jq2 * l2 + rowSums(fC * tC), jq3 * l3 + rowSums(fD * tD))
})
