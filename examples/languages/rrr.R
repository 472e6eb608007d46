# Planar 3-RRR by virtual work; Newton on the platform's pose, since the joints are given.
# workbench: { name = "rrr-r", bound = 1e-10 }
source("exchange.R")

one <- function(p, a, rate, acc) {
  B <- rbind(c(p$b1x, p$b2x, p$b3x), c(p$b1z, p$b2z, p$b3z))
  P <- rbind(c(0, p$p2x, p$p3x), c(0, 0, p$p3z)) - c(p$cx, p$cz)
  along <- function(u) rbind(cos(u), sin(u))
  across <- function(u) rbind(-sin(u), cos(u))
  times <- function(m, v) sweep(m, 2, v, `*`)
  ea <- along(a); na <- across(a)
  E <- B + p$l1 * ea
  x <- c(0, 0, 0)
  for (k in 1:50) {
    r <- rbind(c(cos(x[3]), -sin(x[3])), c(sin(x[3]), cos(x[3]))) %*% P
    S <- rbind(-r[2, ], r[1, ])
    d <- x[1:2] + r - E
    dx <- -solve(cbind(2 * t(d), 2 * colSums(d * S)), colSums(d^2) - p$l2^2)
    x <- x + dx
    if (max(abs(dx)) < 1e-15) break
  }
  u <- atan2(d[2, ], d[1, ])
  e <- along(u); nu <- across(u)
  A <- cbind(t(e), colSums(e * S))
  b <- p$l1 * colSums(e * na)
  J <- solve(A, diag(b))
  xd <- J %*% rate
  U <- (cbind(t(nu), colSums(nu * S)) %*% J - diag(p$l1 * colSums(nu * na))) / p$l2
  ud <- as.vector(U %*% rate)
  w2 <- xd[3]^2
  xdd <- solve(A, b * acc - p$l1 * rate^2 * colSums(e * ea) - p$l2 * ud^2 + w2 * colSums(e * r))
  aP <- xdd[1:2] + xdd[3] * S - w2 * r
  aE <- p$l1 * (times(na, acc) - times(ea, rate^2))
  udd <- colSums(nu * (aP - aE)) / p$l2
  aD <- aE + p$l2 / 2 * (times(nu, udd) - times(e, ud^2))
  up <- c(0, p$g)
  own <- (p$I1 + p$m1 * p$l1^2 / 4) * acc + p$m1 * p$g * p$l1 / 2 * cos(a) + p$m2 * p$l1 * colSums(na * (aD + up))
  bar <- p$m2 * p$l2 / 2 * colSums(nu * (aD + up)) + p$I2 * udd
  own + as.vector(t(U) %*% bar + t(J) %*% c(p$m3 * (xdd[1:2] + up), p$I3 * xdd[3]))
}

serve(function(p, q, qd, qdd, force) t(sapply(seq_len(nrow(q)), function(i) one(p, q[i, ], qd[i, ], qdd[i, ]))))
