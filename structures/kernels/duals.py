"""Dual numbers in compiled code: a value, and its derivatives in several directions.

The sum, the product and each function of dual numbers carry the derivatives along by the chain rule. A kernel that is
compiled for them, from the source that serves plain numbers, computes the exact derivatives of what it computes.

A dual number is a vector of the processor: entry 0 is the value, the others are derivatives. In an array of dual
numbers the entries of each lie together, so Python fills it as an array of numbers with a last axis for these. A type
says how many they are: a run has as few as its directions need.

References
----------
Griewank and Walther, Evaluating Derivatives, 2nd ed. (SIAM 2008), section 3.1: forward mode in several
directions.
"""

import inspect
import math
import operator
from typing import Any, NamedTuple

from numba import types
from numba.core import cgutils
from numba.core.cgutils import ir  # type: ignore[attr-defined]
from numba.core.typeconv.castgraph import Conversion
from numba.core.typing.templates import signature
from numba.extending import intrinsic, lower_builtin, lower_cast, models, overload, register_model, type_callable
from numba.np.arrayobj import make_array, populate_array

from structures.kernels.pieces import OPTIONS
from structures.structure import Vector


class Four(NamedTuple):
    """Dual numbers have four entries."""


class Eight(NamedTuple):
    """Dual numbers have eight entries."""


class Sixteen(NamedTuple):
    """Dual numbers have sixteen entries."""


DOUBLE = ir.DoubleType()
INDEX = ir.IntType(32)
FUSED: dict[str, Any] = {"flags": ("contract",)}
"""Products and sums may be rounded together."""

WIDTHS: dict[Any, int] = {Four: 4, Eight: 8, Sixteen: 16}
"""The entries of a dual number: its value and its derivatives."""


class Lanes(NamedTuple):
    """An array of dual numbers for each group of directions, as plain numbers."""

    values: Vector
    """Groups × shape of the array × entries."""
    width: Any
    """Four, Eight or Sixteen."""


class Lane(NamedTuple):
    """One dual number for each group of directions, as plain numbers."""

    values: Vector
    """Groups × 1 × entries."""
    width: Any


class Dual(types.Type):  # type: ignore[misc]
    """Numba's type of a dual number."""

    def __init__(self, entries: int) -> None:
        super().__init__(name=f"Dual{entries}")
        self.vector = ir.VectorType(DOUBLE, entries)

    def can_convert_from(self, context: Any, other: Any) -> Any:
        """Return how well a plain number becomes a dual one."""
        return Conversion.safe if isinstance(other, types.Float | types.Integer) else None

    def unify(self, context: Any, other: Any) -> Any:
        """Return the type of a variable that holds a dual number here and a plain one there."""
        return self if isinstance(other, types.Float | types.Integer) else None


@register_model(Dual)
class _Model(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, kind.vector)


def _value(builder: Any, dual: Any) -> Any:
    return builder.extract_element(dual, INDEX(0))


def _with_value(builder: Any, dual: Any, value: Any) -> Any:
    return builder.insert_element(dual, value, INDEX(0))


def _constant(vector: Any, number: float) -> Any:
    return ir.Constant(vector, [number] * vector.count)


def _times(builder: Any, dual: Any, number: Any) -> Any:
    """Return the product of all entries with a number."""
    nothing = ir.Constant(dual.type, ir.Undefined)
    everywhere = ir.Constant(ir.VectorType(INDEX, dual.type.count), [0] * dual.type.count)
    filled = builder.shuffle_vector(builder.insert_element(nothing, number, INDEX(0)), nothing, everywhere)
    return builder.fmul(dual, filled, **FUSED)


def _scaled(builder: Any, dual: Any, slope: Any, value: Any) -> Any:
    """Return a function of a dual number, by its slope and its value."""
    return _with_value(builder, _times(builder, dual, slope), value)


@lower_cast(types.Float, Dual)
@lower_cast(types.Integer, Dual)
def _cast(context: Any, builder: Any, source: Any, target: Any, number: Any) -> Any:
    return _with_value(builder, _constant(target.vector, 0.0), context.cast(builder, number, source, types.float64))


def _multiplied(context: Any, builder: Any, a: Any, b: Any) -> Any:
    first, second = _value(builder, a), _value(builder, b)
    slopes = _times(builder, _with_value(builder, a, DOUBLE(0.0)), second)
    return builder.fadd(slopes, _times(builder, b, first), **FUSED)


def _divided(context: Any, builder: Any, a: Any, b: Any) -> Any:
    bottom = _value(builder, b)
    ratio = builder.fdiv(_value(builder, a), bottom)
    slopes = builder.fsub(a, _times(builder, b, ratio), **FUSED)
    return _scaled(builder, slopes, builder.fdiv(DOUBLE(1.0), bottom), ratio)


ARITHMETIC = {
    operator.add: lambda context, builder, a, b: builder.fadd(a, b, **FUSED),
    operator.sub: lambda context, builder, a, b: builder.fsub(a, b, **FUSED),
    operator.truediv: _divided,
}

