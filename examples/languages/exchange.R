# What a formula in R shares with the workbench, in base R: IN.json IN.csv OUT.csv (docs/languages.md).
# serve(formula) calls formula(p, q, qd, qdd, force): p a list, the others matrices with a row per sample, SI.
serve <- function(formula) {
  files <- commandArgs(trailingOnly = TRUE)
  json <- readLines(files[1])
  pair <- regmatches(json, regexec('"(.+)": ([-+.0-9eE]+)', json))
  pair <- pair[lengths(pair) == 3]
  p <- setNames(lapply(pair, function(one) as.numeric(one[3])), sapply(pair, `[`, 2))
  data <- read.csv(files[2])
  column <- function(prefix, names) as.matrix(data[paste0(prefix, names)])
  joints <- seq_len(sum(grepl("^q[0-9]+$", names(data))))
  force <- if ("fx" %in% names(data)) column("f", c("x", "y", "z"))
  tau <- formula(p, column("q", joints), column("qd", joints), column("qdd", joints), force)
  dimnames(tau) <- list(NULL, paste0("tau", joints))
  tau[] <- sprintf("%.17g", tau)
  write.csv(tau, files[3], row.names = FALSE, quote = FALSE)
}
