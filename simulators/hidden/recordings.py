"""Hidden-effect cases: recordings of a unit that has exactly the requested effects, at a requested strength.

*Strength* is the residual of the noise-free reading after the first-order baseline is fitted again
(`simulators.hidden._baseline`): its root mean square in percent of the reading at full-scale load. Each effect is
scaled alone, on the unit without the other effects and the nuisances.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from simulators.hidden import _protocols as protocols
from simulators.hidden._machine import machine_of
from simulators.hidden._scaling import SILENT, HiddenEffect, scaled
from simulators.hidden.effects import EFFECTS, SHARE_OF_RANGE, Hideable, Options, Subject, merged
from simulators.instruments import presets
from smartshoe.errors import UsageError
from smartshoe.protocol import Protocol
from smartshoe.recording import Recording

NUISANCES = ("load_cell_tare", "zero_offset", "delay", "gain_drift", "contact_area", "mild_hysteresis")
NUISANCE_PERCENT_FS = (0.03, 0.08)
# A mild loop of a kind that is never hidden: relays over two thresholds.
_MILD_HYSTERESIS = Hideable(
    "mild_hysteresis", "hysteresis", "wall", "strength", "1", 0.002, 0.2,
    lambda a, d, s: {"bladder": {"hysteresis": {"strength": a, "half_width_n": 30.0}}},
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class HiddenCase:
    """The result of `hide`.

    ``recordings`` are to be fitted, ``hold_out`` to judge the fit on. ``nuisances`` are small imperfections of every
    recording. ``noise_free`` are twins of ``recordings + hold_out`` without noise on load and reading; ``clean`` are
    also without the effects, but with the nuisances. Both are simulated on first access.
    """

    recordings: tuple[Recording, ...]
    hold_out: tuple[Recording, ...]
    effects: tuple[HiddenEffect, ...]
    nuisances: Mapping[str, HiddenEffect]
    seed: int
    full_scale_mbar: float
    noise_percent_fs: float
    options: Options
    noise_free_options: Options
    clean_options: Options
    protocols: tuple[Protocol, ...]

    @cached_property
    def noise_free(self) -> tuple[Recording, ...]:
        """Twins of all recordings without noise, but with effects and nuisances."""
        return _recorded(self.noise_free_options, self.protocols, self.seed)

    @cached_property
    def clean(self) -> tuple[Recording, ...]:
        """Twins of all recordings without noise and effects, but with nuisances."""
        return _recorded(self.clean_options, self.protocols, self.seed)


def hide(  # noqa: PLR0913 - a public verb
    effects: Mapping[str, float] | Sequence[str],
    *,
    strength_percent_fs: float | Mapping[str, float] = 1.0,
    protocol: str | Protocol = "rates",
    seed: int = 0,
    noise_percent_fs: float | None = None,
    coloured_share: float | None = None,
    nuisances: int = 2,
    recordings: int | None = None,
    hold_out: int = 1,
    sample_rate_hz: float = 100.0,
    unit: str | None = None,
) -> HiddenCase:
    """Recordings of a unit that has the named effects (`simulators.hidden.effects.EFFECTS`), and the truth about it.

    ``effects`` maps names to strengths in percent of full scale, or lists names, all of strength
    ``strength_percent_fs``. ``protocol`` is a name of `simulators.hidden._protocols` or a protocol. Arguments that are
    None are drawn from ``seed``: 0.1 to 0.3 % of noise, up to half of its variance coloured, two or three recordings,
    and one of the paper's units with its constants varied by a third and its arm up to eight times as strong.
    ``nuisances`` is the number of small imperfections (0.03 to 0.08 %), which are of no hidden family. ``hold_out``
    recordings come last, with the protocol's variant of rates and loads. Raises `UsageError` for an unknown name.
    """
    asked = _asked(effects, strength_percent_fs)
    # Given arguments do not change what is drawn for the others.
    rng = np.random.default_rng([seed, 1])
    count, noise, share = int(rng.integers(2, 4)), float(rng.uniform(0.1, 0.3)), float(rng.uniform(0.0, 0.5))
    count = count if recordings is None else recordings
    noise = noise if noise_percent_fs is None else noise_percent_fs
    share = share if coloured_share is None else coloured_share
    plans = _protocols(protocol, np.random.default_rng([seed, 3]), count, hold_out)
    subject = drawn_subject(rng, unit, plans[0].duration_s, "second_relaxation" in asked)
    load_noise_n, colour_s = float(rng.uniform(0.3, 0.8)), float(np.exp(rng.uniform(np.log(0.03), np.log(0.5))))
    logger = {"daq": {"sample_rate_hz": sample_rate_hz}}

    overlays: list[Options] = []
    found: list[HiddenEffect] = []
    # The range depends on compression, and all other strengths depend on the range.
    for name in sorted(asked, key=lambda n: n != "gas_compression"):
        overlay, effect = scaled(EFFECTS[name], asked[name], subject, plans[0], seed, logger)
        overlays.append(overlay)
        found.append(effect)
        if name == "gas_compression":
            subject = replace(subject, range_mbar=overlay["sensor"]["range_mbar"])
    annoyances = small_effects(rng, nuisances, {e.family for e in found}, subject, plans[0], seed, logger)

    small = [overlay for overlay, _ in annoyances.values()]
    noisy = merged({"load_noise_n": load_noise_n}, noise_options(noise, share, colour_s, {e.name for e in found}))
    clean = merged(subject.options(), logger, *small, SILENT)
    # A hidden kind of noise is added to the base noise.
    whole = merged(subject.options(), logger, *small, noisy, *overlays)
    made = _recorded(whole, plans, seed)
    fitted = len(made) - hold_out
    order = list(asked)
    return HiddenCase(
        recordings=made[:fitted],
        hold_out=made[fitted:],
        effects=tuple(sorted(found, key=lambda e: order.index(e.name))),
        nuisances={name: effect for name, (_, effect) in annoyances.items()},
        seed=seed,
        full_scale_mbar=subject.full_scale_mbar,
        noise_percent_fs=noise,
        options=whole,
        noise_free_options=merged(clean, *overlays),
        clean_options=clean,
        protocols=plans,
    )


def _asked(effects: Mapping[str, float] | Sequence[str], strength: float | Mapping[str, float]) -> dict[str, float]:
    if isinstance(effects, str):
        effects = [effects]
    if isinstance(effects, Mapping):
        asked = {name: float(value) for name, value in effects.items()}
    else:
        asked = {name: float(strength[name] if isinstance(strength, Mapping) else strength) for name in effects}
    for name, value in asked.items():
        if name not in EFFECTS:
            raise UsageError(f"effect {name!r} cannot be hidden: use one of {', '.join(EFFECTS)}")
        if not (np.isfinite(value) and value > 0):
            raise UsageError(f"strength of {name} is {value:g} % of full scale: give a positive number")
    return asked


def _protocols(protocol: str | Protocol, rng: np.random.Generator, fitted: int, held: int) -> tuple[Protocol, ...]:
    if isinstance(protocol, Protocol):
        built = [protocol] * (fitted + held)
    elif protocol in protocols.PROTOCOLS:
        built = [protocols.build(protocol, rng, other=k >= fitted) for k in range(fitted + held)]
    else:
        raise UsageError(f"protocol {protocol!r} is not known: use one of {', '.join(protocols.PROTOCOLS)}")
    return tuple(replace(p, name=f"{p.name}_{k + 1}") for k, p in enumerate(built))


def drawn_subject(rng: np.random.Generator, unit: str | None, duration_s: float, strong_arm: bool) -> Subject:
    """The unit; with ``strong_arm`` its arm is strong, since beside a weak one a second arm would pass for it."""
    names = sorted(presets.TABLE_1)
    drawn = names[int(rng.integers(len(names)))]
    vary = np.exp(rng.uniform(np.log(0.75), np.log(4 / 3), 3))
    # Arms stronger than Table 1's, as Table 2 requires (docs/paper_audit.md).
    vary[1:] *= np.exp(rng.uniform(*np.log((8.0, 24.0) if strong_arm else (1.0, 8.0))))
    if unit is not None:
        drawn, vary = unit, np.ones(3)
    base = presets.bladder(drawn)
    range_mbar = presets.sensor_range_pa(drawn) / 100.0
    k1, k2, c = (float(x) for x in vary * (base.k1, base.k2, base.c))
    return Subject(drawn, k1, k2, c, range_mbar, duration_s)


def noise_options(noise: float, share: float, colour_s: float, hidden: set[str]) -> Options:
    """White and coloured noise of the reading; a hidden kind of noise replaces the coloured part."""
    if hidden & {"coloured_noise", "heteroscedastic_noise"}:
        share = 0.0
    range_percent = SHARE_OF_RANGE * noise
    sensor: Options = {"noise_percent": range_percent * float(np.sqrt(1.0 - share))}
    if share > 0:
        coloured = range_percent * float(np.sqrt(share))
        sensor["noise"] = {"coloured_percent": coloured, "coloured_time_constant_s": colour_s}
    return {"sensor": sensor, "daq": {}}


def small_effects(
    rng: np.random.Generator,
    count: int,
    families: set[str],
    subject: Subject,
    protocol: Protocol,
    seed: int,
    logger: Options,
) -> dict[str, tuple[Options, HiddenEffect]]:
    known = {**EFFECTS, "mild_hysteresis": _MILD_HYSTERESIS}
    free = [name for name in NUISANCES if known[name].family not in families]
    names = [str(name) for name in rng.permutation(free)[:count]]
    sizes = rng.uniform(*NUISANCE_PERCENT_FS, size=len(names))
    # A nuisance delay stays within a sample, and a nuisance drift adds no temperature channel.
    sample_s = 1.0 / logger["daq"]["sample_rate_hz"]
    small = {
        **known,
        "delay": replace(EFFECTS["delay"], largest=sample_s),
        "gain_drift": replace(EFFECTS["gain_drift"], draw=_drift_by_the_clock),
    }
    return {
        name: scaled(small[name], float(size), subject, protocol, seed, logger)
        for name, size in zip(names, sizes, strict=True)
    }


def _drift_by_the_clock(rng: np.random.Generator, subject: Subject) -> dict[str, float]:
    return {"sign": float(rng.choice([-1.0, 1.0])), "by_temperature": 0.0}


def _recorded(options: Options, protocols: Sequence[Protocol], seed: int) -> tuple[Recording, ...]:
    with machine_of(options, seed) as machine:
        return tuple(machine.run(protocol) for protocol in protocols)


__all__ = ["EFFECTS", "HiddenCase", "HiddenEffect", "hide"]
