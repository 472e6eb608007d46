"""Beginnings of a formula in other languages, as ``workbench new --language`` writes them."""

from __future__ import annotations

OCTAVE = """function tau = {name}_octave(p, q, qd, qdd)
  % The formula that is held against MuJoCo: workbench run {name}.toml --candidates {name}_octave.m
  % The same file runs in MATLAB. q, qd, qdd, tau: n x {count}, SI; p.m, p.a, p.g: read from the model.
  % A bound may stand here:  workbench: {{ name = "{name}-octave" }}
  % To begin with: the driven bars alone, as if nothing hung on them.
  tau = p.m * p.a ^ 2 / 3 * qdd + p.m * p.g * p.a / 2 * cos(q);
end
"""

C = """/* The formula that is held against MuJoCo: workbench run {name}.toml --candidates {name}_c.c
   It is compiled with cc. A bound may stand here:  workbench: {{ name = "{name}-c" }} */
#include <math.h>

/* parameters that the formula uses, once for the workbench and once as places in p */
#define PARAMETERS X (m) X (a) X (g)
#define X(name) name,
enum {{ PARAMETERS }};
#undef X
#define X(name) #name " "
const char workbench_parameters[] = PARAMETERS;

/* one sample: q, qd, qdd and tau have {count} entries, SI; 0 says that all is well */
int
{name}_c (const double *p, const double *q, const double *qd, const double *qdd, double *tau)
{{
  /* to begin with: the driven bars alone, as if nothing hung on them */
  for (int i = 0; i < {count}; i++)
    tau[i] = p[m] * p[a] * p[a] / 3 * qdd[i] + p[m] * p[g] * p[a] / 2 * cos (q[i]);
  return 0;
}}
"""

PROGRAM = """#!/usr/bin/awk -f
# The formula that is held against MuJoCo: workbench run {name}.toml --candidates ./{name}_program
# A program in any language: it is called with three names of files, IN.json IN.csv OUT.csv, reads the parameters from
# the first and the samples from the second (columns q1.. qd1.. qdd1.. fx fy fz, SI), and writes tau1.. to the third.
BEGIN {{
  while ((getline line < ARGV[1]) > 0)
    if (split(line, part, /"/) >= 3) {{ value = part[3]; gsub(/[:, ]/, "", value); p[part[2]] = value + 0 }}
  FS = ","
  getline line < ARGV[2]
  for (i = 1; i <= {count}; i++) printf "tau%d%s", i, (i < {count} ? "," : "\\n") > ARGV[3]
  while ((getline < ARGV[2]) > 0)
    for (i = 1; i <= {count}; i++) {{
      # to begin with: the driven bars alone, as if nothing hung on them
      tau = p["m"] * p["a"] ^ 2 / 3 * $(2 * {count} + i) + p["m"] * p["g"] * p["a"] / 2 * cos($i)
      printf "%.17g%s", tau, (i < {count} ? "," : "\\n") > ARGV[3]
    }}
  exit 0
}}
"""

JULIA = """# The formula that is held against MuJoCo: workbench run {name}.toml --candidates {name}_julia.jl
# Called with three names of files: IN.json (parameters), IN.csv (samples), OUT.csv (torques). Packages: JSON.
using DelimitedFiles, JSON
p = JSON.parsefile(ARGS[1])["parameters"]
data, names = readdlm(ARGS[2], ','; header = true)
column(prefix) = hcat([data[:, findfirst(==("$prefix$i"), vec(names))] for i in 1:{count}]...)
q, qd, qdd = column("q"), column("qd"), column("qdd")
# to begin with: the driven bars alone, as if nothing hung on them
tau = p["m"] * p["a"]^2 / 3 .* qdd .+ p["m"] * p["g"] * p["a"] / 2 .* cos.(q)
open(ARGS[3], "w") do io
    println(io, join(["tau$i" for i in 1:{count}], ","))
    writedlm(io, tau, ',')
end
"""

R = """# The formula that is held against MuJoCo: workbench run {name}.toml --candidates {name}_r.R
# Called with three names of files: IN.json (parameters), IN.csv (samples), OUT.csv (torques). Needs no package.
files <- commandArgs(trailingOnly = TRUE)
pair <- regmatches(json <- readLines(files[1]), regexec('"(.+)": ([-+.0-9eE]+)', json))
p <- lapply(setNames(sapply(pair, `[`, 3), sapply(pair, `[`, 2)), as.numeric)
data <- read.csv(files[2])
column <- function(prefix) as.matrix(data[paste0(prefix, 1:{count})])
q <- column("q"); qd <- column("qd"); qdd <- column("qdd")
# to begin with: the driven bars alone, as if nothing hung on them
tau <- p$m * p$a^2 / 3 * qdd + p$m * p$g * p$a / 2 * cos(q)
colnames(tau) <- paste0("tau", 1:{count})
tau[] <- sprintf("%.17g", tau)
write.csv(tau, files[3], row.names = FALSE, quote = FALSE)
"""

LANGUAGES = {
    "octave": ("{name}_octave.m", OCTAVE),
    "c": ("{name}_c.c", C),
    "julia": ("{name}_julia.jl", JULIA),
    "r": ("{name}_r.R", R),
    "program": ("{name}_program", PROGRAM),
}
"""Language -> name of the file and its text."""
