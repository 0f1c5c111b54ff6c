"""The effect of speed on gait: smooth laws through published means of adults, each with its source.

They are means over people, good to some 5 %; a person's own numbers go into `simulators.people.person.Move`. "After"
means that the trend is the source's, while the numbers are rounded or interpolated here, not read from its tables.
"""

from __future__ import annotations

import math

TRANSITION_M_PER_S = 2.05  # walk to run, 2.0-2.1 m/s: after Hreljac 1993
WALK_RATIO_M_MIN = 0.0064  # step length over cadence, constant from about 1 m/s up: after Sekiya et al. 1996
LONGEST_RUNNING_STANCE = 0.47


def walking_cadence(speed_m_per_s: float, walk_ratio_m_min: float = WALK_RATIO_M_MIN) -> float:
    """Steps per minute: speed is step length times cadence, and their ratio is constant (after Sekiya et al. 1996).

    Below some 1.03 m/s (98 steps a minute) people take longer steps than that (Murakami and Otaka 2017), so the cadence
    of slow walking is some steps a minute too high here.
    """
    return math.sqrt(60.0 * speed_m_per_s / walk_ratio_m_min)


def walking_stance_share(speed_m_per_s: float) -> float:
    """Stance over stride: 0.66 at 0.8 m/s, 0.63 at 1.3, 0.59 at 2.0 (after Nilsson and Thorstensson 1987)."""
    return min(max(0.63 - 0.056 * (speed_m_per_s - 1.3), 0.52), 0.70)


def running_cadence(speed_m_per_s: float) -> float:
    """Steps per minute: 165 at 2.7 m/s, 171 at 3.5 (after Cavanagh and Kram 1989)."""
    return 146.0 + 7.0 * speed_m_per_s


def running_stance_share(speed_m_per_s: float) -> float:
    """Stance over stride: a contact of 0.28 s at 2.7 m/s, 0.22 s at 4.5 (after Nilsson and Thorstensson 1987)."""
    contact_s = 0.46 / math.sqrt(speed_m_per_s)
    return min(contact_s * running_cadence(speed_m_per_s) / 120.0, LONGEST_RUNNING_STANCE)


def stride_time_cv(speed_m_per_s: float) -> float:
    """Stride time varies more as speed falls: 2.6 % at 0.8 m/s, 1.6 at 1.3, 1.0 at 2.0 (after Beauchet et al. 2009)."""
    return min(0.016 * (1.3 / speed_m_per_s), 0.06)


def load_cv(speed_m_per_s: float) -> float:
    """Loads vary more as speed rises: 2.0 % at 0.8 m/s, 3.0 at 1.3, 4.3 at 2.0 (after Masani et al. 2002)."""
    return min(0.005 + 0.019 * speed_m_per_s, 0.08)


def modulation(speed_m_per_s: float) -> float:
    """How much deeper walking's valley and higher its peaks are than at 1.3 m/s, as a share.

    It gives a first peak of 0.95 body weights at 1 m/s, 1.03 at 1.3, 1.25 at 2 and a valley of 0.74, 0.71 and 0.53: the
    trend of Nilsson and Thorstensson 1989, somewhat weaker. Below 1 m/s the shape does not change.
    """
    return min(max(0.45 * (speed_m_per_s - 1.3), -0.15), 0.5)