IN_PLACE = {
    operator.add: operator.iadd,
    operator.sub: operator.isub,
    operator.truediv: operator.itruediv,
}

COMPARISONS = {
    operator.lt: "<", operator.le: "<=", operator.gt: ">", operator.ge: ">=", operator.eq: "==", operator.ne: "!=",
}  # fmt: skip


def _root(context: Any, builder: Any, a: Any) -> Any:
    """Return the square root. That of zero, of a contact that is open, has the slope zero and costs nothing."""
    x, zero = _value(builder, a), DOUBLE(0.0)
    result = cgutils.alloca_once_value(builder, _constant(a.type, 0.0))
    with builder.if_then(builder.fcmp_unordered("!=", x, zero)):
        root = builder.call(builder.module.declare_intrinsic("llvm.sqrt", [DOUBLE]), [x])
        builder.store(_scaled(builder, a, builder.fdiv(DOUBLE(0.5), root), root), result)
    return builder.load(result)


UNARY: dict[Any, Any] = {
    math.exp: lambda x: math.exp(x),
    math.log: lambda x: 1.0 / x,
    math.sin: lambda x: math.cos(x),
    math.cos: lambda x: -math.sin(x),
    math.tanh: lambda x: 1.0 - math.tanh(x) ** 2,
    math.atan: lambda x: 1.0 / (1.0 + x * x),
}
"""Functions of one number, and their slopes."""


def _is_number(kind: Any) -> bool:
    return isinstance(kind, Dual | types.Float | types.Integer)


def _define_binary(function: Any, result: Any, lower: Any, convert: bool = True) -> None:
    """Let a function of two numbers take dual ones; a plain one beside it has the derivatives zero.

    result: its type, if that is no dual number. convert: whether a plain number becomes a dual one; else another
    definition takes it.
    """

    @type_callable(function)  # type: ignore[untyped-decorator]
    def choose(context: Any) -> Any:
        def typer(a: Any, b: Any) -> Any:
            duals = [kind for kind in (a, b) if isinstance(kind, Dual)]
            if not duals or not (_is_number(a) and _is_number(b)):
                return None
            if len(duals) == 2 or convert:
                return signature(result or duals[0], duals[0], duals[0])
            return signature(duals[0], *(kind if isinstance(kind, Dual) else types.float64 for kind in (a, b)))

        return typer

    @lower_builtin(function, Dual, Dual)  # type: ignore[untyped-decorator]
    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return lower(context, builder, *args)


def _define_product(function: Any) -> None:
    """Let a product of a dual and a plain number cost one instruction."""
    _define_binary(function, None, _multiplied, convert=False)

    @lower_builtin(function, Dual, types.Float)  # type: ignore[untyped-decorator]
    @lower_builtin(function, types.Float, Dual)  # type: ignore[untyped-decorator]
    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        dual, plain = args if isinstance(sig.args[0], Dual) else reversed(args)
        return _times(builder, dual, plain)


def _define_unary(function: Any, lower: Any) -> None:
    """Let a function of one number take a dual one."""

    @type_callable(function)  # type: ignore[untyped-decorator]
    def choose(context: Any) -> Any:
        def typer(a: Any) -> Any:
            return a if isinstance(a, Dual) else None

        return typer

    @lower_builtin(function, Dual)  # type: ignore[untyped-decorator]
    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return lower(context, builder, args[0])


def _comparison(sign: str) -> Any:
    def lower(context: Any, builder: Any, a: Any, b: Any) -> Any:
        compare = builder.fcmp_unordered if sign == "!=" else builder.fcmp_ordered
        return compare(sign, _value(builder, a), _value(builder, b))

    return lower


def _choice(sign: str) -> Any:
    def lower(context: Any, builder: Any, a: Any, b: Any) -> Any:
        return builder.select(builder.fcmp_ordered(sign, _value(builder, a), _value(builder, b)), a, b)

    return lower


def _power(x: float, exponent: float) -> tuple[float, float, float]:
    """Return x^e, and its slopes over x and over e."""
    if x == 0.0:
        return x**exponent, 1.0 if exponent == 1.0 else 0.0, 0.0
    value = x**exponent
    return value, exponent * x ** (exponent - 1.0), value * math.log(x) if x > 0.0 else 0.0


def _raised(context: Any, builder: Any, a: Any, b: Any) -> Any:
    kind = types.UniTuple(types.float64, 3)
    sig = signature(kind, types.float64, types.float64)
    numbers = context.compile_internal(builder, _power, sig, [_value(builder, a), _value(builder, b)])
    value, by_base, by_exponent = cgutils.unpack_tuple(builder, numbers, 3)
    slopes = builder.fadd(_times(builder, a, by_base), _times(builder, b, by_exponent), **FUSED)
    return _with_value(builder, slopes, value)


def _smooth(function: Any, slope: Any) -> Any:
    def lower(context: Any, builder: Any, a: Any) -> Any:
        sig, x = signature(types.float64, types.float64), _value(builder, a)
        value = context.compile_internal(builder, lambda x: function(x), sig, [x])
        return _scaled(builder, a, context.compile_internal(builder, slope, sig, [x]), value)

    return lower


