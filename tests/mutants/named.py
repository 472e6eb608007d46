"""Faults that were chosen by hand: each was once planted and seen by no test, or is the sibling of one that was."""

from __future__ import annotations

from dataclasses import dataclass

from mutants.operators import Mutant


@dataclass(frozen=True)
class Named:
    """A text of one module, which stands there once, and what it becomes."""

    module: str
    before: str
    after: str

    def mutant(self, text: str) -> Mutant:
        """The fault in the text of its module."""
        if text.count(self.before) != 1:
            raise ValueError(f"{self.module}: stands there {text.count(self.before)} times: {self.before!r}")
        start = text.index(self.before)
        return Mutant("named", text.count("\n", 0, start) + 1, start, start + len(self.before), self.before, self.after)


COMPARE, VERDICT, METRICS = "campaign/compare.py", "campaign/verdict.py", "metrics.py"
EVIDENCE, CANDIDATE = "campaign/evidence.py", "campaign/candidate_spec.py"
CONTINUATION, ALONG, CLOSURE = "reference/continuation.py", "reference/along.py", "reference/closure.py"
SIDES = "reference/sides.py"
PINOCCHIO, KERNELS, ROWS = "reference/pinocchio_loops.py", "reference/kernels.py", "reference/rows.py"
LINEAR, PROJECTION = "reference/linear.py", "reference/projection.py"
PLATFORM, REDUNDANT, REPLAY = "reference/platform_kernels.py", "reference/redundant.py", "reference/replay.py"
REFERENCE, LOAD, VALUES = "reference/mujoco_reference.py", "robots/load.py", "robots/values.py"
STRUCTURE, CHECK = "robots/assumptions/structure.py", "reference/check.py"

