"""False position in exported C: the twin of `smartshoe.kernels.memory.closer`."""

from __future__ import annotations


def closer_in_c(at: str) -> str:
    """C that moves ``at`` closer to where a rising function ``left`` is zero, in a loop that counts its steps by ``k``.

    It uses the variables ``low``, ``high``, ``under``, ``over`` and ``stays``, which begins as 0. Step 0 has the
    function's value at ``low``, step 1 that at ``high``; a loop that knows the former begins with step 1.
    """
    return f"""if (k == 0) {{
            under = left;
            {at} = high;
        }} else {{
            if (k == 1) {{
                over = left;
            }} else if (left < 0.0) {{
                low = {at};
                under = left;
                over *= stays == 1 ? 0.5 : 1.0;
                stays = 1;
            }} else {{
                high = {at};
                over = left;
                under *= stays == -1 ? 0.5 : 1.0;
                stays = -1;
            }}
            {at} = over > under ? low - (high - low) * (under / (over - under)) : low;
        }}"""
