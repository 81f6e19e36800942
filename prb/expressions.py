"""Numbers as a person writes them in a declaration: a quantity, or a formula of named numbers.

A formula may add, multiply, divide, raise to powers, compare, choose (``a if b > 0 else c``) and call the functions
below; everything in it is in SI units.  It is parsed once and can do nothing else than arithmetic.
"""

import ast
import math
from collections.abc import Callable, Mapping
from functools import cache
from types import CodeType
from typing import Any

import numpy as np

from lab.sections import torsion_constant
from lab.units import to_si

#: What a number looks like in a document.
Written = str | float

_LONGEST = 1000
_ALLOWED = (
    ast.Expression, ast.BinOp, ast.UnaryOp, ast.Compare, ast.IfExp, ast.BoolOp, ast.Call, ast.Name, ast.Constant,
    ast.Add, ast.Sub, ast.Mult, ast.Div, ast.FloorDiv, ast.Mod, ast.Pow, ast.UAdd, ast.USub, ast.Not, ast.And, ast.Or,
    ast.Lt, ast.LtE, ast.Gt, ast.GtE, ast.Eq, ast.NotEq, ast.Load,
)  # fmt: skip


@cache
def gauss_node(index: float, count: float) -> float:
    """Gauss-Legendre node on [0, 1], counted from 0; 0 for the index -1 and 1 for ``count``: the ends."""
    if index < 0:
        return 0.0
    return 1.0 if index >= count else float(np.polynomial.legendre.leggauss(int(count))[0][int(index)] + 1.0) / 2.0


@cache
def gauss_weight(index: float, count: float) -> float:
    """Gauss-Legendre weight on [0, 1], counted from 0."""
    return float(np.polynomial.legendre.leggauss(int(count))[1][int(index)]) / 2.0


FUNCTIONS: Mapping[str, Any] = {
    "sin": math.sin, "cos": math.cos, "exp": math.exp, "sqrt": math.sqrt, "abs": abs, "min": min, "max": max,
    "pi": math.pi,
    "gauss_node": gauss_node, "gauss_weight": gauss_weight, "torsion_constant": torsion_constant,
}  # fmt: skip


class Number:
    """A number that may depend on named ones.

    Parameters
    ----------
    text
        As written.
    names
        What it depends on.
    value
        Its value in SI units where it depends on nothing, else None.
    """

    __slots__ = ("_code", "names", "text", "value")

    def __init__(self, text: str, names: frozenset[str], value: float | None, code: CodeType | None) -> None:
        self.text, self.names, self.value, self._code = text, names, value, code

    def __call__(self, known: dict[str, Any]) -> float:
        """Value with the names that ``environment`` prepared; ValueError in one line where there is none."""
        if self.value is not None:
            return self.value
        try:
            result = float(eval(self._code, known))  # type: ignore[arg-type]  # arithmetic alone, see _parsed
        except NameError as error:
            raise ValueError(f"{self.text!r}: {error.name} is not a number here") from None
        except (ArithmeticError, ValueError, TypeError, IndexError) as error:
            raise ValueError(f"{self.text!r} cannot be evaluated: {error}") from None
        if not math.isfinite(result):
            raise ValueError(f"{self.text!r} is {result}, not a finite number")
        return result


def environment(*numbers: Mapping[str, float]) -> dict[str, Any]:
    """Names for ``Number``: those given, later ones before earlier ones, and the functions."""
    known: dict[str, Any] = {"__builtins__": {}, **FUNCTIONS}
    for mapping in numbers:
        known.update(mapping)
    return known


@cache
def read(written: Written, unit: str) -> Number:
    """Number of a document, in the SI ``unit``.

    Raises
    ------
    ValueError
        In one line, for text that is neither quantity nor formula, and for a bare number that needs a unit.

    Examples
    --------
    >>> read("23.66 mm", "m").value
    0.02366
    >>> read("2 * length", "m")(environment({"length": 0.05}))
    0.1
    """
    text = str(written).strip()
    if len(text) > _LONGEST:
        raise ValueError(f"{text[:40]!r}... is longer than {_LONGEST} characters; name its parts in 'define'")
    try:
        tree = ast.parse(text, mode="eval")
    except (SyntaxError, ValueError):
        return Number(text, frozenset(), _quantity(text, unit), None)
    names = _names(tree, text)
    number = Number(text, names, None, compile(_Floats().visit(tree), "<declaration>", "eval"))
    if names:
        return number
    value = number(environment())
    if isinstance(tree.body, ast.Constant | ast.UnaryOp) and value != 0.0 and unit != "1":
        raise ValueError(f"{text} has no unit; write it like '{text} {unit}'")
    return Number(text, names, value, None)


def _quantity(text: str, unit: str) -> float:
    try:
        return to_si(text, unit)
    except ValueError as error:
        unread = str(error).startswith("cannot read")
        raise ValueError(f"{error}, or as a formula" if unread else str(error)) from None


def _names(tree: ast.Expression, text: str) -> frozenset[str]:
    """Names that a formula uses, functions left out; ValueError for anything that is not arithmetic."""
    called = {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.BitXor):
            raise ValueError(f"{text!r}: write powers as 'a ** b'")
        if not isinstance(node, _ALLOWED) or (isinstance(node, ast.Call) and node.keywords):
            raise ValueError(f"{text!r} is neither a quantity like '1 mm' nor a formula of sums, products and powers")
        if isinstance(node, ast.Constant) and type(node.value) not in (int, float):
            raise ValueError(f"{text!r}: {node.value!r} is not a number")
        if isinstance(node, ast.Call) and not (isinstance(node.func, ast.Name) and callable(_function(node.func.id))):
            functions = ", ".join(name for name, item in FUNCTIONS.items() if callable(item))
            raise ValueError(f"{text!r} calls something unknown; there are {functions}")
        if isinstance(node, ast.Name) and id(node) not in called and (node.id not in FUNCTIONS or _function(node.id)):
            names.add(node.id)
    return frozenset(names)


def _function(name: str) -> Callable[..., float] | None:
    item = FUNCTIONS.get(name)
    return item if callable(item) else None


class _Floats(ast.NodeTransformer):
    """Makes every constant a float, so that towers of powers overflow instead of filling the memory."""

    def visit_Constant(self, node: ast.Constant) -> ast.Constant:
        """A constant as a float."""
        return ast.copy_location(ast.Constant(float(node.value)), node)  # type: ignore[arg-type]
