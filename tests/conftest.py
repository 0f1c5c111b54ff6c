"""What every room's tests share: where the measured files lie, and how Hypothesis runs."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from importlib import import_module
from importlib.metadata import EntryPoint
from pathlib import Path
from types import ModuleType

import pytest
from hypothesis import HealthCheck, settings
from hypothesis.internal.conjecture import providers

settings.register_profile(
    "ci",
    max_examples=50,  # HYPOTHESIS_PROFILE=bank draws twenty times as many, of the laws that say no number of their own
    derandomize=True,
    deadline=None,
    print_blob=True,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.register_profile("bank", settings.get_profile("ci"), max_examples=1000)
settings.register_profile("dev", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "ci"))

# Hypothesis mixes constants that it finds in the loaded modules of a project into its examples. Which modules are
# loaded depends on which tests ran before: a derandomised test would draw other examples from run to run.
if hasattr(providers, "_get_local_constants"):
    providers._get_local_constants = lambda: providers._local_constants

# Told to write no bytecode, each program that a test starts would compile all of the project's modules anew.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# Of several workers each has a core: threads of one would wait for those of another.
if "PYTEST_XDIST_WORKER" in os.environ:
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

ROOT = Path(__file__).resolve().parent.parent


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--measured",
        default=os.environ.get("SMARTSHOE_MEASURED", str(ROOT.parent / "shared" / "data")),
        help="folder of the measured files (default: $SMARTSHOE_MEASURED, else ../shared/data)",
    )
    parser.addoption("--shoe-url", default=None, help="a real shoe for the tests marked hardware")


def pytest_configure(config: pytest.Config) -> None:
    if not hasattr(config, "workerinput"):  # of one process, or the one that starts the workers
        _require_unique_names(ROOT / "tests")
    else:
        from smartshoe.kernels._once import compile_each_kernel_once

        compile_each_kernel_once()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> object:
    """Give each worker whole folders until one runs dry: what a file's tests share is made once, not in each."""
    from xdist.scheduler import WorkStealingScheduling

    return WorkStealingScheduling(config, log)


def _require_unique_names(tests: Path) -> None:
    """Refuse two files of one name: tests are modules without packages, and the second would be taken for the first."""
    files: dict[str, list[str]] = {}
    for path in sorted(tests.rglob("*.py")):
        if path.name != "conftest.py":
            files.setdefault(path.name, []).append(str(path.relative_to(tests.parent)))
    twice = [" and ".join(paths) for paths in files.values() if len(paths) > 1]
    if twice:
        raise pytest.UsageError(
            f"files of tests need names that differ over all folders: rename one of {'; '.join(twice)}"
        )


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption("--shoe-url") is None:
        skip = pytest.mark.skip(reason="needs --shoe-url")
        for item in items:
            if "hardware" in item.keywords:
                item.add_marker(skip)
    off = {
        "bank": "a long bank",
        "benchmark": "figures against peers",
        "site": "builds the documentation",
        "long": "a further case of what others ask",
    }
    asked = config.getoption("-m") or ""
    for item in items:
        mark = next((one for one in off if one in item.keywords), None)  # a bank's case is that, also of a long law
        if mark is not None and mark not in asked:
            item.add_marker(pytest.mark.skip(reason=f"{off[mark]}: run it with -m {mark}"))


@pytest.fixture(scope="session")
def measured(request: pytest.FixtureRequest) -> Path:
    """The folder of real measurements, which is not part of the project."""
    folder = Path(request.config.getoption("--measured"))
    if not folder.is_dir():
        pytest.skip(f"no measured files at {folder}: give --measured")
    return folder


@pytest.fixture(scope="session")
def root() -> Path:
    """The checkout."""
    return ROOT


@pytest.fixture
def forget_effects() -> Callable[[], None]:
    """Makes the catalogue of effects be made anew when it is next asked for, of what is installed by then."""
    catalogue_module = import_module("smartshoe.models.effects.catalogue")  # the package has a function of this name

    def forget() -> None:
        for made in ("_offers", "_found", "catalogue", "blocks"):
            getattr(catalogue_module, made).cache_clear()

    return forget


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch, forget_effects: Callable[[], None]) -> Iterator[ModuleType]:
    """The module of a package that offers its names in capitals as effects."""
    module = ModuleType("another_package")
    monkeypatch.setitem(sys.modules, "another_package", module)

    def offered(group: str) -> tuple[EntryPoint, ...]:
        return tuple(EntryPoint(name, f"another_package:{name}", group) for name in vars(module) if name[0].isupper())

    monkeypatch.setattr(import_module("smartshoe.models.effects.catalogue"), "entry_points", offered)
    forget_effects()
    yield module
    monkeypatch.undo()
    forget_effects()