def _negative(context: Any, builder: Any, a: Any) -> Any:
    return builder.fneg(a)


def _size(context: Any, builder: Any, a: Any) -> Any:
    return builder.select(builder.fcmp_ordered("<", _value(builder, a), DOUBLE(0.0)), builder.fneg(a), a)


for _function, _lower in ARITHMETIC.items():
    _define_binary(_function, None, _lower)
    _define_binary(IN_PLACE[_function], None, _lower)
for _function in (operator.mul, operator.imul):
    _define_product(_function)
for _function, _sign in COMPARISONS.items():
    _define_binary(_function, types.boolean, _comparison(_sign))
for _function in (operator.pow, operator.ipow, pow):
    _define_binary(_function, None, _raised)
_define_binary(max, None, _choice(">"))
_define_binary(min, None, _choice("<"))
for _function, _slope in UNARY.items():
    _define_unary(_function, _smooth(_function, _slope))
_define_unary(math.sqrt, _root)
_define_unary(operator.neg, _negative)
_define_unary(abs, _size)
_define_unary(float, lambda context, builder, a: a)


@intrinsic  # type: ignore[untyped-decorator]
def _as_duals(context: Any, memory: Any, group: Any, width: Any) -> Any:
    """Return a group's dual numbers: an array that shares memory with numbers, groups × shape × entries."""
    entries = WIDTHS[width.instance_class]
    kind = types.Array(Dual(entries), memory.ndim - 2, "C", aligned=False)

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        source, target = make_array(sig.args[0])(context, builder, args[0]), make_array(kind)(context, builder)
        shape, strides = (cgutils.unpack_tuple(builder, part) for part in (source.shape, source.strides))
        start = builder.mul(context.cast(builder, args[1], sig.args[1], types.intp), strides[0])
        populate_array(
            target,
            data=cgutils.pointer_add(builder, source.data, start, target.data.type),
            shape=shape[1:-1],
            strides=strides[1:-1],
            itemsize=context.get_constant(types.intp, 8 * entries),
            meminfo=None,
        )
        return target._getvalue()

    return signature(kind, memory, group, width), build


as_duals: Any = _as_duals
"""The same for kernels: a function of the numbers, of the group, and of Four, Eight or Sixteen."""


@intrinsic  # type: ignore[untyped-decorator]
def _entry(context: Any, dual: Any) -> Any:
    return signature(types.float64, dual), lambda context, builder, sig, args: _value(builder, args[0])


@intrinsic  # type: ignore[untyped-decorator]
def _three_halves(context: Any, dual: Any) -> Any:
    """Return x^1.5, which needs no quotient for its slope."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        x = _value(builder, args[0])
        root = builder.call(builder.module.declare_intrinsic("llvm.sqrt", [DOUBLE]), [x])
        return _scaled(builder, args[0], builder.fmul(DOUBLE(1.5), root), builder.fmul(x, root))

    return signature(dual, dual), build


@intrinsic  # type: ignore[untyped-decorator]
def _cleared(context: Any, dual: Any, smallest: Any) -> Any:
    """Return a dual number whose entries below a number are zero."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        dual = args[0]
        kind, name = ir.FunctionType(dual.type, [dual.type]), f"llvm.fabs.v{dual.type.count}f64"
        size = builder.call(cgutils.get_or_insert_function(builder.module, kind, name), [dual])
        filled = _times(builder, _constant(dual.type, 1.0), args[1])
        return builder.select(builder.fcmp_ordered(">=", size, filled), dual, _constant(dual.type, 0.0))

    return signature(dual, dual, types.float64), build


@intrinsic  # type: ignore[untyped-decorator]
def _replaced(context: Any, dual: Any, value: Any) -> Any:
    """Return a dual number with another value."""
    return signature(dual, dual, types.float64), lambda context, builder, sig, args: _with_value(builder, *args)


with_value: Any = _replaced
entry_of: Any = _entry
three_halves: Any = _three_halves
cleared: Any = _cleared


def value_of(number: Any) -> Any:
    """Return the value of a number without its derivatives."""
    return number


def without_small(number: Any, smallest: float) -> Any:
    """Return a number, or zero where it is smaller, so that it does not become a subnormal one, which is slow."""
    return number if abs(number) >= smallest else 0.0


def where_dual(function: Any, of_duals: Any, number: int = 0, **options: Any) -> None:
    """Let a function be compiled in another way where its argument of this number is dual, or an array of duals."""

    def choose(*arguments: Any) -> Any:
        kind = arguments[number]
        return of_duals if isinstance(getattr(kind, "dtype", kind), Dual) else function

    choose.__signature__ = inspect.signature(function)  # type: ignore[attr-defined]
    overload(function, OPTIONS | {"forceinline": True} | options, strict=False, target="generic")(choose)


where_dual(value_of, lambda number: entry_of(number))
where_dual(without_small, lambda number, smallest: cleared(number, smallest))
