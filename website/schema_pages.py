"""Pages of the campaign file and the robot file: every table and key, from the schemas that check them."""

from __future__ import annotations

import ast
import inspect
import re
import textwrap
import types
import typing
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt, MaxLen, MinLen
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from workbench.campaign.motion_spec import MOTIONS
from workbench.campaign.spec import Campaign
from workbench.robots.robot_file import RobotSpec

TABLE = "| key | value | where not given | meaning |\n|---|---|---|---|"


CAMPAIGN = """# Campaign file, key by key

Made from the schema that checks campaign files, so every key is here and no other.
[Campaign files](../docs/campaign.md) explains them with examples, [sweeps](../docs/sweeps.md) the table `[sweep]`.

"""
ROBOT = """# Robot file, key by key

Made from the schema that checks robot files, so every key is here and no other. [Robots](../docs/robots.md) explains
them with examples.

"""


def campaign_page(repository: Path) -> str:
    """Give the page of the campaign file."""
    return CAMPAIGN + "\n".join(_tables(Campaign))


def robot_page(repository: Path) -> str:
    """Give the page of the robot file."""
    return ROBOT + "\n".join(_tables(RobotSpec))


def tables(root: type[BaseModel]) -> dict[type[BaseModel], str]:
    """Schemas of a document's tables with their headings, each once, in the order in which they are named."""
    found: dict[type[BaseModel], str] = {}
    waiting: list[tuple[str, type[BaseModel]]] = [("", root)]
    while waiting:
        heading, model = waiting.pop(0)
        if model not in found:
            found[model] = heading
            for name, field in model.model_fields.items():
                waiting += _inner(name, field.annotation, heading)
    return found


def _tables(root: type[BaseModel]) -> Iterator[str]:
    """Lines of a document's tables."""
    for model, heading in tables(root).items():
        yield f"## {f'`{heading}`' if heading else 'At the top'}\n"
        yield f"{_prose(inspect.getdoc(model) or '')}\n"
        yield TABLE
        meanings = field_docstrings(model)
        for name, field in model.model_fields.items():
            cells = (f"`{name}`", _shape(field), _default(field), _prose(meanings.get(name, "")))
            yield f"| {' | '.join(_cell(cell) for cell in cells)} |"
        yield ""


def _inner(name: str, annotation: Any, above: str) -> list[tuple[str, type[BaseModel]]]:
    """Tables that a key's value is made of, with their headings."""
    found = []
    path = f"{above.partition(' ')[0].strip('[]')}.{name}" if above else name
    for model, many, named in _models(annotation, False, False):
        kind = next((kind for kind, motion in MOTIONS.items() if motion is model), "")
        heading = f"[[{path}]]" if many else f"[{path}.NAME]" if named else f"[{path}]"
        found.append((f'{heading} kind = "{kind}"' if kind else heading, model))
    return found


def _models(annotation: Any, many: bool, named: bool) -> Iterator[tuple[type[BaseModel], bool, bool]]:
    if inspect.isclass(annotation) and issubclass(annotation, BaseModel):
        yield annotation, many, named
        return
    origin = get_origin(annotation)
    for argument in get_args(annotation):
        yield from _models(argument, many or origin is list, named or origin is dict)


def field_docstrings(model: type[BaseModel]) -> dict[str, str]:
    """The strings that stand below the fields of a schema and of those that it extends, by key."""
    found: dict[str, str] = {}
    for cls in reversed(model.__mro__):
        if not issubclass(cls, BaseModel) or cls is BaseModel:
            continue
        (body,) = ast.parse(textwrap.dedent(inspect.getsource(cls))).body
        assert isinstance(body, ast.ClassDef)
        for before, after in zip(body.body, body.body[1:], strict=False):
            if (
                isinstance(before, ast.AnnAssign)
                and isinstance(before.target, ast.Name)
                and isinstance(after, ast.Expr)
                and isinstance(after.value, ast.Constant)
                and isinstance(after.value.value, str)
            ):
                found[before.target.id] = inspect.cleandoc(after.value.value)
    return found


def _shape(field: FieldInfo) -> str:
    return _described(field.annotation, field.metadata)


def _described(annotation: Any, metadata: Sequence[Any] = ()) -> str:
    """Words for a type and its limits."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is typing.Annotated:
        return _described(arguments[0], [*arguments[1:], *metadata])
    limits = _limits(metadata)
    if origin in (typing.Union, types.UnionType):
        inner = [_described(one, metadata) for one in arguments if one is not type(None)]
        return " or ".join(dict.fromkeys(inner))
    if origin is typing.Literal:
        return " or ".join(f'`"{one}"`' if isinstance(one, str) else f"`{one}`" for one in arguments)
    if origin is list:
        return f"list of {_described(arguments[0])}{limits}"
    if origin is dict:
        return f"table NAME = {_described(arguments[1])}"
    if inspect.isclass(annotation) and issubclass(annotation, BaseModel):
        return "table"
    words = {str: "text", float: "number", int: "whole number", bool: "true or false"}
    return words.get(annotation, str(annotation)) + limits


def _limits(metadata: Sequence[Any]) -> str:
    """``, > 0, at most 6``: limits of a number or of a length."""
    said = []
    for one in (inner for outer in metadata for inner in getattr(outer, "metadata", [outer])):
        for kind, sign in ((Gt, ">"), (Ge, ">="), (Lt, "<"), (Le, "<=")):
            if isinstance(one, kind):
                said.append(f"{sign} {getattr(one, kind.__name__.lower()):g}")
        if isinstance(one, MinLen) and one.min_length > 0:
            said.append(f"at least {one.min_length}")
        if isinstance(one, MaxLen):
            said.append(f"at most {one.max_length}")
    lengths = [text for text in said if text.startswith("at ")]
    if len(lengths) == 2 and lengths[0].split()[-1] == lengths[1].split()[-1]:
        said = [text for text in said if text not in lengths] + [f"exactly {lengths[0].split()[-1]}"]
    return "".join(f", {text}" for text in said)


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "**required**"
    value = field.default if field.default_factory is None else field.default_factory()  # type: ignore[call-arg]
    if value is None:
        return ""
    if isinstance(value, BaseModel):
        return ""
    text = {True: "true", False: "false"}.get(value, repr(value)) if isinstance(value, bool) else repr(value)
    return f"`{text.replace(chr(39), chr(34))}`"


def _prose(text: str) -> str:
    """A docstring as Markdown: what stands in double backticks, or in stars as a name, is code there."""
    return re.sub(r"``([^`]+)``|(?<!\w)\*(\w+)\*", lambda match: f"`{match[1] or match[2]}`", text)


def _cell(text: str) -> str:
    return re.sub(r"\s+", " ", text).replace("|", "\\|")
