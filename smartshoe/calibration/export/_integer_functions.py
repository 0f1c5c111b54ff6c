"""C99 code of the integer arithmetic of exported filters: products, quotients, roots, powers of 64-bit counts."""

from __future__ import annotations

import math
from collections.abc import Sequence, Set
from fractions import Fraction

MOST = 2**59
"""Largest count, so that a sum of four stays within 64 bits."""
REAL_FUNCTIONS = ("exp", "expm1", "log", "log1p", "pow", "sqrt", "tanh", "fabs", "fmax", "fmin")
"""Functions of <math.h> that have an integer twin, called NAME_q, a name that no block uses itself."""

_LOGARITHM_TERMS = 9  # of an odd series in at most 0.2: the next is 0.2^19/19 = 3e-15
_EXPONENTIAL_TERMS = 14  # of a series in at most 0.35: the next is 0.35^15/15! = 1e-19


def functions_text(used: Set[str], fraction: int) -> str:
    """The functions ``used`` and those they call, ordered so that each is defined before it is called."""
    texts = _texts(fraction)
    needed: set[str] = set()
    open_ = list(used)
    while open_:
        name = open_.pop()
        if name not in needed:
            needed.add(name)
            open_ += [other for other in texts if other != name and f"{other}(" in texts[name]]
    return "\n\n".join(text for name, text in texts.items() if name in needed)