NAMED: dict[str, Named] = {
    # a case whose platform motions are apart
    "apart does not fail": Named(COMPARE, "failed = bool(apart) or any(", "failed = any("),
    "apart is not said": Named(COMPARE, "for name, error in kinematics.items() if not error <=", "for name, error in () if not error <="),
    "NaN platform passes": Named(COMPARE, "if not error <= KINEMATICS_BOUND", "if error > KINEMATICS_BOUND"),
    # bounds
    "OTHER_BRANCH x 100": Named(COMPARE, "OTHER_BRANCH = 1e-6", "OTHER_BRANCH = 1e-4"),
    "other branch not refused": Named(COMPARE, "if gaps[worst] > OTHER_BRANCH:", "if False:"),
    "KINEMATICS_BOUND x 100": Named(COMPARE, "KINEMATICS_BOUND = 1e-11", "KINEMATICS_BOUND = 1e-9"),
    "SHARE x 100": Named(VERDICT, "SHARE = 0.1", "SHARE = 10.0"),
    "SHARE / 100": Named(VERDICT, "SHARE = 0.1", "SHARE = 0.001"),
    "CORRECTION x 100": Named(CONTINUATION, "CORRECTION = 0.1", "CORRECTION = 10.0"),
    "LONGEST_STEP x 100": Named(CONTINUATION, "LONGEST_STEP = 0.2", "LONGEST_STEP = 20.0"),
    "correction ignored": Named(CONTINUATION, "<= self.tolerance.residual) & small & (", "<= self.tolerance.residual) & ("),
    "length ignored": Named(CONTINUATION, "& small & (moved <= LONGEST_STEP)", "& small"),
    "correction ignored along": Named(ALONG, "linked = near & (moved <= LONGEST_STEP)", "linked = moved <= LONGEST_STEP"),
    "length ignored along": Named(ALONG, "linked = near & (moved <= LONGEST_STEP)", "linked = near"),
    "sides not looked at": Named(CONTINUATION, "            accepted &= self._on_side(here, active, closed, accepted)\n", ""),
    "sides not looked at along": Named(ALONG, "        linked &= self._on_side(found, rows, found.at(slice(1, None)), linked)\n", ""),
    "sides not looked at, second engine": Named(PINOCCHIO, "if small and self._same_side(jacobian, after) else None", "if small else None"),
    "rows that turn over are a jump": Named(SIDES, "same[s] &= volume >= 0.0 and not negative", "same[s] = False"),
    "rows that turn over are no jump": Named(SIDES, "same[s] &= volume >= 0.0 and not negative", "same[s] = True"),
    "samples that differ factored alike": Named("reference/many.py", "        if other:\n            return False\n", ""),
    "sign of a pivot dropped": Named(LINEAR, "negative ^= head < 0.0", "negative ^= False"),
    "CORRECTION x 100, second engine": Named(PINOCCHIO, "CORRECTION = 0.1", "CORRECTION = 10.0"),
    "LONGEST_STEP x 100, second engine": Named(PINOCCHIO, "LONGEST_STEP = 0.2", "LONGEST_STEP = 20.0"),
    # checks of a model
    "structure not checked": Named(LOAD, "    _check(described, model, file, text, None)\n", ""),
    "numbers not checked": Named(LOAD, "        _check(described, model, file, text, values, elements)\n    loaded", "        pass\n    loaded"),
    "edited numbers not checked": Named(LOAD, "        _check(described, model, file, text, values, elements)\n    return", "    return"),
    "places that disagree not refused": Named(LOAD, "    elif values is not None and elements is not None:", "    elif False:"),
    "rank of a pose not tested": Named(REFERENCE, "bad = (rank < len(structure.passive)) | ~(", "bad = ~("),
    "speed of a pose not tested": Named(REFERENCE, "bad = (rank < len(structure.passive)) | ~(residual <= self._closer.tolerance.velocity * speed)", "bad = rank < len(structure.passive)"),
    "NaN in rates not seen": Named(PROJECTION, "worst = math.inf if math.isnan(value) else max(worst, abs(value))", "worst = max(worst, abs(value))"),
    "NaN speed passes": Named(REFERENCE, "| ~(residual <= self._closer.tolerance.velocity * speed)", "| (residual > self._closer.tolerance.velocity * speed)"),
    "rank at home not tested, second engine": Named(PINOCCHIO, "if rank < len(self.passive):", "if False:"),
    "open loops not checked": Named(CHECK, "if not self.residual <= self.closer.tolerance.residual:", "if False:"),
    "mobility not checked": Named(CHECK, "if mobility > active or (", "if ("),
    "platform's place not checked": Named(CHECK, "ok = gap <= SAME_PLACE", "ok = True"),
    # errors and verdicts
    "peak error above the floor only": Named(METRICS, "zip(largest.tolist(), peaks", "zip(np.where(kept, difference, 0.0).max(axis=1).tolist(), peaks"),
    "rms error above the floor only": Named(METRICS, "for values in (difference, magnitude)", "for values in (np.where(kept, difference, 0.0), magnitude)"),
    "the least uncertainty": Named(EVIDENCE, "return max((value for value in found", "return min((value for value in found"),
    "second engine not counted": Named(EVIDENCE, "found = (self.power_residual(mass_model), self.engine_spread(mass_model, joint), left_open)", "found = (self.power_residual(mass_model), left_open)"),
    "power balance not counted": Named(EVIDENCE, "found = (self.power_residual(mass_model), self", "found = (self"),
    "what is left open not counted": Named(EVIDENCE, "self.engine_spread(mass_model, joint), left_open)", "self.engine_spread(mass_model, joint))"),
    "a case's bound ignored": Named(CANDIDATE, 'return self.model_copy(update={"bound": case.bounds[joint]})', "return self"),
    "a case's bound ignored in a row": Named(COMPARE, "judged = candidate.in_case(case.spec, joint)", "judged = candidate"),
    "uncertainty ignored in a row": Named(COMPARE, "error.peak_error, uncertainty),", "error.peak_error),"),
    "undecided is no failure": Named(VERDICT, "FAILURES = frozenset({FAIL, UNEXPECTED_PASS, UNDECIDED})", "FAILURES = frozenset({FAIL, UNEXPECTED_PASS})"),
    # rows of constraints
    "row of a gear halved": Named(ROWS, "jac[row, dof_of[s1]] = 1.0", "jac[row, dof_of[s1]] = 0.5"),
    "slope of a gear halved": Named(ROWS, "jac[row, dof_of[s2]] = -_slope(", "jac[row, dof_of[s2]] = -0.5 * _slope("),
    "row of a spin halved": Named(ROWS, "                jac[row, d] = s\n", "                jac[row, d] = 0.5 * s\n"),
    "row of a tendon halved": Named(ROWS, "jac[row, dof_of[j]] += tendons[s1, j]", "jac[row, dof_of[j]] += 0.5 * tendons[s1, j]"),
    "row of the other tendon halved": Named(ROWS, "jac[row, dof_of[j]] -= slope * tendons[s2, j]", "jac[row, dof_of[j]] -= 0.5 * slope * tendons[s2, j]"),
    "row of a weld's turn halved": Named(ROWS, "jac[two, d] += sign * cdof[d, 1]", "jac[two, d] += 0.5 * sign * cdof[d, 1]"),
    "row of a connect halved": Named(ROWS, "jac[two, d] += sign * (", "jac[two, d] += 0.5 * sign * ("),
    "third component of a turn zeroed": Named(ROWS, "        jac[three, d] += sign * cdof[d, 2]\n", ""),
    "third component of a turn's residual zeroed": Named(ROWS, "sign * x, sign * y, sign * z", "sign * x, sign * y, 0.0"),
    "second component of a turn's residual zeroed": Named(ROWS, "sign * x, sign * y, sign * z", "sign * x, 0.0, sign * z"),
    "third component of a turn's rate zeroed": Named(ROWS, "out[row + 3 + i] = a[b1, i] - a[b2, i]", "out[row + 3 + i] = a[b1, i] - a[b2, i] if i < 2 else 0.0"),
    # an applied force
    "moment arm of a force turned round": Named(PROJECTION, "    rx, ry, rz = point[0] - com[0], point[1] - com[1], point[2] - com[2]\n    for k in range(depth):", "    rx, ry, rz = com[0] - point[0], com[1] - point[1], com[2] - point[2]\n    for k in range(depth):"),
    "no moment arm": Named(PROJECTION, "    rx, ry, rz = point[0] - com[0], point[1] - com[1], point[2] - com[2]\n    for k in range(depth):", "    rx, ry, rz = 0.0, 0.0, 0.0\n    for k in range(depth):"),
    "force turned round in replay": Named(REPLAY, "return name, reference.base_rotation @ self._force", "return name, -reference.base_rotation @ self._force"),
    "force not in the base's frame in replay": Named(REPLAY, "return name, reference.base_rotation @ self._force", "return name, self._force"),
    "force on the body's origin in replay": Named(REPLAY, "        target=site,\n", "        target=spec.site(site).parent.add_site(name='workbench end').name,\n"),
    "force turns with the platform in replay": Named(REPLAY, "        refsite=origin.name,\n", ""),
    # friction of redundant actuation
    "friction of excess actuators dropped": Named(REDUNDANT, "dry = structure.friction.actuated * direction(qd)", "dry = 0.0 * direction(qd)"),
    "friction of excess actuators not given back": Named(REDUNDANT, "work[:, :, None])[:, :, 0] + dry", "work[:, :, None])[:, :, 0]"),
    "friction of excess actuators counted twice": Named(REDUNDANT, "work = found.tau - dry[:, columns]", "work = found.tau"),
    # inertia of a turned frame
    "inertia not turned": Named(VALUES, "matrix @ np.diag(model.body_inertia[body]) @ matrix.T", "np.diag(model.body_inertia[body])"),
    "inertia turned the wrong way": Named(VALUES, "matrix @ np.diag(model.body_inertia[body]) @ matrix.T", "matrix.T @ np.diag(model.body_inertia[body]) @ matrix"),
    # NaN
    "NaN in a residual not seen": Named(KERNELS, "        if math.isnan(res[i]):\n            worst = math.inf\n", ""),
    "NaN of the platform's side not seen": Named(PLATFORM, "            if math.isnan(value):\n                worst = math.inf\n", ""),
    "NaN in free closure not seen": Named(CLOSURE, "            if not np.isfinite(residual):\n                break\n", ""),
}  # fmt: skip

EQUIVALENT: dict[str, str] = {
    "NaN speed passes": "the kernel makes a row that is no number an infinite residual, and so the residual is never NaN",
    "open loops not checked": "a model whose loops stay open is refused before, when they are closed at home; the check"
    " only says so once more",
    "length ignored": "steps are cut to 1 - 1e-9 of the longest before they are taken, so none is longer; the comparison"
    " only says so once more",
    "NaN in free closure not seen": "numbers of a model are finite and at most 1e10 when it is loaded, and steps are at most"
    " 0.2 long, so no residual of a free closure is NaN; a second line of defence",
    "NaN of the platform's side not seen": "rates that overflow into no number give accelerations that are none, and those"
    " are refused, too; a second line of defence",
}
"""Named faults that no input can show, with the reason."""
