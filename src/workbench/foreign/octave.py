"""Octave and MATLAB: ``tau = name(p, q, qd, qdd)`` in a file name.m, run by Octave in a process of its own."""

from __future__ import annotations

import re
import shutil
from collections.abc import Mapping
from pathlib import Path

from workbench.arrays import FloatArray
from workbench.errors import SpecError
from workbench.foreign.fault import ForeignError
from workbench.foreign.served import ERROR, MARK, REPLY, REQUEST, Scratch, Served, read_reply, write_request

PROGRAMS = ("octave-cli", "octave")
START_S = 60.0

SERVER = """function workbench_server (folder, name, scratch, names)
  addpath (folder);
  names = strsplit (names, ' ');
  takes_force = false;
  try
    takes_force = nargin (name) >= 5;
  end
  printf ("MARKready %d\\n", takes_force); fflush (stdout);
  while true
    line = fgetl (stdin);
    if (! ischar (line))
      break;
    end
    if (isempty (line))
      continue;
    end
    try
      fid = fopen (fullfile (scratch, 'REQUEST'), 'r');
      head = fread (fid, 4, 'double');
      n = head(1); na = head(2); values = fread (fid, head(3), 'double');
      p = struct ();
      for k = 1:head(3)
        p.(names{k}) = values(k);
      end
      arrays = {};
      for k = 1:head(4)
        width = na;
        if (k == 4)
          width = 3;
        end
        arrays{k} = fread (fid, [width, n], 'double')';
      end
      fclose (fid);
      if (! takes_force)
        arrays = arrays(1:3);
      end
      tau = feval (name, p, arrays{:});
      if (! isnumeric (tau) || ! isreal (tau) || ndims (tau) != 2)
        error ('returns %s; expected real numbers of size %d x %d', class (tau), n, na);
      end
      fid = fopen (fullfile (scratch, 'REPLY'), 'w');
      fwrite (fid, size (tau), 'double');
      fwrite (fid, double (tau)', 'double');
      fclose (fid);
      printf ("MARKok\\n");
    catch err
      fid = fopen (fullfile (scratch, 'ERROR'), 'w');
      fprintf (fid, '%s\\n', strrep (err.message, "\\n", ' '));
      for k = 1:numel (err.stack)
        fprintf (fid, '%d %s\\n', err.stack(k).line, err.stack(k).file);
      end
      fclose (fid);
      printf ("MARKerror\\n");
    end
    fflush (stdout);
  end
end
"""

PARSE = re.compile(r"parse error(?: near line (\d+) of file \S+)?:?\s*(.*)")


def octave_program() -> str | None:
    """Where Octave lies; None where it is not installed."""
    return next((found for name in PROGRAMS if (found := shutil.which(name))), None)


class OctaveFormula:
    """One ``.m`` file."""

    def __init__(self, path: Path) -> None:
        self.path = path.resolve()
        program = octave_program()
        if program is None:
            raise SpecError(
                f"{path}: Octave is not installed (no octave-cli); Debian and Ubuntu have it as package octave",
                file=str(path),
            )
        self._program = program
        self._server: Served | None = None
        self._names: tuple[str, ...] = ()
        self._folder = Scratch()

    def __call__(
        self, parameters: Mapping[str, float], arrays: tuple[FloatArray, ...], joints: tuple[str, ...], seconds: float
    ) -> FloatArray:
        """Torques ``(rows, columns)`` as the file returns them.

        Raises
        ------
        ForeignError
            It failed, with its line; or took too long.
        """
        scratch = Path(self._folder.name)
        self.ready(parameters)
        assert self._server is not None
        write_request(scratch, list(parameters.values()), arrays)
        if self._server.ask(seconds) == "ok":
            return read_reply(scratch)
        raise self._fault((scratch / ERROR).read_text(encoding="utf-8", errors="replace"))

    def ready(self, parameters: Mapping[str, float]) -> None:
        """See that Octave runs and knows the parameters' names."""
        if self._server is None or not self._server.running or tuple(parameters) != self._names:
            self.close()
            self.start(tuple(parameters))

    def start(self, names: tuple[str, ...]) -> None:
        """Start Octave, which takes longer than a formula."""
        scratch = Path(self._folder.name)
        text = SERVER.replace("MARK", MARK).replace("REQUEST", REQUEST).replace("REPLY", REPLY).replace("ERROR", ERROR)
        (scratch / "workbench_server.m").write_text(text.replace("\x01", "\\001"), encoding="utf-8")
        arguments = ", ".join(_quoted(text) for text in (self.path.parent, self.path.stem, scratch, " ".join(names)))
        call = f"addpath ({_quoted(scratch)}); workbench_server ({arguments});"
        options = ["--no-gui", "--no-init-file", "--no-site-file", "--no-history", "--quiet"]
        self._names = names
        self._server = Served([self._program, *options, "--eval", call], scratch, START_S)

    def close(self) -> None:
        """End Octave."""
        if self._server:
            self._server.close()

    def _fault(self, text: str) -> ForeignError:
        message, *stack = text.splitlines() or [""]
        parse = PARSE.match(message)
        if parse:
            return ForeignError(f"does not parse: {parse[2]}", int(parse[1]) if parse[1] else None)
        for entry in stack:
            line, _, file = entry.partition(" ")
            if Path(file).name == self.path.name:
                return ForeignError(message, int(line) if int(line) > 0 else None)
        return ForeignError(message)


def _quoted(text: object) -> str:
    return "'" + str(text).replace("'", "''") + "'"