def _texts(fraction: int) -> dict[str, str]:
    series = _listed([Fraction(1, n) for n in range(_EXPONENTIAL_TERMS, 0, -1)], fraction)
    odd_series = _listed([Fraction(2, n) for n in range(2 * _LOGARITHM_TERMS - 1, 0, -2)], fraction)
    one = f"INT64_C({2**fraction})"
    most = f"INT64_C({MOST})"
    ln2 = f"INT64_C({round(Fraction(math.log(2.0)) * 2**fraction)})"
    up = 64 - fraction
    return {
        "held_q": f"""\
/* No count is larger than 2^{MOST.bit_length() - 1}. */
static int64_t held_q(int64_t a)
{{
    return a > {most} ? {most} : (a < -{most} ? -{most} : a);
}}""",
        "fabs_q": """\
static int64_t fabs_q(int64_t a)
{
    return a < 0 ? -a : a;
}""",
        "fmax_q": """\
static int64_t fmax_q(int64_t a, int64_t b)
{
    return a > b ? a : b;
}""",
        "fmin_q": """\
static int64_t fmin_q(int64_t a, int64_t b)
{
    return a < b ? a : b;
}""",
        "rounded_q": """\
/* a/2^shift to the nearest integer; only what is not negative is shifted,
   since C leaves the other to the compiler. */
static int64_t rounded_q(int64_t a, int shift)
{
    const int64_t half = ((int64_t)1 << shift) >> 1;

    return a < 0 ? -((half - a) >> shift) : (a + half) >> shift;
}""",
        "times_q": f"""\
/* a b, held where it is too large: 64 bits by 64, of which the middle is kept. */
static int64_t times_q(int64_t a, int64_t b)
{{
    const uint64_t p = (uint64_t)(a < 0 ? -a : a);
    const uint64_t q = (uint64_t)(b < 0 ? -b : b);
    const uint64_t p0 = (uint32_t)p, p1 = p >> 32, q0 = (uint32_t)q, q1 = q >> 32;
    const uint64_t low = p0 * q0;
    const uint64_t middle = p1 * q0 + p0 * q1 + (low >> 32);
    const uint64_t high = p1 * q1 + (middle >> 32);
    int64_t found;

    if (high >= UINT64_C({MOST >> up})) {{
        found = {most};
    }} else {{
        const uint64_t rest = (middle << 32) | (uint32_t)low;
        found = (int64_t)((high << {up}) + (rest >> {fraction}) + ((rest >> {fraction - 1}) & 1));
    }}
    return (a < 0) != (b < 0) ? -found : found;
}}""",
        "over_q": f"""\
/* a/b by long division, held where it is too large. */
static int64_t over_q(int64_t a, int64_t b)
{{
    const uint64_t p = (uint64_t)(a < 0 ? -a : a);
    const uint64_t q = (uint64_t)(b < 0 ? -b : b);
    uint64_t found, rest;
    int k;

    if (q == 0 || p / q >= UINT64_C({MOST >> fraction})) {{
        return (a < 0) != (b < 0) ? -{most} : {most};
    }}
    found = p / q;
    rest = p % q;
    for (k = 0; k < {fraction}; k++) {{
        rest <<= 1;
        found <<= 1;
        if (rest >= q) {{
            rest -= q;
            found |= 1;
        }}
    }}
    found += 2 * rest >= q ? 1 : 0;
    return (a < 0) != (b < 0) ? -(int64_t)found : (int64_t)found;
}}""",
        "sqrt_q": f"""\
/* Square root bit by bit; 0 of what is negative. */
static int64_t sqrt_q(int64_t a)
{{
    const uint64_t p = a > 0 ? (uint64_t)a : 0;
    uint64_t rest = 0, found = 0;
    int k;

    for (k = 0; k < {32 + fraction // 2}; k++) {{
        const uint64_t bits = k < 32 ? (p >> (62 - 2 * k)) & 3 : 0;
        const uint64_t tried = (found << 2) | 1;
        rest = (rest << 2) | bits;
        found <<= 1;
        if (rest >= tried) {{
            rest -= tried;
            found |= 1;
        }}
    }}
    return (int64_t)found;
}}""",
        "exp_q": f"""\
/* e^a: halves and doubles of a series. */
static int64_t exp_q(int64_t a)
{{
    static const int64_t factor[{_EXPONENTIAL_TERMS}] = {{{series}}};
    const int64_t doublings = (a < 0 ? a - {ln2} / 2 : a + {ln2} / 2) / {ln2};
    const int64_t rest = a - doublings * {ln2};
    int64_t sum = {one};
    int k;

    if (doublings > {MOST.bit_length() - 2 - fraction}) {{
        return {most};
    }}
    if (doublings < -{fraction + 1}) {{
        return 0;
    }}
    for (k = 0; k < {_EXPONENTIAL_TERMS}; k++) {{
        sum = {one} + times_q(times_q(rest, factor[k]), sum);
    }}
    return doublings < 0 ? rounded_q(sum, (int)-doublings) : held_q(sum * ((int64_t)1 << doublings));
}}""",
        "expm1_q": f"""\
static int64_t expm1_q(int64_t a)
{{
    return held_q(exp_q(a) - {one});
}}""",
        "log_q": f"""\
/* Natural logarithm; of what is not positive that of the smallest count. */
static int64_t log_q(int64_t a)
{{
    static const int64_t factor[{_LOGARITHM_TERMS}] = {{{odd_series}}};
    int64_t m = a > 0 ? a : 1, doublings = 0, z, square, sum = 0;
    int k;

    while (m < INT64_C({3 * 2 ** (fraction - 2)})) {{
        m *= 2;
        doublings--;
    }}
    while (m >= INT64_C({3 * 2 ** (fraction - 1)})) {{
        m = rounded_q(m, 1);
        doublings++;
    }}
    z = over_q(m - {one}, m + {one});
    square = times_q(z, z);
    for (k = 0; k < {_LOGARITHM_TERMS}; k++) {{
        sum = factor[k] + times_q(sum, square);
    }}
    return times_q(sum, z) + doublings * {ln2};
}}""",
        "log1p_q": f"""\
static int64_t log1p_q(int64_t a)
{{
    return log_q(held_q(a + {one}));
}}""",
        "pow_q": """\
/* a^b; 0 of what is not positive. */
static int64_t pow_q(int64_t a, int64_t b)
{
    return a > 0 ? exp_q(times_q(b, log_q(a))) : 0;
}""",
        "tanh_q": f"""\
static int64_t tanh_q(int64_t a)
{{
    const int64_t e = exp_q(a < 0 ? held_q(2 * a) : held_q(-2 * a));
    const int64_t found = over_q({one} - e, {one} + e);

    return a < 0 ? -found : found;
}}""",
    }


def _listed(values: Sequence[Fraction], fraction: int) -> str:
    return ", ".join(f"INT64_C({round(value * 2**fraction)})" for value in values)
