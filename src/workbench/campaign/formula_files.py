"""Python files with a user's formulas: run when the command line names them, and modules beside them for them alone.

A file that is named may import others that lie beside it, ``import geometry`` of ``geometry.py``. Nobody else finds
those: installed packages and Python's own modules go first, a library that looks for an optional package of that name
does not get it, and two files in different directories have each their own.
"""

from __future__ import annotations

import importlib.util
import sys
import threading
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from importlib.metadata import entry_points
from pathlib import Path
from types import CodeType, ModuleType

from workbench.campaign.bounded_call import UnrulyError, bounded, said
from workbench.errors import SpecError, did_you_mean
from workbench.reading import read_bytes

GROUP = "workbench.candidates"
"""Entry points of installed packages: each names a module with registered functions."""

LARGEST_SOURCE = 10_000_000


class _Uncached(SourceFileLoader):
    """Reads the source every time: a sign mended within a second leaves a file's size and second of saving alone."""

    def get_code(self, fullname: str) -> CodeType:
        """Compile what the file holds now."""
        return self.source_to_code(read_bytes(self.path, LARGEST_SOURCE), self.path)


def files_of(file: Path, siblings: Siblings | None) -> tuple[Path, ...]:
    """A file of code and those beside it that it has imported."""
    others = siblings.files if siblings else set()
    return (file, *sorted(path for path in others if path != file))


class Siblings:
    """Finds modules beside a file, for the code of that directory alone; keeps them out of ``sys.modules``."""

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self._origins: set[str] = set()
        self._modules: dict[str, ModuleType] = {}
        self._lock = threading.RLock()

    @property
    def files(self) -> set[Path]:
        """Files of the directory that were imported."""
        return {Path(origin) for origin in self._origins}

    @contextmanager
    def visible(self) -> Iterator[None]:
        """Let the code of the directory import its neighbours while the block runs."""
        with self._lock:
            taken = {name: sys.modules[name] for name in self._modules if name in sys.modules}
            sys.modules.update(self._modules)
            sys.meta_path.append(self)
            try:
                yield
            finally:
                sys.meta_path.remove(self)
                # every call of a formula ends here: most have no neighbours, and thousands of modules are loaded
                for name, module in list(sys.modules.items()) if self._origins else ():
                    if self._is_ours(getattr(module, "__file__", None)):
                        self._modules[name] = module
                        sys.modules.pop(name, None)
                sys.modules.update(taken)

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Find a module of the directory, asked for by code of the directory (`importlib.abc.MetaPathFinder`)."""
        if path is not None or not self._asked_from_here():
            return None
        spec = PathFinder.find_spec(fullname, [str(self.directory)])
        if spec is not None and isinstance(spec.loader, SourceFileLoader) and spec.origin:
            self._origins.add(spec.origin)
            spec.loader = _Uncached(spec.loader.name, spec.loader.path)
            return spec
        return None

    def _is_ours(self, file: object) -> bool:
        return isinstance(file, str) and file in self._origins

    def _asked_from_here(self) -> bool:
        frame = sys._getframe(1)
        while frame is not None:
            name = frame.f_code.co_filename
            if frame.f_globals.get("__name__") != __name__ and "importlib" not in name:
                return Path(name).is_relative_to(self.directory)
            frame = frame.f_back  # type: ignore[assignment]
        return False


def load_module(name: str, limit_s: float) -> tuple[ModuleType, Siblings | None]:
    """Run a Python file, or import what an installed entry point names.

    Parameters
    ----------
    name
        A path, or the entry point's name.
    limit_s
        Longest time that it may take.

    Raises
    ------
    SpecError
        No such file or entry point; or it does not run: with its own line.
    """
    path = Path(name)
    installed = {entry.name: entry for entry in entry_points(group=GROUP)}
    try:
        here = path.is_file()
    except (OSError, ValueError) as error:  # a name longer than the system allows, or with a null character
        raise SpecError(f"{name[:60]!r}: {getattr(error, 'strerror', None) or error}", file=name) from error
    if not here:
        if name in installed:
            return _run(name, installed[name].load, limit_s), None
        raise SpecError(
            f"{name}: no such Python file, nor an installed entry point of {GROUP}{did_you_mean(name, installed)}",
            file=name,
        )
    if path.suffix != ".py":
        raise SpecError(
            f"{name}: candidates stand in a file .py, .m, .c, .so, .jl, .R or in a program that can be run", file=name
        )
    whole = path.resolve()
    loader = _Uncached(f"workbench_candidates_{path.stem}", str(whole))
    spec = importlib.util.spec_from_loader(loader.name, loader)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    # dataclasses and pickle look a function's module up by its name
    sys.modules[spec.name] = module
    siblings = Siblings(whole.parent)

    def execute() -> ModuleType:
        with siblings.visible():
            loader.exec_module(module)
        return module

    return _run(name, execute, limit_s), siblings


def _run(name: str, load: Callable[[], ModuleType], limit_s: float) -> ModuleType:
    try:
        return bounded(load, limit_s)
    except UnrulyError as trouble:
        error = trouble.error
        if isinstance(error, SyntaxError):
            line = f":{error.lineno}" if error.lineno else ""
            raise SpecError(f"{name}{line}: {said(error.msg)}", file=name) from error
        if isinstance(error, UnicodeDecodeError):
            raise SpecError(f"{name}: not UTF-8 text (byte {error.start})", file=name) from error
        if isinstance(error, OSError) and error.filename == str(Path(name).resolve()):
            raise SpecError(f"{name}: {error.strerror or error}", file=name) from error
        own = [f for f in traceback.extract_tb(error.__traceback__) if Path(f.filename).name == Path(name).name]
        line = f":{own[-1].lineno}" if own else ""
        raise SpecError(f"{name}{line}: {trouble}", file=name) from error
